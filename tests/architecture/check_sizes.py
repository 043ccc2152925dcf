#!/usr/bin/env python3
"""Name the files of src over 400 lines and the procedures over 80: they want a second look.

    check_sizes.py [SRC]

A procedure's lines are those from its first statement to its end, without the procedures within it
and the comment above it. Prints `file:line: message`, longest first; the exit status is 0 whatever
it finds, and 1 where there is no Fortran file.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fortran_units import Unit, read_units

FILE_LINES = 400
PROCEDURE_LINES = 80


def own_lines(unit: Unit, units: list[Unit]) -> int:
    """Count the lines of a unit without those of the units within it."""
    inner = sum(u.last - u.first + 1 for u in units if u.host is unit)
    return unit.last - unit.first + 1 - inner


def long_ones(src: Path) -> list[tuple[int, str]]:
    """Return the lines and the message of each file and procedure that is over its limit."""
    found = []
    for path in sorted(src.rglob("*")):
        if path.suffix not in {".f90", ".F90", ".inc"}:
            continue
        place = path.relative_to(src.parent).as_posix()
        lines = len(path.read_text(encoding="utf-8").splitlines())
        if lines > FILE_LINES:
            found.append((lines, f"{place}:1: {lines} lines, over {FILE_LINES}"))
        units = read_units(path)
        for unit in units:
            if unit.kind not in {"subroutine", "function"} or unit.path != path:
                continue
            lines = own_lines(unit, units)
            if lines > PROCEDURE_LINES:
                message = f"{unit.name} has {lines} lines, over {PROCEDURE_LINES}"
                found.append((lines, f"{place}:{unit.first}: {message}"))
    return sorted(found, key=lambda entry: (-entry[0], entry[1]))


def main(arguments: list[str]) -> int:
    """Print what is long; return the exit status."""
    src = Path(arguments[0]) if arguments else Path(__file__).resolve().parents[2] / "src"
    if not any(src.rglob("*.f90")):
        print(f"{src}: no Fortran file")
        return 1
    for _, message in long_ones(src):
        print(message)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
