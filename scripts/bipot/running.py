"""Run the program from Python: bipot.run, bipot.plan, bipot.check, bipot.flat.

    import bipot

    result = bipot.run("input/block.inp", n=8, mu=0.2)
    print(result.pairs["BODY-ZMIN:GROUND"].resultant[-1])

A deck is the path of a text, or a bipot.Deck. Parameters of the deck are keyword arguments, as
`--set` has them; where one is called like an argument of the function, `parameters={...}` takes it.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any

from bipot.deck import Deck
from bipot.errors import (
    DeckError,
    MachineError,
    Message,
    NotSolvedError,
    RefusedError,
    ResultError,
    RunError,
    RunTimeoutError,
    StoppedError,
)
from bipot.executable import built_program, set_words, with_threads
from bipot.result import Result

DeckLike = str | os.PathLike[str] | Deck

# How long a program that was told to stop may go on with its increment [s]; told twice, it stops
# at once, and after that it is killed.
GRACE = 10.0
# How long the words of one that a signal has reached already may take to be read [s].
NOTICE = 0.2
STOPPING = "stopping within a second"
HDF5_BEGINS = b"\x89HDF"
AT_PLACE = re.compile(r"^(?!bipot: )(.+?)(?::(\d+):(\d+))?: error: (.*)$")
DONE_OF = re.compile(r"  (\d+) of (\d+)(?:, .* left)?$")


# --- Commands -------------------------------------------------------------------------------------


@contextmanager
def _deck_file(deck: DeckLike) -> Iterator[tuple[str, str | None]]:
    """Give the path of a deck, and the folder that it is relative to (None: the working directory).

    A deck built in Python is written for a while.
    """
    if not isinstance(deck, Deck):
        path = os.fspath(deck)
        _refuse_hdf5(path)
        yield path, None
    else:
        with tempfile.TemporaryDirectory(prefix="bipot-") as holder:
            yield deck.write(Path(holder) / f"{deck.name}.inp").name, holder


def _refuse_hdf5(path: str) -> None:
    """Raise RefusedError where a deck's path is that of a result or of a contact problem."""
    try:
        with open(path, "rb") as file:
            begins = file.read(4)
    except OSError:
        return  # the program's own message is the better one
    if begins == HDF5_BEGINS:
        raise RefusedError(f"{path} is an HDF5 file, not a deck; bipot.read opens a result")


def command_words(
    parameters: Mapping[str, Any] | None, more: Mapping[str, Any], *,
    accuracy: float | None = None, extrapolated: bool = False, time: float | None = None,
    memory: str | None = None, refine: int | None = None, nlgeom: str | None = None,
    overwrite: bool = False, resume: bool = False, force: bool = False,
) -> list[str]:
    """Return a deck's parameters and the options of a run as words of the command line."""
    settings = {**(parameters or {}), **more}
    for name, value in settings.items():
        if isinstance(value, bool) or not (isinstance(value, str) or hasattr(value, "__float__")):
            raise TypeError(f"parameter {name} must be a number or a text, not {value!r}")
    words = set_words(settings)
    words += [] if accuracy is None else ["--accuracy", str(accuracy)]
    words += [] if time is None else ["--time", str(time)]
    words += [] if memory is None else ["--memory", str(memory)]
    words += ["--refine", str(refine)] if refine is not None else []
    words += ["--nlgeom", nlgeom] if nlgeom is not None else []
    flags = {
        "--extrapolated": extrapolated, "--overwrite": overwrite, "--continue": resume,
        "--force": force,
    }  # fmt: skip
    return words + [flag for flag, wanted in flags.items() if wanted]


def _messages(said: str) -> tuple[Message, ...]:
    """Return the mistakes of a deck that the program has told, each with its hints."""
    found: list[Message] = []
    below: list[str] = []  # the lines under the last mistake: the deck's own with a caret, hints

    def add_hints() -> None:
        marks = [i for i, line in enumerate(below) if line.strip() == "^"]
        hints = below[marks[-1] + 1 :] if marks else below
        if found and hints:
            text = "; ".join([found[-1].text, *(line.strip() for line in hints)])
            found[-1] = replace(found[-1], text=text)
        below.clear()

    for line in said.splitlines():
        match = AT_PLACE.match(line)
        if match:
            add_hints()
            file, row, column, text = match.groups()
            found.append(Message(file, int(row or 1), int(column or 1), text))
        elif line.startswith("  "):
            below.append(line)
    add_hints()
    return tuple(found)


def _ask(
    deck: DeckLike, program: str | os.PathLike[str] | None, words: list[str]
) -> subprocess.CompletedProcess[str]:
    """Run the program with words that have it tell something of a deck, and compute nothing."""
    with _deck_file(deck) as (path, folder):
        return subprocess.run(
            [built_program(program), path, *words], cwd=folder, stdin=subprocess.DEVNULL,
            capture_output=True, encoding="utf-8", errors="replace", check=False,
        )


def _error(status: int, said: str, output: str, result: Result | None = None) -> RunError:
    """Return the exception for an exit status other than 0."""
    words = said.strip() or "\n".join(output.strip().splitlines()[-3:])
    message = words or f"bipot ended with status {status}"
    if status == 1:
        mistakes = _messages(said)
        if mistakes:
            return DeckError(message, status, mistakes)
        return RefusedError(message, status)
    kinds = {2: NotSolvedError, 3: MachineError, 130: StoppedError, 143: StoppedError}
    kind = kinds.get(status, StoppedError if status < 0 else MachineError)
    return kind(message, status, result)


def check(
    deck: DeckLike, *, parameters: Mapping[str, Any] | None = None,
    program: str | os.PathLike[str] | None = None, **values: Any,
) -> list[Message]:
    """Return all mistakes of a deck, in their order; an empty list where it has none.

    Nothing is computed and nothing raised for a wrong deck: `str(message)` is
    "file:line:column: text". Raises RefusedError where the deck is no text.
    """
    done = _ask(deck, program, ["--check", *command_words(parameters, values)])
    if done.returncode not in (0, 1):
        raise _error(done.returncode, done.stderr, done.stdout)
    found = list(_messages(done.stderr))
    if done.returncode == 1 and not found:
        raise _error(1, done.stderr, done.stdout)
    return found


def flat(
    deck: DeckLike, *, parameters: Mapping[str, Any] | None = None,
    program: str | os.PathLike[str] | None = None, **values: Any,
) -> str:
    """Return a deck as one text without includes, parameters and blocks: itself a deck.

    Raises DeckError where the deck is wrong.
    """
    done = _ask(deck, program, ["--flat", *command_words(parameters, values)])
    if done.returncode != 0:
        raise _error(done.returncode, done.stderr, done.stdout)
    return done.stdout


# --- Plans ----------------------------------------------------------------------------------------

UNITS = {"bytes": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "s": 1.0, "min": 60.0, "h": 3600.0}


@dataclass(frozen=True)
class PlanLine:
    """A line of the plan: its name, how it is meant ("fixed", "at most", "about", ""), the rest."""

    name: str
    bound: str
    text: str


@dataclass(frozen=True)
class Plan:
    """What a run would do and cost, as `bipot DECK --plan` prints it (docs/plan.md).

    Numbers are those of the lines, with the digits that these have; None where there is no such
    line. `fits` is False where memory or disk would not hold the run, and `message` then says what
    would fit.
    """

    lines: tuple[PlanLine, ...]
    text: str  #: the whole table, as printed
    fits: bool = True
    message: str = ""

    def line(self, name: str) -> str | None:
        """Return the text of the first line of that name, such as "contact solver", or None."""
        return next((line.text for line in self.lines if line.name == name), None)

    def _number(self, name: str, pattern: str) -> float | None:
        """Return a number of a line, times its unit."""
        match = re.search(pattern, self.line(name) or "")
        if match is None:
            return None
        unit = match.groupdict().get("unit")
        return float(match["number"]) * UNITS.get(unit or "", 1.0)

    def _count(self, name: str, pattern: str) -> int | None:
        number = self._number(name, pattern)
        return None if number is None else int(number)

    @property
    def nodes(self) -> int | None:
        """Nodes of the mesh."""
        return self._count("mesh", r"^(?P<number>\d+) node")

    @property
    def elements(self) -> int | None:
        """Elements of the mesh."""
        return self._count("mesh", r"(?P<number>\d+) element")

    @property
    def equations(self) -> int | None:
        """Free degrees of freedom, of all steps the most."""
        return self._count("equations", r"^(?P<number>\d+)")

    @property
    def increments(self) -> int | None:
        """Increments of the deck."""
        return self._count("increments", r"^(?P<number>\d+)")

    @property
    def contact_points(self) -> int:
        """Candidate points of all contact pairs that the table lists."""
        found = (re.search(r": (\d+) point", line.text) for line in self.lines)
        return sum(int(match[1]) for match in found if match)

    @property
    def memory_bytes(self) -> float | None:
        """Peak of the process [bytes]."""
        return self._number("memory", r"^(?P<number>[\d.e+-]+) (?P<unit>bytes|kB|MB|GB)")

    @property
    def seconds(self) -> float | None:
        """Time of one processor, from the start of the program to its end [s]."""
        return self._number("time", r"^(?P<number>[\d.e+-]+) (?P<unit>s|min|h)\b")

    @property
    def file_bytes(self) -> float | None:
        """Size of the result file, at most [bytes]."""
        return self._number("file", r"at most (?P<number>[\d.e+-]+) (?P<unit>bytes|kB|MB|GB)")

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        """Return the table for a notebook."""
        rows = "".join(
            f"<tr><td>{escape(line.name)}</td><td>{line.bound}</td>"
            f"<td style='text-align:left'>{escape(line.text)}</td></tr>"
            for line in self.lines
        )
        return f"<table>{rows}</table>" + (f"<p>{escape(self.message)}</p>" if self.message else "")


def _read_plan(text: str, status: int, said: str) -> Plan:
    """Return the plan of a table in columns of 16 and 9 letters."""
    lines = []
    for line in text.splitlines()[1:]:
        if line[:1].strip() and not line.startswith("note: "):
            lines.append(PlanLine(line[:16].strip(), line[16:25].strip(), line[25:].strip()))
    return Plan(tuple(lines), text, status == 0, said.strip() if status else "")


def plan(
    deck: DeckLike, *, accuracy: float | None = None, extrapolated: bool = False,
    time: float | None = None, memory: str | None = None, refine: int | None = None,
    parameters: Mapping[str, Any] | None = None, program: str | os.PathLike[str] | None = None,
    **values: Any,
) -> Plan:
    """Return what a run would do and cost, and compute nothing.

    Raises DeckError where the deck is wrong. A run that this machine cannot hold is no error:
    `fits` of the plan says so.
    """
    words = command_words(
        parameters, values, accuracy=accuracy, extrapolated=extrapolated, time=time, memory=memory,
        refine=refine,
    )
    done = _ask(deck, program, ["--plan", *words])
    if done.returncode not in (0, 3) or not done.stdout:
        raise _error(done.returncode, done.stderr, done.stdout)
    return _read_plan(done.stdout, done.returncode, done.stderr)


# --- Runs -----------------------------------------------------------------------------------------


class Process:
    """A run that is going on: reads what it prints, and can be told to stop."""

    def __init__(self, words: list[Any], threads: int | None, told: Any = None):
        """Start it; `told(done, total)` is called for each line of an increment."""
        self.output: list[str] = []
        self.said: list[str] = []
        self.process = subprocess.Popen(
            [str(word) for word in words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, encoding="utf-8", errors="replace",
            env=None if threads is None else with_threads(threads),
        )
        self.readers = [
            threading.Thread(target=self._read, args=(stream, kept, told), daemon=True)
            for stream, kept in (
                (self.process.stdout, self.output), (self.process.stderr, self.said)
            )
        ]
        for reader in self.readers:
            reader.start()

    def _read(self, stream: Any, kept: list[str], told: Any) -> None:
        """Keep the lines of a stream."""
        for line in stream:
            kept.append(line)
            match = DONE_OF.search(line.rstrip("\n"))
            if match and told is not None:
                told(int(match[1]), int(match[2]))
        stream.close()

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit status; subprocess.TimeoutExpired where it takes longer."""
        status = self.process.wait(timeout)
        for reader in self.readers:
            reader.join()
        return status

    def stop(self) -> int:
        """Have it keep what is done, and end; return its status."""
        tells = [self.process.terminate, self.process.terminate, self.process.kill]
        # Ctrl-C in a terminal reaches it too, and a second signal would not wait at all.
        with suppress(subprocess.TimeoutExpired):
            return self.wait(NOTICE)
        if any(STOPPING in line for line in self.said):
            tells[0] = lambda: None
        for tell in tells:
            tell()
            with suppress(subprocess.TimeoutExpired):
                return self.wait(GRACE)
        return self.wait()

    def notes(self) -> list[str]:
        """Return what the program has noted, each without "note: "."""
        marked = (line.strip() for line in (*self.output, *self.said))
        return [line.removeprefix("note: ") for line in marked if line.startswith("note: ")]


class Progress:
    """A bar of tqdm on a terminal or in a notebook; nothing where tqdm is not installed."""

    def __init__(self, what: str, wanted: bool, unit: str = "increment"):
        self.what, self.unit = what, unit
        self.bar: Any = None
        self.make: Any = None
        if wanted:
            try:
                with warnings.catch_warnings():
                    # In a notebook without widgets it warns, and draws its bar as text.
                    warnings.simplefilter("ignore")
                    from tqdm.auto import tqdm
            except ImportError:
                return
            self.make = tqdm

    def __call__(self, done: int, total: int) -> None:
        if self.make is None:
            return
        if self.bar is None:
            self.bar = self.make(total=total, desc=self.what, unit=self.unit, disable=None)
        self.bar.update(done - self.bar.n)

    def close(self) -> None:
        """End the bar."""
        if self.bar is not None:
            self.bar.close()


def result_path(
    deck: DeckLike, output: str | os.PathLike[str] | None = None,
    directory: str | os.PathLike[str] | None = None,
) -> Path:
    """Return the result file that a run of a deck writes, as the command line names it."""
    name = deck.name if isinstance(deck, Deck) else Path(deck).stem
    path = Path(output) if output is not None else Path(name)
    # An ending begins with a letter: mu0.3 has none.
    if output is None or not re.fullmatch(r"\.[A-Za-z].*", path.suffix):
        path = path.with_name(f"{path.name}.vtkhdf")
    return Path(directory) / path if directory is not None else path


def _stamp(path: Path) -> tuple[int, int] | None:
    """Return what tells a file from its successor."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def _result_of(path: Path, before: tuple[int, int] | None) -> Result | None:
    """Open what a run has left, or return None where it has left nothing."""
    if _stamp(path) in (None, before):
        return None
    try:
        return Result(path)
    except ResultError:
        return None


def run(
    deck: DeckLike, *,
    output: str | os.PathLike[str] | None = None,
    directory: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    resume: bool = False,
    accuracy: float | None = None,
    extrapolated: bool = False,
    time: float | None = None,
    memory: str | None = None,
    refine: int | None = None,
    nlgeom: str | None = None,
    force: bool = False,
    threads: int | None = None,
    quiet: bool = False,
    timeout: float | None = None,
    program: str | os.PathLike[str] | None = None,
    parameters: Mapping[str, Any] | None = None,
    **values: Any,
) -> Result:
    """Run a deck and return its result, opened.

    deck        path of a text deck, or a Deck, which is written beside the result as NAME.inp
    output      the result file (NAME.vtkhdf); a name without an ending gets .vtkhdf
    directory   where the result goes (the working directory); made if it is not there
    overwrite   replace a result that is unfinished, of another deck, or of other parameters
    resume      go on with the run that left an unfinished result
    accuracy    error allowed, 0.01 for 1 %, in the contact resultants or what *ACCURACY of the deck
                says; the mesh is then chosen
    extrapolated  the accuracy is that of `accuracy.extrapolated` of the result, not of its mesh
    time        CPU time in seconds that all runs together may take: the most accurate mesh
                and increments within them are chosen
    memory      that a run may take, as "4GB" or "500MB": the same
    refine      how often every element is cut into eight; beside these three it keeps the mesh
    nlgeom      "no", "yes" or "auto" in place of the deck's NLGEOM: small strain, finite strain,
                or whichever is enough
    force       run even what does not fit in memory or on the disk
    threads     of the linear algebra library (as the environment has it)
    quiet       no progress bar; there is one anyway only where tqdm is installed
    timeout     seconds after which the run is stopped; what is done is kept
    program     the executable, where it is not the package's own

    `notes` of the result lists what the program noted. Raises DeckError (with all mistakes),
    RefusedError, NotSolvedError, MachineError, StoppedError, RunTimeoutError with the program's
    message; `result` of the exception holds the increments before the failure, where there are any.
    A KeyboardInterrupt stops the run, which keeps what is done, and is raised again.
    """
    path = result_path(deck, output, directory)
    words = command_words(
        parameters, values, accuracy=accuracy, extrapolated=extrapolated, time=time, memory=memory,
        refine=refine, nlgeom=nlgeom, overwrite=overwrite, resume=resume, force=force,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(deck, Deck):
        deck = deck.write(path.with_name(f"{path.stem}.inp"))
    told = Progress(path.stem, not quiet)
    command = [built_program(program), os.fspath(deck), "-o", path, *words]
    try:
        return follow(command, path, threads, timeout, told)
    finally:
        told.close()


def follow(
    command: list[Any], path: Path, threads: int | None = None, timeout: float | None = None,
    told: Callable[[int, int], None] | None = None,
    started: Callable[[Process], None] | None = None,
) -> Result:
    """Run a command that makes the result file `path` to its end, and open that: see `run`.

    `started` is given the process when it runs.
    """
    deck_path = str(command[1])
    _refuse_hdf5(deck_path)
    before = _stamp(path)
    process = Process(command, threads, told)
    if started is not None:
        started(process)
    late = False
    try:
        status = process.wait(timeout)
    except subprocess.TimeoutExpired:
        late = True
        status = process.stop()
    except BaseException:
        process.stop()
        raise
    said, printed = "".join(process.said), "".join(process.output)
    if late and status != 0:
        last = said.strip().splitlines()[-1:] or ["it had to be killed"]
        raise RunTimeoutError(
            f"{deck_path} took longer than {timeout:g} s: {last[0]}", status,
            _result_of(path, before),
        )
    if status != 0:
        raise _error(status, said, printed, _result_of(path, before) if status != 1 else None)
    result = Result(path)
    result.notes = process.notes()
    return result


def read(path: str | os.PathLike[str]) -> Result:
    """Open a result file; raise ResultError where it is none."""
    return Result(path)
