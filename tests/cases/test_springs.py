"""Springs between bodies and as their supports: closed forms, and what must hold of any."""

import re
import unittest

import numpy as np
from program import Run
from two_bodies import solved

from studies.deck_cards import block, deck, pair

SIDE = 2.0
# A body of one element, whose eight corners are far apart from those of another.
CORNERS = {
    11: (0, 0, 0), 12: (1, 0, 0), 13: (1, 1, 0), 14: (0, 1, 0),
    15: (0, 0, 1), 16: (1, 0, 1), 17: (1, 1, 1), 18: (0, 1, 1),
}


def cube(name="A", first=0, low=(0.0, 0.0, 0.0), young=1000.0, side=SIDE, nu=0.0):
    """Return the cards of a cube of one element, nodes 11 to 18 behind `first`."""
    places = {
        first + n: [a + side * b for a, b in zip(low, p, strict=True)] for n, p in CORNERS.items()
    }
    nodes = "".join(f"{n}, " + ", ".join(map(repr, p)) + "\n" for n, p in places.items())
    return (
        f"*NODE\n{nodes}*NSET, NSET={name}-ZMIN, GENERATE\n{first + 11}, {first + 14}\n"
        f"*NSET, NSET={name}-ZMAX, GENERATE\n{first + 15}, {first + 18}\n"
        f"*ELEMENT, TYPE=C3D8, ELSET={name}\n{first + 1}, "
        + ", ".join(str(n) for n in places)
        + f"\n*MATERIAL, NAME=OF-{name}\n*ELASTIC\n{young!r}, {nu!r}\n"
        f"*SOLID SECTION, ELSET={name}, MATERIAL=OF-{name}\n"
    )


def springs(kind, name, ends, stiffness, dofs=""):
    """Return the cards of springs, {number: nodes}, all of one stiffness."""
    lines = "".join(f"{n}, " + ", ".join(map(str, of)) + "\n" for n, of in ends.items())
    return (
        f"*ELEMENT, TYPE={kind}, ELSET={name}\n{lines}*SPRING, ELSET={name}\n{dofs}\n"
        f"{stiffness!r}\n"
    )


def loaded(*lines, more="", increments=1, nlgeom=""):
    """Return a *STEP with concentrated forces."""
    text = "\n".join(lines)
    return (
        f"*STEP{nlgeom}\n*STATIC, DIRECT\n{1 / increments!r}, 1.\n*CLOAD\n{text}\n{more}*END STEP\n"
    )


def energy_balances(case, result):
    """Check the energy, and that of the springs in it."""
    strain = result.history("energy/strain")[-1]
    case.assertLess(abs(result.history("energy/balance")[-1]), 1e-9 * strain)
    stored = 0.5 * np.sum(result.springs.force[-1] * result.springs.elongation[-1])
    case.assertGreater(stored, 0)
    case.assertLess(stored, strain * (1 + 1e-12))


class OnlySupport(unittest.TestCase):
    """A body that springs alone hold."""

    def test_a_pressed_block_on_springs(self):
        """Along x and y by one spring a node, along z by four: springs and column in a row."""
        ends = {100 * dof + n: [n] for dof in (1, 2, 3) for n in (11, 12, 13, 14)}
        stiffness = {1: 3.0, 2: 5.0, 3: 7.0}
        cards = [
            springs("SPRING1", f"S{dof}", {k: v for k, v in ends.items() if k // 100 == dof},
                    stiffness[dof], str(dof))
            for dof in (1, 2, 3)
        ]
        result = solved(self, deck(cube(), *cards, loaded("A-ZMAX, 3, -1.5")))
        top = result.field("displacement", -1)[result.node(15)]
        self.assertAlmostEqual(top[2], -1.5 / 7 - 6 / (1000 * SIDE**2) * SIDE, delta=1e-12)
        force = dict(zip(result.springs.element_ids, result.springs.force[-1], strict=True))
        for number, of in force.items():
            # What SPRING1 resists with is positive where its node moves along the axis.
            self.assertAlmostEqual(of, -1.5 if number // 100 == 3 else 0.0, delta=1e-11)
        np.testing.assert_allclose(result.springs.elongation[-1] * 7, np.array(
            [of if n // 100 == 3 else 0 for n, of in force.items()]), atol=1e-11)
        energy_balances(self, result)
        self.assertRegex(result.run_text("plan"), r"equations +fixed +24,")

    def test_six_struts(self):
        """Statics alone says what six springs carry, whatever body and springs are."""
        places = {901: (-3, 0.4, -2), 902: (2, -3, -1), 903: (5, 3, -2), 904: (3, 4, 5),
                  905: (-1, -2, 4), 906: (-2, 3, 1)}
        ends = {31: (901, 11), 32: (12, 902), 33: (903, 13), 34: (17, 904), 35: (905, 15),
                36: (906, 18)}
        ground = "*NODE, NSET=GROUND\n" + "".join(
            f"{n}, " + ", ".join(map(repr, map(float, p))) + "\n" for n, p in places.items())
        load = np.array([3.0, -4.0, 5.0])
        lines = [f"16, {i + 1}, {load[i]!r}" for i in range(3)]
        for side, young, stiffness in ((SIDE, 1000.0, 20.0), (SIDE, 1e6, 0.01)):
            result = solved(self, deck(
                ground, cube(young=young, side=side, nu=0.3),
                springs("SPRINGA", "STRUTS", ends, stiffness), loaded(*lines), held="GROUND, 1, 3",
            ))
            where = {n: side * np.array(p) for n, p in CORNERS.items()}
            where.update({n: np.array(p) for n, p in places.items()})
            columns = []
            for of in ends.values():
                body, wall = (of if of[0] < 900 else of[::-1])
                along = (where[wall] - where[body]) / np.linalg.norm(where[wall] - where[body])
                columns.append([*along, *np.cross(where[body], along)])
            wanted = np.linalg.solve(np.transpose(columns), -np.array(
                [*load, *np.cross(where[16], load)]))
            scale = np.abs(wanted).max()
            np.testing.assert_allclose(result.springs.force[-1], wanted, atol=1e-8 * scale)
            np.testing.assert_allclose(
                result.springs.elongation[-1], wanted / stiffness, atol=1e-8 * scale / stiffness)
            # The ground carries all.
            total = sum(of.reaction_force[-1] for of in result.reference_nodes)
            np.testing.assert_allclose(total, -load, atol=1e-9)
            energy_balances(self, result)

    def test_a_motion_that_no_spring_sees_is_free(self):
        """Springs along z leave a body free along x: a load there has no equilibrium."""
        text = deck(
            cube(), springs("SPRING1", "S", {k: [k] for k in (11, 12, 13, 14)}, 3.0, "3"),
            loaded("A-ZMAX, 1, 1."),
        )
        run = Run(text, name="deck")
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, "translation along x")


class BetweenBodies(unittest.TestCase):
    """Springs from body to body."""

    def test_springs_in_a_row(self):
        """Two bodies joined along each axis by four springs: what all of them give way adds up."""
        cards = ""
        for dof, stiffness in ((1, 2.0), (2, 4.0), (3, 8.0)):
            ends = {10 * dof + 1000 * dof + k: (15 + k, 111 + k) for k in range(4)}
            cards += springs("SPRING2", f"S{dof}", ends, stiffness, f"{dof}, {dof}")
        text = deck(
            cube("LOW"), cube("UP", 100, (0.0, 0.0, 3.0)), cards,
            loaded("UP-ZMAX, 3, -1.5"), held="LOW-ZMIN, 1, 3",
        )
        result = solved(self, text)
        top = result.field("displacement", -1)[result.node(117)]
        wanted = -1.5 / 8 - 2 * 6 / (1000 * SIDE**2) * SIDE
        self.assertAlmostEqual(top[2], wanted, delta=1e-11)
        np.testing.assert_allclose(top[:2], 0, atol=1e-11)
        z = result.springs.element_ids >= 3000
        # q = u_1 - u_2: the upper body comes nearer.
        np.testing.assert_allclose(result.springs.force[-1][z], 1.5, atol=1e-10)
        np.testing.assert_allclose(result.springs.force[-1][~z], 0, atol=1e-10)
        energy_balances(self, result)
        # A SPRINGA along the same line says the same, of its length.
        axial = text.replace("*ELEMENT, TYPE=SPRING2, ELSET=S3", "*ELEMENT, TYPE=SPRINGA, ELSET=S3")
        axial = axial.replace("ELSET=S3\n3, 3\n", "ELSET=S3\n\n")
        other = solved(self, axial)
        np.testing.assert_allclose(
            other.field("displacement", -1), result.field("displacement", -1), atol=1e-12)
        np.testing.assert_allclose(other.springs.force[-1][z], -1.5, atol=1e-10)

    def test_two_dofs_of_a_lever(self):
        """SPRING2 may join unlike dofs: what goes down on one side comes out on the other."""
        text = deck(
            cube("LOW"), cube("UP", 100, (5.0, 0.0, 0.0)),
            springs("SPRING2", "S", {500: (16, 115)}, 8.0, "1, 3"),
            loaded("16, 1, 2."), held="LOW-ZMIN, 1, 3\nUP-ZMIN, 1, 3",
        )
        result = solved(self, text)
        u = result.field("displacement", -1)
        q = u[result.node(16), 0] - u[result.node(115), 2]
        self.assertAlmostEqual(result.springs.elongation[-1][0], q, delta=1e-14)
        self.assertAlmostEqual(result.springs.force[-1][0], 8 * q, delta=1e-12)
        reaction = result.field("reaction_force", -1)
        low = [result.node(n) for n in (11, 12, 13, 14)]
        up = [result.node(n) for n in (111, 112, 113, 114)]
        self.assertAlmostEqual(reaction[low, 0].sum(), 8 * q - 2, delta=1e-11)
        self.assertAlmostEqual(reaction[up, 2].sum(), -8 * q, delta=1e-11)
        energy_balances(self, result)


SHOE = (
    block("SHOE", (4, 2, 2), (0, 0, 2), (40, 20, 20), 20000.0)
    + "*NODE, NSET=WALL\n9001, 60., 10., 12.\n"
    + springs("SPRINGA", "SPR", {9001: (23, 9001)}, 2.0)
    + "*OBSTACLE, NAME=PLANE, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
)
PRESSED = (
    "*STEP\n*STATIC\n*DSLOAD\nSHOE-ZMAX, P, 1.\nSHOE-XMIN, P, 0.6\n"
    "*EL PRINT, ELSET=SPR\nS, E\n*END STEP\n"
)


class WithFriction(unittest.TestCase):
    """A shoe that slides until a spring takes what friction does not."""

    def shoe(self, *options):
        text = deck(SHOE, pair("SHOE-ZMIN, PLANE", 0.2), PRESSED, held="WALL, 1, 3")
        return solved(self, text, *options)

    def check(self, result):
        total = result.pairs["SHOE-ZMIN:PLANE"].resultant[-1]
        np.testing.assert_allclose(total, [-160, 0, 800], atol=1e-6)
        self.assertAlmostEqual(result.springs.force[-1][0], -80, delta=1e-6)
        self.assertAlmostEqual(result.springs.elongation[-1][0], -40, delta=1e-6)

    def test_statics(self):
        result = self.shoe()
        self.check(result)
        wall = result.reference_nodes[9001].reaction_force[-1]
        np.testing.assert_allclose(wall, [-80, 0, 0], atol=1e-6)
        energy = {
            name: result.history(f"energy/{name}")[-1]
            for name in ("external_work", "strain", "dissipation", "balance")
        }
        self.assertAlmostEqual(energy["dissipation"] / (160 * 40), 1, delta=1e-3)
        self.assertGreater(energy["strain"], 0.5 * 80 * 40)
        self.assertLess(energy["strain"], 0.5 * 80 * 40 * 1.001)

    def test_refined(self):
        """Each element cut in eight: the spring stays at its node."""
        self.check(self.shoe("--refine", "1"))

    def test_printed(self):
        """*EL PRINT: S of a spring is its force, E its elongation."""
        text = deck(SHOE, pair("SHOE-ZMIN, PLANE", 0.2), PRESSED, held="WALL, 1, 3")
        run = Run(text, name="deck")
        head, line = (run.folder / "deck.element.csv").read_text().splitlines()
        self.assertEqual(
            head, "step,increment,time [time],set,element,point,spring force [force],"
            "elongation [length]")
        self.assertTrue(line.startswith('1,1,1.'), line)
        self.assertIn(',"SPR",9001,,', line)
        force, elongation = map(float, line.split(",")[-2:])
        self.assertAlmostEqual(force, -80, delta=1e-6)
        self.assertAlmostEqual(elongation, -40, delta=1e-6)

    def test_units(self):
        """The same deck in m: stiffness in N/m, stress in Pa."""
        metres = deck(
            block("SHOE", (4, 2, 2), (0, 0, 0.002), (0.04, 0.02, 0.02), 20000.0e6)
            + "*NODE, NSET=WALL\n9001, 0.06, 0.01, 0.012\n"
            + springs("SPRINGA", "SPR", {9001: (23, 9001)}, 2000.0)
            + "*OBSTACLE, NAME=PLANE, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n",
            pair("SHOE-ZMIN, PLANE", 0.2),
            PRESSED.replace(", 1.\n", ", 1.e6\n").replace(", 0.6", ", 0.6e6"), held="WALL, 1, 3",
        )
        found, wanted = solved(self, metres), self.shoe()
        np.testing.assert_allclose(
            1000 * found.field("displacement", -1), wanted.field("displacement", -1), atol=1e-7)
        np.testing.assert_allclose(found.springs.force, wanted.springs.force, rtol=1e-9)
        np.testing.assert_allclose(1000 * found.springs.elongation, wanted.springs.elongation,
                                   rtol=1e-9)


class Refused(unittest.TestCase):
    """Decks whose springs cannot be what is meant."""

    def errors(self, *cards, held="A-ZMIN, 1, 3"):
        run = Run(deck(cube(), *cards, loaded("15, 1, 1."), held=held), name="deck")
        self.assertEqual(run.status, 1, run.output)
        return re.sub(r"\s+", " ", run.errors)

    def test_without_a_law(self):
        self.assertIn("spring element 7 has no *SPRING", self.errors(
            "*ELEMENT, TYPE=SPRING1, ELSET=S\n7, 15\n"))

    def test_without_stiffness(self):
        self.assertIn("*SPRING needs a line with the stiffness", self.errors(
            "*ELEMENT, TYPE=SPRING1, ELSET=S\n7, 15\n*SPRING, ELSET=S\n1\n"))

    def test_a_stiffness_that_pushes(self):
        for wrong in (0.0, -3.0):
            self.assertIn("stiffness of a spring must be positive", self.errors(
                springs("SPRING1", "S", {7: [15]}, wrong, "1")))

    def test_rotations_of_nodes_without_any(self):
        self.assertIn("node 15 of spring element 7 has no rotations", self.errors(
            springs("SPRING1", "S", {7: [15]}, 3.0, "4")))

    def test_the_other_number_of_nodes(self):
        self.assertIn("spring element 7 has 1 nodes, not 2", self.errors(
            springs("SPRING2", "S", {7: [15]}, 3.0, "1, 1")))

    def test_no_length(self):
        self.assertIn("lie at one place", self.errors(
            "*NODE\n900, 0., 0., 2.\n", springs("SPRINGA", "S", {7: (15, 900)}, 3.0)))

    def test_nodes_that_are_nowhere(self):
        self.assertIn("names node 900, which is not defined", self.errors(
            springs("SPRING2", "S", {7: (15, 900)}, 3.0, "1, 1")))

    def test_a_spring_far_from_all(self):
        self.assertIn("joins nodes that belong to no element", self.errors(
            "*NODE\n900, 0., 0., 9.\n901, 1., 0., 9.\n",
            springs("SPRINGA", "S", {7: (900, 901)}, 3.0)))

    def test_two_laws(self):
        self.assertIn("element 7 has a *SPRING already", self.errors(
            springs("SPRING1", "S", {7: [15]}, 3.0, "1"), "*SPRING, ELSET=S\n1\n4.\n"))

    def test_sets_of_others(self):
        self.assertIn("of a *SPRING must consist of", self.errors(
            springs("SPRING1", "S", {7: [15]}, 3.0, "1"), "*SPRING, ELSET=A\n1\n4.\n"))


if __name__ == "__main__":
    unittest.main()
