"""Values of a result along a path: `Result.along` describes it."""

from __future__ import annotations

from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.element_faces import CELLS
from bipot.errors import ResultError
from bipot.quantities import von_mises

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    import matplotlib.figure

    from bipot.result import Result

Array = NDArray[Any]

# The corners of the cells in their natural coordinates.
CUBE = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1),
        (-1, 1, 1)]  # fmt: skip
SIMPLEX = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
PRISM = [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
CORNERS = {8: CUBE, 20: CUBE, 4: SIMPLEX, 10: SIMPLEX, 6: PRISM, 15: PRISM}
# All nodes of a pyramid with 13: the first two coordinates go across the square from side to side
# at each height, and the third from 0 at the apex to 1 at the square.
CONE = [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1), (0, 0, 0), (0, -1, 1), (1, 0, 1), (0, 1, 1),
        (-1, 0, 1), (-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, 0.5)]  # fmt: skip
SQUARE = [(a, b) for a in (0, 1) for b in (0, 1)]
TRIANGLE = [(0, 0), (1, 0), (0, 1)]
TRIANGLE2 = [*TRIANGLE, (2, 0), (1, 1), (0, 2)]
# Exponents of the monomials of the shape functions, by the number of nodes.
MONOMIALS = {
    4: [(0, 0, 0), *np.eye(3, dtype=int)],
    10: [e for e in np.ndindex(3, 3, 3) if sum(e) <= 2],
    6: [(*e, c) for c in (0, 1) for e in TRIANGLE],
    15: [(*e, c) for c in (0, 1) for e in TRIANGLE2] + [(*e, 2) for e in TRIANGLE],
    8: list(np.ndindex(2, 2, 2)),
    # The power of what is squared alone counts: serendipity.
    20: [e for e in np.ndindex(3, 3, 3) if sum(k for k in e if k > 1) <= 2],
    13: [(0, 0, 0), *((*e, c) for c in (1, 2) for e in SQUARE),
         *((*e, 2) for e in ((2, 0), (0, 2), (2, 1), (1, 2)))],
}
ON_THE_FACE = 1e-6  # how far outside a point still belongs to an element, in natural coordinates
MOST_STEPS = 30  # of Newton's method for natural coordinates
COLUMNS = {
    "displacement": ("_x", "_y", "_z"), "stress": ("_xx", "_yy", "_zz", "_xy", "_yz", "_xz"),
    "contact_pressure": ("",),
}  # fmt: skip


class Path:
    """Places before any displacement, and what the result has there.

    A place that no element holds has values that are not numbers. Where two bodies touch, a place
    belongs to the one whose surface is the slave.
    """

    def __init__(self, result: Result, points: Array, distance: Array, elements: Array | None):
        self.result = result
        self.points = points  #: (P, 3)
        self.distance = distance  #: (P,) along the path
        self._allowed = elements
        if (self.element < 0).all():
            raise ResultError(f"{result.path}: no element has a point of this path")

    def __repr__(self) -> str:
        inside = int((self.element >= 0).sum())
        return f"<Path of {len(self.points)} points, {inside} of them in elements>"

    @cached_property
    def _places(self) -> tuple[Array, Array, Array]:
        """Element (P,), -1 where there is none; its nodes and their weights, (P, 20) each."""
        count = len(self.points)
        element, nodes = np.full(count, -1), np.zeros((count, 20), int)
        weights, best = np.zeros((count, 20)), np.full(count, np.inf)
        slave = np.zeros(len(self.result.points), bool)
        for pair in self.result.pairs.values():
            slave[pair.nodes] = True
        for rows, of_cell in self.result.cells.values():
            if self._allowed is not None:
                chosen = np.isin(rows, self._allowed)
                rows, of_cell = rows[chosen], of_cell[chosen]
            # A pyramid of 5 nodes is the hexahedron whose upper corners are in one place.
            if of_cell.shape[1] == 5:
                of_cell = of_cell[:, [0, 1, 2, 3, 4, 4, 4, 4]]
            for point, near in enumerate(self._near(of_cell)):
                if len(near) == 0:
                    continue
                corners = self.result.points[of_cell[near]]
                natural, outside = natural_coordinates(corners, self.points[point])
                # Of elements that share the place one with a slave node comes first.
                rank = np.where(outside <= ON_THE_FACE, 0.0, np.inf)
                rank = rank + np.where(slave[of_cell[near]].any(axis=1), 0, 1)
                k = int(np.argmin(rank))
                if rank[k] < best[point]:
                    best[point], element[point] = rank[k], rows[near[k]]
                    size = of_cell.shape[1]
                    nodes[point, :size] = of_cell[near[k]]
                    nodes[point, size:] = of_cell[near[k], 0]
                    weights[point] = 0.0
                    weights[point, :size] = shape_functions(natural[k : k + 1], size)[0]
        return element, nodes, weights

    def _near(self, of_cell: Array) -> Iterator[Array]:
        """Yield the elements of a cell (n, k) whose boxes have each point."""
        corners = self.result.points[of_cell]
        low, high = corners.min(axis=1), corners.max(axis=1)
        # Faces with nodes in the middles of their edges may stand out of the box of the nodes.
        room = (0.25 if of_cell.shape[1] > 8 else 1e-6) * (high - low).max(axis=1, keepdims=True)
        low, high = low - room, high + room
        for point in self.points:
            yield np.flatnonzero(((point >= low) & (point <= high)).all(axis=1))

    @property
    def element(self) -> Array:
        """The elements, rows of `element_ids`; -1 where there is none: (P,)."""
        return self._places[0]

    def field(self, name: str, index: int = -1, on: str | None = None) -> Array:
        """Return a field of the stored increment `index` at the points: (P, ...).

        `name` and `on` are those of `Result.field`. Between nodes a field follows the shape
        functions of the element; a field on elements is that of the element.
        """
        element, nodes, weights = self._places
        if on is None:
            on = "nodes" if name in self.result.field_names[0] else "elements"
        values = self.result.field(name, index, on)
        found = values[element] if on == "elements" else \
            np.einsum("pk,pk...->p...", weights, values[nodes])
        found = np.asarray(found, float).copy()
        found[element < 0] = np.nan
        return found

    def table(self, index: int = -1) -> dict[str, Array]:
        """Return distance, places and what the result has there, a column each: (P,).

        Columns: distance, x, y, z, element (the deck's id, 0 where there is none), and as far as
        the file has them displacement_x, ..., stress_xx, ..., von_mises, contact_pressure.
        pandas.DataFrame takes it as it is.
        """
        ids = np.append(self.result.element_ids, 0)
        columns = {"distance": self.distance}
        columns |= dict(zip("xyz", self.points.T, strict=True))
        columns["element"] = ids[self.element]
        there = self.result.field_names[0] | self.result.field_names[1]
        for name, endings in COLUMNS.items():
            if name in there:
                values = self.field(name, index).reshape(len(self.points), -1)
                columns |= {name + end: values[:, k] for k, end in enumerate(endings)}
                if name == "stress":
                    columns["von_mises"] = von_mises(values)
        return columns

    def to_csv(self, path: str | os.PathLike[str], index: int = -1) -> None:
        """Write `table` as text, numbers between commas."""
        table = self.table(index)
        np.savetxt(path, np.stack(list(table.values()), axis=1), "%.9g", ",",
                   header=",".join(table), comments="")

    def plot(self, index: int = -1) -> matplotlib.figure.Figure:
        """Return a figure of displacement, stress and contact pressure over the distance."""
        from bipot.drawing.curves import draw_along

        return draw_along(self, index)


def path_of(
    result: Result, points: ArrayLike, count: int | None, elements: str | ArrayLike | None
) -> Path:
    """Return the Path that Result.along describes."""
    given = np.asarray(points, float)
    if given.ndim != 2 or given.shape[1] != 3 or len(given) < 2 or not np.isfinite(given).all():
        raise ValueError("a path needs two or more points of three coordinates each")
    if count is not None and count < 2:
        raise ValueError(f"a path needs two or more points, not {count}")
    steps = np.linalg.norm(np.diff(given, axis=0), axis=1)
    distance = np.concatenate([[0.0], np.cumsum(steps)])
    if distance[-1] == 0:
        raise ValueError("the path has no length")
    if count is not None:
        places = np.linspace(0, distance[-1], count)
        given = np.stack([np.interp(places, distance, x) for x in given.T], axis=1)
        distance = places
    if isinstance(elements, str):
        elements = result.element_sets[elements]
    return Path(result, given, distance, None if elements is None else np.asarray(elements))


def node_places(size: int) -> Array:
    """Return the natural coordinates of the nodes of a cell with so many: (size, 3)."""
    if size == len(CONE):
        return np.array(CONE, float)
    corners = np.array(CORNERS[size], float)
    middles = [corners[list(edge)].mean(axis=0) for edge in CELLS[size].edges]
    return np.concatenate([corners, middles])[:size]


def monomials(size: int, natural: Array) -> Array:
    """Return the monomials of a cell at natural coordinates (n, 3): (n, size)."""
    return (natural[:, None, :] ** np.array(MONOMIALS[size])).prod(axis=2)


@cache
def of_monomials(size: int) -> Array:
    """Return the shares of the monomials in the shape functions of a cell: (size, size)."""
    return np.linalg.inv(monomials(size, node_places(size)))


def shape_functions(natural: Array, size: int) -> Array:
    """Return the shape functions of a cell at natural coordinates (n, 3): (n, size)."""
    return monomials(size, natural) @ of_monomials(size)


def shape_gradients(natural: Array, size: int) -> Array:
    """Return their derivatives by the natural coordinates: (n, size, 3)."""
    powers = np.array(MONOMIALS[size])
    found = []
    for k in range(3):
        lower = powers - (np.arange(3) == k) * (powers[:, k : k + 1] > 0)
        found.append(powers[:, k] * (natural[:, None, :] ** lower).prod(axis=2))
    return np.stack([one @ of_monomials(size) for one in found], axis=2)


def natural_coordinates(corners: Array, point: Array) -> tuple[Array, Array]:
    """Return where a point is in elements of one cell, and how far outside of each.

    corners  places of their nodes (n, k, 3)

    Newton's method. Returns natural coordinates (n, 3), and (n,) 0 inside.
    """
    size = corners.shape[1]
    natural = np.tile(node_places(size).mean(axis=0), (len(corners), 1))
    for _ in range(MOST_STEPS):
        residual = point - np.einsum("nk,nki->ni", shape_functions(natural, size), corners)
        jacobian = np.einsum("nkj,nki->nij", shape_gradients(natural, size), corners)
        step = np.einsum("nij,nj->ni", np.linalg.pinv(jacobian), residual)
        natural = np.clip(natural + step, -3, 3)
        if np.abs(step).max() < 1e-12:
            break
    residual = point - np.einsum("nk,nki->ni", shape_functions(natural, size), corners)
    missed = np.linalg.norm(residual, axis=1) / np.ptp(corners, axis=1).max(axis=1)
    a, b, c = natural.T
    sides = {
        8: [-1 - natural, natural - 1], 4: [-natural, (a + b + c - 1)[:, None]],
        6: [-natural[:, :2], (a + b - 1)[:, None], np.abs(c)[:, None] - 1],
        5: [np.abs(natural[:, :2]) - 1, -c[:, None], c[:, None] - 1],
    }[CELLS[size].corners]
    outside = np.concatenate(sides, axis=1).max(axis=1)
    return natural, np.where(missed > ON_THE_FACE, np.inf, np.maximum(outside, 0))
