"""Maps of a contact surface: flat, unrolled, or seen on the body."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from bipot.drawing import views
from bipot.drawing.curves import draw_states
from bipot.drawing.style import COLOURS, GRID, INK, styled
from bipot.element_faces import face_normals
from bipot.quantities import OPEN, STATUS_NAMES

MAX_ARROWS = 9  # along an edge of the map
FLAT = np.cos(np.radians(40))  # normals no further than this from their mean: seen along that
NARROW = 0.15  # width of a strip, of its length, up to which it is drawn wider
NOTHING = 1e-9  # friction that is none, of the largest reaction
ROUND = 0.02  # share of the normals along the axis up to which a surface is unrolled


class Map:
    """The slave surface of a pair in two dimensions.

    `kind` is "flat", seen along its mean normal; "unrolled", where the normals are all across one
    axis; else "on the body", seen from where most of it is seen, without what is turned away.
    """

    def __init__(self, pair):
        self.pair = pair
        self.faces = pair.faces
        self.shown = np.ones(len(pair.nodes), dtype=bool)
        self.names = ["", ""]
        corners = pair.result.points[self.faces]
        normals = face_normals(corners) if len(corners) else pair.frame[0, :, 0]
        mean = normals.mean(axis=0)
        mean /= max(np.linalg.norm(mean), 1e-300)
        axis, across = self.axis(normals)
        if (normals @ mean > FLAT).all() or len(corners) == 0:
            self.kind = "flat"
            self.project(mean if np.linalg.norm(mean) > 0.5 else np.array([0.0, 0.0, 1.0]))
        elif across < ROUND:
            self.kind = "unrolled"
            self.unroll(axis, corners.mean(axis=1), normals)
        else:
            self.kind = "on the body"
            self.look_at_the_body(normals)
        self.friction = np.einsum("tpx,pkx->tpk", pair.friction, self.basis)
        self.largest = float(np.linalg.norm(pair.friction, axis=2).max())
        if self.largest < NOTHING * np.abs(pair.reaction).max(initial=0.0):
            self.largest = 0.0
        low, high = self.window()
        self.inside = ((self.places >= low) & (self.places <= high)).all(axis=1) & self.shown
        self.middle = (low + high) / 2
        extent = np.maximum(high - low, 1e-300)
        self.half = np.full(2, 0.62 * extent.max())
        # Of a narrow strip the width is drawn larger.
        self.is_stretched = bool(extent.min() < NARROW * extent.max())
        if self.is_stretched:
            self.half[np.argmin(extent)] = max(1.5 * extent.min(), 1e-6 * extent.max())
            short = int(np.argmin(extent))
            self.names[short] = f"{self.names[short]} (not to scale)".strip()
        # So many arrows that each has room: at one point of each cell of a coarse grid.
        along = min(np.sqrt(len(self.places)), MAX_ARROWS) - 1
        self.cell = (self.half / 0.62 if not self.is_stretched else extent) / max(along, 1.0)
        cells = np.floor((self.places - low) / self.cell + 1e-6)
        chosen = np.unique(cells[self.inside], axis=0, return_index=True)[1]
        self.with_arrow = np.flatnonzero(self.inside)[chosen]

    def window(self):
        """Return two corners: around all points that ever touch, or else of the whole surface."""
        low, high = self.places.min(axis=0), self.places.max(axis=0)
        touched = self.places[(self.pair.status != OPEN).any(axis=0) & self.shown]
        if len(touched) == 0:
            return low, high
        first, last = touched.min(axis=0), touched.max(axis=0)
        margin = max((last - first).max() / 2, 2 * (high - low).max() / np.sqrt(len(self.places)))
        return np.maximum(low, first - margin), np.minimum(high, last + margin)

    @staticmethod
    def axis(normals):
        """Return the direction that normals have least of, and their share of it."""
        values, vectors = np.linalg.eigh(normals.T @ normals)
        axis = vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0])
        return axis, values[0] / values.sum()

    def project(self, eye):
        """Look along `eye`, or against it, at the surface: x to the right, y or z upwards."""
        axis = int(np.argmax(np.abs(eye)))
        right, against = ((1, 1.0), (0, -1.0), (0, 1.0))[axis]
        eye = eye * np.sign(eye[axis]) * against
        first = np.eye(3)[right] - eye[right] * eye
        first /= np.linalg.norm(first)
        self.set_plane(first, np.cross(eye, first))
        self.names = [self.axis_name(row, along) for row, along in enumerate(self.basis[0])]

    def set_plane(self, first, second):
        basis = np.stack([first, second])
        self.places = self.pair.coordinates @ basis.T
        self.outlines = self.pair.result.points[self.faces] @ basis.T
        self.basis = np.broadcast_to(basis, (len(self.places), 2, 3))

    def unroll(self, axis, middles, normals):
        """Unroll a surface about the axis that its normals meet."""
        first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        first /= np.linalg.norm(first)
        frame = np.stack([first, np.cross(axis, first)])
        # The centre is nearest to the lines through the faces along their normals.
        flat, lines = middles @ frame.T, normals @ frame.T
        lines /= np.linalg.norm(lines, axis=1, keepdims=True)
        away = np.eye(2) - lines[:, :, None] * lines[:, None, :]
        centre = np.linalg.lstsq(
            away.sum(axis=0), np.einsum("fij,fj->i", away, flat), rcond=None
        )[0]
        arms = self.pair.coordinates @ frame.T - centre
        angle = np.arctan2(arms[:, 1], arms[:, 0])
        # Cut it where it has its largest opening.
        order = np.sort(angle)
        gaps = np.diff(np.append(order, order[0] + 2 * np.pi))
        start = order[(int(np.argmax(gaps)) + 1) % len(order)]
        radius = float(np.linalg.norm(arms, axis=1).mean())

        def place(points):
            flat = points @ frame.T - centre
            turned = (np.arctan2(flat[..., 1], flat[..., 0]) - start + 1e-9) % (2 * np.pi) - 1e-9
            return np.stack([radius * turned, points @ axis], axis=-1)

        self.places = place(self.pair.coordinates)
        self.outlines = place(self.pair.result.points[self.faces])
        # A face across the cut lies at one end of it.
        turns = self.outlines[:, :, 0]
        full = 2 * np.pi * radius
        turns += full * np.round((turns[:, :1] - turns) / full)
        along = np.stack([-np.sin(angle), np.cos(angle)], axis=1) @ frame
        self.basis = np.stack([along, np.broadcast_to(axis, along.shape)], axis=1)
        self.names = ["arc length", self.axis_name(1, axis)]

    def look_at_the_body(self, normals):
        """Show what is seen of the surface from where most of it is seen."""
        surface = views.ContactFaces(self.pair, self.pair.result.points)
        direction, _ = views.choose_direction([surface])
        eye = views.towards_the_eye(*direction)
        first = np.cross([0.0, 0.0, 1.0], eye)
        first /= np.linalg.norm(first)
        total = np.zeros(self.pair.result.points.shape)
        np.add.at(total, self.faces, np.repeat(normals[:, None], 4, axis=1))
        self.shown = total[self.pair.nodes] @ eye > 0
        self.faces = self.faces[normals @ eye > 0]
        self.set_plane(first, np.cross(eye, first))
        self.names = [f"seen from elevation {direction[0]:g}\u00b0, azimuth {direction[1]:g}\u00b0",
                      ""]

    @staticmethod
    def axis_name(row, direction):
        """Return x, y or z where the map's axis is one of these, else t1 or t2."""
        along = int(np.argmax(np.abs(direction)))
        sign = "" if direction[along] > 0 else "-"
        return sign + "xyz"[along] if abs(direction[along]) > 1 - 1e-9 else f"t{row + 1}"

    def words(self):
        """Return how the surface is shown, where it is not just seen from before it."""
        hidden = int((~self.shown).sum())
        said = {"flat": "", "unrolled": ", unrolled", "on the body": ", on the body"}[self.kind]
        if not self.inside[self.shown].all():
            said += ", near the contact"
        return said + (f" ({hidden} points on its far side)" if hidden else "")

    def draw(self, axes, row):
        """Draw the states and friction forces of an increment."""
        box = axes.get_window_extent()
        width, height = box.width * 72 / axes.figure.dpi, box.height / axes.figure.dpi
        size = np.clip(0.36 * width / np.sqrt(self.inside.sum()), 2.0, 10.0) ** 2
        axes.add_collection(
            PolyCollection(self.outlines, facecolors="#f4f4f4", edgecolors=GRID, linewidths=0.5)
        )
        status = self.pair.status[row]
        for state, colour in COLOURS.items():
            chosen = (status == state) & self.shown
            axes.scatter(
                *self.places[chosen].T, s=size, c=colour, edgecolors=INK, linewidths=0.4, zorder=3,
                label=f"{STATUS_NAMES[state]} ({(status == state).sum()})",
            )
        if self.largest > 0:
            touching = self.with_arrow[status[self.with_arrow] != OPEN]
            arrows = axes.quiver(
                *self.places[touching].T, *self.friction[row, touching].T,
                angles="uv", scale_units="x", scale=self.largest / (0.85 * self.cell[0]),
                width=0.007, color=INK, zorder=4, clip_on=False,
            )
            # matplotlib takes them for hundreds of times as large, and a notebook cuts pictures by
            # the room that all they have takes.
            arrows.set_in_layout(False)
            unit = self.pair.result.units.of("force")
            axes.quiverkey(
                arrows, 0.05, -0.62 / height, self.largest,
                f"friction on the slave, {self.largest:.3g} {unit}",
                labelpos="E", coordinates="axes", fontproperties={"size": 7.5},
            )
        low, high = self.middle - self.half, self.middle + self.half
        axes.set_aspect("auto" if self.is_stretched else "equal")
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        length = self.pair.result.units.length
        for put, name in zip((axes.set_xlabel, axes.set_ylabel), self.names, strict=True):
            put(f"{name} [{length}]" if length and name and self.kind != "on the body" else name)
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
    """Return a figure with maps of the contact surface at a few increments.

    Of elements of a plane the surface is a line, and all increments have room.
    """
    if result.is_plane:
        return draw_states(result, pair)
    surface = Map(pair)
    rows = telling_rows(result)
    side = 3.1 if len(rows) > 1 else 4.4
    across = min(len(rows), 2)
    down = -(-len(rows) // across)
    width, height = side * across + 0.6, (side + 1.1) * down + 0.2
    figure, all_axes = plt.subplots(down, across, figsize=(width, height), squeeze=False)
    figure.subplots_adjust(
        left=0.75 / width, right=0.985, top=1 - 1.25 / height, bottom=0.85 / height, wspace=0.32,
        hspace=2.1 / side,
    )
    for axes in all_axes.flat[len(rows):]:
        axes.set_axis_off()
    for axes, row in zip(all_axes.flat, rows, strict=False):
        surface.draw(axes, row)
        axes.set_title(f"increment {row + 1}\n{result.label(row)}", pad=22, fontsize=8.5)
    figure.suptitle(
        f"{result.path.stem}, contact {pair.name}\nstatus of the contact points{surface.words()}",
        fontsize=10,
    )
    return figure
