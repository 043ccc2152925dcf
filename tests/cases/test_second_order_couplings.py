"""Couplings and loads on the faces of elements of second order, against closed forms.

Boxes of tests/cases/boxes.py.
"""

import unittest

import numpy as np
from boxes import (
    DRY,
    FLOOR,
    MATERIAL,
    POISSON,
    PRESSURE,
    STEP,
    YOUNG,
    Box,
    BoxCase,
    on_corner,
)
from program import Run

KINDS = ("C3D10", "C3D15", "C3D20", "C3D20R")
N_CORNERS = {"C3D10": 4, "C3D15": 6, "C3D20": 8, "C3D20R": 8}
LENGTH, WIDE, THICK = 3.0, 1.0, 0.6


def bar(kind, shift=0.0):
    """Return a bar along x, whose axis is that of x."""
    return Box("B", (3, 2, 2), (kind,), (0, -WIDE / 2, -THICK / 2), (LENGTH, WIDE, THICK),
               shift=shift)


def pinned(box):
    """Hold a side as the middle of a bar in bending about any axis: plane, free to grow."""
    at = {}
    for y in (-WIDE / 2, 0.0, WIDE / 2):
        at[y] = box.first + next(i for i, x in enumerate(box.x) if np.allclose(x, (0, y, 0)))
    return (
        f"*BOUNDARY\nB-X0, 1\n{at[0.0]}, 2, 3\n"
        f"*EQUATION\n2\n{at[-WIDE / 2]}, 3, 1., {at[WIDE / 2]}, 3, -1.\n"
    )


def numbers(v):
    """Return numbers as the entries of a line."""
    return ", ".join(map(repr, np.array(v, float).tolist()))


def turn_about(axis, angle):
    """Return the matrix of a turn (Rodrigues)."""
    x, y, z = np.array(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def coupled(place, kind="*DISTRIBUTING", node=9001, side="B-X1"):
    """Return a reference node and its coupling."""
    return (
        f"*NODE\n{node}, {numbers(place)}\n"
        f"*COUPLING, CONSTRAINT NAME=C{node}, REF NODE={node}, SURFACE={side}\n{kind}\n"
    )


def loads(node, force=(0, 0, 0), moment=(0, 0, 0)):
    """Return the lines of *CLOAD of a force and a moment."""
    return "".join(
        f"{node}, {i}, {float(v)!r}\n" for i, v in enumerate([*force, *moment], 1) if v
    )


class Couplings(BoxCase):
    def check_uniform(self, result, n):
        """A uniform stress along z of the first nodes, in rest at their corner."""
        x = result.points[:n]
        strain = np.array([POISSON, POISSON, -1.0]) * PRESSURE / YOUNG
        u = result.field("displacement")[:n]
        np.testing.assert_allclose(u - u[0], (x - x[0]) * strain, rtol=0, atol=1e-10)

    def reference(self, result, name, node=9001):
        """Return what is written of a reference node."""
        group = result.file["reference_nodes"]
        return group[name][-1, list(group["node_id"][:]).index(node)]

    def test_a_moment_bends_a_bar(self):
        """Pure bending about an oblique axis, u quadratic in x: exact in all of these."""
        moment = np.array([0.0, 3.0, 10.0])
        for kind in KINDS:
            box = bar(kind, shift=0.15 if kind == "C3D10" else 0.0)
            for place in ((LENGTH, 0, 0), (LENGTH + 1, 0.3, -0.7)):
                with self.subTest(kind=kind, place=place):
                    result = self.solve(
                        box.cards() + MATERIAL + pinned(box) + coupled(place) + STEP
                        + "*CLOAD\n" + loads(9001, moment=moment) + "*END STEP\n"
                    )
                    bend_z = moment[2] / (YOUNG * WIDE**3 * THICK / 12)
                    bend_y = moment[1] / (YOUNG * THICK**3 * WIDE / 12)
                    x, y, z = box.x.T
                    expected = np.column_stack([
                        x * (bend_y * z - bend_z * y),
                        bend_z / 2 * (x**2 + POISSON * (y**2 - z**2)) - bend_y * POISSON * y * z,
                        -bend_y / 2 * (x**2 + POISSON * (z**2 - y**2)) + bend_z * POISSON * y * z,
                    ])
                    u = result.field("displacement")[: len(box.x)]
                    scale = abs(expected).max()
                    np.testing.assert_allclose(u, expected, rtol=0, atol=1e-9 * scale)
                    # The work of the moment: what it turns by.
                    turn = LENGTH * np.array([0, bend_y, bend_z])
                    np.testing.assert_allclose(
                        self.reference(result, "rotation"), turn, rtol=0, atol=1e-9 * scale
                    )
                    flat = (WIDE**2 - THICK**2) / 12
                    mean = [0, bend_z / 2 * (LENGTH**2 + POISSON * flat),
                            -bend_y / 2 * (LENGTH**2 - POISSON * flat)]
                    arm = np.array(place, float) - (LENGTH, 0, 0)
                    np.testing.assert_allclose(
                        self.reference(result, "displacement"), mean + np.cross(turn, arm),
                        rtol=0, atol=1e-9 * scale,
                    )

    def test_rigid_motions_are_those_of_the_mean(self):
        """On curved faces of every type: the reference node goes along, in force and in place."""
        place, drawn = np.array([4.0, 0.3, -0.7]), np.array([0.3, -0.2, 0.5])
        turn, move = np.array([0.01, -0.02, 0.03]), np.array([0.1, 0.2, -0.3])
        force, moment = np.array([2.0, -3.0, 5.0]), np.array([7.0, -1.0, 4.0])
        for kind in (*KINDS, "C3D8", "C3D6", "C3D4"):
            with self.subTest(kind=kind):
                box = bar(kind)
                end = box.side(0, 1)
                faces = [i - box.first for i in end]
                box.x[faces, 0] += 0.2 * np.sin(5 * box.x[faces, 1] + 3 * box.x[faces, 2])
                held = "*BOUNDARY\n" + "".join(
                    f"9002, {i}, {i}, {float(v)!r}\n" for i, v in enumerate([*move, *turn], 1)
                )
                cards = box.cards() + "*NSET, NSET=END\n" + "".join(f"{i}\n" for i in end)
                cards += MATERIAL + coupled(place, side="END")
                result = self.solve(
                    cards + coupled(drawn, "*KINEMATIC", 9002, "B-X0") + STEP + held
                    + "*END STEP\n"
                )
                np.testing.assert_allclose(self.reference(result, "rotation"), turn, atol=1e-10)
                np.testing.assert_allclose(
                    self.reference(result, "displacement"),
                    move + np.cross(turn, place - drawn), rtol=0, atol=1e-10,
                )
                result = self.solve(
                    cards + "*BOUNDARY\nB-X0, 1, 3\n" + STEP + "*CLOAD\n"
                    + loads(9001, force, moment) + "*END STEP\n"
                )
                support = result.field("reaction_force")[: len(box.x)]
                np.testing.assert_allclose(support.sum(axis=0), -force, rtol=0, atol=1e-10)
                np.testing.assert_allclose(
                    np.cross(box.x - place, support).sum(axis=0), -moment, rtol=0, atol=1e-10
                )
                # The loads' work is that of what carries them.
                work = force @ self.reference(result, "displacement") + (
                    moment @ self.reference(result, "rotation")
                )
                energy = result.history("energy/strain")[-1]
                self.assertAlmostEqual(work / (2 * energy), 1, delta=1e-10)

    def test_sets_that_lack_mid_side_nodes(self):
        """Faces are those of the corners, with all of their nodes: contact, tie, both couplings."""
        for kind in KINDS:
            box = Box("B", (2, 2, 1), (kind,), size=(1, 1, 0.5))
            corners = {a for e in box.elements[kind] for a in e[1 : 1 + N_CORNERS[kind]]}
            corners = sorted(corners.intersection(box.side(2, 0)))
            middles = sorted(set(box.side(2, 0)).difference(corners))
            low = Box("A", (2, 2, 1), ("C3D8",), low=(0, 0, -1), after=box)
            tied = (
                low.cards() + on_corner("A") + "*BOUNDARY\nA-Z0, 3\n*TIE, NAME=T\nFACES, A-Z1\n"
            )
            for name, ids in (("corners", corners), ("one is missing", corners + middles[1:])):
                faces = "*NSET, NSET=SOME\n" + "".join(f"{i}\n" for i in ids)
                faces += "*SURFACE, NAME=FACES, TYPE=NODE\nSOME\n"
                for what, more in (
                    ("contact", DRY + FLOOR.replace("B-Z0,", "FACES,")),
                    ("tie", tied),
                    ("rigid", coupled((0, 0, 0), "*KINEMATIC\n3", side="SOME")
                     + "*BOUNDARY\n9001, 3, 6, 0.\n"),
                    ("mean", coupled((0.5, 0.5, 0), side="SOME")),
                ):
                    with self.subTest(kind=kind, what=what, set=name):
                        held = "*BOUNDARY\nB-Z0, 3\n" if what == "mean" else ""
                        result = self.solve(
                            box.cards() + faces + MATERIAL + on_corner("B") + more + STEP + held
                            + f"*DSLOAD\nB-Z1, P, {PRESSURE}\n*END STEP\n"
                        )
                        self.check_uniform(result, len(box.x))
                        if what == "contact":
                            np.testing.assert_allclose(
                                result.pairs[0].pressure[-1], PRESSURE, rtol=1e-8
                            )

    def test_forces_on_sets_that_lack_mid_side_nodes(self):
        """All of a force arrives, as on the whole face."""
        for kind in KINDS:
            box = bar(kind)
            end = box.side(0, 1)
            for lost in ([], end[-1:]):
                with self.subTest(kind=kind, lost=lost):
                    some = "".join(f"{i}\n" for i in end if i not in lost)
                    result = self.solve(
                        box.cards() + "*NSET, NSET=SOME\n" + some + MATERIAL
                        + coupled((LENGTH, 0, 0), side="SOME") + "*BOUNDARY\nB-X0, 1, 3\n" + STEP
                        + "*CLOAD\n9001, 1, 5.\n*END STEP\n"
                    )
                    force = result.field("reaction_force")[: len(box.x)].sum(axis=0)
                    np.testing.assert_allclose(force, [-5, 0, 0], rtol=0, atol=1e-10)

    def test_tied_faces_of_reduced_elements_have_neighbours(self):
        """A layer of four elements: four free faces each, three where it is tied to a base."""
        box = Box("B", (2, 2, 1), ("C3D20R",), size=(1, 1, 0.5))
        base = Box("A", (3, 3, 1), ("C3D8",), low=(0, 0, -1), after=box)
        below = base.cards() + on_corner("A") + "*BOUNDARY\nA-Z0, 3\n"
        for tie, wanted in (("*TIE, NAME=T\nB-Z0, A-Z1\n", False), ("", True)):
            with self.subTest(tie=tie):
                run = Run(
                    box.cards() + MATERIAL + on_corner("B") + below + tie
                    + ("" if tie else DRY + "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, A-Z1\n")
                    + STEP + f"*DSLOAD\nB-Z1, P, {PRESSURE}\n*END STEP\n", name="deck",
                )
                self.assertEqual(run.status, 0, run.errors)
                noted = "have four faces or more without a neighbour" in run.output
                self.assertEqual(noted, wanted)
                result = run.result()
                self.addCleanup(result.close)
                self.check_uniform(result, len(box.x))

    def test_temperatures_of_corners_alone_are_noted(self):
        """The mean over the nodes of an element is no longer what the set was meant to say."""
        for kind in KINDS:
            box = Box("B", (1, 1, 1), (kind,))
            corners = {a for e in box.elements[kind] for a in e[1 : 1 + N_CORNERS[kind]]}
            sets = "*NSET, NSET=CORNERS\n" + "".join(f"{i}\n" for i in sorted(corners))
            sets += "*NSET, NSET=ALL, ELSET=B\n"
            for name in ("CORNERS", "ALL"):
                with self.subTest(kind=kind, set=name):
                    run = Run(
                        box.cards() + sets + MATERIAL + "*EXPANSION\n1e-5\n" + on_corner("B")
                        + "*BOUNDARY\nB-Z0, 3\n" + STEP + f"*TEMPERATURE\n{name}, 10.\n*END STEP\n",
                        name="deck",
                    )
                    self.assertEqual(run.status, 0, run.errors)
                    noted = "and not to all of their mid-side nodes" in run.output
                    self.assertEqual(noted, name == "CORNERS")


class Corner(BoxCase):
    """A block between a floor and a wall, which both press the nodes of one edge.

    The plane y = 0 is one of symmetry through both of these faces.
    """

    def deck(self, kind, friction, turn, solver="AUTO"):
        """Return the box, and its deck turned by a matrix: pressed by 100 on top, by 60 aside."""
        box = Box("B", (2, 2, 2), (kind,))
        cards = "*NODE\n" + "".join(
            f"{box.first + i}, {numbers(turn @ x)}\n" for i, x in enumerate(box.x)
        )
        flat = box.cards()
        cards += flat[flat.index("*ELEMENT"):] + MATERIAL
        cards += f"*SURFACE INTERACTION, NAME=ROUGH\n*FRICTION\n{friction}\n"
        cards += f"*TRANSFORM, NSET=B-Y0, TYPE=R\n{numbers([*turn[:, 0], *turn[:, 1]])}\n"
        for name, axis, side in (("FLOOR", 2, "Z"), ("WALL", 0, "X")):
            cards += f"*OBSTACLE, NAME={name}, TYPE=PLANE\n0., 0., 0., {numbers(turn[:, axis])}\n"
            cards += f"*CONTACT PAIR, INTERACTION=ROUGH\nB-{side}0, {name}\n"
        cards += f"*CONTACT SOLVER, SOLVER={solver}, TOLERANCE=1e-10\n"
        return box, cards + (
            "*BOUNDARY\nB-Y0, 2\n*STEP\n*STATIC\n"
            "*DSLOAD\nB-Z1, P, 100.\nB-X1, P, 60.\n*END STEP\n"
        )

    def test_both_press_evenly_without_friction(self):
        """Stresses are uniform, in any direction: the edge takes its part of both."""
        stress = np.array([-60.0, 0.0, -100.0])
        strain = ((1 + POISSON) * stress - POISSON * stress.sum()) / YOUNG
        for kind in KINDS:
            for turn in (np.eye(3), turn_about((1, 2, 0.5), 0.6)):
                with self.subTest(kind=kind, turned=turn[0, 0] < 1):
                    box, deck = self.deck(kind, 0.0, turn)
                    result = self.solve(deck)
                    u = result.field("displacement") @ turn
                    np.testing.assert_allclose(
                        u, box.x * strain, rtol=0, atol=1e-9 * abs(strain).max()
                    )
                    for pair, pressure in zip((0, 1), (60, 100), strict=True):
                        np.testing.assert_allclose(
                            result.pairs[pair].pressure[-1], pressure, rtol=1e-8
                        )

    def test_what_each_takes_is_the_same_whoever_solves(self):
        """With friction the edge is held twice: the least shares are taken."""
        for kind in KINDS:
            found = {}
            for solver, turn in (
                ("SWEEPS", np.eye(3)),
                ("GLOBAL NEWTON", np.eye(3)),
                ("AUTO", turn_about((1, 2, 0.5), 0.6)),
            ):
                result = self.solve(self.deck(kind, 0.3, turn, solver)[1])
                found[solver] = np.array([result.pairs[i].resultant[-1] @ turn for i in (0, 1)])
            for solver, force in found.items():
                with self.subTest(kind=kind, solver=solver):
                    np.testing.assert_allclose(force, found["SWEEPS"], rtol=0, atol=1e-5)


if __name__ == "__main__":
    unittest.main()
