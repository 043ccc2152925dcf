"""Plane stress elements: closed forms whatever the thickness, friction, finite strain."""

import unittest
from math import pi, sqrt

import numpy as np
from test_plane import FLOOR, POISSON, YOUNG, Case, pair, section, slanted, step

from studies.plane_meshes import PlaneMesh as Mesh

KINDS = ["CPS3", "CPS4", "CPS4I", "CPS6", "CPS8", "CPS8R"]
STRESSES = "*EL FILE, POSITION=CENTROIDAL\nS, E\n"


def arc(low, high):
    """Return the places of a quarter of a ring."""
    def place(a, b):
        angle, r = pi / 2 * (1 - a), low + (high - low) * b
        return r * float(np.cos(angle)), r * float(np.sin(angle))

    return place


def block(kind, n=(4, 3), place=slanted, thickness=2.0, material="", **_):
    """Return a body on the floor."""
    properties = section("A", thickness=thickness).replace("*SOLID", material + "*SOLID")
    return Mesh(kind, n, place).deck + properties + FLOOR + pair("ABOTTOM", "FLOOR")


class Uniform(Case):
    """Uniform stresses are exact, those across the plate zero."""

    def test_pressure(self):
        """u = p/E (nu x, -y), F = p 2 t, the energy p^2/(2 E) V; supports across hold nothing."""
        for kind in KINDS:
            for thickness in (2.0, 300.0):
                deck = block(kind, thickness=thickness) + step(
                    "*BOUNDARY\nALEFT-N, 1\nALEFT-N, 3", "*DSLOAD\nATOP, P, 10.", STRESSES
                )
                with self.subTest(kind, t=thickness), self.solve(deck).result() as result:
                    force = result.pairs[0].resultant[-1]
                    np.testing.assert_allclose(force / thickness, [0, 20, 0], atol=1e-8)
                    x, u = result.points, result.field("displacement")
                    strain = 10 / YOUNG * np.array([POISSON, -1, POISSON])
                    middle = [0, 0, x[:, 2].max() / 2]
                    np.testing.assert_allclose(u, strain * (x - middle), atol=1e-11)
                    stress = result.field("stress")[:, :3]
                    np.testing.assert_allclose(stress, [[0, -10, 0]] * len(stress), atol=1e-8)
                    found = result.field("strain")[:, :3]
                    np.testing.assert_allclose(found, [strain] * len(found), atol=1e-11)
                    energy = 0.5 * 100 / YOUNG * 3 * thickness
                    self.assertAlmostEqual(result.history("energy/strain")[-1] / energy, 1, 8)

    def test_warmth(self):
        """A strip between two walls pushes with E alpha T, not E/(1 - nu) of plane strain."""
        warm = "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nAALL, 0.\n"
        for kind in KINDS:
            deck = block(kind, place=lambda a, b: (2 * a, b), material="*EXPANSION\n1e-3\n")
            deck += warm + step("*BOUNDARY\nALEFT-N, 1\nATOP-N, 2", "*TEMPERATURE\nAALL, 10.")
            with self.subTest(kind), self.solve(deck).result() as result:
                force = result.pairs[0].resultant[-1]
                np.testing.assert_allclose(force, [0, YOUNG * 1e-2 * 4, 0], atol=1e-7)
                wide = result.field("displacement")[:, 0].max()
                self.assertAlmostEqual(wide, 2 * 1e-2 * (1 + POISSON), 10)

    def test_finite_strain(self):
        """Pressed to 0.8 of its height: F = l E (l^2 - 1)/2 A of St Venant-Kirchhoff's law."""
        strain = (0.8**2 - 1) / 2
        for kind in KINDS:
            deck = block(kind, (3, 2), lambda a, b: (2 * a, b), 3.0)
            deck += step("*BOUNDARY\nALEFT-N, 1\nATOP-N, 2, 2, -0.2", nlgeom=True)
            with self.subTest(kind), self.solve(deck).result() as result:
                force = -0.8 * YOUNG * strain * 2 * 3
                self.assertAlmostEqual(result.pairs[0].resultant[-1][1] / force, 1, 8)
                wide = result.field("displacement")[:, 0].max()
                self.assertAlmostEqual(wide, 2 * (sqrt(1 - 2 * POISSON * strain) - 1), 8)


class ClosedForms(Case):
    """What is not uniform comes near with the mesh, whatever the thickness."""

    def test_lame(self):
        """u_r = p/(3 E) ((1 - nu) r + (1 + nu) 4/r), radii 1 and 2; sigma_z is 0 nearly."""
        for kind, n, within in (("CPS8R", (8, 4), 1e-3), ("CPS4", (24, 12), 3e-3)):
            deck = Mesh(kind, n, arc(1, 2)).deck + section("A", thickness=50.0)
            deck += step("*BOUNDARY\nALEFT-N, 1\nARIGHT-N, 2", "*DSLOAD\nABOTTOM, P, 10.", STRESSES)
            with self.subTest(kind), self.solve(deck).result() as result:
                x, u = result.points, result.field("displacement")
                r = np.hypot(x[:, 0], x[:, 1])
                radial = (u[:, 0] * x[:, 0] + u[:, 1] * x[:, 1]) / r
                exact = 10 / (3 * YOUNG) * ((1 - POISSON) * r + (1 + POISSON) * 4 / r)
                np.testing.assert_allclose(radial, exact, atol=within * exact.max())
                self.assertLess(abs(result.field("stress")[:, 2]).max(), 0.2)

    def test_press_fit(self):
        """p = d/(b ((b^2 + 1)/(b^2 - 1) + (c^2 + b^2)/(c^2 - b^2))) E; friction takes no part."""
        b, c, d = 2.0, 3.0, 0.002
        pressure = d * YOUNG / b / ((b * b + 1) / (b * b - 1) + (c * c + b * b) / (c * c - b * b))
        for kind, n in (("CPS4", 16), ("CPS8R", 8)):
            deck = Mesh(kind, (n, 4), arc(1, b + d)).deck
            deck += Mesh(kind, (n, 4), arc(b, c), "B", 1000, 1000).deck
            deck += section("A", "B", thickness=4.0) + pair("BBOTTOM", "ATOP", 0.5)
            deck += step("*BOUNDARY\nALEFT-N, 1\nBLEFT-N, 1\nARIGHT-N, 2\nBRIGHT-N, 2")
            with self.subTest(kind), self.solve(deck).result() as result:
                force = abs(result.pairs[0].resultant[-1][:2])
                np.testing.assert_allclose(force / (pressure * b * 4), 1, atol=0.01)
                reaction = result.pairs[0].reaction[-1]
                self.assertLess(abs(reaction[:, 2]).max(), 1e-9 * abs(reaction).max())

    def test_hertz(self):
        """p_0 = (F E/(pi R))^(1/2) from the force of a half of a disc of R = 10."""

        def place(a, b):
            x = 1.6 * (0.35 * a + 0.65 * a**2)
            low = 10 - sqrt(100 - x * x)
            return x, low + (3 - low) * (0.25 * b + 0.75 * b**2)

        for kind, n in (("CPS4", (24, 12)), ("CPS8R", (12, 8))):
            deck = block(kind, n, place, 20.0)
            deck += step("*BOUNDARY\nALEFT-N, 1\nATOP-N, 2, 2, -0.02")
            with self.subTest(kind), self.solve(deck).result() as result:
                force = 2 * result.pairs[0].resultant[-1][1] / 20
                peak = sqrt(force * YOUNG / (pi * 10))
                self.assertAlmostEqual(result.pairs[0].largest_pressure[-1] / peak, 1, delta=0.025)


class Friction(Case):
    """It acts in the plane."""

    def test_a_bar_that_is_pulled(self):
        """Below mu N nothing slips, though the bar grows thicker; above, all of it does."""
        for kind in KINDS:
            for pull, stays in ((3.0, True), (-0.02, False)):
                deck = block(kind, (8, 2), lambda a, b: (4 * a, b), 2.0).replace(
                    "*FRICTION\n0.0", "*FRICTION\n0.5"
                )
                load = "*BOUNDARY\nARIGHT-N, 1, 1, 0.2"
                if stays:
                    load = f"*DSLOAD\nARIGHT, P, {-pull!r}"
                deck += step("*BOUNDARY\nATOP-N, 2, 2, -0.01") + step(load)
                with self.subTest(kind, pull=pull), self.solve(deck).result() as result:
                    points = result.pairs[0]
                    force = points.resultant[-1]
                    if stays:
                        self.assertAlmostEqual(force[0] / (-pull * 2), 1, 6)
                        self.assertLess(abs(force[0]), 0.5 * force[1])
                    else:
                        self.assertAlmostEqual(force[0] / (-0.5 * force[1]), 1, 6)
                        self.assertTrue((points.status[-1] != 1).all())
                    self.assertLess(abs(points.reaction[-1][:, 2]).max(), 1e-9)

    def balances_along_y(self, deck):
        """Check that one increment is enough, and that the contact force carries the load."""
        with self.solve(deck).result() as result:
            self.assertEqual(len(result.history("time")), 1)
            force = result.pairs[0].resultant[-1][1]
            load = -result.field("applied_force")[:, 1].sum()
            self.assertAlmostEqual(force / load, 1, 8)

    def test_contact_alone_keeps_a_plate_from_turning(self):
        """At finite strain, too, one increment balances the follower pressure along y."""
        for kind in KINDS:
            deck = block(kind, (4, 1), lambda a, b: (4 * a, b), 2.0).replace(
                "*FRICTION\n0.0", "*FRICTION\n0.3"
            )
            deck += step("*BOUNDARY\n1, 1", "*DSLOAD\nATOP, P, 5.", "*NODE FILE\nCF", nlgeom=True)
            with self.subTest(kind):
                self.balances_along_y(deck)

    def test_a_plate_on_another(self):
        """Contact alone keeps the upper one from turning, on a mesh that does not match."""
        for kind in KINDS:
            lower = Mesh(kind, (3, 3), lambda a, b: (a, b / 2), "B", 1000, 1000)
            upper = Mesh(kind, (2, 2), lambda a, b: (0.1 + 0.8 * a, 0.5 + 0.4 * b))
            deck = upper.deck + lower.deck + section("A", "B", thickness=1.3)
            deck += pair("ABOTTOM", "BTOP", 0.5) + step(
                "*BOUNDARY\nBBOTTOM-N, 1, 2\nATOP-N, 1", "*DSLOAD\nATOP, P, 2.",
                "*NODE FILE\nCF", nlgeom=True,
            )
            with self.subTest(kind):
                self.balances_along_y(deck)


class Rigid(Case):
    """*RIGID BODY with elements of a plane."""

    def test_an_end_that_a_moment_turns(self):
        """A beam of length 10 and height 1: its end turns by M L/(E I) and rises by half M L^2."""
        strain = YOUNG / (1 - POISSON**2)
        kinds = ("CPS8R", YOUNG), ("CPE8R", strain), ("CPS4I", YOUNG), ("CPE4I", strain)
        for kind, modulus in kinds:
            mesh = Mesh(kind, (10, 1), lambda a, b: (10 * a, b - 0.5))
            deck = mesh.deck + section("A", thickness=3.0)
            deck += "*NODE\n900, 10., 0., 0.\n901, 10., 0., 0.\n"
            deck += "*RIGID BODY, NSET=ARIGHT-N, REF NODE=900, ROT NODE=901\n"
            deck += step(f"*BOUNDARY\nALEFT-N, 1\n{mesh.at[0, 1]}, 2", "*CLOAD\n901, 3, 0.6")
            with self.subTest(kind), self.solve(deck).result() as result:
                of_node = result.reference_nodes[900]
                turn = 0.6 * 10 / (modulus * 3 / 12)
                self.assertAlmostEqual(of_node.rotation[-1][2] / turn, 1, delta=0.01)
                self.assertAlmostEqual(of_node.displacement[-1][1] / (5 * turn), 1, delta=0.01)

    def test_a_rigid_punch_turns(self):
        """Turned by its ROT NODE, it moves as that says; about other axes it does not."""
        deck = block("CPS4", (4, 3), lambda a, b: (2 * a, b), 1.0)
        deck += "*NODE\n900, 1., 1., 0.\n901, 1., 1., 0.\n"
        deck += "*RIGID BODY, NSET=ATOP-N, REF NODE=900, ROT NODE=901\n"
        held = "*BOUNDARY\n900, 1, 1\n900, 2, 2, -0.05\n901, 3, 3, 0.01"
        with self.solve(deck + step(held)).result() as result:
            x, u = result.points, result.field("displacement")
            top = x[:, 1] > 1 - 1e-9
            np.testing.assert_allclose(u[top, 1], -0.05 + 0.01 * (x[top, 0] - 1), atol=1e-9)
        self.refused(deck + step(held + "\n901, 1, 1, 0.01"), "ROT NODE of a rigid body")


if __name__ == "__main__":
    unittest.main()
