"""What happens within an increment: obstacles that pass nodes and faces, and are met or told.

Where nothing is lost on the way (no friction, or none slides back) one large increment must lead to
what many small ones do. So it is compared with these, and with what is linear by hand.
"""

import tempfile
import unittest
from pathlib import Path

import numpy as np
from facets import binary_stl
from program import Run

DECK = """*NODE
90001, {x!r}, {y!r}, {z!r}
*BLOCK, NAME=B, TYPE=C3D8, NX={n[0]}, NY={n[1]}, NZ={n[2]}
0., 0., 0., {size[0]!r}, {size[1]!r}, {size[2]!r}
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=G, TYPE={shape}, REF NODE=90001{inner}
{x!r}, {y!r}, {z!r}, {axis} {radius!r}
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
90001, 1, 1, {way[0]!r}
90001, 2, 2, {way[1]!r}
90001, 3, 3, {way[2]!r}
*END STEP
"""


def deck(at, way, radius, increments=1, unit=1.0, turn=0, **changes):
    """Return the deck of a block and a tool at `at`; `turn` swaps the axes x, y, z in a cycle."""

    def turned(v):
        return [unit * float(c) for c in np.roll(v, turn)]

    surface = changes.pop("surface", "ZMAX")
    held = changes.pop("held", "ZMIN")
    axis = {"X": "1., 0., 0.,", "Y": "0., 1., 0.,", "Z": "0., 0., 1.,"}
    shape = changes.pop("shape", "SPHERE")
    n = np.roll(changes.pop("n", (4, 4, 3)), turn)
    names = "XYZ"[-turn:] + "XYZ"[:-turn] if turn else "XYZ"
    new = {old: names.index(old) for old in "XYZ"}

    def side(name):
        return "B-" + "XYZ"[new[name[0]]] + name[1:]

    x, y, z = turned(at)
    values = {
        "mu": 0.0,
        "direct": "",
        "inner": "",
        "axis": axis["XYZ"[new["Y"]]] if shape == "CYLINDER" else "",
        "size": turned(changes.pop("size", (1.0, 1.0, 1.0))),
        "n": n,
        "surface": side(surface),
        "held": side(held),
        **changes,
    }
    return DECK.format(
        x=x, y=y, z=z, way=turned(way), radius=unit * radius, shape=shape,
        increment=1.0 / increments, **values,
    )  # fmt: skip


ROLLING = """*PARAMETER
tangent = KEPT
*NODE
90001, 1., 0.5, 0.
*BLOCK, NAME=B, TYPE=C3D8, NX=2, NY=1, NZ=2
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
100., 0.001
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
*COUPLING, CONSTRAINT NAME=C, REF NODE=90001, SURFACE=B-ZMAX
*KINEMATIC
*BODY SOLVER, TANGENT=<tangent>
*STEP, NLGEOM
*STATIC, DIRECT
0.1, 1.
*BOUNDARY
90001, 1, 2
90001, 3, 3, -0.02
90001, 4, 4
90001, 5, 5, <110*pi/180>
90001, 6, 6
*END STEP
"""


class Case(unittest.TestCase):
    def force(self, text, *options):
        """Return the last resultant of a run that must be solved."""
        run = Run(text, *options, name="passes")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            self.assertTrue(result.history("certified").all())
            self.histories = result.pairs[0].resultant[:]
            return self.histories[-1]

    def refused(self, text, *words):
        run = Run(text, "--quiet", name="passes")
        self.assertEqual(run.status, 2, run.output + run.errors)
        for word in words:
            self.assertIn(word, run.errors)
        return run


class Rolling(Case):
    """A block that is rolled over its edge, with its lower face alone for a slave."""

    def test_a_face_that_looks_away_is_not_pressed(self):
        for tangent in ("KEPT", "NEWTON"):
            with self.subTest(tangent=tangent):
                self.refused(
                    ROLLING.replace("tangent = KEPT", f"tangent = {tangent}"),
                    "step 1, increment 10: G passes node", "of B-ZMIN", "from behind",
                    "a slave surface with all faces that may touch",
                )  # fmt: skip


class DeeperThanTheRadius(Case):
    """A tool whose middle is below the face at the increment's end."""

    def over_a_node(self, depth, radius=0.1, **changes):
        return deck((0.5, 0.5, 1.0 + radius), (0.0, 0.0, -depth), radius, **changes)

    def test_a_sphere_presses_one_node_in_proportion_to_its_depth(self):
        # One node touches, straight below: the force is linear in the depth.
        unit = self.force(self.over_a_node(0.03))[2] / 0.03
        self.assertLess(unit, 0.0)
        for depth, mu in ((0.12, 0.0), (0.12, 0.3), (0.19, 0.0)):
            with self.subTest(depth=depth, mu=mu):
                force = self.force(self.over_a_node(depth, mu=mu))
                np.testing.assert_allclose(force, [0.0, 0.0, unit * depth], atol=1e-7)

    def test_a_cylinder_does(self):
        unit = self.force(self.over_a_node(0.03, shape="CYLINDER"))[2] / 0.03
        force = self.force(self.over_a_node(0.12, shape="CYLINDER"))
        np.testing.assert_allclose(force, [0.0, 0.0, unit * 0.12], atol=1e-6)

    def test_it_does_along_each_axis_and_in_millimetres(self):
        reference = self.force(self.over_a_node(0.12))
        for turn in (1, 2):
            force = self.force(self.over_a_node(0.12, turn=turn))
            np.testing.assert_allclose(force, np.roll(reference, turn), atol=1e-6)
        force = self.force(self.over_a_node(0.12, unit=1000.0))
        np.testing.assert_allclose(force, 1e6 * reference, rtol=1e-7, atol=1.0)

    def test_a_tool_that_comes_from_afar_does(self):
        near = self.force(self.over_a_node(0.12))
        text = deck((0.5, 0.5, 1.7), (0.0, 0.0, -0.72), 0.1)
        np.testing.assert_allclose(self.force(text), near, atol=1e-6)

    def test_a_sphere_over_many_nodes_gives_what_small_increments_do(self):
        text = self.over_a_node(0.35, radius=0.3, n=(8, 8, 3))
        force = self.force(text)
        small = self.force(self.over_a_node(0.35, radius=0.3, n=(8, 8, 3), increments=8))
        np.testing.assert_allclose(force, small, atol=1e-4)
        self.assertLess(force[2], -50.0)

    def test_direct_increments_are_refused_with_those_that_would_do(self):
        text = self.over_a_node(0.12, direct=", DIRECT")
        self.refused(
            text, "step 1, increment 1: G passes node", "of B-ZMAX", "from behind",
            "use increments of 0.2 or less, or leave out DIRECT",
        )  # fmt: skip
        force = self.force(text.replace("1.0, 1.\n", "0.2, 1.\n"))
        np.testing.assert_allclose(force, self.force(self.over_a_node(0.12)), atol=1e-6)

    def test_a_surface_of_nodes_is_followed_by_its_normals(self):
        nodes = "*SURFACE, NAME=B-TOP, TYPE=NODE\nB-ZMAX\n*SURFACE INTERACTION"
        of_faces = self.over_a_node(0.12)
        text = of_faces.replace("*SURFACE INTERACTION", nodes, 1).replace("B-ZMAX, G", "B-TOP, G")
        np.testing.assert_allclose(self.force(text), self.force(of_faces), atol=1e-7)

    def test_the_error_by_load_steps_is_no_tool_on_the_far_side(self):
        # Twice the increment leads there; half of it says that nothing depends on increments.
        run = Run(self.over_a_node(0.12), name="passes")
        with run.result() as result:
            self.assertLess(abs(result.history("error/load_steps")[-1]), 1e-6)

    def test_a_hollow_may_pass_a_node_but_not_press_it_from_behind(self):
        # The lower face of a pin, in a hole that goes down by more than it is wide: its upper
        # face would be met first, and is no slave.
        text = deck(
            (0.5, 0.5, 0.3), (0.0, 0.0, -2.6), 1.1, surface="ZMIN", held="ZMAX", inner=", INNER",
            n=(2, 2, 2), size=(1.0, 1.0, 1.0),
        )  # fmt: skip
        self.refused(text, "G presses node", "of B-ZMIN from inside")
        # Down to where it does not press.
        np.testing.assert_array_equal(self.force(text.replace("-2.6", "-0.6")), 0.0)


class ThroughAFin(Case):
    """A plate 0.2 thick, held at its lower end; the tool comes from its left."""

    def fin(self, radius=0.15, z=0.7, way=(0.6, 0.0, 0.0), **changes):
        return deck(
            (-0.2 - radius, 0.5, z), way, radius, size=(0.2, 1.0, 1.0), n=(2, 4, 6),
            surface="XMIN", **changes,
        )  # fmt: skip

    def test_a_tool_that_would_cross_it_pushes_it_away(self):
        # From touch to beyond the other side in what is left of the increment.
        for shape in ("SPHERE", "CYLINDER"):
            with self.subTest(shape=shape):
                force = self.force(self.fin(shape=shape))
                small = self.force(self.fin(shape=shape, increments=32))
                np.testing.assert_allclose(force, small, atol=1e-4)
                self.assertGreater(force[0], 1.0)

    def test_it_does_along_other_axes_in_millimetres_and_with_friction(self):
        reference = self.force(self.fin())
        np.testing.assert_allclose(self.force(self.fin(turn=1)), np.roll(reference, 1), atol=1e-4)
        force = self.force(self.fin(unit=1000.0))
        np.testing.assert_allclose(force, 1e6 * reference, rtol=1e-5, atol=10.0)
        force = self.force(self.fin(mu=0.2, z=0.95))
        small = self.force(self.fin(mu=0.2, z=0.95, increments=32))
        np.testing.assert_allclose(force, small, atol=1e-2)

    def test_a_tool_that_is_held_by_its_edge_does_not_jump_over_it(self):
        # Its middle is above the edge, and leaves it in none of the small increments.
        over = {"radius": 0.08, "z": 1.05, "shape": "CYLINDER"}
        force = self.force(self.fin(**over))
        np.testing.assert_allclose(force, self.force(self.fin(**over, increments=64)), atol=1e-4)
        self.assertGreater(force[0], 1.0)

    def test_direct_increments_are_refused(self):
        self.refused(
            self.fin(direct=", DIRECT"), "step 1, increment 1: G gets 0.15 deep", "of B-XMIN",
            "contact is missed", "use smaller increments",
        )  # fmt: skip

    def test_a_tool_that_slips_between_the_nodes_is_refused_in_any_increments(self):
        # Its radius is a third of an edge: no node keeps its middle out of the face.
        for increments in (1, 16):
            with self.subTest(increments=increments):
                self.refused(
                    deck((0.53, 0.5, 1.1), (0.0, 0.0, -0.12), 0.1, increments),
                    "of B-ZMAX", "contact is missed; use smaller elements",
                )  # fmt: skip


FIN = """*BLOCK, NAME=F, TYPE=C3D8, NX=2, NY=4, NZ=6
0., 0., 0., {f!r}, {s!r}, {s!r}
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=F, MATERIAL=M
{tool}
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I{small}
F-XMIN, {master}
*BOUNDARY
F-ZMIN, 1, 3
*STEP
*STATIC{direct}
{increment!r}, 1.
*BOUNDARY
{moved}, 1, 1, 0.
{moved}, 2, 2, {way!r}
{moved}, 3, 3, 0.
*END STEP
"""


def box(low, high):
    """Return the corners and the triangles of a box, outward."""
    corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


class PastAFin(Case):
    """A tool whose side is 0.05 deep in the plate, beside it before and after the increment."""

    def graze(self, body, way=3.0, increments=1, s=1.0, mu=0.2, direct="", small=""):
        low, high = s * np.array([-0.3, -1.2, 0.5]), s * np.array([0.05, -0.8, 0.9])
        if body:
            size = ", ".join(repr(float(c)) for c in high - low)
            place = ", ".join(repr(float(c)) for c in low)
            tool = f"*BLOCK, NAME=T, TYPE=C3D8, NX=2, NY=2, NZ=2\n{place}, {size}\n"
            tool += "*SOLID SECTION, ELSET=T, MATERIAL=M"
            master, moved = "T-XMAX", "T-XMIN"
        else:
            tool = "*NODE\n9000, 0., 0., 0.\n"
            tool += "*OBSTACLE, NAME=T, TYPE=STL, INPUT=tool.stl, REF NODE=9000"
            master, moved = "T", "9000"
        text = FIN.format(
            f=0.2 * s, s=s, tool=tool, master=master, moved=moved, way=way * s, mu=mu,
            increment=1.0 / increments, direct=direct, small=small,
        )  # fmt: skip
        return text, binary_stl(*box(low, high))

    def run_deck(self, text, stl, *options):
        # The STL file lies beside the deck.
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        (Path(folder.name) / "tool.stl").write_bytes(stl)
        path = Path(folder.name) / "graze.inp"
        path.write_text(text)
        return Run(path, *options)

    def test_the_increment_is_cut_so_that_contact_is_met(self):
        for body in (False, True):
            for s in (1.0, 1000.0):
                with self.subTest(body=body, s=s):
                    # Edges that pass may lose energy at once: in some increments, not in these.
                    run = self.run_deck(*self.graze(body, increments=4, s=s))
                    self.assertEqual(run.status, 0, run.errors)
                    self.assertIn("would pass the face of nodes", run.output)
                    with run.result() as result:
                        force = result.pairs[0].resultant[:, 0] / s**2
                    self.assertGreater(force.max(), 0.5)
                    self.assertEqual(force[-1], 0.0)

    def test_direct_increments_are_refused(self):
        for body in (False, True):
            with self.subTest(body=body):
                run = self.run_deck(*self.graze(body, direct=", DIRECT"))
                self.assertEqual(run.status, 2, run.output)
                for word in ("gets 0.05 deep", "of F-XMIN", "use smaller increments"):
                    self.assertIn(word, run.errors)

    def test_a_way_of_less_than_a_face_is_followed(self):
        # Faces of 0.2 x 1, half of which is 0.51: the way of 0.7 is more, half of it is less.
        text, stl = self.graze(True, way=0.7, direct=", DIRECT")
        for old, new in (
            ("NX=2, NY=4, NZ=6\n0., 0., 0., 0.2, 1.0, 1.0", "NX=2, NY=1, NZ=1\n0,0,0, .2, .2, 1."),
            ("NX=2, NY=2, NZ=2\n-0.3, -1.2, 0.5, 0.35, 0.3999999999999999, 0.4",
             "NX=2, NY=1, NZ=1\n-.3, -.25, 0., .35, .2, 1."),
        ):  # fmt: skip
            self.assertIn(old, text)
            text = text.replace(old, new)
        run = self.run_deck(text, stl)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("gets 0.05 deep", run.errors)

    def test_a_tool_that_stays_beside_it_is_not_cut(self):
        for body in (False, True):
            for way in (0.7, -3.0):
                with self.subTest(body=body, way=way):
                    run = self.run_deck(*self.graze(body, way=way))
                    self.assertEqual(run.status, 0, run.errors)
                    self.assertNotIn("would pass", run.output)

    def test_small_sliding_follows_none(self):
        run = self.run_deck(*self.graze(True, small=", SMALL SLIDING"))
        self.assertEqual(run.status, 0, run.errors)
        self.assertNotIn("would pass", run.output)


if __name__ == "__main__":
    unittest.main()
