"""The contact solvers on other elements than C3D8: a section of docs/studies/solvers.md.

    studies/run solver_elements           runs, studies/data/solver_elements.csv, and the section
    studies/run solver_elements --page    the section alone

The paper's block, and a block on another whose faces do not match, of C3D8, C3D4, C3D10 and C3D20R:
sweeps and local iterations of each solver, and how far its reactions are from those of the others.
"""

import argparse
import csv
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bipot.program import RunError, built_program, program_path, with_threads
from bipot.result import Result
from studies.deck_cards import pair, step
from studies.element_scenes import block_deck, material
from studies.pages import DATA, PAGES, StudyError, claim, table
from studies.solid_meshes import SolidMesh

KEPT = DATA / "solver_elements.csv"
PAGE = PAGES / "solvers.md"
HEADING = "## Other elements"
HEADS = ("scene", "type", "solver", "iterations", "local", "difference")
TYPES = {"C3D8": 4, "C3D4": 4, "C3D10": 2, "C3D20R": 2}  # elements along an edge
STEPS = 10
SAME = 1e-8  # of the largest reaction
SWEEPS = "SOLVER=SWEEPS, MAX SWEEPS=200000, TOLERANCE=1e-11, "
SOLVERS = {
    "Uzawa, rho = 1": SWEEPS + "LOCAL=UZAWA",
    "Uzawa, rho = 0.3": SWEEPS + "LOCAL=UZAWA, RHO=0.3",
    "Uzawa, pseudo-potential": SWEEPS + "LOCAL=UZAWA, FORMULATION=PSEUDOPOTENTIAL",
    "Newton": SWEEPS + "LOCAL=NEWTON",
    "Newton, pseudo-potential": SWEEPS + "LOCAL=NEWTON, FORMULATION=PSEUDOPOTENTIAL",
    "exact local solution": SWEEPS + "LOCAL=EXACT",
    "global Newton": "SOLVER=GLOBAL NEWTON, TOLERANCE=1e-11",
}

def two_deck(kind, n, steps, solver):
    """Return a block on another, pressed and pushed by a thousandth of their edges; n on 3 n/2."""
    up = SolidMesh("UP", kind, (np.linspace(0, 1, n + 1),) * 3)
    grid = np.linspace(0, 1, 3 * n // 2 + 1)
    low = SolidMesh("LOW", kind, (1.2 * grid - 0.1, 1.2 * grid - 0.1, grid - 1), 100001)
    return (
        up.cards() + low.cards() + up.set_cards("SOLE", up.nodes(2, 0))
        + up.set_cards("TOP", up.nodes(2, 1)) + low.set_cards("SEAT", low.nodes(2, 1))
        + low.set_cards("FLOOR", low.nodes(2, 0)) + material(210000.0, 0.3, "UP", "LOW")
        + pair("SOLE-F, SEAT-F", 0.3, ", TYPE=SURFACE TO SURFACE, SMALL SLIDING")
        + f"*CONTACT SOLVER, {solver}\n*BOUNDARY\nFLOOR, 1, 3\n"
        + step("TOP, 1, 2, 0.\nTOP, 3, 3, -0.001", steps // 5)
        + step("TOP, 1, 1, 0.001\nTOP, 2, 2, 0.00173205", 4 * steps // 5)
    )


SCENES = {"one block": block_deck, "two blocks": two_deck}


def run(program, text, folder):
    """Return reactions over the increments, and the counts of iterations and of local ones."""
    deck, path = Path(folder) / "deck.inp", Path(folder) / "deck.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    done = subprocess.run([program, deck, "-o", path, "--overwrite", "-q"], check=False,
                          capture_output=True, text=True, env=with_threads())
    if done.returncode:
        raise RunError(done.stderr)
    with Result(path) as result:
        return (result.pairs[0].reaction, int(result.history("contact_iterations").sum()),
                int(result.history("local_iterations").sum()))


def compare(program, scene, kind, folder, n=None, steps=STEPS):
    """Return a row for each solver; differences are from the global Newton."""
    n = TYPES[kind] if n is None else n
    found = {name: run(program, SCENES[scene](kind, n, steps, solver), folder)
             for name, solver in SOLVERS.items()}
    true = found["global Newton"][0]
    return [
        {"scene": scene, "type": kind, "solver": name, "iterations": iterations, "local": local,
         "difference": f"{abs(reaction - true).max() / abs(true).max():.1e}"}
        for name, (reaction, iterations, local) in found.items()
    ]


def section(rows):
    """Return the section of the page."""
    worst = max(float(row["difference"]) for row in rows)
    same = claim(worst <= SAME, f"All find the same reactions, to {worst:.0e} of the largest")
    of = {(row["scene"], row["type"], row["solver"]): row for row in rows}
    tables = []
    for scene in SCENES:
        lines = [
            [name, *(f"{of[scene, kind, name]['iterations']}, {of[scene, kind, name]['local']}"
                     if name != "global Newton" else of[scene, kind, name]["iterations"]
                     for kind in TYPES)]
            for name in SOLVERS
        ]
        tables.append(table([scene, *(f"{kind}, n = {n}" for kind, n in TYPES.items())], lines))
    first, second = tables
    newton = {(scene, kind): int(of[scene, kind, "Newton"]["iterations"])
              for scene in SCENES for kind in TYPES}
    ratios = [newton[scene, kind] / newton[scene, "C3D8"]
              for scene in SCENES for kind in ("C3D10", "C3D20R")]
    linear = [newton[scene, "C3D4"] / newton[scene, "C3D8"] for scene in SCENES]
    easy = claim(max(ratios) <= 1, "mid-side nodes make the contact problem no harder")
    return f"""\
{HEADING}

By `studies/run solver_elements`. The block in {STEPS} steps, and a block on another that is wider
and whose faces do not match, of other types of elements. Those of second order have half as many
along an edge, and so as many points (`C3D20R` fewer: none in the middles of faces).
{same}, with every solver, to a residual of 1e-11.

On elements of second order Newton takes {min(ratios):.2g} to {max(ratios):.2g} times the sweeps of
`C3D8`: {easy}. On `C3D4` it takes
{min(linear):.2g} to {max(linear):.2g} times as many. Sweeps and local iterations (of the
global Newton its iterations):

{first}

{second}
"""


def with_section(page, text):
    """Return the page with the section in the place of the old one, or before `What was run`."""
    old = re.search(rf"^{HEADING}\n.*?(?=^## )", page, re.DOTALL | re.MULTILINE)
    if old:
        return page[: old.start()] + text + "\n" + page[old.end() :]
    return page.replace("## What was run\n", f"{text}\n## What was run\n")


def read_kept():
    """Return the rows kept."""
    with KEPT.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def main():
    """Make the runs, and the section."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, default=program_path(), help="the program")
    parser.add_argument("--page", action="store_true", help="write the section alone")
    options = parser.parse_args()
    try:
        if not options.page:
            program, rows = built_program(options.bipot).resolve(), []
            with tempfile.TemporaryDirectory() as folder:
                for scene in SCENES:
                    for kind in TYPES:
                        rows += compare(program, scene, kind, folder)
                        print(scene, kind, flush=True)
            with KEPT.open("w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, HEADS, lineterminator="\n")
                writer.writeheader()
                writer.writerows(rows)
        text = with_section(PAGE.read_text(encoding="utf-8"), section(read_kept()))
        PAGE.write_text(text, encoding="utf-8")
    except (StudyError, RunError) as error:
        sys.exit(f"solver_elements: {error}")


if __name__ == "__main__":
    main()
