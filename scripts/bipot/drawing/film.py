"""The animation of a result."""

import sys
from itertools import product

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import animation

from bipot.drawing.contact_map import Map
from bipot.drawing.rendering import camera_on, render, show_image
from bipot.drawing.style import colour_bar, styled

MAX_FRAMES = 60
SIZE = (480, 360)  # pixels of the bodies


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
def draw_animation(result, bodies, pair, path, writer):
    """Save the bodies, and the contact surface beside them, over the increments."""
    frames = bodies.sampled(MAX_FRAMES)
    norm = bodies.norm("displacement", frames)
    figure = plt.figure(figsize=(9.6 if pair else 6.2, 4.6), dpi=80)
    places = figure.add_gridspec(
        1, 2 if pair else 1, left=0.02, right=0.97, top=0.82, bottom=0.18,
        width_ratios=[1.6, 1] if pair else [1],
    )
    body_axes = figure.add_subplot(places[0])
    # The same place is at the same pixel in all frames.
    low, high = bodies.view
    corners = np.array(list(product(*zip(low, high, strict=True))))
    camera = camera_on(corners, bodies.eye, SIZE)
    colour_bar(
        figure, body_axes, norm, bodies.colour_map("displacement"), bodies.label("displacement")
    )
    surface = Map(pair) if pair else None
    map_axes = figure.add_subplot(places[1]) if pair else None

    def draw(frame):
        row = result.field_rows[frame]
        body_axes.clear()
        show_image(body_axes, render(bodies, frame, "displacement", norm, camera), bodies)
        if surface:
            map_axes.clear()
            surface.draw(map_axes, row)
        figure.suptitle(
            f"{result.path.stem}: {result.label(row)}\n{bodies.words()}", fontsize=10
        )

    film = animation.FuncAnimation(figure, draw, frames=frames, init_func=lambda: None)
    # The whole run takes about six seconds, whatever its number of increments.
    speed = int(np.clip(len(frames) / 6, 2, 12))
    film.save(
        path, writer=writer(fps=speed), progress_callback=Progress("animation"),
        savefig_kwargs={"facecolor": "white"},
    )
    plt.close(figure)
