"""Bodies that are taken as rigid obstacles: --as-rigid, and what the plan says of it."""

import re
import unittest

import numpy as np
from program import Run

HEAD = """*HEADING
A tool that is pressed into a pad and drags it
*BLOCK, NAME=PAD, NX=6, NY=4, NZ=3
0., 0., 0.,  3., 2., 1.
"""
TOOL = """*BLOCK, NAME=TOOL, TYPE=C3D8I, NX=3, NY=2, NZ={layers}
0.8, 0.5, 1.,  1.5, 1., {top}
*MATERIAL, NAME=STEEL
*ELASTIC
{young}, 0.3
*SOLID SECTION, ELSET=TOOL, MATERIAL=STEEL
"""
# The same face by itself, seen from below.
FACETS = """*NODE
90000, 0., 0., 0.
"""
PAD = """*MATERIAL, NAME=RUBBER
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=PAD, MATERIAL=RUBBER
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
{slave}, {master}
*CONTACT SOLVER, TOLERANCE=1e-10
"""
STEPS = """*STEP
*STATIC
0.5, 1.
*BOUNDARY
PAD-ZMIN, 1, 3
{held}, 1, 2
{held}, 3, 3, -0.03
*END STEP
*STEP
*STATIC
0.5, 1.
*BOUNDARY
{held}, 1, 1, 0.02
*END STEP
"""
PAIR = "PAD-ZMAX:TOOL-ZMIN"


def deck(young=1e7, top=0.6, layers=2, held="TOOL-ZMAX", swapped=False, steps=STEPS):
    """Return the tool as a body of elements."""
    sides = ("TOOL-ZMIN", "PAD-ZMAX") if swapped else ("PAD-ZMAX", "TOOL-ZMIN")
    return (HEAD + TOOL.format(young=young, top=top, layers=layers)
            + PAD.format(slave=sides[0], master=sides[1]) + steps.format(held=held))


def deck_of_facets():
    """Return the tool as facets, which the deck itself has."""
    x, y = np.linspace(0.8, 2.3, 4), np.linspace(0.5, 1.5, 3)
    lines = [FACETS.rstrip()]
    number = {}
    for j in range(3):
        for i in range(4):
            number[i, j] = 90001 + 4 * j + i
            lines.append(f"{number[i, j]}, {x[i]!r}, {y[j]!r}, 1.".replace("np.float64", ""))
    lines.append("*ELEMENT, TYPE=R3D4, ELSET=FACES")
    for j in range(2):
        for i in range(3):
            corners = (number[i, j], number[i, j + 1], number[i + 1, j + 1], number[i + 1, j])
            lines.append(f"{90001 + 3 * j + i}, " + ", ".join(map(str, corners)))
    lines += ["*RIGID BODY, ELSET=FACES, REF NODE=90000", "*SURFACE, NAME=TOOL-ZMIN", "FACES, SPOS"]
    text = "\n".join(lines).replace("(", "").replace(")", "") + "\n"
    return (HEAD + text + PAD.format(slave="PAD-ZMAX", master="TOOL-ZMIN")
            + STEPS.format(held="90000"))


class AsRigid(unittest.TestCase):
    def run_deck(self, text, *options, status=0):
        run = Run(text, *options, name="tool")
        self.assertEqual(run.status, status, run.errors + run.output)
        return run

    def forces(self, text, *options, pair=PAIR):
        with self.run_deck(text, *options).result() as result:
            self.assertTrue(result.history("certified").all())
            return result.pairs[pair].resultant

    def test_the_obstacle_is_that_of_facets_in_the_deck(self):
        found = self.forces(deck(), "--as-rigid", "tool")
        expected = self.forces(deck_of_facets())
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())

    def test_a_stiffer_body_is_nearer_to_the_obstacle(self):
        rigid = self.forces(deck(), "--as-rigid", "TOOL")
        off = [np.abs(self.forces(deck(young)) - rigid).max() / np.abs(rigid).max()
               for young in (1e6, 1e7)]
        self.assertLess(off[1], 2e-3)
        self.assertAlmostEqual(off[0] / off[1], 10, delta=2)

    def test_the_slave_becomes_the_master(self):
        expected = self.forces(deck(), "--as-rigid", "TOOL")
        found = self.forces(deck(swapped=True), "--as-rigid", "TOOL")
        np.testing.assert_array_equal(found, expected)

    def test_a_body_at_rest_is_an_obstacle_at_rest(self):
        # The pad is lifted to the tool, and drawn along below it.
        steps = STEPS.replace("PAD-ZMIN, 1, 3\n", "{held}, 1, 3\n", 1).replace(
            "{held}, 1, 2\n{held}, 3, 3, -0.03", "PAD-ZMIN, 1, 2\nPAD-ZMIN, 3, 3, 0.03").replace(
            "{held}, 1, 1, 0.02", "PAD-ZMIN, 1, 1, -0.02")
        found = self.forces(deck(steps=steps), "--as-rigid", "TOOL")
        expected = self.forces(deck(), "--as-rigid", "TOOL")
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())

    def test_the_file_says_so_and_goes_on_with_it_alone(self):
        run = self.run_deck(deck(), "--as-rigid", "TOOL")
        self.assertIn("TOOL is rigid", run.output)
        with run.result() as result:
            self.assertIn("--as-rigid TOOL", result.run_text("overrides"))
            self.assertEqual(len(result.file["VTKHDF/Types"]), 6 * 4 * 3)
            self.assertNotIn("TOOL", result.file["sets/elements"])
        again = Run(deck(), name="tool", beside={"tool.vtkhdf": run.file})
        self.assertEqual(again.status, 1)
        self.assertIn("--as-rigid", again.errors)

    def test_what_cannot_be_an_obstacle_is_refused(self):
        two = STEPS.replace("*END STEP", "*CLOAD\nTOOL-ZMAX, 3, -1.\n*END STEP", 1)
        bent = STEPS.replace("{held}, 1, 1, 0.02", "TOOL-XMIN, 3, 3, 0.02")
        other = STEPS.replace("*BOUNDARY\n{held}, 1, 1, 0.02",
                              "*BOUNDARY, OP=NEW\nPAD-ZMIN, 1, 3\n{held}, 1, 3")
        for text, name, words in (
            (deck(), "TOLL", "no element set of this name; it has"),
            (deck(steps=STEPS.replace("{held}, 1, 2\n", "")), "TOOL", "leave it free"),
            (deck(steps=two), "TOOL", "in step 1 forces act on it"),
            (deck(steps=bent), "TOOL", "in step 2"),
            (deck(steps=other.replace("{held}, 1, 3", "TOOL-YMIN, 1, 3")), "TOOL",
             "its supports are others in step 2"),
            (deck() .replace("*MATERIAL, NAME=STEEL",
                             "*ELSET, ELSET=HALF\n73, 74\n*MATERIAL, NAME=STEEL"), "HALF",
             "it is no body of its own"),
            (deck(), "PAD,TOOL", "--as-rigid 'TOOL'"),
        ):
            with self.subTest(name=name, words=words):
                run = self.run_deck(text, "--as-rigid", name, status=1)
                self.assertIn("--as-rigid '", run.errors)
                self.assertIn(words, run.errors)

    def line(self, text):
        """Return stiffness ratio and change of forces as the plan says of the tool."""
        run = self.run_deck(text, "--plan", "--refine", "0", "--accuracy", "0.5")
        found = re.findall(r"rigid body +about +TOOL is (\S+) times as stiff.*by about (\S+) %.*"
                           r"--as-rigid TOOL", run.output)
        self.assertEqual(len(found), 1, run.output)
        return float(found[0][0]), float(found[0][1]) / 100

    def test_the_plan_estimates_what_it_changes(self):
        rigid = self.forces(deck(), "--as-rigid", "TOOL")
        for young in (1e5, 1e7):
            off = np.abs(self.forces(deck(young)) - rigid).max() / np.abs(rigid).max()
            ratio, told = self.line(deck(young))
            self.assertLess(told / off, 4)
            self.assertLess(off / told, 4)
            self.assertAlmostEqual(told * (1 + ratio), 1, delta=0.1)

    def test_a_thin_plate_is_soft_whatever_its_modulus(self):
        # Of the same steel: held at its edges, and so thin that it bends.
        self.assertGreater(self.line(deck(1e7))[0], 1000)
        run = self.run_deck(deck(1e7, top=0.02, layers=1, held="TOOL-XMAX"), "--plan")
        self.assertNotIn("TOOL is", run.output)


if __name__ == "__main__":
    unittest.main()
