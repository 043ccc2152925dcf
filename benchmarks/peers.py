#!/usr/bin/python3
"""Make docs/peers.md: the paper's block, and other decks, here and in CalculiX.

    benchmarks/peers.py [-o docs] [--n 4,8,16,24] [--limit 200]
    benchmarks/peers.py --page

Every comparison goes into benchmarks/peers.csv, in place of an older one of the same deck and size
(n). The page is written from that file, with --page alone. CalculiX is stopped after `--limit`
processor seconds a run, and its time taken from its iterations so far and the number of them an
increment in the largest whole run of the block; the page says where. From n = 16 on the stiffest
penalty alone is run. All runs have one thread. Some 15 minutes. Status 77: ccx is not installed.
"""

import argparse
import csv
import shutil
import sys
import tempfile
import textwrap
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from block_runs import BLUE, ORANGE, new_axes, save  # noqa: E402
from peer_runs import CCX, HEAD, Comparison, PeerRun, compare, comparison_rows  # noqa: E402
from study_pieces import claim, machine, table  # noqa: E402

PENALTIES = (1e6, 1e7, 1e8)
KEPT = ROOT / "benchmarks" / "peers.csv"
COLUMNS = ("deck", "n", "equations", "points", "reference", "program", "settings", "seconds",
           "memory", "error", "increments", "total", "note",
           "iterations", "expected")
FEW_FROM = 16  # n; from here on the stiffest alone
OTHERS = (  # decks whose obstacles are planes, the penalty that suits each
    ("quarter", {"n": "8"}), ("ssnv128", {}), ("patch", {}), ("corner", {}), ("slope", {}),
)
MUCH_LESS_TIME = {16: 80, 24: 100}  # n: at least this ratio


def block_section(n, comparison):
    """Return the lines of one mesh of the block."""
    return [
        f"### n = {n}: {comparison.equations} equations, {comparison.points} contact points", "",
        *table(HEAD, comparison_rows(comparison)), "",
    ]


def stiffest(comparison):
    """Return CalculiX's run with the smallest error."""
    return min(comparison.runs[1:], key=lambda run: run.error)


def memory_words(found):
    """Return the sentence about memory."""
    parts = []
    for n, comparison in found.items():
        ours, theirs = comparison.runs[0].memory, stiffest(comparison).memory
        parts.append(f"{ours / 1e6:.0f} and {theirs / 1e6:.0f} MB at n = {n}")
    return f"- Memory, bipot's and CalculiX's: {', '.join(parts)}."


def conclusions(found):
    """Return what the runs show, each sentence borne out by them."""
    lines = ["## What follows", ""]
    for n, comparison in found.items():
        ours, theirs = comparison.runs[0], stiffest(comparison)
        ratio = theirs.whole_seconds / ours.whole_seconds
        about = "about " if theirs.increments < theirs.total else ""
        words = (
            f"- n = {n}: CalculiX takes {about}{ratio:.3g} times the processor time, with an error "
            f"of {theirs.error:.1e} instead of {ours.error:.1e}."
        )
        lines.append(claim(ratio > MUCH_LESS_TIME.get(n, 1) and ours.error < 1e-8, words))
    full = [c for c in found.values() if len(c.runs) == 1 + len(PENALTIES)]
    falls = all(
        a.error > 5 * b.error for c in full for a, b in zip(c.runs[1:-1], c.runs[2:], strict=True)
    )
    lines.append(claim(falls and full, "- Its error is that of the penalty: it falls with 1/K, by "
                       "a factor of about ten from one row to the next, and so agrees with ours in "
                       "the limit. With K ever larger Newton's iterations end by chance: a larger "
                       "`tension` of ccx's smoothed law is then tried, and only the run that came "
                       "to its end is counted."))
    lines += [
        memory_words(found),
        "- Where the time goes. CalculiX factorises an unsymmetric matrix of the whole body in "
        "every Newton iteration, two or three an increment; bipot factorises a symmetric one "
        "once a run and iterates with the contact rows alone. SPOOLES, Debian's solver, is not the "
        "fastest that CalculiX can be built with (PARDISO is); the number of factorisations is the "
        "same with any.",
        "- A deck of some hundred equations ends in a tenth of a second in both; opening libraries "
        "and measuring the machine is most of ours.", "",
    ]
    return lines


def draw(found, path):
    """Draw the error over the processor time."""
    figure, axes = new_axes()
    for n, comparison in found.items():
        ours, *theirs = comparison.runs
        whole = [run for run in theirs if run.increments]
        axes.loglog([run.whole_seconds for run in whole], [run.error for run in whole], "o-",
                    color=ORANGE, label=None if n != min(found) else "CalculiX, K = 1e6 to 1e8")
        axes.loglog(ours.whole_seconds, ours.error, "s", color=BLUE,
                    label=None if n != min(found) else "bipot")
        for x, y in ((ours.whole_seconds, ours.error), (whole[-1].whole_seconds, whole[-1].error)):
            axes.annotate(f"n = {n}", (x, y), (5, 4), textcoords="offset points", fontsize=8)
    axes.set_xlabel("processor time of the whole run, s")
    axes.set_ylabel("error of the contact resultants")
    axes.legend()
    save(figure, path)


def page(found, others):
    """Return the page's lines."""
    lines = [
        "# Beside CalculiX", "",
        f"By `benchmarks/peers.py` on {machine()}, one thread a program; `benchmarks/peers.csv`",
        "holds the runs. `scripts/compare DECK` does the same for a deck of yours.", "",
        "Both programs have the same bricks (their C3D8 is ours: full integration), increments",
        "and loads. CalculiX 2.20 (Debian's `calculix-ccx`, with SPOOLES) takes contact node to",
        "surface by a linear penalty K and friction by a stick slope of K/10; the rigid plane is",
        "the face of a large brick that is held. Times are processor seconds of the whole process,",
        "user and system, with reading and writing (bipot writes all fields, CalculiX the",
        "resultants alone). The error is the largest difference of the resultants on the slave",
        "surface over all increments, relative to the largest; the reference is bipot's solution",
        "with the tightest tolerance that the certificate vouches for (1e-13), which does not come",
        "from the penalty's limit: that CalculiX tends to it is a check of both.", "",
        "Where CalculiX was stopped its time is that of its iterations so far times the number of",
        "them expected: as many an increment as it took in the largest whole run of the block. Its",
        "error is then that of the increments it finished.", "",
        "![Error over time](figures/peers.png)", "",
        "## The paper's block, 50 increments, tolerance 1e-10", "",
    ]
    for n, comparison in found.items():
        lines += block_section(n, comparison)
    lines += conclusions(found)
    lines += [
        "## Other decks", "",
        "The penalty is 500 moduli over the body's extent. A deck that CalculiX does not bring to",
        "its end is one where it finds no equilibrium: the cube of `slope` is held by friction",
        "alone.", "",
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
    parser.add_argument("-o", dest="folder", type=Path, default=ROOT / "docs")
    parser.add_argument("--n", default="4,8,16,24", help="bricks along the block's edge")
    parser.add_argument("--limit", type=float, default=200.0, help="processor seconds a run of ccx")
    parser.add_argument("--page", action="store_true", help="write the page from the runs kept")
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot")
    options = parser.parse_args()
    if not options.page:
        if shutil.which(CCX) is None:
            print("CalculiX is not installed (Debian: apt-get install calculix-ccx): no page")
            return 77
        make_runs(options)
    found = read_comparisons()
    blocks = {n: found["block", n] for name, n in sorted(found) if name == "block"}
    others = {name: found[name, 0] for name, _ in OTHERS if (name, 0) in found}
    if not blocks:
        sys.exit(f"no comparisons in {KEPT}")
    (options.folder / "figures").mkdir(parents=True, exist_ok=True)
    draw(blocks, options.folder / "figures" / "peers.png")
    lines = [
        part for line in page(blocks, others)
        for part in (textwrap.wrap(line, 120, subsequent_indent="  ")
                     if line.startswith("- ") else [line])
    ]
    text = "\n".join(lines) + "\n"
    (options.folder / "peers.md").write_text(text, encoding="utf-8")
    return 0


def make_runs(options):
    """Compare the block of each size and the other decks; keep each comparison as it is made."""
    limits = SimpleNamespace(slope=None, limit=options.limit, iterations=None)
    program = options.bipot.resolve()
    automatic = {"solver": "AUTO", "local": "AUTO"}
    settings = [
        ("block", int(n), {"n": n, **automatic}, PENALTIES if int(n) < FEW_FROM else PENALTIES[-1:])
        for n in options.n.split(",")
    ]
    settings += [(name, 0, overrides, []) for name, overrides in OTHERS]
    for name, n, overrides, penalties in settings:
        print(name, overrides, file=sys.stderr, flush=True)
        limits.iterations = iterations_an_increment(read_comparisons()) if n else None
        with tempfile.TemporaryDirectory() as folder:
            deck = ROOT / "input" / f"{name}.inp"
            found = compare(program, deck, overrides, penalties, Path(folder), limits)
        print("\n".join(table(HEAD, comparison_rows(found))), file=sys.stderr, flush=True)
        keep(name, n, found)


def iterations_an_increment(found):
    """Return those of CalculiX in the largest whole run of the block; None where there is none."""
    whole = [
        (n, run.iterations / run.total) for (name, n), comparison in found.items()
        for run in comparison.runs if name == "block" and run.iterations
        and run.increments == run.total
    ]
    return max(whole)[1] if whole else None


def read_comparisons():
    """Return the comparisons kept: (deck, n of the block or 0): Comparison."""
    found = {}
    if not KEPT.is_file():
        return found
    with KEPT.open(encoding="utf-8", newline="") as file:
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


def keep(deck, n, comparison):
    """Put a comparison into the file, in place of one of the same deck and size."""
    found = read_comparisons() | {(deck, n): comparison}
    with KEPT.open("w", encoding="utf-8", newline="") as file:
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
