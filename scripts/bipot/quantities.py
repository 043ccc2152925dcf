"""What the numbers of a result mean: states of contact points, von Mises' stress."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

OPEN, STICK, SLIDE = 0, 1, 2
STATUS_NAMES = ("open", "stick", "slide")


def von_mises(stress: Array) -> Array:
    """Return von Mises's stress of rows XX YY ZZ XY YZ XZ."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    return np.sqrt(
        ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + xz**2)
    )
