#!/usr/bin/env python3
"""Run the program on mutated decks and hold it to what it promises of any deck.

    fuzz_decks.py [--bipot P] [--count N] [--seed S] [--first I] [--jobs J] [--runs SHARE]
                  [--server P] [--only NAME ...] [--keep FOLDER]

Deck number I of seed S is always the same; `--first I --count 1` makes it again. Of every deck the
plan is asked for (the deck is read and checked, its cost foreseen), and a share of those that are
accepted and small is run. What is held against the program:

- it ends by itself within 5 s (a plan) or 60 s (a run) of the processor's time, with exit status 0,
  1, 2 or 3, by no signal, without a message of the compiler's run-time library or of a sanitizer;
- status 1 comes with a message that names the deck, and its place where there is one; 2 and 3 with
  a message; 0 with none;
- with --server (build/.../tests/deck_server) decks are read and planned by the thousand in one
  process, without an estimate of their costs, and only runs are made by the program;
- it takes no more memory than its limit, and a run at most twice what its plan says and 100 MB;
- a deck that was made wrong (mutate_deck.wrong) is refused, at the line of the mistake where that
  is known; a deck that is only written differently (mutate_deck.same) keeps its plan;
- a run that ends with status 0 has all increments of its plan in the file, certified, with finite
  numbers; a plan or a refused deck leaves no file.

Findings are printed, and kept with --keep: the deck and what was said. The exit status is 1 where
there are any.
"""

import collections
import concurrent.futures
import os
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mutate_deck
from campaign import ROOT, campaign_options, is_sanitized, keep_file, show_finding
from outcome import ENVIRONMENT, PATIENCE, Outcome, stopped_after

TIME_OF_PLAN, TIME_OF_RUN = 5, 60  # seconds of the processor
ADDRESSES = 1_000_000_000  # bytes that a process may reserve
MEMORY = 600_000_000  # bytes that it may touch while it only plans
# Small forms of the decks in input/: parameters in place of their own.
SMALL = {
    "ball": {"n": 4}, "bend": {"n": 1}, "block": {"n": 2, "steps": 5}, "cantilever": {"n": 1},
    "corner": {"n": 3}, "fall": {"n": 2}, "hertz": {"n": 4}, "incompressible": {"n": 3},
    "ironing": {"n": 2, "steps": 2},
    "mindlin": {"n": 12, "steps": 2},
    "indent": {"n": 2, "times": 1, "steps": 1},
    "patch": {"n": 2}, "pipe": {"n": 3}, "quarter": {"n": 4, "steps": 3}, "rest": {"n": 3},
    "roller": {"n": 4}, "rubber": {"n": 2, "steps": 3}, "slope": {"n": 3},
    "spence": {"n": 4, "steps": 3}, "ssnv128": {"n": 4},
    "tool": {"n": 4, "steps": 2}, "wheel": {"n": 4, "steps": 2},
}
WORDS = ("plane_words", "words")  # of other programs: decks of tests/deck/odd
PIECE = b"** a piece\n*NSET, NSET=PIECE\n1\n"
COMPARED = ("mesh", "bodies", "equations", "contact ", "increments", "fields")


def read_lines(path):
    """A deck as a list of lines, a character a byte."""
    text = path.read_bytes().decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def make_small(lines, parameters):
    """Put other values in the place of a deck's parameters."""
    return [
        next((f"{name} = {value}" for name, value in parameters.items()
              if re.match(rf"{name}\s*=", line)), line)
        for line in lines
    ]


class Corpus:
    """Sound decks that are mutated, and other decks whose pieces are put into them."""

    def __init__(self, only=()):
        """Read the decks of the repository; `only` those of these names are mutated."""
        self.sound = {
            name: make_small(read_lines(ROOT / "input" / f"{name}.inp"), parameters)
            for name, parameters in SMALL.items()
        }
        others = sorted((ROOT / "tests" / "deck").glob("*/*.inp"))
        self.pieces = list(self.sound.values()) + [read_lines(path) for path in others]
        self.odd = {path.stem: read_lines(path)
                    for path in sorted((ROOT / "tests" / "deck" / "odd").glob("*.inp"))}
        for name in WORDS:
            self.sound[name] = self.odd.pop(name)
        if only:
            self.sound = {name: lines for name, lines in self.sound.items() if name in only}
            self.odd = {name: lines for name, lines in self.odd.items() if name in only}

    def deck(self, seed, number):
        """Deck `number`: bytes, kind, what was done to which deck, line of the mistake or None."""
        rng = random.Random(f"{seed}:{number}")
        kind = rng.choices(("wild", "wrong", "same"), (75, 18, 7))[0]
        bases = dict(self.sound)
        if kind == "wild":
            bases.update(self.odd)
        name = rng.choice(sorted(bases))
        lines = list(bases[name])
        ending, place = "\n", None
        if kind == "wild":
            done = mutate_deck.wild(rng, lines, self.pieces)
        elif kind == "wrong":
            mutation, place = mutate_deck.wrong(rng, lines)
            done = [mutation]
        else:
            ending = mutate_deck.same(rng, lines)
            done = [repr(ending)]
        data = ending.join(lines).encode("latin-1")
        return data, kind, f"{name}: {', '.join(done)}", place, rng, name


def figures(output):
    """Equations, increments and seconds of a plan; None where it has no time."""
    found = []
    for pattern in (r"^equations\s+\D*(\d+)", r"^increments\s+\D*(\d+)",
                    r"^time\s+about\s+([\d.e-]+) s "):
        match = re.search(pattern, output, re.M)
        if not match:
            return None
        found.append(float(match.group(1)))
    return found


def planned_increments(output):
    """The fewest and the most increments of a plan; those that are not solved are cut beside."""
    match = re.search(r"^increments\s+\w+\s+(\d+).*$", output, re.M)
    turns = re.search(r"; (\d+) more for", match.group())
    more = re.search(r"; up to (\d+) more", match.group())
    least = int(match.group(1)) + (int(turns.group(1)) if turns else 0)
    return least, least + (int(more.group(1)) if more else 0)


def planned_memory(output):
    """The memory of a plan in bytes."""
    match = re.search(r"^memory\s+about\s+([\d.e+]+) ([kMG])B", output, re.M)
    return float(match.group(1)) * {"k": 1e3, "M": 1e6, "G": 1e9}[match.group(2)] if match else 0.0


def fixed_lines(output):
    """The lines of a plan that do not depend on the machine."""
    return [line for line in output.splitlines() if line.startswith(COMPARED)]


class Server:
    """A process that reads and plans one deck after the other."""

    def __init__(self, path, addresses):
        """Start it in a folder of its own."""
        self.path, self.addresses = path, addresses
        self.folder = tempfile.TemporaryDirectory(prefix="bipot-fuzz-")
        (Path(self.folder.name) / "deck.inp").write_bytes(b"** a deck\n")
        (Path(self.folder.name) / "piece.inp").write_bytes(PIECE)
        self.process = None

    def start(self):
        """Start the process, or start it again."""

        def prepare():
            if self.addresses:
                resource.setrlimit(resource.RLIMIT_AS, (self.addresses, self.addresses))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

        self.errors = open(Path(self.folder.name) / "errors", "w+b")  # noqa: SIM115
        self.process = subprocess.Popen(
            [self.path], cwd=self.folder.name, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=self.errors, env=ENVIRONMENT, preexec_fn=prepare,
        )

    def ask(self, data, limit):
        """What the program would say to a deck; an outcome like that of a process."""
        if self.process is None or self.process.poll() is not None:
            self.start()
        process = self.process
        before = processor_seconds(process.pid)
        outcome = Outcome.__new__(Outcome)
        outcome.limit, outcome.peak = limit, 0
        started = time.monotonic()
        with stopped_after(process, PATIENCE) as stopped:
            try:
                process.stdin.write(struct.pack("i", len(data)) + data)
                process.stdin.flush()
                head = process.stdout.read(8)
            except BrokenPipeError:
                head = b""
            if len(head) == 8:
                status, length = struct.unpack("ii", head)
                said = process.stdout.read(length).decode("utf-8", "replace")
                outcome.status = status
                outcome.errors, outcome.output = (said, "") if status else ("", said)
            else:
                outcome.status, outcome.output = process.wait(), ""
                self.errors.seek(0)
                outcome.errors = self.errors.read().decode("utf-8", "replace")
        outcome.timed_out = stopped.is_set()
        outcome.waited = time.monotonic() - started
        outcome.seconds = processor_seconds(process.pid) - before
        return outcome


def processor_seconds(pid):
    """Seconds of the processor that a process has used so far."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Fuzz:
    """A campaign: decks by their numbers, findings by what they are."""

    def __init__(self, arguments):
        """Prepare the campaign."""
        self.arguments = arguments
        self.corpus = Corpus(arguments.only)
        self.sanitized = is_sanitized(arguments.bipot)
        self.addresses = 0 if self.sanitized else ADDRESSES
        self.slow = 4 if self.sanitized else 1
        self.plans = {}
        self.server = None
        if arguments.server:
            self.server = Server(str(Path(arguments.server).resolve()), self.addresses)
        if arguments.runs > 0:
            import h5py  # noqa: F401  (missing it shows here, not in every run)

    def ask(self, data, folder, *options, limit=TIME_OF_PLAN):
        """Run the program on a deck, or ask the server for its plan."""
        if self.server and options:
            return self.server.ask(data, limit * self.slow)
        return self.run_program(data, folder, *options, limit=limit)

    def run_program(self, data, folder, *options, limit=TIME_OF_PLAN):
        """Run the program on a deck."""
        shutil.rmtree(folder / "work", ignore_errors=True)
        (folder / "work").mkdir()
        (folder / "work" / "deck.inp").write_bytes(data)
        (folder / "work" / "piece.inp").write_bytes(PIECE)
        return Outcome([self.arguments.bipot, "deck.inp", *options], folder,
                       limit * self.slow, self.addresses)

    def judge(self, number):
        """Try deck `number`: (kind, status, ran, complaints, what was done, deck, outcome)."""
        data, kind, done, place, rng, name = self.corpus.deck(self.arguments.seed, number)
        with tempfile.TemporaryDirectory(prefix="bipot-fuzz-") as scratch:
            folder = Path(scratch)
            outcome = self.ask(data, folder, "--plan")
            complaints = outcome.complaints()
            if not self.server and sorted(os.listdir(folder / "work")) != ["deck.inp", "piece.inp"]:
                complaints.append("a plan left files behind")
            if outcome.peak > MEMORY * self.slow and not self.sanitized:
                complaints.append(f"{outcome.peak / 1e6:.0f} MB for a plan")
            if kind == "wrong":
                complaints += self.held_to_wrong(outcome, place)
            if kind == "same" and not complaints:
                complaints += self.held_to_same(outcome, name, folder)
            ran = False
            if outcome.status == 0 and not complaints and rng.random() < self.arguments.runs:
                plan = outcome
                if self.server:
                    plan = self.run_program(data, folder, "--plan")
                    complaints = plan.complaints()
                size = figures(plan.output)
                if size and size[0] <= 1500 and size[1] <= 60 and size[2] <= 2.0:
                    ran = True
                    outcome = self.ask(data, folder, limit=TIME_OF_RUN)
                    complaints += outcome.complaints() + self.held_to_run(outcome, plan, folder)
        return kind, outcome.status, ran, complaints, done, data, outcome

    def held_to_wrong(self, outcome, place):
        """A deck that is wrong must be refused at the line of its mistake."""
        if outcome.status != 1:
            return [f"a wrong deck ended with status {outcome.status}"]
        if place is None:
            return []
        lines = [int(n) for n in re.findall(r"deck\.inp:(\d+):\d+: error: ", outcome.errors)]
        return [] if place + 1 in lines else [f"no mistake at line {place + 1}, but at {lines}"]

    def held_to_same(self, outcome, name, folder):
        """A deck that says the same must have the same plan."""
        if name not in self.plans:
            data = "\n".join(self.corpus.sound[name]).encode("latin-1")
            self.plans[name] = fixed_lines(self.ask(data, folder, "--plan").output)
        if outcome.status != 0:
            return [f"a sound deck ended with status {outcome.status}"]
        if fixed_lines(outcome.output) != self.plans[name]:
            return ["the plan changed with the way the deck is written"]
        return []

    def held_to_run(self, outcome, plan, folder):
        """A run keeps to its plan, and its file is what the program says of it."""
        import h5py
        import numpy

        found = []
        file = folder / "work" / "deck.vtkhdf"
        limit = 2.0 * planned_memory(plan.output) + 1e8
        if outcome.peak > limit and not self.sanitized:
            found.append(f"{outcome.peak / 1e6:.0f} MB for a run, planned {limit / 1e6:.0f} MB")
        if outcome.status == 1:
            found.append("a deck with a plan was refused")
        if outcome.status == 0 and not file.exists():
            found.append("status 0 without a result")
        if outcome.status != 0 or not file.exists():
            return found
        with h5py.File(file) as result:
            rows = int(result["history"].attrs["finished"])
            least, most = planned_increments(plan.output)
            if not least <= rows or (rows > most and "did not converge" not in outcome.output):
                found.append(f"{rows} increments in the file, not those of the plan")
            uncertified = "STOP=CHANGE" in plan.output or "change" in plan.output
            if not uncertified and not result["history/certified"][:rows].all():
                found.append("status 0 with an increment that is not certified")

            def look(name, item):
                if isinstance(item, h5py.Dataset) and item.dtype.kind == "f" and item.size:
                    values = item[()]
                    if not numpy.isfinite(values).all() and name.split("/")[-1] != "convergence":
                        found.append(f"/{name} has numbers that are not finite")

            result.visititems(look)
        return found

    def keep(self, number, complaints, done, data, outcome):
        """Show a finding and keep its deck."""
        show_finding(f"deck {number}", complaints, done, outcome)
        folder = self.arguments.keep
        if folder:
            keep_file(folder, f"{number}.inp", data)
            (folder / f"{number}.txt").write_text(
                f"{complaints}\n{done}\nstatus {outcome.status}\n{outcome.errors}\n{outcome.output}"
            )

    def go(self):
        """Try all decks; the number of findings."""
        counts, slowest, peak, findings = collections.Counter(), (0.0, -1), (0, -1), 0
        started = time.monotonic()
        numbers = range(self.arguments.first, self.arguments.first + self.arguments.count)
        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            for number, answer in zip(numbers, pool.map(self.judge, numbers), strict=True):
                kind, status, ran, complaints, done, data, outcome = answer
                counts[kind, "run" if ran else "plan", status] += 1
                if not ran:
                    slowest = max(slowest, (outcome.seconds, number))
                    peak = max(peak, (outcome.peak, number))
                if complaints:
                    findings += 1
                    self.keep(number, complaints, done, data, outcome)
                if self.arguments.count >= 2000 and (number - self.arguments.first) % 1000 == 999:
                    print(f"{number + 1 - self.arguments.first} decks, {findings} findings, "
                          f"{time.monotonic() - started:.0f} s", flush=True)
        print(f"\n{self.arguments.count} decks of seed {self.arguments.seed} in "
              f"{time.monotonic() - started:.0f} s: {findings} findings")
        for key, number in sorted(counts.items(), key=str):
            print(f"  {key[0]:6s} {key[1]:5s} exit status {key[2]:3d}: {number}")
        print(f"  slowest plan {slowest[0]:.2f} s (deck {slowest[1]}), "
              f"most memory of a plan {peak[0] / 1e6:.0f} MB (deck {peak[1]})")
        return findings


def main():
    """Read the command line and go."""
    parser = campaign_options(__doc__, "deck", 1000)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--runs", type=float, default=0.2, help="share of accepted decks to run")
    parser.add_argument("--only", nargs="+", default=(), metavar="NAME",
                        help="mutate only these decks of input/ and tests/deck/odd")
    parser.add_argument("--server", help="the program deck_server, which plans in one process")
    return 1 if Fuzz(parser.parse_args()).go() else 0


if __name__ == "__main__":
    sys.exit(main())
