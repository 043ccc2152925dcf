"""Run the program under test on a deck and read its result; what all whole-program cases share."""

import os
import shutil
import subprocess
import sys
import tempfile
import weakref
from pathlib import Path

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("BIPOT", str(SOURCE / "build" / "bipot"))
# Where `bipot` is, the package that the scripts share, and `studies`.
sys.path[:0] = [str(SOURCE / "scripts"), str(SOURCE)]

from bipot.result import Result  # noqa: E402  (found through the line above)

INPUT = SOURCE / "input"
DATA = SOURCE / "tests" / "data"


class Run:
    """One run of the program in a folder of its own; `result` opens its file."""

    def __init__(self, deck, *options, name=None, command=(PROGRAM,), **overrides):
        """Run `deck` (a path, or a text to be written to `name`.inp) with --set for `overrides`.

        `command` starts the program.
        """
        self.folder = Path(tempfile.mkdtemp(prefix="bipot-"))
        weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        if name is not None:
            text, deck = deck, self.folder / f"{name}.inp"
            deck.write_text(text)
        self.deck = Path(deck)
        command = [*command, str(self.deck), *options]
        for key, value in overrides.items():
            command += ["--set", f"{key}={value}"]
        done = subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, timeout=600, check=False
        )
        self.status, self.output, self.errors = done.returncode, done.stdout, done.stderr
        self.file = self.folder / f"{self.deck.stem}.vtkhdf"

    def result(self):
        """Open the result file; the run must have left one."""
        return Result(self.file)

    @property
    def plan(self):
        """The table of the plan, as the result file has it."""
        with self.result() as result:
            return result.run_text("plan")
