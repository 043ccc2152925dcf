"""What a scene does not require is left out, and nothing changes by it."""

import unittest

import numpy as np
from program import INPUT, SOURCE, Run

SQUEEZED = """*HEADING
A flat soft block, squeezed between plates, bulges into a wall
*BLOCK, NAME=BODY, TYPE=C3D8B, NX=10, NY=10, NZ=2
0., 0., 0.,  10., 10., 1.
*MATERIAL, NAME=RUBBER
*ELASTIC
1., 0.49
*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER
*OBSTACLE, NAME=WALL, TYPE=PLANE
{wall}, 0., 0., -1., 0., 0.
*SURFACE INTERACTION, NAME=TOUCH
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=TOUCH
BODY-XMAX, WALL
*CONTACT SOLVER, TOLERANCE=1e-11
*BOUNDARY
BODY-ZMIN, 3, 3
BODY-XMIN, 1, 1
BODY-YMIN, 2, 2
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
BODY-ZMAX, 3, 3, -0.1
*NODE FILE
U
{load}*END STEP
"""

# A force so small that it does nothing, but it makes every slave node a candidate.
NO_FORCE = "*CLOAD\n1, 1, 1e-290\n"


# With the sphere at its last place a node at the distance r from the axis has a gap of at most the
# way of 0.06, so that it can touch, where r^2 <= 20.06^2 - 19.94^2 = 4.8.
PRESSED = """*HEADING
A sphere is pressed into a plate
*NODE
1000, 0., 0., 0.
*BLOCK, NAME=BODY, NX=12, NY=12, NZ=1
-6., -6., 0.,  12., 12., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
1., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=1000
0., 0., -20.,  20.
*SURFACE INTERACTION, NAME=TOUCH
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=TOUCH
BODY-ZMIN, BALL
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
BODY-ZMAX, 1, 3
1000, 1, 2
1000, 3, 3, 0.06
*NODE FILE
U
{load}*END STEP
"""

FREE = """*HEADING
A block between plates, contact nowhere
*BLOCK, NAME=BODY, NX=3, NY=3, NZ=3
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
1., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*STEP
*STATIC, DIRECT
{increment}, 1.
*BOUNDARY
BODY-ZMIN, 1, 3
BODY-ZMAX, 3, 3, -0.001
*NODE FILE
U
*END STEP
"""


# A free block under a rigid one that loads turn, on a face of unlike nodes, with W known by its
# products.
LOOSE = """*HEADING
A loose block under a rigid one that turns
*BLOCK, NAME=A, TYPE=C3D8B, NX=2, NY=2, NZ=1
0., 0., 0.,  1.5, 1., 1.
*BLOCK, NAME=C, TYPE=C3D8, NX=2, NY=1, NZ=1
-0.4, -0.3, -0.492,  2.3, 1.6, 0.5
*BLOCK, NAME=B, TYPE=C3D8B, NX=2, NY=1, NZ=1
0.1, 0.1, 1.,  1.3, 0.8, 0.6
*NODE
9999, 0.75, 0.5, 1.3
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=B, MATERIAL=M
*SOLID SECTION, ELSET=C, MATERIAL=M
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.5
*CONTACT PAIR, INTERACTION=DRY
C-ZMAX, A-ZMIN
*CONTACT PAIR, INTERACTION=DRY
A-ZMAX, B-ZMIN
*RIGID BODY, ELSET=B, REF NODE=9999
*CONTACT GAP
C-ZMAX, 0.006
*CONTACT SOLVER, COMPLIANCE=PRODUCTS
*BOUNDARY
C-ZMIN, 1, 3
9999, 1, 2
*STEP, NLGEOM
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
9999, 3, 3, -0.02
*CLOAD
9999, 4, 0.2
9999, 5, 0.3
9999, 6, 0.5
*END STEP
"""


class Savings(unittest.TestCase):
    """Counters say what was left out; forces, gaps and displacements are the same to 1e-10."""

    def solve(self, *options, load="", wall=0.05, mu=0.2, more=""):
        """Run the squeezed block and return the run."""
        text = SQUEEZED.format(load=load, wall=10 + wall, mu=mu) + more
        run = Run(text, *options, name="squeezed")
        self.assertEqual(run.status, 0, run.errors)
        return run

    def count(self, run, name):
        with run.result() as result:
            return result.counters[name]

    def assert_same(self, one, other):
        with one.result() as a, other.result() as b:
            moves = abs(a.field("displacement", -1)).max()
            for name in ("reaction", "gap"):
                first, second = (getattr(r.pairs[0], name) for r in (a, b))
                scale = moves if name == "gap" else abs(first).max()
                np.testing.assert_allclose(first, second, rtol=0, atol=1e-10 * scale)
            first, second = (r.field("displacement", -1) for r in (a, b))
            np.testing.assert_allclose(first, second, rtol=0, atol=1e-10 * moves)

    def test_what_cannot_be_reached_costs_no_interface(self):
        run = self.solve(wall=0.6)
        self.assertEqual(self.count(run, "interface_equations"), 0)
        full = self.solve(wall=0.6, load=NO_FORCE)
        self.assertGreater(self.count(full, "interface_equations"), 0)
        self.assert_same(run, full)

    def test_a_broken_bound_repeats_the_increment(self):
        run = self.solve(wall=0.15)
        self.assertIn("increment 2: node", run.output)
        self.assertIn("repeated with whole slave surfaces", run.output)
        self.assertEqual(self.count(run, "factorisations"), 2)
        full = self.solve(wall=0.15, load=NO_FORCE)
        self.assertEqual(self.count(full, "factorisations"), 1)
        self.assert_same(run, full)

    def test_without_friction_only_normals_are_condensed_to(self):
        run, rubs = self.solve(mu=0), self.solve(mu=1e-16)
        # The wall has 33 nodes; y is held on 3 of them, z on 11 below and 11 above.
        self.assertEqual(self.count(run, "contact_rows"), 33)
        self.assertEqual(self.count(rubs, "contact_rows"), 3 * 33 - 3 - 22)
        self.assertLess(
            self.count(run, "interface_equations"), self.count(rubs, "interface_equations")
        )
        self.assert_same(run, rubs)

    def test_only_nodes_that_a_sphere_can_reach_are_condensed_to(self):
        run = Run(PRESSED.format(load=""), name="pressed")
        full = Run(PRESSED.format(load="*CLOAD\n1001, 1, 1e-290\n"), name="pressed")
        for one in (run, full):
            self.assertEqual(one.status, 0, one.errors)
        # On the grid of unit elements r^2 is 0 once, and 1, 2 and 4 four times each.
        for one, nodes in ((run, 13), (full, 13 * 13)):
            self.assertEqual(self.count(one, "interface_equations"), 3 * nodes)
            # Rows have those that are near at last: r^2 up to 2.
            self.assertEqual(self.count(one, "contact_points"), 9)
            self.assertEqual(self.count(one, "contact_rows"), 3 * 9)
            self.assertEqual(self.count(one, "plan_revisions"), 0)
        with run.result() as result:
            self.assertGreater(result.pairs[0].normal_sum[-1], 0)
        self.assert_same(run, full)

    def test_only_points_near_a_round_obstacle_have_rows(self):
        """Of a beam on rollers: 15 of 735 points touch, and the forces are those of statics. All
        slide at the limit of friction, and few centres of the search for free motions lead there
        (442 iterations where its leaps took the friction of points that slide for constant)."""
        runs = [Run(INPUT / "bend.inp", n=4, solver=solver) for solver in ("AUTO", "SWEEPS")]
        self.assertLess(self.count(runs[0], "contact_iterations"), 150)
        for run in runs:
            self.assertEqual(run.status, 0, run.errors)
            self.assertLessEqual(self.count(run, "contact_rows"), 3 * 75)
            self.assertNotIn("warning: the plan said", run.output + run.errors)
        with runs[0].result() as one, runs[1].result() as other:
            self.assertEqual(sum(pair.reaction.shape[1] for pair in one.pairs.values()), 735)
            touching = [np.count_nonzero(pair.status[-1]) for pair in one.pairs.values()]
            self.assertEqual(sum(touching), 15)
            for a, b in zip(one.pairs.values(), other.pairs.values(), strict=True):
                np.testing.assert_allclose(a.resultant[-1], b.resultant[-1], rtol=0, atol=1e-9)

    def test_free_bodies_take_few_products_in_estimates(self):
        """Gaps between nodes are answered with W formed where a search for free motions would take
        more products than W has columns (965 solutions by these)."""
        run = Run(LOOSE, name="loose")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, r"geometry [\d.e-]+")
        self.assertLess(self.count(run, "solutions"), 500)

    def test_points_settle_before_the_body_is_solved_for(self):
        """Before a round tool and between two bodies, where points are placed twice an increment
        and more: fewer solutions than placements, and the forces that products alone find."""
        fit = SOURCE / "studies" / "data" / "scenes" / "fit.inp"
        for deck in (INPUT / "tool.inp", fit):
            with self.subTest(deck=deck.name):
                # Of fewer increments a step their error is found by twice as many.
                text = deck.read_text().replace("steps = 5\n", "steps = 8\n")
                self.assertEqual(text.count("*CONTACT SOLVER,"), 1)
                products = text.replace("SOLVER,", "SOLVER, COMPLIANCE=PRODUCTS,", 1)
                run, other = Run(text, name="dense"), Run(products, name="products")
                for one in (run, other):
                    self.assertEqual(one.status, 0, one.errors)
                placements = self.count(run, "newton_raphson_iterations")
                self.assertGreater(placements, 2 * self.count(run, "increments"))
                self.assertLess(self.count(run, "solutions"), placements)
                with run.result() as a, other.result() as b:
                    for mine, its in zip(a.pairs.values(), b.pairs.values(), strict=True):
                        largest = abs(its.reaction).max()
                        np.testing.assert_allclose(
                            mine.reaction, its.reaction, rtol=0, atol=1e-5 * largest
                        )

    def test_without_contact_a_step_costs_one_solution(self):
        for increment in (1, 0.1):
            with self.subTest(increment=increment):
                run = Run(FREE.format(increment=increment), name="free")
                self.assertEqual(run.status, 0, run.errors)
                self.assertEqual(self.count(run, "increments"), round(1 / increment))
                self.assertEqual(self.count(run, "factorisations"), 1)
                self.assertEqual(self.count(run, "solutions"), 1)
                for name in (
                    "interface_equations", "contact_points", "contact_rows",
                    "contact_iterations", "compliance_products", "compliance_bytes",
                ):
                    self.assertEqual(self.count(run, name), 0, name)
                with run.result() as result:
                    self.assertEqual(
                        result.field_names[0] - {"node_id"}, {"displacement", "reaction_force"}
                    )

    def test_congruent_elements_share_a_stiffness(self):
        self.assertEqual(self.count(self.solve(), "element_stiffnesses"), 1)

    def test_a_step_that_changes_nothing_costs_no_iteration(self):
        run = self.solve(more="*STEP\n*STATIC, DIRECT\n0.5, 1.\n*END STEP\n")
        with run.result() as result:
            iterations = result.history("contact_iterations")
        self.assertTrue(np.all(iterations[:4] > 0))
        np.testing.assert_array_equal(iterations[4:], 0)


if __name__ == "__main__":
    unittest.main()
