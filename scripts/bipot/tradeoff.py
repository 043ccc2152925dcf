"""Measure what accuracy costs: runs of a deck under many settings, held against a reference.

    scripts/tradeoff DECK

runs the deck on finer meshes, with more increments, with other types of the same elements, at small
and at finite strain, and with --accuracy, each if its plan is within --seconds; the reference is
the finest of all at finite strain that is, else at the deck's own, and its own error is what a
coarser mesh and longer increments change of it. Or settings and reference are given:

    scripts/tradeoff input/block.inp --reference n=24,steps=100,solver=AUTO,local=AUTO \\
        --vary n=2,4,8,16 --vary tolerance=1e-2,1e-4,1e-8 --also solver=AUTO,local=AUTO

Names are parameters of the deck, as `bipot --set` takes them, or --refine, how often every element
of any mesh is cut into eight: `--vary=--refine=0,1 --reference=--refine=2`. All combinations of the
--vary lists are run, once as the deck stands and once with each --also, which may also pin a varied
name. The error of a run is its largest difference from the reference over contact pairs and ends of
*STEPs, relative to the largest value of the reference. Its time is processor time without what
reading the deck and writing the result took, its memory the most it ever had; both are medians over
--repeat.

A reference given three times, from coarse to fine, each as much finer than the one before, is
extrapolated (Richardson, by the order that the three show): where no run can be much better than
those it is to judge.

In the -o folder, NAME being the deck's: NAME-tradeoff.csv, a line a run, which an interrupted study
goes on from; NAME-tradeoff-table.csv, a line a setting; and two work-precision diagrams,
NAME-tradeoff-time.png and NAME-tradeoff-memory.png. Other errors of the same runs (--quantity) and
other references cost no run again. Runs of another program or deck are left in the file, unused.
"""

import argparse
import csv
import hashlib
import itertools
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.ticker import LogLocator

from bipot.figures import BLUE, INK, new_axes, save
from bipot.parameter_study import deck_lines
from bipot.program import ROOT, RunError, block_words, built_program, run_block, script_options
from bipot.report import Bar
from bipot.result import Result, ResultError
from bipot.tradeoff_settings import (
    INCREMENTS,
    TYPE,
    candidates,
    changed_deck,
    planned_seconds,
    references,
)

NOT_SOLVED = 2  # exit status of bipot: an increment found no solution
ENDED = (0, NOT_SOLVED)  # what a second run would only repeat; other failures are tried again
GAIN = 0.05  # relative difference of costs or errors below which they are the same
LEVELS = {0.1: "10 %", 0.01: "1 %", 0.001: "0.1 %"}
GREY = "#a0a0a0"
MARKS = "os^Dv<>Pph"


def mean_slip(pair):
    """Return the mean slip of a pair's surface, (T,): 0 on a surface of nodes, without area."""
    area = pair.area.sum()
    return np.linalg.norm(pair.slip, axis=2) @ pair.area / (area if area > 0 else 1)


# What a run is asked for at the ends of its *STEPs, one row each, as columns of the csv file.
QUANTITIES = {
    "resultant": lambda result, ends: [pair.resultant[ends] for pair in result.pairs.values()],
    "friction": lambda result, ends: [pair.friction_sum[ends] for pair in result.pairs.values()],
    "slip": lambda result, ends: [mean_slip(pair)[ends] for pair in result.pairs.values()],
    "energy/strain": lambda result, ends: [result.history("energy/strain")[ends]],
    "energy/dissipation": lambda result, ends: [result.history("energy/dissipation")[ends]],
}
COLUMNS = (
    "program", "settings", "repetition", "status", "message", "seconds", "memory_bytes",
    "equations", "increments", "certified", *QUANTITIES,
)


class TradeoffError(Exception):
    """The study cannot be made."""


# --- Settings -------------------------------------------------------------------------------------
# A setting is a dictionary of the deck's parameters and their values, all text; its name, such as
# "n=8,solver=AUTO", is what the csv file and the command line know it by.


def read_setting(text):
    """Return the setting of a text such as "n=8,solver=AUTO"; ValueError where it is none."""
    setting = {}
    for word in text.split(","):
        name, equals, value = (part.strip() for part in word.partition("="))
        if not (name and equals and value):
            raise argparse.ArgumentTypeError(f"expected NAME=VALUE,..., found '{text}'")
        if name.lower() in setting:
            raise argparse.ArgumentTypeError(f"'{name}' stands twice in '{text}'")
        setting[name.lower()] = value
    return setting


def read_reference(text):
    """Return the setting of a text, or the path where it names a result file."""
    return Path(text) if text.endswith(".vtkhdf") else read_setting(text)


def read_values(text):
    """Return name and values of a text such as "n=2,4,8"."""
    name, equals, values = text.partition("=")
    values = [value.strip() for value in values.split(",")]
    if not (name.strip() and equals and all(values)):
        raise argparse.ArgumentTypeError(f"expected NAME=VALUE,VALUE,..., found '{text}'")
    return name.strip().lower(), list(dict.fromkeys(values))


def setting_name(setting):
    """Return the name of a setting, the same in whatever order its parameters came."""
    return ",".join(f"{name}={value}" for name, value in sorted(setting.items()))


def combinations(varied, also=()):
    """Return the settings: all combinations of `varied`, a list of (name, values), as they are and
    with each setting of `also` put over them; none twice."""
    names = [name for name, _ in varied]
    if len(set(names)) < len(names):
        raise TradeoffError(f"--vary names a parameter twice: {', '.join(names)}")
    settings = {}
    for more in ({}, *also):
        for values in itertools.product(*(values for _, values in varied)):
            setting = dict(zip(names, values, strict=True)) | more
            settings.setdefault(setting_name(setting), setting)
    return list(settings.values())


def is_number(text):
    """Tell whether a parameter's value is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


# --- Runs -----------------------------------------------------------------------------------------


def read_quantities(result):
    """Return the quantities of a result at the ends of its *STEPs: arrays (steps, components)."""
    ends = result.step_ends
    found = {}
    for name, values in QUANTITIES.items():
        parts = [np.reshape(part, (len(ends), -1)) for part in values(result, ends)]
        found[name] = np.concatenate(parts, axis=1) if parts else np.zeros((len(ends), 0))
    return found


class Study:
    """The runs of a deck, and the csv file that keeps them."""

    def __init__(self, program, deck, folder):
        """Read the runs that `folder` has; raise TradeoffError where its file is another's."""
        if not deck.is_file():
            raise TradeoffError(f"no deck at {deck}")
        self.program, self.deck, self.folder = built_program(program), deck.resolve(), folder
        version = subprocess.run(
            [self.program, "--version"], capture_output=True, text=True, check=True
        )
        said = "\n".join(deck_lines(self.deck)).encode()
        digest = hashlib.sha256(self.program.read_bytes() + said).hexdigest()
        self.maker = f"{version.stdout.strip()} {digest[:12]}"
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / f"{deck.stem}-tradeoff.csv"
        self.rows = [row for row in self._kept() if row["program"] == self.maker]

    def _kept(self):
        """Return the rows of the file; what an interruption left of a line is cut off."""
        if not self.path.is_file() or self.path.stat().st_size == 0:
            with self.path.open("w", encoding="utf-8", newline="") as file:
                csv.writer(file, lineterminator="\n").writerow(COLUMNS)
        text = self.path.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        reader = csv.DictReader(whole.splitlines())
        if tuple(reader.fieldnames or ()) != COLUMNS:
            raise TradeoffError(f"{self.path} has other columns than a study's; move it away")
        if whole != text:
            self.path.write_text(whole, encoding="utf-8")
        return list(reader)

    def runs_of(self, setting):
        """Return the rows of a setting that no second run would change."""
        name = setting_name(setting)
        return [
            row for row in self.rows if row["settings"] == name and int(row["status"]) in ENDED
        ]

    def may_solve(self, setting):
        """Tell whether no run of a setting ended without a solution."""
        return all(row["status"] == "0" for row in self.runs_of(setting))

    def words_of(self, setting):
        """Return the deck of a setting, and the settings that are the program's."""
        changes = {name: value for name, value in setting.items() if name in (INCREMENTS, TYPE)}
        others = {name: value for name, value in setting.items() if name not in changes}
        if not changes:
            return self.deck, others
        name = setting_name(changes).replace("--", "").replace("=", "-").replace(",", "-")
        path = self.folder / f"{self.deck.stem}-{name}.inp"
        path.write_text(changed_deck(self.flat_deck(), changes), encoding="utf-8")
        return path.resolve(), others

    def flat_deck(self):
        """Return the deck as one text, without parameters."""
        done = subprocess.run([self.program, self.deck, "--flat"], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, check=False)
        if done.returncode:
            raise TradeoffError(done.stderr.strip().splitlines()[0])
        return done.stdout

    def within(self, settings, limit):
        """Return those settings whose plan is within so many seconds; say why others are not."""
        found = []
        for setting in settings:
            if self.runs_of(setting):
                found.append(setting)
                continue
            deck, others = self.words_of(setting)
            seconds, refused = planned_seconds(self.program, block_words(deck, others))
            if refused or (seconds is not None and seconds > limit):
                print(f"left out: {setting_name(setting)}: "
                      f"{refused or f'{seconds:.0f} s by its plan'}", file=sys.stderr)
            else:
                found.append(setting)
        return found

    def own_reference(self, quantity, limit):
        """Return the finest reference within a limit, as `reference` does, and its own error in its
        words: what a coarser mesh and longer increments change."""
        said = {}
        for three in references(self.flat_deck()):
            if any(setting_name(one) in said for one in three):
                continue
            deck, others = self.words_of(three[0])
            seconds, refused = planned_seconds(self.program, block_words(deck, others))
            if refused or seconds is None or seconds > limit:
                continue
            try:
                found = [self.one_reference(one, quantity) for one in three]
            except TradeoffError as error:
                said[setting_name(three[0])] = error
                continue
            (values, words), (coarser, _), (longer, _) = found
            mesh = relative_error(coarser, values)
            steps = relative_error(longer, coarser)
            return values, (f"{words} (its own error: mesh {percent(mesh)}, load steps "
                            f"{percent(steps)})")
        more = f": {next(iter(said.values()))}" if said else ""
        raise TradeoffError(f"no reference within {limit:g} s{more}")

    def check(self, settings):
        """Have the program check the deck with these settings; TradeoffError with its words."""
        for setting in settings:
            if self.runs_of(setting):
                continue
            done = subprocess.run(
                [self.program, *block_words(*self.words_of(setting)), "--plan", "--quiet"],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
            )
            if done.returncode == 1:
                lines = [line for line in done.stderr.splitlines() if "error:" in line]
                more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
                raise TradeoffError(f"{setting_name(setting)}: {lines[0].strip()}{more}")

    def run(self, setting):
        """Run a setting once more and keep its row."""
        row = dict.fromkeys(COLUMNS, "")
        row |= {"program": self.maker, "settings": setting_name(setting)}
        row["repetition"] = str(len(self.runs_of(setting)) + 1)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.vtkhdf"
            before = processor_seconds()
            deck, others = self.words_of(setting)
            done = run_block(
                self.program, path, others, deck, capture_output=True, text=True,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            )
            spent = processor_seconds() - before
            if done.returncode in (130, 143):
                raise KeyboardInterrupt
            row["status"] = str(done.returncode)
            if done.returncode == 0:
                row |= measured(path, spent)
            else:
                said = done.stderr.strip().splitlines() or [f"ended with {done.returncode}"]
                row["message"] = said[0]
        self.rows.append(row)
        # One write a line: an interruption leaves whole lines but for the last.
        with self.path.open("a", encoding="utf-8", newline="") as file:
            csv.DictWriter(file, COLUMNS, lineterminator="\n").writerow(row)
        return row

    def complete(self, settings, repeat):
        """Run what is missing for `repeat` runs of each setting, with a bar.

        All settings take turns, so that what else the machine does meets all alike. What is not
        solved is run once.
        """
        self.check(settings)
        turns = [
            (setting, turn) for turn in range(repeat) for setting in settings
            if len(self.runs_of(setting)) <= turn and self.may_solve(setting)
        ]
        bar = Bar(len(turns))
        failed = set()
        for setting, turn in turns:
            name = setting_name(setting)
            bar.show(f"{name} ({turn + 1} of {repeat})")
            if name not in failed and self.may_solve(setting):
                row = self.run(setting)
                if int(row["status"]) not in ENDED:
                    failed.add(name)
            bar.advance(1)
        bar.close()

    def reference(self, given, quantity):
        """Return a quantity of the reference (steps, components), and words for where it is from.

        `given` lists settings, run once and kept, or paths of result files: one, or three to
        extrapolate from.
        """
        found = [self.one_reference(one, quantity) for one in given]
        values, words = found[-1]
        if len(found) > 1:
            values, distance = extrapolate([value for value, _ in found])
            words += f", extrapolated by {100 * distance:.2g} %" if distance else (
                " (not extrapolated: the three do not approach a limit)"
            )
        return values, words

    def one_reference(self, given, quantity):
        """Return a quantity of a setting or a result file (steps, components), and its name."""
        if isinstance(given, Path):
            with Result(given) as result:
                values, words = read_quantities(result)[quantity], str(given)
        else:
            name = setting_name(given)
            self.check([given])
            row = next(iter(self.runs_of(given)), None)
            if row is None:
                print(f"reference: {name}", file=sys.stderr, flush=True)
                row = self.run(given)
            if row["status"] != "0":
                raise TradeoffError(f"the reference {name} has no result: {row['message']}")
            if row["certified"] != row["increments"]:
                raise TradeoffError(f"the reference {name} has increments that are not certified")
            values, words = read_row(row, quantity), name
        if values.size == 0:
            raise TradeoffError(f"no {quantity} in the reference {words}: there is no contact pair")
        if not np.abs(values).max() > 0:
            raise TradeoffError(f"{quantity} is 0 in the reference {words}; choose another")
        return values, words


def percent(part):
    """Return a part in per cent, with two digits."""
    return f"{100 * part:.2g} %"


def processor_seconds():
    """Return the processor time of all runs so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measured(path, spent):
    """Return the columns of a run that went through and `spent` so much processor time.

    The program's own counters are of wall time, which on a shared machine is other people's too:
    only the shares of reading and writing are taken from there.
    """
    with Result(path) as result:
        counters = result.counters
        aside = (counters["seconds_read"] + counters["seconds_write"]) / counters["seconds_total"]
        row = {
            "seconds": f"{spent * (1 - aside):.6g}",
            "memory_bytes": f"{counters['peak_memory_bytes']:.0f}",
            "equations": f"{counters['equations']:.0f}",
            "increments": str(result.finished),
            "certified": str(int((result.history("certified") == 1).sum())),
        }
        for name, values in read_quantities(result).items():
            steps = (" ".join(f"{value:.17g}" for value in step) for step in values)
            row[name] = "; ".join(steps)
    return row


def read_row(row, quantity):
    """Return a quantity of a row of the csv file, (steps, components)."""
    return np.array([[float(word) for word in step.split()] for step in row[quantity].split(";")])


# --- Errors, and who is dominated -----------------------------------------------------------------


@dataclass
class Point:
    """What came of a setting; not a number where it has no result."""

    setting: dict
    outcome: str  # "solved", "not solved", "failed", "not run"
    message: str = ""
    error: float = np.nan  # relative
    seconds: float = np.nan
    memory: float = np.nan  # bytes
    equations: int = 0
    increments: int = 0
    certified: int = 0
    repeats: int = 0


def extrapolate(values):
    """Return the limit of three arrays, coarse to fine, and how far it is from the last, relative.

    Between one and the next the distance to the limit shrinks by the same factor (Richardson). One
    factor for all entries, as entries that are 0 but for rounding have none of their own. Where the
    steps do not shrink, or turn back, the last array and 0.
    """
    earlier, later = values[0] - values[1], values[1] - values[2]
    size = np.vdot(later, later)
    ratio = np.vdot(earlier, later) / size if size > 0 else 0.0
    if ratio <= 1:
        return values[2], 0.0
    limit = values[2] + (values[2] - values[1]) / (ratio - 1)
    return limit, relative_error(values[2], limit)


def relative_error(found, expected):
    """Return the largest difference over the largest expected value; arrays of the same shape."""
    if found.shape != expected.shape:
        raise TradeoffError(
            f"the reference has {expected.shape[0]} steps of {expected.shape[1]} values, a run has"
            f" {found.shape[0]} of {found.shape[1]}: other *STEPs or contact pairs"
        )
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def measure(study, settings, reference, quantity):
    """Return a Point of each setting, its error by `reference`, an array of `quantity`."""
    points = []
    for setting in settings:
        name = setting_name(setting)
        rows = [row for row in study.rows if row["settings"] == name]
        solved = [row for row in rows if row["status"] == "0"]
        if not rows:
            points.append(Point(setting, "not run"))
        elif not solved:
            outcome = "not solved" if rows[-1]["status"] == str(NOT_SOLVED) else "failed"
            points.append(Point(setting, outcome, rows[-1]["message"], repeats=len(rows)))
        else:
            last = solved[-1]
            points.append(Point(
                setting, "solved",
                error=relative_error(read_row(last, quantity), reference),
                seconds=statistics.median(float(row["seconds"]) for row in solved),
                memory=statistics.median(float(row["memory_bytes"]) for row in solved),
                equations=int(last["equations"]), increments=int(last["increments"]),
                certified=int(last["certified"]), repeats=len(solved),
            ))
    return points


def pareto_front(points, cost):
    """Return the points that no other beats in `cost` ("seconds", "memory") and error, cheapest
    first.

    What differs by less than GAIN is the same: otherwise the last digits of a time, or a page of
    memory, would put every setting of equal error on the front.
    """
    def paid(point):
        return getattr(point, cost)

    solved = [point for point in points if np.isfinite(point.error)]
    front = []
    for point in sorted(solved, key=lambda point: (paid(point), point.error)):
        if front and point.error >= (1 - GAIN) * front[-1].error:
            continue
        while front and paid(point) <= (1 + GAIN) * paid(front[-1]):
            front.pop()
        front.append(point)
    return front


def cheapest(points, level, cost="seconds"):
    """Return the cheapest point with an error of at most `level`, or None."""
    good = [point for point in points if point.error <= level]
    return min(good, key=lambda point: getattr(point, cost), default=None)


def sentence(points):
    """Return the sentence that names the cheapest setting of each level."""
    shown = varied_names(points)
    parts = []
    for level, words in LEVELS.items():
        best = cheapest(points, level)
        if best is None:
            parts.append(f"for {words} none of these settings")
        else:
            parts.append(
                f"for {words} {label(best, shown)} ({cost_text(best.seconds, 'seconds')},"
                f" {cost_text(best.memory, 'memory')})"
            )
    return f"Cheapest: {'; '.join(parts)}."


# --- Tables and figures ---------------------------------------------------------------------------


def varied_names(points):
    """Return the names of parameters in which the points differ, in the order they came."""
    names = dict.fromkeys(name for point in points for name in point.setting)
    return [name for name in names if len({point.setting.get(name) for point in points}) > 1]


def label(point, names):
    """Return the values of some of a point's parameters as text; "the deck" where it sets none."""
    words = [f"{name}={point.setting[name]}" for name in names if name in point.setting]
    return ", ".join(words) or "the deck"


def cost_text(value, cost):
    """Return a cost with its unit: seconds, or memory in MB."""
    return f"{value:.2g} s" if cost == "seconds" else f"{value / 1e6:.0f} MB"


def table_rows(points):
    """Return head and rows, in text, of the table of all settings, the most exact first."""
    names = list(dict.fromkeys(name for point in points for name in point.setting))
    fronts = {
        cost: {id(point) for point in pareto_front(points, cost)} for cost in ("seconds", "memory")
    }
    head = [
        *names, "outcome", "error", "seconds", "memory_bytes", "equations", "increments",
        "certified", "runs", "front", "message",
    ]
    rows = []
    for point in sorted(points, key=lambda point: (np.isnan(point.error), point.error)):
        front = "+".join(
            word for word, cost in (("time", "seconds"), ("memory", "memory"))
            if id(point) in fronts[cost]
        )
        numbers = [f"{point.error:.3e}", f"{point.seconds:.3g}", f"{point.memory:.0f}",
                   point.equations, point.increments, point.certified]
        if point.outcome != "solved":
            numbers = [""] * len(numbers)
        rows.append([
            *(point.setting.get(name, "") for name in names), point.outcome, *map(str, numbers),
            str(point.repeats), front, point.message,
        ])
    return head, rows


def print_table(points):
    """Print the table with aligned columns, without the messages."""
    head, rows = table_rows(points)
    lines = [line[:-1] for line in (head, *rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        cells = (cell.rjust(width) for cell, width in zip(line, widths, strict=True))
        print("  ".join(cells).rstrip())


def methods(points):
    """Return the points by method: by the values of the varied parameters that are words."""
    words = [
        name for name in varied_names(points)
        if not all(is_number(p.setting[name]) for p in points if name in p.setting)
    ]
    groups = {}
    for point in points:
        groups.setdefault(label(point, words) if words else "", []).append(point)
    return groups


def draw(axes, points, cost, place=None):
    """Draw a work-precision diagram: error against `cost` ("seconds" or "memory"), log-log.

    A mark a method; the Pareto front in blue, joined and labelled, what it dominates in grey.
    """
    front = pareto_front(points, cost)
    unit = 1e-6 if cost == "memory" else 1.0
    numbers = [
        name for name in varied_names(points)
        if all(is_number(p.setting[name]) for p in points if name in p.setting)
    ]
    axes.set_xscale("log")
    axes.set_yscale("log")
    # An error of exactly 0 has no place on a logarithmic axis.
    least = min((p.error for p in points if p.error > 0), default=1.0) / 3
    for (name, group), mark in zip(methods(points).items(), itertools.cycle(MARKS), strict=False):
        ahead = [point for point in group if any(point is other for other in front)]
        behind = [
            point for point in group
            if np.isfinite(point.error) and not any(point is other for other in front)
        ]
        for chosen, colour, fill, order in ((behind, GREY, "none", 2), (ahead, BLUE, BLUE, 3)):
            axes.plot(
                [max(point.error, least) for point in chosen],
                [unit * getattr(point, cost) for point in chosen],
                mark, color=colour, markerfacecolor=fill, markersize=5, zorder=order,
            )
        if name and ahead + behind:
            axes.plot([], [], mark, color=INK, markerfacecolor="none", markersize=5, label=name)
    axes.plot(
        [max(point.error, least) for point in front],
        [unit * getattr(point, cost) for point in front],
        "-", color=BLUE, linewidth=1, label="Pareto front",
    )
    lost = sum(point.outcome != "solved" for point in points)
    if lost:
        axes.plot([], [], " ", label=f"(not solved: {lost} of {len(points)} settings)")
    annotate(axes, front, numbers, lambda p: (max(p.error, least), unit * getattr(p, cost)))
    plain_ticks(axes.yaxis)
    axes.set_xlabel(place or "error relative to the reference")
    axes.set_ylabel("memory (MB)" if cost == "memory" else "processor time (s)")
    axes.legend(fontsize=7)


def plain_ticks(axis):
    """Write the ticks of a logarithmic axis as plain numbers, more of them on a short one."""
    low, high = axis.get_view_interval()
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    if high / low < 30:
        axis.set_minor_locator(LogLocator(subs=(2, 5)))
        axis.set_minor_formatter(lambda value, _: f"{value:g}")


def annotate(axes, front, names, where):
    """Label the points of the front, but none too near to one that has a label."""
    shown = []
    axes.autoscale_view()  # or the pixels below are those of other limits
    for point in front:
        text = ", ".join(f"{name}={point.setting[name]}" for name in names if name in point.setting)
        pixel = axes.transData.transform(where(point))
        if text and all(abs(pixel[1] - other[1]) > 12 or abs(pixel[0] - other[0]) > 90
                        for other in shown):
            axes.annotate(text, where(point), xytext=(5, 3), textcoords="offset points",
                          fontsize=7, color=INK)
            shown.append(pixel)


def report(study, points, words, quantity):
    """Print table and sentence; write the table as csv and both figures."""
    base = study.folder / f"{study.deck.stem}-tradeoff"
    print(f"error of {quantity} at the ends of the steps, against {words}")
    print_table(points)
    for point in points:
        if point.message:
            print(f"{setting_name(point.setting)}: {point.message}")
    print(sentence(points))
    head, rows = table_rows(points)
    path = base.with_name(f"{base.name}-table.csv")
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])
    print(path)
    for cost, name in (("seconds", "time"), ("memory", "memory")):
        figure, axes = new_axes()
        draw(axes, points, cost, f"error of {quantity} against {words}")
        save(figure, base.with_name(f"{base.name}-{name}.png"))


def command_line(words=None):
    """Return the command line's options."""
    where = ROOT / "build" / "tradeoff"
    parser = script_options(__doc__, where, "the runs, the table and the figures go")
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = __doc__
    parser.add_argument("deck", type=Path, help="the deck, DECK.inp")
    parser.add_argument(
        "--vary", action="append", type=read_values, default=[], metavar="NAME=V,V,...",
        help="a parameter and its values; several make all combinations",
    )
    parser.add_argument(
        "--also", action="append", type=read_setting, default=[], metavar="NAME=V,NAME=V,...",
        help="all combinations once more, with these set",
    )
    parser.add_argument(
        "--reference", action="append", type=read_reference, default=[],
        metavar="NAME=V,...|FILE",
        help="what errors are measured from: the deck with these set, or a result (.vtkhdf);"
        " three times: extrapolated",
    )
    parser.add_argument(
        "--quantity", choices=tuple(QUANTITIES), default="resultant",
        help="resultant: force vectors of the contact pairs (default); friction: sums of the"
        " magnitudes of the points' friction forces; slip: its mean over each pair's surface,"
        " open points too; energies of the whole model",
    )
    parser.add_argument("--repeat", type=int, default=None,
                        help="runs of each setting (3; of those that the program chooses 1)")
    parser.add_argument(
        "--seconds", type=float, default=60.0,
        help="of each run that the program chooses, by its plan (60)",
    )
    options = parser.parse_args(words)
    chooses = not (options.vary or options.also or options.reference)
    if options.repeat is None:
        options.repeat = 1 if chooses else 3
    if options.repeat < 1:
        parser.error("--repeat must be 1 or more")
    if not options.seconds > 0:
        parser.error("--seconds must be above 0")
    if not chooses and len(options.reference) not in (1, 3):
        parser.error(f"--reference is given once or three times, not {len(options.reference)}")
    return options


def main():
    """Run what is missing and report."""
    options = command_line()
    try:
        study = Study(options.bipot, options.deck, options.folder)
        if options.reference:
            settings = combinations(options.vary, options.also)
            study.check(settings)
            reference, words = study.reference(options.reference, options.quantity)
        else:
            settings = study.within(candidates(study.flat_deck()), options.seconds)
            reference, words = study.own_reference(options.quantity, options.seconds)
            if "--nlgeom" not in words:
                # Small strain is no judge of finite strain.
                settings = [setting for setting in settings if setting.get("--nlgeom") != "yes"]
        study.complete(settings, options.repeat)
        points = measure(study, settings, reference, options.quantity)
        report(study, points, words, options.quantity)
    except (TradeoffError, RunError, ResultError) as error:
        sys.exit(f"tradeoff: {error}")
    except KeyboardInterrupt:
        sys.exit("tradeoff: stopped; the same command goes on from here")
