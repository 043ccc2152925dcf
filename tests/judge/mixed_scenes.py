"""Random scenes of elements of second order, as decks and as what their judge sums up."""

import numpy as np
from quadratic_mortar import place
from second_order import Box, Mesh

FAMILIES = ("plain", "loads", "tied", "bodies")
TYPES = [("C3D10",), ("C3D15",), ("C3D20",), ("C3D20R",), ("C3D20", "C3D15"),
         ("C3D20R", "C3D15"), ("C3D10", "C3D15"), ("C3D15", "C3D10")]  # fmt: skip


class Scene:
    """A deck of a seed.

    `foot`: rows of the slave nodes, `faces` those of the slave surface, `alpha` of its mid-side
    nodes; `held`: rows that move as `ways` say, and those at rest. `master`: faces, where the other
    side is a body. Loads are lists with a value for the end of each step.
    """

    def __init__(self, seed, family="plain"):
        self.seed, self.family = seed, family
        first = [20266] if family == "plain" else [20267, FAMILIES.index(family)]
        rng = self.rng = np.random.default_rng([*first, seed])
        self.types = TYPES[rng.integers(len(TYPES))]
        n = rng.integers(2, 4, 3)
        self.size = float(rng.choice([1.0, 1.0, 10 ** rng.uniform(-3, 3)]))
        self.young = float(rng.choice([1000.0, 10 ** rng.uniform(0, 11)]))
        self.nu = float(rng.choice([0.3, 0.0, 0.25, -0.3, 0.4]))
        self.mu = float(rng.choice([0.0, 0.3, rng.uniform(0.02, 1.5)]))
        self.ball = bool(rng.random() < 0.35)
        box = Box(rng, self.types, n)
        shape = np.array([1.0, rng.uniform(0.6, 1.4), rng.uniform(0.5, 1.2)])
        self.boxes, self.shapes = [box], [shape]
        places = [self.size * shape * (box.grid / 2 + box.shift) / n]
        depth = self.size * 10 ** rng.uniform(-3, -2)
        ways = [np.array([0.0, 0.0, -depth])]
        for _ in range(rng.integers(1, 3)):
            ways.append(ways[0] * rng.uniform(0.5, 1.5) + depth * np.array(
                [*rng.uniform(-3, 3, 2), 0.0]))  # fmt: skip
        self.ways, self.parts, self.depth = ways, int(rng.integers(1, 4)), depth
        self.radius = self.size * 10 ** rng.uniform(0, 1)
        self.is_curved = self.small = False
        if family == "loads" and rng.random() < 0.5:
            self.is_curved = True
            places[0] = self.curve(places[0])
        if family in ("tied", "bodies"):
            places = self.add_box(places[0])
        self.join(places)
        under = self.points[self.boxes[0].nodes_on(2, 0)].mean(axis=0)
        self.centre = np.array([*under[:2], -self.radius])
        self.choose_surfaces()
        self.choose_loads()
        self.solved = None  # what `factor` gives

    def curve(self, x):
        """Bend the foot: a bulge, a hollow or a saddle, lowest at 0, and less of it above."""
        rng, top = self.rng, x[:, 2].max()
        middle = x[:, :2].mean(axis=0) + self.size * rng.uniform(-0.3, 0.3, 2)
        across = ((x[:, :2] - middle) / self.size) ** 2 @ rng.choice(
            [(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 0.0)])  # fmt: skip
        rise = across * self.size * 10 ** rng.uniform(-2.5, -1)
        rise -= rise[x[:, 2] == 0].min()
        out = x.copy()
        out[:, 2] += rise * (1 - x[:, 2] / top)
        return out

    def add_box(self, x):
        """Put another box on the first: as large as it, or smaller."""
        rng, low = self.rng, x.max(axis=0)
        types = TYPES[rng.integers(len(TYPES))]
        n = rng.integers(2, 4, 3)
        box = Box(rng, types, n)
        edge = np.array([0.0, 0.0, 0.0])
        size = np.array([*low[:2], self.size * rng.uniform(0.5, 1.0)])
        self.is_smaller = bool(rng.random() < 0.7)
        if self.is_smaller:
            edge[:2] = low[:2] * rng.uniform(0.1, 0.3, 2)
            size[:2] = low[:2] * rng.uniform(0.4, 0.6, 2)
        edge[2] = low[2]
        if self.family == "bodies":
            edge[2] += self.depth * rng.choice([0.0, 0.0, rng.uniform(0, 0.5)])
            self.small = bool(rng.random() < 0.5)
        self.types = (*self.types, *types)
        self.boxes.append(box)
        return [x, edge + size * (box.grid / 2 + box.shift) / n]

    def join(self, places):
        """One mesh of all boxes, materials of their own."""
        rng = self.rng
        self.first = np.cumsum([0, *map(len, places)])
        self.first_element = np.cumsum([0, *(len(b.elements) for b in self.boxes)])
        elements, middles, materials, self.of_box = [], {}, [], []
        for b, box in enumerate(self.boxes):
            shift = int(self.first[b])
            elements += [(kind, [shift + a for a in nodes]) for kind, nodes in box.elements]
            middles |= {shift + m: (shift + a, shift + c) for m, (a, c) in box.middles.items()}
            own = (self.young, self.nu, 0.0, 0.0)
            if self.family != "plain":
                stiff = self.young * (10 ** rng.uniform(-1, 1) if b else 1.0)
                own = (stiff, self.nu, 10 ** rng.uniform(-2, 2), 10 ** rng.uniform(-6, -4))
            self.of_box.append(own)
            materials += len(box.elements) * [own]
        self.mesh = Mesh(np.vstack(places), elements, middles, materials)
        self.points, self.elements, self.middles = self.mesh.points, elements, middles

    def side(self, b, axis, end):
        """[(element, face)] of a side of a box."""
        first = int(self.first_element[b])
        return [(first + e, f) for e, f in self.boxes[b].faces_on(axis, end)]

    def choose_surfaces(self):
        """What touches, what is tied, what is held."""
        rng, last = self.rng, len(self.boxes) - 1
        self.top = self.first[last] + self.boxes[last].nodes_on(2, 1)
        self.rest = np.zeros(0, dtype=int)
        self.faces, self.master, self.tie = self.side(0, 2, 0), None, None
        if last:
            sides = [self.side(1, 2, 0), self.side(0, 2, 1)]
            if rng.random() < 0.3 and (self.family == "bodies" or not self.is_smaller):
                sides.reverse()
            if self.family == "bodies":
                self.faces, self.master = sides
                self.rest = self.boxes[0].nodes_on(2, 0)
            else:
                self.tie = sides
        self.alpha = self.mesh.edge_shares(self.faces)
        self.foot = np.unique([a for e, f in self.faces for a in self.mesh.face_nodes(e, f)])

    def choose_loads(self):
        """Pressures on sides, gravity of boxes, temperatures of nodes: what a step ends with."""
        rng, steps = self.rng, len(self.ways)
        self.pressures, self.gravity, self.warmth = [], [], None
        if self.family == "plain":
            return
        stress = self.young * self.depth / self.size
        for b in range(len(self.boxes)):
            if rng.random() < 0.5:
                side = self.side(b, int(rng.integers(2)), int(rng.integers(2)))
                self.pressures.append((side, stress * rng.uniform(-0.3, 0.3, steps)))
            if rng.random() < 0.5:
                size = stress / self.size / self.of_box[b][2] * rng.uniform(0.0, 0.3, (steps, 1))
                self.gravity.append((b, size * rng.normal(size=3)))
        if rng.random() < 0.5:
            hot = self.depth / self.size / self.of_box[0][3]
            self.warmth = hot * rng.uniform(-0.3, 0.5, (steps, len(self.points)))

    @property
    def has_loads(self):
        """Whether anything but supports acts."""
        return bool(self.pressures or self.gravity or self.warmth is not None)

    def at(self, values, k):
        """A value for the end of each step as it is at the end of increment k (from 0)."""
        step, share = k // self.parts, (k % self.parts + 1) / self.parts
        before = values[step - 1] if step else np.zeros_like(values[0])
        return before + share * (values[step] - before)

    def loads(self, k):
        """Forces (N, 3) of pressures and gravity at the end of increment k."""
        out = np.zeros_like(self.points)
        for faces, size in self.pressures:
            out += self.at(size, k) * self.mesh.pressure(faces)
        for b, vectors in self.gravity:
            span = range(self.first_element[b], self.first_element[b + 1])
            out += self.mesh.weight(span, self.at(vectors, k))
        return out

    def warmer(self, k):
        """How much warmer nodes are at the end of increment k, or None."""
        return None if self.warmth is None else self.at(self.warmth, k)

    def internal_force(self, u, k=None):
        """Forces (N, 3) of the stresses."""
        return self.mesh.internal_force(u, None if k is None else self.warmer(k))

    def areas(self):
        """Those (N,) of the points, (9.12)."""
        return self.mesh.areas(self.faces, self.alpha)

    def rounding(self, u):
        """A force that may be rounding of displacements alone."""
        stiff = max(young for young, *_ in self.of_box)
        return 1e-11 * stiff / (1 - 2 * self.nu) * self.size * np.abs(u).max()

    def gaps_and_normals(self, places):
        """Of nodes at `places` (N, 3) before the obstacle."""
        if not self.ball:
            return places[:, 2], np.tile((0.0, 0.0, 1.0), (len(places), 1))
        away = places - self.centre
        far = np.linalg.norm(away, axis=1)
        return far - self.radius, away / far[:, None]

    def tied(self):
        """Rows of the nodes of the tie, and what (N,) each follows, (11.23)."""
        slave, master = self.tie
        alpha = self.mesh.edge_shares(slave)
        rows, combination, _, covered, area, *_ = place(
            self.mesh, slave, master, self.points, alpha, of_nodes=True)
        share = covered / area
        assert share.min() > 0.9  # the slave is inside its master
        own = {int(r): combination[i] for i, r in enumerate(rows)}
        lines = {}
        for r in sorted(own, key=lambda r: r in alpha):  # corners first
            weights = -own[r].copy()
            part = alpha.get(r, 0.0)
            weights[r] += 1 / (1 - 2 * part)
            ends = self.middles[r] if part else ()
            weights[list(ends)] -= part / (1 - 2 * part)
            lines[r] = (1 - 2 * part) * weights
            for end in ends:
                lines[r] = lines[r] + part * lines.get(end, np.eye(1, len(weights), end)[0])
        kept = np.array(list(lines))
        return kept, np.array([lines[r] for r in kept])

    def factor(self, tie):
        """Displacements (3N, n) of unknowns, the stiffness times these, and its inverse at them."""
        if self.solved is None:
            count = len(self.points)
            own = np.ones(count, dtype=bool)
            own[self.top] = own[self.rest] = False
            follow = np.eye(count)
            if tie is not None:
                own[tie[0]] = False
                follow[tie[0]] = tie[1]
            stiffness = self.mesh.stiffness()
            follow = np.kron(follow[:, own], np.eye(3))
            half = stiffness @ follow
            self.solved = follow, half, np.linalg.inv(follow.T @ half)
        return self.solved

    def free_motion(self, k, tie):
        """Displacements (N, 3) without contact at the end of increment k."""
        count = len(self.points)
        if not self.has_loads:
            return np.tile(self.at(self.ways, k), (count, 1))
        follow, half, flexibility = self.factor(tie)
        u = np.zeros((count, 3))
        u[self.top] = self.at(self.ways, k)
        force = self.loads(k) - self.internal_force(np.zeros_like(u), k)
        left = force.ravel() @ follow - u.ravel() @ half
        return u + (follow @ (flexibility @ left)).reshape(-1, 3)

    def deck(self):
        """The deck's text."""
        out = ["*NODE"]
        out += [f"{i + 1}, " + ", ".join(repr(float(v)) for v in x)
                for i, x in enumerate(self.points)]  # fmt: skip
        for b in range(len(self.boxes)):
            span = range(self.first_element[b], self.first_element[b + 1])
            for kind in dict.fromkeys(self.elements[e][0] for e in span):
                out.append(f"*ELEMENT, TYPE={kind}, ELSET=B{b}")
                for e in span:
                    other, nodes = self.elements[e]
                    if other == kind:
                        ids = [str(e + 1), *(str(i + 1) for i in nodes)]
                        rows = [", ".join(ids[i : i + 12]) for i in range(0, len(ids), 12)]
                        out += [f"{row}," for row in rows[:-1]] + rows[-1:]
        out += ["*NSET, NSET=TOP", *(str(i + 1) for i in self.top)]
        if len(self.rest):
            out += ["*NSET, NSET=REST", *(str(i + 1) for i in self.rest)]
        surfaces = {"FOOT": self.faces, "MASTER": self.master}
        if self.tie:
            surfaces |= dict(zip(("TIED", "GLUE"), self.tie, strict=True))
        for name, faces in surfaces.items():
            if faces is not None:
                out += [f"*SURFACE, NAME={name}", *(f"{e + 1}, S{f}" for e, f in faces)]
        for b, (young, nu, density, expansion) in enumerate(self.of_box):
            out += [f"*MATERIAL, NAME=M{b}", "*ELASTIC", f"{young!r}, {nu!r}"]
            out += ["*DENSITY", repr(density)] if density else []
            out += ["*EXPANSION", repr(expansion)] if expansion else []
            out += [f"*SOLID SECTION, ELSET=B{b}, MATERIAL=M{b}"]
        out += ["*TIE, NAME=T", "TIED, GLUE"] if self.tie else []
        place = ", ".join(repr(float(v)) for v in self.centre)
        if self.master is None:
            kind = "SPHERE" if self.ball else "PLANE"
            out += [f"*OBSTACLE, NAME=O, TYPE={kind}"]
            out += [f"{place}, {self.radius!r}"] if self.ball else ["0., 0., 0., 0., 0., 1."]
        out += ["*SURFACE INTERACTION, NAME=I"]
        out += ["*FRICTION", repr(self.mu)] if self.mu else []
        out += ["*CONTACT PAIR, INTERACTION=I" + (", SMALL SLIDING" if self.small else "")]
        out += ["FOOT, MASTER" if self.master else "FOOT, O"]
        for s, way in enumerate(self.ways):
            out += ["*STEP", "*STATIC, DIRECT", f"{1 / self.parts!r}, 1.", "*BOUNDARY"]
            out += [f"TOP, {i + 1}, {i + 1}, {float(way[i])!r}" for i in range(3)]
            out += ["REST, 1, 3"] if len(self.rest) else []
            if self.pressures or self.gravity:
                out += ["*DLOAD"]
            for faces, values in self.pressures:
                out += [f"{e + 1}, P{f}, {float(values[s])!r}" for e, f in faces]
            for b, vectors in self.gravity:
                size = float(np.linalg.norm(vectors[s])) or 1.0
                along = ", ".join(repr(float(v)) for v in vectors[s] / size)
                out += [f"B{b}, GRAV, {size!r}, {along}"]
            if self.warmth is not None:
                out += ["*TEMPERATURE"]
                out += [f"{i + 1}, {float(v)!r}" for i, v in enumerate(self.warmth[s])]
            out += ["*END STEP"]
        return "\n".join(out) + "\n"


def slave_points(scene, u):
    """What `place` returns of the points before a body at `u`."""
    return place(scene.mesh, scene.faces, scene.master, scene.points + u, scene.alpha)
