"""Bolts that are cut: *PRE-TENSION SECTION.

A bar of length 4 and unit area, held at both ends, is cut in its middle; a force F on the reference
node gives the stress F / A everywhere and moves the cut by F L / (E A), whatever the elements are. A
bolt beside a clamped column: springs in parallel.
"""

import re
import unittest

import numpy as np
from boxes import DRY, Box
from program import Run

YOUNG = 1000.0
FACES = {
    4: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    5: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
CORNERS = {"C3D10": 4, "C3D15": 6, "C3D20": 8, "C3D20R": 8}
MATERIAL = f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG}, 0.3\n"


def faces_at(box, axis, place, upper=False):
    """Return the lines of *SURFACE for a cut across an axis: element, face, of one of its sides."""
    lines = []
    for kind, elements in box.elements.items():
        n = CORNERS.get(kind, int(kind[3]))
        for element, *nodes in elements:
            x = np.array([box.x[node - box.first][axis] for node in nodes[:n]])
            if upper != (x.mean() > place):
                continue
            for i, face in enumerate(FACES[n]):
                if np.all(abs(x[list(face)] - place) < 1e-9):
                    lines.append(f"{element}, S{i + 1}")
    return "\n".join(lines)


def section(box, node, place=2.0, normal="0., 0., 1.", upper=False):
    """Return the cards of a section across z and its reference node."""
    return (
        f"*NODE\n{node}, 0., 0., 9.\n*SURFACE, NAME=CUT{node}, TYPE=ELEMENT\n"
        f"{faces_at(box, 2, place, upper)}\n*PRE-TENSION SECTION, SURFACE=CUT{node}, NODE={node}\n"
        f"{normal}\n"
    ).replace("\n\n", "\n")


def bar(kinds, steps, normal="0., 0., 1.", upper=False, nlgeom=""):
    """Return a bar that is cut: its ends held along z, its bottom also across at three nodes."""
    box = Box("B", (1, 1, 4), kinds, size=(1, 1, 4), shift=0)
    corner, along, across = (
        next(n for n in box.side(2, 0) if tuple(box.x[n - 1][:2]) == xy)
        for xy in ((0, 0), (1, 0), (0, 1))
    )
    return (
        box.cards() + MATERIAL + section(box, 9000, normal=normal, upper=upper)
        + f"*BOUNDARY\nB-Z0, 3, 3\nB-Z1, 3, 3\n{corner}, 1, 2\n{along}, 2, 2\n"
        + f"*STEP{nlgeom}\n*STATIC\n1., 1.\n{steps}*END STEP\n"
    )


class Bars(unittest.TestCase):
    """A bar between two ends that are held."""

    def reference(self, run, field):
        """Return a field of the reference node at the end."""
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            return np.array(getattr(result.reference_nodes[9000], field))[-1]

    def test_a_force_is_the_tension(self):
        for kinds in (["C3D8"], ["C3D6"], ["C3D4"], ["C3D10"], ["C3D15"], ["C3D20"], ["C3D20R"]):
            with self.subTest(kinds):
                run = Run(bar(kinds, "*CLOAD\n9000, 1, 5.\n"), name="bar")
                moved = self.reference(run, "displacement")
                np.testing.assert_allclose(moved, [5 * 4 / YOUNG, 0, 0], atol=1e-9)


if __name__ == "__main__":
    unittest.main()
