"""Meshes of elements from meshio, PyVista, files and arrays, for bipot.Deck.

`read_mesh` makes one kind of mesh of them: nodes, elements, and named sets. Physical groups of a
Gmsh file become sets: groups of volumes sets of elements, groups of faces surfaces, groups of lines
and points sets of nodes.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.element_faces import CELLS, outer_edges_of, outer_faces_of
from bipot.errors import MeshError

Array = NDArray[Any]

# Kinds of cells by their numbers in VTK, called as meshio calls them.
VTK_KINDS = {
    1: "vertex", 2: "vertex", 3: "line", 4: "line", 5: "triangle", 6: "triangle", 7: "polygon",
    8: "pixel", 9: "quad", 10: "tetra", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid",
    21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15",
    27: "pyramid13", 28: "quad9", 29: "hexahedron27", 42: "polyhedron",
}
FLAT = ("vertex", "line", "triangle", "quad", "polygon", "pixel")
FROM_VOXEL = [0, 1, 3, 2, 4, 5, 7, 6]
# The type of element that each kind of cell becomes, and the others that it may.
TYPES = {
    "hexahedron": ("C3D8", "C3D8I", "C3D8B"), "hexahedron20": ("C3D20", "C3D20R"),
    "tetra": ("C3D4",), "tetra10": ("C3D10",), "wedge": ("C3D6",), "wedge15": ("C3D15",),
    "pyramid": ("C3D5",), "pyramid13": ("C3D13",),
}
# Likewise of plane meshes, behind CPE, CPS or CAX.
PLANE_TYPES = {
    "triangle": ("3",), "quad": ("4", "4B"), "triangle6": ("6",), "quad8": ("8", "8R"),
}
INCOMPLETE = "in Gmsh, Mesh.SecondOrderIncomplete = 1 leaves out the nodes within faces and solids"
ADVICE = {
    "hexahedron27": INCOMPLETE, "hexahedron24": INCOMPLETE, "wedge18": INCOMPLETE,
    "pyramid14": INCOMPLETE,
}
HIGHER = "in Gmsh, Mesh.ElementOrder = 1 or 2"


@dataclass
class SolidMesh:
    """Nodes (N, 3), elements of one kind of cell or several, and named sets of both."""

    points: Array
    blocks: list[tuple[str, Array]]  #: kind of cell, and nodes (n, k) as rows of the points
    rows: Array  #: row of each node in the mesh that it was made of, (N,)
    element_sets: dict[str, Array] = field(default_factory=dict)  #: rows of elements
    node_sets: dict[str, Array] = field(default_factory=dict)  #: rows of nodes
    surfaces: dict[str, Array] = field(default_factory=dict)  #: (F, 2): element, face 0 to 5

    @property
    def is_plane(self) -> bool:
        """Whether the elements are triangles and quadrilaterals of the plane z = 0."""
        return self.blocks[0][0] in PLANE_TYPES

    @property
    def n_elements(self) -> int:
        """How many elements there are; they are counted through all blocks."""
        return sum(len(nodes) for _, nodes in self.blocks)

    @property
    def elements(self) -> Array:
        """Nodes of the elements (E, k), where all are of one kind: else MeshError."""
        if len(self.blocks) > 1:
            kinds = ", ".join(kind for kind, _ in self.blocks)
            raise MeshError(f"elements of several kinds: {kinds}; `blocks` has each")
        return self.blocks[0][1]

    def outer_faces(self) -> tuple[Array, Array]:
        """Return the outer faces as of element_faces.outer_faces_of, of a plane the outer edges."""
        if self.is_plane:
            return outer_edges_of([nodes for _, nodes in self.blocks])
        return outer_faces_of([nodes for _, nodes in self.blocks])


@dataclass
class _Cells:
    """Cells of all kinds, as they come: kind, corners (n, k), and names of groups with rows."""

    points: Array
    blocks: list[tuple[str, Array]]
    groups: dict[str, dict[int, Array]]  #: name: {block: rows of its cells}
    node_sets: dict[str, Array]


def read_mesh(
    source: Any, element_sets: Mapping[str, ArrayLike] | None = None,
    node_sets: Mapping[str, ArrayLike] | None = None, plane: bool = False,
) -> SolidMesh:
    """Return the elements of a mesh.

    source        the path of a file that meshio reads (.msh, .vtu, ...), a meshio.Mesh, a grid of
                  PyVista, or arrays (points (N, 3), elements (E, k) as rows of points from 0)
    element_sets  more sets: rows, or a mask, of the elements, in their order in the source
    node_sets     more sets: rows, or a mask, of the points
    plane         elements are the triangles and quadrilaterals of the plane z = 0, not solids

    Nodes that no element has are left out. Elements that stand inside out are turned. They come in
    the order of the source, one kind after the other. Raises MeshError where there are solids that
    no element is, or none, or the file cannot be read.
    """
    cells = _cells_of(source, plane)
    for name, members in (node_sets or {}).items():
        cells.node_sets[name] = _chosen(members, len(cells.points), f"node set {name}")
    found = _elements_of(cells, PLANE_TYPES if plane else TYPES)
    for name, members in (element_sets or {}).items():
        found.element_sets[name] = _chosen(members, found.n_elements, f"element set {name}")
    return found


def _chosen(members: ArrayLike, count: int, what: str) -> Array:
    """Return rows from rows or a mask."""
    rows = np.asarray(members)
    if rows.dtype == bool:
        if rows.shape != (count,):
            raise ValueError(f"{what}: a mask of {count} is needed, not of shape {rows.shape}")
        return np.flatnonzero(rows)
    rows = rows.astype(int).ravel()
    if len(rows) and not (rows.min() >= 0 and rows.max() < count):
        raise ValueError(f"{what}: rows must be from 0 to {count - 1}")
    return rows


def _cells_of(source: Any, plane: bool) -> _Cells:
    """Return the cells of whatever a mesh is given as."""
    if isinstance(source, str | os.PathLike):
        return _from_meshio(_read_file(Path(source)))
    if hasattr(source, "cast_to_unstructured_grid"):
        return _from_pyvista(source.cast_to_unstructured_grid())
    if hasattr(source, "cells") and hasattr(source, "cell_sets"):
        return _from_meshio(source)
    try:
        points, elements = source
    except (TypeError, ValueError):
        raise TypeError(
            "a mesh is a path, a meshio.Mesh, a grid of PyVista, or (points, elements),"
            f" not {type(source).__name__}"
        ) from None
    elements = np.asarray(elements)
    kind, shape = elements.dtype, elements.shape
    names = {
        8: "hexahedron", 20: "hexahedron20", 4: "tetra", 10: "tetra10", 6: "wedge", 15: "wedge15",
        5: "pyramid", 13: "pyramid13",
    }
    if plane:
        names = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}
    name = names.get(shape[1] if len(shape) == 2 else 0)
    if name is None or not np.issubdtype(kind, np.integer):
        raise MeshError(
            "elements are rows of as many whole numbers as they have nodes (4, 5, 6, 8, 10, 13,"
            f" 15 or 20), not {kind} {shape}"
        )
    return _Cells(np.asarray(points, float), [(name, elements)], {}, {})


def _read_file(path: Path) -> Any:
    """Read a file with meshio."""
    try:
        import meshio
    except ImportError as error:
        raise MeshError(f"{path}: reading mesh files needs meshio (pip install meshio)") from error
    if not path.is_file():
        raise MeshError(f"{path}: no such file")
    try:
        return meshio.read(path)
    except KeyError as error:
        # It looks the kinds of cells up in a table.
        raise MeshError(
            f"{path}: meshio has no cells of kind {error.args[0]}; Gmsh's .inp may be read by"
            " the card *INCLUDE of a deck, or PyVista may read the mesh"
        ) from error
    # meshio ends the program where it knows no reader for a file.
    except (Exception, SystemExit) as error:
        raise MeshError(f"{path}: meshio cannot read it: {error}") from error


def _from_meshio(mesh: Any) -> _Cells:
    """Return the cells of a meshio.Mesh; groups by its cell sets and Gmsh's physical numbers."""
    blocks = [(block.type, np.asarray(block.data)) for block in mesh.cells]
    groups: dict[str, dict[int, Array]] = {}
    for name, parts in mesh.cell_sets.items():
        if name.startswith("gmsh:"):
            continue
        found = {
            number: np.asarray(part, int) for number, part in enumerate(parts)
            if part is not None and len(part)
        }
        groups.setdefault(name, {}).update(found)
    physical = mesh.cell_data.get("gmsh:physical")
    if physical is not None:
        dimensions = [_dimension(kind) for kind, _ in blocks]
        for name, (number, dimension) in mesh.field_data.items():
            found = {
                block: np.flatnonzero(np.asarray(numbers) == number)
                for block, numbers in enumerate(physical)
                if dimensions[block] == dimension
            }
            found = {block: rows for block, rows in found.items() if len(rows)}
            groups.setdefault(name, {}).update(found)
    node_sets = {name: np.asarray(rows, int) for name, rows in mesh.point_sets.items()}
    return _Cells(np.asarray(mesh.points, float), blocks, groups, node_sets)


def _dimension(kind: str) -> int:
    """Return the dimension of a kind of cell."""
    letters = kind.rstrip("0123456789")
    if letters == "vertex":
        return 0
    if letters == "line":
        return 1
    return 2 if letters in FLAT else 3


def _from_pyvista(grid: Any) -> _Cells:
    """Return the cells of an unstructured grid of PyVista."""
    kinds = np.asarray(grid.celltypes)
    starts = np.asarray(grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset)
    corners = np.asarray(grid.cell_connectivity)
    blocks = []
    for number in np.unique(kinds):
        rows = np.flatnonzero(kinds == number)
        sizes = starts[rows + 1] - starts[rows]
        kind = VTK_KINDS.get(int(number), f"VTK's cell {number}")
        if np.ptp(sizes) > 0:
            blocks.append((kind, np.zeros((len(rows), 0), int)))
            continue
        found = corners[starts[rows][:, None] + np.arange(sizes[0])]
        if kind == "voxel":
            kind, found = "hexahedron", found[:, FROM_VOXEL]
        blocks.append((kind, found))
    return _Cells(np.asarray(grid.points, float), blocks, {}, {})


def _elements_of(cells: _Cells, types: Mapping[str, tuple[str, ...]]) -> SolidMesh:
    """Return the elements of a mesh with their groups."""
    if cells.points.ndim != 2 or cells.points.shape[1] != 3:
        raise MeshError(f"nodes have 3 coordinates each, and these are {cells.points.shape}")
    if not np.isfinite(cells.points).all():
        raise MeshError("nodes have coordinates that are no numbers")
    counted: dict[str, int] = {}
    for kind, corners in cells.blocks:
        counted[kind] = counted.get(kind, 0) + len(corners)
    plane = types is PLANE_TYPES
    others = {
        kind: n for kind, n in counted.items()
        if n and kind not in types and _dimension(kind) == 2 + (not plane)
    }
    if others:
        words = "; ".join(
            f"{n} of kind {kind}: {ADVICE.get(kind, HIGHER)}" for kind, n in others.items()
        )
        raise MeshError(
            f"the mesh has {'faces' if plane else 'solids'} that no element is: {words}"
        )
    kinds = [kind for kind in dict.fromkeys(kind for kind, _ in cells.blocks) if kind in types]
    kinds = [kind for kind in kinds if counted[kind]]
    if not kinds:
        there = ", ".join(f"{n} of kind {kind}" for kind, n in counted.items() if n) or "no cells"
        raise MeshError(
            f"the mesh has no elements, but {there}; in Gmsh, Mesh {2 if plane else 3}D, and"
            f" physical groups of {'surfaces' if plane else 'volumes'} where there are any groups"
            + ("; of a plane mesh, type='CPE', 'CPS' or 'CAX'"
               if not plane and any(kind in PLANE_TYPES for kind in counted) else "")
        )
    if plane and any(_dimension(kind) == 3 for kind, n in counted.items() if n):
        raise MeshError("the mesh has solids: it is no plane mesh")

    first: dict[int, int] = {}  # row of the first element of each block
    before, blocks = 0, []
    for kind in kinds:
        parts = []
        for number, (other, corners) in enumerate(cells.blocks):
            if other == kind and len(corners):
                first[number] = before
                before += len(corners)
                parts.append(np.asarray(corners))
        blocks.append((kind, np.concatenate(parts)))
    low = min(int(nodes.min()) for _, nodes in blocks)
    high = max(int(nodes.max()) for _, nodes in blocks)
    if low < 0 or high >= len(cells.points):
        raise MeshError(
            f"elements name rows of the points, 0 to {len(cells.points) - 1}; these go from"
            f" {low} to {high}"
        )
    rows = np.unique(np.concatenate([nodes.ravel() for _, nodes in blocks]))
    new = np.full(len(cells.points), -1)
    new[rows] = np.arange(len(rows))
    if plane and (cells.points[rows, 2] != 0).any():
        raise MeshError("a plane mesh is in the plane z = 0")
    turn = _anticlockwise if plane else _upright
    mesh = SolidMesh(
        cells.points[rows], [(kind, new[turn(cells.points, nodes)]) for kind, nodes in blocks], rows
    )
    for name, members in cells.node_sets.items():
        kept = new[members]
        mesh.node_sets[name] = kept[kept >= 0]
    _add_groups(mesh, cells, first, new)
    return mesh


def _anticlockwise(points: Array, elements: Array) -> Array:
    """Return triangles and quadrilaterals all of which go round anticlockwise."""
    count = elements.shape[1] // 2 if elements.shape[1] > 4 else elements.shape[1]
    x, y = points[elements[:, :count], :2].transpose(2, 0, 1)
    clockwise = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) < 0
    order = [0, *range(count - 1, 0, -1)]
    if elements.shape[1] > count:
        order += range(2 * count - 1, count - 1, -1)
    elements = elements.copy()
    elements[clockwise] = elements[clockwise][:, order]
    return elements


def _upright(points: Array, elements: Array) -> Array:
    """Return elements none of which stands inside out, by the edges about each one's middle."""
    cell = CELLS[elements.shape[1]]
    x = points[elements[:, : cell.corners]]

    def mean(corners: list[int]) -> Array:
        return x[:, corners].mean(axis=1)

    if cell.corners == 8:
        along = mean([1, 2, 5, 6]) - mean([0, 3, 4, 7])
        across = mean([2, 3, 6, 7]) - mean([0, 1, 4, 5])
        up = mean([4, 5, 6, 7]) - mean([0, 1, 2, 3])
    elif cell.corners == 6:
        along, across = mean([1, 4]) - mean([0, 3]), mean([2, 5]) - mean([0, 3])
        up = mean([3, 4, 5]) - mean([0, 1, 2])
    elif cell.corners == 5:
        along, across = mean([1, 2]) - mean([0, 3]), mean([2, 3]) - mean([0, 1])
        up = mean([4]) - mean([0, 1, 2, 3])
    else:
        along, across, up = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0], x[:, 3] - x[:, 0]
    inverted = np.einsum("ei,ei->e", np.cross(along, across), up) < 0
    order = list(cell.mirrored)
    if elements.shape[1] > cell.corners:
        edge_of = {frozenset(edge): i for i, edge in enumerate(cell.edges)}
        order += [
            cell.corners + edge_of[frozenset(cell.mirrored[k] for k in edge)]
            for edge in cell.edges
        ]
    elements = elements.copy()
    elements[inverted] = elements[inverted][:, order]
    return elements


def _add_groups(mesh: SolidMesh, cells: _Cells, first: dict[int, int], new: Array) -> None:
    """Make sets and surfaces of the named groups."""
    if not cells.groups:
        return
    outer, nodes_of_faces = mesh.outer_faces()
    if mesh.is_plane:
        keys = [tuple(sorted(nodes)) for nodes in nodes_of_faces[:, :2].tolist()]
    else:
        keys = [_corners(nodes) for nodes in nodes_of_faces.tolist()]
    table = dict(zip(keys, outer.tolist(), strict=True))
    dimension = 1 if mesh.is_plane else 2
    for name, parts in cells.groups.items():
        elements, faces, nodes, lost = [], [], [], 0
        for number, rows in parts.items():
            kind, corners = cells.blocks[number]
            if number in first:
                elements.append(first[number] + rows)
                continue
            members = new[corners[rows]]
            nodes.append(members[members >= 0])
            if _dimension(kind) == dimension and kind.startswith(("triangle", "quad", "line")):
                count = {"t": 3, "q": 4, "l": 2}[kind[0]]
                matched = [table.get(tuple(sorted(face))) for face in members[:, :count].tolist()]
                faces += [face for face in matched if face is not None]
                lost += sum(face is None for face in matched)
            elif _dimension(kind) == dimension:
                lost += len(rows)
        if lost:
            warnings.warn(
                f"{lost} cells of group {name} are no outer faces of solids: no surface has them",
                stacklevel=5,
            )
        if elements:
            mesh.element_sets[name] = np.concatenate(elements)
        if nodes and any(map(len, nodes)):
            mesh.node_sets.setdefault(name, np.unique(np.concatenate(nodes)))
        if faces:
            mesh.surfaces[name] = np.array(faces)


def _corners(nodes: list[int]) -> tuple[int, ...]:
    """Return the corners of a face as of outer_faces_of, sorted: those without mid-side nodes."""
    there = [node for node in nodes if node >= 0]
    count = len(there) // 2 if len(there) > 4 else len(there)
    return tuple(sorted(there[:count]))
