"""The program on several ranks beside the program for one process, and how ranks fail."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from launching import (
    INPUT,
    MPIEXEC,
    PATIENCE,
    PROGRAM,
    SERIAL,
    SOURCE,
    Run,
    check_end,
    forces,
    launch,
    pushed,
    ranks_of,
    with_card,
)

BLOCK = (INPUT / "block.inp").read_text(encoding="utf-8")
# Solved further than it is compared: two runs stop at different points within the tolerance.
AUTO = {"solver": "AUTO", "local": "AUTO", "tolerance": 1e-12}
LIMIT = 1e-10
WRONG_INPUT, NOT_SOLVED, MACHINE = 1, 2, 3


def counters(run):
    """The counters of a run by name."""
    with run.result() as result:
        return result.counters


def status_of(file):
    """How the run of an open result ended."""
    status = file["run"].attrs["status"]
    return (status.decode() if isinstance(status, bytes) else status).rstrip("\0 ")


class Benchmark(unittest.TestCase):
    def test_the_benchmark_compares_ranks(self):
        command = [sys.executable, "-B", SOURCE / "studies" / "run", "parallel"]
        command += ["--bipot", SERIAL]
        command += ["--bipot-mpi", PROGRAM, "--mpirun", MPIEXEC, "-n", "4", "--repeats", "1"]
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, check=True
        )
        lines = [line.strip("| ").split(" | ") for line in done.stdout.strip().splitlines()]
        table = [dict(zip(lines[0], line, strict=True)) for line in lines[2:]]
        self.assertEqual([row["ranks"] for row in table], ["-", "1", "2"])
        self.assertEqual(table[1]["forces"], "0e+00")
        self.assertLess(float(table[2]["forces"]), LIMIT)


class SameForces(unittest.TestCase):
    def check(self, ranks, deck, *options, **settings):
        """Compare every force on `ranks` ranks with those of one process; return both runs."""
        alone = Run(deck, *options, command=(SERIAL,), **settings)
        self.assertEqual(alone.status, 0, alone.errors)
        together = []
        expected = forces(alone)
        largest = max(np.abs(force).max() for force in expected.values())
        self.assertGreater(largest, 0)
        for n in ranks:
            run = Run(deck, *options, command=launch(n), **settings)
            self.assertEqual(run.status, 0, run.errors)
            self.assertNotIn("warning", run.output)
            found = forces(run)
            self.assertEqual(set(found), set(expected))
            for name, force in found.items():
                error = np.abs(force - expected[name]).max() / largest
                self.assertLessEqual(error, LIMIT, f"{name} on {n} ranks")
            with h5py.File(run.file) as file:
                self.assertEqual(file["run"].attrs["ranks"], n)
            together.append(run)
        return alone, together

    def test_the_block_on_one_to_four_ranks(self):
        alone, together = self.check((1, 2, 3, 4), INPUT / "block.inp", n=4, steps=10, **AUTO)
        for run in together:
            for name in ("factor_entries", "equations", "solutions", "contact_rows"):
                self.assertEqual(counters(run)[name], counters(alone)[name], name)
        one = together[0]
        with h5py.File(one.file) as found, h5py.File(alone.file) as expected:
            for name in ("VTKHDF/PointData/displacement", "history/residual"):
                self.assertTrue(np.array_equal(found[name][()], expected[name][()]), name)

    def test_the_block_with_a_larger_mesh(self):
        _, together = self.check((2,), INPUT / "block.inp", n=8, steps=10, **AUTO)
        self.assertLessEqual(counters(together[0])["element_stiffnesses"], 4)

    def test_sweeps(self):
        self.check((2,), INPUT / "block.inp", n=4, steps=10, tolerance=1e-12)

    def test_bodies_held_by_contact_alone(self):
        for deck in ("slope.inp", "hertz.inp"):
            with self.subTest(deck=deck):
                self.check((2,), INPUT / deck, tolerance=1e-12)

    def test_factors_in_single_compressed_or_on_the_disk(self):
        settings = {"n": 8, "steps": 10, **AUTO}
        for card in ("FACTOR=SINGLE", "BLOCK LOW RANK=1e-8", "OUT OF CORE=YES"):
            with self.subTest(card=card):
                deck = with_card(BLOCK, f"*PRECISION, {card}")
                self.check((2,), deck, name="block", **settings)

    def test_contact_by_products_with_the_compliance(self):
        settings = {"n": 6, "steps": 10, **AUTO}
        for card in ("FACTOR=DOUBLE", "FACTOR=SINGLE"):
            with self.subTest(card=card):
                deck = with_card(BLOCK, f"*PRECISION, {card}")
                deck = deck.replace("*CONTACT SOLVER,", "*CONTACT SOLVER, COMPLIANCE=PRODUCTS,")
                alone, (two,) = self.check((2,), deck, name="block", **settings)
                for run in (alone, two):
                    self.assertEqual(counters(run)["contact_matrix_bytes"], 0)

    def test_finite_strain(self):
        """Tangents are renewed; products with the compliance; factors in single precision."""
        text = (INPUT / "rubber.inp").read_text(encoding="utf-8")
        for card in ("FACTOR=DOUBLE", "FACTOR=SINGLE", "PRODUCTS"):
            with self.subTest(card=card):
                deck = with_card(text, f"*PRECISION, {card}")
                if card == "PRODUCTS":
                    deck = text.replace("*CONTACT SOLVER,", "*CONTACT SOLVER, COMPLIANCE=PRODUCTS,")
                _, (two,) = self.check((2,), deck, name="rubber", n=3, steps=2, tolerance=1e-10)
                with two.result() as result:
                    self.assertGreater(result.history("tangents").sum(), 0)

    def test_no_contact_at_all(self):
        self.check((2, 3), INPUT / "cantilever.inp")

    def test_other_supports_in_the_second_step(self):
        first, second, third = (INPUT / "block.inp").read_text(encoding="utf-8").split("*STEP")
        third = third.replace("*BOUNDARY", "*BOUNDARY\nBODY-XMIN, 2, 2")
        deck = "*STEP".join((first, second, third))
        _, together = self.check((2,), deck, name="other", n=4, steps=10, **AUTO)
        self.assertEqual(counters(together[0])["factorisations"], 2)

    def test_tied_bodies(self):
        self.check((2, 3), INPUT / "bracket.inp", tolerance=1e-12)

    def test_bodies_that_equations_join(self):
        """A block turned in a grip on another that a lever lifts, on the ground."""
        deck = (
            "*NODE\n900, 0.5, 0.5, 1.5\n901, 3., 0., 0.\n"
            "*BLOCK, NAME=LOW, NX=3, NY=3, NZ=2\n0., 0., -1.,  1., 1., 1.\n"
            "*BLOCK, NAME=UP, NX=3, NY=3, NZ=3\n0., 0., 0.,  1., 1., 1.\n"
            "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
            "*SOLID SECTION, ELSET=LOW, MATERIAL=M\n*SOLID SECTION, ELSET=UP, MATERIAL=M\n"
            "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., -1.,  0., 0., 1.\n"
            "*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n0.3\n"
            "*CONTACT PAIR, INTERACTION=DRY\nLOW-ZMIN, GROUND\n"
            "*EQUATION\n2\nUP-ZMIN, 1, 1., LOW-ZMAX, 1, -1.\n2\nUP-ZMIN, 2, 1., LOW-ZMAX, 2, -1.\n"
            "3\nUP-ZMIN, 3, 1., LOW-ZMAX, 3, -1., 901, 3, 0.5\n"
            "*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=900, SURFACE=UP-ZMAX\n*KINEMATIC\n"
            "*CONTACT SOLVER, TOLERANCE=1e-12\n"
            "*STEP\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\n901, 3, 3, 0.01\n900, 1, 2\n900, 4, 5\n"
            "900, 3, 3, -0.02\n900, 6, 6, 0.05\n*END STEP\n"
        )
        alone, together = self.check((2, 3), deck, name="joined")
        with h5py.File(alone.file) as expected:
            for run in together:
                with h5py.File(run.file) as found:
                    for name in ("displacement", "rotation", "reaction_force", "reaction_moment"):
                        name = f"reference_nodes/{name}"
                        largest = np.abs(expected[name][:]).max()
                        self.assertEqual(found[name].shape, (4, 2, 3))
                        error = np.abs(found[name][:] - expected[name][:]).max()
                        self.assertLess(error, 1e-9 * largest, name)

    def test_elements_of_second_order(self):
        for deck in (
            pushed("C3D10", "C3D20", sliding=", SMALL SLIDING"),
            pushed("C3D20R", "C3D10"),
        ):
            with self.subTest(deck=deck[-400:]):
                self.check((2,), with_card(deck, "*CONTACT SOLVER, TOLERANCE=1e-12"), name="deck")

    def test_fewer_elements_than_ranks(self):
        self.check((3,), INPUT / "block.inp", n=1, steps=10, **AUTO)

    def test_a_curved_obstacle(self):
        self.check((2,), INPUT / "tool.inp", tolerance=1e-12)


class Plan(unittest.TestCase):
    def test_the_plan_counts_the_memory_of_all_ranks(self):
        runs = [Run(INPUT / "block.inp", "--plan", command=launch(n), n=8) for n in (1, 2)]
        for run in runs:
            self.assertEqual(run.status, 0, run.errors)
            self.assertFalse(run.file.exists())
        self.assertNotIn("ranks", runs[0].output)
        self.assertRegex(runs[1].output, r"ranks +fixed +2, 2 of them on this machine")

    def test_estimates_hold_within_a_factor(self):
        run = Run(INPUT / "block.inp", command=launch(2), n=16, steps=5, **AUTO)
        with run.result() as result:
            planned = result.estimates
        ratio = planned["peak_memory_bytes"] / counters(run)["peak_memory_bytes"]
        self.assertGreater(ratio, 0.75)
        self.assertLess(ratio, 1.5)


class Failure(unittest.TestCase):
    def test_errors_are_said_once_and_keep_their_status(self):
        # (1) wrong input, (2) nothing holds the cube.
        for status, deck, words in (
            (WRONG_INPUT, "*BLOK\n", "unknown keyword"),
            (NOT_SOLVED, (INPUT / "fall.inp").read_text(encoding="utf-8"), "nothing balances"),
        ):
            with self.subTest(status=status):
                run = Run(deck, name="wrong", command=launch(2))
                self.assertEqual(run.status, status, run.output + run.errors)
                self.assertEqual(run.errors.count(words), 1, run.errors)

    def test_too_little_memory_on_one_rank(self):
        # Enough to join the others, too little for half a factor.
        first = launch(1)
        second = ["-n", "1", "sh", "-c", 'ulimit -v 600000; exec "$@"', "sh", PROGRAM]
        arguments = [str(INPUT / "block.inp"), "--set", "n=24", "--overwrite"]
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [*first, *arguments, ":", *second, *arguments],
                cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False,
            )
        self.assertEqual(done.returncode, MACHINE, done.stdout + done.stderr)
        self.assertRegex(done.stderr, "not enough memory|ulimit -v")

    def test_version_and_help_are_said_once(self):
        for option in ("--version", "--help"):
            done = subprocess.run(
                [*launch(2), option], capture_output=True, text=True, timeout=PATIENCE, check=True
            )
            alone = subprocess.run([SERIAL, option], capture_output=True, text=True, check=True)
            self.assertEqual(done.stdout, alone.stdout)

    def test_a_program_for_one_process_refuses_to_be_several(self):
        run = Run(INPUT / "block.inp", command=launch(2, SERIAL))
        self.assertEqual(run.status, WRONG_INPUT)
        self.assertIn("mpirun has started 2 processes", run.errors)
        self.assertFalse(run.file.exists())


class Killed(unittest.TestCase):
    """A rank that dies, of whatever, takes the others with it."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="bipot-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def arguments(self, *options, **settings):
        """The deck with its settings, and options."""
        settings = {"n": 12, "steps": 200, "solver": "AUTO", "local": "AUTO"} | settings
        words = [f"{name}={value}" for name, value in settings.items()]
        return [INPUT / "block.inp", *(w for word in words for w in ("--set", word)), *options]

    def start(self, *options, **settings):
        """Start a run that takes its time; return mpirun and its ranks' processes, in order."""
        running = subprocess.Popen(
            [*launch(2), *self.arguments(*options, **settings)],
            cwd=self.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )
        self.addCleanup(running.kill)
        return running, ranks_of(running, self.folder / "block.vtkhdf")

    def test_a_killed_rank_ends_the_run(self):
        for victim in (0, 1):
            with self.subTest(victim=victim):
                running, ranks = self.start("--overwrite")
                os.kill(ranks[victim], signal.SIGKILL)
                output = check_end(running, ranks)
                self.assertEqual(running.returncode, 128 + signal.SIGKILL)
                self.assertIn("signal 9 (Killed)", output)
                (self.folder / "block.vtkhdf").unlink()

    def test_the_host_stops_behind_its_increment(self):
        running, ranks = self.start(n=4)
        os.kill(ranks[0], signal.SIGTERM)
        check_end(running, ranks)
        self.assertEqual(running.returncode, 128 + signal.SIGTERM)
        result = self.folder / "block.vtkhdf"
        with h5py.File(result) as file:
            self.assertEqual(status_of(file), "stopped")
        subprocess.run(
            [*launch(3), *self.arguments("--continue", n=4)],
            cwd=self.folder, stdout=subprocess.DEVNULL, timeout=PATIENCE, check=True,
        )
        with h5py.File(result) as file:
            self.assertEqual(status_of(file), "finished")
            self.assertEqual(file["history"].attrs["finished"], 200)

    def test_a_terminated_launcher_takes_its_ranks_along(self):
        running, ranks = self.start()
        running.terminate()
        check_end(running, ranks)


if __name__ == "__main__":
    for needed in (SERIAL, PROGRAM, MPIEXEC):
        if shutil.which(needed) is None:
            print(f"skipped: there is no {needed}")
            sys.exit(77)
    unittest.main(verbosity=2)
