"""A cube on a slab as a CalculiX user has it, the slab made an obstacle: as CalculiX finds it."""

import unittest

from program import SOURCE, Run

DECK = SOURCE / "tests" / "deck" / "odd" / "cube_on_slab.inp"

# The total force on the set Ntop at the end of each step, as ccx 2.20 prints it for the uncut
# deck: a slab a thousand times as stiff as the cube, penalties of 1e9 (contact) and 1e8 (sticking)
# MPa/mm.
CALCULIX = {
    3: (-4.0456e-5, -4.0456e-5, -232.4261),
    7: (12.92576, -1.629926, -227.5305),
}


class CubeOnSlab(unittest.TestCase):
    def test_the_support_pushes_as_in_calculix(self):
        run = Run(DECK)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            top = [result.node(node_id) for node_id in range(19, 28)]
            for row, force in CALCULIX.items():
                found = result.field("reaction_force", row)[top].sum(axis=0)
                for axis in range(3):
                    # The penalties and the slab give way by some 0.05 %.
                    self.assertAlmostEqual(
                        found[axis], force[axis], delta=1e-3 * abs(force[axis]) + 1e-3
                    )

    def test_what_was_cut_is_noted(self):
        plan = Run(DECK, "--plan").output
        for note in (
            "32 of 59 nodes belong to no element",
            "*ELEMENT without data",
            "set 'ESLABTOP' names elements that are not in the deck",
            "values prescribed on nodes that belong to no element are ignored",
            "loads on elements that are not in the deck are ignored",
        ):
            self.assertIn(note, plan)


if __name__ == "__main__":
    unittest.main()
