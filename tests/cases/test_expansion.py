"""Bodies that become warmer: what is free expands without stress, what is held is pressed."""

import unittest

import numpy as np
from two_bodies import solved

from studies.deck_cards import deck, pair, quarter_ring

YOUNG, NU, ALPHA = 1000.0, 0.3, 1e-4
# 12 elements on a box of 3 by 1 by 2.
BODY = """*BLOCK, NAME=B, NX=3, NY=2, NZ=2, TYPE={element}
0., 0., 0.,  3., 1., 2.
*NSET, NSET=ALL
B
*MATERIAL, NAME=M
*ELASTIC
1000., {nu}
*EXPANSION, ZERO=20.
1e-4
*SOLID SECTION, ELSET=B, MATERIAL=M
*INITIAL CONDITIONS, TYPE=TEMPERATURE
ALL, 20.
"""
OUTPUT = "*EL FILE, POSITION=INTEGRATION POINTS\nS, E, ERR\n*NODE FILE\nU, RF\n"
ELEMENTS = ("C3D8", "C3D8I", "C3D8B")


def distorted(element, nu=NU):
    """Return a body of nodes and elements that are no boxes."""
    text = [f"*MATERIAL, NAME=M\n*ELASTIC\n1000., {nu}\n*EXPANSION\n1e-4\n*NODE, NSET=ALL"]
    random = np.random.default_rng(7)
    for k in range(3):
        for j in range(3):
            for i in range(4):
                x = np.array([i, 0.5 * j, k]) + 0.15 * random.uniform(-1, 1, 3)
                text.append(f"{1 + i + 4 * j + 12 * k}, " + ", ".join(map(repr, map(float, x))))
    text.append(f"*ELEMENT, TYPE={element}, ELSET=B")
    for k in range(2):
        for j in range(2):
            for i in range(3):
                n = 1 + i + 4 * j + 12 * k
                nodes = [n, n + 1, n + 5, n + 4, n + 12, n + 13, n + 17, n + 16]
                text.append(f"{1 + i + 3 * j + 6 * k}, " + ", ".join(map(str, nodes)))
    return "\n".join(text) + "\n*SOLID SECTION, ELSET=B, MATERIAL=M\n"


def gauss(result, name, step=-1):
    """Return a tensor at the Gauss points: (E, 8, 6)."""
    return result.field(name, step, on="gauss points")


class Expansion(unittest.TestCase):
    def test_a_free_body_has_no_stress(self):
        for element, nu in (*((name, NU) for name in ELEMENTS), ("C3D8B", 0.4999)):
            for held in ("", "*BOUNDARY\n1, 1, 3\n2, 2, 3\n5, 3\n"):
                with self.subTest(element=element, nu=nu, held=held):
                    result = solved(
                        self, distorted(element, nu) + held +
                        "*STEP\n*STATIC\n0.5, 1.\n*TEMPERATURE\nALL, 50.\n" + OUTPUT +
                        "*END STEP\n",
                    )
                    scale = YOUNG / (1 - 2 * nu) * ALPHA * 50
                    self.assertLess(np.abs(gauss(result, "stress")).max(), 1e-12 * scale)
                    want = np.array([1, 1, 1, 0, 0, 0]) * 50 * ALPHA
                    np.testing.assert_allclose(
                        gauss(result, "strain"), np.broadcast_to(want, (12, 8, 6)), rtol=0,
                        atol=1e-15 / (1 - 2 * nu),
                    )
                    self.assertEqual(result.history("error/mesh")[-1], 0)
                    for name in ("external_work", "strain", "balance"):
                        self.assertLess(
                            abs(result.history(f"energy/{name}")[-1]), 1e-12 * scale * ALPHA * 50
                        )

    def test_a_held_bar(self):
        """Held at both ends, free at its sides: -E alpha dT, and half of it half way."""
        for element in ELEMENTS:
            result = solved(
                self, BODY.format(element=element, nu=NU) +
                "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-XMIN, 1\nB-XMAX, 1\nB-YMIN, 2\nB-ZMIN, 3\n"
                "*TEMPERATURE\nALL, 120.\n" + OUTPUT + "*END STEP\n",
            )
            for step, rise in ((0, 50), (1, 100)):
                stress = YOUNG * ALPHA * rise
                np.testing.assert_allclose(
                    gauss(result, "stress", step),
                    np.broadcast_to([-stress, 0, 0, 0, 0, 0], (12, 8, 6)), rtol=0,
                    atol=1e-11 * stress,
                )
                lateral = (1 + NU) * ALPHA * rise
                np.testing.assert_allclose(
                    gauss(result, "strain", step),
                    np.broadcast_to([0, lateral, lateral, 0, 0, 0], (12, 8, 6)), rtol=0, atol=1e-14,
                )
                self.assertAlmostEqual(
                    np.abs(result.field("reaction_force", step)[:, 0]).sum(), 2 * stress * 2,
                    delta=1e-10 * stress,
                )
                # sigma^2/(2 E) over a volume of 6; nothing moves against the supports.
                self.assertAlmostEqual(
                    result.history("energy/strain")[step], stress**2 / (2 * YOUNG) * 6, delta=1e-11
                )
                self.assertAlmostEqual(result.history("energy/balance")[step], 0, delta=1e-11)
            self.assertLess(result.history("error/mesh")[-1], 1e-20)

    def test_temperatures_over_steps(self):
        """A held bar shows what its temperature is: ramps, amplitudes, OP=NEW."""
        def stresses(*steps, amplitude=""):
            text = BODY.format(element="C3D8", nu=NU) + amplitude
            text += "*BOUNDARY\nB-XMIN, 1\nB-XMAX, 1\nB-YMIN, 2\nB-ZMIN, 3\n"
            for lines in steps:
                text += f"*STEP\n*STATIC\n0.5, 1.\n{lines}"
                text += "*EL FILE, POSITION=INTEGRATION POINTS\nS\n*END STEP\n"
            result = solved(self, text)
            count = len(result.history("time"))
            return [-gauss(result, "stress", i)[0, 0, 0] / YOUNG / ALPHA for i in range(count)]

        def compare(found, expected):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)

        to = "*TEMPERATURE{}\nALL, {}\n".format
        compare(stresses(to("", 120.), "", to("", 40.)), [50, 100, 100, 100, 60, 20])
        compare(stresses(to("", 120.), "*TEMPERATURE, OP=NEW\n"), [50, 100, 50, 0])
        # Times the amplitude is the temperature itself, from which 20 are taken.
        wave = "*AMPLITUDE, NAME=A{}\n0., 0.2, 0.5, 1., 1., 0.4\n".format
        follow = to(", AMPLITUDE=A", 100.)
        compare(stresses(follow, "", to("", 20.), amplitude=wave("")), [80, 20, 20, 20, 10, 0])
        total = "*AMPLITUDE, NAME=A, TIME=TOTAL TIME\n0., 0.2, 1., 1., 2., 0.4\n"
        compare(stresses(follow, "", to("", 20.), amplitude=total), [40, 80, 50, 20, 10, 0])
        compare(
            stresses(follow, "*TEMPERATURE, OP=NEW\n", amplitude=total), [40, 80, 40, 0]
        )

    def test_a_bar_between_planes(self):
        """It closes a gap of 0.01 at 33.3 degrees more, and then presses with the rest."""
        text = BODY.format(element="C3D8I", nu=NU) + (
            "*OBSTACLE, NAME=WALL, TYPE=PLANE\n3.01, 0., 0., -1., 0., 0.\n" + pair("B-XMAX, WALL") +
            "*STEP\n*STATIC\n0.25, 1.\n*BOUNDARY\nB-XMIN, 1\nB-YMIN, 2\nB-ZMIN, 3\n*TEMPERATURE\n"
            "ALL, 120.\n*END STEP\n"
        )
        result = solved(self, text)
        time = result.history("time")
        self.assertAlmostEqual(time[1], 1 / 3, delta=1e-9)  # where contact begins
        force = 2 * YOUNG * np.maximum(0, ALPHA * 100 * time - 0.01 / 3)
        np.testing.assert_allclose(
            result.pairs[0].resultant[:, 0], -force, rtol=0, atol=1e-9 * force[-1]
        )

    def shrink_fit(self, n):
        """The mean pressure between a hub and a ring that is cooled by half a degree."""
        text = deck(
            quarter_ring("A", 1, (0.5, 1.0), (3 * n, 8 * n)),
            quarter_ring("B", 20001, (1.0, 2.0), (6 * n, 8 * n)),
            "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*EXPANSION\n1e-4\n",
            "*SOLID SECTION, ELSET=A, MATERIAL=M\n*SOLID SECTION, ELSET=B, MATERIAL=M\n",
            pair("A-OUT, B-IN", 0.0),
            "*STEP\n*STATIC, DIRECT\n1., 1.\n*TEMPERATURE\nB-ALL, -0.5\n*END STEP\n",
            held="A-ALL, 3, 3\nB-ALL, 3, 3\nA-X, 1\nB-X, 1\nA-Y, 2\nB-Y, 2",
        )
        result = solved(self, text)
        contact = result.file["contact/A-OUT:B-IN"]
        return contact["reaction"][-1][:, 0].sum() / contact["covered_area"][-1].sum()

    def test_a_shrink_fit(self):
        """Lame in plane strain: the interference is (1 + nu) alpha dT over the radius of 1."""
        want = YOUNG / (1 - NU**2) * (1 + NU) * ALPHA * 0.5 / (5 / 3 + 5 / 3)
        error = [abs(self.shrink_fit(n) / want - 1) for n in (2, 4)]
        self.assertLess(error[1], 0.002)
        # Facets are off by the square of their length.
        self.assertLess(error[1], 0.3 * error[0])

    def test_two_materials(self):
        """A sandwich whose skins expand and core does not: held flat, each has its own stress."""
        text = (
            "*BLOCK, NAME=LOW, NX=2, NY=2, NZ=2\n0., 0., 0., 1., 1., 1.\n*BLOCK, NAME=UP, NX=3, "
            "NY=3, NZ=2\n0., 0., 1., 1., 1., 1.\n*NSET, NSET=ALL\nLOW, UP\n*MATERIAL, NAME=P\n"
            "*ELASTIC\n1000., 0.3\n*EXPANSION\n1e-4\n*MATERIAL, NAME=Q\n*ELASTIC\n500., 0.2\n"
            "*SOLID SECTION, ELSET=LOW, MATERIAL=P\n*SOLID SECTION, ELSET=UP, MATERIAL=Q\n*TIE\n"
            "UP-ZMIN, LOW-ZMAX\n*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nLOW, 1, 2\nUP, 1, 2\n"
            "LOW-ZMIN, 3\n*TEMPERATURE\nALL, 100.\n" + OUTPUT + "*END STEP\n"
        )
        result = solved(self, text)
        stress = gauss(result, "stress")
        held = -YOUNG * ALPHA * 100 / (1 - NU)
        np.testing.assert_allclose(
            stress[:8], np.broadcast_to([held, held, 0, 0, 0, 0], (8, 8, 6)), rtol=0, atol=1e-11
        )
        np.testing.assert_allclose(stress[8:], 0, rtol=0, atol=1e-11)

    def test_forces_that_cancel_are_no_load(self):
        """A strip of two metals on a rough table curls up, and cools until it lies flat again:
        what the thermal forces leave then is their rounding, which no friction has to balance."""
        text = (
            "*BLOCK, NAME=LOW, TYPE=C3D8I, NX=10, NY=2, NZ=1\n0., 0., 0., 50., 6., 1.\n"
            "*BLOCK, NAME=HIGH, TYPE=C3D8I, NX=15, NY=3, NZ=1\n0., 0., 1., 50., 6., 1.\n"
            "*NSET, NSET=ALL\nLOW, HIGH\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 20.\n"
            "*MATERIAL, NAME=P\n*ELASTIC\n200000., 0.3\n*EXPANSION, ZERO=20.\n1.2e-5\n"
            "*MATERIAL, NAME=Q\n*ELASTIC\n100000., 0.25\n*EXPANSION, ZERO=20.\n3e-5\n"
            "*SOLID SECTION, ELSET=LOW, MATERIAL=P\n*SOLID SECTION, ELSET=HIGH, MATERIAL=Q\n"
            "*TIE\nHIGH-ZMIN, LOW-ZMAX\n*OBSTACLE, NAME=TABLE, TYPE=PLANE\n"
            "0., 0., 0., 0., 0., 1.\n" + pair("LOW-ZMIN, TABLE", 0.2) +
            "*CONTACT SOLVER, TOLERANCE=1e-4\n"
            "*STEP\n*STATIC\n1., 1.\n*DSLOAD\nHIGH-ZMAX, P, 0.01\n*END STEP\n"
            "*STEP\n*STATIC\n0.25, 1.\n*TEMPERATURE\nALL, 100.\n*END STEP\n"
            "*STEP\n*STATIC\n0.5, 1.\n*TEMPERATURE\nALL, 20.\n*END STEP\n"
        )
        result = solved(self, text)
        # None of them was cut.
        np.testing.assert_array_equal(result.history("time"), [1, 1.25, 1.5, 1.75, 2, 2.5, 3])
        np.testing.assert_allclose(result.pairs[0].resultant[:, 2], 3, rtol=1e-3)
        status = result.pairs[0].status
        self.assertLessEqual((status[4] > 0).sum(), 6)
        self.assertGreater((status[-1] > 0).sum(), 25)

    def test_temperatures_without_expansion_are_noted(self):
        text = BODY.format(element="C3D8", nu=NU).replace("*EXPANSION, ZERO=20.\n1e-4\n", "")
        text += "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-XMIN, 1, 3\n*TEMPERATURE\nALL, 9.\n"
        text += "*END STEP\n"
        result = solved(self, text)
        self.assertIn("*TEMPERATURE changes nothing: no material has an *EXPANSION", result.output)
        self.assertEqual(np.abs(result.field("displacement", -1)).max(), 0)


if __name__ == "__main__":
    unittest.main()
