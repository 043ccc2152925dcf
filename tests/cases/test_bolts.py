"""Bolts that are cut: *PRE-TENSION SECTION.

A bar of length 4 and unit area, held at both ends, is cut in its middle; a force F on the reference
node gives the stress F / A everywhere and moves the cut by F L / (E A), whatever the elements are.
A bolt beside a clamped column: springs in parallel.
"""

import unittest

import numpy as np
from boxes import DRY, Box
from program import Run

YOUNG = 1000.0
FACES = {
    4: ((0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    5: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
CORNERS = {"C3D10": 4, "C3D15": 6, "C3D20": 8, "C3D20R": 8}
MATERIAL = f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG}, 0.3\n"


def faces_at(box, axis, place, upper=False):
    """Return the lines of *SURFACE for a cut across an axis: element, face, of one of its sides."""
    lines = []
    for kind, elements in box.elements.items():
        n = CORNERS.get(kind, int(kind[3]))
        for element, *nodes in elements:
            x = np.array([box.x[node - box.first][axis] for node in nodes[:n]])
            if upper != (x.mean() > place):
                continue
            for i, face in enumerate(FACES[n]):
                if np.all(abs(x[list(face)] - place) < 1e-9):
                    lines.append(f"{element}, S{i + 1}")
    return "\n".join(lines)


def section(box, node, place=2.0, normal="0., 0., 1.", upper=False):
    """Return the cards of a section across z and its reference node."""
    return (
        f"*NODE\n{node}, 0., 0., 9.\n*SURFACE, NAME=CUT{node}, TYPE=ELEMENT\n"
        f"{faces_at(box, 2, place, upper)}\n*PRE-TENSION SECTION, SURFACE=CUT{node}, NODE={node}\n"
        f"{normal}\n"
    ).replace("\n\n", "\n")


def bar(kinds, steps, normal="0., 0., 1.", upper=False, nlgeom=""):
    """Return a bar that is cut: its ends held along z, its bottom also across at three nodes."""
    box = Box("B", (1, 1, 4), kinds, size=(1, 1, 4), shift=0)
    corner, along, _ = (
        next(n for n in box.side(2, 0) if tuple(box.x[n - 1][:2]) == xy)
        for xy in ((0, 0), (1, 0), (0, 1))
    )
    return (
        box.cards() + MATERIAL + section(box, 9000, normal=normal, upper=upper)
        + f"*BOUNDARY\nB-Z0, 3, 3\nB-Z1, 3, 3\n{corner}, 1, 2\n{along}, 2, 2\n"
        + f"*STEP{nlgeom}\n*STATIC\n1., 1.\n{steps}*END STEP\n"
    )


class Bars(unittest.TestCase):
    """A bar between two ends that are held."""

    def reference(self, run, field):
        """Return a field of the reference node at the end."""
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            return np.array(getattr(result.reference_nodes[9000], field))[-1]

    def test_a_force_is_the_tension(self):
        for kinds in (["C3D8"], ["C3D6"], ["C3D4"], ["C3D10"], ["C3D15"], ["C3D20"], ["C3D20R"]):
            with self.subTest(kinds):
                run = Run(bar(kinds, "*CLOAD\n9000, 1, 5.\n"), name="bar")
                moved = self.reference(run, "displacement")
                np.testing.assert_allclose(moved, [5 * 4 / YOUNG, 0, 0], atol=1e-9)

    def test_the_normal_tells_the_sign(self):
        """It leads out of the surface, else the bolt is pressed; values of CalculiX's ccx."""
        for normal, upper, tension in (
            ("0., 0., 1.", False, 5.0), ("", False, 5.0), ("", True, 5.0),
            ("0., 0., 1.", True, -5.0), ("0., 0., -1.", False, -5.0),
            ("0.3, 0., 1.", False, 5.220153),
        ):
            with self.subTest(normal=normal, upper=upper):
                run = Run(bar(["C3D8"], "*CLOAD\n9000, 1, 5.\n", normal, upper), name="bar")
                moved = self.reference(run, "displacement")
                np.testing.assert_allclose(moved[0], 0.0218 if "3" in normal else 0.02, rtol=1e-9)
                with run.result() as result:
                    top = [i for i, z in enumerate(result.points[:, 2]) if z > 3.99]
                    force = np.array(result.field("reaction_force"))[top].sum(axis=0)
                np.testing.assert_allclose(force[2], tension, rtol=1e-6)

    def test_it_stays_as_short_once_fixed(self):
        """Fixed, its force is the reaction of the support and the force that is left."""
        steps = (
            "*CLOAD\n9000, 1, 5.\n*END STEP\n*STEP\n*STATIC\n1., 1.\n*CLOAD, OP=NEW\n"
            "*BOUNDARY, FIXED\n9000, 1, 1\n*END STEP\n*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n"
            "B-Z1, 3, 3, 0.01\n"
        )
        run = Run(bar(["C3D20R"], steps), name="bar")
        np.testing.assert_allclose(self.reference(run, "displacement")[0], 0.02, rtol=1e-9)
        # E A (shortening + motion of the end) / L
        np.testing.assert_allclose(self.reference(run, "reaction_force")[0], 7.5, rtol=1e-9)

    def test_a_shortening_is_prescribed(self):
        for nlgeom in ("", ", NLGEOM"):
            run = Run(bar(["C3D8"], "*BOUNDARY\n9000, 1, 1, 0.02\n", nlgeom=nlgeom), name="bar")
            force = self.reference(run, "reaction_force")[0]
            np.testing.assert_allclose(force, 5.0, rtol=0.02 if nlgeom else 1e-9)

    def test_finer_meshes_are_cut_likewise(self):
        for kind, *options in (
            ("C3D8", "--refine", "1"), ("C3D10", "--refine", "1"),
            ("C3D6", "--accuracy", "0.01", "--nlgeom", "no"),
        ):
            with self.subTest(kind, options=options):
                run = Run(bar([kind], "*CLOAD\n9000, 1, 5.\n"), *options, name="bar")
                moved = self.reference(run, "displacement")
                np.testing.assert_allclose(moved[0], 0.02, rtol=1e-6)

    def test_new_nodes_have_the_temperatures_of_the_old(self):
        """A free bar that is warmed evenly grows without stress."""
        deck = bar(["C3D8"], "*TEMPERATURE\nALL, 100.\n").replace("B-Z1, 3, 3\n", "")
        deck = deck.replace("0.3\n", "0.3\n*EXPANSION\n1e-5\n", 1).replace(
            "*BOUNDARY\nB-Z0", "*NSET, NSET=ALL, ELSET=B\n*BOUNDARY\n9000, 1, 1\nB-Z0", 1)
        run = Run(deck, name="bar")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            moved = np.array(result.field("displacement"))
            np.testing.assert_allclose(moved[:, 2], 1e-3 * result.points[:, 2], atol=1e-12)

    def test_flat_decks_give_the_same(self):
        deck = bar(["C3D8"], "*CLOAD\n9000, 1, 5.\n")
        flat = Run(deck, "--flat", name="bar").output
        np.testing.assert_array_equal(
            self.reference(Run(flat, name="bar"), "displacement"),
            self.reference(Run(deck, name="bar"), "displacement"),
        )


class Errors(unittest.TestCase):
    """What is wrong with a section is told once, where it stands."""

    def test_each_has_one_message(self):
        card = "*PRE-TENSION SECTION, SURFACE=CUT9000, NODE=9000"
        good = bar(["C3D8"], "*CLOAD\n9000, 1, 5.\n")
        for old, new, message in (
            ("SURFACE=CUT9000, NODE", "SURFACE=CUTS, NODE", "surface 'CUTS' is not defined"),
            ("SURFACE=CUT9000, NODE=9000", "SURFACE=B-Z1, NODE=9000", "needs TYPE=ELEMENT"),
            (", NODE=9000", "", "needs NODE="),
            (", NODE=9000", ", NODE=9001", "node 9001 is not defined"),
            (", NODE=9000", ", NODE=1", "node 1 belongs to an element"),
            ("SURFACE=CUT9000, NODE", "ELEMENT=3, NODE", "of a beam element is not available"),
            (card + "\n0., 0., 1.", card + "\n0., 0., 0.", "has no length"),
            ("2, S2", "2, S2\n3, S1", "names a face of element"),
            ("2, S2", "4, S2", "no element behind it"),
            ("2, S2", "2, S3", "no element behind it"),
        ):
            with self.subTest(new):
                self.assertIn(old, good)
                deck = good.replace(old, new, 1)
                if ", NODE=9000" not in deck:
                    deck = deck.replace("9000, 1, 5.", "1, 3, 0.")
                run = Run(deck, name="bar")
                errors = [line for line in run.errors.splitlines() if ": error: " in line]
                self.assertEqual((run.status, len(errors)), (1, 1), run.errors)
                self.assertIn(message, errors[0])

    def test_a_cut_that_ends_in_the_body(self):
        box = Box("B", (2, 2, 2), ["C3D8"], shift=0)
        deck = (
            box.cards() + MATERIAL + section(box, 9000, place=0.5)
            + "*STEP\n*STATIC\n*BOUNDARY\nB-Z0, 1, 3\n*CLOAD\n9000, 1, 1.\n*END STEP\n"
        )
        lines = faces_at(box, 2, 0.5).splitlines()
        run = Run(deck.replace("\n".join(lines), lines[0]), name="part")
        self.assertEqual(run.status, 1)
        self.assertIn("does not cut through the body", run.errors)


class Clamped(unittest.TestCase):
    """A bolt and the column that it clamps: springs in parallel."""

    def deck(self, load, mu=0.0, nlgeom=""):
        """Return a bolt (area 1, length 4) and a column (area 3, in two parts) under one head."""
        bolt = Box("B", (1, 1, 4), ["C3D8"], size=(1, 1, 4), shift=0)
        low = Box("C", (2, 1, 3), ["C3D8"], low=(2, 0, 0), size=(3, 1, 3), after=bolt, shift=0)
        top = Box("D", (3, 1, 1), ["C3D8"], low=(2, 0, 3), size=(3, 1, 1), after=low, shift=0)
        head = "*NODE\n9001, 2., 0.5, 9.\n" + "".join(
            f"*COUPLING, CONSTRAINT NAME={side}, REF NODE=9001, SURFACE={side}\n*KINEMATIC\n1, 3\n"
            for side in ("B-Z1", "D-Z1")
        )
        return (
            bolt.cards() + low.cards() + top.cards() + MATERIAL.replace("0.3", "0.")
            + section(bolt, 9000) + head + DRY + f"*FRICTION\n{mu}\n"
            + "*CONTACT PAIR, INTERACTION=DRY\nD-Z0, C-Z1\n"
            + "*BOUNDARY\nB-Z0, 1, 3\nC-Z0, 1, 3\n9001, 1, 2\n9001, 4, 6\n"
            + f"*STEP{nlgeom}\n*STATIC\n1., 1.\n*CLOAD\n9000, 1, 6.\n*END STEP\n"
            + f"*STEP{nlgeom}\n*STATIC\n1., 1.\n*CLOAD, OP=NEW\n9001, 3, {load!r}\n"
            + "*BOUNDARY, FIXED\n9000, 1, 1\n*END STEP\n"
        )

    def test_the_load_is_shared_by_stiffness(self):
        """Of a load P the bolt takes P / 4 (areas 1 and 3, length 4) until the joint opens."""
        for load, bolt, joint in ((4.0, 7.0, 3.0), (10.0, 10.0, 0.0)):
            for mu in (0.0, 0.3):
                with self.subTest(load=load, mu=mu):
                    run = Run(self.deck(load, mu), name="clamped")
                    self.assertEqual(run.status, 0, run.output + run.errors)
                    with run.result() as result:
                        pressed = np.array(result.pairs[0].normal_sum)
                        held = np.array(result.reference_nodes[9000].reaction_force)[-1, 0]
                    np.testing.assert_allclose(pressed, [6.0, joint], atol=1e-6)
                    np.testing.assert_allclose(held, bolt, atol=1e-6)


class FreeAtFiniteStrain(unittest.TestCase):
    """A bar that is cut, and that contact alone holds, is as one that is whole."""

    def run_bar(self, name, cut, shortened, tilt):
        """Run a bar that stands on a rough plate and is pressed on its top; the plate turns.

        Return displacements of the nodes along x, y, z, points and force on the plate.
        """
        box = Box("B", (2, 2, 4), ["C3D8"], size=(1, 1, 2), shift=0)
        cards = section(box, 9000, place=1.0) if cut else ""
        held = f"9000, 1, 1, {shortened!r}\n" if cut else ""
        run = Run(
            box.cards() + MATERIAL + cards
            + "*NODE\n9001, 0.5, 0.5, 0.\n*OBSTACLE, NAME=PLATE, TYPE=PLANE, REF NODE=9001\n"
            + "0., 0., 0., 0., 0., 1.\n" + DRY + "*FRICTION\n0.9\n"
            + "*CONTACT PAIR, INTERACTION=DRY\nB-Z0, PLATE\n"
            + "*CONTACT SOLVER, TOLERANCE=1e-10\n*STEP, NLGEOM\n*STATIC\n0.25, 1.\n"
            + f"*DSLOAD\nB-Z1, P, 20.\n*BOUNDARY\n9001, 1, 3\n9001, 4, 4, {tilt!r}\n{held}"
            + "*END STEP\n", name=name,
        )
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            places = {tuple(x): u for x, u in zip(
                result.points.round(9).tolist(), result.field("displacement"), strict=True
            ) if x[2] != 1.0}
            keys = sorted(places)
            force = result.pairs[0].resultant[-1]
            return np.array(keys), np.array([places[key] for key in keys]), np.array(force)

    def test_turned_by_a_plate(self):
        """By 0.4 rad, with both sides of the cut together."""
        _, whole, force = self.run_bar("whole", False, 0.0, 0.4)
        x, cut, other = self.run_bar("cut", True, 0.0, 0.4)
        np.testing.assert_allclose(cut, whole, atol=1e-7)
        np.testing.assert_allclose(other, force, atol=1e-6)
        top = cut[x[:, 2] == 2.0].mean(axis=0)  # it has turned with the plate
        np.testing.assert_allclose(top[1], -1.96 * np.sin(0.4), rtol=0.01)

    def test_a_shortening_moves_the_upper_part(self):
        """Along the normal, without another force."""
        _, whole, force = self.run_bar("whole", False, 0.0, 0.0)
        x, cut, other = self.run_bar("cut", True, 0.1, 0.0)
        moved = np.where(x[:, 2:] > 1.0, [[0.0, 0.0, -0.1]], 0.0)
        np.testing.assert_allclose(cut, whole + moved, atol=1e-7)
        np.testing.assert_allclose(other, force, atol=1e-6)


if __name__ == "__main__":
    unittest.main()
