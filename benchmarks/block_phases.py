#!/usr/bin/python3
"""Time and memory of the paper's block by phase, against a bare factorisation in the same run.

    benchmarks/block_phases.py [-o docs/speed.md] [-n 8 16 24]

Each mesh is run three times with one BLAS thread; the table holds medians. Machines are shared and
differ: the column to compare is the ratio of a whole run to assembling, ordering, factorising and
condensing, which any program has to do once.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parents[1]
PHASES = (
    "read", "assemble", "order", "factorise", "condense", "loads", "contact", "recover", "write",
)
SOLVERS = (("AUTO", "AUTO"), ("SWEEPS", "NEWTON"))
REPEATS = 3
LARGEST_SWEPT = 16  # the paper's sweeps take minutes above


def run(program, n, solver, local, folder):
    """One run of the block; return its counters and the worst certificate entry."""
    result = Path(folder) / "block.vtkhdf"
    settings = {"n": n, "tolerance": 1e-9, "solver": solver, "local": local}
    command = [program, ROOT / "input" / "block.inp", "-o", result, "--quiet"]
    for name, value in settings.items():
        command += ["--set", f"{name}={value}"]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    with h5py.File(result) as file:
        table = file["run/counters"]
        names = [name.decode() for name in table.attrs["name"]]
        counters = dict(zip(names, table[()], strict=True))
        counters["worst"] = max(entry[()].max() for entry in file["history/certificate"].values())
    return counters


def rows(program, meshes):
    """One table row a mesh and solver: medians over the repeats."""
    with tempfile.TemporaryDirectory() as folder:
        for n in meshes:
            for solver, local in SOLVERS:
                if solver == "SWEEPS" and n > LARGEST_SWEPT:
                    continue
                print(f"n = {n}, {solver}", file=sys.stderr)
                runs = [run(program, n, solver, local, folder) for _ in range(REPEATS)]
                yield n, solver, {
                    name: statistics.median(one[name] for one in runs) for name in runs[0]
                }


def table(program, meshes):
    """The page as Markdown."""
    lines = [
        "# Time and memory of the block by phase",
        "",
        "By `benchmarks/block_phases.py`: 50 increments, tolerance 1e-9, one BLAS thread,",
        f"medians of {REPEATS} runs, seconds. The ratio is the whole run over what any program",
        "does once: assemble + order + factorise + condense.",
        "",
        f"| n | solver | equations | {' | '.join(PHASES)} | total | ratio | MB | worst error |",
        "|" + "---|" * (len(PHASES) + 7),
    ]
    for n, solver, counters in rows(program, meshes):
        times = [counters[f"seconds_{phase}"] for phase in PHASES]
        once = sum(times[1:5])
        cells = [str(n), solver, f"{counters['equations']:.0f}"]
        cells += [f"{time:.2g}" for time in times]
        cells += [f"{counters['seconds_total']:.3g}", f"{counters['seconds_total'] / once:.1f}"]
        cells += [f"{counters['peak_memory_bytes'] / 1e6:.0f}", f"{counters['worst']:.1e}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main():
    """Run and print, or write to a file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot")
    parser.add_argument("-n", type=int, nargs="+", default=[8, 16, 24])
    parser.add_argument("-o", type=Path, help="write the page here")
    options = parser.parse_args()
    text = table(options.bipot.resolve(), options.n)
    if options.o:
        options.o.write_text(text, encoding="utf-8")
    else:
        print(text)


if __name__ == "__main__":
    main()
