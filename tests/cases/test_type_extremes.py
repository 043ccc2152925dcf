"""Extremes of tetrahedra, wedges and second order: right, or refused for the reason that is known.

Of docs/studies/extremes.md. A fifth of the scenes; all of them:
`studies/run extremes --family types`.
"""

import re
import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

from program import PROGRAM, SOURCE

from studies.extremes import finite_runs  # found through program
from studies.extremes.type_page import HEAD
from studies.extremes.type_scenes import TYPES, type_scenes

PAGE = SOURCE / "docs" / "studies" / "extremes.md"


def run(scenes):
    """Outcomes of scenes, in their order."""
    with tempfile.TemporaryDirectory(prefix="extremes-") as folder:
        return finite_runs.run_scenes(scenes, PROGRAM, Path(folder))


class Scenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenes = {scene.name: scene for scene in type_scenes()}
        section = PAGE.read_text(encoding="utf-8").split(f"\n{HEAD}\n")[1]
        section = section.split("\n## ")[0].split("\n| scene |")[1]
        cls.page = dict(re.findall(r"^\| (\S+) \|(?:[^|]*\|){2} \**(\w+)\** \|", section, re.M))

    def test_the_page_has_all_of_them(self):
        self.assertGreaterEqual(len(self.scenes), 40)
        self.assertEqual(list(self.page), list(self.scenes))
        for kind in TYPES:
            self.assertGreaterEqual(sum(kind in name for name in self.scenes), 6)

    def test_right_or_rightly_refused(self):
        slow = ("ball", "ratio-1e+08")
        chosen = [name for name in self.scenes if not name.startswith(slow)][::5]
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
