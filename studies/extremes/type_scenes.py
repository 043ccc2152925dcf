"""Small scenes of tetrahedra, wedges and elements of second order, each extreme in one respect.

What is true of a scene is a closed form (uniform stress, springs in a row), a symmetry (other
units, another place, another direction), Coulomb's law, supports in the place of contact that
sticks, or a balance.
"""

from dataclasses import replace
from itertools import product

import numpy as np

from studies.extremes.finite_scenes import FiniteScene, Units
from studies.solid_meshes import KINDS, Solid, SolidMesh

YOUNG, NU, PRESSURE = 1000.0, 0.3, 1.0
TYPES = ("C3D4", "C3D6", "C3D10", "C3D15", "C3D20", "C3D20R")
SECOND = TYPES[2:]
CLOSED = "closed form"
AS_IT_IS = Units()
SIDES = {"X0": (0, 0), "X1": (0, 1), "Y0": (1, 0), "Y1": (1, 1), "Z0": (2, 0), "Z1": (2, 1)}


# --- Decks ---------------------------------------------------------------------------------------


def box(name, kind, n=(2, 2, 2), low=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), *, bent=None,
        units=AS_IT_IS, first=1, middle=0.5):  # fmt: skip
    """Return the cards of a box, and of its sides NAME-X0 to NAME-Z1 with their surfaces.

    `bent` moves corners of the unit cube (all but mid-side nodes, which stay `middle` of the way
    along their straight edges, from the corner with the lower number).
    """
    axes = [a + s * np.arange(m + 1) / m for a, s, m in zip(low, size, n, strict=True)]
    mesh = SolidMesh(name, kind, axes, first)
    x, unit = mesh.x.copy(), (mesh.x - low) / size
    if bent:
        x = np.array(low) + np.array(size) * bent(unit)
    for a, b, between in edges_of(mesh):
        a, b = sorted((a, b))
        x[between] = x[a] + middle * (x[b] - x[a])
    mesh.x = units.length * (x @ units.turn.T + np.array(units.origin))
    text = mesh.cards()
    for side, (axis, end) in SIDES.items():
        text += mesh.set_cards(f"{name}-{side}", mesh.nodes(axis, end))
    return text


def edges_of(mesh):
    """Return the edges of elements of second order: rows of their ends and of what is between."""
    for row in mesh.elements:
        for k, (a, b) in enumerate(KINDS[mesh.kind][1]):
            yield int(row[a]), int(row[b]), int(row[mesh.corners + k])


def material(name, young=YOUNG, nu=NU):
    """Return the cards of a material and of the section of the set of the same name."""
    return (f"*MATERIAL, NAME=OF-{name}\n*ELASTIC\n{young!r}, {nu!r}\n"
            f"*SOLID SECTION, ELSET={name}, MATERIAL=OF-{name}\n")  # fmt: skip


def ground(pair="B-Z0-F", mu=0.0, height=0.0, units=AS_IT_IS, options=""):
    """Return the cards of a plane below a surface."""
    place = [float(c) for c in units.place([0.0, 0.0, height])]
    normal = [float(c) for c in units.turn @ np.array([0.0, 0.0, 1.0])]
    return (
        f"*OBSTACLE, NAME=GROUND, TYPE=PLANE\n{', '.join(map(repr, place + normal))}\n"
        f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n{mu!r}\n"
        f"*CONTACT PAIR, INTERACTION=I{options}\n{pair}, GROUND\n"
    )


def step(cards, increments=1):
    """Return a step."""
    return f"*STEP\n*STATIC\n{1 / increments!r}, 1., , {1 / increments!r}\n{cards}*END STEP\n"


PLANES = "*BOUNDARY\nB-X0, 1, 1\nB-Y0, 2, 2\n"


def standing(kind, *, nu=NU, more="", free=True, **options):
    """Return a box on a plane, between two planes of symmetry, with a pressure on its top.

    Where its top is not `free` it is moved down as far.
    """
    height = options.get("size", (1.0, 1.0, 1.0))[2]
    pressed = f"*DSLOAD\nB-Z1-F, P, {PRESSURE!r}\n"
    if not free:
        pressed = f"B-Z1, 3, 3, {-PRESSURE / YOUNG * height!r}\n"
    return (
        box("B", kind, **options) + more + material("B", nu=nu) + ground() + step(PLANES + pressed)
    )  # fmt: skip


def uniform(size=(1.0, 1.0, 1.0), nu=NU):
    """Return what measures how uniform the stress of `standing` is, and what is true of it.

    Strains of the three axes at all nodes (least and largest), the force, and the pressures.
    """

    def measure(result):
        x, u = result.points, result.field("displacement", -1)
        mean = PRESSURE / YOUNG
        found = []
        for axis, strain in enumerate((nu * mean, nu * mean, -mean)):
            apart = (u[:, axis] - strain * x[:, axis]) / (mean * size[axis])
            found += [1 + apart.min(), 1 + apart.max()]
        pair = result.pairs[0]
        pressed = pair.pressure[-1]
        force = pair.resultant[-1, 2] / (PRESSURE * size[0] * size[1])
        return np.array([*found, force, pressed.min(), pressed.max()])

    return measure, np.ones(9)


def of_patch(axis, name, extreme, kind, allowed=1e-6, refusal="", reason="", **options):
    """Return a scene of uniform stress."""
    measure, true = uniform(options.get("size", (1.0, 1.0, 1.0)), options.get("nu", NU))
    return FiniteScene(axis, name, extreme, standing(kind, **options), measure, true, CLOSED,
                       allowed, refusal, reason)  # fmt: skip


def walled(upper, lower, *, young=(YOUNG, YOUNG), n=((2, 2, 2), (3, 3, 2)), gap=0.0, press=0.01,
           tied=False, mu=0.0, size=1.0, nu=(NU, NU), adjust="", heights=(1.0, 1.0)):  # fmt: skip
    """Return a box on another between four walls, the upper one's top pressed down.

    `gap` between them at the beginning, an overlap where it is negative.
    """
    s, (h, g) = size, heights
    text = box("L", lower, n[1], (0.0, 0.0, -h * s), (s, s, h * s), first=100001)
    text += box("B", upper, n[0], (0.0, 0.0, gap * s), (s, s, g * s))
    text += material("L", young[1], nu[1]) + material("B", young[0], nu[0])
    if tied:
        text += f"*TIE, NAME=GLUE{adjust}\nB-Z0-F, L-Z1-F\n"
    else:
        text += "*SURFACE INTERACTION, NAME=I\n*FRICTION\n"
        text += f"{mu!r}\n*CONTACT PAIR, INTERACTION=I\nB-Z0-F, L-Z1-F\n"
    sides = "".join(f"{b}-{side}, {axis + 1}, {axis + 1}\n" for b in "BL"
                    for side, (axis, _) in SIDES.items() if axis < 2)  # fmt: skip
    return text + step(f"*BOUNDARY\n{sides}L-Z0, 3, 3\nB-Z1, 3, 3, {-press * s!r}\n")


def oedometer(young, nu=NU):
    """Return the modulus of a body between walls."""
    return young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


def of_springs(axis, name, extreme, upper, lower, allowed=1e-6, refusal="", reason="",
               **options):  # fmt: skip
    """Return a scene of two boxes between walls, with the force between them."""
    young, press = options.get("young", (YOUNG, YOUNG)), options.get("press", 0.01)
    nu, heights = options.get("nu", (NU, NU)), options.get("heights", (1.0, 1.0))
    soft = sum(h / oedometer(e, p) for h, e, p in zip(heights, young[::-1], nu[::-1], strict=True))
    gap, size = options.get("gap", 0.0), options.get("size", 1.0)
    true = max(0.0, press - gap) / soft * size**2

    def measure(result):
        x, f = result.points, result.field("reaction_force", -1)
        low = x[:, 2] == x[:, 2].min()
        high = x[:, 2] == x[:, 2].max()
        forces = [f[low, 2].sum(), -f[high, 2].sum()]
        if len(result.pairs):
            forces.append(abs(result.pairs[0].resultant[-1, 2]))
        return np.array([1.0, *(force / (true or 1.0) for force in forces)])

    ones = np.array([1.0] + (2 if options.get("tied") else 3) * [1.0 if true else 0.0])
    return FiniteScene(axis, name, extreme, walled(upper, lower, **options), measure, ones, CLOSED,
                       allowed, refusal, reason)  # fmt: skip


def pushed(kind, units=AS_IT_IS, *, mu=0.3, nu=NU, n=(3, 3, 2), press=0.01, push=0.004, glued=False,
           young=YOUNG, increments=4, height=1.0, bent=None):  # fmt: skip
    """Return a box pressed on the ground by its top, then pushed along it."""

    def moved(v):
        return "*BOUNDARY\n" + "".join(f"B-Z1, {i}, {i}, {c!r}\n"
                                       for i, c in enumerate(units.vector(v), 1))  # fmt: skip

    held = "*BOUNDARY\nB-Z0, 1, 3\n" if glued else ground(mu=mu, units=units)
    return (
        box("B", kind, n, (-0.5, -0.5, 0.0), (1.0, 1.0, height), units=units, bent=bent)
        + material("B", young * units.stress, nu)
        + held + step(moved([0, 0, -press])) + step(moved([push, 0, -press]), increments)
    )  # fmt: skip


def on_sole(units=AS_IT_IS, young=YOUNG):
    """Return what measures the force on the sole, in units of 1."""

    def measure(result):
        if len(result.pairs):
            force = result.pairs[0].resultant[-1]
        else:
            level = (result.points / units.length @ units.turn - units.origin @ units.turn)[:, 2]
            force = result.field("reaction_force", -1)[level < 1e-6].sum(axis=0)
        return units.turn.T @ force / (young * units.stress * units.length**2)

    return measure


def under_ball(kind, units=AS_IT_IS, *, depth=0.02, mu=0.3, n=(4, 4, 2), radius=2.0, drag=0.0,
               bent=None):  # fmt: skip
    """Return a box held below, with a ball pressed into its top."""
    centre = ", ".join(repr(float(c)) for c in units.place([0.0, 0.0, 1.0 + radius]))

    def moved(v):
        return "*BOUNDARY\n" + "".join(f"900000, {i}, {i}, {c!r}\n"
                                       for i, c in enumerate(units.vector(v), 1))  # fmt: skip

    return (
        box("B", kind, n, (-1.0, -1.0, 0.0), (2.0, 2.0, 1.0), units=units, bent=bent)
        + material("B", YOUNG * units.stress)
        + f"*NODE\n900000, {centre}\n"
        + f"*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=900000\n{centre}, "
        f"{radius * units.length!r}\n*SURFACE INTERACTION, NAME=I\n*FRICTION\n{mu!r}\n"
        f"*CONTACT PAIR, INTERACTION=I\nB-Z1-F, BALL\n*BOUNDARY\nB-Z0, 1, 3\n"
        + step(moved([0, 0, -depth]), 2) + (step(moved([drag, 0, -depth]), 2) if drag else "")
    )  # fmt: skip


def alone(kind, load=PRESSURE):
    """Return one tetrahedron, right-angled, on a plane, pressed at its top by a force."""
    corners = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    x = np.concatenate([corners, *([(corners[a] + corners[b]) / 2] for a, b in KINDS[kind][1])])
    solid = Solid("B", kind, x, np.arange(len(x))[None])
    text = solid.cards()
    for side, axis in (("X0", 0), ("Y0", 1), ("Z0", 2)):
        text += solid.set_cards(f"B-{side}", np.flatnonzero(x[:, axis] == 0))
    return (
        text + material("B") + ground() + step(PLANES + f"*CLOAD\n4, 3, {-load!r}\n")
    )  # fmt: skip


# --- Maps of a unit cube -------------------------------------------------------------------------


def flattened(x, left=1e-4):
    """Move the inner corner of 2 x 2 x 2 elements along a diagonal, nearly to a corner."""
    inner = np.all((x > 0.4) & (x < 0.6), axis=1)
    return np.where(inner[:, None], 2 * left * x, x)


def squeezed(x, left=1e-4):
    """Move two of the middle planes of 2 x 2 x 2 elements nearly to the bottom and to a side."""
    y = x.copy()
    for axis in (0, 2):
        y[:, axis] = np.interp(x[:, axis], [0, 0.5, 1], [0, left, 1])
    return y


def skewed(x):
    """Shear the inside: no inner face stays along the axes."""
    inside = np.prod(4 * x * (1 - x), axis=1)[:, None]
    return x + 0.15 * inside * np.sin(5 * x[:, [1, 2, 0]])


# --- The scenes ----------------------------------------------------------------------------------


def slivers():
    """Return meshes with slivers."""
    for kind in ("C3D4", "C3D10"):
        yield of_patch("sliver", f"sliver-{kind}", f"{kind}, tetrahedra of quality 1e-4", kind,
                       bent=squeezed)  # fmt: skip
        yield of_patch("sliver", f"flat-{kind}", f"{kind}, an inner corner near the bottom's",
                       kind, bent=flattened)  # fmt: skip
    for kind in ("C3D6", "C3D15", "C3D20", "C3D20R"):
        # The pressure on a strip of 1e-4 is that of a force of 1e-5.
        yield of_patch("sliver", f"sliver-{kind}", f"{kind}, layers and strips of 1e-4", kind,
                       allowed=1e-3 if kind == "C3D20R" else 1e-6, bent=squeezed)  # fmt: skip


SOFT = "(height over width) to the fourth is 1e-16: stiffness against bending is rounding"


def aspects():
    """Return elements that are flat or long."""
    for kind in TYPES:
        yield of_patch("aspect", f"flat-1e4-{kind}", f"{kind}, 1e4 times as wide as high", kind,
                       size=(2.0, 2.0, 2e-4), free=False)  # fmt: skip
    for kind in ("C3D4", "C3D10", "C3D15", "C3D20R"):
        yield of_patch("aspect", f"long-1e4-{kind}", f"{kind}, 1e4 times as high as wide", kind,
                       size=(1.0, 1.0, 1e4))  # fmt: skip
    for kind in ("C3D10", "C3D20R"):
        yield of_patch("aspect", f"sheet-100-{kind}", f"{kind}, a free sheet of 100 by 100 by 1",
                       kind, size=(100.0, 100.0, 1.0))  # fmt: skip
        yield of_patch("aspect", f"sheet-1e4-{kind}", f"{kind}, a free sheet of 1e4 by 1e4 by 1",
                       kind, size=(1e4, 1e4, 1.0), refusal="double precision",
                       reason=SOFT)  # fmt: skip


def poisson():
    """Return nearly incompressible bodies."""
    words = "locks: the table of docs/deck.md"
    for kind in TYPES:
        refused = kind in ("C3D4", "C3D6", "C3D15", "C3D20")
        yield of_patch("Poisson", f"nu-0.4999-{kind}", f"{kind}, nu = 0.4999", kind, nu=0.4999,
                       allowed=1e-6, bent=skewed, refusal="Poisson's ratio" if refused else "",
                       reason=words if refused else "")  # fmt: skip
    for kind, nu in (("C3D4", 0.48), ("C3D6", 0.49), ("C3D15", 0.495), ("C3D20", 0.499)):
        yield of_patch("Poisson", f"nu-{nu}-{kind}", f"{kind} at its limit", kind, nu=nu,
                       allowed=1e-7, bent=skewed)  # fmt: skip


ROUNDED = (
    "displacements in double precision cannot balance",
    "1e-16 of the way that the hard body moves strains it by more than 1e-7 of the force",
)


def ratios():
    """Return two boxes of different types, one of them much harder."""
    for upper, lower, young in (
        ("C3D10", "C3D20R", (YOUNG, 1e8 * YOUNG)), ("C3D20", "C3D10", (1e8 * YOUNG, YOUNG)),
        ("C3D15", "C3D4", (YOUNG, 1e8 * YOUNG)), ("C3D6", "C3D15", (1e8 * YOUNG, YOUNG)),
        ("C3D20R", "C3D8", (YOUNG, 1e8 * YOUNG)), ("C3D4", "C3D20", (1e8 * YOUNG, YOUNG)),
    ):  # fmt: skip
        ratio = young[0] / young[1]
        hard = ratio > 1  # the body that is moved
        yield of_springs("stiffness ratio", f"ratio-{ratio:.0e}-{upper}-{lower}",
                         f"{upper} on {lower}, {ratio:.0e} times as stiff", upper, lower,
                         young=young, refusal=ROUNDED[0] if hard else "",
                         reason=ROUNDED[1] if hard else "")  # fmt: skip


def frictions():
    """Return boxes that stick with much friction, slide with little."""
    for kind in SECOND:
        yield FiniteScene("friction", f"glued-{kind}", f"{kind}, held by supports",
                          pushed(kind, glued=True), on_sole(), f"mu-1000-{kind}", "mu = 1000")
        yield FiniteScene("friction", f"mu-1000-{kind}", f"{kind}, mu = 1000: all sticks",
                          pushed(kind, mu=1000.0), on_sole(), f"glued-{kind}",
                          "held by supports")  # fmt: skip
    for kind, mu in product(TYPES, (0.0, 1e-3)):
        yield FiniteScene(
            "friction", f"mu-{mu:g}-{kind}", f"{kind}, mu = {mu:g}: all slides",
            pushed(kind, mu=mu, push=0.02),
            lambda r: np.array([1.0, -r.pairs[0].resultant[-1, 0] / r.pairs[0].resultant[-1, 2]]),
            np.array([1.0, mu]), "Coulomb's law",
        )  # fmt: skip


def symmetries():
    """Return boxes pressed and pushed, in other units, directions and places."""
    for kind in ("C3D10", "C3D15", "C3D20R"):
        plain = f"plain-{kind}"
        yield FiniteScene("units", plain, f"{kind}, pressed and pushed", pushed(kind), on_sole(),
                          f"turned-{kind}", "turned by 37 degrees", 1e-7)  # fmt: skip
        for name, words, units in (
            ("metres", "lengths in m for mm", Units(1e-3, 1e6)),
            ("small", "lengths times 1e-9", Units(length=1e-9)),
            ("large", "lengths times 1e9", Units(length=1e9)),
            ("soft", "stresses times 1e-9", Units(stress=1e-9)),
            ("hard", "stresses times 1e9", Units(stress=1e9)),
            ("turned", "turned by 37 degrees about (1, 2, 2)", Units(angle=37.0)),
            ("far", "1e6 of its edges from the origin", Units(origin=(1e6, -1e6, 1e6))),
        ):  # fmt: skip
            yield FiniteScene("units", f"{name}-{kind}", f"{kind}, {words}", pushed(kind, units),
                              on_sole(units), plain, "as it is", 1e-5 if name == "far" else 1e-7)


def balls():
    """Return balls pressed into a box, and the same turned."""
    half = Units(angle=180.0)
    for kind, mu in (("C3D10", 0.0), ("C3D10", 1000.0), ("C3D15", 0.3), ("C3D20R", 0.3),
                     ("C3D20", 10.0)):  # fmt: skip
        name = f"ball-{mu:g}-{kind}"
        yield FiniteScene("round tool", name, f"{kind}, a ball pressed in and drawn, mu = {mu:g}",
                          under_ball(kind, mu=mu, drag=0.05), on_top(), f"{name}-turned",
                          "turned by 180 degrees", 1e-6)  # fmt: skip
        yield FiniteScene("round tool", f"{name}-turned", "the same, turned by 180 degrees",
                          under_ball(kind, half, mu=mu, drag=0.05), on_top(half), name,
                          "not turned", 1e-6)  # fmt: skip


def on_top(units=AS_IT_IS):
    """Return what measures the force of the ball, in units of 1."""
    return lambda r: units.turn.T @ r.pairs[0].resultant[-1] / (units.stress * units.length**2)


def single():
    """Return single elements, and bodies one element thick."""
    for kind in ("C3D4", "C3D10"):
        yield FiniteScene(
            "one element", f"one-{kind}", f"one {kind}, a force on its top", alone(kind),
            lambda r: r.pairs[0].resultant[-1] / PRESSURE, np.array([0.0, 0.0, 1.0]), "balance",
        )  # fmt: skip
    for kind in ("C3D6", "C3D15", "C3D20", "C3D20R"):
        yield of_patch("one element", f"one-{kind}", f"one cell of {kind}", kind, n=(1, 1, 1))
    for kind in TYPES:
        yield of_patch("one element", f"thin-{kind}", f"{kind}, one element thick, 20 wide", kind,
                       n=(5, 5, 1), size=(20.0, 20.0, 1.0))  # fmt: skip


def middles():
    """Return mid-side nodes near the quarter points of their edges.

    C3D10 and C3D20R, whose points do not integrate forces of such elements exactly, carry the load
    but not an even stress: of them the force counts.
    """
    for kind, middle in (*product(SECOND, (0.27,)), ("C3D10", 0.74), ("C3D20", 0.74)):
        words = f"{kind}, mid-side nodes at {middle} of their edges"
        scene = of_patch("mid-side nodes", f"middle-{middle}-{kind}", words, kind, middle=middle)
        if kind in ("C3D10", "C3D20R"):
            scene = replace(
                scene, true=np.array([1.0]), source="balance",
                measure=lambda r: r.pairs[0].resultant[-1, 2:] / PRESSURE,
            )  # fmt: skip
        yield scene


def gaps():
    """Return bodies that nearly touch, touch at last, or overlap."""
    for upper, lower in (("C3D10", "C3D20"), ("C3D15", "C3D10"), ("C3D20R", "C3D4")):
        for gap, words in ((1e-9, "a gap of 1e-9"), (0.01 - 1e-6, "a gap closed at last"),
                           (0.0101, "a gap that stays"), (-1e-9, "an overlap of 1e-9"),
                           (-0.2, "an overlap of 0.2")):  # fmt: skip
            yield of_springs("gap", f"gap-{gap:.3g}-{upper}-{lower}",
                             f"{upper} on {lower}, {words}", upper, lower, gap=gap)  # fmt: skip


def ties():
    """Return ties across types, one side 1e8 times as stiff."""
    for upper, lower, young in (
        ("C3D10", "C3D20R", (YOUNG, YOUNG)), ("C3D20", "C3D4", (YOUNG, 1e8 * YOUNG)),
        ("C3D4", "C3D20", (1e8 * YOUNG, YOUNG)), ("C3D15", "C3D8", (YOUNG, 1e-8 * YOUNG)),
        ("C3D6", "C3D10", (YOUNG, YOUNG)), ("C3D8", "C3D15", (YOUNG, YOUNG)),
    ):  # fmt: skip
        hard = young[0] > 1e3 * young[1]
        yield of_springs("tie", f"tie-{young[0] / young[1]:.0e}-{upper}-{lower}",
                         f"{upper} tied to {lower}, {young[0] / young[1]:.0e} times as stiff",
                         upper, lower, young=young, tied=True,
                         refusal=ROUNDED[0] if hard else "",
                         reason=ROUNDED[1] if hard else "")  # fmt: skip


def refined():
    """Return meshes with elements that are cut away from contact."""
    for kind in TYPES:
        yield of_patch("refined", f"refined-{kind}", f"{kind}, cut at an upper corner", kind,
                       more="*REFINE\n1., 1., 1., 0.05\n", n=(2, 2, 6))  # fmt: skip


def type_scenes():
    """Return all scenes, in the order of the page."""
    found = [
        scene
        for family in (slivers, aspects, poisson, ratios, frictions, symmetries, balls, single,
                       middles, gaps, ties, refined)
        for scene in family()
    ]  # fmt: skip
    assert len({scene.name for scene in found}) == len(found)
    return found
