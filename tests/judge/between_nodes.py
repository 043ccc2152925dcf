"""What the laws of contact do not see of surfaces: overlaps between nodes, what is covered."""

import numpy as np
from mortar import TURNED, hull_of_overlap, normal_of, place_surface
from obstacles import corners_at
from surfaces import Surface

LEAST_SEEN = 1.01e-4  # of a node's area: less may be the digits of a deck


def ends_of_steps(stored):
    """The last row of each step."""
    rows = range(stored.finished)
    return [r for r in rows if r + 1 == stored.finished or stored.step[r + 1] != stored.step[r]]


def unfelt_overlap(scene, stored):
    """How deep slave faces are in master faces near which no node touches, of the displacements.

    Contact is a matter of means over the faces about a node, and what lies between the nodes may be
    missed by all of them. At the end of each step.
    """
    deepest = 0.0
    for row in ends_of_steps(stored):
        u = stored.u[row]
        size = np.abs(u).max()
        for pair in scene.pairs:
            surface = Surface(scene, pair)
            if size == 0 or not surface.has_faces:
                continue
            held = stored.pairs[scene.key_of(pair)]
            touches = np.abs(held["reaction"][row]).max(axis=1) > 0
            touches |= np.abs(held["gap"][row]) <= 10 * scene.tolerance * size
            slave, master = surface.slave, surface.master
            # With small sliding faces stay before what they face in the undeformed mesh.
            x, way = (stored.places, u) if surface.stays else (stored.places + u, None)
            y = x
            if surface.obstacle is not None:
                at = surface.obstacle.reference
                moved = (0, 0, 0) if at is None else (
                    u[at], stored.rotation[row][at], scene.points[at])  # fmt: skip
                y = corners_at(surface.obstacle, *moved)
            seen = place_surface(slave, x, master, y)
            counts = set(seen.rows[seen.share > LEAST_SEEN].tolist())
            near = set(held["rows"][touches].tolist())
            near |= {node for face in slave if near & set(face) for node in face}
            dents = {}
            for face in slave:
                added = max(scene.added_gaps()[list(face)])
                one = place_surface([face], x, master, y, moved=way)
                depth = -one.least.min() - added
                if depth > 10 * scene.tolerance * size and counts & set(face):
                    dents[face] = depth
            grown = True
            while grown:
                grown = [face for face in dents if near & set(face)]
                for face in grown:
                    near |= set(face)
                    del dents[face]
            deepest = max([deepest, *(depth / size for depth in dents.values())])
    return deepest


def covered_corners(slave, x, master):
    """The corners (n, 3) of what slave faces share with master faces, in the slave's faces."""
    found = []
    for face in slave:
        places = x[list(face)]
        n, middle = normal_of(places), places.mean(axis=0)
        *_, across = np.linalg.svd(n[None])
        plane = across[1:].T if np.linalg.det(np.vstack([across[1:], n])) > 0 else across[:0:-1].T
        flat = (places - middle) @ plane
        for other in master:
            there = x[list(other)]
            if n @ normal_of(there) <= TURNED:
                seen = (there - middle) @ plane
                found.append(middle + hull_of_overlap(flat, seen[::-1]) @ plane.T)
    return np.vstack(found)
