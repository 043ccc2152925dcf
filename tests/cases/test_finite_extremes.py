"""Extremes at finite strain: right, or refused for the reason that is known.

Of docs/studies/extremes.md. A quarter of the scenes; all of them:
`studies/run extremes --family finite`.
"""

import re
import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

from program import PROGRAM, SOURCE

from studies.extremes import finite_runs  # found through program
from studies.extremes.finite_scenes import finite_scenes

PAGE = SOURCE / "docs" / "studies" / "extremes.md"


def run(scenes):
    """Outcomes of scenes, in their order."""
    with tempfile.TemporaryDirectory(prefix="extremes-") as folder:
        return finite_runs.run_scenes(scenes, PROGRAM, Path(folder))


class Scenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenes = {scene.name: scene for scene in finite_scenes()}
        section = PAGE.read_text(encoding="utf-8").split("\n## At finite strain\n")[1]
        section = section.split("\n## ")[0].split("\n| scene |")[1]
        cls.page = dict(re.findall(r"^\| (\S+) \|(?:[^|]*\|){2} \**(\w+)\** \|", section, re.M))

    def test_the_page_has_all_of_them(self):
        self.assertGreaterEqual(len(self.scenes), 40)
        self.assertEqual(list(self.page), list(self.scenes))

    def test_right_or_rightly_refused(self):
        chosen = list(self.scenes)[::4]
        for name in chosen:  # grows by what a scene is compared with
            true = self.scenes[name].true
            if isinstance(true, str) and true not in chosen:
                chosen.append(true)
        for one in run([scene for scene in self.scenes.values() if scene.name in chosen]):
            with self.subTest(scene=one.scene.name):
                self.assertIn(one.outcome, (finite_runs.RIGHT, finite_runs.REFUSED), one.words)
                self.assertEqual(one.outcome, self.page[one.scene.name])

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
