"""Runs of the scenes at finite strain, each held against what is true of it.

    studies/run extremes --family finite [--only ratio] [--keep DIR]

Outcomes are

    right     exit status 0, and no further from what is true than allowed
    refused   exit status 2, with the reason that is known of the scene
    hindered  refused, though the scene has a solution
    wrong     exit status 0, and wrong, or solved where it has no solution
    broken    another exit status, a signal, no end, a result that cannot be read
"""

import resource
import subprocess
from dataclasses import dataclass
from os import environ

import numpy as np

from bipot.result import Result, ResultError
from studies.extremes.finite_scenes import FiniteScene

RIGHT, REFUSED, HINDERED, WRONG, BROKEN = "right", "refused", "hindered", "wrong", "broken"
OUTCOMES = (RIGHT, REFUSED, HINDERED, WRONG, BROKEN)
FAILURES = (WRONG, BROKEN)
LIMIT = 60.0  # seconds for a run


@dataclass
class FiniteOutcome:
    """How one scene went."""

    scene: FiniteScene
    outcome: str = BROKEN
    words: str = ""  # what the program or the failure says
    measured: np.ndarray | None = None
    error: float = np.nan  # of the largest entry of what is true
    increments: int = 0
    iterations: int = 0  # of Newton and Raphson, in all
    seconds: float = np.nan  # of the processor


def iterations_of(result):
    """Return the iterations of Newton and Raphson of a run, none at small strain."""
    name = "newton_raphson_iterations"
    return int(result.history(name).sum()) if name in result.history_names else 0


def run_one(scene, program, folder):
    """Run a scene in a folder, and measure its result; what is true comes later."""
    one = FiniteOutcome(scene)
    folder.mkdir(parents=True, exist_ok=True)
    deck = folder / f"{scene.name}.inp"
    deck.write_text(scene.deck, encoding="utf-8")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            [program, deck.name, "--quiet"], cwd=folder, capture_output=True, text=True,
            timeout=LIMIT, check=False, stdin=subprocess.DEVNULL,
            env=environ | {"OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        one.words = f"no end within {LIMIT:g} s"
        return one
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    one.seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    path = deck.with_suffix(".vtkhdf")
    one.words = done.stderr.strip().splitlines()[0] if done.stderr.strip() else ""
    try:
        if path.exists():
            with Result(path) as result:
                one.increments = result.finished
                one.iterations = iterations_of(result)
                if done.returncode == 0:
                    one.measured = np.asarray(scene.measure(result), dtype=float)
    except (ResultError, KeyError, ValueError) as error:
        one.words = f"unreadable result: {error!r}"
        return one
    finally:
        path.unlink(missing_ok=True)
    if done.returncode == 2 or (done.returncode == 1 and scene.refusal):
        right = scene.refusal and scene.refusal in done.stderr
        one.outcome = REFUSED if right else HINDERED
    elif done.returncode == 0 and scene.refusal:
        one.outcome, one.words = WRONG, "solved, though it has no solution"
    elif done.returncode == 0:
        one.outcome = RIGHT
    else:
        one.words = f"exit status {done.returncode}: {one.words}"
    return one


def hold_against_truth(one, outcomes):
    """Find the error of a solved scene; `outcomes` are all of the run, by name."""
    if one.outcome != RIGHT:
        return
    true = one.scene.true
    if isinstance(true, str):
        true = outcomes[true].measured if true in outcomes else None
        if true is None:
            one.outcome, one.words = BROKEN, f"{one.scene.true} has no result to compare with"
            return
    one.error = float(np.abs(one.measured - true).max() / np.abs(true).max())
    if not one.error <= one.scene.allowed:
        one.outcome = WRONG
        one.words = f"{one.measured} for {true}"


def run_scenes(scenes, program, folder):
    """Run scenes one after the other; return their outcomes in their order."""
    outcomes = {scene.name: run_one(scene, program, folder) for scene in scenes}
    for one in outcomes.values():
        hold_against_truth(one, outcomes)
    return list(outcomes.values())


def told(one):
    """Return an outcome as a line."""
    return (
        f"{one.outcome:9} {one.scene.name:26} error {one.error:8.1e} {one.increments:4} inc "
        f"{one.iterations:5} it {one.seconds:6.2f} s  {one.words if one.outcome != RIGHT else ''}"
    )
