"""Plane strain and axisymmetric elements: closed forms, both sides alike, and what is refused."""

import unittest
from math import pi, sqrt

import numpy as np
from program import Run

from studies.plane_meshes import PlaneMesh as Mesh  # found through program

PLANE_STRAIN = ["CPE3", "CPE4", "CPE4I", "CPE6", "CPE8", "CPE8R"]
AXISYMMETRIC = ["CAX3", "CAX4", "CAX4I", "CAX6", "CAX8", "CAX8R"]
YOUNG, POISSON = 1000.0, 0.3
FILES = "*NODE FILE\nU, RF\n*CONTACT FILE\nCSTR\n*END STEP\n"
FLOOR = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 1., 0.\n"


def section(*names, thickness=""):
    """Return a material and the sections of element sets."""
    text = f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG}, {POISSON}\n"
    for name in names:
        text += f"*SOLID SECTION, ELSET={name}, MATERIAL=M\n" + (f"{thickness}\n" * bool(thickness))
    return text


def pair(slave, master, mu=0.0):
    """Return a contact pair."""
    return (
        f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n{mu}\n"
        f"*CONTACT PAIR, INTERACTION=I\n{slave}, {master}\n"
    )


def step(*lines, nlgeom=False):
    """Return a step of one increment."""
    return "\n".join([f"*STEP{', NLGEOM' * nlgeom}", "*STATIC\n1., 1.", *lines, FILES])


def slanted(a, b):
    """Return a rectangle of 2 by 1.5 whose elements are distorted."""
    return 2 * a + 0.1 * b * a * (1 - a), 1.5 * b + 0.1 * a * b * (1 - b)


class Case(unittest.TestCase):
    """What the cases share."""

    def solve(self, deck, *options, **more):
        """Run a deck that is right; return its run."""
        run = Run(deck, *options, name="plane", **more)
        self.assertEqual(run.status, 0, run.output + run.errors)
        return run

    def refused(self, deck, *words, options=()):
        """Run a deck that is refused; its message has these words."""
        run = Run(deck, *options, name="plane")
        self.assertNotEqual(run.status, 0)
        for word in words:
            self.assertIn(word, run.output + run.errors)
        return run


class PlaneStrain(Case):
    """Slices of one element."""

    def press(self, kind, thickness=2.0):
        """Press a rectangle on a plane by a pressure of 10."""
        return (
            Mesh(kind, (4, 3), slanted).deck
            + section("A", thickness=thickness)
            + FLOOR
            + pair("ABOTTOM", "FLOOR")
            + step("*BOUNDARY\nALEFT-N, 1", "*DSLOAD\nATOP, P, 10.")
        )

    def test_uniform_stress_is_exact(self):
        """F = 10 x 2 x thickness, u = p (1 + nu)/E (nu x, -(1 - nu) y), the same on both sides."""
        for kind in PLANE_STRAIN:
            with self.subTest(kind), self.solve(self.press(kind)).result() as result:
                np.testing.assert_allclose(result.pairs[0].resultant[-1], [0, 40, 0], atol=1e-8)
                x, u = result.points, result.field("displacement")
                scale = 10 * (1 + POISSON) / YOUNG
                exact = scale * np.c_[POISSON * x[:, 0], -(1 - POISSON) * x[:, 1], 0 * x[:, 0]]
                np.testing.assert_allclose(u, exact, atol=1e-11)
                self.assertAlmostEqual(x[:, 2].max(), 2.0, 12)

    def test_reduced_integration_has_four_points(self):
        """A corner of a clamped body beside a pressure moves as in CalculiX 2.20."""
        mesh = Mesh("CPE8R", (3, 2), lambda a, b: (1 + 2 * a, b * (1 + 0.25 * a)))
        deck = mesh.deck + section("A")
        deck += step("*BOUNDARY\nABOTTOM-N, 1, 2", "*DLOAD\n4, P3, 10.\n5, P3, 10.")
        with self.solve(deck).result() as result:
            u = result.field("displacement")[result.node(mesh.at[6, 4])]
            exact = np.array([4.317979e-04, -6.225458e-04]) * 1000 / YOUNG
            np.testing.assert_allclose(u[:2], exact, rtol=1e-6)

    def test_thickness_only_scales_forces(self):
        """A slice much thinner or thicker than its elements gives the same per thickness."""
        for thickness in (2e-3, 2e3):
            with self.solve(self.press("CPE4", thickness)).result() as result:
                force = result.pairs[0].resultant[-1]
                np.testing.assert_allclose(force, [0, 20 * thickness, 0], atol=1e-8 * thickness)

    def test_forces_on_nodes_are_spread_as_pressure(self):
        """1/6, 4/6, 1/6 of edges, by *CLOAD on nodes of the plane, is the pressure."""
        for kind, along in (("CPE8R", [1, 4, 2, 4, 2, 4, 2, 4, 1]), ("CPE4", [3, 6, 6, 6, 3])):
            mesh = Mesh(kind, (4, 3), lambda a, b: (2 * a, 1.5 * b))
            top = sorted((p, n) for p, n in mesh.at.items() if p[1] == 3 * mesh.step)
            loads = [f"{n}, 2, {-40 * w / 24!r}" for (_, n), w in zip(top, along, strict=True)]
            deck = mesh.deck + section("A", thickness=2.0) + FLOOR + pair("ABOTTOM", "FLOOR")
            deck += step("*BOUNDARY\nALEFT-N, 1", "*CLOAD\n" + "\n".join(loads))
            with self.subTest(kind), self.solve(deck).result() as result:
                u = result.field("displacement")[result.points[:, 1] > 1.49, 1]
                np.testing.assert_allclose(u, -10 * 1.3 / YOUNG * 0.7 * 1.5, atol=1e-11)

    def test_finite_strain_before_a_plane(self):
        """A block pressed to 0.8 of its height: St Venant-Kirchhoff, sigma_x = 0."""
        lame = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        mu = YOUNG / (2 * (1 + POISSON))
        e_y = (0.8**2 - 1) / 2
        e_x = -lame / (lame + 2 * mu) * e_y
        force = -0.8 * (lame * (e_x + e_y) + 2 * mu * e_y) * 2
        for kind in PLANE_STRAIN:
            deck = (
                Mesh(kind, (3, 2), lambda a, b: (2 * a, b)).deck
                + section("A")
                + FLOOR
                + pair("ABOTTOM", "FLOOR")
                + step("*BOUNDARY\nALEFT-N, 1\nATOP-N, 2, 2, -0.2", nlgeom=True)
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                self.assertAlmostEqual(result.pairs[0].resultant[-1][1] / force, 1, 7)
                wide = result.field("displacement")[:, 0].max()
                self.assertAlmostEqual(wide, 2 * (sqrt(1 + 2 * e_x) - 1), 7)

    def test_hertz_line_contact(self):
        """p_0 = (F E*/(pi R))^(1/2) from the force of a half of a cylinder of R = 10."""

        def place(a, b):
            x = 1.6 * (0.35 * a + 0.65 * a**2)
            low = 10 - sqrt(100 - x * x)
            return x, low + (3 - low) * (0.25 * b + 0.75 * b**2)

        for kind, n in (("CPE4", (24, 12)), ("CPE8R", (12, 8))):
            deck = (
                Mesh(kind, n, place).deck
                + section("A")
                + FLOOR
                + pair("ABOTTOM", "FLOOR")
                + step("*BOUNDARY\nALEFT-N, 1\nATOP-N, 2, 2, -0.02")
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                force = 2 * result.pairs[0].resultant[-1][1]
                peak = sqrt(force * YOUNG / (1 - POISSON**2) / (pi * 10))
                self.assertAlmostEqual(result.pairs[0].largest_pressure[-1] / peak, 1, delta=0.02)

    def test_lame_thick_cylinder(self):
        """u_r under an inner pressure, on a quarter of a ring of radii 1 and 2."""

        def place(a, b):
            angle = pi / 2 * (1 - a)
            return (1 + b) * np.cos(angle).item(), (1 + b) * np.sin(angle).item()

        for kind, n, within in (("CPE8R", (8, 4), 1e-3), ("CPE4", (24, 12), 3e-3)):
            deck = Mesh(kind, n, place).deck
            deck += section("A") + step(
                "*BOUNDARY\nALEFT-N, 1\nARIGHT-N, 2", "*DSLOAD\nABOTTOM, P, 10."
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                x, u = result.points, result.field("displacement")
                r = np.hypot(x[:, 0], x[:, 1])
                radial = (u[:, 0] * x[:, 0] + u[:, 1] * x[:, 1]) / r
                exact = 1.3 * 10 / (3 * YOUNG) * (0.4 * r + 4 / r)
                np.testing.assert_allclose(radial, exact, atol=within * exact.max())

    def test_two_bodies_with_friction(self):
        """A pressure goes through an interface whose meshes do not match, uniform."""
        for kind in PLANE_STRAIN:
            upper = Mesh(kind, (4, 2), lambda a, b: (2 * a, 1 + b), "A")
            lower = Mesh(kind, (3, 2), lambda a, b: (2 * a, b), "B", 1000, 1000)
            deck = (
                upper.deck
                + lower.deck
                + section("A", "B")
                + pair("ABOTTOM", "BTOP", 0.3)
                + step("*BOUNDARY\nBBOTTOM-N, 2\nALEFT-N, 1\nBLEFT-N, 1", "*DSLOAD\nATOP, P, 10.")
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                np.testing.assert_allclose(result.pairs[0].resultant[-1], [0, 20, 0], atol=1e-7)
                u = result.field("displacement")
                self.assertAlmostEqual(u[:, 1].min(), -10 * 1.3 / YOUNG * 0.7 * 2, 9)

    def test_gravity_and_single_nodes(self):
        """The weight of a column is its reaction; a node by its number is the line through it."""
        mesh = Mesh("CPE4", (2, 2), lambda a, b: (a, b))
        one = mesh.at[0, 0]
        deck = mesh.deck + section("A", thickness=3.0).replace("*SOLID", "*DENSITY\n2.\n*SOLID")
        deck += FLOOR + pair("ABOTTOM", "FLOOR")
        deck += step(f"*BOUNDARY\n{one}, 1", "*DLOAD\nA, GRAV, 9., 0., -1., 0.")
        with self.solve(deck).result() as result:
            np.testing.assert_allclose(result.pairs[0].resultant[-1], [0, 54, 0], atol=1e-8)


class Thicknesses(Case):
    """A part of another thickness is one of another stiffness, whichever side is the slave."""

    def displacement(self, kind, joint, thickness, young, nlgeom):
        """Press one rectangle on another: displacements in the plane, and the force."""
        meshes = (
            Mesh(kind, n, lambda a, b, low=low: (2 * a, low + b), name, first, first)
            for n, low, name, first in (((2, 2), 0, "A", 0), ((3, 2), 1, "B", 100))
        )
        deck = "".join(mesh.deck for mesh in meshes) + section("A", thickness="1.")
        deck += f"*MATERIAL, NAME=K\n*ELASTIC\n{young}, {POISSON}\n"
        deck += f"*SOLID SECTION, ELSET=B, MATERIAL=K\n{thickness}\n"
        held = "*BOUNDARY\nBTOP-N, 1, 1, 0.001\nBTOP-N, 2, 2, -0.01\n"
        if joint == "tie":
            deck += "*TIE, NAME=T\nBBOTTOM, ATOP\n" + FLOOR + pair("ABOTTOM", "FLOOR", 0.05)
        else:
            deck += pair(*joint, 0.05)
            held += "ABOTTOM-N, 1, 2\n"
        with self.solve(deck + step(held, nlgeom=nlgeom)).result() as result:
            self.assertEqual(len(result.pairs[0].lines), 1)
            self.assertTrue(result.certified)
            return result.field("displacement")[:, :2], result.pairs[0].resultant[-1]

    def test_thickness_times_modulus(self):
        for kind, joint, nlgeom, close in (
            ("CPE4", ("ATOP", "BBOTTOM"), False, 1e-9),
            ("CPE4I", ("BBOTTOM", "ATOP"), True, 1e-9),
            ("CPE3", "tie", False, 1e-9),
            ("CPS4", ("BBOTTOM", "ATOP"), False, 1e-5),
            ("CPS3", ("ATOP", "BBOTTOM"), True, 1e-5),
        ):
            with self.subTest(kind, joint=joint):
                one = self.displacement(kind, joint, 2.5, 700.0, nlgeom)
                other = self.displacement(kind, joint, 1.0, 2.5 * 700.0, nlgeom)
                np.testing.assert_allclose(one[0], other[0], rtol=0, atol=close * 0.01)
                np.testing.assert_allclose(one[1], other[1], rtol=0, atol=close * 15)

    def test_the_plan_says_both(self):
        other = Mesh("CPE4", (1, 1), lambda a, b: (5 + a, b), "B", 100, 100).deck
        deck = Mesh("CPE4", (1, 1), lambda a, b: (a, b)).deck + other + FLOOR + section("A") + (
            "*SOLID SECTION, ELSET=B, MATERIAL=M\n2.\n"
        ) + pair("ABOTTOM", "FLOOR") + step("*BOUNDARY\nATOP-N, 1, 2\nBTOP-N, 1, 2\n")
        self.assertIn("thickness 1 to 2", self.solve(deck).output)


class Axisymmetric(Case):
    """Wedges that stand for bodies of revolution."""

    def ring(self, kind, more, inner=1.0, outer=2.0, n=(6, 2), boundary="AALL, 2"):
        """Return a ring 0.3 high."""
        mesh = Mesh(kind, n, lambda a, b: (inner + (outer - inner) * a, 0.3 * b))
        return mesh.deck + section("A") + more[0] + step(f"*BOUNDARY\n{boundary}", *more[1:])

    def test_forces_are_of_the_whole_body(self):
        """A pressure of 10 on a cylinder of radius 2: reactions 40 pi, u_r = nu p r/E."""
        for kind in AXISYMMETRIC:
            mesh = Mesh(kind, (4, 3), lambda a, b: (2 * a + 0.1 * b * a * (1 - a), 1.5 * b))
            deck = (
                mesh.deck + section("A") + step("*BOUNDARY\nABOTTOM-N, 2", "*DSLOAD\nATOP, P, 10.")
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                force = result.field("reaction_force").sum(axis=0)
                self.assertAlmostEqual(force[1] / (40 * pi), 1, 6)
                x, u = result.points, result.field("displacement")
                scale = 10 / YOUNG
                exact = np.c_[0.3 * scale * x[:, 0], -scale * x[:, 1], 0.3 * scale * x[:, 2]]
                # Eight points do not integrate an arc: in proportion to the angle squared.
                np.testing.assert_allclose(u, exact, atol=6e-6 if kind == "CAX8R" else 2e-7)
                energy = result.history("energy/strain")[-1]
                self.assertAlmostEqual(energy / (100 / (2 * YOUNG) * pi * 4 * 1.5), 1, 6)

    def test_lame(self):
        """u_r of a ring under an inner pressure, held along its axis."""
        for kind in AXISYMMETRIC:
            fine = kind[3] in "68"
            deck = self.ring(kind, ("", "*DSLOAD\nALEFT, P, 10."), n=(8 if fine else 24, 2))
            with self.subTest(kind), self.solve(deck).result() as result:
                x, u = result.points, result.field("displacement")
                r = np.hypot(x[:, 0], x[:, 2])
                radial = (u[:, 0] * x[:, 0] + u[:, 2] * x[:, 2]) / r
                exact = 1.3 * 10 / (3 * YOUNG) * (0.4 * r + 4 / r)
                np.testing.assert_allclose(radial, exact, rtol=2e-4 if fine else 3e-3)
                across = u[:, 2] * x[:, 0] - u[:, 0] * x[:, 2]
                self.assertLess(abs(across).max(), 1e-15)

    def test_ring_that_contact_alone_holds_at_finite_strain(self):
        """Pressed against the floor: E e (1 + 2 e)^(1/2) = -p (1 - 2 nu e) along the axis."""
        pressure, e = 0.1 * YOUNG, 0.0
        for _ in range(100):
            e = -pressure / YOUNG * (1 - 2 * POISSON * e) / sqrt(1 + 2 * e)
        along, radial = sqrt(1 + 2 * e) - 1, sqrt(1 - 2 * POISSON * e) - 1
        for kind in ("CAX4", "CAX8R"):
            mesh = Mesh(kind, (3, 2), lambda a, b: (1 + a, 1.5 * b))
            deck = mesh.deck + section("A") + FLOOR + pair("ABOTTOM", "FLOOR") + step(
                f"*DSLOAD\nATOP, P, {pressure}", nlgeom=True
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                x, u = result.points, result.field("displacement")
                exact = [radial, along, radial] * x
                np.testing.assert_allclose(u, exact, atol=1e-5 if kind == "CAX8R" else 1e-6)
                # A wedge of second order has bent edges in the plane of the floor.
                contact = result.pairs[0]
                area = result.file[f"/contact/{contact.name}/covered_area"][-1]
                p = contact.reaction[-1][:, 0] / area
                np.testing.assert_allclose(p, p.mean(), rtol=3e-3 if kind == "CAX8R" else 1e-6)

    def test_ring_on_a_rigid_shaft(self):
        """The pressure of an interference of 0.01 is 5.2448, its force that times the bore."""
        shaft = "*OBSTACLE, NAME=SHAFT, TYPE=CYLINDER\n0., 0., 0., 0., 1., 0., 1.01\n"
        for kind, within in (("CAX4", 1e-3), ("CAX6", 2e-4), ("CAX8R", 2e-4)):
            deck = self.ring(kind, (shaft + pair("ALEFT", "SHAFT"),), n=(16, 2))
            with self.subTest(kind), self.solve(deck).result() as result:
                pressure = 0.01 * 3 * YOUNG / (1.3 * 4.4)
                force = result.pairs[0].resultant[-1]
                self.assertAlmostEqual(force[0] / (0.6 * pi * pressure), 1, delta=within)
                self.assertLess(abs(force[1:]).max(), 1e-9)
                self.assertAlmostEqual(result.pairs[0].area.sum() / (0.6 * pi), 1, 4)

    def test_press_fit(self):
        """Two rings with an interference of 0.002: the sum of both displacements is that."""
        b, c, d = 2.0, 3.0, 0.002
        inner = 1.3 * b / (YOUNG * (b * b - 1)) * (0.4 * b * b + 1)
        outer = 1.3 * b / (YOUNG * (c * c - b * b)) * (0.4 * b * b + c * c)
        pressure = d / (inner + outer)
        for kind in AXISYMMETRIC:
            one = Mesh(kind, (8, 2), lambda a, e: (1 + (1 + d) * a, 0.3 * e), "A")
            two = Mesh(kind, (6, 3), lambda a, e: (2 + a, 0.3 * e), "B", 1000, 1000)
            deck = one.deck + two.deck + section("A", "B") + pair("ARIGHT", "BLEFT")
            deck += step("*BOUNDARY\nAALL, 2\nBALL, 2")
            with self.subTest(kind), self.solve(deck).result() as result:
                force = -result.pairs[0].resultant[-1][0]
                self.assertAlmostEqual(force / (0.6 * pi * b * pressure), 1, delta=4e-3)

    def test_sphere_on_the_axis_presses(self):
        """A ring pressed by a ball: the force is that of its supports, for all 360 degrees."""
        ball = "*OBSTACLE, NAME=BALL, TYPE=SPHERE\n0., 5.3, 0., 5.\n"
        deck = self.ring(
            "CAX8R",
            (ball + pair("ATOP", "BALL"),),
            inner=0.2,
            boundary="ABOTTOM-N, 2",
            n=(12, 3),
        ).replace("0., 5.3, 0., 5.", "0., 5.28, 0., 5.")
        with self.solve(deck).result() as result:
            force = result.pairs[0].resultant[-1]
            support = result.field("reaction_force").sum(axis=0)
            self.assertLess(force[1], -1.0)
            self.assertAlmostEqual(support[1] / -force[1], 1, 6)

    def test_a_continued_run_is_the_same(self):
        """The file has forces of the whole body, what is continued that of the wedge."""
        shaft = "*OBSTACLE, NAME=SHAFT, TYPE=CYLINDER\n0., 0., 0., 0., 1., 0., 1.01\n"
        deck = self.ring("CAX4", (shaft + pair("ALEFT", "SHAFT"), "*DSLOAD\nARIGHT, P, 1."))
        deck = deck.replace("*STATIC\n1., 1.", "*STATIC\n0.25, 1.")
        with self.solve(deck).result() as whole:
            run = self.solve(deck, "--continue", ended_at=("1", "1"))
            with run.result() as continued:
                np.testing.assert_array_equal(
                    whole.pairs[0].resultant, continued.pairs[0].resultant
                )


class Refused(Case):
    """What is not available is refused by name."""

    def deck(self, kind="CPE4", more="", lines=("*BOUNDARY\nABOTTOM-N, 1, 2",), thickness=""):
        """Return a deck that is right but for `more`."""
        return (
            Mesh(kind, (2, 2), lambda a, b: (a, b)).deck
            + section("A", thickness=thickness)
            + more
            + step(*lines)
        )

    def test_the_deck_is_right(self):
        """Without what the others add."""
        self.solve(self.deck())

    def test_beside_solids(self):
        """Plane and solid bodies in one deck."""
        solid = "*NODE\n901, 9, 0, 0\n902, 10, 0, 0\n903, 9, 1, 0\n904, 9, 0, 1\n"
        solid += "*ELEMENT, TYPE=C3D4, ELSET=T\n901, 901, 902, 903, 904\n"
        self.refused(self.deck(more=solid + section("T").split("\n", 3)[3]), "not available")

    def test_both_kinds(self):
        """CPE, CPS and CAX in one deck."""
        for kinds in (("CPE4", "CAX4"), ("CPE4", "CPS4"), ("CPS4", "CAX4")):
            other = Mesh(kinds[1], (1, 1), lambda a, b: (5 + a, b), "B", 100, 100).deck
            more = other + "*SOLID SECTION, ELSET=B, MATERIAL=M\n"
            self.refused(self.deck(kinds[0], more=more), "exclude each other")

    def test_other_types(self):
        """Types that are not computed."""
        for kind in ("CPE4P", "CPS9", "CAX4P"):
            self.refused(self.deck(kind), f"'{kind}' is not available")

    def test_keywords(self):
        """What is not available, and what to do instead, by file and line."""
        body = "*RIGID BODY, ELSET=A, REF NODE=1\n"
        self.refused(
            self.deck("CAX4", body), "*RIGID BODY is not available", "*OBSTACLE", "plane.inp:"
        )
        facets = "*NODE\n900, 0., 0., 9.\n*ELEMENT, TYPE=R3D3, ELSET=R\n900, 1, 2, 900\n"
        facets += "*RIGID BODY, ELSET=R, REF NODE=900\n"
        run = self.refused(
            self.deck(more=facets), "*RIGID BODY of facets", "ANALYTICAL SURFACE=", "plane.inp:"
        )
        self.assertEqual(run.errors.count("error: "), 1, run.errors)
        joint = "*COUPLING, REF NODE=1, SURFACE=ATOP\n*KINEMATIC\n"
        self.refused(self.deck("CAX4", joint), "*COUPLING is not available", "*EQUATION",
                     "plane.inp:")  # fmt: skip
        axes = "*TRANSFORM, NSET=ALEFT-N\n1., 0., 0., 0., 1., 0.\n"
        self.refused(self.deck("CAX4", axes), "*TRANSFORM is not available", "radius", "plane.inp:")

    def test_joints_across_the_plane(self):
        """Equations, local axes and gaps that are none of a plane."""
        more = "*EQUATION\n2\nATOP-N, 3, 1., 1, 3, -1.\n"
        self.refused(self.deck(more=more), "the dof must be 1 or 2", "plane.inp:")
        more = "*TRANSFORM, NSET=ATOP-N\n1., 0., 1., 0., 1., 0.\n"
        self.refused(self.deck(more=more), "local z is z", "plane.inp:")
        more = (
            FLOOR + pair("ABOTTOM", "FLOOR") + "*CONTACT GAP, PARABOLA\nABOTTOM-N, {}, 0., 0., 9.\n"
        )
        for kind, x in (("CPE4", "0."), ("CAX4", "0.5")):
            self.refused(self.deck(kind, more.format(x)), "paraboloid", "plane.inp:")

    def test_edges_and_motions(self):
        """Edges that an element has not, and motions across the plane."""
        for kind, lines, words in (
            ("CPE4", "*DLOAD\nA, P5, 1.", "edges P1 to P4"),
            ("CPE3", "*DLOAD\nA, P4, 1.", "no edge 4"),
            ("CPE4", "*BOUNDARY\nATOP-N, 3, 3, 0.1", "dofs 3 to 5 are 0"),
            ("CAX4", "*BOUNDARY\nATOP-N, 3, 3, 0.1", "dofs 3 to 6 are 0"),
        ):
            with self.subTest(words):
                self.refused(self.deck(kind, lines=("*BOUNDARY\nABOTTOM-N, 2", lines)), words)
        self.refused(self.deck(more="*SURFACE, NAME=X\nA, S5\n"), "edges S1 to S4")

    def test_places(self):
        """Nodes off the plane z = 0, and at negative radii."""
        profile = "*SURFACE, TYPE=SEGMENTS, NAME=T\nSTART, -1., 0.\nLINE, 0., 0.\nLINE, 1., -1.\n"
        for deck in (self.deck(), self.deck(more=profile)):
            self.refused(deck.replace("2, 0.5, 0.0, 0.", "2, 0.5, 0.0, 0.1"), "z = 0")
        self.refused(self.deck("CAX4").replace("1, 0.0, 0.0", "1, -0.1, 0.0"), "negative radius")

    def test_thickness(self):
        """One of 0 or less, of nodes that are shared, of elements of second order beside others."""
        for kind, place, number, words in (
            ("CPE4", 1, 100, "node 5 has elements of thickness 2 and 1"),
            ("CPE8", 5, 100, "elements of first order"),
        ):
            other = Mesh(kind, (1, 1), lambda a, b, x=place: (x + a, b), "B", number, 100).deck
            if "node" in words:
                other = other.replace("101, 101, 102", "101, 5, 102")
            more = other + "*SOLID SECTION, ELSET=B, MATERIAL=M\n2.\n"
            with self.subTest(kind):
                self.refused(self.deck(kind, more=more), words)
        self.refused(self.deck(thickness="-1."), "above 0")

    def test_obstacles(self):
        """Obstacles that are not the same along the thickness."""
        ball = "*OBSTACLE, NAME=O, TYPE=SPHERE\n0.5, -1., 0., 1.\n" + pair("ABOTTOM", "O")
        self.refused(self.deck(more=ball), "the same all along z")
        wall = "*OBSTACLE, NAME=O, TYPE=PLANE\n2., 0., 0., -1., 0., 0.\n" + pair("ARIGHT", "O")
        self.refused(self.deck("CAX4", wall), "body of revolution")

    def test_a_thickness_far_from_the_edges(self):
        """Displacements would lose their digits."""
        for thickness in ("1e-6", "1e6"):
            self.refused(self.deck(thickness=thickness), "takes the digits", "plane.inp:")

    def test_without_a_section_they_are_skipped(self):
        """As Gmsh writes faces beside solids."""
        deck = "*BLOCK, NAME=BODY, ELSET=BODY, TYPE=C3D8, NX=1, NY=1, NZ=1\n0, 0, 0, 1, 1, 1\n"
        deck += "*NODE\n901, 9, 0, 0\n902, 10, 0, 0\n903, 9, 1, 0\n"
        deck += "*ELEMENT, TYPE=CPE3, ELSET=F\n901, 901, 902, 903\n" + section("BODY")
        deck += step("*BOUNDARY\nBODY-ZMIN, 1, 3\nBODY-ZMAX, 3, 3, 0.1")
        self.assertIn("CPE3 elements are skipped", self.solve(deck).output)


if __name__ == "__main__":
    unittest.main()
