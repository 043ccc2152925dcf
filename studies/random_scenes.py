"""Whether --accuracy keeps what it promises on scenes that nobody chose.

    studies/run random_scenes [-o PAGE.md] [--seed S] [--count N] [--jobs N]

Variants of the scenes of scenes.py: a scene by lot, its friction, the other numbers of its deck
that are parameters, and the number of its increments too. Each is asked 10, 3 and 1 % of the last
mesh and of extrapolated values, where its truth (truths.py) is known as well.
"""

import random
import re
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from bipot.report import machine, table
from studies.asked_accuracy import ask
from studies.pages import page_options, put_page
from studies.promises import HEADS, JUDGED, counts, verdict
from studies.scenes import LIMIT, SCENES
from studies.truths import truth

ASKED = (0.1, 0.03, 0.01)
KINDS = (
    "block", "block, mu = 0.1", "quarter", "contact late in a step", "pressed by pulses",
    "partial slip turned round", "contact that spreads", "a tilted plate", "re-entrant corner",
    "two blocks", "rocking", "pressed, lifted, pressed again", "layers 1 : 1000",
    "warm between two walls", "a rough floor, a smooth wall",
)  # fmt: skip
KEPT = ("n", "steps", "tolerance", "waves", "rho")  # parameters that are no part of the scene
MESHES = (6, 8, 10, 12, 16, 20)
FINER = 16  # increments of the truth for one of the deck's


def numbers_of(scene):
    """The numbers that a deck has as parameters."""
    cards = re.search(r"^\*PARAMETER\n(.*?)^\*(?!\*)", scene.path.read_text(encoding="utf-8"),
                      re.MULTILINE | re.DOTALL)  # fmt: skip
    pairs = re.findall(r"^(\w+) = (-?\d[-.e\d]*)$", cards[1], re.MULTILINE) if cards else []
    return {name: float(number) for name, number in pairs if name not in KEPT}


def varied(seed, which):
    """The scene of such a number among those of a seed."""
    lot = random.Random(f"{seed}:{which}")
    name = lot.choice(KINDS)
    scene = next(scene for scene in SCENES if scene.name == name)
    settings = dict(scene.settings)
    for parameter, number in numbers_of(scene).items():
        if parameter == "mu":
            settings[parameter] = round(lot.uniform(0.1, 0.9), 3)
        elif parameter == "nu":
            settings[parameter] = round(lot.uniform(0.05, 0.45), 3)
        elif lot.random() < 0.5:
            settings[parameter] = round(number * lot.uniform(0.6, 1.5), 5)
    # The steps of the block are a fifth and four fifths of its increments.
    # An increment of 2/steps fits into the step's period of 1 from two on.
    fewest = 2 if "<2/steps>" in scene.path.read_text(encoding="utf-8") else 1
    steps = 5 if scene.deck == "block" else lot.randint(fewest, 8)
    return replace(scene, settings=settings, mu=settings.get("mu", scene.mu), steps=steps,
                   meshes=MESHES, finer=FINER)  # fmt: skip


def judge(program, scene):
    """The scene's row in the page's table, and how each ask ended."""
    ends, cells = [], []
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        for asked in ASKED:
            for options in ([], ["--extrapolated"]):
                if doubt > asked:
                    cells.append("-")
                    continue
                found, words = ask(program, scene, folder, (asked, options), (true, doubt))
                ends.append(found)
                _, _, told, error, _ = words
                cells.append(f"over {LIMIT} s" if found.end == "over" else f"{told}: {error}")
    changed = ", ".join(
        f"{name} = {value}" for name, value in scene.settings.items() if not isinstance(value, str)
    )
    increments = f"{scene.steps} increment{'s' if scene.steps > 1 else ''}"
    row = [f"{scene.name}: {changed}, {increments}", f"{100 * doubt:.1g} %", *cells]
    print(*row, sep=" | ", file=sys.stderr, flush=True)
    return row, ends


def summary(ends):
    """The rows of the table of promises: by what is asked, and of which value."""
    rows = []
    for extrapolated in (False, True):
        for asked in ASKED:
            here = [one for one in ends if (one.asked, one.extrapolated) == (asked, extrapolated)]
            rows.append(["extrapolated" if extrapolated else "last mesh", f"{100 * asked:g} %",
                         len(here), *counts(here)])  # fmt: skip
    return rows


def page(program, jobs, seed, count):
    """The page as Markdown."""
    with ThreadPoolExecutor(jobs) as pool:
        done = list(pool.map(lambda i: judge(program, varied(seed, i)), range(count)))
    ends = [end for _, found in done for end in found]
    heads = [f"{100 * asked:g} %{more}" for asked in ASKED for more in ("", ", extrapolated")]
    return "\n".join(
        [
            "# Accuracies of random scenes",
            "",
            f"By `studies/run random_scenes --seed {seed} --count {count}`: `--accuracy` of the",
            "contact resultants on variants of the scenes of the study",
            "`asked_accuracy`, whose friction, other parameters and number of",
            "increments are drawn by lot. Cells are the error as told and, behind it, the true",
            f"one, by four meshes of n = {MESHES[-4]} to {MESHES[-1]}; `doubt` is what is not",
            f"known of that. Promises are judged where it is at most {JUDGED:g} of what is asked,",
            "or where they hold or fail in spite of it (`?`: they are not), and no accuracy is",
            f"asked for that is less than the doubt. Processor seconds up to {LIMIT}, one thread,",
            f"{machine()}.",
            "",
            *verdict(ends),
            "",
            *table(["of", "asked", "scenes", *HEADS], summary(ends)),
            "",
            *table(["scene", "doubt", *heads], [row for row, _ in done]),
            "",
        ]
    )  # fmt: skip


def main():
    """Make the page as the command line says."""
    options = page_options(__doc__)
    options.add_argument("--seed", type=int, default=1, help="of the lots")
    options.add_argument("--count", type=int, default=30, help="scenes")
    options.add_argument("--jobs", type=int, default=2, help="scenes at a time")
    options = options.parse_args()
    put_page(page(options.bipot.resolve(), options.jobs, options.seed, options.count),
             options.page)  # fmt: skip


if __name__ == "__main__":
    main()
