"""Outer faces of any mesh, as pictures draw them: of second order split between all nodes."""

import unittest

import matplotlib as mpl
import numpy as np
from boxes import Box
from program import Run
from test_gauss_points import FIELDS, clamped

from bipot.element_faces import face_normals

mpl.use("Agg")
MESHES = (
    ("C3D8",), ("C3D4",), ("C3D6",), ("C3D5",), ("C3D10",), ("C3D15",), ("C3D20",), ("C3D20R",),
    ("C3D8", "C3D6"), ("C3D20", "C3D15"), ("C3D8", "join", "C3D4"),
)  # fmt: skip


class OuterFaces(unittest.TestCase):
    def solve(self, kinds, cards=FIELDS):
        run = Run(clamped(Box("B", (3, 2, 2), kinds, size=(3, 2, 1)), cards), name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        return result

    def test_pieces_cover_the_box_once_and_face_outwards(self):
        for kinds in MESHES:
            with self.subTest(kinds=kinds):
                result = self.solve(kinds)
                faces, elements = result.boundary
                x = result.points[faces]
                diagonals = x[:, 2:] - x[:, :2]
                area = np.linalg.norm(np.cross(diagonals[:, 0], diagonals[:, 1]), axis=1) / 2
                self.assertAlmostEqual(area.sum(), 22.0, delta=1e-9)
                out = np.einsum("fx,fx->f", face_normals(x), x.mean(axis=1) - [1.5, 1, 0.5])
                self.assertGreater(out.min(), 0)
                # Each piece lies on its element, and all nodes of the surface are used.
                cells = {
                    row: set(nodes.tolist())
                    for rows, block in result.cells.values()
                    for row, nodes in zip(rows, block, strict=True)
                }
                self.assertTrue(all(
                    set(face) <= cells[e] for face, e in zip(faces.tolist(), elements, strict=True)
                ))
                surface = (abs(result.points - [1.5, 1, 0.5]) > np.array([1.5, 1, 0.5]) - 1e-9)
                np.testing.assert_array_equal(
                    np.unique(faces), np.flatnonzero(surface.any(axis=1))
                )

    def test_lines_are_edges_of_elements(self):
        """From one corner to a mid-side node, or to another corner; each on two faces."""
        for kinds, parts in ((("C3D8",), 1), (("C3D20",), 2), (("C3D20R",), 2)):
            with self.subTest(kinds=kinds):
                result = self.solve(kinds)
                faces, _ = result.boundary
                ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
                lines = np.sort(ends[result.boundary_edges], axis=1)
                unique, count = np.unique(lines, axis=0, return_counts=True)
                self.assertEqual(set(count.tolist()), {2})
                # Of 3 x 2 x 2 hexahedra: 32 quadrilaterals have 64 edges.
                self.assertEqual(len(unique), 64 * parts)

    def test_every_mesh_is_drawn(self):
        for kinds in (("C3D10",), ("C3D20", "C3D15"), ("C3D8", "join", "C3D4")):
            with self.subTest(kinds=kinds):
                figure = self.solve(kinds).plot("stress")
                figure.canvas.draw()


if __name__ == "__main__":
    unittest.main()
