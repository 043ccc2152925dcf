#!/usr/bin/python3
"""Make docs/peers.md: the paper's block, and other decks, here and in CalculiX.

    benchmarks/peers.py [-o docs] [--n 4,8,16,24] [--limit 400]

CalculiX is stopped after `--limit` processor seconds a run, and its time taken from the increments
it has finished; the page says where. From n = 16 on the stiffest penalty alone is run. All runs
have one thread. Some 15 minutes. Status 77 where ccx is not installed.
"""

import argparse
import shutil
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from block_runs import BLUE, ORANGE, new_axes, save  # noqa: E402
from peer_runs import CCX, HEAD, compare, comparison_rows  # noqa: E402
from study_pieces import claim, machine, table  # noqa: E402

PENALTIES = (1e6, 1e7, 1e8)
FEW_FROM = 16  # n; from here on the stiffest alone
OTHERS = (  # decks whose obstacles are planes, the penalty that suits each
    ("quarter", {"n": "8"}), ("ssnv128", {}), ("patch", {}), ("corner", {}), ("slope", {}),
)
MUCH_LESS_TIME = {16: 50, 24: 100}  # n: at least this ratio


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
        "every Newton iteration, some four or five an increment; bipot factorises a symmetric one "
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


def page(command, found, others):
    """Return the page's lines."""
    lines = [
        "# Beside CalculiX", "",
        f"By `{command}` on {machine()}, one thread a program. `scripts/compare DECK` does the",
        "same for a deck of yours.", "",
        "Both programs have the same bricks (their C3D8 is ours: full integration), increments",
        "and loads. CalculiX 2.20 (Debian's `calculix-ccx`, with SPOOLES) takes contact node to",
        "surface by a linear penalty K and friction by a stick slope of K/10; the rigid plane is",
        "the face of a large brick that is held. Times are processor seconds of the whole process,",
        "user and system, with reading and writing (bipot writes all fields, CalculiX the",
        "resultants alone). The error is the largest difference of the resultants on the slave",
        "surface over all increments, relative to the largest; the reference is bipot's solution",
        "with the tightest tolerance that the certificate vouches for (1e-13), which does not come",
        "from the penalty's limit: that CalculiX tends to it is a check of both.", "",
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
    parser.add_argument("--limit", type=float, default=400.0, help="processor seconds a run of ccx")
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot")
    options = parser.parse_args()
    if shutil.which(CCX) is None:
        print("CalculiX is not installed (Debian: apt-get install calculix-ccx): no page")
        return 77
    meshes = sorted(int(n) for n in options.n.split(","))
    limits = SimpleNamespace(slope=None, limit=options.limit)
    program = options.bipot.resolve()

    def run(name, settings, penalties):
        print(name, settings, file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory() as folder:
            deck = ROOT / "input" / f"{name}.inp"
            found = compare(program, deck, settings, penalties, Path(folder), limits)
            print("\n".join(table(HEAD, comparison_rows(found))), file=sys.stderr, flush=True)
            return found

    automatic = {"solver": "AUTO", "local": "AUTO"}
    found = {
        n: run("block", {"n": str(n), **automatic}, PENALTIES if n < FEW_FROM else PENALTIES[-1:])
        for n in meshes
    }
    others = {name: run(name, settings, []) for name, settings in OTHERS}
    command = f"benchmarks/peers.py --n {options.n} --limit {options.limit:g}"
    lines = page(command, found, others)
    (options.folder / "figures").mkdir(parents=True, exist_ok=True)
    draw(found, options.folder / "figures" / "peers.png")
    (options.folder / "peers.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
