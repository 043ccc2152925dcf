"""Bodies that turn (CENTRIF of *DLOAD): closed forms, and what does not matter."""

import unittest

import numpy as np
from program import Run

from studies.plane_meshes import PlaneMesh as Mesh  # found through program

YOUNG, NU, DENSITY = 2.0e11, 0.3, 7800.0
SQUARE = 1.0e4  # of the angular velocity

BAR = """\
*BLOCK, NAME=B, NX=6, NY=1, NZ=1, TYPE={kind}
{x}, {y}, 0., {length}, 0.2, 0.1
*MATERIAL, NAME=M
*ELASTIC
{young}, 0.
*DENSITY
{density}
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP
*STATIC
0.5, 1.
*BOUNDARY
B-XMIN, 1, 1
B-YMIN, 2, 2
B-ZMIN, 3, 3
*DLOAD{options}
B, CENTRIF, {square}, {x}, {middle}, 0., 0., 0., -3.
*NODE FILE
U, RF
*END STEP
"""


def bar(kind="C3D8", x=0.0, y=0.0, options="", square=SQUARE, length=1.0):
    """Return the run of a bar that turns about its end: displacements and support forces."""
    deck = BAR.format(
        kind=kind, x=x, y=y, middle=y + 0.1, length=length, young=YOUNG, density=DENSITY,
        options=options, square=square,
    )
    run = Run(deck, name="bar")
    assert run.status == 0, run.output + run.errors
    with run.result() as result:
        return result.points - [x, y, 0.0], [
            (result.field("displacement", i), result.field("reaction_force", i)) for i in (0, -1)
        ]


class ForcesPerVolume(unittest.TestCase):
    """BX, BY, BZ, BR of *DLOAD: closed forms."""

    def test_a_thin_ring(self):
        """Under BR the stress around it is the force times the radius; BZ pulls along the axis."""
        deck = """*NODE, NSET=ALL
1, 10., 0.
2, 10.01, 0.
3, 10.01, 1.
4, 10., 1.
*ELEMENT, TYPE=CAX4, ELSET=E
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=E, MATERIAL=M
*BOUNDARY
1, 2
2, 2
*STEP
*STATIC
*DLOAD
E, BR, 2.
E, BZ, 3.
*NODE FILE
U
*NODE PRINT, NSET=ALL, TOTALS=ONLY
RF
*END STEP
"""
        run = Run(deck, name="ring")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            first = result.field("displacement", -1)[0]
            np.testing.assert_allclose(first[0], 2 * 10.005**2 / 1000, rtol=2e-3)
            rows = (run.folder / "ring.node.csv").read_text().splitlines()
        volume = np.pi * (10.01**2 - 10**2)
        np.testing.assert_allclose(float(rows[-1].split(",")[-2]), -3 * volume, rtol=1e-3)

    def test_weight_is_a_force_per_volume(self):
        """A bar of a density under GRAV, and without one under that force per volume."""
        ends = []
        for load, density in (("B, GRAV, 9., 0., -1., 0.", "*DENSITY\n2.\n"), ("B, BY, -18.", "")):
            deck = BAR.format(kind="C3D8", x=0, y=0, middle=0, length=1, young=YOUNG, density="1.",
                              options="", square=1.0)
            deck = deck.replace("*DENSITY\n1.\n", density)
            deck = deck.replace("B, CENTRIF, 1.0, 0, 0, 0., 0., 0., -3.", load)
            run = Run(deck, name="bar")
            self.assertEqual(run.status, 0, run.output + run.errors)
            with run.result() as result:
                ends.append(result.field("displacement", -1))
        np.testing.assert_allclose(*ends, rtol=1e-9, atol=1e-12 * abs(ends[0]).max())

    def test_what_there_is_not(self):
        """Directions that the elements do not have are refused."""
        for kind, load in (("CAX4", "BX"), ("CPE4", "BZ"), ("CPS4", "BR")):
            deck = "*NODE\n1, 1., 0.\n2, 2., 0.\n3, 2., 1.\n4, 1., 1.\n"
            deck += f"*ELEMENT, TYPE={kind}, ELSET=E\n1, 1, 2, 3, 4\n"
            deck += "*MATERIAL, NAME=M\n*ELASTIC\n1., 0.\n*SOLID SECTION, ELSET=E, MATERIAL=M\n"
            deck += f"*STEP\n*STATIC\n*DLOAD\nE, {load}, 1.\n*END STEP\n"
            run = Run(deck, name="none")
            self.assertEqual(run.status, 1)
            self.assertIn(f"not '{load}'", run.errors)


class Bars(unittest.TestCase):
    """Along a bar that turns about its end: rho w^2 (L^2 - x^2)/2, of its weight's part alone."""

    def test_a_bar_about_its_end(self):
        """Its elongation is rho w^2 L^3/(3 E), and the support has rho w^2 A L^2/2."""
        for kind in ("C3D8", "C3D8I", "C3D8B"):
            with self.subTest(kind=kind):
                points, (_, (u, force)) = bar(kind)
                ends = points[:, 0] == 1.0
                long = DENSITY * SQUARE / (3 * YOUNG)
                np.testing.assert_allclose(u[ends, 0].mean(), long, rtol=1e-9)
                held = -DENSITY * SQUARE * 0.02 / 2
                np.testing.assert_allclose(force[points[:, 0] == 0.0, 0].sum(), held, rtol=1e-9)
                # What pulls it apart across balances: its axis is in the middle.
                self.assertLess(abs(force[:, 1].sum()), 1e-9 * abs(held))

    def test_it_grows_with_its_amplitude(self):
        _, (half, whole) = bar()
        np.testing.assert_allclose(half[0], 0.5 * whole[0], atol=1e-9 * abs(whole[0]).max())

    def test_places_do_not_matter(self):
        _, (_, here) = bar()
        _, (_, there) = bar(x=3.0e4, y=-2.0e4)
        for one, other in zip(here, there, strict=True):
            np.testing.assert_allclose(other, one, atol=1e-7 * abs(one).max())


class Discs(unittest.TestCase):
    """Bodies of revolution that turn about their axis."""

    inner, outer = 0.1, 0.3

    def closed_form(self, r, nu):
        """Return the radial displacement in plane stress: u = (r/E) (hoop - nu radial)."""
        a, b, load = self.inner, self.outer, DENSITY * SQUARE
        share = (3 + nu) / 8 * load
        radial = share * (a**2 + b**2 - (a * b / r) ** 2 - r**2)
        hoop = share * (a**2 + b**2 + (a * b / r) ** 2) - (1 + 3 * nu) / 8 * load * r**2
        return r / YOUNG * (hoop - nu * radial)

    def test_a_thin_disc(self):
        """Timoshenko and Goodier, article 32. Elements of revolution, thin beside the hole."""
        for kind, tolerance in (("CAX8", 5e-4), ("CAX6", 1e-3), ("CAX4", 1e-2)):
            with self.subTest(kind=kind):
                mesh = Mesh(
                    kind, (16, 1),
                    lambda s, t: (self.inner + (self.outer - self.inner) * s, 1e-3 * t),
                )
                deck = "\n".join([
                    mesh.deck, "*SOLID SECTION, ELSET=A, MATERIAL=M", "*MATERIAL, NAME=M",
                    "*ELASTIC", f"{YOUNG}, {NU}", "*DENSITY", f"{DENSITY}", "*STEP",
                    "*STATIC", "1., 1.", "*BOUNDARY", "ABOTTOM-N, 2, 2", "*DLOAD",
                    f"A, CENTRIF, {SQUARE}, 0., 0., 0., 0., 1., 0.", "*NODE FILE", "U",
                    "*END STEP\n",
                ])
                run = Run(deck, name="disc")
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    u = result.field("displacement", -1)
                    r = result.points[:, 0]
                wanted = self.closed_form(r, NU)
                np.testing.assert_allclose(u[:, 0], wanted, rtol=tolerance)


SHAFT = """\
*BLOCK, NAME=B, NX=1, NY=1, NZ=8, TYPE=C3D8I
-0.05, -0.05, 0., 0.1, 0.1, 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
1., 1.
*BOUNDARY
B-ZMIN, 1, 3
*DLOAD
B, CENTRIF, {square}, 0., 0., 0., 0., 0., 1.
*NODE FILE
U
*END STEP
"""


class FiniteStrain(unittest.TestCase):
    """With NLGEOM bodies turn where they are deformed to."""

    def test_a_thin_ring(self):
        """It grows by l: E (l^2 - 1)/2 = rho w^2 R^2, by the second Piola-Kirchhoff stress."""
        radius, thick, young = 1.0, 1e-3, 1000.0
        for kind in ("CAX4", "CAX6", "CAX8"):
            with self.subTest(kind=kind):
                mesh = Mesh(kind, (1, 1), lambda s, t: (radius + thick * (s - 0.5), thick * t))
                deck = "\n".join([
                    mesh.deck, "*SOLID SECTION, ELSET=A, MATERIAL=M", "*MATERIAL, NAME=M",
                    "*ELASTIC", f"{young}, 0.", "*DENSITY", "1.", "*STEP, NLGEOM",
                    "*STATIC", "0.5, 1.", "*BOUNDARY", "ABOTTOM-N, 2, 2", "*DLOAD",
                    "A, CENTRIF, 220., 0., 0., 0., 0., 1., 0.", "*NODE FILE", "U", "*END STEP\n",
                ])
                run = Run(deck, name="ring")
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    u = result.field("displacement", -1)[:, 0]
                np.testing.assert_allclose(u.mean(), np.sqrt(1.44) - 1, rtol=2e-4)

    def test_a_shaft_has_a_critical_speed(self):
        """That of a cantilever: w^2 = 1.8751^4 E I/(rho A L^4) = 10.30, by the bending of beams."""
        for square, status in ((9.9, 0), (10.7, 2)):
            run = Run(SHAFT.format(square=square), name="shaft")
            self.assertEqual(run.status, status, run.output + run.errors)
        self.assertIn("the equilibrium is unstable (2 motions", run.errors)


if __name__ == "__main__":
    unittest.main()
