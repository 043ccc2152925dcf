"""Compare the contact solvers on input/block.inp: the study that the paper began.

Runs the block over meshes, friction, rho and solvers, one run at a time, and keeps the numbers in
FOLDER/runs.json, so that an interrupted study goes on where it stopped and a finished one only
draws. Writes docs/studies/solvers.md and its figures. Every sentence of the page that states
a finding is checked against the runs; the script refuses to write a page they do not bear out.
"""

import hashlib
import itertools
import json
import os
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, ScalarFormatter

from bipot.figures import BLUE, GREEN, INK, ORANGE, PURPLE, RED, new_axes, save
from bipot.program import (
    DECK,
    ROOT,
    RunError,
    built_program,
    command_text,
    run_block,
    script_options,
)
from bipot.report import Bar, machine, table
from bipot.result import Result
from studies import solver_elements
from studies.pages import PAGES, StudyError, claim

MESHES = (1, 2, 4, 8, 16, 24)
TIGHT = (4, 8, 16, 24)  # solved to a residual of 1e-10 by the global Newton
FRICTIONS = (0.0, 0.1, 0.3, 1.0)
# Factors of the natural scale; the last lies beyond the range of Uzawa.
RHOS = (0.1, 0.3, 0.5, 1.0, 1.5, 2.0, 2.5)
STOPS = {
    "change": {"stop": "CHANGE", "tolerance": "1e-6"},
    "residual": {"stop": "RESIDUAL", "tolerance": "1e-8"},
}
GLOBAL = {"solver": "GLOBAL NEWTON", "local": "AUTO"}
NOT_SOLVED = 2  # exit status of bipot


@dataclass(frozen=True)
class Variant:
    """A contact solver: its name here, and what to tell bipot."""

    name: str
    parameters: dict
    colour: str = INK
    line: str = "-"
    card: str = ""  # more options of *CONTACT SOLVER, which the deck has no parameters for
    sweeps: bool = True


VARIANTS = {
    "uzawa": Variant("Uzawa", {"local": "UZAWA"}, BLUE),
    "uzawa-pseudo": Variant(
        "Uzawa, pseudo-potential",
        {"local": "UZAWA", "formulation": "PSEUDOPOTENTIAL"}, PURPLE, "-.",
    ),
    "newton": Variant("Newton", {"local": "NEWTON"}, ORANGE),
    "newton-pseudo": Variant(
        "Newton, pseudo-potential", {"local": "NEWTON", "formulation": "PSEUDOPOTENTIAL"}, RED, ":"
    ),
    "relaxed": Variant(
        "Newton, relaxation 0.4", {"local": "NEWTON"}, GREEN, "--", "RELAXATION=0.4"
    ),
    "exact": Variant("exact local solution", {"local": "EXACT"}, RED, ":"),
    "global": Variant("global Newton", GLOBAL, INK, sweeps=False),
    "auto": Variant("AUTO", {"solver": "AUTO", "local": "AUTO"}, INK, ":", sweeps=False),
}
WITH_RHO = ("uzawa", "uzawa-pseudo", "newton", "newton-pseudo")



@dataclass(frozen=True)
class Case:
    """One run of the study."""

    variant: str
    n: int
    mu: float = 0.3
    rho: float = 1.0
    stop: str = "residual"
    tolerance: str = ""  # other than that of the stopping rule

    @property
    def parameters(self):
        """What `--set` gets."""
        given = {"n": self.n, "mu": self.mu, "rho": self.rho}
        given |= STOPS[self.stop] | VARIANTS[self.variant].parameters
        if self.tolerance:
            given["tolerance"] = self.tolerance
        return given

    @property
    def key(self):
        """Name in the cache."""
        words = (self.variant, self.n, self.mu, self.rho, self.stop, self.tolerance)
        return " ".join(str(word) for word in words if word != "")

    @property
    def weight(self):
        """Rough cost beside other runs, for the time left."""
        return (0.2 + 4 * (self.n / 16) ** 4) * (0.6 if self.rho == 0.3 else 1)


def design(quick):
    """Return the cases in the order they are run."""
    cases = {}

    def add(variants, meshes, mus=(0.3,), rhos=(1.0,), stops=tuple(STOPS), tolerances=("",)):
        for n, variant, mu, rho, stop, tolerance in itertools.product(
            meshes, variants, mus, rhos, stops, tolerances
        ):
            solver = VARIANTS[variant]
            if solver.sweeps or stop == "residual":
                cases[Case(variant, n, mu, rho, stop, tolerance)] = None

    if quick:
        add(("uzawa", "newton", "relaxed", "global"), (1, 2), rhos=(1.0,))
        add(("uzawa",), (1, 2), rhos=(0.3,))
        add(("uzawa",), (2,), rhos=(2.5,), stops=("residual",))
        return list(cases)
    every = ("uzawa", "uzawa-pseudo", "newton", "newton-pseudo", "relaxed", "exact")
    add((*every, "global", "auto"), (1, 2, 4, 8, 16))
    add(("uzawa", "uzawa-pseudo"), (1, 2, 4, 8, 16), rhos=(0.3,))
    # Where Uzawa does not converge, STOP=CHANGE sweeps to the end at every step: n = 4 is enough.
    add(WITH_RHO, (4,), mus=FRICTIONS, rhos=RHOS)
    add(WITH_RHO, (8,), mus=FRICTIONS, rhos=RHOS, stops=("residual",))
    add(WITH_RHO, (8,), mus=FRICTIONS)
    add(("relaxed", "exact", "global", "auto"), (4, 8), mus=FRICTIONS)
    add(("global", "auto"), (24,))
    add(("uzawa", "newton", "relaxed"), (24,), stops=("change",))
    add(("uzawa",), (24,), rhos=(0.3,), stops=("change",))
    add(("relaxed",), (24,), stops=("residual",))
    add(("global",), TIGHT, stops=("residual",), tolerances=("1e-10",))
    return sorted(cases, key=lambda case: case.n)


def deck_with(card):
    """Return the block's deck with more options of *CONTACT SOLVER, such as "RELAXATION=0.4"."""
    text = DECK.read_text(encoding="utf-8")
    changed = text.replace("RHO=<rho>,", f"RHO=<rho>, {card},")
    if changed == text:
        raise ValueError(f"{DECK}: no RHO=<rho> to put {card} after")
    return changed


@dataclass
class Study:
    """The runs and their numbers, kept in a folder."""

    program: Path
    folder: Path
    records: dict = field(default_factory=dict)
    facts: dict = field(default_factory=dict)

    def __post_init__(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.cache = self.folder / "runs.json"
        if self.cache.is_file():
            kept = json.loads(self.cache.read_text(encoding="utf-8"))
            self.facts, self.records = kept["facts"], kept["records"]

    def check_program(self):
        """Forget runs of another program or deck; errors are measured from these runs' own."""
        digest = hashlib.sha256(self.program.read_bytes() + DECK.read_bytes()).hexdigest()
        if self.facts.get("digest") != digest:
            if self.records:
                print("the program or the deck has changed: the runs begin anew")
            self.records = {}
            for old in self.folder.glob("reference-*.npy"):
                old.unlink()
        self.facts = {"digest": digest, "machine": machine()}

    def save(self):
        """Write the cache; an interruption leaves the old one."""
        fresh = self.cache.with_suffix(".new")
        text = json.dumps({"facts": self.facts, "records": self.records}, indent=1)
        fresh.write_text(text, encoding="utf-8")
        os.replace(fresh, self.cache)

    def __getitem__(self, case):
        """Return the record of a case, or None if it was not run."""
        return self.records.get(case.key)

    def run(self, case):
        """Run a case and keep its record; return what the step reactions were."""
        variant = VARIANTS[case.variant]
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            deck = DECK
            if variant.card:
                deck = folder / "block.inp"
                deck.write_text(deck_with(variant.card), encoding="utf-8")
            start = time.perf_counter()
            done = run_block(
                self.program, folder / "run.vtkhdf", case.parameters, deck,
                capture_output=True, text=True, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            )
            record = {"status": done.returncode, "wall": time.perf_counter() - start}
            if done.returncode not in (0, NOT_SOLVED):
                raise StudyError(
                    f"{command_text(case.parameters)}\n"
                    f"ended with status {done.returncode}: {done.stderr.strip()}"
                )
            if done.returncode == NOT_SOLVED:
                record["message"] = done.stderr.strip().splitlines()[0]
            reaction = np.zeros((0, (case.n + 1) ** 2, 3))
            record |= {"finished": 0}
            if (folder / "run.vtkhdf").is_file():
                with Result(folder / "run.vtkhdf") as result:
                    reaction = result.pairs[0].reaction
                    record |= numbers(result)
        self.records[case.key] = record
        return reaction

    def reference(self, case):
        """Return the reactions that a case is compared with, from the global Newton at 1e-12."""
        path = self.folder / f"reference-{case.n}-{case.mu}.npy"
        if not path.is_file():
            exact = Case("global", case.n, case.mu, tolerance="1e-12")
            reaction = self.run(exact)
            if self[exact]["status"] != 0:
                raise StudyError(f"no reference for n = {case.n}, mu = {case.mu}")
            np.save(path, reaction)
        return np.load(path)

    def complete(self, cases):
        """Run what is missing, with a bar."""
        missing = [case for case in cases if self[case] is None]
        bar = Bar(sum(case.weight for case in missing))
        for case in missing:
            bar.show(case.key)
            reference = self.reference(case)
            reaction = self.run(case)
            scale = np.abs(reference).max(axis=(1, 2))[: len(reaction)]
            error = np.abs(reaction - reference[: len(reaction)]).max(axis=(1, 2)) / scale
            self[case]["error"] = float(error.max()) if len(error) else None
            self.save()
            bar.advance(case.weight)
        bar.close()


def numbers(result):
    """Return what the study keeps of a result."""
    iterations = result.history("contact_iterations")
    return {
        "finished": result.finished,
        "certified": int((result.history("certified") == 1).sum()),
        "iterations": int(iterations.sum()),
        "worst": int(iterations.max(initial=0)),
        "local": int(result.history("local_iterations").sum()),
        "products": int(result.history("compliance_products").sum()),
        "worst_products": int(result.history("compliance_products").max(initial=0)),
        "time": float(result.history("contact_time").sum()),
        "solvers": sorted({int(k) for k in result.history("solver")}),
    }


# --- Figures ----------------------------------------------------------------------------------

MESH_LINES = (
    ("uzawa", 1.0, "o"), ("uzawa", 0.3, "s"), ("newton", 1.0, "^"), ("relaxed", 1.0, "D"),
    ("global", 1.0, "o"),
)
OVER_MESHES = {
    "mesh": ("iterations", "change", "sweeps (or iterations) of 50 steps"),
    "time": ("time", "residual", "time in the contact solver (s)"),
}


def line_name(variant, rho):
    """Return the name of a solver, with rho where it matters."""
    name = VARIANTS[variant].name
    return f"{name}, rho = {rho:g}" if variant.startswith("uzawa") else name


def solved(study, case, quantity):
    """Return a number of a run that went through, not a number otherwise."""
    record = study[case]
    return record[quantity] if record and record["status"] == 0 else np.nan


def mesh_axis(axes, meshes):
    """Set the axis of elements an edge."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(meshes))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.set_xlabel("elements along an edge, n")


def figure_over_meshes(study, path, meshes, shown):
    """Draw a number of the runs over the meshes, a line a solver.

    `shown`: name, stopping rule and label. The global Newton always ends by its residual.
    """
    quantity, stop, label = shown
    figure, axes = new_axes()
    for variant, rho, mark in MESH_LINES:
        look = VARIANTS[variant]
        rule = stop if look.sweeps else "residual"
        values = [solved(study, Case(variant, n, rho=rho, stop=rule), quantity) for n in meshes]
        axes.plot(
            meshes, values, marker=mark, markersize=4, color=look.colour,
            linestyle="--" if rho != 1 else look.line, label=line_name(variant, rho),
        )
    axes.set_yscale("log")
    mesh_axis(axes, meshes)
    axes.set_ylabel(label)
    axes.legend(fontsize=8)
    save(figure, path)


def figure_rho(study, path, meshes):
    """Sweeps over rho, a panel a mesh."""
    figure, panels = new_axes(len(meshes), sharey=True)
    panels = np.atleast_1d(panels)
    top = 0
    for n, axes in zip(meshes, panels, strict=True):
        for variant in ("uzawa", "uzawa-pseudo", "newton"):
            look = VARIANTS[variant]
            values = [solved(study, Case(variant, n, rho=rho), "iterations") for rho in RHOS]
            axes.plot(
                RHOS, values, look.line, marker="o", markersize=4, color=look.colour,
                label=look.name,
            )
            top = max(top, np.nan_to_num(values).max())
        relaxed = solved(study, Case("relaxed", n), "iterations")
        axes.axhline(relaxed, color=GREEN, linestyle="--", label=VARIANTS["relaxed"].name)
        axes.set_title(f"n = {n}", fontsize=9)
        axes.set_xlabel("rho (factor of its natural scale)")
    # Not solved: a cross above everything.
    for n, axes in zip(meshes, panels, strict=True):
        for place, variant in enumerate(("uzawa", "uzawa-pseudo")):
            for rho in RHOS:
                record = study[Case(variant, n, rho=rho)]
                if record and record["status"] != 0:
                    height = top * (1.5 + 0.6 * place)
                    axes.plot(rho, height, "x", color=VARIANTS[variant].colour)
        axes.set_yscale("log")
        axes.set_ylim(top=3 * top)
    panels[0].set_ylabel("sweeps of 50 steps (cross: not solved)")
    figure.tight_layout()
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, ncol=4, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    save(figure, path)


def figure_error(study, path, cases):
    """True errors that the two stopping rules leave, a dot a run."""
    figure, axes = new_axes()
    for stop, colour, word in (
        ("change", ORANGE, "relative change 1e-6"), ("residual", BLUE, "residual 1e-8"),
    ):
        chosen = [
            case for case in cases
            if case.stop == stop and not case.tolerance and VARIANTS[case.variant].sweeps
            and study[case]["status"] == 0 and study[case]["error"]
        ]
        shift = 1.06 if stop == "change" else 0.94
        ended = [case for case in chosen if converged(study[case])]
        axes.plot(
            [case.n * shift for case in ended], [study[case]["error"] for case in ended],
            "o", markersize=4, alpha=0.45, markeredgewidth=0, color=colour,
            label=f"ended by a {word}",
        )
        cut = [case for case in chosen if not converged(study[case])]
        if cut:
            axes.plot(
                [case.n * shift for case in cut], [study[case]["error"] for case in cut],
                "x", markersize=5, color=RED, label="cut at 20000 sweeps a step",
            )
    axes.set_yscale("log")
    axes.yaxis.set_minor_formatter(NullFormatter())
    mesh_axis(axes, sorted({case.n for case in cases}))
    axes.set_ylabel("true error of the reactions (relative)")
    axes.legend(fontsize=7.5, ncol=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    save(figure, path)


# --- Tables -----------------------------------------------------------------------------------


def entry(study, case, text):
    """Return a cell: the text of a record, where it was not solved, or a dash."""
    record = study[case]
    if record is None:
        return "-"
    if record["status"] != 0:
        return f"stops at {record['finished'] + 1}"
    return text(record)


def seconds(value):
    """Return a time in a few digits."""
    return f"{value:.2g}" if value < 10 else f"{value:.0f}"


def mesh_table(study, meshes, stop, text, variants):
    """Return a table over the meshes, a row a solver."""
    rows = []
    for variant, rho in variants:
        rule = stop if VARIANTS[variant].sweeps else "residual"
        cases = [Case(variant, n, rho=rho, stop=rule) for n in meshes]
        rows.append([line_name(variant, rho), *(entry(study, case, text) for case in cases)])
    return [*table(["", *(f"n = {n}" for n in meshes)], rows), ""]


def rho_table(study, n, variants, mus):
    """Return a table of sweeps over rho, a row a solver and friction."""
    rows = []
    for variant, mu in itertools.product(variants, mus):
        cases = [Case(variant, n, mu, rho) for rho in RHOS]
        cells = [entry(study, case, lambda r: f"{r['iterations']}") for case in cases]
        rows.append([VARIANTS[variant].name, f"{mu:g}", *cells])
    return [*table(["", "mu", *(f"rho = {rho:g}" for rho in RHOS)], rows), ""]


def global_table(study):
    """Return the table of the global Newton's iterations at 1e-10."""
    rows = []
    for n in TIGHT:
        record = study[Case("global", n, tolerance="1e-10")]
        steps = record["finished"]
        rows.append([
            n, 3 * (n + 1) ** 2,
            f"{record['iterations'] / steps:.2f}", record["worst"],
            f"{record['products'] / steps:.0f}", seconds(record["time"]),
            f"{record['certified']} of {steps}", f"{record['error']:.0e}",
        ])
    head = ["n", "unknowns", "iterations a step", "worst step",
            "products a step", "time (s)", "certified", "true error"]
    return [*table(head, rows), ""]


# --- The page ---------------------------------------------------------------------------------


def listed(values):
    """Return values as "1, 2 and 4"."""
    words = [f"{value:g}" for value in values]
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]])) if words else "none"


def compare(study, rho, meshes):
    """Return the meshes where Uzawa needs more sweeps than Newton, and those where it does not."""
    more, fewer = [], []
    for n in meshes:
        uzawa, newton = (
            study[Case(variant, n, rho=factor, stop="change")]["iterations"]
            for variant, factor in (("uzawa", rho), ("newton", 1.0))
        )
        (more if uzawa > newton else fewer).append(n)
    return more, fewer


def unsolved(study, cases):
    """Return the cases that bipot said it could not solve."""
    return [case for case in cases if study[case]["status"] == NOT_SOLVED]


def silent(study, cases):
    """Return the cases ended by the relative change whose increments are not all certified."""
    return [
        case for case in cases
        if study[case]["status"] == 0 and study[case]["certified"] < study[case]["finished"]
    ]


def worst_error(study, cases, stop):
    """Return the smallest and the largest true error of converged sweeps ended by a rule."""
    errors = [
        study[case]["error"] for case in cases
        if case.stop == stop and VARIANTS[case.variant].sweeps and not case.tolerance
        and study[case]["status"] == 0 and converged(study[case])
    ]
    return min(errors), max(errors)


def converged(record):
    """Whether no step of sweeps ended by their largest number, 20000."""
    return record["worst"] < 20000


def uzawa_or_newton(study):
    """Return the findings about the paper's conclusion."""
    at_1, at_03 = (compare(study, rho, MESHES) for rho in (1.0, 0.3))
    ratio = {
        (n, rho): study[Case("uzawa", n, rho=rho, stop="change")]["iterations"]
        / study[Case("newton", n, stop="change")]["iterations"]
        for n in MESHES for rho in (0.3, 1.0)
    }
    low, high = (pick(ratio[n, 1.0] for n in at_1[1]) for pick in (min, max))
    growth, flat, relaxed = (
        study[Case(variant, 24, rho=rho, stop="change")]["iterations"]
        / study[Case(variant, 4, rho=rho, stop="change")]["iterations"]
        for variant, rho in (("newton", 1.0), ("uzawa", 0.3), ("relaxed", 1.0))
    )
    slow = study[Case("uzawa", 4, rho=0.1)]["iterations"] / study[Case("newton", 4)]["iterations"]
    edge = study[Case("uzawa", 4, rho=2.0)]["iterations"] / study[Case("newton", 4)]["iterations"]
    dear, cheap = (study[Case(variant, 24, stop="change")] for variant in ("newton", "uzawa"))
    visits = dear["local"] / (dear["iterations"] * 25**2)
    return [
        claim(
            at_1[0] == [1, 2] and at_03[0] == [1, 2, 4],
            "**It holds on coarse meshes, and with a poor rho.** With rho = 1 Uzawa needs more"
            f" sweeps than Newton for n = {listed(at_1[0])} ({ratio[1, 1.0]:.1f} times as many at"
            f" n = 1), with rho = 0.3 for n = {listed(at_03[0])} ({ratio[1, 0.3]:.1f} times at"
            f" n = 1). At n = 4 (residual 1e-8) it needs {slow:.1f} times the sweeps with rho = 0.1"
            f" and {edge:.1f} times with rho = 2.",
        ),
        "",
        claim(
            at_1[1] == [4, 8, 16, 24] and low > 0.85 and high < 1,
            f"**It makes no difference with rho = 1 from n = 4 on**: Uzawa takes {low:.2f} to"
            f" {high:.2f} of Newton's sweeps. One visit of Uzawa with that rho all but solves"
            " the local problem.",
        ),
        "",
        claim(
            at_03[1] == [8, 16, 24] and ratio[24, 0.3] < 0.5 and growth > 4 and flat < 1.3
            and relaxed < 2,
            f"**It reverses on fine meshes with a small rho**: with rho = 0.3 Uzawa takes"
            f" {ratio[8, 0.3]:.2f}, {ratio[16, 0.3]:.2f} and {ratio[24, 0.3]:.2f} of Newton's"
            " sweeps for n = 8, 16 and 24. What decides is not the local algorithm but how far a"
            " visit goes: to solve a point's problem exactly while its neighbours stand still goes"
            " too far, the more so the finer the mesh. From n = 4 to n = 24 Newton's sweeps grow"
            f" {growth:.1f}-fold; those of Uzawa with rho = 0.3 do not (factor {flat:.2f}), those"
            f" of Newton with relaxation 0.4 grow {relaxed:.1f}-fold.",
        ),
        "",
        claim(
            dear["time"] > cheap["time"] and visits > 1.5,
            "A sweep of Newton costs more, as the paper says: it takes"
            f" {visits:.1f} local iterations a visit at n = 24, and the sweeps of the 50 steps take"
            f" {seconds(dear['time'])} s against {seconds(cheap['time'])} s of Uzawa with"
            " rho = 1.",
        ),
    ]


def formulations(study, cases):
    """Return the findings about bi-potential against pseudo-potential."""
    pairs = [
        (study[case]["iterations"], study[other]["iterations"])
        for case in cases if case.variant == "newton"
        for other in [Case("newton-pseudo", case.n, case.mu, case.rho, case.stop)]
        if study[other] is not None
    ]
    apart = max(abs(a / b - 1) for a, b in pairs)
    counts = {
        (n, mu): {
            study[Case("newton", n, mu, rho)]["iterations"] for rho in RHOS
        } for n in (4, 8) for mu in FRICTIONS
    }
    spread = max(max(values) / min(values) - 1 for values in counts.values())
    exact = [
        abs(study[case]["iterations"] / study[Case("exact", case.n, case.mu, stop=case.stop)]
            ["iterations"] - 1)
        for case in cases
        if case.variant == "newton" and case.rho == 1 and case.n <= 16
        and study[Case("exact", case.n, case.mu, stop=case.stop)] is not None
    ]
    return [
        claim(
            apart == spread == max(exact) == 0,
            "Once the local problem is solved, nothing about it shows in the sweeps. The Newton of"
            " the bi-potential and that of the pseudo-potential take the same sweeps in"
            f" {len(pairs)} pairs of runs, rho from 0.1 to 2.5 does not change them, nor does an"
            f" exact local solution ({len(exact)} pairs). Newton's rho is no parameter to tune.",
        ),
    ]


def limits(study, cases):
    """Return the findings about rho out of range, and about runs that are not solved."""
    failed, loose = unsolved(study, cases), silent(study, cases)
    by_change = [case for case in failed if case.stop == "change"]
    bi, pseudo = (
        {rho: [case for case in cases if (case.variant, case.rho, case.stop) ==
               (variant, rho, "residual")] for rho in RHOS}
        for variant in ("uzawa", "uzawa-pseudo")
    )

    def lost(group, rho):
        return f"{len(set(group[rho]) & set(failed))} of {len(group[rho])}"

    wrong = max(study[case]["error"] for case in loose)
    return [
        claim(
            all(case.variant.startswith("uzawa") for case in failed)
            and all(case.rho >= 2 for case in failed if case.variant == "uzawa")
            and all(case.rho >= 1.5 for case in failed)
            and set(bi[2.5]) | set(pseudo[2.5]) <= set(failed),
            "**The range of Uzawa ends at 2 over the largest eigenvalue**, as"
            " [theory](../theory/paper.md), section 7, has it: up to rho = 1.5 every run of the"
            f" bi-potential reaches the residual; {lost(bi, 2.0)} runs with rho = 2 and"
            f" {lost(bi, 2.5)} with rho = 2.5 end with status 2 and a message that names the step.",
        ),
        "",
        claim(
            set(pseudo[1.5]) & set(failed) and not set(pseudo[1.0]) & set(failed),
            "**The pseudo-potential has less room**: its Uzawa, with a rho for the normal and one"
            f" for the tangents, loses {lost(pseudo, 1.5)} runs already with rho = 1.5,"
            f" {lost(pseudo, 2.0)} with 2 and {lost(pseudo, 2.5)} with 2.5. No other solver lost a"
            " run.",
        ),
        "",
        claim(
            by_change and all(case.rho >= 1.5 for case in by_change)
            and all(converged(study[case]) for case in loose) and wrong < 1e-2,
            "**With `STOP=CHANGE` such a rho ends the run as well**, with status 2, where the"
            f" sweeps of a step run off or reach their largest number (20000): {len(by_change)}"
            f" runs at n = 4. {len(loose)} more runs met their tolerance at every step, and still"
            " have steps that are not certified, of which the run warns: their changes were small"
            f" because the sweeps were slow, and reactions are wrong by up to {wrong:.0e}.",
        ),
    ]


def stopping(study, cases):
    """Return the findings about the errors the two rules leave."""
    (low, high), (small, large) = (worst_error(study, cases, stop) for stop in STOPS)
    fine = [
        study[case]["error"] for case in cases
        if case.stop == "change" and case.n >= 4 and case.mu == 0.3 and case.rho in (0.3, 1)
        and VARIANTS[case.variant].sweeps
    ]
    return [
        claim(
            high > 1e-4 and large < 1e-5,
            "**A small change is not a small error.** Sweeps that end at a relative change of 1e-6"
            f" leave reactions wrong by {low:.0e} to {high:.0e}, over all runs that stopped by it;"
            f" with mu = 0.3 and rho = 0.3 or 1, from n = 4 on, by {min(fine):.0e} to"
            f" {max(fine):.0e}. The slower the sweeps, the smaller their changes and the larger"
            f" the error. A residual of 1e-8 leaves {small:.0e} to {large:.0e}.",
        ),
    ]


def global_newton(study, cases):
    """Return the findings about the global Newton and AUTO."""
    runs = [case for case in cases if case.variant in ("global", "auto")]
    all_fine = all(
        study[case]["status"] == 0 and study[case]["certified"] == study[case]["finished"] == 50
        for case in runs
    )
    used = {code for case in runs for code in study[case]["solvers"]}
    same = all(
        study[case]["iterations"] == study[Case("global", case.n, case.mu)]["iterations"]
        for case in runs if case.variant == "auto"
    )
    tight = [study[Case("global", n, tolerance="1e-10")] for n in TIGHT]
    mean = [r["iterations"] / 50 for r in tight]
    worst = max(r["worst"] for r in tight)
    products = [r["products"] / 50 for r in tight]
    newton, relaxed, fast = (
        study[Case(name, 16)]["time"] for name in ("newton", "relaxed", "global")
    )
    rivals = [
        study[case]["time"] / study[Case("global", case.n, case.mu)]["time"] for case in cases
        if case.stop == "residual" and case.n >= 8 and study[case]["status"] == 0
        and VARIANTS[case.variant].sweeps and case.mu > 0
    ]
    # Which linear solver AUTO's 100 unknowns choose shows in the products of an iteration.
    few, many = (
        study[Case("global", n)]["products"] / study[Case("global", n)]["iterations"]
        for n in (4, 8)
    )
    return [
        claim(
            all_fine and used <= {0, 2} and same,
            f"All {len(runs)} runs of the global Newton and of AUTO are certified at every step,"
            " for every mesh and friction of the study, and nobody gave them a rho. AUTO never had"
            " to fall back: its iterations are those of the global Newton.",
        ),
        "",
        claim(
            few < 5 < many and max(mean) <= 5.5 and worst <= 12,
            f"To 1e-10 it takes {', '.join(f'{value:.2f}' for value in mean)} iterations a step for"
            f" n = {', '.join(map(str, TIGHT))}, {worst} in the worst step, and"
            f" {', '.join(f'{value:.0f}' for value in products)} products with W a step: up to 100"
            " unknown reactions its linear systems are factorised, above GMRES solves them.",
        ),
        "",
        claim(
            fast < relaxed < newton,
            f"At n = 16 and a residual of 1e-8 the 50 steps take {seconds(fast)} s in the contact"
            f" solver; Newton sweeps take {seconds(newton)} s, under-relaxed ones"
            f" {seconds(relaxed)} s.",
        ),
        "",
        claim(
            min(rivals) > 1,
            f"None of the {len(rivals)} runs of sweeps with friction that reached 1e-8 on n = 8 and"
            f" finer was as fast as the global Newton; the nearest took {min(rivals):.1f} times as"
            " long.",
        ),
    ]


PAPER_LINES = (
    ("uzawa", 1.0), ("uzawa", 0.3), ("uzawa-pseudo", 1.0), ("uzawa-pseudo", 0.3), ("newton", 1.0),
    ("newton-pseudo", 1.0), ("relaxed", 1.0), ("exact", 1.0), ("global", 1.0), ("auto", 1.0),
)


def picture(name, text):
    """Return a figure and its caption."""
    return [f"![{text}](figures/study-{name}.png)", "", text, ""]


def write_page(study, cases, path):
    """Write docs/studies/solvers.md from the records."""
    four_eight = (4, 8)
    keys = {case.key for case in cases} | {key for key in study.records if key.endswith("1e-12")}
    total = sum(study.records[key]["wall"] for key in keys)
    change = [line for line in PAPER_LINES if VARIANTS[line[0]].sweeps]
    text = [
        "# Contact solvers compared", "",
        "The paper compares Uzawa and Newton on one mesh, and leaves the pseudo-potential to"
        " further work. Here is the same block (`input/block.inp`, 50 steps, theta = 60 degrees)"
        " on meshes of n x n x n elements, with every contact solver of bipot. Written by"
        " `studies/run solvers`, numbers too; it does not write a sentence that the runs do"
        " not bear out.", "",
        "    studies/run solvers", "",
        "In what follows Uzawa and Newton are local solvers of the bi-potential, in sweeps over the"
        " points (Gauss-Seidel), unless the pseudo-potential is named; `rho` is a factor of its"
        " natural scale, 1 over the largest eigenvalue of a point's compliance. Sweeps are"
        " those of all 50 steps, mu is 0.3 and rho 1 unless said otherwise.", "",
        "## In short", "",
        "- The paper's \"Uzawa needs more iterations than Newton\" is true of coarse meshes and"
        " of a poor rho. On fine meshes a small rho or an under-relaxation needs far fewer"
        " sweeps than Newton.",
        "- Stop by the residual, not by the change of the reactions.",
        "- The default (AUTO: global Newton) needs no rho, is the fastest here with friction from"
        " n = 8 on, and its iterations hardly depend on the mesh.", "",
        "## Uzawa or Newton?", "",
        *picture("mesh", "Sweeps over the mesh, ended by a relative change of 1e-6 as in the"
                 " paper; iterations of the global Newton to a residual of 1e-8."),
        *uzawa_or_newton(study), "",
        "Sweeps, ended by a relative change of 1e-6:", "",
        *mesh_table(study, MESHES, "change", lambda r: r["iterations"], change),
        "Local iterations of the same runs (a visit of Uzawa counts one; of the exact solution,"
        " the evaluations of the law), in thousands:", "",
        *mesh_table(study, MESHES, "change", lambda r: f"{r['local'] / 1000:.0f}", change),
        "## Bi-potential or pseudo-potential?", "",
        *formulations(study, cases), "",
        "## What rho does to Uzawa", "",
        *picture("rho", "Sweeps to a residual of 1e-8 over rho, mu = 0.3. Crosses: not solved."),
        *limits(study, cases), "",
    ]
    for n in four_eight:
        text += [
            f"Sweeps to a residual of 1e-8, n = {n} (\"stops at k\": status 2 at increment k):", "",
            *rho_table(study, n, ("uzawa", "uzawa-pseudo", "newton"), FRICTIONS),
        ]
    text += [
        "## When to stop", "",
        *picture("error", "True error of the reactions (largest difference from the global Newton"
                 " at 1e-12, over the largest reaction of the step; worst step), a dot a run."),
        *stopping(study, cases), "",
        "True error after a relative change of 1e-6:", "",
        *mesh_table(study, MESHES, "change", lambda r: f"{r['error']:.0e}", change),
        "## All points at once", "",
        *picture("time", "Time in the contact solver, 50 steps to a residual of 1e-8."),
        *global_newton(study, cases), "",
        "Global Newton to a residual of 1e-10:", "",
        *global_table(study),
        "Sweeps or iterations, and seconds in the contact solver, to a residual of 1e-8:", "",
        *mesh_table(
            study, MESHES, "residual",
            lambda r: f"{r['iterations']}, {seconds(r['time'])} s", PAPER_LINES,
        ),
        "Products with the compliance W in the same runs (a sweep is one):", "",
        *mesh_table(study, MESHES, "residual", lambda r: r["products"], PAPER_LINES),
        "## What was run", "",
        f"{len(keys)} runs, {total / 60:.0f} minutes in all, one at a time with one BLAS"
        f" thread, on a shared {study.facts['machine']}: times to compare, not to quote (AUTO and"
        " global Newton do the same work: their times differ by what else the machine did)."
        " Not a full product. All meshes with mu = 0.3 and rho = 1, and Uzawa with 0.3; all mu"
        " and rho on n = 4 and 8. Left out as too slow: at n = 24 every sweep variant but those in"
        " the tables; at n = 8, `STOP=CHANGE` with other rho than 1 and 0.3.", "",
        "One of the runs by hand:", "",
        f"    {command_text(Case('uzawa', 8, rho=0.3, stop='change').parameters)}", "",
        "`RELAXATION=0.4` is no parameter of that deck: the script puts it on its"
        " `*CONTACT SOLVER` line.",
    ]
    page = solver_elements.with_section(
        "\n".join(text) + "\n", solver_elements.section(solver_elements.read_kept()))
    path.write_text(page, encoding="utf-8")
    print(path)


def write_figures(study, cases, folder):
    """Draw all figures from the records."""
    folder.mkdir(parents=True, exist_ok=True)
    meshes = sorted({case.n for case in cases})
    panels = [n for n in (4, 8) if n in meshes] or meshes[-1:]
    for name, shown in OVER_MESHES.items():
        figure_over_meshes(study, folder / f"study-{name}.png", meshes, shown)
    figure_rho(study, folder / "study-rho.png", panels)
    figure_error(study, folder / "study-error.png", cases)


def write_tables(study, meshes, path):
    """Write the tables alone: what a quick study has to show."""
    text = ["Sweeps or iterations, certified steps, true error, to a residual of 1e-8:", ""]
    text += mesh_table(
        study, meshes, "residual",
        lambda r: f"{r['iterations']}, {r['certified']}, {r['error']:.0e}", MESH_PAIRS,
    )
    path.write_text("\n".join(text), encoding="utf-8")
    print(path)


MESH_PAIRS = tuple((variant, rho) for variant, rho, _ in MESH_LINES)


def command_line():
    """Return the command line's options."""
    where = ROOT / "build" / "study"
    parser = script_options(__doc__, where, "the numbers of the runs are kept")
    parser.add_argument("--docs", type=Path, default=PAGES, help="where the page goes")
    parser.add_argument(
        "--quick", action="store_true",
        help="seconds instead of minutes: two meshes, tables and figures into the -o folder",
    )
    parser.add_argument(
        "--redraw", action="store_true",
        help="run nothing: page and figures from the runs kept, whatever program made them",
    )
    return parser.parse_args()


def main():
    """Run what is missing and write the page."""
    options = command_line()
    study = Study(options.bipot.resolve(), options.folder)
    cases = design(options.quick)
    try:
        if options.redraw:
            absent = [case.key for case in cases if study[case] is None]
            if absent:
                raise StudyError(f"{len(absent)} runs are missing, the first: {absent[0]}")
        else:
            built_program(options.bipot)
            study.check_program()
            study.complete(cases)
        if options.quick:
            write_figures(study, cases, options.folder)
            write_tables(study, sorted({c.n for c in cases}), options.folder / "tables.md")
        else:
            write_figures(study, cases, options.docs / "figures")
            write_page(study, cases, options.docs / "solvers.md")
    except (StudyError, RunError) as error:
        sys.exit(f"solvers: {error}")
    except KeyboardInterrupt:
        sys.exit("solvers: stopped; the same command goes on from here")


if __name__ == "__main__":
    main()
