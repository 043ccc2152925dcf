"""The force between two blocks whose faces do not match, by a program of its own.

Elastic, without friction, with conditions at points of the overlaps of two faces.

A unit cube, `upper` elements along each edge, on a block of 2 by 1.5 by 1 with `lower` elements
along 1.5 and 1, E = 1, nu = 0.3, small strain. No point of the overlaps of two faces may penetrate:
one, four or nine Gauss points each. The forces of the points solve a quadratic program.
"""

import argparse
import itertools

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

YOUNG, POISSON, DEPTH = 1.0, 0.3, 0.002
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                    (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
LOW = 0.25  # of the cube, along x and y


def box_stiffness(size):
    """Return the stiffness of a box of these edges with 2 x 2 x 2 points: 24 x 24."""
    shear = YOUNG / (2 * (1 + POISSON))
    first = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    sides, k = 2 * CORNERS - 1, np.zeros((8, 3, 8, 3))
    for point in sides / np.sqrt(3):
        part = 1 + sides * point
        g = np.array([sides[:, i] * part[:, i - 1] * part[:, i - 2] / 8 for i in range(3)]).T
        g *= 2 / np.array(size)
        k += first * np.einsum("ai,bj->aibj", g, g) + shear * np.einsum("aj,bi->aibj", g, g)
        k += shear * np.einsum("ak,bk,ij->aibj", g, g, np.eye(3))
    return k.reshape(24, 24) * np.prod(size) / 8


def block(low, size, n):
    """Return the nodes of a block and its stiffness."""
    axes = [a + s * np.arange(m + 1) / m for a, s, m in zip(low, size, n, strict=True)]
    x = np.array(list(itertools.product(*axes)))
    number = np.arange(len(x)).reshape(np.array(n) + 1)
    k = sparse.lil_matrix((3 * len(x), 3 * len(x)))
    of_one = box_stiffness(np.array(size) / n)
    for at in np.ndindex(*n):
        rows = (3 * number[tuple((CORNERS + at).T)][:, None] + np.arange(3)).ravel()
        k[np.ix_(rows, rows)] += of_one
    return x, k


def hats(x, nodes, size, at):
    """Return the bilinear functions of nodes of a plane of rectangles at a place."""
    return np.prod(np.maximum(0, 1 - abs(x[nodes, :2] - at) / size), axis=1)


def force(upper, lower, points):
    """Return the force that presses, with points**2 conditions an overlap of two faces."""
    low, k_low = block((0, 0, 0), (2, 1.5, 1), (4 * lower // 3, lower, lower))
    up, k_up = block((LOW, LOW, 1), (1, 1, 1), (upper,) * 3)
    x = np.concatenate([low, up])
    k = sparse.block_diag([k_low, k_up]).tocsc()
    is_up = np.arange(len(x)) >= len(low)
    held = np.repeat((x[:, 2] == 0) | (x[:, 2] == 2), 3)
    held |= np.tile([True, True, False], len(x)) & np.repeat(x[:, 2] == 2, 3)
    given = np.where(np.repeat(x[:, 2] == 2, 3) & np.tile([False, False, True], len(x)), -DEPTH, 0)
    free = ~held
    factor = splu(k[free][:, free].tocsc())
    u = given.copy()
    u[free] = factor.solve(-(k[free] @ given))
    below, above = np.flatnonzero(~is_up & (x[:, 2] == 1)), np.flatnonzero(is_up & (x[:, 2] == 1))
    edges = np.concatenate([LOW + np.arange(upper + 1) / upper, 1.5 / lower * np.arange(lower + 2)])
    edges = np.unique(np.round(edges[(edges >= LOW) & (edges <= LOW + 1)], 12))
    gauss = np.polynomial.legendre.leggauss(points)[0]
    along = np.concatenate([(a + b + (b - a) * gauss) / 2 for a, b in itertools.pairwise(edges)])
    rows = np.zeros((len(along) ** 2, 3 * len(x)))
    for row, at in zip(rows, itertools.product(along, along), strict=True):
        row[3 * above + 2] = hats(x, above, 1 / upper, at)
        row[3 * below + 2] = -hats(x, below, 1.5 / lower, at)
    w = rows[:, free] @ factor.solve(rows[:, free].T.copy())
    gap, pressed = rows @ u, np.zeros(len(rows))
    for _ in range(20000):
        before = pressed.copy()
        for i in range(len(gap)):
            pressed[i] = max(0.0, pressed[i] - (w[i] @ pressed + gap[i]) / w[i, i])
        if abs(pressed - before).sum() < 1e-9 * pressed.sum():
            break
    return pressed.sum()


def main():
    argparse.ArgumentParser(description=__doc__).parse_args()
    for upper, lower in ((2, 3), (4, 6)):
        found = ", ".join(f"{force(upper, lower, points):.7f}" for points in (1, 2, 3))
        print(f"{upper} on {lower}, with 1, 4, 9 points an overlap: {found}")


if __name__ == "__main__":
    main()
