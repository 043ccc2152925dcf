"""Elements that name a node twice are the wedges, pyramids, tetrahedra and triangles that they are.

A bar of two cubes is cut into each of these and pressed on a plane by a pressure on its upper
faces. Written as hexahedra or quadrilaterals with repeated nodes, turned in all ways, and their
faces called as those of what is written, it deforms as written plainly.
"""

import itertools
import random
import unittest

import numpy as np
from program import Run

# Corners in the unit cube, edges and faces, as the documents of the dialect number them.
CUBE = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
)
EDGES = {
    "hexahedron": "12 23 34 41 56 67 78 85 15 26 37 48",
    "wedge": "12 23 31 45 56 64 14 25 36",
    "pyramid": "12 23 34 41 15 25 35 45",
    "tetrahedron": "12 23 31 14 24 34",
    "quadrilateral": "12 23 34 41",
    "triangle": "12 23 31",
}
FACES = {
    "hexahedron": "1234 5678 1265 2376 3487 4158",
    "wedge": "123 456 1254 2365 3146",
    "pyramid": "1234 125 235 345 415",
    "tetrahedron": "123 142 243 341",
    "quadrilateral": "12 23 34 41",
    "triangle": "12 23 31",
}
# The corner of each that corners of a hexahedron or quadrilateral are.
AS_WRITTEN = {
    "wedge": (1, 2, 3, 3, 4, 5, 6, 6),
    "pyramid": (1, 2, 3, 4, 5, 5, 5, 5),
    "tetrahedron": (1, 2, 3, 3, 4, 4, 4, 4),
    "triangle": (1, 2, 3, 3),
}
TYPES = {
    ("hexahedron", 1): "C3D8", ("wedge", 1): "C3D6", ("pyramid", 1): "C3D5",
    ("tetrahedron", 1): "C3D4", ("hexahedron", 2): "C3D20", ("wedge", 2): "C3D15",
    ("pyramid", 2): "C3D13", ("tetrahedron", 2): "C3D10", ("quadrilateral", 1): "CPE4",
    ("triangle", 1): "CPE3", ("quadrilateral", 2): "CPE8", ("triangle", 2): "CPE6",
}
TURNS = [
    [int(np.flatnonzero(((p - 0.5) @ turn + 0.5 == CUBE).all(axis=1))[0]) for p in CUBE]
    for turn in (
        np.array(signs)[:, None] * np.eye(3)[list(axes)]
        for axes in itertools.permutations(range(3))
        for signs in itertools.product((1, -1), repeat=3)
    )
    if np.linalg.det(turn) > 0
]


def numbers(words):
    """Return places, from 0, of a line of the tables."""
    return [[int(c) - 1 for c in word] for word in words.split()]


class Mesh:
    """Elements of one shape and order that fill two cubes, or two squares."""

    def __init__(self, shape, order):
        self.shape, self.order = shape, order
        self.at = {}
        self.elements = []  # corners, then mid-side nodes
        for shift in (0, 1):
            corners = [self.node((x + shift, y, z)) for x, y, z in CUBE]
            for element in self.cut(corners, np.array([shift + 0.5, 0.5, 0.5])):
                self.elements.append(element + self.middles(element, shape))

    def node(self, place):
        """Return the node at a place."""
        return self.at.setdefault(tuple(float(x) for x in place), len(self.at) + 1)

    def place(self, node):
        """Return the place of a node."""
        return np.array(list(self.at)[node - 1])

    def middles(self, corners, shape):
        """Return the nodes on edges; of an edge that is a point, its corner."""
        if self.order == 1:
            return []
        ends = ((corners[a], corners[b]) for a, b in numbers(EDGES[shape]))
        return [self.node((self.place(a) + self.place(b)) / 2) if a != b else a for a, b in ends]

    def cut(self, c, centre):
        """Return the corners of the parts of a cube."""
        if self.shape == "triangle":
            return [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]
        if self.shape == "wedge":
            return [[c[i] for i in (0, 1, 2, 4, 5, 6)], [c[i] for i in (0, 2, 3, 4, 6, 7)]]
        if self.shape == "tetrahedron":
            return [
                [c[0], c[a], c[b], c[6]]
                for a, b in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))
            ]
        middle = self.node(centre)
        inward = ("1234", "5876", "1562", "2673", "3784", "4851")
        return [[c[int(k) - 1] for k in face] + [middle] for face in inward]

    def written(self, collapsed):
        """Return the elements as a deck has them, their shape and its faces."""
        if not collapsed:
            return self.elements, self.shape
        turns = TURNS
        shape = "hexahedron"
        if self.shape == "triangle":
            shape = "quadrilateral"
            turns = [[(i + k) % 4 for i in range(4)] for k in range(4)]
        draw = random.Random(7)
        elements = []
        for element in self.elements:
            whole = [element[k - 1] for k in AS_WRITTEN[self.shape]]
            turn = draw.choice(turns)
            corners = [whole[turn[i]] for i in range(len(whole))]
            elements.append(corners + self.middles(corners, shape))
        return elements, shape

    def double(self, elements):
        """Give all but the first of the nodes that an element names several times ids of their own.

        The ids begin behind all others; those between two edges that are one are doubled, too.
        """
        doubled = []
        for element in elements:
            seen, nodes = set(), []
            for node in element:
                nodes.append(node if node not in seen else len(self.at) + len(doubled) + 1)
                if node in seen:
                    doubled.append(node)
                seen.add(node)
            element[:] = nodes
        return doubled

    def original(self, node, copies):
        """Return the node that one is a copy of, or itself."""
        return node if node <= len(self.at) else copies[node - len(self.at) - 1]

    def deck(self, collapsed, doubled=False):
        """Return the deck."""
        elements, shape = self.written(collapsed)
        copies = self.double(elements) if doubled else []
        plane = self.shape == "triangle"
        up = 1 if plane else 2
        lines = ["*NODE"]
        lines += [f"{node}, {x}, {y}, {z}" for (x, y, z), node in self.at.items()]
        lines += [
            f"{len(self.at) + k}, " + ", ".join(map(str, self.place(node)))
            for k, node in enumerate(copies, 1)
        ]
        lines += [f"*ELEMENT, TYPE={TYPES[shape, self.order]}, ELSET=E"]
        foot, top = [], []
        for e, nodes in enumerate(elements, 1):
            words = [str(word) for word in (e, *nodes)]
            lines += [", ".join(words[i:i + 10]) + ("," if i + 10 < len(words) else "")
                      for i in range(0, len(words), 10)]
            for label, face in enumerate(numbers(FACES[shape]), 1):
                corners = {self.original(nodes[k], copies) for k in face}
                if len(corners) < len(numbers(FACES[shape])[0]) - 1 + plane:
                    continue
                heights = {self.place(node)[up] for node in corners}
                if heights == {0.0}:
                    foot.append(f"{e}, S{label}")
                if heights == {1.0}:
                    top.append(f"{e}, P{label}, 10.")
        held = [[], []]
        for place, node in self.at.items():
            for axis in range(2):
                if place[axis] == 0.0 and axis != up:
                    held[axis].append(f"{node}, {axis + 1}")
        lines += ["*SURFACE, NAME=FOOT", *foot]
        lines += ["*MATERIAL, NAME=M", "*ELASTIC", "1000., 0.3",
                  "*SOLID SECTION, ELSET=E, MATERIAL=M", "*SURFACE INTERACTION, NAME=I",
                  "*FRICTION", "0.2", "*OBSTACLE, NAME=G, TYPE=PLANE",
                  "0., 0., 0.,  0., 1., 0." if plane else "0., 0., 0.,  0., 0., 1.",
                  "*CONTACT PAIR, INTERACTION=I", "FOOT, G", "*STEP", "*STATIC",
                  "*BOUNDARY", *held[0], *held[1], "*DLOAD", *top, "*END STEP"]
        return "\n".join(lines) + "\n"


class Collapsed(unittest.TestCase):
    def run_deck(self, deck, *options):
        """Return the displacements, the force on the foot and what was printed."""
        run = Run(deck, "--nlgeom", "no", *options, name="bar")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            self.assertTrue(result.certified)
            return result.field("displacement"), result.pairs[0].resultant[-1], run.output

    def check(self, shape, order, words):
        """Compare both ways of writing a mesh."""
        mesh = Mesh(shape, order)
        plain, force, _ = self.run_deck(mesh.deck(collapsed=False))
        collapsed, same_force, output = self.run_deck(mesh.deck(collapsed=True))
        axis = 1 if shape == "triangle" else 2
        self.assertAlmostEqual(force[axis], 20, places=9)
        np.testing.assert_allclose(same_force, force, atol=1e-8)
        np.testing.assert_allclose(collapsed, plain, atol=1e-9 * abs(plain).max())
        self.assertIn(words, " ".join(output.split()))
        doubled, same_force, output = self.run_deck(mesh.deck(collapsed=True, doubled=True))
        np.testing.assert_allclose(same_force, force, atol=1e-8)
        np.testing.assert_allclose(
            doubled[:len(plain)], plain, atol=1e-9 * abs(plain).max()
        )
        self.assertIn("nodes that an edge of no length joins are one", " ".join(output.split()))
        self.assertIn(words, " ".join(output.split()))

    def test_wedges(self):
        self.check("wedge", 1, "4 of 4 elements name a node twice, and are taken as 4 wedges")

    def test_wedges_that_are_refined(self):
        """Faces that the deck calls by what it writes are cut with their elements."""
        mesh = Mesh("wedge", 1)
        plain, force, _ = self.run_deck(mesh.deck(collapsed=False), "--refine", "1")
        collapsed, same_force, _ = self.run_deck(mesh.deck(collapsed=True), "--refine", "1")
        np.testing.assert_allclose(same_force, force, atol=1e-8)
        np.testing.assert_allclose(
            np.sort(collapsed[:, 2]), np.sort(plain[:, 2]), atol=1e-9 * abs(plain).max()
        )

    def test_pyramids(self):
        self.check("pyramid", 1, "12 elements name a node twice, and are taken as 12 pyramids")

    def test_tetrahedra(self):
        self.check("tetrahedron", 1, "and are taken as 12 tetrahedra")

    def test_wedges_with_middles(self):
        self.check("wedge", 2, "and are taken as 4 wedges")

    def test_pyramids_with_middles(self):
        self.check("pyramid", 2, "12 elements name a node twice, and are taken as 12 pyramids")

    def test_tetrahedra_with_middles(self):
        self.check("tetrahedron", 2, "and are taken as 12 tetrahedra")

    def test_triangles(self):
        self.check("triangle", 1, "and are taken as triangles")

    def test_triangles_with_middles(self):
        self.check("triangle", 2, "and are taken as triangles")


if __name__ == "__main__":
    unittest.main()
