"""Load cycles: whether they have settled, and runs that stop there."""

import unittest

import numpy as np
from program import Run

# A block pressed onto a plane and pushed to and fro: its corners slip, its middle sticks.
BODY = """*BLOCK, NAME=B, NX=4, NY=2, NZ=2
0., 0., 0.,  2., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*CONTACT SOLVER, TOLERANCE=1e-10
*AMPLITUDE, NAME=A
{amplitude}
"""
PRESS = "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.02\n*END STEP\n"
SHAKE = (
    "*STEP\n*STATIC, DIRECT\n{h}, {period}\n"
    "*BOUNDARY, AMPLITUDE=A\nB-ZMAX, 1, 1, {far}\n*END STEP\n"
)
PUSH = "*STEP\n*STATIC, DIRECT\n0.5, 1.\n*BOUNDARY\nB-ZMAX, 1, 1, {far}\n*END STEP\n"


def triangle(cycles):
    """Return an amplitude of cycles over a time of 1 each: 0, 1, 0, -1, 0."""
    points = ["0., 0."]
    for k in range(cycles):
        points += [f"{k + 0.25}, 1.", f"{k + 0.75}, -1."]
    points.append(f"{cycles}., 0.")
    return ",\n".join(points).replace(",\n", "\n")


def shaking(cycles=10, far=0.003, more=""):
    return (BODY.format(amplitude=triangle(cycles)) + PRESS
            + SHAKE.format(h=0.25, period=f"{cycles}.", far=far) + more)


def steps_in_turn(cycles=6, far=0.003, more=""):
    body = BODY.format(amplitude="0., 0., 1., 1.")
    return body + PRESS + (PUSH.format(far=far) + PUSH.format(far=-far)) * cycles + more


class LoadCycles(unittest.TestCase):
    def run_deck(self, text, *options, status=0, **more):
        run = Run(text, *options, name="cycle", **more)
        self.assertEqual(run.status, status, run.errors + run.output)
        return run

    def ends(self, run):
        with run.result() as result:
            cycle, change = result.history("load_cycle"), result.history("load_cycle_change")
            rows = np.flatnonzero(cycle)
            np.testing.assert_array_equal(change[cycle == 0], -1)
            return rows, cycle[rows], change[rows], str(result.run["status"])

    def test_a_cycle_of_an_amplitude_settles_and_the_run_goes_on(self):
        run = self.run_deck(shaking())
        rows, cycle, change, status = self.ends(run)
        self.assertEqual(status, "finished")
        # The first cycle has none before it; rows count from the first step's increment.
        np.testing.assert_array_equal(rows, np.arange(8, 41, 4))
        self.assertEqual(cycle[0], 1)
        self.assertTrue((cycle[2:] == 2).all(), cycle)
        self.assertLess(change[-1], 1e-8)
        self.assertEqual(run.output.count("has settled"), 1)
        self.assertIn("--until-steady leaves out the", run.output)

    def test_until_steady_stops_there_and_the_rest_repeats_it(self):
        whole = self.run_deck(shaking())
        short = self.run_deck(shaking(), "--until-steady")
        *_, status = self.ends(short)
        self.assertEqual(status, "settled")
        self.assertRegex(short.output, r"Left out: the last \d+ increments of the deck")
        with whole.result() as a, short.result() as b:
            done = b.finished
            self.assertEqual(done, 1 + 4 * 3)
            for name in ("time", "residual", "energy/strain"):
                np.testing.assert_array_equal(a.history(name)[:done], b.history(name))
            # What was left out is what the last cycle is, and the last increment has all fields.
            np.testing.assert_allclose(
                a.field("displacement"), b.field("displacement"), rtol=0, atol=2e-11)
            forces = [r.pairs["B-ZMIN:O"].resultant for r in (a, b)]
            np.testing.assert_allclose(
                forces[0][done:].reshape(-1, 4, 3),
                np.broadcast_to(forces[1][-4:], (7, 4, 3)), rtol=0,
                atol=1e-7 * np.abs(forces[0]).max())
            self.assertGreater(b.history("error/mesh")[-1], 0)

    def test_equal_steps_in_turn_are_cycles(self):
        short = self.run_deck(steps_in_turn(), "--until-steady")
        rows, cycle, _, status = self.ends(short)
        self.assertEqual(status, "settled")
        # The first pair of steps begins from rest: cycles begin behind it, and two are compared.
        np.testing.assert_array_equal(rows, [12])
        np.testing.assert_array_equal(cycle, [2])
        with short.result() as result:
            self.assertEqual(result.finished, 13)

    def test_other_loads_that_follow_are_run(self):
        more = PUSH.format(far=0.01)
        for deck in (shaking(more=more), steps_in_turn(more=more)):
            run = self.run_deck(deck, "--until-steady")
            self.assertIn("has settled", run.output)
            self.assertIn("other loads follow", run.output)
            self.assertEqual(self.ends(run)[3], "finished")

    def test_what_is_no_cycle_is_not_compared(self):
        growing = "\n".join(f"{k / 4}, {k * (-1) ** k / 40}" for k in range(41))
        for amplitude in (growing, "0., 0.\n10., 1.", triangle(2)):
            deck = BODY.format(amplitude=amplitude) + PRESS + SHAKE.format(
                h=0.25, period="10." if amplitude != triangle(2) else "2.", far=0.003)
            run = self.run_deck(deck, "--until-steady")
            rows, *_, status = self.ends(run)
            self.assertEqual((len(rows), status), (0, "finished"))

    def test_a_ramp_beside_an_amplitude_is_no_cycle(self):
        deck = shaking().replace("*END STEP\n", "", 1).replace(
            "*BOUNDARY, AMPLITUDE=A", "*BOUNDARY\nB-ZMAX, 3, 3, -0.03\n*BOUNDARY, AMPLITUDE=A")
        deck = deck.replace("-0.02\n*STEP", "-0.02\n*END STEP\n*STEP")
        run = self.run_deck(deck, "--until-steady")
        self.assertEqual(len(self.ends(run)[0]), 0)

    def test_a_killed_run_goes_on_and_stops_at_the_same_end(self):
        plain = self.run_deck(shaking(), "--until-steady")
        again = self.run_deck(shaking(), "--until-steady", "--continue", ended_at=("2", "6"))
        with plain.result() as a, again.result() as b:
            self.assertEqual(a.finished, b.finished)
            np.testing.assert_array_equal(a.history("load_cycle"), b.history("load_cycle"))
            np.testing.assert_array_equal(a.history("load_cycle_change"),
                                          b.history("load_cycle_change"))
            np.testing.assert_array_equal(a.field("displacement"), b.field("displacement"))

    def test_the_rest_is_run_by_continuing_without_the_option(self):
        whole = self.run_deck(shaking())
        short = self.run_deck(shaking(), "--until-steady")
        refused = self.run_deck(shaking(), "--until-steady", "--continue", status=1,
                                beside={"cycle.vtkhdf": short.file})
        self.assertIn("without --until-steady, --continue goes on with it", refused.errors)
        rest = self.run_deck(shaking(), "--continue", beside={"cycle.vtkhdf": short.file})
        self.assertEqual(self.ends(rest)[3], "finished")
        with whole.result() as a, rest.result() as b:
            self.assertEqual(a.finished, b.finished)
            np.testing.assert_array_equal(a.history("energy/dissipation"),
                                          b.history("energy/dissipation"))
            np.testing.assert_array_equal(a.history("load_cycle"), b.history("load_cycle"))
            np.testing.assert_array_equal(a.field("displacement"), b.field("displacement"))

    def test_a_mesh_that_is_chosen_is_refused(self):
        run = self.run_deck(shaking(), "--until-steady", "--accuracy", "0.1", status=1)
        self.assertIn("--until-steady takes a mesh that is kept", run.errors)
        run = self.run_deck(shaking(3), "--until-steady", "--accuracy", "0.9", "--refine", "0",
                            status=0)


if __name__ == "__main__":
    unittest.main()
