"""Bodies solved for by iteration beside bodies with a factor."""

import os
import unittest

import numpy as np
from launching import PROGRAM, Run, forces, launch, with_card

__all__ = ["AUTO", "ITERATIVE", "LONG", "NOT_SOLVED", "WRONG_INPUT", "Agreement"]

AUTO = {"solver": "AUTO", "local": "AUTO", "tolerance": 1e-11}
LIMIT = 1e-8
WRONG_INPUT, NOT_SOLVED = 1, 2
LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")
ITERATIVE = "*BODY SOLVER, TYPE=ITERATIVE"


class Agreement(unittest.TestCase):
    def agree(self, deck, *, most=None, ranks=1, **overrides):
        """Both solvers give the same forces, certified; `most` iterations an increment."""
        command = launch(ranks) if ranks > 1 else (PROGRAM,)
        run = Run(with_card(deck, ITERATIVE), name="iterative", command=command, **overrides)
        self.assertEqual(run.status, 0, run.errors)
        factor = Run(with_card(deck, "*BODY SOLVER, TYPE=FACTOR"), name="factor", **overrides)
        self.assertEqual(factor.status, 0, factor.errors)
        expected, found = forces(factor), forces(run)
        self.assertEqual(expected.keys(), found.keys())
        pressed = [name for name in expected if np.any(expected[name])]
        self.assertTrue(any(name.endswith("/reaction") for name in pressed))
        for name in pressed:
            largest = abs(expected[name]).max()
            np.testing.assert_allclose(
                found[name], expected[name], rtol=0, atol=LIMIT * largest, err_msg=name
            )
        with run.result() as result:
            self.assertTrue(np.all(result.history("certified") == 1))
            counters = result.counters
        self.assertGreater(counters["body_iterations"], 0)
        self.assertEqual(counters["factorisations"], 0)
        if most is not None:
            self.assertLessEqual(counters["compliance_products"], most * counters["increments"])
        with factor.result() as result:
            self.assertEqual(result.counters["body_iterations"], 0)
