#!/usr/bin/python3
"""Measure what accuracy costs in three decks; write docs/accuracy.md and its figures.

The runs are kept in build/accuracy by scripts/tradeoff.py, so that an interrupted study goes on
where it stopped. Every number of the page is read from them, and every sentence that states a
finding is checked against them. The program is built first: scripts/run builds it.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

try:
    import numpy as np

    from bipot_result import ResultError
    from block_runs import ROOT, RunError, new_axes, save, script_options
    from study_solvers import StudyError, claim, machine
    from study_solvers import table as table_lines
    from tradeoff import (
        QUANTITIES,
        Study,
        TradeoffError,
        combinations,
        draw,
        measure,
        sentence,
        setting_name,
    )
except ImportError as error:
    sys.exit(
        f"figures_accuracy: {error};"
        " on Debian: apt-get install python3-numpy python3-h5py python3-matplotlib"
    )

REPEAT = 3
ELEMENTS = ("C3D8", "C3D8I", "C3D8B")
TOLERANCES = ("1e-2", "1e-4", "1e-6", "1e-8", "1e-10")
AUTO = {"solver": "AUTO", "local": "AUTO"}
# The paper's two formulations and two local solvers, in sweeps.
PAPER = {
    f"{formulation.lower()}, {local.capitalize()}": {
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

    def exact(self):
        """Return the setting that shows what the tolerance leaves: the base's mesh, to 1e-12."""
        return self.base | {"tolerance": "1e-12"}


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
)
PLATE = Case(
    "ssnv128", "Plate with friction (SSNV128)", "slip",
    setting(n=32, steps=5, element="C3D8", tolerance="1e-8", thickness="0.00125", **AUTO),
    ("4", "8", "16", "32", "64"), ("1", "2", "5", "20"),
    tuple(
        setting(n=n, steps=steps, element="C3D8", tolerance="1e-8", thickness="0.00125", **AUTO)
        for n, steps in ((32, 50), (64, 100), (128, 200))
    ),
)
SPENCE = Case(
    "spence", "A sphere pressed with friction (Spence)", "friction",
    setting(n=12, steps=10, element="C3D8", tolerance="1e-8", **AUTO),
    ("6", "8", "12", "16"), ("2", "5", "10", "20"),
    (setting(n=32, steps=40, element="C3D8I", tolerance="1e-8", **AUTO),),
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

    def left_by(self, solver, tolerance):
        """Return the error that a tolerance leaves: from the same mesh solved to 1e-12."""
        one = self.case.with_solver(solver, tolerance=tolerance)
        return self.points([one], references=[self.case.exact()])[0].error


def share(error):
    """Return an error in percent."""
    return f"{100 * error:.2g} %"


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
    words = ("n", "steps", "element", "tolerance")
    rows = []
    for (name, _), *points in zip(changed, *columns, strict=True):
        first = points[0]
        if first.outcome != "solved":
            rows.append([name, first.outcome, *[""] * (len(columns) + 1)])
            continue
        rows.append([
            name or "**" + ", ".join(f"{word} = {measured.case.base[word]}" for word in words) + "**",
            factor(first.seconds / base.seconds), factor(first.memory / base.memory),
            *(share(point.error) for point in points),
        ])
    return table_lines(["changed", "time", "memory", *QUANTITIES], rows)


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
    return table_lines(["", *(f"n = {n}" for n in meshes)], rows)


def short(name):
    """Return a shorter name of a method for a legend."""
    for long, brief in (
        ("element=", ""), ("solver=AUTO, local=AUTO", "AUTO"), ("solver=SWEEPS, ", ""),
        ("local=", ""), ("formulation=", ""),
    ):
        name = name.replace(long, brief)
    return name.lower() if "POTENTIAL" in name else name


def figure(measured, folder):
    """Draw error against time and memory over the meshes, and against time over the solvers."""
    case = measured.case
    drawn, (left, middle, right) = new_axes(3)
    drawn.set_size_inches(13, 4)
    meshing = measured.points(case.meshing())
    draw(left, meshing, "seconds", f"error of {case.quantity}")
    draw(middle, meshing, "memory", f"error of {case.quantity}")
    draw(
        right, measured.points(case.solving(), references=[case.exact()]), "seconds",
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
