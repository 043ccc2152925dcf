"""The scenes of the matrix of extremes: small contact problems, extreme in one or two respects.

A `Scene` knows its mesh, materials, obstacles, supports and loads as numbers; `deck` writes it as a
deck of the program. Whoever judges a result takes the same numbers, and nothing of the program.

    from studies.extremes.scenes import all_scenes

    for scene in all_scenes():
        print(scene.name, scene.axis, len(scene.points))
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

PLANE, SPHERE, CYLINDER = "PLANE", "SPHERE", "CYLINDER"
GAUSS = 1 / math.sqrt(3)
CORNERS = np.array(
    [
        *([-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]),
        *([-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]),
    ],
    dtype=float,
)


@dataclass
class Material:
    """Isotropic and linear."""

    young: float = 210000.0
    poisson: float = 0.3
    density: float = 0.0


@dataclass
class Obstacle:
    """Rigid; `reference` is the row of the point that it moves with, None where it is at rest."""

    kind: str = PLANE
    point: tuple = (0.0, 0.0, 0.0)
    direction: tuple = (0.0, 0.0, 1.0)  # the normal of a plane, the axis of a cylinder
    radius: float = 0.0
    inner: bool = False
    reference: int | None = None


@dataclass
class Pair:
    """Rows of the slave points, index of the obstacle, coefficient of friction."""

    nodes: np.ndarray
    obstacle: int = 0
    mu: float = 0.3


@dataclass
class Step:
    """What a step brings: values by (row, direction 0 to 2), reached at its end in a straight line.

    With `factors` (time from 0 to 1, factor) all of them follow that curve instead.
    """

    increments: int = 1
    fixed: dict = field(default_factory=dict)
    forces: dict = field(default_factory=dict)
    gravity: tuple | None = None  # acceleration of everything
    factors: tuple = ()


@dataclass
class Scene:
    """A contact problem: what the deck says, as numbers.

    `points` (N, 3) with the reference points of obstacles last, `elements` (E, 8) rows of them,
    `material_of` (E,) index into `materials`.
    """

    name: str
    axis: str
    points: np.ndarray
    elements: np.ndarray
    steps: list
    pairs: list
    obstacles: list = field(default_factory=lambda: [Obstacle()])
    materials: list = field(default_factory=lambda: [Material()])
    material_of: np.ndarray | None = None
    element: str = "C3D8"
    gaps: dict = field(default_factory=dict)  # row: what is added to the gap of the mesh
    tolerance: float = 1e-8
    rho: float = 1.0
    order: np.ndarray | None = None  # of the ids: point `row` is called order[row] + 1
    frequency: int = 1

    def named(self, name, axis=None, **changes):
        """Return this scene under another name, with some of it changed."""
        return replace(self, name=name, axis=axis or self.axis, **changes)

    @property
    def material_index(self):
        """Index of the material of each element, (E,)."""
        if self.material_of is None:
            return np.zeros(len(self.elements), dtype=int)
        return np.asarray(self.material_of)

    def ids(self):
        """The deck's ids of the points, (N,)."""
        order = np.arange(len(self.points)) if self.order is None else self.order
        return np.asarray(order) + 1


def number(value):
    """Return a number as a deck holds it: the shortest text that reads back the same."""
    return repr(float(value))


def deck(scene, solver="SOLVER=AUTO"):
    """Return the deck of a scene, solved by what `solver` says on the card *CONTACT SOLVER."""
    ids = scene.ids()
    lines = ["*HEADING", f"{scene.name}: {scene.axis}", "*NODE"]
    for row in np.argsort(ids):
        lines.append(", ".join([str(ids[row]), *map(number, scene.points[row])]))
    for m, material in enumerate(scene.materials):
        lines.append(f"*ELEMENT, TYPE={scene.element}, ELSET=PART-{m}")
        for e in np.flatnonzero(scene.material_index == m):
            lines.append(", ".join(map(str, [e + 1, *ids[scene.elements[e]]])))
        lines += [f"*MATERIAL, NAME=M-{m}", "*ELASTIC"]
        lines.append(f"{number(material.young)}, {number(material.poisson)}")
        if material.density > 0:
            lines += ["*DENSITY", number(material.density)]
        lines.append(f"*SOLID SECTION, ELSET=PART-{m}, MATERIAL=M-{m}")
    for o, obstacle in enumerate(scene.obstacles):
        reference = "" if obstacle.reference is None else f", REF NODE={ids[obstacle.reference]}"
        inner = ", INNER" if obstacle.inner else ""
        lines.append(f"*OBSTACLE, NAME=O-{o}, TYPE={obstacle.kind}{inner}{reference}")
        values = list(obstacle.point)
        if obstacle.kind != SPHERE:
            values += list(obstacle.direction)
        if obstacle.kind != PLANE:
            values.append(obstacle.radius)
        lines.append(", ".join(map(number, values)))
    for p, pair in enumerate(scene.pairs):
        lines.append(f"*NSET, NSET=SLAVE-{p}")
        lines += [str(ids[row]) for row in pair.nodes]
        lines += [f"*SURFACE INTERACTION, NAME=I-{p}", "*FRICTION", number(pair.mu)]
        lines += [f"*CONTACT PAIR, INTERACTION=I-{p}", f"SLAVE-{p}, O-{pair.obstacle}"]
    if scene.gaps:
        lines.append("*CONTACT GAP")
        lines += [f"{ids[row]}, {number(gap)}" for row, gap in scene.gaps.items()]
    lines.append(
        f"*CONTACT SOLVER, {solver}, RHO={number(scene.rho)}, TOLERANCE={number(scene.tolerance)}"
    )
    for s, step in enumerate(scene.steps):
        if step.factors:
            lines.append(f"*AMPLITUDE, NAME=CURVE-{s}")
            lines += [f"{number(time)}, {number(factor)}" for time, factor in step.factors]
    for s, step in enumerate(scene.steps):
        lines += step_lines(scene, step, f", AMPLITUDE=CURVE-{s}" if step.factors else "")
    return "\n".join(lines) + "\n"


def step_lines(scene, step, amplitude):
    """Return the lines of one step."""
    ids = scene.ids()
    lines = ["*STEP", "*STATIC, DIRECT", f"{number(1 / step.increments)}, 1."]
    if step.fixed:
        lines.append(f"*BOUNDARY{amplitude}")
        for (row, direction), value in step.fixed.items():
            lines.append(f"{ids[row]}, {direction + 1}, {direction + 1}, {number(value)}")
    if step.forces:
        lines.append(f"*CLOAD{amplitude}")
        for (row, direction), value in step.forces.items():
            lines.append(f"{ids[row]}, {direction + 1}, {number(value)}")
    if step.gravity is not None:
        size = float(np.linalg.norm(step.gravity))
        unit = np.asarray(step.gravity) / size
        lines.append(f"*DLOAD{amplitude}")
        for m in range(len(scene.materials)):
            lines.append(f"PART-{m}, GRAV, {number(size)}, {', '.join(map(number, unit))}")
    if scene.frequency > 1:
        lines += [f"*NODE FILE, FREQUENCY={scene.frequency}", "U, RF", "*CONTACT FILE"]
    return [*lines, "*END STEP"]


# --- Meshes ---------------------------------------------------------------------------------------


def grid(n, size=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0)):
    """Return points and elements of a box of n[0] x n[1] x n[2] elements, x fastest."""
    axes = [origin[i] + size[i] * np.arange(n[i] + 1) / n[i] for i in range(3)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    row = np.arange(len(points)).reshape(n[2] + 1, n[1] + 1, n[0] + 1)
    lower = [row[:-1, :-1, :-1], row[:-1, :-1, 1:], row[:-1, 1:, 1:], row[:-1, 1:, :-1]]
    upper = [row[1:, :-1, :-1], row[1:, :-1, 1:], row[1:, 1:, 1:], row[1:, 1:, :-1]]
    return points, np.stack([corner.ravel() for corner in lower + upper], axis=1)


def side(n, axis, last):
    """Return the rows of the points on one side of a grid: the last or the first across `axis`."""
    row = np.arange((n[0] + 1) * (n[1] + 1) * (n[2] + 1)).reshape(n[2] + 1, n[1] + 1, n[0] + 1)
    return np.take(row, -1 if last else 0, axis=2 - axis).ravel()


def held(rows, vector, directions=(0, 1, 2)):
    """Return the same values at many points, for `Step.fixed` or `Step.forces`."""
    return {(int(row), i): float(vector[i]) for row in rows for i in directions}


def shape_gradients(x):
    """Return gradients (8, 8, 3) by Gauss point and node, and weights (8,), of one element."""
    gradients, weights = [], []
    for g in CORNERS * GAUSS:
        one = 1 + g * CORNERS
        local = (
            0.125
            * CORNERS
            * np.column_stack([one[:, 1] * one[:, 2], one[:, 0] * one[:, 2], one[:, 0] * one[:, 1]])
        )
        jacobian = (x - x[0]).T @ local  # beside a node: coordinates far away lose no digits
        gradients.append(local @ np.linalg.inv(jacobian))
        weights.append(np.linalg.det(jacobian))
    return np.array(gradients), np.array(weights)


def stiffness(scene):
    """Return the dense stiffness (3N, 3N) of C3D8 elements in double precision."""
    k = np.zeros((3 * len(scene.points), 3 * len(scene.points)))
    for nodes, m in zip(scene.elements, scene.material_index, strict=True):
        young, poisson = scene.materials[m].young, scene.materials[m].poisson
        lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        shear = young / (2 * (1 + poisson))
        gradients, weights = shape_gradients(scene.points[nodes])
        moment = np.einsum("g,gai,gbj->aibj", weights, gradients, gradients)
        block = lame * moment + shear * moment.transpose(0, 3, 2, 1)
        block += shear * np.einsum("akbk,ij->aibj", moment, np.eye(3))
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        k[np.ix_(dofs, dofs)] += block.reshape(24, 24)
    return k


# --- The same scene, seen otherwise ---------------------------------------------------------------


def in_units(scene, length=1.0, force=1.0):
    """Return the scene in other units: lengths and forces times these."""
    stress = force / length**2
    return scene.named(
        scene.name,
        points=scene.points * length,
        obstacles=[
            replace(o, point=tuple(length * np.asarray(o.point)), radius=o.radius * length)
            for o in scene.obstacles
        ],
        materials=[
            Material(m.young * stress, m.poisson, m.density * stress / length**2)
            for m in scene.materials
        ],
        gaps={row: gap * length for row, gap in scene.gaps.items()},
        steps=[
            replace(
                step,
                fixed={key: value * length for key, value in step.fixed.items()},
                forces={key: value * force for key, value in step.forces.items()},
                gravity=None if step.gravity is None else tuple(length * np.asarray(step.gravity)),
            )
            for step in scene.steps
        ],
    )


def turned(scene, matrix, shift=(0.0, 0.0, 0.0)):
    """Return the scene turned or mirrored by an orthogonal `matrix` about the origin, then shifted.

    Where the matrix does more than exchange axes, a support must hold all three directions.
    """
    matrix = np.asarray(matrix, dtype=float)
    elements = scene.elements
    if np.linalg.det(matrix) < 0:
        elements = elements[:, [0, 3, 2, 1, 4, 7, 6, 5]]

    def vectors(values):
        """Turn values by (row, direction)."""
        turned_values = {}
        for row in dict.fromkeys(row for row, _ in values):
            given = [i for i in range(3) if (row, i) in values]
            vector = np.array([values.get((row, i), 0.0) for i in range(3)])
            named = np.abs(matrix[:, given]).max(axis=1) > 0
            if named.sum() != len(given):
                raise ValueError(f"{scene.name}: a support that is not turned by this matrix")
            for i in np.flatnonzero(named):
                turned_values[row, int(i)] = float(matrix[i] @ vector)
        return turned_values

    return scene.named(
        scene.name,
        points=scene.points @ matrix.T + shift,
        elements=elements,
        obstacles=[
            replace(o, point=tuple(matrix @ o.point + shift), direction=tuple(matrix @ o.direction))
            for o in scene.obstacles
        ],
        steps=[
            replace(
                step,
                fixed=vectors(step.fixed),
                forces=vectors(step.forces),
                gravity=None if step.gravity is None else tuple(matrix @ step.gravity),
            )
            for step in scene.steps
        ],
    )


def renumbered(scene, seed):
    """Return the scene with nodes numbered, and elements and slave nodes listed, at random."""
    rng = np.random.default_rng(seed)
    elements = rng.permutation(len(scene.elements))
    return scene.named(
        scene.name,
        order=rng.permutation(len(scene.points)),
        elements=scene.elements[elements],
        material_of=scene.material_index[elements],
        pairs=[replace(pair, nodes=rng.permutation(pair.nodes)) for pair in scene.pairs],
    )


def shuffled_deck(text, seed):
    """Return a deck with the cards above its first *STEP in another order."""
    rng = np.random.default_rng(seed)
    head, steps = text.split("*STEP\n", 1)
    cards = ["*" + card for card in head.split("\n*")]
    cards[0] = cards[0].removeprefix("*")
    together = ("*ELASTIC", "*DENSITY", "*FRICTION")  # belong to the card above
    groups = []
    for card in cards:
        if card.startswith(together):
            groups[-1].append(card)
        else:
            groups.append([card])
    lines = [card.rstrip("\n") for k in rng.permutation(len(groups)) for card in groups[k]]
    return "\n".join(lines) + "\n*STEP\n" + steps


# --- Families -------------------------------------------------------------------------------------


def block(name, axis, n=(2, 2, 2), size=(1.0, 1.0, 1.0), **options):
    """Return a block pressed on a plane by its upper side and pushed along it, as in the paper.

    Options: origin, young, poisson, mu, depth and push (shares of the height), angle (degrees),
    increments of the two steps, gap (of the block above the plane), and fields of `Scene`.
    """
    origin = np.asarray(options.pop("origin", (0.0, 0.0, 0.0)))
    gap = options.pop("gap", 0.0)
    depth, push = options.pop("depth", 0.1), options.pop("push", 0.4)
    angle = math.radians(options.pop("angle", 60.0))
    press, slide = options.pop("increments", (2, 3))
    mu = options.pop("mu", 0.3)
    material = Material(options.pop("young", 210000.0), options.pop("poisson", 0.3))
    points, elements = grid(n, size, origin + np.array([0.0, 0.0, gap]))
    top, height = side(n, 2, True), size[2]
    steps = [Step(press, held(top, (0.0, 0.0, -depth * height)))]
    if slide:
        way = push * height * np.array([math.cos(angle), math.sin(angle), 0.0])
        steps.append(Step(slide, held(top, way - np.array([0.0, 0.0, depth * height]))))
    return Scene(
        name,
        axis,
        points,
        elements,
        options.pop("steps", steps),
        [Pair(side(n, 2, False), 0, mu)],
        options.pop("obstacles", [Obstacle(point=tuple(origin))]),
        [material],
        **options,
    )


def free_cube(name, axis, gravity, mu=0.3, n=(2, 2, 2), size=1.0, young=1000.0, **options):
    """Return a cube that only contact holds, under its weight, on the plane z = 0."""
    points, elements = grid(n, (size, size, size))
    planes = options.pop("planes", 1)
    increments = options.pop("increments", 2)
    material = Material(young, options.pop("poisson", 0.3), options.pop("density", 1.0))
    normals = [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)][:planes]
    axes = [2, 0, 1][:planes]
    return Scene(
        name,
        axis,
        points,
        elements,
        options.pop("steps", [Step(increments, gravity=gravity)]),
        [Pair(side(n, a, False), i, mu) for i, a in enumerate(axes)],
        [Obstacle(direction=normal) for normal in normals],
        [material],
        **options,
    )


def friction_scenes():
    """Coefficients of friction from none to ten million, and at the loss of uniqueness."""
    for mu in (0.0, 1e-60, 1e-15, 1e-8, 0.3, 1.0, 2.07, 10.0, 1e3, 1e6):
        yield block(f"mu-{mu:g}", "friction", mu=mu)
    for mu in (1.0, 10.0, 1e6):
        yield block(f"mu-{mu:g}-reversed", "friction", mu=mu, steps=reversed_steps((2, 2, 2)))
    critical = critical_friction()
    for label, mu in (
        ("below-1e-6", critical * (1 - 1e-6)),
        ("below-1e-12", critical * (1 - 1e-12)),
        ("at", critical),
        ("above-1e-12", critical * (1 + 1e-12)),
        ("above-1e-6", critical * (1 + 1e-6)),
        ("twice", 2 * critical),
    ):
        for sign, way in ((1, "with"), (-1, "against")):
            yield one_foot(f"uniqueness-{label}-{way}", "uniqueness", mu, sign * 0.2)


def leaning(n=(1, 1, 3), lean=0.7):
    """Return points and elements of a column that leans along x, and the row of its lowest foot."""
    points, elements = grid(n)
    points[:, 0] += lean * points[:, 2]
    points[0, 2] -= 0.05
    return points, elements, 0


def one_foot(name, axis, mu, push=0.2, **options):
    """Return a leaning column that one node stands on: pressing it pushes the foot sideways."""
    points, elements, foot = leaning()
    top = side((1, 1, 3), 2, True)
    steps = [
        Step(2, held(top, (0.0, 0.0, -0.02))),
        Step(3, held(top, (push, 0.0, -0.02))),
    ]
    return Scene(
        name,
        axis,
        points,
        elements,
        options.pop("steps", steps),
        [Pair(np.array([foot]), 0, mu)],
        [Obstacle(point=tuple(points[foot]))],
        **options,
    )


def critical_friction():
    """Return the friction at which a foot of `one_foot` may slide without a change of its gap.

    There W_nn = mu |W_nt|: the slide that presses the foot down needs no force any more.
    """
    scene = one_foot("compliance", "", 0.3)
    top = side((1, 1, 3), 2, True)
    free = np.setdiff1d(np.arange(3 * len(scene.points)), 3 * top[:, None] + np.arange(3))
    foot = np.searchsorted(free, np.arange(3))
    k = stiffness(scene)[np.ix_(free, free)]
    compliance = np.linalg.solve(k, np.eye(len(free))[:, foot])[foot]
    return float(compliance[2, 2] / np.hypot(compliance[2, 0], compliance[2, 1]))


def reversed_steps(n, height=1.0, way=0.4, increments=3):
    """Return steps that press the top of a grid, push it, and push it back beyond the start."""
    top = side(n, 2, True)
    down = -0.1 * height
    return [
        Step(1, held(top, (0.0, 0.0, down))),
        Step(increments, held(top, (way * height, 0.0, down))),
        Step(increments, held(top, (-way * height, 0.0, down))),
        Step(increments, held(top, (0.0, 0.0, down))),
    ]


def rho_scenes():
    """Factors of rho's natural scale; only the sweeps know them."""
    for rho in (1e-12, 1e-6, 1e-3, 0.1, 0.5, 1.0, 1.9, 2.5, 10.0, 1e3, 1e6, 1e12):
        yield block(f"rho-{rho:g}", "rho", rho=rho, increments=(1, 1))


def material_scenes():
    """Poisson's ratio and Young's modulus over all that is admissible."""
    for nu in (-0.99, -0.9, -0.5, 0.0, 0.49, 0.4999, 0.499999, 0.4999999):
        yield block(f"nu-{nu}", "Poisson", poisson=nu)
    for nu in (0.4999, 0.4999999):
        yield block(f"nu-{nu}-mean-dilatation", "Poisson", poisson=nu, element="C3D8B")
    yield block("nu--0.999999", "Poisson", poisson=-0.999999)
    for young in (1e-9, 1e-3, 1.0, 1e9, 1e18):
        yield block(f"young-{young:g}", "Young", young=young)


def size_scenes():
    """Sizes of the body and its distance from the origin."""
    for size in (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9):
        yield block(f"size-{size:g}", "size", size=(size, size, size))
    for far in (1e3, 1e6):
        for label, direction in (("x", (1, 0, 0)), ("z", (0, 0, 1)), ("xyz", (1, -1, 1))):
            origin = far * np.array(direction, dtype=float)
            yield block(f"far-{far:g}-{label}", "distance", origin=origin)
    yield block("far-1e6-small", "distance", size=(1e-3,) * 3, origin=(1e3, 1e3, 1e3))
    yield block("far-1e6-sliding-free", "distance", origin=(1e6, 0.0, 0.0), mu=0.0)


def shape_scenes():
    """Plates, needles, slivers, and elements distorted up to the limit of the Jacobian."""
    for ratio in (10.0, 1e3, 1e6):
        yield block(f"plate-{ratio:g}", "aspect", size=(1.0, 1.0, 1 / ratio))
        yield block(f"needle-{ratio:g}", "aspect", size=(1 / ratio, 1 / ratio, 1.0))
        yield block(f"sliver-{ratio:g}", "aspect", size=(1.0, 1 / ratio, 1.0))
    yield block("needle-1e4-lying", "aspect", size=(1.0, 1e-4, 1e-4))
    rng = np.random.default_rng(7)
    for share in (0.1, 0.3):
        scene = block(f"distorted-{share:g}", "distortion", n=(3, 3, 3))
        inside = np.all((scene.points > 0.01) & (scene.points < 0.99), axis=1)
        scene.points[inside] += rng.uniform(-share / 3, share / 3, (inside.sum(), 3))
        yield scene
    for least in (1e-1, 1e-3, 1e-6, 1e-9, 1e-12):
        yield flattened(f"flat-corner-{least:g}", least)
    yield flattened("flat-corner-turned", -1e-6)


def flattened(name, least):
    """Return a block one of whose elements has a corner pushed in until its Jacobian is `least`."""
    scene = block(name, "distortion")
    # The far upper corner of the grid: within its element the determinant there goes as 1 - 2 s.
    corner = len(scene.points) - 1
    lowest, highest = scene.points[scene.elements[-1][0]], scene.points[corner].copy()
    scene.points[corner] = highest + (lowest - highest) * (1 - least) / 3 * 1.0
    x = scene.points[scene.elements[-1]]
    low, high = 0.0, 1.0
    for _ in range(200):
        middle = (low + high) / 2
        x[6] = highest + (lowest - highest) * middle
        low, high = (middle, high) if corner_jacobian(x) > least else (low, middle)
    scene.points[corner] = highest + (lowest - highest) * low
    return scene


def corner_jacobian(x):
    """Return the least determinant at the corners of an element, of a unit one 1."""
    values = []
    for corner in CORNERS:
        one = 1 + corner * CORNERS
        local = (
            0.125
            * CORNERS
            * np.column_stack([one[:, 1] * one[:, 2], one[:, 0] * one[:, 2], one[:, 0] * one[:, 1]])
        )
        values.append(np.linalg.det((x - x[0]).T @ local))
    return 64 * min(values)


def stiffness_scenes():
    """Two materials in one body, and two bodies, up to a ratio of 1e12."""
    for ratio in (1e3, 1e6, 1e12):
        for label, lower, upper in (("foot", 1.0, ratio), ("head", ratio, 1.0)):
            scene = block(f"stiff-{label}-{ratio:g}", "stiffness ratio")
            scene.materials = [Material(lower * 1000.0), Material(upper * 1000.0)]
            scene.material_of = np.array([0] * 4 + [1] * 4)
            yield scene
        yield two_blocks(f"two-bodies-{ratio:g}", "stiffness ratio", 1000.0, 1000.0 * ratio)


def two_blocks(name, axis, first, second, gap=0.0):
    """Return two blocks beside one another on one plane, of two stiffnesses."""
    one = block(name, axis)
    other = block(name, axis, origin=(2.0, 0.0, 0.0))
    shift = len(one.points)
    points = np.vstack([one.points, other.points + np.array([0.0, 0.0, gap])])
    steps = []
    for a, b in zip(one.steps, other.steps, strict=True):
        fixed = a.fixed | {(row + shift, i): value for (row, i), value in b.fixed.items()}
        steps.append(Step(a.increments, fixed))
    return Scene(
        name,
        axis,
        points,
        np.vstack([one.elements, other.elements + shift]),
        steps,
        [Pair(np.concatenate([one.pairs[0].nodes, other.pairs[0].nodes + shift]), 0, 0.3)],
        materials=[Material(first), Material(second)],
        material_of=np.array([0] * len(one.elements) + [1] * len(other.elements)),
    )


def motion_scenes():
    """Tiny and huge steps, motions that turn back, circle, lift off and return; many steps."""
    n = (2, 2, 2)
    top = side(n, 2, True)
    for depth in (1e-15, 1e-9, 1e-5, 1.0, 10.0):
        yield block(f"press-{depth:g}", "step size", depth=depth, push=4 * depth)
    for push in (1e-15, 1e-9, 10.0, 1e6):
        yield block(f"push-{push:g}", "step size", push=push)
    yield block("reversed", "path", steps=reversed_steps(n))
    circle = [Step(1, held(top, (0.0, 0.0, -0.1)))]
    for k in range(1, 13):
        way = (0.3 * math.sin(k * math.pi / 6), 0.3 * (1 - math.cos(k * math.pi / 6)), -0.1)
        circle.append(Step(1, held(top, way)))
    yield block("circling", "path", steps=circle)
    lift = Step(
        10, held(top, (0.0, 0.0, -0.1)), factors=((0.0, 1.0), (0.3, -1.0), (0.7, -1.0), (1.0, 1.2))
    )
    yield block("lift-off-and-return", "path", steps=[Step(1, held(top, (0, 0, -0.1))), lift])
    steady = Step(1, held(top, (0, 0, -0.1)))
    once = Step(1, held(top, (0.3, 0.0, -0.1)), factors=((0.0, 1.0), (0.5, -1.0), (1.0, 1.0)))
    yield block("lift-off-within-an-increment", "path", steps=[steady, once])
    away = [Step(1, held(top, (0, 0, -0.1))), Step(1, held(top, (0, 0, 5.0)))]
    yield block("lift-off-for-good", "path", steps=away)
    yield block(
        "reversed-each-increment",
        "path",
        steps=[Step(1, held(top, (0, 0, -0.1)))]
        + [Step(1, held(top, ((-1) ** k * 0.2, 0.0, -0.1))) for k in range(8)],
    )
    yield block("one-step", "path", increments=(1, 0))
    yield block("10000-steps", "path", n=(1, 1, 1), increments=(2000, 8000), frequency=1000)
    yield block(
        "no-motion-after-press",
        "path",
        steps=[Step(1, held(top, (0, 0, -0.1))), Step(3, held(top, (0, 0, -0.1)))],
    )


def load_scenes():
    """No load, touching, gaps of rounding, overlaps, loads of all sizes on free bodies."""
    n = (2, 2, 2)
    top = side(n, 2, True)
    eps = 2.0**-52
    yield block("no-load", "gap", steps=[Step(2, held(top, (0, 0, 0)))])
    yield block("no-load-no-friction", "gap", mu=0.0, steps=[Step(2, held(top, (0, 0, 0)))])
    for gap, label in ((eps, "rounding"), (-eps, "minus-rounding"), (1e-9, "1e-9"), (0.05, "0.05")):
        yield block(f"gap-{label}", "gap", gap=gap)
    yield block("gap-rounding-only", "gap", gap=eps, depth=eps, push=4 * eps)
    yield block("gap-never-closed", "gap", gap=0.2)
    yield block("gap-exactly-closed", "gap", gap=0.125, depth=0.125)
    yield block("overlap-half", "gap", gap=-0.5, depth=0.0)
    yield block("overlap-five-sizes", "gap", gap=-5.0, depth=0.0)
    yield block("overlap-rounding-free", "gap", gap=-eps, depth=0.0, push=0.0)
    for size in (1e-12, 1.0, 1e6):
        yield free_cube(f"weight-{size:g}", "free body", (0.0, 0.0, -10.0 * size))
    yield free_cube("weight-tilted-held", "free body", (2.0, 1.0, -10.0))
    yield free_cube("weight-tilted-sliding", "free body", (4.0, 1.0, -10.0))
    yield free_cube("weight-up", "free body", (0.0, 0.0, 10.0))
    yield free_cube("weight-frictionless", "free body", (0.0, 0.0, -10.0), mu=0.0)
    yield free_cube("weight-toppling", "free body", (20.0, 0.0, -10.0), mu=10.0)
    yield free_cube("weight-toppling-limit", "free body", (10.0, 0.0, -10.0), mu=10.0)
    for margin in (-1e-6, -1e-9, 0.0, 1e-9, 1e-6):
        slope = 0.3 * (1 + margin)
        yield free_cube(f"slope-limit-{margin:g}", "slip limit", (10 * slope, 0.0, -10.0))
    yield free_cube("no-weight", "free body", None, steps=[Step(2, forces={(0, 2): 0.0})])
    yield free_cube("light-and-soft", "free body", (0, 0, -1e-9), young=1e-6, density=1e-9)
    for margin in (-1e-6, -1e-12, 0.0, 1e-12, 1e-6):
        yield at_the_limit(f"uniform-limit-{margin:g}", margin)


def at_the_limit(name, margin, mu=0.3, pressure=10.0):
    """Return an element whose feet carry equal forces, `margin` beyond the limit of friction.

    The upper side is prescribed such that the strain is uniform, and loads on the feet take what
    is not pressure and friction.
    """
    points, elements = grid((1, 1, 1))
    scene = Scene(name, "slip limit", points, elements, [], [Pair(np.arange(4), 0, mu)])
    scene.materials = [Material(1000.0, 0.0)]
    top = np.arange(4, 8)
    normal, shear = -pressure / 1000.0, 2 * mu * pressure / 1000.0
    displacement = np.zeros((8, 3))
    displacement[top] = (shear, 0.0, normal)
    force = (stiffness(scene) @ displacement.ravel()).reshape(8, 3)
    # What holds the feet is the force they need: pressure/4 up and, against the push, friction.
    reaction = np.array([-mu * pressure / 4 * (1 + margin), 0.0, pressure / 4])
    loads = force[:4] - reaction
    first = Step(1, held(top, (0.0, 0.0, normal)))
    pressed = np.zeros((8, 3))
    pressed[top] = (0.0, 0.0, normal)
    second = Step(2, held(top, (shear, 0.0, normal)))
    second.forces = {
        (row, i): float(loads[row, i]) for row in range(4) for i in range(3) if loads[row, i] != 0
    }
    scene.steps = [first, second]
    return scene


def obstacle_scenes():
    """Few points, redundant ones, obstacles beside an element: small, large, round, inside."""
    n = (2, 2, 2)
    bottom, top = side(n, 2, False), side(n, 2, True)
    yield one_foot("one-point", "points", 0.3)
    scene = block("all-points", "points")
    everything = np.setdiff1d(np.arange(len(scene.points)), top)
    yield scene.named("all-points", pairs=[Pair(everything, 0, 0.3)])
    yield scene.named("prescribed-points", pairs=[Pair(np.arange(len(scene.points)), 0, 0.3)])
    yield scene.named(
        "same-plane-twice",
        "redundant",
        obstacles=[Obstacle(), Obstacle()],
        pairs=[Pair(bottom, 0, 0.3), Pair(bottom, 1, 0.3)],
    )
    yield scene.named(
        "same-plane-three-frictions",
        "redundant",
        obstacles=[Obstacle()] * 3,
        pairs=[Pair(bottom, 0, 0.0), Pair(bottom, 1, 0.3), Pair(bottom, 2, 10.0)],
    )
    tilted = math.radians(1e-6)
    yield scene.named(
        "nearly-the-same-plane",
        "redundant",
        obstacles=[Obstacle(), Obstacle(direction=(math.sin(tilted), 0.0, math.cos(tilted)))],
        pairs=[Pair(bottom, 0, 0.3), Pair(bottom, 1, 0.3)],
    )
    wall = side(n, 0, True)
    yield scene.named(
        "between-two-walls",
        "redundant",
        obstacles=[
            Obstacle(),
            Obstacle(direction=(1, 0, 0)),
            Obstacle(point=(1, 0, 0), direction=(-1, 0, 0)),
        ],
        pairs=[
            Pair(bottom, 0, 0.3),
            Pair(np.setdiff1d(side(n, 0, False), top), 1, 0.3),
            Pair(np.setdiff1d(wall, top), 2, 0.3),
        ],
        steps=[Step(2, held(top, (0, 0, -0.1))), Step(2, held(top, (0.0, 0.2, -0.1)))],
    )
    for mu in (0.0, 0.3, 10.0):
        yield free_cube(f"corner-{mu:g}", "redundant", (-4.8, -3.6, -8.0), mu=mu, planes=3)
    yield block(
        "corner-pressed",
        "redundant",
        steps=[Step(2, held(top, (-0.05, -0.05, -0.1)))],
        obstacles=[Obstacle(), Obstacle(direction=(1, 0, 0)), Obstacle(direction=(0, 1, 0))],
    ).named(
        "corner-pressed",
        pairs=[
            Pair(bottom, 0, 0.3),
            Pair(np.setdiff1d(side(n, 0, False), top), 1, 0.3),
            Pair(np.setdiff1d(side(n, 1, False), top), 2, 0.3),
        ],
    )
    for radius, label in ((1e-3, "on-node"), (1e-3, "beside-node"), (1e3, "large"), (1e9, "flat")):
        x = 0.5 if label != "beside-node" else 0.6
        tool = Obstacle(SPHERE, (x, 0.5, -radius), radius=radius)
        yield block(
            f"sphere-{radius:g}-{label}",
            "obstacle",
            steps=[Step(2, held(top, (0, 0, -0.05))), Step(2, held(top, (0.02, 0.01, -0.05)))],
            obstacles=[tool],
        )
    yield block(
        "cylinder-thin",
        "obstacle",
        steps=[Step(2, held(top, (0, 0, -0.02)))],
        obstacles=[Obstacle(CYLINDER, (0.5, 0.5, -0.01), (0, 1, 0), 0.01)],
    )
    yield block(
        "sphere-tenth",
        "obstacle",
        n=(4, 4, 2),
        steps=[
            Step(4, held(side((4, 4, 2), 2, True), (0, 0, -0.02))),
            Step(4, held(side((4, 4, 2), 2, True), (0.05, 0.0, -0.02))),
        ],
        obstacles=[Obstacle(SPHERE, (0.5, 0.5, -0.1), radius=0.1)],
    )
    yield block(
        "bowl",
        "obstacle",
        steps=[Step(2, held(top, (0, 0, -0.05))), Step(2, held(top, (0.05, 0.0, -0.05)))],
        obstacles=[
            Obstacle(SPHERE, (0.5, 0.5, math.sqrt(9.5)), radius=math.sqrt(10.0), inner=True)
        ],
    )
    yield prescribed_touching("prescribed-touching", 0.0)
    yield prescribed_touching("prescribed-touching-turned", 0.3)
    yield pushed_tool("tool-under-force", "obstacle", -5.0)
    yield pushed_tool("tool-under-tiny-force", "obstacle", -1e-12)
    yield pushed_tool("tool-pulled-away", "obstacle", 5.0)


def prescribed_touching(name, angle):
    """Return an element whose nodes are all held, and touch a plane, which may lean by `angle`."""
    n = (1, 1, 1)
    scene = block(name, "points", n=n, origin=(0.1, 0.1, 0.1))
    fixed = held(range(len(scene.points)), (0.0, 0.0, 0.0))
    turn = [
        [math.cos(angle), 0, math.sin(angle)],
        [0, 1, 0],
        [-math.sin(angle), 0, math.cos(angle)],
    ]
    obstacle = Obstacle(point=(0.0, 0.0, 0.1))
    return turned(scene.named(name, steps=[Step(1, fixed)], obstacles=[obstacle]), turn)


def pushed_tool(name, axis, force):
    """Return a block held below, with a plane above it that a force moves along z."""
    n = (2, 2, 2)
    scene = block(name, axis)
    points = np.vstack([scene.points, [0.5, 0.5, 1.5]])
    tool = len(points) - 1
    bottom, top = side(n, 2, False), side(n, 2, True)
    fixed = held(bottom, (0, 0, 0)) | {(tool, 0): 0.0, (tool, 1): 0.0}
    return scene.named(
        name,
        points=points,
        pairs=[Pair(top, 0, 0.3)],
        obstacles=[Obstacle(point=(0, 0, 1), direction=(0, 0, -1), reference=tool)],
        steps=[Step(2, fixed, {(tool, 2): force}), Step(2, {(tool, 0): 0.01}, {(tool, 2): force})],
    )


def tolerance_scenes():
    """Tolerances from all that double precision holds to hardly any."""
    for tolerance in (1e-15, 1e-14, 1e-12, 1e-3, 0.5):
        yield block(f"tolerance-{tolerance:g}", "tolerance", tolerance=tolerance)


def harsh_pairs():
    """Two extremes at once."""
    axis = "pair"
    yield block("incompressible-mu-1e6", axis, poisson=0.4999999, mu=1e6)
    yield block("incompressible-no-friction", axis, poisson=0.4999999, mu=0.0)
    yield block("auxetic-mu-1e6", axis, poisson=-0.99, mu=1e6)
    yield block("small-and-stiff", axis, size=(1e-9,) * 3, young=1e18)
    yield block("small-and-soft", axis, size=(1e-9,) * 3, young=1e-9)
    yield block("large-and-stiff", axis, size=(1e9,) * 3, young=1e18)
    yield block("large-and-soft", axis, size=(1e9,) * 3, young=1e-9)
    yield block("far-and-tiny-step", axis, origin=(1e6, 1e6, 1e6), depth=1e-9, push=4e-9)
    yield block("small-soft-tiny-step", axis, size=(1e-9,) * 3, young=1e-9, depth=1e-15, push=4e-15)
    yield block("push-1e9-slides", axis, push=1e9)
    yield block("push-1e9-sticks", axis, push=1e9, mu=1e6)
    yield block("press-1e-15-push-1", axis, depth=1e-15, push=1.0)
    yield block("press-1e-15-push-1-mu-10", axis, depth=1e-15, push=1.0, mu=10.0)
    yield block("gap-rounding-push-mu-1", axis, gap=2.0**-52, depth=2.0**-52, mu=1.0)
    yield block("grazing", axis, depth=0.0, push=1.0)
    yield block("grazing-mu-1e6", axis, depth=0.0, push=1.0, mu=1e6)
    yield block("grazing-far", axis, depth=0.0, push=1.0, origin=(1e6, 1e6, 1e6))
    yield block("grazing-off-by-rounding", axis, depth=1e-17, push=1.0)
    yield block("far-and-mu-10", axis, origin=(1e6, 1e6, 1e6), mu=10.0)
    yield block("far-incompressible", axis, origin=(1e6, 1e6, 1e6), poisson=0.4999999)
    yield block("plate-incompressible", axis, size=(1.0, 1.0, 1e-3), poisson=0.4999)
    yield block("needle-mu-1e3", axis, size=(1e-3, 1e-3, 1.0), mu=1e3)
    yield block("needle-tiny-step", axis, size=(1e-3, 1e-3, 1.0), depth=1e-12, push=1e-12)
    yield block("mu-1e3-reversed", axis, mu=1e3, steps=reversed_steps((2, 2, 2)))
    yield block("rho-1e-6-mu-10", axis, mu=10.0, rho=1e-6, increments=(1, 1))
    yield block("rho-1e6-nu-0.4999", axis, poisson=0.4999, rho=1e6, increments=(1, 1))
    yield block("overlap-incompressible", axis, gap=-0.5, depth=0.0, poisson=0.4999999)
    yield block("tolerance-1e-15-incompressible", axis, tolerance=1e-15, poisson=0.4999999)
    yield block("tolerance-1e-15-mu-1e6", axis, tolerance=1e-15, mu=1e6)
    yield block("huge-step-incompressible", axis, depth=10.0, push=40.0, poisson=0.4999999)
    scene = block("stiff-foot-1e6-mu-10", axis, mu=10.0)
    scene.materials = [Material(1000.0), Material(1e9)]
    scene.material_of = np.array([0] * 4 + [1] * 4)
    yield scene
    yield two_blocks("two-bodies-1e12-late", axis, 1000.0, 1e15, gap=0.0)
    yield two_blocks("two-bodies-1e6-gap", axis, 1000.0, 1e9, gap=0.05)
    yield free_cube("free-stiff-1e18", axis, (2.0, 1.0, -10.0), young=1e18)
    yield free_cube("free-soft-1e-3", axis, (2.0, 1.0, -10.0), young=1e-3)
    yield free_cube("free-huge", axis, (2.0, 1.0, -10.0), size=1e6, young=1e12)
    yield free_cube("free-corner-limit", axis, (-4.8, -3.6, -8.0), mu=1e6, planes=3)
    yield free_cube("free-tolerance-1e-13", axis, (2.0, 1.0, -10.0), tolerance=1e-13)
    yield free_cube("free-small-far-weight", axis, (2.0, 0.0, -10.0), size=1e-6, young=1e9)
    yield free_cube("free-mu-1e6", axis, (9.0, 0.0, -10.0), mu=1e6)
    yield free_cube("free-incompressible", axis, (2.0, 1.0, -10.0), poisson=0.4999999)
    yield flattened("flat-corner-1e-6-mu-10", 1e-6).named("flat-corner-1e-6-mu-10", axis)


FAMILIES = (
    friction_scenes,
    rho_scenes,
    material_scenes,
    size_scenes,
    shape_scenes,
    stiffness_scenes,
    motion_scenes,
    load_scenes,
    obstacle_scenes,
    tolerance_scenes,
    harsh_pairs,
)


def all_scenes():
    """Return every scene of the matrix, each name once."""
    scenes = [scene for family in FAMILIES for scene in family()]
    names = [scene.name for scene in scenes]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise ValueError(f"scenes of the same name: {', '.join(sorted(twice))}")
    return scenes
