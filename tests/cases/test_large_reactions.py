"""Contact forces many times the loads are right, certified, and reported with their cause."""

import unittest

import numpy as np
from program import Run

# The faces that touch are parallel to the walls; nothing but the walls holds the wedge in x and z.
WEDGE = """*HEADING
A wedge of slope s between two walls, pressed in by 1
*PARAMETER
s = 0.01
mu = 0.
wide = 0.5 + s
*NODE, NSET=ALL
1, -0.5, 0., 0.
2, 0.5, 0., 0.
3, 0.5, 1., 0.
4, -0.5, 1., 0.
5, <-wide>, 0., 1.
6, <wide>, 0., 1.
7, <wide>, 1., 1.
8, <-wide>, 1., 1.
*ELEMENT, TYPE=C3D8, ELSET=W
1, 1, 2, 3, 4, 5, 6, 7, 8
*SURFACE, NAME=LEFT
W, S6
*SURFACE, NAME=RIGHT
W, S4
*SURFACE, NAME=TOP
W, S2
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=W, MATERIAL=M
*OBSTACLE, NAME=A, TYPE=PLANE
-0.5, 0., 0.,  1., 0., <s>
*OBSTACLE, NAME=B, TYPE=PLANE
0.5, 0., 0.,  -1., 0., <s>
*SURFACE INTERACTION, NAME=I
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=I
LEFT, A
RIGHT, B
*BOUNDARY
ALL, 2
*STEP
*STATIC
1., 1.
*DSLOAD
TOP, P, <1/(1 + 2*s)>
*END STEP
"""

# The block slides along x alone; the plane faces it at a slope of s to its guide.
GUIDED = """*HEADING
A guided block, pushed by 1 against a plane along which it nearly slides
*PARAMETER
s = 0.01
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=G, TYPE=PLANE
1., 0., 0.,  <-s>, 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-XMAX, G
*BOUNDARY
B, 2, 3
*STEP
*STATIC
1., 1.
*DSLOAD
B-XMIN, P, 1.
*END STEP
"""

# What the planes do to the block is that of the overlaps; the load is small beside it.
FIT = """*HEADING
A block of height 1.01 in a frame of two planes that are 1 apart, pulled a little to its side
*PARAMETER
load = 1e-3
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.01
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=LOW, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*OBSTACLE, NAME=HIGH, TYPE=PLANE
0., 0., 1.,  0., 0., -1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, LOW
B-ZMAX, HIGH
*BOUNDARY
B-XMIN, 1
B-YMIN, 2
*STEP
*STATIC
1., 1.
*DSLOAD
B-XMAX, P, <load>
*END STEP
"""

LARGE = "times the loads and the forces of moving supports"


class LargeReactions(unittest.TestCase):
    def force(self, run, pair):
        """Return the magnitude of a pair's resultant; the run is certified."""
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            return np.linalg.norm(result.file[f"contact/{pair}/resultant"][-1])

    def test_a_wedge_between_two_walls(self):
        # Along z: 1 = 2 N s/sqrt(1 + s^2).
        for s, is_large in ((0.2, False), (0.06, False), (0.04, True), (1e-2, True), (1e-3, True)):
            with self.subTest(s=s):
                run = Run(WEDGE, name="wedge", s=s)
                expected = np.hypot(1, s) / (2 * s)
                self.assertAlmostEqual(self.force(run, "LEFT:A") / expected, 1, delta=1e-6)
                self.assertEqual(run.output.count(LARGE), int(is_large), run.output)
                if is_large:
                    self.assertIn("They and those of RIGHT:B balance each other", run.output)
                    self.assertNotIn("overlap", run.output)

    def test_a_wedge_that_friction_holds_is_none(self):
        # On walls that stick the shear carries the load: N no more than a few of it.
        run = Run(WEDGE, name="wedge", mu=1)
        self.force(run, "LEFT:A")
        self.assertNotIn(LARGE, run.output)

    def test_a_guided_block(self):
        for s, is_large in ((0.15, False), (1e-2, True), (1e-4, True)):
            with self.subTest(s=s):
                run = Run(GUIDED, name="guided", s=s)
                force = self.force(run, "B-XMAX:G")
                self.assertAlmostEqual(force * s / np.hypot(1, s), 1, delta=1e-5)
                self.assertEqual(run.output.count(LARGE), int(is_large), run.output)
                if is_large:
                    self.assertIn("Supports at rest balance them", run.output)

    def test_a_fit_under_a_small_load(self):
        # E A d/L = 9.901, of overlaps that are 0.01 together.
        for load, is_large in ((2.0, False), (1e-3, True)):
            with self.subTest(load=load):
                run = Run(FIT, name="fit", load=load)
                force = self.force(run, "B-ZMAX:HIGH")
                self.assertAlmostEqual(force, 1000 * 0.01 / 1.01, delta=1e-5)
                self.assertEqual(run.output.count(LARGE), int(is_large), run.output)
                if is_large:
                    self.assertRegex(run.output, r"those of \S+ balance each other")
        # Nothing is applied: overlaps are all there is.
        run = Run(FIT, name="fit", load=0)
        self.force(run, "B-ZMAX:HIGH")
        self.assertNotIn(LARGE, run.output)


if __name__ == "__main__":
    unittest.main()
