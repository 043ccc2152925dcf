"""Scenes whose meshes do not match, of known truth, for studies/effectivity.py.

Eight of each kind. The truth of rings is Lame's; else it is that of a finer mesh whose faces match,
of punches the limit of two whose lines follow the edges of contact: stresses are infinite there,
and a mesh of 80 elements is 1 % off.
"""

from dataclasses import dataclass, field

import numpy as np

CONTACT = """*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I
{slave}, {master}
"""

# A stiff punch, 0.4 wide, on a soft layer, 1 wide, in plane strain; pressed and pushed.
PUNCH = """*BLOCK, NAME=LOW, NX={nx}, NY=1, NZ={nz}
0., 0., 0., 1., 0.1, 0.5
*BLOCK, NAME=UP, NX={ux}, NY=1, NZ={uz}
0.3, 0., 0.5, 0.4, 0.1, 0.2
*MATERIAL, NAME=SOFT
*ELASTIC
100., 0.3
*MATERIAL, NAME=STIFF
*ELASTIC
10000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=SOFT
*SOLID SECTION, ELSET=UP, MATERIAL=STIFF
{contact}*BOUNDARY
LOW, 2, 2
UP, 2, 2
LOW-ZMIN, 1, 3
*STEP
*STATIC
0.25, 1.
*BOUNDARY
UP-ZMAX, 1, 1, {push}
UP-ZMAX, 3, 3, -0.01
*END STEP
"""

# Two leaves, one above the other, bent at the tip of the upper one.
LEAVES = """*BLOCK, NAME=LOW, NX={lower}, NY=2, NZ=2, TYPE=C3D8I
0., 0., 0., 10., 1., 0.25
*BLOCK, NAME=UP, NX={upper}, NY=2, NZ=2, TYPE=C3D8I
0., 0., 0.25, 10., 1., 0.25
*MATERIAL, NAME=M
*ELASTIC
100000., 0.
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
{contact}*BOUNDARY
LOW-XMIN, 1, 3
UP-XMIN, 1, 3
*STEP
*STATIC
0.5, 1.
*BOUNDARY
UP-XMAX, 3, 3, -0.5
*END STEP
"""

# A cantilever that is bent over a cylinder.
BEAM = """*BLOCK, NAME=B, TYPE=C3D8I, NX={nx}, NY={ny}, NZ={nz}
0., 0., 0., 10., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=C, TYPE=CYLINDER
{x}, 0., {z}, 0., 1., 0., {radius}
{contact}*STEP
*STATIC
0.25, 1.
*BOUNDARY
B-XMIN, 1, 3
B-XMAX, 3, 3, -1.
*END STEP
"""

RINGS = """*NODE
{nodes}
*ELEMENT, TYPE=CPE4, ELSET=INNER
{inner}
*ELEMENT, TYPE=CPE4, ELSET=OUTER
{outer}
*NSET, NSET=ALONGX
{alongx}
*NSET, NSET=ALONGY
{alongy}
*ELSET, ELSET=PRESSED
{pressed}
*ELSET, ELSET=BORE
{bore}
*SURFACE, NAME=SHAFT
PRESSED, S2
*SURFACE, NAME=HOLE
BORE, S4
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=INNER, MATERIAL=M
*SOLID SECTION, ELSET=OUTER, MATERIAL=M
{contact}*BOUNDARY
ALONGX, 2, 2
ALONGY, 1, 1
*STEP
*STATIC
1., 1.
*END STEP
"""
RADII = (0.5, 1.0, 1.5)
INTERFERENCE = 0.01
LAYERS = 4


@dataclass
class Scene:
    """A deck of a kind, and where its truth comes from: another deck, two by the elements that they
    have along, or a force."""

    kind: str
    name: str
    deck: str
    fine: dict = field(default_factory=dict)
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))


def contact(slave, master, mu=0.0):
    """Return the cards of a pair."""
    return CONTACT.format(slave=slave, master=master, mu=mu)


def punch(n, mu, swapped, fine=False):
    """Return a punch on n elements, or, `fine`, on n whose lines follow its edges."""
    sides = ("UP-ZMIN", "LOW-ZMAX") if swapped else ("LOW-ZMAX", "UP-ZMIN")
    sizes = {"nx": n, "nz": n // 2, "ux": 2 * n // 5, "uz": n // 10} if fine else {
        "nx": n, "nz": max(2, round(n / 2)), "ux": 4, "uz": 2}
    return PUNCH.format(**sizes, push=0.004 if mu else 0.0, contact=contact(*sides, mu))


def beam(x, radius, nx, layers):
    """Return a cantilever over a cylinder 0.1 beneath it."""
    return BEAM.format(nx=nx, ny=min(2, layers), nz=layers, x=x, z=-0.1 - radius, radius=radius,
                       contact=contact("B-ZMIN", "C", 0.3))


def ring(start, first, inside, outside, n):
    """Return node lines and element lines of a quarter of a ring, and its node numbers."""
    angles = np.linspace(0, np.pi / 2, n + 1)
    radii = np.linspace(inside, outside, LAYERS + 1)
    number = start + np.arange((n + 1) * (LAYERS + 1)).reshape(n + 1, LAYERS + 1)
    nodes = [f"{number[i, k]}, {r * np.cos(a):.15g}, {r * np.sin(a):.15g}"
             for i, a in enumerate(angles) for k, r in enumerate(radii)]
    elements = [
        f"{first + i * LAYERS + k}, {number[i, k]}, {number[i, k + 1]}, {number[i + 1, k + 1]}, "
        f"{number[i + 1, k]}" for i in range(n) for k in range(LAYERS)]
    return nodes, elements, number


def lines(numbers):
    """Return numbers as the lines of a set."""
    return "\n".join(map(str, numbers))


def rings(inner, outer):
    """Return a ring that is pressed into another one, with so many elements a quarter."""
    a, b, c = RADII
    nodes, elements, one = ring(1, 1, a, b + INTERFERENCE, inner)
    more, others, two = ring(one.max() + 1, inner * LAYERS + 1, b, c, outer)
    return RINGS.format(
        nodes="\n".join(nodes + more), inner="\n".join(elements), outer="\n".join(others),
        alongx=lines([*one[0], *two[0]]), alongy=lines([*one[-1], *two[-1]]),
        pressed=lines(np.arange(1, inner + 1) * LAYERS),
        bore=lines(inner * LAYERS + 1 + np.arange(outer) * LAYERS),
        contact=contact("SHAFT", "HOLE"))


def force_of_rings():
    """Return what a quarter of the shaft feels, by Lame's solution in plane strain."""
    a, b, c = RADII
    young, poisson = 1000.0, 0.3
    soft = 1 - 2 * poisson
    flexible = (1 + poisson) / young * b * (
        (c**2 + soft * b**2) / (c**2 - b**2) + (soft * b**2 + a**2) / (b**2 - a**2))
    pressure = INTERFERENCE / flexible
    return np.array([-pressure * b, -pressure * b, 0.0])


BEAMS = ((6.1, 0.5), (5.05, 0.2), (6.0, 0.5), (3.71, 3.0), (4.35, 1.0), (6.6, 0.5), (5.3, 2.0),
         (7.05, 0.5))


def scenes():
    """Return all scenes, eight of each kind."""
    found = []
    for kind, swapped in (("edges of the master in faces of the slave", False),
                          ("edges of the slave in faces of the master", True)):
        found += [Scene(kind, f"{n} elements, mu = {mu}", punch(n, mu, swapped),
                        {of: punch(of, mu, swapped, fine=True) for of in (80, 160)})
                  for mu in (0.0, 0.3) for n in (7, 11, 17, 23)]
    found += [Scene("facets for arcs", f"{inner} and {outer} a quarter", rings(inner, outer),
                    force=force_of_rings())
              for inner, outer in ((6, 5), (10, 12), (12, 10), (8, 8), (12, 24), (7, 6), (9, 8),
                                   (16, 13))]
    leaf = {"contact": contact("UP-ZMIN", "LOW-ZMAX")}
    found += [Scene("leaves that bend", f"{lower} and {upper} along", LEAVES.format(
        lower=lower, upper=upper, **leaf), {60: LEAVES.format(lower=60, upper=60, **leaf)})
        for lower, upper in ((20, 14), (20, 18), (23, 20), (21, 19), (17, 15), (17, 12), (24, 20),
                             (20, 20))]
    for kind, layers, along in (("beams over cylinders, two layers", 2, (20, 30)),
                                ("beams over cylinders, one layer", 1, (10, 20))):
        found += [Scene(kind, f"x = {x}, R = {radius}, {nx} along", beam(x, radius, nx, layers),
                        {120: beam(x, radius, 120, 6)})
                  for (x, radius), nx in zip(BEAMS, 4 * along, strict=True)]
    return found
