"""Confirm by other means that what the program refuses has no solution, or find the solution."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from between_nodes import covered_corners, unfelt_overlap
from contact_patterns import least_of_patterns
from elements import FACES
from joints import Joints
from laws import Judge
from least_squares import least_squares_in_cone
from load_path import LoadPath
from mortar import LEAST_SHARE, normal_of, place_surface
from obstacles import locate, shift_of
from slow_solver import Increment, frame_of, rigid_motions
from surfaces import Ties, settled

CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "unconfirmed"


def unbalanced_share(scene, u, held, loads, increment=None):
    """At least how much of the loads on free motions no reactions balance, 0 to 1.

    Reactions are those of pyramids around the cones of friction, at all slave nodes with the
    normals at displacements `u`: what does not balance then does not balance at all. The pyramids
    are drawn closer where their edges are used. With surfaces the points are those of `increment`.
    """
    motions = rigid_motions(scene, held)
    # What acts on bodies that are held has no part: beside it all else might be rounding.
    loads = np.where(np.abs(motions).max(axis=1, initial=0.0) > 1e-9, loads.ravel(), 0.0)
    work = motions.T @ loads
    total = np.linalg.norm(work)
    # Loads that supports or other loads cancel but for rounding drive nothing.
    if motions.shape[1] == 0 or total <= 1e-13 * np.abs(loads).sum():
        return 0.0
    points = [] if increment is None else rows_of_motions(increment, u, motions)
    for pair in scene.pairs if increment is None else ():
        obstacle = scene.obstacles[pair.obstacle]
        for row in scene.side_rows(pair.part, pair.side):
            _, normal, _ = locate(obstacle, scene.points[[row]], u[[row]], shift_of(obstacle, u))
            frame = frame_of(normal[0], np.ones(3, dtype=bool))
            rows = motions.reshape(-1, 3, motions.shape[1])
            rows = rows[row] - (0 if obstacle.reference is None else rows[obstacle.reference])
            points.append((frame @ rows, pair.friction))
    if not points or drives_unseen(motions, points, loads):
        return 1.0
    angles = [np.linspace(0, 2 * np.pi, 16, endpoint=False) for _ in points]
    width = [np.full(16, np.pi / 16) for _ in points]
    least = 0.0
    for _ in range(6):
        columns, owner = [], []
        for p, (rows, mu) in enumerate(points):
            if mu == 0:
                columns.append(rows[0])
                owner.append((p, 0.0, 0.0))
                continue
            for angle, half in zip(angles[p], width[p], strict=True):
                reach = mu / np.cos(half)
                columns.append(
                    rows[0] + reach * (np.cos(angle) * rows[1] + np.sin(angle) * rows[2])
                )
                owner.append((p, angle, half))
        matrix = np.transpose(columns)
        sizes = np.linalg.norm(matrix, axis=0)
        seen = sizes > 1e-14
        if not seen.any():
            return 1.0
        y, left = least_squares_in_cone(matrix[:, seen] / sizes[seen], -work)
        least = left / total
        if least > 1e-6:
            break
        used = [owner[k] for k, value in zip(np.flatnonzero(seen), y, strict=True) if value > 0]
        for p, angle, half in used:
            if half == 0.0:
                continue
            keep = ~((angles[p] == angle) & (width[p] == half))
            finer = half / 3
            angles[p] = np.concatenate([angles[p][keep], angle + finer * np.array([-2, 0, 2])])
            width[p] = np.concatenate([width[p][keep], np.full(3, finer)])
    return least


def drives_unseen(motions, points, loads):
    """Whether loads drive a motion (3N, m) that no reaction at the points acts along.

    However small they are beside others: these do nothing there but round.
    """
    rows = np.vstack([seen if mu > 0 else seen[:1] for seen, mu in points])
    _, size, ways = np.linalg.svd(rows)
    unseen = motions @ ways[int(np.sum(size > 1e-12 * size.max(initial=0.0))) :].T
    work = unseen.T @ loads
    # Of the motions, which loads that they should not see multiply.
    rounding = 16 * np.finfo(float).eps * np.abs(unseen).max(axis=0) * np.abs(loads).sum()
    return bool(np.any(np.abs(work) > rounding))


def left_by_pressure(scene, increment):
    """What pressures and friction on all that masters cover leave of the loads, 0 to 1."""
    motions = rigid_motions(scene, increment.held)
    motions = motions.reshape(-1, 3, motions.shape[1])
    work = np.einsum("nim,ni->m", motions, increment.loads)
    x, columns = scene.points + increment.before, []
    for pair in scene.pairs:
        slave, master = scene.faces(pair.part, pair.side), scene.faces(*pair.master)
        normal = normal_of(x[list(master[0])])
        *_, across = np.linalg.svd(normal[None])
        reach = pair.friction / np.cos(np.pi / 32)
        ways = [normal + reach * (np.cos(a) * across[1] + np.sin(a) * across[2])
                for a in np.linspace(0, 2 * np.pi, 32, endpoint=False)]  # fmt: skip
        for place in covered_corners(slave, x, master):
            moved = [rigid_at(motions, x, np.unique(faces), place) for faces in (slave, master)]
            columns += [(moved[0] - moved[1]).T @ way for way in ways]
    columns = np.transpose(columns)
    sizes = np.linalg.norm(columns, axis=0)
    _, left = least_squares_in_cone(columns[:, sizes > 0] / sizes[sizes > 0], -work)
    return left / np.linalg.norm(work)


def rigid_at(motions, x, rows, place):
    """Rigid motions (N, 3, m), known at some rows of a body, at a place: (3, m)."""
    terms = np.column_stack([np.ones(len(rows)), x[rows] - place])
    return np.einsum("n,nim->im", np.linalg.pinv(terms)[0], motions[rows])


def rows_of_motions(increment, u, motions):
    """[(rows (3, m) of the rigid motions at a point, friction)] of an increment placed at `u`."""
    _, frames, _, counts = increment.place(u)
    parts = motions.reshape(-1, 3, motions.shape[1])
    out = []
    for p, (_, row, _, mu) in enumerate(increment.points):
        if counts[p, 0]:
            moved = parts[row] - np.einsum("n,nim->im", increment.partner[p], parts)
            out.append((frames[p] @ moved, mu))
    return out


def has_surfaces(scene):
    """Whether anything is placed before faces, tied or turned."""
    turns = any(one.dof > 2 for step in scene.steps for one in step.boundaries)
    facets = any(o.has_facets for o in scene.obstacles)
    return turns or facets or bool(scene.ties) or any(p.master for p in scene.pairs)


def is_flat(increment, u):
    """Whether each pair has one normal: what does not balance on it by far has no solution."""
    _, frames, _, counts = increment.place(u)
    index = np.array([i for i, *_ in increment.points])
    for number in np.unique(index):
        normals = frames[(index == number) & counts[:, 0], 0]
        if len(normals) and np.abs(normals - normals[0]).max() > 1e-2:
            return False
    return True


def largest_strain(scene, loads):
    """A rough bound: all loads on the smallest side of a body of the softest material."""
    areas = [np.prod(np.delete(part.size, axis)) for part in scene.parts for axis in range(3)]
    return np.abs(loads).sum() / (min(m.young for m in scene.materials) * min(areas))


def pieces_come_apart(scene, held):
    """How many motions ties leave to the pieces they join, beyond those of the whole."""
    bodies, ties = scene.bodies(), Ties(scene).all
    count = 6 * len(bodies)
    motions = np.zeros((*scene.points.shape, count))
    for number, rows in enumerate(bodies):
        arm = scene.points[rows] - scene.points[rows].mean(axis=0)
        arm /= np.abs(arm).max()
        for i in range(3):
            motions[rows, i, 6 * number + i] = 1.0
            motions[rows, :, 6 * number + 3 + i] = np.cross(np.eye(3)[i], arm)
    rows = [motions[held]]
    for tie in ties:
        jump = motions[tie.rows] - np.einsum("pn,nim->pim", tie.weights, motions)
        rows.append(jump[~held[tie.rows]])
    size = np.linalg.svd(np.vstack([r.reshape(-1, count) for r in rows]), compute_uv=False)
    free = count - int(np.sum(size > 1e-9 * size.max()))
    alone = rigid_motions(scene, held).any(axis=0).sum() - 3 * len(scene.references())
    return free - int(alone)


def ties_nothing(scene, message):
    """Whether the deck is refused for a tie whose slave nodes the master does not cover at all."""
    if not re.search(r"error: tie .*: no node of .* lies on", message):
        return False
    lost = []
    for tie in scene.ties:
        slave, master = scene.faces(*tie.slave), scene.faces(*tie.master)
        placed = place_surface(slave, scene.points, master, scene.points)
        lost.append(placed.share.max() <= LEAST_SHARE)
    return any(lost)


def missed_depth(scene, increment, solution):
    """How deep a round obstacle is in a slave face of which no neighbour's node touches; 0: none.

    The faces are flat between their displaced nodes, and looked at on a grid: four lines and more
    a radius, at most 200; then on finer ones about the deepest place.
    """
    u, deepest = solution.u, 0.0
    for pair, force in zip(scene.pairs, solution.forces, strict=True):
        if pair.obstacle is None:
            continue
        obstacle = increment.obstacle_now(scene.obstacles[pair.obstacle])
        if obstacle.kind == "PLANE" or obstacle.inner or obstacle.has_facets:
            continue
        touching = set(scene.side_rows(pair.part, pair.side)[np.abs(force).max(axis=1) > 0])
        faces = [scene.nodes[b][list(FACES[f])] for b, f in scene.parts[pair.part].sides[pair.side]]
        for face in faces:
            size = np.ptp(scene.points[face], axis=0).max()
            near = {int(n) for other in faces if set(other) & set(face) for n in other}
            if near & touching:
                continue
            count = int(np.clip(4 * size / obstacle.radius, 20, 200)) + 1
            middle, half = np.zeros(2), 1.0
            for _ in range(4):
                along = (np.clip(x + half * np.linspace(-1, 1, count), -1, 1) for x in middle)
                s, t = (g.ravel() for g in np.meshgrid(*along))
                shapes = np.stack([(1 - s) * (1 - t), (1 + s) * (1 - t), (1 + s) * (1 + t),
                                   (1 - s) * (1 + t)])  # fmt: skip
                places, moved, added = (shapes.T @ a[face] / 4 for a in (
                    scene.points, u, increment.added[:, None]))  # fmt: skip
                gap, _, _ = locate(obstacle, places, moved, shift_of(obstacle, u), added[:, 0])
                least = int(gap.argmin())
                deepest = max(deepest, -gap[least])
                middle, half = np.array([s[least], t[least]]), half * 4 / count
    return deepest


def missed_on_the_way(scene, increment, solution, samples=40):
    """The same at any place of a straight way to the solution, if nothing pressed before it."""
    before = increment.before
    if np.any(increment.pressed_before):
        return 0.0
    ways = [before + share * (solution.u - before) for share in np.linspace(0, 1, samples + 1)]
    return max(missed_depth(scene, increment, replace(solution, u=u)) for u in ways)


def interval(scene, stored, message):
    """(step, end of the refused increment in the step's time, start of the step, displacements)."""
    finished = 0 if stored is None else stored.finished
    before = np.zeros_like(scene.points) if finished == 0 else stored.u[finished - 1]
    done = 0.0 if finished == 0 else float(stored.time[finished - 1])
    start = 0.0
    for step, cards in enumerate(scene.steps):
        if done < start + cards.period * (1 - 1e-9):
            share = cards.period / cards.increments
            number = int(np.floor((done - start) / share + 1e-6)) + 1
            return step, min(cards.period, number * share), start, before
        start += cards.period
    return None


def path_to(scene, stored, step):
    """A LoadPath that has begun `step`."""
    path = LoadPath(scene)
    for number in range(step + 1):
        u = np.zeros((len(scene.points), 6))
        if number:
            last = np.flatnonzero(stored.step == number)[-1]
            u = np.hstack([stored.u[last], stored.rotation[last]])
        path.begin(number, u)
    return path


def confirm(scene, stored, message):
    """(confirmed, refuted or unconfirmed; words) for a refusal with exit status 2."""
    where = interval(scene, stored, message)
    if where is None:
        return OPEN, "every increment is there, and yet the run was refused"
    step, time, start, before = where
    if scene.moves_nodes:
        places = settled(scene) if stored is None else stored.places
        scene = replace(scene, points=places, pairs=[replace(p, adjust=None) for p in scene.pairs])
    turned_before = np.zeros_like(before)
    if stored is not None and stored.finished:
        turned_before = stored.rotation[stored.finished - 1]
    path = path_to(scene, stored, step)
    if not scene.steps[step].direct:
        # Increments end where the load path turns, and what is not balanced there is no solution.
        done = 0.0 if stored is None or stored.finished == 0 else stored.time[stored.finished - 1]
        turns = [t for t in path.kinks() if done - start < t * (1 - 1e-9) and t < time]
        time = min([time, *turns])
    supports, loads = path.supports(time), path.loads(time) + path.thermal(time)
    increment = Increment(scene, before, supports, loads, None, turned_before)
    if stored is not None and stored.finished:
        increment.pressed_before = stored.contact_force[stored.finished - 1]
    if "the ties of the body" in message:
        loose = pieces_come_apart(scene, increment.held)
        if loose > 0:
            return CONFIRMED, f"the pieces have {loose} motions beside each other"
        return REFUTED, "the ties hold all pieces together"
    if re.search(r"is prescribed to move", message):
        u = np.where(increment.held, increment.target, before)
        for _, row, obstacle, _ in increment.points:
            if obstacle is None or obstacle.has_facets:
                continue
            fixed = increment.held[row]
            if obstacle.reference is not None:
                fixed = fixed & increment.held[obstacle.reference]
            gap, normal, rounding = locate(
                increment.obstacle_now(obstacle),
                scene.points[[row]],
                u[[row]],
                shift_of(obstacle, u),
                increment.added[row],
            )
            if np.linalg.norm(normal[0] * ~fixed) < 1e-9 and gap[0] < -rounding[0]:
                return CONFIRMED, f"node {scene.ids[row]} is prescribed to a gap of {gap[0]:.2g}"
    deep = re.search(r"node (\d+) of \S+ begins (\S+) inside its master", message)
    if deep:
        return judge_overlap(scene, increment, int(deep[1]), float(deep[2]))
    loads = loads + prescribed_pull(increment)
    # Normals of faces turn as these are bent, by no more than strains.
    bent = 30 * largest_strain(scene, loads) if has_surfaces(scene) else 0.0
    if has_surfaces(scene):
        left = unbalanced_share(scene, before, increment.held, loads, increment)
        hopeless = left > 1e-6 + bent and is_flat(increment, before)
    else:
        left = unbalanced_share(scene, before, increment.held, loads)
        hopeless = left > 1e-9 and all(o.kind == "PLANE" for o in scene.obstacles)
    if hopeless:
        return CONFIRMED, f"no reactions balance the loads: {left:.1e} of them is left"
    if "nothing balances" in message and all(o.kind == "PLANE" for o in scene.obstacles):
        share = least_of_patterns(increment, 1e-5 + bent) if is_flat(increment, before) else None
        if share is not None:
            return CONFIRMED, f"whatever touches, sticks or slides leaves {share:.1e} of the loads"
    try:
        found = increment.solve(scene.tolerance)
    except np.linalg.LinAlgError as error:
        return OPEN, f"the slow solver failed: {error}"
    if "inside out" in message:
        least = scene.elements().least_volume(found.u)
        return (CONFIRMED if least <= 0 else REFUTED), f"the least det(I + grad u) is {least:.2g}"
    findings = judge_solution(scene, path, increment, found, step, time, start)
    force = max(np.abs(scene.elements().internal_force(found.u)).max(), np.abs(loads).max())
    lost = scene.elements().rounding(found.u)
    # Supports take what rounding makes of stiff elements: not certified, whatever is found.
    carried = increment.body.joints.spread(lost)[increment.held.any(axis=1)].max(initial=0.0)
    if "not certified" in message and carried > 10 * scene.tolerance * force:
        return CONFIRMED, f"rounding in forces of supports is {carried / force:.1e} of the forces"
    spoilt = np.finfo(float).eps * increment.body.condition
    if not findings and spoilt > 10 * scene.tolerance and re.search(NUMERICAL, message):
        # A solution found in extended precision does not say that double precision finds it.
        return CONFIRMED, f"rounding times the condition of the stiffness is {spoilt:.1e}"
    if re.search(r"a face is folded, or one before it", message):
        folded = [f for f in findings if f.kind == "folded faces in contact"]
        if folded:
            return CONFIRMED, f"its own solution has {folded[0].found:g} folded faces in contact"
        return OPEN, f"its own solution (residual {found.residual:.1e}) has no folded face"
    if not findings and "contact gains or loses" in message:
        share = gained_share(increment, found, stored, step)
        if abs(share) > 0.1:
            return CONFIRMED, f"contact gains {share:.1e} of the strain energy beside its friction"
    # From behind no normal settles: a tool's middle is in the face.
    if re.search("would press it from behind|passes|from inside its body|do not settle", message):
        behind = [f for f in findings if f.kind in FROM_BEHIND]
        if behind:
            return CONFIRMED, f"its own solution of the increment: {behind[0]}"
    if not findings and "contact is missed" in message:
        depth = missed_depth(scene, increment, found)
        if "within the increment" in message:
            depth = missed_on_the_way(scene, increment, found)
        if depth > 10 * scene.tolerance * np.abs(found.u).max():
            return CONFIRMED, f"an obstacle is {depth:.2g} deep in a face, and no node near touches"
        overlap = unfelt_overlap(scene, as_stored(scene, increment, found, step, start + time))
        if overlap > 0:
            return CONFIRMED, f"its own solution has an overlap of {overlap:.1e} that nothing feels"
    if re.search(r"not positive definite.*\bsingle precision", message):
        least = least_in_single_precision(increment)
        if least <= 0:
            return CONFIRMED, f"in single precision the stiffness has an eigenvalue {least:.1g}"
    if not findings:
        loop = self_stress(increment, found)
        if loop and not holds_without(loop, scene, path, increment, (step, time, start)):
            names = ", ".join(str(scene.ids[increment.points[p][1]]) for p in loop)
            return CONFIRMED, f"only a self-stress of joints and contact at nodes {names} holds"
        return REFUTED, f"a solution exists (residual {found.residual:.1e})"
    kinds = {f.kind for f in findings}
    if found.converged and kinds <= ROUNDED:
        return CONFIRMED, f"stored displacements do not hold it: {findings[0]}"
    size = np.ptp(scene.points, axis=0).max()
    # Further than any obstacle is away.
    if found.drift > 10 * max(size, np.abs(increment.place(before)[2]).max(initial=0.0)):
        return CONFIRMED, f"loads push a body on and on: {found.drift / size:.1e} times its size"
    lost = lost.max() / 32
    if lost > 10 * scene.tolerance * force:
        return CONFIRMED, f"a last place of the displacements is {lost / force:.1e} of the forces"
    if spoilt > 10 * scene.tolerance:
        return CONFIRMED, f"rounding times the condition of the stiffness is {spoilt:.1e}"
    if left > 1e-9:
        return CONFIRMED, f"no reactions with the normals of now balance the loads: {left:.1e} left"
    wedged = largest_wedge(increment, found)
    if not found.converged and wedged is not None:
        node, share = wedged
        return CONFIRMED, (
            f"obstacles wedge node {node}: its reactions grow, and their sum is {share:.1e} of them"
        )
    return OPEN, f"the slow solver came to {found.residual:.1e}: {findings[0]}"


def self_stress(increment, solution):
    """Points whose normal reactions could all grow together and move nothing; []: there are none.

    Of those that press. With weights and normals of the undeformed mesh, which joined points keep.
    """
    moves, pressing, rows = increment.freedom.motions, [], []
    index = np.array([i for i, *_ in increment.points], dtype=int)
    for number, (surface, forces) in enumerate(
        zip(increment.surfaces, solution.forces, strict=True)
    ):
        if not surface.has_faces or surface.obstacle is not None:
            continue
        nowhere = np.zeros_like(increment.before)
        seen = surface.place(nowhere, nowhere, increment.without_row[number])
        for p, force in zip(np.flatnonzero(index == number), forces, strict=True):
            at = int(np.flatnonzero(seen.rows == increment.points[p][1])[0])
            if force @ seen.normal[at] > 1e-6 * np.abs(forces).max():
                apart = moves[seen.rows[at]] - np.einsum("m,min->in", seen.weights[at], moves)
                rows.append(seen.normal[at] @ apart)
                pressing.append(int(p))
    if not rows:
        return []
    # Shares c >= 0 that add up to 1 and whose forces cancel.
    matrix = np.vstack([1e5 * np.transpose(rows), np.ones(len(rows))])
    share, left = least_squares_in_cone(matrix, np.append(np.zeros(len(matrix) - 1), 1.0))
    return [p for p, c in zip(pressing, share, strict=True) if c > 1e-6] if left < 1e-3 else []


def holds_without(loop, scene, path, increment, when):
    """Whether there is a solution in which one point of a self-stress does not press.

    Of the least reactions one at least is 0.
    """
    for p in loop:
        increment.left_out = {p}
        found = increment.solve(scene.tolerance)
        findings = judge_solution(scene, path, increment, found, *when)
        increment.left_out = set()
        if not findings:
            return True
    return False


def gained_share(increment, solution, stored, step):
    """What contact does in an increment beside friction, (6.5), over the strain energy at its end.

    By the trapezoidal rule, with the reactions stored when it began. Of the increment before it in
    the step, too, where the two have more than the one: the program looks at two at a time.
    """
    scene, work = increment.scene, 0.0
    _, frames, _, _ = increment.place(solution.u)
    moved = increment.relative(solution.u)
    index = np.array([i for i, *_ in increment.points], dtype=int)
    for number, pair in enumerate(scene.pairs):
        at = np.flatnonzero(index == number)
        new, old = solution.forces[number], np.zeros((len(at), 3))
        if stored is not None and stored.finished:
            group = stored.pairs[scene.key_of(pair)]
            order = np.argsort(group["rows"])
            force = np.einsum("pk,pki->pi", group["reaction"][-1], group["frame"][-1])
            old = force[order]
        across = moved[at] - np.einsum("pi,pi,pj->pj", moved[at], frames[at, 0], frames[at, 0])
        work += np.sum(new * across) - np.sum((old + new) * moved[at]) / 2
    energy = np.sum(solution.u * scene.elements().internal_force(solution.u)) / 2
    both = work + gained_last(scene, stored, step)
    return (both if abs(both) > abs(work) else work) / energy if energy > 0 else 0.0


def gained_last(scene, stored, step):
    """The same of the last increment stored, by its nodal forces; 0 if it is of another step."""
    last = -1 if stored is None else stored.finished - 1
    if last < 0 or stored.step[last] != step + 1:
        return 0.0
    u, force = (np.concatenate([np.zeros_like(a[:1]), a])[last : last + 2]
                for a in (stored.u, stored.contact_force))  # fmt: skip
    groups = [stored.pairs[scene.key_of(pair)] for pair in scene.pairs]
    rubbed = sum(np.sum(g["reaction"][last][:, 1:] * g["slip_increment"][last]) for g in groups)
    return rubbed - np.sum(force.sum(axis=0) / 2 * (u[1] - u[0]))


def least_in_single_precision(increment):
    """The least eigenvalue of the stiffness rounded to single precision, over the largest."""
    free = increment.body.free
    stiffness = increment.body.stiffness[np.ix_(free, free)].astype(np.float32)
    values = np.linalg.eigvalsh(stiffness.astype(float))
    return values.min() / values.max()


def largest_wedge(increment, solution):
    """(node, sum of its reactions over the largest) where obstacles hold a node against each other.

    Friction may admit reactions of two obstacles on one node that cancel, of any size. Where the
    node has to move and both slide, there need not be a solution: a solver's reactions then grow
    for ever along such a pair. None where the largest reactions of the increment do not cancel.
    """
    forces = np.vstack(solution.forces)
    rows = np.array([row for _, row, _, _ in increment.points])
    row = rows[np.linalg.norm(forces, axis=1).argmax()]
    there = forces[rows == row]
    largest = np.linalg.norm(there, axis=1).max() or 1.0
    share = float(np.linalg.norm(there.sum(axis=0)) / largest)
    if len(there) < 2 or share > 1e-2:
        return None
    return int(increment.scene.ids[row]), share


# What the program says where it is rounding that keeps it from a solution.
NUMERICAL = r"condition of the stiffness|not positive definite"
FROM_BEHIND = {"pressed from inside, cosine", "middle of a tool is in a body by"}
ROUNDED = {"out of balance", "support forces are rounding by", "support force wrong by"}


def prescribed_pull(increment):
    """Loads that prescribed motion puts on free motions: none, for they are rigid."""
    return np.zeros_like(increment.before)


def judge_overlap(scene, increment, node, depth):
    """Whether a node begins as deep in its master as is said, and that is more than an element."""
    row = int(np.flatnonzero(np.asarray(scene.ids) == node)[0])
    gaps = increment.place(np.zeros_like(increment.before))[2]
    rows = np.array([r for _, r, *_ in increment.points])
    least = gaps[rows == row].min()
    elements = np.flatnonzero((np.asarray(scene.nodes) == row).any(axis=1))
    heights = []
    for element in elements:
        x = scene.points[np.asarray(scene.nodes)[element]]
        volume = float(scene.elements().weight[element].sum())
        for face in FACES:
            a, b, c, d = x[list(face)]
            heights.append(volume / (np.linalg.norm(np.cross(c - a, d - b)) / 2))
    words = f"its gap is {least:.3g}, and elements there are {min(heights):.3g} thick"
    is_so = abs(least + depth) <= 0.01 * depth and depth > 0.9 * min(heights)
    return (CONFIRMED if is_so else REFUTED), words


def judge_solution(scene, path, increment, solution, step, time, start):
    """Findings on an own solution by the same laws, without any excuse of rounding."""
    stored = as_stored(scene, increment, solution, step, start + time)
    judge = Judge(scene, stored, strict=True)
    judge.path = path
    judge.pressed_before = increment.pressed_before
    judge.judge_increment(0, time, increment.before, increment.rotations[0])
    return judge.findings


def tangents(frame, seen):
    """(P, 2): 0 for tangents across a plane of symmetry, else 1."""
    if seen.mirror is None:
        return np.ones((len(frame), 2))
    return (np.abs(np.einsum("pki,pi->pk", frame[:, 1:], seen.mirror)) < 0.5).astype(float)


def as_stored(scene, increment, solution, step, time):
    """A solution in the shape of laws.Stored, one increment long."""
    u = solution.u
    pressed = np.zeros_like(u)
    pairs = {}
    _, frames, gaps, counts = increment.place(u)
    relative = increment.relative(u)
    index = np.array([i for i, *_ in increment.points], dtype=int)
    for number, pair in enumerate(scene.pairs):
        at = np.flatnonzero(index == number)
        rows, force, frame = (
            scene.side_rows(pair.part, pair.side),
            solution.forces[number],
            frames[at],
        )
        np.add.at(pressed, rows, force)
        pressed -= increment.partner[at].T @ force
        slip = np.einsum("pki,pi->pk", frame, relative[at])[:, 1:]
        reaction = np.einsum("pki,pi->pk", frame, force)
        limit = pair.friction * reaction[:, 0]
        size = np.linalg.norm(reaction[:, 1:], axis=1)
        status = np.where(reaction[:, 0] <= 0, 0, np.where(size < limit * (1 - 1e-9), 1, 2))
        group = {
            "rows": rows, "frame": frame[None], "reaction": reaction[None],
            "gap": gaps[at][None], "slip_increment": slip[None], "status": status[None],
            "resultant": force.sum(axis=0)[None], "friction": pair.friction,
        }  # fmt: skip
        surface = increment.surfaces[number]
        if surface.has_faces:
            seen = surface.place(u, increment.rotations[1], increment.without_row[number])
            group["gap"] = np.where(counts[at, 0], gaps[at], 1e30)[None]
            # Tangents across a plane of symmetry are none.
            group["slip_increment"] = slip[None] * tangents(frame, seen)[None]
            group["area"] = surface.area
            group["covered_area"] = seen.covered[None]
            group["least_gap"] = (seen.least + increment.added[rows])[None]
        pairs[scene.key_of(pair)] = group
    residual = scene.elements().internal_force(u) - increment.loads - pressed
    residual, _ = Joints(scene, increment.held).hand_over(residual)
    residual, _ = Ties(scene).hand_over(residual, increment.held)
    supports = np.where(increment.held, residual, 0.0)
    contact = pressed.copy()
    return SimpleNamespace(
        finished=1, step=np.array([step + 1]), time=np.array([time]), certified=np.ones(1),
        status="finished", places=scene.points, u=u[None], rotation=increment.rotations[1][None],
        moments=np.zeros_like(u)[None], supports=supports[None],
        contact_force=contact[None], pairs=pairs,
    )  # fmt: skip
