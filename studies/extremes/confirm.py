"""Confirm by other means that a scene which the program refuses cannot be solved as it was asked.

Nothing of the program is used: linear programming for the balance of bodies, dense matrices for the
digits that double precision leaves.
"""

import numpy as np
from scipy.optimize import linprog, nnls

from studies.extremes.judge import prescribed_at, rounding_of
from studies.extremes.scenes import CYLINDER, PLANE, SPHERE, corner_jacobian, stiffness

EPS = np.finfo(float).eps


def confirm(scene, cause):
    """Return (whether the refusal is right, what was found) for one of judge.CAUSES."""
    if cause == "deck refused":
        least = min(corner_jacobian(scene.points[nodes]) for nodes in scene.elements)
        return least <= 0, f"least Jacobian at a corner {least:.1e}"
    if cause == "nothing balances":
        left = unbalanced_share(scene)
        return left > 0.1 * scene.tolerance, f"reactions leave {left:.1e} of the loads unbalanced"
    if cause == "prescribed into an obstacle":
        return True, "prescribed so by the scene"
    if cause == "contact missed":
        return passes_between_nodes(scene)
    if cause == "inside out":
        least = least_volume(scene)
        return least <= 0, f"least Jacobian as displaced, without friction: {least:.1e}"
    if cause == "begins too deep":
        depth = -min(undeformed_gaps(scene).values())
        edge = min(np.ptp(scene.points[nodes], axis=0).min() for nodes in scene.elements)
        return depth >= edge, f"a node begins {depth:.1e} deep, elements are {edge:.1e} thick"
    lost, words = lost_digits(scene)
    return lost > 0.1 * scene.tolerance, words


def passes_between_nodes(scene):
    """Whether a sphere below the body is nearer to a face of it than any of its nodes ever gets."""
    for pair in scene.pairs:
        obstacle = scene.obstacles[pair.obstacle]
        if obstacle.kind != SPHERE or obstacle.inner:
            continue
        across = scene.points[pair.nodes, :2] - np.asarray(obstacle.point)[:2]
        nearest = np.linalg.norm(across, axis=1).min()
        is_below = np.all(across.min(axis=0) < 0) and np.all(across.max(axis=0) > 0)
        if is_below and nearest > 2 * obstacle.radius:
            return True, f"the nodes pass at {nearest:.1e} from a sphere of {obstacle.radius:.1e}"
    return False, "no sphere lies between the nodes"


def undeformed_gaps(scene):
    """Gaps of the undeformed mesh before planes, by (pair, row of the point)."""
    return {
        (i, at): float(
            (scene.points[at] - np.asarray(scene.obstacles[pair.obstacle].point))
            @ locate(scene.obstacles[pair.obstacle], scene.points[[at]])[0]
        )
        + scene.gaps.get(at, 0.0)
        for i, pair in enumerate(scene.pairs)
        for at in map(int, pair.nodes)
        if scene.obstacles[pair.obstacle].kind == PLANE
    }


def least_volume(scene):
    """Return the least determinant of a displaced element at a corner over the increments.

    Of the solution without friction before fixed planes, a problem of non-negative least squares in
    the reactions; weak springs stand for what friction alone would hold.
    """
    k = stiffness(scene)
    k += 1e-6 * np.abs(np.diag(k)).max() * np.eye(len(k))
    gaps = undeformed_gaps(scene)
    rows = np.zeros((len(gaps), len(k)))
    for row, (i, at) in zip(rows, gaps, strict=True):
        obstacle = scene.obstacles[scene.pairs[i].obstacle]
        row[3 * at : 3 * at + 3] = locate(obstacle, scene.points[[at]])[0]
    least = np.inf
    for increment in range(sum(step.increments for step in scene.steps)):
        fixed, loads = prescribed_at(scene, increment)
        u = np.zeros(len(k))
        free = np.ones(len(k), dtype=bool)
        for (at, direction), value in fixed.items():
            u[3 * at + direction], free[3 * at + direction] = value, False
        inner = k[np.ix_(free, free)]
        u[free] = np.linalg.solve(inner, loads.ravel()[free] - k[np.ix_(free, ~free)] @ u[~free])
        gap = np.array(list(gaps.values())) + rows @ u
        moves = np.linalg.solve(inner, rows[:, free].T)
        compliance = rows[:, free] @ moves
        compliance += 1e-9 * np.diag(compliance).max() * np.eye(len(gap))
        root = np.linalg.cholesky(compliance)
        # 1/2 r.W r + r.g is least for r >= 0 where |L^T r + L^-1 g| is.
        u[free] += moves @ nnls(root.T, -np.linalg.solve(root, gap), maxiter=1000)[0]
        places = scene.points + u.reshape(-1, 3)
        least = min(least, *(corner_jacobian(places[nodes]) for nodes in scene.elements))
    return least


def locate(obstacle, points):
    """Normals (P, 3) of undeformed points before an obstacle."""
    arm = points - np.asarray(obstacle.point)
    if obstacle.kind == PLANE:
        return np.tile(
            np.asarray(obstacle.direction) / np.linalg.norm(obstacle.direction), (len(points), 1)
        )
    if obstacle.kind == CYLINDER:
        axis = np.asarray(obstacle.direction) / np.linalg.norm(obstacle.direction)
        arm = arm - np.outer(arm @ axis, axis)
    normal = arm / np.linalg.norm(arm, axis=1)[:, None]
    return -normal if obstacle.inner else normal


def tangents(normal):
    """Two unit vectors across a normal."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return first, np.cross(normal, first)


def bodies(scene):
    """The body of each point, -1 of a reference point of an obstacle."""
    body = np.full(len(scene.points), -1)
    for nodes in scene.elements:
        known = sorted({b for b in body[nodes] if b >= 0})
        body[nodes] = known[0] if known else body.max() + 1
        for other in known[1:]:
            body[body == other] = known[0]
    return body


def free_motions(scene, held):
    """Columns (3N, m): rigid motions that no support hinders, of bodies and reference points."""
    body = bodies(scene)
    columns = []
    for b in np.unique(body):
        for group in (
            [body == b]
            if b >= 0
            else [np.arange(len(body)) == r for r in np.flatnonzero(body == -1)]
        ):
            rows = np.flatnonzero(group)
            centre = scene.points[rows].mean(axis=0)
            size = np.ptp(scene.points[rows], axis=0).max() or 1.0
            modes = np.zeros((len(scene.points), 3, 6 if b >= 0 else 3))
            for i in range(3):
                modes[rows, i, i] = 1.0
            if b >= 0:
                for i in range(3):
                    modes[rows, :, 3 + i] = np.cross(
                        np.eye(3)[i], (scene.points[rows] - centre) / size
                    )
            modes = modes.reshape(-1, modes.shape[2])
            _, s, v = np.linalg.svd(modes[held]) if held.any() else (0, [], np.eye(modes.shape[1]))
            rank = int(np.sum(np.asarray(s) > 1e-9))
            columns.append(modes @ v[rank:].T)
    return np.hstack(columns)


def unbalanced_share(scene):
    """Return how much of the loads on free motions no admissible reactions balance, 0 to 1.

    The largest share over the increments. All points may press: what does not balance here balances
    nowhere.
    """
    worst = 0.0
    for row in range(sum(step.increments for step in scene.steps)):
        fixed, loads = prescribed_at(scene, row)
        held = np.zeros(loads.shape, dtype=bool)
        for at, direction in fixed:
            held[at, direction] = True
        motions = free_motions(scene, held.ravel())
        work = motions.T @ loads.ravel()
        if motions.shape[1] == 0 or np.abs(work).max() == 0:
            continue
        columns, frictions = [], []
        for pair in scene.pairs:
            obstacle = scene.obstacles[pair.obstacle]
            normals = locate(obstacle, scene.points[pair.nodes])
            for at, normal in zip(pair.nodes, normals, strict=True):
                for direction in (normal, *tangents(normal)):
                    force = np.zeros_like(loads)
                    force[at] = direction
                    if obstacle.reference is not None:
                        force[obstacle.reference] -= direction
                    columns.append(motions.T @ force.ravel())
                frictions.append(pair.mu)
        worst = max(worst, least_left(np.transpose(columns), np.array(frictions), work))
    return worst


def least_left(columns, mu, work):
    """Return the least |columns r + work| / |work| over reactions r in their cones (largest norm).

    Linear programs with more and more tangent planes of the cones: each is a lower bound.
    """
    points, m = len(mu), len(work)
    scale = np.abs(work).max()
    column = np.ones((m, 1))
    balance = np.block([[columns, -column], [-columns, -column]])
    sides = [np.linspace(0, 2 * np.pi, 8, endpoint=False) for _ in range(points)]
    bounds = [(0, None), (None, None), (None, None)] * points + [(0, None)]
    least = 0.0
    for _ in range(40):
        cuts = []
        for i in range(points):
            for angle in sides[i]:
                cut = np.zeros(3 * points + 1)
                cut[3 * i : 3 * i + 3] = (-mu[i], np.cos(angle), np.sin(angle))
                cuts.append(cut)
        found = linprog(
            np.append(np.zeros(3 * points), 1.0),
            A_ub=np.vstack([balance, cuts]),
            b_ub=np.concatenate([-work, work, np.zeros(len(cuts))]) / scale,
            bounds=bounds,
        )
        if found.status != 0:
            return np.inf
        least = float(found.x[-1])
        r = found.x[:-1].reshape(points, 3)
        size = np.hypot(r[:, 1], r[:, 2])
        over = np.flatnonzero(size - mu * r[:, 0] > 1e-12 * max(1.0, np.abs(r).max()))
        if len(over) == 0:
            break
        for i in over:
            sides[i] = np.append(sides[i], np.arctan2(r[i, 2], r[i, 1]))
    return least


def lost_digits(scene):
    """Return the relative error that double precision alone makes, and words for it.

    By the largest of: the condition of the stiffness (with a diagonal of 1), the condition of the
    compliance at the contact rows where it is regular, and what stored displacements hold of the
    forces.
    """
    steps = sum(step.increments for step in scene.steps)
    fixed, loads = prescribed_at(scene, steps - 1)
    held = np.zeros(loads.shape, dtype=bool)
    u = np.zeros_like(loads)
    for (at, direction), value in fixed.items():
        held[at, direction] = True
        u[at, direction] = value
    k = stiffness(scene)
    used = np.zeros(len(loads), dtype=bool)
    used[np.unique(scene.elements)] = True
    free = np.flatnonzero((~held & used[:, None]).ravel())
    matrix = k[np.ix_(free, free)]
    scale = 1 / np.sqrt(np.diag(matrix))
    scaled = matrix * np.outer(scale, scale)
    values = np.linalg.eigvalsh(scaled)
    # Free rigid motions are no loss of digits: contact holds them.
    values = values[values > 0]
    rigid = free_motions(scene, held.ravel()).shape[1]
    kept = np.sort(values)[rigid:] if rigid else values
    condition = kept.max() / kept.min()
    found = {"condition of the stiffness": condition * EPS}
    if rigid == 0:
        compliance = compliance_condition(scene, matrix, free)
        if compliance is not None:
            found["condition of the compliance"] = compliance * EPS
    reached = max(float(np.abs(loads).max()), least_force(scene, k, u, loads, free))
    if reached > 0:
        found["rounding of the displacements"] = rounding_of(scene, u) / 160 / reached
    name = max(found, key=found.get)
    return found[name], f"{name}: {found[name]:.1e}"


def least_force(scene, k, u, loads, free):
    """The largest nodal force of the body without friction, contact points with overlap pressed."""
    response = np.zeros(k.shape[0])
    right = loads.ravel() - k @ u.ravel()
    pressed = []
    for pair in scene.pairs:
        obstacle = scene.obstacles[pair.obstacle]
        for at, normal in zip(pair.nodes, locate(obstacle, scene.points[pair.nodes]), strict=True):
            row = np.zeros(k.shape[0])
            row[3 * at : 3 * at + 3] = normal
            pressed.append(row)
    rows = np.array(pressed)[:, free]
    try:
        solution = np.linalg.solve(k[np.ix_(free, free)], np.column_stack([right[free], rows.T]))
    except np.linalg.LinAlgError:
        return 0.0
    response[free] = solution[:, 0]
    gaps = np.array(pressed) @ (response + u.ravel())
    compliance = np.diag(rows @ solution[:, 1:])
    movable = compliance > 0
    return float(np.max(np.maximum(0, -gaps[movable]) / compliance[movable], initial=0))


def compliance_condition(scene, matrix, free):
    """Condition of the compliance at the contact rows with a diagonal of 1, None where singular."""
    rows = []
    for pair in scene.pairs:
        for at, normal in zip(
            pair.nodes,
            locate(scene.obstacles[pair.obstacle], scene.points[pair.nodes]),
            strict=True,
        ):
            for direction in (normal, *tangents(normal)) if pair.mu > 0 else (normal,):
                row = np.zeros(3 * len(scene.points))
                row[3 * at : 3 * at + 3] = direction
                rows.append(row[free])
    rows = np.array(rows)
    rows = rows[np.abs(rows).max(axis=1) > 0]
    compliance = rows @ np.linalg.solve(matrix, rows.T)
    scale = 1 / np.sqrt(np.diag(compliance))
    values = np.linalg.eigvalsh(compliance * np.outer(scale, scale))
    return values.max() / values.min() if values.min() > 0 else None
