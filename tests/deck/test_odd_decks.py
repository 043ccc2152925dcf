"""Decks as other programs and people write them, in odd/, are read without complaint.

BIPOT is the program; `--plan` reads the deck and ends before anything is computed.
"""

import os
import pathlib
import subprocess
import tempfile
import unittest

BIPOT = os.environ.get("BIPOT", "bipot")
DECKS = pathlib.Path(__file__).resolve().parent / "odd"
INPUT = DECKS.parents[2] / "input"
PATIENCE = 600  # with a program that hangs [s]


class OddDecks(unittest.TestCase):
    """One test a deck, made below."""

    def check(self, deck):
        """Plan the run of one deck; nothing must be left behind."""
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [BIPOT, str(deck), "--plan"],
                cwd=folder, capture_output=True, timeout=PATIENCE, check=False,
            )
            left = os.listdir(folder)
        self.assertEqual(done.returncode, 0, (done.stderr + done.stdout).decode())
        self.assertEqual(left, [])


def add_test(deck):
    """Give the class a test for one deck, under the deck's name."""

    def test(self):
        self.check(deck)

    setattr(OddDecks, "test_" + deck.stem, test)


for path in sorted(DECKS.glob("*.inp")) + sorted(INPUT.glob("*.inp")):
    add_test(path)


if __name__ == "__main__":
    unittest.main()
