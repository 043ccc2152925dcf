"""Whatever the arithmetic, the certificate is that of double precision; or the run says why not."""

import os
import unittest

import numpy as np
from program import INPUT, Run

CHOICES = (
    "FACTOR=SINGLE",
    "COMPLIANCE=SINGLE",
    "FACTOR=SINGLE, COMPLIANCE=SINGLE",
    "BLOCK LOW RANK=1e-4",
    "FACTOR=SINGLE, BLOCK LOW RANK=1e-3, COMPLIANCE=SINGLE",
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
        """All choices give double precision's forces, gaps and displacements, certified."""
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

    def test_block(self):
        for n in (4, 8):
            for tolerance in (1e-8, 1e-10):
                self.agree("block", tolerance, n=n, steps=10, **AUTO)

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
        self.agree("block", 1e-10, choices=(card,), n=16, steps=5, **AUTO)
        runs = [solve("block", card, n=16, steps=5, **AUTO) for _ in range(2)]
        full = solve("block", "", "--plan", n=16, steps=5, **AUTO)
        self.assertIn("million entries", full.output)
        with runs[0].result() as one, runs[1].result() as other:
            self.assertLess(one.counters["factor_entries"], 7.2e6)
            self.assertGreater(one.counters["unrefined_imbalance"], 1e-9)
            np.testing.assert_array_equal(one.pairs[0].reaction, other.pairs[0].reaction)

    def test_what_single_does_not_hold_is_refused(self):
        # At 0.499999999 rounding to single precision makes the stiffness indefinite; before that
        # corrections gain nothing. At which of these the run ends is a matter of how the kernels
        # round; double precision solves both with four bricks along an edge.
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
        run = solve("block", "FACTOR=SINGLE, BLOCK LOW RANK=1e-3, COMPLIANCE=SINGLE")
        self.assertRegex(
            run.output,
            r"factorisations .*LDL\^T, single precision, block low rank 0.001, in core, refined",
        )
        self.assertRegex(
            run.output,
            r"accuracy +factor in single precision, block low rank 0.001: forces balance to "
            r"\S+ as solved, to \S+ as refined",
        )
        self.assertRegex(run.output, r"compliance .*single precision")
        plain = solve("block", "")
        self.assertRegex(plain.output, r"factorisations .*LDL\^T, double precision, in core\n")
        self.assertNotRegex(plain.output, r"single precision")


if __name__ == "__main__":
    unittest.main()
