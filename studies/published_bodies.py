"""Published cases of bodies that touch each other whose decks are written here: deck and values.

The page docs/studies/cases.md shows them, and tests/cases/test_published_bodies.py holds them to
what is published.
"""

import math

import numpy as np

from studies.case_bodies import fit_line_contact
from studies.case_values import mean_square
from studies.deck_cards import deck, pair, quarter_ring, step
from studies.meshes import Mesh
from studies.pages import percent, table

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
{young!r}, {nu!r}
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=HIGH, MATERIAL=M
"""

# --- SSNP167 of Code_Aster: rings in one another --------------------------------------------------


def rings_in_rings(theta, radii=(0.2, 0.6, 1.0), young=1e9, nu=0.2, mean=1e7, second=1e5):
    """Return pressure and radial displacement where two rings touch without friction, plane strain.

    The outer one is pressed by `mean` + `second` cos 2 theta. The mean is Lame's; the rest follows
    from the stress function (A r^2 + B r^4 + C/r^2 + D) cos 2 theta of each ring (Michell).
    """
    a, b, c = radii
    shear, kappa = young / (2 + 2 * nu), 3 - 4 * nu

    def normal(r):
        return np.array([-2, 0, -6 / r**4, -4 / r**2])

    def tangential(r):
        return np.array([2, 6 * r**2, -6 / r**4, -2 / r**2])

    def way(r):
        return np.array([-2 * r, (kappa - 3) * r**3, 2 / r**3, (kappa + 1) / r]) / (2 * shear)

    none = np.zeros(4)
    rows = [(normal(a), none), (tangential(a), none), (tangential(b), none), (none, tangential(b)),
            (none, tangential(c)), (normal(b), -normal(b)), (way(b), -way(b)), (none, normal(c))]
    inner = np.linalg.solve([np.concatenate(row) for row in rows], [0] * 7 + [-second])[:4]
    share = mean * c**2 / (c**2 - a**2)  # Lame: both rings are one
    lame_way = -share * b * (1 + nu) / young * (1 - 2 * nu + a**2 / b**2)
    cosine = np.cos(2 * theta)
    return (share * (1 - a**2 / b**2) - inner @ normal(b) * cosine,
            lame_way + inner @ way(b) * cosine)


def rings_deck(around, second):
    """Return the deck of rings with `around` elements each in a quarter, `second` as above."""
    across, height = 10, 0.05
    load, angle = [], 0.5 * np.pi / around[1]
    for k in range(2):
        for j in range(around[1] + 1):
            theta = j * angle
            share = angle * height / 2 * (0.5 if j in (0, around[1]) else 1.0)
            force = -share * (1e7 + second * np.cos(2 * theta))
            number = 20001 + (k * (around[1] + 1) + j + 1) * (across + 1) - 1
            load += [f"{number}, 1, {float(force * np.cos(theta))!r}",
                     f"{number}, 2, {float(force * np.sin(theta))!r}"]
    cards = "\n".join(load)
    return deck(
        quarter_ring("I", 1, (0.2, 0.6), (across, around[0]), height),
        quarter_ring("O", 20001, (0.6, 1.0), (across, around[1]), height),
        "*MATERIAL, NAME=M\n*ELASTIC\n1e9, 0.2\n"
        "*SOLID SECTION, ELSET=I, MATERIAL=M\n*SOLID SECTION, ELSET=O, MATERIAL=M\n",
        pair("I-OUT, O-IN"),
        f"*STEP\n*STATIC, DIRECT\n1., 1.\n*CLOAD\n{cards}\n*END STEP\n",
        held="I-X, 1\nI-Y, 2\nO-X, 1\nO-Y, 2\nI-ALL, 3\nO-ALL, 3",
    )


def rings_errors(result, second):
    """Return errors of contact pressure, point by point and on the whole, and of the way inwards.

    On the whole: of its mean and of its part with cos 2 theta, over all points. Each beside the
    largest of its kind.
    """
    touching = result.pairs[0]
    theta = np.arctan2(touching.coordinates[:, 1], touching.coordinates[:, 0])
    pressure, way = rings_in_rings(theta, second=second)
    force = touching.reaction[-1][:, 0]
    nodes = [result.nearest_node(place) for place in touching.coordinates]
    moved = result.field("displacement", -1)[nodes]
    radial = moved[:, 0] * np.cos(theta) + moved[:, 1] * np.sin(theta)
    waves = np.array([np.ones(theta.size), np.cos(2 * theta)])
    largest = (waves @ (touching.area * pressure))[0]
    return (np.abs(force / touching.area - pressure).max() / pressure.max(),
            np.abs(waves @ (force - touching.area * pressure)) / largest,
            np.abs(radial - way).max() / np.abs(way).max())


def rings(runs):
    """SSNP167: pressure and displacement of rings under a pressure that varies."""
    rows = []
    for around in ((32, 32), (32, 24), (24, 36)):
        for second in (1e5, 1e6):
            with runs.of_text("ssnp167", rings_deck(around, second)) as result:
                point, waves, way = rings_errors(result, second)
            rows.append([f"{around[0]}, {around[1]}", f"{second:.0e}", f"{100 * point:.2f} %",
                         f"{100 * waves[0]:.2f} %", f"{100 * waves[1]:.2f} %",
                         f"{100 * way:.2f} %"])
    heads = ["elements around", "p2", "pressure, worst point", "its mean",
             "its part with cos 2 theta", "way inwards"]
    return f"""\
## Rings in one another: SSNP167 of Code_Aster

Two rings alike, radii 0.2, 0.6 and 1, E = 1e9, nu = 0.2, without friction, pressed from outside by
1e7 + p2 cos 2 theta; the source has p2 = 1e5 and asks for 2 %. Plane strain. Beside Lame's mean and
Michell's stress function for the rest; errors beside the largest pressure and the largest way:

{table(heads, rows)}

Meshes that match are right at each point. Where the polygons do not match, corners of one lie in
front of sides of the other and overlap by a tenth of the displacement: there single pressures say
how they lie, and only what they add up to is that of the circles.
"""


# --- CGS-4 of NAFEMS: a wedge on a slope ----------------------------------------------------------


def wedge_deck(mu):
    """Return the deck of a wedge under a weight on a slope of a tenth, pushed up it at its side."""
    base, upper = Mesh("BASE"), Mesh("WEDGE", 10001)
    base.grid((12, 2, 3), lambda a, b, c: (6 * a, b, c * (1 + 0.6 * a)), SLOPE="k+")
    upper.grid((7, 3, 4), lambda a, b, c: (1 + 4 * a, b, (1 - c) * (1.1 + 0.4 * a) + 3 * c),
               SOLE="k-", TOP="k+")
    cards = [
        base.cards(FLOOR=lambda x, y, z: z == 0),
        upper.cards(SIDE=lambda x, y, z: x == 1, FLANK=lambda x, y, z: y == 0),
        "*MATERIAL, NAME=M\n*ELASTIC\n1e6, 0.3\n*SOLID SECTION, ELSET=BASE, MATERIAL=M\n"
        "*SOLID SECTION, ELSET=WEDGE, MATERIAL=M\n",
        pair("WEDGE-SOLE, BASE-SLOPE", mu),
        step("WEDGE-SIDE, 1, 1, 0.01").replace("*END", "*DSLOAD\nWEDGE-TOP, P, 1.\n*END"),
    ]
    text = deck(*cards, held="BASE-FLOOR, 1, 3\nWEDGE-FLANK, 2")
    return text.replace("*NODE", "*PARAMETER\nelement = C3D8\n*NODE", 1)


def wedge(runs):
    """CGS-4: the push beside the weight."""
    rows = []
    for mu, published in ((0.0, 0.1), (0.1, 0.20202), (0.2, 0.306122), (0.3, 0.412371)):
        with runs.of_text("cgs4", wedge_deck(mu)) as result:
            force = result.pairs[0].resultant[-1]
        push = -force[0] / force[2]
        rows.append([mu, published, f"{push:.6f}", f"{push / published - 1:+.0e}"])
    return f"""\
## Wedge on a slope: CGS-4 of NAFEMS

A wedge under a weight G is pushed up a slope of tan a = 1/10 at its side until all of it slides.
Source: F/G = (tan a + mu)/(1 - mu tan a).

{table(["mu", "published", "F/G", "error"], rows)}
"""


# --- Bodies that are half-spaces beside their contact ---------------------------------------------
# Blocks whose gaps are those of round ones; elements grow with the distance from the contact.


def as_c3d8i(text):
    """Return the deck with elements of that type."""
    return text.replace("*NODE", "*PARAMETER\nelement = C3D8I\n*NODE", 1)


CYLINDERS = {"radius": 8.0, "young": 200.0, "nu": 0.3, "mu": 0.2, "push": 10.0, "pull": 0.93616}


def cylinders_deck(n=40):
    """Return the deck of two cylinders alike, pressed together and then pulled along."""
    size, of = 15.0, CYLINDERS

    def place(t):
        return size * (0.05 * t + 0.95 * t**5)

    low, high = Mesh("LOW"), Mesh("HIGH", 20001)
    low.grid((n, 1, 14), lambda a, b, c: (place(2 * a - 1), b, -place(1 - c)), TOP="k+")
    high.grid((n, 1, 14), lambda a, b, c: (place(2 * a - 1), b, place(c)), SOLE="k-", CROWN="k+")
    sole = sorted(high.of_surface["SOLE"])
    gaps = "".join(f"{k}, {high.nodes[k - high.first][0]**2 / of['radius']!r}\n" for k in sole)
    presses = f"*CLOAD\n90001, 3, {-of['push']!r}\n*END"
    pulls = f"*CLOAD\n90001, 1, {of['pull']!r}\n*END"
    return as_c3d8i(deck(
        low.cards(FLOOR=lambda x, y, z: z < 1e-6 - size, ALL=lambda x, y, z: True),
        high.cards(BELOW=lambda x, y, z: z < size - 1e-6),
        f"*NODE, NSET=LEAD\n90001, 0., 0.5, {size!r}\n",
        MATERIAL.format(young=of["young"], nu=of["nu"]),
        "*COUPLING, REF NODE=90001, SURFACE=HIGH-CROWN\n*KINEMATIC\n",
        pair("HIGH-SOLE, LOW-TOP", of["mu"], ", SMALL SLIDING"), "*CONTACT GAP\n" + gaps,
        step("90001, 2, 2\n90001, 4, 6").replace("*END", presses),
        step("90001, 2, 2\n90001, 4, 6", 4).replace("*END", pulls),
        held="LOW-FLOOR, 1, 3\nLOW-ALL, 2\nHIGH-BELOW, 2",
    ))


def cylinders_values(result):
    """Return half widths of contact and of what sticks, peak pressure, and mu p0 c/b of the latter.

    Where a point sticks, |x| < c, the traction is less than mu p by mu p0 c/b sqrt(1 - x^2/c^2).
    """
    touching = result.pairs[0]
    b, p0 = fit_line_contact(touching)
    traction = touching.reaction[-1] / touching.area[:, None]
    spare = CYLINDERS["mu"] * traction[:, 0] - np.linalg.norm(traction[:, 1:], axis=1)
    used = spare > 0.2 * spare.max()
    slope, top = np.polyfit(mean_square(touching.coordinates[:, 0])[used], spare[used] ** 2, 1)
    return b, p0, math.sqrt(-top / slope), math.sqrt(top)


def cylinders(runs):
    """Cattaneo and Mindlin's problem of two cylinders alike."""
    rows = []
    for n in (40, 60):
        with runs.of_text("cattaneo", cylinders_deck(n)) as result:
            b, p0, c, _ = cylinders_values(result)
        rows.append([n, f"{b:.4f}", percent(b, 0.68078), f"{p0:.4f}", percent(p0, 9.3514),
                     f"{c:.4f}", percent(c, 0.49651)])
    heads = ["elements along x", "b", "error", "p0", "error", "c", "error"]
    return f"""\
## Two cylinders, pressed and pulled

Two cylinders alike, R = 8, E = 200, nu = 0.3, mu = 0.2, pressed together by P = 10 a length and
then pulled along by Q = 0.93616. Source: Hertz, Cattaneo, Mindlin: b = 0.68078, p0 = 9.3514, and
|x| < c = b sqrt(1 - Q/(mu P)) = 0.49651 sticks. Two blocks of 30 by 15 with the gap of the
cylinders; both widths are fitted, as above.

{table(heads, rows)}
"""


def spheres_deck(n=16):
    """Return the deck of two spheres alike, a quarter of each: blocks with their gap."""
    young, nu, radius, size = 20000.0, 0.3, 50.0, 60.0

    def place(t):
        return size * (0.2 * t + 0.8 * t**3)

    low, high = Mesh("LOW"), Mesh("HIGH", 50001)
    low.grid((n, n, 10), lambda a, b, c: (place(a), place(b), -place(1 - c)), TOP="k+")
    high.grid((n, n, 10), lambda a, b, c: (place(a), place(b), place(c)), SOLE="k-", CROWN="k+")
    planes = {"X": lambda x, y, z: x == 0, "Y": lambda x, y, z: y == 0}
    return as_c3d8i(deck(
        low.cards(FLOOR=lambda x, y, z: z < 1e-6 - size, **planes), high.cards(**planes),
        MATERIAL.format(young=young, nu=nu),
        pair("HIGH-SOLE, LOW-TOP", 0.0, ", SMALL SLIDING"),
        f"*CONTACT GAP, PARABOLA\nHIGH-SOLE, 0., 0., 0., {radius / 2!r}\n",
        step("LOW-FLOOR, 1, 3").replace(
            "*END", f"*DSLOAD\nHIGH-CROWN, P, {spheres_load() / 4 / size**2!r}\n*END"),
        held="LOW-FLOOR, 1, 3\nLOW-X, 1\nLOW-Y, 2\nHIGH-X, 1\nHIGH-Y, 2",
    ))


def spheres_load():
    """Return the force that Hertz says makes a contact of radius 10."""
    return 4 / 3 * 20000.0 / (2 * (1 - 0.3**2)) * 10.0**3 / 25.0


def spheres_values(result):
    """Return radius of contact and peak pressure, fitted."""
    touching = result.pairs[0]
    pressure = touching.reaction[-1][:, 0] / touching.area
    used = pressure > 0.3 * pressure.max()
    square = mean_square(touching.coordinates[:, 0]) + mean_square(touching.coordinates[:, 1])
    slope, top = np.polyfit(square[used], pressure[used] ** 2, 1)
    return math.sqrt(-top / slope), math.sqrt(top)


def spheres(runs):
    """SSNV104: two spheres alike."""
    rows = []
    for n in (12, 16, 20):
        with runs.of_text("ssnv104", spheres_deck(n)) as result:
            a, p0 = spheres_values(result)
        rows.append([n, f"{a:.4f}", percent(a, 10.0), f"{p0:.1f}", percent(p0, 2798.3)])
    return f"""\
## Two spheres: SSNV104 of Code_Aster

Two spheres alike, R = 50, E = 20000, nu = 0.3. Source: Hertz: a = 10, p0 = 2798.3. Two blocks of 60
with the gap of the spheres, under the force of that contact ({spheres_load():.0f}).

{table(["elements along x and y", "a", "error", "p0", "error"], rows)}
"""
