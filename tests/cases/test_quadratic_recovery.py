"""The estimated error of elements of second order beside the true one."""

import itertools
import unittest

import numpy as np
from boxes import MATERIAL, POISSON, YOUNG, Box
from program import Run
from test_gauss_points import gradients, places, powers

SHEAR = YOUNG / 2 / (1 + POISSON)
LAME = 2 * SHEAR * POISSON / (1 - 2 * POISSON)
SMALL = 1e-3


def smooth(x):
    """Return the gradient of a harmonic function: a displacement without forces in the body."""
    a, b, c = np.array([[1, 2, 2], [2, 1, -2], [2, -2, 1]]) / 3
    k = 1.5
    s, t, w = x @ a, x @ b, x @ c
    return SMALL * k * (
        np.exp(k * s)[:, None] * (np.sin(k * t)[:, None] * a + np.cos(k * t)[:, None] * b)
        + np.exp(k * t)[:, None] * (np.sin(k * w)[:, None] * b + np.cos(k * w)[:, None] * c)
    )


def bent(x):
    """Return the displacement of pure bending about y."""
    x, y, z = x.T
    along = -x * z
    up = (x**2 + POISSON * (z**2 - y**2)) / 2
    return SMALL * np.stack([along, POISSON * y * z, up], axis=1)


def strain_of(displacement, x, h=1e-5):
    """Return the strain of a displacement at places, by differences: (n, 3, 3)."""
    slope = np.stack(
        [(displacement(x + h * e) - displacement(x - h * e)) / 2 / h for e in np.eye(3)], axis=-1
    )
    return (slope + slope.swapaxes(1, 2)) / 2


def quadrature(kind):
    """Return 125 points in a cell and their weights."""
    g, w = np.polynomial.legendre.leggauss(5)
    point = np.array(list(itertools.product(g, repeat=3)))
    weight = np.prod(list(itertools.product(w, repeat=3)), axis=1)
    a, b, c = ((point + 1) / 2).T
    if kind == "C3D15":
        return np.stack([a * (1 - b), b, point[:, 2]], axis=1), weight / 4 * (1 - b)
    if kind == "C3D13":
        return np.stack([point[:, 0], point[:, 1], c - 1], axis=1), weight / 2
    if kind == "C3D10":
        inside = np.stack([a * (1 - b) * (1 - c), b * (1 - c), c], axis=1)
        return inside, weight / 8 * (1 - b) * (1 - c) ** 2
    return point, weight


class QuadraticRecovery(unittest.TestCase):
    def solve(self, box, displacement):
        """Move the surface of a box; return displacements, errors, and the estimate over all."""
        surface = (abs(box.x - box.low - box.size / 2) > box.size / 2 - 1e-9).any(axis=1)
        moved = "".join(
            f"{box.first + i}, {k + 1}, {k + 1}, {u!r}\n"
            for i, row in zip(
                np.flatnonzero(surface), displacement(box.x)[surface].tolist(), strict=True
            )
            for k, u in enumerate(row)
        )
        deck = (
            box.cards() + MATERIAL + "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n" + moved
            + "*EL FILE\nERR\n*END STEP\n"
        )
        run = Run(deck, name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        with run.result() as result:
            return (result.field("displacement"), result.field("mesh_error"),
                    result.history("error/mesh")[-1])

    def effectivity(self, kind, n):
        """Return the root of the estimated error over the true one, both squared in energy."""
        box = Box("B", (n, n, n), (kind,), shift=0.1)
        u, estimated, _ = self.solve(box, smooth)
        natural, weight = quadrature(kind)
        at_nodes = np.linalg.inv(np.prod(places(kind)[:, None] ** powers(kind), axis=2))
        shape = np.prod(natural[:, None] ** powers(kind), axis=2) @ at_nodes
        derivative = gradients(kind, natural)
        nodes = np.array([cell for _, *cell in box.elements[kind]]) - box.first
        jacobian = np.einsum("eni,gnj->egij", box.x[nodes], derivative)
        slope = np.einsum("eni,gnj->egij", u[nodes], derivative) @ np.linalg.inv(jacobian)
        x = np.einsum("gn,eni->egi", shape, box.x[nodes])
        wrong = (slope + slope.swapaxes(2, 3)) / 2
        wrong -= strain_of(smooth, x.reshape(-1, 3)).reshape(wrong.shape)
        energy = LAME * np.trace(wrong, axis1=2, axis2=3) ** 2 + 2 * SHEAR * (wrong**2).sum((2, 3))
        return np.sqrt(estimated.sum() / (energy * np.linalg.det(jacobian) * weight).sum())

    def test_estimates_are_near_the_true_error_where_it_is_smooth(self):
        """Coarse meshes have few nodes inside: there it is on the safe side."""
        for kind, n, most in (
            ("C3D10", 3, 1.3), ("C3D10", 5, 1.15), ("C3D13", 3, 1.1), ("C3D15", 5, 1.3),
            ("C3D20", 5, 1.25), ("C3D20R", 5, 1.25),
        ):
            with self.subTest(kind=kind, n=n):
                found = self.effectivity(kind, n)
                self.assertGreater(found, 0.9)
                self.assertLess(found, most)

    def test_a_linear_stress_has_no_error(self):
        """In one layer, too, where no node is inside the body."""
        for kind, n in itertools.product(
            ("C3D10", "C3D13", "C3D15", "C3D20", "C3D20R"), ((4, 1, 1), (3, 2, 1), (2, 3, 2))
        ):
            with self.subTest(kind=kind, n=n):
                box = Box("B", n, (kind,), size=(4, 1, 1), shift=0.0)
                u, _, relative = self.solve(box, bent)
                np.testing.assert_allclose(u, bent(box.x), rtol=0, atol=1e-12)
                self.assertLess(relative, 1e-20)


if __name__ == "__main__":
    unittest.main()
