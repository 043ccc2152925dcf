"""*CLEARANCE: a gap in place of that of the mesh, for all slave nodes of a pair.

By hand: two bars of height 1, Young's modulus 1000, no Poisson's ratio and cross-section 1, of
which the upper is pushed down by d. With the clearance c both bars are shortened by d - c: the
force is 1000 (d - c)/2, and nothing where d < c, wherever the mesh has the upper bar.
"""

import subprocess
import unittest

import numpy as np
from program import PROGRAM, Run

DECK = """\
*PARAMETER
at = 1.1
value = 0.002
down = 0.022
*BLOCK, NAME=LOW, NX=3, NY=3, NZ=2
0., 0., 0., 1., 1., 1.
*BLOCK, NAME=UP, NX=4, NY=4, NZ=2
0., 0., <at>, 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I{sliding}
UP-ZMIN, LOW-ZMAX
{gaps}
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
LOW-ZMIN, 1, 3
UP-ZMAX, 1, 2
UP-ZMAX, 3, 3, <-down>
*END STEP
"""
CLEARANCE = "*CLEARANCE, SLAVE=UP-ZMIN, MASTER=LOW-ZMAX, VALUE=<value>"


def deck(gaps=CLEARANCE, sliding=""):
    """Give the deck with other gaps."""
    return DECK.format(gaps=gaps, sliding=sliding)


def force(run):
    """Return the normal force at the end, and the extra gaps."""
    assert run.status == 0, run.errors
    with run.result() as result:
        (pair,) = result.pairs.values()
        return pair.resultant[-1], np.asarray(pair.extra_gap)


class Clearance(unittest.TestCase):
    """The force of two bars."""

    def test_the_force_is_that_of_the_clearance(self):
        for sliding in ("", ", SMALL SLIDING"):
            for at in (1.1, 1.0, 0.95):
                for value, expected in ((0.002, 10.0), (0.0, 11.0), (-0.005, 13.5), (0.03, 0.0)):
                    with self.subTest(sliding=sliding, at=at, value=value):
                        found, extra = force(Run(deck(sliding=sliding), name="bars", at=at,
                                                 value=value))
                        np.testing.assert_allclose(found, [0, 0, expected], atol=2e-7)
                        np.testing.assert_allclose(extra, value - (at - 1), atol=1e-14)

    def test_gaps_of_nodes_are_added(self):
        gap = "\n*CONTACT GAP\nUP-ZMIN, 0.004"
        found, _ = force(Run(deck(CLEARANCE + gap), name="bars"))
        np.testing.assert_allclose(found, [0, 0, 8.0], atol=2e-7)

    def test_a_finer_mesh_has_the_same_clearance(self):
        found, extra = force(Run(deck(), "--refine", "1", name="bars"))
        np.testing.assert_allclose(found, [0, 0, 10.0], atol=2e-6)
        self.assertEqual(len(extra), 81)

    def test_the_flat_deck_has_it(self):
        run = Run(deck(), "--flat", name="bars")
        self.assertIn("*CLEARANCE, SLAVE=UP-ZMIN, MASTER=LOW-ZMAX, VALUE=0.002", run.output)
        np.testing.assert_array_equal(force(Run(run.output, name="flat"))[0],
                                      force(Run(deck(), name="bars"))[0])

    def test_before_an_obstacle(self):
        # A bar above a sphere of radius 200: the gaps of the mesh are different at all nodes.
        sphere = ("*OBSTACLE, NAME=BALL, TYPE=SPHERE\n0.5, 0.5, -200., 200.\n*CONTACT PAIR, "
                  "INTERACTION=I\nLOW-ZMIN, BALL\n*CLEARANCE, SLAVE=LOW-ZMIN, MASTER=BALL, "
                  "VALUE=0.01")
        run = Run(deck(f"{CLEARANCE}\n{sphere}"), name="bars")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            pairs = result.pairs.values()
            pair = next(one for one in pairs if one.name.endswith("BALL"))
            x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
            mesh = np.sqrt((x - 0.5) ** 2 + (y - 0.5) ** 2 + 200.0**2) - 200
            np.testing.assert_allclose(np.sort(pair.extra_gap), np.sort(0.01 - mesh.ravel()),
                                       atol=1e-12)

    def test_a_run_that_goes_on_has_it_still(self):
        free = ("*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY, OP=NEW\nLOW-ZMIN, 1, 3\n*CLOAD\n"
                "UP-ZMAX, 3, 10.\n*END STEP\n")
        run = Run(deck() + free, name="bars")
        self.assertEqual(run.status, 2, run.output)
        done = subprocess.run([PROGRAM, "bars.inp", "--continue"], cwd=run.folder,
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        with run.result() as result:
            (pair,) = result.pairs.values()
            np.testing.assert_allclose(pair.resultant[-1], [0, 0, 10.0], atol=2e-7)


if __name__ == "__main__":
    unittest.main()
