"""The named sets of a result: the deck's sets of nodes and elements and its surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from bipot.by_name import ByName

if TYPE_CHECKING:
    from bipot.result import Result

Array = NDArray[Any]

GROUP = "/sets"
KINDS = {
    "nodes": "node set", "elements": "element set", "faces": "surface",
    "reference_nodes": "node set with reference nodes",
}


class NamedSets(ByName[Array]):
    """The sets of one kind, by name: sets["PIN"], in any case. Their values are rows.

    A name that is not there raises ResultError, which lists those that are.
    """

    def __init__(self, result: Result, kind: str):
        self._result = result
        self._group = f"{GROUP}/{kind}"  # "nodes", "elements", "faces" or "reference_nodes"
        super().__init__(result.path, KINDS[kind], result.file.get(self._group, ()))

    def __getitem__(self, name: str) -> Array:
        return self._result._dataset(f"{self._group}/{self._name_in_file(name)}")[()]

    def __repr__(self) -> str:
        return f"<NamedSets of {self._group.rpartition('/')[2]}: {', '.join(self)}>"
