"""Wrong cards of elements of second order: one message with its line, exit status 1, no result."""

import re
import unittest

import numpy as np
from program import Run

from studies.extremes.type_scenes import standing  # found through program
from studies.solid_meshes import KINDS, SolidMesh

SECOND = ("C3D10", "C3D15", "C3D20", "C3D20R")
FACES = {"C3D10": 4, "C3D15": 5, "C3D20": 6, "C3D20R": 6}


class Deck:
    """The cards of a box on a plane, whose elements and nodes are changed."""

    def __init__(self, kind):
        grid = np.arange(3) / 2
        self.kind, self.mesh = kind, SolidMesh("B", kind, (grid,) * 3)
        right = self.mesh.cards()
        text = standing(kind)
        assert text.startswith(right)
        self.rest = text[len(right):]
        self.corners = self.mesh.corners

    def text(self):
        return self.mesh.cards() + self.rest

    def along(self, place, element=2):
        """Put the last mid-side node of an element at a place of its edge, from 0 to 1."""
        row = self.mesh.elements[element]
        a, b = KINDS[self.kind][1][-1]
        x = self.mesh.x
        x[row[-1]] = x[row[a]] + place * (x[row[b]] - x[row[a]])
        return row[-1] + 1

    def reordered(self, order):
        """Give the nodes of all elements in another order."""
        self.mesh.elements = self.mesh.elements[:, order]


class WrongMiddles(unittest.TestCase):
    def refused(self, text, words):
        run = Run(text, name="wrong")
        self.assertEqual(run.status, 1, run.output + run.errors)
        first = run.errors.splitlines()[0]
        self.assertRegex(first, r"^\S*wrong\.inp:\d+:\d+: error: ")
        self.assertRegex(first, words)
        self.assertFalse(run.file.exists())

    def test_middles_at_quarters_and_beyond(self):
        for kind in SECOND:
            for place in (0.25, 0.2499, 0.7501, 0.1, 0.0, -0.5, 1.5):
                with self.subTest(kind=kind, place=place):
                    deck = Deck(kind)
                    node = deck.along(place)
                    self.refused(deck.text(), rf"; node {node} is .* edges from the middle of the")

    def test_orders_of_other_programs(self):
        """Gmsh exchanges the last two nodes of tetrahedra; others have vertical edges first."""
        for kind, order in (
            ("C3D10", [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]),
            ("C3D15", [*range(9), 12, 13, 14, 9, 10, 11]),
            ("C3D20", [*range(12), 16, 17, 18, 19, 12, 13, 14, 15]),
            ("C3D20R", [*range(8), 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14]),
        ):
            with self.subTest(kind=kind):
                deck = Deck(kind)
                deck.reordered(order)
                self.refused(deck.text(), "wrong order of its mid-side nodes")

    def test_corners_do_not_blame_middles(self):
        for kind in SECOND:
            with self.subTest(kind=kind):
                deck = Deck(kind)
                row = deck.mesh.elements[2]
                corners = deck.mesh.x[row[:deck.corners]]
                middle = corners.mean(axis=0)
                deck.mesh.x[row[0]] = middle + 0.6 * (middle - corners[0])
                for a, b in KINDS[kind][1]:
                    for one in deck.mesh.elements:
                        at = KINDS[kind][1].index((a, b)) + deck.corners
                        deck.mesh.x[one[at]] = (deck.mesh.x[one[a]] + deck.mesh.x[one[b]]) / 2
                self.refused(deck.text(), r"Jacobian .*-[\d.e-]+(\): wrong order of its nodes\?)?$")

    def test_cards(self):
        """Counts of nodes, ids, numbers that are none, faces."""
        for kind in SECOND:
            text, n = Deck(kind).text(), len(Deck(kind).mesh.elements[0])
            element = re.search(rf"\*ELEMENT, TYPE={kind}, ELSET=B\n((?:1, [^*]*?))\n2, ", text)[1]
            node = re.search(r"\n9, [^\n]*", text)[0]
            words = [word.strip() for word in element.replace("\n", " ").split(",")]

            def with_element(*new, text=text, element=element):
                lines = [", ".join(new[k : k + 15]) for k in range(0, len(new), 15)]
                return text.replace(element, ",\n".join(lines), 1)

            surface = "*SURFACE, NAME=B-Z0-F, TYPE=ELEMENT\n"
            for name, changed, message in (
                ("few", with_element(*words[:-1]), f"has an id and {n} nodes"),
                ("many", with_element(*words, "7"), f"has an id and {n} nodes"),
                ("twice", with_element(*words[:-1], words[1]), "names node .* twice"),
                ("absent", with_element(*words[:-1], "99999"), "99999, which is not defined"),
                ("id", with_element("2", *words[1:]), "duplicate element 2"),
                ("nan", text.replace(node, "\n9, NaN, 0., 0.", 1), "must be finite"),
                ("inf", text.replace(node, "\n9, 0., -Inf, 0.", 1), "must be finite"),
                ("huge", text.replace(node, "\n9, 0., 1e400, 0.", 1), "too large"),
                ("face", text.replace(surface, f"{surface}1, S{FACES[kind] + 1}\n", 1),
                 "no face|expected a face"),
                ("type", text.replace(f"TYPE={kind}", f"TYPE={kind}X", 1), "not available"),
            ):
                with self.subTest(kind=kind, name=name):
                    self.assertNotEqual(changed, text)
                    self.refused(changed, message)


if __name__ == "__main__":
    unittest.main()
