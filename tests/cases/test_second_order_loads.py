"""Couplings, loads and joints on elements of second order, against closed forms.

Boxes of tests/cases/boxes.py; all edges are straight.
"""

import unittest

import numpy as np
from boxes import MATERIAL, POISSON, STEP, YOUNG, Box, BoxCase

KINDS = ("C3D10", "C3D15", "C3D20", "C3D20R")
LENGTH, WIDTH, HEIGHT = 4.0, 0.6, 1.0
COUPLING = "*COUPLING, CONSTRAINT NAME={0}, REF NODE={1}, SURFACE={2}\n*DISTRIBUTING\n"
ENDS = (
    f"*NODE\n8001, -0.5, 0.1, 0.2\n8002, {LENGTH + 0.3}, 0.2, 0.7\n"
    + COUPLING.format("ROOT", 8001, "B-X0")
    + COUPLING.format("TIP", 8002, "B-X1")
)
def bar(kind, **options):
    """Return a bar along x."""
    return Box("B", (4, 2, 2), (kind,), size=(LENGTH, WIDTH, HEIGHT), shift=0, **options)


def held(box):
    """Return supports of three corners of the root that hold the bar, and nothing else."""
    low, side, up = (
        box.first + int(np.argmin(abs(box.x - place).sum(axis=1)))
        for place in ((0, 0, 0), (0, WIDTH, 0), (0, 0, HEIGHT))
    )
    return f"*BOUNDARY\n{low}, 1, 3\n{side}, 1\n{side}, 3\n{up}, 1\n"


class Bending(BoxCase):
    def test_moments_on_distributing_couplings_bend_a_bar_as_a_beam(self):
        """Both ends are grips: stress M z/I, a turn of M L/(E I), without end effects."""
        moment = np.array([0.0, 50.0, 30.0])
        second = np.array([1.0, WIDTH * HEIGHT**3 / 12, HEIGHT * WIDTH**3 / 12])
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = bar(kind)
                loads = "".join(
                    f"{node}, {3 + i}, {sign * moment[i - 1]}\n"
                    for node, sign in ((8001, -1), (8002, 1)) for i in (2, 3)
                )
                result = self.solve(
                    box.cards() + MATERIAL + ENDS + held(box) + STEP + "*CLOAD\n" + loads
                    + "*EL FILE, POSITION=AVERAGED AT NODES\nS\n*END STEP\n"
                )
                tip, root = (result.reference_nodes[node] for node in (8002, 8001))
                turn = moment * LENGTH / (YOUNG * second)
                np.testing.assert_allclose(
                    tip.rotation[-1] - root.rotation[-1], turn, rtol=0, atol=1e-9 * turn.max()
                )
                x, stress = result.points, result.field("stress", on="nodes")
                y, z = (x[:, [1, 2]] - [WIDTH / 2, HEIGHT / 2]).T
                exact = np.zeros_like(stress)
                exact[:, 0] = moment[1] * z / second[1] - moment[2] * y / second[2]
                np.testing.assert_allclose(stress, exact, rtol=0, atol=1e-8 * exact.max())


class LargeBending(BoxCase):
    def test_elastica(self):
        """A cantilever under P L^2/EI = 4 goes down by .6700 and back by .3289 of its length.

        Ten elements; the clamp holds Poisson's strain, and the bar has shear.
        """
        length, young = 10.0, 1000.0
        for kind in ("C3D10", "C3D20R"):
            with self.subTest(kind=kind):
                box = Box("B", (10, 1, 1), (kind,), size=(length, 1, 1), shift=0)
                result = self.solve(
                    box.cards() + f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{young}, 0.3\n"
                    + "*NODE\n8002, 10., 0.5, 0.5\n" + COUPLING.format("TIP", 8002, "B-X1")
                    + "1, 3\n*BOUNDARY\nB-X0, 1, 3\n*STEP, NLGEOM\n*STATIC\n0.1, 1.\n"
                    + f"*CLOAD\n8002, 3, {4 * young / 12 / length**2!r}\n*END STEP\n"
                )
                tip = result.reference_nodes[8002].displacement[-1] / length
                np.testing.assert_allclose(tip, [-0.3289, 0, 0.6700], rtol=0, atol=1.2e-3)


# The faces of elements as CalculiX and Abaqus number them, by their corners.
FACES = {
    "C3D10": ((1, 2, 3), (1, 4, 2), (2, 4, 3), (3, 4, 1)),
    "C3D15": ((1, 2, 3), (4, 6, 5), (1, 4, 5, 2), (2, 5, 6, 3), (3, 6, 4, 1)),
    "C3D20": ((1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)),
}
FACES["C3D20R"] = FACES["C3D20"]


def area_and_middle(corners):
    """Return the area vector of a flat face, of either direction, and its centroid."""
    parts = [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
    areas = [np.cross(b - a, c - a) / 2 for a, b, c in parts]
    size = [np.linalg.norm(area) for area in areas]
    middles = [sum(part) / 3 for part in parts]
    return sum(areas), np.average(middles, axis=0, weights=size)


class Loads(BoxCase):
    def check_load(self, result, force, place):
        """Supports balance a force at a place."""
        reaction = result.field("reaction_force")
        within = 1e-10 * abs(force).max()
        np.testing.assert_allclose(reaction.sum(axis=0), -force, rtol=0, atol=within)
        moment = np.cross(result.points - place, reaction).sum(axis=0)
        np.testing.assert_allclose(moment, 0, rtol=0, atol=1e-9 * abs(force).max())

    def test_pressures_on_each_face(self):
        """The corners are held; the load of face k is p times its area, at its centroid."""
        for kind, faces in FACES.items():
            box = Box("B", (1, 1, 1), (kind,), size=(2, 1.5, 1))
            element, *nodes = box.elements[kind][0]
            x = box.x[np.array(nodes) - box.first]
            inner = x[: max(map(max, faces))].mean(axis=0)
            corners = sorted({node for _, *all_nodes in box.elements[kind]
                              for node in all_nodes[: max(map(max, faces))]})
            held = "*NSET, NSET=CORNERS\n" + "\n".join(map(str, corners)) + "\n"
            for k, face in enumerate(faces):
                with self.subTest(kind=kind, face=k + 1):
                    result = self.solve(
                        box.cards() + held + MATERIAL + "*BOUNDARY\nCORNERS, 1, 3\n" + STEP
                        + f"*DLOAD\n{element}, P{k + 1}, 3.\n*END STEP\n"
                    )
                    area, middle = area_and_middle(x[np.array(face) - 1])
                    if area @ (middle - inner) > 0:
                        area = -area
                    self.check_load(result, 3.0 * area, middle)

    def test_weight(self):
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 2), (kind,), size=(2, 1.5, 1))
                result = self.solve(
                    box.cards() + MATERIAL + "*BOUNDARY\nB-X0, 1, 3\n" + STEP
                    + "*DLOAD\nB, GRAV, 9.81, 0.6, 0., -0.8\n*END STEP\n"
                )
                weight = 1000.0 * 3.0 * 9.81 * np.array([0.6, 0, -0.8])
                self.check_load(result, weight, np.array([1, 0.75, 0.5]))

    def test_free_expansion_is_without_stress(self):
        """In small and in finite strain, on elements out of place."""
        corner = "*BOUNDARY\nB-X0, 1\nB-Y0, 2\nB-Z0, 3\n"
        for kind in KINDS:
            for step, stretch in (("*STEP\n*STATIC\n", 1e-2),
                                  ("*STEP, NLGEOM\n*STATIC\n", 1e-2)):
                with self.subTest(kind=kind, step=step[:13]):
                    box = Box("B", (2, 2, 2), (kind,))
                    result = self.solve(
                        box.cards() + "*NSET, NSET=ALL\n"
                        + "\n".join(str(box.first + i) for i in range(len(box.x)))
                        + "\n" + MATERIAL + "*EXPANSION\n1e-4\n" + corner
                        + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 0.\n" + step
                        + "*TEMPERATURE\nALL, 100.\n*END STEP\n"
                    )
                    np.testing.assert_allclose(
                        result.field("displacement"), stretch * result.points, rtol=0, atol=1e-11
                    )

    def test_forces_on_mid_side_nodes(self):
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 1, 1), (kind,), size=(2, 1, 1))
                middle = int(np.argmin(abs(box.x - [2, 1, 0.5]).sum(axis=1)))
                force = np.array([3.0, -2.0, 5.0])
                loads = "".join(f"{box.first + middle}, {i + 1}, {force[i]}\n" for i in range(3))
                result = self.solve(
                    box.cards() + MATERIAL + "*BOUNDARY\nB-X0, 1, 3\n" + STEP + "*CLOAD\n" + loads
                    + "*END STEP\n"
                )
                self.check_load(result, force, box.x[middle])


class Joints(BoxCase):
    def test_kinematic_couplings_carry_all_nodes(self):
        """A face, its mid-side nodes too, turns as the reference node does."""
        turn, place = np.array([0.002, -0.001, 0.003]), np.array([2.5, 0.5, 0.2])
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 1), (kind,), size=(2, 1, 1))
                lines = "".join(f"8001, {4 + i}, {4 + i}, {turn[i]}\n" for i in range(3))
                result = self.solve(
                    box.cards() + MATERIAL + "*NODE\n8001, 2.5, 0.5, 0.2\n"
                    + "*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=8001, SURFACE=B-X1\n*KINEMATIC\n"
                    + "*BOUNDARY\nB-X0, 1, 3\n" + STEP + "*BOUNDARY\n8001, 1, 3\n" + lines
                    + "*END STEP\n"
                )
                x, u = result.points, result.field("displacement")
                end = abs(x[:, 0] - 2) < 1e-9
                carried = np.cross(turn, x[end] - place)
                np.testing.assert_allclose(u[end], carried, rtol=0, atol=1e-14)
                reference = result.reference_nodes[8001]
                reaction = result.field("reaction_force")
                np.testing.assert_allclose(
                    reaction.sum(axis=0) + reference.reaction_force[-1], 0, rtol=0, atol=1e-8
                )
                moment = np.cross(x - place, reaction).sum(axis=0)
                torque = reference.reaction_moment[-1]
                np.testing.assert_allclose(moment, -torque, rtol=0, atol=1e-8)

    def test_a_corner_of_two_planes(self):
        """Pressed along z between a floor and two walls, one of them smooth, as the law has it.

        Nodes of the edges, mid-side ones among them, have two obstacles, that of the corner three.
        """
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 2), (kind,))
                planes = "".join(
                    f"*OBSTACLE, NAME=O{a}, TYPE=PLANE\n0., 0., 0.,  {normal}\n"
                    f"*CONTACT PAIR, INTERACTION=DRY\nB-{a}0, O{a}\n"
                    for a, normal in (("X", "1., 0., 0."), ("Y", "0., 1., 0."), ("Z", "0., 0., 1."))
                )
                result = self.solve(
                    box.cards() + MATERIAL + "*SURFACE INTERACTION, NAME=DRY\n" + planes
                    + "*BOUNDARY\nB-X1, 1\nB-Y1, 2\n" + STEP
                    + "*BOUNDARY\nB-Z1, 3, 3, -0.001\n*END STEP\n"
                )
                # Confined: the stress along z, and nu/(1 - nu) of it across.
                along = 0.001 * YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
                across = POISSON / (1 - POISSON) * along
                for pair, pressure in zip(
                    result.pairs.values(), (across, across, along), strict=True
                ):
                    np.testing.assert_allclose(pair.pressure[-1], pressure, rtol=1e-7)

    def test_a_quarter_is_a_quarter_of_the_whole(self):
        """A ball pressed into the middle of a face; planes of symmetry cut slave faces' edges."""
        for kind in ("C3D20", "C3D20R"):
            with self.subTest(kind=kind):
                found = []
                for low, n, held in ((0, 2, "B-X0, 1\nB-Y0, 2\n"), (-1, 4, "")):
                    size = (1 - low, 1 - low, 1)
                    box = Box("B", (n, n, 1), (kind,), low=(low, low, 0), size=size, shift=0)
                    result = self.solve(
                        box.cards() + MATERIAL
                        + "*SURFACE INTERACTION, NAME=DRY\n*FRICTION\n0.3\n*NODE\n"
                        + "9001, 0., 0., 4.\n*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=9001\n"
                        + "0., 0., 4., 3.\n*CONTACT PAIR, INTERACTION=DRY\nB-Z1, BALL\n"
                        + f"*BOUNDARY\nB-Z0, 1, 3\n{held}" + "*STEP\n*STATIC, DIRECT\n0.5, 1.\n"
                        + "*BOUNDARY\n9001, 1, 2, 0.\n9001, 3, 3, -0.05\n*END STEP\n"
                    )
                    force = result.field("contact_force")
                    quarter = (result.points[:, :2] > -1e-9).all(axis=1)
                    on_planes = (abs(result.points[quarter, :2]) < 1e-9).sum(axis=1)
                    order = np.lexsort(np.round(result.points[quarter], 9).T)
                    # Forces on the planes are shared with the other parts.
                    shared = force[quarter, 2] * (0.5**on_planes if low else 1)
                    found.append(shared[order])
                largest = abs(found[0]).max()
                self.assertGreater(largest, 1)
                np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-7 * largest)

    def test_equations_between_mid_side_nodes(self):
        """Both ends of a bar move alike but for a stretch: the strain is uniform."""
        for kind in KINDS:
            with self.subTest(kind=kind):
                box = Box("B", (2, 2, 1), (kind,), size=(2, 1, 1))
                ends = [box.side(0, end) for end in (0, 1)]
                place = {tuple(np.round(box.x[n - box.first, 1:], 9)): n for n in ends[0]}
                lines = ["*NODE", "8001, 9., 9., 9."]
                for node in ends[1]:
                    other = place[tuple(np.round(box.x[node - box.first, 1:], 9))]
                    for i in (1, 2, 3):
                        lines += ["*EQUATION", "3", f"{node}, {i}, 1., {other}, {i}, -1., "
                                                    f"8001, {i}, -1."]
                low = box.first + int(np.argmin(abs(box.x).sum(axis=1)))
                up = box.first + int(np.argmin(abs(box.x - [0, 0, 1]).sum(axis=1)))
                held = f"*BOUNDARY\n{low}, 1, 3\n{up}, 2\n8001, 2, 3\n"
                result = self.solve(
                    box.cards() + MATERIAL + "\n".join(lines) + "\n" + held + STEP
                    + "*BOUNDARY\n8001, 1, 1, 0.002\n*END STEP\n"
                )
                x, u = result.points, result.field("displacement")
                exact = (x - x[0]) * 1e-3 * np.array([1, -POISSON, -POISSON])
                np.testing.assert_allclose(u - u[0], exact, rtol=0, atol=1e-11)


if __name__ == "__main__":
    unittest.main()
