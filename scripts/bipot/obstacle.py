"""The rigid obstacle of a contact pair: its shape, where it is in an increment, and its surface."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bipot.element_faces import face_normals

Array = NDArray[Any]

SHAPES = {1: "plane", 2: "sphere", 3: "cylinder", 4: "facets"}
FINENESS = 16  # pieces of a drawn surface along the body
WHOLE = 0.75  # radius, of the body's size, up to which what is round is drawn whole
REACH = 0.8  # how far of a larger one is drawn from the contact, of the body's size


@dataclass(frozen=True)
class Obstacle:
    """An obstacle as the deck places it, or as `moved` has put it."""

    shape: str  #: "plane", "sphere", "cylinder" or "facets"
    point: Array  #: (3,) of the plane; centre of the sphere; on the axis of the cylinder
    direction: Array  #: (3,) unit normal of the plane, to the body; along the cylinder's axis
    radius: float = 0.0  #: of the sphere or cylinder
    inner: bool = False  #: the body lies inside
    node: int | None = None  #: the deck's id of its reference node; None: it is at rest
    #: (C, 3) of the facets
    corners: Array = field(default_factory=lambda: np.zeros((0, 3)))
    #: (F, 4) rows of `corners`, anticlockwise from the body; a triangle has its third one twice
    facets: Array = field(default_factory=lambda: np.zeros((0, 4), dtype=int))
    turn: Array | None = None  #: (3, 3) how it has turned since the start; None: not

    def moved(self, shift: Array, rotation: Array, pivot: Array) -> Obstacle:
        """Return it turned by a rotation vector [rad] about `pivot`, and shifted: (3,) each."""
        turn = rotation_matrix(np.asarray(rotation, float))
        about = np.asarray(pivot, float)

        def place(points: Array) -> Array:
            return (points - about) @ turn.T + about + shift

        return replace(
            self, point=place(self.point), direction=turn @ self.direction,
            corners=place(self.corners), turn=turn,
        )

    def surface(self, low: Array, high: Array, towards: Array) -> Array:
        """Return the part of its surface that is to be drawn about a body, (F, 4, 3).

        low, high   corners of the box of the body, (3,)
        towards     where the contact is: a large round one is drawn about there

        Small pieces, anticlockwise from the side of the body, of which triangles have their last
        corner twice. What is far from the body is left out.
        """
        size = max(float(np.max(high - low)), 1e-300)
        draw = {"plane": self._plane, "sphere": self._sphere, "cylinder": self._cylinder}
        pieces = draw.get(self.shape, self._facets)(low, high, towards, size).reshape(-1, 4, 3)
        middle = pieces.mean(axis=1)
        near = ((middle > low - size) & (middle < high + size)).all(axis=1)
        return self._turned_to_the_body(pieces[near])

    def _turned_to_the_body(self, pieces: Array) -> Array:
        if self.shape == "plane":
            out = np.broadcast_to(self.direction, (len(pieces), 3))
        elif self.shape in ("sphere", "cylinder"):
            out = pieces.mean(axis=1) - self.point
            out = (out - np.outer(out @ self.direction, self.direction)) * (1 - 2 * self.inner)
        else:  # facets are given so
            return pieces
        wrong = np.einsum("fx,fx->f", face_normals(pieces), out) < 0
        return np.where(wrong[:, None, None], pieces[:, [1, 0, 3, 2]], pieces)

    def _plane(self, low: Array, high: Array, _: Array, size: float) -> Array:
        first = perpendicular(self.direction)
        second = np.cross(self.direction, first)
        corners = _box(low, high) - self.point
        spans = []
        for axis in (first, second):
            along = corners @ axis
            margin = 0.1 * size
            spans.append(_steps(along.min() - margin, along.max() + margin, size / FINENESS))
        s, t = np.meshgrid(*spans, indexing="ij")
        return _pieces(self.point + s[..., None] * first + t[..., None] * second)

    def _sphere(self, low: Array, high: Array, towards: Array, size: float) -> Array:
        axis = _unit(towards - self.point, np.array([0.0, 0.0, 1.0]))
        first = perpendicular(axis)
        second = np.cross(axis, first)
        opening = np.pi if self.radius <= WHOLE * size else REACH * size / self.radius
        step = min(size / FINENESS / self.radius, np.pi / 18)
        polar = _steps(0.0, min(opening, np.pi), step)
        around = _steps(0.0, 2 * np.pi, max(np.pi / 18, step / max(np.sin(opening), 0.3)))
        p, a = np.meshgrid(polar, around, indexing="ij")
        p, a = p[..., None], a[..., None]
        out = np.cos(p) * axis + np.sin(p) * (np.cos(a) * first + np.sin(a) * second)
        return _pieces(self.point + self.radius * out)

    def _cylinder(self, low: Array, high: Array, towards: Array, size: float) -> Array:
        axis = self.direction
        along = (_box(low, high) - self.point) @ axis
        margin = 0.04 * size
        lengths = _steps(along.min() - margin, along.max() + margin, size / FINENESS)
        # Pieces are those of the turning obstacle: where it turns their lines show it.
        turn = np.eye(3) if self.turn is None else self.turn
        first = turn @ perpendicular(turn.T @ axis)
        second = np.cross(axis, first)
        count = int(np.ceil(2 * np.pi / min(size / FINENESS / self.radius, np.pi / 18)))
        angles = 2 * np.pi * np.arange(count) / count
        if self.radius > WHOLE * size:
            arm = towards - self.point
            middle = np.arctan2(arm @ second, arm @ first)
            away = (angles + np.pi / count - middle + np.pi) % (2 * np.pi) - np.pi
            angles = angles[np.abs(away) <= REACH * size / self.radius]
        ends = np.stack([angles, angles + 2 * np.pi / count], axis=1)
        x = self.radius * (
            np.cos(ends)[..., None] * first + np.sin(ends)[..., None] * second
        ) + self.point
        along = lengths[:, None] * axis
        parts = [
            x[:, None, 0] + along[None, :-1], x[:, None, 1] + along[None, :-1],
            x[:, None, 1] + along[None, 1:], x[:, None, 0] + along[None, 1:],
        ]
        return np.stack(parts, axis=2)

    def _facets(self, low: Array, high: Array, _: Array, size: float) -> Array:
        low, high = low - 0.25 * size, high + 0.25 * size
        facets = self.corners[self.facets]
        near = ((facets.max(axis=1) >= low) & (facets.min(axis=1) <= high)).all(axis=1)
        facets = facets[near]
        inside = ((facets >= low) & (facets <= high)).all(axis=(1, 2))
        fine = inside & (np.ptp(facets, axis=1).max(axis=1) <= size / FINENESS)
        pieces = [facets[fine]]
        for corners in facets[~fine]:
            triangle = np.array_equal(corners[2], corners[3])
            polygon = clip(corners[:3] if triangle else corners, low, high)
            for k in range(1, len(polygon) - 1, 2):
                part = polygon[[0, k, k + 1, min(k + 2, len(polygon) - 1)]]
                longest = np.linalg.norm(part - np.roll(part, 1, axis=0), axis=1).max()
                count = min(int(np.ceil(longest * FINENESS / size)), FINENESS)
                s = np.linspace(0, 1, max(count, 1) + 1)
                s, t = (grid[..., None] for grid in np.meshgrid(s, s, indexing="ij"))
                pieces.append(_pieces(
                    (1 - s) * ((1 - t) * part[0] + t * part[3])
                    + s * ((1 - t) * part[1] + t * part[2])
                ))
        return np.concatenate(pieces)


def rotation_matrix(vector: Array) -> Array:
    """Return the matrix (3, 3) of a rotation vector (3,) [rad], by Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def perpendicular(axis: Array) -> Array:
    """Return a unit vector perpendicular to `axis`: along x, y or z where one of them is."""
    k = int(np.argmin(np.abs(axis) + np.array([0.0, 1e-9, 2e-9])))
    vector = np.eye(3)[k] - axis[k] * axis
    return vector / np.linalg.norm(vector)


def clip(polygon: Array, low: Array, high: Array) -> Array:
    """Return the part of a convex polygon (n, 3) that lies in a box, by Sutherland and Hodgman."""
    for axis in range(3):
        for bound, sign in ((low[axis], 1.0), (high[axis], -1.0)):
            kept: list[Array] = []
            for here, there in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
                a, b = sign * (here[axis] - bound), sign * (there[axis] - bound)
                if a >= 0:
                    kept.append(here)
                if a * b < 0:
                    kept.append(here + a / (a - b) * (there - here))
            polygon = np.array(kept).reshape(-1, 3)
    return polygon


def _unit(vector: Array, otherwise: Array) -> Array:
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else otherwise


def _box(low: Array, high: Array) -> Array:
    """Return the corners of a box, (8, 3)."""
    bounds = np.stack([low, high])
    return np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]]
                     for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def _steps(first: float, last: float, step: float) -> Array:
    return np.linspace(first, last, max(int(np.ceil((last - first) / step)), 1) + 1)


def _pieces(grid: Array) -> Array:
    """Return the quadrilaterals (F, 4, 3) of a grid of points (n, m, 3)."""
    parts = [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]]
    return np.stack(parts, axis=2).reshape(-1, 4, 3)
