"""check_commit.py asks for a short subject and a body, and for nothing of what Git writes."""

import subprocess
import tempfile
import unittest
from pathlib import Path

from check_commit import CUT, SUBJECT, complaints


class Messages(unittest.TestCase):
    def test_good_ones(self):
        self.assertEqual(complaints("Subject\n\nWhy it is done.\n"), [])
        self.assertEqual(complaints("x" * SUBJECT + "\n\nWhy.\n# a comment of Git\n"), [])
        self.assertEqual(complaints(f"Subject\n\nWhy.\n{CUT}\ndiff of {'x' * 200}\n"), [])
        self.assertEqual(complaints("Merge branch 'main'\n"), [])
        self.assertEqual(complaints("# only comments: Git ends the commit\n"), [])

    def test_bad_ones(self):
        for message, words in (
            ("x" * (SUBJECT + 1) + "\n\nWhy.\n", "73 characters"),
            ("Subject.\n\nWhy.\n", "full stop"),
            ("Subject\nWhy.\n\nMore.\n", "second line"),
            ("Subject\n", "no body"),
            ("Subject\n\n# a comment is no body\n", "no body"),
        ):
            found = complaints(message)
            self.assertEqual(len(found), 1, message)
            self.assertIn(words, found[0])

    def test_the_hook_of_the_repository(self):
        """Git refuses the commit whose message makes it end with a status that is not 0."""
        root = Path(__file__).resolve().parents[2]
        for message, status in (("Subject\n", 1), ("Subject\n\nWhy.\n", 0)):
            with tempfile.NamedTemporaryFile("w", suffix="MSG") as file:
                file.write(message)
                file.flush()
                done = subprocess.run(
                    [root / ".githooks" / "commit-msg", file.name],
                    cwd=root, capture_output=True, text=True, check=False,
                )  # fmt: skip
            self.assertEqual(done.returncode, status, done.stderr)


if __name__ == "__main__":
    unittest.main()
