#!/usr/bin/env python3
"""Make mutants of one line of the source and see whether the tests notice.

    mutate.py [--room ROOM]... [--file FILE]... [--count N] [--seed N] [--units-only] [--list]
    mutate.py --together --kinds term cap branch --least 0.8

Each mutant is compiled alone and linked before the library, so a build costs seconds; the tree
itself is never touched. The unit programs that reach the mutated module run first, then the
whole-program cases, those of its room and the quick ones. What was found is kept in
BUILD/mutation/results.jsonl: a second call goes on where the first one ended, and repeats of the
survivors only the tests that have changed. README.md beside this file says what the words of the
report mean.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Lock

from mutants import Mutant, mutants_of

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SOURCE = ROOT / "src"
# As in the Debug tree, whose run-time checks scripts/test runs as well; and quick to compile.
MUTATED = ["-O1", "-fcheck=all,no-array-temps", "-w"]
SKIPPED = 77  # exit status of a case
MEMORY_KB = 6_000_000  # address space of a test: an index or a size may ask for anything
MANY_TIMES, AND_SECONDS = 5.0, 20.0  # a test that takes longer than that of its usual time hangs
# Whole-program cases that look at a room and are not among the quick ones; behind a blank the
# classes of a file that are run.
CASES = {
    "accuracy": ["case_accuracy", "case_budget"],
    "certificate": ["case_interference", "case_dynamics Steps"],
    "console": ["case_signals Signals.test_what_it_says_can_be_given_to_a_shell"],
    "equations": ["case_savings"],
    "estimates": ["case_stability"],
    "increment": ["case_dynamics Steps"],
    "load_step": ["case_dynamics Steps"],
    "plan": ["case_plan Refused Chosen"],
    "run": ["case_savings"],
}
OUTCOMES = ("killed", "survived", "equivalent", "does not compile")


def digest(*parts: bytes) -> str:
    """Return sixteen digits that stand for the contents."""
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]


def room_of(file: str) -> str:
    """Return the folder of a source file, below src/."""
    return str(Path(file).parent)


@dataclass
class Test:
    """A unit program, or a whole-program case."""

    name: str
    programs: tuple[str, ...]  # that it runs, below the folder of the tree
    called: tuple[str, ...] = ()  # Python and the script of a case
    classes: tuple[str, ...] = ()  # of the script, that are run; none: all
    env: tuple[str, ...] = ()
    digest: str = ""


@dataclass
class Tree:
    """A tree built by Ninja: how it compiles, links and tests."""

    build: Path
    compile: dict[str, list[str]] = field(default_factory=dict)  # by the file below src/
    links: dict[str, list[str]] = field(default_factory=dict)  # by the program
    listed: dict[str, Test] = field(default_factory=dict)  # what ctest runs
    times: dict[str, float] = field(default_factory=dict)  # of tests, of the processor [s]
    order: list[str] = field(default_factory=list)  # of the sources, lowest first
    uses: dict[str, set[str]] = field(default_factory=dict)  # file: modules it uses
    makes: dict[str, str] = field(default_factory=dict)  # module: its file
    included: dict[str, list[str]] = field(default_factory=dict)  # file: that include it

    def read(self) -> Tree:
        """Read what CMake wrote, and what the tests took when scripts/test ran them."""
        for line in self.asked("ninja", "-t", "commands", "all").splitlines():
            if match := re.search(r" -c src/CMakeFiles/\w+_room\.dir/(\S+\.f90)-pp\.f90 -o", line):
                words = shlex.split(line[: match.start()])
                # Modules of the other files of its room lie where its own would go.
                self.compile[match[1]] = [
                    w.replace("-J", "-I", 1) if w.startswith("-J") else w
                    for w in words
                    if w != "-fpreprocessed"
                ]
            elif match := re.search(r" -o (bipot|tests/unit_\w+|tests/deck_server) ", line):
                self.links[match[1]] = shlex.split(line.removeprefix(": && ").removesuffix(" && :"))
        for test in json.loads(self.asked("ctest", "--show-only=json-v1"))["tests"]:
            name, words = test["name"], test["command"]
            env = next((p["value"] for p in test["properties"] if p["name"] == "ENVIRONMENT"), [])
            if "tests/" + name in self.links:
                self.listed[name] = Test(name, ("tests/" + name,), env=tuple(env))
            elif name.startswith("case_"):
                script = next(i for i, w in enumerate(words) if w.endswith(".py"))
                programs = ["bipot"]
                if "deck_server" in Path(words[script]).read_text():
                    programs.append("tests/deck_server")
                called = tuple(words[script - 2 : script + 1])
                self.listed[name] = Test(name, tuple(programs), called, env=tuple(env))
            times = self.build / "test-times" / name
            if name in self.listed and times.exists():
                parts = re.findall(r"(\d+)m([\d.]+)s", times.read_text())
                self.times[name] = sum(60 * float(m) + float(s) for m, s in parts)
        self.order = re.findall(r"^  (\S+\.f90)$", (SOURCE / "CMakeLists.txt").read_text(), re.M)
        for file in self.order:
            text = (SOURCE / file).read_text()
            self.uses[file] = set(re.findall(r"^\s*use\s+(\w+)", text, re.M))
            for module in re.findall(r"^\s*module\s+(?!procedure\b)(\w+)\s*$", text, re.M):
                self.makes[module] = file
            for name in re.findall(r"^\s*include '([^']+\.inc)'", text, re.M):
                self.included.setdefault(str(Path(file).parent / name), []).append(file)
        return self

    def asked(self, *command: str) -> str:
        """Return what a command prints in the tree."""
        return subprocess.run(
            command, cwd=self.build, check=True, capture_output=True, text=True
        ).stdout

    def files(self) -> list[str]:
        """Return what can be mutated: sources that the tree builds, and what they include."""
        there = [f for f in self.order if f in self.compile]
        return [*there, *sorted(f for f, users in self.included.items() if set(users) & set(there))]

    def reached(self, modules: set[str]) -> set[str]:
        """Return the source files that users of these modules use, directly or not."""
        found: set[str] = set()
        waiting = [self.makes[m] for m in modules if m in self.makes]
        while waiting:
            file = waiting.pop()
            if file not in found:
                found.add(file)
                waiting += [self.makes[m] for m in self.uses[file] if m in self.makes]
        return found | {i for i, users in self.included.items() if found & set(users)}

    def tests_of(self, file: str, quick: float) -> list[Test]:
        """Return the tests that can notice a change of a file.

        Units of its room, other units, CASES, and the cases that take `quick` seconds at most:
        first those in a folder of that name, the quickest first.
        """
        units = []
        samples = {}
        for path in sorted((ROOT / "tests/samples").glob("*.f90")):
            samples[path.stem] = set(re.findall(r"^\s*use\s+(\w+)", path.read_text(), re.M))
        top = file.split("/")[0]
        folders = {path.parent for path in (ROOT / "tests").rglob("test_*.pf")}
        for folder in sorted(folders):
            place = folder.relative_to(ROOT / "tests").parts
            used: set[str] = set()
            for path in folder.glob("*"):
                if path.suffix in (".pf", ".f90"):
                    used |= set(re.findall(r"^\s*use\s+(\w+)", path.read_text(), re.M))
            for sample in used & set(samples):
                used |= samples[sample]
            name = "_".join(["unit", *place])
            if name in self.listed and file in self.reached(used):
                units.append((place[0] != top, name))
        tests = [self.listed[name] for _, name in sorted(units)]
        for case in CASES.get(room_of(file), CASES.get(top, [])):
            name, *classes = case.split()
            named = "-".join([name, *classes])
            tests.append(replace(self.listed[name], name=named, classes=tuple(classes)))
        cases = []
        for test in self.listed.values():
            if test.called and self.times.get(test.name, quick + 1.0) <= quick:
                folder = Path(test.called[-1]).parent.name
                cases.append((folder != top, self.times[test.name], test.name))
        tests += [self.listed[name] for _, _, name in sorted(cases)]
        return [replace(test, digest=self.digest_of(test)) for test in tests]

    def digest_of(self, test: Test) -> str:
        """Return what changes when the test does."""
        if test.called:
            return digest(Path(test.called[-1]).read_bytes())
        objects = sorted(p for p in self.links[test.programs[0]] if p.endswith(".o"))
        return digest(*((self.build / p).read_bytes() for p in objects))


def run(
    command: list[str], folder: Path, limit: float, env: dict[str, str] | None = None
) -> tuple[int | None, str]:
    """Run a command and all it starts; return its status, None if it took too long, and output."""
    bounded = ["bash", "-c", f'ulimit -v {MEMORY_KB} -c 0 -f 2000000; exec "$@"', "bash", *command]
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(
            bounded,
            cwd=folder,
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            status: int | None = process.wait(limit)
        except subprocess.TimeoutExpired:
            status = None
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        size = out.tell()
        out.seek(max(0, size - 100_000))
        return status, out.read().decode(errors="replace")


class Bench:
    """A folder for one mutant after the other: its source, its objects, its programs."""

    def __init__(self, tree: Tree, folder: Path) -> None:
        """Make the folder."""
        self.tree = tree
        self.folder = folder
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "modules").mkdir(parents=True)
        (folder / "run").mkdir()
        (folder / "tests").mkdir()
        self.objects: list[tuple[str, str]] = []  # the library of each one's room, and it

    def compile(self, file: str, text: str, mutated: bool = True) -> str:
        """Compile one source file; return the compiler's complaint, empty if there is none."""
        tree = self.tree
        source = self.folder / "source" / file
        source.parent.mkdir(parents=True, exist_ok=True)
        source.write_text(text)
        target = self.folder / (file.replace("/", "_") + ".o")
        first, *flags = tree.compile[file]
        command = [
            os.environ.get("FC", first),
            "-I" + str(self.folder / "modules"),
            "-I" + str(source.parent),
            *flags,
            *(MUTATED if mutated else ["-w"]),
            "-J" + str(self.folder / "modules"),
            "-c",
            str(source),
            "-o",
            str(target),
        ]
        status, output = run(command, tree.build, 600.0)
        if status != 0:
            return output.strip() or "the compiler did not end"
        room = Path(file).parent.as_posix().replace("/", "_")
        self.objects.append((f"lib{room}_room.a", str(target)))
        return ""

    def build(self, file: str, text: str) -> str:
        """Compile a changed file and, where its modules change, those that use them."""
        self.clear()
        if file in self.tree.included:
            path = self.folder / "source" / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            first = self.tree.included[file]
        else:
            first = [file]
        changed: set[str] = set()
        for user in self.tree.order:
            if user in first or self.tree.uses[user] & changed:
                whole = text if user == file else (SOURCE / user).read_text()
                if complaint := self.compile(user, whole, user in first):
                    return complaint
                changed |= self.changed_modules(user)
        return ""

    def changed_modules(self, file: str) -> set[str]:
        """Return the modules of a file that are not those of the tree; remove the others."""
        found = set()
        for module, home in self.tree.makes.items():
            if home == file:
                made = self.folder / "modules" / f"{module.lower()}.mod"
                there = self.tree.build / "src/modules" / Path(home).parent / made.name
                if made.read_bytes() == there.read_bytes():
                    made.unlink()
                else:
                    found.add(module)
        return found

    def clear(self) -> None:
        """Forget the objects and programs of the last mutant."""
        self.objects = []
        for program in self.tree.links:
            (self.folder / program).unlink(missing_ok=True)
        for path in (self.folder / "modules").iterdir():
            path.unlink()
        shutil.rmtree(self.folder / "source", ignore_errors=True)

    def link(self, name: str) -> None:
        """Link a program with the objects, unless that is done."""
        program = self.folder / name
        if program.exists():
            return
        link = self.tree.links[name]
        at = link.index("-o")
        rooms = {Path(word).name for word in link}
        objects = [made for library, made in self.objects if library in rooms]
        command = [*link[:at], *objects, "-o", str(program), *link[at + 2 :]]
        status, output = run(command, self.tree.build, 600.0)
        if status != 0:
            raise RuntimeError(f"{name} does not link: {output}")

    def judge(self, test: Test, limit: float) -> tuple[bool, str]:
        """Run a test of the programs linked with the objects; whether it passes, else its words."""
        for name in test.programs:
            self.link(name)
        program = self.folder / test.programs[0]
        env = {
            **os.environ,
            **dict(word.split("=", 1) for word in test.env),
            "BIPOT": str(program),
            "TMPDIR": str(self.folder / "run"),
        }
        called = [str(program)]
        if test.called:
            called = [*test.called, "--failfast", *test.classes]
        status, output = run(called, self.folder / "run", limit, env)
        shutil.rmtree(self.folder / "run", ignore_errors=True)
        (self.folder / "run").mkdir()
        if status in (0, SKIPPED):
            return True, ""
        if status is None:
            return False, "hangs"
        for pattern in (
            r"^\S+\.(\w+) \.\.\. FAILED$",
            r"^(?:FAIL|ERROR): (\w+)",
            r"^\S+\.(\w+) \.\.\.(?! ok)",
        ):
            if match := re.search(pattern, output, re.M):
                return False, match[1]
        return False, f"status {status}"


def sample(files: list[str], options: argparse.Namespace) -> list[Mutant]:
    """Choose mutants of a room, the kinds of change in turn."""
    count, seed = options.count, options.seed
    by_kind: dict[str, list[tuple[str, Mutant]]] = defaultdict(list)
    for file in files:
        for mutant in mutants_of(file, (SOURCE / file).read_text()):
            if options.kinds and mutant.kind not in options.kinds:
                continue
            place = hashlib.sha256(f"{seed}|{mutant.name}".encode()).hexdigest()
            by_kind[mutant.kind].append((place, mutant))
    kinds = [sorted(by_kind[k], key=lambda p: p[0]) for k in sorted(by_kind)]
    chosen: list[Mutant] = []
    while len(chosen) < count and any(kinds):
        for kind in kinds:
            if kind and len(chosen) < count:
                chosen.append(kind.pop(0)[1])
    return chosen


def read_equivalent(path: Path) -> dict[tuple[str, str, str, str], str]:
    """Read the mutants that change nothing: (file, procedure, old, new) and the reason."""
    found: dict[tuple[str, str, str, str], str] = {}
    place, old, new = ["", ""], "", ""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.startswith("@ "):
            place = [*line[2:].split(), ""][:2]
        elif line.startswith("- "):
            old = line[2:].strip()
        elif line.startswith("+"):
            new = line[1:].strip()
        elif line.startswith("= "):
            found[(place[0], place[1], old, new)] = line[2:].strip()
        elif line.strip() and not line.startswith("#"):
            sys.exit(f"{path}:{number}: expected '@', '-', '+', '=' or '#'")
    return found


def check_equivalent(tree: Tree, listed: dict[tuple[str, str, str, str], str]) -> list[str]:
    """Say which entries are of no mutant: the line has changed."""
    there: set[tuple[str, str, str, str]] = set()
    for file in {key[0] for key in listed}:
        path = SOURCE / file
        for m in mutants_of(file, path.read_text()) if path.exists() else []:
            there.add((m.file, m.procedure, m.old, m.new))
    return [f"{k[0]} {k[1]}: {k[2]}" for k in listed if k not in there]


class Campaign:
    """Mutants, what became of them, and what is still to do."""

    def __init__(self, tree: Tree, options: argparse.Namespace) -> None:
        """Read what earlier calls found."""
        self.tree = tree
        self.options = options
        self.folder = tree.build / "mutation"
        self.folder.mkdir(exist_ok=True)
        self.store = self.folder / "results.jsonl"
        self.known: dict[str, dict] = {}
        self.lock, self.measuring = Lock(), Lock()
        self.tests: dict[str, list[Test]] = {}
        self.seconds: dict[str, float] = {}
        if self.store.exists():
            for line in self.store.read_text().splitlines():
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue  # the line that was being written when a call was ended
                self.known[entry["mutant"]] = entry

    def keep(
        self, mutant: Mutant, outcome: str, by: str, passed: dict[str, str], source: str
    ) -> None:
        """Note what became of a mutant."""
        entry = {
            "mutant": mutant.name,
            "file": mutant.file,
            "procedure": mutant.procedure,
            "line": mutant.first,
            "kind": mutant.kind,
            "old": mutant.old,
            "new": mutant.new,
            "outcome": outcome,
            "by": by,
            "passed": passed,
            "source": source,
        }
        with self.lock:
            self.known[mutant.name] = entry
            with self.store.open("a") as out:
                out.write(json.dumps(entry) + "\n")
            what = mutant.new or "(dropped)"
            place = f"{mutant.file}:{mutant.first}"
            print(f"{outcome:16} {place} {mutant.kind}: {what}  {by}", flush=True)

    def to_do(self, mutant: Mutant) -> list[Test]:
        """Return the tests that this mutant has not met yet; none if its end is known."""
        entry = self.known.get(mutant.name)
        tests = [t for t in self.tests[mutant.file] if not (self.options.units_only and t.called)]
        if entry is None:
            return tests
        if entry["outcome"] != "survived":
            return []
        return [t for t in tests if entry["passed"].get(t.name) != t.digest]

    def compile_unmutated(self, mutants: list[Mutant]) -> None:
        """Compile the files as mutants are, unmutated: what a test must pass to be believed."""
        files = {m.file for m in mutants if self.to_do(m)}
        self.unmutated = Bench(self.tree, self.folder / "unmutated")
        for file in sorted({user for f in files for user in self.tree.included.get(f, [f])}):
            if complaint := self.unmutated.compile(file, (SOURCE / file).read_text()):
                sys.exit(f"{file} does not compile unmutated: {complaint}")

    def usual_time(self, test: Test) -> float:
        """Return the seconds that a test takes unmutated, which it must pass: it runs once."""
        with self.measuring:
            if test.name not in self.seconds:
                start = time.monotonic()
                passes, says = self.unmutated.judge(test, 3600.0)
                if not passes:
                    raise RuntimeError(f"{test.name} fails unmutated: {says}")
                self.seconds[test.name] = time.monotonic() - start
                print(f"{test.name}: {self.seconds[test.name]:.1f} s unmutated", flush=True)
            return self.seconds[test.name]

    def meet(self, mutant: Mutant, bench: Bench) -> None:
        """Build one mutant and run its tests until one notices."""
        tests = self.to_do(mutant)
        text = (SOURCE / mutant.file).read_text()
        if not tests:
            if mutant.name not in self.known:
                self.keep(mutant, "survived", "no test reaches it", {}, digest(text.encode()))
            return
        entry = self.known.get(mutant.name, {})
        passed = dict(entry.get("passed", {}))
        source = digest(text.encode())
        if bench.build(mutant.file, "\n".join(mutant.apply(text.splitlines())) + "\n"):
            self.keep(mutant, "does not compile", "", {}, source)
            return
        for test in tests:
            passes, says = bench.judge(test, AND_SECONDS + MANY_TIMES * self.usual_time(test))
            if not passes:
                self.keep(mutant, "killed", f"{test.name}: {says}", passed, source)
                return
            passed[test.name] = test.digest
        self.keep(mutant, "survived", "", passed, source)

    def go(self, mutants: list[Mutant]) -> None:
        """Do what is still to do."""
        for file in {m.file for m in mutants}:
            self.tests[file] = self.tree.tests_of(file, self.options.quick)
        self.compile_unmutated(mutants)
        benches = [Bench(self.tree, self.folder / f"bench{i}") for i in range(self.options.jobs)]
        free = list(benches)

        def one(mutant: Mutant) -> None:
            with self.lock:
                bench = free.pop()
            try:
                self.meet(mutant, bench)
            finally:
                with self.lock:
                    free.append(bench)

        with ThreadPoolExecutor(self.options.jobs) as pool:
            for done in [pool.submit(one, m) for m in mutants]:
                done.result()


def report(
    campaign: Campaign, mutants: list[Mutant], equivalent: dict[tuple[str, str, str, str], str]
) -> tuple[str, float]:
    """Say how many of each room were killed, and which survived; the part killed of all."""
    rooms: dict[str, Counter[str]] = defaultdict(Counter)
    lines = []
    for m in mutants:
        entry = campaign.known.get(m.name)
        if entry is None:
            continue
        outcome = entry["outcome"]
        if outcome == "survived" and (m.file, m.procedure, m.old, m.new) in equivalent:
            outcome = "equivalent"
        key = m.file if campaign.options.by_file else room_of(m.file)
        rooms[key][outcome] += 1
        if outcome == "survived":
            by = f": {entry['by']}" if entry["by"] else ""
            lines.append(
                f"survived {m.file}:{m.first} {m.procedure} ({m.kind}){by}\n- {m.old}\n+ {m.new}"
            )
    width = max((len(r) for r in rooms), default=0) + 2
    lines.append(
        f"{'':{width}}" + "".join(f"{o:>18}" for o in OUTCOMES) + f"{'of those that differ':>22}"
    )
    total: Counter[str] = Counter()
    for room in sorted(rooms):
        total += rooms[room]
    for room, counts in [*sorted(rooms.items()), *([("all", total)] if len(rooms) > 1 else [])]:
        differ = counts["killed"] + counts["survived"]
        part = f"{100 * counts['killed'] / differ:.0f} %" if differ else "-"
        lines.append(
            f"{room:{width}}" + "".join(f"{counts[o]:18}" for o in OUTCOMES) + f"{part:>22}"
        )
    differ = total["killed"] + total["survived"]
    return "\n".join(lines), total["killed"] / differ if differ else 1.0


def main() -> int:
    """Read the command line, meet the mutants, print the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument(
        "--room", action="append", default=[], help="a folder of src/, contact/geometry say"
    )
    parser.add_argument("--file", action="append", default=[], help="a file below src/")
    parser.add_argument(
        "--count", type=int, default=60, help="mutants a room, or a file where files are named (60)"
    )
    parser.add_argument("--together", action="store_true", help="so many of all rooms together")
    parser.add_argument("--kinds", nargs="+", default=[], help="of change, only these")
    parser.add_argument(
        "--least", type=float, default=0.0, help="part killed below which the exit status is 1"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--build", type=Path, default=ROOT / "build", help="a built Release tree with its tests"
    )
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time")
    parser.add_argument(
        "--no-build", action="store_true", help="the tree is up to date, or to be taken as it is"
    )
    parser.add_argument("--units-only", action="store_true", help="without whole-program cases")
    parser.add_argument(
        "--by-file", action="store_true", help="a line of the report a file, not a room"
    )
    parser.add_argument("--list", action="store_true", help="list the mutants and do nothing")
    parser.add_argument("--report", action="store_true", help="report what is known and do nothing")
    parser.add_argument(
        "--quick", type=float, default=4.0, help="seconds that cases of any room may take (4)"
    )
    options = parser.parse_args()
    if not (options.build / "build.ninja").exists():
        parser.error(f"{options.build}: expected a tree built by Ninja with BIPOT_TESTS=ON")
    if not options.no_build and not (options.list or options.report):
        subprocess.run(["ninja", "-C", options.build], check=True, stdout=subprocess.DEVNULL)
    tree = Tree(options.build.resolve()).read()
    if not (tree.times or options.units_only):
        parser.error(f"{options.build}/test-times: no times of cases; scripts/test writes them")
    files = tree.files()
    groups = []
    for file in options.file:
        if file not in files:
            parser.error(f"--file {file}: not in src/CMakeLists.txt")
        groups.append([file])
    rooms = sorted({room_of(f) for f in files})
    for room in options.room or ([] if options.file else rooms):
        if room not in rooms:
            parser.error(f"--room {room}: expected one of {', '.join(rooms)}")
        groups.append([f for f in files if room_of(f) == room])
    if options.together:
        groups = [[f for group in groups for f in group]]
    mutants = [m for group in groups for m in sample(group, options)]
    if options.list:
        for m in mutants:
            print(f"{m.name} {m.file}:{m.first} {m.kind}\n- {m.old}\n+ {m.new}")
        return 0
    equivalent = read_equivalent(HERE / "equivalent.txt")
    for stale in check_equivalent(tree, equivalent):
        print(f"equivalent.txt: no such mutant any more: {stale}")
    campaign = Campaign(tree, options)
    if not options.report:
        campaign.go(mutants)
    words, part = report(campaign, mutants, equivalent)
    print(words)
    return int(part < options.least)


if __name__ == "__main__":
    sys.exit(main())
