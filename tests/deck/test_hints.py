"""What a person gets wrong first is met with the hint that solves it; each hint, followed, does.

BIPOT is the program.
"""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

BIPOT = os.environ.get("BIPOT", "bipot")
TIME_LIMIT = 600  # seconds

DECK = """\
*BLOCK, NAME=B, NX=2, NY=2, NZ=2, TYPE=C3D8B
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
*STEP
*STATIC
0.5, 1.
*DSLOAD
B-ZMAX, P, 1.
*END STEP
"""
TWO = """\
*BLOCK, NAME=A, NX=4, NY=4, NZ=2
0., 0., 0., 1., 1., 1.
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0.1, 0.1, 1., 0.8, 0.8, 0.8
*ELSET, ELSET=ALL
A, B
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, A-ZMAX
*STEP
*STATIC
1., 1.
*BOUNDARY
A-ZMIN, 1, 3
*DSLOAD
B-ZMAX, P, 1.
*END STEP
"""
PLANE = "TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"


class Hints(unittest.TestCase):
    """One mistake a test."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="bipot-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def call(self, *words):
        """Run the program in the test's folder."""
        return subprocess.run(
            [BIPOT, *words], cwd=self.folder, capture_output=True, text=True, timeout=TIME_LIMIT,
            check=False,
        )

    def run_deck(self, deck, *changes, name="deck.inp"):
        """Run a deck with pieces of it replaced."""
        for old, new in changes:
            self.assertEqual(deck.count(old), 1, old)
            deck = deck.replace(old, new)
        (self.folder / name).write_text(deck)
        return self.call(name, "--overwrite")

    def refused(self, hint, deck, *changes, status=1, message="error: "):
        """Run a deck that is wrong; return what it said."""
        done = self.run_deck(deck, *changes)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.assertIn(message, done.stderr)
        self.assertIn(hint, done.stderr)
        return done.stderr

    def solved(self, deck, *changes):
        """Run a deck that is right; return what it printed."""
        done = self.run_deck(deck, *changes)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_the_decks_themselves(self):
        self.solved(DECK)
        self.solved(TWO)

    def test_a_plane_with_its_normal_flipped(self):
        for wrong, right in (
            ("0., 0., -1.", "0, 0, 1"), ("-0.6, 0., -0.8", "0.6, 0, 0.8"),
        ):
            said = self.refused(
                f"the normal of a PLANE points to the side where the body is: {right} would", DECK,
                (PLANE, f"TYPE=PLANE\n0., 0., 0., {wrong}\n"),
                message="deck.inp:13:9: error: 'B-ZMIN' lies inside the obstacle 'FLOOR'",
            )
            self.assertEqual(said.count("error:"), 1, said)
        # Also with a gap between the two.
        self.refused(
            "0, 0, 1 would", DECK, (PLANE, "TYPE=PLANE\n0., 0., -0.2, 0., 0., -1.\n")
        )

    def test_a_body_in_a_sphere_or_cylinder_or_around_one(self):
        # Side faces of the block, in a hole or around a shaft.
        inside = ("B-ZMIN, FLOOR", "SIDES, FLOOR")
        sides = ("*MATERIAL, NAME=M", "*SURFACE, NAME=SIDES\nB, S3\nB, S4\nB, S5\nB, S6\n"
                 "*MATERIAL, NAME=M")
        single = ("NX=2, NY=2, NZ=2", "NX=1, NY=1, NZ=2")
        for shape, data in (
            ("SPHERE", ".5, .5, .5, 2."), ("CYLINDER", ".5, .5, 0., 0., 0., 1., 2."),
        ):
            self.refused(
                "a body that lies inside a SPHERE or a CYLINDER needs INNER", DECK, inside,
                (PLANE, f"TYPE={shape}\n{data}\n"), sides, single,
                message="the body is on the wrong side",
            )
        self.refused(
            "INNER is for a body that lies inside; this one lies around", DECK,
            (PLANE, "TYPE=SPHERE, INNER\n.5, .5, -3., 3.\n"),
            message="the body is on the wrong side",
        )
        self.solved(DECK, (PLANE, "TYPE=SPHERE\n.5, .5, -3., 3.\n"))

    def test_bodies_on_the_right_side(self):
        """An overlap, however deep, and a tool that is still elsewhere are no mistakes."""
        held = ("*DSLOAD\nB-ZMAX, P, 1.", "*BOUNDARY\nB-ZMAX, 1, 3")
        self.solved(DECK, held, (PLANE, "TYPE=PLANE\n0., 0., 0.3, 0., 0., 1.\n"))
        self.solved(DECK, held, (PLANE, "TYPE=SPHERE\n0., 0., 15., 5.\n"))

    def test_a_load_that_pulls_away(self):
        for load in ("*DSLOAD\nB-ZMAX, P, -1.", "*CLOAD\nB-ZMAX, 3, 1."):
            self.refused(
                "they pull the body off what it touches: a pressure is positive into the body",
                DECK,
                ("*DSLOAD\nB-ZMAX, P, 1.", load), status=2,
                message="nothing balances the loads along body 1 (of node 1): translation along z",
            )
        self.refused(
            "they pull the body off what it touches", TWO, ("P, 1.", "P, -1."), status=2,
            message="nothing balances the loads along body 2",
        )

    def test_a_load_that_pulls_along(self):
        self.refused(
            "supports (*BOUNDARY), contact or friction must hold this motion", DECK,
            ("P, 1.", "P, 1.\n*CLOAD\nB-ZMAX, 1, 1."), status=2, message="nothing balances",
        )

    def test_a_result_is_no_deck(self):
        self.solved(DECK)
        done = self.call("deck.vtkhdf")
        self.assertEqual(done.returncode, 1)
        self.assertIn("deck.vtkhdf: error: this is a result, not a deck: scripts/show", done.stderr)

    def test_other_files_are_no_decks(self):
        for name, text, hint in (
            ("a.msh", "$MeshFormat\n4.1 0 8\n", "gmsh -3 -format inp"),
            ("a.xdmf", '<?xml version="1.0"?>\n<Xdmf>\n', "the .xdmf beside a result"),
            ("a.vtk", "# vtk DataFile Version 3.0\n", "a file of VTK"),
            ("a.stl", "solid die\n", "*OBSTACLE, TYPE=STL, INPUT="),
        ):
            with self.subTest(name=name):
                (self.folder / name).write_text(text)
                done = self.call(name)
                self.assertEqual(done.returncode, 1)
                self.assertIn(hint, done.stderr)

    def test_a_deck_without_its_ending(self):
        self.solved(DECK)
        for word in ("deck", "deck."):
            done = self.call(word)
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"{word}: error: there is no such file; did you mean 'deck.inp'?",
                          done.stderr)
        done = self.call("deck.inp.inp")
        self.assertTrue(done.stderr.endswith("there is no such file\n"), done.stderr)
        (self.folder / "whole.inp").write_text("*INCLUDE, INPUT=deck\n")
        self.assertIn("there is no such file; did you mean 'deck.inp'?",
                      self.call("whole.inp").stderr)

    def test_a_folder_is_no_deck(self):
        (self.folder / "decks").mkdir()
        done = self.call("decks")
        self.assertEqual(done.returncode, 1)
        self.assertIn("'decks' is a folder; name a deck", done.stderr)

    def test_an_incompressible_material(self):
        self.refused("0.499 or 0.4999, with elements of TYPE=C3D8B", DECK, ("0.3\n*S", "0.5\n*S"),
                     message="Poisson's ratio must lie between -1 and 0.5, not '0.5'")
        self.solved(DECK, ("0.3\n*S", "0.4999\n*S"))
        done = self.run_deck(DECK, ("0.3\n*S", "30.\n*S"))
        self.assertNotIn("C3D8B", done.stderr)

    def test_an_obstacle_that_stands_first(self):
        said = self.refused(
            "the surface of the body, the slave, comes first", DECK,
            ("B-ZMIN, FLOOR", "FLOOR, B-ZMIN"),
            message="deck.inp:13:1: error: 'FLOOR' is an obstacle: it can only be a master",
        )
        self.assertEqual(said.count("error:"), 1, said)

    def test_a_slave_coarser_than_its_master(self):
        note = ("contact pair B-ZMIN:A-ZMAX: the faces of the slave are larger than those of "
                "the master (edges of about 0.4 and 0.25); the finer mesh is the better slave: "
                "A-ZMAX, B-ZMIN\n")
        self.assertIn(note, self.solved(TWO))
        self.assertNotIn("better slave", self.solved(TWO, ("B-ZMIN, A-ZMAX", "A-ZMAX, B-ZMIN")))
        # A graded mesh may have larger faces far from the contact.
        finer = ("NX=4, NY=4, NZ=2", "NX=9, NY=9, NZ=2")
        graded = (
            "0., 0., 0., 1., 1., 1.", "-3., -3., 0., 7., 7., 1.\nX, 60., MIDDLE\nY, 60., MIDDLE",
        )
        self.assertIn("better slave", self.solved(TWO, finer, graded))

    def test_a_coarse_slave_in_a_plane(self):
        """Edges are those in the plane, however thick its slices are."""
        def strip(low, first, elements, along):
            nodes = "".join(
                f"{first + 2 * i + k}, {i * along}, {low + k}\n" for i in range(elements + 1)
                for k in (0, 1)
            )
            quads = "".join(
                f"{first + i}, {first + 2 * i}, {first + 2 * i + 2}, {first + 2 * i + 3}, "
                f"{first + 2 * i + 1}\n" for i in range(elements)
            )
            return f"*NODE, NSET=N{first}\n{nodes}*ELEMENT, TYPE=CPE4, ELSET=E{first}\n{quads}"

        deck = "*HEADING\nPlane\n" + strip(0, 1, 4, 0.25) + strip(1, 101, 2, 0.5) + (
            "*SURFACE, NAME=ABOVE\nE101, S1\n*SURFACE, NAME=BELOW\nE1, S3\n"
            "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
            "*SOLID SECTION, ELSET=E1, MATERIAL=M\n0.001\n"
            "*SOLID SECTION, ELSET=E101, MATERIAL=M\n0.001\n"
            "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\nABOVE, BELOW\n"
            "*NSET, NSET=LOW, GENERATE\n1, 9, 2\n*NSET, NSET=HIGH, GENERATE\n102, 106, 2\n"
            "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nLOW, 1, 2\nHIGH, 1\nHIGH, 2, 2, -0.001\n"
            "*END STEP\n"
        )
        self.assertIn("(edges of about 0.5 and 0.25)", self.solved(deck))

    def test_faces_between_two_elements(self):
        """Wrong numbers of faces: all are refused, some are noted; the right ones say nothing."""
        lower = ("*SURFACE INTERACTION", "*SURFACE, NAME=FOOT\n" + "".join(
            f"{e}, S1\n" for e in range(33, 37)) + "*SURFACE INTERACTION")
        pair = ("B-ZMIN, A-ZMAX", "FOOT, A-ZMAX")
        hint = "where nothing can touch: check their numbers (S1 to S6)"
        done = self.run_deck(TWO, lower, pair)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("between two elements", done.stdout)
        some = (lower[0], lower[1].replace("36, S1", "36, S1\n36, S2"))
        done = self.run_deck(TWO, some, pair)
        self.assertIn(f"1 face of FOOT between two elements, {hint}", done.stdout)
        self.refused(hint, TWO, (lower[0], lower[1].replace("S1", "S2")), pair)

    def test_elements_that_are_not_available(self):
        mesh = "*NODE\n1, 0., 0., 0.\n*ELEMENT, TYPE={}, ELSET=T\n1, 1\n" + DECK
        for kind, hint in (
            ("C3D10T", "C3D10 computes displacements"),
            ("C3D27", "C3D20 from Gmsh: Mesh.SecondOrderIncomplete=1"),
            ("C3D14", "C3D13 from Gmsh: Mesh.SecondOrderIncomplete=1"),
            ("C3D8Q", "did you mean C3D8?"),
        ):
            with self.subTest(kind=kind):
                self.refused(hint, mesh.format(kind),
                             message=f"element type '{kind}' is not available")

    def test_wedges_and_pyramids_with_nodes_within_faces(self):
        """As Gmsh writes them: called C3D6 and C3D5, 16 numbers a line."""
        nodes = "".join(f"{i}, 0., 0., {i}.\n" for i in range(1, 19))
        first = ", ".join(map(str, [1, *range(1, 16)]))
        for kind, instead, n, lines in (
            ("C3D6", "C3D15", 6, f"{first},\n16, 17, 18"), ("C3D5", "C3D13", 5, first[:-4]),
        ):
            mesh = f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=T\n{lines}\n" + DECK
            self.refused(f"{instead} from Gmsh: Mesh.SecondOrderIncomplete=1", mesh,
                         message=f"an id and {n} nodes")


if __name__ == "__main__":
    unittest.main()
