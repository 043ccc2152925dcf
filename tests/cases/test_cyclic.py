"""*CYCLIC SYMMETRY MODEL: one sector of a ring against the whole ring."""

import unittest

import numpy as np
from program import Run

SECTORS, PARTS = 5, 2  # elements of a sector about the axis
UPRIGHT = np.eye(3)
RADII, LEVELS = np.array([0.0, 1.0, 1.6, 2.0]), np.array([0.0, 0.4, 1.0])


def deck(n_sectors, *, nlgeom="", axis=UPRIGHT, shift=0.0, hub=False):
    """Return a disk, or its sector, that is pressed on a floor and twisted by its rim.

    The sector has its own side nodes; with a hub it reaches the axis. `axis` has x, y, z in its
    columns.
    """
    radii = RADII if hub else RADII[1:]
    whole = n_sectors == SECTORS
    columns = SECTORS * PARTS if whole else PARTS + 1
    angles = 2 * np.pi / (SECTORS * PARTS) * np.arange(columns)
    number, lines, rim, sides = {}, [], [], ([], [])
    for k, z in enumerate(LEVELS):
        for i, radius in enumerate(radii):
            for j, angle in enumerate(angles):
                if radius == 0.0 and j > 0:
                    number[k, i, j] = number[k, i, 0]
                    if j == PARTS:
                        sides[1].append(number[k, i, j])
                    continue
                number[k, i, j] = len(number) + 1 + 1000 * k
                x = axis @ [radius * np.cos(angle), radius * np.sin(angle), z + shift]
                lines.append(f"{number[k, i, j]}, " + ", ".join(repr(float(c)) for c in x))
                if k == len(LEVELS) - 1 and i == len(radii) - 1:
                    # Half of a force is on each side of a sector.
                    part = 0.5 if not whole and j in (0, PARTS) else 1.0
                    force = axis @ (part * np.array(
                        [-0.4 * np.sin(angle), 0.4 * np.cos(angle), -3.0]))
                    rim += [f"{number[k, i, j]}, {c + 1}, {float(force[c])!r}" for c in range(3)]
                for side, at in zip(sides, (0, PARTS), strict=True):
                    if j == at:
                        side.append(number[k, i, j])
    elements = []
    for k in range(len(LEVELS) - 1):
        for i in range(len(radii) - 1):
            for j in range(columns if whole else PARTS):
                after = (j + 1) % columns
                corners = [number[k + c, a, b] for c in (0, 1)
                           for a, b in ((i, j), (i + 1, j), (i + 1, after), (i, after))]
                elements.append(", ".join(map(str, [len(elements) + 1, *corners])))
    bottom = sorted({number[0, i, j] for i in range(len(radii)) for j in range(columns)})
    normal = ", ".join(repr(float(c)) for c in axis[:, 2])
    text = "*NODE\n" + "\n".join(lines) + "\n*ELEMENT, TYPE=C3D8, ELSET=RING\n"
    text += "\n".join(elements) + "\n*NSET, NSET=LOW\n" + "\n".join(map(str, bottom))
    if not whole:
        for name, side in zip(("LEFT", "RIGHT"), sides, strict=True):
            text += f"\n*NSET, NSET={name}\n" + "\n".join(map(str, side))
        text += f"""
*TIE, NAME=SIDES, CYCLIC SYMMETRY
LEFT, RIGHT
*CYCLIC SYMMETRY MODEL, N={SECTORS}, TIE=SIDES
0., 0., 0., {normal}"""
    floor = ", ".join(repr(float(c)) for c in shift * axis[:, 2])
    return text + f"""
*MATERIAL, NAME=M
*ELASTIC
500., 0.3
*SOLID SECTION, ELSET=RING, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
{floor}, {normal}
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
LOW, FLOOR
*STEP{nlgeom}
*STATIC, DIRECT
0.5, 1.
*CLOAD
""" + "\n".join(rim) + "\n*END STEP\n"


class Sector(unittest.TestCase):
    def solved(self, text):
        run = Run(text, name="case")
        self.assertEqual(run.status, 0, run.errors)
        result = run.result()
        self.addCleanup(result.close)
        return result

    def check_sector(self, *, tolerance, axis=UPRIGHT, **options):
        """Displacements of the sector are those of the ring; forces are a part of its forces."""
        ring, sector = (self.solved(deck(n, axis=axis, **options)) for n in (SECTORS, 1))
        u, v = ring.field("displacement", -1), sector.field("displacement", -1)
        places = {tuple(np.round(x, 9) + 0.0): row for row, x in enumerate(ring.points)}
        rows = [places[tuple(np.round(x, 9) + 0.0)] for x in sector.points]
        np.testing.assert_allclose(v, u[rows], atol=tolerance * abs(u).max())
        along = axis[:, 2]
        forces = [result.pairs[0].resultant[-1] @ along for result in (ring, sector)]
        np.testing.assert_allclose(SECTORS * forces[1], forces[0], rtol=tolerance)
        status = [result.pairs[0].status[-1] for result in (ring, sector)]
        self.assertEqual({*np.unique(status[0])}, {*np.unique(status[1])})

    def test_a_ring_that_is_twisted_on_a_floor(self):
        self.check_sector(tolerance=1e-6)

    def test_a_disk_at_finite_strain_about_another_axis(self):
        axis = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        self.check_sector(tolerance=1e-6, nlgeom=", NLGEOM", axis=axis, shift=0.5, hub=True)

    def test_sides_are_held_beside_nodes_with_local_directions(self):
        """Both sides are held alike, and the middle along the circle, which is no axis of x, y."""
        middle = [i + 1000 * k for k, first in enumerate((1, 10, 19)) for i in range(
            first + 1, first + 9, 3)]
        held = f"""*NSET, NSET=MIDDLE
{", ".join(map(str, middle))}
*TRANSFORM, NSET=MIDDLE, TYPE=C
0., 0., 0.,  0., 0., 1.
*BOUNDARY
LEFT, 1, 2
RIGHT, 1, 2
MIDDLE, 2, 2
*STEP"""
        result = self.solved(deck(1).replace("*STEP", held))
        u, x = result.field("displacement", -1), result.points
        angle = np.arctan2(x[:, 1], x[:, 0])
        along = u[:, 1] * np.cos(angle) - u[:, 0] * np.sin(angle)
        self.assertLess(abs(along).max(), 1e-12)
        sides = abs(angle - np.pi / SECTORS) > 0.1
        self.assertLess(abs(u[sides, :2]).max(), 1e-12)
        self.assertGreater(abs(u[~sides, :2]).max(), 1e-4)

    def test_sides_are_held_along_directions_that_turn_with_them(self):
        """Held along the circle by one side or by both: the first follows the second."""
        found = []
        for nodes in ("RIGHT", "RIGHT, LEFT"):
            lines = f"*NSET, NSET=HELD\n{nodes}\n*TRANSFORM, NSET=HELD, TYPE=C\n"
            lines += "0., 0., 0., 0., 0., 1.\n*BOUNDARY\nHELD, 2, 2\n*STEP"
            result = self.solved(deck(1).replace("*STEP", lines))
            found.append((result.field("displacement", -1), result.pairs[0].resultant[-1]))
        for one, both in zip(*found, strict=True):
            np.testing.assert_allclose(both, one, atol=1e-12 * abs(one).max())

    def test_what_slides_past_a_side_is_told(self):
        """Plates of a quarter of a turn, moved along the circle by a part of the sector."""
        plates = "".join(
            f"*BLOCK, NAME={name}, NX=2, NY=2, NZ=1\n0., 0., {z}.,  1., 1., 1.\n"
            for z, name in enumerate(("LOW", "HIGH"))
        )
        text = plates + """*MATERIAL, NAME=M
*ELASTIC
500., 0.
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=HIGH, MATERIAL=M
*NSET, NSET=LEFT
LOW-XMIN, HIGH-XMIN
*NSET, NSET=RIGHT
LOW-YMIN, HIGH-YMIN
*TIE, NAME=SIDES, CYCLIC SYMMETRY
LEFT, RIGHT
*CYCLIC SYMMETRY MODEL, N=4, TIE=SIDES
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
HIGH-ZMIN, LOW-ZMAX
*STEP, NLGEOM
*STATIC, DIRECT
1., 1.
*BOUNDARY
LOW-ZMIN, 1, 3
HIGH-ZMAX, 3, 3, -0.001
"""
        for turn, told in ((0.001, False), (0.05, True)):
            moves = ""
            for j, i in np.ndindex(3, 3):  # nodes of the upper face
                x, y = i / 2, j / 2
                c, s = float(np.cos(turn)) - 1, float(np.sin(turn))
                u = (x * c - y * s, x * s + y * c)
                moves += "".join(f"{28 + i + 3 * j}, {a}, {a}, {u[a - 1]!r}\n" for a in (1, 2))
            run = Run(text + moves + "*END STEP\n", name="case")
            self.assertEqual(run.status, 0, run.errors)
            words = f"past the side of its sector by {200 * turn / np.pi:.2g} %"
            (self.assertIn if told else self.assertNotIn)(words, run.output)

    def test_bodies_that_touch_share_a_card(self):
        """A quarter of two plates, one on the other: each presses by 2 wherever it touches.

        On the sides nodes of both are in one place, and go with their own body.
        """
        result = self.solved("""*BLOCK, NAME=LOW, NX=2, NY=2, NZ=1
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=HIGH, NX=2, NY=2, NZ=1
0., 0., 1.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
500., 0.
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=HIGH, MATERIAL=M
*NSET, NSET=LEFT
LOW-XMIN, HIGH-XMIN
*NSET, NSET=RIGHT
LOW-YMIN, HIGH-YMIN
*TIE, NAME=SIDES, CYCLIC SYMMETRY
LEFT, RIGHT
*CYCLIC SYMMETRY MODEL, N=4, TIE=SIDES
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
HIGH-ZMIN, LOW-ZMAX
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
LOW-ZMIN, 1, 3
*DSLOAD
HIGH-ZMAX, P, 2.
*END STEP
""")
        u, x = result.field("displacement", -1), result.points
        np.testing.assert_allclose(result.pairs[0].resultant[-1], [0.0, 0.0, 2.0], atol=1e-6)
        np.testing.assert_allclose(u[:, 2], -2.0 / 500.0 * x[:, 2], atol=1e-8)


if __name__ == "__main__":
    unittest.main()
