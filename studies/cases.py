"""Run the cases whose results are known from others; write docs/studies/cases.md and its figures.

Every number of the page that is ours is read from these runs. The program is built first:
scripts/run builds it.
"""

import sys

import numpy as np

from bipot.figures import BLUE, GREEN, INK, ORANGE, new_axes, save
from bipot.program import RunError, script_options
from bipot.result import OPEN, ResultError
from studies import case_bodies, published_bodies
from studies.case_values import (
    contact_points,
    contact_radius,
    fit_hertz,
    fit_line,
    fit_mindlin,
    hertz,
    stick_radius,
)
from studies.pages import PAGES, fresh_runs, percent, table

ELEMENTS = {"C3D8": (BLUE, "o"), "C3D8I": (ORANGE, "s"), "C3D8B": (GREEN, "^")}

SSNV128 = {0.0: 2.86, 0.00125: 2.72, 0.005: 2.28, 0.0075: 1.98, 0.01125: 1.50}


# --- Plate with friction --------------------------------------------------------------------------


def plate(runs, folder):
    """SSNV128: displacements along the lower face."""
    figure, axes = new_axes()
    columns = {}
    for n, colour, line in ((32, ORANGE, "--"), (64, GREEN, ":"), (128, BLUE, "-")):
        with runs("ssnv128", n=n) as result:
            u = result.field("displacement", -1)[:, 0]
            places = [result.nearest_node((x, 0, 0)) for x in SSNV128]
            columns[n] = [1e5 * u[node] for node in places]
            points = result.points
            line_up = np.flatnonzero((points[:, 1] == 0) & (points[:, 2] == 0))
            x, y = 1e3 * points[line_up, 0], 1e5 * u[line_up]
            axes.plot(x, y, line, color=colour, label=f"n = {n}")
            if n == 32:
                pair = result.pairs[0]
                here = np.isclose(pair.coordinates[:, 0], 0.03875)
                beside = pair.reaction[-1, here, 0].sum() / points[:, 1].max()
    with runs("ssnv128", n=32, element="C3D8I") as result:
        u = result.field("displacement", -1)[:, 0]
        columns["C3D8I"] = [1e5 * u[result.nearest_node((x, 0, 0))] for x in SSNV128]
    axes.plot([1e3 * x for x in SSNV128], list(SSNV128.values()), "o", color=INK, label="published")
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("tangential displacement (1e-5 m)")
    axes.legend()
    save(figure, folder / "case-ssnv128.png")
    rows = [
        [f"{x:g}", f"{value:.2f}", *(f"{columns[key][i]:.4f}" for key in (32, 64, 128, "C3D8I")),
         percent(columns[32][i], value)]
        for i, (x, value) in enumerate(SSNV128.items())
    ]
    heads = ["x (m)", "published", "n = 32", "n = 64", "n = 128", "n = 32, C3D8I", "error, n = 32"]
    drift = max(abs(a / b - 1) for a, b in zip(columns[32], columns[128], strict=True))
    return f"""\
## Plate with friction: `ssnv128.inp`

Half of a square plate in plane strain stands on a rigid plane, mu = 1; 50 MPa press on it from
above, 150 MPa from its free side. From the free corner inwards it lifts, slides, then sticks.

Source: SSNV128 of Code_Aster (V6.04.128), after the GRECO benchmarks; its values are within 5 %.
Displacements in 1e-5 m:

{table(heads, rows)}

n = 32, the source's mesh, is within {100 * drift:.2f} % of n = 128. The source's own run has a
normal force of 1.04864e5 N/m at x = 0.03875; here it is {beside:.6g}. The load grows in
proportion, and so does the solution: one increment does.

![Displacement along the lower face](figures/case-ssnv128.png)
"""


# --- Hertz ----------------------------------------------------------------------------------------


def spheres(runs, folder):
    """Hertz by a gap and by a curved obstacle: pressures, and errors against the mesh."""
    figure, (left, right) = new_axes(2)
    modulus = 20000 / 0.91
    rows = []
    errors = {}
    for case, n, a, colour, mark in (
        ("hertz", 8, 10, None, None),
        ("hertz", 12, 10, None, None),
        ("hertz", 16, 10, BLUE, "o"),
        ("hertz", 24, 10, None, None),
        ("ball", 8, 1, None, None),
        ("ball", 12, 1, None, None),
        ("ball", 16, 1, ORANGE, "x"),
        ("ball", 24, 1, None, None),
    ):
        with runs(case, n=n) as result:
            points = contact_points(result.pairs[0])
        p0 = 2 * modulus * a / (np.pi * 50)
        found = fit_hertz(points)
        inside = np.sqrt(points.r2)
        errors.setdefault(case, []).append((n, found[0] / a - 1, found[1] / p0 - 1))
        rows.append(
            [f"`{case}`", n, int(((points.r2 < a * a) & (points.pressure > 0)).sum()),
             f"{found[0]:.4f}", percent(found[0], a), f"{found[1]:.2f}", percent(found[1], p0)]
        )
        if mark:
            left.plot(inside / a, points.pressure / p0, mark, color=colour, markersize=4,
                      markerfacecolor="none", label=f"{case}, n = {n}")
    r = np.linspace(0, 1, 200)
    left.plot(r, np.sqrt(1 - r * r), color=INK, linewidth=1, label="Hertz")
    left.set_xlim(0, 1.4)
    left.set_xlabel("r/a")
    left.set_ylabel("p/p0")
    left.legend(fontsize=8)
    for case, colour in (("hertz", BLUE), ("ball", ORANGE)):
        n, radius, peak = np.array(errors[case]).T
        right.plot(n, 100 * radius, "o-", color=colour, label=f"{case}: a")
        right.plot(n, 100 * peak, "s--", color=colour, label=f"{case}: p0")
    right.axhline(0, color=INK, linewidth=0.8)
    right.set_xlabel("elements along an edge")
    right.set_ylabel("error (%)")
    right.legend(fontsize=8)
    figure.set_size_inches(8.4, 3.6)
    save(figure, folder / "case-hertz.png")
    heads = ["deck", "n", "points in contact", "a", "error", "p0", "error"]
    with runs("ball", a=10) as result:
        large = fit_hertz(contact_points(result.pairs[0]))
    return f"""\
## Hertz: `hertz.inp`, `ball.inp`

`hertz.inp` presses a flat block on a rigid plane with the gap of a sphere, r^2/2R; `ball.inp`
presses a rigid ball under force into a block. A quarter of each, frictionless.

Source: Hertz (1882); the numbers of `hertz.inp` are those of SSNV104 of Code_Aster (V6.04.104: R
= 50, E = 20000, nu = 0.3, 2 mm of approach): a = 10, p0 = 2798.3. A prescribed approach compares
badly: a block of size L is stiffer than a half space by a share of the order a/L, here 1/8. Under
a prescribed force, F = 4/3 E* a^3/R, the block's size enters radius and pressure only as (a/L)^3,
0.2 %. So the force is prescribed: in `hertz.inp` as a pressure on top, where only contact holds
the block; in `ball.inp` on the ball's reference node, with a = 1, p0 =
{2 * modulus / (np.pi * 50):.2f}.

a and p0 are fitted to p^2 = p0^2 (1 - r^2/a^2) where p is above 0.3 p0; a node's r^2 is averaged
with its shape function, as its pressure is (`studies/case_values.py`).

{table(heads, rows)}

The theory takes the ball for a paraboloid and the surface for flat. At a/R = 0.2 (`ball.inp` with
`--set a=10`) this is no longer so: a = {large[0]:.3f} ({percent(large[0], 10)}), p0 =
{large[1]:.1f} ({percent(large[1], 2798.3)}).

![Pressure of a sphere](figures/case-hertz.png)
"""


def roller(runs):
    """Line contact under a rigid cylinder."""
    rows = []
    p0 = 20000 / 0.91 / 100
    for n in (16, 32, 64):
        with runs("roller", n=n) as result:
            a, peak = fit_line(result.pairs[0])
        rows.append([n, f"{a:.4f}", percent(a, 1), f"{peak:.3f}", percent(peak, p0)])
    return f"""\
## Roller: `roller.inp`

A rigid cylinder under force on a block in plane strain, half of it; the cylinder is an obstacle
with a reference node.

Source: Hertz's line contact (Johnson, *Contact Mechanics*, 4.2): a = 1, p0 =
E* a/(2 R) = {p0:.3f} for P = pi E* a^2/(4 R).

{table(["n", "a", "error", "p0", "error"], rows)}
"""


# --- Spence ---------------------------------------------------------------------------------------


def spence_values(result):
    """Return contact radius over Hertz's, stick over contact radius, peak over Hertz's, points."""
    points = contact_points(result.pairs[0])
    a, p0 = hertz(4 * points.normal, 121.5, 1.0)
    edge = contact_radius(points)
    return edge / a, stick_radius(points, 0.2986) / edge, points.pressure.max() / p0, points


def spence(runs, folder):
    """Normal load with friction: stick radius against mesh and increments."""
    figure, (left, right) = new_axes(2)
    rows = []
    for n in (16, 24, 32):
        with runs("spence", n=n, steps=20) as result:
            radius, share, peak, points = spence_values(result)
        rows.append([n, int((points.status != OPEN).sum()), f"{radius:.4f}", f"{share:.4f}",
                     percent(share, 0.5), f"{peak:.4f}", percent(peak, 1.31)])
    a, p0 = hertz(4 * points.normal, 121.5, 1.0)
    touches = points.pressure > 0
    r = np.sqrt(points.r2[touches]) / a
    left.plot(r, points.pressure[touches] / p0, "o", color=BLUE, markersize=2.5, label="p")
    left.plot(r, points.traction[touches] / (0.2986 * p0), "o", color=ORANGE, markersize=2.5,
              label="t/mu")
    line = np.linspace(0, 1, 200)
    left.plot(line, np.sqrt(1 - line**2), color=INK, linewidth=1, label="p without friction")
    left.axvline(share * radius, color=GREEN, linestyle="--", linewidth=1)
    left.set_xlabel("r over Hertz's contact radius")
    left.set_ylabel("over Hertz's peak pressure")
    left.legend(fontsize=8)
    counts = (1, 2, 4, 5, 10, 20, 40)
    shares = []
    for steps in counts:
        with runs("spence", n=20, steps=steps) as result:
            shares.append(spence_values(result)[1])
    right.plot(counts, shares, "o-", color=BLUE)
    right.axhline(0.5, color=INK, linewidth=0.8)
    right.set_xscale("log")
    right.set_xticks(counts, [str(count) for count in counts])
    right.minorticks_off()
    right.set_ylim(bottom=0)
    right.set_xlabel("increments")
    right.set_ylabel("stick radius over contact radius")
    figure.set_size_inches(8.4, 3.6)
    save(figure, folder / "case-spence.png")
    heads = ["n", "points in contact", "a over Hertz's", "c/a", "error", "p0 over Hertz's", "error"]
    steps = table(["increments", *counts], [["c/a", *(f"{share:.3f}" for share in shares)]])
    return f"""\
## Spence: `spence.inp`

A sphere pressed on a rigid plane by a normal force alone, mu = 0.2986, nu = 0, as a block with a
parabolic gap. Friction holds the middle; the rim slips inwards.

Source: example spence35 of CONTACT (Kalker 1990, figure 5.25; Spence 1975): stick radius c = 0.5
a; the centre pressure is 1.31 times Hertz's at the same force. c is where t reaches mu p: r^2
fitted as a parabola of 1 - t/(mu p) over the points that stick; a is where p ends, by a fit of
r^2 against p^2. The quarter block is 16 a wide: in one of 8 a the strain of the whole block takes
5 % off c. 20 increments:

{table(heads, rows)}

Friction depends on the way. The contact spreads over points that did not touch before, and every
increment that makes it grow lets new points slip as if they had touched all along. Too few
increments give a wrong stick radius, in equilibrium and certified (n = 20):

{steps}

![Pressure and friction under a sphere](figures/case-spence.png)
"""


# --- Cattaneo and Mindlin -------------------------------------------------------------------------


def mindlin(runs, folder):
    """A tangential force below the limit: traction along the line of symmetry."""
    rows = []
    figure, axes = new_axes()
    for n in (24, 36, 48):
        with runs("mindlin", n=n) as result:
            pair = result.pairs[0]
            points = contact_points(pair)
            traction = -pair.force[-1, :, 0] / pair.area
            middle = np.isclose(pair.coordinates[:, 1], 0) & (points.pressure > 0)
            ratio = abs(pair.resultant[-1, 0] / pair.resultant[-1, 2])
        a, p0 = fit_hertz(points)
        c, centre = fit_mindlin(points, 0.4)
        rows.append([n, int((points.status != OPEN).sum()), f"{a:.4f}", percent(a, 1), f"{p0:.4f}",
                     percent(p0, 4.39), f"{c / a:.4f}", percent(c / a, 0.5), f"{centre:+.3f}"])
    x = np.linspace(-1, 1, 801)
    limit = 0.4 * 4.39 * np.sqrt(1 - x * x)
    less = np.where(abs(x) < 0.5, 0.5 * 0.4 * 4.39 * np.sqrt(np.maximum(0, 1 - 4 * x * x)), 0)
    axes.plot(x, limit, color=INK, linewidth=0.8, linestyle="--", label="mu p, theory")
    axes.plot(x, limit - less, color=INK, linewidth=1, label="traction, theory")
    axes.plot(points.x[middle], 0.4 * points.pressure[middle], "s", color=BLUE, markersize=4,
              markerfacecolor="none", label=f"mu p, n = {n}")
    axes.plot(points.x[middle], traction[middle] * np.sign(traction[middle].sum()), "o",
              color=ORANGE, markersize=4, label=f"traction, n = {n}")
    axes.set_xlabel("x/a on the line of symmetry")
    axes.set_ylabel("traction (N/mm^2)")
    axes.legend(fontsize=8)
    save(figure, folder / "case-mindlin.png")
    peaks = {}
    for element in ("C3D8", "C3D8B"):
        with runs("mindlin", element=element) as result:
            peaks[element] = fit_hertz(contact_points(result.pairs[0]))[1]
    heads = ["n", "points in contact", "a", "error", "p0", "error", "c/a", "error", "its centre"]
    return f"""\
## Cattaneo and Mindlin: `mindlin.inp`

A rigid ball under force is pressed on a block, then pushed sideways by 7/8 of what would make it
slide: an outer ring slips, the middle sticks. Half of the block; the ball's reference node is
free but for the plane of symmetry.

Source: Cattaneo (1938), Mindlin (1949); the numbers are those of example cattaneo of CONTACT
(Kalker 1990, 5.2.1.1): Fn = 9.1954, mu = 0.4, a = 1, p0 = 4.39, and c = a (1 - Fx/(mu Fn))^(1/3)
= 0.5. There two equal balls meet. Against a rigid ball pressure and friction are independent of
each other, as the theory wants, only where the block is incompressible: nu = 0.4999, and E =
258.6 gives the same E*. So the element is C3D8B; C3D8 locks (n = 24: p0 = {peaks["C3D8"]:.2f},
with C3D8B {peaks["C3D8B"]:.2f}).

c is fitted to (mu p - t)^2 over the points that stick, in theory linear in r^2; the centre of the
stick zone is free in the fit.

{table(heads, rows)}

The tool's force arrives: Fx/Fn = {ratio:.6f} = 7/8 0.4. The block reaches 4 a down and to each
side: worth 1 to 2 % of p0, and its tilt moves the stick zone sideways. The mesh is uniform along
x (the finest elements of a graded block are at its end), so it takes n = 48 for 6 elements in a
radius.

![Traction along the line of symmetry](figures/case-mindlin.png)
"""


# --- Elements -------------------------------------------------------------------------------------


def tip_ratio(result):
    """Return the tip's deflection over Timoshenko's, for a uniform pressure and nu = 0."""
    tip = np.isclose(result.points[:, 0], 10.0)
    beam = 0.001 * 10**4 / (8 * 1000 / 12) + 0.001 * 10**2 / (2 * 5 / 6 * 500)
    return -result.field("displacement", -1)[tip, 2].mean() / beam


def strip_modulus(result):
    """Return the mean pressure on the plate over the mean strain."""
    top = np.isclose(result.points[:, 2], 1.0)
    area = result.points[:, 0].max() * result.points[:, 1].max()
    return -result.field("reaction_force", -1)[top, 2].sum() / area / 0.01


def elements(runs, folder):
    """A cantilever and an incompressible strip with all elements."""
    figure, (left, right) = new_axes(2)
    beam, strip = [], []
    across, along = (1, 2, 4, 8), (2, 4, 8, 16, 32)
    theory = 4 / 3 * 2
    for element, (colour, mark) in ELEMENTS.items():
        ratios, moduli = [], []
        for n in across:
            with runs("cantilever", element=element, n=n) as result:
                ratios.append(tip_ratio(result))
        for n in along:
            with runs("incompressible", element=element, n=n) as result:
                moduli.append(strip_modulus(result))
        left.plot(across, ratios, mark + "-", color=colour, label=element)
        right.plot(along, np.array(moduli) / theory, mark + "-", color=colour, label=element)
        beam.append([element, *(f"{ratio:.4f}" for ratio in ratios)])
        strip.append([element, *(f"{modulus:.4f}" for modulus in moduli)])
    left.axhline(1, color=INK, linewidth=0.8)
    left.set_xscale("log", base=2)
    left.set_xticks(across, [str(n) for n in across])
    left.set_xlabel("elements across the beam")
    left.set_ylabel("deflection over Timoshenko's")
    left.legend(fontsize=8)
    right.axhline(1, color=INK, linewidth=0.8)
    right.set_xscale("log", base=2)
    right.set_yscale("log")
    right.set_xticks(along, [str(n) for n in along])
    right.set_xlabel("elements along half the height")
    right.set_ylabel("modulus over Gent and Lindley's")
    right.legend(fontsize=8)
    figure.set_size_inches(8.4, 3.6)
    save(figure, folder / "case-elements.png")
    bent = []
    for slices in (5, 10, 20):
        row = [slices, f"{1 / (1 + (10 / slices) ** 2 / 2):.6f}"]
        for element in ELEMENTS:
            with runs(
                "cantilever", element=element, slices=slices, pressure=0, moment=0.001
            ) as result:
                tip = np.isclose(result.points[:, 0], 10.0)
                found = -result.field("displacement", -1)[tip, 2].mean()
            row.append(f"{found / (0.001 * 10**2 / (2 * 1000 / 12)):.6f}")
        bent.append(row)
    return f"""\
## Cantilever: `cantilever.inp`

A beam ten times as long as high, clamped at one end, with a pressure on top or a moment at its
tip. No contact: how well elements bend.

Source: Timoshenko's beam. Deflection of the tip over q L^4/(8 E I) + q L^2/(2 k G A), nu = 0,
cubes, n of them across the beam:

{table(["element", *(f"n = {n}" for n in across)], beam)}

Bent by a moment, one element across the beam, C3D8 reaches 1/(1 + (l/h)^2/2) of the deflection, l
and h length and height of an element (Cook and others,
*Concepts and Applications of Finite Element Analysis*, 2002), and C3D8I all of it. One layer of
C3D8B is not enough: its volume strain is constant, so in bending only its shape resists, and
where its elements are short it is too soft.

{table(["elements along", "C3D8 by theory", *ELEMENTS], bent)}

## Nearly incompressible strip: `incompressible.inp`

A long strip, twice as wide as high and nu = 0.4999, between plates that are bonded to it. It can
only bulge at its sides.

Source: Gent and Lindley (1959) for a long incompressible strip, mean pressure over mean strain =
4/3 E (1 + S^2), S = width/(2 height) = 1 here: {theory:.4f}. It is a bound from above for thin
strips and very near for this one. n elements along half the height:

{table(["element", *(f"n = {n}" for n in along)], strip)}

C3D8 locks; C3D8B and C3D8I do not.

![Elements](figures/case-elements.png)
"""


# --- Statics --------------------------------------------------------------------------------------


def statics(runs, folder):
    """The cases that statics decides, and the patch test."""
    worst = []
    for element in ELEMENTS:
        with runs("patch", element=element) as result:
            stress = abs(result.field("stress", -1) - np.array([0, 0, -10.0, 0, 0, 0])).max() / 10
            pressure = max(
                abs(pair.reaction[-1, :, 0] / pair.area / 10 - 1).max()
                for pair in result.pairs.values()
            )
        worst.append([element, f"{stress:.1e}", f"{pressure:.1e}"])
    with runs("slope") as result:
        down, up = result.pairs[0].resultant[-1, [0, 2]]
    with runs("rest") as result:
        weight = result.pairs[0].resultant[-1, 2]
    with runs("corner") as result:
        parts = [pair.normal_sum[-1] for pair in result.pairs.values()]
    with runs("bend") as result:
        left, right, top = (
            result.pairs[name].resultant[-1]
            for name in ("BEAM-ZMIN:LEFT", "BEAM-ZMIN:RIGHT", "BEAM-ZMAX:TOP")
        )
    expected = 0.25 + 0.1 * top[0] / top[2]
    with runs("pipe") as result:
        edge = result.pairs[0].normal_sum[-1]
    with runs("pipe", E=1e8) as result:
        stiff = result.pairs[0].normal_sum[-1]
    figure, axes = new_axes()
    with runs("tool", n=24, steps=20) as result:
        pair = result.pairs[0]
        time = np.append(0, result.history("time"))
        axes.plot(time, np.append(0, -pair.resultant[:, 2]), color=BLUE, label="normal force")
        axes.plot(time, np.append(0, pair.resultant[:, 0]), color=ORANGE, label="drag")
        axes.plot(time[1:], 0.2 * pair.normal_sum, "--", color=INK, linewidth=1,
                  label="mu times the sum of the points' normal forces")
        drag = pair.resultant[-1, 0] / -pair.resultant[-1, 2]
        gap = abs(pair.friction_sum[-1] / pair.normal_sum[-1] / 0.2 - 1)
    axes.set_xlabel("time (down until 1, then sideways)")
    axes.set_ylabel("force on the block")
    axes.legend(fontsize=8)
    save(figure, folder / "case-tool.png")
    return f"""\
## Patch test under contact: `patch.inp`

Eight distorted elements and a graded block on a frictionless plane under uniform pressure, sides
free. Only contact holds them in z. Source: Irons's patch test: stress and contact pressure are
uniform, in any mesh. Largest relative errors:

{table(["element", "stress", "contact pressure"], worst)}

## Slope: `slope.inp`

A cube on a slope under its weight; nothing but friction holds it. Source: statics: it rests where
tan(alpha) <= mu. The deck has tan(alpha) = mu (1 - 1e-6), mu = 0.3, and ends with exit status 0;
friction over normal force is {abs(down / up):.8f}. With `--set margin=1e-6` there is no
equilibrium: exit status 2, and the message says that nothing balances the block's motion. Close
to the limit every point slides, and friction has to point straight up the slope everywhere: the
block moves some way before it rests.

## Free fall: `fall.inp`

A cube under its weight, and nothing below it: exit status 2, "nothing balances the loads along
body 1 (of node 1): translation along z".

## Rest: `rest.inp`

A cube on a frictionless plane under its weight of 10. The plane carries {weight:.10g}. Two
translations and a rotation are held by nothing and driven by nothing; the run names them, leaves
them at 0 and ends with exit status 0.

## Corner: `corner.inp`

A cube in the corner of three frictionless planes, its weight of 10 along (-0.48, -0.36, -0.8).
Source: statics: 4.8, 3.6 and 8. They carry {parts[0]:.10g}, {parts[1]:.10g} and {parts[2]:.10g}.
The nodes on the edges touch two planes, the one in the corner three.

## Bend: `bend.inp`

A loose beam on two rollers, bent by a third one at a quarter of their distance, with mu = 0.01.
Source: statics: the rollers carry a quarter and three quarters of the force but for the friction of
the third one, which acts a height above them: {100 * expected:.4f} % on the left. It carries
{100 * left[2] / -top[2]:.4f} %, the right one {100 * right[2] / -top[2]:.4f} %. (The deflection is
tested against Timoshenko's.)

## Pipe: `pipe.inp`

A bar inside a pipe (a cylinder with `INNER`) under its weight; two edges touch the wall at
sin(theta) = 0.6. Source: statics: each carries W/(2 cos(theta)), 15 together. They carry
{edge:.6f}, and {stiff:.7f} where the bar is a thousand times stiffer and so deforms less. Nothing
holds the slide along the pipe and the swing about its axis, and the run names both.

## Tool: `tool.inp`

A spherical tool is pressed into a block and dragged over it, both by its reference node. When all
of the contact slides, each point carries mu times its normal force; the sums agree to {gap:.0e}.
Drag over normal force is {drag:.4f} for mu = 0.2: the surface is not quite level where the tool
presses.

![Forces of a dragged tool](figures/case-tool.png)
"""


def main():
    """Run the cases, draw the figures and write the page."""
    options = script_options(__doc__, PAGES, "the page and its figures go").parse_args()
    figures = options.folder / "figures"
    try:
        with fresh_runs(options.bipot) as runs:
            figures.mkdir(parents=True, exist_ok=True)
            parts = [
                plate(runs, figures),
                spheres(runs, figures),
                roller(runs),
                spence(runs, figures),
                mindlin(runs, figures),
                elements(runs, figures),
                statics(runs, figures),
                case_bodies.press(runs),
                case_bodies.cylinder(runs),
                case_bodies.punch(runs),
                case_bodies.stack(runs),
                published_bodies.spheres(runs),
                published_bodies.cylinders(runs),
                published_bodies.rings(runs),
                published_bodies.wedge(runs),
            ]
    except (ResultError, RunError) as error:
        sys.exit(f"cases: {error}")
    head = """\
# Published values

Cases whose results nobody on this project chose: theory, statics, benchmarks of others. Most are
decks in `input/` that run as they stand in seconds; those of the last four are written by
`studies/published_bodies.py`. `tests/cases/test_published.py` and
`tests/cases/test_published_bodies.py` hold them to the values below. Written by `studies/run
cases`, our numbers too.
"""
    (options.folder / "cases.md").write_text("\n".join([head, *parts]), encoding="utf-8")


if __name__ == "__main__":
    main()
