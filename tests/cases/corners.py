"""Bodies of elements cut out of a grid, and the walls of their hollows, for cases of corners."""

import itertools
import math

import numpy as np

# Of the six faces of an element S1..S6: the axis across it, its side, its corners seen from
# outside.
FACES = {
    (2, -1): ("S1", (0, 3, 2, 1)), (2, 1): ("S2", (4, 5, 6, 7)), (1, -1): ("S3", (0, 1, 5, 4)),
    (0, 1): ("S4", (1, 2, 6, 5)), (1, 1): ("S5", (2, 3, 7, 6)), (0, -1): ("S6", (3, 0, 4, 7)),
}
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def turned(angles):
    """Return the matrix of turns about x, y and z by these angles, one after the other."""
    matrix = np.eye(3)
    for axis, angle in enumerate(angles):
        turn, (i, j) = np.eye(3), [a for a in range(3) if a != axis]
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[i, j], turn[j, i] = -math.sin(angle), math.sin(angle)
        matrix = turn @ matrix
    return matrix


class Elements:
    """The elements of a grid that `keep` says of their middles, where `place` moves them to.

    `skin[axis, side]` are the faces (element, face of it) towards elements of the grid that are
    left out, or with `outside` towards what is beyond the grid, by the way that they face.
    """

    def __init__(self, name, lines, keep=lambda x: True, place=lambda x: x, first=1, outside=False):
        self.name, self.first = name, first
        shape = [len(line) - 1 for line in lines]
        middles = [0.5 * (np.array(line[1:]) + line[:-1]) for line in lines]
        cells = {
            c for c in itertools.product(*map(range, shape))
            if keep(np.array([of[i] for of, i in zip(middles, c, strict=True)]))
        }
        number, self.places = {}, []
        for c in sorted(cells):
            for corner in CORNERS:
                node = tuple(np.add(c, corner))
                if node not in number:
                    number[node] = len(self.places)
                    self.places.append([line[i] for line, i in zip(lines, node, strict=True)])
        self.grid = np.array(self.places)
        self.places = np.array([place(x) for x in self.grid])
        self.elements = [[number[tuple(np.add(c, k))] for k in CORNERS] for c in sorted(cells)]
        self.skin = {way: [] for way in FACES}
        for element, c in enumerate(sorted(cells)):
            for (axis, side), _ in FACES.items():
                other = list(c)
                other[axis] += side
                is_beyond = not 0 <= other[axis] < shape[axis]
                if tuple(other) not in cells and is_beyond == outside:
                    self.skin[axis, side].append((element, (axis, side)))

    def cards(self, young=1000.0, nu=0.3):
        """Return nodes, elements and material."""
        lines = ["*NODE"]
        lines += [f"{self.first + i}, {x[0]!r}, {x[1]!r}, {x[2]!r}"
                  for i, x in enumerate(self.places.tolist())]
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={self.name}")
        lines += [", ".join(str(self.first + k) for k in (i, *element))
                  for i, element in enumerate(self.elements)]
        lines += [f"*MATERIAL, NAME=OF-{self.name}", "*ELASTIC", f"{young!r}, {nu!r}",
                  f"*SOLID SECTION, ELSET={self.name}, MATERIAL=OF-{self.name}"]
        return "\n".join(lines) + "\n"

    def surface(self, name, ways):
        """Return the card of the surface of the faces that face these ways."""
        lines = [f"{self.first + element}, {FACES[way][0]}"
                 for key in ways for element, way in self.skin[key]]
        return "\n".join([f"*SURFACE, NAME={name}", *lines]) + "\n"

    def facets(self, ways):
        """Return the facets (corners of the grid) that face these ways, turned towards them."""
        return [[self.elements[element][k] for k in FACES[way][1]]
                for key in ways for element, way in self.skin[key]]

    def nodes(self, chosen):
        """Return the numbers of the nodes of whose places in the grid `chosen` says so."""
        return [self.first + i for i, x in enumerate(self.grid) if chosen(x)]

    def held(self, chosen, vector):
        """Return the lines of *BOUNDARY that prescribe a displacement of chosen nodes."""
        return "\n".join(
            f"{node}, {axis + 1}, {axis + 1}, {float(vector[axis])!r}"
            for node in self.nodes(chosen) for axis in range(3)
        )
