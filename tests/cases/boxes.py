"""Boxes of elements of any type, with inner nodes out of place, as cards for the decks of cases.

Elements are cut into two wedges, six tetrahedra, six pyramids about their centre or three about a
corner; those of second order have nodes in the middles of straight edges.
"""


import itertools
import unittest

import numpy as np
from program import Run

YOUNG, POISSON, PRESSURE = 210000.0, 0.3, 100.0
WEDGES = ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
CENTRE = 8
# The elements of second order: what they are without mid-side nodes, and the edges of these.
EDGES = {
    "C3D10": ("C3D4", ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))),
    "C3D15": ("C3D6", ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))),
    "C3D20": ("C3D8", ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4),
                       (1, 5), (2, 6), (3, 7))),
}
EDGES["C3D13"] = "C3D5", ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4))
EDGES["C3D20R"] = EDGES["C3D20"]
VTK_TYPES = {"C3D8": 12, "C3D6": 13, "C3D5": 14, "C3D4": 10, "C3D10": 24, "C3D15": 26, "C3D20": 25,
             "C3D20R": 25, "C3D13": 27}
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def tetrahedra():
    """Return six tetrahedra of an element around its diagonal, right side out; faces match."""
    number = {corner: i for i, corner in enumerate(CORNERS)}
    cells = []
    for axes in itertools.permutations(range(3)):
        path = [np.zeros(3, int)]
        for axis in axes:
            path.append(path[-1] + np.eye(3, dtype=int)[axis])
        cell = [number[tuple(place)] for place in path]
        if np.linalg.det(np.array([CORNERS[a] for a in cell[1:]])) < 0:
            cell[1:3] = cell[2], cell[1]
        cells.append(tuple(cell))
    return tuple(cells)


def pyramids(apex):
    """Return the pyramids of an element whose apex is one of its corners, or its centre."""
    return tuple((*side[::-1], apex) for side in SIDES if apex not in side)


def joined():
    """Return what lies between a hexahedron, at lower x, and elements that are cut into tetrahedra.

    A pyramid on the hexahedron, and tetrahedra about the centre.
    """
    cells = [("C3D5", (*SIDES[5][::-1], CENTRE))]
    for side in SIDES[:5]:
        start = min(range(4), key=lambda i, side=side: sum(CORNERS[side[i]]))
        a, b, c, d = side[start:] + side[:start]
        cells += [("C3D4", (a, c, b, CENTRE)), ("C3D4", (a, d, c, CENTRE))]
    return tuple(cells)


def cut(kind, at):
    """Return the cells of the element at a place in its box: type and nodes, CENTRE among them.

    Of pyramids about a corner elements side by side are mirror images, so that their faces match.
    """
    if kind == "join":
        return joined()
    if kind in ("join2", "corner2"):
        second = {"C3D5": "C3D13", "C3D4": "C3D10"}
        return tuple((second[name], cell) for name, cell in cut(kind[:-1], at))
    if kind == "corner":
        apex = CORNERS.index(tuple(i % 2 for i in at))
        return tuple(("C3D5", cell) for cell in pyramids(apex))
    cells = {"C3D8": (tuple(range(8)),), "C3D6": WEDGES, "C3D5": pyramids(CENTRE),
             "C3D4": tetrahedra()}
    return tuple((kind, cell) for cell in cells[EDGES.get(kind, (kind,))[0]])


class Box:
    """A box of elements that are cut, and its cards; ids behind those of `after`."""

    def __init__(self, name, n, kinds, low=(0, 0, 0), size=(1, 1, 1), after=None, shift=0.15):
        """Give the elements the types `kinds` in turn, along x: they meet in faces that match."""
        self.name, self.low, self.size = name, np.array(low, float), np.array(size, float)
        grid = np.array(list(itertools.product(*(range(m + 1) for m in n))))
        inner = np.all((grid > 0) & (grid < n), axis=1)
        places = grid + shift * inner[:, None] * np.sin(7 * grid + [1, 2, 3])
        self.x = self.low + places / n * self.size
        self.first = 1 if after is None else after.first + len(after.x)
        element = 1 if after is None else after.next_element
        stride = ((n[1] + 1) * (n[2] + 1), n[2] + 1, 1)
        self.elements, centres = {}, []
        for at in itertools.product(*(range(m) for m in n)):
            nodes = [int(np.dot(np.add(at, c), stride)) for c in CORNERS]
            cells = cut(kinds[at[0] % len(kinds)], at)
            if any(CENTRE in cell for _, cell in cells):
                nodes.append(len(self.x) + len(centres))
                centres.append(self.x[nodes[:8]].mean(axis=0))
            for kind, cell in cells:
                self.elements.setdefault(kind, []).append(
                    (element, *(self.first + nodes[a] for a in cell))
                )
                element += 1
        self.x = np.concatenate([self.x, np.reshape(centres, (-1, 3))])
        self.next_element = element
        self.add_middles()

    def add_middles(self):
        """Put nodes in the middles of the edges of elements of second order."""
        number, middles = {}, []
        for kind, elements in self.elements.items():
            if kind not in EDGES:
                continue
            for i, (element, *nodes) in enumerate(elements):
                for edge in EDGES[kind][1]:
                    ends = tuple(sorted(nodes[a] for a in edge))
                    if ends not in number:
                        number[ends] = self.first + len(self.x) + len(middles)
                        middles.append(self.x[[a - self.first for a in ends]].mean(axis=0))
                    nodes.append(number[ends])
                elements[i] = (element, *nodes)
        self.x = np.concatenate([self.x, np.reshape(middles, (-1, 3))])

    def side(self, axis, end):
        """Return the ids of the nodes on a side."""
        place = self.low[axis] + end * self.size[axis]
        return [self.first + i for i in np.flatnonzero(abs(self.x[:, axis] - place) < 1e-9)]

    def cards(self):
        """Return nodes, elements, sets of the sides and the section."""
        lines = ["*NODE"]
        for i, (x, y, z) in enumerate(self.x.tolist()):
            lines.append(f"{self.first + i}, {x!r}, {y!r}, {z!r}")
        for kind, elements in self.elements.items():
            lines.append(f"*ELEMENT, TYPE={kind}, ELSET={self.name}")
            lines += [", ".join(map(str, element)) for element in elements]
        for axis, end in itertools.product(range(3), range(2)):
            side = f"{self.name}-{'XYZ'[axis]}{end}"
            lines += [f"*NSET, NSET={side}", *map(str, self.side(axis, end))]
            lines += [f"*SURFACE, NAME={side}, TYPE=NODE", side]
        lines.append(f"*SOLID SECTION, ELSET={self.name}, MATERIAL=STEEL")
        return "\n".join(lines) + "\n"


MATERIAL = f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG}, {POISSON}\n*DENSITY\n1000.\n"
DRY = "*SURFACE INTERACTION, NAME=DRY\n"
FLOOR = (
    "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n"
    "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, FLOOR\n"
)
STEP = "*STEP\n*STATIC\n"
SOFT = MATERIAL.replace(str(YOUNG), "1000.0")
ROUGH = DRY + "*FRICTION\n0.3\n"


def on_corner(name):
    """Hold a body along x and y on two sides, so that it may grow."""
    return f"*BOUNDARY\n{name}-X0, 1\n{name}-Y0, 2\n"


def pushed(upper, lower, options="", master="", sliding=""):
    """Return a deck of a box on another, pressed and pushed along in eight increments.

    `options` of the steps, `sliding` of the pair; `master` is a pair instead, with its obstacle.
    """
    low = Box("A", (2, 2, 1), (lower,), (-0.2, -0.2, -1), (1.6, 1.4, 1))
    up = Box("B", (2, 2, 1), (upper,), after=low)
    pair = master or f"*CONTACT PAIR, INTERACTION=DRY{sliding}\nB-Z0, A-Z1\n"
    rest = "*BOUNDARY\nA-Z0, 1, 3\n"
    step = f"*STEP{options}\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\nB-Z1, "
    return (
        low.cards() + up.cards() + SOFT + ROUGH + pair + rest
        + step + "3, 3, -0.02\nB-Z1, 1, 2, 0.\n*END STEP\n"
        + step + "3, 3, -0.02\nB-Z1, 1, 1, 0.03\nB-Z1, 2, 2, 0.01\n*END STEP\n"
    )  # fmt: skip


class BoxCase(unittest.TestCase):
    """What is asked of decks of boxes."""

    def solve(self, deck, *options):
        """Return the result of a deck that must be solved and certified."""
        run = Run(deck, *options, name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result

    def check_uniform(self, result):
        """A uniform stress along z is exact on any mesh."""
        x = result.points
        strain = np.array([POISSON, POISSON, -1.0]) * PRESSURE / YOUNG
        u = result.field("displacement")
        np.testing.assert_allclose(u - u[0], (x - x[0]) * strain, rtol=0, atol=1e-10)
