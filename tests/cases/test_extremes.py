"""Extremes by AUTO: solved and right, or refused with the cause; nothing else.

Of the matrix it is every tenth scene, of bodies that touch each other some;
`scripts/test --full` has all of it, by all solvers.

The judge is tried first: results made wrong by hand must not pass it.
"""

import shutil
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from program import PROGRAM, in_long_form

from studies.extremes import body_runs  # found through program
from studies.extremes.body_scenes import all_plans, scene_of
from studies.extremes.confirm import confirm
from studies.extremes.judge import CERTIFIED, FAILED, FALLBACK, judge
from studies.extremes.matrix import confirm_refusals, run_matrix, run_scene
from studies.extremes.scenes import all_scenes, block, free_cube
from studies.two_answers import answers_of_block

# isort: split
import refusals  # of tests/judge, found through body_scenes
from slow_solver import Increment

LEAST_SOLVED = 0.9
PATIENCE = 900.0  # with a run that hangs [s]


class TwoAnswers(unittest.TestCase):
    @in_long_form
    def test_the_program_takes_one_of_several_right_answers(self):
        first, *others = answers_of_block(PROGRAM, 48, starts=6)
        self.assertGreaterEqual(len(others), 1)
        for one in others:
            self.assertLess(one.residual, 1e-11)
            normal = [a.reactions[:, 0].sum() for a in (first, one)]
            self.assertGreater(abs(normal[1] / normal[0] - 1), 1e-4)
        self.assertLess(first.residual, 1e-11)


class Judge(unittest.TestCase):
    """A right result passes; the same result with one number changed does not."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="extremes-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.scene = block("judged", "")
        found = run_scene(cls.scene, "AUTO", PROGRAM, cls.folder, PATIENCE, keep=True)
        assert found.outcome == CERTIFIED, found.words
        cls.result = cls.folder / "scene.vtkhdf"

    def judged(self, dataset, row, change):
        """Outcome and words for the result with `change` applied to a row of a dataset."""
        path = self.folder / "changed.vtkhdf"
        shutil.copy(self.result, path)
        with h5py.File(path, "r+") as file:
            values = file[dataset][row]
            file[dataset][row] = change(values)
        return judge(self.scene, path, 0, "")[:2]

    def test_changed_results_do_not_pass(self):
        contact, points = "contact/SLAVE-0:O-0/", "VTKHDF/PointData/"
        last = 4
        changes = {
            "reaction": (contact + "reaction", last, lambda r: 1.001 * r, "out of balance"),
            "tension": (contact + "reaction", last, lambda r: -r, "adhesion|balance"),
            "none": (contact + "gap", last, lambda g: g * float("nan"), "none"),
            "gap": (contact + "gap", last, lambda g: g + 0.01, "a gap is"),
            "displacement": (
                points + "displacement",
                slice(-27, None),
                lambda u: 1.01 * u,
                "prescribed",
            ),
            "support": (
                points + "reaction_force",
                slice(-27, None),
                lambda f: 1.01 * f,
                "supports",
            ),
            "status": (contact + "status", last, lambda s: 0 * s, "open"),
            "certified": ("history/certified", last, lambda c: 0 * c, "not certified"),
        }
        for name, (dataset, row, change, words) in changes.items():
            with self.subTest(changed=name):
                outcome, found = self.judged(dataset, row, change)
                self.assertEqual(outcome, FAILED)
                self.assertRegex(found, words)

    def test_the_result_itself_passes(self):
        self.assertEqual(self.judged("history/certified", 0, lambda c: c)[0], CERTIFIED)

    def test_a_refusal_needs_its_cause(self):
        path = self.folder / "none.vtkhdf"
        self.assertEqual(judge(self.scene, path, 2, "it did not work")[0], FAILED)
        self.assertEqual(judge(self.scene, path, -8, "nothing balances the loads")[0], FAILED)
        self.assertEqual(judge(self.scene, path, 3, "not enough memory")[0], FAILED)

    def test_another_scene_does_not_pass(self):
        other = block("other", "", mu=0.2)
        outcome, words, _ = judge(other, self.result, 0, "")
        self.assertEqual((outcome, "cone" in words), (FAILED, True))


class Confirmation(unittest.TestCase):
    def test_what_can_be_solved_is_not_confirmed(self):
        for scene in (free_cube("held", "", (2.0, 1.0, -10.0)), block("plain", "")):
            for cause in ("nothing balances", "tolerance not reached", "deck refused"):
                with self.subTest(scene=scene.name, cause=cause):
                    right, words = confirm(scene, cause)
                    self.assertFalse(right, words)


class JudgeOfBodies(unittest.TestCase):
    """What the laws of contact do not say of meshes, and refusals, on the judge's own solutions."""

    def begun(self, name):
        """(scene, first increment)."""
        scene = scene_of(next(plan for plan in all_plans() if plan.name == name))
        path = refusals.path_to(scene, None, 0)
        self.time = scene.steps[0].period / scene.steps[0].increments
        start = np.zeros_like(scene.points)
        return scene, Increment(scene, start, path.supports(self.time), path.loads(self.time))

    def solved(self, name):
        """(scene, first increment, own solution of it as a stored result)."""
        scene, increment = self.begun(name)
        found = increment.solve(scene.tolerance)
        self.assertTrue(found.converged)
        return scene, increment, refusals.as_stored(scene, increment, found, 0, self.time)

    def test_an_edge_between_the_nodes_is_seen(self):
        scene, _, stored = self.solved("edge-1-lower")
        # A hundredth deep along z, as deep as it was moved, with slopes of 45 degrees.
        self.assertAlmostEqual(refusals.unfelt_overlap(scene, stored), np.sqrt(0.5), delta=1e-3)
        scene, _, stored = self.solved("edge-1-upper")
        self.assertEqual(refusals.unfelt_overlap(scene, stored), 0)

    def test_what_tips_over_is_seen(self):
        # Its middle is at 1.25 of the base's width, its nodes are at 0.75 and 1.25.
        scene, increment = self.begun("topples-upper")
        self.assertGreater(refusals.left_by_pressure(scene, increment), 0.1)
        one = body_runs.BodyOutcome("", "", "", (), "", "")
        message = "step 1, increment 1: nothing balances the loads along body 2: translation"
        body_runs.judge_run(one, scene, None, 2, message)
        self.assertEqual(one.outcome, body_runs.REFUSED)
        scene, increment, _ = self.solved("rests-upper")
        self.assertLess(refusals.left_by_pressure(scene, increment), 1e-9)

    def test_a_refusal_of_what_can_be_solved_is_refuted(self):
        scene = scene_of(next(plan for plan in all_plans() if plan.name == "rests-upper"))
        message = "step 1, increment 1: nothing balances the loads along body 2: translation"
        one = body_runs.BodyOutcome("", "", "", (), "", "")
        body_runs.judge_run(one, scene, None, 2, message)
        self.assertEqual(one.outcome, body_runs.REFUTED_RUN)
        for status, words in ((2, "it did not work"), (3, message), (-11, "")):
            one.outcome = body_runs.BROKEN
            body_runs.judge_run(one, scene, None, status, words)
            self.assertNotIn(one.outcome, (body_runs.RIGHT, body_runs.REFUSED))


class Bodies(unittest.TestCase):
    # Refused though they have a solution, or may have one; docs/studies/extremes.md lists them.
    LISTED = ("edge-6-upper", "edge-6-lower", "three-sheet-lower", "rests-on-edge-lower")

    def test_right_or_rightly_refused(self):
        plans = all_plans()
        self.assertGreaterEqual(len(plans), 60)
        with tempfile.TemporaryDirectory(prefix="extremes-") as folder:
            outcomes = body_runs.run_plans(plans[3::27], PROGRAM, folder, compare=False)
        for one in outcomes:
            with self.subTest(scene=one.name):
                allowed = [body_runs.RIGHT, body_runs.REFUSED]
                if one.name in self.LISTED:
                    allowed += [body_runs.REFUTED_RUN, body_runs.OPEN_RUN]
                self.assertIn(one.outcome, allowed, body_runs.told(one))
        solved = [one for one in outcomes if one.outcome == body_runs.RIGHT]
        self.assertGreaterEqual(len(solved), 0.7 * len(outcomes))

    def test_displacements_and_forces_are_the_judges(self):
        plans = [plan for plan in all_plans() if plan.name == "ratio-1e+06-edge-upper"]
        with tempfile.TemporaryDirectory(prefix="extremes-") as folder:
            one = body_runs.run_plans(plans, PROGRAM, folder)[0]
        self.assertEqual((one.outcome, one.compared), (body_runs.RIGHT, 3), body_runs.told(one))
        self.assertLess(one.apart, 1e-7)
        self.assertLess(one.forces_apart, 1e-7)


class Matrix(unittest.TestCase):
    def test_auto_is_right_or_says_why_not(self):
        scenes = all_scenes()
        self.assertGreaterEqual(len(scenes), 120)
        scenes = scenes[::10]
        with tempfile.TemporaryDirectory(prefix="extremes-") as folder:
            outcomes = run_matrix(scenes, ["AUTO"], PROGRAM, Path(folder), limit=PATIENCE, jobs=2)
        for one in outcomes:
            with self.subTest(scene=one.scene):
                self.assertNotEqual(one.outcome, FAILED, one.words)
        solved = [one for one in outcomes if one.outcome in (CERTIFIED, FALLBACK)]
        self.assertGreaterEqual(len(solved), LEAST_SOLVED * len(outcomes))
        for name, (right, words) in confirm_refusals(scenes, outcomes).items():
            with self.subTest(refused=name):
                self.assertTrue(right, words)


if __name__ == "__main__":
    unittest.main()
