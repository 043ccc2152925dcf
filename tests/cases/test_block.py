"""The paper's block against an independent solution (tests/data), and against itself."""

import csv
import math
import unittest
from itertools import pairwise

import numpy as np
from program import DATA, INPUT, Run

BLOCK = INPUT / "block.inp"
CORNERS = {"E": (0, 0, 0), "F": (1, 0, 0), "G": (1, 1, 0), "H": (0, 1, 0)}
VARIANTS = [
    {"formulation": formulation, "local": local}
    for formulation in ("BIPOTENTIAL", "PSEUDOPOTENTIAL")
    for local in ("UZAWA", "NEWTON", "NEWTON6")
]


def reference(n):
    """All steps of the independent solution for n elements an edge; row 0 is the start."""
    with open(DATA / f"ref_n{n}.csv") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{key: float(value) for key, value in row.items()} for row in rows]


def corner_forces(result, corner):
    """Force of the plane on a corner over the run, (T,3) in x, y, z."""
    return force_at(result, CORNERS[corner])


def force_at(result, position):
    """Force of the plane on the node nearest a position over the run, (T,3) in x, y, z."""
    pair = result.pairs[0]
    return pair.force[:, list(pair.nodes).index(result.nearest_node(position))]


def relaxed(share):
    """The block's deck with a relaxation of its sweeps."""
    return BLOCK.read_text().replace("RHO=<rho>", f"RHO=<rho>, RELAXATION={share}")


class PaperBlock(unittest.TestCase):
    """Forces and resultants of every step; source: tests/data/ref_n*.csv, residual 1e-13."""

    def check_against_reference(self, n, **variant):
        rows = reference(n)[1:]
        run = Run(BLOCK, n=n, **variant)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertEqual(result.finished, 50)
            self.assertTrue(np.all(result.history("certified") == 1))
            total = result.pairs[0].resultant[:, 2]
            expected = np.array([row["TN"] for row in rows])
            np.testing.assert_allclose(total, expected, rtol=1e-6)
            for corner in CORNERS:
                force = corner_forces(result, corner)
                for axis, name in enumerate(("rx", "ry", "rn")):
                    expected = np.array([row[f"{corner}_{name}"] for row in rows])
                    # Forces that vanish by symmetry or lift-off are compared beside the others.
                    np.testing.assert_allclose(
                        force[:, axis], expected, rtol=1e-6, atol=1e-8 * abs(force).max()
                    )
            counts = np.array([[r["nopen"], r["nstick"], r["nslide"]] for r in rows])
            status = result.pairs[0].status
            found = np.array([[np.sum(s == k) for k in range(3)] for s in status])
            # A point within rounding of a limit may be counted on either side: at most one a step.
            self.assertLessEqual(np.abs(found - counts).max(), 1)
            return result.pairs[0].reaction.copy()

    def test_every_variant_gives_the_reference(self):
        for n in (1, 2, 4):
            reactions = []
            for variant in VARIANTS:
                with self.subTest(n=n, **variant):
                    reactions.append(self.check_against_reference(n, **variant))
            scale = abs(reactions[0]).max()
            for other in reactions[1:]:
                self.assertLess(abs(other - reactions[0]).max() / scale, 1e-7)

    def test_global_newton_gives_the_reference(self):
        for n in (1, 2, 4):
            with self.subTest(n=n):
                run = Run(BLOCK, n=n, solver="GLOBAL NEWTON", local="AUTO")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    total = result.pairs[0].resultant[:, 2]
                    expected = np.array([row["TN"] for row in reference(n)[1:]])
                    np.testing.assert_allclose(total, expected, rtol=1e-8)
                    self.assertTrue(np.all(result.history("solver") == 2))

    def test_without_poisson_effect_the_force_is_plain(self):
        # E A u/L = 210000 * 1 * 0.1 = 21000.
        for n in (1, 3, 5):
            run = Run(BLOCK, n=n, nu=0, tolerance=1e-12)
            with run.result() as result:
                force = result.pairs[0].resultant[9]
                self.assertAlmostEqual(force[2] / 21000.0, 1.0, delta=1e-10)
                self.assertLess(abs(force[:2]).max(), 1e-11 * force[2])

    def test_a_mirrored_push_gives_mirrored_forces(self):
        with Run(BLOCK, n=4, theta=60).result() as one, Run(BLOCK, n=4, theta=30).result() as two:
            scale = abs(one.pairs[0].resultant).max()
            for corner, mirrored in (("E", "E"), ("F", "H"), ("G", "G"), ("H", "F")):
                force = corner_forces(one, corner)
                image = corner_forces(two, mirrored)[:, [1, 0, 2]]
                self.assertLess(abs(force - image).max() / scale, 1e-8)

    def test_the_whole_block_slides_at_the_end(self):
        # All points slide from step 20-22, and friction is mu times the normal force (tests/data).
        with Run(BLOCK, n=4).result() as result:
            pair = result.pairs[0]
            self.assertTrue(np.all(pair.status[22:] == 2))
            ratio = np.hypot(*pair.resultant[-1, :2]) / pair.resultant[-1, 2]
            self.assertAlmostEqual(ratio, 0.3, delta=1e-7)
            tangential = np.hypot(pair.reaction[-1, :, 1], pair.reaction[-1, :, 2]).sum()
            self.assertAlmostEqual(tangential / pair.reaction[-1, :, 0].sum(), 0.3, delta=1e-9)


class Quarter(unittest.TestCase):
    """Symmetry planes leave two rows, and one at the corner of both."""

    def test_a_quarter_carries_a_quarter(self):
        with Run(INPUT / "quarter.inp", n=4).result() as part, Run(BLOCK, n=4).result() as whole:
            quarter = 4 * part.pairs[0].resultant[:, 2]
            np.testing.assert_allclose(quarter, whole.pairs[0].resultant[:10, 2], rtol=1e-9)
            for position in ((0, 0, 0), (0.25, 0, 0), (0.25, 0.25, 0)):
                mine = force_at(part, position)
                other = force_at(whole, position)[:10]
                self.assertLess(abs(mine - other).max(), 1e-7 * abs(other).max())
            # Nodes on a plane carry half of what the whole block's do, and nothing across it.
            middle = force_at(part, (0.5, 0.25, 0))
            other = force_at(whole, (0.5, 0.25, 0))[:10]
            np.testing.assert_allclose(2 * middle[:, 2], other[:, 2], rtol=1e-7)
            self.assertEqual(abs(middle[:, 0]).max(), 0.0)


class Energy(unittest.TestCase):
    """The balance is of the order of the increment; friction never gives energy back."""

    def test_the_balance_shrinks_with_the_increment(self):
        left = []
        for steps in (50, 100, 200):
            with Run(BLOCK, n=2, steps=steps, tolerance=1e-10).result() as result:
                energy = result.file["history/energy"]
                work = energy["external_work"][-1]
                left.append(abs(energy["balance"][-1]) / work)
                dissipation = np.diff(energy["dissipation"][()])
                self.assertGreaterEqual(dissipation.min(), -1e-12 * work)
        self.assertLess(left[0], 0.05)
        for coarse, fine in pairwise(left):
            self.assertLess(abs(fine / coarse - 0.5), 0.1)

    def test_without_friction_nothing_is_dissipated(self):
        with Run(BLOCK, n=2, mu=0).result() as result:
            energy = result.file["history/energy"]
            self.assertEqual(abs(energy["dissipation"][()]).max(), 0.0)
            work = energy["external_work"][()]
            self.assertLess(abs(energy["balance"][()]).max() / work.max(), 1e-10)


def deformation(points, u):
    """Displacements without the rigid motion that is closest to them."""
    arm = points - points.mean(axis=0)
    motions = [np.tile(e, (len(points), 1)) for e in np.eye(3)]
    motions += [np.cross(e, arm) for e in np.eye(3)]
    motions = np.stack([motion.ravel() for motion in motions], axis=1)
    return u - (motions @ np.linalg.lstsq(motions, u.ravel(), rcond=None)[0]).reshape(u.shape)


class Certificate(unittest.TestCase):
    """The entries in the file, computed again here from the file's own fields."""

    def test_entries_follow_from_the_fields(self):
        with Run(BLOCK, n=3).result() as result:
            pair = result.pairs[0]
            displacement = [result.field("displacement", k) for k in range(50)]
            for row in (0, 9, 25, 49):
                before = displacement[row - 1] if row else 0 * displacement[0]
                now = displacement[row]
                gap = now[pair.nodes, 2]
                slip = (now - before)[pair.nodes, :2]
                np.testing.assert_allclose(pair.gap[row], gap, atol=1e-16)
                np.testing.assert_allclose(pair.slip_increment[row], slip, atol=1e-16)
                reaction = pair.reaction[row]
                support = result.field("reaction_force", row)
                force = max(
                    np.linalg.norm(reaction, axis=1).max(), np.linalg.norm(support, axis=1).max()
                )
                bent = [deformation(result.points, u) for u in (now, now - before)]
                length = max(np.ptp(u, axis=0).max() for u in bent)
                # Contact has moved across the plane, which stays.
                length = max(length, np.linalg.norm((now - before)[pair.nodes], axis=1).max())
                law = np.abs(
                    0.3 * reaction[:, 0] * np.linalg.norm(slip, axis=1)
                    + reaction[:, 0] * gap
                    + (reaction[:, 1:] * slip).sum(axis=1)
                ).sum()
                certificate = result.certificate
                # The measure of forces is that of elements, which are not in the file: it is less
                # than the largest reaction.
                own = law / (length * np.linalg.norm(reaction, axis=1).sum())
                self.assertTrue(0.8 < certificate["law"][row] / own < 1.25)
                self.assertAlmostEqual(
                    certificate["penetration"][row], max(0, (-gap).max()) / length, delta=1e-15
                )
                own = np.abs(gap * reaction[:, 0]).max() / (force * length)
                self.assertTrue(1 < certificate["complementarity"][row] / own < 3)
                # Supports and contact hold each other: the body is in equilibrium.
                total = support.sum(axis=0) + pair.resultant[row]
                self.assertLess(abs(total).max() / force, 1e-10)

    def test_a_loose_tolerance_shows_in_the_certificate(self):
        with Run(BLOCK, n=4, tolerance=1e-3).result() as loose:
            worst = max(values.max() for values in loose.certificate.values())
            self.assertGreater(worst, 1e-6)
            self.assertLessEqual(worst, 1e-2)


class PaperSweeps(unittest.TestCase):
    """Sweeps over the 50 steps at a relative change of 1e-6, from an independent program."""

    ROWS = (
        ({"local": "UZAWA"}, 1576, 3050),
        ({"local": "UZAWA", "rho": 0.3}, 2784, 2567),
        ({"local": "NEWTON"}, 1666, 3360),
        ({"local": "NEWTON6"}, 1666, 3360),
        ({"local": "UZAWA", "formulation": "PSEUDOPOTENTIAL"}, 1651, 3321),
        ({"local": "NEWTON", "formulation": "PSEUDOPOTENTIAL"}, 1666, 3360),
        ({"local": "NEWTON6", "formulation": "PSEUDOPOTENTIAL"}, 1666, 3360),
    )

    def test_counts(self):
        for variant, *expected in self.ROWS:
            for n, count in zip((4, 8), expected, strict=True):
                with self.subTest(n=n, **variant):
                    run = Run(BLOCK, n=n, stop="CHANGE", tolerance=1e-6, **variant)
                    self.assertEqual(run.status, 0, run.errors)
                    with run.result() as result:
                        found = result.history("contact_iterations").sum()
                    self.assertLess(abs(found / count - 1), 0.05)

    def test_under_relaxation_is_flat_in_the_mesh(self):
        counts = []
        for n in (4, 8):
            run = Run(relaxed(0.4), name="relaxed", n=n, stop="CHANGE", tolerance=1e-6)
            with run.result() as result:
                counts.append(result.history("contact_iterations").sum())
        self.assertLess(counts[1], 1.3 * counts[0])


class Extremes(unittest.TestCase):
    """A few ends of the scales; the answer must not depend on the unit system."""

    def test_other_units_give_the_same_iterations_and_forces(self):
        deck = BLOCK.read_text()
        metres = deck.replace("0., 0., 0.,  1., 1., 1.", "0., 0., 0.,  1e-3, 1e-3, 1e-3")
        metres = metres.replace("210000.", "2.1e11").replace("-0.1", "-1e-4")
        metres = metres.replace("0.4*", "4e-4*")
        with Run(BLOCK, n=3).result() as one, Run(metres, name="metres", n=3).result() as two:
            np.testing.assert_array_equal(
                one.history("contact_iterations"), two.history("contact_iterations")
            )
            scale = abs(one.pairs[0].reaction).max()
            difference = abs(one.pairs[0].reaction - two.pairs[0].reaction).max()
            self.assertLess(difference / scale, 1e-10)

    def test_friction_from_none_to_more_than_needed(self):
        for mu in (0, 1e-8, 1, 2.5):
            with self.subTest(mu=mu):
                run = Run(relaxed(0.5), name="relaxed", n=3, mu=mu, tolerance=1e-8)
                self.assertEqual(run.status, 0, run.errors)

    def test_an_untouched_obstacle_takes_no_force(self):
        deck = BLOCK.read_text().replace("0., 0., 0.,  0., 0., 1.", "0., 0., -2.,  0., 0., 1.")
        run = Run(deck, name="apart", n=2)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertEqual(abs(result.pairs[0].reaction).max(), 0.0)
            self.assertTrue(np.all(result.pairs[0].status == 0))
            self.assertEqual(result.history("contact_iterations").sum(), 0)

    def test_a_tilted_scene_gives_the_same_forces(self):
        """The block turned by 30 degrees about y: obstacle, motion and frame turn with it."""
        angle = math.radians(30)
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        n = 2
        with Run(BLOCK, n=n).result() as flat:
            expected = flat.pairs[0].reaction[:, :, 0].copy()
            positions = flat.points.copy()
            elements = flat.elements + 1
        lines = ["*NODE"]
        for k, x in enumerate(positions):
            lines.append(", ".join([str(k + 1), *(repr(float(v)) for v in turn @ x)]))
        lines.append("*ELEMENT, TYPE=C3D8, ELSET=BODY")
        for k, element in enumerate(elements):
            lines.append(", ".join(str(v) for v in [k + 1, *element]))
        top = [k + 1 for k, x in enumerate(positions) if x[2] > 0.999]
        bottom = [k + 1 for k, x in enumerate(positions) if x[2] < 0.001]
        lines += ["*NSET, NSET=TOP", ", ".join(map(str, top))]
        lines += ["*NSET, NSET=BOTTOM", ", ".join(map(str, bottom))]
        normal = turn @ [0, 0, 1]
        lines += [
            "*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3",
            "*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL",
            "*OBSTACLE, NAME=GROUND, TYPE=PLANE",
            "0., 0., 0., " + ", ".join(repr(float(v)) for v in normal),
            "*SURFACE INTERACTION, NAME=DRY", "*FRICTION", "0.3",
            "*CONTACT PAIR, INTERACTION=DRY", "BOTTOM, GROUND",
            "*CONTACT SOLVER, TOLERANCE=1e-10",
        ]
        down = turn @ [0, 0, -0.1]
        push = turn @ [0.4 * math.cos(math.pi / 3), 0.4 * math.sin(math.pi / 3), -0.1]
        for motion, count in ((down, 10), (push, 40)):
            lines += ["*STEP", "*STATIC, DIRECT", f"{1 / count!r}, 1.", "*BOUNDARY"]
            lines += [f"TOP, {k + 1}, {k + 1}, {float(v)!r}" for k, v in enumerate(motion)]
            lines.append("*END STEP")
        run = Run("\n".join(lines), name="tilted")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            found = result.pairs[0].reaction[:, :, 0]
            self.assertLess(abs(found - expected).max() / expected.max(), 1e-8)


if __name__ == "__main__":
    unittest.main()
