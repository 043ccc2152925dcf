"""Meshes of rigid facets, as cards and as STL files, which the cases of rigid surfaces share."""

import struct

import numpy as np


def plate(low, high, n=(1, 1), split=False, height=lambda x, y: 0.0 * x):
    """Return corners (n, 3) and facets of a plate whose normal points along z.

    `n` quadrilaterals along x and y, or with `split` twice as many triangles; z is `height`.
    """
    x, y = (np.linspace(low[a], high[a], n[a] + 1) for a in (0, 1))
    xs, ys = np.meshgrid(x, y)
    corners = np.column_stack([xs.ravel(), ys.ravel(), height(xs, ys).ravel()])
    across = n[0] + 1
    facets = []
    for j in range(n[1]):
        for i in range(n[0]):
            a = i + across * j
            quad = (a, a + 1, a + 1 + across, a + across)
            halves = [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
            facets += halves if split else [quad]
    return corners, facets


def rigid(name, corners, facets, ref, first=1001, types=("R3D3", "R3D4"), side="SPOS"):
    """Return the cards of a rigid body and its surface `name`.

    Node and element numbers begin at `first`; `ref` is the reference node: its number and place.
    """
    number, place = ref
    cards = f"*NODE\n{number}, {place[0]!r}, {place[1]!r}, {place[2]!r}\n"
    cards += "".join(
        f"{first + i}, {float(x)!r}, {float(y)!r}, {float(z)!r}\n"
        for i, (x, y, z) in enumerate(corners)
    )
    for type_, size in zip(types, (3, 4), strict=True):
        chosen = [(i, f) for i, f in enumerate(facets) if len(f) == size]
        if not chosen:
            continue
        cards += f"*ELEMENT, TYPE={type_}, ELSET={name}-FACETS\n"
        cards += "".join(
            f"{first + i}, " + ", ".join(str(first + c) for c in f) + "\n" for i, f in chosen
        )
    return cards + (
        f"*RIGID BODY, ELSET={name}-FACETS, REF NODE={number}\n"
        f"*SURFACE, NAME={name}\n{name}-FACETS, {side}\n"
    )


def binary_stl(corners, facets):
    """Return the bytes of a binary STL file of triangles."""
    parts = [b"bipot".ljust(80), struct.pack("<I", len(facets))]
    for f in facets:
        x = [corners[c] for c in f]
        normal = np.cross(x[1] - x[0], x[2] - x[0])
        parts.append(struct.pack("<12fH", *normal, *np.concatenate(x), 0))
    return b"".join(parts)


def text_stl(corners, facets):
    """Return the text of an STL file of triangles."""
    lines = ["solid tool"]
    for f in facets:
        x = [corners[c] for c in f]
        normal = np.cross(x[1] - x[0], x[2] - x[0])
        lines.append("facet normal " + " ".join(f"{v:.6e}" for v in normal))
        lines.append("outer loop")
        lines += ["  vertex " + " ".join(repr(float(v)) for v in c) for c in x]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid tool"]) + "\n"
