"""bipot.Deck: decks and meshes made in Python are texts that the program reads."""

import re
import sys
import unittest
import warnings
from pathlib import Path

try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE), str(HERE.parent / "cases")]

from boxes import Box  # noqa: E402

import synthetic_result  # noqa: E402
from bipot.element_faces import CELLS, outer_faces_of  # noqa: E402
from bipot.meshes import TYPES  # noqa: E402
from package import BLOCK, ROOT, WithFolder, bipot, needs, pressed_block  # noqa: E402

# As Gmsh 4 writes it: an element, and its lower face.
GMSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "foot"
3 2 "block"
$EndPhysicalNames
$Entities
0 0 1 1
1 0 0 0 1 1 0 1 1 0
1 0 0 0 1 1 1 1 2 0
$EndEntities
$Nodes
1 8 1 8
3 1 0 8
1
2
3
4
5
6
7
8
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
$EndNodes
$Elements
2 2 1 2
2 1 3 1
1 1 4 3 2
3 1 5 1
2 1 2 3 4 5 6 7 8
$EndElements
"""


def same(test, one, other):
    """Check that two results are the same to the bit."""
    np.testing.assert_array_equal(one.points, other.points)
    np.testing.assert_array_equal(one.elements, other.elements)
    test.assertEqual(one.pairs.names, other.pairs.names)
    for pair in one.pairs.values():
        np.testing.assert_array_equal(pair.reaction, other.pairs[pair.name].reaction)


def finish(deck, low, high):
    """Press a body between its set of nodes `high` and the ground below its surface `low`."""
    deck.material("STEEL", 210000.0, 0.3)
    deck.section("STEEL", "BODY")
    deck.plane("GROUND", (0, 0, 0), (0, 0, 1))
    deck.interaction("DRY", friction=0.3)
    deck.pair(low, "GROUND", "DRY")
    with deck.step():
        deck.boundary(high, 1, 2)
        deck.boundary(high, 3, value=-0.01)
    return deck


class AsText(WithFolder):
    def test_a_deck_in_python_is_the_deck_in_text(self):
        with bipot.run(pressed_block(), quiet=True) as built:
            same(self, built, self.run_block())

    def test_a_deck_that_was_read_is_the_same_text(self):
        for path in sorted((ROOT / "input").glob("*.inp")):
            with path.open(encoding="utf-8", newline="") as file:
                self.assertEqual(bipot.Deck.read(path).text(), file.read(), path.name)

    def test_a_deck_survives_being_written_and_read(self):
        text = pressed_block().text()
        again = bipot.Deck.read(pressed_block().write("pressed.inp"))
        self.assertEqual(again.text(), text)
        again.comment("at the end of the model")
        lines = again.text().splitlines()
        self.assertEqual(lines[lines.index("*STEP") - 1], "** at the end of the model")
        lines.remove("** at the end of the model")
        self.assertEqual(lines, text.splitlines())

    def test_a_text_is_added_to(self):
        deck = bipot.Deck.read(BLOCK)
        deck.parameter(lift=0.05)
        deck.amplitude("UP", [(0, 0), (1, 1)])
        with deck.step(0.5, direct=True):
            deck.boundary("BODY-ZMAX", 3, value="<lift>", amplitude="UP")
        with bipot.run(deck, n=1, steps=10, lift=0.1, quiet=True) as result:
            self.assertEqual(result.history("step").max(), 3)
            self.assertAlmostEqual(result.field("displacement").max(), 0.4 * 0.75**0.5, places=6)
            # Lifted: nothing touches at the end.
            np.testing.assert_array_equal(result.pairs[0].status[-1], 0)
        with self.assertRaisesRegex(ValueError, "give the ids of its new nodes"):
            deck.reference_node((0, 0, 1))
        deck.number_from(1000, 2000)
        part = deck.mesh(synthetic_result.element_mesh(1, 1, 1), name="MORE")
        self.assertEqual((part.node_ids[0], part.element_ids.tolist()), (1000, [2000]))

    def test_files_that_a_deck_names_are_found_wherever_it_is_written(self):
        (self.folder / "sub").mkdir()
        Path("sub/body.inp").write_text("*BLOCK, NAME=BODY, NX=1, NY=1, NZ=1\n0,0,0,1,1,1\n")
        Path("sub/main.inp").write_text("*HEADING\nx\n*INCLUDE, INPUT=body.inp\n")
        deck = finish(bipot.Deck.read("sub/main.inp"), "BODY-ZMIN", "BODY-ZMAX")
        self.assertEqual(bipot.check(deck), [])
        deck.write("other/main.inp")
        self.assertEqual(bipot.check("other/main.inp"), [])

    def test_what_others_have_written_is_not_replaced(self):
        Path("pressed.inp").write_text("*HEADING\nby hand\n")
        with self.assertRaisesRegex(bipot.RefusedError, "no Deck has written it"):
            bipot.run(pressed_block(), quiet=True)
        self.assertEqual(Path("pressed.inp").read_text(), "*HEADING\nby hand\n")
        pressed_block().write("pressed.inp", overwrite=True)
        pressed_block(MAX_SWEEPS=7).write("pressed.inp")  # what a Deck has written may go
        self.assertIn("MAX SWEEPS=7", Path("pressed.inp").read_text())

    def test_mistakes_have_lines_of_the_text(self):
        deck = pressed_block()
        deck.card("*FRICTIONLESS")
        message, = bipot.check(deck)
        self.assertEqual(message.file, "pressed.inp")
        self.assertEqual(deck.text().splitlines()[message.line - 1], "*FRICTIONLESS")

    def test_every_card_of_the_page_can_be_made(self):
        page = (ROOT / "docs" / "deck.md").read_text(encoding="utf-8")
        words = set(re.findall(r"^\| \[`\*([A-Z -]+)`\]", page, re.MULTILINE))
        self.assertGreater(len(words), 30)
        for word in words:
            if word in ("HEADING", "PARAMETER"):
                continue
            deck = bipot.Deck().card(f"*{word}", ["1, 2"], {"NAME": "a, b", "INNER": True})
            self.assertEqual(deck.text().splitlines()[1:],
                             [f'*{word}, NAME="a, b", INNER', "1, 2"])

    def test_every_method_writes_what_the_program_reads(self):
        used = set()

        class Watched(bipot.Deck):
            def __getattribute__(self, name):
                used.add(name)
                return super().__getattribute__(name)

        deck = Watched("All methods", name="all")
        deck.units("N", "mm")
        deck.parameter(n=1, word="C3D8I")
        deck.comment("two blocks, one on the other")
        deck.block("LOW", (2, "<n>", 1), (2, 1, 1), type="<word>", grow={"X": (2, "MIDDLE")})
        deck.block("HIGH", (1, 1, 1), (2, 1, 1), corner=(0, 0, 1), set="LID")
        deck.number_from(node=1, element=1)
        part = deck.mesh(synthetic_result.element_mesh(1, 1, 1), name="SIDE")
        deck.node_set("SOME", [*part.node_ids[:2], "LOW-ZMIN"])
        deck.element_set("ALL", ["LOW", "HIGH", "SIDE"])
        deck.surface("FOOT", part.faces(lambda x, n: n[:, 2] < -0.9))
        deck.node_surface("TIP", ["SOME"])
        tool = deck.reference_node((0, 0, -9))
        corners = deck.nodes([[-9, -9, -9], [9, -9, -9], [9, 9, -9], [-9, 9, -9]])
        deck.elements([corners], set="TOOL", type="R3D4")
        deck.refine([(0, 0, 0, 0.1)], times=2)
        deck.refine(nodes="SOME")
        deck.refine(elements="LOW")
        deck.accuracy(
            0.02, "DISPLACEMENT", nodes="SOME", direction=3, mesh="REFINE", value="EXTRAPOLATED"
        )
        deck.rigid_body("TOOL", tool)
        deck.surface("PLATE", [("TOOL", "SPOS")])
        deck.material("STEEL", 210000.0, 0.3, density=7.8e-9, expansion=1.2e-5)
        deck.section("STEEL", "ALL")
        held = deck.reference_node((0, 0, 0))
        deck.plane("GROUND", (0, 0, 0), (0, 0, 1), reference_node=held)
        deck.sphere("BALL", (0, 0, 50), 10.0)
        deck.sphere("HOLLOW", (0, 0, 0), 100.0, inner=True)
        deck.cylinder("BORE", (0, 0, 0), (0, 0, 1), 90.0, inner=True)
        deck.cone("TIP", (0, 0, 99), (0, 0, 1), (0, 5), 10, facets=36)
        deck.stl("STAMP", ROOT / "tests" / "data" / "plate.stl")
        deck.interaction("DRY", 0.3)
        deck.pair("FOOT", "GROUND", "DRY", adjust=0.001)
        deck.pair("HIGH-XMAX", "HOLLOW", "DRY")
        deck.pair("HIGH-YMAX", "BORE", "DRY", small_sliding=True)
        deck.tie("GLUE", "LOW-ZMAX", "HIGH-ZMIN", position_tolerance=0.1)
        deck.block("QUARTER", (2, 2, 1), (1, 1, 1), corner=(50, 50, 50))
        deck.rubber("SEAL", "OGDEN, N=2", 0.4, 2.0, 0.1, -2.0, 0.05, density=1e-9)
        deck.section("SEAL", "QUARTER")
        deck.sector("WHEEL", ("QUARTER-XMIN", "QUARTER-YMIN"), 4, ((50, 50, 0), (50, 50, 1)))
        deck.contact_solver(SOLVER="AUTO", MAX_SWEEPS=100)
        deck.amplitude("UP", [(0, 0), (2, 1)], total_time=True)
        deck.initial_temperature("LOW", 20.0)
        with deck.step(0.5, 1.0, direct=True, title="all at once", nlgeom=True):
            deck.boundary("SOME", "PINNED")
            deck.boundary("LOW-ZMIN", 1, 3)
            deck.boundary("SIDE", 3, value=-0.001, amplitude="UP")
            deck.boundary(held, 1, 6)
            deck.boundary(tool, 1, 3, op="MOD")
            deck.force("HIGH-ZMAX", 3, -1.0, op="MOD")
            deck.pressure("HIGH-ZMAX", 2.0)
            deck.gravity(9810.0, elements="LOW")
            deck.gravity(9810.0)
            deck.temperature("LOW", 30.0, amplitude="UP")
            deck.output(["U", "CF"], ["S", "MISES"], position="AVERAGED AT NODES", frequency=2)
        with deck.step(nlgeom=True):
            deck.boundary("LOW-ZMIN", 1, 3, fixed=True)
        deck.write("all.inp")
        self.assertEqual([str(message) for message in bipot.check("all.inp")], [])
        public = {name for name in vars(bipot.Deck) if not name.startswith("_")}
        self.assertEqual(public - used - {"read", "from_text", "card", "text"}, set())

    def test_what_is_no_card_is_refused(self):
        deck = bipot.Deck()
        for wrong in (
            lambda: deck.card("*", []), lambda: deck.card("*NSET\n*STEP", []),
            lambda: deck.card("*NSET", ["1\n*STEP"]), lambda: deck.card("*NSET", ["*STEP"]),
            lambda: deck.card("*NODE", [(1, float("nan"), 0, 0)]),
            lambda: deck.node_set('a"b', [1]), lambda: deck.nodes([[0.0, 1.0]]),
        ):
            with self.assertRaises(ValueError):
                wrong()
        with self.assertRaises(TypeError):
            deck.card("*NODE", [(1, True, 0, 0)])
        with deck.step():
            with self.assertRaisesRegex(ValueError, "a step within a step"):
                with deck.step():
                    pass

    def test_options_of_rubber(self):
        deck = bipot.Deck("Seal", name="seal")
        deck.rubber("SEAL", "POLYNOMIAL , N = 1", 0.4, 0.1, 0.02).rubber("FOOT", "YEOH, ", 1.0)
        self.assertIn("*HYPERELASTIC, POLYNOMIAL, N=1\n0.4, 0.1, 0.02\n", deck.text())
        self.assertIn("*HYPERELASTIC, YEOH\n1.0\n", deck.text())

    def test_names_with_blanks_and_commas(self):
        deck = bipot.Deck("Names", name="names")
        points, elements = synthetic_result.element_mesh(1, 1, 1)
        part = deck.mesh((points, elements))
        deck.node_set("upper face, left", part.nodes(lambda x: x[:, 2] > 0.5))
        deck.node_set("all of it", ["upper face, left", *part.node_ids[:4]])
        deck.surface("under side", part.faces(lambda x, n: n[:, 2] < -0.5))
        finish(deck, "under side", "upper face, left")
        self.assertEqual(bipot.check(deck), [])


class Meshes(WithFolder):
    def press(self, source, name, **options):
        """Return the deck of a pressed mesh."""
        deck = bipot.Deck("A mesh", name=name)
        part = deck.mesh(source, **options)
        deck.surface("LOW", part.faces(lambda x, n: (n[:, 2] < -0.9) & (x[:, 2] < 1e-9)))
        deck.node_set("HIGH", part.nodes(lambda x: x[:, 2] > 1 - 1e-9))
        return finish(deck, "LOW", "HIGH")

    def reference(self):
        """Return the result of the same block by *BLOCK."""
        deck = bipot.Deck("A block", name="block")
        deck.block("BODY", (2, 2, 1), (2, 2, 1))
        result = bipot.run(finish(deck, "BODY-ZMIN", "BODY-ZMAX"), quiet=True)
        self.addCleanup(result.close)
        return result

    def test_arrays_are_a_mesh(self):
        deck = self.press(synthetic_result.element_mesh(2, 2, 1), "arrays")
        with bipot.run(deck, quiet=True) as result:
            expected = self.reference()
            np.testing.assert_array_equal(result.points, expected.points)
            np.testing.assert_allclose(
                result.pairs[0].resultant, expected.pairs[0].resultant, rtol=1e-12, atol=1e-8
            )

    def test_elements_that_stand_inside_out_are_turned(self):
        points, elements = synthetic_result.element_mesh(2, 2, 1)
        elements[1] = elements[1][[4, 5, 6, 7, 0, 1, 2, 3]]
        with bipot.run(self.press((points, elements), "turned"), quiet=True) as result:
            np.testing.assert_allclose(
                result.pairs[0].resultant, self.reference().pairs[0].resultant, rtol=1e-9, atol=1e-6
            )

    def test_nodes_that_no_element_has_are_left_out(self):
        points, elements = synthetic_result.element_mesh(1, 1, 1)
        points = np.concatenate([[[9.0, 9, 9]], points, [[9.0, 9, 9]]])
        deck = bipot.Deck()
        sets = {"ENDS": [0, 1, 9], "LOW": points[:, 2] == 0}
        part = deck.mesh((points, elements + 1), node_sets=sets)
        self.assertEqual(part.mesh.rows.tolist(), list(range(1, 9)))
        self.assertEqual(part.mesh.node_sets["ENDS"].tolist(), [0])
        self.assertEqual(part.mesh.node_sets["LOW"].tolist(), [0, 1, 2, 3])

    def test_blocks_and_meshes_have_ids_of_their_own(self):
        deck = bipot.Deck("Two bodies", name="two")
        deck.block("TOP", (1, 1, 1), (1, 1, 1), corner=(0, 0, 1))
        part = deck.mesh(synthetic_result.element_mesh(1, 1, 1), name="LOWER")
        node = deck.reference_node((0, 0, 9))
        self.assertEqual((part.node_ids.tolist(), node), (list(range(1, 9)), 9))
        deck.material("M", 1.0, 0.3).section("M", "LOWER").section("M", "TOP")
        with deck.step():
            deck.boundary("TOP", "PINNED")
            deck.boundary("LOWER", "PINNED")
        with bipot.run(deck, quiet=True) as result:
            self.assertEqual((len(result.points), len(result.elements)), (16, 2))

    def test_what_is_no_mesh_of_elements(self):
        points, elements = synthetic_result.element_mesh(1, 1, 1)
        for wrong, words in (
            ((points, elements[:, :7]), "as many whole numbers as they have nodes"),
            ((points[:, :2], elements), "3 coordinates"),
            ((points, elements + 1), "these go from 1 to 8"),
            ((points * np.nan, elements), "no numbers"),
            ((points, elements[:0]), "no elements"),
        ):
            with self.assertRaisesRegex(bipot.MeshError, words):
                bipot.Deck().mesh(wrong)
        with self.assertRaisesRegex(TypeError, "not int"):
            bipot.Deck().mesh(7)
        with self.assertRaisesRegex(ValueError, "rows must be from 0 to 0"):
            bipot.Deck().mesh((points, elements), element_sets={"X": [1]})

    def press_disc(self, source, kind):
        """Return the force of a disc of radius 2 and height 1, E = 1000, pressed by 0.01."""
        deck = bipot.Deck("A disc", name="disc")
        part = deck.mesh(source, type=kind)
        deck.surface("LOW", part.faces(lambda x, n: (n[:, 1] < -0.9) & (x[:, 1] < 1e-9)))
        deck.node_set("HIGH", part.nodes(lambda x: x[:, 1] > 1 - 1e-9))
        deck.material("M", 1000.0, 0.0).section("M", "BODY")
        deck.plane("GROUND", point=(0, 0, 0), normal=(0, 1, 0))
        deck.interaction("DRY").pair("LOW", "GROUND", "DRY")
        with deck.step():
            deck.boundary("HIGH", 2, value=-0.01)
        with bipot.run(deck, quiet=True) as result:
            return result.pairs[0].resultant[-1], part

    def test_plane_meshes(self):
        """10 over 4 pi, of quadrilaterals and triangles; one goes round clockwise."""
        points = np.array([
            (0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (0.5, 0, 0),
            (1, 0.5, 0), (0.5, 1, 0), (0, 0.5, 0), (1.5, 0, 0), (2, 0.5, 0), (1.5, 1, 0),
        ])
        quads = np.array([(0, 1, 4, 3, 6, 7, 8, 9), (1, 4, 5, 2, 7, 12, 11, 10)])
        for elements, kind in (
            (quads, "CAX8R"), (quads[:, :4], "CAX"), (quads[:, :4], "CAX4B"),
            (np.array([(0, 1, 4), (0, 3, 4), (1, 2, 5), (1, 5, 4)]), "CAX3"),
        ):
            with self.subTest(kind):
                force, _ = self.press_disc((points, elements), kind)
                np.testing.assert_allclose(force, [0, 40 * np.pi, 0], rtol=1e-6)
        for wrong, kind, words in (
            ((points[:, [0, 2, 1]], quads), "CAX", "in the plane z = 0"),
            ((points, quads), "CAX4", "no element of the mesh can be of type CAX4"),
        ):
            with self.assertRaisesRegex(bipot.MeshError, words):
                bipot.Deck().mesh(wrong, type=kind)

    @needs("meshio")
    def test_plane_meshes_of_gmsh(self):
        """Groups of lines are surfaces of edges, and sets of nodes; groups of faces sets."""
        import meshio

        points = np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0.0)])
        cells = [("line", np.array([(0, 1)])), ("quad", np.array([(0, 1, 2, 3)]))]
        mesh = meshio.Mesh(
            points, cells, cell_sets={"FOOT": [np.array([0]), None], "ALL": [None, np.array([0])]}
        )
        force, part = self.press_disc(mesh, "CAX")
        np.testing.assert_allclose(force, [0, 40 * np.pi, 0], rtol=1e-6)
        self.assertEqual(part.mesh.surfaces["FOOT"].tolist(), [[0, 0]])
        self.assertEqual(part.mesh.node_sets["FOOT"].tolist(), [0, 1])
        self.assertEqual(part.mesh.element_sets["ALL"].tolist(), [0])
        with self.assertRaisesRegex(bipot.MeshError, "type='CPE', 'CPS' or 'CAX'"):
            bipot.Deck().mesh(mesh)

    @needs("meshio")
    def test_physical_groups_of_gmsh(self):
        import meshio

        points, elements = synthetic_result.element_mesh(2, 2, 1)
        low = elements[:, [0, 3, 2, 1]]
        inside = elements[:1, [1, 2, 6, 5]]  # between two elements: of no surface
        high = np.flatnonzero(points[:, 2] == 1)[:, None]
        cells = [("vertex", high), ("quad", np.concatenate([low, inside])),
                 ("hexahedron", elements)]  # fmt: skip
        numbers = [np.full(9, 4), np.array([7, 7, 7, 7, 8]), np.array([1, 1, 2, 2])]
        mesh = meshio.Mesh(
            points, cells, cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
            field_data={"HIGH": np.array([4, 0]), "LOW": np.array([7, 2]),
                        "MIDDLE": np.array([8, 2]), "ONE": np.array([1, 3]),
                        "OTHER": np.array([2, 3])},
        )
        mesh.write("body.msh", file_format="gmsh22", binary=False)
        deck = bipot.Deck("Gmsh", name="gmsh")
        with self.assertWarnsRegex(UserWarning, "1 cells of group MIDDLE are no outer faces"):
            part = deck.mesh("body.msh")
        self.assertEqual(part.mesh.element_sets["OTHER"].tolist(), [2, 3])
        self.assertEqual(sorted(part.mesh.surfaces), ["LOW"])
        with bipot.run(finish(deck, "LOW", "HIGH"), quiet=True) as result:
            np.testing.assert_allclose(
                result.pairs[0].resultant, self.reference().pairs[0].resultant, rtol=1e-9, atol=1e-6
            )

    @needs("meshio")
    def test_physical_groups_of_the_present_format(self):
        Path("new.msh").write_text(GMSH_41)
        part = bipot.Deck().mesh("new.msh")
        self.assertEqual({name: faces.tolist() for name, faces in part.mesh.surfaces.items()},
                         {"foot": [[0, 0]]})
        self.assertEqual({name: rows.tolist() for name, rows in part.mesh.element_sets.items()},
                         {"block": [0]})

    def check_solved(self, source, types, **options):
        """A mesh as a deck: its types of elements, and that it is solved and certified."""
        deck = self.press(source, "any", **options)
        text = deck.text()
        self.assertEqual(re.findall("TYPE=(C3D[0-9A-Z]+)", text), types)
        with bipot.run(deck, quiet=True, overwrite=True) as result:
            self.assertTrue(result.certified)
            self.assertGreater(result.pairs[0].resultant[-1, 2], 0)

    @needs("meshio")
    def test_meshes_of_every_kind_of_gmsh(self):
        """Written as Gmsh does, in its order of the nodes; groups of faces become surfaces."""
        import meshio

        for kinds in (("C3D4",), ("C3D6",), ("C3D5",), ("C3D10",), ("C3D20",),
                      ("C3D8", "C3D6")):
            box = Box("B", (2, 2, 2), kinds)
            cells = []
            for kind, elements in box.elements.items():
                nodes = np.array([cell for _, *cell in elements]) - box.first
                (name,) = (name for name, types in TYPES.items() if kind in types)
                cells.append((name, nodes))
            _, of_faces = outer_faces_of([nodes for _, nodes in cells])
            below = [row for row in of_faces if (box.x[row[row >= 0], 2] < 1e-9).all()]
            kept = {}
            for row in below:
                kept.setdefault(int((row >= 0).sum()), []).append(row[row >= 0])
            shapes = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}
            cells += [(shapes[n], np.array(rows)) for n, rows in kept.items()]
            physical = [
                np.full(len(rows), 7 if name in shapes.values() else 1) for name, rows in cells
            ]
            mesh = meshio.Mesh(
                box.x, cells, cell_data={"gmsh:physical": physical, "gmsh:geometrical": physical},
                field_data={"FOOT": np.array([7, 2]), "ALL": np.array([1, 3])},
            )
            mesh.write("any.msh", file_format="gmsh22", binary=False)
            with self.subTest(kinds=kinds):
                self.check_solved("any.msh", list(box.elements))
                part = bipot.Deck().mesh("any.msh")
                self.assertEqual(len(part.mesh.surfaces["FOOT"]), len(below))
                self.assertEqual(len(part.mesh.element_sets["ALL"]), part.mesh.n_elements)
                # The middles of straight edges are where the cell has them.
                for _, nodes in part.mesh.blocks:
                    cell = CELLS[nodes.shape[1]]
                    if nodes.shape[1] > cell.corners:
                        x = part.mesh.points[nodes]
                        for i, edge in enumerate(cell.edges):
                            np.testing.assert_allclose(
                                x[:, cell.corners + i], x[:, list(edge)].mean(axis=1), atol=1e-12
                            )

    def test_every_kind_of_element_is_turned(self):
        for kind in ("C3D4", "C3D6", "C3D5", "C3D10", "C3D13", "C3D15", "C3D20"):
            box = Box("B", (1, 1, 1), (kind,))
            nodes = np.array([cell for _, *cell in box.elements[kind]]) - box.first
            mirrored = box.x * [1.0, -1.0, 1.0] + [0.0, 1.0, 0.0]
            with self.subTest(kind=kind):
                self.check_solved((mirrored, nodes), [kind])

    @needs("meshio")
    def test_wedges_of_second_order_that_meshio_does_not_know(self):
        Path("wedge.msh").write_text(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n15\n"
            + "".join(f"{i} 0 0 {i}\n" for i in range(1, 16)) + "$EndNodes\n$Elements\n1\n"
            + "1 18 2 1 1 " + " ".join(map(str, range(1, 16))) + "\n$EndElements\n"
        )
        with self.assertRaisesRegex(bipot.MeshError, r"kind wedge15; .*\.inp.*INCLUDE"):
            bipot.Deck().mesh("wedge.msh")

    def test_types_of_hexahedra(self):
        box = Box("B", (2, 2, 1), ("C3D20",))
        nodes = np.array([cell for _, *cell in box.elements["C3D20"]]) - box.first
        self.check_solved((box.x, nodes), ["C3D20R"], type="C3D20R")
        with self.assertRaisesRegex(bipot.MeshError, r"type C3D8I: it has 4 .*C3D20 or C3D20R"):
            bipot.Deck().mesh((box.x, nodes), type="C3D8I")

    @needs("meshio")
    def test_what_cannot_be_read_and_solids_that_no_element_is(self):
        import meshio

        points = np.zeros((27, 3))
        for kind, nodes, words in (
            ("hexahedron27", 27, "Mesh.SecondOrderIncomplete = 1"),
            ("wedge18", 18, "Mesh.SecondOrderIncomplete = 1"),
            ("pyramid14", 14, "Mesh.SecondOrderIncomplete = 1"),
            ("tetra20", 20, "ElementOrder = 1 or 2"),
        ):
            mesh = meshio.Mesh(points, [(kind, np.arange(nodes)[None])])
            with self.assertRaisesRegex(bipot.MeshError, f"1 of kind {kind}: .*{words}"):
                bipot.Deck().mesh(mesh)
        Path("broken.msh").write_text("$MeshFormat\n")
        for name, words in (("broken.msh", "cannot read"), ("none.msh", "no such file")):
            with self.assertRaisesRegex(bipot.MeshError, words):
                bipot.Deck().mesh(name)

    @needs("pyvista")
    def test_grids_of_pyvista(self):
        import pyvista

        grid = pyvista.ImageData(dimensions=(3, 3, 2))
        for source in (grid, grid.cast_to_structured_grid()):
            with bipot.run(self.press(source, "grid"), quiet=True, overwrite=True) as result:
                np.testing.assert_allclose(
                    result.pairs[0].resultant, self.reference().pairs[0].resultant,
                    rtol=1e-9, atol=1e-6,
                )
        self.check_solved(grid.to_tetrahedra(), ["C3D4"])


if __name__ == "__main__":
    warnings.simplefilter("default")
    unittest.main()
