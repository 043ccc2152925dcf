"""What the fuzzing campaigns share: the command line, and inputs tried by their numbers."""

import argparse
import collections
import os
import random
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def campaign_options(description, what, count):
    """Return a parser of the options of every campaign, over so many inputs of this kind."""
    parser = argparse.ArgumentParser(description=description.split("\n")[0])
    parser.add_argument("--bipot", type=lambda word: Path(word).resolve(), help="the program",
                        default=os.environ.get("BIPOT", ROOT / "build" / "bipot"))
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--seed", type=int, default=os.environ.get("BIPOT_SEED", "1"),
                        help="default: BIPOT_SEED, or 1")
    parser.add_argument("--first", type=int, default=0, help=f"number of the first {what}")
    parser.add_argument("--keep", type=Path, help="folder for what is found")
    return parser


def is_sanitized(program):
    """Whether sanitizers are in the program; they want address space and time."""
    return b"libasan" in program.read_bytes()


@contextmanager
def numbered_input(options, number):
    """Give the random numbers of an input, and a folder with an empty folder `work` for its run."""
    with tempfile.TemporaryDirectory(prefix="bipot-fuzz-") as scratch:
        folder = Path(scratch)
        (folder / "work").mkdir()
        yield random.Random(f"{options.seed}:{number}"), folder


def show_finding(heading, complaints, done, outcome):
    """Print what is wrong, what was done to the input, and the end of what was said."""
    print(f"\n{heading}: {done}: {'; '.join(complaints)}", flush=True)
    print("  " + "\n  ".join((outcome.errors or outcome.output)[-600:].splitlines()[:8]))


def keep_file(folder, name, data):
    """Write what was found into the folder, which is made where it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)


def try_files(options, what, ending, judge):
    """Try all files of a campaign, one after the other; return the number of findings.

    judge(number): (what was done, complaints, data, outcome) of one.
    """
    counts, findings, slowest = collections.Counter(), 0, (0.0, -1)
    started = time.monotonic()
    for number in range(options.first, options.first + options.count):
        done, complaints, data, outcome = judge(number)
        counts[done, outcome.status] += 1
        slowest = max(slowest, (outcome.seconds, number))
        if not complaints:
            continue
        findings += 1
        show_finding(f"file {number}", complaints, done, outcome)
        if options.keep:
            keep_file(options.keep, f"{number}.{ending}", data)
    print(f"\n{options.count} {what} of seed {options.seed} in "
          f"{time.monotonic() - started:.0f} s: {findings} findings")
    for (done, status), n in sorted(counts.items()):
        print(f"  {done:13s} exit status {status:3d}: {n}")
    print(f"  slowest {slowest[0]:.2f} s (file {slowest[1]})")
    return findings
