"""*NODE PRINT and *EL PRINT: sets of nodes and elements as tables of text beside the result."""

import csv
import os
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from program import PROGRAM, Result, Run

# A block that is pressed on a plane and pushed along it, warmer than at first.
DECK = """*BLOCK, NAME=A, NX=3, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*EXPANSION
1e-4
*SOLID SECTION, ELSET=A, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
A-ZMIN, FLOOR
*ELSET, ELSET=TWO
4, 9
*STEP
*STATIC, DIRECT
0.2, 1.
*BOUNDARY
A-ZMAX, 1, 2
A-ZMAX, 3, 3, -0.02
*CLOAD
A-XMIN, 1, 0.1
*NODE FILE
U, RF, CF
*EL FILE, POSITION=INTEGRATION POINTS
S, E, MISES, SP, EP
*EL FILE, POSITION=CENTROIDAL
S
{first}*END STEP
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
A-ZMAX, 1, 1, 0.02
*TEMPERATURE
A, 20.
{second}*END STEP
"""
NODES = "*NODE PRINT, NSET=A-ZMAX, TOTALS=YES, FREQUENCY=2\nU, RF\n"
FORCES = "*NODE PRINT, NSET=A, TOTALS=ONLY\nRF, CF\n"
POINTS = "*EL PRINT, ELSET=TWO\nS, E\nMISES, SP, EP\n"
MEANS = "*EL PRINT, ELSET=TWO, POSITION=CENTROIDAL, FREQUENCY=3\nS, MISES\n"
AXES = ("x", "y", "z")
TENSOR = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")


def table(folder, kind, name="press"):
    """Return a table's head and its rows as dictionaries."""
    with (folder / f"{name}.{kind}.csv").open(newline="") as file:
        reader = csv.DictReader(file)
        return reader.fieldnames, list(reader)


def numbers(row, title, parts, unit):
    """Return some columns of a row, None where they are empty."""
    found = [row[f"{title} {part} [{unit}]"] for part in parts]
    return None if set(found) == {""} else np.array(found, float)


class PrintedSets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_ = Run(DECK.format(first=NODES + POINTS, second=FORCES + MEANS), name="press")
        if cls.run_.status != 0:
            raise AssertionError(cls.run_.errors)
        cls.result = cls.enterClassContext(Result(cls.run_.file))

    def row_of(self, line):
        """Return the increment of a line, from 0."""
        step, increment = self.result.history("step"), self.result.history("increment")
        at = np.flatnonzero((step == int(line["step"])) & (increment == int(line["increment"])))
        self.assertEqual(len(at), 1)
        self.assertEqual(float(line["time [time]"]), self.result.history("time")[at[0]])
        return int(at[0])

    def test_nodes(self):
        head, lines = table(self.run_.folder, "node")
        self.assertEqual(head[:5], ["step", "increment", "time [time]", "set", "node"])
        self.assertEqual(len(head), 5 + 9)
        ids = self.result.node_ids
        top = [line for line in lines if line["set"] == "A-ZMAX"]
        # Every second increment and the last of a step: 2, 4, 5 and 2.
        asked = sorted({self.row_of(line) for line in top})
        self.assertEqual(asked, [1, 3, 4, 6])
        self.assertEqual(len(top), 4 * (12 + 1))
        for line in top:
            row = self.row_of(line)
            force = self.result.field("reaction_force", row)
            self.assertIsNone(numbers(line, "applied force", AXES, "force"))
            if line["node"] == "total":
                self.assertIsNone(numbers(line, "displacement", AXES, "length"))
                at = self.result.points[:, 2] == 1
                np.testing.assert_allclose(
                    numbers(line, "reaction force", AXES, "force"), force[at].sum(axis=0),
                    rtol=1e-13, atol=1e-13 * np.abs(force).max(),
                )
                continue
            at = list(ids).index(int(line["node"]))
            self.assertEqual(self.result.points[at, 2], 1)
            np.testing.assert_array_equal(
                numbers(line, "displacement", AXES, "length"),
                self.result.field("displacement", row)[at],
            )
            np.testing.assert_array_equal(numbers(line, "reaction force", AXES, "force"), force[at])

    def test_totals_are_the_resultants(self):
        """What the supports hold is what the loads and the plane do, with the other sign."""
        _, lines = table(self.run_.folder, "node")
        lines = [line for line in lines if line["set"] == "A"]
        self.assertEqual(len(lines), self.result.finished)
        pair = self.result.pairs[0]
        for line in lines:
            self.assertEqual(line["node"], "total")
            row = self.row_of(line)
            held, loads = (numbers(line, f"{name} force", AXES, "force")
                           for name in ("reaction", "applied"))
            np.testing.assert_allclose(loads, [1.2 * min(1, 0.2 * (row + 1)) * 0.75, 0, 0],
                                       atol=1e-9)
            np.testing.assert_allclose(held + loads + pair.resultant[row], 0, atol=1e-7)

    def test_elements(self):
        head, lines = table(self.run_.folder, "element")
        self.assertEqual(head[:6], ["step", "increment", "time [time]", "set", "element", "point"])
        self.assertEqual(len(head), 6 + 6 + 6 + 1 + 3 + 3)
        points = [line for line in lines if line["point"]]
        means = [line for line in lines if not line["point"]]
        self.assertEqual(len(points), self.result.finished * 2 * 8)
        self.assertEqual(sorted({self.row_of(line) for line in means}), [2, 4, 6])
        self.assertEqual(len(means), 3 * 2)
        ids = list(self.result.element_ids)
        for line in points:
            row, at = self.row_of(line), ids.index(int(line["element"]))
            self.assertIn(int(line["element"]), (4, 9))
            for name, parts, unit in (("stress", TENSOR, "pressure"), ("strain", TENSOR, "strain"),
                                      ("principal stress", "123", "pressure"),
                                      ("principal strain", "123", "strain")):
                field = self.result.field(name.replace(" ", "_"), row, on="gauss points")[at]
                want = field.reshape(8, -1)[int(line["point"]) - 1]
                np.testing.assert_array_equal(numbers(line, name, parts, unit), want)
            field = self.result.field("von_mises", row, on="gauss points")[at]
            want = field[int(line["point"]) - 1]
            self.assertEqual(float(line["von Mises [pressure]"]), want)
        for line in means:
            at = ids.index(int(line["element"]))
            want = self.result.field("stress", self.row_of(line))[at]
            np.testing.assert_array_equal(numbers(line, "stress", TENSOR, "pressure"), want)
            self.assertIsNone(numbers(line, "strain", TENSOR, "strain"))
            s = want[[0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(3, 3)
            deviator = s - np.trace(s) / 3 * np.eye(3)
            self.assertAlmostEqual(float(line["von Mises [pressure]"]),
                                   np.sqrt(1.5 * (deviator**2).sum()), delta=1e-10)

    def test_local_directions_are_not_those_of_the_table(self):
        local = "*TRANSFORM, NSET=A-ZMAX\n2., 1., 0.5,  -1., 3., 0.4\n"
        text = DECK.format(first=NODES, second="").replace("*STEP", local + "*STEP", 1)
        run = Run(text, name="press")
        self.assertEqual(run.status, 0, run.errors)
        _, lines = table(run.folder, "node")
        with Result(run.file) as result:
            line = next(line for line in lines if line["node"] != "total")
            at = list(result.node_ids).index(int(line["node"]))
            for title, field, unit in (("displacement", "displacement", "length"),
                                       ("reaction force", "reaction_force", "force")):
                np.testing.assert_array_equal(
                    numbers(line, title, AXES, unit), result.field(field, 1)[at]
                )

    def test_without_the_cards_there_are_none_nor_older_ones(self):
        run = Run(DECK.format(first=NODES + POINTS, second=""), name="press")
        for kind in ("node", "element"):
            self.assertTrue((run.folder / f"press.{kind}.csv").is_file())
        run.deck.write_text(DECK.format(first="", second=""))
        done = subprocess.run(
            [PROGRAM, "press.inp", "--overwrite"], cwd=run.folder, capture_output=True, check=False
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        for kind in ("node", "element"):
            self.assertFalse((run.folder / f"press.{kind}.csv").exists())

    def test_a_run_that_is_not_solved_has_the_lines_before(self):
        pulled = ("*STEP\n*STATIC\n1., 1.\n*BOUNDARY, OP=NEW\nA-XMIN, 2\n*CLOAD\nA-ZMAX, 3, 9.\n"
                  "*END STEP\n")
        run = Run(DECK.format(first=FORCES, second="") + pulled, name="press")
        self.assertEqual(run.status, 2, run.errors)
        _, lines = table(run.folder, "node")
        with run.result() as result:
            self.assertEqual(len(lines), result.finished)

    def test_a_table_takes_no_input_s_place(self):
        run = Run(DECK.format(first=NODES, second=""), "--plan", name="press")
        for kind in ("node", "element"):
            deck = run.folder / f"press.{kind}.csv"
            deck.write_text(run.deck.read_text())
            done = subprocess.run(
                [PROGRAM, deck.name, "-o", "press"], cwd=run.folder, capture_output=True, text=True,
                check=False,
            )
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertEqual(deck.read_text(), run.deck.read_text())

    def test_totals_on_a_refined_mesh(self):
        """The force on the whole side, new nodes too; lines of nodes are those of the deck's."""
        run = Run(DECK.format(first=NODES, second=""), "--refine", "1", name="press")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            at = result.points[:, 2] == 1
            forces = [result.field("reaction_force", i)[at].sum(axis=0) for i in range(2)]
            total = result.file["print/1/total_reaction_force"][:2]
            np.testing.assert_allclose(total, forces, atol=1e-12 * np.abs(forces).max())
            self.assertEqual(result.file["print/1/node_id"].size, 12)
            self.assertGreater(np.count_nonzero(at), 12)

    def test_an_empty_set_is_noted(self):
        empty = "*NSET, NSET=NOTHING\n" + "*STEP"
        text = DECK.format(first="*NODE PRINT, NSET=NOTHING\nU\n", second="")
        run = Run(text.replace("*STEP", empty, 1), name="press")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("*NODE PRINT of 'NOTHING' writes nothing", run.output + run.errors)
        self.assertFalse((run.folder / "press.node.csv").exists())


if __name__ == "__main__":
    os.environ.setdefault("BIPOT_SOURCE", str(Path(__file__).resolve().parents[2]))
    unittest.main()
