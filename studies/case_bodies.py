"""The cases of docs/studies/cases.md in which bodies touch one another."""

import math

import numpy as np

from studies.case_values import mean_square
from studies.pages import percent, table


def lame(interference=0.0025, radii=(10.0, 20.0, 30.0), modulus=210000.0, nu=0.3):
    """Return the pressure of a press fit of two rings alike in plane stress."""
    a, b, c = (r * r for r in radii)
    outer, inner = (c + b) / (c - b) + nu, (b + a) / (b - a) - nu
    return interference / (radii[1] * (outer + inner) / modulus)


def line_contact(force, radius, modulus):
    """Return half width and peak pressure of Hertz's line contact; `force` is per length."""
    half_width = math.sqrt(4 * force * radius / (math.pi * modulus))
    return half_width, 2 * force / (math.pi * half_width)


def fit_line_contact(pair, row=-1, least=0.3):
    """Fit p^2 = p0^2 (1 - x^2/a^2) where p is at least `least` of its largest; return a, p0."""
    pressure = pair.reaction[row][:, 0] / pair.area
    used = pressure > least * pressure.max()
    slope, p2 = np.polyfit(mean_square(pair.coordinates[:, 0])[used], pressure[used] ** 2, 1)
    return math.sqrt(-p2 / slope), math.sqrt(p2)


def sinks(result):
    """Return how far the base's node at the origin goes down; the other body's comes first."""
    here = np.flatnonzero(np.abs(result.points).max(axis=1) < 1e-9)
    node = max(here, key=lambda index: result.node_ids[index])
    return -float(result.field("displacement", -1)[node, 2])


# --- The part of the page -------------------------------------------------------------------------


def press(runs):
    """Lame: mean pressure of a press fit, against the mesh."""
    expected = lame()
    rows = []
    for n in (2, 4, 8, 16):
        with runs("press", mesh=("rings", n)) as result:
            pair = result.pairs[0]
            pressure = pair.reaction[-1][:, 0] / pair.area
            mean = pair.reaction[-1][:, 0].sum() / pair.area.sum()
            spread = np.ptp(pressure) / mean
        rows.append([n, len(pressure), f"{mean:.4f}", percent(mean, expected),
                     f"{100 * spread:.1f} %"])
    return f"""\
## Press fit: `press.inp`

A ring shrunk onto a hub, alike in material, with free ends: radii 10, 20 and 30, interference
0.0025. Source: Lame, plane stress: {expected:.4f}. Polygons with different numbers of sides
touch, so pressures vary from point to point: the last column is the largest less the smallest,
beside the mean.

{table(["elements across a ring", "points", "mean pressure", "error", "largest - smallest"], rows)}
"""


def cylinder(runs):
    """NAFEMS R0094, benchmark 1: half width, peak pressure and how far the block sinks."""
    half_width, peak = line_contact(35000.0, 50.0, 1 / (0.91 / 210000 + 0.91 / 70000))
    published = {0: 1.30690, 0.1: 1.30108}
    rows, sunk = [], {}
    for n in (4, 8, 12):
        for mu, steps in ((0, 1), (0.1, 10)):
            with runs("cylinder", mesh=("cylinder", n), mu=mu, steps=steps) as result:
                a, p0 = fit_line_contact(result.pairs[0])
                sunk[n, mu] = sinks(result)
            rows.append([n, mu, f"{a:.4f}", percent(a, half_width) if mu == 0 else "",
                         f"{p0:.1f}", percent(p0, peak) if mu == 0 else "",
                         f"{sunk[n, mu]:.5f}", percent(sunk[n, mu], published[mu])])
    heads = ["n", "mu", "half width", "error", "peak pressure", "error", "the block sinks by",
             "beside the published"]
    return f"""\
## Cylinder on a block: `cylinder.inp`

A steel cylinder of radius 50 on an aluminium block of 200 by 200, plane strain, 35 kN per mm.
Source: NAFEMS R0094 (Konter 2006), benchmark 1. Hertz: half width {half_width:.2f}, peak pressure
{peak:.0f}; both are fitted to p^2 = p0^2 (1 - x^2/a^2) where p is above 0.3 p0.

{table(heads, rows)}

The published displacements, 1.3069 and 1.3011 with linear elements, are not those of linear
theory: strains reach 3 % at contact and rotations 0.07, and the benchmark counts them. CalculiX
on the mesh with n = 4 says the same: 1.269 without `NLGEOM`, 1.303 with it; bipot {sunk[4, 0]:.3f}.
"""


def punch(runs):
    """NAFEMS R0094, benchmark 2: how far the base sinks below the punch."""
    published = {0: (0.13073, 0.13294), 0.1: (0.12858, 0.13079)}
    rows, sunk = [], {}
    for n in (3, 4, 6):
        for mu, steps in ((0, 1), (0.1, 5)):
            with runs("punch", mesh=("punch", n), mu=mu, steps=steps) as result:
                sunk[n, mu] = sinks(result)
                force = result.pairs[0].resultant[-1][2]
            rows.append([n, mu, f"{force:.0f}", f"{sunk[n, mu]:.5f}",
                         *(percent(sunk[n, mu], value) for value in published[mu])])
    heads = ["n", "mu", "force", "the base sinks by", "beside linear", "beside quadratic"]
    effect = (sunk[6, 0] - sunk[6, 0.1]) / (published[0][1] - published[0.1][1])
    return f"""\
## Punch: `punch.inp`

A steel punch with a rounded edge on an aluminium base under 100 MPa; a quarter of both. Source:
NAFEMS R0094 (Konter 2006), benchmark 2: at the middle of the contact the base sinks by 0.13073
with linear and 0.13294 with quadratic elements without friction, by 0.12858 and 0.13079 with mu =
0.1.

{table(heads, rows)}

The circle is a polygon of 4 n sides in a quarter, so a coarse mesh carries less than pi/4 100^2 /
4 times 100: {25 * math.pi * 2500:.0f}. With n = 6 friction changes the displacement by
{100 * effect:.0f} % of what it does in the source.
"""


def stack(runs):
    """Statics of a stack whose middle block is held by contact alone."""
    with runs("stack") as result:
        above, below = (result.pairs[name] for name in sorted(result.pairs))
        rows = [
            [pair.name, *(f"{value:.6f}" for value in pair.resultant[-1]),
             f"{pair.friction_sum[-1] / pair.normal_sum[-1]:.6f}"]
            for pair in (above, below)
        ]
        apart = np.abs(above.resultant[-1] - below.resultant[-1]).max()
    return f"""\
## Stack: `stack.inp`

Three blocks; contact alone holds the one in the middle, which slides below (mu = 0.2) and sticks
above (mu = 0.6). Source: statics: both interfaces carry the same force. They differ by
{apart:.0e}.

{table(["pair", "x", "y", "z", "friction over normal forces"], rows)}
"""
