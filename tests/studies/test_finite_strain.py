"""The study of finite strain beside CalculiX: its decks, and what it makes of known runs."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from study import PROGRAM, ROOT, need

need("h5py", "matplotlib")

from bipot.peers.calculix_deck import Penalty, deck_lines  # noqa: E402
from bipot.peers.flat_deck import read_flat  # noqa: E402
from bipot.peers.runs import PeerRun  # noqa: E402
from studies import finite_strain  # noqa: E402
from studies.pages import StudyError  # noqa: E402
from studies.peers import read_comparisons  # noqa: E402


def kept():
    """Return the comparisons kept, by the deck's name."""
    return {name: one for (name, _), one in read_comparisons(finite_strain.KEPT).items()}


class FiniteStrain(unittest.TestCase):
    """The page, and the decks and runs behind it."""

    def test_every_deck_has_a_translation(self):
        decks = {name: text for name, (_, text) in finite_strain.DECKS.items()}
        for name, text in (decks | finite_strain.CHECKS).items():
            with self.subTest(deck=name), tempfile.TemporaryDirectory() as folder:
                deck = Path(folder) / "deck.inp"
                deck.write_text(text)
                scene = read_flat(PROGRAM, deck, {"n": "4"})
                lines = deck_lines(scene, Penalty(1e5, 1e4, 0.0))
                self.assertEqual(any("NLGEOM" in line for line in lines), name in decks
                                 or not name.startswith("small"))

    def test_the_page_is_that_of_the_runs_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / "page.md"
            subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "finite_strain", "--page", "-o",
                 page], check=True, capture_output=True,
            )
            made = page.read_text(encoding="utf-8").splitlines()
        # The third line names the machine.
        self.assertEqual(made[3:], finite_strain.PAGE.read_text(encoding="utf-8").splitlines()[3:])

    def test_a_penalty_that_still_matters_agrees_with_nothing(self):
        run = PeerRun("CalculiX", "K 1e+05, slope 1e+04", 1.0, 1e7, 1e-4, 10, 10)
        self.assertFalse(finite_strain.agrees(run))
        run.note = "changed by 4.0e-04"
        self.assertFalse(finite_strain.agrees(run))
        run.note = "changed by 2.0e-04"
        self.assertTrue(finite_strain.agrees(run))
        run.error = 2e-3
        self.assertFalse(finite_strain.agrees(run))

    def test_other_answers_stop_the_page(self):
        found = kept()
        for name in ("neo", "svk", "heat"):
            found[name].runs[-1].error = 2e-3
        with self.assertRaisesRegex(StudyError, "decks|agree"):
            finite_strain.page(found, "a machine")


if __name__ == "__main__":
    unittest.main(verbosity=2)
