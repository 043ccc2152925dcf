"""Fields at Gauss points, type by type: where the points are, what a mixed mesh has, tables."""

import csv
import itertools
import subprocess
import unittest

import h5py
import numpy as np
from boxes import CORNERS, EDGES, MATERIAL, Box
from program import PROGRAM, Run

from bipot.errors import ResultError

FIELDS = "*EL FILE, POSITION=CENTROIDAL\nS, E, MISES, SP\n*EL FILE, POSITION=INTEGRATION POINTS\n"
POINTS = {"C3D8": 8, "C3D10": 4, "C3D13": 18, "C3D15": 18, "C3D20": 27, "C3D20R": 8,
          "C3D20R_14": 14, "C3D4": 8, "C3D6": 8}
# The nodes of a pyramid as of_cone gives them.
CONE = np.array([
    (-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (0, 0, 0), (0, -1, -1), (1, 0, -1),
    (0, 1, -1), (-1, 0, -1), (-1, -1, -0.5), (1, -1, -0.5), (1, 1, -0.5), (-1, 1, -0.5),
])


def clamped(box, cards=FIELDS):
    """Return the deck of a box that is clamped at its foot and sheared and twisted at its head."""
    moved = "".join(
        f"{node}, 1, 1, {0.01 * (1 + y)!r}\n{node}, 2, 2, {0.02 * x * x!r}\n"
        for node in box.side(2, 1) for x, y, _ in [box.x[node - box.first].tolist()]
    )
    return (
        box.cards() + MATERIAL + "*BOUNDARY\nB-Z0, 1, 3\n*STEP\n*STATIC, DIRECT\n0.5, 1.\n"
        + f"*BOUNDARY\n{moved}{cards}*END STEP\n"
    )


def of_cone(natural):
    """Return places (n, 3) of a pyramid by how far they are across it, and -1 to 0 to its apex."""
    down = 1 - natural[:, 2:]
    return np.concatenate([natural[:, :2] / down, -down], axis=1)


def powers(kind):
    """Return the exponents (n, 3) of the monomials that a cell's shape functions consist of."""
    every = np.array(list(itertools.product(range(3), repeat=3)))
    if kind == "C3D10":
        return every[every.sum(axis=1) <= 2]
    if kind == "C3D15":
        flat, z = every[:, :2].sum(axis=1), every[:, 2]
        return every[(flat <= 2) & ((z < 2) | (flat < 2))]
    if kind == "C3D8":
        return every[every.max(axis=1) < 2]
    if kind == "C3D13":
        flat, z = np.where(every > 1, every, 0)[:, :2].sum(axis=1), every[:, 2]
        return every[(every.sum(axis=1) == 0) | ((z > 0) & (flat <= 2 * (z - 1)))]
    # No power above the first but of one coordinate, squared.
    return every[(np.where(every > 1, every, 0).sum(axis=1) <= 2)]


def places(kind):
    """Return the natural coordinates of the nodes of a cell."""
    if kind == "C3D13":
        return CONE
    corners = {
        "C3D10": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        "C3D15": [(r, s, t) for t in (-1, 1) for r, s in ((0, 0), (1, 0), (0, 1))],
    }.get(kind, [tuple(2 * c - 1 for c in corner) for corner in CORNERS])
    corners = np.array(corners, float)
    if kind not in EDGES:
        return corners
    middles = [corners[list(edge)].mean(axis=0) for edge in EDGES[kind][1]]
    return np.concatenate([corners, middles])


def gradients(kind, at):
    """Return the derivatives (points, nodes, 3) of the shape functions, by their monomials."""
    exponents = powers(kind)
    values = np.prod(places(kind)[:, None] ** exponents, axis=2)
    inverse = np.linalg.inv(values)
    found = []
    for axis in range(3):
        lower = exponents.copy()
        lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
        slope = exponents[:, axis] * np.prod(at[:, None] ** lower, axis=2)
        found.append(slope @ inverse)
    return np.stack(found, axis=2)


class GaussPoints(unittest.TestCase):
    def solve(self, deck):
        """Return the run of a deck and its result."""
        run = Run(deck, name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        return run, result

    def test_strains_are_those_of_the_shape_functions_at_the_points_named(self):
        for kind in ("C3D8", "C3D10", "C3D13", "C3D15", "C3D20", "C3D20R"):
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 2), (kind,))
                _, result = self.solve(clamped(box))
                self.assertEqual(result.gauss_types, [kind])
                ids = [element for element, *_ in box.elements[kind]]
                rows = result.gauss_elements()
                np.testing.assert_array_equal(result.element_ids[rows], ids)
                natural = result.gauss_coordinates(kind)
                self.assertEqual(natural.shape, (POINTS[kind], 3))
                natural = of_cone(natural) if kind == "C3D13" else natural
                nodes = np.array([cell for _, *cell in box.elements[kind]]) - box.first
                derivative = gradients(kind, natural)
                u = result.field("displacement")[nodes]
                jacobian = np.einsum("eni,gnj->egij", box.x[nodes], derivative)
                slope = np.einsum("eni,gnj->egij", u, derivative) @ np.linalg.inv(jacobian)
                strain = (slope + slope.swapaxes(2, 3))[..., [0, 1, 2, 0, 1, 0],
                                                        [0, 1, 2, 1, 2, 2]] / 2
                found = result.field("strain", on="gauss points")
                self.assertEqual(found.shape, (len(ids), POINTS[kind], 6))
                np.testing.assert_allclose(found, strain, rtol=0, atol=1e-13)
                # Every increment has its row.
                first = result.field("strain", 0, on="gauss points")
                np.testing.assert_allclose(first, strain / 2, rtol=0, atol=1e-12)

    def test_types_of_a_mixed_mesh_stand_apart(self):
        for kinds in (("C3D8", "C3D6"), ("C3D20", "C3D15"), ("C3D20R", "C3D15")):
            with self.subTest(kinds=kinds):
                box = Box("B", (2, 2, 2), kinds)
                _, result = self.solve(clamped(box))
                self.assertEqual(set(result.gauss_types), set(kinds))
                mean = result.field("stress", on="elements")
                for kind in kinds:
                    rows = result.gauss_elements(kind)
                    ids = [element for element, *_ in box.elements[kind]]
                    np.testing.assert_array_equal(result.element_ids[rows], ids)
                    stress = result.field("stress", on="gauss points", type=kind)
                    self.assertEqual(stress.shape, (len(rows), POINTS[kind], 6))
                    # Means are within what there is at the points.
                    self.assertTrue((stress.min(axis=1) <= mean[rows] + 1e-9).all())
                    self.assertTrue((stress.max(axis=1) >= mean[rows] - 1e-9).all())
                    mises = result.field("von_mises", on="gauss points", type=kind)
                    principal = result.field("principal_stress", on="gauss points", type=kind)
                    a, b, c = np.moveaxis(principal, 2, 0)
                    np.testing.assert_allclose(
                        mises**2, ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2, rtol=1e-9
                    )
                with self.assertRaisesRegex(ResultError, "say type=...; it has C3D"):
                    result.field("stress", on="gauss points")

    def test_tables_have_as_many_points_as_each_element_has(self):
        """A chain of C3D20R has 14 points."""
        for kinds in (("C3D10",), ("C3D20", "C3D15"), ("C3D20R",)):
            with self.subTest(kinds=kinds):
                box = Box("B", (2, 1, 1), kinds)
                cards = FIELDS + "*EL PRINT, ELSET=B\nS, MISES\n"
                run, result = self.solve(clamped(box, cards))
                with (run.folder / "deck.element.csv").open(newline="") as file:
                    lines = list(csv.DictReader(file))
                types = {name.split("_")[0]: name for name in result.gauss_types}
                if kinds == ("C3D20R",):
                    self.assertEqual(types, {"C3D20R": "C3D20R_14"})
                count = sum(POINTS[types[kind]] * len(box.elements[kind]) for kind in types)
                self.assertEqual(len(lines), 2 * count)
                last = {
                    (int(line["element"]), int(line["point"])): line for line in lines[count:]
                }
                for kind, name in types.items():
                    stress = result.field("stress", on="gauss points", type=name)
                    for i, (element, *_) in enumerate(box.elements[kind]):
                        for point in range(POINTS[name]):
                            line = last[element, point + 1]
                            self.assertEqual(float(line["stress XX [pressure]"]),
                                             stress[i, point, 0])
                            self.assertEqual(float(line["stress XZ [pressure]"]),
                                             stress[i, point, 5])

    def test_a_continued_run_has_them(self):
        run = Run(clamped(Box("B", (2, 2, 2), ("C3D20", "C3D15"))), name="deck")
        with run.result() as result:
            before = {kind: result.field("stress", on="gauss points", type=kind)
                      for kind in result.gauss_types}
        with h5py.File(run.file, "r+") as file:
            file["run"].attrs.modify("status", b"running")
        done = subprocess.run([PROGRAM, run.deck, "--continue"], cwd=run.folder,
                              capture_output=True, text=True, timeout=60, check=False)  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stderr)
        with run.result() as result:
            self.assertIn("continued", result.run)
            for kind, stress in before.items():
                np.testing.assert_array_equal(
                    result.field("stress", on="gauss points", type=kind), stress
                )
        # Damage of what was written is noticed.
        with h5py.File(run.file, "r+") as file:
            file["run"].attrs.modify("status", b"running")
            file["gauss/C3D15/stress"][0, 0, 0, 0] += 1
        done = subprocess.run([PROGRAM, run.deck, "--continue"], cwd=run.folder,
                              capture_output=True, text=True, timeout=60, check=False)  # fmt: skip
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("damaged: increment 1 of 2 is not what was written", done.stderr)


if __name__ == "__main__":
    unittest.main()
