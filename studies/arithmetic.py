"""Time, memory and accuracy of each choice of arithmetic beside double precision.

    studies/run arithmetic [-o TABLE.md] [-n 16 24 32] [--steps 5 50] [--repeats 3]

The paper's block by the automatic solver, tolerance 1e-10, one BLAS thread. The choices take turns,
so that what else the machine does meets all of them; columns are ratios of medians to those of
double precision: processor time of the whole run, of its parts by wall clock, and peak memory.
"""

import statistics
import sys
import tempfile
from pathlib import Path

from bipot.program import ROOT, run_deck
from bipot.result import Result
from studies.pages import page_options, put_page

DOUBLE = "double"
CHOICES = {
    DOUBLE: "",
    "single factor": "FACTOR=SINGLE",
    "low rank 1e-5": "BLOCK LOW RANK=1e-5",
}
PARTS = ("factorise", "loads", "contact", "recover")
TOLERANCE = 1e-10


def run(program, card, n, steps, folder):
    """One run; return its counters and the worst certificate entry."""
    text = (ROOT / "input" / "block.inp").read_text(encoding="utf-8")
    if card:
        text = text.replace("*STEP\n", f"*PRECISION, {card}\n*STEP\n", 1)
    deck, path = Path(folder) / "block.inp", Path(folder) / "block.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    settings = {"n": n, "steps": steps, "tolerance": TOLERANCE, "solver": "AUTO", "local": "AUTO"}
    run_deck(program, deck, path, settings)
    with Result(path) as result:
        worst = max(entry.max() for entry in result.certificate.values())
        return result.counters | {"worst": worst}


def measure(program, n, steps, repeats):
    """Medians of every choice's counters."""
    runs = {name: [] for name in CHOICES}
    with tempfile.TemporaryDirectory() as folder:
        for repeat in range(repeats):
            for name, card in CHOICES.items():
                print(f"n = {n}, {steps} steps, {name}, run {repeat + 1}", file=sys.stderr)
                runs[name].append(run(program, card, n, steps, folder))
    return {
        name: {key: statistics.median(one[key] for one in of_choice) for key in of_choice[0]}
        for name, of_choice in runs.items()
    }


def rows(program, n, steps, repeats):
    """The lines of one mesh and one number of steps."""
    medians = measure(program, n, steps, repeats)
    double = medians[DOUBLE]
    for name, counters in medians.items():
        ratios = [counters["cpu_seconds"] / double["cpu_seconds"]]
        ratios += [counters[f"seconds_{part}"] / double[f"seconds_{part}"] for part in PARTS]
        ratios.append(counters["peak_memory_bytes"] / double["peak_memory_bytes"])
        cells = [str(n), f"{counters['increments']:.0f}", name]
        if name == DOUBLE:
            cells += [f"{counters['cpu_seconds']:.3g} s"]
            cells += [f"{counters[f'seconds_{part}']:.2g} s" for part in PARTS]
            cells += [f"{counters['peak_memory_bytes'] / 1e6:.0f} MB"]
        else:
            cells += [f"{ratio:.2f}" for ratio in ratios]
        cells += [
            f"{counters['factor_entries'] / 1e6:.1f}",
            f"{counters['newton_raphson_iterations'] / counters['increments']:.1f}",
        ]
        cells += [
            f"{counters[key]:.0e}" if counters[key] > 0 else "0"
            for key in ("unrefined_imbalance", "imbalance", "worst")
        ]
        yield "| " + " | ".join(cells) + " |"


def main():
    """Measure and print, or write to a file."""
    parser = page_options(__doc__)
    parser.add_argument("-n", type=int, nargs="+", default=[16, 24, 32])
    parser.add_argument("--steps", type=int, nargs="+", default=[5, 50])
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    lines = [
        f"| n | increments | choice | time | {' | '.join(PARTS)} | memory | million entries "
        "| iterations | as solved | as refined | worst error |",
        "|" + "---|" * (9 + len(PARTS)),
    ]
    for n in options.n:
        for steps in options.steps:
            lines += rows(options.bipot.resolve(), n, steps, options.repeats)
    put_page("\n".join(lines) + "\n", options.page)


if __name__ == "__main__":
    main()
