"""Whether a run at finite strain that was refused has no solution, by other means."""

import re
from itertools import product

import numpy as np
from elements import REAL
from laws import Judge
from obstacles import locate, shift_of, turned
from refusals import CONFIRMED, OPEN, REFUTED, interval, path_to


def confirm_finite(scene, stored, message):
    """(confirmed, refuted or unconfirmed; words) for a refusal with exit status 2."""
    where = interval(scene, stored, message)
    if where is None:
        where = (len(scene.steps) - 1, scene.steps[-1].period, 0.0, stored.u[-1])
    if "is prescribed to move" in message:
        words = prescribed_depth(scene, stored, where)
        if words:
            return CONFIRMED, words
    told = re.search(r"law of material M(\d+) .* stretched by (\S+), (\S+) and (\S+):", message)
    if told:
        which = np.flatnonzero(scene.material == int(told[1]))[0]
        least = np.inf
        for stretches in product(*(within_digits(x) for x in told.groups()[1:])):
            h = np.tile(np.diag(stretches) - np.eye(3), (len(scene.nodes), 1, 1, 1))
            least = min(least, scene.elements().least_acoustic_at(h.astype(REAL), which))
        if least < 0:
            return CONFIRMED, f"at these stretches an acoustic tensor has an eigenvalue {least:.2g}"
        return REFUTED, f"at these stretches the law is elliptic: {least:.2g}"
    if stored is not None and stored.finished:
        least, sticking = least_stiffness(scene, stored)
        if least < 0:
            how = "whatever sticks" if sticking else "where nothing rubs"
            return CONFIRMED, f"the tangent has an eigenvalue of {least:.2g} of the largest, {how}"
        least = scene.elements().least_acoustic(stored.u[-1])
        if least < 0:
            return CONFIRMED, f"an acoustic tensor has an eigenvalue of {least:.2g}"
    return OPEN, "not shown to have no solution"


def within_digits(text):
    """The least, the middle and the largest number that is told so."""
    half = 0.5 * 10.0 ** -len(text.partition(".")[2])
    return [float(text) + k * half for k in (-1, 0, 1)]


def prescribed_depth(scene, stored, where):
    """Words on a node that cannot leave an obstacle it is prescribed to enter; or None."""
    step, time, _, before = where
    supports = path_to(scene, stored, step).supports(time)
    u, rotation, held = before.copy(), np.zeros_like(before), np.zeros(before.shape, dtype=bool)
    for (row, dof), (value, *_) in supports.items():
        if dof < 3:
            u[row, dof], held[row, dof] = value, True
        else:
            rotation[row, dof - 3] = value
    added = scene.added_gaps()
    for pair in scene.pairs:
        if pair.obstacle is None:
            continue
        obstacle = scene.obstacles[pair.obstacle]
        at = obstacle.reference
        here = obstacle if at is None else turned(obstacle, rotation[at], scene.points[at])
        rows = scene.side_rows(pair.part, pair.side)
        gap, normal, rounding = locate(
            here, scene.points[rows], u[rows], shift_of(obstacle, u), added[rows]
        )
        fixed = held[rows] if at is None else held[rows] & held[at]
        blocked = np.linalg.norm(np.where(fixed, 0.0, normal), axis=1) < 1e-9
        deep = np.where(blocked, gap + rounding, 0.0)
        if deep.min() < 0:
            node = scene.ids[rows[np.argmin(deep)]]
            return f"node {node} is prescribed to a gap of {gap[np.argmin(deep)]:.2g}"
    return None


def least_stiffness(scene, stored):
    """(least eigenvalue beside the largest, whether all that presses sticks) at the last increment.

    Of the tangent over the motions that supports and points that press let. Where it is not
    negative with all such points stuck, they may slide; curvature of surfaces is left out.
    """
    row = stored.finished - 1
    u = stored.u[row]
    judge = Judge(scene, stored)
    path = path_to(scene, stored, int(stored.step[row]) - 1)
    held = np.zeros(u.shape, dtype=bool)
    for node, dof in path.prescribed:
        if dof < 3:
            held[node, dof] = True
    mesh = np.unique(scene.nodes)
    free = [3 * r + i for r in mesh for i in range(3) if not held[r, i]]
    k = scene.elements().tangent(u)[np.ix_(free, free)]
    largest = np.abs(np.linalg.eigvalsh(k)).max()
    judge.freedom = None
    judge.path = path
    before = stored.u[row - 1] if row else np.zeros_like(u)
    judge.judge_increment(row, 0.0, before, stored.rotation[row - 1] if row else None)
    least = 0.0
    for sticking in (True, False):
        rows = contact_rows(scene, judge, (row, u, before, held), sticking)[:, free]
        left = k
        if len(rows):
            _, size, basis = np.linalg.svd(rows)
            motions = basis[np.sum(size > 1e-9 * size[0]) :].T
            left = motions.T @ k @ motions
        least = np.linalg.eigvalsh(left)[0] / largest if len(left) else 0.0
        if least < -1e-10:
            return least, sticking
    return 0.0, False


def contact_rows(scene, judge, state, sticking):
    """Rows (n, 3N) of what points that press hold: their normals, or all directions."""
    row, u, before, held = state
    turned_before = judge.stored.rotation[max(row - 1, 0)]
    rows = [np.zeros(u.size)]
    for p in judge.points_of(row, u, before, held, turned_before):
        strength = np.linalg.norm(p["force"], axis=1)
        for at in np.flatnonzero(strength > 1e-6 * strength.max(initial=0.0)):
            own = np.zeros(len(u))
            own[p["rows"][at]] = 1.0
            if p["master"] is not None:
                own -= p["master"][at]
            for way in np.eye(3) if sticking else p["normal"][at][None]:
                rows.append(np.outer(own, way).ravel())
    return np.array(rows)
