"""Bodies by iteration: the page is that of the runs that are kept, and says what they say."""

import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from study import ROOT, need

need("h5py", "matplotlib", "numpy")

from studies import iteration  # noqa: E402
from studies.pages import StudyError  # noqa: E402


def run_of(n, **others):
    """A run whose time grows as N, its memory as N, its iterations not at all."""
    equations = 3.0 * n * (n + 1) ** 2
    phases = {f"seconds_{name}": 1e-5 * equations for name in iteration.PHASES}
    return {
        "n": n, "equations": equations, "contact_points": (n + 1.0) ** 2, "increments": 50.0,
        "certified": 50.0, "iterations": 2500.0, "of_contact": 2000.0, "newton": 200.0,
        "cpu": 1e-3 * equations, "total": 1e-3 * equations, "memory": 3e3 * equations,
        **phases, "factor_cpu": math.nan, "factor_memory": math.nan, "forces": math.nan,
        "load": 0.0, "machine": "one",
    } | others


class TestIteration(unittest.TestCase):
    def test_the_page_is_that_of_the_runs_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / "iteration.md"
            subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "iteration", "--page", "-o", made],
                check=True, capture_output=True,
            )
            self.assertEqual(made.read_text(encoding="utf-8"),
                             iteration.PAGE.read_text(encoding="utf-8"))

    def test_growth_is_found_again(self):
        text = "\n".join(iteration.page([run_of(n) for n in (16, 24, 32, 48)]))
        self.assertIn("iterations an increment as N^0.00", text)
        self.assertIn("memory as\nN^1.00", text)
        self.assertIn("| 10^7 | 50 | 1.7 min | 3.3 min | 30 GB |", text)

    def test_longer_increments_have_laws_of_their_own(self):
        longer = [run_of(n, increments=10.0, certified=10.0, iterations=20.0 * n) for n in
                  (24, 32, 48)]
        text = "\n".join(iteration.page([run_of(n) for n in (16, 24, 32, 48)] + longer))
        self.assertIn("iterations an increment as N^0.00", text)
        self.assertRegex(text, r"In 10 increments \(n = 24 to 48\) iterations grow as N\^0\.3[34]")

    def test_an_increment_without_certificate_makes_no_page(self):
        with self.assertRaises(StudyError):
            iteration.page([run_of(n, certified=49.0) for n in (24, 32, 48)])

    def test_two_sizes_make_no_law(self):
        with self.assertRaises(StudyError):
            iteration.page([run_of(n) for n in (16, 24, 32)])


if __name__ == "__main__":
    unittest.main(verbosity=2)
