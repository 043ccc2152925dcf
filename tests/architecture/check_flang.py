#!/usr/bin/env python3
"""Have flang read the source: gfortran takes some of what is no standard Fortran.

    check_flang.py [SRC]

All rooms of src/CMakeLists.txt below `hdf5`, whose modules gfortran wrote. Prints what flang says
of each file that it refuses, and nothing of files that use such a one. flang is the command that
the environment names (FLANG), or else flang-new-19, flang-new or flang, found on the PATH; without
one the exit status is 77, a skip for CTest. `scripts/test --full flang` runs it, and a job of CI.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from check_layers import rooms_of

NAMES = ("flang-new-19", "flang-new", "flang")
INCLUDED = ("/usr/include", "/usr/include/mumps_seq", "/usr/include/MUMPS")  # of MUMPS


def compiler() -> str | None:
    """Return the command of flang, None where there is none."""
    named = os.environ.get("FLANG")
    return named or next((found for name in NAMES if (found := shutil.which(name))), None)


def count_refused(flang: str, src: Path, paths: list[str]) -> tuple[int, int]:
    """Print what flang says of files that it refuses; count them, and those that use such a one."""
    refused: set[str] = set()
    unread = 0
    with tempfile.TemporaryDirectory() as modules:
        command = [flang, "-fsyntax-only", "-J", modules, *(f"-I{path}" for path in INCLUDED)]
        for path in paths:
            text = (src / path).read_text(encoding="utf-8")
            module = Path(path).stem + "_mod"
            if refused.intersection(re.findall(r"^ *use (\w+)", text, re.MULTILINE)):
                refused.add(module)
                unread += 1
                continue
            # One file is preprocessed.
            options = ["-cpp"] if re.search(r"^#if", text, re.MULTILINE) else []
            done = subprocess.run(
                [*command, *options, path], cwd=src, capture_output=True, text=True, check=False
            )
            if done.returncode != 0:
                refused.add(module)
                print(done.stderr, end="", flush=True)
    return len(refused) - unread, unread


def main(arguments: list[str]) -> int:
    """Read the source; return 1 where flang refuses a file of it."""
    src = Path(arguments[0]) if arguments else Path(__file__).resolve().parents[2] / "src"
    flang = compiler()
    if flang is None:
        print(f"skipped: none of {', '.join(NAMES)} is installed")
        return 77
    rooms = rooms_of((src / "CMakeLists.txt").read_text(encoding="utf-8"))
    names = [room.name for room in rooms]
    paths = [path for room in rooms[: names.index("hdf5")] for _, path in room.files]
    n_refused, unread = count_refused(flang, src, paths)
    if n_refused > 0:
        print(f"{n_refused} of {len(paths)} files are refused, {unread} that use them not read")
        return 1
    print(f"{flang} reads all {len(paths)} files below hdf5")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
