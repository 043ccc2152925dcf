"""Turns of any size in one increment at finite strain: grips, and the factor turned with bodies."""

import unittest

import numpy as np
from finite_laws import NEO
from program import INPUT, Run
from test_finite_bodies import Turns, rotation, turned_block, turned_stack

MU = 0.3


def turn(vector):
    """Return the matrix of a rotation vector, by the eigenvectors of its cross product."""
    cross = np.array([[0, -vector[2], vector[1]], [vector[2], 0, -vector[0]],
                      [-vector[1], vector[0], 0]])
    values, vectors = np.linalg.eig(cross)
    return (vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors)).real


REF = np.array([0.3, 0.4, 2.0])
PAIR = "*CONTACT PAIR, INTERACTION=I\nB-ZMIN, PLATE\n*SURFACE INTERACTION, NAME=I\n"
RUBBING = f"{PAIR}*FRICTION\n{MU}\n"


def bar(ways, top=None, pair=RUBBING, element="C3D8"):
    """Run a bar on a plate whose upper end is moved and turned, an increment a step.

    The end goes with a reference node at REF, or node by node: these by number.
    """
    cards = f"*BLOCK, NAME=B, NX=2, NY=2, NZ=3, TYPE={element}, ELSET=ALL\n"
    cards += "0., 0., 0., 1., 1., 1.5\n"
    cards += f"*MATERIAL, NAME=M\n{NEO}\n*SOLID SECTION, ELSET=ALL, MATERIAL=M\n"
    cards += f"*OBSTACLE, NAME=PLATE, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n{pair}"
    cards += "*CONTACT SOLVER, TOLERANCE=1e-11\n"
    if top is None:
        cards += "*NODE\n900, " + ", ".join(map(str, REF.tolist())) + "\n"
        cards += "*COUPLING, CONSTRAINT NAME=C, REF NODE=900, SURFACE=B-ZMAX\n*KINEMATIC\n"
    for k, (way, vector) in enumerate(ways):
        cards += f"*STEP{', NLGEOM' if k == 0 else ''}\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\n"
        if top is None:
            goes = {900: [*way, *vector]}
        else:
            matrix = turn(np.array(vector))
            goes = {node: REF + way + matrix @ (x - REF) - x for node, x in top.items()}
        for node, values in goes.items():
            for i, value in enumerate(values):
                cards += f"{node}, {i + 1}, {i + 1}, {float(value)!r}\n"
        cards += "*END STEP\n"
    return Run(cards, name="bar")


WAYS = [
    ((0.0, 0.0, -0.1), (0.0, 0.0, 0.0)),
    ((0.05, 0.02, -0.12), (0.02, -0.03, 0.4)),
    ((0.05, 0.02, -0.12), (0.01, 0.02, 1.1)),
    ((0.0, 0.0, -0.1), (0.0, 0.0, 3.5)),
]


class Grips(unittest.TestCase):
    """A grip does what supports do that prescribe each of its nodes."""

    def test_as_node_by_node(self):
        for element in ("C3D8", "C3D8I"):
            with self.subTest(element=element):
                one = bar(WAYS, element=element)
                self.assertEqual(one.status, 0, one.errors)
                with one.result() as a:
                    held = a.points[:, 2] > 1.499
                    top = dict(zip(a.node_ids[held], a.points[held], strict=True))
                    other = bar(WAYS, top, element=element)
                    self.assertEqual(other.status, 0, other.errors)
                    with other.result() as b:
                        self.compare(a, b, held)

    def compare(self, a, b, held):
        """Hold results of a grip against those of nodes that are held."""
        grip = a.reference_nodes[900]
        for t, (way, _) in enumerate(WAYS):
            u = b.field("displacement", t)
            np.testing.assert_allclose(a.field("displacement", t), u, atol=2e-9)
            force = b.field("reaction_force", t)[held]
            size = np.abs(force).sum()
            np.testing.assert_allclose(grip.reaction_force[t], force.sum(0), atol=1e-7 * size)
            arms = (b.points + u)[held] - REF - way
            np.testing.assert_allclose(
                grip.reaction_moment[t], np.cross(arms, force).sum(0), atol=1e-7 * size
            )
        for name in ("energy/strain", "energy/external_work"):
            np.testing.assert_allclose(a.history(name), b.history(name), rtol=1e-7)

    def test_a_bar_that_goes_all_the_way_round(self):
        """Its energy and its places are those before."""
        ways = [((0, 0, -0.1), (0, 0, np.radians(angle))) for angle in (0, 120, 240, 360)]
        run = bar(ways, pair=PAIR)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            energy = result.history("energy/strain")
            np.testing.assert_allclose(energy, energy[0], rtol=1e-8)
            first, last = result.field("displacement", 0), result.field("displacement", -1)
            np.testing.assert_allclose(last, first, atol=1e-8)

    def test_the_deck(self):
        """All of the lower face slides round: friction turns the bar back by its limit."""
        run = Run(INPUT / "grip.inp")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            pair, grip = result.pairs[0], result.reference_nodes[9000]
            moment = grip.reaction_moment[-1]
            np.testing.assert_allclose(moment[2], pair.torque[-1][2], rtol=1e-6)
            self.assertAlmostEqual(grip.rotation[-1][2], 2 * np.pi)
            force = np.linalg.norm(pair.resultant[-1])
            # The mean distance from the middle of a square; pressure is larger at its edges.
            self.assertAlmostEqual(moment[2] / (MU * force), 0.3826, delta=0.05)


class LargeTurns(Turns):
    """Both bodies turn by 30 to 180 degrees an increment, with one factor."""

    def test_what_sticks(self):
        for degrees in (30, 90):
            with self.subTest(degrees=degrees):
                run = turned_stack(2.0, 0.02, degrees)
                self.check(run, degrees)
                with run.result() as result:
                    self.assertEqual(sum(result.history("tangents")), 0)

    def test_what_has_slid(self):
        for tangent in ("KEPT", "NEWTON"):
            with self.subTest(tangent=tangent):
                self.check(turned_stack(0.3, 0.15, 90, tangent=tangent), 90)

    def test_obstacles_that_turn(self):
        for floor in ("plane", "facets"):
            with self.subTest(floor=floor):
                self.check(turned_block(floor, degrees=45), 45)

    def test_half_a_turn(self):
        run = turned_stack(2.0, 0.02, 180, 180)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            forces = result.pairs[0].resultant
            np.testing.assert_allclose(
                rotation(180).T @ forces[-1], forces[-2], atol=1e-10 * np.abs(forces[-2]).max()
            )


BEAM = f"""\
*BLOCK, NAME=B, NX=20, NY=1, NZ=1, TYPE=C3D8I, ELSET=ALL
0., 0., 0., 10., 1., 0.5
*MATERIAL, NAME=M
{NEO}
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*NODE
9000, 8.5, 0.5, 1.5
*OBSTACLE, NAME=PIN, TYPE=CYLINDER, REF NODE=9000
8.5, 0., 1.5, 0., 1., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
B-ZMAX, PIN
*CONTACT SOLVER, TOLERANCE=1e-10
*PARAMETER
tangent = KEPT
way = 1.
steps = 2
*BODY SOLVER, TANGENT=<tangent>
*STEP, NLGEOM
*STATIC, DIRECT
<1/steps>, 1.
*BOUNDARY
B-XMIN, 1, 3
9000, 1, 2
9000, 3, 3, <-way>
*END STEP
"""


class Slender(unittest.TestCase):
    """A beam that an increment bends by many times its height over its length."""

    def test_as_with_the_tangent_of_each_iteration(self):
        for way, steps in ((1.0, 2), (3.0, 4)):
            with self.subTest(way=way):
                runs = [
                    Run(BEAM, name="beam", way=way, steps=steps, tangent=tangent)
                    for tangent in ("KEPT", "NEWTON")
                ]
                self.assertEqual([run.status for run in runs], [0, 0], runs[0].errors)
                with runs[0].result() as one, runs[1].result() as other:
                    forces = [result.pairs[0].resultant for result in (one, other)]
                    size = np.abs(forces[1]).max()
                    np.testing.assert_allclose(forces[0], forces[1], atol=1e-7 * size)
                    self.assertEqual(len(forces[0]), steps)

    def test_in_one_increment(self):
        """Where full Newton iterations lead nowhere."""
        run = Run(BEAM, name="beam", way=3.0, steps=2)
        self.assertEqual(run.status, 0, run.errors)


del Turns

if __name__ == "__main__":
    unittest.main()
