#!/usr/bin/env python3
"""What scripts/test says of runs of ctest: how long they take, what was skipped, how they ended.

    ctest_summary.py expect TREE... [-- OPTIONS OF CTEST]
    ctest_summary.py skips TREE...
    ctest_summary.py verdict SECONDS [--forbidden NAME]... TREE...

A TREE is a build folder; TREE/ctest.log is what ctest last printed there (empty: no test of the
tree was chosen), TREE/ctest.output its log of what each test printed. `expect` adds the times that
the chosen tests took before, which ctest keeps beside its logs. `skips` prints a line for each test
that was skipped, and for each part of a test file, with the reason that it gave. `verdict` prints
one line: "79 of 79 passed in 12 min", or "3 of 79 failed: NAME, NAME, NAME (12 min)", and ends with
status 1 where it is not the former.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

PROCESSES = 2  # scripts/test runs so many tests at once
LISTED = re.compile(r"^\s+\d+ - (\S+) \((.+?)\)", re.MULTILINE)
SKIPS = {"Skipped", "Disabled"}


def label(tree: Path) -> str:
    """Return what stands behind the names of a tree's tests: nothing for Release."""
    return f" ({tree.name})" if tree.name in {"debug", "mpi"} else ""


def in_words(seconds: float) -> str:
    """Return a time: seconds below two minutes, else minutes."""
    return f"{seconds:.0f} s" if seconds < 119.5 else f"{seconds / 60:.0f} min"


def costs(tree: Path) -> dict[str, float]:
    """Return how long each test of a tree took before, on average: those that never passed lack."""
    path = tree / "Testing" / "Temporary" / "CTestCostData.txt"
    found = {}
    if path.is_file():
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.startswith("---"):
                break
            name, _, cost = line.split()
            if float(cost) > 0:
                found[name] = float(cost)
    return found


def expect(trees: list[Path], options: list[str]) -> str:
    """Return the sentence that says how many tests there are and how long they will take."""
    count, seconds, unknown = 0, 0.0, 0
    for tree in trees:
        listing = subprocess.run(
            ["ctest", "--test-dir", str(tree), "-N", *options],
            capture_output=True,
            text=True,
            check=False,
        ).stdout
        names = re.findall(r"^ *Test +#\d+: (\S+)", listing, re.MULTILINE)
        known = costs(tree)
        times = [known[name] for name in names if name in known]
        count += len(names)
        unknown += len(names) - len(times)
        seconds += max([sum(times) / PROCESSES, *times])
    tests = f"{count} test{'s' * (count != 1)}"
    if count == 0:
        return "no test is chosen"
    if unknown == count:
        return f"{tests}: no times of earlier runs; all tests take 15 to 30 min on two processors"
    more = f", and {unknown} of which no time is known" if unknown else ""
    return f"{tests}: about {in_words(seconds)} by the times of earlier runs{more}"


def outputs(tree: Path) -> dict[str, str]:
    """Return what each test of the last run of a tree printed."""
    path = tree / "ctest.output"
    if not path.is_file():
        return {}
    text = path.read_text(encoding="utf-8", errors="replace")
    pattern = r"^\d+/\d+ Testing: (\S+)\n.*?^Output:\n-+\n(.*?)^<end of output>"
    return dict(re.findall(pattern, text, re.MULTILINE | re.DOTALL))


def skips(tree: Path) -> list[str]:
    """Return a line for each test that was skipped and for each part of one."""
    log = read_log(tree)
    skipped = {name for name, how in LISTED.findall(log) if how in SKIPS}
    ran = set(re.findall(r"^ *\d+/\d+ Test +#\d+: (\S+) ", log, re.MULTILINE))
    lines = []
    for name, output in outputs(tree).items():
        if name in skipped:
            said = [line.strip() for line in output.splitlines() if line.strip()]
            reason = said[-1].removeprefix("skipped: ") if said else "it does not say why"
            lines.append(f"skipped: {name}{label(tree)}: {reason}")
        elif name in ran:
            # Of Python's unittest: the name of the part, maybe its first line of text, the reason.
            part = r"^(\w+) \([^\n]*\)(?:\n[^\n]*)?? \.\.\. skipped (['\"])(.*)\2$"
            for which, _, reason in re.findall(part, output, re.MULTILINE):
                lines.append(f"skipped: {name}{label(tree)}, {which}: {reason}")
    return lines


def read_log(tree: Path) -> str:
    """Return what ctest printed of a tree."""
    path = tree / "ctest.log"
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def verdict(seconds: float, forbidden: list[str], trees: list[Path]) -> tuple[str, bool]:
    """Return the closing line, and whether all is well."""
    total, failed, n_skipped, broken = 0, [], 0, []
    for tree in trees:
        log = read_log(tree)
        if not log:
            continue
        closing = re.search(
            r"^\d+% tests passed, (\d+) tests failed out of (\d+)", log, re.MULTILINE
        )
        if closing is None:
            broken.append(tree.name)
            continue
        total += int(closing[2])
        for name, how in LISTED.findall(log[closing.start() :]):
            if how in SKIPS:
                n_skipped += 1
            else:
                failed.append(name + label(tree))
    time = in_words(seconds)
    if broken:
        return f"ctest came to no end in {', '.join(broken)} ({time})", False
    if total == 0:
        return "no test was chosen", False
    if failed:
        return f"{len(failed)} of {total} failed: {', '.join(failed)} ({time})", False
    if forbidden:
        names = ", ".join(forbidden)
        return f"{len(forbidden)} of {total} skipped, which is forbidden: {names} ({time})", False
    and_skipped = f", {n_skipped} skipped," if n_skipped else ""
    return f"{total - n_skipped} of {total} passed{and_skipped} in {time}", True


def main(arguments: list[str]) -> int:
    """Print what was asked for; return the exit status."""
    command, rest = arguments[0], arguments[1:]
    if command == "expect":
        cut = rest.index("--") if "--" in rest else len(rest)
        print(expect([Path(tree) for tree in rest[:cut]], rest[cut + 1 :]))
        return 0
    if command == "skips":
        for tree in rest:
            for line in skips(Path(tree)):
                print(line)
        return 0
    seconds, rest = float(rest[0]), rest[1:]
    forbidden = []
    while rest and rest[0] == "--forbidden":
        forbidden.append(rest[1])
        rest = rest[2:]
    line, is_well = verdict(seconds, forbidden, [Path(tree) for tree in rest])
    print(line)
    return 0 if is_well else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
