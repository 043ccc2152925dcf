"""Obstacles that press on faces from inside their body, and those that may."""

import unittest

import numpy as np
from program import Run

DECK = """*NODE
90001, {hub}
*BLOCK, NAME=B, TYPE=C3D8, NX={n[0]}, NY={n[1]}, NZ={n[2]}
0., 0., 0., {s!r}, {s!r}, {s!r}
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
{cards}*OBSTACLE, NAME=G, TYPE={shape}, REF NODE=90001{inner}
{numbers}
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I
{surface}, G
*BOUNDARY
{held}, 1, 3
*STEP
*STATIC{direct}
{increment!r}, 1.
*BOUNDARY
{motion}*END STEP
"""


def deck(shape, point, way, axis=None, radius=None, hub=None, spin=None, unit=1.0, turn=0, **other):
    """Return the deck of a block and an obstacle that goes along `way` or turns by `spin`.

    `turn` swaps the axes x, y, z in a cycle; `unit` is the length of the block.
    """

    def turned(v):
        return np.roll(np.asarray(v, dtype=float), turn)

    def text(v):
        return ", ".join(repr(float(c)) for c in v)

    def side(name):
        return "B-" + "XYZ"[("XYZ".index(name[0]) + turn) % 3] + name[1:]

    numbers = [*(unit * turned(point)), *([] if axis is None else turned(axis))]
    if radius is not None:
        numbers.append(unit * radius)
    motion = [(i + 1, unit * c) for i, c in enumerate(turned(way))]
    if spin is not None:
        motion += [(i + 4, c) for i, c in enumerate(turned(spin)) if c]
    values = {
        "mu": 0.0, "n": (2, 2, 2), "direct": "", "inner": "", "cards": "", "increment": 0.25,
        "surface": side("ZMAX"), "held": side("ZMIN"), **other,
    }  # fmt: skip
    return DECK.format(
        hub=text(unit * turned(point if hub is None else hub)), s=unit, shape=shape,
        numbers=text(numbers), motion="".join(f"90001, {i}, {i}, {c!r}\n" for i, c in motion),
        **values,
    )  # fmt: skip


# Below the upper face of the block, and on their way up.
PLANE = ("PLANE", (0.5, 0.5, 0.9), (0.0, 0.0, 0.15), (0.0, 0.0, 1.0))
SPHERE = ("SPHERE", (0.5, 0.5, 0.6), (0.0, 0.0, 0.05), None, 0.4)
CYLINDER = ("CYLINDER", (0.5, 0.5, 0.6), (0.0, 0.0, 0.05), (0.0, 1.0, 0.0), 0.4)


class Case(unittest.TestCase):
    def refused(self, text, *words):
        run = Run(text, name="inside")
        self.assertEqual(run.status, 2, run.output + run.errors)
        for word in words:
            self.assertIn(word, run.errors)
        return run

    def solved(self, text):
        """Return the resultants of a run that must be solved, without a cut increment."""
        run = Run(text, name="inside")
        self.assertEqual(run.status, 0, run.output + run.errors)
        self.assertNotIn("retrying", run.output)
        with run.result() as result:
            self.assertTrue(result.history("certified").all())
            return result.pairs[0].resultant[:]


class InsideFromTheStart(Case):
    WORDS = ("G presses node", "from inside its body", "right side")

    def test_planes_spheres_and_cylinders_are_refused(self):
        for obstacle in (PLANE, SPHERE, CYLINDER):
            for mu in (0.0, 0.3):
                for direct in ("", ", DIRECT"):
                    with self.subTest(obstacle=obstacle[0], mu=mu, direct=direct):
                        run = self.refused(
                            deck(*obstacle, mu=mu, direct=direct), *self.WORDS, "of B-ZMAX"
                        )
                        # Parts of the increment would do no better.
                        self.assertNotIn("retrying", run.output)

    def test_they_are_along_each_axis_in_all_sizes_and_meshes(self):
        for turn, unit, n in ((1, 1.0, (2, 2, 2)), (2, 1000.0, (3, 1, 4)), (0, 1e-3, (4, 4, 2))):
            for obstacle in (PLANE, SPHERE, CYLINDER):
                with self.subTest(obstacle=obstacle[0], turn=turn, unit=unit):
                    self.refused(
                        deck(*obstacle, turn=turn, unit=unit, n=n, mu=0.3), *self.WORDS,
                        "of B-" + "ZXY"[turn] + "MAX",
                    )  # fmt: skip

    def test_a_surface_of_nodes_is_refused_where_it_has_faces(self):
        nodes = "*SURFACE, NAME=TOP, TYPE=NODE\nB-ZMAX\n"
        self.refused(deck(*PLANE, cards=nodes, surface="TOP"), *self.WORDS, "of TOP")

    def test_what_is_inside_without_pressing_is_solved(self):
        shape, point, way, axis = PLANE
        force = self.solved(deck(shape, point, 0.5 * np.array(way), axis))
        np.testing.assert_array_equal(force, 0.0)


class IntoTheBodyByATurn(Case):
    def test_a_plane_that_turns_over_the_upper_face_is_refused_where_it_pulls(self):
        # Its normal goes from -z through -x to z: at 90 degrees it pushes the rim sideways.
        for height, turn, unit in ((1.0, 0, 1.0), (1.3, 1, 1000.0)):
            with self.subTest(height=height):
                text = deck(
                    "PLANE", (0.5, 0.5, height), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0),
                    spin=(0.0, 2.5, 0.0), increment=0.1, turn=turn, unit=unit, mu=0.3,
                )  # fmt: skip
                run = self.refused(text, "G p", "node")
                with run.result() as result:
                    rows = result.history("time").size
                    angle = 2.5 * result.history("time")[-1]
                    force = result.pairs[0].resultant[:rows]
                self.assertGreater(np.degrees(angle), 80.0)
                self.assertLess(np.degrees(angle), 120.0)
                self.assertGreater(np.abs(force).max(), 0.0)

    def test_a_roller_that_drags_the_face_until_it_stands_is_refused(self):
        text = deck(
            "CYLINDER", (0.5, 0.65, 9.0), (0.0, 0.0, -0.02), (1.0, 0.0, 0.0), 8.0,
            spin=(-0.85, 0.0, 0.0), increment=0.125, mu=1.3, n=(1, 1, 2),
        )  # fmt: skip
        self.refused(text, "G passes node", "of B-ZMAX", "all faces that may touch")
        # Its side that comes below the roller is what it presses.
        both = "*SURFACE, NAME=BOTH, TYPE=NODE\nB-ZMAX\nB-YMAX\n"
        with_side = text.replace("*OBSTACLE", both + "*OBSTACLE", 1).replace("B-ZMAX, G", "BOTH, G")
        self.assertEqual(Run(with_side, name="side").status, 0)


class WithoutTheirFaces(Case):
    """Nodes of the body that get behind an obstacle, for they are in no slave surface of it."""

    COLUMN = "*SURFACE, NAME=PART, TYPE=NODE\n" + "".join(f"{90001 + k}\n" for k in (21, 24, 27))
    DOWN = ("PLANE", (0.5, 0.5, 1.0), (0.0, 0.0, -0.02), (0.0, 0.0, -1.0))

    def notes(self, text):
        run = Run(text, name="beside")
        self.assertEqual(run.status, 0, run.errors)
        return [line for line in run.output.splitlines() if "without contact, for it is" in line]

    def test_the_deepest_is_told_with_its_depth(self):
        # The first column of three goes down by 0.02, the last one moves hardly.
        lines = self.notes(deck(*self.DOWN, cards=self.COLUMN, surface="PART"))
        self.assertEqual(len(lines), 1)
        self.assertRegex(lines[0], r"step 1: node 900\d\d of the body is 0\.02.* inside G ")
        self.assertIn("not in PART", lines[0])

    def test_nothing_is_told_of_slave_nodes_and_of_what_was_there_before(self):
        self.assertEqual(self.notes(deck(*self.DOWN)), [])
        part = {"cards": self.COLUMN, "surface": "PART"}
        text = deck("PLANE", (0.5, 0.5, 0.99), (0.0, 0.0, -0.02), (0.0, 0.0, -1.0), **part)
        self.assertEqual(self.notes(text), [])
        # Where gaps are not those of the mesh, the mesh does not say where the body ends.
        gap = "*CONTACT GAP\nB-ZMAX, -0.01\n*BOUNDARY"
        text = deck(*self.DOWN, **part).replace("*BOUNDARY", gap, 1)
        self.assertEqual(self.notes(text), [])


class Legal(Case):
    def test_a_rim_may_be_pressed_from_its_side(self):
        # A plane with the normal -x beside the upper face: x = 1 there is its rim.
        force = self.solved(deck("PLANE", (1.0, 0.5, 0.5), (-0.02, 0.0, 0.0), (-1.0, 0.0, 0.0)))
        self.assertLess(force[-1][0], -1.0)
        # And by 10 degrees from below.
        c, s = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
        force = self.solved(deck("PLANE", (1.0, 0.5, 1.0), (-0.02, 0.0, 0.0), (-c, 0.0, s)))
        self.assertLess(force[-1][0], -1.0)

    def test_other_faces_may_be_behind_the_plane_all_the_time(self):
        # A plane under the last column of the lower face; what is left of it is behind the plane.
        part = "*SURFACE, NAME=PART, TYPE=NODE\n" + "".join(
            f"{90001 + k}\n" for k in (4, 5, 9, 10, 14, 15, 19, 20, 24, 25)
        )
        text = deck(
            "PLANE", (0.75, 0.5, 0.0), (0.0, 0.0, 0.02), (-0.3, 0.0, 1.0), n=(4, 4, 2), cards=part,
            surface="PART", held="B-ZMAX",
        )  # fmt: skip
        force = self.solved(text)
        self.assertGreater(force[-1][2], 1.0)

    def test_a_sphere_smaller_than_an_element_may_go_deep(self):
        text = deck("SPHERE", (0.5, 0.5, 1.1), (0.0, 0.0, -0.25), None, 0.1, increment=0.1)
        self.assertLess(self.solved(text)[-1][2], -1.0)

    def test_a_sphere_may_press_a_corner(self):
        text = deck("SPHERE", (1.1, 1.1, 1.1), (-0.05, -0.05, -0.05), None, 0.15, increment=0.1)
        self.assertLess(self.solved(text)[-1].max(), 0.0)


if __name__ == "__main__":
    unittest.main()
