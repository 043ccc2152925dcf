"""Write the meshes of input/meshes: what *BLOCK cannot make, of elements mapped from grids."""

import argparse
import math
from pathlib import Path

from bipot.program import ROOT

FOLDER = ROOT / "input" / "meshes"

# The corners of an element of a grid, and those of its sides as *SURFACE numbers them.
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
SIDES = {"k-": "S1", "k+": "S2", "j-": "S3", "i+": "S4", "j+": "S5", "i-": "S6"}


class Mesh:
    """Elements on grids that are joined where their nodes coincide; one body, one set of cards."""

    def __init__(self, name, first=1, close=1e-7):
        """Number nodes and elements from `first`; nodes nearer than `close` are one."""
        self.name, self.first, self.close = name, first, close
        self.nodes, self.elements = [], []
        self.number = {}
        self.surfaces = {}    # elements and sides
        self.of_surface = {}  # nodes

    def node(self, x):
        """Return the number of the node at x, a new one or one that is there."""
        x = [0.0 if abs(value) < self.close else value for value in x]
        key = tuple(round(value / self.close) for value in x)
        if key not in self.number:
            self.number[key] = self.first + len(self.nodes)
            self.nodes.append(x)
        return self.number[key]

    def grid(self, counts, place, **surfaces):
        """Add a grid of elements: `place(a, b, c)` with a, b and c from 0 to 1 is a point of it.

        A surface is named with its side of the grid, TOP="k+"; its nodes are a set of that name.
        """
        steps = [[i / n for i in range(n + 1)] for n in counts]
        at = {
            (i, j, k): self.node(place(a, b, c))
            for i, a in enumerate(steps[0])
            for j, b in enumerate(steps[1])
            for k, c in enumerate(steps[2])
        }
        for i in range(counts[0]):
            for j in range(counts[1]):
                for k in range(counts[2]):
                    self.elements.append([at[i + a, j + b, k + c] for a, b, c in CORNERS])
                    element = self.first + len(self.elements) - 1
                    for name, side in surfaces.items():
                        here = (i, j, k)["ijk".index(side[0])]
                        last = counts["ijk".index(side[0])] - 1
                        if here == (last if side[1] == "+" else 0):
                            self.surfaces.setdefault(name, []).append((element, SIDES[side]))
                            self.of_surface.setdefault(name, set()).update(
                                at[i + a, j + b, k + c]
                                for a, b, c in CORNERS
                                if (a, b, c)["ijk".index(side[0])] == (side[1] == "+")
                            )

    def select(self, condition):
        """Return the numbers of the nodes for which condition(x, y, z) holds."""
        return [self.first + i for i, x in enumerate(self.nodes) if condition(*x)]

    def cards(self, **sets):
        """Return the mesh as cards of a deck; a set of nodes is named with its condition.

        The type of its elements is the deck's parameter `element`.
        """
        lines = ["*NODE"]
        lines += [
            f"{self.first + i}, " + ", ".join(f"{value:.12g}" for value in x)
            for i, x in enumerate(self.nodes)
        ]
        lines.append(f"*ELEMENT, TYPE=<element>, ELSET={self.name}")
        lines += [
            ", ".join(map(str, [self.first + i, *nodes])) for i, nodes in enumerate(self.elements)
        ]
        for name, condition in sets.items():
            lines.append(f"*NSET, NSET={self.name}-{name}")
            lines += in_lines(self.select(condition))
        for name, faces in self.surfaces.items():
            lines.append(f"*SURFACE, NAME={self.name}-{name}, TYPE=ELEMENT")
            lines += [f"{element}, {side}" for element, side in faces]
            lines.append(f"*NSET, NSET={self.name}-{name}")
            lines += in_lines(sorted(self.of_surface[name]))
        return "\n".join(lines) + "\n"


def in_lines(numbers, most=16):
    """Return numbers as data lines of a few each."""
    return [", ".join(map(str, numbers[i : i + most])) for i in range(0, len(numbers), most)]


def graded(s, ratio):
    """Return where `s` from 0 to 1 goes if the last of many steps is `ratio` times the first."""
    return s if ratio == 1 else (ratio**s - 1) / (ratio - 1)


def between(p, q, s):
    """Return the point at s from 0 to 1 between two points."""
    return [a + (b - a) * s for a, b in zip(p, q, strict=True)]


# ------------------------------------------------------------------------------------------ meshes


def quarter_disc(mesh, radius, counts, into, gradings=(1.0, 1.0), **surfaces):
    """Add a quarter of a disc: a core with four corners, and two grids between it and the arc.

    `counts`: elements along the arc from the first axis to its middle and from there to the second,
    from the core to the arc, and through the disc. `into(p, q, c)` is the point of the disc at
    (p, q), p and q from 0 to `radius`, c from 0 to 1. `gradings`: the last step over the first, on
    the arc from the first axis to its middle, and from the arc to the core. Surfaces: ARC=... is
    the outside, others are sides of grids (k- and k+ are the faces of the disc).
    """
    first, second, across, through = counts
    core, corner = 0.5 * radius, 0.4 * radius
    arc = {name: side for name, side in surfaces.items() if side == "arc"}
    faces = {name: side for name, side in surfaces.items() if side != "arc"}

    def on_side(s):
        """Return a point of the core's side across the first axis."""
        return between((core, 0.0), (corner, corner), s)

    def on_arc(s):
        angle = math.pi / 4 * s
        return radius * math.cos(angle), radius * math.sin(angle)

    def inside(a, b, c):
        """Return a point of the core: b along the first axis, a along the second."""
        a = graded(a, gradings[0])
        return into(b * (core + (corner - core) * a), a * (core + (corner - core) * b), c)

    def beside(a, b, c):
        s, t = graded(a, gradings[0]), 1 - graded(1 - b, gradings[1])
        p, q = between(on_side(s), on_arc(s), t)
        return into(p, q, c)

    def above(a, b, c):
        t = 1 - graded(1 - b, gradings[1])
        q, p = between(on_side(a), on_arc(a), t)
        return into(p, q, c)

    mesh.grid((second, first, through), lambda b, a, c: inside(a, b, c), **faces)
    outside = dict.fromkeys(arc, "i+")
    mesh.grid((across, first, through), lambda b, a, c: beside(a, b, c), **faces, **outside)
    outside = dict.fromkeys(arc, "j+")
    mesh.grid((second, across, through), above, **faces, **outside)


def quarter_ring(mesh, inner, outer, counts, into, radial, **surfaces):
    """Add a quarter of a ring: elements across it, along its arc and through it.

    `radial` maps 0 to 1 on itself, from the inside to the outside; `into` is that of quarter_disc.
    """

    def place(a, b, c):
        radius, angle = inner + (outer - inner) * radial(a), math.pi / 2 * b
        return into(radius * math.cos(angle), radius * math.sin(angle), c)

    mesh.grid(counts, place, **surfaces)


def rings(n=4):
    """Two quarter rings with the radii 10, 20 and 30, 1 high; n + 1 and n elements across."""
    inner, outer = Mesh("HUB", 1), Mesh("RING", 100001)
    for mesh, radius, counts in ((inner, 10.0, (n + 1, 5 * n, 1)), (outer, 20.0, (n, 6 * n, 1))):
        quarter_ring(mesh, radius, radius + 10, counts, lambda p, q, c: (p, q, c), lambda t: t,
                     IN="i-", OUT="i+")
    sets = {"X0": lambda x, y, z: x == 0, "Y0": lambda x, y, z: y == 0,
            "Z0": lambda x, y, z: z == 0}
    return inner.cards(**sets) + outer.cards(**sets)


def cylinder(n=4):
    """Half of a cylinder of radius 50 on half of a block of 200 by 200, one element thick."""
    round_one = Mesh("CYLINDER", 1)
    counts = (3 * n, n, 2 * n, 1)

    def lower(p, q, c):
        return q, 1 - c, 50 - p

    def upper(p, q, c):
        return q, c, 50 + p

    quarter_disc(round_one, 50.0, counts, lower, (8.0, 8.0), ROUND="arc")
    quarter_disc(round_one, 50.0, counts, upper, (8.0, 8.0))
    block = Mesh("BLOCK", 100001)
    ratio = 60.0

    def place(a, b, c):
        return 100 * graded(a, ratio), b, -200 * graded(1 - c, ratio)

    block.grid((5 * n, 1, 5 * n), place, TOP="k+")
    top = round_one.cards(X0=lambda x, y, z: x == 0, Y=lambda x, y, z: True,
                         POINT=lambda x, y, z: x == 0 and z == 100)
    return top + block.cards(X0=lambda x, y, z: x == 0, Y=lambda x, y, z: True,
                             BOTTOM=lambda x, y, z: z == -200)


def punch(n=3):
    """A quarter of a punch with a fillet on a quarter of a base, both round."""
    flat, fillet, height = 40.0, 10.0, 100.0
    counts = (n, n, 2 * n, 3 * n)

    def sole(p, q):
        beyond = min(fillet, max(0.0, math.hypot(p, q) - flat))
        return fillet - math.sqrt(fillet**2 - beyond**2)

    def in_punch(p, q, c):
        low = sole(p, q)
        return p, q, low + (height - low) * graded(c, 12.0)

    def in_base(p, q, c):
        return p, q, -200 * graded(1 - c, 24.0)

    tool = Mesh("PUNCH", 1)
    quarter_disc(tool, flat, counts, in_punch, (1.0, 4.0), SOLE="k-", TOP="k+")
    # Even steps of the fillet's angle.
    quarter_ring(tool, flat, flat + fillet, (n, 2 * n, 3 * n), in_punch,
                 lambda t: math.sin(math.pi / 2 * t), SOLE="k-", TOP="k+")
    base = Mesh("BASE", 100001)
    quarter_disc(base, flat, counts, in_base, (1.0, 4.0), TOP="k+")
    quarter_ring(base, flat, 100.0, (3 * n, 2 * n, 3 * n), in_base,
                 lambda t: graded(t, 12.0), TOP="k+")
    sets = {"X0": lambda x, y, z: x == 0, "Y0": lambda x, y, z: y == 0}
    return tool.cards(**sets) + base.cards(
        **sets, BOTTOM=lambda x, y, z: z == -200, M=lambda x, y, z: x == 0 and y == 0 and z == 0
    )


MESHES = {"rings": rings, "cylinder": cylinder, "punch": punch}


def mesh_file(name, *sizes):
    """Return the text of input/meshes/NAME.inp, of its usual size or another one."""
    return f"** Written by `studies/run meshes`\n{MESHES[name](*sizes)}"


def main():
    """Write the meshes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "-o", dest="folder", type=Path, default=FOLDER, help="instead of %(default)s"
    )
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name in MESHES:
        (folder / f"{name}.inp").write_text(mesh_file(name), encoding="utf-8")


if __name__ == "__main__":
    main()
