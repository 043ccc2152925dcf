"""Pages: every link leads somewhere, every file named is there, every study has its line."""

import os
import re
import subprocess
import sys
import unittest
from functools import cache
from pathlib import Path

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
LINK = re.compile(r"\]\(([^)\s]+)\)")
# A name with a pattern in it (*, NAME) names no file.
FILE = re.compile(r"`((?:docs|input|scripts|src|studies|tests)/[\w./-]+)(?: [^`]*)?`")
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("studies/**/*.md")])
# Some studies need these, and not every machine has them.
ABSENT = re.compile(r"No module named '(h5py|matplotlib|numpy|scipy)")


@cache
def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    return {
        re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        for heading in re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    }


class Links(unittest.TestCase):
    """Links and names of files in all pages."""

    def test_every_link_leads_to_a_file_and_a_heading(self):
        self.assertGreater(len(PAGES), 20)
        wrong = []
        for page in PAGES:
            for link in LINK.findall(page.read_text(encoding="utf-8")):
                if re.match(r"[a-z]+:", link):
                    continue
                name, _, anchor = link.partition("#")
                target = (page.parent / name).resolve() if name else page
                if not target.exists() or (anchor and anchor not in anchors(target)):
                    wrong.append(f"{page.relative_to(ROOT)}: {link}")
        self.assertEqual(wrong, [])

    def test_every_file_named_is_there(self):
        wrong = [
            f"{page.relative_to(ROOT)}: {name}"
            for page in PAGES for name in FILE.findall(page.read_text(encoding="utf-8"))
            if not (ROOT / name).exists()
        ]
        self.assertEqual(wrong, [])


class Studies(unittest.TestCase):
    """What runs, what is listed, and what it makes."""

    def setUp(self):
        self.table = (ROOT / "studies" / "README.md").read_text(encoding="utf-8")

    def run_study(self, *words):
        """Run studies/run from another folder."""
        return subprocess.run(
            [sys.executable, "-B", ROOT / "studies" / "run", *words], cwd="/", text=True,
            capture_output=True, check=False,
        )

    def test_every_study_has_a_line_and_shows_its_options(self):
        names = re.findall(r"^\| `(\w+)` \|", self.table, re.MULTILINE)
        listed = re.findall(r"^  (\w+) {2,}\S", self.run_study().stdout, re.MULTILINE)
        self.assertEqual(listed, names)
        for name in names:
            done = self.run_study(name, "--help")
            if ABSENT.search(done.stderr):
                continue
            self.assertEqual(done.returncode, 0, f"{name}: {done.stderr}")
            self.assertTrue(done.stdout.startswith(f"usage: run {name} "), done.stdout)

    def test_every_page_has_a_study(self):
        for page in (ROOT / "docs" / "studies").glob("*.md"):
            self.assertIn(f"](../docs/studies/{page.name})", self.table)

    def test_every_figure_is_on_a_page(self):
        shown = "".join(page.read_text(encoding="utf-8") for page in PAGES)
        for figure in (ROOT / "docs" / "studies" / "figures").iterdir():
            self.assertIn(f"figures/{figure.name})", shown)

    def test_an_unknown_study_is_refused(self):
        done = self.run_study("nothing")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no study 'nothing', expected one of accuracy, arithmetic,", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
