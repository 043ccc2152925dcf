"""Surfaces before surfaces: weights, normals and gaps of nodes, by integrals of the judge's own.

What is integrated is what docs/theory.md, section 11, says, (11.1) to (11.4). How is another way
than the program's: overlaps are the hull of corners that lie inside and of crossings of edges, and
their integrals those of Gauss's product rule, 49 points a triangle, whatever the faces look like.
"""

from dataclasses import dataclass

import numpy as np

TURNED = -0.2  # the cosine of normals of faces that face each other, at most
LEAST_SHARE = 1e-3  # of a node's area, from which on it has a row
LEAST_KEPT = 2e-4  # down to which it keeps a row that it had
NOTHING = 1e-9  # of a face: what is covered has lost its digits

XI = np.array([-1.0, 1.0, 1.0, -1.0])
ETA = np.array([-1.0, -1.0, 1.0, 1.0])


def product_rule(n):
    """Points (n*n, 2) and weights of a square folded to the triangle (0,0), (1,0), (1,1)."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    s, t = (g.ravel() for g in np.meshgrid(x, x, indexing="ij"))
    weight = np.outer(w, w).ravel() * s * 2
    return np.column_stack([s, s * t]), weight


POINTS, WEIGHTS = product_rule(7)


def normal_of(x):
    """The outward unit normal of a face (3 or 4, 3), anticlockwise from outside."""
    # Of a triangle the edges from its first corner, else the diagonals.
    n = np.cross(x[-2] - x[0], x[-1] - x[-3])
    return n / np.linalg.norm(n)


def is_folded(flat):
    """Whether a face (4, 2), seen in a plane, has a corner that points inwards."""
    along, back = np.roll(flat, -1, axis=0) - flat, np.roll(flat, 1, axis=0) - flat
    turn = cross2(along, back)
    return len(flat) == 4 and bool((turn * np.sign(turn.sum())).min() <= 0)


def evenness(flat):
    """The least over the largest Jacobian at a flat face's corners; 1 of triangles."""
    if len(flat) == 3:
        return 1.0
    along = np.roll(flat, -1, axis=0) - flat
    back = np.roll(flat, 1, axis=0) - flat
    size = np.abs(cross2(along, back))
    return size.min() / size.max()


def cross2(a, b):
    """The third component of a x b."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def inside(points, polygon, slack):
    """Which points (n, 2) lie in a convex polygon (m, 2) that runs anticlockwise."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    length = np.linalg.norm(edge, axis=1)
    away = cross2(edge[None], points[:, None] - polygon[None]) / np.where(length > 0, length, 1)
    return np.all(away >= -slack, axis=1)


def hull_of_overlap(a, b):
    """Corners (n, 2) of what two convex polygons share, anticlockwise; empty: nothing."""
    size = max(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max())
    slack = 1e-14 * size
    found = [a[inside(a, b, slack)], b[inside(b, a, slack)]]
    da, db = np.roll(a, -1, axis=0) - a, np.roll(b, -1, axis=0) - b
    across = cross2(da[:, None], db[None])
    start = b[None] - a[:, None]
    steep = np.abs(across) > 1e-14 * size**2
    with np.errstate(divide="ignore", invalid="ignore"):
        s = cross2(start, np.broadcast_to(db[None], start.shape)) / across
        t = cross2(start, np.broadcast_to(da[:, None], start.shape)) / across
    meet = steep & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    at = np.nonzero(meet)
    found.append(a[at[0]] + s[at][:, None] * da[at[0]])
    corners = np.vstack(found)
    if len(corners) < 3:
        return corners[:0]
    middle = corners.mean(axis=0)
    order = np.argsort(np.arctan2(*(corners - middle).T[::-1]))
    return corners[order]


def shapes(flat, points):
    """Shape functions (n, 3 or 4) of a flat face at points (n, 2) of its plane."""
    if len(flat) == 3:
        edges = np.column_stack([flat[1] - flat[0], flat[2] - flat[0]])
        s, t = np.linalg.solve(edges, (points - flat[0]).T)
        return np.column_stack([1 - s - t, s, t])
    xi = np.zeros((len(points), 2))
    for _ in range(30):
        s, t = xi.T[:, :, None]
        values = (1 + s * XI) * (1 + t * ETA) / 4
        along_s = XI * (1 + t * ETA) / 4 @ flat
        along_t = ETA * (1 + s * XI) / 4 @ flat
        left = points - values @ flat
        determinant = cross2(along_s, along_t)
        step = np.column_stack([cross2(left, along_t), cross2(along_s, left)])
        step /= determinant[:, None]
        xi = xi + step
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    s, t = xi.T[:, :, None]
    return (1 + s * XI) * (1 + t * ETA) / 4


def bend_of(flat):
    """How far a face is from a parallelogram, over its size; 0 for triangles."""
    if len(flat) == 3:
        return 0.0
    return float(np.abs(flat[0] - flat[1] + flat[2] - flat[3]).max() / np.ptp(flat, axis=0).max())


def least_on_edges(corners, middles):
    """The least value on the edges of a polygon, along which it is a quadratic function."""
    ends = np.roll(corners, -1)
    slope, bend = 4 * middles - 3 * corners - ends, 2 * (corners + ends - 2 * middles)
    inside = (slope < 0) & (slope + 2 * bend > 0)
    bend = np.where(inside, bend, 1.0)
    return (corners - np.where(inside, slope, 0.0) ** 2 / (4 * bend)).min()


@dataclass
class Placed:
    """Slave nodes before a master surface. P nodes, M vertices of the master."""

    rows: np.ndarray  # (P,)
    area: np.ndarray  # (P,) of the slave faces about a node
    covered: np.ndarray  # (P,) of it
    weights: np.ndarray  # (P, M); 0 where nothing is covered
    normal: np.ndarray  # (P, 3)
    apart: np.ndarray  # (P, 3) from the mean place on the master to that of the row
    own: np.ndarray  # (P, N) what rows have of other slave nodes, against theirs
    least: np.ndarray  # (P,) least distance in the faces about the node
    corner: np.ndarray  # (P,) least distance at corners of what faces share
    most: np.ndarray  # (P,) largest
    bend: float  # how far the faces are from parallelograms
    folded: int = 0  # faces in contact of which a corner points inwards
    either: float | np.ndarray = 0.0  # (P,) how much other weights are that explain as much

    @property
    def share(self):
        """What is covered of each node's area."""
        return self.covered / np.where(self.area > 0, self.area, 1.0)

    @property
    def gap(self):
        """(P,) along the normals."""
        return np.einsum("pi,pi->p", self.normal, self.apart)


def taken_over(has_none):
    """(4, 4): what each node of a face gets of the multipliers of all; columns add up to 1.

    Those of nodes that have none go to their neighbours along the edges, or to the node across.
    """
    out = np.diag((~has_none).astype(float))
    for a in np.flatnonzero(has_none):
        takers = [b for b in ((a + 1) % 4, (a + 3) % 4) if not has_none[b]]
        takers = takers or np.flatnonzero(~has_none).tolist()
        out[takers, a] = 1.0 / max(1, len(takers))
    return out


def plain_part(bare, aslant):
    """How much of a face's functions are its shape functions, by what of it is bare, (11.32).

    `aslant`: the part of what is covered that leans against it.
    """
    return float(np.clip((bare - 0.02) / 0.08, 0, 1) * np.clip((1 - 20 * aslant) / 0.9, 0, 1))


def straight_part(n, m):
    """How much of what a face with normal m covers is turned to n, by their angle, (11.35)."""
    facing = -(n @ m)
    if facing >= 0.707:
        return float(min(1, (facing - 0.707) / (0.866 - 0.707)))
    return float(min(0, 1 - np.sqrt(1 - facing**2) / facing))  # what leans, as it rises


def sight_share(n, m):
    """How much of what faces with these normals see of each other counts, (11.37)."""
    return float(np.clip((-(n @ m) + TURNED) / (0.707 + TURNED), 0, 1))


def place_surface(slave, x, master, y, none=(), moved=None, skins=None, of_nodes=False):
    """Placed nodes of `slave` faces [(4 rows of x)] before `master` faces [(3 or 4 rows of y)].

    `none`: rows of slave nodes without a multiplier, (11.17); `y` is `x` then, and weights have
    those of the slave's own nodes for whose place their neighbours stand. `moved`: displacements
    that distances in the faces have beyond `x`, which is `y` then, and nothing else has. `skins`:
    all outer faces of the slave's body and of the master's, which may hide what overlaps; `y` is
    `x` then. `of_nodes`: rows are of nodes, each by itself, as those of ties.
    """
    if moved is None:
        moved = np.zeros((max(len(x), len(y)), 3))
    rows = np.unique(slave)
    number = {int(r): i for i, r in enumerate(rows)}
    count = len(rows)
    area, covered = np.zeros(count), np.zeros(count)
    weights, own_part = np.zeros((count, len(y))), np.zeros((count, len(x)))
    normal, bend = np.zeros((count, 3)), 0.0
    least, corner, most = (np.full(count, sign * np.inf) for sign in (1, 1, -1))
    normals = [normal_of(y[list(f)]) for f in master]
    folded = set()
    corners = [y[list(f)] for f in master]
    for face in slave:
        face = [int(r) for r in face]
        at = [number[r] for r in face]
        places = x[face]
        n = normal_of(places)
        first = places[1] - places[0]
        first = first - n * (n @ first)
        first /= np.linalg.norm(first)
        plane = np.column_stack([first, np.cross(n, first)])
        middle = places.mean(axis=0)
        flat = (places - middle) @ plane
        own = integrate(flat, flat, None)
        has_none = np.isin(face, list(none))
        given = taken_over(has_none)
        # What has no multiplier keeps its area, of which nothing is covered.
        area[at] += given @ own[1] + has_none * own[1]
        bend = max(bend, bend_of(flat), float(np.abs((places - middle) @ n).max()
                                               / np.ptp(flat, axis=0).max()))  # fmt: skip
        low, high = flat.min(axis=0), flat.max(axis=0)
        lumped, mass, mixed = np.zeros(4), np.zeros((4, 4)), []
        covers = None if skins is None else [
            Covers(skin, x, middle, np.column_stack([plane, n])) for skin in skins
        ]
        for f, (there, m) in enumerate(zip(corners, normals, strict=True)):
            if n @ m > TURNED:
                continue
            seen = (there - middle) @ plane
            if np.any(seen.min(axis=0) > high) or np.any(seen.max(axis=0) < low):
                continue
            polygon = hull_of_overlap(flat, seen[::-1])
            if len(polygon) < 3:
                continue
            pieces = [polygon]
            if covers is not None:
                pieces = seen_of(polygon, there - middle, m, n, plane, face, list(master[f]),
                                 float(np.abs((places - middle) @ n).max()), covers)  # fmt: skip
            for polygon in pieces:
                size, lump, own_mass, mix, values = integrate(flat, polygon, seen)
                if size < 1e-12 * own[0]:
                    continue
                counts = sight_share(n, m)
                lump, own_mass, mix = counts * lump, counts * own_mass, counts * mix
                lumped += lump
                mass += own_mass
                mixed.append((f, mix, lump))
                ends = places + moved[face], there + moved[list(master[f])]
                distance = (values[0] @ ends[0] - values[1] @ ends[1]) @ m
                at_corners, at_middles = distance[-2 * len(polygon) :].reshape(2, -1)
                lowest = min(distance.min(), least_on_edges(at_corners, at_middles))
                corner[at] = np.minimum(corner[at], at_corners.min())
                least[at] = np.minimum(least[at], lowest)
                most[at] = np.maximum(most[at], distance.max())
            if not mixed or mixed[-1][0] != f:
                continue
            if is_folded(seen) or is_folded(flat):
                folded |= {("master", f)} if is_folded(seen) else {("slave", *face)}
            bend = max(bend, bend_of(seen), float(np.abs((there - there.mean(axis=0)) @ m).max()
                                                   / np.ptp(seen, axis=0).max()))  # fmt: skip
        if lumped.sum() < NOTHING * own[0]:
            continue
        straight = sum(lump.sum() * straight_part(n, normals[f]) for f, _, lump in mixed)
        plain = 0.0
        if not of_nodes:
            plain = plain_part(1 - lumped.sum() / own[0], 1 - straight / lumped.sum())
        part = plain * np.eye(4)
        if plain < 1:
            part += (1 - plain) * lumped[:, None] * np.linalg.inv(mass)
        dual = given @ part  # Phi = dual N, (11.1), (11.32)
        shared = given @ (plain * mass + (1 - plain) * np.diag(lumped))
        covered[at] += shared.sum(axis=1)
        for b, a in np.argwhere((shared != 0) & ~np.eye(4, dtype=bool)):
            own_part[at[b], face[b]] += shared[b, a]
            own_part[at[b], face[a]] -= shared[b, a]
        for f, mix, lump in mixed:
            part = dual @ mix
            for a in range(4):
                weights[at[a], list(master[f])] += part[a]
                normal[at[a]] += (given @ lump)[a] * normals[f]
    some = covered > 0
    weights[some] /= covered[some, None]
    own_part[some] /= covered[some, None]
    length = np.linalg.norm(normal, axis=1)
    normal[some] /= length[some, None]
    apart = np.where(some[:, None], x[rows] - own_part @ x - weights @ y, 0.0)
    if y is x:
        weights += own_part
    return Placed(rows, area, covered, weights, normal, apart, own_part, least, corner, most, bend,
                  len(folded))  # fmt: skip


class Covers:
    """The outer faces of a body as triangles about their middles, in a plane and above it."""

    def __init__(self, skin, x, middle, axes):
        corners = [x[list(face)] for face in skin]
        self.nodes, triangles = [], []
        for face, at in zip(skin, corners, strict=True):
            for k in range(len(at)):
                triangles.append([at[k], at[(k + 1) % len(at)], at.mean(axis=0)])
                self.nodes.append(set(face))
        self.at = (np.array(triangles) - middle) @ axes  # (T, 3, 3)

    def regions(self, polygon, plane, own, warp):
        """Half-planes [(k, 3)], a . x + b >= 0, of what lies between 0 and a master behind it.

        `plane`: heights of the master, b + a . x, as (3,). `own`: the nodes of both faces; their
        neighbours count where they are between by more than `warp`.
        """
        deepest = (plane[:2] @ polygon.T + plane[2]).min()
        flat, height = self.at[:, :, :2], self.at[:, :, 2]
        near = (flat.max(axis=1) > polygon.min(axis=0)).all(axis=1)
        near &= (flat.min(axis=1) < polygon.max(axis=0)).all(axis=1)
        near &= (height.min(axis=1) < 0) & (height.max(axis=1) > deepest)
        size = np.ptp(polygon, axis=0).max()
        for t in np.flatnonzero(near):
            common = max(len(self.nodes[t] & nodes) for nodes in own)
            if common == len(self.nodes[t]):
                continue
            slack = max(1e-9 * size, warp if common else 0.0)
            turn = cross2(flat[t, 1] - flat[t, 0], flat[t, 2] - flat[t, 0])
            if abs(turn) < 1e-12 * size**2:
                continue
            ends = flat[t] if turn > 0 else flat[t, ::-1]
            along = np.roll(ends, -1, axis=0) - ends
            inward = np.column_stack([-along[:, 1], along[:, 0]])
            sides = np.column_stack([inward, -np.sum(inward * ends, axis=1)])
            own_plane = np.linalg.solve(np.column_stack([flat[t], np.ones(3)]), height[t])
            below = -own_plane - [0, 0, slack]
            above = own_plane - plane - [0, 0, slack]
            yield np.vstack([sides, below, above])


def clipped(polygon, limit):
    """What of a convex polygon (m, 2) is where limit[:2] . x + limit[2] >= 0."""
    value = polygon @ limit[:2] + limit[2]
    out = []
    for k in range(len(polygon)):
        after = (k + 1) % len(polygon)
        if value[k] >= 0:
            out.append(polygon[k])
        if value[k] * value[after] < 0:
            part = value[k] / (value[k] - value[after])
            out.append(polygon[k] + part * (polygon[after] - polygon[k]))
    return np.array(out).reshape(-1, 2)


def divided(polygons, regions):
    """Convex polygons outside all regions and those inside any."""
    outside, inside = list(polygons), []
    for limits in regions:
        left = []
        for polygon in outside:
            for limit in limits:
                left.append(clipped(polygon, -limit))
                polygon = clipped(polygon, limit)
                if len(polygon) < 3:
                    break
            inside.append(polygon)
        outside = [p for p in left if len(p) > 2]
    return outside, [p for p in inside if len(p) > 2]


def seen_of(polygon, there, m, n, plane, face, other, warp, covers):
    """What of an overlap is seen: behind the slave all but what faces of both bodies hide."""
    up = np.append(m @ plane, m @ n)
    middle = there.mean(axis=0)
    heights = -np.append(up[:2], -(m @ middle)) / up[2]
    if (polygon @ heights[:2] + heights[2]).min() > -1e-12:
        return [polygon]
    own = set(face), set(other)
    warp = max(warp, float(np.abs((there - middle) @ m).max()))
    pieces, doubtful = divided([polygon], covers[0].regions(polygon, heights, own, warp))
    seen, hidden = divided(doubtful, covers[1].regions(polygon, heights, own, warp))
    # What is in one piece has no corners inside.
    return pieces + seen if hidden else [polygon]


def integrate(flat, polygon, seen):
    """Area of a polygon in a slave face, int N, int N N^T, int N N_master^T; values at points.

    `flat` and `seen`: slave and master face in the plane. Corners of the polygon and the middles of
    its edges are the last points whose values are returned.
    """
    a, b = polygon, np.roll(polygon, -1, axis=0)
    middle = np.broadcast_to(polygon.mean(axis=0), a.shape)
    even = float(min(evenness(flat), 1.0 if seen is None else evenness(seen)))
    # Shape functions that are fractions with a pole close by take more points.
    for _ in range((even < 0.3) + (even < 0.2) + (even < 0.1) + (even < 0.05)):
        ab, bm, ma = (a + b) / 2, (b + middle) / 2, (middle + a) / 2
        middle, a, b = (np.vstack(v) for v in (
            (middle, ma, bm, ma), (ma, a, ab, ab), (bm, ab, b, bm)))  # fmt: skip
    twice = cross2(a - middle, b - middle)
    points = (middle[:, None] + POINTS[None, :, :1] * (a - middle)[:, None]
              + POINTS[None, :, 1:] * (b - a)[:, None])  # fmt: skip
    w = (twice[:, None] / 2 * WEIGHTS[None]).ravel()
    edges = (polygon + np.roll(polygon, -1, axis=0)) / 2
    every = np.vstack([points.reshape(-1, 2), polygon, edges])
    n = shapes(flat, every)
    inner = n[: len(w)]
    lump, mass = w @ inner, inner.T @ (w[:, None] * inner)
    if seen is None:
        return w.sum(), lump, mass, None, None
    m = shapes(seen, every)
    return w.sum(), lump, mass, inner.T @ (w[:, None] * m[: len(w)]), (n, m)
