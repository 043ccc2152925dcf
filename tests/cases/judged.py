"""The judge: on random decks, and on a stored result after somebody has changed it."""

import shutil
import subprocess
import sys

import h5py
from program import PROGRAM, SOURCE

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


def judge_decks(family, *options):
    """Run the judge on decks of a family; its status is 0 if all are right, or rightly refused."""
    return subprocess.run(
        [sys.executable, "-B", str(SOURCE / "tests" / "judge" / "judge.py"),
         "--bipot", PROGRAM, "--family", family, *options],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
