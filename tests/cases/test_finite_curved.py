"""Second order at finite strain before curved obstacles, and pressures between bodies.

Boxes of tests/cases/boxes.py.
"""

import unittest

import numpy as np
from boxes import Box, BoxCase
from finite_laws import NEO, cauchy_stress
from scipy.optimize import brentq
from test_finite_cells import TIGHT, material, moved, step

PIVOT = np.array([0.5, 0.5, 0.0])
SHIFT = np.array([0.06, 0.03, -0.08])
OBSTACLES = {
    "ball": "TYPE=SPHERE, REF NODE=9001\n0.5, 0.5, -1.5, 1.5\n",
    "roll": "TYPE=CYLINDER, REF NODE=9001\n0.5, 0.5, -1.5, 0., 1., 0., 1.5\n",
    "bowl": "TYPE=SPHERE, INNER, REF NODE=9001\n0.5, 0.5, 2., 2.12\n",
}


def pressed(kind, obstacle, friction, increment="0.25"):
    """Return a box that is pressed on an obstacle and dragged; its deck, and it."""
    box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5), shift=0.1)
    deck = box.cards() + material() + (
        f"*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n{friction}\n*NODE\n9001, 0.5, 0.5, 0.\n"
        f"*OBSTACLE, NAME=O, {OBSTACLES[obstacle]}*CONTACT PAIR, INTERACTION=DRY\nB-Z0, O\n"
    )
    way = moved(box, box.side(2, 1), lambda x: SHIFT)
    return box, deck + TIGHT + step(way + "9001, 1, 6, 0.\n", increment=increment)


class RoundObstacles(BoxCase):
    """Which nodes in the middles of edges press by themselves is a matter of what presses."""

    def test_forces_stay_while_nothing_moves(self):
        """Forces at the end of a step are those of an increment in which nothing changes."""
        for obstacle in ("ball", "roll"):
            for kind in ("C3D10", "C3D20R"):
                for friction, increment in ((0.0, "0.25"), (0.3, "0.25"), (0.8, "0.25"),
                                            (0.8, "1.")):
                    with self.subTest(obstacle=obstacle, kind=kind, friction=friction,
                                      increment=increment):
                        _, deck = pressed(kind, obstacle, friction, increment)
                        result = self.solve(deck + 2 * step("", increment="1.", first=False))
                        force = result.pairs[0].force
                        size = abs(force[-1]).max()
                        for k in (-3, -2):
                            np.testing.assert_allclose(force[k], force[-1], rtol=0,
                                                       atol=1e-10 * size)

    def test_smooth_contact_does_not_depend_on_increments(self):
        """Without friction the way to a place leaves nothing behind."""
        for obstacle, kind in (("ball", "C3D10"), ("roll", "C3D20R")):
            with self.subTest(obstacle=obstacle, kind=kind):
                one, many = (
                    self.solve(pressed(kind, obstacle, 0.0, increment)[1]).pairs[0].resultant[-1]
                    for increment in ("1.", "0.1")
                )
                np.testing.assert_allclose(one, many, rtol=0, atol=1e-9 * abs(many).max())

    def test_forces_turn_with_the_obstacle(self):
        """By 90 and 180 degrees: points that are open, stick and slide."""
        quarter = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
        for obstacle, kind, friction in (
            ("ball", "C3D20R", 0.3), ("ball", "C3D10", 0.8), ("roll", "C3D10", 0.3),
            ("roll", "C3D20R", 0.3), ("bowl", "C3D10", 0.8), ("bowl", "C3D20R", 0.3),
        ):
            with self.subTest(obstacle=obstacle, kind=kind, friction=friction):
                box, deck = pressed(kind, obstacle, friction)
                for angle, q in ((90, quarter), (180, quarter @ quarter)):
                    way = moved(box, box.side(2, 1),
                                lambda x, q=q: q @ (x + SHIFT - PIVOT) + PIVOT - x)
                    deck += step(
                        f"{way}9001, 1, 3, 0.\n9001, 4, 4, 0.\n9001, 6, 6, 0.\n"
                        f"9001, 5, 5, {np.radians(angle)!r}\n", increment="1.", first=False,
                    ).replace("*STATIC", "*STATIC, DIRECT")
                force = self.solve(deck).pairs[0].force
                size = abs(force[-3]).max()
                for k, q in ((-2, quarter), (-1, quarter @ quarter)):
                    np.testing.assert_allclose(force[k], force[-3] @ q.T, rtol=0,
                                               atol=1e-10 * size)


class PressureBetweenBodies(BoxCase):
    def test_it_is_over_the_deformed_area(self):
        """Two boxes pressed to a stretch of 0.7: the Cauchy stress at all points."""
        across = brentq(lambda a: cauchy_stress(NEO, (0.7, a, a))[1], 0.8, 1.6, xtol=1e-15)
        stress = -cauchy_stress(NEO, (0.7, across, across))[0]
        for kinds in (("C3D10", "C3D20R"), ("C3D20R", "C3D8"), ("C3D4", "C3D15")):
            with self.subTest(kinds=kinds):
                low = Box("LOW", (3, 3, 1), kinds[1:])
                up = Box("UP", (2, 2, 1), kinds[:1], low=(0, 0, 1), after=low)
                result = self.solve(
                    low.cards() + up.cards() + material()
                    + "*BOUNDARY\nLOW-X0, 1\nUP-X0, 1\nLOW-Y0, 2\nUP-Y0, 2\nLOW-Z0, 3\n"
                    + "*SURFACE INTERACTION, NAME=DRY\n"
                    + "*CONTACT PAIR, INTERACTION=DRY\nUP-Z0, LOW-Z1\n" + TIGHT
                    + step("*BOUNDARY\nUP-Z1, 3, 3, -0.6\n", increment="0.2")
                )
                pressure = result.pairs[0].pressure[-1]
                np.testing.assert_allclose(pressure, stress, rtol=0, atol=1e-9 * stress)
                field = result.field("contact_pressure")
                np.testing.assert_allclose(field[field > 0], stress, rtol=0, atol=1e-9 * stress)


if __name__ == "__main__":
    unittest.main()
