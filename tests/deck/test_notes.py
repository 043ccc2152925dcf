"""What a deck says and the program does not do, and does not refuse, is noted: nothing is silent.

BIPOT is the program; `--plan` reads a deck, prints its notes and computes nothing.
"""

import os
import pathlib
import subprocess
import tempfile
import unittest

BIPOT = os.environ.get("BIPOT", "bipot")
TIME_LIMIT = 20  # seconds

DECK = """\
*BLOCK, NAME=B, NX=2, NY=1, NZ=1
0., 0., 0., 2., 1., 1.
*NODE
99, 1., 0., -3.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
*STEP
*STATIC
0.5, 1.
*BOUNDARY
B-ZMAX, 1, 3, 0.
*END STEP
"""
SECTION = "*SOLID SECTION, ELSET=B, MATERIAL=M\n"


class Notes(unittest.TestCase):
    """One deck a note."""

    def plan(self, *changes, included=""):
        """Plan the deck with pieces replaced, beside a file to be included: what is printed."""
        deck = DECK
        for old, new in changes:
            self.assertEqual(deck.count(old), 1, old)
            deck = deck.replace(old, new)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "deck.inp"
            path.write_text(deck)
            path.with_name("mesh.inc").write_text(included)
            done = subprocess.run(
                [BIPOT, str(path), "--plan"],
                cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT, check=False,
            )
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_numbers_that_friction_would_depend_on(self):
        card = "NAME=I\n*FRICTION\n0.1, 1000., 0., 0.\n"
        plan = self.plan(("NAME=I\n", card))
        self.assertIn("the stick slope of *FRICTION is ignored", plan)
        self.assertIn("the temperature of *FRICTION is ignored", plan)

    def with_output(self, cards):
        """Plan the deck with output cards in its step."""
        return self.plan(("*END STEP\n", cards + "*END STEP\n"))

    def with_solver(self, options):
        """Plan the deck with a *CONTACT SOLVER card."""
        return self.plan(("*STEP\n*STATIC", f"*CONTACT SOLVER, {options}\n*STEP\n*STATIC"))

    def test_auto_beside_what_belongs_to_sweeps(self):
        note = "SOLVER=AUTO with LOCAL or RELAXATION: sweeps are used"
        self.assertIn(note, self.with_solver("SOLVER=AUTO, LOCAL=UZAWA"))
        self.assertIn(note, self.with_solver("SOLVER=AUTO, RELAXATION=0.5"))
        self.assertNotIn("sweeps run", self.with_solver("SOLVER=AUTO, LOCAL=AUTO"))
        self.assertNotIn("sweeps run", self.with_solver("LOCAL=UZAWA"))

    def test_what_the_solver_does_not_look_at(self):
        for solver in ("AUTO", "GLOBAL NEWTON"):
            with self.subTest(solver=solver):
                self.assertIn(
                    "STOP=CHANGE of *CONTACT SOLVER is ignored",
                    self.with_solver(f"SOLVER={solver}, STOP=CHANGE"),
                )
        self.assertNotIn("ignored", self.with_solver("SOLVER=SWEEPS, STOP=CHANGE"))

    def test_a_place_of_no_tensors(self):
        note = "POSITION of *EL FILE is ignored"
        self.assertIn(note, self.with_output("*EL FILE, POSITION=AVERAGED AT NODES\nERR\n"))
        self.assertNotIn(note, self.with_output("*EL FILE, POSITION=AVERAGED AT NODES\nS\n"))

    def test_a_frequency_that_another_one_replaces(self):
        note = "FREQUENCY=2, the last in the deck, applies to all results"
        cards = "*NODE FILE, FREQUENCY={}\nU\n*EL FILE, FREQUENCY=2\nS\n"
        self.assertIn(note, self.with_output(cards.format(3)))
        self.assertNotIn("FREQUENCY", self.with_output(cards.format(2)))

    def test_thicknesses(self):
        self.assertIn(
            "thickness of *SOLID SECTION is ignored", self.plan((SECTION, SECTION + "1.\n"))
        )
        # As Abaqus/CAE writes it.
        self.assertNotIn("thickness", self.plan((SECTION, SECTION + ",\n")))
        card = "*SURFACE INTERACTION, NAME=I\n"
        self.assertIn(
            "thickness of *SURFACE INTERACTION is ignored", self.plan((card, card + "1.,\n"))
        )

    def test_rotations_of_nodes_of_elements(self):
        note = "dofs 4 to 6 of *BOUNDARY are ignored on nodes of elements"
        line = "B-ZMAX, 1, 3, 0.\n"
        for more in ("B-ZMAX, 6, 6\n", "B-ZMAX, 4\n", "B-ZMAX, 1, 6, 0.\n"):
            self.assertIn(note, self.plan((line, line + more)))
        self.assertNotIn(note, self.plan())

    def test_a_node_that_is_written_twice(self):
        note = "a line of *NODE that is written twice is taken once"
        line = "99, 1., 0., -3.\n"
        self.assertIn(note, self.plan((line, 2 * line)))
        self.assertNotIn(note, self.plan((line, line + "98, 1., 0., -3.\n")))

    def test_another_stiffness_of_contact(self):
        change = "*CHANGE SURFACE BEHAVIOR, INTERACTION=I\n*SURFACE BEHAVIOR"
        linear = change + ", PRESSURE-OVERCLOSURE=LINEAR\n1e6\n"
        self.assertIn("*SURFACE BEHAVIOR is ignored", self.with_output(linear))
        self.assertNotIn("ignored", self.with_output(change + "\n"))
        soft = change + ", PRESSURE-OVERCLOSURE=EXPONENTIAL\n1e-3, 2.\n"
        self.assertIn("nothing presses before it touches", self.with_output(soft))

    def test_a_second_section(self):
        """The last one counts, as in CalculiX."""
        for first, last, noted in (("M", "N", True), ("M", "M", False)):
            said = self.plan(
                ("*MATERIAL", "*MATERIAL, NAME=N\n*ELASTIC\n1., 0.\n*MATERIAL"),
                (SECTION, f"*SOLID SECTION, ELSET=B, MATERIAL={first}\n"
                          f"*SOLID SECTION, ELSET=B, MATERIAL={last}\n"))
            words = "another material than a section before, 2, the first"
            self.assertEqual(words in said, noted, said)

    def test_a_second_title(self):
        printed = self.plan((
            "*MATERIAL", "*HEADING\nof the deck\n*HEADING\nof the mesh\n*MATERIAL"))
        self.assertIn("only the first *HEADING is the title", printed)
        self.assertNotIn("of the mesh", printed)

    def test_the_title_of_a_file_that_is_included(self):
        """Programs that write meshes give them one: it says nothing of the deck, and is no note."""
        printed = self.plan(
            ("*MATERIAL", "*HEADING\nof the deck\n*INCLUDE, INPUT=mesh.inc\n*MATERIAL"),
            included="*HEADING\nof the mesh\n",
        )
        self.assertNotIn("HEADING", printed)
        self.assertIn(": of the deck\n", printed)
        self.assertNotIn("of the mesh", printed)
        printed = self.plan(("*MATERIAL", "*INCLUDE, INPUT=mesh.inc\n*MATERIAL"),
                            included="*HEADING\nof the mesh\n")
        self.assertNotIn("of the mesh", printed)

    def test_tables_of_gmsh_that_meshio_writes_as_sets(self):
        tables = (
            "*ELSET, ELSET=gmsh:bounding_entities\n-3,10,9,-10\n*NSET, NSET=gmsh:x\n0.5, word\n"
            "*ELSET, ELSET=gmsh:bounding_entities\n42,45\n*MATERIAL"
        )
        printed = self.plan(("*MATERIAL", tables))
        self.assertIn("set 'GMSH:BOUNDING_ENTITIES' is skipped", printed)
        self.assertIn("set 'GMSH:X' is skipped", printed)

    def test_missing_members_of_a_set_that_nothing_uses(self):
        sets = "*NSET, NSET=IDLE, GENERATE\n500, 700\n*ELSET, ELSET=REST\n1, 77\n*MATERIAL"
        printed = self.plan(("*MATERIAL", sets))
        self.assertIn("set 'IDLE' names nodes that are not in the deck (the first: node 500)",
                      printed)
        self.assertIn("set 'REST' names elements that are not in the deck", printed)

    def test_what_is_held_at_0_on_a_node_of_nothing(self):
        note = "values prescribed on nodes that belong to no element are ignored"
        self.assertIn(note, self.plan(("B-ZMAX, 1, 3, 0.\n", "B-ZMAX, 1, 3, 0.\n99, 1, 6\n")))

    def test_forces_on_what_was_taken_out(self):
        note = "values prescribed on nodes that belong to no element are ignored"
        printed = self.plan(
            ("*MATERIAL", "*ELEMENT, TYPE=C3D8, ELSET=SLAB\n*MATERIAL"),
            ("*END STEP\n", "*CLOAD\n99, 3, -1.\n*END STEP\n"),
        )
        self.assertIn(note, printed)


if __name__ == "__main__":
    unittest.main()
