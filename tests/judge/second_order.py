"""Elements of second order from the monomials that define their types: what the judge sums up.

Nothing is taken from the program. Places go with the nodes' own functions, mid-side nodes anywhere.
"""

from itertools import permutations, product

import numpy as np

TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
WEDGE = [(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)]
HEXA = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
        (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]  # fmt: skip
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
WEDGE_EDGES = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
HEXA_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
              (0, 4), (1, 5), (2, 6), (3, 7)]  # fmt: skip
TET_POWERS = [p for p in product(range(3), repeat=3) if sum(p) <= 2]
WEDGE_POWERS = ([(a, b, c) for a, b in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
                 for c in (0, 1)] + [(a, b, 2) for a, b in ((0, 0), (1, 0), (0, 1))])  # fmt: skip
# Of the 27 of a full hexahedron those with at most one square, and no square of a product alone.
HEXA_POWERS = [p for p in product(range(3), repeat=3)
               if sum(i for i in p if i > 1) <= 2]  # fmt: skip


def gauss_rule(n):
    """Points and weights of n x n x n points."""
    x, w = np.polynomial.legendre.leggauss(n)
    points = np.array(list(product(x, repeat=3)))
    return points, np.array([a * b * c for a, b, c in product(w, repeat=3)])


def tet_rule():
    """Four points of degree 2."""
    a = (5 - np.sqrt(5)) / 20
    b = 1 - 3 * a
    return np.array([(a, a, a), (b, a, a), (a, b, a), (a, a, b)]), np.full(4, 1 / 24)


def wedge_rule():
    """Six points of degree 4 on the triangle [Dunavant 1985], times three along the axis."""
    flat, weights = [], []
    for a, w in ((0.445948490915965, 0.223381589678011), (0.091576213509771, 0.109951743655322)):
        b = 1 - 2 * a
        flat += [(a, a), (a, b), (b, a)]
        weights += 3 * [w / 2]
    x, v = np.polynomial.legendre.leggauss(3)
    points = [(*p, z) for p in flat for z in x]
    return np.array(points), np.array([w * s for w in weights for s in v])


def whole_rule(corners):
    """6 x 6 x 6 points and weights of a cell with so many corners, folded from the cube."""
    points, weights = gauss_rule(6)
    if corners == 8:
        return points, weights
    s, t, r = (1 + points.T) / 2
    weights = weights / 8 * (1 - s)
    if corners == 6:
        return np.stack([s, t * (1 - s), points[:, 2]], axis=1), 2 * weights
    return np.stack([s, t * (1 - s), r * (1 - s) * (1 - t)], axis=1), weights * (1 - s) * (1 - t)


def values_and_slopes(powers, inverse, points):
    """Functions (G, A) and gradients (G, A, 3) of nodes at points of the parent."""
    values = np.prod(points[:, None] ** powers[None], axis=2) @ inverse
    slopes = np.zeros((len(points), len(powers), 3))
    for i in range(3):
        less = powers.copy()
        less[:, i] = np.maximum(less[:, i] - 1, 0)
        slopes[:, :, i] = powers[:, i] * np.prod(points[:, None] ** less[None], axis=2)
    return values, np.einsum("gpi,pa->gai", slopes, inverse)


class Kind:
    """An element type: its functions and their gradients at its points of quadrature."""

    def __init__(self, corners, edges, powers, rule, faces):
        corners = np.array(corners, dtype=float)
        self.edges, self.faces, self.corners = edges, faces, len(corners)
        middles = [(corners[a] + corners[b]) / 2 for a, b in edges]
        places = np.vstack([corners, middles])
        powers = np.array(powers)
        table = np.prod(places[:, None] ** powers[None], axis=2)
        assert table.shape[0] == table.shape[1]
        inverse = np.linalg.inv(table)
        points, self.weights = rule
        self.values, self.gradients = values_and_slopes(powers, inverse, points)
        points, self.whole_weights = whole_rule(self.corners)
        self.whole = values_and_slopes(powers, inverse, points)


class Face:
    """A face of a triangle with 6 nodes or a quadrilateral with 8: values and slopes at points."""

    def __init__(self, corners, powers, points, weights):
        self.corners = len(corners)
        corners = np.array(corners, dtype=float)
        middles = (corners + np.roll(corners, -1, axis=0)) / 2
        powers, points = np.array(powers), np.array(points)
        table = np.prod(np.vstack([corners, middles])[:, None] ** powers[None], axis=2)
        inverse = np.linalg.inv(table)
        self.powers, self.inverse = powers, inverse
        self.weights = np.array(weights)
        self.values, self.slopes = self.at(points)

    def at(self, points):
        """Functions (G, A), and their slopes along both coordinates, at points (G, 2)."""
        x, y = points.T
        first, second = self.powers.T
        of_x, of_y = (np.stack([np.ones_like(v), v, v * v]) for v in (x, y))
        slope_x, slope_y = (np.stack([0 * v, np.ones_like(v), 2 * v]) for v in (x, y))
        values = (of_x[first] * of_y[second]).T @ self.inverse
        slopes = ((slope_x[first] * of_y[second]).T, (of_x[first] * slope_y[second]).T)
        return values, [slope @ self.inverse for slope in slopes]

    def pressed(self, x):
        """Return int N n dA (n, 3) of nodes at x, n into the body."""
        normal = np.cross(self.slopes[0] @ x, self.slopes[1] @ x)
        return self.values.T @ (self.weights[:, None] * normal)

    def shares(self, x):
        """int N dA of nodes at x (n, 3), corners first."""
        normal = np.cross(self.slopes[0] @ x, self.slopes[1] @ x)
        return self.values.T @ (self.weights * np.linalg.norm(normal, axis=1))


def face_rules():
    """{number of corners: Face}, by 6 x 6 Gauss points, on triangles folded from the square."""
    x, w = np.polynomial.legendre.leggauss(6)
    square = list(product(x, repeat=2))
    weights = [a * b for a, b in product(w, repeat=2)]
    flat = [((1 + s) / 2, (1 - s) * (1 + t) / 4) for s, t in square]
    folded = [v * (1 - s) / 8 for (s, _), v in zip(square, weights, strict=True)]
    quadratic = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    return {3: Face([(0, 0), (1, 0), (0, 1)], quadratic, flat, folded),
            4: Face([(-1, -1), (1, -1), (1, 1), (-1, 1)], [*quadratic, (2, 1), (1, 2)],
                    square, weights)}  # fmt: skip


FACES = face_rules()
TET_FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]
WEDGE_FACES = [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]
HEXA_FACES = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
KINDS = {
    "C3D10": Kind(TET, TET_EDGES, TET_POWERS, tet_rule(), TET_FACES),
    "C3D15": Kind(WEDGE, WEDGE_EDGES, WEDGE_POWERS, wedge_rule(), WEDGE_FACES),
    "C3D20": Kind(HEXA, HEXA_EDGES, HEXA_POWERS, gauss_rule(3), HEXA_FACES),
    "C3D20R": Kind(HEXA, HEXA_EDGES, HEXA_POWERS, gauss_rule(2), HEXA_FACES),
}


class Box:
    """A box of elements in a grid of half cells, distorted inside: types side by side or stacked.

    The nodes are at `grid / 2 + shift`, in cells.
    """

    def __init__(self, rng, types, n):
        self.types, self.n = types, n
        index, self.elements, grid = {}, [], []

        def node(at):
            at = tuple(int(i) for i in at)
            if at not in index:
                index[at] = len(grid)
                grid.append(at)
            return index[at]

        def add(kind, corners):
            corners = [np.array(c) for c in corners]
            if kind == "C3D10" and np.linalg.det(np.array(corners[1:]) - corners[0]) < 0:
                corners[2], corners[3] = corners[3], corners[2]
            every = [*corners, *((corners[a] + corners[b]) // 2 for a, b in KINDS[kind].edges)]
            self.elements.append((kind, [node(c) for c in every]))

        for i, j, k in product(*map(range, n)):
            base, kind = 2 * np.array([i, j, k]), self.type_of(i, k)
            if kind == "C3D10":
                for order in permutations(range(3)):
                    steps = np.cumsum([2 * np.eye(3, dtype=int)[o] for o in order], axis=0)
                    add(kind, [base, *(base + s for s in steps)])
            elif kind == "C3D15":
                for flat in (((0, 0), (2, 0), (2, 2)), ((0, 0), (2, 2), (0, 2))):
                    add(kind, [base + np.array([*p, z]) for z in (0, 2) for p in flat])
            else:
                add(kind, [base + np.array(c) + 1 for c in HEXA])
        self.grid = grid = np.array(grid)
        inside = (grid > 0) & (grid < 2 * n)
        shift = rng.uniform(-0.15, 0.15, grid.shape) * inside
        self.middles = {}  # mid-side node -> the ends of its edge
        for kind, nodes in self.elements:
            for (a, b), m in zip(KINDS[kind].edges, nodes[KINDS[kind].corners :], strict=True):
                self.middles[m] = (nodes[a], nodes[b])
        for m, (a, b) in self.middles.items():
            shift[m] = (shift[a] + shift[b]) / 2 + inside[m] * rng.uniform(-0.04, 0.04, 3)
        self.shift = shift

    def type_of(self, i, k):
        """The type of a cell: hexahedra lie beside wedges, tetrahedra above or below them."""
        if len(self.types) == 1:
            return self.types[0]
        at = k if "C3D10" in self.types else i
        return self.types[0] if at == 0 else self.types[1]

    def nodes_on(self, axis, end):
        """Rows of the nodes on a side: end 0 or 1."""
        return np.flatnonzero(self.grid[:, axis] == 2 * end * self.n[axis])

    def faces_on(self, axis, end):
        """[(element, face number from 1)] of a side."""
        place = 2 * end * self.n[axis]
        return [
            (e, f + 1)
            for e, (kind, nodes) in enumerate(self.elements)
            for f, corners in enumerate(KINDS[kind].faces)
            if np.all(self.grid[[nodes[c] for c in corners], axis] == place)
        ]


class Mesh:
    """Elements with materials, and what is summed over them."""

    def __init__(self, points, elements, middles, materials):
        """`materials`: (modulus, nu, density, expansion) of each element."""
        self.points, self.elements, self.middles = points, elements, middles
        self.materials = materials
        self.middle_of = {frozenset(ends): m for m, ends in middles.items()}

    def face_nodes(self, e, f):
        """Corners, then middles, of face f (from 1) of an element."""
        kind, nodes = self.elements[e]
        corners = [nodes[c] for c in KINDS[kind].faces[f - 1]]
        around = zip(corners, [*corners[1:], corners[0]], strict=True)
        return corners + [self.middle_of[frozenset(ends)] for ends in around]

    def at_points(self, e):
        """Gradients (G, A, 3) in space and volumes (G,) at the points of an element."""
        kind, nodes = self.elements[e]
        one = KINDS[kind]
        jacobian = np.einsum("gai,aj->gij", one.gradients, self.points[nodes])
        slopes = np.einsum("gij,gaj->gai", np.linalg.inv(jacobian), one.gradients)
        volume = one.weights * np.linalg.det(jacobian)
        assert volume.min() > 0
        return nodes, slopes, volume

    def constants(self, e):
        """Lame's constants of an element."""
        young, nu = self.materials[e][:2]
        return young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))

    def internal_force(self, u, warmer=None):
        """Forces (N, 3) of the stresses; `warmer`: how much the nodes are."""
        out = np.zeros_like(u)
        for e in range(len(self.elements)):
            nodes, slopes, volume = self.at_points(e)
            lame, shear = self.constants(e)
            h = np.einsum("gai,aj->gji", slopes, u[nodes] - u[nodes[0]])
            strain = (h + h.transpose(0, 2, 1)) / 2
            if warmer is not None:
                strain = strain - self.materials[e][3] * warmer[nodes].mean() * np.eye(3)
            stress = 2 * shear * strain
            stress += lame * np.einsum("gii->g", strain)[:, None, None] * np.eye(3)
            np.add.at(out, nodes, np.einsum("g,gij,gaj->ai", volume, stress, slopes))
        return out

    def stiffness(self):
        """(3N, 3N), dense."""
        count = len(self.points)
        out = np.zeros((count, 3, count, 3))
        for e in range(len(self.elements)):
            nodes, g, volume = self.at_points(e)
            lame, shear = self.constants(e)
            k = lame * np.einsum("g,gai,gbj->aibj", volume, g, g)
            k += shear * np.einsum("g,gaj,gbi->aibj", volume, g, g)
            dots = shear * np.einsum("g,gak,gbk->ab", volume, g, g)
            for i in range(3):
                k[:, i, :, i] += dots
            at = np.ix_(nodes, range(3), nodes, range(3))
            out[at] += k
        return out.reshape(3 * count, 3 * count)

    def weight(self, elements, acceleration):
        """Forces (N, 3) of gravity on elements, exact also where they are curved."""
        out = np.zeros_like(self.points)
        for e in elements:
            kind, nodes = self.elements[e]
            values, gradients = KINDS[kind].whole
            jacobian = np.einsum("gai,aj->gij", gradients, self.points[nodes])
            volume = KINDS[kind].whole_weights * np.linalg.det(jacobian)
            shares = self.materials[e][2] * volume @ values
            np.add.at(out, nodes, shares[:, None] * acceleration)
        return out

    def pressure(self, faces):
        """Forces (N, 3) of a pressure of 1 on faces [(element, face)]."""
        out = np.zeros_like(self.points)
        for e, f in faces:
            nodes = self.face_nodes(e, f)
            out[nodes] += FACES[len(nodes) // 2].pressed(self.points[nodes])
        return out

    def edge_shares(self, faces):
        """{mid-side node: alpha} of (9.11) on faces [(element, face)]."""
        alpha = {}
        for e, f in faces:
            nodes = self.face_nodes(e, f)
            mine = 0.25 if len(nodes) == 8 else 0.2
            for m in nodes[len(nodes) // 2 :]:
                alpha[m] = max(mine, alpha.get(m, 0.0))
        return alpha

    def areas(self, faces, alpha):
        """Those (N,) of the points of faces, (9.12)."""
        share = np.zeros(len(self.points))
        for e, f in faces:
            nodes = self.face_nodes(e, f)
            np.add.at(share, nodes, FACES[len(nodes) // 2].shares(self.points[nodes]))
        out = share.copy()
        for m, part in alpha.items():
            out[m] -= 2 * part * share[m]
            out[list(self.middles[m])] += part * share[m]
        return out
