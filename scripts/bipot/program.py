"""What scripts that make pages share: command lines, tables, claims that runs must bear out."""

import argparse
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


class StudyError(Exception):
    """The study cannot go on, or its runs do not show what the page says."""


def program_options(description):
    """Return a parser of the option of all scripts that run the program: --bipot, a path."""
    parser = argparse.ArgumentParser(description=description.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot", help="the program")
    return parser


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


def set_words(settings):
    """Return the words of a command line that give a deck's parameters these values."""
    return [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]


def with_threads(threads=1):
    """Return the environment in which a program has so many threads."""
    return {**os.environ, "OPENBLAS_NUM_THREADS": str(threads), "OMP_NUM_THREADS": str(threads)}


def run_words(program, deck, result, settings):
    """Return the command that runs a deck quietly into a result file, be there one or not."""
    return [program, deck, "-o", result, "--overwrite", "--quiet", *set_words(settings)]


def run_deck(program, deck, result, settings):
    """Run a deck with one thread into a result file.

    CalledProcessError when it does not end well.
    """
    words = run_words(program, deck, result, settings)
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, env=with_threads())


def claim(holds, words):
    """Return the words if the runs bear them out; refuse to write the page otherwise."""
    if not holds:
        raise StudyError(f"the runs no longer show this, so the page must change: {words}")
    return words


def table(head, rows):
    """Return the lines of a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(map(str, line)) + " |" for line in lines]


def machine():
    """Return the processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


class Bar:
    """A progress bar on a terminal; a line now and then elsewhere."""

    def __init__(self, total):
        self.total, self.done, self.begun, self.said = total, 0.0, time.monotonic(), 0.0

    def show(self, what):
        """Show how far the study is and what runs now."""
        if self.total == 0:
            return
        share, now = self.done / self.total, time.monotonic()
        left = "?" if share < 0.01 else f"{(now - self.begun) * (1 / share - 1):.0f} s"
        blocks = "#" * int(30 * share)
        line = f"[{blocks:<30}] {share:4.0%}  {left} left  {what}"
        if sys.stderr.isatty():
            print(f"\r{line:<90.90}", end="", file=sys.stderr, flush=True)
        elif now - self.said > 30:
            self.said = now
            print(line, file=sys.stderr, flush=True)

    def advance(self, weight):
        """Count a run of this weight."""
        self.done += weight

    def close(self):
        """End the bar's line."""
        if self.total and sys.stderr.isatty():
            print(f"\r{'':<90}\r", end="", file=sys.stderr, flush=True)
