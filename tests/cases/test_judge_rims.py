"""The judge on contact beside what is clamped, joined or shared, in corners, before small tools.

Right results are found right. Faults that programs had once, put into them, are found.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from judged import findings, judge_decks
from program import PROGRAM, SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

from held_points import Freedom, points_that_cannot_part
from mortar import place_surface
from obstacles import depth_below
from refusals import path_to, self_stress
from rim_scenes import Rims, random_rims, walls_of_facets
from scenes import SPHERE, Boundary, Equation, Obstacle, Pressure, Step, Tie, deck_of, write_deck
from slow_solver import Increment
from surfaces import Surface

RELEASE = os.environ.get("BIPOT_BUILD_TYPE", "Release") == "Release"


def blocks(upper=(2, 2, 1), lower=(2, 2, 1), **options):
    """Two cubes, the upper one the slave, the lower one held below: (builder, step)."""
    b = Rims(0, np.random.default_rng(1))
    for z, cells in ((0.0, lower), (1.0, upper)):
        b.part((0, 0, z), (1, 1, 1), cells, b.material(1000.0, 0.3), "C3D8", True, False)
    b.touch((1, "ZMIN"), (0, "ZMAX"), 0.3, **options)
    step = Step(1.0, 1, True)
    b.scene.steps.append(step)
    b.hold(step, 0, "ZMIN", (0, 1, 2))
    step.pressures.append(Pressure(1, "ZMAX", 4.0))
    return b, step


def clamp(b, step):
    """Clamp a side of both cubes."""
    for part in (0, 1):
        b.hold(step, part, "XMIN", (0, 1, 2))


def pairs_of(b):
    """[(row of the upper cube, row of the lower one)] at the same place."""
    lower = {tuple(b.points[r]): r for r in b.side(0, "ZMAX")[0]}
    return [(r, lower[tuple(b.points[r])]) for r in b.side(1, "ZMIN")[0]]


class SelfStress(unittest.TestCase):
    """What constraints and contact could carry between them, and nothing else."""

    def test_points_of_a_mean_that_press_together(self):
        """Means of two nodes are joined: their reactions may grow together, one alone may not."""
        b, _ = blocks()
        (one, under), (two, below) = pairs_of(b)[:2]
        b.scene.equations.append(
            Equation([([one], 2, 1.0), ([two], 2, 1.0), ([under], 2, -1.0), ([below], 2, -1.0)])
        )
        scene = b.finish("by hand")
        nothing = np.zeros_like(scene.points)
        path = path_to(scene, None, 0)
        increment = Increment(scene, nothing, path.supports(1.0), path.loads(1.0))
        increment.place(nothing)
        rows = [row for _, row, _, _ in increment.points]
        for pressing, expected in (((one, two), [one, two]), ((one,), []), ((), [])):
            force = np.outer(np.isin(rows, pressing), [0.0, 0.0, 1.0])
            found = self_stress(increment, SimpleNamespace(forces=[force]))
            self.assertEqual(sorted(rows[p] for p in found), sorted(expected))


class Rule(unittest.TestCase):
    """Which points have no row, and who gets what they have."""

    def fixed(self, b, held):
        """Places (n, 2) of the points that surely, and of those that perhaps, cannot move apart."""
        scene = b.finish("by hand")
        surface, nothing = Surface(scene, scene.pairs[0]), np.zeros_like(scene.points)
        answers = points_that_cannot_part(surface, Freedom(scene, held(scene)), nothing, nothing)
        return [sorted(tuple(scene.points[r, :2]) for r, one in answers.items() if one[k])
                for k in (0, 2)]  # fmt: skip

    @staticmethod
    def clamped(scene):
        """Directions that a clamp of both at x = 0 holds."""
        return np.repeat((scene.points[:, 0] < 1e-9)[:, None], 3, axis=1)

    @staticmethod
    def free(scene):
        """No direction."""
        return np.zeros(scene.points.shape, dtype=bool)

    def test_clamped_rims_with_meshes_that_match_or_not(self):
        for lower in ((2, 2, 1), (3, 5, 1)):
            with self.subTest(lower):
                b, _ = blocks((2, 2, 1), lower)
                expected = [(0.0, y) for y in (0.0, 0.5, 1.0)]
                self.assertEqual(self.fixed(b, self.clamped), [expected, expected])

    def test_one_side_alone_is_no_clamp(self):
        b, _ = blocks()
        for part in (0, 1):
            rows = b.side(part, "XMIN")[0]
            with self.subTest(part):
                def held(scene, rows=rows):
                    out = np.zeros(scene.points.shape, dtype=bool)
                    out[rows] = True
                    return out
                self.assertEqual(self.fixed(b, held), [[], []])

    def test_welds_ties_and_common_nodes(self):
        b, _ = blocks()
        row, other = pairs_of(b)[4]
        for dof in range(3):
            b.scene.equations.append(Equation([([row], dof, 1.0), ([other], dof, -1.0)]))
        self.assertEqual(self.fixed(b, self.free)[0], [(0.5, 0.5)])
        b, _ = blocks((2, 2, 1), (4, 3, 1))
        b.divide(1, "ZMIN", 0, 0.5, "U")
        b.divide(0, "ZMAX", 0, 0.5, "L")
        b.scene.pairs[0].side, b.scene.pairs[0].master = "U1", (0, "L1")
        b.scene.ties.append(Tie((1, "U0"), (0, "L0")))
        self.assertEqual(self.fixed(b, self.free)[0], [(0.5, y) for y in (0.0, 0.5, 1.0)])
        b, _ = blocks()
        row, other = pairs_of(b)[0]
        b.elements = [np.array([other if r == row else r for r in nodes]) for nodes in b.elements]
        self.assertEqual(self.fixed(b, self.free)[0], [(0.0, 0.0)])

    def test_means_that_are_joined_leave_points_free(self):
        b, _ = blocks()
        terms = [([r], 2, sign) for pair in pairs_of(b)[:2]
                 for r, sign in zip(pair, (1.0, -1.0), strict=True)]  # fmt: skip
        b.scene.equations.append(Equation(terms))
        self.assertEqual(self.fixed(b, self.free), [[], []])

    def test_neighbours_get_what_has_no_multiplier(self):
        # A face of width 1/2: its clamped nodes' 1/16 each go to their neighbours in x.
        b, _ = blocks()
        scene = b.finish("by hand")
        surface = Surface(scene, scene.pairs[0])
        none = [r for r in scene.side_rows(1, "ZMIN") if scene.points[r, 0] == 0]
        placed = place_surface(surface.slave, scene.points, surface.master, scene.points, none)
        at = {tuple(scene.points[r, :2]): i for i, r in enumerate(placed.rows)}
        for place, area in (((0.0, 0.0), 0.0), ((0.5, 0.0), 0.1875), ((0.5, 0.5), 0.375),
                            ((1.0, 0.0), 0.0625), ((1.0, 0.5), 0.125)):  # fmt: skip
            self.assertAlmostEqual(placed.covered[at[place]], area, delta=1e-12)
        some = placed.covered > 0
        np.testing.assert_allclose(placed.weights[some].sum(axis=1), 1.0, atol=1e-12)
        # The middle node stands for x = (0.25*0.5 + 0.125*0)/0.375, on the master's side as well.
        lower = list(scene.parts[0].rows)
        weights = placed.weights[at[0.5, 0.5], lower]
        self.assertAlmostEqual(weights.sum(), 1.0, delta=1e-12)
        self.assertAlmostEqual(weights @ scene.points[lower, 0], 1 / 3, delta=1e-12)
        means = scene.points[placed.rows[some]] - placed.weights[some] @ scene.points
        np.testing.assert_allclose(means, 0.0, atol=1e-12)

    def test_a_tool_below_a_face(self):
        face = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
        for place, depth in (((0.5, 0.5, -0.1), 0.1), ((0.5, 0.5, 0.1), 0.0),
                             ((1.5, 0.5, -0.1), 0.0)):  # fmt: skip
            tool = Obstacle("O", SPHERE, np.array(place), None, 0.05)
            found = depth_below(face, tool, np.zeros(3), np.array([0.0, 0.0, 1.0]))
            self.assertAlmostEqual(found, depth, delta=1e-15)
        # A corner is pressed in by more than the tool is large, which touches it from above.
        face[2, 2] = -0.4
        for above, depth in ((0.05, 0.0), (-0.05, 0.05)):
            place = np.array([1 - 1e-6, 1 - 1e-6, -0.4 + above])
            tool = Obstacle("O", SPHERE, place, None, 0.05)
            found = depth_below(face, tool, np.zeros(3), np.array([0.0, 0.0, 1.0]))
            self.assertAlmostEqual(found, depth, delta=1e-6)


class Faults(unittest.TestCase):
    """Right results; with a fault of old they are wrong."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="judge-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.scenes, cls.results = {}, {}
        for name in ("clamp", "mean", "crack", "corner", "tool"):
            scene = getattr(cls, name)()
            deck = cls.folder / f"{name}.inp"
            write_deck(scene, deck)
            done = subprocess.run([PROGRAM, deck.name], cwd=cls.folder, capture_output=True,
                                  text=True, check=False)  # fmt: skip
            assert done.returncode == 0, done.stderr
            cls.scenes[name], cls.results[name] = scene, deck.with_suffix(".vtkhdf")

    @staticmethod
    def clamp():
        b, step = blocks((2, 2, 1), (3, 3, 1))
        clamp(b, step)
        return b.finish("clamp")

    @staticmethod
    def mean():
        """The mean of two nodes goes with that of the two opposite."""
        b, step = blocks()
        b.hold(step, 1, "ZMAX", (0, 1))
        terms = [([r], 2, sign) for pair in pairs_of(b)[:2]
                 for r, sign in zip(pair, (1.0, -1.0), strict=True)]  # fmt: skip
        b.scene.equations.append(Equation(terms))
        return b.finish("mean")

    @staticmethod
    def crack():
        """Two cubes that share the nodes at the ends of their interface."""
        b, _ = blocks((3, 2, 1), (3, 2, 1))
        shared = {r: other for r, other in pairs_of(b) if b.points[r][0] in (0.0, 1.0)}
        b.elements = [np.array([shared.get(int(r), int(r)) for r in nodes]) for nodes in b.elements]
        return b.finish("crack")

    @staticmethod
    def corner():
        """A cube pressed into the corner of a floor and a wall, one master of facets."""
        b = Rims(0, np.random.default_rng(1))
        body = b.part((0, 0, 0), (1, 1, 1), (2, 2, 2), b.material(1000.0, 0.3), "C3D8", True, False)
        p = b.scene.parts[body]
        p.sides["FOOT"] = [*p.sides["ZMIN"], *p.sides["YMIN"]]
        corners = np.array([(-1, 0, 0), (2, 0, 0), (2, 2, 0), (-1, 2, 0), (-1, 0, 2), (2, 0, 2)])
        tool = walls_of_facets(b, body, "FACETS", corners.astype(float),
                               [[(0, 1, 2, 3)], [(0, 4, 5, 1)]], 0.3)  # fmt: skip
        step = Step(1.0, 1, True)
        b.scene.steps.append(step)
        step.boundaries += [Boundary([tool], dof, 0.0) for dof in range(3)]
        for side in ("ZMAX", "YMAX"):
            step.pressures.append(Pressure(body, side, 5.0))
        b.hold(step, body, "XMAX", (0,))
        return b.finish("corner")

    @staticmethod
    def tool():
        """A sphere a tenth as large as a face, pressed onto a node by half of its radius."""
        b = Rims(0, np.random.default_rng(1))
        part = b.part((0, 0, 0), (1, 1, 1), (2, 2, 2), b.material(1000.0, 0.3), "C3D8", True, False)
        at = b.obstacle(SPHERE, (0.5, 0.5, 1.05), None, 0.05, free=True)
        b.pair(part, "ZMAX", at, 0.3)
        reference = b.scene.obstacles[at].reference
        step = Step(1.0, 1, True)
        b.scene.steps.append(step)
        b.hold(step, part, "ZMIN", (0, 1, 2))
        for dof, value in ((0, 0.0), (1, 0.0), (2, -0.025)):
            step.boundaries.append(Boundary([reference], dof, value))
        return b.finish("tool")

    def findings(self, name, change=None):
        """Kinds of findings after `change(file)`."""
        return findings(self.scenes[name], self.results[name], change)

    def test_the_results_are_right(self):
        for name in self.scenes:
            with self.subTest(name):
                self.assertEqual(self.findings(name), set())

    @staticmethod
    def press(file, forces, gap=None):
        """Change reactions along the normal by {row of the pair's points: force}."""
        (group,) = file["contact"].values()
        total = file["VTKHDF/PointData/contact_force"]
        supports = file["VTKHDF/PointData/reaction_force"]
        for point, force in forces.items():
            frame = group["frame"][-1, point]
            reaction = group["reaction"][-1, point]
            reaction[0] += force
            group["reaction"][-1, point] = reaction
            if gap is not None:
                group["gap"][-1, point] = gap
                group["status"][-1, point] = 1
            node = group["node"][point]
            total[node] += force * frame[0]
            supports[node] -= force * frame[0]
            resultant = group["resultant"][-1]
            group["resultant"][-1] = resultant + force * frame[0]

    def test_a_reaction_where_both_sides_are_clamped(self):
        # However large: supports take it, and every node and body is in balance.
        def fault(file):
            (group,) = file["contact"].values()
            out = int(np.flatnonzero(group["gap"][-1] > 1e29)[0])
            self.press(file, {out: 1.9e18}, 0.0)

        self.assertIn("place of a point whose sides cannot move apart",
                      self.findings("clamp", fault))  # fmt: skip

    def test_a_reaction_where_the_sides_are_one_node(self):
        def fault(file):
            (group,) = file["contact"].values()
            out = int(np.flatnonzero(group["gap"][-1] > 1e29)[0])
            self.press(file, {out: 3.0}, 0.0)

        self.assertIn("place of a point whose sides cannot move apart",
                      self.findings("crack", fault))  # fmt: skip

    def test_what_neighbours_of_a_clamp_do_not_get(self):
        def fault(file):
            (group,) = file["contact"].values()
            covered = group["covered_area"][-1]
            covered[covered > 0.3] = 0.25
            group["covered_area"][-1] = covered

        self.assertIn("covered area wrong by", self.findings("clamp", fault))

    def test_a_stress_of_contact_and_constraint(self):
        # The joint holds what contact pushes: nodes and bodies are in balance, no law is broken.
        scene = self.scenes["mean"]
        joined = [int(rows[0]) for rows, _, weight in scene.equations[0].terms if weight > 0]
        others = [int(rows[0]) for rows, _, weight in scene.equations[0].terms if weight < 0]

        def fault(file):
            (group,) = file["contact"].values()
            order = list(scene.ids[joined])
            ids = file["VTKHDF/PointData/node_id"][:]
            points = [k for k, n in enumerate(group["node"][:]) if ids[n] in order]
            self.press(file, dict.fromkeys(points, 48.0))
            total = file["VTKHDF/PointData/contact_force"]
            supports = file["VTKHDF/PointData/reaction_force"]
            for node in np.flatnonzero(np.isin(ids, scene.ids[others])):
                total[node] -= (0.0, 0.0, 48.0)
            for node in np.flatnonzero(np.isin(ids, scene.ids[joined])):
                supports[node] = 0.0

        found = self.findings("mean", fault)
        self.assertIn("reactions that constraints could carry exceed the least", found)
        self.assertNotIn("out of balance", found)

    def test_a_node_that_slid_into_the_floor(self):
        scene = self.scenes["corner"]
        row = int(np.argmin(np.abs(scene.points[: scene.parts[0].rows[-1]]).sum(axis=1)))

        def fault(file):
            ids = file["VTKHDF/PointData/node_id"][:]
            at = int(np.flatnonzero(ids == scene.ids[row])[0])
            u = file["VTKHDF/PointData/displacement"][at]
            file["VTKHDF/PointData/displacement"][at] = u + np.array([0.0, 2e-3, -2e-3])

        self.assertIn("node behind a wall by", self.findings("corner", fault))

    def test_points_that_no_side_tells_apart(self):
        def fault(file):
            (group,) = file["contact"].values()
            del group["master_side"]
            file["VTKHDF/PointData/displacement"][:, 2] -= 1e-2

        from laws import Unreadable

        with self.assertRaises(Unreadable):
            self.findings("corner", fault)

    def test_a_tool_that_went_through(self):
        scene = self.scenes["tool"]

        def fault(file):
            z = file["reference_nodes/displacement"]
            z[:, :, 2] = -0.15
            (group,) = file["contact"].values()
            frame = group["frame"][:]
            frame[..., 0, 2] *= -1
            group["frame"][:] = frame

        for step in scene.steps:
            for one in step.boundaries:
                one.value *= 6
        try:
            found = self.findings("tool", fault)
        finally:
            for step in scene.steps:
                for one in step.boundaries:
                    one.value /= 6
        self.assertIn("pressed from inside, cosine", found)
        self.assertIn("middle of a tool is in a body by", found)

    def test_work_of_forces(self):
        def fault(file):
            file["VTKHDF/PointData/displacement"][:] *= 1 + 1e-4

        self.assertIn("work of nodal forces wrong by", self.findings("clamp", fault))


class Decks(unittest.TestCase):
    def test_seeds_are_reproducible_and_varied(self):
        self.assertEqual(deck_of(random_rims(11)), deck_of(random_rims(11)))
        scenes = [random_rims(seed) for seed in range(150)]
        self.assertGreaterEqual(len({s.kind for s in scenes}), 12)
        self.assertTrue(any(s.couplings for s in scenes) and any(s.ties for s in scenes))
        pairs = [p for s in scenes for p in s.pairs]
        self.assertTrue(any(p.wall == 2 for p in pairs) and any(p.small for p in pairs))
        self.assertTrue(any(p.whole for p in pairs) and any(p.friction == 0 for p in pairs))
        self.assertEqual({o.kind for s in scenes for o in s.obstacles},
                         {"SPHERE", "CYLINDER", "FACETS", "STL"})  # fmt: skip

    @unittest.skipUnless(RELEASE, "takes minutes in a Debug build")
    def test_decks_that_once_failed(self):
        # 219: a crack that opens again, with small sliding and meshes that do not match. 224: all
        # points slide at first, and a search leaps past where four of them stick. 326: a small tool
        # that presses a corner in by four times its radius. 70013: one that goes past a corner.
        # 72153: points beside a tie, which give way by a thousandth of what others do.
        done = judge_decks("rims", "--only", "219", "224", "326", "70013", "72153")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_random_decks(self):
        seed = "1" if RELEASE else "1001"
        done = judge_decks("rims", "--decks", "5", "--seed", seed)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


def load_tests(loader, tests, _):
    """The judge itself is tried where the Release tree is: no check of a Debug build sees it."""
    return tests if RELEASE else loader.loadTestsFromTestCase(Decks)


if __name__ == "__main__":
    unittest.main()
