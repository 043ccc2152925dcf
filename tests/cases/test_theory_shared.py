"""Decks of ../shared/reference/finds3 that ask for what contact is not.

Where that folder is absent the whole file is skipped (status 77). Its name says `shared`, so that
the skip is allowed; nothing else is skipped here.
"""

import sys
import unittest

from program import SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "finds3"


class Behavior(unittest.TestCase):
    """Surfaces that *SURFACE BEHAVIOR ties are not taken for sliding ones."""

    def test_tied_by_behavior(self):
        run = Run(SHARED / "tied_by_behavior.inp")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("ties become a *TIE", run.output)


if __name__ == "__main__":
    if not SHARED.is_dir():
        print(f"{SHARED} is not there", file=sys.stderr)
        sys.exit(77)
    unittest.main()
