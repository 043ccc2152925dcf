"""Faces of bricks: the nodes of each, which of them are outer ones, and their normals."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# The six faces of a brick, corners counterclockwise seen from outside.
BRICK_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


def outer_faces(bricks: Array) -> Array:
    """Return the faces that one brick alone has, (F, 2): brick, face 0 to 5 (S1 to S6)."""
    keys = np.sort(bricks[:, BRICK_FACES].reshape(-1, 4), axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return np.stack(np.divmod(np.sort(first[count == 1]), len(BRICK_FACES)), axis=1)


def face_nodes(bricks: Array, faces: Array) -> Array:
    """Return the nodes of faces (F, 2), counterclockwise seen from outside: (F, 4)."""
    return bricks[faces[:, :1], BRICK_FACES[faces[:, 1]]]


def face_normals(corners: Array) -> Array:
    """Return unit normals of faces (F, 4, 3), by their diagonals."""
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
