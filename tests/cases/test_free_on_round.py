"""Bodies that no support holds, in round obstacles: no load drives what contact leaves free."""

import unittest

import h5py
import numpy as np
from program import Run


def dome(n, pressure=5.0, turned=False, held=False):
    """A deck: a dome of n x n x 2 elements stands on its pole in a wider spherical cup.

    `turned`: along x instead of z. `held`: its middle planes are held across themselves.
    """
    ids, lines = {}, []
    for k in range(3):
        for j in range(n + 1):
            for i in range(n + 1):
                x, y = i / n - 0.5, j / n - 0.5
                low = 1.5 - np.sqrt(2.25 - x * x - y * y)
                place = np.array([x, y, low + (0.5 - low) * k / 2])
                ids[i, j, k] = len(lines) + 1
                place = np.roll(place, 1) if turned else place
                lines.append(", ".join(map(str, [ids[i, j, k], *map(float, place)])))
    elements = []
    for k in range(2):
        for j in range(n):
            for i in range(n):
                corners = [ids[i + a, j + b, k + c] for c in (0, 1)
                           for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]  # fmt: skip
                elements.append(", ".join(map(str, [len(elements) + 1, *corners])))
    centre = "3., 0., 0., 3." if turned else "0., 0., 3., 3."
    axes = (2, 3) if turned else (1, 2)
    supports = "".join(f"{ids[n // 2, j, k]}, {axes[0]}\n{ids[j, n // 2, k]}, {axes[1]}\n"
                       for j in range(n + 1) for k in range(3))  # fmt: skip
    return "\n".join([
        "*HEADING", "a dome in a cup", "*NODE", *lines,
        "*ELEMENT, TYPE=C3D8, ELSET=A", *elements,
        "*SURFACE, NAME=BOTTOM", *(f"{e + 1}, S1" for e in range(n * n)),
        "*SURFACE, NAME=TOP", *(f"{e + 1}, S2" for e in range(n * n, 2 * n * n)),
        "*MATERIAL, NAME=M", "*ELASTIC", "1000., 0.3", "*SOLID SECTION, ELSET=A, MATERIAL=M",
        "*OBSTACLE, NAME=CUP, TYPE=SPHERE, INNER", centre, "*SURFACE INTERACTION, NAME=I",
        "*CONTACT PAIR, INTERACTION=I", "BOTTOM, CUP",
        *(["*BOUNDARY", supports.rstrip()] if held else []),
        "*STEP", "*STATIC", "0.5, 1.", "*DSLOAD", f"TOP, P, {pressure!r}", "*END STEP", "",
    ])  # fmt: skip


class FreeBodies(unittest.TestCase):
    """Domes that stand on their pole, and on its neighbours."""

    def normal_forces(self, deck, name):
        """The normal reactions at the end of a run, which must be solved, and the resultant."""
        run = Run(deck, name=name)
        self.assertEqual(run.status, 0, run.errors)
        with h5py.File(run.file) as file:
            pair = next(iter(file["contact"].values()))
            return pair["reaction"][-1][:, 0], pair["resultant"][-1]

    def test_as_if_held(self):
        """Supports that symmetry leaves without forces change nothing."""
        for n, pressure in ((2, 5.0), (4, 0.5)):
            self.compare(n, pressure)

    def test_as_if_held_where_more_than_the_pole_presses(self):
        """The neighbours touch within the increment; what swings is brought to rest."""
        for n, pressure in ((4, 5.0), (4, 20.0), (6, 5.0), (8, 2.0)):
            self.compare(n, pressure)

    def compare(self, n, pressure):
        with self.subTest(n=n, pressure=pressure):
            free, force = self.normal_forces(dome(n, pressure), "free")
            held, _ = self.normal_forces(dome(n, pressure, held=True), "held")
            np.testing.assert_allclose(free, held, rtol=0, atol=1e-6 * held.max())
            np.testing.assert_allclose(force, [0.0, 0.0, pressure], rtol=0, atol=1e-7 * pressure)

    def test_along_another_axis(self):
        """The pole of a coarse dome presses alone: all of the load, wherever it points."""
        for n, n_pressed in ((2, 1), (4, 5)):
            normal, force = self.normal_forces(dome(n, turned=True), "turned")
            self.assertEqual(np.count_nonzero(normal), n_pressed)
            np.testing.assert_allclose(force, [5.0, 0.0, 0.0], rtol=0, atol=5e-7)


if __name__ == "__main__":
    unittest.main()
