"""VTK reads cells of every type, of second order too, and several types in one mesh."""

import os
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from boxes import VTK_TYPES, Box
from program import Run
from test_gauss_points import FIELDS, clamped
from test_vtk_reads_result import MISSING, MISSING_XDMF, fields_of, need, times_of

if not MISSING:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
    from vtkmodules.vtkIOHDF import vtkHDFReader
if not MISSING_XDMF:
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

MESHES = (
    ("C3D4",), ("C3D6",), ("C3D5",), ("C3D10",), ("C3D15",), ("C3D20",), ("C3D20R",),
    ("C3D8", "C3D6"), ("C3D20", "C3D15"), ("C3D8", "join", "C3D4"), ("C3D13",),
)  # fmt: skip


class Cells(unittest.TestCase):
    def grids(self, kinds):
        """Yield the last increment of a box as each of VTK's readers makes it, and its result."""
        box = Box("B", (3, 2, 2), kinds)
        run = Run(clamped(box, FIELDS), name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        need(MISSING)
        readers = [(vtkHDFReader, "deck.vtkhdf")]
        need(MISSING_XDMF)
        readers.append((vtkXdmfReader, "deck.xdmf"))
        for reader_type, name in readers:
            reader = reader_type()
            reader.SetFileName(os.fspath(run.folder / name))
            reader.UpdateTimeStep(times_of(reader)[-1])
            yield box, reader.GetOutputDataObject(0), result

    def test_cells_fill_the_box(self):
        for kinds in MESHES:
            for box, grid, result in self.grids(kinds):
                with self.subTest(kinds=kinds, grid=grid.GetClassName()):
                    types = [VTK_TYPES[kind] for kind, cells in box.elements.items() for _ in cells]
                    found = [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())]
                    self.assertEqual(found, types)
                    # Nodes in the order of the cell: none is inside out, all of them fill the box.
                    sizes = vtkCellSizeFilter()
                    sizes.SetInputData(grid)
                    sizes.Update()
                    volume = vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Volume"))
                    self.assertGreater(volume.min(), 0)
                    self.assertAlmostEqual(volume.sum(), 1.0, delta=1e-3)  # warped faces in parts
                    fields = fields_of(grid)
                    np.testing.assert_array_equal(
                        fields["PointData", "displacement"], result.field("displacement")
                    )
                    np.testing.assert_array_equal(
                        fields["CellData", "von_mises"].ravel(),
                        result.field("von_mises", on="elements"),
                    )


if __name__ == "__main__":
    unittest.main()
