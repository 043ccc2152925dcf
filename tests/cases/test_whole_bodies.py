"""Whole bodies: what falls is refused, what rests is solved, what is prescribed is kept."""

import unittest

import numpy as np
from program import Run

CUBE = """*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
"""

STEP = """*STEP
*STATIC, DIRECT
1., 1.
{0}
*END STEP
"""


def wall(axis, side):
    """A frictionless plane that faces the side B-<axis>MAX of the cube."""
    normal = ["0."] * 3
    normal["XYZ".index(axis)] = "-1." if side == "MAX" else "1."
    point = ["0."] * 3
    point["XYZ".index(axis)] = "1." if side == "MAX" else "0."
    return f"""*OBSTACLE, NAME=O, TYPE=PLANE
{", ".join(point + normal)}
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-{axis}{side}, O
"""


class Falling(unittest.TestCase):
    def test_a_body_held_only_sideways_falls(self):
        for held, axis, side in ((1, "X", "MAX"), (2, "Y", "MAX"), (1, "Y", "MIN")):
            with self.subTest(held=held, wall=axis + side):
                support = f"*BOUNDARY\nB-{'XYZ'[held - 1]}MIN, {held}, {held}, 0.\n"
                load = "*DLOAD\nB, GRAV, 1., 0, 0, -1"
                run = Run(CUBE + wall(axis, side) + STEP.format(support + load), name="falls")
                self.assertEqual(run.status, 2, run.output)
                self.assertIn("nothing balances the loads along body 1", run.errors)
                self.assertIn("translation along z", run.errors)

    def test_a_push_beyond_friction_is_refused_where_friction_ends(self):
        # Weight 1, a push that grows to 0.31 where friction holds 0.3: the run goes on to there.
        plane = wall("Z", "MIN").replace("NAME=I\n", "NAME=I\n*FRICTION\n0.3\n")
        weight = "*STEP\n*STATIC\n*DLOAD\nB, GRAV, 1., 0, 0, -1\n*END STEP\n"
        push = "*STEP\n*STATIC\n0.25, 1.\n*DSLOAD\nB-XMIN, P, 0.31\n*END STEP\n"
        run = Run(CUBE + plane + weight + push, name="pushed")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("nothing balances the loads along body 1", run.errors)
        self.assertIn("translation along x", run.errors)
        with run.result() as result:
            force = result.pairs[0].resultant[-1]
        self.assertLess(-force[0], 0.3)
        self.assertAlmostEqual(force[0], -0.3, delta=1e-4)

    def test_loads_that_supports_carry_need_nothing_else(self):
        # Held along x alone; a pressure of 10 along x leaves the cube's other motions alone.
        load = "*BOUNDARY\nB-XMIN, 1, 1, 0.\n*DSLOAD\nB-XMAX, P, 10."
        run = Run(CUBE + STEP.format(load), name="pressed")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            u = result.field("displacement", -1)
            force = result.field("reaction_force", -1).sum(axis=0)
        self.assertAlmostEqual(np.ptp(u[:, 0]), 0.01, delta=1e-12)
        self.assertAlmostEqual(force[0], 10.0, delta=1e-11)

    def test_a_small_load_on_a_heavy_body_is_balanced_by_itself(self):
        # Weight 1e6 along z, a push of 1e-4 along x. Poisson's ratio is 0, so nothing else pushes
        # along x. Forces of 1e6 are rounded by 1e-10, and a hundred of them add up: that excuses a
        # thousandth of the push at most, where 10 tolerances of the weight would be 0.1.
        plane = wall("Z", "MIN").replace("NAME=I\n", "NAME=I\n*FRICTION\n0.3\n")
        load = "*DLOAD\nB, GRAV, 1e6, 0, 0, -1\n*CLOAD\n14, 1, 1e-4"
        cube = CUBE.replace("1000., 0.3", "1e9, 0.")
        run = Run(cube + plane + STEP.format(load), name="push")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            force = result.file["contact/B-ZMIN:O/resultant"][-1]
        self.assertAlmostEqual(force[0], -1e-4, delta=1e-7)


TWO_CUBES = """*BLOCK, NAME=HARD, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=SOFT, NX=2, NY=2, NZ=2
5., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
1e9, 0.3
*MATERIAL, NAME=FOAM
*ELASTIC
1e-2, 0.3
*SOLID SECTION, ELSET=HARD, MATERIAL=STEEL
*SOLID SECTION, ELSET=SOFT, MATERIAL=FOAM
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
HARD-ZMIN, O
*CONTACT PAIR, INTERACTION=I
SOFT-ZMIN, O
*CONTACT SOLVER, SOLVER={0}
"""


class Apart(unittest.TestCase):
    """Bodies that nothing couples do not see how stiff others are."""

    def test_a_soft_body_is_solved_as_closely_as_a_stiff_one(self):
        # 1e11 apart in stiffness. The stiff cube is only pressed; of the soft one, pressed and
        # dragged, a part slides, and its forces are those that it has beside a cube as soft as it.
        motion = "*BOUNDARY\nHARD-ZMAX, 1, 2\nHARD-ZMAX, 3, 3, -0.01\n"
        motion += "SOFT-ZMAX, 1, 1, 0.003\nSOFT-ZMAX, 2, 2, 0.001\nSOFT-ZMAX, 3, 3, -0.01\n"
        for solver in ("AUTO", "SWEEPS"):
            with self.subTest(solver=solver):
                force = []
                for stiffness in ("1e9", "1e-2"):
                    deck = TWO_CUBES.format(solver).replace("1e9, 0.3", stiffness + ", 0.3")
                    run = Run(deck + STEP.format(motion), name="apart")
                    self.assertEqual(run.status, 0, run.errors)
                    with run.result() as result:
                        force.append(result.file["contact/SOFT-ZMIN:O/reaction"][-9:])
                        status = set(result.file["contact/SOFT-ZMIN:O/status"][-9:].flat)
                self.assertEqual(status, {1, 2})
                np.testing.assert_allclose(force[0], force[1], atol=1e-7 * abs(force[1]).max())

    def test_bodies_that_press_on_an_obstacle_together_share_its_force(self):
        # A plane that is free along z lies on two cubes and is pressed down by 3: 1.5 each.
        cubes = (
            TWO_CUBES.format("AUTO")
            .replace("1e-2, 0.3", "1e9, 0.3")
            .replace("TYPE=PLANE\n", "TYPE=PLANE, REF NODE=999\n")
            .replace("0., 0., 0., 0., 0., 1.", "0., 0., 1., 0., 0., -1.")
            .replace("-ZMIN, O", "-ZMAX, O")
        )
        load = "*BOUNDARY\nHARD-ZMIN, 1, 3\nSOFT-ZMIN, 1, 3\n999, 1, 2\n*CLOAD\n999, 3, -3."
        run = Run("*NODE\n999, 3., 0.5, 1.\n" + cubes + STEP.format(load), name="shared")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            for name in ("HARD", "SOFT"):
                force = result.file[f"contact/{name}-ZMAX:O/resultant"][-1]
                self.assertAlmostEqual(force[2], -1.5, delta=1e-7)


class Prescribed(unittest.TestCase):
    def test_a_jump_is_not_lost_by_an_inexact_factor(self):
        motion = "*BOUNDARY, AMPLITUDE=JUMP\nB-ZMAX, 1, 3, 0.1\nB-ZMIN, 1, 3, 0."
        for factor in ("FACTOR=DOUBLE", "FACTOR=SINGLE", "FACTOR=DOUBLE, BLOCK LOW RANK=1e-5"):
            with self.subTest(factor=factor):
                deck = CUBE + f"*PRECISION, {factor}\n*AMPLITUDE, NAME=JUMP\n0., 1., 1., 1.\n"
                run = Run(deck + STEP.format(motion), name="jump")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    u = result.field("displacement", -1)
                # The top goes by 0.1, the bottom stays, to the last bit; the middle goes half way.
                self.assertTrue(np.all(u[18:] == 0.1), u[18:])
                self.assertTrue(np.all(u[:9] == 0.0), u[:9])
                self.assertAlmostEqual(u[13, 0], 0.05, delta=1e-12)

    def test_loads_that_jump_are_not_lost_either(self):
        push = "*BOUNDARY\nB-ZMIN, 1, 3, 0.\n*CLOAD, AMPLITUDE=JUMP\n27, 1, 1.\n"
        found = []
        for factor in ("DOUBLE", "SINGLE"):
            deck = CUBE + f"*PRECISION, FACTOR={factor}\n*AMPLITUDE, NAME=JUMP\n0., 1., 1., 1.\n"
            run = Run(deck + STEP.format(push) * 2, name="push")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found.append([result.field("displacement", row) for row in (0, 1)])
        np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-10 * np.max(found[0]))


class Gaps(unittest.TestCase):
    """What is free goes as far as it takes until something holds it, however weak the load is."""

    def test_a_free_cube_is_pushed_to_a_wall(self):
        # Weight 1 on a frictionless floor, pushed towards a wall that is 1e-3 away.
        wall = """*OBSTACLE, NAME=WALL, TYPE=PLANE
1.001, 0., 0.,  -1., 0., 0.
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-XMAX, WALL
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
"""
        for push in (1e-1, 1e-3, 1e-5):
            with self.subTest(push=push):
                load = f"*DLOAD\nB, GRAV, 1., 0, 0, -1\nB, GRAV, {push}, 1, 0, 0"
                run = Run(CUBE + wall + STEP.format(load), name="wall")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    force = result.file["contact/B-XMAX:WALL/resultant"][-1]
                    u = result.field("displacement", -1)
                self.assertAlmostEqual(-force[0] / push, 1.0, delta=1e-6)
                self.assertAlmostEqual(u[2::3, 0].max(), 1e-3, delta=1e-9)

    def test_a_tool_under_a_weak_force_finds_the_body(self):
        # The ball is 0.5 above the cube; forces of 1e-8 to 1e-2 of E.
        tool = """*NODE
100, 0.5, 0.5, 3.5
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=100
0.5, 0.5, 3.5,  2.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMAX, BALL
*BOUNDARY
B-ZMIN, 1, 3
100, 1, 2
"""
        for force in (10.0, 1e-2, 1e-3, 1e-4, 1e-5):
            with self.subTest(force=force):
                load = f"*CLOAD\n100, 3, -{force}"
                run = Run(CUBE + tool + STEP.format(load), name="ball")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    found = result.file["contact/B-ZMAX:BALL/resultant"][-1]
                    u = result.reference_nodes[100].displacement[-1]
                self.assertAlmostEqual(-found[2] / force, 1.0, delta=1e-6)
                self.assertAlmostEqual(u[2], -0.5, delta=1e-3 * force + 0.025)


STIFF = """*BLOCK, NAME=B, NX=2, NY=2, NZ=4
0., 0., 0.,  1., 1., {length}
*ELSET, ELSET=FOOT, GENERATE
1, 8, 1
*ELSET, ELSET=HEAD, GENERATE
9, 16, 1
*MATERIAL, NAME=HARD
*ELASTIC
{hard}, 0.3
*MATERIAL, NAME=SOFT
*ELASTIC
1., 0.3
*SOLID SECTION, ELSET=FOOT, MATERIAL=SOFT
*SOLID SECTION, ELSET=HEAD, MATERIAL=HARD
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMAX, 1, 2, 1.
B-ZMAX, 3, 3, {down}
*END STEP
"""


class Stiff(unittest.TestCase):
    """A soft foot under a head much stiffer: how far the head moves is rounded, and its forces."""

    def solve(self, hard, down):
        return Run(STIFF.format(length=2.0, hard=hard, down=down), name="stiff")

    def test_what_double_precision_cannot_hold_is_refused(self):
        # The last bits of a motion of 1 are worth 1e12 eps in the head; the foot presses with 1e-4.
        run = self.solve(1e12, -1e-4)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("displacements in double precision cannot balance these forces", run.errors)

    def test_what_it_holds_is_in_balance(self):
        run = self.solve(1e4, -1e-2)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            support = result.field("reaction_force", -1).sum(axis=0)
            contact = result.file["contact/B-ZMIN:O/resultant"][-1]
        np.testing.assert_allclose(support, -contact, rtol=0.0, atol=1e-7 * contact[2])


if __name__ == "__main__":
    unittest.main()
