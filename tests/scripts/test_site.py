"""What scripts/site makes of the pages before Sphinx takes them."""

import importlib.machinery
import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE)]

from package import ROOT  # noqa: E402
from test_page import CHROMIUM, browse  # noqa: E402

LOADER = importlib.machinery.SourceFileLoader("site_script", str(ROOT / "scripts" / "site"))
SPEC = importlib.util.spec_from_loader("site_script", LOADER)
site = importlib.util.module_from_spec(SPEC)
sys.dont_write_bytecode = True
LOADER.exec_module(site)


class Pages(unittest.TestCase):
    """All pages are there, and their links are among them."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        changed = patch.object(site, "PAGES", Path(holder.name) / "pages")
        changed.start()
        self.addCleanup(changed.stop)
        site.put_pages()

    def test_links_lead_to_pages(self):
        wrong = []
        for page in site.PAGES.glob("**/*.md"):
            text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
            for target in re.findall(r"\]\(([^) ]+)\)", text):
                name = target.partition("#")[0]
                if re.match(r"[a-z]+:", target) or not name or name.endswith("gallery.md"):
                    continue
                if not (page.parent / name).exists():
                    wrong.append(f"{page.name}: {target}")
        self.assertEqual(wrong, [])

    def test_every_page_has_its_place(self):
        named = {name for names in site.NAVIGATION.values() for name in names}
        named |= {"index.md", "gallery.md", "api.md"}
        there = {page.relative_to(site.PAGES).as_posix() for page in site.PAGES.glob("**/*.md")}
        there = {name for name in there if not name.startswith("studies/")}
        self.assertEqual(there | {"gallery.md", "api.md"}, named)


@unittest.skipUnless(os.environ.get("BIPOT_LONG", "") not in ("", "0"), "with BIPOT_LONG")
@unittest.skipIf(CHROMIUM is None, "no Chromium on the PATH")
class Browsed(unittest.TestCase):
    """A browser shows pages of the site as they are meant."""

    def test_three_pages(self):
        made = subprocess.run([ROOT / "scripts" / "site"], cwd=ROOT, check=False)
        if made.returncode == 77:
            self.skipTest("PyPI cannot be reached")
        self.assertEqual(made.returncode, 0)
        for page in ("index.html", "gallery.html", "deck/obstacles.html"):
            with self.subTest(page), tempfile.TemporaryDirectory() as folder:
                seen = browse(site.SITE / "html" / page, Path(folder), width=1200)
                self.assertEqual(seen["errors"], [])
                self.assertTrue(all(width > 0 for width in seen["pictures"]), seen["pictures"])
                self.assertEqual([one for one in seen["requests"] if "://" in one
                                  and not one.startswith("file:")], [])
                self.assertLessEqual(seen["page"], 1200)
                self.assertEqual(seen["cut"], [])


class Gallery(unittest.TestCase):
    """What the gallery says of a deck is what the repository says."""

    def test_every_deck_shows_something(self):
        shows = dict(site.what_decks_show())
        decks = {path.name for path in (ROOT / "input").glob("*.inp")}
        self.assertEqual(decks - set(shows), set())
        self.assertTrue(shows["ball.inp"].startswith("A rigid sphere"))

    def test_the_beginning_of_a_deck(self):
        lines = ["*HEADING", "A name", "** What it", "** shows", "*PARAMETER", "n = 1", "*NODE",
                 "** no card", *(f"{k}, 0, 0, 0" for k in range(20))]
        self.assertEqual(site.head_of(lines), "> What it\n> shows")
        cards = site.first_cards(lines)
        self.assertEqual(cards[:2], ["*NODE", "0, 0, 0, 0"])
        self.assertEqual((len(cards), cards[-1]), (site.SHOWN + 1, "..."))

    def test_tables(self):
        table = "step  pair  x\n   1  A\nthe end"
        done = SimpleNamespace(returncode=0, stdout="plan\n" + table, stderr="")
        self.assertEqual(site.table_of(done), table)
        done = SimpleNamespace(returncode=2, stdout="plan", stderr="a\nbipot: error: none")
        self.assertEqual(site.table_of(done), "bipot: error: none")


if __name__ == "__main__":
    unittest.main()
