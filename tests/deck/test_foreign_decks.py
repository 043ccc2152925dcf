"""What decks for Abaqus and CalculiX say in another way means the same."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from program import PROGRAM, Run

DECK = """\
*BLOCK, NAME=LEFT, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*BLOCK, NAME=RIGHT, NX=2, NY=2, NZ=2
2., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
{elastic}
*SOLID SECTION, ELSET=LEFT, MATERIAL=M
*SOLID SECTION, ELSET=RIGHT, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
{friction}
{pairs}
*STEP{step}
*STATIC, DIRECT
{static}
{sets}*BOUNDARY
LEFT-ZMAX, 1, 2, 0.
LEFT-ZMAX, 3, 3, -0.01
RIGHT-ZMAX, 1, 2, 0.
RIGHT-ZMAX, 3, 3, -0.02
*END STEP
"""
PLAIN = {
    "elastic": "1000., 0.3",
    "friction": "0.3",
    "pairs": "*CONTACT PAIR, INTERACTION=DRY\nLEFT-ZMIN, FLOOR\n"
    "*CONTACT PAIR, INTERACTION=DRY\nRIGHT-ZMIN, FLOOR",
    "static": "1., 1.",
    "step": "",
    "sets": "",
}


def resultants(*options, **changes):
    """Run the deck with some of its lines written in another way: resultants, output."""
    run = Run(DECK.format(**{**PLAIN, **changes}), *options, name="deck")
    assert run.status == 0, run.errors
    with run.result() as result:
        return [pair.resultant[-1] for pair in result.pairs.values()], run.output


class SameDeck(unittest.TestCase):
    """Each way of writing it gives the same bits."""

    @classmethod
    def setUpClass(cls):
        cls.expected, _ = resultants()

    def check(self, *options, **changes):
        """Compare with the plain deck; return what was printed."""
        found, output = resultants(*options, **changes)
        np.testing.assert_array_equal(found, self.expected)
        return output

    def test_two_pairs_in_one_card(self):
        self.check(pairs="*CONTACT PAIR, INTERACTION=DRY\nLEFT-ZMIN, FLOOR\nRIGHT-ZMIN, FLOOR")

    def test_one_temperature_behind_constants(self):
        output = self.check(elastic="1000., 0.3, 20.", friction="0.3, 1e5, 20.")
        self.assertIn("temperatures behind constants of materials are ignored", output)

    def test_zeros_of_static_are_left_out(self):
        self.check(static="0., 0.")

    def test_sets_inside_a_step(self):
        self.check(sets="*NSET, NSET=PART, FREQUENCY=1\n1, 2\n*ELSET, ELSET=PIECE\n1\n")

    def test_contact_in_the_first_step(self):
        """General contact and its interactions, as Abaqus writes them for explicit steps."""
        begin = "*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n{friction}\n{pairs}\n"
        late = "*SURFACE INTERACTION, NAME=LATE\n*FRICTION\n0.3\n"
        pairs = "*CONTACT PAIR, INTERACTION=LATE\nLEFT-ZMIN, FLOOR\nRIGHT-ZMIN, FLOOR\n"
        general = (
            "*CONTACT, OP=NEW\n*CONTACT INCLUSIONS\nLEFT-ZMIN, FLOOR\nRIGHT-ZMIN, FLOOR\n"
            "*CONTACT PROPERTY ASSIGNMENT\n, , LATE\n*BULK VISCOSITY\n0.06, 1.2\n"
        )
        found = []
        for contact in (pairs, general):
            deck = DECK.replace(begin, "").replace("{sets}", "{sets}" + late + contact)
            run = Run(deck.format(**PLAIN), name="deck")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found.append([pair.resultant[-1] for pair in result.pairs.values()])
        np.testing.assert_array_equal(found[0], self.expected)
        np.testing.assert_allclose(found[1], self.expected, rtol=1e-9, atol=1e-9)

    def test_remarks_below_parameter(self):
        self.check(elastic="1000., 0.3\n*PARAMETER\n# of one edge\nmu = 0.3 # dry",
                   friction="<mu>")  # fmt: skip

    def test_orientations_of_isotropic_materials(self):
        output = self.check(
            static="1., 1.\n*EL FILE, POSITION=NODES\nS",
            pairs=PLAIN["pairs"] + "\n*ORIENTATION, NAME=OR, SYSTEM=RECTANGULAR\n"
            "0., 1., 0., -1., 0., 0.\n3, 0.",
        )
        self.assertIn("*ORIENTATION is ignored: materials are isotropic", output)
        self.assertIn("POSITION=NODES of *EL FILE: the values", output)

    def test_stresses_at_nodes(self):
        found = []
        for position in ("NODES", "AVERAGED AT NODES"):
            static = f"1., 1.\n*EL FILE, POSITION={position}\nS"
            run = Run(DECK.format(**{**PLAIN, "static": static}), name="deck")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found.append(result.field("stress", -1))
        self.assertGreater(len(found[0]), 16)
        np.testing.assert_array_equal(*found)

    def test_small_strain_in_place_of_nlgeom(self):
        output = self.check("--nlgeom", "no", step=", NLGEOM")
        self.assertIn("NLGEOM is set aside", output)
        solver = "*CONTACT SOLVER, COMPLIANCE=PRODUCTS\n*PRECISION, FACTOR=SINGLE\n"
        pairs = solver + PLAIN["pairs"]
        beyond = DECK.format(**{**PLAIN, "step": ", NLGEOM", "pairs": pairs})
        run = Run(beyond, "--check", name="deck")
        self.assertEqual(run.status, 1, run.output)
        self.assertIn("--nlgeom no", run.errors)


class Folders(unittest.TestCase):
    """`bipot --check FOLDER` lists all decks of a folder."""

    def check(self, **decks):
        """Write decks by their names, and check the folder that they are in."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in decks.items():
                path = Path(folder, *name.split("__")).with_suffix(".inp")
                path.parent.mkdir(exist_ok=True)
                path.write_text(text)
            Path(folder, "notes.txt").write_text("not a deck")
            done = subprocess.run(
                [PROGRAM, "--check", folder], capture_output=True, text=True, check=False
            )
            return done.returncode, done.stdout.replace(folder, ""), done.stderr

    def test_a_line_a_deck(self):
        good, bad = DECK.format(**PLAIN), DECK.format(**{**PLAIN, "elastic": "-1., 0.3"})
        status, printed, errors = self.check(b=good, a=bad, sub__c=good, mesh="*NODE\n1, 0, 0, 0\n")
        self.assertEqual(status, 1)
        self.assertEqual(errors, "bipot: error: 1 of 3 decks are refused\n")
        lines = printed.splitlines()
        self.assertRegex(lines[0], "^refused   /a.inp:7:1: error: Young's modulus must be")
        self.assertEqual(
            lines[1:],
            [
                "accepted  /b.inp",
                "no deck   /mesh.inp: it has no *STEP",
                "accepted  /sub/c.inp",
                "2 of 3 decks accepted",
            ],
        )

    def test_all_accepted(self):
        status, printed, errors = self.check(a=DECK.format(**PLAIN))
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("1 of 1 decks accepted", printed)

    def test_no_deck(self):
        status, _, errors = self.check()
        self.assertEqual(status, 1)
        self.assertIn("no deck (.inp) in", errors)


if __name__ == "__main__":
    unittest.main()
