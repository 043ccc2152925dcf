"""The surfaces of a scene: what slave nodes face, what ties make them follow."""

from dataclasses import dataclass

import numpy as np
from mortar import LEAST_SHARE, Placed, place_surface
from obstacles import corners_at

# How far own integrals and the program's may be apart, beside rounding. In faces that are no
# parallelograms its rule is one of degree 9 (docs/theory.md, section 11).
ROUNDING = 1e-11
BENT = 1e-6


@dataclass
class Seen(Placed):
    """Placed nodes of a pair, with what the pair adds."""

    corners: np.ndarray | None = None  # of the master, where it is
    mirror: np.ndarray | None = None  # (3,) across a plane of symmetry
    undeformed: np.ndarray | None = None  # (P,) areas of the nodes in the mesh

    def doubt(self, size):
        """(P,) how uncertain weights are, beside 1."""
        rough = BENT * self.bend**2 if self.bend > 1e-10 else 0.0
        rounded = 1e-13 * size / np.sqrt(self.area.max())
        share = np.maximum(self.share, 1e-12)
        return ROUNDING + rough + rounded / share


class Surface:
    """A contact pair before faces: the surface of a body, or facets."""

    def __init__(self, scene, pair):
        self.scene, self.pair = scene, pair
        self.obstacle = None if pair.obstacle is None else scene.obstacles[pair.obstacle]
        self.has_faces = self.obstacle is None or self.obstacle.has_facets
        if not self.has_faces:
            return
        self.slave = scene.faces(pair.part, pair.side)
        if self.obstacle is None:
            self.master = scene.faces(*pair.master)
            self.reached = np.unique(self.master)
        else:
            self.master, self.reached = self.obstacle.facets, np.unique(self.slave)
        # What lies between two bodies hides: all their outer faces.
        self.skins = None
        if self.obstacle is None and pair.part != pair.master[0]:
            self.skins = [[f for side in scene.parts[part].sides for f in scene.faces(part, side)]
                          for part in (pair.part, pair.master[0])]  # fmt: skip
        self.mirror_rows = self.planes_of_symmetry()
        nowhere = np.zeros(scene.points.shape)
        self.area = None
        self.first = self.place(nowhere, nowhere)
        self.area = self.first.area

    def planes_of_symmetry(self):
        """[(axis, rows of the slave on the plane)] of docs/theory.md, section 11."""
        scene, out = self.scene, []
        steps = [held_at_zero(scene, number) for number in range(len(scene.steps))]
        pair = np.ravel(self.slave)
        if self.obstacle is None:
            pair = np.concatenate([pair, np.ravel(self.master)])
        bodies = [rows for rows in scene.tied_bodies() if np.isin(rows, pair).any()]
        rows = np.concatenate(bodies)
        slave = np.unique(self.slave)
        size = np.ptp(scene.points[rows], axis=0).max()
        for axis in range(3):
            x = scene.points[rows, axis]
            for end in (x.min(), x.max()):
                on = rows[np.abs(x - end) <= 1e-9 * size]
                both = all(np.isin(on, body).any() for body in bodies)
                held = all((int(r), axis) in step for step in steps for r in on)
                mine = slave[np.isin(slave, on)]
                free = any((int(r), axis) not in step for step in steps for r in slave)
                if not (both and held and len(mine) and free):
                    continue
                if self.obstacle is None or self.is_mirrored(axis, end, x.mean() > end, steps):
                    out.append((axis, mine))
        return out

    def is_mirrored(self, axis, place, above, steps):
        """Whether facets stay cut by a plane, or stay their own images about it, as near as faces.

        `above`: the body lies where coordinates are larger than the plane's `place`.
        """
        scene, at = self.scene, self.obstacle.reference
        if at is not None:
            if not all((at, axis) in step for step in steps):
                return False
            for step in scene.steps:
                for one in step.boundaries:
                    turned = one.dof >= 3 and one.dof != 3 + axis and one.value != 0
                    if turned and at in [int(row) for row in one.rows]:
                        return False
        x = self.obstacle.corners
        near = 1e-6 * max(np.ptp(x, axis=0).max(), np.ptp(scene.points, axis=0).max())
        y = (x[:, axis] - place) * (1 if above else -1)
        if y.min() >= -near:
            return y.min() <= near
        faces = np.abs(scene.points[np.asarray(self.slave), axis] - place)
        width = faces[faces.min(axis=1) <= near].max()
        close = [f for f in map(list, self.obstacle.facets) if y[f].min() <= width
                 and y[f].max() >= -width]  # fmt: skip
        wanted = np.unique(np.concatenate(close)) if close else np.zeros(0, int)
        for image in x[wanted]:
            image[axis] = 2 * place - image[axis]
            if np.abs(x - image).max(axis=1).min() > near:
                return False
        return len(wanted) > 0

    @property
    def stays(self):
        """Whether nodes face what they face in the undeformed mesh: with small sliding."""
        return self.obstacle is None and self.pair.small

    def places(self, u):
        """(N, 3) where nodes are when they are placed: displaced, or as with small sliding."""
        return self.scene.points + (0.0 if self.stays else u)

    def place(self, u, rotation, none=()):
        """Seen at displacements `u` (N, 3), obstacles turned by `rotation` (N, 3).

        `none`: rows of nodes without a multiplier, whose two sides cannot move apart.
        """
        scene, obstacle = self.scene, self.obstacle
        x = self.places(u)
        if obstacle is None:
            y = x
        else:
            at = obstacle.reference
            turn = (0, 0, 0) if at is None else (u[at], rotation[at], scene.points[at])
            y = corners_at(obstacle, *turn)
        placed = place_surface(self.slave, x, self.master, y, none, u if self.stays else None,
                               self.skins)  # fmt: skip
        seen = Seen(**vars(placed), corners=y[np.unique(np.concatenate(
            [np.ravel(f) for f in self.master]))], undeformed=self.area)  # fmt: skip
        for axis, rows in self.mirror_rows:
            seen.mirror = np.zeros((len(seen.rows), 3)) if seen.mirror is None else seen.mirror
            on = np.isin(seen.rows, rows)
            seen.normal[on, axis] = 0.0
            seen.normal[on] /= np.maximum(np.linalg.norm(seen.normal[on], axis=1), 1e-300)[:, None]
            seen.mirror[on, axis] = 1.0
        return seen


def held_at_zero(scene, step):
    """{(row, dof)} held at 0 throughout a step, as far as the cards say; OP=NEW ends the others."""
    held = {}
    for number in range(step + 1):
        if "*BOUNDARY" in scene.steps[number].new:
            held = {}
        for one in scene.steps[number].boundaries:
            for row in one.rows:
                at = scene.unknown_of(int(row), one.dof)[:2]
                if not one.fixed:
                    held[at] = one.value == 0.0
                elif number == 0:
                    held[at] = True
                else:
                    held.setdefault(at, False)
    return {key for key, at_zero in held.items() if at_zero}


@dataclass
class Tied:
    """The nodes of a tie: their rows, weights (P, N) of the masters, and doubt about these."""

    rows: np.ndarray
    weights: np.ndarray
    reached: np.ndarray
    doubt: float


class Ties:
    """All ties of a scene, in its settled mesh."""

    def __init__(self, scene):
        self.all = []
        if not scene.ties:
            return
        self.size = max(np.ptp(scene.points[r], axis=0).max() for r in scene.bodies())
        for tie in scene.ties:
            slave, master = scene.faces(*tie.slave), scene.faces(*tie.master)
            placed = place_surface(slave, scene.points, master, scene.points, of_nodes=True)
            tied = placed.share > LEAST_SHARE
            doubt = ROUNDING + BENT * placed.bend**2
            reached = np.concatenate([placed.rows, np.unique(master)])
            # Weights are as large as little of a node is covered, and so is what they round by;
            # what moves as one is tied to itself exactly.
            weights = placed.weights[tied]
            weights = weights / weights.sum(axis=1, keepdims=True)
            self.all.append(Tied(placed.rows[tied], weights, reached, doubt))

    def hand_over(self, force, held):
        """Forces (N, 3) on tied directions go to their masters; (forces, doubt about them)."""
        if not self.all:
            return force, 0.0
        force, doubt = force.copy(), 0.0
        for _ in range(len(self.all) + 1):  # chains: a master may be tied itself
            for tie in self.all:
                taken = np.where(held[tie.rows], 0.0, force[tie.rows])
                force[tie.rows] -= taken
                force += tie.weights.T @ taken
                doubt += tie.doubt * np.abs(taken).sum()
        return force, doubt

    def spread(self, rounding):
        """Rounding (N,) of forces, with what masters get from the nodes that are tied to them."""
        rounding = rounding.copy()
        for _ in self.all:
            before = rounding.copy()
            for tie in self.all:
                rounding += np.abs(tie.weights.T) @ before[tie.rows]
        return rounding


def settled(scene):
    """Where the nodes (N, 3) of the mesh are once slave nodes are on their masters."""
    points = scene.points.copy()
    for tie in scene.ties:
        slave, master = scene.faces(*tie.slave), scene.faces(*tie.master)
        for _ in range(10):
            placed = place_surface(slave, points, master, points, of_nodes=True)
            on = placed.share > LEAST_SHARE
            shift = placed.gap[on, None] * placed.normal[on]
            points[placed.rows[on]] -= shift
            if np.abs(shift).max(initial=0.0) < 1e-14 * np.abs(points).max():
                break
    for pair in scene.pairs:
        if pair.adjust is None:
            continue
        slave, master = scene.faces(pair.part, pair.side), scene.faces(*pair.master)
        moves = None
        for _ in range(3):
            placed = place_surface(slave, points, master, points, of_nodes=True)
            if moves is None:
                moves = (placed.share > LEAST_SHARE) & (placed.gap <= pair.adjust)
            points[placed.rows[moves]] -= placed.gap[moves, None] * placed.normal[moves]
    return points
