"""Published cases of two bodies in C3D10: a wedge on a slope (CGS-4), two spheres (SSNV104).

With C3D8 they are in test_published_bodies.py.
"""

import math
import unittest

import numpy as np
from two_bodies import solved

from studies.deck_cards import deck, pair, step  # found through two_bodies
from studies.published_bodies import MATERIAL, spheres_load
from studies.solid_meshes import SolidMesh

STEEP = 0.1  # tangent of the slope


def wedge_deck(mu):
    """Return the deck of a wedge under a weight, pushed up a slope of a tenth at its side."""
    def base(x):
        return x * [1, 1, 0] + np.outer(x[:, 2] * (1 + STEEP * x[:, 0]), [0, 0, 1])

    def wedge(x):
        sole = 1 + STEEP * x[:, 0]
        return x * [1, 1, 0] + np.outer(sole + x[:, 2] * (3 - sole), [0, 0, 1])

    low = SolidMesh("LOW", "C3D10", (np.linspace(0, 6, 5), [0, 0.5, 1], [0, 1]), 1, base)
    high = SolidMesh("HIGH", "C3D10", (np.linspace(1, 5, 4), [0, 1], [0, 0.5, 1]), 10001, wedge)
    return deck(
        low.cards(), high.cards(), low.set_cards("SLOPE", low.nodes(2, 1)),
        low.set_cards("FLOOR", low.nodes(2, 0)), high.set_cards("SOLE", high.nodes(2, 0)),
        high.set_cards("TOP", high.nodes(2, 1)), high.set_cards("SIDE", high.nodes(0, 0)),
        high.set_cards("FLANK", high.nodes(1, 0)), MATERIAL.format(young=1e6, nu=0.3),
        pair("SOLE-F, SLOPE-F", mu),
        step("SIDE, 1, 1, 0.01").replace("*END", "*DSLOAD\nTOP-F, P, 1.\n*END"),
        held="FLOOR, 1, 3\nFLANK, 2",
    )


def spheres_deck(n=8):
    """Return the deck of a quarter of two spheres alike: blocks of 60 with their gap."""
    axis = 60 * (0.2 * np.arange(n + 1) / n + 0.8 * (np.arange(n + 1) / n) ** 3)
    depth = 60 * (0.2 * np.arange(6) / 5 + 0.8 * (np.arange(6) / 5) ** 3)
    high = SolidMesh("HIGH", "C3D10", (axis, axis, depth))
    low = SolidMesh("LOW", "C3D10", (axis, axis, depth), 50001,
                    lambda x: x[:, [1, 0, 2]] * [1, 1, -1])
    cards, held = "", "FLOOR, 1, 3\n"
    for body in (high, low):
        for k, name in enumerate("XY"):
            rows = np.flatnonzero(body.x[:, k] == 0)
            if body is low:
                rows = np.setdiff1d(rows, low.nodes(2, 1))
            cards += body.set_cards(f"{body.name}-{name}", rows)
            held += f"{body.name}-{name}, {k + 1}\n"
    return deck(
        high.cards(), low.cards(), cards, high.set_cards("SOLE", high.nodes(2, 0)),
        low.set_cards("SEAT", low.nodes(2, 0)), low.set_cards("FLOOR", low.nodes(2, 1)),
        high.set_cards("CROWN", high.nodes(2, 1)), MATERIAL.format(young=20000.0, nu=0.3),
        pair("SOLE-F, SEAT-F", 0.0, ", TYPE=SURFACE TO SURFACE, SMALL SLIDING"),
        "*CONTACT GAP, PARABOLA\nSOLE, 0., 0., 0., 25.\n",
        "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\n"
        f"CROWN-F, P, {spheres_load() / 4 / 60**2!r}\n*END STEP\n",
        held=held.rstrip(),
    )


class SecondOrder(unittest.TestCase):
    def test_wedge_on_a_slope(self):
        """CGS-4 of NAFEMS: push over weight is (tan a + mu)/(1 - mu tan a)."""
        for mu, published in ((0.0, 0.1), (0.1, 0.20202), (0.2, 0.306122), (0.3, 0.412371)):
            with self.subTest(mu=mu):
                force = solved(self, wedge_deck(mu)).pairs[0].resultant[-1]
                self.assertAlmostEqual(abs(force[0]) / abs(force[2]) / published, 1, delta=1e-4)

    def test_two_spheres(self):
        """SSNV104 of Code_Aster: radius of contact a = 10, peak pressure 2798.3 (fitted to p^2).

        The mean of the squared distance, weighted by Hertz's pressure, is 2 a^2/5; nodal forces
        give it as exactly as the faces' quadratic functions do.
        """
        result = solved(self, spheres_deck())
        touching = result.pairs[0]
        pressure, place = touching.pressure[-1], touching.coordinates
        used = pressure > 0.5 * pressure.max()
        _, top = np.polyfit((place[used, :2] ** 2).sum(axis=1), pressure[used] ** 2, 1)
        self.assertAlmostEqual(math.sqrt(top) / 2798.3, 1, delta=0.015)
        force = result.field("contact_force")[touching.nodes, 2]
        square = (result.points[touching.nodes, :2] ** 2).sum(axis=1)
        radius = math.sqrt(2.5 * (force @ square) / force.sum())
        self.assertAlmostEqual(radius / 10, 1, delta=0.015)


if __name__ == "__main__":
    unittest.main()
