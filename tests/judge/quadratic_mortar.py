"""Faces with mid-side nodes before faces with mid-side nodes: (11.21) and (11.22), integrated anew.

Faces are cut into parts between their nodes, as docs/theory.md, section 11, says; overlaps are the
hulls of mortar.py, integrals those of Gauss's product rule with 49 points a triangle.
"""

import numpy as np
from mortar import (
    LEAST_SHARE,
    POINTS,
    TURNED,
    WEIGHTS,
    cross2,
    hull_of_overlap,
    plain_part,
    sight_share,
    straight_part,
)
from second_order import FACES

DUAL_SHARE = 0.05  # the same where functions of a part of a face are dual

PARTS = {3: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
         4: [(0, 4, 7), (4, 1, 5), (5, 2, 6), (7, 6, 3), (4, 5, 6, 7)]}  # fmt: skip
PARENT = {3: np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)]),
          4: np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)],
                      dtype=float)}  # fmt: skip


def outward(x):
    """The unit normal of a part (3 or 4, 3) whose nodes run clockwise from outside."""
    n = np.cross(x[-1] - x[-3], x[-2] - x[0]) if len(x) == 4 else np.cross(x[2] - x[0], x[1] - x[0])
    return n / np.linalg.norm(n)


def places_seen(face, x, plane, points, start):
    """Where in the parent of a face (nodes x) points (G, 2) of a plane are seen."""
    at = np.tile(np.asarray(start, dtype=float), (len(points), 1))
    flat = x @ plane
    for _ in range(40):
        values, slopes = face.at(at)
        left = points - values @ flat
        s, t = slopes[0] @ flat, slopes[1] @ flat
        step = np.column_stack([cross2(left, t), cross2(s, left)]) / cross2(s, t)[:, None]
        at = at + step
        if np.abs(step).max() < 1e-12:  # the next would be its square
            break
    return at


def polynomials(kind, at):
    """What shape functions of a face are made of, (G, 2 kind)."""
    s, t = at.T
    return np.column_stack([s**0, s, t, s * s, s * t, t * t, s * s * t, s * t * t][: 2 * kind])


def fit(kind, own, pieces):
    """M^-1 int N~ N_k of each of `pieces` [(places, weights, N_k)]: (2 kind, k).

    That is: values at the points of the face of the polynomials closest to N_k. They are taken in
    coordinates as wide as what is covered, orthogonal there, so that no narrow strip costs digits.
    """
    at, w = np.concatenate([p[0] for p in pieces]), np.concatenate([p[1] for p in pieces])
    middle = w @ at / w.sum()
    spread = (at - middle).T @ (w[:, None] * (at - middle)) / w.sum()
    scale = np.linalg.cholesky(spread) if kind == 3 else np.diag(np.sqrt(np.diag(spread)))
    scale = np.linalg.inv(scale).T
    q, r = np.linalg.qr(np.sqrt(w)[:, None] * polynomials(kind, (at - middle) @ scale))
    at_nodes = polynomials(kind, (PARENT[kind] - middle) @ scale)
    at_points = np.linalg.solve(own.T, at_nodes) @ np.linalg.inv(r)
    found, first = [], 0
    for places, weights, theirs in pieces:
        part = q[first : first + len(places)]
        found.append(at_points @ part.T @ (np.sqrt(weights)[:, None] * theirs))
        first += len(places)
    return found


def place(mesh, slave, master, x, alpha, of_nodes=False):
    """Points of `slave` faces [(element, face)] before `master` faces, nodes at x (N, 3).

    Returns rows (P,), the combinations C (P, N) with d(u) = C u, normals (P, 3), covered areas
    (P,), areas (P,) of the nodes, the gaps (P,) raised by (11.35), and the shares (P,) of their
    areas from which on they have rows. `of_nodes`: rows are of nodes, as those of ties.
    """
    faces = [mesh.face_nodes(e, f) for e, f in slave]
    facing = [mesh.face_nodes(e, f) for e, f in master]
    rows = np.unique(np.concatenate(faces))
    number = {int(r): i for i, r in enumerate(rows)}
    count = len(rows)
    weights, normal = np.zeros((count, len(x))), np.zeros((count, 3))
    covered, area = np.zeros(count), np.zeros(count)
    nearest, opposed = np.full(count, np.inf), np.zeros(count)
    least, shared = np.full(count, LEAST_SHARE), np.zeros((count, count))
    seen_parts = []
    for nodes in facing:
        kind = len(nodes) // 2
        for part in PARTS[kind]:
            corners = x[[nodes[c] for c in part]]
            seen_parts.append((nodes, kind, part, corners, outward(corners)))
    for nodes in faces:
        kind = len(nodes) // 2
        face = FACES[kind]
        at = [number[n] for n in nodes]
        own = np.eye(2 * kind)  # N~ = own N
        for m in range(kind):
            share = alpha[nodes[kind + m]]
            own[kind + m, kind + m] = 1 - 2 * share
            own[m, kind + m] += share
            own[(m + 1) % kind, kind + m] += share
        lumped, pieces = np.zeros(2 * kind), []
        mass, straight, turned = np.zeros((2 * kind, 2 * kind)), 0.0, []
        area[at] += own @ face.shares(x[nodes])
        for part in PARTS[kind]:
            corners = x[[nodes[c] for c in part]]
            n = outward(corners)
            first = corners[1] - corners[0]
            first = first - n * (n @ first)
            first /= np.linalg.norm(first)
            plane = np.column_stack([first, -np.cross(n, first)])  # nodes run anticlockwise in it
            flat = corners @ plane
            for other, size, piece, there, m in seen_parts:
                if n @ m > TURNED:
                    continue
                far = there @ plane
                if np.any(far.min(axis=0) > flat.max(axis=0)) or np.any(
                    far.max(axis=0) < flat.min(axis=0)
                ):
                    continue
                polygon = hull_of_overlap(flat, far[::-1])
                if len(polygon) < 3:
                    continue
                a, b = polygon, np.roll(polygon, -1, axis=0)
                c = np.broadcast_to(polygon.mean(axis=0), a.shape)
                w = (cross2(a - c, b - c)[:, None] / 2 * WEIGHTS[None]).ravel()
                points = c[:, None] + POINTS[None, :, :1] * (a - c)[:, None]
                points = (points + POINTS[None, :, 1:] * (b - a)[:, None]).reshape(-1, 2)
                if w.sum() < 1e-13 * np.ptp(flat, axis=0).prod():
                    continue
                here = places_seen(face, x[nodes], plane, points, PARENT[kind][list(part)].mean(0))
                values, slopes = face.at(here)
                tall = np.cross(slopes[1] @ x[nodes], slopes[0] @ x[nodes])
                w = np.maximum(w, 0.0) * np.linalg.norm(tall, axis=1) / np.abs(tall @ n)
                w *= sight_share(n, m)
                mine = values @ own.T
                opposite = FACES[size]
                places = places_seen(opposite, x[other], plane, points,
                                     PARENT[size][list(piece)].mean(0))  # fmt: skip
                theirs, along = opposite.at(places)
                up = np.cross(along[1] @ x[other], along[0] @ x[other])
                up /= np.linalg.norm(up, axis=1)[:, None]
                lumped += w @ mine
                mass += mine.T @ (w[:, None] * mine)
                straight += w.sum() * straight_part(n, m)
                pieces.append((other, here, w, theirs, mine))
                normal[at] += mine.T @ (w[:, None] * up)
                turned.append((straight_part(n, m), w @ mine))
                middle = PARENT[kind][list(part)].mean(0)
                mine = face.at(places_seen(face, x[nodes], plane, polygon, middle))[0]
                middle = PARENT[size][list(piece)].mean(0)
                theirs, along = opposite.at(places_seen(opposite, x[other], plane, polygon, middle))
                up = np.cross(along[1] @ x[other], along[0] @ x[other])
                up /= np.linalg.norm(up, axis=1)[:, None]
                gap = np.einsum("gi,gi->g", up, mine @ x[nodes] - theirs @ x[other])
                nearest[at] = np.minimum(nearest[at], gap.min())
        if lumped.sum() <= 0:
            continue
        covered[at] += lumped
        bare = max(0.0, 1 - lumped.sum() / face.shares(x[nodes]).sum())
        plain = 0.0
        if not of_nodes and kind == 3:
            plain = plain_part(bare, 1 - straight / lumped.sum())
        if plain < 1 and bare > 0.1:
            least[at] = DUAL_SHARE
        # Functions of eight nodes are below 0 over half of a face.
        opposed[at] += sum(
            (1 - bare if kind == 4 and s > 0 else 1) * s * w for s, w in turned)
        shared[np.ix_(at, at)] += plain * mass + (1 - plain) * np.diag(lumped)
        fits = [0.0] * len(pieces)
        if plain < 1:
            fits = fit(kind, own, [piece[1:4] for piece in pieces])
        for (other, _, w, theirs, mine), values in zip(pieces, fits, strict=True):
            part = plain * mine.T @ (w[:, None] * theirs) + (1 - plain) * lumped[:, None] * values
            for k, a in enumerate(at):
                np.add.at(weights[a], other, part[k])
    some = covered > 0
    weights[some] /= covered[some, None]
    normal[some] /= np.linalg.norm(normal[some], axis=1)[:, None]
    shared[some] /= covered[some, None]
    places = np.zeros((count, len(x)))  # of the points
    for i, r in enumerate(rows):
        part = alpha.get(int(r), 0.0)
        places[i, r] = 1 / (1 - 2 * part)
        if part:
            places[i, list(mesh.middles[int(r)])] -= part / (1 - 2 * part)
    of_rows = np.where(some[:, None], shared @ places, places)
    combination = of_rows - weights
    gap = np.einsum("pi,pi->p", normal, combination @ x)
    slanted = np.clip(20 * (1 - opposed / np.where(some, covered, 1.0)), 0, 1)
    gap += slanted * np.maximum(0, np.where(some, nearest, gap) - gap)
    return rows, combination, normal, covered, area, gap, least
