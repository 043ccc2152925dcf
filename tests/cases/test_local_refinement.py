"""Elements cut in some places: nodes hang where they meet others, and everything still fits."""

import unittest

import numpy as np
from program import INPUT, Run
from test_refine import body, by_place
from two_bodies import solved

from studies.deck_cards import block, deck, pair, step

GROUND = "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
PRESSURE = ("*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\n{top}, P, 10.\n"
            "*EL FILE\nS\n*CONTACT FILE\n*END STEP\n")  # fmt: skip


def at(name, *nodes, times=1):
    """Return the cards that cut the elements at some nodes."""
    numbers = ", ".join(map(str, nodes))
    return f"*NSET, NSET={name}\n{numbers}\n*REFINE, NSET={name}, TIMES={times}\n"


class SameSpace(unittest.TestCase):
    """What is known of nested meshes."""

    def test_all_elements_are_those_of_a_refined_mesh(self):
        """Cut all, once or twice: the deck refined as a whole, with equations, ties and rollers."""
        cards, _ = body(1)
        lid = block("LID", (2, 1, 1), (0, 0, 2), (2, 1, 0.5), 2000.0)
        rest = (
            lid, "*TIE, NAME=T\nLID-ZMIN, BODY-TOP\n", GROUND, pair("BODY-SOLE, GROUND", 0.3),
            "*TRANSFORM, NSET=BODY-BACK\n1., 2., 0., -2., 1., 0.\n",
            step("LID-ZMAX, 3, 3, -0.02\nLID-ZMAX, 1, 1, 0.003"),
        )  # fmt: skip
        held = "BODY-BACK, 2\nLID-ZMAX, 2\nBODY-EDGE, 1"
        for times in (1, 2):
            refine = f"*REFINE, ELSET=BODY, TIMES={times}\n*REFINE, ELSET=LID, TIMES={times}\n"
            cut = solved(self, deck(cards, refine, *rest, held=held))
            whole = solved(self, deck(cards, *rest, held=held), "--refine", str(times))
            (places, found), (expected_places, expected) = by_place(cut), by_place(whole)
            np.testing.assert_allclose(places, expected_places, atol=1e-12)
            np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())

    def test_finer_spaces_hold_coarser_ones(self):
        """A body that is stretched: of nested meshes the finer one is the more yielding.

        Equations, local directions, couplings and ties on what is cut and what is not.
        """
        cards, mesh = body(2)
        number = {tuple(x): 1 + i for i, x in enumerate(mesh.nodes)}
        middle, front, corner = number[1, 0.5, 2], number[1, 0, 0], number[2, 1, 2]
        lid = block("LID", (4, 2, 1), (0, 0, 2), (2, 1, 0.5), 300.0)
        scenes = {
            "rollers": ("*TRANSFORM, NSET=BODY-BACK\n1., 2., 0., -2., 1., 0.\n",
                        step("BODY-SOLE, 3\nBODY-TOP, 3, 3, -0.1\nBODY-BACK, 2\nBODY-EDGE, 1")),
            "equations": ("*NODE\n90001, 5., 0., 1.\n",
                          "*EQUATION\n3\nBODY-RIGHT, 1, 1., BODY-LEFT, 1, -1., 90001, 1, -1.\n",
                          "*EQUATION\n2\nBODY-RIGHT, 2, 1., BODY-LEFT, 2, -1.\n",
                          step("BODY-SOLE, 3\n90001, 1, 1, 0.1\nBODY-EDGE, 1, 2")),
            "coupling": ("*NODE\n90002, 1., 0.5, 4.\n",
                         "*COUPLING, REF NODE=90002, SURFACE=BODY-TOP\n*KINEMATIC\n",
                         step("BODY-SOLE, 1, 3\n90002, 5, 5, 0.1\n90002, 2, 2, 0.05")),
            "tie": (lid, "*TIE, NAME=T\nLID-ZMIN, BODY-TOP\n",
                    step("BODY-SOLE, 1, 3\nLID-ZMAX, 1, 1, 0.1\nLID-ZMAX, 2, 3, 0.")),
        }  # fmt: skip
        for name, rest in scenes.items():
            # Both sides of a strip stay alike.
            other = front if name == "equations" else corner
            with self.subTest(scene=name):
                energy = [
                    solved(self, deck(cards, refine, *rest)).history("energy/strain")[-1]
                    for refine in (
                        "", at("ONE", middle), at("ONE", middle) + at("TWO", other),
                        at("ONE", middle, times=2) + at("TWO", other, times=2),
                        "*REFINE, ELSET=BODY, TIMES=2\n")
                ]  # fmt: skip
                # More of it is cut each time: by more than rounding, by less than all.
                self.assertTrue(np.all(np.diff(energy) < -1e-10 * energy[0]), energy)
                self.assertGreater(energy[-1], 0.5 * energy[0])


class Patch(unittest.TestCase):
    """A uniform stress is uniform wherever nodes hang."""

    def assert_uniform(self, result, tolerance=1e-10):
        stress = result.field("stress", -1, on="elements")
        expected = np.broadcast_to([0, 0, -10.0, 0, 0, 0], stress.shape)
        np.testing.assert_allclose(stress, expected, atol=10 * tolerance)
        for of in result.pairs.values():
            pressure = of.pressure[-1]
            # Nodes that hang touch by those about them. Areas are those of faces that have grown.
            pressed = pressure[pressure > 0]
            np.testing.assert_allclose(pressed, pressed[0], rtol=tolerance)
            np.testing.assert_allclose(pressed[0], 10.0, rtol=0.01)

    def test_distorted_elements_on_a_plane(self):
        text = (INPUT / "patch.inp").read_text()
        for element in ("C3D8", "C3D8I", "C3D8B"):
            for cards in (at("Q", 1, times=3), at("Q", 14, times=2),
                          "*ELSET, ELSET=Q\n2, 3\n*REFINE, ELSET=Q, TIMES=2\n"):  # fmt: skip
                with self.subTest(element=element, cards=cards):
                    run = Run(text.replace("*MATERIAL", f"{cards}*MATERIAL", 1), name="patch",
                              element=element)  # fmt: skip
                    self.assertEqual(run.status, 0, run.errors)
                    with run.result() as result:
                        self.assert_uniform(result)
                        shown = result.field("contact_pressure", -1)
                        status = result.field("contact_status", -1)
                        below = result.points[:, 2] == 0
                        np.testing.assert_allclose(shown[below], 10.0, rtol=1e-9)
                        hanging = np.count_nonzero(below & (status < 0))
                        self.assertEqual(hanging > 0, "\n14\n" not in cards)

    def test_bodies_that_touch_each_other(self):
        """Meshes that do not match, cut on the slave's side, on the master's, on both."""
        low = block("LOW", 4, (0, 0, 0), (2, 2, 1))
        up = block("UP", 3, (0, 0, 1), (2, 2, 1))
        on_slave, on_master = 125 + 6, 4 * 25 + 13
        rest = (pair("UP-ZMIN, LOW-ZMAX", 0.3), PRESSURE.format(top="UP-ZMAX"))
        held = "LOW-ZMIN, 3\nLOW-XMIN, 1\nLOW-YMIN, 2\nUP-XMIN, 1\nUP-YMIN, 2"
        for refine in (at("S", on_slave), at("S", on_slave, times=2), at("M", on_master),
                       at("S", on_slave, times=2) + at("M", on_master, times=2)):  # fmt: skip
            with self.subTest(refine=refine):
                result = solved(self, deck(low, up, refine, *rest, held=held, tolerance=1e-12))
                self.assert_uniform(result)

    def test_facets(self):
        """Before an obstacle of triangles."""
        up = block("UP", 3, (0, 0, 0), (2, 2, 1))
        plate = ("*NODE\n901, -1., -1., 0.\n902, 4., -1., 0.\n903, 4., 4., 0.\n904, -1., 4., 0.\n"
                 "*ELEMENT, TYPE=R3D3, ELSET=PLATE\n901, 901, 902, 903\n902, 901, 903, 904\n"
                 "*NODE\n905, 0., 0., -1.\n*RIGID BODY, REF NODE=905, ELSET=PLATE\n"
                 "*SURFACE, NAME=PLATE\nPLATE, SPOS\n")  # fmt: skip
        result = solved(
            self, deck(up, plate, at("S", 6, times=2), pair("UP-ZMIN, PLATE"),
                       PRESSURE.format(top="UP-ZMAX"), held="UP-XMIN, 1\nUP-YMIN, 2\n905, 1, 3",
                       tolerance=1e-12))  # fmt: skip
        self.assert_uniform(result)


EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6),
         (3, 7))  # fmt: skip
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def openings(result):
    """Return, of every node in the middle of an edge or face of an element, how far it is off that.

    Found by places alone, where the nodes are after the last increment.
    """
    body = np.arange(len(result.points))  # the lowest node that elements connect each one to
    while True:
        lowest = body.copy()
        np.minimum.at(lowest, result.elements, body[result.elements].min(axis=1)[:, None])
        if np.array_equal(lowest, body):
            break
        body = lowest
    places = np.round(result.points, 9)
    at = {(body[node], *places[node]): node for node in np.unique(result.elements)}
    moved = result.points + result.field("displacement", -1)
    found = []
    for element in result.elements:
        for side in (*EDGES, *FACES):
            around = element[list(side)]
            middle = np.round(result.points[around].mean(axis=0), 9)
            node = at.get((body[around[0]], *middle))
            if node is not None:
                found.append(np.abs(moved[node] - moved[around].mean(axis=0)).max())
    return np.array(found)


class Meaning(unittest.TestCase):
    def test_the_mesh_stays_closed(self):
        """Under a ball that is drawn sideways, and in bodies that touch and are tied."""
        low = block("LOW", 2, (0, 0, 0), (2, 2, 1))
        up = block("UP", 3, (0, 0, 1), (2, 2, 1), 300.0)
        lid = block("LID", 2, (0, 0, 2), (2, 2, 1), 3000.0)
        refine = at("L", 27, times=2) + at("U", 27 + 6, times=2) + at("M", 27 + 64 + 5)
        steps = [step(f"LID-ZMAX, 3, 3, -0.05\nLID-ZMAX, 1, 1, {x}") for x in (0, 0.02)]
        scene = deck(low, up, lid, refine, "*TIE, NAME=T\nLID-ZMIN, UP-ZMAX\n",
                     pair("UP-ZMIN, LOW-ZMAX", 0.3), *steps, held="LOW-ZMIN, 1, 3")  # fmt: skip
        indent = (INPUT / "indent.inp").read_text()
        for text in (indent, scene):
            result = solved(self, text)
            found = openings(result)
            self.assertGreater(len(found), 50)
            motion = np.abs(result.field("displacement", -1)).max()
            self.assertLess(found.max(), 1e-12 * motion)

    def test_hertz(self):
        """Elements cut twice at contact: the pressure of Hertz, from which coarse elements are far.

        In the half-space it is 2798.3; a block of eight contact radii differs by less than 0.5 %.
        """
        text = (INPUT / "hertz.inp").read_text()
        near = "*NSET, NSET=NEAR, GENERATE\n1, 2\n10, 11\n82, 83\n91, 92\n"
        error = []
        for times in (0, 2, 3):
            cards = f"{near}*REFINE, NSET=NEAR, TIMES={times}\n" if times else ""
            run = Run(text.replace("*MATERIAL", f"{cards}*MATERIAL", 1), name="hertz", n=8,
                      grading=1)  # fmt: skip
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                error.append(abs(result.pairs[0].pressure[-1].max() / 2798.3 - 1))
        self.assertGreater(error[0], 0.1)
        self.assertLess(error[1], 0.05)
        self.assertLess(error[2], 0.02)

    def test_numbers(self):
        """Elements that are not cut keep theirs, pieces get higher ones; so do nodes."""
        cards, mesh = body(1)
        result = solved(self, deck(cards, at("Q", 1), step("BODY-SOLE, 1, 3\nBODY-TOP, 3, 3, -1.")))
        ids = result.element_ids
        self.assertEqual(list(ids), [*range(5, 13), 2, 3, 4])
        kept = [result.node(number) for number in range(1, len(mesh.nodes) + 1)]
        np.testing.assert_allclose(result.points[kept], mesh.nodes, atol=1e-12)
        self.assertIn("refined locally: 4 elements are 11", result.output)

    def test_neighbours_differ_by_one_cut(self):
        """Edges that meet at a node are twice as long at most."""
        cards, _ = body(3)
        result = solved(self, deck(cards, at("Q", 1, times=4),
                                   step("BODY-SOLE, 1, 3\nBODY-TOP, 3, 3, -0.1")))  # fmt: skip
        edge = np.ptp(result.points[result.elements][:, :, 0], axis=1)
        self.assertEqual(len(np.unique(np.round(edge, 9))), 5)
        for node in range(len(result.points)):
            here = edge[np.any(result.elements == node, axis=1)]
            if len(here):
                self.assertLess(here.max(), 2.1 * here.min())


class Accuracy(unittest.TestCase):
    def test_contact_that_is_small(self):
        """The pressure of Hertz to 5 %, on a mesh that is finer where the ball touches."""
        text = (INPUT / "hertz.inp").read_text()
        text = text.replace("*STEP\n", "*ACCURACY, OF=PRESSURE\n0.05\n*STEP, NLGEOM=NO\n", 1)
        run = Run(text, name="hertz", n=8, grading=1)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            sequence = result.accuracy
            self.assertGreater(sequence.cuts[-1], 0)
            self.assertEqual(result.file["run"].attrs["cuts"], sequence.cuts[-1])
            self.assertLess(abs(result.pairs[0].pressure[-1].max() / 2796.2 - 1), 0.05)
            # As fine everywhere as at contact it would have a million elements.
            self.assertLess(sequence.elements[-1], 20000)
            size = (sequence.element_size / 2.0**sequence.cuts)[-1]
            self.assertGreater(512 / size**3, 5 * sequence.elements[-1])


if __name__ == "__main__":
    unittest.main()
