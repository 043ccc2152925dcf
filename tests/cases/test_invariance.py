"""What must not matter: units, place and direction in space, numbers of nodes, order of cards."""

import math
import unittest

import numpy as np
from program import Run

from studies.extremes.scenes import (  # found through program
    CYLINDER,
    SPHERE,
    Obstacle,
    Scene,
    Step,
    block,
    deck,
    free_cube,
    held,
    in_units,
    pushed_tool,
    renumbered,
    shuffled_deck,
    side,
    turned,
    two_blocks,
)

N = (3, 3, 2)
TOP = side(N, 2, True)
PRESSED = held(TOP, (0.0, 0.0, -0.03))
PUSHED = held(TOP, (0.05, 0.02, -0.03))

# Length and force of the unit in N and mm, each with the factor of numbers in it.
UNITS = {
    "N-m": (1e-3, 1.0),
    "kN-m": (1e-3, 1e-3),
    "MN-km": (1e-6, 1e-6),
    "1e-9 of both": (1e9, 1e9),
    "1e9 of the length": (1e-9, 1.0),
}


def on_round(kind, point, radius, **options):
    """A block pressed on a rigid sphere or cylinder and pushed over it."""
    steps = [Step(2, PRESSED), Step(2, PUSHED)]
    obstacle = Obstacle(kind, point, (0.0, 1.0, 0.0), radius)
    return block("round", "", n=N, steps=steps, obstacles=[obstacle], **options)


def scenes(**options) -> dict[str, Scene]:
    """Scenes whose solution is unique, so that forces can be compared."""
    return {
        "block": block("block", "", n=N, **options),
        "frictionless": block("frictionless", "", n=N, mu=0.0, **options),
        "nearly incompressible": block("soft", "", n=N, poisson=0.4999, **options),
        "with a gap": block("gap", "", n=N, gap=0.01, **options),
        "sphere": on_round(SPHERE, (0.45, 0.55, -1.0), 1.0, **options),
        "cylinder": on_round(CYLINDER, (0.45, 0.0, -1.0), 1.0, **options),
        "free cube": free_cube("cube", "", (2.0, 1.0, -10.0), n=N, **options),
        "tool under force": pushed_tool("tool", "", -5.0).named("tool", **options),
        "two bodies": two_blocks("two", "", 1000.0, 5000.0).named("two", **options),
    }


def solve(scene, text=None):
    """Run a scene; return forces (T, P, 3) and statuses (T, P) by its points, and iterations."""
    run = Run(text or deck(scene), name="scene")
    if run.status != 0:
        raise AssertionError(f"{scene.name}: {run.errors}")
    with run.result() as result:
        forces, statuses = [], []
        row_of = {int(i): row for row, i in enumerate(scene.ids())}
        for pair in result.pairs.values():
            rows = [row_of[int(result.node_ids[node])] for node in pair.nodes]
            forces.append(pair.force[:, np.argsort(rows)])
            statuses.append(pair.status[:, np.argsort(rows)])
        iterations = result.history("contact_iterations")
        return np.concatenate(forces, 1), np.concatenate(statuses, 1), iterations


class Units(unittest.TestCase):
    def test_units_change_nothing(self):
        """Same statuses, same iterations, forces to 1e-12."""
        for name, scene in scenes().items():
            force, status, iterations = solve(scene)
            for unit, (length, factor) in UNITS.items():
                with self.subTest(scene=name, unit=unit):
                    other = solve(in_units(scene, length, factor))
                    np.testing.assert_array_equal(other[1], status)
                    np.testing.assert_array_equal(other[2], iterations)
                    difference = np.abs(other[0] / factor - force).max()
                    allowed = 1e-12
                    if name == "nearly incompressible":
                        allowed = 1e-11  # lambda is 5000 G: so many digits fewer
                    self.assertLessEqual(difference, allowed * np.abs(force).max())

    def test_units_far_out_change_nothing(self):
        """Powers of two round nothing: whatever differs by more than digits is a threshold's."""
        for name, scene in scenes().items():
            force, status, iterations = solve(scene)
            for length, factor in ((2.0**60, 1.0), (2.0**-30, 2.0**60), (1.0, 2.0**-120)):
                with self.subTest(scene=name, length=length, force=factor):
                    other = solve(in_units(scene, length, factor))
                    np.testing.assert_array_equal(other[1], status)
                    np.testing.assert_array_equal(other[2], iterations)
                    difference = np.abs(other[0] / factor - force).max()
                    self.assertLessEqual(difference, 1e-11 * np.abs(force).max())


class Space(unittest.TestCase):
    def compare(self, name, scene, matrix, shift=(0.0, 0.0, 0.0)):
        """The turned scene has the turned forces, to 1e-10."""
        force, _, _ = solve(scene)
        other, _, _ = solve(turned(scene, matrix, shift))
        difference = np.abs(other @ np.asarray(matrix) - force).max()
        self.assertLessEqual(difference, 1e-10 * np.abs(force).max(), name)

    def test_mirrored(self):
        for name, scene in scenes(tolerance=1e-12).items():
            for axis in range(3):
                with self.subTest(scene=name, axis="xyz"[axis]):
                    mirror = np.eye(3)
                    mirror[axis, axis] = -1.0
                    self.compare(name, scene, mirror)

    def test_turned_by_a_right_angle(self):
        for name, scene in scenes(tolerance=1e-12).items():
            for matrix in ([[0, -1, 0], [1, 0, 0], [0, 0, 1]], [[0, 0, 1], [1, 0, 0], [0, 1, 0]]):
                with self.subTest(scene=name, matrix=matrix):
                    self.compare(name, scene, matrix)

    def test_turned_by_any_angle(self):
        """Obstacles, supports and loads turn with the body."""
        a, b = 0.7, 1.9
        about_z = [[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]
        about_x = [[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]]
        matrix = np.array(about_z) @ np.array(about_x)
        for name, scene in scenes(tolerance=1e-12).items():
            if name == "tool under force":
                continue  # its tool is held along two axes
            with self.subTest(scene=name):
                self.compare(name, scene, matrix)

    def test_shifted(self):
        for name, scene in scenes(tolerance=1e-12).items():
            with self.subTest(scene=name):
                self.compare(name, scene, np.eye(3), (3.0, -2.0, 5.0))


class Numbers(unittest.TestCase):
    def test_nodes_numbered_at_random(self):
        for name, scene in scenes(tolerance=1e-12).items():
            force, status, _ = solve(scene)
            for seed in (1, 2):
                with self.subTest(scene=name, seed=seed):
                    other = solve(renumbered(scene, seed))
                    difference = np.abs(other[0] - force).max()
                    self.assertLessEqual(difference, 1e-10 * np.abs(force).max())
                    np.testing.assert_array_equal(other[1], status)

    def test_cards_in_another_order(self):
        for name, scene in scenes().items():
            force, _, _ = solve(scene)
            for seed in (1, 2, 3):
                with self.subTest(scene=name, seed=seed):
                    other = solve(scene, shuffled_deck(deck(scene), seed))
                    difference = np.abs(other[0] - force).max()
                    self.assertLessEqual(difference, 1e-10 * np.abs(force).max())


if __name__ == "__main__":
    unittest.main()
