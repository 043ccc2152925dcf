"""Whatever the arithmetic, the certificate is that of double precision; or the run says why not."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from program import INPUT, PROGRAM, SOURCE, Result, Run

CHOICES = (
    "FACTOR=SINGLE",
    "BLOCK LOW RANK=1e-4",
    "FACTOR=SINGLE, BLOCK LOW RANK=1e-3",
    "OUT OF CORE=YES",
    "FACTOR=SINGLE, BLOCK LOW RANK=1e-3, OUT OF CORE=YES",
)
AUTO = {"solver": "AUTO", "local": "AUTO"}


def solve(deck, card, *options, **overrides):
    """Run a deck of input/ with a *PRECISION card before its first step, or as it is."""
    text = (INPUT / f"{deck}.inp").read_text()
    if card:
        text = text.replace("*STEP\n", f"*PRECISION, {card}\n*STEP\n", 1)
    return Run(text, *options, name=deck, **overrides)


class Precision(unittest.TestCase):
    def agree(self, deck, tolerance, choices=CHOICES, only_forces=False, **overrides):
        """All choices give double precision's forces, gaps and displacements, certified.

        Returns the run of the last of them.
        """
        double = solve(deck, "", tolerance=tolerance, **overrides)
        self.assertEqual(double.status, 0, double.errors)
        for card in choices:
            with self.subTest(deck=deck, tolerance=tolerance, card=card):
                run = solve(deck, card, tolerance=tolerance, **overrides)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as one, double.result() as other:
                    self.assertTrue(np.all(one.history("certified") == 1))
                    self.assertLessEqual(one.counters["imbalance"], 10 * tolerance)
                    if "FACTOR" in card:
                        self.assertGreater(one.counters["unrefined_imbalance"], 1e-9)
                    a, b = (r.pairs[0].reaction for r in (one, other))
                    np.testing.assert_allclose(a, b, rtol=0, atol=1e3 * tolerance * abs(b).max())
                    if only_forces:
                        continue
                    moves = abs(other.field("displacement", -1)).max()
                    for field in (lambda r: r.pairs[0].gap, lambda r: r.field("displacement", -1)):
                        a, b = field(one), field(other)
                        np.testing.assert_allclose(a, b, rtol=0, atol=1e3 * tolerance * moves)
        return run

    def test_block(self):
        for n, tolerance in ((4, 1e-8), (8, 1e-10)):
            self.agree("block", tolerance, n=n, steps=5, **AUTO)

    def test_block_by_sweeps(self):
        self.agree("block", 1e-10, n=4, steps=10, solver="SWEEPS", local="NEWTON")

    def test_curved_obstacle(self):
        self.agree("tool", 1e-9)

    def test_free_bodies(self):
        self.agree("rest", 1e-9)
        # At the limit of friction a body goes as far as a millionth of the forces sends it.
        self.agree("slope", 1e-9, only_forces=True)

    @unittest.skipUnless(
        os.environ.get("BIPOT_BUILD_TYPE", "Release") == "Release", "takes minutes in a Debug build"
    )
    def test_fronts_large_enough_to_compress(self):
        card = "BLOCK LOW RANK=1e-4"
        runs = [self.agree("block", 1e-10, choices=(card,), n=16, steps=5, **AUTO),
                solve("block", card, tolerance=1e-10, n=16, steps=5, **AUTO)]  # fmt: skip
        full = solve("block", "", "--plan", n=16, steps=5, **AUTO)
        self.assertIn("million entries", full.output)
        with runs[0].result() as one, runs[1].result() as other:
            self.assertLess(one.counters["factor_entries"], 7.2e6)
            self.assertGreater(one.counters["unrefined_imbalance"], 1e-9)
            np.testing.assert_array_equal(one.pairs[0].reaction, other.pairs[0].reaction)

    def test_a_body_that_nothing_presses(self):
        """What single precision leaves of forces that are next to nothing is taken out as well: no
        part of them falls while they fall with it."""
        deck = (SOURCE / "studies" / "data" / "scenes" / "again.inp").read_text()
        deck = deck.replace("*STEP\n", "*PRECISION, FACTOR=SINGLE\n*STEP\n", 1)
        run = Run(deck, name="again", steps=20)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            lifted = result.pairs[0].normal_sum == 0
            self.assertGreater(lifted.sum(), 2)
            self.assertLess(result.history("error/arithmetic").max(), 1e-8)
            self.assertGreater(result.counters["unrefined_imbalance"], 1e-9)

    def test_what_single_does_not_hold_is_refused(self):
        # At 0.499999999 rounding to single precision makes the stiffness indefinite; before that
        # corrections gain nothing. At which of these the run ends is a matter of how the kernels
        # round; double precision solves both with four elements along an edge.
        refusals = (
            r"single precision holds; \*PRECISION, FACTOR=DOUBLE holds more"
            r"|the factor of the stiffness is too far from it \(single precision\)"
            r"|the factor \(single precision\) left"
        )
        for nu, n in (("0.499999999", 4), ("0.49999999", 8), ("0.49999999", 4)):
            with self.subTest(nu=nu, n=n):
                run = solve("block", "FACTOR=SINGLE", nu=nu, n=n, **AUTO)
                self.assertEqual(run.status, 2, run.output)
                self.assertRegex(run.errors, refusals)
                if n == 4:
                    run = solve("block", "", nu=nu, n=n, **AUTO)
                    self.assertEqual(run.status, 0, run.errors)

    def test_nearly_incompressible_is_certified_or_refused(self):
        for n in (4, 8):
            run = solve("block", "FACTOR=SINGLE", nu="0.4999999", n=n, steps=5, **AUTO)
            if run.status == 0:
                with run.result() as result:
                    self.assertTrue(np.all(result.history("certified") == 1))
            else:
                self.assertEqual(run.status, 2, run.errors)
                self.assertRegex(run.errors, "FACTOR=DOUBLE|did not reach the tolerance")

    def test_the_run_tells_its_precision(self):
        run = solve("block", "FACTOR=SINGLE, BLOCK LOW RANK=1e-3", "--verbose")
        self.assertRegex(
            run.plan,
            r"factorisations .*LDL\^T, single precision, block low rank 0.001, in core, refined",
        )
        self.assertRegex(
            run.output,
            r"linear solver +single precision, block low rank 0.001: residual \S+, \S+ after "
            r"refinement",
        )
        plain = solve("block", "")
        self.assertRegex(plain.plan, r"factorisations .*LDL\^T, double precision, in core\n")
        self.assertNotRegex(plain.plan, r"single precision")


class FewIncrements(unittest.TestCase):
    """Where increments are few single precision is the plan's choice, and double where it fails."""

    # As many elements as it takes for the factor to cost more than anything else.
    DECK = """*HEADING
A block pressed on a plane
*PARAMETER
nu = 0.3
*BLOCK, NAME=BODY, ELSET=BODY, TYPE=C3D8, NX=14, NY=14, NZ=14
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=RUBBER
*ELASTIC
100., <nu>
*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, GROUND
*CONTACT SOLVER, TOLERANCE={tolerance}
*STEP
*STATIC, DIRECT
{size}, 1.
*BOUNDARY
BODY-ZMAX, 1, 2, 0.
BODY-ZMAX, 3, 3, -0.01
*END STEP
"""
    HELD = DECK.format(mu=0.3, tolerance=1e-9, size=1.0)
    ROUGH = DECK.format(mu=0.0, tolerance=2e-4, size=0.25)

    def in_double(self, text, **settings):
        text = text.replace("*STEP\n", "*PRECISION, FACTOR=DOUBLE\n*STEP\n", 1)
        run = Run(text, name="deck", **settings)
        self.assertEqual(run.status, 0, run.errors)
        self.assertNotIn("chosen ", run.plan)
        return run

    def test_they_are_solved_in_single_precision(self):
        run = Run(self.HELD, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.plan, r"chosen +single precision, in core: a share of 0\.\d+ of the")
        with run.result() as one, self.in_double(self.HELD).result() as other:
            self.assertEqual(one.run["single_factor"], 1)
            self.assertEqual(other.run["single_factor"], 0)
            self.assertTrue(np.all(one.history("certified") == 1))
            a, b = (r.pairs[0].reaction for r in (one, other))
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * abs(b).max())

    def test_more_increments_are_not(self):
        text = self.HELD.replace("1.0, 1.", "0.1, 1.")
        run = Run(text, "--plan", name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertNotIn("chosen ", run.output)

    def test_double_precision_takes_over(self):
        """What single precision does not hold is that of FACTOR=DOUBLE, to the last bit."""
        for nu in ("0.49999999", "0.499999999"):
            run = Run(self.ROUGH, name="deck", nu=nu)
            self.assertEqual(run.status, 0, run.errors)
            self.assertRegex(run.plan, r"chosen +single precision")
            self.assertIn("it is factorised in double precision from here on", run.output)
            self.assertNotIn("the plan said", run.output)
            with run.result() as one, self.in_double(self.ROUGH, nu=nu).result() as other:
                self.assertEqual(one.counters["plan_revisions"], 1)
                a, b = (r.pairs[0].reaction for r in (one, other))
                np.testing.assert_array_equal(a, b)

    def test_it_goes_on_in_a_run_that_is_continued(self):
        """Killed between its increments: the rest has the same bits."""
        whole = Run(self.ROUGH, name="deck", nu="0.49999999")
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "deck.inp").write_text(self.ROUGH)
            command = [PROGRAM, "deck.inp", "--set", "nu=0.49999999", "-o", "r.vtkhdf"]

            def run(*options, **environment):
                return subprocess.run(
                    [*command, *options], cwd=folder, capture_output=True, text=True, check=False,
                    env={**os.environ, **environment},
                )

            # With a clock by which each increment is counted by itself.
            library = Path(os.environ["BIPOT_KILL_LIBRARY"])
            clock = library.with_name("libslow_clock.so")
            watched = {"LD_PRELOAD": f"{library}:{clock}", "LOOK": "1000"}
            run(KILL_COUNT=str(Path(folder) / "changes"), **watched)
            changes = int((Path(folder) / "changes").read_text())
            run("--overwrite", KILL_AT_WRITE=str(changes * 9 // 10), **watched)
            with Result(Path(folder) / "r.vtkhdf") as killed:
                self.assertIn(killed.finished, (1, 2, 3))
            done = run("--continue")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("continued ", done.stdout)
            self.assertNotIn("from here on", done.stdout)
            with Result(Path(folder) / "r.vtkhdf") as one, whole.result() as other:
                self.assertEqual(one.finished, 4)
                a, b = (r.pairs[0].reaction for r in (one, other))
                np.testing.assert_array_equal(a, b)


if __name__ == "__main__":
    unittest.main()
