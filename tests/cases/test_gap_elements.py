"""Gap elements between bodies, and to the ground: statics, and what must hold of any."""

import unittest

from program import Run
from test_springs import SIDE, cube, loaded, springs
from two_bodies import solved

from studies.deck_cards import deck

YOUNG = 1000.0
STIFFNESS = YOUNG * SIDE  # of a cube along an axis, E A/L


def gaps(name, ends, data):
    """Return the cards of gap elements, {number: nodes}, with one line for all."""
    lines = "".join(f"{n}, {a}, {b}\n" for n, (a, b) in ends.items())
    return f"*ELEMENT, TYPE=GAPUNI, ELSET={name}\n{lines}*GAP, ELSET={name}\n{data}\n"


def in_a_row(data, swapped=False, solver=""):
    """Return two cubes in a row along z, held at their far ends, and gaps between their corners."""
    ends = {200 + n: (n, 100 + n - 4) for n in (15, 16, 17, 18)}
    if swapped:
        ends = {n: (b, a) for n, (a, b) in ends.items()}
    return deck(
        cube(), cube("B", 100, low=(0.0, 0.0, SIDE + 0.5)), gaps("G", ends, data), solver,
        loaded("A-ZMAX, 3, 50.", increments=2),
        held="A-ZMIN, 1, 3\nB-ZMAX, 1, 3",
    )


class BetweenBodies(unittest.TestCase):
    """Two cubes in a row: 200 = k u_A + N, N = k u_B, u_A - u_B = c."""

    def check(self, text, clearance, force=200.0):
        result = solved(self, text)
        self.assertEqual(len(result.pairs), 4)
        each = (force - STIFFNESS * clearance) / 8
        for pair in result.pairs.values():
            self.assertAlmostEqual(abs(pair.reaction[-1][0][0]), max(0.0, each), delta=1e-9)
            self.assertEqual(pair.coordinates.shape, (1, 3))
        u = result.field("displacement", -1)
        self.assertAlmostEqual(u[result.node(15)][2], (force - 4 * max(0.0, each)) / STIFFNESS,
                               delta=1e-12)
        return result

    def test_the_clearance_closes(self):
        """The first increment leaves it open; the plan and the result name each gap."""
        result = self.check(in_a_row("0.06, 0., 0., 1."), 0.06)
        self.assertEqual(next(iter(result.pairs)), "G-215:15")
        self.assertFalse(result.pairs[0].reaction[0].any())
        self.assertAlmostEqual(result.pairs[0].gap[0][0], 0.06 - 100 / STIFFNESS, delta=1e-12)
        self.assertIn("4 pairs, 4 points", result.output)

    def test_a_gap_that_stays_open(self):
        """Nothing acts across it."""
        self.check(in_a_row("0.2, 0., 0., 1."), 0.2)

    def test_the_direction_is_from_node_to_node(self):
        """It need not be given; given, it need not be a unit vector; nor does the order matter."""
        for data, swapped in (("0.06,", False), ("0.06, 0., 0., 7.", False), ("0.06,", True)):
            self.check(in_a_row(data, swapped), 0.06)

    def test_other_nodes_may_pass_it(self):
        """Its direction is skew, so its bodies have nodes behind a plane through a node."""
        result = solved(self, in_a_row("0.03, 1., 0., 1."))
        self.assertNotIn("without contact", result.output)

    def test_overlaps_press_at_once(self):
        """A clearance below 0 drives the bodies apart."""
        self.check(in_a_row("-0.04, 0., 0., 1."), -0.04)

    def test_all_methods(self):
        """All of the paper's methods give the same."""
        for formulation in ("BIPOTENTIAL", "PSEUDOPOTENTIAL"):
            for local in ("UZAWA", "NEWTON"):
                self.check(in_a_row("0.06, 0., 0., 1.", solver="*CONTACT SOLVER, SOLVER=SWEEPS, "
                           f"FORMULATION={formulation}, LOCAL={local}, TOLERANCE=1e-12\n")
                           .replace("*CONTACT SOLVER, TOLERANCE=1e-10\n", ""), 0.06)

    def test_finite_strain(self):
        """Without lateral strain the law of a column is known: forces are equal across the gap."""
        text = in_a_row("0.06, 0., 0., 1.").replace("*STEP\n", "*STEP, NLGEOM\n")
        for tangent in ("KEPT", "NEWTON"):
            solver = f"*BODY SOLVER, TANGENT={tangent}\n"
            result = solved(self, text.replace("*STEP", f"{solver}*STEP", 1))
            u = result.field("displacement", -1)
            up = [u[result.node(n)][2] for n in (15, 111)]
            self.assertAlmostEqual(up[0] - up[1], 0.06, delta=1e-9)
            total = sum(abs(p.reaction[-1][0][0]) for p in result.pairs.values())
            stretch = 1 - up[1] / SIDE
            stress = YOUNG * stretch * (stretch**2 - 1) / 2  # St. Venant and Kirchhoff
            self.assertAlmostEqual(total, -stress * SIDE**2, delta=1e-6)


class ToTheGround(unittest.TestCase):
    """A node of no element on one side."""

    def stopped(self, order, more=""):
        ends = {300: (900, 15)} if order == 0 else {300: (15, 900)}
        direction = "0., 0., -1." if order == 0 else "0., 0., 1."
        return deck(
            cube(), "*NODE\n900, 9., 9., 9.\n", gaps("STOP", ends, f"0.05, {direction}"), more,
            loaded("A-ZMAX, 3, 100."), held="A-ZMIN, 1, 3\n900, 1, 3",
        )

    def test_a_stop(self):
        """The corner goes as far as the clearance, whichever node is named first."""
        for order in (0, 1):
            result = solved(self, self.stopped(order))
            u = result.field("displacement", -1)
            self.assertAlmostEqual(u[result.node(15)][2], 0.05, delta=1e-12)
            self.assertGreater(result.pairs["STOP-300:900"].reaction[-1][0][0], 1.0)

    def test_what_gaps_and_springs_hold(self):
        """A cube that is pushed to a stop by its load, soft springs beside it: N = P - k c."""
        ends = {100 * dof + n: [n] for dof in (1, 2) for n in (11, 12, 13, 14, 15)}
        held = [springs("SPRING1", f"S{dof}", {k: v for k, v in ends.items() if k // 100 == dof},
                        3.0, str(dof)) for dof in (1, 2)]
        up = springs("SPRING1", "UP", {600 + n: [n] for n in (11, 12, 13, 14)}, 7.0, "3")
        stops = gaps("STOP", {700 + n: (910, n) for n in (11, 12, 13, 14)}, "0.2, 0., 0., 1.")
        result = solved(self, deck(
            cube(), "*NODE\n910, 0., 0., -5.\n", *held, up, stops,
            loaded("A-ZMIN, 3, -10."), held="910, 1, 3",
        ))
        total = sum(p.reaction[-1][0][0] for p in result.pairs.values())
        self.assertAlmostEqual(total, 40 - 4 * 7 * 0.2, delta=1e-9)

    def test_what_is_refused(self):
        """Each by one message that says where and what."""
        good = in_a_row("0.06, 0., 0., 1.")
        for text, words in (
            (good.replace("*GAP, ELSET=G\n0.06, 0., 0., 1.\n", ""), "gap element 215 has no *GAP"),
            (good.replace("0.06, 0., 0., 1.", ""), "*GAP needs a data line"),
            (good.replace("*GAP, ELSET=G", "*GAP, ELSET=A"), "elements of the type GAPUNI"),
            (good.replace("215, 15, 111", "215, 15, 15"), "element 215 names node 15 twice"),
            (good.replace("215, 15, 111", "215, 15, 999"), "names node 999, which is not defined"),
            (good.replace("215, 15, 111", "215, 801, 802").replace(
                "*ELEMENT, TYPE=GAPUNI", "*NODE\n801, 0., 0., 0.\n802, 0., 0., 1.\n"
                "*ELEMENT, TYPE=GAPUNI"), "neither node of gap element 215"),
            (good.replace("0.06, 0., 0., 1.", "0.06,").replace("15, 111", "15, 803").replace(
                "*ELEMENT, TYPE=GAPUNI", f"*NODE\n803, 0., 0., {SIDE}\n*ELEMENT, TYPE=GAPUNI"),
             "lie at one place"),
        ):
            run = Run(text, name="deck")
            self.assertEqual(run.status, 1, words)
            self.assertIn(words, run.errors)
            self.assertEqual(run.errors.count("error:"), 1, run.errors)


if __name__ == "__main__":
    unittest.main()
