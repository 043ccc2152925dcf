"""The studies of speed and scaling: what they make of runs, and of numbers that are known."""

import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

from study import PROGRAM, ROOT, need

need("h5py", "matplotlib", "numpy")

import numpy as np  # noqa: E402

from studies import scaling, speed  # noqa: E402

LIMITS = "#!/bin/sh\necho dgemm 1e10\necho read 2e10\necho dsymv 3e10\n"


def cube(n, **changes):
    """Return a row of a run that keeps to theory, at known rates."""
    equations = 3 * n * (n + 1) ** 2
    row = dict.fromkeys(speed.COLUMNS, 1.0) | {
        "scene": "block", "n": float(n), "steps": 50.0, "threads": 1.0, "repeats": 1,
        "arithmetic": "double precision, in core", "machine": "a machine",
        "equations": equations, "increments": 50.0,
        "contact_points": (n + 1) ** 2, "contact_rows": 3 * (n + 1) ** 2,
        "interface_equations": 3 * (n + 1) ** 2, "factor_entries": 2.0 * equations ** (4 / 3),
        "factor_flops": 5.0 * equations**2, "compliance_products": 50 * 10 * equations**0.1,
        "solutions": 54.0, "memory": 16.0 * equations ** (4 / 3), "cpu": 1.0, "total": 1.0,
        "seconds_factorise": 5.0 * equations**2 / 1e10, "seconds_loads": 0.0,
    }
    row["seconds_recover"] = 16 * row["factor_entries"] * 54 / 2e10
    row["seconds_condense"] = row["interface_equations"] ** 3 / 4e10
    row["seconds_contact"] = 4 * row["contact_rows"] ** 2 * row["compliance_products"] / 3e10
    return row | changes


class Runs(unittest.TestCase):
    """Rows of runs."""

    def test_a_run_is_measured_and_read_again(self):
        with tempfile.TemporaryDirectory() as folder:
            limits = Path(folder) / "limits"
            limits.write_text(LIMITS)
            limits.chmod(0o755)
            for scene, steps in (("block", 5), ("plate", 2)):
                options = SimpleNamespace(
                    scene=scene, steps=steps, scratch=folder, bipot=PROGRAM, limits=limits,
                    made="2024-05-06T07:08:09",
                )
                row = speed.run(options, 2, 1)
                self.assertEqual((row["n"], row["steps"], row["certified"]), (2, steps, steps))
                self.assertEqual(row["limit_dsymv"], 3e10)
                self.assertEqual(row["contact_points"], 9)
                self.assertEqual(row["arithmetic"], "double precision, in core")
                self.assertGreater(row["factor_flops"], 0)
                self.assertGreater(row["cpu"], 0)
                path = Path(folder) / "runs.csv"
                speed.write_rows([row], path)
                (again,) = speed.read_rows(path)
                for name in speed.COLUMNS:
                    if name in speed.WORDS:
                        self.assertEqual(again[name], row[name])
                    else:
                        self.assertAlmostEqual(again[name], row[name], delta=1e-5 * abs(row[name]))

    def test_a_result_is_taken(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "block.vtkhdf"
            subprocess.run(
                [PROGRAM, ROOT / "input" / "block.inp", "-o", path, "--quiet", "--set", "n=3",
                 "--set", "steps=5"], check=True, capture_output=True,
            )
            row = speed.take(path)
        self.assertEqual((row["scene"], row["n"], row["steps"]), ("block", 3, 5))
        self.assertEqual(row["equations"], 3 * 3 * 16)
        self.assertTrue(math.isnan(row["limit_dgemm"]))

    def test_medians_are_those_of_a_setting(self):
        rows = [cube(8, cpu=value) for value in (1.0, 5.0, 2.0)] + [cube(16, cpu=9.0)]
        found = speed.medians(rows)
        self.assertEqual([(row["n"], row["cpu"], row["repeats"]) for row in found],
                         [(8, 2.0, 3), (16, 9.0, 1)])

    def test_shares_are_work_over_time_over_the_limit(self):
        row = cube(16, limit_dgemm=2e10, limit_read=1e10)
        found = speed.shares(row)
        for name, share in (("factorise", 0.5), ("condense", 2.0), ("recover", 2.0)):
            self.assertAlmostEqual(found[name], share, places=9)
        # A machine half of whose time goes to others: the phases took half as long.
        busy = speed.shares(row | {"cpu": 0.5})
        self.assertAlmostEqual(busy["factorise"], 1.0, places=9)

    def test_the_page_has_a_line_a_setting(self):
        text = "\n".join(speed.page([cube(8), cube(16), cube(16, threads=2.0, cpu=2.0)]))
        self.assertEqual(sum(line.startswith("| 16 | 50 |") for line in text.splitlines()), 2)
        self.assertIn("Two threads over one", text)

    def test_ratios_of_threads_are_those_of_turns(self):
        one = [cube(16, total=total) for total in (10.0, 40.0, 20.0)]
        two = [cube(16, threads=2.0, total=total) for total in (9.0, 20.0, 16.0)]
        # Of the pairs 0.9, 0.5 and 0.8. Of the medians of the first two runs it would be 0.58.
        line = speed.thread_table(one + two)[2]
        self.assertEqual(line.split(" | ")[:4], ["| 16", "2", "50", "3"])
        self.assertTrue(line.endswith("| 0.80 |"), line)
        line = speed.thread_table(one[:2] + two[:2])[2]
        self.assertTrue(line.endswith("| 0.70 |"), line)
        for others in ([row | {"made": "later"} for row in two],
                       [row | {"made": ""} for row in two]):
            self.assertEqual(speed.thread_table(one + others), [])

    def test_the_page_tells_how_many_runs_were_made(self):
        for counts, words in (((1, 1), "; each line is one run."),
                              ((3, 3), "; each line holds the medians of 3 runs."),
                              ((3, 1), "; each line holds the medians of so many `runs`, 1 to 3.")):
            rows = counts[0] * [cube(8)] + counts[1] * [cube(32)]
            text = "\n".join(speed.page(rows))
            self.assertIn(words, text)
            for n, count in zip((8, 32), counts, strict=True):
                self.assertIn(f"| {n} | 50 | 1 | {count} | double, in core |", text)

    def test_a_page_of_plates_alone_is_written(self):
        rows = [cube(8, scene=scene, machine=f"a {scene}'s")
                for scene in ("plate", "plate-dense")]
        text = "\n".join(speed.page(rows))
        self.assertIn("three layers of elements, on a plate's and a plate-dense's, whose", text)
        self.assertIn("; each line is one run.", text)
        self.assertIn("With the dense compliance", text)


class Scaling(unittest.TestCase):
    """Laws and what they foretell."""

    def test_a_law_finds_its_exponent(self):
        rows = [{"equations": n, "value": 3.0 * n**1.5} for n in (10, 100, 1000)]
        law = scaling.fit(rows, lambda row: row["value"])
        self.assertAlmostEqual(law.exponent, 1.5)
        self.assertAlmostEqual(law(1e6), 3e9, delta=1e-3)
        self.assertAlmostEqual(law.reaches(3e9), 1e6, delta=1e-3)
        self.assertLess(law.off, 1e-12)
        forced = scaling.fit(rows, lambda row: row["value"], 1.0)
        self.assertEqual(forced.exponent, 1.0)
        self.assertAlmostEqual(forced(1000), rows[-1]["value"])  # through the largest
        self.assertAlmostEqual(forced.off, 0.9)

    def test_theory_is_foretold(self):
        rows = [cube(n) for n in (16, 24, 32, 40, 48, 64)]
        _, worst = scaling.work_table(rows)
        self.assertLess(worst, 0.05)  # (n+1)^2 is not quite a power of the equations
        model = scaling.make_model(rows)
        self.assertAlmostEqual(model.factorise, 1e10, delta=1)
        found = scaling.foretell(model, 1e7)
        self.assertAlmostEqual(found["factor"], 16 * 1e7 ** (4 / 3), delta=1e-6 * found["factor"])
        self.assertAlmostEqual(found["factorise"], 5e14 / 1e10, delta=1e-6 * found["factorise"])
        rows_of_w = 3 * (1e7 / 3) ** (2 / 3)
        self.assertAlmostEqual(found["matrices"], 16 * rows_of_w**2, delta=0.05 * found["matrices"])

    def test_too_few_runs_are_refused(self):
        with self.assertRaises(scaling.StudyError):
            scaling.work_table([cube(16), cube(24)])

    def test_numbers_read_well(self):
        self.assertEqual(scaling.bytes_in_words(3.24e9), "3.2 GB")
        self.assertEqual(scaling.bytes_in_words(4.56e11), "456 GB")
        self.assertEqual(scaling.time_in_words(7200), "2 h")
        self.assertEqual(scaling.time_in_words(12), "12 s")
        self.assertEqual(scaling.size_in_words(1e9), "10^9")
        self.assertEqual(scaling.size_in_words(3.5e7), "3.5 x 10^7")

    def test_the_page_is_that_of_the_runs_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "scaling", "-o", folder,
                 "--bipot", PROGRAM],
                check=True, capture_output=True,
            )
            made = (Path(folder) / "scaling.md").read_text(encoding="utf-8").splitlines()
        kept = (ROOT / "docs" / "studies" / "scaling.md").read_text(encoding="utf-8").splitlines()
        # The third line names the machine.
        self.assertEqual(made[5:], kept[5:])
        self.assertTrue(np.all([line == line.rstrip() for line in made]))


if __name__ == "__main__":
    unittest.main(verbosity=2)
