"""Contact and ties between surfaces of any two types of elements: faces with mid-side nodes.

Boxes of tests/cases/test_free_meshes.py.
"""

import itertools
import unittest

import numpy as np
from program import Run
from test_free_meshes import DRY, MATERIAL, POISSON, PRESSURE, STEP, YOUNG, Box, on_corner

SECOND = ("C3D10", "C3D15", "C3D20", "C3D20R")
KINDS = ("C3D4", "C3D6", "C3D8", *SECOND)
PAIRS = [p for p in itertools.product(KINDS, repeat=2) if set(p) & set(SECOND)]


class SecondOrderPairs(unittest.TestCase):
    def solve(self, deck, *options):
        """Return the result of a deck that must be solved and certified."""
        run = Run(deck, *options, name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result

    def check_uniform(self, result):
        """A uniform stress along z is exact on any mesh."""
        x = result.points
        strain = np.array([POISSON, POISSON, -1.0]) * PRESSURE / YOUNG
        u = result.field("displacement")
        np.testing.assert_allclose(u - u[0], (x - x[0]) * strain, rtol=0, atol=1e-10)

    def bodies(self, kinds):
        """Return two boxes, the upper on the lower, whose faces do not match."""
        low = Box("LOW", (3, 3, 1), kinds[1:])
        up = Box("UP", (2, 2, 1), kinds[:1], low=(0, 0, 1), after=low)
        return low.cards() + up.cards() + MATERIAL

    def test_uniform_stress_between_bodies(self):
        for kinds in PAIRS:
            with self.subTest(kinds=kinds):
                result = self.solve(
                    self.bodies(kinds) + DRY + on_corner("LOW") + on_corner("UP")
                    + "LOW-Z0, 3\n*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE\n"
                    "UP-Z0, LOW-Z1\n" + STEP + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                )
                self.check_uniform(result)
                wanted = PRESSURE / (1 + POISSON * PRESSURE / YOUNG) ** 2
                np.testing.assert_allclose(result.pairs[0].pressure[-1], wanted, rtol=1e-7)

    def test_uniform_stress_across_a_tie(self):
        for kinds in PAIRS:
            with self.subTest(kinds=kinds):
                self.check_uniform(self.solve(
                    self.bodies(kinds) + "*TIE, NAME=T\nUP-Z0, LOW-Z1\n"
                    + on_corner("LOW") + "LOW-Z0, 3\n" + STEP
                    + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                ))


if __name__ == "__main__":
    unittest.main()
