"""Tetrahedra, wedges and elements of second order cut into smaller ones, all of them or some: what
the mesh has and means stays, and results go where finer meshes go.
"""

import itertools
import math
import unittest

import numpy as np
from boxes import (
    DRY,
    FLOOR,
    MATERIAL,
    PRESSURE,
    STEP,
    VTK_TYPES,
    YOUNG,
    Box,
    BoxCase,
    on_corner,
)
from program import ASKED, Run

LOAD = f"*DSLOAD\nB-Z1, P, {PRESSURE}\n*EL FILE, POSITION=AVERAGED AT NODES\nS\n*END STEP\n"
KINDS = (("C3D4",), ("C3D6",), ("C3D8", "C3D6"), ("C3D10",), ("C3D15",), ("C3D20",), ("C3D20R",),
         ("C3D20", "C3D15"))
LINEAR = ("C3D4", "C3D6", "C3D8")


def on_floor(box, refine=""):
    """Return the deck of a box that is pressed on a floor."""
    return (box.cards() + refine + MATERIAL + DRY + on_corner("B") + FLOOR + STEP + LOAD)


def at_corner(times=1, z=0.0, radius=0.2):
    return f"*REFINE, TIMES={times}\n0., 0., {z}, {radius}\n"


def tetrahedra_of(result):
    """Return the corners of tetrahedra, (elements, 4, 3)."""
    return result.points[result.cells[VTK_TYPES["C3D4"]][1]]


def quality(x):
    """Return 12 (3 V)^(2/3) / (sum of squares of edges): 1 of a regular tetrahedron."""
    edges = [x[:, i] - x[:, j] for i, j in itertools.combinations(range(4), 2)]
    volume = np.einsum("ij,ij->i", x[:, 1] - x[:, 0],
                       np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 0])) / 6  # fmt: skip
    return 12 * np.cbrt(3 * volume) ** 2 / sum((edge**2).sum(axis=1) for edge in edges), volume


class Uniform(BoxCase):
    """A uniform stress is exact on the finer mesh."""

    def check(self, result):
        self.check_uniform(result)
        stress = result.field("stress", on="nodes")
        np.testing.assert_allclose(stress, [[0, 0, -PRESSURE, 0, 0, 0]] * len(stress), rtol=0,
                                   atol=1e-10 * PRESSURE)  # fmt: skip
        np.testing.assert_allclose(result.pairs[0].pressure[-1], PRESSURE, rtol=1e-9)

    def test_all_elements(self):
        for kinds in KINDS:
            with self.subTest(kinds=kinds):
                box = Box("B", (2, 2, 2), kinds)
                result = self.solve(on_floor(box), "--refine", "1")
                self.check(result)
                types = result.file["VTKHDF/Types"][:]
                counts = {VTK_TYPES[kind]: 8 * len(cells) for kind, cells in box.elements.items()}
                self.assertEqual({int(t): int((types == t).sum()) for t in set(types)}, counts)

    def test_some_elements_at_contact(self):
        for kinds, times in itertools.product(KINDS[:3], (1, 2)):
            with self.subTest(kinds=kinds, times=times):
                self.check(self.solve(on_floor(Box("B", (3, 3, 2), kinds), at_corner(times))))

    def test_some_elements_of_second_order(self):
        """Far enough from contact that no node hangs there."""
        for kinds, times in itertools.product(KINDS[3:], (1, 2)):
            with self.subTest(kinds=kinds, times=times):
                box = Box("B", (2, 2, 4), kinds)
                deck = on_floor(box, at_corner(times, 1.0, 0.1))
                result = self.solve(deck)
                self.check(result)
                self.assertGreater(len(result.points), 1.2 * len(box.x))

    def test_pyramids_beside_what_is_cut(self):
        box = Box("B", (3, 2, 2), ("C3D8", "join", "C3D4"))
        self.check(self.solve(on_floor(box, "*NSET, NSET=FAR\n"
                                       f"{box.side(0, 1)[0]}\n*REFINE, NSET=FAR\n")))  # fmt: skip

    def test_bodies_that_touch(self):
        """Cut on the slave's side and on the master's."""
        for kinds, cut in itertools.product(itertools.product(LINEAR, repeat=2), ("UP", "LOW")):
            with self.subTest(kinds=kinds, cut=cut):
                low = Box("LOW", (3, 3, 2), kinds[1:])
                up = Box("UP", (2, 2, 2), kinds[:1], low=(0, 0, 1), after=low)
                self.check_uniform(self.solve(
                    low.cards() + up.cards() + f"*REFINE, NSET={cut}-X0\n" + MATERIAL + DRY
                    + on_corner("LOW") + on_corner("UP") + "LOW-Z0, 3\n*CONTACT PAIR, "
                    "INTERACTION=DRY, TYPE=SURFACE TO SURFACE\nUP-Z0, LOW-Z1\n" + STEP
                    + f"*DSLOAD\nUP-Z1, P, {PRESSURE}\n*END STEP\n"
                ))  # fmt: skip


class Meshes(BoxCase):
    def test_hexahedra_and_wedges_are_those_of_a_finer_box(self):
        for kind in ("C3D6", "C3D15", "C3D20", "C3D20R"):
            with self.subTest(kind=kind):
                fields = []
                for n, options in ((1, ("--refine", "2")), (2, ("--refine", "1")), (4, ())):
                    text = on_floor(Box("B", (n, n, n), (kind,), shift=0))
                    text = text.replace("B-Y0, 2\n", "B-Y0, 2\nB-Z1, 1, 2\n")
                    result = self.solve(text, *options)
                    order = np.lexsort(np.round(result.points, 9).T)
                    fields.append((result.points[order], result.field("displacement")[order]))
                for places, found in fields[:2]:
                    np.testing.assert_allclose(places, fields[2][0], atol=1e-12)
                    np.testing.assert_allclose(found, fields[2][1], rtol=0,
                                               atol=1e-8 * np.abs(found).max())  # fmt: skip

    def test_tetrahedra_keep_their_shape(self):
        """Slivers get no worse however often all elements are cut, and little by repeated cuts.

        The pieces around the inner diagonal are 0.5 at worst of what was cut, by one cut.
        """
        box = Box("B", (2, 2, 2), ("C3D4",), size=(1, 2, 0.7))
        before, after = None, []
        for options in ((), ("--refine", "1"), ("--refine", "3")):
            run = Run(on_floor(box), *options, name="deck")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found, volume = quality(tetrahedra_of(result))
            self.assertAlmostEqual(volume.sum(), 1.4, delta=1.4e-12)
            self.assertGreater(volume.min(), 0)
            if before is None:
                before = found.min()
            after.append(found.min() / before)
        self.assertGreater(after[1], 0.5)
        self.assertAlmostEqual(after[2], after[1], delta=1e-9)
        run = Run(on_floor(box, at_corner(3, radius=0.01)), name="deck")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            found, volume = quality(tetrahedra_of(result))
        self.assertAlmostEqual(volume.sum(), 1.4, delta=1.4e-12)
        self.assertGreater(found.min() / before, 0.5)

    def test_curved_edges_stay_as_curved(self):
        """New nodes lie on the deck's parabolas: the weight is that of the deck's elements."""
        for kind in ("C3D10", "C3D15", "C3D20"):
            with self.subTest(kind=kind):
                box = Box("B", (1, 1, 2), (kind,), shift=0)
                box.x[:, 2] += 0.2 * box.x[:, 2] * box.x[:, 0] * (1 - box.x[:, 0])
                weights = []
                for options in ((), ("--refine", "1"), ("--refine", "2")):
                    result = self.solve(
                        box.cards() + MATERIAL + DRY + on_corner("B") + FLOOR + STEP
                        + "*DLOAD\nB, GRAV, 10., 0., 0., -1.\n*END STEP\n", *options
                    )  # fmt: skip
                    weights.append(result.pairs[0].resultant[-1, 2])
                    x, _, z = result.points.T
                    if kind != "C3D10":  # whose inner edges are straight, one across the top
                        top = z > 1 - 1e-9
                        self.assertGreater(top.sum(), 3)
                        np.testing.assert_allclose(z[top], 1 + 0.2 * (x * (1 - x))[top],
                                                   atol=1e-12)  # fmt: skip
                np.testing.assert_allclose(weights, weights[0], rtol=1e-9)

    def test_sets_of_corners_mean_faces(self):
        """A support and a contact by corners alone are those by all nodes on the finer mesh."""
        found = []
        for corners in (False, True):
            box = Box("B", (2, 2, 2), ("C3D10",))
            if corners:
                middles = {node for cell in box.elements["C3D10"] for node in cell[5:]}
                box.side = lambda *of, box=box, middles=middles: [
                    node for node in Box.side(box, *of) if node not in middles
                ]
            result = self.solve(on_floor(box), "--refine", "1")
            self.check_uniform(result)
            found.append(result.pairs[0].pressure.shape)
        self.assertEqual(found[0], found[1])

    def test_a_plan(self):
        deck = on_floor(Box("B", (2, 2, 1), ("C3D10",)))
        deck = deck.replace(STEP, "*STEP\n*STATIC\n0.25, 1.\n")
        plan = Run(deck, "--plan", "--refine", "1", name="deck")
        self.assertEqual(plan.status, 0, plan.errors)
        self.assertIn("192 elements", plan.output)
        self.solve(deck, "--refine", "1")


class Limits(BoxCase):
    """Where finer meshes go."""

    def hertz(self, kind, n=3):
        """A rigid ball of radius 1 pressed by 0.1 into a block of 1, a quarter of it."""
        box = Box("B", (n, n, n), (kind,), shift=0)
        return (
            box.cards() + MATERIAL + DRY + "*NODE\n90001, 0., 0., 2.\n*OBSTACLE, NAME=BALL, "
            "TYPE=SPHERE, REF NODE=90001\n0., 0., 2., 1.\n*CONTACT PAIR, INTERACTION=DRY\n"
            "B-Z1, BALL\n*BOUNDARY\nB-X0, 1\nB-Y0, 2\nB-Z0, 1, 3\n*STEP\n*STATIC\n1., 1.\n"
            "*BOUNDARY\n90001, 3, 3, -0.1\n90001, 1, 2\n*END STEP\n"
        )

    # The force from C3D8, C3D10 and C3D20R with 24 to 48 elements along an edge: -3339.6, -3344.4,
    # -3341.9.
    FORCE = -3342.5

    def test_hertz(self):
        for kind, refine, error in (("C3D10", 1, 0.005), ("C3D20R", 1, 0.015), ("C3D4", 2, 0.025),
                                    ("C3D15", 1, 0.01)):  # fmt: skip
            with self.subTest(kind=kind):
                result = self.solve(self.hertz(kind), "--refine", str(refine))
                self.assertLess(abs(result.pairs[0].resultant[-1, 2] / self.FORCE - 1), error)

    def beam(self, kind, n=1, length=6):
        """A cantilever whose last part a floor lifts by 0.01."""
        box = Box("B", (length * n, n, n), (kind,), size=(length, 1, 1), shift=0)
        x, z = box.x[:, 0], box.x[:, 2]
        tip = np.flatnonzero((z < 1e-9) & (x > length - 1 - 1e-9)) + 1
        return (
            box.cards() + "*NSET, NSET=TIP\n" + "\n".join(map(str, tip)) + "\n" + MATERIAL + DRY
            + "*NODE\n90001, 6., 0., 0.\n*OBSTACLE, NAME=FLOOR, TYPE=PLANE, REF NODE=90001\n"
            "0., 0., 0., 0., 0., 1.\n*CONTACT PAIR, INTERACTION=DRY\nTIP, FLOOR\n*BOUNDARY\n"
            "B-X0, 1, 3\n*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n90001, 3, 3, 0.01\n90001, 1, 2\n"
            "*END STEP\n"
        )

    def block(self, kind, n=2):
        """A block glued at its top and pressed on a rough floor by 0.001."""
        return (
            Box("B", (n, n, n), (kind,), shift=0).cards() + MATERIAL
            + DRY + "*FRICTION\n0.3\n" + FLOOR + "*BOUNDARY\nB-Z1, 1, 2\n*STEP\n*STATIC\n1., 1.\n"
            "*BOUNDARY\nB-Z1, 3, 3, -0.001\n*END STEP\n"
        )

    def test_accuracies_are_kept(self):
        """Limits: from C3D20R and C3D8 with 16 and 32 elements along an edge, of order 1.5."""
        for scene, limit in (("block", 223.35), ("beam", 4.111), ("hertz", self.FORCE)):
            for kind, accuracy in (("C3D10", 0.05), ("C3D4", 0.15)):
                with self.subTest(scene=scene, kind=kind):
                    result = self.solve(getattr(self, scene)(kind), *ASKED, str(accuracy))
                    force = result.pairs[0].resultant[-1, 2]
                    self.assertLess(abs(force / limit - 1), accuracy)

    def test_bending(self):
        """The force at the tip by beam theory, 3 E I d / L^3 with shear, is 4 % off the solid's."""
        result = self.solve(self.beam("C3D10"), "--refine", "1")
        found = result.pairs[0].resultant[-1, 2]
        arm, shear = 5.0, YOUNG / 2.6 * 5 / 6
        theory = 0.01 / (arm**3 / (3 * YOUNG / 12) + arm / shear)
        self.assertTrue(math.isclose(found, theory, rel_tol=0.06), (found, theory))


class Refusals(unittest.TestCase):
    def test_what_is_refused(self):
        for wanted, text, options in (
            ("is a 5-node pyramid, which cannot be refined",
             on_floor(Box("B", (1, 1, 1), ("C3D5",))), ("--refine", "1")),
            ("is a 5-node pyramid, which cannot be refined",
             on_floor(Box("B", (1, 1, 1), ("C3D5",)), at_corner()), ()),
            ("a 5-node pyramid cannot be refined: keep it by *ACCURACY, MESH=KEEP",
             on_floor(Box("B", (1, 1, 1), ("C3D5",))), (*ASKED, "0.1")),
            ("consists of faces with mid-side nodes, and this refines a part of it",
             on_floor(Box("B", (3, 3, 2), ("C3D10",)), "*REFINE, NSET=B-X0\n"), ()),
        ):  # fmt: skip
            with self.subTest(wanted=wanted):
                run = Run(text, *options, name="deck")
                self.assertEqual(run.status, 1, run.output)
                self.assertIn(wanted, run.errors)


if __name__ == "__main__":
    unittest.main()
