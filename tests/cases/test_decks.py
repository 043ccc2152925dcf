"""Every deck in input/ runs as it stands: certified, with the exit status it declares."""

import re
import unittest

import numpy as np
from program import INPUT, Run

# A deck that is meant to end otherwise says so in a comment: ** exit status 2
DECLARED = re.compile(r"^\*\*\s*exit status\s+(\d)", re.MULTILINE | re.IGNORECASE)


class Decks(unittest.TestCase):
    def test_every_deck_runs_as_it_stands(self):
        decks = sorted(INPUT.glob("*.inp"))
        self.assertGreater(len(decks), 0)
        for deck in decks:
            with self.subTest(deck=deck.name):
                declared = DECLARED.search(deck.read_text())
                run = Run(deck)
                self.assertEqual(run.status, int(declared[1]) if declared else 0, run.errors)
                self.assertNotIn("times the loads and the forces of moving supports", run.output)
                if run.status == 0:
                    with run.result() as result:
                        self.assertTrue(np.all(result.history("certified") == 1))
                        for entry in result.certificate.values():
                            self.assertTrue(np.all(np.isfinite(entry)))

    def test_every_deck_has_a_plan(self):
        for deck in sorted(INPUT.glob("*.inp")):
            with self.subTest(deck=deck.name):
                run = Run(deck, "--plan")
                self.assertEqual(run.status, 0, run.errors)
                self.assertIn("equations", run.output)
                self.assertEqual(list(run.folder.iterdir()), [])

    def test_the_decks_declare_what_studies_sweep(self):
        for deck in sorted(INPUT.glob("*.inp")):
            text = deck.read_text()
            names = ["steps", "element"]
            if "*INCLUDE" not in text:  # a mesh that is read has its size
                names.append("n")
            if "*CONTACT PAIR" in text:
                names += ["tolerance", "solver", "mu"]
            for name in names:
                with self.subTest(deck=deck.name, parameter=name):
                    self.assertRegex(text, rf"(?m)^{name}\s*=")


if __name__ == "__main__":
    unittest.main()
