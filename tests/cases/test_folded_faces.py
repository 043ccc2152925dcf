"""Faces that a sticking tool twists until they fold: no contact is computed over these."""

import unittest

from facets import plate, rigid
from program import Run

CORNERS, FACETS = plate((0.15, 0.07), (0.82, 0.56), (2, 2))
# Seen from below, at the top of the block.
DOWN = [tuple(reversed(f)) for f in FACETS]



def tool(corners):
    """Return the cards of a tool at the top of the block."""
    return rigid("TOOL", [(x, y, 0.5) for x, y, _ in corners], DOWN, (9001, (0.1, 0.63, 1.5)))


SMALL = tool(CORNERS)
DECK = """*HEADING
a rough tool turns on a soft block
*PARAMETER
turn = -0.88
*BLOCK, NAME=B, NX=1, NY=2, NZ=2
0., 0., 0., 1., 0.7, 0.5
*MATERIAL, NAME=M
*ELASTIC
3., 0.45
*SOLID SECTION, ELSET=B, MATERIAL=M
{tool}*SURFACE INTERACTION, NAME=I
*FRICTION
6.7
*CONTACT PAIR, INTERACTION=I
B-ZMAX, TOOL
*BOUNDARY
B-ZMIN, 1, 3
*STEP
*STATIC
1., 1.
*BOUNDARY
9001, 1, 2
9001, 3, 3, -0.003
9001, 4, 6
*END STEP
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
9001, 6, 6, <turn>
*END STEP
""".replace("{tool}", SMALL)


class FoldedFaces(unittest.TestCase):
    """A turn of 50 degrees with the block's top sticking to the tool."""

    def test_what_twists_the_top_too_far_is_refused(self):
        """A tool over all of the top, as rough: the increment before is kept."""
        corners, _ = plate((-0.3, -0.3), (1.3, 1.0), (2, 2))
        run = Run(DECK.replace(SMALL, tool(corners)), name="folded")
        self.assertEqual(run.status, 2, run.output)
        with run.result() as result:
            self.assertEqual(len(result.history("time")), 1)

    def test_a_distorted_one_is_not(self):
        """A quarter of the turn distorts the top and folds nothing."""
        run = Run(DECK, name="distorted", turn=-0.22)
        self.assertEqual(run.status, 0, run.errors)


if __name__ == "__main__":
    unittest.main()
