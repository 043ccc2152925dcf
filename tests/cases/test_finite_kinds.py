"""Elements at finite strain: C3D8I with transposed modes, C3D8B by mean dilatation."""

import unittest

import numpy as np
from meshes import grid
from program import Run

NEO = "*HYPERELASTIC, NEO HOOKE\n{c10!r}, {d1!r}"


class Bending(unittest.TestCase):
    """Large bending, and Cook's membrane, of literature and of the program in ../shared."""

    def test_elastica(self):
        """A cantilever of length 10 under P L^2/EI = 4: the elastica's deflection is 0.6700 L."""
        young, length = 1000.0, 10
        deck = f"""\
*PARAMETER
element = C3D8I
*BLOCK, NAME=B, ELSET=B, TYPE=<element>, NX=10, NY=1, NZ=1
0., 0., 0., {length}., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
{young}, 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.1, 1.
*BOUNDARY
B-XMIN, 1, 3
*CLOAD
B-XMAX, 3, {4 * young / 12 / length**2 / 4!r}
*END STEP
"""
        found = {}
        for kind in ("C3D8", "C3D8B", "C3D8I"):
            run = Run(deck, name="elastica", element=kind)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                u = result.field("displacement", -1)
                tip = np.abs(result.points[:, 0] - length) < 1e-9
                found[kind] = u[tip].mean(axis=0) / length
        # The elastica, and ../shared's program: w/L .568, .711, .6699.
        self.assertAlmostEqual(found["C3D8I"][2], 0.66996, delta=5e-4)
        self.assertAlmostEqual(found["C3D8I"][0], -0.32894, delta=2e-3)
        self.assertAlmostEqual(found["C3D8"][2], 0.568, delta=6e-4)
        self.assertAlmostEqual(found["C3D8B"][2], 0.711, delta=6e-4)

    def cook(self, n, force, law, increment, expected):
        """Run Cook's membrane in plane strain; `expected`: how far the upper corner goes."""

        def shape(at):
            x, y, z = at
            return 48 * x, 44 * x + y * (44 - 28 * x), z

        mesh, index, places = grid("ALL", (n, n, 1), shape)
        loads = []
        for j, nodes in enumerate(index[-1]):
            part = force / n / 2 / (2 if j in (0, n) else 1)
            loads += [f"{node}, 2, {part!r}" for node in nodes]
        held = "\n".join(f"{node}, 1, 2" for node in index[0].ravel())
        deck = f"""\
*PARAMETER
element = C3D8I
{mesh}*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
{increment}, 1.
*BOUNDARY
{held}
ALL, 3, 3
*CLOAD
{chr(10).join(loads)}
*END STEP
"""
        for kind, goal in zip(("C3D8", "C3D8B", "C3D8I"), expected, strict=True):
            run = Run(deck, name="cook", element=kind)
            self.assertEqual(run.status, 0, (kind, run.errors))
            with run.result() as result:
                at = result.nearest_node(places[index[-1, -1, 0]])
                found = result.field("displacement", -1)[at, 1]
            self.assertAlmostEqual(found, goal, delta=0.6 * 10.0 ** -(len(str(goal)) - 2), msg=kind)

    def test_cook(self):
        """To the digits that ../shared's program has."""
        young = 240.565
        law = NEO.format(c10=young / 5.2, d1=2.4 / young)
        self.cook(8, 16.0, law, 0.25, (1.336, 1.401, 1.445))

    def test_nearly_incompressible_cook(self):
        """Bulk modulus 5000 times the shear modulus: C3D8 locks."""
        law = NEO.format(c10=80.194 / 2, d1=2 / 400889.8)
        self.cook(2, 100.0, law, 0.1, (2.11, 4.51, 5.72))


class Patch(unittest.TestCase):
    """Any gradient of the displacement, the same everywhere, of distorted elements."""

    def test_one_gradient(self):
        rng = np.random.default_rng(3)

        def shape(at):
            inner = np.all((at > 0) & (at < 1))
            return at + inner * rng.uniform(-0.12, 0.12, 3)

        gradient = np.array([[0.2, 0.3, -0.2], [-0.3, -0.15, 0.2], [0.2, -0.3, 0.1]])
        mesh, _, places = grid("ALL", (3, 3, 3), shape)
        rim = [n for n, x in places.items() if np.any((x < 1e-9) | (x > 1 - 1e-9))]
        moved = "\n".join(
            f"{n}, {i + 1}, {i + 1}, {float(gradient[i] @ places[n])!r}"
            for n in rim
            for i in range(3)
        )
        for kind in ("C3D8", "C3D8B", "C3D8I"):
            for law in ("*ELASTIC\n100., 0.3", NEO.format(c10=20.0, d1=2e-2)):
                deck = f"""\
*PARAMETER
element = {kind}
{mesh}*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.25, 1.
*EL FILE
S
*BOUNDARY
{moved}
*END STEP
"""
                run = Run(deck, name="patch")
                self.assertEqual(run.status, 0, (kind, run.errors))
                with run.result() as result:
                    expected = result.points @ gradient.T
                    found = result.field("displacement", -1)
                    stress = result.field("stress", -1)
                np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8, err_msg=kind)
                alike = stress[[0] * len(stress)]
                np.testing.assert_allclose(stress, alike, rtol=0, atol=1e-5 * abs(stress).max())


if __name__ == "__main__":
    unittest.main()
