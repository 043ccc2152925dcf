"""Products of the compliance and inexact factors at finite strain give the same forces."""

import unittest

import numpy as np
from program import Run

HEAD = """\
*PARAMETER
tangent = KEPT
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
192.3, 0.0024
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8, NX=3, NY=2, NZ=2
0., 0., 0., 1.2, 1., 1.
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*BODY SOLVER, TANGENT=<tangent>
"""

# Pressed on a plane and pushed; before a second plane, under force; before another block.
ON_PLANE = """\
*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
"""
UNDER_FORCE = """\
*NODE
9000, 0.6, 0.5, 1.
*OBSTACLE, NAME=T, TYPE=PLANE, REF NODE=9000
0., 0., 1., 0., 0., -1.
*CONTACT PAIR, INTERACTION=I
B-ZMAX, T
"""
ON_BLOCK = """\
*BLOCK, NAME=T, ELSET=T, TYPE=C3D8, NX=2, NY=2, NZ=1
0.2, 0.2, 1., 0.8, 0.8, 1.4
*SOLID SECTION, ELSET=T, MATERIAL=M
*CONTACT PAIR, INTERACTION=I
T-ZMIN, B-ZMAX
"""
STEP = """\
*STEP{nlgeom}
*STATIC
0.25, 1.
*BOUNDARY
{lines}*END STEP
"""


def steps(first, second):
    """Return two steps of these lines."""
    return STEP.format(nlgeom=", NLGEOM", lines=first) + STEP.format(nlgeom="", lines=second)


SCENES = {
    "plane": HEAD + ON_PLANE + steps("B-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.2\n", "B-ZMAX, 1, 1, 0.2\n"),
    "free": HEAD
    + ON_PLANE
    + UNDER_FORCE
    + steps("9000, 1, 2\n9000, 4, 6\n*CLOAD\n9000, 3, -150.\n", "9000, 1, 1, 0.05\n"),
    "blocks": HEAD
    + ON_BLOCK
    + steps("B-ZMIN, 1, 3\nT-ZMAX, 1, 2\nT-ZMAX, 3, 3, -0.2\n", "T-ZMAX, 1, 1, 0.1\n"),
}
PRODUCTS = "*CONTACT SOLVER, COMPLIANCE=PRODUCTS\n"
OTHERS = (
    "*PRECISION, FACTOR=SINGLE\n",
    "*PRECISION, BLOCK LOW RANK=1e-6\n",
)


def forces(text, **overrides):
    """Return the forces of the last pair at all increments, and the iterations."""
    run = Run(text, "--quiet", name="scene", **overrides)
    assert run.status == 0, run.errors
    with run.result() as result:
        pair = list(result.pairs.values())[-1]
        return pair.resultant[:], int(result.history("newton_raphson_iterations").sum())


class SameForces(unittest.TestCase):
    """The tolerance of the decks is 1e-8."""

    def test_kept_tangent(self):
        for name, text in SCENES.items():
            expected, iterations = forces(text)
            for variant in (PRODUCTS, *OTHERS):
                with self.subTest(scene=name, variant=variant):
                    found, n = forces(text.replace("*STEP", variant + "*STEP", 1))
                    np.testing.assert_allclose(
                        found, expected, rtol=0, atol=1e-7 * abs(expected).max()
                    )
                    self.assertLessEqual(n, 1.1 * iterations)

    def test_tangent_of_each_iteration(self):
        text = SCENES["plane"].replace("-0.2", "-0.1")
        expected, _ = forces(text, tangent="NEWTON")
        for variant in (PRODUCTS, *OTHERS):
            found, _ = forces(text.replace("*STEP", variant + "*STEP", 1), tangent="NEWTON")
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * abs(expected).max())


if __name__ == "__main__":
    unittest.main()
