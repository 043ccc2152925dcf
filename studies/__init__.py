"""Studies: what measures the program and makes pages of docs/; README.md says which makes what.

    studies/run NAME [options]           from anywhere
    python3 -m studies.NAME [options]    the same, in the repository's root

Here, once for all of them, is where they find the package `bipot` of scripts/.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))
