"""The reader of result files and `scripts/show`, on small files written here."""

import importlib.util
import io
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import matplotlib as mpl
import numpy as np

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
sys.path[:0] = [str(SCRIPTS), str(Path(__file__).resolve().parent)]

import synthetic_result  # noqa: E402
from bipot.drawing.style import save  # noqa: E402
from bipot.result import SLIDE, STICK, Result, ResultError, von_mises  # noqa: E402

mpl.use("Agg")


class WithFolder(unittest.TestCase):
    """A test with a folder of its own and a result file of three increments in it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.path = self.folder / "small.vtkhdf"
        synthetic_result.write(self.path)

    def open(self):
        result = Result(self.path)
        self.addCleanup(result.close)
        return result


class ReaderTest(WithFolder):
    def test_leaves_out_the_unfinished_row(self):
        result = self.open()
        self.assertEqual(result.finished, 3)
        self.assertEqual(result.history("contact_iterations").tolist(), [10, 10, 10])
        self.assertEqual(result.pairs[0].reaction.shape, (3, 6, 3))
        self.assertEqual(result.certificate["law"].tolist(), [0, 0, 0])

    def test_finds_nodes_by_place_and_by_id(self):
        result = self.open()
        self.assertEqual(result.nearest_node((2.1, -0.1, 0.1)), 2)
        self.assertEqual(result.node(102), 2)
        with self.assertRaisesRegex(ResultError, "elements have no node 7$"):
            result.node(7)

    def test_reference_nodes_are_histories(self):
        synthetic_result.write(self.path, tool=2, field_increments=[1])
        result = self.open()
        nodes = result.reference_nodes
        self.assertEqual((len(nodes), nodes.node_ids.tolist()), (1, [900]))
        self.assertEqual(nodes.quantities, ["displacement", "reaction_force"])
        self.assertEqual([node.node_id for node in nodes], [900])
        tool = nodes[900]
        self.assertEqual(tool.coordinates.tolist(), [0, 0, 50])
        self.assertEqual(tool.displacement.tolist(), [[0, 0, -2], [0, 0, -4], [0, 0, -6]])
        self.assertEqual(nodes.displacement.shape, (3, 1, 3))
        self.assertEqual((tool.rotation.tolist(), nodes.rotation.shape), ([[0] * 3] * 3, (3, 1, 3)))
        self.assertEqual(tool.reaction_force.tolist(), [[0] * 3] * 3)
        with self.assertRaisesRegex(ResultError, "no dataset /reference_nodes/reaction_moment"):
            _ = tool.reaction_moment
        with self.assertRaisesRegex(ResultError, "no reference node 102; it has 900"):
            nodes[102]
        # It is no point of the mesh.
        with self.assertRaisesRegex(ResultError, "no node 900; it is one of reference_nodes"):
            result.node(900)
        self.assertEqual(len(result.points), 12)

    def test_without_reference_nodes_there_are_none(self):
        result = self.open()
        nodes = result.reference_nodes
        self.assertEqual((len(nodes), list(nodes), nodes.coordinates.shape), (0, [], (0, 3)))
        self.assertEqual((nodes.displacement.shape, nodes.quantities), ((3, 0, 3), []))
        with self.assertRaisesRegex(ResultError, "no reference node 900$"):
            nodes[900]

    def test_turns_local_reactions_to_global(self):
        pair = self.open().pairs["BODY-ZMIN:GROUND"]
        np.testing.assert_allclose(pair.force[1], np.tile([5.0, 0, 20], (6, 1)))
        np.testing.assert_allclose(pair.friction[1], np.tile([5.0, 0, 0], (6, 1)))
        np.testing.assert_allclose(pair.force.sum(axis=1), pair.resultant)
        np.testing.assert_allclose(pair.friction_sum / pair.normal_sum, 0.25)
        self.assertEqual(pair.friction_coefficient, 0.3)

    def test_takes_the_force_at_a_node(self):
        result = self.open()
        pair = result.pairs[0]
        np.testing.assert_allclose(pair.force_at(result.node(102))[:, 0], [10, 20, 30])
        with self.assertRaisesRegex(ResultError, "not in pair"):
            pair.force_at(result.nearest_node((0, 0, 1)))

    def test_reads_a_field_by_its_offset(self):
        result = self.open()
        top = result.nearest_node((1, 1, 1))
        np.testing.assert_allclose(result.field("displacement", 1)[top], [0.02, 0, -0.02])
        np.testing.assert_allclose(result.field("stress", -1)[:, 2], -30)
        with self.assertRaisesRegex(ResultError, "no index 3"):
            result.field("displacement", 3)
        with self.assertRaisesRegex(ResultError, "no field 'colour'"):
            result.field("colour", 0)

    def test_chooses_between_nodes_and_elements(self):
        synthetic_result.write(self.path, stress_on=("Cell", "Point"))
        result = self.open()
        np.testing.assert_allclose(result.field("stress", 0, on="elements")[:, 2], [-10] * 2)
        np.testing.assert_allclose(result.field("stress", -1, on="nodes")[:, 2], [-60] * 12)
        with self.assertRaisesRegex(ResultError, "'stress' is on nodes and on elements"):
            result.field("stress", 0)
        with self.assertRaisesRegex(ResultError, "no field 'displacement' on elements"):
            result.field("displacement", 0, on="elements")
        with self.assertRaisesRegex(ValueError, "not 'faces'"):
            result.field("stress", 0, on="faces")

    def test_maps_sparse_fields_to_their_rows(self):
        synthetic_result.write(self.path, finished=5, field_increments=[1, 4])
        result = self.open()
        self.assertEqual(result.field_rows.tolist(), [1, 4])
        self.assertEqual(result.label(4), "step 2, increment 4, time 2.5")

    def test_a_mesh_of_other_cells_than_elements(self):
        # A wedge in place of the second element.
        with h5py.File(self.path, "r+") as file:
            grid = file["VTKHDF"]
            elements = grid["Connectivity"][()].reshape(2, 8)
            for name, values in (
                ("Connectivity", np.concatenate([elements[0], elements[1, [0, 1, 2, 4, 5, 6]]])),
                ("Offsets", np.array([0, 8, 14])), ("Types", np.array([12, 13], dtype="u1")),
            ):
                del grid[name]
                grid[name] = values
        result = self.open()
        self.assertIn("12 nodes, 2 elements", result._repr_html_())
        self.assertEqual(result.element_ids.tolist(), [1, 2])
        np.testing.assert_allclose(result.field("stress", -1)[:, 2], [-30] * 2)
        with self.assertRaisesRegex(ResultError, "not all elements are C3D8"):
            _ = result.elements
        if importlib.util.find_spec("pyvista") is not None:
            grid = result.to_pyvista(-1)
            self.assertEqual(grid.celltypes.tolist(), [12, 13])
            self.assertAlmostEqual(abs(grid.volume), 1.5, places=12)

    def test_boundary_of_two_elements_has_ten_faces(self):
        result = self.open()
        faces, elements = result.boundary
        self.assertEqual(faces.shape, (10, 4))
        self.assertEqual(np.bincount(elements).tolist(), [5, 5])
        self.assertEqual(len(result.pairs[0].faces), 2)

    def test_boundary_normals_point_outward(self):
        result = self.open()
        faces, _ = result.boundary
        corners = result.points[faces]
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        outward = corners.mean(axis=1) - result.points.mean(axis=0)
        self.assertTrue(((normals * outward).sum(axis=1) > 0).all())

    def test_knows_the_run_and_the_steps(self):
        result = self.open()
        self.assertEqual(result.run["status"], "finished")
        self.assertIn("*HEADING", result.run_text("deck"))
        self.assertEqual(list(result.step_ends), [0, 2])
        self.assertEqual(result.pairs[0].status[0].tolist(), [STICK, SLIDE, SLIDE] * 2)
        self.assertIsNone(result.convergence)

    def test_stress_of_pure_shear(self):
        # By hand: von Mises's stress of a shear stress 1 is the root of 3.
        np.testing.assert_allclose(von_mises(np.array([[0, 0, 0, 1.0, 0, 0]])), 3**0.5)


class ForeignFileTest(WithFolder):
    def test_names_a_missing_file(self):
        with self.assertRaisesRegex(ResultError, "no such file"):
            Result(self.folder / "none.vtkhdf")

    def test_names_a_file_that_is_not_hdf5(self):
        self.path.write_text("*HEADING\n")
        with self.assertRaisesRegex(ResultError, "not an HDF5 file"):
            Result(self.path)

    def test_names_what_a_foreign_file_lacks(self):
        with h5py.File(self.path, "w") as file:
            file["W"] = [1.0]
        with self.assertRaisesRegex(ResultError, "not a bipot result .*history"):
            Result(self.path)


class ShowTest(WithFolder):
    def show(self, *arguments, **environment):
        """Run scripts/show in the test's folder, with pictures of few pixels: they take time."""
        return subprocess.run(
            [sys.executable, SCRIPTS / "show", *arguments, "--dpi", "40"],
            cwd=self.folder,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
        )

    def test_makes_pictures_and_an_animation(self):
        done = self.show("small.vtkhdf", "-o", "pictures")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        made = {path.name for path in (self.folder / "pictures").iterdir()}
        expected = {"deformed.png", "stress.png", "pressure.png", "contact.png", "forces.png",
                    "errors.png", "animation.gif"}
        self.assertEqual(made, expected)
        self.assertEqual(len(done.stdout.split()), len(expected))

    def test_a_tool_that_moves_far_changes_no_picture_of_the_body(self):
        pictures = []
        for tool in (0, 20):
            synthetic_result.write(self.path, tool=tool)
            picture = io.BytesIO()
            with Result(self.path) as result:
                save(result.plot("displacement"), picture, form="png")
            pictures.append(picture.getvalue())
        self.assertEqual(*pictures)

    def test_one_increment_is_enough(self):
        synthetic_result.write(self.path, finished=1)
        done = self.show("small.vtkhdf")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue((self.folder / "small-pictures" / "animation.gif").exists())

    def test_draws_the_stress_wherever_it_is(self):
        for places in (("Point",), ("Cell", "Point")):
            synthetic_result.write(self.path, stress_on=places)
            with Result(self.path) as result:
                figure = result.plot("stress")
            bar = figure.axes[1]
            self.assertEqual(bar.get_ylim(), (0, 30 if "Cell" in places else 60), places)
            mpl.pyplot.close(figure)

    def test_draws_the_contact_without_any_field(self):
        synthetic_result.write(self.path, field_increments=[])
        done = self.show("small.vtkhdf", "--no-animation")
        self.assertEqual(done.returncode, 0)
        self.assertIn("no displacements", done.stderr)
        self.assertTrue((self.folder / "small-pictures" / "contact.png").exists())

    def test_says_that_a_run_has_nothing_to_show(self):
        synthetic_result.write(self.path, finished=0)
        done = self.show("small.vtkhdf")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no increment is finished", done.stderr)

    def test_fails_without_a_traceback(self):
        done = self.show("none.vtkhdf")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr, "show: none.vtkhdf: no such file\n")


if __name__ == "__main__":
    unittest.main()
