"""Make docs/studies/iteration.md: bodies solved for by iteration, how that grows, how far it goes.

    studies/run iteration [-n 16 24 32] [--steps 50] [--factor 32] [--take RESULT] [-o docs/studies]
    studies/run iteration --page

The paper's block by the automatic solver, one thread, with `TYPE=ITERATIVE`, and with a factor up
to the size `--factor`: processor time, memory, iterations, and by how much the reactions differ,
relative to the largest. Runs are kept in studies/data/iteration.csv, one of each size and number of
increments; --take adds one that was made otherwise, and --page runs nothing. Exponents are fitted
to what was run from 24 elements an edge on.

Wants build/mpi/bipot (scripts/run --iterative DECK builds it) for both.
"""

import argparse
import csv
import math
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bipot.program import ROOT, run_words, with_threads
from bipot.report import machine
from bipot.result import Result
from studies.pages import StudyError, claim, table
from studies.scaling import MACHINES, bytes_in_words, fit, size_in_words, time_in_words

RUNS = ROOT / "studies" / "data" / "iteration.csv"
PAGE = ROOT / "docs" / "studies" / "iteration.md"
CARD = "*BODY SOLVER, TYPE=ITERATIVE\n"
SETTINGS = {"solver": "AUTO", "local": "AUTO"}
PHASES = ("assemble", "factorise", "condense", "loads", "contact", "recover", "estimate", "write")
COLUMNS = (
    "n", "equations", "contact_points", "increments", "certified", "iterations", "of_contact",
    "newton", "cpu", "total", "memory", *(f"seconds_{name}" for name in PHASES), "factor_cpu",
    "factor_memory", "forces", "load", "machine",
)
FROM = 24  # elements along an edge, from where on laws are fitted
INDEX = 2**31 / 81  # equations whose entries PETSc's indices of Debian count, 81 in a row


def row_of(result):
    """Return what a result tells of its run."""
    found = result.counters
    return {
        "n": round(((found["equations"] / 3) ** (1 / 3)) - 2 / 3),
        "equations": found["equations"], "contact_points": found["contact_points"],
        "increments": found["increments"],
        "certified": int(result.history("certified").sum()),
        "iterations": found["body_iterations"], "of_contact": found["compliance_products"],
        "newton": found["contact_iterations"], "cpu": found["cpu_seconds"],
        "total": found["seconds_total"], "memory": found["peak_memory_bytes"],
        **{f"seconds_{name}": found[f"seconds_{name}"] for name in PHASES},
        "factor_cpu": math.nan, "factor_memory": math.nan, "forces": math.nan,
        "load": os.getloadavg()[0], "machine": machine(),
    }


def run(program, n, steps, card, folder):
    """Run the block; return its row and its reactions."""
    text = (ROOT / "input" / "block.inp").read_text(encoding="utf-8")
    deck, path = Path(folder) / "block.inp", Path(folder) / "block.vtkhdf"
    deck.write_text(re.sub(r"^\*STEP", card + "*STEP", text, count=1, flags=re.MULTILINE),
                    encoding="utf-8")
    command = run_words(program, deck, path, {"n": n, "steps": steps, **SETTINGS})
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=with_threads())
    if done.returncode != 0:
        raise StudyError(f"n = {n}: status {done.returncode}: {done.stderr}")
    with Result(path) as result:
        found = row_of(result), [pair.reaction[:] for pair in result.pairs.values()]
    path.unlink()
    return found


def measure(program, n, steps, with_factor):
    """Return the row of a size."""
    with tempfile.TemporaryDirectory() as folder:
        row, reactions = run(program, n, steps, CARD, folder)
        if with_factor:
            other, exact = run(program, n, steps, CARD.replace("ITERATIVE", "FACTOR"), folder)
            row |= {"factor_cpu": other["cpu"], "factor_memory": other["memory"]}
            row["forces"] = max(
                float(abs(a - b).max() / abs(b).max())
                for a, b in zip(reactions, exact, strict=True)
            )
    return row


def read_rows():
    """Return the rows that are kept, numbers as such."""
    if not RUNS.is_file():
        return []
    with RUNS.open(encoding="utf-8", newline="") as file:
        return [
            {name: text if name == "machine" else float(text) for name, text in row.items()}
            for row in csv.DictReader(file)
        ]


def keep_row(row):
    """Put a row in the place of one of its size and increments."""
    def kind(one):
        return -one["increments"], one["n"]

    rows = [other for other in read_rows() if kind(other) != kind(row)]
    rows = sorted([*rows, row], key=kind)
    with RUNS.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for one in rows:
            writer.writerow({
                name: one[name] if name == "machine" else f"{one[name]:.6g}" for name in COLUMNS
            })


def words(value, kind):
    """Say a number, or that there is none."""
    return "-" if math.isnan(value) else kind(value)


def processor(row, *phases):
    """Return the processor seconds of phases: of the run's, as much as of its time they took."""
    return sum(row[f"seconds_{name}"] for name in phases) / row["total"] * row["cpu"]


def rate(row):
    """Return the processor seconds of an iteration, over the equations."""
    seconds = processor(row, "condense", "loads", "contact", "estimate")
    return seconds / row["iterations"] / row["equations"]


def measured_table(rows):
    """Return the table of runs."""
    head = ["n", "equations", "contact points", "increments", "iterations each", "of contact alone",
            "Newton steps", "an iteration, an equation", "set-up", "processor time", "memory",
            "factor: time", "memory", "forces"]
    lines = [
        [
            f"{row['n']:.0f}", f"{row['equations']:,.0f}", f"{row['contact_points']:,.0f}",
            f"{row['increments']:.0f}",
            f"{row['iterations'] / row['increments']:.0f}",
            f"{row['of_contact'] / row['increments']:.0f}",
            f"{row['newton'] / row['increments']:.1f}", f"{1e6 * rate(row):.2f} us",
            time_in_words(processor(row, "factorise")), time_in_words(row["cpu"]),
            bytes_in_words(row["memory"]), words(row["factor_cpu"], time_in_words),
            words(row["factor_memory"], bytes_in_words), words(row["forces"], "{:.0e}".format),
        ]
        for row in rows
    ]
    return table(head, lines)


def by_increments(rows):
    """Return the runs with the most increments, and all others."""
    most = max((row["increments"] for row in rows), default=0)
    return ([row for row in rows if row["increments"] == most],
            [row for row in rows if row["increments"] != most])


def plain(exponent):
    """An exponent to two places; what rounds to nothing has no sign."""
    return f"{round(exponent, 2) + 0.0:.2f}"


def law_of_longer(rows):
    """Return the lines on runs whose increments are longer: how these grow by themselves."""
    if len(rows) < 3 or len({row["increments"] for row in rows}) > 1:
        return []
    iterations = fit(rows, lambda row: row["iterations"] / row["increments"])
    seconds = fit(rows, lambda row: row["cpu"] / row["increments"])
    sizes = sorted(row["n"] for row in rows)
    return [
        f"In {rows[0]['increments']:.0f} increments (n = {sizes[0]:.0f} to {sizes[-1]:.0f}) "
        f"iterations grow as N^{plain(iterations.exponent)}, seconds as "
        f"N^{plain(seconds.exponent)} (off by at most {seconds.off:.0%}).",
    ]


def page(rows):
    """Return the lines of the page."""
    fitted = [row for row in rows if row["n"] >= FROM]
    # Longer increments take more iterations each.
    alike, longer = by_increments(fitted)
    if len(alike) < 3:
        raise StudyError(f"three sizes from n = {FROM} on are needed")
    memory = fit(fitted, lambda row: row["memory"])
    an_increment = fit(alike, lambda row: row["cpu"] / row["increments"])
    iterations = fit(alike, lambda row: row["iterations"] / row["increments"])
    set_up = fit(fitted, lambda row: processor(row, "factorise"))
    head = ["equations", "iterations an increment", "set-up", "an increment", "memory"]
    foretold = table(head, [
        [size_in_words(size), f"{iterations(size):.0f}", time_in_words(set_up(size)),
         time_in_words(an_increment(size)), bytes_in_words(memory(size))]
        for size in (1e6, 1e7, 1e8, 1e9)
    ])
    loads = [row["load"] for row in rows]
    machines = " and ".join(dict.fromkeys(row["machine"] for row in rows))
    certified = all(row["certified"] == row["increments"] for row in rows)
    return [
        "# Bodies by iteration", "",
        "By `studies/run iteration`: the paper's block with n elements along an edge,",
        "[`*BODY SOLVER, TYPE=ITERATIVE`](../deck/solvers.md#body-solver) and the automatic solver,"
        " one thread,",
        f"{machines}; the load of its two processors was {min(loads):.1f} to {max(loads):.1f}, and "
        "what else runs there only adds to",
        "times. Iterations are those of all solutions, of the estimated errors too; seconds are "
        "of the",
        "processor. Beside them a factor, in what precision the plan takes, and by how much the",
        "reactions differ, relative to the largest.", "",
        claim(certified, "Every increment of every run is certified."), "",
        measured_table(rows), "",
        "## How it grows", "",
        f"Laws fitted to n >= {FROM} (iterations and seconds of an increment to the runs of "
        f"{alike[0]['increments']:.0f} increments),",
        "of the number of equations N: iterations an increment as "
        f"N^{plain(iterations.exponent)},",
        f"seconds an increment as N^{plain(an_increment.exponent)} (off by at most "
        f"{an_increment.off:.0%}), the set-up of the levels as "
        f"N^{plain(set_up.exponent)}, memory as",
        f"N^{plain(memory.exponent)}.",
        *law_of_longer(longer), "One processor of this kind:", "",
        foretold, "",
        "## What breaks first", "",
        claim(memory.reaches(MACHINES[0][1]) > max(row["equations"] for row in rows),
              f"**Memory** ends this machine (24 GB) at {size_in_words(memory.reaches(24e9))} "
              f"equations, a node with 1 TB at {size_in_words(memory.reaches(1e12))}: it is the "
              "matrix as it is summed up and as PETSc coarsens it, side by side for a moment."),
        "",
        claim(memory.reaches(1e12) > INDEX,
              f"**Indices** come before such a node is full: PETSc as Debian has it counts the "
              f"entries of a matrix in 32 bits, {size_in_words(INDEX)} equations on one rank, and "
              "[more ranks](../parallel.md#bodies-by-iteration) have fewer each; a deck has at "
              "most 20 million nodes."),
        "",
        claim(memory(1e9) > 1e12,
              f"**Time**: at 10^7 equations an increment takes {time_in_words(an_increment(1e7))} "
              "of one processor; [what two save](../parallel.md#bodies-by-iteration) was measured. "
              f"10^9 equations take {time_in_words(an_increment(1e9))} of one processor, and "
              f"{bytes_in_words(memory(1e9))}: no single node reads such a mesh."),
    ]


def main():
    """Run what is asked for, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bipot", default=ROOT / "build" / "mpi" / "bipot", type=Path)
    parser.add_argument("-n", nargs="*", type=int, default=[16, 24, 32])
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--factor", type=int, default=32)
    parser.add_argument("--take", type=Path, nargs="*", default=[])
    parser.add_argument("--page", action="store_true")
    parser.add_argument("-o", dest="page_path", type=Path, default=PAGE)
    options = parser.parse_args()
    for path in options.take:
        with Result(path) as result:
            keep_row(row_of(result))
    if not options.page:
        for n in options.n:
            print(f"n = {n}", file=sys.stderr)
            keep_row(measure(options.bipot, n, options.steps, n <= options.factor))
    options.page_path.write_text("\n".join(page(read_rows())) + "\n", encoding="utf-8")


if __name__ == "__main__":
    np.seterr(all="raise")
    main()
