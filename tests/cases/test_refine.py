"""A deck whose elements are cut into eight means what it meant before, on a finer mesh."""

import subprocess
import unittest

import numpy as np
from program import INPUT, PROGRAM, Run
from two_bodies import solved

from studies.deck_cards import block, deck, pair, step
from studies.meshes import Mesh, in_lines

ELASTIC = "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*EXPANSION\n1e-3\n*DENSITY\n0.5\n"
SECTION = "*SOLID SECTION, ELSET=BODY, MATERIAL=M\n"


def body(n, *, element="C3D8", place=None):
    """Return the cards of a body of 2n by n by 2n elements, and its mesh.

    Its sides are surfaces and sets of nodes; BODY-CAP and BODY-FLANK the elements on two of them.
    """
    mesh = Mesh("BODY")
    mesh.grid((2 * n, n, 2 * n), place or (lambda a, b, c: (2 * a, b, 2 * c)),
              TOP="k+", SOLE="k-", LEFT="i-", RIGHT="i+", FRONT="j-", BACK="j+")  # fmt: skip
    cards = f"*PARAMETER\nelement = {element}\n" + mesh.cards(
        ALL=lambda x, y, z: True, EDGE=lambda x, y, z: x == 0 and z == 2
    )
    for name, surface in (("CAP", "TOP"), ("FLANK", "RIGHT")):
        numbers = sorted({element for element, _ in mesh.surfaces[surface]})
        cards += "\n".join([f"*ELSET, ELSET=BODY-{name}", *in_lines(numbers)]) + "\n"
    return cards + ELASTIC + SECTION, mesh


def by_place(result, name="displacement", row=-1):
    """Return places and values of a field of nodes, in the order of the places."""
    used = np.unique(result.elements)  # the others have no place that says which they are
    order = used[np.lexsort(np.round(result.points[used], 9).T)]
    return result.points[order], result.field(name, row)[order]


class SameScene(unittest.TestCase):
    """A coarse deck refined is the deck that was written with the finer mesh."""

    def assert_same(self, one, other, row=-1, tolerance=1e-8):
        (places, found), (expected_places, expected) = by_place(one, row=row), by_place(other,
                                                                                        row=row)
        self.assertGreater(np.abs(expected).max(), 0)
        np.testing.assert_allclose(places, expected_places, atol=1e-12)
        np.testing.assert_allclose(found, expected, atol=tolerance * np.abs(expected).max())
        for pair_of_one, pair_of_other in zip(one.pairs.values(), other.pairs.values(),
                                              strict=True):
            size = np.abs(pair_of_other.resultant[row]).max()
            np.testing.assert_allclose(pair_of_one.resultant[row], pair_of_other.resultant[row],
                                       atol=tolerance * size)  # fmt: skip

    def compare(self, text):
        """Solve the deck of the coarse mesh refined, and that of the fine mesh."""
        coarse, fine = solved(self, text(1), "--refine", "1"), solved(self, text(2))
        self.assert_same(coarse, fine)
        return coarse, fine

    def test_the_block_of_the_paper(self):
        """A block of n elements refined is the one of 2 n, in every increment; twice, of 4 n."""
        runs = (Run(INPUT / "block.inp", n=4, steps=10),
                Run(INPUT / "block.inp", "--refine", "1", n=2, steps=10),
                Run(INPUT / "block.inp", "--refine", "2", n=1, steps=10))  # fmt: skip
        results = []
        for run in runs:
            self.assertEqual(run.status, 0, run.errors)
            results.append(run.result())
            self.addCleanup(results[-1].close)
        for row in range(10):
            self.assert_same(results[1], results[0], row)
            self.assert_same(results[2], results[0], row)
        self.assertEqual(results[2].run_text("overrides").split("\n")[-1], "--refine 2")
        self.assertIn("refined 2 times: the 1 elements of the deck are 64, its 8 nodes 125",
                      runs[2].output)  # fmt: skip

    def test_loads_of_faces_and_weight(self):
        """Pressure on faces of sets of elements, of surfaces, of sets of nodes; weight."""
        def text(n):
            cards, _ = body(n)
            loads = ("*DLOAD\nBODY-CAP, P2, 3.\nBODY-FLANK, P4, 1.\nBODY, GRAV, 9., 0., 0., -1."
                     "\n*DSLOAD\nBODY-TOP, P, 2.\n*END STEP")  # fmt: skip
            steps = step("BODY-LEFT, 1\nBODY-FRONT, 2").replace("*END STEP", loads)
            ground = "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
            return deck(cards, ground, pair("BODY-SOLE, GROUND", 0.2), steps)

        self.compare(text)

    def test_bodies_ties_and_gaps_of_formulas(self):
        def text(n):
            cards, _ = body(n)
            base = block("BASE", (2 * n, 2 * n, n), (-1, -1, -1), (4, 3, 1), 500.0)
            lid = block("LID", (3 * n, n, n), (0, 0, 2), (2, 1, 0.5), 2000.0)
            return deck(
                cards, base, lid, "*TIE, NAME=T\nLID-ZMIN, BODY-TOP\n",
                pair("BODY-SOLE, BASE-ZMAX", 0.3),
                "*CONTACT GAP, PARABOLA\nBODY-SOLE, 1., 0.5, 0., 300.\n",
                step("LID-ZMAX, 3, 3, -0.02\nLID-ZMAX, 1, 1, 0.003"),
                held="BASE-ZMIN, 1, 3\nLID-ZMAX, 2",
            )  # fmt: skip

        self.compare(text)

    def test_gaps_of_single_nodes_are_bilinear(self):
        """What the deck says of its nodes holds between them as the mesh does."""
        def text(n):
            cards, mesh = body(n)
            # Linear over the sole, so that the finer deck has the same gaps between.
            nodes = sorted(mesh.of_surface["SOLE"])
            gaps = "".join(
                f"{node}, {0.01 * (1 + x + y)!r}\n" for node in nodes
                for x, y, _ in [mesh.nodes[node - 1]]
            )  # fmt: skip
            ground = "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
            return deck(cards, ground, pair("BODY-SOLE, GROUND"), f"*CONTACT GAP\n{gaps}",
                        step("BODY-TOP, 1, 2\nBODY-TOP, 3, 3, -0.05"))  # fmt: skip

        coarse, fine = self.compare(text)
        order = [np.lexsort(of.pairs[0].coordinates.T) for of in (coarse, fine)]
        gaps = [of.pairs[0].gap[-1][at] for of, at in zip((coarse, fine), order, strict=True)]
        np.testing.assert_allclose(*gaps, atol=1e-10)

    def test_temperatures_are_linear_between_the_nodes_of_the_deck(self):
        def text(n):
            cards, mesh = body(n)
            warm = "".join(f"{1 + i}, {50 * z + 20 * x!r}\n"
                           for i, (x, _, z) in enumerate(mesh.nodes))  # fmt: skip
            amplitude = "*AMPLITUDE, NAME=A\n0., 0., 1., 0.8\n"
            steps = step("BODY-EDGE, 1, 3").replace(
                "*END STEP", f"*TEMPERATURE, AMPLITUDE=A\n{warm}*END STEP"
            )
            return deck(cards, amplitude, steps)

        self.compare(text)

    def test_equations_and_couplings(self):
        """A periodic strip, its sides node by node; a face that goes with a node.

        Sets go together by the numbers of their nodes, in whatever order the deck defines them.
        """
        def text(n):
            cards, _ = body(n)
            nodes = cards.split("*NODE\n")[1].split("*ELEMENT")[0]
            lines = nodes.splitlines(keepends=True)
            cards = cards.replace(nodes, "".join(lines[::2] + lines[-1 - len(lines) % 2 :: -2]))
            self.assertEqual(sorted(cards.split("\n")), sorted(body(n)[0].split("\n")))
            return deck(
                cards, "*NODE\n90001, 5., 0., 1.\n90002, 1., 0.5, 4.\n",
                "*EQUATION\n3\nBODY-RIGHT, 1, 1., BODY-LEFT, 1, -1., 90001, 1, -1.\n"
                "*EQUATION\n2\nBODY-RIGHT, 2, 1., BODY-LEFT, 2, -1.\n",
                "*COUPLING, REF NODE=90002, SURFACE=BODY-TOP\n*DISTRIBUTING\n",
                step("BODY-SOLE, 3\n90001, 1, 1, 0.01\nBODY-EDGE, 1, 2").replace(
                    "*END STEP", "*CLOAD\n90002, 3, -5.\n*END STEP"),
            )  # fmt: skip

        self.compare(text)

    def test_local_directions(self):
        """Rollers on a slope, an edge that is held."""
        def text(n):
            cards, _ = body(n)
            return deck(cards, "*TRANSFORM, NSET=BODY-BACK\n1., 2., 0., -2., 1., 0.\n",
                        step("BODY-SOLE, 3\nBODY-TOP, 3, 3, -0.1"),
                        held="BODY-BACK, 2\nBODY-EDGE, 1")  # fmt: skip

        self.compare(text)


class Meaning(unittest.TestCase):
    """What stays with the deck's nodes, and what stays as it is."""

    def test_forces_and_tables_stay_with_the_nodes_of_the_deck(self):
        """A force on each node of a set is no more of it; the table has the deck's nodes."""
        cards, mesh = body(1)
        text = deck(cards, step("BODY-SOLE, 1, 3").replace(
            "*END STEP", "*CLOAD\nBODY-TOP, 3, -2.\n*NODE PRINT, NSET=BODY-TOP\nU\n*END STEP"))
        told = "forces of *CLOAD stay on the nodes of the deck: near them displacements"
        self.assertNotIn(told, Run(text, name="forces").output)
        run = Run(text, "--refine", "2", name="forces")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn(told, run.output)
        with run.result() as result:
            supports = result.field("reaction_force", -1).sum(axis=0)
            np.testing.assert_allclose(
                supports, [0, 0, 2 * len(mesh.of_surface["TOP"])], atol=1e-9
            )
        table = (run.folder / "forces.node.csv").read_text().splitlines()
        self.assertEqual(len([line for line in table if line[:1].isdigit()]),
                         len(mesh.of_surface["TOP"]))  # fmt: skip

    def test_the_patch_test_holds(self):
        """Distorted elements of each type, under a pressure: uniform, whatever the refinement."""
        for element in ("C3D8", "C3D8I", "C3D8B"):
            with self.subTest(element=element):
                run = Run(INPUT / "patch.inp", "--refine", "1", element=element)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    stress = result.field("stress", -1, on="elements")
                    np.testing.assert_allclose(stress, np.broadcast_to(stress[0], stress.shape),
                                               atol=1e-10 * np.abs(stress).max())

    def test_ids_of_pieces_tell_whose_they_are(self):
        """The pieces of element i are 8 (i - 1) + 1 to 8 i; the deck's nodes keep their numbers."""
        cards, mesh = body(1)
        result = solved(self, deck(cards, step("BODY-SOLE, 1, 3\nBODY-TOP, 3, 3, -0.1")),
                        "--refine", "1")  # fmt: skip
        ids = result.element_ids
        self.assertEqual(sorted(ids), list(range(1, 8 * len(mesh.elements) + 1)))
        middle = result.points[result.elements].mean(axis=1)
        for element, corners in enumerate(mesh.elements):
            centre = np.mean([mesh.nodes[node - 1] for node in corners], axis=0)
            pieces = np.isin(ids, range(8 * element + 1, 8 * element + 9))
            np.testing.assert_allclose(middle[pieces].mean(axis=0), centre, atol=1e-12)
        kept = [result.node(number) for number in range(1, len(mesh.nodes) + 1)]
        np.testing.assert_allclose(result.points[kept], mesh.nodes, atol=1e-12)

    def test_a_result_of_another_refinement_is_not_replaced(self):
        run = Run(INPUT / "block.inp", "--refine", "1", n=1, steps=5)
        self.assertEqual(run.status, 0, run.errors)
        command = [PROGRAM, str(run.deck), "--set", "n=1", "--set", "steps=5"]
        for options, status in (([], 1), (["--refine", "2"], 1), (["--refine", "1"], 0)):
            again = subprocess.run([*command, *options], cwd=run.folder, capture_output=True,
                                   text=True, timeout=600, check=False)  # fmt: skip
            self.assertEqual(again.returncode, status, again.stderr)
            self.assertEqual("--refine 1" in again.stderr, status == 1, again.stderr)


class Refused(unittest.TestCase):
    def test_numbers_that_are_none(self):
        for value in ("-1", "7", "1.5", "twice"):
            with self.subTest(value=value):
                run = Run(INPUT / "block.inp", "--refine", value)
                self.assertEqual(run.status, 1)
                self.assertEqual(run.errors, "bipot: error: --refine must be a whole number from "
                                 f"0 to 6, not '{value}'\n")  # fmt: skip

    def test_more_than_there_is_room_for(self):
        """At once, in words, and not after minutes."""
        run = Run(INPUT / "block.inp", "--refine", "6", "--plan", n=12)
        self.assertEqual(run.status, 1)
        self.assertIn("the mesh cannot be refined", run.errors)
        self.assertEqual(run.errors.count("\n"), 1)

    def test_ids_that_leave_no_room(self):
        text = (INPUT / "patch.inp").read_text()
        run = Run(text.replace("*STEP", "*NODE\n2147483647, 0., 0., 0.\n*STEP", 1), "--refine", "1",
                  name="high")  # fmt: skip
        self.assertEqual(run.status, 1)
        self.assertIn("ids are too high", run.errors)

    def test_a_flat_deck_is_the_one_that_was_written(self):
        run = Run(INPUT / "block.inp", "--flat", "--refine", "1")
        self.assertEqual(run.status, 1)
        self.assertIn("--flat", run.errors)


if __name__ == "__main__":
    unittest.main()
