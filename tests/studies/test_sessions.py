"""The commands on the pages of options and of plans run, and print what the pages show.

So do those of README.md and of the tutorial, in files of their own.
"""

import re
import unittest

from page_test import PageTest
from study import ROOT

from studies.sessions import PAGES, alike, difference, sessions_of, shortened

# Commands outside sessions: these are run by other tests, or install something.
ELSEWHERE = re.compile(
    r"scripts/(test|run DECK|run --(mpi|iterative)|wheel|sanitize|lint)\b"
    r"|pip install|apt install|apt-get"
)
COMMAND = re.compile(
    r"^ *(?:\$ )?((?:build/)?bipot (?!\d)\S.*|scripts/\w+\b.*|studies/run.*)$", re.MULTILINE
)
FENCED = re.compile(r"^```\w*\n(.*?)^```|(^ {4}[^\n]*\n)", re.DOTALL | re.MULTILINE)
RUN = """\
bipot 0.1.0: a block
memory          about    150 MB (24.6 GB free)
time            about    1.1 s of CPU time: factorise 0.4 s
   2    40           2       5       0     284   3      9.0E-11   0.01  50 of 50
50 of 50 increments certified to 1e-9, worst error 1.3e-10 (increment 36), 0.97 s: fine.vtkhdf
""".splitlines()


class Sessions(PageTest):
    """Every page in a folder of its own, its commands one after the other."""

    def test_options(self):
        self.check("docs/options.md")

    def test_plan(self):
        self.check("docs/plan.md")

    def test_every_command_is_in_a_session(self):
        for name in PAGES:
            page = (ROOT / name).read_text(encoding="utf-8")
            run = {command.words for session in sessions_of(page) for command in session}
            code = "".join(fenced or indented for fenced, indented in FENCED.findall(page))
            for words in COMMAND.findall(code):
                command = words.split("  ")[0]
                self.assertTrue(command in run or ELSEWHERE.match(command), f"{name}: {command}")


class Comparison(unittest.TestCase):
    """What counts as the same, and what does not."""

    def test_the_machine_does_not_matter(self):
        other = [
            RUN[0], RUN[1].replace("150 MB (24.6", "151 MB (3.1"),
            RUN[2].replace("1.1 s", "12 s").replace("0.4 s", "0.9 s"),
            RUN[3].replace("3      9.0E-11", "4      1.0E-10").replace("0.01", "1.72"),
            RUN[4].replace("1.3e-10 (increment 36), 0.97", "2e-11 (increment 4), 31"),
        ]
        self.assertIsNone(difference(RUN, other))

    def test_the_result_matters(self):
        changes = (
            ("a block", "a bloc"), ("50 of 50", "49 of 50"), ("284", "280"),
            ("fine.vtkhdf", "fin.vtkhdf"), ("1.3e-10", "1.3e-6"), ("certified", "finished"),
        )
        for old, new in changes:
            with self.subTest(new=new):
                self.assertIsNotNone(difference(RUN, [line.replace(old, new) for line in RUN]))

    def test_lines_left_out(self):
        shown = [RUN[0], "...", RUN[4]]
        self.assertIsNone(difference(shown, RUN))
        self.assertEqual(shortened(shown, RUN), shown)
        self.assertEqual(difference([RUN[0], "...", "the end"], RUN), "the end")
        self.assertIn("more was printed", difference(RUN[:2], RUN))
        self.assertIsNotNone(difference([*RUN, "and so on"], RUN))
        self.assertIsNone(difference([RUN[0], "..."], RUN))

    def test_numbers(self):
        self.assertTrue(alike("mesh 5.1 %, load steps 0.21 %", "mesh 5.12 %, load steps 0.211 %"))
        self.assertFalse(alike("mesh 5.1 %", "mesh 5.9 %"))
        self.assertFalse(alike("289 points", "288 points"))

    def test_sessions_are_found(self):
        page = "text\n\n```console\n$ a -b\none\n\ntwo\n$ c\n```\n\n```\n$ no session\n```\n"
        (session,) = sessions_of(page)
        self.assertEqual([c.words for c in session], ["a -b", "c"])
        self.assertEqual([c.shown for c in session], [["one", "", "two"], []])


if __name__ == "__main__":
    unittest.main()
