"""The paper's block to 0.1 %: by an accuracy of extrapolated values, and by one fine mesh.

    studies/run fine_block [-o docs/studies/fine-block.md]

The block of input/block.inp with free increments. By hand: finer and finer meshes, each increment
in eight parts, their errors, and of the mesh that would have 0.1 %, by the order of these, what the
plan foresees: few machines hold it.
"""

import re
import subprocess
import sys
import tempfile
from dataclasses import replace

import numpy as np

from bipot.program import set_words, with_threads
from bipot.report import machine, table
from studies.asked_accuracy import of_sequence
from studies.pages import claim, page_command
from studies.promises import end_of, told_by
from studies.scenes import SCENES, run
from studies.truths import error_of, truth

ASKED = 1e-3
PARTS = 8  # of the deck's increments, by hand
BY_HAND = (8, 12, 16, 24, 32)
TRUE = (24, 32, 40, 48)
LONGEST = 7200  # [s]
UNITS = {"s": 1, "min": 60, "h": 3600}


def needed(sizes, errors):
    """How many bricks along an edge have the error that is asked, and the order of the errors."""
    slope, _ = np.polyfit(np.log(sizes), np.log(errors), 1)
    return int(np.ceil(sizes[-1] * (errors[-1] / ASKED) ** (-1 / slope))), -slope


def foreseen(program, scene, n):
    """Seconds and memory in words, as the plan of a mesh has them."""
    command = [program, scene.path, "--plan", *set_words(scene.parameters(n, PARTS))]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=with_threads())
    time, unit = re.search(r"^time +about +([\d.]+) (\w+) of one", done.stdout, re.M).groups()
    memory = re.search(r"^memory +about +([\d.]+ \w+)", done.stdout, re.M)[1]
    return float(time) * UNITS[unit], memory


def page(program):
    """The page as Markdown."""
    scene = replace(next(scene for scene in SCENES if scene.name == "block"), meshes=TRUE)
    rows, errors = [], []
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        for n in BY_HAND:
            one = run(program, scene, folder, scene.parameters(n, PARTS))
            errors.append(error_of(one, true))
            rows.append([f"by hand, n = {n}", f"{one.seconds:.3g}", n**3, PARTS, "-",
                         f"{100 * errors[-1]:.2g} %"])  # fmt: skip
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
        one = run(program, scene, folder, scene.parameters(8), "--accuracy", str(ASKED),
                  "--extrapolated", limit=LONGEST)  # fmt: skip
    error = error_of(of_sequence(one), true)
    n, order = needed(BY_HAND[-3:], errors[-3:])
    seconds, memory = foreseen(program, scene, n)
    sequence = one.sequence
    rows += [
        [f"by hand, n = {n}: foreseen", f"{seconds:.2g}", n**3, PARTS, "-", f"{100 * ASKED:g} %"],
        [f"`--accuracy {ASKED:g} --extrapolated`, {len(sequence)} runs", f"{one.seconds:.3g}",
         f"{sequence.bricks[-1]:.0f}", f"{sequence.divisions[-1]:.0f}",
         f"{100 * told_by(sequence):.2g} %", f"{100 * error:.2g} %"],
    ]  # fmt: skip
    ratio = seconds / one.seconds
    claim(end_of(one.status, error, ASKED, doubt) in ("kept", "not judged"), "0.1 % is reached")
    return "\n".join(
        [
            "# The paper's block to 0.1 %",
            "",
            "By `studies/run fine_block`: the contact resultants of `input/block.inp`, with free",
            "increments, within 0.1 %: by an accuracy of extrapolated values, and on one fine mesh",
            f"with each increment in {PARTS} parts. What the error of such meshes is follows from",
            f"n = {', '.join(map(str, BY_HAND[-3:]))}: it falls with the order {order:.2f}. The",
            f"limit of n = {', '.join(map(str, TRUE))} is what is true, and known to",
            f"{100 * doubt:.1g} %. Processor seconds, one thread, {machine()}.",
            "",
            claim(ratio >= 5, f"One mesh takes {ratio:.0f} times as long and {memory} of memory,"),
            "as its plan foresees; nothing but the truth tells that it is enough.",
            "",
            *table(["how", "s", "bricks", "parts", "told", "true"], rows),
            "",
        ]
    )


if __name__ == "__main__":
    page_command(__doc__, page)
