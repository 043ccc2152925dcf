"""Supports, equations and local directions at the mid-side nodes of faces in contact.

Boxes of tests/cases/boxes.py.
"""

import unittest

import numpy as np
from boxes import DRY, MATERIAL, STEP, Box, BoxCase

KINDS = ("C3D10", "C3D15", "C3D20", "C3D20R")


def numbers(v):
    """Return numbers as the entries of a line."""
    return ", ".join(map(repr, np.array(v, float).tolist()))


class TurnedBox(Box):
    """A box of one element along each edge, turned about the origin by a matrix."""

    def __init__(self, kind, turn):
        super().__init__("B", (1, 1, 1), (kind,))
        self.flat = self.x
        self.x = self.x @ turn.T

    def side(self, axis, end):
        return [self.first + i for i in np.flatnonzero(abs(self.flat[:, axis] - end) < 1e-9)]


def turn_about(axis, angle):
    """Return the matrix of a turn (Rodrigues)."""
    x, y, z = np.array(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


class SecondOrderJoints(BoxCase):
    def check_lifted(self, kind, turn, held):
        """Pulled off a plane with a mid-side node of the sole held: as without the plane."""
        box = TurnedBox(kind, turn)
        middle = box.first + next(
            i for i, x in enumerate(box.flat) if np.allclose(x, (0, 0.5, 0))
        )
        cards = box.cards() + f"*NSET, NSET=HELD\n{middle}\n" + MATERIAL
        for name in ("HELD", "B-Z1"):
            cards += f"*TRANSFORM, NSET={name}, TYPE=R\n{numbers([*turn[:, 0], *turn[:, 1]])}\n"
        cards += held.format(middle)
        cards += STEP + "*BOUNDARY\nB-Z1, 3, 3, 0.001\nB-Z1, 1, 2, 0.\n*END STEP\n"
        floor = (
            f"*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., {numbers(turn[:, 2])}\n"
            "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, FLOOR\n"
        )
        free = self.solve(cards).field("reaction_force")
        result = self.solve(cards.replace(STEP, DRY + floor + STEP))
        np.testing.assert_allclose(
            result.field("reaction_force"), free, rtol=0, atol=1e-9 * abs(free).max()
        )
        self.assertEqual(abs(result.pairs[0].force).max(), 0)

    def test_middles_on_slanting_supports_do_not_hold_the_ends_of_their_edges(self):
        for kind in KINDS:
            for angle in (0.0, 0.6):
                with self.subTest(kind=kind, angle=angle):
                    self.check_lifted(kind, turn_about((1, 2, 0.5), angle), "*BOUNDARY\nHELD, 3\n")

    def test_middles_that_equations_hold_do_not_hold_the_ends_of_their_edges(self):
        """Along the normal of a slanting plane the node goes with one at rest."""
        held = (
            "*NODE, NSET=REST\n9999, 5., 5., 5.\n*BOUNDARY\nREST, 1, 3\n"
            "*EQUATION\n2\n{0}, 3, 1., 9999, 3, -1.\n"
        )
        for kind in KINDS:
            for angle in (0.0, 0.6):
                with self.subTest(kind=kind, angle=angle):
                    self.check_lifted(kind, turn_about((1, 2, 0.5), angle), held)

    def test_middles_may_be_held_along_rough_planes(self):
        """Pressed and dragged with a mid-side node of the sole held along it: all balances."""
        drag = np.array([0.002, 0.0005, -0.001])
        for kind in KINDS:
            along_axes = None
            for angle in (0.0, 0.6):
                with self.subTest(kind=kind, angle=angle):
                    turn = turn_about((1, 2, 0.5), angle)
                    box = TurnedBox(kind, turn)
                    middle = box.first + next(
                        i for i, x in enumerate(box.flat) if np.allclose(x, (0, 0.5, 0))
                    )
                    cards = box.cards() + f"*NSET, NSET=HELD\n{middle}\n" + MATERIAL
                    cards += DRY + "*FRICTION\n0.3\n"
                    for name in ("HELD", "B-Z1"):
                        cards += f"*TRANSFORM, NSET={name}, TYPE=R\n"
                        cards += numbers([*turn[:, 0], *turn[:, 1]]) + "\n"
                    cards += (
                        f"*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., {numbers(turn[:, 2])}\n"
                        "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, FLOOR\n"
                    )
                    found = []
                    for held in ("HELD, 1, 2\n", "HELD, 1\n", ""):
                        result = self.solve(
                            cards + STEP + "*BOUNDARY\n" + held
                            + "".join(f"B-Z1, {i}, {i}, {v}\n" for i, v in enumerate(drag, 1))
                            + "*END STEP\n"
                        )
                        contact, support = (
                            result.field(name) for name in ("contact_force", "reaction_force")
                        )
                        scale = abs(contact).max()
                        all_forces = contact + support
                        np.testing.assert_allclose(
                            all_forces.sum(axis=0), 0, rtol=0, atol=1e-9 * scale
                        )
                        np.testing.assert_allclose(
                            np.cross(result.points, all_forces).sum(axis=0), 0, rtol=0,
                            atol=1e-9 * scale,
                        )
                        found.append(result.pairs[0].resultant[-1] @ turn)
                    # However the scene is turned.
                    along_axes = found if along_axes is None else along_axes
                    np.testing.assert_allclose(found, along_axes, rtol=0, atol=1e-6 * scale)


if __name__ == "__main__":
    unittest.main()
