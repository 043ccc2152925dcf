"""Elements of a plane: finer meshes, joints, friction, the axis; closed forms of contact."""

import re
import unittest
from math import cos, pi, radians, sin, sqrt

import numpy as np
from program import LONG
from test_plane import (
    AXISYMMETRIC,
    FLOOR,
    PLANE_STRAIN,
    POISSON,
    YOUNG,
    Case,
    Mesh,
    pair,
    section,
    slanted,
    step,
)

STIFF = YOUNG / (1 - POISSON**2)  # of a half plane and a half space


def press(kind, *more, thickness="", boundary="*BOUNDARY\nALEFT-N, 1", n=(4, 3), load=""):
    """Return a rectangle of 2 by 1.5 on a plane, with what else the step and the deck have."""
    return (
        Mesh(kind, n, slanted).deck
        + section("A", thickness=thickness)
        + FLOOR
        + pair("ABOTTOM", "FLOOR")
        + "".join(more)
        + step(boundary, load or "*DSLOAD\nATOP, P, 10.")
    )


class Uniform(Case):
    """Decks whose stress is uniform, -10 along y."""

    def check(self, deck, *options, thickness=1.0, kind="CPE4", force=True):
        """Run a deck; u and the force are those of a pressure of 10; return how many elements."""
        with self.solve(deck, *options).result() as result:
            x, u = result.points, result.field("displacement")
            low = x[:, 1].min()
            if kind[:3] == "CPE":
                scale = 10 * (1 + POISSON) / YOUNG
                exact = scale * np.c_[POISSON * x[:, 0], -(1 - POISSON) * (x[:, 1] - low),
                                      0 * x[:, 0]]  # fmt: skip
                area = 2 * thickness
            else:
                scale = 10 / YOUNG
                exact = scale * np.c_[POISSON * x[:, 0], low - x[:, 1], POISSON * x[:, 2]]
                area = 4 * pi
            # Eight points do not integrate an arc: in proportion to the angle squared.
            np.testing.assert_allclose(u, exact, atol=1e-5 if kind == "CAX8R" else 2e-7)
            if force:
                self.assertAlmostEqual(result.pairs[0].resultant[-1][1] / (10 * area), 1, 6)
            return len(result.element_ids)


class Finer(Uniform):
    """The mesh of the deck cut."""

    def test_whole_meshes(self):
        for kind in PLANE_STRAIN + AXISYMMETRIC:
            boundary = "*BOUNDARY\nALEFT-N, 1" if kind[:3] == "CPE" else ""
            deck = press(kind, boundary=boundary)
            with self.subTest(kind):
                n = self.check(deck, "--refine", "1", kind=kind)
                self.assertEqual(n, (48 if kind[3] in "48" else 96))

    def test_some_elements(self):
        for kind in PLANE_STRAIN + AXISYMMETRIC:
            boundary = "*BOUNDARY\nALEFT-N, 1" if kind[:3] == "CPE" else ""
            deck = press(kind, "*REFINE, TIMES=2\n2., 1.6, 0., 0.1\n", boundary=boundary)
            with self.subTest(kind):
                n = self.check(deck, kind=kind)
                self.assertGreater(n, 12)

    def test_forces_on_nodes_stay(self):
        """A force on a node is spread along the thickness on the finer mesh, too."""
        for kind in ("CPE4", "CPE8R", "CAX4", "CAX8"):
            mesh = Mesh(kind, (4, 3), slanted)
            corner = mesh.at[(0 if kind[:3] == "CPE" else 2 * mesh.step), 3 * mesh.step]
            deck = press(kind, load=f"*CLOAD\n{corner}, 2, -5.")
            with self.subTest(kind), self.solve(deck, "--refine", "1").result() as result:
                self.assertAlmostEqual(result.pairs[0].resultant[-1][1], 5, 7)
                x, u = result.points, result.field("displacement")
                high, at = x[:, 1] > 1.5 - 1e-9, radius_of(x)
                for place in np.unique(np.round(at[high], 8)):
                    line = u[high & (abs(at - place) < 1e-7), 1]
                    self.assertGreater(len(line), 1)
                    self.assertLess(np.ptp(line), 1e-6 * abs(u[:, 1]).max())

    def test_the_flat_deck_is_the_same(self):
        for kind in ("CPE8R", "CAX4"):
            deck = press(kind).replace("ATOP, P, 10.", "ATOP, P, <p>")
            deck = "*PARAMETER\np = 10\n" + deck
            run = self.solve(deck, "--flat")
            self.assertIn(f"TYPE={kind}", run.output)
            with self.subTest(kind):
                self.check(run.output, kind=kind)

    def test_an_accuracy_chooses_the_mesh(self):
        """The share of the load that the middle half of a flat punch carries, to 2 %."""
        run = self.solve(punch("CPE4", 6, 6), "--accuracy", "0.02")
        with run.result() as result:
            n = len(result.element_ids)
        self.assertGreater(n, 144)


class Joints(Uniform):
    """Equations, ties, couplings, sections of bolts, local axes, gaps."""

    def test_equations(self):
        """The top is kept level by a node that carries the load; sets and single nodes."""
        for kind in PLANE_STRAIN + AXISYMMETRIC:
            mesh = Mesh(kind, (4, 3), slanted)
            top = [number for p, number in mesh.at.items() if p[1] == 3 * mesh.step]
            each = "".join(f"2\n{number}, 2, 1., 900, 2, -1.\n" for number in top)
            force, thickness = (-60, 3.0) if kind[:3] == "CPE" else (-40 * pi, "")
            for lines in ("2\nATOP-N, 2, 1., 900, 2, -1.\n", each):
                deck = press(
                    kind, "*NODE\n900, 5., 2., 0.\n*EQUATION\n", lines, thickness=thickness,
                    boundary="*BOUNDARY\nALEFT-N, 1" if kind[:3] == "CPE" else "",
                    load=f"*CLOAD\n900, 2, {force!r}",
                )  # fmt: skip
                with self.subTest(kind, lines=len(lines)):
                    self.check(deck, kind=kind, thickness=3.0)

    def test_ties(self):
        for kind in PLANE_STRAIN + AXISYMMETRIC:
            upper = Mesh(kind, (4, 2), lambda a, b: (2 * a, 0.75 + 0.75 * b), "A")
            lower = Mesh(kind, (3, 2), lambda a, b: (2 * a, 0.75 * b), "B", 1000, 1000)
            deck = (
                upper.deck + lower.deck + section("A", "B") + FLOOR + pair("BBOTTOM", "FLOOR")
                + "*TIE, NAME=T\nABOTTOM, BTOP\n"
                + step("*BOUNDARY\nALEFT-N, 1\nBLEFT-N, 1" if kind[:3] == "CPE" else "",
                       "*DSLOAD\nATOP, P, 10.")
            )  # fmt: skip
            with self.subTest(kind):
                self.check(deck, kind=kind)

    def test_couplings_in_plane_strain(self):
        """A force in the middle is a uniform traction, as a level top is."""
        for kind in PLANE_STRAIN:
            for below in ("*DISTRIBUTING\n", "*KINEMATIC\n2, 2\n"):
                deck = press(
                    kind, "*NODE\n900, 1., 4., 0.\n*COUPLING, REF NODE=900, SURFACE=ATOP\n", below,
                    thickness=2.0, load="*CLOAD\n900, 2, -40.",
                )  # fmt: skip
                with self.subTest(kind, below=below):
                    self.check(deck, kind=kind, thickness=2.0)

    def test_a_moment_bends(self):
        """The end of a beam of length 10 and height 1 rises by M L^2/(2 E' I)."""
        for kind, n in (("CPE8", (5, 1)), ("CPE8R", (5, 1)), ("CPE6", (10, 2))):
            mesh = Mesh(kind, n, lambda a, b: (10 * a, b - 0.5))
            middle = mesh.at[0, n[1] * mesh.step // 2]
            deck = mesh.deck + section("A", thickness=3.0)
            deck += "*NODE\n900, 10., 0., 0.\n*COUPLING, REF NODE=900, SURFACE=ARIGHT\n"
            deck += "*DISTRIBUTING\n" + step(
                f"*BOUNDARY\nALEFT-N, 1\n{middle}, 2", "*CLOAD\n900, 6, 0.6"
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                x, u = result.points, result.field("displacement")
                end = u[(x[:, 0] > 9.99) & (abs(x[:, 1]) < 1e-9), 1]
                np.testing.assert_allclose(end, 0.6 * 100 / (2 * STIFF * 3 / 12), rtol=2e-3)

    def test_a_bolt_of_a_plane(self):
        """The force of a section is that of the clamps; its shortening F H/(E' A)."""
        for kind in ("CPE4", "CPE8R", "CAX4", "CAX8", "CAX8R"):
            mesh = Mesh(kind, (3, 4), lambda a, b: (2 * a, 5 * b))
            cut = "".join(f"{e}, S1\n" for e in (7, 8, 9))
            of_plane = kind[:3] == "CPE"
            area = 6 if of_plane else 4 * pi
            deck = mesh.deck + section("A", thickness=3.0 if of_plane else "")
            deck += f"*NODE\n900, 1., 2.5, 0.\n*SURFACE, NAME=CUT\n{cut}"
            deck += "*PRE-TENSION SECTION, SURFACE=CUT, NODE=900\n" + step(
                "*BOUNDARY\nATOP-N, 2\nABOTTOM-N, 2" + "\nALEFT-N, 1" * of_plane,
                f"*CLOAD\n900, 1, {10 * area!r}",
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                x, force = result.points, result.field("reaction_force")
                top = force[x[:, 1] > 4.99, 1].sum()
                self.assertAlmostEqual(top / (10 * area), 1, 6)
                u = result.field("displacement")[:, 1]
                short = 5 * 10 / (STIFF if of_plane else YOUNG)
                self.assertAlmostEqual((u.max() - u.min()) / short, 1, 5)

    def test_local_axes_in_the_plane(self):
        """The rectangle turned by 30 degrees, held along its own axes."""
        c, s = cos(radians(30)), sin(radians(30))

        def place(a, b):
            x, y = slanted(a, b)
            return c * x - s * y, s * x + c * y

        for kind in PLANE_STRAIN:
            deck = Mesh(kind, (4, 3), place).deck + section("A", thickness=2.0)
            deck += f"*TRANSFORM, NSET=AALL\n{c!r}, {s!r}, 0., {-s!r}, {c!r}, 0.\n"
            deck += step("*BOUNDARY\nALEFT-N, 1\nABOTTOM-N, 2", "*DSLOAD\nATOP, P, 10.")
            with self.subTest(kind), self.solve(deck).result() as result:
                x, u = result.points, result.field("displacement")
                x, u = (v[:, :2] @ np.array([[c, -s], [s, c]]) for v in (x, u))
                scale = 10 * (1 + POISSON) / YOUNG
                exact = scale * np.c_[POISSON * x[:, 0], -(1 - POISSON) * x[:, 1]]
                np.testing.assert_allclose(u, exact, atol=1e-9)

    def test_gaps(self):
        """A gap of a set is one at all nodes along the thickness."""
        for kind in ("CPE8R", "CAX4"):
            deck = press(
                kind, "*CONTACT GAP\nABOTTOM-N, 0.005\n",
                boundary="*BOUNDARY\nATOP-N, 2, 2, -0.0186500" if kind[:3] == "CPE" else
                "*BOUNDARY\nATOP-N, 2, 2, -0.02", load="*NODE PRINT, NSET=ATOP-N\nU",
            ).replace("ALEFT-N, 1\n", "")  # fmt: skip
            if kind[:3] == "CPE":
                deck = deck.replace("*BOUNDARY\n", "*BOUNDARY\nALEFT-N, 1\n")
            with self.subTest(kind), self.solve(deck).result() as result:
                self.assertAlmostEqual(
                    result.pairs[0].resultant[-1][1] / (20 if kind[:3] == "CPE" else 40 * pi), 1, 6
                )


def graded(n):
    """Return places from 0 to 40, half of them below 1, fine on both sides of 1; n = 3 m."""
    below = np.sin(pi / 2 * np.arange(n + 1) / n)
    above = 1 + 39 * (np.arange(1, n + 1) / n) ** 3.2
    return np.concatenate([below, above])


def punch(kind, n, deep, depth=0.01):
    """Return a body of 40 by 40 moved up by a depth against a rigid flat punch, x at most 1."""
    across, down = graded(n), 40 * (1 - np.arange(deep + 1) / deep) ** 3.2

    def place(a, b):
        k, m = a * 2 * n, b * deep
        return float(np.interp(k, range(2 * n + 1), across)), -float(
            np.interp(m, range(deep + 1), down))  # fmt: skip

    mesh = Mesh(kind, (2 * n, deep), place)
    under = "".join(line + "\n" for line in mesh.sides["TOP"][:n])
    return (
        mesh.deck
        + section("A")
        + f"*SURFACE, NAME=UNDER\n{under}"
        + "*OBSTACLE, NAME=PUNCH, TYPE=PLANE\n0., 0., 0., 0., -1., 0.\n"
        + pair("UNDER", "PUNCH")
        + step(f"*BOUNDARY\nALEFT-N, 1\nABOTTOM-N, 2, 2, {depth!r}")
    )


def radius_of(x):
    """Return how far places are from the plane x = 0, or from the axis of a wedge."""
    return np.where(x[:, 2] < 0.02 * x[:, 0], np.hypot(x[:, 0], x[:, 2]), x[:, 0])


def inner_share(result, radius=0.5):
    """Return the part of the force within a radius, that of nodes at the radius by half."""
    points = result.pairs[0]
    at = radius_of(points.coordinates)
    force = points.reaction[-1][:, 0]
    inside = (at < radius - 1e-9) + 0.5 * (abs(at - radius) < 1e-9)
    return (force * inside).sum() / force.sum()


class Punches(Case):
    """Flat punches, rigid and without friction."""

    def test_a_long_one(self):
        """The pressure is F/(pi (a^2 - x^2)^(1/2)): a third of the force within a/2."""
        for kind, n in (("CPE4", 24), ("CPE8R", 12)):
            with self.subTest(kind), self.solve(punch(kind, n, n)).result() as result:
                self.assertAlmostEqual(inner_share(result) * 3, 1, delta=0.02)

    def test_a_round_one(self):
        """F = 2 E' a d, of which 1 - (1 - 1/4)^(1/2) within a/2; nodes on the axis press, too."""
        for kind, n in (("CAX4", 24), ("CAX8R", 12)):
            with self.subTest(kind), self.solve(punch(kind, n, n)).result() as result:
                self.assertAlmostEqual(inner_share(result) / (1 - sqrt(0.75)), 1, delta=0.02)
                x, u = result.points, result.field("displacement")
                force = -result.pairs[0].resultant[-1][1]
                self.assertAlmostEqual(force / (2 * STIFF * 0.01), 1, delta=0.05)
                self.assertLess(abs(u[x[:, 0] < 1e-4, 0]).max(), 1e-6)


class Balls(Case):
    """Contact on the axis."""

    def test_hertz(self):
        """p_0 = (6 F E'^2/(pi^3 R^2))^(1/3) of a ball of R = 10 on a plane."""

        def place(a, b):
            x = 2.4 * (0.35 * a + 0.65 * a**2)
            low = 10 - sqrt(100 - x * x)
            return x, low + (4 - low) * (0.25 * b + 0.75 * b**2)

        for kind, n in (("CAX4", (24, 14)), ("CAX8", (12, 8)), ("CAX8R", (12, 8))):
            deck = (
                Mesh(kind, n, place).deck
                + section("A")
                + FLOOR
                + pair("ABOTTOM", "FLOOR")
                + step("*BOUNDARY\nALEFT-N, 1\nATOP-N, 2, 2, -0.04")
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                force = result.pairs[0].resultant[-1][1]
                peak = (6 * force * STIFF**2 / (pi**3 * 100)) ** (1 / 3)
                self.assertAlmostEqual(result.pairs[0].largest_pressure[-1] / peak, 1, delta=0.03)

    def test_finite_strain(self):
        """A cylinder pressed to 0.8 of its height: St Venant-Kirchhoff, no stress across."""
        e = (0.8**2 - 1) / 2
        force = -0.8 * YOUNG * e * 4 * pi
        wide = 2 * (sqrt(1 - 2 * POISSON * e) - 1)
        for kind in AXISYMMETRIC:
            deck = (
                Mesh(kind, (3, 2), lambda a, b: (2 * a, b)).deck
                + section("A")
                + FLOOR
                + pair("ABOTTOM", "FLOOR")
                + step("*BOUNDARY\nATOP-N, 2, 2, -0.2", nlgeom=True)
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                # Arcs are off by parts of the angle squared.
                within = 3e-4 if kind[3] in "68" else 1e-5
                self.assertAlmostEqual(result.pairs[0].resultant[-1][1] / force, 1, delta=within)
                out = np.hypot(*(result.points + result.field("displacement"))[:, [0, 2]].T).max()
                self.assertAlmostEqual((out - 2) / wide, 1, delta=1e-3)


class Friction(Case):
    """Friction of bodies of revolution acts along the meridian."""

    def test_a_sleeve_that_is_pulled(self):
        """All of it slides: F along the axis is mu times the force across."""
        shaft = "*NODE\n900, 0., 0., 0.\n*OBSTACLE, NAME=SHAFT, TYPE=CYLINDER, REF NODE=900\n"
        shaft += "0., 0., 0., 0., 1., 0., 1.01\n"
        for kind in AXISYMMETRIC:
            deck = (
                Mesh(kind, (6, 6), lambda a, b: (1 + a, 3 * b)).deck
                + section("A")
                + shaft
                + pair("ALEFT", "SHAFT", 0.1)
                + step("*BOUNDARY\nARIGHT-N, 2\n900, 2")
                + step("*BOUNDARY\n900, 2, 2, 0.05")
            )
            with self.subTest(kind), self.solve(deck).result() as result:
                force = result.pairs[0].resultant[-1]
                # A sum of radial parts has that of a chord, 1 - alpha^2/8.
                self.assertAlmostEqual(force[1] / (0.1 * force[0]), 1, 4)
                self.assertTrue((result.pairs[0].status[-1] != 1).all())
                support = result.field("reaction_force").sum(axis=0)
                self.assertAlmostEqual(support[1] / -force[1], 1, 7)

    def test_nothing_rubs_across_a_slice(self):
        """Faces with mid-side nodes bend a little across it: friction acts in the plane alone."""
        one = Mesh("CPE6", (5, 2), lambda a, b: (a, 0.6 * b), "A")
        two = Mesh("CPE8", (2, 1), lambda a, b: (1.2 * a - 0.1, 0.6 + 0.5 * b), "B", 1000, 1000)
        deck = one.deck + two.deck + section("A", "B") + pair("BBOTTOM", "ATOP", 0.8)
        deck += step("*BOUNDARY\nABOTTOM-N, 1, 2\nBTOP-N, 1\nBTOP-N, 2, 2, -0.01")
        with self.solve(deck).result() as result:
            self.assertGreater(np.abs(result.pairs[0].reaction[-1][:, 1]).max(), 0)
            self.assertEqual(np.abs(result.pairs[0].reaction[-1][:, 2]).max(), 0)

    def test_bodies_that_touch_on_the_axis(self):
        """One over a wider one whose nodes are elsewhere: the law holds, halves are alike."""
        for i, low in enumerate(AXISYMMETRIC):
            for high in AXISYMMETRIC if LONG else [AXISYMMETRIC[i - 1]]:
                one = Mesh(low, (1, 2), lambda a, b: (a, 0.6 * b), "A")
                two = Mesh(high, (2, 1), lambda a, b: (1.2 * a, 0.6 + 0.5 * b), "B", 1000, 1000)
                deck = one.deck + two.deck + section("A", "B") + pair("ATOP", "BBOTTOM", 0.1)
                deck += step("*BOUNDARY\nABOTTOM-N, 1, 2\nBTOP-N, 1\nBTOP-N, 2, 2, -0.01")
                with self.subTest(f"{low} {high}"), self.solve(deck).result() as result:
                    points = result.pairs[0]
                    x = result.points[points.nodes]
                    normal = points.reaction[-1][:, 0]
                    friction = points.reaction[-1][:, 1]
                    radius = np.hypot(x[:, 0], x[:, 2])
                    on_axis = radius < 1e-3
                    self.assertEqual(np.count_nonzero(friction[on_axis]), 0)
                    across = np.isclose(x[:, 2], 0)
                    halves = [np.sort(normal[side]) for side in (
                        across, np.isclose(x[:, 2], radius * sin(radians(1))))]  # fmt: skip
                    np.testing.assert_allclose(halves[0], halves[1], atol=2e-5 * normal.max())

    def test_no_friction_on_the_axis(self):
        """A ball on the axis presses: by symmetry nothing slips at the node there."""
        ball = "*OBSTACLE, NAME=BALL, TYPE=SPHERE\n0., 2.09, 0., 1.5\n"
        for kind in AXISYMMETRIC:
            mesh = Mesh(kind, (5, 2), lambda a, b: (a, 0.6 * b)).deck + section("A")
            deck = mesh + ball + pair("ATOP", "BALL", 0.1) + step("*BOUNDARY\nABOTTOM-N, 1, 2")
            with self.subTest(kind), self.solve(deck).result() as result:
                points = result.pairs[0]
                x = result.points[points.nodes]
                on_axis = np.hypot(x[:, 0], x[:, 2]) < 1e-5
                self.assertGreater(points.reaction[-1][on_axis, 0].max(), 0)
                self.assertEqual(np.abs(points.reaction[-1][on_axis, 1:]).max(), 0)

    def test_both_half_planes_stick_alike(self):
        """Rings whose nodes do not meet, pressed, then one cools: reactions are pairs."""
        one = Mesh("CAX4", (3, 2), lambda a, b: (1 + a, 0.6 * b), "A")
        two = Mesh("CAX4", (5, 2), lambda a, b: (1 + 1.2 * a, 0.6 + 0.5 * b), "B", 1000, 1000)
        for small in ("", ", SMALL SLIDING"):
            deck = one.deck + two.deck + section("A", "B").replace(
                "*SOLID", "*EXPANSION\n1e-4\n*SOLID", 1)  # fmt: skip
            deck += pair("ATOP", "BBOTTOM", 1.2).replace("I\nATOP", f"I{small}\nATOP")
            deck += step("*BOUNDARY\nABOTTOM-N, 1, 2\nBTOP-N, 2, 2, -0.01")
            deck += step("*TEMPERATURE\nAALL, -50.")
            with self.subTest(small), self.solve(deck).result() as result:
                points = result.pairs[0]
                x = result.points[points.nodes]
                self.assertTrue((points.status[-1] == 1).any())
                for component in (0, 1):
                    r = points.reaction[-1][:, component]
                    halves = [r[side][np.argsort(x[side, 0])] for side in (
                        np.isclose(x[:, 2], 0), ~np.isclose(x[:, 2], 0))]  # fmt: skip
                    np.testing.assert_allclose(halves[0], halves[1], atol=1e-7 * r.max())

    def test_a_press_fit_that_is_pulled(self):
        """Two rings, the outer one pulled along the axis until all slides."""
        for kind in AXISYMMETRIC:
            one = Mesh(kind, (4, 4), lambda a, e: (1 + 1.002 * a, 4 * e - 0.5), "A")
            two = Mesh(kind, (3, 3), lambda a, e: (2 + a, 3 * e), "B", 1000, 1000)
            deck = one.deck + two.deck + section("A", "B") + pair("BLEFT", "ARIGHT", 0.05)
            deck += step("*BOUNDARY\nALEFT-N, 2\nBRIGHT-N, 2, 2, 0.05")
            with self.subTest(kind), self.solve(deck).result() as result:
                force = result.pairs[0].resultant[-1]
                self.assertGreater(force[0], 1)
                self.assertAlmostEqual(force[1] / (-0.05 * force[0]), 1, delta=1e-3)

    def test_a_rough_plane_holds(self):
        """With a large coefficient the sole moves as one that is clamped."""
        for kind in AXISYMMETRIC[:-1]:  # CAX8R takes other points where a side is held
            mesh = Mesh(kind, (4, 3), lambda a, b: (2 * a, 1.5 * b)).deck + section("A")
            top = "*DSLOAD\nATOP, P, 10."
            rough = mesh + FLOOR + pair("ABOTTOM", "FLOOR", 50.0) + step(top)
            held = mesh + step("*BOUNDARY\nABOTTOM-N, 1, 2", top)
            with self.subTest(kind), self.solve(rough).result() as result:
                found = result.field("displacement")
                self.assertAlmostEqual(result.pairs[0].resultant[-1][1] / (40 * pi), 1, 5)
                with self.solve(held).result() as clamped:
                    u = clamped.field("displacement")
                    np.testing.assert_allclose(found, u, atol=1e-6 * abs(u).max())

    def test_forces_of_calculix(self):
        """A disc pressed on a wider one, mu = 0.3: 180 times what CalculiX's wedge has."""
        for kind, force in CALCULIX.items():
            upper = Mesh(kind, (8, 4), lambda a, b: (a, 1 + b), "A")
            lower = Mesh(kind, (15, 6), lambda a, b: (1.5 * a, b), "B", 1000, 1000)
            deck = upper.deck + lower.deck + (
                "*MATERIAL, NAME=M1\n*ELASTIC\n1000., 0.3\n*MATERIAL, NAME=M2\n*ELASTIC\n"
                "400., 0.2\n*SOLID SECTION, ELSET=A, MATERIAL=M1\n"
            ) + "2.\n" * (kind[:3] == "CPE") + "*SOLID SECTION, ELSET=B, MATERIAL=M2\n" + (
                "2.\n" * (kind[:3] == "CPE") + pair("ABOTTOM", "BTOP", 0.3)
                + step("*BOUNDARY\nBBOTTOM-N, 2\nBLEFT-N, 1\nALEFT-N, 1"
                       "\nATOP-N, 2, 2, -0.02" + "\nBBOTTOM-N, 1" * (kind[:3] == "CPE"))
            )  # fmt: skip
            with self.subTest(kind), self.solve(deck).result() as result:
                found = -result.pairs[0].resultant[-1][1]
                self.assertAlmostEqual(abs(found) / force, 1, delta=0.01)


# Forces along y of CalculiX, with a linear pressure-overclosure of 1e7 and a stick slope of 1e6: on
# the thickness of 2, and 180 times those of its wedge of 2 degrees.
CALCULIX = {"CPE4": 14.29068, "CAX4": 180 * 0.1279933}


class Named(Case):
    """What a plane is is said, of a Gmsh mesh above all: it has one type for all."""

    def test_model_and_thickness(self):
        for kind, thickness, words in (
            ("CPE4", "10.", "plane strain (CPE), thickness 10"),
            ("CPS4", "", "plane stress (CPS), thickness 1 (not given)"),
            ("CAX4", "", "bodies of revolution (CAX) about the y axis, forces are for 360 degrees"),
        ):
            boundary = "" if kind == "CAX4" else "*BOUNDARY\nALEFT-N, 1"
            run = self.solve(press(kind, thickness=thickness, boundary=boundary))
            self.assertRegex(run.output, rf"(?m)^model +{re.escape(words)}$")
            self.assertIn(words, run.plan)
        solid = "*BLOCK, NAME=A, ELSET=A, NX=1, NY=1, NZ=1\n0, 0, 0, 2, 1.5, 0.5\n"
        run = self.solve(solid + section("A") + step("*BOUNDARY\nA-YMIN, 1, 3"))
        self.assertNotRegex(run.output, "(?m)^model")


class BesideSolids(Case):
    """The same bodies as solids."""

    def test_a_slice(self):
        """Plane strain is a block held along z, element by element."""
        lines = "*BOUNDARY\nALEFT-N, 1\nATOP-N, 2, 2, -0.02"
        friction = FLOOR + pair("ABOTTOM", "FLOOR", 0.2)
        deck = Mesh("CPE4", (4, 3), lambda a, b: (2 * a, 1.5 * b)).deck
        deck += section("A", thickness=0.5) + friction
        deck += step(lines) + step(lines + "\nATOP-N, 1, 1, 0.004").replace("ALEFT-N, 1\n", "")
        solid = (
            "*BLOCK, NAME=A, ELSET=A, TYPE=C3D8, NX=4, NY=3, NZ=1\n0, 0, 0, 2, 1.5, 0.5\n"
            + section("A").replace("*SOLID", "*NSET, NSET=AALL\nA\n*SOLID")
            + friction.replace("ABOTTOM", "A-YMIN")
            + step("*BOUNDARY\nAALL, 3\n" + lines.replace("ALEFT-N", "A-XMIN").replace(
                "ATOP-N", "A-YMAX"))
            + step("*BOUNDARY\nA-YMAX, 2, 2, -0.02\nA-YMAX, 1, 1, 0.004")
        )  # fmt: skip
        with self.solve(deck).result() as plane, self.solve(solid).result() as body:
            np.testing.assert_allclose(
                plane.pairs[0].resultant, body.pairs[0].resultant, rtol=1e-7, atol=1e-9
            )

    def test_a_ring(self):
        """A press fit of rings as a quarter of hexahedra: the pressure, to what chords take."""
        n, d = 24, 0.002

        def quarter(name, inner, outer, m, first):
            text, number = f"*NODE, NSET={name}ALL\n", {}
            for i, r in enumerate(np.linspace(inner, outer, m + 1)):
                for j in range(n + 1):
                    for k in range(2):
                        number[i, j, k] = first + len(number)
                        angle = pi / 2 * j / n
                        text += f"{number[i, j, k]}, {float(r * cos(angle))!r}, {0.3 * k!r}, "
                        text += f"{float(r * sin(angle))!r}\n"
            text += f"*ELEMENT, TYPE=C3D8, ELSET={name}\n"
            inside, outside, e = "", "", first
            for i in range(m):
                for j in range(n):
                    ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                    nodes = [number[p, q, 1] for p, q in ring] + [number[p, q, 0] for p, q in ring]
                    text += ", ".join(map(str, [e, *nodes])) + "\n"
                    inside += f"{e}, S6\n" * (i == 0)
                    outside += f"{e}, S4\n" * (i == m - 1)
                    e += 1
            for side, j in (("Z0", 0), ("X0", n)):
                text += f"*NSET, NSET={name}{side}\n"
                text += "".join(f"{v}\n" for (_, q, _), v in number.items() if q == j)
            return text + f"*SURFACE, NAME={name}IN\n{inside}*SURFACE, NAME={name}OUT\n{outside}"

        solid = quarter("A", 1, 2 + d, 8, 1) + quarter("B", 2, 3, 6, 5000) + section("A", "B")
        solid += pair("AOUT", "BIN") + step(
            "*BOUNDARY\nAALL, 2\nBALL, 2\nAZ0, 3\nBZ0, 3\nAX0, 1\nBX0, 1"
        )
        one = Mesh("CAX4", (8, 1), lambda a, e: (1 + (1 + d) * a, 0.3 * e), "A")
        two = Mesh("CAX4", (6, 1), lambda a, e: (2 + a, 0.3 * e), "B", 1000, 1000)
        ring = one.deck + two.deck + section("A", "B") + pair("ARIGHT", "BLEFT")
        ring += step("*BOUNDARY\nAALL, 2\nBALL, 2")
        with self.solve(ring).result() as revolved, self.solve(solid).result() as body:
            whole = revolved.pairs[0].resultant[-1][0] / (2 * pi * 2 * 0.3)
            part = body.pairs[0].resultant[-1][0] / (2 * 0.3)
            self.assertAlmostEqual(part / whole, 1, delta=0.01)


if __name__ == "__main__":
    unittest.main()
