"""Time of the paper's block on several ranks, beside the program for one process.

    studies/run parallel [-n 16 24 32] [--ranks 1 2] [--steps 10] [--repeats 3] [-o TABLE.md]

The block by the automatic solver, one BLAS thread a rank. The programs take turns, and each phase
is the best of the repeats: what else the machine does only adds to it. Processor time and memory
are sums over the ranks, of the repeat that took least of each. The last column compares the forces
with those of one process, relative to the largest.

Wants build/bipot and build/mpi/bipot (scripts/run --mpi 1 DECK builds the latter), and as many
processors as ranks that nobody else uses: ranks wait for each other, so one that is held up
holds up all. The load of the machine is printed, so that a busy one is not taken for a slow one.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bipot.program import ROOT, run_words, with_threads
from bipot.report import table
from bipot.result import Result
from studies.pages import page_options, put_page

ALONE = "-"
PHASES = ("assemble", "factorise", "condense", "solve", "contact", "total")
HEAD = [
    "n", "equations", "ranks", *PHASES, "factorise, times faster", "CPU", "memory", "forces",
]


def command_of(ranks, options):
    """What starts the program."""
    if ranks == ALONE:
        return [options.bipot]
    launcher = [options.mpirun, "-n", str(ranks)]
    return [*launcher, "--oversubscribe", "--bind-to", "none", options.bipot_mpi]


def run(n, ranks, options, folder):
    """One run: seconds of its phases, processor time, memory, and every reaction."""
    result = Path(folder) / "block.vtkhdf"
    settings = {"n": n, "steps": options.steps, "tolerance": 1e-11, "solver": "AUTO",
                "local": "AUTO"}
    *launcher, program = command_of(ranks, options)
    deck = ROOT / "input" / "block.inp"
    command = [*launcher, *run_words(program, deck, result, settings)]
    environment = with_threads()
    if os.geteuid() == 0:  # Open MPI starts nothing as root unless it is told twice.
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    with Result(result) as file:
        counters = file.counters
        reactions = [pair.reaction[:] for pair in file.pairs.values()]
    seconds = {name: counters.get(f"seconds_{name}") for name in PHASES}
    # Solutions with the factor are most of these two.
    seconds["solve"] = counters["seconds_loads"] + counters["seconds_recover"]
    return {
        **seconds, "equations": counters["equations"], "cpu": counters["cpu_seconds"],
        "memory": counters["peak_memory_bytes"], "reactions": reactions,
    }


def measure(n, options):
    """The best of every kind of run: ranks, numbers."""
    best = {}
    with tempfile.TemporaryDirectory() as folder:
        for repeat in range(options.repeats):
            for ranks in (ALONE, *options.ranks):
                load = os.getloadavg()[0]
                print(f"n = {n}, ranks {ranks}, run {repeat + 1}, load {load:.1f}", file=sys.stderr)
                found = run(n, ranks, options, folder)
                known = best.setdefault(ranks, found)
                for name in (*PHASES, "cpu", "memory"):
                    known[name] = min(known[name], found[name])
    return best


def difference(found, expected):
    """The largest difference of reactions, relative to the largest of them."""
    largest = max(np.abs(reaction).max() for reaction in expected)
    pairs = zip(found, expected, strict=True)
    return max(np.abs(one - other).max() for one, other in pairs) / largest


def rows(n, options):
    """The lines of one mesh."""
    best = measure(n, options)
    alone = best[ALONE]
    for ranks, found in best.items():
        same = ALONE
        if ranks != ALONE:
            same = f"{difference(found['reactions'], alone['reactions']):.0e}"
        yield [
            str(n), f"{found['equations']:.0f}", str(ranks),
            *(f"{found[phase]:.3g} s" for phase in PHASES),
            f"{alone['factorise'] / found['factorise']:.2f}",
            f"{found['cpu']:.3g} s", f"{found['memory'] / 1e6:.0f} MB",
            same,
        ]


def main():
    """Measure and print, or write to a file."""
    parser = page_options(__doc__)
    parser.add_argument("--bipot-mpi", type=Path, default=ROOT / "build" / "mpi" / "bipot",
                        help="the program for several ranks")
    parser.add_argument("--mpirun", default="mpirun")
    parser.add_argument("-n", type=int, nargs="+", default=[16, 24, 32])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    lines = table(HEAD, [row for n in options.n for row in rows(n, options)])
    put_page("\n".join(lines) + "\n", options.page)


if __name__ == "__main__":
    main()
