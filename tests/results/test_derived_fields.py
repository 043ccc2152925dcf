"""Fields that follow from others: von Mises' stress, principal values, penetration, loads."""

import csv
import os
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from program import PROGRAM, Result, Run
from two_bodies import solved

PLACES = ("nodes", "elements", "gauss points")
# A block pressed into another, which its master's nodes enter between the slave's; a plane holds.
DECK = """*BLOCK, NAME=A, NX=2, NY=3, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=B, NX=4, NY=3, NZ=1
0., 0., 1.,  1., 1., 0.5
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
A-ZMIN, FLOOR
*CONTACT PAIR, INTERACTION=I
A-ZMAX, B-ZMIN
*STEP
*STATIC
0.5, 1.
*DSLOAD
B-ZMAX, P, 20.
*CLOAD
9, 1, 0.5
*NODE FILE
U, RF, CF
*EL FILE, POSITION=AVERAGED AT NODES
S, E, MISES, SP, EP
*EL FILE, POSITION=INTEGRATION POINTS
*EL FILE, POSITION=CENTROIDAL
*CONTACT FILE
COPEN
*END STEP
"""


class DerivedFields(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.result = solved(cls(), DECK)

    def tensors(self, name, on, step):
        """Return symmetric matrices, one a place: (n, 3, 3)."""
        flat = self.result.field(name, step, on=on).reshape(-1, 6)
        return flat[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]

    def test_von_mises(self):
        for on in PLACES:
            for step in (0, 1):
                stress = self.tensors("stress", on, step)
                mean = np.trace(stress, axis1=1, axis2=2) / 3
                deviator = stress - mean[:, None, None] * np.eye(3)
                want = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
                found = self.result.field("von_mises", step, on=on).reshape(-1)
                np.testing.assert_allclose(found, want, rtol=1e-12, atol=1e-12)
                self.assertGreater(found.max(), 5)

    def test_principal_values(self):
        for on in PLACES:
            for name in ("stress", "strain"):
                tensor = self.tensors(name, on, -1)
                found = self.result.field(f"principal_{name}", -1, on=on).reshape(-1, 3)
                scale = np.abs(tensor).max()
                np.testing.assert_allclose(
                    found, np.linalg.eigvalsh(tensor)[:, ::-1], rtol=0, atol=1e-13 * scale
                )

    def test_penetration(self):
        """At the points of the quadrature the faces overlap where the slave's nodes only touch."""
        found = self.result.field("contact_penetration", -1)
        want = np.zeros_like(found)
        for pair in self.result.pairs.values():
            group = self.result.file[f"contact/{pair.name}"]
            gap = group["least_gap" if "least_gap" in group else "gap"][-1]
            np.maximum.at(want, group["node"][:], -gap)
        np.testing.assert_array_equal(found, want)
        self.assertGreater(found.max(), 1e-6)

    def test_loads(self):
        for step, part in ((0, 0.5), (1, 1.0)):
            found = self.result.field("applied_force", step)
            np.testing.assert_allclose(
                found.sum(axis=0), [0.5 * part, 0, -20 * part], rtol=0, atol=1e-12
            )
            self.assertEqual(found[8, 0], 0.5 * part)


class ContactTable(unittest.TestCase):
    """*CONTACT PRINT: what the pairs add up to, as text beside the result."""

    PRINT = DECK.replace("*CONTACT FILE\nCOPEN\n", "*CONTACT PRINT, TOTALS=ONLY\nCF, CSTR\n")

    def rows(self, folder, name):
        """Return the table's head and its rows as dictionaries."""
        with (folder / f"{name}.contact.csv").open(newline="") as file:
            reader = csv.DictReader(file)
            return reader.fieldnames, list(reader)

    def compare(self, run, name, rows, pairs=("A-ZMIN:FLOOR", "A-ZMAX:B-ZMIN")):
        """Hold every row against what the datasets of the points add up to."""
        with Result(run.folder / f"{name}.vtkhdf") as result:
            self.assertEqual(len(rows), len(pairs) * result.finished)
            for i, row in enumerate(rows):
                k, pair = divmod(i, len(pairs))
                group = result.file[f"contact/{pairs[pair]}"]
                self.assertEqual(row["pair"], pairs[pair])
                for column in ("step", "increment", "time [time]"):
                    history = result.history(column.split(" ")[0])
                    self.assertEqual(float(row[column]), history[k])
                for vector, quantity in (("resultant", "force"), ("moment", "moment"),
                                         ("torque", "moment")):
                    found = [row[f"{vector} {axis} [{quantity}]"] for axis in "xyz"]
                    if vector in group:
                        np.testing.assert_array_equal(np.array(found, float), group[vector][k])
                    else:
                        self.assertEqual(found, ["", "", ""])
                area = group["covered_area"][k] if "covered_area" in group else group["area"][:]
                normal = group["reaction"][k][:, 0]
                pressure = np.where(area > 0, normal / np.maximum(area, 1e-30), 0)
                np.testing.assert_allclose(
                    [float(row["contact area [area]"]), float(row["largest pressure [pressure]"]),
                     float(row["largest slip [length]"])],
                    [area[group["status"][k] != 0].sum(), pressure.max(),
                     np.linalg.norm(group["slip"][k], axis=1).max()],
                    rtol=1e-13, atol=1e-300,
                )

    def test_the_table_is_what_the_points_add_up_to(self):
        run = Run(self.PRINT, name="press")
        self.assertEqual(run.status, 0, run.errors)
        head, rows = self.rows(run.folder, "press")
        self.assertEqual(len(head), 16)
        self.compare(run, "press", rows)
        self.assertAlmostEqual(float(rows[2]["resultant z [force]"]), 20.0, delta=1e-6)
        self.assertAlmostEqual(float(rows[2]["contact area [area]"]), 1.0, delta=1e-12)

    def test_without_the_card_there_is_none_nor_an_older_one(self):
        run = Run(self.PRINT, name="press")
        self.assertTrue((run.folder / "press.contact.csv").is_file())
        run.deck.write_text(DECK)
        done = subprocess.run(
            [PROGRAM, "press.inp", "--overwrite"], cwd=run.folder, capture_output=True, check=False
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertFalse((run.folder / "press.contact.csv").exists())

    def test_a_run_that_is_not_solved_has_the_rows_before(self):
        text = self.PRINT + "*STEP\n*STATIC\n1., 1.\n*DSLOAD\nB-ZMAX, P, -1.\n*END STEP\n"
        run = Run(text, name="pulled")
        self.assertEqual(run.status, 2, run.errors)
        _, rows = self.rows(run.folder, "pulled")
        self.assertGreaterEqual(len(rows), 4)
        self.compare(run, "pulled", rows)

    def test_it_takes_no_input_s_place(self):
        run = Run(self.PRINT, "--plan", name="press")
        (run.folder / "press.contact.csv").write_text(self.PRINT)
        done = subprocess.run(
            [PROGRAM, "press.contact.csv", "-o", "press"], cwd=run.folder, capture_output=True,
            text=True, check=False,
        )
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual((run.folder / "press.contact.csv").read_text(), self.PRINT)


if __name__ == "__main__":
    os.environ.setdefault("BIPOT_SOURCE", str(Path(__file__).resolve().parents[2]))
    unittest.main()
