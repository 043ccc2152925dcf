"""Faces of elements: the nodes of each, which of them are outer ones, and their normals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# The six faces of an element, corners counterclockwise seen from outside.
ELEMENT_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


def outer_faces(elements: Array) -> Array:
    """Return the faces that one element alone has, (F, 2): element, face 0 to 5 (S1 to S6)."""
    keys = np.sort(elements[:, ELEMENT_FACES].reshape(-1, 4), axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return np.stack(np.divmod(np.sort(first[count == 1]), len(ELEMENT_FACES)), axis=1)


def face_nodes(elements: Array, faces: Array) -> Array:
    """Return the nodes of faces (F, 2), counterclockwise seen from outside: (F, 4)."""
    return elements[faces[:, :1], ELEMENT_FACES[faces[:, 1]]]


def face_normals(corners: Array) -> Array:
    """Return unit normals of faces (F, 4, 3), by their diagonals."""
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
