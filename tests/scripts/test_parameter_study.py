"""bipot.study: each run is made once, resumed where it was, and none is another deck's."""

import os
import shutil
import signal
import sys
import threading
import time
import unittest
from pathlib import Path
from unittest.mock import patch

try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

from bipot.parameter_study import combinations, run_name  # noqa: E402
from bipot.running import Process  # noqa: E402
from package import BLOCK, ROOT, WithFolder, bipot, needs, pressed_block  # noqa: E402


def pushed(result):
    """Return how far the resultant is inclined at the end."""
    force = result.pairs[0].resultant[-1]
    return {"ratio": np.hypot(*force[:2]) / force[2]}


class Studies(WithFolder):
    def study(self, vary, deck=BLOCK, **options):
        given = {"folder": "runs", "steps": 10, "quiet": True, "evaluate": pushed, **options}
        return bipot.study(deck, vary, **given)

    def stamps(self):
        """Return when each file of the folder was written."""
        return {path.name: path.stat().st_mtime_ns for path in Path("runs").glob("*.vtkhdf")}

    def test_a_row_for_each_combination_whatever_runs_beside(self):
        study = self.study({"mu": [0.1, 0.3], "n": [1, 2]}, processes=2)
        self.assertEqual([(row["mu"], row["n"]) for row in study],
                         [(0.1, 1), (0.1, 2), (0.3, 1), (0.3, 2)])
        # Everything slides at the end, so the inclination is the coefficient of friction.
        np.testing.assert_allclose(study.column("ratio"), [0.1, 0.1, 0.3, 0.3], rtol=1e-6)
        self.assertTrue(all(row["certified"] and row["increments"] == 10 for row in study))
        self.assertEqual(sorted(self.stamps()), sorted(
            f"mu={mu},n={n}.vtkhdf" for mu in (0.1, 0.3) for n in (1, 2)
        ))
        with study.result(mu=0.3, n=2) as result:
            self.assertEqual(len(result.elements), 8)
        with self.assertRaisesRegex(ValueError, "2 runs have"):
            study.result(n=2)
        with self.assertRaises(KeyError):
            study.column("colour")
        self.assertIn("<th>ratio</th>", study._repr_html_())

    def test_columns_are_not_replaced(self):
        with self.assertRaisesRegex(ValueError, "evaluate must not return mu, seconds"):
            self.study({"mu": [0.1]}, evaluate=lambda _: {"mu": 1, "seconds": 2, "more": 3})
        self.assertEqual(self.study({"mu": [0.1]}, evaluate=None)[0]["status"], "finished")

    def test_refinements_are_varied_like_parameters(self):
        """A block of n elements refined is that of 2 n; runs that are there are known again."""
        vary = [{"n": 1, "--refine": 0}, {"n": 1, "--refine": 1}, {"n": 2, "--refine": 0}]
        study = self.study(vary, evaluate=lambda result: {"elements": len(result.elements),
                                                          **pushed(result)})  # fmt: skip
        self.assertEqual(study.column("elements").tolist(), [1, 8, 8])
        self.assertEqual(next(iter(self.stamps())).count("refine="), 1)
        np.testing.assert_allclose(study.column("ratio")[1], study.column("ratio")[2], rtol=1e-8)
        stamps = self.stamps()
        self.study(vary)
        self.assertEqual(self.stamps(), stamps)
        for refine in (0, 1):
            found = self.study({"n": [1]}, folder=f"all-{refine}", refine=refine,
                               evaluate=lambda run: {"elements": len(run.elements)})  # fmt: skip
            self.assertEqual(found.column("elements").tolist(), [8**refine])
            self.study({"n": [1]}, folder=f"all-{refine}", refine=refine)
        with self.assertRaisesRegex(bipot.RefusedError, "with other parameters"):
            self.study({"n": [1]}, folder="all-1")

    def test_finished_runs_are_not_run_again(self):
        first = self.study({"n": [1, 2]})
        before = self.stamps()
        second = self.study({"n": [1, 2, 3]})
        after = self.stamps()
        self.assertEqual({name: after[name] for name in before}, before)
        self.assertEqual(len(after), 3)
        self.assertEqual([row["seconds"] for row in second][:2], [row["seconds"] for row in first])

    def test_a_stopped_run_goes_on(self):
        deck = pressed_block().write("pressed.inp")
        Path("runs").mkdir()
        words = [os.environ["BIPOT"], deck, "-o", "runs/mu=0.2.vtkhdf"]
        words += ["--set", "steps=1000", "--set", "mu=0.2"]

        def stop_at_20(done, total):
            if done == 20:
                process.process.terminate()

        process = Process(words, 1, stop_at_20)
        self.assertEqual(process.wait(), 143)
        row, = self.study({"mu": [0.2]}, deck, steps=1000)
        self.assertEqual((row["status"], row["increments"]), ("finished", 1000))
        with bipot.read(row["path"]) as result:
            self.assertTrue(result.run["continued"])

    def test_an_interrupted_study_stops_its_runs_and_goes_on(self):
        deck = pressed_block()

        def interrupt():
            # When both runs are there, and so going on.
            while len(list(Path("runs").glob("*.vtkhdf"))) < 2:
                time.sleep(0.01)
            os.kill(os.getpid(), signal.SIGINT)

        threading.Thread(target=interrupt, daemon=True).start()
        with self.assertRaises(KeyboardInterrupt):
            self.study({"mu": [0.1, 0.3]}, deck, steps=3000, processes=2)
        # Nothing is held any more, and what the runs had done is continued.
        for path in Path("runs").glob("*.vtkhdf"):
            with bipot.read(path) as result:
                self.assertEqual(result.run["status"], "stopped")
                self.assertGreater(result.finished, 0)
        study = self.study({"mu": [0.1, 0.3]}, deck, steps=3000, processes=2)
        np.testing.assert_allclose(study.column("ratio"), [0.1, 0.3], rtol=1e-6)

    def test_a_run_without_a_solution_is_a_row(self):
        study = self.study({"local": ["NEWTON", "UZAWA"]}, n=1, rho=3, mu=0.3)
        solved, lost = study
        self.assertEqual((solved["status"], lost["status"]), ("finished", "not solved"))
        self.assertIn("outside the range in which Uzawa converges", lost["message"])
        self.assertTrue(np.isnan(study.column("ratio")[1]))

    def test_a_run_that_takes_too_long_is_a_row(self):
        row, = self.study({"n": [12]}, steps=20000, timeout=1.0)
        self.assertEqual(row["status"], "stopped")
        self.assertIn("took longer than 1 s", row["message"])

    def test_a_run_that_had_to_be_killed_is_stopped(self):
        def kill(process):
            process.process.kill()
            return process.wait()

        with patch.object(Process, "stop", kill):
            row, = self.study({"n": [6]}, steps=20000, timeout=1.0)
        self.assertEqual(row["status"], "stopped")  # its file says that it is running
        self.assertIn("had to be killed", row["message"])

    def test_a_wrong_deck_is_told_before_anything_runs(self):
        with self.assertRaisesRegex(bipot.DeckError, "n=2,nn=1: .*no parameter 'NN'"):
            self.study([{"n": 2}, {"n": 2, "nn": 1}])
        self.assertEqual(self.stamps(), {})
        with self.assertRaisesRegex(bipot.DeckError, "no such file"):
            self.study({"n": [1]}, "none.inp")

    def test_files_of_another_deck_are_kept(self):
        self.study({"n": [1]})
        before = self.stamps()
        changed = Path("block.inp")
        changed.write_text(BLOCK.read_text().replace("0.3", "0.25"))
        with self.assertRaisesRegex(bipot.RefusedError, "of another deck"):
            self.study({"n": [1]}, changed)
        with self.assertRaisesRegex(bipot.RefusedError, "with other parameters"):
            self.study({"n": [1]}, mu=0.1)
        self.assertEqual(self.stamps(), before)
        self.study({"n": [1]}, mu=0.1, overwrite=True)
        self.assertNotEqual(self.stamps(), before)

    def test_included_files_are_part_of_the_deck(self):
        text = BLOCK.read_text()
        head, tail = text.split("*MATERIAL", 1)
        Path("main.inp").write_text(f"{head}*INCLUDE, INPUT=rest.inp\n")
        Path("rest.inp").write_text(f"*MATERIAL{tail}")
        self.study({"n": [1]}, "main.inp")
        before = self.stamps()
        self.study({"n": [1]}, "main.inp")
        self.assertEqual(self.stamps(), before)
        Path("rest.inp").write_text(f"*MATERIAL{tail}".replace("210000", "200000"))
        with self.assertRaisesRegex(bipot.RefusedError, "of another deck"):
            self.study({"n": [1]}, "main.inp")

    def test_triangles_that_a_deck_names_are_part_of_it(self):
        shutil.copy(ROOT / "tests" / "data" / "plate.stl", "plate.stl")
        deck = pressed_block().stl("STAMP", "plate.stl")
        self.study({"n": [1]}, deck)
        before = self.stamps()
        self.study({"n": [1]}, deck)
        self.assertEqual(self.stamps(), before)
        later = time.time() + 10
        os.utime("plate.stl", (later, later))
        with self.assertRaisesRegex(bipot.RefusedError, "a file that the deck names was changed"):
            self.study({"n": [1]}, deck)

    def test_names_of_files_are_names(self):
        self.assertEqual(run_name({"solver": "GLOBAL NEWTON", "x": "a/b"}),
                         "solver=GLOBAL%20NEWTON,x=a%2Fb")
        self.assertEqual(combinations({"n": [1, 1, 2]}), [{"n": 1}, {"n": 2}])
        self.assertEqual(combinations({}), [{}])
        with self.assertRaisesRegex(TypeError, "values of n must be a list"):
            combinations({"n": 4})
        with self.assertRaisesRegex(ValueError, "processes must be 1 or more"):
            self.study({"n": [1]}, processes=0)

    @needs("pandas")
    def test_a_table(self):
        table = self.study({"n": [1]}).to_pandas()
        self.assertEqual(table["status"].tolist(), ["finished"])


if __name__ == "__main__":
    unittest.main()
