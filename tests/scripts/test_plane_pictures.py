"""Pictures of elements of a plane: from the front, contact over the length of the surface."""

import sys
import unittest
from pathlib import Path

try:
    import matplotlib as mpl
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

from bipot.drawing import rendering  # noqa: E402
from bipot.drawing.bodies import Bodies, Look  # noqa: E402
from bipot.drawing.curves import draw_pressures, draw_states  # noqa: E402
from bipot.drawing.skin import crossings  # noqa: E402
from bipot.pictures import pictures_of  # noqa: E402
from package import WithFolder, bipot  # noqa: E402

mpl.use("Agg")
rendering.DPI = 40  # pixels take time, and what is seen does not depend on them

DECK = """\
*HEADING
two elements, pressed onto a plane
*NODE
1, {r}., 0.
2, {r}.5, 0.
3, {r}.8, 0.
4, {r}., 0.4
5, {r}.5, 0.4
6, {r}.8, 0.4
*NSET, NSET=TOP
4, 5, 6
*ELEMENT, TYPE={kind}, ELSET=BODY
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*MATERIAL, NAME=STEEL
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*SURFACE, NAME=BELOW
1, S1
2, S1
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 1., 0.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
BELOW, FLOOR
*STEP, INC=3
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
TOP, 1
TOP, 2, 2, -0.01
*NODE FILE
U
*END STEP
"""


class Plane(WithFolder):
    """A slice of plane strain, and a wedge of a body of revolution."""

    def result_of(self, kind, radius):
        (self.folder / "plane.inp").write_text(DECK.format(kind=kind, r=radius))
        result = bipot.run("plane.inp", quiet=True, overwrite=True)
        self.addCleanup(result.close)
        return result

    def test_lines_of_the_surface_and_pictures(self):
        for kind, radius, bodies in (("CPE4", 0, "slice"), ("CAX4", 3, "wedge")):
            with self.subTest(kind=kind):
                result = self.result_of(kind, radius)
                self.assertEqual(result.run["bodies"], bodies)
                self.assertTrue(result.is_plane)
                pair = result.pairs[0]
                ((points, distance),) = pair.lines
                ids = result.node_ids[pair.nodes[points]]
                np.testing.assert_array_equal(ids, [1, 2, 3])
                np.testing.assert_allclose(distance, [0, 0.5, 0.8])
                figure = draw_pressures(result, -1)
                (line,) = figure.axes[0].get_lines()
                np.testing.assert_allclose(line.get_xdata(), distance)
                np.testing.assert_allclose(line.get_ydata(), pair.pressure[-1, points])
                self.assertGreater(line.get_ydata().min(), 5.0)
                figure = draw_states(result, pair)
                counts = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
                self.assertEqual(sum(int(words.split("(")[1].split()[0]) for words in counts), 3)
                shown = Bodies(result)
                np.testing.assert_allclose(shown.eye, [0, 0, 1], atol=1e-12)
                scene = shown.scene(-1, "displacement")
                self.assertGreater(len(scene.edges), 0)
                self.assertFalse(scene.obstacles)
                names = []
                for picture in pictures_of(result):
                    names.append(picture.name)
                    mpl.pyplot.close(picture.figure)
                self.assertEqual(names, ["deformed", "pressure", "contact", "forces", "errors"])
                mpl.pyplot.close("all")

    def test_obstacles_are_lines(self):
        """A wall around the axis is seen where the plane crosses it, at its radius."""
        angle = np.radians(np.arange(-95, 96, 10))
        ring = np.stack([2 * np.cos(angle), np.zeros_like(angle), 2 * np.sin(angle)], axis=1)
        up = ring + np.array([0, 3, 0])
        wall = np.stack([ring[:-1], ring[1:], up[1:], up[:-1]], axis=1)
        lines = crossings(wall, 2, 0.0)
        self.assertEqual(lines.shape, (1, 2, 3))
        np.testing.assert_allclose(lines[..., 0], 2, rtol=0.01)
        np.testing.assert_allclose(np.sort(lines[0, :, 1]), [0, 3])
        np.testing.assert_allclose(lines[..., 2], 0, atol=1e-12)

    def test_a_turned_section_encloses_its_body(self):
        result = self.result_of("CAX4", 3)
        for turn in (270.0, 90.0):
            with self.subTest(turn=turn):
                bodies = Bodies(result, Look(scale=1e-9, turn=turn))
                scene = bodies.scene(-1, "displacement")
                volume = 0.0
                for a, b, c in ((0, 1, 2), (0, 2, 3)):
                    corners = scene.polygons[:, [a, b, c]]
                    volume += np.linalg.det(corners).sum() / 6
                # 0.8 by 0.4, its middle at the radius 3.4; chords of 5 degrees enclose less.
                chords = np.sin(np.radians(5)) / np.radians(5)
                pappus = np.radians(turn) * 3.4 * 0.8 * 0.4 * chords
                self.assertAlmostEqual(volume / pappus, 1.0, delta=1e-6)
                self.assertEqual(len(scene.start), 0)
                self.assertLess(np.abs(scene.outline[..., 2]).max(), 0.4 + 1e-6)
                self.assertIn(f"turned by {turn:g} degrees", bodies.words())
                figure = result.plot("displacement", turn=turn)
                mpl.pyplot.close(figure)

    def test_what_cannot_be_turned_is_refused(self):
        for result, look, words in (
            (self.result_of("CPE4", 0), Look(turn=270.0), "only sections of bodies of revolution"),
            (self.result_of("CAX4", 3), Look(turn=400.0), "up to 360 degrees"),
            (self.result_of("CAX4", 3), Look(turn=90.0, clip=(0, None)), "is not cut as well"),
        ):
            with self.subTest(words=words), self.assertRaisesRegex(bipot.ResultError, words):
                Bodies(result, look)

    def test_solids_are_none(self):
        result = self.run_block()
        self.assertEqual(result.run["bodies"], "solid")
        self.assertFalse(result.is_plane)


if __name__ == "__main__":
    unittest.main()
