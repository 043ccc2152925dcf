"""A scene as its generator knows it, and the deck that says the same to the program."""

import struct
from dataclasses import dataclass, field

import numpy as np
from elements import FACES, Elements
from finite_elements import (
    BLATZ_KO,
    MOONEY_RIVLIN,
    NEO_HOOKE,
    OGDEN,
    ST_VENANT,
    YEOH,
    FiniteElements,
    ogden_terms,
    yeoh_terms,
)

PLANE, SPHERE, CYLINDER = "PLANE", "SPHERE", "CYLINDER"
FACETS, STL = "FACETS", "STL"
EPS = np.finfo(float).eps


@dataclass
class Axes:
    """The axes of a material that is not isotropic, and its stiffness along them.

    `c` is (6, 6), stresses by engineering strains xx yy zz xy yz xz. Rectangular: `a` on axis 1,
    `b` in the plane of axes 1 and 2; else two points of an axis, about which they go around. They
    are turned by `degrees` about the third.
    """

    c: np.ndarray
    a: np.ndarray
    b: np.ndarray
    around: bool
    degrees: float

    def cards(self):
        """The lines of the constants: the upper triangle, column by column, 11 22 33 12 13 23."""
        order = [0, 1, 2, 3, 5, 4]
        values = [number(self.c[order[i], order[j]]) for j in range(6) for i in range(j + 1)]
        lines = [", ".join(values[i:i + 8]) for i in range(0, 21, 8)]
        return ["*ELASTIC, TYPE=ANISOTROPIC", *lines]

    def orientation(self, name):
        """The lines of *ORIENTATION."""
        system = "CYLINDRICAL" if self.around else "RECTANGULAR"
        points = ", ".join(number(x) for x in (*self.a, *self.b))
        return [f"*ORIENTATION, NAME={name}, SYSTEM={system}", points,
                f"3, {number(self.degrees)}"]

    def at(self, places):
        """The stiffnesses along x, y, z at places (n, 3): strains turned there, stresses back."""
        if self.around:
            third = np.broadcast_to((self.b - self.a) / np.linalg.norm(self.b - self.a),
                                    places.shape)
            first = np.cross(np.cross(third, places - self.a), third)
        else:
            first = np.broadcast_to(self.a, places.shape)
            third = np.broadcast_to(np.cross(self.a, self.b), places.shape)
            third = third / np.linalg.norm(third, axis=1)[:, None]
        first = first / np.linalg.norm(first, axis=1)[:, None]
        second = np.cross(third, first)
        angle = np.radians(self.degrees)
        turned = (np.cos(angle) * first + np.sin(angle) * second,
                  np.cos(angle) * second - np.sin(angle) * first, third)
        pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
        # Row: the engineering strain along the axes; column: of those along x, y, z.
        rows = np.empty((len(places), 6, 6))
        for i, (p, q) in enumerate(pairs):
            for j, (k, m) in enumerate(pairs):
                one = turned[p][:, k] * turned[q][:, m]
                other = turned[p][:, m] * turned[q][:, k]
                both = (one + other) / 2 if k != m else one
                rows[:, i, j] = both * (2 if p != q else 1)
        return np.einsum("nij,ik,nkl->njl", rows, self.c, rows)


@dataclass
class Material:
    """A material; `density` None where nothing has weight.

    At finite strain `young` and `poisson` are those of small strain, and `share` is the part of
    `C01` in `C10 + C01`; Yeoh's and Ogden's laws make their constants of it.
    """

    young: float
    poisson: float
    density: float | None = None
    expansion: float | None = None
    law: str = ST_VENANT
    share: float = 0.0
    axes: Axes | None = None

    def cards(self):
        """The lines of the law."""
        if self.axes is not None:
            return self.axes.cards()
        shear = self.young / (2 * (1 + self.poisson))
        compliance = 6 * (1 - 2 * self.poisson) / self.young
        if self.law == NEO_HOOKE:
            values = [shear / 2, compliance]
        elif self.law == MOONEY_RIVLIN:
            values = [(1 - self.share) * shear / 2, self.share * shear / 2, compliance]
        elif self.law == YEOH:
            values = [shear / 2, *(shear / 2 * c for c in yeoh_terms(self.share)), compliance]
        elif self.law == OGDEN:
            terms = ogden_terms(self.share)
            values = [v for mu, alpha in terms for v in (shear * mu, alpha)] + [compliance]
            return ["*HYPERELASTIC, OGDEN, N=2", ", ".join(number(v) for v in values)]
        elif self.law == BLATZ_KO:
            return ["*HYPERFOAM, N=1", f"{number(shear)}, -2., 0.25"]
        else:
            return ["*ELASTIC", f"{number(self.young)}, {number(self.poisson)}"]
        return [f"*HYPERELASTIC, {self.law}", ", ".join(number(v) for v in values)]


@dataclass
class Part:
    """A body: elements on a grid, written as *BLOCK or as *NODE and *ELEMENT.

    `rows` are its points and `elements` its elements, as ranges of the scene's; `sides` the faces
    [(element, 0..5)] of its six sides by name (XMIN, ...).
    """

    name: str
    element: str
    explicit: bool
    cells: tuple
    corner: np.ndarray
    size: np.ndarray
    rows: range
    elements: range
    sides: dict
    material: list  # of each element


@dataclass
class Obstacle:
    """A rigid obstacle; `reference` is the row of its reference node, None at rest.

    One of facets has `facets` [(3 or 4 corners)], anticlockwise from the side where the body is, of
    `corners` (M, 3). Those of a *RIGID BODY are nodes: `corner_rows` are their rows.
    """

    name: str
    kind: str
    point: np.ndarray
    direction: np.ndarray | None = None
    radius: float = 0.0
    inner: bool = False
    reference: int | None = None
    corners: np.ndarray | None = None
    facets: list | None = None
    corner_rows: range | None = None
    back: bool = False  # the facets are written the other way round, and the surface with SNEG
    text: bool = False  # an STL file of text
    wall_of: int | None = None  # the obstacle of which these facets are a wall, and
    of_it: list | None = None  # the numbers of its facets that they are

    @property
    def has_facets(self):
        """Whether slave faces lie before its facets."""
        return self.facets is not None


@dataclass
class Pair:
    """A slave surface, by part and side, and the index of an obstacle or a master (part, side).

    A master with concave edges is a pair for each `wall` (0, 1, ...) here, and one in the deck:
    that of an obstacle is `wall_of` the deck's, that of a body the side `whole`.

    `closed` is of surfaces without separation: whether they touch in the mesh, or begin apart.
    `most` is the largest friction on a unit of area, TAUMAX.
    """

    part: int
    side: str
    obstacle: int | None
    friction: float
    master: tuple | None = None
    small: bool = False
    adjust: float | None = None
    wall: int | None = None
    whole: str | None = None
    closed: bool | None = None
    most: float | None = None


@dataclass
class Tie:
    """A slave and a master surface, (part, side) each."""

    slave: tuple
    master: tuple


@dataclass
class Boundary:
    """Displacements: points (rows), direction 0..2, value, amplitude (index or None).

    Directions 3 to 5 are the components of a reference node's rotation vector.
    """

    rows: list
    dof: int
    value: float
    amplitude: int | None = None
    name: str | None = None  # of the set that has these rows
    fixed: bool = False  # they stay what they are


@dataclass
class Force:
    """A force on each of `rows`, direction 0..2; 3..5: a moment on a coupling's reference node."""

    rows: list
    dof: int
    value: float
    amplitude: int | None = None
    name: str | None = None


@dataclass
class Pressure:
    """A pressure on a side of a part; by *DLOAD face by face, or by *DSLOAD."""

    part: int
    side: str
    value: float
    amplitude: int | None = None
    by_faces: bool = False


@dataclass
class Gravity:
    """An acceleration on the elements of a part, along `direction` (of any length)."""

    part: int
    value: float
    direction: np.ndarray
    amplitude: int | None = None


@dataclass
class Temperature:
    """The temperature of `rows`."""

    rows: list
    value: float
    amplitude: int | None = None
    name: str | None = None


@dataclass
class Equation:
    """Terms [(rows, dof, coefficient)], as many rows in each; their sum is 0, row by row."""

    terms: list


@dataclass
class Coupling:
    """A side of a part and a reference node; `rotation` is the row that its rotations have."""

    part: int
    side: str
    reference: int
    kinematic: bool
    dofs: tuple = (0, 1, 2)
    rotation: int = -1


@dataclass
class Transform:
    """Local directions of `rows`: two points (6,), read as TYPE=R or C; `stand_ins` are theirs."""

    rows: list
    points: np.ndarray
    around: bool
    name: str | None = None
    stand_ins: list = field(default_factory=list)

    def directions(self, place):
        """Rows (3, 3): unit vectors at a place."""
        first, second = self.points[:3], self.points[3:]
        if self.around:
            z = (second - first) / np.linalg.norm(second - first)
            x = place - first
            x = x - (x @ z) * z
        else:
            x, z = first, np.cross(first, second)
            z = z / np.linalg.norm(z)
        x = x / np.linalg.norm(x)
        return np.array([x, np.cross(z, x), z])


@dataclass
class Step:
    """A *STEP; `new` holds the keywords whose earlier loads end with it."""

    period: float
    increments: int
    direct: bool
    boundaries: list = field(default_factory=list)
    forces: list = field(default_factory=list)
    pressures: list = field(default_factory=list)
    gravity: list = field(default_factory=list)
    temperatures: list = field(default_factory=list)
    new: set = field(default_factory=set)


@dataclass
class Scene:
    """All of a deck. `points` (N, 3) and `ids` (N,) are in the order of the deck."""

    seed: int
    points: np.ndarray
    ids: np.ndarray
    nodes: np.ndarray  # (E, 8) rows
    types: np.ndarray  # (E,)
    material: np.ndarray  # (E,)
    materials: list
    parts: list
    obstacles: list
    pairs: list
    amplitudes: list  # of (times, values)
    steps: list
    gaps: dict = field(default_factory=dict)  # (part, side) -> added gap
    controls: dict = field(default_factory=dict)
    precision: dict = field(default_factory=dict)
    element_ids: np.ndarray | None = None
    kind: str = ""
    ties: list = field(default_factory=list)
    exact: np.ndarray | None = None  # (N, 3) displacements at the end, where they are known
    exact_to: float = 1e-8  # of the largest
    equations: list = field(default_factory=list)
    couplings: list = field(default_factory=list)
    transforms: list = field(default_factory=list)
    first_temperatures: list = field(default_factory=list)  # of Temperature
    loose: list = field(default_factory=list)  # rows of nodes that couplings or equations name
    finite: bool = False  # *STEP, NLGEOM

    @property
    def tolerance(self):
        """Of the contact solver."""
        return float(self.controls.get("TOLERANCE", 1e-8))

    def elements(self):
        """The finite elements, made once."""
        if not hasattr(self, "_elements"):
            young = [self.materials[m].young for m in self.material]
            poisson = [self.materials[m].poisson for m in self.material]
            axes = [self.materials[m].axes for m in self.material]
            self._elements = Elements(self.points, self.nodes, self.types, young, poisson, axes)
            if self.finite:
                laws = [(self.materials[m].law, self.materials[m].share) for m in self.material]
                self._elements = FiniteElements(
                    self.points, self.nodes, self.types, young, poisson, laws
                )
        return self._elements

    def side_rows(self, part, side):
        """The points of a side of a part, sorted."""
        faces = self.parts[part].sides[side]
        return np.unique([self.nodes[b][list(FACES[f])] for b, f in faces])

    def faces(self, part, side):
        """The faces of a side, four rows each."""
        return [tuple(int(r) for r in self.nodes[b][list(FACES[f])])
                for b, f in self.parts[part].sides[side]]  # fmt: skip

    @property
    def moves_nodes(self):
        """Whether the deck moves slave nodes onto their masters before anything is computed."""
        return bool(self.ties) or any(p.adjust is not None for p in self.pairs)

    def tied_bodies(self):
        """The rows of each body: what elements and ties connect."""
        groups = [set(rows.tolist()) for rows in self.bodies()]
        for tie in self.ties:
            ends = [int(self.side_rows(*end)[0]) for end in (tie.slave, tie.master)]
            first, second = (next(g for g in groups if end in g) for end in ends)
            if first is not second:
                groups = [g for g in groups if g is not second]
                first |= second
        return [np.array(sorted(g)) for g in groups]

    def bodies(self):
        """The rows of each body: what elements connect."""
        body = np.full(len(self.points), -1)
        for nodes in self.nodes:
            known = sorted({b for b in body[nodes] if b >= 0})
            body[nodes] = known[0] if known else body.max() + 1
            for other in known[1:]:
                body[body == other] = known[0]
        return [np.flatnonzero(body == b) for b in np.unique(body[body >= 0])]

    def references(self):
        """The rows of reference nodes."""
        return sorted({o.reference for o in self.obstacles if o.reference is not None})

    def longest_arm(self, coupling, places=None):
        """What turns the rotations of a coupling into lengths; `places` instead of the points."""
        points = self.points if places is None else places
        rows = self.side_rows(coupling.part, coupling.side)
        return np.linalg.norm(points[rows] - points[coupling.reference], axis=1).max()

    def unknown_of(self, row, dof):
        """(row, dof, factor) of the unknown that a card means by a dof 0..5 of a node."""
        for one in self.couplings:
            if one.reference == row and dof > 2:
                return one.rotation, dof - 3, self.longest_arm(one)
        for one in self.transforms:
            if row in one.rows:
                return one.stand_ins[one.rows.index(row)], dof, 1.0
        return row, dof, 1.0

    def add_force(self, out, row, dof, value):
        """Add a force or moment of a card to forces (N, 3) along x, y, z."""
        for one in self.couplings:
            if one.reference == row and dof > 2:
                out[one.rotation, dof - 3] += value / self.longest_arm(one)
                return
        for one in self.transforms:
            if row in one.rows:
                out[row] += value * one.directions(self.points[row])[dof]
                return
        out[row, dof] += value

    def first_temperature(self):
        """(N,) what nodes begin with."""
        out = np.zeros(len(self.points))
        for one in self.first_temperatures:
            out[one.rows] = one.value
        return out

    def name_of(self, pair):
        """The name of a pair's results."""
        if pair.master is not None:
            part, side = pair.master
            master = f"{self.parts[part].name}-{pair.whole or side}"
        else:
            one = self.obstacles[pair.obstacle]
            master = (one if one.wall_of is None else self.obstacles[one.wall_of]).name
        return f"{self.parts[pair.part].name}-{pair.side}:{master}"

    def key_of(self, pair):
        """The same, with the number of the wall where it is of one."""
        return self.name_of(pair) + ("" if pair.wall is None else f"#{pair.wall}")

    def added_gaps(self):
        """What *CONTACT GAP adds at each point, (N,)."""
        out = np.zeros(len(self.points))
        for (part, side), gap in self.gaps.items():
            out[self.side_rows(part, side)] += gap
        return out


def number(x):
    """A number with all its digits."""
    return repr(float(x))


def listed(values):
    """Numbers or ids in lines of ten."""
    values = [str(v) for v in values]
    return [", ".join(values[i : i + 10]) for i in range(0, len(values), 10)]


class DeckWriter:
    """The text of a scene."""

    def __init__(self, scene):
        self.scene = scene
        self.lines = []
        self.sets = {}  # tuple of rows -> name, written by *NSET before they are used

    def text(self):
        """The whole deck."""
        scene = self.scene
        self.add("*HEADING", f"Random scene {scene.seed}: {scene.kind}")
        for part in scene.parts:
            self.write_part(part)
        self.write_references()
        self.write_materials()
        self.write_contact()
        for index, (times, values) in enumerate(scene.amplitudes):
            self.add(f"*AMPLITUDE, NAME=A{index}")
            pairs = [number(x) for pair in zip(times, values, strict=True) for x in pair]
            for i in range(0, len(pairs), 8):
                self.add(", ".join(pairs[i : i + 8]))
        self.write_controls()
        body = self.lines
        self.lines = []
        for step in scene.steps:
            self.write_step(step)
        steps, self.lines = self.lines, []
        for rows, name in self.sets.items():
            self.add(f"*NSET, NSET={name}", *listed(scene.ids[list(rows)]))
        return "\n".join([*body, *self.lines, *steps]) + "\n"

    def add(self, *lines):
        self.lines += lines

    def write_part(self, part):
        scene = self.scene
        if not part.explicit:
            nx, ny, nz = part.cells
            self.add(f"*BLOCK, NAME={part.name}, TYPE={part.element}, NX={nx}, NY={ny}, NZ={nz}")
            self.add(", ".join(number(x) for x in (*part.corner, *part.size)))
            return
        self.add("*NODE")
        for row in part.rows:
            self.add(f"{scene.ids[row]}, " + ", ".join(number(x) for x in scene.points[row]))
        self.add(f"*ELEMENT, TYPE={part.element}, ELSET={part.name}")
        for element in part.elements:
            ids = ", ".join(str(i) for i in scene.ids[scene.nodes[element]])
            self.add(f"{scene.element_ids[element]}, {ids}")
        index = scene.parts.index(part)
        for side, faces in part.sides.items():
            self.add(f"*NSET, NSET={part.name}-{side}")
            self.add(*listed(scene.ids[scene.side_rows(index, side)]))
            self.add(f"*SURFACE, NAME={part.name}-{side}")
            self.add(*[f"{scene.element_ids[b]}, S{f + 1}" for b, f in faces])

    def write_references(self):
        scene = self.scene
        rows = scene.references() + scene.loose
        if rows:
            self.add("*NODE")
        for row in rows:
            self.add(f"{scene.ids[row]}, " + ", ".join(number(x) for x in scene.points[row]))

    def write_materials(self):
        scene = self.scene
        for index, one in enumerate(scene.materials):
            self.add(f"*MATERIAL, NAME=M{index}", *one.cards())
            if one.density is not None:
                self.add("*DENSITY", number(one.density))
            if one.expansion is not None:
                self.add("*EXPANSION", number(one.expansion))
            if one.axes is not None:
                self.add(*one.axes.orientation(f"O{index}"))
        for part in scene.parts:
            kinds = sorted(set(part.material))
            for m in kinds:
                name = part.name
                if len(kinds) > 1:
                    name = f"{part.name}-M{m}"
                    chosen = [
                        scene.element_ids[b]
                        for b, other in zip(part.elements, part.material, strict=True)
                        if other == m
                    ]
                    self.add(f"*ELSET, ELSET={name}", *listed(chosen))
                along = f", ORIENTATION=O{m}" if scene.materials[m].axes is not None else ""
                self.add(f"*SOLID SECTION, ELSET={name}, MATERIAL=M{m}{along}")

    def write_contact(self):
        scene = self.scene
        for one in scene.obstacles:
            if one.wall_of is not None:
                continue
            if one.kind == FACETS:
                self.write_facets(one)
                continue
            options = f"*OBSTACLE, NAME={one.name}, TYPE={one.kind}"
            if one.inner:
                options += ", INNER"
            if one.reference is not None:
                options += f", REF NODE={scene.ids[one.reference]}"
            if one.kind == STL:
                self.add(f"{options}, INPUT={self.stl_name(one)}")
                continue
            data = [*one.point]
            if one.direction is not None:
                data += [*one.direction]
            if one.kind != PLANE:
                data.append(one.radius)
            self.add(options, ", ".join(number(x) for x in data))
        for index, pair in enumerate(scene.pairs):
            if pair.wall:
                continue
            self.add(f"*SURFACE INTERACTION, NAME=I{index}")
            if pair.closed is not None:
                self.add("*SURFACE BEHAVIOR, NO SEPARATION")
            if pair.friction:
                most = "" if pair.most is None else f", TAUMAX={number(pair.most)}"
                self.add(f"*FRICTION{most}", number(pair.friction))
            options = "" if pair.adjust is None else f", ADJUST={number(pair.adjust)}"
            options += ", SMALL SLIDING" if pair.small else ""
            self.add(f"*CONTACT PAIR, INTERACTION=I{index}{options}")
            self.add(f"{scene.name_of(pair).replace(':', ', ')}")
        for index, tie in enumerate(scene.ties):
            names = [f"{scene.parts[part].name}-{side}" for part, side in (tie.slave, tie.master)]
            self.add(f"*TIE, NAME=T{index}", ", ".join(names))
        for (part, side), gap in scene.gaps.items():
            self.add("*CONTACT GAP", f"{scene.parts[part].name}-{side}, {number(gap)}")
        self.write_joints()

    def write_joints(self):
        """Equations, couplings, local directions and first temperatures."""
        scene = self.scene
        for one in scene.equations:
            terms = [f"{self.set_of(rows, None)}, {dof + 1}, {number(weight)}"
                     for rows, dof, weight in one.terms]  # fmt: skip
            self.add("*EQUATION", str(len(terms)), *terms)
        for index, one in enumerate(scene.couplings):
            side = f"{scene.parts[one.part].name}-{one.side}"
            if one.kinematic and len(one.dofs) == 3 and scene.seed % 2:
                # The same in the words of the other card.
                self.add(f"*RIGID BODY, NSET={side}, REF NODE={scene.ids[one.reference]}")
                continue
            self.add(f"*COUPLING, CONSTRAINT NAME=C{index}, REF NODE={scene.ids[one.reference]}, "
                     f"SURFACE={side}")  # fmt: skip
            self.add("*KINEMATIC" if one.kinematic else "*DISTRIBUTING")
            if len(one.dofs) < 3:
                self.add(*[f"{i + 1}, {i + 1}" for i in one.dofs])
        for one in scene.transforms:
            self.add(f"*TRANSFORM, NSET={self.set_of(one.rows, one.name)}, "
                     f"TYPE={'C' if one.around else 'R'}")  # fmt: skip
            self.add(", ".join(number(x) for x in one.points))
        for one in scene.first_temperatures:
            self.add("*INITIAL CONDITIONS, TYPE=TEMPERATURE")
            self.add(f"{self.set_of(one.rows, one.name)}, {number(one.value)}")

    def stl_name(self, obstacle):
        """The STL file of an obstacle, beside the deck."""
        return f"seed-{self.scene.seed}-{obstacle.name}.stl"

    def write_facets(self, one):
        """Nodes, facets, rigid body and surface of an obstacle."""
        scene = self.scene
        self.add("*NODE")
        for row in one.corner_rows:
            self.add(f"{scene.ids[row]}, " + ", ".join(number(x) for x in scene.points[row]))
        number_of = [o is one for o in scene.obstacles].index(True)
        first = int(scene.element_ids.max()) + 1 + 1000 * number_of
        for size in (3, 4):
            chosen = [(i, f) for i, f in enumerate(one.facets) if len(f) == size]
            if chosen:
                self.add(f"*ELEMENT, TYPE=R3D{size}, ELSET={one.name}-E")
            for i, f in chosen:
                order = f[::-1] if one.back else f
                ids = [str(scene.ids[one.corner_rows[c]]) for c in order]
                self.add(", ".join([str(first + i), *ids]))
        self.add(f"*RIGID BODY, ELSET={one.name}-E, REF NODE={scene.ids[one.reference]}")
        self.add(f"*SURFACE, NAME={one.name}", f"{one.name}-E, {'SNEG' if one.back else 'SPOS'}")

    def write_controls(self):
        for keyword, options in (
            ("*CONTACT SOLVER", self.scene.controls),
            ("*PRECISION", self.scene.precision),
        ):
            if options:
                values = [v if isinstance(v, str) else number(v) for v in options.values()]
                words = [f"{k}={v}" for k, v in zip(options, values, strict=True)]
                self.add(", ".join([keyword, *words]))

    def set_of(self, rows, name):
        """A name or an id for some points."""
        if name is not None:
            return name
        if len(set(rows)) == 1:
            return str(self.scene.ids[rows[0]])
        return self.sets.setdefault(tuple(rows), f"SET{len(self.sets)}")

    def write_step(self, step):
        self.add("*STEP, NLGEOM" if self.scene.finite else "*STEP")
        self.add("*STATIC, DIRECT" if step.direct else "*STATIC")
        self.add(f"{number(step.period / step.increments)}, {number(step.period)}")
        written = set()

        def card(keyword, amplitude, fixed=False):
            text = keyword + (", FIXED" if fixed else "")
            if amplitude is not None:
                text += f", AMPLITUDE=A{amplitude}"
            if keyword in step.new and keyword not in written:
                text += ", OP=NEW"
                written.add(keyword)
            self.add(text)

        for one in step.boundaries:
            card("*BOUNDARY", one.amplitude, one.fixed)
            place = self.set_of(one.rows, one.name)
            self.add(f"{place}, {one.dof + 1}, {one.dof + 1}, {number(one.value)}")
        for one in step.forces:
            card("*CLOAD", one.amplitude)
            self.add(f"{self.set_of(one.rows, one.name)}, {one.dof + 1}, {number(one.value)}")
        for one in step.pressures:
            part = self.scene.parts[one.part]
            if one.by_faces:
                card("*DLOAD", one.amplitude)
                for element, face in part.sides[one.side]:
                    self.add(f"{self.scene.element_ids[element]}, P{face + 1}, {number(one.value)}")
            else:
                card("*DSLOAD", one.amplitude)
                self.add(f"{part.name}-{one.side}, P, {number(one.value)}")
        for one in step.gravity:
            card("*DLOAD", one.amplitude)
            along = ", ".join(number(x) for x in one.direction)
            self.add(f"{self.scene.parts[one.part].name}, GRAV, {number(one.value)}, {along}")
        for one in step.temperatures:
            card("*TEMPERATURE", one.amplitude)
            self.add(f"{self.set_of(one.rows, one.name)}, {number(one.value)}")
        for keyword in sorted(step.new - written):
            self.add(f"{keyword}, OP=NEW")
        self.add("*END STEP")


def deck_of(scene):
    """The deck of a scene, as text."""
    return DeckWriter(scene).text()


def stl_of(obstacle):
    """The bytes of an STL file of an obstacle's triangles."""
    facets = [obstacle.corners[list(f)] for f in obstacle.facets]
    if obstacle.text:
        lines = ["solid tool"]
        for x in facets:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(number(v) for v in corner) for corner in x]
            lines += ["endloop", "endfacet"]
        return "\n".join([*lines, "endsolid tool", ""]).encode()
    parts = [b"random scene".ljust(80), struct.pack("<I", len(facets))]
    parts += [struct.pack("<12fH", 0, 0, 0, *x.ravel(), 0) for x in facets]
    return b"".join(parts)


def write_deck(scene, path):
    """Write a deck, and beside it the STL files that it names."""
    writer = DeckWriter(scene)
    path.write_text(writer.text())
    for obstacle in scene.obstacles:
        if obstacle.kind == STL and obstacle.wall_of is None:
            (path.parent / writer.stl_name(obstacle)).write_bytes(stl_of(obstacle))
