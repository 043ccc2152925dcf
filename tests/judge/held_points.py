"""Points whose two sides cannot move apart, by a reading of docs/theory.md, section 11, of its own.

Motions are rows of a dense matrix: displacements over those of all directions that depend on
nothing. Whether a side is held nearly, or joined nearly, is asked twice, with less and with more
allowance than the 95 % of the theory: between the two either answer is right.
"""

import numpy as np
from joints import Joints
from mortar import TURNED, normal_of, shapes
from surfaces import Ties

BEYOND = 0.1  # of a face: how far beyond its edges a node is still opposite
NONE = 1e-12  # a component of a normal, or of a motion, that is none
TURN = 0.995  # cosine of normals then and now that are still those of the undeformed mesh
LEFT = (0.03, 0.05, 0.07)  # of a motion that is none at most: surely, by the theory, perhaps


def free_directions(scene, held, joints, ties):
    """Indices of all directions (of 3N) that depend on nothing and are not held."""
    used = np.zeros(held.shape, dtype=bool)
    used[np.unique(scene.nodes)] = True
    used[scene.references()] = True
    for terms in joints.lines.values():
        for other in terms:
            used[other] = True
    for at in joints.lines:
        used[at] = False
    for tie in ties:
        used[tie.rows] &= held[tie.rows]
    return np.flatnonzero((used & ~held).ravel())


def follow_ties(ties, joints, free, held):
    """All displacements (3N, n) that a unit of each free direction makes, ties included."""
    out = np.zeros((held.size, len(free)))
    out[free, np.arange(len(free))] = 1.0
    for _ in range(len(ties) + (4 if joints.lines else 0)):  # chains
        for tie in ties:
            for i in range(3):
                moves = ~held[tie.rows, i]
                out[3 * tie.rows[moves] + i] = tie.weights[moves] @ out[i::3]
        joints.complete(out)
    return out


class Freedom:
    """How nodes move where directions (N, 3) are `held`."""

    def __init__(self, scene, held):
        self.scene, self.held = scene, held
        self.joints, self.ties = Joints(scene, held), Ties(scene).all
        free = free_directions(scene, held, self.joints, self.ties)
        self.motions = follow_ties(self.ties, self.joints, free, held).reshape(*held.shape, -1)
        self.hung = {}  # (row, axis) -> the rows that a tie hangs it on
        for tie in self.ties:
            for row, weights in zip(tie.rows, tie.weights, strict=True):
                for axis in np.flatnonzero(~held[row]):
                    self.hung[int(row), int(axis)] = set(np.flatnonzero(weights).tolist())

    def is_held(self, row, direction):
        """Whether a node cannot move along a direction."""
        return np.abs(direction @ self.motions[row]).sum() <= NONE

    def are_held(self, row, opposite, direction, left):
        """Whether a node and all but `left` of what is opposite cannot move along a direction."""
        nodes, shares = opposite
        held = sum(s for n, s in zip(nodes, shares, strict=True) if self.is_held(n, direction))
        return self.is_held(row, direction) and held >= 1 - left

    def apart(self, row, opposite, direction):
        """The size of the motion along a direction that is left between both sides."""
        nodes, shares = opposite
        motion = direction @ self.motions[row]
        for node, share in zip(nodes, shares, strict=True):
            motion = motion - share * (direction @ self.motions[node])
        return np.abs(motion).sum()

    def are_tied(self, row, opposite, axis, left):
        """Whether ties hang the node and all but `left` of what is opposite on each other."""
        mine, tied = self.hung.get((row, axis), set()), 0.0
        for node, share in zip(*opposite, strict=True):
            its = self.hung.get((node, axis), set())
            if node in mine or row in its or mine & its:
                tied += share
        return tied >= 1 - left

    def still_axes(self, row, opposite, left):
        """(3,) along which the two sides cannot move apart."""
        return np.array([
            self.are_held(row, opposite, e, left) or self.apart(row, opposite, e) <= left
            or self.are_tied(row, opposite, axis, left) for axis, e in enumerate(np.eye(3))
        ])  # fmt: skip

    def is_fixed(self, row, opposite, normal, left):
        """Whether the two sides cannot move apart along the normal, but for `left`."""
        still = self.still_axes(row, opposite, left)
        return bool(np.all(still | (np.abs(normal) <= NONE))
                    or self.are_held(row, opposite, normal, left)
                    or self.apart(row, opposite, normal) <= NONE)  # fmt: skip


def opposite_of(row, slave, x, master):
    """(rows, shape functions) of the master's place opposite a slave node, None if there is none.

    `x` (N, 3): places of both surfaces.
    """
    least, found = BEYOND, None
    for face in slave:
        if row not in face:
            continue
        places = x[list(face)]
        n = normal_of(places)
        first = places[1] - places[0]
        first = first - n * (n @ first)
        first /= np.linalg.norm(first)
        plane = np.column_stack([first, np.cross(n, first)])
        for other in master:
            there = x[list(other)]
            if n @ normal_of(there) > TURNED:
                continue
            seen = (there - x[row]) @ plane
            if np.any(np.abs(seen.mean(axis=0)) > 2 * np.ptp(seen, axis=0)):
                continue
            share = shapes(seen, np.zeros((1, 2)))[0]
            # Outside a face that is no parallelogram there may be no such place.
            meets = np.abs(share @ seen).max() <= 1e-9 * np.ptp(seen, axis=0).max()
            if meets and -share.min() < least - 1e-12:
                least = -share.min()
                share = np.maximum(share, 0)
                found = ([int(r) for r in other], share / share.sum())
    return found


def points_that_cannot_part(surface, freedom, u, rotation):
    """{row: (surely, by the theory, perhaps, still (3,))} of slave nodes before a body's surface.

    Where displacements `u` (N, 3) take both. `still`: axes along which the sides cannot move apart.
    """
    out = {}
    if surface.obstacle is not None:
        return out
    placed, x = surface.place(u, rotation), surface.places(u)
    for at, row in enumerate(placed.rows):
        row = int(row)
        normal = placed.normal[at]
        if not normal.any():
            continue
        opposite = opposite_of(row, surface.slave, x, surface.master)
        if opposite is None:
            continue
        if normal @ surface.first.normal[at] > TURN:
            normal = surface.first.normal[at]
        answers = [freedom.is_fixed(row, opposite, normal, left) for left in LEFT]
        out[row] = (*answers, freedom.still_axes(row, opposite, LEFT[1]))
    return out


def held_with_their_weights(surface, freedom, placed, left):
    """(P,) nodes held along their normals, with all but `left` of their weights' sizes.

    Of points without a multiplier neighbours have the weights: so this is asked when those are
    known, and again when there are more.
    """
    out = np.zeros(len(placed.rows), dtype=bool)
    if surface.obstacle is not None:
        return out
    for at, row in enumerate(placed.rows):
        weights, normal = placed.weights[at], placed.normal[at]
        if not normal.any():
            continue
        if normal @ surface.first.normal[at] > TURN:
            normal = surface.first.normal[at]
        if freedom.is_held(row, normal):
            held = [abs(weights[k]) for k in np.flatnonzero(weights) if freedom.is_held(k, normal)]
            out[at] = sum(held) >= (1 - left) * np.abs(weights).sum()
    return out
