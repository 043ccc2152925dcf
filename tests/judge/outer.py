#!/usr/bin/env python3
"""Random decks of two bodies whose surfaces are all their outer faces, judged by their distance.

    tests/judge/outer.py --decks 60 --seed 1 [--only SEED ...] [--general]

Bodies are boxes, plates, bars, angles and channels of C3D8, C3D20 or C3D20R, turned at random; one
is moved along a line until it is a given way from the other, also into its hollows. Families, the
seeds in turn:

    apart    comes closer by a part of that way: no force, however the faces lie
    meet     comes closer by more: no run ends well without a force where the bodies overlap
    stack    flat on the other, offset, thin or thick: forces are those of the twin of which the
             surfaces are the two faces that touch; within a tenth, or a twentieth once both are
             refined, once or twice, where the slave's reaches over the master's edge, as (11.32)
             then counts for its nodes at edges, and not for the twin

With --general the decks have general contact in place of the pair; roles are what it chooses, and
the twins have these.

Distances are those of the convex elements of both, by non-negative least squares; nothing is taken
from the program. A deck is right, wrong, refused or broken; only decks that meet may be refused
with exit status 2, as edges that cross between nodes are not felt there.
Exit status 1 where any deck is not right.
"""

import argparse
import copy
import os
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from itertools import product
from pathlib import Path

import h5py
import numpy as np
from scipy.optimize import nnls

ROOT = Path(__file__).resolve().parents[2]
FAMILIES = ("apart", "meet", "stack")
TWIN, OVERHANGING_TWIN, REFINED_TWIN = 1e-6, 0.1, 0.05  # of the force
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                    (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])  # fmt: skip
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
         (0, 4), (1, 5), (2, 6), (3, 7))  # fmt: skip
SHAPES = {  # cells, and the sizes of one
    "box": ([(0, 0, 0)], (1, 1, 1)),
    "plate": (list(product((0, 1), (0, 1), (0,))), (0.6, 0.5, 0.03)),
    "bar": ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], (0.6, 0.3, 0.3)),
    "angle": ([(0, 0, 0), (1, 0, 0), (0, 0, 1)], (0.5, 0.6, 0.5)),
    "channel": ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 1), (2, 0, 1)], (0.5, 0.5, 0.5)),
    "block": (list(product((0, 1), (0, 1), (0, 1))), (0.5, 0.5, 0.5)),
}


class Body:
    """Elements on a grid, of which nodes are numbered from `first`."""

    def __init__(self, name, first, shape, kind, scale=1.0):
        self.name, self.first, self.kind = name, first, kind
        cells, size = SHAPES[shape]
        number, self.elements = {}, []
        for cell in cells:
            corners = 2 * (np.array(cell) + CORNERS)
            places = list(corners)
            if kind != "C3D8":
                places += [(corners[a] + corners[b]) // 2 for a, b in EDGES]
            self.elements.append([number.setdefault(tuple(p), len(number)) for p in places])
        self.x = np.array(list(number)) / 2 * np.array(size) * scale
        self.x -= self.x.mean(axis=0)
        self.low, self.top = (
            np.flatnonzero(self.x[:, 2] == end) for end in (self.x[:, 2].min(), self.x[:, 2].max())
        )
        self.faces = self.name

    def hulls(self):
        """The corners of each element."""
        return [self.x[e[:8]] for e in self.elements]

    def cards(self):
        lines = [f"*NODE, NSET={self.name}"]
        lines += [f"{self.first + i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in
                  enumerate(self.x.tolist())]  # fmt: skip
        lines.append(f"*ELEMENT, TYPE={self.kind}, ELSET={self.name}")
        for e, nodes in enumerate(self.elements):
            numbers = [str(self.first + i) for i in nodes]
            lines.append(", ".join([str(self.first + e), *numbers[:10]]) + "," * (len(nodes) > 10))
            if len(nodes) > 10:
                lines.append(", ".join(numbers[10:]))
        lines.append(f"*SOLID SECTION, ELSET={self.name}, MATERIAL=M")
        for end, rows in (("LOW", self.low), ("TOP", self.top)):
            lines.append(f"*NSET, NSET={self.name}{end}")
            lines += [str(self.first + i) for i in rows]
        return "\n".join([*lines, f"*SURFACE, NAME=S{self.name}", self.faces, ""])


def distance(one, other):
    """The distance of two convex hulls of points (n, 3), (m, 3)."""
    size = max(np.ptp(one), np.ptp(other))
    heavy = 1e3 * size
    rows = np.vstack([np.hstack([one.T, -other.T]),
                      np.repeat([heavy, 0.0], (len(one), len(other))),
                      np.repeat([0.0, heavy], (len(one), len(other)))])  # fmt: skip
    weight, _ = nnls(rows, np.array([0.0, 0.0, 0.0, heavy, heavy]))
    a, b = weight[: len(one)], weight[len(one) :]
    return float(np.linalg.norm(a @ one / a.sum() - b @ other / b.sum()))


class Scene:
    """What a seed makes."""

    def __init__(self, seed, general=False):
        self.general = general
        self.seed, self.family = seed, FAMILIES[seed % len(FAMILIES)]
        self.rng = rng = np.random.default_rng([20268, seed])
        kinds = rng.choice(["C3D8", "C3D8", "C3D20", "C3D20R"], size=2)
        shapes = rng.choice(list(SHAPES), size=2)
        if self.family == "stack":
            shapes = rng.choice(["box", "plate", "bar", "block"], size=2)
        self.fixed = Body("B", 1, shapes[0], kinds[0])
        self.moved = Body("A", 1001, shapes[1], kinds[1], rng.uniform(0.5, 1.2))
        self.mu, self.large = float(rng.choice([0.0, 0.2])), bool(rng.random() < 0.5)
        self.words = f"{shapes[1]} of {kinds[1]} on {shapes[0]} of {kinds[0]}"
        self.moved_is_slave = bool(rng.random() < 0.5)
        if self.family == "stack":
            self.put_on_top()
        else:
            self.bring_near()

    def put_on_top(self):
        rng, low, high = self.rng, self.fixed, self.moved
        if rng.random() < 0.5:
            high.x *= (1, 1, rng.choice([0.01, 0.1]))
        self.way = np.array([0.0, 0.0, -0.01 * min(np.ptp(b.x[:, 2]) for b in (low, high))])
        high.x += rng.uniform(-0.4, 0.4, 3) * np.ptp(low.x, axis=0)
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min()

    def bring_near(self):
        rng = self.rng
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        turn *= np.sign(np.linalg.det(turn))
        if rng.random() < 0.25:  # along the axes, but for a corner
            turn = turn if rng.random() < 0.5 else np.eye(3)
        self.moved.x = self.moved.x @ turn.T
        line = rng.normal(size=3)
        line /= np.linalg.norm(line)
        self.apart = float(10 ** rng.uniform(-3, -1))
        self.moved.x += 5 * line + rng.uniform(-0.3, 0.3, 3)
        for _ in range(500):
            left = self.distance() - self.apart
            if left < 1e-9:
                break
            self.moved.x -= max(left, 1e-9) * line
            if np.dot(self.moved.x.mean(axis=0), line) < -5:
                break
        self.way = -line * self.apart * (0.5 if self.family == "apart" else 1.5)

    def distance(self, way=0.0):
        return min(distance(a + way, b) for a in self.moved.hulls() for b in self.fixed.hulls())

    def overhangs(self):
        """Whether the slave of a stack reaches over an edge of its master."""
        slave, master = self.moved.x[:, :2], self.fixed.x[:, :2]
        if not self.moved_is_slave:
            slave, master = master, slave
        return np.any(slave.min(0) < master.min(0)) or np.any(slave.max(0) > master.max(0))

    def deck(self):
        """One end of the moved body goes along its way, the low end of the other is held."""
        a, b = ("A", "B") if self.moved_is_slave else ("B", "A")
        lines = [f"*HEADING\n{self.family} {self.seed}: {self.words}",
                 self.fixed.cards() + self.moved.cards() + "*MATERIAL, NAME=M\n*ELASTIC",
                 "1000., 0.3\n*SURFACE INTERACTION, NAME=I"]  # fmt: skip
        lines += [f"*FRICTION\n{self.mu!r}"] * (self.mu > 0)
        pair = f"*CONTACT PAIR, INTERACTION=I\nS{a}, S{b}"
        if self.general:
            pair = ("*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n"
                    "*CONTACT PROPERTY ASSIGNMENT\n, , I")
        lines += [
            pair,
            "*STEP" + ", NLGEOM" * self.large,
            "*STATIC\n0.5, 1.",
            "*BOUNDARY\nBLOW, 1, 3",
        ]
        lines += [f"ATOP, {k}, {k}, {w!r}" for k, w in enumerate(self.way.tolist(), 1)]
        return "\n".join([*lines, "*END STEP", ""])


def run(scene, folder, name, options, *words):
    """(exit status, message, force on the slave or None)."""
    deck = Path(folder) / f"{name}.inp"
    deck.write_text(scene.deck())
    done = subprocess.run(
        [options.program, deck.name, *words], cwd=folder, capture_output=True, text=True,
        check=False, timeout=20 * options.limit, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_CPU, (int(options.limit), int(options.limit) + 1)),
    )  # fmt: skip
    force = None
    if done.returncode == 0:
        with h5py.File(deck.with_suffix(".vtkhdf")) as file:
            force = np.zeros(3)  # what can never touch makes no pair
            for pair in file.get("contact", {}):
                if len({*pair.split(":")}) == 1:
                    continue  # a body with itself
                force = file["contact"][pair]["resultant"][-1]
                scene.moved_is_slave = pair.startswith(("A", "SA"))
    return done.returncode, (done.stderr or done.stdout).strip()[-300:], force


def judge_seed(seed, options):
    """(scene, outcome, words) of a seed."""
    scene = Scene(seed, options.general)
    with tempfile.TemporaryDirectory(dir=options.keep) as folder:
        status, words, force = run(scene, folder, f"outer-{seed}", options)
        if status not in (0, 1, 2):
            return scene, "broken", f"{status}: {words}"
        if scene.family == "apart":
            if status:
                return scene, "refused", words
            right = not np.any(force)
            return scene, "right" if right else "wrong", f"pressed by {force} though apart"
        if scene.family == "meet":
            if status == 2:
                return scene, "right", ""
            if status:
                return scene, "refused", words
            right = np.any(force) or scene.distance(scene.way) > 1e-9
            return scene, "right" if right else "wrong", "enters the other without a force"
        if status:
            return scene, "refused", words
        twin = as_twin(scene)
        _, words, wanted = run(twin, folder, f"outer-{seed}-twin", options)
        if wanted is None:
            return scene, "broken", f"twin: {words}"
        allowed = OVERHANGING_TWIN if scene.overhangs() else TWIN
        close = are_close(force, wanted, allowed)
        for level in ("1", "2") if scene.overhangs() else ():
            if not close:
                fine = [run(s, folder, f"outer-{seed}-fine", options, "--refine", level,
                            "--overwrite")[2] for s in (scene, twin)]  # fmt: skip
                close = all(f is not None for f in fine) and are_close(*fine, REFINED_TWIN)
        return scene, "right" if close else "wrong", f"{force}, its twin {wanted}"


def are_close(force, wanted, allowed):
    """Whether two forces are, beside the largest component of the second."""
    return np.abs(force - wanted).max() <= allowed * np.abs(wanted).max()


def as_twin(scene):
    """The scene with the two faces that touch as surfaces."""
    twin = copy.deepcopy(scene)
    twin.general = False
    for body, rows in ((twin.moved, "bottom"), (twin.fixed, "top")):
        body.faces = facing(body, rows)
    return twin


def facing(body, which):
    """The lines of a surface of the elements' faces at an end of a body."""
    z = body.x[:, 2]
    end, face = (z.min(), [0, 1, 2, 3]) if which == "bottom" else (z.max(), [4, 5, 6, 7])
    lines = []
    for e, nodes in enumerate(body.elements):
        if np.all(np.abs(z[[nodes[k] for k in face]] - end) < 1e-12):
            lines.append(f"{body.first + e}, S{1 if which == 'bottom' else 2}")
    return "\n".join(lines)


def main():
    """Judge decks, print what failed and a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--decks", type=int, default=60, help="how many")
    parser.add_argument("--seed", type=int, default=os.environ.get("BIPOT_SEED", "1"),
                        help="of the first deck; default: BIPOT_SEED, or 1")  # fmt: skip
    parser.add_argument("--only", type=int, nargs="+", help="seeds of single decks")
    parser.add_argument("--general", action="store_true", help="general contact, no pairs")
    parser.add_argument("--keep", type=Path, help="where decks are run")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of the processor")
    parser.add_argument("--bipot", dest="program",
                        default=os.environ.get("BIPOT", str(ROOT / "build" / "bipot")))  # fmt: skip
    options = parser.parse_args()
    counts = Counter()
    for seed in options.only or range(options.seed, options.seed + options.decks):
        scene, outcome, words = judge_seed(seed, options)
        counts[outcome] += 1
        if outcome != "right":
            print(f"{scene.family} {seed} ({scene.words}): {outcome}: {words}", flush=True)
    print(dict(counts))
    return int(any(outcome != "right" for outcome in counts))


if __name__ == "__main__":
    sys.exit(main())
