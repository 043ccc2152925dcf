"""Cases whose results are known from others: theory, statics and published benchmarks.

Each class is a deck of input/ and names its source; docs/studies/cases.md has the scenes, the
convergence and the figures. What takes more than a few seconds runs where the program is fast.
"""

import unittest
from itertools import pairwise

import numpy as np
from program import INPUT, LONG, Run, in_long_form

from studies.case_values import (  # found through program
    contact_points,
    contact_radius,
    fit_hertz,
    fit_line,
    fit_mindlin,
    hertz,
    stick_radius,
)

ELEMENTS = ("C3D8", "C3D8I", "C3D8B")


class Case(unittest.TestCase):
    """A deck of input/ by its name, run with parameters; the base of all cases here."""

    deck = ""

    def solve(self, status=0, **parameters):
        """Run the deck and return the run; it must end with `status`."""
        run = Run(INPUT / f"{self.deck}.inp", **parameters)
        self.assertEqual(run.status, status, f"{parameters}\n{run.output}{run.errors}")
        return run

    def result(self, **parameters):
        """Run the deck, which must end well, and return its result, open for reading."""
        run = self.solve(**parameters)
        result = run.result()
        self.addCleanup(result.close)
        # The folder of a run goes with it.
        result.of_run = run
        self.assertTrue(np.all(result.history("certified") == 1))
        return result

    def assert_relative(self, found, expected, tolerance, what=""):
        """Fail unless the relative difference is at most the tolerance."""
        error = abs(found / expected - 1)
        self.assertLessEqual(error, tolerance, f"{what}: {found:.6g}, not {expected:.6g}")


class PlateWithFriction(Case):
    """SSNV128, Code_Aster V6.04.128: tangential displacements within 5 %."""

    deck = "ssnv128"
    places = (0.0, 0.00125, 0.005, 0.0075, 0.01125)
    published = (2.86e-5, 2.72e-5, 2.28e-5, 1.98e-5, 1.50e-5)

    def displacements(self, **parameters):
        result = self.result(**parameters)
        u = result.field("displacement", -1)
        return np.array([u[result.nearest_node((x, 0, 0)), 0] for x in self.places])

    def test_displacements_are_the_published_ones(self):
        for element in ELEMENTS:
            u = self.displacements(element=element)
            np.testing.assert_allclose(u, self.published, rtol=0.05)
            # All but the last agree far better.
            np.testing.assert_allclose(u[:-1], self.published[:-1], rtol=0.01)

    def test_the_force_beside_the_middle_is_the_published_one(self):
        # Normal force 1.04864e5 N/m at x = 0.03875 (ssnv128a, the same mesh); half on each side.
        result = self.result()
        pair = result.pairs[0]
        here = np.isclose(pair.coordinates[:, 0], 0.03875)
        force = pair.reaction[-1, here, 0].sum() / result.points[:, 1].max()
        self.assert_relative(force, 1.04864e5, 1e-3)

    def test_one_increment_is_as_good_as_many(self):
        # The load grows in proportion and so does the solution.
        one, many = self.displacements(steps=1), self.displacements(steps=20)
        np.testing.assert_allclose(one, many, rtol=1e-6)

    @in_long_form
    def test_the_mesh_has_converged(self):
        fine = self.displacements(n=128)
        np.testing.assert_allclose(self.displacements(n=32), fine, rtol=0.01)


class Hertz(Case):
    """p0 = 2798.3 MPa, a = 10 mm (SSNV104, Code_Aster V6.04.104); Hertz (1882)."""

    deck = "hertz"

    def test_radius_and_peak_pressure(self):
        points = contact_points(self.result().pairs[0])
        self.assert_relative(4 * points.normal, 4 / 3 * 20000 / 0.91 * 10**3 / 50, 1e-9, "force")
        a, p0 = fit_hertz(points)
        self.assert_relative(a, 10.0, 0.02, "radius")
        self.assert_relative(p0, 2798.3, 0.02, "peak pressure")

    @in_long_form
    def test_finer_meshes_come_closer(self):
        errors = []
        for n in (8, 12, 24):
            a, p0 = fit_hertz(contact_points(self.result(n=n).pairs[0]))
            errors.append(abs(a / 10 - 1) + abs(p0 / 2798.3 - 1))
        for coarse, fine in pairwise(errors):
            self.assertLess(fine, coarse)
        self.assertLess(errors[-1], 0.01)


class Ball(Case):
    """Hertz by a curved obstacle under force."""

    deck = "ball"

    def test_radius_and_peak_pressure(self):
        points = contact_points(self.result().pairs[0])
        a, p0 = hertz(4 / 3 * 20000 / 0.91 / 50, 50.0, 20000 / 0.91)
        self.assert_relative(a, 1.0, 1e-12)
        found = fit_hertz(points)
        self.assert_relative(found[0], a, 0.02, "radius")
        self.assert_relative(found[1], p0, 0.02, "peak pressure")

    def test_the_whole_force_is_carried(self):
        result = self.result(n=8)
        self.assert_relative(-result.pairs[0].resultant[-1, 2], 20000 / 0.91 / 150, 1e-8)


class Roller(Case):
    """Line contact: half width a, p0 = E* a/(2 R) (Johnson, Contact Mechanics, 4.2)."""

    deck = "roller"

    def test_half_width_and_peak_pressure(self):
        a, p0 = fit_line(self.result().pairs[0])
        self.assert_relative(a, 1.0, 0.02, "half width")
        self.assert_relative(p0, 20000 / 0.91 / 100, 0.02, "peak pressure")


class Spence(Case):
    """c/a = 0.5 and 1.31 times Hertz's peak pressure (Kalker 1990, fig. 5.25; Spence 1975)."""

    deck = "spence"

    def values(self, **parameters):
        points = contact_points(self.result(**parameters).pairs[0])
        share = stick_radius(points, 0.2986) / contact_radius(points)
        return share, points.pressure.max() / hertz(4 * points.normal, 121.5, 1.0)[1]

    def test_stick_radius_and_centre_pressure(self):
        for n in (16, 24) if LONG else (16,):
            share, pressure = self.values(n=n, steps=20)
            self.assert_relative(share, 0.5, 0.05, f"stick radius, n = {n}")
            self.assert_relative(pressure, 1.31, 0.03, f"centre pressure, n = {n}")

    def test_too_few_increments_stick_too_little(self):
        n, steps = (16, (1, 2, 5, 20)) if LONG else (12, (1, 2, 5))
        shares = [self.values(n=n, steps=few)[0] for few in steps]
        for few, more in pairwise(shares):
            self.assertLess(few, more)
        self.assertLess(shares[0], 0.3)
        self.assertLess(shares[1], 0.45)


class Mindlin(Case):
    """a = 1, c/a = 0.5, p0 = 4.39 (Cattaneo 1938, Mindlin 1949; Kalker 1990, 5.2.1.1)."""

    deck = "mindlin"

    def test_stick_radius(self):
        result = self.result(n=48)
        points = contact_points(result.pairs[0])
        a, p0 = fit_hertz(points)
        self.assert_relative(a, 1.0, 0.02, "contact radius")
        self.assert_relative(p0, 4.39, 0.02, "peak pressure")
        self.assert_relative(fit_mindlin(points, 0.4)[0] / a, 0.5, 0.05, "stick radius")

    def test_forces_are_those_of_the_tool(self):
        result = self.result(n=12)
        force = -result.pairs[0].resultant[result.step_ends]
        self.assert_relative(force[0, 2], 9.1954 / 2, 1e-7)
        self.assert_relative(force[1, 2], 9.1954 / 2, 1e-7)
        self.assert_relative(-force[1, 0], 0.875 * 0.4 * 9.1954 / 2, 1e-7)

    def test_full_integration_locks(self):
        peak = fit_hertz(contact_points(self.result(element="C3D8").pairs[0]))[1]
        self.assertGreater(peak, 2 * 4.39)


class Slope(Case):
    """Statics: held where tan(alpha) <= mu, at 1e-6 on both sides."""

    deck = "slope"
    scenes = ({}, {"n": 8}, {"n": 2, "nu": 0}, {"n": 1, "nu": 0.45}, {"element": "C3D8I"})

    def test_below_the_limit_friction_holds_it(self):
        for scene in self.scenes:
            for margin in (-1e-6, -1e-3, -1e-2, -0.5):
                with self.subTest(margin=margin, **scene):
                    pair = self.result(margin=margin, **scene).pairs[0]
                    slope = scene.get("mu", 0.3) * (1 + margin)
                    weight = 10 / np.hypot(1, slope) * np.array([-slope, 0, 1])
                    np.testing.assert_allclose(pair.resultant[-1], weight, atol=1e-8 * 10)

    def test_above_the_limit_nothing_balances_it(self):
        for scene in (*self.scenes, {"mu": 0.6}, {"n": 8, "mu": 0.9}):
            for margin in (1e-6, 1e-3, 1e-2, 0.1, 0.5) if LONG else (1e-6, 0.1):
                with self.subTest(margin=margin, **scene):
                    run = self.solve(status=2, margin=margin, **scene)
                    words = run.output + run.errors
                    self.assertIn("nothing balances", words)
                    self.assertIn("body 1", words)
                    self.assertIn("translation along", words)


class Patch(Case):
    """Constant stress in distorted elements is exact (Irons's patch test), under contact too."""

    deck = "patch"

    def test_stress_and_pressure_are_uniform(self):
        for element in ELEMENTS:
            with self.subTest(element=element):
                result = self.result(element=element)
                stress = result.field("stress", -1)
                error = abs(stress - np.array([0, 0, -10.0, 0, 0, 0])).max()
                self.assertLess(error / 10, 1e-10)
                for pair in result.pairs.values():
                    pressure = pair.reaction[-1, :, 0] / pair.area
                    self.assertLess(abs(pressure / 10 - 1).max(), 1e-10)
                self.assertLess(abs(result.field("reaction_force", -1)).max(), 1e-10)


class Cantilever(Case):
    """Timoshenko's beam; the locking of one element in bending is known in closed form."""

    deck = "cantilever"

    def tip(self, **parameters):
        """Deflection of the tip over Timoshenko's."""
        result = self.result(**parameters)
        tip = np.isclose(result.points[:, 0], 10.0)
        found = result.field("displacement", -1)[tip, 2].mean()
        load, moment = parameters.get("pressure", 0.001), parameters.get("moment", 0.0)
        shear = 5 / 6 * 1000 / (2 * (1 + parameters.get("nu", 0)))
        beam = load * 10**4 / (8 * 1000 / 12) + load * 10**2 / (2 * shear)
        return -found / (beam + moment * 10**2 / (2 * 1000 / 12))

    def test_incompatible_modes_bend(self):
        self.assert_relative(self.tip(element="C3D8I"), 1.0, 0.005)
        self.assert_relative(self.tip(element="C3D8I", n=4), 1.0, 0.001)
        # The clamp also holds the beam's width and height, which theory lets go.
        self.assert_relative(self.tip(element="C3D8I", nu=0.3), 1.0, 0.02)

    def test_bending_by_a_moment_is_exact_with_incompatible_modes(self):
        for slices in (2, 5, 10):
            ratio = self.tip(element="C3D8I", pressure=0, moment=0.001, slices=slices)
            self.assert_relative(ratio, 1.0, 1e-9)

    def test_full_integration_locks_as_known(self):
        # 1/(1 + (l/h)^2/2) for nu = 0, l and h length and height of an element (Cook et al., 2002).
        for slices in (2, 5, 10, 20):
            ratio = self.tip(element="C3D8", pressure=0, moment=0.001, slices=slices)
            self.assert_relative(ratio, 1 / (1 + (10 / slices) ** 2 / 2), 1e-9)

    def test_every_element_converges(self):
        for element in ELEMENTS:
            coarse, fine = (abs(self.tip(element=element, n=n) - 1) for n in (1, 4))
            self.assertLess(fine, 0.04)
            self.assertLess(fine, coarse)


class Incompressible(Case):
    """Gent and Lindley (1959): 4/3 E (1 + S^2) for a long bonded strip, S = width/(2 height)."""

    deck = "incompressible"

    def modulus(self, **parameters):
        """Mean pressure on the plate over the mean strain."""
        result = self.result(**parameters)
        top = np.isclose(result.points[:, 2], 1.0)
        area = result.points[:, 0].max() * result.points[:, 1].max()
        return -result.field("reaction_force", -1)[top, 2].sum() / area / 0.01

    def test_only_full_integration_locks(self):
        theory = 4 / 3 * (1 + 1)
        self.assert_relative(self.modulus(n=8, element="C3D8B"), theory, 0.02)
        self.assert_relative(self.modulus(n=8, element="C3D8I"), theory, 0.02)
        self.assertGreater(self.modulus(n=8, element="C3D8"), 3 * theory)

    def test_the_mesh_has_converged(self):
        fine = self.modulus(n=32)
        self.assert_relative(self.modulus(n=8), fine, 0.015)
        self.assert_relative(fine, 4 / 3 * (1 + 1), 0.005)

    def test_compressible_material_does_not_lock(self):
        self.assert_relative(
            self.modulus(n=8, nu=0.3, element="C3D8"), self.modulus(n=8, nu=0.3), 0.01
        )


class Fall(Case):
    """A cube in free fall has no equilibrium, and the run names the motion."""

    deck = "fall"

    def test_the_motion_is_named(self):
        for element in ELEMENTS:
            run = self.solve(status=2, element=element)
            self.assertIn("nothing balances", run.output + run.errors)
            self.assertIn("translation along z", run.output + run.errors)


class Rest(Case):
    """A cube on a frictionless plane keeps three motions that nothing drives."""

    deck = "rest"

    def test_three_motions_are_named(self):
        words = self.solve().output
        for motion in ("translation along x", "translation along y", "rotation about z"):
            self.assertIn(motion, words)

    def test_the_plane_carries_the_weight(self):
        for n in (1, 4, 8):
            pair = self.result(n=n).pairs[0]
            np.testing.assert_allclose(pair.resultant[-1], [0, 0, 10], atol=1e-8)
            # The pressure's centre is below the weight's.
            np.testing.assert_allclose(pair.moment[-1, :2], [5, -5], atol=1e-7)


class Corner(Case):
    """Statics: three frictionless planes carry the three parts of the weight."""

    deck = "corner"

    def test_each_plane_carries_its_part(self):
        for n in (1, 2, 4, 8):
            pairs = self.result(n=n).pairs
            parts = zip(pairs.values(), np.eye(3), (4.8, 3.6, 8.0), strict=True)
            for pair, direction, part in parts:
                np.testing.assert_allclose(pair.resultant[-1], part * direction, atol=1e-7)


class Pipe(Case):
    """Statics: two edges carry the weight, each at cos(theta) = 0.8 across the wall."""

    deck = "pipe"

    def test_the_edges_carry_the_weight(self):
        for E, tolerance in ((1e5, 1e-3), (1e8, 1e-6)):
            pair = self.result(E=E).pairs[0]
            self.assert_relative(pair.resultant[-1, 2], 12.0, 1e-8)
            self.assert_relative(pair.normal_sum[-1], 12.0 / 0.8, tolerance)

    def test_slide_and_swing_are_named(self):
        words = self.solve().output
        self.assertIn("translation along y, translation along x with rotation about y", words)

    def test_nothing_balances_a_driven_swing(self):
        for side in (0.1, 1e-5):
            words = self.solve(status=2, side=side).errors
            self.assertIn("nothing balances", words)
            self.assertIn("translation along x with rotation about y", words)


class Bend(Case):
    """Statics and Timoshenko: a loose beam, bent over two rollers by a third one."""

    deck = "bend"
    force, a, b, height, width = 1e-3, 3.0, 1.0, 0.4, 0.6

    def test_the_rollers_share_the_force(self):
        names = ("BEAM-ZMIN:LEFT", "BEAM-ZMIN:RIGHT", "BEAM-ZMAX:TOP")
        for pairs in (self.result(n=2).pairs, self.result(n=2, mu=0.2).pairs):
            left, right, top = (pairs[name].resultant[-1] for name in names)
            self.assert_relative(-top[2], self.force, 1e-7)
            # Of the moments about the right roller: friction of the third one acts a height above.
            moment = self.force * self.b - top[0] * self.height
            self.assert_relative(left[2], moment / (self.a + self.b), 1e-3)
            self.assert_relative(left[2] + right[2], self.force, 1e-7)

    def test_the_deflection_is_that_of_a_beam(self):
        result = self.result(n=4)
        place, moved = result.points, result.field("displacement", -1)

        def sinks(x):
            axis = (abs(place[:, 0] - x) < 1e-6) & (abs(place[:, 2] - self.height / 2) < 1e-6)
            return -moved[axis, 2].mean()

        length = self.a + self.b
        between = (sinks(-2) * self.b + sinks(2) * self.a) / length
        inertia, area = self.width * self.height**3 / 12, self.width * self.height
        bending = self.force * (self.a * self.b) ** 2 / (3 * 1000 * inertia * length)
        shear = self.force * self.a * self.b / (5 / 6 * 1000 / 2.6 * area * length)
        self.assert_relative(sinks(1) - between, bending + shear, 0.02)


class Tool(Case):
    """All points slide at the end and carry mu times their normal force, against the drag."""

    deck = "tool"

    def test_the_dragged_contact_slides(self):
        for mu in (0.1, 0.2, 0.5):
            pair = self.result(mu=mu).pairs[0]
            normal = pair.reaction[-1, :, 0]
            friction = np.linalg.norm(pair.reaction[-1, :, 1:], axis=1)
            self.assertTrue(np.all(pair.status[-1, normal > 0] == 2))
            np.testing.assert_allclose(friction, mu * normal, atol=1e-7 * normal.max())
            drag = pair.resultant[-1, 0] / -pair.resultant[-1, 2]
            self.assert_relative(drag, mu, 0.05)


if __name__ == "__main__":
    unittest.main()
