"""The table of contact forces at the end of a run: values by hand, errors, digits, and who says it.

Two cubes of nu = 0 whose feet are pressed on a plane by 10 and 20 on unit faces: the stress is
uniform and the pressures are the forces. In a second step supports drive all of one along
(0.03, -0.04), of the other along x by 0.05, so that both slide by 0.05 with the friction that
mu = 0.3 allows, against their ways.
"""

import re
import subprocess
import unittest

import numpy as np
from program import ASKED, INPUT, PROGRAM, Run

from bipot.summary import known_digits, row_in_words, summarize

BODIES = """*HEADING
Two cubes on a plane
*BLOCK, NAME=B, NX=2, NY=2, NZ=1
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=C, NX=1, NY=1, NZ=1
5., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*SOLID SECTION, ELSET=C, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
C-ZMIN, O
B-ZMIN, O
*CONTACT SOLVER, TOLERANCE=1e-10
"""
STEPS = """*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
B, 1, 2
C, 1, 2
*DSLOAD
B-ZMAX, P, 10.
C-ZMAX, P, 20.
*END STEP
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
B, 1, 1, 0.03
B, 2, 2, -0.04
C, 1, 1, 0.05
*END STEP
"""
# step, pair, normal force, friction, largest pressure, largest slip
BY_HAND = [
    (1, "C-ZMIN:O", (0, 0, 20), (0, 0, 0), 20, 0),
    (1, "B-ZMIN:O", (0, 0, 10), (0, 0, 0), 10, 0),
    (2, "C-ZMIN:O", (0, 0, 20), (-6, 0, 0), 20, 0.05),
    (2, "B-ZMIN:O", (0, 0, 10), (-1.8, 2.4, 0), 10, 0.05),
]
HEAD = "step  pair"


def table_of(output):
    """The cells of the table in what a run prints."""
    lines = output.splitlines()
    (start,) = (k for k, line in enumerate(lines) if line.startswith(HEAD))
    rows = []
    for line in lines[start:]:
        if line.strip().startswith("-"):
            break
        rows.append(re.split(r"\s{2,}", line.strip()))
    return rows


def vector(text):
    """The numbers of "(1, 2, 3)"."""
    return [float(part) for part in text.strip("()").split(",")]


def without_pandas(result):
    """The rows of a summary by step and pair."""
    return {(row["step"], row["pair"]): row for row in summarize(result)}


class OfAHandCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_of_deck = Run(BODIES + STEPS, name="cubes")

    def test_the_console_has_the_values(self):
        self.assertEqual(self.run_of_deck.status, 0, self.run_of_deck.errors)
        head, *rows = table_of(self.run_of_deck.output)
        self.assertEqual(head[:4], ["step", "pair", "normal force (x, y, z)", "error"])
        for row, (step, pair, normal, friction, pressure, slip) in zip(rows, BY_HAND, strict=True):
            self.assertEqual((int(row[0]), row[1]), (step, pair))
            np.testing.assert_allclose(vector(row[2]), normal, atol=1e-6)
            np.testing.assert_allclose(vector(row[4]), friction, atol=1e-6)
            np.testing.assert_allclose(float(row[6]), pressure, rtol=1e-6)
            np.testing.assert_allclose(float(row[8]), slip, atol=1e-9)
            # One run says nothing of the errors of pressures and slips.
            self.assertEqual((row[7], row[9]), ("-", "-"))
        self.assertIn("\n      - error not estimated\n", self.run_of_deck.output)

    def test_python_has_the_values_and_the_errors(self):
        with self.run_of_deck.result() as result:
            rows = without_pandas(result)
            total = result.history("error/total")[result.step_ends]
        for step, pair, normal, friction, pressure, slip in BY_HAND:
            row = rows[step, pair]
            for name, expected in (("normal_force", normal), ("friction_force", friction)):
                found = [row[f"{name}_{axis}"] for axis in "xyz"]
                np.testing.assert_allclose(found, expected, atol=1e-7)
                # Of the largest resultant at that time: that of C.
                largest = 20 if step == 1 else np.hypot(20, 6)
                np.testing.assert_allclose(row[f"{name}_error"], total[step - 1] * largest,
                                           rtol=1e-6)
            np.testing.assert_allclose(row["largest_pressure"], pressure, rtol=1e-7)
            np.testing.assert_allclose(row["largest_slip"], slip, atol=1e-9)
            self.assertTrue(np.isnan(row["largest_pressure_error"]))
            self.assertTrue(np.isnan(row["largest_slip_error"]))

    def test_stored_forces_are_the_sums_of_the_reactions(self):
        with self.run_of_deck.result() as result:
            for pair in result.pairs.values():
                normal = np.einsum("tp,tpx->tx", pair.reaction[:, :, 0], pair.frame[:, :, 0])
                np.testing.assert_allclose(pair.normal_force, normal, atol=1e-12)
                np.testing.assert_allclose(pair.normal_force + pair.friction_force,
                                           pair.resultant, atol=1e-12)
                slip = np.linalg.norm(pair.slip, axis=2).max(axis=1)
                np.testing.assert_allclose(pair.largest_slip, slip, rtol=1e-14)
                np.testing.assert_allclose(pair.largest_pressure, pair.pressure.max(axis=1))

    def test_quiet_prints_the_closing_line_alone(self):
        run = Run(BODIES + STEPS, "--quiet", name="cubes")
        self.assertEqual(len(run.output.splitlines()), 1)

    def test_a_run_that_goes_on_tells_of_all_steps(self):
        run = Run(BODIES + STEPS + FREE, name="cubes")
        self.assertEqual(run.status, 2, run.output)
        # What is done is told, also of a run that is not solved.
        self.assertEqual(table_of(run.output)[1:], table_of(self.run_of_deck.output)[1:])
        done = subprocess.run(
            [PROGRAM, "cubes.inp", "--continue"], cwd=run.folder, capture_output=True, text=True,
            check=False,
        )
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(table_of(done.stdout), table_of(run.output))


# A body that nothing holds any more.
FREE = """*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY, OP=NEW
C, 1, 3
*CLOAD
B, 3, 10.
*END STEP
"""


class Rounding(unittest.TestCase):
    """Friction that is rounding is 0 also where no error is known."""

    def friction(self, size):
        row = {"step": 1, "pair": "A:B"}
        for name, values in (("normal_force", (0.0, 0.0, -114.0)), ("friction_force", size)):
            row |= {f"{name}_{axis}": x for axis, x in zip("xyz", values, strict=True)}
        for name in ("normal_force", "friction_force", "largest_pressure", "largest_slip"):
            row[f"{name}_error"] = float("nan")
        row |= {f"moment_{axis}": 0.0 for axis in "xyz"}
        row |= {"largest_pressure": 1.0, "largest_slip": 0.0, "normal_sum": 114.0, "extent": 1.0}
        return row_in_words(row)[4]

    def test_friction(self):
        self.assertEqual(self.friction((-4e-11, -3.37e-11, -2e-13)), "(0, 0, 0)")
        self.assertEqual(self.friction((1.2345e-3, 0.0, 0.0)), "(0.00123, 0, 0)")


class KnownErrors(unittest.TestCase):
    """A value is not rounded away where its error is larger than it: it has two digits."""

    def test_two_digits(self):
        row = {"step": 1, "pair": "A:B"}
        for name, values in (
            ("normal_force", (0.0, 0.01, 3.512)), ("friction_force", (0.914, 1e-12, 0.0)),
            ("moment", (0.0, 0.0, 12.345)),
        ):
            row |= {f"{name}_{axis}": x for axis, x in zip("xyz", values, strict=True)}
        for name, error in (("normal_force", 14.0), ("friction_force", 14.0),
                            ("largest_pressure", 50.0), ("largest_slip", 0.001)):
            row[f"{name}_error"] = error
        row |= {"largest_pressure": 7.58, "largest_slip": 0.0, "normal_sum": 3.512, "extent": 1.0}
        expected = ["1", "A:B", "(0, 0, 3.5)", "14", "(0.91, 0, 0)", "14", "7.6", "50", "0",
                    "0.0010", "3.5", "(0, 0, 12.3)"]
        self.assertEqual(row_in_words(row), expected)


class Told(unittest.TestCase):
    """The console, the file by Python and the page say the same of any run."""

    def same(self, run):
        """The console's cells are Python's."""
        with run.result() as result:
            expected = sorted(row_in_words(row) for row in summarize(result))
        found = sorted(table_of(run.output)[1:])
        self.assertEqual([row[:2] for row in found], [row[:2] for row in expected])
        for one, other in zip(found, expected, strict=True):
            self.assertEqual(one, other)

    def test_of_two_bodies_and_curved_masters(self):
        for deck in ("stack.inp", "pipe.inp"):
            with self.subTest(deck=deck):
                run = Run(INPUT / deck)
                self.assertEqual(run.status, 0, run.errors)
                self.same(run)

    def test_of_several_runs_there_is_one_answer(self):
        run = Run(INPUT / "block.inp", *ASKED, "0.2", n=2, steps=5)
        self.assertEqual(run.status, 0, run.errors)
        self.same(run)
        # What one run says of itself is not told beside what all of them say: one answer, of which
        # the last line of the table of runs has the parts.
        (said,) = re.findall(r"^estimated error of the contact forces: mesh ([\d.]+) %.*load steps "
                             r"([\d.]+) %; 20 % is reached", run.output, re.MULTILINE)
        self.assertEqual(run.output.count("estimated error of"), 2)
        last = re.findall(r"^ +\d+ +\d+ +\S+ +\d+ +\S+ s +\S+(?: %)? +\S.*$", run.output, re.M)[-1]
        # It is made again, for its result to be kept.
        self.assertEqual(last.removesuffix("  again, to keep it").split()[-4::2], list(said))
        error = sum(map(float, said)) / 100
        with run.result() as result:
            rows = list(without_pandas(result).values())
            pressed = max(row["normal_force_z"] for row in rows)
            mu = result.pairs[0].friction_coefficient
            listed = result.pairs[0].normal_sum.max()
        for row in rows:
            self.assertAlmostEqual(row["normal_force_error"] / listed, error, delta=0.02 * error)
            self.assertAlmostEqual(row["friction_force_error"], mu * row["normal_force_error"])
        self.assertLessEqual(pressed, listed * (1 + 1e-12))

    def test_errors_of_the_energy_are_not_taken_for_those_of_forces(self):
        steps = STEPS.replace("*STEP", "*STEP, NLGEOM=NO", 1)
        deck = BODIES + "*ACCURACY, OF=ENERGY, MESH=KEEP\n0.5\n" + steps
        run = Run(deck, name="cubes")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("estimated error of the energy: mesh", run.output)
        self.same(run)
        with run.result() as result:
            self.assertTrue(all(np.isnan(row["normal_force_error"])
                                for row in without_pandas(result).values()))

    def test_the_line_of_an_increment_names_what_its_errors_are_of(self):
        run = Run(BODIES + STEPS, name="cubes")
        self.assertEqual(run.output.count("estimated error of the contact force: mesh "), 2)


class KnownDigits(unittest.TestCase):
    """Numbers are rounded to their errors; by hand, as in the unit test of the program."""

    def test_by_hand(self):
        for value, error, expected in (
            (123.456, 0.5, "123.5"), (123.456, 3.9, "123"), (123.456, 39, "120"),
            (123.456, 390, "100"), (123.456, 1390, "0"), (-2129.6, 84, "-2130"),
            (12.3, 0.002, "12.300"),
            (123456789, 1, "1.23457e8"), (1.23456e-7, 4e-10, "1.235e-7"), (9.96, 0.1, "10.0"),
            (0.0510123, np.nan, "0.0510"), (98.14, np.nan, "98.1"), (0, np.nan, "0"),
            (2 / 3, 0, "0.666667"), (22700, 840, "22700"), (5, 84, "0"), (99.7, 4, "100"),
        ):
            with self.subTest(value=value, error=error):
                self.assertEqual(known_digits(value, error), expected)

class WhereForcesBalance(unittest.TestCase):
    """A ring that a pin in it spreads: no resultant, but a pressure; a torque where it turns."""

    def test_the_sum_and_the_torque(self):
        run = Run(RING, name="ring")
        self.assertEqual(run.status, 0, run.output + run.errors)
        _, press, turn = table_of(run.output)
        with run.result() as result:
            pair = result.pairs[0]
            np.testing.assert_allclose(pair.middle, (1, 2, 0.5), atol=1e-12)
            force = np.einsum("tp,tpx->tpx", pair.reaction[:, :, 0], pair.frame[:, :, 0])
            force += np.einsum("tpk,tpkx->tpx", pair.reaction[:, :, 1:], pair.frame[:, :, 1:])
            about = np.cross(pair.coordinates - pair.middle, force).sum(axis=1)
            ends = result.step_ends
            rows = without_pandas(result)
            sums = pair.normal_sum[ends]
        self.assertGreater(sums.min(), 10)
        for k, (row, cells) in enumerate(((rows[1, pair.name], press), (rows[2, pair.name], turn))):
            self.assertAlmostEqual(row["normal_sum"], sums[k], 9)
            self.assertAlmostEqual(row["moment_z"], about[ends[k], 2], 9)
            np.testing.assert_allclose(float(cells[10]), sums[k], rtol=0.06)
            self.assertEqual(row_in_words(row)[10:], cells[10:])
        self.assertEqual(press[11], "(0, 0, 0)")
        # All slides: mu = 0.3, at the radius of 1.
        self.assertAlmostEqual(abs(rows[2, pair.name]["moment_z"]) / (0.3 * sums[1]), 1, delta=0.02)


def ring(n=12):
    """Cards of a ring of 1.02 to 2 about (1, 2), its inner surface IN and outer nodes OUT."""
    nodes, elements, inner, outer = [], [], [], []
    for k in range(2):
        for j in range(2):
            for i in range(n):
                r, a = 0.99 + j, 2 * np.pi * i / n
                number = 1 + i + n * (j + 2 * k)
                nodes.append(f"{number}, {1 + r * np.cos(a)!r}, {2 + r * np.sin(a)!r}, {k}")
                if j == 1:
                    outer.append(str(number))
    for i in range(n):
        a, b = 1 + i, 1 + (i + 1) % n
        low = (a, a + n, b + n, b)
        elements.append(f"{i + 1}, " + ", ".join(map(str, [*low, *(x + 2 * n for x in low)])))
        inner.append(f"{i + 1}, S6")
    return "\n".join(
        ["*NODE", *nodes, "*ELEMENT, TYPE=C3D8, ELSET=B", *elements, "*NSET, NSET=OUT", *outer,
         "*NSET, NSET=ALL", *(str(i + 1) for i in range(4 * n)), "*SURFACE, NAME=IN", *inner]
    )


RING = ring() + """
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
9000, 1., 2., 0.
*OBSTACLE, NAME=PIN, TYPE=CYLINDER, REF NODE=9000
1., 2., 0., 0., 0., 1., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
IN, PIN
*BOUNDARY
OUT, 1, 2
ALL, 3
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
9000, 1, 6
*END STEP
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
9000, 6, 6, 0.1
*END STEP
"""


if __name__ == "__main__":
    unittest.main()
