"""The paper's block, and other decks, here, in CalculiX, GetFEM and Siconos: docs/studies/peers.md.

    studies/run peers [-o docs/studies] [--n 4,8,16,24] [--limit 200]
    studies/run peers --page

Every comparison goes into studies/data/peers.csv, in place of an older one of the same deck and
size (n). The page is written from that file, with --page alone. A peer is stopped after `--limit`
processor seconds a run, and its time taken from its iterations so far and the number of them an
increment in its largest whole run of the block; the page says where. From n = 16 on the stiffest of
CalculiX's penalties alone is run.
Siconos solves the contact problems of the block's increments alone, up to n = 16, through the
driver studies/programs/solve_fclib.c (cmake -DBIPOT_BENCHMARKS=ON). All runs have one thread. Some
25 minutes. A peer that is not installed is skipped with a line. Status 77: CalculiX is not
installed.
"""

import argparse
import csv
import itertools
import math
import shutil
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np

from bipot.figures import BLUE, GREEN, ORANGE, new_axes, save
from bipot.peers.runs import (
    CCX,
    HEAD,
    Comparison,
    PeerError,
    PeerRun,
    absent,
    compare,
    comparison_rows,
)
from bipot.program import ROOT
from bipot.report import machine, table
from studies.contact_alone import Bench, export_block, find_program, read_problem, same_kernels
from studies.pages import DATA, PAGES, claim

PENALTIES = (1e6, 1e7, 1e8)
KEPT = DATA / "peers.csv"
COLUMNS = ("deck", "n", "equations", "points", "reference", "program", "settings", "seconds",
           "memory", "error", "increments", "total", "note",
           "iterations", "expected")
FEW_FROM = 16  # n; from here on the stiffest alone
OTHERS = (  # decks whose obstacles are planes, the penalty that suits each
    ("quarter", {"n": "8"}), ("ssnv128", {}), ("patch", {}), ("corner", {}), ("slope", {}),
)
CONTACT_ALONE = "block-contact"  # the name of Siconos' comparisons among those kept
CONTACT_UP_TO = 16               # n
CONTACT_TOLERANCE = 1e-10        # of the scaled natural map
CONTACT_REFERENCE = 1e-13
CONTACT_SECONDS = 20.0           # a solver that takes longer over an increment is given up
SICONOS = (("NSGS", "dense"), ("NSN_AC", "dense"), ("ADMM", "dense"))
MUCH_LESS_TIME = {16: 80, 24: 100}  # n: at least this ratio


def block_section(n, comparison):
    """Return the lines of one mesh of the block."""
    return [
        f"### n = {n}: {comparison.equations} equations, {comparison.points} contact points", "",
        *table(HEAD, comparison_rows(comparison)), "",
    ]


def stiffest(comparison):
    """Return CalculiX's run with the smallest error."""
    return min(comparison.of("CalculiX"), key=lambda run: run.error)


def memory_words(found):
    """Return the sentence about memory."""
    parts = []
    for n, comparison in found.items():
        runs = [comparison.runs[0], stiffest(comparison), *comparison.of("GetFEM")]
        parts.append(f"{', '.join(f'{run.memory / 1e6:.0f}' for run in runs)} MB at n = {n}")
    return f"- Memory of bipot, CalculiX and, where it ran, GetFEM: {'; '.join(parts)}."


def against_calculix(found):
    """Return what the runs show of CalculiX."""
    lines = []
    for n, comparison in found.items():
        ours, theirs = comparison.runs[0], stiffest(comparison)
        ratio = theirs.whole_seconds / ours.whole_seconds
        about = "about " if theirs.increments < theirs.total else ""
        words = (
            f"- n = {n}: CalculiX takes {about}{ratio:.3g} times the processor time, with an error "
            f"of {theirs.error:.1e} instead of {ours.error:.1e}."
        )
        lines.append(claim(ratio > MUCH_LESS_TIME.get(n, 1) and ours.error < 1e-8, words))
    full = [runs for runs in (c.of("CalculiX") for c in found.values())
            if len(runs) == len(PENALTIES)]
    falls = all(
        a.error > 5 * b.error for runs in full for a, b in itertools.pairwise(runs)
    )
    lines.append(claim(falls and full, "- Its error is that of the penalty: it falls with 1/K, by "
                       "a factor of about ten from one row to the next, and so agrees with ours in "
                       "the limit. With K ever larger Newton's iterations end by chance: a larger "
                       "`tension` of ccx's smoothed law is then tried, and only the run that came "
                       "to its end is counted."))
    return lines


def against_getfem(found):
    """Return what the runs show of GetFEM; nothing where it did not run."""
    lines, each = [], []
    for n, comparison in found.items():
        for theirs in comparison.of("GetFEM"):
            ours = comparison.runs[0]
            ratio = theirs.whole_seconds / ours.whole_seconds
            about = "about " if theirs.increments < theirs.total else ""
            words = (
                f"- n = {n}: GetFEM takes {about}{ratio:.3g} times the processor time, with an "
                f"error of {theirs.error:.1e}; ours is {ours.error:.1e}."
            )
            lines.append(claim(theirs.error < 1e-8, words))
            each.append((theirs.expected or theirs.iterations) / theirs.total)
    if each:
        lines.append(
            "- GetFEM's error is that of the tolerance of its Newton iterations: there is no "
            "penalty, and a program by others finds the same resultants with "
            f"the same elements. It takes {min(each):.1f} to {max(each):.1f} iterations an "
            "increment, a factorisation each."
        )
    return lines


def conclusions(found):
    """Return what the runs show, each sentence borne out by them."""
    return [
        "## What follows", "",
        *against_calculix(found),
        *against_getfem(found),
        memory_words(found),
        "- Where the time goes. CalculiX factorises an unsymmetric matrix of the whole body in "
        "every Newton iteration, two or three an increment, and GetFEM one of the body and its "
        "contact forces; bipot factorises a symmetric one once a run and iterates with the "
        "contact rows alone. SPOOLES, CalculiX's solver in Debian, is not the fastest that it can "
        "be built with (PARDISO is); GetFEM has MUMPS, as bipot; the number of factorisations is "
        "the same with any. SPOOLES takes 92 % of CalculiX's time: so many samples of `perf record "
        "ccx -i peer` lay in it for the deck that `scripts/compare` hands to ccx with n = 16 and 5 "
        "increments, on an Intel Xeon whose dense products run at 45 Gflop/s. That is 3.1 s an "
        "iteration, of 18, where our line `time` had 0.65 s for MUMPS's symmetric factor, and an "
        "unsymmetric one is twice the work. With MUMPS in its place somewhat less than half of "
        "CalculiX's time would be left, and of the ratios above as much.",
        "- The number of increments matters: in a run of few the factorisation is most of our "
        "time. With 5 increments the same comparison gave 45 times our processor time.",
        "- A deck of some hundred equations ends in a tenth of a second in all; opening libraries "
        "and measuring the machine is most of ours, and Python with GetFEM some tenth of a second "
        "and 50 MB.", "",
    ]


def contact_section(found):
    """Return the lines on the contact problems alone."""
    if not found:
        return []
    lines = [
        "## The contact problems alone, beside Siconos", "",
        "Siconos has no finite elements here: it is given the condensed contact problem of every",
        "increment of the block, as bipot exports it (`--export-fclib all`, [fclib](../fclib.md)),",
        "scaled so that the largest entries of W and q are 1. bipot solves the same files. Each",
        f"starts from 0 and ends at a scaled natural map of {CONTACT_TOLERANCE:g} or less,",
        "computed from its reactions by one routine; where Siconos' own test ends it before that,",
        "its tolerance is lowered. The time is that of the solver, the best of three, summed over",
        "the increments. The error is that of the sums of the reactions, relative to the largest,",
        f"against bipot's at {CONTACT_REFERENCE:g}. More solvers and problems:",
        "[siconos](siconos.md).", "",
    ]
    for n, comparison in found.items():
        lines += [f"### n = {n}: {comparison.points} contact points", ""]
        rows = [row[:4] + row[5:] for row in comparison_rows(comparison)]
        head = ["program", "solver", "s", "ratio", "error of the resultants", ""]
        lines += [*table(head, rows), ""]
    for n, comparison in found.items():
        ours, *theirs = comparison.runs
        whole = [run for run in theirs if run.increments == run.total]
        best = min(whole, key=lambda run: run.seconds, default=None)
        words = (
            "none of Siconos' solvers brings all increments to the residual" if best is None else
            f"the fastest of Siconos' solvers, {best.settings}, takes "
            f"{best.seconds / ours.seconds:.2g} times bipot's time"
        )
        lines.append(claim(ours.increments == ours.total and ours.error < 1e-8,
                           f"- n = {n}: {words}."))
    return [*lines, ""]


def draw(found, path):
    """Draw the error over the processor time."""
    figure, axes = new_axes()
    colors = {"bipot": (BLUE, "s", "bipot"), "CalculiX": (ORANGE, "o-", "CalculiX, K = 1e6 to 1e8"),
              "GetFEM": (GREEN, "^", "GetFEM")}
    for program, (color, marks, label) in colors.items():
        for n, comparison in found.items():
            runs = [run for run in comparison.of(program) if run.increments]
            if not runs:
                continue
            axes.loglog([run.whole_seconds for run in runs], [run.error for run in runs], marks,
                        color=color, label=label)
            label = None
            place = (5, -11) if program == "GetFEM" else (5, 4)
            axes.annotate(f"n = {n}", (runs[-1].whole_seconds, runs[-1].error), place,
                          textcoords="offset points", fontsize=8)
    axes.set_xlabel("processor time of the whole run, s")
    axes.set_ylabel("error of the contact resultants")
    axes.legend(loc="center")
    save(figure, path)


def page(found, others, contact, where):
    """Return the page's lines."""
    lines = [
        "# Beside CalculiX, GetFEM and Siconos", "",
        f"By `studies/run peers` on {where}, one thread a program; `studies/data/peers.csv`",
        "holds the runs. `scripts/compare DECK` does the same for a deck of yours.", "",
        "All programs have the same elements (their C3D8 is ours: full integration), increments",
        "and loads. CalculiX 2.20 (Debian's `calculix-ccx`, with SPOOLES) takes contact node to",
        "surface by a linear penalty K and friction by a stick slope of K/10; the rigid plane is",
        "the face of a large element that is held. GetFEM 5.4 (Debian's `python3-getfem`, with",
        "MUMPS) takes contact and friction at the nodes, exactly, by the augmented Lagrangian of",
        "Alart and Curnier, with Newton's iterations over displacements and contact forces at once",
        "(`scripts/bipot/peers/getfem_contact.py`), which begin at those of the increment before.",
        "Its augmentation is Young's modulus E times the length h of an edge, its tolerance that",
        "of the residual over the external load. The residual adds forces and lengths, so forces",
        "are given over E: in N and mm the lengths do not count. Without friction its resultants",
        "are ours to 1e-10 and better (`tests/scripts/test_compare.py`): elements are the same.",
        "",
        "Times are processor seconds of the whole process, user and system, with reading and",
        "writing (bipot writes all fields, the others the resultants alone). The error is the",
        "largest difference of the resultants on the slave surface over all increments, relative",
        "to the largest; the reference is bipot's solution with the tightest tolerance that the",
        "certificate vouches for (1e-13), which does not come from the penalty's limit: that",
        "CalculiX tends to it, and GetFEM meets it, is a check of all.", "",
        "Where a peer was stopped its time is that of its iterations so far times the number of",
        "them expected: as many an increment as it took in its largest whole run of the block.",
        "Its error is then that of the increments it finished.", "",
        "![Error over time](figures/peers.png)", "",
        "## The paper's block, 50 increments, tolerance 1e-10", "",
    ]
    for n, comparison in found.items():
        lines += block_section(n, comparison)
    lines += conclusions(found)
    lines += contact_section(contact)
    lines += [
        "## Other decks", "",
        "GetFEM is given decks that `*BOUNDARY` alone moves, with no contact point held in a",
        "direction; of these there is none here. CalculiX's penalty is 500 moduli over the body's",
        "extent. A deck that it does not bring to its end is one where it finds no equilibrium:",
        "the cube of `slope` is held by friction alone.", "",
    ]
    rows = []
    for name, comparison in others.items():
        for row in comparison_rows(comparison):
            rows.append([f"`{name}`, {comparison.equations} equations", *row])
    lines += table(["deck", *HEAD], rows)
    lines += [
        "", "Not translated, and said so: round obstacles (`ball`, `mindlin`, `pipe`, `roller`,",
        "`tool`), `*CONTACT GAP` (`hertz`, `spence`), C3D8B; and decks without contact.",
    ]
    return lines


def main():
    """Run all and write the page and its figure."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("-o", dest="folder", type=Path, default=PAGES)
    parser.add_argument("--n", default="4,8,16,24", help="elements along the block's edge")
    parser.add_argument("--limit", type=float, default=200.0,
                        help="processor seconds a run of a peer")
    parser.add_argument("--page", action="store_true", help="write the page from the runs kept")
    parser.add_argument("--machine", default=machine(), help="where these were made (here)")
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot")
    options = parser.parse_args()
    if not options.page:
        if shutil.which(CCX) is None:
            print(f"{absent('CalculiX')}; no page without it")
            return 77
        make_runs(options)
    found = read_comparisons()
    blocks = {n: found["block", n] for name, n in sorted(found) if name == "block"}
    contact = {n: found[name, n] for name, n in sorted(found) if name == CONTACT_ALONE}
    others = {name: found[name, 0] for name, _ in OTHERS if (name, 0) in found}
    if not blocks:
        sys.exit(f"no comparisons in {KEPT}")
    (options.folder / "figures").mkdir(parents=True, exist_ok=True)
    draw(blocks, options.folder / "figures" / "peers.png")
    lines = [
        part for line in page(blocks, others, contact, options.machine)
        for part in (textwrap.wrap(line, 120, subsequent_indent="  ")
                     if line.startswith("- ") else [line])
    ]
    text = "\n".join(lines) + "\n"
    (options.folder / "peers.md").write_text(text, encoding="utf-8")
    return 0


def make_runs(options):
    """Compare the block of each size and the other decks; keep each comparison as it is made."""
    limits = SimpleNamespace(slope=None, limit=options.limit, iterations={})
    program = options.bipot.resolve()
    automatic = {"solver": "AUTO", "local": "AUTO"}
    settings = [
        ("block", int(n), {"n": n, **automatic}, PENALTIES if int(n) < FEW_FROM else PENALTIES[-1:])
        for n in options.n.split(",")
    ]
    settings += [(name, 0, overrides, []) for name, overrides in OTHERS]
    for name, n, overrides, penalties in settings:
        print(name, overrides, file=sys.stderr, flush=True)
        limits.iterations = iterations_an_increment(read_comparisons()) if n else {}
        with tempfile.TemporaryDirectory() as folder:
            deck = ROOT / "input" / f"{name}.inp"
            found = compare(program, deck, overrides, penalties, Path(folder), limits)
        show(found)
        keep(name, n, found)
    driver = find_program(None, ["build/studies/solve_fclib"])
    if driver is None:
        print("Siconos is not installed, or its driver not built (Debian: apt-get install "
              "libsiconos-numerics-dev libfclib-dev; cmake -DBIPOT_BENCHMARKS=ON): skipped",
              file=sys.stderr)
        return
    for n in (int(n) for n in options.n.split(",")):
        if n <= CONTACT_UP_TO:
            print("block, the contact problems alone", n, file=sys.stderr, flush=True)
            with tempfile.TemporaryDirectory() as folder:
                found = contact_alone(n, program, driver, Path(folder))
            show(found)
            keep(CONTACT_ALONE, n, found)


def show(comparison):
    """Print the runs of a comparison, and which peers were skipped."""
    lines = [*table(HEAD, comparison_rows(comparison)), *comparison.skipped]
    print("\n".join(lines), file=sys.stderr, flush=True)


def contact_alone(n, program, driver, folder):
    """Solve the contact problems of all increments of the block here and with Siconos' solvers."""
    bench = Bench(program, driver, CONTACT_TOLERANCE, CONTACT_SECONDS, folder, same_kernels())
    problems = [read_problem(path) for path in export_block(bench, n, "all")]
    file = folder / "problem.hdf5"
    runs = {("bipot", "auto"): Alone()}
    runs |= {("Siconos", f"{solver}, {storage}"): Alone() for solver, storage in SICONOS}
    largest = 0.0
    for problem in problems:
        scaled = problem.scaled()
        scaled.write(file)
        unit = abs(problem.q).max() / abs(problem.w).max()
        bench.tolerance = CONTACT_REFERENCE
        tight = bench.run_bipot(scaled, file, "auto", ["--solver", "auto"])
        if not tight.reached(CONTACT_TOLERANCE):
            raise PeerError(f"{problem.name}: the reference's residual is {tight.residual:.1e}")
        reference = unit * our_resultant(folder)
        largest = max(largest, abs(reference).max())
        bench.tolerance = CONTACT_TOLERANCE
        for (name, words), taken in runs.items():
            if taken.ended:
                continue
            if name == "bipot":
                run = bench.run_bipot(scaled, file, "auto", ["--solver", "auto"])
            else:
                run = bench.run_siconos(scaled, file, *words.split(", "))
            if not run.reached(CONTACT_TOLERANCE):
                taken.ended = True
                continue
            found = (our_resultant(folder) if name == "bipot"
                     else np.loadtxt(folder / "siconos.txt", ndmin=1).reshape(-1, 3).sum(axis=0))
            taken.seconds += run.seconds
            taken.increments += 1
            taken.error = max(taken.error, abs(unit * found - reference).max())
    comparison = Comparison(
        equations=len(problems[0].q), points=len(problems[0].mu),
        reference=f"{CONTACT_REFERENCE:g}",
    )
    for (name, words), taken in runs.items():
        note = f"ended in increment {taken.increments + 1}" if taken.ended else ""
        comparison.runs.append(PeerRun(
            name, words, taken.seconds, math.nan, taken.error / largest, taken.increments,
            len(problems), note,
        ))
    return comparison


@dataclass
class Alone:
    """A solver on the contact problems of the increments, one after the other."""

    seconds: float = 0.0
    error: float = 0.0    # of the resultant, a force
    increments: int = 0   # that it finished
    ended: bool = False   # at one that it did not bring to the residual


def our_resultant(folder):
    """Return the sum of the reactions that bipot wrote last, in the axes of the points (3,)."""
    with h5py.File(folder / "bipot.hdf5") as file:
        return file["solution/r"][()].reshape(-1, 3).sum(axis=0)


def iterations_an_increment(found):
    """Return those of each peer in its largest whole run of the block, by name."""
    whole = sorted(
        (n, run.iterations / run.total, run.program) for (name, n), comparison in found.items()
        for run in comparison.runs if name == "block" and run.iterations
        and run.increments == run.total
    )
    return {program: each for _, each, program in whole}


def read_comparisons(path=None):
    """Return the comparisons kept: (deck, n of the block or 0): Comparison."""
    found, path = {}, path or KEPT
    if not path.is_file():
        return found
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            comparison = found.setdefault((row["deck"], int(row["n"])), Comparison(
                equations=int(row["equations"]), points=int(row["points"]),
                reference=row["reference"],
            ))
            comparison.runs.append(PeerRun(
                row["program"], row["settings"],
                *(float(row[name]) for name in ("seconds", "memory", "error")),
                *(int(row[name]) for name in ("increments", "total")), row["note"],
                int(row["iterations"]), float(row["expected"]),
            ))
    return found


def keep(deck, n, comparison, path=None):
    """Put a comparison into the file, in place of one of the same deck and size."""
    path = path or KEPT
    found = read_comparisons(path) | {(deck, n): comparison}
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for (name, size), one in sorted(found.items()):
            for run in one.runs:
                writer.writerow([
                    name, size, one.equations, one.points, one.reference, run.program,
                    run.settings, f"{run.seconds:.4g}", f"{run.memory:.4g}", f"{run.error:.3g}",
                    run.increments, run.total, run.note, run.iterations, f"{run.expected:.4g}",
                ])


if __name__ == "__main__":
    sys.exit(main())
