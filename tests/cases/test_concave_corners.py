"""Masters with concave edges, each side of which is as good as a pair of its own; and pressures
where a master covers little of a node, or has facets twice.
"""

import math
import tempfile
import unittest
from pathlib import Path

import numpy as np
from corners import Elements, turned
from facets import plate, rigid, text_stl
from program import Run
from two_bodies import solved

from studies.deck_cards import block, deck, pair, step
from studies.requires import corner

SLAVE = [(2, -1), (0, -1), (0, 1), (1, -1), (1, 1)]


class Corners(unittest.TestCase):
    """A block pushed into a hollow: one pair, and as many pairs as the hollow has walls."""

    def scene(self, walls, divided, **options):
        """Return the result of a block in a hollow whose walls face these ways.

        `divided`: a pair a wall. `rigid`: the hollow is of facets, else a body. `n`: elements of
        the block along each axis. `lean`: by how much its faces across x lean, of its height.
        `push`: how its top is moved. `angles`: by which all of it is turned.
        """
        given = {"rigid": True, "n": 2, "lean": 0.0, "push": (-0.01, 0.0, -0.02), "mu": 0.3,
                 "angles": (0.0, 0.0, 0.0), "size": 1.0, "options": "", "increments": 1}
        given.update(options)
        turn, n = turned(given["angles"]), given["n"]

        def place(x):
            return given["size"] * (turn @ [x[0] + given["lean"] * x[2], x[1], x[2]])

        line = np.linspace(0, 1, n + 1)
        block = Elements("A", [line] * 3, place=place, outside=True)
        coarse = [
            [-0.6, 0.0, 0.45, 1.0, 1.6] if axis < 2 else [-0.6, 0.0, 0.55, 1.4] for axis in range(3)
        ]

        def is_solid(x):
            return any(
                (x[axis] < 0 and side > 0) or (x[axis] > 1 and side < 0) for axis, side in walls
            )

        hollow = Elements("H", coarse, keep=is_solid, place=place, first=2001)
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
        resultant = sum(p.resultant[-1] for p in two.pairs.values())
        self.assertGreater(np.abs(resultant).max(), 0)
        difference = np.abs(one.pairs[0].resultant[-1] - resultant).max()
        self.assertLess(difference, 1e-8 * np.abs(resultant).max())
        return one, two, n


class Angles(Corners):
    """Two walls that meet at some angle, a block between them pushed into the corner."""

    def test_inner_corners_of_rigid_walls(self):
        """Up to 150 degrees the walls are sides of their own, up to 180 they are one."""
        for degrees, mu in ((90, 0.0), (100, 0.3), (120, 0.0), (135, 0.3), (148, 0.3)):
            with self.subTest(degrees=degrees, mu=mu):
                lean = 1 / math.tan(math.radians(degrees))
                one, two, n = self.check_twins([(2, 1), (0, 1)], lean=lean, mu=mu, n=3)
                self.assertEqual(n, 2)
                self.assertEqual(set(one.pairs[0].side), {1, 2})
                # Every point is that of the pair which stands for its side.
                for side, twin in enumerate(two.pairs.values(), 1):
                    chosen = one.pairs[0].side == side
                    forces = one.pairs[0].force[-1][chosen]
                    np.testing.assert_array_equal(one.pairs[0].nodes[chosen], twin.nodes)
                    np.testing.assert_allclose(
                        forces, twin.force[-1], rtol=0, atol=1e-8 * np.abs(forces).max()
                    )
        one = self.scene([(2, 1), (0, 1)], False, lean=1 / math.tan(math.radians(155)))
        self.assertEqual(set(one.pairs[0].side), {1})

    def test_inner_corners_of_bodies(self):
        for degrees in (90, 120):
            for small in ("", ", SMALL SLIDING"):
                with self.subTest(degrees=degrees, small=small):
                    lean = 1 / math.tan(math.radians(degrees))
                    *_, n = self.check_twins(
                        [(2, 1), (0, 1)], lean=lean, rigid=False, options=small
                    )
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


class Grooves(unittest.TestCase):
    """A block on a plate with a groove of flat bottom, which goes through or ends."""

    def forces_on(self, is_solid, **options):
        """Return the displacement of a block that is pressed and dragged over a hollow."""
        body = Elements("A", [np.linspace(0, 1, 5)] * 2 + [np.linspace(0, 1, 3)], outside=True)
        lines = [[-0.5, 0.2, 0.4, 0.7, 1.5], [-0.5, 0.3, 0.6, 1.5], [-0.6, -0.3, 0, 1]]
        hollow = Elements("H", lines, keep=is_solid, first=2001)
        walls = rigid("W", hollow.places, hollow.facets(list(hollow.skin)),
                      (9001, (0.0, 0.0, 0.0)), first=3001, **options)
        moved = body.held(lambda x: x[2] == 1, (0.02, 0, -0.02))
        return solved(self, deck(
            body.cards(), body.surface("SK", [(2, -1)]), walls, pair("SK, W", 0.3),
            step(moved, 2), held="9001, 1, 3",
        ))

    def test_what_spans_a_groove_is_held_beside_it(self):
        """What a groove takes off: 0.8 and 0.4 % of the force, 2.6 and 1.3 with 8 elements a side.

        Each node has some of the plate below it: by dual functions it took nothing off.
        """
        plain = self.forces_on(lambda x: x[2] < 0)
        for name, end, taken_off in (("through", 9, 0.0078), ("ends", 0.6, 0.0035)):
            with self.subTest(groove=name):
                grooved = self.forces_on(lambda x, end=end: x[2] < -0.3 or (
                    x[2] < 0 and not (0.4 < x[0] < 0.7 and x[1] < end)))
                force, whole = (abs(r.pairs[0].resultant[-1, 2]) for r in (grooved, plain))
                self.assertAlmostEqual(1 - force / whole, taken_off, delta=0.0005)
                self.assertEqual(len(set(grooved.pairs[0].side)), 2 if end == 9 else 3)


class Little(unittest.TestCase):
    """Pressures where a master covers little of a node, or has facets twice."""

    def press(self, corners, facets, *options):
        """Return the result of a block that is pressed onto an STL file."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        (Path(folder.name) / "tool.stl").write_text(text_stl(corners, facets))
        path = Path(folder.name) / "deck.inp"
        path.write_text(deck(
            block("A", 3, (0, 0, 0), (1, 1, 1), nu=0.0),
            "*OBSTACLE, NAME=T, TYPE=STL, INPUT=tool.stl\n", pair("A-ZMIN, T"),
            step("A-ZMAX, 1, 2\nA-ZMAX, 3, 3, -0.02\n*CONTACT PRINT"),
        ))
        run = Run(path, *options)
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        result.output = run.output
        self.addCleanup(result.close)
        return result

    def test_facets_count_once(self):
        """Twice or three times, from another corner on: the pressure is E times the strain."""
        corners, facets = plate((-0.3, -0.4), (1.4, 1.2), (3, 2), split=True)
        turned_on = [f[k:] + f[:k] for k in (1, 2) for f in facets[::2]]
        result = self.press(corners, facets + turned_on)
        np.testing.assert_allclose(result.pairs[0].pressure[-1], 20, rtol=1e-8)
        self.assertIn(f"{len(turned_on)} triangles of ", result.output)
        # Turned round they are the other side, which nothing is before.
        result = self.press(corners, facets + [f[::-1] for f in facets])
        np.testing.assert_allclose(result.pairs[0].pressure[-1], 20, rtol=1e-8)
        self.assertNotIn("count once", result.output)

    def test_little_is_left_out_of_the_largest(self):
        """A plate that covers 0.01 of the last row: its nodes press as if it were much."""
        result = self.press(*plate((-0.5, -0.5), (2 / 3 + 0.01, 1.5), split=True))
        pair = result.pairs[0]
        x = pair.coordinates[:, 0]
        np.testing.assert_array_equal(pair.partly_covered[-1], x > 0.9)
        self.assertGreater(pair.pressure[-1].max(), 1.5 * pair.largest_pressure[-1])
        whole = pair.pressure[-1][~pair.partly_covered[-1]].max()
        self.assertEqual(pair.largest_pressure[-1], whole)
        stored = result.file[f"/contact/{pair.name}/largest_pressure"][-1]
        self.assertAlmostEqual(float(np.squeeze(stored)), whole, places=10)

    def test_flush_edges_count(self):
        """At an edge that is flush with nodes half of these is covered: that is enough."""
        result = self.press(*plate((-0.5, -0.5), (2 / 3, 1.5), split=True))
        self.assertFalse(result.pairs[0].partly_covered.any())

    def test_rows_that_contradict_each_other_take_few_steps(self):
        """Before a stiff body the rows of an edge node agree but for more than the tolerance."""
        result = solved(self, corner())
        iterations = result.history("contact_iterations")
        self.assertEqual(len(iterations), 2)
        self.assertLess(iterations.max(), 300)
        self.assertLess(result.history("residual").max(), 1e-8)


if __name__ == "__main__":
    unittest.main()
