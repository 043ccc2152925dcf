"""Which element: errors of the types over processor time, beside an independent program's.

    studies/run elements [--only PART,...] [-o docs/studies/elements.md]
    studies/run elements --page

Makes decks (studies/element_scenes.py), runs them and keeps their numbers in
studies/data/elements.csv, in place of older ones; the page is written from that file, with --page
alone. Times are user processor time of the whole process, the least of three runs, one thread. The
parts `ball` and `shell` need Gmsh, `calculix` CalculiX.
"""

import argparse
import csv
import os
import re
import resource
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from bipot.figures import BLUE, GREEN, ORANGE, RED, new_axes, save
from bipot.program import RunError, built_program, program_path, with_threads
from bipot.report import machine
from bipot.result import Result
from studies import element_peers
from studies import element_scenes as scenes
from studies.pages import DATA, PAGES, StudyError, claim, put_page, table

KEPT = DATA / "elements.csv"
HEADS = ("part", "type", "size", "equations", "gflop", "seconds", "machine", "values")
REPEATS = 3
LINES = {"C3D8": (BLUE, "o"), "C3D8I": (GREEN, "s"), "C3D10": (ORANGE, "^"), "C3D20R": (RED, "D")}
# Elements along an edge; of the beam, across its height.
TIMED = {
    "block": {"C3D8": (4, 8, 12, 16, 20, 24), "C3D8I": (4, 8, 12, 16, 20, 24),
              "C3D10": (2, 4, 6, 8, 10), "C3D20R": (2, 4, 6, 8, 10, 12)},
    "bending": {"C3D8": (1, 2, 4, 8), "C3D8I": (1, 2, 4, 8), "C3D10": (1, 2, 4, 6),
                "C3D20R": (1, 2, 4, 8)},
    "hertz": {"C3D8": (8, 12, 16, 24), "C3D8I": (8, 12, 16, 24), "C3D10": (4, 6, 8, 12),
              "C3D20R": (4, 6, 8, 12)},
}
# Errors of an independent program (elements, mortar and contact of its own, in Python): pressure,
# of Mindlin's problem the friction. Balls are meshed by another version of Gmsh there.
INDEPENDENT = {
    ("hertz", "C3D8", "16"): 0.0962, ("hertz", "C3D4", "16"): 0.0874,
    ("hertz", "C3D10", "8"): 0.1393, ("hertz", "C3D15", "8"): 0.1420,
    ("hertz", "C3D20R", "8"): 0.1475, ("hertz", "C3D8", "24"): 0.0721,
    ("hertz", "C3D10", "12"): 0.1023, ("hertz", "C3D20R", "12"): 0.1229,
    ("two bodies", "C3D8", "14/12"): 0.1185, ("two bodies", "C3D10", "7/6"): 0.1264,
    ("two bodies", "C3D15", "7/6"): 0.1229, ("two bodies", "C3D20R", "7/6"): 0.1563,
    ("mindlin", "C3D8", "16"): 0.1206, ("mindlin", "C3D4", "16"): 0.1135,
    ("mindlin", "C3D10", "8"): 0.1714, ("mindlin", "C3D15", "8"): 0.1757,
    ("mindlin", "C3D20R", "8"): 0.1855,
    ("ball", "C3D4", "a/4"): 0.0553, ("ball", "C3D4", "a/8"): 0.0380,
    ("ball", "C3D10", "a/2"): 0.0291, ("ball", "C3D10", "a/4"): 0.0126,
    ("shell", "C3D4", "0.25/0.33"): 0.02172, ("shell", "C3D4", "0.125/0.165"): 0.0054,
    ("shell", "C3D10", "0.5/0.6"): 0.00402, ("shell", "C3D10", "0.25/0.33"): 0.00085,
    ("rings", "C3D8", "6/4"): 0.01353, ("rings", "C3D8", "12/8"): 0.00366,
    ("rings", "C3D10", "3/2"): 0.0096, ("rings", "C3D10", "6/4"): 0.0024,
    ("rings", "C3D15", "3/2"): 0.0118, ("rings", "C3D20R", "3/2"): 0.0118,
    ("rings", "C3D20R", "6/4"): 0.00295,
}
ALLOWED = 1.1  # of these


def sizes(size):
    """Return the numbers of a size such as 7/6."""
    return [float(word) if "." in word else int(word) for word in size.split("/")]


def scene(part, kind, size):
    """Return the deck of a part, a type and a size, and what evaluates a result of it."""
    if part in TIMED:
        n = int(size)
        make, values = getattr(scenes, f"{part}_deck"), getattr(scenes, f"{part}_values")
        body = scenes.hertz_body(kind, n) if part == "hertz" else None
        return make(kind, n), partial(values, body)
    if part == "two bodies":
        return (scenes.two_hertz_deck(kind, *sizes(size)),
                partial(scenes.two_hertz_values, kind, *sizes(size)))
    if part == "mindlin":
        return (scenes.mindlin_deck(kind, int(size)),
                partial(scenes.mindlin_values, kind, int(size)))
    if part == "ball":
        h = scenes.SMALL / int(size[2:])
        return scenes.ball_deck(kind, h, scenes.ball_body(kind, h)), scenes.ball_values
    make = {"shell": lambda: scenes.shell_deck(kind, sizes(size)),
            "rings": lambda: scenes.rings_deck(kind, *sizes(size))}[part]
    return make(), scenes.uniform_values


def parts():
    """Return all runs by part: pairs of type and size."""
    found = {part: [(kind, str(n)) for kind, all_n in of.items() for n in all_n]
             for part, of in TIMED.items()}
    for part, kind, size in INDEPENDENT:
        if (kind, size) not in found.setdefault(part, []):
            found[part].append((kind, size))
    found["bending"] += [REFERENCE[1:], CONFIRMED[1:]]
    size = f"{element_peers.UPPER} on {element_peers.LOWER}"
    return found | {"calculix": [(case, size) for case in element_peers.CASES]
                    + [(kind, str(n)) for kind, n in element_peers.ON_SLAB]}


def run_beside_calculix(program, case, size, folder):
    """Return the row of a comparison with CalculiX."""
    values = element_peers.compare(program, case, folder, int(size.split()[0]))
    return dict.fromkeys(HEADS, "") | {
        "part": "calculix", "type": case, "size": size, "machine": machine(),
        "values": "; ".join(f"{name}={value:.2g}" for name, value in values.items()),
    }


def run(program, part, kind, size, folder):
    """Return the row of a run."""
    if part == "calculix":
        return run_beside_calculix(program, kind, size, folder)
    text, evaluate = scene(part, kind, size)
    deck, path = folder / "deck.inp", folder / "deck.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    seconds = []
    is_timed = size in map(str, TIMED.get(part, {}).get(kind, ()))
    for _ in range(REPEATS if is_timed else 1):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run([program, deck, "-o", path, "--overwrite", "-q"], check=False,
                              capture_output=True, text=True, env=with_threads())
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
        if done.returncode:
            raise RunError(f"{part}, {kind}, {size}: {done.stderr}")
    planned = subprocess.run([program, deck, "--plan"], check=True, capture_output=True, text=True,
                             env=with_threads()).stdout
    flop = re.search(r"([\d.e+-]+) (k|M|G|T)flop per factorisation", planned)
    gflop = float(flop[1]) * {"k": 1e-6, "M": 1e-3, "G": 1.0, "T": 1e3}[flop[2]]
    with Result(path) as result:
        values = evaluate(result)
        equations = int(result.counters["equations"])
    row = {"part": part, "type": kind, "size": size, "equations": equations,
           "gflop": f"{gflop:.3g}", "seconds": f"{min(seconds):.3f}", "machine": machine(),
           "values": "; ".join(f"{name}={value:.8g}" for name, value in values.items())}
    print(*row.values(), sep=", ", flush=True)
    return row


def read_kept():
    """Return the rows kept, by part, type and size."""
    if not KEPT.exists():
        return {}
    with KEPT.open(encoding="utf-8", newline="") as file:
        return {(row["part"], row["type"], row["size"]): row for row in csv.DictReader(file)}


def keep(row):
    """Put a row into the file, in place of an older one."""
    rows = read_kept()
    rows[row["part"], row["type"], row["size"]] = row
    fresh = KEPT.with_suffix(".new")
    with fresh.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, HEADS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.values())
    os.replace(fresh, KEPT)


def values_of(row):
    """Return the values of a row by name."""
    return {name: float(value) for name, value in
            (word.split("=") for word in row["values"].split("; "))}


# --- Errors -----------------------------------------------------------------------------------

REFERENCE = ("bending", "C3D20R", "12")  # finer than what is timed
CONFIRMED = ("bending", "C3D8I", "16")


def extrapolated(sizes_of, values):
    """Return what three values converge to as c n^-p, with p fitted by bisection."""
    (a, b, c), (x, y, z) = sizes_of, values
    low, high = 0.05, 6.0
    for _ in range(100):
        p = (low + high) / 2
        ratio = (a**-p - b**-p) / (b**-p - c**-p)
        low, high = (p, high) if (x - y) / (y - z) > ratio else (low, p)
    return z - (y - z) * c**-p / (b**-p - c**-p)


def truths(kept):
    """Return the true values of block and beam, and how far they are in doubt: name to both."""
    found = {}
    for name in ("N pressed", "N", "T"):
        each = []
        for kind, all_n in TIMED["block"].items():
            last = all_n[-3:]
            rows = [values_of(kept["block", kind, str(n)])[name] for n in last]
            each.append(extrapolated(last, rows))
        found["block", name] = np.mean(each), np.ptp(each) / 2 / np.mean(each)
    best, other = (values_of(kept[row]) for row in (REFERENCE, CONFIRMED))
    for name, value in best.items():
        found["bending", name] = value, abs(other[name] / value - 1)
    return found


def error_of(row, true):
    """Return the largest error of a row's values; of Hertz's problem the value is one."""
    values = values_of(row)
    if row["part"] == "hertz":
        return values["pressure"]
    return max(abs(value / true[row["part"], name][0] - 1) for name, value in values.items())


def draw(kept, true, path):
    """Draw errors over processor time, a panel a scene."""
    figure, panels = new_axes(3)
    figure.set_size_inches(9.2, 3.4)
    titles = ("block: forces", "beam on a support: force, tip", "Hertz: pressure")
    for axes, (part, of), title in zip(panels, TIMED.items(), titles, strict=True):
        for kind, all_n in of.items():
            colour, mark = LINES[kind]
            rows = [kept[part, kind, str(n)] for n in all_n]
            axes.plot([float(row["seconds"]) for row in rows],
                      [error_of(row, true) for row in rows], marker=mark, markersize=4,
                      color=colour, label=kind)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_title(title, fontsize=9)
        axes.set_xlabel("processor time (s)")
    panels[0].set_ylabel("error")
    panels[0].legend(fontsize=8)
    figure.tight_layout()
    save(figure, path)


def cheapest(kept, true, part, kind, limit):
    """Return the row of the cheapest run whose error is at most `limit`, or None."""
    rows = [kept[part, kind, str(n)] for n in TIMED[part][kind]]
    rows = [row for row in rows if error_of(row, true) <= limit]
    return min(rows, key=lambda row: float(row["seconds"]), default=None)


# --- The page ---------------------------------------------------------------------------------

WANTED = {"block": (1, 0.5, 0.2), "bending": (3, 1, 0.4), "hertz": (25, 16, 11)}  # errors [%]
TITLES = {"block": "block", "bending": "beam", "hertz": "Hertz"}


def times(kept, true):
    """Return the table of the cheapest runs of each error."""
    rows = []
    for part, limits in WANTED.items():
        for limit in limits:
            row = [TITLES[part], f"{limit:g} %"]
            for kind in LINES:
                best = cheapest(kept, true, part, kind, limit / 100)
                row.append(f"{float(best['seconds']):.2g}, n = {best['size']}" if best else "-")
            rows.append(row)
    return table(["scene", "error at most", *LINES], rows)


def counts(kept, true):
    """Return the table of all runs that are timed."""
    rows = []
    for part, of in TIMED.items():
        for kind, all_n in of.items():
            for n in all_n:
                row = kept[part, kind, str(n)]
                rows.append([TITLES[part], kind, n, row["equations"], row["gflop"], row["seconds"],
                             f"{100 * error_of(row, true):.2g} %"])
    heads = ["scene", "type", "n", "equations", "Gflop of the factor", "s", "error"]
    return table(heads, rows)


def beside_independent(kept):
    """Return the table of errors beside those of the independent program."""
    names = {"hertz": "Hertz, before a plane", "two bodies": "Hertz, two bodies",
             "mindlin": "Cattaneo-Mindlin, friction", "ball": "ball on a plane, within 0.8 a",
             "shell": "ball in a shell", "rings": "ring in a ring"}
    rows = []
    for key, other in INDEPENDENT.items():
        values = values_of(kept[key])
        ours = values.get("friction", values["pressure"])
        claim(ours <= ALLOWED * other, f"{key}: {ours:.4f} beside {other}")
        rows.append([names[key[0]], key[1], key[2], f"{100 * ours:.3g} %", f"{100 * other:.3g} %",
                     f"{ours / other:.2f}"])
    return table(["scene", "type", "mesh", "error", "of the other program", "ratio"], rows)


def beside_calculix(kept):
    """Return the table of what CalculiX finds, and the largest differences of those that ended.

    Those are of blocks on blocks; behind them come blocks on a slab.
    """
    rows, worst = [], {}
    on_block = f"{element_peers.UPPER} on {element_peers.LOWER}"
    on_slab = [(kind, str(n)) for kind, n in element_peers.ON_SLAB]
    for case, size in [*((case, on_block) for case in element_peers.CASES), *on_slab]:
        row = kept["calculix", case, size]
        values = values_of(row) if row["values"] else {}
        name = case if size == on_block else f"{case}, {size} along an edge, on a slab"
        rows.append([name, *(f"{values[part]:.1e}" if values else "does not end"
                             for part in ("pressed", "sticking", "sliding"))])
        for name, value in values.items() if size == on_block else ():
            worst[name] = max(worst.get(name, 0.0), value)
    return table(["type", "pressed", "some stick", "all slide"], rows), worst


# While some points stick, with `STIFFNESSES` of element_peers times four: measured once.
HARDER = 4.7e-4


def is_ahead(kept, true, part, kind):
    """Whether a type is the cheapest of all for the smallest error of a part."""
    runs = {one: cheapest(kept, true, part, one, WANTED[part][-1] / 100) for one in LINES}
    seconds = {one: float(row["seconds"]) for one, row in runs.items() if row}
    return kind in seconds and seconds[kind] == min(seconds.values())


def page(kept, figure):
    """Return the page."""
    true = truths(kept)
    peers, apart = beside_calculix(kept)
    doubts = [100 * max(doubt for (part, _), (_, doubt) in true.items() if part == wanted)
              for wanted in ("block", "bending")]
    machines = sorted({row["machine"] for row in kept.values()})
    order = list(LINES)
    block, beam, ball = ([kind for kind in order if is_ahead(kept, true, part, kind)]
                         for part in TIMED)
    ratio = {kind: float(cheapest(kept, true, "block", kind, 0.002)["seconds"]) for kind in order}
    claim(block == ["C3D20R"] and beam == ["C3D20R"] and ball == ["C3D8"],
          "C3D20R is the cheapest for block and beam, C3D8 for Hertz's pressure")
    claim(cheapest(kept, true, "bending", "C3D8I", 0.01)["size"] == "2",
          "two C3D8I across bend to 1 %")
    slab = {(kind, n): values_of(kept["calculix", kind, str(n)])["sticking"]
            for kind, n in element_peers.ON_SLAB}
    claim(all(slab[kind, 4] < slab[kind, 2] / 3 for kind in ("C3D10", "C3D15")),
          "differences from CalculiX fall with the mesh")
    claim(apart["pressed"] < 1e-3 and apart["sliding"] < 1e-3 and apart["sticking"] < 2e-3,
          "CalculiX agrees to 1e-3, and to 2e-3 while some points stick")
    return f"""\
# Which element

By `studies/run elements`: contact problems with `C3D8`, `C3D8I`, `C3D10` and `C3D20R`, their
errors over processor time, beside errors of an independent program on the same meshes, and beside
CalculiX.

## In short

- **A shape that no hexahedra fit: `C3D10`.** Its contact forces are about as good for their time as
  those of hexahedra. `C3D4` is only for contact pressures of bulky bodies: in bending it is far too
  stiff ([deck](../deck/elements.md#which-element)).
- **Hexahedra and forces: `C3D20R`.** For the block's forces to 0.2 % it takes
  {ratio['C3D20R']:.2g} s, `C3D10` {ratio['C3D10']:.2g}, `C3D8I` {ratio['C3D8I']:.2g},
  `C3D8` {ratio['C3D8']:.2g}.
- **Thin parts that bend: `C3D8I`,** two across, for 1 %; `C3D20R`, four across, for less.
- **Hexahedra and contact pressures: `C3D8` or `C3D8I`.** Hertz's pressure is steep at its rim,
  which many linear faces follow better than few faces of second order.
- **Curved surfaces that fit into each other: elements of second order**, whose mid-side nodes lie
  on the curve (below: ball in a shell).

## Errors over processor time

![Errors over processor time]({figure})

User processor time of the whole run, the least of {REPEATS}, one thread, on
{", ".join(machines)}. The machine did other work too: times to compare, not to quote. Seconds of
the cheapest of these runs whose error is at most what the second column says:

{times(kept, true)}

*Block*: the [paper's](solvers.md), 10 increments, n elements along an edge; the largest of the
errors of three forces (normal at the end of pressing, normal and friction at the end). The truth
is extrapolated from the three finest meshes of each type, and its mean; in doubt by
{doubts[0]:.1g} %. Stresses are infinite at the edges of the clamped face, which keeps the
order of all types low.

*Beam*: 6 by 0.6 by 0.4, clamped, under pressure, coming to rest on a cylinder of radius 10 at two
thirds of its length; n elements across its height, 12 n along; the larger of the errors of the
support's force and of the way of the tip. The truth is that of `{REFERENCE[1]}` with
n = {REFERENCE[2]}; `{CONFIRMED[1]}` with n = {CONFIRMED[2]} says the same to {doubts[1]:.1g} %.

*Hertz*: a quarter of a block of 16 by 16 by 8, its gap that of a ball of radius 5, pressed so that
the radius of contact is 1; n elements along an edge, the last twelve times the first. The error of
the pressure in the mean square over the contact, beside Hertz's closed form.

{counts(kept, true)}

## Beside an independent program

A program in Python with elements, mortar operators and a contact solver of its own, on the same
meshes (balls: meshed to the same sizes by another version of Gmsh; n/m: elements of slave and
master). Errors of the pressure in the mean square, of Cattaneo and Mindlin's problem those of the
friction, beside closed forms. This page is not written where an error is more than {ALLOWED:g}
times the other.

{beside_independent(kept)}

Of ball in a shell and ring in a ring the exact pressure is 1 everywhere. bipot moves the slave
nodes onto the master at the beginning (`ADJUST`), and the other program takes the gaps between
the meshes as none: so coarse meshes differ.

## Beside CalculiX

Blocks with friction 0.3, pressed and then pushed until all of them slides, on a block whose faces
do not match: {element_peers.UPPER} elements along an edge on {element_peers.LOWER}, of linear
types twice as many. CalculiX (`TYPE=SURFACE TO SURFACE`) presses Gauss points with a penalty; its
forces are extrapolated from two stiffnesses. The largest difference of the forces, beside the
largest force: at most {apart['pressed']:.0e} while they are pressed, {apart['sticking']:.0e} while
some points stick, {apart['sliding']:.0e} while all slide. On a slab that is held, where no face of
the other body gives way, the two programs differ more while some points stick, here at nodes,
there at Gauss points: by {slab['C3D10', 2]:.1e} with 2 `C3D10` along an edge and
{slab['C3D10', 4]:.1e} with 4, by {slab['C3D15', 2]:.1e} and {slab['C3D15', 4]:.1e} with `C3D15`.
It is the meshes, not the penalty: extrapolated from stiffnesses four times as large (`C3D10`, 4
along an edge) it is {HARDER:.1e}.

{peers}
"""


def command_line():
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, default=program_path(), help="the program")
    parser.add_argument("--only", default="", help="parts to run, with commas")
    parser.add_argument("--page", action="store_true", help="write the page alone")
    parser.add_argument("-o", dest="docs", type=Path, default=PAGES / "elements.md",
                        help="where the page goes")
    return parser.parse_args()


def main():
    """Run the parts and write the page."""
    options = command_line()
    try:
        if not options.page:
            program = built_program(options.bipot).resolve()
            with tempfile.TemporaryDirectory() as folder:
                for part, cases in parts().items():
                    if not options.only or part in options.only.split(","):
                        for kind, size in cases:
                            keep(run(program, part, kind, size, Path(folder)))
        kept = read_kept()
        figure = Path("figures") / "elements.png"
        text = page(kept, figure)
        draw(kept, truths(kept), options.docs.parent / figure)
        put_page(text, options.docs)
    except (StudyError, RunError) as error:
        sys.exit(f"elements: {error}")


if __name__ == "__main__":
    main()
