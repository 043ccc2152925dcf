"""Contact points whose two sides cannot move apart: clamped, tied or shared.

Their rows are zero but for rounding, or second differences of the motion of one side: reactions
there would be anything. What such a node's multiplier covers its neighbours get.
"""

import unittest

import numpy as np
from fixed_scenes import Crack, clamped, equations, glued
from program import Run
from two_bodies import solved

GLUE = [(55 + i + 9 * j, 37 + i + 9 * j) for j in (0, 1) for i in range(5)]


class Contact:
    """What a result says of its only pair at the last increment."""

    def __init__(self, result):
        (group,) = result.file["contact"].values()
        self.x = np.array(group["coordinates"])
        self.reaction = np.array(group["reaction"])[-1]
        self.area = np.array(group.get("covered_area", [group["area"]]))[-1]
        self.slip = np.array(group["slip"])[-1]
        self.resultant = np.array(group["resultant"])[-1]
        ids = np.array(result.file["VTKHDF/PointData/node_id"])
        self.node = ids[np.array(group["node"])]
        moved = np.array(result.file["VTKHDF/PointData/displacement"])[-len(ids) :]
        self.moved = {node: moved[k] for k, node in enumerate(ids)}
        self.largest = abs(moved).max()

    def pressure(self):
        """Pressures of the points that have an area."""
        return self.reaction[self.area > 0, 0] / self.area[self.area > 0]


class Case(unittest.TestCase):
    def contact(self, text, *options):
        """Solve a deck and return its pair."""
        result = solved(self, text, *options)
        self.output = result.output
        return Contact(result)


class Clamped(Case):
    """Sources: 3.36 and 0.0021 are the limits of meshes of 4, 8, 16 elements (3.50, 3.42, 3.38)."""

    def check(self, text, points):
        """Reactions are of the size of the load, none on the clamped edge."""
        contact = self.contact(text)
        self.assertAlmostEqual(contact.resultant[2], 3.46, delta=0.12)
        self.assertAlmostEqual(contact.largest, 0.00208, delta=0.00005)
        self.assertLess(abs(contact.pressure()).max(), 1.3)
        edge = contact.x[:, 0] == 0
        self.assertEqual(abs(contact.reaction[edge]).max(), 0)
        self.assertIn(f"keep both sides of {points} points of UP-ZMIN:LOW-ZMAX", self.output)
        return contact

    def test_any_meshes_sliding_and_friction(self):
        for low, up, options in (
            (4, 4, {}),
            (4, 4, {"small": "YES"}),
            (4, 4, {"mu": 0}),
            (4, 5, {}),
            (5, 4, {"mu": 0}),
            (8, 4, {"small": "YES"}),
            (3, 7, {"mu": 0.9}),
        ):
            with self.subTest(low=low, up=up, **options):
                self.check(clamped((low, 2), (up, 2), **options), 3)

    def test_covered_area_reaches_the_edge(self):
        contact = self.check(clamped(small="YES"), 3)
        self.assertAlmostEqual(contact.area.sum(), 4.0, delta=1e-12)
        # The column beside the edge has the half of an element that the edge had.
        beside = contact.area[contact.x[:, 0] == 1.0].sum()
        self.assertAlmostEqual(beside, 1.5, delta=1e-12)

    def test_uniform_pressure_reaches_the_edge(self):
        # A column that does not spread: all moves along z as stress/E, but for the held edge's x,
        # y. Its normals are held on one side alone.
        held = "LOW-XMIN, 1, 2\nUP-XMIN, 1, 2\nLOW-ZMIN, 1, 2"
        text = clamped((4, 2), (5, 2), held=held, mu=0, small="YES").replace(
            "1000., 0.3", "1000., 0."
        )
        contact = self.contact(text)
        self.assertLess(abs(contact.pressure() - 1.0).max(), 1e-9)

    def test_normals_alone_held_under_tilting(self):
        # Deformation inclines the normals: where the edge may slide that frees nothing.
        held = "LOW-ZMIN, 1, 2\nLOW-XMIN, 1, 3\nUP-XMIN, 3, 3"
        of = {
            small: self.contact(clamped((4, 2), (5, 2), held=held, small=small))
            for small in ("YES", "NO")
        }
        for contact in of.values():
            self.assertLess(abs(contact.pressure()).max(), 1.3)
        self.assertAlmostEqual(of["YES"].resultant[2], of["NO"].resultant[2], delta=1e-3)

    def test_tangents_alone_held_keep_their_normal(self):
        held = "LOW-ZMIN, 1, 2\nLOW-XMIN, 1, 3\nUP-XMIN, 1, 2"
        contact = self.contact(clamped((4, 2), (5, 2), held=held))
        self.assertAlmostEqual(contact.resultant[2], 4.0, delta=1e-6)
        self.assertNotIn("from moving apart", self.output)

    def test_an_overlap_from_the_start_is_reported(self):
        for small in ("YES", "NO"):
            self.contact(clamped((4, 2), (5, 2), small=small, height=0.999))
            self.assertIn("their overlap of up to 0.001 is not carried", self.output)

    def test_an_overlap_that_motion_makes_is_refused(self):
        run = Run(clamped((4, 2), (5, 2), pushed="*BOUNDARY\nUP-XMIN, 3, 3, -0.01\n"), name="deck")
        self.assertEqual(run.status, 2)
        self.assertIn("is prescribed to move 0.005 into LOW-ZMAX", run.errors)
        self.contact(clamped((4, 2), (5, 2), pushed="*BOUNDARY\nUP-XMIN, 3, 3, 0.01\n"))


class BeforeObstacles(Case):
    """A cube whose lower edge is clamped within a plane, by 0.01."""

    DECK = """*HEADING
A cube that is held within a plane
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
900, 0., 0., 0.
*OBSTACLE, NAME=G, TYPE=PLANE, REF NODE=900
0., 0., 0.01, 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, G
*NSET, NSET=EDGE
1, 4, 7
*BOUNDARY
EDGE, 1, 3
900, 1, 2
*STEP
*STATIC
1., 1.
*BOUNDARY
900, 3, 3, {way}
*DSLOAD
B-ZMAX, P, 1.
*END STEP
"""

    def test_an_overlap_that_stays_is_not_carried(self):
        contact = self.contact(self.DECK.format(way=0.0))
        self.assertIn("their overlap of up to 0.01 is not carried", self.output)
        self.assertEqual(abs(contact.reaction[contact.x[:, 0] == 0]).max(), 0)

    def test_one_that_grows_is_refused(self):
        run = Run(self.DECK.format(way=0.001), name="deck")
        self.assertEqual(run.status, 2)
        self.assertIn("into G", run.errors)


class Glued(Case):
    """The strips pass the load uniformly: 2 on the right half, shear and bending add some."""

    def check(self, text, points):
        """The contact carries its half; nothing is on the edge of the glue."""
        contact = self.contact(text)
        self.assertAlmostEqual(abs(contact.resultant[2]), 2.13, delta=0.03)
        self.assertAlmostEqual(contact.largest, 0.00242, delta=0.00005)
        edge = contact.x[:, 0] == 2
        self.assertEqual(abs(contact.reaction[edge]).max(), 0)
        self.assertIn(f"keep both sides of {points} points", self.output)
        return contact

    def test_meshes_that_match(self):
        for options in ({}, {"small": "YES"}, {"pair": "LCS, UCS"}, {"glue": "*TIE\nLGS, UGS\n"}):
            with self.subTest(**options):
                self.check(glued(**options), 2)

    def test_meshes_that_do_not_match(self):
        for low, up, pair, points in (
            ((12, 1), (8, 1), "UCS, LCS", 2),
            ((6, 2), (4, 3), "UCS, LCS", 4),
            ((6, 2), (4, 3), "LCS, UCS", 3),
            ((4, 3), (10, 5), "LCS, UCS", 4),
        ):
            with self.subTest(low=low, up=up, pair=pair):
                self.check(glued(low, up, pair), points)

    def test_equations_do_what_a_tie_does(self):
        tied = self.check(glued(), 2)
        joined = self.check(glued(glue=equations(GLUE)), 2)
        self.assertLess(abs(joined.reaction - tied.reaction).max(), 1e-6)


class Cracks(Case):
    """A closed crack that slides: the stress across it is p sin^2, and it slips by
    4 (1 - nu^2)/E (p sin cos - mu p sin^2) sqrt(1 - s^2).
    """

    SLIP, PRESSURE = 3.8076e-3, 11.698

    def slips(self, crack, contact):
        """Slips between the lips over what they should be, on the middle three quarters."""
        tied = {v: k for k, v in crack.number.items()}
        slips = {}
        for node in contact.node:
            i, j, k, side = tied[int(node)]
            s = crack.x[i]
            if abs(s) > 0.75:
                continue
            other = crack.number[i, j, k, -side]
            slip = np.linalg.norm(contact.moved[int(node)] - contact.moved[other])
            slips[s, k] = slip / (crack.length * self.SLIP * np.sqrt(1 - s * s))
        return slips

    def test_pressure_and_slip(self):
        crack = Crack()
        contact = self.contact(crack.deck())
        self.assertIn("keep both sides of 4 points of UPPER:LOWER", self.output)
        self.assertLess(abs(contact.pressure() / self.PRESSURE - 1).max(), 1e-4)
        slips = self.slips(crack, contact)
        self.assertLess(abs(slips[0.0, 0] - 1), 0.04)
        # A bound by the mesh, towards the tips.
        self.assertLess(max(abs(v - 1) for v in slips.values()), 0.075)

    def test_turned_small_swapped_and_finite(self):
        crack = Crack(turn=0.5, length=1e-3)
        for small in ("YES", "NO"):
            contact = self.contact(crack.deck(small=small, pair="LOWER, UPPER"))
            self.assertLess(abs(self.slips(crack, contact)[0.0, 0] - 1), 0.042)

    def test_half_the_error_on_twice_the_elements(self):
        crack = Crack(n=40)
        slips = self.slips(crack, self.contact(crack.deck()))
        self.assertLess(abs(slips[0.0, 0] - 1), 0.024)

    def test_a_crack_that_sticks(self):
        crack = Crack()
        contact = self.contact(crack.deck(mu=3.0))
        self.assertLess(max(self.slips(crack, contact).values()), 1e-9)


if __name__ == "__main__":
    unittest.main()
