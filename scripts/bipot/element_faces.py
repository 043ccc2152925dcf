"""Faces of elements: the nodes of each, which of them are outer ones, and their normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# The six faces of an element, corners counterclockwise seen from outside.
ELEMENT_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


@dataclass(frozen=True)
class Cell:
    """A shape of elements: its faces S1, S2, ... by their corners, and its edges.

    The node in the middle of edge i, where there are such, is the one `corners` + i.
    """

    corners: int
    faces: tuple[tuple[int, ...], ...]
    edges: tuple[tuple[int, int], ...]
    mirrored: tuple[int, ...]  #: the corners of an element that stands inside out, put right


HEXAHEDRON = Cell(
    8, tuple(tuple(face) for face in ELEMENT_FACES.tolist()),
    ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6),
     (3, 7)), (4, 5, 6, 7, 0, 1, 2, 3),
)  # fmt: skip
TETRAHEDRON = Cell(
    4, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)), (0, 2, 1, 3),
)
WEDGE = Cell(
    6, ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)), (3, 4, 5, 0, 1, 2),
)
PYRAMID = Cell(
    5, ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)), (0, 3, 2, 1, 4),
)
# By the number of nodes: no two cells have as many.
CELLS = {
    8: HEXAHEDRON, 20: HEXAHEDRON, 4: TETRAHEDRON, 10: TETRAHEDRON, 6: WEDGE, 15: WEDGE, 5: PYRAMID,
    13: PYRAMID,
}
FACE_NODES = 8  # of a face, at most


def outer_faces(elements: Array) -> Array:
    """Return the faces that one element alone has, (F, 2): element, face 0 to 5 (S1 to S6).

    `elements` are of one cell, (E, 8) or as many nodes as it has.
    """
    return outer_faces_of([elements])[0]


def outer_faces_of(blocks: Sequence[Array]) -> tuple[Array, Array]:
    """Return the outer faces of elements of several cells, and their nodes.

    blocks  nodes (n, k) of the elements of a cell each; elements are counted through them all

    Returns (F, 2), element and face from 0, and (F, 8): the corners counterclockwise seen from
    outside, then the nodes in the middles of the edges, that of the first two first, -1 behind.
    """
    found, nodes, before = [np.zeros((0, 2), int)], [np.zeros((0, FACE_NODES), int)], 0
    corners = [np.zeros((0, 4), int)]
    for block in blocks:
        cell = CELLS[block.shape[1]]
        for number, face in enumerate(cell.faces):
            local = all_nodes_of_face(cell, number, block.shape[1])
            padded = np.full((len(block), FACE_NODES), -1)
            padded[:, : len(local)] = block[:, local]
            nodes.append(padded)
            corner = np.full((len(block), 4), -1)
            corner[:, : len(face)] = block[:, list(face)]
            corners.append(np.sort(corner, axis=1))
            rows = before + np.arange(len(block))
            found.append(np.stack([rows, np.full(len(block), number)], axis=1))
        before += len(block)
    faces, of_faces = np.concatenate(found), np.concatenate(nodes)
    _, first, count = np.unique(
        np.concatenate(corners), axis=0, return_index=True, return_counts=True
    )
    outer = first[count == 1]
    outer = outer[np.lexsort((faces[outer, 1], faces[outer, 0]))]
    return faces[outer], of_faces[outer]


def outer_edges_of(blocks: Sequence[Array]) -> tuple[Array, Array]:
    """Return the outer edges of triangles and quadrilaterals of a plane, and their nodes.

    blocks  nodes (n, k) of elements of a kind each, anticlockwise; 6 or 8 with mid-side nodes

    Returns as outer_faces_of: (F, 2), element and edge from 0, and (F, 3): both ends, then the node
    between them, -1 where there is none.
    """
    found, nodes, before = [np.zeros((0, 2), int)], [np.zeros((0, 3), int)], 0
    for block in blocks:
        corners = block.shape[1] // 2 if block.shape[1] > 4 else block.shape[1]
        for edge in range(corners):
            of_edge = np.full((len(block), 3), -1)
            of_edge[:, :2] = block[:, [edge, (edge + 1) % corners]]
            if block.shape[1] > corners:
                of_edge[:, 2] = block[:, corners + edge]
            nodes.append(of_edge)
            rows = before + np.arange(len(block))
            found.append(np.stack([rows, np.full(len(block), edge)], axis=1))
        before += len(block)
    edges, of_edges = np.concatenate(found), np.concatenate(nodes)
    _, first, count = np.unique(
        np.sort(of_edges[:, :2], axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = first[count == 1]
    outer = outer[np.lexsort((edges[outer, 1], edges[outer, 0]))]
    return edges[outer], of_edges[outer]


def all_nodes_of_face(cell: Cell, number: int, nodes: int) -> list[int]:
    """Return which nodes of an element with so many nodes a face has, in the order above."""
    face = list(cell.faces[number])
    if nodes == cell.corners:
        return face
    middle = {frozenset(edge): cell.corners + i for i, edge in enumerate(cell.edges)}
    return face + [middle[frozenset(side)] for side in zip(face, face[1:] + face[:1], strict=True)]


def split_faces(nodes: Array) -> tuple[Array, Array, Array]:
    """Return flat pieces of faces (F, 8) between all their nodes.

    Returns nodes (M, 4), a triangle's last one twice; the face of each (M,); and which of its four
    sides are edges of an element (M, 4).
    """
    count = (nodes >= 0).sum(axis=1)
    found, of_face, sides = [np.zeros((0, 4), int)], [np.zeros(0, int)], [np.zeros((0, 4), bool)]
    triangle = ([0, 1, 2, 2], (True, True, False, True))
    inner = (False,) * 4
    outer = (True, False, False, True)
    ways = {
        3: [triangle],
        4: [([0, 1, 2, 3], (True,) * 4)],
        6: [([0, 3, 5, 5], outer), ([1, 4, 3, 3], outer), ([2, 5, 4, 4], outer),
            ([3, 4, 5, 5], inner)],
        8: [([0, 4, 7, 7], outer), ([1, 5, 4, 4], outer), ([2, 6, 5, 5], outer),
            ([3, 7, 6, 6], outer), ([4, 5, 6, 7], inner)],
    }  # fmt: skip
    for n, pieces in ways.items():
        rows = np.flatnonzero(count == n)
        for local, is_edge in pieces:
            found.append(nodes[rows][:, local])
            of_face.append(rows)
            sides.append(np.tile(is_edge, (len(rows), 1)))
    parent = np.concatenate(of_face)
    order = np.argsort(parent, kind="stable")
    return np.concatenate(found)[order], parent[order], np.concatenate(sides)[order]


def face_nodes(elements: Array, faces: Array) -> Array:
    """Return the nodes of faces (F, 2) of hexahedra, counterclockwise from outside: (F, 4)."""
    return elements[faces[:, :1], ELEMENT_FACES[faces[:, 1]]]


def face_normals(corners: Array) -> Array:
    """Return unit normals of faces (F, 4, 3), by their diagonals."""
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
