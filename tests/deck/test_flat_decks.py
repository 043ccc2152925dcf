"""bipot --flat: a deck without includes, parameters and blocks is the same scene."""

import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from program import INPUT, PROGRAM, Run

# Everything that a flat deck writes out anew: includes, parameters in names, words and numbers,
# blocks with a set of their own and with letters that need quotes, a title that is no parameter.
ODD = """*HEADING
Not a <parameter>, and *not a keyword
*PARAMETER
 n = 2
 thickness = 1/3
 kind = C3D8I
 over = "the top"
*INCLUDE, INPUT=blocks.inp
*MATERIAL, NAME=M
*ELASTIC
 <1000*thickness>, 0.3
*SOLID SECTION, ELSET="both, of them", MATERIAL=M
*SOLID SECTION, ELSET=<over>, MATERIAL=M
*OBSTACLE, NAME=GROUND, TYPE=PLANE
 0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
 <0.1*n>
*CONTACT PAIR, INTERACTION=DRY
 LOW-ZMIN, GROUND
*TIE, NAME=GLUE
 "THE TOP-ZMIN", LOW-ZMAX
*ENERGY PRINT, ELSET=<nothing
*STEP
*STATIC
 0.5, 1.
*BOUNDARY
 "the top-zmax", 1, 2
 "the top-zmax", 3, 3, <-thickness/100>
*END STEP
"""
BLOCKS = """** a comment with <a parameter> that is none
*BLOCK, NAME=LOW, NX=<n>, NY=<n>, NZ=<n>, TYPE=<kind>, ELSET="both, of them"
 0., 0., 0., 1., 1., <thickness>
*BLOCK, NAME=<over>, NX=3, NY=2, NZ=1
 0., 0., <thickness>, 1., 1., <thickness>
 X, 2., MIDDLE
"""


def call(*words, **options):
    """Call the program."""
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, timeout=300,
                          check=False, **options)


def flat(deck, *words):
    """Return a deck's flat text."""
    answer = call(deck, "--flat", *words)
    if answer.returncode != 0:
        raise AssertionError(answer.stderr)
    return answer.stdout


class FlatDecks(unittest.TestCase):
    def same_histories(self, one, other):
        """Check that two runs found the same to the bit."""
        self.assertEqual((one.status, other.status), (0, 0), one.errors + other.errors)
        with one.result() as a, other.result() as b:
            self.assertGreater(len(a.points), 0)
            np.testing.assert_array_equal(a.points, b.points)
            np.testing.assert_array_equal(a.elements, b.elements)
            np.testing.assert_array_equal(a.field("displacement", -1), b.field("displacement", -1))
            for pair in a.pairs.values():
                found = b.pairs[pair.name]
                np.testing.assert_array_equal(pair.reaction, found.reaction)

    def test_decks_of_input_are_flat_and_stay_as_they_are(self):
        for deck in sorted(INPUT.glob("*.inp")):
            with self.subTest(deck=deck.name), tempfile.TemporaryDirectory() as folder:
                text = flat(deck)
                self.assertNotRegex(text, r"(?im)^\*(parameter|block|include)")
                again = Path(folder) / "again.inp"
                again.write_text(text)
                self.assertEqual(flat(again), re.sub(r"(?m)^\*\*.*\n|^\s*\n", "", text))
                said = call(deck, "--plan").stdout.splitlines()
                self.assertEqual(call(again, "--plan").stdout.splitlines()[:6], said[:6])

    def test_a_flat_deck_gives_the_same_bits(self):
        for deck, words in (("block.inp", {"n": "3"}), ("press.inp", {}), ("bracket.inp", {})):
            with self.subTest(deck=deck):
                sets = [word for name, value in words.items()
                        for word in ("--set", f"{name}={value}")]
                self.same_histories(
                    Run(INPUT / deck, **words), Run(flat(INPUT / deck, *sets), name="flat")
                )

    def test_names_words_and_numbers_are_written_out(self):
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "odd.inp"
            deck.write_text(ODD)
            (Path(folder) / "blocks.inp").write_text(BLOCKS)
            text = flat(deck, "--set", "n=3")
            self.assertIn("Not a <parameter>, and *not a keyword\n", text)
            self.assertIn("*ELEMENT, TYPE=C3D8I, ELSET=LOW\n", text)
            self.assertIn('*ELSET, ELSET="BOTH, OF THEM"\nLOW\n', text)
            self.assertIn("\n 333.3333333333333, 0.3\n", text)
            self.assertIn("\n 0.30000000000000004\n", text)
            self.assertIn("*ENERGY PRINT, ELSET=<nothing\n", text)
            self.same_histories(Run(deck, n=3), Run(text, name="flat"))

    def test_a_wrong_deck_prints_its_mistakes_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "wrong.inp"
            deck.write_text(ODD.replace("*MATERIAL", "*MATERIALS").replace("LOW-ZMIN", "LOW-ZMEN"))
            (Path(folder) / "blocks.inp").write_text(BLOCKS)
            answer = call(deck, "--flat")
        self.assertEqual((answer.returncode, answer.stdout), (1, ""))
        self.assertIn("*MATERIALS", answer.stderr)
        self.assertIn("LOW-ZMEN", answer.stderr)

    def test_what_a_full_disk_does_not_take_ends_the_run(self):
        with open("/dev/full", "w") as full:
            answer = subprocess.run([PROGRAM, INPUT / "block.inp", "--flat"], stdout=full,
                                    stderr=subprocess.PIPE, text=True, timeout=300, check=False)
        self.assertEqual(answer.returncode, 3)
        self.assertEqual(answer.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
