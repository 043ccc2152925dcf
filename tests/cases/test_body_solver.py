"""A deck that asks for an iterative solver in a build that has none."""

import unittest

from program import INPUT, Run


class NoIterativeSolver(unittest.TestCase):
    def test_says_how_to_build_one(self):
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        deck = deck.replace("*STEP", "*BODY SOLVER, TYPE=ITERATIVE\n*STEP", 1)
        run = Run(deck, name="block", solver="AUTO", local="AUTO")
        self.assertEqual(run.status, 1, run.errors)
        self.assertIn("this build has no iterative solver", run.errors)
        self.assertIn("scripts/run --iterative", run.errors)
        self.assertFalse(run.file.exists())

    def test_a_factor_asked_for_is_the_one_chosen_anyway(self):
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        asked = Run(deck.replace("*STEP", "*BODY SOLVER, TYPE=FACTOR\n*STEP", 1), name="asked")
        plain = Run(deck, name="plain")
        self.assertEqual((asked.status, plain.status), (0, 0), asked.errors)
        with asked.result() as one, plain.result() as other:
            self.assertTrue((one.pairs[0].reaction[()] == other.pairs[0].reaction[()]).all())
            self.assertEqual(one.counters["body_iterations"], 0)


if __name__ == "__main__":
    unittest.main()
