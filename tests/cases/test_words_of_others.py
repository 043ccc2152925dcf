"""Words that other programs write mean here what they mean there: values by hand.

A cube of edge 1, E = 1000 and nu = 0 is pressed on a plane: the force is 1000 times the shortening.
"""

import tempfile
import unittest
from pathlib import Path

import numpy as np
from program import Run

CUBE = """*BLOCK, NAME=A, NX=1, NY=1, NZ=1
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=A, MATERIAL=M
*SURFACE INTERACTION, NAME=I
{friction}*OBSTACLE, NAME=G, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*CONTACT PAIR, INTERACTION=I{options}
{slave}, G
"""
HELD = "*BOUNDARY\nA-ZMAX, 1, 2\n"


def cube(friction="", options="", slave="A-ZMIN"):
    """Return the cube before the plane."""
    return CUBE.format(friction=friction, options=options, slave=slave)


def step(cards, period=1.0):
    """Return a step of four increments at small strain."""
    return f"*STEP\n*STATIC, DIRECT\n{period / 4}, {period}\n{cards}*END STEP\n"


class Words(unittest.TestCase):
    def forces(self, deck, *options, says=""):
        """Return the forces on the cube in all increments."""
        run = Run(deck, *options, name="words")
        self.assertEqual(run.status, 0, run.output + run.errors)
        self.assertIn(says, " ".join(run.output.split()))
        with run.result() as result:
            self.assertTrue(result.certified)
            return result.pairs[0].resultant

    def check(self, deck, force):
        """Check the normal force at the end."""
        np.testing.assert_allclose(self.forces(deck)[-1], [0, 0, force], atol=1e-7)

    def test_smooth_step(self):
        """t^3 (10 - 15 t + 6 t^2), at quarters."""
        deck = "*AMPLITUDE, NAME=S, DEFINITION=SMOOTH STEP\n0., 0., 1., 1.\n" + cube() + step(
            HELD + "*BOUNDARY, AMPLITUDE=S\nA-ZMAX, 3, 3, -0.01\n"
        )
        t = np.array([0.25, 0.5, 0.75, 1.0])
        np.testing.assert_allclose(
            self.forces(deck)[:, 2], 10 * t**3 * (10 - 15 * t + 6 * t**2), rtol=1e-9
        )

    def test_rounded_corners(self):
        """The parabola from 3/8 to 5/8 that touches the lines is at 1 - 1/8 in the middle."""
        deck = "*AMPLITUDE, NAME=S, SMOOTH=0.25\n0., 0., 0.5, 1., 1., 0.\n" + cube() + step(
            HELD + "*BOUNDARY, AMPLITUDE=S\nA-ZMAX, 3, 3, -0.01\n"
        )
        np.testing.assert_allclose(self.forces(deck)[:3, 2], [5, 8.75, 5], rtol=1e-9)

    def test_velocity(self):
        """0.005 per unit of time, for 2."""
        self.check(cube() + step(HELD + "*BOUNDARY, TYPE=VELOCITY\nA-ZMAX, 3, 3, -0.005\n", 2), 10)

    def test_velocities_go_on(self):
        """-0.005 for 2, as long again for 3, back by 0.01, by half an amplitude, at rest."""
        moved = "*BOUNDARY{}\nA-ZMAX, 3, 3, {}\n"
        deck = "*AMPLITUDE, NAME=S\n0., 0., 1., 0.5\n" + cube() + step(
            HELD + moved.format(", TYPE=VELOCITY", -0.005), 2
        ) + step("*BOUNDARY\nA-ZMAX, 1\n", 3) + "".join(
            step(moved.format(options, value)) for options, value in (
                (", TYPE=VELOCITY", 0.01), (", AMPLITUDE=S", -0.06), (", TYPE=VELOCITY", -0.01),
                (", TYPE=VELOCITY, OP=NEW", -0.01), ("", -0.02), (", TYPE=VELOCITY", 0),
            )
        )
        np.testing.assert_allclose(
            self.forces(deck)[3::4, 2], [10, 25, 15, 30, 40, 50, 20, 20], rtol=1e-9
        )

    def test_velocities_of_what_turns(self):
        """Shafts turn at 0.01 for 1 and 2, and a face that a coupling turns does."""
        shaft = (
            "*NODE, NSET=R\n900, 0.5, 0.5, -2.\n" + cube().replace(
                "TYPE=PLANE\n0., 0., 0.,  0., 0., 1.",
                "TYPE=CYLINDER, REF NODE=900\n0.5, 0., -2., 0., 1., 0., 2.",
            ).replace("NX=1", "NX=4"), "*BOUNDARY\nA-ZMAX, 1, 2\nA-ZMAX, 3, 3, -0.01\n900, 1, 3\n"
        )
        face = (
            "*NODE, NSET=R\n900, 0.5, 0.5, 1.\n" + cube()
            + "*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=A-ZMAX\n*KINEMATIC\n",
            "*BOUNDARY\n900, 1, 2\n900, 3, 3, -0.01\n",
        )
        for scene, held in (shaft, face):
            turned = [
                self.forces(
                    scene.replace("{friction}", "*FRICTION\n0.3\n")
                    + step(f"{held}*BOUNDARY{kind}\nR, 5, 5, {first}\n", 1)
                    + step(f"*BOUNDARY{kind}\nR, 5, 5, {second}\n", 2)
                )
                for kind, first, second in (("", 0.01, 0.03), (", TYPE=VELOCITY", 0.01, 0.01))
            ]
            np.testing.assert_allclose(*turned, rtol=0, atol=1e-9)

    def test_rough(self):
        """The foot sticks while the top is moved by 0.002: shear 500 x 0.002."""
        deck = cube(friction="*FRICTION, ROUGH\n") + step(
            "*BOUNDARY\nA-ZMAX, 1, 1, 0.002\nA-ZMAX, 2\nA-ZMAX, 3, 3, -0.01\n"
        )
        np.testing.assert_allclose(self.forces(deck)[-1], [-1, 0, 10], atol=1e-6)

    def test_surfaces_of_whole_sets_and_unions(self):
        press = step(HELD + "*BOUNDARY\nA-ZMAX, 3, 3, -0.01\n")
        whole = "*SURFACE, NAME=SKIN\nA,\n"
        union = (
            "*SURFACE, NAME=FOOT\nA, S1\n*SURFACE, NAME=SIDE\nA, S3\n"
            "*SURFACE, NAME=BOTH, COMBINE=UNION\nFOOT, SIDE\n"
        )
        self.check(whole + cube(slave="SKIN") + press, 10)
        self.check(union + cube(slave="BOTH") + press, 10)

    def test_forces_that_follow(self):
        """Nodes of solids do not turn, so their forces keep their direction."""
        deck = cube() + step("*BOUNDARY\nA-ZMAX, 1, 2\n*CLOAD, FOLLOWER\nA-ZMAX, 3, -2.5\n")
        self.check(deck, 10)

    def test_pairs_that_are_tied(self):
        """A second cube on top of the first, glued to it: both in a row, half as stiff."""
        deck = (
            "*BLOCK, NAME=B, NX=1, NY=1, NZ=1\n0., 0., 1.,  1., 1., 1.\n"
            "*SOLID SECTION, ELSET=B, MATERIAL=M\n" + cube()
            + "*CONTACT PAIR, INTERACTION=I, TIED\nB-ZMIN, A-ZMAX\n"
            + step("*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.01\n")
        )
        self.check(deck, 5)

    def test_nodes_that_move_alike(self):
        """The same two cubes, joined node by node."""
        deck = (
            "*BLOCK, NAME=B, NX=1, NY=1, NZ=1\n0., 0., 1.,  1., 1., 1.\n"
            "*SOLID SECTION, ELSET=B, MATERIAL=M\n" + cube()
            + "*MPC\n{}, B-ZMIN, A-ZMAX\n"
            + step("*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.01\n")
        )
        self.check(deck.format("TIE"), 5)
        self.check(deck.format("PIN"), 5)

    def test_couplings(self):
        """A force of 10 on the reference node, whichever way its card is written."""
        ways = {
            "kinematic": "*KINEMATIC COUPLING, REF NODE=900\nA-ZMAX, 1, 6\n",
            "beam": "*MPC\nBEAM, A-ZMAX, 900\n",
            "distributing": "*ELEMENT, TYPE=DCOUP3D, ELSET=D\n900, 900\n"
            "*DISTRIBUTING COUPLING, ELSET=D\nA-ZMAX, 1.\n",
        }
        for name, card in ways.items():
            with self.subTest(name):
                node = "*NODE\n900, .5, .5, 2.\n"
                hold = "*BOUNDARY\nA-ZMIN, 1, 2\n*CLOAD\n900, 3, -10.\n"
                self.check(node + cube() + card + step(hold), 10)

    def test_links(self):
        """A strut (3, 0, 4) on the cube's top carries a force of 10 along x: 40/3 goes down."""
        deck = (
            "*NODE\n900, .5, .5, 1.\n901, 3.5, .5, 5.\n902, 3.5, .5, 9.\n903, 7.5, 4., 12.\n"
            + cube() + "*KINEMATIC COUPLING, REF NODE=900\nA-ZMAX, 1, 3\n"
            "*MPC\nLINK, 901, 900\nLINK, 902, 901\nLINK, 902, 901\nLINK, 903, 902\n"
            + step(
                "*BOUNDARY\n900, 1, 2\n900, 4, 6\n901, 2, 3\n902, 1, 2\n903, 1, 2\n"
                "*CLOAD\n901, 1, -10.\n"
            )
        )
        # What hangs on struts above is not loaded, and one strut is there twice.
        self.check(deck, 40 / 3)
        run = Run(deck, "--nlgeom", "yes", name="links")
        self.assertEqual(run.status, 1)
        self.assertIn("NLGEOM does not cover *MPC, LINK", run.errors)
        here = Run(deck.replace("902, 3.5, .5, 9.", "902, 3.5, .5, 5."), name="links")
        self.assertIn("nodes 902 and 901 of a LINK are in one place", here.errors)

    def test_plastic_materials_that_are_elastic(self):
        """Cubes of E = 1000 and 2000 in a row: 20/3 in both, at yields of 5 and 8."""
        deck = (
            "*BLOCK, NAME=B, NX=1, NY=1, NZ=1\n0., 0., 1.,  1., 1., 1.\n"
            + cube().replace("1000., 0.\n", "1000., 0.\n*PLASTIC\n5., 0.\n9., 0.1\n")
            + "*MATERIAL, NAME=N\n*ELASTIC\n2000., 0.\n*PLASTIC, HARDENING=KINEMATIC\n8., 0.\n"
            "*SOLID SECTION, ELSET=B, MATERIAL=N\n*CONTACT PAIR, INTERACTION=I\nB-ZMIN, A-ZMAX\n"
            + step("*BOUNDARY\nA, 1, 2\nB, 1, 2\nB-ZMAX, 3, 3, -0.01\n")
        )
        run = Run(deck, "--check", name="plastic")
        self.assertEqual(run.status, 1)
        self.assertIn("--elastic runs the deck so", run.errors)
        force = self.forces(
            deck, "--elastic", "--nlgeom", "no",
            says="is above its first yield stress in 100 % of its volume: von Mises' stress gets "
            "to 1.33 times that of M (5), in element ",
        )
        np.testing.assert_allclose(force[-1], [0, 0, 20 / 3], atol=1e-7)
        self.forces(deck, "--elastic", "--nlgeom", "no",
                    says="does not yield: von Mises' stress gets to 0.833 times that of N (8)")

    def test_static_steps_alone(self):
        deck = cube() + step(HELD + "*BOUNDARY\nA-ZMAX, 3, 3, -0.01\n")
        modes = "*STEP, PERTURBATION\n*FREQUENCY\n5\n*END STEP\n*STEP\n*STATIC\n*END STEP\n"
        run = Run(deck + modes, "--check", name="modes")
        self.assertEqual(run.status, 1)
        self.assertIn("--static-steps runs the steps before it", run.errors)
        force = self.forces(deck + modes, "--static-steps",
                            says="step 2 (PERTURBATION) is left out, and 1 step behind it")
        np.testing.assert_allclose(force[-1], [0, 0, 10], atol=1e-7)
        self.assertEqual(len(force), 4)
        run = Run(cube() + modes, "--static-steps", "--check", name="modes")
        self.assertEqual(run.status, 1)
        self.assertIn("the first step is not static", run.errors)

    def test_plane_elements_of_a_mesh_generator(self):
        """A disc of radius 2, written as CPS4: 10 over its area 4 pi."""
        nodes = "*NODE\n1, 0., 0.\n2, 2., 0.\n3, 2., 1.\n4, 0., 1.\n"
        mesh = nodes + "*ELEMENT, TYPE=CPS4, ELSET=A\n1, 1, 2, 3, 4\n*NSET, NSET=FOOT\n1, 2\n"
        cards = cube(slave="FOOT").split("\n", 2)[2]
        cards = cards.replace("0., 0., 0.,  0., 0., 1.", "0., 0., 0.,  0., 1., 0.")
        cards += step("*BOUNDARY\n3, 2, 2, -0.01\n4, 2, 2, -0.01\n")
        force = self.forces(mesh + "*PLANE ELEMENTS, TYPE=CAX\n" + cards,
                            says="CPS4 elements are taken as CAX4")
        np.testing.assert_allclose(force[-1], [0, 40 * np.pi, 0], rtol=1e-6)

    def test_hybrid_elements(self):
        """Nearly incompressible between stiff plates: twice as soft as elements that lock.

        C3D8H is the mean dilatation of C3D8B to the bit; CPE4H is within 5 % of CPE8R, which does
        not lock either.
        """
        block = (
            "*BLOCK, NAME=A, NX=4, NY=1, NZ=2, TYPE={}\n0., 0., 0.,  2., .5, 1.\n"
            + cube().split("\n", 2)[2].replace("1000., 0.\n", "1000., 0.4999\n")
            + step("*BOUNDARY\nA-ZMAX, 1, 2\nA-ZMIN, 1, 2\nA, 2\nA-ZMAX, 3, 3, -0.01\n")
        )
        hybrid, plain, stiff = (
            self.forces(block.format(kind))[-1, 2] for kind in ("C3D8H", "C3D8B", "C3D8")
        )
        self.assertEqual(hybrid, plain)
        self.assertGreater(stiff, 2 * hybrid)
        forces = {kind: self.plane_force(kind, 8) for kind in ("CPE4", "CPE4H", "CPE8R")}
        np.testing.assert_allclose(forces["CPE4H"], forces["CPE8R"], rtol=0.05)
        self.assertGreater(forces["CPE4"], 2 * forces["CPE8R"])

    def plane_force(self, kind, n):
        """Return the force of a slice of 2n x n elements, nu = 0.4999, on a line."""
        order = 2 if "8" in kind else 1
        ids = {}
        for j in range(n * order + 1):
            for i in range(2 * n * order + 1):
                if order == 1 or i % 2 == 0 or j % 2 == 0:
                    ids[i, j] = len(ids) + 1
        lines = ["*NODE"]
        lines += [f"{k}, {i / n / order}, {j / n / order}" for (i, j), k in ids.items()]
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET=A")
        around = [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)]
        for j in range(n):
            for i in range(2 * n):
                nodes = [
                    ids[int((i + a) * order), int((j + b) * order)]
                    for a, b in around[:4 * order]
                ]
                lines.append(", ".join(map(str, [2 * n * j + i + 1, *nodes])))
        foot = [str(k) for (i, j), k in ids.items() if j == 0]
        top = [str(k) for (i, j), k in ids.items() if j == n * order]
        lines += ["*NSET, NSET=FOOT", *foot, "*NSET, NSET=TOP", *top]
        cards = cube(slave="FOOT").split("\n", 2)[2].replace("1000., 0.\n", "1000., 0.4999\n")
        cards = cards.replace("0., 0., 0.,  0., 0., 1.", "0., 0., 0.,  0., 1., 0.")
        deck = "\n".join(lines) + "\n" + cards
        deck += step("*BOUNDARY\nTOP, 1\nTOP, 2, 2, -0.01\nFOOT, 1\n")
        return self.forces(deck)[-1, 1]

    def test_latin_1(self):
        """A comment and a heading of an old file; names must be UTF-8 still."""
        deck = "*HEADING\nPr\xfcfk\xf6rper\n** Gr\xf6\xdfe\n" + cube()
        deck += step(HELD + "*BOUNDARY\nA-ZMAX, 3, 3, -0.01\n")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "old.inp"
            path.write_bytes(deck.encode("latin-1"))
            run = Run(path)
        self.assertEqual(run.status, 0, run.output + run.errors)
        self.assertIn("are not UTF-8 text: read as Latin-1", run.output)
        with run.result() as result:
            self.assertIn("Pr\xfcfk\xf6rper", result.run_text("deck"))


if __name__ == "__main__":
    unittest.main()
