"""What few increments make of friction is told as large as it is, where nothing is asked."""

import unittest

import numpy as np
from program import INPUT, SOURCE, Run

SCENES = SOURCE / "studies/data/scenes"


def found(path, **words):
    """Each pair's resultant over the increments, and the error by load steps."""
    text = path.read_text(encoding="utf-8")
    with Run(text, name=path.stem, tolerance=1e-8, **words).result() as run:
        forces = np.hstack([pair.resultant[:] for pair in run.pairs.values()])
        return run.history("time"), forces, run.history("error/load_steps")


class FewIncrements(unittest.TestCase):
    def test_told_beside_true(self):
        """Beside 16 times as many increments, at the ends where it is told: 0.5 to 4 times that."""
        for path, words, steps in (
            (INPUT / "block.inp", {"n": 4}, 5),
            (INPUT / "tool.inp", {"n": 8}, 2),
            (SCENES / "tilted.inp", {"n": 4}, 3),
            (SCENES / "layers.inp", {"n": 4}, 3),
        ):
            with self.subTest(deck=path.stem):
                time, forces, told = found(path, steps=steps, **words)
                fine_time, fine, _ = found(path, steps=16 * steps, **words)
                rows = np.flatnonzero(told >= 0)
                same = [np.argmin(abs(fine_time - time[row])) for row in rows]
                np.testing.assert_allclose(fine_time[same], time[rows], rtol=1e-9)
                apart = np.linalg.norm(forces[rows] - fine[same], axis=1).max()
                true = apart / np.linalg.norm(fine, axis=1).max()
                self.assertGreater(true, 1e-4)
                self.assertGreater(told.max() / true, 0.5)
                self.assertLess(told.max() / true, 4.0)


if __name__ == "__main__":
    unittest.main()
