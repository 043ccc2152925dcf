"""A block whose nodes and elements cards make from others: places and force by hand."""

import unittest

import numpy as np
from program import Run

# 4 x 3 x 2 cells of 0.5: the lower layer by *NGEN and *NFILL, the others by *NCOPY; a row of
# elements by *ELGEN, another layer by *ELCOPY.
MADE = """*NODE
1, 0., 0., 0.
5, 2., 0., 0.
31, 0., 1.5, 0.
35, 2., 1.5, 0.
*NGEN, NSET=FRONT
1, 5
*NGEN, NSET=BACK
35, 31, 1
*NFILL, NSET=FLOOR
FRONT, BACK, 3, 10
*NSET, NSET=ALSO, GENERATE
1, 5
11, 15
*NSET, NSET=ALSO
21, 22, 23, 24, 25, BACK
*NCOPY, CHANGE NUMBER=100, OLD SET=ALSO, NEW SET=UP, SHIFT, MULTIPLE=2
0., 0., 0.5

*ELEMENT, TYPE=C3D8, ELSET=E
1, 1, 2, 12, 11, 101, 102, 112, 111
*ELGEN, ELSET=E
1, 4, 1, 1, 3, 10, 10
*ELCOPY, OLD SET=E, ELEMENT SHIFT=100, SHIFT NODES=100, NEW SET=E2
*ELSET, ELSET=ALL
E, E2
"""
PRESS = """*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*SURFACE, NAME=FOOT
E, S1
*SURFACE INTERACTION, NAME=I
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*CONTACT PAIR, INTERACTION=I
FOOT, G
*STEP
*STATIC
*BOUNDARY
TOP, 1, 2
TOP, 3, 3, -0.01
*END STEP
"""


class Generated(unittest.TestCase):
    def test_a_block(self):
        """Pressed by 0.01 of 1 over 2 x 1.5, with nu = 0: 1000 x 0.01 x 3."""
        run = Run(MADE + PRESS.replace(
            "*STEP", "*NSET, NSET=TOP, GENERATE\n201, 205\n211, 215\n221, 225\n231, 235\n*STEP"
        ), name="made")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            np.testing.assert_allclose(result.pairs[0].resultant[-1], [0, 0, 30], atol=1e-8)
            places = dict(zip(result.node_ids.tolist(), result.points, strict=True))
            self.assertEqual(len(result.element_ids), 24)
            self.assertEqual(max(result.element_ids), 124)
        self.assertEqual(len(places), 60)
        for node, place in places.items():
            layer, row, column = node // 100, node % 100 // 10, node % 10 - 1
            np.testing.assert_allclose(place, np.array([column, row, layer]) / 2, atol=1e-12)


if __name__ == "__main__":
    unittest.main()
