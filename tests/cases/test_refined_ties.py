"""Nodes that hang on the slave side of a tie: a uniform stress goes through, and bodies turn."""

import unittest

import numpy as np
from program import Run

from studies.extremes.type_scenes import box, material, step  # found through program

HELD = "*BOUNDARY\nB-X0, 1, 1\nB-Y0, 2, 2\nL-X0, 1, 1\nL-Y0, 2, 2\nL-Z0, 3, 3\n"
PRESSED = "*DSLOAD\nB-Z1-F, P, 1.\n*EL FILE, POSITION=AVERAGED AT NODES\nS\n"
IN_A_CELL = {"C3D8": 1, "C3D8I": 1, "C3D6": 2, "C3D4": 6}


def cut(kind, *cells):
    """Return cards that cut the elements of some cells of the upper box, numbered from 0."""
    n = IN_A_CELL[kind]
    ids = [str(n * cell + k + 1) for cell in cells for k in range(n)]
    return "*ELSET, ELSET=CUT\n" + "\n".join(ids) + "\n*REFINE, ELSET=CUT\n"


def bent(weight):
    """Return a map of the unit cube that bends one of its sides along z."""
    def move(x):
        y = x.copy()
        y[:, 2] += 0.15 * x[:, 0] ** 2 * weight(x[:, 2])
        return y

    return move


def tied(upper, lower, refine, step_cards, *, shift=0.0, is_bent=False):
    """Return two boxes, the upper one the slave; a shift along x leaves part of it uncovered."""
    low, up = (bent(lambda z: z), bent(lambda z: 1 - z)) if is_bent else (None, None)
    return (
        box("L", lower, (3, 3, 1), (0.0, 0.0, -1.0), first=100001, bent=low)
        + box("B", upper, (4, 4, 1), (shift, 0.0, 0.0), bent=up)
        + refine + material("L") + material("B")
        + "*TIE, NAME=GLUE\nB-Z0-F, L-Z1-F\n" + step(step_cards)
    )  # fmt: skip


class RefinedTies(unittest.TestCase):
    def solved(self, text):
        run = Run(text, name="tied")
        self.assertEqual(run.status, 0, run.errors)
        return run.result()

    def test_uniform_stress(self):
        for upper, lower in (("C3D8", "C3D8"), ("C3D8I", "C3D10"), ("C3D4", "C3D8"),
                             ("C3D6", "C3D20")):  # fmt: skip
            for cells in ((5,), (0, 13), (4, 8, 9)):
                with (
                    self.subTest(upper=upper, lower=lower, cells=cells),
                    self.solved(tied(upper, lower, cut(upper, *cells), HELD + PRESSED)) as result,
                ):
                    stress = result.field("stress", -1, on="nodes")
                    np.testing.assert_allclose(
                        stress, [[0, 0, -1, 0, 0, 0]] * len(stress), rtol=0, atol=1e-11
                    )

    def test_bodies_turn_without_strain(self):
        """The lower body is turned a little: flat, bent, and with part of the slave uncovered."""
        turned = "*BOUNDARY\n" + "".join(
            f"{node}, 1, 1, {-1e-3 * z!r}\n{node}, 2, 2, 0.\n{node}, 3, 3, {1e-3 * x!r}\n"
            for node, x, z in lower_nodes()
        )
        for upper, options in (("C3D8", {"shift": 0.3}), ("C3D8", {"is_bent": True}),
                               ("C3D4", {"is_bent": True})):  # fmt: skip
            text = tied(upper, "C3D8", cut(upper, 5, 14), turned, **options)
            with self.subTest(upper=upper, options=options), self.solved(text) as result:
                x, u = result.points, result.field("displacement", -1)
                exact = 1e-3 * np.stack([-x[:, 2], 0 * x[:, 0], x[:, 0]], axis=1)
                np.testing.assert_allclose(u, exact, rtol=0, atol=1e-14)


def lower_nodes():
    """Return the numbers, x and z of the lower body's lowest nodes."""
    from studies.solid_meshes import SolidMesh

    grid = np.arange(4) / 3
    mesh = SolidMesh("L", "C3D8", (grid, grid, [-1.0, 0.0]), 100001)
    return [(100001 + int(row), *map(float, mesh.x[row, [0, 2]])) for row in mesh.nodes(2, 0)]


if __name__ == "__main__":
    unittest.main()
