"""Finite strain of all types of elements: patch tests, contact, ties, pressures, heat, solvers.

Boxes of tests/cases/boxes.py.
"""

import unittest

import numpy as np
from boxes import DRY, Box, BoxCase
from finite_laws import NEO, SVK, E, cauchy_stress
from scipy.optimize import brentq

SECOND = ("C3D10", "C3D13", "C3D15", "C3D20", "C3D20R")
KINDS = ("C3D4", "C3D5", "C3D6", *SECOND)
LAWS = {
    "svk": SVK,
    "neo": NEO,
    "mooney": "*HYPERELASTIC, MOONEY-RIVLIN\n20., 18., 0.012",
    "foam": "*HYPERFOAM, N=1\n80., -2., 0.25",
}
ROUGH = "*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n0.3\n"
CORNER = "*BOUNDARY\nB-X0, 1\nB-Y0, 2\n"
FLOOR = (
    "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n"
    "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, FLOOR\n"
)
TIGHT = "*CONTACT SOLVER, TOLERANCE=1e-11\n"


def material(law=NEO, more=""):
    return f"*MATERIAL, NAME=STEEL\n{law}\n{more}"


def step(cards, increment="0.25", first=True, fields=""):
    nlgeom = ", NLGEOM" if first else ""
    return f"*STEP{nlgeom}\n*STATIC\n{increment}, 1.\n{fields}{cards}*END STEP\n"


def moved(box, nodes, way):
    """Cards that prescribe the displacements of nodes, a function of their place."""
    return "*BOUNDARY\n" + "".join(
        f"{n}, {i + 1}, {i + 1}, {float(v)!r}\n"
        for n in nodes
        for i, v in enumerate(way(box.x[n - box.first]))
    )


def stretch_across(law, along):
    """The stretch across a uniaxial stress."""
    return brentq(lambda a: cauchy_stress(law, (along, a, a))[1], 0.8, 1.6, xtol=1e-15)


class FiniteCells(BoxCase):
    def test_one_gradient(self):
        """Any gradient of the displacement at the rim is the one inside, and stress is uniform."""
        gradient = np.array([[0.2, 0.3, -0.2], [-0.3, -0.15, 0.2], [0.2, -0.3, 0.1]])
        # Every element, and every law in one of each order.
        for kind in KINDS:
            for name, law in LAWS.items():
                if name != "mooney" and kind not in ("C3D4", "C3D20"):
                    continue
                with self.subTest(kind=kind, law=name):
                    box = Box("B", (2, 2, 2), (kind,))
                    rim = [
                        box.first + i
                        for i, x in enumerate(box.x)
                        if np.any((x < 1e-9) | (x > 1 - 1e-9))
                    ]
                    result = self.solve(
                        box.cards()
                        + material(law)
                        + step(
                            moved(box, rim, lambda x: gradient @ x),
                            fields="*EL FILE\nS, E, EG, PK2\n",
                        )
                    )
                    u = result.field("displacement")
                    np.testing.assert_allclose(u, result.points @ gradient.T, rtol=0, atol=1e-12)
                    stress = result.field("stress")
                    size = abs(stress).max()
                    first = stress[[0] * len(stress)]
                    np.testing.assert_allclose(stress, first, rtol=0, atol=1e-11 * size)
                    f = np.eye(3) + gradient
                    green = ((f.T @ f - np.eye(3)) / 2)[(0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)]
                    found = result.field("green_strain")
                    np.testing.assert_allclose(found, [green] * len(found), rtol=0, atol=1e-12)
                    if name in ("svk", "neo"):
                        left = np.linalg.eigh(f @ f.T)
                        wanted = left[1] @ np.diag(cauchy_stress(law, left[0] ** 0.5)) @ left[1].T
                        wanted = wanted[(0, 1, 2, 0, 1, 0), (0, 1, 2, 1, 2, 2)]
                        np.testing.assert_allclose(stress[0], wanted, rtol=0, atol=1e-9 * size)

    def test_pressed_on_a_plane(self):
        """Uniaxial stress, the force in closed form, areas that grow."""
        for kind in KINDS:
            for law in (SVK, NEO) if kind == "C3D20" else (NEO,):
                with self.subTest(kind=kind, law=law):
                    box = Box("B", (2, 2, 2), (kind,))
                    result = self.solve(
                        box.cards()
                        + material(law)
                        + DRY
                        + FLOOR
                        + TIGHT
                        + CORNER
                        + step("*BOUNDARY\nB-Z1, 3, 3, -0.2\n")
                    )
                    across = stretch_across(law, 0.8)
                    force = -cauchy_stress(law, (0.8, across, across))[0] * across**2
                    np.testing.assert_allclose(
                        result.pairs[0].resultant[-1], [0, 0, force], rtol=0, atol=1e-8 * force
                    )

    def test_turned_with_its_plane(self):
        """Pressed, dragged, then turned by 90 and 180 degrees: reactions turn, slips stay."""
        for kind in ("C3D4", "C3D10", "C3D20", "C3D20R"):
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5))
                top = box.side(2, 1)
                floor = (
                    "*NODE\n9001, 0., 0., 0.\n*OBSTACLE, NAME=FLOOR, TYPE=PLANE, REF NODE=9001\n"
                    "0., 0., 0.,  0., 0., 1.\n*CONTACT PAIR, INTERACTION=DRY\nB-Z0, FLOOR\n"
                )
                shift = np.array([0.06, 0.03, -0.05])
                deck = box.cards() + material() + ROUGH + floor + TIGHT
                deck += step(moved(box, top, lambda x, shift=shift: shift) + "9001, 1, 6, 0.\n")
                for angle in (90, 180):
                    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
                    q = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
                    deck += step(
                        moved(box, top, lambda x, q=q, shift=shift: q @ (x + shift) - x)
                        + f"9001, 1, 3, 0.\n9001, 4, 4, 0.\n9001, 5, 5, {np.radians(angle)!r}\n"
                        "9001, 6, 6, 0.\n",
                        increment="1.",
                        first=False,
                    ).replace("*STATIC", "*STATIC, DIRECT")
                result = self.solve(deck)
                force = result.pairs[0].resultant
                quarter = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
                for row, q in ((-2, quarter), (-1, quarter @ quarter)):
                    wanted = q @ force[-3]
                    np.testing.assert_allclose(
                        force[row], wanted, rtol=0, atol=1e-10 * abs(wanted).max()
                    )

    def test_kept_factor_and_tangents_of_every_iteration(self):
        for kind in ("C3D4", "C3D10", "C3D20"):
            found = {}
            for tangent in ("KEPT", "NEWTON"):
                box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5))
                deck = box.cards() + material() + ROUGH + FLOOR + TIGHT
                deck += f"*BODY SOLVER, TANGENT={tangent}\n"
                deck += step("*BOUNDARY\nB-Z1, 1, 2, 0.\nB-Z1, 3, 3, -0.1\n")
                deck += step("*BOUNDARY\nB-Z1, 1, 1, 0.1\nB-Z1, 2, 2, 0.05\n", first=False)
                found[tangent] = self.solve(deck).pairs[0].force[-1]
            with self.subTest(kind=kind):
                size = abs(found["KEPT"]).max()
                np.testing.assert_allclose(found["NEWTON"], found["KEPT"], rtol=0, atol=1e-8 * size)

    def test_pressures_follow(self):
        """A box under pressure on all its faces shrinks alike in all directions."""
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 2), (kind,))
                loads = "*DSLOAD\n" + "".join(f"B-{side}1, P, 40.\n" for side in "XYZ")
                result = self.solve(box.cards() + material() + CORNER + "B-Z0, 3\n" + step(loads))
                stretch = brentq(lambda a: cauchy_stress(NEO, (a, a, a))[0] + 40, 0.5, 1)
                u = result.field("displacement")
                np.testing.assert_allclose(u, result.points * (stretch - 1), rtol=0, atol=1e-8)

    def test_pressure_on_curved_faces(self):
        """A bent plate under pressure: forces and moments of loads and supports balance."""
        for kind in ("C3D6", *SECOND):
            with self.subTest(kind=kind):
                box = Box("B", (2, 1, 1), (kind,), size=(4, 1, 0.5))
                result = self.solve(
                    box.cards()
                    + material()
                    + "*BOUNDARY\nB-X0, 1, 3\n"
                    + step("*DSLOAD\nB-Z1, P, 1.\n")
                )
                load = -result.field("reaction_force").sum(axis=0)
                self.assertLess(result.field("displacement")[:, 2].min(), -0.5)
                self.assertGreater(abs(load[0]), 0.05 * abs(load[2]))

    def test_free_expansion(self):
        """A warmer box is without stress for every law."""
        for kind in ("C3D4", "C3D10", "C3D20"):
            for law in LAWS.values() if kind == "C3D10" else (SVK,):
                with self.subTest(kind=kind, law=law):
                    box = Box("B", (2, 2, 2), (kind,))
                    more = "*EXPANSION\n1e-4\n"
                    deck = box.cards() + material(law, more) + CORNER + "B-Z0, 3\n*NSET, NSET=ALL\n"
                    deck += "".join(f"{box.first + i}\n" for i in range(len(box.x)))
                    deck += "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 0.\n"
                    result = self.solve(
                        deck + step("*TEMPERATURE\nALL, 1000.\n", fields="*EL FILE\nS\n")
                    )
                    np.testing.assert_allclose(
                        result.field("displacement"), result.points * 0.1, rtol=0, atol=1e-9
                    )
                    self.assertLess(abs(result.field("stress")).max(), 1e-7 * E)

    def bodies(self, kinds, law=NEO):
        low = Box("LOW", (3, 3, 1), kinds[1:])
        up = Box("UP", (2, 2, 1), kinds[:1], low=(0, 0, 1), after=low)
        return (
            low.cards()
            + up.cards()
            + material(law)
            + ("*BOUNDARY\nLOW-X0, 1\nUP-X0, 1\nLOW-Y0, 2\nUP-Y0, 2\nLOW-Z0, 3\n")
        )

    def test_one_block_on_another(self):
        """Uniaxial stress of two blocks that touch or are tied, of any types."""
        across = stretch_across(NEO, 0.85)
        force = cauchy_stress(NEO, (0.85, across, across))[0] * across**2
        touch = DRY + "*CONTACT PAIR, INTERACTION=DRY\nUP-Z0, LOW-Z1\n" + TIGHT
        tie = "*TIE, NAME=T\nUP-Z0, LOW-Z1\n"
        for kinds, joints in (
            (("C3D10", "C3D20"), (touch,)),
            (("C3D20", "C3D10"), (touch,)),
            (("C3D10", "C3D8"), (touch,)),
            (("C3D4", "C3D10"), (tie,)),
            (("C3D20R", "C3D15"), (touch,)),
            (("C3D8", "C3D20"), (tie,)),
        ):
            for joint in joints:
                with self.subTest(kinds=kinds, joint=joint):
                    result = self.solve(
                        self.bodies(kinds)
                        + joint
                        + step("*BOUNDARY\nUP-Z1, 3, 3, -0.3\n", increment="0.2")
                    )
                    found = result.field("reaction_force")[result.points[:, 2] > 2 - 1e-9, 2].sum()
                    self.assertAlmostEqual(found / force, 1, delta=1e-7)

    def test_calculix(self):
        """Forces that move one side of a box, as CalculiX 2.20 has them of the same mesh."""
        forces = {
            ("C3D4", SVK): (4.9010406, 2.7340722, -19.0100009),
            ("C3D4", NEO): (7.345741, 3.9676446, -26.354301),
            ("C3D10", SVK): (3.52967391, 1.82623922, -17.02847592),
            ("C3D10", NEO): (5.18084694, 2.65983931, -23.91143739),
            ("C3D20", SVK): (3.45803154, 1.72738991, -16.9000054),
            ("C3D20", NEO): (5.02754564, 2.51277498, -23.75083156),
            ("C3D20R", SVK): (3.40522306, 1.7013237, -16.8131835),
            ("C3D20R", NEO): (4.93874471, 2.46725866, -23.65657234),
        }
        for (kind, law), force in forces.items():
            with self.subTest(kind=kind, law=law):
                box = Box("B", (2, 2, 2), (kind,))
                shift = np.array([0.1, 0.05, -0.1])
                ends = moved(box, box.side(2, 1), lambda x, shift=shift: shift)
                ends += moved(box, box.side(2, 0), lambda x: 0 * x)
                result = self.solve(box.cards() + material(law) + step(ends))
                found = result.field("reaction_force")[result.points[:, 2] > 1 - 1e-9].sum(axis=0)
                np.testing.assert_allclose(found, force, rtol=0, atol=1e-6 * abs(force[2]))

    def test_other_factors_and_compliances(self):
        """Products, a factor in single precision and a compressed one give the same forces."""
        # Neither knows which elements the stiffness is of.
        for kind, nlgeom, size in (("C3D10", ", NLGEOM", 1), ("C3D20", "", 0.1)):
            box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5))
            found = {}
            for contact, cards in (
                ("", ""),
                (", COMPLIANCE=PRODUCTS", ""),
                ("", "*PRECISION, FACTOR=SINGLE\n"),
                ("", "*PRECISION, BLOCK LOW RANK=1e-9\n"),
            ):
                deck = box.cards() + material() + ROUGH + FLOOR + cards
                deck += f"*CONTACT SOLVER, TOLERANCE=1e-10{contact}\n"
                deck += step(f"*BOUNDARY\nB-Z1, 1, 2, 0.\nB-Z1, 3, 3, {-0.1 * size}\n")
                deck += step(
                    f"*BOUNDARY\nB-Z1, 1, 1, {0.1 * size}\nB-Z1, 2, 2, {0.05 * size}\n",
                    first=False,
                )
                found[contact, cards] = (
                    self.solve(deck.replace(", NLGEOM", nlgeom)).pairs[0].force[-1]
                )
            wanted = found["", ""]
            for name, force in found.items():
                with self.subTest(kind=kind, nlgeom=nlgeom, what=name):
                    np.testing.assert_allclose(
                        force, wanted, rtol=0, atol=1e-8 * abs(wanted).max()
                    )


if __name__ == "__main__":
    unittest.main()
