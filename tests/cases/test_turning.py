"""Obstacles that turn: closed forms; gaps, slips and torques found anew from rotation vectors."""

import math
import unittest

import numpy as np
from program import INPUT, Run

HEAD = """*BLOCK, NAME=B, NX={elements[0]}, NY={elements[1]}, NZ={elements[2]}
{corner},  {size}
*NODE, NSET=HUB
900, {hub}
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE={shape}, REF NODE=900
{numbers}
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I
B-{side}, O
*CONTACT SOLVER, TOLERANCE={tolerance}
"""

STEP = """*STEP
*STATIC{direct}
{increment}, 1., , {increment}
{cards}
*END STEP
"""


def step(cards, increment=1.0, direct=False):
    """Return a step of one unit of time."""
    return STEP.format(cards=cards, increment=increment, direct=", DIRECT" if direct else "")


def floor(mu, point="0., 0., 0.", normal="0., 0., 1.", tolerance=1e-12, bottom=0.2):
    """Return a cube above a plane whose reference node is below it."""
    return HEAD.format(
        elements=(3, 3, 3), corner=f"0., 0., {bottom}", size="1., 1., 1.", hub="0.5, 0.5, -0.3",
        shape="PLANE", numbers=f"{point}, {normal}", mu=mu, side="ZMIN", tolerance=tolerance,
    )  # fmt: skip


def wheel(mu=0.3, kind="CYLINDER", centre=0.0, ny=2):
    """Return a block below a wheel of radius 5 whose hub is above the origin."""
    axis = "0., 1., 0., " if kind == "CYLINDER" else ""
    return HEAD.format(
        elements=(8, ny, 4), corner=f"-2., {-ny / 4}, -2.", size=f"4., {ny / 2}, 2.",
        hub="0., 0., 5.", shape=kind, numbers=f"{centre}, 0., 5., {axis}5.", mu=mu, side="ZMAX",
        tolerance=1e-10,
    )  # fmt: skip


HELD = "*BOUNDARY\nB-ZMIN, 1, 3, 0.\nHUB, 1, 2, 0.\n"
PLANE_STRAIN = HELD + "B, 2, 2, 0.\n"


def rotation(vector):
    """Return the matrix of a rotation vector, by the series of the exponential."""
    x, y, z = vector
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    r = term = np.eye(3)
    for n in range(1, 40):
        term = term @ k / n
        r = r + term
    return r


# Plane strain: two bodies, and a wheel that turns on the upper one.
PLATE_ON_BASE = """*BLOCK, NAME=PLATE, NX=8, NY=1, NZ=2
-2., 0., -1.,  4., 0.5, 1.
*BLOCK, NAME=BASE, NX=7, NY=1, NZ=3
-3., 0., -3.,  6., 0.5, 2.
*NODE, NSET=HUB
900, 0., 0.25, 5.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=PLATE, MATERIAL=M
*SOLID SECTION, ELSET=BASE, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=CYLINDER, REF NODE=900
0., 0., 5.,  0., 1., 0.,  5.
*SURFACE INTERACTION, NAME=SMOOTHER
*FRICTION
0.2
*SURFACE INTERACTION, NAME=ROUGH
*FRICTION
0.6
*CONTACT PAIR, INTERACTION=SMOOTHER
PLATE-ZMAX, O
*CONTACT PAIR, INTERACTION=ROUGH
PLATE-ZMIN, BASE-ZMAX
*CONTACT SOLVER, TOLERANCE=1e-9
*BOUNDARY
BASE-ZMIN, 1, 3, 0.
PLATE, 2, 2, 0.
BASE, 2, 2, 0.
HUB, 1, 2, 0.
HUB, 5, 5, 0.
""" + step("*CLOAD\nHUB, 3, -10.", 0.5) + step("*BOUNDARY\nHUB, 5, 5, 0.3", 0.5)


class Motion:
    """What a result says of its only pair and of the reference node, row by row."""

    def __init__(self, result):
        pair = result.pairs[0]
        self.pair = pair
        tool = result.reference_nodes[900]
        self.hub = tool.coordinates
        none = np.zeros_like(result.points)
        fields = [result.field("displacement", i) for i in range(len(result.field_rows))]
        u = np.array([none, *fields])
        self.way = np.array([np.zeros(3), *tool.displacement])
        self.arm = (result.points + u)[:, pair.nodes] - (self.hub + self.way)[:, None]
        self.vector = np.array([np.zeros(3), *tool.rotation])
        self.moment = tool.reaction_moment
        names = "frame reaction gap slip slip_increment status torque resultant"
        for name in names.split():
            getattr(pair, name)  # it stays when the file is closed

    def slip(self, row):
        """Return the slip of an increment along t1, t2: (P, 2).

        The place of the material that a point is at moves along a chord; the obstacle shows it as
        it stands halfway: by the orthogonal factor of 1 + R, R the turn of the increment.
        """
        old, new = (rotation(vector) for vector in self.vector[row : row + 2])
        chord = self.arm[row + 1] @ new - self.arm[row] @ old
        left, _, right = np.linalg.svd(np.eye(3) + new @ old.T)
        chord = chord @ (left @ right @ old).T
        return np.einsum("pi,pai->pa", chord, self.pair.frame[row][:, 1:])

    def torque(self, row):
        """Return the moment of the contact forces on the obstacle about its reference node."""
        force = np.einsum("pa,pai->pi", self.pair.reaction[row], self.pair.frame[row])
        return -np.cross(self.arm[row + 1], force).sum(axis=0)


class Turning(unittest.TestCase):
    def solved(self, deck, *options, **overrides):
        name = None if hasattr(deck, "parts") else "deck"
        run = Run(deck, *options, name=name, **overrides)
        self.assertEqual(run.status, 0, run.errors)
        return run

    def judged(self, run):
        """Check slips and torques of all increments against what the fields say."""
        with run.result() as result:
            motion = Motion(result)
            rows = len(result.field_rows)
            self.assertGreater(rows, 0)
            self.assertTrue(np.all(result.history("certified") == 1))
            for row in range(rows):
                length = np.abs(motion.arm).max()
                found = motion.pair.slip_increment[row] - motion.slip(row)
                self.assertLess(np.abs(found).max(), 1e-13 * length)
                torque = motion.pair.torque[row]
                size = length * np.abs(motion.pair.reaction[row]).sum() + 1e-30
                self.assertLess(np.abs(motion.torque(row) - torque).max(), 1e-13 * size)
                self.assertLess(np.abs(motion.moment[row] + torque).max(), 1e-13 * size)
        return motion

    def test_a_plane_that_has_turned_is_a_plane_placed_so(self):
        angle = math.radians(10)
        c, s = math.cos(angle), math.sin(angle)
        for axis in (4, 5):
            r = rotation([angle, 0, 0] if axis == 4 else [0, angle, 0])
            hub = np.array([0.5, 0.5, -0.3])
            point = ", ".join(repr(float(v)) for v in hub + r @ (-hub))
            normal = f"0., {-s!r}, {c!r}" if axis == 4 else f"{s!r}, 0., {c!r}"
            press = step("*BOUNDARY\nB-ZMAX, 1, 2, 0.01\nB-ZMAX, 3, 3, -0.3", 0.5)
            for mu in (0.0, 0.4):
                with self.subTest(axis=axis, mu=mu):
                    still = "*BOUNDARY\nB-ZMAX, 1, 3, 0.\nHUB, 1, 3, 0.\n"
                    turned = floor(mu) + step(f"{still}HUB, {axis}, {axis}, {angle!r}") + press
                    placed = floor(mu, point, normal) + step(still) + press
                    runs = self.solved(turned), self.solved(placed)
                    self.judged(runs[0])
                    with runs[0].result() as one, runs[1].result() as other:
                        found, wanted = one.pairs[0], other.pairs[0]
                        largest = np.abs(wanted.reaction).max()
                        self.assertGreater(largest, 1.0)
                        far = np.abs(found.reaction[-1] - wanted.reaction[-1]).max()
                        self.assertLess(far, 1e-10 * largest)
                        np.testing.assert_array_equal(found.status[-1], wanted.status[-1])

    def test_a_wheel_rubs_with_the_torque_of_friction(self):
        # Plane strain: every point slides across the axis.
        turns = step("*BOUNDARY\nHUB, 5, 5, 0.8", 0.1)
        deck = wheel() + PLANE_STRAIN + step("*BOUNDARY\nHUB, 3, 3, -0.05") + turns
        motion = self.judged(self.solved(deck))
        pair = motion.pair
        normal = pair.reaction[-1][:, 0].sum()
        self.assertGreater(normal, 10.0)
        self.assertAlmostEqual(pair.torque[-1][1], -0.3 * normal * 5.0, delta=1e-8 * normal)
        touching = pair.reaction[-1][:, 0] > 0
        self.assertTrue(np.all(pair.status[-1][touching] == 2))
        slid = np.linalg.norm(pair.slip_increment[-1][touching], axis=1)
        np.testing.assert_allclose(slid, 2 * 5.0 * math.sin(0.04), rtol=1e-8)

    def test_a_wheel_drives_a_plate_that_lies_on_another_body(self):
        run = self.solved(PLATE_ON_BASE)
        with run.result() as result:
            on_wheel, on_base = result.pairs.values()
            self.assertTrue(np.all(result.history("certified") == 1))
            normal = on_wheel.reaction[-1][:, 0].sum()
            self.assertAlmostEqual(on_wheel.torque[-1][1], -0.2 * 5.0 * normal, delta=1e-8)
            self.assertAlmostEqual(on_wheel.resultant[-1][2], -10.0, delta=1e-8)
            self.assertLess(on_wheel.resultant[-1][0], -1.9)
            # Nothing else acts on the plate in the plane.
            left = (on_wheel.resultant[-1] + on_base.resultant[-1])[[0, 2]]
            np.testing.assert_allclose(left, 0.0, atol=1e-8)

    def test_the_work_of_the_torque_is_lost_to_friction(self):
        # Steady: work T theta, dissipation along the chords, T 2 sin(theta/2).
        turns = step("*BOUNDARY\nHUB, 5, 5, 0.8", 0.1)
        deck = wheel() + PLANE_STRAIN + step("*BOUNDARY\nHUB, 3, 3, -0.05") + turns
        with self.solved(deck).result() as result:
            torque = abs(result.pairs[0].torque[-1][1])
            work = np.diff(result.history("energy/external_work"))[-1]
            lost = np.diff(result.history("energy/dissipation"))[-1]
        self.assertAlmostEqual(work, torque * 0.08, delta=1e-8 * work)
        self.assertAlmostEqual(lost, torque * 2 * math.sin(0.04), delta=1e-8 * work)

    def test_a_half_turn_in_36_increments(self):
        turns = step(f"*BOUNDARY\nHUB, 5, 5, {math.pi!r}", 1 / 36)
        deck = wheel() + PLANE_STRAIN + step("*BOUNDARY\nHUB, 3, 3, -0.05") + turns
        motion = self.judged(self.solved(deck))
        self.assertEqual(len(motion.pair.torque), 37)
        normal = motion.pair.reaction[-1][:, 0].sum()
        self.assertAlmostEqual(motion.pair.torque[-1][1], -1.5 * normal, delta=1e-8 * normal)
        touching = motion.pair.reaction[-1][:, 0] > 0
        slid = np.abs(motion.pair.slip[-1][touching]).max()
        self.assertAlmostEqual(slid, 5.0 * math.pi, delta=0.002 * 5.0 * math.pi)

    def test_a_sphere_that_spins_rubs_around_its_axis(self):
        turns = step("*BOUNDARY\nHUB, 6, 6, 0.6", 0.25)
        deck = wheel(kind="SPHERE", ny=8) + HELD + step("*BOUNDARY\nHUB, 3, 3, -0.2") + turns
        motion = self.judged(self.solved(deck))
        pair, arm = motion.pair, motion.arm[-1]
        force = np.einsum("pa,pai->pi", pair.reaction[-1], pair.frame[-1])
        friction = np.linalg.norm(pair.reaction[-1][:, 1:], axis=1)
        sliding = pair.status[-1] == 2
        self.assertGreater(sliding.sum(), 15)
        limit = 0.3 * pair.reaction[-1][:, 0]
        np.testing.assert_allclose(friction[sliding], limit[sliding], rtol=1e-8)
        radius = np.hypot(arm[:, 0], arm[:, 1])
        # By symmetry all friction is across the radius, but for what the material gives way.
        self.assertAlmostEqual(-pair.torque[-1][2], (friction * radius).sum(), delta=1e-4)
        self.assertLess(np.abs((force[:, :2]).sum(axis=0)).max(), 1e-8)

    def test_a_sphere_off_its_reference_node_goes_around_it(self):
        turns = step("*BOUNDARY\nHUB, 5, 5, 0.6", 0.125)
        cam = wheel(kind="SPHERE", ny=8, centre=0.5)
        motion = self.judged(self.solved(cam + HELD + step("*BOUNDARY\nHUB, 3, 3, -0.2") + turns))
        for row in range(len(motion.pair.gap)):
            centre = rotation(motion.vector[row + 1]) @ [0.5, 0.0, 0.0]
            gap = np.linalg.norm(motion.arm[row + 1] - centre, axis=1) - 5.0
            np.testing.assert_allclose(motion.pair.gap[row], gap, atol=1e-13)

    def test_an_axis_that_turns_takes_its_cylinder_along(self):
        turns = step("*BOUNDARY\nHUB, 4, 4, 0.02\nHUB, 6, 6, 0.3", 0.125)
        press = step("*BOUNDARY\nHUB, 3, 3, -0.1")
        motion = self.judged(self.solved(wheel(ny=4) + HELD + press + turns))
        for row in range(len(motion.pair.gap)):
            axis = rotation(motion.vector[row + 1]) @ [0.0, 1.0, 0.0]
            arm = motion.arm[row + 1]
            gap = np.linalg.norm(arm - np.outer(arm @ axis, axis), axis=1) - 5.0
            np.testing.assert_allclose(motion.pair.gap[row], gap, atol=1e-13)

    def test_what_sticks_goes_around_with_the_obstacle(self):
        press = step("*BOUNDARY\nB-ZMAX, 1, 3, 0.\nHUB, 1, 2, 0.\nHUB, 3, 3, 0.25")
        turns = step("*BOUNDARY\nHUB, 6, 6, 0.3", 0.5)
        motion = self.judged(self.solved(floor(20.0, tolerance=1e-10) + press + turns))
        stuck = motion.pair.status[-1] == 1
        self.assertTrue(np.all(stuck))
        before = motion.arm[1] @ rotation(motion.vector[-1]).T
        np.testing.assert_allclose(motion.arm[-1], before, atol=1e-8)

    def test_amplitudes_and_steps_add_up_to_the_last_value(self):
        amplitude = "*AMPLITUDE, NAME=A\n0., 0., 0.35, 1., 1., 0.5\n"
        press = step("*BOUNDARY\nHUB, 3, 3, -0.05")
        swings = step("*BOUNDARY, AMPLITUDE=A\nHUB, 5, 5, 0.4", 0.25)
        goes_on = step("*BOUNDARY\nHUB, 5, 5, -0.1", 0.5) + step("", 1.0)
        deck = wheel().replace("*MATERIAL", amplitude + "*MATERIAL", 1) + PLANE_STRAIN
        motion = self.judged(self.solved(deck + press + swings + goes_on))
        # 16 degrees are too many at once.
        quarter = 0.4 / 0.35 * 0.25
        angles = [0, 0, quarter / 2, quarter, 0.4, 0.4 - 0.2 * 15 / 65, 0.4 - 0.2 * 40 / 65, 0.2]
        np.testing.assert_allclose(motion.vector[:, 1], [*angles, 0.05, -0.1, -0.1], atol=1e-12)
        # It turns back in the last but one: friction has turned as well, and stays then.
        torques = motion.pair.torque[:, 1]
        self.assertLess(torques[2], -10.0)
        self.assertGreater(torques[-2], 10.0)
        self.assertAlmostEqual(torques[-1], torques[-2], delta=1e-8 * torques[-2])

    def test_increments_are_cut_to_10_degrees(self):
        press = step("*BOUNDARY\nHUB, 3, 3, -0.05")
        run = self.solved(wheel() + PLANE_STRAIN + press + step("*BOUNDARY\nHUB, 5, 5, 0.8"))
        self.assertIn("turns by up to 45.8 degrees in an increment of the deck", run.output)
        with run.result() as result:
            self.assertEqual(len(result.history("time")), 1 + 8)
        # 10 degrees each are not cut, whatever rounding makes of them.
        ninths = step(f"*BOUNDARY\nHUB, 5, 5, {math.pi / 2!r}", 1 / 9)
        run = self.solved(wheel() + PLANE_STRAIN + press + ninths)
        self.assertNotIn("degrees", run.output)
        with run.result() as result:
            self.assertEqual(len(result.history("time")), 1 + 9)

    def test_direct_keeps_increments_and_says_so(self):
        press = step("*BOUNDARY\nHUB, 3, 3, -0.05")
        turns = step("*BOUNDARY\nHUB, 5, 5, 0.8", 1.0, True)
        run = self.solved(wheel() + PLANE_STRAIN + press + turns)
        self.assertIn("step 2: an obstacle turns by up to 45.8 degrees", run.output)
        self.assertIn("its slip is the chord", run.output)
        self.judged(run)

    def test_points_before_a_cylinder_that_tilts_far_settle(self):
        """They move by a half an iteration left to themselves; without friction no way matters."""
        def result(angle, direct):
            text = HEAD.format(
                elements=(4, 4, 4), corner="0., 0., 0.", size="1., 1., 1.", hub="0.46, 1., 1.76",
                shape="CYLINDER", numbers="0.46, 1., 1.76, 0., 1., 0., 0.76", mu=0.0, side="ZMAX",
                tolerance=1e-8,
            )  # fmt: skip
            text += step("*BOUNDARY\nB-ZMIN, 1, 3\n900, 1, 2\n900, 3, 3, -0.0022")
            run = self.solved(text + step(f"*BOUNDARY\n900, 4, 4, {angle}", direct=direct))
            result = run.result()
            self.addCleanup(result.close)
            return result

        whole, parts = result(0.4, True), result(0.4, False)
        self.assertGreater(parts.finished, whole.finished)
        self.assertLess(whole.counters["newton_raphson_iterations"], 40)
        force = parts.pairs[0].resultant[-1]
        np.testing.assert_allclose(
            whole.pairs[0].resultant[-1], force, atol=1e-5 * np.abs(force).max()
        )

    def test_contact_begins_where_the_plane_has_turned_enough(self):
        # About x through (0.5, -0.3): the edge y = 1 of the cube's lower face, 0.2 up.
        deck = floor(0.2, point="0.5, 0.5, -0.3") + step(
            "*BOUNDARY\nB-ZMAX, 1, 3, 0.\nHUB, 1, 3, 0.\nHUB, 4, 4, 0.9", 0.5
        )
        angle = math.atan2(0.5, 0.5)
        with self.solved(deck).result() as result:
            times = result.history("time")[result.history("extra") == 1]
            self.assertLess(np.abs(times - angle / 0.9).min(), 1e-9)
            touching = result.pairs[0].reaction[:, :, 0].sum(axis=1) > 0
            self.assertFalse(np.any(touching[result.history("time") < angle / 0.9 - 1e-6]))
            self.assertTrue(touching[-1])

    def test_a_wheel_under_force_finds_its_height(self):
        loads = step("*CLOAD\nHUB, 3, -40.") + step("*BOUNDARY\nHUB, 5, 5, 0.4", 0.25)
        motion = self.judged(self.solved(wheel() + PLANE_STRAIN + loads))
        np.testing.assert_allclose(motion.pair.resultant[:, 2], -40.0, rtol=1e-8)
        self.assertLess(motion.pair.torque[-1][1], -0.29 * 40.0 * 5.0)

    def test_a_wheel_that_nothing_holds_back_rolls(self):
        # The hub goes where no friction is left over: about as far as its rim turns.
        held = HELD.replace("HUB, 1, 2, 0.", "HUB, 2, 2, 0.") + "B, 2, 2, 0.\n"
        press = step("*BOUNDARY\nHUB, 1, 1, 0.\nHUB, 3, 3, -0.05")
        again = held.replace("*BOUNDARY", "*BOUNDARY, OP=NEW").strip()
        rolls = step(again + "\nHUB, 3, 3, -0.05\nHUB, 5, 5, 0.1", 0.1)
        motion = self.judged(self.solved(wheel(0.5) + held + press + rolls))
        self.assertLess(np.abs(motion.pair.resultant[:, 0]).max(), 1e-6)
        self.assertAlmostEqual(motion.way[-1][0], 0.1 * 5.0, delta=0.05)

    def test_a_block_slides_off_a_plane_that_turns_past_its_cone(self):
        deck = floor(0.5, tolerance=1e-8, bottom=0.0) + step(
            "*DLOAD\nB, GRAV, 10., 0., 0., -1.\n*BOUNDARY\nHUB, 1, 3, 0."
        )
        run = Run(deck + step(f"*BOUNDARY\nHUB, 4, 4, {math.radians(30)!r}", 1 / 8), name="slope")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("nothing balances the loads along body 1", run.errors)
        with run.result() as result:
            np.testing.assert_allclose(result.pairs[0].resultant[:, 2], 10.0, rtol=1e-8)
            last = math.radians(30) * (result.history("time")[-1] - 1.0)
        self.assertLess(last, math.atan(0.5))
        self.assertGreater(last, math.atan(0.5) - 0.005)

    def test_the_deck_with_a_wheel(self):
        motion = self.judged(self.solved(INPUT / "wheel.inp"))
        normal = motion.pair.reaction[:, :, 0].sum(axis=1)
        torque = motion.pair.torque[-20:, 1]
        np.testing.assert_allclose(torque, -0.3 * 5.0 * normal[-20:], rtol=1e-7)


if __name__ == "__main__":
    unittest.main()
