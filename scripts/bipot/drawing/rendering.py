"""Bodies and obstacles as pixels: at each, the nearest surface is seen.

What is drawn is flat triangles and lines, all in numpy at once: a picture needs no graphics library
and no display, and is the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_rgb

from bipot.drawing.style import GROUND, INK, PLAIN

FINE = 2  # pixels that are drawn for one that is kept, along each side
DPI = 150
WIDTH, HEIGHT = 6.0, 4.5  # [inch]
MARGIN = 1.06  # of the picture about what is in it
LIFT = 0.004  # of lines before the faces that they lie on, of the size
VEIL = 0.22  # opacity of obstacles between the spectator and the bodies
AT_ONCE = 50_000  # pixels of triangles that are looked at together
LONG = 32  # pixels along a side of the largest triangle that is drawn in one piece


class Camera(NamedTuple):
    """From where and how large a scene is seen, without perspective."""

    axes: np.ndarray  #: (3, 3) rows: unit vectors to the right, upwards, and to the spectator
    middle: np.ndarray  #: (3,) the place in the middle of the picture
    length: float  #: of a pixel
    depth: float  #: the size of the scene
    shape: tuple[int, int]  #: rows and columns of pixels

    def seen(self, places: np.ndarray) -> np.ndarray:
        """Return places (..., 3) as column, row and depth in pixels that are drawn."""
        flat = (places - self.middle) @ self.axes.T * (FINE / self.length)
        rows, columns = self.shape
        return flat * [1, -1, 1] + [FINE * columns / 2, FINE * rows / 2, 0]


class Image(NamedTuple):
    """A picture in pixels."""

    pixels: np.ndarray  #: (rows, columns, 3), 0 to 255
    right: np.ndarray  #: (3,) unit vector to the right
    up: np.ndarray  #: (3,) and upwards
    length: float  #: of a column


def screen_axes(eye):
    """Return the unit vectors to the right and upwards on a screen seen from `eye`."""
    right = np.cross([0.0, 0.0, 1.0], eye)
    if np.linalg.norm(right) < 1e-6:  # from above: y upwards
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    return right, np.cross(eye, right)


def camera_on(points, eye, size) -> Camera:
    """Return a Camera that has points (N, 3) in its picture of so many columns and rows."""
    columns, rows = (int(one) for one in size)
    axes = np.stack([*screen_axes(eye), eye])
    flat = points @ axes.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    length = MARGIN * max((high[0] - low[0]) / columns, (high[1] - low[1]) / rows, 1e-300)
    depth = max(float(np.ptp(points, axis=0).max()), 1e-300)
    return Camera(axes, (low + high) / 2 @ axes, length, depth, (rows, columns))


def render(bodies, index, quantity, norm, camera=None) -> Image:
    """Return an Image of the bodies at a stored increment; without a camera they fill it."""
    scene = bodies.scene(index, quantity)
    if camera is None:
        dpi = bodies.look.dpi or DPI
        parts = [scene.polygons, *scene.obstacles, scene.start]
        points = np.concatenate([part.reshape(-1, 3) for part in parts])
        camera = camera_on(points, bodies.eye, (WIDTH * dpi, HEIGHT * dpi))
    return render_scene(scene, camera, norm, bodies.colour_map(quantity))


def render_scene(scene, camera, norm, colours) -> Image:
    """Return an Image of a Scene: `norm` and `colours` make the colours of the bodies' values."""
    rows, columns = (FINE * count for count in camera.shape)
    depth = np.full(rows * columns, -np.inf)
    value = np.full(rows * columns, np.nan)
    shade = np.ones(rows * columns)
    is_body = np.zeros(rows * columns, dtype=bool)
    eye, lift = camera.axes[2], LIFT * camera.depth * FINE / camera.length
    behind, before = [], []
    for pieces in scene.obstacles:
        normals = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
        away = normals @ eye >= 0
        behind.append(pieces[away])
        before.append(pieces[~away])
    none = np.zeros((0, 4, 3))
    # An obstacle that is touched lies in the faces that touch it: these are seen.
    for polygons, values, body, back in (
        (scene.polygons, scene.values, True, 0.0), (np.concatenate([none, *behind]), None, False,
                                                    lift),
    ):
        triangles, bright, of_corners = triangles_of(polygons, camera, values, body)
        for one, pixel, far, weights in fragments(triangles, (rows, columns)):
            where = nearest(pixel, far - back, depth)
            depth[pixel[where]] = far[where] - back
            shade[pixel[where]] = bright[one[where]]
            is_body[pixel[where]] = body
            value[pixel[where]] = (weights[where] * of_corners[one[where]]).sum(axis=1)
    seen = np.isfinite(depth)
    picture = np.ones((rows * columns, 3))
    known = seen & is_body & ~np.isnan(value)
    picture[seen] = np.where(is_body[seen, None], to_rgb(PLAIN), to_rgb(GROUND))
    picture[known] = colours(norm(value[known]))[:, :3]
    picture[seen] *= shade[seen, None]
    pixel = camera.shape[1] / (WIDTH * DPI)  # what a line of width 1 is on a screen
    for segments, colour, width in (
        (scene.edges, "#7d8794", 3.0), (scene.lines, "#6e6e6e", 1.0), (scene.start, "#a8a8a8", 1.2),
        (scene.outline, INK, 1.8),
    ):
        brush = max(1, round(FINE * width * pixel))
        where = line_pixels(camera.seen(segments), brush, depth - lift, (rows, columns))
        picture[where] = to_rgb(colour)
    triangles, bright, _ = triangles_of(np.concatenate([none, *before]), camera)
    veiled = np.zeros(rows * columns)
    for one, where, far, _ in fragments(triangles, (rows, columns)):
        shown = far + lift > depth[where]
        veiled[where[shown]] = bright[one[shown]]
    covered = veiled > 0
    veil = np.array(to_rgb(GROUND)) * veiled[covered, None]
    picture[covered] = (1 - VEIL) * picture[covered] + VEIL * veil
    fine = picture.reshape(camera.shape[0], FINE, camera.shape[1], FINE, 3)
    pixels = (255 * fine.mean(axis=(1, 3))).round().astype("uint8")
    return Image(pixels, camera.axes[0], camera.axes[1], camera.length)


def triangles_of(polygons, camera, values=None, closed=False):
    """Return quadrilaterals (P, 4, 3), of which triangles have a corner twice, as triangles.

    closed  what is turned away from the spectator is left out: it is behind something else

    Returns their corners in pixels (T, 3, 3), how bright they are (T,), and the values at their
    corners (T, 3). A lamp stands over the spectator's shoulder; shades are light, so that the
    colours are those of the bar.
    """
    if closed:
        seen = np.cross(polygons[:, 2] - polygons[:, 0], polygons[:, 3] - polygons[:, 1])
        seen = seen @ camera.axes[2] > 0
        polygons, values = polygons[seen], values[seen]
    if values is None:
        values = np.full(polygons.shape[:2], np.nan)
    halves = [[0, 1, 2], [0, 2, 3]]
    corners = polygons[:, halves].reshape(-1, 3, 3)
    values = values[:, halves].reshape(-1, 3)
    while True:
        flat = camera.seen(corners)
        extent = np.ptp(flat[:, :, :2], axis=1).max(axis=1, initial=0)
        large = extent > LONG
        if not large.any():
            break
        corners = np.concatenate([corners[~large], quarters(corners[large])])
        values = np.concatenate([values[~large], quarters(values[large, :, None])[:, :, 0]])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1)
    lamp = np.array([-0.6, 0.9, 1.0]) @ camera.axes
    facing = np.sign(normals @ camera.axes[2])
    light = normals @ (lamp / np.linalg.norm(lamp)) * facing / np.where(size > 0, size, 1)
    return flat, 0.7 + 0.3 * np.clip(light, 0, 1), values


def quarters(triangles):
    """Return triangles (T, 3, k) cut into four each, by the middles of their sides."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([np.stack(part, axis=1) for part in parts])


def fragments(
    triangles, shape
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield what covers pixels of a picture of so many rows and columns, many at once.

    Triangle (n,), pixel (n,) as row * columns + column, depth (n,), and the weights of the
    triangle's corners (n, 3).
    """
    rows, columns = shape
    low = np.floor(triangles[:, :, :2].min(axis=1)).astype(int)
    high = np.ceil(triangles[:, :, :2].max(axis=1)).astype(int)
    # All triangles of one size, a power of two of pixels, have as many pixels about them.
    side = 2 ** np.ceil(np.log2(np.maximum(high - low, 1).max(axis=1))).astype(int)
    for count in np.unique(side):
        chosen = np.flatnonzero(side == count)
        offsets = np.stack(np.meshgrid(*2 * [np.arange(count)]), axis=-1).reshape(-1, 2)
        for part in np.array_split(chosen, max(1, len(chosen) * len(offsets) // AT_ONCE)):
            a, b, c = np.moveaxis(triangles[part], 1, 0)
            one, two = b - a, c - a
            area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
            # Seen from the side a triangle covers nothing.
            over = np.divide(1, area, out=np.full(len(part), np.nan), where=area != 0)[:, None]
            of_s = over * np.stack([two[:, 1], -two[:, 0]], axis=1)
            of_t = over * np.stack([-one[:, 1], one[:, 0]], axis=1)
            start = (low[part] + 0.5 - a[:, :2])[:, :, None]
            s, t = (of @ offsets.T + (of[:, None] @ start)[:, 0] for of in (of_s, of_t))
            row, which = np.nonzero((s >= 0) & (t >= 0) & (s + t <= 1))
            place = low[part][row] + offsets[which]
            shown = ((place >= 0) & (place < [columns, rows])).all(axis=1)
            row, which, place = row[shown], which[shown], place[shown]
            s, t = s[row, which], t[row, which]
            far = a[row, 2] + s * one[row, 2] + t * two[row, 2]
            yield part[row], place[:, 1] * columns + place[:, 0], far, \
                np.stack([1 - s - t, s, t], axis=1)


def nearest(pixel, far, depth):
    """Return those (n,) that are nearer than `depth` at their pixels, of each pixel one."""
    chosen = np.flatnonzero(far > depth[pixel])
    chosen = chosen[np.lexsort((far[chosen], pixel[chosen]))]
    last = np.append(pixel[chosen][1:] != pixel[chosen][:-1], True)
    return chosen[last[: len(chosen)]]


def line_pixels(segments, brush, depth, shape):
    """Return the pixels of segments (S, 2, 3), `brush` wide, that lie before `depth`."""
    rows, columns = shape
    count = np.ceil(np.abs(segments[:, 1, :2] - segments[:, 0, :2]).max(axis=1, initial=0))
    count = count.astype(int) + 1
    which = np.repeat(np.arange(len(segments)), count)
    step = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    share = (step / np.maximum(count - 1, 1)[which])[:, None]
    places = (1 - share) * segments[which, 0] + share * segments[which, 1]
    found = [np.zeros(0, int)]
    for offset in np.ndindex(brush, brush):
        place = np.floor(places[:, :2] + np.array(offset) - (brush - 1) / 2).astype(int)
        inside = ((place >= 0) & (place < [columns, rows])).all(axis=1)
        pixel = place[inside, 1] * columns + place[inside, 0]
        found.append(pixel[places[inside, 2] > depth[pixel]])
    return np.concatenate(found)


def show_image(axes, image, bodies):
    """Show an Image in axes, with the directions of x, y and z and a length."""
    axes.imshow(image.pixels, interpolation="antialiased")
    axes.set_axis_off()
    rows, columns = image.pixels.shape[:2]
    corner, arm = np.array([0.07 * columns, 0.93 * rows]), 0.06 * columns
    for name, direction in zip(bodies.axes, np.eye(3), strict=True):
        flat = np.array([direction @ image.right, -(direction @ image.up)])
        if not name or np.linalg.norm(flat) < 0.15:
            continue
        axes.annotate(
            "", corner + arm * flat, corner, annotation_clip=False,
            arrowprops={"arrowstyle": "-|>", "color": INK, "shrinkA": 0, "shrinkB": 0,
                        "linewidth": 0.9, "mutation_scale": 7},
        )
        axes.annotate(name, corner + 1.3 * arm * flat, ha="center", va="center", fontsize=8,
                      annotation_clip=False)
    wanted = 0.2 * columns * image.length
    decade = 10.0 ** np.floor(np.log10(wanted))
    bar = decade * max(step for step in (1, 2, 5) if step * decade <= wanted * (1 + 1e-9))
    right = np.array([0.98 * columns, 0.97 * rows])
    left = right - [bar / image.length, 0]
    axes.plot(*np.stack([left, right], axis=1), color=INK, linewidth=1.5, clip_on=False)
    axes.text(*((left + right) / 2 - [0, 0.01 * rows]),
              f"{bar:g} {bodies.result.units.length}".strip(), ha="center", va="bottom", fontsize=8)
    axes.set_xlim(-0.5, columns - 0.5)
    axes.set_ylim(rows - 0.5, -0.5)
