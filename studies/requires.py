"""Make docs/studies/requires.md: scenes that ask for more than they need, before and after.

    studies/run requires --before PROGRAM [--rounds 5] [--only WORD] [-o PAGE]
    studies/run requires --page

Each scene runs with an older build (`--before`) and with this one in turns, with one BLAS thread,
and beside them what it would be without what it does not need. Times are user time of the
processor, and medians: ratios those of the rounds, for machines are shared. They are kept in
studies/data/requires.csv, with the largest difference between the two builds' results; --page runs
nothing. --only runs the scenes whose name holds a word, and keeps the others' figures.
"""

import argparse
import csv
import math
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from collections import namedtuple
from pathlib import Path

import numpy as np

from bipot.program import ROOT, run_words, with_threads
from bipot.report import machine
from bipot.result import Result
from studies.deck_cards import block, deck, pair, step
from studies.pages import StudyError, put_page, table
from studies.speed import PHASES, limits, row_of

RUNS = ROOT / "studies" / "data" / "requires.csv"
PAGE = ROOT / "docs" / "studies" / "requires.md"
COLUMNS = ("scene", "before", "after", "ratio", "without", "difference", "rounds", "status",
           "load", "machine", "floor", "total", *PHASES)
LONGEST = 10     # scenes of which the page says where the time goes
TOGETHER = 16    # solutions that share a reading of the factor
LIMIT = 120      # seconds of the processor of one run
AUTO = {"solver": "AUTO", "local": "AUTO"}
BLOCK = {"n": 14, **AUTO}
SIDES = ("before", "after", "without")

# name: of the row; deck(folder): its path; without: the same of a scene that needs no more; wanted:
# seconds that the row asks for; done: what was, or None; most: rounds, where a run is long.
Scene = namedtuple("Scene", "name deck settings without wanted done most", defaults=(9,))


def of_input(name):
    """Return what gives a deck of input/."""
    return lambda _: ROOT / "input" / f"{name}.inp"


def changed(name, *changes):
    """Return what writes a deck of input/, its text changed by pairs (pattern, replacement)."""
    def write(folder):
        text = (ROOT / "input" / f"{name}.inp").read_text(encoding="utf-8")
        for pattern, put in changes:
            text, n = re.subn(pattern, put, text, count=1, flags=re.MULTILINE | re.DOTALL)
            if n != 1:
                raise StudyError(f"input/{name}.inp no longer has {pattern!r}")
        return text_deck(folder, text)
    return write


def text_deck(folder, text):
    """Write a deck and return its path."""
    path = folder / "scene.inp"
    path.write_text(text, encoding="utf-8")
    return path


def given(make):
    """Return what writes the text that `make` returns."""
    return lambda folder: text_deck(folder, make())


def write_stl(path, corners, triangles):
    """Write a binary STL file."""
    x = np.asarray(corners, dtype=float)[np.asarray(triangles)]
    rows = np.zeros(len(x), dtype=[("x", "<f4", (4, 3)), ("n", "<u2")])
    rows["x"][:, 1:] = x
    with path.open("wb") as file:
        file.write(b"bipot".ljust(80) + np.uint32(len(x)).astype("<u4").tobytes())
        file.write(rows.tobytes())


def floor(folder):
    """The paper's block on a plane of two triangles."""
    corners = [(-4, -4, 0), (5, -4, 0), (5, 5, 0), (-4, 5, 0)]
    write_stl(folder / "floor.stl", corners, [(0, 1, 2), (0, 2, 3)])
    return changed("block", (r"TYPE=PLANE\n[^\n]*", "TYPE=STL, INPUT=floor.stl"))(folder)


def ball(folder):
    """The round tool as 101,760 triangles."""
    around, down = 240, 213
    theta = np.pi * np.arange(1, down) / down
    phi = 2 * np.pi * np.arange(around) / around
    ring = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)),
                     np.outer(np.cos(theta), np.ones(around))], axis=-1).reshape(-1, 3)
    corners = 2.0 * np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]]) + [-0.2, 0, 2.0]
    triangles = []
    for j in range(around):
        k = (j + 1) % around
        triangles.append((len(ring), j, k))
        triangles.append((len(ring) + 1, (down - 2) * around + k, (down - 2) * around + j))
        for i in range(down - 2):
            a, b = i * around + j, i * around + k
            triangles += [(a, a + around, b + around), (a, b + around, b)]
    write_stl(folder / "ball.stl", corners, triangles)
    return changed("tool", (r"TYPE=SPHERE, REF NODE=1\n[^\n]*",
                            "TYPE=STL, INPUT=ball.stl, REF NODE=1"))(folder)


FAR = """\\g<0>*BLOCK, NAME=FAR, ELSET=FAR, TYPE=<element>, NX=4, NY=4, NZ=4
5., 0., 0.,  1., 1., 1.
*SOLID SECTION, ELSET=FAR, MATERIAL=STEEL
*BOUNDARY
FAR-XMAX, 1, 3, 0.
"""
FAR_PAIR = "*CONTACT PAIR, INTERACTION=DRY\nBODY-XMAX, FAR-XMIN\n"
BEFORE_SOLVER = r"^BODY-ZMIN, GROUND\n"


def planes(n):
    """A block on n planes, each a little turned and a little lower."""
    cards = [
        f"*OBSTACLE, NAME=O{i}, TYPE=PLANE\n0., 0., {-1e-4 * i!r}, {1e-3 * math.cos(i)!r}, "
        f"{1e-3 * math.sin(i)!r}, 1.\n*CONTACT PAIR, INTERACTION=I\nA-ZMIN, O{i}\n"
        for i in range(n)
    ]
    return deck(
        block("A", 4, (0, 0, 0), (1, 1, 1)), "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3\n",
        *cards, step("A-ZMAX, 1, 2\nA-ZMAX, 3, 3, -0.02", options=""), tolerance=1e-8,
    )


def corner():
    """A block in a corner of an angle a thousand times as stiff, two pairs."""
    low = [(x, y, z) for x in (-0.5, 0.0) for y in (0.0, 0.5, 1.0)
           for z in (-0.5, 0.0, 0.5, 1.0, 1.5)]
    low += [(x, y, z) for x in (0.5, 1.0, 1.5, 2.0) for y in (0.0, 0.5, 1.0) for z in (-0.5, 0.0)]
    number = {place: 1000 + i for i, place in enumerate(low)}
    cells = [(-0.5, y, z) for y in (0.0, 0.5) for z in (-0.5, 0.0, 0.5, 1.0)]
    cells += [(x, y, -0.5) for x in (0.0, 0.5, 1.0, 1.5) for y in (0.0, 0.5)]
    lines = ["*NODE", *(f"{n}, {x}, {y}, {z}" for (x, y, z), n in number.items())]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=L")
    for i, (x, y, z) in enumerate(cells):
        nodes = [number[x + 0.5 * a, y + 0.5 * b, z + 0.5 * c]
                 for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines.append(", ".join(map(str, [5001 + i, *nodes])))
    lines += ["*SURFACE, NAME=FL", *(f"{5001 + i}, S2" for i, c in enumerate(cells) if c[0] >= 0)]
    lines += ["*SURFACE, NAME=WA", *(f"{5001 + i}, S4" for i, c in enumerate(cells)
                                     if c[0] < 0 and c[2] >= 0)]
    lines += ["*NSET, NSET=LB", *(str(n) for place, n in number.items() if place[2] == -0.5)]
    lines += ["*MATERIAL, NAME=ML", "*ELASTIC", "1e6, 0.3", "*SOLID SECTION, ELSET=L, MATERIAL=ML"]
    return deck(
        block("A", 3, (0, 0, 0), (1, 1, 1)), "\n".join(lines) + "\n",
        "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3\n*CONTACT PAIR, INTERACTION=I\nA-ZMIN, FL\n"
        "*CONTACT PAIR, INTERACTION=I\nA-XMIN, WA\n",
        step("LB, 1, 3\nA-YMIN, 2, 2\nA-ZMAX, 3, 3, -.02\nA-XMAX, 1, 1, -.01", 2, ""),
        tolerance=1e-8,
    )


def wedge():
    """A wedge between two planes at 20 degrees with a coefficient of 10, pressed and let go."""
    number, lines = {}, ["*NODE"]
    for i in range(4):
        for j in range(3):
            for k in range(4):
                z = k / 3
                x = (2 * i / 3 - 1) * (0.5 + z * math.tan(math.radians(20)))
                number[i, j, k] = len(number) + 1
                lines.append(f"{number[i, j, k]}, {x!r}, {j / 2}, {z!r}")
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=B")
    cells = [(i, j, k) for i in range(3) for j in range(2) for k in range(3)]
    for n, (i, j, k) in enumerate(cells):
        nodes = [number[i + a, j + b, k + c]
                 for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines.append(", ".join(map(str, [n + 1, *nodes])))
    for name, axis, at, face in (("XMIN", 0, 0, "S6"), ("XMAX", 0, 2, "S4"), ("ZMAX", 2, 2, "S2")):
        lines += [f"*SURFACE, NAME=B-{name}",
                  *(f"{n + 1}, {face}" for n, c in enumerate(cells) if c[axis] == at)]
    lines += ["*NSET, NSET=B-YMIN", *(str(n) for (_, j, _), n in number.items() if j == 0)]
    lines += ["*MATERIAL, NAME=A", "*ELASTIC", "1000., 0.3", "*SOLID SECTION, ELSET=B, MATERIAL=A"]
    sine, cosine = math.sin(math.radians(20)), math.cos(math.radians(20))
    lines += ["*OBSTACLE, NAME=L, TYPE=PLANE", f"-.5, 0., 0., {cosine!r}, 0., {sine!r}",
              "*OBSTACLE, NAME=R, TYPE=PLANE", f".5, 0., 0., {-cosine!r}, 0., {sine!r}",
              "*SURFACE INTERACTION, NAME=I", "*FRICTION", "10.",
              "*CONTACT PAIR, INTERACTION=I", "B-XMIN, L",
              "*CONTACT PAIR, INTERACTION=I", "B-XMAX, R"]
    lines += ["*STEP", "*STATIC", "0.5, 1.0", "*BOUNDARY", "B-YMIN, 2", "*DSLOAD",
              "B-ZMAX, P, 10.", "*END STEP"]
    lines += ["*STEP", "*STATIC", f"{1 / 3!r}, 1.0", "*DSLOAD", "B-ZMAX, P, 0.", "*END STEP"]
    return "*HEADING\nA wedge that locks itself\n" + "\n".join(lines) + "\n"


def tower(n):
    """n blocks, one on the other, under their weight."""
    blocks = [
        f"*BLOCK, NAME=B{i}, NX=1, NY=1, NZ=1, TYPE=C3D8\n{(i % 3) / 100}, 0., {float(i)}, "
        f"1., 1., 1.\n*MATERIAL, NAME=M{i}\n*ELASTIC\n1000., 0.3\n*DENSITY\n1.\n"
        f"*SOLID SECTION, ELSET=B{i}, MATERIAL=M{i}\n" for i in range(n)
    ]
    pairs = ["B0-ZMIN, G", *(f"B{i}-ZMIN, B{i - 1}-ZMAX" for i in range(1, n))]
    loads = "".join(f"B{i}, GRAV, 1., 0., 0., -1.\n" for i in range(n))
    return (
        "*HEADING\nA tower of blocks\n" + "".join(blocks)
        + "*OBSTACLE, NAME=G, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
        + "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.5\n"
        + "".join(f"*CONTACT PAIR, INTERACTION=I\n{names}\n" for names in pairs)
        + f"*STEP\n*STATIC\n1., 1.\n*DLOAD\n{loads}*END STEP\n"
    )


def plates():
    """Two plates whose 5,041 nodes touch, in 6 increments."""
    return deck(
        block("LOW", (70, 70, 1), (0, 0, -0.1), (7, 7, 0.1)),
        block("HIGH", (70, 70, 1), (0, 0, 0), (7, 7, 0.1)), pair("HIGH-ZMIN, LOW-ZMAX", 0.3),
        step("HIGH-ZMAX, 3, 3, -0.002\nHIGH-ZMAX, 1, 1, 0.002\nHIGH-ZMAX, 2, 2, 0.", 6),
        held="LOW-ZMIN, 1, 3", tolerance=1e-8,
    )


def loose():
    """Three loose blocks on a plane, one on the other, under their weights."""
    sizes = ((12, 12, 8), (10, 10, 10), (8, 8, 10))
    low, cards = 0.0, []
    for i, n in enumerate(sizes):
        side, at = n[0] / 10, (1.2 - n[0] / 10) / 2
        cards.append(block(f"B{i}", n, (at, at, low), (side, side, n[2] / 10)))
        low += n[2] / 10
    loads = "".join(f"B{i}, GRAV, {k}., 0.1, 0., -1.\n" for i, k in enumerate((1, 1, 2)))
    return deck(
        "".join(cards).replace("*SOLID SECTION", "*DENSITY\n1.\n*SOLID SECTION"),
        "*OBSTACLE, NAME=G, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n", pair("B0-ZMIN, G", 0.3),
        pair("B1-ZMIN, B0-ZMAX", 0.3, number=2), pair("B2-ZMIN, B1-ZMAX", 0.3, number=3),
        f"*STEP\n*STATIC, DIRECT\n0.5, 1.\n*DLOAD\n{loads}*END STEP\n", tolerance=1e-8,
    )


def cycles():
    """The block pressed down, then pushed to and fro ten times."""
    text = (ROOT / "input" / "block.inp").read_text(encoding="utf-8")
    first, press, _ = re.split(r"(?=^\*STEP)", text, flags=re.MULTILINE)
    press = re.sub(r"<5/steps>", "1.", press)
    push = [step(f"BODY-ZMAX, 1, 1, {way}", 2) for way in (0.02, -0.02) * 10]
    return first + press + "".join(push)


def single(folder):
    """The paper's block with a factor in single precision."""
    return changed("block", (r"^\*STEP", "*PRECISION, FACTOR=SINGLE\n*STEP"))(folder)


ONE_INCREMENT = [(r"<5/steps>, 1\.0", "1., 1."), (r"^\*\* Sideways.*", "")]

SCENES = (
    Scene("the block beside a second body that it cannot meet",
          changed("block", (BEFORE_SOLVER, FAR + FAR_PAIR)), BLOCK,
          changed("block", (BEFORE_SOLVER, FAR)), None,
          "before: pairs out of reach have no normals that turn"),
    Scene("the block on an STL of two triangles", floor, BLOCK, of_input("block"), 0.55,
          "flat facets are a plane for as long as no node crosses their edge"),
    Scene("the round tool as 101,760 triangles", ball, {"n": 12}, of_input("tool"), 0.10,
          "in part: points that an iteration has looked at are not placed again", 1),
    Scene("the block pushed along a plane of symmetry", of_input("block"), BLOCK | {"theta": 0},
          None, 0.26, "asked for: `--symmetry`"),
    Scene("ten equal load cycles", given(cycles), {"n": 8, **AUTO}, None, None,
          "asked for: `--until-steady`"),
    Scene("estimates of load steps in one increment without friction",
          changed("block", *ONE_INCREMENT), BLOCK | {"mu": 0}, None, None,
          "nothing goes beside a run that does not remember its path"),
    Scene("three loose blocks", given(loose), {}, None, None,
          "half of the iterations, placed first where the increment before leads; the estimate of "
          "load steps follows the path", 3),
    Scene("mortar: `foundation`, n = 8, base = 12", of_input("foundation"), {"n": 8, "base": 12},
          None, None, "points of quadrature by the error that they leave", 3),
    Scene("two plates of 5,041 points", given(plates), {}, None, None,
          "placed first where the increment before leads; the estimate of load steps follows the "
          "path", 1),
    Scene("100 planes", given(lambda: planes(100)), {}, given(lambda: planes(10)), 1.0,
          "in part: blocks near a point are compared once", 3),
    Scene("a stiff corner", given(corner), {}, None, 0.3,
          "proximal steps that change nothing end in a last one with the least softening", 3),
    Scene("a wedge with mu = 10", given(wedge), {}, None, 0.5,
          "bodies that no load presses part where reactions vanish", 3),
    Scene("100 stacked blocks", given(lambda: tower(100)), {}, None, 3.0,
          "W by what few bodies share; places that move by rounding settle at once", 1),
    Scene("single precision: the block, n = 32", single, {"n": 32, **AUTO}, of_input("block"), None,
          "not done: see below", 1),
    Scene("small runs: the block, n = 4", of_input("block"), {"n": 4, **AUTO}, None, None,
          "increments of less than 0.2 s are counted together"),
)


def user_seconds(program, path, result, settings):
    """Run a deck; return the user time of the process, and what it ended with.

    A run that takes longer than LIMIT is stopped: its time is not known.
    """
    words = [str(word) for word in run_words(program, path, result, settings)]
    environment = with_threads()
    child = subprocess.Popen(
        words, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)),
    )
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime if child.returncode >= 0 else math.nan, child.returncode


def fields_of(path):
    """Return forces and displacements where a run ended, each over its largest component."""
    with Result(path) as result:
        found = [result.field("displacement", -1)]
        found += [one.force[-1] for one in result.pairs.values()]
    return found


def where_time_goes(path, taken, machine_limits):
    """Return the seconds of a run by phase, and the least that its matrix takes.

    That is the elimination at the rate of dense products, and its factor read twice for so many
    solutions as can share a reading. Phases are clocked by the wall: they are scaled to `taken`,
    the processor's seconds.
    """
    with Result(path) as result:
        row = row_of(result)
    rates = limits(machine_limits, 1)
    of_wall = taken / row["total"]
    return {phase: row[f"seconds_{phase}"] * of_wall for phase in PHASES} | {
        "total": taken,
        "floor": row["factor_flops"] / rates["dgemm"]
        + 2 * 8 * row["factor_entries"] * math.ceil(row["solutions"] / TOGETHER) / rates["read"],
    }


def difference(one, other):
    """Return the largest difference of results, relative to the largest force or displacement."""
    if len(one) != len(other):
        return math.inf
    worst = abs(one[0] - other[0]).max() / max(abs(other[0]).max(), 1e-300)
    largest = max((abs(force).max() for force in other[1:] if force.size), default=0.0)
    for first, second in zip(one[1:], other[1:], strict=True):
        if first.shape != second.shape:
            return math.inf
        if largest > 0 and first.size:
            worst = max(worst, abs(first - second).max() / largest)
    return worst


def measure(programs, scene, rounds, folder):
    """Run a scene on all its sides; return its row."""
    seconds = {side: [] for side in SIDES}
    results, status = {}, {}
    for number in range(min(rounds, scene.most)):
        order = SIDES if number % 2 == 0 else SIDES[::-1]
        for side in order:
            if side == "without" and scene.without is None:
                continue
            place = folder / side
            place.mkdir(exist_ok=True)
            path = (scene.without if side == "without" else scene.deck)(place)
            settings = scene.settings if path.parent != place or "*PARAMETER" in path.read_text(
                encoding="utf-8") else {}
            taken, ended = user_seconds(programs[side], path, place / "result.vtkhdf", settings)
            if ended not in (0, 2) and not (side == "before" and ended < 0):
                raise StudyError(f"{scene.name}, {side}: ended with status {ended}")
            seconds[side].append(taken)
            status[side] = ended
            results[side] = place / "result.vtkhdf"
    same = math.nan
    if status["before"] >= 0:
        same = difference(fields_of(results["after"]), fields_of(results["before"]))
    return {
        "scene": scene.name,
        **{side: statistics.median(seconds[side]) if seconds[side] else math.nan
           for side in SIDES},
        "ratio": statistics.median(
            after / before
            for before, after in zip(seconds["before"], seconds["after"], strict=True)
        ),
        "difference": same, "rounds": len(seconds["after"]), "status": status["after"],
        "load": os.getloadavg()[0], "machine": machine(),
        **where_time_goes(results["after"], seconds["after"][-1], programs["limits"]),
    }


def read_rows():
    """Return the rows that are kept, by scene."""
    if not RUNS.is_file():
        return {}
    with RUNS.open(encoding="utf-8", newline="") as file:
        return {
            row["scene"]: {
                name: text if name in ("scene", "machine") else float(text or "nan")
                for name, text in row.items()
            }
            for row in csv.DictReader(file)
        }


def keep_row(row):
    """Put a row in the place of that of its scene."""
    rows = read_rows() | {row["scene"]: row}
    with RUNS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for scene in SCENES:
            if scene.name in rows:
                writer.writerow({
                    name: value if isinstance(value, str) else f"{value:.4g}"
                    for name, value in rows[scene.name].items()
                })


def number(value):
    """Return seconds in words, `-` where there are none."""
    return "-" if value is None or math.isnan(value) else f"{value:.3g}"


def page(rows):
    """Return the page as Markdown."""
    lines = []
    for scene in SCENES:
        if scene.name not in rows:
            lines.append([scene.name, *"---", "-", number(scene.wanted), "-",
                          scene.done or "not done; not measured"])
            continue
        row = rows[scene.name]
        lines.append([
            scene.name,
            f"over {LIMIT}" if math.isnan(row["before"]) else number(row["before"]),
            number(row["after"]),
            "-" if math.isnan(row["ratio"]) else f"{row['ratio']:.2f}",
            number(row["without"]), number(scene.wanted),
            f"{row['difference']:.0e}" if row["difference"] > 0 else "-",
            scene.done or "not done",
        ])
    if not rows:
        raise StudyError("no scene has figures")
    loads = [row["load"] for row in rows.values()]
    machines = " and ".join(dict.fromkeys(row["machine"] for row in rows.values()))
    return "\n".join([
        "# What scenes require", "",
        "By `studies/run requires`: scenes of which a part takes time that nothing in them needs, "
        "or more",
        "than it must. Before: an older build; after: this one, in turns with it. Without: the "
        "same scene by",
        "simpler cards, which ask for nothing more (a plane for two triangles). Wanted: what was "
        "asked for.",
        "Seconds of user time of the processor with one thread, medians; ratios are of rounds. "
        "The last",
        "number is the largest difference of forces and displacements between the builds, over "
        "the largest;", "where there is none they are the same to the last bit.", "",
        f"{machines}; the load of its processors was {min(loads):.1f} to {max(loads):.1f}.", "",
        table(["scene", "before", "after", "ratio", "without", "wanted", "differs", "done"],
              lines), "",
        *EXPLANATION.splitlines(), "",
        *profile_lines(list(rows.values())),
    ]) + "\n"


def profile_lines(rows):
    """Return the lines on where the time of the longest runs goes."""
    names = [phase for phase in PHASES if any(row[phase] > 0 for row in rows)]
    longest = sorted((row for row in rows if not math.isnan(row["total"])),
                     key=lambda row: -row["total"])[:LONGEST]
    lines = [
        [row["scene"], number(row["total"]), number(row["floor"]),
         f"{row['total'] / row['floor']:.0f}", *(f"{row[name]:.2g}" for name in names),
         f"{max(0.0, row['total'] - sum(row[name] for name in PHASES)):.2g}"]
        for row in longest
    ]
    return [
        f"## Where the time of the {LONGEST} longest goes", "",
        "Seconds of the last run of this build. Floor: the operations of the elimination at the "
        "rate of dense",
        f"products, and the factor read twice for every {TOGETHER} solutions at the rate of "
        "memory, both as this", "machine did them right after. Other: the certificate, energies "
        "and all that no phase counts.", "",
        table(["scene", "total", "floor", "times", *names, "other"], lines), "",
        "What stands above the floor is geometry where little is to be solved: points are placed "
        "on faces in",
        "each iteration (`recover`), again for the estimate of load steps, and by the "
        "certificate's own code", "(`other`).",
    ]


EXPLANATION = """\
Where nothing was done, the ratio of two equal programs says how far figures scatter.

- **The block** has n = 14 and 50 increments where nothing else is said. Beside 100 planes stand 10
  as "without".
- **Two triangles.** On the plane itself results are the same to the last bit; what differs from
  before is what the tolerance of contact leaves. What is left of the time integrates over the
  facets where increments end, for the result and for the certificate.
- **Symmetry, cycles, stiff bodies.** They take as long as before where nothing asks for less:
  `--symmetry`, `--until-steady` and `--as-rigid`, of which `--plan` says what they would save.
- **A stiff corner.** Its edge nodes have a point of each pair, and Coulomb's law leaves open how
  these share a force: what differs is the shares. Displacements differ by 1e-7 of the largest, the
  sums of forces over the pairs by 1e-8.
- **A wedge.** At the end nothing presses in either build, and the body lies free: what differs is
  where, by 4e-9 of its size.
- **Pairs out of reach** were made faster before the older build.
- **Single precision** refines each increment by itself. Correcting the contact of 16 increments at
  once, from solutions with as many right-hand sides, was tried: three passes are needed where an
  increment by itself takes two, for it begins from the one before. At n = 32 that took 33.2 s for
  36.7, and 23.9 in double precision; so little is not worth 150 lines."""


def main():
    """Run what is asked for, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bipot", default=ROOT / "build" / "bipot", type=Path)
    parser.add_argument("--before", type=Path, help="an older build")
    parser.add_argument("--limits", type=Path,
                        default=ROOT / "build" / "studies" / "machine_limits")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default="", help="scenes whose name holds this")
    parser.add_argument("--page", action="store_true", help="run nothing")
    parser.add_argument("-o", dest="page_path", type=Path, default=PAGE)
    options = parser.parse_args()
    if not options.page:
        if options.before is None:
            parser.error("--before PROGRAM: what to compare with")
        after = options.bipot.resolve()
        programs = {"before": options.before.resolve(), "after": after, "without": after,
                    "limits": options.limits.resolve()}
        for scene in SCENES:
            if options.only not in scene.name:
                continue
            with tempfile.TemporaryDirectory() as folder:
                row = measure(programs, scene, options.rounds, Path(folder))
            keep_row(row)
            print("  ".join([f"{row[name]:.3g}" for name in (*SIDES, "ratio", "difference",
                                                              "status")] + [scene.name]),
                  flush=True)
    put_page(page(read_rows()), options.page_path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
