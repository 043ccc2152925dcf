"""Ten decks at finite strain, here and in CalculiX: docs/studies/finite-strain.md.

    studies/run finite_strain [-o docs/studies/finite-strain.md] [--only NAME,...]
    studies/run finite_strain --page

The decks are made here. Each is compared as `scripts/compare` does; every comparison goes into
studies/data/finite_strain.csv, in place of an older one, and the page is written from that file,
with --page alone. All runs have one thread. Some ten minutes. Status 77: CalculiX is not installed.
"""

import argparse
import math
import shutil
import sys
import tempfile
import textwrap
from pathlib import Path
from types import SimpleNamespace

from bipot.peers.runs import CCX, CHANGE, absent, compare
from bipot.program import ROOT
from bipot.report import machine, table
from studies.pages import DATA, PAGES, claim, put_page
from studies.peers import keep, read_comparisons, show

KEPT = DATA / "finite_strain.csv"
PAGE = PAGES / "finite-strain.md"
AGREES = 1e-3  # of the largest resultant
ENOUGH = 7     # decks of ten that agree
SMALL = [5e4, 5e6, 5e8]  # the penalties at small strain

PARAMETERS = "*PARAMETER\nn = 8\nE = 200.\nnu = 0.3\n"
NEO = "*HYPERELASTIC, NEO HOOKE\n<{E}/(4*(1+nu))>, <6*(1-2*nu)/({E})>\n"
SOFT, HARD = NEO.format(E="E"), NEO.format(E="3*E")
GROUND = "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., {z},  {slope}, 0., 1.\n"
CUBE = ("<n>", "<n>", "<n>")


def block(name, low, size, cells):
    """Return the card of a block."""
    words = [", ".join(map(str, numbers)) for numbers in (low, size)]
    return (f"*BLOCK, NAME={name}, ELSET={name}, TYPE=C3D8, NX={cells[0]}, NY={cells[1]}, "
            f"NZ={cells[2]}\n{',  '.join(words)}\n")


def made_of(name, law, *bodies):
    """Return the cards of a material and the bodies of it."""
    sections = "".join(f"*SOLID SECTION, ELSET={body}, MATERIAL={name}\n" for body in bodies)
    return f"*MATERIAL, NAME={name}\n{law}{sections}"


def contact(slave, master, mu):
    """Return the cards of a contact pair."""
    friction = f"*FRICTION\n{mu}\n" if mu else ""
    return (f"*SURFACE INTERACTION, NAME=TOUCH\n{friction}*CONTACT PAIR, INTERACTION=TOUCH\n"
            f"{slave}, {master}\n")


def steps(*each, nlgeom=", NLGEOM"):
    """Return the steps: of each the number of increments and the lines of its loading cards."""
    text = "*CONTACT SOLVER, TOLERANCE=1e-10\n"
    for k, (increments, *lines) in enumerate(each):
        text += f"*STEP{'' if k else nlgeom}\n*STATIC, DIRECT\n{1 / increments:.12g}, 1.\n"
        text += "".join(f"{line}\n" for line in lines) + "*END STEP\n"
    return text


def on_ground(law, mu, *each, z=0.0, slope=0.0):
    """Return the deck of a cube on a plane."""
    return (PARAMETERS + block("B", (0, 0, 0), (1, 1, 1), CUBE) + made_of("M", law, "B")
            + GROUND.format(z=z, slope=slope) + contact("B-ZMIN", "GROUND", mu) + steps(*each))


def pressed(increments, depth):
    """Return a step that presses the upper side of a cube."""
    return (increments, "*BOUNDARY", "B-ZMAX, 1, 2", f"B-ZMAX, 3, 3, {-depth}")


def stacked(joint, slide=0.2, lower=HARD):
    """Return the deck of two cubes with meshes that match; the lower one is harder if not said."""
    return (PARAMETERS + block("A", (0, 0, 1), (1, 1, 1), CUBE)
            + block("L", (0, 0, 0), (1, 1, 1), CUBE) + made_of("M", SOFT, "A")
            + made_of("N", lower, "L") + joint
            + steps((5, "*BOUNDARY", "L-ZMIN, 1, 3", "A-ZMAX, 1, 2", "A-ZMAX, 3, 3, -0.3"),
                    (5, "*BOUNDARY", f"A-ZMAX, 1, 1, {slide}")))


def unlike(upper, lower, mu=0.3, depth=0.2, slide=0.25, finite=True):
    """Return the deck of a cube on a wider block, `upper` elements on 1 and `lower` on 1.5."""
    law, nlgeom = (SOFT, ", NLGEOM") if finite else ("*ELASTIC\n<E>, <nu>\n", "")
    each = [(6, "*BOUNDARY", "L-ZMIN, 1, 3", "A-ZMAX, 1, 2", f"A-ZMAX, 3, 3, {-depth}")]
    if slide:
        each.append((10, "*BOUNDARY", f"A-ZMAX, 1, 1, {slide}"))
    return (PARAMETERS + block("A", (0.25, 0.25, 1), (1, 1, 1), (upper,) * 3)
            + block("L", (0, 0, 0), (2, 1.5, 1), (4 * lower // 3, lower, lower))
            + made_of("M", law, "A", "L") + contact("A-ZMIN", "L-ZMAX", mu)
            + steps(*each, nlgeom=nlgeom))


def half_bar(first, z, cells):
    """Return nodes and elements of half of the bar, ids from `first` on: rows of numbers."""
    nx, ny, nz = cells
    def node(i, j, k):
        return first + i + (nx + 1) * (j + (ny + 1) * k)
    nodes = [(node(i, j, k), i / nx, j / ny, z + k / nz)
             for k in range(nz + 1) for j in range(ny + 1) for i in range(nx + 1)]
    around = ((0, 0), (1, 0), (1, 1), (0, 1))
    elements = [(first + i + nx * (j + ny * k),
                 *(node(i + a, j + b, k + c) for c in (0, 1) for a, b in around))
                for k in range(nz) for j in range(ny) for i in range(nx)]
    return nodes, elements


def bar(turns=9, centre=1.5):
    """Return the deck of two tied halves of a bar whose upper end is turned by 90 degrees.

    Each step turns it about the line x = `centre`, z = 2 along y by an equal part.
    """
    cells = (4, 4, 4)
    text = PARAMETERS
    for name, first, z, law in (("LOW", 1, 0.0, SOFT), ("HIGH", 1001, 1.0, HARD)):
        nodes, elements = half_bar(first, z, cells)
        text += "*NODE\n" + "".join(", ".join(map(str, row)) + "\n" for row in nodes)
        text += f"*ELEMENT, TYPE=C3D8, ELSET={name}\n"
        text += "".join(", ".join(map(str, row)) + "\n" for row in elements)
        layer = cells[0] * cells[1]
        for side, from_, face in (("0", first, 1), ("1", elements[-1][0] - layer + 1, 2)):
            text += (f"*ELSET, ELSET={name}{side}, GENERATE\n{from_}, {from_ + layer - 1}\n"
                     f"*SURFACE, NAME={name}-END{side}\n{name}{side}, S{face}\n")
        text += made_of(name, law, name)
    head = [row for row in nodes if row[3] == 2.0]
    foot = [node for node, *_ in half_bar(1, 0.0, cells)[0] if node <= 25]
    for name, ids in (("FOOT", foot), ("HEAD", [row[0] for row in head])):
        text += f"*NSET, NSET={name}\n" + "".join(f"{node},\n" for node in ids)
    text += "*TIE, NAME=GLUE\nHIGH-END0, LOW-END1\n"
    each = []
    for k in range(1, turns + 1):
        angle = math.radians(90 * k / turns)
        lines = ["*BOUNDARY", *(["FOOT, 1, 3", "HEAD, 2, 2"] if k == 1 else [])]
        for node, x, _, _ in head:
            arm = x - centre
            lines += [f"{node}, 1, 1, {arm * math.cos(angle) - arm:.12g}",
                      f"{node}, 3, 3, {-arm * math.sin(angle):.12g}"]
        each.append((1, *lines))
    return text + steps(*each)


TOUCHING = contact("A-ZMIN", "L-ZMAX", 0.8)
STUCK = contact("A-ZMIN", "L-ZMAX", 10)
TIED = "*TIE, NAME=GLUE\nA-ZMIN, L-ZMAX\n"
DECKS = {  # name: (what it is, the deck)
    "neo": (
        "cube of neo-Hooke on a plane, mu 0.3, pressed by 10 %, dragged by 28 %",
        on_ground(SOFT, 0.3, pressed(5, 0.1),
                  (10, "*BOUNDARY", "B-ZMAX, 1, 1, 0.2", "B-ZMAX, 2, 2, 0.2")),
    ),
    "svk": (
        "cube of St Venant-Kirchhoff (`*ELASTIC`), mu 0.2, pressed by 5 %, dragged by 10 %",
        on_ground("*ELASTIC\n<E>, <nu>\n", 0.2, pressed(5, 0.05),
                  (10, "*BOUNDARY", "B-ZMAX, 1, 1, 0.1")),
    ),
    "mooney": (
        "cube of Mooney-Rivlin, pressed by 30 % on a sloping plane without friction",
        on_ground("*HYPERELASTIC, MOONEY-RIVLIN\n20., 16., 0.006\n", 0, pressed(10, 0.3), z=-0.02,
                  slope=0.3),
    ),
    "roller": (
        "a rigid cylinder, mu 0.3, pressed into a strip of neo-Hooke by 20 %",
        PARAMETERS + block("B", (-1, 0, 0), (2, 0.25, 1), ("<2*n>", 1, "<n>"))
        + made_of("M", SOFT, "B")
        + "*OBSTACLE, NAME=ROLLER, TYPE=CYLINDER\n0., 0., 2.,  0., 1., 0.,  1.\n"
        + contact("B-ZMAX", "ROLLER", 0.3)
        + steps((8, "*BOUNDARY", "B, 2, 2", "B-ZMIN, 1, 1", "B-ZMIN, 3, 3, 0.2")),
    ),
    "stack": (
        "cubes of unlike neo-Hooke, mu 0.8, matching meshes, pressed by 15 % and sheared",
        stacked(TOUCHING),
    ),
    "unlike": (
        "cube on a wider block, mu 0.3, 5 elements on 6 by 1.5, pressed by 10 % and slid",
        unlike(5, 6),
    ),
    "seal": (
        "seal of neo-Hooke in plane strain, mu 0.5, pressed by 15 %, then pressed from one side by "
        "a fluid that follows it",
        PARAMETERS + block("B", (0, 0, 0), (6, 1, 4), ("<3*n/2>", 1, "<n>"))
        + made_of("M", "*HYPERELASTIC, NEO HOOKE\n100., 0.001\n", "B")
        + GROUND.format(z=0, slope=0) + contact("B-ZMIN", "GROUND", 0.5)
        + steps((5, "*BOUNDARY", "B, 2, 2", "B-ZMAX, 1, 1", "B-ZMAX, 3, 3, -0.6"),
                (5, "*DSLOAD", "B-XMIN, P, 160.")),
    ),
    "strip": (
        "a cantilever ten times as long as high, its end moved across by 70 % of its length, no "
        "contact",
        PARAMETERS + block("B", (0, 0, 0), (5, 0.5, 0.5), ("<4*n>", "<n/4>", "<n/4>"))
        + made_of("M", SOFT, "B")
        + steps((10, "*BOUNDARY", "B-XMIN, 1, 3", "B-XMAX, 2, 2", "B-XMAX, 3, 3, -3.5")),
    ),
    "bar": (
        "a bar of two tied halves, unlike neo-Hooke, one end turned by 90 degrees, no contact",
        bar(),
    ),
    "heat": (
        "cube of neo-Hooke, mu 0.3, pressed by 2 %, then heated by 200 K (alpha dT 0.002)",
        on_ground(SOFT + "*EXPANSION\n1e-5\n", 0.3, pressed(5, 0.02),
                  (5, "*TEMPERATURE", "B, 200.")),
    ),
}
CHECKS = {  # what explains those that differ
    "stuck": stacked(STUCK, 0.0),
    "tied": stacked(TIED, 0.0),
    "alike": stacked(STUCK, 0.0, SOFT),
    "small 2 on 3": unlike(2, 3, 0, 0.002, 0, finite=False),
    "small 4 on 6": unlike(4, 6, 0, 0.002, 0, finite=False),
}


REASONS = {
    "stack": "where all points stick contact is a tie. With mu 10 and without the slide bipot's "
             "resultants are those of the same cubes tied (to 1e-8, "
             "`tests/cases/test_finite_bodies.py`). CalculiX's contact is {stuck} off, its tie "
             "{tied}. Cubes alike, whose faces stretch alike, are {alike} apart: what is off is "
             "CalculiX's friction on faces that stretch, whatever its penalty",
    "unlike": "CalculiX lets no point of the faces penetrate: where the meshes do not match, "
              "the interface is held flatter than the elements on either side would be (see "
              "below). With K above that of the table its iterations do not end",
}


def last_whole(comparison):
    """Return the last run of CalculiX that came to its end, None where none did."""
    whole = [run for run in comparison.of("CalculiX")
             if run.increments == run.total and not run.settings.startswith("mortar")]
    return whole[-1] if whole else None


def settled(run):
    """Return whether a run has no penalty, or one whose tenth changes little."""
    return not run.settings or (
        run.note.startswith("changed by ") and float(run.note.split()[-1]) < CHANGE
    )


def agrees(run):
    """Return whether a run of CalculiX finds our resultants."""
    return run is not None and settled(run) and run.error < AGREES


def rows_of(found):
    """Return the rows of the table of decks."""
    rows = []
    for name in DECKS:
        ours, theirs = found[name].runs[0], last_whole(found[name])
        change = theirs.note.removeprefix("changed by ") if theirs else ""
        rows.append([
            f"`{name}`", f"{found[name].equations}", f"{ours.seconds:.3g}",
            *(["-"] * 5 if theirs is None else [
                f"{theirs.seconds:.3g}", f"{theirs.seconds / ours.seconds:.3g}",
                theirs.settings.split(",")[0].removeprefix("K ") or "-", change or "-",
                f"{theirs.error:.1e}",
            ]),
        ])
    return rows


def error(comparison):
    """Return the error of the last whole run of CalculiX as words."""
    return f"{last_whole(comparison).error:.1e}"


def staggered(found):
    """Return what the blocks at small strain show of meshes that do not match."""
    apart, meet = found["small 2 on 3"], found["small 4 on 6"]
    errors = [run.error for run in apart.of("CalculiX") if run.settings.startswith("K")]
    return [
        "## Meshes that do not match", "",
        claim(errors == sorted(errors) and errors[-1] > 0.05,
              "- Two blocks of 2 on 3 elements (the deck `unlike`, but at small strain, without "
              "friction, pressed by 0.002) differ by "
              f"{', '.join(f'{e:.1e}' for e in errors)} as CalculiX's penalty rises: the stiffer "
              "it is, the further apart. The cause is neither finite strain nor friction."),
        claim(last_whole(meet).error < 1e-4,
              "- With 4 on 6 elements, whose nodes meet on the interface, the same blocks differ "
              f"by {error(meet)}."),
        "- The reason is the number of conditions. CalculiX's face-to-face contact has a penalty "
        "at several points of each overlap of two faces. Between faces that overlap by halves a "
        "surface that nowhere penetrates cannot bend at the nodes of either side: the interface "
        "stays plane. bipot asks for one gap a slave node, a mean over its "
        "faces, which lets both sides bend.",
        "- `studies/run unlike_meshes` has both answers, by elements and a quadratic program of "
        "its own. Force on the upper block for 2 on 3 elements and E = 1: 0.0013785 with one "
        "condition an overlap of two faces, 0.0014504 with four, 0.0014690 with nine, which is "
        "6.6 % more. For 4 on 6 elements it is 0.0013394 with four and with nine.",
    ]


def page(found, where):
    """Return the page's lines."""
    good = [name for name in DECKS if agrees(last_whole(found[name]))]
    ratios = [last_whole(found[name]).seconds / found[name].runs[0].seconds for name in good]
    lines = [
        "# Finite strain beside CalculiX", "",
        f"By `studies/run finite_strain` on {where}, one thread a",
        "program; `studies/data/finite_strain.csv` holds all runs, and the script the decks.",
        "`scripts/compare DECK` does the same for a deck of yours.", "",
        "Elements (C3D8), laws and loads are the same in both programs: CalculiX's `*ELASTIC` with",
        "`NLGEOM` is the law of St Venant and Kirchhoff, as ours. Its contact is node to surface",
        "before planes and cylinders, face to face between bodies, by a linear penalty K and a",
        "stick slope of K/10. K is raised tenfold from 500 moduli over the extent until the",
        f"resultants change by less than {CHANGE:g}. CalculiX may cut increments; its iterations",
        "end at a residual of 1e-6. The difference is that of the contact resultants over all",
        "increments, or of the forces of the supports where nothing touches, relative to the",
        "largest. Times are CPU seconds of whole processes, CalculiX's those of the last K.",
        "", "## Ten decks", "",
        *(f"- `{name}`: {words}" for name, (words, _) in DECKS.items()), "",
        *table(["deck", "equations", "bipot s", "CalculiX s", "ratio", "K", "changed by",
                "difference"], rows_of(found)), "",
        claim(len(good) >= ENOUGH,
              f"- {len(good)} of {len(DECKS)} agree to {AGREES:g}: {', '.join(good)}. There "
              f"CalculiX takes {min(ratios):.2g} to {max(ratios):.2g} times bipot's processor "
              "time. Of `roller` most of that is the ring of 2880 elements that stands for the "
              "cylinder. Dragged as well, it is not in the table: CalculiX's increments were cut "
              "until it was stopped, tried with n = 4 alone."),
        "- `neo`: CalculiX cuts the increments where sliding begins, and has other load steps.",
        "- `heat`: bipot divides the deformation by 1 + alpha dT, CalculiX takes alpha dT off "
        "Green's strain; the difference is of second order.",
    ]
    measured = {name: error(found[name]) for name in ("stuck", "tied", "alike")}
    for name in DECKS:
        if name not in good:
            reason = REASONS.get(name, "").format(**measured)
            lines.append(claim(reason, f"- `{name}`: {reason}."))
    return [*lines, "", *staggered(found)]


def make_runs(options, names):
    """Compare these decks, and keep each comparison as it is made."""
    limits = SimpleNamespace(slope=None, limit=options.limit, iterations={})
    decks = {name: text for name, (_, text) in DECKS.items()} | CHECKS
    for name in names:
        print(name, file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as source:
            deck = Path(source) / "deck.inp"
            deck.write_text(decks[name], encoding="ascii")
            penalties = SMALL if name.startswith("small") else []
            found = compare(options.bipot.resolve(), deck, {}, penalties, Path(folder), limits)
        show(found)
        keep(name, 8, found, KEPT)


def main():
    """Run all and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("-o", dest="page", type=Path, default=PAGE)
    parser.add_argument("--only", default=",".join([*DECKS, *CHECKS]), help="names of decks")
    parser.add_argument("--limit", type=float, default=200.0,
                        help="processor seconds a run of CalculiX")
    parser.add_argument("--page", dest="kept", action="store_true",
                        help="write the page from the runs kept")
    parser.add_argument("--machine", default=machine(), help="where these were made (here)")
    parser.add_argument("--bipot", type=Path, default=ROOT / "build" / "bipot")
    options = parser.parse_args()
    if not options.kept:
        if shutil.which(CCX) is None:
            print(f"{absent('CalculiX')}; no page without it")
            return 77
        make_runs(options, options.only.split(","))
    found = {name: one for (name, _), one in read_comparisons(KEPT).items()}
    lines = [part for line in page(found, options.machine)
             for part in (textwrap.wrap(line, 100, subsequent_indent="  ")
                          if line.startswith("- ") else [line])]
    put_page("\n".join(lines) + "\n", options.page)
    return 0


if __name__ == "__main__":
    sys.exit(main())
