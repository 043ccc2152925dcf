"""Bodies at finite strain whose supports see rotations only once they have strained.

The nodes of an upper face are held in its plane: to the undeformed body rotations about axes in
that plane are free. Boxes of tests/cases/boxes.py.
"""

import unittest

import numpy as np
from boxes import Box, BoxCase
from test_finite_cells import step

SVK = "*ELASTIC\n1000., 0.2\n"


def pressed(kind, friction, pressure, master="LOW-Z1", beside=0.0):
    """Press a box that is held in the plane of its upper face, and load one of its sides."""
    low = Box("LOW", (3, 3, 2), (kind,), size=(1.4, 1.4, 1))
    up = Box("UP", (2, 2, 2), (kind,), low=(0.2, 0.2, 1), size=(1, 1, 0.5), after=low)
    deck = low.cards() + up.cards() + "*MATERIAL, NAME=STEEL\n" + SVK
    deck += f"*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n{friction}\n"
    deck += "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 1.,  0., 0., 1.\n"
    deck += f"*CONTACT PAIR, INTERACTION=DRY\nUP-Z0, {master}\n"
    loads = f"*BOUNDARY\nLOW-Z0, 1, 3\nUP-Z1, 1, 2\n*DSLOAD\nUP-Z1, P, {pressure}\n"
    if beside > 0.0:
        loads += f"*CLOAD\n{up.side(0, 1)[0]}, 3, {-beside}\n"
    return deck + step(loads, increment="1.")


class HeldInPlane(BoxCase):
    def test_forces_are_the_loads(self):
        """In one increment; the pressure is over the area that supports keep."""
        for kind, master, friction, pressure, beside in (
            ("C3D8", "LOW-Z1", 0.0, 60.0, 0.0), ("C3D8", "LOW-Z1", 0.3, 10.0, 2.0),
            ("C3D8", "FLOOR", 0.0, 60.0, 10.0), ("C3D10", "LOW-Z1", 0.0, 10.0, 1.0),
            ("C3D20R", "LOW-Z1", 0.3, 60.0, 5.0), ("C3D20R", "FLOOR", 0.0, 10.0, 0.0),
        ):
            with self.subTest(kind=kind, master=master, friction=friction, beside=beside):
                result = self.solve(pressed(kind, friction, pressure, master, beside))
                force = result.pairs[0].resultant
                self.assertEqual(len(force), 1)
                np.testing.assert_allclose(force[-1][2], pressure + beside, rtol=1e-8)


if __name__ == "__main__":
    unittest.main()
