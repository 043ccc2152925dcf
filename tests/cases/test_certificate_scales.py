"""What the certificate measures by, what it says of energy, refusals that say what was tried."""

import re
import unittest

import numpy as np
from program import INPUT, Run

CUBE = """*HEADING
A bar of one element between a plane and its prescribed end
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., {length}
6, 1., 0., {length}
7, 1., 1., {length}
8, 0., 1., {length}
*ELEMENT, TYPE=C3D8, ELSET=B
1, 1, 2, 3, 4, 5, 6, 7, 8
*SURFACE, NAME=FOOT
B, S1
*NSET, NSET=X
1, 4, 5, 8
*NSET, NSET=Y
1, 2, 5, 6
*NSET, NSET=HEAD
5, 6, 7, 8
*MATERIAL, NAME=A
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=A
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
FOOT, G
*STEP
*STATIC
0.5, 1.
*BOUNDARY
X, 1
Y, 2
HEAD, 3, 3, -1.
*END STEP
"""

STIFF = """*HEADING
A soft block pressed down by a block 1e8 times stiffer
*BLOCK, NAME=L, NX=3, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=U, NX=2, NY=3, NZ=1
0., 0., 1.,  1., 1., 0.5
*MATERIAL, NAME=A
*ELASTIC
1000., 0.3
*MATERIAL, NAME=B
*ELASTIC
{young}, 0.3
*SOLID SECTION, ELSET=L, MATERIAL=A
*SOLID SECTION, ELSET=U, MATERIAL=B
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
L-ZMAX, U-ZMIN
*BOUNDARY
L-ZMIN, 3
L-XMIN, 1
L-YMIN, 2
U-XMIN, 1
U-YMIN, 2
*STEP
*STATIC
0.5, 1.
*BOUNDARY
U-ZMAX, 3, 3, -0.01
*END STEP
"""

CLAMPED = """*HEADING
Two blocks, one on the other, clamped at the same side: nodes of the clamped edge are held in both
*BLOCK, NAME=LOW, NX={n}, NY=2, NZ=2
0., 0., 0.,  4., 1., 1.
*BLOCK, NAME=UP, NX={n}, NY=2, NZ=2
0., 0., 1.,  4., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I{sliding}
UP-ZMIN, LOW-ZMAX
*BOUNDARY
LOW-ZMIN, 3, 3
LOW-XMIN, 1, 3
UP-XMIN, 1, 3
*STEP
*STATIC, DIRECT
0.5, 1.
*DSLOAD
UP-ZMAX, P, 1.
*END STEP
"""

OVERLAP = """*HEADING
A block that overlaps a plane by 0.01 is pushed out of it
*BLOCK, NAME=B, NX=1, NY=1, NZ=2
0., 0., -0.01,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
*BOUNDARY
B-XMIN, 1
B-YMIN, 2
B-ZMAX, 3
*STEP
*STATIC
1., 1.
*END STEP
"""

SLIDING = """*HEADING
A cube is pulled along a plane that its weight does not hold it on
*BLOCK, NAME=B, NX=1, NY=1, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
*STEP
*STATIC
0.5, 1.
*DSLOAD
B-ZMAX, P, 1.
*CLOAD
B-XMAX, 1, {pull}
*END STEP
"""


class Precision(unittest.TestCase):
    """States that double precision holds exactly are certified."""

    def test_a_needle_is_in_balance(self):
        # nu = 0: N = E A d/L; four elements of the cross section's size take the same way.
        for length in (4.0, 1e3, 1e5, 1e6):
            with self.subTest(length=length):
                run = Run(CUBE.format(length=length), name="needle")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    force = result.file["contact/FOOT:G/resultant"][-1]
                np.testing.assert_allclose(force, [0, 0, 1000 / length], rtol=1e-7, atol=1e-10)

    def test_a_block_moves_a_much_softer_one(self):
        # N = A d/(H1/E1 + H2/E2) as all sides but the supported ones are free.
        for young in (1e7, 1e9, 1e11):
            with self.subTest(young=young):
                run = Run(STIFF.format(young=young), name="stiff")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    force = result.file["contact/L-ZMAX:U-ZMIN/resultant"][-1]
                self.assertAlmostEqual(-force[2] * (1 / 1000 + 0.5 / young) / 0.01, 1, delta=1e-7)


class Reactions(unittest.TestCase):
    """Reactions that nothing determines are not certified."""

    def test_clamps_hide_nothing(self):
        # Statics: contact carries no more than the load of 4. Where rows of the clamped nodes are
        # solved for, their reactions are anything; then the run is refused.
        for n, mu, sliding in ((4, 0, ""), (4, 0.3, ", SMALL SLIDING"), (5, 0, ", SMALL SLIDING")):
            with self.subTest(n=n, mu=mu, sliding=sliding):
                run = Run(CLAMPED.format(n=n, mu=mu, sliding=sliding), name="clamped")
                self.assertIn(run.status, (0, 2), run.errors)
                if run.status == 2:
                    continue
                with run.result() as result:
                    force = result.file["contact/UP-ZMIN:LOW-ZMAX/resultant"][-1]
                self.assertLess(abs(force[2]), 4.0)


class Energy(unittest.TestCase):
    """Strain energy, work and dissipation add up."""

    def test_strains_have_half_the_work(self):
        for deck, options in (("block", {"n": 2, "steps": 5}), ("pipe", {}), ("tool", {"n": 4})):
            with self.subTest(deck=deck):
                run = Run(INPUT / f"{deck}.inp", **options)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    self.assertLess(result.history("certificate/energy").max(), 1e-9)

    def test_removing_an_overlap_is_work(self):
        # E A (0.01)^2/(2 L): all of it comes from the overlap.
        run = Run(OVERLAP, name="overlap")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            strain = result.history("energy/strain")[-1]
            work = result.history("energy/external_work")[-1]
        self.assertAlmostEqual(strain, 0.05, delta=1e-9)
        self.assertAlmostEqual(work, 0.05, delta=1e-9)

    def test_larger_increments_of_sliding_are_no_loss(self):
        # A rigid slide in one increment: half of the friction is lost by the trapezoidal rule, and
        # is beside strains that are next to none; with more increments it is less.
        run = Run(INPUT / "slope.inp", n=2)
        self.assertEqual(run.status, 0, run.errors)


class Refusals(unittest.TestCase):
    """Refusals come at once, and say what was tried."""

    def test_proportional_loads_are_refused_at_once(self):
        run = Run(SLIDING.format(pull=0.31 / 4), name="sliding")
        self.assertEqual(run.status, 2, run.errors)
        self.assertIn("nothing balances the loads along body 1", run.errors)
        self.assertNotIn("retrying with half the increment", run.output + run.errors)
        run = Run(SLIDING.format(pull=0.29 / 4), name="sliding")
        self.assertEqual(run.status, 0, run.errors)

    def test_a_tolerance_that_is_named_was_tried(self):
        run = Run(STIFF.format(young=1e13).replace("-0.01", "-1."), name="stiff")
        self.assertEqual(run.status, 2, run.output)
        self.assertNotIn("would be met", run.errors)
        found = re.search(r"with a tolerance of (\S+) this increment is solved", run.errors)
        if found is None:
            return
        solver = f"*CONTACT SOLVER, TOLERANCE={found.group(1)}\n*STEP\n"
        deck = STIFF.format(young=1e13).replace("-0.01", "-1.").replace("*STEP\n", solver)
        run = Run(deck, name="stiff")
        self.assertNotIn("step 1, increment 1: not certified", run.errors)


class Slopes(unittest.TestCase):
    """A block whose friction holds it by a margin of 1e-6, and one that it does not hold."""

    def test_friction_that_holds_is_found_with_many_points(self):
        # 361 points, which the search for the free motions alone does not balance.
        run = Run(INPUT / "slope.inp", n=18)
        self.assertEqual(run.status, 0, run.errors)
        run = Run(INPUT / "slope.inp", n=8, margin=1e-6)
        self.assertEqual(run.status, 2, run.errors)
        self.assertIn("nothing balances the loads", run.errors)


if __name__ == "__main__":
    unittest.main()
