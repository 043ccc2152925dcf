"""What --accuracy reaches, and what it costs beside the best that can be set by hand.

    studies/run asked_accuracy [-o docs/studies/asked-accuracy.md] [--only NAME;...] [--page]

All scenes of scenes.py, 10, 3 and 1 % of the contact resultants, ten of them 0.3 % too, of what
the last mesh gives and, with --extrapolated, of what elements and increments without size would. By
hand: meshes and increments, all combinations; the cheapest run that is as accurate, which only the
truth tells. And what is common: finer meshes until the last change is less than what is asked, then
more increments until theirs is.

Rows go into studies/data/asked_accuracy.csv as each scene is done, in place of older ones; the page
is made from that file, with --page alone.
"""

import csv
import sys
import tempfile
from ast import literal_eval
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np

from bipot.program import built_program, program_options
from bipot.report import machine, table
from studies.pages import DATA, put_page
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
    within,
)
from studies.scenes import LIMIT, SCENES, Outcome, run
from studies.truths import error_of, truth

KEPT = DATA / "asked_accuracy.csv"
BEFORE = ["scene", "asked", "doubt", "s by hand", "best by hand", "s, common way", "its error"]
VALUE = ["s", "elements", "told", "true", "runs"]
ASKED = (0.1, 0.03, 0.01)
ALSO_ASKED = (0.003,)
OF_TEN = (
    "block", "block, mu = 0.1", "quarter", "ball, pressed a way", "contact late in a step",
    "pressed by pulses", "partial slip turned round", "a tilted plate", "two blocks", "rocking",
)  # fmt: skip


@dataclass
class Setting:
    """A run on a mesh and with increments set by hand."""

    n: int
    finer: int
    error: float
    outcome: Outcome

    @property
    def words(self):
        """What was set."""
        finer = f", {self.finer} times the increments" if self.finer > 1 else ""
        return f"n = {self.n}{finer}"


@dataclass
class Reached:
    """How a promise was kept, and what that took."""

    asked: float
    extrapolated: bool
    end: str  # kept, broken, refused, over, not judged
    is_known: bool = False  # whether the truth can judge it
    seconds: float = 0.0
    of_best: float = 0.0  # seconds over those of the best by hand; 0: there is none
    of_common: float = 0.0  # likewise over those of the common way
    common_kept: bool | None = None
    effectivity: float = 0.0  # error as told over the true one; 0: not judged


def by_hand(program, scene, folder, true):
    """All settings by hand that can be solved."""
    found = []
    for n in scene.meshes[:-1]:
        for finer in sorted({1, 2, scene.finer // 2}) if scene.mu > 0 else (1,):
            parameters = {**scene.parameters(n, finer), "tolerance": 1e-5}
            one = run(program, scene, folder, parameters)
            if one and one.status == 0:
                found.append(Setting(n, finer, error_of(one, true), one))
    return found


def common_way(settings, asked):
    """Seconds of all runs and the error at the end; None where no change is as small.

    Without friction the increments are not changed.
    """
    seconds = 0.0
    meshes = [s for s in settings if s.finer == 1]
    for i, one in enumerate(meshes):
        seconds += one.outcome.seconds
        if i > 0 and error_of(meshes[i - 1].outcome, one.outcome) <= asked:
            break
    else:
        return None
    last = one
    for finer in (s for s in settings if s.n == one.n and s.finer > 1):
        seconds += finer.outcome.seconds
        change = error_of(last.outcome, finer.outcome)
        last = finer
        if change <= asked:
            return seconds, last.error
    return (seconds, last.error) if last is one else None


def of_sequence(one):
    """The extrapolated values as the outcome of a run."""
    sequence, values = one.sequence, one.sequence.extrapolated
    pairs = []
    for name, (*_, mu) in zip(one.names, one.pairs, strict=True):
        a = list(sequence.names).index(f"{name}/pressing_force")
        normal = values[:, a + 1 : a + 4]
        friction = values[:, a + 4 : a + 7] if mu > 0 else np.zeros_like(normal)
        pairs.append((values[:, a], normal, friction, mu))
    return Outcome(one.status, one.seconds, one.times, pairs, sequence, one.reason)


def judge(program, scene):
    """The rows of a scene in the file: what the page says of each value, and how it ended."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        settings = by_hand(program, scene, folder, true)
        for asked in sorted(ASKED + (ALSO_ASKED if scene.name in OF_TEN else ()), reverse=True):
            enough = [s for s in settings if s.error <= asked]
            best = min(enough, key=lambda s: s.outcome.seconds) if enough else None
            common = common_way(settings, asked)
            before = [scene.name, f"{100 * asked:g} %", f"{100 * doubt:.1g} %",
                      f"{best.outcome.seconds:.2g}" if best else "-", best.words if best else "-",
                      f"{common[0]:.2g}" if common else "-",
                      f"{100 * common[1]:.2g} %" if common else "-"]  # fmt: skip
            for options in ([], ["--extrapolated"]):
                found, cells = ask(program, scene, folder, (asked, options), (true, doubt))
                if found.end in ("kept", "not judged"):
                    found.of_best = found.seconds / best.outcome.seconds if best else 0.0
                    found.of_common = found.seconds / common[0] if common else 0.0
                found.common_kept = common[1] <= asked if common else None
                texts = dict(zip(BEFORE + VALUE, map(str, before + cells), strict=True))
                rows.append((texts, found))
                print(*texts.values(), sep=" | ", file=sys.stderr, flush=True)
    return rows


def read_kept():
    """The rows that are kept, in the order of the scenes: texts of the page, and how each ended."""
    if not KEPT.is_file():
        return []
    order = [scene.name for scene in SCENES]
    rows = []
    with KEPT.open(encoding="utf-8", newline="") as file:
        for line in csv.DictReader(file):
            ended = Reached(**{
                field.name: line[f"raw {field.name}"] if field.name == "end" else literal_eval(
                    line[f"raw {field.name}"]) for field in fields(Reached)
            })
            rows.append(({name: line[name] for name in BEFORE + VALUE}, ended))
    return sorted((row for row in rows if row[0]["scene"] in order),
                  key=lambda row: order.index(row[0]["scene"]))


def keep(rows):
    """Put a scene's rows into the file, in place of its older ones."""
    names = {texts["scene"] for texts, _ in rows}
    rows = [row for row in read_kept() if row[0]["scene"] not in names] + rows
    heads = [*BEFORE, *VALUE, *(f"raw {field.name}" for field in fields(Reached))]
    with KEPT.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        for texts, ended in rows:
            writer.writerow([*texts.values(), *map(str, asdict(ended).values())])


def ask(program, scene, folder, wanted, known):
    """Run for an accuracy: how it ended, and its cells of the page's table."""
    asked, options = wanted
    true, doubt = known
    one = run(program, scene, folder, scene.parameters(scene.meshes[2]), "--accuracy", str(asked),
              *options)  # fmt: skip
    found = Reached(asked, bool(options), "over", can_judge(asked, doubt))
    if one is None:
        return found, [f"over {LIMIT}", "-", "-", "-", "-"]
    sequence, found.seconds = one.sequence, one.seconds
    told = told_by(sequence)
    error = error_of(of_sequence(one) if options and one.status == 0 else one, true)
    found.end = end_of(one.status, error, asked, doubt)
    found.effectivity = effectivity(told, error, doubt)
    elements = f"{sequence.elements[-1]:.0f}"
    if sequence.cuts[-1] > 0:
        elements += f", {sequence.cuts[-1]:.0f} cuts"
    if sequence.divisions[-1] > 1:
        elements += f", {sequence.divisions[-1]:.0f} parts"
    return found, [
        f"{one.seconds:.3g}", elements, f"{100 * told:.2g} %" if told >= 0 else "-",
        f"{100 * error:.2g} %{MARKS[found.end]}", len(sequence),
    ]  # fmt: skip


def spread(ratios):
    """The median and the largest, in words."""
    return (f"{np.median(ratios):.1f}", f"{max(ratios):.1f}") if ratios else ("-", "-")


def summary(ends):
    """The rows of the table of promises: by what is asked, and of which value."""
    rows = []
    for extrapolated in (False, True):
        for asked in sorted(ASKED + ALSO_ASKED, reverse=True):
            here = [e for e in ends if (e.asked, e.extrapolated) == (asked, extrapolated)]
            best = [e.of_best for e in here if e.of_best > 0]
            common = [e.of_common for e in here if e.of_common > 0]
            ways = [e.common_kept for e in here if e.common_kept is not None]
            rows.append(
                [
                    "extrapolated" if extrapolated else "last mesh", f"{100 * asked:g} %",
                    len(here), *counts(here), *spread(best),
                    *spread(common),
                    f"{ways.count(False)} of {len(ways)}",
                ]
            )  # fmt: skip
    return rows


def reached_where_known(ends):
    """How many are reached of those that the truth can judge: in words."""
    parts = []
    for asked in sorted(ASKED + ALSO_ASKED, reverse=True):
        last, extrapolated = (
            reached([one for one in ends if (one.asked, one.extrapolated) == (asked, of_limit)])
            for of_limit in (False, True)
        )
        parts.append(f"{100 * asked:g} %: {last}, extrapolated {extrapolated}")
    return ["Where the truth can judge what is asked, it is reached:", "; ".join(parts) + "."]


def page(kept):
    """The page as Markdown, of the rows that are kept."""
    ends = [end for _, end in kept]
    last, extrapolated = ([e for e in ends if e.extrapolated == of] for of in (False, True))
    rows = [
        [*one.values(), *(other[name] for name in VALUE)]
        for (one, _), (other, _) in zip(kept[::2], kept[1::2], strict=True)
    ]
    head = [*BEFORE, *VALUE, *(f"{name}, extrapolated" for name in VALUE)]
    head_of_summary = ["of", "asked", "scenes", *HEADS, "over best, median", "most",
                       "over common way, median", "most", "common way wrong"]  # fmt: skip
    return "\n".join(
        [
            "# What an accuracy that is asked for costs",
            "",
            "By `studies/run asked_accuracy`: `--accuracy` of the contact resultants, on meshes",
            "and with increments that the program chooses, of what the last mesh gives and, with",
            "`--extrapolated`, of what elements and increments without size would give. `told` is",
            "the error as the program says it, by mesh and load steps; `true` that against the",
            "limit of four fine meshes with fine increments, and `doubt` what is not known of that",
            f"limit: promises are judged where it is at most {JUDGED:g} of what is asked, and `?`",
            "marks those that are not. `elements` are those of the last run, with the `cuts` of",
            "elements at contact and the `parts` of each increment. Processor seconds, of all",
            f"`runs`, one thread, {machine()}. Scenes that are not in `input/` were made to be",
            "hard to judge; they are in `studies/data/scenes`. Those with an *own mesh* write",
            "nodes and elements down, and get no coarser ones.",
            "",
            "By hand nothing tells how accurate a run is: the seconds of the best are those of the",
            "one run that is enough, found afterwards, by the truth. What is common is to refine",
            "the mesh until the last change is less than what is asked, then the increments: the",
            "seconds are those of all runs on this way, and its error is what is left at the end.",
            "",
            *verdict(ends),
            f"Of the last mesh it is 0.5 to 5 times in {within(last)}, of extrapolated values,",
            "which are often closer to the truth than anything says, in "
            f"{within(extrapolated)}.",
            "",
            *reached_where_known(ends),
            "",
            *table(head_of_summary, summary(ends)),
            "",
            *table(head, rows),
            "",
        ]
    )


def main():
    """Run the scenes that are asked for, and write data and page."""
    options = program_options(__doc__)
    options.add_argument("-o", dest="page", type=Path, help="write the page here")
    options.add_argument("--only", default="", help="scenes, by parts of their names")
    options.add_argument("--page", dest="page_alone", action="store_true", help="no runs")
    options = options.parse_args()
    if not options.page_alone:
        program = built_program(options.bipot.resolve())
        for scene in SCENES:
            if any(part in scene.name for part in options.only.split(";")):
                keep(judge(program, scene))
    put_page(page(read_kept()), options.page)


if __name__ == "__main__":
    main()
