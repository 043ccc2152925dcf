"""Faces of which a support takes a corner past their diagonal: contact is not computed there."""

import unittest

from facets import plate, rigid
from program import Run

CORNERS, FACETS = plate((-0.3, -0.3), (1.3, 1.0), (2, 2))
# Seen from below, at the top of the block.
DOWN = [tuple(reversed(f)) for f in FACETS]

DECK = """*HEADING
a support takes a corner of the top across its face, below a smooth tool
*PARAMETER
along = 0.515
across = 0.187
*BLOCK, NAME=B, NX=1, NY=2, NZ=2
0., 0., 0., 1., 0.7, 0.5
*MATERIAL, NAME=M
*ELASTIC
3., 0.45
*SOLID SECTION, ELSET=B, MATERIAL=M
{tool}*SURFACE INTERACTION, NAME=I
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
13, 1, 1, <along>
13, 2, 2, <across>
*END STEP
""".replace("{tool}", rigid("TOOL", [(x, y, 0.5) for x, y, _ in CORNERS], DOWN,
                            (9001, (0.1, 0.63, 1.5))))  # fmt: skip


class FoldedFaces(unittest.TestCase):
    """Node 13 is the corner at (0, 0) of a face of 1 by 0.35."""

    def test_a_folded_face_is_refused(self):
        """The corner points inwards: the increment before is kept."""
        run = Run(DECK, name="folded")
        self.assertEqual(run.status, 2, run.output)
        told = r"step 2, increment 1: at node \d+ of .*B-ZMAX.* a face is folded"
        self.assertRegex(run.errors, told)
        with run.result() as result:
            self.assertEqual(len(result.history("time")), 1)

    def test_a_distorted_one_is_not(self):
        """A hundredth less of the way folds nothing."""
        run = Run(DECK, name="distorted", along=0.51, across=0.184)
        self.assertEqual(run.status, 0, run.errors)


if __name__ == "__main__":
    unittest.main()
