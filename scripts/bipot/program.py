"""What the scripts of a clone run the program with: options, words of a command, one run."""

import argparse
import shlex
import subprocess
from pathlib import Path

from bipot.errors import RunError
from bipot.executable import ROOT, built_program, program_path, set_words, with_threads

__all__ = (
    "DECK", "ROOT", "RunError", "block_words", "built_program", "command_text", "program_options",
    "run_block", "run_deck", "run_words", "script_options", "set_words", "with_threads",
)
# The block of the paper, for who asks for no other deck.
DECK = ROOT / "input" / "block.inp"


def program_options(description):
    """Return a parser of the option of all scripts that run the program: --bipot, a path."""
    parser = argparse.ArgumentParser(description=description.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, default=program_path(), help="the program")
    return parser


def script_options(description, folder, what):
    """Return a parser of the options that the scripts share: -o, where `what` goes, and --bipot."""
    parser = program_options(description)
    shown = folder.relative_to(ROOT)
    parser.add_argument(
        "-o", dest="folder", type=Path, default=folder, help=f"where {what} ({shown})"
    )
    return parser


def run_words(program, deck, result, settings):
    """Return the command that runs a deck quietly into a result file, be there one or not."""
    return [program, deck, "-o", result, "--overwrite", "--quiet", *set_words(settings)]


def run_deck(program, deck, result, settings):
    """Run a deck with one thread into a result file.

    CalledProcessError when it does not end well.
    """
    words = run_words(program, deck, result, settings)
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, env=with_threads())


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
