"""Mappings of what a deck names: in any case, with errors that list what is there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from bipot.errors import ResultError

Value = TypeVar("Value")


class ByName(Mapping[str, Value]):
    """What a result has by names of the deck, in any case; a slash may stand for the file's "_".

    A name that is not there raises ResultError, which lists those that are.
    """

    def __init__(self, path: Path, kind: str, names: Iterable[str]):
        self._path = path
        self._kind = kind  # in words
        self._names = {name.upper(): name for name in names}

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names.values())

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and _key(name) in self._names

    def _name_in_file(self, name: str) -> str:
        if name not in self:
            there = f"; it has {', '.join(self)}" if self else ""
            raise ResultError(f"{self._path}: no {self._kind} '{name}'{there}")
        return self._names[_key(name)]

    def get(self, name: str, default: Any = None) -> Any:
        """Return what has the name, or `default` where nothing has."""
        try:
            return self[name]
        except ResultError:
            return default


def _key(name: str) -> str:
    return name.upper().replace("/", "_")
