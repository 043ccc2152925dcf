"""What is seen of the mesh: its boundary, or what a plane leaves of it with the section.

A vertex is a point between two nodes, so that it follows them and has their values. Both nodes are
the same at a corner of an element.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bipot.element_faces import CELLS

# Tetrahedra of a cell, by the number of its corners.
TETRAHEDRA = {
    4: ((0, 1, 2, 3),),
    5: ((0, 1, 2, 4), (0, 2, 3, 4)),
    6: ((0, 1, 2, 3), (1, 2, 3, 4), (2, 3, 4, 5)),
    8: ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)),
}
ROUNDING = 1e-9  # distance from the plane that is none, of the size of the mesh


class Vertices(NamedTuple):
    """Points between nodes: (..., 2) nodes, and (...) the share of the second."""

    nodes: np.ndarray
    share: np.ndarray

    def at(self, values):
        """Return values of nodes (N,) or (N, k) at the vertices."""
        first, second = values[self.nodes[..., 0]], values[self.nodes[..., 1]]
        share = self.share.reshape(self.share.shape + (1,) * (values.ndim - 1))
        # What is not a number at the other node of a corner counts for nothing.
        between = (1 - share) * first + share * second
        return np.where(share == 0, first, np.where(share == 1, second, between))

    @classmethod
    def corners(cls, nodes):
        """Return the vertices that are nodes."""
        return cls(np.stack([nodes, nodes], axis=-1), np.zeros(nodes.shape))

    @classmethod
    def joined(cls, parts):
        """Return the vertices of several, one behind the other."""
        return cls(*(np.concatenate(each) for each in zip(*parts, strict=True)))


class Skin(NamedTuple):
    """Polygons of four vertices (a triangle has one twice), and the lines of the mesh on them."""

    vertices: Vertices  #: (P, 4), anticlockwise from outside
    element: np.ndarray  #: (P,) of each
    sides: np.ndarray  #: (P, 4) whether side i, from vertex i to the next, is a line of the mesh
    grid: Vertices  #: (S, 2) lines of the mesh across the section
    outline: Vertices  #: (M, 2) sharp edges, and those of the section


def whole_skin(result, sharp):
    """Return the boundary of a mesh; `sharp` are nodes (M, 2) of its sharp edges."""
    faces, element = result.boundary
    return Skin(
        Vertices.corners(faces), element, result.boundary_edges,
        Vertices.corners(np.zeros((0, 2), int)), Vertices.corners(sharp),
    )


def cut_skin(result, sharp, axis, place, sign):
    """Return what a plane leaves of the mesh, before any displacement.

    axis, place  the plane, as x = 0.5
    sign         1: what lies above is cut away; -1: what lies below
    """
    points = result.points
    distance = sign * (points[:, axis] - place)
    distance[np.abs(distance) < ROUNDING * np.ptp(points, axis=0).max()] = 0.0
    faces, element = result.boundary
    parts, elements, sides, outline = cut_faces(faces, result.boundary_edges, distance)
    section, of_element = section_of(result, distance, axis, sign)
    count = len(section.share)
    edges = [clip_edge(edge, distance) for edge in sharp]
    outline += [edge for edge in edges if edge]
    return Skin(
        Vertices.joined([parts, section]), np.concatenate([element[elements], of_element]),
        np.concatenate([sides, np.zeros((count, 4), bool)]), grid_of(result, distance),
        as_vertices(outline, 2),
    )


def between(a, b, distance):
    """Return the vertex (a, b, share) of an edge in the plane."""
    return (a, b, distance[a] / (distance[a] - distance[b]))


def as_vertices(found, count):
    """Return vertices (n, count) of lists of (a, b, share)."""
    table = np.array(found, float).reshape(-1, count, 3)
    return Vertices(table[..., :2].astype(int), table[..., 2])


def clip_edge(edge, distance):
    """Return the part of an edge below the plane as two vertices, None where there is none."""
    a, b = edge
    below = distance[a] < 0, distance[b] < 0
    if not any(below):
        return None
    ends = [(node, node, 0.0) for node in (a, b)]
    if not all(below):
        ends[below.index(False)] = between(a, b, distance)
    return ends


def cut_faces(faces, sides, distance):
    """Cut boundary faces (F, 4): vertices, their faces, lines of the mesh, edges of the section."""
    below = distance[faces] < 0
    whole = np.flatnonzero((distance[faces] <= 0).all(axis=1) & below.any(axis=1))
    crossed = np.flatnonzero((distance[faces] > 0).any(axis=1) & below.any(axis=1))
    polygons, of_face, lines, outline = [], [], [], []
    for face in crossed:
        corners, marks = [], []
        for i in range(4):
            a, b = faces[face, i], faces[face, (i + 1) % 4]
            if a == b:
                continue
            if distance[a] <= 0:
                corners.append((a, a, 0.0))
                marks.append(bool(sides[face, i]) and (distance[a] < 0 or distance[b] < 0))
            if distance[a] * distance[b] < 0:
                corners.append(between(a, b, distance))
                # From below to above the section's edge follows, else what is left of the side.
                marks.append(distance[a] > 0 and bool(sides[face, i]))
        cut = [k for k, (a, b, _) in enumerate(corners) if a != b or distance[a] == 0]
        outline += [[corners[i], corners[j]] for i, j in pairwise(cut)]
        for k in range(1, len(corners) - 1, 2):
            last = min(k + 2, len(corners) - 1)
            polygons.append([corners[0], corners[k], corners[k + 1], corners[last]])
            of_face.append(face)
            lines.append([
                k == 1 and marks[0], marks[k], last > k + 1 and marks[k + 1],
                last == len(corners) - 1 and marks[last],
            ])
    for face in whole:  # with an edge in the plane
        for i in range(4):
            a, b = faces[face, i], faces[face, (i + 1) % 4]
            if a != b and distance[a] == 0 and distance[b] == 0:
                outline.append([(a, a, 0.0), (b, b, 0.0)])
    parts = Vertices.joined([Vertices.corners(faces[whole]), as_vertices(polygons, 4)])
    rows = np.concatenate([whole, np.array(of_face, int)])
    marked = np.concatenate([sides[whole], np.array(lines, bool).reshape(-1, 4)])
    return parts, rows, marked, outline


def section_of(result, distance, axis, sign):
    """Return the section of the elements, as vertices (P, 4) and their elements."""
    found, elements = [as_vertices([], 4)], [np.zeros(0, int)]
    for rows, nodes in result.cells.values():
        corners = CELLS[nodes.shape[1]].corners
        for local in TETRAHEDRA[corners]:
            tetrahedra = nodes[:, list(local)]
            # Those below first.
            above = distance[tetrahedra] >= 0
            order = np.argsort(above, axis=1, kind="stable")
            ordered = np.take_along_axis(tetrahedra, order, axis=1)
            for below, edges in (
                (1, ((0, 1), (0, 2), (0, 3), (0, 3))), (3, ((3, 0), (3, 1), (3, 2), (3, 2))),
                (2, ((0, 2), (0, 3), (1, 3), (1, 2))),
            ):
                chosen = np.flatnonzero((~above).sum(axis=1) == below)
                ends = ordered[chosen][:, np.array(edges)]
                a, b = distance[ends[..., 0]], distance[ends[..., 1]]
                found.append(Vertices(ends, a / np.where(a == b, 1.0, a - b)))
                elements.append(rows[chosen])
    section, element = Vertices.joined(found), np.concatenate(elements)
    places = section.at(result.points)
    normals = np.cross(places[:, 2] - places[:, 0], places[:, 3] - places[:, 1])
    real = np.linalg.norm(normals, axis=1) > ROUNDING * np.ptp(result.points, axis=0).max() ** 2
    wrong = sign * normals[:, axis] < 0
    turned = np.where(wrong[:, None], [3, 2, 1, 0], [0, 1, 2, 3])
    each = np.arange(len(turned))[:, None]
    return Vertices(section.nodes[each, turned][real], section.share[each, turned][real]), \
        element[real]


def grid_of(result, distance):
    """Return the lines (S, 2) in which the plane crosses faces of elements."""
    found = {}
    for _, nodes in result.cells.values():
        for face in CELLS[nodes.shape[1]].faces:
            corners = nodes[:, list(face)]
            below = distance[corners] < 0
            for row in np.flatnonzero(below.any(axis=1) & ~below.all(axis=1)):
                ring = corners[row]
                crossing = [
                    between(a, b, distance) for a, b in zip(ring, np.roll(ring, -1), strict=True)
                    if (distance[a] < 0) != (distance[b] < 0)
                ]
                found[tuple(sorted(ring))] = crossing[:2]
    return as_vertices(list(found.values()), 2)


def crossings(pieces, axis, place):
    """Return the lines (S, 2, 3) in which a plane crosses quadrilaterals (F, 4, 3)."""
    found = []
    for piece, distance in zip(pieces, pieces[:, :, axis] - place, strict=True):
        ends = []
        for i in range(4):
            j = (i + 1) % 4
            if (distance[i] < 0) != (distance[j] < 0):
                share = distance[i] / (distance[i] - distance[j])
                ends.append(piece[i] + share * (piece[j] - piece[i]))
        found += [ends[k:k + 2] for k in range(0, len(ends) - 1, 2)]
    return np.reshape(found, (-1, 2, 3))


def cut_pieces(pieces, axis, place, sign):
    """Return what a plane leaves of quadrilaterals (F, 4, 3) that are no part of the mesh."""
    distance = sign * (pieces[:, :, axis] - place)
    kept = [pieces[(distance <= 0).all(axis=1)]]
    for piece, away in zip(pieces, distance, strict=True):
        if not ((away < 0).any() and (away > 0).any()):
            continue
        polygon = []
        for i in range(4):
            j = (i + 1) % 4
            if away[i] <= 0:
                polygon.append(piece[i])
            if away[i] * away[j] < 0:
                polygon.append(piece[i] + away[i] / (away[i] - away[j]) * (piece[j] - piece[i]))
        for k in range(1, len(polygon) - 1, 2):
            last = min(k + 2, len(polygon) - 1)
            kept.append(np.array([[polygon[0], polygon[k], polygon[k + 1], polygon[last]]]))
    return np.concatenate(kept)

