"""The contact pairs of a result: what happened at the candidate points of each."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from bipot.by_name import ByName
from bipot.errors import ResultError
from bipot.obstacle import SHAPES, Obstacle

if TYPE_CHECKING:
    from bipot.result import Description, Result

Array = NDArray[Any]


class Pairs(ByName["Pair"]):
    """The contact pairs of a result by name: pairs["BODY-ZMIN:GROUND"], in any case, or pairs[0].

    Names are those of the deck, "<slave surface>:<master>". It is a mapping: `for name in pairs`
    goes through the names, `for pair in pairs.values()` through the pairs. A name that is not there
    raises ResultError.
    """

    def __init__(self, result: Result, names: list[str]):
        super().__init__(result.path, "contact pair", names)
        self._pairs = {name: Pair(result, name) for name in self}

    @property
    def names(self) -> list[str]:
        """The names of the pairs."""
        return list(self)

    @overload
    def __getitem__(self, which: int | str) -> Pair: ...

    @overload
    def __getitem__(self, which: slice) -> list[Pair]: ...

    def __getitem__(self, which: int | str | slice) -> Pair | list[Pair]:
        if not isinstance(which, str):
            return list(self._pairs.values())[which]
        return self._pairs[self._name_in_file(which)]

    def __repr__(self) -> str:
        return f"<Pairs {', '.join(self)}>"


class Pair:
    """What happened at the P candidate points of one contact pair."""

    def __init__(self, result: Result, name: str):
        self.result = result
        self.name = name

    def __repr__(self) -> str:
        return f"<Pair {self.name}>"

    def describe(self, name: str) -> Description:
        """Return what the file says of a dataset of the pair, such as "resultant"."""
        return self.result.describe(f"/contact/{self.name}/{name}")

    def _points(self, quantity: str) -> Array:
        """Return a dataset that is the same in all increments."""
        return self.result._dataset(f"/contact/{self.name}/{quantity}")[()]

    def _over_time(self, quantity: str) -> Array:
        """Return a dataset over the finished increments."""
        return self.result._dataset(f"/contact/{self.name}/{quantity}")[: self.result.finished]

    @cached_property
    def obstacle(self) -> Obstacle | None:
        """The obstacle that is the master, as the deck places it; None where bodies are."""
        group = self.result.file[f"/contact/{self.name}"]
        if "obstacle_shape" not in group:
            return None
        given = {name[9:]: group[name][()] for name in group if name.startswith("obstacle_")}
        shape, node = SHAPES.get(int(given["shape"][0]), "unknown"), int(given["node"][0])
        facets = {}
        if "connectivity" in given:
            nodes = given["connectivity"].reshape(-1, 4)
            facets["facets"] = np.where(nodes < 0, nodes[:, 2:3], nodes)
            facets["corners"] = given["corners"]
        number = None
        if node >= 0:
            number = int(self.result._dataset("/reference_nodes/node_id")[node])
        return Obstacle(
            shape, given["point"], given["direction"], float(given["radius"][0]),
            bool(given["inner"][0]), number, **facets,
        )

    def obstacle_at(self, index: int = -1, scale: float = 1.0) -> Obstacle | None:
        """Return the obstacle where it is in the stored increment `index`, or None.

        `scale` is the factor of its displacement and rotation. Raises ResultError where there is
        no such increment.
        """
        obstacle = self.obstacle
        if obstacle is None or obstacle.node is None:
            return obstacle
        row = self.result.field_row(index)
        node = self.result.reference_nodes[obstacle.node]
        shift, rotation = scale * node.displacement[row], scale * node.rotation[row]
        return obstacle.moved(shift, rotation, node.coordinates)

    @cached_property
    def master_nodes(self) -> Array:
        """Rows of the mesh's points that the master has where it is a surface; else none: (M,)."""
        if "master_node" not in self.result.file[f"/contact/{self.name}"]:
            return np.zeros(0, dtype=int)
        return self._points("master_node")

    @cached_property
    def pressure(self) -> Array:
        """Normal reactions over the points' areas, as far as the master covers them: (T, P)."""
        area = self.area
        if "covered_area" in self.result.file[f"/contact/{self.name}"]:
            area = self._over_time("covered_area")
        area = np.broadcast_to(area, self.reaction.shape[:2])
        return np.divide(
            self.reaction[:, :, 0], area, out=np.zeros(area.shape), where=area > 0
        )

    @cached_property
    def partly_covered(self) -> Array:
        """Where a master of faces covers less than half of what a point turns to it: (T, P).

        A pressure there is a force over little area: it is not compared with others.
        """
        if "is_partly_covered" not in self.result.file[f"/contact/{self.name}"]:
            return np.zeros(self.reaction.shape[:2], dtype=bool)
        return self._over_time("is_partly_covered") == 1

    @cached_property
    def largest_pressure(self) -> Array:
        """Largest pressure of the points: (T,).

        Points that are partly covered, and reactions that are not determined, are left out.
        """
        return self._over_time("largest_pressure")

    @cached_property
    def largest_slip(self) -> Array:
        """Longest slip of the points since the start of the run: (T,)."""
        return self._over_time("largest_slip")

    @cached_property
    def side(self) -> Array:
        """Side of the master that each point is before, from 1: (P,).

        Concave edges divide a master of faces into sides, and a node has a point before each.
        """
        if "master_side" not in self.result.file[f"/contact/{self.name}"]:
            return np.ones(len(self.nodes), dtype=int)
        return self._points("master_side")

    @cached_property
    def friction_coefficient(self) -> float:
        """The pair's coefficient of friction, the largest where it depends on the pressure.

        Not a number where the file does not tell.
        """
        attributes = self.result.file[f"/contact/{self.name}"].attrs
        return float(attributes.get("friction_coefficient", np.nan))

    @cached_property
    def friction_coefficients(self) -> Array:
        """The coefficient of friction in each increment, (T,): *CHANGE FRICTION gives it anew."""
        if "friction" not in self.result.file[f"/contact/{self.name}"]:
            return np.full(self.result.finished, self.friction_coefficient)
        return self._over_time("friction")

    @cached_property
    def is_removed(self) -> Array:
        """Whether *MODEL CHANGE has removed the pair, (T,)."""
        if "is_removed" not in self.result.file[f"/contact/{self.name}"]:
            return np.zeros(self.result.finished, dtype=bool)
        return self._over_time("is_removed").astype(bool)

    @cached_property
    def nodes(self) -> Array:
        """Rows of the mesh's points, (P,)."""
        return self._points("node")

    @cached_property
    def coordinates(self) -> Array:
        """Where the points are before any displacement, (P, 3)."""
        return self._points("coordinates")

    @cached_property
    def area(self) -> Array:
        """The part of the surface that belongs to each point, (P,)."""
        return self._points("area")

    @cached_property
    def extra_gap(self) -> Array:
        """What *CONTACT GAP adds to the distance that the mesh says, (P,)."""
        if "extra_gap" not in self.result.file[f"/contact/{self.name}"]:
            return np.zeros(len(self.nodes))
        return self._points("extra_gap")

    @cached_property
    def allowed_interference(self) -> Array:
        """What *CONTACT INTERFERENCE lets points overlap by, which the gap has added: (T, P)."""
        if "allowed_interference" not in self.result.file[f"/contact/{self.name}"]:
            return np.zeros((self.result.finished, len(self.nodes)))
        return self._over_time("allowed_interference")

    @cached_property
    def frame(self) -> Array:
        """Local frames, rows n, t1, t2: (T, P, 3, 3), stored once where they do not change."""
        frame = self.result._dataset(f"/contact/{self.name}/frame")
        rows = self.result.finished
        if len(frame) == 1:
            return np.broadcast_to(frame[()], (rows, *frame.shape[1:]))
        return frame[:rows]

    @cached_property
    def reaction(self) -> Array:
        """Reactions on the slave body in the local frame n, t1, t2: (T, P, 3)."""
        return self._over_time("reaction")

    @cached_property
    def force(self) -> Array:
        """Reactions on the slave body in x, y, z: (T, P, 3)."""
        return np.einsum("tpa,tpax->tpx", self.reaction, self.frame)

    @cached_property
    def friction(self) -> Array:
        """Tangential part of `force`, (T, P, 3)."""
        return np.einsum("tpa,tpax->tpx", self.reaction[:, :, 1:], self.frame[:, :, 1:])

    @cached_property
    def gap(self) -> Array:
        """Distances to the obstacle, (T, P)."""
        return self._over_time("gap")

    @cached_property
    def slip(self) -> Array:
        """Slip since the start of the run, local t1 and t2: (T, P, 2)."""
        return self._over_time("slip")

    @cached_property
    def slip_increment(self) -> Array:
        """Slip in each increment, local t1 and t2: (T, P, 2)."""
        return self._over_time("slip_increment")

    @cached_property
    def status(self) -> Array:
        """OPEN, STICK or SLIDE, (T, P)."""
        return self._over_time("status")

    @cached_property
    def resultant(self) -> Array:
        """Sum of the reactions on the slave body in x, y, z: (T, 3)."""
        return self._over_time("resultant")

    @cached_property
    def normal_force(self) -> Array:
        """Sum of the normal reactions on the slave body in x, y, z: (T, 3)."""
        return self._over_time("forces")[:, 0]

    @cached_property
    def friction_force(self) -> Array:
        """Sum of the friction on the slave body in x, y, z: (T, 3)."""
        return self._over_time("forces")[:, 1]

    @cached_property
    def moment(self) -> Array:
        """Moment of the reactions on the slave body about the origin: (T, 3)."""
        return self._over_time("moment")

    @cached_property
    def middle(self) -> Array:
        """Middle of the slave surface, or the point beside it of the axis if there is one: (3,)."""
        if "middle" not in self.result.file[f"/contact/{self.name}"]:  # of an earlier version
            weights = self.area if self.area.any() else None
            return np.average(self.coordinates, axis=0, weights=weights)
        return self._points("middle")

    @cached_property
    def moment_about_middle(self) -> Array:
        """Moment of the reactions on the slave body about `middle`: (T, 3)."""
        return self.moment - np.cross(self.middle, self.resultant)

    @cached_property
    def torque(self) -> Array:
        """Moment of the forces on the obstacle about its reference node: (T, 3)."""
        return self._over_time("torque")

    @cached_property
    def normal_sum(self) -> Array:
        """Sum of the normal reactions, (T,)."""
        return self.reaction[:, :, 0].sum(axis=1)

    @cached_property
    def friction_sum(self) -> Array:
        """Sum of the magnitudes of the tangential reactions, (T,)."""
        return np.linalg.norm(self.reaction[:, :, 1:], axis=2).sum(axis=1)

    def force_at(self, node: int) -> Array:
        """Return the local reactions (n, t1, t2) at a node over the increments, (T, 3).

        Of a node before several sides of the master they are those of the side that it presses
        most, over all increments together.
        """
        found = np.flatnonzero(self.nodes == node)
        if len(found) == 0:
            raise ResultError(f"{self.result.path}: node {node} is not in pair {self.name}")
        return self.reaction[:, found[self.reaction[:, found, 0].sum(axis=0).argmax()]]

    @cached_property
    def faces(self) -> Array:
        """Boundary faces whose four corners are points of this pair, as mesh points (F, 4)."""
        faces, _ = self.result.boundary
        return faces[np.isin(faces, self.nodes).all(axis=1)]

    @cached_property
    def lines(self) -> list[tuple[Array, Array]]:
        """The slave surface of elements of a plane: points of the pair along each of its lines.

        Points (n,), rows of `nodes`, and their distances along the line (n,). A line begins where
        x is least, or y; of a closed one the first point is the last, too.
        """
        points = self.result.points
        z, close = points[:, 2], 1e-9 * np.ptp(points, axis=0).max()
        in_plane = np.abs(z) <= close
        if self.result.run.get("bodies") == "slice":  # those of a thinner part begin further back
            in_plane = z < 0.5 * (z[self.nodes].min() + z[self.nodes].max()) - close
        beside: dict[int, set[int]] = {}
        for face in self.faces:
            for a, b in zip(face, np.roll(face, -1), strict=True):
                if a != b and in_plane[a] and in_plane[b]:
                    beside.setdefault(int(a), set()).add(int(b))
                    beside.setdefault(int(b), set()).add(int(a))
        row = {int(node): k for k, node in enumerate(self.nodes)}
        order = sorted(beside, key=lambda node: (len(beside[node]) != 1, *points[node]))
        found, left = [], set(beside)
        for start in order:
            if start not in left:
                continue
            line = [start]
            left.discard(start)
            while ahead := beside[line[-1]] & left:
                line.append(min(ahead))
                left.discard(line[-1])
            if len(line) > 2 and start in beside[line[-1]]:
                line.append(start)
            steps = np.linalg.norm(np.diff(points[line], axis=0), axis=1)
            distance = np.concatenate([[0.0], np.cumsum(steps)])
            found.append((np.array([row[node] for node in line]), distance))
        return found
