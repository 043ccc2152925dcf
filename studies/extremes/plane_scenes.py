"""Small scenes of plane and axisymmetric elements, bolts, and contact and loads that change.

What is true of a scene is a closed form (uniform stress, springs in a row, the rings of Lame), a
symmetry (other units, another place, in proportion), or Coulomb's law of the whole.
"""

from math import pi, sqrt

import numpy as np

from studies.extremes.finite_scenes import FiniteScene
from studies.plane_meshes import PlaneMesh

YOUNG, NU, PRESSURE = 1000.0, 0.3, 1.0
CLOSED = "closed form"
COULOMB = "Coulomb's law of the whole"
FLOOR = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., {y!r}, 0., 0., 1., 0.\n"


# --- Decks ---------------------------------------------------------------------------------------


def sheet(kind, name="A", n=(4, 3), low=(0.0, 0.0), size=(2.0, 1.5), first=0, bent=0.05):
    """Return the cards of a rectangle, its inner nodes moved by a part of it."""

    def place(a, b):
        inner = 16 * a * (1 - a) * b * (1 - b) * bent
        return (float(low[0] + size[0] * (a + inner)), float(low[1] + size[1] * (b - inner)))

    return PlaneMesh(kind, n, place, name, first, first).deck


def material(name="A", young=YOUNG, nu=NU, thickness=None):
    """Return the cards of a material and of the section of the set of the same name."""
    text = f"*MATERIAL, NAME=OF-{name}\n*ELASTIC\n{young!r}, {nu!r}\n"
    text += f"*SOLID SECTION, ELSET={name}, MATERIAL=OF-{name}\n"
    return text + (f"{thickness!r}\n" if thickness else "")


def pair(slave, master, mu=0.0, name="I"):
    """Return a contact pair."""
    return (f"*SURFACE INTERACTION, NAME={name}\n*FRICTION\n{mu!r}\n"
            f"*CONTACT PAIR, INTERACTION={name}\n{slave}, {master}\n")  # fmt: skip


def step(cards, increments=1, nlgeom=False):
    """Return a step."""
    each = repr(1 / increments)
    return (f"*STEP{', NLGEOM' * nlgeom}\n*STATIC\n{each}, 1., , {each}\n{cards}"
            "*NODE FILE\nU, RF\n*CONTACT FILE\nCSTR\n*END STEP\n")  # fmt: skip


def is_round(kind):
    """Whether elements are axisymmetric."""
    return kind.startswith("CAX")


def held(kind, *names):
    """Return the supports of the left sides; on the axis nodes are held by themselves."""
    if is_round(kind):
        return ""
    return "*BOUNDARY\n" + "".join(f"{name}LEFT-N, 1\n" for name in names)


def end_force(result):
    """Return the force of the first pair along y at the end."""
    return abs(result.pairs[0].resultant[-1, 1])


# --- Uniform stress ------------------------------------------------------------------------------


def pressed(axis, name, extreme, kind, *, thickness=None, size=(2.0, 1.5), low=(0.0, 0.0),
            stress=1.0, nu=NU, more="", allowed=1e-6, refusal="", reason="", **mesh):  # fmt: skip
    """Return a scene of a rectangle on a plane, with a pressure on its top."""
    deck = (
        sheet(kind, low=low, size=size, **mesh) + material("A", YOUNG * stress, nu, thickness)
        + more + FLOOR.format(y=float(low[1])) + pair("ABOTTOM", "FLOOR")
        + step(held(kind, "A") + f"*DSLOAD\nATOP, P, {PRESSURE * stress!r}\n")
    )  # fmt: skip
    outer, inner = low[0] + size[0], low[0]
    area = pi * (outer**2 - inner**2) if is_round(kind) else size[0] * (thickness or 1)
    shrinks = 1.0 if is_round(kind) else 1 - nu**2

    def measure(result):
        y, u = result.points[:, 1] - low[1], result.field("displacement", -1)[:, 1]
        apart = (u + PRESSURE / YOUNG * shrinks * y) / (PRESSURE / YOUNG * size[1])
        force = end_force(result) / (PRESSURE * stress * area)
        return np.array([force, 1 + apart.min(), 1 + apart.max()])

    return FiniteScene(axis, name, extreme, deck, measure, np.ones(3), CLOSED, allowed, refusal,
                       reason)  # fmt: skip


def sheets():
    """Return slices and discs of extreme sizes, places and materials."""
    for kind in ("CPE4", "CPE8R"):
        for thickness in (1e-6, 1e-3, 1e3, 1e6):
            far = not 1e-4 < thickness < 1e4
            yield pressed("thickness", f"thick-{thickness:.0e}-{kind}",
                          f"{kind}, {thickness:.0e} thick", kind, thickness=thickness,
                          allowed=1e-5, refusal="takes the digits" if far else "",
                          reason="The slice is solved with nodes on both of its sides; forces are "
                          "in proportion to the thickness." if far else "")  # fmt: skip
    for kind in ("CPE6", "CAX4", "CAX8"):
        for size in (1e-9, 1e9):
            yield pressed("units", f"size-{size:.0e}-{kind}", f"{kind}, lengths times {size:.0e}",
                          kind, size=(2 * size, 1.5 * size), allowed=1e-5,
                          thickness=None if is_round(kind) else size)  # fmt: skip
    for kind in ("CPE4", "CAX8"):
        for stress in (1e-9, 1e9):
            yield pressed("units", f"stress-{stress:.0e}-{kind}",
                          f"{kind}, stresses times {stress:.0e}", kind, stress=stress,
                          allowed=1e-5)  # fmt: skip
    for kind, flat in (("CPE3", 1e4), ("CAX3", 1e3), ("CAX6", 1e2)):
        yield pressed("aspect", f"flat-{flat:.0e}-{kind}",
                      f"{kind}, elements {flat:.0e} times as wide as high", kind,
                      size=(2.0, 1.5 / flat), allowed=1e-5,
                      thickness=None if is_round(kind) else 1e-2)  # fmt: skip
    yield pressed("place", "far-CPE4", "CPE4, 1e5 of its width from the origin", "CPE4",
                  low=(2e5, -1e5), allowed=1e-5)  # fmt: skip
    yield pressed("place", "far-CAX4", "CAX4, 1e5 of its height along the axis", "CAX4",
                  low=(0.0, 1.5e5), allowed=1e-5)  # fmt: skip
    for inner in (1e-6, 1e4):
        yield pressed("hole", f"hole-{inner:.0e}-CAX4",
                      f"CAX4, a wall of 2 about a hole of {inner:.0e}", "CAX4", low=(inner, 0.0),
                      allowed=1e-4)  # fmt: skip
    for kind in ("CPE8R", "CAX8R"):
        yield pressed("nu", f"nu-0.4999-{kind}", f"{kind}, nu = 0.4999", kind, nu=0.4999,
                      allowed=1e-3)  # fmt: skip
    yield pressed("nu", "nu-0.49-CPE3", "CPE3, nu = 0.491", "CPE3", nu=0.491,
                  refusal="mesh with CPE8R",
                  reason="Elements of three nodes lock.")  # fmt: skip
    for kind in ("CPE4", "CAX6"):
        yield pressed("refined", f"cut-{kind}", f"{kind}, cut seven times at a corner of the top",
                      kind, more="*REFINE, TIMES=7\n2., 1.5, 0., 1e-3\n",
                      allowed=1e-5)  # fmt: skip


# --- Two bodies ----------------------------------------------------------------------------------


def stacked(kind, *, young=(YOUNG, YOUNG), gap=0.0, tied=False, heights=(1.0, 1.0)):
    """Return two rectangles, one above the other, and their contact or tie; nu = 0."""
    text = sheet(kind, "A", (4, 2), (0.0, heights[1] + gap), (2.0, heights[0]), 0, 0.0)
    text += sheet(kind, "B", (3, 2), (0.0, 0.0), (2.0, heights[1]), 1000, 0.0)
    text += material("A", young[0], 0.0) + material("B", young[1], 0.0)
    joint = "*TIE, NAME=GLUE\nABOTTOM, BTOP\n" if tied else pair("ABOTTOM", "BTOP")
    return text + joint


def of_springs(axis, name, extreme, kind, *, press=0.01, allowed=1e-6, refusal="", reason="",
               **options):  # fmt: skip
    """Return a scene of two rectangles pressed together, with the forces at both ends."""
    young, heights = options.get("young", (YOUNG, YOUNG)), options.get("heights", (1.0, 1.0))
    soft = sum(h / e for h, e in zip(heights, young, strict=True))
    area = 4 * pi if is_round(kind) else 2.0
    true = max(0.0, press - options.get("gap", 0.0)) / soft * area
    deck = stacked(kind, **options) + step(
        held(kind, "A", "B") + f"*BOUNDARY\nBBOTTOM-N, 2\nATOP-N, 2, 2, {-press!r}\n"
    )

    def measure(result):
        y, f = result.points[:, 1], result.field("reaction_force", -1)[:, 1]
        forces = [f[y == y.min()].sum(), -f[y == y.max()].sum()]
        return np.array([1.0, *(force / (true or 1.0) for force in forces)])

    return FiniteScene(axis, name, extreme, deck, measure,
                       np.array([1.0, *[float(true > 0)] * 2]), CLOSED, allowed, refusal,
                       reason)  # fmt: skip


def bodies():
    """Return bodies on bodies: stiffness, gaps, ties."""
    for kind in ("CPE4", "CAX8R"):
        for young in ((1e3, 1e7), (1e7, 1e3)):
            yield of_springs("stiffness", f"hard-{young[0] / young[1]:.0e}-{kind}",
                             f"{kind}, {young[0] / young[1]:.0e} times as stiff as what it is on",
                             kind, young=young)  # fmt: skip
    for kind in ("CPE8", "CAX4"):
        for gap in (1e-9, 0.01, 0.0101, -1e-9):
            yield of_springs("gap", f"gap-{gap:g}-{kind}",
                             f"{kind}, a gap of {gap:g}, pressed by 0.01", kind,
                             gap=gap)  # fmt: skip
    for kind in ("CPE6", "CAX4", "CAX8"):
        yield of_springs("tie", f"tie-{kind}", f"{kind} tied, 1e4 times as stiff", kind,
                         young=(1e7, 1e3), tied=True)  # fmt: skip


# --- Rings ---------------------------------------------------------------------------------------


def sleeve(kind, over, mu=0.0, pull=0.0, young=YOUNG, size=1.0):
    """Return a ring of radii 1 and 2 on a rigid shaft that is larger by a part, then pulled."""
    s = size
    shaft = "*NODE\n900, 0., 0., 0.\n*OBSTACLE, NAME=SHAFT, TYPE=CYLINDER, REF NODE=900\n"
    shaft += f"0., 0., 0., 0., 1., 0., {s * (1 + over)!r}\n"
    supports = f"*BOUNDARY\n{'ARIGHT-N' if pull else 'AALL'}, 2\n900, 2\n"
    high = 3.0 if pull else 0.3
    return (
        sheet(kind, n=(12, 3), low=(s, 0.0), size=(s, high * s), bent=0.0) + material("A", young)
        + shaft + pair("ALEFT", "SHAFT", mu) + step(supports)
        + (step(f"*BOUNDARY\n900, 2, 2, {s * pull!r}\n") if pull else "")
    )  # fmt: skip


def rings():
    """Return rings on shafts: interference, friction, units."""

    def pressure_of(over, unit=1.0):
        def measure(result):
            return np.array([result.pairs[0].resultant[-1, 0] / (over * unit)])

        return measure

    lame = 0.6 * pi * 3 * YOUNG / (1.3 * 4.4)  # the force of an interference of 1
    yield FiniteScene("fit", "fit-0.01", "an interference of 0.01", sleeve("CAX8R", 0.01),
                      pressure_of(0.01), np.array([lame]), CLOSED, 4e-4)  # fmt: skip
    for over in (1e-9, 0.07):
        yield FiniteScene("fit", f"fit-{over:g}", f"an interference of {over:g}",
                          sleeve("CAX8R", over), pressure_of(over), "fit-0.01",
                          "fit-0.01: in proportion", 1e-6)  # fmt: skip
    for size in (1e-9, 1e9):
        yield FiniteScene("fit", f"fit-size-{size:.0e}", f"lengths times {size:.0e}",
                          sleeve("CAX8R", 0.01, size=size), pressure_of(0.01, size**2), "fit-0.01",
                          "fit-0.01: as it is", 1e-6)  # fmt: skip

    def slides(mu):
        def measure(result):
            force = result.pairs[0].resultant[-1]
            return np.array([force[1] / (mu * force[0]), float(force[0] > 1.0)])

        return measure

    for kind in ("CAX4", "CAX6", "CAX8R"):
        for mu in (1e-6, 0.1, 0.3):
            yield FiniteScene("sleeve", f"sleeve-{mu:g}-{kind}",
                              f"{kind}, a sleeve drawn off its shaft, mu = {mu:g}",
                              sleeve(kind, 0.01, mu, 0.05), slides(mu), np.ones(2), COULOMB,
                              1e-4)  # fmt: skip

    def rough(kind, mu):
        sole = FLOOR.format(y=0.0) + pair("ABOTTOM", "FLOOR", mu) if mu else ""
        supports = "" if mu else "*BOUNDARY\nABOTTOM-N, 1, 2\n"
        return (sheet(kind, bent=0.0) + material() + sole
                + step(supports + f"*DSLOAD\nATOP, P, {PRESSURE!r}\n"))  # fmt: skip

    def top(result):
        y, u = result.points[:, 1], result.field("displacement", -1)
        high = y > 1.5 - 1e-9
        wide = np.hypot(*result.points[high][:, [0, 2]].T)
        return np.array([u[high, 1].min(), u[high, 1].max(), u[high, 0][wide > 1.99].max()])

    for kind in ("CAX4", "CAX8"):
        yield FiniteScene("rough", f"held-{kind}", f"{kind}, a disc whose sole is held",
                          rough(kind, 0), top, f"rough-{kind}", f"rough-{kind}: a rough floor",
                          1e-6)  # fmt: skip
        yield FiniteScene("rough", f"rough-{kind}", f"{kind}, a disc on a floor, mu = 1e4",
                          rough(kind, 1e4), top, f"held-{kind}",
                          f"held-{kind}: supports where it sticks", 1e-6)  # fmt: skip
    for kind in ("CAX4", "CAX8R"):
        for left in (0.95, 0.65):
            green = (left**2 - 1) / 2
            wide = 2 * sqrt(1 - 2 * NU * green)
            true = np.array([-left * YOUNG * green * 4 * pi / (YOUNG * 4), wide])

            def squeezed(result, _true=true):
                x = result.points + result.field("displacement", -1)
                return np.array([end_force(result) / (YOUNG * 4), np.hypot(x[:, 0], x[:, 2]).max()])

            deck = (sheet(kind, n=(3, 2), size=(2.0, 1.0), bent=0.0) + material()
                    + FLOOR.format(y=0.0) + pair("ABOTTOM", "FLOOR")
                    + step(f"*BOUNDARY\nATOP-N, 2, 2, {left - 1!r}\n", 2, True))  # fmt: skip
            yield FiniteScene("strain", f"pressed-{left:g}-{kind}",
                              f"{kind} at finite strain, pressed to {left:g}", deck, squeezed,
                              true, CLOSED, 1e-4)  # fmt: skip


# --- Bolts ---------------------------------------------------------------------------------------


def column(kind, *, layers=4, cuts=(2,), normal=""):
    """Return a column of 4 between clamps, cut above some of its layers; its area and modulus."""
    if kind.startswith("C3D"):
        text = (f"*BLOCK, NAME=B, ELSET=B, TYPE={kind}, NX=1, NY=1, NZ={layers}\n"
                "0, 0, 0, 2, 1, 4\n" + material("B"))  # fmt: skip
        cells, ends, axis, area, modulus = 1, ("B-ZMIN", "B-ZMAX"), 3, 2.0, YOUNG
        free = "*BOUNDARY\nB-XMIN, 1\nB-YMIN, 2\n"
    else:
        text = sheet(kind, "B", (2, layers), size=(2.0, 4.0), bent=0.0) + material("B")
        cells, ends, axis = 2, ("BBOTTOM-N", "BTOP-N"), 2
        area = 4 * pi if is_round(kind) else 2.0
        modulus = YOUNG if is_round(kind) else YOUNG / (1 - NU**2)
        free = held(kind, "B")
    for k, cut in enumerate(cuts):
        faces = "".join(f"{cut * cells + i + 1}, S1\n" for i in range(cells))
        text += f"*SURFACE, NAME=CUT{k}\n{faces}*NODE, NSET=BOLT{k}\n{9000 + k}, 0., 0., 0.\n"
        text += f"*PRE-TENSION SECTION, SURFACE=CUT{k}, NODE={9000 + k}\n{normal}"
    clamps = free + "".join(f"*BOUNDARY\n{end}, {axis}\n" for end in ends)
    return text, clamps, ends[1], axis, area, modulus


def tension(axis, at=4.0):
    """Return what measures the tension and the jump of a column at its cut."""

    def measure(result):
        x, u = result.points[:, axis - 1], result.field("displacement", -1)[:, axis - 1]
        force = result.field("reaction_force", -1)[:, axis - 1]
        return np.array([force[x > at - 1e-9].sum(), np.ptp(u)])

    return measure


def scaled(measure, factors):
    """Return a measure in units of its own."""
    return lambda result: np.append(measure(result) / factors, 1.0)


def bolts():
    """Return bolts under extreme forces, fixed, in a row."""
    for kind in ("C3D8", "C3D8I", "CPE4", "CPE8R", "CAX4", "CAX8"):
        text, clamps, _, axis, area, modulus = column(kind)
        for strain in (1e-12, 0.1):
            force = strain * modulus * area
            yield FiniteScene(
                "bolt", f"bolt-{strain:g}-{kind}", f"{kind}, a bolt shortened by {strain:g}",
                text + step(clamps + f"*CLOAD\n9000, 1, {force!r}\n"),
                scaled(tension(axis), np.array([force, 4 * strain])), np.ones(3), CLOSED, 1e-5,
            )  # fmt: skip
    for kind in ("C3D8", "CAX8R"):
        text, clamps, end, axis, area, modulus = column(kind)
        force, moved = 0.01 * modulus * area, 0.002 * modulus * area / 4
        fixed = step("*CLOAD, OP=NEW\n*BOUNDARY, FIXED\nBOLT0, 1, 1\n"
                     f"*BOUNDARY\n{end}, {axis}, {axis}, 0.002\n")  # fmt: skip
        yield FiniteScene(
            "bolt", f"fixed-{kind}", f"{kind}, a bolt fixed and its clamps drawn apart",
            text + step(clamps + f"*CLOAD\n9000, 1, {force!r}\n") + fixed,
            lambda result, axis=axis, scale=force + moved: tension(axis)(result)[:1] / scale,
            np.ones(1), CLOSED, 1e-5,
        )  # fmt: skip
    text, clamps, _, axis, area, modulus = column("C3D8", cuts=(1, 3))
    shortened = "".join(f"*BOUNDARY\n900{k}, 1, 1, {d!r}\n" for k, d in enumerate((0.03, -0.01)))
    yield FiniteScene(
        "bolt", "two-cuts", "two cuts in a row, one shortened and one lengthened",
        text + step(clamps + shortened),
        lambda result: tension(3)(result)[:1] / (0.02 / 4 * YOUNG * 2), np.ones(1), CLOSED, 1e-6,
    )  # fmt: skip
    for length in (1e-9, 1e9):
        text, clamps, _, axis, area, modulus = column("C3D8", normal=f"0., 0., {-length!r}\n")
        yield FiniteScene(
            "bolt", f"normal-{length:.0e}", f"a normal of {length:.0e}",
            text + step(clamps + f"*CLOAD\n9000, 1, {0.01 * modulus * area!r}\n"),
            scaled(tension(3), np.array([0.01 * modulus * area, 0.04])), np.ones(3), CLOSED, 1e-6,
        )  # fmt: skip


# --- What changes from step to step --------------------------------------------------------------


def on_floor(kind, mu):
    """Return a body on a floor, its top and side sets, the axes along and across the floor."""
    if kind.startswith("C3D"):
        text = (
            f"*BLOCK, NAME=B, ELSET=B, TYPE={kind}, NX=3, NY=2, NZ=2\n0, 0, 0, 3, 1, 1\n"
            + material("B")
            + "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
        )
        return text + pair("B-ZMIN", "FLOOR", mu), "B-ZMAX", 1, 3  # fmt: skip
    text = sheet(kind, "B", (4, 2), size=(3.0, 1.0), bent=0.0) + material("B")
    return text + FLOOR.format(y=0.0) + pair("BBOTTOM", "FLOOR", mu), "BTOP-N", 1, 2


def changed(kind, before, after):
    """Return a body that is pressed, dragged, and dragged on with another coefficient."""
    text, top, along, across = on_floor(kind, before)
    supports = "".join(f"*BOUNDARY\n{top}, {k}, {k}\n" for k in range(1, across + 1))
    press = f"*BOUNDARY\n{top}, {across}, {across}, -0.01\n"
    new = f"*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n{after!r}\n"
    return (
        text + step(supports + press) + step(f"*BOUNDARY\n{top}, {along}, {along}, 0.1\n", 2)
        + step(new + f"*BOUNDARY\n{top}, {along}, {along}, 0.6\n", 2)
    ), along, across  # fmt: skip


def frictions():
    """Return coefficients that change while a body slides."""
    for kind in ("C3D8", "CPE4", "CPE8R"):
        for before, after in ((0.3, 1e-9), (0.3, 0.0), (0.0, 0.3), (1e-6, 1.0)):
            deck, along, across = changed(kind, before, after)

            def ratio(result, along=along, across=across, mu=after):
                force = result.pairs[0].resultant[-1]
                return np.array([1 + force[along - 1] / force[across - 1] + mu, 1.0])

            yield FiniteScene("change", f"mu-{before:g}-{after:g}-{kind}",
                              f"{kind}, mu = {before:g}, then {after:g}, dragged on", deck, ratio,
                              np.ones(2), COULOMB, 1e-6)  # fmt: skip


def removed(kind, gap, times):
    """Return two bodies whose pair is removed and added some times, pressed throughout."""
    press = held(kind, "A", "B") + "*BOUNDARY\nBBOTTOM-N, 2\nATOP-N, 2, 2, -0.01\n"
    text = stacked(kind, gap=gap)
    steps = step(press)
    for _ in range(times):
        for word in ("REMOVE", "ADD"):
            steps += step(f"*MODEL CHANGE, TYPE=CONTACT PAIR, {word}\nABOTTOM, BTOP\n")
    return text + steps


def pairs():
    """Return pairs that are removed and added."""
    for kind in ("CPE4", "CPE8R", "CAX4", "CAX8"):
        area = 4 * pi if is_round(kind) else 2.0
        for gap, times in ((0.0, 1), (-0.004, 1), (0.0, 4)):
            true = (0.01 - gap) * YOUNG / 2 * area

            def forces(result, true=true):
                ends = np.abs(result.pairs[0].resultant[:, 1])
                return np.array([ends[0], ends[-1], ends[1] + true]) / true

            yield FiniteScene("pair", f"removed-{times}-{gap:g}-{kind}",
                              f"{kind}, a pair removed and added {times} times, a gap of {gap:g}",
                              removed(kind, gap, times), forces, np.ones(3), CLOSED,
                              1e-6)  # fmt: skip


def delays():
    """Return loads that follow an amplitude late."""
    table = "*AMPLITUDE, NAME=RAMP\n0., 0., 1., 1.\n"
    for kind in ("CPE4", "CAX8"):
        for delay, part in ((1e-9, 1.0), (0.25, 0.75), (1.0, 0.0), (1e9, 0.0)):
            loads = held(kind, "A")
            loads += f"*DSLOAD, AMPLITUDE=RAMP, TIME DELAY={delay!r}\nATOP, P, {PRESSURE!r}\n"
            area = 4 * pi if is_round(kind) else 2.0
            deck = (table + sheet(kind) + material() + FLOOR.format(y=0.0)
                    + pair("ABOTTOM", "FLOOR") + step(loads, 4))  # fmt: skip
            yield FiniteScene("delay", f"delay-{delay:g}-{kind}",
                              f"{kind}, a pressure {delay:g} of the step late", deck,
                              lambda result, area=area: np.array([end_force(result) / area, 1.0]),
                              np.array([part, 1.0]), CLOSED, 1e-6)  # fmt: skip


def plane_scenes():
    """Return all scenes, in the order of the page."""
    found = [
        scene
        for family in (sheets, bodies, rings, bolts, frictions, pairs, delays)
        for scene in family()
    ]
    assert len({scene.name for scene in found}) == len(found)
    return found
