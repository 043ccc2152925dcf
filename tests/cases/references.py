"""Solutions on meshes that are too fine to be solved at every test: tests/data/references.json.

Each is what the program found of a scene that a test describes. BIPOT_LONG=1 solves them again and
holds the file against what is found; BIPOT_KEEP_REFERENCES=1 writes it, too.
"""

import json
import os

import numpy as np
from program import DATA

FILE = DATA / "references.json"
LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")
KEEP = os.environ.get("BIPOT_KEEP_REFERENCES", "") not in ("", "0")
# Of the largest value. They are solved to 1e-6 of the largest resultant, of which a component may
# be a tenth; any error that is compared with them is hundreds of times larger.
AGREEMENT = 1e-5


def rounded(values):
    """Return an array as lists of numbers with eleven digits."""
    return np.vectorize(lambda x: float(f"{x:.11g}"))(values).tolist()


def write(kept):
    """Write the file, an array a line."""
    parts = []
    for name, arrays in sorted(kept.items()):
        lines = ",\n".join(f'  "{key}": {json.dumps(values)}' for key, values in arrays.items())
        parts.append(f' "{name}": {{\n{lines}\n }}')
    FILE.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


def reference(name, solve):
    """Return the kept arrays of a name; `solve` returns them where they are to be found again."""
    kept = json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else {}
    if LONG or KEEP:
        found = {key: np.asarray(values) for key, values in solve().items()}
        if KEEP:
            kept[name] = {key: rounded(values) for key, values in found.items()}
            write(kept)
        for key, values in found.items():
            np.testing.assert_allclose(
                kept[name][key], values, rtol=0, atol=AGREEMENT * abs(values).max(), err_msg=name
            )
    return {key: np.array(values) for key, values in kept[name].items()}
