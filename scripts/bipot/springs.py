"""The springs of a result: forces and elongations over the increments."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bipot.errors import ResultError

if TYPE_CHECKING:
    from bipot.result import Result

Array = NDArray[Any]

GROUP = "/springs"


class Springs:
    """The G springs of a result, in the order of `element_ids`; none where the deck has none.

    Arrays have a row an increment of the run, T of them.
    """

    def __init__(self, result: Result):
        self.result = result

    @cached_property
    def element_ids(self) -> Array:
        """The deck's ids of the springs, (G,)."""
        if GROUP not in self.result.file:
            return np.zeros(0, dtype=int)
        return self.result._dataset(f"{GROUP}/element_id")[()].astype(int)

    def __len__(self) -> int:
        return len(self.element_ids)

    @cached_property
    def force(self) -> Array:
        """Stiffness times elongation [force], (T, G); positive where SPRINGA draws."""
        return self._over_time("spring_force")

    @cached_property
    def elongation(self) -> Array:
        """Change of length of SPRINGA, u of SPRING1, u_1 - u_2 of SPRING2 [length], (T, G)."""
        return self._over_time("elongation")

    def row(self, element_id: int) -> int:
        """Return the place of a spring in the arrays; raise ResultError where there is none."""
        found = np.flatnonzero(self.element_ids == element_id)
        if len(found) == 0:
            raise ResultError(f"{self.result.path}: no spring {element_id}")
        return int(found[0])

    def _over_time(self, quantity: str) -> Array:
        if GROUP not in self.result.file:
            return np.zeros((self.result.finished, 0))
        return self.result._dataset(f"{GROUP}/{quantity}")[: self.result.finished]
