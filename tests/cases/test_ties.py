"""Tied surfaces whose meshes do not match: what must hold whatever the numbers are."""

import unittest

import h5py
import numpy as np
from program import Run
from two_bodies import solved

from studies.deck_cards import block, deck, pair, quarter_ring, step

GROUND = "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., -1.,  0., 0., 1.\n"
PUSH = "{0}-ZMAX, 3, 3, -0.05\n{0}-ZMAX, 1, 1, 0.02\n{0}-ZMAX, 2, 2, 0."
WEIGHT = "*STEP\n*STATIC, DIRECT\n1., 1.\n*DLOAD\n{}*END STEP\n"


def tie(surfaces, options=""):
    """Return the cards of a tie, "SLAVE, MASTER"."""
    return f"*TIE, NAME=GLUE{options}\n{surfaces}\n"


def at_end(result, field):
    """Return a field over the nodes at the end, a row a node in the order of the deck."""
    nodes = len(result.file["VTKHDF/Points"])
    return result.file[f"VTKHDF/PointData/{field}"][:].reshape(-1, nodes, 3)[-1]


def gravity(*bodies):
    """Return a *STEP under the bodies' weight, downwards."""
    return WEIGHT.format("".join(f"{name}, GRAV, 10., 0., 0., -1.\n" for name in bodies))


def heavy(card):
    """Return the cards of a block of density 1."""
    return card.replace("*SOLID", "*DENSITY\n1.\n*SOLID")


def shaken(name, n, low, first):
    """Return the cards of a unit cube of C3D8 from z = `low`, its nodes moved about but on edges.

    Those of a side stay in it. Node and element numbers begin at `first`.
    """
    random = np.random.default_rng(first)
    nodes, elements = [], []
    sets = {"X": [], "Y": [], "Z": []}
    for k in range(n + 1):
        for j in range(n + 1):
            for i in range(n + 1):
                place = np.array([i, j, k], float)
                inside = (place > 0) & (place < n)
                if inside.sum() >= 2:
                    place += 0.25 * inside * random.uniform(-1, 1, 3)
                x = place / n + [0, 0, low]
                number = first + len(nodes)
                nodes.append(f"{number}, {x[0]!r}, {x[1]!r}, {x[2]!r}".replace("np.float64", ""))
                for axis, index in zip("XYZ", (i, j, k), strict=True):
                    if index == 0:
                        sets[axis].append(str(number))
    across = n + 1
    for k in range(n):
        for j in range(n):
            for i in range(n):
                base = first + i + across * (j + across * k)
                ring = [base, base + 1, base + 1 + across, base + across]
                corners = ring + [corner + across * across for corner in ring]
                elements.append(", ".join(map(str, [first + len(elements), *corners])))
    bottom = [str(first + i) for i in range(n * n)]
    top = [str(first + n * n * (n - 1) + i) for i in range(n * n)]
    lines = ["*NODE", *(line.replace("(", "").replace(")", "") for line in nodes)]
    lines += [f"*ELEMENT, TYPE=C3D8, ELSET={name}", *elements]
    for axis, members in sets.items():
        lines += [f"*NSET, NSET={name}-{axis}", *members]
    lines += [f"*ELSET, ELSET={name}-B", *bottom, f"*ELSET, ELSET={name}-T", *top]
    lines += [f"*SURFACE, NAME={name}-BOTTOM, TYPE=ELEMENT", f"{name}-B, S1"]
    lines += [f"*SURFACE, NAME={name}-TOP, TYPE=ELEMENT", f"{name}-T, S2"]
    return "\n".join(lines) + "\n"


class TiedPairs(unittest.TestCase):
    def test_a_pair_that_behaves_as_tied_is_a_tie(self):
        """The displacements are those of *TIE, with and without NLGEOM; friction has no part."""
        behavior = (
            "*SURFACE INTERACTION, NAME=BOND\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED\n1e6\n"
            "*FRICTION\n0.1, 1e6\n*CONTACT PAIR, INTERACTION=BOND, TYPE=SURFACE TO SURFACE\n"
            "UP-ZMIN, LOW-ZMAX\n"
        )
        for nlgeom in ("", ", NLGEOM"):
            found = []
            for cards in (behavior, tie("UP-ZMIN, LOW-ZMAX")):
                text = deck(
                    block("LOW", (2, 2, 1), (0, 0, -1), (1, 1, 1)),
                    block("UP", (3, 3, 1), (0, 0, 0), (1, 1, 1)),
                    cards,
                    f"*STEP{nlgeom}\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nLOW-ZMIN, 1, 3\n"
                    f"{PUSH.format('UP')}\n*END STEP\n",
                )
                run = Run(text, name="tied")
                self.assertEqual(run.status, 0, run.errors)
                self.assertEqual("ties become a *TIE" in run.output, cards == behavior)
                with run.result() as result:
                    found.append(at_end(result, "displacement"))
            np.testing.assert_array_equal(found[0], found[1])


class PatchTest(unittest.TestCase):
    """A uniform stress goes through a tie of meshes that do not match."""

    def stress_error(self, axis, slave_is_upper, upper, lower, change=str):
        """The largest error of the stress, of blocks along an axis under a pressure of 10."""
        name = "XYZ"[axis]
        low, start = [0, 0, 0], [0, 0, 0]
        low[axis] = -1
        sides = (f"UP-{name}MIN", f"LOW-{name}MAX")
        rolls = "".join(
            f"{body}-{other}MIN, {'XYZ'.index(other) + 1}\n"
            for body in ("LOW", "UP")
            for other in "XYZ"
            if other != name
        )
        text = deck(
            block("LOW", lower, low, (1, 1, 1)),
            block("UP", upper, start, (1, 1, 1)),
            tie(", ".join(sides if slave_is_upper else sides[::-1])),
            f"*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nUP-{name}MAX, P, 10.\n"
            "*EL FILE, POSITION=INTEGRATION POINTS\nS\n*END STEP\n",
            held=f"LOW-{name}MIN, {axis + 1}\n{rolls}".strip(),
            tolerance=1e-12,
        )
        result = solved(self, change(text))
        stress = result.file["gauss/C3D8/stress"][:].reshape(-1, 6)
        wanted = np.zeros(6)
        wanted[axis] = -10
        return np.abs(stress - wanted).max() / 10

    def test_every_axis_and_either_side(self):
        for axis in range(3):
            for slave_is_upper in (True, False):
                error = self.stress_error(axis, slave_is_upper, 2, 3)
                self.assertLess(error, 1e-12, (axis, slave_is_upper))

    def test_elements_that_are_no_cubes(self):
        for slave_is_upper in (True, False):
            error = self.stress_error(2, slave_is_upper, (2, 5, 1), (3, 1, 2))
            self.assertLess(error, 1e-12)

    def test_a_gap_within_the_tolerance_is_closed(self):
        def open_up(text):
            return text.replace("\n0, 0, 0,  1, 1, 1", "\n0, 0, 0.004,  1, 1, 0.996", 1)

        for slave_is_upper in (True, False):
            error = self.stress_error(2, slave_is_upper, 2, 3, open_up)
            self.assertLess(error, 1e-12)


class DistortedPatch(unittest.TestCase):
    """Nodes moved about within a flat interface and within the blocks."""

    def test_nodes_moved_about(self):
        error = {}
        for slave_is_upper in (True, False):
            text = deck(
                shaken("LOW", 3, -1, 1),
                shaken("UP", 2, 0, 1001),
                "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
                "*SOLID SECTION, ELSET=LOW, MATERIAL=M\n*SOLID SECTION, ELSET=UP, MATERIAL=M\n",
                tie("UP-BOTTOM, LOW-TOP" if slave_is_upper else "LOW-TOP, UP-BOTTOM"),
                "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nUP-TOP, P, 10.\n"
                "*EL FILE, POSITION=INTEGRATION POINTS\nS\n*END STEP\n",
                held="LOW-Z, 3\nLOW-X, 1\nLOW-Y, 2\nUP-X, 1\nUP-Y, 2",
                tolerance=1e-12,
            )
            result = solved(self, text)
            stress = result.file["gauss/C3D8/stress"][:].reshape(-1, 6)
            error[slave_is_upper] = np.abs(stress - [0, 0, -10, 0, 0, 0]).max() / 10
        # What quadrature leaves of faces that are no parallelograms.
        self.assertLess(max(error.values()), 1e-9)


class Equivalence(unittest.TestCase):
    """A tie of equal meshes is no tie at all; tied bodies are one."""

    def test_equal_meshes_are_one_block(self):
        whole = solved(
            self,
            deck(
                block("A", (2, 2, 4), (0, 0, -1), (1, 1, 2)),
                GROUND,
                pair("A-ZMIN, GROUND", 0.3),
                step(PUSH.format("A"), 2),
                tolerance=1e-12,
            ),
        )
        u = at_end(whole, "displacement")
        for surfaces in ("UP-ZMIN, LOW-ZMAX", "LOW-ZMAX, UP-ZMIN"):
            result = solved(
                self,
                deck(
                    block("LOW", 2, (0, 0, -1), (1, 1, 1)),
                    block("UP", 2, (0, 0, 0), (1, 1, 1)),
                    GROUND,
                    tie(surfaces),
                    pair("LOW-ZMIN, GROUND", 0.3),
                    step(PUSH.format("UP"), 2),
                    tolerance=1e-12,
                ),
            )
            tied = at_end(result, "displacement")
            self.assertLess(np.abs(tied[:27] - u[:27]).max(), 1e-12 * np.abs(u).max())
            self.assertLess(np.abs(tied[27:] - u[18:]).max(), 1e-12 * np.abs(u).max())
            self.assertRegex(result.run_text("plan"), r"bodies +fixed +1, held by its supports")
            # 45 nodes less 9 held
            self.assertRegex(result.run_text("plan"), r"equations +fixed +108,")

    def test_half_a_model_is_the_whole(self):
        cards = [
            "*TIE, NAME=GLUE\nUP-ZMIN, LOW-ZMAX\n",
            GROUND,
            pair("LOW-ZMIN, GROUND", 0.3),
            step("UP-ZMAX, 3, 3, -0.05\nUP-ZMAX, 2, 2, 0.01\nUP-ZMAX, 1, 1, 0.", 2),
        ]
        whole = solved(
            self,
            deck(
                block("LOW", (6, 2, 2), (-1, 0, -1), (2, 1, 1)),
                block("UP", (4, 3, 2), (-1, 0, 0), (2, 1, 1)),
                *cards,
            ),
        )
        half = solved(
            self,
            deck(
                block("LOW", (3, 2, 2), (0, 0, -1), (1, 1, 1)),
                block("UP", (2, 3, 2), (0, 0, 0), (1, 1, 1)),
                *cards,
                held="LOW-XMIN, 1\nUP-XMIN, 1",
            ),
        )
        here = {
            (*np.round(x, 9), i < 63): u
            for i, (x, u) in enumerate(
                zip(whole.file["VTKHDF/Points"][:], at_end(whole, "displacement"), strict=True)
            )
        }
        low = 4 * 3 * 3
        largest = 0.0
        for i, (x, u) in enumerate(
            zip(half.file["VTKHDF/Points"][:], at_end(half, "displacement"), strict=True)
        ):
            # The lower block of the whole model has 7 x 3 x 3 nodes.
            same = here.get((*np.round(x, 9), i < low))
            self.assertIsNotNone(same)
            largest = max(largest, np.abs(u - same).max())
        self.assertLess(largest, 1e-9 * 0.05)
        self.assertIn("along these the tie does not hold", half.output)

    def test_free_tied_bodies_move_as_one(self):
        """Two blocks that friction alone holds; their weights and the push are what it carries."""
        result = solved(
            self,
            deck(
                heavy(block("LOW", 3, (0, 0, -1), (1, 1, 1))),
                heavy(block("UP", 2, (0.3, 0.2, 0), (1, 0.5, 0.7))),
                GROUND,
                tie("UP-ZMIN, LOW-ZMAX"),
                pair("LOW-ZMIN, GROUND", 0.5),
                gravity("LOW", "UP").replace("*END", "*CLOAD\nUP-ZMAX, 1, 0.1\n*END"),
            ),
        )
        force = at_end(result, "contact_force").sum(axis=0)
        np.testing.assert_allclose(force, [-0.9, 0, 13.5], atol=1e-8)
        self.assertRegex(result.run_text("plan"), r"free motions +at most +6 of body 1 ")


class Equilibrium(unittest.TestCase):
    """Loads on tied bodies are carried where these are held, wherever they act."""

    def test_an_l_under_its_weight(self):
        for surfaces in ("ARM-XMIN, POST-XMAX", "POST-XMAX, ARM-XMIN"):
            result = solved(
                self,
                deck(
                    heavy(block("POST", (2, 2, 5), (0, 0, 0), (1, 1, 3))),
                    heavy(block("ARM", (3, 3, 3), (1, 0, 2), (2, 1, 1), young=3000.0)),
                    tie(surfaces),
                    gravity("POST", "ARM"),
                    held="POST-ZMIN, 1, 3",
                ),
            )
            force = at_end(result, "reaction_force")
            x = result.file["VTKHDF/Points"][:]
            np.testing.assert_allclose(force.sum(axis=0), [0, 0, 50], atol=1e-10)
            # 30 at x = 0.5, 20 at x = 2, about the y axis
            moment = (x[:, 2] * force[:, 0] - x[:, 0] * force[:, 2]).sum()
            self.assertAlmostEqual(moment, -55, delta=1e-9)

    def test_a_chain_of_three(self):
        """The middle one is slave of one neighbour and master of the other, at shared nodes too."""
        result = solved(
            self,
            deck(
                heavy(block("A", (3, 2, 1), (0, 0, 0), (1, 1, 1))),
                heavy(block("B", 3, (0, 0, 1), (1, 1, 1))),
                heavy(block("C", 2, (1, 0, 1), (1, 1, 1))),
                "*TIE, NAME=ONE\nB-ZMIN, A-ZMAX\n*TIE, NAME=TWO\nC-XMIN, B-XMAX\n",
                gravity("A", "B", "C"),
                held="A-ZMIN, 1, 3",
            ),
        )
        np.testing.assert_allclose(
            at_end(result, "reaction_force").sum(axis=0), [0, 0, 30], atol=1e-10
        )
        self.assertRegex(result.run_text("plan"), r"bodies +fixed +1, held")

    def test_a_prescribed_master_moves_its_slaves(self):
        result = solved(
            self,
            deck(
                block("A", 2, (0, 0, 0), (1, 1, 1)),
                block("B", 3, (0, 0, 1), (1, 1, 1)),
                tie("B-ZMIN, A-ZMAX"),
                step("A-ZMAX, 1, 1, 0.3\nA-ZMAX, 2, 2, 0.1\nA-ZMAX, 3, 3, -0.2"),
                held="A-ZMIN, 1, 3",
            ),
        )
        u = at_end(result, "displacement")[27:]
        np.testing.assert_allclose(u, np.tile([0.3, 0.1, -0.2], (64, 1)), atol=1e-13)
        force = at_end(result, "reaction_force")
        np.testing.assert_allclose(force.sum(axis=0), 0, atol=1e-9)
        np.testing.assert_allclose(force[27:], 0, atol=0)

    def test_rings_whose_facets_do_not_match(self):
        """A thick pipe of two tied rings under pressure: Lame's displacement inside."""
        for surfaces in ("I-OUT, O-IN", "O-IN, I-OUT"):
            result = solved(
                self,
                deck(
                    quarter_ring("I", 1, (1, 2), (6, 24)),
                    quarter_ring("O", 1001, (2, 3), (5, 18)),
                    "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
                    "*SOLID SECTION, ELSET=I, MATERIAL=M\n*SOLID SECTION, ELSET=O, MATERIAL=M\n",
                    tie(surfaces),
                    "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nI-IN, P, 10.\n*END STEP\n",
                    held="I-X, 1\nI-Y, 2\nO-X, 1\nO-Y, 2\nI-ALL, 3\nO-ALL, 3",
                ),
            )
            x = result.file["VTKHDF/Points"][:]
            u = at_end(result, "displacement")
            inside = np.abs(np.hypot(x[:, 0], x[:, 1]) - 1) < 1e-6
            mean = (u * x).sum(axis=1)[inside].mean()
            # u(a) = (1 + nu) p a ((1 - 2 nu) a^2 + b^2)/(E (b^2 - a^2)), plane strain
            lame = 1.3 * 10 * (0.4 + 9) / (1000 * 8)
            self.assertAlmostEqual(mean / lame, 1, delta=0.01)


class Hinges(unittest.TestCase):
    """Pieces that can move against each other are refused, not guessed at."""

    def refused(self, *cards, **more):
        """Run a deck that must end with status 2, for want of a tie that holds."""
        run = Run(deck(*cards, **more), name="deck")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("free to move against each other", run.errors)

    def test_a_line_of_tied_nodes(self):
        """One element's edge on the master: the block turns about it."""
        for held in ("LOW-ZMIN, 1, 3", ""):
            self.refused(
                heavy(block("LOW", 3, (0, 0, -1), (1, 1, 1))),
                heavy(block("UP", 2, (0.995, 0, 0), (1, 1, 1))),
                GROUND,
                tie("UP-ZMIN, LOW-ZMAX"),
                pair("LOW-ZMIN, GROUND"),
                gravity("LOW", "UP"),
                held=held,
            )

    def test_supports_in_the_place_of_the_tie(self):
        """Along z all tied nodes are held, so that the lower block hangs on nothing."""
        self.refused(
            heavy(block("LOW", 3, (0, 0, -1), (1, 1, 1))),
            heavy(block("UP", 2, (0, 0, 0), (1, 1, 1))),
            tie("UP-ZMIN, LOW-ZMAX"),
            gravity("LOW", "UP"),
            held="UP-ZMIN, 3\nUP-XMIN, 1, 2",
        )


class ContactOnTiedNodes(unittest.TestCase):
    """Points and masters of contact that are tied themselves."""

    def resultants(self, contact):
        """A block pressed against the side of two tied ones: the pairs' forces, all together."""
        names = ("LOW-XMAX", "UP-XMAX")
        pairs = [
            pair(contact.format(name), 0.3, number=i + 1) for i, name in enumerate(names)
        ]
        result = solved(
            self,
            deck(
                block("LOW", 4, (0, 0, -1), (1, 1, 1)),
                block("UP", 3, (0, 0, 0), (1, 1, 1)),
                block("SIDE", (1, 3, 5), (1, 0, -1), (1, 1, 2)),
                tie("UP-ZMIN, LOW-ZMAX"),
                *pairs,
                step("SIDE-XMAX, 1, 1, -0.01\nSIDE-XMAX, 2, 3, 0."),
                held="LOW-XMIN, 1, 3\nUP-XMIN, 1, 3",
            ),
        )
        support = at_end(result, "reaction_force")
        x = result.file["VTKHDF/Points"][:]
        np.testing.assert_allclose(support.sum(axis=0), 0, atol=1e-9)
        return support[x[:, 0] > 1.5].sum(axis=0)

    def test_either_side_is_the_slave(self):
        one = self.resultants("{}, SIDE-XMIN")
        other = self.resultants("SIDE-XMIN, {}")
        self.assertLess(np.abs(one - other).max(), 0.02 * np.abs(one).max())

    def test_solvers_end_alike(self):
        """Newton's method and sweeps on an L whose tied nodes touch the ground."""
        forces = []
        for solver in ("GLOBAL NEWTON", "SWEEPS"):
            result = solved(
                self,
                deck(
                    block("LEFT", 2, (0, 0, -1), (1, 1, 1)),
                    block("RIGHT", 3, (1, 0, -1), (1, 1, 1)),
                    GROUND,
                    tie("RIGHT-XMIN, LEFT-XMAX"),
                    pair("LEFT-ZMIN, GROUND"),
                    pair("RIGHT-ZMIN, GROUND", number=2),
                    step(PUSH.format("LEFT"), 2),
                ).replace("*CONTACT SOLVER", f"*CONTACT SOLVER, SOLVER={solver}"),
            )
            forces.append(at_end(result, "contact_force").sum(axis=0))
        np.testing.assert_allclose(forces[0], forces[1], rtol=1e-6, atol=1e-8)


class Arithmetic(unittest.TestCase):
    """Other precisions, a run cut in two, and an exported problem."""

    TEXT = deck(
        block("LOW", 4, (0, 0, -1), (1, 1, 1)),
        block("UP", 3, (0, 0, 0), (1, 1, 1), young=3000.0),
        GROUND,
        tie("UP-ZMIN, LOW-ZMAX"),
        pair("LOW-ZMIN, GROUND", 0.3),
        step(PUSH.format("UP"), 4),
    )

    def test_other_precisions(self):
        u = at_end(solved(self, self.TEXT), "displacement")
        for options in (
            "FACTOR=SINGLE",
            "BLOCK LOW RANK=1e-6",
            "OUT OF CORE=YES",
        ):
            text = self.TEXT.replace("*TIE", f"*PRECISION, {options}\n*TIE")
            other = at_end(solved(self, text), "displacement")
            self.assertLess(np.abs(other - u).max(), 1e-9 * np.abs(u).max(), options)

    def test_a_run_cut_in_two_is_the_same(self):
        """Ended by a signal after a few increments and continued: the same bits."""
        text = self.TEXT.replace("0.25, 1.", f"{1 / 64!r}, 1.")
        whole = Run(text, name="deck")
        self.assertEqual(whole.status, 0, whole.errors)
        continued = Run(text, "--continue", name="deck", ended_at=("1", "3"))
        self.assertEqual(continued.status, 0, continued.errors)
        with h5py.File(continued.file) as one, h5py.File(whole.file) as other:
            for name in ("displacement", "reaction_force", "contact_force"):
                name = f"VTKHDF/PointData/{name}"
                self.assertTrue(np.array_equal(one[name][()], other[name][()]), name)

    def test_an_exported_problem_has_these_reactions(self):
        run = Run(self.TEXT, "--export-fclib", "4", name="deck")
        self.assertEqual(run.status, 0, run.errors)
        exported = run.folder / "deck-4.fclib.hdf5"
        with run.result() as result, h5py.File(exported) as file:
            reaction = result.pairs[0].reaction[3]
            r = file["solution/r"][()].reshape(-1, 3)
            np.testing.assert_allclose(r, reaction, rtol=0, atol=1e-12 * np.abs(reaction).max())
        again = Run(exported)
        self.assertEqual(again.status, 0, again.errors)


class Arms(unittest.TestCase):
    """Nodes that ADJUST=NO leaves off their master."""

    TEXT = """*BLOCK, NAME=LOW, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=UP, NX=3, NY=3, NZ=2
0.1, 0.2, 1.4,  0.7, 0.7, 0.5
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*TIE, NAME=GLUE, ADJUST=NO, POSITION TOLERANCE=0.5
UP-ZMIN, LOW-ZMAX
*STEP{nlgeom}
*STATIC
*BOUNDARY
LOW-ZMIN, 1, 3
{load}*NODE FILE
U, RF
*END STEP
"""

    def test_what_turns_is_not_strained(self):
        """A small rotation of the base goes through the gap."""
        turn, lines = np.array([0.01, -0.02, 0.03]), ""
        with Run(self.TEXT.format(nlgeom="", load=""), name="ties").result() as it:
            points, ids = it.points, it.node_ids
        for node, x in zip(ids, points, strict=True):
            if abs(x[2]) < 1e-9:
                u = map(float, np.cross(turn, x))
                lines += "".join(f"{node}, {d}, {d}, {of!r}\n" for d, of in enumerate(u, 1))
        text = self.TEXT.format(nlgeom="", load=lines).replace("LOW-ZMIN, 1, 3\n", "")
        run = Run(text, name="ties")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("off the master by up to 0.4 (ADJUST=NO) turn", run.output)
        with run.result() as result:
            u = result.field("displacement", -1)
            np.testing.assert_allclose(u, np.cross(turn, points), rtol=0, atol=1e-12)

    def test_moments_go_through(self):
        """A force on top has its moment about the base."""
        load = "*CLOAD\nUP-ZMAX, 1, 0.0625\n"
        run = Run(self.TEXT.format(nlgeom="", load=load), name="ties")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            force = result.field("reaction_force", -1)
            moment = np.cross(result.points, force).sum(axis=0)
        np.testing.assert_allclose(force.sum(axis=0), [-1, 0, 0], atol=1e-10)
        np.testing.assert_allclose(moment, [0, -1.9, 0.55], atol=1e-10)

    def test_not_at_finite_strain(self):
        run = Run(self.TEXT.format(nlgeom=", NLGEOM", load=""), name="ties")
        self.assertEqual(run.status, 1)
        self.assertIn("ties that leave nodes off their master", run.errors)


if __name__ == "__main__":
    unittest.main()
