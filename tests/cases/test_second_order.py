"""Contact of elements of second order before planes, spheres and cylinders: mid-side nodes.

Boxes of tests/cases/boxes.py.
"""

import unittest

import numpy as np
from boxes import DRY, FLOOR, MATERIAL, STEP, Box, BoxCase, on_corner
from program import Run

KINDS = ("C3D10", "C3D13", "C3D15", "C3D20", "C3D20R")
ROUGH = "*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n0.3\n"
DRAGGED = (
    "*STEP\n*STATIC, DIRECT\n0.5, 1.\n*BOUNDARY\nB-Z1, 1, 2, 0.\nB-Z1, 3, 3, -0.1\n*END STEP\n"
    "*STEP\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\nB-Z1, 1, 1, 0.2\nB-Z1, 2, 2, 0.35\n*END STEP\n"
)


class SecondOrder(BoxCase):
    def test_all_solvers_of_the_paper_find_the_same_reactions(self):
        for kind in ("C3D10", "C3D20R"):
            box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5))
            found = {}
            for local in ("UZAWA", "NEWTON", "EXACT"):
                for law in ("BIPOTENTIAL", "PSEUDOPOTENTIAL"):
                    cards = (
                        f"*CONTACT SOLVER, SOLVER=SWEEPS, LOCAL={local}, FORMULATION={law}, "
                        "TOLERANCE=1e-11, MAX SWEEPS=100000\n"
                    )
                    deck = box.cards() + MATERIAL + ROUGH + FLOOR + cards + DRAGGED
                    found[local, law] = self.solve(deck).pairs[0].force
            cards = "*CONTACT SOLVER, SOLVER=GLOBAL NEWTON, TOLERANCE=1e-11\n"
            found["global"] = self.solve(
                box.cards() + MATERIAL + ROUGH + FLOOR + cards + DRAGGED
            ).pairs[0].force
            for name, force in found.items():
                with self.subTest(kind=kind, solver=name):
                    np.testing.assert_allclose(
                        force, found["global"], rtol=0, atol=1e-8 * abs(force).max()
                    )

    def test_forces_at_the_nodes_are_those_of_the_points(self):
        """Contact balances the supports, in force and moment, and areas add up to the face."""
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5))
                result = self.solve(box.cards() + MATERIAL + ROUGH + FLOOR + DRAGGED)
                pair = result.pairs[0]
                force = result.field("contact_force")
                support = result.field("reaction_force")
                scale = abs(support).max()
                total = pair.resultant[-1]
                np.testing.assert_allclose(force.sum(axis=0), total, rtol=0, atol=1e-9 * scale)
                np.testing.assert_allclose(
                    support.sum(axis=0) + total, 0, rtol=0, atol=1e-9 * scale
                )
                moment = np.cross(result.points, force + support).sum(axis=0)
                np.testing.assert_allclose(moment, 0, rtol=0, atol=1e-8 * scale)
                self.assertAlmostEqual(pair.area.sum(), 1.0, delta=1e-12)
                self.assertGreater(pair.area.min(), 0)
                gap = pair.gap[-1]
                self.assertGreater(gap.min(), -1e-10)

    def test_held_middles_do_not_hold_the_ends_of_their_edges(self):
        """Pulled off the plane, with a mid-side node of the sole held: no corner stays with it."""
        for kind in ("C3D10", "C3D20R"):
            with self.subTest(kind=kind):
                box = Box("B", (1, 1, 1), (kind,))
                middle = box.first + next(
                    i for i, x in enumerate(box.x) if np.allclose(x, (0, 0.5, 0))
                )
                held = f"*NSET, NSET=HELD\n{middle}\n"
                cards = (
                    box.cards() + held + MATERIAL + "*BOUNDARY\nHELD, 1, 3\n" + STEP
                    + "*BOUNDARY\nB-Z1, 3, 3, 0.001\nB-Z1, 1, 2, 0.\n*END STEP\n"
                )
                free = self.solve(cards).field("reaction_force")
                floor = self.solve(cards.replace(STEP, DRY + FLOOR + STEP))
                np.testing.assert_allclose(
                    floor.field("reaction_force"), free, rtol=0, atol=1e-9 * abs(free).max()
                )
                self.assertEqual(abs(floor.pairs[0].force).max(), 0)

    def test_a_small_sphere_does_not_press_before_it_touches(self):
        """Under a mid-side node of the sole, off by a twentieth of an element, and then in it."""
        for kind in ("C3D10", "C3D20R"):
            box = Box("B", (2, 2, 1), (kind,), size=(2, 2, 1), shift=0)
            for radius in (0.1, 1.0, 5.0):
                with self.subTest(kind=kind, radius=radius):
                    sphere = (
                        f"*NODE\n9001, 0.5, 1., {-radius - 0.05}\n*OBSTACLE, NAME=BALL, "
                        f"TYPE=SPHERE, REF NODE=9001\n0.5, 1., {-radius - 0.05}, {radius}\n"
                        "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, BALL\n"
                    )
                    step = (
                        "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nB-Z1, 1, 3, 0.\n"
                        "9001, 1, 2, 0.\n9001, 3, 3, {}\n*END STEP\n"
                    )
                    deck = box.cards() + MATERIAL + DRY + sphere
                    result = self.solve(deck + step.format(0.049))
                    self.assertEqual(abs(result.pairs[0].force).max(), 0)
                    result = self.solve(deck + step.format(0.051))
                    self.assertGreater(result.pairs[0].resultant[-1, 2], 0)

    def test_pressing_at_a_distance_is_an_error_of_the_mesh(self):
        """A ball that presses between the nodes of elements twice its radius."""
        box = Box("B", (2, 2, 1), ("C3D10",), size=(2, 2, 1), shift=0)
        deck = (
            box.cards() + MATERIAL + DRY + "*NODE\n9001, 0.5, 1., {0}\n*OBSTACLE, NAME=BALL, "
            "TYPE=SPHERE, REF NODE=9001\n0.5, 1., {0}, {1}\n*CONTACT PAIR, INTERACTION=DRY\n"
            "B-Z0, BALL\n*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nB-Z1, 1, 3, 0.\n"
            "9001, 1, 2, 0.\n9001, 3, 3, 0.2\n*END STEP\n"
        )
        error = {r: self.solve(deck.format(-r, r)).history("error/mesh")[-1] for r in (2.0, 8.0)}
        self.assertGreater(error[2.0], 0.2)
        self.assertLess(error[8.0], 0.1)

    def test_a_bump_in_the_gap_is_that_of_all_nodes(self):
        """A uniform *CONTACT GAP is closed by a stroke as long, everywhere alike."""
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 2), (kind,))
                deck = (
                    box.cards() + MATERIAL + DRY + on_corner("B") + FLOOR
                    + "*CONTACT GAP\nB-Z0, 0.01\n" + STEP
                    + "*BOUNDARY\nB-Z1, 3, 3, -0.011\n*END STEP\n"
                )
                result = self.solve(deck)
                pressure = result.pairs[0].pressure[-1]
                np.testing.assert_allclose(pressure, 210000.0 * 0.001, rtol=1e-8)

    def test_points_at_the_rim_of_contact_know_the_ends_of_their_edges(self):
        """Most nodes cannot reach the plane; those beside them are ends of edges that can."""
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (3, 3, 3), (kind,), size=(4, 4, 4), shift=0)
                deck = (
                    box.cards() + MATERIAL + DRY + on_corner("B") + FLOOR
                    + "*CONTACT GAP, PARABOLA\nB-Z0, 0., 0., 0., 20.\n" + STEP
                    + "*BOUNDARY\nB-Z1, 1, 2, 0.\nB-Z1, 3, 3, -0.06\n*END STEP\n"
                )
                result = self.solve(deck)
                press = result.pairs[0].pressure[-1] > 0
                self.assertGreater(press.sum(), 2)
                self.assertLess(press.sum(), len(press) / 2)

    def test_a_chain_of_reduced_elements_has_no_mechanisms(self):
        """Clamped at one end: with 8 points each there is a motion without strain an element."""
        box = Box("B", (4, 1, 1), ("C3D20R",), size=(4, 1, 1), shift=0)
        deck = (
            box.cards() + MATERIAL + "*BOUNDARY\nB-X0, 1, 3\n" + STEP
            + "*DLOAD\nB, GRAV, 1., 0., 0., -1.\n*END STEP\n"
        )
        sag = {}
        for kind in ("C3D20R", "C3D20"):
            run = Run(deck.replace("C3D20R", kind), name="deck")
            self.assertEqual(run.status, 0, run.errors)
            noted = "4 elements of C3D20R have four faces or more without" in run.output
            self.assertEqual(noted, kind == "C3D20R")
            result = run.result()
            self.addCleanup(result.close)
            sag[kind] = result.field("displacement")[:, 2].min()
        # Two rules that leave nothing out; neither is exact beside a clamp.
        self.assertAlmostEqual(sag["C3D20R"] / sag["C3D20"], 1, delta=3e-3)

    def test_reduced_elements_beside_a_clamp_have_no_direction(self):
        """A plate one element thick that is clamped below, and turned with its load."""
        turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
        box = Box("B", (2, 2, 1), ("C3D20R",), size=(2, 2, 1), shift=0)
        found = []
        for axes in (np.eye(3), turn):
            below = "\n".join(map(str, box.side(2, 0)))
            placed = box.cards().split("*NODE\n")[1].split("*ELEMENT")[0]
            cards = box.cards().replace(placed, "".join(
                f"{i + 1}, {x!r}, {y!r}, {z!r}\n"
                for i, (x, y, z) in enumerate((box.x @ axes).tolist())
            ))
            force = (np.array([0.3, 0.0, -1.0]) @ axes).tolist()
            result = self.solve(
                cards + MATERIAL + f"*NSET, NSET=BELOW\n{below}\n*BOUNDARY\nBELOW, 1, 3\n"
                + STEP + "*CLOAD\n" + "".join(
                    f"{box.side(2, 1)[0]}, {k + 1}, {force[k]!r}\n" for k in range(3)
                ) + "*END STEP\n"
            )
            found.append(result.field("displacement") @ axes.T)
        np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-9 * abs(found[0]).max())

    def test_odd_shapes_of_reduced_elements_have_no_mechanisms(self):
        """Elements at places of a grid, held at a side of the first, under their weight."""
        plate = [(i, j, 0) for i in range(3) for j in range(3)]
        block = [(i, j, k) for i in range(2) for j in range(2) for k in range(2)]
        shapes = {
            "ring": [at for at in plate if at != (1, 1, 0)],
            "angle": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 2, 0)],
            "tee": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0), (1, 2, 0)],
            "tongue": [*plate, (3, 1, 0), (4, 1, 0)],
            "peg": [*block, (2, 0, 0), (3, 0, 0)],
            "bridge": [*block, (2, 0, 0), *((i + 3, j, k) for i, j, k in block)],
            "strip": [(i, j, 0) for i in range(2) for j in range(4)],
        }
        for name, places in shapes.items():
            with self.subTest(name):
                n = tuple(int(m) for m in np.max(places, axis=0) + 1)
                box = Box("B", n, ("C3D20R",), size=n, shift=0)
                numbers = [np.ravel_multi_index(at, n) for at in places]
                elements = [box.elements["C3D20R"][i] for i in numbers]
                used = sorted({node for _, *nodes in elements for node in nodes})
                held = [i for i in elements[0][1:] if box.x[i - 1, 0] == 0]
                cards = "*NODE\n"
                for i in used:
                    cards += f"{i}, " + ", ".join(map(str, box.x[i - 1].tolist())) + "\n"
                cards += "*ELEMENT, TYPE=C3D20R, ELSET=B\n"
                cards += "".join(", ".join(map(str, element)) + "\n" for element in elements)
                cards += "*NSET, NSET=HELD\n" + "".join(f"{i}\n" for i in held)
                result = self.solve(
                    cards + "*SOLID SECTION, ELSET=B, MATERIAL=STEEL\n" + MATERIAL
                    + "*BOUNDARY\nHELD, 1, 3\n" + STEP
                    + "*DLOAD\nB, GRAV, 1., 0.3, 0.5, -1.\n*END STEP\n"
                )
                # A mechanism goes to any length.
                self.assertLess(abs(result.field("displacement")).max(), 10.0)

    def test_what_does_not_match(self):
        """An edge with a middle on one side alone; a quadrilateral beside two triangles."""
        nodes = (
            "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 1., 1., 0.\n4, 0., 1., 0.\n5, 0., 0., 1.\n"
            "6, 1., 0., 1.\n7, 1., 1., 1.\n8, 0., 1., 1.\n9, 2., 0., 0.\n10, 2., 1., 0.\n"
            "11, 2., 0., 1.\n12, 2., 1., 1.\n"
        )
        rest = (
            "*SOLID SECTION, ELSET=B, MATERIAL=STEEL\n" + MATERIAL
            + "*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 1, 3\n4, 1, 3\n" + STEP
            + "*DLOAD\nB, GRAV, 1., 0., 0., -1.\n*END STEP\n"
        )
        cube = "*ELEMENT, TYPE=C3D8, ELSET=B\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
        # The wedges have triangles on the cube's side: 2 3 7 and 2 7 6.
        wedges = (
            "*ELEMENT, TYPE=C3D6, ELSET=B\n2, 2, 3, 7, 9, 10, 12\n3, 2, 7, 6, 9, 12, 11\n"
        )
        run = Run(nodes + cube + wedges + rest, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("face 4 of element 1 is a quadrilateral beside two triangles", run.output)
        middles = [(2, 3), (3, 7), (7, 2), (9, 10), (10, 12), (12, 9), (2, 9), (3, 10), (7, 12)]
        places = dict(zip(range(1, 13), (
            (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
            (2, 0, 0), (2, 1, 0), (2, 0, 1), (2, 1, 1),
        ), strict=True))
        second = "*NODE\n"
        for i, (a, b) in enumerate(middles, 13):
            second += f"{i}, " + ", ".join(
                str((p + q) / 2) for p, q in zip(places[a], places[b], strict=True)
            ) + "\n"
        second += "*ELEMENT, TYPE=C3D15, ELSET=B\n2, 2, 3, 7, 9, 10, 12,\n" + ", ".join(
            map(str, range(13, 22))
        ) + "\n"
        run = Run(nodes + cube + second + rest, name="deck")
        self.assertEqual(run.status, 1, run.output)
        self.assertIn("but not the same node in its middle", run.errors)

    def test_an_edge_that_is_half_of_another(self):
        """A tetrahedron beside a hexahedron, from a corner of it to the middle of an edge."""
        box = Box("B", (1, 1, 1), ("C3D20",))
        deck = (
            box.cards() + "*NODE\n8001, 2., 0.2, 0.2\n"
            + "*ELEMENT, TYPE=C3D4, ELSET=B\n9, 5, 10, 6, 8001\n" + MATERIAL + on_corner("B")
            + STEP + "*DSLOAD\nB-Z1, P, 1.\n*END STEP\n"
        )
        run = Run(deck, name="deck")
        self.assertEqual(run.status, 1, run.output)
        self.assertIn(
            "the edge of element 9 from node 5 to node 10 is half of an edge of element 1: join "
            "parts of first and second order by *TIE", run.errors
        )  # fmt: skip

    def test_what_is_refused(self):
        box = Box("B", (1, 1, 1), ("C3D20R",))
        alone = box.cards() + MATERIAL + DRY + on_corner("B") + FLOOR
        press = STEP + "*DSLOAD\nB-Z1, P, 1.\n*END STEP\n"
        for wanted, deck in (
            ("an element of this type has an id and 20 nodes", alone.replace(
                "C3D20R", "C3D20", 1).replace("1, 1, 5,", "1, 5,", 1) + press),
        ):
            with self.subTest(wanted):
                run = Run(deck, name="deck")
                self.assertEqual(run.status, 1, run.output)
                self.assertIn(wanted, run.errors)


if __name__ == "__main__":
    unittest.main()
