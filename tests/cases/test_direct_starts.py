"""Increments that DIRECT keeps whole, solved from where smaller ones lead.

A plane turns far in one increment on a block that much friction holds. The deck follows a random
scene of tests/judge (family `bodies`, seed 300030).
"""

import unittest

import numpy as np
from program import Run

DECK = """*HEADING
A plane that turns on a block
*PARAMETER
mu = 4.21
turn = 0.8664
*BLOCK, NAME=B, TYPE=C3D8B, NX=1, NY=1, NZ=2
0., 0., 0., 1., 0.7, 1.
*NODE
9001, 0.573, 0.062, 2.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.25
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=TOOL, TYPE=PLANE, REF NODE=9001
0., 0., 1.0004,  0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=I
B-ZMAX, TOOL
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMIN, 1, 3
9001, 1, 2
9001, 3, 3, -0.0027
*END STEP
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
9001, 6, 6, <turn>
*END STEP
"""


class KeptWhole(unittest.TestCase):
    def test_a_plane_that_turns_far(self):
        for turn, mu in ((0.8664, 4.21), (-0.8664, 4.21)):
            with self.subTest(turn=turn, mu=mu):
                run = Run(DECK, name="turn", turn=turn, mu=mu)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    # The deck's increments, and no more of them.
                    np.testing.assert_array_equal(result.history("extra"), [0, 0])
                    self.assertTrue(np.all(result.history("certified") == 1))
                    reaction = result.pairs[0].reaction[-1]
                friction = np.hypot(reaction[:, 1], reaction[:, 2])
                self.assertTrue(np.all(friction <= (1 + 1e-7) * mu * reaction[:, 0]))
                self.assertGreater(friction.max(), 0)


if __name__ == "__main__":
    unittest.main()
