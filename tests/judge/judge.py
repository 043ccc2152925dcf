#!/usr/bin/env python3
"""Run the program on random decks and judge its results by an independent finite-element program.

    tests/judge/judge.py --decks 2000 --seed 1 [--jobs 2]
                         [--family one|bodies|joined|rims|finite|closed|steps|cut|axes]
    tests/judge/judge.py --only SEED [--family bodies]

The family `one` has a body, or several that do not touch, before planes, spheres and cylinders;
`bodies` has bodies that touch each other or are tied, obstacles of facets and obstacles that turn.
`joined` has decks of these two with equations, couplings, local directions, supports that stay as
they are, and temperatures. `rims` has contact beside what is clamped, tied, joined or cracked, in
corners of one master, and before tools smaller than an element. `finite` has bodies at finite
strain, pressed by 5 to 40 % of their height, before obstacles and each other. `closed` has surfaces
without separation, pressed, pulled and pushed. `axes` has materials that are not isotropic. `steps`
has several *STEPs that hold bodies and tools and free them. Of `all` the second and the third have
a quarter as many decks as the first, the others none; of `both` the third has none, either.

A deck is one of

    right        certified, and right by every law (laws.py)
    wrong        certified, and wrong
    confirmed    refused with exit status 2, and shown to have no solution, or none that double
                 precision holds, by other means (refusals.py); or refused as a mistake that it is
    refuted      refused, though a solution was found
    unconfirmed  refused, and neither shown to be right nor to be wrong
    broken       another exit status, a signal, no end, an unreadable result

Exit status 1 if any is wrong, refuted, unconfirmed or broken.
"""

import argparse
import math
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded

import numpy as np
from body_scenes import random_bodies
from closed_scenes import random_closed
from finite_refusals import confirm_finite
from finite_scenes import random_finite
from joined_scenes import random_joined
from laws import Judge, Stored, Unreadable
from random_scenes import random_scene
from refusals import CONFIRMED, OPEN, REFUTED, confirm, ties_nothing
from rim_scenes import random_rims
from scenes import Axes, write_deck
from step_scenes import random_steps

ROOT = Path(__file__).resolve().parents[2]
RIGHT, WRONG, BROKEN = "right", "wrong", "broken"
FAILURES = (WRONG, REFUTED, OPEN, BROKEN)
PATIENCE = 20  # seconds to wait for one of the processor


@dataclass
class Verdict:
    """The outcome of a deck, in words."""

    family: str
    seed: int
    kind: str
    outcome: str
    words: str
    deck: Path


def run_program(program, deck, limit):
    """(exit status, message) of a run; the status of one that does not end is None.

    `limit` is in seconds of the processor: on a busy machine a run may take far longer.
    """
    most = math.ceil(limit)
    try:
        done = subprocess.run(
            [program, deck.name], cwd=deck.parent, capture_output=True, text=True,
            timeout=PATIENCE * limit, check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most + 1)),
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return None, f"no end within {PATIENCE * limit:g} s"
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return None, f"no end within {limit:g} s of the processor"
    return done.returncode, done.stderr


def stored_result(scene, path):
    """The result file, None where there is none."""
    return Stored(scene, path) if path.exists() else None


def judge_run(scene, deck, status, message, options):
    """(outcome, words) of a run."""
    result = deck.with_suffix(".vtkhdf")
    try:
        stored = stored_result(scene, result)
    except (OSError, KeyError, Unreadable, ValueError) as error:
        return BROKEN, f"exit status {status}, unreadable result: {error!r}"
    if status == 1 and ties_nothing(scene, message):
        return CONFIRMED, message.strip()[:200]
    if status not in (0, 2):
        return BROKEN, f"exit status {status}: {message.strip()[:400]}"
    if status == 0 and stored is None:
        return BROKEN, "exit status 0 without a result"
    findings = []
    if stored is not None:
        judge = Judge(scene, stored)
        try:
            findings = judge.judge(complete=status == 0)
        except Unreadable as error:
            findings = judge.findings
            if not findings:
                return BROKEN, f"exit status {status}, unreadable result: {error!r}"
    if findings:
        more = f" (and {len(findings) - 1} more)" if len(findings) > 1 else ""
        worst = max(findings, key=lambda f: f.found / f.allowed if f.allowed > 0 else 1e300)
        return WRONG, f"{findings[0]}{more}; worst: {worst}"
    if status == 0:
        return RIGHT, ""
    outcome, words = (confirm_finite if scene.finite else confirm)(scene, stored, message)
    if outcome == REFUTED and any(pair.most is not None for pair in scene.pairs):
        # What cones cannot balance, less cannot; but what they can says nothing of less.
        outcome = OPEN
    return outcome, f"{message.strip()[:300]} -- {words}"


def random_cut(seed):
    """A scene of one body, or of several, whose friction is at most a stress."""
    scene = (random_scene if seed % 2 else random_bodies)(seed)
    rng = np.random.default_rng([seed, 79])
    for pair in scene.pairs:
        young = scene.materials[scene.material[0]].young
        if pair.friction:
            pair.most = float(f"{young * 10 ** rng.uniform(-5, -2):.3g}")
    return scene


def random_axes(seed):
    """A scene of one body, or of several, whose materials are not isotropic."""
    scene = (random_scene if seed % 2 else random_bodies)(seed)
    rng = np.random.default_rng([seed, 80])
    scene.exact = None
    span = np.ptp(scene.points, axis=0).max()
    for material in scene.materials:
        if material.expansion is not None:
            continue
        root = rng.normal(size=(6, 6)) / 4 + np.diag(10 ** rng.uniform(-0.4, 0.4, 6))
        c = material.young * (root @ root.T + np.eye(6) / 20)
        c = np.array([[float(f"{c[i, j]:.6g}") for j in range(6)] for i in range(6)])
        around = rng.random() < 0.4
        a, b = rng.normal(size=(2, 3))
        if around:
            # Its axis passes far from all elements.
            b = scene.points.mean(axis=0) + 3 * span * a / np.linalg.norm(a)
            a, b = b, b + span * np.cross(a, rng.normal(size=3))
        material.axes = Axes(c, a, b, around, float(rng.integers(-90, 90)))
    return scene


FAMILIES = {
    "one": random_scene, "bodies": random_bodies, "joined": random_joined, "rims": random_rims,
    "finite": random_finite, "closed": random_closed, "steps": random_steps, "cut": random_cut,
    "axes": random_axes,
}  # fmt: skip


def judge_seed(deck, options):
    """The Verdict on a deck (family, seed)."""
    family, seed = deck
    scene = FAMILIES[family](seed)
    folder = Path(tempfile.mkdtemp(prefix=f"judge-{family}-{seed}-", dir=options.keep))
    keep = False
    try:
        outcome, words, deck = judge_scene(scene, folder, f"seed-{seed}", options)
        plain = without_choices(scene, words)
        if outcome in (REFUTED, OPEN) and plain:
            # What a deck chooses may fail; the program's own choice may not.
            first = words
            outcome, words, deck = judge_scene(plain, folder, f"seed-{seed}-auto", options)
            if outcome == RIGHT:
                outcome, words = CONFIRMED, f"by the deck's choice alone, AUTO is right: {first}"
        keep = outcome in FAILURES
        return Verdict(family, seed, scene.kind, outcome, words, deck)
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)


def without_choices(scene, words):
    """The scene without what a message blames: solver, precision, increments; None if nothing."""
    if (scene.finite and "smaller increments may help" in words) or "leave out DIRECT" in words:
        if any(step.direct for step in scene.steps):
            return replace(scene, steps=[replace(step, direct=False) for step in scene.steps])
        return None
    solver = {k: v for k, v in scene.controls.items() if k != "TOLERANCE"}
    blamed = ("did not reach", "a tolerance of", "SOLVER=AUTO may help")
    if solver and any(blame in words for blame in blamed):
        kept = {k: v for k, v in scene.controls.items() if k == "TOLERANCE"}
        return replace(scene, controls=kept, precision={})
    if scene.precision and re.search(r"the factor (of|\()", words):
        return replace(scene, precision={"FACTOR": "DOUBLE"})
    return None


def judge_scene(scene, folder, name, options):
    """(outcome, words, deck) of a scene that is run in a folder."""
    deck = folder / f"{name}.inp"
    write_deck(scene, deck)
    status, message = run_program(options.program, deck, options.limit)
    return (*judge_run(scene, deck, status, message, options), deck)


def judge_decks(decks, options):
    """Verdicts on many decks, (family, seed) each."""
    if options.jobs == 1:
        for deck in decks:
            yield judge_seed(deck, options)
        return
    with ProcessPoolExecutor(options.jobs) as pool:
        for done in as_completed([pool.submit(judge_seed, deck, options) for deck in decks]):
            yield done.result()


def chosen_decks(options):
    """The decks (family, seed) that the command line names."""
    groups = {"all": ["one", "bodies", "joined"], "both": ["one", "bodies"]}
    families = groups.get(options.family, [options.family])
    if options.only:
        return [(family, seed) for family in families for seed in options.only]
    out = []
    for family in families:
        count = options.decks
        if options.family in groups and family != "one":
            count = options.decks // 4
        out += [(family, seed) for seed in range(options.seed, options.seed + count)]
    return out


def read_options(words=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--decks", type=int, default=200, help="how many")
    parser.add_argument("--seed", type=int, default=os.environ.get("BIPOT_SEED", "1"),
                        help="of the first deck; default: BIPOT_SEED, or 1")  # fmt: skip
    parser.add_argument("--family", choices=[*FAMILIES, "both", "all"], default="all")
    parser.add_argument("--only", type=int, nargs="+", help="seeds of single decks, kept")
    parser.add_argument("--keep", type=Path, help="where decks that fail are kept")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--refusals", action="store_true", help="print those confirmed, too")
    parser.add_argument(
        "--limit", type=float, default=120.0, help="seconds of the processor that a run may take"
    )
    parser.add_argument("--bipot", dest="program", help="the program",
                        default=os.environ.get("BIPOT", str(ROOT / "build" / "bipot")))  # fmt: skip
    options = parser.parse_args(words)
    options.keep = options.keep or Path(tempfile.gettempdir()) / "judge"
    options.keep.mkdir(parents=True, exist_ok=True)
    return options


def main():
    """Judge decks, print what failed and a table."""
    options = read_options()
    counts = Counter()
    by_kind = Counter()
    for verdict in judge_decks(chosen_decks(options), options):
        counts[verdict.outcome] += 1
        by_kind[verdict.kind, verdict.outcome] += 1
        told = options.only or (options.refusals and verdict.outcome == CONFIRMED)
        if verdict.outcome in FAILURES or told:
            print(f"{verdict.family} {verdict.seed} ({verdict.kind}): {verdict.outcome}: "
                  f"{verdict.words}\n    {verdict.deck}", flush=True)  # fmt: skip
    outcomes = (RIGHT, CONFIRMED, WRONG, REFUTED, OPEN, BROKEN)
    print(f"{'':32s}" + "".join(f"{o:>12s}" for o in outcomes))
    for kind in sorted({k for k, _ in by_kind}):
        print(f"{kind:32s}" + "".join(f"{by_kind[kind, o]:12d}" for o in outcomes))
    print(f"{'all':32s}" + "".join(f"{counts[o]:12d}" for o in outcomes))
    return int(any(counts[o] for o in FAILURES))


if __name__ == "__main__":
    sys.exit(main())
