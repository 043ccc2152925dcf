"""What a deck chooses and what then is not solved: the message names the choice that did it."""

import unittest

from program import Run

# The middle one of three blocks is free: friction alone holds it to the upper one, which drags it
# over the smooth lower one.
DRAGGED = """*HEADING
Stack of three
*PARAMETER
tolerance = 1e-7
inc = 1/3
*BLOCK, NAME=B0, TYPE=C3D8B, NX=1, NY=1, NZ=1
0., 0., 0.,  2., 1.2, 1.
*BLOCK, NAME=B1, TYPE=C3D8I, NX=2, NY=1, NZ=2
0., 0., 1.,  2., 1.2, 1.4
*BLOCK, NAME=B2, TYPE=C3D8, NX=3, NY=1, NZ=1
1.0825706744742243, 0.04777829584999349, 2.4004193300873857,  2., 1.2, 2.
*MATERIAL, NAME=M0
*ELASTIC
1000., 0.3
*MATERIAL, NAME=M1
*ELASTIC
800.5344318456744, 0.
*MATERIAL, NAME=M2
*ELASTIC
842.288829234642, 0.3
*SOLID SECTION, ELSET=B0, MATERIAL=M0
*SOLID SECTION, ELSET=B1, MATERIAL=M1
*SOLID SECTION, ELSET=B2, MATERIAL=M2
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
B1-ZMIN, B0-ZMAX
*SURFACE INTERACTION, NAME=ROUGH
*FRICTION
0.438
*CONTACT PAIR, INTERACTION=ROUGH
B1-ZMAX, B2-ZMIN
*CONTACT SOLVER, TOLERANCE=<tolerance>
*AMPLITUDE, NAME=A0
0., 1.
*STEP
*STATIC
0.5, 1.
*BOUNDARY
B0-ZMIN, 1, 3
B2-ZMAX, 1, 2
*BOUNDARY, AMPLITUDE=A0
B2-ZMAX, 3, 3, -0.0020966504369288124
*END STEP
*STEP
*STATIC, DIRECT
<inc>, 1.
*BOUNDARY
B2-ZMAX, 2, 2, 0.31773017503976225
B2-ZMAX, 3, 3, -0.0007688563861357687
*END STEP
"""


DRAWN = """*HEADING
A block that sticks to the side of another one and is drawn up, then across
*PARAMETER
solver = SWEEPS
local = NEWTON6
*BLOCK, NAME=B0, TYPE=C3D8, NX=3, NY=1, NZ=1
0.0, 0.0, 0.0, 1.0, 1.0, 0.6
*BLOCK, NAME=B1, TYPE=C3D8I, NX=1, NY=1, NZ=1
1.0, 0.09581770889988439, -0.24580546973419787, 0.5, 1.0, 0.6
*MATERIAL, NAME=M0
*ELASTIC
1000.0, 0.3
*MATERIAL, NAME=M1
*ELASTIC
1000.0, 0.25
*SOLID SECTION, ELSET=B0, MATERIAL=M0
*SOLID SECTION, ELSET=B1, MATERIAL=M1
*SURFACE INTERACTION, NAME=I0
*FRICTION
1.861
*CONTACT PAIR, INTERACTION=I0
B1-XMIN, B0-XMAX
*AMPLITUDE, NAME=A0
0.44157677716739835, -0.6846431144431038, 0.4921894710940316, 0.5333616709593048
*CONTACT SOLVER, SOLVER=<solver>, LOCAL=<local>
*STEP
*STATIC, DIRECT
0.5, 0.5
*BOUNDARY
B0-XMIN, 1
*BOUNDARY
B0-XMIN, 2
*BOUNDARY
B0-XMIN, 3
*BOUNDARY
B1-XMAX, 2
*BOUNDARY
B1-XMAX, 3
*BOUNDARY, AMPLITUDE=A0
B1-XMAX, 1, 1, -0.0004273559595433487
*END STEP
*STEP
*STATIC, DIRECT
0.16666666666666666, 0.5
*BOUNDARY
B1-XMAX, 3, 3, 0.08912652856926817
*END STEP
*STEP
*STATIC
0.3333333333333333, 1.0
*BOUNDARY
B1-XMAX, 2, 2, -0.16764000726934217
*END STEP
"""


class Choices(unittest.TestCase):
    """Solvers and increments that the deck names."""

    def test_an_increment_whose_parts_are_solved(self):
        """That nothing balances the loads is not said of what smaller increments balance."""
        run = Run(DRAGGED, name="whole")
        if run.status != 0:
            self.assertIn("leave out DIRECT", run.errors)
            self.assertNotIn("nothing balances", run.errors)
        smaller = Run(DRAGGED, name="parts", inc=0.1)
        self.assertEqual(smaller.status, 0, smaller.errors)

    def test_a_solver_by_which_points_do_not_settle(self):
        """AUTO is named where the deck has another solver, and solves it."""
        run = Run(DRAWN, name="sweeps")
        if run.status != 0:
            self.assertIn("SOLVER=AUTO may help", run.errors)
        auto = Run(DRAWN, name="auto", solver="AUTO", local="AUTO")
        self.assertEqual(auto.status, 0, auto.errors)


if __name__ == "__main__":
    unittest.main()
