"""Decks of blocks on blocks, which the cases of contact between bodies share."""

BLOCK = """*BLOCK, NAME={name}, NX={n[0]}, NY={n[1]}, NZ={n[2]}
{low[0]}, {low[1]}, {low[2]},  {size[0]}, {size[1]}, {size[2]}
*MATERIAL, NAME=OF-{name}
*ELASTIC
{young!r}, {nu!r}
*SOLID SECTION, ELSET={name}, MATERIAL=OF-{name}
"""


def block(name, n, low, size, young=1000.0, nu=0.3):
    """Return the cards of a block of `n` bricks (along each axis, or one number for all)."""
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
