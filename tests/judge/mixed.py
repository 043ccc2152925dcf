#!/usr/bin/env python3
"""Random decks of elements of second order before obstacles, judged by formulas of its own.

    tests/judge/mixed.py --decks 60 --seed 1 [--only SEED ...]

A box of C3D10, C3D15, C3D20 or C3D20R, or of two of these beside or above each other, distorted,
with mid-side nodes off the middle, is pressed onto a plane or a sphere and pushed along it. Shape
functions come from the monomials that the types are defined by, and the stiffness, gaps, slips and
nodal forces of the points (9.11) from them; nothing is taken from the program.
A deck is right, wrong (certified, and not so), refused (not looked into further), or broken.
Exit status 1 where any is wrong or broken.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections import Counter
from itertools import permutations, product
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
ALLOWED = 2e-7  # twice what a certified increment may be off, of the largest force or motion

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


class Kind:
    """An element type: its places in the parent, and gradients at its points of quadrature."""

    def __init__(self, corners, edges, powers, rule, faces):
        corners = np.array(corners, dtype=float)
        self.edges, self.faces, self.corners = edges, faces, len(corners)
        middles = [(corners[a] + corners[b]) / 2 for a, b in edges]
        places = np.vstack([corners, middles])
        powers = np.array(powers)
        table = np.prod(places[:, None] ** powers[None], axis=2)
        assert table.shape[0] == table.shape[1]
        points, self.weights = rule
        slopes = np.zeros((len(points), len(powers), 3))
        for i in range(3):
            less = powers.copy()
            less[:, i] = np.maximum(less[:, i] - 1, 0)
            slopes[:, :, i] = powers[:, i] * np.prod(points[:, None] ** less[None], axis=2)
        self.gradients = np.einsum("gpi,pa->gai", slopes, np.linalg.inv(table))


class Face:
    """A face of a triangle with 6 nodes or a quadrilateral with 8: values and slopes at points."""

    def __init__(self, corners, powers, points, weights):
        corners = np.array(corners, dtype=float)
        middles = (corners + np.roll(corners, -1, axis=0)) / 2
        powers, points = np.array(powers), np.array(points)
        table = np.prod(np.vstack([corners, middles])[:, None] ** powers[None], axis=2)
        inverse = np.linalg.inv(table)
        self.weights = np.array(weights)
        self.values = np.prod(points[:, None] ** powers[None], axis=2) @ inverse
        slopes = []
        for i in range(2):
            less = powers.copy()
            less[:, i] = np.maximum(less[:, i] - 1, 0)
            slopes.append(powers[:, i] * np.prod(points[:, None] ** less[None], axis=2) @ inverse)
        self.slopes = slopes

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


class Scene:
    """A deck of a seed."""

    def __init__(self, seed):
        rng = self.rng = np.random.default_rng([20266, seed])
        self.seed = seed
        pairs = [("C3D10",), ("C3D15",), ("C3D20",), ("C3D20R",), ("C3D20", "C3D15"),
                 ("C3D20R", "C3D15"), ("C3D10", "C3D15"), ("C3D15", "C3D10")]  # fmt: skip
        self.types = pairs[rng.integers(len(pairs))]
        self.n = rng.integers(2, 4, 3)
        self.size = float(rng.choice([1.0, 1.0, 10 ** rng.uniform(-3, 3)]))
        self.young = float(rng.choice([1000.0, 10 ** rng.uniform(0, 11)]))
        self.nu = float(rng.choice([0.3, 0.0, 0.25, -0.3, 0.4]))
        self.mu = float(rng.choice([0.0, 0.3, rng.uniform(0.02, 1.5)]))
        self.ball = bool(rng.random() < 0.35)
        self.make_mesh()
        depth = self.size * 10 ** rng.uniform(-3, -2)
        ways = [np.array([0.0, 0.0, -depth])]
        for _ in range(rng.integers(1, 3)):
            ways.append(ways[0] * rng.uniform(0.5, 1.5) + depth * np.array(
                [*rng.uniform(-3, 3, 2), 0.0]))  # fmt: skip
        self.ways, self.parts = ways, int(rng.integers(1, 4))
        self.radius = self.size * 10 ** rng.uniform(0, 1)
        under = self.points[self.foot].mean(axis=0)
        self.centre = np.array([*under[:2], -self.radius])

    def type_of(self, i, k):
        """The type of a cell: hexahedra lie beside wedges, tetrahedra above or below them."""
        if len(self.types) == 1:
            return self.types[0]
        at = k if "C3D10" in self.types else i
        return self.types[0] if at == 0 else self.types[1]

    def make_mesh(self):
        """Nodes by their places in a grid of half cells, elements and faces of the foot."""
        rng, n = self.rng, self.n
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
        grid = np.array(grid)
        inside = (grid > 0) & (grid < 2 * n)
        corner = np.zeros(len(grid), dtype=bool)
        for kind, nodes in self.elements:
            corner[nodes[: KINDS[kind].corners]] = True
        shift = rng.uniform(-0.15, 0.15, grid.shape) * inside
        middles = {}
        for kind, nodes in self.elements:
            for (a, b), m in zip(KINDS[kind].edges, nodes[KINDS[kind].corners :], strict=True):
                middles[m] = (nodes[a], nodes[b])
        for m, (a, b) in middles.items():
            shift[m] = (shift[a] + shift[b]) / 2 + inside[m] * rng.uniform(-0.04, 0.04, 3)
        shape = np.array([1.0, rng.uniform(0.6, 1.4), rng.uniform(0.5, 1.2)])
        self.points = self.size * shape * (grid / 2 + shift) / n
        self.middles = middles
        self.top = np.flatnonzero(grid[:, 2] == 2 * n[2])
        self.foot = np.flatnonzero(grid[:, 2] == 0)
        self.faces = []  # (element, face number from 1)
        self.alpha = {}  # mid-side node of the foot -> alpha
        for e, (kind, nodes) in enumerate(self.elements):
            for f, corners in enumerate(KINDS[kind].faces):
                if np.any(grid[[nodes[c] for c in corners], 2]):
                    continue
                self.faces.append((e, f + 1))
                for (a, b), m in zip(KINDS[kind].edges, nodes[KINDS[kind].corners :], strict=True):
                    if a in corners and b in corners:
                        mine = 0.25 if len(corners) == 4 else 0.2
                        self.alpha[m] = max(mine, self.alpha.get(m, 0.0))

    def deck(self):
        """The deck's text."""
        out = ["*NODE"]
        out += [f"{i + 1}, " + ", ".join(repr(float(v)) for v in x)
                for i, x in enumerate(self.points)]  # fmt: skip
        for kind in dict.fromkeys(kind for kind, _ in self.elements):
            out.append(f"*ELEMENT, TYPE={kind}, ELSET=B")
            for e, (other, nodes) in enumerate(self.elements):
                if other == kind:
                    ids = [str(e + 1), *(str(i + 1) for i in nodes)]
                    rows = [", ".join(ids[i : i + 12]) for i in range(0, len(ids), 12)]
                    out += [f"{row}," for row in rows[:-1]] + rows[-1:]
        out += ["*NSET, NSET=TOP", *(str(i + 1) for i in self.top)]
        out += ["*SURFACE, NAME=FOOT", *(f"{e + 1}, S{f}" for e, f in self.faces)]
        out += ["*MATERIAL, NAME=M", "*ELASTIC", f"{self.young!r}, {self.nu!r}",
                "*SOLID SECTION, ELSET=B, MATERIAL=M"]  # fmt: skip
        place = ", ".join(repr(float(v)) for v in self.centre)
        if self.ball:
            out += ["*OBSTACLE, NAME=O, TYPE=SPHERE", f"{place}, {self.radius!r}"]
        else:
            out += ["*OBSTACLE, NAME=O, TYPE=PLANE", "0., 0., 0., 0., 0., 1."]
        out += ["*SURFACE INTERACTION, NAME=I"]
        out += ["*FRICTION", repr(self.mu)] if self.mu else []
        out += ["*CONTACT PAIR, INTERACTION=I", "FOOT, O"]
        for way in self.ways:
            out += ["*STEP", "*STATIC, DIRECT", f"{1 / self.parts!r}, 1.", "*BOUNDARY"]
            out += [f"TOP, {i + 1}, {i + 1}, {float(way[i])!r}" for i in range(3)]
            out += ["*END STEP"]
        return "\n".join(out) + "\n"

    def internal_force(self, u):
        """Forces (N, 3) of the stresses."""
        lame = self.young * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
        shear = self.young / (2 * (1 + self.nu))
        out = np.zeros_like(u)
        for kind, nodes in self.elements:
            one = KINDS[kind]
            jacobian = np.einsum("gai,aj->gij", one.gradients, self.points[nodes])
            slopes = np.einsum("gij,gaj->gai", np.linalg.inv(jacobian), one.gradients)
            h = np.einsum("gai,aj->gji", slopes, u[nodes] - u[nodes[0]])
            strain = (h + h.transpose(0, 2, 1)) / 2
            stress = 2 * shear * strain
            stress += lame * np.einsum("gii->g", strain)[:, None, None] * np.eye(3)
            volume = one.weights * np.linalg.det(jacobian)
            assert volume.min() > 0
            np.add.at(out, nodes, np.einsum("g,gij,gaj->ai", volume, stress, slopes))
        return out

    def areas(self):
        """Those (N,) of the points, (9.12)."""
        share = np.zeros(len(self.points))
        middle_of = {frozenset(ends): m for m, ends in self.middles.items()}
        for e, f in self.faces:
            kind, nodes = self.elements[e]
            corners = [nodes[c] for c in KINDS[kind].faces[f - 1]]
            around = zip(corners, [*corners[1:], corners[0]], strict=True)
            every = corners + [middle_of[frozenset(ends)] for ends in around]
            np.add.at(share, every, FACES[len(corners)].shares(self.points[every]))
        out = share.copy()
        for m, alpha in self.alpha.items():
            out[m] -= 2 * alpha * share[m]
            out[list(self.middles[m])] += alpha * share[m]
        return out

    def rounding(self, u):
        """A force that may be rounding of displacements alone."""
        return 1e-11 * self.young / (1 - 2 * self.nu) * self.size * np.abs(u).max()

    def gaps_and_normals(self, places):
        """Of nodes at `places` (N, 3)."""
        if not self.ball:
            return places[:, 2], np.tile((0.0, 0.0, 1.0), (len(places), 1))
        away = places - self.centre
        far = np.linalg.norm(away, axis=1)
        return far - self.radius, away / far[:, None]


def judge(scene, path):
    """Findings [(increment, kind, found over allowed)] on a result."""
    with h5py.File(path) as file:
        view, count = file["VTKHDF"], len(scene.points)
        ids = view["PointData/node_id"][:count] - 1
        finished = int(file["history"].attrs["finished"])

        def field(name):
            starts = view["Steps/PointDataOffsets"][name][:finished]
            out = np.zeros((finished, count, 3))
            out[:, ids] = [view["PointData"][name][s : s + count] for s in starts]
            return out

        u, support = field("displacement"), field("reaction_force")
        pressed = field("contact_force")
        (group,) = file["contact"].values()
        rows = ids[group["node"][:]]
        frame, reaction = group["frame"][:], group["reaction"][:finished]
        area = group["area"][:]
        told_gap, told_slip = group["gap"][:finished], group["slip_increment"][:finished]
    frame = np.broadcast_to(frame, (finished, *frame.shape[1:]))
    findings = []

    def note(row, kind, found, scale):
        if not found <= ALLOWED * scale:
            findings.append((row + 1, kind, float(found / (ALLOWED * scale))))

    if not np.array_equal(np.sort(rows), scene.foot):
        return [(0, "points are not the nodes of the foot", np.inf)]
    own = scene.areas()[rows]
    note(-1, "areas", np.abs(area - own).max(), own.max())
    before = np.zeros((count, 3))
    held = np.zeros(count, dtype=bool)
    held[scene.top] = True
    steps = len(scene.ways) * scene.parts
    if finished != steps:
        return [(finished, "increments are missing", np.inf)]
    for k in range(finished):
        step, share = k // scene.parts, (k % scene.parts + 1) / scene.parts
        start = scene.ways[step - 1] if step else np.zeros(3)
        way = start + share * (scene.ways[step] - start)
        length = np.abs(u[k]).max()
        note(k, "support", np.abs(u[k][scene.top] - way).max(), length)
        gap, normal = scene.gaps_and_normals(scene.points + u[k])
        free, _ = scene.gaps_and_normals(scene.points + way)
        moved = u[k] - before
        force = np.einsum("pk,pki->pi", reaction[k], frame[k])
        largest = max(np.linalg.norm(force, axis=1).max(), np.abs(support[k]).max())
        # A body that nothing presses goes along with its supports: its forces are rounding.
        largest = max(largest, scene.rounding(u[k]) / ALLOWED)
        nodal, own_gap = np.zeros((count, 3)), np.zeros(len(rows))
        own_way = np.zeros((len(rows), 3))
        for p, r in enumerate(rows):
            alpha = scene.alpha.get(int(r), 0.0)
            ends = list(scene.middles.get(int(r), ()))
            if alpha:
                # Without contact the body goes along with its supports: where neither end would be
                # inside the obstacle then, they have no part in the point.
                least = free[ends].min()
                alone = least > 0
                if abs(least) < 1e-9 * length:
                    both = (gap[r] - alpha * gap[ends].sum()) / (1 - 2 * alpha)
                    alone = abs(told_gap[k, p] - gap[r]) < abs(told_gap[k, p] - both)
                alpha = 0.0 if alone else alpha
            share = 1 / (1 - 2 * alpha)
            nodal[r] += share * force[p]
            own_gap[p], own_way[p] = share * gap[r], share * moved[r]
            for e in ends if alpha else ():
                nodal[e] -= alpha * share * force[p]
                own_gap[p] -= alpha * share * gap[e]
                own_way[p] -= alpha * share * moved[e]
        note(k, "stored gap", np.abs(own_gap - told_gap[k]).max(), length)
        note(k, "normal", np.abs(normal[rows] - frame[k][:, 0]).max(), 1.0)
        slip = np.einsum("pki,pi->pk", frame[k][:, 1:], own_way)
        note(k, "stored slip", np.abs(slip - told_slip[k]).max(), length)
        note(k, "stored nodal force", np.abs(nodal - pressed[k]).max(), largest)
        left = scene.internal_force(u[k]) - nodal
        note(k, "equilibrium", np.abs(left[~held]).max(), largest)
        note(k, "support force", np.abs(left - support[k])[held].max(), largest)
        press, size = reaction[k][:, 0], np.linalg.norm(reaction[k][:, 1:], axis=1)
        note(k, "penetration", max(0.0, -own_gap.min()), length)
        note(k, "adhesion", max(0.0, -press.min()), largest)
        note(k, "complementarity", np.abs(own_gap * press).max(), largest * length)
        note(k, "cone", max(0.0, (size - scene.mu * press).max()), largest)
        law = scene.mu * press * np.linalg.norm(slip, axis=1)
        law = law + np.einsum("pk,pk->p", reaction[k][:, 1:], slip)
        note(k, "friction law", np.abs(law).max(), largest * length)
        before = u[k]
    return findings


def judge_seed(seed, options):
    """(outcome, words) of a seed."""
    scene = Scene(seed)
    with tempfile.TemporaryDirectory(dir=options.keep) as folder:
        deck = Path(folder) / f"mixed-{seed}.inp"
        deck.write_text(scene.deck())
        done = subprocess.run(
            [options.program, deck.name, "--quiet"], cwd=folder, capture_output=True, text=True,
            timeout=options.limit, check=False, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        if done.returncode != 0:
            outcome = "refused" if done.returncode == 2 else "broken"
            return scene, outcome, f"{done.returncode}: {done.stderr.strip()[:300]}"
        findings = judge(scene, deck.with_suffix(".vtkhdf"))
    if not findings:
        return scene, "right", ""
    kinds = Counter(kind for _, kind, _ in findings)
    return scene, "wrong", f"{findings[0]}, all: {dict(kinds)}"


def main():
    """Judge decks, print what failed and a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--decks", type=int, default=60, help="how many")
    parser.add_argument("--seed", type=int, default=os.environ.get("BIPOT_SEED", "1"),
                        help="of the first deck; default: BIPOT_SEED, or 1")  # fmt: skip
    parser.add_argument("--only", type=int, nargs="+", help="seeds of single decks")
    parser.add_argument("--keep", type=Path, help="where decks are run")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds that a run may take")
    parser.add_argument("--bipot", dest="program",
                        default=os.environ.get("BIPOT", str(ROOT / "build" / "bipot")))  # fmt: skip
    options = parser.parse_args()
    counts = Counter()
    for seed in options.only or range(options.seed, options.seed + options.decks):
        scene, outcome, words = judge_seed(seed, options)
        counts[outcome] += 1
        if outcome != "right":
            print(f"{seed} ({' and '.join(scene.types)}, {'sphere' if scene.ball else 'plane'}, "
                  f"mu {scene.mu:g}): {outcome}: {words}", flush=True)  # fmt: skip
    print(dict(counts))
    return int(any(counts[o] for o in ("wrong", "broken")))


if __name__ == "__main__":
    sys.exit(main())
