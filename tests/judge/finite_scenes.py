"""Random scenes at finite strain: soft bodies that are pressed, sheared, turned and loaded."""

import numpy as np
from body_scenes import Stack, rough, sheet
from finite_elements import BLATZ_KO, MOONEY_RIVLIN, NEO_HOOKE, OGDEN, ST_VENANT, YEOH
from obstacles import rotation
from random_scenes import Builder
from scenes import CYLINDER, FACETS, PLANE, SPHERE, STL, Boundary, Force, Pressure


def material_of(b, young, depth):
    """A law, and the depth (of the height) that it is asked to bear."""
    laws = (NEO_HOOKE, YEOH, OGDEN, ST_VENANT, MOONEY_RIVLIN, BLATZ_KO)
    law = b.pick(*laws, p=[0.2, 0.1, 0.1, 0.2, 0.2, 0.2])
    poisson = 0.25 if law == BLATZ_KO else b.pick(0.3, 0.0, 0.45, p=[0.6, 0.2, 0.2])
    if law == ST_VENANT:
        # Where it is pressed it holds no farther.
        depth = min(depth, 0.12)
        poisson = min(poisson, 0.3)
    index = b.material(young, poisson)
    one = b.scene.materials[index]
    one.law = law
    one.share = 0.4 if law in (YEOH, OGDEN) else 0.0
    if law == MOONEY_RIVLIN:
        one.share = round(b.between(0.1, 0.6), 2)
    return index, depth


def box(b, depth, **options):
    """(part, young, size (3,), depth) of a body whose inner nodes are often out of place."""
    young = b.pick(1.0, 1000.0, b.power(-3, 9))
    size = b.pick(1.0, 2.0, b.power(-3, 3)) * np.array([1.0, b.pick(1.0, 0.6), b.pick(1.0, 0.6)])
    cells = options.pop("cells", None) or tuple(int(c) for c in b.rng.integers(2, 4, 3))
    material, depth = material_of(b, young, depth)
    part = b.part((0, 0, 0), size, cells, material, "C3D8", **options)
    return part, young, size, depth


def steps_of(b, depth):
    """A step with increments for a depth."""
    step = b.step()
    step.increments = max(1, int(np.ceil(depth / b.pick(0.2, b.between(0.03, 0.08)))))
    return step


def hold_reference(b, step, obstacle, way=None):
    """Hold an obstacle's reference node, or prescribe its way."""
    at = b.scene.obstacles[obstacle].reference
    if at is not None:
        way = np.zeros(3) if way is None else way
        step.boundaries += [Boundary([at], i, float(way[i])) for i in range(3)]


def drawn_depth(b):
    """A part of the height."""
    return b.between(0.05, 0.4)


def pressed(b):
    """Pressed onto a plane, then sheared."""
    part, _, size, depth = box(b, drawn_depth(b))
    plane = b.plane_at(part, "ZMIN", b.pick(0.0, 0.0, 0.02 * size[2]), b.pick(0.0, 0.0, 0.05),
                       free=b.chance(0.3))  # fmt: skip
    b.pair(part, "ZMIN", plane)
    if b.chance(0.3):
        b.pair(part, "XMAX", b.plane_at(part, "XMAX", b.pick(0.0, 0.05 * size[0])))
    step = steps_of(b, depth)
    b.hold(step, part, "ZMAX", (0, 1))
    b.hold(step, part, "ZMAX", (2,), -depth * size[2])
    hold_reference(b, step, plane)
    if b.chance(0.6):
        way = b.between(-0.3, 0.3)
        b.hold(steps_of(b, abs(way)), part, "ZMAX", (b.pick(0, 1),), way * size[2])
    return "finite: pressed onto a plane"


def indented(b):
    """A sphere or a cylinder pressed into a body, and drawn over it."""
    depth = b.between(0.05, 0.25)
    cells = tuple(int(b.rng.integers(*ends)) for ends in ((3, 5), (2, 5), (2, 4)))
    part, _, size, depth = box(b, depth, cells=cells)
    kind = b.pick(SPHERE, CYLINDER)
    radius = size[0] * b.between(0.8, 2.0)
    top = np.array([size[0] / 2, size[1] / 2, size[2] + radius])
    top[:2] += 0.1 * size[:2] * b.rng.uniform(-1, 1, 2)
    direction = b.pick(np.array([0, 1.0, 0]), np.array([1.0, 0, 0])) if kind == CYLINDER else None
    tool = b.obstacle(kind, top, direction, radius, free=True)
    b.pair(part, "ZMAX", tool)
    step = steps_of(b, 2 * depth)
    b.hold(step, part, "ZMIN", (0, 1, 2))
    down = np.array([0.0, 0.0, -depth * size[2]])
    hold_reference(b, step, tool, down)
    if b.chance(0.5):
        way = down + np.array([b.between(-0.15, 0.15) * size[0], 0.0, 0.0])
        hold_reference(b, steps_of(b, 0.15), tool, way)
    return f"finite: before a {kind.lower()}"


def turn_side(b, step, part, side, vector, shift):
    """Prescribe that a side turns about its middle, by chords, and goes along a shift."""
    rows, _ = b.side(part, side)
    x = np.array([b.points[r] for r in rows])
    centre = x.mean(axis=0)
    there = centre + shift + (x - centre) @ rotation(vector).astype(float).T
    for row, way in zip(rows, there - x, strict=True):
        step.boundaries += [Boundary([row], i, float(way[i])) for i in range(3)]


def turned(b):
    """The supports of a body turn, before a plane, or an obstacle that presses it does."""
    part, _, size, depth = box(b, b.between(0.05, 0.25))
    by_tool = b.chance(0.5)
    kind = b.pick(PLANE, CYLINDER) if by_tool else PLANE
    if kind == PLANE:
        tool = b.plane_at(part, "ZMIN", free=by_tool)
    else:
        radius = size[0] * b.between(1.0, 2.0)
        middle = np.array([size[0] / 2, size[1] / 2, -radius])
        tool = b.obstacle(CYLINDER, middle, np.array([0, 1.0, 0]), radius, free=True)
    b.pair(part, "ZMIN", tool)
    step = steps_of(b, depth)
    shift = np.array([0.0, 0.0, -depth * size[2]])
    later = steps_of(b, 0.3)
    turn_side(b, step, part, "ZMAX", np.zeros(3), shift)
    if not by_tool:
        vector = np.array([*b.rng.uniform(-0.15, 0.15, 2), b.between(-0.6, 0.6)])
        turn_side(b, later, part, "ZMAX", vector, shift)
        return "finite: supports turn"
    hold_reference(b, step, tool)
    at = b.scene.obstacles[tool].reference
    spot = b.scene.obstacles[tool].point
    b.points[at] = np.array([size[0] / 2, size[1] / 2, spot[2]])
    dof = 5 if kind == PLANE else 4
    later.boundaries += [Boundary([at], i, 0.0) for i in range(3, 6) if i != dof]
    later.boundaries.append(Boundary([at], dof, b.between(-0.3, 0.3)))
    return "finite: an obstacle turns"


def loaded(b):
    """Pressures that follow and forces that do not, on a body that is held, before planes."""
    part, young, size, _ = box(b, 0.1)
    sides = ("XMIN", "XMAX", "YMIN", "YMAX", "ZMAX")
    step = steps_of(b, 0.2)
    b.hold(step, part, "ZMIN", (0, 1, 2))
    for side in b.rng.choice(sides, b.rng.integers(1, 3), replace=False):
        far = b.pick(0.0, 0.05) * size[0]
        b.pair(part, str(side), b.plane_at(part, str(side), far))
    for later in range(b.rng.integers(1, 3)):
        here = step if later == 0 else steps_of(b, 0.2)
        level = b.between(0.01, 0.1)
        if b.chance(0.7):
            here.pressures.append(
                Pressure(part, b.pick(*sides), young * level * b.between(-0.3, 1),
                         b.maybe_amplitude(here, 0.15), b.chance(0.4))
            )  # fmt: skip
        if b.chance(0.6) or not here.pressures:
            rows, name = b.side(part, b.pick(*sides))
            value = young * size[0] * size[1] * level * b.between(-0.5, 0.5) / len(rows)
            here.forces.append(Force(rows, b.pick(0, 1, 2), value, None, name))
    return "finite: pressures and forces"


def stacked(b):
    """Two bodies, one pressed onto the other and pushed over it."""
    depth = drawn_depth(b)
    stack = Stack(b)
    wide = np.array([1.0, b.pick(1.0, 0.7)])
    above = wide * b.pick(1.0, b.between(0.4, 0.8))
    for shape, start in ((wide, np.zeros(2)), (above, (wide - above) * b.between(0.2, 0.8))):
        part = stack.add(1.0, 0.0, shape, start, tuple(int(c) for c in b.rng.integers(2, 4, 3)),
                         element="C3D8", poisson=0.3)  # fmt: skip
        b.scene.materials.pop()
        young = stack.young * (1.0 if part == 0 else b.power(-0.7, 0.7))
        index, depth = material_of(b, young, depth)
        b.scene.parts[part].material = [index] * len(b.scene.parts[part].elements)
    b.touch(*stack.face(0, 1))
    step = steps_of(b, depth)
    height = stack.height
    b.hold(step, 0, stack.lower(), (0, 1, 2))
    b.hold(step, 1, stack.upper(), stack.others)
    b.hold(step, 1, stack.upper(), (stack.axis,), -depth * height)
    draw = b.rng.random()
    if draw < 0.5:
        way = b.between(-0.2, 0.2)
        b.hold(steps_of(b, abs(way)), 1, stack.upper(), (b.pick(*stack.others),), way * height)
    elif draw < 0.75:
        vector = b.between(-0.4, 0.4) * np.eye(3)[stack.axis]
        turn_side(b, steps_of(b, 0.3), 1, stack.upper(), vector,
                  stack.along(-depth * height))  # fmt: skip
    return "finite: two bodies"


def plated(b):
    """A tool of facets pressed onto a body by motion or force, drawn over it or turned on it."""
    depth = b.between(0.05, 0.2)
    part, young, size, depth = box(b, depth)
    reach = b.pick(1.6, 1.6, 0.6)
    low = size[:2] * ((1 - reach) / 2 + b.rng.uniform(-0.05, 0.05, 2))
    kind = b.pick(FACETS, FACETS, STL)
    wave = b.pick(0.0, 0.3 * depth * size[2])
    corners, facets = sheet(b, low, low + reach * size[:2], size[2], wave,
                            split=True if kind == STL else None)  # fmt: skip
    hub = np.array([*(size[:2] / 2), 1.5 * size[2]])
    tool = b.facets(kind, corners, [f[::-1] for f in facets], hub, back=b.chance(0.4), text=True)
    b.pair(part, "ZMAX", tool, rough(b))
    at = b.scene.obstacles[tool].reference
    step = steps_of(b, depth)
    b.hold(step, part, "ZMIN", (0, 1, 2))
    step.boundaries += [Boundary([at], i, 0.0) for i in range(2)]
    if b.chance(0.25):
        step.forces.append(Force([at], 2, -young * depth / 2 * size[0] * size[1]))
    else:
        step.boundaries.append(Boundary([at], 2, -depth * size[2]))
    later = steps_of(b, 0.2)
    if b.chance(0.5):
        later.boundaries.append(Boundary([at], 5, b.between(-0.5, 0.5)))
    else:
        later.boundaries.append(Boundary([at], b.pick(0, 1), b.between(-0.2, 0.2) * size[0]))
    return "finite: tool of facets"


def random_finite(seed):
    """The scene of a seed."""
    rng = np.random.default_rng([5, seed])
    b = Builder(seed, rng)
    b.scene.finite = True
    kinds = (pressed, indented, turned, loaded, stacked, plated)
    kind = kinds[rng.choice(len(kinds), p=[0.2, 0.15, 0.15, 0.15, 0.2, 0.15])](b)
    if b.chance(0.2):
        b.scene.controls["TOLERANCE"] = b.pick(1e-6, 1e-10)
    return b.finish(kind)
