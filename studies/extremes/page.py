"""The page of the matrix of extremes, docs/studies/extremes.md, and its figure."""

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from bipot.figures import BLUE, GREEN, INK, ORANGE, RED, new_axes, save
from bipot.report import table
from studies.extremes.judge import CERTIFIED, DIAGNOSED, FAILED, FALLBACK
from studies.two_answers import HEADS
from studies.two_answers import rows as rows_of_answers

OUTCOMES = (CERTIFIED, FALLBACK, DIAGNOSED, FAILED)
LETTER = {CERTIFIED: "c", FALLBACK: "f", DIAGNOSED: "**d**", FAILED: "**X**"}
COLOURS = (GREEN, BLUE, ORANGE, RED)


def axes_of(outcomes):
    """The axes in the order of the matrix, each with the names of its scenes."""
    found = {}
    for one in outcomes:
        names = found.setdefault(one.axis, [])
        if one.scene not in names:
            names.append(one.scene)
    return found


def draw_map(outcomes, solvers, path):
    """Draw a cell a run: solvers upwards, scenes along, the axes named below."""
    axes = axes_of(outcomes)
    scenes = [name for names in axes.values() for name in names]
    cells = np.zeros((len(solvers), len(scenes)))
    for one in outcomes:
        cells[solvers.index(one.solver), scenes.index(one.scene)] = OUTCOMES.index(one.outcome)
    figure, plot = new_axes()
    figure.set_size_inches(13, 3.2)
    plot.pcolormesh(
        cells, cmap=ListedColormap(COLOURS), vmin=-0.5, vmax=3.5, edgecolors="white", linewidth=0.3
    )
    plot.set_yticks(np.arange(len(solvers)) + 0.5, solvers)
    plot.invert_yaxis()
    ends = np.cumsum([len(names) for names in axes.values()])
    starts = ends - [len(names) for names in axes.values()]
    plot.set_xticks((starts + ends) / 2, list(axes), rotation=40, ha="right", fontsize=8)
    for end in ends[:-1]:
        plot.axvline(end, color=INK, linewidth=0.8)
    plot.tick_params(length=0)
    plot.grid(False)
    plot.spines[:].set_visible(False)
    plot.legend(
        [Patch(color=colour) for colour in COLOURS],
        OUTCOMES,
        ncols=4,
        loc="lower left",
        bbox_to_anchor=(0, 1.0),
    )
    save(figure, path)


def good(outcomes):
    """How many were solved and certified."""
    return sum(one.outcome in (CERTIFIED, FALLBACK) for one in outcomes)


def put_section(page, head, lines):
    """Put the lines of a section in the place of the one that a page has, or at its end."""
    before, _, after = page.read_text(encoding="utf-8").partition(f"{head}\n")
    rest = after.find("\n## ") + 1
    after = after[rest:] if rest else ""
    page.write_text(
        "\n".join([before.rstrip(), "", *lines[:-1], *([""] * bool(after))]) + "\n" + after,
        encoding="utf-8",
    )
    print(page)


def write_page(outcomes, solvers, confirmed, answers, seconds, sections, path):
    """Write the page.

    `confirmed` is, by scene, what the check of AUTO's refusals found; `answers` are those of an
    increment that has several (two_answers.py), `sections` the lines of those on bodies that touch
    each other (body_page.py), on finite strain (finite_page.py) on types (type_page.py) and on
    plane bodies (plane_page.py).
    """
    axes = axes_of(outcomes)
    by = {(one.scene, one.solver): one for one in outcomes}
    auto = [one for one in outcomes if one.solver == "AUTO"]
    failed = [one for one in outcomes if one.outcome == FAILED]
    refused = [one for one in auto if one.outcome == DIAGNOSED]
    lines = [
        "# At the extremes",
        "",
        f"{len(auto)} small scenes, each extreme in one or two respects, solved by AUTO and by the "
        "paper's four solvers (sweeps with rho at its natural scale unless the scene says "
        "otherwise); as many of [bodies that touch each other](#bodies-that-touch-each-other); "
        "scenes [at finite strain](#at-finite-strain); of [tetrahedra, wedges and second order]"
        "(#tetrahedra-wedges-and-second-order); and of [plane bodies, bolts, and what changes]"
        "(#plane-bodies-bolts-and-what-changes). Written by a script, numbers too:",
        "",
        "    studies/run extremes",
        "",
        "Every run is judged from its result file and the scene's own numbers alone: internal "
        "forces from the displacements in extended precision, gaps and slips from the obstacles, "
        "Signorini's and Coulomb's laws, balance with loads and supports, every number finite. "
        "What the program says of its own certificate does not count.",
        "",
        "- **certified** (c): exit status 0, every increment there, and all of that holds to twice "
        "what the program allows itself (10 times the tolerance, 1e-8 unless the scene asks for "
        "another);",
        "- **fallback** (f): the same, after AUTO's first solver gave up in some increment;",
        "- **diagnosed** (d): exit status 1 or 2, and a message that names the cause, with the "
        "best residual where one was sought;",
        "- **failed** (X): a wrong result, a crash, no end within the time limit, a number that is "
        "none, another exit status.",
        "",
        "![A column a scene, a row a solver](figures/extremes.png)",
        "",
    ]
    rows = []
    for solver in solvers:
        mine = [one for one in outcomes if one.solver == solver]
        counts = [sum(one.outcome == kind for one in mine) for kind in OUTCOMES]
        rows.append([solver, len(mine), *counts, f"{100 * good(mine) / len(mine):.1f} %"])
    lines += table(["solver", "scenes", *OUTCOMES, "solved"], rows)
    lines += ["", f"{len(outcomes)} runs in {seconds:.0f} s. "]
    lines[-1] += "No run failed." if not failed else f"{len(failed)} runs failed."
    worst = np.nanmax([one.error for one in auto])
    lines[-1] += f" The largest error found in a result of AUTO is {worst:.2g} of what is allowed."
    lines += ["", "## Where each solver works", "", "Scenes solved of those of each kind:", ""]
    rows = []
    for axis, names in axes.items():
        cells = [f"{good([by[name, solver] for name in names])}" for solver in solvers]
        rows.append([axis, len(names), *cells])
    lines += table(["", "scenes", *solvers], rows)
    lines += ["", "## What AUTO refuses", ""]
    lines += [
        "Each refusal was checked by other means (`studies/extremes/confirm.py`): whether any "
        "reactions in their cones balance the loads, by linear programming; how many digits the "
        "stiffness and the stored displacements leave in double precision, by dense matrices. "
        "`no` means that others solve what AUTO does not.",
        "",
    ]
    rows = []
    for one in refused:
        right, words = confirmed[one.scene]
        rows.append([one.scene, one.words.replace("|", "/"), "yes" if right else "no", words])
    lines += table(["scene", "what the program says", "confirmed", "by"], rows)
    lines += ["", "## An increment with two answers", ""]
    lines += [
        "With much friction Coulomb's law may have several solutions: a point alone loses "
        "uniqueness at mu = W_nn/|W_nt|, 2.07 on the block with n = 4. At mu = 10 its increment 48 "
        "has at least two. `studies/run two_answers` finds them by a Newton method of its own from "
        "random reactions on the exported problem; each satisfies the law to the residual given. "
        "The program takes the first, which continues the increment before, and certifies it: a "
        "certificate says that an answer is one, not that it is the only one.",
        "",
    ]
    lines += table(HEADS, rows_of_answers(answers))
    if failed:
        lines += ["", "## What failed", ""]
        lines += table(["scene", "solver", ""], [[o.scene, o.solver, o.words] for o in failed])
    lines += ["", "## All scenes", ""]
    rows = []
    for axis, names in axes.items():
        for name in names:
            cells = [LETTER[by[name, solver].outcome] for solver in solvers]
            rows.append([axis, name, *cells])
    lines += table(["", "scene", *solvers], rows)
    lines += ["", *sections[:-1]]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(path)
