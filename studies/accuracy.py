"""Measure what accuracy costs in three decks; write docs/studies/accuracy.md and its figures.

The runs are kept in build/accuracy by scripts/tradeoff, so that an interrupted study goes on
where it stopped. Every number of the page is read from them, and every sentence that states a
finding is checked against them. The program is built first: scripts/run builds it.
"""

import itertools
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.figures import new_axes, save
from bipot.program import ROOT, RunError, script_options
from bipot.report import machine, table
from bipot.result import ResultError
from bipot.tradeoff import (
    QUANTITIES,
    Study,
    TradeoffError,
    combinations,
    draw,
    measure,
    sentence,
    setting_name,
)
from studies.pages import PAGES, StudyError, claim

REPEAT = 3
ELEMENTS = ("C3D8", "C3D8I", "C3D8B")
TOLERANCES = ("1e-2", "1e-4", "1e-6", "1e-8", "1e-10")
AUTO = {"solver": "AUTO", "local": "AUTO"}
# The paper's two formulations and two local solvers, in sweeps.
PAPER = {
    f"{local.capitalize()} ({formulation.lower()})": {
        "solver": "SWEEPS", "formulation": formulation, "local": local,
    }
    for formulation in ("BIPOTENTIAL", "PSEUDOPOTENTIAL") for local in ("UZAWA", "NEWTON")
}
SOLVERS = {"AUTO": AUTO, **PAPER}


@dataclass(frozen=True)
class Case:
    """What is studied of a deck."""

    name: str
    title: str
    quantity: str  # whose error the figure shows
    base: dict
    meshes: tuple
    steps: tuple
    references: tuple  # one setting, or three to extrapolate from
    doubled: tuple  # two of the meshes, the second twice as fine

    def with_solver(self, solver, **more):
        """Return the base with another contact solver and more."""
        rest = {k: v for k, v in self.base.items() if k not in ("solver", "local")}
        return rest | SOLVERS[solver] | more

    def meshing(self):
        """Return the settings of mesh, steps and element."""
        varied = [("n", self.meshes), ("steps", self.steps), ("element", ELEMENTS)]
        return [self.base | setting for setting in combinations(varied)]

    def solving(self):
        """Return the settings of solver and tolerance on the base's mesh."""
        return [
            self.with_solver(solver, tolerance=tolerance)
            for solver in SOLVERS for tolerance in TOLERANCES
        ]

    def solvers_on_meshes(self):
        """Return the settings of the solvers over the meshes."""
        return [self.with_solver(solver, n=n) for solver in SOLVERS for n in self.meshes]

    def solving_shown(self):
        """Return those of `solving` whose errors the exact solution can still tell."""
        return [one for one in self.solving() if float(one["tolerance"]) > 1e-9]

    def exact(self):
        """Return the setting that shows what the tolerance leaves: the base's mesh, to 1e-10."""
        return self.base | {"tolerance": "1e-10"}


def setting(**parameters):
    """Return a setting with its values as text."""
    return {name: str(value) for name, value in parameters.items()}


BLOCK = Case(
    "block", "The paper's block", "resultant",
    setting(n=8, steps=50, element="C3D8", tolerance="1e-8", **AUTO),
    ("2", "4", "8", "16"), ("5", "20", "50", "100"),
    tuple(
        setting(n=n, steps=steps, element="C3D8B", tolerance="1e-8", **AUTO)
        for n, steps in ((6, 25), (12, 50), (24, 100))
    ),
    ("8", "16"),
)
PLATE = Case(
    "ssnv128", "Plate with friction (SSNV128)", "energy/strain",
    setting(n=32, steps=5, element="C3D8", tolerance="1e-8", thickness="0.00125", **AUTO),
    ("4", "8", "16", "32", "64"), ("1", "2", "5", "20"),
    tuple(
        setting(n=n, steps=steps, element="C3D8I", tolerance="1e-8", thickness="0.00125", **AUTO)
        for n, steps in ((32, 50), (64, 100), (128, 200))
    ),
    ("8", "16"),
)
SPENCE = Case(
    "spence", "A sphere pressed with friction (Spence)", "energy/strain",
    setting(n=16, steps=10, element="C3D8", tolerance="1e-8", **AUTO),
    ("6", "8", "12", "16"), ("2", "5", "10", "20"),
    (setting(n=32, steps=40, element="C3D8I", tolerance="1e-8", **AUTO),),
    ("8", "16"),
)
CASES = (BLOCK, PLATE, SPENCE)
SLOW = 2.0  # seconds: runs that take longer are not repeated, their times differ by little


class Measured:
    """The runs of a case, and their errors."""

    def __init__(self, case, program, folder):
        self.case = case
        self.study = Study(program, ROOT / "input" / f"{case.name}.inp", folder)

    def run(self):
        """Run what is missing."""
        case = self.case
        settings = {
            setting_name(one): one
            for one in (*case.meshing(), *case.solving(), *case.solvers_on_meshes())
        }
        for one in (*case.references, case.exact()):
            self.study.one_reference(one, case.quantity)
        self.study.complete(settings.values(), 1)
        quick = [
            one for one in settings.values()
            if all(float(row["seconds"] or 0) < SLOW for row in self.study.runs_of(one))
        ]
        self.study.complete(quick, REPEAT)

    def points(self, settings, quantity=None, references=None):
        """Return the points of settings, their errors those of a quantity."""
        quantity = quantity or self.case.quantity
        reference, _ = self.study.reference(references or self.case.references, quantity)
        return measure(self.study, settings, reference, quantity)

    def point(self, quantity=None, /, **changes):
        """Return the point of the base with these changes."""
        return self.points([self.case.base | setting(**changes)], quantity)[0]

    def solver(self, solver, **changes):
        """Return the point of the base with another contact solver and these changes."""
        return self.points([self.case.with_solver(solver, **setting(**changes))])[0]

    def left_by(self, solver, tolerance, quantity=None):
        """Return the error that a tolerance leaves: from the same mesh solved to 1e-10."""
        one = self.case.with_solver(solver, tolerance=tolerance)
        return self.points([one], quantity, [self.case.exact()])[0].error


def share(error):
    """Return an error in percent, with two digits."""
    return f"{100 * error:.2g} %" if error < 0.995 else f"{100 * error:.0f} %"


def factor(value):
    """Return a ratio of times or memories."""
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def knobs(measured):
    """Return the base and what differs from it by one knob: (words, setting)."""
    case = measured.case
    changed = [("", case.base)]
    for name, values in (
        ("n", case.meshes), ("steps", case.steps), ("element", ELEMENTS), ("tolerance", TOLERANCES)
    ):
        changed += [
            (f"{name} = {value}", case.base | {name: value})
            for value in values if value != case.base[name]
        ]
    return changed + [(solver, case.with_solver(solver)) for solver in PAPER]


def knob_table(measured):
    """Return the table of one knob at a time."""
    changed = knobs(measured)
    columns = [measured.points([one for _, one in changed], quantity) for quantity in QUANTITIES]
    base = columns[0][0]
    names = ("n", "steps", "element", "tolerance")
    start = ", ".join(f"{name} = {measured.case.base[name]}" for name in names)
    rows = []
    for (name, _), *points in zip(changed, *columns, strict=True):
        first = points[0]
        if first.outcome != "solved":
            rows.append([name, first.outcome, *[""] * (len(columns) + 1)])
            continue
        rows.append([
            name or f"**{start}**",
            factor(first.seconds / base.seconds), factor(first.memory / base.memory),
            *(share(point.error) for point in points),
        ])
    return [*table(["changed", "time", "memory", *QUANTITIES], rows), ""]


def solver_table(measured):
    """Return the times of the solvers over AUTO's, a column a mesh."""
    meshes = measured.case.meshes
    rows = []
    for solver in SOLVERS:
        cells = []
        for n in meshes:
            point, auto = measured.solver(solver, n=n), measured.solver("AUTO", n=n)
            solved = point.outcome == "solved"
            cells.append(factor(point.seconds / auto.seconds) if solved else point.outcome)
        rows.append([solver, *cells])
    return [*table(["", *(f"n = {n}" for n in meshes)], rows), ""]


def short(name):
    """Return a shorter name of a method for a legend."""
    for long, brief in (
        ("element=", ""), ("solver=AUTO, local=AUTO", "AUTO"), ("solver=SWEEPS, ", ""),
        ("local=UZAWA", "Uzawa"), ("local=NEWTON", "Newton"),
        ("formulation=PSEUDOPOTENTIAL", "pseudopotential"), ("formulation=BI", "bi"),
        ("POTENTIAL", "potential"),
    ):
        name = name.replace(long, brief)
    return name


def figure(measured, folder):
    """Draw error against time and memory over the meshes, and against time over the solvers."""
    case = measured.case
    drawn, (left, middle, right) = new_axes(3)
    drawn.set_size_inches(13, 4)
    meshing = measured.points(case.meshing())
    draw(left, meshing, "seconds", f"error of {case.quantity}")
    draw(middle, meshing, "memory", f"error of {case.quantity}")
    draw(
        right, measured.points(case.solving_shown(), references=[case.exact()]), "seconds",
        f"error left by the tolerance, n = {case.base['n']}",
    )
    for axes in (left, middle, right):
        handles, names = axes.get_legend_handles_labels()
        axes.legend(
            handles, [short(name) for name in names], fontsize=7, ncol=2, loc="lower left",
            bbox_to_anchor=(0, 1),
        )
    drawn.tight_layout()
    save(drawn, folder / f"accuracy-{case.name}.png")


# --- The page -------------------------------------------------------------------------------------


def steps_matter(measured, quantity):
    """Return the errors of a quantity with the fewest and the most increments."""
    few, many = measured.case.steps[0], measured.case.steps[-1]
    return measured.point(quantity, steps=few).error, measured.point(quantity, steps=many).error


def block_findings(measured):
    """Return the findings on the block."""
    base, finer = measured.point(), measured.point(n=16)
    better, incompatible = measured.point(element="C3D8B"), measured.point(element="C3D8I")
    few, many = steps_matter(measured, "resultant")
    fewest, most = measured.point(steps=5), measured.point(steps=100)
    loose = measured.left_by("AUTO", "1e-2", "friction")
    held = measured.point("friction").error
    left = measured.left_by("AUTO", "1e-4")
    times = {solver: measured.solver(solver, n=16).seconds for solver in PAPER}
    auto = measured.solver("AUTO", n=16).seconds
    cheap, dear = min(times.values()) / auto, max(times.values()) / auto
    best = measured.points([measured.case.base | setting(element="C3D8B", steps=5)])[0]
    return [
        claim(
            base.error > 1.3 * incompatible.error > 1.3 * better.error
            and better.seconds < 1.5 * base.seconds,
            f"- **The element is nearly free.** From C3D8 to C3D8I the error of the force goes from"
            f" {share(base.error)} to {share(incompatible.error)}, to C3D8B to"
            f" {share(better.error)}, in {factor(incompatible.seconds / base.seconds)} and"
            f" {factor(better.seconds / base.seconds)} times the time. The mesh that C3D8 needs"
            f" for as much, n = 16 with {share(finer.error)}, takes"
            f" {factor(finer.seconds / base.seconds)} times.",
        ),
        claim(
            abs(few - many) < 0.01 * many and fewest.seconds < 0.7 * base.seconds,
            f"- **More increments buy nothing here.** With 5 the force is as wrong as with 100"
            f" ({share(few)} and {share(many)}), in"
            f" {factor(fewest.seconds / most.seconds)} of the time. C3D8B with 5 increments has"
            f" {share(best.error)} in {factor(best.seconds / base.seconds)} of the base's time.",
        ),
        claim(
            left < 1e-4 and 0.1 * held < loose < held,
            f"- **A tolerance of 1e-4 is enough.** It leaves {left:.0e} of the force, far below"
            f" what the mesh does. 1e-2 changes the friction by {share(loose)}, of which the mesh"
            f" has {share(held)} wrong.",
        ),
        claim(
            cheap > 1.5,
            f"- **The paper's solvers reach the same error later**: on n = 16 they take"
            f" {factor(cheap)} to {factor(dear)} times as long as AUTO for the whole run. On n = 2"
            " it hardly matters.",
        ),
    ]


def plate_findings(measured):
    """Return the findings on the plate."""
    few, many = steps_matter(measured, "slip")
    spent, saved = steps_matter(measured, "energy/dissipation")
    loose = measured.left_by("AUTO", "1e-2", "slip")
    tight = measured.left_by("AUTO", "1e-4", "slip")
    slips = [measured.point("slip", n=n).error for n in measured.case.meshes]
    halves = [measured.point("resultant", n=n).error for n in measured.case.meshes]
    lost = [
        solver for solver in PAPER if measured.solver(solver, n=64).outcome == "not solved"
    ]
    return [
        claim(
            abs(few - many) < 0.01 * max(few, many),
            f"- **One increment is enough for forces and displacements** ({share(few)} of the slip"
            f" with 1, {share(many)} with 20): the load grows in proportion.",
        ),
        claim(
            spent > 0.9 and 0.04 < saved < 0.06,
            f"- **Not for the dissipated energy**: {share(spent)} with 1 increment,"
            f" {share(saved)} with 20, on any mesh. Friction counts with its value at the end of an"
            " increment ([theory](../theory.md), energy), so the error is one over the number of"
            " increments.",
        ),
        claim(
            max(slips) < 0.01,
            "- **Any mesh is fine enough for a benchmark that asks for 5 %**: the slip is wrong by"
            f" {', '.join(share(error) for error in slips)} for n ="
            f" {', '.join(measured.case.meshes)}. Not in order: errors of different sign cancel on"
            " some meshes.",
        ),
        claim(
            all(1.8 < a / b < 2.2 for a, b in itertools.pairwise(halves)),
            f"- **The normal force halves its error with the mesh size** ({share(halves[0])} with"
            f" n = 4, {share(halves[-1])} with n = 64), but only because the source holds one"
            " contact node in z, which takes its share of the load. What follows from"
            " equilibrium says nothing about accuracy: look at slips or energies.",
        ),
        claim(
            loose > 0.003 and tight < 1e-3,
            f"- **A tolerance of 1e-2 shows**: it leaves {share(loose)} of the slip on the same"
            f" mesh, 1e-4 {tight:.0e}.",
        ),
        claim(
            len(lost) == 3,
            f"- **Three of the paper's solvers do not solve n = 64**"
            f" ({', '.join(lost)}): after some 5000 sweeps without progress the run gives up.",
        ),
    ]


def spence_findings(measured):
    """Return the findings on the sphere."""
    few, many = steps_matter(measured, "energy/strain")
    spent, saved = steps_matter(measured, "energy/dissipation")
    meshes = measured.case.meshes
    erratic = [measured.point(n=n, element="C3D8I").error for n in meshes]
    forces = [measured.point("friction", n=n).error for n in meshes]
    loose = measured.left_by("AUTO", "1e-2")
    return [
        claim(
            min(erratic) == erratic[2] < erratic[3] / 2 and min(forces) == forces[0],
            "- **A small error can be chance.** The strain energy is wrong by"
            f" {', '.join(share(error) for error in erratic)} for n = {', '.join(meshes)} with"
            f" C3D8I, the friction by {', '.join(share(error) for error in forces)} with C3D8: the"
            " rim of the contact falls between nodes, now nearer to the one, now to the other. So"
            " the cheapest settings above are lucky ones. One mesh proves nothing; look at two.",
        ),
        claim(
            abs(few - many) < 0.1 * many and spent > 3 > 1 > saved,
            f"- **Increments decide about the dissipated energy alone**: wrong by {share(spent)}"
            f" with 2, by {share(saved)} with 20, and the reference's 40 are themselves too few for"
            f" it by a tenth or so. Strain energy ({share(few)} and {share(many)}) and forces"
            " hardly feel it. The stick radius does, up to 10 increments ([cases](cases.md)).",
        ),
        claim(
            loose < 1e-3,
            f"- **Even a tolerance of 1e-2 would do**: it leaves {loose:.0e} of the strain energy,"
            " most of which is not the contact's.",
        ),
    ]


def bought(before, after):
    """Return what a change does to error and time, in words."""
    if after.outcome != "solved":
        return after.outcome
    error = before.error / after.error
    # A change of the last digits is none.
    gained = "the same" if abs(error - 1) < 0.01 else f"÷ {factor(error)}"
    return f"{gained}, × {factor(after.seconds / before.seconds)}"


def summary(measured):
    """Return the table of what a turn of each knob buys, a column a case."""
    def turns(one):
        coarse, fine = (one.point(n=n) for n in one.case.doubled)
        few, many = one.point(steps=one.case.steps[0]), one.point(steps=one.case.steps[-1])
        spent = [
            one.point("energy/dissipation", steps=one.case.steps[place]) for place in (0, -1)
        ]
        base = one.point()
        sweeps = min(
            (one.solver(solver) for solver in PAPER),
            key=lambda point: point.seconds if point.outcome == "solved" else np.inf,
        )
        return {
            "mesh twice as fine": bought(coarse, fine),
            "C3D8I instead of C3D8": bought(base, one.point(element="C3D8I")),
            "C3D8B instead of C3D8": bought(base, one.point(element="C3D8B")),
            "increments": bought(few, many),
            "increments, dissipation": bought(*spent),
            "tolerance 1e-4 instead of 1e-2": bought(
                one.point(tolerance="1e-2"), one.point(tolerance="1e-4")
            ),
            "tolerance 1e-8 instead of 1e-4": bought(one.point(tolerance="1e-4"), base),
            "the fastest of the paper's solvers instead of AUTO": bought(base, sweeps),
        }

    columns = [turns(one) for one in measured]
    head = ["", *(f"{one.case.name}: {one.case.quantity}" for one in measured)]
    return [*table(head, [[name, *(c[name] for c in columns)] for name in columns[0]]), ""]


def section(measured, findings):
    """Return the section of a case."""
    case = measured.case
    base = measured.point()
    _, words = measured.study.reference(case.references, case.quantity)
    last = case.references[-1]
    given = f"n = {last['n']}, {last['steps']} increments, {last['element']}"
    note = ""
    if ", extrapolated by " in words:
        far = words.split(", extrapolated by ")[1]
        first = ", ".join(f"n = {one['n']}" for one in case.references)
        note = f", extrapolated over {first} with increments in proportion: by {far}"
    return [
        f"## {case.title}: `{case.name}.inp`", "",
        f"Errors of `{case.quantity}` in the figure, against {given}{note}. The table begins with"
        f" the setting that the others differ from by one thing; it takes {base.seconds:.2g} s and"
        f" {base.memory / 1e6:.0f} MB.", "",
        f"![{case.title}](figures/accuracy-{case.name}.png)", "",
        "Left and middle: all combinations of n, increments and element, by AUTO. Right: AUTO and"
        " the paper's four solvers with tolerances from 1e-2 to 1e-8 on one mesh,"
        " against its solution to 1e-10. Grey is dominated.", "",
        sentence(measured.points(case.meshing())), "",
        *knob_table(measured),
        *findings(measured), "",
        "Time over AUTO's, whole run, tolerance 1e-8:", "",
        *solver_table(measured),
    ]


def defaults(measured):
    """Return the section on the defaults."""
    left = max(one.left_by("AUTO", "1e-8") for one in measured)
    price = max(
        one.point().seconds / one.point(tolerance="1e-4").seconds for one in measured
    )
    slower = [
        one.solver(solver).seconds / one.point().seconds
        for one in measured for solver in PAPER if one.solver(solver).outcome == "solved"
    ]
    return [
        "## The defaults, and why", "",
        claim(
            left < 1e-7 and price < 1.6,
            f"- `TOLERANCE=1e-8`: leaves at most {left:.0e} here, nothing beside any mesh, and"
            f" costs at most {factor(price)} times what 1e-4 costs. 1e-4 would do; the margin is"
            " for the certificate, which judges every point, not sums.",
        ),
        claim(
            min(slower) > 1.05,
            f"- `SOLVER=AUTO`: on the three meshes of the tables the paper's solvers take"
            f" {factor(min(slower))} to {factor(max(slower))} times as long, to the same"
            " error.",
        ),
        "- The element is the deck's, and so are mesh and increments: the program has no default"
        " for them. The decks say C3D8, as the sources do; for your own, C3D8I is the better start"
        " (and in bending far better: [cases](cases.md)).",
    ]


def page(measured):
    """Return the page."""
    rows = [row for one in measured for row in one.study.rows]
    spent = sum(float(row["seconds"] or 0) for row in rows) / 60
    quantities = ", ".join(f"`{name}`" for name in QUANTITIES)
    block, plate, sphere = measured
    return [
        "# Speed against accuracy", "",
        "What a result costs and how wrong it is, measured in three decks: mesh, increments,"
        " element, tolerance, and the solvers, those of the paper among them. Written by"
        " `studies/run accuracy`, numbers too; it does not write a finding that the runs do"
        " not bear out. The same for a deck of yours:", "",
        "    scripts/tradeoff.py input/block.inp --reference n=24,solver=AUTO,local=AUTO \\",
        "        --vary n=2,4,8,16 --vary tolerance=1e-2,1e-4,1e-8 --also solver=AUTO,local=AUTO",
        "",
        "It runs what is missing, keeps every run (Ctrl-C and go on later), prints a table and the"
        " cheapest settings, and draws work-precision diagrams. `--help` says the rest.", "",
        f"**Error**: largest difference from the reference over contact pairs and ends of steps,"
        f" relative to the largest value, of {quantities}: force vectors of the contact, sum of"
        " the friction forces' magnitudes, mean slip of the contact surface, and two energies."
        " **Time**: processor time of one thread without reading the deck and writing the result,"
        f" median of {REPEAT} runs ({SLOW:g} s and more: one run); a tenth or two are chance."
        " **Memory**: the most that the run ever had.", "",
        "## What a turn of each knob buys", "",
        "Error divided by, time multiplied by:", "",
        *summary(measured),
        f"Increments: {', '.join(steps_words(one) for one in measured)}.", "",
        *short_findings(measured), "",
        *section(block, block_findings),
        *section(plate, plate_findings),
        *section(sphere, spence_findings),
        *defaults(measured), "",
        "## What was run", "",
        f"{len(rows)} runs, {spent:.0f} minutes of processor time, one BLAS thread, on a shared"
        f" {machine()}: times to compare, not to quote.",
    ]


def steps_words(measured):
    """Return the increments that the summary compares."""
    return f"{measured.case.steps[0]} and {measured.case.steps[-1]} (`{measured.case.name}`)"


def short_findings(measured):
    """Return what follows from all three cases."""
    block, _, sphere = measured
    gains = [one.point().error / one.point(element="C3D8I").error for one in measured]
    dearest = max(one.point(element="C3D8I").seconds / one.point().seconds for one in measured)
    finer = [
        one.point(n=one.case.doubled[0]).error / one.point(n=one.case.doubled[1]).error
        for one in measured
    ]
    change = max(
        abs(np.subtract(*steps_matter(one, quantity)))
        for one in measured for quantity in QUANTITIES if quantity != "energy/dissipation"
    )
    prices = [
        one.point(n=one.case.doubled[1]).seconds / one.point(n=one.case.doubled[0]).seconds
        for one in (block, sphere)
    ]
    tight = [one.left_by("AUTO", "1e-4") for one in measured]
    shares = [left / one.point().error for left, one in zip(tight, measured, strict=True)]
    loose = max(
        one.left_by("AUTO", "1e-2", quantity)
        for one in measured for quantity in ("friction", "slip")
    )
    memories = [
        point.memory / one.point().memory for one in measured
        for point in one.points([setting for name, setting in knobs(one) if "n =" not in name])
        if point.outcome == "solved"
    ]
    return [
        claim(
            min(gains) > 1.3 and dearest < 1.3,
            f"- **Most accuracy for a second: the element.** C3D8I instead of C3D8 divides the"
            f" error by {factor(min(gains))} to {factor(max(gains))}, in at most"
            f" {factor(dearest)} times the time.",
        ),
        claim(
            min(prices) > 5 and min(finer) > 1.5,
            f"- **Then the mesh**: half the size divides the error by {factor(min(finer))} to"
            f" {factor(max(finer))} and takes, in three dimensions, {factor(min(prices))} to"
            f" {factor(max(prices))} times as long. It is also all that memory depends on"
            f" ({factor(min(memories))} to {factor(max(memories))} times, whatever else is"
            " changed).",
        ),
        claim(
            change < 0.02,
            "- **Increments pay only where the way is asked for**: for the dissipated energy of"
            " plate and sphere, and where contact spreads, for the stick zone. The errors of"
            f" forces, slip and strain energy change by at most {share(change)} between the fewest"
            " and the most.",
        ),
        claim(
            max(shares) < 0.1,
            f"- **A tolerance below 1e-4 never pays**: 1e-4 leaves at most {max(tight):.0e}, and"
            f" nowhere more than {share(max(shares))} of the error that the mesh makes. It does not"
            f" cost much either. 1e-2 leaves up to {share(loose)} of friction and slip.",
        ),
        "- **Another solver than AUTO never pays**: all come to the same errors, the paper's four"
        " later, and not everywhere.",
    ]


def main():
    """Run what is missing, draw the figures and write the page."""
    parser = script_options(__doc__, PAGES, "the page and its figures go")
    parser.add_argument(
        "--runs", type=Path, default=ROOT / "build" / "accuracy", help="where the runs are kept"
    )
    options = parser.parse_args()
    try:
        measured = [Measured(case, options.bipot, options.runs) for case in CASES]
        for one in measured:
            print(one.case.name, file=sys.stderr, flush=True)
            one.run()
        figures = options.folder / "figures"
        figures.mkdir(parents=True, exist_ok=True)
        for one in measured:
            figure(one, figures)
        path = options.folder / "accuracy.md"
        path.write_text("\n".join(page(measured)) + "\n", encoding="utf-8")
        print(path)
    except (TradeoffError, RunError, ResultError, StudyError) as error:
        sys.exit(f"accuracy: {error}")
    except KeyboardInterrupt:
        sys.exit("accuracy: stopped; the same command goes on from here")


if __name__ == "__main__":
    main()
