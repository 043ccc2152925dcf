"""Curves along a path, and along the contact surfaces of elements of a plane."""

import matplotlib.pyplot as plt
import numpy as np

from bipot.drawing.histories import PALETTE, legend_beside
from bipot.drawing.style import COLOURS, GRID, INK, styled
from bipot.quantities import STATUS_NAMES

PANELS = (
    ("displacement", "length", lambda name: name.startswith("displacement_")),
    ("stress", "pressure", lambda name: name.startswith("stress_") or name == "von_mises"),
    ("contact pressure", "pressure", lambda name: name == "contact_pressure"),
)


@styled
def draw_along(path, index):
    """Return a figure of what a Path has at a stored increment."""
    result, table = path.result, path.table(index)
    panels = []
    for words, quantity, belongs in PANELS:
        names = [name for name in table if belongs(name)]
        # A path through the inside of bodies has no contact.
        if names and (words != "contact pressure" or np.nan_to_num(table[names[0]]).any()):
            panels.append((words, quantity, names))
    figure, axes = plt.subplots(
        len(panels), 1, figsize=(8.6, 0.6 + 2.4 * len(panels)), sharex=True, squeeze=False
    )
    for one, (words, quantity, names) in zip(axes[:, 0], panels, strict=True):
        one.grid(color=GRID, linewidth=0.4)
        one.set_axisbelow(True)
        for colour, name in zip(PALETTE, names, strict=False):
            label = "von Mises" if name == "von_mises" else name.rpartition("_")[2]
            one.plot(table["distance"], table[name], color=colour, label=label, linewidth=1.3)
        one.set_ylabel(result.units.label(words, quantity))
        if len(names) > 1:
            legend_beside(one)
    ends = " to ".join("(" + ", ".join(f"{x:g}" for x in point) + ")" for point in
                       (path.points[0], path.points[-1]))
    row = result.field_rows[range(len(result.field_rows))[index]]
    axes[0, 0].set_title(f"{result.path.stem}: {result.label(row)}\nfrom {ends}")
    axes[-1, 0].set_xlabel(result.units.label("distance along the path", "length"))
    return figure


ROUNDING = 1e-9  # of a coordinate that is 0, of the size of the surface
MOST_ROWS = 60  # increments whose states are drawn


def over_length(result, pair, axes):
    """Prepare axes over the lines of a surface; return points and places (n,) of each line.

    Several lines follow each other with room between them.
    """
    found, start = [], 0.0
    for points, distance in pair.lines:
        found.append((points, start + distance))
        start += 1.05 * distance[-1]
    axes.grid(color=GRID, linewidth=0.4)
    axes.set_axisbelow(True)
    size = np.ptp(pair.coordinates, axis=0).max()
    begins = ", ".join(
        "({:.4g}, {:.4g})".format(*np.where(np.abs(x) < ROUNDING * size, 0, x)) for x in
        (pair.coordinates[points[0], :2] for points, _ in found)
    )
    axes.set_xlabel(result.units.label(f"length along the surface from {begins}", "length"))
    return found


@styled
def draw_pressures(result, index):
    """Return a figure of contact pressures over the lengths of the surfaces of a plane."""
    row = result.field_rows[range(len(result.field_rows))[index]]
    pairs = [pair for pair in result.pairs.values() if len(pair.nodes)]
    figure, axes = plt.subplots(
        len(pairs), 1, figsize=(8.6, 0.8 + 2.8 * len(pairs)), squeeze=False, layout="constrained"
    )
    for one, pair in zip(axes[:, 0], pairs, strict=True):
        for points, places in over_length(result, pair, one):
            one.plot(places, pair.pressure[row, points], ".-", color=INK, linewidth=1.1)
        one.set_ylabel(result.units.label("contact pressure", "pressure"))
        one.set_title(pair.name)
    figure.suptitle(f"{result.path.stem}: {result.label(row)}", fontsize=10)
    return figure


@styled
def draw_states(result, pair):
    """Return a figure of the states of the points of a plane over length and time."""
    figure, axes = plt.subplots(figsize=(8.6, 4.6), layout="constrained")
    rows = np.arange(result.finished)
    if len(rows) > MOST_ROWS:
        rows = np.unique(np.linspace(0, len(rows) - 1, MOST_ROWS).round().astype(int))
    lines, times = over_length(result, pair, axes), result.history("time")[rows]
    seen = np.unique(np.concatenate([points for points, _ in lines]))
    last = pair.status[-1, seen]
    for state, colour in COLOURS.items():
        label = f"{STATUS_NAMES[state]} ({(last == state).sum()} at the end)"
        for points, places in lines:
            when, which = np.nonzero(pair.status[np.ix_(rows, points)] == state)
            axes.scatter(places[which], times[when], s=18, c=colour, edgecolors=INK,
                         linewidths=0.4, label=label, zorder=3)
            label = None
    axes.set_ylabel("time")
    axes.set_title(f"{result.path.stem}, contact {pair.name}", pad=22)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3, fontsize=8)
    return figure
