"""Concave corners and repeated triangles: decks of ../shared/reference/finds3.

Where that folder is absent the whole file is skipped (status 77). Its name says `shared`, so that
the skip is allowed; nothing else is skipped here.
"""

import shutil
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from program import SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "finds3"


class Finds(unittest.TestCase):
    """Source: the table of README.md there."""

    def solve(self, name, **overrides):
        """Run a deck of the folder beside the files that it names; it must be certified."""
        folder = Path(tempfile.mkdtemp(prefix="bipot-"))
        self.addCleanup(shutil.rmtree, folder)
        for file in (*SHARED.glob("*.stl"), SHARED / f"{name}.inp"):
            shutil.copy(file, folder)
        run = Run(folder / f"{name}.inp", **overrides)
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result

    def check_twins(self, name):
        """One pair is as two are, to 1e-8; return its resultant and least gap."""
        one, two = (self.solve(f"concave_corner_{name}{n}") for n in ("one_pair", "two_pairs"))
        forces = [np.sum([p.resultant[-1] for p in result.pairs.values()], axis=0)
                  for result in (one, two)]
        np.testing.assert_allclose(*forces, rtol=0, atol=1e-8 * np.abs(forces[1]).max())
        return forces[0], one.pairs[0].gap[-1].min()

    def test_a_rigid_corner(self):
        force, gap = self.check_twins("")
        np.testing.assert_allclose(force, (22.37, -5.49, 29.35), atol=0.005)
        self.assertGreater(gap, -1e-9)

    def test_a_corner_of_a_body(self):
        force, gap = self.check_twins("deformable_")
        np.testing.assert_allclose(force, (4.17, 0, 16.55), atol=0.005)
        self.assertGreater(gap, -1e-9)

    def test_repeated_triangles(self):
        pressure = self.solve("stl_duplicates").pairs[0].pressure[-1]
        np.testing.assert_allclose(pressure, 20, rtol=1e-8)


if __name__ == "__main__":
    if not SHARED.is_dir():
        print(f"{SHARED} is not there")
        sys.exit(77)
    unittest.main()
