"""Bodies whose surfaces are all their outer faces: a face acts on what it sees."""

import itertools
import unittest

import numpy as np
from program import Run

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
"""


def turned(*angles):
    """A rotation about x, then y, then z."""
    result = np.eye(3)
    for axis, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(3)
        a, b = [k for k in range(3) if k != axis]
        turn[a, a] = turn[b, b] = c
        turn[a, b], turn[b, a] = (-s, s) if axis != 1 else (s, -s)
        result = turn @ result
    return result


# Its space diagonal is upright.
ON_A_CORNER = turned(np.pi / 4, -np.arctan(np.sqrt(0.5)), 0.0)


class Bar:
    """A box of one element, or of several along x, with all outer faces as its surface."""

    def __init__(self, name, first, size, turn=None, n=1):
        self.name, self.first, self.n, self.faces = name, first, n, name
        turn = np.eye(3) if turn is None else turn
        x = [
            np.multiply((i / n - 0.5, j - 0.5, k - 0.5), size)
            for i, k, j in itertools.product(range(n + 1), range(2), range(2))
        ]
        self.x = np.array(x) @ np.transpose(turn)

    def cards(self):
        number = [self.first + i for i in range(len(self.x))]
        lines = [f"*NODE, NSET={self.name}"]
        places = list(zip(number, self.x.tolist(), strict=True))
        lines += [f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in places]
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={self.name}")
        for e in range(self.n):
            k = 4 * e
            nodes = [k, k + 4, k + 5, k + 1, k + 2, k + 6, k + 7, k + 3]
            lines.append(", ".join(map(str, [self.first + e, *(number[i] for i in nodes)])))
        lines.append(f"*SOLID SECTION, ELSET={self.name}, MATERIAL=M")
        for end, of in (("LOW", self.x[:, 2].min()), ("TOP", self.x[:, 2].max())):
            there = [str(i) for i, x in places if abs(x[2] - of) < 1e-9]
            lines.append(f"*NSET, NSET={self.name}{end}\n{', '.join(there)}")
        lines.append(f"*SURFACE, NAME=S{self.name}\n{self.faces}")
        return "\n".join(lines) + "\n"


def deck(one, other, step, options="", increments=2):
    """One is the slave and moves; the lowest nodes of the other are held."""
    return (
        f"*HEADING\nall outer faces\n{one.cards()}{other.cards()}{MATERIAL}"
        "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\n"
        f"S{one.name}, S{other.name}\n"
        f"*STEP{options}\n*STATIC\n{1 / increments!r}, 1.\n{step}*END STEP\n"
    )


class ApartAndTouching(unittest.TestCase):
    def pressing(self, one, other, step, options=""):
        """The force between two bodies at the end, on the slave."""
        run = Run(deck(one, other, step, options), name="sight")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            return result.file[f"contact/S{one.name}:S{other.name}/resultant"][-1]

    def apart(self, high, low):
        """They come closer by less than a plane between them is wide: no force."""
        step = "*BOUNDARY\nA, 1, 2\nB, 1, 3\nA, 3, 3, -0.015\n"
        for one, other in ((high, low), (low, high)):
            for options in ("", ", NLGEOM"):
                with self.subTest(slave=one.name, options=options):
                    force = self.pressing(one, other, step, options)
                    self.assertEqual(np.abs(force).max(), 0)

    def test_corner_over_corner(self):
        low, high = Bar("B", 1, (1, 1, 1), ON_A_CORNER), Bar("A", 101, (1, 1, 1), ON_A_CORNER)
        high.x = high.x @ turned(0, 0, 0.4).T + (0.1, 0.03, 0)
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.05
        self.apart(high, low)

    def test_crossing_bars(self):
        on_edge = turned(np.pi / 4, 0, 0)
        low = Bar("B", 1, (3, 0.5, 0.5), on_edge, n=3)
        high = Bar("A", 101, (3, 0.5, 0.5), turned(0, 0, 1.1) @ on_edge, n=3)
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.05
        self.apart(high, low)

    def test_a_thin_plate(self):
        """The top of the block and the underside of the plate do not see each other."""
        plate, block = Bar("B", 1, (2, 2, 0.02), n=4), Bar("A", 101, (1, 1, 0.3))
        block.x[:, 2] += 0.16
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nATOP, 3, 3, -0.003\n"
        for options in ("", ", NLGEOM"):
            for one, other in ((block, plate), (plate, block)):
                forces = []
                for block.faces, plate.faces in (("A", "B"), ("A, S1", "B, S2")):
                    forces.append(self.pressing(one, other, step, options))
                with self.subTest(slave=one.name, options=options):
                    self.assertGreater(abs(forces[1][2]), 5)
                    self.assertLess(np.abs(forces[0] - forces[1]).max(), 1e-9*abs(forces[1][2]))


if __name__ == "__main__":
    unittest.main()
