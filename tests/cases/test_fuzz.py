"""The short form of the fuzzing campaigns, with fixed seeds (docs/reliability.md)."""

import subprocess
import sys
import unittest
from pathlib import Path

from program import PROGRAM, SOURCE

FUZZ = SOURCE / "tests" / "fuzz"
SERVER = Path(PROGRAM).parent / "tests" / "deck_server"


class Fuzz(unittest.TestCase):
    """Nothing may be found."""

    def find_nothing(self, script, *options):
        """Run a campaign."""
        done = subprocess.run(
            [sys.executable, "-B", str(FUZZ / script), "--bipot", PROGRAM, *options],
            capture_output=True, text=True, check=False,
        )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(": 0 findings", done.stdout)

    def test_mutated_decks(self):
        self.find_nothing("fuzz_decks.py", "--count", "40", "--seed", "41", "--runs", "0.3")

    def test_mutated_decks_in_one_process(self):
        self.assertTrue(SERVER.exists(), f"{SERVER} is not built")
        self.find_nothing("fuzz_decks.py", "--count", "600", "--seed", "42", "--runs", "0",
                          "--server", str(SERVER))

    def test_damaged_problems(self):
        self.find_nothing("fuzz_fclib.py", "--count", "50", "--seed", "43")


if __name__ == "__main__":
    unittest.main()
