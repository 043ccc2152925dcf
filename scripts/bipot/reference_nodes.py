"""The reference nodes of a result: what moves or carries forces beside the elements, over time."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bipot.errors import ResultError
from bipot.named_sets import NamedSets

if TYPE_CHECKING:
    from bipot.result import Description, Result

Array = NDArray[Any]

GROUP = "/reference_nodes"
QUANTITIES = ("displacement", "rotation", "reaction_force", "reaction_moment", "applied_force",
              "applied_moment")


class ReferenceNodes:
    """The R reference nodes of a result: reference_nodes[900] by the deck's id, or one by one.

    They are the reference nodes of obstacles and couplings, and nodes that equations alone name;
    none where the deck has no such nodes. A number that is none of them raises ResultError. Arrays
    have a row an increment of the run, T of them, and R nodes in the order of `node_ids`.
    """

    def __init__(self, result: Result):
        self.result = result

    @cached_property
    def node_ids(self) -> Array:
        """The deck's ids of the nodes, (R,)."""
        if GROUP not in self.result.file:
            return np.zeros(0, dtype=int)
        return self.result._dataset(f"{GROUP}/node_id")[()].astype(int)

    def __len__(self) -> int:
        return len(self.node_ids)

    def __iter__(self) -> Iterator[ReferenceNode]:
        return (ReferenceNode(self, int(node_id), row) for row, node_id in enumerate(self.node_ids))

    def __getitem__(self, node_id: int) -> ReferenceNode:
        return ReferenceNode(self, node_id, self.row(node_id))

    def __repr__(self) -> str:
        return f"<ReferenceNodes {self._words()}>"

    def _words(self) -> str:
        return ", ".join(map(str, self.node_ids))

    @property
    def quantities(self) -> list[str]:
        """Which of displacement, rotation, reaction_force, ... the file has."""
        return [name for name in QUANTITIES if f"{GROUP}/{name}" in self.result.file]

    @cached_property
    def sets(self) -> NamedSets:
        """The deck's sets that have reference nodes, by name: places of these in the arrays.

        A reference node that an element has, too, is not among them: it is a node of the mesh.
        """
        return NamedSets(self.result, "reference_nodes")

    def of_set(self, name: str) -> list[ReferenceNode]:
        """Return the reference nodes of a set of the deck; raise ResultError where it has none."""
        return [ReferenceNode(self, int(self.node_ids[row]), int(row)) for row in self.sets[name]]

    def row(self, node_id: int) -> int:
        """Return the place of a node in the arrays; raise ResultError where it is none of them."""
        found = np.flatnonzero(self.node_ids == node_id)
        if len(found) == 0:
            there = f"; it has {self._words()}" if len(self) else ""
            raise ResultError(f"{self.result.path}: no reference node {node_id}{there}")
        return int(found[0])

    def describe(self, name: str) -> Description:
        """Return what the file says of a dataset of these nodes, such as "reaction_force"."""
        return self.result.describe(f"{GROUP}/{name}")

    def _over_time(self, quantity: str) -> Array:
        if GROUP not in self.result.file:
            return np.zeros((self.result.finished, 0, 3))
        return self.result._dataset(f"{GROUP}/{quantity}")[: self.result.finished]

    @cached_property
    def coordinates(self) -> Array:
        """Where the nodes are in the deck [length], (R, 3)."""
        if GROUP not in self.result.file:
            return np.zeros((0, 3))
        return self.result._dataset(f"{GROUP}/coordinates")[()]

    @cached_property
    def displacement(self) -> Array:
        """Displacements from there in x, y, z [length], (T, R, 3)."""
        return self._over_time("displacement")

    @cached_property
    def rotation(self) -> Array:
        """Rotation vectors in x, y, z [rad], (T, R, 3); 0 where the deck turns nothing."""
        if f"{GROUP}/rotation" not in self.result.file:
            return np.zeros((self.result.finished, len(self), 3))
        return self._over_time("rotation")

    @cached_property
    def reaction_force(self) -> Array:
        """Forces of the supports on the nodes in x, y, z [force], (T, R, 3)."""
        return self._over_time("reaction_force")

    @cached_property
    def reaction_moment(self) -> Array:
        """Moments of the supports about the nodes in x, y, z [force times length], (T, R, 3).

        On obstacles that the deck turns, and on coupled faces. Raises ResultError where the deck
        has neither; `torque` of a pair is there for every obstacle.
        """
        return self._over_time("reaction_moment")

    @cached_property
    def applied_force(self) -> Array:
        """Forces of the loads in x, y, z [force], (T, R, 3); ResultError if not asked for (CF)."""
        return self._over_time("applied_force")

    @cached_property
    def applied_moment(self) -> Array:
        """Moments of the loads in x, y, z [force times length], (T, R, 3).

        Raises ResultError if not asked for (CF), or without couplings.
        """
        return self._over_time("applied_moment")


class ReferenceNode:
    """A reference node over the T increments of the run."""

    def __init__(self, nodes: ReferenceNodes, node_id: int, row: int):
        self.node_id = node_id  #: the deck's
        self._nodes, self._row = nodes, row

    def __repr__(self) -> str:
        return f"<ReferenceNode {self.node_id}>"

    @property
    def coordinates(self) -> Array:
        """Where the node is in the deck [length], (3,)."""
        return self._nodes.coordinates[self._row]

    @property
    def displacement(self) -> Array:
        """Displacement from there in x, y, z [length], (T, 3)."""
        return self._nodes.displacement[:, self._row]

    @property
    def rotation(self) -> Array:
        """Rotation vector in x, y, z [rad], (T, 3); 0 where the deck turns nothing."""
        return self._nodes.rotation[:, self._row]

    @property
    def reaction_force(self) -> Array:
        """Force of the supports on the node in x, y, z [force], (T, 3)."""
        return self._nodes.reaction_force[:, self._row]

    @property
    def reaction_moment(self) -> Array:
        """Moment of the supports about the node [force times length], (T, 3).

        Raises ResultError where the deck neither turns obstacles nor couples faces.
        """
        return self._nodes.reaction_moment[:, self._row]

    @property
    def applied_force(self) -> Array:
        """Force of the loads in x, y, z [force], (T, 3); ResultError if not asked for (CF)."""
        return self._nodes.applied_force[:, self._row]

    @property
    def applied_moment(self) -> Array:
        """Moment of the loads [force times length], (T, 3).

        Raises ResultError if not asked for (CF), or without couplings.
        """
        return self._nodes.applied_moment[:, self._row]
