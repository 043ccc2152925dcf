"""Random scenes of bodies before bodies, ties, obstacles of facets, and obstacles that turn."""

import numpy as np
from random_scenes import SIDES, Builder, add_loads
from scenes import CYLINDER, FACETS, PLANE, SPHERE, STL, Boundary, Force, Gravity, Pressure, Tie


class Stack:
    """Bodies along an axis, each on the one before."""

    def __init__(self, b, size=None):
        self.b = b
        self.axis = b.pick(2, 2, 0, 1)
        self.others = [i for i in range(3) if i != self.axis]
        self.size = b.pick(1.0, 1.0, 2.0, b.power(-2, 2)) if size is None else size
        self.young = b.pick(1000.0, 2.1e5, b.power(0, 6))
        self.parts, self.height = [], 0.0
        self.low = np.zeros(3)
        self.wide = None

    def along(self, value, other=0.0):
        """A vector with `value` along the axis of the stack."""
        v = np.full(3, float(other))
        v[self.axis] = value
        return v

    def add(self, young, gap=0.0, shape=None, start=None, cells=None, **options):
        """A body at `gap` from the last; `shape` and `start` across the axis. Its part."""
        b = self.b
        width = np.array([1.0, b.pick(1.0, 0.6, 1.4)]) if shape is None else np.asarray(shape)
        start = np.zeros(2) if start is None else np.asarray(start)
        tall = b.pick(1.0, 0.5, 0.7)
        size = self.along(tall * self.size)
        size[self.others] = width * self.size
        corner = self.along(self.height + gap)
        corner[self.others] = start * self.size
        if cells is None:
            cells = tuple(int(c) for c in b.rng.integers(1, 4, 3))
        options.setdefault("poisson", b.pick(0.3, 0.0, 0.25, 0.45, p=[0.5, 0.2, 0.2, 0.1]))
        poisson = options.pop("poisson")
        material = b.material(young, poisson, options.pop("density", None))
        part = b.part(corner, size, cells, material, **options)
        self.height += gap + tall * self.size
        self.parts.append(part)
        self.wide = width
        return part

    def lower(self):
        """The name of the lower sides."""
        return "XYZ"[self.axis] + "MIN"

    def upper(self):
        """The name of the upper sides."""
        return "XYZ"[self.axis] + "MAX"

    def face(self, below, above):
        """The two surfaces that touch, (part, side) each, in either order."""
        ends = [(self.parts[above], self.lower()), (self.parts[below], self.upper())]
        return ends if self.b.chance(0.5) else ends[::-1]


def stiffness_ratio(b):
    """A ratio of stiffnesses, 1e-6 to 1e6, often moderate."""
    return b.pick(1.0, b.power(-1.5, 1.5), b.power(-6, 6), p=[0.35, 0.4, 0.25])


def rough(b):
    """A coefficient of friction, 0 to 10."""
    return round(b.between(2, 10), 2) if b.chance(0.1) else b.friction()


def overhang(b, width):
    """(shape, start) of an upper body over a lower one of the given width."""
    way = b.rng.random()
    width = np.asarray(width)
    if way < 0.3:
        return width, np.zeros(2)
    if way < 0.5:
        # Wholly inside, or over all edges.
        part = b.between(0.3, 0.9) if b.chance(0.7) else b.between(1.1, 1.5)
        return width * part, width * (1 - part) * b.rng.uniform(0.2, 0.8, 2)
    if way < 0.9:
        moved = b.rng.uniform(-0.6, 0.6, 2) * width
        if b.chance(0.4):
            moved[b.rng.integers(2)] = 0.0
        return width, moved
    # A thin strip is left.
    return width, np.array([width[0] * (1 - b.power(-2, -1)), 0.0]) * b.pick(-1, 1)


def dome(b, stack, part, height):
    """Lower the edges of the upper side of a part: its middle stays where it is."""
    p = b.scene.parts[part]
    rows, _ = b.side(part, stack.upper())
    for row in rows:
        place = (b.points[row] - p.corner) / p.size
        shape = np.prod([np.sin(np.pi * place[i]) for i in stack.others])
        b.points[row] = b.points[row] - stack.along(height * (1 - shape))


def push_on(b, stack, part, depth, steps):
    """Later steps: the upper side is moved along or across, sometimes far."""
    far = b.pick(3 * depth, 3 * depth, 0.3 * stack.size)
    for _ in range(steps):
        step = b.step()
        if far > 10 * depth:
            step.increments = max(step.increments, 3)
        moved = b.pick(*stack.others)
        b.hold(step, part, stack.upper(), (moved,), b.between(-1, 1) * far,
               b.maybe_amplitude(step, 0.15))  # fmt: skip
        if b.chance(0.25):
            b.hold(step, part, stack.upper(), (stack.axis,), -depth * b.between(-0.5, 2))


def press(b, stack, part, depth):
    """The first step: the lowest body held below, the upper side of `part` moved down."""
    step = b.step()
    b.hold(step, stack.parts[0], stack.lower(), (0, 1, 2))
    b.hold(step, part, stack.upper(), tuple(stack.others))
    b.hold(step, part, stack.upper(), (stack.axis,), -depth, b.maybe_amplitude(step, 0.15))
    return step


def mirrored(b, stack, step, parts):
    """Hold a side of all bodies across it, as planes of symmetry are."""
    side = "XYZ"[b.pick(*stack.others)] + "MIN"
    for part in parts:
        b.hold(step, part, side, ("XYZ".index(side[0]),))


def two_blocks(b):
    """A block pressed onto another by prescribed motion, then pushed about."""
    stack = Stack(b)
    depth = stack.size * b.power(-3.5, -1.7)
    domed = b.chance(0.2)
    options = {"explicit": True} if domed else {}
    below = stack.add(stack.young, **options)
    shape, start = overhang(b, stack.wide)
    gap = b.pick(0.0, 0.0, b.between(0, 0.5) * depth, -b.between(0, 0.5) * depth)
    if b.chance(0.05):
        depth = -0.01 * gap if gap < 0 else depth  # all but the overlap is next to nothing
    above = stack.add(stack.young * stiffness_ratio(b), gap, shape, start)
    if domed:
        dome(b, stack, below, stack.size * b.between(0.01, 0.08))
    slave, master = stack.face(0, 1)
    options = {}
    if gap and b.chance(0.3):
        options["adjust"] = abs(gap) * b.pick(2.0, 0.5, 0.0)
    if b.chance(0.12):
        options["small"] = True
    b.touch(slave, master, rough(b), **options)
    if b.chance(0.2):
        b.scene.gaps[slave] = b.between(-0.3, 0.6) * depth
    step = press(b, stack, above, depth)
    if b.chance(0.2) and np.allclose(start, 0):
        mirrored(b, stack, step, (below, above))
    push_on(b, stack, above, depth, b.rng.integers(0, 3))
    return "block on block"


def loaded_blocks(b):
    """A block under loads on another; contact alone holds it, or rollers do across."""
    stack = Stack(b)
    stack.add(stack.young)
    shape, start = overhang(b, stack.wide) if b.chance(0.5) else (stack.wide, np.zeros(2))
    heavy = b.chance(0.5)
    young = stack.young * stiffness_ratio(b)
    above = stack.add(young, b.pick(0.0, 0.0, 1e-3 * stack.size), shape, start,
                      density=1.0 if heavy else None)  # fmt: skip
    b.scene.materials[0].density = 1.0 if heavy else None
    # Without friction nothing but rounding decides where a block that nothing holds across goes.
    rollers = b.chance(0.4)
    friction = rough(b)
    b.touch(*stack.face(0, 1), friction if rollers else max(friction, 0.05))
    step = b.step()
    b.hold(step, stack.parts[0], stack.lower(), (0, 1, 2))
    level = min(young, stack.young) * b.power(-4, -2)
    down = stack.along(-1.0) + b.pick(0.0, b.between(0, 0.6)) * stack.along(0.0, 1.0) * b.way()
    if heavy:
        step.gravity.append(Gravity(above, level / stack.size, down))
    else:
        step.pressures.append(Pressure(above, stack.upper(), level, None, b.chance(0.5)))
    if rollers:
        b.hold(step, above, stack.upper(), tuple(stack.others))
    if b.chance(0.5):
        later = b.step()
        side = b.pick(*[s for s in SIDES if s[0] != "XYZ"[stack.axis]])
        later.pressures.append(Pressure(above, side, level * b.between(0, 0.6),
                                        b.maybe_amplitude(later)))  # fmt: skip
    return "loaded block on block"


def three(b):
    """A stack of three, the middle one held by contact alone."""
    stack = Stack(b)
    depth = stack.size * b.power(-3.5, -2)
    stack.add(stack.young)
    width = stack.wide
    for _ in range(2):
        shape, start = overhang(b, width) if b.chance(0.3) else (width, np.zeros(2))
        stack.add(stack.young * stiffness_ratio(b), b.pick(0.0, 0.0, 0.2 * depth), shape, start)
    first = rough(b)
    b.touch(*stack.face(0, 1), first)
    second = rough(b)
    b.touch(*stack.face(1, 2), second + 0.07 if abs(second - first) < 0.05 else second)
    press(b, stack, stack.parts[2], depth)
    push_on(b, stack, stack.parts[2], depth, b.rng.integers(0, 2))
    return "stack of three"


def tied(b):
    """Two or three bodies glued in a stack, on the ground or before a plane."""
    stack = Stack(b)
    stack.add(stack.young)
    width = stack.wide
    count = int(b.rng.integers(2, 4))
    heavy = b.chance(0.3)
    b.scene.materials[0].density = 1.0 if heavy else None
    for _ in range(count - 1):
        shape, start = overhang(b, width) if b.chance(0.5) else (width, np.zeros(2))
        off = b.pick(0.0, 0.0, 0.001, -0.001) * stack.size
        stack.add(stack.young * stiffness_ratio(b), off, shape, start,
                  density=1.0 if heavy else None)  # fmt: skip
    touching = count == 3 and b.chance(0.4)
    ends = range(count - 1)
    for k in ends:
        slave, master = stack.face(k, k + 1)
        if touching and k == 1:
            b.touch(slave, master, rough(b))
        else:
            b.scene.ties.append(Tie(slave, master))
    step = b.step()
    top = stack.parts[-1]
    depth = stack.size * b.power(-4, -2)
    ground = not touching and b.chance(0.4)
    if ground:
        plane = b.plane_at(stack.parts[0], stack.lower(), b.pick(0.0, 0.3 * depth))
        b.pair(stack.parts[0], stack.lower(), plane)
    else:
        b.hold(step, stack.parts[0], stack.lower(), (0, 1, 2))
    if ground or touching or b.chance(0.5):
        b.hold(step, top, stack.upper(), (0, 1, 2))
        b.hold(step, top, stack.upper(), (stack.axis,), -depth, b.maybe_amplitude(step))
        if b.chance(0.5):
            push_on(b, stack, top, depth, 1)
    else:
        soft = min(m.young for m in b.scene.materials)
        add_loads(b, step, top, soft, stack.size, heavy)
    if b.chance(0.25):
        mirrored(b, stack, step, stack.parts)
    return "tied, with contact" if ground or touching else "tied"


def patch(b):
    """A uniform stress through surfaces that do not match: the displacements are known."""
    stack = Stack(b, 1.0)
    count, glued = int(b.rng.integers(2, 4)), b.chance(0.4)
    same = b.chance(0.5)
    poisson = 0.3 if same else 0.0
    shaken = b.chance(0.3)
    for k in range(count):
        young = stack.young * (1.0 if same else b.power(-2, 2))
        stack.add(young, shape=(1.0, 1.0), start=None, poisson=poisson, upper=None,
                  explicit=shaken or b.chance(0.5), distorted=shaken)  # fmt: skip
        if k:
            slave, master = stack.face(k - 1, k)
            if glued and b.chance(0.6):
                b.scene.ties.append(Tie(slave, master))
            else:
                b.touch(slave, master, 0.0 if same else b.pick(0.0, 0.4))
    step = b.step()
    b.hold(step, stack.parts[0], stack.lower(), (stack.axis,))
    for axis in stack.others:
        for part in stack.parts:
            b.hold(step, part, "XYZ"[axis] + "MIN", (axis,))
    strain = b.power(-4, -2.5)
    pressure = strain * min(m.young for m in b.scene.materials)
    step.pressures.append(Pressure(stack.parts[-1], stack.upper(), pressure))
    points = np.array(b.points)
    exact, base = np.zeros_like(points), 0.0
    for part, material in zip(stack.parts, b.scene.materials, strict=True):
        p = b.scene.parts[part]
        rows = list(p.rows)
        e = pressure / material.young
        low = p.corner[stack.axis]
        exact[rows, stack.axis] = base - e * (points[rows, stack.axis] - low)
        for axis in stack.others:
            exact[rows, axis] = poisson * e * points[rows, axis]
        base -= e * p.size[stack.axis]
    b.scene.exact = exact
    b.scene.exact_to = 1e-7 if shaken else 2e-8
    return "uniform stress"


def sheet(b, low, high, z, wave=0.0, tilt=(0.0, 0.0), split=None):
    """Corners and facets, up, of a sheet at height `z`; waves and a tilt lift it only."""
    n = b.rng.integers(1, 5, 2)
    if wave:
        n = n + 3
    x = [np.linspace(low[i], high[i], n[i] + 1) for i in range(2)]
    xs, ys = np.meshgrid(*x)
    s, t = ((v - v.min()) / np.ptp(v) for v in (xs, ys))
    zs = z + tilt[0] * s + tilt[1] * t + wave * (1 - np.cos(2 * np.pi * s)) / 2
    corners = np.column_stack([xs.ravel(), ys.ravel(), zs.ravel()])
    split = b.chance(0.5) if split is None else split
    facets, across = [], n[0] + 1
    for j in range(n[1]):
        for i in range(n[0]):
            a = int(i + across * j)
            quad = (a, a + 1, a + 1 + int(across), a + int(across))
            if split or b.chance(0.2):
                facets += [(quad[0], quad[1], quad[2]), (quad[0], quad[2], quad[3])]
            else:
                facets.append(quad)
    return corners, facets


def facet_tool(b):
    """A tool of facets pressed onto a held body from above, moved about, often turned."""
    size = b.pick(1.0, 1.0, b.power(-1, 1))
    young = b.pick(1000.0, b.power(0, 6))
    width = np.array([1.0, b.pick(1.0, 0.7, 1.3)]) * size
    tall = size * b.pick(1.0, 0.5)
    part = b.part((0, 0, 0), (*width, tall), tuple(int(c) for c in b.rng.integers(1, 4, 3)),
                  b.material(young))  # fmt: skip
    depth = size * b.power(-3, -1.8)
    reach = b.pick(1.3, 1.3, 0.6)
    low = width * (1 - reach) / 2 - b.rng.uniform(0, 0.1, 2) * size
    if b.chance(0.3):
        low[0] += b.between(0.2, 0.6) * size
    high = low + reach * width + 0.07 * size
    kind = b.pick(FACETS, FACETS, STL)
    wave = b.pick(0.0, 0.0, 0.3 * depth)
    tilt = b.pick((0.0, 0.0), (0.3 * depth, 0.1 * depth))
    gap = b.pick(0.0, 0.0, 0.2 * depth)
    corners, facets = sheet(b, low, high, tall + gap, wave, tilt, True if kind == STL else None)
    text = b.chance(0.5)
    if kind == STL and not text:
        corners = corners.astype(np.float32).astype(float)
    # The body is below: seen from there the facets run anticlockwise.
    facets = [f[::-1] for f in facets]
    hub = np.array([*(width * b.rng.uniform(0, 1, 2)), tall + size])
    tool = b.facets(kind, corners, facets, hub, back=b.chance(0.4), text=text)
    reference = b.scene.obstacles[tool].reference
    b.pair(part, "ZMAX", tool, rough(b))
    step = b.step()
    b.hold(step, part, "ZMIN", (0, 1, 2))
    step.boundaries += [Boundary([reference], i, 0.0) for i in range(2)]
    pushed = b.chance(0.25)
    if pushed:
        force = -young * width.prod() * b.power(-4, -2.3)
        step.forces.append(Force([reference], 2, force))
    else:
        step.boundaries.append(
            Boundary([reference], 2, -gap - depth, b.maybe_amplitude(step, 0.15))
        )
    for _ in range(b.rng.integers(0, 3)):
        later = b.step()
        amplitude = b.maybe_amplitude(later, 0.15)
        if b.chance(0.5):
            turn_about(b, later, reference, b.pick((5,), (5,), (3,), (4, 5)), depth / size)
        else:
            far = b.pick(3 * depth, 3 * depth, 0.2 * size)
            later.boundaries.append(
                Boundary([reference], b.pick(0, 1), b.between(-1, 1) * far, amplitude)
            )
    return "tool of facets under force" if pushed else "tool of facets"


def turn_about(b, step, reference, dofs, little):
    """Prescribe rotations: about an axis across the surface by little, along its normal by more."""
    for dof in dofs:
        angle = b.between(-1, 1) * (b.pick(0.1, 0.5, 1.5) if dof == 5 else little)
        angle = np.clip(angle, -1.2 * step.increments, 1.2 * step.increments)
        step.boundaries.append(
            Boundary([reference], dof, float(angle), b.maybe_amplitude(step, 0.1))
        )


def turning(b):
    """A plane, sphere or cylinder that turns on a body that is held, or on a free one."""
    kind = b.pick(PLANE, SPHERE, CYLINDER, CYLINDER)
    cells = tuple(int(c) for c in b.rng.integers(1, 5, 3))
    young = b.pick(1000.0, b.power(0, 6))
    part = b.part((0, 0, 0), (1.0, b.pick(1.0, 0.6), b.pick(1.0, 0.6)), cells, b.material(young))
    p = b.scene.parts[part]
    top = p.corner + p.size * np.array([0.5, 0.5, 1.0])
    depth = b.power(-3, -1.8)
    step = b.step()
    b.hold(step, part, "ZMIN", (0, 1, 2))
    inner = kind != PLANE and b.chance(0.2)
    if kind == PLANE:
        tool = b.obstacle(PLANE, top, (0.0, 0.0, -1.0), free=True)
        axes = b.pick((5,), (5,), (3,), (4, 5))
        little = depth
    else:
        radius = b.power(-0.2, 1) if not inner else b.between(2, 10)
        rows, _ = b.side(part, "ZMAX")
        over = np.array(b.points[rows[int(b.rng.integers(len(rows)))]])
        over[:2] += b.rng.uniform(-0.03, 0.03, 2)
        centre = over + np.array([0.0, 0.0, radius])
        if inner:
            half = np.linalg.norm(p.size[:2]) / 2
            centre = top - np.array([0.0, 0.0, np.sqrt(radius**2 - half**2)])
        direction = None if kind == SPHERE else b.pick(np.eye(3)[0], np.eye(3)[1])
        tool = b.obstacle(kind, centre, direction, radius, inner=inner, free=True)
        axes = b.pick((3,), (4,), (5,), (3, 4))
        little = 1.0
    obstacle = b.scene.obstacles[tool]
    reference = obstacle.reference
    if kind != PLANE:
        # About the middle, or beside it by less than the depth.
        beside = 0.3 * depth * b.rng.uniform(-1, 1, 3) * b.pick(0, 1)
        b.points[reference] = np.asarray(obstacle.point) + beside
    b.pair(part, "ZMAX", tool, rough(b))
    step.boundaries += [Boundary([reference], i, 0.0) for i in range(2)]
    pushed = b.chance(0.3) and not inner
    if pushed:
        step.forces.append(Force([reference], 2, -young * b.power(-5, -2.7)))
    else:
        step.boundaries.append(Boundary([reference], 2, -depth, b.maybe_amplitude(step, 0.1)))
    if b.chance(0.3):
        turn_about(b, step, reference, axes, little * 0.3)
    for _ in range(b.rng.integers(1, 3)):
        later = b.step()
        turn_about(b, later, reference, axes, little)
        if b.chance(0.3):
            later.boundaries.append(Boundary([reference], b.pick(0, 1), b.between(-2, 2) * depth))
    return "turning obstacle under force" if pushed else "turning obstacle"


KINDS = (
    (two_blocks, 0.27), (loaded_blocks, 0.13), (three, 0.1), (tied, 0.16), (patch, 0.08),
    (facet_tool, 0.14), (turning, 0.12),
)  # fmt: skip


def random_bodies(seed):
    """The scene of a seed of this family."""
    rng = np.random.default_rng([20261, seed])
    b = Builder(seed, rng)
    weights = np.array([w for _, w in KINDS])
    maker = KINDS[rng.choice(len(KINDS), p=weights / weights.sum())][0]
    kind = maker(b)
    if kind != "uniform stress" and b.chance(0.5):
        b.add_controls()
    return b.finish(kind)
