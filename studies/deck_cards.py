"""Cards of decks of blocks and rings, which cases and studies of several bodies share."""

import math

BLOCK = """*BLOCK, NAME={name}, NX={n[0]}, NY={n[1]}, NZ={n[2]}
{low[0]}, {low[1]}, {low[2]},  {size[0]}, {size[1]}, {size[2]}
*MATERIAL, NAME=OF-{name}
*ELASTIC
{young!r}, {nu!r}
*SOLID SECTION, ELSET={name}, MATERIAL=OF-{name}
"""


def block(name, n, low, size, young=1000.0, nu=0.3):
    """Return the cards of a block of `n` elements (along each axis, or one number for all)."""
    counts = (n, n, n) if isinstance(n, int) else n
    return BLOCK.format(name=name, n=counts, low=low, size=size, young=young, nu=nu)


def pair(surfaces, mu=0.0, options="", number=1):
    """Return the cards of a contact pair, "SLAVE, MASTER"."""
    return (
        f"*SURFACE INTERACTION, NAME=I{number}\n*FRICTION\n{mu!r}\n"
        f"*CONTACT PAIR, INTERACTION=I{number}{options}\n{surfaces}\n"
    )


def step(lines, increments=1, options=", DIRECT"):
    """Return a *STEP that prescribes `lines`."""
    return f"*STEP\n*STATIC{options}\n{1 / increments!r}, 1.\n*BOUNDARY\n{lines}\n*END STEP\n"


def deck(*cards, held="", tolerance=1e-10):
    """Return a deck of blocks and pairs, its first supports, and steps."""
    model = "".join(card for card in cards if not card.startswith("*STEP"))
    steps = "".join(card for card in cards if card.startswith("*STEP"))
    boundary = f"*BOUNDARY\n{held}\n" if held else ""
    return (
        "*HEADING\nBodies that touch each other\n"
        f"{model}*CONTACT SOLVER, TOLERANCE={tolerance!r}\n{boundary}{steps}"
    )


def quarter_ring(name, first, radii, divisions, height=0.1):
    """Return the cards of a quarter of a ring of C3D8, `divisions` across and around, one high.

    Node and element numbers begin at `first`. Its surfaces are NAME-IN and NAME-OUT; its sets of
    nodes NAME-ALL, and NAME-X and NAME-Y on the planes x = 0 and y = 0.
    """
    across, around = divisions
    number, nodes = {}, []
    for k in range(2):
        for j in range(around + 1):
            for i in range(across + 1):
                radius = radii[0] + (radii[1] - radii[0]) * i / across
                angle = 0.5 * math.pi * j / around
                x = radius * math.cos(angle) if j < around else 0.0
                y = radius * math.sin(angle) if j > 0 else 0.0
                number[i, j, k] = first + len(nodes)
                nodes.append(f"{number[i, j, k]}, {x!r}, {y!r}, {k * height!r}")
    elements = []
    for j in range(around):
        for i in range(across):
            corners = [
                number[i + a, j + b, k] for k in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))
            ]
            elements.append(", ".join(map(str, [first + len(elements), *corners])))
    sets = {
        "X": [n for (i, j, k), n in number.items() if j == around],
        "Y": [n for (i, j, k), n in number.items() if j == 0],
        "ALL": list(number.values()),
    }
    inside = [str(first + j * across) for j in range(around)]
    outside = [str(first + (j + 1) * across - 1) for j in range(around)]
    lines = ["*NODE", *nodes, f"*ELEMENT, TYPE=C3D8, ELSET={name}", *elements]
    for key, members in sets.items():
        lines += [f"*NSET, NSET={name}-{key}", *map(str, members)]
    lines += [f"*ELSET, ELSET={name}-EI", *inside, f"*ELSET, ELSET={name}-EO", *outside]
    lines += [f"*SURFACE, NAME={name}-IN, TYPE=ELEMENT", f"{name}-EI, S6"]
    lines += [f"*SURFACE, NAME={name}-OUT, TYPE=ELEMENT", f"{name}-EO, S4"]
    return "\n".join(lines) + "\n"
