"""Bodies on bodies against an independent program, ../shared/reference/two_bodies.

It has mortar operators, contact solver and elements of its own. Where that folder is absent the
whole file is skipped (status 77). Its name says `shared`, so that the skip is allowed; nothing else
is skipped here.
"""

import csv
import importlib.util
import sys
import unittest

import numpy as np
from facets import plate, rigid
from program import SOURCE, Run

from studies.deck_cards import block, deck, pair, step

SHARED = SOURCE.parent / "shared" / "reference" / "two_bodies"
STEEL = 210000.0
SLIDE = (0.4 * np.cos(np.pi / 3), 0.4 * np.sin(np.pi / 3))


def rows(name):
    """Return the rows of a table as dictionaries of numbers where they are numbers."""
    with open(SHARED / name, newline="", encoding="utf-8") as file:
        return [
            {key: value if key == "master" else float(value) for key, value in row.items()}
            for row in csv.DictReader(file)
        ]


def column(table, *names):
    """Return columns of a table side by side."""
    return np.array([[row[name] for name in names] for row in table])


class Independent(unittest.TestCase):
    """Source: two_body_reference.py there; each case says its bodies and path."""

    def solve(self, text):
        """Run a deck that must be solved; return its result."""
        run = Run(text, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result

    def block_on_foundation(self, young, pressed, slid):
        """Case ii: a cube of 4 elements an edge on a foundation of 6, twice as large."""
        result = self.solve(
            deck(
                block("UP", 4, (0, 0, 0), (1, 1, 1), young=STEEL),
                block("LOW", 6, (-0.5, -0.5, -2), (2, 2, 2), young=young),
                pair("UP-ZMIN, LOW-ZMAX", 0.3),
                step("UP-ZMAX, 3, 3, -0.1", pressed),
                step(f"UP-ZMAX, 1, 1, {SLIDE[0]!r}\nUP-ZMAX, 2, 2, {SLIDE[1]!r}", slid),
                held="UP-ZMAX, 1, 2\nLOW-ZMIN, 1, 3",
            )
        )
        return result.file["contact/UP-ZMIN:LOW-ZMAX"]

    def test_ii_slide(self):
        want = rows("ii_slide.csv")
        found = self.block_on_foundation(70000.0, 10, 20)
        normal = column(want, "TN")[:, 0]
        error = np.abs(found["resultant"][:] - column(want, "TX", "TY", "TN")).max(axis=1)
        self.assertLess((error / normal).max(), 1e-6)
        status = found["status"][:]
        counts = np.array([[(row == code).sum() for code in (0, 1, 2)] for row in status])
        self.assertTrue((counts == column(want, "open", "stick", "slide")).all())
        # Node by node at the end; both number x first.
        points = rows("ii_slide_final_points.csv")
        place = np.lexsort(found["coordinates"][:].T[[2, 0, 1]])
        other = np.lexsort(column(points, "x", "y", "z").T[[2, 0, 1]])
        force = np.einsum("pa,pab->pb", found["reaction"][-1], found["frame"][-1])[place]
        self.assertLess(
            np.abs(force - column(points, "rx", "ry", "rz")[other]).max(), 1e-6 * normal[-1]
        )
        area = found["covered_area"][-1][place]
        self.assertLess(np.abs(area - column(points, "area")[other][:, 0]).max(), 1e-8)

    def test_iii_stiff_foundations(self):
        for row in rows("iii_limit.csv")[:2]:
            found = self.block_on_foundation(float(row["master"][2:]), 10, 40)["resultant"][:]
            self.assertLess(abs(found[9, 2] / row["TN10"] - 1), 1e-6)
            self.assertLess(abs(found[-1, 2] / row["TN50"] - 1), 1e-6)
            self.assertLess(abs(np.hypot(*found[-1, :2]) / row["TT50"] - 1), 1e-6)

    def test_iii_rigid_tools(self):
        want = rows("iii_rigid_tool.csv")
        for facets in (1, 5):
            result = self.solve(
                deck(
                    block("UP", 4, (0, 0, 0), (1, 1, 1), young=STEEL),
                    block("TOOL", (facets, facets, 1), (-1.1, -1.2, -1), (3.4, 3.3, 1)),
                    pair("UP-ZMIN, TOOL-ZMAX", 0.3),
                    step("UP-ZMAX, 3, 3, -0.1", 10),
                    step(f"UP-ZMAX, 1, 1, {SLIDE[0]!r}\nUP-ZMAX, 2, 2, {SLIDE[1]!r}", 40),
                    held="UP-ZMAX, 1, 2\nTOOL, 1, 3",
                )
            )
            found = result.file["contact/UP-ZMIN:TOOL-ZMAX/resultant"][:]
            error = np.abs(found - column(want, "TX", "TY", "TN")).max(axis=1)
            self.assertLess((error / column(want, "TN")[:, 0]).max(), 1e-8)

    def test_iii_rigid_facets(self):
        # The same tools as facets of a rigid body.
        want = rows("iii_rigid_tool.csv")
        for facets in (1, 5):
            corners, faces = plate((-1.1, -1.2), (2.3, 2.1), (facets, facets))
            result = self.solve(
                deck(
                    block("UP", 4, (0, 0, 0), (1, 1, 1), young=STEEL),
                    rigid("TOOL", corners, faces, (900, (0.0, 0.0, 0.0))),
                    pair("UP-ZMIN, TOOL", 0.3),
                    step("UP-ZMAX, 3, 3, -0.1", 10),
                    step(f"UP-ZMAX, 1, 1, {SLIDE[0]!r}\nUP-ZMAX, 2, 2, {SLIDE[1]!r}", 40),
                    held="UP-ZMAX, 1, 2\n900, 1, 3",
                )
            )
            found = result.file["contact/UP-ZMIN:TOOL"]
            error = np.abs(found["resultant"][:] - column(want, "TX", "TY", "TN")).max(axis=1)
            self.assertLess((error / column(want, "TN")[:, 0]).max(), 1e-8)
            status = found["status"][:]
            counts = np.array([[(row == code).sum() for code in (0, 1, 2)] for row in status])
            self.assertTrue((counts == column(want, "open", "stick", "slide")).all())

    def test_vii_turning_facets(self):
        # That program is run: its tool turns by 10 degrees. It takes the chord of the material;
        # here it is the point's as the tool stands halfway: the two differ by half an increment's
        # turn in the direction of the slip, and by half of that in increments of half the size.
        spec = importlib.util.spec_from_file_location("reference", SHARED / "two_body_reference.py")
        reference = importlib.util.module_from_spec(spec)
        sys.modules["reference"] = reference
        spec.loader.exec_module(reference)
        corners, faces = plate((-0.6, -0.6), (1.6, 1.6), (3, 3))
        corners[:, 2] = 1.0
        errors = []
        for increments in (10, 20):
            want = np.array(reference.turning_tool(steps=increments)[1])
            result = self.solve(
                deck(
                    block("LOW", 4, (0, 0, 0), (1, 1, 1), young=STEEL),
                    rigid("TOOL", corners, faces, (900, (0.5, 0.5, 1.0)), side="SNEG"),
                    pair("LOW-ZMAX, TOOL", 0.3),
                    step("900, 3, 3, -0.02"),
                    step(f"900, 6, 6, {np.deg2rad(10.0)!r}", increments),
                    held="LOW-ZMIN, 1, 3\n900, 1, 3",
                )
            )
            found = result.file["contact/LOW-ZMAX:TOOL"]
            force = found["resultant"][:]
            self.assertLess(abs(force[0, 2] / want[0, 2] - 1), 1e-8)  # not yet turned
            error = np.abs(force - want[:, [3, 4, 2]]).max(axis=1) / np.abs(want[:, 2])
            torque = np.abs(found["torque"][:, 2] + want[:, 5]) / np.abs(want[:, 5]).max()
            errors.append((error.max(), torque.max()))
        self.assertLess(max(errors[0]), 1e-3)
        self.assertLess(errors[1][0], 0.6 * errors[0][0])
        self.assertLess(errors[1][1], 0.6 * errors[0][1])

    def test_v_symmetric(self):
        for row in rows("v_symmetric.csv"):
            result = self.solve(
                deck(
                    block("UP", 4, (0, 0, 0), (1, 1, 1), young=STEEL),
                    block("LOW", int(row["n_low"]), (0, 0, -1), (1, 1, 1), young=STEEL),
                    pair("UP-ZMIN, LOW-ZMAX"),
                    step("UP-ZMAX, 3, 3, -0.02\nLOW-ZMIN, 3, 3, 0.02"),
                    held="UP-ZMAX, 1, 2\nLOW-ZMIN, 1, 2",
                    tolerance=1e-12,
                )
            )
            found = result.file["contact/UP-ZMIN:LOW-ZMAX/resultant"][-1][2]
            self.assertLess(abs(found / row["TN_two"] - 1), 1e-12)

    def test_vi_stack(self):
        want = rows("vi_stack_middle.csv")
        result = self.solve(
            deck(
                block("LOW", 3, (0, 0, -1), (1, 1, 1), young=STEEL),
                block("MID", 4, (0.1, 0.1, 0), (0.8, 0.8, 0.8), young=STEEL),
                block("UP", 3, (0, 0, 0.8), (1, 1, 1), young=STEEL),
                pair("MID-ZMIN, LOW-ZMAX", 0.3),
                pair("MID-ZMAX, UP-ZMIN", 0.2, number=2),
                step("UP-ZMAX, 3, 3, -0.03", 5),
                step("UP-ZMAX, 1, 1, 0.1\nUP-ZMAX, 2, 2, 0.05", 10),
                held="UP-ZMAX, 1, 2\nLOW-ZMIN, 1, 3",
            )
        )
        for number, name in (("1", "MID-ZMIN:LOW-ZMAX"), ("2", "MID-ZMAX:UP-ZMIN")):
            found = result.file[f"contact/{name}"]
            wanted = column(want, *(f"R{number}{axis}" for axis in "xyz"))
            error = np.abs(found["resultant"][:] - wanted).max(axis=1)
            self.assertLess((error / np.abs(wanted).max(axis=1)).max(), 1e-6)
            counts = np.array(
                [[(row == code).sum() for code in (0, 1, 2)] for row in found["status"][:]]
            )
            self.assertTrue(
                (
                    counts == column(want, *(word + number for word in ("open", "stick", "slide")))
                ).all()
            )
        mid = slice(4**3, 4**3 + 5**3)
        moved = np.array(
            [result.field("displacement", i)[mid].mean(axis=0) for i in range(len(want))]
        )
        self.assertLess(np.abs(moved - column(want, "mid_ux", "mid_uy", "mid_uz")).max(), 1e-9)


if __name__ == "__main__":
    if not SHARED.is_dir():
        print(f"skipped: there is no {SHARED}")
        sys.exit(77)
    unittest.main()
