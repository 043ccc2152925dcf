"""Meshes of hexahedra as cards, for the decks of cases."""

import numpy as np


def grid(nodes, cells, shape):
    """Cards of a mesh of hexahedra: nodes of the unit cube, moved by `shape`."""
    n = np.array(cells) + 1
    index = np.arange(n.prod()).reshape(n) + 1
    lines = [f"*NODE, NSET={nodes}"]
    places = {}
    for (i, j, k), number in np.ndenumerate(index):
        places[number] = shape(np.array([i, j, k]) / (n - 1))
        lines.append("{}, {!r}, {!r}, {!r}".format(number, *map(float, places[number])))
    below = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corner = [(*at, level) for level in (0, 1) for at in below]
    lines.append("*ELEMENT, TYPE=<element>, ELSET=B")
    for number, (i, j, k) in enumerate(np.ndindex(*cells), 1):
        at = [str(index[i + a, j + b, k + c]) for a, b, c in corner]
        lines.append(", ".join([str(number), *at]))
    return "\n".join(lines) + "\n", index, places
