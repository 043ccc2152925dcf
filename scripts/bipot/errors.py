"""What can go wrong, as exceptions with the program's own words.

    BipotError
        ResultError             a file is no result, or does not hold what was asked for
        MeshError               a mesh has no elements, or is none
        RunError                a run did not end well
            ProgramMissingError     there is no executable
            DeckError               exit status 1: the deck is wrong; nothing was computed
            RefusedError            exit status 1: wrong options, or a file that would be replaced
            NotSolvedError          exit status 2: an increment was not solved or not certified
            MachineError            exit status 3: memory, disk, a library
            StoppedError            a signal stopped it
            RunTimeoutError         stopped by the caller's timeout; a TimeoutError too
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bipot.result import Result


class BipotError(Exception):
    """All that this package raises, but for wrong types and values of arguments."""


class ResultError(BipotError):
    """The file cannot be read as a bipot result, or does not hold what was asked for."""


class MeshError(BipotError):
    """A mesh cannot be made one of hexahedra with 8 nodes."""


@dataclass(frozen=True)
class Message:
    """A mistake in a deck: where, what, and what would solve it."""

    file: str
    line: int  #: from 1; 1 for what has no place
    column: int  #: from 1
    text: str  #: with the hint behind a semicolon, where there is one

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}: {self.text}"


class RunError(BipotError):
    """There is no program to run, or it did not end well.

    `status` is the program's exit status (negative: the signal that killed it, as subprocess has
    it; None where it was not run). `result` is the open Result of the increments before the
    failure, or None where the run has left none.
    """

    def __init__(self, message: str, status: int | None = None, result: Result | None = None):
        super().__init__(message)
        self.status = status
        self.result = result


class ProgramMissingError(RunError):
    """There is no executable where it is looked for."""


class DeckError(RunError):
    """The deck is wrong, and nothing was computed; `messages` lists all its mistakes."""

    def __init__(self, message: str, status: int | None = None, messages: tuple[Message, ...] = ()):
        super().__init__(message, status)
        self.messages = messages


class RefusedError(RunError):
    """The run was refused: wrong options, or a file that it would replace. Nothing was computed."""


class NotSolvedError(RunError):
    """An increment was not solved or not certified, or the accuracy asked for was not reached."""


class MachineError(RunError):
    """The machine failed: memory, disk, a library."""


class StoppedError(RunError):
    """A signal stopped the run; `run(..., resume=True)` goes on with it."""


class RunTimeoutError(StoppedError, TimeoutError):
    """The run took longer than the caller's `timeout` and was stopped."""
