"""Extremes at finite strain: right, or refused for the reason that is known.

Of docs/studies/extremes.md. A quarter of the scenes; all of them:
`studies/run extremes --family finite`.
"""

import unittest
from dataclasses import replace

from page_of_extremes import SectionCase, run

from studies.extremes import finite_runs  # found through page_of_extremes
from studies.extremes.finite_scenes import finite_scenes


class Scenes(SectionCase, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.take(finite_scenes(), "## At finite strain")

    def test_the_page_has_all_of_them(self):
        self.check_page()

    def test_right_or_rightly_refused(self):
        self.check_outcomes(list(self.scenes)[::4])

    def test_what_is_wrong_is_found(self):
        """A truth that is off by 1e-5, and a refusal with other words, do not pass."""
        bar, foam = self.scenes["pressed-0.7"], self.scenes["foam-0.3"]
        scenes = [
            replace(bar, true=bar.true * (1 + 1e-5)),
            replace(bar, name="refused", refusal="elliptic"),
            replace(foam, refusal="does not come to balance"),
            replace(bar, name="broken", deck=bar.deck.replace("*STATIC", "*STATICS")),
        ]
        self.assertEqual(
            [one.outcome for one in run(scenes)],
            [finite_runs.WRONG, finite_runs.WRONG, finite_runs.HINDERED, finite_runs.BROKEN],
        )


if __name__ == "__main__":
    unittest.main()
