"""Run the matrix of extremes: small scenes, each at a limit, by AUTO and by the paper's solvers.

    studies/run extremes           all scenes and solvers: docs/studies/extremes.md and its map
    studies/run extremes --only mu- --solvers AUTO --keep /tmp/decks
    studies/run extremes --family bodies     bodies that touch each other (body_runs.py), by AUTO;
                                             makes their part of the page anew
    studies/run extremes --family finite     finite strain (finite_runs.py), likewise
    studies/run extremes --family types      tetrahedra, wedges, second order, likewise
    studies/run extremes --family plane      plane bodies, bolts, what changes, likewise

Every run is judged here from its result file and the scene's own numbers (judge.py): what
the program says of itself does not count. Outcomes are

    certified   exit status 0 and everything holds
    fallback    the same, after AUTO's first solver gave up
    diagnosed   exit status 1 or 2 and a message that names the cause
    failed      anything else: a wrong result, no result, a crash, no end, a number that is none

Exit status: 0 where no run failed, 1 otherwise. Bodies that touch each other have a judge and
outcomes of their own, and so have scenes at finite strain, which are held against what is true of
them.
"""

import os
import shutil
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from bipot.program import program_options
from bipot.report import Bar
from studies.extremes import finite_runs
from studies.extremes.body_runs import FAILURES, OUTCOMES, RIGHT, run_plans, told
from studies.extremes.body_scenes import all_plans
from studies.extremes.confirm import confirm
from studies.extremes.finite_scenes import finite_scenes
from studies.extremes.judge import CERTIFIED, DIAGNOSED, FAILED, FALLBACK, cause_of, judge
from studies.extremes.plane_scenes import plane_scenes
from studies.extremes.scenes import all_scenes, deck
from studies.extremes.type_scenes import type_scenes

SOLVERS = {
    "AUTO": "SOLVER=AUTO",
    "Uzawa, bi-potential": "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=UZAWA",
    "Newton, bi-potential": "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=NEWTON",
    "Uzawa, pseudo-potential": "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=UZAWA",
    "Newton, pseudo-potential": "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=NEWTON",
}


@dataclass
class Outcome:
    """How one scene went with one solver."""

    scene: str
    axis: str
    solver: str
    outcome: str
    words: str
    cause: str | None
    error: float  # the worst found here, of what the scene's tolerance allows
    seconds: float


def run_scene(scene, solver, program, folder, limit, keep=False):
    """Run one scene by one solver in a folder of its own, and judge it.

    The deck stays in the folder; the result, of megabytes, only with `keep`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "scene.inp"
    path.write_text(deck(scene, SOLVERS[solver]))
    command = [program, path.name, "--quiet"]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    start = time.monotonic()
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=limit,
            check=False,
            env=environment,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        words = f"no end within {limit:g} s"
        return Outcome(scene.name, scene.axis, solver, FAILED, words, None, float("nan"), limit)
    seconds = time.monotonic() - start
    result = folder / "scene.vtkhdf"
    outcome, words, error = judge(scene, result, done.returncode, done.stderr)
    if not keep:
        result.unlink(missing_ok=True)
    cause = cause_of(done.stderr) if outcome == DIAGNOSED else None
    error /= 10 * scene.tolerance
    return Outcome(scene.name, scene.axis, solver, outcome, words, cause, error, seconds)


def run_matrix(scenes, solvers, program, folder, limit=60.0, jobs=2):
    """Run all scenes by all solvers, `jobs` at a time; return the outcomes in their order."""
    tasks = [(scene, solver) for scene in scenes for solver in solvers]
    found = {}
    with ThreadPoolExecutor(jobs) as pool:
        futures = {
            pool.submit(
                run_scene,
                scene,
                solver,
                program,
                folder / f"{scene.name}-{list(SOLVERS).index(solver)}",
                limit,
            ): (scene.name, solver)
            for scene, solver in tasks
        }
        bar = Bar(len(tasks))
        for future in as_completed(futures):
            found[futures[future]] = future.result()
            bar.advance(1)
            bar.show(futures[future][0])
        bar.close()
    return [found[scene.name, solver] for scene, solver in tasks]


def confirm_refusals(scenes, outcomes):
    """Check what AUTO refused by other means; return (right, words) by the name of the scene."""
    known = {scene.name: scene for scene in scenes}
    return {
        one.scene: confirm(known[one.scene], one.cause)
        for one in outcomes
        if one.solver == "AUTO" and one.outcome == DIAGNOSED
    }


def main():
    """Run, print, write the page."""
    parser = program_options(__doc__)
    parser.add_argument("--family", default="all",
                        choices=("one", "bodies", "finite", "types", "plane", "all"))  # fmt: skip
    parser.add_argument("--only", default="", help="scenes whose name or axis holds this")
    parser.add_argument("--solvers", default="", help="parts of solvers' names, as a,b")
    parser.add_argument("--jobs", type=int, default=max(1, min(2, os.cpu_count() or 1)))
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for one run")
    parser.add_argument("--keep", help="folder in which the decks stay")
    options = parser.parse_args()
    program = options.bipot.resolve()
    folder = Path(options.keep or tempfile.mkdtemp(prefix="extremes-"))
    try:
        failed = run_families(options, program, folder)
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    return 1 if failed else 0


def run_families(options, program, folder):
    """Run what the command line names, print it, write the page of all; whether a run failed."""
    wanted = [word for word in options.solvers.split(",") if word]
    solvers = [name for name in SOLVERS if not wanted or any(word in name for word in wanted)]
    scenes, plans = [], []
    if options.family in ("one", "all"):
        scenes = [s for s in all_scenes() if options.only in s.name or options.only == s.axis]
    if options.family in ("bodies", "all"):
        plans = [p for p in all_plans() if options.only in p.name or options.only == p.axis]
    start = time.monotonic()
    outcomes = run_matrix(scenes, solvers, program, folder, options.limit, options.jobs)
    seconds = time.monotonic() - start
    for one in outcomes:
        if one.outcome != CERTIFIED:
            print(f"{one.outcome:10} {one.solver:24} {one.scene:34} {one.words}")
    for solver in solvers if outcomes else ():
        mine = [one.outcome for one in outcomes if one.solver == solver]
        counts = {name: mine.count(name) for name in (CERTIFIED, FALLBACK, DIAGNOSED, FAILED)}
        print(f"{solver}: {len(mine)} runs, " + ", ".join(f"{n} {k}" for k, n in counts.items()))
    start = time.monotonic()
    of_bodies = run_plans(plans, program, folder, jobs=options.jobs)
    seconds_of_bodies = time.monotonic() - start
    for one in of_bodies:
        if one.outcome != RIGHT:
            print(told(one))
    if of_bodies:
        kinds = [one.outcome for one in of_bodies]
        print(f"bodies: {len(kinds)} runs, "
              + ", ".join(f"{kinds.count(kind)} {kind}" for kind in OUTCOMES))  # fmt: skip
    of_strain, of_types, of_plane = [], [], []
    for family, scenes_of, found in (
        ("finite", finite_scenes, of_strain), ("types", type_scenes, of_types),
        ("plane", plane_scenes, of_plane),
    ):  # fmt: skip
        if options.family in (family, "all"):
            chosen = [s for s in scenes_of() if options.only in s.name or options.only == s.axis]
            found += finite_runs.run_scenes(chosen, program, folder)
    for one in of_strain + of_types + of_plane:
        if one.outcome != finite_runs.RIGHT or options.only:
            print(finite_runs.told(one))
    if options.family == "bodies" and not options.only:
        from studies.extremes.body_page import HEAD, bodies_lines
        from studies.extremes.page import put_section
        from studies.pages import PAGES

        put_section(PAGES / "extremes.md", HEAD, bodies_lines(of_bodies, seconds_of_bodies))
    if options.family == "finite" and not options.only:
        from studies.extremes.finite_page import HEAD, finite_lines
        from studies.extremes.page import put_section
        from studies.pages import PAGES

        put_section(PAGES / "extremes.md", HEAD, finite_lines(of_strain))
    if options.family == "types" and not options.only:
        from studies.extremes.page import put_section
        from studies.extremes.type_page import HEAD, type_lines
        from studies.pages import PAGES

        put_section(PAGES / "extremes.md", HEAD, type_lines(of_types))
    if options.family == "plane" and not options.only:
        from studies.extremes.page import put_section
        from studies.extremes.plane_page import HEAD, plane_lines
        from studies.pages import PAGES

        put_section(PAGES / "extremes.md", HEAD, plane_lines(of_plane))
    if options.family == "all" and not options.only and not wanted:
        # Only the whole matrix makes the page; drawing is not needed for less.
        from studies.extremes.body_page import bodies_lines
        from studies.extremes.finite_page import finite_lines
        from studies.extremes.page import draw_map, write_page
        from studies.extremes.plane_page import plane_lines
        from studies.extremes.type_page import type_lines
        from studies.pages import PAGES
        from studies.two_answers import answers_of_block

        draw_map(outcomes, solvers, PAGES / "figures" / "extremes.png")
        confirmed = confirm_refusals(scenes, outcomes)
        answers = answers_of_block(program)
        sections = bodies_lines(of_bodies, seconds_of_bodies) + finite_lines(of_strain)
        sections += type_lines(of_types) + plane_lines(of_plane)
        page = PAGES / "extremes.md"
        write_page(outcomes, solvers, confirmed, answers, seconds, sections, page)
    return (
        any(one.outcome == FAILED for one in outcomes)
        or any(one.outcome in FAILURES for one in of_bodies)
        or any(one.outcome in finite_runs.FAILURES for one in of_strain + of_types + of_plane)
    )
