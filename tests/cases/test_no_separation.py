"""Surfaces without separation: what has touched stays closed, may pull, and has no friction then.

Where the floor is smooth and touched from the beginning, that is a roller support: every load has
the solution of the linear problem with the face held along its normal.
"""

import unittest

import numpy as np
from boxes import DRY, FLOOR, SOFT, Box, on_corner
from program import Run

BAR = """*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0.01, 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, NO SEPARATION
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
"""
DRY_CLOSED = DRY + "*SURFACE BEHAVIOR, NO SEPARATION\n"
METHODS = [""] + [
    f"*CONTACT SOLVER, {words}\n" for words in ("SOLVER=GLOBAL NEWTON", "COMPLIANCE=PRODUCTS")
] + [
    f"*CONTACT SOLVER, SOLVER=SWEEPS, FORMULATION={formulation}, LOCAL={local}\n"
    for formulation in ("BIPOTENTIAL", "PSEUDOPOTENTIAL")
    for local in ("UZAWA", "NEWTON", "NEWTON6", "EXACT")
]




def step(cards, increments=2, options=""):
    """Return a step."""
    return f"*STEP{options}\n*STATIC, DIRECT\n{1 / increments}, 1.\n{cards}*END STEP\n"


class NoSeparation(unittest.TestCase):
    def run_deck(self, deck, *options):
        run = Run(deck, *options, name="closed")
        self.assertEqual(run.status, 0, run.output + run.errors)
        return run

    def forces(self, deck, *options):
        """Return the force on the body in each increment, and the last displacements."""
        with self.run_deck(deck, *options).result() as result:
            self.assertTrue(result.certified)
            return result.pairs[0].resultant, result.field("displacement", on="nodes")

    def test_press_pull_slide_and_press(self):
        """A bar 0.01 above the floor, its top prescribed: it opens until it has touched.

        While it pulls there is no friction, so the whole bar slides along; pressed where it has
        come to it sticks, sheared by nothing.
        """
        deck = BAR
        deck += step("*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.005\n", 1)
        for way in ("3, 3, -0.02", "3, 3, 0.01", "1, 1, 0.01", "3, 3, -0.03"):
            deck += step(f"*BOUNDARY\nB-ZMAX, {way}\n")
        strains = [0, 0.0025, 0.01, -0.005, -0.02, -0.02, -0.02, 0, 0.02]
        for method in METHODS:
            with self.subTest(method):
                forces, u = self.forces(method + deck)
                np.testing.assert_allclose(forces[:, 2], np.multiply(1000, strains), atol=2e-5)
                np.testing.assert_allclose(forces[:, :2], 0, atol=2e-5)
                np.testing.assert_allclose(u[:, 0], 0.01, atol=1e-8)

    def test_it_is_a_roller_support(self):
        """A force beside the middle tips the block: half of its foot is pulled, half is pressed."""
        for kind, n in (("C3D8", (4, 3, 2)), ("C3D20", (2, 2, 1)), ("C3D10", (2, 1, 1))):
            with self.subTest(kind):
                box = Box("B", n, (kind,))
                corner = box.first + int(np.argmax(box.x.sum(axis=1)))
                cards = f"*CLOAD\n{corner}, 3, 3.\n{corner}, 1, 8.\n" + on_corner("B")
                body = box.cards() + SOFT
                one = self.run_deck(body + DRY_CLOSED + FLOOR + step(cards, 1), "--nlgeom", "no")
                two = self.run_deck(body + step(cards + "B-Z0, 3\n", 1), "--nlgeom", "no")
                with one.result() as closed, two.result() as held:
                    self.assertTrue(closed.certified)
                    u, wanted = (r.field("displacement", on="nodes") for r in (closed, held))
                    np.testing.assert_allclose(u, wanted, atol=1e-9 * abs(wanted).max())
                    normal = closed.pairs[0].reaction[-1, :, 0]
                    self.assertLess(normal.min(), -0.1)
                    self.assertGreater(normal.max(), 0.1)

    def test_a_body_hangs(self):
        """Of weight 8, free but for the floor that holds it: with NLGEOM, and beside a twin below.

        The twin is pulled by 5 at its foot and hangs on the block: meshes that do not match.
        """
        body = Box("B", (2, 2, 2), ("C3D8",))
        below = Box("A", (3, 3, 1), ("C3D8",), (0, 0, -1), after=body)
        load = "*DLOAD\nB, GRAV, 8e-3, 0., 0., 1.\n" + on_corner("B")
        cards = body.cards() + SOFT + DRY_CLOSED + FLOOR
        for options in ("", ", NLGEOM"):
            with self.subTest(options):
                forces, _ = self.forces(cards + step(load, 2, options))
                np.testing.assert_allclose(forces[:, 2], [-4, -8], rtol=1e-7)
        cards = body.cards() + below.cards() + SOFT + DRY_CLOSED
        cards += "*CONTACT PAIR, INTERACTION=DRY\nA-Z1, B-Z0\n"
        load = "*DSLOAD\nA-Z0, P, -5.\n" + on_corner("B") + on_corner("A") + "B-Z1, 3\n"
        for options in ("", ", NLGEOM"):
            with self.subTest("two bodies" + options):
                forces, _ = self.forces(cards + step(load, 2, options))
                np.testing.assert_allclose(forces[:, 2], [2.5, 5], rtol=5e-3 if options else 1e-7)

    def test_it_clings_to_a_ball(self):
        """A ball that touches one node is drawn away by a force of 2, and another by 0.01."""
        body = Box("B", (2, 2, 1), ("C3D8",))
        ball = "*NODE\n900, 0.5, 0.5, -1.\n*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=900\n"
        ball += "0.5, 0.5, -1., 1.\n*CONTACT PAIR, INTERACTION=DRY\nB-Z0, BALL\n"
        cards = body.cards() + SOFT + DRY_CLOSED + ball
        held = "*BOUNDARY\nB-Z1, 1, 3\n900, 1, 2\n"
        for load, force in (("*CLOAD\n900, 3, -2.\n", 2), ("*BOUNDARY\n900, 3, 3, -0.01\n", None)):
            with self.subTest(load), self.run_deck(cards + step(held + load, 2)).result() as result:
                self.assertTrue(result.certified)
                pair = result.pairs[0]
                self.assertEqual(np.count_nonzero(pair.status[-1]), 1)
                if force:
                    np.testing.assert_allclose(pair.resultant[-1], [0, 0, -force], atol=1e-6)
                else:
                    self.assertLess(pair.resultant[-1, 2], -1)

    def test_a_file_of_points_that_may_open_is_refused(self):
        run = Run(BAR + step("*BOUNDARY\nB-ZMAX, 1, 3\n"), "--export-fclib", "1", name="closed")
        self.assertEqual(run.status, 1)
        self.assertIn("--export-fclib: points of such a file may open", run.errors)

    def test_it_is_kept_where_a_run_goes_on(self):
        """A run that was ended while the bar was pulled comes to the same bits."""
        deck = BAR
        deck += step("*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.02\n")
        deck += step("*BOUNDARY\nB-ZMAX, 3, 3, 0.01\n", 40)
        whole = self.run_deck(deck)
        parts = Run(deck, "--continue", name="closed", ended_at=("2", "3"))
        self.assertEqual(parts.status, 0, parts.errors)
        with whole.result() as one, parts.result() as two:
            np.testing.assert_array_equal(one.pairs[0].reaction[-1], two.pairs[0].reaction[-1])
            self.assertLess(one.pairs[0].resultant[-1, 2], -19)


if __name__ == "__main__":
    unittest.main()
