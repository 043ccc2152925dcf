"""Decks in which tools pass nodes and faces within an increment, ../shared/reference/finds3.

Where that folder is absent the whole file is skipped (status 77).
"""

import shutil
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from program import SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "finds3"


def solved(case, name, *options):
    """Return the open result of a deck that must be solved, and what was printed."""
    run = Run(SHARED / f"{name}.inp", *options)
    case.assertEqual(run.status, 0, run.errors)
    result = run.result()
    case.addCleanup(result.close)
    return result, run.output


class Finds(unittest.TestCase):
    def test_tools_deeper_than_their_radius_press(self):
        for name, force in (("deep_sphere", -20.86), ("deep_cylinder", -64.4)):
            with self.subTest(name=name):
                result, _ = solved(self, name)
                self.assertAlmostEqual(result.pairs[0].resultant[-1, 2], force, delta=0.05)

    def test_a_roller_pushes_the_fin_away(self):
        result, printed = solved(self, "tunnel_fin")
        self.assertIn("would pass the face", printed)
        # As in increments of 0.2.
        self.assertAlmostEqual(result.pairs[0].resultant[-1, 0], 3.816, delta=0.01)

    def test_facets_that_graze_past_are_met(self):
        # In one increment, cut where contact is missed, it is refused: an edge that lets go loses
        # energy at once there. In others it does not.
        with tempfile.TemporaryDirectory() as folder:
            for name in ("graze_stl.inp", "graze_stl_tool.stl"):
                shutil.copy(SHARED / name, folder)
            deck = Path(folder, "graze_stl.inp")
            deck.write_text(deck.read_text().replace("\n1.0, 1.0\n", "\n0.25, 1.0\n"))
            run = Run(deck)
        self.assertEqual(run.status, 0, run.errors)
        result, printed = run.result(), run.output
        self.addCleanup(result.close)
        self.assertIn("would pass the face", printed)
        force = result.pairs[0].resultant[:, 0]
        # With --refine 1 it is 0.825; dual functions of what is covered had 1.915 and 1.096.
        self.assertAlmostEqual(force.max(), 0.974, delta=0.01)
        self.assertEqual(force[-1], 0.0)

    def test_a_bump_under_a_node_is_measured_and_noted(self):
        result, printed = solved(self, "bump_between_nodes")
        self.assertIn("faces of A-ZMIN penetrate G between their nodes by up to 0.0295", printed)
        np.testing.assert_allclose(result.history("face_penetration")[-1], 0.0295, atol=1e-4)


if __name__ == "__main__":
    if not SHARED.is_dir():
        print(f"skipped: {SHARED} is absent")
        sys.exit(77)
    unittest.main()
