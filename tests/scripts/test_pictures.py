"""What pictures show: bounds and colours of the bodies alone, obstacles where they touch, time."""

import os
import struct
import subprocess
import sys
import unittest
from pathlib import Path
from unittest.mock import patch

try:
    import h5py
    import matplotlib as mpl
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

import synthetic_result  # noqa: E402
from bipot.drawing import rendering, views  # noqa: E402
from bipot.drawing.bodies import Bodies, Look, Scene  # noqa: E402
from bipot.drawing.contact_map import Map  # noqa: E402
from bipot.drawing.histories import draw_errors, draw_forces  # noqa: E402
from bipot.drawing.skin import cut_skin, whole_skin  # noqa: E402
from bipot.element_faces import outer_faces_of, split_faces  # noqa: E402
from bipot.obstacle import clip, rotation_matrix  # noqa: E402
from bipot.pictures import plane_of  # noqa: E402
from bipot.result import Result  # noqa: E402
from bipot.units import Units  # noqa: E402
from package import ROOT, WithFolder, bipot, needs  # noqa: E402

mpl.use("Agg")
rendering.DPI = 40  # pixels take time, and what is seen does not depend on them
PIECES = 16  # of a drawn surface along the body, at least


def distances(points, polygons):
    """Return the least distance of each point to quadrilaterals (F, 4, 3)."""
    triangles = np.concatenate([polygons[:, [0, 1, 2]], polygons[:, [0, 2, 3]]])
    return np.array([min_distance(point, triangles) for point in points])


def min_distance(point, triangles):
    """Return the distance of a point to the nearest of the triangles (F, 3, 3)."""
    least = np.inf
    a, edges = triangles, np.roll(triangles, -1, axis=1) - triangles
    along = np.einsum("fkx,fkx->fk", point - a, edges)
    s = np.clip(along / np.maximum((edges**2).sum(axis=2), 1e-300), 0, 1)
    least = np.linalg.norm(a + s[:, :, None] * edges - point, axis=2).min()
    normals = np.cross(edges[:, 0], edges[:, 1])
    length = np.linalg.norm(normals, axis=1)
    real = length > 1e-12 * length.max()
    normals, a, edges = normals[real] / length[real, None], a[real], edges[real]
    height = np.einsum("fx,fx->f", point - a[:, 0], normals)
    foot = point - height[:, None] * normals
    sides = np.einsum("fkx,fx->fk", np.cross(edges, foot[:, None] - a), normals)
    inside = (sides >= 0).all(axis=1)
    return min(least, np.abs(height[inside]).min(initial=np.inf))


def pressed_block(shape, move, turn=0.0, cells=(4, 4, 2)):
    """Return a deck in which `shape` (a function that adds it) is moved into a block's top.

    move  displacement of the reference node; turn: its rotation about z [rad]
    """
    deck = bipot.Deck("A block under a tool", name="tool")
    deck.block("BODY", cells, (2, 2, 1), (-1, -1, -1))
    deck.material("SOFT", young=1000.0, poisson=0.3)
    deck.section("SOFT", "BODY")
    centre = deck.reference_node((0.0, 0.0, 2.0))
    shape(deck, centre)
    deck.interaction("DRY", friction=0.2)
    deck.pair("BODY-ZMAX", "TOOL", "DRY")
    with deck.step(increment=0.5):
        deck.boundary("BODY-ZMIN", "PINNED")
        for axis, value in enumerate((*move, 0.0, 0.0, turn), 1):
            deck.boundary(centre, axis, value=value)
    return deck


def stl_plate(path):
    """Write an STL file of a plate of two triangles at z = 0 that faces downwards."""
    corners = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], float)
    with path.open("wb") as file:
        file.write(b"plate".ljust(80) + struct.pack("<I", 2))
        for facet in ((0, 2, 1), (0, 3, 2)):
            file.write(struct.pack("<12fH", 0, 0, -1, *corners[list(facet)].ravel(), 0))
    return path


class Obstacles(WithFolder):
    """Each kind of obstacle, driven into a block, as it is drawn."""

    def solved(self, shape, move, **options):
        result = bipot.run(pressed_block(shape, move, **options), quiet=True)
        self.addCleanup(result.close)
        self.assertTrue(result.certified)
        return result

    def check(self, result, sagitta=0.0):
        """The drawn surface is as far from each point about the contact as the file's gap says."""
        bodies = Bodies(result)
        self.assertEqual(bodies.scale, 1.0)
        pair = result.pairs[0]
        for index, row in enumerate(result.field_rows):
            places = bodies.places(index)[pair.nodes]
            (pieces,) = bodies.obstacle_surfaces(index)
            near = np.abs(pair.gap[row]) < 0.05
            self.assertTrue((pair.reaction[row, near, 0] > 0).any())
            away = distances(places[near], pieces)
            self.assertLess(np.abs(away - np.abs(pair.gap[row, near])).max(), sagitta + 1e-8)
            # Pieces are turned to the body.
            normals = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
            k = np.argmin(np.linalg.norm(pieces.mean(axis=1)[:, None] - places, axis=2), axis=0)
            facing = np.einsum("px,px->p", normals[k], pair.frame[row, :, 0])
            self.assertTrue((facing[near] > 0).all())
        # Bounds are the bodies', however far the obstacle was driven.
        points = np.concatenate(
            [result.points, *map(bodies.places, range(len(result.field_rows)))]
        )
        self.assertGreaterEqual(points.min(), bodies.low.min())
        size = bodies.size
        low, high = bodies.view
        self.assertLess(np.max([bodies.low - low, high - bodies.high]), 1.6 * size)
        return bodies

    def test_plane(self):
        def plane(deck, node):
            deck.plane("TOOL", (0, 0, 0), (0, 0, -1), reference_node=node)

        result = self.solved(plane, (0.3, 0.0, -0.1))
        self.check(result)

    def test_sphere(self):
        def sphere(deck, node):
            deck.sphere("TOOL", (0, 0, 2), 2.0, reference_node=node)

        result = self.solved(sphere, (0.2, 0.1, -0.15))
        step = 2.0 / PIECES / 2.0
        self.check(result, sagitta=2.0 * step**2 / 2)

    def test_cylinder_that_turns(self):
        def cylinder(deck, node):
            deck.cylinder("TOOL", (0, 0, 3), (1, 0, 0), 3.0, reference_node=node)

        turn = 0.5
        result = self.solved(cylinder, (0.0, 0.1, -0.2), turn=turn)
        step = 2.2 / PIECES / 3.0
        self.check(result, sagitta=3.0 * step**2)
        np.testing.assert_allclose(
            result.pairs[0].obstacle_at().direction, [np.cos(turn), np.sin(turn), 0], atol=1e-12
        )

    def test_hollow_sphere(self):
        # The body lies in the bowl: at its corners the bowl is nearest.
        def bowl(deck, node):
            deck.sphere("TOOL", (0, 0, -9.9), 10.0, inner=True, reference_node=node)

        result = self.solved(bowl, (0.0, 0.0, -0.15))
        step = 2.2 / PIECES / 10.0
        self.check(result, sagitta=10.0 * step**2)

    def test_facets(self):
        path = stl_plate(self.folder / "plate.stl")

        def facets(deck, node):
            deck.stl("TOOL", path, reference_node=node)

        result = self.solved(facets, (0.1, 0.0, -0.1), turn=0.3)
        self.check(result)

    def test_a_close_up_holds_what_is_pressed(self):
        def sphere(deck, node):
            deck.sphere("TOOL", (0, 0, 2), 2.0, reference_node=node)

        result = self.solved(sphere, (0.0, 0.0, -0.01), cells=(12, 12, 2))
        bodies = Bodies(result, close=True)
        self.assertIsNotNone(bodies.box)
        pressed = bodies.places(-1)[bodies.near(result.pairs[0], -1)]
        self.assertTrue(((pressed > bodies.box[0]) & (pressed < bodies.box[1])).all())
        self.assertTrue((bodies.low >= bodies.box[0]).all())
        self.assertTrue((bodies.high <= bodies.box[1]).all())
        self.assertLess(bodies.size, Bodies(result).size)

    def test_displacements_are_not_drawn_so_large_that_gaps_show(self):
        # An interference is no part of the mesh: the rings are drawn apart by it, times the factor.
        result = bipot.run(ROOT / "input" / "press.inp", quiet=True)
        self.addCleanup(result.close)
        np.testing.assert_allclose(result.pairs[0].extra_gap, -0.0025)
        bodies = Bodies(result)
        self.assertLessEqual(bodies.scale * 0.0025, 0.02 * bodies.size)
        self.assertGreater(bodies.scale, 1)

    def test_a_pair_of_bodies_has_none(self):
        result = bipot.run(ROOT / "input" / "foundation.inp", n=1, base=2, steps=3, quiet=True)
        self.addCleanup(result.close)
        (pair,) = result.pairs.values()
        self.assertIsNone(pair.obstacle)
        masters = result.points[pair.master_nodes]
        np.testing.assert_array_equal(masters[:, 2], 0.0)
        self.assertEqual(len(masters), 9)
        bodies = Bodies(result, apart=True)
        self.assertTrue(bodies.apart)
        # On the screen the two have nothing in common: what is drawn across the pull is apart.
        body = views.components([result.elements], len(result.points))
        places = bodies.places(-1)
        pull = bodies.offset[pair.nodes[0]] - bodies.offset[pair.master_nodes[0]]
        across = pull - bodies.eye * (pull @ bodies.eye)
        slave, master = body[pair.nodes[0]], body[pair.master_nodes[0]]
        self.assertGreater(
            (places[body == slave] @ across).min(), (places[body == master] @ across).max()
        )


class Bounds(WithFolder):
    """A tool's own motion sets no scale."""

    def written(self, tool):
        path = self.folder / f"tool-{tool}.vtkhdf"
        synthetic_result.write(path, tool=tool)
        result = Result(path)
        self.addCleanup(result.close)
        return result

    def test_bounds_and_colours_are_those_of_the_bodies(self):
        result = self.written(20)
        self.assertEqual(result.reference_nodes[900].displacement[-1].tolist(), [0, 0, -60])
        bodies = Bodies(result)
        moved = result.points + bodies.scale * result.field("displacement")
        both = np.concatenate([moved, result.points])
        np.testing.assert_allclose(bodies.low, both.min(axis=0))
        np.testing.assert_allclose(bodies.high, both.max(axis=0))
        largest = np.linalg.norm(result.field("displacement"), axis=1).max()
        norm = bodies.norm("displacement", range(3))
        self.assertEqual((norm.vmin, norm.vmax), (0, largest))
        still = Bodies(self.written(0))
        self.assertEqual(norm.vmax, still.norm("displacement", range(3)).vmax)
        self.assertEqual(bodies.scale, still.scale)

    def test_components_and_ranges_that_are_asked_for(self):
        result = self.written(0)
        down = Bodies(result, Look(component="z"))
        np.testing.assert_array_equal(down.lengths(2), result.field("displacement", 2)[:, 2])
        least = result.field("displacement", 2)[:, 2].min()
        norm = down.norm("displacement", [2])
        self.assertEqual((norm.vmin, norm.vmax), (least, -least))
        along = Bodies(result, Look(component="zz"))
        np.testing.assert_allclose(along.mises(2), -30.0)
        # What is no component of a quantity leaves it as it is.
        np.testing.assert_allclose(down.mises(2), 30.0)
        norm = Bodies(result, Look(limits=(-1.0, 2.0))).norm("stress", [2])
        self.assertEqual((norm.vmin, norm.vmax), (-1.0, 2.0))
        with self.assertRaisesRegex(ValueError, "displacement has no component 'zz'"):
            result.plot("displacement", component="zz")

    def test_pressure_is_that_of_the_pair(self):
        result = self.written(0)
        bodies = Bodies(result, apart=True)
        pressure = bodies.pressure(2)
        np.testing.assert_allclose(pressure[result.pairs[0].nodes], 30.0)
        self.assertTrue(np.isnan(np.delete(pressure, result.pairs[0].nodes)).all())
        self.assertEqual(bodies.norm("pressure", [2]).vmax, 30.0)

    @needs("pyvista")
    def test_pyvista_has_the_points_of_the_bodies(self):
        result = self.written(20)
        grid = result.to_pyvista()
        self.assertEqual(grid.n_points, len(result.points))
        np.testing.assert_allclose(grid.bounds, (0, 2, 0, 1, 0, 1))
        np.testing.assert_array_equal(grid["node_id"], 100 + np.arange(grid.n_points))


class Mesh:
    """A mesh alone, as what is cut reads it from a result."""

    def __init__(self, points, blocks):
        self.points = np.array(points, float)
        self.cells, first = {}, 0
        for kind, nodes in enumerate(np.array(block) for block in blocks):
            self.cells[kind] = (first + np.arange(len(nodes)), nodes)
            first += len(nodes)
        faces, nodes = outer_faces_of([nodes for _, nodes in self.cells.values()])
        pieces, parent, self.boundary_edges = split_faces(nodes)
        self.boundary = pieces, faces[parent, 0]


CUBE = [(x, y, z) for z in (0, 1) for y, x in ((0, 0), (0, 1), (1, 1), (1, 0))]
SHAPES = {  # points, elements and volume
    "hexahedron": (CUBE, [[range(8)]], 1.0),
    "wedges": (CUBE, [[(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)]], 1.0),
    "tetrahedron": (CUBE, [[(0, 1, 3, 4)]], 1 / 6),
    "pyramids": ([*CUBE, (0.5, 0.5, 0.5)], [[
        (0, 1, 2, 3, 8), (4, 7, 6, 5, 8), (0, 4, 5, 1, 8), (1, 5, 6, 2, 8), (2, 6, 7, 3, 8),
        (3, 7, 4, 0, 8)]], 1.0),
}


def volume(polygons):
    """Return the volume that polygons (P, 4, 3) enclose, by the divergence theorem."""
    a, b, c, d = np.moveaxis(polygons, 1, 0)
    return sum(np.einsum("px,px->", one, np.cross(two, three)) for one, two, three in
               ((a, b, c), (a, c, d))) / 6


def directed_area(polygons):
    """Return the sum of the areas of polygons along their normals; 0 where they are closed."""
    a, b, c, d = np.moveaxis(polygons, 1, 0)
    return np.cross(c - a, d - b).sum(axis=0) / 2


class Clip(WithFolder):
    """What a plane leaves of the bodies is closed, and has the volume that it should."""

    def cut(self, name, axis, place, sign):
        points, blocks, _ = SHAPES[name]
        mesh = Mesh(points, [[list(nodes) for nodes in block] for block in blocks])
        skin = cut_skin(mesh, np.zeros((0, 2), int), axis, place, sign)
        return mesh, skin

    def test_both_sides_are_closed_and_make_up_the_whole(self):
        for name, (points, blocks, whole) in SHAPES.items():
            mesh = Mesh(points, [[list(nodes) for nodes in block] for block in blocks])
            self.assertAlmostEqual(
                volume(whole_skin(mesh, np.zeros((0, 2), int)).vertices.at(mesh.points)), whole)
            for axis, place in ((0, 0.25), (1, 0.5), (2, 0.7)):
                with self.subTest(shape=name, axis=axis, place=place):
                    found = 0.0
                    for sign in (1, -1):
                        _, skin = self.cut(name, axis, place, sign)
                        polygons = skin.vertices.at(mesh.points)
                        np.testing.assert_allclose(directed_area(polygons), 0, atol=1e-12)
                        below = sign * (place - polygons[..., axis])
                        self.assertGreaterEqual(below.min(), -1e-12)
                        self.assertEqual(len(polygons), len(skin.element))
                        found += volume(polygons)
                    self.assertAlmostEqual(found, whole)

    def test_a_cube_by_hand(self):
        _, skin = self.cut("hexahedron", 0, 0.25, 1)
        points = np.array(CUBE, float)
        self.assertAlmostEqual(volume(skin.vertices.at(points)), 0.25)
        # Four lines of the mesh about the section, each 1 long; values are linear between nodes.
        grid = skin.grid.at(points)
        np.testing.assert_allclose(grid[..., 0], 0.25)
        np.testing.assert_allclose(np.linalg.norm(grid[:, 1] - grid[:, 0], axis=1), np.ones(4))
        values = skin.vertices.at(points @ [1.0, 10.0, 100.0])
        np.testing.assert_allclose(values, skin.vertices.at(points) @ [1.0, 10.0, 100.0])
        edge = np.array([[0, 1], [1, 2]])
        mesh = Mesh(CUBE, [[list(range(8))]])
        outline = cut_skin(mesh, edge, 0, 0.25, 1).outline.at(points)
        lengths = np.linalg.norm(outline[:, 1] - outline[:, 0], axis=1)
        np.testing.assert_allclose(np.sort(lengths), [0.25, 1, 1, 1, 1])  # the edge below, the cut

    def test_a_plane_through_nodes(self):
        path = self.folder / "cut.vtkhdf"
        synthetic_result.write(path, size=(3, 2, 1))
        with Result(path) as result:
            for place, kept in ((1.0, 2.0), (2.0, 4.0), (1.5, 3.0)):
                skin = cut_skin(result, np.zeros((0, 2), int), 0, place, 1)
                polygons = skin.vertices.at(result.points)
                self.assertAlmostEqual(volume(polygons), kept)
                np.testing.assert_allclose(directed_area(polygons), 0, atol=1e-12)
                # Elements of the section are those that are kept.
                middle = result.points[result.elements[skin.element]].mean(axis=1)
                self.assertLess((middle[:, 0] - place).max(), 0.5)

    def test_what_is_before_the_plane_is_cut_away(self):
        path = self.folder / "cut.vtkhdf"
        synthetic_result.write(path)
        with Result(path) as result:
            for azimuth, low, high in ((0.0, 0.0, 0.5), (180.0, 0.5, 2.0)):
                bodies = Bodies(result, Look(scale=0.0, view=(20.0, azimuth), clip=(0, 0.5)))
                scene = bodies.scene(-1, "stress")
                found = scene.polygons[..., 0]
                self.assertAlmostEqual(found.min(), low)
                self.assertAlmostEqual(found.max(), high)
                np.testing.assert_allclose(scene.values, 30.0)
                for pieces in scene.obstacles:
                    side = 0.5 - pieces[..., 0] if azimuth == 0 else pieces[..., 0] - 0.5
                    self.assertGreaterEqual(side.min(), -1e-12)
                self.assertIn("cut at x = 0.5", bodies.words())
            with self.assertRaisesRegex(bipot.ResultError, "no clip at x=7: .* between 0 and 2"):
                Bodies(result, Look(clip=(0, 7.0)))

    def test_planes_in_words(self):
        self.assertEqual(plane_of("x=0.5"), (0, 0.5))
        self.assertEqual(plane_of(" z = -1e3 "), (2, -1000.0))
        self.assertEqual(plane_of("y"), (1, None))
        for wrong in ("w=1", "x=", "x=a", "x=nan", "1", "", "x=1,y=2"):
            with self.subTest(wrong), self.assertRaisesRegex(ValueError, "not a plane"):
                plane_of(wrong)

    def test_the_command(self):
        synthetic_result.write(self.folder / "small.vtkhdf")
        for form, begins in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
            done = show("small.vtkhdf", "--only", "stress", "--clip", "x=0.5", "--format", form,
                        "--dpi", "40")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            path = Path("small-pictures") / f"stress.{form}"
            self.assertEqual(path.read_bytes()[: len(begins)], begins)
        for plane, said in (("q=1", "not a plane, such as x=0.5 or x: 'q=1'"),
                            ("x=3", "no clip at x=3: the bodies are between 0 and 2")):
            done = show("small.vtkhdf", "--clip", plane)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(said, done.stderr)


def show(*arguments, **environment):
    """Run scripts/show."""
    return subprocess.run(
        [sys.executable, ROOT / "scripts" / "show", *arguments], capture_output=True, text=True,
        env={**os.environ, **environment}, check=False,
    )


class Command(WithFolder):
    """The command takes the Python of an active environment, and draws paths."""

    def test_the_active_environment(self):
        python = self.folder / "env" / "bin" / "python3"
        python.parent.mkdir(parents=True)
        python.write_text("#!/bin/sh\necho the active one: \"$@\"\n")
        python.chmod(0o755)
        done = show("small.vtkhdf", VIRTUAL_ENV=str(self.folder / "env"))
        self.assertEqual(done.stdout, f"the active one: {ROOT}/scripts/show small.vtkhdf\n")

    def test_a_path(self):
        synthetic_result.write(self.folder / "small.vtkhdf")
        done = show("small.vtkhdf", "--along", "0,0.5,0.5:2,0.5,0.5")
        self.assertEqual(done.stdout.split(),
                         ["small-pictures/along.png", "small-pictures/along.csv"], done.stderr)
        lines = Path("small-pictures/along.csv").read_text().splitlines()
        self.assertEqual(len(lines), 202)
        png = Path("small-pictures/along.png").read_bytes()
        self.assertAlmostEqual(struct.unpack(">I", png[16:20])[0], 1200, delta=2)
        for words, said in (("0,0,0:1,1", "not two or more places"),
                            ("0,0,9:1,0,9", "no element has a point of this path")):
            done = show("small.vtkhdf", "--along", words)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(said, done.stderr)


class Named(WithFolder):
    """Labels have the units that the deck names, and no number is another one."""

    def figure_of(self, units, what):
        path = self.folder / "small.vtkhdf"
        synthetic_result.write(path)
        with h5py.File(path, "r+") as file:
            file["run"].attrs["units"] = np.bytes_(units)
        with Result(path) as result:
            figure = result.plot(what)
            words = [text.get_text() for text in figure.findobj(mpl.text.Text)]
            limits = figure.axes[-1].get_ylim()
        mpl.pyplot.close(figure)
        return words, limits

    def test_labels(self):
        for what, label in (("displacement", "displacement, magnitude [mm]"),
                            ("stress", "von Mises stress [kN/mm²]"),
                            ("pressure", "contact pressure [kN/mm²]"), ("forces", "force [kN]")):
            words, limits = self.figure_of("kN, mm", what)
            self.assertIn(label, words)
            plain, same = self.figure_of("", what)
            self.assertIn(label.partition(" [")[0] + " [deck units]", plain)
            self.assertEqual(limits, same)
        self.assertIn("0.5 mm", self.figure_of("kN, mm", "displacement")[0])
        self.assertIn("x", self.figure_of("", "displacement")[0])

    def test_units_of_quantities(self):
        units = Units.from_text("N, mm")
        self.assertEqual(
            [units.of(name) for name in ("force", "length", "pressure", "energy", "area", "ratio")],
            ["N", "mm", "N/mm²", "N mm", "mm²", ""],
        )
        self.assertEqual(Units.from_text("").of("force"), "deck units")

    def test_they_are_those_of_the_deck(self):
        text = (ROOT / "input" / "block.inp").read_text()
        text = text.replace("*PARAMETER", "*UNITS\nN, mm\n*PARAMETER", 1)
        (self.folder / "named.inp").write_text(text)
        with (bipot.run("named.inp", n=1, steps=5, quiet=True) as named,
              bipot.run(ROOT / "input" / "block.inp", n=1, steps=5, quiet=True) as plain):
            self.assertEqual((named.units, plain.units), (("N", "mm"), ("", "")))
            np.testing.assert_array_equal(named.pairs[0].reaction, plain.pairs[0].reaction)
        deck = bipot.Deck().units("N", "mm")
        self.assertIn("*UNITS\nN, mm\n", deck.text())


class Rendered(WithFolder):
    """Bodies as pixels."""

    def setUp(self):
        super().setUp()
        path = self.folder / "small.vtkhdf"
        synthetic_result.write(path)
        self.result = Result(path)
        self.addCleanup(self.result.close)

    def test_pixels_are_shown_with_axes_and_a_length(self):
        pixels = np.full((90, 120, 3), 255, "uint8")
        right, up = rendering.screen_axes(views.towards_the_eye(24, -58))
        image = rendering.Image(pixels, right, up, 0.05)  # 6 long: a bar of 1
        with patch("bipot.drawing.bodies.render", return_value=image):
            figure = self.result.plot("stress")
        axes, bar = figure.axes
        self.assertEqual(axes.images[0].get_array().shape, (90, 120, 3))
        words = [text.get_text() for text in axes.texts]
        self.assertLessEqual({"x", "y", "z", "1"}, set(words))
        (line,) = axes.get_lines()
        self.assertAlmostEqual(np.ptp(line.get_xdata()) * 0.05, 1.0)
        self.assertEqual(bar.get_ylabel(), "von Mises stress [deck units]")
        mpl.pyplot.close(figure)

    def test_a_scene_is_what_is_there(self):
        scene = Bodies(self.result, Look(scale=0.0)).scene(-1, "pressure")
        self.assertAlmostEqual(volume(scene.polygons), 2.0)
        pressed = (scene.polygons[..., 2] == 0) & ~np.isnan(scene.values)
        np.testing.assert_allclose(scene.values[pressed], 30.0)
        self.assertTrue(np.isnan(scene.values[scene.polygons[..., 2] > 0]).all())
        self.assertEqual(len(scene.start), len(scene.outline))

    def test_screens(self):
        for direction in ((24, -58), (90, 0), (-90, 10), (0, 90)):
            eye = views.towards_the_eye(*direction)
            right, up = rendering.screen_axes(eye)
            np.testing.assert_allclose(np.cross(right, up), eye, atol=1e-12)
            self.assertGreaterEqual(up[2], -1e-12)

    def picture_of(self, polygons, values, view, obstacles=(), lines=()):
        """Return the Image of a scene, 240 by 180 pixels, and its colours."""
        none = np.zeros((0, 2, 3))
        scene = Scene(np.array(polygons, float), np.array(values, float),
                      np.array(lines, float).reshape(-1, 2, 3), none, none,
                      [np.array([pieces], float) for pieces in obstacles], none)
        eye = views.towards_the_eye(*view)
        camera = rendering.camera_on(scene.polygons.reshape(-1, 3), eye, (240, 180))
        norm, colours = mpl.colors.Normalize(0, 30), Bodies(self.result).colour_map("stress")
        return rendering.render_scene(scene, camera, norm, colours), camera, colours

    def test_a_cube_is_drawn_where_it_is(self):
        """Seen along x it is a square of the colour of its value, before a white ground."""
        bodies = Bodies(self.result, Look(scale=0.0, view=(0.0, 0.0)))
        scene = bodies.scene(-1, "stress")._replace(obstacles=[])
        camera = rendering.camera_on(scene.polygons.reshape(-1, 3), bodies.eye, (240, 180))
        norm, colours = mpl.colors.Normalize(0, 30), bodies.colour_map("stress")
        image = rendering.render_scene(scene, camera, norm, colours)
        self.assertEqual(image.pixels.shape, (180, 240, 3))
        drawn = (image.pixels < 250).any(axis=2)
        rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
        np.testing.assert_allclose([np.ptp(rows) * image.length, np.ptp(columns) * image.length],
                                   1.0, atol=3 * image.length)
        middle = image.pixels[90, 120] / 255
        expected = np.array(colours(1.0))[:3]
        np.testing.assert_allclose(middle, expected, atol=0.12)
        np.testing.assert_array_equal(image.pixels[2, 2], 255)

    def test_what_is_nearer_is_seen_in_any_order(self):
        """Two squares that cut each other: at each pixel the upper one, whichever comes first."""
        one = [(0, 0, 0), (2, 0, 2), (2, 1, 2), (0, 1, 0)]
        two = [(0, 0, 2), (2, 0, 0), (2, 1, 0), (0, 1, 2)]
        image, camera, colours = self.picture_of([one, two], [[0] * 4, [30] * 4], (90, 0))
        other, _, _ = self.picture_of([two, one], [[30] * 4, [0] * 4], (90, 0))
        np.testing.assert_array_equal(image.pixels, other.pixels)
        for place, value in (((0.5, 0.5, 1.5), 1.0), ((1.5, 0.5, 1.5), 0.0)):
            column, row, _ = (camera.seen(np.array(place)) / rendering.FINE).astype(int)
            colour = image.pixels[row, column] / 255
            np.testing.assert_allclose(colour / colour.max(),
                                       colours(value)[:3] / max(colours(value)[:3]), atol=0.02)

    def test_values_vary_over_a_face(self):
        """Half way between two values a pixel has the colour half way between theirs."""
        square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        image, camera, colours = self.picture_of([square], [[0, 30, 30, 0]], (90, 0))
        for x in (0.25, 0.5, 0.75):
            column, row, _ = (camera.seen(np.array([x, 0.5, 0])) / rendering.FINE).astype(int)
            colour = image.pixels[row, column] / 255
            np.testing.assert_allclose(colour / colour.max(),
                                       colours(x)[:3] / max(colours(x)[:3]), atol=0.02)

    def test_obstacles_and_lines(self):
        """What stands behind is hidden, what stands before is a veil; so with lines."""
        square = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
        above = [(1, 0, 1), (1, 2, 1), (2, 2, 1), (2, 0, 1)]  # seen from its back
        below = [(0, 0, -1), (2, 0, -1), (2, 2, -1), (0, 2, -1)]
        lines = [[(0.2, 1, 0), (0.9, 1, 0)], [(0.2, 0.5, -0.5), (0.9, 0.5, -0.5)]]
        bare, camera, _ = self.picture_of([square], [[15] * 4], (90, 0))
        image, _, _ = self.picture_of([square], [[15] * 4], (90, 0), (above, below), lines)

        def pixel(of, *place):
            column, row, _ = (camera.seen(np.array(place)) / rendering.FINE).astype(int)
            return of.pixels[row - 1 : row + 2, column].astype(int).reshape(-1)

        np.testing.assert_array_equal(pixel(image, 0.5, 1.5, 0), pixel(bare, 0.5, 1.5, 0))
        np.testing.assert_array_equal(pixel(image, 0.5, 0.5, 0), pixel(bare, 0.5, 0.5, 0))
        self.assertLess(pixel(image, 0.5, 1, 0).min(), 130)
        veiled = pixel(image, 1.5, 1.5, 0) / pixel(bare, 1.5, 1.5, 0)
        ground = 255 * np.array(mpl.colors.to_rgb(rendering.GROUND))
        share = rendering.VEIL
        plain = pixel(bare, 1.5, 1.5, 0)[:3]
        np.testing.assert_allclose(veiled[:3] * plain, (1 - share) * plain + share * ground,
                                   atol=0.1 * share * 255)


class Views(WithFolder):
    """The contact is seen."""

    def view_of(self, look=None, **options):
        path = self.folder / "view.vtkhdf"
        synthetic_result.write(path)
        with Result(path) as result:
            return Bodies(result, look, **options)

    def test_contact_below_is_seen_from_below(self):
        self.assertLess(self.view_of(apart=True).eye[2], 0)

    def test_bodies_are_seen_from_above(self):
        self.assertGreater(self.view_of().eye[2], 0)

    def test_a_view_that_is_asked_for(self):
        for apart in (False, True):
            bodies = self.view_of(Look(view=(90.0, 0.0)), apart=apart)
            np.testing.assert_allclose(bodies.eye, [0, 0, 1], atol=1e-12)

    def test_surfaces_turned_to_the_spectator_are_chosen(self):
        path = self.folder / "view.vtkhdf"
        synthetic_result.write(path)
        with Result(path) as result:
            surface = views.ContactFaces(result.pairs[0], result.points)
            for normal in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]):
                surface.normals = np.tile(np.array(normal, float), (len(surface.normals), 1))
                direction, _ = views.choose_direction([surface])
                self.assertGreater(views.towards_the_eye(*direction) @ normal, 0.3, normal)

    def test_bodies_are_counted(self):
        elements = np.array([np.arange(8), np.arange(4, 12), np.arange(12, 20)])
        body = views.components([elements], 20)
        self.assertEqual(body.tolist(), [0] * 12 + [1] * 8)


class Maps(WithFolder):
    """Where the points of a contact surface stand in its picture."""

    def ring(self):
        """Return the pair of a ring shrunk onto a hub."""
        result = bipot.run(ROOT / "input" / "press.inp", quiet=True)
        self.addCleanup(result.close)
        return result.pairs[0]

    def test_a_ring_is_unrolled(self):
        pair = self.ring()
        unrolled = Map(pair)
        self.assertEqual(unrolled.kind, "unrolled")
        x = pair.coordinates
        radius = np.hypot(x[:, 0], x[:, 1])
        self.assertLess(np.ptp(radius), 1e-3 * radius.max())
        # Lengths along the arc and along the axis are true.
        angle = np.arctan2(x[:, 1], x[:, 0])
        np.testing.assert_allclose(
            np.ptp(unrolled.places[:, 0]), radius.mean() * np.ptp(angle), rtol=1e-4
        )
        np.testing.assert_allclose(np.abs(unrolled.places[:, 1]), np.abs(x[:, 2]), atol=1e-12)
        sides = np.linalg.norm(unrolled.outlines - np.roll(unrolled.outlines, 1, axis=1), axis=2)
        true = pair.result.points[unrolled.faces]
        chords = np.linalg.norm(true - np.roll(true, 1, axis=1), axis=2)
        np.testing.assert_allclose(sides, chords, rtol=0.02)

    def test_a_flat_surface_is_seen_from_before_it(self):
        path = self.folder / "flat.vtkhdf"
        synthetic_result.write(path)
        with Result(path) as result:
            flat = Map(result.pairs[0])
            self.assertEqual(flat.kind, "flat")
            np.testing.assert_allclose(
                np.sort(np.abs(flat.places), axis=0),
                np.sort(np.abs(result.pairs[0].coordinates[:, :2]), axis=0), atol=1e-12,
            )

    def test_a_small_contact_fills_its_map(self):
        deck = bipot.Deck("A block under a ball", name="dent")
        deck.block("BODY", cells=(12, 12, 3), size=(2.0, 2.0, 0.5), corner=(-1.0, -1.0, -0.5))
        deck.material("M", young=1000.0, poisson=0.3)
        deck.section("M", "BODY")
        deck.sphere("BALL", centre=(0.5, 0.0, 1.0), radius=1.0)
        deck.interaction("DRY", friction=0.2)
        deck.pair("BODY-ZMAX", "BALL", "DRY")
        with deck.step():
            deck.boundary("BODY-ZMAX", 1, 2)
            deck.boundary("BODY-ZMIN", 1, 2)
            deck.boundary("BODY-ZMIN", 3, value=0.02)
        with bipot.run(deck, directory=self.folder, quiet=True) as result:
            pair = result.pairs[0]
            seen = Map(pair)
            touching = pair.status[-1] > 0
            self.assertLess(touching.sum(), 0.2 * len(touching))
            self.assertGreater(touching.sum(), 1)
            self.assertTrue(seen.inside[touching].all())
            # The picture is of the contact, and says so.
            self.assertLess(2 * seen.half.max(), 0.8 * np.ptp(seen.places[:, 0]))
            np.testing.assert_allclose(
                seen.middle, [0.5, 0.0], atol=0.5 * seen.half.max()
            )
            self.assertIn("near the contact", seen.words())
            arrows = np.isin(np.flatnonzero(touching), seen.with_arrow)
            self.assertGreater(arrows.sum(), 1)


class TimeAxes(WithFolder):
    """Histories are drawn over the time of the run, and legends stand beside them."""

    def setUp(self):
        super().setUp()
        self.path = self.folder / "small.vtkhdf"
        synthetic_result.write(self.path, finished=5, field_increments=[0])
        self.result = Result(self.path)
        self.addCleanup(self.result.close)

    def test_lines_stand_over_the_time(self):
        times = self.result.history("time")
        for figure in (draw_forces(self.result, self.result.pairs[0]), draw_errors(self.result)):
            lines = [line for axes in figure.axes for line in axes.get_lines()
                     if len(line.get_xdata()) == len(times)]
            self.assertTrue(lines)
            for line in lines:
                np.testing.assert_array_equal(line.get_xdata(), times)
            self.assertIn("time", figure.axes[-1].get_xlabel())
            mpl.pyplot.close(figure)

    def test_errors_that_are_none_have_no_curve(self):
        figure = draw_errors(self.result)
        legend = figure.axes[0].get_legend()
        self.assertEqual([text.get_text() for text in legend.get_texts()], ["equilibrium"])
        (said,) = (text.get_text() for text in figure.axes[0].texts)
        self.assertEqual(said, "0: adhesion, complementarity, cone, law, penetration")
        mpl.pyplot.close(figure)

    def test_legends_cover_no_axes(self):
        for figure in (draw_forces(self.result, self.result.pairs[0]), draw_errors(self.result)):
            figure.canvas.draw()
            found = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
            self.assertTrue(found)
            for legend in found:
                box = legend.get_window_extent()
                for axes in figure.axes:
                    self.assertFalse(box.overlaps(axes.get_window_extent()))
            mpl.pyplot.close(figure)


class Accuracy(WithFolder):
    """What led to an accuracy, and where the mesh is still wrong."""

    def test_runs_stand_over_the_time_that_they_took(self):
        deck = self.folder / "block.inp"
        text = (ROOT / "input" / "block.inp").read_text()
        deck.write_text(text.replace("*END STEP", "*EL FILE\nS, ERR\n*END STEP"))
        with bipot.run(deck, accuracy=0.1, nlgeom="no", steps=5, solver="AUTO", local="AUTO",
                       quiet=True) as result:  # fmt: skip
            sequence = result.accuracy
            axes = result.plot("accuracy").axes[0]
            lines = {line.get_label(): line for line in axes.lines}
            pressing, friction = (lines[f"BODY-ZMIN:GROUND/{name}_force"]
                                  for name in ("pressing", "friction"))  # fmt: skip
            np.testing.assert_allclose(pressing.get_xdata(), np.cumsum(sequence.processor_time))
            column = sequence.names.index("BODY-ZMIN:GROUND/pressing_force")
            apart = abs(sequence.values - sequence.extrapolated)[:, :, column].max(axis=1)
            np.testing.assert_allclose(pressing.get_ydata(), apart / sequence.scale[column])
            # A vector is one line, as far away as its components together.
            columns = [sequence.names.index(f"BODY-ZMIN:GROUND/friction_force_{x}") for x in "xyz"]
            apart = (sequence.values - sequence.extrapolated)[:, :, columns]
            apart = np.linalg.norm(apart, axis=2).max(axis=1) / sequence.scale[columns[0]]
            np.testing.assert_allclose(friction.get_ydata(), apart)
            self.assertEqual(len([t for t in axes.texts if t.get_text()]), len(sequence))
            self.assertEqual(len(result.plot("mesh_error").axes), 2)
            errors = result.field("mesh_error", -1, on="elements")
            bodies = Bodies(result)
            drawn = bodies.face_values(-1, "mesh_error")
            np.testing.assert_array_equal(drawn[:, 0], errors[bodies.face_element])
            self.assertGreater(drawn.max(), 0)

    def test_where_none_was_asked_for(self):
        with bipot.run(ROOT / "input" / "block.inp", n=1, steps=5, quiet=True) as result:
            with self.assertRaisesRegex(bipot.ResultError, "no accuracy was asked for"):
                result.plot("accuracy")


class Geometry(unittest.TestCase):
    def test_rotation_of_a_quarter_turn(self):
        turn = rotation_matrix(np.array([0, 0, np.pi / 2]))
        np.testing.assert_allclose(turn @ [1, 0, 0], [0, 1, 0], atol=1e-15)

    def test_a_polygon_is_cut_at_a_box(self):
        square = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], float)
        cut = clip(square, np.full(3, -1.0), np.array([1.0, 3.0, 1.0]))
        self.assertEqual((cut.min(axis=0).tolist(), cut.max(axis=0).tolist()),
                         ([-1, -1, 0], [1, 2, 0]))
        self.assertEqual(len(clip(square + np.array([0, 0, 5]), np.full(3, -1.0), np.ones(3))), 0)


class Window(WithFolder):
    """scripts/show --interactive."""

    def setUp(self):
        super().setUp()
        synthetic_result.write(self.folder / "small.vtkhdf")

    def show(self, **environment):
        kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        return subprocess.run(
            [sys.executable, ROOT / "scripts" / "show", "small.vtkhdf", "--interactive"],
            capture_output=True, text=True, env={**kept, **environment}, check=False,
        )

    def test_it_says_what_is_missing(self):
        # A folder that hides PyVista, wherever it is installed.
        hidden = self.folder / "hidden"
        hidden.mkdir()
        (hidden / "pyvista.py").write_text("raise ImportError('hidden')\n")
        done = self.show(PYTHONPATH=str(hidden))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^show: --interactive needs pyvista: pip install pyvista")
        (hidden / "pyvista.py").write_text("")
        done = self.show(PYTHONPATH=str(hidden))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^show: --interactive needs a display, .*DISPLAY")

    @needs("pyvista")
    def test_the_scene_has_bodies_and_obstacles(self):
        from bipot.drawing.interactive import make_plotter

        with bipot.run(ROOT / "input" / "block.inp", n=1, steps=10, quiet=True) as result:
            plotter = make_plotter(result, off_screen=True)
            self.assertLessEqual({"bodies", "obstacle GROUND"}, set(plotter.actors))
            bounds = np.array(plotter.actors["obstacle GROUND"].bounds)
            np.testing.assert_allclose(bounds[4:], 0, atol=1e-12)
            plotter.close()


if __name__ == "__main__":
    unittest.main()
