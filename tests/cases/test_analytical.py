"""Analytical surfaces are the shapes that their profiles make; cones have ends."""

import unittest

import numpy as np
from program import Run
from test_plane import pair, section, slanted, step

from studies.plane_meshes import PlaneMesh as Mesh

CUBE = """*BLOCK, NAME=A, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*NODE, NSET=HUB
900, 0.5, 0.5, -2.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=A, MATERIAL=M
*SURFACE INTERACTION, NAME=I
{tool}*CONTACT PAIR, INTERACTION=I
A-ZMIN, TOOL
*BOUNDARY
HUB, 1, 2
A-ZMAX, 1, 3
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
HUB, 3, 3, 0.01
*END STEP
"""
# Axes below the cube: x stays, y is up, and what is swept goes against z; of what is turned z is
# up. The body is to the left.
SWEPT = "CYLINDER, NAME=TOOL\n0.5, 0.5, -2., 1.5, 0.5, -2.\n0.5, 1.5, -2.\n"
TURNED = "REVOLUTION, NAME=TOOL\n0.5, 0.5, -2., 0.5, 0.5, -1.\n"
PLANE = "PLANE, REF NODE=900\n0., 0., 0., 0., 0., 1.\n"
SHAPES = (
    (SWEPT + "START, -3., 2.\nLINE, 0., 2.\nLINE, 3., 2.\n", PLANE, "a plane without ends"),
    (TURNED + "START, 0., 2.\nLINE, 3., 2.\n", PLANE, "a plane without ends"),
    (SWEPT + "START, -2., 0.\nCIRCL, 0., 2., 0., 0.\nCIRCL, 2., 0., 0., 0.\n",
     "CYLINDER, REF NODE=900\n0.5, 0., -2., 0., 1., 0., 2.\n", "a whole cylinder without ends"),
    (TURNED + "START, 0., 2.\nCIRCL, 2., 0., 0., 0.\n",
     "SPHERE, REF NODE=900\n0.5, 0.5, -2., 2.\n", "a whole sphere"),
    # A bowl about the cube: its centre is to the left.
    (TURNED + "START, 0., 2.\nCIRCL, 3., 5., 0., 5.\n",
     "SPHERE, INNER, REF NODE=900\n0.5, 0.5, 3., 3.\n", "a whole sphere"),
)  # fmt: skip
PARTS = """*PART, NAME=FLOOR
*NODE, NSET=RP
1, 0., 0., 0.
*SURFACE, TYPE=CYLINDER, NAME=RIGID
START, 5., 0.
LINE, -5., 0.
*RIGID BODY, REF NODE=RP, ANALYTICAL SURFACE=RIGID
*END PART
*PART, NAME=CUBE
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
*NSET, NSET=TOP
5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=ALL
1, 1, 2, 3, 4, 5, 6, 7, 8
*SURFACE, NAME=FOOT
1, S1
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*END PART
*ASSEMBLY, NAME=ASSEMBLY
*INSTANCE, NAME=F, PART=FLOOR
0.5, 0.25, 0.
0.5, 0.25, 0., 1.5, 0.25, 0., -90.
*END INSTANCE
*INSTANCE, NAME=C, PART=CUBE
*END INSTANCE
*END ASSEMBLY
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
C.FOOT, F.RIGID
*BOUNDARY
C.TOP, 1, 3
F.RP, 1, 2
*STEP
*STATIC
*BOUNDARY
F.RP, 3, 3, 0.01
*END STEP
"""


class Analytical(unittest.TestCase):
    def forces(self, deck, note=""):
        """Return the reactions of the points, and the resultant."""
        run = Run(deck, name="tool")
        self.assertEqual(run.status, 0, run.output + run.errors)
        self.assertIn(note, run.output)
        with run.result() as result:
            self.assertTrue(result.certified)
            return result.pairs[0].force[-1], result.pairs[0].resultant[-1]

    def test_each_is_the_obstacle_of_its_shape(self):
        rigid = "*RIGID BODY, ANALYTICAL SURFACE=TOOL, REF NODE=900\n"
        for profile, shape, note in SHAPES:
            with self.subTest(profile):
                own, total = self.forces(CUBE.format(tool=f"*SURFACE, TYPE={profile}{rigid}"),
                                         note=note)  # fmt: skip
                same, _ = self.forces(CUBE.format(tool=f"*OBSTACLE, NAME=TOOL, TYPE={shape}"))
                np.testing.assert_allclose(own, same, atol=1e-9)
                self.assertGreater(total[2], 0.1)

    def test_profiles_of_several_pieces(self):
        """A table with a rounded rim, wider than the cube, is a plane beneath it."""
        rigid = "*RIGID BODY, ANALYTICAL SURFACE=TOOL, REF NODE=900\n"
        table = "START, {0}3., 0.\nLINE, {0}3., 1.\nCIRCL, {0}2., 2., {0}2., 1.\nLINE, 0., 2.\n"
        rim = table.format("-") + "LINE, 2., 2.\nCIRCL, 3., 1., 2., 1.\nLINE, 3., 0.\n"
        other = "START, 0., 2.\nLINE, 2., 2.\nCIRCL, 3., 1., 2., 1.\nLINE, 3., 0.\n"
        cone = "*OBSTACLE, NAME=TOOL, TYPE=CONE, REF NODE=900\n.5, .5, 0., 0, 0, -1., 2, 3, 1\n"
        plane, total = self.forces(CUBE.format(tool=f"*OBSTACLE, NAME=TOOL, TYPE={PLANE}"))
        for name, tool, note in (
            ("swept", f"*SURFACE, TYPE={SWEPT}{rim}{rigid}", "has 94 facets, and ends where"),
            ("turned", f"*SURFACE, TYPE={TURNED}{other}{rigid}", "ends where its profile does"),
            ("cone", cone, "are 180 facets, off by at most 0.0003"),
        ):
            with self.subTest(name):
                own, _ = self.forces(CUBE.format(tool=tool), note=note)
                np.testing.assert_allclose(own, plane, atol=1e-8)
        self.assertGreater(total[2], 10)

    def test_a_punch_ends(self):
        """A cylinder of radius 1/4 on the middle of a face: it alone is pressed."""
        own, total = self.forces(CUBE.replace("NX=2, NY=2", "NX=8, NY=8").format(
            tool="*OBSTACLE, NAME=TOOL, TYPE=CONE, REF NODE=900\n"
            ".5, .5, -1., 0., 0., 1., .25, .25, 1.\n"
        ))  # fmt: skip
        points = np.array([(x, y) for y in range(9) for x in range(9)]) / 8 - 0.5
        far = np.hypot(*points.T) > 0.25 + 0.125 * 2**0.5
        self.assertEqual(len(own), len(points))
        np.testing.assert_array_equal(own[far], 0)
        self.assertGreater(own[40, 2], 0)
        # A quarter of a turn changes nothing.
        around = np.lexsort((points[:, 0], -points[:, 1]))
        np.testing.assert_allclose(own[around, 2], own[:, 2], atol=1e-6 * total[2])

    def test_profiles_before_elements_of_a_plane(self):
        """A rounded table is a plane to what is narrower; a cone bears F along its axis."""
        flat = "*OBSTACLE, NAME=TOOL, TYPE=PLANE, REF NODE=900\n0., 0., 0., 0., 1., 0.\n"
        table = (
            "*SURFACE, TYPE=SEGMENTS, NAME=TOOL\nSTART, {0}., 0.\nLINE, 2., 0.\n"
            "CIRCL, 3., -1., 2., -1.\n*RIGID BODY, ANALYTICAL SURFACE=TOOL, REF NODE=900\n"
        )
        for kind, first in (("CPE4", -2), ("CPS4I", -2), ("CAX4", 0)):
            mesh = Mesh(kind, (3, 2), slanted).deck + section("A") + "*NODE\n900, 0., -1.\n"
            more = pair("ABOTTOM", "TOOL", 0.1) + step(
                "*BOUNDARY\nATOP-N, 1, 2\n900, 1\n900, 6\n900, 2, 2, 0.01", nlgeom=True
            )
            with self.subTest(kind):
                _, total = self.forces(mesh + table.format(first) + more, note="facets, and ends")
                _, same = self.forces(mesh + flat + more)
                np.testing.assert_allclose(total, same, atol=1e-4 * abs(same).max())
        chamfered = Mesh("CAX4", (1, 1), lambda a, b: (1 + a, 2 * b + (1 - a) * (1 - b)))
        cone = "*SURFACE, TYPE=SEGMENTS, NAME=TOOL\nSTART, 0., 2.\nLINE, 3., -1.\n"
        deck = chamfered.deck + section("A") + cone + pair("ABOTTOM", "TOOL")
        own, total = self.forces(deck + step("*DSLOAD\nATOP, P, 10."), note="has 1 facet, and")
        self.assertAlmostEqual(total[1] / (30 * np.pi), 1, 4)
        np.testing.assert_allclose(own[:, 0], own[:, 1], rtol=1e-3)

    def test_an_instance_moves_it(self):
        """The part's floor faces -y; turned by -90 degrees about x it faces up: E times 0.01."""
        _, total = self.forces(PARTS)
        np.testing.assert_allclose(total, [0, 0, 10], atol=1e-7)


if __name__ == "__main__":
    unittest.main()
