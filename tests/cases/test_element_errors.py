"""Errors of contact pressures of elements of second order, beside those of an independent program.

Scenes of the study `elements` on coarse meshes. Source of the limits: 1.1 times the errors in
../shared/reference/free_meshes/csv (hertz_rigid, hertz_mortar; hertz_a25, hertz_mortar_a25 for
faces of C3D20R).
"""

import unittest

from two_bodies import solved

from studies import element_scenes as scenes  # found through two_bodies


class Hertz(unittest.TestCase):
    """The error of Hertz's pressure in the mean square."""

    def test_before_a_plane(self):
        for kind, n, other in (
            ("C3D4", 8, 0.1989), ("C3D8", 8, 0.2147), ("C3D10", 4, 0.3011),
            ("C3D15", 4, 0.3137), ("C3D20R", 4, 0.3052),
        ):
            with self.subTest(kind=kind):
                values = scenes.hertz_values(
                    scenes.hertz_body(kind, n), solved(self, scenes.hertz_deck(kind, n)))
                self.assertLess(values["pressure"], 1.1 * other)

    def test_two_bodies(self):
        for kind, other in (("C3D10", 0.1896), ("C3D20R", 0.1994)):
            with self.subTest(kind=kind):
                result = solved(self, scenes.two_hertz_deck(kind, 5, 4))
                values = scenes.two_hertz_values(kind, 5, 4, result)
                self.assertLess(values["pressure"], 1.1 * other)


if __name__ == "__main__":
    unittest.main()
