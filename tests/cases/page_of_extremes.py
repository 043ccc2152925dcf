"""What the cases of docs/studies/extremes.md share: a section of the page, and its scenes run."""

import re
import tempfile
from pathlib import Path

from program import PROGRAM, SOURCE

from studies.extremes import finite_runs  # found through program

PAGE = SOURCE / "docs" / "studies" / "extremes.md"


def run(scenes):
    """Outcomes of scenes, in their order."""
    with tempfile.TemporaryDirectory(prefix="extremes-") as folder:
        return finite_runs.run_scenes(scenes, PROGRAM, Path(folder))


class SectionCase:
    """A test case of scenes by name (`scenes`) and of their outcomes on the page (`page`)."""

    @classmethod
    def take(cls, scenes, heading):
        """Take the scenes of a section of the page."""
        cls.scenes = {scene.name: scene for scene in scenes}
        section = PAGE.read_text(encoding="utf-8").split(f"\n{heading}\n")[1]
        section = section.split("\n## ")[0].split("\n| scene |")[1]
        cls.page = dict(re.findall(r"^\| (\S+) \|(?:[^|]*\|){2} \**(\w+)\** \|", section, re.M))

    def check_page(self):
        """The page has all of the scenes, at least 40."""
        self.assertGreaterEqual(len(self.scenes), 40)
        self.assertEqual(list(self.page), list(self.scenes))

    def check_outcomes(self, chosen):
        """Scenes, and those that they are compared with, are right or refused, as on the page."""
        for name in chosen:  # grows by what a scene is compared with
            true = self.scenes[name].true
            if isinstance(true, str) and true not in chosen:
                chosen.append(true)
        for one in run([scene for scene in self.scenes.values() if scene.name in chosen]):
            with self.subTest(scene=one.scene.name):
                self.assertIn(one.outcome, (finite_runs.RIGHT, finite_runs.REFUSED), one.words)
                self.assertEqual(one.outcome, self.page[one.scene.name])
