"""Extremes of tetrahedra, wedges and second order: right, or refused for the reason that is known.

Of docs/studies/extremes.md. A fifth of the scenes; all of them:
`studies/run extremes --family types`.
"""

import unittest
from dataclasses import replace

from page_of_extremes import SectionCase, run

from studies.extremes import finite_runs  # found through page_of_extremes
from studies.extremes.type_page import HEAD
from studies.extremes.type_scenes import TYPES, type_scenes


class Scenes(SectionCase, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.take(type_scenes(), HEAD)

    def test_the_page_has_all_of_them(self):
        self.check_page()
        for kind in TYPES:
            self.assertGreaterEqual(sum(kind in name for name in self.scenes), 6)

    def test_right_or_rightly_refused(self):
        slow = ("ball", "ratio-1e+08")
        chosen = [name for name in self.scenes if not name.startswith(slow)][::5]
        self.check_outcomes(chosen)

    def test_what_is_wrong_is_found(self):
        """A truth that is off by 1e-5, and a refusal with other words, do not pass."""
        flat, locked = self.scenes["flat-1e4-C3D10"], self.scenes["nu-0.4999-C3D20"]
        outcomes = run([
            replace(flat, true=flat.true * (1 + 1e-5)),
            replace(locked, name="other-words", refusal="is too distorted"),
            replace(locked, name="solved", deck=flat.deck),
        ])  # fmt: skip
        self.assertEqual(
            [one.outcome for one in outcomes],
            [finite_runs.WRONG, finite_runs.HINDERED, finite_runs.WRONG],
        )


if __name__ == "__main__":
    unittest.main()
