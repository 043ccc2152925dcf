"""Slave nodes that slide off the edge of their master, and onto it, while contact is sought."""

import unittest

from program import Run

# A soft block with a rounded sole, dragged over another with so much friction that it tips, and
# past its edge.
DRAGGED = """*HEADING
a soft block dragged with much friction
*PARAMETER
inc = 0.2
mu = 3.
drag = 2.2
*BLOCK, NAME=BOX, NX=6, NY=4, NZ=2
0., 0., 0.,  5., 3., 2.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BOX, MATERIAL=M
*BLOCK, NAME=TOP, NX=3, NY=3, NZ=2
1., 0.5, 2.,  1.6, 1.7, 1.
*SOLID SECTION, ELSET=TOP, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=I
TOP-ZMIN, BOX-ZMAX
*CONTACT GAP, PARABOLA
TOP-ZMIN, 1.8, 1.35, 2., 6.
*BOUNDARY
BOX-ZMIN, 1, 3
*STEP
*STATIC
<inc>, 1.
*BOUNDARY
TOP-ZMAX, 1, 2, 0.
TOP-ZMAX, 3, 3, -0.1
*END STEP
*STEP
*STATIC
<inc>, 1.
*BOUNDARY
TOP-ZMAX, 1, 1, <drag>
*END STEP
*STEP
*STATIC
<inc>, 1.
*BOUNDARY
TOP-ZMAX, 1, 1, 0.2
TOP-ZMAX, 2, 2, 0.4
TOP-ZMAX, 3, 3, -0.05
*END STEP
"""


class UncoveredNodes(unittest.TestCase):
    """A node beside its master where points were placed last may end inside it."""

    def test_it_is_not_called_prescribed(self):
        """No support moves the sole: smaller increments are tried; what does not settle is told."""
        run = Run(DRAGGED, name="dragged")
        self.assertNotIn("is prescribed to move", run.errors)
        self.assertIn("retrying with half the increment", run.output + run.errors)
        if run.status != 0:
            self.assertEqual(run.status, 2, run.errors)
            self.assertRegex(run.errors, "smaller increments may help|: not certified, ")


if __name__ == "__main__":
    unittest.main()
