"""The deformed bodies and the obstacles that they touch."""

from __future__ import annotations

from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import Normalize

from bipot.drawing import views
from bipot.drawing.rendering import render, show_image
from bipot.drawing.skin import crossings, cut_pieces, cut_skin, whole_skin
from bipot.drawing.style import BOTH, COLD, RED, WARM, colour_bar, styled
from bipot.drawing.turned import AXES, STEP, turn_section, upright, without_the_gap
from bipot.element_faces import face_normals
from bipot.errors import ResultError
from bipot.quantities import von_mises

ERROR = 0.02  # by which contact may be drawn wrong, of the size of the bodies
SMALL = 0.3  # extent of what is pressed, of that size, up to which it gets a close-up
MARGIN = 1.0  # about it, of its extent

QUANTITIES = {
    "displacement": ("displacement, magnitude", COLD, "length"),
    "stress": ("von Mises stress", WARM, "pressure"),
    "pressure": ("contact pressure", RED, "pressure"),
    "mesh_error": ("energy of the error by the mesh", WARM, "energy"),
}
COMPONENTS = {"displacement": ("x", "y", "z"), "stress": ("xx", "yy", "zz", "xy", "yz", "xz")}


class Look(NamedTuple):
    """What is drawn of the bodies, and how; what is left out is chosen."""

    scale: float | None = None  #: factor of the drawn displacements
    index: int = -1  #: the stored increment
    view: tuple[float, float] | None = None  #: elevation and azimuth of the spectator, in degrees
    limits: tuple[float, float] | None = None  #: of the colours
    component: str | None = None  #: one of COMPONENTS in place of magnitude and von Mises stress
    clip: tuple[int, float | None] | None = None
    #: axis (0, 1, 2) and place of a plane, None: the middle; what lies before it is cut away
    dpi: int | None = None  #: dots per inch of what is drawn as pixels
    turn: float | None = None  #: degrees by which the section of bodies of revolution is turned


class Scene(NamedTuple):
    """What is drawn of the bodies at an increment, whatever draws it."""

    polygons: np.ndarray  #: (P, 4, 3) of the bodies
    values: np.ndarray  #: (P, 4) at their corners, not a number where there is none
    lines: np.ndarray  #: (S, 2, 3) of the mesh
    outline: np.ndarray  #: (M, 2, 3) sharp edges
    start: np.ndarray  #: (M, 2, 3) those before loading, none where they are not drawn
    obstacles: list[np.ndarray]  #: (F, 4, 3) pieces of each
    edges: np.ndarray  #: (S, 2, 3) of obstacles that are seen as lines


def sharp_edges(corners, faces):
    """Return the edges (M, 2) of boundary faces that meet there at an angle."""
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges, where = np.unique(pairs, axis=0, return_inverse=True)
    normals = np.repeat(face_normals(corners), 4, axis=0)
    total = np.zeros((len(edges), 3))
    np.add.at(total, where.ravel(), normals)
    # Two unit normals at an angle a add up to 2 cos(a/2): sharp from 40 degrees on. The side of a
    # triangle that has no length is none.
    total[edges[:, 0] == edges[:, 1]] = np.inf
    return edges[np.linalg.norm(total, axis=1) < 2 * np.cos(np.radians(20))]


def round_down(factor):
    """Return the largest of 1, 2 and 5 times 10^k that is no more."""
    decade = 10.0 ** np.floor(np.log10(factor))
    return float(decade * max(step for step in (1, 2, 5) if step * decade <= factor * (1 + 1e-9)))


class Bodies:
    """The boundary of the mesh and the obstacles, drawn deformed.

    With `apart` bodies that touch each other are pulled apart, so that their contact is seen. With
    `close` they are cut out about the contact, where that is small.
    """

    def __init__(self, result, look=None, apart=False, close=False):
        look = look or Look()
        self.result, self.look = result, look
        self.faces, self.face_element = result.boundary
        self.stress_on = "elements" if "stress" in result.field_names[1] else "nodes"
        self.scale = self.choose_scale() if look.scale is None else look.scale
        self.edges = sharp_edges(result.points[self.faces], self.faces)
        self.plane = None  # axis, place and sign of what is cut away
        self.check_turn()
        self.offset = np.zeros(result.points.shape)
        blocks = [nodes for _, nodes in result.cells.values()]
        self.body = views.components(blocks, len(result.points))
        self.box = self.box_about_the_contact() if close else None
        self.direction = self.choose_direction(apart)
        self.eye = views.towards_the_eye(*self.direction)
        self.skin = self.make_skin()
        self.apart = bool(self.offset.any())
        self.low, self.high = self.limits()
        self.size = float(np.max(self.high - self.low))
        self.view = self.view_limits()

    # --- What is drawn ------------------------------------------------------------------------

    @property
    def shows_start(self):
        """Whether the sharp edges before loading are drawn, too."""
        return not (self.apart or self.box or self.plane or self.look.turn)

    @property
    def axes(self):
        """Return the deck's names of the axes of the picture, '' where one has none."""
        return AXES if self.look.turn else tuple("xyz")

    def check_turn(self):
        """Raise ResultError where a section is to be turned and cannot be."""
        if self.look.turn is None:
            return
        if self.result.run.get("bodies") != "wedge":
            raise ResultError("only sections of bodies of revolution (CAX) can be turned")
        if self.look.clip is not None:
            raise ResultError("a section that is turned is not cut as well")
        turn = self.look.turn
        if not 0 < turn <= 360:
            raise ResultError(f"a section is turned by up to 360 degrees, not by {turn:g}")

    def angles(self):
        """Return the angles [rad] of what is turned; what is left open faces the spectator."""
        first = self.direction[1] + 180 - self.look.turn / 2
        count = max(2, round(self.look.turn / STEP) + 1)
        return np.radians(np.linspace(first, first + self.look.turn, count))

    def make_skin(self):
        """Return the boundary of the mesh, or what the plane leaves of it."""
        if self.look.clip is None:
            return whole_skin(self.result, self.edges)
        axis, place = self.look.clip
        low, high = (edge(self.result.points[:, axis]) for edge in (np.min, np.max))
        place = (low + high) / 2 if place is None else place
        if not low < place < high:
            raise ResultError(
                f"no clip at {'xyz'[axis]}={place:g}: the bodies are between {low:g} and {high:g}"
            )
        # What lies between the spectator and the plane is cut away.
        self.plane = (axis, place, 1 if self.eye[axis] >= 0 else -1)
        return cut_skin(self.result, self.edges, *self.plane)

    def displacement(self, index):
        return self.result.field("displacement", index)

    def places(self, index):
        """Return where the nodes are drawn, (N, 3)."""
        return self.result.points + self.scale * self.displacement(index) + self.offset

    def component(self, quantity):
        """Return the number of the component that is drawn, None where it is none."""
        names = COMPONENTS.get(quantity, ())
        return names.index(self.look.component) if self.look.component in names else None

    def words_for(self, quantity):
        """Return what the colours are."""
        words, k = QUANTITIES[quantity][0], self.component(quantity)
        if k is not None:
            words = f"{quantity}, {COMPONENTS[quantity][k]}"
        return words

    def label(self, quantity):
        """Return what the colours are, with its unit."""
        return self.result.units.label(self.words_for(quantity), QUANTITIES[quantity][2])

    def colour_map(self, quantity):
        """Return the colours of a quantity."""
        return QUANTITIES[quantity][1] if self.component(quantity) is None else BOTH

    def lengths(self, index):
        """Return the displacements' magnitude, or the component that is drawn, (N,)."""
        u, k = self.displacement(index), self.component("displacement")
        return np.linalg.norm(u, axis=1) if k is None else u[:, k]

    def mises(self, index):
        """Return von Mises's stress, or the component that is drawn.

        Of the elements, or of the nodes where only they have it.
        """
        stress, k = self.result.field("stress", index, on=self.stress_on), self.component("stress")
        return von_mises(stress) if k is None else stress[:, k]

    def mesh_error(self, index):
        """Return the error by the mesh of the elements, an energy."""
        return self.result.field("mesh_error", index, on="elements")

    def pressure(self, index, partly_covered=True):
        """Return the contact pressure of the nodes, not a number where none is a slave node.

        `partly_covered`: with that of points that their master covers by less than half.
        """
        found, row = np.full(len(self.result.points), np.nan), self.result.field_rows[index]
        for pair in self.result.pairs.values():
            found[pair.nodes] = np.nan_to_num(found[pair.nodes])
            counts = partly_covered | ~pair.partly_covered[row]
            np.add.at(found, pair.nodes, np.where(counts, pair.pressure[row], 0))
        return found

    def obstacle_surfaces(self, index):
        """Return the pieces (F, 4, 3) of each obstacle near the bodies, where it is drawn."""
        return [pieces for _, pieces in self.named_obstacles(index)]

    def named_obstacles(self, index):
        """Return name and pieces (F, 4, 3) of each obstacle, once each."""
        found, points = {}, self.places(index)
        still = points - self.offset
        low, high = still.min(axis=0), still.max(axis=0)
        if self.look.turn:
            radius = np.hypot(still[:, 0], still[:, 2]).max()
            low[[0, 2]], high[[0, 2]] = -radius, radius
        if self.box:
            low, high = np.maximum(low, self.box[0]), np.minimum(high, self.box[1])
        for pair in self.result.pairs.values():
            obstacle = pair.obstacle_at(index, self.scale)
            if obstacle is None or len(pair.nodes) == 0:
                continue
            offset = self.offset[pair.nodes[0]]
            key = (pair.name.rpartition(":")[2], *offset)
            if key not in found:
                touched = self.near(pair, index)
                towards = (points - self.offset)[touched].mean(axis=0)
                pieces = obstacle.surface(low, high, towards)
                if self.plane:
                    pieces = cut_pieces(pieces, *self.plane)
                if self.look.turn:
                    pieces = without_the_gap(upright(pieces), self.angles())
                found[key] = pieces + offset
        return [(key[0], pieces) for key, pieces in found.items()]

    def near(self, pair, index):
        """Return the slave nodes that press, or else the one with the least gap."""
        row = self.result.field_rows[index]
        pressed = pair.nodes[pair.reaction[row, :, 0] > 0]
        return pressed if len(pressed) else pair.nodes[[int(np.argmin(pair.gap[row]))]]

    # --- How it is drawn ----------------------------------------------------------------------

    def choose_scale(self):
        """Return 1 where the displacements can be seen as they are, else 1, 2 or 5 times 10^k.

        Before what is round, turns, or came from afar, only true displacements touch; gaps that
        *CONTACT GAP and its like add are not drawn, and so must stay small.
        """
        size = np.ptp(self.result.points, axis=0).max()
        largest = max(np.abs(self.displacement(index)).max() for index in self.sampled())
        if largest == 0 or 0.04 * size <= largest <= 0.6 * size:
            return 1.0
        wanted = 0.15 * size / largest
        for pair in self.result.pairs.values():
            touched = (pair.reaction[:, :, 0] > 0).any(axis=0)
            # How far pressed points are drawn from what they touch, and others in it, to scale.
            extra = pair.extra_gap + pair.allowed_interference[-1]
            wrong = max(np.abs(extra[touched]).max(initial=0.0),
                        (extra - pair.gap[-1]).max(initial=0.0))
            if wrong > 0:
                wanted = min(wanted, max(1.0, ERROR * size / wrong))
            obstacle = pair.obstacle
            if obstacle is None:
                continue
            turned = pair.obstacle_at().turn
            if obstacle.shape != "plane" or (turned is not None and (turned != np.eye(3)).any()):
                return 1.0
            came = (pair.coordinates - obstacle.point) @ obstacle.direction
            came = came[touched].max(initial=0.0)
            if came > 0:
                wanted = min(wanted, 1 + ERROR * size / came)
        return round_down(wanted)

    def sampled(self, most=20):
        """Return up to `most` stored increments, the last among them."""
        stored = len(self.result.field_rows)
        return np.unique(np.linspace(0, stored - 1, min(stored, most)).round().astype(int))

    def choose_direction(self, apart):
        """Return elevation and azimuth; with `apart` also pull the bodies apart.

        Bodies are seen from above. From where contact is seen is asked with `apart` alone.
        """
        if self.look.turn:
            return self.look.view or views.ABOVE[0]
        if self.result.is_plane:
            return self.look.view or views.FRONT
        points = self.places(-1)
        surfaces = [views.ContactFaces(pair, points) for pair in self.result.pairs.values()]
        before_bodies = [one for one in surfaces if len(one.pair.master_nodes)]
        if not apart or not before_bodies:
            # Before another body nothing is seen of it.
            seen = [one for one in surfaces if one not in before_bodies]
            directions = views.DIRECTIONS if apart else views.ABOVE
            return self.look.view or views.choose_direction(seen, None, directions)[0]
        if self.box:
            points = np.clip(points, *self.box)
        size = np.ptp(points, axis=0).max()

        def pull(eye):
            offset, far = views.pull_apart(points, self.body, before_bodies, eye)
            return offset, far / size

        directions = [self.look.view] if self.look.view else views.DIRECTIONS
        direction, offset = views.choose_direction(surfaces, pull, directions)
        if offset is not None:
            self.offset = offset
        return direction

    def limits(self):
        """Return the corners of the box that holds the bodies in all increments, as drawn."""
        starts = [] if self.offset.any() else [self.result.points]
        drawn = [*starts, *map(self.places, self.sampled())]
        lows, highs = [], []
        shown = np.unique(self.skin.vertices.nodes)
        for body in range(self.body.max() + 1):
            nodes = shown[self.body[shown] == body]
            if len(nodes) == 0:
                continue
            points = np.concatenate([places[nodes] for places in drawn]) - self.offset[nodes[0]]
            low, high = points.min(axis=0), points.max(axis=0)
            if self.box:
                low, high = np.maximum(low, self.box[0]), np.minimum(high, self.box[1])
            if (low <= high).all():
                lows.append(low + self.offset[nodes[0]])
                highs.append(high + self.offset[nodes[0]])
        low, high = np.min(lows, axis=0), np.max(highs, axis=0)
        if self.look.turn:
            return np.array([-high[0], -high[0], low[1]]), np.array([high[0], high[0], high[1]])
        return low, high

    def box_about_the_contact(self):
        """Return the corners of a box about the nodes that are pressed, None if it is large."""
        points, row = self.places(-1), self.result.field_rows[-1]
        pressed = [pair.nodes[pair.reaction[row, :, 0] > 0] for pair in self.result.pairs.values()]
        touched = points[np.concatenate([np.zeros(0, dtype=int), *pressed])]
        if len(touched) == 0:
            return None
        low, high = touched.min(axis=0), touched.max(axis=0)
        extent = float(np.max(high - low))
        if not 0 < extent <= SMALL * np.ptp(points, axis=0).max():
            return None
        return low - MARGIN * extent, high + MARGIN * extent

    def view_limits(self):
        """Return the corners of the box of the picture: that of the bodies and of what they touch.

        Obstacles are drawn near the bodies alone, and so their motion does not set the view.
        """
        low, high = self.low, self.high
        for index in self.sampled(3):
            for pieces in self.obstacle_surfaces(index):
                if len(pieces):
                    low = np.minimum(low, pieces.min(axis=(0, 1)))
                    high = np.maximum(high, pieces.max(axis=(0, 1)))
        return low, high

    def norm(self, quantity, indices):
        """Return the colour range of a quantity over stored increments."""
        if self.look.limits:
            return Normalize(*self.look.limits)
        values = {
            "stress": self.mises, "mesh_error": self.mesh_error, "displacement": self.lengths,
            "pressure": lambda i: np.nan_to_num(self.pressure(i, False)),
        }[quantity]  # fmt: skip
        largest = max(np.abs(values(i)).max() for i in indices) or 1.0
        return Normalize(0 if self.component(quantity) is None else -largest, largest)

    def face_values(self, index, quantity):
        """Return the values at the corners of the polygons of the skin, (P, 4)."""
        values = {"stress": self.mises, "mesh_error": self.mesh_error, "pressure": self.pressure,
                  "displacement": self.lengths}[quantity](index)  # fmt: skip
        of_elements = {"stress": self.stress_on == "elements", "mesh_error": True}
        if of_elements.get(quantity):
            return np.repeat(values[self.skin.element, None], 4, axis=1)
        return self.skin.vertices.at(values)

    def scene(self, index, quantity):
        """Return what is drawn at a stored increment."""
        places, skin = self.places(index), self.skin
        polygons = skin.vertices.at(places)
        ends = np.stack([polygons, np.roll(polygons, -1, axis=1)], axis=2)
        lines = np.concatenate([ends[skin.sides], skin.grid.at(places)])
        values, outline = self.face_values(index, quantity), skin.outline.at(places)
        if self.box:
            low, high = self.low - 0.01 * self.size, self.high + 0.01 * self.size
            shown, of_lines, of_outline = (
                ((each.mean(axis=1) > low) & (each.mean(axis=1) < high)).all(axis=1)
                for each in (polygons, lines, outline)
            )
            polygons, values = polygons[shown], values[shown]
            lines, outline = lines[of_lines], outline[of_outline]
        if self.look.turn:
            polygons, values, lines, outline = turn_section(
                polygons, values, skin.vertices.nodes[..., 0], skin.sides, self.angles())
        start = self.result.points[self.edges] if self.shows_start else np.zeros((0, 2, 3))
        obstacles = self.obstacle_surfaces(index)
        edges = np.zeros((0, 2, 3))
        if self.result.is_plane and not self.look.turn:
            pieces = np.concatenate([np.zeros((0, 4, 3)), *obstacles])
            edges = crossings(pieces, 2, self.result.points[:, 2].mean())
            obstacles = []
        return Scene(polygons, values, lines, outline, start, obstacles, edges)

    def scale_words(self):
        """Return how displacements are drawn."""
        if self.scale == 1:
            return "displacements to scale"
        return f"displacements times {self.scale:g}"

    def words(self):
        """Return how displacements and bodies are drawn."""
        said = self.scale_words()
        if self.apart:
            said += "; bodies drawn apart"
        if self.box:
            said += "; close-up of the contact"
        if self.shows_start:
            said += "; thin outline: before loading"
        if self.plane:
            said += f"; cut at {'xyz'[self.plane[0]]} = {self.plane[1]:g}"
        if self.look.turn:
            said += f"; turned by {self.look.turn:g} degrees"
        if any(pair.obstacle is not None for pair in self.result.pairs.values()):
            said += "; grey: obstacles"
        return said


def error_of_force(result, row):
    """Return the estimated error of an increment's contact forces, '' where there is none."""
    if "error/total" not in result.history_names or result.error_of_energy or not result.pairs:
        return ""
    error = result.history("error/total")[row]
    return f"; contact force ±{float(f'{100 * error:.2g}'):g} %" if error > 0 else ""


@styled
def draw_bodies(bodies, quantity):
    """Return a figure of the bodies at the stored increment that is looked at."""
    result = bodies.result
    last = range(len(result.field_rows))[bodies.look.index]
    row = result.field_rows[last]
    norm = bodies.norm(quantity, [last])
    figure = plt.figure(figsize=(7.2, 5.4))
    axes = figure.add_subplot()
    show_image(axes, render(bodies, last, quantity, norm), bodies)
    colour_bar(figure, axes, norm, bodies.colour_map(quantity), bodies.label(quantity))
    when = f"{result.label(row)}{error_of_force(result, row)}"
    axes.set_title(f"{result.path.stem}: {when}\n{bodies.words()}", pad=12)
    return figure
