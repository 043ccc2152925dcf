#!/usr/bin/env python3
"""What scripts/test says of runs of ctest: how long they take, what was skipped, how they ended.

    ctest_summary.py expect TREE [-- OPTIONS OF CTEST]
    ctest_summary.py times TREE...
    ctest_summary.py skips RUN...
    ctest_summary.py verdict SECONDS [--forbidden NAME]... RUN...

A TREE is a build folder. A RUN is TREE/ctest, say: RUN.log is what ctest printed (empty: no test of
the tree was chosen), RUN.output its log of what each test printed. `expect` adds the times that the
chosen tests took before, which ctest keeps beside its logs. `times` prints the processor times of
all tests that ran, which `tests/timed` wrote into TREE/test-times: the 20 longest, the sum of each
label, those over 15 s outside --full, then all. `skips` prints a line for each test that was
skipped, and for each part of a test file, with the reason that it gave. `verdict` prints one line:
"79 of 79 passed in 12 min", or "3 of 79 failed: NAME, NAME, NAME (12 min)", and ends with status 1
where it is not the former.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

PROCESSES = 2  # scripts/test runs so many tests at once
MOST_SECONDS = 15  # of the processor that a test may take outside --full
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


def listed(tree: Path, options: list[str]) -> dict[str, list[str]]:
    """Return the labels of the tests that options of ctest choose in a tree, by test."""
    done = subprocess.run(
        ["ctest", "--test-dir", str(tree), "--show-only=json-v1", *options],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        return {}
    found = {}
    for test in json.loads(done.stdout)["tests"]:
        values = {entry["name"]: entry["value"] for entry in test.get("properties", [])}
        found[test["name"]] = values.get("LABELS", [])
    return found


def expect(tree: Path, options: list[str]) -> str:
    """Return the sentence that says how many tests there are and how long they will take."""
    names = listed(tree, options)
    known = costs(tree)
    times = [known[name] for name in names if name in known]
    count, unknown = len(names), len(names) - len(times)
    tests = f"{count} test{'s' * (count != 1)}"
    if count == 0:
        return f"{tree.name}: no test is chosen"
    if unknown == count:
        return f"{tree.name}: {tests}, no times of earlier runs"
    more = f", and {unknown} of which no time is known" if unknown else ""
    seconds = max([sum(times) / PROCESSES, *times])
    return f"{tree.name}: {tests}, about {in_words(seconds)} by the times of earlier runs{more}"


def seconds_of(text: str) -> float:
    """Return the processor time of a test from what `tests/timed` wrote [s]."""
    clock = re.findall(r"(\d+)m([\d.]+)s", text)
    # Of the shell that ran the test, then of the test: in user and in system mode.
    return sum(60 * int(minutes) + float(seconds) for minutes, seconds in clock[2:4])


def processor_times(tree: Path) -> dict[str, float]:
    """Return the processor time of each test that ran in a tree [s]."""
    paths = (tree / "test-times").glob("*")
    return {path.name: seconds_of(path.read_text(encoding="utf-8")) for path in paths}


def times(trees: list[Path]) -> str:
    """Return the table of processor times."""
    rows = []
    for tree in trees:
        labels = listed(tree, ["-C", "full"])
        for name, seconds in processor_times(tree).items():
            if name in labels:
                rows.append((seconds, name + label(tree), labels[name] or ["no label"]))
    rows.sort(reverse=True)
    by_label: dict[str, float] = {}
    for seconds, _, names in rows:
        for name in names:
            by_label[name] = by_label.get(name, 0.0) + seconds
    usual = [(seconds, name) for seconds, name, names in rows if "full" not in names]
    long = [name for seconds, name in usual if seconds > MOST_SECONDS]
    return "\n".join(
        [
            f"processor time of {len(usual)} tests: {sum(seconds for seconds, _ in usual):.0f} s",
            f"over {MOST_SECONDS} s outside --full: {', '.join(long) or 'none'}",
            "",
            "by label:",
            *(f"{seconds:9.1f} s  {name}" for name, seconds in sorted(by_label.items())),
            "",
            "the longest:",
            *(f"{seconds:9.1f} s  {name}" for seconds, name in usual[:20]),
            "",
            "all:",
            *(f"{seconds:9.1f} s  {name}" for seconds, name, _ in rows),
        ]
    )


def outputs(run: Path) -> dict[str, str]:
    """Return what each test of a run printed."""
    path = run.with_suffix(".output")
    if not path.is_file():
        return {}
    text = path.read_text(encoding="utf-8", errors="replace")
    pattern = r"^\d+/\d+ Testing: (\S+)\n.*?^Output:\n-+\n(.*?)^<end of output>"
    return dict(re.findall(pattern, text, re.MULTILINE | re.DOTALL))


def skips(run: Path) -> list[str]:
    """Return a line for each test that was skipped and for each part of one."""
    log = read_log(run)
    tree = run.parent
    skipped = {name for name, how in LISTED.findall(log) if how in SKIPS}
    ran = set(re.findall(r"^ *\d+/\d+ Test +#\d+: (\S+) ", log, re.MULTILINE))
    lines = []
    for name, output in outputs(run).items():
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


def read_log(run: Path) -> str:
    """Return what ctest printed of a run."""
    path = run.with_suffix(".log")
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def verdict(seconds: float, forbidden: list[str], runs: list[Path]) -> tuple[str, bool]:
    """Return the closing line, and whether all is well."""
    total, failed, n_skipped, broken = 0, [], 0, []
    for run in runs:
        tree = run.parent
        log = read_log(run)
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
        print(expect(Path(rest[0]), rest[2:]))
        return 0
    if command == "times":
        print(times([Path(tree) for tree in rest]))
        return 0
    if command == "skips":
        for run in rest:
            for line in skips(Path(run)):
                print(line)
        return 0
    seconds, rest = float(rest[0]), rest[1:]
    forbidden = []
    while rest and rest[0] == "--forbidden":
        forbidden.append(rest[1])
        rest = rest[2:]
    line, is_well = verdict(seconds, forbidden, [Path(run) for run in rest])
    print(line)
    return 0 if is_well else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
