"""How far small strain is off, by `--theory` and by NLGEOM: docs/theory-error.md.

    studies/run theory_error [-o docs/theory-error.md] [--only NAME,...]
    studies/run theory_error --asked [-o docs/theory-error.md] [--only NAME,...]
    studies/run theory_error --page

Every scene is run by small strain with and without `--theory`, and at finite strain with the laws
of St Venant and Kirchhoff and of neo-Hooke. Errors at the ends of steps go into
studies/data/theory_error.csv, in place of older ones; page and figure are made from that file, with
--page alone. With --asked the scenes that accuracies are asked of are run, and go into
studies/data/theory_asked.csv. All runs have one thread. Some three minutes, and as many.
"""

import csv
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bipot.figures import BLUE, INK, ORANGE, new_axes, save
from bipot.program import ROOT, built_program, program_options
from bipot.report import machine
from bipot.result import Result
from studies.pages import DATA, claim, put_page, table

KEPT = DATA / "theory_error.csv"
KEPT_ASKED = DATA / "theory_asked.csv"
PAGE = ROOT / "docs" / "theory-error.md"
FIGURE = ROOT / "docs" / "studies" / "figures" / "theory-error.png"
LAWS = {"svk": "St Venant-Kirchhoff", "neo": "neo-Hooke"}
HUGE = 1e300
RESOLVED = 1e-4  # of the forces: less is left to the tolerance of contact in the runs
ALLOWED = 0.01   # what AUTO allows where no accuracy is asked for

FLOOR = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"


def bodies(*each, young=1000.0, nu=0.3, more=""):
    """Return the cards of blocks of one material: name, low corner, size, elements, element."""
    cards = "".join(
        f"*BLOCK, NAME={name}, ELSET={name}, TYPE={kind}, NX={n[0]}, NY={n[1]}, NZ={n[2]}\n"
        f"{', '.join(map(str, low))}, {', '.join(map(str, size))}\n"
        for name, low, size, n, kind in each)
    names = "\n".join(name for name, *_ in each)
    return (f"{cards}*MATERIAL, NAME=M\n*ELASTIC\n{young}, {nu}\n{more}"
            f"*ELSET, ELSET=ALL\n{names}\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n")


def pairs(mu, *each):
    """Return the cards of contact pairs with one friction."""
    friction = f"*FRICTION\n{mu}\n" if mu else ""
    return f"*SURFACE INTERACTION, NAME=I\n{friction}" + "".join(
        f"*CONTACT PAIR, INTERACTION=I\n{slave}, {master}\n" for slave, master in each)


def steps(*each):
    """Return steps: of each the number of increments and the lines of its cards."""
    return "".join(f"*STEP\n*STATIC, DIRECT\n{1 / n!r}, 1.\n{lines}*END STEP\n"
                   for n, lines in each)


def pressed(down, n=(3, 3, 3), size=(1.0, 1.0, 1.0), side=None, mu=0.3, kind="C3D8", more="",
            heat="", counts=(6, 6)):
    """Return a block or column that its clamped top presses on a plane and, if at all, pushes."""
    top = f"*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, {-down!r}\n{heat}"
    push = [] if side is None else [(counts[1], f"*BOUNDARY\nB-ZMAX, 1, 1, {side!r}\n")]
    return (bodies(("B", (0, 0, 0), size, n, kind), more=more) + FLOOR
            + pairs(mu, ("B-ZMIN", "FLOOR")) + steps((counts[0], top), *push))


def column(share, side=0.0):
    """Return a column of 20 by 1 with that share of Euler's load, its foot held by friction."""
    strain = (2 * math.pi / 20) ** 2 / 12
    return pressed(share * strain * 20, (2, 2, 20), (1.0, 1.0, 20.0), side or None, 0.5, "C3D8I")


def indented(depth, size, n, radius, clamp, mu=0.3, kind="C3D8I"):
    """Return a block or plate that a rigid ball presses into its upper face."""
    middle = f"{size[0] / 2}, {size[1] / 2}, {size[2] + radius}"
    held = "".join(f"{surface}, 1, 3\n" for surface in clamp)
    return (bodies(("B", (0, 0, 0), size, n, kind))
            + f"*NODE, NSET=R\n9999999, {middle}\n"
            + f"*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=9999999\n{middle}, {radius}\n"
            + pairs(mu, ("B-ZMAX", "BALL"))
            + steps((6, f"*BOUNDARY\n{held}9999999, 1, 2\n9999999, 3, 3, {-depth!r}\n")))


def cantilever(down):
    """Return a beam of 10 by 1 whose tip a rigid cylinder presses down."""
    return (bodies(("B", (0, 0, 0), (10.0, 1.0, 1.0), (10, 1, 2), "C3D8I"))
            + "*NODE, NSET=R\n9999999, 9., 0., 3.\n"
            + "*OBSTACLE, NAME=ROLL, TYPE=CYLINDER, REF NODE=9999999\n9., 0., 3., 0., 1., 0., 2.\n"
            + pairs(0.3, ("B-ZMAX", "ROLL"))
            + steps((8, f"*BOUNDARY\nB-XMIN, 1, 3\n9999999, 1, 2\n9999999, 3, 3, {-down!r}\n")))


def stacked(down, ratio=1.0, mu=0.3):
    """Return two blocks, of which the upper one is pressed on the lower one and pushed."""
    upper = ("HIGH", (0.2, 0.2, 1.0), (0.8, 0.8, 0.6), (3, 3, 2), "C3D8")
    lower = ("LOW", (0, 0, 0), (1.0, 1.0, 1.0), (2, 2, 2), "C3D8")
    cards = bodies(upper, young=1000.0 * ratio)
    for word in ("NAME=M", "MATERIAL=M", "ELSET=ALL"):
        cards = cards.replace(word, f"{word}2")
    return bodies(lower) + cards + pairs(mu, ("HIGH-ZMIN", "LOW-ZMAX")) + steps(
        (5, f"*BOUNDARY\nLOW-ZMIN, 1, 3\nHIGH-ZMAX, 1, 2\nHIGH-ZMAX, 3, 3, {-down!r}\n"),
        (5, f"*BOUNDARY\nHIGH-ZMAX, 1, 1, {down!r}\n"))


def beside(down, other, upwards=False):
    """Return two cubes on a plane: one pressed, the other pressed otherwise, or only pulled."""
    two = [("B", (0, 0, 0), (1.0, 1.0, 1.0), (3, 3, 3), "C3D8"),
           ("C", (3, 0, 0), (1.0, 1.0, 1.0), (3, 3, 3), "C3D8")]
    touch = [("B-ZMIN", "FLOOR")] + ([] if upwards else [("C-ZMIN", "FLOOR")])
    held = "C-ZMIN, 1, 3\n" if upwards else ""
    return bodies(*two) + FLOOR + pairs(0.3, *touch) + steps(
        (5, f"*BOUNDARY\n{held}B-ZMAX, 1, 2\nB-ZMAX, 3, 3, {-down!r}\nC-ZMAX, 1, 2\n"
            f"C-ZMAX, 3, 3, {other if upwards else -other!r}\n"))


def warmed(by):
    """Return a block that is warmed between a plane and its clamped top."""
    return pressed(0.001, more="*EXPANSION\n1e-4\n", heat=f"*TEMPERATURE\nB, {by}\n")


def turned(angle):
    """Return a block on a plane whose top turns about the vertical and goes down."""
    return (bodies(("B", (0, 0, 0), (1.0, 1.0, 1.0), (3, 3, 3), "C3D8"))
            + "*NODE, NSET=R\n9999999, 0.5, 0.5, -1.\n"
            + "*OBSTACLE, NAME=FLOOR, TYPE=PLANE, REF NODE=9999999\n0., 0., 0., 0., 0., 1.\n"
            + pairs(0.3, ("B-ZMIN", "FLOOR"))
            + steps((5, "*BOUNDARY\n9999999, 1, 6\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.02\n"),
                    (5, f"*BOUNDARY\n9999999, 6, 6, {angle!r}\n")))


def from_input(name):
    """Return a deck of input/ that includes what it does from anywhere."""
    text = (ROOT / "input" / f"{name}.inp").read_text(encoding="utf-8")
    return text.replace("INPUT=meshes/", f"INPUT={ROOT / 'input' / 'meshes'}/")


def stretched(down):
    """Return a strip that is stretched by 0.3 % while a cylinder bends it."""
    return (bodies(("B", (0, 0, 0), (16.0, 1.0, 0.4), (20, 1, 1), "C3D8I"))
            + "*NODE, NSET=R\n9999999, 8., 0.5, 2.4\n"
            + "*OBSTACLE, NAME=ROLL, TYPE=CYLINDER, REF NODE=9999999\n"
            + "8., 0.5, 2.4, 0., 1., 0., 2.\n"
            + pairs(0.2, ("B-ZMAX", "ROLL"))
            + steps((8, "*BOUNDARY\nB-XMIN, 1, 3\nB-XMAX, 2, 3\nB-XMAX, 1, 1, 0.05\n"
                        f"9999999, 1, 2\n9999999, 3, 3, {-down!r}\n")))


SCENES = {
    **{f"block, {100 * d:g} %": pressed(d, side=2 * d)
       for d in (0.001, 0.003, 0.01, 0.03, 0.06, 0.1)},
    "block of 0.1 %, n = 4": pressed(0.001, (4, 4, 4), side=0.002, counts=(10, 40)),
    **{f"block of 1 %, n = {n}": pressed(0.01, (n, n, n), side=0.02, counts=(10, 40))
       for n in (8, 16)},
    **{f"ball into a block, {d:g}": indented(d, (1.0, 1.0, 0.6), (6, 6, 4), 1.0, ("B-ZMIN",))
       for d in (0.01, 0.03, 0.08)},
    **{f"column 6:1, down {d:g}": pressed(d, (2, 2, 12), (1.0, 1.0, 6.0), 0.02, 0.5)
       for d in (0.01, 0.05, 0.1)},
    **{f"column 20:1, {s:g} Euler": column(s) for s in (0.4, 0.8)},
    "column 20:1, 0.5 Euler, pushed": column(0.5, 0.1),
    **{f"column 20:1, {s:g} Euler": column(s) for s in (1.2, 2.4)},
    **{f"cantilever 10:1, tip {d:g}": cantilever(d) for d in (0.05, 0.1, 0.5, 1.5)},
    **{f"plate 20:1, {d / 0.5:g} t": indented(d, (10.0, 10.0, 0.5), (12, 12, 2), 3.0,
                                             ("B-XMIN", "B-XMAX", "B-YMIN", "B-YMAX"), 0)
       for d in (0.05, 0.15, 0.3)},
    **{f"two blocks, {d:g}": stacked(d) for d in (0.01, 0.05)},
    "soft on stiff, 0.05": stacked(0.05, 0.1),
    "stiff on soft, 0.05": stacked(0.05, 10.0),
    **{f"stretched strip, {d:g}": stretched(d) for d in (0.05, 0.4)},
    "light beside heavy": beside(0.04, 0.001),
    "pulled beside pressed": beside(0.04, 0.03, True),
    "warmed by 1 %": warmed(100.0),
    "warmed by 0.1 %": warmed(10.0),
    "turned plane, 0.1 rad": turned(0.1),
    "punch (input/indent)": from_input("indent"),
    "roller (input/roller)": from_input("roller"),
    "cylinder (input/cylinder)": from_input("cylinder"),
    "stack (input/stack)": from_input("stack"),
}
WANTED = (0.1,)
FINER = 5  # times as accurate as is asked: the truth of an accuracy, at finite strain
SVK, NEO = "SVK", "NEO HOOKE"
# Scenes that accuracies are asked of: deck and law, None where it is left open.
ASKED = {
    "block, 0.3 %": (pressed(0.003, side=0.006), NEO),
    "block, 1 %": (pressed(0.01, side=0.02), SVK),
    "block, 1 %, law open": (pressed(0.01, side=0.02), None),
    "block, 3 %": (pressed(0.03, side=0.06), NEO),
    "block, 10 %, law open": (pressed(0.1, side=0.2), None),
    "column 6:1, down 0.05": (pressed(0.05, (2, 2, 12), (1.0, 1.0, 6.0), 0.02, 0.5), SVK),
    "column 6:1, law open": (pressed(0.01, (2, 2, 12), (1.0, 1.0, 6.0), 0.02, 0.5), None),
    "column 20:1, 1.2 Euler": (column(1.2), SVK),
    "two blocks, 0.02": (stacked(0.02), SVK),
    "warmed by 0.1 %": (warmed(10.0), None),
}
ASKED_HEADS = ("scene", "named", "asked", "way", "theory", "told", "true", "elements", "cpu",
               "cpu_small")
HEADS = ("scene", "step", "bound", "svk", "svk_true", "neo", "neo_true", "law", "cpu", "cpu_theory",
         "cpu_svk")


def solve(program, folder, deck, *options, or_not=False):
    """Run a deck; return the result, or None where it is not solved and not wanted all the same."""
    path = folder / "run.inp"
    path.write_text(deck, encoding="utf-8")
    done = subprocess.run([program, path, "--overwrite", "--quiet", "-o", folder / "run.vtkhdf",
                           *options], capture_output=True, text=True, check=False)
    if done.returncode == 1:
        raise SystemExit(done.stderr)
    return Result(folder / "run.vtkhdf") if or_not or done.returncode == 0 else None


def ends_of(result):
    """Return the resultants of the pairs at the ends of the steps."""
    groups = [result.file["contact"][name]["resultant"][:] for name in result.file["contact"]]
    return np.array([[one[row] for one in groups] for row in result.step_ends])


def measure(program, name):
    """Run a scene all ways; return its rows."""
    neo = re.sub(r"^\*ELASTIC\b", "*ELASTIC, LAW=NEO HOOKE", SCENES[name], flags=re.M)
    cpu, values = {}, {}
    with tempfile.TemporaryDirectory() as kept:
        for way, deck, options in (("", SCENES[name], ("--nlgeom", "no")),
                                   ("theory", SCENES[name], ("--nlgeom", "no", "--theory")),
                                   ("svk", SCENES[name], ("--nlgeom", "yes")),
                                   ("neo", neo, ("--nlgeom", "yes"))):
            result = solve(program, Path(kept), deck, *options)
            if result is None:
                continue
            with result:
                cpu[way] = result.counters["cpu_seconds"]
                values[way] = ends_of(result)
                if way in ("", "theory"):
                    at = {key: result.history(f"error/{key}")[result.step_ends]
                          for key in ("small_strain", "small_strain_deck_law",
                                      "small_strain_other_law", "law")}
                if way == "":
                    bound = at["small_strain"]
    for step, linear in enumerate(values[""]):
        true = {}
        for law in LAWS:
            true[law] = ""
            if law in values:
                finite = values[law][step]
                true[law] = (np.linalg.norm(finite - linear, axis=-1).max()
                             / np.linalg.norm(finite, axis=-1).max())
        yield dict(zip(HEADS, (name, step + 1, bound[step], at["small_strain_deck_law"][step],
                               true["svk"], at["small_strain_other_law"][step], true["neo"],
                               at["law"][step], cpu[""], cpu["theory"], cpu.get("svk", "")),
                       strict=True))


def ask(program, name, wanted):
    """Ask an accuracy of a scene; return its row."""
    deck, law = ASKED[name]
    deck = deck.replace("*STATIC, DIRECT", "*STATIC")
    if law:
        deck = re.sub(r"^\*ELASTIC\b", f"*ELASTIC, LAW={law}", deck, flags=re.M)
    row = dict.fromkeys(ASKED_HEADS, "")
    row.update(scene=name, named=law or "", asked=wanted, way="not reached")
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        found = solve(program, folder, deck, "--accuracy", str(wanted), or_not=True)
        with found:
            runs, ends = found.accuracy, ends_of(found)
            if runs.reached:
                finite = found.small_strain_is == "finite strain"
                row["way"] = "finite strain" if finite else "small strain"
            row.update(theory=runs.small_strain, elements=int(runs.elements[-1]),
                       told=runs.mesh_and_load_steps + runs.others + max(0.0, runs.small_strain),
                       cpu=found.counters["cpu_seconds"])
        small = solve(program, folder, deck, "--accuracy", str(wanted), "--nlgeom", "no")
        if small is not None:
            with small:
                row["cpu_small"] = small.counters["cpu_seconds"]
        if runs.reached:
            true = solve(program, folder, deck, "--accuracy", str(wanted / FINER),
                         "--nlgeom", "yes")
            if true is not None:
                with true:
                    truth = ends_of(true)
                row["true"] = max(np.linalg.norm(one - other, axis=-1).max()
                                  / np.linalg.norm(other, axis=-1).max()
                                  for one, other in zip(ends, truth, strict=True))
    return row


def read_kept(path=KEPT):
    """Return the rows kept, numbers as numbers; None where there is none."""
    with path.open(encoding="utf-8", newline="") as lines:
        return [{key: value if key in ("scene", "named", "way") else float(value) if value else None
                 for key, value in row.items()} for row in csv.DictReader(lines)]


def keep(found, path=KEPT, heads=HEADS, scenes=SCENES, second="step"):
    """Write rows, those of other scenes that are kept already behind them, in the scenes' order."""
    old = read_kept(path) if path.exists() else []
    rows = list(found)
    new = {row["scene"] for row in rows}
    order = list(scenes)
    rows = [*rows, *(row for row in old if row["scene"] in scenes and row["scene"] not in new)]
    with path.open("w", encoding="utf-8", newline="") as lines:
        writer = csv.DictWriter(lines, heads, lineterminator="\n")
        writer.writeheader()
        for row in sorted(rows, key=lambda row: (order.index(row["scene"]), float(row[second]))):
            writer.writerow({key: "" if value is None else f"{value:.4g}"
                             if isinstance(value, float) else value for key, value in row.items()})


def per_cent(value):
    """Return an error in words."""
    if value is None:
        return "not solved"
    if value > HUGE:
        return "more"
    number = 100 * value
    return f"{number:.0f} %" if number >= 100 else f"{number:.2g} %"


def judged(rows):
    """Return estimate and true error of each law and end where both are there and resolved."""
    return [(row, law, row[law], row[f"{law}_true"]) for row in rows for law in LAWS
            if row[f"{law}_true"] is not None and row[law] < HUGE
            and row[f"{law}_true"] > RESOLVED]


def right_choices(rows):
    """Return how often AUTO is right, and of how many errors that are not close to 1 %."""
    found = [(told > ALLOWED) == (true > ALLOWED) for row in rows for law in LAWS
             for told, true in [(row[law], row[f"{law}_true"])]
             if true is not None and abs(true / ALLOWED - 1) > 0.2]
    return sum(found), len(found)


def draw(rows, path):
    """Draw the block over how far it is pressed, and all scenes, estimate over true error."""
    figure, (left, right) = new_axes(2)
    block = [row for row in rows if row["scene"].startswith("block,") and row["step"] == 2]
    pressed_by = [float(row["scene"].split()[1]) for row in block]
    for law, colour in zip(LAWS, (BLUE, ORANGE), strict=True):
        left.loglog(pressed_by, [100 * row[f"{law}_true"] for row in block], color=colour,
                    linewidth=1.2, label=f"{LAWS[law]}, true")
        left.loglog(pressed_by, [100 * row[law] for row in block], "o", color=colour,
                    markersize=4, label="estimate")
    left.loglog(pressed_by, [100 * row["bound"] for row in block], "--", color=INK, linewidth=1,
                label="bound")
    left.set_xlabel("block pressed by [%]")
    left.set_ylabel("small strain is off by [%]")
    left.legend(fontsize=7)
    for law, colour in zip(LAWS, (BLUE, ORANGE), strict=True):
        points = [(true, told) for _, which, told, true in judged(rows) if which == law]
        right.loglog(*(100 * np.array(points)).T, "o", color=colour, markersize=3, label=LAWS[law])
    bounds = [(row["svk_true"], row["bound"]) for row in rows
              if row["svk_true"] and row["svk_true"] > RESOLVED and row["bound"] > 0]
    right.loglog(*(100 * np.array(bounds)).T, "x", color=INK, markersize=4, label="bound")
    ends = np.array([0.02, 200.0])
    for factor in (0.8, 1.2):
        right.loglog(ends, factor * ends, color=INK, linewidth=0.6, linestyle=":")
    right.set_xlabel("true [%]")
    right.set_ylabel("estimated [%]")
    right.legend(fontsize=7)
    figure.tight_layout()
    save(figure, path)


def asked_section(rows):
    """Return the section on accuracies that are asked for, from the rows kept."""
    reached = [row for row in rows if row["way"] != "not reached"]
    wrong = [row["scene"] for row in reached if row["true"] is not None
             and row["true"] > row["asked"]]
    lines = [[row["scene"], row["named"] or "open", per_cent(row["asked"]), row["way"],
              "-" if row["way"] == "finite strain" else per_cent(row["theory"]),
              per_cent(row["told"]) if row["way"] != "not reached" else "-",
              "-" if row["true"] is None else per_cent(row["true"]), f"{row['elements']:.0f}",
              f"{row['cpu']:.2g}",
              "-" if not row["cpu_small"] else f"{row['cpu'] / row['cpu_small']:.1f}"]
             for row in rows]
    return f"""## An accuracy counts it

`--accuracy X` and `*ACCURACY` ask for the forces, however they are found: what small strain leaves
out is one of their errors. Coarse runs bound it; where the bound is more than a tenth of what is
asked, runs from there on estimate it. What it takes is not there for mesh and load steps. Where
that is more than a third, and the law is known, the runs begin again at finite strain. `NLGEOM=NO`
on a `*STEP`, or `--nlgeom no`, asks for the accuracy of the small-strain solution alone. All of
these runs look at the stability at the ends of steps, too, where a bound is enough at the
displacement of the linear run: of what is unstable the error is not known. At finite strain what
buckles is refused on the first mesh, for finer ones are softer; elements that may be too soft on a
coarse mesh (C3D8I, C3D8B, C3D20R) have to say so on two.

Of {len(rows)} accuracies that scenes were asked for {len(reached)} are reached,
{claim(not wrong, "and none of these is farther off than was asked")}. Where the law that the deck
leaves open decides more than is asked, or finite strain is not solved, the accuracy is not reached;
the run says so, and its result is the small-strain solution. Beyond Euler's load the column is
unstable at finite strain.

{table(("scene", "law", "asked", "reached by", "small strain", "estimated", "true", "elements",
        "CPU time [s]", "over `--nlgeom no`"), lines)}

"estimated" is the sum of all sources, "true" the difference from a run at finite strain that was
asked for {FINER} times the accuracy, both of the largest resultant of a pair.
"""


def page(rows, asked, figure):
    """Return the page as Markdown, from the rows kept."""
    found = judged(rows)
    near = sum(abs(told / true - 1) <= 0.2 for _, _, told, true in found)
    worst = max(abs(told / true - 1) for _, _, told, true in found)
    below = [row["scene"] for row in rows if row["svk_true"] is not None
             and row["svk_true"] > RESOLVED
             and row["bound"] < max(row["svk_true"], row["neo_true"] or 0)]
    over = [row["bound"] / max(row["svk_true"], row["neo_true"] or 0) for row in rows
            if row["svk_true"] and row["svk_true"] > RESOLVED and row["bound"] < HUGE]
    right, of = right_choices(rows)
    off = f"at worst {100 * worst:.1f} %"
    lost = sorted({row["scene"] for row in rows if row["svk"] > HUGE})
    scenes = {row["scene"] for row in rows}
    costs = [row for row in rows if row["scene"].startswith("block of 1 %") and row["step"] == 2]
    lines = [[row["scene"], f"{row['step']:.0f}", per_cent(row["bound"]), per_cent(row["svk"]),
              per_cent(row["svk_true"]), per_cent(row["neo"]), per_cent(row["neo_true"]),
              per_cent(row["law"])] for row in rows]
    block = {row["scene"]: row for row in rows if row["step"] == 2}
    one = block["block, 1 %"]
    return f"""# Is small strain enough?

By `studies/run theory_error`, on one thread of {machine()}; numbers in
`studies/data/theory_error.csv`.

A run without `NLGEOM` takes strains and rotations as small. How far that is off is the fifth
source of error, `small strain`: the largest difference between the resultants of a pair at small
and at finite strain, as a part of the largest resultant at finite strain, on the same mesh, with
the same increments and law.

- A plain run prints a **bound**: `small strain: at most 5.7 %`. It costs one evaluation of the
  internal forces at the end of a step. If `*ELASTIC` leaves the law open, the larger of the bounds
  of two laws is printed. A bound above 100 % is printed as `not known`. If the bound predicts more
  than 20 % in the first step, and an estimate takes at most a fifth of the increments and of the
  planned time, the run makes the estimate.
- `--theory` (or `*ACCURACY, THEORY=ESTIMATE`) prints an **estimate**: `small strain: 2.2 %, or
  1 % by neo-Hooke's law`. A run at finite strain, the shadow run, goes beside the linear one with
  its factor.
- `--nlgeom auto` (or `*STEP, NLGEOM=AUTO`) decides by the estimate: where it is more than 1 %, the
  run begins again at finite strain. A run at finite strain whose strains and rotations stay below
  0.001 ends with a note that names it.
- An **accuracy** counts it as one more error: [below](#an-accuracy-counts-it).

No limit on strains says the same:

- a block pressed by 1 %: {per_cent(one['svk_true'])} off;
- a plate bent by 0.3 of its thickness, strained by 1 %:
  {per_cent(block_at(rows, 'plate 20:1, 0.3 t')['svk_true'])} off;
- a column at 0.8 of Euler's load, strained by 0.7 %:
  {per_cent(block_at(rows, 'column 20:1, 0.8 Euler')['svk_true'])} off.

![left: a block pressed by 0.1 to 10 %; right: all scenes]({figure})

## How good the estimate is

In {len(scenes)} scenes with {len(found)} values that are more than {per_cent(RESOLVED)} of the
forces the estimate is
{claim(near >= 0.95 * len(found), f"within 20 % of the true error in {near}, and {off} off")}.
Shadow runs go in halves of a `*STEP`, and beside them the linear one does: what the size of
increments makes of friction is not taken for the theory.
{claim(not below, "The bound is never below the true error")}, and {min(over):.1f}
to {max(over):.0f} times as large: least where bodies are stocky, most where they are slender and
turn, or where a light pair stands beside a heavy one. `NLGEOM=AUTO`, which allows 1 %,
{claim(right == of, f"decides as the true error would in all {of} cases")} whose true error is not
within 20 % of 1 %.

Where it is not known how far small strain is off the run says that: {"; ".join(lost)}. The
column is straight, and finite strain changes its force by a few per cent; but beyond Euler's load
it is unstable, and what a run finds is not what the column does. The cantilever's force is another
one altogether.

{table(("scene", "end of step", "bound", "SVK", "true", "neo-Hooke", "true", "laws apart"), lines)}

"more": not known, of a bound more than 100 %. SVK is the law of St Venant and Kirchhoff, which
`*ELASTIC` is with `NLGEOM`. Of decks of `input/` the parameters are those of the deck.

{asked_section(asked)}
## What the law makes

`*ELASTIC` names E and nu, which say what happens at small strain. At finite strain laws of the
same constants differ: pressed by 10 %, St Venant and Kirchhoff's block is softer than the linear
one ({per_cent(block['block, 10 %']['svk_true'])}), neo-Hooke's stiffer
({per_cent(block['block, 10 %']['neo_true'])}). The last column of the table says how far the two
are apart. Where that is more than is asked for, a run at finite strain is no more true than one
at small strain, before the deck says which law holds: `*HYPERELASTIC`, or `*ELASTIC, LAW=SVK` or
`LAW=NEO HOOKE`. `NLGEOM=AUTO` keeps small strain until then, and says why. Where bodies bend
(plates, the cantilever) the laws agree, for strains are small and rotations are not. A note says
where von Mises' stress passes 1 % of E: no metal stays elastic there, and neither law holds.

## What it costs

Processor time, with both laws, and beside it one run at finite strain:

{table(("scene, 50 increments", "linear [s]", "with `--theory`", "NLGEOM"),
       [[row["scene"], f"{row['cpu']:.2f}", f"{row['cpu_theory'] / row['cpu']:.1f} times",
         f"{row['cpu_svk'] / row['cpu']:.1f} times"] for row in costs])}

The stability at the ends of steps takes some solutions with the linear run's factor where the
bodies are supported and far from buckling, else a factor of its own and as much memory as the first
one. With a law that the deck names there is one shadow run
instead of two. `NLGEOM=AUTO` pays where small strain is enough, which is most scenes: then it
costs what `--theory` does; where it is not, that and the finite run.

## What it does not see

- Other equilibria: a shadow run stays near the linear one. What buckles only at a larger load
  than the last is not seen. A plain run, of which nothing is asked, looks at no stability.
- A mesh that is too stiff buckles at a higher load than the body.
- Stability is looked at at the ends of steps alone, with the deck's law.
- Couplings whose reference node turns and surfaces with SMALL SLIDING have no shadow run, nor have
  bodies that are solved for by iteration: the bound stays. Of the first two a note says so.
- The estimate is of the resultants (without contact of the strain energy), not of stresses or
  slips.
"""


def block_at(rows, scene):
    """Return the row of a scene's last step."""
    return [row for row in rows if row["scene"] == scene][-1]


def main():
    """Run the scenes that are asked for, and write data, figure and page."""
    options = program_options(__doc__)
    options.add_argument("-o", dest="page", type=Path, help="write the page here")
    options.add_argument("--only", default="", help="scenes, by parts of their names")
    options.add_argument("--asked", action="store_true", help="the accuracies that are asked for")
    options.add_argument("--page", dest="page_alone", action="store_true", help="no runs")
    options = options.parse_args()
    if not options.page_alone:
        program = built_program(options.bipot.resolve())
        for name in ASKED if options.asked else SCENES:
            if not any(part in name for part in options.only.split(",")):
                continue
            print(name, file=sys.stderr, flush=True)
            if options.asked:
                keep([ask(program, name, wanted) for wanted in WANTED], KEPT_ASKED, ASKED_HEADS,
                     ASKED, "asked")
            else:
                keep(measure(program, name))
    rows = read_kept()
    if not options.asked:
        draw(rows, FIGURE)
    put_page(page(rows, read_kept(KEPT_ASKED), FIGURE.relative_to(PAGE.parent)), options.page)


if __name__ == "__main__":
    main()
