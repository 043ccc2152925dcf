"""Points at the edge of what is held: their weights, motion along a clamp, places beyond a face."""

import unittest

import numpy as np
from fixed_scenes import clamped
from program import Run

FIRST_UP = 45
"""The number of nodes of the lower strip, 4 x 2 x 2 elements."""


def held_to(column, mu=0.3, small="NO", swap=False, turned=False):
    """Two strips, the nodes of both interfaces held as far as a column of each.

    The lower strip begins at -0.2: its columns are 1.06 wide, those of the upper one 1. On the
    master the last column held is at 1.92, on the slave at 2: of what lies opposite 93 % is held.
    With the share of its neighbour's weights the slave node has 96 % of them on held nodes.
    """
    low = [1 + i + 5 * j + 30 for j in range(3) for i in range(column + 1)]
    up = [FIRST_UP + 1 + i + 5 * j for j in range(3) for i in range(column + 1)]
    held = "".join(f"{n}, 1, 3\n" for n in low + up)
    text = clamped(held=held.rstrip(), mu=mu, small=small)
    lower, upper = "0., 0., 0., 4., 1., 1.", "0., 0., 1.0, 4., 1., 1."
    assert lower in text and upper in text
    text = text.replace(lower, "-0.2, 0., 0., 4.24, 1., 1.")
    if swap:
        text = text.replace("UP-ZMIN, LOW-ZMAX", "LOW-ZMAX, UP-ZMIN")
    if turned:
        # Along the other horizontal axis.
        text = text.replace("-0.2, 0., 0., 4.24, 1., 1.", "0., -0.2, 0., 1., 4.24, 1.")
        text = text.replace(upper, "0., 0., 1.0, 1., 4., 1.").replace("NX=4, NY=2", "NX=2, NY=4")
        low = [1 + i + 3 * j + 30 for j in range(column + 1) for i in range(3)]
        up = [FIRST_UP + 1 + i + 3 * j for j in range(column + 1) for i in range(3)]
        text = text.replace(held, "".join(f"{n}, 1, 3\n" for n in low + up))
    return text


class HeldWithTheirWeights(unittest.TestCase):
    """A pressure of 1 on strips that are held on the left and free on the right."""

    def test_no_lever_makes_a_reaction_large(self):
        """Reactions are of the size of the load, whatever is the slave."""
        for options in (
            {},
            {"mu": 0},
            {"small": "YES"},
            {"swap": True},
            {"turned": True, "mu": 0.9},
        ):
            with self.subTest(**options):
                run = Run(held_to(2, **options), name="held")
                self.assertEqual(run.status, 0, run.errors)
                (pair,) = run.result().file["contact"].values()
                reaction, at = pair["reaction"][-1], pair["coordinates"][:]
                along = at[:, 1 if options.get("turned") else 0]
                self.assertEqual(np.abs(reaction[along <= 2]).max(), 0)
                self.assertLess(reaction[:, 0].max(), 1.0)
                # The load on what is free, 2 by 1, less what the held column beside it takes.
                self.assertAlmostEqual(reaction[:, 0].sum(), 1.85, delta=0.15)


class DrivenAlong(unittest.TestCase):
    """Clamps that go on along the interface they are clamped down to."""

    def test_inclination_by_deformation_is_no_overlap(self):
        """Beside the clamp the master bends: normals there lean by what the load deforms."""
        for far in (1e-3, -1e-3):
            for dof in (1, 2):
                with self.subTest(far=far, dof=dof):
                    deck = clamped(held="LOW-XMIN, 1, 3\nUP-XMIN, 1, 3")
                    deck += f"*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nUP-XMIN, {dof}, {dof}, {far}\n"
                    run = Run(deck + "*END STEP\n", name="along")
                    self.assertEqual(run.status, 0, run.errors)

    def test_motion_into_the_master_is_still_refused(self):
        """Down by 1e-3 is 1e-3 into the master."""
        deck = clamped(held="LOW-XMIN, 1, 3\nUP-XMIN, 1, 3")
        deck += "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nUP-XMIN, 3, 3, -1e-3\n*END STEP\n"
        run = Run(deck, name="into")
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, r"is prescribed to move 0\.001 into LOW-ZMAX")


if __name__ == "__main__":
    unittest.main()
