"""Masters with concave edges: each of their sides is as good as a pair of its own."""

import math
import unittest

import numpy as np
from corners import Bricks, turned
from facets import rigid
from two_bodies import solved

from studies.deck_cards import deck, pair, step

SLAVE = [(2, -1), (0, -1), (0, 1), (1, -1), (1, 1)]


class Corners(unittest.TestCase):
    """A block pushed into a hollow: one pair, and as many pairs as the hollow has walls."""

    def scene(self, walls, divided, **options):
        """Return the result of a block in a hollow whose walls face these ways.

        `divided`: a pair a wall. `rigid`: the hollow is of facets, else a body. `n`: bricks of the
        block along each axis. `lean`: by how much its faces across x lean, of its height. `push`:
        how its top is moved. `angles`: by which all of it is turned.
        """
        given = {"rigid": True, "n": 2, "lean": 0.0, "push": (-0.01, 0.0, -0.02), "mu": 0.3,
                 "angles": (0.0, 0.0, 0.0), "size": 1.0, "options": "", "increments": 1}
        given.update(options)
        turn, n = turned(given["angles"]), given["n"]

        def place(x):
            return given["size"] * (turn @ [x[0] + given["lean"] * x[2], x[1], x[2]])

        line = np.linspace(0, 1, n + 1)
        block = Bricks("A", [line] * 3, place=place, outside=True)
        coarse = [
            [-0.6, 0.0, 0.45, 1.0, 1.6] if axis < 2 else [-0.6, 0.0, 0.55, 1.4] for axis in range(3)
        ]

        def is_solid(x):
            return any(
                (x[axis] < 0 and side > 0) or (x[axis] > 1 and side < 0) for axis, side in walls
            )

        hollow = Bricks("H", coarse, keep=is_solid, place=place, first=2001)
        cards, surfaces = [block.cards(), block.surface("SK", SLAVE)], []
        groups = [[way] for way in walls] if divided else [walls]
        held = ""
        for i, ways in enumerate(groups):
            name = f"W{i}"
            if given["rigid"]:
                ref = 9001 + i
                first = 3001 + 1000 * i
                cards.append(rigid(name, hollow.places, hollow.facets(ways),
                                   (ref, (0.0, 0.0, 0.0)), first=first))
                held += f"{ref}, 1, 3\n"
            else:
                cards.append(hollow.surface(name, ways))
            surfaces.append(pair(f"SK, {name}", given["mu"], given["options"], number=i))
        if not given["rigid"]:
            cards.append(hollow.cards(young=2000.0))
            rim = [w[0] for w in coarse], [w[-1] for w in coarse]
            held += hollow.held(lambda x: any(x == rim[0]) or any(x[:2] == rim[1][:2]), (0, 0, 0))
        push = given["size"] * (turn @ given["push"])
        moved = block.held(lambda x: x[2] == 1 and not any(
            x[axis] == (1 - side) / 2 for axis, side in walls), push)
        text = deck(*cards, *surfaces, step(moved, given["increments"]), held=held.strip(),
                    tolerance=1e-12)
        return solved(self, text)

    def check_twins(self, walls, **options):
        """Run a scene both ways; forces and displacements must be the same to 1e-8."""
        one, two = self.scene(walls, False, **options), self.scene(walls, True, **options)
        n = len(one.pairs[0].nodes) // len(two.pairs[0].nodes)
        moved, moved_too = (r.field("displacement") for r in (one, two))
        m = min(len(moved), len(moved_too))
        largest = np.abs(moved_too).max()
        self.assertLess(np.abs(moved[:m] - moved_too[:m]).max(), 1e-8 * largest)
        resultant = sum(p.resultant[-1] for p in two.pairs)
        self.assertGreater(np.abs(resultant).max(), 0)
        difference = np.abs(one.pairs[0].resultant[-1] - resultant).max()
        self.assertLess(difference, 1e-8 * np.abs(resultant).max())
        return one, two, n


class Angles(Corners):
    """Two walls that meet at some angle, a block between them pushed into the corner."""

    def test_inner_corners_of_rigid_walls(self):
        """From 100 to 145 degrees the walls are sides of their own."""
        for degrees in (90, 100, 120, 135, 145):
            for mu in (0.0, 0.3):
                with self.subTest(degrees=degrees, mu=mu):
                    lean = 1 / math.tan(math.radians(degrees))
                    *_, n = self.check_twins([(2, 1), (0, 1)], lean=lean, mu=mu)
                    self.assertEqual(n, 2)

    def test_inner_corners_of_bodies(self):
        for degrees in (90, 120):
            for small in ("", ", SMALL SLIDING"):
                with self.subTest(degrees=degrees, small=small):
                    lean = 1 / math.tan(math.radians(degrees))
                    *_, n = self.check_twins([(2, 1), (0, 1)], lean=lean, rigid=False, options=small)
                    self.assertEqual(n, 2)

    def test_turned_and_scaled_scenes(self):
        for size in (1e-3, 1e3):
            with self.subTest(size=size):
                self.check_twins([(2, 1), (0, 1)], angles=(0.3, -0.7, 1.1), size=size)

    def test_three_walls_and_a_box(self):
        for walls, push in (
            ([(2, 1), (0, 1), (1, 1)], (-0.01, -0.005, -0.02)),
            ([(2, 1), (0, 1), (0, -1), (1, 1), (1, -1)], (-0.01, -0.005, -0.02)),
        ):
            for is_rigid in (True, False):
                with self.subTest(walls=len(walls), rigid=is_rigid):
                    *_, n = self.check_twins(
                        walls, push=push, rigid=is_rigid, increments=2,
                        options="" if is_rigid else ", SMALL SLIDING",
                    )
                    self.assertEqual(n, 3)


if __name__ == "__main__":
    unittest.main()
