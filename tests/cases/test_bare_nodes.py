"""Slave nodes of a surface of nodes that none of its faces has: they are left out of the pair."""

import unittest

import numpy as np
from program import Run

DECK = """\
*BLOCK, NAME=LOW, NX=4, NY=4, NZ=2
0., 0., 0., 4., 4., 1.
*BLOCK, NAME=UP, NX=2, NY=2, NZ=2
1., 1., 1., 2., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE, NAME=SLAVE, TYPE=NODE
UP-ZMIN
{more}
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I, TYPE=NODE TO SURFACE
{slave}, LOW-ZMAX
*STEP
*STATIC
*BOUNDARY
LOW-ZMIN, 1, 3
UP-ZMAX, 1, 1, 0.002
UP-ZMAX, 2, 2
UP-ZMAX, 3, 3, -0.01
*END STEP
"""
NOTE = ("contact pair SLAVE:LOW-ZMAX: 1 of 10 slave nodes are on none of the faces whose nodes the "
        "surface has, and are left out (the first: node 90)")


def run_of(slave, more="90"):
    """Run the deck: its output, and the forces of all points."""
    run = Run(DECK.format(slave=slave, more=more), name="blocks")
    assert run.status == 0, run.errors
    with run.result() as result:
        (pair,) = result.pairs.values()
        return run.output, np.asarray(pair.resultant[-1]), len(pair.extra_gap)


class BareNodes(unittest.TestCase):
    """A node of the surface above its faces."""

    def test_the_others_touch_as_the_faces_do(self):
        output, found, n = run_of("SLAVE")
        self.assertIn(NOTE, output)
        _, expected, _ = run_of("UP-ZMIN")
        self.assertEqual(n, 9)
        self.assertGreater(found[2], 1.0)
        np.testing.assert_array_equal(found, expected)

    def test_without_any_face_it_is_an_error(self):
        deck = DECK.format(slave="SLAVE", more="")
        run = Run(deck.replace("TYPE=NODE\nUP-ZMIN", "TYPE=NODE\n90"), name="blocks")
        self.assertEqual(run.status, 1)
        self.assertIn("has nodes without faces", run.errors)


if __name__ == "__main__":
    unittest.main()
