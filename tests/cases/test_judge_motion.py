"""Random dynamic decks before their judge, tried on histories that are wrong first."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from program import PROGRAM, SOURCE, Run

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

import motion


class Mass(unittest.TestCase):
    def test_rigid_motions_have_the_inertia_of_the_body(self):
        scene = motion.Scene(3)
        whole, kept = motion.masses(scene)
        turn = np.array([1.0, 2.0, 3.0]) + np.cross((0.3, -0.2, 1.0), scene.points)
        true = sum(row @ whole @ row for row in turn.T)
        self.assertAlmostEqual(turn.ravel() @ motion.repaired(scene) @ turn.ravel(), true, 9)
        self.assertEqual(np.abs(kept[scene.base]).max(), 0.0)


class Faults(unittest.TestCase):
    def test_another_mass_or_scheme_is_found(self):
        scene = motion.Scene(5)
        run = Run(scene.deck(), name="m")
        self.assertEqual(run.status, 0, run.errors)
        self.assertLess(motion.compare(motion.March(scene), run.file), motion.CLOSE)
        kept = mock.patch.object(
            motion, "repaired", lambda scene: np.kron(motion.masses(scene)[1], np.eye(3))
        )
        with kept:
            self.assertGreater(motion.compare(motion.March(scene), run.file), 100 * motion.CLOSE)
        scene.alpha -= 1e-3
        self.assertGreater(motion.compare(motion.March(scene), run.file), 100 * motion.CLOSE)

    def test_a_refusal_fails(self):
        with tempfile.TemporaryDirectory() as folder:
            refuses = Path(folder) / "refuses"
            refuses.write_text("#!/bin/sh\nexit 2\n")
            refuses.chmod(0o755)
            done = judge("--bipot", str(refuses), "--decks", "1")
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("broken", done.stdout)


class Decks(unittest.TestCase):
    def test_random_decks(self):
        done = judge("--bipot", PROGRAM, "--only", "1", "5", "7")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("{'right': 3}", done.stdout)


def judge(*options):
    """Run the judge."""
    return subprocess.run(
        [sys.executable, "-B", str(SOURCE / "tests" / "judge" / "motion.py"), *options],
        capture_output=True, text=True, check=False,
    )  # fmt: skip


if __name__ == "__main__":
    unittest.main()
