"""Contact problems in FCLIB's layout: read, solved, written, and exported from decks."""

import re
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from fclib_file import Solved, read_local, residual, write_global, write_local
from program import INPUT, Run

BLOCK = INPUT / "block.inp"
SOLVERS = [
    ("--solver", "auto"),
    ("--solver", "global-newton"),
    ("--solver", "SWEEPS"),
    ("--local", "uzawa", "--rho", "0.5"),
    ("--local", "newton6", "--relaxation", "0.7"),
    ("--local", "exact"),
    ("--solver", "sweeps", "--formulation", "pseudopotential"),
]
HELD = """*HEADING
A quarter of a block: planes of symmetry at x = 0 and y = 0
*BLOCK, NAME=BODY, ELSET=BODY, TYPE=C3D8, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, GROUND
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP
*STATIC, DIRECT
0.5, 1.0
*BOUNDARY
BODY-XMIN, 1, 1, 0.
BODY-YMIN, 2, 2, 0.
BODY-ZMAX, 3, 3, -0.1
*END STEP
"""


def two_points(seed=1):
    """A regular problem of two points, one of them pressed."""
    factor = np.random.default_rng(seed).normal(size=(6, 6))
    return factor @ factor.T + np.eye(6), np.array([-1.0, 0.3, 0.1, -0.5, -0.2, 0.4]), [0.3, 0.6]


def stack(n, mu):
    """Rigid blocks of mass and inertia 1 on one another, touching at four corners each."""
    h, v = np.zeros((12 * n, 6 * n)), []
    for b in range(n):
        v += [0.3 * np.sin(b + 1), 0.2 * np.cos(b + 1), -1]
        v += [0.05 * np.sin(2 * b), 0.1 * np.cos(3 * b), 0.2]
        for point, corner in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
            for a, axis in enumerate(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])):
                row = h[12 * b + 3 * point + a]
                row[6 * b : 6 * b + 6] = *axis, *np.cross([*corner, -1], axis)
                if b:
                    row[6 * b - 6 : 6 * b] = *-axis, *-np.cross([*corner, 1], axis)
    return h @ h.T, h @ np.array(v), np.full(4 * n, mu)


class Folder(unittest.TestCase):
    """Every test in a folder of its own."""

    def setUp(self):
        """Make it."""
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)
        self.path = self.folder / "problem.hdf5"


class Export(unittest.TestCase):
    """--export-fclib."""

    def check_reactions(self, run, row):
        """What was exported is the increment: its reactions solve it, and nothing else does."""
        exported = run.folder / f"{run.deck.stem}-{row}.fclib.hdf5"
        w, q, mu = read_local(exported)
        np.testing.assert_array_equal(w, w.T)
        with run.result() as result:
            reaction = result.pairs[0].reaction[row - 1]
        scale = np.abs(reaction).max()
        with h5py.File(exported) as file:
            r, u = file["solution/r"][()], file["solution/u"][()]
        np.testing.assert_allclose(r.reshape(-1, 3), reaction, rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(u, w @ r + q, rtol=0, atol=1e-12)
        self.assertLess(residual(w, q, mu, r), 1e-8)
        for options in SOLVERS:
            with self.subTest(options=options):
                solved = Solved(exported, *options, "--tolerance", "1e-10", "--overwrite")
                self.assertEqual(solved.status, 0, solved.errors)
                found = solved.read("r").reshape(-1, 3)
                np.testing.assert_allclose(found, reaction, rtol=0, atol=1e-7 * scale)

    def test_block_is_exported_and_solved_again(self):
        run = Run(BLOCK, "--export-fclib", "1,15,30-32", n=2)
        self.assertEqual(run.status, 0, run.errors)
        names = sorted(path.name for path in run.folder.glob("*.hdf5"))
        self.assertEqual(names, [f"block-{row}.fclib.hdf5" for row in (1, 15, 30, 31, 32)])
        for row in (1, 15, 30):
            self.check_reactions(run, row)

    def test_guess_is_where_the_increment_started(self):
        run = Run(BLOCK, "--export-fclib", "15", n=2)
        with run.result() as result, h5py.File(run.folder / "block-15.fclib.hdf5") as file:
            before = result.pairs[0].reaction[13]
            guess = file["guesses/1/r"][()].reshape(-1, 3)
            np.testing.assert_allclose(guess, before, rtol=0, atol=1e-12 * np.abs(before).max())

    def test_points_on_symmetry_planes_keep_their_reactions(self):
        run = Run(HELD, "--export-fclib", "all", name="held")
        self.assertEqual(run.status, 0, run.errors)
        self.assertEqual(len(list(run.folder.glob("*.hdf5"))), 2)
        self.check_reactions(run, 2)

    def test_frictionless_points_keep_their_reactions(self):
        run = Run(BLOCK, "--export-fclib", "20", n=2, mu=0)
        self.assertEqual(run.status, 0, run.errors)
        self.check_reactions(run, 20)

    def test_an_increment_that_nothing_balances_is_exported_too(self):
        # The first step presses the cube on a plane without friction, the second pushes it along.
        deck = """\
*BLOCK, NAME=CUBE, TYPE=C3D8, NX=1, NY=1, NZ=1
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=CUBE, MATERIAL=SOFT
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
CUBE-ZMIN, FLOOR
*STEP
*STATIC, DIRECT
1., 1.
*DLOAD
CUBE, GRAV, 10., 0., 0., -1.
*END STEP
*STEP
*STATIC, DIRECT
1., 1.
*DLOAD
CUBE, GRAV, 1., 1., 0., 0.
*END STEP
"""
        run = Run(deck, "--export-fclib", "2", name="pushed")
        self.assertEqual(run.status, 2)
        self.assertIn("nothing balances the loads", run.errors)
        self.assertEqual(len(run.errors.splitlines()), 3, run.errors)
        with h5py.File(run.folder / "pushed-2.fclib.hdf5") as file:
            guess = file["guesses/1/r"][()].reshape(-1, 3)
        # The increment before it carries the weight.
        np.testing.assert_allclose(guess.sum(axis=0), (10, 0, 0), rtol=0, atol=1e-8)

    def test_lists_that_make_no_sense_are_refused(self):
        for text in ("0", "51", "3-1", "1,,2", "x", "1-", "-3", "1 2", "99999999999", "all,1"):
            with self.subTest(text=text):
                run = Run(BLOCK, "--export-fclib", text, n=1)
                self.assertEqual(run.status, 1)
                self.assertEqual(len(run.errors.splitlines()), 1)
                self.assertIn("--export-fclib", run.errors)
                self.assertFalse(run.file.exists())


class Solve(Folder):
    """bipot PROBLEM.hdf5."""

    def test_every_storage_gives_the_same(self):
        w, q, mu = two_points()
        found = []
        for storage in ("rows", "columns", "triplets", "swapped"):
            write_local(self.path, w, q, mu, storage)
            solved = Solved(self.path)
            self.assertEqual(solved.status, 0, solved.errors)
            found.append(solved.read("r"))
            self.assertLess(residual(w, q, np.array(mu), found[-1]), 1.01e-8)
        for r in found[1:]:
            np.testing.assert_array_equal(r, found[0])

    def test_solution_file_is_a_whole_problem(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        with h5py.File(self.path, "a") as file:
            file["guesses/number_of_guesses"] = np.array([0], dtype=np.int32)
            file["fclib_local/info/title"] = "two points"
        first = Solved(self.path)
        copied = read_local(first.file)
        for original, copy in zip((w, q, mu), copied, strict=True):
            np.testing.assert_array_equal(original, copy)
        np.testing.assert_allclose(first.read("u"), w @ first.read("r") + q, rtol=0, atol=1e-14)
        self.assertEqual(first.fact("converged"), 1)
        self.assertLessEqual(first.fact("residual"), 1e-8)
        for entry in ("penetration", "adhesion", "complementarity", "cone", "law"):
            self.assertLessEqual(first.fact(entry), 1e-7)
        again = Solved(first.file)
        self.assertEqual(again.status, 0, again.errors)
        np.testing.assert_array_equal(again.read("r"), first.read("r"))

    # By hand: v = (r + f)/2, u = v + w. Normal: (r_n - 4)/2 + 1 = 0, so r_n = 2. Tangent: stick
    # needs r_t = -1; at mu = 0.25 it slides with r_t = -0.5, u_t = 0.25.
    def test_global_problem_by_hand(self):
        for mu, r, u in ((1.0, [2, -1, 0], [0, 0, 0]), (0.25, [2, -0.5, 0], [0, 0.25, 0])):
            write_global(self.path, 2 * np.eye(3), np.eye(3), [-4, 1, 0], [1, 0, 0], [mu])
            solved = Solved(self.path, "--tolerance", "1e-12")
            self.assertEqual(solved.status, 0, solved.errors)
            np.testing.assert_allclose(solved.read("r"), r, rtol=0, atol=1e-10)
            np.testing.assert_allclose(solved.read("u"), u, rtol=0, atol=1e-10)
            np.testing.assert_allclose(solved.read("v"), np.subtract(u, [1, 0, 0]), atol=1e-10)

    def test_one_triangle_of_m_is_mirrored(self):
        random = np.random.default_rng(3)
        m = random.normal(size=(7, 7))
        m = m @ m.T + 7 * np.eye(7)
        h, f = random.normal(size=(7, 6)), random.normal(size=7)
        w, mu = np.array([-1, 0.1, 0, -0.5, 0, 0.2]), [0.4, 0.2]
        compliance, free = h.T @ np.linalg.solve(m, h), w + h.T @ np.linalg.solve(m, f)
        for given in (m, np.triu(m), np.tril(m)):
            for storage in ("triplets", "swapped", "rows", "columns"):
                write_global(self.path, given, h, f, w, mu, storage)
                solved = Solved(self.path)
                self.assertEqual(solved.status, 0, solved.errors)
                self.assertLess(residual(compliance, free, mu, solved.read("r")), 1.1e-8)
                self.assertLess(solved.fact("equilibrium"), 1e-12)
                balance = m @ solved.read("v") - h @ solved.read("r") - f
                np.testing.assert_allclose(balance, 0, atol=1e-12)

    def test_thousands_of_unknowns_are_no_burden(self):
        n = 20000
        chain = np.arange(n)
        with h5py.File(self.path, "w") as file:
            group = file.create_group("fclib_global")
            group["spacedim"] = np.array([3], dtype=np.int32)
            rows = np.concatenate([chain, chain[:-1]])
            columns = np.concatenate([chain, chain[1:]])
            values = np.concatenate([np.full(n, 2.1), np.full(n - 1, -1.0)])
            matrices = {"M": (n, n, rows, columns, values)}
            matrices["H"] = (n, 6, np.arange(6) * 3000, np.arange(6), np.ones(6))
            for name, (m, k, i, p, x) in matrices.items():
                for key, number in {"m": m, "n": k, "nz": len(x), "nzmax": len(x)}.items():
                    group[f"{name}/{key}"] = np.array([number], dtype=np.int32)
                group[f"{name}/i"], group[f"{name}/p"] = i.astype(np.int32), p.astype(np.int32)
                group[f"{name}/x"] = x
            vectors = {"f": np.full(n, -1.0), "w": np.full(6, 0.1), "mu": [0.3, 0.3]}
            for name, values in vectors.items():
                group[f"vectors/{name}"] = np.asarray(values)
        solved = Solved(self.path)
        self.assertEqual(solved.status, 0, solved.errors)
        self.assertLess(solved.fact("equilibrium"), 1e-12)

    def test_tangents_that_cannot_move_need_no_row(self):
        write_local(self.path, np.diag([2.0, 1.0, 0.0]), [-1.0, 0.2, 0.0], [0.2])
        solved = Solved(self.path, "--tolerance", "1e-12")
        self.assertEqual(solved.status, 0, solved.errors)
        np.testing.assert_allclose(solved.read("r"), [0.5, -0.1, 0], rtol=0, atol=1e-11)

    def test_frictionless_points_slip_freely(self):
        write_local(self.path, [[2, 1, 0], [1, 2, 0], [0, 0, 0]], [-1, 0.2, 3], [0])
        solved = Solved(self.path, "--tolerance", "1e-12")
        self.assertEqual(solved.status, 0, solved.errors)
        np.testing.assert_allclose(solved.read("r"), [0.5, 0, 0], rtol=0, atol=1e-11)
        np.testing.assert_allclose(solved.read("u"), [0, 0.7, 3], rtol=0, atol=1e-11)

    def test_slightly_asymmetric_w_is_solved_as_it_is(self):
        w, q, mu = two_points()
        w[0, 4] += 0.01
        write_local(self.path, w, q, mu)
        solved = Solved(self.path)
        self.assertEqual(solved.status, 0, solved.errors)
        self.assertIn("not symmetric", solved.output)
        self.assertLess(residual(w, q, mu, solved.read("r")), 1.01e-8)

    def test_units_change_nothing(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        r = Solved(self.path).read("r")
        for length, force in ((1e-12, 1e9), (1e10, 1e-10)):
            write_local(self.path, w * length / force, q * length, mu)
            solved = Solved(self.path)
            self.assertEqual(solved.status, 0, solved.errors)
            np.testing.assert_allclose(solved.read("r") / force, r, rtol=1e-6)

    def test_what_is_not_solved_is_said_and_kept(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        solved = Solved(self.path, "--solver", "sweeps", "--max-sweeps", "2")
        self.assertEqual(solved.status, 2)
        self.assertEqual(len(solved.errors.splitlines()), 1)
        self.assertIn("not solved to 1e-8", solved.errors)
        self.assertEqual(solved.fact("converged"), 0)
        self.assertGreater(solved.fact("residual"), 1e-8)
        found = residual(w, q, mu, solved.read("r"))
        self.assertAlmostEqual(found / solved.fact("residual"), 1, places=5)

    def test_a_tolerance_in_reach_is_named_and_is_met(self):
        w, q, mu = stack(3, 0.3)
        write_local(self.path, w, q, mu)
        named = []
        for sweeps in range(20, 2000, 20):
            options = ("--solver", "sweeps", "--max-sweeps", str(sweeps))
            solved = Solved(self.path, *options)
            if solved.status == 0:
                break
            near = solved.fact("residual") <= 1e-6
            self.assertEqual("would be met" in solved.errors, near, solved.errors)
            if near:
                tolerance = re.search(r"a tolerance of (\S+) would be met", solved.errors).group(1)
                self.assertLessEqual(float(tolerance), 2.1 * solved.fact("residual"))
                named.append(Solved(self.path, *options, "--tolerance", tolerance).status)
        self.assertTrue(named)
        self.assertEqual(set(named), {0})

    # Rigid bodies make W singular: 12 rows a block of rank 6, and a band.
    def test_stacks_of_rigid_blocks(self):
        for n, mu, most in ((10, 0.3, 100), (10, 0.7, 50), (20, 0.7, 60)):
            with self.subTest(n=n, mu=mu):
                w, q, mu = stack(n, mu)
                write_local(self.path, w, q, mu)
                solved = Solved(self.path)
                self.assertEqual(solved.status, 0, solved.errors)
                self.assertLess(residual(w, q, mu, solved.read("r")), 1.01e-8)
                self.assertLessEqual(solved.fact("iterations"), most)
                self.assertGreater(solved.fact("processor_seconds"), 0)

    def test_other_files_are_not_replaced(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        original = self.path.read_bytes()
        other = self.folder / "notes.txt"
        other.write_text("not to be lost")
        for output in (other, self.path, self.folder):
            solved = Solved(self.path, output=output)
            self.assertEqual(solved.status, 1)
            self.assertEqual(len(solved.errors.splitlines()), 1)
        self.assertEqual(other.read_text(), "not to be lost")
        self.assertEqual(self.path.read_bytes(), original)
        for _ in range(2):
            self.assertEqual(Solved(self.path).status, 0)
        # Not even then: it is what is read.
        forced = Solved(self.path, "--overwrite", output=self.path)
        self.assertEqual(forced.status, 1)
        self.assertEqual(self.path.read_bytes(), original)
        forced = Solved(self.path, "--overwrite", output=other)
        self.assertEqual(forced.status, 0, forced.errors)
        self.assertEqual(sorted(path.suffix for path in self.folder.iterdir()), [
            ".hdf5", ".hdf5", ".txt"])

    def test_options_of_the_other_kind_are_refused(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        wrong = [
            ("--plan",),
            ("--set", "n=1"),
            ("--export-fclib", "1"),
            ("--solver", "newton"),
            ("--solver",),
            ("--rho", "-1"),
            ("--rho", "nan"),
            ("--relaxation", "2"),
            ("--max-sweeps", "1.5"),
            ("--tolerance", "0"),
            ("--solver", "global-newton", "--local", "exact"),
        ]
        for options in wrong:
            with self.subTest(options=options):
                solved = Solved(self.path, *options)
                self.assertEqual(solved.status, 1)
                self.assertEqual(len(solved.errors.splitlines()), 1)
                self.assertFalse(solved.file.exists())
        solved = Solved(self.path, "--local", "newtn6")
        wanted = "--local must be UZAWA, NEWTON, NEWTON6, EXACT or AUTO, not 'newtn6'"
        self.assertIn(f"bipot: error: {wanted}; did you mean NEWTON6?", solved.errors)
        run = Run(BLOCK, "--solver", "auto", n=1)
        self.assertEqual(run.status, 1)
        self.assertIn("*CONTACT SOLVER", run.errors)


class Hostile(Folder):
    """Wrong files: one clear line, status 1, nothing written."""

    def check_refused(self, *words):
        solved = Solved(self.path)
        self.assertEqual(solved.status, 1, solved.errors)
        self.assertEqual(len(solved.errors.splitlines()), 1, solved.errors)
        for word in (self.path.name, *words):
            self.assertIn(word, solved.errors)
        self.assertFalse(solved.file.exists())

    def put(self, name, values):
        """Replace a dataset of the problem; None takes it away."""
        with h5py.File(self.path, "a") as file:
            group = "fclib_global" if "fclib_global" in file else "fclib_local"
            if f"{group}/{name}" in file:
                del file[f"{group}/{name}"]
            if values is not None:
                file[f"{group}/{name}"] = values

    def test_wrong_datasets_of_a_local_problem(self):
        w, q, mu = two_points()
        entries = 36
        integers = np.arange(entries, dtype=np.int32)
        wrong = {
            "spacedim": [None, [2], [4], [3, 3], "three", []],
            "W/m": [None, [5], [-1], [0], [2**31 - 1], [2**40], [1.5e300]],
            "W/n": [None, [7], [2**62]],
            "W/nz": [[36], [37], [-3], [-1, -1], None],
            "W/p": [None, integers, [0], [0, 6, 12, 18, 24, 30, 37], [0, 6, 3, 18, 24, 30, 36],
                    [1, 6, 12, 18, 24, 30, 36], [-6, 6, 12, 18, 24, 30, 36], "six"],
            "W/i": [None, integers, -integers, integers[:5], np.full(entries, 2**31 - 1)],
            "W/x": [None, np.full(entries, np.nan), np.full(entries, np.inf), np.zeros(entries),
                    np.full(entries, 1e300), np.ones(5), -np.ones(entries), "x"],
            "vectors/q": [None, q[:5], np.append(q, 0), np.full(6, np.nan), np.full(6, -np.inf)],
            "vectors/mu": [None, [0.3], [0.3, -0.1], [0.3, np.nan], [], np.full(10000, 0.3)],
            "G/m": [[1]],
            "V/m": [[1]],
        }
        for name, choices in wrong.items():
            for values in choices:
                with self.subTest(name=name, values=str(values)[:40]):
                    write_local(self.path, w, q, mu)
                    self.put(name, values)
                    self.check_refused()

    def test_wrong_datasets_of_a_global_problem(self):
        wrong = {
            "M/x": [[2, np.nan, 2], [2, -2, 2], [0, 0, 0], [2]],
            "M/m": [[4]],
            "M/i": [[0, 1, 3], [0, 1, -1]],
            "H/x": [[0, 0, 0], [np.inf, 1, 1]],
            "H/n": [[2]],
            "H/m": [[2], [2**31 - 1]],
            "vectors/f": [[1, 2], [1, 2, np.nan], None],
            "vectors/w": [[1, 2], None],
        }
        for name, choices in wrong.items():
            for values in choices:
                with self.subTest(name=name, values=str(values)):
                    write_global(self.path, 2 * np.eye(3), np.eye(3), [-4, 1, 0], [1, 0, 0], [1])
                    self.put(name, values)
                    self.check_refused()

    def test_m_that_is_not_positive_definite_is_named(self):
        for m in (np.diag([1.0, -1, 1]), [[1, 2, 0], [2, 1, 0], [0, 0, 1]]):
            write_global(self.path, m, np.eye(3), [-4, 1, 0], [1, 0, 0], [1])
            self.check_refused("M is not positive definite")
        m = [[2, 1, 0], [0.5, 2, 0], [0, 0, 1]]
        write_global(self.path, m, np.eye(3), [1, 1, 0], [1, 1, 1], [1])
        self.check_refused("M is not symmetric")

    def test_points_that_cannot_move_are_named(self):
        write_local(self.path, np.diag([0.0, 1, 1, 2, 2, 2]), np.ones(6), [0.3, 0.3])
        self.check_refused("point 1", "along n")
        write_local(self.path, np.diag([1.0, 1, 1, 2, 0, 2]), np.ones(6), [0.3, 0.3])
        self.check_refused("point 2", "along t1")

    def test_claims_larger_than_the_file_are_refused(self):
        w, q, mu = two_points()
        for name in ("W/x", "W/i", "W/p", "vectors/q", "vectors/mu"):
            write_local(self.path, w, q, mu)
            with h5py.File(self.path, "a") as file:
                group = file["fclib_local"]
                kind = group[name].dtype
                del group[name]
                group.create_dataset(name, shape=(2**33,), dtype=kind, chunks=(1024,))
            self.check_refused("more numbers than the file holds")

    def test_other_things_under_a_dataset_s_name(self):
        w, q, mu = two_points()
        for name in ("W/x", "vectors/q", "spacedim"):
            write_local(self.path, w, q, mu)
            with h5py.File(self.path, "a") as file:
                del file[f"fclib_local/{name}"]
                file.create_group(f"fclib_local/{name}")
            self.check_refused()
            with h5py.File(self.path, "a") as file:
                del file[f"fclib_local/{name}"]
                file[f"fclib_local/{name}"] = h5py.SoftLink(f"/fclib_local/{name}")
            self.check_refused()

    def test_files_that_are_none(self):
        self.check_refused("no such file")
        self.path.write_bytes(b"")
        self.check_refused()
        self.path.write_text("*HEADING\n")
        self.check_refused("not an HDF5 file")
        with h5py.File(self.path, "w") as file:
            file["something"] = 1
        self.check_refused("no FCLIB problem")

    def test_files_cut_anywhere_never_crash(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        whole = self.path.read_bytes()
        for length in range(8, len(whole), 397):
            self.path.write_bytes(whole[:length])
            self.check_refused()

    def test_files_with_wrong_bytes_never_crash(self):
        w, q, mu = two_points()
        write_local(self.path, w, q, mu)
        whole = bytearray(self.path.read_bytes())
        random = np.random.default_rng(11)
        for _ in range(60):
            damaged = bytearray(whole)
            for place in random.integers(8, len(whole), 3):
                damaged[place] = random.integers(0, 256)
            self.path.write_bytes(damaged)
            solved = Solved(self.path, "--overwrite")
            self.assertIn(solved.status, (0, 1, 2), solved.errors)
            self.assertLessEqual(len(solved.errors.splitlines()), 1, solved.errors)


if __name__ == "__main__":
    unittest.main()
