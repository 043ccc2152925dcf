"""The part of docs/studies/extremes.md on tetrahedra, wedges and elements of second order."""

from bipot.report import table
from studies.extremes.finite_page import count_table, refusal_table, row_of
from studies.extremes.finite_runs import BROKEN, HINDERED, REFUSED, RIGHT, WRONG

HEAD = "## Tetrahedra, wedges and second order"
ROW = ["scene", "what is extreme", "true by", "outcome", "error"]


def type_lines(outcomes):
    """Return the lines of the section for the outcomes of all scenes."""
    right = [one for one in outcomes if one.outcome == RIGHT]
    worst = max(right, key=lambda one: one.error / one.scene.allowed)
    slowest = max(outcomes, key=lambda one: one.seconds)
    lines = [
        HEAD,
        "",
        f"{len(outcomes)} small scenes of `C3D4`, `C3D6`, `C3D10`, `C3D15`, `C3D20` and `C3D20R`, "
        "at small strain, each with something that is known to be true of it: uniform stress, "
        "springs in a row, a symmetry (other units, another place, another direction), supports in "
        "the place of contact that sticks, Coulomb's law of the whole, or a balance.",
        "",
        "    studies/run extremes --family types",
        "",
        f"- **{RIGHT}**: exit status 0, and no further from what is true than 1e-6 of the largest "
        "number compared, unless the scene in `studies/extremes/type_scenes.py` says otherwise;",
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
        "Where mid-side nodes of straight edges are off their middles, `C3D10` and `C3D20R` carry "
        "the load but no even stress: their 4 and 8 points do not integrate the forces of such an "
        "element exactly, while those of `C3D15` and `C3D20` do. With all of them at 0.27 of their "
        "edges the pressures are off by 2 % and 12 %. Mesh generators put them in the middle.",
        "",
        *refusal_table(outcomes),
    ]
    for one in outcomes:
        if one.outcome in (WRONG, BROKEN):
            lines += [f"{one.scene.name} is {one.outcome}: {one.words}", ""]
    lines += table(ROW, [row_of(one)[: len(ROW)] for one in outcomes])
    return [*lines, ""]
