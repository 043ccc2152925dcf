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
from two_bodies import solved

from studies.case_bodies import fit_line_contact, lame, line_contact, sinks  # found through program
from studies.deck_cards import block, deck, pair, step
from studies.meshes import mesh_file
from studies.published_bodies import (
    CYLINDERS,
    cylinders_deck,
    cylinders_values,
    rings_deck,
    rings_errors,
    rings_in_rings,
    spheres_deck,
    spheres_load,
    spheres_values,
    wedge_deck,
)


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
        """Lame, plane stress: 6.1523. The error falls with the square of the elements' size."""
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

    def test_rings_under_a_pressure_that_varies(self):
        """Michell's solution, each value within the source's 2 %; and with ten times the variation.

        Where the polygons do not match their corners overlap by a tenth of the displacement: there
        single pressures say how they lie on each other.
        """
        _, way = rings_in_rings(np.linspace(0, 0.5 * np.pi, 91))
        self.assertAlmostEqual(np.abs(way).max(), 5.5e-3, delta=0.05e-3)  # as the source says
        for around, second in itertools.product(((32, 32), (32, 24), (24, 36)), (1e5, 1e6)):
            with self.subTest(around=around, second=second):
                result = solved(self, rings_deck(around, second))
                pressure, waves, way = rings_errors(result, second)
                if around[0] == around[1]:
                    self.assertLess(pressure, 0.01)
                self.assertLess(waves.max(), 0.008)
                self.assertLess(way, 0.02 if second < 1e6 else 0.025)

    def test_a_wedge_is_pushed_up_a_slope(self):
        """F/G = (tan a + mu)/(1 - mu tan a)."""
        for mu, published in ((0.0, 0.1), (0.1, 0.20202), (0.2, 0.306122), (0.3, 0.412371)):
            with self.subTest(mu=mu):
                result = solved(self, wedge_deck(mu))
                self.assertTrue(np.all(result.pairs[0].status[-1] == 2))
                force = result.pairs[0].resultant[-1]
                self.assertAlmostEqual(force[2] / 4, 1, delta=1e-8)
                self.assertAlmostEqual(-force[0] / force[2] / published, 1, delta=1e-5)

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
    """Bodies that are half-spaces beside their contact."""

    def test_cylinders_alike_stick_in_the_middle(self):
        """Cattaneo, Mindlin: |x| < c sticks, c = b sqrt(1 - Q/(mu P)); b and p0 are Hertz's."""
        result = solved(self, cylinders_deck())
        of = CYLINDERS
        half_width, peak = line_contact(of["push"], of["radius"] / 2,
                                        of["young"] / (2 * (1 - of["nu"] ** 2)))  # fmt: skip
        self.assertAlmostEqual(half_width, 0.68078, places=5)
        self.assertAlmostEqual(peak, 9.3514, places=4)
        b, p0, c, top = cylinders_values(result)
        self.assertAlmostEqual(b / half_width, 1, delta=0.015)
        self.assertAlmostEqual(p0 / peak, 1, delta=0.01)
        self.assertAlmostEqual(c / 0.49651, 1, delta=0.015)
        self.assertAlmostEqual(top / (of["mu"] * peak * 0.49651 / half_width), 1, delta=0.02)
        status = result.pairs[0].status[-1]
        self.assertEqual({1, 2}, set(status[status > 0]))

    def test_two_spheres(self):
        """SSNV104 of Code_Aster (Hertz): crushed by 4 in all, p0 = 2798.3 and a = 10."""
        result = solved(self, spheres_deck())
        self.assertAlmostEqual(result.pairs[0].normal_sum[-1] / (spheres_load() / 4), 1, places=9)
        a, p0 = spheres_values(result)
        self.assertAlmostEqual(p0 / 2798.3, 1, delta=0.01)
        self.assertAlmostEqual(a / 10, 1, delta=0.015)


if __name__ == "__main__":
    unittest.main()
