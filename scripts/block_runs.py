"""What the scripts that run input/block.inp share: the runs, and the look of their figures."""

import shlex
import subprocess
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parent.parent
DECK = ROOT / "input" / "block.inp"
INK, BLUE, ORANGE, GREEN, GRID = "#303030", "#2f6db0", "#e8813a", "#2a9d6f", "#c9c9c9"
PURPLE, RED = "#7b5ea7", "#c2443c"


def block_words(deck, parameters):
    """Return the deck and its parameters as words of bipot's command line."""
    words = [str(deck)]
    for name, value in parameters.items():
        words += ["--set", f"{name}={value}"]
    return words


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
