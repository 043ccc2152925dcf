"""Displacements and reactions together, beside one after the other (*BODY SOLVER, TANGENT=KEPT)."""

import unittest

import numpy as np
from program import INPUT, Run
from test_finite_curved import pressed
from test_finite_loads import BEAM, ENDS, FOLLOWING, INNER
from test_no_separation import BAR
from test_turning import HELD, floor, step, wheel

FEW = 14  #: iterations of an increment, most of them by the factor of where it begins

RUBBER = "*HYPERELASTIC, NEO HOOKE\n0.178571, 1.2"

# A cube of 2 x 2 x 2 elements above an obstacle, its face XMIN .. ZMAX named CUBE-..
CUBE = """\
*BLOCK, NAME=CUBE, ELSET=CUBE, TYPE={kind}, NX=2, NY=2, NZ=2
0., 0., {gap},  1., 1., 1.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=CUBE, MATERIAL=M
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
CUBE-ZMIN, GROUND
*BODY SOLVER, TANGENT=NEWTON
*STEP, NLGEOM
*STATIC, DIRECT
1., 1.
*DSLOAD
CUBE-ZMAX, P, 1.
*END STEP
"""

# A body [-1, 1] x [-1, 1] x [0, 1], held below, in local axes that are turned about y, into which a
# ball is pressed and dragged.
BALL = """\
*PARAMETER
a = {degrees}*pi/180
tangent = {tangent}
*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=C3D8, ELSET=B
{elements}
*NODE
90000, <2*sin(a)>, 0., <2*cos(a)>
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE, NAME=TOP
{top}
*NSET, NSET=LOW
{low}
*OBSTACLE, NAME=TOOL, TYPE=SPHERE, REF NODE=90000
<2*sin(a)>, 0., <2*cos(a)>, 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.6
*CONTACT PAIR, INTERACTION=DRY
TOP, TOOL
*CONTACT SOLVER, TOLERANCE=1e-10
*BODY SOLVER, TANGENT=<tangent>
*STEP, NLGEOM
*STATIC, DIRECT
1., 3.
*BOUNDARY
LOW, 1, 3
90000, 1, 1, <-0.2*sin(a)>
90000, 2, 2
90000, 3, 3, <-0.2*cos(a)>
*END STEP
*STEP
*STATIC, DIRECT
1., 3.
*BOUNDARY
90000, 1, 1, <-0.2*sin(a) + 0.3*cos(a)>
90000, 3, 3, <-0.2*cos(a) - 0.3*sin(a)>
*END STEP
"""


def ball(degrees, tangent):
    """Return the deck of the ball, everything turned about y."""
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0],
                     [-np.sin(angle), 0, np.cos(angle)]])
    size = np.array([4, 4, 2])
    number = np.arange(1, np.prod(size + 1) + 1).reshape(size + 1)
    nodes, elements, top = [], [], []
    for i, j, k in np.ndindex(*(size + 1)):
        x = turn @ ([-1, -1, 0] + np.array([i, j, k]) * [0.5, 0.5, 0.5])
        nodes.append(f"{number[i, j, k]}, {x[0]:.16g}, {x[1]:.16g}, {x[2]:.16g}")
    for i, j, k in np.ndindex(*size):
        its = [number[i + a, j + b, k + c] for c in (0, 1)
               for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        elements.append(f"{len(elements) + 1}, " + ", ".join(str(node) for node in its))
        if k == size[2] - 1:
            top.append(f"{len(elements)}, S2")
    return BALL.format(degrees=degrees, tangent=tangent, law=RUBBER, nodes="\n".join(nodes),
                       elements="\n".join(elements), top="\n".join(top),
                       low="\n".join(str(node) for node in number[:, :, 0].ravel()))


RING = """\
*NODE
{nodes}
9000, 0., 5.3
*ELEMENT, TYPE={kind}, ELSET=RING
{elements}
*SURFACE, NAME=SKIN
RING, S2
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, MOONEY-RIVLIN
0.8, 0.2, 0.02
*SOLID SECTION, ELSET=RING, MATERIAL=RUBBER
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 1., 0.
*OBSTACLE, NAME=LID, TYPE=PLANE, REF NODE=9000
0., 5.3, 0., 0., -1., 0.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=DRY
SKIN, FLOOR
SKIN, LID
*BODY SOLVER, TANGENT=NEWTON
*STEP, NLGEOM
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
9000, 1, 3
9000, 2, 2, -0.4
*END STEP
"""


def ring(n, kind, turned):
    """Return the deck of a ring of n elements between a floor and a lid, turned by an angle."""
    middles = kind.endswith("8")
    nodes, elements = [], []
    for i in range(2 * n):
        for j in range(3):
            if (i % 2 or j == 1) and (not middles or (i % 2 and j == 1)):
                continue
            angle, radius = np.pi * i / n + turned, 2 + 0.325 * j
            nodes.append(f"{3 * i + j + 1}, {radius * np.cos(angle):.12g}, "
                         f"{2.65 + radius * np.sin(angle):.12g}")
    for e in range(n):
        at = [(0, 0), (0, 2), (2, 2), (2, 0), (0, 1), (1, 2), (2, 1), (1, 0)]
        its = [3 * ((2 * e + i) % (2 * n)) + j + 1 for i, j in at[: 8 if middles else 4]]
        elements.append(f"{e + 1}, " + ", ".join(str(node) for node in its))
    return RING.format(kind=kind, nodes="\n".join(nodes), elements="\n".join(elements))


SMOOTH_BLOCKS = """\
*BLOCK, NAME=LOW, ELSET=BOTH, TYPE=C3D8, NX=3, NY=1, NZ=1
0., 0., 0., 1., 1., 0.5782
*BLOCK, NAME=UP, ELSET=BOTH, TYPE=C3D8, NX=3, NY=2, NZ=1
0.2833, 0.3769, 0.5782,  0.9874, 0.9210, 1.0244
*MATERIAL, NAME=A
*HYPERELASTIC, NEO HOOKE
2.06, 0.728
*SOLID SECTION, ELSET=BOTH, MATERIAL=A
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
LOW-ZMAX, UP-ZMIN
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
LOW-ZMIN, 1, 3
*DSLOAD
UP-ZMAX, P, 0.37327
*END STEP
"""


class TogetherCase(unittest.TestCase):
    """Runs that are to end well."""

    def solved(self, text, name="deck", few=FEW, **parameters):
        """Return the resultants of all increments of a run that takes few iterations."""
        run = Run(text, name=name, **parameters)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertLessEqual(result.history("newton_raphson_iterations").max(), few)
            return result.pairs[0].resultant


class Obstacles(TogetherCase):
    """Obstacles that are flat or round, still or turning."""

    def test_axes_of_space_do_not_matter(self):
        """A ball that is turned by 45 degrees about y has the same forces, turned."""
        found = {}
        for degrees in (0, 45):
            kept = Run(ball(degrees, "KEPT"), name="kept")
            self.assertEqual(kept.status, 0, kept.errors)
            found[degrees] = self.solved(ball(degrees, "NEWTON"), "ball")
            with kept.result() as result:
                np.testing.assert_allclose(found[degrees], result.pairs[0].resultant, rtol=0,
                                           atol=1e-8 * abs(found[degrees]).max())
        x, y, z = found[0].T
        turned = np.stack([x + z, np.sqrt(2) * y, z - x], axis=1) / np.sqrt(2)
        np.testing.assert_allclose(found[45], turned, rtol=0, atol=1e-8 * abs(turned).max())

    def test_obstacles_that_turn(self):
        """A wheel that rubs, and a plane that tilts below what sticks to it and slides on it: the
        slip is that of material points of the obstacle, turned back by half of its turn."""
        still = "*BOUNDARY\nB-ZMAX, 1, 3, 0.\nHUB, 1, 3, 0.\n"
        for name, deck in (
            ("wheel", wheel() + HELD + step("*BOUNDARY\nHUB, 3, 3, -0.05") +
             step("*BOUNDARY\nHUB, 5, 5, 0.4", 0.25)),
            ("plane", floor(0.4) + step(still) + step("*BOUNDARY\nB-ZMAX, 3, 3, -0.3") +
             step("*BOUNDARY\nHUB, 4, 4, 0.2", 0.5)),
        ):
            with self.subTest(obstacle=name):
                deck = deck.replace("*STEP\n", "*BODY SOLVER, TANGENT=NEWTON\n*STEP, NLGEOM\n", 1)
                newton = self.solved(deck, name, few=20)
                kept = Run(deck.replace("TANGENT=NEWTON", "TANGENT=KEPT"), name="kept")
                self.assertEqual(kept.status, 0, kept.errors)
                with kept.result() as result:
                    np.testing.assert_allclose(newton, result.pairs[0].resultant, rtol=0,
                                               atol=1e-9 * abs(newton).max())

    def test_what_does_not_part(self):
        """A bar touches the floor, is pulled without friction, slides along, and is pressed."""
        deck = "*BODY SOLVER, TANGENT=NEWTON\n" + BAR
        deck += step("*BOUNDARY\nB-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.02")
        for way in ("3, 3, 0.01", "1, 1, 0.01", "3, 3, -0.03"):
            deck += step(f"*BOUNDARY\nB-ZMAX, {way}", 0.5)
        newton = self.solved(deck.replace("*STEP\n", "*STEP, NLGEOM\n", 1))
        kept = Run(deck.replace("TANGENT=NEWTON", "TANGENT=KEPT").replace(
            "*STEP\n", "*STEP, NLGEOM\n", 1), name="kept")
        self.assertEqual(kept.status, 0, kept.errors)
        with kept.result() as result:
            np.testing.assert_allclose(newton, result.pairs[0].resultant, rtol=0,
                                       atol=1e-7 * abs(newton).max())
        self.assertLess(newton[:, 2].min(), -10)

    def test_points_in_the_middles_of_edges(self):
        """Boxes of second order on a ball, a roll and in a bowl, dragged: not in more iterations
        than the kept factor takes; ends of edges join their middles on the way."""
        for obstacle, kind in (("ball", "C3D10"), ("roll", "C3D20R"), ("bowl", "C3D10")):
            with self.subTest(obstacle=obstacle, kind=kind):
                forces, iterations = [], []
                for tangent in ("KEPT", "NEWTON"):
                    _, deck = pressed(kind, obstacle, 0.3)
                    deck = deck.replace("*STEP", f"*BODY SOLVER, TANGENT={tangent}\n*STEP", 1)
                    run = Run(deck, name="box")
                    self.assertEqual(run.status, 0, run.errors)
                    with run.result() as result:
                        forces.append(result.pairs[0].force)
                        iterations.append(result.history("newton_raphson_iterations").sum())
                self.assertLessEqual(iterations[1], iterations[0])
                np.testing.assert_allclose(*forces, rtol=0, atol=1e-8 * abs(forces[0]).max())


class Loads(TogetherCase):
    """Loads that follow bodies: the whole of their stiffness is in the matrix."""

    def test_pressures_with_free_edges(self):
        """A cantilever bent far, by an independent program (as of test_finite_loads): half of what
        a pressure changes by at the edges of its surface is not symmetric."""
        text = BEAM.replace("*STEP", "*BODY SOLVER, TANGENT=NEWTON\n*STEP").format(
            load=f"*DSLOAD\nB-ZMAX, P, {4.8 / 12!r}\n", ends=ENDS, inner=INNER)
        run = Run(text, name="beam")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertLessEqual(result.history("newton_raphson_iterations").max(), FEW)
            u = result.field("displacement", -1)
            tip = u[np.isclose(result.points[:, 0], 10)].mean(axis=0)
        np.testing.assert_allclose(tip, FOLLOWING, rtol=0, atol=1e-4)


class FreeBodies(TogetherCase):
    """Bodies that nothing holds but contact."""

    def test_free_flight_onto_a_plane(self):
        """A cube that touches a plane presses as its load does. One above the plane falls on it, to
        where it comes with the kept factor: loads that do work as nothing resists are a jump, of
        the same energy."""
        law = "*ELASTIC\n5000., 0.3"
        force = self.solved(CUBE.format(kind="C3D8", gap=0.0, law=law))
        np.testing.assert_allclose(force[-1], [0, 0, 1], atol=1e-3)
        for gap in (0.01, 0.1):
            with self.subTest(gap=gap):
                newton = CUBE.format(kind="C3D8", gap=gap, law=law)
                kept = newton.replace("TANGENT=NEWTON", "TANGENT=KEPT")
                errors = [Run(text, name="deck").errors for text in (newton, kept)]
                self.assertIn("the solution jumps", errors[0])
                self.assertEqual(*errors)

    def test_nothing_balances_them(self):
        """A body that is pulled off, one that slides, and one in the air are named with the motion
        that nothing resists, in the words that the kept factor has, after one attempt."""
        touching = CUBE.format(kind="C3D8", gap=0.0, law="*ELASTIC\n5000., 0.3")
        for name, newton in (
            ("pulled off", touching.replace("P, 1.", "P, -1.")),
            ("sliding", touching.replace("P, 1.\n", "P, 1.\nCUBE-XMIN, P, 0.4\n")),
            ("falling", (INPUT / "fall.inp").read_text().replace(
                "*STEP\n", "*BODY SOLVER, TANGENT=NEWTON\n*STEP, NLGEOM\n")),
        ):
            with self.subTest(body=name):
                kept = newton.replace("TANGENT=NEWTON", "TANGENT=KEPT")
                runs = [Run(text, name="deck") for text in (newton, kept)]
                self.assertEqual([run.status for run in runs], [2, 2])
                self.assertIn("nothing balances the loads along body 1", runs[0].errors)
                self.assertEqual(*(run.errors for run in runs))

    def test_which_bodies_are_solved_so(self):
        """Where the deck does not say, free ones are, held ones are not."""
        free = CUBE.format(kind="C3D8", gap=0.0, law="*ELASTIC\n5000., 0.3").replace(
            "*BODY SOLVER, TANGENT=NEWTON\n", "")
        runs = Run(free, name="free"), Run(INPUT / "rubber.inp", n=2, steps=2, press=1, push=1)
        for run, tangent in zip(runs, ("newton", "kept"), strict=True):
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                self.assertEqual(result.run["tangent"], tangent)

    def test_a_block_slides_off_another(self):
        """A smooth block stands off the middle of a soft one, which tilts below it: it is named."""
        run = Run(SMOOTH_BLOCKS, name="deck")
        self.assertEqual(run.status, 2, run.errors)
        self.assertIn("nothing balances the loads along body 2", run.errors)

    def test_a_ball_that_touches_nothing_yet(self):
        """A force presses a ball into a block; the nearest node is not below it, so that no point
        touches where the run begins. What holds the ball back there does not say how far it goes:
        it comes to rest on the block, not beyond it."""
        deck = ball(0, "NEWTON").replace("*STEP, NLGEOM", "*STEP, NLGEOM\n*STATIC\n1., 1.", 1)
        deck = deck[: deck.index("*END STEP") + 10].replace("*STATIC, DIRECT\n1., 3.\n", "")
        deck = deck.replace("90000, 3, 3, <-0.2*cos(a)>\n", "*CLOAD\n90000, 3, -0.02\n")
        deck = deck.replace("90000, 1, 1, <-0.2*sin(a)>", "90000, 1, 1")
        deck = deck.replace("<2*sin(a)>, 0., <2*cos(a)>", "0.2, 0.2, <2>")
        newton = self.solved(deck, "newton", few=10)
        kept = Run(deck.replace("tangent = NEWTON", "tangent = KEPT"), name="kept")
        self.assertEqual(kept.status, 0, kept.errors)
        with kept.result() as result:
            np.testing.assert_allclose(newton[-1], result.pairs[0].resultant[-1], rtol=0, atol=1e-9)
        np.testing.assert_allclose(newton[-1, 2], -0.02, rtol=0, atol=1e-9)

    def test_a_beam_on_rollers(self):
        """Little friction holds a loose beam that is bent over two rollers by a third: what slides
        must not go to and fro."""
        text = (INPUT / "bend.inp").read_text().replace(
            "*STEP\n", "*BODY SOLVER, TANGENT=NEWTON\n*STEP, NLGEOM\n")
        run = Run(text, name="bend", n=1)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertLessEqual(result.history("newton_raphson_iterations").max(), 20)
            for roller, force in (("LEFT", 0.00025), ("RIGHT", 0.00075)):
                found = result.pairs[f"BEAM-ZMIN:{roller}"].resultant[-1, 2]
                np.testing.assert_allclose(found, force, rtol=0.01)

    def test_rings_between_plates(self):
        """Little friction at a few points holds rings of rubber, which bend easily: what
        holds them back until contact does must not resist that. The lid presses as the floor."""
        for n, kind, turned in ((12, "CPS8", 0.37), (20, "CPS8", 0.0), (24, "CPS4", 0.1),
                                (12, "CPE8", 0.1)):
            with self.subTest(n=n, kind=kind):
                run = Run(ring(n, kind, turned), name="ring")
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    self.assertLessEqual(result.history("newton_raphson_iterations").max(), 25)
                    floor, lid = (pair.resultant[-1] for pair in result.pairs.values())
                    self.assertGreater(floor[1], 0.003)
                    np.testing.assert_allclose(lid, -floor, rtol=0, atol=1e-8 * floor[1])

    def test_a_pendulum(self):
        """A bar in a pipe without friction: that it swings is resisted by its weight alone, by what
        normals turn with it."""
        text = (INPUT / "pipe.inp").read_text().replace(
            "*STEP\n", "*BODY SOLVER, TANGENT=NEWTON\n*STEP, NLGEOM\n")
        force = self.solved(text, name="pipe")
        np.testing.assert_allclose(force[-1], [0, 0, 12], atol=1e-6)

    def test_a_body_hangs(self):
        """Of a plane that it touches, by points that stay closed and pull."""
        text = CUBE.format(kind="C3D8", gap=0.0, law="*ELASTIC\n5000., 0.3")
        text = text.replace("*FRICTION", "*SURFACE BEHAVIOR, NO SEPARATION\n*FRICTION")
        force = self.solved(text.replace("P, 1.", "P, -1."))
        np.testing.assert_allclose(force[-1], [0, 0, -1], atol=1e-3)

    def test_a_weak_body_beside_a_strong_one(self):
        """Each is balanced by its own forces: pressed on by a millionth of the load, of a millionth
        of the stiffness, a body ends as the strong one does."""
        strong = CUBE.format(kind="C3D8", gap=0.0, law="*ELASTIC\n20., 0.3")
        body = strong[: strong.index("*OBSTACLE")]
        pair = "*CONTACT PAIR, INTERACTION=DRY\nCUBE-ZMIN, GROUND\n"
        load = "CUBE-ZMAX, P, 1.\n"
        weak = [text.replace("CUBE", "WEAK").replace("NAME=M", "NAME=W").replace("MATERIAL=M",
                "MATERIAL=W").replace("0., 0., 0.0,", "3., 0., 0.,").replace("20., 0.3",
                "2e-5, 0.3").replace("P, 1.", "P, 1e-6") for text in (body, pair, load)]
        text = strong.replace(body, body + weak[0]).replace(pair, pair + weak[1])
        run = Run(text.replace(load, load + weak[2]), name="two")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            forces = [result.pairs[i].force[-1] for i in range(2)]
            np.testing.assert_allclose(1e6 * forces[1], forces[0], rtol=0,
                                       atol=1e-7 * abs(forces[0]).max())

    def test_as_with_the_kept_factor(self):
        """Three blocks on each other."""
        text = (INPUT / "stack.inp").read_text().replace("*STEP", "*STEP, NLGEOM", 1)
        found = {}
        for tangent in ("KEPT", "NEWTON"):
            run = Run(text.replace("*STEP", f"*BODY SOLVER, TANGENT={tangent}\n*STEP", 1),
                      name="stack")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found[tangent] = [result.pairs[i].resultant for i in range(2)]
                if tangent == "NEWTON":
                    self.assertLessEqual(result.history("newton_raphson_iterations").max(), FEW)
        for kept, newton in zip(found["KEPT"], found["NEWTON"], strict=True):
            np.testing.assert_allclose(newton, kept, rtol=0, atol=1e-6 * abs(kept).max())


class Steps(TogetherCase):
    """By the factor that is there, by GMRES, by a factor of each iteration."""

    def test_whichever_step(self):
        """The paper's block in rubber has the same forces with the kept tangent, with factors that
        serve as long as they lead, in double and in single precision, compressed, and with one in
        each iteration. Those that serve are few: none more than one an increment."""
        text = (INPUT / "block.inp").read_text().replace("*STEP\n", "*STEP, NLGEOM\n")
        text = text.replace("*ELASTIC\n210000., <nu>", RUBBER)
        text = text.replace("*CONTACT SOLVER", "<card>\n*BODY SOLVER, TANGENT=<tangent>\n"
                            "*CONTACT SOLVER", 1)
        text = text.replace("*PARAMETER\n", "*PARAMETER\ntangent = NEWTON\n", 1)
        found, tangents, iterations = {}, {}, {}
        for name, tangent, card in (
            ("kept", "KEPT", "FACTOR=DOUBLE"),
            ("serves", "NEWTON", "FACTOR=DOUBLE"),
            ("single", "NEWTON", "FACTOR=SINGLE"),
            ("compressed", "NEWTON", "FACTOR=DOUBLE, BLOCK LOW RANK=1e-4"),
            ("each", "NEWTON", "FACTOR=DOUBLE"),
        ):
            deck = text.replace("<card>", f"*PRECISION, {card}")
            if name == "each":
                deck = deck.replace("STOP=<stop>", "STOP=<stop>, COMPLIANCE=PRODUCTS")
            run = Run(deck, name=name, tangent=tangent, solver="AUTO", local="AUTO", n=3, steps=10)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found[name] = result.pairs[0].resultant
                tangents[name] = result.history("tangents")
                iterations[name] = result.history("newton_raphson_iterations")
        for name, force in found.items():
            with self.subTest(name):
                np.testing.assert_allclose(force, found["kept"], rtol=0,
                                           atol=1e-8 * abs(force).max())
        self.assertLessEqual(iterations["serves"].max(), 14)
        self.assertLessEqual(tangents["serves"].max(), 1)
        np.testing.assert_array_equal(tangents["each"], iterations["each"])

    def test_the_factor_turns_with_the_body(self):
        """A bar of rubber is turned all the way round on a plate, 30 degrees an increment. Once
        all of it slides each increment is the one before, turned: few iterations, one factor."""
        text = (INPUT / "grip.inp").read_text().replace(
            "*STEP", "*BODY SOLVER, TANGENT=<tangent>\n*STEP", 1).replace(
            "*PARAMETER\n", "*PARAMETER\ntangent = KEPT\n", 1)
        moments = {}
        for tangent in ("KEPT", "NEWTON"):
            run = Run(text, name="grip", tangent=tangent, n=2, tolerance=1e-10)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                moments[tangent] = result.pairs[0].moment[-1]
                if tangent == "NEWTON":
                    self.assertLessEqual(
                        result.history("newton_raphson_iterations")[-8:].max(), 6)
                    self.assertLessEqual(result.history("tangents").sum(), 1)
        np.testing.assert_allclose(moments["NEWTON"], moments["KEPT"], rtol=0,
                                   atol=1e-8 * abs(moments["KEPT"]).max())


class Surfaces(TogetherCase):
    """Faces of one body before those of another one."""

    def test_ironing(self):
        """Points slide over several elements; the forces are those of the kept factor."""
        text = (INPUT / "ironing.inp").read_text()
        text = text.replace("*STEP", "*BODY SOLVER, TANGENT=<tangent>\n*STEP", 1).replace(
            "*PARAMETER\n", "*PARAMETER\ntangent = KEPT\n", 1)
        short = {"n": 2, "draw": 0.3, "tolerance": 1e-10}
        newton = self.solved(text, "ironing", tangent="NEWTON", **short)
        kept = Run(text, name="ironing", tangent="KEPT", **short)
        self.assertEqual(kept.status, 0, kept.errors)
        with kept.result() as result:
            np.testing.assert_allclose(newton, result.pairs[0].resultant, rtol=0,
                                       atol=1e-8 * abs(newton).max())


if __name__ == "__main__":
    unittest.main()
