"""Elements of second order: sets of mid-side nodes alone, runs that are continued, ties.

Boxes of tests/cases/boxes.py.
"""

import unittest

import h5py
import numpy as np
from boxes import DRY, FLOOR, MATERIAL, SOFT, Box, BoxCase, pushed
from program import Run

KINDS = ("C3D10", "C3D15", "C3D20", "C3D20R")


class Sets(unittest.TestCase):
    def test_mid_side_nodes_alone_are_noted(self):
        for kind in KINDS:
            box = Box("B", (1, 1, 1), (kind,), shift=0.0)
            corners = 8
            sole = box.side(2, 0)
            middles = [node for node in sole if node - box.first >= corners]
            deck = box.cards() + MATERIAL + DRY + FLOOR.replace("B-Z0", "SOLE")
            deck += "*BOUNDARY\nB-X0, 1\nB-Y0, 2\n*STEP\n*STATIC\n*BOUNDARY\nB-Z1, 3, 3, -0.01\n"
            for nodes, lone in ((middles, len(middles)), (sole, 0), ([*middles, sole[0]], None)):
                with self.subTest(kind=kind, nodes=len(nodes)):
                    surface = "*SURFACE, NAME=SOLE, TYPE=NODE\n" + "".join(
                        f"{node}\n" for node in nodes
                    )
                    text = deck.replace("*MATERIAL", surface + "*MATERIAL", 1) + "*END STEP\n"
                    run = Run(text, name="deck")
                    self.assertEqual(run.status, 0, run.errors + run.output)
                    words = "mid-side nodes without the corners of their edges"
                    found = [line for line in run.output.splitlines() if words in line]
                    self.assertEqual(len(found), int(lone != 0), run.output)
                    if lone:
                        self.assertIn(f"'SOLE' has {lone} mid-side nodes", found[0])
                        self.assertIn(f"node {middles[0]})", found[0])


class Sheets(BoxCase):
    def test_sheets_that_bend_too_far_without_contact_are_named(self):
        """1000 times as wide as high, pressed down: by a pressure refused, by its top solved."""
        box = Box("B", (2, 2, 1), ("C3D20R",), size=(1000, 1000, 1))
        deck = box.cards() + SOFT + DRY + FLOOR + "*BOUNDARY\nB-X0, 1\nB-Y0, 2\n*STEP\n*STATIC\n"
        run = Run(deck + "*DSLOAD\nB-Z1, P, 1.\n*END STEP\n", name="deck")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("without contact the loads would move the bodies", run.errors)
        self.solve(deck + "*BOUNDARY\nB-Z1, 3, 3, -0.001\n*END STEP\n")


class Continued(unittest.TestCase):
    """A run that is ended by a signal and continued gives what it gives in one go, to the bit."""

    def check(self, deck):
        whole = Run(deck, name="deck")
        self.assertEqual(whole.status, 0, whole.errors)
        parts = Run(deck, "--continue", name="deck", ended_at=("1", "1"))
        self.assertEqual(parts.status, 0, parts.errors)
        with h5py.File(whole.file) as one, h5py.File(parts.file) as other:
            self.assertTrue(other["run"].attrs["continued"].strip())
            for name in ("displacement", "contact_force", "reaction_force"):
                name = f"VTKHDF/PointData/{name}"
                np.testing.assert_array_equal(one[name][()], other[name][()], name)

    def test_two_bodies(self):
        self.check(pushed("C3D10", "C3D20"))
        self.check(pushed("C3D15", "C3D20R", sliding=", SMALL SLIDING"))

    def test_at_finite_strain(self):
        self.check(pushed("C3D20", "C3D10", options=", NLGEOM"))

    def test_before_a_sphere(self):
        """Which mid-side points press alone goes on as it was."""
        ball = (
            "*OBSTACLE, NAME=BALL, TYPE=SPHERE\n0.45, 0.55, -1.49,  1.5\n"
            "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, BALL\n"
        )
        for kind in ("C3D10", "C3D20"):
            with self.subTest(kind=kind):
                self.check(pushed(kind, "C3D20", master=ball))


class Tied(BoxCase):
    def test_ties_at_finite_strain_are_one_mesh(self):
        """Two boxes whose meshes match, bent and turned by a fifth of their length."""
        end = (
            "*STEP, NLGEOM\n*STATIC, DIRECT\n0.5, 1.\n*BOUNDARY\n{low}-Z0, 1, 3\n{up}-Z1, 1, 1, 0.4"
            "\n{up}-Z1, 3, 3, -0.1\n*END STEP\n"
        )
        for kind in ("C3D10", "C3D20", "C3D20R"):
            with self.subTest(kind=kind):
                whole = Box("B", (2, 2, 4), (kind,), size=(1, 1, 2), shift=0.0)
                low = Box("A", (2, 2, 2), (kind,), shift=0.0)
                up = Box("B", (2, 2, 2), (kind,), low=(0, 0, 1), after=low, shift=0.0)
                one = self.solve(whole.cards() + SOFT + end.format(low="B", up="B"))
                two = self.solve(low.cards() + up.cards() + SOFT + "*TIE, NAME=T\nB-Z0, A-Z1\n"
                                 + end.format(low="A", up="B"))  # fmt: skip
                at = {tuple(np.round(x, 9)): u for x, u in
                      zip(one.points, one.field("displacement", -1), strict=True)}  # fmt: skip
                true = np.array([at[tuple(np.round(x, 9))] for x in two.points])
                found = two.field("displacement", -1)
                np.testing.assert_allclose(found, true, rtol=0, atol=1e-8)
                forces = [r.field("reaction_force", -1)[r.points[:, 2] < 1e-9].sum(axis=0)
                          for r in (one, two)]  # fmt: skip
                np.testing.assert_allclose(*forces, rtol=0, atol=1e-6 * abs(forces[0]).max())


if __name__ == "__main__":
    unittest.main()
