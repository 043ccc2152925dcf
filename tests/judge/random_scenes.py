"""Random scenes: small bodies, obstacles, loads and paths of every kind that a deck can say."""

from itertools import pairwise

import numpy as np
from elements import CORNERS, FACES
from scenes import (
    CYLINDER,
    FACETS,
    PLANE,
    SPHERE,
    Boundary,
    Force,
    Gravity,
    Material,
    Obstacle,
    Pair,
    Part,
    Pressure,
    Scene,
    Step,
)

SIDES = ("XMIN", "XMAX", "YMIN", "YMAX", "ZMIN", "ZMAX")
ELEMENTS = ("C3D8", "C3D8I", "C3D8B")
OUTWARD = {side: (1 if side.endswith("MAX") else -1) * np.eye(3)["XYZ".index(side[0])]
           for side in SIDES}  # fmt: skip


def turns_of_the_cube():
    """The 24 ways to number an element's nodes without turning it inside out."""
    corners = CORNERS.astype(int)
    turns = []
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in corners:
            matrix = np.zeros((3, 3), dtype=int)
            matrix[range(3), axes] = signs
            if round(np.linalg.det(matrix)) == 1:
                turned = corners @ matrix.T
                turns.append([int(np.flatnonzero((corners == t).all(axis=1))[0]) for t in turned])
    return turns


TURNS = turns_of_the_cube()


class Builder:
    """Gathers a scene piece by piece."""

    def __init__(self, seed, rng):
        self.rng = rng
        self.points, self.ids, self.elements, self.element_ids = [], [], [], []
        self.scene = Scene(
            seed, None, None, None, None, None, [], [], [], [], [], [], element_ids=None
        )

    # -- draws --------------------------------------------------------------------------------

    def chance(self, p):
        """True with probability `p`."""
        return bool(self.rng.random() < p)

    def pick(self, *values, p=None):
        """One of some values."""
        return values[self.rng.choice(len(values), p=p)]

    def between(self, low, high):
        """Uniform."""
        return float(self.rng.uniform(low, high))

    def power(self, low, high):
        """Ten to a uniform power."""
        return float(10 ** self.rng.uniform(low, high))

    def friction(self):
        """A coefficient of friction, 0 to 2."""
        kind = self.rng.random()
        if kind < 0.2:
            return 0.0
        if kind < 0.65:
            return round(self.between(0.02, 0.5), 3)
        return round(self.between(0.5, 2.0), 3)

    def way(self):
        """A random unit vector."""
        v = self.rng.normal(size=3)
        return v / np.linalg.norm(v)

    # -- pieces -------------------------------------------------------------------------------

    def material(self, young, poisson=None, density=None):
        """Index of a new material."""
        if poisson is None:
            often = [0.4, 0.15, 0.2, 0.1, 0.1, 0.05]
            poisson = self.pick(0.3, 0.0, 0.25, 0.45, -0.3, 0.49, p=often)
        self.scene.materials.append(Material(young, poisson, density))
        return len(self.scene.materials) - 1

    def part(self, corner, size, cells, material, element=None, explicit=None, distorted=None,
             upper=None):  # fmt: skip
        """A body; `upper` is the material of the upper half of its elements."""
        rng, scene = self.rng, self.scene
        element = element or self.pick(*ELEMENTS, p=[0.5, 0.3, 0.2])
        explicit = self.chance(0.55) if explicit is None else explicit
        distorted = (explicit and self.chance(0.6)) if distorted is None else distorted
        corner, size = np.asarray(corner, dtype=float), np.asarray(size, dtype=float)
        first, first_element = len(self.points), len(self.elements)
        n = np.asarray(cells)
        axes = [np.arange(m + 1) / m for m in cells]
        for z in axes[2]:
            for y in axes[1]:
                for x in axes[0]:
                    place = np.array([x, y, z])
                    if distorted:
                        # Points of a side stay in its plane.
                        inside = (place > 0) & (place < 1)
                        place = place + inside * rng.uniform(-0.22, 0.22, 3) / n
                    self.points.append(corner + size * place)
        count = len(self.points) - first
        start = max(self.ids, default=0)
        if explicit:
            chosen = start + 1 + rng.permutation(2 * count)[:count]
            self.ids += [int(i) for i in chosen]
        else:
            self.ids += range(start + 1, start + count + 1)
        row, layer = n[0] + 1, (n[0] + 1) * (n[1] + 1)
        turned = explicit and self.chance(0.5)
        start = max(self.element_ids, default=0)
        for k in range(n[2]):
            for j in range(n[1]):
                for i in range(n[0]):
                    base = first + i + row * j + layer * k
                    low = [base, base + 1, base + 1 + row, base + row]
                    nodes = np.array(low + [b + layer for b in low])
                    if turned:
                        nodes = nodes[TURNS[rng.integers(24)]]
                    self.elements.append(nodes)
        total = len(self.elements) - first_element
        if explicit:
            self.element_ids += [int(i) for i in start + 1 + rng.permutation(2 * total)[:total]]
        else:
            self.element_ids += range(start + 1, start + total + 1)
        elements = range(first_element, len(self.elements))
        name = f"B{len(scene.parts)}"
        materials = [material] * total
        if upper is not None:
            materials = [upper if 2 * (b // (n[0] * n[1])) >= n[2] else material
                         for b in range(total)]  # fmt: skip
            explicit_ok = set(materials)
            assert len(explicit_ok) <= 2
        part = Part(name, element, explicit, tuple(int(c) for c in cells), corner, size,
                    range(first, len(self.points)), elements, {}, materials)  # fmt: skip
        part.sides = {side: self.side_faces(part, side) for side in SIDES}
        scene.parts.append(part)
        return len(scene.parts) - 1

    def side_faces(self, part, side):
        """[(element, face)] of a side."""
        nx, ny = (c + 1 for c in part.cells[:2])
        axis, last = "XYZ".index(side[0]), side.endswith("MAX")
        faces = []
        for b in part.elements:
            for f, corners in enumerate(FACES):
                local = self.elements[b][list(corners)] - part.rows[0]
                place = np.array([local % nx, local // nx % ny, local // (nx * ny)])[axis]
                if np.all(place == (part.cells[axis] if last else 0)):
                    faces.append((b, f))
        return faces

    def obstacle(self, kind, point, direction=None, radius=0.0, inner=False, free=False):
        """Index of a new obstacle; with a reference node if `free`."""
        reference = None
        if free:
            reference = len(self.points)
            self.points.append(np.asarray(point, dtype=float) + self.rng.uniform(-1, 1, 3))
            self.ids.append(max(self.ids) + int(self.rng.integers(1, 50)))
        name = f"O{len(self.scene.obstacles)}"
        direction = None if direction is None else np.asarray(direction, dtype=float)
        point = np.asarray(point, dtype=float)
        self.scene.obstacles.append(
            Obstacle(name, kind, point, direction, radius, inner, reference)
        )
        return len(self.scene.obstacles) - 1

    def plane_at(self, part, side, gap=0.0, tilt=0.0, free=False):
        """A plane before a side of a part, facing it."""
        part = self.scene.parts[part]
        outward = OUTWARD[side]
        middle = part.corner + part.size / 2
        point = middle + outward * (part.size @ np.abs(outward) / 2 + gap)
        normal = -outward
        if tilt:
            normal = normal + tilt * (1 - np.abs(outward)) * self.rng.uniform(-1, 1, 3)
            # The plane stays clear of the side.
            reach = np.abs(normal * (1 - np.abs(outward))) @ part.size / 2
            point = point + outward * reach
        if self.chance(0.5):
            normal = normal * self.between(0.5, 3)
        return self.obstacle(PLANE, point, normal, free=free)

    def facets(self, kind, corners, facets, point, fixed=False, back=False, text=False):
        """Index of a new obstacle of facets, with a reference node at `point`."""
        corners = np.asarray(corners, dtype=float)
        rows = None
        if kind == FACETS:
            rows = range(len(self.points), len(self.points) + len(corners))
            self.points += list(corners)
            self.ids += range(max(self.ids) + 7, max(self.ids) + 7 + len(corners))
        reference = None
        if kind == FACETS or not fixed:
            reference = len(self.points)
            self.points.append(np.asarray(point, dtype=float))
            self.ids.append(max(self.ids) + 3)
        name = f"O{len(self.scene.obstacles)}"
        self.scene.obstacles.append(
            Obstacle(name, kind, corners[0], reference=reference, corners=corners, facets=facets,
                     corner_rows=rows, back=back, text=text)
        )  # fmt: skip
        return len(self.scene.obstacles) - 1

    def touch(self, slave, master, friction=None, **options):
        """A contact pair of two surfaces, (part, side) each."""
        friction = self.friction() if friction is None else friction
        self.scene.pairs.append(Pair(*slave, None, friction, master, **options))

    def pair(self, part, side, obstacle, friction=None):
        """A contact pair."""
        friction = self.friction() if friction is None else friction
        self.scene.pairs.append(Pair(part, side, obstacle, friction))

    def side(self, part, side):
        """(rows, name) of the points of a side."""
        part_ = self.scene.parts[part]
        rows = sorted({int(r) for b, f in part_.sides[side]
                       for r in self.elements[b][list(FACES[f])]})  # fmt: skip
        return rows, f"{part_.name}-{side}"

    def hold(self, step, part, side, dofs, value=0.0, amplitude=None):
        """Prescribe displacements of a side."""
        rows, name = self.side(part, side)
        for dof in dofs:
            step.boundaries.append(Boundary(rows, dof, value, amplitude, name))

    def step(self):
        """A new step."""
        period = self.pick(1.0, 1.0, 2.0, 0.5, 0.3)
        step = Step(period, int(self.rng.integers(1, 5)), self.chance(0.6))
        self.scene.steps.append(step)
        return step

    def amplitude(self, step, jump=None):
        """Index of a new amplitude over a step; often it ends away from 1, or jumps."""
        kind = self.rng.random()
        t = step.period
        if jump or (jump is None and kind < 0.35):
            value = self.pick(1.0, 1.0, -0.5, 0.3)
            table = self.pick(
                ([0.0, t], [value, value]),
                ([0.0, 1e-3 * t, t], [0.0, value, 1.0]),
                ([0.5 * t, 0.5001 * t], [0.0, 1.0]),
                ([0.0], [1.0]),
            )
        elif kind < 0.7:
            m = int(self.rng.integers(2, 5))
            times = np.sort(self.rng.uniform(0, t, m))
            values = self.rng.uniform(-1, 1, m)
            table = (list(times), list(values))
        else:
            table = ([0.0, 0.5 * t, t], [0.0, 1.0, self.pick(0.0, 0.5, 1.0)])
        times = list(table[0])
        for a, b in pairwise(times):
            assert b > a
        self.scene.amplitudes.append((times, list(table[1])))
        return len(self.scene.amplitudes) - 1

    def maybe_amplitude(self, step, p=0.25):
        """An amplitude or None."""
        return self.amplitude(step) if self.chance(p) else None

    # -- what every scene may have ------------------------------------------------------------

    def add_controls(self):
        """Solver, tolerance and precision."""
        scene = self.scene
        draw = self.rng.random()
        if draw < 0.12:
            scene.controls["SOLVER"] = "GLOBAL NEWTON"
            if self.chance(0.4):  # numbers that are drawn for nothing: seeds keep their decks
                self.pick("DIRECT", "GMRES")
        elif draw < 0.24:
            scene.controls["SOLVER"] = "SWEEPS"
            scene.controls["LOCAL"] = self.pick("EXACT", "NEWTON", "NEWTON6")
            scene.controls["FORMULATION"] = self.pick("BIPOTENTIAL", "PSEUDOPOTENTIAL")
            self.chance(0.3)
        if self.chance(0.15):
            scene.controls["TOLERANCE"] = self.pick(1e-6, 1e-10, 1e-9)
        if self.chance(0.3):
            scene.precision["FACTOR"] = self.pick("SINGLE", "SINGLE", "DOUBLE")
        if self.chance(0.12):
            scene.precision["BLOCK LOW RANK"] = self.pick(1e-5, 1e-3)
        self.chance(0.12)
        if self.chance(0.03):
            scene.precision["OUT OF CORE"] = "YES"

    def finish(self, kind):
        """The scene."""
        scene = self.scene
        scene.kind = kind
        scene.points = np.array(self.points)
        scene.ids = np.array(self.ids)
        scene.nodes = np.array(self.elements)
        scene.element_ids = np.array(self.element_ids)
        scene.types = np.concatenate([[p.element] * len(p.elements) for p in scene.parts])
        scene.material = np.concatenate([p.material for p in scene.parts])
        return scene


# -- kinds of scenes --------------------------------------------------------------------------


def body(b, corner=(0.0, 0.0, 0.0), young=None, cells=None, size=None, density=None, **options):
    """A part with drawn size and mesh; returns (part, young, size)."""
    young = young if young is not None else b.pick(1000.0, 1.0, 2.1e5, b.power(-3, 12))
    size = b.pick(1.0, 1.0, 2.0, b.power(-3, 4)) if size is None else size
    shape = np.array([1.0, b.pick(1.0, 0.5, 1.5), b.pick(1.0, 0.5, 0.7, 2.0)])
    cells = cells or tuple(b.rng.integers(1, 4, 3))
    m = b.material(young, density=density)
    upper = None
    if b.chance(0.12) and cells[2] > 1:
        upper = b.material(young * b.power(-3, 3), density=density)
        options["explicit"] = True
    return b.part(corner, size * shape, cells, m, upper=upper, **options), young, size


def pressed(b):
    """Pressed onto planes by prescribed motion, then pushed to and fro."""
    part, _, size = body(b)
    depth = size * b.power(-3, -1.5)
    gap = b.pick(0.0, 0.0, 0.3 * depth, -0.3 * depth)
    plane = b.plane_at(part, "ZMIN", gap, b.pick(0.0, 0.0, 0.02), free=b.chance(0.3))
    b.pair(part, "ZMIN", plane)
    if b.chance(0.15):
        b.scene.gaps[part, "ZMIN"] = b.between(-0.5, 1) * depth
    reference = b.scene.obstacles[plane].reference
    if b.chance(0.3):
        wall = b.plane_at(part, "XMAX", b.pick(0.0, depth))
        b.pair(part, "XMAX", wall)
    step = b.step()
    b.hold(step, part, "ZMAX", (0, 1))
    b.hold(step, part, "ZMAX", (2,), -depth, b.maybe_amplitude(step))
    if reference is not None:
        step.boundaries += [Boundary([reference], i, 0.0) for i in range(3)]
    if b.chance(0.25):
        side = b.pick("YMIN", "YMAX", "XMIN")
        b.hold(step, part, side, ("XYZ".index(side[0]),))
    for _ in range(b.rng.integers(0, 3)):
        step = b.step()
        moved = b.pick(0, 1)
        amplitude = b.maybe_amplitude(step)
        if reference is not None and b.chance(0.5):
            step.boundaries.append(
                Boundary([reference], moved, b.between(-3, 3) * depth, amplitude)
            )
        else:
            b.hold(step, part, "ZMAX", (moved,), b.between(-3, 3) * depth, amplitude)
        if b.chance(0.3):
            b.hold(step, part, "ZMAX", (2,), -depth * b.between(-0.5, 2))
    return "pressed by prescribed motion"


def add_loads(b, step, part, young, size, gravity, level=None):
    """Pressures, forces and weight, some by amplitudes."""
    level = level or b.power(-4, -2)
    for _ in range(b.rng.integers(0 if gravity else 1, 3)):
        if b.chance(0.6):
            step.pressures.append(
                Pressure(part, b.pick(*SIDES), young * level * b.between(-0.3, 1),
                         b.maybe_amplitude(step), b.chance(0.4))
            )  # fmt: skip
        else:
            rows, name = b.side(part, b.pick(*SIDES))
            if b.chance(0.5):
                rows, name = [rows[b.rng.integers(len(rows))]], None
            step.forces.append(
                Force(rows, b.pick(0, 1, 2), young * size**2 * level * b.between(-1, 1) / len(rows),
                      b.maybe_amplitude(step), name)
            )  # fmt: skip
    if gravity:
        down = b.pick(np.array([0.0, 0.0, -1.0]), b.way() - np.array([0.0, 0.0, 2.0]))
        step.gravity.append(
            Gravity(part, young * level / size, down, b.maybe_amplitude(step, 0.15))
        )


def loaded(b):
    """Held at one side, loaded, before planes at others."""
    heavy = b.chance(0.5)
    part, young, size = body(b, density=1.0 if heavy else None)
    fixed = b.pick(*SIDES)
    others = [s for s in SIDES if s != fixed]
    for side in b.rng.choice(others, b.rng.integers(0, 3), replace=False):
        plane = b.plane_at(part, side, b.pick(0.0, 0.0, size * b.power(-5, -2)),
                           b.pick(0.0, 0.05))  # fmt: skip
        b.pair(part, side, plane)
    for number in range(b.rng.integers(1, 4)):
        step = b.step()
        if number == 0:
            b.hold(step, part, fixed, (0, 1, 2))
        add_loads(b, step, part, young, size, heavy and number == 0)
        if number and b.chance(0.3):
            step.new.add(b.pick("*CLOAD", "*DSLOAD", "*DLOAD"))
    return "loaded, held at a side"


def free(b):
    """A body that contact alone holds, or that nothing holds."""
    part, young, size = body(b, density=1.0)
    slope = b.pick(0.0, 0.0, b.between(0, 0.8))
    step = b.step()
    level = b.power(-5, -2)
    friction = b.friction()
    b.pair(part, "ZMIN", b.plane_at(part, "ZMIN", b.pick(0.0, 0.0, 1e-3 * size)), friction)
    for side in ("XMIN", "YMAX"):
        if b.chance(0.4):
            b.pair(part, side, b.plane_at(part, side, b.pick(0.0, 1e-3 * size)))
    turn = b.between(0, 2 * np.pi)
    down = np.array([np.sin(slope) * np.cos(turn), np.sin(slope) * np.sin(turn), -np.cos(slope)])
    step.gravity.append(Gravity(part, young * level / size, down, b.maybe_amplitude(step, 0.1)))
    if b.chance(0.5):
        add_loads(b, step, part, young, size, False, level * b.between(0.05, 0.5))
    if b.chance(0.4):
        later = b.step()
        add_loads(b, later, part, young, size, False, level * b.between(0.05, 0.5))
    return "free body on planes"


def rollers(b):
    """Rollers on some sides, loads that they and planes balance or not."""
    heavy = b.chance(0.4)
    part, young, size = body(b, density=1.0 if heavy else None)
    step = b.step()
    sides = list(b.rng.choice(SIDES, b.rng.integers(1, 4), replace=False))
    for side in sides:
        b.hold(step, part, side, ("XYZ".index(side[0]),), b.pick(0.0, 0.0, 1e-3 * size))
    if b.chance(0.6):
        side = b.pick(*[s for s in SIDES if s not in sides])
        b.pair(part, side, b.plane_at(part, side, b.pick(0.0, 1e-3 * size)))
    level = b.power(-4, -2)
    if b.chance(0.5):
        # What the rollers hold exactly.
        for side in sides:
            other = side[0] + ("MIN" if side.endswith("MAX") else "MAX")
            step.pressures.append(Pressure(part, other, young * level, b.maybe_amplitude(step)))
    else:
        add_loads(b, step, part, young, size, heavy, level)
    if b.chance(0.3):
        b.step()
    return "rollers"


def several(b):
    """Two or three bodies of very different stiffness, each held or pressed in its own way."""
    young = b.pick(1000.0, b.power(0, 6))
    ratio = 1.0
    first = b.step()
    later = b.step() if b.chance(0.4) else None
    parts = []
    size = 1.0
    for k in range(b.rng.integers(2, 4)):
        part, e, _ = body(b, (3.0 * k, 0.0, 0.0), young * ratio, tuple(b.rng.integers(1, 3, 3)),
                          size, density=1.0)  # fmt: skip
        parts.append((part, e))
        ratio = b.pick(1e8, 1e-8, 1e3, 1e5, 1.0)
    shared = None
    if b.chance(0.4):
        # One free plate under all of them, pressed up by a force.
        corner = b.scene.parts[0].corner
        shared = b.obstacle(PLANE, corner, (0.0, 0.0, 1.0), free=True)
        reference = b.scene.obstacles[shared].reference
        first.boundaries += [Boundary([reference], i, 0.0) for i in range(2)]
        first.forces.append(Force([reference], 2, min(e for _, e in parts) * b.power(-4, -2)))
    for part, e in parts:
        way = b.pick("pressed", "held", "free") if shared is None else "held"
        plane = shared if shared is not None else b.plane_at(part, "ZMIN")
        b.pair(part, "ZMIN", plane)
        if way == "pressed":
            b.hold(first, part, "ZMAX", (0, 1))
            b.hold(first, part, "ZMAX", (2,), -b.power(-4, -1.5), b.maybe_amplitude(first))
            if later:
                b.hold(later, part, "ZMAX", (0,), b.between(-0.05, 0.05))
        elif way == "held":
            b.hold(first, part, "ZMAX", (0, 1, 2))
            value, amplitude = e * b.power(-4, -2), b.maybe_amplitude(first)
            first.pressures.append(Pressure(part, b.pick("XMAX", "YMIN"), value, amplitude))
        else:
            first.gravity.append(Gravity(part, e * b.power(-5, -3), np.array([0.0, 0.0, -1.0])))
    return "several bodies"


def round_tool(b):
    """A sphere or cylinder at rest, moved or pushed, on a held body; or a body in a bore."""
    part, young, _ = body(b, size=1.0, cells=tuple(b.rng.integers(1, 5, 3)))
    p = b.scene.parts[part]
    top = p.corner + p.size * np.array([0.5, 0.5, 1.0])
    kind = b.pick(SPHERE, CYLINDER)
    step = b.step()
    if b.chance(0.25):
        # Inside: the body rests in a hollow, its lower side before the wall.
        radius = b.between(2, 20)
        middle = p.corner + p.size * np.array([0.5, 0.5, 0.0])
        half = np.linalg.norm(p.size[:2]) / 2
        centre = middle + np.array([0.0, 0.0, np.sqrt(radius**2 - half**2)])
        direction = None if kind == SPHERE else b.pick(np.eye(3)[0], np.eye(3)[1])
        o = b.obstacle(kind, centre, direction, radius, inner=True)
        b.pair(part, "ZMIN", o)
        b.hold(step, part, "ZMAX", (0, 1))
        b.hold(step, part, "ZMAX", (2,), -b.power(-3, -1.5), b.maybe_amplitude(step))
        if b.chance(0.5):
            later = b.step()
            b.hold(later, part, "ZMAX", (b.pick(0, 1),), b.between(-0.05, 0.05))
        return "in a hollow"
    radius = b.power(-0.3, 1)
    nx, ny = p.cells[0] + 1, p.cells[1] + 1
    # Over a node of the upper side, nearly: between the nodes nothing would touch.
    rows, _ = b.side(part, "ZMAX")
    node = b.points[rows[int(b.rng.integers(len(rows)))]]
    over = np.array([*(node[:2] + b.rng.uniform(-0.05, 0.05, 2) / np.array([nx, ny])), top[2]])
    gap = b.pick(0.0, 0.01)
    centre = over + np.array([0.0, 0.0, radius + gap])
    direction = None if kind == SPHERE else b.pick(
        np.eye(3)[0], np.eye(3)[1], np.array([1.0, 0.5, 0.0])
    )  # fmt: skip
    moves = b.chance(0.85)
    o = b.obstacle(kind, centre, direction, radius, free=moves)
    b.pair(part, "ZMAX", o)
    b.hold(step, part, "ZMIN", (0, 1, 2))
    if not moves:
        step.forces.append(Force(rows, 2, young * b.power(-3, -1.5) / len(rows)))
        return "before a round obstacle at rest"
    reference = b.scene.obstacles[o].reference
    depth = gap + b.power(-3, -1.7)
    step.boundaries += [Boundary([reference], i, 0.0) for i in range(2)]
    pushed = b.chance(0.45)
    if pushed:
        step.forces.append(
            Force([reference], 2, -young * b.power(-8, -2.5), b.maybe_amplitude(step, 0.15))
        )
    else:
        step.boundaries.append(Boundary([reference], 2, -depth, b.maybe_amplitude(step, 0.15)))
    for _ in range(b.rng.integers(0, 3)):
        later = b.step()
        value, amplitude = b.between(-0.1, 0.1), b.maybe_amplitude(later, 0.15)
        later.boundaries.append(Boundary([reference], b.pick(0, 1), value, amplitude))
    return "round tool under force" if pushed else "round tool"


def stiff_column(b):
    """A column of two materials up to 1e8 apart, at extreme sizes, pressed and then pushed."""
    size = b.pick(1.0, b.power(-4, 6))
    young = b.pick(1000.0, b.power(0, 10))
    nu = b.pick(0.3, 0.4999, -0.5, 0.0, 0.45)
    low = b.material(young, nu)
    high = b.material(young * b.pick(1e-8, 1e-6, 1e8, 1e4, 1e6), nu)
    cells = (2, int(b.rng.integers(1, 4)), int(b.pick(2, 4)))
    shape = np.array([1.0, 1.0, b.pick(1.0, 1.0, 10.0, 100.0)])
    part = b.part((0.0, 0.0, 0.0), size * shape, cells, low,
                  b.pick("C3D8B", "C3D8", "C3D8I"), True, b.chance(0.3), high)  # fmt: skip
    friction = b.pick(0.3, 1e-12, 1.5, 0.0, 1e6, p=[0.4, 0.1, 0.2, 0.2, 0.1])
    plane = b.plane_at(part, "ZMIN", b.pick(0.0, -1e-6, -1e-12) * size)
    b.pair(part, "ZMIN", plane, friction)
    depth = size * b.pick(1e-9, 1e-3, 1e-2, 0.1)
    step = b.step()
    b.hold(step, part, "ZMAX", (0, 1))
    b.hold(step, part, "ZMAX", (2,), -depth)
    if b.chance(0.6):
        later = b.step()
        b.hold(later, part, "ZMAX", (b.pick(0, 1),), size * b.pick(1.0, 1e-2, 1e-6))
    return "stiff and soft"


def paths(b):
    """No contact: amplitudes, jumps, several steps, supports and loads that end."""
    part, young, size = body(b, density=b.pick(None, 1.0))
    fixed, moved = b.pick(("ZMIN", "ZMAX"), ("XMAX", "XMIN"), ("YMIN", "YMAX"))
    for number in range(b.rng.integers(1, 4)):
        step = b.step()
        amplitude = b.amplitude(step) if b.chance(0.7) else None
        if number == 0:
            b.hold(step, part, fixed, (0, 1, 2))
        draw = b.rng.random()
        if draw < 0.5:
            b.hold(step, part, moved, b.pick((0, 1, 2), (0,), (2,)), size * b.between(-0.1, 0.1),
                   amplitude)  # fmt: skip
        elif draw < 0.8:
            add_loads(b, step, part, young, size, False)
        else:
            rows, name = b.side(part, moved)
            value = young * size**2 * 1e-3
            step.forces.append(Force(rows, b.pick(0, 1, 2), value, amplitude, name))
        if number and b.chance(0.35):
            keyword = b.pick("*CLOAD", "*DSLOAD", "*BOUNDARY")
            step.new.add(keyword)
            if keyword == "*BOUNDARY":
                b.hold(step, part, fixed, (0, 1, 2))
    return "paths without contact"


def dragged(b):
    """A body whose sides are held or dragged along the plane it is pressed on."""
    part, young, size = body(b)
    b.pair(part, "ZMIN", b.plane_at(part, "ZMIN", free=b.chance(0.4)))
    reference = b.scene.obstacles[0].reference
    step = b.step()
    sides = b.pick(SIDES[:2], SIDES[:4], ("XMIN",), ("XMIN", "YMIN"))
    for side in sides:
        b.hold(step, part, side, b.pick((0,), (0, 1)), b.pick(0.0, 0.01 * size))
    b.hold(step, part, "XMIN", (0,))
    b.hold(step, part, "YMIN", (1,))
    if reference is not None:
        step.boundaries += [Boundary([reference], i, 0.0) for i in range(3)]
    step.pressures.append(Pressure(part, "ZMAX", young * b.power(-4, -2)))
    for _ in range(b.rng.integers(1, 3)):
        later = b.step()
        if reference is not None and b.chance(0.6):
            value = b.between(-0.1, 0.1) * size
            later.boundaries.append(Boundary([reference], b.pick(0, 1), value))
        else:
            b.hold(later, part, b.pick(*sides), (0,), b.between(-0.1, 0.1) * size)
    return "dragged by held sides"


KINDS = (
    (pressed, 0.2), (loaded, 0.13), (free, 0.14), (rollers, 0.12), (several, 0.11),
    (round_tool, 0.12), (stiff_column, 0.07), (paths, 0.08), (dragged, 0.03),
)  # fmt: skip


def random_scene(seed):
    """The scene of a seed."""
    rng = np.random.default_rng([20260, seed])
    b = Builder(seed, rng)
    weights = np.array([w for _, w in KINDS])
    maker = KINDS[rng.choice(len(KINDS), p=weights / weights.sum())][0]
    kind = maker(b)
    b.add_controls()
    return b.finish(kind)
