"""What the judge finds in a stored result after somebody has changed it."""

import shutil
import sys

import h5py
from program import SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

from laws import Judge, Stored


def findings(scene, result, change=None):
    """Return the kinds of findings in a copy of `result` after `change(file)`."""
    path = result.with_name("changed.vtkhdf")
    shutil.copy(result, path)
    if change:
        with h5py.File(path, "r+") as file:
            change(file)
    return {f.kind for f in Judge(scene, Stored(scene, path), True).judge()}
