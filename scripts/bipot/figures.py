"""What the scripts that run decks share: command line, runs, and the look of their figures."""

import shlex
import subprocess
import tempfile
from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from bipot_result import Result
from study_pieces import ROOT, program_options, set_words

DECK = ROOT / "input" / "block.inp"
INK, BLUE, ORANGE, GREEN, GRID = "#303030", "#2f6db0", "#e8813a", "#2a9d6f", "#c9c9c9"
PURPLE, RED = "#7b5ea7", "#c2443c"


class RunError(Exception):
    """There is no program to run, or it did not end well."""


def script_options(description, folder, what):
    """Return a parser of the options that the scripts share: -o, where `what` goes, and --bipot."""
    parser = program_options(description)
    shown = folder.relative_to(ROOT)
    parser.add_argument(
        "-o", dest="folder", type=Path, default=folder, help=f"where {what} ({shown})"
    )
    return parser


def built_program(path):
    """Return the program's full path; raise RunError where there is none."""
    if not path.is_file():
        raise RunError(f"no program at {path}; scripts/run builds it")
    return path.resolve()


class Runs:
    """Runs of the decks in input/, and the commands that repeat them by hand."""

    def __init__(self, program, folder):
        """Keep the results of `program` in `folder`."""
        self.program = program
        self.folder = folder
        self.commands = []

    def __call__(self, case, /, **parameters):
        """Run input/CASE.inp with these parameters and return its result, open for reading."""
        deck = ROOT / "input" / f"{case}.inp"
        self.commands.append(command_text(parameters, f"input/{case}.inp"))
        print(self.commands[-1], flush=True)
        path = self.folder / f"run-{len(self.commands)}.vtkhdf"
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


def block_words(deck, parameters):
    """Return the deck and its parameters as words of bipot's command line."""
    return [str(deck), *set_words(parameters)]


def command_text(parameters, deck="input/block.inp"):
    """Return the command, as one types it in the repository, of a run with these parameters."""
    return shlex.join(["build/bipot", *block_words(deck, parameters)])


def run_block(program, path, parameters, deck=DECK, **options):
    """Run the block into the result file `path`; `options` go to subprocess.run."""
    command = [program, *block_words(deck, parameters), "-o", path, "--quiet"]
    return subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, check=False, **options)


def deck_with(card):
    """Return the block's deck with more options of *CONTACT SOLVER, such as "RELAXATION=0.4"."""
    text = DECK.read_text(encoding="utf-8")
    changed = text.replace("RHO=<rho>,", f"RHO=<rho>, {card},")
    if changed == text:
        raise ValueError(f"{DECK}: no RHO=<rho> to put {card} after")
    return changed


def new_axes(columns=1, **options):
    """Return a figure and its axes in the style of all figures."""
    plt.rcParams.update({"font.size": 9, "axes.edgecolor": INK, "legend.frameon": False})
    figure, axes = plt.subplots(1, columns, figsize=(6.4, 3.9), squeeze=False, **options)
    for one in axes[0]:
        one.spines[["top", "right"]].set_visible(False)
        one.grid(color=GRID, linewidth=0.4)
        one.set_axisbelow(True)
    return figure, axes[0] if columns > 1 else axes[0, 0]


def save(figure, path):
    """Write a figure and name it."""
    figure.savefig(path, dpi=120, bbox_inches="tight", facecolor="white")
    plt.close(figure)
    print(path)
