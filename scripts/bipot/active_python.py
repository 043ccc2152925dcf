"""The Python of an active environment, which the commands of a clone take."""

import os
import sys
from pathlib import Path


def hand_over() -> None:
    """Start again with the Python of the active environment, if this one is another."""
    prefix = os.environ.get("VIRTUAL_ENV") or os.environ.get("CONDA_PREFIX")
    if not prefix or Path(prefix).resolve() == Path(sys.prefix).resolve():
        return
    python = Path(prefix) / "bin" / "python3"
    if python.is_file():
        os.execv(python, [str(python), *sys.argv])
