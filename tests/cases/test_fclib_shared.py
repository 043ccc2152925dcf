"""Frictional contact problems that others wrote, in ../shared/fclib beside the repository.

Where that folder is absent the whole file is skipped (status 77). Its name says `shared`, so that
the skip is allowed; nothing else is skipped here.
"""

import sys
import tempfile
import unittest
from pathlib import Path

from fclib_file import Solved, read_local, residual
from program import SOURCE

SHARED = SOURCE.parent / "shared" / "fclib"
# What the files are: points, equations of a global one; iterations that AUTO may take, about twice
# what it takes. Rigid bodies: their W is singular.
FILES = {
    "CubeH8.hdf5": (1, 162, 4),
    "LMGC_GlobalFrictionContactProblem00046.hdf5": (9, 162, 4),
    "Capsules-i100-1090.hdf5": (276, None, 60),
    "Capsules-i122-1617.hdf5": (296, None, 100),
    "Capsules-i125-1213.hdf5": (286, None, 60),
    "LMGC_100_PR_PerioBox-i00361-60-03000.hdf5": (60, None, 150),
    "BoxesStack1-i100000-32.hdf5": (52, None, 40),
    "spheres-in-a-box-98-i10000-256-10.hdf5": (256, None, 140),
}


class OthersProblems(unittest.TestCase):
    """Source: test data of Siconos, Apache-2.0; the residual is recomputed here."""

    def check(self, name, *options):
        """Solved to 1e-8, with the W of the file, by a definition of this file alone."""
        points, equations, most = FILES[name]
        w, q, mu = read_local(SHARED / name)
        self.assertEqual(len(mu), points)
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "solution.hdf5"
            solved = Solved(SHARED / name, *options, output=output)
            self.assertEqual(solved.status, 0, solved.errors)
            self.assertLessEqual(residual(w, q, mu, solved.read("r")), 1.05e-8)
            if not options:
                self.assertLessEqual(solved.fact("iterations"), most)
            if equations:
                self.assertEqual(len(solved.read("v")), equations)
                self.assertLess(solved.fact("equilibrium"), 1e-12)

    def test_cube_h8(self):
        self.check("CubeH8.hdf5")
        self.check("CubeH8.hdf5", "--solver", "sweeps")

    # Read as it stands, one triangle of M alone, W_nn would be .0156.
    def test_cube_h8_has_its_whole_m(self):
        self.assertAlmostEqual(read_local(SHARED / "CubeH8.hdf5")[0][0, 0], 0.020557, places=6)

    def test_lmgc_global(self):
        self.check("LMGC_GlobalFrictionContactProblem00046.hdf5")
        self.check("LMGC_GlobalFrictionContactProblem00046.hdf5", "--solver", "sweeps")

    # Their W is not quite symmetric.
    def test_capsules(self):
        for name in ("i100-1090", "i122-1617", "i125-1213"):
            with self.subTest(name):
                self.check(f"Capsules-{name}.hdf5")
                self.check(f"Capsules-{name}.hdf5", "--solver", "global-newton")

    def test_boxes_and_spheres(self):
        for name in ("BoxesStack1-i100000-32.hdf5", "spheres-in-a-box-98-i10000-256-10.hdf5"):
            with self.subTest(name):
                self.check(name)
                self.check(name, "--solver", "global-newton")

    def test_perio_box(self):
        self.check("LMGC_100_PR_PerioBox-i00361-60-03000.hdf5")


if __name__ == "__main__":
    if not SHARED.is_dir():
        print(f"skipped: {SHARED} is not there")
        sys.exit(77)
    unittest.main()
