"""*KINEMATIC couplings at finite strain whose reference nodes turn freely, or under moments."""

import unittest

import numpy as np
from program import Run
from scipy.spatial.transform import Rotation

SIDE = 3.0  # height of the bar
REFERENCE = np.array([0.2, 0.1, 3.5])


def solved(case, text, **options):
    """Run a deck that must be certified; return its result."""
    run = Run(text, name="case", **options)
    case.assertEqual(run.status, 0, run.errors)
    result = run.result()
    case.addCleanup(result.close)
    return result


def reference(result):
    """Return what the result file says of the only reference node at the end."""
    of = result.reference_nodes[900]
    return {
        name: np.asarray(getattr(of, name))[-1]
        for name in ("displacement", "rotation", "reaction_force", "reaction_moment")
    }


def bar(cards, tangent="KEPT", turn=None, increments=9, more=""):
    """Return the deck of a bar of rubber that is held below, with a coupling on its upper face.

    `turn` is a rotation of the scene about its origin.
    """
    line = np.arange(3) / 2
    grid = [(x - 0.5, y - 0.5, z) for z in np.arange(5) * SIDE / 4 for y in line for x in line]
    points = np.array([*grid, REFERENCE])
    if turn is not None:
        points = turn.apply(points)
    numbers = [*range(1, 46), 900]
    text = "*NODE\n"
    for number, x in zip(numbers, points, strict=True):
        text += f"{number}, " + ", ".join(repr(float(value)) for value in x) + "\n"
    text += "*ELEMENT, TYPE=C3D8, ELSET=BAR\n"
    element = 0
    for k in range(4):
        for j in range(2):
            for i in range(2):
                element += 1
                low = [1 + i + 3 * j + 9 * k + step for step in (0, 1, 4, 3)]
                text += ", ".join(map(str, [element, *low, *(n + 9 for n in low)])) + "\n"
    text += "*NSET, NSET=LOW, GENERATE\n1, 9\n*NSET, NSET=HIGH, GENERATE\n37, 45\n"
    return (
        text
        + f"""*SURFACE, NAME=TOP, TYPE=NODE
HIGH
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
0.5, 0.5
*SOLID SECTION, ELSET=BAR, MATERIAL=M
*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=TOP
*KINEMATIC
*BODY SOLVER, TANGENT={tangent}
*STEP, NLGEOM
*STATIC
{1 / increments!r}, 1.
*BOUNDARY
LOW, 1, 3
{cards}*NODE FILE
U
*END STEP
{more}"""
    )


def loads(force, moment):
    """Return the cards of a force and a moment on the reference node."""
    lines = [f"900, {i + 1}, {float(value)!r}\n" for i, value in enumerate([*force, *moment])]
    return "*CLOAD\n" + "".join(lines)


class Elastica(unittest.TestCase):
    def test_an_end_moment_rolls_a_beam_to_a_circle(self):
        """Curvature M/EI: at 270 degrees the tip is at L sin(a)/a, -L (1 - cos a)/a."""
        length, young, angle = 20.0, 1000.0, 1.5 * np.pi
        thickness = 0.5
        moment = young * thickness**3 / 12.0 * angle / length
        text = f"""*BLOCK, NAME=B, ELSET=B, TYPE=C3D8I, NX=24, NY=1, NZ=1
0., -0.5, -0.25, {length}, 1., {thickness}
*MATERIAL, NAME=M
*ELASTIC
{young}, 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
900, {length}, 0., 0.
*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=B-XMAX
*KINEMATIC
*BODY SOLVER, TANGENT=NEWTON
*STEP, NLGEOM
*STATIC
{1 / 14!r}, 1.
*BOUNDARY
B-XMIN, 1, 3
900, 2, 2
900, 4, 4
900, 6, 6
*CLOAD
900, 5, {moment!r}
*END STEP
"""
        end = reference(solved(self, text))
        tip = np.array([np.sin(angle) / angle - 1, 0.0, (np.cos(angle) - 1) / angle]) * length
        # The section strains by 6 %: St Venant-Kirchhoff is no beam there.
        np.testing.assert_allclose(end["displacement"], tip, atol=0.01 * length)
        np.testing.assert_allclose(end["rotation"], [0, angle, 0], atol=0.01 * angle)


class AsCalculiX(unittest.TestCase):
    def test_a_moment_bends_a_bar(self):
        """Displacements of three nodes of the face by CalculiX's *KINEMATIC, NLGEOM, C3D8."""
        wanted = [
            [9.604361e-01, 0.0, 9.278788e-02],
            [8.724871e-01, 0.0, -1.904400e-01],
            [7.845381e-01, 0.0, -4.736679e-01],
        ]
        text = bar("*CLOAD\n900, 5, 0.05\n", "NEWTON", increments=10)
        text = text.replace("*HYPERELASTIC, NEO HOOKE\n0.5, 0.5", "*ELASTIC\n2.4, 0.2")
        result = solved(self, text)
        u = result.field("displacement", -1)[[36, 40, 44]]
        # By default it stops where half a per cent of the mean force is out of balance.
        np.testing.assert_allclose(u, wanted, atol=5e-5)


class Answers(unittest.TestCase):
    """The bar, twisted by 90 degrees, holds the reference node by forces and moments."""

    @classmethod
    def setUpClass(cls):
        cls.quarter = np.pi / 2
        held = f"900, 1, 5\n900, 6, 6, {cls.quarter!r}\n"
        run = Run(bar(held), name="case")
        assert run.status == 0, run.errors
        cls.grip = run.result()
        cls.addClassCleanup(cls.grip.close)
        cls.end = reference(cls.grip)

    def check_pattern(self, result):
        """Hold the nodes of the face against the rotation vector."""
        end = reference(result)
        x = result.points[36:45]
        places = x + result.field("displacement", -1)[36:45]
        turned = Rotation.from_rotvec(end["rotation"]).apply(x - REFERENCE)
        wanted = REFERENCE + end["displacement"] + turned
        np.testing.assert_allclose(places, wanted, atol=1e-12 * SIDE)

    def test_a_torque_turns_as_far_as_the_grip(self):
        torque = f"900, 1, 5\n*CLOAD\n900, 6, {self.end['reaction_moment'][2]!r}\n"
        for tangent in ("KEPT", "NEWTON"):
            with self.subTest(tangent=tangent):
                result = solved(self, bar(torque, tangent))
                self.check_pattern(result)
                end = reference(result)
                self.assertAlmostEqual(end["rotation"][2], self.quarter, delta=1e-6)
                for name in ("reaction_force", "reaction_moment"):
                    wanted = self.end[name].copy()
                    wanted[2] *= name == "reaction_force"
                    np.testing.assert_allclose(end[name], wanted, atol=1e-7)

    def test_all_forces_and_moments_turn_alike(self):
        """Nothing of the reference node is held: the same place, and the work is the energy."""
        cards = loads(self.end["reaction_force"], self.end["reaction_moment"])
        for tangent in ("KEPT", "NEWTON"):
            with self.subTest(tangent=tangent):
                result = solved(self, bar(cards, tangent))
                self.check_pattern(result)
                end = reference(result)
                np.testing.assert_allclose(end["displacement"], np.zeros(3), atol=1e-6)
                np.testing.assert_allclose(end["rotation"], [0, 0, self.quarter], atol=1e-6)
                self.assertAlmostEqual(
                    result.history("energy/strain")[-1] / self.grip.history("energy/strain")[-1],
                    1,
                    delta=1e-6,
                )

    def test_mixed_directions(self):
        """Two components of the rotation follow the deck, the third turns past 180 degrees."""
        cards = "900, 4, 4, 0.5\n900, 5, 5, 0.3\n"
        cards += "*CLOAD\n900, 6, 0.3\n900, 1, 0.02\n900, 3, -0.05\n"
        ends = []
        for tangent in ("KEPT", "NEWTON"):
            result = solved(self, bar(cards, tangent))
            self.check_pattern(result)
            ends.append(reference(result))
            np.testing.assert_allclose(ends[-1]["rotation"][:2], [0.5, 0.3], rtol=1e-14)
            self.assertGreater(ends[-1]["rotation"][2], np.pi)
            self.assertLess(
                abs(result.history("energy/balance")[-1]),
                0.002 * result.history("energy/strain")[-1],
            )
        for name in ends[0]:
            np.testing.assert_allclose(ends[0][name], ends[1][name], atol=1e-6)

    def test_a_turned_scene(self):
        """By 37 degrees about a slanting axis: the same, turned."""
        turn = Rotation.from_rotvec(np.radians(37) * np.array([1, 2, 2]) / 3)
        force, moment = self.end["reaction_force"], self.end["reaction_moment"]
        plain = reference(solved(self, bar(loads(force, moment))))
        cards = loads(turn.apply(force), turn.apply(moment))
        turned = reference(solved(self, bar(cards, turn=turn)))
        for name in ("displacement", "rotation"):
            np.testing.assert_allclose(turned[name], turn.apply(plain[name]), atol=1e-6)

    def test_a_run_cut_in_two_is_the_same(self):
        """Ended by a signal after a few increments and continued: the same bits."""
        cards = loads(self.end["reaction_force"], self.end["reaction_moment"])
        text = bar(cards, increments=12)
        straight = reference(solved(self, text))
        continued = Run(text, "--continue", name="case", ended_at=("1", "5"))
        self.assertEqual(continued.status, 0, continued.errors)
        with continued.result() as result:
            end = reference(result)
        for name, value in straight.items():
            np.testing.assert_array_equal(end[name], value)

    def test_what_the_deck_leaves_to_the_program(self):
        """Couplings that turn freely with their contact, others by a kept tangent."""
        turned = "900, 1, 5\n900, 6, 6, 1.\n"
        for cards, tangent, name in (
            (loads([0.0] * 3, [0.0, 0.0, 0.1]), "AUTO", "newton"), (turned, "AUTO", "kept"),
            (loads([0.0] * 3, [0.0, 0.0, 0.1]), "KEPT", "kept"), (turned, "NEWTON", "newton"),
        ):  # fmt: skip
            with self.subTest(name=name, tangent=tangent):
                self.assertEqual(solved(self, bar(cards, tangent)).run["tangent"], name)

    def test_pressed_on_a_plate(self):
        """A moment presses the coupled face's corner on a plate with friction: both tangents."""
        wall = """*OBSTACLE, NAME=WALL, TYPE=PLANE
0.52, 0., 0.,  -1., 0., 0.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
SIDE, WALL
*BODY SOLVER"""
        side = "*NSET, NSET=RIGHT\n" + "".join(f"{3 * i}\n" for i in range(4, 16))
        side += "*SURFACE, NAME=SIDE, TYPE=NODE\nRIGHT\n"
        ends = []
        for tangent in ("KEPT", "NEWTON"):
            text = bar(loads([0.0, 0.0, 0.0], [0.0, 0.03, 0.05]), tangent)
            result = solved(self, text.replace("*BODY SOLVER", side + wall, 1))
            self.check_pattern(result)
            self.assertGreater(np.abs(result.pairs[0].resultant[-1]).max(), 1e-3)
            ends.append(reference(result))
        for name in ends[0]:
            np.testing.assert_allclose(ends[0][name], ends[1][name], atol=1e-6)

    def test_later_steps_and_whole_turns(self):
        """A torque past a whole turn, held there, and let go: back to where it began."""
        more = "*STEP\n*STATIC\n1., 1.\n*BOUNDARY, FIXED\n900, 4, 6\n*END STEP\n"
        more += f"*STEP\n*STATIC\n{1 / 12!r}, 1.\n*BOUNDARY, OP=NEW\nLOW, 1, 3\n900, 1, 2\n"
        more += "*CLOAD, OP=NEW\n*END STEP\n"
        cards = "900, 1, 2\n*CLOAD\n900, 6, 0.55\n"
        for tangent in ("KEPT", "NEWTON"):
            with self.subTest(tangent=tangent):
                result = solved(self, bar(cards, tangent, increments=18, more=more))
                rotation = np.asarray(result.reference_nodes[900].rotation)[:, 2]
                self.assertGreater(rotation.max(), 2 * np.pi)
                np.testing.assert_allclose(reference(result)["rotation"], np.zeros(3), atol=1e-5)
        # 20 degrees and more an increment, by Newton's method as it converges.
        self.assertEqual(len(rotation), 18 + 1 + 12)
        self.assertLessEqual(max(result.history("newton_raphson_iterations")), 12)


if __name__ == "__main__":
    unittest.main()
