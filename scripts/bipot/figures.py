"""The look of all figures."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

INK, BLUE, ORANGE, GREEN, GRID = "#303030", "#2f6db0", "#e8813a", "#2a9d6f", "#c9c9c9"
PURPLE, RED = "#7b5ea7", "#c2443c"


def new_axes(columns=1, rows=1, **options):
    """Return a figure and its axes in the style of all figures, row after row."""
    plt.rcParams.update({"font.size": 9, "axes.edgecolor": INK, "legend.frameon": False})
    size = (6.4, 3.9 if rows == 1 else 2.3 * rows)
    figure, axes = plt.subplots(rows, columns, figsize=size, squeeze=False, **options)
    axes = axes.ravel()
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.grid(color=GRID, linewidth=0.4)
        one.set_axisbelow(True)
    return figure, axes if axes.size > 1 else axes[0]


def save(figure, path):
    """Write a figure and name it."""
    figure.savefig(path, dpi=120, bbox_inches="tight", facecolor="white")
    plt.close(figure)
    print(path)
