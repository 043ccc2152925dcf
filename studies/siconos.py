"""Bipot beside Siconos on the same frictional contact problems, by one definition of the residual.

    studies/run siconos [--n 8,16] [--steps 1,15,30] [-o docs/studies] [PROBLEM.hdf5 ...]
    studies/run siconos --page

The problems are the FCLIB files named, and the condensed problems of the paper's block that bipot
exports. Each is solved as it is and scaled (largest entries of W and q are 1): Siconos' stopping
test has units. Both programs start from 0 and get the same file, one thread and the same kernels of
OpenBLAS. The time is the processor's in the solver, with what it prepares from W, without reading
and writing; the best of three runs. The residual is the scaled natural map, docs/theory.md (5.2),
computed here from the reactions each program wrote. Where Siconos stops before that residual is
reached, its tolerance is lowered; what it says of itself tells to what.

All runs go into studies/data/siconos.csv, in place of older ones of the same problem. The page
shows of them what a reader wants; it is written from that file, with --page alone. Runs into
another file (--runs) make no page unless --page asks for it. Status 0; 1 for
a wrong command line; 77 where Siconos (the driver studies/programs/solve_fclib.c, cmake
-DBIPOT_BENCHMARKS=ON) is not there: then bipot's runs are printed, and nothing is kept.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
import textwrap
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bipot.report import table
from studies.contact_alone import (
    REPEATS,
    Bench,
    Problem,
    Run,
    export_block,
    find_program,
    read_problem,
    same_kernels,
)
from studies.pages import DATA, PAGES, claim

KEPT = DATA / "siconos.csv"
COLUMNS = (
    "problem", "units", "points", "tolerance", "timeout", "program", "solver", "iterations",
    "seconds", "residual", "says",
)
UNITS = ("as it is", "scaled")
BIPOT_SOLVERS = {
    "auto": ["--solver", "auto"],
    "global Newton": ["--solver", "global-newton"],
    "sweeps": ["--solver", "sweeps"],
}
SICONOS_SOLVERS = [
    ("NSGS", "blocks"),
    ("NSGS", "dense"),
    ("NSN_AC", "blocks"),
    ("NSN_AC", "dense"),
    ("NSN_FB", "blocks"),
    ("NSN_FB", "dense"),
    ("ADMM", "blocks"),
    ("ADMM", "dense"),
]
SHOWN = ("NSGS", "NSN_AC", "ADMM")  # of Siconos, on the page


@dataclass
class Solved:
    """What came of all solvers on one problem in one of its units."""

    problem: str
    units: str
    points: int
    tolerance: float
    timeout: float
    runs: list[Run] = field(default_factory=list)

    def fastest(self, program: str, solver: str = "") -> Run | None:
        """The fastest run of a program, or of one of its solvers, that reached the residual."""
        good = [run for run in self.of(program, solver) if run.reached(self.tolerance)]
        return min(good, key=lambda run: run.seconds, default=None)

    def of(self, program: str, solver: str = "") -> list[Run]:
        """The runs of a program whose solver begins with these letters."""
        return [
            run for run in self.runs if run.program == program and run.solver.startswith(solver)
        ]

    def auto(self) -> Run:
        """Bipot's run without any option."""
        return self.of("bipot", "auto")[0]

    def over_siconos(self) -> float:
        """The time of bipot without options over that of the fastest of Siconos' solvers."""
        ours, theirs = self.auto(), self.fastest("Siconos")
        return ours.seconds / theirs.seconds if theirs and ours.reached(self.tolerance) else np.nan


def compare(bench: Bench, problem: Problem, units: str) -> Solved:
    """All solvers on one problem."""
    path = bench.folder / "problem.hdf5"
    problem.write(path)
    solved = Solved(problem.name, units, len(problem.mu), bench.tolerance, bench.timeout)
    solved.runs = [bench.run_bipot(problem, path, *item) for item in BIPOT_SOLVERS.items()]
    if bench.driver:
        solved.runs += [bench.run_siconos(problem, path, *choice) for choice in SICONOS_SOLVERS]
    return solved


def show(solved: Solved) -> None:
    """Print all runs of a problem."""
    head = ["program", "solver", "iterations", "seconds", "residual", "reached", "says of itself"]
    rows = [
        [*run.row(), "yes" if run.reached(solved.tolerance) else "no", run.own]
        for run in solved.runs
    ]
    print(f"{solved.problem}, {solved.units}: {solved.points} points")
    print("\n".join([*table(head, rows), ""]), flush=True)


# --- What is kept, and the page -------------------------------------------------------------------


def read_kept(path: Path) -> dict[tuple[str, str], Solved]:
    """The problems of a file of runs, by name and units."""
    found = {}
    if not path.is_file():
        return found
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            solved = found.setdefault((row["problem"], row["units"]), Solved(
                row["problem"], row["units"], int(row["points"]), float(row["tolerance"]),
                float(row["timeout"]),
            ))
            solved.runs.append(Run(
                row["program"], row["solver"], int(row["iterations"]), float(row["seconds"]),
                float(row["residual"]), row["says"],
            ))
    return found


def keep(solved: Solved, path: Path) -> None:
    """Put a problem into the file, in place of the same one in the same units."""
    found = read_kept(path) | {(solved.problem, solved.units): solved}
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for one in found.values():
            about = [one.problem, one.units, one.points, f"{one.tolerance:g}", f"{one.timeout:g}"]
            for run in one.runs:
                writer.writerow([
                    *about, run.program, run.solver, run.iterations, f"{run.seconds:.3g}",
                    f"{run.residual:.1e}", run.own,
                ])


def shown(solved: Solved) -> list[Run]:
    """The runs that the page has of a problem.

    Bipot without options, its fastest where that is another, and of the solvers of Siconos the
    fastest storage of W, or where neither is solved that with the least residual.
    """
    ours = solved.fastest("bipot")
    found = [solved.auto()] + ([ours] if ours and ours.solver != "auto" else [])
    theirs = solved.fastest("Siconos")
    names = dict.fromkeys([*SHOWN, *([theirs.solver.split(",")[0]] if theirs else [])])
    for name in names:
        runs = solved.of("Siconos", name)
        if runs:
            best = solved.fastest("Siconos", name)
            found.append(best or min(runs, key=lambda run: run.residual))
    return found


def section(name: str, versions: list[Solved]) -> list[str]:
    """The lines of one problem in its units."""
    rows = []
    for solved in versions:
        for run in shown(solved):
            row = run.row()
            if not run.reached(solved.tolerance):
                row[3] = "not reached" if np.isfinite(run.seconds) else run.own
            rows.append([solved.units, *row])
    head = ["units", "program", "solver", "iterations", "seconds", "residual"]
    points = versions[0].points
    words = f"{points} point" + ("s" if points > 1 else "")
    return [f"## {name}: {words}", "", *table(head, rows), ""]


def is_of_block(solved: Solved) -> bool:
    """Whether a problem is the paper's block's."""
    return solved.problem.startswith("block-")


def range_of(ratios: list[float]) -> str:
    """The least and the largest of some ratios."""
    return f"{min(ratios):.2g} to {max(ratios):.2g}"


def conclusions(found: list[Solved]) -> list[str]:
    """What the runs show, each sentence borne out by them."""
    of_block = [one.over_siconos() for one in found if is_of_block(one)]
    small = [one for one in found if not is_of_block(one) and one.points < 10]
    others = [one for one in found if not is_of_block(one) and one.points >= 10]
    lines = [claim(
        all(one.auto().reached(one.tolerance) for one in found),
        f"- `auto`, what bipot does without options, reaches the residual in all {len(found)}"
        " cases, a case being a problem in one of its units.",
    )]
    always = [
        ", ".join(choice) for choice in SICONOS_SOLVERS
        if all(run.reached(one.tolerance) for one in found
               for run in one.of("Siconos", ", ".join(choice)))
    ]
    counts = {
        name: sum(one.fastest("Siconos", name) is not None for one in found)
        for name in dict.fromkeys(name for name, _ in SICONOS_SOLVERS)
    }
    lines.append(
        "- Of Siconos, with either storage of W: "
        + ", ".join(f"{name} {count}" for name, count in counts.items())
        + f" of {len(found)}. In all of them with one and the same storage: "
        + ("; ".join(always) or "none") + "."
    )
    if of_block:
        lines.append(claim(
            max(of_block) < 1,
            f"- The block: `auto` takes {range_of(of_block)} times as long as the fastest of"
            f" Siconos' {len(SICONOS_SOLVERS)} choices, picked for each case afterwards.",
        ))
    if others:
        ratios = [one.over_siconos() for one in others]
        best = [one.fastest("bipot").seconds / one.fastest("Siconos").seconds for one in others]
        lines.append(claim(
            max(ratios) < 1.1,
            f"- Problems of others with ten points and more: {range_of(ratios)} times, with"
            f" bipot's fastest solver {range_of(best)}: as fast as the fastest choice, or faster.",
        ))
    if small:
        most = max(one.auto().seconds for one in small)
        lines.append(claim(
            min(one.over_siconos() for one in small) > 1 and most < 1e-3,
            "- Problems of less than ten points:"
            f" {range_of([one.over_siconos() for one in small])} times, `auto` within"
            f" {1e3 * most:.1g} ms.",
        ))
    return lines


def page(found: list[Solved]) -> list[str]:
    """The lines of the page."""
    by_name = {}
    for one in found:
        by_name.setdefault(one.problem, []).append(one)
    ratios = []
    for name, versions in by_name.items():
        of = {one.units: one for one in versions}
        ratios.append([name, versions[0].points, *(
            f"{of[units].over_siconos():.2g}" if units in of else "-" for units in UNITS
        )])
    runs = sum(len(one.runs) for one in found)
    limits = ", ".join(f"{limit:g}" for limit in sorted({one.timeout for one in found}))
    lines = [
        "# Beside Siconos", "",
        "By `studies/run siconos`: contact problems of FCLIB, and those of the paper's block that"
        " bipot exports (`block-n16-step30`: n = 16, increment 30; [fclib](../fclib.md)). Each is"
        " solved as it is and scaled (largest entries of W and q are 1): Siconos' stopping test has"
        " units. Both programs start from 0 and get the same file, one thread and the same kernels"
        " of OpenBLAS. Siconos is Debian's libsiconos-numerics, through"
        " `studies/programs/solve_fclib.c`; W is stored by blocks or dense. Seconds are those of"
        " the processor in the solver, with what it prepares from W, without reading and writing;"
        f" the best of {REPEATS} runs, given up after {limits} s. The residual is the scaled"
        " natural map ([theory](../theory/stopping.md), (5.2)), computed by one routine from the"
        f" reactions that each program wrote; it is to be {found[0].tolerance:g} or less. Where"
        " Siconos stops before that, its own tolerance is lowered, as far as to a"
        " ten-thousandth.", "",
        f"Here are the few solvers that matter; all {runs} runs, with what each program says of"
        " itself, are in [studies/data/siconos.csv](../../studies/data/siconos.csv).", "",
        "## What follows", "",
        *conclusions(found), "",
        "Seconds of `auto` over those of the fastest of Siconos' solvers:", "",
        *table(["problem", "points", *UNITS], ratios), "",
    ]
    for name, versions in by_name.items():
        lines += section(name, versions)
    return lines


def main() -> int:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", type=Path)
    parser.add_argument("--bipot", help="the program (default: build/bipot)")
    parser.add_argument("--driver", help="Siconos' driver (default: build/studies/solve_fclib)")
    parser.add_argument("--n", default="8,16", help="elements along the block's edge, or none")
    parser.add_argument("--steps", default="1,15,30", help="increments of the block")
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--timeout", type=float, default=20, help="seconds a run")
    parser.add_argument("--page", action="store_true", help="write the page from the runs kept")
    parser.add_argument("--runs", type=Path, default=KEPT, help="the file of the runs")
    parser.add_argument("-o", dest="folder", type=Path, default=PAGES, help="where the page goes")
    arguments = parser.parse_args()
    if not arguments.page:
        status = make_runs(arguments)
        if status != 0 or arguments.runs != KEPT:
            return status
    found = list(read_kept(arguments.runs).values())
    if not found:
        print(f"no runs in {arguments.runs}", file=sys.stderr)
        return 1
    lines = [
        part for line in page(found)
        for part in (textwrap.wrap(line, 100, subsequent_indent="  " * line.startswith("- "))
                     if line[:1] not in ("", "|", "#") else [line])
    ]
    text = "\n".join(lines).rstrip() + "\n"
    (arguments.folder / "siconos.md").write_text(text, encoding="utf-8")
    return 0


def make_runs(arguments: argparse.Namespace) -> int:
    """Solve every problem, print and keep the runs; return the exit status."""
    bipot = find_program(arguments.bipot, ["build/bipot"])
    if not bipot:
        print("bipot is not built; scripts/run builds it", file=sys.stderr)
        return 1
    others = {one.tolerance for one in read_kept(arguments.runs).values()} - {arguments.tolerance}
    if others:
        print(
            f"{arguments.runs} has runs to a residual of {others.pop():g}; name another file with "
            f"--runs for runs to {arguments.tolerance:g}", file=sys.stderr,
        )
        return 1
    driver = find_program(arguments.driver, ["build/studies/solve_fclib"])
    if not driver:
        print(
            "Siconos is not installed, or its driver is not built: install libsiconos-numerics-dev "
            "and libfclib-dev and configure with -DBIPOT_BENCHMARKS=ON; bipot runs alone",
            file=sys.stderr,
        )
    with tempfile.TemporaryDirectory() as scratch:
        bench = Bench(
            bipot, driver, arguments.tolerance, arguments.timeout, Path(scratch), same_kernels()
        )
        files = list(arguments.problems)
        if arguments.n != "none":
            for n in arguments.n.split(","):
                files += export_block(bench, int(n), arguments.steps)
        for path in files:
            problem = read_problem(path)
            for units, version in zip(UNITS, (problem, problem.scaled()), strict=True):
                solved = compare(bench, version, units)
                show(solved)
                if driver:
                    keep(solved, arguments.runs)
    return 0 if driver else 77


if __name__ == "__main__":
    sys.exit(main())
