#!/usr/bin/env python3
"""Name the lines of pages written by hand that have more than 100 columns.

Code, tables, headings and lines that nothing but a link or code makes so long are left out, and so
are the pages that studies write. Prints `file:line: message`; the exit status is 1 where it finds
any.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COLUMNS = 100
WRITTEN_BY_STUDIES = re.compile(r"docs/(studies/.*|theory-error\.md)")
LEFT_OUT = re.compile(r" {4}|#| *\|")  # code, headings, tables
FENCE = re.compile(r"\s*```")
UNBROKEN = re.compile(r"!?\[[^]]*\]\([^)]*\)|`[^`]*`")  # a link, an image or code


def long_lines(text: str) -> list[int]:
    """Return the numbers of the lines of a page that can be broken and are too long."""
    found, in_code = [], False
    for number, line in enumerate(text.splitlines(), 1):
        if FENCE.match(line):
            in_code = not in_code
        elif len(line) > COLUMNS and not in_code and not LEFT_OUT.match(line):
            words = UNBROKEN.sub(lambda unbroken: "x" * len(unbroken[0]), line).split()
            if len(words) > 1 + (words[0] == "-"):
                found.append(number)
    return found


def main() -> int:
    """Print what is too long; return the exit status."""
    folders = ("", ".github/", ".github/*/", "docs/", "docs/*/", "input/", "studies/", "tests/**/")
    pages = {path for folder in folders for path in ROOT.glob(f"{folder}*.md")}
    status = 0
    for path in sorted(pages):
        name = path.relative_to(ROOT).as_posix()
        if WRITTEN_BY_STUDIES.fullmatch(name):
            continue
        for number in long_lines(path.read_text(encoding="utf-8")):
            print(f"{name}:{number}: over {COLUMNS} columns")
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
