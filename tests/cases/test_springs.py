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


class Foundations(unittest.TestCase):
    """Faces that resist along their normals."""

    def block(self, kind, *options, stiffness=25.0, step="A-ZMAX, P, 3."):
        """A block on a foundation, free across it but for two of its sides."""
        text = deck(
            block("A", (3, 2, 4), (0, 0, 0), (3, 2, 4)).replace("NZ=4", f"NZ=4, TYPE={kind}"),
            f"*FOUNDATION\nFEET, F1, {stiffness!r}\n",
            "*ELSET, ELSET=FEET, GENERATE\n1, 6\n",
            f"*STEP\n*STATIC\n1., 1.\n*DSLOAD\n{step}\n*EL FILE\nS\n*END STEP\n",
            held="A-XMIN, 1\nA-YMIN, 2",
        )
        return solved(self, text, *options)

    def test_a_pressed_block(self):
        """Uniform stress p, settlement p/k."""
        for kind in ("C3D8", "C3D8I"):
            result = self.block(kind)
            u, x = result.field("displacement", -1), result.points
            wanted = np.column_stack([0.3 * 3e-3 * x[:, 0], 0.3 * 3e-3 * x[:, 1],
                                      -3 / 25 - 3e-3 * x[:, 2]])
            np.testing.assert_allclose(u, wanted, atol=1e-11)
            self.assertEqual(len(result.springs), 0)
            stored = 0.5 * 3 * 3 / 25 * 6 + 0.5 * 3 * 3 / 1000 * 24
            self.assertAlmostEqual(result.history("energy/strain")[-1], stored, delta=1e-9)

    def test_second_order(self):
        """An element of 20 nodes whose lower corners do not make a rectangle."""
        corners = [np.array(p, float) for p in (
            (0, 0, 0), (2, 0.2, 0), (2.3, 1.9, 0), (-0.2, 1.7, 0),
            (0, 0, 3), (2, 0.2, 3), (2.3, 1.9, 3), (-0.2, 1.7, 3))]
        edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
                 (0, 4), (1, 5), (2, 6), (3, 7)]
        places = corners + [(corners[a] + corners[b]) / 2 for a, b in edges]
        lines = "".join(f"{n}, {p[0]!r}, {p[1]!r}, {p[2]!r}\n" for n, p in enumerate(places, 1))
        text = deck(
            f"*NODE\n{lines}*ELEMENT, TYPE=C3D20, ELSET=A\n1, "
            + ", ".join(map(str, range(1, 16))) + ",\n16, 17, 18, 19, 20\n",
            "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=A, MATERIAL=M\n",
            "*FOUNDATION\nA, F1, 25.\n",
            "*STEP\n*STATIC\n1., 1.\n*DLOAD\nA, P2, 3.\n*END STEP\n",
            held="1, 1, 2\n2, 2",
        )
        result = solved(self, text)
        u, x = result.field("displacement", -1), result.points
        np.testing.assert_allclose(u[:, 2], -3 / 25 - 3e-3 * x[:, 2], atol=1e-11)

    def test_refined(self):
        result = self.block("C3D8", "--refine", "1")
        u, x = result.field("displacement", -1), result.points
        np.testing.assert_allclose(u[:, 2], -3 / 25 - 3e-3 * x[:, 2], atol=1e-11)

    def test_a_moment_tilts_a_stiff_block(self):
        """A rigid plate on a foundation: turn = M / (k I)."""
        text = deck(
            block("A", (4, 4, 1), (0, 0, 0), (2, 2, 1), 1e7),
            "*ELSET, ELSET=FEET, GENERATE\n1, 16\n*FOUNDATION\nFEET, F1, 25.\n",
            loaded("A-XMIN, 3, 1.", "A-XMAX, 3, -1."), held="1, 1, 2\n5, 2",
        )
        result = solved(self, text)
        u, x = result.field("displacement", -1), result.points
        # 10 nodes a side, 1 from the middle; I = 2 2^3/12.
        turn = 20 * 1 / (25 * 16 / 12)
        np.testing.assert_allclose(u[:, 2], -turn * (x[:, 0] - 1), atol=1e-4)


class LargeTurns(unittest.TestCase):
    """NLGEOM: a SPRINGA acts along the line between its nodes as they move."""

    def test_a_truss(self):
        """A body that is led along z, and a spring that turns as it lengthens."""
        wall, stiffness, way = np.array([-3.0, 0.0, -1.0]), 20.0, 1.5
        start = np.array([0.0, 0.0, SIDE])
        line = start - wall + np.array([0, 0, way])
        pull = stiffness * (np.linalg.norm(line) - np.linalg.norm(start - wall))
        force = pull * line[2] / np.linalg.norm(line)
        result = solved(self, deck(
            f"*NODE, NSET=WALL\n900, {wall[0]!r}, {wall[1]!r}, {wall[2]!r}\n", cube(nu=0.3),
            springs("SPRINGA", "S", {31: (900, 15)}, stiffness),
            loaded(f"15, 3, {force!r}", increments=4, nlgeom=", NLGEOM"),
            held="WALL, 1, 3\nA-ZMIN, 1, 2\nA-ZMAX, 1, 2",
        ))
        u = result.field("displacement", -1)[[result.node(n) for n in CORNERS]]
        np.testing.assert_allclose(u, len(u) * [[0, 0, way]], atol=1e-7)
        self.assertAlmostEqual(result.springs.force[-1][0], pull, delta=1e-6)
        wanted = -pull * line / np.linalg.norm(line)
        np.testing.assert_allclose(
            result.reference_nodes[900].reaction_force[-1], wanted, atol=1e-6)
        stored = 0.5 * pull**2 / stiffness
        self.assertAlmostEqual(result.history("energy/strain")[-1], stored, delta=1e-6)

    def test_what_turns_as_a_whole_has_no_force(self):
        """A body that its supports turn by 60 degrees, and the other end with it."""
        angle = np.pi / 3
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0],
                         [0, 0, 1]])
        places = {n: SIDE * np.array(p, float) for n, p in CORNERS.items()}
        places[900] = np.array([5.0, 4.0, 3.0])
        lines = "\n".join(
            f"{n}, {i + 1}, {i + 1}, {(turn @ p - p)[i]!r}"
            for n, p in places.items() for i in range(3)
        )
        text = deck(
            "*NODE\n900, 5., 4., 3.\n", cube(nu=0.3),
            springs("SPRINGA", "S", {31: (900, 17)}, 20.0),
            f"*STEP, NLGEOM\n*STATIC\n1., 1.\n*BOUNDARY\n{lines}\n*END STEP\n",
        )
        result = solved(self, text)
        self.assertLess(abs(result.springs.force[-1][0]), 1e-10)
        # Nothing is left to find.
        together = solved(self, text.replace("*STEP", "*BODY SOLVER, TANGENT=NEWTON\n*STEP"))
        self.assertLess(abs(together.springs.force[-1][0]), 1e-10)
        small = solved(self, text, "--nlgeom", "no")
        self.assertGreater(abs(small.springs.force[-1][0]), 10)

    def test_a_body_that_hangs(self):
        """Statics of the deformed lines: a body that hangs on four springs."""
        walls = {901: (-3.0, -3.0, 6.0), 902: (5.0, -3.5, 6.0), 903: (5.5, 5.0, 6.0),
                 904: (-3.0, 4.5, 6.0)}
        nodes = "".join(f"{n}, " + ", ".join(map(repr, p)) + "\n" for n, p in walls.items())
        ends = {n - 870: (n, n - 886) for n in walls}
        load = np.array([3.0, -2.0, -60.0])
        lines = [f"{n}, {i + 1}, {load[i] / 4!r}" for n in (11, 12, 13, 14) for i in range(3)]
        result = solved(self, deck(
            f"*NODE, NSET=WALL\n{nodes}", cube(nu=0.3, young=1e4),
            springs("SPRINGA", "S", ends, 20.0),
            springs("SPRING1", "FEET", {40 + n: (n,) for n in (11, 12, 13, 14)}, 5.0, "1"),
            springs("SPRING1", "SIDES", {60 + n: (n,) for n in (11, 12, 13, 14)}, 5.0, "2"),
            loaded(*lines, increments=4, nlgeom=", NLGEOM"), held="WALL, 1, 3",
        ))
        u = result.field("displacement", -1)
        total = np.array(load)
        for number, of in ends.items():
            there = np.array(walls[of[0]])
            here = SIDE * np.array(CORNERS[of[1]], float)
            moved = here + u[result.node(of[1])]
            longer = np.linalg.norm(moved - there) - np.linalg.norm(here - there)
            row = result.springs.row(number)
            self.assertAlmostEqual(result.springs.elongation[-1][row], longer, delta=1e-12)
            self.assertAlmostEqual(result.springs.force[-1][row], 20 * longer, delta=1e-10)
            total -= 20 * longer * (moved - there) / np.linalg.norm(moved - there)
        for n in (11, 12, 13, 14):
            total[:2] -= 5 * u[result.node(n), :2]
        np.testing.assert_allclose(total, 0, atol=1e-6)
        self.assertLess(u[result.node(11), 2], -0.5)

    def test_friction(self):
        """The shoe of small strain, whose strains are small."""
        text = deck(SHOE.replace("9001, 60.", "9001, 100."), pair("SHOE-ZMIN, PLANE", 0.2), PRESSED,
                    held="WALL, 1, 3")
        result = solved(self, text, "--nlgeom", "yes")
        here = np.array([20.0, 10.0, 12.0]) + result.field("displacement", -1)[result.node(23)]
        line = here - [100, 10, 12]
        pull = 2 * (np.linalg.norm(line) - 80)
        self.assertAlmostEqual(result.springs.force[-1][0], pull, delta=1e-9)
        along = pull * line / np.linalg.norm(line)
        # The shoe goes down by 2: the spring presses it on the plane.
        total = result.pairs["SHOE-ZMIN:PLANE"].resultant[-1]
        normal = 800 + along[2]
        np.testing.assert_allclose(total, [-0.2 * normal, 0, normal], atol=0.2)
        self.assertGreater(along[2], 3.5)
        self.assertAlmostEqual(240 - 0.2 * normal, along[0], delta=0.2)


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

    def test_foundations(self):
        self.assertIn("must be F1 to F6", self.errors("*FOUNDATION\nA, S1, 3.\n"))
        self.assertIn("must be positive", self.errors("*FOUNDATION\nA, F1, 0.\n"))
        self.assertIn("'B' is not defined", self.errors("*FOUNDATION\nB, F1, 3.\n"))

    def test_sets_of_others(self):
        self.assertIn("of a *SPRING must consist of", self.errors(
            springs("SPRING1", "S", {7: [15]}, 3.0, "1"), "*SPRING, ELSET=A\n1\n4.\n"))


class Tables(unittest.TestCase):
    """Forces over elongations, with NLGEOM."""

    ROWS = ((-0.5, -40.0), (-0.1, -20.0), (0.0, 0.0), (0.2, 8.0), (0.6, 40.0))

    def table(self, kind, ends, dofs=""):
        """Return the cards of springs of these forces."""
        lines = "".join(f"{n}, " + ", ".join(map(str, of)) + "\n" for n, of in ends.items())
        rows = "".join(f"{force!r}, {q!r}\n" for q, force in self.ROWS)
        return (
            f"*ELEMENT, TYPE={kind}, ELSET=T\n{lines}*SPRING, ELSET=T, NONLINEAR\n{dofs}{rows}"
        )

    def test_a_block_on_springs_of_a_table(self):
        """A stiff block goes as deep as the table says, and stores what is below it."""
        ends = {100 + n: [n] for n in (11, 12, 13, 14)}
        held = [
            springs("SPRING1", f"S{dof}", {1000 * dof + n: [n] for n in (11, 12, 13, 14)}, 3.0,
                    str(dof)) for dof in (1, 2)
        ]
        q, force = np.transpose(self.ROWS)
        for load in (-30.0, -10.0, 6.0, 24.0):
            result = solved(self, deck(
                cube(young=1e7), *held, self.table("SPRING1", ends, "3\n"),
                loaded("A-ZMIN, 3, " + repr(load), increments=2, nlgeom=", NLGEOM"),
            ))
            row = np.isin(result.springs.element_ids, list(ends))
            depth = np.interp(load, force, q)
            np.testing.assert_allclose(result.springs.force[-1][row], load, rtol=1e-8)
            np.testing.assert_allclose(result.springs.elongation[-1][row], depth, rtol=1e-6)
            grid = np.linspace(0, depth, 200001)
            forces = np.interp(grid, q, force)
            stored = np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(grid))
            self.assertAlmostEqual(result.history("energy/strain")[-1], 4 * stored,
                                   delta=1e-4 * 4 * stored)

    def test_a_strut_gets_stiffer(self):
        """SPRINGA between a corner that is pulled and the ground: force of its change of length."""
        result = solved(self, deck(
            cube(young=1e7), "*NODE\n900, 6., 0., 0.\n", self.table("SPRINGA", {100: [12, 900]}),
            "*STEP, NLGEOM\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\n900, 1, 1, 0.3\n*END STEP\n",
            held="A-ZMIN, 1, 3\n900, 1, 3",
        ))
        self.assertAlmostEqual(result.springs.force[-1][0], 16.0, delta=1e-3)

    def test_past_the_table(self):
        """The force stays, and the run names the spring that is farthest off."""
        struts = {100: [12, 900], 101: [11, 901]}
        for pulls, words in (
            ((0.7, 0.9), "2 springs past the end of the table"),
            ((0.7, 0.3), "1 spring past the end"), ((0.1, 0.3), ""),
        ):
            run = Run(deck(
                cube(young=1e7), "*NODE\n900, 6., 0., 0.\n901, -5., 0., 0.\n",
                self.table("SPRINGA", struts), "*STEP, NLGEOM\n*STATIC, DIRECT\n0.25, 1.\n"
                f"*BOUNDARY\n900, 1, 1, {pulls[0]}\n901, 1, 1, {-pulls[1]}\n*END STEP\n",
                held="A-ZMIN, 1, 3\n900, 1, 3\n901, 1, 3",
            ), name="deck")
            self.assertEqual(run.status, 0, run.errors)
            self.assertEqual("past the end of the table" in run.output, bool(words))
            self.assertIn(words, run.output)
            if words:
                worst = 100 + (pulls[1] > pulls[0])
                self.assertIn(f"farthest is element {worst}, by", run.output)
                self.assertIn("with a force of 40", run.output)

    def test_what_is_refused(self):
        """At small strain, by elongations that do not rise, with a force at 0, with one line."""
        def text(rows, nlgeom=", NLGEOM"):
            return deck(
                cube(), "*NODE\n900, 6., 0., 0.\n*ELEMENT, TYPE=SPRINGA, ELSET=T\n100, 12, 900\n"
                f"*SPRING, ELSET=T, NONLINEAR\n{rows}\n", loaded("A-ZMAX, 3, 1.", nlgeom=nlgeom),
                held="A-ZMIN, 1, 3\n900, 1, 3",
            )

        good = "-1., -1.\n1., 1."
        for deck_text, words in (
            (text(good, ""), "a table of *SPRING needs *STEP, NLGEOM"),
            (text("0., 0.\n1., 1.\n2., 1."), "must rise from line to line"),
            (text("1., -1.\n3., 1."), "has a force of 2 at elongation 0"),
            (text("0., 0."), "needs two lines at least"),
            (text("1., -1.\n-1., 1."), "never rise"),
            (text(good).replace(", NONLINEAR", ""), "is a *SPRING, NONLINEAR"),
        ):
            run = Run(deck_text, name="deck")
            self.assertEqual(run.status, 1, words)
            self.assertIn(words, run.errors)
            self.assertEqual(run.errors.count("error:"), 1, run.errors)
        run = Run(text(good), name="deck")
        self.assertEqual(run.status, 0, run.errors)


if __name__ == "__main__":
    unittest.main()
