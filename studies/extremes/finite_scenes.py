"""Small scenes at finite strain, each extreme in one respect, with what is true of them.

What is true comes from a closed form of the law written here, from a symmetry of mechanics (another
unit, another place, another direction, more increments), or from a balance. A scene that is to be
refused has the words that its message must have, and the reason why they are right.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from math import cos, radians, sin

import numpy as np
from scipy.optimize import brentq

YOUNG, NU = 200.0, 0.3


@dataclass(frozen=True)
class FiniteScene:
    """A deck, what is measured of its result, and what that must be."""

    axis: str
    name: str
    extreme: str  # what is extreme, in words
    deck: str
    measure: Callable  # of the open result: an array
    true: np.ndarray | str  # the same by a closed form, or the name of the scene it must equal
    source: str  # of what is true, in words
    allowed: float = 1e-6  # of the largest entry
    refusal: str = ""  # words of the message, where it is to be refused
    reason: str = ""  # why that is right


# --- Laws: energy's derivatives by hand ----------------------------------------------------------


@dataclass(frozen=True)
class Law:
    """Cards of a material, and the principal Cauchy stresses at principal stretches."""

    cards: str
    stress: Callable

    def force(self, along, free=2):
        """Force on a unit of undeformed area along z; x (and y) free, the rest held at 1."""

        def at(across):
            stretches = np.array([across, across if free == 2 else 1.0, along])
            return self.stress(stretches) * stretches.prod() / stretches

        if free == 0:
            return at(1.0)[2]
        across = brentq(lambda a: at(a)[0], 0.2, 6.0, xtol=1e-15, rtol=1e-15)
        return at(across)[2]


def neo_hooke(young=YOUNG, nu=NU):
    """Return the law with G/2 (I1 J^(-2/3) - 3) + K/2 (J - 1)^2."""
    shear, bulk = young / (2 * (1 + nu)), young / (3 * (1 - 2 * nu))

    def stress(a):
        volume = a.prod()
        return shear * volume ** (-5 / 3) * (a**2 - (a**2).mean()) + bulk * (volume - 1)

    return Law(f"*HYPERELASTIC, NEO HOOKE\n{shear / 2!r}, {2 / bulk!r}", stress)


def mooney_rivlin(young=YOUNG, nu=NU):
    """Return the law with a third of the shear modulus in I2."""
    shear, bulk = young / (2 * (1 + nu)), young / (3 * (1 - 2 * nu))
    first, second = shear / 3, shear / 6

    def stress(a):
        volume = a.prod()
        b = volume ** (-2 / 3) * a**2
        tau = 2 * first * b - 2 * second / b
        return (tau - tau.mean()) / volume + bulk * (volume - 1)

    return Law(f"*HYPERELASTIC, MOONEY-RIVLIN\n{first!r}, {second!r}, {2 / bulk!r}", stress)


def blatz_ko(shear=80.0):
    """Return the law with mu/2 (sum of 1/a^2 + 2 J - 5)."""
    return Law(
        f"*HYPERFOAM, N=1\n{shear!r}, -2., 0.25", lambda a: shear * (1 - a**-2 / a.prod())
    )


def st_venant(young=YOUNG, nu=NU):
    """Return the law that is linear in Green's strain."""
    shear, bulk = young / (2 * (1 + nu)), young / (3 * (1 - 2 * nu))

    def stress(a):
        green = (a**2 - 1) / 2
        second = (bulk - 2 * shear / 3) * green.sum() + 2 * shear * green
        return a**2 * second / a.prod()

    return Law(f"*ELASTIC\n{young!r}, {nu!r}", stress)


# --- Decks ---------------------------------------------------------------------------------------


def static(increments, direct=False):
    """Return the cards that begin a step."""
    return f"*STEP, NLGEOM\n*STATIC{', DIRECT' * direct}\n{1 / increments!r}, 1.\n"


def bar(law, stretch, *, element="C3D8", size=(3.0, 1.0, 2.0), n=(2, 1, 2), sides="",
        increments=10, direct=False, mu=0.0):  # fmt: skip
    """Return a bar on three planes of symmetry, pressed by a plate or pulled along z.

    `sides` are cards that hold more of it. All of it strains alike.
    """
    if stretch < 1:
        plate = f"""\
*NODE
9000, 0., 0., {size[2]!r}
*OBSTACLE, NAME=PLATE, TYPE=PLANE, REF NODE=9000
0., 0., {size[2]!r}, 0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu!r}
*CONTACT PAIR, INTERACTION=I
B-ZMAX, PLATE
"""
        moved = "9000, 1, 2\n9000, 3, 3, "
    else:
        plate, moved = "", "B-ZMAX, 3, 3, "
    return f"""\
*BLOCK, NAME=B, NX={n[0]}, NY={n[1]}, NZ={n[2]}, TYPE={element}
0., 0., 0., {size[0]!r}, {size[1]!r}, {size[2]!r}
*MATERIAL, NAME=M
{law.cards}
*SOLID SECTION, ELSET=B, MATERIAL=M
{plate}*CONTACT SOLVER, TOLERANCE=1e-10
{static(increments, direct)}*BOUNDARY
B-XMIN, 1, 1
B-YMIN, 2, 2
B-ZMIN, 3, 3
{sides}{moved}{(stretch - 1) * size[2]!r}
*END STEP
"""


def on_top(result):
    """Return the force on the bar's upper end along z, of the plate or of the supports."""
    if len(result.pairs):
        return np.array([result.pairs[0].resultant[-1, 2]])
    top = result.points[:, 2] == result.points[:, 2].max()
    return np.array([result.field("reaction_force", -1)[top, 2].sum()])


WALLED = "B-XMAX, 1, 1\nB-YMAX, 2, 2\n"
SHEET = "B-YMAX, 2, 2\n"


def grid(n, place, element):
    """Return cards of nodes, elements and the sets LOW, TOP and ALL of a block of n x n x n."""
    index = {at: k for k, at in enumerate(product(range(n + 1), repeat=3), 1)}
    lines = ["*NODE, NSET=ALL"]
    for at, number in index.items():
        x, y, z = map(float, place(np.array(at) / n))
        lines.append(f"{number}, {x!r}, {y!r}, {z!r}")
    lines.append(f"*ELEMENT, TYPE={element}, ELSET=B")
    around = [(0, 0), (1, 0), (1, 1), (0, 1)]
    for number, (i, j, k) in enumerate(product(range(n), repeat=3), 1):
        corners = [str(index[i + a, j + b, k + c]) for c in (0, 1) for a, b in around]
        lines.append(", ".join([str(number), *corners]))
    for name, level in (("LOW", 0), ("TOP", n)):
        lines += [f"*NSET, NSET={name}", *(str(m) for at, m in index.items() if at[2] == level)]
    lines += ["*SURFACE, NAME=SOLE, TYPE=ELEMENT"]
    lines += [f"{m}, S1" for m, at in enumerate(product(range(n), repeat=3), 1) if at[2] == 0]
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Units:
    """What a length of 1 and a stress of 1 become, where the scene is, and how it is turned."""

    length: float = 1.0
    stress: float = 1.0
    angle: float = 0.0  # about (1, 2, 2)/3 [degrees]
    origin: tuple = (0.0, 0.0, 0.0)  # of lengths

    @property
    def turn(self):
        """The rotation, by Rodrigues' formula."""
        x, y, z = np.array([1.0, 2.0, 2.0]) / 3
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        t = radians(self.angle)
        return np.eye(3) + sin(t) * cross + (1 - cos(t)) * cross @ cross

    def vector(self, v):
        """A vector of lengths in these units, as three numbers of a deck."""
        return [float(c) for c in self.length * self.turn @ np.asarray(v, dtype=float)]

    def place(self, x):
        """A place in them."""
        return self.length * (self.turn @ np.asarray(x, dtype=float) + np.array(self.origin))


def pushed(units=Units(), *, mu=0.3, nu=NU, element="C3D8", n=3, press=0.2, push=0.3,
           increments=(5, 10), direct=False, glued=False):  # fmt: skip
    """Return a cube of rubber, pressed on the ground by its upper side, then pushed."""
    law = neo_hooke(YOUNG * units.stress, nu)

    def moved(v):
        return "\n".join(f"TOP, {i}, {i}, {c!r}" for i, c in enumerate(units.vector(v), 1))

    normal = [float(c) for c in units.turn @ np.array([0.0, 0.0, 1.0])]
    low = [float(c) for c in units.place([0.0, 0.0, 0.0])]
    ground = ", ".join(repr(c) for c in (*low, *normal))
    contact = f"""\
*OBSTACLE, NAME=GROUND, TYPE=PLANE
{ground}
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu!r}
*CONTACT PAIR, INTERACTION=I
SOLE, GROUND
"""
    held = "*BOUNDARY\nLOW, 1, 3\n" if glued else ""
    return f"""\
{grid(n, units.place, element)}*MATERIAL, NAME=M
{law.cards}
*SOLID SECTION, ELSET=B, MATERIAL=M
{"" if glued else contact}*CONTACT SOLVER, TOLERANCE=1e-10
{held}{static(increments[0], direct)}*BOUNDARY
{moved([0, 0, -press])}
*END STEP
{static(increments[1], direct)}*BOUNDARY
{moved([push, 0, -press])}
*END STEP
"""


def rubbed(units=Units(), *, mu=1000.0, drag=0.5, n=3):
    """Return the cube held below, a ball pressed into its upper side and drawn along."""
    law = neo_hooke(YOUNG * units.stress)
    centre = ", ".join(repr(float(c)) for c in units.place([0.5, 0.5, 1.6]))
    upper = [k for k, at in enumerate(product(range(n), repeat=3), 1) if at[2] == n - 1]

    def moved(v):
        return "\n".join(f"9000, {i}, {i}, {c!r}" for i, c in enumerate(units.vector(v), 1))

    return f"""\
{grid(n, units.place, "C3D8")}*SURFACE, NAME=CROWN, TYPE=ELEMENT
{"".join(f"{k}, S2" + chr(10) for k in upper)}*NODE
9000, {centre}
*MATERIAL, NAME=M
{law.cards}
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=9000
{centre}, {0.6 * units.length!r}
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu!r}
*CONTACT PAIR, INTERACTION=I
CROWN, BALL
*CONTACT SOLVER, TOLERANCE=1e-10
*BOUNDARY
LOW, 1, 3
{static(4)}*BOUNDARY
{moved([0, 0, -0.25])}
*END STEP
{static(8)}*BOUNDARY
{moved([drag, 0, -0.25])}
*END STEP
"""


def on_sole(units=Units()):
    """Return what measures the force on the sole and the strain energy, in units of 1."""

    def measure(result):
        if len(result.pairs):
            force = result.pairs[0].resultant[-1]
        else:
            low = result.points[:, 2] == result.points[:, 2].min()
            force = result.field("reaction_force", -1)[low].sum(axis=0)
        force = units.turn.T @ force / (units.stress * units.length**2)
        energy = result.history("energy/strain")[-1] / (units.stress * units.length**3)
        return np.array([*force, energy])

    return measure


def stack(young, nu=(0.3, 0.3), heights=(1.0, 1.0), n=((2, 2, 2), (3, 3, 2)), press=0.4,
          element="C3D8"):  # fmt: skip
    """Return two blocks, the upper one pressed on the lower one without friction."""
    cards = ""
    for name, e, p, low, height, m in zip(
        "AB", young, nu, (0.0, heights[0]), heights, n, strict=True
    ):
        cards += f"""\
*BLOCK, NAME={name}, NX={m[0]}, NY={m[1]}, NZ={m[2]}, TYPE={element}
0., 0., {low!r}, 1., 1., {height!r}
*MATERIAL, NAME=OF-{name}
{neo_hooke(e, p).cards}
*SOLID SECTION, ELSET={name}, MATERIAL=OF-{name}
"""
    return f"""\
{cards}*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, A-ZMAX
{static(10)}*BOUNDARY
A-ZMIN, 3, 3
A-XMIN, 1, 1
A-YMIN, 2, 2
A-XMAX, 1, 1
A-YMAX, 2, 2
B-XMIN, 1, 1
B-YMIN, 2, 2
B-XMAX, 1, 1
B-YMAX, 2, 2
B-ZMAX, 3, 3, {-press!r}
*END STEP
"""


def force_of_stack(young, nu=(0.3, 0.3), heights=(1.0, 1.0), press=0.4):
    """Return the force between them: both are in uniform strain between walls."""
    laws = [neo_hooke(e, p) for e, p in zip(young, nu, strict=True)]

    def stretch(law, force):
        return brentq(lambda a: law.force(a, 0) - force, 0.05, 1.0, xtol=1e-16, rtol=1e-15)

    # The stretch of the first block; the second has what is left.
    total = sum(heights) - press
    low = max(0.05, (total - heights[1]) / heights[0])
    high = min(1.0, (total - 0.05 * heights[1]) / heights[0])

    def apart(first):
        second = (total - first * heights[0]) / heights[1]
        return laws[0].force(first, 0) - laws[1].force(second, 0)

    softer = young[1] < young[0]
    if not softer:
        first = brentq(apart, low, high, xtol=1e-16, rtol=1e-15)
        return np.array([laws[0].force(first, 0)])
    second = brentq(
        lambda a: laws[1].force(a, 0) - laws[0].force((total - a * heights[1]) / heights[0], 0),
        max(0.05, (total - heights[0]) / heights[1]), 1.0, xtol=1e-16, rtol=1e-15,
    )  # fmt: skip
    return np.array([laws[1].force(second, 0)])


def between_blocks(result):
    """Return the force between them along z."""
    return np.array([-abs(result.pairs[0].resultant[-1, 2])])


def turning_bar(angle, stretch=1.0, increments=18, element="C3D8"):
    """Return a bar whose ends are turned about z together, and drawn apart to a stretch."""
    cards = f"""\
*BLOCK, NAME=B, NX=4, NY=1, NZ=1, TYPE={element}
-2., -0.5, -0.5, 4., 1., 1.
*MATERIAL, NAME=M
{neo_hooke().cards}
*SOLID SECTION, ELSET=B, MATERIAL=M
"""
    boundary = ""
    for k, (x, y, z) in enumerate(product((-2.0, 2.0), (-0.5, 0.5), (-0.5, 0.5))):
        node = {(-2.0, -0.5): 1, (2.0, -0.5): 5, (-2.0, 0.5): 6, (2.0, 0.5): 10}[x, y]
        node += 10 * (z > 0)
        rows = {1: [], 2: []}
        for j in range(increments + 1):
            t = j / increments
            a = radians(angle) * t
            drawn = x * (1 + (stretch - 1) * t)
            rows[1].append((t, cos(a) * drawn - sin(a) * y - x))
            rows[2].append((t, sin(a) * drawn + cos(a) * y - y))
        for axis, values in rows.items():
            cards += f"*AMPLITUDE, NAME=A{k}-{axis}\n"
            cards += "".join(f"{t!r}, {v!r}\n" for t, v in values)
            boundary += f"*BOUNDARY, AMPLITUDE=A{k}-{axis}\n{node}, {axis}, {axis}, 1.\n"
    boundary += "*BOUNDARY\nB-XMIN, 3, 3\nB-XMAX, 3, 3\n"
    return f"{cards}{static(increments)}{boundary}*END STEP\n"


def energy_and_length(result):
    """Return the strain energy and the deformed distance between the ends' middles."""
    x = result.points + result.field("displacement", -1)
    low = result.points[:, 0] == result.points[:, 0].min()
    high = result.points[:, 0] == result.points[:, 0].max()
    apart = x[high].mean(axis=0) - x[low].mean(axis=0)
    return np.array([result.history("energy/strain")[-1], np.linalg.norm(apart)])


# --- The scenes ----------------------------------------------------------------------------------

CLOSED = "closed form"


def of_bar(axis, name, extreme, law, stretch, free=2, allowed=1e-6, **options):
    """Return a scene of a bar whose force is known."""
    size = options.get("size", (3.0, 1.0, 2.0))
    true = np.array([law.force(stretch, free) * size[0] * size[1]])
    sides = {2: "", 1: SHEET, 0: WALLED}[free]
    deck = bar(law, stretch, sides=sides, **options)
    return FiniteScene(axis, name, extreme, deck, on_top, true, CLOSED, allowed)


def stretches():
    """Return bars that are pressed to 0.3 and pulled to 5."""
    axis = "stretch"
    neo, mooney, foam = neo_hooke(), mooney_rivlin(), blatz_ko()
    for stretch in (0.7, 0.5, 0.4):
        yield of_bar(axis, f"pressed-{stretch}", f"neo-Hooke, stretch {stretch}", neo, stretch)
    yield of_bar(
        axis, "pressed-0.2", "neo-Hooke, stretch 0.2: it has collapsed sideways at 0.39", neo, 0.2
    )
    yield of_bar(
        axis, "pressed-0.3", "neo-Hooke, nu = 0.45, stretch 0.3", neo_hooke(nu=0.45), 0.3
    )
    yield of_bar(axis, "walled-0.3", "neo-Hooke, between four walls, 0.3", neo, 0.3, 0)
    yield of_bar(axis, "sheet-0.3", "Mooney-Rivlin, between two walls, 0.3", mooney, 0.3, 1)
    yield of_bar(axis, "pulled-2", "neo-Hooke, stretch 2", neo, 2.0)
    yield of_bar(axis, "pulled-5", "neo-Hooke, stretch 5", neo, 5.0)
    yield of_bar(axis, "pulled-5-incompatible", "the same, C3D8I", neo, 5.0, element="C3D8I")
    yield of_bar(axis, "foam-0.4", "Blatz-Ko, stretch 0.4", foam, 0.4)
    none = np.array([0.0])
    yield FiniteScene(
        axis, "foam-0.3", "Blatz-Ko, stretch 0.3", bar(foam, 0.3), on_top, none, CLOSED,
        refusal="elliptic",
        reason="two stretches have the ratio 2 + sqrt(3) from (2 + sqrt(3))^(-4/5) = 0.349 on",
    )  # fmt: skip
    yield FiniteScene(
        axis, "venant-0.5", "St Venant-Kirchhoff, stretch 0.5", bar(st_venant(), 0.5), on_top,
        none, CLOSED, refusal="elliptic",
        reason="in uniaxial stress the law is elliptic down to 0.592",
    )  # fmt: skip


def poisson():
    """Return nearly incompressible bodies."""
    axis = "Poisson"
    for nu, element in product((0.49, 0.499, 0.4999), ("C3D8I",)):
        yield of_bar(
            axis, f"nu-{nu}", f"nu = {nu}, stretch 0.6, {element}", neo_hooke(nu=nu), 0.6,
            element=element,
        )  # fmt: skip
    yield of_bar(
        axis, "nu-0.4999-dilatation", "nu = 0.4999, stretch 0.9, C3D8B", neo_hooke(nu=0.4999), 0.9,
        element="C3D8B",
    )  # fmt: skip
    yield of_bar(
        axis, "nu-0.4999-walled", "nu = 0.4999, between four walls, 0.95, C3D8I",
        neo_hooke(nu=0.4999), 0.95, 0, element="C3D8I",
    )  # fmt: skip
    for element, angle in product(("C3D8I", "C3D8B"), (0.0, 90.0)):
        name = f"nu-0.4999-pushed-{element}"
        units, words = Units(angle=angle), "pressed and pushed with friction"
        deck = pushed(units, nu=0.4999, element=element, press=0.1, push=0.1)
        if angle == 0.0:
            yield FiniteScene(
                axis, name, f"nu = 0.4999, {words}, {element}", deck, on_sole(units),
                f"{name}-turned", "turned by 90 degrees",
            )  # fmt: skip
        else:
            yield FiniteScene(
                axis, f"{name}-turned", "the same, turned by 90 degrees", deck, on_sole(units),
                name, "not turned",
            )  # fmt: skip


PLAIN = "plain"


def symmetries():
    """Return the cube pressed and pushed, in other units, directions and places."""
    yield FiniteScene(
        "units", PLAIN, "a cube of 1 with E = 200, pressed by 0.2 and pushed by 0.3", pushed(),
        on_sole(), "turned-180", "turned by 180 degrees",
    )  # fmt: skip
    for name, words, units in (
        ("metres", "lengths in m for mm", Units(1e-3, 1e6)),
        ("small", "lengths times 1e-6", Units(length=1e-6)),
        ("large", "lengths times 1e6", Units(length=1e6)),
        ("soft", "stresses times 1e-6", Units(stress=1e-6)),
        ("hard", "stresses times 1e12", Units(stress=1e12)),
        ("tiny", "lengths times 1e-12", Units(length=1e-12)),
    ):
        yield FiniteScene(
            "units", name, words, pushed(units), on_sole(units), PLAIN, "other units", 1e-7
        )
    for angle in (37.0, 90.0, 180.0):
        units = Units(angle=angle)
        yield FiniteScene(
            "turn", f"turned-{angle:.0f}", f"turned by {angle:.0f} degrees about (1, 2, 2)",
            pushed(units), on_sole(units), PLAIN, "not turned", 1e-7,
        )  # fmt: skip
    for far in (1e3, 1e6, 1e9):
        units = Units(origin=(far, -far, far))
        yield FiniteScene(
            "distance", f"far-{far:.0e}", f"{far:.0e} of its edges from the origin",
            pushed(units), on_sole(units), PLAIN, "at the origin", max(1e-7, 1e-13 * far),
        )  # fmt: skip


def turns():
    """Return bars that are turned as they are loaded."""
    for angle in (90.0, 180.0):
        yield FiniteScene(
            "turn", f"turning-{angle:.0f}", f"both ends turned by {angle:.0f} degrees",
            turning_bar(angle), energy_and_length, np.array([0.0, 4.0]), CLOSED,
        )  # fmt: skip
    yield FiniteScene(
        "turn", "turning-drawn", "both ends turned by 180 degrees, drawn to stretch 1.3",
        turning_bar(180.0, 1.3), energy_and_length, "drawn", "not turned",
    )  # fmt: skip
    yield FiniteScene(
        "turn", "drawn", "both ends drawn to stretch 1.3", turning_bar(0.0, 1.3), energy_and_length,
        "turning-drawn", "turned by 180 degrees",
    )  # fmt: skip


def aspects():
    """Return bars of elements that are long or flat."""
    neo = neo_hooke()
    for name, words, size in (
        ("flat-100", "elements 100 times as wide as high", (1.0, 1.0, 0.01)),
        ("flat-1e4", "elements 1e4 times as wide as high", (1.0, 1.0, 1e-4)),
        ("long-100", "elements 100 times as long as thick", (1.0, 1.0, 100.0)),
        ("strip-1e5", "elements of 1e5 x 1 x 300", (1e5, 1.0, 300.0)),
        ("flat-1e8", "elements 1e8 times as wide as high", (1.0, 1.0, 1e-8)),
    ):
        yield of_bar("aspect", name, f"{words}, stretch 0.6", neo, 0.6, size=size, n=(1, 1, 1))


def ratios():
    """Return two blocks, one of them much harder."""
    for young in ((200.0, 200.0), (200.0, 2e5), (200.0, 2e8), (2e8, 200.0), (2e11, 200.0)):
        ratio = young[1] / young[0]
        yield FiniteScene(
            "stiffness ratio", f"ratio-{ratio:.0e}", f"upper over lower block {ratio:.0e}",
            stack(young), between_blocks, force_of_stack(young), CLOSED,
        )  # fmt: skip


def frictions():
    """Return the cube with no friction and with very much."""
    yield FiniteScene(
        "friction", "glued", "the sole held by supports",
        pushed(glued=True, push=0.05), on_sole(), "mu-1000", "mu = 1000",
    )  # fmt: skip
    for mu in (10.0, 1000.0):
        yield FiniteScene(
            "friction", f"mu-{mu:.0f}", f"mu = {mu:.0f}: all sticks",
            pushed(mu=mu, push=0.05), on_sole(), "glued", "held by supports",
        )  # fmt: skip
    for mu in (1e-6, 0.1):
        yield FiniteScene(
            "friction", f"mu-{mu:g}", f"mu = {mu:g}: all slides", pushed(mu=mu, push=0.5),
            lambda result, mu=mu: np.array(
                [-result.pairs[0].resultant[-1, 0] / result.pairs[0].resultant[-1, 2] / mu]
            ),
            np.array([1.0]), "Coulomb's law",
        )  # fmt: skip
    yield FiniteScene(
        "friction", "mu-0", "mu = 0: no force along the ground", pushed(mu=0.0),
        lambda result: result.pairs[0].resultant[-1] / result.pairs[0].resultant[-1, 2],
        np.array([0.0, 0.0, 1.0]), "Coulomb's law",
    )  # fmt: skip


def balls():
    """Return a ball that rubs the cube."""
    half = Units(angle=180.0)
    for mu in (0.3, 1000.0):
        yield FiniteScene(
            "round tool", f"ball-{mu:g}", f"a ball pressed in and drawn along, mu = {mu:g}",
            rubbed(mu=mu), on_sole(), f"ball-{mu:g}-turned", "turned by 180 degrees",
        )  # fmt: skip
        yield FiniteScene(
            "round tool", f"ball-{mu:g}-turned", "the same, turned by 180 degrees",
            rubbed(half, mu=mu), on_sole(half), f"ball-{mu:g}", "not turned", 1e-7,
        )  # fmt: skip
    yield FiniteScene(
        "round tool", "ball-leaves", "a ball drawn off the edge: the cube is as it was",
        rubbed(mu=0.3, drag=5.0),
        lambda result: result.points + result.field("displacement", -1),
        np.array(list(product(np.arange(4) / 3, repeat=3))), "what is elastic",
    )  # fmt: skip


def increments():
    """Return the same way in 1 and in 100 increments."""
    neo = neo_hooke()
    for count in (1, 100):
        yield of_bar(
            "increments", f"pressed-in-{count}", f"stretch 0.4 in {count}", neo, 0.4,
            increments=count,
        )  # fmt: skip
    yield of_bar(
        "increments", "direct-in-1", "stretch 0.6 in 1, DIRECT", neo, 0.6, increments=1,
        direct=True,
    )  # fmt: skip
    for count in (1, 100):
        yield FiniteScene(
            "increments", f"pushed-in-{count}", f"pressed and pushed, mu = 1000, in {count} each",
            pushed(mu=1000.0, push=0.05, increments=(count, count)), on_sole(), "glued",
            "held by supports",
        )  # fmt: skip


def finite_scenes():
    """Return all scenes, in the order of the page."""
    found = [
        scene
        for family in (
            stretches, poisson, symmetries, turns, aspects, ratios, frictions, balls,
            increments,
        )
        for scene in family()
    ]  # fmt: skip
    assert len({scene.name for scene in found}) == len(found)
    return found
