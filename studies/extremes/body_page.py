"""The part of docs/studies/extremes.md on bodies that touch each other."""

import numpy as np

from bipot.report import table
from studies.extremes.body_runs import (
    BROKEN,
    OPEN_RUN,
    OUTCOMES,
    REFUSED,
    REFUTED_RUN,
    RIGHT,
    WRONG,
)

HEAD = "## Bodies that touch each other"


def bodies_lines(outcomes, seconds):
    """Return the lines of the section for the outcomes of all plans."""
    count = {kind: [one for one in outcomes if one.outcome == kind] for kind in OUTCOMES}
    right = count[RIGHT]
    compared = [one for one in right if one.compared]
    lines = [
        HEAD,
        "",
        f"{len(outcomes)} small scenes of two or three deformable bodies, by AUTO, in five systems "
        "of units in turn; every scene twice, either body (of three, the middle one or the others) "
        "as the slave; one in all units. Each is run by the program and judged by the second "
        "finite-element program of `tests/judge`, which shares no code with it: from displacements "
        "and reactions of every increment it finds places, weights, gaps, normals and slips by its "
        "own integrals, balances every node and every body, and checks the laws of contact. It "
        "then solves the increments itself, with dense matrices, from where the program's began.",
        "",
        f"- **{RIGHT}**: exit status 0, and right by every law, to twice what the program allows "
        "itself;",
        f"- **{REFUSED}**: exit status 1 or 2, a message that names the cause, and confirmed by "
        "other means: that nothing balances the loads, that contact lies between the nodes, that "
        "double precision holds no solution;",
        f"- **{REFUTED_RUN}**: refused in this way, though the scene has a solution;",
        f"- **{OPEN_RUN}**: refused, and neither confirmed nor refuted;",
        f"- **{WRONG}**: exit status 0, and wrong;",
        f"- **{BROKEN}**: a crash, no end, a message without a cause, a result that cannot be "
        "read.",
        "",
    ]
    rows = []
    axes = list(dict.fromkeys(one.axis for one in outcomes))
    for axis in axes:
        mine = [one.outcome for one in outcomes if one.axis == axis]
        rows.append([axis, len(mine), *(mine.count(kind) for kind in OUTCOMES)])
    rows.append(["all", len(outcomes), *(len(count[kind]) for kind in OUTCOMES)])
    lines += table(["", "scenes", *OUTCOMES], rows)
    worst = max(right, key=lambda one: one.error)
    most = max(right, key=lambda one: one.placements)
    longest = max(right, key=lambda one: one.iterations)
    apart = max(compared, key=lambda one: one.apart)
    by_force = max(compared, key=lambda one: one.forces_apart)
    lines += [
        "",
        f"Of what is allowed, the worst error that the judge found in a right result is "
        f"{worst.error:.2g} ({worst.name}: {worst.worst}). Placements are at most "
        f"{most.placements} an increment ({most.name}), iterations of contact at most "
        f"{longest.iterations} ({longest.name}). The judge solved "
        f"{sum(one.compared for one in right)} of the {sum(one.increments for one in right)} "
        f"increments itself: its displacements are within {apart.apart:.1e} of the largest "
        f"({apart.name}; where nothing keeps a body from rolling on its edge mechanics leaves open "
        f"how it lies), its forces within {by_force.forces_apart:.1e} ({by_force.name}), in the "
        f"middle of the scenes {np.median([one.forces_apart for one in compared]):.0e}. All runs "
        f"and the judge took {seconds:.0f} s.",
        "",
    ]
    lines += refusals(outcomes)
    lines += findings(outcomes)
    lines += ["### All scenes of bodies", ""]
    lines += [
        "Error: the worst that the judge found, of what is allowed. Iterations: of contact, the "
        "most in an increment. Placements: the most in an increment. Difference from the judge's "
        "own solutions: of displacements and of forces, beside the largest.",
        "",
    ]
    heads = ["scene", "what is extreme", "slave", "units", "outcome", "error", "iterations",
             "placements", "displacements", "forces"]  # fmt: skip
    lines += table(heads, [row_of(one) for one in outcomes])
    return [*lines, ""]


def row_of(one):
    """The row of one scene."""
    own = [f"{one.apart:.1e}", f"{one.forces_apart:.1e}"] if one.compared else ["", ""]
    name = one.name.removesuffix("-upper").removesuffix("-lower")
    numbers = [""] * 5
    if one.outcome == RIGHT:
        numbers = [f"{one.error:.1e}", one.iterations, one.placements, *own]
    outcome = one.outcome if one.outcome == RIGHT else f"**{one.outcome}**"
    return [name, one.extreme, slave_of(one), one.units, outcome, *numbers]


def slave_of(one):
    """Which body is the slave, in words."""
    if len(one.slaves) == 1:
        return one.slaves[0]
    return "middle" if one.slaves[0] == "upper" else "lower, upper"


def refusals(outcomes):
    """The table of what was refused."""
    refused = [one for one in outcomes if one.outcome in (REFUSED, REFUTED_RUN, OPEN_RUN)]
    rows = [
        [one.name, one.words.replace("|", "/"), one.outcome, one.confirmed.replace("|", "/")]
        for one in refused
    ]
    lines = ["### What is refused", ""]
    return [*lines, *table(["scene", "what the program says", "", "by the judge"], rows), ""]


def findings(outcomes):
    """What is wrong, or right by the laws alone."""
    lines = []
    failed = [one for one in outcomes if one.outcome in (WRONG, BROKEN)]
    if failed:
        lines += ["### What failed", ""]
        lines += table(["scene", "", ""], [[o.name, o.outcome, o.words] for o in failed])
        lines += [""]
    unfelt = [one for one in outcomes if one.unfelt > 0]
    if unfelt:
        lines += [
            "### Right by the laws alone",
            "",
            "Faces that overlap between their nodes where nothing presses, of the largest "
            "displacement:",
            "",
        ]
        rows = [[one.name, one.extreme, f"{one.unfelt:.1e}"] for one in unfelt]
        lines += [*table(["scene", "what is extreme", "overlap"], rows), ""]
    return lines
