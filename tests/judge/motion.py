#!/usr/bin/env python3
"""Run the program on random dynamic decks and judge its histories by an inertia of its own.

    tests/judge/motion.py --decks 100 --seed 1 [--only SEED ...]

A box of distorted bricks before a plane is thrown, turned and pulled by its weight, or driven at
its top; loads jump, and steps follow each other. The judge marches through the same increments with
its own mass, accelerations and contact, and compares forces, energies, places and velocities. A run
that ends because energy was given is confirmed where the judge finds that gain.
"""

import argparse
import math
import os
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded

import numpy as np
from elements import CORNERS, Elements, inverse_and_determinant, parent_gradients, shape_functions

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT)]
from bipot.result import Result  # noqa: E402  (found through the line above)

CLOSE = 1e-6  # of the largest force, energy, place or velocity
MOST_GIVEN = 0.03  # of the largest energy, as the program's manual says


@dataclass
class Scene:
    """A deck: a box, how it begins, and what its steps do."""

    seed: int
    steps: list = field(default_factory=list)  # (increments, weight (3,), begins anew)
    jump: tuple = ()  # increment of the first step behind which `pulled` acts, and that

    def __post_init__(self):
        """Draw it."""
        rng = np.random.default_rng([20271, self.seed])
        self.n = rng.integers(1, 4, 3) + np.array([0, 0, 1])
        self.size = rng.choice([0.5, 1.0, 2.0], 3)
        grids = [np.linspace(0.0, s, k + 1) for s, k in zip(self.size, self.n, strict=True)]
        z, y, x = np.meshgrid(*grids[::-1], indexing="ij")
        self.points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
        self.base = np.flatnonzero(self.points[:, 2] == 0.0)
        self.top = np.flatnonzero(self.points[:, 2] == self.size[2])
        if rng.random() < 0.6:
            shift = rng.uniform(-0.15, 0.15, self.points.shape) * (self.size / self.n)
            shift[np.r_[self.base, self.top], 2] = 0.0
            self.points += shift
        i, j, k = (a.ravel() for a in np.meshgrid(*map(range, self.n), indexing="ij"))
        nx, ny = self.n[0] + 1, self.n[1] + 1
        corners = (np.asarray(CORNERS, dtype=float) > 0).astype(int)
        self.bricks = np.stack(
            [(i + a) + nx * ((j + b) + ny * (k + c)) for a, b, c in corners], axis=1
        )
        self.young, self.poisson = 10 ** rng.uniform(2, 4), rng.choice([0.0, 0.2, 0.3, 0.45])
        self.density, self.mu = rng.choice([0.3, 1.0, 5.0]), rng.choice([0.0, 0.1, 0.3, 0.8])
        self.alpha = rng.choice([0.0, -0.05, -0.1, -0.3])
        speed = math.sqrt(self.young / self.density)
        self.dt = rng.uniform(0.3, 1.5) * min(self.size / self.n) / speed
        self.gap = rng.choice([0.0, rng.uniform(0.0, 0.02) * min(self.size)])
        self.weight = np.array([*rng.uniform(-1, 1, 2), -rng.uniform(0.0, 2.0)])
        self.weight *= 0.003 * speed**2 / self.size[2]
        n = int(rng.integers(15, 35))
        self.steps = [(n, self.weight, True)]
        self.velocity = np.zeros_like(self.points)
        self.driven = rng.random() < 0.35
        self.table = [(0.0, 0.0)]
        if self.driven:
            self.way = rng.uniform(-0.02, 0.02, 3) * self.size
            self.way[2] = -rng.uniform(0.002, 0.01) * self.size[2] - self.gap
            rate = rng.uniform(0.1, 0.4) * speed / self.size[2]
            self.table = [(t, math.sin(rate * t)) for t in self.dt * np.arange(n + 1)]
        else:
            middle = self.points.mean(axis=0)
            turn = np.cross(rng.uniform(-0.01, 0.01, 3) * speed, (self.points - middle))
            self.velocity += rng.uniform(-0.01, 0.01, 3) * speed + turn / max(self.size)
            self.velocity[:, 2] -= rng.uniform(0.0, 0.02) * speed
            if rng.random() < 0.4:
                at = int(rng.integers(3, n - 5))
                self.jump = (at, rng.uniform(-1, 1, 3) * 0.005 * speed**2 / self.size[2])
            elif rng.random() < 0.5:
                again = rng.random() < 0.5
                self.steps.append((8, self.weight * (1.0 if again else 1.7), not again))

    def deck(self):
        """The deck as a text."""
        text = "*NODE, NSET=ALL\n"
        text += "".join(f"{i + 1}, {x!r}, {y!r}, {z!r}\n"
                        for i, (x, y, z) in enumerate(self.points.tolist()))  # fmt: skip
        text += "*ELEMENT, TYPE=C3D8, ELSET=B\n"
        text += "".join(f"{e + 1}, " + ", ".join(map(str, row + 1)) + "\n"
                        for e, row in enumerate(self.bricks))  # fmt: skip
        for name, nodes in (("BASE", self.base), ("TOP", self.top)):
            text += f"*NSET, NSET={name}\n" + "".join(f"{i + 1}\n" for i in nodes)
        text += (
            "*SOLID SECTION, ELSET=B, MATERIAL=M\n*MATERIAL, NAME=M\n*ELASTIC\n"
            f"{self.young!r}, {float(self.poisson)!r}\n*DENSITY\n{float(self.density)!r}\n"
            "*SURFACE, NAME=S, TYPE=NODE\nBASE\n"
            f"*OBSTACLE, NAME=WALL, TYPE=PLANE\n0., 0., {-float(self.gap)!r}, 0., 0., 1.\n"
            f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n{float(self.mu)!r}\n"
            "*CONTACT PAIR, INTERACTION=I\nS, WALL\n*CONTACT SOLVER, TOLERANCE=1e-11\n"
        )
        if self.velocity.any():
            text += "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
                f"{i + 1}, {k + 1}, {v!r}\n"
                for i, row in enumerate(self.velocity.tolist())
                for k, v in enumerate(row)
            )
        if self.driven:
            text += "*AMPLITUDE, NAME=A\n" + "".join(f"{t!r}, {v!r}\n" for t, v in self.table)
        if self.jump:
            at = self.jump[0] * self.dt
            end = self.steps[0][0] * self.dt
            text += f"*AMPLITUDE, NAME=J\n0., 0., {at!r}, 0.\n"
            text += f"{at * (1 + 1e-9)!r}, 1., {end!r}, 1.\n"
        for s, (n, weight, _) in enumerate(self.steps):
            text += f"*STEP\n*DYNAMIC, DIRECT, ALPHA={float(self.alpha)!r}\n"
            text += f"{self.dt!r}, {self.dt * n!r}\n"
            text += gravity(weight, "")
            if self.jump and s == 0:
                text += gravity(self.jump[1], ", AMPLITUDE=J")
            if self.driven:
                text += "*BOUNDARY, AMPLITUDE=A\n" + "".join(
                    f"TOP, {k + 1}, {k + 1}, {w!r}\n" for k, w in enumerate(self.way.tolist())
                )
            text += "*END STEP\n"
        return text


def gravity(weight, option):
    """The card of an acceleration."""
    size = float(np.linalg.norm(weight))
    return f"*DLOAD{option}\nB, GRAV, {size!r}, " + ", ".join(map(repr, (weight / size).tolist())) \
        + "\n"


def masses(scene):
    """(consistent, without mass at the base), (N, N) each."""
    n = len(scene.points)
    whole, kept = np.zeros((n, n)), np.zeros((n, n))
    at, by = np.polynomial.legendre.leggauss(4)
    for row in scene.bricks:
        x = scene.points[row].astype(np.longdouble)
        m = np.zeros((8, 8))
        for a, p in zip(by, at, strict=True):
            for b, q in zip(by, at, strict=True):
                for c, r in zip(by, at, strict=True):
                    xi = np.array([p, q, r], dtype=np.longdouble)
                    f = shape_functions(xi)
                    _, size = inverse_and_determinant((x.T @ parent_gradients(xi))[None])
                    m += scene.density * a * b * c * float(size[0]) * np.outer(f, f).astype(float)
        whole[np.ix_(row, row)] += m
        touches = np.isin(row, scene.base)
        if not touches.any():
            kept[np.ix_(row, row)] += m
            continue
        lumps = np.diag(m) * m.sum() / np.trace(m)
        for i in range(8):
            to = [i]
            if touches[i]:
                edges = (CORNERS[i] != CORNERS).sum(axis=1)
                to = np.flatnonzero(~touches & (edges == 1))
                if len(to) == 0:
                    to = np.flatnonzero(~touches)
            kept[row[to], row[to]] += lumps[i] / len(to)
    return whole, kept


def repaired(scene):
    """The mass (3N, 3N) with the inertia of the whole body."""
    whole, kept = (np.kron(m, np.eye(3)) for m in masses(scene))
    arm = scene.points - scene.points.mean(axis=0)
    rigid = np.hstack(
        [np.tile(np.eye(3), (len(arm), 1))]
        + [np.cross(e, arm).reshape(-1, 1) for e in np.eye(3)]
    )
    inertia, true = (rigid.T @ m @ rigid for m in (kept, whole))
    shape = np.linalg.solve(inertia, (kept @ rigid).T).T
    return kept + shape @ (true - inertia) @ shape.T


class March:
    """The judge's own history: rows of forces (3) and energies, and where it ends.

    HHT-alpha, divided by 1 + alpha.
    """

    def __init__(self, scene):
        self.scene = scene
        n = 3 * len(scene.points)
        kind = ["C3D8"] * len(scene.bricks)
        bulk = np.full(len(scene.bricks), 1.0)
        self.k = Elements(scene.points, scene.bricks, kind, bulk * scene.young,
                          bulk * scene.poisson).stiffness()  # fmt: skip
        self.m = repaired(scene)
        self.beta, self.gamma = (1 - scene.alpha) ** 2 / 4, 0.5 - scene.alpha
        dofs = (3 * scene.base[:, None] + (2, 0, 1)).ravel()
        self.held = np.zeros(n, dtype=bool)
        if scene.driven:
            self.held[(3 * scene.top[:, None] + np.arange(3)).ravel()] = True
        self.heavy = ~self.held
        self.heavy[dofs] = False
        free = np.flatnonzero(~self.held)
        c = 1 + scene.alpha
        self.matrix = self.k + self.m / (c * self.beta * scene.dt**2)
        self.inverse = np.zeros((n, n))
        self.inverse[np.ix_(free, free)] = np.linalg.inv(self.matrix[np.ix_(free, free)])
        self.dofs = dofs
        self.w = self.inverse[np.ix_(dofs, dofs)]
        self.rate = 1.0 / np.linalg.eigvalsh(self.w)[-1]
        self.rows, self.given_at = [], None
        self.march()

    def accelerations(self, force):
        """What forces make of free nodes with mass."""
        a = np.zeros_like(force)
        on = np.flatnonzero(self.heavy)
        a[on] = np.linalg.solve(self.m[np.ix_(on, on)], force[on])
        return a

    def touch(self, free, r):
        """Reactions (3 a point: normal, two tangents) where `free` is gap and slip without them."""
        mu = self.scene.mu
        for _ in range(200000):
            x = self.w @ r + free
            step = (r - self.rate * x).reshape(-1, 3)
            step[:, 0] -= self.rate * mu * np.hypot(*x.reshape(-1, 3)[:, 1:].T)
            sliding = np.hypot(*step[:, 1:].T)
            normal = np.maximum(0.0, (step[:, 0] + mu * sliding) / (1 + mu * mu))
            inside = sliding <= mu * step[:, 0]
            new = np.zeros_like(step)
            part = mu * normal / np.maximum(sliding, 1e-300)
            new[:, 0] = np.where(inside, step[:, 0], normal)
            new[:, 1:] = np.where(inside[:, None], step[:, 1:], part[:, None] * step[:, 1:])
            new = new.ravel()
            done = np.abs(new - r).max() <= 1e-14 * max(np.abs(new).max(), 1e-30)
            r = new
            if done:
                break
        return r

    def of_supports(self):
        """The kinetic energy of the body as fast as its supports get."""
        if not self.scene.driven:
            return 0.0
        places = np.array([place for _, place in self.scene.table])
        speed = np.linalg.norm(self.scene.way) * np.abs(np.diff(places)).max() / self.scene.dt
        mass = np.resize([1.0, 0.0, 0.0], len(self.held))
        return 0.5 * speed**2 * mass @ self.m @ mass

    def march(self):
        """All increments."""
        scene, dt, alpha, c = self.scene, self.scene.dt, self.scene.alpha, 1 + self.scene.alpha
        n = len(self.held)
        u, v, a, g0 = np.zeros(n), scene.velocity.ravel().copy(), np.zeros(n), np.zeros(n)
        r, support = np.zeros(len(self.dofs)), np.zeros(n)
        work = lost = pressed = least = 0.0
        largest, begun, done = 0.0, 0.0, 0
        whole = scene.points.size
        for s, (count, weight, anew) in enumerate(scene.steps):
            for i in range(count):
                load = self.m @ np.resize(weight, whole)
                if scene.jump and s == 0 and i >= scene.jump[0]:
                    load = load + self.m @ np.resize(scene.jump[1], whole)
                end = np.zeros(n)
                if scene.driven:
                    end[self.held] = np.resize(scene.way * scene.table[done + 1][1],
                                               self.held.sum())
                starts = (i == 0 and anew) or (scene.jump and s == 0 and i == scene.jump[0])
                if starts:
                    if done == 0 and scene.driven:
                        change = np.where(self.held, end / dt, 0.0)
                        v = np.where(self.held, change, v)
                        v = v + self.accelerations(-self.m @ change)
                    if done == 0:
                        begun = 0.5 * v @ self.m @ v
                        largest = max(begun, self.of_supports())
                    pull = self.k @ u - load
                    pull[self.dofs] -= r
                    g0 = np.where(self.heavy, pull, 0.0)
                    a = self.accelerations(-g0)
                    support = np.where(self.held, pull + self.m @ a, 0.0)
                    g0 = np.where(self.held, -self.m @ a, g0)
                p = u + dt * v + dt * dt * (0.5 - self.beta) * a
                p[self.held] = (end - self.beta * (end - u - dt * v))[self.held]
                inertia = self.m @ p / (c * self.beta * dt * dt)
                right = load + inertia + alpha / c * g0
                new = np.where(self.held, end, 0.0)
                new = new + self.inverse @ (right - self.matrix @ new)
                at = new[self.dofs].reshape(-1, 3).copy()
                at[:, 0] += scene.gap + scene.points[scene.base, 2]
                at[:, 1:] -= u[self.dofs].reshape(-1, 3)[:, 1:]
                r1 = self.touch(at.ravel(), r)
                new = new + self.inverse[:, self.dofs] @ r1
                a1 = (new - p) / (self.beta * dt * dt)
                a1[self.dofs] = 0.0
                v1 = v + dt * ((1 - self.gamma) * a + self.gamma * a1)
                v1 = np.where(self.heavy, v1, (new - u) / dt)
                g1 = self.k @ new - load
                g1[self.dofs] -= r1
                answer = self.m @ a1
                support1 = np.where(self.held, (answer - alpha * g0) / c + g1, 0.0)
                g1 = np.where(self.held, (alpha * g0 - answer) / c, g1)
                way = new - u
                mean = 0.5 * (r + r1).reshape(-1, 3)
                moved = way[self.dofs].reshape(-1, 3)
                lost -= (mean[:, 1:] * moved[:, 1:]).sum()
                pressed += mean[:, 0] @ moved[:, 0]
                work += load @ way + 0.5 * (support + support1) @ way
                u, v, a, g0, r, support = new, v1, a1, g1, r1, support1
                done += 1
                kinetic, strain = 0.5 * v @ self.m @ v, 0.5 * u @ self.k @ u
                total = r.reshape(-1, 3).sum(axis=0)
                self.rows.append([*total[[1, 2, 0]], kinetic, strain, lost, work, pressed])
                given = kinetic + strain + lost - work - begun
                least = min(least, given)
                largest = max(largest, kinetic + strain, abs(lost) + abs(work))
                if self.given_at is None and given - least > MOST_GIVEN * largest:
                    self.given_at = done
        self.u, self.v = u.reshape(-1, 3), v.reshape(-1, 3)


NAMES = ("kinetic", "strain", "dissipation", "external_work", "contact")


def compare(march, path):
    """How far the histories of a result file are from the judge's, of the largest."""
    with Result(path) as result:
        forces = result.pairs[0].resultant
        found = np.column_stack([forces, *(result.history(f"energy/{x}") for x in NAMES)])
        u, v = result.field("displacement"), result.field("velocity")
    own = np.array(march.rows)[: len(found)]
    if len(found) < len(march.rows):
        return math.inf
    scale = np.abs(own).max(axis=0)
    scale[:3], scale[3:] = max(scale[:3].max(), 1e-30), max(scale[3:].max(), 1e-30)
    far = [np.abs((found - own) / scale).max()]
    far += [np.abs(x - y).max() / max(np.abs(y).max(), 1e-30)
            for x, y in ((u, march.u), (v, march.v))]  # fmt: skip
    return max(far)


def judge_seed(seed, options):
    """(scene, outcome, words) of a seed."""
    scene = Scene(seed)
    march = March(scene)
    with tempfile.TemporaryDirectory(dir=options.keep) as folder:
        deck = Path(folder) / f"motion-{seed}.inp"
        deck.write_text(scene.deck())
        done = subprocess.run([options.program, deck.name, "--quiet"], cwd=folder,
                              capture_output=True, text=True, timeout=120, check=False)  # fmt: skip
        if done.returncode == 2 and "have given the bodies" in done.stderr:
            told = f"increment {march.given_at}:"
            inside = march.given_at is not None and (told in done.stderr or len(scene.steps) > 1)
            return scene, "confirmed" if inside else "refuted", done.stderr.strip()[:200]
        if done.returncode != 0:
            return scene, "broken", f"{done.returncode}: {done.stderr.strip()[:300]}"
        far = compare(march, deck.with_suffix(".vtkhdf"))
    if march.given_at is not None:
        return scene, "wrong", f"energy was given in increment {march.given_at}"
    return scene, "right" if far <= CLOSE else "wrong", f"apart by {far:.1e}"


def main():
    """Judge decks, print what failed and a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--decks", type=int, default=100, help="how many")
    parser.add_argument("--seed", type=int, default=os.environ.get("BIPOT_SEED", "1"),
                        help="of the first deck; default: BIPOT_SEED, or 1")  # fmt: skip
    parser.add_argument("--only", type=int, nargs="+", help="seeds of single decks")
    parser.add_argument("--keep", type=Path, help="where decks are run")
    parser.add_argument("--bipot", dest="program",
                        default=os.environ.get("BIPOT", str(ROOT / "build" / "bipot")))  # fmt: skip
    options = parser.parse_args()
    counts = Counter()
    for seed in options.only or range(options.seed, options.seed + options.decks):
        scene, outcome, words = judge_seed(seed, options)
        counts[outcome] += 1
        if outcome not in ("right", "confirmed") or options.only:
            what = "driven" if scene.driven else "jump" if scene.jump else "free"
            print(f"{seed} ({what}, {len(scene.steps)} steps, mu {scene.mu:g}, alpha "
                  f"{scene.alpha:g}): {outcome}: {words}", flush=True)  # fmt: skip
    print(dict(counts))
    return int(any(outcome not in ("right", "confirmed") for outcome in counts))


if __name__ == "__main__":
    sys.exit(main())
