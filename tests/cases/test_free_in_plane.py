"""Bodies that may move in a plane without friction.

No load drives them there: they stay where they were on the mean of their nodes, however the scene
lies in its axes and wherever the program holds them to factorise.
"""

import unittest

import h5py
import numpy as np
from program import Run

HALF = 0.5  # of the height of a block; its sides are 1 and 1.5
SIZE = np.array([1.0, 1.5, 2 * HALF])


def turned(degrees):
    """Turn about x, then about z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ about_x


def numbers(*values):
    """A line of numbers."""
    return ", ".join(repr(float(v)) for v in values)


def prescribed(nodes, way):
    """Lines of *BOUNDARY that move nodes."""
    return [f"{node}, {i}, {i}, {float(way[i - 1])!r}" for node in nodes for i in (1, 2, 3)]


class Deck:
    """A deck whose scene is turned as a whole."""

    def __init__(self, degrees):
        self.turn = turned(degrees)
        self.head, self.lines, self.body = ["*NODE"], [], {}
        self.n_nodes = self.n_elements = 0

    def at(self, *place):
        """Return the numbers of a place or a vector."""
        return numbers(*(self.turn @ np.array(place)))

    def block(self, name, cells, low, size):
        """Add a block, its surfaces NAMEL below and NAMEU above; returns its nodes below, above."""
        n = np.array(cells) + 1
        ids = self.n_nodes + 1 + np.arange(n.prod()).reshape(n)
        for at, number in np.ndenumerate(ids):
            place = np.array(low) + np.array(size) * np.array(at) / np.array(cells)
            self.head.append(f"{number}, {self.at(*place)}")
        self.n_nodes += n.prod()
        self.lines += [f"*NSET, NSET=N{name}, GENERATE", f"{ids.min()}, {ids.max()}"]
        faces = [f"*SURFACE, NAME={name}L"], [f"*SURFACE, NAME={name}U"]
        self.lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
        for i, j, k in np.ndindex(*cells):
            self.n_elements += 1
            corners = [str(ids[i + a, j + b, k + c]) for c in (0, 1)
                       for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]  # fmt: skip
            self.lines.append(", ".join([str(self.n_elements), *corners]))
            if k == 0:
                faces[0].append(f"{self.n_elements}, S1")
            if k == cells[2] - 1:
                faces[1].append(f"{self.n_elements}, S2")
        self.lines += [*faces[0], *faces[1], f"*SOLID SECTION, ELSET={name}, MATERIAL=M"]
        self.body[name] = ids.ravel() - 1
        return [list(ids[:, :, k].ravel()) for k in (0, -1)]

    def node(self, *place):
        """Add a reference node."""
        self.n_nodes += 1
        self.head.append(f"{self.n_nodes}, {self.at(*place)}")
        return self.n_nodes

    def add(self, *lines):
        """Add lines."""
        self.lines += lines

    def start(self, *options):
        """Run the deck."""
        text = ["*HEADING", "Free in a plane", *self.head,
                "*MATERIAL, NAME=M", "*ELASTIC", "100., 0.3", "*EXPANSION", "1e-3",
                "*SURFACE INTERACTION, NAME=SMOOTH", "*SURFACE INTERACTION, NAME=ROUGH",
                "*FRICTION", "0.5", *self.lines, ""]  # fmt: skip
        return Run("\n".join(text), *options, name="free")

    def run(self, test, *options):
        """Displacements at the end of each body, turned back; the run must be solved."""
        run = self.start(*options)
        test.assertEqual(run.status, 0, run.errors)
        return self.moved(run)

    def moved(self, run):
        """Displacements at the end of each body, turned back."""
        with h5py.File(run.file) as file:
            n = len(file["VTKHDF/Points"])
            u = file["VTKHDF/PointData/displacement"][-n:] @ self.turn
        return {name: u[nodes] for name, nodes in self.body.items()}


def between_plates(deck, step="*STEP", lid="moved", mu="SMOOTH", cells=(2, 3, 2)):
    """A block between two planes, the upper moved or pressed down."""
    deck.block("B", cells, (0, 0, 0), SIZE)
    node = deck.node(0, 0, SIZE[2])
    deck.add("*OBSTACLE, NAME=GROUND, TYPE=PLANE", deck.at(0, 0, 0) + ", " + deck.at(0, 0, 1),
             f"*OBSTACLE, NAME=LID, TYPE=PLANE, REF NODE={node}",
             deck.at(0, 0, SIZE[2]) + ", " + deck.at(0, 0, -1),
             f"*CONTACT PAIR, INTERACTION={mu}", "BL, GROUND",
             "*CONTACT PAIR, INTERACTION=SMOOTH", "BU, LID",
             step, "*STATIC", "0.5, 1.")  # fmt: skip
    if lid == "moved":
        way = deck.turn @ np.array([0, 0, -0.04])
        deck.add("*BOUNDARY", *prescribed([node], way))
    else:
        force = deck.turn @ np.array([0, 0, -6.0])
        deck.add("*CLOAD", *(f"{node}, {i}, {float(force[i - 1])!r}" for i in (1, 2, 3)))
    deck.add("*BOUNDARY", f"{node}, 4, 6", "*END STEP")


def between_cylinders(deck, step="*STEP", aside=0):
    """A block between two cylinders, the upper moved down, both somewhat aside of its middle."""
    deck.block("B", (2, 3, 2), (-0.5, -0.75, 0), SIZE)
    node = deck.node(aside, 0, SIZE[2] + 3)
    way = deck.turn @ np.array([0, 0, -0.02])
    deck.add("*OBSTACLE, NAME=GROUND, TYPE=CYLINDER",
             deck.at(aside, 0, -3) + ", " + deck.at(0, 1, 0) + ", 3.",
             f"*OBSTACLE, NAME=LID, TYPE=CYLINDER, REF NODE={node}",
             deck.at(aside, 0, SIZE[2] + 3) + ", " + deck.at(0, 1, 0) + ", 3.",
             "*CONTACT PAIR, INTERACTION=SMOOTH", "BL, GROUND",
             "*CONTACT PAIR, INTERACTION=SMOOTH", "BU, LID",
             "*CONTACT SOLVER, TOLERANCE=1e-12", step, "*STATIC", "0.5, 1.",
             "*BOUNDARY", *prescribed([node], way), f"{node}, 4, 6",
             "*END STEP")  # fmt: skip


class FreeInPlane(unittest.TestCase):
    """Each scene as it is and turned by 37 degrees."""

    def both(self, make, *options, within=2e-6):
        """Displacements of a scene in two positions, which must be the same."""
        found = []
        for degrees in (0, 37):
            deck = Deck(degrees)
            make(deck)
            found.append(deck.run(self, *options))
        for name, straight in found[0].items():
            np.testing.assert_allclose(found[1][name], straight, atol=within * abs(straight).max())
        return found[1]

    def at_rest(self, u, axes=(0, 1)):
        """The mean of the nodes of a body has not moved along axes."""
        np.testing.assert_allclose(u.mean(0)[list(axes)], 0, atol=1e-6 * abs(u).max())

    def test_planes(self):
        """Pressed uniformly, a block widens by nu times what it is pressed, to both sides."""
        u = self.both(between_plates)["B"]
        self.at_rest(u)
        np.testing.assert_allclose(abs(u).max(0), [0.3 * 0.02, 0.3 * 0.03, 0.04], rtol=1e-6)

    def test_lid_under_force(self):
        """The lid is free in its plane as well: a stress of 4 shortens the block by 4 %."""
        u = self.both(lambda deck: between_plates(deck, lid="pressed"))["B"]
        self.at_rest(u)
        np.testing.assert_allclose(abs(u).max(0), [0.3 * 0.02, 0.3 * 0.03, 0.04], rtol=1e-6)

    def test_finite_strain(self):
        """The same at finite strain."""
        for tangent in ("KEPT", "NEWTON"):
            step = f"*BODY SOLVER, TANGENT={tangent}\n*STEP, NLGEOM"
            with self.subTest(tangent=tangent):
                u = self.both(lambda deck, step=step: between_plates(deck, step=step))["B"]
                self.at_rest(u)

    def test_rough_ground(self):
        """Friction holds the block: nothing is free."""
        self.both(lambda deck: between_plates(deck, mu="ROUGH"))

    def test_plates_of_elements(self):
        """Smooth plates that are bodies; none of the meshes fits."""

        def make(deck):
            floor, _ = deck.block("F", (2, 2, 1), (-0.5, -0.5, -0.5), (2.0, 2.5, 0.5))
            deck.block("B", (2, 3, 2), (0, 0, 0), SIZE)
            _, roof = deck.block("R", (3, 2, 1), (-0.5, -0.5, SIZE[2]), (2.0, 2.5, 0.5))
            way = deck.turn @ np.array([0, 0, -0.04])
            deck.add("*CONTACT PAIR, INTERACTION=SMOOTH", "BL, FU",
                     "*CONTACT PAIR, INTERACTION=SMOOTH", "BU, RL", "*BOUNDARY",
                     *(f"{node}, 1, 3" for node in floor), "*STEP", "*STATIC", "1., 1.",
                     "*BOUNDARY", *(f"{node}, {i}, {i}, {float(way[i - 1])!r}"
                                    for node in roof for i in (1, 2, 3)), "*END STEP")  # fmt: skip

        self.at_rest(self.both(make)["B"])

    def test_between_cylinders(self):
        """Along the axes of two smooth cylinders a block stays, about them it turns."""
        u = self.both(between_cylinders, within=1e-9)["B"]
        np.testing.assert_allclose(u.mean(0)[1], 0, atol=1e-9 * abs(u).max())

    def test_squeezed_out(self):
        """A block that slips out between cylinders goes no farther than these take it.

        Its nodes slide off the crests. Past a quarter of its width they are out of reach there,
        which is refused where it is seen; past its width all of it is. At finite strain it is found
        where it balances on them, which is unstable.
        """
        newton = "*BODY SOLVER, TANGENT=NEWTON\n*STEP, NLGEOM"
        for step, aside in (("*STEP, NLGEOM", 0), ("*STEP", 1e-6), ("*STEP, NLGEOM", 1e-3),
                            (newton, 0), (newton, 1e-3)):  # fmt: skip
            with self.subTest(step=step, aside=aside):
                deck = Deck(0)
                between_cylinders(deck, step, aside)
                run = deck.start()
                if run.status == 0:
                    self.assertLess(abs(deck.moved(run)["B"]).max(), SIZE[0])
                else:
                    self.assertEqual(run.status, 2)
                    self.assertRegex(run.errors, "use smaller elements|equilibrium is unstable")

    def test_two_that_stick(self):
        """Two blocks that stick to each other between smooth plates stay where both were."""

        def make(deck):
            deck.block("B", (2, 3, 1), (0, 0, 0), SIZE * [1, 1, 0.5])
            deck.block("C", (2, 2, 1), (-0.1, 0.2, HALF), (0.8, 1.0, HALF))
            node = deck.node(0, 0, SIZE[2])
            way = deck.turn @ np.array([0, 0, -0.04])
            deck.add("*OBSTACLE, NAME=GROUND, TYPE=PLANE",
                     deck.at(0, 0, 0) + ", " + deck.at(0, 0, 1),
                     f"*OBSTACLE, NAME=LID, TYPE=PLANE, REF NODE={node}",
                     deck.at(0, 0, SIZE[2]) + ", " + deck.at(0, 0, -1),
                     "*CONTACT PAIR, INTERACTION=SMOOTH", "BL, GROUND",
                     "*CONTACT PAIR, INTERACTION=SMOOTH", "CU, LID",
                     "*CONTACT PAIR, INTERACTION=ROUGH, SMALL SLIDING=YES", "CL, BU",
                     "*STEP", "*STATIC", "1., 1.", "*BOUNDARY", *prescribed([node], way),
                     f"{node}, 4, 6", "*END STEP")  # fmt: skip

        self.both(make)

    def test_warmed_in_a_gap(self):
        """A warm block that touches nothing stays where it is."""

        def make(deck):
            deck.block("B", (2, 3, 2), (0, 0, 0), SIZE)
            deck.add("*OBSTACLE, NAME=GROUND, TYPE=PLANE",
                     deck.at(0, 0, -1) + ", " + deck.at(0, 0, 1),
                     "*CONTACT PAIR, INTERACTION=SMOOTH", "BL, GROUND",
                     "*INITIAL CONDITIONS, TYPE=TEMPERATURE", "NB, 0.", "*STEP", "*STATIC",
                     "0.5, 1.", "*TEMPERATURE", "NB, 20.", "*END STEP")  # fmt: skip

        u = self.both(make)["B"]
        self.at_rest(u, (0, 1, 2))

    def test_without_contact(self):
        """A warm block that nothing holds or touches."""

        def make(deck):
            deck.block("B", (2, 3, 2), (0, 0, 0), SIZE)
            deck.add("*INITIAL CONDITIONS, TYPE=TEMPERATURE", "NB, 0.", "*STEP", "*STATIC",
                     "0.5, 1.", "*TEMPERATURE", "NB, 20.", "*END STEP")  # fmt: skip

        self.at_rest(self.both(make)["B"], (0, 1, 2))


if __name__ == "__main__":
    unittest.main()
