"""Errors by mesh and load steps at finite strain, and accuracies that are asked for."""

import re
import unittest

import numpy as np
from program import INPUT, Run, in_long_form

# Cook's panel between walls, neo-Hookean, its right side drawn up by a quarter of its height.
COOK = """\
*PARAMETER
element = C3D8I
up = 10.
*NODE, NSET=ALL
1, 0., 0., 0.
2, 48., 44., 0.
3, 48., 60., 0.
4, 0., 44., 0.
5, 0., 0., 1.
6, 48., 44., 1.
7, 48., 60., 1.
8, 0., 44., 1.
*ELEMENT, TYPE=<element>, ELSET=B
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=LEFT
1, 4, 5, 8
*NSET, NSET=RIGHT
2, 3, 6, 7
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
<240.565/5.2>, <2.4/240.565>
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.25, 1.
*EL FILE
ERR
*BOUNDARY
ALL, 3, 3
LEFT, 1, 2
RIGHT, 2, 2, <up>
*END STEP
"""

# Scenes in plane strain, neo-Hookean: a block on a plane, one on another block, a column at 0.7 of
# Euler's load, its foot on a plane. They are pressed, then pushed sideways.
HEAD = """\
*PARAMETER
n = 2
element = C3D8
E = 1000.
nu = 0.3
mu = 0.1
"""
BODY = """\
*BLOCK, NAME=B, ELSET=B, TYPE=<element>, NX=<{nx}>, NY=1, NZ=<{nz}>
{box}
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
<E/(4*(1+nu))>, <6*(1-2*nu)/E>
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
<mu>
"""
ON_PLANE = """\
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
"""
ON_BLOCK = """\
*BLOCK, NAME=T, ELSET=T, TYPE=<element>, NX=<n>, NY=1, NZ=<n>
0.2, 0., 1., 0.8, 0.5, 1.6
*SOLID SECTION, ELSET=T, MATERIAL=M
*CONTACT PAIR, INTERACTION=I
T-ZMIN, B-ZMAX
"""
STEPS = """\
*STEP, NLGEOM
*STATIC
{increment}, 1.
*BOUNDARY
B-YMIN, 2, 2
B-YMAX, 2, 2
{held}{top}-ZMAX, 1, 1
{top}-ZMAX, 3, 3, {press}
*END STEP
*STEP
*STATIC
{increment}, 1.
*BOUNDARY
{top}-ZMAX, 1, 1, {push}
*END STEP
"""


FINE = {
    "block": (96.38, -8.82, 95.15),
    "rubber": (128.2, -8.62, 124.9),
    "pair": (41.25, -0.625, 40.82),
    "column": (8.977, 0.062, 8.949),
}


def scene(name):
    """Return the deck of a scene."""
    if name == "block":
        body = BODY.format(nx="n", nz="n", box="0., 0., 0., 1.5, 0.5, 1.")
        steps = STEPS.format(increment=0.125, held="", top="B", press=-0.1, push=0.05)
        return HEAD + body + ON_PLANE + steps
    if name == "rubber":
        return scene("block").replace("C3D8", "C3D8I").replace("nu = 0.3", "nu = 0.45")
    if name == "column":
        body = BODY.format(nx="n", nz="6*n", box="0., 0., 0., 1., 0.5, 12.")
        press = -0.7 * 4 * np.pi**2 / 12 / 12
        steps = STEPS.format(increment=0.25, held="", top="B", press=press, push=0.1)
        return (
            (HEAD + body + ON_PLANE + steps)
            .replace("mu = 0.1", "mu = 0.3")
            .replace("C3D8", "C3D8I")
        )
    body = BODY.format(nx="2*n+1", nz="n", box="0., 0., 0., 1.2, 0.5, 1.")
    held = "T-YMIN, 2, 2\nT-YMAX, 2, 2\nB-ZMIN, 1, 3\n"
    steps = STEPS.format(increment=0.125, held=held, top="T", press=-0.2, push=0.1)
    return (HEAD + body + ON_BLOCK + steps).replace("mu = 0.1", "mu = 0.3")


def errors(run, row=-1):
    """Return the errors by mesh and load steps, and the strain energy, at the end of a row."""
    assert run.status == 0, run.errors
    with run.result() as result:
        names = ("error/mesh", "error/load_steps", "energy/strain")
        return [float(result.history(name)[row]) for name in names]


class ByTheMesh(unittest.TestCase):
    """The energy of the recovered stresses, docs/theory.md (10.25)."""

    # Strain energy of meshes divided two, three and four times, of C3D8I and of C3D8 alike, by
    # Richardson's extrapolation.
    ENERGY = 618.6

    def test_error_of_the_energy_is_told(self):
        for element, divided in (("C3D8I", "2"), ("C3D8I", "3"), ("C3D8", "3")):
            run = Run(COOK, "--refine", divided, name="cook", element=element)
            told, _, energy = errors(run)
            true = energy / self.ENERGY - 1
            self.assertLess(told, 1.3 * true)
            self.assertGreater(told, 0.6 * true)

    def test_field_of_elements_sums_to_the_error(self):
        run = Run(COOK, "--refine", "2", name="cook")
        told, _, energy = errors(run)
        with run.result() as result:
            of_elements = result.field("mesh_error", -1)
        np.testing.assert_allclose(of_elements.sum(), told * 2 * energy, rtol=1e-10)

    def test_small_strain_is_as_without(self):
        for element in ("C3D8", "C3D8I", "C3D8B"):
            told = [
                errors(Run(COOK, "--refine", "2", *options, name="cook", element=element, up=1e-6))
                for options in ((), ("--nlgeom", "no"))
            ]
            np.testing.assert_allclose(told[0], told[1], rtol=1e-5)


class ByLoadSteps(unittest.TestCase):
    """A coarse run beside the run, docs/theory.md (10.2)."""

    def test_slip_that_depends_on_the_path(self):
        """Rubber that slides edge first, beside increments an eighth as large."""
        ends, told = {}, {}
        for steps in (4, 8, 64):
            run = Run(INPUT / "rubber.inp", "--quiet", n=4, steps=steps)
            told[steps] = errors(run)[1]
            with run.result() as result:
                ends[steps] = result.pairs["BLOCK-ZMIN:GROUND"].resultant[-1]
        for steps in (4, 8):
            true = np.linalg.norm(ends[steps] - ends[64]) / np.linalg.norm(ends[64])
            self.assertGreater(true, 1e-4)
            self.assertGreater(told[steps], 0.5 * true)
            self.assertLess(told[steps], 2 * true)
        self.assertLess(told[64], 0.4 * told[8])


class Asked(unittest.TestCase):
    """Accuracies that are asked for, beside forces on fine meshes.

    Forces in the middle and at the end, pressing, friction, pressing, are Richardson's of meshes
    with n = 8, 16 and 32 (the column: 4, 8 and 16).
    """

    def check(self, name, accuracy):
        run = Run(scene(name), "--accuracy", str(accuracy), "--quiet", name=name)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            (pair,) = result.pairs.values()
            middle, end = (pair.resultant[row] for row in map(int, result.step_ends))
        for value, true in zip((middle[2], end[0], end[2]), FINE[name], strict=True):
            # The scale of a small force is a tenth of the largest.
            allowed = accuracy * max(abs(true), 0.1 * FINE[name][0])
            self.assertLess(abs(value - true), allowed, (name, accuracy))
        # The accuracy has chosen the tolerance as well.
        friction = 0.1 if name in ("block", "rubber") else 0.3
        certified = float(re.search("certified to ([0-9.e-]+),", run.output)[1])
        self.assertAlmostEqual(certified, 10 * 0.002 * accuracy * friction)

    def test_ten_percent(self):
        for name in FINE:
            self.check(name, 0.1)

    @in_long_form
    def test_three_percent(self):
        for name in ("pair",):
            self.check(name, 0.03)

    def test_one_percent(self):
        for name in ("block", "column"):
            self.check(name, 0.01)

    def test_a_mesh_that_is_kept(self):
        """Covered areas count as they are deformed: the sides of the pressed block bulge."""
        run = Run(scene("pair"), "--accuracy", "0.05", "--refine", "0", name="pair", n=5)
        self.assertEqual(run.status, 0, run.errors)
        told, _, _ = errors(run)
        self.assertLess(told, 0.04)
        self.assertGreater(told, 0.01)

    def test_a_time(self):
        run = Run(scene("block"), "--time", "1", "--quiet", name="block")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("within 1 s of CPU time", run.output)


if __name__ == "__main__":
    unittest.main()
