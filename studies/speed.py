"""Time and memory of the paper's block by phase, beside what the machine can do.

    studies/run speed [-n 8,16,24,32,40] [--threads 1,2] [--repeat 3] [--steps 50]
    studies/run speed -n 48,64 --threads 1 --add
    studies/run speed --scene plate -n 20,40,60 --threads 1 --steps 6 --add
    studies/run speed --take block.vtkhdf

Runs the block with the automatic solver and writes every run into studies/data/runs.csv, then
docs/studies/speed.md from the medians. Before each run the machine is measured: its dense products,
its memory; at the end its products with a compliance (compliance_products.f90, kept beside the
runs in products.csv). Numbers of threads take turns, so that what else the machine does meets
all of them, and their ratios are those of neighbours. `--add` keeps the runs that the file has of
other sizes and threads, without it the file holds the new runs only; `--page` only writes the page;
`--take` adds runs that were made otherwise, with one thread, from their results. From n = 32 on
each setting is run once. A quiet machine takes some ten minutes. `--runs` and `-o` name another
file and page.

The scene `plate` is studies/plate.inp: many contact points and few elements above them.
"""

import argparse
import csv
import math
import re
import statistics
import subprocess
import sys
import tempfile
from datetime import datetime
from pathlib import Path

from bipot.peers.runs import measure
from bipot.program import ROOT, program_options, run_words, with_threads
from bipot.report import machine, table
from bipot.result import Result
from studies.pages import DATA, PAGES, put_page

RUNS = DATA / "runs.csv"
PRODUCTS = "products.csv"  # beside the file of the runs
PAGE = PAGES / "speed.md"
SCENES = {
    "block": (ROOT / "input" / "block.inp", {"solver": "AUTO", "local": "AUTO"}),
    "plate": (ROOT / "studies" / "plate.inp", {}),
    "plate-dense": (ROOT / "studies" / "plate.inp", {"compliance": "DENSE"}),
}
# Columns that are no numbers. Runs of one command share `made`, when it began; "" is not known.
WORDS = ("scene", "arithmetic", "made", "machine")
PHASES = (
    "read", "assemble", "order", "factorise", "condense", "loads", "contact", "recover", "estimate",
    "write",
)
PLATES = {
    "plate": "As the plan has it: with many points the compliance of the contact is not formed.",
    "plate-dense": "With the dense compliance (`COMPLIANCE=DENSE`).",
}
COUNTERS = (
    "equations", "contact_points", "contact_rows", "interface_equations", "increments",
    "factor_entries", "solutions", "compliance_products", "contact_iterations",
    "newton_raphson_iterations", "solver_fallbacks", "imbalance",
)
LIMITS = ("dgemm", "read", "dsymv")
COLUMNS = (
    "scene", "n", "steps", "threads", "arithmetic", "cpu", "total", "memory", "worst", "certified",
    "factor_flops", *(f"seconds_{phase}" for phase in PHASES), *COUNTERS,
    *(f"limit_{name}" for name in LIMITS), "made", "machine",
)
ONCE_FROM = 32


def limits(program, threads):
    """Return what the machine does at this moment: name, value."""
    done = subprocess.run([program], env=with_threads(threads), check=True, capture_output=True,
                          text=True)
    return {name: float(value) for name, value in map(str.split, done.stdout.splitlines())}


def row_of(result):
    """Return what a result tells of its run."""
    counters, plan = result.counters, result.run_text("plan")
    row = {name: counters[name] for name in COUNTERS}
    row |= {f"seconds_{phase}": counters.get(f"seconds_{phase}", 0.0) for phase in PHASES}
    return row | {
        "cpu": counters["cpu_seconds"], "total": counters["seconds_total"],
        "memory": counters["peak_memory_bytes"],
        "worst": max(float(entry.max()) for entry in result.certificate.values()),
        "certified": int(result.history("certified").sum()),
        "arithmetic": re.search(r"LDL\^T, (.*?core)", plan)[1],
        "factor_flops": 1e9 * float(re.search(r"([\d.]+) Gflop", plan)[1]),
    }


def run(options, n, threads):
    """Run the scene once; return its row."""
    deck, settings = SCENES[options.scene]
    with tempfile.TemporaryDirectory(dir=options.scratch) as folder:
        row = {"scene": options.scene, "n": n, "steps": options.steps, "threads": threads,
               "made": options.made, "machine": machine()}
        found = limits(options.limits, threads)
        row |= {f"limit_{name}": found[name] for name in LIMITS}
        path = Path(folder) / "run.vtkhdf"
        words = run_words(options.bipot, deck, path, {"n": n, "steps": options.steps, **settings})
        log = Path(folder) / "log"
        taken = measure(words, ROOT, log, threads=threads)
        if taken.status != 0:
            sys.exit(f"n = {n}: status {taken.status}: {log.read_text()}")
        with Result(path) as result:
            return row | row_of(result) | {"cpu": taken.seconds}


def take(path):
    """Return the row of a run that was made otherwise; nothing is known of the machine then."""
    with Result(path) as result:
        title = result.run["name"]
        scene = "plate" if "plate" in str(title).lower() else "block"
        words = f"{result.run_text('overrides')}\n{result.run_text('deck')}"
        value = {
            name: float(re.search(rf"^\s*{name}\s*=\s*([\d.]+)", words, re.MULTILINE)[1])
            for name in ("n", "steps")
        }
        row = {"scene": scene, **value, "threads": 1, "made": "", "machine": machine()}
        return row | {f"limit_{name}": math.nan for name in LIMITS} | row_of(result)


def read_rows(path=RUNS):
    """Return the rows of the file, numbers as such."""
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [
            {name: text if name in WORDS else float(text) for name, text in row.items()}
            for row in csv.DictReader(file)
        ]


def write_rows(rows, path=RUNS):
    """Write all rows, ordered by size and threads."""
    rows.sort(key=lambda row: (row["scene"], row["threads"], row["n"], row["steps"]))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({
                name: row[name] if name in WORDS else f"{row[name]:.6g}" for name in COLUMNS
            })


def same_setting(one, other):
    """Whether two runs are of one setting."""
    return all(one[name] == other[name] for name in ("scene", "n", "steps", "threads"))


def medians(rows):
    """Return one row for each scene, size, number of increments, threads and arithmetic."""
    keys = ("scene", "n", "steps", "threads", "arithmetic")
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in keys), []).append(row)
    return [
        {
            name: group[0][name] if name in WORDS else statistics.median(r[name] for r in group)
            for name in COLUMNS
        } | {"repeats": len(group)}
        for _, group in sorted(groups.items())
    ]


def seconds_of(row, phase):
    """Return the seconds of a phase: with one thread processor time, else wall time.

    The program clocks its phases by the wall; on a machine that others use too the processor's
    share of a run is taken for that of its phases.
    """
    return row[f"seconds_{phase}"] * (row["cpu"] / row["total"] if row["threads"] == 1 else 1)


def shares(row):
    """Return, for each phase that has one, its rate over the machine's: of what, and the share.

    Factorising: operations of the elimination; condensing: the cube of the interface's size. A
    solution reads the factor twice.
    """
    word = 4 if "single" in row["arithmetic"] else 8
    return {
        "factorise": row["factor_flops"] / seconds_of(row, "factorise") / row["limit_dgemm"],
        "condense": row["interface_equations"] ** 3
        / seconds_of(row, "condense") / row["limit_dgemm"],
        "recover": 2 * word * row["factor_entries"] * row["solutions"]
        / (seconds_of(row, "recover") + seconds_of(row, "loads")) / row["limit_read"],
    }


def time_table(rows):
    """Return the lines of the table of times."""
    head = ["n", "increments", "threads", "runs", "arithmetic", "equations", "points", *PHASES,
            "total", "processor", "MB", "worst error"]
    lines = []
    for row in rows:
        cells = [f"{row[name]:.0f}" for name in ("n", "steps", "threads", "repeats")]
        cells += [row["arithmetic"].replace(" precision", "")]
        cells += [f"{row['equations']:.0f}", f"{row['contact_points']:.0f}"]
        cells += [f"{seconds_of(row, phase):.2g}" for phase in PHASES]
        cells += [f"{row['total']:.3g}", f"{row['cpu']:.3g}", f"{row['memory'] / 1e6:.0f}",
                  f"{row['worst']:.1e}"]
        lines.append(cells)
    return table(head, lines)


def share_table(rows):
    """Return the lines of the table of rates; runs beside which nothing was measured are not in."""
    head = ["n", "threads", "dgemm Gflop/s", "read GB/s", "dsymv GB/s", "factorise", "condense",
            "recover", "products", "solutions", "Gflop of the factor", "entries, 1e6"]
    lines = []
    for row in rows:
        share = shares(row)
        if math.isnan(row["limit_dgemm"]):
            continue
        lines.append([
            f"{row['n']:.0f}", f"{row['threads']:.0f}", f"{row['limit_dgemm'] / 1e9:.3g}",
            f"{row['limit_read'] / 1e9:.3g}", f"{row['limit_dsymv'] / 1e9:.3g}",
            *(f"{share[name]:.2f}" for name in ("factorise", "condense", "recover")),
            f"{row['compliance_products']:.0f}", f"{row['solutions']:.0f}",
            f"{row['factor_flops'] / 1e9:.3g}", f"{row['factor_entries'] / 1e6:.4g}",
        ])
    return table(head, lines)


def turns(rows):
    """Return the runs with more threads, each with the run with one thread that took turns with it.

    The k-th runs of a command with one number of threads and with another are neighbours: a list
    of such pairs by size, increments, threads and command.
    """
    groups = {}
    for row in rows:
        key = (row["n"], row["steps"], row["threads"], row["made"])
        groups.setdefault(key, []).append(row)
    pairs = {}
    for (n, steps, threads, made), more in sorted(groups.items()):
        one = groups.get((n, steps, 1.0, made))
        if threads > 1 and one is not None and made != "":
            pairs[n, steps, threads, made] = list(zip(more, one, strict=False))
    return pairs


def thread_table(rows):
    """Return the lines of the table of more threads over one: ratios of wall time by phase."""
    names = ("factorise", "condense", "contact", "recover", "total")
    columns = [*(f"seconds_{name}" for name in names[:-1]), "total"]
    lines = []
    for (n, steps, threads, _), pairs in turns(rows).items():
        ratios = [statistics.median(more[name] / one[name] for more, one in pairs)
                  for name in columns]
        lines.append([f"{n:.0f}", f"{threads:.0f}", f"{steps:.0f}", len(pairs),
                      *(f"{ratio:.2f}" for ratio in ratios)])
    return table(["n", "threads", "increments", "pairs", *names], lines) if lines else []


def product_lines(runs, products):
    """Return the lines on products with the compliance, where they have been measured."""
    reading = [row["limit_read"] for row in runs
               if row["threads"] == 1 and not math.isnan(row["limit_read"])]
    if not reading or not products.is_file():
        return []
    memory = statistics.median(reading)
    with products.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    head = ["rows", "triangle, MB", "read", "read, huge pages", "product", "of the reading",
            "of that in huge pages", "of memory's"]
    cells = []
    for row in rows:
        for name, word in (("double", 8), ("single", 4)):
            pages, huge, product = (
                float(row[column]) for column in (f"read_{name}", f"read_{name}_huge", name))
            cells.append([
                f"{row['rows']}, {name}", f"{word * float(row['rows']) ** 2 / 2e6:.1f}",
                *(f"{rate / 1e9:.1f} GB/s" for rate in (pages, huge, product)),
                *(f"{product / rate:.2f}" for rate in (pages, huge, memory))])
    return [
        "## Products with the compliance", "",
        "By `compliance_products`, one thread: how fast memory of the size of a triangle of W is",
        "read, in pages of 4 kB and of 2 MB, and how fast the triangle is read in a product with a",
        f"vector, in double precision by OpenBLAS (kernels for {rows[0]['kernels']}), in single",
        "from panels; best of 40, in turns, so each finds of the caches what the others left. W",
        "and its panels lie in huge pages where the system gives them. `of memory's`: beside the",
        f"reading of memory of the table above, {memory / 1e9:.1f} GB/s in the middle run: 256 MB",
        "in ordinary pages, which no cache holds.", "",
        *table(head, cells), ""]


def runs_in_words(rows):
    """Say of how many runs the lines of medians are."""
    counts = [row["repeats"] for row in rows]
    if not counts:
        return "no runs"
    if max(counts) == 1:
        return "each line is one run"
    if min(counts) == max(counts):
        return f"each line holds the medians of {max(counts)} runs"
    return f"each line holds the medians of so many `runs`, {min(counts)} to {max(counts)}"


def seconds_in_words(rows):
    """Say what the seconds of the phases are."""
    more = ", with more of the wall" if any(row["threads"] > 1 for row in rows) else ""
    return ["Seconds by phase: with one thread of the processor (the machine is shared; phases",
            f"are clocked by the wall, and scaled by the processor's share of the run){more}."]


def page(rows, products=DATA / PRODUCTS):
    """Return the lines of docs/studies/speed.md; `products` is the file of those with W."""
    runs = [row for row in rows if row["scene"] == "block"]
    every = medians(rows)
    rows = [row for row in every if row["scene"] == "block"]
    plates = [row for row in every if row["scene"].startswith("plate")]
    lines = [
        "# Time and memory of the block by phase", "",
        f"By `studies/run speed` on {machines(rows)}: the paper's block, automatic solver,",
        f"tolerance 1e-10; {runs_in_words(rows)}.",
        *seconds_in_words(rows),
        "`total` is wall time, `processor` that of the whole process, `MB` the peak of memory. All",
        "runs are in `studies/data/runs.csv`; [scaling](scaling.md) fits their growth.", "",
        *time_table(rows), "",
        "## Beside the machine", "",
        "Measured before each run: the rate of large dense products, of reading memory, and of a",
        "symmetric matrix beyond the caches in its product with a vector. The shares are those of",
        "the phases in these limits: operations of the elimination in dense products, solutions",
        "(the factor is read twice; many at once share a reading) in the rate of memory. The",
        "machine's limit and the phase are not measured in the same second, so a share has an",
        "error of a tenth or two.", "",
        *share_table(rows), "", *product_lines(runs, products),
    ]
    threads = thread_table(runs)
    if threads:
        lines += ["## Two threads over one" if max(row["threads"] for row in rows) == 2
                  else "## More threads over one", "",
                  "Ratios of wall time, medians over pairs of runs of one command, which took",
                  "turns.",
                  "", *threads, ""]
    if plates:
        lines += ["## A plate with many contact points", "",
                  f"`studies/plate.inp`, three layers of elements, on {machines(plates)}, whose",
                  f"dense products ran at {rate_in_words(plates)}; {runs_in_words(plates)}.", ""]
        for scene, words in PLATES.items():
            found = [row for row in plates if row["scene"] == scene]
            if found:
                lines += [words, "", *time_table(found), ""]
    return lines


def machines(rows):
    """Name the machines of runs."""
    return " and ".join(dict.fromkeys(row["machine"] for row in rows))


def rate_in_words(rows):
    """Say how fast dense products were beside runs, the least and the most."""
    rates = [row["limit_dgemm"] / 1e9 for row in rows]
    return f"{min(rates):.0f} to {max(rates):.0f} Gflop/s"


def whole_numbers(text):
    """Return the numbers of a text such as "8,16"."""
    try:
        found = [int(word) for word in text.split(",")]
    except ValueError:
        found = [0]
    if min(found) < 1:
        raise argparse.ArgumentTypeError(f"expected numbers of at least 1, found '{text}'")
    return found


def main():
    """Run and write."""
    parser = program_options(__doc__)
    parser.add_argument("-n", type=whole_numbers, default=[8, 16, 24, 32, 40])
    parser.add_argument("--threads", type=whole_numbers, default=[1, 2])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--steps", type=int, default=50, help="increments")
    parser.add_argument("--scene", choices=SCENES, default="block")
    parser.add_argument("--take", type=Path, nargs="+", default=[], metavar="RESULT")
    parser.add_argument("--add", action="store_true", help="to the runs that are there")
    parser.add_argument("--page", action="store_true", help="write the page from the runs there")
    parser.add_argument("--scratch", type=Path, help="where results go for the moment")
    parser.add_argument("--runs", type=Path, default=RUNS, help="the file of the runs")
    parser.add_argument("-o", dest="written", type=Path, default=PAGE, help="write the page here")
    parser.add_argument("--limits", type=Path, help="(build/studies/machine_limits)",
                        default=ROOT / "build" / "studies" / "machine_limits")
    options = parser.parse_args()
    options.made = datetime.now().isoformat(timespec="seconds")
    products = options.runs.with_name(PRODUCTS)
    rows = read_rows(options.runs) if options.add or options.page or options.take else []
    for path in options.take:
        new = take(path)
        rows = [row for row in rows if not same_setting(row, new)] + [new]
        write_rows(rows, options.runs)
    if not options.page and not options.take:
        for program in (options.bipot, options.limits):
            if not program.is_file():
                sys.exit(f"no program at {program}; configure with -DBIPOT_BENCHMARKS=ON and build")
        options.bipot, options.limits = options.bipot.resolve(), options.limits.resolve()
        for n in options.n:
            new = []
            for number in range(1 if n >= ONCE_FROM else options.repeat):
                for threads in options.threads:
                    print(f"{options.scene}, n = {n}, run {number + 1}, threads: {threads}",
                          file=sys.stderr, flush=True)
                    new.append(run(options, n, threads))
            rows = [row for row in rows if not any(same_setting(row, one) for one in new)] + new
            write_rows(rows, options.runs)
        meter = options.limits.with_name("compliance_products")
        if meter.is_file() and options.scene == "block":
            products.write_text(subprocess.run(
                [meter], env=with_threads(1), check=True, capture_output=True, text=True).stdout)
    if not rows:
        sys.exit(f"no runs in {options.runs}")
    put_page("\n".join(page(rows, products)).rstrip() + "\n", options.written)
    return 0


if __name__ == "__main__":
    sys.exit(main())
