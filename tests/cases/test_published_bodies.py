"""Cases of bodies that touch each other whose results are known from others.

docs/studies/cases.md has the decks of input/ among them; the others are a few blocks, written here.
"""

import itertools
import shutil
import tempfile
import unittest
from pathlib import Path

import numpy as np
from program import INPUT, Run
from two_bodies import block, deck, pair, quarter_ring, solved, step

from studies.case_bodies import fit_line_contact, lame, line_contact, sinks  # found through program
from studies.case_values import mean_square
from studies.meshes import Mesh, mesh_file

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
{young!r}, {nu!r}
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=HIGH, MATERIAL=M
"""


def rings_in_rings(theta, radii=(0.2, 0.6, 1.0), young=1e9, nu=0.2, mean=1e7, second=1e5):
    """Return pressure and radial displacement where two rings touch without friction, plane strain.

    The outer one is pressed by `mean` + `second` cos 2 theta. The mean is Lame's; the rest follows
    from the stress function (A r^2 + B r^4 + C/r^2 + D) cos 2 theta of each ring (Michell).
    """
    a, b, c = radii
    shear, kappa = young / (2 + 2 * nu), 3 - 4 * nu

    def normal(r):
        return np.array([-2, 0, -6 / r**4, -4 / r**2])

    def tangential(r):
        return np.array([2, 6 * r**2, -6 / r**4, -2 / r**2])

    def way(r):
        return np.array([-2 * r, (kappa - 3) * r**3, 2 / r**3, (kappa + 1) / r]) / (2 * shear)

    none = np.zeros(4)
    rows = [(normal(a), none), (tangential(a), none), (tangential(b), none), (none, tangential(b)),
            (none, tangential(c)), (normal(b), -normal(b)), (way(b), -way(b)), (none, normal(c))]
    inner = np.linalg.solve([np.concatenate(row) for row in rows], [0] * 7 + [-second])[:4]
    share = mean * c**2 / (c**2 - a**2)  # Lame: both rings are one
    lame_way = -share * b * (1 + nu) / young * (1 - 2 * nu + a**2 / b**2)
    cosine = np.cos(2 * theta)
    return (share * (1 - a**2 / b**2) - inner @ normal(b) * cosine,
            lame_way + inner @ way(b) * cosine)


class Decks(unittest.TestCase):
    """Decks of input/ with meshes of several sizes."""

    def result(self, name, mesh, **parameters):
        """Run a deck with another mesh in the place of the one that it includes."""
        folder = Path(tempfile.mkdtemp(prefix="bipot-mesh-"))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        (folder / "meshes").mkdir()
        (folder / "meshes" / f"{mesh[0]}.inp").write_text(mesh_file(*mesh))
        run = Run(shutil.copy(INPUT / f"{name}.inp", folder), **parameters)
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        result.of_run = run
        self.addCleanup(result.close)
        self.assertTrue(np.all(result.history("certified") == 1))
        return result

    def test_press_fit(self):
        """Lame, plane stress: 6.1523. The error falls with the square of the size of the bricks."""
        self.assertAlmostEqual(lame(), 6.1523, places=4)
        errors = []
        for n in (2, 4, 8):
            touching = self.result("press", ("rings", n)).pairs[0]
            self.assertTrue(np.all(touching.status[-1] == 2))
            errors.append(touching.reaction[-1][:, 0].sum() / touching.area.sum() / lame() - 1)
        self.assertLess(errors[2], 1e-3)
        for coarse, fine in itertools.pairwise(errors):
            self.assertGreater(fine, 0)
            self.assertAlmostEqual(coarse / fine, 4, delta=0.5)

    def test_cylinder(self):
        """NAFEMS R0094-1. Hertz: half width and peak pressure; a line contact of two bodies.

        The published displacements count large strains. CalculiX without them: 1.269 at n = 4.
        """
        half_width, peak = line_contact(35000.0, 50.0, 1 / (0.91 / 210000 + 0.91 / 70000))
        self.assertAlmostEqual(half_width, 6.21, delta=0.005)
        self.assertAlmostEqual(peak, 3585.37, delta=3)
        coarse = self.result("cylinder", ("cylinder", 4))
        self.assertAlmostEqual(sinks(coarse), 1.269, delta=0.001)
        fine = self.result("cylinder", ("cylinder", 8))
        a, p0 = fit_line_contact(fine.pairs[0])
        self.assertAlmostEqual(a / half_width, 1, delta=0.01)
        self.assertAlmostEqual(p0 / peak, 1, delta=0.01)
        held = self.result("cylinder", ("cylinder", 4), mu=0.1, steps=5)
        self.assertLess(sinks(held), sinks(coarse) - 0.002)

    def test_punch(self):
        """NAFEMS R0094-2: the base sinks by 0.13073, with mu = 0.1 by 0.12858 (linear elements)."""
        smooth = sinks(self.result("punch", ("punch", 4)))
        rough = sinks(self.result("punch", ("punch", 4), mu=0.1, steps=3))
        self.assertAlmostEqual(smooth / 0.13073, 1, delta=0.005)
        self.assertAlmostEqual(rough / 0.12858, 1, delta=0.005)
        self.assertAlmostEqual((smooth - rough) / (0.13073 - 0.12858), 1, delta=0.1)

    def test_stack(self):
        """Statics: both interfaces carry the same force; the one below slides."""
        run = Run(INPUT / "stack.inp")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            above, below = (result.pairs[name] for name in ("HIGH-ZMIN:MIDDLE-ZMAX",
                                                           "MIDDLE-ZMIN:LOW-ZMAX"))
            np.testing.assert_allclose(above.resultant[-1], below.resultant[-1],
                                       atol=1e-9 * above.normal_sum[-1])
            self.assertTrue(np.all(below.status[-1] == 2))
            self.assertTrue(np.all(above.status[-1] == 1))
            self.assertAlmostEqual(below.friction_sum[-1] / below.normal_sum[-1], 0.2, places=9)


class Blocks(unittest.TestCase):
    """A few blocks."""

    def test_contact_patches(self):
        """SSNP121 and SSNP170 of Code_Aster: constant stress through meshes that do not match."""
        two = (block("LOW", 3, (0, 0, -1), (1, 1, 1), 2e6, 0.0),
               block("UP", 2, (0, 0, 0), (1, 1, 1), 2e6, 0.0))
        result = solved(self, deck(*two, pair("UP-ZMIN, LOW-ZMAX"), step("UP-ZMAX, 3, 3, -0.1"),
                                   held="LOW-ZMIN, 1, 3\nUP-ZMAX, 1, 2"))
        touching = result.pairs[0]
        np.testing.assert_allclose(touching.reaction[-1][:, 0] / touching.area, 1e5, rtol=1e-10)
        under = [result.nearest_node((x, y, 0.0)) for x in (0, 1) for y in (0, 1)]
        np.testing.assert_allclose(result.field("displacement", -1)[under, 2], -0.05, rtol=1e-10)

    def test_two_cubes(self):
        """SSNV167 of Code_Aster: sides of 2 mm, E = 200 GPa, nu = 0, pressed by 0.2: 10,000 MPa."""
        two = (block("LOW", 2, (0, 0, -2), (2, 2, 2), 200000.0, 0.0),
               block("UP", 3, (0, 0, 0), (2, 2, 2), 200000.0, 0.0))
        result = solved(self, deck(*two, pair("UP-ZMIN, LOW-ZMAX"), step("UP-ZMAX, 3, 3, -0.2"),
                                   held="LOW-ZMIN, 1, 3\nUP-ZMAX, 1, 2"))
        touching = result.pairs[0]
        np.testing.assert_allclose(touching.reaction[-1][:, 0] / touching.area, 1e4, rtol=1e-10)

    def rings(self, around, second):
        """SSNP167 of Code_Aster: rings in one another, pressed by 1e7 + 1e5 cos 2 theta (`second`).

        Return errors of contact pressure, point by point and on the whole, and of the radial
        displacement where they touch, beside the largest of each.
        """
        across, height = 10, 0.05
        load, angle = [], 0.5 * np.pi / around[1]
        for k in range(2):
            for j in range(around[1] + 1):
                theta = j * angle
                share = angle * height / 2 * (0.5 if j in (0, around[1]) else 1.0)
                force = -share * (1e7 + second * np.cos(2 * theta))
                number = 20001 + (k * (around[1] + 1) + j + 1) * (across + 1) - 1
                load += [f"{number}, 1, {float(force * np.cos(theta))!r}",
                         f"{number}, 2, {float(force * np.sin(theta))!r}"]
        cards = "\n".join(load)
        text = deck(
            quarter_ring("I", 1, (0.2, 0.6), (across, around[0]), height),
            quarter_ring("O", 20001, (0.6, 1.0), (across, around[1]), height),
            "*MATERIAL, NAME=M\n*ELASTIC\n1e9, 0.2\n"
            "*SOLID SECTION, ELSET=I, MATERIAL=M\n*SOLID SECTION, ELSET=O, MATERIAL=M\n",
            pair("I-OUT, O-IN"),
            f"*STEP\n*STATIC, DIRECT\n1., 1.\n*CLOAD\n{cards}\n*END STEP\n",
            held="I-X, 1\nI-Y, 2\nO-X, 1\nO-Y, 2\nI-ALL, 3\nO-ALL, 3",
        )
        result = solved(self, text)
        touching = result.pairs[0]
        theta = np.arctan2(touching.coordinates[:, 1], touching.coordinates[:, 0])
        pressure, way = rings_in_rings(theta, second=second)
        force = touching.reaction[-1][:, 0]
        nodes = [result.nearest_node(place) for place in touching.coordinates]
        moved = result.field("displacement", -1)[nodes]
        radial = moved[:, 0] * np.cos(theta) + moved[:, 1] * np.sin(theta)
        # Of the pressure also what all points say together: its mean, its part with cos 2 theta.
        waves = np.array([np.ones(theta.size), np.cos(2 * theta)])
        largest = (waves @ (touching.area * pressure))[0]
        return (np.abs(force / touching.area - pressure).max() / pressure.max(),
                np.abs(waves @ (force - touching.area * pressure)) / largest,
                np.abs(radial - way).max() / np.abs(way).max())

    def test_rings_under_a_pressure_that_varies(self):
        """Michell's solution, each value within the source's 2 %; and with ten times the variation.

        Where the polygons do not match their corners overlap by a tenth of the displacement: there
        single pressures say how they lie on each other.
        """
        _, way = rings_in_rings(np.linspace(0, 0.5 * np.pi, 91))
        self.assertAlmostEqual(np.abs(way).max(), 5.5e-3, delta=0.05e-3)  # as the source says
        for around, second in itertools.product(((32, 32), (32, 24), (24, 36)), (1e5, 1e6)):
            with self.subTest(around=around, second=second):
                pressure, waves, way = self.rings(around, second)
                if around[0] == around[1]:
                    self.assertLess(pressure, 0.01)
                self.assertLess(waves.max(), 0.008)
                self.assertLess(way, 0.02 if second < 1e6 else 0.025)

    def wedge(self, mu):
        """NAFEMS' CGS-4: a wedge under a weight on a slope of a tenth, pushed up it at its side.

        Return the push beside the weight once all of it slides.
        """
        base, upper = Mesh("BASE"), Mesh("WEDGE", 10001)
        base.grid((12, 2, 3), lambda a, b, c: (6 * a, b, c * (1 + 0.6 * a)), SLOPE="k+")
        upper.grid((7, 3, 4), lambda a, b, c: (1 + 4 * a, b, (1 - c) * (1.1 + 0.4 * a) + 3 * c),
                   SOLE="k-", TOP="k+")
        cards = [
            base.cards(FLOOR=lambda x, y, z: z == 0),
            upper.cards(SIDE=lambda x, y, z: x == 1, FLANK=lambda x, y, z: y == 0),
            "*MATERIAL, NAME=M\n*ELASTIC\n1e6, 0.3\n*SOLID SECTION, ELSET=BASE, MATERIAL=M\n"
            "*SOLID SECTION, ELSET=WEDGE, MATERIAL=M\n",
            pair("WEDGE-SOLE, BASE-SLOPE", mu),
            step("WEDGE-SIDE, 1, 1, 0.01").replace("*END", "*DSLOAD\nWEDGE-TOP, P, 1.\n*END"),
        ]
        text = deck(*cards, held="BASE-FLOOR, 1, 3\nWEDGE-FLANK, 2").replace(
            "*NODE", "*PARAMETER\nelement = C3D8\n*NODE", 1)
        result = solved(self, text)
        self.assertTrue(np.all(result.pairs[0].status[-1] == 2))
        force = result.pairs[0].resultant[-1]
        self.assertAlmostEqual(force[2] / 4, 1, delta=1e-8)
        return -force[0] / force[2]

    def test_a_wedge_is_pushed_up_a_slope(self):
        """F/G = (tan a + mu)/(1 - mu tan a)."""
        for mu, published in ((0.0, 0.1), (0.1, 0.20202), (0.2, 0.306122), (0.3, 0.412371)):
            with self.subTest(mu=mu):
                self.assertAlmostEqual(self.wedge(mu) / published, 1, delta=1e-5)

    def pad(self, side):
        """SSNV503 of Code_Aster: a pad under 300 on a base, mu = 0.3, pushed at one side.

        The top is twice as large as the side: it slides where the side carries more than 180.
        """
        two = (block("BASE", (6, 1, 2), (-1, 0, -1), (4, 1, 1), 1e5, 0.0),
               block("PAD", (5, 1, 2), (0, 0, 0), (2, 1, 1), 2.1e5, 0.0))
        loads = f"*DSLOAD\nPAD-ZMAX, P, 300.\nPAD-XMIN, P, {side!r}\n"
        cards = step("BASE-ZMIN, 1, 3").replace("*END STEP", f"{loads}*END STEP")
        return Run(deck(*two, pair("PAD-ZMIN, BASE-ZMAX", 0.3), cards, held="BASE-ZMIN, 1, 3\n"
                        "BASE-YMIN, 2, 2\nBASE-YMAX, 2, 2\nPAD-YMIN, 2, 2\nPAD-YMAX, 2, 2"),
                   name="pad")

    def test_a_pad_sticks_or_slides(self):
        sticks = self.pad(178.2)
        self.assertEqual(sticks.status, 0, sticks.errors)
        with sticks.result() as result:
            self.assertAlmostEqual(abs(result.pairs[0].resultant[-1][0]) / 178.2, 1, places=7)
        slides = self.pad(181.8)
        self.assertEqual(slides.status, 2, slides.output)
        self.assertIn("translation along x", slides.errors)



class Half(unittest.TestCase):
    """Bodies that are half-spaces beside their contact: blocks whose gaps are those of round ones.

    Bricks grow with the distance from the middle of the contact.
    """

    def solve(self, *cards, held):
        text = deck(*cards, held=held)
        return solved(self, text.replace("*NODE", "*PARAMETER\nelement = C3D8I\n*NODE", 1))

    def test_cylinders_alike_stick_in_the_middle(self):
        """Cattaneo, Mindlin: |x| < c sticks, c = b sqrt(1 - Q/(mu P)); b and p0 are Hertz's.

        There the traction is less than mu p by mu p0 c/b sqrt(1 - x^2/c^2).
        """
        radius, young, nu, mu, push, pull, size = 8.0, 200.0, 0.3, 0.2, 10.0, 0.93616, 15.0

        def place(t):
            return size * (0.05 * t + 0.95 * t**5)

        low, high = Mesh("LOW"), Mesh("HIGH", 20001)
        low.grid((40, 1, 14), lambda a, b, c: (place(2 * a - 1), b, -place(1 - c)), TOP="k+")
        high.grid((40, 1, 14), lambda a, b, c: (place(2 * a - 1), b, place(c)),
                  SOLE="k-", CROWN="k+")
        sole = sorted(high.of_surface["SOLE"])
        gaps = "".join(f"{k}, {high.nodes[k - high.first][0]**2 / radius!r}\n" for k in sole)
        presses, pulls = (f"*CLOAD\n90001, 3, {-push!r}\n*END", f"*CLOAD\n90001, 1, {pull!r}\n*END")
        result = self.solve(
            low.cards(FLOOR=lambda x, y, z: z < 1e-6 - size, ALL=lambda x, y, z: True),
            high.cards(BELOW=lambda x, y, z: z < size - 1e-6),
            f"*NODE, NSET=LEAD\n90001, 0., 0.5, {size!r}\n", MATERIAL.format(young=young, nu=nu),
            "*COUPLING, REF NODE=90001, SURFACE=HIGH-CROWN\n*KINEMATIC\n",
            pair("HIGH-SOLE, LOW-TOP", mu, ", SMALL SLIDING"), "*CONTACT GAP\n" + gaps,
            step("90001, 2, 2\n90001, 4, 6").replace("*END", presses),
            step("90001, 2, 2\n90001, 4, 6", 4).replace("*END", pulls),
            held="LOW-FLOOR, 1, 3\nLOW-ALL, 2\nHIGH-BELOW, 2",
        )
        touching = result.pairs[0]
        half_width, peak = line_contact(push, radius / 2, young / (2 * (1 - nu**2)))
        self.assertAlmostEqual(half_width, 0.68078, places=5)
        self.assertAlmostEqual(peak, 9.3514, places=4)
        b, p0 = fit_line_contact(touching)
        self.assertAlmostEqual(b / half_width, 1, delta=0.015)
        self.assertAlmostEqual(p0 / peak, 1, delta=0.01)
        traction = touching.reaction[-1] / touching.area[:, None]
        spare = mu * traction[:, 0] - np.linalg.norm(traction[:, 1:], axis=1)
        used = spare > 0.2 * spare.max()
        slope, top = np.polyfit(mean_square(touching.coordinates[:, 0])[used], spare[used] ** 2, 1)
        self.assertAlmostEqual(np.sqrt(-top / slope) / 0.49651, 1, delta=0.015)
        self.assertAlmostEqual(np.sqrt(top) / (mu * peak * 0.49651 / half_width), 1, delta=0.02)
        self.assertEqual({1, 2}, set(touching.status[-1][touching.status[-1] > 0]))

    def test_two_spheres(self):
        """SSNV104 of Code_Aster (Hertz): crushed by 4 in all, p0 = 2798.3 and a = 10."""
        young, nu, radius, size = 20000.0, 0.3, 50.0, 60.0
        load = 4 / 3 * young / (2 * (1 - nu**2)) * 10.0**3 / (radius / 2)

        def place(t):
            return size * (0.2 * t + 0.8 * t**3)

        low, high = Mesh("LOW"), Mesh("HIGH", 50001)
        low.grid((16, 16, 10), lambda a, b, c: (place(a), place(b), -place(1 - c)), TOP="k+")
        high.grid((16, 16, 10), lambda a, b, c: (place(a), place(b), place(c)),
                  SOLE="k-", CROWN="k+")
        planes = {"X": lambda x, y, z: x == 0, "Y": lambda x, y, z: y == 0}
        result = self.solve(
            low.cards(FLOOR=lambda x, y, z: z < 1e-6 - size, **planes), high.cards(**planes),
            MATERIAL.format(young=young, nu=nu),
            pair("HIGH-SOLE, LOW-TOP", 0.0, ", SMALL SLIDING"),
            f"*CONTACT GAP, PARABOLA\nHIGH-SOLE, 0., 0., 0., {radius / 2!r}\n",
            step("LOW-FLOOR, 1, 3").replace(
                "*END", f"*DSLOAD\nHIGH-CROWN, P, {load / 4 / size**2!r}\n*END"),
            held="LOW-FLOOR, 1, 3\nLOW-X, 1\nLOW-Y, 2\nHIGH-X, 1\nHIGH-Y, 2",
        )
        touching = result.pairs[0]
        self.assertAlmostEqual(touching.normal_sum[-1] / (load / 4), 1, places=9)
        pressure = touching.reaction[-1][:, 0] / touching.area
        used = pressure > 0.3 * pressure.max()
        square = mean_square(touching.coordinates[:, 0]) + mean_square(touching.coordinates[:, 1])
        slope, top = np.polyfit(square[used], pressure[used] ** 2, 1)
        self.assertAlmostEqual(np.sqrt(top) / 2798.3, 1, delta=0.01)
        self.assertAlmostEqual(np.sqrt(-top / slope) / 10, 1, delta=0.015)


if __name__ == "__main__":
    unittest.main()
