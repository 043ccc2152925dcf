"""Scenes that are their own mirror images: what the plan says, and half of them by --symmetry."""

import unittest

import numpy as np
from program import INPUT, Run
from test_as_rigid import deck, deck_of_facets

BALL = """*NODE
9000, 0., 0., 5.
*BLOCK, NAME=B, NX={nx}, NY=4, NZ=3
-1., -1., -1.,  2., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=SPHERE, REF NODE=9000
{x}, 0., 4.,  4.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
B-ZMAX, O
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP{nlgeom}
*STATIC
0.5, 1.
*BOUNDARY
B-ZMIN, 1, 3
9000, 1, 2
*CLOAD
9000, 3, -20.
B-ZMAX, 3, -0.1
{more}*DSLOAD
B-XMIN, P, 3.
B-XMAX, P, 3.
*END STEP
"""


def ball(nx=4, x=0.0, nlgeom="", more=""):
    return BALL.format(nx=nx, x=x, nlgeom=nlgeom, more=more)


class Symmetry(unittest.TestCase):
    def run_deck(self, text, *options, status=0, **settings):
        name = None if hasattr(text, "exists") else "scene"
        run = Run(text, *options, name=name, **settings)
        self.assertEqual(run.status, status, run.errors + run.output)
        return run

    def compare(self, text, pair, parts, *options, **settings):
        """Hold the part against the whole: displacements, and forces as many times."""
        whole = self.run_deck(text, *options, **settings)
        part = self.run_deck(text, *options, "--symmetry", **settings)
        with whole.result() as a, part.result() as b:
            self.assertTrue(b.history("certified").all())
            self.assertIn("--symmetry", b.run_text("overrides"))
            ids = [r.file["VTKHDF/PointData/node_id"][:] for r in (a, b)]
            self.assertLess(len(ids[1]), len(ids[0]))
            rows = np.searchsorted(ids[0], ids[1])
            np.testing.assert_array_equal(ids[0][rows], ids[1])
            u = [r.field("displacement") for r in (a, b)]
            # At the tool's edges two rows of a face are much alike: tolerances leave them 4e-7.
            np.testing.assert_allclose(u[0][rows], u[1], rtol=0, atol=1e-6 * np.abs(u[0]).max())
            force = [r.pairs[pair].resultant for r in (a, b)]
            across = np.abs(force[0]).max(axis=0) > 1e-6 * np.abs(force[0]).max()
            np.testing.assert_allclose(force[0][:, across], parts * force[1][:, across], rtol=0,
                                       atol=1e-6 * np.abs(force[0]).max())
            np.testing.assert_allclose(a.history("energy/strain"),
                                       parts * b.history("energy/strain"), rtol=1e-6)
        return part

    def test_half_of_the_block(self):
        part = self.compare(INPUT / "block.inp", "BODY-ZMIN:GROUND", 2, n=4, theta=0)
        self.assertIn("half of the scene is run and written, before y = 0.5", part.output)

    def test_a_quarter_below_a_ball_under_force(self):
        # Forces on nodes of the planes, on the ball, and pressures on faces that are cut.
        part = self.compare(ball(), "B-ZMAX:O", 4)
        self.assertIn("quarter of the scene is run and written, before x = 0 and y = 0",
                      part.output)

    def test_half_of_two_bodies_and_of_facets(self):
        for text, options in ((deck(), ()), (deck(), ("--as-rigid", "TOOL")),
                              (deck_of_facets(), ())):
            self.compare(text, "PAD-ZMAX:TOOL-ZMIN", 2, *options)

    def planes(self, text, **settings):
        run = self.run_deck(text, "--plan", **settings)
        lines = [line for line in run.output.splitlines() if line.startswith("symmetry")]
        return lines[0].split("about ")[1].split(":")[0] if lines else ""

    def test_the_plan_says_about_which_planes(self):
        self.assertEqual(self.planes(INPUT / "block.inp", n=4, theta=0), "y = 0.5")
        self.assertEqual(self.planes(INPUT / "block.inp", n=4, theta=90), "x = 0.5")
        self.assertEqual(self.planes(ball()), "x = 0 and y = 0")
        self.assertEqual(self.planes(deck()), "y = 1")

    def test_what_is_not_symmetric_has_no_plane(self):
        one = "*ELSET, ELSET=ONE\n1\n*MATERIAL, NAME=N\n*ELASTIC\n999., 0.3\n"
        other = ball().replace("*SOLID SECTION, ELSET=B,", one + "*ELSET, ELSET=REST, GENERATE\n"
                               "2, 48\n*SOLID SECTION, ELSET=ONE, MATERIAL=N\n"
                               "*SOLID SECTION, ELSET=REST,")
        self.assertEqual(self.planes(other), "")
        self.assertEqual(self.planes(INPUT / "block.inp", n=4, theta=60), "")
        # Planes that cut elements.
        self.assertEqual(self.planes(INPUT / "block.inp", n=5, theta=0), "")
        self.assertEqual(self.planes(ball(nx=5)), "y = 0")
        # A ball, a force, a support and a pressure on one side.
        self.assertEqual(self.planes(ball(x=1e-6)), "y = 0")
        self.assertEqual(self.planes(ball(more="B-XMIN, 3, -0.1\n")), "y = 0")
        self.assertEqual(self.planes(ball().replace("9000, 1, 2", "9000, 1, 2\nB-YMIN, 1, 1")),
                         "x = 0")
        self.assertEqual(self.planes(ball().replace("B-XMAX, P, 3.", "B-XMAX, P, 3.001")), "y = 0")
        # A slave surface on one side.
        self.assertEqual(self.planes(ball().replace("*SURFACE INTER", "*SURFACE, NAME=S\n33, S2\n"
                                                    "34, S2\n*SURFACE INTER").replace(
                                                        "B-ZMAX, O", "S, O")), "")

    def test_without_a_plane_it_is_refused(self):
        run = self.run_deck(INPUT / "block.inp", "--symmetry", status=1, n=4, theta=60)
        self.assertIn("--symmetry: mesh, supports, loads", run.errors)

    def test_finite_strain_says_what_it_hides(self):
        run = self.run_deck(ball(nlgeom=", NLGEOM"), "--symmetry")
        self.assertIn("buckling that is not symmetric about x = 0 and y = 0 is not seen",
                      run.output)
        self.compare(ball(nlgeom=", NLGEOM"), "B-ZMAX:O", 4)


if __name__ == "__main__":
    unittest.main()
