"""Decks of contact whose surfaces cannot move apart everywhere: clamps, glue, cracks."""

import numpy as np


def top_faces(first, n, side):
    """Return data lines of the faces of strips n[0] x n[1] x 2 left and right of x = 2.

    `side` is "S2", the upper faces of the upper layer, or "S1", the lower ones of the lower.
    """
    layer = first + (n[0] * n[1] if side == "S2" else 0)
    left, right = [], []
    for j in range(n[1]):
        for i in range(n[0]):
            part = left if (i + 0.5) * 4 / n[0] < 2 else right
            part.append(f"{layer + j * n[0] + i}, {side}\n")
    return "".join(left), "".join(right)


def strips(low, up, mu=0.3, small="NO", height=1.0):
    """Two strips, each `n` x `n` x 2 elements, the upper from `height` on; pair UCS:LCS at right.

    Sets LGS and UGS are their left halves.
    """
    low_left, low_right = top_faces(1, low, "S2")
    up_left, up_right = top_faces(1 + 2 * low[0] * low[1], up, "S1")
    return f"""*HEADING
Two strips
*BLOCK, NAME=LOW, NX={low[0]}, NY={low[1]}, NZ=2
0., 0., 0., 4., 1., 1.
*BLOCK, NAME=UP, NX={up[0]}, NY={up[1]}, NZ=2
0., 0., {height}, 4., 1., 1.
*SURFACE, NAME=LGS
{low_left}*SURFACE, NAME=LCS
{low_right}*SURFACE, NAME=UGS
{up_left}*SURFACE, NAME=UCS
{up_right}*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I, SMALL SLIDING={small}
"""


PRESS = """*STEP
*STATIC
1., 1.
*DSLOAD
UP-ZMAX, P, 1.
*END STEP
"""


def glued(low=(8, 1), up=(8, 1), pair="UCS, LCS", glue="*TIE\nUGS, LGS\n", **options):
    """The strips glued on the left, in contact on the right, pressed, then sheared."""
    force = 0.36 / ((up[0] + 1) * (up[1] + 1))
    return (
        strips(low, up, **options)
        + f"{pair}\n{glue}*BOUNDARY\nLOW-ZMIN, 1, 3\n{PRESS}"
        + f"*STEP\n*STATIC\n0.25, 1.\n*CLOAD\nUP-ZMAX, 1, {force!r}\n*END STEP\n"
    )


def clamped(low=(4, 2), up=(4, 2), held="LOW-XMIN, 1, 3\nUP-XMIN, 1, 3", pushed="", **options):
    """The strips on each other, both `held` at the same end, pressed by 1 per area."""
    step = PRESS.replace("1., 1.", "0.5, 1.", 1).replace("*DSLOAD", f"{pushed}*DSLOAD")
    return (
        strips(low, up, **options)
        + f"UP-ZMIN, LOW-ZMAX\n*BOUNDARY\nLOW-ZMIN, 3, 3\n{held}\n"
        + step
    )


def equations(nodes):
    """Return equations that join pairs of nodes along all axes."""
    return "".join(
        f"*EQUATION\n2\n{a}, {dof}, 1., {b}, {dof}, -1.\n" for a, b in nodes for dof in (1, 2, 3)
    )


YOUNG, POISSON = 25000.8, 0.25004
MU = float(np.tan(np.pi / 6))


class Crack:
    """A crack of half length 1 along x in a plate of half width 20, `n` elements along it, meshed.

    Lips are surfaces UPPER and LOWER; the tips' nodes belong to both. Stress far away is a
    pressure of 100 at `angle` to the crack, as displacements of the plate's edge; plane strain.
    `turn` turns all of it, `length` multiplies it.
    """

    def __init__(self, n=20, angle=20.0, turn=0.0, length=1.0):
        self.turn, self.length = turn, length
        self.rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        beyond = [0.0]
        while beyond[-1] < 20.0:
            beyond.append(beyond[-1] + 2.0 / n * 1.4 ** (len(beyond) - 1))
        beyond = np.array(beyond)
        self.x = np.concatenate([-1.0 - beyond[::-1], np.linspace(-1, 1, n + 1)[1:-1], 1 + beyond])
        self.y = beyond
        self.number, self.nodes, self.elements = {}, [], []
        self.lips = {1: [], -1: []}
        for side in (1, -1):
            self.fill(side, 2.0 / n)
        edge = np.radians(angle)
        along = np.array([np.cos(edge), np.sin(edge)])
        stress = -100.0 * np.outer(along, along)
        self.strain = (1 + POISSON) / YOUNG * (stress - POISSON * np.trace(stress) * np.eye(2))

    def fill(self, side, height):
        """Mesh the plate above the crack, or below it."""
        for j in range(len(self.y) - 1):
            for i in range(len(self.x) - 1):
                low, high = (j, j + 1) if side > 0 else (j + 1, j)
                corners = [(i, low), (i + 1, low), (i + 1, high), (i, high)]
                self.elements.append(
                    [self.node(*c, k, side, height) for k in (0, 1) for c in corners]
                )
                if j == 0 and max(abs(self.x[i]), abs(self.x[i + 1])) < 1 + 1e-9:
                    self.lips[side].append(len(self.elements))

    def node(self, i, j, k, side, height):
        """Return the number of a node, which both sides share but on the crack."""
        on_crack = j == 0 and abs(self.x[i]) < 1 - 1e-9
        key = (i, j, k, side if on_crack or j > 0 else 0)
        if key not in self.number:
            self.number[key] = len(self.number) + 1
            self.nodes.append((self.x[i], side * self.y[j], k * height))
        return self.number[key]

    def turned(self, place):
        """Turn and enlarge a vector of the plane."""
        return self.length * self.rotation @ np.asarray(place)

    def deck(self, mu=MU, small="YES", pair="UPPER, LOWER"):
        """Return the deck."""
        lines = ["*HEADING", "A closed crack", "*NODE, NSET=ALL"]
        boundary = []
        for number, (x, y, z) in enumerate(self.nodes, 1):
            place = [*self.turned((x, y)), self.length * z]
            lines.append(f"{number}, " + ", ".join(f"{float(c)!r}" for c in place))
            if abs(x) > self.x[-1] - 1e-9 or abs(y) > self.y[-1] - 1e-9:
                moved = self.turned(self.strain @ [x, y])
                boundary += [f"{number}, {a + 1}, {a + 1}, {float(moved[a])!r}" for a in (0, 1)]
        lines.append("*ELEMENT, TYPE=C3D8I, ELSET=E")
        lines += [f"{e}, " + ", ".join(map(str, c)) for e, c in enumerate(self.elements, 1)]
        lines += ["*SURFACE, NAME=UPPER", *(f"{e}, S3" for e in self.lips[1])]
        lines += ["*SURFACE, NAME=LOWER", *(f"{e}, S5" for e in self.lips[-1])]
        lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, {POISSON}"]
        lines += ["*SOLID SECTION, ELSET=E, MATERIAL=M", "*SURFACE INTERACTION, NAME=I"]
        lines += [
            "*FRICTION",
            repr(float(mu)),
            f"*CONTACT PAIR, INTERACTION=I, SMALL SLIDING={small}",
        ]
        lines += [pair, "*BOUNDARY", "ALL, 3, 3", "*STEP", "*STATIC", "1., 1.", "*BOUNDARY"]
        return "\n".join([*lines, *boundary, "*END STEP", ""])
