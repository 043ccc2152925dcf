"""The judge, the independent finite-element program of tests/judge, on solutions checked by hand.

And on results in which one number was changed. test_judge_decks.py has it judge random decks.
"""

import shutil
import subprocess
import sys
import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
from judged import findings
from program import PROGRAM, SOURCE, in_long_form

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

from body_scenes import random_bodies
from contact_patterns import least_of_patterns
from elements import Elements
from finite_elements import (
    BLATZ_KO,
    MOONEY_RIVLIN,
    NEO_HOOKE,
    OGDEN,
    ST_VENANT,
    YEOH,
    FiniteElements,
    ogden_terms,
    yeoh_terms,
)
from finite_refusals import confirm_finite
from finite_scenes import turn_side
from laws import Judge, Stored
from load_path import LoadPath, kinks_of
from mortar import least_on_edges, place_surface
from obstacles import chords, rotation
from random_scenes import Builder
from refusals import (
    CONFIRMED,
    as_stored,
    confirm,
    judge_solution,
    missed_depth,
    pieces_come_apart,
    unbalanced_share,
)
from scenes import Boundary, Force, Gravity, Pressure, Step, Tie, deck_of, write_deck
from slow_solver import Increment, Solution

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
                 (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float)  # fmt: skip


def distorted_cube():
    """An element with no two faces alike."""
    return CUBE + 0.15 * np.random.default_rng(3).uniform(-1, 1, CUBE.shape)


class InternalForces(unittest.TestCase):
    """The judge's own elements."""

    def test_constant_strain_gives_constant_stress_in_distorted_elements(self):
        x = distorted_cube()
        strain = np.array([(1.0, 0.2, -0.3), (0.2, -0.5, 0.4), (-0.3, 0.4, 0.7)])
        young, poisson = 1000.0, 0.3
        lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        stress = lame * np.trace(strain) * np.eye(3) + young / (1 + poisson) * strain
        for element in ("C3D8", "C3D8I", "C3D8B"):
            elements = Elements(x, [range(8)], [element], [young], [poisson])
            force = elements.internal_force(x @ strain)
            # A unit pressure all around is the stress -I: its forces are -int g_a dV.
            expected = -elements.pressure_force([(0, f) for f in range(6)]) @ stress
            with self.subTest(element=element):
                np.testing.assert_allclose(force, expected, atol=1e-12 * np.abs(force).max())

    def test_stiffness_is_the_derivative_of_forces_and_knows_rigid_motions(self):
        x = distorted_cube()
        rng = np.random.default_rng(5)
        for element in ("C3D8", "C3D8I", "C3D8B"):
            elements = Elements(x, [range(8)], [element], [1000.0], [0.4])
            k = elements.stiffness()
            u = rng.normal(size=(8, 3))
            with self.subTest(element=element):
                force = elements.internal_force(u).ravel()
                np.testing.assert_allclose(k @ u.ravel(), force, atol=1e-11 * np.abs(force).max())
                values = np.linalg.eigvalsh(k)
                self.assertLess(np.abs(values[:6]).max(), 1e-12 * values[-1])
                self.assertGreater(values[6], 1e-4 * values[-1])

    def test_a_beam_of_one_element_bends_as_the_page_of_theory_says(self):
        # nu = 0, length L, height h: C3D8 is 1 + (L/h)^2/2 times too stiff, C3D8I is exact.
        length, height = 3.0, 0.5
        x = CUBE * (length, 1.0, height)
        u = np.zeros((8, 3))
        u[:, 0] = (x[:, 0] - length / 2) * (x[:, 2] - height / 2)
        exact = 1000.0 * length * height**3 / 12  # E I L kappa^2, kappa = 1
        for element, factor in (("C3D8I", 1.0), ("C3D8", 1 + (length / height) ** 2 / 2)):
            elements = Elements(x, [range(8)], [element], [1000.0], [0.0])
            work = np.sum(u * elements.internal_force(u))
            with self.subTest(element=element):
                self.assertAlmostEqual(work / exact, factor, delta=1e-12 * factor)

    def test_an_element_inside_out_has_no_volume(self):
        x = distorted_cube()
        elements = Elements(x, [range(8)], ["C3D8"], [1.0], [0.3])
        for stretch in (-1.5, -0.5, 0.3):  # det(I + grad u) = 1 + stretch, everywhere
            u = np.zeros((8, 3))
            u[:, 2] = stretch * x[:, 2]
            self.assertAlmostEqual(elements.least_volume(u), 1 + stretch, delta=1e-12)

    def test_weight_and_pressure(self):
        x = CUBE * (2.0, 1.0, 0.5)
        elements = Elements(x, [range(8)], ["C3D8"], [1.0], [0.0])
        np.testing.assert_allclose(elements.weights([3.0], np.array([0])), 3.0 / 8, rtol=1e-14)
        top = elements.pressure_force([(0, 1)])
        np.testing.assert_allclose(top[4:], np.tile((0, 0, -0.5), (4, 1)), atol=1e-14)
        np.testing.assert_allclose(top[:4], 0)


class FiniteForces(unittest.TestCase):
    """The judge's elements at finite strain."""

    LAWS = (
        (ST_VENANT, 0.0), (NEO_HOOKE, 0.0), (MOONEY_RIVLIN, 0.4), (BLATZ_KO, 0.0), (YEOH, 0.4),
        (OGDEN, 0.4),
    )

    def elements(self, law, x=None):
        """One element; of all laws lambda = G = 400."""
        return FiniteElements(
            distorted_cube() if x is None else x, [range(8)], ["C3D8"], [1000.0], [0.25], [law]
        )

    def test_closed_forms_of_uniaxial_strain(self):
        # The force on the undeformed area 1 at a stretch, by each law's page in the theory.
        lame = shear = 400.0
        bulk = lame + 2 * shear / 3
        for stretch in (0.6, 1.0 + 1e-9, 1.8):
            k = stretch**2 - 1
            first = stretch ** (-5 / 3) * 2 * k / 3
            second = stretch ** (-7 / 3) * 2 * k / 3
            longer = np.log1p(stretch - 1)
            x = 3 * np.expm1(-2 / 3 * longer) + k * stretch ** (-2 / 3)
            c20, c30 = yeoh_terms(0.4)
            principal = sum(
                4 * mu / (3 * a) * (np.expm1(2 * a / 3 * longer) - np.expm1(-a / 3 * longer))
                for mu, a in ogden_terms(0.4)
            )
            expected = {
                ST_VENANT: (lame + 2 * shear) / 2 * k * stretch,
                NEO_HOOKE: shear * first + bulk * (stretch - 1),
                MOONEY_RIVLIN: shear * (0.6 * first + 0.4 * second) + bulk * (stretch - 1),
                BLATZ_KO: shear * (1 - stretch**-3),
                YEOH: shear * (1 + 2 * c20 * x + 3 * c30 * x**2) * first + bulk * (stretch - 1),
                OGDEN: shear * principal / stretch + bulk * (stretch - 1),
            }
            for law in self.LAWS:
                u = np.zeros((8, 3))
                u[:, 2] = (stretch - 1) * CUBE[:, 2]
                force = self.elements(law, CUBE).internal_force(u)[4:, 2].sum()
                with self.subTest(law=law, stretch=stretch):
                    self.assertAlmostEqual(force / expected[law[0]], 1.0, delta=2e-7)

    def test_forces_turn_with_the_element_and_small_ones_are_linear(self):
        rng = np.random.default_rng(5)
        x, v = distorted_cube(), rng.uniform(-0.2, 0.2, (8, 3))
        turn = rotation((0.4, -1.3, 2.0)).astype(float)
        linear = Elements(x, [range(8)], ["C3D8"], [1000.0], [0.25])
        for law in self.LAWS:
            elements = self.elements(law)
            force = elements.internal_force(v)
            turned = elements.internal_force((x + v) @ turn.T - x)
            largest = np.abs(force).max()
            little = elements.internal_force(1e-9 * v) / 1e-9
            with self.subTest(law=law):
                np.testing.assert_allclose(turned, force @ turn.T, atol=1e-12 * largest)
                moment = np.cross(x + v, force).sum(axis=0)
                np.testing.assert_allclose(moment, 0, atol=1e-12 * largest)
                np.testing.assert_allclose(little, linear.internal_force(v), atol=1e-6 * largest)
                self.assertAlmostEqual(
                    (elements.energy(v * (1 + 1e-5)) - elements.energy(v * (1 - 1e-5))) / 2e-5,
                    np.sum(force * v), delta=1e-7 * largest,
                )  # fmt: skip

    def test_tangent_and_bands(self):
        v = np.random.default_rng(5).uniform(-0.2, 0.2, (8, 3))
        for law in self.LAWS:
            elements = self.elements(law)
            ends = [elements.internal_force(v * (1 + s)) for s in (1e-6, -1e-6)]
            change = (ends[0] - ends[1]).ravel() / 2e-6
            with self.subTest(law=law):
                np.testing.assert_allclose(elements.tangent(v) @ v.ravel(), change,
                                           atol=1e-6 * np.abs(change).max())  # fmt: skip
        # Knowles and Sternberg: Blatz and Ko's law is elliptic to a ratio of 2 + sqrt(3).
        for ratio, elliptic in ((3.6, True), (3.85, False)):
            u = CUBE * (np.array([ratio**0.5, ratio**-0.5, 1.0]) - 1)
            least = self.elements((BLATZ_KO, 0.0), CUBE).least_acoustic(u)
            self.assertEqual(least > 0, elliptic)

    def test_pressure_follows(self):
        turn = rotation((0.0, 0.7, 0.0)).astype(float)
        elements = self.elements(self.LAWS[0], CUBE)
        force = elements.pressure_force([(0, 1)], 2 * CUBE @ turn.T - CUBE).sum(axis=0)
        np.testing.assert_allclose(force, turn @ (0, 0, -4), atol=1e-14)


def cube_scene(**options):
    """A cube of one part before a plane below it, without steps: (builder, part)."""
    b = Builder(0, np.random.default_rng(1))
    young, cells = options.pop("young", 1000.0), options.pop("cells", (2, 2, 2))
    density = options.pop("density", None)
    material = b.material(young, 0.3, density)
    part = b.part((0, 0, 0), (1, 1, 1), cells, material, "C3D8", options.pop("explicit", False))
    return b, part


def add_step(b, **options):
    """A step of one increment."""
    step = Step(1.0, options.pop("increments", 1), True)
    b.scene.steps.append(step)
    return step


def plane_below(b, part, friction):
    """The pair of the lower side and a plane that touches it."""
    b.rng = np.random.default_rng(1)
    plane = b.obstacle("PLANE", (0, 0, 0), (0, 0, 1))
    b.pair(part, "ZMIN", plane, friction)


class Paths(unittest.TestCase):
    """What is prescribed at a time, by hand."""

    def test_ramps_amplitudes_and_ends(self):
        b, part = cube_scene(cells=(1, 1, 1))
        first, second, third = (add_step(b) for _ in range(3))
        b.scene.amplitudes.append(([0.0, 0.5], [1.0, 3.0]))
        first.forces.append(Force([0], 0, 8.0))
        first.pressures.append(Pressure(part, "ZMAX", 4.0, 0))
        second.forces.append(Force([0], 0, 2.0))
        third.new.add("*DSLOAD")
        path = LoadPath(b.finish("by hand"))
        nothing = np.zeros_like(path.scene.points)
        path.begin(0, nothing)
        self.assertEqual(path.loads(0.5)[0, 0], 4.0)
        self.assertAlmostEqual(path.loads(0.25)[:, 2].sum(), -8.0, delta=1e-13)
        path.begin(1, nothing)
        self.assertEqual(path.loads(0.5)[0, 0], 5.0)
        self.assertAlmostEqual(path.loads(0.5)[:, 2].sum(), -12.0, delta=1e-13)
        path.begin(2, nothing)
        self.assertEqual(path.loads(0.5)[0, 0], 2.0)
        self.assertAlmostEqual(path.loads(0.5)[:, 2].sum(), -6.0, delta=1e-13)
        self.assertAlmostEqual(path.loads(1.0)[:, 2].sum(), 0.0, delta=1e-13)

    def test_supports(self):
        b, _ = cube_scene(cells=(1, 1, 1))
        first, second = add_step(b), add_step(b)
        b.scene.amplitudes.append(([0.0, 1.0], [1.0, 1.0]))
        first.boundaries.append(Boundary([0], 1, 0.1, 0))
        first.boundaries.append(Boundary([1], 1, 0.2))
        second.boundaries.append(Boundary([1], 1, 0.4))
        path = LoadPath(b.finish("by hand"))
        u = np.zeros_like(path.scene.points)
        path.begin(0, u)
        self.assertEqual(path.supports(0.5)[0, 1][0], 0.1)
        self.assertEqual(path.supports(0.5)[1, 1][0], 0.1)
        u[0, 1], u[1, 1] = 0.1, 0.2
        path.begin(1, u)
        self.assertEqual(path.supports(0.5)[0, 1][0], 0.1)
        self.assertAlmostEqual(path.supports(0.5)[1, 1][0], 0.3, delta=1e-16)


    def test_kinks_are_where_slopes_change(self):
        # Constant before 0.5, a bend at 1, none at 1.5, constant from 2 on; the ends do not count.
        table = ([0.5, 1.0, 1.5, 2.0], [1.0, 2.0, 5.0, 8.0])
        self.assertEqual(kinks_of(table, 3.0), [0.5, 1.0, 2.0])
        self.assertEqual(kinks_of(table, 1.0), [0.5])
        self.assertEqual(kinks_of(([0.0, 1.0], [2.0, 2.0]), 3.0), [])


class Solver(unittest.TestCase):
    """The judge's own solver, and the judge on what it finds."""

    def one(self, b):
        """(solution, findings) of the only increment of a scene."""
        scene = b.finish("by hand")
        path = LoadPath(scene)
        nothing = np.zeros_like(scene.points)
        path.begin(0, nothing)
        increment = Increment(scene, nothing, path.supports(1.0), path.loads(1.0))
        found = increment.solve(1e-8)
        return found, judge_solution(scene, path, increment, found, 0, 1.0, 0.0)

    def test_uniform_compression(self):
        # nu = 0.3, no friction: u_z = -p/E, reactions p A.
        b, part = cube_scene()
        plane_below(b, part, 0.0)
        step = add_step(b)
        step.pressures.append(Pressure(part, "ZMAX", 10.0))
        for row, dof in ((0, 0), (0, 1), (2, 1)):
            step.boundaries.append(Boundary([row], dof, 0.0))
        found, findings = self.one(b)
        self.assertEqual(findings, [])
        self.assertAlmostEqual(found.forces[0][:, 2].sum(), 10.0, delta=1e-9)
        self.assertAlmostEqual(found.u[-1, 2], -0.01, delta=1e-12)

    def test_friction_along_held_tangents_follows_the_known_slip(self):
        # All nodes are moved along x and held in y: the friction is mu p A against it.
        b, part = cube_scene()
        plane_below(b, part, 0.3)
        step = add_step(b)
        for dof, value in ((0, 0.1), (1, 0.0)):
            step.boundaries.append(Boundary(list(range(27)), dof, value))
        step.pressures.append(Pressure(part, "ZMAX", 10.0))
        found, findings = self.one(b)
        self.assertEqual(findings, [])
        np.testing.assert_allclose(found.forces[0].sum(axis=0), (-3.0, 0.0, 10.0), atol=1e-9)
        # Without it the law is broken, and the judge says so.
        frictionless = [force * (0.0, 0.0, 1.0) for force in found.forces]
        path, increment = self.context(b)
        bare = Solution(found.u, frictionless, True, 0.0, 0.0)
        findings = judge_solution(b.scene, path, increment, bare, 0, 1.0, 0.0)
        self.assertIn("friction law", {f.kind for f in findings})

    def context(self, b):
        """A path and an increment of a scene."""
        path = LoadPath(b.scene)
        nothing = np.zeros_like(b.scene.points)
        path.begin(0, nothing)
        return path, Increment(b.scene, nothing, path.supports(1.0), path.loads(1.0))

    def test_loads_on_a_held_body_hide_none_on_a_free_one(self):
        b, part = cube_scene(cells=(1, 1, 1))
        plane_below(b, part, 0.0)
        other = b.part((5, 0, 0), (1, 1, 1), (1, 1, 1), 0, "C3D8", False)
        step = add_step(b)
        for dof in range(3):
            step.boundaries.append(Boundary(list(b.scene.parts[other].rows), dof, 0.0))
        step.forces += [Force([0], 0, 1e-11), Force([8], 0, 1e5)]
        b.finish("one held, one free")
        path, increment = self.context(b)
        left = unbalanced_share(b.scene, increment.before, increment.held, path.loads(1.0))
        self.assertGreater(left, 0.99)

    @in_long_form
    def test_a_gap_keeps_two_planes_from_holding_a_block(self):
        # Both could clamp it with any force, so that reactions alone balance every load: but where
        # a gap is left no pattern of contact does. Where they press it friction holds it.
        for gap, holds in ((-0.001, True), (0.01, False)):
            b, part = cube_scene(cells=(1, 1, 1))
            plane_below(b, part, 0.3)
            plane = b.obstacle("PLANE", (0, 0, 1 + gap), (0, 0, -1))
            b.pair(part, "ZMAX", plane, 0.3)
            step = add_step(b)
            step.forces.append(Force([0], 0, 0.1))
            b.finish("between planes")
            path, increment = self.context(b)
            left = unbalanced_share(b.scene, increment.before, increment.held, path.loads(1.0))
            with self.subTest(gap=gap):
                self.assertLess(left, 1e-9)
                self.assertEqual(least_of_patterns(increment, 1e-2) is None, holds)

    @in_long_form
    def test_patterns_know_the_angle_of_friction(self):
        # To 2 %, by which a pyramid is wider than its cone.
        for tangent, holds in ((0.299, True), (0.31, False)):
            _, increment = self.slope(tangent)
            with self.subTest(tangent=tangent):
                self.assertEqual(least_of_patterns(increment, 1e-5) is None, holds)

    def slope(self, tangent):
        """(path, increment) of a block on a plane, mu 0.3, and gravity as much from its normal."""
        b, part = cube_scene(density=1.0)
        plane_below(b, part, 0.3)
        step = add_step(b)
        step.gravity.append(Gravity(part, 1.0, np.array([tangent, 0.0, -1.0])))
        b.finish("slope")
        return self.context(b)

    def test_a_block_on_a_slope_holds_up_to_the_angle_of_friction(self):
        for tangent, holds in ((0.299, True), (0.301, False)):
            path, increment = self.slope(tangent)
            scene = increment.scene
            left = unbalanced_share(scene, increment.before, increment.held, path.loads(1.0))
            with self.subTest(tangent=tangent):
                self.assertEqual(left < 1e-9, holds, left)
                words = confirm(scene, None, "nothing balances the loads along")
                self.assertEqual(words[0] == CONFIRMED, not holds, words)

    def test_what_falls_and_is_called_solved_is_condemned(self):
        # As large as a factor of rounding makes it; only x is held.
        b, part = cube_scene(density=1.0)
        b.obstacle("PLANE", (1, 0, 0), (-1, 0, 0))
        b.pair(part, "XMAX", 0, 0.0)
        step = add_step(b)
        b.hold(step, part, "XMIN", (0,))
        step.gravity.append(Gravity(part, 1.0, np.array([0.0, 0.0, -1.0])))
        b.finish("falls")
        path, increment = self.context(b)
        for far in (1e31, 1e3, 0.0):
            u = np.zeros_like(b.scene.points)
            u[:, 2] = -far
            nothing = Solution(u, [np.zeros((9, 3))], True, 0.0, 0.0)
            stored = as_stored(b.scene, increment, nothing, 0, 1.0)
            judge = Judge(b.scene, stored)
            judge.path = path
            judge.judge_increment(0, 1.0, increment.before)
            with self.subTest(far=far):
                self.assertIn("body out of balance by", {f.kind for f in judge.findings})

    def test_rounding_is_no_excuse_beside_forces(self):
        # A stiff head on a soft foot, far away: the last places of its displacements are forces
        # larger than those of the foot.
        b = Builder(0, np.random.default_rng(1))
        soft, stiff = b.material(1.0, 0.3), b.material(1e8, 0.3)
        part = b.part((0, 0, 0), (1, 1, 2), (1, 1, 4), soft, "C3D8", True, False, stiff)
        plane_below(b, part, 0.0)
        step = add_step(b)
        b.hold(step, part, "ZMAX", (0, 1), 1000.0)
        b.hold(step, part, "ZMAX", (2,), -1e-3)
        found, findings = self.one(b)
        self.assertTrue({f.kind for f in findings} & {"out of balance"}, findings)
        path, increment = self.context(b)
        stored = as_stored(b.scene, increment, found, 0, 1.0)
        judge = Judge(b.scene, stored)
        judge.path = path
        judge.judge_increment(0, 1.0, increment.before)
        self.assertIn("out of balance", {f.kind for f in judge.findings})

    def test_forces_of_rounding_have_no_law(self):
        # The cube goes along with its supports before a plane that it just touches: reactions of
        # rounding, whichever way, are no finding. A strain of 1e-6 makes them one.
        b, part = cube_scene(young=1e11)
        plane_below(b, part, 0.3)
        step = add_step(b)
        b.hold(step, part, "ZMAX", (0, 1, 2))
        scene = b.finish("along")
        path, increment = self.context(b)
        far = np.zeros_like(scene.points)
        far[:, 0] = 1e-3
        for strain, kinds in ((0.0, set()), (1e-6, {"adhesion", "cone", "friction law"})):
            u = far + strain * scene.points * (0, 1, 0)
            forces = np.zeros((9, 3))
            forces[4] = (1e-9, 0.0, -1e-9) if strain == 0 else (1e4, 0.0, -1e4)
            stored = as_stored(scene, increment, Solution(u, [forces], True, 0.0, 0.0), 0, 1.0)
            judge = Judge(scene, stored)
            judge.path = path
            judge.judge_increment(0, 1.0, increment.before)
            laws = {"adhesion", "cone", "complementarity", "friction law"}
            with self.subTest(strain=strain):
                self.assertEqual({f.kind for f in judge.findings} & laws, kinds)

    def test_loads_that_contact_takes_at_once_move_nothing(self):
        # A pressure on the side that the plane holds: displacements are rounding, and slip is too.
        b, part = cube_scene(cells=(1, 1, 1), young=1e5)
        plane_below(b, part, 0.5)
        step = add_step(b)
        step.pressures.append(Pressure(part, "ZMIN", -100.0))
        b.hold(step, part, "ZMAX", (0, 1, 2))
        found, findings = self.one(b)
        self.assertEqual(findings, [])
        self.assertLess(np.abs(found.u).max(), 1e-15)
        rng = np.random.default_rng(1)
        path, increment = self.context(b)
        for size, kinds in ((1e-12, set()), (1e-6, {"friction law"})):
            # The first is far below 1e-7 of the way of a node under its force, 25/(k of 4e4).
            u = found.u.copy()
            u[:4, :2] = size * rng.uniform(0.5, 1, (4, 2))
            bent = Solution(u, found.forces, True, 0.0, 0.0)
            stored = as_stored(b.scene, increment, bent, 0, 1.0)
            judge = Judge(b.scene, stored)
            judge.path = path
            judge.judge_increment(0, 1.0, increment.before)
            with self.subTest(size=size):
                self.assertEqual({f.kind for f in judge.findings} & {"friction law"}, kinds)

    def test_a_tool_between_nodes_is_seen(self):
        # A sphere is in a face whose nodes are open: in its middle, and small beside the middle.
        for radius, x, y, deep, allowed in (
            (0.1, 0.5, 0.5, 0.01, 1e-12), (0.01, 0.527, 0.473, 0.006, 1e-3)
        ):  # fmt: skip
            b, part = cube_scene(cells=(1, 1, 1))
            b.obstacle("SPHERE", (x, y, 1 + radius - deep), radius=radius)
            b.pair(part, "ZMAX", 0, 0.0)
            step = add_step(b)
            b.hold(step, part, "ZMIN", (0, 1, 2))
            scene = b.finish("between")
            _, increment = self.context(b)
            u = np.zeros_like(scene.points)
            for force, depth in ((0.0, deep), (1.0, 0.0)):
                solution = Solution(u, [np.full((4, 3), force)], True, 0.0, 0.0)
                found = missed_depth(scene, increment, solution)
                with self.subTest(radius=radius, force=force):
                    self.assertAlmostEqual(found, depth, delta=allowed)

    def test_a_jump_that_is_lost_is_condemned(self):
        b, part = cube_scene(cells=(1, 1, 1))
        step = add_step(b)
        b.scene.amplitudes.append(([0.0, 1.0], [1.0, 1.0]))
        b.hold(step, part, "ZMAX", (2,), 0.1, 0)
        b.hold(step, part, "ZMIN", (0, 1, 2))
        b.finish("jump")
        path, increment = self.context(b)
        lost = Solution(np.zeros_like(b.scene.points), [], True, 0.0, 0.0)
        kinds = {f.kind for f in judge_solution(b.scene, path, increment, lost, 0, 1.0, 0.0)}
        self.assertEqual(kinds, {"prescribed displacement off by"})

    def test_a_falling_body_is_not_balanced(self):
        b, part = cube_scene(density=1.0)
        step = add_step(b)
        b.obstacle("PLANE", (1, 0, 0), (-1, 0, 0))
        b.pair(part, "XMAX", 0, 0.0)
        b.hold(step, part, "XMIN", (0,))
        step.gravity.append(Gravity(part, 1.0, np.array([0.0, 0.0, -1.0])))
        scene = b.finish("falls")
        self.assertEqual(confirm(scene, None, "nothing balances the loads along")[0], CONFIRMED)


class Tampered(unittest.TestCase):
    """A right result is right; with one number changed it is wrong."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="judge-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        b, part = cube_scene(explicit=True)
        plane_below(b, part, 0.4)
        first, second = add_step(b), add_step(b, increments=3)
        b.hold(first, part, "ZMAX", (0, 1))
        b.hold(first, part, "ZMAX", (2,), -0.01)
        b.hold(second, part, "ZMAX", (0,), 0.02)
        second.pressures.append(Pressure(part, "XMIN", 2.0))
        # A second body, free, which lies on the plane of the first.
        material = b.material(50.0, 0.2, 1.0)
        other = b.part((3, 0, 0), (1, 1, 1), (1, 1, 1), material, "C3D8B", False)
        b.scene.materials[0].density = 1.0
        b.pair(other, "ZMIN", 0, 0.5)
        first.gravity.append(Gravity(other, 1.0, np.array([0.0, 0.1, -1.0])))
        cls.scene = b.finish("to be changed")
        deck = cls.folder / "scene.inp"
        deck.write_text(deck_of(cls.scene))
        done = subprocess.run([PROGRAM, deck.name], cwd=cls.folder, capture_output=True, text=True,
                              check=False)  # fmt: skip
        assert done.returncode == 0, done.stderr
        cls.result = deck.with_suffix(".vtkhdf")

    def findings(self, change=None):
        """Kinds of findings after `change(file)`."""
        return findings(self.scene, self.result, change)

    def rows(self, file, row, ids):
        """Rows of nodes with `ids` in the fields of an increment."""
        start = file["VTKHDF/Steps/PointDataOffsets/displacement"][row]
        order = file["VTKHDF/PointData/node_id"][:]
        return [int(start + np.flatnonzero(order == i)[0]) for i in ids]

    def test_the_result_is_right(self):
        self.assertEqual(self.findings(), set())

    def test_a_reaction_changed_by_a_hundred_thousandth(self):
        def change(file):
            reaction = file["contact/B0-ZMIN:O0/reaction"]
            values = reaction[2]
            at = np.argmax(values[:, 0])
            values[at] *= 1 + 1e-5
            reaction[2] = values

        found = self.findings(change)
        self.assertIn("out of balance", found)

    def test_a_point_that_sticks_but_is_said_to_slide(self):
        def change(file):
            status = file["contact/B0-ZMIN:O0/status"]
            values = status[0]
            self.assertIn(1, values)
            values[values == 1] = 2
            status[0] = values

        found = self.findings(change)
        self.assertEqual(found, {"friction of a point that slides below its limit by"})

    def test_a_support_force_changed_by_a_hundred_thousandth(self):
        def change(file):
            force = file["VTKHDF/PointData/reaction_force"]
            values = force[:]
            values[np.unravel_index(np.argmax(np.abs(values)), values.shape)] *= 1 + 1e-5
            force[...] = values

        found = self.findings(change)
        self.assertTrue({"support force wrong by", "body out of balance by"} <= found, found)

    def test_a_held_node_that_moved(self):
        ids = self.scene.ids[self.scene.side_rows(0, "ZMAX")][:1]

        def change(file):
            (row,) = self.rows(file, 1, ids)
            u = file["VTKHDF/PointData/displacement"]
            values = u[row]
            values[0] += 1e-13
            u[row] = values

        self.assertIn("prescribed displacement off by", self.findings(change))

    def test_slip_the_other_way(self):
        def change(file):
            reaction = file["contact/B0-ZMIN:O0/reaction"]
            values = reaction[3]
            values[:, 1:] *= -1
            reaction[3] = values

        found = self.findings(change)
        self.assertTrue({"friction law", "friction does work"} <= found, found)

    def test_slip_of_one_point_the_other_way(self):
        # The point with the least friction among those that slide.
        def change(file):
            reaction = file["contact/B0-ZMIN:O0/reaction"]
            values = reaction[3]
            size = np.linalg.norm(values[:, 1:], axis=1)
            size[file["contact/B0-ZMIN:O0/status"][3] != 2] = np.inf
            values[np.argmin(size), 1:] *= -1
            reaction[3] = values

        self.assertIn("friction does work", self.findings(change))

    def test_a_body_that_was_shifted(self):
        # Strains do not change: only its contact sees it.
        ids = self.scene.ids[list(self.scene.parts[1].rows)]
        for shift, kinds in (((0, 0, -1e-6), {"penetration"}), ((0, 0, 1e-3), {"complementarity"}),
                             ((1e-3, 0, 0), {"friction law"})):  # fmt: skip

            def change(file, shift=shift):
                u = file["VTKHDF/PointData/displacement"]
                for row in self.rows(file, 3, ids):
                    u[row] = u[row] + shift

            with self.subTest(shift=shift):
                found = self.findings(change)
                self.assertTrue(kinds <= found, found)

    def test_an_increment_that_is_missing(self):
        def change(file):
            file["history"].attrs["finished"] = np.int64(3)
            file["VTKHDF/Steps"].attrs["NSteps"] = np.int64(3)

        self.assertIn("number of increments", self.findings(change))

    def test_a_load_of_another_size(self):
        pressure = self.scene.steps[1].pressures[0]
        pressure.value *= 1 + 1e-5
        try:
            self.assertIn("out of balance", self.findings())
        finally:
            pressure.value = 2.0

    def test_an_obstacle_elsewhere(self):
        plane = self.scene.obstacles[0]
        plane.point = plane.point + np.array([0, 0, 1e-6])
        try:
            self.assertIn("penetration", self.findings())
        finally:
            plane.point = plane.point - np.array([0, 0, 1e-6])


def two_cubes(friction=0.3, gap=0.0, **options):
    """A cube of 2x2x2 elements on one of 3x3x3 that it overhangs, pressed down: (builder, step)."""
    b = Builder(0, np.random.default_rng(1))
    soft, hard = b.material(1000.0, 0.3), b.material(3000.0, 0.25)
    below = b.part((0, 0, 0), (1, 1, 1), (3, 3, 3), soft, "C3D8", False)
    above = b.part((0.3, 0.1, 1 + gap), (1, 1, 1), (2, 2, 2), hard, "C3D8", True, False)
    b.touch((above, "ZMIN"), (below, "ZMAX"), friction, **options)
    step = add_step(b)
    b.hold(step, below, "ZMIN", (0, 1, 2))
    b.hold(step, above, "ZMAX", (0, 1))
    b.hold(step, above, "ZMAX", (2,), -0.01)
    return b, step


class Mortar(unittest.TestCase):
    """Weights, normals and gaps of nodes before surfaces, by hand."""

    SQUARE = np.array([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)], dtype=float)  # faces down

    def test_overlap_of_two_squares(self):
        # A unit square over the left half of another: (11.1) there is that of half a face.
        below = np.array([(-0.5, 0, -0.1), (0.5, 0, -0.1), (0.5, 1, -0.1), (-0.5, 1, -0.1)])
        placed = place_surface([(0, 1, 2, 3)], self.SQUARE, [(0, 1, 2, 3)], below, of_nodes=True)
        # int over 0 < x < 1/2 of (1-x)(1-y) and of x(1-y).
        np.testing.assert_allclose(placed.covered, [3 / 16, 3 / 16, 1 / 16, 1 / 16], atol=1e-15)
        np.testing.assert_allclose(placed.area, 0.25, atol=1e-15)
        np.testing.assert_allclose(placed.weights.sum(axis=1), 1, atol=1e-13)
        np.testing.assert_allclose(placed.weights @ below, self.SQUARE - (0, 0, 0.1), atol=1e-13)
        np.testing.assert_allclose(placed.gap, 0.1, atol=1e-14)
        np.testing.assert_allclose(placed.normal, np.tile((0, 0, 1.0), (4, 1)), atol=1e-15)

    def test_weights_reproduce_a_flat_master_of_any_faces(self):
        rng = np.random.default_rng(7)
        for _ in range(20):
            slave = self.SQUARE + 0.2 * rng.uniform(-1, 1, (4, 3)) * (1, 1, 0)
            master = 1.5 * self.SQUARE[::-1] + 0.3 * rng.uniform(-1, 1, (4, 3)) * (1, 1, 0)
            halves = [(0, 1, 2), (0, 2, 3)] if rng.random() < 0.5 else [(0, 1, 2, 3)]
            placed = place_surface([(0, 1, 2, 3)], slave, halves, master, of_nodes=True)
            on = placed.covered > 1e-3 * placed.area
            np.testing.assert_allclose((placed.weights @ master)[on], slave[on], atol=1e-10)
            # Where a part is bare rows stand for means of places that are covered.
            placed = place_surface([(0, 1, 2, 3)], slave, halves, master)
            places = slave - placed.own @ slave
            np.testing.assert_allclose((placed.weights @ master)[on], places[on], atol=1e-10)

    def test_normals_are_means_over_what_covers(self):
        # A roof of two slopes, its ridge under a quarter of the slave: N_a of each part, by hand.
        roof = np.array([(-1, -1, -1.25), (0.25, -1, 0), (0.25, 2, 0), (-1, 2, -1.25),
                         (2, -1, 0), (2, 2, 0)], dtype=float)  # fmt: skip
        faces = [(0, 1, 2, 3), (1, 4, 5, 2)]
        placed = place_surface([(0, 1, 2, 3)], self.SQUARE, faces, roof)
        slope = np.array([-1, 0, 1]) / np.sqrt(2)
        for node, share in ((0, 7 / 32), (3, 1 / 32)):  # int_0^1/4 of 1-x, of x
            n = share * slope + (0.5 - share) * np.array([0, 0, 1])
            with self.subTest(node=node):
                np.testing.assert_allclose(placed.normal[node], n / np.linalg.norm(n), atol=1e-13)

    def test_least_values_on_edges(self):
        # (x - 0.3)^2 on the triangle (0, 0), (1, 0), (0, 1).
        found = least_on_edges(np.array([0.09, 0.49, 0.09]), np.array([0.04, 0.04, 0.09]))
        self.assertAlmostEqual(found, 0.0, delta=1e-15)

    def test_what_has_moved_since_changes_distances_alone(self):
        # The slave rises by x where it is, the other side sinks by a half: 0.1 + x + 0.5.
        points = np.vstack([self.SQUARE, self.SQUARE[::-1] - (0, 0, 0.1)])
        moved = np.zeros_like(points)
        moved[:4, 2], moved[4:, 2] = self.SQUARE[:, 0], -0.5
        faces = [(0, 1, 2, 3)], points, [(4, 5, 6, 7)], points
        still, placed = place_surface(*faces), place_surface(*faces, moved=moved)
        np.testing.assert_array_equal(still.weights, placed.weights)
        np.testing.assert_array_equal(still.gap, placed.gap)
        np.testing.assert_allclose(placed.least, 0.6, atol=1e-15)
        np.testing.assert_allclose(placed.most, 1.6, atol=1e-15)

    def test_what_is_turned_away_or_beside_covers_nothing(self):
        towards = self.SQUARE[::-1].copy()
        for master in (self.SQUARE - (0, 0, 0.1), np.add(towards, (1.5, 0, -0.1))):
            placed = place_surface([(0, 1, 2, 3)], self.SQUARE, [(0, 1, 2, 3)], master)
            self.assertEqual(placed.covered.max(), 0.0)


class Turns(unittest.TestCase):
    """Obstacles that turn, by hand."""

    def test_rotation_is_rodrigues(self):
        axis, angle = np.array([1.0, 2.0, -2.0]) / 3, 2.5
        k = np.array([[0, 2, 2], [-2, 0, -1], [-2, 1, 0]]) / 3
        want = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
        np.testing.assert_allclose(rotation(angle * axis).astype(float), want, atol=1e-15)

    def test_a_point_that_stays_slips_along_the_chord(self):
        # At the arm 2 about z: the material goes +y, the point slips back by 2 r sin(phi/2).
        place, still = np.array([[2.0, 0, 0]]), np.zeros((1, 3))
        for phi in (0.01, 0.5):
            slip = chords(place, still, still, np.zeros(3), np.zeros(3), np.array([0, 0, phi]))
            np.testing.assert_allclose(slip, [[0, -4 * np.sin(phi / 2), 0]], atol=1e-15)

    def test_what_goes_along_does_not_slip(self):
        place, old, new = np.array([[2.0, 1, 0]]), np.array([0, 0, 0.3]), np.array([0, 0, 0.8])
        hub = np.array([0.5, 0.5, 0.0])

        def gone(vector):
            return (hub + (place - hub) @ rotation(vector).T - place).astype(float)

        slip = chords(place, gone(old), gone(new), hub, old, new)
        np.testing.assert_allclose(slip, 0, atol=1e-15)


class SolverOfBodies(unittest.TestCase):
    """The judge's own solver before surfaces, and the judge on what it finds."""

    def one(self, b):
        """(solution, findings, increment) of the only increment of a scene."""
        scene = b.finish("by hand")
        path = LoadPath(scene)
        nothing = np.zeros_like(scene.points)
        path.begin(0, np.zeros((len(nothing), 6)))
        increment = Increment(scene, nothing, path.supports(1.0), path.loads(1.0))
        found = increment.solve(1e-8)
        return found, judge_solution(scene, path, increment, found, 0, 1.0, 0.0), increment

    def test_two_cubes(self):
        for options in ({}, {"small": True}, {"gap": 0.004}):
            b, _ = two_cubes(**options)
            found, findings, _ = self.one(b)
            with self.subTest(**options):
                self.assertEqual(findings, [])
                self.assertGreater(found.forces[0][:, 2].sum(), 1.0)

    def test_a_tie_carries_a_uniform_stress(self):
        b = Builder(0, np.random.default_rng(1))
        material = b.material(1000.0, 0.0)
        below = b.part((0, 0, 0), (1, 1, 1), (2, 2, 2), material, "C3D8", False)
        above = b.part((0, 0, 1), (1, 1, 1), (3, 3, 3), material, "C3D8", False)
        b.scene.ties.append(Tie((above, "ZMIN"), (below, "ZMAX")))
        step = add_step(b)
        b.hold(step, below, "ZMIN", (0, 1, 2))
        b.hold(step, above, "ZMAX", (0, 1, 2))
        b.hold(step, above, "ZMAX", (2,), -0.02)
        found, findings, _ = self.one(b)
        self.assertEqual(findings, [])
        z = b.scene.points[:, 2]
        np.testing.assert_allclose(found.u[:, 2], -0.01 * z, atol=1e-14)

    def test_a_tie_on_a_line_is_a_hinge(self):
        for overlap, loose in ((0.001, True), (0.6, False)):
            b = Builder(0, np.random.default_rng(1))
            material = b.material(1000.0, 0.0)
            below = b.part((0, 0, 0), (1, 1, 1), (1, 2, 1), material, "C3D8", False)
            above = b.part((1 - overlap, 0, 1), (1, 1, 1), (1, 3, 1), material, "C3D8", False)
            b.scene.ties.append(Tie((above, "ZMIN"), (below, "ZMAX")))
            add_step(b)
            scene = b.finish("hinge")
            count = pieces_come_apart(scene, np.zeros(scene.points.shape, dtype=bool))
            with self.subTest(overlap=overlap):
                self.assertEqual(count > 0, loose)


class Carried(unittest.TestCase):
    """Tied bodies, a soft one between stiff ones, that supports carry before they touch anything.

    What rounding makes of forces in the stiff ones is more than that of the soft one's own.
    """

    def test_a_node_that_is_left_behind(self):
        scene = random_bodies(90028)
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "carried.inp"
            write_deck(scene, deck)
            subprocess.run([PROGRAM, deck.name], cwd=folder, capture_output=True, check=True)
            result = deck.with_suffix(".vtkhdf")
            stored = Stored(scene, result)
            self.assertEqual(Judge(scene, stored).judge(), [])
            free = np.abs(stored.supports).max(axis=(0, 2)) == 0
            stored.u[0, np.flatnonzero(free)[-1], 1] += 1e-8
            found = {f.kind for f in Judge(scene, stored).judge()}
            self.assertIn("out of balance", found)


class TamperedBodies(unittest.TestCase):
    """Right results of bodies before bodies; with one number changed they are wrong."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="judge-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.scenes = {}
        b, _ = two_cubes()
        later = add_step(b, increments=2)
        b.hold(later, 1, "ZMAX", (0,), 0.02)
        cls.scenes["blocks"] = b.finish("blocks")
        cls.scenes["tied"] = cls.tied()
        cls.scenes["tool"] = cls.tool()
        cls.results = {}
        for name, scene in cls.scenes.items():
            deck = cls.folder / f"{name}.inp"
            write_deck(scene, deck)
            done = subprocess.run([PROGRAM, deck.name], cwd=cls.folder, capture_output=True,
                                  text=True, check=False)  # fmt: skip
            assert done.returncode == 0, done.stderr
            cls.results[name] = deck.with_suffix(".vtkhdf")

    @staticmethod
    def tied():
        """Two blocks that are tied, sheared before a plane."""
        b = Builder(0, np.random.default_rng(1))
        soft, hard = b.material(1000.0, 0.3), b.material(3000.0, 0.25)
        below = b.part((0, 0, 0), (1, 1, 1), (3, 3, 2), soft, "C3D8", False)
        above = b.part((0.2, 0.1, 1.001), (0.7, 0.7, 1), (2, 2, 2), hard, "C3D8", True, False)
        b.scene.ties.append(Tie((above, "ZMIN"), (below, "ZMAX")))
        plane_below(b, below, 0.3)
        step = add_step(b)
        b.hold(step, above, "ZMAX", (0, 1))
        b.hold(step, above, "ZMAX", (2,), -0.01)
        b.hold(step, above, "ZMAX", (0,), 0.01)
        return b.finish("tied")

    @staticmethod
    def tool():
        """A plate of facets that is pressed down, then turned."""
        b = Builder(0, np.random.default_rng(1))
        part = b.part((0, 0, 0), (1, 1, 0.5), (3, 3, 2), b.material(1000.0, 0.3), "C3D8", False)
        corners = [(-0.1, -0.1, 0.5), (1.2, -0.1, 0.5), (1.2, 1.2, 0.5), (-0.1, 1.2, 0.5)]
        tool = b.facets("FACETS", corners, [(2, 1, 0), (3, 2, 0)], (0.4, 0.5, 1.0))
        at = b.scene.obstacles[tool].reference
        b.pair(part, "ZMAX", tool, 0.3)
        first, second = add_step(b), add_step(b, increments=2)
        b.hold(first, part, "ZMIN", (0, 1, 2))
        first.boundaries += [Boundary([at], i, 0.0) for i in range(2)]
        first.boundaries.append(Boundary([at], 2, -0.005))
        second.boundaries.append(Boundary([at], 5, 0.2))
        return b.finish("tool")

    def findings(self, name, change=None):
        """Kinds of findings after `change(file)`."""
        return findings(self.scenes[name], self.results[name], change)

    def changed(self, name, dataset, row, change):
        """Kinds of findings after `change(values)` of a row of a dataset; fields by increments."""

        def apply(file):
            values = file[dataset][:]
            shape = values.shape
            if dataset.startswith("VTKHDF"):
                values = values.reshape(-1, int(file["VTKHDF/NumberOfPoints"][0]), *shape[1:])
            change(values[row])
            file[dataset][...] = values.reshape(shape)

        return self.findings(name, apply)

    def test_the_results_are_right(self):
        for name in self.scenes:
            with self.subTest(name=name):
                self.assertEqual(self.findings(name), set())

    def test_numbers_of_a_pair_changed_by_a_hundred_thousandth(self):
        def grow(values):
            at = np.unravel_index(np.argmax(np.abs(np.where(values < 1e29, values, 0))),
                                  values.shape)  # fmt: skip
            values[at] += 1e-5 * max(abs(values[at]), 0.01)

        for dataset, kind in (
            ("reaction", "contact force of a node wrong by"),
            ("gap", "weighted gap wrong by"),
            ("slip_increment", "slip wrong by"),
            ("covered_area", "covered area wrong by"),
            ("moment", "moment wrong by"),
            ("moment_left", "moment left of a pair wrong by"),
            ("resultant", "resultant wrong by"),
        ):
            with self.subTest(dataset=dataset):
                found = self.changed("blocks", f"contact/B1-ZMIN:B0-ZMAX/{dataset}", 1, grow)
                self.assertIn(kind, found)

    def test_a_normal_that_leans(self):
        def lean(values):
            turn = rotation((1e-5, 0, 0)).astype(float)
            values[...] = values @ turn.T

        found = self.changed("blocks", "contact/B1-ZMIN:B0-ZMAX/frame", 1, lean)
        self.assertIn("normal wrong by", found)

    def test_points_that_gape_or_overlap_more_than_is_told(self):
        for shift, kind in ((0.1, "least gap too large by"), (-0.1, "least gap too small by")):

            def change(values, shift=shift):
                values += shift

            with self.subTest(kind=kind):
                name = "contact/B1-ZMIN:B0-ZMAX/least_gap"
                self.assertIn(kind, self.changed("blocks", name, 1, change))

    def test_a_node_that_was_let_through(self):
        def lose(values):
            values[np.argmin(values)] = 1e30

        found = self.changed("blocks", "contact/B1-ZMIN:B0-ZMAX/gap", 1, lose)
        self.assertTrue(
            {"node without a place, covered by", "reaction on a node without a place"} <= found
        )

    def test_a_master_that_feels_less(self):
        rows = self.scenes["blocks"].side_rows(0, "ZMAX")
        ids = self.scenes["blocks"].ids[rows]

        def change(file):
            order = file["VTKHDF/PointData/node_id"][:]
            at = np.flatnonzero(np.isin(order, ids)) + len(order)  # of increment 2
            force = file["VTKHDF/PointData/contact_force"][:]
            force[at] *= 1 - 1e-5
            file["VTKHDF/PointData/contact_force"][...] = force

        found = self.findings("blocks", change)
        self.assertTrue({"action is not reaction, by", "body out of balance by"} <= found, found)

    def test_a_body_that_went_on_alone(self):
        # The upper body as a whole: its strains do not change, its supports do.
        ids = self.scenes["blocks"].ids[list(self.scenes["blocks"].parts[1].rows)]
        for shift, kind in (
            ((0, 0, -1e-6), "weighted gap wrong by"),
            ((1e-6, 0, 0), "slip wrong by"),
        ):

            def change(file, shift=shift):
                order = file["VTKHDF/PointData/node_id"][:]
                at = np.flatnonzero(np.isin(order, ids)) + len(order)
                u = file["VTKHDF/PointData/displacement"][:]
                u[at] += shift
                file["VTKHDF/PointData/displacement"][...] = u

            with self.subTest(shift=shift):
                self.assertIn(kind, self.findings("blocks", change))

    def test_reactions_that_break_the_law(self):
        def turn(values):
            values[:, 1:] *= -1

        def stronger(values):
            values[:, 1:] *= 1.01

        name = "contact/B1-ZMIN:B0-ZMAX/reaction"
        self.assertIn("friction law", self.changed("blocks", name, 2, turn))
        self.assertIn("cone", self.changed("blocks", name, 2, stronger))

    def test_weights_of_other_places(self):
        # The lower body beside where it was: a gap does not show it, the forces on its nodes do.
        scene = self.scenes["blocks"]
        moved = scene.points.copy()
        moved[list(scene.parts[0].rows)] += (1e-4, 0, 0)
        other = replace(scene, points=moved)
        judge = Judge(other, Stored(other, self.results["blocks"]), True)
        judge.walk()
        self.assertIn("contact force of a node wrong by", {f.kind for f in judge.findings})

    def test_tied_nodes_that_part(self):
        scene = self.scenes["tied"]
        ids = scene.ids[scene.side_rows(1, "ZMIN")][:1]

        def change(file):
            order = file["VTKHDF/PointData/node_id"][:]
            u = file["VTKHDF/PointData/displacement"][:]
            u[np.flatnonzero(np.isin(order, ids))] += 1e-10
            file["VTKHDF/PointData/displacement"][...] = u

        self.assertIn("tied surfaces part by", self.findings("tied", change))

    def test_tied_bodies_that_do_not_balance(self):
        def less(values):
            values[values[:, 2] < -0.1] *= 1 - 1e-5

        found = self.changed("tied", "VTKHDF/PointData/reaction_force", 0, less)
        self.assertTrue({"support force wrong by", "body out of balance by"} <= found, found)

    def test_slave_nodes_that_were_not_moved_onto_the_master(self):
        scene = self.scenes["tied"]
        ids = scene.ids[scene.side_rows(1, "ZMIN")]

        def change(file):
            points = file["VTKHDF/Points"][:]
            points[np.isin(file["VTKHDF/PointData/node_id"][:], ids), 2] += 1e-5
            file["VTKHDF/Points"][...] = points

        self.assertIn("coordinates", self.findings("tied", change))

    def test_a_tool_that_turned_less(self):
        def less(values):
            values *= 1 - 1e-6

        found = self.changed("tool", "reference_nodes/rotation", 2, less)
        self.assertIn("prescribed displacement off by", found)

    def test_torque_and_slip_of_a_tool(self):
        def more(values):
            values *= 1 + 1e-6

        for dataset, kind in (("torque", "torque wrong by"), ("slip_increment", "slip wrong by")):
            with self.subTest(dataset=dataset):
                found = self.changed("tool", f"contact/B0-ZMAX:O0/{dataset}", 2, more)
                self.assertIn(kind, found)
        found = self.changed("tool", "reference_nodes/reaction_moment", 2, more)
        self.assertIn("moment of a support wrong by", found)


class TamperedFinite(unittest.TestCase):
    """Right results at finite strain are right; of another theory, or with a fault, wrong."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="judge-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.scenes = {"blocks": cls.blocks(), "loaded": cls.loaded()}
        cls.results = {name: cls.run_scene(scene, name) for name, scene in cls.scenes.items()}

    @classmethod
    def run_scene(cls, scene, name, *options):
        """The result of a scene that the program certifies."""
        deck = cls.folder / f"{name}.inp"
        write_deck(scene, deck)
        done = subprocess.run([PROGRAM, *options, deck.name], cwd=cls.folder, capture_output=True,
                              text=True, check=False)  # fmt: skip
        assert done.returncode == 0, done.stderr
        return deck.with_suffix(".vtkhdf")

    @staticmethod
    def blocks():
        """Two blocks, pressed by a fifth of the upper one, and turned together."""
        b, lower = cube_scene(explicit=True)
        b.scene.finite = True
        b.scene.materials[0].law = NEO_HOOKE
        soft = b.material(500.0, 0.25)
        b.scene.materials[soft].law = BLATZ_KO
        upper = b.part((0.2, 0.1, 1), (0.6, 0.7, 1), (2, 2, 2), soft, "C3D8", True, False)
        b.touch((upper, "ZMIN"), (lower, "ZMAX"), 0.5)
        first, second = add_step(b, increments=3), add_step(b, increments=3)
        down = np.array([0.0, 0.0, -0.2])
        turn_side(b, first, lower, "ZMIN", np.zeros(3), np.zeros(3))
        turn_side(b, first, upper, "ZMAX", np.zeros(3), down)
        turn_side(b, second, lower, "ZMIN", np.array([0, 0, 0.5]), np.zeros(3))
        turn_side(b, second, upper, "ZMAX", np.array([0, 0, 0.2]), down)
        return b.finish("blocks")

    @staticmethod
    def loaded(law=MOONEY_RIVLIN):
        """A block under a pressure that follows, before a plane."""
        b, part = cube_scene(explicit=True)
        b.scene.finite = True
        b.scene.materials[0].law = law
        b.scene.materials[0].share = 0.3 if law == MOONEY_RIVLIN else 0.0
        b.pair(part, "XMAX", b.obstacle("PLANE", (1.05, 0, 0), (-1, 0, 0)), 0.2)
        step = add_step(b, increments=3)
        b.hold(step, part, "ZMIN", (0, 1, 2))
        step.pressures.append(Pressure(part, "XMIN", 120.0))
        return b.finish("loaded")

    def findings(self, name, change=None):
        """Kinds of findings after `change(file)`."""
        return findings(self.scenes[name], self.results[name], change)

    def test_the_results_are_right(self):
        for name in self.scenes:
            with self.subTest(name=name):
                self.assertEqual(self.findings(name), set())

    def test_small_strain_is_not_finite_strain(self):
        scene = self.loaded()
        small = self.run_scene(scene, "small", "--nlgeom", "no")
        self.assertIn("out of balance", findings(scene, small))

    def test_another_law_or_a_constant_changed_by_a_hundred_thousandth(self):
        for law, young in ((NEO_HOOKE, 1000.0), (MOONEY_RIVLIN, 1000.01)):
            scene = self.loaded(law)
            scene.materials[0].young = young
            with self.subTest(law=law):
                self.assertIn("out of balance", findings(scene, self.results["loaded"]))

    def test_a_pressure_on_the_undeformed_body(self):
        scene = self.loaded()
        elements = scene.elements()
        elements.pressure_force = lambda faces, u=0.0: Elements.pressure_force(elements, faces)
        kinds = findings(scene, self.results["loaded"])
        self.assertLessEqual({"out of balance", "body out of balance by"}, kinds)

    def test_moments_about_undeformed_places(self):
        scene = self.loaded()
        stored = Stored(scene, self.results["loaded"])

        class OldArms(Judge):
            def check_bodies(self, *measures):
                super().check_bodies(*measures[:-1], 0 * measures[-1])

        kinds = {f.kind for f in OldArms(scene, stored).judge()}
        self.assertEqual(kinds, {"body out of balance by"})

    def test_slips_that_do_not_turn_with_the_master(self):
        scene = self.scenes["blocks"]
        stored = Stored(scene, self.results["blocks"])

        class OldSlips(Judge):
            def way_over(self, surface, placed, ends, moved, *told):
                return moved

        kinds = {f.kind for f in OldSlips(scene, stored).judge()}
        self.assertEqual(kinds, {"slip wrong by"})

    def test_an_energy_changed_by_a_hundred_thousandth(self):
        def change(file):
            file["history/energy/strain"][1] *= 1 + 1e-5

        self.assertEqual(self.findings("loaded", change), {"strain energy wrong by"})

    def test_a_refusal_without_a_reason_is_not_confirmed(self):
        scene = self.scenes["loaded"]
        stored = Stored(scene, self.results["loaded"])
        self.assertEqual(confirm_finite(scene, stored, "no balance")[0], "unconfirmed")


if __name__ == "__main__":
    unittest.main()
