"""What leaving out saves: the same scene with and without what it does not require.

    studies/run savings [-o docs/studies/savings.md] [--rounds 3]

Needs the program and build/studies/bare_factorisation (cmake -DBIPOT_BENCHMARKS=ON). In every
round both sides of each comparison run, the first one in turns, with one BLAS thread; ratios are
medians over the rounds, of processor time and of the peak of memory. Status 1 when two sides that
should agree differ by more than 1e-10, when a run without contact takes more than 1.3 times as long
as METIS and MUMPS alone, or when a side did not leave out what it should have. A round takes some
three minutes; where others work the times scatter, and ratios less.
"""

import resource
import statistics
import subprocess
import sys
import tempfile
from collections import namedtuple
from pathlib import Path

import numpy as np

from bipot.program import ROOT, run_words, with_threads
from bipot.result import Result
from studies.pages import page_options, put_page

SAME = 1e-10  # differences of forces and displacements, relative to the largest
MOST_OF_BARE = 1.3  # a run without contact, over METIS and MUMPS alone
COUNTERS = (
    "interface_equations",
    "contact_points",
    "contact_rows",
    "solutions",
    "element_stiffnesses",
    "factor_entries",
)

BLOCK = ROOT / "input" / "block.inp"
BLOCK_SETTINGS = {"n": 24, "solver": "AUTO", "local": "AUTO", "tolerance": 1e-11}

FREE = """*HEADING
A block of steel between plates, displacement alone
*BLOCK, NAME=BODY, NX=24, NY=24, NZ=24
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
BODY-ZMIN, 1, 3
BODY-ZMAX, 3, 3, -0.1
*NODE FILE
U
*END STEP
"""

# Neither the sphere nor the plate goes further than 0.1, so nodes with a gap of at most 0.1 before
# the sphere's last place can touch: those within 7.7 of the middle, a twentieth of the face.
PLATE = """*HEADING
A sphere is pressed into the lower face of a plate that lies against a rigid one
*NODE
100001, 0., 0., -150.
*BLOCK, NAME=PLATE, NX=60, NY=60, NZ=3
-30., -30., 0.,  60., 60., 3.
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SOLID SECTION, ELSET=PLATE, MATERIAL=STEEL
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=100001
0., 0., -150.,  150.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=DRY
PLATE-ZMIN, BALL
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP
*STATIC, DIRECT
0.1, 1.
*BOUNDARY
PLATE-ZMAX, 1, 3
100001, 1, 2
100001, 3, 3, 0.1
*NODE FILE
U
{load}*END STEP
"""
# A force so small that it does nothing. But how far a body under forces goes is not known before,
# so every slave node is a candidate.
NO_FORCE = "*CLOAD\n100002, 1, 1e-290\n"

# A run of the program (deck: a path or a text), and METIS and MUMPS alone on such a deck.
Side = namedtuple("Side", "name deck settings is_bare", defaults=({}, False))
# What the sides cost, `more` over `less`. `same`: whether their results should be.
Comparison = namedtuple("Comparison", "name more less same")
Measured = namedtuple("Measured", "seconds memory counters forces displacement")


def block(mu, name):
    """The paper's block with a coefficient of friction."""
    return Side(f"mu = {mu:g}, {name}", BLOCK, {**BLOCK_SETTINGS, "mu": mu})


SMOOTH = block(0, "normals alone")
COMPARISONS = (
    Comparison("block, n = 24: with friction / without", block(0.3, "friction"), SMOOTH, False),
    Comparison(
        "block, n = 24: without, all rows kept / normals alone",
        block(1e-16, "all rows kept"), SMOOTH, True,
    ),
    Comparison(
        "plate before a sphere: whole face / what can touch",
        Side("whole face in the interface", PLATE.format(load=NO_FORCE)),
        Side("what can touch", PLATE.format(load="")), True,
    ),
    Comparison(
        "no contact, n = 24, one increment: whole run / METIS and MUMPS alone",
        Side("whole run", FREE), Side("METIS and MUMPS alone", FREE, is_bare=True), True,
    ),
)


def call(command):
    """Run a command; return what it prints and the seconds of processor time it takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, check=True, stdout=subprocess.PIPE, text=True, env=with_threads()
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, sum(
        getattr(after, kind) - getattr(before, kind) for kind in ("ru_utime", "ru_stime")
    )


def measure(programs, side, folder):
    """Run one side: what it takes (a whole process, or its timed part), and its results."""
    deck = side.deck
    if not isinstance(deck, Path):
        deck = Path(folder) / "deck.inp"
        deck.write_text(side.deck, encoding="utf-8")
    if side.is_bare:
        return measure_bare(programs[1], deck, folder)
    path = Path(folder) / "result.vtkhdf"
    _, seconds = call(run_words(programs[0], deck, path, side.settings))
    with Result(path) as result:
        forces = [pair.force for pair in result.pairs.values()]
        return Measured(
            seconds,
            result.counters["peak_memory_bytes"],
            result.counters,
            np.concatenate(forces, axis=1) if forces else None,
            result.field("displacement", -1),
        )


def measure_bare(program, deck, folder):
    """METIS and MUMPS alone: their own time, without reading and assembling."""
    path = Path(folder) / "displacements"
    output, _ = call([program, deck, path])
    values = {name: float(value) for name, value in map(str.split, output.splitlines())}
    return Measured(
        values["cpu_seconds"],
        values["peak_memory_bytes"],
        values,
        None,
        np.fromfile(path).reshape(-1, 3),
    )


def difference(one, other):
    """The largest difference of contact forces and displacements, relative to the largest."""
    worst = 0.0
    for name in ("forces", "displacement"):
        first, second = getattr(one, name), getattr(other, name)
        if first is not None and second is not None:
            worst = max(worst, abs(first - second).max() / abs(second).max())
    return worst


def run_rounds(programs, rounds, comparisons):
    """All rounds: runs[comparison][side] is a list over the rounds, and the largest differences.

    A side that two comparisons share runs for each of them, right beside its partner.
    """
    runs = [([], []) for _ in comparisons]
    differences = [0.0] * len(comparisons)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(rounds):
            for i, comparison in enumerate(comparisons):
                found = {}
                for k in (0, 1) if number % 2 == 0 else (1, 0):
                    side = (comparison.more, comparison.less)[k]
                    print(f"round {number + 1}: {comparison.name}: {side.name}", file=sys.stderr)
                    found[k] = measure(programs, side, folder)
                if comparison.same:
                    differences[i] = max(differences[i], difference(found[0], found[1]))
                for k in (0, 1):
                    # The fields are large and not needed any more.
                    runs[i][k].append(found[k]._replace(forces=None, displacement=None))
    return runs, differences


def ratio(sides, quantity):
    """Median over the rounds of one side over the other."""
    return statistics.median(
        getattr(more, quantity) / getattr(less, quantity)
        for more, less in zip(*sides, strict=True)
    )


def faults(comparisons, runs, differences):
    """What is not as it should be, a sentence each."""
    for comparison, sides, found in zip(comparisons, runs, differences, strict=True):
        if found > SAME:
            yield f"{comparison.name}: results differ by {found:.1e}, allowed {SAME:g}"
        more, less = (side[0].counters for side in sides)
        for counters in (more, less):
            if counters.get("plan_revisions", 0) > 0:
                yield f"{comparison.name}: a run took the whole of the slave surfaces after all"
        if comparison.less.is_bare:
            if ratio(sides, "seconds") > MOST_OF_BARE:
                yield f"{comparison.name}: more than {MOST_OF_BARE} times as long"
            if more["factor_entries"] != less["factor_entries"]:
                yield f"{comparison.name}: the factors are not of one matrix and order"
        elif not less["interface_equations"] < more["interface_equations"]:
            yield f"{comparison.name}: nothing was left out"


def page(comparisons, runs, differences, rounds):
    """The page as Markdown."""
    lines = [
        "# What is left out, and what it saves",
        "",
        "By `studies/run savings`: one BLAS thread, processor time, medians over",
        f"{rounds} rounds in which both sides ran one after the other. Same to: the largest",
        "difference of contact forces and of displacements, relative to the largest of them. With",
        "friction and without are two problems.",
        "",
        "| what over what | time | memory | same to |",
        "|" + "---|" * 4,
    ]
    for comparison, sides, found in zip(comparisons, runs, differences, strict=True):
        lines.append(
            f"| {comparison.name} | {ratio(sides, 'seconds'):.2f} | {ratio(sides, 'memory'):.2f} | "
            + (f"{found:.0e} |" if found > 0 else "the last bit |" if comparison.same else "- |")
        )
    lines += [
        "",
        "What each side did:",
        "",
        "| run | time, s | memory, MB | "
        + " | ".join(name.replace("_", " ") for name in COUNTERS) + " |",
        "|" + "---|" * (3 + len(COUNTERS)),
    ]
    listed = set()
    for comparison, sides in zip(comparisons, runs, strict=True):
        scene = comparison.name.split(":")[0]
        for side, measured in zip((comparison.more, comparison.less), sides, strict=True):
            if (scene, side.name) in listed:
                continue
            listed.add((scene, side.name))
            seconds = statistics.median(one.seconds for one in measured)
            memory = statistics.median(one.memory for one in measured)
            counters = measured[0].counters
            cells = [f"{scene}: {side.name}", f"{seconds:.3g}", f"{memory / 1e6:.0f}"]
            cells += [f"{counters[name]:.0f}" if name in counters else "-" for name in COUNTERS]
            lines.append("| " + " | ".join(cells) + " |")
    lines += ["", *EXPLANATION.splitlines()]
    return "\n".join(lines) + "\n"


EXPLANATION = """\
- **Friction.** Without it only the normal displacements of the face are condensed to, a third of
  the rows with friction. All rows kept is the same problem with a coefficient of 1e-16.
- **Plate.** 60 x 60 x 3 elements, the upper face held, a rigid sphere of radius 150 pressed by 0.1
  into the lower one, 10 increments. The plan knows how far sphere and plate go, and takes a
  twentieth of the nodes into the interface; a force of 1e-290 on a node, which does nothing, takes
  that knowledge away.
- **No contact.** The whole process, from reading the deck to the closed result file, against what
  `studies/programs/bare_factorisation.f90` spends in METIS, and in MUMPS as it comes, on the same
  matrix in the same order: 1.3 times is the most that is allowed. Memory is that of both processes.
- Elements share a stiffness where they are congruent to the rounding of coordinates."""


def main():
    """Run and print, or write to a file."""
    parser = page_options(__doc__)
    parser.add_argument(
        "--bare", type=Path, default=ROOT / "build" / "studies" / "bare_factorisation"
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", help="comparisons whose name holds this word")
    options = parser.parse_args()
    programs = [options.bipot.resolve(), options.bare.resolve()]
    for program in programs:
        if not program.is_file():
            parser.error(f"{program} is not there: build with -DBIPOT_BENCHMARKS=ON")
    if options.rounds < 1:
        parser.error(f"--rounds {options.rounds}: one round at least")
    comparisons = [one for one in COMPARISONS if (options.only or "") in one.name]
    if not comparisons:
        parser.error(f"--only {options.only}: no comparison has this in its name")
    runs, differences = run_rounds(programs, options.rounds, comparisons)
    text = page(comparisons, runs, differences, options.rounds)
    put_page(text, options.page)
    found = list(faults(comparisons, runs, differences))
    for fault in found:
        print(fault, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
