"""Friction that falls with the rate of slip (*FRICTION, EXPONENTIAL DECAY)."""

import unittest

import numpy as np
from program import Run
from test_friction_over_pressure import METHODS
from two_bodies import solved

REST, FAST, DECAY = 0.4, 0.1, 3.0
PERIOD = 0.5


def coefficient(rate):
    """Return mu of a rate of slip."""
    return FAST + (REST - FAST) * np.exp(-DECAY * rate)


def deck(method="SOLVER=AUTO", drive=(0.3, 0.0), increments=2, below="", nlgeom="", friction=None):
    """Return a soft block that is pressed on a floor, and its top driven along it.

    `below`: cards of a body and the name of its surface, in the place of the floor.
    """
    cards, master = below or (
        "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n", "FLOOR")
    friction = friction or f", EXPONENTIAL DECAY\n{REST}, {FAST}, {DECAY}"
    return f"""*BLOCK, NAME=B, NX=3, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
100., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
{cards}*SURFACE INTERACTION, NAME=I
*FRICTION{friction}
*CONTACT PAIR, INTERACTION=I
B-ZMIN, {master}
*CONTACT SOLVER, TOLERANCE=1e-11, {method}
*STEP{nlgeom}
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMAX, 1, 2, 0.
B-ZMAX, 3, 3, -0.02
*END STEP
*STEP{nlgeom}
*STATIC, DIRECT
{PERIOD / increments!r}, {PERIOD!r}
*BOUNDARY
B-ZMAX, 1, 1, {drive[0]!r}
B-ZMAX, 2, 2, {drive[1]!r}
*END STEP
"""


class ByRate(unittest.TestCase):
    def check(self, result, increments):
        """Every point has the friction that its own slip in the last increment asks for."""
        pair = result.pairs[0]
        r = pair.reaction[-1]
        slip = np.linalg.norm(pair.slip_increment[-1], axis=1)
        friction = np.linalg.norm(r[:, 1:], axis=1)
        slides = slip > 1e-9
        self.assertGreater(slides.sum(), 5)
        most = coefficient(slip / (PERIOD / increments)) * r[:, 0]
        small = 1e-9 * r[:, 0].max()
        np.testing.assert_allclose(friction[slides], most[slides], rtol=0, atol=small)
        self.assertTrue((friction[~slides] <= REST * r[~slides, 0] * (1 + 1e-9)).all())
        return slip, r

    def test_all_methods_agree(self):
        found = []
        for method in METHODS:
            result = solved(self, deck(method, drive=(0.08, 0.03)))
            slip, r = self.check(result, 2)
            # Not all of them slide fast: the coefficients are between the two.
            self.assertGreater(np.ptp(coefficient(slip / 0.25)), 1e-3)
            found.append(r)
        for r in found[1:]:
            np.testing.assert_allclose(r, found[0], rtol=0, atol=1e-9 * found[0].max())

    def test_the_rate_is_by_the_time_of_the_step(self):
        """Slip as a whole: the top's way over the period, whatever the increments."""
        for increments in (1, 4):
            result = solved(self, deck(drive=(30.0, 0.0), increments=increments))
            self.check(result, increments)
            force = result.pairs[0].resultant[-1]
            self.assertAlmostEqual(-force[0] / force[2], FAST, delta=1e-7)
        result = solved(self, deck(drive=(0.5, 0.0), friction=", EXPONENTIAL DECAY\n0.4, 0.4, 1."))
        force = result.pairs[0].resultant[-1]
        self.assertAlmostEqual(-force[0] / force[2], REST, delta=1e-7)

    def test_between_bodies(self):
        below = (
            "*BLOCK, NAME=A, NX=4, NY=3, NZ=1\n-0.5, -0.2, -1., 2., 1.4, 1.\n"
            "*SOLID SECTION, ELSET=A, MATERIAL=M\n*BOUNDARY\nA-ZMIN, 1, 3\n", "A-ZMAX")
        self.check(solved(self, deck(below=below)), 2)

    def test_what_is_refused(self):
        for friction, nlgeom, said in (
            (", EXPONENTIAL DECAY\n0.1, 0.4, 1.", "", "mu of fast slip must not be more than mu"),
            (", EXPONENTIAL DECAY\n0.4, 0.1, -1.", "", "must not be negative: '-1.'"),
            (", EXPONENTIAL DECAY, TAUMAX=3.\n0.4, 0.1, 1.", "", "are not available together"),
            (", EXPONENTIAL DECAY\n", "", "needs a data line"),
            (", EXPONENTIAL DECAY\n0.4, 0.1, 1.", ", NLGEOM", "does not cover *FRICTION, EXPO"),
        ):
            with self.subTest(said=said):
                run = Run(deck(friction=friction, nlgeom=nlgeom), name="deck")
                self.assertEqual(run.status, 1, run.errors)
                self.assertEqual(run.errors.count("error:"), 1, run.errors)
                self.assertIn(said, run.errors)


if __name__ == "__main__":
    unittest.main()
