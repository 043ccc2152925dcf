"""Results in CalculiX's format: a reader by its fixed columns finds what the result holds."""

import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

sys.path[:0] = [str(Path(__file__).resolve().parents[n] / folder)
                for n, folder in ((1, "cases"), (0, ""))]  # fmt: skip

from boxes import DRY, FLOOR, SOFT, Box, on_corner  # noqa: E402
from program import SOURCE, Run  # noqa: E402

NODES = {1: 8, 2: 6, 3: 4, 4: 20, 5: 15, 6: 10, 7: 3, 8: 6, 9: 4, 10: 8}
LOAD = "*STEP\n*STATIC, DIRECT\n0.5, 1.\n*DSLOAD\nB-Z1, P, 7.\n{}*END STEP\n"
FIELDS = "*NODE FILE\nU, RF\n*EL FILE\nS\n"


def numbers(line, first, width=12):
    """Return the numbers in columns of a line from `first` on."""
    line = line.rstrip("\n")
    return [float(line[i : i + width]) for i in range(first, len(line), width)]


def read(path):
    """Return nodes, elements and blocks of a file, by the columns that cgx's manual names."""
    nodes, elements, blocks = {}, {}, []
    lines = iter(path.read_text().splitlines())
    for line in lines:
        if re.match(" {4}2C", line):
            count = int(line[24:36])
            assert line[73] == "1"
            for _ in range(count):
                line = next(lines)
                nodes[int(line[3:13])] = numbers(line, 13)
            assert next(lines) == " -3"
        elif re.match(" {4}3C", line):
            for _ in range(int(line[24:36])):
                line = next(lines)
                element, kind = int(line[3:13]), int(line[13:18])
                members = []
                while len(members) < NODES[kind]:
                    line = next(lines)
                    assert line[:3] == " -2"
                    members += [int(n) for n in numbers(line, 3, 10)]
                elements[element] = kind, members
            assert next(lines) == " -3"
        elif line.startswith("  100C"):
            time, count = float(line[12:24]), int(line[24:36])
            line = next(lines)
            assert line[:3] == " -4"
            name, n_components = line[5:13].strip(), int(line[13:18])
            components = [next(lines)[5:13].strip() for _ in range(n_components)]
            values = {}
            for _ in range(count):
                line = next(lines)
                values[int(line[3:13])] = numbers(line, 13)
            assert next(lines) == " -3"
            blocks.append((name, time, [c for c in components if c != "ALL"], values))
    assert line.strip() == "9999"
    return nodes, elements, blocks


class Frd(unittest.TestCase):
    def converted(self, deck, beside=""):
        """Return the result of a run, and what is read of its conversion."""
        run = Run(deck, name="frd")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        return result, read(result.to_frd(run.folder / "frd.frd")), run

    def test_it_is_read_back(self):
        for kind in ("C3D8", "C3D20", "C3D10", "C3D15", "C3D6", "C3D4"):
            with self.subTest(kind):
                box = Box("B", (2, 1, 1), (kind,))
                deck = box.cards() + SOFT + DRY + FLOOR + LOAD.format(on_corner("B") + FIELDS)
                result, (nodes, elements, blocks), _ = self.converted(deck)
                np.testing.assert_allclose(list(nodes.values()), result.points, rtol=1e-5)
                self.assertEqual(list(nodes), list(result.node_ids))
                # A middle of an edge lies between the corners of an edge of the cell.
                for kind_here, members in elements.values():
                    x = np.array([nodes[n] for n in members])
                    self.assertEqual(len(set(members)), NODES[kind_here])
                    for k, (a, b) in MIDDLES.get(kind_here, {}).items():
                        np.testing.assert_allclose(x[k], (x[a] + x[b]) / 2, atol=1e-6)
                names = [(name, time) for name, time, *_ in blocks]
                kinds = ("DISP", "FORC", "STRESS", "CONTACT")
                self.assertEqual(names, [(name, time) for time in (0.5, 1.0) for name in kinds])
                values = {name: np.array(list(of.values())) for name, _, _, of in blocks[4:]}
                u = result.field("displacement", on="nodes")
                np.testing.assert_allclose(values["DISP"], u, rtol=1e-5, atol=1e-12)
                np.testing.assert_allclose(values["STRESS"][:, 2], -7, rtol=1e-3)
                foot = np.isin(result.node_ids, box.side(2, 0))
                np.testing.assert_allclose(values["CONTACT"][foot, 3], 7, rtol=1e-3)
                self.assertFalse(values["CONTACT"][~foot].any())

    def test_the_command_writes_the_same(self):
        """Pyramids are hexahedra whose upper corners are one."""
        for name, wanted in (("C3D13", (4, 13)), ("C3D5", (1, 5))):
            box = Box("B", (1, 1, 1), (name,))
            deck = box.cards() + SOFT + DRY + FLOOR + LOAD.format(on_corner("B") + FIELDS)
            _, (nodes, elements, _), run = self.converted(deck)
            for kind, members in elements.values():
                self.assertEqual((kind, len(set(members))), wanted)
                x = np.array([nodes[n] for n in members])
                for k, (a, b) in MIDDLES.get(kind, {}).items():
                    np.testing.assert_allclose(x[k], (x[a] + x[b]) / 2, atol=1e-6)
        wanted = (run.folder / "frd.frd").read_text()
        (run.folder / "frd.frd").unlink()
        command = [sys.executable, SOURCE / "scripts" / "show", "--frd", run.file]
        done = subprocess.run(command, cwd=run.folder, capture_output=True, text=True, check=True)
        self.assertEqual(done.stdout, "frd.frd\n")
        self.assertEqual((run.folder / "frd.frd").read_text(), wanted)

    @unittest.skipUnless(shutil.which("cgx"), "CalculiX's viewer (cgx) is not installed")
    def test_cgx_reads_it(self):
        box = Box("B", (2, 1, 1), ("C3D20",))
        deck = box.cards() + SOFT + DRY + FLOOR + LOAD.format(on_corner("B") + FIELDS)
        _, (nodes, elements, blocks), run = self.converted(deck)
        (run.folder / "read.fbd").write_text("read frd.frd\nprnt st\nds 4\nsend all abq\nexit\n")
        done = subprocess.run(["cgx", "-bg", "read.fbd"], cwd=run.folder, capture_output=True,
                              text=True, timeout=120, check=False)  # fmt: skip
        self.assertIn(f"{len(nodes)} nodes", done.stdout)
        self.assertIn(f"{len(elements)} elements", done.stdout)
        self.assertIn(f"reading Dataset No:{len(blocks)}\n", done.stdout)
        self.assertRegex(done.stdout, "CONTACT +6")
        self.assertIn("TYPE=C3D20", (run.folder / "all.msh").read_text())

    @unittest.skipUnless(shutil.which("ccx"), "CalculiX (ccx) is not installed")
    def test_it_is_as_calculix_writes_it(self):
        """Same nodes, elements and columns; same displacements under a uniform strain."""
        for kind in ("C3D20", "C3D15", "C3D10"):
            with self.subTest(kind):
                box = Box("B", (1, 1, 1), (kind,), shift=0)
                sides = "*BOUNDARY\nB-Z0, 3\n"
                load = "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-Z1, 3, 3, -0.01\n"
                deck = box.cards().replace("*SURFACE, NAME=", "** ").replace(", TYPE=NODE", "")
                deck = re.sub(r"\*\* (B-.*)\nB-.*\n", "", deck) + SOFT + sides + on_corner("B")
                # CalculiX takes 16 numbers a line.
                deck = re.sub(r"^((\d+, ){12})(?=\d)", r"\1\n", deck, flags=re.MULTILINE)
                deck += load + "*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n"
                _, ours, run = self.converted(deck)
                (run.folder / "theirs.inp").write_text(deck)
                subprocess.run(["ccx", "theirs"], cwd=run.folder, capture_output=True, check=True,
                               timeout=120)  # fmt: skip
                theirs = read(run.folder / "theirs.frd")
                self.assertEqual(list(ours[0]), list(theirs[0]))
                self.assertEqual(ours[1], theirs[1])
                own, other = (next(b for b in of[2] if b[0] == "DISP") for of in (ours, theirs))
                self.assertEqual(own[2], other[2])
                u, v = (np.array(list(b[3].values())) for b in (own, other))
                np.testing.assert_allclose(u, v, atol=2e-5 * abs(v).max())


# Of cells of second order: the ends of the edges in whose middles nodes are, by their place.
MIDDLES = {
    4: {8: (0, 1), 9: (1, 2), 10: (2, 3), 11: (3, 0), 12: (0, 4), 13: (1, 5), 14: (2, 6),
        15: (3, 7), 16: (4, 5), 17: (5, 6), 18: (6, 7), 19: (7, 4)},
    5: {6: (0, 1), 7: (1, 2), 8: (2, 0), 9: (0, 3), 10: (1, 4), 11: (2, 5), 12: (3, 4),
        13: (4, 5), 14: (5, 3)},
    6: {4: (0, 1), 5: (1, 2), 6: (2, 0), 7: (0, 3), 8: (1, 3), 9: (2, 3)},
}  # fmt: skip

if __name__ == "__main__":
    unittest.main()
