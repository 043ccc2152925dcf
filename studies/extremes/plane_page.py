"""The part of docs/studies/extremes.md on elements of a plane, bolts, and what changes."""

from bipot.report import table
from studies.extremes.finite_page import count_table, refusal_table, row_of
from studies.extremes.finite_runs import BROKEN, HINDERED, REFUSED, RIGHT, WRONG

HEAD = "## Plane bodies, bolts, and what changes"
ROW = ["scene", "what is extreme", "true by", "outcome", "error"]


def plane_lines(outcomes):
    """Return the lines of the section for the outcomes of all scenes."""
    right = [one for one in outcomes if one.outcome == RIGHT]
    worst = max(right, key=lambda one: one.error / one.scene.allowed)
    slowest = max(outcomes, key=lambda one: one.seconds)
    lines = [
        HEAD,
        "",
        f"{len(outcomes)} small scenes of plane strain (`CPE`) and axisymmetric elements (`CAX`), "
        "of sections of bolts, of friction and pairs that change from step to step, and of loads "
        "that come late, each with something that is known to be true of it: uniform stress, "
        "springs in a row, a press fit, a symmetry (other units, another place, in proportion), "
        "supports where contact sticks, or Coulomb's law of the whole.",
        "",
        "    studies/run extremes --family plane",
        "",
        f"- **{RIGHT}**: exit status 0, and no further from what is true than the scene in "
        "`studies/extremes/plane_scenes.py` says, mostly 1e-6 of the largest number compared "
        "(wedges of bodies of revolution, whose sides are chords, 1e-4);",
        f"- **{REFUSED}**: exit status 1 or 2, with the reason that is known of the scene;",
        f"- **{HINDERED}**: refused without a known reason;",
        f"- **{WRONG}**: exit status 0, and wrong;",
        f"- **{BROKEN}**: a crash, no end, a result that cannot be read.",
        "",
        *count_table(outcomes),
        "",
        f"The largest error, of what is allowed, is {worst.error / worst.scene.allowed:.1g} "
        f"({worst.scene.name}). All runs took {sum(one.seconds for one in outcomes):.0f} s of the "
        f"processor, the longest {slowest.seconds:.1f} s ({slowest.scene.name}).",
        "",
        *refusal_table(outcomes),
    ]
    for one in outcomes:
        if one.outcome in (WRONG, BROKEN):
            lines += [f"{one.scene.name} is {one.outcome}: {one.words}", ""]
    lines += table(ROW, [row_of(one)[: len(ROW)] for one in outcomes])
    return [*lines, ""]
