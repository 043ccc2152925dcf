"""Bodies solved for by iteration beside bodies with a factor, of the program for one process."""

import functools
import os
import unittest

import numpy as np
from launching import PROGRAM, SERIAL, Run, forces, launch, with_card

__all__ = ["AUTO", "ITERATIVE", "LONG", "NOT_SOLVED", "WRONG_INPUT", "Agreement"]

AUTO = {"solver": "AUTO", "local": "AUTO", "tolerance": 1e-11}
LIMIT = 1e-8
WRONG_INPUT, NOT_SOLVED = 1, 2
LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")
ITERATIVE = "*BODY SOLVER, TYPE=ITERATIVE"


@functools.cache
def forces_by_factor(deck, settings):
    """What several tests compare with, solved once."""
    run = Run(deck, name="factor", command=(SERIAL,), **dict(settings))
    assert run.status == 0, run.errors
    with run.result() as result:
        assert result.counters["body_iterations"] == 0
    return forces(run)


class Agreement(unittest.TestCase):
    def agree(self, deck, *, most=None, ranks=1, **overrides):
        """Both solvers give the same forces, certified; `most` iterations an increment.

        Returns the run by iteration.
        """
        command = launch(ranks) if ranks > 1 else (PROGRAM,)
        run = Run(with_card(deck, ITERATIVE), name="iterative", command=command, **overrides)
        self.assertEqual(run.status, 0, run.errors)
        deck = with_card(deck, "*BODY SOLVER, TYPE=FACTOR")
        expected = forces_by_factor(deck, tuple(sorted(overrides.items())))
        found = forces(run)
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
        return run
