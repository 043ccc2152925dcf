"""Make docs/studies/scaling.md: how time and memory grow, and what that means for larger problems.

    studies/run scaling [-o docs/studies]

Takes the runs of studies/data/runs.csv (studies/run speed), fits a power law of the number of
equations to every phase, and a model with the exponents of theory to what the phases do. The
model's largest runs are foretold from the smaller ones, as a check, before it foretells larger
ones than any machine here has room for.
"""

import math
import re
import subprocess
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.figures import BLUE, GREEN, ORANGE, PURPLE, RED, new_axes, save
from bipot.program import ROOT, script_options
from bipot.report import table
from studies.pages import PAGES, StudyError, claim
from studies.speed import machines, medians, read_rows, seconds_of

SMALLEST = 16  # below, fixed costs hide the growth
CHECKED = 2    # the largest runs, foretold from the others
INCREMENTS = 50
PLATE = 100  # elements along its sides
CUBE_TRIANGLE = (3 * 65**2) ** 2 / 2  # entries of W of the block with n = 64
YEAR = 365.25 * 24 * 3600
# Bytes of memory of machines that the page speaks of.
MACHINES = (("this machine", 24e9), ("a node with 1 TB", 1e12), ("a hundred such nodes", 1e14))


@dataclass
class Law:
    """coefficient * equations ** exponent."""

    coefficient: float
    exponent: float
    off: float  # the largest relative deviation of a run from the law

    def __call__(self, equations):
        return self.coefficient * equations**self.exponent

    def reaches(self, value):
        """Return the number of equations at which the law has the value."""
        return (value / self.coefficient) ** (1 / self.exponent)


def fit(rows, quantity, exponent=None):
    """Fit a law by least squares of logarithms; with the exponent given, through the largest run:
    the smaller ones have not yet reached it."""
    rows = [row for row in rows if not math.isnan(quantity(row))]
    x = np.log([row["equations"] for row in rows])
    y = np.log([quantity(row) for row in rows])
    if exponent is None:
        if len(rows) < 2:
            raise StudyError("runs of two sizes at least are needed for an exponent")
        exponent, constant = np.polyfit(x, y, 1)
    else:
        constant = y[-1] - exponent * x[-1]
    off = np.max(np.abs(np.exp(y - constant - exponent * x) - 1))
    return Law(math.exp(constant), float(exponent), float(off))


# What the phases do, and how theory has it grow with the equations N of a cube: n^4 = N^(4/3),
# n^6 = N^2 (nested dissection in three dimensions; a surface has n^2 points).
WORK = {
    "entries of the factor": (lambda r: r["factor_entries"], 4 / 3),
    "operations of the factorisation": (lambda r: r["factor_flops"], 2),
    "contact points": (lambda r: r["contact_points"], 2 / 3),
    "entries of W": (lambda r: r["contact_rows"] ** 2, 4 / 3),
    "products with W an increment": (
        # A refined factor repeats contact from a warm start, so it tells nothing here.
        lambda r: r["compliance_products"] / r["increments"] if is_double(r) else math.nan, None
    ),
}


def is_double(row):
    """Whether a run's factor is in double precision and in core."""
    return row["arithmetic"] == "double precision, in core"


def measured_table(rows):
    """Return the lines of the fits of time and memory."""
    quantities = {
        "read, with the plan": (lambda r: seconds_of(r, "read"), "N^4/3 and less"),
        "assemble": (lambda r: seconds_of(r, "assemble"), "N"),
        "factorise": (lambda r: seconds_of(r, "factorise"), "N^2"),
        "condense": (lambda r: seconds_of(r, "condense"), "N^2"),
        "contact": (lambda r: seconds_of(r, "contact"), "N^4/3, products beside"),
        "loads and recover": (
            lambda r: seconds_of(r, "loads") + seconds_of(r, "recover"), "N^4/3"
        ),
        "write": (lambda r: seconds_of(r, "write"), "N"),
        "whole run": (lambda r: r["cpu"], ""),
        "memory": (lambda r: r["memory"], "N^4/3"),
    }
    large = [row for row in rows if row["n"] >= SMALLEST and is_double(row)]
    sizes = [row["n"] for row in large]
    head = ["", *(f"n = {n:.0f}" for n in sizes), "exponent", "off by at most", "theory"]
    lines = []
    for name, (quantity, theory) in quantities.items():
        law = fit(large, quantity)
        unit, scale = ("GB", 1e9) if name == "memory" else ("s", 1)
        values = [f"{quantity(row) / scale:.3g} {unit}" for row in large]
        lines.append([name, *values, f"{law.exponent:.2f}", f"{law.off:.0%}", theory])
    return table(head, lines)


def work_table(rows):
    """Return the lines of what the phases do, foretold from the smaller runs; and the largest error
    of that."""
    large = [row for row in rows if row["n"] >= SMALLEST]
    if len(large) <= CHECKED + 1:
        raise StudyError(f"runs of at least {CHECKED + 2} sizes from n = {SMALLEST} on are needed")
    known, checked = large[:-CHECKED], large[-CHECKED:]
    head = ["", "fitted to n", "exponent",
            *(f"n = {row['n']:.0f}: foretold / counted" for row in checked)]
    lines, worst = [], 0.0
    for name, (quantity, exponent) in WORK.items():
        law = fit(known, quantity, exponent)
        ratios = [law(row["equations"]) / quantity(row) for row in checked]
        worst = max([worst, *(abs(ratio - 1) for ratio in ratios if not math.isnan(ratio))])
        sizes = f"{known[0]['n']:.0f} to {known[-1]['n']:.0f}"
        shown = ["-" if math.isnan(ratio) else f"{ratio:.2f}" for ratio in ratios]
        lines.append([name, sizes, f"{law.exponent:.2f}", *shown])
    return table(head, lines), worst


@dataclass
class Model:
    """Laws of the work, fitted to all runs, and the rates of the largest run."""

    laws: dict
    factorise: float  # operations a second
    condense: float   # operations a second, by the cube of the rows
    contact: float    # bytes a second of a triangle of W
    recover: float    # bytes a second of the factor, read twice
    memory: Law       # of a whole run in double precision, in core


def make_model(rows):
    """Return the model."""
    large = [row for row in rows if row["n"] >= SMALLEST]
    laws = {name: fit(large, *how) for name, how in WORK.items()}
    last = [row for row in large if is_double(row)][-1]
    return Model(
        laws,
        last["factor_flops"] / seconds_of(last, "factorise"),
        last["interface_equations"] ** 3 / seconds_of(last, "condense"),
        4 * last["contact_rows"] ** 2 * last["compliance_products"] / seconds_of(last, "contact"),
        16 * last["factor_entries"] * last["solutions"]
        / (seconds_of(last, "loads") + seconds_of(last, "recover")),
        fit([row for row in large if is_double(row)], lambda row: row["memory"], 4 / 3),
    )


def foretell(model, equations):
    """Return what a run of INCREMENTS increments would take: name, value."""
    laws = model.laws
    entries, w = laws["entries of the factor"](equations), laws["entries of W"](equations)
    products = INCREMENTS * laws["products with W an increment"](equations)
    return {
        "points": laws["contact points"](equations),
        "factor": 8 * entries,
        "single": 4 * entries,
        "matrices": 16 * w,
        "factorise": laws["operations of the factorisation"](equations) / model.factorise,
        "condense": w**1.5 / model.condense,
        "contact": 4 * w * products / model.contact,
        "recover": 16 * entries * (INCREMENTS + 4) / model.recover,
    }


def bytes_in_words(number):
    """Return 3.2 GB, 45 TB."""
    for unit, size in (("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if number >= size:
            return f"{number / size:.2g} {unit}" if number < 100 * size else (
                f"{number / size:.0f} {unit}"
            )
    return f"{number / 1e3:.0f} kB"


def time_in_words(seconds):
    """Return 12 s, 3.4 h, 2.1 years."""
    for unit, size in (("years", YEAR), ("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            number = seconds / size
            return f"{number:.2g} {unit}" if number < 100 else f"{number:,.0f} {unit}"
    return f"{seconds:.2g} s"


def size_in_words(number):
    """Return 10^6, or 3.5 * 10^7."""
    power = math.floor(math.log10(number) + 1e-9)
    leading = number / 10**power
    return f"10^{power}" if abs(leading - 1) < 0.005 else f"{leading:.2g} x 10^{power}"


def forecast_table(model):
    """Return the lines of the table of larger cubes."""
    head = ["equations", "contact points", "factor, double", "single", "C and W, dense",
            "factorise", "condense", f"contact, {INCREMENTS} increments", "recover"]
    lines = []
    for equations in (1e6, 1e7, 1e8, 1e9):
        found = foretell(model, equations)
        lines.append([
            size_in_words(equations), f"{found['points']:,.0f}",
            *(bytes_in_words(found[name]) for name in ("factor", "single", "matrices")),
            *(time_in_words(found[name])
              for name in ("factorise", "condense", "contact", "recover")),
        ])
    return table(head, lines)


def limits_table(model):
    """Return the lines of the table of where a machine's memory ends."""
    entries, w = model.laws["entries of the factor"], model.laws["entries of W"]
    head = ["memory", "a run in double", "its factor", "a factor in single", "C and W"]
    lines = []
    for name, size in MACHINES:
        sizes = (model.memory.reaches(size), entries.reaches(size / 8), entries.reaches(size / 4),
                 w.reaches(size / 16))
        lines.append([f"{name}, {bytes_in_words(size)}", *map(size_in_words, sizes)])
    return table(head, lines)


def many_points(model, points):
    """Return the lines about a surface of so many points, whatever is above it."""
    rows = 3 * points
    w = 8 * rows**2
    product = 4 * rows**2 / model.contact
    inverse = rows**3 / model.condense
    products = round(model.laws["products with W an increment"](1e6))
    return [
        f"{points:,} points have {rows:,} rows: W and the interface's compliance C are "
        f"{bytes_in_words(w)} each, dense and in double precision; C is the inverse of the Schur "
        f"complement, {time_in_words(inverse)} of one processor at the rate of the largest run. A "
        f"triangle of W's copy in single precision, which most products read, is "
        f"{bytes_in_words(w / 4)}; contact takes {time_in_words(product)} a product, and "
        f"{time_in_words(products * product)} an increment of {products}.",
    ]


def draw(rows, path):
    """Draw the phases over the equations."""
    figure, axes = new_axes()
    phases = {"factorise": BLUE, "condense": GREEN, "contact": ORANGE, "recover": PURPLE,
              "write": RED}
    x = [row["equations"] for row in rows]
    for name, colour in phases.items():
        axes.loglog(x, [seconds_of(row, name) for row in rows], "o-", color=colour, label=name)
    axes.set_xlabel("equations")
    axes.set_ylabel(f"processor time, {INCREMENTS} increments, s")
    axes.legend()
    save(figure, path)


def entries_without_contact(program):
    """Return the entries of the factor of the plate without its contact pair, by the plan."""
    text = (ROOT / "studies" / "plate.inp").read_text(encoding="utf-8")
    text = re.sub(r"\*CONTACT PAIR[^\n]*\n[^\n]*\n\*CONTACT SOLVER[^\n]*\n", "", text)
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "plate.inp"
        deck.write_text(text, encoding="utf-8")
        words = [program, deck, "--plan", "--set", f"n={PLATE}"]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    found = re.search(r"at most +([\d.]+) million entries", done.stdout)
    if done.returncode != 0 or found is None:
        raise StudyError(f"no plan of the plate: {done.stderr or done.stdout}")
    return 1e6 * float(found[1])


def plate_words(program):
    """Return what 100 x 100 elements on their contact points would take, with W and without."""
    rows = 3 * (PLATE + 1) ** 2
    entries, triangle = entries_without_contact(program), rows**2 / 2
    share = triangle / (2 * entries)
    return claim(
        share > 2,
        f"C and W of `studies/plate.inp` with n = {PLATE}, {PLATE} x {PLATE} x 3 elements, are "
        f"{bytes_in_words(16 * rows**2)}, W's copy {bytes_in_words(2 * rows**2)}, about what this "
        "machine holds beside the factor; what was run is in [speed](speed.md). Two things would "
        "halve it without another method: on planes along the axes W is C with its rows in another "
        "order, so one of the two is enough; and of a symmetric matrix a triangle is enough. A "
        "better way for such "
        f"a body is to keep neither: the factor of the same plate without a contact pair has "
        f"{entries / 1e6:.3g} million entries, the triangle of W {triangle / 1e6:.0f} million. A "
        f"product with W by one solution would read {share:.0f} times less, and the dense inverse "
        "would not be needed at all. For a cube it is the other way round (n = 64: a triangle of "
        f"{CUBE_TRIANGLE / 1e6:.0f} million, a factor of 2000), so the plan should choose: by "
        "solutions where twice the factor is less than the triangle.",
    )


def consequences(model, program):
    """Return what the model says, borne out by its numbers."""
    entries, w = model.laws["entries of the factor"], model.laws["entries of W"]
    big, huge = foretell(model, 1e7), foretell(model, 1e9)
    first = model.memory.reaches(MACHINES[0][1])
    return [
        claim(entries.reaches(1e12 / 8) < w.reaches(1e12 / 16),
              f"**What breaks first is the factor's memory.** It and W grow alike (N^4/3), and the "
              f"factor is {big['factor'] / big['matrices']:.0f} times C and W together. In double "
              f"precision it fills this machine at {size_in_words(first)} equations, in single at "
              f"{size_in_words(entries.reaches(MACHINES[0][1] / 4))}; the plan goes from one to "
              f"the "
              "other by itself, then to compression and to the disk."),
        "",
        claim(big["single"] < 1e12 < huge["single"],
              f"**10^7 equations** ({big['points']:,.0f} contact points): "
              f"{bytes_in_words(big['factor'])} of factor in double precision, "
              f"{bytes_in_words(big['single'])} in single, and {bytes_in_words(big['matrices'])} "
              f"of "
              f"C and W: one large node holds it. The factorisation takes "
              f"{time_in_words(big['factorise'])} of one processor at this machine's rate, and is "
              "what MUMPS shares among processors and compresses (block low rank) best. Nothing in "
              "the method has to change; the dense inverse "
              f"({time_in_words(big['condense'])}) and the products "
              f"({time_in_words(big['contact'])}) need threads or the same processors "
              f"(ScaLAPACK)."),
        "",
        claim(huge["single"] > 1e13 and huge["factorise"] > 10 * YEAR,
              f"**10^9 equations**: {bytes_in_words(huge['single'])} of factor in single precision "
              f"and {time_in_words(huge['factorise'])} of one such processor: no direct factor. "
              "Iteration takes over, contact solved together with the bodies, whose memory grows "
              "as N and whose time does hardly faster: [iteration](iteration.md) has what it "
              "takes and how far it goes."),
        "",
        claim(w.reaches(MACHINES[1][1] / 16) > 1e7,
              "**10^5 contact points.** " + many_points(model, 100000)[0]
              + " Below a thin body it is W that breaks: it is to be kept compressed (far from "
              "its diagonal it is smooth: "
              "hierarchical matrices, as in H2Lib or hmat-oss), or not kept at all: a product with "
              "it is one solution with the factor. Certificate, law, search and result file ask "
              "for "
              "nothing but W r, and stay as they are."),
        "",
        "**10,000 contact points.** " + many_points(model, 10000)[0] + " " + plate_words(program),
        "",
        "**Indices.** METIS as Debian has it counts in 32 bits, and a deck has at most 20 million "
        "nodes: 6 x 10^7 equations are a limit of the program, beyond what its method reaches.",
    ]


def page(rows, program):
    """Return the lines of the page."""
    work, worst = work_table(rows)
    model = make_model(rows)
    return [
        "# How it grows", "",
        "By `studies/run scaling` from the runs in `studies/data/runs.csv` on "
        f"{machines(rows)}: the",
        f"paper's block with n elements along an edge, {INCREMENTS} increments, one thread, "
        f"automatic",
        "solver ([speed](speed.md)). N is the number of equations, 3 n (n + 1)^2.", "",
        "![Phases](figures/scaling.png)", "",
        "## Measured", "",
        f"Processor seconds and memory, and the exponent of a power of N fitted to n >= "
        f"{SMALLEST}.",
        "", *measured_table(rows), "",
        "## The model", "",
        "What the phases do is counted by the program, so it has no noise. With the exponents of",
        "theory (a surface has n^2 points; nested dissection of a cube keeps n^4 entries and takes",
        "n^6 operations) a law goes through the largest run that is known; the exponent of the",
        f"products is fitted, to runs in double precision. The last {CHECKED} runs are foretold",
        f"from those before within {worst:.0%}.", "",
        *work, "",
        "Seconds are the work over the rates of the largest run in double precision:",
        f"{model.factorise / 1e9:.3g} Gflop/s factorising, {model.condense / 1e9:.3g} condensing",
        f"(by the cube of the rows), {model.contact / 1e9:.3g} GB/s of a triangle of W for each",
        "product, most of which read half as much, in single precision, and "
        f"{model.recover / 1e9:.3g} GB/s of the",
        "factor for each solution, up to 16 of which share a reading.", "",
        "## Foretold", "",
        f"A cube, {INCREMENTS} increments, one processor of this kind:", "",
        *forecast_table(model), "",
        "The number of equations at which a whole run, or one of its parts alone, fills a memory:",
        "",
        *limits_table(model), "",
        "## What it means", "",
        *consequences(model, program),
    ]


def main():
    """Write the page and its figure."""
    options = script_options(__doc__, PAGES, "the page and its figure go").parse_args()
    rows = [
        row for row in medians(read_rows())
        if row["scene"] == "block" and row["threads"] == 1 and row["steps"] == INCREMENTS
    ]
    rows.sort(key=lambda row: row["n"])
    try:
        lines = page(rows, options.bipot.resolve())
    except StudyError as error:
        sys.exit(f"scaling: {error}")
    (options.folder / "figures").mkdir(parents=True, exist_ok=True)
    draw(rows, options.folder / "figures" / "scaling.png")
    wrapped = [
        part for line in lines
        for part in (textwrap.wrap(line, 120, break_long_words=False)
                     if len(line) > 120 and not line.startswith("|") else [line])
    ]
    (options.folder / "scaling.md").write_text("\n".join(wrapped) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
