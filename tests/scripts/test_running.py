"""bipot.run, plan, check and flat: results, plans and errors of the real program."""

import collections.abc
import os
import signal
import sys
import time
import unittest
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

from bipot.running import Process  # noqa: E402
from package import BLOCK, ROOT, WithFolder, bipot, needs, pressed_block  # noqa: E402


class Runs(WithFolder):
    def test_a_run_gives_its_result_and_the_parameters_arrive(self):
        result = self.run_block(mu=0.2)
        self.assertEqual(result.path, Path("block.vtkhdf"))
        self.assertEqual((result.finished, result.run["status"]), (10, "finished"))
        pair = result.pairs["BODY-ZMIN:GROUND"]
        # All of the face slides at the end: the resultant is on the cone of the coefficient given.
        force = pair.resultant[-1]
        self.assertAlmostEqual(np.hypot(*force[:2]) / force[2], 0.2, delta=1e-6)
        self.assertEqual(sorted(result.run_text("overrides").split("\n")),
                         ["mu=0.2", "n=2", "steps=10"])
        self.assertTrue(result.certified)
        self.assertLess(result.worst_error, 1e-9)

    def test_options_are_those_of_the_command_line(self):
        result = self.run_block(output="a.b/mu0.3", directory="out", threads=1)
        self.assertEqual(result.path, Path("out/a.b/mu0.3.vtkhdf"))
        self.assertTrue(result.path.is_file())
        again = bipot.run(BLOCK, n=1, steps=10, output="out/a.b/mu0.3", overwrite=True, quiet=True)
        with again:
            self.assertEqual(len(again.elements), 1)

    def test_a_parameter_may_be_called_like_an_argument(self):
        deck = bipot.Deck("A parameter called output", name="odd")
        deck.parameter(output=2)
        deck.block("BODY", ("<output>", 1, 1), (1, 1, 1))
        deck.material("M", 1.0, 0.3).section("M", "BODY")
        with deck.step():
            deck.boundary("BODY", "PINNED")
        with bipot.run(deck, parameters={"output": 3}, quiet=True) as result:
            self.assertEqual(len(result.elements), 3)

    def test_notes_of_the_program_are_kept(self):
        self.assertTrue(any("finite strain may change" in note for note in self.run_block().notes))
        with bipot.run(ROOT / "input" / "press.inp", quiet=True) as result:
            overlap = "50 nodes of RING-IN:HUB-OUT overlap before the first step, by up to 0.0025"
            self.assertEqual(sum(note.startswith(overlap) for note in result.notes), 1)
        with bipot.read(result.path) as again:
            self.assertEqual(sum(note.startswith(overlap) for note in again.notes), 1)

    def test_a_bar_follows_the_increments_where_tqdm_is(self):
        bars = []

        class Bar:
            def __init__(self, **given):
                self.given, self.n, self.closed = given, 0, False
                bars.append(self)

            def update(self, more):
                self.n += more

            def close(self):
                self.closed = True

        with patch.dict(sys.modules, {"tqdm": SimpleNamespace(), "tqdm.auto": SimpleNamespace(
            tqdm=Bar
        )}):
            self.run_block(quiet=False)
            bar, = bars
            self.assertEqual((bar.n, bar.given["total"], bar.closed), (10, 10, True))
            self.run_block(quiet=True)
            self.assertEqual(len(bars), 1)
        with patch.dict(sys.modules, {"tqdm": None, "tqdm.auto": None}):
            self.assertEqual(self.run_block(quiet=False).finished, 10)

    def test_a_stopped_run_is_resumed(self):
        deck = pressed_block()
        path = deck.write("pressed.inp")
        told = []

        def stop_at_20(done, total):
            told.append((done, total))
            if done == 20:
                process.process.terminate()

        words = [os.environ["BIPOT"], path, "--set", "steps=1000"]
        process = Process(words, 1, stop_at_20)
        self.assertEqual(process.wait(), 143, process.said)
        self.assertEqual(told[0], (1, 1000))
        with bipot.read("pressed.vtkhdf") as part:
            self.assertEqual(part.run["status"], "stopped")
            before = part.finished
            self.assertGreaterEqual(before, 20)
            self.assertLess(before, 1000)
        with self.assertRaisesRegex(bipot.RefusedError, "unfinished"):
            bipot.run(path, steps=1000, quiet=True)
        with bipot.run(path, steps=1000, resume=True, quiet=True) as whole:
            self.assertEqual((whole.finished, whole.run["status"]), (1000, "finished"))
            self.assertTrue(whole.run["continued"])

    def test_a_run_that_has_been_told_is_not_told_twice(self):
        told = []
        path = pressed_block().write("pressed.inp")
        words = [os.environ["BIPOT"], path, "--set", "steps=20000"]
        process = Process(words, 1, lambda done, total: told.append(done))
        while not told:
            time.sleep(0.01)
        process.process.send_signal(signal.SIGINT)  # as a terminal does
        while not process.said:
            time.sleep(0.01)
        with patch.object(process.process, "terminate") as terminate:
            self.assertEqual(process.stop(), 130)
        terminate.assert_not_called()
        with bipot.read("pressed.vtkhdf") as part:
            self.assertEqual(part.run["status"], "stopped")

    def test_a_timeout_stops_the_program(self):
        with self.assertRaises(bipot.RunTimeoutError) as caught:
            bipot.run(BLOCK, n=12, steps=10000, timeout=1.0, quiet=True)
        self.assertIsInstance(caught.exception, TimeoutError)
        self.assertIn("took longer than 1 s", str(caught.exception))
        # What it wrote is free: nothing holds it any more.
        left = caught.exception.result
        if left is not None:
            self.assertEqual(left.run["status"], "stopped")


class Errors(WithFolder):
    def test_a_wrong_deck_names_every_mistake(self):
        Path("bad.inp").write_text("*HEADING\nx\n*BLOCK, NAME=B, NX=1, NY=1, NU=1\n0,0,0,1,1,1\n")
        with self.assertRaises(bipot.DeckError) as caught:
            bipot.run("bad.inp", quiet=True)
        found = caught.exception
        self.assertEqual(found.status, 1)
        self.assertIn((3, 29), [(message.line, message.column) for message in found.messages])
        self.assertIn("did you mean NX?", next(m.text for m in found.messages if m.column == 29))
        # The same list as --check gives to editors, hints and all.
        self.assertEqual(list(found.messages), bipot.check("bad.inp"))
        for ask in (bipot.plan, bipot.flat):
            with self.assertRaises(bipot.DeckError):
                ask("bad.inp")

    def test_a_missing_deck(self):
        with self.assertRaisesRegex(bipot.DeckError, r"none\.inp: error: there is no such file"):
            bipot.run("none.inp", quiet=True)
        self.assertIn("no such file", bipot.check("none.inp")[0].text)

    def test_a_parameter_that_the_deck_does_not_have(self):
        with self.assertRaisesRegex(bipot.DeckError, "no parameter 'NN'"):
            bipot.run(BLOCK, nn=2, quiet=True)
        with self.assertRaisesRegex(TypeError, "parameter n must be a number or a text"):
            bipot.run(BLOCK, n=[1, 2], quiet=True)

    def test_no_program(self):
        with self.assertRaisesRegex(bipot.ProgramMissingError, "no program at .*nowhere"):
            bipot.run(BLOCK, program="nowhere")

    def test_another_runs_file_is_not_replaced(self):
        before = self.run_block().path.read_bytes()
        with self.assertRaisesRegex(bipot.RefusedError, "was made with --set n=2"):
            self.run_block(n=1)
        self.assertEqual(Path("block.vtkhdf").read_bytes(), before)

    def test_a_result_is_no_deck(self):
        path = self.run_block().path
        for ask in (bipot.run, bipot.plan, bipot.check, bipot.flat):
            with self.assertRaisesRegex(bipot.RefusedError, "is an HDF5 file, not a deck"):
                ask(path)

    def test_an_increment_that_is_not_solved_keeps_those_before(self):
        # The first increments take about 30 sweeps, the first sideways about 45.
        deck = pressed_block(MAX_SWEEPS=38)
        with self.assertRaisesRegex(bipot.NotSolvedError, "step 2, increment 1") as caught:
            bipot.run(deck, steps=50, quiet=True)
        found = caught.exception
        self.assertEqual(found.status, 2)
        self.assertEqual((found.result.finished, found.result.run["status"]), (10, "not solved"))
        self.assertTrue(found.result.certified)
        found.result.close()

    def test_a_failed_run_is_not_given_an_older_file(self):
        self.run_block(output="same")
        with self.assertRaises(bipot.NotSolvedError) as caught:
            self.run_block(output="same", local="UZAWA", rho=3, overwrite=True)
        self.assertIsNone(caught.exception.result)


class Plans(WithFolder):
    def test_numbers_of_the_plan_are_those_of_the_run(self):
        plan = bipot.plan(BLOCK, n=2, steps=10)
        result = self.run_block()
        estimates = result.estimates
        self.assertEqual((plan.nodes, plan.elements), (len(result.points), len(result.elements)))
        self.assertEqual(plan.equations, estimates["equations"])
        self.assertEqual(plan.increments, estimates["increments"])
        self.assertEqual(plan.contact_points, estimates["contact_points"])
        # Two or three digits are printed.
        for found, name in (
            (plan.memory_bytes, "peak_memory_bytes"), (plan.file_bytes, "file_bytes"),
        ):
            self.assertAlmostEqual(found / estimates[name], 1, delta=0.06, msg=name)
        self.assertAlmostEqual(plan.seconds / estimates["cpu_seconds"], 1, delta=0.3)
        self.assertTrue(plan.fits)
        self.assertIn("sweeps", plan.line("contact solver"))
        self.assertIsNone(plan.line("chosen"))

    def test_a_run_that_the_machine_cannot_hold_is_no_error(self):
        # A dense matrix of three rows a point: terabytes.
        plan = bipot.plan(ROOT / "studies" / "plate.inp", n=500, layers=1, compliance="DENSE")
        self.assertFalse(plan.fits)
        self.assertIn("of memory", plan.message)
        self.assertEqual((plan.elements, plan.contact_points), (500**2, 501**2))

    def test_a_deck_without_contact_has_no_points(self):
        plan = bipot.plan(ROOT / "input" / "cantilever.inp")
        self.assertEqual(plan.contact_points, 0)
        self.assertGreater(plan.equations, 0)

    def test_all_decks_have_their_numbers(self):
        for name in ("hertz", "stack", "foundation", "ssnv128"):
            plan = bipot.plan(ROOT / "input" / f"{name}.inp")
            for number in (plan.nodes, plan.elements, plan.equations, plan.increments,
                           plan.contact_points, plan.memory_bytes, plan.seconds, plan.file_bytes):
                self.assertGreater(number, 0, f"{name}: {plan.text}")

    def test_a_flat_deck_is_a_deck_of_the_same(self):
        text = bipot.flat(BLOCK, n=1, steps=10)
        self.assertNotIn("<", text)
        Path("flat.inp").write_text(text)
        with bipot.run("flat.inp", quiet=True) as one:
            np.testing.assert_array_equal(
                one.pairs[0].reaction, self.run_block(n=1).pairs[0].reaction
            )


class Results(WithFolder):
    def test_what_the_file_says_of_itself(self):
        result = self.run_block()
        self.assertEqual(result.describe("displacement").quantity, "length")
        self.assertEqual(result.describe("energy/strain").text, "elastic energy of the bodies")
        described = result.pairs[0].describe("resultant")
        self.assertEqual((described.quantity, described.shape), ("force", (10, 3)))
        for name in (*result.history_names, *set.union(*result.field_names)):
            self.assertTrue(all(result.describe(name)[:2]), name)
        with self.assertRaisesRegex(bipot.ResultError, "no field or history 'colour'"):
            result.describe("colour")

    def test_pairs_by_number_and_by_name(self):
        pairs = self.run_block().pairs
        self.assertIs(pairs["body-zmin:ground"], pairs[0])
        self.assertEqual((len(pairs), pairs.names), (1, ["BODY-ZMIN:GROUND"]))
        self.assertEqual([pair.name for pair in pairs.values()], pairs.names)
        self.assertIsInstance(pairs, collections.abc.Mapping)
        self.assertEqual(list(pairs), pairs.names)
        self.assertIn("body-zmin:Ground", pairs)
        self.assertNotIn("X", pairs)
        self.assertIsNone(pairs.get("X"))
        with self.assertRaisesRegex(bipot.ResultError, "no contact pair 'X'; it has BODY-ZMIN:GR"):
            pairs["X"]

    def test_a_notebook_sees_the_certificate(self):
        result = self.run_block()
        html = result._repr_html_()
        self.assertIn("10, 10 of them certified", html)
        self.assertIn(f"{result.worst_error:.2g}", html)
        self.assertIn("finished", repr(result))
        result.close()
        self.assertIn("closed", repr(result))
        self.assertIn("closed", result._repr_html_())

    @needs("matplotlib")
    def test_plots_are_figures(self):
        result = self.run_block()
        for what, axes in (("displacement", 2), ("contact", 4), ("forces", 3)):
            figure = result.plot(what)
            self.assertEqual(len(figure.axes), axes, what)
            figure.canvas.draw()
            room = figure.get_tightbbox(figure.canvas.get_renderer())
            # What a notebook shows is cut to this, in inches.
            self.assertLess(max(room.width, room.height), 1.2 * max(figure.get_size_inches()), what)
        self.assertIn("step 1, increment 1", result.plot("displacement", 0).axes[0].get_title())
        with self.assertRaisesRegex(bipot.ResultError, "no field 'stress'; ask for it"):
            result.plot("stress")
        with self.assertRaisesRegex(ValueError, "not 'colour'"):
            result.plot("colour")
        with self.assertRaisesRegex(bipot.ResultError, "no index 10"):
            result.plot("displacement", 10)

    @needs("pandas")
    def test_a_table_of_the_histories(self):
        result = self.run_block()
        table = result.to_pandas()
        self.assertEqual(len(table), 10)
        np.testing.assert_array_equal(table["energy/strain"], result.history("energy/strain"))
        np.testing.assert_array_equal(
            table["BODY-ZMIN:GROUND/resultant_z"], result.pairs[0].resultant[:, 2]
        )
        deck = ROOT / "input" / "wheel.inp"
        wheel = bipot.run(deck, quiet=True, n=8, steps=2, directory=self.folder)
        self.addCleanup(wheel.close)
        table, (hub,) = wheel.to_pandas(), wheel.reference_nodes
        np.testing.assert_array_equal(table["900/rotation_y"], hub.rotation[:, 1])
        np.testing.assert_array_equal(table["900/reaction_moment_y"], hub.reaction_moment[:, 1])
        self.assertGreater(np.abs(hub.reaction_moment[-1, 1]), 0)

    def test_a_summary_is_a_list_without_pandas(self):
        result = self.run_block()
        with patch.dict(sys.modules, {"pandas": None}):
            (first, last) = result.summary()
            text = repr(result.summary())
        self.assertEqual((first["step"], last["step"], last["pair"]), (1, 2, "BODY-ZMIN:GROUND"))
        found = [last[f"normal_force_{x}"] + last[f"friction_force_{x}"] for x in "xyz"]
        np.testing.assert_allclose(found, result.pairs[0].resultant[-1], rtol=1e-9)
        self.assertEqual(last["largest_pressure"], result.pairs[0].largest_pressure[-1])
        head, *lines = text.splitlines()
        self.assertTrue(head.startswith("step  pair"))
        self.assertEqual(len(lines), 2)

    @needs("pandas")
    def test_a_summary_is_a_table(self):
        result = self.run_block()
        table = result.summary()
        self.assertEqual(table["step"].tolist(), [1, 2])
        np.testing.assert_allclose(
            table["normal_force_error"],
            result.history("error/total")[result.step_ends]
            * np.linalg.norm(result.pairs[0].resultant[result.step_ends], axis=1),
        )

    @needs("pyvista")
    def test_a_grid_for_pyvista(self):
        result = self.run_block()
        grid = result.to_pyvista(1)
        self.assertEqual((grid.n_points, grid.n_cells), (27, 8))
        np.testing.assert_array_equal(grid["displacement"], result.field("displacement", 1))
        self.assertEqual(grid.field_data["time"][0], result.history("time")[1])
        self.assertAlmostEqual(grid.volume, 1.0, places=12)


if __name__ == "__main__":
    unittest.main()
