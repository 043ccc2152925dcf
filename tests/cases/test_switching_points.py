"""Mid-side nodes that become points by themselves, or are no more, while they press.

A ball below the face of a block is moved along it by less than an element: corners begin and cease
to be inside the ball without contact, and the points beside them switch at once between (9.11) and
their node alone. docs/theory.md (6.9).
"""

import unittest

import numpy as np
from boxes import Box
from program import Run

YOUNG = 1000.0


def rubbed(kind, mu, way, size=1.0, increments=3):
    """Return a block above a ball, pressed in by way[i][2] and moved by way[i][:2], one a *STEP."""
    block = Box("B", (2, 2, 2), (kind,), size=(size, 1.1 * size, 0.9 * size))
    under = size * np.array([0.47, 0.52, -2.0])
    deck = block.cards()
    deck += f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG}, 0.3\n*SURFACE INTERACTION, NAME=I\n"
    deck += f"*FRICTION\n{mu}\n" if mu else ""
    deck += "*OBSTACLE, NAME=BALL, TYPE=SPHERE\n"
    deck += ", ".join(repr(float(v)) for v in under) + f", {2.0 * size}\n"
    deck += "*CONTACT PAIR, INTERACTION=I\nB-Z0, BALL\n"
    for to in way:
        deck += f"*STEP\n*STATIC, DIRECT\n{1 / increments!r}, 1.\n*BOUNDARY\n"
        deck += "".join(f"B-Z1, {i + 1}, {i + 1}, {to[i] * size!r}\n" for i in range(3))
        deck += "*END STEP\n"
    return deck


class Switches(unittest.TestCase):
    WAYS = (
        # Onto and off the middle of the face; a corner comes to touch; contact ends.
        [(0.0, 0.0, -0.006), (0.12, 0.03, -0.004), (0.3, 0.3, -0.012)],
        [(0.0, 0.0, -0.004), (0.14, -0.1, -0.003)],
        [(0.1, 0.1, -0.003), (-0.1, -0.05, -0.005), (0.2, 0.12, -0.005)],
    )

    def test_they_lose_energy_and_the_run_goes_on(self):
        # Refused before as contact that gains or loses energy.
        for kind in ("C3D10", "C3D15", "C3D20", "C3D20R"):
            for mu in (0.0, 0.3):
                for way, size in zip(self.WAYS, (1.0, 250.0, 1e-3), strict=True):
                    with self.subTest(kind=kind, mu=mu, way=way, size=size):
                        run = Run(rubbed(kind, mu, way, size), "--quiet", name="rubbed")
                        self.assertEqual(run.status, 0, run.errors)

    def test_at_finite_strain_they_are_no_snap(self):
        deck = rubbed("C3D10", 0.3, self.WAYS[1]).replace("*STEP\n", "*STEP, NLGEOM\n")
        run = Run(deck, "--quiet", name="rubbed")
        self.assertEqual(run.status, 0, run.errors)

    def test_a_continued_run_knows_which_they_are(self):
        deck = rubbed("C3D20R", 0.3, self.WAYS[2])
        whole = Run(deck, "--quiet", name="rubbed")
        parts = Run(deck, "--continue", name="rubbed", ended_at=("2", "2"))
        self.assertEqual(parts.status, 0, parts.errors)
        with whole.result() as one, parts.result() as other:
            for name in ("displacement", "contact_force"):
                np.testing.assert_array_equal(other.field(name), one.field(name))
            np.testing.assert_array_equal(
                other.file["history/energy/balance"], one.file["history/energy/balance"]
            )


if __name__ == "__main__":
    unittest.main()
