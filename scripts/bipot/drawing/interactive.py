"""A window of PyVista with the bodies and their obstacles, to turn and to go through increments."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import numpy as np

from bipot.drawing.bodies import Bodies, Look
from bipot.drawing.style import COLD, GROUND, RED, WARM
from bipot.errors import ResultError

if TYPE_CHECKING:
    import pyvista

    from bipot.result import Result

# What is coloured, the first of these that the file has.
SCALARS = {"contact_pressure": RED, "von_mises": WARM, "displacement": COLD}


def open_window(result: Result, scale: float | None = None) -> None:
    """Open the window, and wait until it is closed.

    Raises ResultError where PyVista, a display, or the displacements are missing.
    """
    try:
        import pyvista  # noqa: F401
    except ImportError as error:
        raise ResultError(
            f"--interactive needs pyvista: pip install pyvista ({error}; this is {sys.executable})"
        ) from error
    if sys.platform.startswith("linux") and not has_display():
        raise ResultError(
            "--interactive needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set; "
            "--html writes a page for a browser"
        )
    make_plotter(result, scale).show()


def has_display() -> bool:
    """Return whether the environment names a display."""
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def make_plotter(
    result: Result, scale: float | None = None, off_screen: bool = False
) -> pyvista.Plotter:
    """Return the scene with a slider over the increments, at the last one.

    Raises ResultError where the file has no displacements.
    """
    import pyvista

    if len(result.field_rows) == 0 or "displacement" not in result.field_names[0]:
        raise ResultError(f"{result.path}: no displacements are stored")
    bodies = Bodies(result, Look(scale))
    stored = len(result.field_rows)
    names = result.field_names[0] | result.field_names[1]
    scalars = next(name for name in SCALARS if name in names)
    if scalars == "contact_pressure":
        ranges = [bodies.norm("pressure", bodies.sampled()).vmax]
    else:
        ranges = [
            np.linalg.norm(np.atleast_2d(grid[scalars].T).T, axis=1).max()
            for grid in (result.to_pyvista(int(index)) for index in bodies.sampled())
        ]
    plotter = pyvista.Plotter(off_screen=off_screen, title=f"bipot: {result.path.name}")

    def draw(index: int) -> None:
        grid = result.to_pyvista(index)
        grid.points = grid.points + bodies.scale * grid["displacement"]
        plotter.add_mesh(
            grid, name="bodies", scalars=scalars, clim=(0, max(ranges) or 1.0), show_edges=True,
            scalar_bar_args={"title": scalars, "vertical": True, "fmt": "%.3g",
                             "title_font_size": 14, "label_font_size": 12},
            cmap=SCALARS[scalars], ambient=0.4, reset_camera=False,
        )
        for name, pieces in bodies.named_obstacles(index):
            plotter.add_mesh(
                surface(pieces), name=f"obstacle {name}", color=GROUND, opacity=0.3,
                ambient=0.4, reset_camera=False,
            )
        plotter.add_text(
            f"{result.label(result.field_rows[index])}\n{bodies.scale_words()}", name="title",
            font_size=9,
        )

    draw(stored - 1)
    if stored > 1:
        plotter.add_slider_widget(
            lambda value: draw(round(value) - 1), (1, stored), value=stored, fmt="%.0f",
            title="increment with fields", pointa=(0.25, 0.08), pointb=(0.65, 0.08),
            title_height=0.015, slider_width=0.015, tube_width=0.004,
        )
    plotter.add_axes()
    low, high = bodies.view
    middle, size = (low + high) / 2, float(np.max(high - low))
    plotter.camera_position = [tuple(middle + 3 * size * bodies.eye), tuple(middle), (0, 0, 1)]
    plotter.reset_camera(bounds=np.stack([low, high], axis=1).ravel().tolist())
    return plotter


def surface(pieces: np.ndarray) -> pyvista.PolyData:
    """Return pieces (F, 4, 3) as a mesh."""
    import pyvista

    rows = np.arange(4 * len(pieces)).reshape(-1, 4)
    faces = np.insert(rows, 0, 4, axis=1).ravel()
    return pyvista.PolyData(pieces.reshape(-1, 3), faces)
