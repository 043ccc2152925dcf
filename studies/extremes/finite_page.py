"""The part of docs/studies/extremes.md on finite strain."""

from bipot.report import table
from studies.extremes.finite_runs import (
    BROKEN,
    HINDERED,
    OUTCOMES,
    REFUSED,
    RIGHT,
    WRONG,
)

HEAD = "## At finite strain"
ROW = ["scene", "what is extreme", "true by", "outcome", "error", "increments", "iterations",
       "s"]  # fmt: skip


def finite_lines(outcomes):
    """Return the lines of the section for the outcomes of all scenes."""
    count = {kind: [one for one in outcomes if one.outcome == kind] for kind in OUTCOMES}
    right = count[RIGHT]
    seconds = sum(one.seconds for one in outcomes)
    longest = max(right, key=lambda one: one.iterations / one.increments)
    slowest = max(outcomes, key=lambda one: one.seconds)
    worst = max(right, key=lambda one: one.error / one.scene.allowed)
    lines = [
        HEAD,
        "",
        f"{len(outcomes)} small scenes with `NLGEOM`, each with something that is known to be true "
        "of it: a closed form of the law, a symmetry (other units, another place, another "
        "direction, more increments), supports in the place of contact that sticks, or Coulomb's "
        "law of the whole. The laws are written anew in `studies/extremes/finite_scenes.py`.",
        "",
        "    studies/run extremes --family finite",
        "",
        f"- **{RIGHT}**: exit status 0, and no further from what is true than 1e-6 of the largest "
        "number compared (1e-7 for most symmetries);",
        f"- **{REFUSED}**: exit status 2, with the reason for which the scene has no solution;",
        f"- **{HINDERED}**: refused, though it has one;",
        f"- **{WRONG}**: exit status 0, and wrong;",
        f"- **{BROKEN}**: a crash, no end, a result that cannot be read.",
        "",
    ]
    lines += count_table(outcomes)
    lines += [
        "",
        f"The largest error, of what is allowed, is {worst.error / worst.scene.allowed:.1g} "
        f"({worst.scene.name}). Most iterations an increment: "
        f"{longest.iterations / longest.increments:.0f} ({longest.scene.name}). All runs took "
        f"{seconds:.0f} s of the processor, the longest {slowest.seconds:.1f} s "
        f"({slowest.scene.name}).",
        "",
    ]
    lines += refusal_table(outcomes)
    for one in count[WRONG] + count[BROKEN]:
        lines += [f"{one.scene.name} is {one.outcome}: {one.words}", ""]
    lines += table(ROW, [row_of(one) for one in outcomes])
    return [*lines, ""]


def count_table(outcomes):
    """Return a table of the outcomes of each axis."""
    rows = []
    for axis in [*dict.fromkeys(one.scene.axis for one in outcomes), "all"]:
        mine = [one for one in outcomes if axis in (one.scene.axis, "all")]
        kinds = [sum(one.outcome == kind for one in mine) for kind in OUTCOMES]
        largest = max([0.0, *(one.error for one in mine if one.outcome in (RIGHT, WRONG))])
        rows.append([axis, len(mine), *kinds, f"{largest:.1e}"])
    return table(["", "scenes", *OUTCOMES, "largest error"], rows)


def refusal_table(outcomes):
    """Return a table of what is refused, and why, with an empty line behind it."""
    rows = [
        [one.scene.name, one.words.replace("|", "/"), one.scene.reason or "none is known"]
        for kind in (REFUSED, HINDERED) for one in outcomes if one.outcome == kind
    ]  # fmt: skip
    if not rows:
        return []
    return [*table(["refused", "what the program says", "why that is right"], rows), ""]


def row_of(one):
    """Return the row of one scene."""
    source = one.scene.source
    if isinstance(one.scene.true, str):
        source = f"{one.scene.true}: {source}"
    outcome = one.outcome if one.outcome == RIGHT else f"**{one.outcome}**"
    error = f"{one.error:.1e}" if one.outcome in (RIGHT, WRONG) else ""
    counts = [one.increments, one.iterations, f"{one.seconds:.2f}"]
    return [one.scene.name, one.scene.extreme, source, outcome, error, *counts]
