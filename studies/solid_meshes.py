"""Meshes of any type of element on graded grids, as cards: blocks, and what a map makes of them.

Hexahedra are cut into two wedges along z or six tetrahedra, mirrored from cell to cell so that a
mesh has the planes of symmetry of its grid. Mid-side nodes are mapped as corners are: they lie on
curved sides.
"""

import itertools
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                 (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
# The cells of each kind; the edges of its mid-side nodes; its faces by their corners.
HEX_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
             (0, 4), (1, 5), (2, 6), (3, 7))  # fmt: skip
WEDGE_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
KINDS = {
    "C3D4": ("tetrahedra", ()), "C3D10": ("tetrahedra", TET_EDGES),
    "C3D6": ("wedges", ()), "C3D15": ("wedges", WEDGE_EDGES),
    "C3D8": ("hexahedra", ()), "C3D8I": ("hexahedra", ()), "C3D8B": ("hexahedra", ()),
    "C3D20": ("hexahedra", HEX_EDGES), "C3D20R": ("hexahedra", HEX_EDGES),
}
FACES = {
    "hexahedra": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3),
                  (3, 7, 4, 0)),
    "wedges": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "tetrahedra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
}


def cells_of(shape, at):
    """Return the corners of the elements of a cell at a place of the grid, in the cell's cube."""
    mirror = np.array(at) % 2
    if shape == "hexahedra":
        return [CUBE]
    if shape == "wedges":
        same = (mirror[0] + mirror[1]) % 2 == 0
        halves = (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1))) if same else (
            ((0, 0), (1, 0), (0, 1)), ((1, 0), (1, 1), (0, 1)))
        return [np.array([(*corner, k) for k in (0, 1) for corner in half]) for half in halves]
    cells = []
    for axes in itertools.permutations(range(3)):
        path = np.zeros((4, 3), int)
        for k, axis in enumerate(axes):
            path[k + 1] = path[k] + np.eye(3, dtype=int)[axis]
        cell = np.where(mirror == 1, 1 - path, path)
        if np.linalg.det((cell[1:] - cell[0]).astype(float)) < 0:
            cell[[1, 2]] = cell[[2, 1]]
        cells.append(cell)
    return cells


class Solid:
    """Nodes and elements of one type, numbered from `first`, and their cards."""

    def __init__(self, name, kind, x, elements, first=1):
        """Give coordinates (m, 3) and, for each element, the rows of its nodes."""
        self.name, self.kind, self.first = name, kind, first
        self.x, self.elements = x, elements
        self.corners = len(cells_of(KINDS[kind][0], (0, 0, 0))[0])

    def faces(self, rows):
        """Return faces whose corners all are among these rows: element row, number, rows."""
        shape, edges = KINDS[self.kind]
        inside = np.isin(self.elements, rows)
        found = []
        for number, corners in enumerate(FACES[shape], 1):
            sides = itertools.pairwise([*corners, corners[0]])
            middles = [self.corners + next(i for i, edge in enumerate(edges) if set(edge) == set(s))
                       for s in sides] if edges else []
            for row in np.flatnonzero(inside[:, corners].all(axis=1)):
                found.append((int(row), number, self.elements[row, [*corners, *middles]]))
        return found

    def set_cards(self, name, rows):
        """Return cards of a set of nodes, and of the surface of their faces, NAME-F."""
        lines = [f"*NSET, NSET={name}", *(str(self.first + row) for row in rows)]
        lines += [f"*SURFACE, NAME={name}-F, TYPE=ELEMENT"]
        lines += [f"{self.first + row}, S{number}" for row, number, _ in self.faces(rows)]
        return "\n".join(lines) + "\n"

    def cards(self):
        """Return nodes and elements; the set of all nodes has the name too."""
        lines = [f"*NODE, NSET={self.name}"]
        lines += [f"{self.first + i}, {x!r}, {y!r}, {z!r}"
                  for i, (x, y, z) in enumerate(self.x.tolist())]
        lines.append(f"*ELEMENT, TYPE={self.kind}, ELSET={self.name}")
        for i, row in enumerate(self.elements):
            words = [str(self.first + i), *(str(self.first + node) for node in row)]
            lines += [", ".join(words[k : k + 15]) + ("," if k + 15 < len(words) else "")
                      for k in range(0, len(words), 15)]
        return "\n".join(lines) + "\n"


class SolidMesh(Solid):
    """A grid of elements of one type, of which a map may make another shape.

    `axes` are the coordinates of the planes of the grid; `first` the first node and element number.
    """

    def __init__(self, name, kind, axes, first=1, place=None):
        """Make the elements cell by cell, and map their nodes."""
        shape, edges = KINDS[kind]
        axes = [np.asarray(axis, float) for axis in axes]
        halves = [np.interp(np.arange(2 * len(a) - 1) / 2, np.arange(len(a)), a) for a in axes]
        keys, rows = {}, []
        for at in itertools.product(*(range(len(a) - 1) for a in axes)):
            for cell in cells_of(shape, at):
                places = 2 * (cell + at)
                places = np.concatenate([places, *((places[[a]] + places[[b]]) // 2
                                                   for a, b in edges)])
                rows.append([keys.setdefault(tuple(key), len(keys)) for key in places.tolist()])
        self.keys = np.array(list(keys))
        self.grid = np.stack([halves[k][self.keys[:, k]] for k in range(3)], axis=1)
        self.last = self.keys.max(axis=0)
        x = self.grid if place is None else place(self.grid)
        super().__init__(name, kind, x, np.array(rows), first)

    def nodes(self, axis, end, reach=None):
        """Return the rows of the nodes on a side of the grid (end 0 or 1).

        `reach`: none but those of faces that begin below it, along both directions.
        """
        on = self.keys[:, axis] == end * self.last[axis]
        if reach is not None:
            for other in range(3):
                if other != axis:
                    begin = self.grid[(self.keys[:, other] % 2 == 0), other]
                    limit = begin[begin >= reach].min(initial=np.inf)
                    on &= self.grid[:, other] <= limit
        return np.flatnonzero(on)


def of_gmsh(geometry, name, kind, first=1):
    """Return the solid that Gmsh makes of a geometry (a text), C3D4 or C3D10."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "solid.geo", Path(folder) / "solid.inp"
        source.write_text(geometry, encoding="utf-8")
        done = subprocess.run(
            ["gmsh", "-3", "-v", "2", "-format", "inp", source, "-o", target],
            check=False, capture_output=True, text=True,
        )
        if done.returncode or not target.exists():
            raise RuntimeError(f"gmsh: {done.stdout}{done.stderr}")
        text = target.read_text(encoding="utf-8")
    blocks = re.split(r"^\*", text, flags=re.MULTILINE)
    nodes, elements = {}, []
    for block in blocks:
        head, _, body = block.partition("\n")
        numbers = body.replace("\n", " ").replace(",", " ").split()
        if head.strip() == "NODE":
            for i in range(0, len(numbers), 4):
                nodes[int(numbers[i])] = [float(word) for word in numbers[i + 1 : i + 4]]
        elif head.upper().startswith("ELEMENT") and f"TYPE={kind}," in head.upper():
            count = {"C3D4": 5, "C3D10": 11}[kind]
            elements += np.reshape([int(word) for word in numbers], (-1, count))[:, 1:].tolist()
    used, rows = np.unique(elements, return_inverse=True)
    return Solid(name, kind, np.array([nodes[i] for i in used]),
                 rows.reshape(np.shape(elements)), first)


def graded(n, size, ratio):
    """Return n + 1 places from 0 to size whose steps grow by the same factor, to `ratio` times."""
    steps = ratio ** (np.arange(n) / max(n - 1, 1))
    return size * np.concatenate([[0], np.cumsum(steps) / steps.sum()])
