"""What studies share: options, the runs behind a page, and sentences that they must bear out."""

import shutil
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

from bipot.program import ROOT, RunError, built_program, command_text, program_options, run_block
from bipot.report import table as table_lines
from bipot.result import Result
from studies.meshes import mesh_file

PAGES = ROOT / "docs" / "studies"
DATA = ROOT / "studies" / "data"


class StudyError(Exception):
    """The study cannot go on, or its runs do not show what the page says."""


def page_options(description):
    """Return a parser of --bipot and of -o, for put_page: `page`, a path or None."""
    parser = program_options(description)
    parser.add_argument("-o", dest="page", type=Path, help="write the page here")
    return parser


def put_page(text, path):
    """Write a page, a text that ends its last line, to `path`; print it where that is None."""
    if path is None:
        sys.stdout.write(text)
    else:
        path.write_text(text, encoding="utf-8")


def page_command(description, page):
    """Read the command line of a script with no other options, and put page(program)."""
    options = page_options(description).parse_args()
    put_page(page(options.bipot.resolve()), options.page)


def page_with_jobs(description, page):
    """Likewise for a study that can run several scenes at a time: put page(program, jobs)."""
    options = page_options(description)
    options.add_argument("--jobs", type=int, default=2, help="scenes at a time")
    options = options.parse_args()
    put_page(page(options.bipot.resolve(), options.jobs), options.page)


def claim(holds, words):
    """Return the words if the runs bear them out; refuse to write the page otherwise."""
    if not holds:
        raise StudyError(f"the runs no longer show this, so the page must change: {words}")
    return words


def table(heads, rows):
    """Return a Markdown table as one text."""
    return "\n".join(table_lines(heads, rows))


def percent(found, expected):
    """Return the relative difference in words."""
    return f"{100 * (found / expected - 1):+.2f} %"


class Runs:
    """Runs of the decks in input/, and the commands that repeat them by hand."""

    def __init__(self, program, folder):
        """Keep the results of `program` in `folder`."""
        self.program = program
        self.folder = folder
        self.commands = []

    def __call__(self, case, /, mesh=None, **parameters):
        """Run input/CASE.inp with these parameters and return its result, open for reading.

        `mesh`, a name of studies.meshes and a size, takes the place of the one that it includes.
        """
        deck = ROOT / "input" / f"{case}.inp"
        words = command_text(parameters, f"input/{case}.inp")
        if mesh is not None:
            folder = self.folder / "-".join(map(str, mesh))
            (folder / "meshes").mkdir(parents=True, exist_ok=True)
            (folder / "meshes" / f"{mesh[0]}.inp").write_text(mesh_file(*mesh), encoding="utf-8")
            deck = Path(shutil.copy(deck, folder))
            words += f"  (mesh {mesh[0]}, n = {mesh[1]})"
        self.commands.append(words)
        print(self.commands[-1], flush=True)
        return self._run(parameters, deck)

    def of_text(self, name, text, **parameters):
        """Run a deck that is given as text and return its result, open for reading."""
        return self._run(parameters, self._write(name, text, parameters))

    def attempt(self, name, text, **parameters):
        """Run one that need not be solved; return its result too, and what ended it, or ''."""
        deck = self._write(name, text, parameters)
        path = self._path()
        done = run_block(self.program, path, parameters, deck, capture_output=True, text=True)
        if done.returncode not in (0, 2):
            raise RunError(f"{self.commands[-1]}\n{done.stderr}")
        return Result(path), done.stderr.split("\n", 1)[0] if done.returncode else ""

    def _write(self, name, text, parameters):
        """Write a deck, and the command that runs it; return its path."""
        deck = self.folder / f"{name}.inp"
        deck.write_text(text, encoding="utf-8")
        words = " ".join(f"{key}={value}" for key, value in parameters.items())
        self.commands.append(f"{name}.inp, written by the study{' with ' * bool(words)}{words}")
        print(self.commands[-1], flush=True)
        return deck

    def _path(self):
        """Return where the result of the last of the commands goes."""
        return self.folder / f"run-{len(self.commands)}.vtkhdf"

    def _run(self, parameters, deck):
        """Run the last of the commands."""
        path = self._path()
        done = run_block(self.program, path, parameters, deck)
        if done.returncode != 0:
            raise RunError(f"{self.commands[-1]}\nended with status {done.returncode}")
        return Result(path)


@contextmanager
def fresh_runs(program):
    """Give Runs of `program`, in a folder that is thrown away."""
    program = built_program(program)
    with tempfile.TemporaryDirectory() as folder:
        yield Runs(program, Path(folder))
