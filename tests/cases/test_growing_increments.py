"""Increments that grow: without DIRECT the first number of *STATIC is a guess."""

import unittest

import numpy as np
from program import Run

HEAD = """*BLOCK, NAME=B, NX=3, NY=3, NZ=3
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*OBSTACLE, NAME=G, TYPE={obstacle}
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
"""
STEPS = """*STEP{nlgeom}
*STATIC
{first}, 1.{rest}
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, {press}
*END STEP
*STEP
*STATIC
{first}, 1.{rest}
*BOUNDARY
B-ZMAX, 1, 1, {push}
*END STEP
"""
PLANE = "PLANE\n0., 0., 0., 0., 0., 1."
BALL = "SPHERE\n0.5, 0.4, -3., 3."


def deck(first, obstacle=PLANE, nlgeom="", press=-0.02, push=0.03, rest=""):
    """Return a block that is pressed on an obstacle, then pushed along."""
    steps = STEPS.format(first=first, nlgeom=nlgeom, press=press, push=push, rest=rest)
    return HEAD.format(obstacle=obstacle) + steps


class GrowingIncrements(unittest.TestCase):
    """What they leave as it is, and where they end."""

    def test_they_end_where_amplitudes_turn(self):
        """Friction remembers the way there and back, and beyond a jump, as with DIRECT."""
        jump = "0., 0., 0.5, 0.2, 0.50005, 1., 1., 1."
        for name, points in (
            ("there and back", "0., 0., 0.5, 1., 1., 0."),
            ("beside an end", "0., 0., 0.499999, 1., 1., 0."),
            ("jump", jump),
            ("jump at once", jump.replace("0.50005", "0.500001")),
            ("jump back", "0., 0., 0.5, 1., 0.500001, 0., 1., 1."),
        ):
            scene = f"*AMPLITUDE, NAME=A\n{points}\n" + HEAD.format(obstacle=PLANE)
            step = "*STEP\n*STATIC{}\n0.01, 1.\n*BOUNDARY\nB-ZMAX, 2, 2\nB-ZMAX, 3, 3, -0.02\n"
            step += "*BOUNDARY, AMPLITUDE=A\nB-ZMAX, 1, 1, 0.03\n*END STEP\n"
            ends = []
            for keeps in ("", ", DIRECT"):
                run = Run(scene + step.format(keeps), name="deck")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    ends.append(result.pairs[0].resultant[-1])
                    told = result.history("error/load_steps")
                    if not keeps:
                        self.assertTrue(np.isclose(result.history("time"), 0.5, atol=2e-5).any())
                        self.assertLess(result.finished, 70)
            with self.subTest(scene=name):
                change = np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1])
                self.assertLess(change, 0.01 if "jump" in name else 1e-4 + 4 * told[-1])

    def test_first_numbers_agree(self):
        """Forces at the ends of steps with 0.01 and with 1 differ by the told error at most, and by
        four times that of load steps: of one increment that has been seen to tell a third."""
        finite = ", NLGEOM"
        for name, values in (
            ("block", {}),
            ("sticking", {"push": 0.003}),
            ("ball", {"obstacle": BALL, "press": -0.05}),
            ("finite", {"nlgeom": finite, "press": -0.1, "push": 0.05}),
            ("finite ball", {"nlgeom": finite, "obstacle": BALL, "press": -0.1}),
        ):
            with self.subTest(scene=name):
                ends = []
                for first in (0.01, 1):
                    run = Run(deck(first, **values), name="deck")
                    self.assertEqual(run.status, 0, run.errors)
                    with run.result() as result:
                        rows = result.step_ends
                        ends.append((
                            result.pairs["B-ZMIN:G"].resultant[rows],
                            result.history("error/load_steps")[rows],
                            result.history("error/mesh")[rows], result.finished,
                        ))  # fmt: skip
                    self.assertEqual("in place of 100" in run.output, first < 1)
                (fine, small, _, many), (coarse, large, mesh, few) = ends
                self.assertLess(many, 60)
                self.assertLess(few, 20)
                scale = np.linalg.norm(coarse, axis=1)
                change = np.linalg.norm(fine - coarse, axis=1) / scale
                # Contact is solved to its tolerance.
                told = 4 * (small + large) + 1e-6
                self.assertTrue((change <= told).all(), (change, told))
                self.assertTrue((change <= large + mesh).all(), (change, large, mesh))

    def test_what_is_named_stays(self):
        """Increments end at what FREQUENCY names and where an amplitude bends."""
        text = deck(0.01).replace("*END STEP", "*NODE FILE, FREQUENCY=30\nU\n*END STEP")
        text = text.replace(
            "*STEP", "*AMPLITUDE, NAME=A\n0., 0., 0.375, 1., 1., 0.2\n*STEP", 1
        ).replace("*BOUNDARY\nB-ZMAX, 1, 1", "*BOUNDARY, AMPLITUDE=A\nB-ZMAX, 1, 1")
        run = Run(text, name="deck")
        with run.result() as result:
            time = result.history("time")
            written = time[result.field_rows]
        np.testing.assert_allclose(written, [0.3, 0.6, 0.9, 1.0, 1.3, 1.6, 1.9, 2.0])
        self.assertLess(abs(time - 1.375).min(), 1e-9)
        self.assertLess(len(time), 80)
        # Behind the bend they begin anew.
        np.testing.assert_allclose(time[time > 1.376][0], 1.38)

    def test_a_largest_increment(self):
        """The fourth number bounds what increments grow to, and the first one."""
        for first, largest, n in ((0.01, 0.01, 100), (0.01, 0.03, 51), (0.5, 0.02, 50)):
            with self.subTest(first=first, largest=largest):
                run = Run(deck(first, rest=f", 1e-5, {largest}"), name="deck")
                self.assertIn("the smallest increment of *STATIC is ignored", run.output)
                with run.result() as result:
                    self.assertEqual((result.history("step") == 1).sum(), n)

    def test_nothing_to_compare_with(self):
        """Where errors are not estimated, and with DIRECT, increments stay as they are."""
        quiet = deck(0.02).replace("*STEP", "*ACCURACY, ESTIMATE=NO\n*STEP", 1)
        for text in (quiet, deck(0.02).replace("*STATIC", "*STATIC, DIRECT")):
            with Run(text, name="deck").result() as result:
                self.assertEqual(result.finished, 100)

    def test_a_continued_run(self):
        """A run that is stopped in the middle of a size goes on as if it had not been."""
        whole = Run(deck(0.01), name="deck")
        again = Run(deck(0.01), "--continue", name="deck", ended_at=("1", "5"))
        self.assertIn("continue", again.output)
        with whole.result() as one, again.result() as other:
            for name in ("time", "error/load_steps", "energy/strain"):
                np.testing.assert_array_equal(one.history(name), other.history(name))
            for first, second in zip(one.pairs.values(), other.pairs.values(), strict=True):
                np.testing.assert_array_equal(first.reaction, second.reaction)


if __name__ == "__main__":
    unittest.main()
