"""Random scenes of contact beside what is clamped, tied or joined, in corners, with small tools.

Blocks whose sides are clamped down to the rim of their interface; surfaces that are tied in part;
welds, means and couplings within a pair; closed cracks; blocks in the corners of one master; and
spheres and cylinders smaller than an element.
"""

import numpy as np
from body_scenes import Stack, rough, stiffness_ratio
from elements import FACES
from joined_scenes import Joiner
from random_scenes import Builder
from scenes import (
    CYLINDER,
    FACETS,
    SPHERE,
    STL,
    Boundary,
    Coupling,
    Equation,
    Force,
    Obstacle,
    Pair,
    Pressure,
    Tie,
)

DIVISIONS = (1, 2, 2, 3, 4)


class Rims(Builder):
    """A builder of such scenes; parts are written node by node, so that sides may be divided."""

    def __init__(self, seed, rng):
        super().__init__(seed, rng)
        self.spot_nodes = []

    def cells(self, stack=None):
        """Elements along the axes; few along that of a stack."""
        n = [self.pick(*DIVISIONS) for _ in range(3)]
        if stack is not None:
            n[stack.axis] = self.pick(1, 1, 2)
        return tuple(n)

    def other_cells(self, cells, stack):
        """Those of a block before one with `cells`: often the same."""
        return cells if self.chance(0.45) else self.cells(stack)

    def divide(self, part, side, axis, at, name):
        """Name the faces of a side on both sides of a place along an axis: `name`-0 and -1."""
        p = self.scene.parts[part]
        halves = ([], [])
        for b, f in p.sides[side]:
            middle = np.mean([self.points[r] for r in self.face_rows(b, f)], axis=0)[axis]
            halves[int(middle > at)].append((b, f))
        for k, faces in enumerate(halves):
            p.sides[f"{name}{k}"] = faces
        return all(halves)

    def face_rows(self, element, face):
        """The four rows of a face of an element."""
        return self.elements[element][list(FACES[face])]

    def without(self, rows, *others):
        """Rows that are in no other list."""
        taken = set().union(*map(set, others))
        return [r for r in rows if r not in taken]


def two(b, same=None, gap=0.0, wide=None):
    """Two blocks on each other: (stack, slave, master)."""
    stack = Stack(b)
    cells = b.cells(stack) if wide is None else wide
    cells = list(cells)
    cells[stack.axis] = b.pick(1, 1, 2)
    stack.add(stack.young, cells=tuple(cells), explicit=True, distorted=b.chance(0.25))
    upper = tuple(cells) if same else b.other_cells(tuple(cells), stack)
    stack.add(stack.young * stiffness_ratio(b), gap, stack.wide, cells=upper, explicit=True,
              distorted=not same and b.chance(0.25))  # fmt: skip
    slave, master = stack.face(0, 1)
    return stack, slave, master


def load(b, stack, step, levels=(-4, -2)):
    """Press the upper block onto the lower one, and shear it, by loads."""
    young = min(m.young for m in b.scene.materials)
    level = young * b.power(*levels)
    top = stack.parts[-1]
    step.pressures.append(Pressure(top, stack.upper(), level, b.maybe_amplitude(step, 0.15),
                                   b.chance(0.3)))  # fmt: skip
    return level


def push(b, stack, step, level, share=0.6):
    """A pressure on a side, or forces along the top of the upper block."""
    top = stack.parts[-1]
    axis = b.pick(*stack.others)
    if b.chance(0.5):
        side = "XYZ"[axis] + b.pick("MIN", "MAX")
        step.pressures.append(Pressure(top, side, level * b.between(-share, share)))
    else:
        rows, name = b.side(top, stack.upper())
        area = b.scene.parts[top].size.prod() / b.scene.parts[top].size[stack.axis]
        force = level * area * b.between(-share, share) / len(rows)
        step.forces.append(Force(rows, axis, force, b.maybe_amplitude(step, 0.15), name))


def clamp(b, step, part, side, dofs, value=0.0):
    """Hold a side in some directions."""
    b.hold(step, part, side, dofs, value)


def clamped(b):
    """Sides of both bodies are clamped, down to the rim of the interface."""
    stack, slave, master = two(b, gap=b.pick(0.0, 0.0, 0.0, 1e-3))
    b.touch(slave, master, rough(b), small=b.chance(0.35))
    step = b.step()
    if b.chance(0.7):
        clamp(b, step, stack.parts[0], stack.lower(), (0, 1, 2))
    ends = ["XYZ"[i] + end for i in stack.others for end in ("MIN", "MAX")]
    sides = b.rng.choice(ends, b.pick(1, 1, 2, 4), replace=False)
    every = (0, 1, 2)
    dofs = b.pick(every, every, every, (stack.axis,), tuple(stack.others))
    for side in sides:
        for part in stack.parts:
            clamp(b, step, part, side, dofs)
    if dofs != every or not any(s.name == f"B0-{stack.lower()}" for s in step.boundaries):
        clamp(b, step, stack.parts[0], stack.lower(), every)
    if dofs == (stack.axis,):
        # Something has to hold the upper block across.
        for part in stack.parts:
            clamp(b, step, part, sides[0], tuple(stack.others))
    level = load(b, stack, step)
    for _ in range(b.rng.integers(0, 2)):
        later = b.step()
        if dofs == every and b.chance(0.4):
            # Both clamps go on together, or one along the interface, or away from it.
            young = min(m.young for m in b.scene.materials)
            far = level / young * stack.size * b.between(-1, 1)
            axis = b.pick(*stack.others) if b.chance(0.7) else stack.axis
            if axis == stack.axis:
                far = abs(far)
            clamp(b, later, stack.parts[1], sides[0], (axis,), far)
            continue
        push(b, stack, later, level)
    return "clamped to the rim"


def tied_beside(b):
    """A part of the interface is tied, the rest is in contact."""
    cells = b.cells()
    stack, slave, master = two(b, wide=cells)
    axis = b.pick(*stack.others)
    part = b.scene.parts[slave[0]]
    place = part.corner[axis] + part.size[axis] * b.pick(0.5, 0.5, 0.34, 0.67)
    for end in (slave, master):
        if not b.divide(*end, axis, place, end[1] + "-"):
            return None
    glued = b.pick(0, 1)
    names = [(end[0], f"{end[1]}-{k}") for k in (glued, 1 - glued) for end in (slave, master)]
    b.scene.ties.append(Tie(*names[:2]))
    whole = b.chance(0.25)
    b.touch(slave if whole else names[2], names[3], rough(b),
            small=b.chance(0.3))  # fmt: skip
    step = b.step()
    clamp(b, step, stack.parts[0], stack.lower(), (0, 1, 2))
    level = load(b, stack, step)
    for _ in range(b.rng.integers(0, 3)):
        push(b, stack, b.step(), level)
    return "tied beside contact"


def facing(b, slave, master):
    """[(row of the slave, row of the master)] at the same place."""
    ends = [b.side(*end)[0] for end in (slave, master)]
    out = []
    for row in ends[0]:
        for other in ends[1]:
            if np.linalg.norm(b.points[row] - b.points[other]) < 1e-9:
                out.append((row, other))
    return out


def spots(b):
    """Nodes of both surfaces are joined within the pair: welds, means, couplings."""
    cells = b.pick((2, 3, 2), (3, 3, 3), (4, 2, 2), (3, 2, 4))
    stack, slave, master = two(b, same=True, wide=cells)
    b.touch(slave, master, rough(b), small=b.chance(0.3))
    pairs = facing(b, slave, master)
    way = b.pick("weld", "weld", "mean", "normals", "coupling")
    chosen = [pairs[k] for k in b.rng.permutation(len(pairs))[: b.pick(1, 2, 3)]]
    axes = (0, 1, 2)
    if way == "weld":
        for row, other in chosen:
            for dof in b.pick(axes, axes, tuple(stack.others)):
                b.scene.equations.append(Equation([([row], dof, 1.0), ([other], dof, -1.0)]))
    elif way == "normals":
        for row, other in chosen:
            dof = stack.axis
            b.scene.equations.append(Equation([([row], dof, 1.0), ([other], dof, -1.0)]))
    elif way == "mean" and len(chosen) > 1:
        for dof in b.pick(axes, (stack.axis,)):
            terms = [([row], dof, 1.0) for row, _ in chosen]
            terms += [([other], dof, -1.0) for _, other in chosen]
            b.scene.equations.append(Equation(terms))
    else:
        # A rigid spot: the same faces of both surfaces go with one node each, and these together.
        axis = stack.others[0]
        p = b.scene.parts[slave[0]]
        for end in (slave, master):
            if not b.divide(*end, axis, p.corner[axis] + p.size[axis] * 0.5, end[1] + "-"):
                return None
        nodes = []
        for part, side in (slave, master):
            rows, _ = b.side(part, side + "-0")
            b.points.append(np.mean([b.points[r] for r in rows], axis=0))
            b.ids.append(max(b.ids) + 3)
            b.scene.loose.append(len(b.points) - 1)
            nodes.append(len(b.points) - 1)
            b.scene.couplings.append(Coupling(part, side + "-0", nodes[-1], True))
        b.spot_nodes = nodes
    step = b.step()
    clamp(b, step, stack.parts[0], stack.lower(), (0, 1, 2))
    if b.scene.couplings:
        for node in b.spot_nodes:
            for dof in range(6):
                step.boundaries.append(Boundary([node], dof, 0.0))
    elif way == "normals" or b.chance(0.3):
        rows, name = b.side(stack.parts[1], stack.upper())
        for dof in stack.others:
            step.boundaries.append(Boundary(rows, dof, 0.0, None, name))
    level = load(b, stack, step)
    for _ in range(b.rng.integers(0, 3)):
        push(b, stack, b.step(), level, 0.4)
    return f"joined within contact: {way}"


def crack(b):
    """A block of two halves whose nodes between them are two but at the rim."""
    cells = b.pick((3, 3, 3), (4, 3, 2), (3, 4, 4), (4, 4, 2))
    stack, slave, master = two(b, same=True, wide=cells)
    low, high = stack.parts
    faces = [(low, stack.upper()), (high, stack.lower())]
    joined = b.pick((0, 1), (0, 1), (0,))  # of the axes across, whose ends are shared
    p = b.scene.parts[low]
    edge = [stack.others[k] for k in joined]
    one_sided = b.chance(0.2)
    shared = {}
    for row, other in facing(b, *faces):
        place = (np.asarray(b.points[row]) - p.corner) / p.size
        ends = [place[i] < 1e-9 or (place[i] > 1 - 1e-9 and not one_sided) for i in edge]
        if any(ends):
            shared[other] = row
    b.elements = [np.array([shared.get(int(r), int(r)) for r in nodes]) for nodes in b.elements]
    gap = b.pick(0.0, 0.0, 1e-4) * stack.size
    rows, _ = b.side(high, stack.lower())
    for row in rows:
        if row not in shared.values():
            b.points[row] = b.points[row] + stack.along(gap)
    for m in b.scene.materials[1:]:
        m.young = stack.young
    b.touch(slave, master, rough(b), small=b.chance(0.3))
    step = b.step()
    clamp(b, step, low, stack.lower(), (0, 1, 2))
    if b.chance(0.5):
        level = load(b, stack, step)
        for _ in range(b.rng.integers(0, 2)):
            push(b, stack, b.step(), level)
        return "crack"
    depth = stack.size * b.power(-4, -2.2)
    clamp(b, step, high, stack.upper(), tuple(stack.others))
    clamp(b, step, high, stack.upper(), (stack.axis,), -depth)
    for _ in range(b.rng.integers(0, 3)):
        later = b.step()
        clamp(b, later, high, stack.upper(), (b.pick(*stack.others),), b.between(-2, 2) * depth)
        if b.chance(0.3):
            clamp(b, later, high, stack.upper(), (stack.axis,), depth * b.between(-1, 1))
    return "crack"


def walls_of_facets(b, body, kind, corners, walls, friction):
    """Pairs of the side FOOT and each wall of one master of facets; its reference node's row."""
    every = [f for wall in walls for f in wall]
    whole = b.facets(kind, corners, every, corners[0] - np.ptp(corners), text=b.chance(0.5))
    deck, first = b.scene.obstacles[whole], 0
    for k, wall in enumerate(walls):
        numbers = list(range(first, first + len(wall)))
        first += len(wall)
        b.scene.obstacles.append(
            Obstacle(deck.name, kind, deck.point, reference=deck.reference, corners=deck.corners,
                     facets=wall, corner_rows=deck.corner_rows, wall_of=whole, of_it=numbers)
        )  # fmt: skip
        b.scene.pairs.append(Pair(body, "FOOT", len(b.scene.obstacles) - 1, friction, wall=k))
    return deck.reference


def corner_walls(b, size, count, split):
    """(corners, [facets of each wall]) of a floor and one or two walls at the origin, one mesh."""
    x, y, z = np.eye(3)
    n = [int(v) for v in b.rng.integers(1, 4, 3)]  # along x, y, z: walls share the nodes of edges
    far = 1.4 * size
    known, corners = {}, []

    def node(i, j, k):
        if (i, j, k) not in known:
            known[i, j, k] = len(corners)
            corners.append(far * (x * i / n[0] + y * j / n[1] + z * k / n[2]))
        return known[i, j, k]

    walls = []
    for normal in range(3)[::-1][:count]:
        s, t = (normal + 1) % 3, (normal + 2) % 3
        facets = []
        for i in range(n[s]):
            for j in range(n[t]):
                at = []
                for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    place = [0, 0, 0]
                    place[s], place[t] = i + di, j + dj
                    at.append(node(*place))
                quad = tuple(at)
                facets += [quad[:3], (quad[0], quad[2], quad[3])] if split else [quad]
        walls.append(facets)
    return np.array(corners), walls


def corner(b):
    """A block in the corner of one master: facets, or a body with a step."""
    young = b.pick(1000.0, b.power(0, 6))
    size = b.pick(1.0, 1.0, b.power(-2, 2))
    cells = tuple(int(c) for c in b.rng.integers(1, 4, 3))
    body = b.part((0, 0, 0), (size, size * b.pick(1.0, 0.7), size * b.pick(1.0, 0.6)), cells,
                  b.material(young, b.pick(0.3, 0.0, 0.45)), explicit=True,
                  distorted=b.chance(0.3))  # fmt: skip
    count = b.pick(2, 2, 3)
    p = b.scene.parts[body]
    slaves = ("ZMIN", "YMIN", "XMIN")[:count]
    p.sides["FOOT"] = [face for side in slaves for face in p.sides[side]]
    # From mu = 1 on a node may be wedged between floor and wall, by reactions of any size.
    friction, small = min(rough(b), 0.9), False
    if b.chance(0.65):
        kind = b.pick(FACETS, FACETS, STL)
        corners, walls = corner_walls(b, size, count, kind == STL or b.chance(0.5))
        if kind == STL:
            corners = corners.astype(np.float32).astype(float)
        tool = walls_of_facets(b, body, kind, corners, walls, friction)
    else:
        tool = None
        master = step_of_elements(b, size, count, young * stiffness_ratio(b))
        small = b.chance(0.2)
        for k in range(count):
            b.scene.pairs.append(Pair(body, "FOOT", None, friction, (master, f"STEP{k}"),
                                      small, wall=k, whole="STEP"))  # fmt: skip
    step = b.step()
    if tool is not None:
        for dof in range(3):
            step.boundaries.append(Boundary([tool], dof, 0.0))
    else:
        b.hold(step, master, "ZMIN", (0, 1, 2))
    depth = size * b.power(-3.5, -1.8)
    if b.chance(0.5):
        rows, _ = b.side(body, "ZMAX")
        lower = b.side(body, "YMIN")[0] + (b.side(body, "XMIN")[0] if count == 3 else [])
        rows = b.without(rows, lower)
        for dof in range(3):
            value = -depth * b.between(0, 1) if dof >= 3 - count else 0.0
            step.boundaries.append(Boundary(rows, dof, value, None, None))
        if b.chance(0.5):
            later = b.step()
            dof = int(b.rng.integers(3))
            later.boundaries.append(Boundary(rows, dof, depth * b.between(-1.5, 1)))
    else:
        level = min(m.young for m in b.scene.materials) * b.power(-4, -2)
        sides = ("ZMAX", "YMAX", "XMAX")[:count]
        for side in sides:
            step.pressures.append(Pressure(body, side, level * b.between(0.2, 1)))
        if count == 2:
            b.hold(step, body, "XMAX", (0,))
        if b.chance(0.5):
            later = b.step()
            later.pressures.append(Pressure(body, b.pick(*sides), level * b.between(0.1, 1)))
    return f"corner of {count} walls" + ("" if tool is not None else " of a body")


def step_of_elements(b, size, count, young):
    """A body with a floor and one or two walls around the octant of positive coordinates."""
    thick, far = 0.5 * size, 1.3 * size
    n = [int(b.pick(1, 2, 3)) for _ in range(3)]
    lines = [np.concatenate([[-thick], np.linspace(0, far, n[i] + 1)]) for i in range(3)]
    if count == 2:
        lines[0] = np.linspace(-0.2 * size, far, n[0] + 2)
    cells = tuple(len(line) - 1 for line in lines)
    part = b.part((0, 0, 0), (1, 1, 1), cells, b.material(young, 0.3), explicit=True,
                  distorted=False)  # fmt: skip
    p = b.scene.parts[part]
    first = p.rows[0]
    shape = [c + 1 for c in cells]
    for at in p.rows:
        local = at - first
        index = local % shape[0], local // shape[0] % shape[1], local // (shape[0] * shape[1])
        b.points[at] = np.array([lines[i][index[i]] for i in range(3)])
    middles = {k: np.mean([b.points[r] for r in b.elements[k]], axis=0) for k in p.elements}
    kept = [k for k in p.elements if middles[k][2] < 0 or middles[k][1] < 0
            or (count == 3 and middles[k][0] < 0)]  # fmt: skip
    sides, walls = {}, [[] for _ in range(count)]
    for k in kept:
        for f in range(6):
            places = np.array([b.points[r] for r in b.face_rows(k, f)])
            middle = places.mean(axis=0)
            for wall in range(count):
                axis = 2 - wall
                others = [a for a in range(3 - count, 3) if a != axis]
                if np.all(np.abs(places[:, axis]) < 1e-12 * size) and np.all(middle[others] > 0):
                    walls[wall].append((k, f))
            if np.ptp(places[:, 2]) == 0 and places[0, 2] < 0:
                sides.setdefault("ZMIN", []).append((k, f))
    # Elements that are not there are the last ones: they are taken out of the lists.
    number = {k: p.elements[0] + i for i, k in enumerate(kept)}
    b.elements = b.elements[: p.elements[0]] + [b.elements[k] for k in kept]
    b.element_ids = b.element_ids[: p.elements[0]] + [b.element_ids[k] for k in kept]
    p.elements = range(p.elements[0], p.elements[0] + len(kept))
    p.material = p.material[: len(kept)]
    p.sides = {name: [(number[k], f) for k, f in faces] for name, faces in sides.items()}
    for k, wall in enumerate(walls):
        p.sides[f"STEP{k}"] = [(number[e], f) for e, f in wall]
    p.sides["STEP"] = [face for k in range(count) for face in p.sides[f"STEP{k}"]]
    return part


def small_tool(b):
    """A sphere or cylinder smaller than an element, pressed by less or more than its radius."""
    young = b.pick(1000.0, b.power(0, 6))
    cells = (b.pick(1, 2, 3), b.pick(1, 2, 3), b.pick(1, 2))
    part = b.part((0, 0, 0), (1.0, b.pick(1.0, 0.7), b.pick(0.5, 1.0)), cells,
                  b.material(young, b.pick(0.3, 0.0)), explicit=True,
                  distorted=b.chance(0.3))  # fmt: skip
    p = b.scene.parts[part]
    kind = b.pick(SPHERE, SPHERE, CYLINDER)
    rows, _ = b.side(part, "ZMAX")
    over = b.pick("node", "node", "node", "edge", "face")
    if over == "node":
        place = np.array(b.points[b.pick(*rows)])
        place[:2] += b.pick(0.0, 1e-3) * b.rng.uniform(-1, 1, 2)
    else:
        face = b.face_rows(*p.sides["ZMAX"][b.rng.integers(len(p.sides["ZMAX"]))])
        corners = np.array([b.points[r] for r in face])
        place = corners[:2].mean(axis=0) if over == "edge" else corners.mean(axis=0)
    width = min(p.size[0] / cells[0], p.size[1] / cells[1])
    radius = width * b.pick(0.02, 0.05, 0.1, 0.3)
    gap = b.pick(0.0, 0.0, 0.3 * radius)
    centre = place + np.array([0.0, 0.0, radius + gap])
    direction = None if kind == SPHERE else b.pick(np.eye(3)[0], np.eye(3)[1])
    tool = b.obstacle(kind, centre, direction, radius, free=True)
    b.pair(part, "ZMAX", tool, rough(b))
    reference = b.scene.obstacles[tool].reference
    step = b.step()
    b.hold(step, part, "ZMIN", (0, 1, 2))
    step.boundaries += [Boundary([reference], i, 0.0) for i in range(2)]
    depth = radius * b.pick(0.1, 0.5, 0.9, 1.5, 2.5, 4.0)
    depth = min(depth, 0.3 * p.size[2] / cells[2])
    step.boundaries.append(Boundary([reference], 2, -gap - depth))
    if b.chance(0.3):
        later = b.step()
        later.boundaries.append(Boundary([reference], b.pick(0, 1),
                                         b.between(-1, 1) * radius))  # fmt: skip
    return f"small tool over a {over}"


KINDS = ((clamped, 0.27), (tied_beside, 0.16), (spots, 0.16), (crack, 0.13), (corner, 0.18),
         (small_tool, 0.1))  # fmt: skip


def random_rims(seed):
    """The scene of a seed of this family."""
    rng = np.random.default_rng([20263, seed])
    weights = np.array([w for _, w in KINDS])
    maker = KINDS[rng.choice(len(KINDS), p=weights / weights.sum())][0]
    kind = None
    while kind is None:  # a surface that could not be divided
        b = Rims(seed, rng)
        kind = maker(b)
    if b.chance(0.2):
        b.add_controls()
    scene = b.finish(kind)
    return Joiner(scene, rng).finish() if scene.couplings else scene
