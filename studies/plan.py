"""What the plan foresees beside what the run takes: memory, processor time, result file.

    studies/run plan [--largest 32]

Every deck is run with one BLAS thread, three times where a run takes seconds; ratios are medians of
estimate over measurement, so 1 is exact. Memory should be within 25 %, time within a factor of 2;
status 1 when one of them is not. On a machine where others work the times scatter.
"""

import statistics
import sys
import tempfile
from pathlib import Path

from bipot.program import ROOT, run_deck
from bipot.result import Result
from studies.pages import page_options, put_page

AUTO = {"solver": "AUTO", "local": "AUTO"}
DECKS = ("hertz", "mindlin", "tool", "rest")
MEMORY, TIME = 1.25, 2.0


def cases(largest):
    """Name, deck and parameters of every run."""
    block = ROOT / "input" / "block.inp"
    for n in (4, 8, 16, 24, 32):
        if n > largest:
            break
        for mu in (0.3, 0.0):
            yield f"block, n = {n}, mu = {mu:g}", block, {"n": n, "mu": mu, **AUTO}
    for n in (8, 16):
        yield f"block, n = {n}, sweeps", block, {"n": n}
    for deck in DECKS:
        yield deck, ROOT / "input" / f"{deck}.inp", {}
    yield "Gmsh's elements", ROOT / "tests" / "deck" / "odd" / "gmsh_hexahedra.inp", {}


def run(program, deck, settings, folder):
    """One run: estimates and counters, and the size of the file as it is at the end."""
    path = Path(folder) / "result.vtkhdf"
    run_deck(program, deck, path, settings)
    with Result(path) as result:
        return result.estimates, result.counters | {"file_bytes": path.stat().st_size}


def rows(program, largest):
    """One case after the other: its name and the medians of its quantities."""
    with tempfile.TemporaryDirectory() as folder:
        for name, deck, settings in cases(largest):
            print(name, file=sys.stderr)
            runs = [run(program, deck, settings, folder)]
            while len(runs) < 3 and runs[0][1]["cpu_seconds"] < 20:
                runs.append(run(program, deck, settings, folder))
            yield name, {
                quantity: tuple(
                    statistics.median(one[side][key] for one in runs)
                    for side, key in enumerate(keys)
                )
                for quantity, keys in (
                    ("memory", ("peak_memory_bytes", "peak_memory_bytes")),
                    ("time", ("cpu_seconds", "cpu_seconds")),
                    ("file", ("likely_file_bytes", "file_bytes")),
                    ("solutions", ("solutions", "solutions")),
                    ("products", ("compliance_products", "compliance_products")),
                )
            }


def table(program, largest):
    """The page as Markdown, and the cases that are further off than they should be."""
    lines = [
        "# What the plan foresees, and what the run takes",
        "",
        "By `studies/run plan`: estimate / measured, one BLAS thread, medians of 3",
        "runs (of 1 where a run takes more than 20 s). Memory is the peak of the process, time",
        "that of the processor.",
        "",
        "| run | memory, MB | ratio | time, s | ratio | file, MB | ratio | solutions | products |",
        "|" + "---|" * 9,
    ]
    off = []
    for name, found in rows(program, largest):
        cells = [name]
        for quantity, unit, digits in (("memory", 1e6, 4), ("time", 1, 2), ("file", 1e6, 3)):
            estimate, measured = (value / unit for value in found[quantity])
            ratio = estimate / measured
            cells += [f"{estimate:.{digits}g} / {measured:.{digits}g}", f"{ratio:.2f}"]
            limit = {"memory": MEMORY, "time": TIME}.get(quantity)
            if limit and not 1 / limit <= ratio <= limit:
                off.append(f"{name}: {quantity}")
        cells += [
            f"{found[quantity][0]:.0f} / {found[quantity][1]:.0f}"
            for quantity in ("solutions", "products")
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n", off


def main():
    """Run and print, or write to a file."""
    parser = page_options(__doc__)
    parser.add_argument("--largest", type=int, default=32, help="largest n of the block")
    options = parser.parse_args()
    text, off = table(options.bipot.resolve(), options.largest)
    put_page(text, options.page)
    for case in off:
        print(f"further off than it should be: {case}", file=sys.stderr)
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main())
