"""What a run says of the limits of its theory and of its mesh."""

import re
import unittest

import numpy as np
from program import INPUT, Run

SIGNS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
                  [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
# A ball of radius 2 is pressed into the middle of a face, on which a node of the mesh lies.
PRESSED = """*NODE, NSET=CENTRE
1, 0., 0., 2.
*BLOCK, NAME=BODY, TYPE=C3D8I, NX={n}, NY={n}, NZ=4
{low}, {low}, -1., {size}, {size}, 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=M
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=1
0., 0., 2., 2.
*SURFACE INTERACTION, NAME=DRY
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMAX, BALL
*BOUNDARY
BODY-ZMIN, 1, 3
{more}*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
CENTRE, 1, 2
CENTRE, 3, 3, {depth}
*END STEP
"""
THEORY = "finite strain (?:may change|changes) forces by"
MESH = r"touches at (one point|two points) at node (\d+)(.*): contact pressure is not resolved; " \
    r"that takes elements of about (\S+)"


def largest_deformation(result):
    """The largest principal strain and rotation at the centres of the elements, over the run."""
    mesh = result.file["VTKHDF"]
    points = mesh["Points"][:]
    elements = mesh["Connectivity"][:].reshape(-1, 8)
    jacobian = np.einsum("eai,ak->eik", points[elements], SIGNS / 8)
    found = np.zeros(2)
    for step in range(mesh["Steps"].attrs["NSteps"]):
        u = result.field("displacement", step)
        h = np.einsum("eai,ak->eik", u[elements], SIGNS / 8) @ np.linalg.inv(jacobian)
        across = h.transpose(0, 2, 1)
        strain = abs(np.linalg.eigvalsh((h + across) / 2)).max()
        rotation = np.sqrt(((h - across) ** 2).sum((1, 2)).max() / 8)
        found = np.maximum(found, [strain, rotation])
    return found


class SmallStrain(unittest.TestCase):
    """Strains and rotations are in the file, and reported where theory leaves much out."""

    def check(self, run):
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            told = [result.counters[name] for name in ("largest_strain", "largest_rotation")]
            np.testing.assert_allclose(told, largest_deformation(result), rtol=1e-9, atol=1e-12)
        return told

    def test_the_block_leaves_linear_theory(self):
        run = Run(INPUT / "block.inp")
        strain, rotation = self.check(run)
        self.assertGreater(min(strain, rotation), 0.05)
        line = re.findall(
            rf"note: strains up to (\S+) %, rotations up to (\S+) rad: {THEORY} (\S+) %; "
            "--nlgeom yes includes it\n",
            run.output)
        self.assertEqual(len(line), 1, run.output)
        self.assertAlmostEqual(float(line[0][0]), 100 * strain, delta=0.5)
        self.assertAlmostEqual(float(line[0][1]), rotation, delta=0.005)
        with run.result() as result:
            error = result.history("error/small_strain").max()
            self.assertEqual(result.counters["largest_small_strain_error"], error)
        self.assertAlmostEqual(float(line[0][2]), 100 * error, delta=0.5)
        # A run at finite strain went along.
        self.assertIn(f"at small strain, which is off by {line[0][2]} % here",
                      run.output.splitlines()[-1])

    def test_what_is_small_is_not_told(self):
        for deck, options in (("patch", {}), ("ball", {"n": 4})):
            run = Run(INPUT / f"{deck}.inp", **options)
            self.assertGreater(self.check(run)[0], 0)
            self.assertNotRegex(run.output, THEORY)
            self.assertNotIn("at small strain", run.output)

    def test_ends_of_steps_count_where_no_fields_are_written(self):
        text = (INPUT / "block.inp").read_text()
        every = Run(text, name="block")
        ends = Run(re.sub(r"\*END STEP", "*OUTPUT, FIELD, FREQUENCY=0\n*END STEP", text),
                   name="block")
        self.assertEqual(ends.status, 0, ends.errors)
        with every.result() as one, ends.result() as other:
            self.assertLessEqual(other.counters["largest_strain"], one.counters["largest_strain"])
            self.assertGreater(other.counters["largest_strain"], 0.05)


class SmallContact(unittest.TestCase):
    """A round contact on one or two points is told, with the elements that Hertz would need."""

    def told(self, run):
        self.assertEqual(run.status, 0, run.errors)
        found = re.findall(MESH, run.output)
        self.assertLessEqual(len(found), 1, run.output)
        return (found[0][0], float(found[0][3])) if found else None

    def press(self, depth, n=8, low=-1.0, more=""):
        text = PRESSED.format(depth=-depth, n=n, low=low, size=1 - low, more=more)
        return Run(text, "--quiet", name="pressed")

    def test_a_ball_on_one_node(self):
        for depth in (0.001, 0.005):
            points, element = self.told(self.press(depth))
            self.assertEqual(points, "one point")
            hertz = np.sqrt(2.0 * depth) / 2  # half the radius of the contact
            self.assertLess(hertz / 1.5, element)
            self.assertLess(element, 1.5 * hertz)

    def test_a_ball_on_many_nodes(self):
        self.assertIsNone(self.told(self.press(0.02)))

    def test_symmetry_planes_change_nothing(self):
        planes = "BODY-XMIN, 1, 1\nBODY-YMIN, 2, 2\n"
        quarter = self.press(0.001, n=4, low=0.0, more=planes)
        self.assertEqual(self.told(quarter), self.told(self.press(0.001)))

    def test_hertz_by_force_knows_the_radius(self):
        # Coarse on purpose: elements of 20 and more where the contact's radius is 0.4.
        settings = {"a": 0.4, "size": 200, "grading": 1, "n": 4}
        for deck in ("ball", "hertz"):
            with self.subTest(deck=deck):
                points, element = self.told(Run(INPUT / f"{deck}.inp", **settings))
                self.assertEqual(points, "one point")
                self.assertAlmostEqual(element, 0.2, delta=0.01)

    def test_a_roller_on_two_nodes(self):
        points, element = self.told(Run(INPUT / "roller.inp", n=2, a=0.1, size=80))
        self.assertEqual(points, "two points")
        self.assertAlmostEqual(element, 0.05, delta=0.01)

    def test_corners_and_planes_are_left_out(self):
        for deck in ("block", "rest", "corner"):
            with self.subTest(deck=deck):
                run = Run(INPUT / f"{deck}.inp", "--quiet")
                self.assertNotIn("not resolved", run.output)


if __name__ == "__main__":
    unittest.main()
