"""Contact by products with the compliance finds the forces that contact with a dense one finds."""

import unittest

import numpy as np
from program import INPUT, PROGRAM, Run

from studies.deck_cards import block, pair

HEAD = """*HEADING
A plate of three layers before an obstacle
{blocks}{obstacle}*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I
{surfaces}
*CONTACT SOLVER, COMPLIANCE={compliance}, TOLERANCE={tolerance}{options}
*PRECISION, {precision}
"""
PLANE = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n"
SPHERE = "*OBSTACLE, NAME=FLOOR, TYPE=SPHERE\n0.5, 0.5, -1.,  1.\n"
# Pressed by its upper side, then pushed along x.
PRESS = """*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
A-ZMAX, 1, 2, 0.
A-ZMAX, 3, 3, -2e-4
*END STEP
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
A-ZMAX, 1, 1, 0.0004
*END STEP
"""
# The same, but contact alone holds it along z.
LOAD = """*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
A-ZMAX, 1, 2, 0.
*DSLOAD
A-ZMAX, P, 100.
*END STEP
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
A-ZMAX, 1, 1, 0.0004
*END STEP
"""


def plate(name, n, low=0.0, young=210000.0, x=0.0, length=1.0):
    """Return the cards of a plate of n x n x 3 elements on the height `low`."""
    return block(name, (n, n, 3), (x, 0.0, low), (length, 1.0, 0.1), young)


def deck(compliance, **changes):
    """Return the deck of a plate, its steps PRESS if nothing else is said."""
    words = {
        "blocks": plate("A", 8),
        "obstacle": PLANE,
        "surfaces": "A-ZMIN, FLOOR",
        "mu": 0.3,
        "tolerance": "1e-9",
        "options": "",
        "precision": "OUT OF CORE=NO",
        "steps": PRESS,
        **changes,
    }
    return HEAD.format(compliance=compliance, **words) + words["steps"]


class Products(unittest.TestCase):
    def solved(self, compliance, *options, **changes):
        """Run such a deck, which must be solved and certified."""
        run = Run(deck(compliance, **changes), *options, name="plate")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertTrue(np.all(result.history("certified") == 1))
        return run

    def agree(self, limit=1e-7, **changes):
        """The forces of all increments are the same with W and without; without, none is formed."""
        runs = [self.solved(word, **changes) for word in ("DENSE", "PRODUCTS")]
        with runs[0].result() as dense, runs[1].result() as products:
            for a, b in zip(dense.pairs.values(), products.pairs.values(), strict=True):
                largest = abs(a.reaction).max()
                self.assertGreater(largest, 0.0)
                np.testing.assert_allclose(b.reaction, a.reaction, rtol=0, atol=limit * largest)
            a, b = (r.field("displacement", -1) for r in (dense, products))
            np.testing.assert_allclose(b, a, rtol=0, atol=limit * abs(a).max())
            self.assertGreater(dense.counters["contact_matrix_bytes"], 0)
            self.assertEqual(products.counters["contact_matrix_bytes"], 0)
            self.assertEqual(products.counters["compliance_bytes"], 0)
            # Every product is a solution.
            self.assertGreaterEqual(
                products.counters["solutions"], products.counters["compliance_products"]
            )
        self.assertNotIn("the plan said", runs[1].output + runs[1].errors)
        return runs[1]

    def test_plate(self):
        for n in (8, 12):
            self.agree(blocks=plate("A", n))

    def test_plate_without_friction(self):
        self.agree(mu=0.0)

    def test_free_plate(self):
        self.agree(steps=LOAD)

    def test_thin_body_on_a_sphere(self):
        steps = PRESS.replace("-2e-4", "-2e-3")
        for mu in (0.0, 0.3):
            self.agree(obstacle=SPHERE, mu=mu, steps=steps)

    def test_two_plates(self):
        held = "*BOUNDARY\nB-ZMIN, 1, 3, 0.\n"
        self.agree(
            blocks=plate("A", 8) + plate("B", 6, -0.1),
            obstacle="",
            surfaces="A-ZMIN, B-ZMAX",
            steps=held + PRESS,
        )

    def test_plate_between_plane_and_plate(self):
        self.agree(
            blocks=plate("A", 5, 0.1) + plate("B", 4),
            surfaces="A-ZMIN, B-ZMAX",
            options="\n" + pair("B-ZMIN, FLOOR", 0.2, number=2).rstrip(),
        )

    def test_points_that_hang_on_a_tied_plate(self):
        # Only one of both is before the plane, or reactions along the seam would not be unique.
        self.agree(
            blocks=plate("A", 6) + plate("B", 4, x=1.0, length=0.5),
            surfaces="B-ZMIN, FLOOR",
            options="\n*TIE, NAME=SEAM\nB-XMIN, A-XMAX",
        )

    def test_inexact_factors(self):
        for precision in ("FACTOR=SINGLE", "FACTOR=SINGLE, BLOCK LOW RANK=1e-4"):
            with self.subTest(precision=precision):
                self.agree(precision=precision)
        steps = PRESS.replace("-2e-4", "-2e-3")
        self.agree(precision="FACTOR=SINGLE", obstacle=SPHERE, steps=steps)


    def test_it_is_formed_where_newton_fails(self):
        """A cube that friction alone holds on a slope needs the other solvers, which read W."""
        text = (INPUT / "slope.inp").read_text()
        runs = []
        for word in ("DENSE", "PRODUCTS"):
            card = f"*CONTACT SOLVER, COMPLIANCE={word},"
            runs.append(Run(text.replace("*CONTACT SOLVER,", card), name="slope", n=4))
            self.assertEqual(runs[-1].status, 0, runs[-1].errors)
        with runs[0].result() as dense, runs[1].result() as products:
            self.assertGreater(products.counters["solver_fallbacks"], 0)
            a, b = (r.pairs[0].reaction for r in (dense, products))
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-7 * abs(a).max())

    def test_sweeps_form_it(self):
        """Sweeps read W by rows: it is formed, whatever the deck says."""
        run = self.solved("PRODUCTS", options=", SOLVER=SWEEPS")
        with run.result() as result:
            self.assertGreater(result.counters["contact_matrix_bytes"], 0)
        self.assertIn("dense, double precision", run.plan)

    def test_files_hold_it(self):
        """A contact problem that is written to a file has its W, and is solved like the deck."""
        run = self.solved("PRODUCTS", "--export-fclib", "2")
        with run.result() as result:
            self.assertGreater(result.counters["contact_matrix_bytes"], 0)
        problem = Run(next(run.folder.glob("*.fclib.hdf5")))
        self.assertEqual(problem.status, 0, problem.errors)

    def test_what_does_not_fit_is_refused(self):
        """Where memory has no room for W, products run, and what needs W says what it takes."""
        big = {"blocks": plate("A", 56), "steps": PRESS[: PRESS.rindex("*STEP")]}

        def limited(compliance, options=""):
            """Plan such a deck with 900 MB of addresses."""
            return Run(
                deck(compliance, options=options, **big),
                "--plan",
                name="plate",
                command=("/bin/sh", "-c", 'ulimit -v 900000; exec "$0" "$@"', PROGRAM),
            )

        self.assertEqual(limited("PRODUCTS").status, 0)
        automatic = limited("AUTO")
        self.assertEqual(automatic.status, 0, automatic.errors)
        self.assertIn("not formed", automatic.output)
        for refused in (limited("DENSE"), limited("PRODUCTS", ", SOLVER=SWEEPS")):
            self.assertEqual(refused.status, 3)
            self.assertRegex(refused.errors, "the run needs (about|more than) .* of memory")

    def test_auto_chooses_by_the_figures(self):
        """A cube has its W, a plate of many contact points and few increments has not."""
        cube = Run(deck("AUTO", blocks=block("A", 8, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 210000.0)),
                   "--plan", name="plate")
        self.assertEqual(cube.status, 0, cube.errors)
        self.assertIn("dense, double precision", cube.output)
        thin = Run(deck("AUTO", blocks=plate("A", 48)), "--plan", name="plate")
        self.assertEqual(thin.status, 0, thin.errors)
        self.assertIn("not formed: each product with it is a solution", thin.output)


if __name__ == "__main__":
    unittest.main()
