"""Contact pressure at finite strain is over the deformed area, of obstacles as of bodies."""

import unittest

import numpy as np
from program import Run
from scipy.optimize import brentq
from test_finite_strain import BAR
from test_laws import C01, C10, D1, MOONEY, mooney

SIDES = "B-XMAX, 1, 1\n"


def stress_at(stretch, confined):
    """Return the Cauchy stress along the bar, and what it stretches by along x and y."""
    if confined:  # the sides x hold, the others are free
        def free(across):
            volume = stretch * across
            step = 1e-30j
            three = across + step
            first = stretch**2 + 1 + three**2
            second = stretch**2 + (stretch * three) ** 2 + three**2
            energy = (
                C10 * (first * (volume + stretch * step) ** (-2 / 3) - 3)
                + C01 * (second * (volume + stretch * step) ** (-4 / 3) - 3)
                + (volume + stretch * step - 1) ** 2 / D1
            )
            return energy.imag / 1e-30

        across = brentq(free, 0.8, 3.0, xtol=1e-15)
        one = 1.0
    else:
        one = across = brentq(lambda a: mooney(stretch, a)[1], 0.8, 2.0, xtol=1e-15)
    first = stretch + 1e-30j
    volume = first * one * across
    energy = (
        C10 * ((first**2 + one**2 + across**2) * volume ** (-2 / 3) - 3)
        + C01 * (((first * one) ** 2 + (one * across) ** 2 + (across * first) ** 2)
                 * volume ** (-4 / 3) - 3)
        + (volume - 1) ** 2 / D1
    )
    return energy.imag / 1e-30 / (one * across), one * across


class UniformPressure(unittest.TestCase):
    """A bar that a plane presses, free to grow sideways: the pressure is its Cauchy stress."""

    def check(self, stretch, confined, turn=None):
        """Hold the largest pressure, the field at the nodes and the force against the stress."""
        text = BAR.format(
            law=MOONEY, press=2 * (stretch - 1), sides=SIDES if confined else "", increment=0.05
        ).replace("*EL FILE", "*CONTACT PRINT\n*NODE FILE\nU, CFORCE\n*EL FILE")
        run = Run(turn(text) if turn else text, name="bar")
        self.assertEqual(run.status, 0, run.errors)
        stress, grown = stress_at(stretch, confined)
        with run.result() as result:
            pair = result.pairs["B-ZMAX:PRESS"]
            force = pair.resultant[-1][2]
            pressure = result.file["contact/B-ZMAX:PRESS/largest_pressure"][-1]
            area = result.file["contact/B-ZMAX:PRESS/contact_area"][-1]
            at_points = pair.pressure[-1]
            field = result.field("contact_pressure", -1)
        np.testing.assert_allclose(force, stress * 3 * grown, rtol=1e-6)
        np.testing.assert_allclose(pressure, -stress, rtol=1e-6)
        np.testing.assert_allclose(area, 3 * grown, rtol=1e-6)
        np.testing.assert_allclose(at_points, -stress, rtol=1e-6)
        np.testing.assert_allclose(field[field > 0], -stress, rtol=1e-6)

    def test_free_sides(self):
        """At a stretch of 0.7 the pressure is 26 % less than over the undeformed area."""
        self.check(0.7, confined=False)

    def test_held_sides(self):
        self.check(0.7, confined=True)
        self.check(0.5, confined=True)

    def test_an_obstacle_of_facets_and_a_plane_agree(self):
        """Before facets the area was the deformed one all along."""
        plate = """*NODE, NSET=PLATE
801, -5., -5., 2.
802, 8., -5., 2.
803, 8., 6., 2.
804, -5., 6., 2.
*ELEMENT, TYPE=R3D4, ELSET=PLATE
801, 801, 804, 803, 802
*RIGID BODY, ELSET=PLATE, REF NODE=900
*SURFACE, NAME=PRESS, TYPE=ELEMENT
PLATE, SPOS
"""

        def with_facets(text):
            begin = text.index("*OBSTACLE")
            end = text.index("*SURFACE INTERACTION")
            return text[:begin] + plate + text[end:]

        self.check(0.7, confined=False, turn=with_facets)


if __name__ == "__main__":
    unittest.main()
