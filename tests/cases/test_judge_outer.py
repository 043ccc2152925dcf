"""Random bodies with all outer faces as surfaces, and their judge on changed decks first."""

import argparse
import sys
import unittest
from unittest import mock

import numpy as np
from program import PROGRAM, SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

import outer

OPTIONS = argparse.Namespace(program=PROGRAM, limit=60.0, keep=None, general=False)


class Judge(unittest.TestCase):
    def test_distances_by_hand(self):
        cube = outer.CORNERS.astype(float)
        for shift, wanted in (((3, 0, 0), 2), ((2, 2, 2), np.sqrt(3)), ((0.5, -1.25, 0), 0.25),
                              ((0.5, 0.5, 0.5), 0)):  # fmt: skip
            self.assertAlmostEqual(outer.distance(cube, cube + shift), wanted, delta=1e-9)

    def test_a_force_between_what_is_apart_is_found(self):
        made = outer.Scene

        def pushed(seed, general):
            scene = made(seed, general)
            scene.way = scene.way * 8
            return scene

        with mock.patch.object(outer, "Scene", pushed):
            found = (outer.judge_seed(seed, OPTIONS)[1] for seed in range(3, 28, 3))
            self.assertIn("wrong", found)

    def test_another_twin_is_found(self):
        made = outer.as_twin

        def pushed_less(scene):
            twin = made(scene)
            twin.way = twin.way * 0.9
            return twin

        with mock.patch.object(outer, "as_twin", pushed_less):
            self.assertEqual(outer.judge_seed(2, OPTIONS)[1], "wrong")


class Decks(unittest.TestCase):
    def test_random_decks(self):
        # 54 and on: all is apart, but the mean gap of a node covered in part is below 0. 147: the
        # rim of a plate, past which a channel's foot is seen along a strip of rounding. 71225: a
        # coarse mesh, on which the twin is farther from both when they are refined. 70: a master of
        # second order with two sides.
        for seed in (*range(1, 10), 54, 70, 87, 90, 96, 132, 147, 71225):
            scene, outcome, words = outer.judge_seed(seed, OPTIONS)
            with self.subTest(seed=seed, family=scene.family, bodies=scene.words):
                self.assertEqual(outcome, "right", words)

    def test_general_contact(self):
        """22: apart, but mean gaps are below 0, by which no node may be moved."""
        options = argparse.Namespace(**{**vars(OPTIONS), "general": True})
        for seed in (3, 5, 13, 22):
            scene, outcome, words = outer.judge_seed(seed, options)
            with self.subTest(seed=seed, family=scene.family, bodies=scene.words):
                self.assertEqual(outcome, "right", words)


if __name__ == "__main__":
    unittest.main()
