"""Dynamic steps: closed forms, histories of a program of its own, energies, and what they refuse.

The histories of tests/data/dynamics.json were made by a prototype in Python that shares nothing
with the program: HHT-alpha, bricks, no mass at the plane, the inertia of the whole body put right.
"""

import itertools
import json
import math
import re
import unittest

import numpy as np
from boxes import Box
from program import DATA, Run

REFERENCE = json.loads((DATA / "dynamics.json").read_text())
MATERIAL = "*MATERIAL, NAME=M\n*ELASTIC\n{0}, {1}\n*DENSITY\n1.\n"


def block(name, low, size, n):
    """Return the cards of a block of bricks."""
    return (
        f"*BLOCK, NAME={name}, NX={n[0]}, NY={n[1]}, NZ={n[2]}\n"
        + ", ".join(map(repr, (*low, *size)))
        + f"\n*SOLID SECTION, ELSET={name}, MATERIAL=M\n"
    )


def before_plane(place, friction, slave="B-ZMIN"):
    """Return the cards of a plane z = place that faces up, and its pair."""
    return (
        f"*OBSTACLE, NAME=WALL, TYPE=PLANE\n0., 0., {place!r}, 0., 0., 1.\n"
        f"*SURFACE INTERACTION, NAME=I\n*FRICTION\n{friction!r}\n"
        f"*CONTACT PAIR, INTERACTION=I\n{slave}, WALL\n"
    )


def thrown(**velocity):
    """Return *INITIAL CONDITIONS of sets, each with three components."""
    lines = [
        f"{name}, {i + 1}, {v!r}\n"
        for name, way in velocity.items()
        for i, v in enumerate(way)
        if v
    ]
    return "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(lines)


def weight(g, name="B"):
    """Return the *DLOAD of an acceleration."""
    size = math.sqrt(sum(x * x for x in g))
    return f"*DLOAD\n{name}, GRAV, {size!r}, " + ", ".join(repr(x / size) for x in g) + "\n"


def step(dt, period, cards="", alpha=-0.05):
    """Return a dynamic step."""
    return f"*STEP\n*DYNAMIC, DIRECT, ALPHA={alpha!r}\n{dt!r}, {period!r}\n{cards}*END STEP\n"


def finite(deck):
    """Return the deck at finite strain."""
    return deck.replace("*STEP\n", "*STEP, NLGEOM\n")


def rubber():
    """Return the deck of a soft cube that is thrown askew and slides as it bounces."""
    return finite(
        block("B", (0, 0, 0), (1, 1, 1), (3, 3, 3))
        + MATERIAL.format(100.0, 0.3).replace("*ELASTIC", "*ELASTIC, LAW=NEO HOOKE")
        + before_plane(-0.1, 0.4)
        + thrown(B=(1.0, 0, -3.0))
        + step(0.005, 0.5, weight((0, 0, -10.0)))
    )


def spin(n=2, increments=150, each=math.pi / 200, cards=""):
    """Return the deck of a soft free cube that turns about x at 4."""
    at = [i / n for i in range(n + 1)]
    speeds = "".join(
        f"{1 + i + (n + 1) * (j + (n + 1) * k)}, {axis}, {v!r}\n"
        for k, z in enumerate(at) for j, y in enumerate(at) for i in range(n + 1)
        for axis, v in ((2, -4 * (z - 0.5)), (3, 4 * (y - 0.5)))
    )  # fmt: skip
    return finite(
        block("B", (0, 0, 0), (1, 1, 1), (n, n, n))
        + MATERIAL.format(100.0, 0.3).replace("*ELASTIC", "*ELASTIC, LAW=NEO HOOKE")
        + cards + "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + speeds
        + step(each, increments * each, "*NODE FILE\nU\n")
    )  # fmt: skip


def column():
    """Return the deck of a column that buckles: its tangent is definite in short increments."""
    return finite(
        block("B", (0, 0, 0), (0.2, 0.2, 4.0), (1, 1, 16))
        + MATERIAL.format(1000.0, 0.3).replace("ELASTIC", "ELASTIC, LAW=NEO HOOKE")
        .replace("\n1.\n", "\n0.01\n")
        + "*AMPLITUDE, NAME=A\n0., 0., 0.1, 1., 10., 1.\n*STEP\n*DYNAMIC\n0.1, 0.4\n"
        "*BOUNDARY, AMPLITUDE=A\nB-ZMAX, 3, 3, -0.2\n*BOUNDARY\nB-ZMIN, 1, 3\nB-ZMAX, 1, 2\n"
        + weight((0.5, 0, 0)) + "*END STEP\n"
    )  # fmt: skip


def together(deck):
    """Return the deck with displacements and reactions found together."""
    return deck.replace("*STEP", "*BODY SOLVER, TANGENT=NEWTON\n*STEP", 1)


def by_error(deck):
    """Return the deck with increments by their error in time."""
    return deck.replace("*DYNAMIC, DIRECT", "*DYNAMIC")


def bar(alpha=-0.05, n=20, period=2.0):
    """Return the deck of a bar of length 10 that strikes a wall at 10; E 900, density 1."""
    return (
        block("B", (0, 0, 0), (1, 1, 10), (1, 1, n))
        + MATERIAL.format(900.0, 0.0)
        + before_plane(-5.0, 0.0)
        + thrown(B=(0, 0, -10.0))
        + step(20 / n / 60, period, alpha=alpha)
    )


def slide(n=(4, 4, 2), low=0.0, width=1.0, cards="", period=0.5, dt=0.01):
    """Return the deck of a block that is pushed at 1 and slides to rest, mu 0.3, g 10."""
    return (
        block("B", (0, low, 0), (1, width, 0.5), n)
        + MATERIAL.format(1e4, 0.3)
        + before_plane(0.0, 0.3)
        + thrown(B=(1.0, 0, 0))
        + step(dt, period, weight((0, 0, -10.0)) + cards)
    )


def between_planes(deck):
    """Return the deck of a block with a second plane above it."""
    return deck.replace(
        "*SURFACE INTERACTION",
        "*OBSTACLE, NAME=LID, TYPE=PLANE\n0., 0., 0.6, 0., 0., -1.\n*SURFACE INTERACTION",
    ).replace("B-ZMIN, WALL\n", "B-ZMIN, WALL\nB-ZMAX, LID\n")


def bounce(period=0.4, alpha=0.0, dt=0.002):
    """Return the deck of a cube that falls from 0.1."""
    return (
        block("B", (0, 0, 0), (1, 1, 1), (3, 3, 3))
        + MATERIAL.format(1e4, 0.3)
        + before_plane(-0.1, 0.3)
        + step(dt, period, weight((0, 0, -10.0)), alpha)
    )


def held():
    """Return the deck of a block on a slope that is too slight for it to slide."""
    return (
        block("B", (0, 0, 0), (1, 1, 0.5), (4, 4, 2))
        + MATERIAL.format(1e4, 0.3)
        + before_plane(0.0, 0.3)
        + step(0.005, 1.0, weight((2.0, 0, -10.0)), -0.3)
    )


def shaken():
    """Return the deck of a cube whose top is pressed and moved to and fro."""
    way = "".join(f"{0.005 * k!r}, {math.sin(0.1 * k)!r}\n" for k in range(201))
    return (
        block("B", (0, 0, 0), (1, 1, 1), (3, 3, 3))
        + MATERIAL.format(1e3, 0.3)
        + before_plane(0.0, 0.3)
        + "*AMPLITUDE, NAME=SHAKE\n"
        + way
        + "*AMPLITUDE, NAME=PRESS\n0., 0., 0.2, 1.\n"
        + step(
            0.005,
            1.0,
            "*BOUNDARY, AMPLITUDE=SHAKE\nB-ZMAX, 1, 1, 0.05\n"
            "*BOUNDARY, AMPLITUDE=PRESS\nB-ZMAX, 3, 3, -0.02\n*BOUNDARY\nB-ZMAX, 2, 2\n",
        )
    )


class DynamicCase(unittest.TestCase):
    def solve(self, deck, *options, **more):
        """Run a deck, which must be certified throughout."""
        run = Run(deck, *options, name="d", **more)
        self.assertEqual(run.status, 0, run.output + run.errors)
        return run.result()


class Histories(DynamicCase):
    def test_a_prototype_has_the_same_histories(self):
        decks = {
            "bar": bar(), "slide": slide(), "held": held(), "bounce": bounce(), "shaken": shaken(),
            "rubber": rubber(), "spin": spin(),
        }  # fmt: skip
        ways = [*decks.items(), *((name, together(decks[name])) for name in ("rubber", "spin"))]
        for name, deck in ways:
            with self.subTest(name), self.solve(deck) as result:
                known = np.array(REFERENCE[name]["rows"])
                every = REFERENCE[name]["every"]
                force = result.pairs[0].resultant if result.pairs else np.zeros((10**4, 3))
                force = force[: len(result.history("time"))]
                energy = [result.history(f"energy/{x}") for x in
                          ("dissipation", "kinetic", "strain")]
                found = np.column_stack([force[:, 0], force[:, 2], *energy])[every - 1::every]
                scale = abs(known).max(axis=0)
                scale[:2] = scale[:2].max()
                scale[2:] = scale[2:].max()
                far = abs(found - known) / np.maximum(scale, 1e-300)
                self.assertLess(far.max(), 3e-8)


class ClosedForms(DynamicCase):
    def test_a_bar_strikes_a_wall(self):
        """The force is v sqrt(E rho) A for 2 L/c, and the bar leaves with its velocity."""
        with self.solve(bar()) as result:
            time, force = result.history("time"), result.pairs[0].resultant[:, 2]
            exact = np.where((time > 0.5) & (time < 0.5 + 2 / 3), 300.0, 0.0)
            self.assertLess(abs(force - exact).sum() / exact.sum(), 0.06)
            self.assertAlmostEqual(force.sum() / 60, 200.0, delta=5.0)
            self.assertAlmostEqual(result.field("velocity")[:, 2].mean(), 10.0, delta=0.4)

    def test_equal_bars_swap_their_velocities(self):
        """What one loses the other gets, to rounding."""
        deck = (
            block("LOW", (0, 0, 0), (1, 1, 5), (1, 1, 10))
            + block("UP", (0, 0, 6), (1, 1, 5), (1, 1, 10))
            + MATERIAL.format(900.0, 0.0)
            + "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\nUP-ZMIN, LOW-ZMAX\n"
            + thrown(UP=(0, 0, -10.0))
            + step(1 / 60, 1.0)
        )
        with self.solve(deck) as result:
            u = [result.field("displacement", i)[:, 2] for i in (-11, -1)]
            mean = (u[1] - u[0]) * 6
            upper = result.points[:, 2] > 5.5
            # Means over all nodes, of trilinear bricks of equal height.
            share = np.where(np.isin(result.points[:, 2], (0, 5, 6, 11)), 0.5, 1.0) / 40
            self.assertAlmostEqual((mean * share)[upper].sum(), 0.0, delta=0.5)
            self.assertAlmostEqual((mean * share)[~upper].sum(), -10.0, delta=0.5)
            self.assertLess(result.certificate["balance"].max(), 1e-10)

    def test_a_block_slides_to_rest(self):
        """Friction does all the work: v^2/(2 mu g), m v^2/2."""
        with self.solve(slide()) as result:
            way = result.field("displacement")[:, 0].mean()
            self.assertAlmostEqual(way, 1 / 6, delta=5e-4)
            self.assertAlmostEqual(result.history("energy/dissipation")[-1], 0.25, delta=1e-3)

    def test_free_fall_strains_nothing(self):
        """All sides may touch, and no element keeps its mass where it was."""
        for kind, n in (("C3D10", 2), ("C3D4", 3)):
            box = Box("B", (n, n, n), (kind,))
            sides = "".join(f"B-{a}{e}\n" for a in "XYZ" for e in (0, 1))
            deck = (
                box.cards()
                + MATERIAL.format(1e4, 0.3).replace("NAME=M", "NAME=STEEL")
                + "*NSET, NSET=N, ELSET=B\n*SURFACE, NAME=ALL, TYPE=NODE\n"
                + sides
                + before_plane(-9.0, 0.3, "ALL")
                + thrown(N=(1.0, 0.5, 0))
                + step(0.05, 1.0, weight((0, 0, -10.0)))
            )
            with self.subTest(kind), self.solve(deck) as result:
                u = result.field("displacement")
                np.testing.assert_allclose(u, np.tile([1.0, 0.5, -5.0], (len(u), 1)), atol=1e-10)
                self.assertLess(abs(result.history("energy/strain")).max(), 1e-12)
                np.testing.assert_allclose(
                    result.history("energy/kinetic")[-1], 0.5 * (1.25 + 100.0), rtol=1e-10
                )

    def test_a_block_falls_before_it_lands(self):
        """Its weight and its inertia are two sums over its elements: they agree to rounding."""
        for n in (4, 6, 12):
            deck = bounce(0.002, dt=0.001).replace("X=3, NY=3, NZ=3", f"X={n}, NY={n}, NZ={n}")
            with self.subTest(n), self.solve(deck) as result:
                u = result.field("displacement")
                np.testing.assert_allclose(u, np.tile([0, 0, -2e-5], (len(u), 1)), atol=1e-13)

    def test_velocities_move_evenly(self):
        """Displacements without an amplitude would jump; these go on in the next step."""
        moved = "*BOUNDARY, TYPE=VELOCITY\nB-ZMAX, 1, 1, 0.2\n*NODE FILE, FREQUENCY=1\nU\n"
        deck = (
            block("B", (0, 0, 0), (1, 1, 1), (2, 2, 2))
            + MATERIAL.format(1e4, 0.3)
            + before_plane(-5.0, 0.3)
            + step(0.004, 0.016, moved)
            + step(0.004, 0.008)
        )
        with self.solve(deck) as result:
            top = result.points[:, 2] > 0.9
            for row, time in enumerate(result.history("time")):
                np.testing.assert_allclose(
                    result.field("displacement", row)[top, 0], 0.2 * time, rtol=1e-12
                )
            self.assertEqual(row, 5)

    def test_amplitudes_of_velocities_are_integrated(self):
        """Displacements are their integrals, of tables and series, to rounding; energy stays."""
        times, values = np.array([0, 0.25, 0.6, 1.0]), np.array([0, 1, -0.5, 0.25])
        table = "0., 0., 0.25, 1., 0.6, -0.5, 1., 0.25\n"
        kinds = {"NAME=A": lambda t: np.interp(t, times, values),
                 "NAME=A, DEFINITION=PERIODIC": lambda t: np.sin(7 * t)}  # fmt: skip
        for (name, rate), order in itertools.product(kinds.items(), (1, 2)):
            lines = table if name == "NAME=A" else "1, 7., 0., 0.\n0., 1.\n"
            kind = ("VELOCITY", "ACCELERATION")[order - 1]
            deck = (
                block("B", (0, 0, 0), (1, 1, 1), (1, 1, 1)) + MATERIAL.format(1e4, 0.3)
                + f"*AMPLITUDE, {name}\n{lines}" + thrown(B=(0.3, 0, 0))
                + step(0.02, 1.0, f"*BOUNDARY, TYPE={kind}, AMPLITUDE=A\nB-ZMIN, 1, 1, 2.\n"
                       "*BOUNDARY\nB-ZMIN, 2, 3\n*NODE FILE, FREQUENCY=1\nU\n", alpha=0.0)
            )  # fmt: skip
            # Gauss's formula on the fine pieces of the table: it has its corners at their ends.
            fine = np.linspace(0, 1, 2001)
            x, w = np.polynomial.legendre.leggauss(4)
            at = fine[:-1, None] + 0.00025 * (1 + x)
            with self.subTest(kind + lines), self.solve(deck) as result:
                base = result.points[:, 2] < 0.1
                for row, time in enumerate(result.history("time")):
                    each = np.where(at < time, (time - at) ** (order - 1) * 2 * rate(at), 0)
                    far = (each @ w).sum() * 0.00025 + (0.3 * time if order == 2 else 0)
                    np.testing.assert_allclose(
                        result.field("displacement", row)[base, 0], far, atol=1e-9
                    )
                self.assertEqual(row, 49)

    def test_supports_are_as_fast_as_their_amplitude(self):
        """Also where it bends or jumps inside an increment: by the way it goes at the end."""
        table = "0., 0., 0.053, 0.02, 0.096, 0.02, 0.0960001, 0.05, 0.2, 0.154\n"
        deck = (
            block("B", (0, 0, 0), (1, 1, 1), (1, 1, 1)) + MATERIAL.format(1e4, 0.3)
            + "*AMPLITUDE, NAME=A\n" + table
            + step(0.02, 0.2, "*BOUNDARY, AMPLITUDE=A\nB-ZMIN, 1, 1, 2.\n"
                   "*BOUNDARY\nB-ZMIN, 2, 3\n*NODE FILE, FREQUENCY=1\nV\n")
        )  # fmt: skip
        with self.solve(deck) as result:
            base = result.points[:, 2] < 0.1
            for row in range(10):
                speed = 0.04 / 0.053 if row < 2 else 0.0 if row < 4 else 2.0
                np.testing.assert_allclose(
                    result.field("velocity", row)[base, 0], speed, rtol=1e-6, err_msg=str(row)
                )

    def test_the_shortest_increments_know_the_speed_of_supports(self):
        """They are 1/4096 of the deck's: so short are those behind a stroke by a support."""
        deck = (
            block("B", (0, 0, 0), (1, 1, 1), (2, 2, 2)) + MATERIAL.format(1e7, 0.3)
            + "*AMPLITUDE, NAME=A\n0., 0., 1., 1.\n"
            + "*STEP\n*DYNAMIC\n0.32, 0.32, 1e-9\n*BOUNDARY, AMPLITUDE=A\nB-ZMIN, 1, 1, 1.\n"
            "*BOUNDARY\nB-ZMIN, 2, 3\n*NODE FILE, FREQUENCY=1\nV\n*END STEP\n"
        )  # fmt: skip
        with self.solve(deck) as result:
            base = result.points[:, 2] < 0.1
            self.assertAlmostEqual(result.history("time")[0], 0.32 / 4096)
            np.testing.assert_allclose(result.field("velocity", 0)[base, 0], 1.0, rtol=1e-9)

    def test_prescribed_accelerations_go_on(self):
        """By the speed that the step before ends with, as a stone that is thrown; then evenly."""
        held = "*BOUNDARY\nB-ZMIN, 2, 3\n"
        pushed = "*BOUNDARY, TYPE=ACCELERATION\nB-ZMIN, 1, 1, {}\n"
        deck = (
            block("B", (0, 0, 0), (1, 1, 1), (1, 1, 1)) + MATERIAL.format(1e4, 0.3)
            + step(0.05, 1.0, pushed.format(2.0) + held, alpha=0.0) + step(0.05, 0.5, "", 0.0)
            + step(0.05, 1.0, pushed.format(-4.0), 0.0) + step(0.05, 1.0, pushed.format(0.0), 0.0)
        )  # fmt: skip
        with self.solve(deck) as result:
            base = result.points[:, 2] < 0.1
            found = result.field("displacement")[base, 0]
        # 1 + 2 (1/2) + 2/8; at 3, less 4/2; then at -1.
        np.testing.assert_allclose(found, 2.25 + 3.0 - 2.0 - 1.0, rtol=1e-12)

    def test_accelerations_along_local_directions_go_on(self):
        """First velocities are along x, y, z, and the motion is along the direction of a card."""
        deck = (
            block("B", (0, 0, 0), (1, 1, 1), (1, 1, 1)) + MATERIAL.format(1e4, 0.3)
            + "*TRANSFORM, NSET=B-ZMIN, TYPE=R\n0.6, 0.8, 0., -0.8, 0.6, 0.\n"
            + thrown(B=(0.3, 0.4, 0))
            + step(0.05, 1.0, "*BOUNDARY, TYPE=ACCELERATION\nB-ZMIN, 1, 1, 2.\n"
                   "*BOUNDARY\nB-ZMIN, 2, 3\n", alpha=0.0)
        )  # fmt: skip
        with self.solve(deck) as result:
            base = result.points[:, 2] < 0.1
            np.testing.assert_allclose(
                result.field("displacement")[base] @ [0.6, 0.8, 0.0], 0.5 + 1.0, rtol=1e-12
            )

    def test_a_free_body_turns(self):
        """What time takes of its angular momentum and energy falls as the square of increments."""
        twist, lost = [], []
        for n in (75, 150):
            with self.solve(spin(increments=n, each=0.75 * math.pi / n)) as result:
                twist.append(result.history("error/angular_momentum")[-1])
                lost.append(result.history("energy/balance")[-1])
                kinetic = result.history("energy/kinetic")[-1]
        self.assertLess(twist[1], 0.002)
        self.assertLess(lost[1], 0.006 * kinetic)
        for first, second in (twist, lost):
            self.assertLess(second, 0.4 * first)
            self.assertGreater(second, 0.1 * first)

    def test_a_pendulum_swings_through(self):
        """A bar that hangs on an edge falls from level to the other side, as if it were rigid."""
        deck = finite(
            block("B", (0, 0, 0), (1, 0.1, 0.1), (8, 1, 1)) + MATERIAL.format(1e5, 0.3)
            + "*BOUNDARY\n1, 1, 3\n10, 1, 3\n"
            + step(0.01, 1.2, weight((0, 0, -10.0)) + "*NODE FILE, FREQUENCY=1\nU\n")
        )  # fmt: skip
        with self.solve(deck) as result:
            end = int(np.argmax(result.points[:, 0] - result.points[:, 2]))
            at = [result.points[end] + result.field("displacement", i)[end] for i in range(120)]
            found = np.unwrap([math.atan2(-z, x) for x, _, z in at])
        angle, rate, right = 0.0, 0.0, []
        for i in range(12000):
            # Its inertia about the edge, and where its centre is.
            rate += 1e-4 * 10 * (0.5 * math.cos(angle) + 0.05 * math.sin(angle)) * 3 / 1.01
            angle += 1e-4 * rate
            if i % 100 == 99:
                right.append(angle)
        self.assertGreater(max(right), 3.0)
        self.assertLess(abs(found - right).max(), 0.01)

    def test_both_ways_to_balance_are_one(self):
        """With supports that move, damping, and a body that lands on its edge."""
        faces = ", ".join(f"B-{side}" for side in ("XMIN", "XMAX", "YMIN", "YMAX", "ZMIN", "ZMAX"))
        edge = (
            spin(3, 30, 0.01, "*SURFACE, NAME=ALL, COMBINE=UNION\n" + faces + "\n"
                 "*OBSTACLE, NAME=WALL, TYPE=PLANE\n-0.1, 0., -0.1, 1., 0., 1.\n"
                 "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3\n"
                 "*CONTACT PAIR, INTERACTION=I\nALL, WALL\n")
            .replace("100.0, 0.3", "1000.0, 0.3")
            .replace("*NODE FILE", weight((-10.0, 0, -10.0)) + "*NODE FILE")
        )  # fmt: skip
        damped = finite(shaken()).replace("*DENSITY", "*DAMPING, ALPHA=2.\n*DENSITY")
        for name, deck in {"edge": edge, "shaken": damped}.items():
            with self.subTest(name), self.solve(deck) as one, self.solve(together(deck)) as other:
                self.assertGreater(one.pairs[0].resultant[:, 2].max(), 1.0)
                u = one.field("displacement")
                np.testing.assert_allclose(
                    other.field("displacement"), u, atol=1e-7 * abs(u).max()
                )
                np.testing.assert_allclose(
                    other.pairs[0].resultant, one.pairs[0].resultant,
                    atol=1e-6 * abs(one.pairs[0].resultant).max(),
                )  # fmt: skip

    def test_a_cube_tumbles(self):
        """It lands on a corner, slides and turns, on faces all of which may touch."""
        faces = ", ".join(f"B-{side}" for side in ("XMIN", "XMAX", "YMIN", "YMAX", "ZMIN", "ZMAX"))
        wall = before_plane(-0.3, 0.4, "ALL").replace(
            "*CONTACT PAIR", f"*SURFACE, NAME=ALL, COMBINE=UNION\n{faces}\n*CONTACT PAIR"
        )
        deck = spin(4, 60, 0.01, wall).replace("100.0", "1000.0")
        deck = deck.replace("*NODE FILE", weight((0, 0, -10.0)) + "*NODE FILE")
        run = Run(deck, name="d")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("moments of inertia of bodies are wrong by up to 4", run.output)
        with run.result() as result:
            force = result.pairs[0].resultant
            names = ("kinetic", "strain", "dissipation", "external_work", "contact", "balance")
            energy = {name: result.history(f"energy/{name}") for name in names}
        self.assertGreater(force[:, 2].max(), 20.0)
        self.assertGreater(energy["dissipation"][-1], 0.5)
        had = energy["kinetic"] + energy["strain"] + energy["dissipation"]
        lost = energy["external_work"] + energy["contact"] - had
        np.testing.assert_allclose(np.diff(lost), np.diff(energy["balance"]), atol=1e-10)
        self.assertLess(abs(energy["contact"][-1]) + abs(energy["balance"][-1]), 0.05 * had.max())

    def test_a_mass_on_a_spring_swings(self):
        """Its place is v/w sin(w t), with an error that falls as the square of the increment."""
        k, v = 40.0, 1.0
        late = []
        for dt in (0.05, 0.025):
            deck = (
                block("B", (0, 0, 0), (1, 1, 1), (1, 1, 1))
                + MATERIAL.format(1e9, 0.0)
                + "*ELEMENT, TYPE=SPRING1, ELSET=COIL\n"
                + "".join(f"{901 + i}, {i + 1}\n" for i in range(8))
                + f"*SPRING, ELSET=COIL\n1\n{k / 8!r}\n"
                + thrown(B=(v, 0, 0))
                + step(dt, 1.0, "*BOUNDARY\nB, 2, 3\n", 0.0)
            )
            with self.solve(deck) as result:
                late.append(result.field("displacement")[0, 0] - v / k**0.5 * math.sin(k**0.5))
        self.assertLess(abs(late[1]), 0.02 * v / k**0.5)
        self.assertAlmostEqual(late[0] / late[1], 4.0, delta=0.3)

    def test_a_damped_brick_swings(self):
        """By exp(-z w t), and what damping takes is what is gone; errors fall as dt squared."""
        frequency, ratio = 30.0, (2.0 / 30.0 + 0.003 * 30.0) / 2
        swings = frequency * math.sqrt(1 - ratio**2)
        late = []
        for dt in (0.01, 0.005):
            deck = (
                block("B", (0, 0, 0), (1, 1, 1), (1, 1, 1))
                + MATERIAL.format(300.0, 0.0) + "*DAMPING, ALPHA=2., BETA=0.003\n"
                + "*BOUNDARY\nB-ZMIN, 1, 3\nB-ZMAX, 1, 2\n" + thrown(**{"B-ZMAX": (0, 0, 1.0)})
                + step(dt, 1.0, "*NODE FILE, FREQUENCY=1\nU\n", alpha=0.0)
            )  # fmt: skip
            with self.solve(deck) as result:
                time = result.history("time")
                top = result.points[:, 2] > 0.9
                found = [result.field("displacement", i)[top, 2].mean() for i in range(len(time))]
                had = result.history("energy/kinetic") + result.history("energy/strain")
                np.testing.assert_allclose(result.history("energy/damped"), 1 / 6 - had, atol=1e-13)
            right = np.exp(-ratio * frequency * time) / swings * np.sin(swings * time)
            late.append(abs(found - right).max() * frequency)
        self.assertLess(late[1], 0.01)
        self.assertLess(late[1], 0.3 * late[0])

    def test_damping_moves_nothing(self):
        """A body that rings and lands keeps its momentum until then; its skin is damped, too."""
        damped = "*DAMPING, BETA=0.002\n*OBSTACLE"
        deck = bounce(0.3).replace("*OBSTACLE", damped, 1).replace(
            "*STEP\n", thrown(**{"B-ZMAX": (0.0, 0.0, 0.5)}) + "*STEP\n"
        )
        with self.solve(deck) as result:
            lost = result.history("energy/damped")
            gone = [result.history(f"energy/{x}") for x in ("kinetic", "strain", "balance")]
            force = result.pairs[0].resultant[:, 2]
        # At rest but for the top: a quarter of the momentum of a body that moves as fast.
        first = int(np.argmax(force > 0))
        self.assertGreater(first, 20)
        self.assertGreater(np.diff(lost).min(), -1e-4 * lost[-1])
        self.assertGreater(lost[first - 1], 0.01)
        self.assertLess(abs(gone[2]).max(), 1e-12)
        self.assertGreater(force.max(), 10.0)

    def test_a_coupling_hands_on_what_moves_it(self):
        """Its reference node has the mass of its surface: momentum is force times time, and a body
        is moved by it as by its own nodes."""
        cube = block("B", (0, 0, 0), (1, 1, 1), (2, 2, 2)) + MATERIAL.format(1e4, 0.3)
        head = (
            "*NODE\n9001, 0.5, 0.5, 1.5\n"
            "*COUPLING, CONSTRAINT NAME=C, REF NODE=9001, SURFACE=B-ZMAX\n"
        )
        share = np.array([0.25, 0.5, 0.25])
        share = np.einsum("i,j,k->ijk", share, share, share).ravel()
        for kind in ("*KINEMATIC\n1, 3\n", "*DISTRIBUTING\n1, 3\n"):
            deck = cube + head + kind + step(0.01, 0.1, "*CLOAD\n9001, 3, 10.\n")
            with self.subTest(kind), self.solve(deck) as result:
                x = result.points
                mine = x[:, 2] < 1.1
                at = np.rint(2 * x[mine]).astype(int) @ (9, 3, 1)
                momentum = share[at] @ result.field("velocity")[mine]
                np.testing.assert_allclose(momentum, [0, 0, 1.0], atol=1e-10)
        moved = [
            cube + "*STEP\n*DYNAMIC, DIRECT, ALPHA=0.\n0.005, 0.1\n*BOUNDARY, TYPE=VELOCITY\n"
            "B-ZMAX, 1, 1, 1.\nB-ZMAX, 2, 3, 0.\n*END STEP\n",
            cube + head + "*KINEMATIC\n1, 3\n" + "*STEP\n*DYNAMIC, DIRECT, ALPHA=0.\n0.005, 0.1\n"
            "*BOUNDARY, TYPE=VELOCITY\n9001, 1, 1, 1.\n*BOUNDARY\n9001, 2, 6\n*END STEP\n",
        ]
        with self.solve(moved[0]) as by_nodes, self.solve(moved[1]) as by_coupling:
            top = by_nodes.points[:, 2] > 0.99
            for i, way in ((0, 0.005), (-1, 0.1)):
                u = by_nodes.field("displacement", i)[top]
                np.testing.assert_allclose(u, np.tile([way, 0, 0], (9, 1)), atol=1e-15)
            for name in ("external_work", "kinetic", "strain"):
                one, two = (r.history(f"energy/{name}") for r in (by_nodes, by_coupling))
                np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-12)
            # What begins to move at once strikes: no energy is lost by that.
            self.assertLess(abs(by_nodes.history("energy/balance")).max(), 1e-12)

    def test_half_a_body_is_half_of_the_whole(self):
        sharp = "*CONTACT SOLVER, TOLERANCE=1e-12\n*STEP"
        whole = slide(low=-0.5, period=0.2).replace("*STEP", sharp)
        half = slide((4, 2, 2), 0.0, 0.5, "*BOUNDARY\nB-YMIN, 2, 2\n", 0.2).replace("*STEP", sharp)
        with self.solve(whole) as whole, self.solve(half) as half:
            most = whole.history("energy/kinetic").max()
            for name in ("kinetic", "strain", "dissipation", "balance"):
                one, two = (r.history(f"energy/{name}") for r in (whole, half))
                np.testing.assert_allclose(one, 2 * two, rtol=0, atol=1e-10 * most)
            one, two = (r.pairs[0].resultant[:, ::2] for r in (whole, half))
            np.testing.assert_allclose(one, 2 * two, rtol=0, atol=1e-8 * abs(one).max())


class Increments(DynamicCase):
    def test_they_follow_their_error(self):
        """Any first one leads to the same pressure of a bar, in fewer than DIRECT takes for it."""
        direct = bar()
        for dt in (0.2, 0.005):
            deck = by_error(direct.replace(f"{1 / 60!r}, 2.0", f"{dt!r}, 2.0"))
            with self.subTest(dt), self.solve(deck) as result:
                ends = np.concatenate([[0.0], result.history("time")])
                force = result.pairs[0].resultant[:, 2]
                exact = np.clip(ends, 0.5, 0.5 + 2 / 3)
                far = abs(force * np.diff(ends) - 300 * np.diff(exact)).sum()
                self.assertLess(far / 200.0, 0.08)
                self.assertLess(len(force), 100)
                self.assertLessEqual(result.history("error/in_time").max(), 0.03)
                lengths = np.diff(ends) / dt
                power = np.log2(lengths[:-1])
                np.testing.assert_allclose(power, np.rint(power), atol=1e-9)
        smallest = by_error(direct.replace(f"{1 / 60!r}, 2.0", "0.2, 2.0, 0.1"))
        run = Run(smallest, name="d")
        self.assertIn("as short as increments get", run.output)

    def test_a_load_that_jumps_acts_from_there_on(self):
        """A block that lies there is pulled by 10 from 0.1 on, and friction holds 3 of it."""
        table = "*AMPLITUDE, NAME=J\n0., 0., 0.1, 0., 0.10000001, 1., 1., 1.\n"
        deck = (
            block("B", (0, 0, 0), (1, 1, 0.5), (4, 4, 2))
            + MATERIAL.format(1e4, 0.3)
            + before_plane(0.0, 0.3)
            + table
            + step(
                0.01,
                0.4,
                weight((0, 0, -10.0)) + "*DLOAD, AMPLITUDE=J\nB, GRAV, 10., 1., 0., 0.\n",
            )
        )
        for text in (deck, by_error(deck)):
            with self.subTest(text is deck), self.solve(text) as result:
                u, v = (result.field(x)[:, 0].mean() for x in ("displacement", "velocity"))
                self.assertAlmostEqual(u / 0.315, 1.0, delta=0.015)
                self.assertAlmostEqual(v / 2.1, 1.0, delta=0.005)
        late = Run(deck.replace("0., 0., 0.1, 0., 0.10000001", "0., 0., 0.105, 0., 0.10500001"),
                   name="d")
        self.assertIn("an amplitude jumps inside it", late.output)

    def test_a_step_that_goes_on_changes_nothing(self):
        """Two steps with the same loads are one."""
        whole = slide(period=0.2)
        parts = slide(period=0.1) + step(0.01, 0.1, weight((0, 0, -10.0)))
        with self.solve(whole) as whole, self.solve(parts) as parts:
            for name in ("displacement", "velocity"):
                np.testing.assert_allclose(whole.field(name), parts.field(name), atol=1e-13)


class Energies(DynamicCase):
    def test_without_alpha_the_balance_is_exact(self):
        """Work of normal forces included, which is the error of contact in time."""
        with self.solve(bounce()) as result:
            self.assertLess(abs(result.history("energy/balance")).max(), 1e-11)
            self.assertGreater(abs(result.history("energy/contact")).max(), 1e-3)

    def test_a_slow_motion_needs_no_inertia(self):
        """A block that is pressed in a period of its vibration, or in a thousand."""
        for period, is_slow in ((0.02, False), (20.0, True)):
            deck = (
                block("B", (0, 0, 0), (1, 1, 0.5), (2, 2, 2))
                + MATERIAL.format(1e4, 0.3)
                + before_plane(0.0, 0.3)
                + f"*AMPLITUDE, NAME=P, DEFINITION=SMOOTH STEP\n0., 0., {period!r}, 1.\n"
                + step(period / 50, period, "*BOUNDARY, AMPLITUDE=P\nB-ZMAX, 3, 3, -0.01\n"
                       "*BOUNDARY\nB-ZMAX, 1, 2\n")
            )
            run = Run(deck, name="d")
            self.assertEqual("*STATIC would do" in run.output, is_slow, run.output + run.errors)

    def test_a_body_may_arrive_as_an_increment_ends(self):
        """Its gaps are rounding then, and so would be the forces that answer these."""
        deck = (
            block("B", (0, 0, 0), (1, 1, 0.5), (4, 4, 2))
            + MATERIAL.format(1e4, 0.3)
            + before_plane(-0.1, 0.3)
            + thrown(B=(1.0, 0, -0.5))
            + step(0.002, 0.21)
        )
        with self.solve(deck) as result:
            force = result.pairs[0].resultant[:, 2]
            self.assertLess(abs(force[:100]).max(), 1e-12)
            self.assertGreater(force[101], 1.0)
        # Of more nodes solutions are rounded more.
        long = bar(n=60, period=0.55).replace("NX=1, NY=1", "NX=3, NY=3")
        long = re.sub(r"0\.00\d+, 0\.55", "0.016666666666666666, 0.55", long)
        with self.solve(long.replace("*STEP", "*CONTACT SOLVER, TOLERANCE=2e-4\n*STEP")) as result:
            force = result.pairs[0].resultant[:, 2]
            self.assertLess(abs(force[:30]).max(), 1e-9)
            self.assertGreater(force[-1], 100.0)

    def test_what_the_scheme_took_is_told(self):
        run = Run(bounce(alpha=-0.05), name="d")
        told = re.search(r"the scheme in time took ([\d.]+) % of the energy", run.output)
        with run.result() as result:
            energy = {x: result.history(f"energy/{x}") for x in
                      ("kinetic", "strain", "dissipation", "external_work", "contact")}
            lost = (energy["external_work"] + energy["contact"] - energy["kinetic"]
                    - energy["strain"] - energy["dissipation"])
            most = max((energy["kinetic"] + energy["strain"]).max(),
                       (abs(energy["dissipation"]) + abs(energy["external_work"])).max())
            self.assertAlmostEqual(float(told[1]), 100 * lost[-1] / most, delta=0.1)

    def test_a_body_that_gains_energy_ends_the_run(self):
        """At alpha 0 and long increments contact gives more than a bar may have."""
        deck = (
            block("B", (0, 0, 0), (1, 1, 10), (1, 1, 20))
            + MATERIAL.format(900.0, 0.0)
            + before_plane(-1.0, 0.0)
            + step(1 / 30, 10.0, weight((0, 0, -10.0)), 0.0)
        )
        run = Run(deck, name="d")
        self.assertEqual(run.status, 2)
        self.assertIn("have given the bodies", run.errors)
        # Nor beside a body that flies by with a thousand times its energy.
        other = block("C", (5, 0, 0), (1, 1, 1), (1, 1, 1))
        deck = deck.replace("*MATERIAL", other + "*MATERIAL", 1)
        run = Run(deck.replace("*STEP\n", thrown(C=(1600.0, 0, 0)) + "*STEP\n"), name="d")
        self.assertEqual(run.status, 2)
        self.assertIn("have given the body of node 1 ", run.errors)
        # At finite strain, too: a cube that falls.
        deck = bounce(0.42, 0.0, 0.004).replace("*ELASTIC", "*ELASTIC, LAW=NEO HOOKE")
        deck = deck.replace("*MATERIAL", other + "*MATERIAL", 1)
        run = Run(finite(deck.replace("*STEP\n", thrown(C=(45.0, 0, 0)) + "*STEP\n")), name="d")
        self.assertEqual(run.status, 2)
        self.assertIn("have given the body of node 1 ", run.errors)

    def test_a_jump_of_a_support_hides_no_gain(self):
        """It is no speed, beside which a bar has little energy; a spring joins the bodies."""
        deck = (
            block("B", (0, 0, 0), (1, 1, 10), (1, 1, 20))
            + block("C", (5, 0, 0), (1, 1, 1), (1, 1, 1))
            + "*ELEMENT, TYPE=SPRINGA, ELSET=S\n9001, 1, 85\n*SPRING, ELSET=S\n\n1e-9\n"
            + MATERIAL.format(900.0, 0.0)
            + before_plane(-1.0, 0.0)
            + "*AMPLITUDE, NAME=J\n0., 0., 9.98, 0., 9.981, 1., 10., 1.\n"
            + step(1 / 30, 10.0, weight((0, 0, -10.0)) + "*BOUNDARY\nC, 2, 3\n"
                   "*BOUNDARY, AMPLITUDE=J\nC, 1, 1, 2000.\n", 0.0)
        )  # fmt: skip
        run = Run(deck, name="d")
        self.assertEqual(run.status, 2, run.output)
        self.assertRegex(run.errors, r"increment 2\d\d: .* have given the bodies")

    def test_what_a_paddle_does_is_no_gift(self):
        """A plane that turns strikes a block: the block has the work of the torque, 0.124."""
        deck = (
            block("B", (0, 0, 0), (1, 1, 1), (2, 2, 2))
            + MATERIAL.format(1000.0, 0.3)
            + before_plane(0.0, 0.0).replace("TYPE=PLANE", "TYPE=PLANE, REF NODE=900")
            + step(0.005, 0.1, "*BOUNDARY\n900, 1, 6\n*BOUNDARY\n900, 5, 5, -0.01\n").replace(
                ", DIRECT", "")
        )
        deck = "*NODE\n900, -2., 0.5, 0.\n" + deck
        with self.solve(deck) as result:
            had = result.history("energy/kinetic")[-1] + result.history("energy/strain")[-1]
            work = result.history("energy/external_work")[-1]
            np.testing.assert_allclose(had, work, rtol=0.01)
            self.assertGreater(work, 0.1)
            for share in ("contact", "balance"):
                self.assertLess(abs(result.history(f"energy/{share}")).max(), 0.01 * work)


class Steps(DynamicCase):
    def test_a_body_at_rest_stays_there(self):
        """What a static step leaves in balance a dynamic one does not move."""
        deck = slide(period=0.1).replace(thrown(B=(1.0, 0, 0)), "").replace(
            "*STEP\n",
            "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-XMIN, 1, 1\nB-YMIN, 2, 2\n"
            + weight((0, 0, -10.0))
            + "*END STEP\n*STEP\n",
        )
        with self.solve(deck) as result:
            u = [result.field("displacement", i) for i in (0, -1)]
            self.assertLess(abs(u[1] - u[0]).max(), 1e-7 * abs(u[0]).max())
            self.assertLess(result.history("energy/kinetic")[-1], 1e-16)

    def test_a_continued_run_is_the_same_to_the_bit(self):
        decks = ((slide(), "20"), (by_error(slide(dt=0.02)), "1"), (rubber(), "50"),
                 (together(rubber()), "51"), (column(), "129"), (column(), "133"))  # fmt: skip
        for deck, at in decks:
            with self.subTest(at), self.solve(deck) as once, self.solve(
                deck, "--continue", ended_at=("1", at)
            ) as twice:
                for name in ("displacement", "velocity", "acceleration"):
                    np.testing.assert_array_equal(once.field(name), twice.field(name))
                np.testing.assert_array_equal(
                    once.history("energy/balance"), twice.history("energy/balance")
                )

    def test_what_is_tied_falls_together(self):
        tied = (
            block("B", (0, 0, 0), (1, 1, 0.5), (2, 2, 2))
            + block("C", (0, 0, 0.5), (1, 1, 0.5), (3, 3, 2))
            + MATERIAL.format(1e4, 0.3)
            + "*TIE, NAME=T\nC-ZMIN, B-ZMAX\n"
            + before_plane(-9.0, 0.3)
            + thrown(B=(1.0, 0, 0), C=(1.0, 0, 0))
            + step(0.05, 0.5, weight((0, 0, -10.0)) + weight((0, 0, -10.0), "C"))
        )
        with self.solve(tied) as result:
            u = result.field("displacement")
            np.testing.assert_allclose(u, np.tile([0.5, 0, -1.25], (len(u), 1)), atol=1e-10)


class Accuracy(DynamicCase):
    """Means in time are as accurate as they are asked to be: impulses are known."""

    def test_a_bar_strikes_a_wall(self):
        """The mean force is 2 m v/T, and the error in time is told by three runs."""
        with self.solve(by_error(bar()), "--accuracy", "0.1") as result:
            values, divisions = result.file["accuracy/values"], result.file["accuracy/divisions"]
            told = result.file["accuracy"].attrs["mesh_and_load_steps"]
            self.assertLess(told, 0.1)
            self.assertAlmostEqual(values[-1, -1, 0], 100.0, delta=100 * told)
            self.assertEqual(abs(values[-1, :-1]).max(), 0.0)
            self.assertEqual(set(divisions[:3]), {1, 2, 4})
            # What the shortest increments change is what the longest are wrong by.
            self.assertGreater(abs(values[2, -1, 0] - values[0, -1, 0]), 1.0)
            self.assertLess(abs(values[2, -1, 0] - 100.0), 0.3)

    def test_a_block_slides_to_rest(self):
        """The means of normal force and friction are m g and m v/T."""
        with self.solve(by_error(slide()), "--accuracy", "0.02") as result:
            mean = result.file["accuracy/values"][-1, -1]
            np.testing.assert_allclose(mean[[0, 3]], 5.0, rtol=0.02)
            self.assertAlmostEqual(mean[4], -1.0, delta=0.02 * 0.3 * 5.0)

    def test_what_the_deck_keeps_is_told(self):
        """Increments of DIRECT stay, and where they are too long that is said."""
        run = Run(slide(), "--accuracy", "0.02", name="d")
        self.assertEqual(run.status, 2)
        self.assertIn("and DIRECT keeps them as they are", run.errors)
        with run.result() as result:
            self.assertEqual(len(result.history("time")), 50)

    def test_meshes_without_mass_are_skipped(self):
        """A layer between two surfaces has none; the deck has two."""
        deck = between_planes(slide(period=0.1))
        run = Run(deck, "--accuracy", "0.5", name="d")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("4 elements are too few", run.output)


class Refused(unittest.TestCase):
    def refuse(self, deck, words, status=1, *options):
        run = Run(deck, *options, name="d")
        self.assertEqual(run.status, status, run.output + run.errors)
        self.assertIn(words, run.errors)

    def test_what_is_not_covered_is_named(self):
        deck = slide(period=0.02)
        self.refuse(finite(deck).replace("NLGEOM", "NLGEOM=AUTO"), "does not cover NLGEOM=AUTO")
        self.refuse(
            together(finite(deck)).replace("*BODY", "*CONTACT SOLVER, SOLVER=SWEEPS\n*BODY"),
            "does not cover TANGENT=NEWTON with a SOLVER of *CONTACT SOLVER",
        )
        self.refuse(deck, "an accuracy on a mesh that is kept", 1, "--accuracy", "0.1", "--refine",
                    "0")  # fmt: skip
        self.refuse(deck, "bounds of time and memory", 1, "--time", "10")
        for option in (("--until-steady",), ("--symmetry",), ("--as-rigid", "B")):
            self.refuse(deck, option[0], 1, *option)
        self.refuse(
            deck.replace("*DENSITY\n1.\n", "").replace(weight((0, 0, -10.0)), ""),
            "material M of element 1 has no *DENSITY",
        )
        self.refuse(deck.replace("-0.05", "-0.6"), "ALPHA must be from -0.5 to 0")
        self.refuse(
            deck.replace(
                "*STEP", "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-ZMAX, 1, 3\n*END STEP\n*STEP"
            ),
            "takes a first step that is a *DYNAMIC",
        )

    def test_elements_with_contact_nodes_only_are_named(self):
        deck = between_planes(slide((3, 3, 1), period=0.02))
        self.refuse(deck, "the body of element 1 has no others")


if __name__ == "__main__":
    unittest.main()
