"""*DISTRIBUTING couplings at finite strain, whose surfaces turn, under forces and moments."""

import unittest

import numpy as np
from program import Run
from scipy.spatial.transform import Rotation
from test_turning_couplings import REFERENCE, SIDE, bar, loads, reference, solved

FORCE, MOMENT = np.array([0.02, -0.01, 0.03]), np.array([0.02, 0.03, 0.04])
LARGE = loads([0.03, 0.02, -0.05], [0.04, 0.08, 0.06])  # turns the face by 111 degrees
FACE = range(36, 45)
TURN = Rotation.from_rotvec([0.4, -0.7, 0.3])


def rbe3(cards, tangent="KEPT", increments=4, **options):
    """Return the bar of rubber with a *DISTRIBUTING on its upper face."""
    return bar(cards, tangent, increments=increments, **options).replace(
        "*KINEMATIC", "*DISTRIBUTING")


def weights():
    """Return shares and first moments of the nodes of the undeformed face, 2 x 2 squares."""
    line = np.array([0.25, 0.5, 0.25])
    share = np.outer(line, line).ravel()
    # int N x over the side: -1/4 + 1/24 at the ends, 0 in the middle, less the length there.
    along = np.array([-0.25 / 2 + 0.5**2 / 6, 0.0, 0.25 / 2 - 0.5**2 / 6])
    moment = np.zeros((9, 3))
    moment[:, 0] = np.outer(line, along).ravel()
    moment[:, 1] = np.outer(along, line).ravel()
    return share, moment


def best_turn(moment, places):
    """Return the R for which the sum of R m . x is the largest, by singular values."""
    left, _, right = np.linalg.svd(moment.T @ places)
    sign = np.sign(np.linalg.det(left @ right))
    return right.T @ np.diag([1.0, 1.0, sign]) @ left.T


class Bent(unittest.TestCase):
    """The bar under a force beside the middle of its face, and a moment: turned by 48 degrees."""

    @classmethod
    def setUpClass(cls):
        run = Run(rbe3(loads(FORCE, MOMENT)), name="case")
        assert run.status == 0, run.errors
        cls.result = run.result()
        cls.addClassCleanup(cls.result.close)
        cls.u = cls.result.field("displacement", -1)
        cls.places = cls.result.points + cls.u
        cls.end = reference(cls.result)
        cls.share, cls.moment = weights()
        face = cls.places[FACE]
        cls.face = face - cls.share @ face
        cls.turn = best_turn(cls.moment, cls.face)

    def test_mean_and_rotation_are_those_of_the_face(self):
        middle = np.array([0.0, 0.0, SIDE])
        place = self.share @ self.places[FACE] + self.turn @ (REFERENCE - middle)
        np.testing.assert_allclose(REFERENCE + self.end["displacement"], place, atol=1e-12)
        turned = Rotation.from_rotvec(self.end["rotation"]).as_matrix()
        np.testing.assert_allclose(turned, self.turn, atol=1e-12)
        self.assertGreater(np.linalg.norm(self.end["rotation"]), 0.8)

    def test_supports_hold_force_and_moment_where_the_node_is(self):
        reaction = self.result.field("reaction_force", -1)
        np.testing.assert_allclose(reaction.sum(axis=0), -FORCE, atol=1e-9)
        arms = self.places - (REFERENCE + self.end["displacement"])
        np.testing.assert_allclose(np.cross(arms, reaction).sum(axis=0), -MOMENT, atol=1e-9)

    def test_forces_on_nodes_in_their_place_hold_the_same_body(self):
        """F w + p x R m, I p = M + R (X_ref - X_m) x F: as dead loads."""
        turned = self.moment @ self.turn.T
        inertia = np.sum(turned * self.face) * np.eye(3) - turned.T @ self.face
        arm = self.turn @ (REFERENCE - [0.0, 0.0, SIDE])
        p = np.linalg.solve(inertia, MOMENT + np.cross(arm, FORCE))
        force = np.outer(self.share, FORCE) + np.cross(p, turned)
        cards = "*CLOAD\n" + "".join(
            f"{37 + i}, {k + 1}, {float(force[i, k])!r}\n" for i in range(9) for k in range(3))
        text = bar(cards, "NEWTON", increments=2)
        start, end = text.index("*COUPLING"), text.index("*BODY SOLVER")
        u = solved(self, text[:start] + text[end:]).field("displacement", -1)
        np.testing.assert_allclose(u, self.u[:45], atol=5e-8)

    def test_newton_s_tangent_finds_the_same(self):
        found = [solved(self, rbe3(LARGE, tangent)) for tangent in ("KEPT", "NEWTON")]
        u = [result.field("displacement", -1) for result in found]
        np.testing.assert_allclose(u[1], u[0], atol=1e-7)
        self.assertGreater(np.linalg.norm(reference(found[0])["rotation"]), 1.9)

    def test_a_scene_that_is_turned_has_a_solution_that_is(self):
        cards = loads(TURN.apply(FORCE), TURN.apply(MOMENT))
        u = solved(self, rbe3(cards, turn=TURN)).field("displacement", -1)
        np.testing.assert_allclose(u, TURN.apply(self.u), atol=1e-7)


class RigidTurn(unittest.TestCase):
    def test_a_body_that_a_grip_turns_has_no_forces(self):
        """One and a half turns about an axis: the mean goes along, its rotation vector too."""
        axis = np.array([0.6, 0.0, 0.8])
        vector = 3.0 * np.pi * axis
        more = "*NODE\n901, 0., 0., 0.\n*SURFACE, NAME=BASE, TYPE=NODE\nLOW\n" \
            "*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=901, SURFACE=BASE\n*KINEMATIC\n"
        cards = "901, 1, 3\n" + "".join(
            f"901, {4 + k}, {4 + k}, {float(vector[k])!r}\n" for k in range(3))
        text = rbe3(cards, increments=4).replace("LOW, 1, 3\n", "")
        at = text.index("*COUPLING")
        result = solved(self, text[:at] + more + text[at:])
        end = reference(result)
        place = Rotation.from_rotvec(vector).apply(REFERENCE)
        np.testing.assert_allclose(end["displacement"], place - REFERENCE, atol=1e-10)
        np.testing.assert_allclose(end["rotation"], vector, atol=1e-10)
        self.assertLess(abs(result.field("reaction_force", -1)).max(), 1e-10)


class Lever(unittest.TestCase):
    def test_a_force_on_a_lever_above_a_column_makes_it_buckle(self):
        """k L tan(k L) = L/b, b the lever: P = 0.74 EI/L^2 at b = L, Euler's is 2.47 EI/L^2."""
        stiffness = 2.4 / 12.0 / SIDE**2
        for force, status in ((0.5, 0), (1.6, 2)):
            cards = f"*CLOAD\n900, 3, {-force * stiffness!r}\n"
            text = rbe3(cards, increments=1).replace(
                "900, 0.2, 0.1, 3.5", f"900, 0., 0., {2 * SIDE}")
            run = Run(text, name="case")
            self.assertEqual(run.status, status, run.errors)
        self.assertIn("the equilibrium is unstable (2 motions", run.errors)


if __name__ == "__main__":
    unittest.main()
