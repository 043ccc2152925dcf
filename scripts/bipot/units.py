"""What a deck calls its units, for labels: no number is converted."""

from __future__ import annotations

from typing import NamedTuple

UNNAMED = "deck units"


class Units(NamedTuple):
    """The names of the units of force and length; both are empty where the deck has no *UNITS."""

    force: str = ""  #: as "N"
    length: str = ""  #: as "mm"

    @classmethod
    def from_text(cls, text: str) -> Units:
        """Return the units of `/run@units`, such as "N, mm"."""
        force, _, length = text.partition(", ")
        return cls(force, length)

    def of(self, quantity: str) -> str:
        """Return the unit of a quantity as `describe` names it, "" where it has none.

        "deck units" where the deck does not name its units.
        """
        force, length = self
        units = {
            "force": force, "length": length, "area": f"{length}²", "volume": f"{length}³",
            "pressure": f"{force}/{length}²", "moment": f"{force} {length}",
            "energy": f"{force} {length}",
        }  # fmt: skip
        if quantity not in units:
            return ""
        return units[quantity] if self.force else UNNAMED

    def label(self, words: str, quantity: str) -> str:
        """Return words with the unit of a quantity, in brackets."""
        unit = self.of(quantity)
        return f"{words} [{unit}]" if unit else words
