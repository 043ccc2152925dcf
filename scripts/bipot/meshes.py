"""Meshes of elements from meshio, PyVista, files and arrays, for bipot.Deck.

`read_mesh` makes one kind of mesh of them: nodes, hexahedra with 8 nodes, and named sets. Physical
groups of a Gmsh file become sets: groups of volumes sets of elements, groups of quadrilaterals
surfaces, groups of lines and points sets of nodes.
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

from bipot.element_faces import face_nodes, outer_faces
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
UPSIDE_DOWN = [4, 5, 6, 7, 0, 1, 2, 3]
HOW_TO = (
    "hexahedra with 8 nodes are needed. In Gmsh: extrude a surface with Layers and Recombine, or"
    " make surfaces and volumes transfinite; Mesh.SubdivisionAlgorithm = 2 cuts tetrahedra into"
    " hexahedra; Mesh.ElementOrder = 1 gives 8 nodes"
)


@dataclass
class HexahedralMesh:
    """Nodes (N, 3), elements (E, 8) as rows of the nodes, and named sets of both."""

    points: Array
    elements: Array
    rows: Array  #: row of each node in the mesh that it was made of, (N,)
    element_sets: dict[str, Array] = field(default_factory=dict)  #: rows of elements
    node_sets: dict[str, Array] = field(default_factory=dict)  #: rows of nodes
    surfaces: dict[str, Array] = field(default_factory=dict)  #: (F, 2): element, face 0 to 5


@dataclass
class _Cells:
    """Cells of all kinds, as they come: kind, corners (n, k), and names of groups with rows."""

    points: Array
    blocks: list[tuple[str, Array]]
    groups: dict[str, dict[int, Array]]  #: name: {block: rows of its cells}
    node_sets: dict[str, Array]


def read_mesh(
    source: Any, element_sets: Mapping[str, ArrayLike] | None = None,
    node_sets: Mapping[str, ArrayLike] | None = None,
) -> HexahedralMesh:
    """Return the elements of a mesh.

    source        the path of a file that meshio reads (.msh, .vtu, ...), a meshio.Mesh, a grid of
                  PyVista, or arrays (points (N, 3), elements (E, 8) as rows of points from 0)
    element_sets  more sets: rows, or a mask, of the elements, in their order in the source
    node_sets     more sets: rows, or a mask, of the points

    Nodes that no element has are left out. Those that stand inside out are turned. Raises MeshError
    where there are other solids than elements, or none, or the file cannot be read.
    """
    cells = _cells_of(source)
    for name, members in (node_sets or {}).items():
        cells.node_sets[name] = _chosen(members, len(cells.points), f"node set {name}")
    found = _elements_of(cells)
    for name, members in (element_sets or {}).items():
        found.element_sets[name] = _chosen(members, len(found.elements), f"element set {name}")
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


def _cells_of(source: Any) -> _Cells:
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
    if len(shape) != 2 or shape[1] != 8 or not np.issubdtype(kind, np.integer):
        raise MeshError(f"elements are rows of 8 whole numbers, not {kind} {shape}")
    return _Cells(np.asarray(points, float), [("hexahedron", elements)], {}, {})


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


def _elements_of(cells: _Cells) -> HexahedralMesh:
    """Return the elements of a mesh with their groups."""
    if cells.points.ndim != 2 or cells.points.shape[1] != 3:
        raise MeshError(f"nodes have 3 coordinates each, and these are {cells.points.shape}")
    if not np.isfinite(cells.points).all():
        raise MeshError("nodes have coordinates that are no numbers")
    counted: dict[str, int] = {}
    for kind, corners in cells.blocks:
        counted[kind] = counted.get(kind, 0) + len(corners)
    solids = {kind: n for kind, n in counted.items() if n and _dimension(kind) == 3}
    elements = solids.pop("hexahedron", 0)
    if solids:
        words = ", ".join(f"{n} of kind {kind}" for kind, n in solids.items())
        raise MeshError(f"the mesh has solids that are no hexahedra: {words}; {HOW_TO}")
    if not elements:
        there = ", ".join(f"{n} of kind {kind}" for kind, n in counted.items() if n) or "no cells"
        raise MeshError(f"the mesh has no elements, but {there}; {HOW_TO}")

    first: dict[int, int] = {}  # row of the first element of each block
    parts: list[Array] = []
    for number, (kind, corners) in enumerate(cells.blocks):
        if kind == "hexahedron":
            first[number] = sum(len(part) for part in parts)
            parts.append(corners)
    old = np.concatenate(parts)
    if old.min() < 0 or old.max() >= len(cells.points):
        raise MeshError(
            f"elements name rows of the points, 0 to {len(cells.points) - 1}; these go from"
            f" {old.min()} to {old.max()}"
        )
    old = _upright(cells.points, old)
    rows, corners = np.unique(old, return_inverse=True)
    new = np.full(len(cells.points), -1)
    new[rows] = np.arange(len(rows))
    mesh = HexahedralMesh(cells.points[rows], corners.reshape(-1, 8), rows)
    for name, members in cells.node_sets.items():
        kept = new[members]
        mesh.node_sets[name] = kept[kept >= 0]
    _add_groups(mesh, cells, first, new)
    return mesh


def _upright(points: Array, elements: Array) -> Array:
    """Return elements none of which stands inside out, by the edges about each one's middle."""
    x = points[elements]
    along = x[:, [1, 2, 5, 6]].mean(axis=1) - x[:, [0, 3, 4, 7]].mean(axis=1)
    across = x[:, [2, 3, 6, 7]].mean(axis=1) - x[:, [0, 1, 4, 5]].mean(axis=1)
    up = x[:, 4:].mean(axis=1) - x[:, :4].mean(axis=1)
    inverted = np.einsum("ei,ei->e", np.cross(along, across), up) < 0
    elements = elements.copy()
    elements[inverted] = elements[inverted][:, UPSIDE_DOWN]
    return elements


def _add_groups(mesh: HexahedralMesh, cells: _Cells, first: dict[int, int], new: Array) -> None:
    """Make sets and surfaces of the named groups."""
    if not cells.groups:
        return
    outer = outer_faces(mesh.elements)
    keys = np.sort(face_nodes(mesh.elements, outer), axis=1)
    table = dict(zip(map(tuple, keys.tolist()), outer.tolist(), strict=True))
    for name, parts in cells.groups.items():
        elements, faces, nodes, lost = [], [], [], 0
        for number, rows in parts.items():
            kind, corners = cells.blocks[number]
            if kind == "hexahedron":
                elements.append(first[number] + rows)
                continue
            members = new[corners[rows]]
            nodes.append(members[members >= 0])
            if kind == "quad":
                matched = [table.get(tuple(sorted(quad))) for quad in members.tolist()]
                faces += [face for face in matched if face is not None]
                lost += sum(face is None for face in matched)
            elif _dimension(kind) == 2:
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
