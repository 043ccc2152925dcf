"""Pairs out of reach of each other: no iteration places their points, and the result has the gaps
and slips of the displacements all the same."""

import unittest

import numpy as np
from two_bodies import solved

from studies.deck_cards import block, deck, pair, quarter_ring, step

FAR = ": 0 points of"
WAY = 0.2


class OutOfReach(unittest.TestCase):
    def test_gaps_before_round_obstacles(self):
        """A block goes sideways: what is placed where it began is off by 0.2**2 / (2*3)."""
        centre = np.array([0.5, 0.5, 4.0])
        for card, across, sign in (
            ("TYPE=CYLINDER, INNER\n0.5, 0.5, 4., 1., 0., 0., 5.", [1, 2], -1),
            ("TYPE=SPHERE, INNER\n0.5, 0.5, 4., 6.", [0, 1, 2], -1),
            ("TYPE=CYLINDER\n0.5, 0.5, 4., 1., 0., 0., 3.", [1, 2], 1),
            ("TYPE=SPHERE\n0.5, 0.5, 4., 2.5", [0, 1, 2], 1),
        ):
            face = "BODY-ZMIN" if sign < 0 else "BODY-ZMAX"
            text = deck(
                block("BODY", 2, (0, 0, 0), (1, 1, 0.5)),
                f"*OBSTACLE, NAME=ROUND, {card}\n",
                pair(f"{face}, ROUND", 0.3),
                step(f"BODY-ZMAX, 1, 1, 0.1\nBODY-ZMAX, 2, 2, {WAY}", 2),
                held="BODY-ZMAX, 3",
            )
            with self.subTest(card.splitlines()[0]):
                result = solved(self, text)
                self.assertIn(FAR, result.output)
                points = result.pairs[0]
                radius = float(card.split()[-1])
                at = (points.coordinates - centre + np.array([0.1, WAY, 0.0]))[:, across]
                expected = sign * (np.linalg.norm(at, axis=1) - radius)
                self.assertGreater(expected.min(), WAY)
                np.testing.assert_allclose(points.gap[-1], expected, rtol=0, atol=1e-9)

    def test_gaps_between_bodies(self):
        """A pin goes towards one side of a hole: it faces others of its faces then."""
        gaps = []
        for load in ("", "*CLOAD\nHOLE-ALL, 1, 0.\n"):
            text = deck(
                quarter_ring("PIN", 1, (0.3, 0.6), (1, 8)),
                quarter_ring("HOLE", 20001, (1.5, 2.0), (1, 5)),
                "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n",
                "*SOLID SECTION, ELSET=PIN, MATERIAL=M\n*SOLID SECTION, ELSET=HOLE, MATERIAL=M\n",
                pair("PIN-OUT, HOLE-IN"),
                step(f"PIN-ALL, 1, 1, {WAY}\n{load}".rstrip("\n")),
                held="PIN-ALL, 2, 3\nHOLE-ALL, 2, 3\nHOLE-X, 1",
            )
            result = solved(self, text)
            # Of a body under loads nothing is taken to be out of reach.
            (self.assertNotIn if load else self.assertIn)(FAR, result.output)
            gaps.append(result.pairs[0].gap[-1])
        np.testing.assert_allclose(*gaps, rtol=0, atol=1e-9)

    def test_a_lever_goes_further_than_its_supports(self):
        """Its end sinks by eight times what turns its root: the plan is revised, and says so."""
        result = solved(self, LEVER)
        self.assertRegex(result.output, r"note: .* reaches LOW-ZMAX, .* thought out of reach")
        self.assertGreater(result.pairs[0].resultant[-1, 2], 0.1)


LEVER = """\
*BLOCK, NAME=UP, NX=8, NY=1, NZ=1
0., 0., 0., 8., 1., 1.
*BLOCK, NAME=LOW, NX=4, NY=1, NZ=1
6., -0.5, -1.2, 4., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
UP-ZMIN, LOW-ZMAX
*STEP
*STATIC
1., 1.
*BOUNDARY
LOW-ZMIN, 1, 3
UP-XMIN, 2, 3
1, 1
10, 1
19, 1, 1, 0.05
28, 1, 1, 0.05
*END STEP
"""


if __name__ == "__main__":
    unittest.main()
