"""Ties of bent surfaces of which one is refined in part: nodes that hang go with the others."""

import unittest

import h5py
import numpy as np
from program import Run

TURN = 1e-3


def cut(x, y):
    """The height of the bent cut between the two bodies."""
    return -0.16 * (x - 0.5) ** 2 - 0.12 * (y - 0.45) ** 2


def body(first, n, low, high, lower, upper):
    """Cards of a body of n x n x 1 elements between two surfaces z(x, y); ids from `first`."""
    x = np.linspace(low, high, n + 1)
    nodes, elements = "*NODE\n", f"*ELEMENT, TYPE=C3D8B, ELSET=E{first}\n"
    places = {}
    for k, z in enumerate((lower, upper)):
        for j in range(n + 1):
            for i in range(n + 1):
                id_ = first + i + (n + 1) * (j + (n + 1) * k)
                places[id_] = (x[i], x[j], z(x[i], x[j]))
                nodes += f"{id_}, {x[i]!r}, {x[j]!r}, {float(z(x[i], x[j]))!r}\n"
    for j in range(n):
        for i in range(n):
            a = first + i + (n + 1) * j
            low4 = (a, a + 1, a + n + 2, a + n + 1)
            ids = (*low4, *(b + (n + 1) ** 2 for b in low4))
            elements += f"{first + i + n * j}, " + ", ".join(map(str, ids)) + "\n"
    return places, nodes + elements


def deck(slave_is_lower):
    """The deck: both ends of the two bodies are turned about x as one rigid body would be."""
    lower, cards = body(1, 3, 0.0, 1.0, lambda x, y: -0.6 + 0 * x, cut)
    upper, more = body(101, 3, 0.1, 0.85, cut, lambda x, y: 0.5 + 0 * x)
    surfaces = ["*SURFACE, NAME=LOWER\nE1, S2\n", "*SURFACE, NAME=UPPER\nE101, S1\n"]
    slave, master = ("LOWER", "UPPER") if slave_is_lower else ("UPPER", "LOWER")
    ends = [(i, p) for i, p in lower.items() if p[2] < -0.5]
    ends += [(i, p) for i, p in upper.items() if p[2] > 0.4]
    held = "".join(
        f"{i}, 1\n{i}, 2, 2, {-TURN * p[2]!r}\n{i}, 3, 3, {TURN * p[1]!r}\n" for i, p in ends
    )
    join = f"*TIE, POSITION TOLERANCE=0.05\n{slave}, {master}\n"
    return (
        "*HEADING\na bent cut\n" + cards + more + "".join(surfaces)
        + "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=E1, MATERIAL=M\n"
        "*SOLID SECTION, ELSET=E101, MATERIAL=M\n*ELSET, ELSET=SOME\n5\n*REFINE, ELSET=SOME\n"
        "*ELSET, ELSET=OTHERS\n105\n*REFINE, ELSET=OTHERS\n"
        + join + "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n" + held
        + "*NODE FILE\nU, RF\n*END STEP\n"
    )  # fmt: skip


def ring(first, radii, turn):
    """Places and elements of a ring about z, 48 x 1 x 2 elements; ids from `first`.

    It is turned by a part of an element, and its places have the digits of a file.
    """
    places, elements = {}, ""
    for k in range(3):
        for r, radius in enumerate(radii):
            for a in range(48):
                angle = 2 * np.pi * (a + turn) / 48
                place = (radius * np.cos(angle), radius * np.sin(angle), 0.3 * k)
                places[first + a + 48 * (r + 2 * k)] = np.round(place, 7)
    for k in range(2):
        for a in range(48):
            low = [first + b % 48 + 48 * (r + 2 * k)
                   for b, r in ((a, 0), (a, 1), (a + 1, 1), (a + 1, 0))]
            ids = [first + a + 48 * k, *low, *(i + 96 for i in low)]
            elements += ", ".join(map(str, ids)) + "\n"
    return places, elements


def rings(turn):
    """The deck: the outer faces of two tied rings are turned about x as one body."""
    inner, some = ring(1, (2.0, 3.0), 0.0)
    outer, more = ring(1001, (3.0, 4.0), turn)
    nodes = "".join(
        f"{i}, " + ", ".join(map(repr, map(float, p))) + "\n"
        for i, p in {**inner, **outer}.items()
    )
    ends = [(i, p) for i, p in inner.items() if np.hypot(*p[:2]) < 2.5]
    ends += [(i, p) for i, p in outer.items() if np.hypot(*p[:2]) > 3.5]
    held = "".join(
        f"{i}, 1\n{i}, 2, 2, {float(-TURN * p[2])!r}\n{i}, 3, 3, {float(TURN * p[1])!r}\n"
        for i, p in ends
    )
    return (
        "*HEADING\nrings\n*NODE\n" + nodes + "*ELEMENT, TYPE=C3D8, ELSET=BOLT\n" + some
        + "*ELEMENT, TYPE=C3D8, ELSET=NUT\n" + more
        + "*SURFACE, NAME=BOLT\nBOLT, S4\n*SURFACE, NAME=NUT\nNUT, S6\n"
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=BOLT, MATERIAL=M\n"
        "*SOLID SECTION, ELSET=NUT, MATERIAL=M\n*TIE, POSITION TOLERANCE=0.1\nBOLT, NUT\n"
        "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n" + held + "*NODE FILE\nRF\n*END STEP\n"
    )  # fmt: skip


class BentTies(unittest.TestCase):
    """A refined element on either side."""

    def test_both_sides(self):
        """The deck is taken, and turned as one body it is without forces."""
        for lower in (True, False):
            run = Run(deck(lower), name="bent")
            self.assertEqual(run.status, 0, run.errors)
            with h5py.File(run.file) as file:
                force = file["VTKHDF/PointData/reaction_force"][()]
                u = file["VTKHDF/PointData/displacement"][()]
                x = file["VTKHDF/Points"][()]
            turned = np.column_stack([0 * x[:, 0], -TURN * x[:, 2], TURN * x[:, 1]])
            np.testing.assert_allclose(u, turned, rtol=0, atol=1e-12)
            # Without the tie's shifts taken up strains would be of the order of the turn.
            self.assertLess(abs(force).max(), 1e-9 * 1000 * TURN)

    def test_rings_whose_nodes_do_not_match(self):
        """A bolt in a nut: facets of one cylinder, a part of a facet apart.

        Slivers of facets then face nodes or do not, as these move onto their master. The tie must
        be taken, and the turn of both rings as one body must leave no force.
        """
        for turn in (0.05, 0.3, 0.7):
            run = Run(rings(turn), name="rings")
            self.assertEqual(run.status, 0, run.errors)
            with h5py.File(run.file) as file:
                force = file["VTKHDF/PointData/reaction_force"][()]
            self.assertLess(abs(force).max(), 1e-9 * 1000 * TURN)


if __name__ == "__main__":
    unittest.main()
