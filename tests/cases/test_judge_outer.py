"""Random bodies with all outer faces as surfaces, and their judge on changed decks first."""

import argparse
import sys
import unittest
from unittest import mock

import numpy as np
from program import PROGRAM, SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

import outer

OPTIONS = argparse.Namespace(program=PROGRAM, limit=60.0, keep=None)


class Judge(unittest.TestCase):
    def test_distances_by_hand(self):
        cube = outer.CORNERS.astype(float)
        for shift, wanted in (((3, 0, 0), 2), ((2, 2, 2), np.sqrt(3)), ((0.5, -1.25, 0), 0.25),
                              ((0.5, 0.5, 0.5), 0)):  # fmt: skip
            self.assertAlmostEqual(outer.distance(cube, cube + shift), wanted, delta=1e-9)

    def judged(self, change):
        """The outcomes of the first decks of a family, changed."""
        made = outer.Scene

        def changed(seed):
            scene = made(seed)
            change(scene)
            return scene

        with mock.patch.object(outer, "Scene", changed):
            return {outer.judge_seed(seed, OPTIONS)[1] for seed in self.seeds}

    def test_a_force_between_what_is_apart_is_found(self):
        def push(scene):
            scene.way = scene.way * 8

        self.seeds = range(3, 28, 3)
        self.assertIn("wrong", self.judged(push))

    def test_another_twin_is_found(self):
        def lift(scene):
            # The twin is told to begin apart.
            cards = scene.moved.cards

            def other():
                if "S1" in scene.moved.faces:
                    scene.way = scene.way * 0.9
                return cards()

            scene.moved.cards = other

        self.seeds = (2,)
        self.assertEqual(self.judged(lift), {"wrong"})


class Decks(unittest.TestCase):
    def test_random_decks(self):
        # 54 and on: all is apart, but the mean gap of a node covered in part is below 0.
        for seed in (*range(1, 10), 54, 87, 90, 96, 132):
            scene, outcome, words = outer.judge_seed(seed, OPTIONS)
            with self.subTest(seed=seed, family=scene.family, bodies=scene.words):
                self.assertEqual(outcome, "right", words)


if __name__ == "__main__":
    unittest.main()
