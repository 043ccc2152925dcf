"""Decks of ../shared/reference/finds3 whose contact points cannot move apart, and twins that can.

Where that folder is absent the whole file is skipped (status 77).
"""

import sys
import unittest

import numpy as np
from program import SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "finds3"


class Finds(unittest.TestCase):
    """Resultants of the pair along z at the end."""

    def force(self, name, **overrides):
        """Solve a deck and return the normal resultant of its only pair."""
        run = Run(SHARED / f"{name}.inp", **overrides)
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        (pair,) = result.file["contact"].values()
        return np.array(pair["resultant"])[-1]

    def test_clamped_on_both_sides(self):
        # 3.2 by the nodes that are left; with what the edge's nodes had 3.5.
        for options in ({}, {"small": "YES"}, {"mu": 0}, {"n": 4, "m": 7}):
            self.assertAlmostEqual(self.force("both_clamped", **options)[2], 3.48, delta=0.07)

    def test_tied_beside_contact(self):
        # 1.87 by the nodes that are left; with what the edge's nodes had 2.12.
        for options in ({}, {"small": "YES"}, {"mu": 0}):
            self.assertAlmostEqual(self.force("tie_beside_contact", **options)[2], 2.12, delta=0.02)

    def test_what_may_move_stays(self):
        for s in (0.1, 0.01, 0.001, 0.0001):
            self.assertAlmostEqual(s * self.force("keep_taper", s=s)[2], 1, delta=1e-4)
        self.assertAlmostEqual(abs(self.force("keep_free_tool")[2]), 4, delta=1e-9)
        self.assertAlmostEqual(self.force("keep_stiff_part")[2], 225.38468, delta=1e-4)


if __name__ == "__main__":
    if not SHARED.is_dir():
        print("skipped: there is no", SHARED)
        sys.exit(77)
    unittest.main()
