"""Messages speak of the card that is meant, and say nothing that is false or comes too late."""

import unittest

from program import Run

HEAD = """*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=A, MATERIAL=M
*SURFACE INTERACTION, NAME=I
"""
BLOCK = "*BLOCK, NAME=A, ELSET=A, NX=2, NY=2, NZ=2\n0., 0., 0., 1., 1., 1.\n" + HEAD
FLOOR = """*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*CONTACT PAIR, INTERACTION=I
A-ZMIN, G
"""
STEP = "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n{}\n*END STEP\n"


class Checked(unittest.TestCase):
    def errors(self, deck):
        """Return the errors of a deck that is refused."""
        run = Run(deck, "--check", name="words")
        self.assertEqual(run.status, 1, run.output)
        lines = run.errors.splitlines()
        return [line.split(": error: ")[1] for line in lines if ": error: " in line]

    def test_a_surface_and_itself(self):
        for line in ("A-ZMIN", "A-ZMIN, A-ZMIN"):
            deck = BLOCK + f"*CONTACT PAIR, INTERACTION=I\n{line}\n" + STEP.format("A-ZMAX, 1, 3")
            (error,) = self.errors(deck)
            self.assertRegex(error, "^no two faces of 'A-ZMIN' are turned towards each other")

    def test_lines_below_what_is_not_understood(self):
        """One mistake is one message."""
        for lines, words in (
            ("*SURFACE, NAME=S, TYPE=ELEMNT\nA-ZMIN\n", "TYPE must be ELEMENT"),
            ("*NSET, NSET=N, FROM=3\nNOSUCH\n", "unknown parameter 'FROM'"),
        ):
            (error,) = self.errors(BLOCK + lines + STEP.format("A-ZMAX, 1, 3"))
            self.assertIn(words, error)
        for lines, words in (
            ("*FRICTION, USER\n", "*FRICTION, USER is not available"),
            ("*MPC, USER\n1, 1, 2\n", "*MPC, USER is not available"),
            ("*MPC\nSLIDER, 1, 2, 3\n", "*MPC: 'SLIDER' is not available"),
        ):
            (error,) = self.errors(BLOCK + lines + STEP.format("A-ZMAX, 1, 3"))
            self.assertIn(words, error)
        (error,) = self.errors(BLOCK + STEP.format("A-ZMAX, 1, 3\n*CLOAD\n999, 4, 1."))
        self.assertEqual(error, "node 999 is not defined")

    def test_shortened_options(self):
        """Of three letters, told by their whole name as the docs write it."""
        deck = BLOCK + "*FRICTION, SLI=0.1\n0.2\n" + FLOOR + STEP.format("A-ZMAX, 1, 3")
        run = Run(deck, name="words")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("SLI of *FRICTION is read as SLIP TOLERANCE\n", run.output + run.errors)
        (error,) = self.errors(deck.replace("SLI=", "SL="))
        self.assertIn("unknown parameter 'SL'", error)

    def test_a_mean_that_is_prescribed(self):
        coupling = (
            "*NODE\n9000, 0.5, 0.5, 1.5\n"
            "*COUPLING, CONSTRAINT NAME=C, REF NODE=9000, SURFACE=A-ZMAX\n*DISTRIBUTING\n1, 6\n"
        )
        for dof in (3, 5):
            deck = BLOCK + coupling + FLOOR + STEP.format(f"9000, {dof}, {dof}, -0.01")
            (error,) = self.errors(deck)
            self.assertRegex(error, "node 9000 .*by .DISTRIBUTING.* with .KINEMATIC in its place")
            self.assertNotIn("term", error)

    def test_shells_are_no_rigid_bodies(self):
        """What is said of a slave of shells is that they are not available, and no more."""
        deck = BLOCK + """*NODE
9001, 0., 0., 1.
9002, 1., 0., 1.
9003, 1., 1., 1.
9004, 0., 1., 1.
*ELEMENT, TYPE=S4, ELSET=SH
9000, 9001, 9002, 9003, 9004
*SHELL SECTION, ELSET=SH, MATERIAL=M
0.1
*SURFACE, NAME=SHELL
9000, SNEG
*CONTACT PAIR, INTERACTION=I
SHELL, A-ZMAX
""" + STEP.format("A-ZMIN, 1, 3")
        (error,) = self.errors(deck)
        self.assertRegex(error, "^.SHELL SECTION")


class Overlaps(unittest.TestCase):
    def run_of(self, pair, low, options=""):
        """Return a run of a small block on a larger one, both held, its foot at `low`."""
        deck = BLOCK + (
            f"*BLOCK, NAME=B, ELSET=B, NX=2, NY=2, NZ=1\n0.25, 0.25, {low}, 0.5, 0.5, 1.\n"
            f"*SOLID SECTION, ELSET=B, MATERIAL=M\n*CONTACT PAIR, INTERACTION=I{options}\n"
            "B-ZMIN, A-ZMAX\n" + pair + STEP.format("A-ZMIN, 1, 3\nB-ZMAX, 1, 3")
        )
        run = Run(deck, name="words")
        self.assertEqual(run.status, 0, run.output + run.errors)
        return run

    def test_held_bodies_that_overlap_can_reach(self):
        """By their places alone; nothing is repeated for want of reach."""
        run = self.run_of("", 0.999)
        self.assertRegex(run.output, "(?m)^contact +B-ZMIN:A-ZMAX: 9 points")
        self.assertNotIn("out of reach", run.output + run.errors)
        self.assertIn("ADJUST=0 of *CONTACT PAIR removes them", run.output + run.errors)

    def test_an_overlap_that_is_asked_for(self):
        """ADJUST does not remove that of *CLEARANCE: it is not advised."""
        run = self.run_of("*CLEARANCE, SLAVE=B-ZMIN, MASTER=A-ZMAX, VALUE=-0.001\n", 1.0)
        self.assertIn("overlap before the first step", run.output + run.errors)
        self.assertIn("the deck asks for it", run.output + run.errors)
        self.assertNotIn("ADJUST", run.output + run.errors)


if __name__ == "__main__":
    unittest.main()
