"""Tied surfaces whose meshes do not match: what must hold whatever the numbers are."""

import unittest

import numpy as np
from program import Run
from two_bodies import block, deck, pair, step


def solved(case, text, *options):
    """Run a deck that must be solved; return its open result."""
    run = Run(text, *options, name="deck")
    case.assertEqual(run.status, 0, run.errors)
    result = run.result()
    result.output = run.output
    case.addCleanup(result.close)
    case.assertTrue(result.history("certified").all())
    return result


def tie(surfaces, name="GLUE", options=""):
    """Return the cards of a tie, "SLAVE, MASTER"."""
    return f"*TIE, NAME={name}{options}\n{surfaces}\n"


def displacements(result):
    """Return the nodes' displacements at the end, a row a node in the order of the deck."""
    return result.file["VTKHDF/PointData/displacement"][:].reshape(-1, len(result.file["VTKHDF/Points"]), 3)[-1]
