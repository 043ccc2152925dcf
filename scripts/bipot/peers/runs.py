"""Run a deck here, in CalculiX and in GetFEM, and hold all against our converged solution.

    comparison = compare(Path("input/block.inp"), {"n": "8"}, [1e7, 1e8], options)
    for run in comparison.runs: ...

Times are processor seconds, user and system, of the whole process, one thread each; memory is the
most that the process ever had. The error of a run is the largest difference of a pair's resultant
from the reference over the increments, relative to the largest resultant of the run.
"""

import math
import os
import re
import shutil
import subprocess
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bipot.peers.calculix_deck import (
    MORTAR,
    NODES,
    SURFACES,
    Penalty,
    check_translatable,
    deck_lines,
    read_resultants,
)
from bipot.peers.flat_deck import DeckError, read_flat
from bipot.peers.getfem_problem import AUGMENTATION, TOLERANCE, problem_arrays, read_output
from bipot.program import run_words, with_threads
from bipot.result import Result

CCX = "ccx"
PACKAGES = {"CalculiX": "calculix-ccx", "GetFEM": "python3-getfem"}  # Debian's
SOLVE_IN_GETFEM = Path(__file__).resolve().with_name("getfem_contact.py")
TOLERANCES = ("1e-13", "1e-12", "1e-11", "1e-10")  # of the reference: the first that is certified
# Largest tension of ccx's open points, of the largest contact pressure. It matters to no digit that
# is compared, but ccx diverges by chance in an increment; then the next is tried.
TENSIONS = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)

CHANGE = 3e-4  # of the largest resultant: a tenfold penalty leaves a ninth of it, below 1e-4
RAISES = 5     # of the penalty, tenfold each: beyond 1e5 of them ccx's numbers lose their digits


class PeerError(Exception):
    """The comparison cannot be made."""


@dataclass
class Measured:
    """What a process took."""

    status: int     # exit status; negative: ended by that signal
    seconds: float  # processor time, user and system
    memory: float   # bytes, the most it had
    stopped: bool   # by us


@dataclass
class PeerRun:
    """A row of the comparison."""

    program: str
    settings: str
    seconds: float
    memory: float
    error: float
    increments: int       # that it finished
    total: int            # that the deck has
    note: str = ""
    iterations: int = 0   # Newton iterations, a factorisation each, of a peer
    expected: float = 0.0  # of them in the whole run, where it was stopped
    forces: np.ndarray | None = field(default=None, repr=False, compare=False)

    @property
    def whole_seconds(self):
        """Time of all increments: measured, or that of an iteration times those expected."""
        if self.increments == self.total:
            return self.seconds
        return self.seconds / self.iterations * self.expected if self.iterations else math.nan


@dataclass
class Comparison:
    """The runs of one deck."""

    runs: list = field(default_factory=list)
    equations: int = 0
    points: int = 0
    reference: str = ""
    skipped: list = field(default_factory=list)  # a sentence for each peer that did not run

    def of(self, program):
        """Return the runs of a program."""
        return [run for run in self.runs if run.program == program]


def peak_memory(pid):
    """Return the most memory a live process has had [bytes], 0 when it has gone."""
    try:
        text = Path(f"/proc/{pid}/status").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0
    found = re.search(r"VmHWM:\s+(\d+) kB", text)
    return 1024 * int(found[1]) if found else 0


def measure(command, folder, log, must_stop=lambda seconds: False, threads=1):
    """Run a command to its end, or until `must_stop` of its processor seconds is true.

    The resource usage of a child holds the memory of the process that started it, so memory is read
    from /proc while the command runs.
    """
    with log.open("wb") as output:
        process = subprocess.Popen(
            [str(word) for word in command], cwd=folder, env=with_threads(threads),
            stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
        )
        memory, stopped, looked = 0, False, 0.0
        begun = time.monotonic()
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            memory = max(memory, peak_memory(process.pid))
            if not stopped and time.monotonic() - looked > 0.5:
                looked = time.monotonic()
                if must_stop(seconds_so_far(process.pid)):
                    process.kill()
                    stopped = True
            # A short run is looked at often: its memory is known only while it lives.
            time.sleep(min(0.05, 0.002 + 0.02 * (time.monotonic() - begun)))
        process.returncode = os.waitstatus_to_exitcode(status)
    return Measured(process.returncode, usage.ru_utime + usage.ru_stime, memory, stopped)


def seconds_so_far(pid):
    """Return the processor seconds of a live process."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return 0.0
    user, system = text.rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def run_ours(program, deck, overrides, folder, name, home=None):
    """Run bipot; return what it took and its result, None where it failed.

    `home` is the folder where the deck's includes are, if not its own.
    """
    command = run_words(program, deck, folder / f"{name}.vtkhdf", overrides)
    log = folder / f"{name}.log"
    taken = measure(command, home or deck.parent, log)
    if taken.status == 0:
        return taken, Result(folder / f"{name}.vtkhdf")
    if taken.status == 1:
        raise PeerError(log.read_text(encoding="utf-8", errors="replace").strip())
    return taken, None


def with_tolerance(text, tolerance):
    """Return the text of a deck with this tolerance of the contact solver."""
    card = re.compile(r"^[ \t]*\*\s*CONTACT\s+SOLVER(?:[^\n]*,[ \t]*\n)*[^\n]*",
                      re.IGNORECASE | re.MULTILINE)
    found = card.search(text)
    if found is None:
        step = re.search(r"^\s*\*\s*STEP", text, re.IGNORECASE | re.MULTILINE)
        at = step.start() if step else len(text)
        return f"{text[:at]}*CONTACT SOLVER, TOLERANCE={tolerance}\n{text[at:]}"
    words, changes = re.subn(r"TOLERANCE\s*=\s*[^,\s]+", f"TOLERANCE={tolerance}", found[0],
                             flags=re.IGNORECASE)
    if not changes:
        words = re.sub(r"(SOLVER)", rf"\1, TOLERANCE={tolerance}", words, count=1,
                       flags=re.IGNORECASE)
    return text[: found.start()] + words + text[found.end() :]


def resultants(result, scene):
    """Return the forces on the slave bodies, (T, pairs, 3), in the order of the deck's pairs.

    T are the deck's increments; those within one that has grown are not numbers. Without a pair
    they are those of the supports on their nodes, (T, supports, 3).
    """
    if not scene.pairs:
        rows = {int(node): row for row, node in enumerate(result.node_ids)}
        chosen = [[rows[node] for node in scene.nodes_of(name)] for name in scene.supports]
        if len(result.field_rows) < result.finished:
            raise PeerError("without a *CONTACT PAIR fields of all increments are compared: "
                            "leave FREQUENCY and TIME POINTS out")
        fields = (result.field("reaction_force", k) for k in range(result.finished))
        forces = np.array([[force[nodes].sum(axis=0) for nodes in chosen] for force in fields])
    else:
        forces = np.stack(
            [result.pairs[f"{p.slave}:{p.master}"].resultant for p in scene.pairs], 1
        )
    ends, begin = [], 0.0
    for step in scene.steps:
        n = step.n_increments
        ends += [begin + step.period * (k + 1) / n for k in range(n)]
        begin += step.period
    found = np.full((len(ends), *forces.shape[1:]), np.nan)
    for instant, force in zip(result.history("time"), forces, strict=True):
        row = int(np.argmin(np.abs(np.array(ends) - instant)))
        if abs(ends[row] - instant) <= 1e-9 * begin:
            found[row] = force
    return found


def error_of(found, reference):
    """Return the largest difference in the increments both have, over the largest resultant."""
    rows = min(len(found), len(reference))
    found, reference = found[:rows], reference[:rows]
    if not np.isfinite(found - reference).any():
        return math.nan
    return float(np.nanmax(abs(found - reference)) / np.nanmax(abs(reference)))


def converged(program, deck, overrides, folder):
    """Return the reference's result and its tolerance, the tightest that is certified."""
    text = deck.read_text(encoding="utf-8-sig")
    copy = folder / deck.name
    for tolerance in TOLERANCES:
        copy.write_text(with_tolerance(text, tolerance), encoding="utf-8")
        _, result = run_ours(program, copy, overrides, folder, "reference", deck.parent)
        if result is not None and result.history("certified").all():
            return result, tolerance
    raise PeerError(f"no run is certified as a reference, even with tolerance {TOLERANCES[-1]}")


def default_penalty(scene, result):
    """Return a stiff penalty: 500 times the stiffest material over the body's extent."""
    modulus = max(map(young_modulus, scene.materials.values()))
    extent = np.ptp(result.points, axis=0).max()
    return float(f"{500 * modulus / extent:.1g}")


def young_modulus(cards):
    """Return Young's modulus at small strain of a material's cards."""
    if "ELASTIC" in cards:
        return float(cards["ELASTIC"][0])
    law, words = next(item for item in cards.items() if item[0].startswith("HYPERELASTIC"))
    constants = [float(word) for word in words]
    n = int(law.split("N=")[1]) if "N=" in law else 1
    if "OGDEN" in law:
        shear, at = sum(constants[: 2 * n : 2]), 2 * n
    elif "YEOH" in law or "REDUCED" in law:
        shear, at = 2 * constants[0], 3 if "YEOH" in law else n
    else:
        at = 1 if "NEO" in law else 2
        shear = 2 * sum(constants[:at])
    bulk = 2 / constants[at]
    return 9 * bulk * shear / (3 * bulk + shear)


def run_calculix(scene, penalties, reference, folder, options):
    """Give the runs of ccx, one a penalty; with pairs of two surfaces, one by mortar as well.

    Its mortar is not run at finite strain: there it ended early, or was a third off. Where
    `penalties` is empty they are raised from the one that suits the scene, tenfold each, until the
    resultants change by less than `CHANGE` from one to the next.
    """
    kind = SURFACES if scene.has_two_surfaces else NODES
    if not scene.pairs:
        yield calculix_run(scene, Penalty(0.0, 0.0, 0.0), "", reference, folder, options)
        return
    raised = not penalties
    if raised:
        penalties = [default_penalty(scene, reference) * 10**k for k in range(RAISES + 1)]
    before = None
    for stiffness in penalties:
        slope = options.slope or stiffness / 10
        settings = f"K {stiffness:.0e}, slope {slope:.0e}"
        run = calculix_run(scene, Penalty(stiffness, slope, 0.0, kind), settings, reference, folder,
                           options)
        whole, change = run.increments == run.total, math.nan
        if whole and before is not None:
            change = error_of(run.forces, before)
            run.note = f"changed by {change:.1e}"
        yield run
        if raised and (change < CHANGE or (before is not None and not whole)):
            break
        before = run.forces if whole else before
    if scene.has_two_surfaces and not scene.finite:
        slope = options.slope or penalties[0] / 10
        yield calculix_run(scene, Penalty(0.0, slope, 0.0, MORTAR), f"mortar, slope {slope:.0e}",
                           reference, folder, options)


def calculix_run(scene, penalty, settings, reference, folder, options):
    """Return the run of ccx with a penalty, the tension of open points the first that it takes."""
    pressure = largest_pressure(reference)
    tensions = TENSIONS if scene.pairs and penalty.kind == NODES else TENSIONS[:1]
    forces = resultants(reference, scene)
    for tension in tensions:
        law = replace(penalty, tension=tension * pressure)
        taken, found, iterations = run_ccx(
            deck_lines(scene, law), scene.n_forces, folder, options
        )
        if len(found) == len(forces) or taken.stopped:
            break
    note, expected = "", 0.0
    if taken.stopped:
        each = options.iterations.get("CalculiX", iterations[0] / max(1, iterations[1]))
        expected = each * len(forces)
        note = f"stopped: {iterations[0]} iterations of {expected:.0f} expected"
    elif len(found) < len(forces):
        note = f"ended in increment {len(found) + 1}"
    return PeerRun(
        "CalculiX", settings, taken.seconds, taken.memory, error_of(found, forces), len(found),
        len(forces), note, iterations[0], expected, found,
    )


def run_ccx(lines, n_forces, folder, options):
    """Run ccx on a deck; return what it took, the resultants of its increments, and the numbers of
    iterations and of increments that it began."""
    for old in folder.glob("peer.*"):
        old.unlink()
    (folder / "peer.inp").write_text("\n".join(lines) + "\n", encoding="ascii")

    def must_stop(seconds):
        done = len(read_resultants(folder / "peer.dat", n_forces))
        return done > 0 and seconds > options.limit

    taken = measure([CCX, "-i", "peer"], folder, folder / "peer.log", must_stop)
    return taken, read_resultants(folder / "peer.dat", n_forces), count_iterations(
        folder / "peer.cvg"
    )


def count_iterations(path):
    """Return the numbers of iterations and of increments in a .cvg file: a line an iteration."""
    text = path.read_text(encoding="ascii", errors="replace") if path.is_file() else ""
    lines = [line.split() for line in text.splitlines() if re.match(r"\s+\d+\s+\d+\s", line)]
    return len(lines), len({tuple(words[:2]) for words in lines})


def python_with_getfem():
    """Return the first Python of the path that has GetFEM; None where none has.

    Debian's python3-getfem is for Debian's Python, which need not be the one that runs this.
    """
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        python = shutil.which("python3", path=folder) if folder else None
        if python is not None:
            asked = subprocess.run([python, "-c", "import getfem"], capture_output=True,
                                   check=False)
            if asked.returncode == 0:
                return python
    return None


def run_getfem(python, problem, reference, scene, folder, options):
    """Return the run of GetFEM on the arrays of a problem."""
    np.savez(folder / "getfem.npz", **problem)
    log = folder / "getfem.log"
    forces, n_pairs = resultants(reference, scene), len(scene.pairs)

    def must_stop(seconds):
        return seconds > options.limit and read_output(log, n_pairs).increments > 0

    taken = measure([python, SOLVE_IN_GETFEM, folder / "getfem.npz"], folder, log, must_stop)
    found = read_output(log, n_pairs)
    seconds, note, expected = taken.seconds, "", 0.0
    if taken.stopped:
        # What it did in the increment that it did not end is neither counted nor timed.
        seconds = found.seconds
        each = options.iterations.get("GetFEM", found.iterations / found.increments)
        expected = each * len(forces)
        note = f"stopped: {found.iterations} iterations of {expected:.0f} expected"
    elif len(found.forces) < len(forces):
        note = f"ended in increment {len(found.forces) + 1}"
    return PeerRun(
        "GetFEM", f"augmentation {AUGMENTATION:g} E h, Newton {TOLERANCE:.0e}", seconds,
        taken.memory, error_of(found.forces, forces), len(found.forces), len(forces), note,
        found.iterations, expected,
    )


def largest_pressure(result):
    """Return the largest normal reaction over the area of its point, or over the mean area."""
    found = [1e-30]
    for pair in result.pairs.values():
        area = np.where(pair.area > 0, pair.area, max(pair.area.mean(), 1e-30))
        found.append(float((pair.reaction[:, :, 0] / area).max(initial=0.0)))
    return max(found)


def compare(program, deck, overrides, penalties, folder, options):
    """Run the deck here and in the peers; `penalties` of ccx empty for one that suits the scene,
    at finite strain for as many as `run_calculix` says.

    `options` has `slope` (None: a tenth of the penalty), `limit`, processor seconds after which a
    run of a peer is stopped, and `iterations`, by the peer's name, those an increment by which its
    time is then extrapolated (where missing: as many as in the increments it began). A peer that is
    not installed, or cannot be given the deck, is named in `skipped`.
    """
    deck = deck.resolve()
    scene = read_flat(program, deck, overrides)
    check_translatable(scene)
    reference, tolerance = converged(program, deck, overrides, folder)
    scene.take_mesh(reference)
    taken, result = run_ours(program, deck, overrides, folder, "ours")
    if result is None:
        raise PeerError(f"{deck.name}: our own run ended with status {taken.status}")
    forces = resultants(reference, scene)
    comparison = Comparison(
        equations=int(result.counters["equations"]),
        points=int(result.counters["contact_points"]), reference=tolerance,
    )
    comparison.runs.append(PeerRun(
        "bipot", "", taken.seconds, taken.memory, error_of(resultants(result, scene), forces),
        len(forces), len(forces),
    ))
    if shutil.which(CCX):
        if not (penalties or scene.finite):
            penalties = [default_penalty(scene, result)]
        comparison.runs += run_calculix(scene, penalties, reference, folder, options)
    else:
        comparison.skipped.append(absent("CalculiX"))
    try:
        problem, python = problem_arrays(scene), python_with_getfem()
    except DeckError as error:
        comparison.skipped.append(f"GetFEM is not given this deck: {error}")
    else:
        if python is None:
            comparison.skipped.append(absent("GetFEM"))
        else:
            comparison.runs.append(
                run_getfem(python, problem, reference, scene, folder, options)
            )
    return comparison


def absent(program):
    """Return the sentence on a peer that is not installed."""
    return f"{program} is not installed (Debian: apt-get install {PACKAGES[program]}): skipped"


def comparison_rows(comparison):
    """Return the rows of a table: program, settings, time, ratio, memory, error, note."""
    ours = comparison.runs[0]
    rows = []
    for run in comparison.runs:
        about = "about " if run.increments < run.total else ""
        ratio = run.whole_seconds / ours.whole_seconds
        failed = math.isnan(ratio) or run.note.startswith("ended")
        rows.append([
            run.program, run.settings,
            "-" if failed else f"{about}{run.whole_seconds:.3g}",
            "-" if failed else f"{ratio:.3g}",
            "-" if math.isnan(run.memory) else f"{run.memory / 1e6:.0f}",
            f"{run.error:.1e}", run.note,
        ])
    return rows


HEAD = ["program", "settings", "processor s", "ratio", "MB", "error of the resultants", ""]

