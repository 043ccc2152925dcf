"""An accuracy that meshes do not reach says why: edges inside faces of the other body."""

import unittest

from program import ASKED, Run

DECK = """*PARAMETER
low = -0.37
wide = 0.78
*BLOCK, NAME=SOFT, TYPE=C3D8, NX=4, NY=4, NZ=2
-1., -1., 0.,  2., 2., 1.
*BLOCK, NAME=PUNCH, TYPE=C3D8, NX=2, NY=2, NZ=2
<low>, <low>, 1.,  <wide>, <wide>, 0.5
*MATERIAL, NAME=RUBBER
*ELASTIC
10., 0.3
*MATERIAL, NAME=STEEL
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=SOFT, MATERIAL=RUBBER
*SOLID SECTION, ELSET=PUNCH, MATERIAL=STEEL
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.
*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE
SOFT-ZMAX, PUNCH-ZMIN
*BOUNDARY
SOFT-ZMIN, 1, 3
PUNCH-ZMAX, 1, 2
*STEP
*STATIC
1., 1.
*BOUNDARY
PUNCH-ZMAX, 3, 3, -0.01
*END STEP
"""
ALIGN = "align the mesh"


class EdgesInsideFaces(unittest.TestCase):
    def test_cause_and_remedy(self):
        run = Run(DECK, *ASKED, "0.005", "--memory", "70MB", name="punch")
        self.assertEqual(run.status, 2, run.errors)
        self.assertRegex(run.errors, r"; edges of a body inside faces of the other make [\d.]+ %: "
                         + ALIGN)  # fmt: skip

    def test_edges_along_edges(self):
        """A punch as wide as the block leaves no node half covered, and nothing to align."""
        run = Run(DECK, *ASKED, "1e-6", "--memory", "70MB", name="punch", low=-1, wide=2)
        self.assertEqual(run.status, 2, run.errors)
        self.assertNotIn("align the mesh", run.errors)


if __name__ == "__main__":
    unittest.main()
