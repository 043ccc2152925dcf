"""Rigid surfaces of facets: before the obstacles that they are meshes of, and file before card."""

import math
import unittest

import numpy as np
from facets import binary_stl, plate, rigid, text_stl
from program import INPUT, Run
from two_bodies import block, deck, pair, step

HELD = "*BOUNDARY\n900, 1, 3\n"
ORIGIN = (900, (0.0, 0.0, 0.0))


def fixed_plate(name, low, high, ref=ORIGIN, **mesh):
    """Return the cards of a plate at rest and its surface `name`."""
    return rigid(name, *plate(low, high, **mesh), ref) + f"*BOUNDARY\n{ref[0]}, 1, 3\n"


class Facets(unittest.TestCase):
    """Runs that must be solved and certified."""

    def solve(self, text, *options, **files):
        """Run a deck that must be solved; return its result. `files` are written beside it."""
        run = Run(text, *options, name="deck") if not files else self.run_beside(text, files)
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result

    def run_beside(self, text, files):
        """Run a deck in a folder that has the files too."""
        import tempfile
        from pathlib import Path

        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for name, content in files.items():
            (Path(folder.name) / name.replace("_", ".")).write_bytes(content)
        path = Path(folder.name) / "deck.inp"
        path.write_text(text)
        return Run(path)


class AgainstObstacles(Facets):
    """Facets of a plane, and the plane itself."""

    def block_on(self, cards):
        """Run block.inp with other cards in place of its plane; return its pair."""
        text = (INPUT / "block.inp").read_text()
        start, end = text.index("*OBSTACLE"), text.index("*SURFACE INTERACTION")
        return self.solve(text[:start] + cards + text[end:]).file["contact/BODY-ZMIN:GROUND"]

    def test_block_on_plane(self):
        # Quadrilaterals and triangles, larger and smaller than the faces of the block, either side.
        want = self.block_on("*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n")
        force = want["resultant"][:]
        largest = np.abs(force).max()
        self.assertLess(abs(force[-1, 2] / 22191.84803 - 1), 1e-9)  # of the paper's run
        down = plate((-1.1, -1.2), (2.3, 2.1), (3, 2))
        reversed_facets = [f[::-1] for f in down[1]]
        for name, cards in {
            "one": fixed_plate("GROUND", (-1.1, -1.2), (2.3, 2.1)),
            "triangles": fixed_plate("GROUND", (-1.1, -1.2), (2.3, 2.1), n=(13, 11), split=True),
            "other side": rigid("GROUND", down[0], reversed_facets, ORIGIN, side="SNEG") + HELD,
            "shells": rigid("GROUND", *down, ORIGIN, types=("S3", "S4")) + HELD,
        }.items():
            with self.subTest(name):
                found = self.block_on(cards)
                self.assertLess(np.abs(found["resultant"][:] - force).max() / largest, 1e-8)
                self.assertTrue((found["status"][:] == want["status"][:]).all())
                self.assertLess(np.abs(found["slip"][:] - want["slip"][:]).max(), 1e-9)
                self.assertLess(np.abs(found["torque"][:] - want["torque"][:]).max(), 1e-8 * largest)
                # Of the face as it is deformed.
                covered = found["covered_area"][:].sum(axis=1)
                self.assertTrue((covered > 1.0).all() and (covered < 1.05).all())
                self.assertLess(np.abs(found["moment_left"][:]).max(), 1e-8 * largest)
                self.assertLess(np.abs(found["least_gap"][:]).max(), 1e-10)


if __name__ == "__main__":
    unittest.main()
