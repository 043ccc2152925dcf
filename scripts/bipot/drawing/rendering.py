"""Bodies and obstacles as PyVista renders them off screen: depth, light, holes that are holes.

Where PyVista is not installed, or can draw nothing on this machine, matplotlib draws them instead.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np

from bipot.drawing.style import INK, PLAIN

FINE = 2  # pixels that are rendered for one that is kept, along each side
DPI = 200
GROUND = "#b3bac2"  # of obstacles
WIDTH, HEIGHT = 6.0, 4.5  # [inch]
MARGIN = 1.06  # of the picture about what is in it
LIFT = 0.002  # of lines before the faces that they lie on, of the size


class Image(NamedTuple):
    """A picture in pixels."""

    pixels: np.ndarray  #: (rows, columns, 3), 0 to 255
    right: np.ndarray  #: (3,) unit vector to the right
    up: np.ndarray  #: (3,) and upwards
    length: float  #: of a column


# Where no graphics library is found VTK ends the process, so another one tries it first.
TRIED = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(16, 16))
plotter.set_background("white")
plotter.add_mesh(pyvista.Plane(), color="black")
raise SystemExit(not plotter.screenshot(None, return_img=True).min() < 128)
"""


@functools.cache
def can_render():
    """Return whether PyVista is there and can draw; BIPOT_PICTURES=matplotlib does without it."""
    if os.environ.get("BIPOT_PICTURES") == "matplotlib":
        return False
    if importlib.util.find_spec("pyvista") is None:
        return False
    tried = subprocess.run([sys.executable, "-c", TRIED], capture_output=True, check=False)
    if tried.returncode:
        print("show: PyVista can draw nothing here, so matplotlib draws the bodies; on Debian: "
              "apt-get install libegl1 libgl1-mesa-dri", file=sys.stderr)
    return tried.returncode == 0


def render(bodies, index, quantity, norm):
    """Return an Image of the bodies at a stored increment, None where matplotlib is to draw it."""
    if not can_render():
        return None
    scene = bodies.scene(index, quantity)
    colours = bodies.colour_map(quantity)
    dpi = bodies.look.dpi or DPI
    return render_scene(scene, bodies.eye, norm, colours, (WIDTH * dpi, HEIGHT * dpi))


def screen_axes(eye):
    """Return the unit vectors to the right and upwards on a screen seen from `eye`."""
    right = np.cross([0.0, 0.0, 1.0], eye)
    if np.linalg.norm(right) < 1e-6:  # from above: y upwards
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    return right, np.cross(eye, right)


def render_scene(scene, eye, norm, colours, size):
    """Return an Image of so many columns and rows."""
    from vtkmodules.vtkCommonCore import vtkLogger

    # Without a display VTK warns before it goes on to another way.
    said = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    import pyvista

    columns, rows = (FINE * int(one) for one in size)
    right, up = screen_axes(eye)
    parts = [scene.polygons, *scene.obstacles, scene.start]
    points = np.concatenate([part.reshape(-1, 3) for part in parts])
    flat = points @ np.stack([right, up, eye], axis=1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    middle = np.stack([right, up, eye], axis=1) @ ((low + high) / 2)
    length = MARGIN * max((high[0] - low[0]) / columns, (high[1] - low[1]) / rows, 1e-300)
    deep = max(float(np.ptp(points, axis=0).max()), 1e-300)
    lift = LIFT * deep * eye

    plotter = pyvista.Plotter(off_screen=True, window_size=(columns, rows), lighting="none")
    plotter.disable_anti_aliasing()  # the pixels that are rendered for one are averaged here
    plotter.set_background("white")
    # A lamp over the spectator's shoulder; shades are light, so that the colours are those of the
    # bar.
    lamp = eye - 0.6 * right + 0.9 * up
    plotter.add_light(pyvista.Light(position=middle + 10 * deep * lamp, focal_point=middle,
                                    light_type="scene light"))
    pixel = columns / (WIDTH * DPI)  # what a line of width 1 is on a screen
    plain = {"ambient": 0.7, "diffuse": 0.3, "specular": 0.0}
    body = faces_of(scene.polygons)
    body["value"] = scene.values.ravel()
    plotter.add_mesh(body, scalars="value", cmap=colours, clim=(norm.vmin, norm.vmax),
                     nan_color=PLAIN, show_scalar_bar=False, interpolate_before_map=True, **plain)
    for segments, colour, width in (
        (scene.lines, "#6e6e6e", 1.0), (scene.outline, INK, 1.8), (scene.start, "#a8a8a8", 1.2),
    ):
        if len(segments):
            plotter.add_mesh(lines_of(segments + lift), color=colour, line_width=width * pixel,
                             lighting=False)
    for pieces in scene.obstacles:
        normals = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
        behind = normals @ eye >= 0
        # What stands between the spectator and the bodies is a veil.
        for chosen, opacity, away in ((behind, 1.0, -1.0), (~behind, 0.22, 1.0)):
            if chosen.any():
                plotter.add_mesh(faces_of(pieces[chosen] + away * lift), color=GROUND,
                                 opacity=opacity, **plain)
    camera = plotter.camera
    camera.parallel_projection = True
    camera.focal_point, camera.position = middle, middle + 3 * deep * eye
    camera.up = up
    camera.parallel_scale = length * rows / 2
    camera.clipping_range = (0.1 * deep, 10 * deep)
    pixels = plotter.screenshot(None, return_img=True)
    plotter.close()
    vtkLogger.SetStderrVerbosity(said)
    shape = (rows // FINE, FINE, columns // FINE, FINE, 3)
    means = pixels[:, :, :3].reshape(shape).mean(axis=(1, 3)).round().astype("uint8")
    return Image(means, right, up, FINE * length)


def faces_of(pieces):
    """Return quadrilaterals (F, 4, 3), of which triangles have a corner twice, as a mesh."""
    import pyvista

    rows = np.arange(4 * len(pieces)).reshape(-1, 4)
    return pyvista.PolyData(pieces.reshape(-1, 3), np.insert(rows, 0, 4, axis=1).ravel())


def lines_of(segments):
    """Return segments (S, 2, 3) as a mesh."""
    import pyvista

    rows = np.arange(2 * len(segments)).reshape(-1, 2)
    return pyvista.PolyData(segments.reshape(-1, 3), lines=np.insert(rows, 0, 2, axis=1).ravel())


def show_image(axes, image, bodies):
    """Show an Image in axes, with the directions of x, y and z and a length."""
    axes.imshow(image.pixels, interpolation="antialiased")
    axes.set_axis_off()
    rows, columns = image.pixels.shape[:2]
    corner, arm = np.array([0.07 * columns, 0.93 * rows]), 0.06 * columns
    for name, direction in zip("xyz", np.eye(3), strict=True):
        flat = np.array([direction @ image.right, -(direction @ image.up)])
        if np.linalg.norm(flat) < 0.15:
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
