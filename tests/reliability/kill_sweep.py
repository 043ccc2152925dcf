#!/usr/bin/env python3
"""Kill runs at every single write of their result files, and at random times; nothing may be lost.

    kill_sweep.py [--points N] [--torn N] [--random N] [--continue M] [--twice K] [--seed S]

After each kill h5py opens the file, VTK reads every step of it, every increment that was finished
is there and equal to the uninterrupted run's to the last bit. M of the killed runs are continued to
their end, and then the whole file equals the uninterrupted one; K of those are killed a second time
while they continue. Torn writes are begun and cut at a page. All numbers are summed over the cases
and spread evenly over their writes; 0 points means every write there is.

Exit status 0: no loss. Environment: see result_checks.py.
"""

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

from result_checks import (
    HERE,
    INPUT,
    MISSING_VTK,
    NAME,
    Case,
    Whole,
    close_reader,
    fresh_folder,
    is_finished,
    rows_in,
)

CASES = (
    Case(INPUT / "block.inp", n=2, steps=10),
    Case(INPUT / "block.inp", n=3, steps=10, solver="AUTO", local="AUTO"),
    Case(HERE / "changes.inp"),
    Case(HERE / "widened.inp"),
    Case(INPUT / "tool.inp", n=4, steps=3),
    Case(INPUT / "pipe.inp"),
    Case(INPUT / "slope.inp"),
)


class Sweep:
    """The kills of one case, and what was wrong after them."""

    def __init__(self, case, chance):
        """Run the case once to its end."""
        self.case, self.chance = case, chance
        self.folder = Path(tempfile.mkdtemp(prefix="bipot-"))
        self.wrong = []
        self.n_kills = self.n_continued = self.n_twice = 0
        whole = self._fresh("whole")
        self.n_changes = case.count_changes(whole)
        self.whole = Whole(whole / NAME)

    def close(self):
        """Remove all files of the case."""
        shutil.rmtree(self.folder)

    def _fresh(self, name):
        return fresh_folder(self.folder / name)

    def at_writes(self, n, n_continued, n_twice, torn):
        """Kill at `n` writes in their order; continue some, kill some of those again."""
        changes = spread(range(1, self.n_changes + 1), n)
        continued = set(spread(changes, n_continued))
        twice = set(spread(sorted(continued), n_twice))
        rows = 0
        for change in changes:
            folder = self._fresh("killed")
            where = f"{self.case}, write {change} of {self.n_changes}{' (torn)' if torn else ''}"
            if not self.case.kill_at(folder, change, torn=torn):
                continue
            rows = self._check(folder, where, rows)
            if change in twice:
                self._continue(folder, where, again=True)
            elif change in continued:
                self._continue(folder, where)

    def at_random(self, n, n_continued):
        """Kill at random moments of a run; continue some."""
        started = time.monotonic()
        self.case.run(self._fresh("timed"))
        whole_time = time.monotonic() - started
        for i in range(n):
            folder = self._fresh("killed")
            process = self.case.start(folder)
            time.sleep(self.chance.uniform(0.0, whole_time))
            process.kill()
            process.communicate()
            if process.returncode != -signal.SIGKILL:
                continue
            where = f"{self.case}, at a random moment"
            self._check(folder, where, 0)
            if i < n_continued:
                self._continue(folder, where)

    def _check(self, folder, where, rows):
        """Look at what a kill has left; return the increments that are finished."""
        self.n_kills += 1
        path = folder / NAME
        if not path.exists():
            if rows > 0:
                self.wrong.append(f"{where}: the file is gone")
            return rows
        try:
            self.wrong += [f"{where}: {what}" for what in self.whole.losses(path, rows)]
            return max(rows, rows_in(path))
        except (OSError, KeyError, ValueError) as problem:
            self.wrong.append(f"{where}: {problem}")
            return rows

    def _continue(self, folder, where, again=False):
        """Continue a killed run to its end, or kill it again and continue that."""
        if again:
            self.n_twice += 1
            rows = rows_in(folder / NAME)
            change = self.chance.randint(1, self.n_changes)
            where += f", then write {change} when continued"
            if self.case.kill_at(folder, change, "--continue"):
                self._check(folder, where, rows)
            else:
                self.n_continued += 1
                self.wrong += [f"{where}: {w}" for w in self.whole.differences(folder / NAME)]
                return
        try:
            finished = (folder / NAME).exists() and is_finished(folder / NAME)
        except (OSError, KeyError):
            return  # told by _check
        if not finished:
            self.n_continued += 1
            status, words = self.case.run(folder, "--continue")
            if status != 0:
                self.wrong.append(f"{where}: continued with status {status}\n{words}")
                return
        self.wrong += [f"{where}: {w}" for w in self.whole.differences(folder / NAME)]


def spread(items, n):
    """Return `n` of the items, evenly spread; all of them where there are not more, or for 0."""
    items = list(items)
    if n >= len(items) or n == 0:
        return items
    return [items[(2 * i + 1) * len(items) // (2 * n)] for i in range(n)]


def share(n, i, n_cases):
    """The part of `n` that falls to case `i`."""
    return n * (i + 1) // n_cases - n * i // n_cases


def say(words):
    """Print without delay."""
    print(words, flush=True)


def sweep(options, cases=CASES, tell=say):
    """Sweep all cases; return what was wrong, and how many kills, continuations, second kills."""
    chance = random.Random(options.seed)
    wrong, counts = [], [0, 0, 0]
    try:
        for i, case in enumerate(cases):
            one = Sweep(case, chance)
            m, k = (share(n, i, len(cases)) for n in (options.continued, options.twice))
            points, torn = (share(n, i, len(cases)) for n in (options.points, options.torn))
            if points or options.points == 0:
                one.at_writes(points, m, k, torn=False)
            if torn:
                one.at_writes(torn, m // 2, 0, torn=True)
            if options.random:
                n = share(options.random, i, len(cases))
                one.at_random(n, max(1, m // 4))
            one.close()
            wrong += one.wrong
            new = (one.n_kills, one.n_continued, one.n_twice)
            counts = [a + b for a, b in zip(counts, new, strict=True)]
            tell(
                f"{case}: {one.n_changes} writes, {one.n_kills} kills, {one.n_continued} "
                f"continuations ({one.n_twice} of them killed again), {len(one.wrong)} losses"
            )
            for what in one.wrong[:5]:
                tell(f"    {what}")
    finally:
        close_reader()
    return wrong, counts


def main():
    """Sweep as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=700, help="kills at writes; 0: at every one")
    parser.add_argument("--torn", type=int, default=100, help="kills in the middle of writes")
    parser.add_argument("--random", type=int, default=70, help="kills at random moments")
    parser.add_argument("--continue", type=int, default=70, dest="continued", help="continuations")
    parser.add_argument("--twice", type=int, default=35, help="of them, killed a second time")
    parser.add_argument("--seed", type=int, default=os.environ.get("BIPOT_SEED", "1"),
                        help="default: BIPOT_SEED, or 1")
    options = parser.parse_args()
    if MISSING_VTK:
        print(MISSING_VTK)
    started = time.monotonic()
    wrong, (n_kills, n_continued, n_twice) = sweep(options)
    print(
        f"{n_kills} kills, {n_continued} continuations ({n_twice} of them killed again): "
        f"{len(wrong)} losses, {time.monotonic() - started:.0f} s"
    )
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
