"""The look of all pictures of a result."""

import functools

import matplotlib.pyplot as plt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap

from bipot.quantities import OPEN, SLIDE, STICK

COLOURS = {OPEN: "#ffffff", STICK: "#2f6db0", SLIDE: "#e8813a"}
INK, GRID = "#303030", "#c9c9c9"
PLAIN = "#dcdcd8"  # a body where it has no colour of its own
GROUND = "#b3bac2"  # of obstacles
COLUMNS = 1200  # pixels of a picture

# Light where nothing happens, so that lines of the mesh and shades are seen there; ever darker.
# BOTH is of components: cold below 0, warm above.
WARM, COLD, RED, BOTH = (
    LinearSegmentedColormap.from_list(name, colours)
    for name, colours in {
        "warm": ("#f3f2ee", "#fbdc98", "#f28e54", "#c53d5e", "#701f70", "#28103f"),
        "cold": ("#f3f3f0", "#c4e3d0", "#6bbcb4", "#2f84ab", "#26488c", "#1b1b4d"),
        "red": ("#f5f3ea", "#fbe08d", "#f6a04c", "#e2502f", "#a61b2b", "#5c0a24"),
        "both": ("#26488c", "#5aa6b8", "#f3f2ee", "#f28e54", "#a3234f"),
    }.items()
)

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
    bar = figure.colorbar(ScalarMappable(norm, colour_map), ax=axes, shrink=0.7, pad=0.03)
    bar.set_label(label)
    bar.outline.set_visible(False)


def save(figure, target, tight=True, form=None, dpi=None):
    """Write a picture to a path or a file, and forget the figure.

    Without `dpi` it is COLUMNS pixels wide.
    """
    with plt.rc_context(STYLE):
        width, box = figure.get_figwidth(), None
        if tight:
            # Laid out once: "tight" would do it all again.
            figure.draw_without_rendering()
            figure.set_layout_engine("none")
            box = figure.get_tightbbox().padded(plt.rcParams["savefig.pad_inches"])
            width = box.width
        figure.savefig(
            target, bbox_inches=box, facecolor="white", format=form, dpi=dpi or COLUMNS / width
        )
    plt.close(figure)
