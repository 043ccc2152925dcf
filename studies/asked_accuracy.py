"""What --accuracy reaches, and what it costs beside the best that can be set by hand.

    studies/run asked_accuracy [-o docs/studies/asked-accuracy.md]

Four scenes, 10 %, 1 % and 0.1 %. By hand: increments, contact tolerance and the precision of the
factor, all combinations on the same mesh; the cheapest of those that are as accurate. The truth is
a finer mesh with fine increments, or the limit of three (as in effectivity.py).
"""

import itertools
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.program import ROOT, set_words, with_threads
from bipot.report import machine, table
from bipot.result import Result
from studies.effectivity import AUTO, at_step_ends, limit
from studies.pages import page_command

ASKED = (0.1, 0.01, 0.001)


@dataclass
class Case:
    """A deck, its settings, the meshes of the truth, and the increments tried by hand."""

    deck: str
    quantity: str
    n: int
    truth: tuple
    settings: dict
    increments: tuple


CASES = (
    Case("block", "resultants", 16, (8, 16, 24), AUTO, (5, 10, 50)),
    Case("quarter", "resultants", 16, (8, 16, 24), {}, (1, 5, 20)),
    Case("ssnv128", "energy", 32, (128,), {"thickness": 0.005}, (1, 5, 20)),
    Case("roller", "energy", 64, (128,), {}, (1, 5, 20)),
)


@dataclass
class Outcome:
    """How a run ended, what it took, and what it found at the ends of its steps."""

    status: int
    seconds: float
    values: np.ndarray
    estimate: float
    increments: int
    reason: str


def run(program, case, folder, n, steps, card="", free=False, accuracy=None, tolerance=1e-9):
    """Run the deck with a card more, its increments free to be cut or not."""
    text = (ROOT / "input" / f"{case.deck}.inp").read_text(encoding="utf-8")
    if free:
        text = text.replace("*STATIC, DIRECT", "*STATIC")
    if card:
        text = text.replace("*STEP\n", f"{card}\n*STEP\n", 1)
    deck, result = Path(folder) / f"{case.deck}.inp", Path(folder) / "result.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    command = [program, deck, "-o", result, "--overwrite"]
    if accuracy:
        command += ["--accuracy", str(accuracy)]
    command += set_words({**case.settings, "n": n, "steps": steps, "tolerance": tolerance})
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, env=with_threads()
    )
    if not result.exists():
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    with Result(result) as found:
        estimates, values = at_step_ends(found, case.quantity == "energy")
        seconds, increments = found.counters["cpu_seconds"], found.finished
    result.unlink()
    warnings = [line for line in done.stdout.splitlines() if line.startswith("warning: step")]
    told, _, cause = warnings[0].partition(";") if warnings else ("", "", "")
    reason = cause.strip() or told
    return Outcome(done.returncode, seconds, values, estimates.max(), increments, reason)


def truth(program, case, folder):
    """What the runs should find."""
    fine = [
        run(program, case, folder, n, case.increments[-1], tolerance=1e-8).values
        for n in case.truth
    ]
    if len(fine) < 3:
        return fine[0]
    return np.array(
        [limit(case.truth, [of_mesh[k] for of_mesh in fine]) for k in range(len(fine[0]))]
    )


def error_of(values, true):
    """The largest error at the end of a step, beside the largest value there."""
    return max(abs(v - t).max() / abs(t).max() for v, t in zip(values, true, strict=True))


def by_hand(program, case, folder, true):
    """All settings by hand: error, seconds, words."""
    found = []
    for steps, tolerance, factor in itertools.product(
        case.increments, (1e-2, 1e-4, 1e-8), ("DOUBLE", "SINGLE")
    ):
        card = f"*PRECISION, FACTOR={factor}"
        one = run(program, case, folder, case.n, steps, card=card, tolerance=tolerance)
        words = f"steps={steps}, tolerance={tolerance:g}, {factor.lower()}"
        if one.status == 0:
            found.append((error_of(one.values, true), one.seconds, words))
    return found


def study(program):
    """The rows of the page's table, how many were reached, how many refused."""
    rows, reached, refused = [], 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            true = truth(program, case, folder)
            settings = by_hand(program, case, folder, true)
            for asked in ASKED:
                card = "*ACCURACY, OF=ENERGY\n0.5" if case.quantity == "energy" else ""
                one = run(program, case, folder, case.n, case.increments[0], card, True, asked)
                error = error_of(one.values, true)
                enough = [s for s in settings if s[0] <= asked]
                best = min(enough, key=lambda s: s[1]) if enough else None
                ended = "reached" if one.status == 0 and error <= asked else "**missed**"
                if one.status == 2 and one.reason:
                    ended = "refused: " + one.reason
                    refused += 1
                reached += ended == "reached"
                rows.append(
                    [
                        case.deck, case.quantity, f"{asked:g}", ended, f"{one.estimate:.2g}",
                        f"{error:.2g}", one.increments, f"{one.seconds:.2g}",
                        f"{best[1]:.2g}" if best else "-",
                        f"{one.seconds / best[1]:.2f}" if best else "-",
                        best[2] if best else "-",
                    ]
                )  # fmt: skip
                print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    return rows, reached, refused


def page(program):
    """The page as Markdown."""
    rows, reached, refused = study(program)
    head = [
        "deck", "of", "asked", "", "estimate", "true error", "increments", "s", "s by hand",
        "ratio", "best by hand",
    ]  # fmt: skip
    return "\n".join(
        [
            "# What an accuracy that is asked for costs",
            "",
            "By `studies/run asked_accuracy`: `--accuracy` in four scenes with increments that",
            "may be cut, beginning from few (block 5, the others 1), and the cheapest setting by",
            "hand that is as accurate on the same mesh (increments, contact tolerance, precision",
            "of the factor: 18 combinations a scene). Processor seconds of whole runs, one thread,",
            f"{machine()}. Meshes: "
            + ", ".join(f"{case.deck} n = {case.n}" for case in CASES)
            + ".",
            "True errors: against n = 8, 16, 24 extrapolated (block, quarter) or n = 128, fine",
            "increments, at the end of the worst step.",
            "",
            f"Reached: **{reached} of {len(rows)}**; refused with a reason: {refused}.",
            "",
            *table(head, rows),
            "",
        ]
    )


if __name__ == "__main__":
    page_command(__doc__, page)
