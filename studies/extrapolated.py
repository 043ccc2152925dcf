"""What an accuracy of extrapolated values takes beside one of the last mesh.

    studies/run extrapolated [-o docs/studies/extrapolated.md]

Scenes of the study asked_accuracy whose values converge evenly enough that a truth can be found
which is known better than a fifth of what is asked: 1 and 0.3 % of the contact resultants, with
--extrapolated and without. The truth is the limit of five meshes with finer increments, by the same
fit for every quantity; its doubt is how far the limit of three of them is from it. Errors are those
of docs/deck.md, *ACCURACY.
"""

import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from bipot.report import machine, table
from studies.asked_accuracy import SCENES, Outcome, error_of, run
from studies.pages import page_command

ASKED = (0.01, 0.003)
# Of each scene the meshes of the truth, and how many increments it has for one of the deck's.
TRUTHS = {
    "block": ((12, 16, 20, 26, 34), 32),
    "block, mu = 0.1": ((12, 16, 20, 26, 34), 32),
    "a tilted plate": ((12, 16, 20, 26, 34), 32),
    "partial slip turned round": ((10, 12, 16, 20, 26), 32),
}


def limit_of(sizes, meshes):
    """The limit of q + c h^p fitted to what the meshes give, all increments of a quantity alike."""
    best = None
    for order in np.arange(0.5, 2.51, 0.01):
        powers = np.stack([np.ones(len(sizes)), np.array(sizes) ** order], axis=1)
        found, left = np.linalg.lstsq(powers, meshes, rcond=None)[:2]
        if best is None or left.sum() < best[0]:
            best = left.sum(), found[0]
    return best[1]


def extrapolate(runs, sizes):
    """The forces of a mesh without size."""
    pairs = []
    for of_pair in zip(*(one.pairs for one in runs), strict=True):
        *forces, mu = zip(*of_pair, strict=True)
        limits = [
            limit_of(sizes, np.array([part.ravel() for part in parts])).reshape(parts[0].shape)
            for parts in forces
        ]
        pairs.append((*limits, mu[0]))
    return Outcome(0, 0, runs[-1].times, pairs, None, "")


def truth(program, scene, folder):
    """The forces without an error of mesh or increments, and what is not known of them.

    Increments of two sizes leave friction an error that halves with them: on a mesh between, what
    the finer ones change is taken twice.
    """
    meshes, finer = TRUTHS[scene.name]
    sizes = [1 / n for n in meshes]

    def of(n, times):
        return run(program, scene, folder, {**scene.parameters(n, times), "tolerance": 1e-8},
                   direct=False)  # fmt: skip

    coarse = finer // 8
    runs = [of(n, coarse) for n in meshes]
    limit, other = extrapolate(runs, sizes), extrapolate(runs[-3:], sizes[-3:])
    doubt = error_of(other, limit)
    steps = {times: of(meshes[0], times) for times in (coarse, finer // 2, finer)}
    kept = np.isclose(limit.times[:, None], steps[finer].times, rtol=1e-9).any(axis=1)
    at = {
        times: [int(np.argmin(abs(one.times - time))) for time in limit.times[kept]]
        for times, one in steps.items()
    }
    pairs = []
    for i, pair in enumerate(limit.pairs):
        found = []
        for k, part in enumerate(pair[:3]):
            of_times = {t: one.pairs[i][k][at[t]] for t, one in steps.items()}
            to_limit = 2 * of_times[finer] - of_times[finer // 2] - of_times[coarse]
            found.append(part[kept] + to_limit)
        pairs.append((*found, pair[3]))
    true = Outcome(0, 0, limit.times[kept], pairs, None, "")
    return true, doubt


def of_sequence(one):
    """The extrapolated values as the outcome of a run."""
    sequence, values = one.sequence, one.sequence.extrapolated
    starts = [i for i, name in enumerate(sequence.names) if name.endswith("/pressing_force")]
    pairs = [
        (values[:, a], values[:, a + 1 : a + 4], values[:, a + 4 : a + 7], pair[3])
        for a, pair in zip(starts, one.pairs, strict=True)
    ]
    return Outcome(one.status, one.seconds, one.times, pairs, sequence, one.reason)


def judge(program, scene):
    """The rows of a scene in the page's table, and how each ended."""
    rows, ends = [], []
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        for asked in ASKED:
            if doubt > asked / 5:
                continue
            row, seconds = [scene.name, f"{100 * asked:g} %", f"{100 * doubt:.1g} %"], []
            for options in ([], ["--extrapolated"]):
                one = run(program, scene, folder, scene.parameters(8), "--accuracy", str(asked),
                          *options)  # fmt: skip
                if one is None or one.status != 0:
                    row += ["-" if one is None else "refused", "-", "-", "-"]
                    seconds.append(None)
                    continue
                if options:
                    one = of_sequence(one)
                error = error_of(one, true)
                ends.append(error <= asked)
                seconds.append(one.seconds)
                told = one.sequence.mesh + max(0.0, one.sequence.load_steps)
                row += [f"{one.seconds:.2g}", f"{one.sequence.bricks[-1]:.0f}",
                        f"{100 * told:.2g} %", f"{100 * error:.2g} %"]  # fmt: skip
            both = None not in seconds
            rows.append([*row, f"{seconds[0] / seconds[1]:.1f}" if both else "-"])
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    return rows, ends


def page(program):
    """The page as Markdown."""
    scenes = [scene for scene in SCENES if scene.name in TRUTHS]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(lambda scene: judge(program, scene), scenes))
    rows = [row for rows, _ in found for row in rows]
    ends = [end for _, ends in found for end in ends]
    saved = [float(row[-1]) for row in rows if row[-1] != "-"]
    head = ["scene", "asked", "doubt", "s, last mesh", "bricks", "told", "true",
            "s, extrapolated", "bricks", "told", "true", "times less"]  # fmt: skip
    return "\n".join(
        [
            "# What extrapolated values save",
            "",
            "By `studies/run extrapolated`: `--accuracy` of the contact resultants, of what the",
            "last mesh gives and, with `--extrapolated`, of what several meshes and several",
            "divisions of the increments give for bricks and increments without size. `told` is",
            "the error as the program says it, `true` that against the limit of five meshes,",
            "`doubt` how far the limit of the last three of these is from it: rows are left out",
            "where that is above a fifth of what is asked. Processor seconds of all runs, one",
            f"thread, {machine()}; `-` is a run of more than 100 s.",
            "",
            f"Promises broken: **{ends.count(False)}** of {len(ends)}. Where both are reached "
            f"extrapolated values take {np.median(saved):.1f} times less in the median.",
            "",
            *table(head, rows),
            "",
        ]
    )


if __name__ == "__main__":
    page_command(__doc__, page)
