"""Decks from elsewhere, ../shared/reference/finds3: far from the origin, bent ties, and others.

Where that folder is absent the whole file is skipped (status 77). Its name says `shared`, so that
the skip is allowed; nothing else is skipped here.
"""

import re
import sys
import unittest

import h5py
import numpy as np
from program import SOURCE, Run

FINDS = SOURCE.parent / "shared" / "reference" / "finds3"


def moved(text, shift):
    """The deck with the coordinates of its *NODE cards less a shift, rounded to 10 digits."""
    lines, nodes = [], False
    for line in text.splitlines():
        if line.startswith("*"):
            nodes = line.split(",")[0].strip().upper() == "*NODE"
        elif nodes:
            id_, *x = line.split(",")
            x = [round(float(v) - s, 10) for v, s in zip(x, shift, strict=True)]
            line = ", ".join([id_, *map(repr, x)])
        lines.append(line)
    return "\n".join(lines) + "\n"


class Finds(unittest.TestCase):
    """Each deck is solved; far away it is what it is at the origin."""

    def displacement(self, deck, name=None):
        """The displacements of a run, which must be solved."""
        run = Run(deck, name=name)
        self.assertEqual(run.status, 0, run.errors + run.output)
        with h5py.File(run.file) as file:
            return file["VTKHDF/PointData/displacement"][()]

    def test_far(self):
        """Displacements differ by what rounding of the coordinates, 1e-9 of the edges, explains."""
        for name, shift in (
            ("tie_far_from_origin", (5e5, 5e6, 0.0)),
            ("two_bodies_at_1e6", (1e6, 1e6, 1e6)),
        ):
            path = FINDS / f"{name}.inp"
            far = self.displacement(path)
            here = self.displacement(moved(path.read_text(), shift), name)
            np.testing.assert_allclose(far, here, rtol=0, atol=1e-6 * abs(here).max(), err_msg=name)

    def test_bent_tie(self):
        """A bent tie with refined elements is solved, as without *REFINE."""
        text = (FINDS / "bent_tie.inp").read_text()
        coarse = text[: text.index("*ELSET, ELSET=RF0")] + text[text.index("*SURFACE INTERACTION"):]
        fine, plain = self.displacement(text, "fine"), self.displacement(coarse, "plain")
        self.assertLess(abs(abs(fine).max() / abs(plain).max() - 1), 0.1)

    def test_estimate_of_a_bent_layer(self):
        """Bodies of one layer, whose middles the tie moves by rounding: an error below 100 %."""
        run = Run(FINDS / "mesh_estimate.inp")
        self.assertEqual(run.status, 0, run.errors)
        told = re.findall(r"estimated error of the energy: mesh ([\d.e+]+) %", run.output)
        errors = [float(error) for error in told]
        self.assertEqual(len(errors), 2)
        self.assertLess(max(errors), 100.0)

    def test_no_node_is_prescribed(self):
        """A node that slides onto its master is not called prescribed."""
        run = Run(FINDS / "free_node_called_prescribed.inp", mu=3, drag=2.2, inc=0.1)
        self.assertNotIn("is prescribed to move", run.errors)


if __name__ == "__main__":
    if not FINDS.is_dir():
        print(f"skipped: {FINDS} is not there")
        sys.exit(77)
    unittest.main()
