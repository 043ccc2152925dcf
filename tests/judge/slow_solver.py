"""A slow solver of its own: one increment on dense matrices, to see whether a solution exists.

Reactions and rigid motions are found by a semi-smooth Newton method on all of

    x = W r + G a + x_0,      G^T r + q = 0,      Signorini's and Coulomb's laws between x and r,

and where that fails from what a proximal iteration with Gauss-Seidel projections comes to,
where `W` comes from the dense stiffness with its rigid motions shifted away. Not fast, not robust
in every case: where it finds nothing, that proves nothing.
"""

import time
from dataclasses import dataclass

import numpy as np
from held_points import (
    LEFT,
    Freedom,
    follow_ties,
    free_directions,
    held_with_their_weights,
    points_that_cannot_part,
)
from joints import Joints
from mortar import LEAST_KEPT, LEAST_SHARE
from obstacles import chords, locate, shift_of, turned
from surfaces import Surface, Ties

EXTENDED = np.longdouble


@dataclass
class Solution:
    """Displacements (N, 3), and reactions (P, 3) in space of every pair's points."""

    u: np.ndarray
    forces: list
    converged: bool
    residual: float
    drift: float  # how far loads that nothing holds pushed bodies on


class Body:
    """The stiffness of a scene with some directions held, and its free rigid motions.

    Directions that are tied follow the `free` ones: all of them are `follow` (3N, n) times these.
    """

    def __init__(self, scene, held):
        self.scene = scene
        elements = scene.elements()
        self.stiffness = elements.stiffness()
        self.joints = joints = Joints(scene, held)
        self.ties = ties = Ties(scene).all
        self.tied = [~held[tie.rows] for tie in ties]
        self.free = free_directions(scene, held, joints, ties)
        self.motions = rigid_motions(scene, held)[self.free]  # (n, m), orthonormal
        self.follow = follow_ties(ties, joints, self.free, held) if ties or joints.lines else None
        if self.follow is not None:
            self.motions, _ = np.linalg.qr(self.motions)
            k = self.follow.T @ self.stiffness @ self.follow
        else:
            k = self.stiffness[np.ix_(self.free, self.free)]
        scale = np.sqrt(np.maximum(np.diag(k), 0))
        typical = np.median(scale[scale > 0]) if np.any(scale > 0) else 1.0
        self.scale = np.where(scale > 0, scale, typical)
        # In scaled unknowns the motions are other ones.
        turned = self.scale[:, None] * self.motions
        basis, _ = np.linalg.qr(turned) if turned.size else (turned, None)
        self.basis = basis
        shifted = k / np.outer(self.scale, self.scale) + basis @ basis.T
        values = np.linalg.eigvalsh(shifted)
        self.condition = float(values.max() / max(values.min(), 1e-300)) if len(values) else 1.0
        self.inverse = np.linalg.pinv(shifted, rcond=1e-15, hermitian=True)

    def reduced(self, force):
        """Forces (3N, ...) on the free directions, with those of the directions tied to them."""
        return force[self.free] if self.follow is None else self.follow.T @ force

    def spread(self, motion):
        """All displacements (3N, ...) of free ones (n, ...)."""
        if self.follow is not None:
            return self.follow @ motion
        out = np.zeros((self.stiffness.shape[0], *motion.shape[1:]))
        out[self.free] = motion
        return out

    def complete(self, u):
        """Displacements (N, 3) in which tied nodes are where their masters take them."""
        u = u.copy()
        for _ in self.ties:
            for tie, moves in zip(self.ties, self.tied, strict=True):
                u[tie.rows] = np.where(moves, tie.weights @ u, u[tie.rows])
        flat = u.reshape(-1)
        for _ in range(4 if self.joints.lines else 0):
            self.joints.complete(flat)
        return flat.reshape(u.shape)

    def balanced(self, force):
        """`force` (n,) less what `solve` leaves out of it: its part along rigid motions."""
        return force - self.scale * (self.basis @ (self.basis.T @ (force / self.scale)))

    def solve(self, force):
        """Displacements (n, ...) of the free directions, but for rigid motions."""
        scale = self.scale if force.ndim == 1 else self.scale[:, None]
        return self.inverse @ (force / scale) / scale


def rigid_motions(scene, held):
    """Orthonormal (3N, m): motions of bodies and reference nodes that nothing held hinders."""
    joints = Joints(scene, held)
    if joints.lines:
        return joined_motions(scene, held, joints)
    columns = []
    groups = [(rows, 6) for rows in scene.tied_bodies()]
    groups += [(np.array([r]), 3) for r in scene.references()]
    for rows, number in groups:
        arm = scene.points[rows] - scene.points[rows].mean(axis=0)
        arm = arm / (np.abs(arm).max() or 1.0)
        modes = np.zeros((*scene.points.shape, number))
        for i in range(3):
            modes[rows, i, i] = 1.0
            if number == 6:
                modes[rows, :, 3 + i] = np.cross(np.eye(3)[i], arm)
        modes = modes.reshape(-1, number)
        modes, _ = np.linalg.qr(modes)
        fixed = modes[held.ravel()]
        if len(fixed):
            _, s, v = np.linalg.svd(fixed)
            modes = modes @ v[int(np.sum(s > 1e-9)) :].T
        columns.append(modes)
    if not columns:
        return np.zeros((scene.points.size, 0))
    return np.hstack(columns)


def joined_motions(scene, held, joints):
    """The same where joints take part: motions of bodies and single nodes that keep all lines."""
    columns = []
    size = max(np.ptp(scene.points[rows], axis=0).max() for rows in scene.bodies())
    for rows in scene.tied_bodies():
        arm = (scene.points[rows] - scene.points[rows].mean(axis=0)) / size
        for i in range(3):
            for motion in (np.eye(3)[i], np.cross(np.eye(3)[i], arm)):
                columns.append(np.zeros(scene.points.shape))
                columns[-1][rows] = motion
    meshed = set(np.unique(scene.nodes).tolist())
    single = {(r, i) for r in scene.references() for i in range(3)}
    for at, terms in joints.lines.items():
        single |= {key for key in (at, *terms) if key[0] not in meshed}
    for key in sorted(single):
        columns.append(np.zeros(scene.points.shape))
        columns[-1][key] = 1.0
    motions = np.array(columns).reshape(len(columns), -1).T
    rows = [motions[3 * r + d] - sum(share * motions[3 * a + b] for (a, b), share in terms.items())
            for (r, d), terms in joints.lines.items()]  # fmt: skip
    rows = np.vstack([motions[held.ravel()], *rows])
    _, s, v = np.linalg.svd(rows)
    modes = motions @ v[int(np.sum(s > 1e-9 * s.max(initial=1e-300))) :].T
    return np.linalg.qr(modes)[0]


class Increment:
    """One increment: from displacements `before` to the supports and loads at its end.

    `turned_before`: rotation vectors (N, 3) of reference nodes; those at the end are supports.
    """

    def __init__(self, scene, before, supports, loads, body=None, turned_before=None):
        self.scene, self.before, self.loads = scene, before, loads
        self.held = np.zeros(before.shape, dtype=bool)
        self.target = np.zeros(before.shape)
        none = np.zeros(before.shape)
        self.rotations = (none if turned_before is None else turned_before, none.copy())
        for (node, dof), (value, *_) in supports.items():
            if dof > 2:
                self.rotations[1][node, dof - 3] = value
                continue
            self.held[node, dof] = True
            self.target[node, dof] = value
        if body is None or not np.array_equal(body.held, self.held):
            body = Body(scene, self.held)
            body.held = self.held
        self.body = body
        self.added = scene.added_gaps()
        self.pressed_before = np.zeros_like(before)  # forces of contact when it began
        self.points = []  # (pair index, row, obstacle)
        self.surfaces = [Surface(scene, pair) for pair in scene.pairs]
        self.freedom = Freedom(scene, self.held)
        self.kept = set()  # points that had a place on a surface
        self.left_out = set()  # points that are not to press
        for index, pair in enumerate(scene.pairs):
            obstacle = None if pair.obstacle is None else scene.obstacles[pair.obstacle]
            for row in scene.side_rows(pair.part, pair.side):
                self.points.append((index, int(row), obstacle, pair.friction))

    # -- geometry -----------------------------------------------------------------------------

    def obstacle_now(self, obstacle):
        """An obstacle, turned as it is at the end of the increment."""
        at = obstacle.reference
        if at is None:
            return obstacle
        return turned(obstacle, self.rotations[1][at], self.scene.points[at])

    def face(self, surface, none, u):
        """Seen nodes of a pair; what is held with its weights joins `none`, rows without a row."""
        while True:
            seen = surface.place(u, self.rotations[1], none)
            held = held_with_their_weights(surface, self.freedom, seen, LEFT[1])
            more = {int(row) for row in seen.rows[held]} - none
            if not more:
                return seen
            none |= more

    def place(self, u):
        """Rows B (3P, n) in frames at `u`, frames, gaps, and which rows count."""
        count = len(self.points)
        b = np.zeros((3 * count, u.size))
        frames = np.zeros((count, 3, 3))
        gaps = np.zeros(count)
        counts = np.ones((count, 3), dtype=bool)
        self.partner = np.zeros((count, len(u)))  # what part each node has in the master's motion
        self.drag = np.zeros((count, 3))
        answers = [points_that_cannot_part(s, self.freedom, u, self.rotations[1])
                   if s.has_faces else {} for s in self.surfaces]  # fmt: skip
        self.without_row = [{row for row, one in of.items() if one[1]} for of in answers]
        seen = [self.face(s, none, u) if s.has_faces else None
                for s, none in zip(self.surfaces, self.without_row, strict=True)]  # fmt: skip
        for p, (index, row, obstacle, mu) in enumerate(self.points):
            mirror = np.zeros(3)
            if obstacle is not None and obstacle.reference is not None:
                self.partner[p, obstacle.reference] = 1.0
            if seen[index] is None:
                gap, normal, _ = locate(
                    self.obstacle_now(obstacle), self.scene.points[[row]], u[[row]],
                    shift_of(obstacle, u), self.added[row],
                )  # fmt: skip
                gaps[p], normal = gap[0], normal[0]
            else:
                gaps[p], normal, mirror, counts[p] = self.before_surface(p, seen[index], u)
            if obstacle is not None and obstacle.reference is not None:
                self.drag[p] = self.drag_of(obstacle, p, u)
            movable = ~self.held[row] & (mirror == 0)
            others = np.flatnonzero(self.partner[p])
            movable = movable | ((~self.held[others]).any(axis=0) & (mirror == 0))
            if row in answers[index]:
                movable = movable & ~answers[index][row][3]
            frames[p] = frame_of(normal, movable)
            for k in range(3):
                b[3 * p + k, 3 * row : 3 * row + 3] += frames[p, k]
                for other in others:
                    b[3 * p + k, 3 * other : 3 * other + 3] -= self.partner[p, other] * frames[p, k]
            reach = np.linalg.norm(frames[p] * movable, axis=1) > 1e-9
            if not reach[0]:
                counts[p] = False
            elif mu == 0:
                counts[p, 1:] = False
            counts[p] &= np.abs(frames[p] @ mirror) < 0.5
            counts[p] &= p not in self.left_out
        return self.body.reduced(b.T).T, frames, gaps, counts

    def before_surface(self, p, seen, u):
        """(gap, normal, mirror, whether it counts) of a point before a surface."""
        index, row, obstacle, _ = self.points[p]
        at = int(np.flatnonzero(seen.rows == row)[0])
        share = seen.share[at]
        if row in self.without_row[index]:
            return 0.0, np.eye(3)[2], np.zeros(3), False
        counts = share > (LEAST_KEPT if p in self.kept else LEAST_SHARE)
        mirror = np.zeros(3) if seen.mirror is None else seen.mirror[at]
        if not counts:
            return 0.0, np.eye(3)[2], mirror, False
        self.kept.add(p)
        self.partner[p] += seen.weights[at] if obstacle is None else seen.own[at]
        if obstacle is None and self.scene.pairs[index].small:
            gap = seen.gap[at] + seen.normal[at] @ (u[row] - seen.weights[at] @ u)
        else:
            gap = seen.gap[at]
        return gap + self.added[row], seen.normal[at], mirror, True

    def drag_of(self, obstacle, p, u):
        """What the turn of an obstacle adds to the way of a point against it, (9.8)."""
        at = obstacle.reference
        old, new = (r[at] for r in self.rotations)
        if not (np.any(old) or np.any(new)):
            return np.zeros(3)
        # What the row has of other nodes of its slave; the reference node is the obstacle's.
        own = self.partner[p].copy()
        own[at] = 0.0

        def at_row(values):
            return values[self.points[p][1]] - own @ values

        before = self.before
        way = chords(at_row(self.scene.points)[None], (at_row(before) - before[at])[None],
                     (at_row(u) - u[at])[None], self.scene.points[at], old, new)[0]  # fmt: skip
        return way - (at_row(u - before) - (u - before)[at])

    def relative(self, u):
        """Motions (P, 3) of the points from the start of the increment, less their masters'.

        As they were placed last.
        """
        moved = u - self.before
        rows = np.array([row for _, row, _, _ in self.points], dtype=int)
        return moved[rows] - self.partner @ moved + self.drag

    # -- solution -----------------------------------------------------------------------------

    def solve(self, tolerance, seed=0, seconds=20.0):
        """The best Solution found; after so many of the processor nothing new is begun."""
        deadline = time.process_time() + seconds
        rng = np.random.default_rng(seed)
        u = np.where(self.held, self.target, self.before)
        force = np.zeros((len(self.points), 3))
        curved = any(o is None or o.kind != "PLANE" for _, _, o, _ in self.points)
        curved = curved or np.any(self.rotations[1])
        best, close = None, 0
        for _ in range(40 if curved else 4):
            problem = Problem(self, u, force)
            r, a, residual, drift = problem.solve(tolerance, rng, deadline)
            new, force = problem.displacements(r, a), problem.forces(r)
            moved = np.abs(new - u).max()
            done = residual <= tolerance
            if best is None or done or residual < best.residual:
                best = Solution(new, self.by_pair(force), done, residual, drift)
            if drift > 0 or time.process_time() > deadline:
                best.drift = drift
                break
            u = new
            # Once more from where nothing moves: that is refinement.
            size = max(np.abs(u - self.before).max(), np.ptp(u, axis=0).max())
            close += moved <= 1e-9 * size
            if close == 3:
                break
        return best

    def by_pair(self, force):
        """Forces (P, 3) of all points as a list, a pair each."""
        index = np.array([i for i, *_ in self.points], dtype=int)
        return [force[index == i] for i in range(len(self.scene.pairs))]


def frame_of(normal, movable):
    """Rows n, t1, t2; a tangent along which nothing can move is one of them."""
    across = np.eye(3) - np.outer(normal, normal)
    *_, v = np.linalg.svd(across @ np.diag(movable.astype(float)) @ across + 1e-3 * across)
    first = v[0] - normal * (v[0] @ normal)
    first /= np.linalg.norm(first)
    return np.array([normal, first, np.cross(normal, first)])


class Contact:
    """Reactions r (n) and motions a (m) of x = W r + G a + x_0 and G^T r + q = 0 in the law.

    `sizes` are the forces of the bodies, `of` the body of each row of r and of each motion: a small
    body beside a large one is solved to its own measure.
    """

    def __init__(self, w, g, x, q, mu, counts, sizes, of):
        self.w, self.g, self.x, self.q = w, g, x, q
        self.mu, self.counts, self.sizes, self.of = mu, counts, sizes, of
        blocks = np.einsum("pkpk->p", w.reshape(len(mu), 3, len(mu), 3))
        if not g.size:
            soft = np.median(blocks[blocks > 0]) if np.any(blocks > 0) else 1.0
        else:
            soft = self.soft()
            blocks = blocks + self.theta() * (g.reshape(len(mu), 3, -1) ** 2).sum(axis=(1, 2))
        self.rho = 1 / np.where(blocks > 0, blocks, soft)

    def soft(self):
        """A typical compliance."""
        diagonal = np.diag(self.w)
        positive = diagonal[diagonal > 0]
        return float(np.median(positive)) if len(positive) else 1.0

    def theta(self):
        """How stiffly the proximal iteration holds rigid motions at first."""
        largest = (self.g**2).sum(axis=1).max(initial=0.0)
        return 3 * self.soft() / largest if largest > 0 else 0.0

    def natural_map(self, r, x):
        """Z (3P,) of Alart and Curnier; 0 at a solution."""
        r, x = r.reshape(-1, 3), x.reshape(-1, 3)
        y = r - self.rho[:, None] * x
        normal = np.maximum(0, y[:, 0])
        radius = self.mu * normal
        size = np.linalg.norm(y[:, 1:] * self.counts[:, 1:], axis=1)
        share = np.where(size > radius, radius / np.where(size > 0, size, 1), 1.0)
        out = r - np.column_stack([normal, share[:, None] * y[:, 1:]])
        return np.where(self.counts, out, r).ravel()

    def residual(self, r, a):
        """Size of what is not fulfilled, over that of the forces."""
        z = self.natural_map(r, self.w @ r + self.g @ a + self.x)
        e = self.g.T @ r + self.q
        return float(np.linalg.norm(np.concatenate([z, e]) / self.scale(r)))

    def scale(self, r):
        """The measure (n + m) of each equation: the largest force of its body."""
        sizes = self.sizes.copy()
        np.maximum.at(sizes, self.of[: len(r)], np.abs(r))
        return sizes[self.of]

    def projection_slopes(self, y):
        """Derivative (3P, 3P) of the projection at y = r - rho x."""
        n = y.size
        p = np.zeros((n, n))
        for i, (one, mu) in enumerate(zip(y.reshape(-1, 3), self.mu, strict=True)):
            if not self.counts[i, 0] or one[0] <= 0:
                continue
            block = np.zeros((3, 3))
            block[0, 0] = 1.0
            radius = mu * one[0]
            both = self.counts[i, 1:].astype(float)
            t = one[1:] * both
            length = np.hypot(*t)
            if length <= radius:
                block[1:, 1:] = np.diag(both)
            else:
                t = t / length
                side = np.eye(2) - np.outer(t, t)
                block[1:, 1:] = radius / length * side * np.outer(both, both)
                block[1:, 0] = mu * t
            p[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = block
        return p

    def newton(self, r, a, goal, limit=60):
        """Semi-smooth Newton steps from (r, a); (r, a, residual) of the best."""
        n, m = len(r), len(a)
        unit = self.rho.repeat(3)
        best = current = (r, a, self.residual(r, a))
        for _ in range(limit):
            r, a, size = current
            if size <= goal:
                break
            x = self.w @ r + self.g @ a + self.x
            p = self.projection_slopes(r - unit * x)
            across = p * unit[None, :]
            matrix = np.block([[np.eye(n) - p + across @ self.w, across @ self.g],
                               [self.g.T, np.zeros((m, m))]])  # fmt: skip
            right = -np.concatenate([self.natural_map(r, x), self.g.T @ r + self.q])
            measure = self.scale(r)
            matrix = matrix / measure[:, None]
            columns = np.linalg.norm(matrix, axis=0)
            columns[columns == 0] = 1.0
            step = np.linalg.lstsq(matrix / columns, right / measure, rcond=1e-13)[0] / columns
            trials = []
            for share in (1.0, 0.5, 0.25, 0.1, 0.02):
                trial = (r + share * step[:n], a + share * step[n:])
                trials.append((*trial, self.residual(*trial)))
                if trials[-1][2] < (1 - 0.1 * share) * size:
                    break
            current = min(trials, key=lambda t: t[2])
            if not np.isfinite(current[2]):
                break
            if current[2] < best[2]:
                best = current
            elif current[2] >= size:
                break
        return best

    def sweep(self, r, sweeps):
        """Gauss-Seidel projections without motions."""
        r = r.copy()
        for _ in range(sweeps):
            for p in range(len(self.mu)):
                if not self.counts[p, 0]:
                    continue
                at = slice(3 * p, 3 * p + 3)
                x = self.w[at] @ r + self.x[at]
                y = r[at] - self.rho[p] * np.where(self.counts[p], x, 0)
                normal = max(0.0, y[0])
                tangent = y[1:] * self.counts[p, 1:]
                size, radius = np.hypot(*tangent), self.mu[p] * normal
                if size > radius:
                    tangent = tangent * (radius / size)
                r[at] = (normal, *tangent)
        return r

    def held(self, centre, theta):
        """The same with rigid motions held by springs 1/theta at `centre`: no motions are left."""
        w = self.w + theta * self.g @ self.g.T
        x = self.x + self.g @ (centre + theta * self.q)
        off = ~self.counts.ravel()
        w[off], w[:, off] = 0, 0
        nothing = np.zeros((len(x), 0))
        of = self.of[: len(x)]
        return Contact(w, nothing, x, np.zeros(0), self.mu, self.counts, self.sizes, of)

    def solve_held(self, r, goal, sweeps):
        """(r, residual) where there are no motions."""
        nothing = np.zeros(0)
        best = self.newton(r, nothing, goal)
        for attempt in range(4):
            if best[2] <= goal:
                break
            found = self.newton(self.sweep(best[0], sweeps * 2**attempt), nothing, goal)
            if found[2] < best[2]:
                best = found
        return best[0], best[2]

    def proximal(self, r, a, goal, deadline, steps=50, sweeps=50):
        """Springs that follow the motions: (r, a, residual, how far the motions ran away).

        Where the springs' forces do not vanish however far they follow, loads push on for ever.
        """
        theta, drift = self.theta(), 0.0
        best = (r, a, self.residual(r, a))
        if not self.g.size:
            r, left = self.solve_held(r, goal, 4 * sweeps)
            return r, a, left, 0.0
        for step in range(steps):
            r, left = self.held(a, theta).solve_held(r, goal, sweeps)
            e = self.g.T @ r + self.q
            a = a + theta * e
            size = self.residual(r, a)
            if size < best[2]:
                best = (r, a, size)
            if size <= goal or time.process_time() > deadline:
                break
            if left <= 1e3 * goal and np.linalg.norm(e) > 1e-6 * np.linalg.norm(self.q):
                drift = max(drift, float(np.linalg.norm(self.g @ a, np.inf)))
            else:
                drift = 0.0
            theta *= 3 if step % 3 == 2 else 1
        return (*best, drift)


class Problem(Contact):
    """The contact problem of an increment, linearised at displacements `u`."""

    def __init__(self, increment, u, force):
        """`force` (P, 3): reactions that act at `u` already; the new ones are found beside them."""
        self.increment = increment
        body, scene = increment.body, increment.scene
        elements = scene.elements()
        b, self.frames, gaps, counts = increment.place(u)
        off = ~counts.ravel()
        self.known = np.where(counts, np.einsum("pki,pi->pk", self.frames, force), 0.0).ravel()
        pressed = body.reduced(increment.loads.ravel()) + b.T @ self.known
        # Displacements under loads, supports and these reactions, refined: stiff parts move far.
        base = np.where(increment.held, increment.target, u).ravel()
        if body.follow is not None:
            base = body.complete(base.reshape(u.shape)).ravel()
        elastic = elements.internal_force(base.reshape(u.shape))
        q = body.motions.T @ body.reduced((increment.loads - elastic).ravel())
        # Less than this is rounding of loads that balance, motion by motion: bodies differ.
        behind = body.reduced((np.abs(increment.loads) + np.abs(elastic)).ravel())
        behind = np.abs(body.motions).T @ behind
        q[np.abs(q) <= 1e-13 * behind] = 0.0
        for _ in range(3):
            left = pressed - body.reduced(elements.internal_force(base.reshape(u.shape)).ravel())
            base += body.spread(body.solve(body.balanced(left)))
        self.base = base.reshape(u.shape)
        acting = np.maximum(np.abs(increment.loads), np.abs(elements.internal_force(self.base)))
        self.response = body.solve(b.T)
        w = b @ self.response
        relative = increment.relative(self.base)
        x = np.einsum("pki,pi->pk", self.frames, relative)
        x[:, 0] = gaps + np.einsum("pi,pi->p", self.frames[:, 0], relative - increment.relative(u))
        g = b @ body.motions
        # Rows that do not count have no reaction.
        w[off], w[:, off], g[off] = 0, 0, 0
        mu = np.array([mu for *_, mu in increment.points])
        groups = [*scene.tied_bodies(), *[np.array([r]) for r in scene.references()]]
        group = np.full(len(u), -1)
        for number, rows in enumerate(groups):
            group[rows] = number
        every = np.repeat([group[row] for _, row, _, _ in increment.points], 3).astype(int)
        owners = group[body.free[np.abs(body.motions).argmax(axis=0)] // 3]
        self.of = np.concatenate([every, owners]).astype(int)
        # Beside nothing that acts yet: what rounding makes of a motion.
        moved = np.abs(self.base - increment.before).max() + np.abs(x).max(initial=0.0)
        diagonal = np.diag(w)
        sizes = np.zeros(len(groups))
        for number, rows in enumerate(groups):
            soft = diagonal[(every == number) & (diagonal > 0)]
            floor = 1e-10 * moved / np.median(soft) if len(soft) else 0.0
            sizes[number] = max(acting[rows].max(), floor)
        sizes[sizes == 0] = sizes.max() or 1.0
        super().__init__(w, g, x.ravel() - w @ self.known, q, mu, counts, sizes, self.of)

    def solve(self, tolerance, rng, deadline):
        """(r, a, residual, drift), the best of several starts."""
        n = len(self.x)
        r, a = self.known, np.zeros(self.g.shape[1])
        goal = 0.01 * tolerance
        if not self.counts.any():
            # It has gone so far that nothing faces it any more, and loads push it on.
            left = self.residual(r, a)
            far = np.abs(self.base - self.increment.before).max()
            return r, a, left, float(far) if left > goal else 0.0
        # To rounding: bodies with small forces have no part in the largest.
        best = self.newton(r, a, 1e-3 * goal)
        drift = 0.0
        for attempt in range(4):
            if best[2] <= goal or drift > 0 or time.process_time() > deadline:
                break
            start = (np.zeros(n), np.zeros_like(a)) if attempt == 0 else best[:2]
            if attempt == 2:
                start = (start[0] * (1 + 0.1 * rng.normal(size=n)), start[1])
            sweeps = 30 * (attempt + 1)
            *found, drift = self.proximal(*start, goal, deadline, sweeps=sweeps)
            if drift == 0:
                found = self.newton(*found[:2], 1e-3 * goal)
            if found[2] < best[2]:
                best = tuple(found)
        return (*best, drift if best[2] > goal else 0.0)

    def displacements(self, r, a):
        """All displacements (N, 3)."""
        u = self.base.ravel().copy()
        body = self.increment.body
        u += body.spread(self.response @ (r - self.known) + body.motions @ a)
        return u.reshape(self.base.shape)

    def forces(self, r):
        """Reactions in space (P, 3)."""
        local = np.where(self.counts, r.reshape(-1, 3), 0.0)
        # Exactly in their cones; rounding is none.
        rounding = 1e-14 * self.scale(r)[: len(r) : 3]
        local[:, 0] = np.where(local[:, 0] > rounding, local[:, 0], 0.0)
        size = np.linalg.norm(local[:, 1:], axis=1)
        radius = self.mu * local[:, 0]
        local[:, 1:] *= np.where(size > radius, radius / np.where(size > 0, size, 1), 1)[:, None]
        return np.einsum("pk,pki->pi", local, self.frames)
