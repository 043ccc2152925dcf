"""VTK shows the increments of a result file as h5py reads them, and so does the XDMF sidecar.

Environment: BIPOT, the executable; BIPOT_FORBID_SKIPS=1 makes a missing VTK a failure.
"""

import csv
import os
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import numpy as np

DECK = Path(__file__).resolve().parents[2] / "input" / "block.inp"
STEPS = 10
COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")

try:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOHDF import vtkHDFReader

    MISSING = None
except ImportError as problem:
    MISSING = f"VTK with its HDF reader is not installed: {problem}"

try:
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

    MISSING_XDMF = MISSING
except ImportError as problem:
    MISSING_XDMF = f"VTK with its XDMF reader is not installed: {problem}"


def need(missing):
    """Skip the test, or fail it where skips are forbidden, when something is missing."""
    if missing and os.environ.get("BIPOT_FORBID_SKIPS") == "1":
        raise AssertionError(missing)
    if missing:
        raise unittest.SkipTest(missing)


def fields_of(grid):
    """The arrays that a VTK data set carries, by group and name."""
    found = {}
    for group, data in (("PointData", grid.GetPointData()), ("CellData", grid.GetCellData())):
        for i in range(data.GetNumberOfArrays()):
            array = data.GetArray(i)
            found[group, array.GetName()] = vtk_to_numpy(array)
    return found


def times_of(reader):
    """The times that a VTK reader offers."""
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    return np.array(information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()))


class ResultFile(unittest.TestCase):
    """One run of the paper's block, read in several ways."""

    options = ()
    point_fields = frozenset(
        {"displacement", "reaction_force", "node_id"}
        | {"contact_force", "contact_pressure", "contact_status"}
    )
    cell_fields = frozenset({"element_id"})

    @classmethod
    def deck(cls):
        """The deck, in a file called block.inp."""
        return DECK

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        command = [os.environ["BIPOT"], cls.deck(), "--set", "n=2", "--set", f"steps={STEPS}"]
        command += ["--quiet", *cls.options]
        run = subprocess.run(command, cwd=cls.folder.name, capture_output=True, text=True)
        if run.returncode != 0:
            raise AssertionError(f"the run ended with {run.returncode}:\n{run.stdout}{run.stderr}")
        cls.path = Path(cls.folder.name) / "block.vtkhdf"
        cls.sidecar = cls.path.with_suffix(".xdmf")
        cls.file = h5py.File(cls.path, "r")
        cls.addClassCleanup(cls.file.close)
        cls.vtkhdf = cls.file["VTKHDF"]
        cls.n_steps = int(cls.vtkhdf["Steps"].attrs["NSteps"])

    def block(self, group, name, step):
        """The block of a field that belongs to a step, by its offset."""
        n = int(self.vtkhdf[{"PointData": "NumberOfPoints", "CellData": "NumberOfCells"}[group]][0])
        start = int(self.vtkhdf["Steps"][group + "Offsets"][name][step])
        return self.vtkhdf[group][name][start : start + n]

    def names(self):
        """Group and name of every field."""
        return {(g, name) for g in ("PointData", "CellData") for name in self.vtkhdf[g]}

    def assert_fields(self, found, step, names):
        """The arrays found are exactly the named fields of a step."""
        for group, name in [key for key in found if key[1].endswith("_XX")]:
            # XDMF has no fit type for our six components.
            parts = [found.pop((group, name[:-2] + part)) for part in COMPONENTS]
            found[group, name[:-3]] = np.stack([part.ravel() for part in parts], axis=1)
        self.assertEqual(set(found), names)
        for (group, name), values in found.items():
            with self.subTest(step=step, field=name):
                np.testing.assert_array_equal(values, self.block(group, name, step))

    def test_every_increment_is_there(self):
        self.assertEqual(self.n_steps, STEPS)
        self.assertEqual(self.file["history"].attrs["finished"], STEPS)
        self.assertEqual(self.file["run"].attrs["status"], b"finished")
        values = self.vtkhdf["Steps/Values"][: self.n_steps]
        np.testing.assert_array_equal(values, self.file["history/time"][:STEPS])
        self.assertTrue(np.all(np.diff(values) > 0))

    def test_fields_are_those_asked_for(self):
        self.assertEqual(set(self.vtkhdf["PointData"]), self.point_fields)
        self.assertEqual(set(self.vtkhdf["CellData"]), self.cell_fields)

    def test_every_dataset_is_described(self):
        def look(name, item):
            if isinstance(item, h5py.Dataset):
                self.assertIn("description", item.attrs, name)
                self.assertIn("quantity", item.attrs, name)

        self.file.visititems(look)

    def test_contact_forces_sum_to_the_resultant(self):
        (pair,) = self.file["contact"].values()
        for step in range(self.n_steps):
            total = self.block("PointData", "contact_force", step).sum(axis=0)
            np.testing.assert_allclose(total, pair["resultant"][step], rtol=1e-12, atol=1e-9)

    def test_points_are_nodes_of_the_mesh(self):
        (pair,) = self.file["contact"].values()
        points = self.vtkhdf["Points"][:]
        np.testing.assert_array_equal(pair["coordinates"][:], points[pair["node"][:]])

    def test_vtk_reads_every_step(self):
        need(MISSING)
        reader = vtkHDFReader()
        reader.SetFileName(str(self.path))
        times = times_of(reader)
        np.testing.assert_array_equal(times, self.vtkhdf["Steps/Values"][: self.n_steps])
        # Forwards, backwards and the ends: the reader caches.
        for step in (0, 1, self.n_steps - 1, self.n_steps // 2, 0):
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutput()
            points = vtk_to_numpy(grid.GetPoints().GetData())
            np.testing.assert_array_equal(points, self.vtkhdf["Points"][:])
            connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
            np.testing.assert_array_equal(connectivity, self.vtkhdf["Connectivity"][:])
            self.assertEqual(grid.GetNumberOfCells(), self.vtkhdf["NumberOfCells"][0])
            self.assertEqual(grid.GetCellType(0), 12)
            self.assert_fields(fields_of(grid), step, self.names())

    def test_xdmf_names_the_right_blocks(self):
        steps = ElementTree.parse(self.sidecar).getroot().findall("Domain/Grid/Grid")
        self.assertEqual(len(steps), self.n_steps)
        for step, grid in enumerate(steps):
            time = float(grid.find("Time").get("Value"))
            self.assertEqual(time, self.vtkhdf["Steps/Values"][step])
            found = {}
            for attribute in grid.findall("Attribute"):
                group = {"Node": "PointData", "Cell": "CellData"}[attribute.get("Center")]
                found[group, attribute.get("Name")] = self.evaluate(attribute.find("DataItem"))
            self.assert_fields(found, step, self.names())
            points = self.evaluate(grid.find("Geometry/DataItem"))
            np.testing.assert_array_equal(points, self.vtkhdf["Points"][:])

    def evaluate(self, item):
        """What a DataItem stands for; a selection is written twice, for two readers."""
        extents = [int(n) for n in item.get("Dimensions").split()]
        name, path = item.text.strip().split(":", 1)
        self.assertEqual(name, self.path.name)
        if item.get("Type") == "HyperSlab":
            selection, source = item.findall("DataItem")
            start, stride, count = np.array(selection.text.split(), int).reshape(3, -1)
            self.assertEqual(list(count), extents)
            path, inline = path.split("|")
            numbers = [[int(n) for n in part.split()] for part in inline.split(":")]
            whole = [int(n) for n in source.get("Dimensions").split()]
            self.assertEqual(numbers, [list(start), list(stride), list(count), whole])
            self.assertEqual(source.text, f"{name}:{path}")
            cut = tuple(slice(a, a + n) for a, n in zip(start, count, strict=True))
            return self.evaluate(source)[cut]
        values = self.file[path]
        self.assertEqual(int(item.get("Precision")), values.dtype.itemsize)
        return values[:].reshape(extents)

    def test_vtk_reads_xdmf(self):
        need(MISSING_XDMF)
        reader = vtkXdmfReader()
        reader.SetFileName(str(self.sidecar))
        times = times_of(reader)
        np.testing.assert_array_equal(times, self.vtkhdf["Steps/Values"][: self.n_steps])
        for step in (0, self.n_steps - 1, self.n_steps // 2):
            reader.UpdateTimeStep(times[step])
            self.assert_fields(fields_of(reader.GetOutputDataObject(0)), step, self.names())


class Tensors(ResultFile):
    """The same with C3D8I, and with stress and strain wherever they can be."""

    options = ("--set", "element=C3D8I", "--set", "nu=0.3")
    point_fields = ResultFile.point_fields | {"stress", "strain", "von_mises"}
    cell_fields = ResultFile.cell_fields | {"stress", "strain", "von_mises"}
    cards = """*NODE FILE
U, RF
*CONTACT FILE
CDIS
*EL FILE, POSITION=CENTROIDAL
S, E
*EL FILE, POSITION=AVERAGED AT NODES
S, E
*EL FILE, POSITION=INTEGRATION POINTS
S, E
*END STEP"""

    @classmethod
    def deck(cls):
        """The block's deck, its steps asking for tensors."""
        path = Path(cls.folder.name) / "block.inp"
        path.write_text(DECK.read_text().replace("*END STEP", cls.cards, 1))
        return path

    def tensor(self, group, name, step):
        """A block of a field as tensors, component last."""
        if group == "gauss":
            return self.file["gauss/C3D8I"][name][step].reshape(-1, 6)
        return self.block(group, name, step)

    def test_stress_follows_from_strain(self):
        """Hooke's law with E = 210000, nu = 0.3, and shear strains as tensor components."""
        lame, shear = 210000 * 0.3 / (1.3 * 0.4), 210000 / 2.6
        for group in ("CellData", "PointData", "gauss"):
            strain = self.tensor(group, "strain", STEPS - 1)
            expected = 2 * shear * strain
            expected[:, :3] += lame * strain[:, :3].sum(axis=1, keepdims=True)
            stress = self.tensor(group, "stress", STEPS - 1)
            np.testing.assert_allclose(stress, expected, rtol=1e-12, atol=1e-8)

    def test_centroids_are_means_of_gauss_points(self):
        at_points = self.file["gauss/C3D8I/stress"][2]
        mean = self.block("CellData", "stress", 2)
        np.testing.assert_allclose(at_points.mean(axis=1), mean, rtol=1e-12, atol=1e-8)

    def test_gauss_points_are_placed_like_nodes(self):
        """On a box, trilinear through the Gauss points gives the nodes, averaged over elements."""
        values = self.file["gauss/C3D8I/stress"][STEPS - 1]
        nodes = self.vtkhdf["Connectivity"][:].reshape(-1, 8)
        points = self.vtkhdf["Points"][:]
        corner = np.sign(points[nodes] - points[nodes].mean(axis=1, keepdims=True))
        weight = np.prod(1 + np.sqrt(3) * corner[:, :, None, :] * corner[:, None, :, :], axis=3) / 8
        total, count = np.zeros((len(points), 6)), np.zeros((len(points), 1))
        np.add.at(total, nodes, weight @ values)
        np.add.at(count, nodes, 1)
        found = self.block("PointData", "stress", STEPS - 1)
        np.testing.assert_allclose(found, total / count, rtol=1e-12, atol=1e-8)

class ReferenceNodes(ResultFile):
    """A far tool, a grip and a node of an equation: no reader of the mesh sees their nodes."""

    # Nodes without elements stand before, between and behind those of the two elements.
    DECK = """*NODE
900, 50., 50., 90.
1, 0., 0., 0.
2, 1., 0., 0.
3, 0., 1., 0.
4, 1., 1., 0.
901, -70., 0.5, 1.
5, 0., 0., 1.
6, 1., 0., 1.
7, 0., 1., 1.
8, 1., 1., 1.
902, 0.5, 0.5, -80.
11, 0., 0., 2.
12, 1., 0., 2.
13, 0., 1., 2.
14, 1., 1., 2.
903, 40., 0., 0.
*ELEMENT, TYPE=C3D8, ELSET=B
1, 1, 2, 4, 3, 5, 6, 8, 7
2, 5, 6, 8, 7, 11, 12, 14, 13
*NSET, NSET=TOP
11, 12, 13, 14
*NSET, NSET=MIDDLE
5, 6, 7, 8
*NSET, NSET=GRIPPED
1, 2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*NSET, NSET=SOME
900, 901, 902, 903, 14
*OBSTACLE, NAME=O, TYPE=PLANE, REF NODE=900
0., 0., 2.,  0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
TOP, O
*COUPLING, REF NODE=902, SURFACE=GRIPPED
*KINEMATIC
*EQUATION
3
6, 1, 1., 5, 1, -1., 903, 1, -1.
*STEP
*STATIC, DIRECT
<1/steps>, 1.
*BOUNDARY
902, 1, 6
900, 1, 1, 0.03
900, 2, 2
903, 1, 1, 0.02
*CLOAD
900, 3, -7.
*NODE PRINT, NSET=SOME
U, RF
*END STEP
"""
    OUTSIDE = frozenset({900, 902, 903})

    @classmethod
    def deck(cls):
        """The deck, in a file called block.inp, with the parameters that the command sets."""
        path = Path(cls.folder.name) / "block.inp"
        path.write_text("*PARAMETER\nn = 1\nsteps = 1\n" + cls.DECK)
        return path

    def of_node(self, name, number):
        """What a reference node has in every increment."""
        nodes = self.file["reference_nodes"]
        (at,) = np.flatnonzero(nodes["node_id"][:] == number)
        return nodes[name][:STEPS, at]

    def test_the_mesh_holds_the_nodes_of_elements_in_their_order(self):
        ids = self.vtkhdf["PointData/node_id"][:]
        self.assertEqual(ids.tolist(), [*range(1, 9), *range(11, 15)])
        points = self.vtkhdf["Points"][:]
        self.assertEqual(len(points), 12)
        np.testing.assert_array_equal(points[ids == 14], [[1, 1, 2]])
        elements = ids[self.vtkhdf["Connectivity"][:]].reshape(-1, 8)
        self.assertEqual(
            elements.tolist(), [[1, 2, 4, 3, 5, 6, 8, 7], [5, 6, 8, 7, 11, 12, 14, 13]]
        )
        # Slave nodes and the node with the largest residual are rows of these points.
        (pair,) = self.file["contact"].values()
        self.assertEqual(ids[pair["node"][:]].tolist(), [11, 12, 13, 14])
        worst = self.file["history/worst_node"][:STEPS]
        self.assertTrue(set(ids[worst[worst >= 0]].tolist()) <= {11, 12, 13, 14})

    def test_reference_nodes_are_beside_it(self):
        nodes = self.file["reference_nodes"]
        # An unused node is noted and has no place; 901 is one.
        self.assertEqual(nodes["node_id"][:].tolist(), sorted(self.OUTSIDE))
        np.testing.assert_array_equal(
            nodes["coordinates"][:], [[50, 50, 90], [0.5, 0.5, -80], [40, 0, 0]]
        )
        self.assertIn("1 of 16 nodes belong to no element", str(self.file["run/notes"][()]))
        (pair,) = self.file["contact"].values()
        self.assertEqual(nodes["node_id"][:][pair["obstacle_node"][0]], 900)

    def test_motions_are_those_prescribed(self):
        time = self.file["history/time"][:STEPS]
        way = self.of_node("displacement", 900)
        np.testing.assert_allclose(way[:, 0], 0.03 * time, rtol=1e-14)
        np.testing.assert_array_equal(way[:, 1], 0)
        self.assertTrue((np.diff(way[:, 2]) < 0).all())
        np.testing.assert_array_equal(self.of_node("displacement", 902), 0)
        np.testing.assert_array_equal(self.of_node("rotation", 902), 0)
        # The equation: so far two nodes of the element part.
        says = self.of_node("displacement", 903)
        np.testing.assert_allclose(says[:, 0], 0.02 * time, rtol=1e-14)
        np.testing.assert_array_equal(says[:, 1:], 0)
        ids, u = self.vtkhdf["PointData/node_id"][:], self.block("PointData", "displacement", 3)
        np.testing.assert_allclose(u[ids == 6, 0] - u[ids == 5, 0], says[3, 0], rtol=1e-12)

    def test_forces_are_those_of_loads_and_supports(self):
        time = self.file["history/time"][:STEPS]
        (pair,) = self.file["contact"].values()
        # The tool presses with its load, and what drives it along x is the friction.
        np.testing.assert_allclose(pair["resultant"][:STEPS, 2], -7 * time, rtol=1e-8)
        drive = self.of_node("reaction_force", 900)
        np.testing.assert_array_equal(drive[:, 2], 0)
        np.testing.assert_allclose(drive[:, 0], pair["resultant"][:STEPS, 0], rtol=1e-8)
        self.assertGreater(drive[-1, 0], 0.1)
        # It takes a force to part two nodes of an elastic body.
        self.assertGreater(self.of_node("reaction_force", 903)[-1, 0], 0.1)
        # The grip holds the body: action is reaction, and about its node moments balance.
        np.testing.assert_allclose(
            self.of_node("reaction_force", 902), -pair["resultant"][:STEPS], atol=1e-8
        )
        x = self.vtkhdf["Points"][:]
        for step in range(STEPS):
            force = self.block("PointData", "contact_force", step)
            moment = np.cross(x - [0.5, 0.5, -80], force).sum(axis=0)
            held = self.of_node("reaction_moment", 902)[step]
            self.assertLess(np.abs(held + moment).max(), 1e-7)

    def test_bounds_are_those_of_the_body(self):
        need(MISSING)
        reader = vtkHDFReader()
        reader.SetFileName(str(self.path))
        for step in (0, STEPS - 1):
            reader.UpdateInformation()
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutput()
            self.assertEqual(grid.GetBounds(), (0, 1, 0, 1, 0, 2))
            moved = self.block("PointData", "displacement", step)[:, 0]
            found = [0.0, 0.0]
            self.assertTrue(grid.GetPointData().GetRange("displacement", found, 0))
            self.assertEqual(found, [moved.min(), moved.max()])

    def test_xdmf_bounds_are_those_of_the_body(self):
        need(MISSING_XDMF)
        reader = vtkXdmfReader()
        reader.SetFileName(str(self.sidecar))
        reader.UpdateInformation()
        reader.Update()
        self.assertEqual(reader.GetOutputDataObject(0).GetBounds(), (0, 1, 0, 1, 0, 2))

    def test_tables_of_sets_list_reference_nodes_too(self):
        with self.path.with_suffix(".node.csv").open(newline="") as table:
            lines = list(csv.DictReader(table))
        self.assertEqual(len(lines), 5 * STEPS)
        ids = self.vtkhdf["PointData/node_id"][:]
        for title, name, unit in (("displacement", "displacement", "length"),
                                  ("reaction force", "reaction_force", "force")):
            for number in (14, *sorted(self.OUTSIDE), 901):
                found = np.array([
                    [float(line[f"{title} {axis} [{unit}]"]) for axis in "xyz"]
                    for line in lines if int(line["node"]) == number
                ])
                expected = np.zeros((STEPS, 3))
                if number in self.OUTSIDE:
                    expected = self.of_node(name, number)
                elif number == 14:
                    expected = np.concatenate([
                        self.block("PointData", name, step)[ids == 14] for step in range(STEPS)
                    ])
                np.testing.assert_array_equal(found, expected, f"{title} of {number}")


if __name__ == "__main__":
    unittest.main()
