"""Values along a path: exact for what the elements can represent, whatever their shape."""

import sys
import unittest
from pathlib import Path

try:
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

import synthetic_result  # noqa: E402
from bipot.along import (  # noqa: E402
    CORNERS,
    MONOMIALS,
    natural_coordinates,
    node_places,
    shape_functions,
    shape_gradients,
)
from bipot.errors import ResultError  # noqa: E402
from bipot.result import Result  # noqa: E402
from package import WithFolder  # noqa: E402

# Points inside each cell, in its natural coordinates.
INSIDE = np.array([(0.2, 0.3, 0.1), (0.05, 0.6, 0.25), (0.5, 0.1, 0.3)])


def straight(natural, size):
    """Return places (n, 3) in a cell with straight edges: a pyramid's get narrow to its apex."""
    if size in CORNERS:
        return natural
    return natural * np.concatenate([natural[:, 2:]] * 2 + [np.ones((len(natural), 1))], axis=1)


class ShapeFunctions(unittest.TestCase):
    """They interpolate, and represent what they should."""

    def test_one_at_the_node_of_each(self):
        for size in MONOMIALS:
            np.testing.assert_allclose(
                shape_functions(node_places(size), size), np.eye(size), atol=1e-12)

    def test_polynomials(self):
        """Linear ones of first order, quadratic ones of second order are represented."""
        rng = np.random.default_rng(1)
        for size in MONOMIALS:
            order = 2 if size in (10, 13, 15, 20) else 1
            powers = np.array([e for e in np.ndindex(3, 3, 3) if sum(e) <= order])
            factors = rng.normal(size=len(powers))

            def polynomial(natural, powers=powers, factors=factors, size=size):
                places = straight(natural, size)
                return (places[:, None] ** powers).prod(axis=2) @ factors

            found = shape_functions(INSIDE, size) @ polynomial(node_places(size))
            np.testing.assert_allclose(found, polynomial(INSIDE), rtol=1e-11)

    def test_gradients_are_derivatives(self):
        for size in MONOMIALS:
            for k in range(3):
                step = 1e-5 * (np.arange(3) == k)
                slope = (shape_functions(INSIDE + step, size)
                         - shape_functions(INSIDE - step, size)) / 2e-5
                np.testing.assert_allclose(shape_gradients(INSIDE, size)[:, :, k], slope, atol=1e-9)

    def test_places_are_found_in_distorted_elements(self):
        rng = np.random.default_rng(2)
        for size in (*CORNERS, 13):
            moved = (0.08 if size in CORNERS else 0.04) * rng.normal(size=(size, 3))
            corners = straight(node_places(size), size) + moved
            for natural in INSIDE:
                point = shape_functions(natural[None], size)[0] @ corners
                found, outside = natural_coordinates(corners[None], point)
                np.testing.assert_allclose(found[0], natural, atol=1e-9)
                self.assertEqual(outside[0], 0.0)
            _, outside = natural_coordinates(corners[None], np.array([5.0, 5.0, 5.0]))
            self.assertGreater(outside[0], 0.1)


class Along(WithFolder):
    """A path through two cubes, whose fields are linear."""

    def setUp(self):
        super().setUp()
        path = self.folder / "small.vtkhdf"
        synthetic_result.write(path, stress_on=("Cell", "Point"))
        self.result = Result(path)
        self.addCleanup(self.result.close)

    def test_fields(self):
        path = self.result.along([(0, 0.5, 0.1), (2, 0.5, 0.9), (2, 0.5, 0.5)], 13)
        np.testing.assert_allclose(path.distance[-1], np.hypot(2, 0.8) + 0.4)
        height = path.points[:, 2]
        moved = path.field("displacement")
        np.testing.assert_allclose(moved[:, 0], 0.03 * height, atol=1e-14)
        np.testing.assert_allclose(moved[:, 2], -0.03 * height, atol=1e-14)
        np.testing.assert_allclose(path.field("displacement", 0)[:, 2], -0.01 * height, atol=1e-14)
        np.testing.assert_allclose(path.field("stress", on="elements")[:, 2], -30.0)
        np.testing.assert_allclose(path.field("stress", on="nodes")[:, 2], -60.0)
        sides = self.result.points[self.result.elements[path.element]].mean(axis=1)[:, 0]
        self.assertTrue((np.abs(sides - path.points[:, 0]) <= 0.5 + 1e-9).all())

    def test_what_is_outside_has_no_value(self):
        path = self.result.along([(-1, 0.5, 0.5), (3, 0.5, 0.5)], 5)
        np.testing.assert_array_equal(path.element >= 0, [False, True, True, True, False])
        np.testing.assert_array_equal(np.isnan(path.field("displacement")[:, 0]), path.element < 0)
        np.testing.assert_array_equal(path.table()["element"] == 0, path.element < 0)
        with self.assertRaisesRegex(ResultError, "no element has a point of this path"):
            self.result.along([(0, 0, 7), (1, 0, 7)], 5)
        for wrong in ([(0, 0, 0)], [(0, 0), (1, 1)], [(0, 0, 0), (np.nan, 0, 0)]):
            with self.assertRaisesRegex(ValueError, "two or more points of three coordinates"):
                self.result.along(wrong)
        with self.assertRaisesRegex(ValueError, "no length"):
            self.result.along([(0, 0, 0), (0, 0, 0)], 3)

    def test_elements_that_the_path_sees(self):
        path = self.result.along([(0.5, 0.5, 0.5), (1.5, 0.5, 0.5)], elements=[1])
        np.testing.assert_array_equal(path.element, [-1, 1])

    def test_tables(self):
        path = self.result.along([(0, 0.5, 0), (2, 0.5, 0)], 3)
        table = path.table()
        self.assertEqual(list(table)[:6], ["distance", "x", "y", "z", "element", "displacement_x"])
        np.testing.assert_allclose(table["distance"], [0, 1, 2])
        path.to_csv(self.folder / "along.csv")
        lines = (self.folder / "along.csv").read_text().splitlines()
        self.assertEqual(lines[0], ",".join(table))
        np.testing.assert_allclose(
            np.loadtxt(lines[1:], delimiter=","), np.stack(list(table.values()), axis=1), rtol=1e-8)


if __name__ == "__main__":
    unittest.main()
