"""Gaps, normals and relative motions of points before rigid obstacles."""

from dataclasses import replace

import numpy as np
from scenes import CYLINDER, EPS, PLANE


def unit(vector):
    """A vector of length 1."""
    vector = np.asarray(vector, dtype=float)
    return vector / np.linalg.norm(vector)


def shift_of(obstacle, u):
    """The displacement (3,) of an obstacle."""
    return np.zeros(3) if obstacle.reference is None else u[obstacle.reference]


def rotation(vector):
    """The matrix (3, 3) of a rotation vector, in extended precision: the exponential's series."""
    x, y, z = np.asarray(vector, dtype=np.longdouble)
    zero = np.longdouble(0)
    spin = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    halvings = 0
    while np.abs(spin).max() > 0.5:
        spin, halvings = spin / 2, halvings + 1
    out = term = np.eye(3, dtype=np.longdouble)
    for n in range(1, 30):
        term = term @ spin / n
        out = out + term
    for _ in range(halvings):
        out = out @ out
    return out


def turned(obstacle, vector, hub):
    """The obstacle (plane, sphere or cylinder) when it has turned about its reference node."""
    if not np.any(vector):
        return obstacle
    r = rotation(vector)
    point = hub + r @ (np.asarray(obstacle.point, dtype=np.longdouble) - hub)
    direction = None if obstacle.direction is None else r @ obstacle.direction
    return replace(obstacle, point=point, direction=direction)


def corners_at(obstacle, u, vector, hub):
    """Where the corners (M, 3) of facets are, the reference node at `hub` displaced by `u`."""
    if obstacle.reference is None:
        return obstacle.corners
    arms = obstacle.corners - hub
    return (hub + u + arms @ rotation(vector).T).astype(float)


def chords(places, old, new, hub, old_vector, new_vector):
    """How points (P, 3) slip on an obstacle that turns, (9.8) of docs/theory.md.

    `old`, `new`: displacements (P, 3) of the points less those of the reference node, which is at
    `hub`.
    """
    first, last = rotation(old_vector), rotation(new_vector)
    arms = places.astype(np.longdouble) - hub
    way = (arms + new) @ last - (arms + old) @ first
    # Halfway: the mean of both as a rotation.
    left, _, right = np.linalg.svd((np.eye(3) + last @ first.T).astype(float))
    return (way @ (left @ right @ first).T).astype(float)


def locate(obstacle, places, u, shift, added=0.0):
    """Gap (P,), normal (P, 3) and rounding of the gap (P,) of points displaced by `u` (P, 3)."""
    extended = np.longdouble
    away = (places.astype(extended) - np.asarray(obstacle.point, dtype=extended)) + (
        u.astype(extended) - np.asarray(shift, dtype=extended)
    )
    size = np.abs(places).max(axis=1) + np.abs(u).max(axis=1)
    size = size + float(np.abs(obstacle.point).max()) + np.abs(shift).max() + np.abs(added)
    if obstacle.kind == PLANE:
        normal = np.asarray(obstacle.direction, dtype=extended)
        normal = normal / np.sqrt(normal @ normal)
        gap = away @ normal
        normals = np.tile(normal, (len(places), 1))
    else:
        if obstacle.kind == CYLINDER:
            axis = np.asarray(obstacle.direction, dtype=extended)
            axis = axis / np.sqrt(axis @ axis)
            away = away - np.outer(away @ axis, axis)
        distance = np.sqrt((away**2).sum(axis=1))
        normals = away / distance[:, None]
        gap = distance - obstacle.radius
        size = size + obstacle.radius
        if obstacle.inner:
            gap, normals = -gap, -normals
    return (gap + added).astype(float), normals.astype(float), 8 * EPS * size


def depth_below(face, obstacle, shift, way):
    """How deep below a face (4, 3) the middle of a sphere or cylinder is, 0 beside it.

    Along the unit vector `way` (3,), out of the body. Of a cylinder the point of its axis that is
    nearest to the middle of the face. The face is the bilinear surface of its corners: of one that
    is warped by more than a tool is large a plane says nothing.
    """
    middle = face.mean(axis=0)
    place = np.asarray(obstacle.point, dtype=float) + shift
    if obstacle.kind == CYLINDER:
        axis = unit(obstacle.direction)
        place = place + axis * (axis @ (middle - place))
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    along, twist = signs.T @ face / 4, (1, -1, 1, -1) @ face / 4
    at = np.array([0.0, 0.0, (middle - place) @ way])  # xi, eta, and how deep
    for _ in range(30):
        left = middle + at[:2] @ along + at[0] * at[1] * twist - place - at[2] * way
        slopes = np.column_stack([along[0] + at[1] * twist, along[1] + at[0] * twist, -way])
        at = at - np.linalg.lstsq(slopes, left, rcond=None)[0]
    inside = np.all(np.abs(at[:2]) <= 1 + 1e-9)
    # Farther than the face is wide it is on the far side of the body, if not beyond it.
    near = at[2] < np.ptp(face, axis=0).max()
    return max(0.0, float(at[2])) if inside and near else 0.0


def across(vectors, normals):
    """The parts (P, 3) of vectors across their normals."""
    return vectors - np.einsum("pi,pi->p", vectors, normals)[:, None] * normals
