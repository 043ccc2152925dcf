"""Extreme scenes of two and three deformable bodies that touch each other.

A `Plan` says in a few numbers what is pressed onto what. `scene_of` makes of it a scene of
tests/judge, from which the deck is written and by whose numbers the run is judged.

    from studies.extremes.body_scenes import all_plans, scene_of

    for plan in all_plans():
        print(plan.name, plan.extreme, len(scene_of(plan).points))
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bipot.program import ROOT

sys.path.append(str(ROOT / "tests" / "judge"))

from random_scenes import Builder
from scenes import Force, Gravity, Pressure, Step

# Length and stress of a millimetre and of a megapascal.
UNITS = {
    "mm, MPa": (1.0, 1.0),
    "m, Pa": (1e-3, 1e6),
    "um, MPa": (1e3, 1.0),
    "km, TPa": (1e-6, 1e-6),
    "nm, Pa": (1e6, 1e6),
}
UPPER, LOWER = "upper", "lower"
SOFT = 1000.0


@dataclass(frozen=True)
class Body:
    """A block of elements; `shape` moves its points (N, 3), given in it from 0 to 1 as well."""

    cells: tuple
    low: tuple
    size: tuple
    young: float = SOFT
    poisson: float = 0.3
    element: str = "C3D8"
    shape: Callable | None = None
    density: float | None = None


BASE = Body((3, 3, 2), (-0.2, -0.2, -1.0), (1.4, 1.4, 1.0))
BLOCK = Body((2, 2, 2), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


@dataclass(frozen=True)
class Plan:
    """Bodies from the lowest to the highest, and what is done to them.

    Step 1 moves the upper side of the highest down by `way`, step 2 across by `push`; with `loads`
    these are all that act on it, and nothing holds it but contact.
    """

    name: str
    axis: str
    extreme: str
    bodies: tuple = (BASE, BLOCK)
    mu: tuple = (0.3,)
    slaves: tuple = (UPPER,)  # of each pair, from the lowest
    way: float = 0.01
    push: tuple = (0.02, 60.0)  # how far, in which direction [degrees]
    increments: tuple = (1, 2)
    back: bool = False  # a third step goes all the way back across
    loads: tuple = ()
    added: float = 0.0  # what *CONTACT GAP adds, of every pair
    adjust: float | None = None
    small: bool = False
    units: str = "mm, MPa"
    tolerance: float = 1e-8


def scene_of(plan):
    """Return the scene of a plan, a tests/judge Scene."""
    length, stress = UNITS[plan.units]
    b = Builder(0, np.random.default_rng(len(plan.name)))
    parts = []
    for body in plan.bodies:
        density = None if body.density is None else body.density * stress / length
        material = b.material(body.young * stress, body.poisson, density)
        low, size = (length * np.asarray(v, dtype=float) for v in (body.low, body.size))
        part = b.part(low, size, body.cells, material, body.element, True, False)
        if body.shape is not None:
            rows = list(b.scene.parts[part].rows)
            points = np.array([b.points[row] for row in rows]) / length
            share = (points - body.low) / body.size
            for row, point in zip(rows, length * body.shape(points, share), strict=True):
                b.points[row] = point
        parts.append(part)
    options = {"small": plan.small}
    if plan.adjust is not None:
        options["adjust"] = plan.adjust * length
    for k, (mu, slave) in enumerate(zip(plan.mu, plan.slaves, strict=True)):
        ends = [(parts[k + 1], "ZMIN"), (parts[k], "ZMAX")]
        if slave == LOWER:
            ends.reverse()
        b.touch(*ends, mu, **options)
        if plan.added:
            b.scene.gaps[ends[0]] = plan.added * length
    steps_of(b, plan, parts, length, stress)
    b.scene.controls = {"TOLERANCE": plan.tolerance}
    return b.finish(f"{plan.name}, {plan.extreme}")


def steps_of(b, plan, parts, length, stress):
    """Add the steps of a plan."""
    press, across = plan.increments

    def step(increments):
        b.scene.steps.append(Step(1.0, increments, True))
        return b.scene.steps[-1]

    first = step(press)
    b.hold(first, parts[0], "ZMIN", (0, 1, 2))
    if plan.loads:
        for one in plan.loads:
            one(first, b, parts[-1], length, stress)
        return
    top = parts[-1]
    b.hold(first, top, "ZMAX", (0, 1))
    b.hold(first, top, "ZMAX", (2,), -plan.way * length)
    far, angle = plan.push
    way = far * length * np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    if across:
        for target in ((1,), (1, 0))[plan.back]:
            later = step(across)
            for i in range(2):
                b.hold(later, top, "ZMAX", (i,), float(target * way[i]))


# --- Loads on the highest body --------------------------------------------------------------------


def pressed(level, side="ZMAX"):
    """A pressure on a side."""
    return lambda step, b, part, length, stress: step.pressures.append(
        Pressure(part, side, level * stress)
    )


def weighed(down, across=0.0):
    """Its weight, of a density of 1, and a share of it along x."""
    return lambda step, b, part, length, stress: step.gravity.append(
        Gravity(part, 1.0, np.array([across, 0.0, -down]))
    )


def rolled(step, b, part, length, stress):
    """Rollers on the upper side: it moves along z alone."""
    b.hold(step, part, "ZMAX", (0, 1))


def dragged(direction, value):
    """A force on every node of the upper side."""

    def drag(step, b, part, length, stress):
        rows, name = b.side(part, "ZMAX")
        force = value * stress * length**2 / len(rows)
        step.forces.append(Force(rows, direction, force, None, name))

    return drag


# --- Shapes ---------------------------------------------------------------------------------------


def roof(slope, axis=0, top=False):
    """An edge: the lower side (the upper with `top`) rises from its middle line across `axis`."""

    def shape(points, share):
        out = points.copy()
        rise = slope * np.abs(points[:, axis] - middle(points, axis))
        out[:, 2] += -rise * share[:, 2] if top else rise * (1 - share[:, 2])
        return out

    return shape


def corner(points, share):
    """A corner: the lower side rises from its middle along x and y."""
    out = points.copy()
    rise = sum(np.abs(points[:, i] - middle(points, i)) for i in range(2))
    out[:, 2] += 0.5 * rise * (1 - share[:, 2])
    return out


def middle(points, axis):
    """The middle of points along an axis."""
    return (points[:, axis].min() + points[:, axis].max()) / 2


def tilted(degrees):
    """Turned about the edge x = 0 of the lower side, which stays."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

    def shape(points, share):
        out = points.copy()
        out[:, 0] = c * points[:, 0] - s * points[:, 2]
        out[:, 2] = s * points[:, 0] + c * points[:, 2]
        return out

    return shape


def lines_moved(by):
    """The inner lines of the mesh moved along x and y, and no longer above those below."""

    def shape(points, share):
        inside = (share > 1e-9) & (share < 1 - 1e-9)
        inside[:, 2] = False
        return points + by * inside

    return shape


def crowded(power):
    """Lines of the mesh crowd at x = 0: faces of all widths down to slivers."""

    def shape(points, share):
        out = points.copy()
        low, high = points[:, 0].min(), points[:, 0].max()
        out[:, 0] = low + (high - low) * share[:, 0] ** power
        return out

    return shape


def flattened(points, share):
    """The middle of the mesh moved until four quadrilaterals are close to triangles."""
    out = points.copy()
    inside = np.all(np.abs(share[:, :2] - 0.5) < 1e-9, axis=1)
    out[inside, :2] -= 0.24 * np.ptp(points[:, :2], axis=0)
    return out


# --- Families -------------------------------------------------------------------------------------


def fine(body, n):
    """The body with n elements along x and y, and one along z."""
    return replace(body, cells=(n, n, 1))


def ratio_plans():
    """One body stiffer than the other by up to a million."""
    for ratio in (1e-6, 1e-3, 1e3, 1e6):
        above = replace(BLOCK, young=SOFT * ratio)
        words = f"upper {ratio:g} times as stiff"
        yield Plan(f"ratio-{ratio:g}", "stiffness ratio", words, (BASE, above))


def friction_plans():
    """From none to far beyond what is unique."""
    for mu in (0.0, 1e-8, 1.0, 3.0, 10.0):
        yield Plan(f"mu-{mu:g}", "friction", f"mu = {mu:g}", mu=(mu,))
    yield Plan("mu-10-back", "friction", "mu = 10, there and back", mu=(10.0,), back=True)
    yield Plan("mu-1-far", "friction", "mu = 1, slides by most of a face", mu=(1.0,),
               push=(0.4, 30.0), increments=(1, 4))  # fmt: skip


def edge_plans():
    """An edge or a corner on a face, on another edge, or beside one."""
    axis = "edge on face"
    for slope, width in ((0.2, 1.0), (1.0, 1.0), (3.0, 0.4), (6.0, 0.2)):
        above = replace(BLOCK, low=(0.5 - width / 2, 0.0, 0.0), size=(width, 1.0, 1.0),
                        shape=roof(slope))  # fmt: skip
        yield Plan(f"edge-{slope:g}", axis, f"edge with slopes {slope:g}", (BASE, above))
    yield Plan("corner", axis, "corner on face", (BASE, replace(BLOCK, shape=corner)))
    for degrees in (0.1, 10.0):
        above = replace(BLOCK, shape=tilted(degrees))
        yield Plan(f"tilted-{degrees:g}", axis, f"block tilted by {degrees:g} degrees",
                   (BASE, above))  # fmt: skip
    below = replace(BASE, cells=(3, 2, 2), shape=roof(0.5, 1, True))
    above = replace(BLOCK, shape=roof(0.5))
    yield Plan("edges-crossed", axis, "edge across edge", (below, above))
    below = replace(BASE, cells=(2, 3, 2), shape=roof(0.5, 0, True))
    yield Plan("edge-along-edge", axis, "edge along edge, a tenth beside",
               (below, replace(above, low=(0.1, 0.0, 0.0))))  # fmt: skip


def over(share, both=False):
    """BLOCK over the edge of a base of its own size: this share of one of its faces is covered."""
    low = (1.0 - 0.5 * share, (1.0 - 0.5 * share) if both else 0.0, 0.0)
    return (Body((3, 3, 2), (0.0, 0.0, -1.0), (1.0, 1.0, 1.0)), replace(BLOCK, low=low))


def overlap_plans():
    """The upper block hangs over the edge of the lower one."""
    axis = "partial overlap"
    for share in (0.5, 0.1, 0.01, 0.003):
        yield Plan(f"overlap-{share:g}", axis, f"{share:g} of a face covered", over(share),
                   push=(0.001, 120.0))  # fmt: skip
    for share in (0.1, 0.01):
        yield Plan(f"overlap-corner-{share:g}", axis, f"a corner of {share**2:g} of a face covered",
                   over(share, True), push=(0.001, 45.0))  # fmt: skip
    yield Plan("overlap-edge-on-edge", axis, "sides flush, pushed 0.001 of a face over", over(0.0),
               push=(0.001, 120.0))  # fmt: skip
    yield Plan("slides-off", axis, "slides off the edge", over(0.5), push=(0.3, 0.0),
               increments=(1, 4))  # fmt: skip
    yield Plan("slides-on", axis, "slides onto the edge, from beside it", over(-0.1),
               push=(0.2, 180.0), increments=(1, 4))  # fmt: skip


def stacked(middle_body, above=BLOCK):
    """Three bodies, the middle one held by contact alone."""
    top = middle_body.low[2] + middle_body.size[2]
    return (BASE, middle_body, replace(above, cells=(3, 3, 2), low=(0.1, -0.1, top)))


def three_plans():
    """A stack of three."""
    axis = "three bodies"
    for ratio in (1e-6, 1e-3, 1.0, 1e3, 1e6):
        bodies = stacked(replace(BLOCK, young=SOFT * ratio))
        yield Plan(f"three-{ratio:g}", axis, f"the middle one {ratio:g} times as stiff", bodies,
                   (0.3, 0.2))  # fmt: skip
    yield Plan("three-mu-10-0", axis, "mu = 10 below and 0 above", stacked(BLOCK), (10.0, 0.0))
    yield Plan("three-mu-10-10", axis, "mu = 10, twice", stacked(BLOCK), (10.0, 9.0))
    sheet = replace(BLOCK, size=(1.0, 1.0, 0.01), cells=(2, 2, 1))
    yield Plan("three-sheet", axis, "a sheet of a hundredth between", stacked(sheet), (0.3, 0.2))
    stair = (BASE, replace(BLOCK, young=SOFT * 1e3),
             replace(BLOCK, low=(0.1, -0.1, 1.0), young=SOFT * 1e6))  # fmt: skip
    yield Plan("three-stair", axis, "each a thousand times as stiff as that below", stair,
               (0.3, 0.2))  # fmt: skip


def sliver_plans():
    """Thin elements, thin faces, and lines of the meshes that all but lie on each other."""
    axis = "slivers"
    for thick in (1e-2, 1e-3):
        above = replace(BLOCK, size=(1.0, 1.0, thick), cells=(2, 2, 1))
        yield Plan(f"sheet-{thick:g}", axis, f"a sheet of {thick:g} of its width", (BASE, above),
                   way=1e-2 * thick, push=(2e-2 * thick, 60.0))  # fmt: skip
    for width in (1e-2, 1e-4):
        above = replace(BLOCK, size=(width, 1.0, 0.1), low=(0.31, 0.0, 0.0), cells=(1, 3, 1))
        yield Plan(f"strip-{width:g}", axis, f"faces {width:g} wide", (BASE, above),
                   way=1e-4, push=(2e-4, 90.0))  # fmt: skip
    same = Body((2, 2, 2), (0.0, 0.0, -1.0), (1.0, 1.0, 1.0))
    for by in (1e-4, 1e-8, 1e-12, 1e-15):
        above = replace(BLOCK, shape=lines_moved(by))
        yield Plan(f"lines-{by:g}", axis, f"lines of the meshes {by:g} apart", (same, above),
                   push=(1e-9, 60.0))  # fmt: skip
    above = replace(BLOCK, cells=(4, 2, 2), shape=crowded(8))
    yield Plan("crowded", axis, "faces from 0.9 down to 1.5e-5 wide", (BASE, above))
    above = replace(BLOCK, shape=flattened)
    yield Plan("flattened", axis, "quadrilaterals close to triangles", (BASE, above))


def finer_plans():
    """One mesh finer by 8."""
    axis = "master finer by 8"
    yield Plan("finer-8", axis, "8 by 8 faces before one", (
        fine(replace(BASE, low=(0, 0, -1), size=(1, 1, 1)), 8), fine(BLOCK, 1)))  # fmt: skip
    yield Plan("finer-16", axis, "16 by 16 faces before 2 by 2", (
        fine(replace(BASE, low=(0, 0, -1), size=(1, 1, 1)), 16), fine(BLOCK, 2)),
        increments=(1, 1))  # fmt: skip
    yield Plan("finer-8-beside", axis, "8 by 8 faces before one, half beside", (
        fine(replace(BASE, low=(0.47, 0.23, -1), size=(1, 1, 1)), 8), fine(BLOCK, 1)))  # fmt: skip


def lifted(body, gap):
    """The body, higher by a gap."""
    return replace(body, low=(*body.low[:2], body.low[2] + gap))


def gap_plans():
    """Gaps and interferences of a hundred times the displacement."""
    axis = "gap, interference"
    yield Plan("gap-100-open", axis, "gap of 100 times the way", (BASE, lifted(BLOCK, 0.1)),
               way=1e-3, push=(1e-3, 60.0))  # fmt: skip
    yield Plan("gap-100-closed", axis, "gap of 100 times the depth, closed",
               (BASE, lifted(BLOCK, 0.1)), way=0.101, push=(2e-3, 60.0))  # fmt: skip
    yield Plan("added-gap-100", axis, "*CONTACT GAP of 100 times the way", added=0.1, way=1e-3,
               push=(1e-3, 60.0))  # fmt: skip
    yield Plan("added-gap-100-closed", axis, "*CONTACT GAP of 100 times the depth, closed",
               added=0.1, way=0.101, push=(2e-3, 60.0))  # fmt: skip
    yield Plan("interference-100", axis, "overlap of 100 times the way",
               (BASE, lifted(BLOCK, -0.1)), way=1e-3, push=(1e-3, 60.0))  # fmt: skip
    yield Plan("added-interference-100", axis, "*CONTACT GAP of -100 times the way", added=-0.1,
               way=1e-3, push=(1e-3, 60.0))  # fmt: skip
    yield Plan("interference-alone", axis, "overlap, and nothing moves",
               (BASE, lifted(BLOCK, -0.01)), way=0.0, increments=(1, 0))  # fmt: skip
    yield Plan("interference-adjusted", axis, "overlap of 100 times the way, taken away by ADJUST",
               (BASE, lifted(BLOCK, -0.1)), way=1e-3, push=(1e-3, 60.0), adjust=0.2)  # fmt: skip


def pair_plans():
    """Two extremes and more at once."""
    axis = "several"
    for ratio in (1e-6, 1e6):
        above = replace(BLOCK, young=SOFT * ratio)
        words = f"{ratio:g} times as stiff"
        yield Plan(f"ratio-{ratio:g}-mu-10", axis, f"upper {words}, mu = 10", (BASE, above),
                   (10.0,))  # fmt: skip
        yield Plan(f"ratio-{ratio:g}-edge", axis, f"edge {words}",
                   (BASE, replace(above, shape=roof(1.0))))  # fmt: skip
        below, hung = over(0.01)
        yield Plan(f"ratio-{ratio:g}-overlap-0.01", axis, f"0.01 of a face covered, {words}",
                   (below, replace(hung, young=SOFT * ratio)), push=(0.001, 120.0))  # fmt: skip
        yield Plan(f"ratio-{ratio:g}-interference", axis, f"overlap of 100 times the way, {words}",
                   (BASE, lifted(above, -0.1)), way=1e-3, push=(1e-3, 60.0))  # fmt: skip
        yield Plan(f"ratio-{ratio:g}-finer-8", axis, f"8 by 8 faces before one, {words}", (
            fine(replace(BASE, low=(0, 0, -1), size=(1, 1, 1)), 8), fine(above, 1)))  # fmt: skip
        sheet = replace(above, size=(1.0, 1.0, 0.01), cells=(2, 2, 1))
        yield Plan(f"ratio-{ratio:g}-sheet", axis, f"a sheet of a hundredth, {words}",
                   (BASE, sheet), way=1e-4, push=(2e-4, 60.0))  # fmt: skip
    yield Plan("edge-mu-10", axis, "edge, mu = 10", (BASE, replace(BLOCK, shape=roof(1.0))),
               (10.0,))  # fmt: skip
    yield Plan("edges-crossed-mu-10", axis, "edge across edge, mu = 10", (
        replace(BASE, cells=(3, 2, 2), shape=roof(0.5, 1, True)),
        replace(BLOCK, shape=roof(0.5))), (10.0,))  # fmt: skip
    yield Plan("overlap-0.01-mu-10", axis, "0.01 of a face covered, mu = 10", over(0.01), (10.0,),
               push=(0.001, 120.0))  # fmt: skip
    yield Plan("finer-8-mu-10-edge", axis, "edge before 8 by 8 faces, mu = 10", (
        fine(replace(BASE, low=(0, 0, -1), size=(1, 1, 1)), 8),
        replace(BLOCK, cells=(2, 1, 1), shape=roof(0.2))), (10.0,))  # fmt: skip
    yield Plan("interference-mu-10", axis, "overlap of 100 times the way, mu = 10",
               (BASE, lifted(BLOCK, -0.1)), (10.0,), way=1e-3, push=(1e-3, 60.0))  # fmt: skip
    yield Plan("interference-edge", axis, "edge, overlap of 100 times the way",
               (BASE, lifted(replace(BLOCK, shape=roof(1.0)), -0.1)), way=1e-3,
               push=(1e-3, 60.0))  # fmt: skip
    yield Plan("three-gaps", axis, "three bodies, gaps of 100 times the depth, closed", (
        BASE, lifted(BLOCK, 0.05), lifted(replace(BLOCK, cells=(3, 3, 2)), 1.1)), (0.3, 0.2),
        way=0.101, push=(2e-3, 60.0))  # fmt: skip
    yield Plan("three-mu-10-ratios", axis, "three bodies, 1e-6 and 1e6 times as stiff, mu = 10", (
        BASE, replace(BLOCK, young=SOFT * 1e-6),
        replace(BLOCK, low=(0.1, -0.1, 1.0), young=SOFT * 1e6)), (10.0, 9.0))  # fmt: skip
    yield Plan("incompressible-ratio", axis, "C3D8B, nu = 0.4999, 1e6 times as stiff", (
        replace(BASE, poisson=0.4999, element="C3D8B"),
        replace(BLOCK, young=SOFT * 1e6, element="C3D8I")))  # fmt: skip
    yield Plan("tolerance-1e-13-mu-10", axis, "mu = 10, tolerance 1e-13", mu=(10.0,),
               tolerance=1e-13)  # fmt: skip
    yield Plan("small-sliding-edge", axis, "edge, SMALL SLIDING, mu = 10",
               (BASE, replace(BLOCK, shape=roof(0.2))), (10.0,), small=True)  # fmt: skip


def loaded_plans():
    """The upper body free, under loads that contact balances or cannot balance."""
    axis = "free body"
    heavy = (BASE, replace(BLOCK, density=1e-3))
    light = (BASE, replace(BLOCK, density=1e-3, young=SOFT * 1e6))
    yield Plan("rests", axis, "free, under its weight", heavy, loads=(weighed(1.0),))
    yield Plan("rests-1e6", axis, "free, 1e6 times as stiff, under its weight", light,
               loads=(weighed(1.0),))  # fmt: skip
    yield Plan("rests-at-limit", axis, "free, pushed by 0.999 of its friction", heavy,
               loads=(weighed(1.0, 0.2997),))  # fmt: skip
    yield Plan("rests-gap", axis, "free, a hundredth above, falls onto the base",
               (BASE, lifted(heavy[1], 0.01)), loads=(weighed(1.0),))  # fmt: skip
    yield Plan("rolls-on-0.01", axis, "on rollers, 0.01 of a face covered", over(0.01),
               loads=(rolled, pressed(1e-3)))  # fmt: skip
    yield Plan("rests-beyond-limit", axis, "free, pushed by 1.1 of its friction", heavy,
               loads=(weighed(1.0, 0.33),))  # fmt: skip
    yield Plan("lifted", axis, "free, pulled away", loads=(dragged(2, 1.0),))
    yield Plan("topples", axis, "free, more than half beyond the edge",
               tuple(replace(b, density=1.0) for b in over(0.5)), loads=(weighed(1.0),))
    yield Plan("falls-beside", axis, "free, sides flush, none covered",
               tuple(replace(b, density=1.0) for b in over(0.0)), loads=(weighed(1.0),))
    yield Plan("rests-on-edge", axis, "free, balanced on its edge",
               (BASE, replace(heavy[1], shape=roof(0.2))), loads=(weighed(1.0),))  # fmt: skip


FAMILIES = (
    ratio_plans,
    friction_plans,
    edge_plans,
    overlap_plans,
    three_plans,
    sliver_plans,
    finer_plans,
    gap_plans,
    pair_plans,
    loaded_plans,
)


def all_plans():
    """Every plan, with either body as the slave, the units in turn; and one in all units."""
    units = list(UNITS)
    plans = []
    for family in FAMILIES:
        for plan in family():
            for slave in (UPPER, LOWER):
                count = len(plan.mu)
                # In a stack the middle body is the slave in both pairs, or the master in both.
                slaves = (slave,) if count == 1 else (slave, {UPPER: LOWER, LOWER: UPPER}[slave])
                plans.append(replace(
                    plan, name=f"{plan.name}-{slave}", slaves=slaves,
                    units=units[len(plans) // 2 % len(units)],
                ))  # fmt: skip
    hard = replace(next(p for p in plans if p.name == "ratio-1e+06-edge-upper"), axis="units")
    for number, one in enumerate(units):
        plans.append(replace(hard, name=f"units-{number + 1}", units=one))
    return plans
