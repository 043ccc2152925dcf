"""Extremes of plane bodies, bolts and changes: right, or refused for the reason that is known.

Of docs/studies/extremes.md. A fifth of the scenes; all of them:
`studies/run extremes --family plane`.
"""

import unittest
from dataclasses import replace

from page_of_extremes import SectionCase, run

from studies.extremes import finite_runs  # found through page_of_extremes
from studies.extremes.plane_page import HEAD
from studies.extremes.plane_scenes import plane_scenes


class Scenes(SectionCase, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.take(plane_scenes(), HEAD)

    def test_the_page_has_all_of_them(self):
        self.check_page()

    def test_right_or_rightly_refused(self):
        self.check_outcomes(list(self.scenes)[::5])

    def test_what_is_wrong_is_found(self):
        """A truth that is off by 1e-5, and a refusal with other words, do not pass."""
        bolt, thin = self.scenes["two-cuts"], self.scenes["thick-1e-06-CPE4"]
        outcomes = run([
            replace(bolt, true=bolt.true * (1 + 1e-5)),
            replace(thin, name="other-words", refusal="is too distorted"),
            replace(thin, name="solved", deck=self.scenes["thick-1e-03-CPE4"].deck),
        ])  # fmt: skip
        self.assertEqual(
            [one.outcome for one in outcomes],
            [finite_runs.WRONG, finite_runs.HINDERED, finite_runs.WRONG],
        )


if __name__ == "__main__":
    unittest.main()
