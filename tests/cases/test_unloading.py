"""Bodies that friction alone holds, unloaded to exactly nothing: parted, or locked for good."""

import unittest

import numpy as np
from program import Run

from studies.requires import wedge


class UnloadedWedge(unittest.TestCase):
    """A wedge between two walls, pressed in and let go."""

    def pressing(self, mu):
        """Return the force of a wall when pressed and when let go, and the last iterations."""
        run = Run(wedge().replace("*FRICTION\n10.", f"*FRICTION\n{mu}"), name="wedge")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            force = np.linalg.norm(result.file["contact/B-XMIN:L/resultant"][:], axis=1)
            return force[1], force[-1], result.file["history/contact_iterations"][-1]

    def test_a_wedge_that_sticks_springs_back_and_is_free(self):
        pressed, left, iterations = self.pressing(10)
        self.assertGreater(pressed, 1)
        self.assertEqual(left, 0)
        # Nothing was near enough to nothing for the search to end: 43,210 in half the increment.
        self.assertLess(iterations, 20000)

    def test_a_wedge_that_has_slid_stays_locked(self):
        for mu, share in ((0.5, 0.3), (1, 0.05), (5, 0.008)):
            with self.subTest(mu=mu):
                pressed, left, _ = self.pressing(mu)
                self.assertGreater(left, share * pressed)


if __name__ == "__main__":
    unittest.main()
