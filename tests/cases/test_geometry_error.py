"""What the geometry of faces makes of forces where meshes do not match is estimated, and counts."""

import unittest

import numpy as np
from program import ASKED, INPUT, Run

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
100000., 0.
"""
LEAVES = (
    """*BLOCK, NAME=LOW, NX=20, NY=2, NZ=2, TYPE=C3D8I
0., 0., 0.,  10., 1., .25
*BLOCK, NAME=UP, NX={n}, NY=2, NZ=2, TYPE=C3D8I
0., 0., .25,  10., 1., .25
"""
    + MATERIAL
    + """*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
UP-ZMIN, LOW-ZMAX
*BOUNDARY
LOW-XMIN, 1, 3
UP-XMIN, 1, 3
*STEP, NLGEOM=NO
*STATIC
.25, 1.
*BOUNDARY
UP-XMAX, 3, 3, -1.2
*END STEP
"""
)
PUNCH = """*BLOCK, NAME=LAYER, NX={n}, NY=1, NZ=2
0., 0., 0.,  1., .1, .2
*NODE
9000, 0., 0., 1.
9001, -1., -1., .2
9002, .55, -1., .2
9003, .55, 1., .2
9004, -1., 1., .2
*ELEMENT, TYPE=R3D4, ELSET=TOOL
9001, 9001, 9004, 9003, 9002
*RIGID BODY, ELSET=TOOL, REF NODE=9000
*SURFACE, NAME=FACE
TOOL, SPOS
*MATERIAL, NAME=M
*ELASTIC
100., 0.
*SOLID SECTION, ELSET=LAYER, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
LAYER-ZMAX, FACE
*BOUNDARY
LAYER-ZMIN, 1, 3
LAYER-YMIN, 2
LAYER-YMAX, 2
9000, 1, 2
*STEP, NLGEOM=NO
*STATIC
*BOUNDARY
9000, 3, 3, -.002
*END STEP
"""
BEAM = """*BLOCK, NAME=B, TYPE=C3D8I, NX=10, NY=1, NZ=1
0, 0, 0,  10, 1, 1
*MATERIAL, NAME=M
*ELASTIC
1000., .3
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
.3
*OBSTACLE, NAME=C, TYPE=CYLINDER
6.1, 0, -.6,  0, 1, 0,  .5
*CONTACT PAIR, INTERACTION=I
B-ZMIN, C
*STEP, NLGEOM=NO
*STATIC
.25, 1.
*BOUNDARY
B-XMIN, 1, 3
B-XMAX, 3, 3, -1.
*END STEP
"""


def force_and_errors(run):
    with run.result() as result:
        force = abs(result.pairs[0].resultant[-1][2])
        parts = ("between_nodes", "at_edges", "of_facets", "geometry", "total")
        return force, {name: result.history(f"error/{name}")[-1] for name in parts}


class Geometry(unittest.TestCase):
    def test_edges_in_faces(self):
        """With 20 elements along it the punch ends at nodes; with 10 in the middle of a face."""
        _, flush = force_and_errors(Run(PUNCH.format(n=20), name="flush"))
        self.assertEqual(flush["at_edges"], 0)
        right, _ = force_and_errors(Run(PUNCH.format(n=80), name="fine"))
        force, told = force_and_errors(Run(PUNCH.format(n=10), name="punch"))
        self.assertEqual(told["of_facets"], 0)
        off = abs(force - right) / force
        self.assertGreater(off, 0.03)
        self.assertGreater(told["total"], off / 3)
        self.assertLess(told["total"], 5 * off)

    def test_leaves(self):
        """Meshes that match add next to nothing; of others what their arcs differ by is told."""
        _, matching = force_and_errors(Run(LEAVES.format(n=20), name="matching"))
        self.assertLess(matching["geometry"], 0.003)
        right, _ = force_and_errors(Run(LEAVES.format(n=20), name="right"))
        force, told = force_and_errors(Run(LEAVES.format(n=18), name="unlike"))
        off = abs(force - right) / force
        self.assertGreater(told["between_nodes"], off / 3)
        self.assertLess(told["between_nodes"], max(0.01, 5 * off))

    def test_a_coarse_stiff_slave(self):
        """What enters its faces between few nodes, and not in the mean, makes next to nothing."""
        _, told = force_and_errors(Run(INPUT / "press.inp", "--refine", "1"))
        self.assertLess(told["geometry"], 0.005)

    def test_a_press_fit(self):
        """Gaps that ADJUST closes and *CONTACT GAP sets are of the bodies: Lame's pressure."""
        run = Run(INPUT / "press.inp")
        with run.result() as result:
            pair = result.pairs[0]
            off = abs(pair.reaction[-1, :, 0].sum() / (6.1523 * pair.area.sum()) - 1)
        _, told = force_and_errors(run)
        self.assertEqual(told["of_facets"], 0)
        self.assertGreater(told["total"], off / 3)
        self.assertLess(told["total"], 5 * off)

    def test_a_round_tool(self):
        """Elements are too stiff, nodes let it in: the difference is told. n = 36: 3.571."""
        with Run(INPUT / "tool.inp", n=6).result() as result:
            end = result.step_ends[0]
            off = abs(abs(result.pairs[0].resultant[end][2]) / 3.571 - 1)
            told = {name: result.history(f"error/{name}")[end] for name in ("mesh", "total")}
        self.assertGreater(told["mesh"], 3 * off)
        self.assertGreater(told["total"], off / 3)
        self.assertLess(told["total"], 3 * off)

    def test_few_nodes_on_a_cylinder(self):
        """Their normals lean: of a mesh of 120 x 6 x 6 the force is (1.266, 0, 2.779)."""
        deck = BEAM.replace("NX=10, NY=1, NZ=1", "NX=20, NY=2, NZ=2").replace("6.1, 0,", "6, 0,")
        run = Run(deck, name="beam")
        _, told = force_and_errors(run)
        with run.result() as result:
            force = result.pairs[0].resultant[-1]
        off = np.linalg.norm(force - (1.266, 0, 2.779)) / np.linalg.norm(force)
        self.assertGreater(off, 0.2)
        self.assertGreater(told["total"], off / 2)
        self.assertLess(told["total"], 2 * off)

    def test_a_promise_over_a_cylinder(self):
        """Meshes whose contact nodes coincide agree by accident: right is 3.06 +- 0.05."""
        run = Run(BEAM, *ASKED, "0.2", name="beam")
        self.assertEqual(run.status, 0, run.errors)
        force, _ = force_and_errors(run)
        self.assertLess(abs(force / 3.06 - 1), 0.2)


if __name__ == "__main__":
    unittest.main()
