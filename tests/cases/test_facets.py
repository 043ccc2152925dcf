"""Rigid surfaces of facets: before the obstacles that they are meshes of, and file before card."""

import itertools
import math
import os
import tempfile
import unittest
from pathlib import Path

import numpy as np
from facets import binary_stl, plate, rigid, text_stl
from program import INPUT, Run

from studies.deck_cards import block, deck, pair, step

RELEASE = os.environ.get("BIPOT_BUILD_TYPE", "Release") == "Release"
HELD = "*BOUNDARY\n900, 1, 3\n"
SHAPES = {
    "ball": lambda x, y: np.sqrt(9 - x**2 - y**2) - 3,
    "roller": lambda x, y: np.sqrt(9 - x**2) - 3 + 0 * y,
    "askew": lambda x, y: 0.1 * x + 0 * y - 0.3,
}
ORIGIN = (900, (0.0, 0.0, 0.0))


def fixed_plate(name, low, high, ref=ORIGIN, **mesh):
    """Return the cards of a plate at rest and its surface `name`."""
    return rigid(name, *plate(low, high, **mesh), ref) + f"*BOUNDARY\n{ref[0]}, 1, 3\n"


class Facets(unittest.TestCase):
    """Runs that must be solved and certified."""

    def solve(self, text, *options, **files):
        """Run a deck that must be solved; return its result. `files` are written beside it."""
        run = Run(text, *options, name="deck") if not files else self.run_beside(text, files)
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        result.output = run.output + run.errors
        return result

    def run_beside(self, text, files):
        """Run a deck in a folder that has the files too."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for name, content in files.items():
            (Path(folder.name) / name.replace("_", ".")).write_bytes(content)
        path = Path(folder.name) / "deck.inp"
        path.write_text(text)
        return Run(path)


class Symmetry(Facets):
    """Halves and quarters of a block on a round tool of facets, which planes of symmetry cut."""

    def on_tool(self, shape, halves, steps=(), mu=0.3, depth=0.06, options="", **tool_options):
        """(force times how many parts make the whole, {place: normal}), and the result.

        `halves`: whether of the block, -1..1 along x and y, the part above 0 is there alone;
        `cut`: of the tool as well; `split`: it is of triangles.
        """
        cut = tool_options.pop("cut", False)
        low, size, n, held = [-1.0, -1.0], [2.0, 2.0], [8, 8], "UP-ZMAX, 1, 2"
        tool, facets = [-1.3, -1.3], [12, 12]
        for axis in np.flatnonzero(halves):
            low[axis], size[axis], n[axis] = 0.0, 1.0, 4
            held += f"\nUP-{'XY'[axis]}MIN, {axis + 1}"
            if cut:
                tool[axis], facets[axis] = 0.0, 6
        text = deck(
            block("UP", (*n, 3), (*low, 0), (*size, 0.8)),
            fixed_plate(
                "TOOL", tool, (1.3, 1.3), n=tuple(facets), height=SHAPES[shape], **tool_options
            ),
            pair("UP-ZMIN, TOOL", mu, options),
            step(f"UP-ZMAX, 3, 3, {-depth!r}", 2),
            *steps,
            held=held,
            tolerance=1e-12,
        )
        found = self.solve(text).file["contact/UP-ZMIN:TOOL"]
        places = [tuple(np.round(x, 9)) for x in found["coordinates"][:]]
        normals = dict(zip(places, found["frame"][-1][:, 0], strict=True))
        return found["resultant"][-1] * 2 ** sum(halves), normals

    def check(self, part, whole, axes, tolerance, of_normals=1e-12):
        """The same forces along `axes`, and the same normals."""
        size = np.abs(whole[0]).max()
        for axis in axes:
            self.assertLess(abs(part[0][axis] - whole[0][axis]) / size, tolerance)
        for place, normal in part[1].items():
            self.assertLess(np.abs(normal - whole[1][place]).max(), of_normals)

    def test_a_part_does_what_the_whole_does(self):
        for shape, mu in (("ball", 0.0), ("ball", 0.3), ("roller", 0.3)):
            whole = self.on_tool(shape, (0, 0), mu=mu)
            for halves in ((1, 0), (0, 1), (1, 1)):
                with self.subTest(shape, mu=mu, halves=halves):
                    part = self.on_tool(shape, halves, mu=mu)
                    self.check(part, whole, [2], 1e-10)
                    for (x, y, _), normal in part[1].items():
                        if x == 0 and halves[0]:
                            self.assertEqual(normal[0], 0.0)
                        if y == 0 and halves[1]:
                            self.assertEqual(normal[1], 0.0)
            # Before half of the tool faces that are tilted do not see beyond the plane.
            cut = self.on_tool(shape, (1, 0), mu=mu, cut=True)
            self.check(cut, whole, [2], 1e-5, 1e-4)

    def test_the_tool_may_move_in_the_plane_and_turn_about_its_normal(self):
        for lines in ("900, 2, 2, 0.3", "900, 4, 4, 0.2"):
            slide = step(lines, 3)
            whole = self.on_tool("ball", (0, 0), [slide])
            self.check(self.on_tool("ball", (1, 0), [slide]), whole, [1, 2], 1e-10)
            self.assertGreater(abs(whole[0][1]), 0.1 * whole[0][2])

    def test_what_is_moved_onto_the_tool_stays_on_the_plane(self):
        options = ", ADJUST=1."
        whole = self.on_tool("ball", (0, 0), options=options)
        self.assertGreater(np.ptp([z for _, _, z in whole[1]]), 0.25)
        for halves in ((1, 0), (1, 1)):
            part = self.on_tool("ball", halves, options=options)
            self.assertEqual(sum(x == 0 for x, _, _ in part[1]), 5 + 4 * (1 - halves[1]))
            self.check(part, whole, [2], 1e-9, 1e-8)

    def test_triangles_need_not_be_mirror_images(self):
        whole = self.on_tool("ball", (0, 0), split=True)
        self.check(self.on_tool("ball", (1, 0), split=True), whole, [2], 1e-8, 1e-3)

    def test_what_leaves_the_plane_is_not_symmetric(self):
        """A block beside a wall, before a tool that moves or turns along it or lies askew."""
        for lines in ("900, 1, 1, 0.1", "900, 6, 6, 0.1"):
            normals = self.on_tool("ball", (1, 0), [step(lines, 2)])[1]
            self.assertGreater(max(abs(n[0]) for p, n in normals.items() if p[0] == 0), 0.01)
        normals = self.on_tool("askew", (1, 0), depth=0.3)[1]
        want = np.array([-0.1, 0.0, 1.0]) / math.hypot(0.1, 1.0)
        for normal in normals.values():
            self.assertLess(np.abs(normal - want).max(), 1e-12)


class AgainstObstacles(Facets):
    """Facets of a plane, and the plane itself."""

    def block_on(self, cards):
        """Run block.inp with other cards in place of its plane; return its pair."""
        text = (INPUT / "block.inp").read_text()
        start, end = text.index("*OBSTACLE"), text.index("*SURFACE INTERACTION")
        return self.solve(text[:start] + cards + text[end:]).file["contact/BODY-ZMIN:GROUND"]

    def test_block_on_plane(self):
        # Quadrilaterals and triangles, larger and smaller than the faces of the block, either side.
        want = self.block_on("*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n")
        force = want["resultant"][:]
        largest = np.abs(force).max()
        self.assertLess(abs(force[-1, 2] / 22191.84803 - 1), 1e-9)  # of the paper's run
        down = plate((-1.1, -1.2), (2.3, 2.1), (3, 2))
        reversed_facets = [f[::-1] for f in down[1]]
        for name, cards in {
            "one": fixed_plate("GROUND", (-1.1, -1.2), (2.3, 2.1)),
            "triangles": fixed_plate("GROUND", (-1.1, -1.2), (2.3, 2.1), n=(13, 11), split=True),
            "other side": rigid("GROUND", down[0], reversed_facets, ORIGIN, side="SNEG") + HELD,
            "shells": rigid("GROUND", *down, ORIGIN, types=("S3", "S4")) + HELD,
        }.items():
            with self.subTest(name):
                found = self.block_on(cards)
                self.assertLess(np.abs(found["resultant"][:] - force).max() / largest, 1e-8)
                self.assertTrue((found["status"][:] == want["status"][:]).all())
                self.assertLess(np.abs(found["slip"][:] - want["slip"][:]).max(), 1e-9)
                self.assertLess(
                    np.abs(found["torque"][:] - want["torque"][:]).max(), 1e-8 * largest
                )
                # Of the face as it is deformed.
                covered = found["covered_area"][:].sum(axis=1)
                self.assertTrue((covered > 1.0).all() and (covered < 1.05).all())
                self.assertLess(np.abs(found["moment_left"][:]).max(), 1e-8 * largest)
                self.assertLess(np.abs(found["least_gap"][:]).max(), 1e-10)
                # Placed once, as before a plane: no iteration follows facets.
                iterations = found.file["history/newton_raphson_iterations"][:]
                self.assertTrue((iterations == 1).all(), iterations)

    def turning(self, tool, rotation):
        """Press a tool on a cube and turn it; return the pair and the result."""
        result = self.solve(
            deck(
                block("LOW", 4, (0, 0, 0), (1, 1, 1), young=210000.0),
                tool,
                pair("LOW-ZMAX, TOOL", 0.3),
                step("900, 3, 3, -0.02"),
                step(rotation, 5),
                held="LOW-ZMIN, 1, 3\n900, 1, 3",
            )
        )
        return result.file["contact/LOW-ZMAX:TOOL"], result

    def test_turning_plate(self):
        # Spun by 10 degrees about the normal, tilted, and about an oblique axis that changes.
        node = "*NODE\n900, 0.5, 0.5, 1.\n"
        plane = node + "*OBSTACLE, NAME=TOOL, TYPE=PLANE, REF NODE=900\n0.5, 0.5, 1., 0., 0., -1.\n"
        corners, facets = plate((-0.6, -0.6), (1.6, 1.6), (3, 3))
        corners[:, 2] = 1.0
        meshed = rigid("TOOL", corners, facets, (900, (0.5, 0.5, 1.0)), side="SNEG")
        for rotation in (
            f"900, 6, 6, {math.radians(10)!r}",
            "900, 5, 5, 0.02",
            "900, 4, 4, 0.01\n900, 6, 6, 0.1",
        ):
            want, want_run = self.turning(plane, rotation)
            found, found_run = self.turning(meshed, rotation)
            for field in ("resultant", "torque", "slip", "moment"):
                error = np.abs(found[field][:] - want[field][:]).max()
                self.assertLess(error, 1e-8 * np.abs(want[field][:]).max(), (field, rotation))
            self.assertTrue((found["status"][:] == want["status"][:]).all())
            moments = [r.reference_nodes[900].reaction_moment[-1] for r in (want_run, found_run)]
            self.assertLess(np.abs(moments[1] - moments[0]).max(), 1e-8 * np.abs(moments[0]).max())

    def over_an_edge(self, corners, facets):
        """Drag a block half off a plate at rest; return the result."""
        return self.solve(
            deck(
                block("UP", 4, (0, 0, 0), (1, 1, 1)),
                rigid("TOOL", corners, facets, ORIGIN) + HELD,
                pair("UP-ZMIN, TOOL", 0.2),
                step("UP-ZMAX, 3, 3, -0.02"),
                step("UP-ZMAX, 1, 1, 0.5", 10),
                held="UP-ZMAX, 1, 2",
            )
        )

    def test_a_flat_punch_that_ends_within_faces(self):
        # It covers nodes in part, in the mesh and when faces have bent, as one with a facet aside.
        corners, facets = plate((-0.4, -0.4), (0.3, 0.4), height=lambda x, y: 0.02 * x)
        aside = np.array([[-3.0, 0.0, -0.5], [-2.9, 0.0, -0.5], [-2.9, 0.1, -0.5]])
        tools = [(corners, facets), (np.vstack([corners, aside]), [*facets, (4, 5, 6)])]
        found = []
        for corners, facets in tools:
            result = self.solve(
                deck(
                    block("UP", 2, (-0.5, -0.5, 0.01), (1, 1, 1)),
                    rigid("TOOL", corners, facets, ORIGIN) + HELD,
                    pair("UP-ZMIN, TOOL", 0.2),
                    step("UP-ZMAX, 3, 3, -0.02"),
                    held="UP-ZMAX, 1, 2",
                )
            )
            self.assertEqual(result.counters["plan_revisions"], 0)
            found.append(result.file["contact/UP-ZMIN:TOOL/reaction"][:])
        self.assertGreater(found[0][-1, :, 0].sum(), 1.0)
        self.assertLess(np.abs(found[0] - found[1]).max(), 1e-6 * np.abs(found[1]).max())

    def test_flat_facets_end(self):
        # What crosses the edge of a flat plate sees what it would of one with a facet aside that
        # is not in its plane, which is never taken for a plane.
        corners, facets = plate((-1.0, -1.0), (1.07, 2.0), n=(5, 3))
        flat = self.over_an_edge(corners, facets)
        self.assertEqual(flat.counters["plan_revisions"], 1)
        self.assertIn("crosses the edge of TOOL", flat.output)
        aside = np.array([[-3.0, 0.0, -0.5], [-2.9, 0.0, -0.5], [-2.9, 0.1, -0.5]])
        n = len(corners)
        bent = self.over_an_edge(np.vstack([corners, aside]), [*facets, (n, n + 1, n + 2)])
        self.assertEqual(bent.counters["plan_revisions"], 0)
        for name in ("resultant", "reaction", "slip", "covered_area"):
            found, want = (r.file[f"contact/UP-ZMIN:TOOL/{name}"][:] for r in (flat, bent))
            self.assertLess(np.abs(found - want).max(), 1e-7 * np.abs(want).max(), name)

    def test_over_an_edge(self):
        # A block is dragged half off a plate: nodes leave it, forces balance, what is left presses.
        result = self.over_an_edge(*plate((-1.0, -1.0), (1.07, 2.0), n=(5, 3)))
        found = result.file["contact/UP-ZMIN:TOOL"]
        covered = found["covered_area"][:]
        self.assertTrue((np.diff(covered.sum(axis=1)[1:]) < 1e-3).all())
        beyond = found["coordinates"][:][:, 0] > 0.99
        self.assertTrue((covered[0][beyond] > 0).all() and (covered[-1][beyond] == 0).all())
        self.assertTrue((found["reaction"][-1][beyond] == 0).all())
        force = found["resultant"][:]
        self.assertTrue((force[:, 2] > 1.0).all() and force[-1, 2] < 0.9 * force[0, 2])
        self.assertLess(abs(force[-1, 0] / force[-1, 2] + 0.2), 1e-6)

    def test_loaded_tool(self):
        # A plate under force, held sideways, that finds its own height; above by a gap at first.
        def pressed(tool):
            return self.solve(
                deck(
                    block("LOW", (4, 3, 2), (0, 0, 0), (1, 1, 0.5), young=1000.0),
                    tool,
                    pair("LOW-ZMAX, TOOL", 0.4),
                    "*STEP\n*STATIC, DIRECT\n0.5, 1.\n*CLOAD\n900, 3, -20.\n*END STEP\n",
                    "*STEP\n*STATIC, DIRECT\n0.5, 1.\n*CLOAD\n900, 1, 5.\n*END STEP\n",
                    held="LOW-ZMIN, 1, 3\n900, 2, 2",
                )
            )

        node = "*NODE\n900, 0.3, 0.2, 2.\n"
        corners, facets = plate((-0.6, -0.6), (1.6, 1.6), (2, 5), split=True)
        corners[:, 2] = 0.6
        want = pressed(
            node + "*OBSTACLE, NAME=TOOL, TYPE=PLANE, REF NODE=900\n0., 0., 0.6, 0., 0., -1.\n"
        )
        found = pressed(rigid("TOOL", corners, facets, (900, (0.3, 0.2, 2.0)), side="SNEG"))
        moved = [r.reference_nodes[900].displacement[-1] for r in (want, found)]
        self.assertLess(np.abs(moved[1] - moved[0]).max(), 1e-9)
        for field in ("resultant", "slip"):
            values = [r.file[f"contact/LOW-ZMAX:TOOL/{field}"][:] for r in (want, found)]
            error = np.abs(values[1] - values[0]).max()
            self.assertLess(error, 1e-8 * np.abs(values[0]).max())

    def test_adjust_and_gaps(self):
        # A block .03 above: moved onto facets as onto the plane; with a gap that is added.
        def lowered(tool):
            cards = deck(
                block("UP", (3, 3, 2), (0, 0, 0.03), (1, 1, 1)),
                tool,
                pair("UP-ZMIN, TOOL", 0.2, options=", ADJUST=0.1")
                + "*CONTACT GAP\nUP-ZMIN, 0.01\n",
                step("UP-ZMAX, 3, 3, -0.02"),
                held="UP-ZMAX, 1, 2",
            )
            result = self.solve(cards)
            return result.file["contact/UP-ZMIN:TOOL/resultant"][-1], result.points

        want, at = lowered("*OBSTACLE, NAME=TOOL, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n")
        found, also = lowered(fixed_plate("TOOL", (-1, -1), (2, 2), n=(2, 3)))
        self.assertLess(np.abs(found - want).max(), 1e-8 * want[2])
        self.assertLess(np.abs(also[: len(at)] - at).max(), 1e-14)


def cap(n, radius=2.0, half=1.0, top=1.0):
    """Return a mesh of a sphere's lowest part, in single precision; it points down."""
    corners, facets = plate((-half, -half), (half, half), (n, n), split=True)
    corners = corners.astype(np.float32).astype(float)
    height = top + radius - np.sqrt(radius**2 - corners[:, 0] ** 2 - corners[:, 1] ** 2)
    corners[:, 2] = height.astype(np.float32)
    return corners, [f[::-1] for f in facets]


class Files(Facets):
    """STL files."""

    STL = "*NODE\n900, 0., 0., 3.\n*OBSTACLE, NAME=TOOL, TYPE=STL, INPUT=cap.stl, REF NODE=900\n"
    SPHERE = (
        "*NODE\n900, 0., 0., 3.\n*OBSTACLE, NAME=TOOL, TYPE=SPHERE, REF NODE=900\n0., 0., 3., 2.\n"
    )

    def pressed(self, tool, elements=4):
        """Return a deck of a tool that is pressed on a block and drags it."""
        return deck(
            block("LOW", elements, (-0.5, -0.5, 0), (1, 1, 1)),
            tool,
            pair("LOW-ZMAX, TOOL", 0.3),
            step("900, 3, 3, -0.05", 2),
            step("900, 1, 1, 0.02"),
            held="LOW-ZMIN, 1, 3\n900, 1, 2",
        )

    def resultant(self, tool, elements=4, **files):
        """Return the forces on the block."""
        result = self.solve(self.pressed(tool, elements), **files)
        return result.file["contact/LOW-ZMAX:TOOL/resultant"][:]

    def test_forms_are_the_same_bits(self):
        mesh = cap(16)
        binary = self.resultant(self.STL, cap_stl=binary_stl(*mesh))
        text = text_stl(*mesh)
        others = {
            "text": self.resultant(self.STL, cap_stl=text.encode()),
            "line ends": self.resultant(
                self.STL, cap_stl=text.upper().replace("E+", "e+").replace("\n", "\r\n").encode()
            ),
            "elements": self.resultant(rigid("TOOL", *mesh, (900, (0.0, 0.0, 3.0)))),
        }
        self.assertGreater(binary[-1, 0], 1.0)
        for name, forces in others.items():
            self.assertTrue((forces == binary).all(), name)

    @unittest.skipUnless(RELEASE, "thousands of triangles")
    def test_fine_files_are_the_sphere(self):
        # In the size of the triangles by its square; the limit is the sphere's, as faces get fine.
        fine = [self.resultant(self.STL, cap_stl=binary_stl(*cap(n))) for n in (12, 24, 48)]
        change = [np.abs(b - a).max() for a, b in itertools.pairwise(fine)]
        self.assertTrue(3.5 < change[0] / change[1] < 4.5, change)
        errors = []
        for elements in (4, 8):
            exact = self.resultant(self.SPHERE, elements)
            meshed = self.resultant(self.STL, elements, cap_stl=binary_stl(*cap(48)))
            errors.append(abs(meshed[1, 2] / exact[1, 2] - 1))
        self.assertLess(errors[1], 0.45 * errors[0], errors)

    def test_at_rest(self):
        # Without a reference node, and with one that is held; the plate covers part of the block.
        corners, facets = plate((-1, -1), (0.6, 2), (2, 3), split=True)
        cards = deck(
            block("UP", 4, (0, 0, 0), (1, 1, 1)),
            "*OBSTACLE, NAME=TOOL, TYPE=STL, INPUT=plate.stl\n",
            pair("UP-ZMIN, TOOL", 0.3),
            step("UP-ZMAX, 3, 3, -0.02", 2),
            held="UP-ZMAX, 1, 2",
        )
        rest = self.solve(cards, plate_stl=binary_stl(np.float32(corners).astype(float), facets))
        held = self.solve(
            cards.replace(
                "*OBSTACLE, NAME=TOOL, TYPE=STL, INPUT=plate.stl\n",
                rigid("TOOL", np.float32(corners).astype(float), facets, ORIGIN) + HELD,
            )
        )
        a, b = (r.file["contact/UP-ZMIN:TOOL"] for r in (rest, held))
        for field in ("resultant", "status", "gap", "covered_area", "least_gap"):
            self.assertTrue((a[field][:] == b[field][:]).all(), field)
        beyond = a["coordinates"][:][:, 0] > 0.76
        self.assertTrue((a["gap"][-1][beyond] > 1e29).all())
        self.assertTrue((a["covered_area"][-1][beyond] == 0).all())
        self.assertTrue((a["reaction"][-1][beyond] == 0).all())
        self.assertLess(abs(a["covered_area"][-1].sum() - 0.6), 0.01)
        self.assertGreater(a["resultant"][-1][2], 1.0)


if __name__ == "__main__":
    unittest.main()
