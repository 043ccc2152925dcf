"""An increment of a scene of mixed.py solved anew: whether there is a solution where it is refused.

Reactions by Gauss-Seidel sweeps over the points, of each the projection on Coulomb's cone, on the
compliance of the dense stiffness; points are placed again until they stay. Where it finds nothing,
that proves nothing.
"""

import numpy as np


def frames(normals):
    """(P, 3, 3): rows n, t1, t2."""
    out = []
    for n in normals:
        first = np.eye(3)[np.argmin(np.abs(n))]
        first = first - n * (n @ first)
        first /= np.linalg.norm(first)
        out.append((n, first, np.cross(n, first)))
    return np.array(out)


def project(y, mu):
    """The closest point of Coulomb's cone."""
    size = np.linalg.norm(y[1:])
    if mu * size <= -y[0]:
        return np.zeros(3)
    if size <= mu * y[0]:
        return y
    normal = (y[0] + mu * size) / (1 + mu * mu)
    return np.array([normal, *(mu * normal * y[1:] / size)])


def sweep(compliance, free, mu, reaction, tolerance=1e-9, most=4000):
    """Reactions (P, 3) with x = W r + free in the laws, and how far from that they are."""
    count = len(reaction)
    blocks = compliance.reshape(count, 3, count, 3)
    rho = np.array([1 / np.linalg.norm(blocks[p, :, p], 2) for p in range(count)])
    for _ in range(most):
        change = 0.0
        for p in range(count):
            r = reaction[p]
            x = blocks[p].reshape(3, -1) @ reaction.ravel() + free[p]
            for _ in range(10):
                # The bi-potential: x* = x + mu |x_t| n.
                way = x.copy()
                way[0] += mu * np.linalg.norm(x[1:])
                new = project(r - rho[p] * way, mu)
                x = x + blocks[p, :, p] @ (new - r)
                change = max(change, np.abs(new - r).max())
                r = new
            reaction[p] = r
        if change <= tolerance * max(np.abs(reaction).max(), 1e-300):
            return reaction, True
    return reaction, False


def solve_increment(scene, k, before, place_points, tie):
    """Displacements (N, 3) at the end of increment k, which begins at `before`; None: not found.

    `place_points(u, free)` gives C (P, N), gaps and normals of the points at u.
    """
    follow, half, flexibility = scene.factor(tie)
    free = scene.free_motion(k, tie)
    held = np.zeros(len(free), dtype=bool)
    held[scene.top] = held[scene.rest] = True
    if not scene.has_loads:  # not a motion of the body as a whole: contact may have turned it
        load = np.zeros_like(free)
        load[held] = free[held]
        free_u = load + (follow @ (flexibility @ (-load.ravel() @ half))).reshape(-1, 3)
    else:
        free_u = free
    u, reaction = before.copy(), None
    u[held] = free[held]
    length = np.abs(free).max()
    for _ in range(40):
        combination, gap, normal = place_points(u, free)
        frame = frames(normal)
        rows = np.einsum("pki,pn->pkni", frame, combination).reshape(3 * len(gap), -1)
        moved = rows @ follow
        compliance = moved @ flexibility @ moved.T
        at_free = (rows @ (free_u - u).ravel()).reshape(-1, 3)
        at_free[:, 0] += gap
        at_free[:, 1:] += (rows @ (u - before).ravel()).reshape(-1, 3)[:, 1:]
        if reaction is None:
            reaction = np.zeros_like(at_free)
        reaction, converged = sweep(compliance, at_free, scene.mu, reaction)
        if not converged:
            return None
        new = free_u + (follow @ (flexibility @ (moved.T @ reaction.ravel()))).reshape(-1, 3)
        far = np.abs(new - u).max()
        u = new
        if far <= 1e-7 * length:
            return u
    return None
