"""Runs of the scenes of bodies that touch each other, before the judge of tests/judge.

    studies/run extremes --family bodies [--only edge] [--keep DIR]

A run that ends with status 0 is judged from its result file by a second finite-element program,
which places surfaces, balances forces and checks the laws of contact by its own integrals. It then
solves every increment by itself, from where the program's began, and the two are compared. What the
program refuses is confirmed, or refuted by a solution. Outcomes are

    right        exit status 0, and right by every law
    refused      exit status 1 or 2, one cause named, and confirmed
    refuted      refused, though a solution was found
    unconfirmed  refused, and neither confirmed nor refuted
    wrong        exit status 0, and wrong
    broken       another exit status, a signal, no end, a result that cannot be read
"""

from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np

from bipot.report import Bar
from studies.extremes.body_scenes import scene_of
from studies.extremes.judge import cause_of

# isort: split
# Of tests/judge, found through body_scenes.
from between_nodes import unfelt_overlap
from judge import run_program
from laws import Judge, Stored, Unreadable
from load_path import LoadPath
from mortar import normal_of
from refusals import (
    CONFIRMED,
    OPEN,
    REFUTED,
    confirm,
    judge_solution,
)
from scenes import write_deck
from slow_solver import Increment

RIGHT, REFUSED, REFUTED_RUN, OPEN_RUN, WRONG, BROKEN = (
    "right", "refused", "refuted", "unconfirmed", "wrong", "broken")  # fmt: skip
OUTCOMES = (RIGHT, REFUSED, REFUTED_RUN, OPEN_RUN, WRONG, BROKEN)
FAILURES = (WRONG, BROKEN)
PATIENCE = 120.0  # seconds in which the judge may begin something new in an increment
LIMIT = 120.0  # seconds of the processor for a run


@dataclass
class BodyOutcome:
    """How one scene went."""

    name: str
    axis: str
    extreme: str
    slaves: tuple
    units: str
    outcome: str
    words: str = ""
    confirmed: str = ""  # how a refusal was confirmed, or was not
    error: float = np.nan  # the worst that the judge found, of what it allows
    worst: str = ""  # what that is
    iterations: int = 0  # of contact, in a placement, the most
    placements: int = 0  # in an increment, the most
    apart: float = np.nan  # from the judge's displacements, of the largest
    forces_apart: float = np.nan  # from its forces, of the largest
    unfelt: float = 0.0  # how deep faces overlap where nothing presses, of the displacements
    compared: int = 0  # increments that the judge solved
    increments: int = 0


def unjudged(plan):
    """Return the outcome of a plan before its run."""
    return BodyOutcome(plan.name, plan.axis, plan.extreme, plan.slaves, plan.units, BROKEN)


def run_scene(one, scene, program, folder, compare=True, limit=LIMIT):
    """Run a scene in a folder, judge it, and return its outcome: `one`, filled in."""
    folder.mkdir(parents=True, exist_ok=True)
    deck = folder / f"{one.name}.inp"
    write_deck(scene, deck)
    status, message = run_program(program, deck, limit)
    path = deck.with_suffix(".vtkhdf")
    try:
        stored = Stored(scene, path) if path.exists() else None
        judge_run(one, scene, stored, status, message)
        if stored is not None:
            read_counts(one, path)
        if one.outcome == RIGHT and compare:
            compare_solutions(one, scene, stored)
    except (OSError, KeyError, Unreadable, ValueError) as error:
        one.outcome, one.words = BROKEN, f"exit status {status}, unreadable result: {error!r}"
    path.unlink(missing_ok=True)
    return one


def judge_run(one, scene, stored, status, message):
    """Fill in outcome, words and errors of a run that ended so."""
    one.increments = sum(step.increments for step in scene.steps)
    if status is None or status not in (0, 1, 2) or (status == 0 and stored is None):
        one.words = f"exit status {status}: {message.strip()[:300]}"
        return
    findings = []
    if stored is not None:
        judge = Judge(scene, stored)
        findings = judge.judge(complete=status == 0)
        if judge.worst:
            one.worst = max(judge.worst, key=judge.worst.get)
            one.error = judge.worst[one.worst]
    if findings:
        worst = max(findings, key=lambda f: f.found / f.allowed if f.allowed > 0 else np.inf)
        one.outcome, one.words = WRONG, f"{worst} ({len(findings)} findings)"
        return
    if status == 0:
        one.outcome = RIGHT
        one.unfelt = unfelt_overlap(scene, stored)
        return
    one.words = message.strip().splitlines()[0] if message.strip() else ""
    if cause_of(message) is None:
        one.words = f"exit status {status} without a cause: {one.words}"
        return
    found, one.confirmed = confirm_refusal(scene, stored, message, status)
    one.outcome = {CONFIRMED: REFUSED, REFUTED: REFUTED_RUN}.get(found, OPEN_RUN)


def confirm_refusal(scene, stored, message, status):
    """(confirmed, refuted or unconfirmed; words) for what the program refuses."""
    if status == 1:
        steepest = turned_by(scene)
        if "is turned towards" in message and steepest < 0:
            return REFUTED, (
                f"the normals of faces before each other have a cosine of {steepest:.2f}, "
                "of which the program takes no more than -0.2"
            )
        return OPEN, ""
    return confirm(scene, stored, message)


def turned_by(scene):
    """The least cosine between normals of slave and master faces."""
    x = scene.points
    return min(
        float(normal_of(x[list(a)]) @ normal_of(x[list(b)]))
        for pair in scene.pairs
        for a in scene.faces(pair.part, pair.side)
        for b in scene.faces(*pair.master)
    )


def read_counts(one, path):
    """Read the iterations and placements of the increments that are there."""
    with h5py.File(path) as file:
        history = file["history"]
        finished = int(history.attrs["finished"])
        contact = history["contact_iterations"][:finished]
        one.placements = int(history["newton_raphson_iterations"][:finished].max(initial=0))
        one.iterations = int(contact.max(initial=0))


def compare_solutions(one, scene, stored):
    """Solve the increments again, each from where the program's began, and compare."""
    if scene.moves_nodes:
        scene = replace(scene, points=stored.places,
                        pairs=[replace(p, adjust=None) for p in scene.pairs])  # fmt: skip
    path, step = LoadPath(scene), -1
    before = np.zeros_like(scene.points)
    pressed_before = np.zeros_like(before)
    body, start, apart, forces_apart = None, 0.0, 0.0, 0.0
    for row in range(stored.finished):
        if int(stored.step[row]) - 1 != step:
            start += scene.steps[step].period if step >= 0 else 0.0
            step += 1
            path.begin(step, np.hstack([before, np.zeros_like(before)]))
        time = stored.time[row] - start
        increment = Increment(scene, before, path.supports(time), path.loads(time), body)
        increment.pressed_before = pressed_before
        body = increment.body
        found = increment.solve(scene.tolerance, seconds=PATIENCE)
        if not judge_solution(scene, path, increment, found, step, time, start):
            u, contact = stored.u[row], stored.contact_force[row]
            size = np.abs(u).max() or 1.0
            apart = max(apart, np.abs(found.u - u).max() / size)
            own = own_forces(increment, found)
            size = np.abs(contact).max() or 1.0
            forces_apart = max(forces_apart, np.abs(own - contact).max() / size)
            one.compared += 1
        before, pressed_before = stored.u[row], stored.contact_force[row]
    if one.compared:
        one.apart, one.forces_apart = apart, forces_apart


def told(one):
    """A line on an outcome that is not right."""
    words = f"{one.outcome:11} {one.name:34} {one.words}"
    return f"{words} -- {one.confirmed}" if one.confirmed else words


def own_forces(increment, solution):
    """The forces (N, 3) of contact on all nodes in a solution of the judge."""
    increment.place(solution.u)
    out = np.zeros_like(solution.u)
    forces = np.vstack(solution.forces)
    rows = np.array([row for _, row, _, _ in increment.points])
    np.add.at(out, rows, forces)
    return out - increment.partner.T @ forces


def run_plans(plans, program, folder, compare=True, jobs=2):
    """Run plans, `jobs` at a time; return their outcomes in their order."""
    found = {}
    bar = Bar(len(plans))
    with ProcessPoolExecutor(jobs) as pool:
        futures = [
            pool.submit(
                run_scene, unjudged(p), scene_of(p), program, Path(folder) / p.name, compare
            )
            for p in plans
        ]
        for future in as_completed(futures):
            one = future.result()
            found[one.name] = one
            bar.advance(1)
            bar.show(one.name)
    bar.close()
    return [found[plan.name] for plan in plans]
