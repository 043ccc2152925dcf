"""Tetrahedra and wedges against an independent program, ../shared/reference/free_meshes.

It has elements, mortar operators and a contact solver of its own. Where that folder is absent the
whole file is skipped (status 77). Its name says `shared`, so that the skip is allowed; nothing else
is skipped here.
"""

import sys
import unittest

import numpy as np
from program import SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "free_meshes" / "ref"


class Independent(unittest.TestCase):
    """Source: decks.py and refs2.py there; the decks are theirs."""

    def check(self, name, kind):
        """Return the result of a deck, and the rows of the reference."""
        run = Run(SHARED / f"{name}.inp")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        rows = np.loadtxt(SHARED / f"{name}_{kind}.csv", delimiter=",")
        return result, rows

    def test_blocks_on_a_plane(self):
        for name in ("block_C3D4_n2", "block_C3D4_n3", "block_C3D6_n2", "block_C3D6_n3"):
            with self.subTest(name):
                result, rows = self.check(name, "nodal")
                wanted = rows[:, 1:4]
                np.testing.assert_allclose(
                    result.pairs[0].resultant, wanted, rtol=0, atol=1e-6 * abs(wanted).max()
                )

    def test_blocks_of_second_order_on_a_plane(self):
        for name in (
            "block_C3D10_n2", "block_C3D10_n3", "block_C3D15_n2", "block_C3D20_n2",
            "block_C3D20_n3", "block_C3D20R_n2",
        ):
            with self.subTest(name):
                result, rows = self.check(name, "dualq")
                wanted = rows[:, 1:4]
                np.testing.assert_allclose(
                    result.pairs[0].resultant, wanted, rtol=0, atol=1e-6 * abs(wanted).max()
                )

    def test_a_ball_on_a_plane(self):
        result, rows = self.check("ball_C3D4", "nodal")
        np.testing.assert_allclose(abs(result.pairs[0].resultant[:, 2]), rows[:, 2], rtol=1e-6)
        np.testing.assert_allclose(result.pairs[0].pressure.max(axis=1), rows[:, 4], rtol=1e-6)

    def test_two_blocks(self):
        """Slave triangles have three dual functions of their own, or six."""
        for name, kind in (
            ("two_C3D4_C3D4", "dual"), ("two_C3D10_C3D10", "dualq"), ("two_C3D10_C3D8", "dualq"),
        ):
            with self.subTest(name):
                result, rows = self.check(name, kind)
                wanted = rows[:, 1:4] * 1e-3
                np.testing.assert_allclose(
                    result.pairs[0].resultant, wanted, rtol=0, atol=1e-6 * abs(wanted).max()
                )


if __name__ == "__main__":
    if not SHARED.is_dir():
        print(f"skipped: there is no {SHARED}")
        sys.exit(77)
    unittest.main()
