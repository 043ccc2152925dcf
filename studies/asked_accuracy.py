"""What --accuracy reaches, and what it costs beside the best that can be set by hand.

    studies/run asked_accuracy [-o docs/studies/asked-accuracy.md]

Scenes of input/ and others made to be hard to judge (data/scenes), 10 % and 2 %, on meshes and with
increments that the program chooses. By hand: meshes and increments, all combinations; the cheapest
run that is as accurate. The truth is the limit of three fine meshes with fine increments, which end
at the events of the load path. Errors are those of docs/deck.md, *ACCURACY: of each pair
the normal forces as parts of their largest sum, friction as a part of mu times that, at the ends of
the deck's increments.
"""

import itertools
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bipot.program import ROOT, set_words, with_threads
from bipot.report import machine, table
from bipot.result import Result
from studies.pages import DATA, page_command

ASKED = (0.1, 0.02)
AUTO = {"solver": "AUTO", "local": "AUTO"}
BALL = (
    "*CLOAD\nCENTRE, 3, <-force/4>",
    "*BOUNDARY\nCENTRE, 3, 3, <-a*a/radius>",
)
FINER = 4  # increments of the truth for one of the deck's
LIMIT = 100  # processor time that a run for an accuracy may take [s]


@dataclass
class Scene:
    """A deck, its meshes, the largest of which are the truth, and its settings."""

    name: str
    deck: str
    mu: float
    meshes: tuple = (4, 6, 8, 12, 16, 24)
    steps: int = 5  # 0: the deck has its own
    settings: dict = field(default_factory=dict)
    replaced: tuple = ()
    other: tuple = ()  # a parameter that grows with n, and its part of it
    by_hand: str = ""  # cards that an accuracy does not need
    finer: int = FINER  # increments of the truth for one of the deck's

    @property
    def path(self):
        """The deck: of input/, or one of those that are there for this study."""
        own = DATA / "scenes" / f"{self.deck}.inp"
        return own if own.exists() else ROOT / "input" / own.name

    def parameters(self, n, finer=1):
        """The parameters of a run with n bricks and so many times as many increments."""
        found = {**self.settings, "n": n}
        if self.steps:
            found["steps"] = self.steps * finer
        if self.other:
            found[self.other[0]] = int(self.other[1] * n)
        return found


COARSE = (2, 4, 6, 8, 12, 16)
SCENES = (
    Scene("block", "block", 0.3, settings=AUTO),
    Scene("block, mu = 0.8, along x", "block", 0.8,
          settings={**AUTO, "mu": 0.8, "nu": 0.2, "theta": 0}),
    Scene("block, mu = 0.1", "block", 0.1, settings={**AUTO, "mu": 0.1}),
    Scene("quarter", "quarter", 0.3),
    Scene("hertz", "hertz", 0.0, steps=1),
    Scene("ball, pressed a way", "ball", 0.0, steps=1, replaced=BALL),
    Scene("spence", "spence", 0.2986),
    Scene("foundation", "foundation", 0.3, (2, 4, 6, 8, 10), 6, other=("base", 1.5)),
    Scene("tool", "tool", 0.2, (8, 12, 16, 24, 36), 2),
    Scene("indent, by hand with *REFINE", "indent", 0.2, (2, 3, 4, 6, 8), 4, {"times": 4},
          by_hand="*REFINE, TIMES=<times>\n0., 0., 0., <reach>\n"),
    Scene("contact late in a step", "late", 0.3),
    Scene("a period an increment", "wave", 0.3, finer=16),
    Scene("four periods an increment", "wave", 0.3, settings={"waves": 20}, finer=64),
    Scene("pressed by pulses", "pulse", 0.3, steps=4),
    Scene("partial slip turned round", "reversal", 0.5, COARSE, 3),
    Scene("contact that spreads", "spreading", 0.4, steps=4),
    Scene("a tilted plate", "tilted", 0.3, steps=3),
    Scene("ball inside a brick, by hand with *REFINE", "inside", 0.2, (2, 3, 4, 6, 8, 10), 2,
          {"times": 3}, by_hand="*REFINE, TIMES=<times>\n<at>, <at>, 0., 0.25\n"),
    Scene("layers 1 : 1000", "layers", 0.3, (4, 6, 8, 12, 16), 3),
    Scene("re-entrant corner", "angle", 0.3, COARSE, 4),
    Scene("rubber, nu = 0.4999", "rubber", 0.5, (*COARSE, 24), 4),
    Scene("needle", "needle", 0.3, (1, 2, 3, 4), 16, finer=8),
    Scene("two blocks", "two", 0.4, (2, 4, 6, 8, 12, 16), 3),
    Scene("rocking", "rocking", 0.6, COARSE, 4),
    Scene("weight alone", "weight", 0.3, COARSE, 4),
    Scene("press fit", "fit", 0.2, (2, 4, 6, 8, 10), 3),
    Scene("a rough floor, a smooth wall", "wall", 0.5),
    Scene("a cylinder rolled and dragged", "rolled", 0.3, (4, 6, 8, 12, 16, 20), 4),
    Scene("warm between two walls", "heat", 0.3, COARSE, 4),
    Scene("pressed, lifted, pressed again", "again", 0.4, steps=4),
    Scene("two layers, much friction", "grip", 1.5, steps=4),
    Scene("a soft layer, bricks cut", "fixed", 0.3, (2, 3, 4, 8, 12, 16), 4),
    Scene("a strip drawn from under a lid", "lap", 0.2, (2, 3, 4, 5, 6), 4),
)  # fmt: skip


@dataclass
class Outcome:
    """How a run ended, what it took, and what it found at the ends of the deck's increments."""

    status: int
    seconds: float
    times: np.ndarray
    pairs: list  # of each: sum of normal reactions (T,), as vectors (T, 3), friction (T, 3), mu
    sequence: object
    reason: str


def run(program, scene, folder, parameters, *options, direct=True):
    """Run the deck; None where that takes too long.

    Increments are free to be cut where options ask for an accuracy, or `direct` is false.
    """
    text = scene.path.read_text(encoding="utf-8")
    if scene.replaced:
        text = text.replace(*scene.replaced)
    if options:
        text = text.replace(scene.by_hand, "")
    if options or not direct:
        text = text.replace("*STATIC, DIRECT", "*STATIC")
    deck, result = Path(folder) / f"{scene.deck}.inp", Path(folder) / "result.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    command = [program, deck, "-o", result, "--overwrite", "-q", *options]
    command += set_words(parameters)
    if options:
        command = ["sh", "-c", f'ulimit -t {LIMIT}; exec "$@"', "sh", *command]
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, env=with_threads()
    )
    if done.returncode < 0:
        result.unlink(missing_ok=True)
        return None
    if not result.exists():
        # A mesh that misses the contact is no setting, but the truth and an accuracy take a result.
        if direct and not options:
            return None
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    with Result(result) as found:
        kept = found.history("extra") == 0
        pairs = [forces(pair, kept) for pair in found.pairs]
        times, sequence = found.history("time")[kept], found.accuracy
        seconds = found.counters["cpu_seconds"]
    if sequence:
        seconds = sequence.processor_time.sum()
    result.unlink()
    return Outcome(done.returncode, seconds, times, pairs, sequence, done.stderr.strip())


def forces(pair, kept):
    """The sum of a pair's normal reactions, the same as vectors, the sum of its friction, mu."""
    local, total = pair.reaction[kept], pair.resultant[kept]
    normal = np.einsum("tp,tpx->tx", local[:, :, 0], pair.frame[kept][:, :, 0, :])
    return local[:, :, 0].sum(axis=1), normal, total - normal, pair.friction_coefficient


def truth(program, scene, folder):
    """The forces of a mesh without size: Richardson's limit of the three finest, in every entry."""
    fine = [
        run(program, scene, folder, {**scene.parameters(n, scene.finer), "tolerance": 1e-8},
            direct=False)
        for n in scene.meshes[-3:]
    ]  # fmt: skip
    sizes = 1 / np.array(scene.meshes[-3:])
    changes = [
        max(abs(a[0] - b[0]).max() for a, b in zip(one.pairs, other.pairs, strict=True))
        for one, other in itertools.pairwise(fine)
    ]
    orders = np.linspace(0.5, 3, 251)
    ratio = (sizes[0] ** orders - sizes[1] ** orders) / (sizes[1] ** orders - sizes[2] ** orders)
    order = orders[np.argmin(abs(ratio - changes[0] / max(changes[1], 1e-300)))]
    weight = sizes[2] ** order / (sizes[1] ** order - sizes[2] ** order)
    pairs = [
        tuple(b + weight * (b - a) for a, b in zip(one, other, strict=True))
        for one, other in zip(fine[1].pairs, fine[2].pairs, strict=True)
    ]
    limit = Outcome(0, 0, fine[2].times, pairs, None, "")
    return limit, error_of(fine[2], limit)


def error_of(found, true):
    """The largest error of a pair at the ends of increments that both have."""
    here = np.flatnonzero(np.isclose(found.times[:, None], true.times, rtol=1e-9).any(axis=1))
    there = [int(np.argmin(abs(true.times - time))) for time in found.times[here]]
    scales = [pair[0].max() for pair in true.pairs]
    worst = 0.0
    for one, other, own in zip(found.pairs, true.pairs, scales, strict=True):
        scale = max(own, 1e-3 * max(scales))
        apart = [a[here] - b[there] for a, b in zip(one[:3], other[:3], strict=True)]
        mu = other[3]
        worst = max(worst, abs(apart[0]).max() / scale,
                    np.linalg.norm(apart[1], axis=1).max() / scale)  # fmt: skip
        if mu > 0:
            worst = max(worst, np.linalg.norm(apart[2], axis=1).max() / (scale * min(mu, 1)))
    return worst


def by_hand(program, scene, folder, true):
    """All settings by hand: error, seconds, words."""
    found = []
    for n in scene.meshes[:-1]:
        for finer in (1, scene.finer // 2) if scene.mu > 0 else (1,):
            parameters = {**scene.parameters(n, finer), "tolerance": 1e-5}
            one = run(program, scene, folder, parameters)
            words = f"n = {n}" + (f", {finer} times the increments" if finer > 1 else "")
            if one and one.status == 0:
                found.append((error_of(one, true), one.seconds, words))
    return found


def judge(program, scene):
    """The rows of a scene in the page's table, and how each ended."""
    rows, ends = [], []
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        settings = by_hand(program, scene, folder, true)
        for asked in ASKED:
            one = run(program, scene, folder, scene.parameters(scene.meshes[2]), "--accuracy",
                      str(asked))  # fmt: skip
            enough = [s for s in settings if s[0] <= asked]
            best = min(enough, key=lambda s: s[1]) if enough else None
            of_best = [f"{best[1]:.2g}", best[2]] if best else ["-", "-"]
            row = [scene.name, f"{100 * asked:g} %"]
            if one is None:
                ends.append(("refused", None))
                rows.append([*row, f"over {LIMIT} s", *8 * "-", of_best[0], "-", of_best[1]])
                continue
            error, sequence = error_of(one, true), one.sequence
            end = "refused"
            if one.status == 0:
                end = "reached" if error <= asked else "**broken**"
            ends.append((end, one.seconds / best[1] if best else None))
            told = sequence.mesh + max(0.0, sequence.load_steps) if sequence.mesh >= 0 else -1
            rows.append(
                [
                    *row, end, f"{100 * told:.2g} %" if told >= 0 else "-",
                    f"{100 * error:.2g} %", f"{100 * doubt:.1g} %", len(sequence),
                    f"{sequence.bricks[-1]:.0f}", f"{sequence.cuts[-1]:.0f}",
                    f"{sequence.divisions[-1]:.0f}", f"{one.seconds:.2g}", of_best[0],
                    f"{one.seconds / best[1]:.1f}" if best else "-", of_best[1],
                ]
            )  # fmt: skip
    for row in rows:
        print(*row, sep=" | ", file=sys.stderr, flush=True)
    return rows, ends


def study(program):
    """The rows of the page's table, and how each ended. What is measured is processor time."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        scenes = list(pool.map(lambda scene: judge(program, scene), SCENES))
    return [row for rows, _ in scenes for row in rows], [end for _, ends in scenes for end in ends]


def page(program):
    """The page as Markdown."""
    rows, ends = study(program)
    reached = [ratio for end, ratio in ends if end == "reached" and ratio]
    broken = sum(end == "**broken**" for end, _ in ends)
    head = [
        "scene", "asked", "", "told", "true", "doubt", "runs", "bricks", "cuts", "parts", "s",
        "s by hand", "ratio", "best by hand",
    ]  # fmt: skip
    return "\n".join(
        [
            "# What an accuracy that is asked for costs",
            "",
            "By `studies/run asked_accuracy`: `--accuracy` of the contact resultants, on meshes",
            "and with increments that the program chooses, and the cheapest mesh and increments by",
            "hand that are as accurate. `told` is the error of the result as the program says it,",
            "by mesh and load steps; `true` that against the limit of three fine meshes with",
            f"{FINER} times the increments and more, and `doubt` how far the finest of these is",
            "from the limit. `runs` are all that were made, `bricks`, `cuts` of those at contact",
            "beside all others and `parts` of each increment those of",
            f"the last. Processor seconds, of all runs, one thread, {machine()}. By hand nothing",
            "tells how accurate a run is: its seconds are those of the one run that is enough,",
            "found afterwards. Scenes that are not in `input/` were made to be hard to judge; they",
            "are in `studies/data/scenes`.",
            "",
            f"Promises broken: **{broken}** of {sum(end != 'refused' for end, _ in ends)}; refused "
            f"{sum(end == 'refused' for end, _ in ends)} of {len(ends)}. Of those reached the",
            f"cost is {np.median(reached):.1f} times that by hand in the median, at most",
            f"{max(reached):.1f}.",
            "",
            *table(head, rows),
            "",
        ]
    )


if __name__ == "__main__":
    page_command(__doc__, page)
