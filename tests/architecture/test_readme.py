#!/usr/bin/env python3
"""What README.md says is tested: tests/readme.txt names the tests of each of its sentences.

A sentence stands in that table as on the page, without links, stress and line ends; a piece of code
as its first line. Below it, indented, are the names of its tests, as ctest has them, or "no test:"
and why none is needed. `scripts/test` runs these tests.
"""

from __future__ import annotations

import os
import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
TREE = Path(os.environ.get("BIPOT_TREE", ROOT / "build"))
CODE = re.compile(r"^```\w*\n(.*?)^```\n|^((?: {4}[^\n]*\n)+)", re.MULTILINE | re.DOTALL)
NO_TEST = "no test: "


def sentences_of(page: str) -> list[str]:
    """Return what a page says, sentence by sentence: without headings, pictures and tables."""
    found = ["".join(code).splitlines()[0].strip() for code in CODE.findall(page)]
    text = re.sub(r"^(#|!\[|\|).*$", "", CODE.sub("\n", page), flags=re.MULTILINE)
    text = re.sub(r"^- (\*\*[^*]*\*\*)?|\*\*", r"\n\n", text, flags=re.MULTILINE)
    for paragraph in re.split(r"\n\s*\n", text):
        for sentence in re.split(r"(?<=[.!?]) (?=[A-Z`[])", " ".join(paragraph.split())):
            found.append(re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", sentence))
    return list(filter(None, found))


def table_of(text: str) -> dict[str, list[str]]:
    """Return the tests of each sentence, or "no test: why" alone."""
    table: dict[str, list[str]] = {}
    row: list[str] = []
    for line in text.splitlines():
        if line.startswith("    "):
            row += [line.strip()] if line.strip().startswith(NO_TEST) else line.split()
        elif line and not line.startswith("#"):
            row = table.setdefault(line, [])
    return table


def faults(page: str, text: str, tests: set[str]) -> list[str]:
    """Return what is wrong with a table: page, table, the names of all tests."""
    said, table = sentences_of(page), table_of(text)
    found = [f"a sentence without a row: {sentence}" for sentence in said if sentence not in table]
    for sentence, row in table.items():
        if sentence not in said:
            found.append(f"the page does not say: {sentence}")
        if not row:
            found.append(f"neither a test nor a reason: {sentence}")
        if len(row) != 1 or not row[0].startswith(NO_TEST):
            found += [f"there is no test {name}" for name in row if name not in tests]
    return found


class Readme(unittest.TestCase):
    """The page and its table."""

    maxDiff = None

    def test_every_sentence_has_its_tests(self) -> None:
        done = subprocess.run(["ctest", "--test-dir", TREE, "-N"],
                              capture_output=True, text=True, check=True)  # fmt: skip
        tests = set(re.findall(r"^ *Test *#\d+: (\S+)", done.stdout, re.MULTILINE))
        self.assertGreater(len(tests), 100)
        page, table = ((ROOT / path).read_text(encoding="utf-8")
                       for path in ("README.md", "tests/readme.txt"))  # fmt: skip
        self.assertEqual(faults(page, table, tests), [])
        done = subprocess.run(["ctest", "--test-dir", TREE, "-N", "-L", "^readme$"],
                              capture_output=True, text=True, check=True)  # fmt: skip
        labelled = set(re.findall(r"^ *Test *#\d+: (\S+)", done.stdout, re.MULTILINE))
        named = {name for row in table_of(table).values() for name in row if " " not in name}
        self.assertEqual(labelled, {name for name in named if not name.startswith("unit_")})

    def test_faults_are_found(self) -> None:
        page = "# It\n\nIt runs [here](a.md). It\nends.\n\n    $ it\n    4\n\n"
        page += "- **Head.** An item\n  of two.\n"
        table = "# Head\nIt runs here.\n    case_a\nIt ends.\n    no test: it is so\n"
        table += "$ it\n    case_a\nAn item of two.\n    case_a case_b\n"
        tests = {"case_a", "case_b"}
        self.assertEqual(faults(page, table, tests), [])
        for old, new, found in (
            ("It ends.\n", "It stops.\n", ["a sentence without a row: It ends.",
                                           "the page does not say: It stops."]),
            ("case_b", "case_c", ["there is no test case_c"]),
            ("    no test: it is so\n", "", ["neither a test nor a reason: It ends."]),
            ("a case_b", "a\n    no test: it is so", ["there is no test no test: it is so"]),
        ):  # fmt: skip
            with self.subTest(new=new):
                self.assertEqual(faults(page, table.replace(old, new), tests), found)


if __name__ == "__main__":
    unittest.main()
