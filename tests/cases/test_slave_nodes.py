"""Slaves of nodes that have no faces of their own, before a surface of elements."""

import unittest

import numpy as np
from program import Run

NODES = [8, 9]  # on the lower side of the block, in a line
STEEL = "*MATERIAL, NAME=M\n*ELASTIC\n2000., 0.3\n"


def deck(master, *, gap=0.0, pair="", nlgeom="", more="", nodes=NODES):
    """Return a block that two nodes of its lower side hold above a body, or above a plane."""
    base = {
        "BASE-ZMAX": "*BLOCK, NAME=BASE, NX=5, NY=4, NZ=1\n-1., -1., -1.,  4., 4., 1.\n"
                     "*SOLID SECTION, ELSET=BASE, MATERIAL=M\n",
        "GROUND": "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n",
    }[master]
    held = "*BOUNDARY\nBASE, 1, 3\n" if master == "BASE-ZMAX" else ""
    return f"""*BLOCK, NAME=B, NX=4, NY=2, NZ=2
0., 0., {gap}, 2., 1.5, 1.
{STEEL}*SOLID SECTION, ELSET=B, MATERIAL=M
{base}*NSET, NSET=FEET
{", ".join(map(str, nodes))}
*SURFACE, NAME=FEET, TYPE=NODE
FEET
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I{pair}
FEET, {master}
{more}*STEP{nlgeom}
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
B-ZMAX, 1, 1, 0.01
B-ZMAX, 2, 2
B-ZMAX, 3, 3, -0.02
{held}*END STEP
"""


class SlaveNodes(unittest.TestCase):
    def solved(self, text):
        run = Run(text, name="case")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        return run, result

    def test_a_force_in_one_node(self):
        """Half of the block's weight in pressure, all of it in node 8, at the middle of an edge."""
        text = deck("BASE-ZMAX", nodes=[8])
        start = text.index("B-ZMAX, 1, 1")
        end = text.index("*BOUNDARY\nBASE")
        text = text[:start] + "B-ZMAX, 1, 2\n*DSLOAD\nB-ZMAX, P, 10.\n" + text[end:]
        run, result = self.solved(text)
        pair = result.pairs[0]
        force = np.asarray(pair.reaction[-1])
        at = int(np.flatnonzero(result.node_ids[pair.nodes] == 8)[0])
        np.testing.assert_allclose(force[at], [30, 0, 0], atol=1e-7)
        self.assertEqual(abs(np.delete(force, at, axis=0)).max(), 0)
        self.assertIn("the slave has nodes and no faces. Each stands", run.output)

    def test_a_body_that_is_held_is_a_plane(self):
        """Nodes before a body all of which is held do as the same nodes before an obstacle."""
        for nlgeom in ("", ", NLGEOM"):
            for tangent in ("KEPT", "NEWTON") if nlgeom else ("KEPT",):
                with self.subTest(nlgeom=nlgeom, tangent=tangent):
                    more = f"*BODY SOLVER, TANGENT={tangent}\n" if nlgeom else ""
                    found = [
                        self.solved(deck(master, nlgeom=nlgeom, more=more))[1]
                        for master in ("BASE-ZMAX", "GROUND")
                    ]
                    u = [result.field("displacement", -1)[:45] for result in found]
                    np.testing.assert_allclose(u[0], u[1], atol=1e-8 * abs(u[1]).max())
                    forces = [result.pairs[0].resultant[-1] for result in found]
                    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-7, atol=1e-7)
                    friction = np.linalg.norm(forces[0][:2])
                    self.assertGreater(friction, 0.01 * forces[0][2])

    def test_adjust_moves_slaves_alone(self):
        run, result = self.solved(deck("BASE-ZMAX", gap=0.01, pair=", ADJUST=0.02"))
        self.assertIn("moved 2 nodes, by 0.01 at most", run.output)
        low = result.points[:15]
        self.assertEqual([*np.flatnonzero(low[:, 2] == 0.0) + 1], NODES)

    def test_the_same_pair_twice(self):
        run = Run(deck("BASE-ZMAX", more="*CONTACT PAIR, INTERACTION=I\nFEET, BASE-ZMAX\n"),
                  name="case")
        self.assertEqual(run.status, 1)
        self.assertIn("duplicate contact pair 'FEET:BASE-ZMAX'", run.errors)


if __name__ == "__main__":
    unittest.main()
