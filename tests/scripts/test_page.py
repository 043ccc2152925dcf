"""The page of `scripts/show --html`: well-formed, with the file's numbers, nothing outside it.

With Chromium (or Chrome) on the PATH, or named by CHROMIUM, the page is loaded there too.
"""

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from unittest.mock import patch

try:
    import h5py
    import matplotlib as mpl
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

import synthetic_result  # noqa: E402
from bipot.page import CERTIFIED, brief, folded, make_page, number, short  # noqa: E402
from bipot.result import Result  # noqa: E402
from package import ROOT, WithFolder, bipot  # noqa: E402

mpl.use("Agg")
VOID = {"meta", "link", "img", "br", "hr"}
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
CHROMIUM = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, BROWSERS)), None)


class Page(HTMLParser):
    """A page's elements; raises AssertionError where they are not nested."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.elements, self.tables, self.words = [], [], {}, []
        self.feed(text)
        self.close()
        if self.open:
            raise AssertionError(f"not closed: {self.open}")

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.table = self.tables.setdefault(dict(attributes).get("id"), [])
        if tag == "tr":
            self.table.append([])
        if tag in ("td", "th"):
            self.table[-1].append("")

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            raise AssertionError(f"</{tag}> at line {self.getpos()[0]}")

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.table[-1][-1] += data
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


def vector(text):
    """Return the numbers of "(1, 2, 3)"."""
    return [float(part) for part in text.strip("()").split(",")]


class OfARun(WithFolder):
    """The page of a run of the paper's block."""

    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.result = cls.enterClassContext(
            bipot.run(ROOT / "input" / "block.inp", n=1, steps=10, quiet=True, directory=folder)
        )
        cls.text = make_page(cls.result)
        cls.page = Page(cls.text)

    def test_it_says_what_was_run(self):
        words = " ".join(" ".join(self.page.words).split())
        run = self.result.run
        for said in ("The block of Joli, Feng and Talbi (2007)", run["version"], run["started"],
                     run["status"], "All 10 increments are certified."):
            self.assertIn(said, words)
        plan = " ".join(self.result.run_text("plan").split())
        self.assertIn(plan, words)
        self.assertIn("*OBSTACLE, NAME=GROUND", words)

    def test_its_numbers_are_those_of_the_file(self):
        head, *rows = self.page.tables["certificates"]
        entries = self.result.certificate
        self.assertEqual(head, ["increment", "at", "certified", *entries])
        self.assertEqual(len(rows), self.result.finished)
        for row, line in enumerate(rows):
            said = [str(row + 1), self.result.label(row),
                    CERTIFIED[int(self.result.history("certified")[row])]]
            self.assertEqual(line[:3], said)
            for text, values in zip(line[3:], entries.values(), strict=True):
                self.assertEqual(text, brief(values[row]))
                self.assertAlmostEqual(float(text), values[row], delta=5e-2 * abs(values[row]))
        _, *rows = self.page.tables["resultants"]
        pair = self.result.pairs[0]
        total = self.result.history("error/total")
        for row, line in zip(self.result.step_ends, rows, strict=True):
            # To the digits that the error leaves: normal force and friction are the resultant.
            (normal, error), (friction, _) = (text.split(" ± ") for text in line[2:4])
            force, error = np.array([vector(normal), vector(friction)]).sum(axis=0), float(error)
            largest = np.linalg.norm(pair.resultant[row])
            self.assertAlmostEqual(error, total[row] * largest, delta=0.06 * error)
            np.testing.assert_allclose(force, pair.resultant[row], rtol=0, atol=error)
            self.assertFalse([text for text in line[4:6] if "±" in text])  # not estimated
            self.assertEqual([int(text) for text in line[8:]],
                             np.bincount(pair.status[row], minlength=3).tolist())
        _, *rows = self.page.tables["estimates"]
        known = self.result.history("error/total") >= 0
        self.assertEqual(len(rows), known.sum())
        last = dict(zip(self.page.tables["estimates"][0], rows[-1], strict=True))
        self.assertEqual(last["mesh"], short(self.result.history("error/mesh")[-1]))
        done = {line[0]: line[1:] for line in self.page.tables["counters"][1:]}
        self.assertEqual(done["equations"],
                         [number(self.result.estimates["equations"]),
                          number(self.result.counters["equations"])])

    def test_the_tolerance_is_that_of_the_run(self):
        allowed = self.result.counters["certificate_tolerance"]
        self.assertAlmostEqual(allowed, 10 * 1e-10, delta=1e-15)  # TOLERANCE of the deck
        run = dict(row for row in self.page.tables["run"])
        self.assertIn(f"(allowed: {short(allowed)})", run["worst error of the certificate"])
        self.assertGreater(allowed, self.result.worst_error)

    def test_the_plan_is_a_table(self):
        rows = self.page.tables["plan-table"][1:]
        names = [row[0] for row in rows]
        self.assertLessEqual({"mesh", "equations", "contact", "memory", "time"}, set(names))
        self.assertEqual(rows[names.index("mesh")][1:], ["fixed", "8 nodes, 1 elements"])

    def test_numbers_in_the_least_room(self):
        self.assertEqual([brief(x) for x in (1.16e-9, 0.0, 1.0, 2.5e12, -1.0)],
                         ["1.2e-9", "0", "1", "2.5e12", "-1"])

    def test_includes_are_folded(self):
        lines = ["*HEADING", "** *INCLUDE, INPUT=a.inp", "1, 2", "** *include, input=b.inp",
                 "3 < 4", "** end of b.inp", "** end of a.inp", "*STEP"]
        page = Page(folded(lines))
        self.assertEqual([tag for tag, _ in page.elements],
                         ["pre", "details", "summary", "pre", "details", "summary", "pre", "pre"])
        words = [text.strip() for text in page.words if text.strip()]
        self.assertEqual(words, ["*HEADING", "*INCLUDE, INPUT=a.inp  (4 lines)", "1, 2",
                                 "*include, input=b.inp  (1 lines)", "3 < 4", "*STEP"])
        # Of an older program, that marked no ends.
        self.assertEqual([tag for tag, _ in Page(folded(lines[:3])).elements], ["pre"])
        long = Page(folded([f"{k}, 0." for k in range(1000)]))
        self.assertIn("... and 600 more lines", " ".join(long.words))

    def test_includes_of_a_run_are_folded(self):
        (self.folder / "body.inp").write_text("*NSET, NSET=NONE\nBODY-ZMIN\n")
        text = (ROOT / "input" / "block.inp").read_text()
        (self.folder / "main.inp").write_text(
            text.replace("*MATERIAL", "*INCLUDE, INPUT=body.inp\n*MATERIAL", 1))
        with bipot.run("main.inp", n=1, steps=5, quiet=True) as result:
            page = Page(folded(result.run_text("deck").splitlines()))
        self.assertEqual([tag for tag, _ in page.elements],
                         ["pre", "details", "summary", "pre", "pre"])
        self.assertIn("*INCLUDE, INPUT=body.inp  (2 lines)", page.words)

    def test_everything_is_in_it(self):
        for attribute in ("src", "href"):
            for tag, attributes in self.page.elements:
                target = attributes.get(attribute)
                self.assertTrue(target is None or target[:1] == "#" or target[:5] == "data:",
                                f"<{tag}> {attribute} {str(target)[:60]}")
        self.assertNotIn("script", [tag for tag, _ in self.page.elements])
        self.assertNotRegex(self.text, r"url\(|@import|https?://")
        pictures = self.page.all("img")
        self.assertEqual(len(pictures), 5)  # deformed, pressure, contact, forces, errors
        for picture in pictures:
            data = base64.b64decode(picture["src"].removeprefix("data:image/png;base64,"))
            self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
            self.assertGreater(len(picture["alt"]), 20)

    def test_it_is_accessible(self):
        self.assertEqual(self.page.all("html"), [{"lang": "en"}])
        keys = [attributes["id"] for _, attributes in self.page.elements if "id" in attributes]
        self.assertEqual(len(keys), len(set(keys)))
        for link in self.page.all("a"):
            self.assertIn(link["href"].removeprefix("#"), keys)
        for section in self.page.all("section"):
            self.assertIn(section["aria-labelledby"], keys)
        heads = [tag for tag, _ in self.page.elements if re.fullmatch(r"h\d", tag)]
        self.assertEqual(heads[0], "h1")
        self.assertEqual(set(heads[1:]), {"h2"})
        self.assertTrue(all(th.get("scope") in ("col", "row") for th in self.page.all("th")))
        self.assertEqual(len(self.page.all("table")), len(self.page.all("caption")))

    @unittest.skipIf(CHROMIUM is None, "no Chromium on the PATH")
    def test_chromium_shows_it(self):
        path = self.folder / "block.html"
        path.write_text(self.text, encoding="utf-8")
        for width in (800, 1400):
            dom = browse(path, self.folder, width)
            self.assertEqual(dom["errors"], [])
            self.assertEqual(len(dom["pictures"]), 5)
            self.assertTrue(all(width > 100 for width in dom["pictures"]), dom["pictures"])
            self.assertEqual(dom["requests"], [])
            # Pictures have their size, or that of narrower text; no table is cut off, and nothing
            # makes the page wider than the window.
            self.assertEqual(dom["shown"], [min(wide, dom["text"]) for wide in dom["pictures"]])
            self.assertLessEqual(dom["page"], width)
            self.assertEqual(dom["cut"], [])

    @unittest.skipIf(CHROMIUM is None, "no Chromium on the PATH")
    def test_what_is_wrong_with_a_page_is_seen(self):
        path = self.folder / "wrong.html"
        path.write_text('<!DOCTYPE html><img src="data:image/png;base64,AAAA">'
                        '<img src="http://127.0.0.1:9/none.png"><script>console.error("wrong")</script>')
        dom = browse(path, self.folder)
        self.assertTrue(any("wrong" in line for line in dom["errors"]), dom["errors"])
        self.assertEqual(dom["pictures"], [0, 0])
        self.assertEqual(dom["requests"], ["http://127.0.0.1:9/none.png"])


def browse(path, folder, width=1000):
    """Load a page in Chromium; return console errors, widths of its pictures and its requests.

    Likewise widths in a window of `width`: `shown` of the pictures, `text`, `page`, and the names
    of the tables that are `cut` off.

    A frame in a page of this test's own holds it, and asks it what it has loaded.
    """
    asking = folder / "asking.html"
    asking.write_text(f"""<!DOCTYPE html><html><body><pre id="said"></pre>
<iframe id="frame" src="{path.as_uri()}" width="{width}" height="800"></iframe>
<script>
window.addEventListener("load", () => {{
  const page = document.getElementById("frame").contentDocument;
  const widths = Array.from(page.images, image => image.complete ? image.naturalWidth : -1);
  const asked = page.defaultView.performance.getEntriesByType("resource").map(one => one.name);
  document.getElementById("said").textContent = JSON.stringify({{
    pictures: widths, requests: asked.filter(name => !name.startsWith("data:")),
    shown: Array.from(page.images, image => Math.round(image.getBoundingClientRect().width)),
    text: Math.round((page.querySelector("main") || page.body).getBoundingClientRect().width),
    page: page.documentElement.scrollWidth,
    cut: Array.from(page.querySelectorAll(".wide"))
      .filter(one => one.scrollWidth > one.clientWidth + 1)
      .map(one => one.querySelector("table").id),
  }});
}});
</script></body></html>""", encoding="utf-8")
    done = subprocess.run(
        [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
         f"--user-data-dir={folder / 'profile'}", "--no-first-run", "--disable-sync",
         "--disable-background-networking", "--disable-component-update", "--disable-extensions",
         "--host-resolver-rules=MAP * ~NOTFOUND", "--allow-file-access-from-files",
         "--enable-logging=stderr", "--v=0", "--virtual-time-budget=10000", "--dump-dom",
         asking.as_uri()],
        capture_output=True, text=True, timeout=600, check=False,
    )
    said = re.search(r'<pre id="said">([^<]*)</pre>', done.stdout)
    if said is None:
        raise AssertionError(f"Chromium showed nothing: {done.stdout[:500]} {done.stderr[-2000:]}")
    return {
        **json.loads(unescape(said[1])),
        "errors": [line for line in done.stderr.splitlines() if "CONSOLE" in line],
    }


class OfAnAccuracy(WithFolder):
    """The page of a run that reached an accuracy says what its runs say, and nothing else."""

    def test_errors_are_those_of_the_runs(self):
        result = bipot.run(ROOT / "input" / "block.inp", n=2, steps=5, quiet=True, accuracy=0.2,
                           nlgeom="no", directory=self.folder)
        self.addCleanup(result.close)
        with patch("bipot.page.pictures", return_value=""):
            page = Page(make_page(result))
        runs = result.accuracy
        self.assertTrue(runs.reached)
        words = " ".join(" ".join(page.words).split())
        self.assertIn(f"mesh {short(runs.mesh)}, load steps {short(runs.load_steps)}", words)
        self.assertIn("0.2 was asked for and is reached", words)
        head, *rows = page.tables["estimates"]
        self.assertEqual([int(row[1]) for row in rows], runs.elements.tolist())
        self.assertNotIn("mesh", head)


class Written(WithFolder):
    """What the command writes."""

    def show(self, *arguments):
        return subprocess.run(
            [sys.executable, ROOT / "scripts" / "show", *arguments], capture_output=True,
            text=True, check=False,
        )

    def test_one_file(self):
        synthetic_result.write(self.folder / "small.vtkhdf")
        done = self.show("small.vtkhdf", "--html", "-o", "pages")
        self.assertEqual((done.returncode, done.stderr, done.stdout),
                         (0, "", "pages/small.html\n"))
        self.assertEqual(sorted(p.name for p in self.folder.rglob("*")),
                         ["pages", "small.html", "small.vtkhdf"])
        page = Page((self.folder / "pages" / "small.html").read_text(encoding="utf-8"))
        self.assertEqual(len(page.all("img")), 6)  # stress too

    def test_what_a_deck_says_stays_words(self):
        path = self.folder / "small.vtkhdf"
        synthetic_result.write(path)
        with h5py.File(path, "r+") as file:
            del file["run/deck"]
            file["run/deck"] = np.bytes_('*HEADING\n<script>alert("&")</script>\n')
            file["run/notes"] = np.bytes_("note: a < b & c\n")
            file["history/certified"][1] = 0
            file["run"].attrs["status"] = np.bytes_("not solved")
        with Result(path) as result, patch("bipot.page.pictures", return_value=""):
            text = make_page(result)
        page = Page(text)
        self.assertNotIn("script", [tag for tag, _ in page.elements])
        words = " ".join(page.words)
        for said in ('<script>alert("&")</script>', "a < b & c",
                     "2 of 3 increments are certified.", "not certified: increments 2",
                     "the run's status is 'not solved'"):
            self.assertIn(said, words)
        self.assertEqual([row[2] for row in page.tables["certificates"][1:]], ["yes", "no", "yes"])


if __name__ == "__main__":
    unittest.main()
