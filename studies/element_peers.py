"""Blocks of any type of element, here and in CalculiX: one on a held slab, and two.

CalculiX presses Gauss points of faces with a penalty (TYPE=SURFACE TO SURFACE): its forces are
extrapolated to no compliance from two stiffnesses, linearly in 1 over them.
"""

import subprocess
from pathlib import Path

import numpy as np

from bipot.peers.calculix_deck import read_resultants
from bipot.program import RunError, with_threads
from bipot.result import Result
from studies.solid_meshes import SolidMesh

LONGEST = 150  # of a run of ccx [s]
STIFFNESSES = (5e7, 2e8)  # pressure over penetration; of sticking a third of it
CASES = ("C3D10 on C3D10", "C3D20R on C3D20R", "C3D15 on C3D15", "C3D10 on C3D8", "C3D20R on C3D10")
UPPER, LOWER = 4, 6  # elements along an edge of bodies of second order
ON_SLAB = (("C3D10", 2), ("C3D10", 4), ("C3D15", 2), ("C3D15", 4))  # on a slab that is held
INCREMENTS = (2, 8)  # pressed, pushed
PRESSED, PUSHED = -1e-4, (2e-4, 3.46410161513775e-4)
CONTACT = """*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
{k!r}
"""


def divisions(kind, n):
    """Return the elements along an edge: of linear types twice as many."""
    return n if kind in ("C3D10", "C3D15", "C3D20", "C3D20R") else 2 * n


def bent(x):
    """Move what is inside a unit cube out of place, corners and mid-side nodes alike."""
    inside = np.prod(4 * x * (1 - x), axis=1)[:, None]
    return x + 0.04 * inside * np.sin(5 * x[:, [1, 2, 0]])


def mesh_of(case, n):
    """Return the cards of the bodies of a case, "TYPE" or "TYPE on TYPE", sets and all."""
    upper, _, lower = case.partition(" on ")
    grid = np.linspace(0, 1, divisions(upper, n) + 1)
    up = SolidMesh("UP", upper, (grid,) * 3, 1, bent)
    text = up.cards() + up.set_cards("SOLE", up.nodes(2, 0)) + up.set_cards("TOP", up.nodes(2, 1))
    if lower:
        n = LOWER * divisions(lower, n) // UPPER
        grid = np.linspace(0, 1, n + 1)
        low = SolidMesh("LOW", lower, (grid, grid, grid - 1), 100001)
    else:
        low = SolidMesh("LOW", "C3D8", ([-1.0, 2.0], [-1.0, 2.0], [-1.0, 0.0]), 100001)
    return text + low.cards() + low.set_cards("SEAT", low.nodes(2, 1)) + low.set_cards(
        "FLOOR", low.nodes(2, 0) if lower else np.arange(len(low.x)))


def steps(printed=""):
    """Return the two steps."""
    first, second = (1 / n for n in INCREMENTS)
    return (
        f"*STEP{printed and ', INC=1000'}\n*STATIC, DIRECT\n{first!r}, 1.\n*BOUNDARY\n"
        f"TOP, 1, 2, 0.\nTOP, 3, 3, {PRESSED!r}\n{printed}*END STEP\n"
        f"*STEP{printed and ', INC=1000'}\n"
        f"*STATIC, DIRECT\n{second!r}, 1.\n*BOUNDARY\nTOP, 1, 1, {PUSHED[0]!r}\n"
        f"TOP, 2, 2, {PUSHED[1]!r}\n{printed}*END STEP\n"
    )


def deck(case, stiffness=None, n=UPPER):
    """Return the deck of a case, for CalculiX with a stiffness."""
    alone = " on " not in case
    pair = "SOLE-F, SEAT-F" if stiffness or not alone else "SOLE, GROUND"
    kind = ", TYPE=SURFACE TO SURFACE" if stiffness or not alone else ""
    sliding = "" if stiffness or alone else ", SMALL SLIDING"
    friction = f"0.3, {stiffness / 3!r}" if stiffness else "0.3"
    plane = "" if stiffness or not alone else (
        "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n")
    printed = "*NODE PRINT, NSET=PRINTED, TOTALS=ONLY\nRF\n" if stiffness else ""
    return (
        mesh_of(case, n) + "*NSET, NSET=PRINTED\nTOP\n*MATERIAL, NAME=M\n*ELASTIC\n210000., 0.3\n"
        "*SOLID SECTION, ELSET=UP, MATERIAL=M\n*SOLID SECTION, ELSET=LOW, MATERIAL=M\n" + plane
        + "*SURFACE INTERACTION, NAME=DRY\n" + (CONTACT.format(k=stiffness) if stiffness else "")
        + f"*FRICTION\n{friction}\n*CONTACT PAIR, INTERACTION=DRY{kind}{sliding}\n{pair}\n"
        + "*BOUNDARY\nFLOOR, 1, 3, 0.\n" + steps(printed)
    )


def ours(program, case, folder, n):
    """Return the resultants on the upper body over the increments."""
    path, result = Path(folder) / "ours.inp", Path(folder) / "ours.vtkhdf"
    path.write_text(deck(case, None, n), encoding="utf-8")
    done = subprocess.run([program, path, "-o", result, "--overwrite", "-q"], check=False,
                          capture_output=True, text=True, env=with_threads())
    if done.returncode:
        raise RunError(f"{case}: {done.stderr}")
    with Result(result) as found:
        return found.pairs[0].resultant


def calculix(case, folder, n):
    """Return the same of CalculiX, extrapolated."""
    found = []
    for stiffness in STIFFNESSES:
        name = Path(folder) / "ccx"
        text = deck(case, stiffness, n).replace("PRINTED", "SUPPORT1")
        name.with_suffix(".inp").write_text("*HEADING\nblocks\n" + text, encoding="utf-8")
        try:
            subprocess.run(["ccx", "ccx"], cwd=folder, check=False, capture_output=True,
                           env=with_threads(), timeout=LONGEST)
        except subprocess.TimeoutExpired as error:
            raise RunError(f"ccx does not end: {case}") from error
        found.append(-read_resultants(name.with_suffix(".dat"), 1)[:, 0])
        if len(found[-1]) != sum(INCREMENTS):
            raise RunError(f"ccx ended in increment {len(found[-1]) + 1} of {case}")
    (a, b), (k, m) = found, STIFFNESSES
    return b + (b - a) * (1 / m) / (1 / k - 1 / m)


def compare(program, case, folder, n=UPPER):
    """Return the largest differences while it is pressed, while part sticks, and while all slides.

    Of the largest force; nothing where CalculiX does not end.
    """
    here = ours(program, case, folder, n)
    try:
        there = calculix(case, folder, n)
    except RunError as error:
        print(error)
        return {}
    apart = np.linalg.norm(here - there, axis=1) / np.linalg.norm(here, axis=1).max()
    slides = np.hypot(here[:, 0], here[:, 1]) > 0.2999 * abs(here[:, 2])
    presses = np.arange(len(here)) < INCREMENTS[0]
    return {name: apart[which].max(initial=0.0) for name, which in
            (("pressed", presses), ("sticking", ~presses & ~slides), ("sliding", slides))}
