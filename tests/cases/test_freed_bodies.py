"""Bodies that one step holds and a later one frees, where nothing remembers the path: runs end."""

import unittest

from program import Run

BLOCK = """*BLOCK, NAME=A, NX=1, NY=1, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=A, MATERIAL=M
*SURFACE INTERACTION, NAME=I
"""
PLANE = """*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*CONTACT PAIR, INTERACTION=I
A-ZMIN, G
"""
TOOL = """*NODE
900, .5, .5, 0.
*OBSTACLE, NAME=G, TYPE=PLANE, REF NODE=900
0., 0., 0.,  0., 0., 1.
*CONTACT PAIR, INTERACTION=I
A-ZMIN, G
"""


def step(cards):
    """Return a step of two increments: the estimate of load steps looks at its second."""
    return f"*STEP\n*STATIC\n0.5, 1.\n{cards}*END STEP\n"


class FreedBodies(unittest.TestCase):
    def force(self, deck):
        """Return the normal force at the end."""
        run = Run(deck, name="freed")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            self.assertTrue(result.certified)
            return result.pairs[0].resultant[-1, 2]

    def test_a_clamp_is_taken_off(self):
        """The block rests on the plane under its weight of 1."""
        first = "*BOUNDARY\nA-XMIN, 1\nA-YMIN, 2\nA-ZMAX, 3\n*DLOAD\nA, GRAV, 1., 0., 0., -1.\n"
        second = "*BOUNDARY, OP=NEW\nA-XMIN, 1\nA-YMIN, 2\n"
        self.assertAlmostEqual(self.force(BLOCK + PLANE + step(first) + step(second)), 1.0, 7)

    def test_a_tool_is_driven_and_then_loaded(self):
        """A plane is driven by 0.01, and then pressed by 12."""
        held = "A-ZMAX, 1, 3\n900, 1, 2\n"
        first = "*BOUNDARY\n" + held + "900, 3, 3, 0.01\n"
        second = "*BOUNDARY, OP=NEW\n" + held + "*CLOAD\n900, 3, 12.\n"
        self.assertAlmostEqual(self.force(BLOCK + TOOL + step(first) + step(second)), 12.0, 6)

    def test_a_support_along_the_plane_is_let_go(self):
        """The block is pressed by 20 on its top of area 1 and may then move along y."""
        first = "*BOUNDARY\nA-XMIN, 1\nA-YMIN, 2\n*DSLOAD\nA-ZMAX, P, 20.\n"
        second = "*BOUNDARY, OP=NEW\nA-XMIN, 1\n"
        self.assertAlmostEqual(self.force(BLOCK + PLANE + step(first) + step(second)), 20.0, 6)


if __name__ == "__main__":
    unittest.main()
