"""What joins nodes at finite strain: equations, ties, couplings, local axes, hanging nodes."""

import unittest

import numpy as np
from finite_laws import LAWS, NEO, cauchy_stress
from program import Run
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from turned_grips import check_turn

STEP = "*STEP, NLGEOM\n*STATIC\n{increment}, 1.\n*NODE FILE\nU, RF\n*EL FILE\nS, E\n"



def solved(case, text):
    """Run a deck that must be certified, and open its result."""
    run = Run(text, name="case")
    case.assertEqual(run.status, 0, run.errors)
    result = run.result()
    case.addCleanup(result.close)
    return result


def block(name, n, low, size):
    """Return the cards of a block of elements."""
    numbers = ", ".join(map(str, [*low, *size]))
    counts = f"NX={n[0]}, NY={n[1]}, NZ={n[2]}"
    return f"*BLOCK, NAME={name}, {counts}, TYPE=C3D8, ELSET=ALL\n{numbers}\n"


def section(law):
    """Return the cards of the material of all elements."""
    return f"*MATERIAL, NAME=M\n{law}\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n"


class Patch(unittest.TestCase):
    """Sides that move apart strain all elements alike, whatever joins them."""

    def check(self, mesh, ends):
        """Stretch the box [0, 2] x [0, 1] x [0, 1]; `ends` are its sets at x = 0 and x = 2."""
        stretches = np.array([1.5, 0.8, 0.9])
        sides = f"*BOUNDARY\n{ends[0]}-XMIN, 1, 1\n{ends[1]}-XMAX, 1, 1, 1.\n"
        for name in dict.fromkeys(ends):
            sides += f"{name}-YMIN, 2, 2\n{name}-YMAX, 2, 2, -0.2\n"
            sides += f"{name}-ZMIN, 3, 3\n{name}-ZMAX, 3, 3, -0.1\n"
        for name, law in LAWS.items():
            with self.subTest(law=name):
                text = mesh + section(law) + STEP.format(increment=0.25) + sides + "*END STEP\n"
                result = solved(self, text)
                x = result.points
                np.testing.assert_allclose(
                    result.field("displacement", -1), x * (stretches - 1), rtol=0, atol=1e-8
                )
                stress = result.field("stress", -1, on="elements")
                wanted = [*cauchy_stress(law, stretches), 0, 0, 0]
                wanted = np.tile(wanted, (len(stress), 1))
                np.testing.assert_allclose(stress, wanted, rtol=0, atol=1e-6)

    def test_nodes_that_hang(self):
        mesh = block("B", (4, 2, 2), (0, 0, 0), (2, 1, 1)) + "*REFINE\n2., 1., 1., 0.3\n"
        self.check(mesh, ("B", "B"))

    def test_ties(self):
        """Of meshes that do not match."""
        mesh = block("A", (2, 2, 2), (0, 0, 0), (1, 1, 1))
        mesh += block("B", (3, 3, 3), (1, 0, 0), (1, 1, 1))
        mesh += "*TIE, NAME=T\nB-XMIN, A-XMAX\n"
        self.check(mesh, ("A", "B"))


FAR = "{end}-XMAX, 1, 1, 0.3\n{end}-XMAX, 2, 3, 0.5\n"


def bent(case, mesh, ends, grip="", load=FAR):
    """Hold a bar [0, 2] at x = 0 and move the end at x = 2."""
    text = mesh + section(NEO) + grip + STEP.format(increment=0.1)
    text += f"*BOUNDARY\n{ends[0]}-XMIN, 1, 3\n" + load.format(end=ends[1]) + "*END STEP\n"
    result = solved(case, text)
    order = np.lexsort(result.points.T.round(9))
    return result, result.points[order], result.field("displacement", -1)[order]


class Joined(unittest.TestCase):
    """What is joined node by node is one mesh."""

    def setUp(self):
        self.mesh = block("B", (4, 2, 2), (0, 0, 0), (2, 1, 1))
        self.halves = block("A", (2, 2, 2), (0, 0, 0), (1, 1, 1))
        self.halves += block("B", (2, 2, 2), (1, 0, 0), (1, 1, 1))

    def compare(self, joint):
        """Hold two halves, bent far, against the whole."""
        whole = bent(self, self.mesh, ("B", "B"))
        result, x, u = bent(self, self.halves + joint, ("A", "B"))
        twice = np.isclose(x[:, 0], 1)
        np.testing.assert_allclose(x[twice][::2], x[twice][1::2])
        keep = ~twice
        keep[np.flatnonzero(twice)[::2]] = True
        np.testing.assert_allclose(u[keep], whole[2], rtol=0, atol=1e-7)
        np.testing.assert_allclose(
            result.history("energy/strain"), whole[0].history("energy/strain"), rtol=1e-6
        )

    def test_equations(self):
        joint = "*EQUATION\n" + "".join(
            f"2\nB-XMIN, {i}, 1., A-XMAX, {i}, -1.\n" for i in (1, 2, 3)
        )
        self.compare(joint)

    def test_ties(self):
        self.compare("*TIE, NAME=T\nB-XMIN, A-XMAX\n")

    def test_contact(self):
        """Pressed on a ball and dragged, upper and lower half joined."""
        whole = self.pressed(block("B", (3, 3, 4), (0, 0, 0), (1, 1, 1)), "B", "")
        halves = block("A", (3, 3, 2), (0, 0, 0), (1, 1, 0.5))
        halves += block("B", (3, 3, 2), (0, 0, 0.5), (1, 1, 0.5))
        equations = "*EQUATION\n" + "".join(
            f"2\nA-ZMAX, {i}, 1., B-ZMIN, {i}, -1.\n" for i in (1, 2, 3)
        )
        for joint in ("*TIE, NAME=T\nB-ZMIN, A-ZMAX\n", equations):
            with self.subTest(joint=joint):
                force = self.pressed(halves, "A", joint)
                np.testing.assert_allclose(force, whole, rtol=0, atol=1e-7 * np.abs(whole).max())

    def pressed(self, mesh, lower, joint):
        """Return the force of the ball."""
        ball = "*OBSTACLE, NAME=BALL, TYPE=SPHERE\n0.5, 0.5, -2., 2.\n"
        ball += "*SURFACE INTERACTION, NAME=I\n"
        ball += f"*FRICTION\n0.3\n*CONTACT PAIR, INTERACTION=I\n{lower}-ZMIN, BALL\n"
        step = STEP.format(increment=0.25) + "*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.2\n"
        step += "*END STEP\n*STEP\n*STATIC\n0.25, 1.\n*BOUNDARY\nB-ZMAX, 1, 1, 0.2\n*END STEP\n"
        return solved(self, mesh + section(NEO) + ball + joint + step).pairs[0].resultant[-1]


class Turned(unittest.TestCase):
    def test_a_tie_turns_with_its_body(self):
        """A bar of two meshes that do not match, pulled and turned by 90 degrees."""
        mesh = block("A", (2, 2, 1), (0, 0, 0), (1, 1, 1))
        mesh += block("B", (3, 3, 1), (1, 0, 0), (1, 1, 1))
        mesh += "*TIE, NAME=T\nB-XMIN, A-XMAX\n" + section(NEO)
        pull = "*BOUNDARY\nA-XMIN, 1, 3\nB-XMAX, 2, 3\nB-XMAX, 1, 1, 0.4\n*END STEP\n"
        check_turn(self, mesh, STEP.format(increment=0.5) + pull)


RING = """\
*SOLID SECTION, ELSET=B, MATERIAL=M
*MATERIAL, NAME=M
{law}
{axes}*STEP, NLGEOM
*STATIC
0.2, 1.
*NODE FILE
U
*BOUNDARY
ALL, 3, 3
{sides}*DSLOAD
IN, P, 15.
*END STEP
"""


def ring(degrees, around, across=3, radii=(1.0, 1.5), height=0.2):
    """Return the cards of a sector of a ring; its sets of nodes at its ends are E0 and E1."""
    number, text = {}, "*NODE, NSET=ALL\n"
    for k in range(2):
        for j in range(around + 1):
            for i in range(across + 1):
                r = radii[0] + (radii[1] - radii[0]) * i / across
                angle = np.radians(degrees) * j / around
                x, y = r * np.cos(angle), r * np.sin(angle)
                number[i, j, k] = len(number) + 1
                text += f"{number[i, j, k]}, {float(x)!r}, {float(y)!r}, {height * k}\n"
    text += "*ELEMENT, TYPE=C3D8, ELSET=B\n"
    for j in range(around):
        for i in range(across):
            nodes = [
                number[i + a, j + b, k] for k in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))
            ]
            text += ", ".join(map(str, [1 + i + across * j, *nodes])) + "\n"
    for end, at in (("E0", 0), ("E1", around)):
        text += f"*NSET, NSET={end}\n"
        text += "".join(f"{n}\n" for (_, j, _), n in number.items() if j == at)
    text += "*ELSET, ELSET=INNER\n" + "".join(f"{1 + across * j}\n" for j in range(around))
    return text + "*SURFACE, NAME=IN\nINNER, S6\n"


def tube(pressure, x):
    """Return the displacement of a neo-Hookean tube, from radius 1 to 2, under inner pressure."""

    def nominal(along, around):
        """First Piola-Kirchhoff stress along the radius and around, its length kept."""
        stress = cauchy_stress(NEO, [along, around, 1.0])
        return stress[0] * around, stress[1] * along

    def slopes(radius, state):
        place, force = state
        around = place / radius
        along = brentq(lambda a: radius * nominal(a, around)[0] - force, 0.3, 2.0, xtol=1e-14)
        return along, nominal(along, around)[1]

    def shoot(bore):
        return solve_ivp(
            slopes, (1.0, 2.0), (bore, -pressure * bore), rtol=1e-9, atol=1e-10, dense_output=True
        ).sol

    # `force` is R P_r; -p times the stretch around at the bore, whose radius is 1.
    bore = brentq(lambda place: shoot(place)(2.0)[1], 1.01, 1.6, xtol=1e-10)
    return shoot(bore)(x)[0] - x


class LocalDirections(unittest.TestCase):
    def test_a_sector_is_a_part_of_the_ring(self):
        """Under pressure that follows; its inclined plane of symmetry is one of local directions,
        of either kind."""
        whole = ring(90, 6) + RING.format(law=NEO, axes="", sides="E0, 2, 2\nE1, 1, 1\n")
        result = solved(self, whole)
        u = result.field("displacement", -1)[:4]
        self.assertGreater(u[0, 0], 0.1)
        c, s = float(np.cos(np.pi / 6)), 0.5
        for axes in (
            "*TRANSFORM, NSET=E1, TYPE=C\n0., 0., 0., 0., 0., 1.\n",
            f"*TRANSFORM, NSET=E1\n{c!r}, {s}, 0., {-s}, {c!r}, 0.\n",
        ):
            with self.subTest(axes=axes):
                text = ring(30, 2) + RING.format(law=NEO, axes=axes, sides="E0, 2, 2\nE1, 2, 2\n")
                part = solved(self, text).field("displacement", -1)
                np.testing.assert_allclose(part[:4], u, rtol=0, atol=1e-8)
                np.testing.assert_allclose(part[8:12] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]], u,
                                           rtol=0, atol=1e-8)

    def test_a_tube_under_pressure(self):
        """A thin wedge of a tube, of which its length stays, has the radial displacement of the
        differential equation: d(r P_r)/dR = P_t along R, r P_r = -p r at the bore, 0 outside."""
        degrees, across, pressure = 2, 24, 20.0
        c, s = float(np.cos(np.radians(degrees))), float(np.sin(np.radians(degrees)))
        axes = f"*TRANSFORM, NSET=E1\n{c!r}, {s!r}, 0., {-s!r}, {c!r}, 0.\n"
        text = ring(degrees, 1, across, (1.0, 2.0), 0.05) + RING.format(
            law=NEO, axes=axes, sides="E0, 2, 2\nE1, 2, 2\n"
        ).replace("P, 15.", f"P, {pressure}")
        result = solved(self, text)
        u = result.field("displacement", -1)[: across + 1, 0]
        x = result.points[: across + 1, 0]
        self.assertGreater(u[0], 0.2)
        np.testing.assert_allclose(u, tube(pressure, x), rtol=1e-3)


class Couplings(unittest.TestCase):
    def setUp(self):
        self.mesh = block("B", (4, 2, 2), (0, 0, 0), (2, 1, 1))
        self.node = "*NODE\n900, 2., 0.5, 0.5\n"
        self.node += "*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=B-XMAX\n"

    def test_a_grip_that_does_not_turn(self):
        """*KINEMATIC moves a side as supports that prescribe it do."""
        result, _, u = bent(self, self.mesh, ("B", "B"))
        load = "900, 1, 1, 0.3\n900, 2, 3, 0.5\n900, 4, 6\n"
        grip = self.node + "*KINEMATIC\n"
        other, _, v = bent(self, self.mesh, ("B", "B"), grip=grip, load=load)
        np.testing.assert_allclose(v, u, rtol=0, atol=1e-8)
        force = result.field("reaction_force", -1)[np.isclose(result.points[:, 0], 2)].sum(axis=0)
        np.testing.assert_allclose(other.reference_nodes[900].reaction_force[-1], force, rtol=1e-6)

    def test_a_force_that_is_spread(self):
        """*DISTRIBUTING from the middle of a side puts forces on its nodes, weighed by areas."""
        share = {0: 0.25, 1: 0.5, 2: 0.25}
        load = "*CLOAD\n"
        for y in range(3):
            for z in range(3):
                node, part = 5 + 5 * y + 15 * z, share[y] * share[z]
                load += f"{node}, 3, {8 * part!r}\n{node}, 1, {4 * part!r}\n"
        _, _, u = bent(self, self.mesh, ("B", "B"), load=load)
        grip = self.node + "*DISTRIBUTING\n"
        spread = "*CLOAD\n900, 3, 8.\n900, 1, 4.\n"
        _, x, v = bent(self, self.mesh, ("B", "B"), grip=grip, load=spread)
        self.assertEqual(len(x), 45)
        np.testing.assert_allclose(v, u, rtol=0, atol=1e-8)

    def test_what_turns_is_refused(self):
        for grip, load in (
            ("*KINEMATIC\n1, 2\n", "900, 1, 2\n900, 4, 4, 0.1\n900, 5, 6\n"),
            ("*DISTRIBUTING\n1, 4\n", "*CLOAD\n900, 4, 1.\n"),
        ):
            with self.subTest(grip=grip, load=load):
                text = self.mesh + section(NEO) + self.node + grip + STEP.format(increment=0.5)
                run = Run(text + "*BOUNDARY\nB-XMIN, 1, 3\n" + load + "*END STEP\n", name="case")
                self.assertEqual(run.status, 1, run.output)
                self.assertIn(f"NLGEOM does not cover {grip.split()[0]} couplings ", run.errors)
                self.assertIn("(reference node 900)", run.errors)


if __name__ == "__main__":
    unittest.main()
