"""The default solver, global Newton, against its promises and against the paper's sweeps."""

import unittest

import numpy as np
from program import INPUT, SOURCE, Run

from studies.deck_cards import pair, quarter_ring

BLOCK = INPUT / "block.inp"
GLOBAL = {"solver": "GLOBAL NEWTON", "local": "AUTO"}
AUTO = {"solver": "AUTO", "local": "AUTO"}


# Nodes 2 and 4 overlap the floor and the wall: they have to slide up along the wall, and along the
# floor away from it. A force of the floor then pushes to the wall with mu times its own, one of the
# wall to the floor likewise: together they lift and push off only where mu is below 1.
WEDGE = """\
*HEADING
A corner that has to slide along a floor and a wall at once
*BLOCK, NAME=BLOCK, TYPE=C3D8, NX=1, NY=1, NZ=1
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=BLOCK, MATERIAL=SOFT
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0.01, 0., 0., 1.
*OBSTACLE, NAME=WALL, TYPE=PLANE
0.999, 0., 0., -1., 0., 0.
*SURFACE INTERACTION, NAME=ROUGH
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=ROUGH
BLOCK-ZMIN, FLOOR
*CONTACT PAIR, INTERACTION=ROUGH
BLOCK-XMAX, WALL
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
BLOCK-ZMAX, 1, 1, -0.001
BLOCK-ZMAX, 2, 3, 0.
*END STEP
"""

# The belt is clamped on the plane x = 0 and hangs on y = 0; the drum turns away from the clamp.
BELT = f"""\
*HEADING
A belt around a quarter of a drum
{quarter_ring("BELT", 1, (30.0, 30.5), (2, 80), 5.0).replace("C3D8", "C3D8I")}\
*NODE, NSET=AXLE
100000, 0., 0., 0.
*MATERIAL, NAME=RUBBER
*ELASTIC
400., 0.4
*SOLID SECTION, ELSET=BELT, MATERIAL=RUBBER
*OBSTACLE, NAME=DRUM, TYPE=CYLINDER, REF NODE=100000
0., 0., 0.,  0., 0., 1.,  30.
{pair("BELT-IN, DRUM", 0.3)}\
*CONTACT SOLVER, TOLERANCE=1e-4
*BOUNDARY
BELT-ALL, 3, 3
BELT-X, 1, 2
AXLE, 1, 6
*STEP
*STATIC
0.5, 1.
*CLOAD
BELT-Y, 2, -1.
*END STEP
*STEP
*STATIC
0.25, 1.
*BOUNDARY
AXLE, 6, 6, -0.1
*END STEP
"""


class GlobalNewton(unittest.TestCase):
    def test_nodes_of_two_rough_obstacles_cost_no_more(self):
        """Each increment takes some 45 iterations; what the planes carry is that of sweeps."""
        deck = (SOURCE / "studies" / "data" / "scenes" / "corner.inp").read_text()
        carried = []
        for solver in ("AUTO", "SWEEPS, LOCAL=EXACT"):
            run = Run(deck.replace("SOLVER=AUTO", f"SOLVER={solver}"), name="corner")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                carried.append(np.array([pair.resultant[-1] for pair in result.pairs.values()]))
                if solver == "AUTO":
                    self.assertLess(result.history("contact_iterations").max(), 120)
        np.testing.assert_allclose(carried[0], carried[1], rtol=1e-5)

    def test_iterations_hardly_depend_on_the_mesh(self):
        """At most 4.5 a step and 10 at worst with n = 4, 5.5 and 12 with n = 8."""
        for n, mean, worst in ((4, 4.5, 10), (8, 5.5, 12)):
            with self.subTest(n=n):
                run = Run(BLOCK, n=n, **GLOBAL)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    iterations = result.history("contact_iterations")
                self.assertLessEqual(iterations.mean(), mean)
                self.assertLessEqual(iterations.max(), worst)

    def test_forces_are_those_of_the_sweeps(self):
        for n in (4, 8):
            with self.subTest(n=n):
                with Run(BLOCK, n=n, **AUTO).result() as one, Run(BLOCK, n=n).result() as two:
                    scale = abs(two.pairs[0].reaction).max()
                    difference = abs(one.pairs[0].reaction - two.pairs[0].reaction).max()
                    self.assertLess(difference / scale, 1e-8)

    def test_reactions_are_admissible_to_rounding(self):
        with Run(BLOCK, n=8, tolerance=1e-4, **GLOBAL).result() as result:
            reaction = result.pairs[0].reaction
            tangential = np.hypot(reaction[:, :, 1], reaction[:, :, 2])
            self.assertGreaterEqual(reaction[:, :, 0].min(), 0.0)
            excess = tangential - 0.3 * reaction[:, :, 0]
            self.assertLess(excess.max(), 1e-13 * reaction.max())

    def test_few_products_where_gmres_gets_nowhere(self):
        """A plug between two blocks: corrections are factorised that GMRES takes long for, and the
        products of a Newton iteration are fewer than 30 in the mean."""
        deck = SOURCE / "studies" / "data" / "scenes" / "fit.inp"
        with Run(deck).result() as result:
            products = result.history("compliance_products").sum()
            self.assertLess(products, 30 * result.history("contact_iterations").sum())

    def test_few_products_on_a_slender_belt(self):
        """A small residual of GMRES says little of a correction there: without factorisations the
        increments take some 16000 products, with them 700. The belt pulls by exp(mu pi/2) times
        its load (Euler), but for what its thickness makes of the radius."""
        run = Run(BELT, name="belt")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertLess(result.counters["compliance_products"], 3000)
            pull = result.pairs[0].resultant[-1, 0]
        self.assertAlmostEqual(pull / 6.0 / np.exp(0.15 * np.pi), 1.0, delta=0.5 / 30.0)

    def test_a_local_solver_beside_it_is_refused(self):
        run = Run(BLOCK, solver="GLOBAL NEWTON", local="NEWTON")
        self.assertEqual(run.status, 1)
        self.assertIn("GLOBAL NEWTON", run.errors)


class Automatic(unittest.TestCase):
    def test_nearly_incompressible_blocks_are_certified(self):
        for nu in (0.4999, 0.4999999):
            for n in (4, 8):
                with self.subTest(nu=nu, n=n):
                    run = Run(BLOCK, n=n, nu=nu, tolerance=1e-8, **AUTO)
                    self.assertEqual(run.status, 0, run.errors)

    def test_any_friction_is_certified(self):
        # Above mu = 2.07 Coulomb's problem may have several solutions: any of them will do.
        for mu in (0, 1e-8, 0.3, 1, 2.5, 10, 1e6):
            with self.subTest(mu=mu):
                run = Run(BLOCK, n=4, mu=mu, tolerance=1e-8, **AUTO)
                self.assertEqual(run.status, 0, run.errors)

    def test_a_wedge_holds_itself_from_a_friction_of_one_on(self):
        for mu in (0, 0.9, 0.99):
            with self.subTest(mu=mu):
                run = Run(WEDGE.format(mu=mu), name="wedge")
                self.assertEqual(run.status, 0, run.errors)
        for mu in (1.01, 1.5):
            with self.subTest(mu=mu):
                run = Run(WEDGE.format(mu=mu), name="wedge")
                self.assertEqual(run.status, 2, run.errors)
                self.assertRegex(run.errors, "node [24] is wedged: ")

    def test_the_file_says_what_was_used(self):
        run = Run(BLOCK, "--verbose", n=4, **AUTO)
        with run.result() as result:
            self.assertTrue(np.all(result.history("solver") == 2))
            self.assertTrue(np.all(result.history("solver_stages") == 1))
        self.assertIn("global Newton", run.output)


class SharedNodes(unittest.TestCase):
    def test_a_floor_and_a_wall_share_by_what_was_before(self):
        """The share of the wall, which Coulomb's law leaves open at the edge, depends neither on
        the solver nor on the increments."""
        deck = (SOURCE / "studies" / "data" / "scenes" / "wall.inp").read_text()
        shares = []
        for solver, steps in (("AUTO", 40), ("SWEEPS", 40), ("AUTO", 160), ("AUTO", 640)):
            changed = deck.replace("SOLVER=AUTO", f"SOLVER={solver}")
            run = Run(changed, name="wall", n=6, mu=0.221, steps=steps)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                wall = next(pair for pair in result.pairs.values() if pair.name.endswith("WALL"))
                shares.append(wall.reaction[-1, :, 0].sum())
        self.assertLess(abs(shares[1] / shares[0] - 1), 1e-4)
        self.assertLess(abs(shares[2] / shares[3] - 1), 2e-3)
        self.assertLess(abs(shares[0] / shares[3] - 1), 1e-2)

    def test_a_wall_with_a_reference_node_shares_as_one_at_rest(self):
        deck = (SOURCE / "studies" / "data" / "scenes" / "wall.inp").read_text()
        held = deck.replace("NAME=WALL, TYPE=PLANE", "NAME=WALL, TYPE=PLANE, REF NODE=9000")
        held = held.replace("*BLOCK,", "*NODE\n9000, 2., 0., 0.\n*BLOCK,", 1)
        held = held.replace("*BOUNDARY\n", "*BOUNDARY\n9000, 1, 3\n")
        shares = []
        for text in (deck, held):
            run = Run(text, name="wall", n=6, mu=0.221, steps=40)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                wall = next(pair for pair in result.pairs.values() if pair.name.endswith("WALL"))
                shares.append(wall.resultant[-1])
        np.testing.assert_allclose(shares[1], shares[0], rtol=1e-6, atol=1e-6)


class Sweeps(unittest.TestCase):
    def test_newton_sweeps_stall_at_no_mu(self):
        for mu in (0, 0.01, 1):
            with self.subTest(mu=mu):
                run = Run(BLOCK, n=2, mu=mu, tolerance=1e-8)
                self.assertEqual(run.status, 0, run.errors)


if __name__ == "__main__":
    unittest.main()
