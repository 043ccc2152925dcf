"""Scenes that are drawn by lot: the same for a seed, and such that the program takes them."""

import subprocess
import unittest

from study import PROGRAM, need

need("h5py", "numpy")

from studies.random_scenes import KINDS, varied  # noqa: E402
from studies.scenes import SCENES, set_words  # noqa: E402

COUNT = 60


class Lots(unittest.TestCase):
    """The scenes of a seed."""

    def test_a_seed_has_its_own_scenes(self):
        first = [varied(1, i) for i in range(COUNT)]
        self.assertEqual(first, [varied(1, i) for i in range(COUNT)])
        self.assertNotEqual(first, [varied(2, i) for i in range(COUNT)])
        self.assertEqual({scene.name for scene in first}, set(KINDS))

    def test_scenes_are_varied(self):
        for i in range(COUNT):
            scene = varied(1, i)
            with self.subTest(scene=scene.name):
                known = next(one for one in SCENES if one.name == scene.name)
                self.assertNotEqual(scene.settings, known.settings)
                self.assertEqual(scene.mu, scene.settings["mu"])

    def test_the_program_takes_them(self):
        for i in range(COUNT // 3):
            scene = varied(1, i)
            done = subprocess.run(
                [PROGRAM, scene.path, "--check", *set_words(scene.parameters(4))],
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            self.assertEqual(done.returncode, 0, f"{scene}: {done.stderr}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
