"""The named sets of a result: the deck's sets of nodes and bricks and its surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from bipot.errors import ResultError

if TYPE_CHECKING:
    from bipot.result import Result

Array = NDArray[Any]

GROUP = "/sets"
KINDS = {
    "nodes": "node set", "elements": "element set", "faces": "surface",
    "reference_nodes": "node set with reference nodes",
}


class NamedSets(Mapping[str, Array]):
    """The sets of one kind, by name: sets["PIN"], in any case. Their values are rows.

    A name that is not there raises ResultError, which lists those that are.
    """

    def __init__(self, result: Result, kind: str):
        self._result = result
        self._kind = kind  # "nodes", "elements", "faces" or "reference_nodes"
        self._names = {name.upper(): name for name in result.file.get(f"{GROUP}/{kind}", ())}

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names.values())

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and _key(name) in self._names

    def __getitem__(self, name: str) -> Array:
        if name not in self:
            raise ResultError(f"{self._result.path}: no {KINDS[self._kind]} '{name}'"
                              + (f"; it has {', '.join(self)}" if self else ""))
        return self._result._dataset(f"{GROUP}/{self._kind}/{self._names[_key(name)]}")[()]

    def get(self, name: str, default: Any = None) -> Any:
        """Return the rows of a set, or `default` where there is no such set."""
        try:
            return self[name]
        except ResultError:
            return default

    def __repr__(self) -> str:
        return f"<NamedSets of {self._kind}: {', '.join(self)}>"


def _key(name: str) -> str:
    return name.upper().replace("/", "_")
