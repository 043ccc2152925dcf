"""Scenes of users at their price: time, plan, estimate and certificate, beside CalculiX.

    studies/run user_scenes [--finds FOLDER] [--examples FOLDER] [--only NAME;...] [--limit 60]
    studies/run user_scenes --page [-o docs/studies/user-scenes.md]

Decks that users wrote, or would: those of `requires`, the tutorial's, those of a folder of finds,
and public ones of a clone of calculix/examples. What is not here is left out, and its row stays as
it was. Each runs once, with one thread and at most `--limit` seconds of the processor, and
CalculiX, where it can be given the scene, up to ten times ours. Rows are kept in
studies/data/user_scenes.csv; the page is made from that file, with --page alone.
"""

import csv
import itertools
import math
import re
import shutil
import statistics
import sys
import tempfile
import textwrap
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from bipot.errors import RunError
from bipot.peers.calculix_deck import (
    NODES,
    SURFACES,
    Penalty,
    check_translatable,
    deck_lines,
    read_resultants,
)
from bipot.peers.flat_deck import DeckError, read_flat
from bipot.peers.runs import (
    CCX,
    TENSIONS,
    PeerError,
    default_penalty,
    error_of,
    largest_pressure,
    measure,
    resultants,
)
from bipot.program import ROOT, built_program, program_options, run_words
from bipot.report import machine, table
from bipot.result import Result, ResultError
from bipot.tradeoff_settings import PLANNED, seconds_in
from studies.pages import DATA, PAGES, put_page
from studies.requires import SCENES as ASKING
from studies.solid_meshes import SolidMesh

KEPT = DATA / "user_scenes.csv"
PAGE = PAGES / "user-scenes.md"
SETTLED = 0.01  # of the largest force: what ten times the penalty changes, of one that is enough
RAISED = range(-1, 4)  # powers of ten of the penalty that suits a scene
SLOWER = 10.0   # times ours, after which CalculiX is stopped
SHORT = 2.0     # seconds that it has in any case
FINDS = (
    "o_ring", "bracket_bolt_head", "press_fit_C3D20", "dry_bricks_estimate", "dry_bricks_finite",
    "capstan_second_order", "tower_100_blocks", "tower_200_blocks", "planes_100", "planes_300",
    "cost_block_alone", "cost_unloaded_body", "cost_pair_out_of_reach", "cost_stiff_body_as_rigid",
    "cost_nlgeom_tiny_strain", "cost_first_increment_fixed", "slow_refusal", "plan_out_of_reach",
    "products_finite_strain_free_body",
    "accuracy_cost_plate_under_ball", "accuracy_cost_v_groove",
)  # fmt: skip
EXAMPLES = (
    "yahoo/Bolt_mm", "yahoo/Boltedjoint", "ccx/test/contact2", "yahoo/eigen",
    "launcher/cont/clamp/_cl", "launcher/cont/dring/_dring", "launcher/cont/wavespring/_ws",
    "other/gears",
)  # fmt: skip
STRANGER = DATA / "from_pages"  # decks made from the user's pages alone
TUTORIAL = ("foot", "bracket", "oring")


HEAD = """By `studies/run user_scenes`: decks that users wrote or would write. CPU time in seconds,
with one thread, {machine}, one run each, on a machine that others used too. `from`: `finds` are
decks of our own that are not in the repository, `requires` is [that study](requires.md), `pages`
are five decks made from the user's pages alone (studies/data/from_pages). `ended` says where a run
was stopped. `iterations`: of an increment, on bodies and contact together. `estimate` and
`certificate`: percent of the time. `plan`: the seconds that the plan predicts, or its first
increments where they correct it. `CalculiX`: its time with the lowest penalty, by powers of ten,
from which a tenfold one changes its forces by less than 1 %; stopped at {slower} times our time it
counts as that. It runs public decks as they stand. `Gflop` and `GB` are lower bounds: the
operations of all factorisations, and the bytes of the factor that all solutions read. An accuracy,
where one is asked for, is 10 %."""
MISSES = """
## What misses its aim, and why

**Slower than CalculiX**: towers of loose blocks (27 times slower), dry stones, a scene of 0.06 s,
and `contact2`, curved faces of second order (9.8 s for 1.6). A tower is one contact problem of
all bodies, with dense algebra over 6 motions of each: half of the time of 200 blocks is
orthonormal bases of these and of what contact cannot see, made anew in every placement. 25, 50
and 100 blocks take 0.41, 0.73 and 3.4 s, exponents of 0.8 and 2.2; 200 do not end within 5
minutes on a machine that others use. 100 and 200 planes take 2.5 and 11 s (2.1) and 690 MB and
2.4 GB: `W` is formed over 7,500 and 15,000 rows, though its rank is 75. Wanted were exponents of
1.5.

**Estimate over half of the run**: decks of fewer than 8 increments a `*STEP`, whose error by load
steps is found by halves of them, two solutions for one: 2/3 of what contact takes. What was tried
to make it less estimates a wrong error. Halves that begin at the run's own end gave 2e-8 of
`dry_bricks_estimate` (0.027 % before; 0.02 % by 8 increments). Doubles in the `*STEP` of 10
increments of `dry_bricks_finite` took 1.5 for 3.9 s, and gave 0.0011 % of a true 0.23 %; added to
what halves gave for the `*STEP` before, 3.8 %. Halves give 0.41 %. A block of rubber, n = 24 (10
increments a `*STEP`, in doubles) has 11 %, with n = 16 17 %.

**Certificate over 15 %**: scenes whose increments are nearly free, with one factor (22 % at most).

**Plan**: too short for scenes of less than half a second, whose friction turns (a wedge, a corner),
and for 50 increments of a block (2.4 times, beside others on the machine); `contact2` says 19 s
after its third increment and takes 9.8; what it is of decks that were stopped is not known.

**Not in the table**: 300 planes (4.6 GB), two plates of 5,041 points, and a bracket of second-order
tetrahedra with 200,000 equations. Boltedjoint, eigen, `_cl`, `_dring`, `_ws` and gears are rows of
an earlier build, which was stopped after 15 s.

## Scenes from the user's pages alone

Made in one go from docs/, and shown as they came out. Three of five were refused at first, each
with its line and what is expected: a `*BLOCK` has no C3D10 or C3D20 (their meshes come from the
study now, as a mesher would make them), weight of a body without `*DENSITY`, and a plane as the
housing of a bush of revolution, which is a `CYLINDER, INNER`. Then all five were solved and
certified. Notes that came: nodes of the press fit overlap before the first step and are pressed
out; CAX4 is too stiff for this rubber, CAX8R is not.
"""


@dataclass
class Row:
    """What a run took; what is not known is nan."""

    scene: str
    source: str
    ended: str              # the exit status in words
    equations: float = math.nan
    points: float = math.nan
    increments: float = math.nan
    iterations: float = math.nan   # of an increment, on bodies and contact
    seconds: float = math.nan      # of the processor
    estimate: float = math.nan     # part of the time
    certificate: float = math.nan  # likewise
    planned: float = math.nan      # seconds
    gflop: float = math.nan        # of the factors
    gbytes: float = math.nan       # of factors read for solutions
    calculix: float = math.nan     # seconds
    beside: str = ""               # what there is to say of CalculiX

    @property
    def ratio(self):
        """CalculiX's time over ours."""
        return self.calculix / self.seconds


@dataclass
class Scene:
    """A deck, its settings and options; `write(folder)` gives its path."""

    name: str
    source: str
    write: object
    settings: dict
    options: tuple = ()
    is_public: bool = False  # CalculiX takes it as it is


def all_scenes(finds, examples):
    """Return the scenes whose decks are here."""
    def one(path):
        return lambda _: path

    found = []
    for name in FINDS if finds else ():
        path = finds / f"{name}.inp"
        options = ("--accuracy", "0.1") if name.startswith("accuracy") else ()
        if path.is_file():
            found.append(Scene(name, "finds", one(path), {}, options))
    found += [Scene(of.name, "requires", of.deck, of.settings) for of in ASKING]
    found += [Scene(name, "tutorial", one(ROOT / "docs" / "tutorial" / f"{name}.inp"), {})
              for name in TUTORIAL]
    found += [Scene(path.stem, "pages", with_meshes(path), {})
              for path in sorted(STRANGER.glob("*.inp"))]
    for name in EXAMPLES if examples else ():
        path = examples / f"{name}.inp"
        if path.is_file():
            found.append(Scene(name, "calculix/examples", one(path), {}, is_public=True))
    return found


def with_meshes(path):
    """Return what writes a deck with its lines `** mesh NAME, type, x, y, z, sizes, counts`.

    Each is a box of elements of a type that a *BLOCK does not have, with its sides as sets.
    """
    def write(folder):
        first = 1
        lines = []
        for line in path.read_text("ascii").splitlines(keepends=True):
            if not line.startswith("** mesh "):
                lines.append(line)
                continue
            name, kind, *numbers = line.removeprefix("** mesh ").split(",")
            begin, size, count = ([float(word) for word in numbers[k:k + 3]] for k in (0, 3, 6))
            axes = [[x + width * i / n for i in range(int(n) + 1)]
                    for x, width, n in zip(begin, size, count, strict=True)]
            box = SolidMesh(name, kind.strip(), axes, first)
            first += max(len(box.x), len(box.elements))
            lines.append(box.cards())
            for axis, end in itertools.product(range(3), range(2)):
                side = f"{name}-{'XYZ'[axis]}{('MIN', 'MAX')[end]}"
                lines.append(box.set_cards(side, box.nodes(axis, end)))
        deck = folder / path.name
        deck.write_text("".join(lines), "ascii")
        return deck
    return write


def run_scene(program, scene, limits, folder):
    """Run a scene here and in CalculiX, each within its seconds; return its row."""
    limit, most = limits
    deck = scene.write(folder).resolve()
    is_set = re.search(r"^\*PARAMETER", deck.read_text("utf-8", "replace"), re.MULTILINE | re.I)
    settings = scene.settings if is_set else {}
    path, log = folder / "result.vtkhdf", folder / "log"
    command = [word for word in run_words(program, deck, path, settings) if word != "--quiet"]
    taken = measure([*command, "--verbose", *scene.options], folder, log,
                    lambda seconds: seconds > limit)
    text = log.read_text(encoding="utf-8", errors="replace")
    row = Row(scene.name, scene.source, ended_in_words(taken, limit, text), seconds=taken.seconds)
    if not scene.options:  # else the plan is that of the first of many runs
        read_log(text, row)
    try:
        with Result(path) as result:
            read_counters(result, row)
            if taken.status == 0 and not scene.options:
                beside_calculix(program, scene, (deck, settings), result, row, (most, folder))
    except (ResultError, RunError, OSError):
        pass
    return row


def ended_in_words(taken, limit, text):
    """Return how a run ended."""
    if taken.stopped:
        return f"over {limit:g} s"
    if taken.status == 0:
        return "solved"
    lines = [line for line in text.splitlines() if "error:" in line] or text.splitlines()[-1:]
    words = lines[0].split("error: ", 1)[-1] if lines else ""
    return f"status {taken.status}: {words[:120]}"


def read_log(text, row):
    """Take from what a run says what its result does not have: the plan's time."""
    planned = PLANNED.search(text)
    if planned:
        row.planned = seconds_in(planned[1])
    corrected = re.search(r"the run takes about (.*?) of CPU time, not the plan", text)
    if corrected:
        row.planned = seconds_in(corrected[1])
    each = re.search(r"([\d.e+]+) (G|M|T)flop per factorisation", text)
    if each:
        row.gflop = float(each[1]) * {"M": 1e-3, "G": 1.0, "T": 1e3}[each[2]]
    for name, pattern in (("equations", r"^equations +\S+ +(\d+)"),):
        found = re.search(pattern, text, re.MULTILINE)
        if found:
            setattr(row, name, float(found[1]))


def read_counters(result, row):
    """Take what a result counts."""
    counters = result.counters
    if not counters["increments"]:
        return
    row.equations, row.points = counters["equations"], counters["contact_points"]
    row.increments = counters["increments"]
    both = counters["newton_raphson_iterations"] + counters["contact_iterations"]
    row.iterations = both / max(1.0, row.increments)
    whole = max(counters["seconds_total"], 1e-9)
    row.estimate = counters["seconds_estimate"] / whole
    row.certificate = counters["seconds_certify"] / whole
    row.gflop *= counters["factorisations"]
    row.gbytes = 2 * 8e-9 * counters["factor_entries"] * counters["solutions"]


def beside_calculix(program, scene, given, result, row, where):
    """Take CalculiX's time, or why there is none."""
    limit, folder = where
    most = min(limit, max(SHORT, SLOWER * row.seconds))
    deck, settings = given
    if scene.is_public:
        shutil.copy(deck, folder / "peer.inp")
        taken = measure([CCX, "-i", "peer"], folder, folder / "peer.log",
                        lambda seconds: seconds > most)
        row.calculix, row.beside = taken.seconds, "as it stands"
        if taken.stopped:
            row.calculix, row.beside = math.inf, "stopped"
        elif taken.status != 0:
            row.calculix, row.beside = math.nan, f"ends with status {taken.status}"
        count_stopped(row, most)
        return
    try:
        flat = read_flat(program, deck, settings)
        check_translatable(flat)
        flat.take_mesh(result)
        row.calculix, row.beside = settled_penalty(flat, result, most, folder)
    except (DeckError, PeerError, RunError, KeyError, ValueError) as error:
        row.beside = str(error).splitlines()[0][:100]
        return
    count_stopped(row, most)


def count_stopped(row, most):
    """Take ten times our time for a run of CalculiX that was stopped then; none if before."""
    if math.isinf(row.calculix):
        row.calculix = SLOWER * row.seconds if most >= SLOWER * row.seconds else math.nan
        row.beside += f" at {most:.3g} s"


def settled_penalty(flat, result, most, folder):
    """Return the seconds of the least penalty beyond which forces settle, and what it is.

    Infinite: stopped; nan: it ends without a solution.
    """
    kind = SURFACES if flat.has_two_surfaces else NODES
    wanted = resultants(result, flat)
    tensions = TENSIONS if flat.pairs and kind == NODES else TENSIONS[:1]
    before = seconds = None
    for power in RAISED if flat.pairs else (0,):
        stiffness = default_penalty(flat, result) * 10.0**power if flat.pairs else 0.0
        for tension in tensions:
            law = Penalty(stiffness, stiffness / 10, tension * largest_pressure(result), kind)
            taken, forces = run_ccx(deck_lines(flat, law), flat.n_forces, most, folder)
            if len(forces) == len(wanted) or taken.stopped:
                break
        if taken.stopped:
            return math.inf, f"stopped with K = {stiffness:.0e}"
        if len(forces) < len(wanted):
            if before is None:
                continue
            return math.nan, f"ends with K = {stiffness:.0e}"
        if not flat.pairs:
            return taken.seconds, "no contact"
        if before is not None and error_of(forces, before[0]) < SETTLED:
            return seconds, f"K = {before[1]:.0e}"
        before, seconds = (forces, stiffness), taken.seconds
    return math.nan, "no penalty settles" if before else "finds no solution"


def run_ccx(lines, n_forces, most, folder):
    """Run ccx on a deck; return what it took, and its forces."""
    for old in folder.glob("peer.*"):
        old.unlink()
    (folder / "peer.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
    taken = measure([CCX, "-i", "peer"], folder, folder / "peer.log",
                    lambda seconds: seconds > most)
    return taken, read_resultants(folder / "peer.dat", n_forces)


def read_kept():
    """Return the rows that are kept, by scene."""
    if not KEPT.is_file():
        return {}
    with KEPT.open(encoding="utf-8", newline="") as file:
        return {line["scene"]: Row(**{
            of.name: line[of.name] if of.type is str else float(line[of.name] or "nan")
            for of in fields(Row)}) for line in csv.DictReader(file)}


def keep(row):
    """Put a row in the place of that of its scene."""
    rows = read_kept() | {row.scene: row}
    with KEPT.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [of.name for of in fields(Row)], lineterminator="\n")
        writer.writeheader()
        for one in rows.values():
            writer.writerow({name: value if isinstance(value, str) else
                             "" if math.isnan(value) else f"{value:.4g}"
                             for name, value in asdict(one).items()})


def cell(value, scale=1.0):
    """Return a number in words, `-` where there is none."""
    if math.isnan(value):
        return "-"
    return f"{scale * value:.0f}" if scale * value >= 100 else f"{scale * value:.3g}"


def spread(values):
    """Return the median and the largest of some numbers, in words."""
    values = [value for value in values if not math.isnan(value)]
    if not values:
        return "-"
    return f"{statistics.median(values):.2g} in the median, {max(values):.2g} at most"


def findings(rows):
    """Return what the rows show, beside what is wanted."""
    solved = [row for row in rows if row.ended == "solved"]
    ratios = [row.ratio for row in solved if not math.isnan(row.calculix)]
    plans = [row.planned / row.seconds for row in solved if row.seconds >= 0.5
             and not math.isnan(row.planned)]
    within = sum(0.5 <= plan <= 2 for plan in plans)
    found = [
        f"- {len(solved)} of {len(rows)} are solved within the limit.",
        f"- CalculiX's time over ours, of {len(ratios)} scenes that it solves or was stopped in: "
        f"{statistics.median(ratios):.2g} in the median, {min(ratios):.2g} at least (wanted: 5 and "
        "1)." if ratios else "- CalculiX solved none.",
        f"- The plan is within a factor 2 of the time in {within} of {len(plans)} that take 0.5 s "
        "and more.",
        f"- Part of the estimate of errors: {spread([row.estimate for row in solved])} (wanted: "
        f"0.5); of the certificate: {spread([row.certificate for row in solved])} (wanted: 0.15).",
    ]
    return [line for words in found for line in textwrap.wrap(words, 88, subsequent_indent="  ")]


def page(rows):
    """Return the page as Markdown."""
    lines = [[row.scene, row.source, row.ended, cell(row.equations), cell(row.points),
              cell(row.increments), cell(row.iterations), cell(row.seconds),
              cell(row.estimate, 100.0), cell(row.certificate, 100.0), cell(row.planned),
              cell(row.calculix), cell(row.ratio), cell(row.gflop), cell(row.gbytes), row.beside]
             for row in rows]
    return "\n".join([
        "# Scenes of users at their price", "",
        *textwrap.wrap(HEAD.format(machine=machine(), slower=f"{SLOWER:g}"), 98), "",
        *findings(rows), "",
        *table(["scene", "from", "ended", "equations", "points", "increments", "iterations", "s",
                "estimate, %", "certificate, %", "plan, s", "CalculiX, s", "over ours", "Gflop",
                "GB", "CalculiX: with, or why not"], lines), "",
        *MISSES.strip().splitlines(), "",
    ])


def main():
    """Run what is asked for and is here, and write data and page."""
    options = program_options(__doc__)
    options.add_argument("-o", dest="page", type=Path, default=PAGE, help="write the page here")
    options.add_argument("--finds", type=Path, help="a folder of decks of our own")
    options.add_argument("--examples", type=Path, help="a clone of calculix/examples")
    options.add_argument("--only", default="", help="scenes, by parts of their names")
    options.add_argument("--limit", type=float, default=60.0, help="seconds of a run")
    options.add_argument("--beside", type=float, default=600.0, help="the same of CalculiX")
    options.add_argument("--page", dest="page_alone", action="store_true", help="no runs")
    options = options.parse_args()
    if not options.page_alone:
        program = built_program(options.bipot.resolve())
        for scene in all_scenes(options.finds, options.examples):
            if not any(part in scene.name for part in options.only.split(";")):
                continue
            with tempfile.TemporaryDirectory() as folder:
                row = run_scene(program, scene, (options.limit, options.beside), Path(folder))
            keep(row)
            print(*asdict(row).values(), sep=" | ", file=sys.stderr, flush=True)
    put_page(page(list(read_kept().values())), options.page)


if __name__ == "__main__":
    main()
