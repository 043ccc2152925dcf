"""Small strain is linear: the same scene under a load that is any number of times as small has
reactions that are as many times as small, in meshes along the axes and across them."""

import unittest

import numpy as np
from program import Run

MATERIAL = """*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*DENSITY
7.85e-9
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
"""
LOW = ((0.0, 0.0, 0.0), (3.0, 3.0, 1.0), (3, 3, 2))  # corner, size, elements
UP = ((0.5, 0.5, 1.0), (2.0, 2.0, 1.0), (2, 2, 2))
WEIGHT = 7.85e-9 * 9810.0 * 4.0  # of the upper block [N]


def turn(angle):
    """Return a rotation about (1, 2, 2)/3."""
    x, y, z = np.array([1.0, 2.0, 2.0]) / 3.0
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def block(name, box, first, rotation, digits):
    """Return a block of C3D8, its layers of nodes and of elements at both ends as sets."""
    corner, size, n = (np.array(x) for x in box)
    ids = {}
    lines = [f"*NODE, NSET={name}\n"]
    for k in range(n[2] + 1):
        for j in range(n[1] + 1):
            for i in range(n[0] + 1):
                ids[i, j, k] = first + len(ids)
                place = rotation @ (corner + size * np.array([i, j, k]) / n)
                words = ", ".join(f"{x:.{digits}g}" for x in place)
                lines.append(f"{ids[i, j, k]}, {words}\n")
    lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}\n")
    elements = {"BOTTOM": [], "TOP": []}
    number = first
    for k in range(n[2]):
        for j in range(n[1]):
            for i in range(n[0]):
                square = ((0, 0), (1, 0), (1, 1), (0, 1))
                nodes = [ids[i + a, j + b, k + c] for c in (0, 1) for a, b in square]
                lines.append(", ".join(str(x) for x in [number, *nodes]) + "\n")
                if k == 0:
                    elements["BOTTOM"].append(f"{number}, S1\n")
                if k == n[2] - 1:
                    elements["TOP"].append(f"{number}, S2\n")
                number += 1
    for end, faces in elements.items():
        lines.append(f"*SURFACE, NAME={name}-{end}\n" + "".join(faces))
    ground = [ids[i, j, 0] for i in range(n[0] + 1) for j in range(n[1] + 1)]
    lines.append(f"*NSET, NSET={name}-GROUND\n" + "".join(f"{x},\n" for x in ground))
    lines.append(f"*SOLID SECTION, ELSET={name}, MATERIAL=STEEL\n")
    return "".join(lines)


def scene(gravity, rotation=None, digits=17, nlgeom=""):
    """Return a block that stands on another by its weight alone, both turned."""
    rotation = np.eye(3) if rotation is None else rotation
    down = ", ".join(f"{x:.17g}" for x in -rotation[:, 2])
    return (
        MATERIAL
        + block("LOW", LOW, 1, rotation, digits)
        + block("UP", UP, 1001, rotation, digits)
        + "*CONTACT PAIR, INTERACTION=DRY\nUP-BOTTOM, LOW-TOP\n*BOUNDARY\nLOW-GROUND, 1, 3\n"
        + f"*STEP{nlgeom}\n*STATIC\n*DLOAD\nUP, GRAV, {gravity!r}, {down}\n"
        + f"LOW, GRAV, {gravity!r}, {down}\n*END STEP\n"
    )


class SmallLoads(unittest.TestCase):
    def solve(self, deck, halves=False):
        """Return the reactions of the points beside the weight that they carry, and it.

        The increment may be halved where that is said.
        """
        run = Run(deck, name="small")
        self.assertEqual(run.status, 0, run.output + run.errors)
        if not halves:
            self.assertNotIn("did not converge", run.output)
        with run.result() as result:
            self.assertTrue(result.certified)
            pair = result.pairs[0]
            return pair.reaction[-1], np.linalg.norm(pair.resultant[-1])

    def test_any_load(self):
        """Along the axes: reactions are proportional to the load, down to 1e-25 of it."""
        expected, weight = self.solve(scene(9810.0e3))
        self.assertAlmostEqual(weight / (1e3 * WEIGHT), 1.0, 7)
        for part in (1e-3, 1e-6, 1e-25):
            found, _ = self.solve(scene(9810.0e3 * part))
            np.testing.assert_allclose(found / part, expected, atol=1e-6 * weight)

    def test_across_the_axes(self):
        """Turned, with all digits: rounding of places is no gap, and no error of the forces."""
        for part in (1.0, 1e-9):
            rotation = turn(0.7)
            expected, weight = self.solve(scene(9810.0e3, rotation))
            found, _ = self.solve(scene(9810.0e3 * part, rotation))
            np.testing.assert_allclose(found / part, expected, atol=1e-6 * weight)

    def test_twelve_digits(self):
        """Gaps of 1e-12 stay: few points press, and carry the whole weight."""
        for nlgeom in ("", ", NLGEOM=YES"):
            for part in (1.0, 1e-6):
                # On gaps of rounding two points carry the lightest one, and it all but tips.
                deck = scene(9810.0 * part, turn(0.7), 12, nlgeom)
                _, weight = self.solve(deck, halves=nlgeom != "" and part < 1)
                self.assertAlmostEqual(weight / (part * WEIGHT), 1.0, 6)


class RoundObstacles(unittest.TestCase):
    def test_in_a_hollow_sphere(self):
        """The lower corners of a box touch, as far as a radius is known, and share any load."""
        text = f"""*BLOCK, NAME=B, NX=2, NY=2, NZ=2
-2., -1., -1., 4., 2., 2.
*SOLID SECTION, ELSET=B, MATERIAL=STEEL
*OBSTACLE, NAME=SHELL, TYPE=SPHERE, INNER
0., 0., 0.5, {np.sqrt(7.25)!r}
*CONTACT PAIR, INTERACTION=DRY
B-ZMIN, SHELL
*BOUNDARY
B-ZMAX, 1, 2
*STEP
*STATIC
*DSLOAD
B-ZMAX, P, PRESSURE
*END STEP
"""
        for pressure in (1e-3, 1e-9, 1e-30):
            run = Run(MATERIAL + text.replace("PRESSURE", repr(pressure)), name="shell")
            self.assertEqual(run.status, 0, run.output + run.errors)
            with run.result() as result:
                self.assertTrue(result.certified)
                pair = result.pairs[0]
                normal = pair.reaction[-1][:, 0] / (8.0 * pressure)
                self.assertAlmostEqual(pair.resultant[-1, 2] / (8.0 * pressure), 1.0, 7)
            self.assertEqual(np.count_nonzero(normal), 4)
            np.testing.assert_allclose(normal[normal > 0], normal.max(), rtol=1e-6)


if __name__ == "__main__":
    unittest.main()
