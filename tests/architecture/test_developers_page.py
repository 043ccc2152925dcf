#!/usr/bin/env python3
"""docs/developers.md names files and rooms of src/ that are there, and all rooms."""

from __future__ import annotations

import re
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from check_layers import rooms_of

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "developers.md").read_text(encoding="utf-8")


class DevelopersPage(unittest.TestCase):
    def test_files_that_are_named_are_there(self) -> None:
        named = sorted(set(re.findall(r"`(src/[\w./]+)`", PAGE)))
        self.assertGreater(len(named), 30)
        self.assertEqual([path for path in named if not (ROOT / path).exists()], [])

    def test_the_table_has_every_room(self) -> None:
        section = PAGE.split("## The layers", 1)[1].split("\n## ", 1)[0]
        rooms = re.findall(r"^\| `([\w/]+)` \|", section, re.MULTILINE)
        listed = rooms_of((ROOT / "src" / "CMakeLists.txt").read_text(encoding="utf-8"))
        self.assertEqual(rooms, [room.name for room in listed])
        folders = {path.parent.relative_to(ROOT / "src") for path in ROOT.glob("src/**/*.f90")}
        self.assertEqual({folder.as_posix() for folder in folders}, set(rooms))

    def test_links_within_the_page_lead_somewhere(self) -> None:
        def anchor(heading: str) -> str:
            return re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-")

        for path, wanted in re.findall(r"\]\(([\w.]*)#([^)]+)\)", PAGE):
            text = (ROOT / "docs" / path).read_text(encoding="utf-8") if path else PAGE
            anchors = {anchor(line) for line in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}
            self.assertIn(wanted, anchors)
        for path in re.findall(r"\]\(([\w./]+\.md)", PAGE):
            self.assertTrue((ROOT / "docs" / path).is_file(), path)


if __name__ == "__main__":
    unittest.main()
