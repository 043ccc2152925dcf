"""Run the program under test on a deck and read its result; what all whole-program cases share."""

import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
import weakref
from pathlib import Path

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("BIPOT", str(SOURCE / "build" / "bipot"))
# Where `bipot` is, the package that the scripts share, and `studies`.
sys.path[:0] = [str(SOURCE / "scripts"), str(SOURCE)]

from bipot.result import Result  # noqa: E402  (found through the line above)

INPUT = SOURCE / "input"
DATA = SOURCE / "tests" / "data"
ASKED = ("--nlgeom", "no", "--accuracy")  # an accuracy of the small-strain solution
LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")  # scripts/test --full
# What takes seconds and tries again, elsewhere, what other tests try.
in_long_form = unittest.skipUnless(LONG, "with BIPOT_LONG")


class Run:
    """One run of the program in a folder of its own; `result` opens its file."""

    def __init__(self, deck, *options, name=None, command=(PROGRAM,), ended_at=None, beside=None,
                 **overrides):
        """Run `deck` (a path, or a text to be written to `name`.inp) with --set for `overrides`.

        `command` starts the program. With `ended_at`, a step and an increment as printed, a first
        run is ended by a signal behind it: "--continue" among the options then continues that one.
        A text before these two is waited for first.
        `beside` are files that are there already, by their names: copies of these paths. With
        `ended_at` they come behind the first run.
        """
        self.folder = Path(tempfile.mkdtemp(prefix="bipot-"))
        weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        if name is not None:
            text, deck = deck, self.folder / f"{name}.inp"
            deck.write_text(text)
        self.deck = Path(deck)
        settings = [
            word for key, value in overrides.items() for word in ("--set", f"{key}={value}")
        ]
        if ended_at:
            self.end_early([*command, str(self.deck), *settings], list(ended_at))
        for file, source in (beside or {}).items():
            shutil.copyfile(source, self.folder / file)
        command = [*command, str(self.deck), *options, *settings]
        done = subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, timeout=600, check=False
        )
        self.status, self.output, self.errors = done.returncode, done.stdout, done.stderr
        self.file = self.folder / f"{self.deck.stem}.vtkhdf"

    def end_early(self, command, ended_at):
        """Run until an increment is printed, and end by a signal.

        The pipe holds one line: under any load the program ends at most two increments behind.
        """
        *awaited, step, increment = ended_at
        reading, writing = os.pipe2(os.O_DIRECT | os.O_CLOEXEC)
        fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, os.sysconf("SC_PAGE_SIZE"))
        with os.fdopen(reading) as lines, subprocess.Popen(
            command, cwd=self.folder, stdout=writing, stderr=subprocess.DEVNULL
        ) as running:
            os.close(writing)
            for line in lines:
                if awaited and awaited[0] in line:
                    awaited = []
                if not awaited and line.split()[:2] == [step, increment]:
                    running.terminate()

    def result(self):
        """Open the result file; the run must have left one."""
        return Result(self.file)

    @property
    def plan(self):
        """The table of the plan, as the result file has it."""
        with self.result() as result:
            return result.run_text("plan")
