"""The study of public decks: cards, families, sources, comparison; the page is of the rows kept."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

from study import PROGRAM, ROOT, need

need("h5py", "matplotlib")

import numpy as np  # noqa: E402

from studies import public_deck_page as pages  # noqa: E402
from studies import public_deck_text as text  # noqa: E402
from studies import public_decks  # noqa: E402
from studies.pages import StudyError  # noqa: E402

# Two cubes of one element each, the upper one pressed down; no deck of the collection.
MESH = """\
** two cubes
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
9, 0., 0., 1.
10, 1., 0., 1.
11, 1., 1., 1.
12, 0., 1., 1.
13, 0., 0., 2.
14, 1., 0., 2.
15, 1., 1., 2.
16, 0., 1., 2.
*ELEMENT, TYPE=C3D8, ELSET=BOTH
1, 1, 2, 3, 4, 5, 6, 7, 8
2, 9, 10, 11, 12, 13, 14, 15, 16
*NSET, NSET=FOOT
1, 2, 3, 4
*NSET, NSET=HEAD
13, 14, 15, 16
"""
DECK = """\
*HEADING
{title}
*INCLUDE, INPUT={mesh}
*SURFACE, NAME=LOW
1, S2
*SURFACE, NAME=HIGH
2, S1
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=BOTH, MATERIAL=M
*CONTACT PAIR, INTERACTION=I{kind}
HIGH, LOW
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
{stiffness}
*FRICTION
0.2, {slope}
*BOUNDARY
FOOT, 1, 3
*STEP
*STATIC
1., 1.
*BOUNDARY
HEAD, 1, 2
HEAD, 3, 3, -0.1
*NODE PRINT, NSET=HEAD
RF
*END STEP
"""
PLAIN = {"title": "a", "mesh": "cubes.msh", "kind": ", TYPE=NODE TO SURFACE", "stiffness": "1e5",
         "slope": "1e4"}


class PublicDecks(unittest.TestCase):
    """Decks of our own in a folder like the collection's."""

    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = Path(place.name)
        (self.folder / "cubes.msh").write_text(MESH)

    def put(self, name, **changes):
        """Write a deck, its mesh beside it; return its path."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        (path.parent / "cubes.msh").write_text(MESH)
        path.write_text(DECK.format(**{**PLAIN, **changes}))
        return path

    def test_families_differ_in_more_than_the_type_of_contact(self):
        plain = text.family_key(text.read_cards(self.put("a.inp")))
        held = self.put("held.inp")
        (self.folder / "foot.bou").write_text("** by a tool\nFOOT, 1, 3\n")
        held.write_text(held.read_text().replace("FOOT, 1, 3", "*INCLUDE, INPUT=foot.bou", 1))
        self.assertEqual(text.family_key(text.read_cards(held)), plain)
        alike = {"title": "another", "kind": ",TYPE=MORTAR", "stiffness": "3e7", "slope": "2."}
        for name, value in alike.items():
            self.assertEqual(text.family_key(text.read_cards(self.put("b.inp", **{name: value}))),
                             plain, name)
        self.put("b.inp")
        other = (self.folder / "b.inp").read_text()
        for old, new in (("0.2,", "0.3,"), ("-0.1", "-0.2"), ("1000.", "1001.")):
            (self.folder / "b.inp").write_text(other.replace(old, new))
            self.assertNotEqual(text.family_key(text.read_cards(self.folder / "b.inp")), plain)

    def test_sources_are_the_first_folders(self):
        for name, source in (("yahoo/a.inp", "users"), ("ccx/test/a.inp", "tests of CalculiX"),
                             ("launcher/x/a.inp", "examples of tools"), ("a.inp", "users")):
            self.assertEqual(text.source_of(self.put(name), self.folder), source)
        self.assertEqual([path.name for path in text.decks_in(self.folder)], ["a.inp"] * 4)

    def test_a_card_may_take_several_lines(self):
        path = self.put("a.inp", kind=",\n  TYPE=MORTAR")
        pair = next(c for c in text.read_cards(path) if c.keyword == "CONTACTPAIR")
        self.assertEqual(pair.option("TYPE"), "MORTAR")
        self.assertEqual(pair.data, ["HIGH, LOW"])

    def test_variants_change_contact_alone(self):
        cards = text.read_cards(self.put("a.inp"))
        lines = text.for_calculix(cards, "face stiffness=10 slope=100").splitlines()
        plain = text.for_calculix(cards).splitlines()
        new = [line for line in lines if line not in plain]
        self.assertEqual(new, ["*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE", "1e+06",
                               "0.2, 1e+06"])
        swapped = text.for_bipot(cards, "swap stiffness=10").splitlines()
        new = [line for line in swapped if line not in text.for_bipot(cards).splitlines()]
        self.assertEqual(new, [" LOW,HIGH"])
        path = self.put("b.inp")
        path.write_text(path.read_text().replace("FOOT, 1, 3", "FOOT, 1, 6\nHEAD, 6, 6").replace(
            "OVERCLOSURE=LINEAR", "OVERCLOSURE=TIED").replace("*FRICTION\n0.2, 1e4\n", ""))
        lines = text.for_calculix(text.read_cards(path), "slope=2 translations").splitlines()
        self.assertIn("FOOT, 1, 3", lines)
        self.assertNotIn("HEAD, 6, 6", lines)
        self.assertEqual(lines[lines.index("*FRICTION") + 1], "1, 200000")
        self.assertIn("*NSET, NSET=PUBLICALL", plain)
        self.assertNotIn("*NODE PRINT, NSET=HEAD", plain)

    def test_refusals_are_grouped_without_names_and_numbers(self):
        for message, group in (
            ("a.inp:3:1: error: *BUCKLE: bipot solves static frictional contact of elastic "
             "solids", "*BUCKLE"),
            ("a.inp:7:2: error: element 20 is not defined", "element N is not defined"),
            ("a.inp:7:2: error: cannot include 'b c.inp': there is no such file",
             "cannot include '...'"),
            ("a.inp:7:2: error: unknown keyword '*I'", "unknown keyword '*I'"),
        ):
            self.assertEqual(text.refusal_of(message), group)

    def test_forces_of_the_deck_are_compared(self):
        """Against forces and displacements by hand: nu = 0, each cube loses half of 0.1."""
        cards = text.read_cards(self.put("a.inp"))
        how, _, result, message = public_decks.run_bipot(PROGRAM, cards, "", self.folder, 100.0)
        self.assertEqual((how, message), ("solved", ""))
        down = np.repeat([0.0, -0.05, -0.05, -0.1], 4)
        # The stress is 50 on an area of 1, a quarter at each corner of the supports.
        force = np.repeat([12.5, 0.0, 0.0, -12.5], 4)
        rows = np.zeros((2, 16, 4))
        rows[:, :, 0] = np.arange(1, 17)
        rows[0, :, 3], rows[1, :, 3] = down, force
        def differences(factor_of_forces=1.0, further=0.0, n=16):
            printed = {1.0: {"displacements": rows[0, :n] + [0, 0, 0, further],
                             "forces": rows[1, :n] * [1, 1, 1, factor_of_forces]}}
            row = public_decks.Row("a.inp")
            public_decks.compare(result, printed, row)
            self.assertEqual(row.compared, 1)
            return row.contact, row.supports, row.displacement
        with result:
            np.testing.assert_allclose(differences(), 0, atol=1e-9)
            np.testing.assert_allclose(differences(1.1), [0.1, 0.1, 0], atol=1e-9)
            np.testing.assert_allclose(differences(1, 0.01), [0, 0, 0.1], atol=1e-9)
            # A node of the upper cube is not printed: the forces of the lower one are compared.
            np.testing.assert_allclose(differences(1.1, 0, 15), [0.1, 0.1, 0], atol=1e-9)
            np.testing.assert_array_equal(np.isnan(differences(1, 0, 7)), [True, True, False])

    def test_what_calculix_prints_is_read(self):
        path = self.folder / "a.dat"
        path.write_text(
            "\n displacements (vx,vy,vz) for set ALL and time  0.1000000E+01\n\n"
            "         1  1.000000E+00  2.000000E+00  3.000000E+00\n"
            "\n forces (fx,fy,fz) for set ALL and time  0.1000000E+01\n\n"
            "         1  4.000000E+00  5.000000E+00 -6.000000E+00\n"
        )
        found = public_decks.read_printed(path)
        np.testing.assert_array_equal(found[1.0]["displacements"], [[1, 1, 2, 3]])
        np.testing.assert_array_equal(found[1.0]["forces"], [[1, 4, 5, -6]])
        self.assertEqual(public_decks.read_printed(self.folder / "none.dat"), {})

    def test_a_folder_is_checked_and_its_rows_are_kept(self):
        self.put("yahoo/good.inp")
        self.put("yahoo/bad.inp", slope="1e4\n*DYNAMIC")
        rows = {}
        options = SimpleNamespace(only="", variant="", check=True, limit=10.0,
                                  csv=self.folder / "rows.csv")
        public_decks.study(self.folder, PROGRAM, options, rows)
        kept = public_decks.read_rows(options.csv)
        self.assertEqual(sorted(kept), [("yahoo/bad.inp", ""), ("yahoo/good.inp", "")])
        self.assertEqual(kept["yahoo/good.inp", ""].check, "accepted")
        self.assertIn("bad.inp:", kept["yahoo/bad.inp", ""].check)


class Page(unittest.TestCase):
    """docs/studies/public-decks.md."""

    def test_the_page_is_that_of_the_rows_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / "page.md"
            subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "public_decks", "--page", "-o",
                 page], check=True, capture_output=True,
            )
            made = page.read_text(encoding="utf-8").splitlines()
        # The third line names the machine.
        kept = public_decks.PAGE.read_text(encoding="utf-8").splitlines()
        self.assertEqual(made[:2] + made[3:], kept[:2] + kept[3:])

    def test_a_difference_that_nothing_explains_stops_the_page(self):
        rows = public_decks.read_rows()
        row = next(row for row in rows.values() if pages.worst(row) < pages.WITHIN)
        row.displacement = 0.5
        with self.assertRaises(StudyError):
            pages.page(rows, "a machine")


if __name__ == "__main__":
    unittest.main(verbosity=2)
