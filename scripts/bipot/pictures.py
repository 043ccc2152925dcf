"""Pictures of a result: what scripts/show writes and Result.plot returns.

What is drawn, a subject a file, is in bipot.drawing; which pictures there are is said here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, NamedTuple

import matplotlib
import matplotlib.pyplot as plt

from bipot.drawing.bodies import COMPONENTS, QUANTITIES, Bodies, Look, draw_bodies
from bipot.drawing.contact_map import draw_contact
from bipot.drawing.curves import draw_pressures
from bipot.drawing.film import draw_animation
from bipot.drawing.histories import draw_errors, draw_forces
from bipot.drawing.sequence import draw_sequence
from bipot.errors import ResultError

if TYPE_CHECKING:
    from bipot.result import Result

__all__ = (
    "COMPONENTS", "NAMES", "Look", "Picture", "animate", "figure", "has_bodies", "pictures_of",
    "plane_of",
)  # fmt: skip

BODIES = {"displacement": "deformed", "stress": "stress", "pressure": "pressure",
          "mesh_error": "mesh-error"}  # fmt: skip
NAMES = (*BODIES.values(), "contact", "forces", "errors", "accuracy")
OF_PAIRS = {"contact": draw_contact, "forces": draw_forces}


class Picture(NamedTuple):
    """A picture of a result."""

    name: str  #: of its file, without the ending
    text: str  #: what it shows
    figure: matplotlib.figure.Figure
    tight: bool  #: whether its margins may be cut off


def plane_of(words: str) -> tuple[int, float | None]:
    """Return axis and place of a plane such as "x=0.5"; "x" is in the middle of the bodies.

    Raises ValueError for what is none.
    """
    found = re.fullmatch(r"\s*([xyz])\s*(?:=\s*(\S+))?\s*", words)
    try:
        place = float(found[2]) if found and found[2] else None
    except ValueError:
        found = None
    if not found or (place is not None and not math.isfinite(place)):
        raise ValueError(f"not a plane, such as x=0.5 or x: {words!r}")
    return "xyz".index(found[1]), place


def has_bodies(result: Result) -> bool:
    """Return whether the file has displacements, without which no body is drawn."""
    return len(result.field_rows) > 0 and "displacement" in result.field_names[0]


def has_quantity(result: Result, quantity: str) -> bool:
    """Return whether the bodies can be drawn in the colours of a quantity."""
    if quantity == "pressure":
        return any(len(pair.nodes) for pair in result.pairs.values())
    return any(quantity in names for names in result.field_names)


def pictures_of(
    result: Result, look: Look | None = None, names: Collection[str] | None = None
) -> Iterator[Picture]:
    """Yield all pictures, one after the other; the receiver closes the figure.

    `names`: these alone, of `contact` and `forces` those of all pairs.
    """
    names = NAMES if names is None else names
    look = look or Look()
    if has_bodies(result):
        for quantity, name in BODIES.items():
            if name in names and has_quantity(result, quantity):
                yield picture_of_bodies(result, look, quantity, name)
    for pair in result.pairs.values():
        if len(pair.nodes) == 0:
            continue
        suffix = "" if len(result.pairs) == 1 else "-" + re.sub(r"[^A-Za-z0-9]+", "-", pair.name)
        if "contact" in names:
            text = f"Which points of {pair.name} are open, stick and slide"
            text += (" over the time." if result.is_plane else
                     ", at a few increments; arrows are friction.")
            yield Picture(
                f"contact{suffix}", text, draw_contact(result, pair), result.is_plane
            )
        if "forces" in names:
            yield Picture(
                f"forces{suffix}", f"Forces of {pair.name} over the time, and friction over "
                "normal force.", draw_forces(result, pair), True,
            )  # fmt: skip
    if "errors" in names:
        yield Picture(
            "errors", "Errors of the certificate, and estimated ones, over the time.",
            draw_errors(result), True,
        )  # fmt: skip
    if "accuracy" in names and result.accuracy is not None:
        yield Picture(
            "accuracy", "How far each run on the way to the accuracy was from what they tend to.",
            draw_sequence(result), True,
        )  # fmt: skip


def picture_of_bodies(result: Result, look: Look, quantity: str, name: str) -> Picture:
    """Return a picture of the bodies in the colours of a quantity."""
    pressure = quantity == "pressure"
    if pressure and result.is_plane:
        return Picture(name, "The contact pressure over the length of the surfaces.",
                       draw_pressures(result, look.index), True)
    bodies = Bodies(result, look, apart=pressure, close=pressure)
    label = bodies.words_for(quantity)
    when = result.label(result.field_rows[look.index])
    text = f"The bodies at {when}, coloured by {label}; {bodies.words()}."
    return Picture(name, text, draw_bodies(bodies, quantity), True)


def animate(result: Result, path, writer, look: Look | None = None) -> None:
    """Save the animation of the bodies, with the pair that has the largest surface beside them."""
    pairs = [pair for pair in result.pairs.values() if len(pair.nodes) and not result.is_plane]
    largest = max(pairs, key=lambda pair: pair.area.sum(), default=None)
    draw_animation(result, Bodies(result, look), largest, path, writer)


def figure(result, what, pair, look):
    """Return the figure that Result.plot describes."""
    made = make_figure(result, what, pair, look)
    # A notebook shows the figure that its cell ends with, and all that are open once more.
    if "inline" in matplotlib.get_backend():
        plt.close(made)
    return made


def make_figure(result, what, pair, look):
    """Return the figure that is asked for."""
    drawn = has_bodies(result)
    if what is None:
        what = "displacement" if drawn or not result.pairs else "forces"
    if what not in (*QUANTITIES, *OF_PAIRS, "errors", "accuracy"):
        raise ValueError(
            "displacement, stress, pressure, mesh_error, contact, forces, errors or accuracy, "
            f"not {what!r}"
        )
    if result.finished == 0:
        raise ResultError(f"{result.path}: no increment is finished")
    if what == "errors":
        return draw_errors(result)
    if what == "accuracy":
        if result.accuracy is None:
            raise ResultError(f"{result.path}: no accuracy was asked for")
        return draw_sequence(result)
    if what in QUANTITIES:
        if not drawn:
            raise ResultError(f"{result.path}: no displacements are stored")
        if not has_quantity(result, what):
            missing = f"field '{what}'; ask for it in the deck"
            if what == "pressure":
                missing = "contact pair"
            raise ResultError(f"{result.path}: no {missing}")
        if look.component is not None and look.component not in COMPONENTS.get(what, ()):
            raise ValueError(f"{what} has no component {look.component!r}")
        result.field("displacement", look.index)  # that there is such an increment
        pressure = what == "pressure"
        if pressure and result.is_plane:
            return draw_pressures(result, look.index)
        return draw_bodies(Bodies(result, look, apart=pressure, close=pressure), what)
    if not result.pairs:
        raise ResultError(f"{result.path}: no contact pair")
    return OF_PAIRS[what](result, result.pairs[pair])
