"""Increments end where the load path turns and where contact begins, unless DIRECT keeps them."""

import unittest

import numpy as np
from program import Run

# A cube with nu = 0 before a plane that is GAP below it; driven along x as a whole it slides.
BODY = """*BLOCK, NAME=B, NX=2, NY=2, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., {gap},  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*CONTACT SOLVER, TOLERANCE=1e-10
*AMPLITUDE, NAME=A
{amplitude}
"""

PRESS = "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nB, 1, 2\nB-ZMAX, 3, 3, -0.01\n*END STEP\n"
DRAG = "*STEP\n*STATIC{direct}\n{h}, 1.\n*BOUNDARY, AMPLITUDE=A\nB, 1, 1, 0.1\n*END STEP\n"
SLANT = (
    "*STEP\n*STATIC{direct}\n{h}, 1.\n*BOUNDARY\n"
    "B, 2, 2\nB, 1, 1, 0.02\nB-ZMAX, 3, 3, -0.02\n*END STEP\n"
)

BEAM = """*BLOCK, NAME=B, TYPE=C3D8I, NX=18, NY=6, NZ=6
0., 0., 0.,  60., 6., 4.
*MATERIAL, NAME=M
*ELASTIC
70000., 0.33
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
60., 6., {gap},  -0.2, -0.342, 0.94
*SURFACE INTERACTION, NAME=I
*FRICTION
0.
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*CONTACT SOLVER, SOLVER=AUTO, TOLERANCE=1e-8
*AMPLITUDE, NAME=A
{amplitude}
"""
LOWERED = (
    "*STEP\n*STATIC{direct}\n{h}, 1.\n*BOUNDARY\nB-XMIN, 1, 2, 0.\nB-XMIN, 3, 3, -1.7\n*END STEP\n"
)


class LoadPaths(unittest.TestCase):
    def solve(self, steps, gap=0.0, amplitude="0., 0., 1., 1.", h=1.0, direct=False, body=BODY):
        """Run the cube through `steps`; its histories are rows of `self.rows`."""
        text = body.format(gap=-gap, amplitude=amplitude)
        text += steps.format(h=h, direct=", DIRECT" if direct else "")
        self.run_of_result = run = Run(text, name="path")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        file = result.file
        self.rows = {name: result.history(name) for name in ("time", "extra", "increment")}
        self.rows["dissipation"] = result.history("energy/dissipation")
        self.rows["load_steps"] = result.history("error/load_steps")
        self.rows["resultant"] = file["contact/B-ZMIN:O/resultant"][: len(self.rows["time"])]
        self.written = result.file["VTKHDF/Steps"].attrs["NSteps"]

        def table(name):
            data = file[f"run/{name}"]
            return dict(zip(data.attrs["name"].astype(str), data[:], strict=True))

        self.counters, self.estimates = table("counters"), table("estimates")

    def test_increments_end_at_kinks(self):
        # Out to 0.1 and back to 0.05: friction 3 is against the way back, and all of the way costs.
        self.solve(PRESS + DRAG, amplitude="0., 0., 0.3, 1., 1., 0.5")
        np.testing.assert_allclose(self.rows["time"], [1.0, 1.3, 2.0], rtol=1e-9)
        np.testing.assert_array_equal(self.rows["extra"], [0, 1, 0])
        np.testing.assert_allclose(
            self.rows["resultant"], [[0, 0, 10], [-3, 0, 10], [3, 0, 10]], rtol=0, atol=1e-7
        )
        np.testing.assert_allclose(self.rows["dissipation"][-1], 3 * 0.15, rtol=1e-7)
        self.assertEqual(self.counters["increments_at_events"], 1)
        self.assertGreaterEqual(self.estimates["increments_at_events"], 1)
        self.assertEqual(self.counters["kinks_inside_increments"], 0)
        self.assertNotIn("note:", self.run_of_result.output)
        self.assertNotIn("warning", self.run_of_result.errors + self.run_of_result.output)

    def test_a_delayed_amplitude_is_one_whose_times_are_later(self):
        found = []
        for delay, amplitude in ((", TIME DELAY=0.3", "0., 0., 0.3, 1., 0.7, 0.5"),
                                 ("", "0.3, 0., 0.6, 1., 1., 0.5")):
            steps = PRESS + DRAG.replace("AMPLITUDE=A", "AMPLITUDE=A" + delay)
            self.solve(steps, amplitude=amplitude)
            found.append(self.rows)
        np.testing.assert_allclose(found[0]["time"], [1.0, 1.3, 1.6, 2.0], rtol=1e-9)
        for name in ("time", "resultant", "dissipation"):
            np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-12, atol=1e-12)

    def test_no_increment_is_shorter_than_the_smallest(self):
        # Out to 0.1, then back to 0 within less than 1/4096: one increment ends at the first kink.
        self.solve(PRESS + DRAG, amplitude="0., 0., 0.5, 1., 0.5001, 0., 1., 0.")
        np.testing.assert_allclose(self.rows["time"], [1.0, 1.5, 2.0], rtol=1e-9)
        np.testing.assert_allclose(self.rows["dissipation"][-1], 3 * 0.2, rtol=1e-7)

    def test_points_on_a_line_cut_nothing(self):
        points = ", ".join(f"{k / 10}, {k / 10}" for k in range(11))
        points = points.replace(", 0.6, 0.6", ",\n0.6, 0.6")
        self.solve(PRESS + DRAG, amplitude=points)
        np.testing.assert_allclose(self.rows["time"], [1.0, 2.0], rtol=1e-12)

    def test_direct_keeps_increments_and_tells_kinks(self):
        # Two increments: kinks at 0.3 and 0.8 are inside, that at 0.5 is not.
        amplitude = "0., 0., 0.3, 1., 0.5, 0.5, 0.8, 1.\n1., 0.5"
        self.solve(PRESS + DRAG, amplitude=amplitude, h=0.5, direct=True)
        np.testing.assert_allclose(self.rows["time"], [1.0, 1.5, 2.0], rtol=1e-12)
        np.testing.assert_array_equal(self.rows["extra"], 0)
        self.assertEqual(self.counters["kinks_inside_increments"], 2)
        said = self.run_of_result.output
        self.assertEqual(said.count("note: step 2: breakpoints of amplitudes"), 1)

    def test_too_many_kinks_are_told(self):
        zigzag = "\n".join(f"{k / 12}, {k % 2}" for k in range(13))
        self.solve(PRESS + DRAG, amplitude=zigzag)
        np.testing.assert_allclose(self.rows["time"], [1.0, 2.0], rtol=1e-12)
        self.assertEqual(self.counters["kinks_inside_increments"], 11)
        self.assertIn("too many", self.run_of_result.output)
        # Nor does a coarser run say what that makes, which goes across the same kinks.
        self.assertEqual(self.rows["load_steps"][-1], -1)
        self.assertIn("is not estimated", self.run_of_result.output)

    def test_an_increment_ends_where_contact_begins(self):
        # The plane is met at 0.8, so the cube slides by a fifth of its way: 0.004 under 0.3*4.
        self.solve(SLANT, gap=0.016)
        np.testing.assert_allclose(self.rows["time"], [0.8, 1.0], rtol=1e-9)
        np.testing.assert_array_equal(self.rows["extra"], [1, 0])
        np.testing.assert_allclose(self.rows["resultant"][-1], [-1.2, 0, 4], rtol=0, atol=1e-6)
        np.testing.assert_allclose(self.rows["dissipation"][-1], 1.2 * 0.004, rtol=1e-6)
        self.assertEqual(self.counters["increments_at_events"], 1)
        self.assertEqual(self.counters["first_touches_inside_increments"], 0)
        self.assertEqual(self.estimates["increments_at_events"], 1)

    def test_a_first_touch_of_rounding_is_passed(self):
        # A long thin beam is lowered as a whole until a corner of its tip touches a slope, 2/17 of
        # the way: its forces are rounding there, and whether an increment that ends there is
        # certified depends on that. If not, none does. From there on they grow with the way.
        self.solve(LOWERED, body=BEAM, gap=0.2, h=0.25)
        output = self.run_of_result.output
        passed = output.count("(to time 0.117647, at first contact) did not converge: retrying "
                              "with a later end\n")  # fmt: skip
        self.assertEqual(output.count("note: step 1: contact begins inside increment 1\n"), passed)
        self.assertEqual(self.rows["extra"].sum(), 1 - passed)
        kept = self.rows["extra"] == 0
        np.testing.assert_allclose(self.rows["time"][kept], [0.25, 0.5, 0.75, 1.0], rtol=1e-12)
        force = self.rows["resultant"][kept, 2]
        np.testing.assert_allclose(force, force[-1] * np.array([9, 26, 43, 60]) / 60, rtol=1e-6)

    def test_contact_from_the_start_cuts_nothing(self):
        self.solve(SLANT, gap=0.0)
        np.testing.assert_allclose(self.rows["time"], [1.0], rtol=1e-12)

    def test_direct_tells_where_contact_begins(self):
        self.solve(SLANT, gap=0.016, h=0.5, direct=True)
        np.testing.assert_allclose(self.rows["time"], [0.5, 1.0], rtol=1e-12)
        self.assertEqual(self.counters["first_touches_inside_increments"], 1)
        words = "note: step 1: contact begins inside increment 2"
        self.assertEqual(self.run_of_result.output.count(words), 1)

    def test_the_error_sees_what_lies_across(self):
        # With DIRECT, sizes h and 2h both end where the amplitude is 0, and friction is 0 there;
        # the last way is back, so it is 3, beside a resultant of the size of (3, 10).
        sine = ", ".join(f"{k / 8}, {k % 2}" for k in range(5)) + ",\n"
        sine += ", ".join(f"{k / 8}, {k % 2}" for k in range(5, 9))
        self.solve(PRESS + DRAG, amplitude=sine, h=0.25, direct=True)
        error = np.linalg.norm(self.rows["resultant"][-1] - [3, 0, 10]) / np.hypot(3, 10)
        self.assertGreater(error, 0.1)
        np.testing.assert_allclose(self.rows["load_steps"][-1], error, rtol=1e-3)
        self.solve(PRESS + DRAG, amplitude=sine, h=0.25)
        np.testing.assert_allclose(self.rows["resultant"][-1], [3, 0, 10], rtol=0, atol=1e-7)
        self.assertLess(self.rows["load_steps"][-1], 1e-6)

    def test_the_error_sees_where_contact_begins(self):
        # A cube that may give way: all of it slides where the way counts from the start, not where
        # it counts from the touch.
        steps = SLANT.replace("B, 2, 2\nB, 1, 1, 0.02", "B-ZMAX, 1, 1, 0.02\nB-ZMAX, 2, 2")
        body = BODY.replace("NX=2, NY=2, NZ=1", "NX=6, NY=6, NZ=6")
        body = body.replace("1000., 0.", "1000., 0.3")
        self.solve(steps, gap=0.016, body=body)
        right = self.rows["resultant"][-1]
        self.assertLess(self.rows["load_steps"][-1], 1e-4)
        self.solve(steps, gap=0.016, body=body, direct=True)
        error = np.linalg.norm(self.rows["resultant"][-1] - right) / np.linalg.norm(right)
        self.assertGreater(error, 1e-3)
        np.testing.assert_allclose(self.rows["load_steps"][-1], error, rtol=0.1)

    def test_asked_increments_are_written(self):
        # FREQUENCY counts the deck's increments: the second and the fourth, and no extra one.
        steps = SLANT.replace("*END STEP", "*NODE FILE, FREQUENCY=2\nU\n*END STEP")
        self.solve(steps, gap=0.005, h=0.25)
        np.testing.assert_allclose(self.rows["time"], [0.25, 0.5, 0.75, 1.0], rtol=1e-9)
        self.solve(steps, gap=0.007, h=0.25)
        np.testing.assert_allclose(self.rows["time"], [0.25, 0.35, 0.5, 0.75, 1.0], rtol=1e-9)
        self.assertEqual(self.written, 2)

    # The top follows the amplitude, unnamed in the steps behind the first: E = 1000, edges of 1.
    THREE = (
        "*STEP\n*STATIC\n{h}, 1.\n*BOUNDARY\nB, 1, 2\n*BOUNDARY, AMPLITUDE=A\n"
        "B-ZMAX, 3, 3, -0.01\n*END STEP\n*STEP\n*STATIC\n{h}, 0.5\n*END STEP\n"
        "*STEP\n*STATIC\n{h}, 1.\n{third}*END STEP\n"
    )

    def test_amplitudes_over_the_time_of_the_run(self):
        body = BODY.replace("NAME=A\n", "NAME=A, TIME=TOTAL TIME\n")
        points = ((0.0, 0.0), (0.75, 1.0), (1.25, 0.4), (2.0, 0.8), (2.25, 0.2))
        table = ", ".join(f"{time}, {value}" for time, value in points)
        steps = self.THREE.replace("{third}", "")
        self.solve(steps, amplitude=table, h=0.25, body=body)
        time = self.rows["time"]
        np.testing.assert_allclose(time, np.arange(0.25, 2.6, 0.25), rtol=1e-9)
        expected = 10 * np.interp(time, *np.transpose(points))
        np.testing.assert_allclose(self.rows["resultant"][:, 2], expected, rtol=0, atol=1e-7)
        # Increments end at its kinks in every step, which are kinks of the run's time.
        self.solve(steps, amplitude=table, h=0.5, body=body)
        np.testing.assert_allclose(
            self.rows["time"], [0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.25, 2.5], rtol=1e-9
        )
        expected = 10 * np.interp(self.rows["time"], *np.transpose(points))
        np.testing.assert_allclose(self.rows["resultant"][:, 2], expected, rtol=0, atol=1e-7)
        self.assertEqual(self.counters["increments_at_events"], 3)
        self.assertGreaterEqual(self.estimates["increments_at_events"], 3)
        # What is named again ramps from where it was, 0.4 + 0.25/0.75*0.4.
        third = "*BOUNDARY\nB-ZMAX, 3, 3, -0.02\n"
        self.solve(self.THREE.replace("{third}", third), amplitude=table, h=0.5, body=body)
        np.testing.assert_allclose(
            self.rows["resultant"][-2:, 2], [(16 / 3 + 20) / 2, 20], rtol=0, atol=1e-7
        )

    def test_periodic_amplitudes(self):
        # A0 = 0.5, from t = 0.25 on 0.3 sin(2 pi s) - 0.1 cos(4 pi s) beside it, in the time of
        # each step: what follows is held.
        series = f"2, {2 * np.pi:.15f}, 0.25, 0.5\n0., 0.3, -0.1, 0."
        body = BODY.replace("NAME=A\n", "NAME=A, DEFINITION=PERIODIC\n")
        steps = self.THREE.replace("{third}", "")

        def expected(time):
            s = time - 0.25
            wave = 0.3 * np.sin(2 * np.pi * s) - 0.1 * np.cos(4 * np.pi * s)
            return 10 * (0.5 + np.where(s >= -1e-12, wave, 0))

        self.solve(steps, amplitude=series, h=0.0625, body=body)
        time = self.rows["time"]
        np.testing.assert_allclose(
            self.rows["resultant"][:, 2], expected(np.minimum(time, 1.0)), rtol=0, atol=1e-7
        )
        self.assertNotIn("straight lines", self.run_of_result.output)
        body = body.replace("PERIODIC", "PERIODIC, TIME=TOTAL TIME")
        self.solve(steps, amplitude=series, h=0.125, body=body)
        time = self.rows["time"]
        np.testing.assert_allclose(
            self.rows["resultant"][:, 2], expected(time), rtol=0, atol=1e-7
        )
        self.assertNotIn("straight lines", self.run_of_result.output)
        # Its second term has 4 increments a period.
        direct = steps.replace("*STATIC", "*STATIC, DIRECT")
        self.solve(direct, amplitude=series, h=0.125, body=body)
        self.assertIn(
            "amplitude 'A' has a period of 0.5 and the increments of the step are 0.125: they take "
            "loads in straight lines, and fewer than 8 a period miss much of it",
            self.run_of_result.output,
        )

    def test_fixed_displacements(self):
        """What a pressure has pushed down stays there without it, and pulls as much."""
        steps = (
            "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB, 1, 2\n*DSLOAD\nB-ZMAX, P, 10.\n*END STEP\n"
            "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY, FIXED\nB-ZMAX, 3, 3, 7.\n*DSLOAD, OP=NEW\n"
            "*END STEP\n"
            "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-ZMAX, 3, 3, -0.005\n*END STEP\n"
        )
        self.solve(steps)
        np.testing.assert_allclose(
            self.rows["resultant"][:, 2], [10, 10, 10, 5], rtol=0, atol=1e-7
        )
        self.assertIn("the values of *BOUNDARY, FIXED are ignored", self.run_of_result.output)
        result = self.run_of_result.result()
        self.addCleanup(result.close)
        for step, force in ((1, -5), (2, -10), (3, -5)):
            support = result.field("reaction_force", step)[:, 2]
            np.testing.assert_allclose(support.sum(), force, rtol=0, atol=1e-7)
        top = result.file["VTKHDF/Points"][:, 2] == 1
        before, after = (result.field("displacement", step)[top, 2] for step in (0, 2))
        np.testing.assert_allclose(before, -0.01, rtol=1e-9)
        np.testing.assert_array_equal(after, before)


if __name__ == "__main__":
    unittest.main()
