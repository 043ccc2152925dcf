"""General contact: the pairs that *CONTACT makes are those that one would write by hand."""

import re
import unittest

import numpy as np
from program import INPUT, Run

PAIR = re.compile(r"\*CONTACT PAIR, INTERACTION=([A-Z]+).*\n((?:[^*\n].*\n)+)")
GENERAL = "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n"


def pairs_of(text):
    """Return the pairs of a deck: interaction, slave, master."""
    return [
        (interaction, *(word.strip() for word in line.split(",")))
        for interaction, lines in PAIR.findall(text) for line in lines.splitlines()
    ]


def without_pairs(text):
    """Return a deck without its pairs, with a mark where the first was."""
    return PAIR.sub("", PAIR.sub("@@\n", text, count=1))


def by_hand(text, names):
    """Return the deck with the roles that general contact gives the bodies of its pairs."""
    cards = ""
    for interaction, slave, master in pairs_of(text):
        bodies = [(one.split("-")[0], other.split("-")[0])
                  for one, other in (name.split(":") for name in names)]
        if (master.split("-")[0], slave.split("-")[0]) in bodies:
            slave, master = master, slave
        cards += f"*CONTACT PAIR, INTERACTION={interaction}, ADJUST=0\n{slave}, {master}\n"
    return without_pairs(text).replace("@@\n", cards)


def general(text):
    """Return the deck with general contact: each pair's interaction for its surfaces."""
    cards = GENERAL + "*CONTACT PROPERTY ASSIGNMENT\n"
    cards += f", , {pairs_of(text)[0][0]}\n"
    cards += "".join(f"{slave}, {master}, {interaction}\n"
                     for interaction, slave, master in pairs_of(text)[1:]
                     if interaction != pairs_of(text)[0][0])
    return without_pairs(text).replace("@@\n", cards)


BLOCKS = """\
*BLOCK, NAME=LOW, ELSET=LOW, NX=3, NY=3, NZ=2
0., 0., 0., 3., 3., 1.
*BLOCK, NAME=UP, ELSET=UP, NX=2, NY=2, NZ=2
0.5, 0.5, {height}, 1.5, 1.5, 1.
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*ELSET, ELSET=ALL
LOW, UP
*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
*SURFACE INTERACTION, NAME=ROUGH
*FRICTION, ROUGH
{cards}*BOUNDARY
LOW-ZMIN, 1, 3
UP-ZMAX, 1, 2
*STEP
*STATIC
1., 1.
*DSLOAD
UP-ZMAX, P, {pressure}
*END STEP
"""
PROPERTY = "*CONTACT PROPERTY ASSIGNMENT\n, , DRY\n"


def grid(first, n, size, low):
    """Return lines of nodes and of elements, and a function that numbers the nodes."""
    def number(i, j):
        return first + i + (n[0] + 1) * j

    nodes = [f"{number(i, j)}, {size[0] * i / n[0]}, {low + size[1] * j / n[1]}"
             for j in range(n[1] + 1) for i in range(n[0] + 1)]
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    cells = [f"{first + i + n[0] * j}, " + ", ".join(str(number(i + a, j + b)) for a, b in corners)
             for j in range(n[1]) for i in range(n[0])]
    return "\n".join(nodes), "\n".join(cells), number


def punch_on_rubber(cards):
    """Return a punch of revolution with a sharp corner, pressed into a disc by a tenth."""
    disc, cells_of_disc, of_disc = grid(1, (10, 5), (10.0, 4.0), 0.0)
    punch, cells_of_punch, of_punch = grid(101, (4, 4), (2.0, 3.0), 4.0)

    def names(nodes):
        return ", ".join(map(str, nodes))

    def faces(elements, face):
        return "\n".join(f"{element}, S{face}" for element in elements)

    return f"""\
*NODE
{disc}
{punch}
*ELEMENT, TYPE=CAX4, ELSET=DISC
{cells_of_disc}
*ELEMENT, TYPE=CAX4, ELSET=PUNCH
{cells_of_punch}
*NSET, NSET=AXIS
{names(of_disc(0, j) for j in range(6))},
{names(of_punch(0, j) for j in range(5))}
*NSET, NSET=LOW
{names(of_disc(i, 0) for i in range(11))}
*NSET, NSET=HIGH
{names(of_punch(i, 4) for i in range(5))}
*SURFACE, NAME=TOP
{faces(range(41, 51), 3)}
*SURFACE, NAME=UNDERSIDE
{faces(range(101, 105), 1)}
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, MOONEY-RIVLIN
0.4, 0.1, 0.05
*SOLID SECTION, ELSET=PUNCH, MATERIAL=STEEL
*SOLID SECTION, ELSET=DISC, MATERIAL=RUBBER
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
{cards}*BOUNDARY
LOW, 2, 2
AXIS, 1, 1
*STEP, NLGEOM
*STATIC
0.1, 1.
*BOUNDARY
HIGH, 2, 2, -0.4
*END STEP
"""


class General(unittest.TestCase):
    def run_deck(self, deck, **settings):
        run = Run(deck, name="deck", **settings)
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result, run

    def blocks(self, cards, height="1.", pressure=10):
        return self.run_deck(BLOCKS.format(cards=cards, height=height, pressure=pressure))

    def test_is_the_pairs_written_by_hand(self):
        """To 1e-9 of the largest displacement; the meshes are those of the example decks."""
        for name in ("stack", "foundation", "bolt", "cylinder", "punch"):
            with self.subTest(deck=name):
                text = (INPUT / f"{name}.inp").read_text()
                text = text.replace("meshes/", f"{INPUT}/meshes/")
                whole, _ = self.run_deck(general(text), tolerance=1e-12)
                names = list(whole.pairs)
                hand, _ = self.run_deck(by_hand(text, names), tolerance=1e-12)
                u, v = whole.field("displacement"), hand.field("displacement")
                self.assertLess(abs(u - v).max(), 1e-9 * abs(v).max())

    def test_the_side_of_a_punch_begins_to_face_what_it_is_pressed_into(self):
        """Its share of the rows grows from nothing: force and run are those without the side."""
        hand = "*CONTACT PAIR, INTERACTION=DRY\nTOP, UNDERSIDE\n"
        forces = []
        for cards in (hand, GENERAL + PROPERTY):
            result, _ = self.run_deck(punch_on_rubber(cards))
            self.assertEqual(len(result.history("certified")), 10)
            forces.append(result.pairs[next(iter(result.pairs))].resultant[-1])
        np.testing.assert_allclose(*forces, rtol=0, atol=0.01 * abs(forces[0]).max())

    def test_a_tool_whose_sides_face_the_strip_that_it_is_pressed_into(self):
        """Within what the mesh is off by: the strip bulges beside it, and touches it there."""
        text = (INPUT / "ironing.inp").read_text()
        text = text[: text.index("** Along th")]
        forces = []
        hand = text.replace("SOLE, STRIP-ZMAX", "STRIP-ZMAX, SOLE")
        for deck in (hand, general(text)):
            result, _ = self.run_deck(deck)
            forces.append(result.pairs[next(iter(result.pairs))].resultant[-1])
        np.testing.assert_allclose(*forces, rtol=0, atol=0.1 * abs(forces[0]).max())

    def test_an_interference_by_the_name_of_the_pair(self):
        """Rings pressed into each other by a clearance below 0, as two surfaces by hand."""
        text = (INPUT / "press.inp").read_text().replace("meshes/", f"{INPUT}/meshes/")
        text = re.sub(r"\*CONTACT GAP\n.*\n", "", text)
        clearance = "*CLEARANCE, SLAVE={}, MASTER={}, VALUE=-0.0025\n*CONTACT SOLVER"
        whole, _ = self.run_deck(
            general(text).replace("*CONTACT SOLVER", clearance.format("HUB", "RING")),
            tolerance=1e-12)
        hand, _ = self.run_deck(
            by_hand(text, ["HUB:RING"]).replace("*CONTACT SOLVER", clearance.format(
                "HUB-OUT", "RING-IN")), tolerance=1e-12)
        u, v = whole.field("displacement"), hand.field("displacement")
        self.assertGreater(abs(v).max(), 1e-4)
        self.assertLess(abs(u - v).max(), 1e-9 * abs(v).max())

    def test_the_last_property_that_fits_wins_and_without_one_nothing_rubs(self):
        for cards, mu in (
            (GENERAL, 0.0),
            (GENERAL + PROPERTY, 0.2),
            (GENERAL + PROPERTY + "UP-ZMIN, LOW-ZMAX, ROUGH\n", 1000.0),
            (GENERAL + "*CONTACT PROPERTY ASSIGNMENT\nUP-ZMIN, LOW-ZMAX, ROUGH\n, , DRY\n", 0.2),
        ):
            with self.subTest(cards=cards):
                result, run = self.blocks(cards)
                (pair,) = result.pairs
                self.assertEqual(result.pairs[pair].friction_coefficient, mu)
                self.assertEqual("is frictionless" in run.output, mu == 0)

    def test_overlaps_are_removed_without_strain(self):
        """By what the blocks overlap; nothing presses but the load of 2.25 times 10."""
        result, run = self.blocks(GENERAL + PROPERTY, height="0.98")
        self.assertRegex(run.output, "removes the overlap of LOW:UP in the mesh without strain: "
                         "[0-9]+ nodes moved, by 0.02 at most")
        self.assertAlmostEqual(abs(result.pairs["LOW:UP"].resultant[-1][2]), 22.5, delta=1e-6)

    def test_what_is_excluded_does_not_touch(self):
        for cards, pairs in (
            ("*CONTACT EXCLUSIONS\nLOW-ZMAX, UP-ZMIN\n", 0),
            ("*CONTACT EXCLUSIONS\n, UP-ZMIN\n", 0),
            ("*CONTACT EXCLUSIONS\n, UP-ZMAX\n", 1),
        ):
            with self.subTest(cards=cards):
                run = Run(BLOCKS.format(cards=GENERAL + cards, height="1.", pressure=10),
                          "--plan", name="deck")
                self.assertEqual(run.status, 0, run.errors)
                self.assertEqual("LOW:UP" in run.output, pairs == 1, run.output)

    def test_a_pair_by_hand_wins_for_its_faces(self):
        result, _ = self.blocks(
            GENERAL + PROPERTY + "*CONTACT PAIR, INTERACTION=ROUGH\nUP-ZMIN, LOW-ZMAX\n")
        self.assertEqual(list(result.pairs), ["UP-ZMIN:LOW-ZMAX"])

    def test_inclusions_name_surfaces_and_obstacles(self):
        floor = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
        for lines, names in (
            ("UP-ZMIN, LOW-ZMAX\n", ["LOW:UP"]),
            ("LOW-ZMIN, FLOOR\n", ["LOW:FLOOR"]),
            (", \n", ["LOW:UP", "LOW:FLOOR"]),
        ):
            with self.subTest(lines=lines):
                run = Run(BLOCKS.format(cards=floor + "*CONTACT\n*CONTACT INCLUSIONS\n" + lines,
                                        height="1.", pressure=10), "--plan", name="deck")
                self.assertEqual(run.status, 0, run.errors)
                for name in ("LOW:UP", "LOW:FLOOR"):
                    self.assertEqual(name in run.output, name in names, run.output)

    def test_roles_stay_under_refinement(self):
        """The upper block has the larger elements in the deck, and the smaller ones refined."""
        cards = GENERAL + PROPERTY + "*REFINE, ELSET=UP, TIMES=2\n"
        for deck in (GENERAL + PROPERTY, cards):
            run = Run(BLOCKS.format(cards=deck, height="1.", pressure=10), "--plan", name="deck")
            self.assertEqual(run.status, 0, run.errors)
            self.assertIn("LOW:UP", run.output)

    def test_closed_facets_of_a_rigid_body_need_no_surface(self):
        """A rigid box under the block carries its load; an open one is a mistake that says so."""
        box = ("*NODE\n9001, -5., -5., -2.\n9002, 5., -5., -2.\n9003, 5., 5., -2.\n"
               "9004, -5., 5., -2.\n9005, -5., -5., -1.\n9006, 5., -5., -1.\n9007, 5., 5., -1.\n"
               "9008, -5., 5., -1.\n9009, 0., 0., -3.\n*ELEMENT, TYPE=R3D4, ELSET=BOX\n"
               "9001, 9001, 9004, 9003, 9002\n9002, 9005, 9006, 9007, 9008\n"
               "9003, 9001, 9002, 9006, 9005\n9004, 9002, 9003, 9007, 9006\n"
               "9005, 9003, 9004, 9008, 9007\n9006, 9004, 9001, 9005, 9008\n"
               "*RIGID BODY, ELSET=BOX, REF NODE=9009\n")
        deck = ("*BLOCK, NAME=B, ELSET=B, NX=2, NY=2, NZ=2\n0., 0., -1., 1., 1., 1.\n" + box +
                "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*SOLID SECTION, ELSET=B, "
                "MATERIAL=STEEL\n*BOUNDARY\nB-ZMAX, 1, 2\n9009, 1, 3\n" + GENERAL +
                "*STEP\n*STATIC\n1., 1.\n*DSLOAD\nB-ZMAX, P, 10.\n*END STEP\n")
        result, _ = self.run_deck(deck)
        np.testing.assert_allclose(result.pairs["B:BOX"].normal_force[-1], [0, 0, 10], atol=1e-6)
        run = Run(deck.replace("9002, 9005, 9006, 9007, 9008\n", ""), "--plan", name="deck")
        self.assertEqual(run.status, 1)
        self.assertIn("they are not closed", run.errors)

    def test_slices_in_plane_strain(self):
        """Two plates of CPE4: the pair by hand, and the ends of the slice touch nothing."""
        nodes = elements = ""
        for body, (x, y, w, n) in enumerate(((0.0, 0.0, 3.0, 3), (0.75, 1.0, 1.5, 2))):
            first = 100 * body
            for j in range(3):
                for i in range(n + 1):
                    nodes += f"{first + j * (n + 1) + i + 1}, {x + w * i / n}, {y + j / 2}\n"
            elements += f"*ELEMENT, TYPE=CPE4, ELSET={'AB'[body]}\n"
            for j in range(2):
                for i in range(n):
                    a = first + j * (n + 1) + i + 1
                    elements += f"{first + j * n + i + 1}, {a}, {a + 1}, {a + n + 2}, {a + n + 1}\n"
        deck = ("*NODE\n" + nodes + elements + "*ELSET, ELSET=ALL\nA, B\n*MATERIAL, NAME=M\n"
                "*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n*SURFACE, NAME=TOP\n"
                "A, S3\n*SURFACE, NAME=FOOT\n101, S1\n102, S1\n*SURFACE INTERACTION, NAME=DRY\n"
                "*FRICTION\n0.2\n*NSET, NSET=BASE\n1, 2, 3, 4\n*NSET, NSET=HEAD\n107, 108, 109\n"
                "{}*BOUNDARY\nBASE, 1, 2\n*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nHEAD, 1, 1, 0.001\n"
                "HEAD, 2, 2, -0.01\n*END STEP\n")
        top = deck.replace("A, S3\n", "4, S3\n5, S3\n6, S3\n")
        whole, _ = self.run_deck(top.format(GENERAL + PROPERTY))
        self.assertEqual(list(whole.pairs), ["A:B"])
        hand, _ = self.run_deck(top.format("*CONTACT PAIR, INTERACTION=DRY\nTOP, FOOT\n"))
        u, v = whole.field("displacement"), hand.field("displacement")
        self.assertLess(abs(u - v).max(), 1e-9 * abs(v).max())

    def test_what_no_pair_keeps_apart_is_not_certified(self):
        """A block comes from farther away than both are long, into the other by half."""
        cards = "*CONTACT EXCLUSIONS\nLOW-ZMAX, UP-ZMIN\n"
        for contact, status, said in (
            (GENERAL, 2, r"node 5\d of UP is 0.5 inside LOW, where no contact pair keeps it out"),
            (GENERAL + cards, 0, None),
            ("", 0, "note: step 1: node .* of UP is 0.5 inside LOW"),
        ):
            with self.subTest(contact=contact):
                deck = BLOCKS.format(cards=contact, height="20.", pressure=0)
                deck = re.sub(r"\*DSLOAD\n.*\n", "*BOUNDARY\nUP-ZMAX, 3, 3, -19.5\n", deck)
                run = Run(deck, name="deck")
                self.assertEqual(run.status, status, run.errors)
                if said:
                    self.assertRegex(run.errors + run.output, said)
                else:
                    self.assertNotIn("inside LOW", run.errors + run.output)

    def test_what_the_mesh_has_in_each_other_is_told(self):
        """Once, where nothing keeps it out; bodies that touch overlap by nothing."""
        for height, n in (("0.9", 1), ("1.", 0)):
            deck = BLOCKS.format(cards="", height=height, pressure=0)
            deck = re.sub(r"\*DSLOAD\n.*\n", "*BOUNDARY\nUP-ZMAX, 3, 3, -0.\n", deck)
            run = Run(deck, name="deck")
            self.assertEqual(run.status, 0, run.errors)
            self.assertEqual(len(re.findall("inside (LOW|UP), where no contact pair keeps it out, "
                                            "in the mesh of the deck already", run.output)), n,
                             run.output)

    def test_edges_that_cross_without_a_node_inside(self):
        """Two ridges of one element each, across each other: supports move one into the other.

        By 0.2 of what is between them they do not touch; by 0.02 beyond it the middle of each edge
        is 0.02/sqrt(2) below the faces of the other.
        """
        # The diagonal of a unit square stands on end; the upper ridge is that turned over.
        low = [(x, y, z) for x in (0.0, 3.0) for y, z in ((-1, -1), (0, -2), (1, -1), (0, 0))]
        up = [(y + 1.5, x - 1.5, -z) for x, y, z in low]
        nodes = "".join(f"{n}, {x}, {y}, {z + 0.1 * (n > 8)}\n"
                        for n, (x, y, z) in enumerate(low + up, 1))
        deck = ("*NODE\n" + nodes + "*ELEMENT, TYPE=C3D8, ELSET=LOW\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
                "*ELEMENT, TYPE=C3D8, ELSET=UP\n2, 9, 10, 11, 12, 13, 14, 15, 16\n"
                "*ELSET, ELSET=ALL\nLOW, UP\n*NSET, NSET=BELOW, GENERATE\n1, 8\n"
                "*NSET, NSET=ABOVE, GENERATE\n9, 16\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
                "*SOLID SECTION, ELSET=ALL, MATERIAL=M\n*SURFACE, NAME=L\nLOW\n*SURFACE, NAME=U\n"
                "UP\n*SURFACE INTERACTION, NAME=DRY\n{}*BOUNDARY\nBELOW, 1, 3\nABOVE, 1, 2\n"
                "*STEP{}\n*STATIC\n1., 1.\n*BOUNDARY\nABOVE, 3, 3, -{}\n*END STEP\n")
        pair = "*CONTACT PAIR, INTERACTION=DRY\nU, L\n"
        leave = GENERAL + "*CONTACT EXCLUSIONS\nU, L\n"
        for contact, moved, status in ((GENERAL, 0.08, 0), (GENERAL, 0.12, 2), (pair, 0.08, 0),
                                       (pair, 0.12, 2), (leave, 0.12, 0), ("", 0.12, 0)):
            for large in ("", ", NLGEOM"):
                with self.subTest(contact=contact, moved=moved, large=large):
                    run = Run(deck.format(contact, large, moved), name="deck")
                    self.assertEqual(run.status, status, run.errors + run.output)
                    said = r"the edge of nodes \d+ and \d+ of (LOW|UP) is 0.0141 inside (LOW|UP), "
                    if status == 2:
                        self.assertRegex(run.errors, said + "and no node of .* feels it:")
                    elif not contact:
                        self.assertRegex(run.output, said + "where no contact pair keeps it out")
                    else:
                        self.assertNotIn(" inside ", run.errors + run.output)

    def test_a_hollow_elsewhere_excuses_nothing(self):
        """A hub shrinks into a shaft with a bore: quarters of four faces in five, as a slice.

        Where faces of the shaft's bore stand out of it by 0.0096, its outside is convex: only what
        those of the hub stand out of it, 0.0123, is no overlap.
        """
        nodes = elements = sets = ""
        for name, inner, outer, n, first in (("S", 0.5, 1.0, 4, 1), ("H", 1.0, 1.6, 5, 101)):
            rows = [range(first + i * (n + 1), first + (i + 1) * (n + 1)) for i in range(2)]
            for radius, row in zip((inner, outer), rows, strict=True):
                angles = np.linspace(0, np.pi / 2, n + 1)
                nodes += "".join(f"{node}, {radius * np.cos(a):.9f}, {radius * np.sin(a):.9f}\n"
                                 for node, a in zip(row, angles, strict=True))
            elements += f"*ELEMENT, TYPE=CPE4, ELSET={name}\n"
            elements += "".join(f"{first + k}, {a}, {b}, {b + 1}, {a + 1}\n"
                                for k, (a, b) in enumerate(zip(*rows, strict=True)) if k < n)
            sets += (f"*NSET, NSET={name}-Y\n{rows[0][0]}, {rows[1][0]}\n*NSET, NSET={name}-X\n"
                     f"{rows[0][-1]}, {rows[1][-1]}\n*NSET, NSET={name}-ALL, GENERATE\n"
                     f"{rows[0][0]}, {rows[1][-1]}\n")
        deck = ("*NODE\n" + nodes + elements + sets + "*NSET, NSET=BORE, GENERATE\n1, 5\n"
                "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*EXPANSION\n1e-4\n*ELSET, ELSET=ALL\n"
                "S, H\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n" + GENERAL + "*STEP, NLGEOM\n"
                "*STATIC\n1., 1.\n*BOUNDARY\nS-Y, 2\nH-Y, 2\nS-X, 1\nH-X, 1\nBORE, 1, 2\n"
                "*TEMPERATURE\nH-ALL, -20.\n*END STEP\n")
        run = Run(deck, name="deck")
        self.assertEqual(run.status, 2, run.output)
        self.assertRegex(run.errors, "H is 0.0149 deep into the face of nodes .* of S, but no node "
                         "of that face or of its neighbours touches it: contact is missed")

    def test_mistakes(self):
        for cards, part in (
            ("*CONTACT\n", "needs a *CONTACT INCLUSIONS"),
            ("*CONTACT INCLUSIONS, ALL EXTERIOR\n", "belongs below *CONTACT"),
            ("*CONTACT\n*CONTACT INCLUSIONS\n", "needs data lines"),
            (GENERAL + "*CONTACT EXCLUSIONS\nUP-ZMIN, NOWHERE\n", "'NOWHERE' is not defined"),
            (GENERAL + "*CONTACT PROPERTY ASSIGNMENT\n, , WET\n", "'WET' is not defined"),
            (GENERAL + "*CONTACT PROPERTY ASSIGNMENT\n, \n", "expected a surface interaction"),
            (GENERAL + "*CONTACT INITIALIZATION DATA, NAME=A, INTERFERENCE FIT\n",
             "INTERFERENCE FIT of *CONTACT INITIALIZATION DATA is not available"),
        ):
            with self.subTest(cards=cards):
                run = Run(BLOCKS.format(cards=cards, height="1.", pressure=10), "--plan",
                          name="deck")
                self.assertEqual(run.status, 1)
                self.assertEqual(run.errors.count("error:"), 1, run.errors)
                self.assertIn(part, run.errors)


if __name__ == "__main__":
    unittest.main()
