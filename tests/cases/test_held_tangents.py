"""Friction along directions that supports hold: what they drive slides, as Coulomb has it."""

import unittest

import numpy as np
from program import Run

SOLVERS = (
    "SOLVER=AUTO",
    "SOLVER=GLOBAL NEWTON",
    "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=EXACT",
    "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=NEWTON",
    "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=UZAWA",
    "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=NEWTON",
    "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=NEWTON6",
    "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=UZAWA",
)

BODY = """*BLOCK, NAME=B, NX=2, NY=2, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
100, 0., 0., 0.
*OBSTACLE, NAME=O, TYPE=PLANE, REF NODE=100
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*CONTACT SOLVER, {solver}, TOLERANCE=1e-10
"""

# The normal force, the friction that it allows, and a force on the lower nodes by their areas.
N, LIMIT = 10.0, 3.0
AREAS = dict(zip(range(1, 10), (1, 2, 1, 2, 4, 2, 1, 2, 1), strict=True))


def shares(force):
    """A force along y on the lower face, as data lines of *CLOAD."""
    return "\n".join(f"{node}, 2, {force * area / 16!r}" for node, area in AREAS.items())


def step(text, increments=1):
    """A *STEP that presses the cube by N and does what `text` says."""
    return (
        f"*STEP\n*STATIC, DIRECT\n{1.0 / increments}, 1.\n"
        f"*DSLOAD\nB-ZMAX, P, {N}\n{text}\n*END STEP\n"
    )


class Held(unittest.TestCase):
    def solve(self, text, solver="SOLVER=AUTO"):
        """Run a deck and return its pair's group of the result file, and all of the file."""
        run = Run(BODY.format(solver=solver) + text, name="held")
        self.assertEqual(run.status, 0, run.errors)
        self.result = run.result()
        self.addCleanup(self.result.close)
        self.run_of_result = run  # keeps the folder
        return self.result.file["contact/B-ZMIN:O"]

    def test_a_body_driven_both_ways_has_friction_against_its_way(self):
        # 3 and 4 of 5: friction 0.3*10 is shared as they are.
        drive = "*BOUNDARY\n100, 1, 3\nB, 1, 1, 0.03\nB, 2, 2, -0.04"
        for solver in SOLVERS:
            with self.subTest(solver=solver):
                pair = self.solve(step(drive), solver)
                np.testing.assert_allclose(
                    pair["resultant"][-1], [-0.6 * LIMIT, 0.8 * LIMIT, N], rtol=0.0, atol=1e-8
                )
                self.assertTrue(np.all(pair["status"][-1] == 2))
                energy = self.result.file["history/energy"]
                self.assertAlmostEqual(energy["dissipation"][-1], LIMIT * 0.05, delta=1e-9)

    def test_a_tool_that_slides_along_a_held_body_drags_it(self):
        hold = "*BOUNDARY\nB, 1, 2\n100, 2, 3\n100, 1, 1, 0.1"
        pair = self.solve(step(hold, increments=4))
        np.testing.assert_allclose(pair["resultant"][:, 0], [LIMIT * k / 4 for k in (1, 2, 3, 4)])
        # Supports of the body take what friction gives it, those of the tool its opposite.
        support = self.result.field("reaction_force", -1)
        self.assertAlmostEqual(support[:, 0].sum(), -LIMIT, delta=1e-8)
        drive = self.result.reference_nodes[100].reaction_force
        self.assertAlmostEqual(drive[-1, 0], LIMIT, delta=1e-8)
        energy = self.result.file["history/energy"]
        np.testing.assert_allclose(energy["dissipation"][-1], 0.025 * LIMIT * 2.5, rtol=1e-8)

    def test_what_is_pulled_across_its_way_creeps(self):
        # Driven along x by s, pulled along y by P < 3: the friction of 3 must have P across, so the
        # cube slips by s P/sqrt(9 - P^2) along y, however small P is.
        drive = "*BOUNDARY\n100, 1, 3\nB, 1, 1, {0}\n*CLOAD\n{1}"
        for s, pull in ((0.01, 1.8), (1e-4, 2.9), (-0.01, 1e-3)):
            across = np.sqrt(LIMIT**2 - pull**2)
            for solver in SOLVERS[:3] if (s, pull) != (0.01, 1.8) else SOLVERS:
                with self.subTest(s=s, pull=pull, solver=solver):
                    pair = self.solve(step(drive.format(s, shares(pull))), solver)
                    np.testing.assert_allclose(
                        pair["resultant"][-1],
                        [-np.sign(s) * across, -pull, N],
                        rtol=0.0,
                        atol=1e-7,
                    )
                    np.testing.assert_allclose(
                        pair["slip"][-1][:, 1], abs(s) * pull / across, rtol=1e-6
                    )

    def test_a_tool_under_force_is_held_by_what_slides_on_it(self):
        # The tool is pulled along y by 1.8 and free there; held bodies are driven along x on it.
        drive = "*BOUNDARY\n100, 1, 1\n100, 3, 3\nB, 2, 2, 0.\nB, 1, 1, 0.01\n*CLOAD\n100, 2, 1.8"
        pair = self.solve(step(drive))
        np.testing.assert_allclose(pair["resultant"][-1], [-2.4, 1.8, N], rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(pair["slip"][-1][:, 1], -0.0075, rtol=1e-6)

    def test_a_held_normal_is_told(self):
        hold = "*BOUNDARY\n100, 1, 3\nB-ZMIN, 1, 3, 0."
        self.solve(step(hold))
        words = "supports hold the normal of 9 points of B-ZMIN:O"
        self.assertIn(words, self.run_of_result.output)
        self.solve(step("*BOUNDARY\n100, 1, 3\nB, 1, 2, 0."))
        self.assertNotIn("hold the normal", self.run_of_result.output)

    def test_a_drive_of_rounding_is_none(self):
        for s in (1e-17, 0.0):
            with self.subTest(s=s):
                drive = f"*BOUNDARY\n100, 1, 3\nB, 1, 1, {s}\nB, 2, 2, 0."
                pair = self.solve(step(drive))
                np.testing.assert_array_equal(pair["reaction"][-1][:, 1:], 0.0)
                self.assertTrue(np.all(pair["status"][-1] == 1))

    def test_what_is_held_oblique_to_the_plane_is_solved(self):
        # The lower edge rests on a plane inclined by 45 degrees and is held along x. Pressed down
        # by 10, the plane answers with 10 along z; driven down the plane's normal it slides.
        deck = """*BLOCK, NAME=B, NX=1, NY=1, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*NSET, NSET=EDGE
1, 3
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0.,  1., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
EDGE, O
*BOUNDARY
B, 1, 2
B-XMAX, 3, 3
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
B, 1, 1, {0}
*CLOAD
1, 3, -5.
3, 3, -5.
*END STEP
"""
        for s in (0.0, 0.001):
            with self.subTest(s=s):
                run = Run(deck.format(s), name="oblique")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    pair = result.file["contact/EDGE:O"]
                    reaction, slip = pair["reaction"][-1], pair["slip"][-1]
                    u = result.field("displacement", -1)[[0, 2]]
                np.testing.assert_allclose(u[:, 2], -s, rtol=0.0, atol=1e-12)
                if s > 0.0:
                    np.testing.assert_allclose(np.abs(slip[:, 0]), np.sqrt(2.0) * s, rtol=1e-9)
                    np.testing.assert_allclose(
                        np.linalg.norm(reaction[:, 1:], axis=1), 0.3 * reaction[:, 0], rtol=1e-9
                    )


if __name__ == "__main__":
    unittest.main()
