"""Processor time or memory that is allowed chooses mesh and increments, and is kept to."""

import re
import unittest

import numpy as np
from program import ASKED, INPUT, PROGRAM, Run

AUTO = {"solver": "AUTO", "local": "AUTO", "steps": 5}


def block(*replacements):
    """The block, its increments free to be cut, with other words in it."""
    text = (INPUT / "block.inp").read_text().replace("*STATIC, DIRECT", "*STATIC")
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    return text


def with_card(text, card):
    """The deck with a card before its first step."""
    return text.replace("*STEP\n", f"{card}\n*STEP, NLGEOM=NO\n", 1)


def run_block(*options, deck=None, **overrides):
    """The block, or a deck like it, within bounds."""
    return Run(deck or block(), *options, name="block", **{**AUTO, **overrides})


class Within(unittest.TestCase):
    def test_time(self):
        """A result, its error by several meshes, and all of it in the file; foreseen and told."""
        with run_block(n=4).result() as result:
            time = max(1, round(15 * result.counters["cpu_seconds"]))  # a busy machine takes longer
        run = run_block("--time", str(time), "--verbose")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, r"\nnext run        \d+ elements.*: error [\d.]+ %, .* of "
                         f"CPU time with all runs before, of {time} s\n")  # fmt: skip
        self.assertIn(f"estimated error of the contact forces within {time} s of CPU time: mesh ",
                      run.output)  # fmt: skip
        with run.result() as result:
            group = result.file["accuracy"]
            self.assertEqual((group.attrs["wanted"], group.attrs["time_allowed"]), (0, time))
            self.assertEqual((group.attrs["memory_allowed"], group.attrs["reached"]), (0, 1))
            size, divisions = group["element_size"][:], group["divisions"][:]
            same = divisions == divisions[-1]
            self.assertTrue(np.all(np.diff(size[same]) < 0))
            self.assertGreater(np.count_nonzero(same), 1)
            self.assertEqual(len(result.file["VTKHDF/CellData/element_id"]), group["elements"][-1])
            self.assertGreater(group.attrs["mesh"], 0)
            self.assertGreater(group.attrs["load_steps"], 0)
            self.assertTrue(np.all(result.history("certified") == 1))
            sequence = result.accuracy
            self.assertEqual((sequence.time_allowed, sequence.memory_allowed), (time, 0))
            self.assertIn(f"within {time} s, {len(size)} runs", repr(sequence))

    def test_what_coarse_meshes_solve_is_kept(self):
        """Where finer meshes gain nothing the last of the first runs is made again, to be kept."""
        run = Run((INPUT / "hertz.inp").read_text(), "--memory", "80MB", name="hertz", mu=0)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            group = result.file["accuracy"]
            elements = group["elements"][:]
            self.assertGreaterEqual(len(elements), 3)
            self.assertTrue(np.all(np.diff(elements) > 0))
            self.assertLess(group.attrs["mesh"], 1e-6)
            self.assertEqual(len(result.file["VTKHDF/CellData/element_id"]), elements[-1])
            self.assertTrue(np.all(result.history("certified") == 1))
        lines = re.findall(rf"^ +\d+ +{int(elements[-1])} +[\d.]+ +1 .* s ", run.output,
                           re.MULTILINE)  # fmt: skip
        self.assertEqual(len(lines), 2)

    def test_more_memory_is_a_finer_mesh(self):
        """What the plan foresees stays below the bound, and the error falls."""
        found = []
        for memory in ("55MB", "120MB"):
            run = run_block("--memory", memory, mu=0)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                group = result.file["accuracy"]
                self.assertEqual(group.attrs["memory_allowed"], 1e6 * float(memory[:-2]))
                peak = result.estimates["peak_memory_bytes"]
                self.assertLessEqual(peak, group.attrs["memory_allowed"])
                found.append((group["elements"][-1], group.attrs["mesh"]))
        self.assertGreater(found[1][0], 1.5 * found[0][0])
        self.assertLess(found[1][1], found[0][1])

    def test_memory_that_the_allocator_keeps(self):
        """A run that is made again to be kept is not refused for heap that earlier runs freed."""
        hoards = [f"MALLOC_{name}_THRESHOLD_=2000000000" for name in ("TRIM", "MMAP")]
        run = Run(
            block(),
            "--memory",
            "55MB",
            name="block",
            command=("env", *hoards, PROGRAM),
            **AUTO,
            mu=0,
        )
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertTrue(np.all(result.history("certified") == 1))
            self.assertLessEqual(result.estimates["peak_memory_bytes"], 55e6)

    def test_beside_an_accuracy(self):
        """Reached before the time is over it ends; what is not reached is told, with status 2."""
        run = run_block(*ASKED, "0.1", "--time", "60")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, "error of the contact forces: .*; 10 % is reached")
        run = run_block(*ASKED, "1e-5", "--memory", "60MB", mu=0)
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, r"^accuracy 0.001 % of the contact forces was not "
                         r"reached: within 60 MB of memory it is mesh .*; the next run, of "
                         r"elements .* times as small, takes it to some .* of memory; \d+ runs, "
                         r".* of CPU time; the result is that of \d+ elements of [\d.]+ times the "
                         r"deck's edges, and otherwise complete\n$")  # fmt: skip
        with run.result() as result:
            self.assertEqual(result.file["accuracy"].attrs["reached"], 0)
            self.assertGreater(len(result.accuracy), 2)

    def test_an_accuracy_far_out_of_reach(self):
        """What it takes is told at once, however far it is: no mesh is counted up to it."""
        deck = """*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=BALL, TYPE=SPHERE
0.5, 0.5, 2., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMAX, BALL
*BOUNDARY
B-ZMIN, 1, 2
B-ZMIN, 3, 3, 0.05
*STEP
*STATIC
*END STEP
"""
        run = Run(deck, *ASKED, "1e-9", "--time", "0.3", "--nlgeom", "no", name="ball")
        self.assertEqual(run.status, 2, run.errors)
        times = re.search(r"the next run, of elements (\S+) times as small", run.errors)
        self.assertGreater(float(times[1]), 1e6)


class Kept(unittest.TestCase):
    def test_a_mesh_that_is_kept_is_run_or_refused(self):
        """Bounds do not choose it; beyond them nothing is run, unless forced."""
        run = run_block("--time", "100", "--refine", "0", "-q", n=2)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertNotIn("accuracy", result.file)
        run = run_block("--time", "0.001", "--refine", "1", n=2)
        self.assertEqual(run.status, 3)
        self.assertRegex(run.errors, r"the run takes about .* s of CPU time, and --time "
                         r"allows 0.001 s; elements .* times as large would do\n")  # fmt: skip
        self.assertFalse(run.file.exists())
        run = run_block("--memory", "20MB", "--refine", "0", n=2)
        self.assertEqual(run.status, 3)
        self.assertRegex(run.errors, "needs .* of memory, and --memory allows 20 MB")
        run = run_block("--time", "0.001", "--refine", "0", "--force", "-q", n=2)
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("and --time allows 0.001 s", run.errors + run.output)

    def test_too_little_for_any_mesh(self):
        for words, message in (
            (["--time", "0.001"], "and --time allows 0.001 s; there is no coarser mesh"),
            (["--memory", "20MB"], "of memory, and --memory allows 20 MB"),
        ):
            run = run_block(*words)
            self.assertEqual(run.status, 3)
            self.assertIn(message, run.errors)
            self.assertFalse(run.file.exists())


class Options(unittest.TestCase):
    def test_wrong_values(self):
        for option, values, wanted in (
            ("--time", ("0", "-1", "nan", "inf", "1e12", "soon", "1s"),
             "a number above 0 and below 1e9, in seconds of CPU time"),
            ("--memory", ("0GB", "-4GB", "nanGB", "1e99GB", "4", "4XB", "GB", "1kB"),
             "a size with its unit from 1MB to 1000TB, as 4GB, 500MB or 1.5GiB"),
        ):  # fmt: skip
            for value in values:
                run = run_block(option, value)
                self.assertEqual(run.status, 1, value)
                self.assertEqual(
                    run.errors, f"bipot: error: {option} must be {wanted}, not '{value}'\n"
                )

    def test_what_excludes_bounds(self):
        deck = with_card(block(), "*ACCURACY, ESTIMATE=NO")
        for words, message in (
            (["--time", "5"], "--time takes the estimates that the deck leaves out by *ACCURACY, "
             "ESTIMATE=NO"),
            (["--memory", "1GB"], "--memory takes the estimates"),
            (["--time", "5", "--refine", "0", "--check"], ""),
            (["--time", "5", "--export-fclib", "1"], "--time takes the estimates"),
        ):  # fmt: skip
            run = run_block(*words, deck=deck)
            self.assertEqual(run.status, 1 if message else 0, run.errors)
            self.assertIn(message, run.errors)
        run = run_block("--time", "5", "--export-fclib", "1")
        self.assertEqual(run.status, 1)
        self.assertIn("--time tries several: --refine 0 keeps the deck's mesh", run.errors)

    def test_a_plan_is_that_of_the_mesh_foreseen(self):
        """More than the first mesh, within the time, and said so."""
        run = run_block("--time", "3", "--plan")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("the best of the contact forces; the mesh is chosen for it, within 3 s of "
                      "CPU time", run.output)  # fmt: skip
        elements = int(run.output.split(" elements")[0].split()[-1])
        self.assertGreater(elements, 64)

    def test_a_result_within_other_bounds_is_another(self):
        """A run with other bounds does not replace it unless told to; a finished one is that."""
        run = run_block("--memory", "45MB", mu=0)
        self.assertEqual(run.status, 0, run.errors)
        again = Run(run.deck, "--memory", "0.05GB", "-o", str(run.file), **AUTO, mu=0)
        self.assertEqual(again.status, 1)
        self.assertIn("--memory 45MB", again.errors)
        words = ("--memory", "0.045GB", "-o", str(run.file), "--continue")
        again = Run(run.deck, *words, **AUTO, mu=0)
        self.assertEqual(again.status, 1)
        self.assertIn("is finished: there is nothing to continue", again.errors)


if __name__ == "__main__":
    unittest.main()
