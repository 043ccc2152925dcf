"""The look of all pictures of a result."""

import functools

import matplotlib.pyplot as plt
from matplotlib.cm import ScalarMappable

from bipot.result import OPEN, SLIDE, STICK

COLOURS = {OPEN: "#ffffff", STICK: "#2f6db0", SLIDE: "#e8813a"}
INK, GRID = "#303030", "#c9c9c9"
PLAIN = "#dcdcd8"  # a body where it has no colour of its own
OBSTACLE = "#7d8794"

STYLE = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "figure.dpi": 110,
}


def styled(draw):
    """Return a function that draws in the style of all pictures, others keep theirs."""

    @functools.wraps(draw)
    def in_style(*given, **options):
        with plt.rc_context(STYLE):
            return draw(*given, **options)

    return in_style


def colour_bar(figure, axes, norm, colour_map, label):
    """Draw a colour bar beside axes."""
    bar = figure.colorbar(ScalarMappable(norm, colour_map), ax=axes, shrink=0.7, pad=0.13)
    bar.set_label(label)
    bar.outline.set_visible(False)


def save(figure, target, tight=True, form=None):
    """Write a picture to a path or a file, and forget the figure."""
    figure.savefig(
        target, bbox_inches="tight" if tight else None, facecolor="white", format=form
    )
    plt.close(figure)
