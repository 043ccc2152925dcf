"""The paper's block to 0.1 %: by an accuracy of extrapolated values, and by one fine mesh.

    studies/run fine_block [-o docs/studies/fine-block.md]

The block of input/block.inp with free increments. By hand: finer and finer meshes, and their
errors, which nothing but the truth tells. Each increment is in 64 parts, for load steps must make
much less than 0.1 % there.
"""

import sys
import tempfile
from dataclasses import replace

import numpy as np

from bipot.report import machine, table
from studies.asked_accuracy import of_sequence
from studies.pages import page_command
from studies.promises import MARKS, end_of, told_by
from studies.scenes import SCENES, run
from studies.truths import error_of, truth

ASKED = (0.01, 0.003, 0.001)
PARTS = 64  # of the deck's increments, by hand
BY_HAND = (8, 12, 16, 20, 24, 28)
TRUE = (16, 20, 26, 34)
LONGEST = 7200  # [s]


def time_of(error, settings):
    """Seconds of one mesh with such an error, between those by hand or with the last two's order.

    Time and error are powers of the elements' size there.
    """
    logs = np.log([(e, s) for e, s in settings])
    at = min(max(1, int(np.searchsorted(-logs[:, 0], -np.log(error)))), len(logs) - 1)
    slope = (logs[at, 1] - logs[at - 1, 1]) / (logs[at, 0] - logs[at - 1, 0])
    return float(np.exp(logs[at, 1] + slope * (np.log(error) - logs[at, 0])))


def page(program):
    """The page as Markdown."""
    scene = replace(next(scene for scene in SCENES if scene.name == "block"), meshes=TRUE)
    rows, settings = [], []
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        for n in BY_HAND:
            one = run(program, scene, folder, scene.parameters(n, PARTS))
            settings.append((error_of(one, true), one.seconds))
            rows.append([f"by hand, n = {n}", f"{one.seconds:.3g}", n**3, PARTS, "-",
                         f"{100 * settings[-1][0]:.2g} %", "-", "-"])  # fmt: skip
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
        for asked in ASKED:
            one = run(program, scene, folder, scene.parameters(8), "--accuracy", str(asked),
                      "--extrapolated", limit=LONGEST)  # fmt: skip
            error, sequence = error_of(of_sequence(one), true), one.sequence
            mark = MARKS[end_of(one.status, error, asked, doubt)]
            ratios = [one.seconds / time_of(e, settings) for e in (asked, max(error, doubt))]
            rows.append(
                [f"`--accuracy {asked:g}`", f"{one.seconds:.3g}", f"{sequence.elements[-1]:.0f}",
                 f"{sequence.divisions[-1]:.0f}", f"{100 * told_by(sequence):.2g} %",
                 f"{100 * error:.2g} %{mark}", *(f"{ratio:.2g}" for ratio in ratios)]
            )  # fmt: skip
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    return "\n".join(
        [
            "# The paper's block to 0.1 %",
            "",
            "By `studies/run fine_block`: the contact resultants of `input/block.inp`, with free",
            f"increments: on one mesh by hand, increments in {PARTS} parts, and by an accuracy",
            "of extrapolated values (`--extrapolated`), all its runs included. The limit of",
            f"n = {', '.join(map(str, TRUE))} is what is true, and known to {100 * doubt:.1g} %.",
            "The last two columns are the seconds over those of the one mesh whose error is what",
            "was asked, and what the extrapolated values truly have (or the doubt, if that is",
            "more): between those by hand, or with the power of the last two beyond them. What one",
            "mesh has, nothing but the truth tells.",
            f"Processor seconds, one thread, {machine()}.",
            "",
            *table(["how", "s", "elements", "parts", "told", "true", "over one mesh, as asked",
                    "over one mesh, as true"], rows),
            "",
        ]
    )  # fmt: skip


if __name__ == "__main__":
    page_command(__doc__, page)
