"""docs/results.md lists what a result file holds: every dataset, its shape, every counter.

The page is held against the file of a run that asks for all there is. A dataset that the page does
not list fails, and so does one of the page that no file has. Environment: BIPOT, the executable.
"""

import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import h5py

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("BIPOT", str(SOURCE / "build" / "bipot"))
PAGE = SOURCE / "docs" / "results.md"

# A flat obstacle, a round one that moves and turns, one of facets, and another body in a grip;
# increments that may be cut; all outputs.
DECK = """\
*HEADING
All that a result may hold
*NODE, NSET=CENTRE
1, 0.4, 0.5, 3.
1001, 1.05, -1., -1.
1002, 1.05, 2., -1.
1003, 1.05, 2., 0.5
1004, 1.05, -1., 0.5
1005, 1.05, 2., 2.
1006, 1.05, -1., 2.
1007, 1.05, 2., 3.
2, 2., 0., 0.
3, 0.5, 2.5, 0.5
*ELEMENT, TYPE=R3D4, ELSET=PLATE
1001, 1001, 1002, 1003, 1004
1002, 1004, 1003, 1005, 1006
*ELEMENT, TYPE=R3D3, ELSET=PLATE
1003, 1006, 1005, 1007
*RIGID BODY, ELSET=PLATE, REF NODE=2
*SURFACE, NAME=SIDE
PLATE, SNEG
*BLOCK, NAME=BODY, NX=2, NY=3, NZ=3
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=WALL, NX=4, NY=1, NZ=5
0., 1., 0.,  1., 1., 1.
*ELEMENT, TYPE=SPRING1, ELSET=PAD
900, 1008
901, 1009
902, 1010
*SPRING, ELSET=PAD
2
10.
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT
*SOLID SECTION, ELSET=WALL, MATERIAL=SOFT
*COUPLING, REF NODE=3, SURFACE=WALL-YMAX
*KINEMATIC
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*OBSTACLE, NAME=TOOL, TYPE=SPHERE, REF NODE=1
0.4, 0.5, 3.,  2.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, GROUND
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMAX, TOOL
*CONTACT PAIR, INTERACTION=DRY
BODY-XMAX, SIDE
*CONTACT PAIR, INTERACTION=DRY
WALL-YMIN, BODY-YMAX
*BOUNDARY
3, 1, 6, 0.
BODY-XMIN, 1, 1, 0.
BODY-YMIN, 2, 2, 0.
CENTRE, 1, 2, 0.
2, 1, 3, 0.
*STEP
*STATIC
0.25, 1.
*BOUNDARY
CENTRE, 3, 3, -0.02
CENTRE, 6, 6, 0.1
*CONTACT INTERFERENCE
BODY-ZMIN, GROUND, 1e-3
*CHANGE FRICTION, INTERACTION=DRY
*FRICTION
0.2
*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE
BODY-XMAX, SIDE
*NODE FILE, FREQUENCY=2
U, RF, CF
*CONTACT FILE
COPEN
*CONTACT PRINT
*NODE PRINT, NSET=BODY-XMIN, TOTALS=YES
U, RF, CF
*EL PRINT, ELSET=WALL
S, E, MISES, SP, EP
*EL PRINT, ELSET=PAD
S, E
*EL PRINT, ELSET=WALL, POSITION=CENTROIDAL
S, E, MISES, SP, EP
*EL FILE, POSITION=INTEGRATION POINTS
S, E, ERR, MISES, SP, EP
*EL FILE, POSITION=AVERAGED AT NODES
S
*EL FILE, POSITION=CENTROIDAL
E
*END STEP
"""

# For /accuracy, which is there where an accuracy chose the mesh.
ASKED = """\
*BLOCK, NAME=BODY, NX=4, NY=4, NZ=4
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, GROUND
*ACCURACY
0.5
*STEP
*STATIC
0.5, 1.
*BOUNDARY
BODY-ZMAX, 1, 1, 0.02
BODY-ZMAX, 2, 2, 0.
BODY-ZMAX, 3, 3, -0.02
*END STEP
"""

# Fields that refer to the undeformed body, at finite strain.
FINITE = """\
*BLOCK, NAME=BODY, NX=2, NY=3, NZ=3, TYPE=C3D8
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT
*STEP, NLGEOM
*STATIC
1., 1.
*BOUNDARY
BODY-ZMIN, 1, 3, 0.
BODY-ZMAX, 3, 3, 0.1
*EL FILE, POSITION=INTEGRATION POINTS
EG, PK2
*EL FILE, POSITION=AVERAGED AT NODES
*EL FILE, POSITION=CENTROIDAL
*END STEP
"""
MOVING = """\
*BLOCK, NAME=BODY, NX=1, NY=1, NZ=1, TYPE=C3D8
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=BODY, MATERIAL=SOFT
*STEP
*DYNAMIC, DIRECT
0.1, 0.2
*END STEP
"""


def section(heading):
    """Return the text of the page under a heading of the third level."""
    text = PAGE.read_text(encoding="utf-8")
    found = re.search(rf"^### `{re.escape(heading)}.*?(?=^##)", text, re.MULTILINE | re.DOTALL)
    if not found:
        raise AssertionError(f"{PAGE} has no section {heading}")
    return found[0]


def rows(text):
    """Return the tables' rows as lists of cells, without their heads."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    is_rule = [set("".join(row)) <= set("-") and row[0] != "" for row in cells]
    heads = {i - 1 for i, rule in enumerate(is_rule) if rule}
    return [row for i, row in enumerate(cells) if not is_rule[i] and i not in heads]


def listed_shapes(text):
    """Return the datasets of the first column and the shapes that each may have.

    Names share the shapes that follow them: "`gap` (T, P), `slip_increment`, `slip` (T, P, 2)".
    """
    shapes = {}
    for row in rows(text):
        waiting, done = [], True
        for name, shape in re.findall(r"`([^`]+)`|\(([^)]*)\)", row[0]):
            if name:
                waiting = [name] if done else [*waiting, name]
                done = False
                if name in shapes:
                    raise AssertionError(f"the page lists {name} twice")
                shapes[name] = []
            else:
                done = True
                for waits in waiting:
                    shapes[waits].append(shape)
    return shapes


def extents(shape, sizes):
    """Return the numbers of a shape of the page: (S N, 3), (8E), (E+1)."""
    numbers = []
    for part in shape.split(","):
        total = 0
        for term in part.split("+"):
            product = 1
            for factor in re.findall(r"\d+|[A-Z]", term):
                product *= int(factor) if factor.isdigit() else sizes[factor]
            total += product
        numbers.append(total)
    return tuple(numbers)


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        files = []
        for name, text in (("all", DECK), ("asked", ASKED), ("finite", FINITE),
                           ("moving", MOVING)):
            deck = Path(folder) / f"{name}.inp"
            deck.write_text(text)
            done = subprocess.run(
                [PROGRAM, str(deck), "--quiet"], cwd=folder, capture_output=True, text=True,
                timeout=600, check=False
            )
            if done.returncode != 0:
                raise AssertionError(done.stdout + done.stderr)
            files.append(cls.enterClassContext(h5py.File(deck.with_suffix(".vtkhdf"))))
        cls.file, cls.asked, cls.finite, cls.moving = files
        mesh, history = cls.file["VTKHDF"], cls.file["history"]
        cls.sizes = {
            "N": int(mesh["NumberOfPoints"][0]),
            "E": int(mesh["NumberOfCells"][0]),
            "S": int(mesh["Steps"].attrs["NSteps"]),
            "T": int(history.attrs["finished"]),
        }

    def datasets(self, group, file=None):
        """Return the datasets below a group by their names in it."""
        found = {}

        def note(name, item):
            if isinstance(item, h5py.Dataset):
                found[name] = item

        (file or self.file)[group].visititems(note)
        return found

    def check(self, group, listed, sizes, file=None):
        """Hold a group against what the page lists of it."""
        self.assertEqual(len(set(sizes.values())), len(sizes), f"{sizes}: shapes would be alike")
        found = self.datasets(group, file)
        self.assertEqual(sorted(found), sorted(listed), f"{group}: in the file, on the page")
        for name, shapes in listed.items():
            with self.subTest(dataset=f"{group}/{name}"):
                self.assertIn(found[name].shape, [extents(shape, sizes) for shape in shapes])
                for attribute in ("description", "quantity"):
                    self.assertTrue(found[name].attrs[attribute])

    def test_mesh_and_fields(self):
        listed = listed_shapes(section("/VTKHDF"))
        undeformed = {
            name: listed.pop(name) for name in list(listed) if re.search("pk2|green", name)
        }
        self.assertEqual(len(undeformed), 4)
        for name, shapes in undeformed.items():
            self.assertIn(self.finite["VTKHDF"][name].shape, [
                extents(shape, {"S": 1, "E": 18, "N": 48}) for shape in shapes
            ])
        for name in ("velocity", "acceleration"):
            shape, = listed.pop(f"PointData/{name}")
            self.assertEqual(self.moving[f"VTKHDF/PointData/{name}"].shape,
                             extents(shape, {"S": 2, "N": 8}))
        for group in ("PointData", "CellData"):
            offsets = listed.pop(f"Steps/{group}Offsets/<name>")
            names = [name for name in listed if name.startswith(f"{group}/")]
            for name in names:
                listed[f"Steps/{group}Offsets/{name.split('/')[1]}"] = offsets
        self.check("VTKHDF", listed, self.sizes)

    def test_gauss_points(self):
        listed = listed_shapes(section("/gauss"))
        undeformed = {name: listed.pop(name) for name in ("pk2_stress", "green_strain")}
        self.check("gauss/C3D8", listed, self.sizes)
        for name in undeformed:
            self.assertEqual(self.finite["gauss/C3D8"][name].shape, (1, 18, 8, 6))

    def test_histories(self):
        self.assertIn("All of these are (T).", section("/history"))
        listed = listed_shapes(section("/history"))
        moving = ("energy/kinetic", "energy/contact", "energy/damped", "error/in_time",
                  "error/angular_momentum")  # fmt: skip
        for name in moving:
            del listed[name]
            self.assertEqual(self.moving["history"][name].shape, (2,))
        self.check("history", {name: ["T"] for name in listed}, self.sizes)

    def test_pairs(self):
        of_all, of_obstacles, of_faces, of_surfaces, of_facets = (
            listed_shapes(part)
            for part in re.split("If the master (?:is|consists)", section("/contact"))
        )
        frames = set()
        for name, pair in self.file["contact"].items():
            sizes = {**self.sizes, "P": len(pair["node"])}
            here = of_all | of_obstacles
            if name == "WALL-YMIN:BODY-YMAX":
                here = of_all | of_faces | of_surfaces
                sizes["M"] = len(pair["master_node"])
            if name == "BODY-XMAX:SIDE":
                here |= of_faces | of_facets
                sizes |= {"C": 7, "F": 3}
            self.check(f"contact/{name}", here, sizes)
            frames.add(len(pair["frame"]))
        self.assertEqual(len(self.file["contact"]), 4)
        self.assertEqual(frames, {1, self.sizes["T"]})

    def test_reference_nodes(self):
        listed = listed_shapes(section("/reference_nodes"))
        self.check("reference_nodes", listed, self.sizes | {"R": 3})
        self.assertEqual(self.file["reference_nodes/node_id"][:].tolist(), [1, 2, 3])

    def test_springs(self):
        self.check("springs", listed_shapes(section("/springs")), self.sizes | {"G": 3})

    def test_sets(self):
        listed = listed_shapes(section("/sets"))
        kinds = [name.removesuffix("/<name>") for name in listed]
        self.assertEqual(sorted(self.file["sets"]), sorted(kinds))
        for name, item in self.datasets("sets").items():
            with self.subTest(set=name):
                (shape,) = listed[f"{name.partition('/')[0]}/<name>"]
                self.assertEqual(item.shape[1:], (2,) if shape == "n, 2" else ())
                self.assertGreater(len(item), 0)
                self.assertTrue(item.attrs["description"])
                self.assertEqual(item.attrs["quantity"], b"index")
        self.assertEqual(self.file["sets/reference_nodes/CENTRE"][:].tolist(), [0, 1, 2])

    def test_accuracy(self):
        listed = listed_shapes(section("/accuracy"))
        runs = len(self.asked["accuracy/elements"])
        self.check("accuracy", listed, {"K": runs, "T": 2, "C": 8}, self.asked)
        text = section("/accuracy")
        for name in self.asked["accuracy"].attrs:
            if name != "description":
                self.assertIn(f"`{name}`", text)

    def test_printed_sets(self):
        of_nodes, others = section("/print").split("Of a set of elements")
        of_elements, of_springs = others.split("Of the springs")
        self.assertEqual(sorted(self.file["print"]), ["1", "2", "3", "4"])
        sets = {"1": "BODY-XMIN", "2": "WALL", "3": "PAD", "4": "WALL"}
        for name, group in self.file["print"].items():
            ids = "node_id" if name == "1" else "element_id"
            listed = listed_shapes({"1": of_nodes, "3": of_springs}.get(name, of_elements))
            self.assertEqual(group.attrs["set"].decode(), sets[name])
            if name == "4":  # means of the elements
                del listed["n_points"]
            sizes = {k: v for k, v in self.sizes.items() if k == "T"} | {"P": len(group[ids])}
            self.check(f"print/{name}", listed, sizes)

    def test_counters_and_estimates(self):
        listed = [
            (name, row[1]) for row in rows(section("/run"))
            for name in re.findall(r"`(\w+)`", row[0])
        ]
        counters, estimates = (
            [name.decode() for name in self.file[f"run/{group}"].attrs["name"]]
            for group in ("counters", "estimates")
        )
        planned = [name for name, bound in listed if bound != "-"]
        counted = [name for name, bound in listed if "not counted" not in bound]
        self.assertEqual(sorted(estimates), sorted(planned), "in the file, on the page")
        self.assertEqual(sorted(counters), sorted(counted), "in the file, on the page")

    def test_every_group_has_a_section(self):
        text = PAGE.read_text(encoding="utf-8")
        groups = re.findall(r"^### `/(\w+)", text, re.MULTILINE)
        others = {"print", "reference_nodes", "gauss", "springs"}
        self.assertEqual(sorted(self.asked), sorted(set(groups) - others))
        self.assertEqual(sorted({*self.file, "accuracy"}), sorted(groups))
        for group in ("run", "checksums", "state"):
            for name in self.file[group]:
                self.assertIn(f"`{name}`", section(f"/{group}"))


if __name__ == "__main__":
    unittest.main()
