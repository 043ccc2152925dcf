"""How accuracies of local values and of the energy are kept.

    studies/run local_accuracy [-o docs/studies/local-accuracy.md] [--jobs N]

*ACCURACY with OF=ENERGY, DISPLACEMENT, SLIP, PRESSURE and MISES, eight scenes, 10 and 3 %. What is
true is found as for forces (truths.py), of the largest values that the result files of runs by hand
show: by Python, not by what the program compares from mesh to mesh.
"""

import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from bipot.report import machine, table
from studies.pages import page_with_jobs
from studies.promises import (
    HEADS,
    JUDGED,
    MARKS,
    can_judge,
    counts,
    effectivity,
    end_of,
    reached,
    told_by,
    verdict,
)
from studies.scenes import LARGEST, LIMIT, SCENES, run
from studies.truths import TrueRuns, error_of, runs_for_truth, truth_of

ASKED = (0.1, 0.03)
OF_EIGHT = (
    "block", "quarter", "ball, pressed a way", "contact late in a step",
    "partial slip turned round", "re-entrant corner", "two blocks", "rocking",
)  # fmt: skip


@dataclass
class Ask:
    """How an accuracy of a value ended."""

    of: str
    asked: float
    end: str  # kept, broken, refused, over, not judged
    doubt: float
    effectivity: float = 0.0  # error as told over the true one; 0: not judged

    @property
    def is_known(self):
        """Whether the truth can judge what is asked."""
        return can_judge(self.asked, self.doubt)


def of_largest(one, name):
    """An outcome that has largest values where forces are, so that truths.py knows them."""
    none = np.zeros((len(one.times), 3))
    least = 1e-3 * one.largest["DISPLACEMENT"][0].max() if name == "SLIP" else 0.0
    pairs = [(values, none, none, 0.0) for values in one.largest[name]]
    return replace(one, pairs=pairs, least=least)


def truth_of_largest(runs, name):
    """The largest values that are true, and what is not known of them."""
    return truth_of(
        TrueRuns(
            runs.sizes,
            [of_largest(one, name) for one in runs.meshes],
            [of_largest(one, name) for one in runs.steps],
        )
    )


def judge(program, scene):
    """The rows of a scene in the page's table, and how each ask ended."""
    rows, asks = [], []
    with tempfile.TemporaryDirectory() as folder:
        runs = runs_for_truth(program, scene, folder, of="ALL")
        for name in LARGEST:
            if name == "SLIP" and scene.mu == 0:
                continue
            true, doubt = truth_of_largest(runs, name)
            cells = []
            for asked in ASKED:
                one = run(program, scene, folder, scene.parameters(scene.meshes[2]),
                          "--accuracy", str(asked), of=name)  # fmt: skip
                found, words = ask(one, name, asked, (true, doubt))
                asks.append(found)
                cells += words
            rows.append([scene.name, name, f"{100 * doubt:.1g} %", *cells])
            print(*rows[-1], sep=" | ", file=sys.stderr, flush=True)
    return rows, asks


def ask(one, name, asked, known):
    """How a run for an accuracy ended, and its cells of the page's table."""
    true, doubt = known
    if one is None:
        return Ask(name, asked, "over", doubt), [f"over {LIMIT}", "-", "-", "-"]
    sequence = one.sequence
    told = told_by(sequence)
    error = error_of(of_largest(one, name), true)
    found = Ask(name, asked, end_of(one.status, error, asked, doubt), doubt,
                effectivity(told, error, doubt))  # fmt: skip
    return found, [
        f"{one.seconds:.2g}", f"{sequence.elements[-1]}",
        f"{100 * told:.2g} %" if told >= 0 else "-",
        f"{100 * error:.2g} %{MARKS[found.end]}",
    ]  # fmt: skip


def summary(asks):
    """The rows of the table of promises: by what is asked, and of which value."""
    rows = []
    for name in LARGEST:
        for asked in ASKED:
            here = [a for a in asks if (a.of, a.asked) == (name, asked)]
            unknown = sum(a.end in ("refused", "over") and a.doubt > a.asked for a in here)
            rows.append([name, f"{100 * asked:g} %", len(here), *counts(here), unknown])
    return rows


def page(program, jobs):
    """The page as Markdown."""
    scenes = [scene for scene in SCENES if scene.name in OF_EIGHT]
    with ThreadPoolExecutor(jobs) as pool:
        done = list(pool.map(lambda scene: judge(program, scene), scenes))
    rows = [row for found, _ in done for row in found]
    asks = [one for _, found in done for one in found]
    heads = [f"{name}, {100 * asked:g} %" for asked in ASKED
             for name in ("s", "elements", "told", "true")]  # fmt: skip
    return "\n".join(
        [
            "# Accuracies of local values and of the energy",
            "",
            "By `studies/run local_accuracy`: `*ACCURACY` with `OF=ENERGY` and with those of",
            "largest values, at the ends of the deck's increments, on meshes and with increments",
            "that the program chooses. Scenes and columns are those of the study",
            "[asked-accuracy](asked-accuracy.md), and so is the truth: its values are read from",
            "the result files of four fine meshes with fine increments, and `doubt` is what is",
            f"not known of their limit. Promises are judged where it is at most {JUDGED:g} of",
            "what is asked, or where they hold or fail in spite of it; `?` marks those that are",
            "not. A largest pressure or stress at a sharp edge or a corner has no limit: there",
            "the doubt is large, and an accuracy has to be refused. Processor seconds, one",
            f"thread, {machine()}.",
            "",
            *verdict(asks),
            "",
            "Where the truth can judge what is asked, it is reached: the energy in",
            f"{reached([a for a in asks if a.of == 'ENERGY'])}, the others in",
            f"{reached([a for a in asks if a.of != 'ENERGY'])}.",
            "",
            *table(["of", "asked", "scenes", *HEADS,
                    "refused or over, and the truth not known either"],
                   summary(asks)),
            "",
            *table(["scene", "of", "doubt", *heads], rows),
            "",
        ]
    )  # fmt: skip


def main():
    """Make the page as the command line says."""
    page_with_jobs(__doc__, page)


if __name__ == "__main__":
    main()
