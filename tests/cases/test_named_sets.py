"""The deck's sets and surfaces in the result file: by name, as rows of the mesh that it holds."""

import subprocess
import unittest

import h5py
import numpy as np
from program import PROGRAM, Run
from two_bodies import solved

from bipot.element_faces import face_nodes
from bipot.errors import ResultError

# A block on a plane, pushed by a ball whose reference node belongs to a set with a node of the
# block and one of nothing. Node 9999 stands before the block's nodes: rows are not numbers.
DECK = """\
*NODE
9999, 40., 40., 40.
*NODE, NSET=TOOL
7000, 0.5, 0.5, 3.
*BLOCK, NAME=BODY, NX=2, NY=3, NZ=2
0., 0., 0.,  1., 1., 1.
*NSET, NSET=Edge
10000, 10001, 10002
*NSET, NSET=Edge
9999
*NSET, NSET=LOST
9999
*NSET, NSET=MIXED
TOOL, EDGE
*NSET, NSET=A/B
BODY-XMIN
*ELSET, ELSET=FIRST
1, 2
*SURFACE, NAME=FOOT
FIRST, S1
*SURFACE, NAME=CORNERS, TYPE=NODE
EDGE
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=7000
0.5, 0.5, 3.,  2.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, GROUND
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMAX, BALL
*BOUNDARY
BODY-XMIN, 1, 1, 0.
BODY-YMIN, 2, 2, 0.
TOOL, 1, 2, 0.
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
TOOL, 3, 3, -0.02
{output}*END STEP
"""
EDGE = [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]
TEXT = DECK.format(output="*NODE FILE\nU\n*EL FILE\nS\n")


def by_place(points):
    """Return points in one order, whatever that of the rows is."""
    points = np.round(points, 9)
    return points[np.lexsort(points.T)]


def places(result):
    """Return what the sets mean: kind and name, and the places of the members."""
    centres = result.points[result.elements].mean(axis=1)
    found = {("nodes", name): result.points[rows] for name, rows in result.node_sets.items()}
    for name, rows in result.element_sets.items():
        found["elements", name] = centres[rows]
    for name, faces in result.face_sets.items():
        found["faces", name] = result.points[face_nodes(result.elements, faces)].mean(axis=1)
    for name, rows in result.reference_nodes.sets.items():
        found["reference_nodes", name] = result.reference_nodes.coordinates[rows]
    return {key: by_place(points) for key, points in found.items()}


class NamedSets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.result = solved(cls(), TEXT)

    def assert_same(self, one, other):
        self.assertEqual(list(one), list(other))
        for key, points in one.items():
            np.testing.assert_allclose(points, other[key], atol=1e-9, err_msg=str(key))

    def test_names_are_those_of_the_deck(self):
        sides = [f"BODY-{side}" for side in ("XMAX", "XMIN", "YMAX", "YMIN", "ZMAX", "ZMIN")]
        self.assertEqual(
            list(self.result.node_sets),
            sorted(["A_B", "BODY", *sides, "CORNERS", "EDGE", "MIXED"]),
        )
        self.assertEqual(list(self.result.element_sets), ["BODY", "FIRST"])
        self.assertEqual(list(self.result.face_sets), [*sides, "FOOT"])
        self.assertEqual(list(self.result.reference_nodes.sets), ["MIXED", "TOOL"])

    def test_members_are_rows_of_the_mesh(self):
        points, sets = self.result.points, self.result.node_sets
        for axis, letter in enumerate("XYZ"):
            for value, end in enumerate(("MIN", "MAX")):
                rows = np.flatnonzero(points[:, axis] == value)
                np.testing.assert_array_equal(sets[f"body-{letter}{end}"], rows)
                faces = self.result.face_sets[f"BODY-{letter}{end}"]
                nodes = face_nodes(self.result.elements, faces)
                np.testing.assert_array_equal(np.unique(nodes), rows)
                self.assertEqual(len(faces), 4 if letter == "Y" else 6)
        np.testing.assert_array_equal(points[sets["Edge"]], EDGE)
        np.testing.assert_array_equal(sets["CORNERS"], sets["EDGE"])
        np.testing.assert_array_equal(sets["A/B"], sets["BODY-XMIN"])
        np.testing.assert_array_equal(self.result.element_ids[self.result.element_sets["first"]],
                                      [1, 2])  # fmt: skip
        foot = face_nodes(self.result.elements, self.result.face_sets["FOOT"])
        np.testing.assert_array_equal(foot, self.result.elements[:2][:, [0, 3, 2, 1]])

    def test_reference_nodes_of_a_set(self):
        (node,) = self.result.reference_nodes.of_set("mixed")
        self.assertEqual(node.node_id, 7000)
        np.testing.assert_array_equal(self.result.points[self.result.node_sets["MIXED"]], EDGE)
        with self.assertRaisesRegex(ResultError, "'EDGE'; it has MIXED, TOOL"):
            self.result.reference_nodes.of_set("EDGE")

    def test_fields_of_a_set(self):
        result = self.result
        np.testing.assert_array_equal(
            result.field("displacement", 0, nodes="edge"),
            result.field("displacement", 0)[result.node_sets["EDGE"]],
        )
        np.testing.assert_array_equal(
            result.field("stress", elements="FIRST"), result.field("stress")[:2]
        )
        np.testing.assert_array_equal(result.field("stress", elements=[1]),
                                      result.field("stress")[1:2])  # fmt: skip
        with self.assertRaisesRegex(ResultError, "no node set 'PIN'; it has A_B, BODY, BODY-XMAX"):
            result.field("displacement", nodes="PIN")
        with self.assertRaisesRegex(ResultError, "no element set 'PIN'; it has BODY, FIRST"):
            result.field("stress", elements="PIN")
        with self.assertRaisesRegex(ValueError, "not both"):
            result.field("stress", nodes="BODY", elements="BODY")
        with self.assertRaisesRegex(ValueError, "on is 'elements'"):
            result.field("stress", on="elements", nodes="BODY")

    def test_supports_balance_contact(self):
        """Sums over sets are in balance with the resultants of the pairs, an increment each."""
        result = self.result
        ground, ball = (result.pairs[name].resultant
                        for name in ("BODY-ZMIN:GROUND", "BODY-ZMAX:BALL"))
        self.assertGreater(-ball[-1, 2], 1)
        for index in (0, -1):
            supports = result.reaction("BODY-XMIN", index) + result.reaction("BODY-YMIN", index)
            # The edge of both sides counts twice; its nodes are held in x and y.
            shared = np.intersect1d(result.node_sets["BODY-XMIN"], result.node_sets["BODY-YMIN"])
            supports -= result.field("reaction_force", index, nodes=shared).sum(axis=0)
            np.testing.assert_allclose(supports + ground[index] + ball[index], 0, atol=1e-7)
            np.testing.assert_allclose(result.reaction("TOOL", index), ball[index], atol=1e-7)
            np.testing.assert_allclose(result.reaction("MIXED", index),
                                       ball[index] + result.reaction("EDGE", index))  # fmt: skip
        with self.assertRaisesRegex(ResultError, "no node set 'LOST'"):
            result.reaction("LOST")
        with self.assertRaisesRegex(ResultError, "no index 2"):
            result.reaction("TOOL", 2)

    def test_a_finer_mesh_has_them(self):
        finer = places(solved(self, TEXT, "--refine", "1"))
        coarse = places(self.result)
        self.assertEqual(list(finer), list(coarse))
        for key, size in ((("nodes", "BODY-ZMAX"), 35), (("nodes", "EDGE"), 5),
                          (("elements", "FIRST"), 16), (("faces", "FOOT"), 8),
                          (("reference_nodes", "TOOL"), 1)):  # fmt: skip
            self.assertEqual(len(finer[key]), size, key)
        written = TEXT.replace("NX=2, NY=3, NZ=2", "NX=4, NY=6, NZ=4")
        written = places(solved(self, written.replace("10002\n", "10002, 10003, 10004\n")))
        for key in finer:
            if key[0] != "reference_nodes" and key[1] not in ("FIRST", "FOOT"):
                np.testing.assert_allclose(finer[key], written[key], atol=1e-9, err_msg=str(key))

    def test_a_flat_deck_has_them(self):
        run = Run(TEXT, name="deck")
        done = subprocess.run([PROGRAM, run.deck, "--flat"], cwd=run.folder, capture_output=True,
                              text=True, timeout=60, check=True)  # fmt: skip
        self.assertNotIn("*BLOCK", done.stdout)
        self.assert_same(places(self.result), places(solved(self, done.stdout)))

    def test_a_continued_run_has_them(self):
        run = Run(TEXT, name="deck")
        with h5py.File(run.file, "r+") as file:
            file["run"].attrs.modify("status", b"running")
        done = subprocess.run([PROGRAM, run.deck, "--continue"], cwd=run.folder,
                              capture_output=True, text=True, timeout=60, check=False)  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        with run.result() as result:
            self.assertIn("continued", result.run)
            self.assert_same(places(self.result), places(result))

    def test_damage_of_a_set_is_noticed(self):
        run = Run(TEXT, name="deck")
        with h5py.File(run.file, "r+") as file:
            file["run"].attrs.modify("status", b"running")
            file["sets/nodes/EDGE"][0] = 4
        done = subprocess.run([PROGRAM, run.deck, "--continue"], cwd=run.folder,
                              capture_output=True, text=True, timeout=60, check=False)  # fmt: skip
        self.assertEqual(done.returncode, 1)
        self.assertIn("is damaged", done.stderr)


class LargeSets(unittest.TestCase):
    def test_they_take_little_room(self):
        text = TEXT.replace("NX=2, NY=3, NZ=2", "NX=11, NY=11, NZ=11").replace("0.5, 1.", "1., 1.")
        result = solved(self, text)
        body = result.file["sets/nodes/BODY"]
        self.assertEqual((len(body), body.compression), (12**3, "gzip"))
        self.assertLess(body.id.get_storage_size(), len(body))
        np.testing.assert_array_equal(result.node_sets["BODY"], np.arange(12**3))
        self.assertIsNone(result.file["sets/nodes/EDGE"].compression)


class Names(unittest.TestCase):
    def test_names_that_hdf5_has_not_stay_apart(self):
        sets = ("*NSET, NSET=A_B\n10003\n*NSET, NSET=.\n10004\n"
                "*SURFACE, NAME=A_B, TYPE=NODE\n10005\n")  # fmt: skip
        result = solved(self, TEXT.replace("*MATERIAL", sets + "*MATERIAL"))
        names = [name for name in result.node_sets if "_" in name]
        self.assertEqual(names, ["A_B", "A_B-2", "A_B-3", "_"])
        ids = [result.node_ids[result.node_sets[name]].tolist() for name in names[1:]]
        self.assertEqual(ids, [[10003], [10005], [10004]])

    def test_too_many_are_noted(self):
        sets = "".join(f"*ELSET, ELSET=E{i}\n1\n" for i in range(1999))
        run = Run(TEXT.replace("*MATERIAL", sets + "*MATERIAL"), name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("the result file has the first 2000 of 2001 element sets", run.output)
        with run.result() as result:
            self.assertEqual(len(result.element_sets), 2000)
            self.assertEqual(len(result.element_sets["E1997"]), 1)
            self.assertIsNone(result.element_sets.get("E1998"))


class WhatIsWritten(unittest.TestCase):
    """Asking for one field does not drop those that take no room, and errors say how to ask."""

    def fields(self, output):
        result = solved(self, DECK.format(output=output))
        return result, *result.field_names

    def test_naming_displacements_keeps_forces(self):
        kept = {"node_id", "reaction_force", "contact_force", "contact_pressure", "contact_status"}
        for output, more in (("*NODE FILE\nU\n", {"displacement"}), ("*NODE FILE\nRF\n", set()),
                             ("*CONTACT FILE\n", set()), ("", {"displacement"})):
            _, nodes, elements = self.fields(output)
            self.assertEqual(nodes, kept | more, output)
            self.assertEqual(elements, {"element_id"}, output)

    def test_stress_brings_von_mises(self):
        result, nodes, elements = self.fields("*EL FILE, POSITION=AVERAGED AT NODES\nS\n"
                                              "*EL FILE, POSITION=INTEGRATION POINTS\n")
        self.assertLessEqual({"stress", "von_mises"}, nodes)
        self.assertEqual(elements, {"element_id"})
        self.assertEqual(result.gauss_types, ["C3D8"])
        self.assertEqual(set(result.file["gauss/C3D8"]),
                         {"stress", "von_mises", "element_id", "natural_coordinates"})
        _, nodes, elements = self.fields("*EL FILE\nE\n")
        self.assertEqual(elements, {"strain", "element_id"})

    def test_errors_name_what_there_is_and_how_to_ask(self):
        result, *_ = self.fields("*NODE FILE\nRF\n*EL FILE\nE\n")
        for name, on, words in (
            ("displacement", None, "contact_force, .* on nodes; element_id, strain on elements; "
             "U of .NODE FILE in the deck asks for it$"),
            ("stress", None, "S of .EL FILE in the deck asks for it$"),
            ("strain", "nodes", "it has contact_force, [^;]* on nodes; E of .EL FILE in the deck "
             "asks for it, with POSITION=AVERAGED AT NODES$"),
            ("stress_gauss_points", None, "S of .EL FILE .*, with POSITION=INTEGRATION POINTS$"),
            ("stress", "gauss points", "no fields at Gauss points; .EL FILE, POSITION=INTEGR.*"),
            ("colour", None, "no field 'colour'; it has [^;]*; element_id, strain on elements$"),
        ):
            with self.assertRaisesRegex(ResultError, words):
                result.field(name, on=on)


if __name__ == "__main__":
    unittest.main()
