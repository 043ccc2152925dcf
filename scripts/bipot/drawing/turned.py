"""The section of bodies of revolution, turned about its axis.

The picture stands upright: its z is the axis of the section, y; its x and y are across.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bipot.element_faces import face_normals

STEP = 5.0  # degrees between the sections of what is turned
SHARP = np.cos(np.radians(40))  # edges of the section that meet at more make a line
AXES = ("x", "", "y")  # of the section, along those of the picture


def turned(section, angle):
    """Return where places (..., 3) of the section are at an angle [rad], of the picture."""
    radius = np.hypot(section[..., 0], section[..., 2])
    return np.stack(
        [radius * np.cos(angle), radius * np.sin(angle), section[..., 1]], axis=-1)


def upright(pieces):
    """Return places (..., 3) of the deck in the picture."""
    return np.stack([pieces[..., 0], -pieces[..., 2], pieces[..., 1]], axis=-1)


def without_the_gap(pieces, angles):
    """Return the pieces (F, 4, 3) of the picture that lie within the angles [rad]."""
    middle = pieces.mean(axis=1)
    beyond = (np.arctan2(middle[:, 1], middle[:, 0]) - angles[0]) % (2 * np.pi)
    return pieces[beyond <= angles[-1] - angles[0]]


def turn_section(polygons, values, nodes, sides, angles):
    """Turn the section that faces the spectator; return polygons, values, lines and outline.

    polygons  (P, 4, 3) of the boundary of the wedge
    values    (P, 4) at their corners
    nodes     (P, 4) of the corners
    sides     (P, 4) whether side i is a line of the mesh
    angles    (K,) of the sections, ascending [rad]
    """
    front = face_normals(polygons)[:, 2] > 0.5
    polygons, values, nodes, sides = (each[front] for each in (polygons, values, nodes, sides))
    ends = np.stack([polygons, np.roll(polygons, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    pairs = np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=2).reshape(-1, 2)
    of_ends = np.stack([values, np.roll(values, -1, axis=1)], axis=2).reshape(-1, 2)
    _, where, count = np.unique(
        np.sort(pairs, axis=1), axis=0, return_inverse=True, return_counts=True)
    outer = (count[where.ravel()] == 1) & (pairs[:, 0] != pairs[:, 1])
    edges, edge_nodes, edge_values = ends[outer], pairs[outer], of_ends[outer]
    shells = []
    for first, second in pairwise(angles):
        at, then = turned(edges, first), turned(edges, second)
        shells.append(np.stack([at[:, 0], then[:, 0], then[:, 1], at[:, 1]], axis=1))
    shell_values = np.tile(edge_values[:, [0, 0, 1, 1]], (len(angles) - 1, 1))
    mesh = ends[sides.ravel()]
    corners = sharp_corners(edges, edge_nodes)
    circles = np.concatenate([
        np.stack([turned(corners, first), turned(corners, second)], axis=1)
        for first, second in pairwise(angles)
    ])
    caps = [turned(polygons, angles[0]), turned(polygons, angles[-1])[:, ::-1]]
    return (
        np.concatenate([*caps, *shells]),
        np.concatenate([values, values[:, ::-1], shell_values]),
        np.concatenate([turned(mesh, angles[0]), turned(mesh, angles[-1])]),
        np.concatenate([turned(edges, angles[0]), turned(edges, angles[-1]), circles]),
    )


def sharp_corners(edges, nodes):
    """Return the places (C, 3) of the section where two outer edges meet at an angle."""
    along = edges[:, 1] - edges[:, 0]
    along = along / np.linalg.norm(along, axis=1)[:, None]
    ending = {int(node): k for k, node in enumerate(nodes[:, 1])}
    found = [
        edges[k, 0] for k, node in enumerate(nodes[:, 0])
        if int(node) in ending and along[k] @ along[ending[int(node)]] < SHARP
    ]
    return np.array(found).reshape(-1, 3)
