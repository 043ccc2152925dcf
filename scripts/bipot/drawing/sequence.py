"""The meshes by which an accuracy was reached: how far each was from what they tend to."""

import matplotlib.pyplot as plt
import numpy as np

from bipot.drawing.style import GRID, INK, styled

COLOURS = ("#2f6db0", "#e8813a", "#2a9d6f", "#7a4fa3", "#c2443c")


def by_quantity(names):
    """Return the columns of each quantity: a vector's components are three of them."""
    found = {}
    for column, name in enumerate(names):
        head, _, tail = name.rpartition("_")
        is_component = tail in "xyz" and f"{head}_x" in names and f"{head}_z" in names
        found.setdefault(head if is_component else name, []).append(column)
    return found


def distances(sequence):
    """Return of each quantity how far every run is from the limit, (K,), in parts of its scale."""
    found = {}
    for name, columns in by_quantity(sequence.names).items():
        if sequence.error[columns[0]] < 0 <= sequence.error.max():
            continue  # it is there beside another one, and not compared
        scale = sequence.scale[columns[0]]
        apart = sequence.values[:, :, columns] - sequence.extrapolated[:, columns]
        largest = np.linalg.norm(apart, axis=2).max(axis=1)
        found[name] = largest / scale if scale > 0 else largest
    return found


@styled
def draw_sequence(result):
    """Return a figure of the runs' distances from the limit over the processor time so far."""
    sequence = result.accuracy
    figure, axes = plt.subplots(figsize=(8.6, 4.2))
    seconds = np.cumsum(sequence.processor_time)
    for (name, apart), colour in zip(distances(sequence).items(), COLOURS * 9, strict=False):
        drawn = np.where(apart > 0, apart, np.nan)
        axes.plot(seconds, drawn, "o-", color=colour, markersize=4, linewidth=1.2, label=name)
    told = sequence.mesh_and_load_steps + sequence.others
    if sequence.mesh >= 0:
        axes.plot(seconds[-1], told, "k_", markersize=14, label="estimated error")
    if sequence.wanted > 0:
        axes.axhline(sequence.wanted, color=INK, linewidth=0.8, linestyle=":", label="wanted")
    top = axes.get_xaxis_transform()
    for k, time in enumerate(seconds):
        words = f"{sequence.elements[k]}"
        if sequence.cuts[k]:
            words += f", cut {sequence.cuts[k]}"
        if sequence.divisions[k] > 1:
            words += f", 1/{sequence.divisions[k]}"
        axes.text(time, 1.01, words, transform=top, rotation=60, fontsize=6, color=INK)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(color=GRID, linewidth=0.4)
    axes.set_axisbelow(True)
    axes.set_xlabel(
        "CPU time of all runs so far [s]; above: elements, cuts at contact, parts of increments"
    )
    axes.set_ylabel("distance from the limit, in parts of the scale")
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure
