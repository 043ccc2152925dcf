"""Many runs of one deck, some at a time, resumed where they were: bipot.study.

    study = bipot.study(
        "input/block.inp", {"mu": [0.1, 0.2, 0.3], "n": [4, 8]}, folder="friction", processes=2,
        evaluate=lambda result: {"pushed": result.pairs[0].resultant[-1, 0]},
    )
    study.to_pandas()

Each run has a file in the folder, named by its parameters: `mu=0.2,n=8.vtkhdf`. The files are all
that there is: a study that was interrupted goes on when it is asked for again, with finished runs
read and stopped ones continued; one with more values runs what is new.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from bipot.deck import Deck
from bipot.errors import (
    DeckError,
    MachineError,
    NotSolvedError,
    RefusedError,
    ResultError,
    RunTimeoutError,
    StoppedError,
)
from bipot.executable import built_program
from bipot.result import Result
from bipot.running import DeckLike, Process, Progress, check, command_words, follow

if TYPE_CHECKING:
    import pandas

Settings = dict[str, Any]
Ended = tuple[str, str]
"""How a run ended that did not finish: its status and the program's words."""
Missing = tuple[Path, Settings, bool]
"""A run to be made: its file, all its parameters, whether to replace what is there."""
ENDED = {
    NotSolvedError: "not solved", MachineError: "failed", StoppedError: "stopped",
    RunTimeoutError: "stopped",
}
INCLUDED = re.compile(r'(?i)^\s*\*INCLUDE\s*,\s*INPUT\s*=\s*"?([^"]*?)"?\s*$')
NAMED_FILE = re.compile(r'(?im)^\s*\*OBSTACLE\b.*\bINPUT\s*=\s*"?([^",\r\n]*)')


class Study(Sequence[dict[str, Any]]):
    """The rows of a study, one a run, in the order of their parameters.

    A row has the parameters, `status` ("finished", "not solved", "stopped", "failed"),
    `increments` (how many are done), `certified` (whether all are), `seconds` (that the run took),
    `path`, `message` (why it did not end well), and what `evaluate` gave of its result.
    """

    def __init__(self, rows: list[dict[str, Any]]):
        self.rows = rows

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.rows)

    def __getitem__(self, which: Any) -> Any:
        return self.rows[which]

    def column(self, name: str) -> np.ndarray:
        """Return a column; not a number where a row has none. KeyError where no row has it."""
        if not any(name in row for row in self.rows):
            raise KeyError(name)
        return np.array([row.get(name, np.nan) for row in self.rows])

    def result(self, **parameters: Any) -> Result:
        """Open the result of the one run that has these parameters; ValueError if none or more."""
        found = [
            row for row in self.rows
            if all(name in row and row[name] == value for name, value in parameters.items())
        ]
        if len(found) != 1:
            raise ValueError(f"{len(found)} runs have {parameters}")
        return Result(found[0]["path"])

    def to_pandas(self) -> pandas.DataFrame:
        """Return the rows as a pandas.DataFrame."""
        import pandas

        return pandas.DataFrame(self.rows)

    def _repr_html_(self) -> str:
        """Return the rows as a table for a notebook."""
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        head = "".join(f"<th>{escape(name)}</th>" for name in names)
        body = "".join(
            "<tr>" + "".join(f"<td>{escape(str(row.get(name, '')))}</td>" for name in names)
            + "</tr>" for row in self.rows
        )
        return f"<table><tr>{head}</tr>{body}</table>"

    def __repr__(self) -> str:
        finished = sum(row["status"] == "finished" for row in self.rows)
        return f"<Study of {len(self.rows)} runs, {finished} finished>"


def combinations(vary: Mapping[str, Sequence[Any]] | Sequence[Settings]) -> list[Settings]:
    """Return all combinations of the lists, or the settings that are listed; none twice."""
    if isinstance(vary, Mapping):
        for name, values in vary.items():
            if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
                raise TypeError(f"the values of {name} must be a list, not {values!r}")
        settings = [
            dict(zip(vary, values, strict=True)) for values in itertools.product(*vary.values())
        ]
    else:
        settings = [dict(setting) for setting in vary]
    return list({run_name(setting): setting for setting in settings}.values())


def run_name(setting: Mapping[str, Any]) -> str:
    """Return the name of a run's file, without its ending."""
    words = (
        f"{name.lstrip('-')}={quote(str(value), safe='+')}" for name, value in setting.items()
    )
    return ",".join(words)


def _lines(text: str) -> list[str]:
    """Return what a deck says: no comments, no blanks at the end of lines."""
    lines = (line.rstrip() for line in re.split(r"\r\n|\n|\r", text))
    return [line for line in lines if line and not line.lstrip().startswith("**")]


def deck_lines(path: Path, above: tuple[Path, ...] = ()) -> list[str]:
    """Return the lines of a deck with those of its includes in their places."""
    found = []
    for line in _lines(path.read_text(encoding="utf-8", errors="replace")):
        match = INCLUDED.match(line)
        named = match and next(
            (place for place in (path.parent / match[1], Path(match[1])) if place.is_file()), None
        )
        if named and named.resolve() not in above:
            found += deck_lines(named, (*above, path.resolve()))
        else:
            found.append(line)
    return found


class _Runs:
    """The runs of a study: which are there, and what is to be done for the others."""

    def __init__(
        self, deck: Path, folder: Path, program: Path, accuracy: float | None, refine: int | None
    ):
        self.deck, self.folder, self.program = deck, folder, program
        self.accuracy, self.refine = accuracy, refine
        self.lines = deck_lines(deck) if deck.is_file() else []
        named = NAMED_FILE.findall("\n".join(self.lines))
        files = (deck.parent / name.strip() for name in named)
        self.newest = max((file.stat().st_mtime for file in files if file.is_file()), default=0.0)

    def path(self, setting: Settings) -> Path:
        """Return the file of a run."""
        return self.folder / f"{run_name(setting) or self.deck.stem}.vtkhdf"

    def found(self, setting: Settings, given: Settings) -> str | None:
        """Return the status of the file that a run has, None without one.

        RefusedError where it is another deck's or of other parameters.
        """
        path = self.path(setting)
        if not path.exists():
            return None
        with Result(path) as result:
            words = command_words(None, given, accuracy=self.accuracy, refine=self.refine)
            pairs = zip(words[::2], words[1::2], strict=True)
            wanted = {value.lower() if name == "--set" else f"{name} {value}"
                      for name, value in pairs}
            if self.accuracy is None:
                wanted.discard("--refine 0")  # told only where an accuracy would choose the mesh
            said = result.run_text("overrides").lower()
            matter = ""
            if {line.strip() for line in said.splitlines() if line.strip()} != wanted:
                matter = "with other parameters"
            elif _lines(result.run_text("deck")) != self.lines:
                matter = "of another deck, or of this one before it was changed"
            elif path.stat().st_mtime < self.newest:
                matter = "before a file that the deck names was changed"
            if matter:
                raise RefusedError(
                    f"{path} was made {matter}: give another folder, or overwrite=True"
                )
            return str(result.run.get("status"))


def study(
    deck: DeckLike, vary: Mapping[str, Sequence[Any]] | Sequence[Settings], *,
    folder: str | os.PathLike[str] = "study",
    processes: int = 1,
    evaluate: Callable[[Result], Mapping[str, Any]] | None = None,
    overwrite: bool = False,
    accuracy: float | None = None,
    refine: int | None = None,
    threads: int | None = 1,
    timeout: float | None = None,
    quiet: bool = False,
    program: str | os.PathLike[str] | None = None,
    parameters: Mapping[str, Any] | None = None,
    **values: Any,
) -> Study:
    """Run a deck with all combinations of parameters, and return a row for each run.

    deck       path of a text deck, or a Deck, which is written into the folder
    vary       {"mu": [0.1, 0.2], "n": [4, 8]}: all combinations; or a list of {"mu": 0.1, "n": 4}.
               The name "--refine" stands for that option: {"--refine": [0, 1, 2]}
    folder     of the runs' files; those that are finished are not run again, those that were
               stopped go on. A run without a solution is kept if it has an increment
    processes  runs at a time
    evaluate   takes each finished result and returns more columns; called when all runs are done
    overwrite  run again what is there of another deck or of other parameters
    accuracy, refine, threads, timeout, program, and parameters that all runs share: as bipot.run

    A run that is not solved, stopped by `timeout` or failed by the machine is a row that says so.
    DeckError, before anything is run, where the deck is wrong with any of the settings;
    RefusedError where the folder has files of another deck. A KeyboardInterrupt stops all runs,
    which keep what is done, and is raised again.
    """
    if processes < 1:
        raise ValueError(f"processes must be 1 or more, not {processes}")
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    path = deck.write(place / f"{deck.name}.inp") if isinstance(deck, Deck) else Path(deck)
    runs = _Runs(path, place, built_program(program), accuracy, refine)
    fixed = {**(parameters or {}), **values}
    settings = combinations(vary)
    missing: list[Missing] = []
    for setting in settings:
        given = {**fixed, **setting}
        try:
            status = runs.found(setting, given)
            again = False
        except (RefusedError, ResultError):
            if not overwrite:
                raise
            status, again = None, True
        if status in ("finished", "settled", "not solved"):
            continue
        mistakes = check(path, parameters=given, program=runs.program)
        if mistakes:
            words = "; ".join(map(str, mistakes))
            raise DeckError(f"{run_name(setting)}: {words}", 1, tuple(mistakes))
        missing.append((runs.path(setting), given, again))
    told = Progress(place.name, not quiet, "run")
    ended = _run_missing(runs, missing, processes, threads, timeout, told)
    paths = map(runs.path, settings)
    return Study([
        _row(setting, path, ended.get(path), evaluate)
        for setting, path in zip(settings, paths, strict=True)
    ])


def _run_missing(
    runs: _Runs, missing: list[Missing], processes: int, threads: int | None,
    timeout: float | None, told: Progress,
) -> dict[Path, Ended]:
    """Run what is missing, so many at a time; return how those ended that did not finish."""
    failures: dict[Path, Ended] = {}
    alive: set[Process] = set()
    halted = False

    def one(path: Path, given: Settings, again: bool) -> None:
        if halted:
            return
        words = command_words(
            None, given, accuracy=runs.accuracy, refine=runs.refine, overwrite=again,
            resume=not again,
        )
        command = [runs.program, runs.deck, "-o", path, *words]
        started: list[Process] = []

        def note(process: Process) -> None:
            started.append(process)
            alive.add(process)
            if halted:
                process.stop()

        try:
            follow(command, path, threads, timeout, None, note).close()
        except (NotSolvedError, MachineError, StoppedError) as error:
            failures[path] = (ENDED[type(error)], str(error))
            if error.result is not None:
                error.result.close()
        finally:
            alive.difference_update(started)

    with ThreadPoolExecutor(processes) as pool:
        waiting = {pool.submit(one, *run) for run in missing}
        done = 0
        try:
            told(0, len(missing))
            while waiting:
                ended, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in ended:
                    future.result()
                done += len(ended)
                told(done, len(missing))
        except BaseException:
            halted = True
            pool.shutdown(wait=False, cancel_futures=True)
            for process in tuple(alive):
                process.stop()
            raise
        finally:
            told.close()
    return failures


def _row(
    setting: Settings, path: Path, ended: Ended | None,
    evaluate: Callable[[Result], Mapping[str, Any]] | None,
) -> dict[str, Any]:
    """Return the row of a run."""
    status, message = ended or ("failed", "")
    row = {**setting, "status": status, "increments": 0, "certified": False,
           "seconds": float("nan"), "path": str(path), "message": message}
    if not path.exists():  # not one increment was finished
        return row
    with Result(path) as result:
        if ended is None:
            row["status"] = str(result.run.get("status"))
        row["increments"], row["certified"] = result.finished, result.certified
        if "counters" in result.file["run"]:
            row["seconds"] = result.counters["seconds_total"]
        if row["status"] in ("finished", "settled") and evaluate is not None:
            more = evaluate(result)
            if taken := sorted(more.keys() & row.keys()):
                raise ValueError(
                    f"evaluate must not return {', '.join(taken)}: the study has a column of that"
                    " name already"
                )
            row |= more
    return row
