#!/usr/bin/env python3
"""Random decks of elements of second order, judged by formulas of its own.

    tests/judge/mixed.py --decks 60 --seed 1 [--family NAME ...] [--only SEED ...]

A box of C3D10, C3D15, C3D20 or C3D20R, or of two of these beside or above each other, distorted,
with mid-side nodes off the middle, is pressed and pushed along. Families:

    plain    onto a plane or a sphere
    loads    the same, under pressures, gravity and temperatures, with a foot that is curved in half
             of the decks: its mid-side nodes are on the curve
    tied     the same of two boxes that are tied, whose meshes do not match
    bodies   onto another box, whose mesh does not match, with small or finite sliding and loads

Shape functions come from the monomials that the types are defined by; stiffness, loads, gaps,
slips, weights of faces (11.21), (11.22) and nodal forces of the points (9.11) from them; nothing is
taken from the program.
A deck is right, wrong (certified, and not so), refused or broken. Nothing confirms a refusal: where
a solution of the judge's own exists it is "refused, solvable", else "refused, unconfirmed".
Exit status 1 where any deck is not right.

It does not know surfaces of bodies that are curved in the mesh, or their ties, supports at nodes
that may touch, bodies that are free, obstacles that move, C3D20R with 14 points, linear types
beside second order, finite strain, nor how a load that is prescribed jumps. With finite sliding
weights are those of its own cuts and quadrature, so that places and forces are judged to 1e-6.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
from mixed_scenes import FAMILIES, Scene, slave_points
from mixed_solver import solve_increment

ROOT = Path(__file__).resolve().parents[2]
ALLOWED = 2e-7  # twice what a certified increment may be off, of the largest force or motion
ROUGH = 1e-6  # where faces that have deformed are integrated over: 3e-9 in 24 decks
AREA = 1e-5  # of areas of curved faces: 2e-7 in 24 decks


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
        cover = group["covered_area"][:finished] if scene.master else None
        told_gap, told_slip = group["gap"][:finished], group["slip_increment"][:finished]
    frame = np.broadcast_to(frame, (finished, *frame.shape[1:]))
    findings = []
    between = scene.master is not None
    # The program's quadrature in faces that have deformed, or are curved, is not the judge's.
    rough = ROUGH if between and not scene.small else ALLOWED

    def note(row, kind, found, scale, allowed=ALLOWED):
        if not found <= allowed * scale:
            findings.append((row + 1, kind, float(found / (allowed * scale))))

    if not np.array_equal(np.sort(rows), scene.foot):
        return [(0, "points are not the nodes of the foot", np.inf)]
    own = scene.areas()[rows]
    tie = scene.tied() if scene.tie else None
    start = in_mesh(scene, rows) if between else None
    bent = AREA if scene.is_curved else ALLOWED
    note(-1, "areas", np.abs(area - own).max(), own.max(), bent)
    on = np.ones(len(rows), dtype=bool)
    before = np.zeros((count, 3))
    held = np.zeros(count, dtype=bool)
    held[scene.top] = held[scene.rest] = True
    steps = len(scene.ways) * scene.parts
    if finished != steps:
        return [(finished, "increments are missing", np.inf)]
    for k in range(finished):
        way, loads = scene.at(scene.ways, k), scene.loads(k)
        length = np.abs(u[k]).max()
        note(k, "support", np.abs(u[k][scene.top] - way).max(), length)
        note(k, "rest", np.abs(u[k][scene.rest]).max(initial=0.0), length)
        force = np.einsum("pk,pki->pi", reaction[k], frame[k])
        largest = max(np.linalg.norm(force, axis=1).max(), np.abs(support[k]).max())
        # A body that nothing presses goes along with its supports: its forces are rounding.
        largest = max(largest, scene.rounding(u[k]) / ALLOWED)
        inner = scene.internal_force(u[k], k)
        largest = max(largest, np.abs(loads).max(), heat(scene, k) * 1e-3)
        if between:
            seen = in_mesh(scene, rows, u[k], start)
            combination, normal, own_cover, whole, _, enough = seen
            own_gap = gaps_at(scene, seen, u[k])
            on, share = cover[k] > 0, own_cover / whole
            note(k, "covered area", np.abs(own_cover - cover[k])[on].max(), own.max(), ROUGH)
            # What a node had while an increment was placed it keeps down to a fifth.
            least = enough * (0.95 if scene.small else 0.19)
            note(k, "rows", float(np.any(share[on] < least[on])
                                  or np.any(share[~on] > 1.05 * enough[~on])), 1.0)  # fmt: skip
        else:
            combination, own_gap, normal = before_obstacle(
                scene, rows, u[k], scene.free_motion(k, tie), told_gap[k], length
            )
        # What both sides' weights are wrong by counts by their sizes.
        many = np.maximum(1.0, np.abs(combination).sum(axis=1) / 2)
        own_way = combination @ (u[k] - before)
        nodal = combination.T @ force
        note(k, "without a row", np.linalg.norm(force[~on], axis=1).max(initial=0.0), largest)
        note(k, "stored gap", (np.abs(own_gap - told_gap[k]) / many)[on].max(), length, rough)
        note(k, "normal", np.abs(normal - frame[k][:, 0])[on].max(), 1.0, rough)
        slip = np.einsum("pki,pi->pk", frame[k][:, 1:], own_way)
        note(k, "stored slip", np.abs(slip - told_slip[k])[on].max(), length, rough)
        note(k, "stored nodal force", np.abs(nodal - pressed[k]).max(), largest, rough)
        left = inner - loads - nodal
        if tie:
            follows = np.einsum("sn,ni->si", tie[1], u[k])
            note(k, "tie", np.abs(u[k][tie[0]] - follows).max(), length)
            left += tie[1].T @ left[tie[0]]
            left[tie[0]] = 0.0
        note(k, "equilibrium", np.abs(left[~held]).max(), largest)
        note(k, "support force", np.abs(left - support[k])[held].max(), largest)
        if between:
            note(k, "action and reaction", np.abs(pressed[k].sum(axis=0)).max(), largest)
        press, size = reaction[k][:, 0], np.linalg.norm(reaction[k][:, 1:], axis=1)
        note(k, "penetration", max(0.0, -(own_gap / many)[on].min()), length, rough)
        note(k, "adhesion", max(0.0, -press.min()), largest)
        note(k, "complementarity", np.abs(own_gap * press / many)[on].max(), largest * length,
             rough)
        note(k, "cone", max(0.0, (size - scene.mu * press).max()), largest)
        law = scene.mu * press * np.linalg.norm(told_slip[k], axis=1)
        law = law + np.einsum("pk,pk->p", reaction[k][:, 1:], told_slip[k])
        note(k, "friction law", np.abs(law).max(), largest * length)
        before = u[k]
    return findings


def in_mesh(scene, rows, u=0.0, start=None):
    """C (P, N), normals, covered and whole areas, gaps and least shares of points, as `rows` are.

    `start` is what it was in the mesh, which small sliding keeps.
    """
    if scene.small and start is not None:
        return start
    own, *found = slave_points(scene, u)
    order = np.searchsorted(own, rows)
    return tuple(one[order] for one in found)


def gaps_at(scene, seen, u):
    """(P,) gaps; with small sliding those in the mesh and how far both sides have parted since."""
    combination, normal, *_, gap, _ = seen
    return gap + (np.einsum("pi,pi->p", normal, combination @ u) if scene.small else 0.0)


def heat(scene, k):
    """The size of forces of expansion, whose sums are rounded."""
    if scene.warmth is None:
        return 0.0
    return np.abs(scene.internal_force(np.zeros_like(scene.points), k)).max()


def before_obstacle(scene, rows, u, free_motion, told, length):
    """C (P, N), gaps and normals of the points before an obstacle."""
    gap, normal = scene.gaps_and_normals(scene.points + u)
    free, _ = scene.gaps_and_normals(scene.points + free_motion)
    combination = np.zeros((len(rows), len(u)))
    own_gap = np.zeros(len(rows))
    for p, r in enumerate(rows):
        alpha = scene.alpha.get(int(r), 0.0)
        ends = list(scene.middles.get(int(r), ()))
        if alpha:
            # Where neither end would be inside the obstacle without contact they have no part.
            least = free[ends].min()
            alone = least > 0
            if abs(least) < 1e-9 * length:
                both = (gap[r] - alpha * gap[ends].sum()) / (1 - 2 * alpha)
                alone = abs(told[p] - gap[r]) < abs(told[p] - both)
            alpha = 0.0 if alone else alpha
        share = 1 / (1 - 2 * alpha)
        combination[p, r] = share
        own_gap[p] = share * gap[r]
        for e in ends if alpha else ():
            combination[p, e] = -alpha * share
            own_gap[p] -= alpha * share * gap[e]
    return combination, own_gap, normal[rows]


def solve_next(scene, path):
    """Displacements (N, 3) after the last increment in a file, by the judge; None: not found."""
    count, k, before = len(scene.points), 0, np.zeros((len(scene.points), 3))
    if path.exists():
        with h5py.File(path) as file:
            view, k = file["VTKHDF"], int(file["history"].attrs["finished"])
            ids = view["PointData/node_id"][:count] - 1
            if k:
                first = view["Steps/PointDataOffsets/displacement"][k - 1]
                before[ids] = view["PointData/displacement"][first : first + count]
    tie = scene.tied() if scene.tie else None
    start = in_mesh(scene, scene.foot) if scene.master else None

    def place_points(u, free):
        if scene.master:
            seen = in_mesh(scene, scene.foot, u, start)
            combination, normal, cover, whole, _, enough = seen
            on = cover / whole > enough
            gap = gaps_at(scene, seen, u)
            return combination[on], gap[on], normal[on]
        nothing = np.zeros(len(scene.foot))
        return before_obstacle(scene, scene.foot, u, free, nothing, 0.0)

    return solve_increment(scene, k, before, place_points, tie)


def judge_seed(seed, family, options):
    """(outcome, words) of a seed."""
    scene = Scene(seed, family)
    with tempfile.TemporaryDirectory(dir=options.keep) as folder:
        deck = Path(folder) / f"{family}-{seed}.inp"
        deck.write_text(scene.deck())
        done = subprocess.run(
            [options.program, deck.name, "--quiet"], cwd=folder, capture_output=True, text=True,
            timeout=20 * options.limit, check=False,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            preexec_fn=lambda: resource.setrlimit(
                resource.RLIMIT_CPU, (int(options.limit), int(options.limit) + 1)),
        )  # fmt: skip
        if done.returncode != 0:
            outcome = "broken"
            if done.returncode == 2:
                found = solve_next(scene, deck.with_suffix(".vtkhdf"))
                outcome = f"refused, {'unconfirmed' if found is None else 'solvable'}"
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
    parser.add_argument("--family", nargs="+", choices=FAMILIES, default=FAMILIES,
                        help="of decks, the seeds in turn; default: all")  # fmt: skip
    parser.add_argument("--only", type=int, nargs="+", help="seeds of single decks")
    parser.add_argument("--keep", type=Path, help="where decks are run")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds of the processor")
    parser.add_argument("--bipot", dest="program",
                        default=os.environ.get("BIPOT", str(ROOT / "build" / "bipot")))  # fmt: skip
    options = parser.parse_args()
    counts = Counter()
    for seed in options.only or range(options.seed, options.seed + options.decks):
        family = options.family[seed % len(options.family)]
        scene, outcome, words = judge_seed(seed, family, options)
        counts[outcome] += 1
        if outcome != "right":
            against = "body" if scene.master else "sphere" if scene.ball else "plane"
            print(f"{family} {seed} ({' and '.join(scene.types)}, {against}, mu {scene.mu:g}): "
                  f"{outcome}: {words}", flush=True)  # fmt: skip
    print(dict(counts))
    return int(any(outcome != "right" for outcome in counts))


if __name__ == "__main__":
    sys.exit(main())
