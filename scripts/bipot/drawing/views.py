"""From where a picture is seen, and how far bodies are pulled apart in it."""

import numpy as np

from bipot.element_faces import face_normals

# The first view that is nearly as good as any is taken: from above, if the contact allows it.
DIRECTIONS = [(el, az) for el in (24.0, -24.0) for az in (-58.0, 32.0, -148.0, 122.0)]
ABOVE = DIRECTIONS[:4]
FRONT = (90.0, -90.0)  # of elements of a plane
NEARLY = 0.9
ROOM = 0.08  # between bodies that are pulled apart, of the size of all


def towards_the_eye(elevation, azimuth):
    """Return the unit vector from the bodies to the spectator."""
    elevation, azimuth = np.radians([elevation, azimuth])
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])


def components(blocks, count):
    """Return the number of the body (0, 1, ...) of each of `count` nodes.

    `blocks` are nodes of elements (n, k), an array for each cell.
    """
    label = np.arange(count)
    while True:
        least = label.copy()
        for nodes in blocks:
            np.minimum.at(least, nodes, label[nodes].min(axis=1)[:, None])
        least = least[least]
        if np.array_equal(least, label):
            break
        label = least
    return np.unique(label, return_inverse=True)[1]


class ContactFaces:
    """The slave faces of a pair: unit normals out of the body, and how much each counts."""

    def __init__(self, pair, points):
        self.pair = pair
        corners = points[pair.faces]
        self.normals = face_normals(corners)
        diagonals = corners[:, 2:] - corners[:, :2]
        area = np.linalg.norm(np.cross(diagonals[:, 0], diagonals[:, 1]), axis=1) / 2
        # What is never pressed hardly counts.
        pressed = np.zeros(len(points))
        pressed[pair.nodes] = (pair.reaction[:, :, 0] > 0).any(axis=0)
        self.weights = area * (1e-3 + pressed[pair.faces].mean(axis=1))

    def seen_by(self, eye):
        """Return how well the faces are seen, 0 to 1, times what they count."""
        return float(self.weights @ np.clip(self.normals @ eye, 0, None))

    def mean_normal(self):
        """Return the direction out of the body; of a surface that is closed, along its axis."""
        total = self.weights @ self.normals
        if np.linalg.norm(total) < 0.3 * self.weights.sum():
            spread = np.einsum("f,fi,fj->ij", self.weights, self.normals, self.normals)
            total = np.linalg.eigh(spread)[1][:, 0]
            total = -total * np.sign(total[np.argmax(np.abs(total))])
        return total / np.linalg.norm(total)


def pull_apart(points, body, surfaces, eye):
    """Return how far each node is moved so that bodies in contact hide nothing of each other.

    points    (N, 3) where the nodes are drawn
    body      (N,) number of the body
    surfaces  ContactFaces of the pairs between two bodies
    eye       the unit vector to the spectator

    Returns offsets (N, 3), and the largest of them; None where this view cannot show it.
    """
    count = body.max() + 1
    offset, placed = np.zeros((count, 3)), np.zeros(count, dtype=bool)
    size = np.ptp(points, axis=0).max()
    extent = [np.ptp(points[body == k], axis=0).prod() for k in range(count)]
    ways = []
    for surface in surfaces:
        slave, master = body[surface.pair.nodes[0]], body[surface.pair.master_nodes[0]]
        if slave != master and len(surface.normals):
            out = surface.mean_normal()
            ways += [(master, slave, -out), (slave, master, out)]
    placed[int(np.argmax(extent))] = True
    while True:
        way = next((w for w in ways if placed[w[0]] and not placed[w[1]]), None)
        if way is None:
            start = next((w[0] for w in ways if not placed[w[0]]), None)
            if start is None:
                break
            placed[start] = True  # another group of bodies
            continue
        _, new, direction = way
        across = direction - eye * (direction @ eye)  # on the screen
        length = np.linalg.norm(across)
        if length < 0.3:
            return None, np.inf
        across /= length
        group = [k for k in range(count) if placed[k]]
        front = max(((points[body == k] + offset[k]) @ across).max() for k in group)
        base = offset[way[0]]
        back = ((points[body == new] + base) @ across).min()
        pull = max(front - back + ROOM * size, 0.25 * size) / length
        offset[new] = base + pull * direction
        placed[new] = True
    _keep_with_neighbours(points, body, placed, offset)
    return offset[body], float(np.linalg.norm(offset, axis=1).max())


def _keep_with_neighbours(points, body, placed, offset):
    """Move bodies that touch no other one (ties hold them) with the nearest that is placed."""
    if placed.sum() < 2:
        return
    low, high = (np.array([edge(points[body == k], axis=0) for k in range(len(offset))])
                 for edge in (np.min, np.max))
    there = np.flatnonzero(placed)
    for k in np.flatnonzero(~placed):
        away = np.maximum(low[k] - high[there], low[there] - high[k]).clip(0)
        offset[k] = offset[there[np.argmin(np.linalg.norm(away, axis=1))]]


def choose_direction(surfaces, pull=None, directions=DIRECTIONS):
    """Return the (elevation, azimuth) from which contact is seen, and the offsets of the nodes.

    surfaces  ContactFaces that are to be seen
    pull      a function of the eye that gives offsets and their size over that of the bodies
    """
    found = []
    for direction in directions:
        eye = towards_the_eye(*direction)
        offset, far = pull(eye) if pull else (0.0, 0.0)
        score = sum(surface.seen_by(eye) for surface in surfaces) / (1 + far)
        found.append((score if offset is not None else -1.0, direction, offset))
    best = max(score for score, _, _ in found)
    return next(one[1:] for one in found if one[0] >= NEARLY * best)
