"""A surface that touches itself: as its two parts with names of their own."""

import math
import unittest

import numpy as np
from program import Run

N = 6  # elements along each arm
HEIGHT = [0.0, 0.5, 0.56, 1.06]  # of the arms and the slot between them
# The corners of six tetrahedra that a cube is cut into, alike in all cubes, and the ends of the
# edges whose middles an element has, in the order of its nodes.
TETRAHEDRA = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
OF_TETRAHEDRON = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
OF_SQUARE = [(0, 1), (1, 2), (2, 3), (3, 0)]
KINDS = {"C3D8": [], "C3D10": OF_TETRAHEDRON, "CPE4": [], "CPE8": OF_SQUARE}


def clip(contact, kind="C3D8", step="*STEP"):
    """Return the deck of a C of one layer of elements, 0.06 apart, whose upper arm is pressed down.

    LOW and UP are what of the slot belongs to either arm, LOW-NODES and UP-NODES their nodes, SKIN
    all outer faces.
    """
    is_plane = kind.startswith("CPE")
    ids, elements = {}, ""

    def number(place):
        return ids.setdefault(place, len(ids) + 1)

    cells = [(i, j) for j in (0, 2) for i in range(N)] + [(0, 1)]
    n = 0
    for i, j in cells:
        corners = [(0.5 * a, HEIGHT[b], 0.5 * k)[:2 if is_plane else 3]
                   for k in range(1 if is_plane else 2)
                   for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
        parts = [corners]
        if kind == "C3D10":
            parts = [[corners[k] for k in part] for part in TETRAHEDRA]
        for part in parts:
            middles = [tuple((x + y) / 2 for x, y in zip(part[a], part[b], strict=True))
                       for a, b in KINDS[kind]]
            n += 1
            elements += f"{n}, " + ", ".join(str(number(place)) for place in part + middles) + "\n"
    nodes = "".join(f"{n}, " + ", ".join(map(str, place)) + "\n" for place, n in ids.items())

    def those(chosen):
        return "".join(f"{n}\n" for place, n in ids.items() if chosen(*place[:2]))

    held = those(lambda x, y: y == 0)
    tip = those(lambda x, y: (x, y) == (0.5 * N, HEIGHT[3]))
    every = "" if is_plane else "*BOUNDARY\nEVERY, 3, 3\n"
    return (
        f"*NODE, NSET=EVERY\n{nodes}*ELEMENT, TYPE={kind}, ELSET=B\n{elements}"
        f"*NSET, NSET=HELD\n{held}*NSET, NSET=TIP\n{tip}"
        f"*NSET, NSET=LOW\n{those(lambda x, y: x >= 0.5 and y == HEIGHT[1])}"
        f"*NSET, NSET=UP\n{those(lambda x, y: x >= 0.5 and y == HEIGHT[2])}"
        "*SURFACE, NAME=SKIN\nB\n"
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=B, MATERIAL=M\n"
        f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.2\n{contact}"
        f"{step}\n*STATIC\n0.5, 1.\n*BOUNDARY\nHELD, 1, 2\nTIP, 2, 2, -0.12\n{every}"
        "*END STEP\n"
    )


def pair(surfaces):
    """Return a contact pair."""
    return f"*CONTACT PAIR, INTERACTION=I\n{surfaces}\n"


GENERAL = "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n, , I\n"


def accordion(contact, step):
    """Return the deck of five layers, 0.2 thick and 0.1 apart, joined left and right in turn.

    LOWk and UPk are what lies below and above the gap k. The bottom is held, the top pressed down.
    """
    n, layers = 8, 5
    ids, elements = {}, ""
    rows = 3 * layers - 1
    for j in range(rows):
        for i in range(n):
            if j % 3 == 2 and i != (0 if j // 3 % 2 else n - 1):
                continue
            corners = [ids.setdefault((a, b), len(ids) + 1)
                       for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
            elements += f"{len(elements.splitlines()) + 1}, {', '.join(map(str, corners))}\n"
    nodes = "".join(f"{k}, {0.5 * i}, {0.1 * j}\n" for (i, j), k in ids.items())
    sets = ""
    for gap in range(layers - 1):
        for name, row in (("LOW", 3 * gap + 2), ("UP", 3 * gap + 3)):
            sets += f"*NSET, NSET={name}{gap}\n" + "".join(
                f"{k}\n" for (i, j), k in ids.items()
                if j == row and i != (0 if gap % 2 else n))
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE=CPE4, ELSET=W\n{elements}{sets}"
        "*NSET, NSET=BOTTOM\n" + "".join(f"{k}\n" for (_, j), k in ids.items() if j == 0)
        + "*NSET, NSET=TOP\n" + "".join(f"{k}\n" for (_, j), k in ids.items() if j == rows)
        + "*MATERIAL, NAME=M\n*HYPERELASTIC, NEO HOOKE\n192.3, 0.0024\n"
        "*SOLID SECTION, ELSET=W, MATERIAL=M\n*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.1\n"
        f"{contact}*BOUNDARY\nBOTTOM, 1, 2\nTOP, 1, 1\n{step}\n*STATIC\n0.2, 1.\n*BOUNDARY\n"
        "TOP, 2, 2, -0.3\n*END STEP\n"
    )


BEFORE_PLATES = "OUTT, PLATE\nOUTB, FLOOR"


def ring(contact, step="*STEP", whole=True):
    """Return the deck of a ring, or its right half, squeezed flat between two plates.

    Of plane strain, inner radius 1, wall 0.1. IN is its inner surface, INT and INB the upper and
    the lower half of it, OUTT and OUTB those of the outer one, before which the plates are.
    """
    n = 32 if whole else 16
    begin, turn = (0, 2 * math.pi) if whole else (-math.pi / 2, math.pi)
    ids, elements = {}, ""
    surfaces = dict.fromkeys(("INT", "INB", "OUTT", "OUTB", "IN"), "")
    for k in range(n):
        half = "T" if math.sin(begin + (k + 0.5) * turn / n) > 0 else "B"
        for i in range(2):
            corners = [ids.setdefault((a, b % n if whole else b), len(ids) + 1)
                       for a, b in ((i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1))]
            e = 2 * k + i + 1
            elements += f"{e}, {', '.join(map(str, corners))}\n"
            surfaces[("IN", "OUT")[i] + half] += f"{e}, {('S4', 'S2')[i]}\n"
            if i == 0:
                surfaces["IN"] += f"{e}, S4\n"
    x = {m: [(1 + 0.05 * a) * of(begin + b * turn / n) for of in (math.cos, math.sin)]
         for (a, b), m in ids.items()}
    nodes = "".join(f"{m}, {place[0]:.12f}, {place[1]:.12f}\n" for m, place in x.items())
    held = ["".join(f"{m}, {k + 1}, {k + 1}\n" for m, place in x.items() if abs(place[k]) < 1e-9)
            for k in range(2)]
    material = "*HYPERELASTIC, NEO HOOKE\n192.3, 0.0024\n"
    if "NLGEOM" not in step:
        material = "*ELASTIC\n1000., 0.3\n"
    return (
        f"*NODE\n{nodes}1001, 0., 2.\n1002, 0., -2.\n*ELEMENT, TYPE=CPE4, ELSET=B\n{elements}"
        + "".join(f"*SURFACE, NAME={name}\n{lines}" for name, lines in surfaces.items())
        + f"*MATERIAL, NAME=M\n{material}*SOLID SECTION, ELSET=B, MATERIAL=M\n"
        "*OBSTACLE, NAME=PLATE, TYPE=PLANE, REF NODE=1001\n0., 1.1, 0., 0., -1., 0.\n"
        "*OBSTACLE, NAME=FLOOR, TYPE=PLANE, REF NODE=1002\n0., -1.1, 0., 0., 1., 0.\n"
        f"*SURFACE INTERACTION, NAME=I\n{contact}{step}\n*STATIC\n0.1, 1.\n"
        f"*BOUNDARY\n{held[0]}{held[1]}"
        "1001, 2, 2, -1.02\n1002, 2, 2, 1.02\n*END STEP\n"
    )


class Self(unittest.TestCase):
    def solve(self, deck, *options, **how):
        run = Run(deck, *options, name="deck", **how)
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result, run

    def test_is_its_parts_by_name(self):
        """To 1e-8, at small and finite strain, as a pair with itself and by general contact."""
        for kind in KINDS:
            for step in ("*STEP", "*STEP, NLGEOM"):
                named, _ = self.solve(clip(pair("LOW, UP"), kind, step))
                force = np.abs(named.pairs["LOW:UP"].normal_force[-1])
                self.assertGreater(force.max(), 0.1)
                for contact, name in (
                    (pair("SKIN, SKIN"), "SKIN:SKIN"),
                    (GENERAL, "B:B"),
                ):
                    with self.subTest(kind=kind, step=step, contact=name):
                        itself, _ = self.solve(clip(contact, kind, step))
                        self.assertEqual(list(itself.pairs), [name])
                        u, v = (of.field("displacement") for of in (itself, named))
                        self.assertLess(abs(u - v).max(), 1e-8 * abs(v).max())

    def test_walls_between_gaps(self):
        """Both sides of a wall have one side, and its back is no overlap, however far all moves."""
        roles = "LOW0, UP0\nUP1, LOW1\nLOW2, UP2\nUP3, LOW3\n"
        named, _ = self.solve(accordion(pair(roles.rstrip()), "*STEP, NLGEOM"))
        itself, run = self.solve(accordion(GENERAL, "*STEP, NLGEOM"))
        self.assertNotIn("removes the overlap", run.output)
        forces = sum(of.normal_sum[-1] for of in named.pairs.values())
        self.assertGreater(forces, 10)
        self.assertAlmostEqual(itself.pairs["W:W"].normal_sum[-1], forces, delta=1e-6 * forces)
        u, v = (of.field("displacement") for of in (itself, named))
        self.assertLess(abs(u - v).max(), 1e-6 * abs(v).max())

    def test_ring_squeezed_flat(self):
        """As its halves by name, though the sides that it has in the mesh are not these."""
        for step in ("*STEP", "*STEP, NLGEOM"):
            with self.subTest(step=step):
                plates = pair(BEFORE_PLATES)
                named, _ = self.solve(ring(plates + pair("INT, INB"), step))
                itself, _ = self.solve(ring(plates + GENERAL, step))
                forces = [of.normal_sum[-1] for of in (named.pairs["INT:INB"], itself.pairs["B:B"])]
                self.assertGreater(forces[0], 500)
                self.assertAlmostEqual(forces[1], forces[0], delta=1e-8 * forces[0])
                u, v = (of.field("displacement") for of in (itself, named))
                self.assertLess(abs(u - v).max(), 1e-8 * abs(v).max())

    def test_half_a_ring_sees_itself_late(self):
        """No face sees another in the mesh. A run that is continued has the sides of the other.

        Before the plates general contact finds faces that turn towards them, too; pressures are
        those of a round surface as a whole.
        """
        plates = pair(BEFORE_PLATES)
        named, _ = self.solve(ring(plates + pair("INT, INB"), "*STEP, NLGEOM", whole=False))
        deck = ring(plates + pair("IN"), "*STEP, NLGEOM", whole=False)
        itself, _ = self.solve(deck)
        again, _ = self.solve(deck, "--continue", ended_at=("1", "6"))
        u, v, w = (of.field("displacement") for of in (itself, named, again))
        self.assertGreater(itself.pairs["IN:IN"].normal_sum[-1], 250)
        self.assertLess(abs(u - v).max(), 1e-8 * abs(v).max())
        self.assertTrue((u == w).all())
        general, _ = self.solve(ring(GENERAL, "*STEP, NLGEOM", whole=False))
        self.assertLess(abs(general.field("displacement") - v).max(), 1e-7 * abs(v).max())
        for name in ("normal_sum", "largest_pressure"):
            one, other = (getattr(pairs, name)[-1] for pairs in (general.pairs["B:PLATE"],
                                                                 named.pairs["OUTT:PLATE"]))
            self.assertAlmostEqual(one, other, delta=1e-6 * other)

    def test_what_folds_through_itself_is_not_certified(self):
        """Sides are those of an increment's beginning: what meets later takes smaller increments.

        At small strain half a ring by general contact has the force of its halves by hand.
        """
        for whole in (False, True):
            deck = ring(pair(BEFORE_PLATES) + pair("IN"), "*STEP, NLGEOM", whole)
            run = Run(deck.replace("*STATIC\n0.1, 1.", "*STATIC, DIRECT\n1., 1."), name="deck")
            self.assertEqual(run.status, 2, run.output)
            self.assertRegex(run.errors, r"^step 1, increment 1: IN gets 0\.[12]\d* deep .*contact "
                                         r"is missed; use smaller increments")
        at_once = "*STATIC\n1., 1."
        force = []
        for contact in (pair(BEFORE_PLATES) + GENERAL, pair(BEFORE_PLATES + "\nINT, INB")):
            deck = ring(contact, whole=False).replace("*STATIC\n0.1, 1.", at_once)
            run = Run(deck, name="deck")
            self.assertEqual(run.status, 0, run.errors)
            force.append([p.normal_sum[-1] for p in run.result().pairs.values()][-1])
        self.assertAlmostEqual(force[0] / force[1], 1, delta=1e-7)

    def test_what_may_go_through_itself(self):
        """What the deck excludes from itself, or removes, is none that contact has missed."""
        through = "TIP, 2, 2, -0.12", "TIP, 2, 2, -2.5"
        removed = "*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\nSKIN, SKIN\n*STATIC, DIRECT\n1., 1."
        once = "*STATIC, DIRECT\n1., 1."
        for contact, step, status in ((GENERAL + "*CONTACT EXCLUSIONS\nSKIN, SKIN\n", once, 0),
                                      (pair("SKIN, SKIN"), removed, 0),
                                      (pair("SKIN, SKIN"), once, 2)):
            deck = clip(contact).replace("*STATIC\n0.5, 1.", step).replace(*through)
            run = Run(deck, name="deck")
            self.assertEqual(run.status, status, run.errors + run.output)

    def test_one_name_is_the_surface_with_itself(self):
        itself, _ = self.solve(clip(pair("SKIN")))
        self.assertEqual(list(itself.pairs), ["SKIN:SKIN"])

    def test_what_excludes_a_body_from_itself(self):
        """Nothing presses then, and the edges that get into the body are no mistake."""
        for lines in ("SKIN, SKIN\n", "SKIN\n"):
            result, run = self.solve(clip(GENERAL + "*CONTACT EXCLUSIONS\n" + lines))
            self.assertEqual(list(result.pairs), [])
            self.assertNotIn("inside its own body", run.output)

    def test_a_pair_by_hand_wins_for_its_faces(self):
        result, _ = self.solve(clip(GENERAL + pair("UP, LOW")))
        self.assertEqual(list(result.pairs), ["UP:LOW"])

    def test_what_does_not_see_itself_is_a_mistake(self):
        """By name; general contact makes no such pair."""
        run = Run(clip(pair("LOW, LOW")), "--check", name="deck")
        self.assertEqual(run.status, 1)
        self.assertIn("no two faces of 'LOW' are turned towards each other", run.errors)

    def test_what_may_fold(self):
        """At finite strain a surface that is flat may come to touch itself: a note."""
        run = Run(clip(pair("LOW, LOW"), step="*STEP, NLGEOM"), "--plan", name="deck")
        self.assertEqual(run.status, 0)
        self.assertIn("contact of LOW with itself: no two faces are turned towards", run.output)


if __name__ == "__main__":
    unittest.main()
