"""The plan beside the run: what was foreseen, what was counted, and what does not fit."""

import os
import re
import resource
import subprocess
import tempfile
import unittest
from pathlib import Path

from program import INPUT, PROGRAM, SOURCE, Result, Run

ODD = SOURCE / "tests" / "deck" / "odd"
AUTO = {"solver": "AUTO", "local": "AUTO"}
MEGABYTE = 1_000_000
NAMES = {
    "increments", "increments_with_fields", "equations", "interface_equations", "factorisations",
    "contact_points", "contact_rows", "compliance_bytes", "contact_matrix_bytes",
    "factor_entries", "file_bytes",
}
RELEASED = """*BLOCK, NAME=BODY, TYPE=C3D8, NX=6, NY=6, NZ=6
0., 0., 0., 1., 1., 1.
*NSET, NSET=SIDE
BODY-XMIN
*MATERIAL, NAME=M
*DENSITY
1.
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=M
*STEP
*STATIC
1., 1.
*BOUNDARY
BODY-ZMIN, 1, 3
{first}*DLOAD
BODY, GRAV, 1., 0., 0., -1.
*END STEP
*STEP
*STATIC
1., 1.
*BOUNDARY, OP=NEW
BODY-ZMIN, 1, 3
{second}*END STEP
"""


def plan_and_run(deck, *options, **settings):
    """Run a deck; return its estimates, their bounds, its counters, and the run."""
    run = Run(deck, *options, **settings)
    if run.status:
        raise AssertionError(run.errors)
    with run.result() as result:
        bounds = result.file["run/estimates"].attrs["bound"].astype(str)
        bounds = dict(zip(result.estimates, bounds, strict=True))
        return result.estimates, bounds, result.counters, run


class Kept(unittest.TestCase):
    def check(self, deck, **settings):
        estimates, bounds, counters, run = plan_and_run(deck, **settings)
        self.assertLessEqual(NAMES, set(estimates))
        self.assertLessEqual(NAMES, set(counters))
        for name, bound in bounds.items():
            if bound == "fixed":
                self.assertEqual(counters[name], estimates[name], name)
            elif bound == "at most":
                self.assertLessEqual(counters[name], estimates[name], name)
        self.assertNotIn("warning: the plan", run.output)
        return estimates, counters

    def test_runs_keep_to_their_plans(self):
        for deck, settings in (
            (INPUT / "block.inp", {"n": 4, "steps": 10}),
            (INPUT / "block.inp", {"n": 4, "steps": 10, "mu": 0, **AUTO}),
            (INPUT / "quarter.inp", {}),
            (INPUT / "tool.inp", {}),
            (INPUT / "rest.inp", {}),
            (INPUT / "cantilever.inp", {}),
            (INPUT / "patch.inp", {}),
            (ODD / "gmsh_hexahedra.inp", {}),
            (ODD / "cube_on_slab.inp", {}),
        ):
            with self.subTest(deck=deck.name, **settings):
                self.check(deck, **settings)

    def test_rows_are_those_that_the_law_needs(self):
        # 25 points below: three rows each, one without friction.
        for mu, rows in ((0.3, 75), (0, 25)):
            estimates, counters = self.check(INPUT / "block.inp", n=4, steps=10, mu=mu, **AUTO)
            self.assertEqual(estimates["contact_rows"], rows)
            self.assertEqual(counters["contact_rows"], rows)
        # Symmetry planes take a tangent from 2 x 2 points of 3 x 3, and both from the corner.
        estimates, counters = self.check(INPUT / "quarter.inp")
        self.assertEqual(estimates["contact_rows"], 4 * 3 + 4 * 2 + 1)
        self.assertEqual(counters["contact_rows"], estimates["contact_rows"])

    def test_bodies_that_only_touch_have_a_block_each(self):
        # Slave and master faces of a stack, unknowns held from above and below left out.
        estimates, counters = self.check(INPUT / "stack.inp")
        entries = estimates["compliance_bytes"] / 8
        self.assertEqual(counters["compliance_bytes"], estimates["compliance_bytes"])
        # High: 4 x 4 nodes; middle: 5 x 5 twice; low: those that it takes for in reach.
        high, middle = 3 * 16, 3 * 50
        low = estimates["interface_equations"] - high - middle
        self.assertEqual(entries, high**2 + middle**2 + low**2)
        run = Run(INPUT / "stack.inp", "--plan")
        self.assertIn(f"3 blocks, the largest {middle} x {middle}, on contact nodes", run.output)

    def test_other_supports_are_another_factorisation(self):
        deck = (INPUT / "block.inp").read_text()
        first, second, third = deck.split("*STEP")
        third = third.replace("*BOUNDARY", "*BOUNDARY\nBODY-XMIN, 2, 2")
        run = Run("*STEP".join((first, second, third)), name="other", n=2, steps=10, **AUTO)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertEqual(result.estimates["factorisations"], 2)
            self.assertEqual(result.counters["factorisations"], 2)
        self.assertNotIn("warning: the plan", run.output)

    def test_the_largest_factor_may_be_a_later_one(self):
        # The second step lets go of a side: more equations, and a factor of more entries.
        deck = RELEASED.format(first="SIDE, 1, 3\n", second="")
        run = self.check(deck, name="released")
        self.assertEqual(run[0]["factor_entries"], run[1]["factor_entries"])
        held = self.check(RELEASED.format(first="SIDE, 1, 3\n", second="SIDE, 1, 3\n"), name="held")
        self.assertGreater(run[0]["factor_entries"], 1.1 * held[0]["factor_entries"])

    def test_the_plan_is_printed_as_it_is_stored(self):
        run = Run(INPUT / "block.inp", "--verbose", n=2, steps=10)
        for line in run.plan.strip().split("\n"):
            self.assertIn(line, run.output)


class Foreseen(unittest.TestCase):
    CASES = (
        (INPUT / "block.inp", {"n": 8, **AUTO}),
        (INPUT / "block.inp", {"n": 8, "mu": 0, **AUTO}),
        (INPUT / "block.inp", {"n": 16, "steps": 10, **AUTO}),
        (INPUT / "hertz.inp", {}),
        (INPUT / "mindlin.inp", {}),
        (INPUT / "tool.inp", {}),
        (INPUT / "rest.inp", {}),
        (ODD / "gmsh_hexahedra.inp", {}),
    )

    @classmethod
    def setUpClass(cls):
        cls.runs = [(deck, settings, plan_and_run(deck, **settings))
                    for deck, settings in cls.CASES]  # fmt: skip

    def test_memory_and_file_within_a_quarter(self):
        for deck, settings, (estimates, _, counters, run) in self.runs:
            with self.subTest(deck=deck.name, **settings):
                self.assertAlmostEqual(
                    estimates["peak_memory_bytes"] / counters["peak_memory_bytes"], 1, delta=0.25
                )
                self.assertAlmostEqual(
                    estimates["likely_file_bytes"] / run.file.stat().st_size, 1, delta=0.25
                )

    def test_what_takes_the_time_is_counted_right(self):
        # The time itself is the machine's: studies/run plan, where nobody else works.
        for deck, settings, (estimates, _, counters, _) in self.runs:
            with self.subTest(deck=deck.name, **settings):
                self.assertGreater(estimates["cpu_seconds"], 0)
                for name, within in (("solutions", 3), ("compliance_products", 10)):
                    ratio = estimates[name] / counters[name]
                    self.assertLess(1 / within, ratio, name)
                    self.assertLess(ratio, within, name)


class Threads(unittest.TestCase):
    """Idle processors factorise, unless somebody has said how many threads there are to be."""

    def plan(self, processors=None, **environment):
        words = [PROGRAM, INPUT / "block.inp", "--plan"]
        for name, value in {"n": 24, **AUTO}.items():
            words += ["--set", f"{name}={value}"]
        variables = {k: v for k, v in os.environ.items() if not k.endswith("_NUM_THREADS")}
        done = subprocess.run(
            words, capture_output=True, text=True, check=False, env={**variables, **environment},
            preexec_fn=processors and (lambda: os.sched_setaffinity(0, processors)),
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return re.findall(r"\nthreads +fixed +(\d+) while the stiffness", done.stdout)

    def test_the_environment_has_the_say(self):
        for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
            for number in ("1", "2"):
                self.assertEqual(self.plan(**{variable: number}), [])

    def test_no_more_than_the_process_may_use(self):
        allowed = sorted(os.sched_getaffinity(0))
        self.assertEqual(self.plan(processors=allowed[:1]), [])
        for number in self.plan():
            self.assertIn(int(number), range(2, len(allowed) + 1))


class Limited(unittest.TestCase):
    def limited(self, kind, megabytes, *words, folder=None):
        """Run the program with a limit of its own on addresses or on the size of files."""
        return subprocess.run(
            [PROGRAM, *map(str, words)], capture_output=True, text=True, timeout=600, check=False,
            cwd=folder,
            preexec_fn=lambda: resource.setrlimit(kind, (megabytes * MEGABYTE,) * 2),
        )

    def call(self, n, megabytes, *words, deck=INPUT / "block.inp", folder=None):
        settings = ("--set", f"n={n}", "--set", "solver=AUTO", "--set", "local=AUTO")
        return self.limited(
            resource.RLIMIT_AS, megabytes, deck, *settings, *words, folder=folder
        )


class Refused(Limited):
    def test_what_fits_ends_with_0_and_writes_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            answer = self.limited(
                resource.RLIMIT_AS, 4000, INPUT / "block.inp", "--plan", folder=folder
            )
            self.assertEqual(answer.returncode, 0, answer.stderr)
            self.assertEqual(os.listdir(folder), [])

    def test_too_little_memory_ends_with_3_and_says_what_would_fit(self):
        answer = self.call(32, 560, "--plan")
        self.assertEqual(answer.returncode, 3)
        found = re.search(
            r"needs about (\d+) MB of memory, and (\d+) MB are free.* elements ([\d.]+) times",
            answer.stderr,
        )
        self.assertIsNotNone(found, answer.stderr)
        needs, left, coarser = map(float, found.groups())
        self.assertGreater(needs, left)
        self.assertGreater(coarser, 1)
        self.assertEqual(self.call(int(32 / coarser), 560, "--plan").returncode, 0)

    def test_a_run_is_refused_before_it_begins(self):
        with tempfile.TemporaryDirectory() as folder:
            answer = self.limited(
                resource.RLIMIT_AS, 330, INPUT / "block.inp", "--set", "n=24", folder=folder
            )
            self.assertEqual(answer.returncode, 3)
            self.assertIn("nothing was run", answer.stderr)
            self.assertEqual(os.listdir(folder), [])

    def test_a_mesh_that_cannot_be_analysed_is_refused_at_once(self):
        answer = self.call(60, 500, "--plan")
        self.assertEqual(answer.returncode, 3)
        self.assertIn("needs more than", answer.stderr)

    def test_forced_it_goes_on(self):
        answer = self.call(24, 360, "--plan", "--force")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertIn("warning: the run needs about", answer.stdout)

    def test_too_little_disk_names_the_frequency_that_fits(self):
        answer = self.limited(
            resource.RLIMIT_FSIZE, 5, INPUT / "block.inp", "--set", "n=16", "--plan"
        )
        self.assertEqual(answer.returncode, 3)
        found = re.search(r"FREQUENCY=(\d+) it would fit", answer.stderr)
        self.assertIsNotNone(found, answer.stderr)
        deck = (INPUT / "block.inp").read_text().replace(
            "*END STEP", f"*NODE FILE, FREQUENCY={found[1]}\nU, RF\n*CONTACT FILE\n*END STEP", 1
        )
        with tempfile.NamedTemporaryFile("w", suffix=".inp") as file:
            file.write(deck)
            file.flush()
            words = (file.name, "--set", "n=16")
            answer = self.limited(resource.RLIMIT_FSIZE, 5, *words, "--plan")
            self.assertEqual(answer.returncode, 0, answer.stderr)

    def test_no_room_for_the_libraries_is_told(self):
        answer = self.call(2, 150, "--plan")
        self.assertEqual(answer.returncode, 3)
        self.assertIn("ulimit -v", answer.stderr)


class Chosen(Limited):
    """What the deck leaves open is chosen so that the run fits."""

    def chosen(self, megabytes, card=""):
        """Run the block with n = 16 in so many megabytes; return the arithmetic, and the forces."""
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "block.inp"
            text = (INPUT / "block.inp").read_text()
            deck.write_text(text.replace("*STEP\n", f"{card}*STEP\n", 1))
            words = ("--set", "steps=5")
            answer = self.call(16, megabytes, *words, deck=deck, folder=folder)
            self.assertEqual(answer.returncode, 0, answer.stderr)
            kept = sorted(os.listdir(folder))
            self.assertEqual(kept, ["block.inp", "block.vtkhdf", "block.xdmf"])
            with Result(Path(folder) / "block.vtkhdf") as result:
                plan = result.run_text("plan")
                factor = re.search(r"LDL\^T, (.*?core)", plan)
                why = re.search(r"^chosen +(.*)", plan, re.MULTILINE)
                self.assertTrue(result.history("certified").all())
                return factor[1], why and why[1], result.pairs[0].reaction

    def test_less_memory_takes_another_arithmetic(self):
        room, why, expected = self.chosen(4000)
        self.assertEqual(room, "double precision, in core")
        self.assertIsNone(why)
        for megabytes, arithmetic in (
            (365, "single precision, in core"), (330, "single precision, out of core"),
        ):
            with self.subTest(megabytes=megabytes):
                factor, why, found = self.chosen(megabytes)
                self.assertEqual(factor, arithmetic)
                self.assertIn(f"{arithmetic}: double precision, in core, needs", why)
                self.assertLess(abs(found - expected).max(), 1e-7 * abs(expected).max())

    def test_what_the_deck_says_is_kept(self):
        factor, why, _ = self.chosen(365, "*PRECISION, FACTOR=DOUBLE\n")
        self.assertEqual(factor, "double precision, out of core")
        self.assertIn("double precision, in core, needs", why)
        factor, why, _ = self.chosen(4000, "*PRECISION, FACTOR=SINGLE, OUT OF CORE=YES\n")
        self.assertEqual(factor, "single precision, out of core")
        self.assertIsNone(why)
        factor, why, _ = self.chosen(4000, "*PRECISION, FACTOR=AUTO, OUT OF CORE=AUTO\n")
        self.assertEqual(factor, "double precision, in core")

    def test_nothing_else_is_chosen_where_all_is_said(self):
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "block.inp"
            card = "*PRECISION, FACTOR=DOUBLE, OUT OF CORE=NO\n"
            text = (INPUT / "block.inp").read_text().replace("*STEP\n", f"{card}*STEP\n", 1)
            deck.write_text(text)
            answer = self.call(16, 365, "--plan", deck=deck)
            self.assertEqual(answer.returncode, 3, answer.stdout)
            self.assertIn("double precision, in core", answer.stdout)
            self.assertNotIn("chosen", answer.stdout)


if __name__ == "__main__":
    unittest.main()
