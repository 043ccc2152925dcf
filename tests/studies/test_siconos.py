"""The study beside Siconos: what it keeps of its runs, and what it says of them."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from study import PROGRAM, ROOT, need

need("h5py", "numpy")

import numpy as np  # noqa: E402

from studies import contact_alone, siconos  # noqa: E402
from studies.pages import StudyError  # noqa: E402

NO_SICONOS = 77


def solved(name="block-n8-step1", units="as it is", auto=1.0):
    """Return a problem that bipot's sweeps and Siconos' NSGS solve, NSN_AC and ADMM do not."""
    runs = [
        contact_alone.Run("bipot", "auto", 7, auto, 3e-9, "global Newton"),
        contact_alone.Run("bipot", "sweeps", 90, 0.5, 9e-9, "sweeps"),
        contact_alone.Run("bipot", "sweeps, accelerated", 30, 0.1, 2e-8, "sweeps, not converged"),
        contact_alone.Run("Siconos", "NSGS, blocks", 100, 2.0, 1e-8, "converged"),
        contact_alone.Run("Siconos", "NSGS, dense", 100, 4.0, 1e-8, "converged"),
        contact_alone.Run("Siconos", "NSN_AC, blocks", 9, 0.01, 3e-5, "not converged"),
        contact_alone.Run("Siconos", "NSN_AC, dense", 8, 0.02, 2e-5, "not converged"),
        contact_alone.Run("Siconos", "ADMM, blocks", own="more than 20 s"),
    ]
    return siconos.Solved(name, units, 81, 1e-8, 20.0, runs)


class Page(unittest.TestCase):
    """What is shown of the runs."""

    def test_the_fastest_that_reach_the_residual_are_shown(self):
        names = [run.solver for run in siconos.shown(solved())]
        self.assertEqual(
            names, ["auto", "sweeps", "NSGS, blocks", "NSN_AC, dense", "ADMM, blocks"]
        )
        self.assertEqual(solved().over_siconos(), 0.5)

    def test_what_is_not_solved_has_no_time(self):
        text = "\n".join(siconos.section("block-n8-step1", [solved()]))
        self.assertIn("| as it is | Siconos | NSN_AC, dense | 8 | not reached | 2.0e-05 |", text)
        self.assertIn("| as it is | Siconos | ADMM, blocks | - | more than 20 s | - |", text)

    def test_what_the_runs_do_not_show_is_not_written(self):
        words = "\n".join(siconos.conclusions([solved()]))
        self.assertIn("The block: `auto` takes 0.5 to 0.5 times", words)
        self.assertIn("NSGS 1, NSN_AC 0, NSN_FB 0, ADMM 0 of 1", words)
        with self.assertRaisesRegex(StudyError, "The block"):
            siconos.conclusions([solved(auto=2.5)])
        failed = solved()
        failed.runs[0].residual = 1e-7
        with self.assertRaisesRegex(StudyError, "reaches the residual"):
            siconos.conclusions([failed])

    def test_the_page_is_that_of_the_runs_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "siconos", "--page", "-o", folder],
                check=True, capture_output=True,
            )
            made = (Path(folder) / "siconos.md").read_text(encoding="utf-8")
        kept = (ROOT / "docs" / "studies" / "siconos.md").read_text(encoding="utf-8")
        self.assertEqual(made, kept)


class Kept(unittest.TestCase):
    """The file of runs."""

    def test_runs_are_kept_and_read_again(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "siconos.csv"
            self.assertEqual(siconos.read_kept(path), {})
            siconos.keep(solved(auto=9.0), path)
            siconos.keep(solved(units="scaled"), path)
            siconos.keep(solved(), path)
            found = siconos.read_kept(path)
        self.assertEqual(
            found, {("block-n8-step1", units): solved(units=units) for units in siconos.UNITS}
        )

    def test_the_block_is_solved(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "siconos.csv"
            done = subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "siconos", "--n", "2", "--steps",
                 "3", "--bipot", PROGRAM, "--runs", path, "-o", folder],
                capture_output=True, text=True, check=False,
            )
            self.assertIn(done.returncode, (0, NO_SICONOS), done.stderr)
            self.assertEqual(path.exists(), done.returncode == 0)
        self.assertIn("block-n2-step3, as it is: 9 points", done.stdout)
        rows = [line.strip("| ").split(" | ") for line in done.stdout.splitlines()]
        ours = [row for row in rows if row[:2] == ["bipot", "auto"]]
        self.assertEqual(len(ours), 2)
        for row in ours:
            self.assertLess(float(row[4]), 1e-8)
            self.assertEqual(row[5], "yes")

    def test_runs_of_another_tolerance_are_not_mixed(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "siconos.csv"
            siconos.keep(solved(), path)
            before = path.read_bytes()
            done = subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "siconos", "--n", "none",
                 "--tolerance", "1e-6", "--bipot", PROGRAM, "--runs", path, "-o", folder],
                capture_output=True, text=True, check=False,
            )
            self.assertEqual(done.returncode, 1)
            self.assertIn("has runs to a residual of 1e-08", done.stderr)
            self.assertEqual(path.read_bytes(), before)


class Residual(unittest.TestCase):
    """The measure of all."""

    def test_a_point_that_sticks_is_solved_by_its_own_reaction(self):
        # u = W r + q with W = 2 and q = (-2, 0.2, 0): r = (1, -0.1, 0) stops all motion, and its
        # friction is a fifth of what mu = 0.5 allows.
        problem = contact_alone.Problem(
            "one", 2.0 * np.eye(3), np.array([-2.0, 0.2, 0.0]), np.array([0.5])
        )
        self.assertLess(problem.residual(np.array([1.0, -0.1, 0.0])), 1e-15)
        self.assertGreater(problem.residual(np.array([1.0, 0.0, 0.0])), 1e-2)
        self.assertEqual(problem.residual(np.array([np.nan, 0.0, 0.0])), np.inf)


if __name__ == "__main__":
    unittest.main(verbosity=2)
