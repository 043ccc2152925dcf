"""The balance of energy along the path: what no size of increments makes smaller is refused."""

import re
import unittest

import numpy as np
from facets import rigid
from program import Run


def pushed(increment, floor, mu=0.0, way=2.0):
    """Return the deck of a cube pressed down by 0.1 and pushed along `floor`: [(x, z)]."""
    corners = [(x, y, z) for x, z in floor for y in (-1.0, 2.0)]
    facets = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(floor) - 1)]
    return f"""*HEADING
A cube, pressed down on a floor and pushed along it
*BLOCK, NAME=B, NX=1, NY=1, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
{rigid("G", corners, facets, (9000, (0.0, 0.0, 0.0)))}*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
*BOUNDARY
9000, 1, 3
*STEP
*STATIC
1., 1.
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, -0.1
*END STEP
*STEP
*STATIC, DIRECT
{increment}, 1.
*BOUNDARY
B-ZMAX, 2
B-ZMAX, 1, 1, {way}
B-ZMAX, 3, 3, -0.1
*END STEP
"""


class Path(unittest.TestCase):
    def test_a_fall_down_a_step_is_lost_in_any_increment(self):
        # The front of the face goes down while the edge passes below it; what then still rests on
        # the upper floor falls at once. All of the fall h is h (R1 + R2)/2 by the trapezoidal rule,
        # which nothing dissipates.
        for h, increment in ((0.02, 0.1), (0.05, 0.1), (0.05, 0.02)):
            with self.subTest(h=h, increment=increment):
                floor = [(-1.0, 0.0), (1.53, 0.0), (1.53, -h), (4.0, -h)]
                run = Run(pushed(increment, floor), name="step")
                self.assertEqual(run.status, 2, run.output)
                told = re.search(r"gains or loses (\S+) of energy .* energy of (\S+), and (\S+) in",
                                 run.errors)  # fmt: skip
                self.assertIsNotNone(told, run.errors)
                with run.result() as result:
                    before = result.file["contact/B-ZMIN:G/resultant"][0][2]
                    went = result.history("energy/balance")[-1]
                at_once, strain, in_quarters = (float(one) for one in told.groups())
                self.assertAlmostEqual(in_quarters / at_once, 1, delta=0.05)
                self.assertGreater(at_once, 0.1 * strain)
                self.assertLess(went + at_once, h * before * (1 - h / 0.1 / 2))

    def test_the_same_fall_down_a_ramp_is_work(self):
        floor = [(-1.0, 0.0), (1.55, 0.0), (2.55, -0.02), (4.0, -0.02)]
        run = Run(pushed(0.1, floor, way=3.0), name="ramp")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            strain = result.history("energy/strain")
            self.assertLess(strain[-1], 0.7 * strain[0])
            self.assertLess(np.abs(result.history("energy/balance")).max(), 0.1 * strain[-1])

    def test_what_increments_halve_is_no_loss(self):
        # As sliding begins up to half of the friction of an increment is left over, mu N d/2. It is
        # more than a tenth of the strain energy in both runs, and half of the increment halves it.
        left = []
        for increment in (0.2, 0.1):
            run = Run(pushed(increment, [(-1.0, 0.0), (4.0, 0.0)], mu=0.3), name="slide")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                balance = result.history("energy/balance")
                left.append(balance[-1] - balance[0])
                self.assertGreater(-left[-1], 0.1 * result.history("energy/strain")[-1])
        self.assertLess(left[1] / left[0], 0.55)


if __name__ == "__main__":
    unittest.main()
