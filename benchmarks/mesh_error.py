#!/usr/bin/python3
"""How far the estimated error of the mesh is from the true one.

    benchmarks/mesh_error.py [-o docs/mesh-error.md]

The estimate is /history/error/mesh at the end of each *STEP; the truth is taken from finer meshes:
their limit by Richardson's extrapolation where their errors fall regularly, else the finest of
them. Effectivity is estimate over truth.
"""

import argparse
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[1]


@dataclass
class Case:
    """A deck, the meshes whose estimate is judged, and those the truth is taken from."""

    deck: str
    quantity: str
    meshes: tuple
    truth: tuple
    settings: dict


CASES = (
    Case("block", "resultant", (2, 4, 8, 16), (8, 16, 24), {"solver": "AUTO", "local": "AUTO"}),
    Case("tool", "resultant", (6, 12, 18), (30,), {}),
    Case("ssnv128", "strain energy", (8, 16, 32), (64,), {"thickness": 0.005}),
)


def run(program, case, n, folder):
    """Return, at the ends of the steps, the estimates and the quantity: (steps,), (steps, k)."""
    result = Path(folder) / f"{case.deck}.vtkhdf"
    command = [program, ROOT / "input" / f"{case.deck}.inp", "-o", result, "--quiet"]
    for name, value in {**case.settings, "n": n}.items():
        command += ["--set", f"{name}={value}"]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    with h5py.File(result) as file:
        step = file["history/step"][:]
        ends = np.flatnonzero(np.append(step[1:] != step[:-1], True))
        if case.quantity == "strain energy":
            values = file["history/energy/strain"][:][ends, None]
        else:
            values = np.hstack([pair["resultant"][:][ends] for pair in file["contact"].values()])
        return file["history/error/mesh"][:][ends], values


def limit(meshes, values):
    """Return the limit of values on three meshes, v + c n^-p, p of the largest component."""
    first, second, third = values
    largest = np.argmax(abs(third))
    ratio = (first[largest] - second[largest]) / (second[largest] - third[largest])
    low, high = 0.1, 8.0
    for _ in range(60):
        order = 0.5 * (low + high)
        powers = [n**-order for n in meshes]
        found = (powers[0] - powers[1]) / (powers[1] - powers[2])
        low, high = (order, high) if found < ratio else (low, order)
    return third + (third - second) * powers[2] / (powers[1] - powers[2])


def rows(program):
    """Yield a table row a case, mesh and step."""
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            known = {n: run(program, case, n, folder) for n in sorted({*case.meshes, *case.truth})}
            for step in range(len(known[case.truth[0]][0])):
                true = [known[n][1][step] for n in case.truth]
                true = limit(case.truth, true) if len(true) == 3 else true[0]
                for n in case.meshes:
                    estimate, values = known[n][0][step], known[n][1][step]
                    error = abs(values - true).max() / abs(true).max()
                    yield case, n, step + 1, estimate, error


def page(program):
    """The page as Markdown."""
    lines = [
        "# How good the estimate of the mesh's error is",
        "",
        "By `benchmarks/mesh_error.py`: the estimate of [theory](theory.md), section 10, at the",
        "end of each `*STEP`, and the true error of the largest contact resultant or of the strain",
        "energy. True is, of the block, the limit of n = 8, 16, 24 (Richardson); of the others a",
        "finer mesh: n = 30 of the tool, 64 of the plate. Effectivity is estimate over truth.",
        "",
        "| deck | quantity | n | step | estimate | true | effectivity |",
        "|---|---|---|---|---|---|---|",
    ]
    within = total = 0
    for case, n, step, estimate, error in rows(program):
        ratio = estimate / error
        total += 1
        within += 1 / 3 <= ratio <= 3
        lines.append(
            f"| {case.deck} | {case.quantity} | {n} | {step} | {estimate:.2g} | {error:.2g} "
            f"| {ratio:.2g} |"
        )
    lines += ["", f"Between 1/3 and 3: {within} of {total}.", ""]
    return "\n".join(lines)


def main():
    """Print the page, or write it to a file."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot")
    parser.add_argument("-o", type=Path, help="write the page here")
    options = parser.parse_args()
    text = page(options.bipot.resolve())
    if options.o:
        options.o.write_text(text, encoding="utf-8")
    else:
        print(text)


if __name__ == "__main__":
    main()
