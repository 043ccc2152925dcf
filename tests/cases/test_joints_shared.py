"""Welds and means within a contact pair: the decks of ../shared/reference/finds3.

Where that folder is absent the whole file is skipped (status 77). Its name says `shared`, so that
the skip is allowed; nothing else is skipped here.
"""

import sys
import unittest

import numpy as np
from program import SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "finds3"


class Joints(unittest.TestCase):
    """Source: the table of ../shared/reference/README.md."""

    def at_ends(self, deck, **options):
        run = Run(SHARED / f"{deck}.inp", **options)
        self.assertEqual(run.status, 0, run.errors)
        file = run.result().file
        contact = next(iter(file["contact"].values()))
        force = file["VTKHDF/PointData/reaction_force"][:]
        n_steps = len(file["history/step"])
        support = force.reshape(n_steps, -1, 3).sum(axis=1)
        return support, contact["reaction"][:, :, 0], file

    def test_spot_weld(self):
        for options in ({}, {"mu": 0}, {"small": "YES"}):
            with self.subTest(**options):
                support, normal, _ = self.at_ends("spot_weld", **options)
                np.testing.assert_allclose(support[-1], [-1, 0, 4], atol=1e-6)
                np.testing.assert_allclose(normal.sum(axis=1)[1:], 3.8, atol=0.1)
                self.assertLess(normal.max(), 0.5)

    def test_average_weld(self):
        """The least reactions: those of the two nodes that are joined would be 0.16 to 0.54."""
        support, normal, _ = self.at_ends("average_weld")
        np.testing.assert_allclose(support[-1], [-1, 0, 4], atol=1e-6)
        np.testing.assert_allclose(normal.sum(axis=1), [1.75, 3.5, 3.5, 3.5, 3.5, 3.5], atol=0.03)

    def test_self_stress_of_average_weld_holds_no_pull(self):
        run = Run(SHARED / "average_weld.inp", mu=1e-3, small="YES")
        self.assertEqual(run.status, 2)
        self.assertIn("nothing balances the loads", run.errors)
        self.assertGreaterEqual(np.count_nonzero(run.result().file["history/step"][:] == 1), 2)


if __name__ == "__main__":
    if not SHARED.is_dir():
        sys.exit(77)
    unittest.main()
