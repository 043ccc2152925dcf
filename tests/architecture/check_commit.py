#!/usr/bin/env python3
"""Check the message of a commit: a short subject, and a body that says why.

    check_commit.py FILE    a message, as Git gives it to the hook commit-msg

`pre-commit install` has Git call it. Prints what is wrong; the exit status is 1 where anything is.
"""

from __future__ import annotations

import sys
from pathlib import Path

SUBJECT = 72
CUT = "# ------------------------ >8 ------------------------"  # of git commit --verbose
MADE_BY_GIT = ("Merge ", "Revert ", "fixup! ", "squash! ")


def complaints(message: str) -> list[str]:
    """Return what is wrong with a message."""
    lines = message.partition(CUT)[0].splitlines()
    lines = [line.rstrip() for line in lines if not line.startswith("#")]
    while lines and not lines[0]:
        del lines[0]
    if not lines:
        return []  # Git ends the commit
    if lines[0].startswith(MADE_BY_GIT):
        return []
    found = []
    if len(lines[0]) > SUBJECT:
        found.append(f"the subject has {len(lines[0])} characters, at most {SUBJECT} are read")
    if lines[0].endswith("."):
        found.append("the subject ends with a full stop")
    if len(lines) > 1 and lines[1]:
        found.append("the second line is not empty")
    if not any(lines[2:]):
        found.append("no body: say below the subject, after an empty line, why this is done")
    return found


def main() -> int:
    """Check the message in the file that is named."""
    found = complaints(Path(sys.argv[1]).read_text(encoding="utf-8"))
    for words in found:
        print(f"commit message: {words}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
