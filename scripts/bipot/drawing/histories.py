"""Histories over the time of the run: forces of a pair, and the errors."""

import matplotlib.pyplot as plt
import numpy as np

from bipot.drawing.style import COLOURS, GRID, INK, styled
from bipot.quantities import SLIDE, STICK
from bipot.summary import OF_ROUNDING

FEW = 25  # increments that get a mark each: the line between two hides how few they are
PALETTE = ("#2f6db0", "#e8813a", "#2a9d6f", "#7a4fa3", "#c2443c", "#8a6d3b", "#4aa3c7", "#7f7f7f")
ERRORS = {"mesh": "mesh", "geometry": "geometry", "load_steps": "load steps", "contact": "contact",
          "arithmetic": "arithmetic", "total": "total", "small_strain": "small strain"}


def over_time(result, axes):
    """Prepare axes over the time of the run; return the times, and how their lines are marked."""
    times = result.history("time")
    for one in axes:
        one.grid(color=GRID, linewidth=0.4)
        one.set_axisbelow(True)
        for row in result.step_ends[:-1]:
            one.axvline(times[row], color=GRID, linewidth=1.2, linestyle="--")
    # The run starts at 0, of which nothing is stored.
    last = times[-1] if times[-1] > 0 else 1.0
    axes[-1].set_xlim(0, 1.02 * last)
    axes[-1].set_xlabel("time (dashed: ends of steps)" if len(result.step_ends) > 1 else "time")
    return times, {"marker": ".", "markersize": 5} if len(times) <= FEW else {}


def legend_beside(axes):
    """Put the legend to the right of axes, where it covers nothing."""
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)


def ratio(across, along):
    """Return friction over pressure; not a number where nothing presses."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(along > 0, across / along, np.nan)


@styled
def draw_forces(result, pair):
    """Return a figure of the forces of a contact pair over the time, their moment and ratio."""
    figure, (top, middle, bottom) = plt.subplots(
        3, 1, figsize=(8.6, 7.2), sharex=True, gridspec_kw={"height_ratios": [3, 2, 2]}
    )
    times, marks = over_time(result, (top, middle, bottom))
    top.plot(times, pair.normal_sum, color=INK, label="sum of the normal forces", **marks)
    top.plot(
        times, pair.friction_sum, color=COLOURS[SLIDE],
        label="sum of the magnitudes\nof the friction forces", **marks,
    )
    # What is rounding beside the forces has no moment.
    arm = np.abs(pair.coordinates - pair.middle).max(initial=0)
    least = OF_ROUNDING * arm * (pair.normal_sum + pair.friction_sum).max(initial=0)
    moment = np.where(np.abs(pair.moment_about_middle) > least, pair.moment_about_middle, 0)
    for axis, colour in enumerate(("#7a4fa3", "#2a9d6f", COLOURS[STICK])):
        top.plot(
            times, pair.resultant[:, axis], "--", color=colour, linewidth=1.1,
            label=f"resultant on the body, {'xyz'[axis]}", **marks,
        )
        middle.plot(
            times, moment[:, axis], "--", color=colour, linewidth=1.1,
            label=f"moment about the middle, {'xyz'[axis]}", **marks,
        )
    middle.set_ylabel(result.units.label("moment", "moment"))
    top.set_ylabel(result.units.label("force", "force"))
    top.set_title(f"{result.path.stem}, contact {pair.name}")

    bottom.plot(
        times, ratio(pair.friction_sum, pair.normal_sum), color=COLOURS[SLIDE],
        label="friction / normal,\nsums of magnitudes", **marks,
    )
    normals = pair.frame[:, :, 0]
    if np.ptp(normals, axis=(0, 1)).max() < 1e-12:
        normal = normals[0, 0]
        along = pair.resultant @ normal
        across = np.linalg.norm(pair.resultant - along[:, None] * normal, axis=1)
        bottom.plot(
            times, ratio(across, along), "--", color=COLOURS[STICK], label="the same, resultants",
            **marks,
        )
    if pair.friction_coefficients.max(initial=0) > 0:
        bottom.step(
            times, pair.friction_coefficients, color=INK, linewidth=0.8, linestyle=":",
            where="post", label="coefficient of friction",
        )
    certified = result.history("certified")
    for value, mark, label in ((0, "rx", "not certified"), (-1, "k|", "certificate pending")):
        chosen = times[certified == value]
        if len(chosen):
            bottom.plot(chosen, np.zeros(len(chosen)), mark, label=label, clip_on=False)
    # Rounding is no ratio.
    bottom.set_ylim(0, max(0.01, 1.05 * bottom.get_ylim()[1]))
    bottom.set_ylabel("ratio of the forces")
    for axes in (top, middle, bottom):
        legend_beside(axes)
    return figure


@styled
def draw_errors(result):
    """Return a figure of the certificate's errors over the time, and of the estimated ones."""
    figure, axes = plt.subplots(
        2, 1, figsize=(8.6, 5.4), sharex=True, gridspec_kw={"hspace": 0.3}
    )
    times, _ = over_time(result, axes)
    estimates = {
        words: result.history(f"error/{name}") for name, words in ERRORS.items()
        if f"error/{name}" in result.history_names
    }
    for one, errors in zip(axes, (result.certificate, estimates), strict=True):
        least, largest, none = np.inf, 0.0, []
        for colour, (name, values) in zip(PALETTE, errors.items(), strict=False):
            # -1: not estimated, or pending; 0 has no place on these axes.
            # Huge: not known.
            known = (values >= 0) & (values < 1e300)
            positive = known & (values > 0)
            marks = {"marker": ".", "markersize": 5} if known.sum() <= FEW else {}
            drawn = np.where(positive, values, np.nan)
            if name == "small strain" and result.small_strain_is == "bound":
                name = "small strain (at most)"
            if not positive.any():
                none += [name] * bool(known.any())
                continue
            # A sum often equals its largest part, which is drawn on top of it.
            width, order = (3.6, 1.5) if name == ERRORS["total"] else (1.2, 2)
            # Across increments without an estimate the line goes on.
            one.plot(times[known], drawn[known], color=colour, label=name, linewidth=width,
                     zorder=order, **marks)
            least = min(least, values[positive].min())
            largest = max(largest, values[positive].max())
        one.set_yscale("log")
        if largest > 0:
            one.set_ylim(least / 3, largest * 3)
            legend_beside(one)
        if none:
            one.text(0.01, 0.02, f"0: {', '.join(none)}", transform=one.transAxes, fontsize=8)
    axes[0].set_ylabel("errors, relative")
    axes[0].set_title(f"{result.path.stem}: certificate of each increment")
    axes[1].set_ylabel("errors, relative")
    axes[1].set_title("estimated errors")
    return figure
