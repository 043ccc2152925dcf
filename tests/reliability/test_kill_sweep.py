"""A short form of kill_sweep.py: killed at any moment, a run loses nothing and can be continued."""

import argparse
import os
import unittest

from kill_sweep import sweep
from result_checks import MISSING_VTK


class KillSweep(unittest.TestCase):
    def test_nothing_is_lost(self):
        if MISSING_VTK and os.environ.get("BIPOT_FORBID_SKIPS") == "1":
            self.fail(MISSING_VTK)
        options = argparse.Namespace(
            points=63, torn=14, random=7, continued=14, twice=7, seed=2
        )
        wrong, (n_kills, n_continued, n_twice) = sweep(options, tell=lambda _: None)
        self.assertEqual(wrong, [])
        self.assertGreaterEqual(n_kills, 77)
        self.assertGreaterEqual(n_continued, 14)
        self.assertGreaterEqual(n_twice, 7)


if __name__ == "__main__":
    unittest.main()
