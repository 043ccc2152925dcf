"""Equations between displacements, and couplings: what must hold whatever the numbers are."""

import unittest

import h5py
import numpy as np
from program import ASKED, Run
from test_ties import GROUND, PUSH, at_end, gravity, heavy, tie
from two_bodies import solved

from studies.deck_cards import block, deck, pair, step

SIDES = "".join(f"*EQUATION\n2\nUP-ZMIN, {i}, 1., LOW-ZMAX, {i}, -1.\n" for i in (1, 2, 3))
STRESS = "*EL FILE, POSITION=INTEGRATION POINTS\nS\n"


def node(number, *place):
    """Return the card of a node."""
    return f"*NODE\n{number}, " + ", ".join(map(repr, place)) + "\n"


def equations(*lines):
    """Return the cards of equations, each given by its terms."""
    cards = [f"{len(line.split(',')) // 3}\n{line}\n" for line in lines]
    return "*EQUATION\n" + "".join(cards)


def loaded(lines, increments=1, more=""):
    """Return a *STEP with concentrated forces."""
    return f"*STEP\n*STATIC, DIRECT\n{1 / increments!r}, 1.\n*CLOAD\n{lines}\n{more}*END STEP\n"


def of_node(result, number, field):
    """Return what a reference node has at the end, by its number in the deck."""
    return getattr(result.reference_nodes[number], field)[-1]


class Periodic(unittest.TestCase):
    """Opposite sides move alike but for what a single node says."""

    def strip(self, *cards):
        """A strip without supports, and node 900 whose displacement is its elongation."""
        text = deck(
            node(900, 5.0, 5.0, 5.0),
            block("A", (4, 2, 3), (0, 0, 0), (2, 1, 1)),
            equations(
                "A-XMAX, 1, 1., A-XMIN, 1, -1., 900, 1, -1.",
                "A-XMAX, 2, 1., A-XMIN, 2, -1.",
                "A-XMAX, 3, 1., A-XMIN, 3, -1.",
            ),
            *cards,
            tolerance=1e-12,
        )
        return solved(self, text.replace("*END STEP", STRESS + "*END STEP"))

    def stress_error(self, result, wanted):
        stress = result.file["gauss/C3D8/stress"][:].reshape(-1, 6)
        return np.abs(stress - [wanted, 0, 0, 0, 0, 0]).max() / abs(wanted)

    def test_a_prescribed_elongation_is_a_uniform_stress(self):
        result = self.strip(step("900, 1, 1, 0.02"))
        self.assertLess(self.stress_error(result, 10), 1e-12)
        self.assertAlmostEqual(of_node(result, 900, "reaction_force")[0], 10, delta=1e-10)
        # It is held by nothing. Its sides move alike, so that it turns about its axis alone.
        plan = result.run_text("plan")
        self.assertRegex(plan, r"free motions +at most +4 of body 1 \(of node 901\)")
        self.assertIn("translation along z, rotation about x", result.output)

    def test_a_force_on_the_node_is_carried(self):
        result = self.strip(loaded("900, 1, 5."))
        self.assertLess(self.stress_error(result, 5), 1e-12)
        self.assertAlmostEqual(of_node(result, 900, "displacement")[0], 0.01, delta=1e-13)

    def test_sets_go_together_by_the_numbers_of_their_nodes(self):
        """In whatever order the deck defines them: four posts, each lifted at one end."""
        places = [(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
        lifts = {301: 0.01, 302: -0.02, 303: 0.03, 304: 0.015}
        found = []
        for order in (range(8), (6, 3, 4, 1, 7, 0, 5, 2)):
            nodes = "".join(f"{11 + i}, " + ", ".join(map(repr, places[i])) + "\n" for i in order)
            leaders = sorted(lifts) if order == range(8) else (302, 304, 301, 303)
            nodes += "".join(f"{number}, 0., 0., 9.\n" for number in leaders)
            text = deck(
                f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=A\n1, 11, 12, 14, 13, 15, 16, 18, 17\n",
                "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=A, MATERIAL=M\n",
                "*NSET, NSET=TOP\n18, 15, 17, 16\n*NSET, NSET=LEADERS\n304, 302, 303, 301\n",
                equations("TOP, 3, 1., LEADERS, 3, -2."),
                step("\n".join(f"{n}, 3, 3, {v!r}" for n, v in lifts.items())),
                held="11, 1, 3\n12, 1, 3\n13, 1, 3\n14, 1, 3",
            )
            result = solved(self, text)
            top = [result.node(15 + k) for k in range(4)]
            found.append(result.field("displacement", -1)[top, 2])
        np.testing.assert_allclose(found, 2 * [[2 * lifts[n] for n in sorted(lifts)]], rtol=1e-13)

    def test_shear(self):
        """Sides that are held apart along another axis: simple shear."""
        text = deck(
            node(900, 5.0, 5.0, 5.0),
            block("A", (4, 2, 3), (0, 0, 0), (2, 1, 1)),
            equations(
                "A-XMAX, 2, 1., A-XMIN, 2, -1.",
                "A-XMAX, 3, 1., A-XMIN, 3, -1., 900, 3, -1.",
            ),
            step("900, 3, 3, 0.02", 1),
            held="A-ZMIN, 1\nA-ZMAX, 1\nA-XMIN, 1\nA-XMAX, 1",
            tolerance=1e-12,
        )
        result = solved(self, text.replace("*END STEP", STRESS + "*END STEP"))
        stress = result.file["gauss/C3D8/stress"][:].reshape(-1, 6)
        shear = 0.01 * 1000 / 2.6
        self.assertLess(np.abs(stress - [0, 0, 0, 0, 0, shear]).max(), 1e-12 * shear)


class AgainstTies(unittest.TestCase):
    """On matching nodes a tie is an equation for each degree of freedom."""

    def blocks(self, joint, *cards, **more):
        text = deck(
            heavy(block("LOW", 2, (0, 0, -1), (1, 1, 1))),
            heavy(block("UP", 2, (0, 0, 0), (1, 1, 1), young=3000.0)),
            GROUND,
            joint,
            pair("LOW-ZMIN, GROUND", 0.3),
            *cards,
            tolerance=1e-12,
            **more,
        )
        return solved(self, text)

    def alike(self, one, other, fields=("displacement", "contact_force", "reaction_force")):
        for field in fields:
            a, b = at_end(one, field), at_end(other, field)
            self.assertLess(np.abs(a - b).max(), 1e-12 * max(1e-9, np.abs(a).max()), field)

    def test_pushed(self):
        cards = [step(PUSH.format("UP"), 2)]
        one = self.blocks(tie("UP-ZMIN, LOW-ZMAX"), *cards)
        other = self.blocks(SIDES, *cards)
        self.alike(one, other)
        self.assertRegex(other.run_text("plan"), r"bodies +fixed +1, held by its supports")

    def test_free_bodies(self):
        """Blocks that friction alone holds under their weight and a push."""
        cards = [gravity("LOW", "UP").replace("*END", "*CLOAD\nUP-ZMAX, 1, 0.1\n*END")]
        one = self.blocks(tie("UP-ZMIN, LOW-ZMAX"), *cards)
        other = self.blocks(SIDES, *cards)
        for result in (one, other):
            force = at_end(result, "contact_force").sum(axis=0)
            np.testing.assert_allclose(force, [-0.9, 0, 20], atol=1e-8)
        u, v = at_end(one, "displacement"), at_end(other, "displacement")
        # Which node stands for a free motion is another: that is rounding of the way.
        self.assertLess(np.abs(u - v).max(), 1e-9 * np.abs(u).max())
        self.assertRegex(other.run_text("plan"), r"free motions +at most +6 of body 1 ")

    def test_chains_and_the_order_of_terms(self):
        """A middle node between the two sides, and the other side as the dependent one."""
        cards = [step(PUSH.format("UP"), 2)]
        one = self.blocks(SIDES, *cards)
        turned = self.blocks(
            equations(*(f"LOW-ZMAX, {i}, -2., UP-ZMIN, {i}, 2." for i in (1, 2, 3))), *cards
        )
        self.alike(one, turned)
        middle = "".join(node(900 + i, 0.0, 0.0, 0.0) for i in range(9))
        chained = self.blocks(
            middle
            + "*NSET, NSET=MIDDLE, GENERATE\n900, 908\n"
            + equations(
                *(f"UP-ZMIN, {i}, 1., MIDDLE, {i}, 3." for i in (1, 2, 3)),
                *(f"MIDDLE, {i}, 3., LOW-ZMAX, {i}, 1." for i in (1, 2, 3)),
            ),
            *cards,
        )
        u = at_end(one, "displacement")
        v = at_end(chained, "displacement")
        self.assertLess(np.abs(u - v).max(), 1e-12 * np.abs(u).max())
        # The middle nodes go along, each with a node of either side.
        self.assertEqual(chained.reference_nodes.node_ids.tolist(), list(range(900, 909)))
        for side in (v[18:27], v[27:36]):
            far = np.abs(chained.reference_nodes.displacement[-1] * -3 - side).max()
            self.assertLess(far, 1e-12 * np.abs(u).max())


class Joints(unittest.TestCase):
    """Equations that leave bodies some of their motions."""

    def blocks(self, *cards, held="LOW-ZMIN, 1, 3"):
        return deck(
            block("LOW", 2, (0, 0, -1), (1, 1, 1)),
            block("UP", 2, (0, 0, 0), (1, 1, 1)),
            equations("UP-ZMIN, 3, 1., LOW-ZMAX, 3, -1."),
            *cards,
            held=held,
        )

    def test_a_smooth_joint_carries_pressure_alone(self):
        run = Run(self.blocks(loaded("UP-ZMAX, 3, -1.")), name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.plan, r"free motions +at most +3 of body 1 ")
        self.assertIn("translation along x, translation along y, rotation about z", run.output)
        result = run.result()
        self.addCleanup(result.close)
        np.testing.assert_allclose(
            at_end(result, "reaction_force").sum(axis=0), [0, 0, 9], atol=1e-10
        )

    def test_what_it_does_not_carry_is_refused(self):
        run = Run(self.blocks(loaded("UP-ZMAX, 1, 1.")), name="deck")
        self.assertEqual(run.status, 2)
        self.assertIn("nothing balances the loads along piece of node", run.errors)
        self.assertIn("translation along x", run.errors)

    def test_contact_holds_the_rest(self):
        """Pushed against a wall, without friction."""
        wall = "*OBSTACLE, NAME=WALL, TYPE=PLANE\n1.01, 0., 0.,  -1., 0., 0.\n"
        push = loaded("UP-ZMAX, 1, 1.\nUP-ZMAX, 3, -1.")
        result = solved(self, self.blocks(wall, pair("UP-XMAX, WALL"), push))
        force = at_end(result, "contact_force").sum(axis=0)
        np.testing.assert_allclose(force, [-9, 0, 0], atol=1e-7)
        np.testing.assert_allclose(
            at_end(result, "reaction_force").sum(axis=0), [0, 0, 9], atol=1e-7
        )


class Levers(unittest.TestCase):
    """Coefficients are ratios of displacements, and of forces the other way round."""

    def test_a_lever(self):
        text = deck(
            node(900, 5.0, 5.0, 5.0),
            block("A", 2, (0, 0, 0), (1, 1, 1), nu=0.0),
            equations("A-ZMAX, 3, 2., 900, 1, -1."),
            step("900, 1, 1, -0.02"),
            held="A-ZMIN, 1, 3",
            tolerance=1e-12,
        )
        result = solved(self, text)
        force = at_end(result, "reaction_force")
        # The block takes half of the way and twice the force.
        self.assertAlmostEqual(of_node(result, 900, "reaction_force")[0], -5, delta=1e-10)
        x = result.file["VTKHDF/Points"][:]
        below = np.abs(x[:, 2]) < 1e-9
        np.testing.assert_allclose(force[below].sum(axis=0), [0, 0, 10], atol=1e-10)

    def test_a_balance_beam(self):
        """Two free blocks on the ground, one pressed by the other's weight through a lever."""
        text = deck(
            heavy(block("A", 2, (0, 0, -1), (1, 1, 1))),
            heavy(block("B", 2, (3, 0, -1), (1, 1, 1))),
            GROUND,
            pair("A-ZMIN, GROUND", 0.3),
            pair("B-ZMIN, GROUND", 0.3, number=2),
            equations("A-ZMAX, 3, 1., B-ZMAX, 3, 3."),
            gravity("A", "B"),
        )
        result = solved(self, text)
        force = at_end(result, "contact_force")
        x = result.file["VTKHDF/Points"][:]
        on_a, on_b = force[x[:, 0] < 2].sum(axis=0)[2], force[x[:, 0] > 2].sum(axis=0)[2]
        # 10 of each; what the lever takes from one the other feels a third of, or three times.
        self.assertAlmostEqual((on_b - 10) / (on_a - 10), 3, delta=1e-6)


    def test_coefficients_that_are_far_apart(self):
        """A ratio of 1e11: carried where one side is prescribed, refused where both are free."""
        cards = [
            node(900, 5.0, 5.0, 5.0),
            block("A", 2, (0, 0, 0), (1, 1, 1), nu=0.0),
            equations("A-ZMAX, 3, 1., 900, 1, -1e11"),
        ]
        result = solved(
            self, deck(*cards, step("900, 1, 1, -1e-13"), held="A-ZMIN, 1, 3", tolerance=1e-12)
        )
        self.assertAlmostEqual(of_node(result, 900, "reaction_force")[0] / -1e12, 1, delta=1e-9)
        # Nodes that hang on a corner, 902, one going 1e16 times as far: what could hold them does
        # not move as far as rounding lets see.
        loose = deck(
            node(900, 5.0, 5.0, 5.0),
            node(901, 5.0, 5.0, 5.0),
            block("A", 2, (0, 0, 0), (1, 1, 1)),
            equations("900, 1, 1., 901, 1, -1e16, 902, 3, -1."),
            loaded("A-ZMAX, 3, 1."),
            held="A-ZMIN, 3",
        )
        run = Run(loose, name="deck")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("too far apart", run.errors)
        run = Run(loose.replace("1e16", "1e5"), name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, "left as they are: .*piece of node 900")


class RigidLids(unittest.TestCase):
    """Contact points and faces whose nodes depend on others."""

    def test_a_lid_under_a_force_is_one_that_is_prescribed(self):
        cards = [
            block("A", 3, (0, 0, -1), (1, 1, 1)),
            GROUND,
            pair("A-ZMIN, GROUND", 0.3),
        ]
        joined = deck(
            node(900, 5.0, 5.0, 5.0),
            *cards,
            equations("A-ZMAX, 3, 1., 900, 3, -1."),
            loaded("900, 3, -30.", 2),
            held="A-ZMAX, 1, 2",
            tolerance=1e-12,
        )
        one = solved(self, joined)
        way = of_node(one, 900, "displacement")[2]
        other = solved(
            self,
            deck(
                *cards,
                step(f"A-ZMAX, 3, 3, {float(way)!r}", 2),
                held="A-ZMAX, 1, 2",
                tolerance=1e-12,
            ),
        )
        a, b = at_end(one, "contact_force"), at_end(other, "contact_force")
        self.assertLess(np.abs(a - b).max(), 1e-9 * np.abs(b).max())
        self.assertAlmostEqual(a.sum(axis=0)[2], 30, delta=1e-8)

    def test_a_foot_that_cannot_spread(self):
        """Points of contact that move along the ground together, before other bodies too."""
        for ground in (True, False):
            base = [GROUND] if ground else [block("BASE", 3, (-0.5, -0.5, -2), (2, 2, 1))]
            below = "GROUND" if ground else "BASE-ZMAX"
            text = deck(
                node(900, 5.0, 5.0, 5.0),
                heavy(block("A", 2, (0, 0, -1), (1, 1, 1))),
                *base,
                pair(f"A-ZMIN, {below}", 0.5),
                equations("A-ZMIN, 1, 1., 900, 1, -1.", "A-ZMIN, 2, 1., 900, 2, -1."),
                gravity("A").replace("*END", "*CLOAD\n900, 1, 3.\n*END"),
                held="" if ground else "BASE-ZMIN, 1, 3",
            )
            for solver in ("GLOBAL NEWTON", "SWEEPS"):
                with self.subTest(ground=ground, solver=solver):
                    result = solved(
                        self,
                        text.replace("*CONTACT SOLVER", f"*CONTACT SOLVER, SOLVER={solver}"),
                    )
                    force = at_end(result, "contact_force")
                    x = result.file["VTKHDF/Points"][:]
                    foot = force[(np.abs(x[:, 2] + 1) < 1e-9) & (x[:, 0] < 2)]
                    if ground:
                        np.testing.assert_allclose(foot.sum(axis=0), [-3, 0, 10], atol=1e-6)
                    moved = at_end(result, "displacement")[1:28]
                    low = np.abs(x[1:28, 2] + 1) < 1e-9
                    self.assertLess(np.ptp(moved[low][:, :2], axis=0).max(), 1e-15)


class Couplings(unittest.TestCase):
    """Faces that go with a reference node, or that it is the mean of."""

    def coupled(self, kind, *cards, place=(0.5, 0.5, 1.0), n=(2, 2, 3), held="A-ZMIN, 1, 3"):
        text = deck(
            node(900, *place),
            block("A", n, (0, 0, 0), (1, 1, 1)),
            f"*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=900, SURFACE=A-ZMAX\n{kind}\n",
            *cards,
            held=held,
            tolerance=1e-12,
        )
        return solved(self, text.replace("*END STEP", STRESS + "*END STEP"))

    def moment(self, result, where, about):
        """The moment of the reaction forces where a mask says, about a point."""
        x = result.file["VTKHDF/Points"][:]
        force = at_end(result, "reaction_force")
        return np.cross(x[where] - about, force[where]).sum(axis=0)

    def test_a_turn_is_that_of_every_node(self):
        """A kinematic coupling that turns: the same as the displacements that it means."""
        place, turn, shift = np.array([0.3, 0.6, 1.4]), [0.01, -0.02, 0.03], [0.001, 0.0, -0.002]
        prescribed = "".join(f"900, {i + 1}, {i + 1}, {v}\n" for i, v in enumerate([*shift, *turn]))
        one = self.coupled("*KINEMATIC\n1, 3", step(prescribed.strip()), place=place.tolist())
        x = one.file["VTKHDF/Points"][:]
        top = np.abs(x[:, 2] - 1) < 1e-9
        wanted = np.array(shift) + np.cross(turn, x[top] - place)
        np.testing.assert_allclose(at_end(one, "displacement")[top], wanted, atol=1e-15)
        numbers = one.file["VTKHDF/PointData/node_id"][: len(x)]
        lines = "\n".join(
            f"{number}, {i + 1}, {i + 1}, {float(v)!r}"
            for number, u in zip(numbers[top], wanted, strict=True)
            for i, v in enumerate(u)
        )
        other = solved(
            self,
            deck(
                node(900, *place.tolist()),
                block("A", (2, 2, 3), (0, 0, 0), (1, 1, 1)),
                step(lines),
                held="A-ZMIN, 1, 3",
                tolerance=1e-12,
            ),
        )
        low = np.abs(x[:, 2]) < 1e-9
        a = at_end(one, "reaction_force")[low]
        b = at_end(other, "reaction_force")[low]
        self.assertLess(np.abs(a - b).max(), 1e-12 * np.abs(a).max())
        # Force and moment that the reference node takes: those at the other end, turned round.
        np.testing.assert_allclose(
            of_node(one, 900, "reaction_force"), -a.sum(axis=0), atol=1e-11 * np.abs(a).max()
        )
        np.testing.assert_allclose(of_node(one, 900, "rotation"), turn, atol=1e-15)
        moment = -self.moment(one, low, place)
        at_node = of_node(one, 900, "reaction_moment")
        np.testing.assert_allclose(at_node, moment, atol=1e-10 * np.abs(a).max())

    def test_a_moment_turns_it_as_far_as_the_turn_asks_for_a_moment(self):
        turned = self.coupled("*KINEMATIC", step("900, 6, 6, 0.01\n900, 1, 3\n900, 4, 5"))
        low = np.abs(turned.file["VTKHDF/Points"][:][:, 2]) < 1e-9
        moment = -self.moment(turned, low, [0.5, 0.5, 1.0])
        self.assertGreater(moment[2], 0)
        loaded_by = self.coupled("*KINEMATIC", loaded(f"900, 6, {float(moment[2])!r}"))
        self.assertAlmostEqual(of_node(loaded_by, 900, "rotation")[2], 0.01, delta=1e-13)
        self.assertEqual(np.abs(of_node(loaded_by, 900, "reaction_moment")).max(), 0)

    def test_a_sliding_coupling_lets_the_face_spread(self):
        """Only dof 3 is coupled: a uniform stress."""
        result = self.coupled(
            "*KINEMATIC\n3, 3",
            loaded("900, 3, -10."),
            held="A-ZMIN, 3\nA-XMIN, 1\nA-YMIN, 2",
        )
        stress = result.file["gauss/C3D8/stress"][:].reshape(-1, 6)
        self.assertLess(np.abs(stress - [0, 0, -10, 0, 0, 0]).max(), 1e-11)

    def test_a_force_is_distributed(self):
        """In the middle: a uniform stress, whatever the faces' sizes; elsewhere with its moment."""
        result = self.coupled(
            "*DISTRIBUTING",
            loaded("900, 3, -10."),
            held="A-ZMIN, 3\nA-XMIN, 1\nA-YMIN, 2",
        )
        stress = result.file["gauss/C3D8/stress"][:].reshape(-1, 6)
        self.assertLess(np.abs(stress - [0, 0, -10, 0, 0, 0]).max(), 1e-11)
        self.assertAlmostEqual(of_node(result, 900, "displacement")[2], -0.01, delta=1e-13)
        place = [1.5, -0.5, 2.0]
        loads = "900, 1, 2.\n900, 2, -1.\n900, 3, -5.\n900, 5, 0.7"
        result = self.coupled("*DISTRIBUTING", loaded(loads), place=place)
        low = np.abs(result.file["VTKHDF/Points"][:][:, 2]) < 1e-9
        force = at_end(result, "reaction_force")[low].sum(axis=0)
        np.testing.assert_allclose(force, [-2, 1, 5], atol=1e-11)
        np.testing.assert_allclose(self.moment(result, low, place), [0, -0.7, 0], atol=1e-10)

    def test_a_distributing_node_goes_with_the_mean(self):
        """A rigid motion of the face is that of the reference node."""
        place, turn = np.array([1.5, -0.5, 2.0]), np.array([0.01, -0.02, 0.03])
        text = deck(
            node(900, *place.tolist()),
            node(901, 0.0, 0.0, 0.0),
            block("A", (2, 3, 1), (0, 0, 0), (1, 1, 1)),
            "*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=900, SURFACE=A-ZMAX\n*DISTRIBUTING\n",
            "*COUPLING, CONSTRAINT NAME=TURN, REF NODE=901, SURFACE=A-ZMAX\n*KINEMATIC\n",
            step("901, 1, 3\n901, 4, 4, 0.01\n901, 5, 5, -0.02\n901, 6, 6, 0.03"),
            tolerance=1e-12,
        )
        result = solved(self, text)
        np.testing.assert_allclose(
            of_node(result, 900, "displacement"), np.cross(turn, place), atol=1e-14
        )
        np.testing.assert_allclose(of_node(result, 900, "rotation"), turn, atol=1e-14)

    def test_a_free_body_in_a_grip(self):
        """Its reference node is held, the block is pressed on a plane and turned about z."""
        result = self.coupled(
            "*KINEMATIC",
            "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n",
            pair("A-ZMIN, GROUND", 0.3),
            step("900, 1, 2\n900, 3, 3, -0.01\n900, 4, 5\n900, 6, 6, 0.0", 1),
            step("900, 6, 6, 0.05", 4),
            held="",
        )
        force = at_end(result, "contact_force").sum(axis=0)
        self.assertGreater(force[2], 1)
        np.testing.assert_allclose(of_node(result, 900, "reaction_force"), -force, atol=1e-8)
        x = result.file["VTKHDF/Points"][:]
        torque = np.cross(x - [0.5, 0.5, 0], at_end(result, "contact_force")).sum(axis=0)[2]
        self.assertAlmostEqual(of_node(result, 900, "reaction_moment")[2], -torque, delta=1e-8)
        self.assertLess(torque, -0.1)


class Arithmetic(unittest.TestCase):
    """Other ways to the same numbers."""

    TEXT = deck(
        node(900, 5.0, 5.0, 5.0),
        heavy(block("LOW", 3, (0, 0, -1), (1, 1, 1))),
        heavy(block("UP", 3, (0, 0, 0), (1, 1, 1), young=3000.0)),
        GROUND,
        pair("LOW-ZMIN, GROUND", 0.3),
        equations(
            "UP-ZMIN, 3, 1., LOW-ZMAX, 3, -1.",
            "UP-ZMIN, 1, 1., LOW-ZMAX, 1, -1., 900, 1, -0.1",
            "UP-ZMIN, 2, 1., LOW-ZMAX, 2, -1.",
        ),
        gravity("LOW", "UP").replace("*END", "*BOUNDARY\n900, 1, 1, 0.1\n*END"),
        step("UP-ZMAX, 3, 3, -0.03\nUP-ZMAX, 1, 1, 0.02\nUP-ZMAX, 2, 2, 0.", 4),
    )

    def field(self, change=str, *options, name="displacement"):
        run = Run(change(self.TEXT), *options, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return at_end(result, name)

    def test_products_and_single_factors(self):
        u = self.field()
        for change in (
            lambda t: t.replace("*CONTACT SOLVER", "*CONTACT SOLVER, COMPLIANCE=PRODUCTS"),
            lambda t: t.replace("*STEP", "*PRECISION, FACTOR=SINGLE\n*STEP", 1),
            lambda t: t.replace("*CONTACT SOLVER", "*CONTACT SOLVER, SOLVER=SWEEPS"),
        ):
            v = self.field(change)
            self.assertLess(np.abs(u - v).max(), 1e-6 * np.abs(u).max())

    def test_a_run_cut_in_two_is_the_same(self):
        """Ended by a signal after a few increments and continued: the same bits."""
        text = self.TEXT.replace("0.25, 1.", f"{1 / 64!r}, 1.")
        whole = Run(text, name="deck")
        self.assertEqual(whole.status, 0, whole.errors)
        continued = Run(text, "--continue", name="deck", ended_at=("2", "3"))
        self.assertEqual(continued.status, 0, continued.errors)
        with h5py.File(continued.file) as one, h5py.File(whole.file) as other:
            names = ["displacement", "reaction_force", "contact_force"]
            names = [f"VTKHDF/PointData/{name}" for name in names]
            names += ["reference_nodes/displacement", "reference_nodes/reaction_force"]
            for name in names:
                self.assertTrue(np.array_equal(one[name][()], other[name][()]), name)

    def test_an_exported_problem_has_these_reactions(self):
        run = Run(self.TEXT, "--export-fclib", "4", name="deck")
        self.assertEqual(run.status, 0, run.errors)
        exported = run.folder / "deck-4.fclib.hdf5"
        with run.result() as result, h5py.File(exported) as file:
            reaction = result.pairs[0].reaction[3]
            r = file["solution/r"][()].reshape(-1, 3)
            np.testing.assert_allclose(r, reaction, rtol=0, atol=1e-12 * np.abs(reaction).max())
        again = Run(exported)
        self.assertEqual(again.status, 0, again.errors)

    def test_an_accuracy_is_met(self):
        self.field(lambda t: t.replace(", DIRECT", ""), *ASKED, "0.2")


if __name__ == "__main__":
    unittest.main()
