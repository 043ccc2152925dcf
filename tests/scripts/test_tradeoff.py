"""scripts/tradeoff: a small real study, interruptions, and what it makes of its numbers."""

import argparse
import csv
import io
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from contextlib import redirect_stderr
from pathlib import Path
from unittest.mock import patch

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = Path(os.environ.get("BIPOT", ROOT / "build" / "bipot"))
SCRIPTS = ROOT / "scripts"
DECK = ROOT / "input" / "block.inp"
sys.path.insert(0, str(SCRIPTS))

try:
    import h5py  # noqa: F401
    import matplotlib  # noqa: F401
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

from bipot import tradeoff  # noqa: E402
from bipot.parameter_study import deck_lines  # noqa: E402
from bipot.program import run_block  # noqa: E402
from bipot.result import Result  # noqa: E402
from bipot.tradeoff_settings import changed_deck  # noqa: E402

REFERENCE = "n=4,steps=10,solver=AUTO,local=AUTO"
SMALL = [
    "--vary", "steps=10", "--vary", "n=1,2", "--vary", "tolerance=1e-2,1e-8",
    "--also", "local=UZAWA,rho=3", "--reference", REFERENCE, "--repeat", "2",
]
# A cube on a plane, pressed from above.
PRESSED = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
*ELEMENT, TYPE=C3D8, ELSET=BODY
1, 1, 2, 3, 4, 5, 6, 7, 8
*SURFACE, NAME=FOOT
BODY, S1
*NSET, NSET=TOP
5, 6, 7, 8
*MATERIAL, NAME=SOFT
*ELASTIC
100, 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0, 0, 0, 0, 0, 1
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
FOOT, GROUND
*STEP
*STATIC, DIRECT
0.5, 1
*BOUNDARY
TOP, 1, 2
TOP, 3, 3, -0.005
*END STEP
"""
# Four settings twice; Uzawa beyond the range of rho once each; the reference.
RUNS = 4 * 2 + 4 + 1


def command(folder, *words):
    """Return the words of a study of the block in a folder."""
    return [
        sys.executable, "-B", SCRIPTS / "tradeoff", DECK, *words, "-o", folder,
        "--bipot", PROGRAM,
    ]


def study(folder, *words):
    """Make a study of the block in a folder."""
    return subprocess.run(command(folder, *words), capture_output=True, text=True, check=False)


def rows(folder, name="block-tradeoff.csv"):
    """Return the rows of a csv file."""
    with (Path(folder) / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Small(unittest.TestCase):
    """One small study, read by all tests."""

    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(holder.cleanup)
        cls.folder = Path(holder.name)
        cls.done = study(cls.folder, *SMALL)

    def test_every_run_has_its_line(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        kept = rows(self.folder)
        self.assertEqual(len(kept), RUNS)
        for row in kept:
            if "UZAWA" in row["settings"]:
                self.assertEqual(row["status"], "2", row["settings"])
                self.assertIn("did not reach the tolerance", row["message"])
            else:
                self.assertEqual((row["status"], row["increments"]), ("0", "10"))
                self.assertGreater(float(row["seconds"]), 0)
                self.assertGreater(float(row["memory_bytes"]), 1e6)

    def test_the_table_has_the_error_of_the_resultants(self):
        found = {}
        for n in (2, 4):
            path = self.folder / f"by-hand-{n}.vtkhdf"
            given = {"n": n, "steps": 10, "solver": "AUTO", "local": "AUTO", "tolerance": 1e-10}
            self.assertEqual(run_block(PROGRAM, path, given).returncode, 0)
            with Result(path) as result:
                # 10 increments: 2 down, 8 sideways.
                found[n] = result.pairs[0].reaction[[1, 9]].sum(axis=1)
        expected = abs(found[2] - found[4]).max() / abs(found[4]).max()
        table = rows(self.folder, "block-tradeoff-table.csv")
        fine = [row for row in table if (row["n"], row["tolerance"]) == ("2", "1e-8")]
        solved = next(row for row in fine if row["outcome"] == "solved")
        self.assertAlmostEqual(float(solved["error"]) / expected, 1, delta=2e-3)
        self.assertEqual(solved["certified"], "10")
        self.assertEqual(sum(row["outcome"] == "not solved" for row in table), 4)
        self.assertEqual(len(table), 8)

    def test_words_and_figures(self):
        self.assertRegex(
            self.done.stdout, r"Cheapest: for 10 % n=2.*; for 1 % none of these settings; for 0.1 %"
        )
        self.assertEqual(self.done.stdout.count("not solved"), 4)
        for name in ("time", "memory"):
            size = (self.folder / f"block-tradeoff-{name}.png").stat().st_size
            self.assertTrue(5_000 < size < 100_000, f"{name}: {size} bytes")

    def test_a_finished_study_runs_nothing(self):
        before = (self.folder / "block-tradeoff.csv").read_bytes()
        copy = self.folder / "copy"
        copy.mkdir()
        (copy / "block-tradeoff.csv").write_bytes(before)
        again = study(copy, *SMALL, "--quantity", "energy/strain")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertIn("error of energy/strain", again.stdout)
        self.assertEqual((copy / "block-tradeoff.csv").read_bytes(), before)

    def test_a_result_file_is_a_reference(self):
        folder = self.folder / "file"
        folder.mkdir()
        path = folder / "fine.vtkhdf"
        self.assertEqual(run_block(PROGRAM, path, {"n": 2, "steps": 10}).returncode, 0)
        done = study(
            folder, "--vary", "n=1,2", "--vary", "steps=10", "--vary", "tolerance=1e-8",
            "--reference", path,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        table = rows(folder, "block-tradeoff-table.csv")
        errors = {row["n"]: float(row["error"]) for row in table}
        self.assertLess(errors["2"], 1e-7)
        self.assertGreater(errors["1"], 1e-2)

    def test_a_deck_alone_is_studied_by_itself(self):
        """A block that is pressed: all kinds of settings, a reference that tells its error."""
        folder = self.folder / "alone"
        folder.mkdir()
        deck = folder / "pressed.inp"
        deck.write_text(PRESSED, encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-B", SCRIPTS / "tradeoff", deck, "-o", folder, "--bipot", PROGRAM],
            capture_output=True, text=True, check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"--nlgeom=yes,--refine=3,--type=C3D8I \(its own error: "
                                      r"mesh [\d.e-]+ %, load steps [\d.e-]+ %\)")
        table = rows(folder, "pressed-tradeoff-table.csv")
        found = {tuple((name, row[name]) for name in row if name.startswith("--") and row[name]):
                 float(row["error"]) for row in table if row["outcome"] == "solved"}
        plain, refined = found[()], found[("--refine", "1"),]
        self.assertLess(refined, 0.8 * plain)
        for setting in (("--increments", "4"), ("--nlgeom", "yes"), ("--type", "C3D8I"),
                        ("--accuracy", "0.1")):
            self.assertIn((setting,), found)
        self.assertLess(found[("--accuracy", "0.03"),], 0.06)

    def test_increments_are_cut_whatever_their_card_says(self):
        """Numbers that are there are cut, those that are not are 1."""
        for card, expected in (
            ("*STATIC, DIRECT\n0.5, 2.", "*STATIC, DIRECT\n0.25, 2."),
            ("*STATIC\n0.1, 1., 1e-5, 0.2", "*STATIC, DIRECT\n0.05, 1."),
            ("*STATIC\n\n*BOUNDARY", "*STATIC, DIRECT\n0.5, 1.\n*BOUNDARY"),
        ):
            self.assertEqual(changed_deck(card, {"--increments": "2"}), expected)
        self.assertEqual(changed_deck("*ELEMENT, TYPE=C3D8, ELSET=A", {"--type": "C3D8I"}),
                         "*ELEMENT, TYPE=C3D8I, ELSET=A")
        self.assertEqual(changed_deck("*ELEMENT, TYPE=C3D8R", {"--type": "C3D8I"}),
                         "*ELEMENT, TYPE=C3D8R")

    def test_meshes_are_refined_from_any_deck(self):
        """The error falls with each refinement; it is that of the block with as many elements."""
        folder = self.folder / "refined"
        folder.mkdir()
        done = study(
            folder, "--vary=--refine=0,1", "--vary", "n=1", "--vary", "steps=10",
            "--also", "n=2,--refine=0", "--reference", "n=4,steps=10",
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        table = rows(folder, "block-tradeoff-table.csv")
        errors = {(row["n"], row["--refine"]): float(row["error"]) for row in table}
        self.assertLess(errors["1", "1"], 0.7 * errors["1", "0"])
        self.assertAlmostEqual(errors["2", "0"] / errors["1", "1"], 1, delta=1e-3)

    def test_another_program_begins_anew(self):
        made = tradeoff.Study(PROGRAM, DECK, self.folder)
        self.assertTrue(made.rows)
        other = self.folder / "bipot"
        other.write_text(f"#!/bin/sh\nexec '{PROGRAM}' \"$@\"\n", encoding="utf-8")
        other.chmod(0o755)
        self.assertEqual(tradeoff.Study(other, DECK, self.folder).rows, [])


class Interrupted(unittest.TestCase):
    """What was run before an interruption is not run again."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)
        self.path = self.folder / "block-tradeoff.csv"

    def test_half_a_line_is_run_again(self):
        words = ["--vary", "n=1,2", "--reference", "n=1,steps=5", "--repeat", "1"]
        self.assertEqual(study(self.folder, *words).returncode, 0)
        whole = self.path.read_text(encoding="utf-8")
        self.assertEqual(whole.count("\n"), 4)
        self.path.write_text(whole[:-40], encoding="utf-8")
        done = study(self.folder, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        again = self.path.read_text(encoding="utf-8")
        self.assertEqual(again.splitlines()[:3], whole.splitlines()[:3])
        names = [row["settings"] for row in rows(self.folder)]
        self.assertEqual(names, ["n=1,steps=5", "n=1", "n=2"])

    def test_ctrl_c_leaves_a_file_that_continues(self):
        words = ["--vary", "n=1,2", "--vary", "steps=40,80,160", "--reference", "n=1,steps=50"]
        words += ["--repeat", "2"]
        process = subprocess.Popen(
            command(self.folder, *words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        until = time.monotonic() + 600
        while time.monotonic() < until and process.poll() is None:
            if self.path.is_file() and self.path.read_bytes().count(b"\n") >= 4:
                break
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=600)
        self.assertEqual(process.returncode, 1)
        self.assertIn("tradeoff: stopped; the same command goes on from here", said)
        kept = self.path.read_text(encoding="utf-8")
        self.assertLess(len(rows(self.folder)), 13)
        done = study(self.folder, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(rows(self.folder)), 13)
        self.assertTrue(self.path.read_text(encoding="utf-8").startswith(kept))


class Refused(unittest.TestCase):
    """Mistakes are told in a line, before anything runs."""

    def refuse(self, expected, *words):
        """Check that a study ends with a line and has run nothing."""
        with tempfile.TemporaryDirectory() as folder:
            said = io.StringIO()
            line = list(map(str, command(folder, *words)[2:]))
            with patch.object(sys, "argv", line), redirect_stderr(said), \
                    self.assertRaises(SystemExit) as ended:
                tradeoff.main()
            # Python prints a text that it is ended with; a number is the status.
            told = said.getvalue() or str(ended.exception.code)
            self.assertRegex(told.strip().splitlines()[-1], expected)
            self.assertNotIn(ended.exception.code, (0, None))
            if (Path(folder) / "block-tradeoff.csv").is_file():
                self.assertEqual(rows(folder), [])

    def test_wrong_names_and_values(self):
        reference = ["--reference", "n=1"]
        self.refuse("the deck has no parameter 'BOGUS'", "--vary", "bogus=1", *reference)
        self.refuse("the deck has no parameter 'BOGUS'", "--also", "bogus=1", *reference)
        self.refuse(
            "the deck has no parameter 'BOGUS'", "--vary", "n=1", "--reference", "bogus=1"
        )
        self.refuse("expected a number from|must be a whole number", "--vary", "n=1,x", *reference)
        self.refuse("expected NAME=VALUE,VALUE,..., found 'n'", "--vary", "n", *reference)
        self.refuse("expected NAME=VALUE,..., found 'n=1,,'", "--also", "n=1,,", *reference)
        self.refuse("names a parameter twice", "--vary", "n=1", "--vary", "N=2", *reference)
        self.refuse("once or three times, not 2", "--vary", "n=1", *reference, *reference)
        self.refuse("no such file", "--vary", "n=1", "--reference", "nowhere.vtkhdf")

    def test_a_file_of_something_else_is_left_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "block-tradeoff.csv"
            path.write_text("a,b\n1,2\n", encoding="utf-8")
            done = study(folder, "--vary", "n=1", "--reference", "n=1")
            self.assertIn("other columns than a study's", done.stderr)
            self.assertEqual(path.read_text(encoding="utf-8"), "a,b\n1,2\n")

    def test_a_reference_without_result(self):
        with tempfile.TemporaryDirectory() as folder:
            done = study(folder, "--vary", "n=1", "--reference", "n=1,local=UZAWA,rho=3")
            self.assertEqual(done.returncode, 1)
            self.assertIn("has no result: step 1, increment 1:", done.stderr)


def made_up(error, seconds, memory=1e6, outcome="solved", **setting):
    """Return a point with these numbers."""
    return tradeoff.Point(setting, outcome, error=error, seconds=seconds, memory=memory)


class Numbers(unittest.TestCase):
    """Fronts, sentences and limits of numbers that are made up."""

    def test_the_front_has_what_nothing_beats(self):
        points = [
            made_up(0.5, 1.0, n="1"), made_up(0.05, 2.0, n="2"), made_up(0.2, 3.0, n="3"),
            made_up(0.005, 8.0, n="4"), made_up(0.005, 9.0, n="5"),
            made_up(np.nan, 0.1, outcome="not solved", n="6"),
            # Better by less than 5 %: the same. Faster by less than 5 %, but worse: behind.
            made_up(0.00499, 20.0, n="7"), made_up(0.3, 1.99, n="8"),
        ]
        front = [point.setting["n"] for point in tradeoff.pareto_front(points, "seconds")]
        self.assertEqual(front, ["1", "2", "4"])
        self.assertEqual(tradeoff.pareto_front(points[5:6], "seconds"), [])

    def test_the_front_of_memory_is_another(self):
        points = [made_up(0.1, 1.0, 9e6, n="1"), made_up(0.1, 2.0, 3e6, n="2")]
        for cost, expected in (("seconds", "1"), ("memory", "2")):
            front = tradeoff.pareto_front(points, cost)
            self.assertEqual([point.setting["n"] for point in front], [expected])

    def test_the_sentence_names_the_cheapest(self):
        points = [
            made_up(0.09, 1.5, n="2", mu="0"), made_up(0.008, 4.0, 2e7, n="8", mu="0"),
            made_up(0.01, 3.0, 3e7, n="4", mu="0"), made_up(0.002, 60.0, n="16", mu="0"),
        ]
        self.assertEqual(
            tradeoff.sentence(points),
            "Cheapest: for 10 % n=2 (1.5 s, 1 MB); for 1 % n=4 (3 s, 30 MB); for 0.1 % none of"
            " these settings.",
        )

    def test_the_limit_of_a_power_of_the_mesh(self):
        limit = np.array([[3.0, 0.0], [1.0, -2.0]])
        slope = np.array([[0.4, 0.0], [-0.1, 0.2]])
        found, distance = tradeoff.extrapolate([limit + slope * h**1.3 for h in (0.4, 0.2, 0.1)])
        np.testing.assert_allclose(found, limit, atol=1e-12)
        self.assertAlmostEqual(distance, 0.4 * 0.1**1.3 / 3.0)

    def test_no_limit_where_steps_grow_or_turn_back(self):
        for three in ((1.0, 1.1, 1.3), (1.5, 1.0, 1.3), (1.0, 1.3, 1.3)):
            found, distance = tradeoff.extrapolate([np.array([[value]]) for value in three])
            self.assertEqual((found[0, 0], distance), (1.3, 0.0))

    def test_errors_are_relative_to_the_largest_value(self):
        expected = np.array([[0.0, -4.0], [1.0, 2.0]])
        found = np.array([[0.125, -4.0], [1.0, 1.75]])
        self.assertEqual(tradeoff.relative_error(found, expected), 0.0625)
        with self.assertRaisesRegex(tradeoff.TradeoffError, "other .STEPs or contact pairs"):
            tradeoff.relative_error(expected[:1], expected)


class Settings(unittest.TestCase):
    """What --vary and --also stand for."""

    def test_combinations(self):
        varied = [("n", ["1", "2"]), ("tolerance", ["a", "b"])]
        names = [tradeoff.setting_name(setting) for setting in tradeoff.combinations(varied)]
        self.assertEqual(
            names, ["n=1,tolerance=a", "n=1,tolerance=b", "n=2,tolerance=a", "n=2,tolerance=b"]
        )
        pinned = tradeoff.combinations(varied, [{"n": "2"}, {"n": "3"}])
        self.assertEqual(
            [tradeoff.setting_name(setting) for setting in pinned[4:]],
            ["n=3,tolerance=a", "n=3,tolerance=b"],
        )
        self.assertEqual(tradeoff.combinations([]), [{}])

    def test_words(self):
        found = tradeoff.read_setting("N=8, solver=GLOBAL NEWTON")
        self.assertEqual(found, {"n": "8", "solver": "GLOBAL NEWTON"})
        self.assertEqual(tradeoff.read_values("n=2, 4,2"), ("n", ["2", "4"]))
        for text in ("n=1,n=2", "=1", "n="):
            with self.assertRaises(argparse.ArgumentTypeError):
                tradeoff.read_setting(text)

    def test_a_deck_is_known_by_its_includes_too(self):
        with tempfile.TemporaryDirectory() as folder:
            deck, part = Path(folder) / "deck.inp", Path(folder) / "part.inp"
            deck.write_text("*HEADING\n*include, input = part.inp\n", encoding="utf-8")
            part.write_text("*INCLUDE, INPUT=\"deck.inp\"\n*NSET, NSET=ONE\n", encoding="utf-8")
            before = deck_lines(deck)
            part.write_text("*INCLUDE, INPUT=\"deck.inp\"\n*NSET, NSET=TWO\n", encoding="utf-8")
            self.assertNotEqual(deck_lines(deck), before)


if __name__ == "__main__":
    unittest.main()
