"""Contact and ties between surfaces of any two types of elements: faces with mid-side nodes.

Boxes of tests/cases/boxes.py.
"""

import itertools
import unittest

import numpy as np
from boxes import DRY, MATERIAL, POISSON, PRESSURE, STEP, YOUNG, Box, BoxCase, on_corner

# Faces of C3D20 and C3D20R are the same.
SECOND = ("C3D10", "C3D15", "C3D20R")
PAIRS = [
    kinds for kinds in itertools.product(("C3D4", "C3D6", "C3D8", *SECOND), repeat=2)
    if set(kinds) & set(SECOND)
]
PAIR = "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE{}\nUP-Z0, LOW-Z1\n"


class Ring(Box):
    """A quarter of a ring about the z axis: along the x of the box from its inner radius on."""

    def __init__(self, name, n, kind, inner, after=None):
        super().__init__(name, (2, n, n), (kind,), after=after, shift=0)
        self.flat = self.x
        radius, angle = inner + 0.5 * self.x[:, 0], self.x[:, 1] * np.pi / 2
        self.x = np.stack([radius * np.cos(angle), radius * np.sin(angle), self.x[:, 2]], axis=1)
        self.x[abs(self.x) < 1e-14] = 0

    def side(self, axis, end):
        return [self.first + i for i in np.flatnonzero(abs(self.flat[:, axis] - end) < 1e-9)]


class SecondOrderPairs(BoxCase):
    def bodies(self, kinds):
        """Return two boxes, the upper on the lower, whose faces do not match."""
        low = Box("LOW", (3, 3, 1), kinds[1:])
        up = Box("UP", (2, 2, 1), kinds[:1], low=(0, 0, 1), after=low)
        return low.cards() + up.cards() + MATERIAL

    def test_uniform_stress_between_bodies(self):
        for kinds in PAIRS:
            with self.subTest(kinds=kinds):
                result = self.solve(
                    self.bodies(kinds) + DRY + on_corner("LOW") + on_corner("UP") + "LOW-Z0, 3\n"
                    + PAIR.format(", SMALL SLIDING") + STEP
                    + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                )
                self.check_uniform(result)
                np.testing.assert_allclose(result.pairs[0].pressure[-1], PRESSURE, rtol=1e-9)

    def test_uniform_stress_over_areas_that_grow(self):
        for kinds in (
            ("C3D10", "C3D20R"), ("C3D20R", "C3D10"), ("C3D8", "C3D10"), ("corner2", "C3D13"),
        ):
            with self.subTest(kinds=kinds):
                result = self.solve(
                    self.bodies(kinds) + DRY + on_corner("LOW") + on_corner("UP") + "LOW-Z0, 3\n"
                    + PAIR.format("") + STEP + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                )
                self.check_uniform(result)
                wanted = PRESSURE / (1 + POISSON * PRESSURE / YOUNG) ** 2
                np.testing.assert_allclose(result.pairs[0].pressure[-1], wanted, rtol=1e-7)

    def test_uniform_stress_across_a_tie(self):
        for kinds in (
            ("C3D10", "C3D20R"), ("C3D20R", "C3D10"), ("C3D10", "C3D8"), ("C3D4", "C3D10"),
            ("C3D15", "C3D10"), ("C3D20R", "C3D6"),
        ):
            with self.subTest(kinds=kinds):
                self.check_uniform(self.solve(
                    self.bodies(kinds) + "*TIE, NAME=T\nUP-Z0, LOW-Z1\n"
                    + on_corner("LOW") + "LOW-Z0, 3\n" + STEP
                    + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                ))

    def test_rings_in_each_other(self):
        """Pressure all round: errors are those of the meshes, which do not fit into each other.

        Source of the limits: 1.1 times what an independent program has of the same meshes
        (../shared/design/elements.md, ring in a ring).
        """
        for kind, limit in (("C3D20R", 0.0118), ("C3D15", 0.0118), ("C3D10", 0.0096)):
            with self.subTest(kind=kind):
                inner = Ring("IN", 3, kind, 1.0)
                outer = Ring("OUT", 2, kind, 1.5, after=inner)
                held = "".join(f"{n}-Y0, 2\n{n}-Y1, 1\n{n}-Z0, 3\n" for n in ("IN", "OUT"))
                result = self.solve(
                    inner.cards() + outer.cards() + MATERIAL + DRY + "*BOUNDARY\n" + held
                    + "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE, SMALL SLIDING, "
                    "ADJUST=0.02\nIN-X1, OUT-X0\n" + STEP
                    + "*DSLOAD\nIN-X0, P, 1.\nOUT-X1, P, 1.\nIN-Z1, P, 1.\nOUT-Z1, P, 1.\n"
                    "*END STEP\n"
                )
                pair = result.pairs[0]
                error = pair.pressure[-1] - 1
                self.assertLess(np.sqrt(np.average(error**2, weights=pair.area)), 1.1 * limit)

    def test_a_block_slides_over_the_edge_of_its_master(self):
        """Action is reaction, and friction that of Coulomb's law, with a share of a face beyond."""
        for kinds in (
            ("C3D10", "C3D20R"), ("C3D20R", "C3D10"), ("C3D8", "C3D10"), ("corner2", "C3D13"),
        ):
            with self.subTest(kinds=kinds):
                low = Box("LOW", (3, 3, 1), kinds[1:], size=(1.5, 1.5, 0.5))
                up = Box("UP", (2, 2, 1), kinds[:1], low=(0.2, 0.2, 0.5), size=(1, 1, 0.5),
                         after=low)
                result = self.solve(
                    low.cards() + up.cards() + MATERIAL + DRY + "*FRICTION\n0.3\n"
                    "*BOUNDARY\nLOW-Z0, 1, 3\n" + PAIR.format("")
                    + "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nUP-Z1, 3, 3, -0.001\nUP-Z1, 1, 2, 0.\n"
                    "*END STEP\n*STEP\n*STATIC\n0.25, 1.\n*BOUNDARY\nUP-Z1, 1, 1, 0.34\n"
                    "*END STEP\n"
                )
                force = result.pairs[0].resultant[-1]
                self.assertAlmostEqual(abs(force[0]) / force[2], 0.3, delta=2e-3)
                support = result.field("reaction_force")
                np.testing.assert_allclose(
                    support[: len(low.x)].sum(axis=0), force, rtol=0, atol=1e-9 * force[2]
                )

    def test_a_held_middle_does_not_hold_the_ends_of_its_edge(self):
        """Lifted off its master with one mid-side node of the sole held: nothing stays behind."""
        for kind, sliding in itertools.product(("C3D10", "C3D20R"), ("", ", SMALL SLIDING")):
            with self.subTest(kind=kind, sliding=sliding):
                low = Box("LOW", (1, 1, 1), ("C3D8",))
                up = Box("UP", (1, 1, 1), (kind,), low=(0, 0, 1), after=low)
                middle = up.first + next(
                    i for i, x in enumerate(up.x) if np.allclose(x, (0, 0.5, 1))
                )
                cards = (
                    low.cards() + up.cards() + f"*NSET, NSET=HELD\n{middle}\n" + MATERIAL
                    + DRY + "*BOUNDARY\nHELD, 1, 3\nLOW-Z0, 1, 3\n" + STEP
                    + "*BOUNDARY\nUP-Z1, 3, 3, 0.001\nUP-Z1, 1, 2, 0.\n*END STEP\n"
                )
                free = self.solve(cards).field("reaction_force")
                pair = self.solve(cards.replace(STEP, PAIR.format(sliding) + STEP))
                np.testing.assert_allclose(
                    pair.field("reaction_force"), free, rtol=0, atol=1e-9 * abs(free).max()
                )

    def test_facets_are_the_plane_that_they_lie_in(self):
        x = [
            (-1, -1), (0.4, -1), (2, -1), (-1, 0.3), (0.6, 0.4), (2, 0.7), (-1, 2), (0.5, 2),
            (2, 2),
        ]
        nodes = "".join(f"{9001 + i}, {a}, {b}, 0.\n" for i, (a, b) in enumerate(x))
        shells = "".join(
            f"{900 + k}, {9001 + i}, {9002 + i}, {9005 + i}, {9004 + i}\n"
            for k, i in enumerate((0, 1, 3, 4))
        )
        tool = (
            "*NODE\n" + nodes + "*ELEMENT, TYPE=S4, ELSET=TOOL\n" + shells
            + "*SURFACE, NAME=FACETS, TYPE=ELEMENT\nTOOL, SPOS\n*NODE\n9999, 0., 0., -1.\n"
            "*RIGID BODY, ELSET=TOOL, REF NODE=9999\n"
        )
        for kind in ("C3D10", "C3D15", "C3D20R"):
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 1), (kind,))
                deck = (
                    box.cards() + tool + MATERIAL + DRY + "*BOUNDARY\n9999, 1, 3\n"
                    + on_corner("B").split("\n", 1)[1]
                    + "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE\nB-Z0, FACETS\n"
                    + STEP + f"*DSLOAD\nB-Z1, P, {PRESSURE}\n*END STEP\n"
                )
                result = self.solve(deck)
                x0 = result.points[: len(box.x)]
                u = result.field("displacement")[: len(box.x)]
                strain = np.array([POISSON, POISSON, -1.0]) * PRESSURE / YOUNG
                np.testing.assert_allclose(u - u[0], (x0 - x0[0]) * strain, rtol=0, atol=1e-10)


if __name__ == "__main__":
    unittest.main()
