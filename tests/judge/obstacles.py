"""Gaps, normals and relative motions of points before rigid obstacles."""

import numpy as np
from scenes import CYLINDER, EPS, PLANE


def unit(vector):
    """A vector of length 1."""
    vector = np.asarray(vector, dtype=float)
    return vector / np.linalg.norm(vector)


def shift_of(obstacle, u):
    """The displacement (3,) of an obstacle."""
    return np.zeros(3) if obstacle.reference is None else u[obstacle.reference]


def locate(obstacle, places, u, shift, added=0.0):
    """Gap (P,), normal (P, 3) and rounding of the gap (P,) of points displaced by `u` (P, 3)."""
    extended = np.longdouble
    away = (places.astype(extended) - np.asarray(obstacle.point, dtype=extended)) + (
        u.astype(extended) - np.asarray(shift, dtype=extended)
    )
    size = np.abs(places).max(axis=1) + np.abs(u).max(axis=1)
    size = size + np.abs(obstacle.point).max() + np.abs(shift).max() + np.abs(added)
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


def across(vectors, normals):
    """The parts (P, 3) of vectors across their normals."""
    return vectors - np.einsum("pi,pi->p", vectors, normals)[:, None] * normals
