"""Friction with a largest stress, or coefficients over the pressure: closed forms, all methods."""

import unittest

import numpy as np
from program import Run
from two_bodies import solved

YOUNG = 1000.0
SIDE = 1.0  # of the bar's section
N = 12  # elements along it
STEP = 0.5  # of each
TOP = 100  # what the nodes above the floor have more
# The paper's methods, sweeps with the exact solution of a point, and what the program chooses.
METHODS = [
    "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=UZAWA",
    "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=NEWTON",
    "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=UZAWA",
    "SOLVER=SWEEPS, FORMULATION=PSEUDOPOTENTIAL, LOCAL=NEWTON",
    "SOLVER=SWEEPS, FORMULATION=BIPOTENTIAL, LOCAL=NEWTON6",
    "SOLVER=SWEEPS, LOCAL=EXACT",
    "SOLVER=GLOBAL NEWTON",
    "SOLVER=AUTO",
]


def bar(friction, pressure, force, method="SOLVER=AUTO", more="", step="*STEP"):
    """Return the deck of a bar along x on a floor, pulled at its end.

    Each node of its bottom is pressed down by `pressure` times the node's area; the nodes above
    move along x with them and stay level, so that each presses with just that.
    """
    x = STEP * np.arange(N + 1)
    places, number = [], {}
    for k in range(2):
        for j in range(2):
            for i in range(N + 1):
                number[i, j, k] = 1 + i + j * (N + 1) + k * TOP
                places.append(f"{number[i, j, k]}, {x[i]!r}, {j * SIDE!r}, {k * SIDE!r}")
    elements = [
        f"{i + 1}, " + ", ".join(str(number[i + a, b, c]) for c in (0, 1)
                                 for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)))
        for i in range(N)
    ]
    area = areas()
    bottom = [number[i, j, 0] for j in range(2) for i in range(N + 1)]
    top = [n + TOP for n in bottom]
    loads = [
        f"{number[i, j, 0]}, 3, {-pressure[i] * area[i]!r}" for j in range(2) for i in range(N + 1)
    ]
    pulled = [f"{number[N, j, 0]}, 1, {force / 2!r}" for j in range(2)]
    equations = [f"2\n{n + TOP}, 1, 1., {n}, 1, -1." for n in bottom]
    return "\n".join([
        "*HEADING\nA bar on a floor\n*NODE\n" + "\n".join(places),
        "*ELEMENT, TYPE=C3D8, ELSET=BAR\n" + "\n".join(elements),
        "*SURFACE, NAME=UNDER\n" + "\n".join(f"{i + 1}, S1" for i in range(N)),
        "*NSET, NSET=ABOVE\n" + ",\n".join(map(str, top)),
        "*NSET, NSET=ALL\nABOVE,\n" + ",\n".join(map(str, bottom)),
        f"*MATERIAL, NAME=M\n*ELASTIC\n{YOUNG!r}, 0.\n*SOLID SECTION, ELSET=BAR, MATERIAL=M",
        "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.",
        f"*SURFACE INTERACTION, NAME=F\n{friction}",
        "*CONTACT PAIR, INTERACTION=F\nUNDER, FLOOR",
        "*EQUATION\n" + "\n".join(equations),
        f"*CONTACT SOLVER, {method}, TOLERANCE=1e-13",
        "*AMPLITUDE, NAME=AT-ONCE\n0., 1., 1., 1.",
        f"*BOUNDARY\nALL, 2\nABOVE, 3\n{number[0, 0, 0]}, 1\n{number[0, 1, 0]}, 1",
        f"{step}\n*STATIC, DIRECT\n0.25, 1.\n*CLOAD, AMPLITUDE=AT-ONCE\n" + "\n".join(loads)
        + "\n*CLOAD\n" + "\n".join(pulled) + f"\n{more}*END STEP\n",
    ])


def areas():
    """Return the area that each place along the bar has, at one of its two bottom nodes."""
    area = np.full(N + 1, STEP * SIDE / 2)
    area[[0, -1]] /= 2
    return area


def slipped(largest, force):
    """Return friction of each place (both its nodes) and displacement, of a bar pulled at its end.

    From that end on places slip with their largest friction until these have taken the force.
    """
    friction = np.zeros(N + 1)
    left = force
    for i in range(N, -1, -1):
        friction[i] = min(left, largest[i])
        left -= friction[i]
    assert abs(left) < 1e-12 * force
    u = np.zeros(N + 1)
    inside = np.cumsum(friction)[:-1]  # the bar's force in each element
    u[1:] = np.cumsum(inside) * STEP / (YOUNG * SIDE**2)
    return friction, u - u[friction > 0][0]


def pairs_of(result):
    """Return the reaction of both nodes of each place together, and their mean slip."""
    pair = result.pairs["UNDER:FLOOR"]
    r = pair.reaction[-1]
    slip = pair.slip[-1]
    order = np.argsort(pair.coordinates[:, 0], kind="stable").reshape(N + 1, 2)
    return r[order].sum(axis=1), slip[order].mean(axis=1)


class CutCone(unittest.TestCase):
    """Friction of at most a stress, TAUMAX, where the pressure is larger than at its cut."""

    PRESSURE = np.linspace(2.0, 14.0, N + 1)
    FORCE = 8.0
    MU, MOST = 0.25, 2.0

    def test_the_plateau_of_partial_slip(self):
        """From the pulled end on friction is the stress, then mu p, then what is left."""
        largest = 2 * areas() * np.minimum(self.MU * self.PRESSURE, self.MOST)
        friction, u = slipped(largest, self.FORCE)
        self.assertGreater(np.sum(self.MU * self.PRESSURE[friction > 0] > self.MOST), 3)
        self.assertGreater(np.sum(self.MU * self.PRESSURE[friction > 0] < self.MOST), 1)
        card = f"*FRICTION, TAUMAX={self.MOST}\n{self.MU}"
        for method in METHODS:
            with self.subTest(method=method):
                result = solved(self, bar(card, self.PRESSURE, self.FORCE, method))
                r, slip = pairs_of(result)
                np.testing.assert_allclose(r[:, 0], 2 * areas() * self.PRESSURE, rtol=1e-9)
                np.testing.assert_allclose(-r[:, 1], friction, atol=1e-9 * self.FORCE)
                np.testing.assert_allclose(slip[:, 0], u, atol=1e-9 * u[-1])

    def test_nodes_without_faces_have_no_pressure(self):
        """Both are refused by the name of the pair."""
        for card in ("*FRICTION, TAUMAX=2.\n0.3", "*FRICTION\n0.3, , 0.\n0.2, , 5."):
            deck = bar(card, self.PRESSURE, 1.0).replace(
                "*SURFACE, NAME=UNDER\n",
                "*SURFACE, NAME=UNDER, TYPE=NODE\n1,\n2,\n3,\n*SURFACE, NAME=X\n",
            )
            run = Run(deck, name="deck")
            self.assertEqual(run.status, 1, run.output)
            self.assertIn("slaves of the contact pair 'UNDER:FLOOR' have no area", run.errors)


class Table(unittest.TestCase):
    """Coefficients over the pressure."""

    PRESSURE = np.linspace(1.0, 13.0, N + 1)
    CARD = "*FRICTION\n0.1, , 2.\n0.4, , 8.\n0.2, , 12."

    def test_partial_slip(self):
        """Each place has the coefficient of its own pressure, straight between two lines."""
        mu = np.interp(self.PRESSURE, [2, 8, 12], [0.1, 0.4, 0.2])
        largest = 2 * areas() * mu * self.PRESSURE
        friction, u = slipped(largest, 10.0)
        self.assertGreater(np.sum(friction > 0), 6)
        for method in METHODS:
            with self.subTest(method=method):
                result = solved(self, bar(self.CARD, self.PRESSURE, 10.0, method))
                r, slip = pairs_of(result)
                np.testing.assert_allclose(-r[:, 1], friction, atol=1e-9 * 10)
                np.testing.assert_allclose(slip[:, 0], u, atol=1e-9 * u[-1])
        self.assertIn("there may be more than one solution", result.output)

    def test_a_step_changes_the_table(self):
        """Under a stress from the second step on the bar slips on: work of friction by hand."""
        first = np.interp(self.PRESSURE, [2, 8, 12], [0.1, 0.4, 0.2]) * self.PRESSURE
        more = (
            "*END STEP\n*STEP\n*CHANGE FRICTION, INTERACTION=F\n*FRICTION, TAUMAX=1.8\n0.3\n"
            "*STATIC, DIRECT\n1., 1.\n"
        )
        result = solved(self, bar(self.CARD, self.PRESSURE, 7.0, more=more))
        r, slip = pairs_of(result)
        friction, u = slipped(2 * areas() * np.minimum(0.3 * self.PRESSURE, 1.8), 7.0)
        np.testing.assert_allclose(-r[:, 1], friction, atol=1e-8)
        np.testing.assert_allclose(slip[:, 0], u, atol=1e-8 * u[-1])
        _, moved = slipped(2 * areas() * first, 7.0)
        # In each increment friction acts with its value at the end.
        lost = friction @ (u - moved)
        dissipated = result.history("energy/dissipation")
        self.assertAlmostEqual(dissipated[-1] - dissipated[-2], lost, delta=1e-7 * lost)


class FiniteStrain(unittest.TestCase):
    """A block that widens under its load: its friction stress is over the deformed area."""

    def test_the_deformed_area_counts(self):
        """Pressed and pulled along as a whole: friction is TAUMAX times the area there."""
        deck = (
            "*HEADING\nA block that widens\n*BLOCK, NAME=A, NX=2, NY=2, NZ=1\n0.,0.,0., 1.,1.,1.\n"
            "*MATERIAL, NAME=M\n*ELASTIC\n100., 0.3\n*SOLID SECTION, ELSET=A, MATERIAL=M\n"
            "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
            "*SURFACE INTERACTION, NAME=F\n*FRICTION, TAUMAX=1.5\n0.4\n"
            "*CONTACT PAIR, INTERACTION=F\nA-ZMIN, FLOOR\n"
            "{solver}*STEP, NLGEOM\n*STATIC, DIRECT\n0.5, 1.\n"
            "*BOUNDARY\nA-ZMAX, 1, 2, 0.\nA-ZMAX, 3, 3, -0.15\n*END STEP\n"
            "*STEP, NLGEOM\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\nA-ZMAX, 1, 1, 0.3\n*END STEP\n"
        )
        for solver in ("*BODY SOLVER, TANGENT=NEWTON\n", "*BODY SOLVER, TANGENT=KEPT\n"):
            result = solved(self, deck.format(solver=solver))
            pair = result.pairs[0]
            area = result.file["/contact/A-ZMIN:FLOOR/covered_area"][-1]
            self.assertGreater(area.sum(), 1.05)
            self.assertTrue((pair.reaction[-1][:, 0] * 0.4 > 1.5 * area).any())
            largest = np.minimum(0.4 * pair.reaction[-1][:, 0], 1.5 * area)
            friction = np.linalg.norm(pair.reaction[-1][:, 1:], axis=1)
            self.assertTrue((pair.status[-1] == 2).all())
            np.testing.assert_allclose(friction, largest, rtol=1e-7)


if __name__ == "__main__":
    unittest.main()
