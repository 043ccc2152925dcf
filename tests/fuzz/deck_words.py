#!/usr/bin/env python3
"""Print the words of all decks of the repository as a dictionary for AFL++."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

words = set()
for path in [*ROOT.glob("input/*.inp"), *ROOT.glob("tests/deck/*/*.inp")]:
    for line in path.read_bytes().decode("latin-1").splitlines():
        if line.startswith("**"):
            continue
        for word in re.split(r"[,=<>]", line):
            if re.fullmatch(r"\*?[A-Za-z][A-Za-z0-9 -]{1,30}", word.strip()):
                words.add(word.strip())
print("\n".join(f'"{word}"' for word in sorted(words)))
