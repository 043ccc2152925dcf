"""Nodal forces of every load on every type of element, in all orders of its nodes.

All nodes are held: the reactions are minus the integrals of the shape functions times the load,
which are computed here from the monomials that define the types. Nothing is taken from the program.
"""

import unittest
from itertools import permutations, product

import numpy as np
from program import Run

YOUNG, NU, DENSITY, EXPANSION = 1000.0, 0.3, 2.0, 1e-3
PRESSURE, SQUARE, RISE = 3.0, 0.7, 5.0
BULK_STRESS = YOUNG / (1 - 2 * NU) * EXPANSION * RISE  # that takes the expansion back
THICKNESS = 0.25

LINE = (-1, 1)
TRIANGLE = [(0, 0), (1, 0), (0, 1)]
SQUARE_CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
# Corners in natural coordinates, edges, and faces as CalculiX and Abaqus number them.
SHAPES = {
    "tetrahedron": (
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
        [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)],
    ),
    "wedge": (
        [(*p, z) for z in LINE for p in TRIANGLE],
        [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
        [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    ),
    "pyramid": (
        [(*p, 0) for p in SQUARE_CORNERS] + [(0, 0, 1)],
        [],
        [(0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)],
    ),
    "hexahedron": (
        [(*p, z) for z in LINE for p in SQUARE_CORNERS],
        [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
         (0, 4), (1, 5), (2, 6), (3, 7)],
        [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)],
    ),
    "triangle": (TRIANGLE, [(0, 1), (1, 2), (2, 0)], [(0, 1), (1, 2), (2, 0)]),
    "quadrilateral": (
        SQUARE_CORNERS, [(0, 1), (1, 2), (2, 3), (3, 0)], [(0, 1), (1, 2), (2, 3), (3, 0)],
    ),
}  # fmt: skip
# Rotations that generate all of a shape: what corner takes the place of each.
TURNS = {
    "tetrahedron": [(1, 2, 0, 3), (0, 2, 3, 1)],
    "wedge": [(1, 2, 0, 4, 5, 3), (3, 5, 4, 0, 2, 1)],
    "pyramid": [(1, 2, 3, 0, 4)],
    "hexahedron": [(1, 2, 3, 0, 5, 6, 7, 4), (3, 2, 6, 7, 0, 1, 5, 4)],
    "triangle": [(1, 2, 0)],
    "quadrilateral": [(1, 2, 3, 0)],
}
N_TURNS = {"tetrahedron": 12, "wedge": 6, "pyramid": 4, "hexahedron": 24, "triangle": 3,
           "quadrilateral": 4}  # fmt: skip
SOLIDS = {
    "C3D4": "tetrahedron", "C3D10": "tetrahedron", "C3D6": "wedge", "C3D15": "wedge",
    "C3D5": "pyramid", "C3D8": "hexahedron", "C3D8I": "hexahedron", "C3D8B": "hexahedron",
    "C3D20": "hexahedron", "C3D20R": "hexahedron",
}  # fmt: skip
PLANE = {
    "3": "triangle", "6": "triangle", "4": "quadrilateral", "8": "quadrilateral",
    "8R": "quadrilateral",
}  # fmt: skip


def powers_of(shape, second):
    """Return the exponents of a type's monomials: serendipity, where it has mid-side nodes."""
    top = range(3 if second else 2)
    if shape == "tetrahedron":
        return [p for p in product(top, repeat=3) if sum(p) < len(top)]
    if shape == "triangle":
        return [p for p in product(top, repeat=2) if sum(p) < len(top)]
    if shape == "wedge":
        return [p for p in product(top, repeat=3)
                if p[0] + p[1] < len(top) and (p[2] < 2 or p[0] + p[1] < 2)]  # fmt: skip
    dimension = 2 if shape == "quadrilateral" else 3
    return [p for p in product(top, repeat=dimension) if sum(i for i in p if i > 1) <= 2]


class Type:
    """A type of element: its nodes in natural coordinates, its functions and its symmetries."""

    def __init__(self, shape, second):
        corners, self.edges, self.faces = SHAPES[shape]
        corners = np.array(corners, dtype=float)
        self.shape, self.second, self.dimension = shape, second, corners.shape[1]
        self.nodes = corners
        if second:
            self.nodes = np.vstack([corners, [corners[list(e)].mean(axis=0) for e in self.edges]])
        self.n_corners = len(corners)
        self.powers = np.array(powers_of(shape, second))
        if shape == "pyramid":  # 1, x, y, z and x y/(1 - z), which is 0 at the apex
            self.inverse = np.linalg.inv([[1, *p, p[0] * p[1]] for p in corners])
        else:
            self.inverse = np.linalg.inv(np.prod(self.nodes[:, None] ** self.powers, axis=2))

    def values(self, place):
        """Return the functions of the nodes at natural coordinates, which may be complex."""
        if self.shape == "pyramid":
            return np.array([1, *place, place[0] * place[1] / (1 - place[2])]) @ self.inverse
        return np.prod(place**self.powers, axis=1) @ self.inverse

    def inside(self, t):
        """Return the natural coordinates that a point of the unit cube stands for."""
        if self.shape in ("hexahedron", "quadrilateral"):
            return 2 * t - 1
        if self.shape == "pyramid":
            return np.array([*((2 * t[:2] - 1) * (1 - t[2])), t[2]])
        if self.shape == "wedge":
            return np.array([t[0], t[1] * (1 - t[0]), 2 * t[2] - 1])
        left, place = 1.0, []
        for part in t:
            place.append(part * left)
            left = left - place[-1]
        return np.array(place)

    def on_face(self, face, t):
        """Return the natural coordinates on a face: bilinear, its last corner twice if it has 3."""
        corner = self.nodes[list(face)]
        if len(corner) == 2:
            return corner[0] * (1 - t[0]) + corner[1] * t[0]
        a, b, c, d = corner if len(corner) == 4 else (*corner, corner[2])
        return (a * (1 - t[1]) + d * t[1]) * (1 - t[0]) + (b * (1 - t[1]) + c * t[1]) * t[0]

    def orders(self):
        """Return all orders of the nodes that rotations of the shape give."""
        found = {tuple(range(self.n_corners))}
        while True:
            more = {tuple(one[i] for i in turn) for one in found for turn in TURNS[self.shape]}
            if more <= found:
                break
            found |= more
        at = {frozenset(edge): self.n_corners + k for k, edge in enumerate(self.edges)}
        return [
            (*one, *(at[frozenset((one[a], one[b]))] for a, b in self.edges if self.second))
            for one in sorted(found)
        ]


def slopes(function, t):
    """Return the derivatives of a function of t by complex steps, as columns."""
    step = 1e-30
    return np.stack([
        function(t + 1j * step * axis).imag / step for axis in np.eye(len(t))
    ], axis=-1)  # fmt: skip


def points(dimension):
    """Return points and weights in the unit cube or square."""
    line, weight = np.polynomial.legendre.leggauss(6)
    return zip(
        np.array(list(product((line + 1) / 2, repeat=dimension))),
        [np.prod(w) for w in product(weight / 2, repeat=dimension)],
        strict=True,
    )


def volume_integrals(kind, x, width):
    """Return the integrals of N (A), N x (A, d) and grad N (A, d), and of N/width (A)."""
    n, of_x = np.zeros(len(x)), np.zeros_like(x)
    gradient, around = np.zeros_like(x), np.zeros(len(x))
    for t, w in points(kind.dimension):
        value = kind.values(kind.inside(t))
        place = value @ x
        jacobian = slopes(lambda s: kind.values(kind.inside(s)) @ x, t)
        volume = w * np.linalg.det(jacobian) * width(place)
        n += volume * value
        of_x += volume * np.outer(value, place)
        natural = slopes(lambda s: kind.values(kind.inside(s)), t)
        gradient += volume * natural @ np.linalg.inv(jacobian)
        around += volume / place[0] * value
    return n, of_x, gradient, around


def pressure_forces(kind, x, face, width):
    """Return the integral of -N n over a face."""
    force = np.zeros_like(x)
    for t, w in points(kind.dimension - 1):
        value = kind.values(kind.on_face(face, t))
        along = slopes(lambda s: kind.values(kind.on_face(face, s)) @ x, t)
        # Faces of solids are listed clockwise from outside, edges of the plane anticlockwise.
        normal = np.cross(*along.T) if kind.dimension == 3 else [-along[1, 0], along[0, 0]]
        force += w * width(value @ x) * np.outer(value, normal)
    return force


def places(kind, shift):
    """Return nodes that lie askew, and the same with mid-side nodes out of the middle."""
    d = kind.dimension
    by = np.array([[1.0, 0.3, 0.1], [-0.2, 0.9, 0.2], [0.15, -0.1, 1.2]])[:d, :d]
    corners = kind.nodes[: kind.n_corners]
    x = corners @ by.T + 0.06 * np.sin(np.arange(corners.size).reshape(corners.shape) * 5 + 1)
    x = x + shift[:d]
    if not kind.second:
        return [x]
    x = np.vstack([x, [x[list(edge)].mean(axis=0) for edge in kind.edges]])
    bent = x.copy()
    middles = bent[kind.n_corners :]
    middles += 0.05 * np.cos(np.arange(middles.size) * 3).reshape(-1, d)
    return [x, bent]


class BodyLoads(unittest.TestCase):
    def check(self, name, kind, width, loads, stress, tolerance):
        """Compare all loads; `loads` are GRAV and CENTRIF with their directions and axis."""
        # Few bodies in one place: how deep they are in each other is looked for.
        orders = list(kind.orders())
        for first in range(0, len(orders), 2):
            self.check_orders(name, kind, width, loads, stress, tolerance, orders[first:first + 2])

    def check_orders(self, name, kind, width, loads, stress, tolerance, orders):
        """The same of elements with their nodes in some orders."""
        *_, steps = loads
        lines, elements, all_nodes, shapes = [], [], [], places(kind, np.array([3.0, 0.4, 0.2]))
        for k, x in enumerate(shapes):
            for order in orders:
                first = len(all_nodes)
                all_nodes += list(x)
                elements.append((k, order, [first + i for i in order]))
        for i, at in enumerate(all_nodes, 1):
            lines.append(", ".join([str(i), *(repr(float(v)) for v in at)]))
        lines = ["*NODE, NSET=ALL", *lines, f"*ELEMENT, TYPE={name}, ELSET=B"]
        for i, (*_, nodes) in enumerate(elements, 1):
            numbers = [str(i), *(str(node + 1) for node in nodes)]
            lines += [", ".join(numbers[:12]) + ("," if numbers[12:] else "")]
            lines += [", ".join(numbers[12:])] if numbers[12:] else []
        n_faces = len(kind.faces)
        text = "\n".join([
            *lines, "*MATERIAL, NAME=M", "*ELASTIC", f"{YOUNG}, {NU}", "*DENSITY", f"{DENSITY}",
            "*EXPANSION", f"{EXPANSION}", "*SOLID SECTION, ELSET=B, MATERIAL=M",
            *([f"{THICKNESS}"] if name[:2] == "CP" else []),
            "*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALL, 0.", "*BOUNDARY", "ALL, 1, 3",
            *(f"*STEP\n*STATIC\n1., 1.\n*DLOAD, OP=NEW\n{load}\n*NODE FILE\nRF\n*END STEP"
              for load in [*(f"B, P{k + 1}, {PRESSURE}" for k in range(n_faces)), *steps]),
            f"*STEP\n*STATIC\n1., 1.\n*DLOAD, OP=NEW\n*TEMPERATURE\nALL, {RISE}",
            "*NODE FILE\nRF\n*END STEP\n",
        ])  # fmt: skip
        run = Run(text, name="loads")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            self.assertEqual(result.finished, n_faces + 3)
            reactions = [result.field("reaction_force", k) for k in range(n_faces + 3)]
            found = -np.array([self.at_nodes(result, kind, force) for force in reactions])
        integrals = [self.integrals(kind, x, width, loads, stress, name) for x in shapes]
        for e, (k, order, _) in enumerate(elements):
            of_faces, of_body = integrals[k]
            wanted = [
                next(force for its, force in of_faces if its == {order[i] for i in face})
                for face in kind.faces
            ]
            for load, one in enumerate([*wanted, *of_body]):
                np.testing.assert_allclose(
                    found[load, e], one[list(order)], rtol=0, atol=tolerance * abs(one).max(),
                    err_msg=f"{name}, element {e + 1}, step {load + 1}",
                )

    def at_nodes(self, result, kind, force):
        """Return forces at the nodes of each element (n, A, d), of a slice those on all of it."""
        cells = np.concatenate([nodes for _, nodes in result.cells.values()])
        of = force[cells]
        if kind.dimension == 3:
            return of
        # Opposite a node another one, between two corners one more; those of a wedge are turned.
        x = result.points[cells]
        angle = np.arctan2(x[:, :, 2], x[:, :, 0]) * (self.ring and 1.0)
        of = np.stack([of[..., 0] * np.cos(angle) + of[..., 2] * np.sin(angle), of[..., 1]], -1)
        n = kind.n_corners
        corners = of[:, :n] + of[:, n : 2 * n]
        if not kind.second:
            return corners
        return np.concatenate(
            [corners + of[:, 4 * n :], of[:, 2 * n : 3 * n] + of[:, 3 * n : 4 * n]], axis=1
        )

    @staticmethod
    def integrals(kind, x, width, loads, stress, name):
        """Return the exact forces of pressure by faces (as sets of nodes), and of body loads."""
        gravity, axis, direction, _ = loads
        of_faces = [
            (set(face), PRESSURE * pressure_forces(kind, x, face, width)) for face in kind.faces
        ]
        n, of_x, gradient, around = volume_integrals(kind, x, width)
        from_axis = of_x - np.outer(n, axis)
        from_axis -= np.outer(from_axis @ direction, direction)
        of_body = [DENSITY * np.outer(n, gravity), DENSITY * SQUARE * from_axis]
        bent = kind.second and any(
            abs(x[list(edge)].mean(axis=0) - x[kind.n_corners + i]).max() > 1e-9
            for i, edge in enumerate(kind.edges)
        )
        if not bent:  # what stresses do is integrated exactly on straight edges alone
            of_body.append(stress * gradient)
            if name[:3] == "CAX":
                of_body[-1][:, 0] += stress * around
        return of_faces, of_body

    def test_copies_in_a_mirror(self):
        """*ELCOPY, REFLECT: the copies have forces per volume (BX) as their originals have."""
        types = [*SOLIDS.items(), *((f"CPE{name}", shape) for name, shape in PLANE.items())]
        for name, shape in types:
            with self.subTest(type=name):
                second = name in ("C3D10", "C3D15", "C3D20", "C3D20R", "CPE6", "CPE8", "CPE8R")
                kind = Type(shape, second)
                x = places(kind, np.array([3.0, 0.4, 0.2]))[0]
                ids = range(1, len(x) + 1)
                how, mirror = "MIRROR", "0., 0., -9., 1., 0., -9.\n0., 1., -9."
                if kind.dimension == 2:
                    how, mirror = "LINE", "0., -9., 0., 1., -9., 0."
                nodes = "\n".join(", ".join(map(str, (i, *map(float, at)))) for i, at in zip(
                    ids, x, strict=True))  # fmt: skip
                numbers = [str(i) for i in (1, *ids)]
                rows = [", ".join(numbers[:12]), ", ".join(numbers[12:])]
                text = "\n".join([
                    "*NODE, NSET=OLD", nodes,
                    f"*NCOPY, CHANGE NUMBER=100, OLD SET=OLD, NEW SET=NEW, REFLECT={how}",
                    mirror, f"*ELEMENT, TYPE={name}, ELSET=B", ",\n".join(filter(None, rows)),
                    "*ELCOPY, ELEMENT SHIFT=1, SHIFT NODES=100, OLD SET=B, NEW SET=B, REFLECT",
                    "*MATERIAL, NAME=M", "*ELASTIC", "1000., 0.3",
                    "*SOLID SECTION, ELSET=B, MATERIAL=M", "*STEP", "*STATIC", "*BOUNDARY",
                    "OLD, 1, 3", "NEW, 1, 3", "*DLOAD", "B, BX, 2.", "*NODE FILE", "RF",
                    "*END STEP", "",
                ])  # fmt: skip
                run = Run(text, name="mirror")
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    force = result.field("reaction_force", -1)[:, 0]
                    of = dict(zip(result.node_ids.tolist(), force, strict=False))
                one = np.array([of[node] for node in ids])
                other = np.array([of[node + 100] for node in ids])
                np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * abs(one).max())
                self.assertLess(one.sum(), 0)

    def test_orders_are_all_that_there_are(self):
        """As many as a shape has rotations; each keeps the volume's sign."""
        for shape, n in N_TURNS.items():
            kind = Type(shape, False)
            orders = kind.orders()
            self.assertEqual(len(orders), n)
            for order in orders:
                to = np.linalg.lstsq(
                    np.c_[kind.nodes, np.ones(len(order))], kind.nodes[list(order)], rcond=None
                )[0]
                self.assertGreater(np.linalg.det(to[:-1]), 0)
        even = [p for p in permutations(range(4)) if np.linalg.det(np.eye(4)[list(p)]) > 0]
        self.assertEqual(Type("tetrahedron", False).orders(), even)

    def test_of_solids(self):
        direction = np.array([1.0, 2.0, -2.0]) / 3
        axis, gravity = np.array([0.3, 0.2, -0.1]), np.array([0.5, -2.0, 1.0])
        size = np.linalg.norm(gravity)
        steps = (
            f"B, GRAV, {size!r}, 0.5, -2., 1.",
            f"B, CENTRIF, {SQUARE}, 0.3, 0.2, -0.1, 1., 2., -2.",
        )
        for name, shape in SOLIDS.items():
            with self.subTest(kind=name):
                kind = Type(shape, name in ("C3D10", "C3D15", "C3D20", "C3D20R"))
                self.check(name, kind, lambda _: 1.0, (gravity, axis, direction, steps),
                           BULK_STRESS, 1e-11)  # fmt: skip

    def test_of_plane_elements(self):
        """Wedges of a body of revolution have chords for arcs: forces within 2e-4."""
        for family, stress in (("CPE", BULK_STRESS), ("CAX", BULK_STRESS),
                               ("CPS", YOUNG / (1 - NU) * EXPANSION * RISE)):  # fmt: skip
            ring = self.ring = family == "CAX"
            gravity = np.array([0.0, -2.0] if ring else [0.5, -2.0])
            axis = np.array([0.0, 0.0] if ring else [0.3, 0.2])
            direction = np.array([0.0, 1.0] if ring else [0.0, 0.0])
            steps = (
                f"B, GRAV, {float(np.linalg.norm(gravity))!r}, {gravity[0]}, {gravity[1]}, 0.",
                f"B, CENTRIF, {SQUARE}, {axis[0]}, {axis[1]}, 0., "
                + ("0., 1., 0." if ring else "0., 0., 1."),
            )
            width = (lambda x: 2 * np.pi * x[0]) if ring else lambda _: THICKNESS
            for size, shape in PLANE.items():
                with self.subTest(kind=family + size):
                    kind = Type(shape, size[0] in "68")
                    self.check(family + size, kind, width, (gravity, axis, direction, steps),
                               stress, 2e-4 if ring else 1e-11)  # fmt: skip


if __name__ == "__main__":
    unittest.main()
