"""Pictures of a result: the deformed body, the contact surface, the forces, an animation.

What scripts/show writes and Result.plot returns. Each function makes one matplotlib figure.
"""

import functools
import sys

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib import animation
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from bipot.brick_faces import face_normals
from bipot.result import OPEN, SLIDE, STATUS_NAMES, STICK, ResultError, von_mises

COLOURS = {OPEN: "#ffffff", STICK: "#2f6db0", SLIDE: "#e8813a"}
INK, GRID = "#303030", "#c9c9c9"
MAX_FRAMES = 60
MAX_ARROWS = 9  # along an edge of the contact map
# Small pieces make the colours of a coarse mesh smooth; more of them than this only cost time.
PIECES = 3000
ELEVATION, AZIMUTH = 24.0, -58.0

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


# --- The deformed body --------------------------------------------------------------------------


def toward_the_eye():
    """Return the unit vector from the body to the spectator."""
    elevation, azimuth = np.radians([ELEVATION, AZIMUTH])
    horizontal = np.cos(elevation)
    return np.array(
        [horizontal * np.cos(azimuth), horizontal * np.sin(azimuth), np.sin(elevation)]
    )


def subdivide(corners, pieces):
    """Cut faces (F, 4, k) into pieces x pieces bilinear parts: (F * pieces**2, 4, k)."""
    s = np.linspace(0, 1, pieces + 1)
    s, t = np.meshgrid(s, s, indexing="ij")
    shape = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)
    grid = np.einsum("ijc,fck->fijk", shape, corners)
    parts = [grid[:, :-1, :-1], grid[:, 1:, :-1], grid[:, 1:, 1:], grid[:, :-1, 1:]]
    return np.stack(parts, axis=3).reshape(-1, 4, corners.shape[2])


def sharp_edges(corners, faces):
    """Return the edges (M, 2) of boundary faces that meet there at an angle."""
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, where = np.unique(pairs, axis=0, return_inverse=True)
    normals = np.repeat(face_normals(corners), 4, axis=0)
    total = np.zeros((len(edges), 3))
    np.add.at(total, where.ravel(), normals)
    # Two unit normals at an angle a add up to 2 cos(a/2): sharp from 40 degrees on.
    return edges[np.linalg.norm(total, axis=1) < 2 * np.cos(np.radians(20))]


class Body:
    """The boundary of the mesh, drawn deformed in 3-D axes."""

    def __init__(self, result, scale):
        self.result = result
        self.faces, self.face_brick = result.boundary
        # Reference nodes of obstacles belong to no brick: their motion is none of the body's.
        self.nodes = np.unique(result.bricks)
        self.stress_on = "elements" if "stress" in result.field_names[1] else "nodes"
        self.scale = self.choose_scale() if scale is None else scale
        self.edges = sharp_edges(result.points[self.faces], self.faces)
        low, high = self.limits()
        self.low, self.high = low, high
        self.size = float(np.max(high - low))

    def displacement(self, index):
        return self.result.field("displacement", index)

    def mises(self, index):
        """Return von Mises's stress of the bricks, or of the nodes where only they have it."""
        return von_mises(self.result.field("stress", index, on=self.stress_on))

    def choose_scale(self):
        """Return 1 where the displacements can be seen as they are, else 1, 2 or 5 times 10^k."""
        size = np.ptp(self.result.points[self.nodes], axis=0).max()
        largest = max(
            np.abs(self.displacement(index)[self.nodes]).max() for index in self.sampled()
        )
        if largest == 0 or 0.04 * size <= largest <= 0.6 * size:
            return 1.0
        wanted = 0.15 * size / largest
        decade = 10.0 ** np.floor(np.log10(wanted))
        return float(decade * max(step for step in (1, 2, 5) if step * decade <= wanted))

    def sampled(self, most=20):
        """Return up to `most` stored increments, the last among them."""
        stored = len(self.result.field_rows)
        return np.unique(np.linspace(0, stored - 1, min(stored, most)).round().astype(int))

    def limits(self):
        """Return the corners of the box that holds the body in all increments."""
        points = self.result.points[self.nodes]
        low, high = points.min(axis=0), points.max(axis=0)
        for index in self.sampled():
            moved = points + self.scale * self.displacement(index)[self.nodes]
            low, high = np.minimum(low, moved.min(axis=0)), np.maximum(high, moved.max(axis=0))
        return low, high

    def draw(self, axes, index, quantity, norm, colour_map):
        """Draw the body at a stored increment, coloured by `quantity`."""
        corners = (self.result.points + self.scale * self.displacement(index))[self.faces]
        if quantity == "stress":
            values = self.mises(index)
            if self.stress_on == "elements":
                values = np.repeat(values[self.face_brick, None], 4, axis=1)
            else:
                values = values[self.faces]
        else:
            values = np.linalg.norm(self.displacement(index), axis=1)[self.faces]

        eye = toward_the_eye()
        seen = face_normals(corners) @ eye > 0
        corners, values = corners[seen], values[seen]
        pieces = int(np.clip(np.sqrt(PIECES / max(len(corners), 1)), 1, 8))
        parts = subdivide(np.concatenate([corners, values[:, :, None]], axis=2), pieces)
        colours = colour_map(norm(parts[:, :, 3].mean(axis=1)))
        # A lamp over the spectator's left shoulder gives the faces their depth.
        lamp = eye + np.array([-0.4, 0.3, 0.8])
        light = face_normals(parts[:, :, :3]) @ (lamp / np.linalg.norm(lamp))
        colours[:, :3] *= (0.8 + 0.2 * np.clip(light, 0, 1))[:, None]

        # The mesh's lines are flat polygons a little nearer to the eye, so that the drawing
        # order hides those behind the body; as short as the parts of the faces, for that order
        # goes by the middle of each polygon.
        s = np.linspace(0, 1, pieces + 1)[:, None, None, None]
        along = (1 - s) * corners + s * np.roll(corners, -1, axis=1)
        first, last = along[:-1].reshape(-1, 3), along[1:].reshape(-1, 3)
        lines = np.stack([first, first, last, last], axis=1) + 0.02 * self.size * eye
        line_colour = np.array([0.1, 0.1, 0.1, 0.6 if len(corners) < 2000 else 0.2])
        body = Poly3DCollection(
            [*parts[:, :, :3], *lines],
            facecolors=np.concatenate([colours, np.zeros((len(lines), 4))]),
            edgecolors=np.concatenate([colours, np.tile(line_colour, (len(lines), 1))]),
            linewidths=0.45,
            zsort="average",
        )
        before = Line3DCollection(
            self.result.points[self.edges], colors="#9a9a9a", linewidths=0.8, linestyles="--"
        )
        before.set_sort_zpos(-1e300)
        axes.add_collection3d(before)
        axes.add_collection3d(body)
        self.frame(axes)

    def frame(self, axes):
        """Set view, limits and labels of 3-D axes."""
        axes.set_proj_type("ortho")
        axes.view_init(ELEVATION, AZIMUTH)
        # A thin body still gets axes that can be labelled.
        margin = 0.03 * self.size
        low, high = self.low - margin, self.high + margin
        for name, first, last in zip("xyz", low, high, strict=True):
            getattr(axes, f"set_{name}lim")(first, last)
            getattr(axes, f"set_{name}label")(name)
            axis = getattr(axes, f"{name}axis")
            axis.set_pane_color((1, 1, 1, 0))
            axis.set_major_locator(MaxNLocator(4))
            axis._axinfo["grid"].update(color="#e4e4e4", linewidth=0.5)
        axes.set_box_aspect(high - low, zoom=1.05)
        axes.tick_params(labelsize=7, pad=0)

    def norm(self, quantity, indices):
        """Return the colour range of a quantity over stored increments."""
        if quantity == "stress":
            largest = max(self.mises(i).max() for i in indices)
        else:
            largest = max(
                np.linalg.norm(self.displacement(i)[self.nodes], axis=1).max() for i in indices
            )
        return Normalize(0, largest or 1.0)


QUANTITIES = {
    "displacement": ("displacement, magnitude (deck units)", plt.cm.viridis),
    "stress": ("von Mises's stress (deck units)", plt.cm.inferno),
}


def scale_words(scale):
    """Return how the displacements are drawn, in words."""
    return "displacements to scale" if scale == 1 else f"displacements times {scale:g}"


def colour_bar(figure, axes, norm, colour_map, label):
    bar = figure.colorbar(ScalarMappable(norm, colour_map), ax=axes, shrink=0.7, pad=0.1)
    bar.set_label(label)
    bar.outline.set_visible(False)


@styled
def draw_body(result, body, quantity, index=-1):
    """Return a figure of the body at a stored increment."""
    label, colour_map = QUANTITIES[quantity]
    last = range(len(result.field_rows))[index]
    norm = body.norm(quantity, [last])
    figure = plt.figure(figsize=(7.2, 5.4))
    axes = figure.add_subplot(projection="3d")
    body.draw(axes, last, quantity, norm, colour_map)
    colour_bar(figure, axes, norm, colour_map, label)
    axes.set_title(
        f"{result.path.stem}: {result.label(result.field_rows[last])}\n"
        f"{scale_words(body.scale)}; dashed: before loading",
    )
    return figure


# --- The contact surface ------------------------------------------------------------------------


class Map:
    """The contact surface of a pair, seen along its mean normal."""

    def __init__(self, pair):
        self.pair = pair
        normal = pair.frame[:, :, 0].mean(axis=(0, 1))
        if np.linalg.norm(normal) < 1e-6:  # a closed surface has no mean normal
            normal = np.array([0.0, 0.0, 1.0])
        normal /= np.linalg.norm(normal)
        first = pair.frame[0, 0, 1] - normal * (normal @ pair.frame[0, 0, 1])
        first /= np.linalg.norm(first)
        self.basis = np.stack([first, np.cross(normal, first)])
        self.places = pair.coordinates @ self.basis.T
        self.outlines = pair.result.points[pair.faces] @ self.basis.T
        self.friction = pair.friction @ self.basis.T
        self.largest = float(np.linalg.norm(self.friction, axis=2).max())
        low, high = self.places.min(axis=0), self.places.max(axis=0)
        self.middle = (low + high) / 2
        self.half = 0.5 * max(float((high - low).max()), 1e-300) * 1.24
        # So many arrows that each has room: at one point of each cell of a coarse grid.
        self.cell = 2 * self.half / min(np.sqrt(len(self.places)), MAX_ARROWS)
        cells = np.floor((self.places - low) / self.cell + 1e-9)
        self.with_arrow = np.unique(cells, axis=0, return_index=True)[1]

    def axis_name(self, row):
        """Return x, y or z where the map's axis is one of these, else t1 or t2."""
        along = np.argmax(np.abs(self.basis[row]))
        return "xyz"[along] if self.basis[row, along] > 1 - 1e-9 else f"t{row + 1}"

    def draw(self, axes, row):
        """Draw the states and friction forces of an increment."""
        spacing = 2 * self.half / np.sqrt(len(self.places))
        width = axes.get_window_extent().width * 72 / axes.figure.dpi
        size = np.clip(0.36 * width * spacing / (2 * self.half), 2.0, 10.0) ** 2
        axes.add_collection(
            PolyCollection(self.outlines, facecolors="#f4f4f4", edgecolors=GRID, linewidths=0.5)
        )
        status = self.pair.status[row]
        for state, colour in COLOURS.items():
            chosen = status == state
            axes.scatter(
                *self.places[chosen].T, s=size, c=colour, edgecolors=INK, linewidths=0.4, zorder=3,
                label=f"{STATUS_NAMES[state]} ({chosen.sum()})",
            )
        if self.largest > 0:
            touching = self.with_arrow[status[self.with_arrow] != OPEN]
            arrows = axes.quiver(
                *self.places[touching].T, *self.friction[row, touching].T,
                angles="xy", scale_units="xy", scale=self.largest / (0.85 * self.cell),
                width=0.007, color=INK, zorder=4, clip_on=False,
            )
            # matplotlib takes them for hundreds of times as large, and a notebook cuts pictures by
            # the room that all they have takes.
            arrows.set_in_layout(False)
            axes.quiverkey(
                arrows, 0.05, -0.26, self.largest,
                f"friction on the body, {self.largest:.3g} (deck units)",
                labelpos="E", coordinates="axes", fontproperties={"size": 7.5},
            )
        axes.set_aspect("equal")
        axes.set_xlim(self.middle[0] - self.half, self.middle[0] + self.half)
        axes.set_ylim(self.middle[1] - self.half, self.middle[1] + self.half)
        axes.set_xlabel(self.axis_name(0))
        axes.set_ylabel(self.axis_name(1))
        axes.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3, fontsize=7.5, handletextpad=0.1,
            columnspacing=1.0, scatterpoints=1, markerscale=min(1.0, 7 / np.sqrt(size)),
        )


def telling_rows(result, count=4):
    """Return up to `count` increments that tell the run's story: the ends of its steps first."""
    chosen = list(result.step_ends[-count:])
    between = np.linspace(0, result.finished - 1, 2 * count + 1).round().astype(int)[1:-1:2]
    # Largest distance from what is chosen first, so that the gaps are filled evenly.
    while len(chosen) < min(count, result.finished):
        away = [min(abs(row - other) for other in chosen) for row in between]
        if max(away) == 0:
            break
        chosen.append(between[int(np.argmax(away))])
    return sorted(int(row) for row in chosen)


@styled
def draw_contact(result, pair):
    """Return a figure with maps of the contact surface at a few increments."""
    surface = Map(pair)
    rows = telling_rows(result)
    figure, all_axes = plt.subplots(
        1, len(rows), figsize=(3.1 * len(rows) + 0.4, 4.1), squeeze=False
    )
    figure.subplots_adjust(
        left=0.55 / (3.1 * len(rows)), right=0.985, top=0.74, bottom=0.2, wspace=0.32
    )
    for axes, row in zip(all_axes[0], rows, strict=True):
        surface.draw(axes, row)
        axes.set_title(f"increment {row + 1}\n{result.label(row)}", pad=22, fontsize=8.5)
    figure.suptitle(
        f"{result.path.stem}, contact {pair.name}: state of the points",
        fontsize=10,
    )
    return figure


# --- Forces -------------------------------------------------------------------------------------


def ratio(across, along):
    """Return friction over pressure; not a number where nothing presses."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(along > 0, across / along, np.nan)


@styled
def draw_forces(result, pair):
    """Return a figure of the forces of a contact pair over the increments, and their ratio."""
    increments = np.arange(1, result.finished + 1)
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(7.2, 5.6), sharex=True, gridspec_kw={"height_ratios": [3, 2]}
    )
    top.plot(increments, pair.normal_sum, color=INK, label="sum of the normal forces")
    top.plot(
        increments, pair.friction_sum, color=COLOURS[SLIDE],
        label="sum of the magnitudes of the friction forces",
    )
    for axis, colour in enumerate(("#7a4fa3", "#2a9d6f", COLOURS[STICK])):
        top.plot(
            increments, pair.resultant[:, axis], "--", color=colour, linewidth=1.1,
            label=f"resultant on the body, {'xyz'[axis]}",
        )
    top.set_ylabel("force (deck units)")
    top.legend(fontsize=8, loc="best")
    top.set_title(f"{result.path.stem}, contact {pair.name}")

    bottom.plot(
        increments, ratio(pair.friction_sum, pair.normal_sum), color=COLOURS[SLIDE],
        label="friction / normal, sums of magnitudes",
    )
    normals = pair.frame[:, :, 0]
    if np.ptp(normals, axis=(0, 1)).max() < 1e-12:
        normal = normals[0, 0]
        along = pair.resultant @ normal
        across = np.linalg.norm(pair.resultant - along[:, None] * normal, axis=1)
        bottom.plot(
            increments, ratio(across, along), "--", color=COLOURS[STICK],
            label="the same, resultants",
        )
    if pair.friction_coefficient > 0:
        bottom.axhline(
            pair.friction_coefficient, color=INK, linewidth=0.8, linestyle=":",
            label="coefficient of friction",
        )
    certified = result.history("certified")
    for value, mark, label in ((0, "rx", "not certified"), (-1, "k|", "certificate pending")):
        chosen = increments[certified == value]
        if len(chosen):
            bottom.plot(chosen, np.zeros(len(chosen)), mark, label=label, clip_on=False)
    bottom.set_ylim(bottom=0)
    bottom.set_ylabel("ratio of the forces")
    bottom.set_xlabel("increment of the run")
    bottom.xaxis.set_major_locator(MaxNLocator(integer=True))
    bottom.legend(fontsize=8, loc="lower right")
    for axes in (top, bottom):
        axes.set_xlim(0.5, result.finished + 0.5)
        axes.grid(color=GRID, linewidth=0.4)
        for row in result.step_ends[:-1]:
            axes.axvline(row + 1.5, color=GRID, linewidth=1.2, linestyle="--")
    return figure


# --- Animation ----------------------------------------------------------------------------------


class Progress:
    """A bar on the terminal; silent where standard error is none."""

    def __init__(self, what):
        self.what = what

    def __call__(self, done, total):
        if sys.stderr.isatty():
            full = 30 * (done + 1) // total
            end = "\n" if done + 1 == total else ""
            sys.stderr.write(f"\r{self.what} [{'#' * full:<30}] {done + 1}/{total}{end}")
            sys.stderr.flush()


@styled
def draw_animation(result, body, pair, path, writer):
    """Save the body, and the contact surface beside it, over the increments."""
    frames = body.sampled(MAX_FRAMES)
    label, colour_map = QUANTITIES["displacement"]
    norm = body.norm("displacement", frames)
    figure = plt.figure(figsize=(9.6 if pair else 6.2, 4.6), dpi=80)
    places = figure.add_gridspec(
        1, 2 if pair else 1, left=0.02, right=0.97, top=0.82, bottom=0.18,
        width_ratios=[1.6, 1] if pair else [1],
    )
    body_axes = figure.add_subplot(places[0], projection="3d")
    colour_bar(figure, body_axes, norm, colour_map, label)
    surface = Map(pair) if pair else None
    map_axes = figure.add_subplot(places[1]) if pair else None

    def draw(frame):
        row = result.field_rows[frame]
        body_axes.clear()
        body.draw(body_axes, frame, "displacement", norm, colour_map)
        if surface:
            map_axes.clear()
            surface.draw(map_axes, row)
        figure.suptitle(
            f"{result.path.stem}: {result.label(row)}  ({scale_words(body.scale)})", fontsize=10
        )

    film = animation.FuncAnimation(figure, draw, frames=frames, init_func=lambda: None)
    # The whole run takes about six seconds, whatever its number of increments.
    speed = int(np.clip(len(frames) / 6, 2, 12))
    film.save(
        path, writer=writer(fps=speed), progress_callback=Progress("animation"),
        savefig_kwargs={"facecolor": "white"},
    )
    plt.close(figure)


# --- One figure ---------------------------------------------------------------------------------


def figure(result, what=None, index=-1, pair=0, scale=None):
    """Return the figure that Result.plot describes."""
    made = make_figure(result, what, index, pair, scale)
    # A notebook shows the figure that its cell ends with, and all that are open once more.
    if "inline" in matplotlib.get_backend():
        plt.close(made)
    return made


def make_figure(result, what, index, pair, scale):
    """Return the figure that is asked for."""
    drawn = "displacement" in result.field_names[0] and len(result.field_rows) > 0
    if what is None:
        what = "displacement" if drawn or not result.pairs else "forces"
    if what not in (*QUANTITIES, "contact", "forces"):
        raise ValueError(f"displacement, stress, contact or forces, not {what!r}")
    if result.finished == 0:
        raise ResultError(f"{result.path}: no increment is finished")
    if what in QUANTITIES:
        if not drawn:
            raise ResultError(f"{result.path}: no displacements are stored")
        if not any(what in names for names in result.field_names):
            raise ResultError(f"{result.path}: no field '{what}'; ask for it in the deck")
        result.field("displacement", index)  # that there is such an increment
        return draw_body(result, Body(result, scale), what, index)
    if not result.pairs:
        raise ResultError(f"{result.path}: no contact pair")
    draw = draw_contact if what == "contact" else draw_forces
    return draw(result, result.pairs[pair])
