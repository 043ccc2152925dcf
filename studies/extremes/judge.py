"""Judge a run of an extreme scene, by nothing but the scene's own numbers and the result file.

The internal forces are computed here from the displacements, in extended precision; gaps and slips
from the displacements and the obstacles. What the program says of its own certificate is not used.
"""

import re

import h5py
import numpy as np

from bipot.result import OPEN, Result
from studies.extremes.scenes import CORNERS, CYLINDER, GAUSS, PLANE, Scene, shape_gradients

CERTIFIED, FALLBACK, DIAGNOSED, FAILED = "certified", "fallback", "diagnosed", "failed"
SLACK = 2.0  # times what the program allows itself: its scales are not these to the last digit
ROUNDED = 160 * np.finfo(float).eps  # of stiffness times displacement: what stored values hold

# What an honest refusal says: a cause and, where there is one, a number.
CAUSES = {
    "tolerance not reached": r"did not reach the tolerance .*best residual \d\S*, largest at node",
    "nothing balances": r"nothing balances the loads along .*(translation|rotation)",
    "not certified": r"not certified, penetration \S+, adhesion",
    "not positive definite": r"not positive definite",
    "points do not settle": r"do not settle \(they still move by \d",
    "prescribed into an obstacle": r"is prescribed to move \S+ into",
    "contact missed": r"deep into the face of nodes .*contact is missed",
    "inside out": r"element \d+ is turned inside out, det\(I \+ grad u\) = -\S+: the body would go",
    "contact has energy": r"contact gains or loses \S+ of energy that is neither work nor friction",
    "begins too deep": r"begins \S+ inside its master, which is more than element \d+ behind it is",
    "tips over an edge": r"presses \S+ beyond the edge of .* from tipping over",
    "deck refused": r"\.inp:\d+.*: error: ",
}


def cause_of(message):
    """Return which of the honest refusals a message is, None where it is none."""
    for cause, pattern in CAUSES.items():
        if re.search(pattern, message, re.DOTALL):
            return cause
    return None


class Wrong(Exception):
    """What a result claims and does not hold."""


def judge(scene: Scene, path, status, message):
    """Return the outcome and words for it: (one of the four, text, worst error found here)."""
    cause = cause_of(message)
    numbers = np.nan
    try:
        if path.exists():
            refuse_nan(path)
        if status == 0:
            with Result(path) as result:
                numbers = check_result(scene, result)
                stages = result.history("solver_stages").max(initial=0)
            outcome = FALLBACK if stages > 1 else CERTIFIED
            return outcome, "", numbers
    except Wrong as error:
        return FAILED, str(error), numbers
    if status in (1, 2) and cause:
        return DIAGNOSED, message.strip().splitlines()[0], numbers
    return FAILED, f"exit status {status}: {message.strip()[:300]}", numbers


def refuse_nan(path):
    """Raise Wrong where a number of the file is none."""

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind == "f":
            count = rows_that_count(item)
            if not np.all(np.isfinite(item[:count])):
                raise Wrong(f"{name} holds numbers that are none")

    with h5py.File(path) as file:
        finished = int(file["history"].attrs["finished"])

        def rows_that_count(item):
            over_time = item.name.startswith(
                ("/history", "/contact", "/reference_nodes")
            ) and len(item) > finished
            return finished if over_time else None

        file.visititems(visit)


def check_result(scene, result):
    """Return the worst relative error of the stored increments; raise Wrong if too large."""
    expected = sum(step.increments for step in scene.steps)
    if result.finished != expected:
        raise Wrong(f"exit status 0 with {result.finished} of {expected} increments")
    if result.run["status"] != "finished":
        raise Wrong(f"exit status 0 with the file's status {result.run['status']}")
    if not np.all(result.history("certified") == 1):
        raise Wrong("exit status 0 with increments that are not certified")
    rows = result.field_rows
    if len(rows) == 0 or rows[-1] != expected - 1:
        raise Wrong("no fields of the last increment")
    # Reference nodes stand behind the points of the mesh.
    tools = result.reference_nodes
    ids = np.concatenate([result.node_ids, tools.node_ids])
    if sorted(ids) != sorted(scene.ids()):
        raise Wrong("the nodes of the file are not those of the scene")
    place = np.searchsorted(scene.ids(), ids, sorter=np.argsort(scene.ids()))
    back = np.empty(len(place), dtype=int)
    back[np.argsort(scene.ids())[place]] = np.arange(len(place))
    worst = 0.0
    before, row_before = np.zeros_like(scene.points), -1
    for index, row in enumerate(rows):
        u, supports = (result.field(name, index) for name in ("displacement", "reaction_force"))
        if len(tools):
            u = np.concatenate([u, tools.displacement[row]])
            supports = np.concatenate([supports, tools.reaction_force[row]])
        u, supports = u[back], supports[back]
        at = Increment(scene, result, back, row, u, before if row == row_before + 1 else None)
        at.check_supports()
        worst = max(worst, at.check_contact(), at.check_balance(supports))
        before, row_before = u, row
    return worst


class Increment:
    """One increment of a result, and what the scene says of it."""

    def __init__(self, scene, result, back, row, u, before):
        self.scene, self.u, self.before = scene, u, before
        self.label = f"increment {row + 1}"
        self.fixed, self.loads = prescribed_at(scene, row)
        self.allowed = SLACK * 10 * scene.tolerance
        # The points of each pair, in the order of the scene: (reaction, frame) of every slave.
        self.points = []
        for pair, found in zip(scene.pairs, sorted_pairs(scene, result), strict=True):
            order = {int(back_row): k for k, back_row in enumerate(found.nodes)}
            file_row = back[pair.nodes]
            chosen = [order[int(r)] for r in file_row if int(r) in order]
            rows = [node for node, r in zip(pair.nodes, file_row, strict=True) if int(r) in order]
            self.points.append(
                (
                    pair,
                    np.array(rows, dtype=int),
                    found.reaction[row][chosen],
                    found.frame[row][chosen],
                    found.status[row][chosen],
                    found.gap[row][chosen],
                )
            )
        self.force = internal_force(scene, u)
        self.contact = self.contact_force()
        sizes = [np.abs(self.force).max(initial=0), np.abs(self.contact).max(initial=0)]
        mesh = np.unique(scene.elements)
        sizes.append(np.abs(self.loads[mesh]).max(initial=0))
        self.force_scale = float(max(sizes)) or float(np.abs(self.loads).max(initial=0))
        increment = u - (0 if before is None else before)
        spread = np.ptp(u[mesh], axis=0).max()
        self.length_scale = max(float(np.linalg.norm(increment, axis=1).max()), float(spread))

    def contact_force(self):
        """Reactions as forces of the points of the mesh, (N, 3)."""
        force = np.zeros_like(self.u)
        for pair, rows, reaction, frame, _, _ in self.points:
            vectors = np.einsum("pa,pax->px", reaction, frame)
            np.add.at(force, rows, vectors)
            reference = self.scene.obstacles[pair.obstacle].reference
            if reference is not None:
                force[reference] -= vectors.sum(axis=0)
        return force

    def check_supports(self):
        """What is prescribed is met, to rounding."""
        for (row, direction), value in self.fixed.items():
            if abs(self.u[row, direction] - value) > 1e-14 * max(abs(value), self.length_scale):
                raise Wrong(
                    f"{self.label}: a prescribed displacement is {self.u[row, direction]}, "
                    f"not {value}"
                )

    def check_contact(self):
        """Signorini's and Coulomb's laws at every point of every pair; the worst relative error."""
        f, u = self.force_scale, self.length_scale
        errors = {"penetration": 0.0, "adhesion": 0.0, "complementarity": 0.0, "cone": 0.0}
        errors["slip against friction"] = 0.0
        for pair, rows, reaction, frame, status, stored in self.points:
            obstacle = self.scene.obstacles[pair.obstacle]
            gap, normal, reach = self.gaps(obstacle, rows)
            # What coordinates far away hold of a gap.
            known = 8 * np.finfo(float).eps * reach
            if len(rows) == 0:
                continue
            if np.abs(stored - gap).max() > self.allowed * u + known.max():
                raise Wrong(
                    f"{self.label}: a gap is {gap[np.abs(stored - gap).argmax()]}, "
                    f"not {stored[np.abs(stored - gap).argmax()]}"
                )
            if np.abs(frame[:, 0] - normal).max() > 1e-6:
                raise Wrong(f"{self.label}: a normal is not that of the obstacle")
            normal_force, friction = reaction[:, 0], reaction[:, 1:]
            size = np.linalg.norm(friction, axis=1)
            closed = np.maximum(0, np.abs(gap) - known)
            put(errors, "penetration", np.maximum(0, -gap - known), u)
            put(errors, "adhesion", np.maximum(0, -normal_force), f)
            put(errors, "complementarity", closed * np.abs(normal_force), f * u)
            put(errors, "cone", np.maximum(0, size - pair.mu * normal_force), f)
            if self.before is not None and pair.mu > 0:
                slip = self.slips(obstacle, rows, frame)
                # Dissipation at its largest: mu r_n |x_t| + r_t . x_t = 0.
                defect = pair.mu * normal_force * np.linalg.norm(slip, axis=1)
                defect += (friction * slip).sum(axis=1)
                # Where all three directions of a point are held there is nothing to slide.
                movable = ~self.is_fixed(rows, obstacle)
                size = np.maximum(np.linalg.norm(reaction, axis=1), pair.mu * normal_force)
                total = max(float(size.sum()), f)
                put(errors, "slip against friction", np.abs(defect[movable]), total * u)
            if np.any(np.linalg.norm(reaction[status == OPEN], axis=1) > self.allowed * f):
                raise Wrong(f"{self.label}: a point is called open and has a reaction")
        for name, error in errors.items():
            if error > self.allowed:
                raise Wrong(f"{self.label}: {name} {error:.1e}, allowed {self.allowed:.1e}")
        return max(errors.values())

    def is_fixed(self, rows, obstacle):
        """Whether supports hold a tangent of each point: its slip is theirs then."""
        held = np.array([[(int(row), i) in self.fixed for i in range(3)] for row in rows])
        reference = obstacle.reference
        if reference is None:
            return held.any(axis=1)
        moved = np.array([(reference, i) in self.fixed for i in range(3)])
        return (held & moved).any(axis=1)

    def gaps(self, obstacle, rows):
        """Gap, normal and the size of the coordinates they come from, of points at their places."""
        shift = 0 if obstacle.reference is None else self.u[obstacle.reference]
        start = self.scene.points[rows] - np.asarray(obstacle.point, dtype=float)
        arm = start + (self.u[rows] - shift)
        # A mesh is rounded as its largest coordinates are, also where it meets the origin.
        reach = np.full(len(rows), np.abs(self.scene.points).max() + np.abs(self.u).max())
        extra = np.array([self.scene.gaps.get(int(row), 0.0) for row in rows])
        if obstacle.kind == PLANE:
            normal = np.asarray(obstacle.direction) / np.linalg.norm(obstacle.direction)
            gap = start @ normal + (self.u[rows] - shift) @ normal
            return gap + extra, np.tile(normal, (len(rows), 1)), reach
        if obstacle.kind == CYLINDER:
            along = np.asarray(obstacle.direction) / np.linalg.norm(obstacle.direction)
            arm = arm - np.outer(arm @ along, along)
        distance = np.linalg.norm(arm, axis=1)
        normal = arm / distance[:, None]
        reach = reach + obstacle.radius
        if obstacle.inner:
            return obstacle.radius - distance + extra, -normal, reach
        return distance - obstacle.radius + extra, normal, reach

    def slips(self, obstacle, rows, frame):
        """Motion of the points along t1 and t2 in the increment, (P, 2)."""
        moved = self.u[rows] - self.before[rows]
        if obstacle.reference is not None:
            moved = moved - (self.u - self.before)[obstacle.reference]
        return np.einsum("px,pax->pa", moved, frame[:, 1:])

    def check_balance(self, supports):
        """Internal forces balance loads, reactions and supports; the worst relative error.

        A displacement of many digits leaves internal forces with few: `rounding` is what the stored
        numbers can hold at all. A result whose forces lie below it says nothing and is refused,
        but where there is no force to speak of.
        """
        residual = self.force - self.loads - self.contact
        held = np.zeros_like(self.u, dtype=bool)
        for row, direction in self.fixed:
            held[row, direction] = True
        free = np.where(held, 0, residual)
        rounding = rounding_of(self.scene, self.u)
        scale = max(self.force_scale, float(np.abs(np.where(held, residual, 0)).max(initial=0)))
        error = float(np.abs(free).max())
        if error > self.allowed * scale + rounding:
            raise Wrong(f"{self.label}: forces out of balance by {error:.1e} of {scale:.1e}")
        said = np.abs(np.where(held, supports - residual, supports)).max()
        if said > self.allowed * scale + rounding:
            raise Wrong(f"{self.label}: forces of supports wrong by {said:.1e} of {scale:.1e}")
        forces = max(np.abs(self.contact).max(), np.abs(self.loads).max(), np.abs(supports).max())
        if error > max(self.allowed, 1e-6) * scale and forces > rounding:
            raise Wrong(
                f"{self.label}: balanced to rounding alone, {error / scale:.1e} of the "
                "largest force"
            )
        return error / scale if scale > 0 and error > rounding else 0.0


def put(errors, name, values, scale):
    """Keep the largest of `values` over `scale` under `name`; 0/0 = 0."""
    largest = float(np.max(values, initial=0.0))
    if largest > 0:
        errors[name] = max(errors[name], largest / scale if scale > 0 else np.inf)


def sorted_pairs(scene, result):
    """The pairs of the file in the order of the scene."""
    return [result.pairs[f"SLAVE-{p}:O-{pair.obstacle}"] for p, pair in enumerate(scene.pairs)]


def prescribed_at(scene, row):
    """Return what supports prescribe and the nodal loads (N, 3), at the end of increment `row`."""
    fixed, forces, weight = {}, {}, np.zeros(3)
    for step in scene.steps:
        last = min(row, step.increments - 1)
        row -= step.increments
        share = (last + 1) / step.increments
        if step.factors:
            times, factors = np.transpose(step.factors)
            factor = float(np.interp(share, times, factors))
            fixed |= {key: factor * value for key, value in step.fixed.items()}
            forces |= {key: factor * value for key, value in step.forces.items()}
        else:
            for key, value in step.fixed.items():
                start = fixed.get(key, 0.0)
                fixed[key] = start + share * (value - start)
            for key, value in step.forces.items():
                start = forces.get(key, 0.0)
                forces[key] = start + share * (value - start)
        if step.gravity is not None:
            weight = weight + share * (np.asarray(step.gravity) - weight)
        if row < 0:
            break
    loads = np.zeros_like(scene.points)
    for (at, direction), value in forces.items():
        loads[at, direction] += value
    if np.any(weight):
        for nodes, m in zip(scene.elements, scene.material_index, strict=True):
            share = node_volumes(scene.points[nodes]) * scene.materials[m].density
            loads[nodes] += np.outer(share, weight)
    return fixed, loads


def node_volumes(x):
    """Integrals of the shape functions of an element, (8,)."""
    _, weights = shape_gradients(x)
    shapes = 0.125 * np.prod(1 + GAUSS * CORNERS[:, None, :] * CORNERS[None, :, :], axis=2)
    return weights @ shapes


def internal_force(scene, u):
    """Forces of the stresses on the points, (N, 3), computed in extended precision."""
    force = np.zeros(u.shape, dtype=np.longdouble)
    for nodes, m in zip(scene.elements, scene.material_index, strict=True):
        lame, shear = lame_constants(scene.materials[m])
        gradients, weights = shape_gradients(scene.points[nodes])
        gradients, weights = gradients.astype(np.longdouble), weights.astype(np.longdouble)
        # An element's own shift takes no part: what is left is its deformation.
        local = (u[nodes] - u[nodes[0]]).astype(np.longdouble)
        strain = np.einsum("ai,gaj->gij", local, gradients)
        strain = (strain + strain.transpose(0, 2, 1)) / 2
        virtual = gradients
        if scene.element == "C3D8B":
            mean = np.einsum("g,gai->ai", weights, gradients) / weights.sum()
            change = np.einsum("ai,ai", local, mean) - np.trace(strain, axis1=1, axis2=2)
            for i in range(3):
                strain[:, i, i] += change / 3
        trace = np.trace(strain, axis1=1, axis2=2)
        stress = 2 * shear * strain
        for i in range(3):
            stress[:, i, i] += lame * trace
        element = np.einsum("g,gij,gaj->ai", weights, stress, virtual)
        if scene.element == "C3D8B":
            pressure = np.trace(stress, axis1=1, axis2=2) / 3
            element -= np.einsum("g,g,gai->ai", weights, pressure, gradients)
            element += mean * (weights @ pressure)
        force[nodes] += element
    return force.astype(float)


def lame_constants(material):
    """Lame's constants in extended precision: 1 - 2 nu keeps its digits."""
    nu, young = np.longdouble(material.poisson), np.longdouble(material.young)
    return young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))


def rounding_of(scene, u):
    """What the last digits of displacements make of forces, the largest over the elements."""
    largest = 0.0
    for nodes, m in zip(scene.elements, scene.material_index, strict=True):
        lame, shear = lame_constants(scene.materials[m])
        gradients, weights = shape_gradients(scene.points[nodes])
        size = np.einsum("g,gai,gai->a", weights, gradients, gradients).max()
        stiffness = float(abs(lame) + 2 * shear) * size
        largest = max(largest, stiffness * float(np.abs(u[nodes]).max()))
    return ROUNDED * largest
