"""Tetrahedra, wedges and pyramids, alone and beside hexahedra, of first and second order: what any
mesh has exactly, what is refused.
"""

import itertools
import unittest

import numpy as np
from boxes import (
    DRY,
    EDGES,
    FLOOR,
    MATERIAL,
    POISSON,
    PRESSURE,
    STEP,
    VTK_TYPES,
    YOUNG,
    Box,
    BoxCase,
    on_corner,
)
from program import Run


class FreeMeshes(BoxCase):
    def test_uniform_stress_on_a_floor(self):
        for kinds in (
            ("C3D4",), ("C3D6",), ("C3D8", "C3D6"), ("C3D5",), ("corner",), ("C3D8", "C3D5"),
            ("C3D6", "C3D5"), ("C3D8", "join", "C3D4"),
            ("C3D10",), ("C3D15",), ("C3D20",), ("C3D20R",), ("C3D20", "C3D15"), ("corner2",),
            ("C3D20", "join2", "C3D10"),
        ):
            with self.subTest(kinds=kinds):
                box = Box("B", (3, 3, 3), kinds)
                deck = (
                    box.cards() + MATERIAL + DRY + on_corner("B") + FLOOR + STEP
                    + f"*DSLOAD\nB-Z1, P, {PRESSURE}\n*EL FILE, POSITION=AVERAGED AT NODES\nS\n"
                    + "*END STEP\n"
                )
                result = self.solve(deck)
                self.check_uniform(result)
                stress = result.field("stress", on="nodes")
                np.testing.assert_allclose(
                    stress, [[0, 0, -PRESSURE, 0, 0, 0]] * len(stress), rtol=0, atol=1e-9
                )
                np.testing.assert_allclose(result.pairs[0].pressure[-1], PRESSURE, rtol=1e-9)
                types = result.file["VTKHDF/Types"][:]
                counts = {VTK_TYPES[kind]: len(cells) for kind, cells in box.elements.items()}
                self.assertEqual({int(t): int((types == t).sum()) for t in set(types)}, counts)

    def test_displacements_of_second_degree_are_exact(self):
        """Pure bending, prescribed on the surface: inner nodes follow, and stress is linear."""
        for kinds in (("corner2",), ("C3D20", "join2", "C3D10")):
            with self.subTest(kinds=kinds):
                box = Box("B", (3, 2, 2), kinds, shift=0)
                x, y, z = box.x.T
                u = 0.01 * np.stack(
                    [-x * z, POISSON * y * z, (x**2 + POISSON * (z**2 - y**2)) / 2], axis=1
                )
                outer = ((box.x < 1e-9) | (box.x > 1 - 1e-9)).any(axis=1)
                self.assertTrue((~outer).any())
                held = "".join(
                    f"{box.first + a}, {i + 1}, {i + 1}, {u[a, i].item()!r}\n"
                    for a in np.flatnonzero(outer) for i in range(3)
                )
                result = self.solve(
                    box.cards() + MATERIAL + STEP + "*BOUNDARY\n" + held
                    + "*EL FILE, POSITION=AVERAGED AT NODES\nS\n*END STEP\n"
                )
                np.testing.assert_allclose(result.field("displacement"), u, rtol=0, atol=1e-14)
                stress = result.field("stress", on="nodes")
                np.testing.assert_allclose(stress[:, 0], -0.01 * YOUNG * z, rtol=0, atol=1e-8)
                np.testing.assert_allclose(stress[:, 1:], 0, rtol=0, atol=1e-8)

    def test_uniform_stress_between_bodies(self):
        """Slave and master faces are triangles that do not match."""
        every = [*itertools.product(("C3D4", "C3D6", "C3D8"), repeat=2)][:-1]
        every += [("C3D5", "C3D8"), ("C3D8", "C3D5"), ("corner", "C3D4"), ("C3D5", "corner")]
        for kinds in every:
            with self.subTest(kinds=kinds):
                low = Box("LOW", (3, 3, 2), kinds[1:])
                up = Box("UP", (2, 2, 2), kinds[:1], low=(0, 0, 1), after=low)
                deck = (
                    low.cards() + up.cards() + MATERIAL + DRY + on_corner("LOW") + on_corner("UP")
                    + "LOW-Z0, 3\n*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE\n"
                    "UP-Z0, LOW-Z1\n" + STEP + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                )
                result = self.solve(deck)
                self.check_uniform(result)
                # Over areas that have grown.
                wanted = PRESSURE / (1 + POISSON * PRESSURE / YOUNG) ** 2
                np.testing.assert_allclose(result.pairs[0].pressure[-1], wanted, rtol=1e-7)

    def test_uniform_stress_across_a_tie(self):
        for kinds in (
            ("C3D4", "C3D4"), ("C3D6", "C3D8"), ("C3D8", "C3D4"), ("C3D5", "C3D8"),
            ("corner", "C3D5"), ("C3D13", "C3D8"),
        ):
            with self.subTest(kinds=kinds):
                low = Box("LOW", (3, 3, 2), kinds[1:])
                up = Box("UP", (2, 2, 2), kinds[:1], low=(0, 0, 1), after=low)
                deck = (
                    low.cards() + up.cards() + MATERIAL + "*TIE, NAME=T\nUP-Z0, LOW-Z1\n"
                    + on_corner("LOW") + "LOW-Z0, 3\n" + STEP
                    + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                )
                self.check_uniform(self.solve(deck))

    def test_a_rise_of_temperature_strains_a_free_body(self):
        for kinds in (
            ("C3D4",), ("C3D6", "C3D8"), ("C3D5",), ("corner",), ("C3D10",), ("C3D20", "C3D15"),
            ("C3D20R",), ("C3D13",),
        ):
            with self.subTest(kinds=kinds):
                box = Box("B", (2, 2, 2), kinds)
                deck = (
                    box.cards() + MATERIAL + "*EXPANSION\n1e-5\n" + on_corner("B") + "B-Z0, 3\n"
                    + f"*NSET, NSET=ALL, GENERATE\n1, {len(box.x)}\n"
                    + STEP + "*TEMPERATURE\nALL, 50.\n*END STEP\n"
                )
                result = self.solve(deck)
                x = result.points
                np.testing.assert_allclose(
                    result.field("displacement"), 5e-4 * x, rtol=0, atol=1e-12
                )

    def test_the_floor_carries_the_weight(self):
        for kinds in (
            ("C3D4",), ("C3D6",), ("C3D5",), ("corner",), ("C3D8", "join"), ("C3D10",),
            ("C3D20R", "C3D15"), ("C3D20",), ("C3D13",),
        ):
            with self.subTest(kinds=kinds):
                box = Box("B", (2, 3, 2), kinds, size=(1, 2, 3))
                deck = (
                    box.cards() + MATERIAL + DRY + on_corner("B") + FLOOR + STEP
                    + "*DLOAD\n, GRAV, 9.81, 0., 0., -1.\n*END STEP\n"
                )
                result = self.solve(deck)
                np.testing.assert_allclose(
                    result.pairs[0].resultant[-1], [0, 0, 6000.0 * 9.81], rtol=1e-9, atol=1e-6
                )

    def test_middles_of_a_pyramid_may_have_the_order_of_gmsh(self):
        """One edge is bent: the sets of eight nodes are told apart by all of them."""
        x = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0], [0.5, 1, 2.0]])
        x = np.concatenate([x, [x[list(edge)].mean(axis=0) for edge in EDGES["C3D13"][1]]])
        x[12] += 0.1
        results = []
        for middles in (range(6, 14), (6, 9, 10, 7, 11, 8, 12, 13)):
            deck = "*NODE\n" + "".join(f"{i}, {a}, {b}, {c}\n" for i, (a, b, c) in enumerate(x, 1))
            deck += f"*ELEMENT, TYPE=C3D13, ELSET=B\n1, 1, 2, 3, 4, 5, {str([*middles])[1:-1]}\n"
            deck += (
                "*SOLID SECTION, ELSET=B, MATERIAL=STEEL\n" + MATERIAL + "*NSET, NSET=BASE\n"
                "1, 2, 3, 4\n*BOUNDARY\nBASE, 1, 3\n" + STEP + "*CLOAD\n5, 1, 1.\n*END STEP\n"
            )
            results.append(self.solve(deck).field("displacement"))
        np.testing.assert_allclose(results[0], results[1], rtol=1e-12)

    def test_faces_of_a_pyramid_have_the_numbers_of_the_page_of_decks(self):
        x = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0], [0.5, 1, 2.0]])
        faces = ((1, 4, 3, 2), (1, 2, 5), (2, 3, 5), (3, 4, 5), (4, 1, 5))
        deck = "*NODE\n" + "".join(f"{i}, {a}, {b}, {c}\n" for i, (a, b, c) in enumerate(x, 1))
        deck += (
            "*ELEMENT, TYPE=C3D5, ELSET=B\n1, 1, 2, 3, 4, 5\n*SOLID SECTION, ELSET=B, "
            "MATERIAL=STEEL\n" + MATERIAL + "*NSET, NSET=ALL, GENERATE\n1, 5\n*SURFACE, NAME=F\n"
            "1, S{0}\n*BOUNDARY\nALL, 1, 3\n" + STEP + "{1}\n*END STEP\n"
        )
        for k, face in enumerate(faces, 1):
            corners = x[np.array(face) - 1]
            area = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            area = area if len(face) == 4 else area / 2
            for load in (f"*DLOAD\n1, P{k}, 7.", "*DSLOAD\nF, P, 7."):
                with self.subTest(face=k, load=load):
                    result = self.solve(deck.format(k, load))
                    force = result.field("reaction_force").sum(axis=0)
                    np.testing.assert_allclose(force, 7 * area, rtol=0, atol=1e-10)

    def test_a_block_of_pyramids_slides_as_one_of_hexahedra(self):
        """Six pyramids instead of a hexahedron: pressed and dragged over a body of hexahedra."""
        forces = {}
        for kinds in (("C3D8", "C3D8"), ("C3D5", "C3D8"), ("C3D8", "C3D5"), ("corner", "C3D8")):
            with self.subTest(kinds=kinds):
                low = Box("LOW", (3, 3, 2), kinds[1:], size=(1.5, 1.5, 1), shift=0)
                up = Box("UP", (2, 2, 2), kinds[:1], low=(0.2, 0.2, 1), after=low, shift=0)
                result = self.solve(
                    low.cards() + up.cards() + MATERIAL
                    + "*SURFACE INTERACTION, NAME=ROUGH\n*FRICTION\n0.3\n*BOUNDARY\nLOW-Z0, 1, 3\n"
                    "*CONTACT PAIR, INTERACTION=ROUGH, TYPE=SURFACE TO SURFACE\nUP-Z0, LOW-Z1\n"
                    "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nUP-Z1, 3, 3, -0.001\nUP-Z1, 1, 2, 0.\n"
                    "*END STEP\n*STEP\n*STATIC\n0.25, 1.\n*BOUNDARY\nUP-Z1, 1, 1, 0.003\n"
                    "*END STEP\n"
                )
                pair = result.pairs[0]
                force = pair.resultant[[1, -1]]
                # Pressed, and at last sliding; not all points along x, for the block bulges.
                self.assertAlmostEqual(abs(force[1, 0]) / force[1, 2], 0.3, delta=5e-4)
                support = result.field("reaction_force")
                np.testing.assert_allclose(
                    support[: len(low.x)].sum(axis=0), force[1], rtol=0, atol=1e-6
                )
                forces[kinds] = force[:, 2]
        for kinds, force in forces.items():
            np.testing.assert_allclose(force, forces["C3D8", "C3D8"], rtol=0.04, err_msg=kinds)

    def test_a_flat_deck_is_the_same_mesh(self):
        box = Box("B", (3, 2, 2), ("C3D8", "join", "C3D4"))
        deck = (
            box.cards() + MATERIAL + "*BOUNDARY\nB-Z0, 1, 3\n" + STEP
            + f"*DSLOAD\nB-Z1, P, {PRESSURE}\n*END STEP\n"
        )
        flat = Run(deck, "--flat", name="deck")
        self.assertEqual(flat.status, 0, flat.errors)
        self.assertIn("TYPE=C3D5", flat.output)
        found = [self.solve(text).field("displacement") for text in (deck, flat.output)]
        np.testing.assert_array_equal(*found)

    def test_a_cantilever_sags_as_the_page_of_decks_says(self):
        # By Timoshenko's theory, with 5/6 of the section against shear.
        length, weight = 10.0, 1000.0
        shear = YOUNG / (2 * (1 + POISSON))
        exact = weight * length**4 / (8 * YOUNG / 12) + weight * length**2 / (2 * shear * 5 / 6)
        for n, percent in ((1, 22), (4, 79)):
            with self.subTest(n=n):
                box = Box("B", (10 * n, n, n), ("C3D4",), size=(length, 1, 1), shift=0)
                result = self.solve(
                    box.cards() + MATERIAL + "*BOUNDARY\nB-X0, 1, 3\n" + STEP
                    + "*DLOAD\nB, GRAV, 1., 0., 0., -1.\n*END STEP\n"
                )
                tip = result.points[:, 0] == length
                sag = -result.field("displacement")[tip, 2].mean()
                self.assertEqual(round(100 * sag / exact), percent)

    def test_what_is_refused(self):
        box = Box("B", (1, 1, 1), ("C3D4",))
        deck = (
            box.cards() + MATERIAL + "*BOUNDARY\nB-Z0, 1, 3\n" + STEP
            + "*DLOAD\n{}, {}, 1.\n*END STEP\n"
        )
        # With its third corner at 0.5, 0.5 the base is not convex.
        pyramid = (
            "*NODE\n1, 0., 0., 0.\n2, 2., 0., 0.\n3, {}, {}, 0.\n4, 0., 2., 0.\n5, .3, .3, 2.\n"
            "*ELEMENT, TYPE=C3D5, ELSET=B\n1, 1, 2, 3, 4, 5\n*SOLID SECTION, ELSET=B, "
            "MATERIAL=STEEL\n" + MATERIAL + "*NSET, NSET=ALL, GENERATE\n1, 5\n*BOUNDARY\n"
            "ALL, 1, 3\n" + STEP + "*DLOAD\n1, P1, 1.\n*END STEP\n"
        )
        for wanted, text in (
            ("element 1 is a 4-node tetrahedron: it has no face 5", deck.format(1, "P5")),
            ("a *BLOCK consists of hexahedra",
             "*BLOCK, NAME=A, NX=1, NY=1, NZ=1, TYPE=C3D4\n0., 0., 0., 1., 1., 1.\n" + deck),
            ("an element of this type has an id and 4 nodes",
             deck.replace("1, 1, 5, 7, 8", "1, 1, 5, 7")),
            ("element 1 is inside out or flat",
             pyramid.format(2, 2).replace(".3, 2.", ".3, -2.")),
            ("element 1 is too distorted: its Jacobian reaches", pyramid.format(0.5, 0.5)),
        ):
            with self.subTest(wanted=wanted):
                run = Run(text, name="deck")
                self.assertEqual(run.status, 1, run.output)
                self.assertIn(wanted, run.errors)


if __name__ == "__main__":
    unittest.main()
