"""Welds, means and couplings within a contact pair: what they and contact could both carry."""

import re
import unittest

import numpy as np
from program import Run

LOW, UP = 0, 54
"""Nodes of the two sheets before their first: 9 x 3 x 2 each."""


def low(i, j):
    """Return the node of the lower sheet's upper side at place i, j."""
    return LOW + 28 + i + 9 * j


def up(i, j):
    """Return the node of the upper sheet's lower side at place i, j."""
    return UP + 1 + i + 9 * j


def equation(*terms):
    """Return the card of an equation of (node, dof, factor)."""
    lines = [terms[k : k + 4] for k in range(0, len(terms), 4)]
    text = "\n".join(", ".join(f"{n}, {d}, {f!r}" for n, d, f in line) for line in lines)
    return f"*EQUATION\n{len(terms)}\n{text}\n"


def spot(i, j, *dofs):
    """Return the cards of a weld of two nodes that face each other."""
    return "".join(equation((up(i, j), d, 1.0), (low(i, j), d, -1.0)) for d in dofs or (1, 2, 3))


def mean(places, dofs=(3,), factors=(1.0, 1.0)):
    """Return the cards that tie means of nodes to the means of those they face."""
    return "".join(
        equation(
            *((up(*at), d, f) for at, f in zip(places, factors, strict=True)),
            *((low(*at), d, -f) for at, f in zip(places, factors, strict=True)),
        )
        for d in dofs
    )


def sheets(joint, mu=0.3, small="NO", pull=1.0, swap=False, controls="", lift=0.25):
    """Return a deck: a sheet on another, joined within their contact, pressed by 4, then pulled."""
    slave, master = ("LOW-ZMAX", "UP-ZMIN") if swap else ("UP-ZMIN", "LOW-ZMAX")
    return f"""*HEADING
two sheets
*BLOCK, NAME=LOW, NX=8, NY=2, NZ=1
0., 0., 0., 4., 1., 0.25
*BLOCK, NAME=UP, NX=8, NY=2, NZ=1
0., 0., {lift!r}, 4., 1., 0.25
*MATERIAL, NAME=M
*ELASTIC
10000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
{joint}*SURFACE INTERACTION, NAME=I
*FRICTION
{float(mu)!r}
*CONTACT PAIR, INTERACTION=I, SMALL SLIDING={small}
{slave}, {master}
*CONTACT SOLVER, TOLERANCE=1e-9{controls}
*BOUNDARY
LOW-ZMIN, 1, 3
*STEP
*STATIC
1., 1.
*DSLOAD
UP-ZMAX, P, 1.
*END STEP
*STEP
*STATIC
0.5, 1.
*CLOAD
UP-XMAX, 1, {pull / 6!r}
*END STEP
"""


def refused_at_once(deck):
    """Return a deck whose increments are not tried in smaller and smaller parts."""
    return deck.replace("*STATIC\n", "*STATIC, DIRECT\n")


class Sheets(unittest.TestCase):
    """Two sheets, joined within their contact."""

    def run_sheets(self, joint, **options):
        run = Run(sheets(joint, **options), name="sheets")
        self.assertEqual(run.status, 0, run.errors)
        return run, run.result().file

    def check(self, file, n_redundant, pull=1.0, largest=0.5):
        """Supports carry the loads; no pressure is beyond what presses; reactions are the least."""
        contact = next(iter(file["contact"].values()))
        support = file["VTKHDF/PointData/reaction_force"][:].reshape(3, -1, 3).sum(axis=1)
        np.testing.assert_allclose(support[:, 2], 4, atol=1e-6)
        np.testing.assert_allclose(support[:, 0], [0, -pull / 2, -pull], atol=1e-6)
        redundant = contact["redundant"][:] > 0
        np.testing.assert_array_equal(redundant.sum(axis=1), n_redundant)
        np.testing.assert_array_equal(file["history/redundant_points"][:], n_redundant)
        normal = contact["reaction"][:, :, 0]
        self.assertLess(normal.max(), largest)
        # Where all that could be shared presses, some of it could be given to the joint.
        pressure = file["VTKHDF/PointData/contact_pressure"][:].reshape(3, -1)
        node = contact["node"][:].ravel()
        self.assertEqual(np.abs(pressure[:, node][redundant]).max(initial=0), 0)
        self.assertLess(file["history/certificate/balance"][:].max(), 1e-8)
        return normal, redundant


class Welds(Sheets):
    """Single nodes."""

    def test_a_weld_carries_and_contact_beside_it(self):
        """4 is pressed on; the share of the welded node goes to the points beside it."""
        for small in ("NO", "YES"):
            for mu in (0.3, 0):
                with self.subTest(small=small, mu=mu):
                    run, file = self.run_sheets(spot(4, 1), mu=mu, small=small)
                    normal, _ = self.check(file, 0)
                    np.testing.assert_allclose(normal.sum(axis=1), 4, atol=0.02)
                    self.assertIn("both sides of 1 points", run.output)

    def test_several_welds_and_either_side_the_slave(self):
        found = []
        for options in ({}, {"swap": True}, {"small": "YES"}):
            _, file = self.run_sheets(spot(2, 1) + spot(4, 1) + spot(6, 1), **options)
            found.append(self.check(file, 0)[0].sum(axis=1))
        np.testing.assert_allclose(found[1], found[0], rtol=2e-4)
        np.testing.assert_allclose(found[2], found[0], rtol=2e-4)

    def test_solvers_end_alike(self):
        found = []
        for controls in (
            "",
            ", SOLVER=GLOBAL NEWTON",
            ", COMPLIANCE=PRODUCTS",
            ", SOLVER=SWEEPS, LOCAL=EXACT",
            ", SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL",
        ):
            _, file = self.run_sheets(spot(2, 1) + spot(6, 1), small="YES", controls=controls)
            found.append(self.check(file, 0)[0])
        for other in found[1:]:
            np.testing.assert_allclose(other, found[0], atol=1e-5)

    def test_digits_of_the_mesh_do_not_count(self):
        """The upper sheet lies beside its place by less than a thousandth of an element."""
        for small in ("NO", "YES"):
            text = sheets(spot(4, 1), small=small)
            shifted = text.replace("NZ=1\n0., 0., 0.25", "NZ=1\n0.0003, -0.0002, 0.25")
            self.assertNotEqual(shifted, text)
            run = Run(shifted, name="sheets")
            self.assertEqual(run.status, 0, run.errors)
            normal, _ = self.check(run.result().file, 0)
            np.testing.assert_allclose(normal.sum(axis=1), 4, atol=0.02)


class Means(Sheets):
    """Equations of which no row of a point is a part: their sums are."""

    PAIR = ((2, 1), (6, 1))

    def test_one_of_two_does_not_press(self):
        for small in ("NO", "YES"):
            with self.subTest(small=small):
                _, file = self.run_sheets(mean(self.PAIR), small=small, pull=0.9)
                normal, where = self.check(file, 2, pull=0.9)
                self.assertLess(normal[where].reshape(3, 2).min(axis=1).max(), 1e-8)
                np.testing.assert_allclose(normal[0].sum(), 3.5, atol=0.02)

    def test_all_directions_and_other_factors(self):
        _, file = self.run_sheets(mean(self.PAIR, (1, 2, 3)), mu=0)
        self.check(file, 2)
        _, file = self.run_sheets(
            mean((*self.PAIR, (4, 0)), factors=(1.0, 2.5, 0.3)), pull=0.9, small="YES"
        )
        normal, where = self.check(file, 3, pull=0.9)
        self.assertLess(normal[where].reshape(3, 3).min(axis=1).max(), 1e-8)

    def test_a_difference_leaves_the_sum(self):
        """What one takes the other gives: equal reactions are the least, and 4 is pressed."""
        joint = equation(
            (up(2, 1), 3, 1.0), (up(6, 1), 3, -1.0), (low(2, 1), 3, -1.0), (low(6, 1), 3, 1.0)
        )
        _, file = self.run_sheets(joint, small="YES")
        normal, where = self.check(file, 2)
        np.testing.assert_allclose(normal.sum(axis=1), 4, atol=1e-6)
        shares = normal[where].reshape(3, 2)
        np.testing.assert_allclose(shares[:, 0], shares[:, 1], atol=1e-7)

    def test_self_stress_holds_no_pull(self):
        """Friction of 0.0035 at most: the joint could press the sheets with any force."""
        for small in ("NO", "YES"):
            deck = refused_at_once(sheets(mean(self.PAIR), mu=1e-3, small=small))
            run = Run(deck, name="sheets")
            self.assertEqual(run.status, 2)
            self.assertIn("nothing balances the loads", run.errors)
            file = run.result().file
            contact = next(iter(file["contact"].values()))
            self.assertEqual(file["history/step"][0], 1)
            self.assertLess(contact["reaction"][:, :, 0].sum(axis=1).max(), 4)

    def test_friction_limit_is_that_of_the_least(self):
        """Of 0.3 x 3.02: two means take more than one, and 1 is more than friction holds."""
        joint = mean(self.PAIR) + mean(((3, 1), (5, 1)))
        _, file = self.run_sheets(joint, pull=0.6)
        self.check(file, 4, pull=0.6)
        self.assertEqual(Run(refused_at_once(sheets(joint)), name="sheets").status, 2)

    def test_an_overlap_that_stays_is_told(self):
        run, file = self.run_sheets(mean(self.PAIR), lift=0.2497, small="YES", pull=0.9)
        self.check(file, 2, pull=0.9)
        depth = re.search(
            r"keep 2 points of \S+ in their master, by up to (\S+) .*not carried", run.output
        )
        self.assertAlmostEqual(float(depth[1]), 3e-4, delta=1e-9)


class Coupled(Sheets):
    """A rigid spot of nodes of both sheets."""

    def test_a_coupling_of_both_sides(self):
        nodes = ", ".join(str(f(i, j)) for f in (low, up) for i in (3, 4) for j in (0, 1))
        card = "*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=SPOT\n*KINEMATIC\n"
        for small, dofs in (("NO", ""), ("YES", "3, 3\n")):
            with self.subTest(small=small, dofs=dofs):
                joint = f"*NODE\n900, 2., 0.5, 0.25\n*NSET, NSET=SPOT\n{nodes}\n{card}{dofs}"
                _, file = self.run_sheets(joint, small=small, pull=0.5)
                self.check(file, 0, pull=0.5)


class OneSide(unittest.TestCase):
    """Nodes joined to each other before a rigid floor."""

    def test_opposite_motions_are_no_wedge(self):
        """Two nodes that go opposite ways up and down press no more than the load."""
        text = """*HEADING
a block on a floor
*BLOCK, NAME=B, NX=4, NY=1, NZ=1
0., 0., 0., 4., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*EQUATION
2
2, 3, 1., 4, 3, 1.
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.01
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
*STEP
*STATIC
1., 1.
*DSLOAD
B-ZMAX, P, 1.
*END STEP
*STEP
*STATIC
1., 1.
*CLOAD
B-XMAX, 1, 0.25
*END STEP
"""
        run = Run(text, name="block")
        self.assertEqual(run.status, 2)
        self.assertIn("nothing balances the loads", run.errors)
        contact = next(iter(run.result().file["contact"].values()))
        self.assertLess(contact["reaction"][:, :, 0].sum(axis=1).max(), 4 + 1e-6)


if __name__ == "__main__":
    unittest.main()
