"""Nodes that many obstacles face: solved for the few of their points that may press.

Planes below the highest ones change nothing, however many they are.
"""

import unittest

import numpy as np
from program import Run
from two_bodies import solved

from studies.deck_cards import block, deck, pair, step

N_PLANES = 16
APART = 0.03  # more than the block can sink


def planes(count, apart):
    """Return planes below z = 0 that lean in turn to all sides, each lower by `apart`."""
    cards = []
    for k in range(count):
        lean = 1e-3 * np.array([np.sin(k), np.cos(k)])
        cards.append(
            f"*OBSTACLE, NAME=P{k}, TYPE=PLANE\n0., 0., {-k * apart}, {lean[0]}, {lean[1]}, 1.\n"
        )
    return cards


def scene(count, mu, apart, scale=1.0):
    """Return a block that is pressed on planes by its upper side, and sheared."""
    return deck(
        block("BODY", 3, (0, 0, 0), (1, 1, 1), young=1000.0 * scale),
        *planes(count, apart),
        *(pair(f"BODY-ZMIN, P{k}", mu, number=k + 1) for k in range(count)),
        step("BODY-ZMAX, 3, 3, -0.02\nBODY-ZMAX, 1, 1, 0.004", 2),
        held="BODY-ZMAX, 2",
        tolerance=1e-12,
    )


def force(result):
    """Return the force of all pairs at the end (3)."""
    return sum(np.sum(pair.reaction[-1], axis=0) for pair in result.pairs.values())


class CrowdedNodes(unittest.TestCase):
    def test_planes_out_of_reach_change_nothing(self):
        """The others are lower by more than the block can sink: one plane alone is the source."""
        for mu in (0.0, 0.3):
            for scale in (1.0, 1e6):
                with self.subTest(mu=mu, scale=scale):
                    alone = solved(self, scene(1, mu, APART, scale))
                    among = solved(self, scene(N_PLANES, mu, APART, scale))
                    np.testing.assert_allclose(
                        among.pairs[0].reaction[-1],
                        alone.pairs[0].reaction[-1],
                        rtol=0,
                        atol=1e-9 * np.abs(force(alone)).max(),
                    )

    def test_few_iterations_before_many_planes(self):
        """Planes 1e-4 apart all count; they take no more than three times what one plane takes."""
        for mu in (0.0, 0.3):
            with self.subTest(mu=mu):
                one, many = (solved(self, scene(count, mu, 1e-4)) for count in (1, N_PLANES))
                iterations = [result.history("contact_iterations").max() for result in (one, many)]
                self.assertLessEqual(iterations[1], 3 * iterations[0], iterations)
                self.assertGreaterEqual(
                    min(pair.gap[-1].min() for pair in many.pairs.values()), -1e-10
                )

    def test_two_planes_in_one(self):
        """With unlike coefficients they may share the force at will: a note says so."""

        def solve(second, height):
            run = Run(
                BLOCK_ON_TWO.replace("SECOND", second).replace("HEIGHT", str(height)), name="two"
            )
            self.assertEqual(run.status, 0, run.output + run.errors)
            return run.output

        note = "note: step 1: B-ZMIN:G1 and B-ZMIN:G2 touch 9 nodes along the same normal"
        self.assertIn(note, solve("0.3", 0))
        for second, height in (("0.5", 0), ("0.3", -1)):  # the sum is known; out of reach
            self.assertNotIn("the same normal", solve(second, height))


BLOCK_ON_TWO = """\
*BLOCK, NAME=B, ELSET=B, NX=2, NY=2, NZ=1
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=G1, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*OBSTACLE, NAME=G2, TYPE=PLANE
0., 0., HEIGHT, 0., 0., 1.
*SURFACE INTERACTION, NAME=ONE
*FRICTION
0.5
*SURFACE INTERACTION, NAME=TWO
*FRICTION
SECOND
*CONTACT PAIR, INTERACTION=ONE
B-ZMIN, G1
*CONTACT PAIR, INTERACTION=TWO
B-ZMIN, G2
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMAX, 1, 1, 0.02
B-ZMAX, 2
B-ZMAX, 3, 3, -0.01
*END STEP
"""


if __name__ == "__main__":
    unittest.main()
