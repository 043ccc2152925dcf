"""Curves along a path: displacement, stress and contact pressure over the distance."""

import matplotlib.pyplot as plt
import numpy as np

from bipot.drawing.histories import PALETTE, legend_beside
from bipot.drawing.style import GRID, styled

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
