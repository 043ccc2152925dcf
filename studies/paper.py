"""Make figures 2 and 3 of Joli, Feng and Talbi (2007) from runs of input/block.inp.

Writes docs/studies/paper.md and its figures; the numbers of the page are read from the same runs.
The program is built first: scripts/run builds it.
"""

import shutil
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.ticker import MaxNLocator

from bipot.figures import BLUE, GREEN, GRID, INK, ORANGE, new_axes, save
from bipot.program import ROOT, RunError, script_options
from bipot.result import ResultError
from studies.pages import PAGES, StudyError, fresh_runs
from studies.paper_finite import finite_strain

# The two corners of the lower face whose forces the paper follows.
CORNERS = {"F": (1.0, 0.0, 0.0), "H": (0.0, 1.0, 0.0)}

# The sweeps that figure 3 counts, ended by the relative change of the reactions as in the paper.
COUNTED = {"formulation": "BIPOTENTIAL", "solver": "SWEEPS", "stop": "CHANGE", "tolerance": "1e-6"}
METHODS = (
    ("Uzawa, rho = 1", {"local": "UZAWA", "rho": 1.0}, BLUE, "-"),
    ("Uzawa, rho = 0.3", {"local": "UZAWA", "rho": 0.3}, GREEN, "--"),
    ("Newton", {"local": "NEWTON", "rho": 1.0}, ORANGE, "-"),
)


def figure_2(run, n, path):
    """Draw the normal forces of F and H over the load steps of `run`; return the caption."""
    figure, axes = new_axes()
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    values = {}
    for local, line, mark in (("NEWTON", "-", ""), ("UZAWA", "none", "o")):
        with run(n=n, local=local) as result:
            increments = np.arange(result.finished + 1)
            turn = result.step_ends[0] + 1
            pair = result.pairs[0]
            for (corner, place), colour in zip(CORNERS.items(), (BLUE, ORANGE), strict=True):
                force = pair.force_at(result.nearest_node(place))[:, 0]
                values[local, corner] = force
                axes.plot(
                    increments, np.insert(force, 0, 0.0), color=colour,
                    linestyle=line, marker=mark, markersize=4, markerfacecolor="none",
                    label=f"{corner} ({place[0]:g}, {place[1]:g}, 0), {local.capitalize()}",
                )
    axes.axvline(turn, color=GRID, linestyle="--", linewidth=1.2)
    axes.annotate("down", (turn, 0), (-6, 6), textcoords="offset points", ha="right", color=INK)
    axes.annotate("sideways", (turn, 0), (6, 6), textcoords="offset points", color=INK)
    axes.set_xlim(0, increments[-1])
    axes.set_ylim(bottom=0)
    axes.set_xlabel("load step")
    axes.set_ylabel("normal contact force (N)")
    axes.legend(ncol=2, fontsize=8)
    save(figure, path)

    newton, uzawa = (
        np.array([values[local, corner] for corner in CORNERS]) for local in ("NEWTON", "UZAWA")
    )
    difference = np.abs(uzawa - newton).max() / newton.max()
    at_turn, last = (
        ", ".join(
            f"{corner} {force:.4f}" for corner, force in zip(CORNERS, newton[:, row], strict=True)
        )
        for row in (turn - 1, -1)
    )
    return (
        f"Normal contact forces of the corners F and H of the block ({n} x {n} x {n} elements) over"
        f" the load steps. Step {turn}: {at_turn} N; step {increments[-1]}: {last} N. The two local"
        f" solvers differ by {difference:.1e} of the largest force. A corner's force depends on the"
        " mesh: it is the share of one node."
    )


def figure_3(run, n, path):
    """Draw contact iterations over cumulative Newton-Raphson iterations; return the caption."""
    figure, axes = new_axes()
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    totals = []
    for name, parameters, colour, line in METHODS:
        with run(n=n, **COUNTED, **parameters) as result:
            sweeps = result.history("contact_iterations")
            local = result.history("local_iterations")
            newton_raphson = np.cumsum(result.history("newton_raphson_iterations"))
        axes.plot(newton_raphson, sweeps, line, color=colour, label=name, drawstyle="steps-pre")
        totals.append(f"{name}: {sweeps.sum()} ({local.sum()} local)")
    axes.set_xlim(0, newton_raphson[-1])
    axes.set_ylim(bottom=0)
    axes.set_xlabel("cumulative Newton-Raphson iterations")
    axes.set_ylabel("contact iterations (sweeps)")
    axes.legend(fontsize=8)
    save(figure, path)
    return (
        f"Sweeps over the contact points ({n} x {n} x {n} elements, bi-potential, ended by a"
        f" relative change of {COUNTED['tolerance']}) against cumulative Newton-Raphson iterations."
        f" Sweeps of the whole run: {'; '.join(totals)}. `rho` is a factor of its natural scale,"
        " 1 over the largest eigenvalue of the point's compliance."
    )


def show_block(runs, folder):
    """Pictures of the block on a finer mesh, by scripts/show; return their text."""
    result = runs("block", n=8, solver="AUTO", local="AUTO")
    show = ROOT / "scripts" / "show"
    text = []
    pictures = tempfile.TemporaryDirectory()
    command = [show, result.path, "-o", pictures.name, "--no-animation"]
    result.close()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    for name, caption in (
        (
            "deformed",
            "The block at the end of the push (8 x 8 x 8 elements, displacements to "
            "scale); grey is the ground.",
        ),
        ("pressure", "The contact pressure there."),
        (
            "contact",
            "Its lower face: points that stick, slide and have opened; arrows are friction.",
        ),
        ("forces", "Resultants over the time, and friction over normal force."),
    ):
        shutil.copy(Path(pictures.name) / f"{name}.png", folder)
        text += [f"![{name}](figures/{name}.png)", "", f"{caption} By `scripts/show`.", ""]
    pictures.cleanup()
    return text


def main():
    """Run the block, draw the figures and write the page of their captions."""
    parser = script_options(__doc__, PAGES, "the page and its figures go")
    parser.add_argument("-n", type=int, default=4, help="elements along an edge of the block (4)")
    options = parser.parse_args()
    text = ["# Figures of the paper", "", "Written by `studies/run paper`, numbers too.", ""]
    try:
        with fresh_runs(options.bipot) as runs:
            figures = options.folder / "figures"
            figures.mkdir(parents=True, exist_ok=True)
            draws = {2: figure_2, 3: figure_3}
            for number, draw in draws.items():
                path = figures / f"figure-{number}.png"
                caption = draw(partial(runs, "block"), options.n, path)
                text += [f"![Figure {number}](figures/{path.name})", ""]
                text += [f"Figure {number}. {caption}", ""]
            text += show_block(runs, figures)
            text += ["The runs:", "", *(f"    {command}" for command in runs.commands), ""]
            text += finite_strain(runs, draws, options.n, figures)
    except (ResultError, RunError, StudyError) as error:
        sys.exit(f"paper: {error}")
    (options.folder / "paper.md").write_text("\n".join(text).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
