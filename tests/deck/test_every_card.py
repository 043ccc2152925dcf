"""docs/deck keeps its word: what its entries do not name is a mistake, for every keyword they name.

Each card has an entry, a table with its first line: the options that it has, and those that are
ignored. docs/deck.md lists all entries.
DECK has every one of these keywords (the test fails where it lacks one). Each of its data lines
gets a field too many, each card an option that it does not have, each card without data a data
line; every time the mistake must be told with file and line. Words that could be options are those
of the page, those that stand in quotes in the deck reader, and some of Abaqus and CalculiX.

BIPOT is the program, BIPOT_SOURCE the repository.
"""

import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from deck_server import DeckServer

BIPOT = os.environ.get("BIPOT", "bipot")
SOURCE = pathlib.Path(os.environ.get("BIPOT_SOURCE", pathlib.Path(__file__).resolve().parents[2]))
INDEX = (SOURCE / "docs" / "deck.md").read_text(encoding="utf-8")
PAGES = {path.name: path.read_text(encoding="utf-8")
         for path in sorted((SOURCE / "docs" / "deck").glob("*.md"))}
ENTRY = re.compile(r"^\| `\*([A-Z -]+)` \| (.*) \|\n\|---\|---\|\n((?:\|.*\n)+)", re.MULTILINE)
READER = "".join(path.read_text() for path in sorted((SOURCE / "src" / "deck").rglob("*.f90")))
TIME_LIMIT = 20  # seconds

# Every keyword, every data line of which has all the fields that it can have.
DECK = """\
*HEADING
A title
*PARAMETER
n = 1
*UNITS
N, mm
*INCLUDE, INPUT=more.inp
*NODE, NSET=LOWER
101, 0., 0., 0.
102, 1., 0., 0.
103, 1., 1., 0.
104, 0., 1., 0.
*NODE
105, 0., 0., 1.
106, 1., 0., 1.
107, 1., 1., 1.
108, 0., 1., 1.
900, 0., 0., -1.
901, 0., 0., -2.
902, 1., 0., -2.
903, 0., 1., -2.
904, 0., 0., 3.
905, 0., 0., 3.
906, 0., 0., 3.
907, 0., 0., 3.
908, 5., 0., 3.
909, 6., 0., 3.
910, 7., 0., 3.
*SYSTEM
0., 0., 0., 1., 0., 0.
*NGEN, NSET=ROW
904, 908, 4
*NFILL
ROW, ROW, 1, 1
*NSET, NSET=EIGHT, GENERATE
101, 108
*NCOPY, CHANGE NUMBER=20, OLD SET=EIGHT, SHIFT
0., 0., 9.
*ELEMENT, TYPE=C3D8, ELSET=CUBE
101, 101, 102, 103, 104, 105, 106, 107, 108
*PLANE ELEMENTS, TYPE=CAX
*ELGEN
101, 1, 1, 1, 1, 1, 1, 1, 1, 1
*ELCOPY, OLD SET=CUBE, ELEMENT SHIFT=20, SHIFT NODES=20, NEW SET=CUBE
*ELEMENT, TYPE=R3D3, ELSET=PLATE
901, 901, 902, 903
*PART, NAME=PLOT
*NODE
1, 0., 0., 9.
*END PART
*ASSEMBLY, NAME=WHOLE
*INSTANCE, NAME=PLOT-1, PART=PLOT
1., 0., 0.
0., 0., 0., 0., 0., 1., 90.
*END INSTANCE
*END ASSEMBLY
*BLOCK, NAME=BODY, NX=<n>, NY=1, NZ=2
1., 0., 0., 1., 1., 1.
Z, 2., MIDDLE
*NSET, NSET=UPPER, GENERATE
105, 108, 1
*NSET, NSET=SOME
101, 102
*NSET, NSET=EDGE
105, 108
*ELSET, ELSET=ALL
CUBE, BODY
*REFINE, ELSET=CUBE, TIMES=1
*REFINE
0., 0., 1., 0.1
*SURFACE, NAME=FOOT
CUBE, S1
*SURFACE, NAME=SIDE
CUBE, S4
*SURFACE, NAME=TIP, TYPE=NODE
UPPER, 1.
*MATERIAL, NAME=STEEL
*ELASTIC
1000., 0.3, 20.
*DENSITY
1., 20.
*DAMPING, ALPHA=1., BETA=0.1
*EXPANSION
1e-5, 20.
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
100., 0.01, 20.
*MATERIAL, NAME=FOAM
*HYPERFOAM, N=1
100., -2., 0.25, 20.
*MATERIAL, NAME=WOOD
*ELASTIC, TYPE=ENGINEERING CONSTANTS
1000., 900., 800., 0.1, 0.1, 0.1, 300., 300.,
300., 20.
*DENSITY
1., 20.
*ORIENTATION, NAME=GRAIN
1., 1., 0., -1., 1., 0., 0., 0., 0.
3, 20.
*SOLID SECTION, ELSET=CUBE, MATERIAL=WOOD, ORIENTATION=GRAIN
1.
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
1.
*OBSTACLE, NAME=GROUND, TYPE=PLANE, REF NODE=900
0., 0., 0., 0., 0., 1.
*RIGID BODY, ELSET=PLATE, REF NODE=900
*SURFACE, NAME=PLATE
PLATE, SPOS
*SURFACE INTERACTION, NAME=DRY
1.
*FRICTION
0.3, 1e5, 20., 5.
*CONTACT PAIR, INTERACTION=DRY
FOOT, GROUND
*CONTACT
*CONTACT INCLUSIONS
ONE-XMAX, TWO-XMIN
*CONTACT EXCLUSIONS
ONE-XMAX, TWO-XMIN
*CONTACT PROPERTY ASSIGNMENT
ONE-XMAX, TWO-XMIN, DRY
*TIE, NAME=JOINT, ADJUST=YES, POSITION TOLERANCE=0.1
SIDE, BODY-XMIN
*EQUATION
4
904, 1, 1., 101, 1, -1., 102, 1, -1., 103, 1, -1.
*ELEMENT, TYPE=SPRING2, ELSET=SPRUNG
991, 904, 105
*SPRING, ELSET=SPRUNG
1, 1
1000., 0., 20.
*ELEMENT, TYPE=GAPUNI, ELSET=STOPPED
992, 904, 106
*GAP, ELSET=STOPPED
0.1, 0., 0., 1.
*FOUNDATION
CUBE, F2, 5.
*BLOCK, NAME=ONE, NX=1, NY=1, NZ=1
5., 0., 0., 1., 1., 1.
*BLOCK, NAME=TWO, NX=1, NY=1, NZ=1
7., 0., 0., 1., 1., 1.
*BLOCK, NAME=THREE, NX=1, NY=1, NZ=1
9., 0., 0., 1., 1., 1.
*SOLID SECTION, ELSET=THREE, MATERIAL=STEEL
*TIE, NAME=SIDES, CYCLIC SYMMETRY
THREE-XMIN, THREE-YMIN
*CYCLIC SYMMETRY MODEL, N=4, TIE=SIDES
9., 0., 0., 9., 0., 1.
*SOLID SECTION, ELSET=ONE, MATERIAL=STEEL
*SOLID SECTION, ELSET=TWO, MATERIAL=STEEL
*ELEMENT, TYPE=DCOUP3D, ELSET=HANDLE
990, 910
*KINEMATIC COUPLING, REF NODE=908
ONE-ZMIN, 1, 3
*MPC
BEAM, ONE-ZMAX, 909
*DISTRIBUTING COUPLING, ELSET=HANDLE
TWO-ZMAX, 1.
*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=905, SURFACE=EDGE
*KINEMATIC
2, 3
*COUPLING, CONSTRAINT NAME=MEAN, REF NODE=906, SURFACE=FOOT
*DISTRIBUTING
1, 6
*SURFACE, NAME=CUT
902, S2
*PRE-TENSION SECTION, SURFACE=CUT, NODE=907
0., 0., 1.
*TRANSFORM, NSET=SOME, TYPE=R
1., 0., 0., 0., 1., 0.
*CONTACT GAP
FOOTNODES, 0.01
FOOTNODES, PARABOLA, 0., 0., 0., 50.
*CLEARANCE, SLAVE=FOOT, MASTER=GROUND, VALUE=0.01
*CONTACT SOLVER, TOLERANCE=1e-8
*PRECISION, FACTOR=DOUBLE
*BODY SOLVER, TYPE=FACTOR, TANGENT=KEPT
*ACCURACY, OF=DISPLACEMENT, NSET=UPPER
0.5
*AMPLITUDE, NAME=RISE
0., 0., 1., 1.
*INITIAL CONDITIONS, TYPE=TEMPERATURE
BODY, 20.
*STEP
A title of the step
*STATIC
0.5, 1., 0.1, 0.5
*BOUNDARY
BODY, 1, 3, 0.
UPPER, XSYMM
900, 1, 3, 0.
*CLOAD
UPPER, 3, -1.
*DLOAD
CUBE, GRAV, 9.81, 0., 0., -1.
CUBE, P2, 1.
*DSLOAD
FOOT, P, 0.
*TEMPERATURE
BODY, 30.
*CONTACT INTERFERENCE, AMPLITUDE=RISE
FOOT, GROUND, 0.001
*CHANGE FRICTION, INTERACTION=DRY
*FRICTION
0.2, 1e5, 20., 5.
*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE
FOOT, GROUND
*NODE FILE
U, RF
*EL FILE
S, E
*CONTACT FILE
CDIS
*CONTACT PRINT
CF
*NODE PRINT, NSET=SOME
U, RF
*EL PRINT, ELSET=CUBE
S
*END STEP
"""
MORE = "*NSET, NSET=FOOTNODES\n101, 102, 103, 104\n"

PLACES = {"anywhere": "anywhere", "model": "before the first step", "step": "in a step",
          "model or first step": "before the first step, or in it"}
# Cards that DECK has not: they are checked, and change nothing, or do not go with others of it.
UNTRIED = {"SURFACE BEHAVIOR", "CHANGE SURFACE BEHAVIOR", "CONTACT INITIALIZATION DATA", "DYNAMIC"}

# Cards whose lines are titles, and those whose lines are lists of names, of any length.
TITLES = ("HEADING", "STEP")
RESULTS = ("NODE FILE", "EL FILE", "CONTACT FILE", "CONTACT PRINT", "NODE PRINT",
           "EL PRINT")
LISTS = ("NSET", "ELSET", *RESULTS)

# Options that these keywords have in Abaqus or CalculiX.
OF_USERS = "FRICTION", "MPC", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING"
ELSEWHERE = """
    INSTANCE, SYSTEM, INPUT, FILE, OFFSET, MODULI, DEPENDENCIES, ZERO, COMPOSITE, ORIENTATION,
    HCRIT, SLIP, ROUGH, USER, TAUMAX, EXPONENTIAL DECAY, ANISOTROPIC, TRACKING THICKNESS,
    EXTENSION ZONE, HEIGHT, PAD THICKNESS, CPSET, REGION TYPE, CROP, TRIM, COMBINE, FILLET
    RADIUS, REFINEMENT, LOAD CASE, FIXED, FOLLOWER, SUBMODEL, STEP, DATA SET, TIME DELAY,
    CONSTANT RESULTANT, ORIENTATION NAME, STABILIZE, FACTOR, ALLSDTOL, RIKS, LONG TERM, FULLY
    PLASTIC, EXPLICIT, TIME RESET, TOTAL TIME AT START, THERMAL, INCF, INCR, SUBCYCLING, SHELLS,
    LAYERS, EXPANSION, 2D, 3D, TOTALS, SECTION FORCES, MODE, VALUES, RIGID BODY, NODE, CYCLIC
    SYMMETRY, SMOOTH, BEGIN, RANDOM, UNITS, DISTRIBUTION, MASTER, SLAVE, FREQUENCY, POSITION,
    ADJUST
"""


def squeezed(word):
    """Return a word as the program compares and prints it."""
    return word.replace(" ", "").upper()


def printed_cards():
    """Return the program's table, by keyword."""
    text = subprocess.run([BIPOT, "--cards"], capture_output=True, text=True, check=True).stdout
    return {card["keyword"]: card for card in json.loads(text)["cards"]}


def keywords_that_are(kind):
    """Return the keywords of the program's table that are read, ignored or refused."""
    return [keyword for keyword, card in printed_cards().items() if card["is"] == kind]


def entries():
    """Return the entry of each keyword: its page, what it does, and its rows by their names."""
    found = {}
    for name, text in PAGES.items():
        for keyword, what, rows in ENTRY.findall(text):
            cells = [re.split(r"(?<!\\)\|", row)[1:3] for row in rows.splitlines()]
            found[keyword] = (name, what, {left.strip(): right.strip() for left, right in cells})
    return found


def first_line(card):
    """Return the first line of a card of the program's table, as an entry has it."""
    words = [f"*{card['keyword']}"]
    for option in card["options"]:
        value = option.get("words") or [option[key] for key in ("value",) if key in option]
        text = ", " + option["name"] + ("=" + "\\|".join(value) if value else "")
        words.append(text if option.get("required") else f"[{text}]")
    return f"`{''.join(words)}`"


def page_table():
    """Return the options of each keyword in its entry: those read, and those ignored."""
    table = {}
    for keyword, (_, _, rows) in entries().items():
        named = re.findall(r"\[?, ([A-Z0-9 -]+)", rows["first line"])
        table[keyword] = (named, re.findall(r"`([^`]+)`", rows.get("ignored with a note", "")))
    return table


def cards(deck):
    """Return keyword, line of the keyword (from 1) and lines of the data of every card."""
    found = []
    for number, line in enumerate(deck.splitlines(), 1):
        if line.startswith("*"):
            found.append((line[1:].split(",")[0], number, []))
        else:
            found[-1][2].append(number)
    return found


def mistakes_in(said):
    """Return the mistakes of a deck by line, and what is said of each."""
    mistakes = re.findall(r"^deck\.inp:(\d+):\d+: error: (.*)$", said, re.MULTILINE)
    return [(int(number), what) for number, what in mistakes]


class Changed(unittest.TestCase):
    """The deck with some of its lines changed."""

    @classmethod
    def setUpClass(cls):
        """Read the page and cut the deck into cards."""
        cls.table = page_table()
        cls.cards = cards(DECK)
        cls.lines = DECK.splitlines()
        cls.server = DeckServer(**{"more.inp": MORE})
        cls.addClassCleanup(cls.server.close)

    def changed(self, changes=None):
        """Return the deck with some of its lines changed."""
        lines = list(self.lines)
        for number, text in (changes or {}).items():
            lines[number - 1] = text
        return "\n".join(lines) + "\n"

    def plan(self, changes=None):
        """Plan the deck with some of its lines changed: exit status, all text, mistakes by line."""
        status, said = self.server.ask(self.changed(changes))
        return status, said, mistakes_in(said)

    def refused(self, number, text, part=""):
        """Change one line (or more, from it on) and expect a mistake at the last of them."""
        status, said, mistakes = self.plan({number: text})
        line = number + text.count("\n")
        self.assertEqual(status, 1, said)
        self.assertTrue([what for at, what in mistakes if at == line and part in what], said)


class EveryCard(Changed):
    """One thing too many."""

    def test_the_deck_is_right_as_it_is(self):
        status, said, _ = self.plan()
        self.assertEqual(status, 0, said)

    def test_the_program_says_what_is_said_in_one_process(self):
        keyword, header, _ = self.cards[3]
        for changes in ({}, {1: "*PREPRINT\n*HEADING"}, {header: f"*{keyword}, NO SUCH OPTION"}):
            with self.subTest(changes=changes), tempfile.TemporaryDirectory() as folder:
                (pathlib.Path(folder) / "deck.inp").write_text(self.changed(changes))
                (pathlib.Path(folder) / "more.inp").write_text(MORE)
                done = subprocess.run(
                    [BIPOT, "deck.inp", "--plan", "--verbose"],
                    cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT, check=False,
                )
                status, said, mistakes = self.plan(changes)
                self.assertEqual(done.returncode, status)
                self.assertEqual(mistakes_in(done.stderr), mistakes)
                notes, printed = (
                    re.findall("^note: .*", text, re.MULTILINE) for text in (said, done.stdout)
                )
                self.assertEqual(printed[:len(notes)], notes)
                self.assertGreater(len(mistakes) + len(notes), 0)

    def test_every_card_that_is_read_has_an_entry(self):
        read = {word: card for word, card in printed_cards().items() if card["is"] == "read"}
        written = entries()
        self.assertEqual(set(written), set(read))
        self.assertEqual(set(self.table) - UNTRIED, {keyword for keyword, _, _ in self.cards})
        for keyword, card in read.items():
            with self.subTest(keyword=keyword):
                _, _, rows = written[keyword]
                self.assertEqual(rows["first line"], first_line(card))
                self.assertEqual(rows.get("further lines", ""),
                                 f"`{card['data']}`" if card["data"] else "")
                self.assertEqual(rows["place"], PLACES[card["place"]])
                self.assertEqual(self.table[keyword][1],
                                 [option["name"] for option in card["ignored options"]])
                self.assertGreater(len(rows["CalculiX, Abaqus"]), 5)

    def test_the_index_has_every_entry(self):
        listed = re.findall(r"^\| \[`\*([A-Z -]+)`\]\(deck/([^#)]*)(?:#[^)]*)?\) \| (.*) \|$",
                            INDEX, re.MULTILINE)
        self.assertEqual([keyword for keyword, _, _ in listed], keywords_that_are("read"))
        self.assertEqual({keyword: (page, what) for keyword, page, what in listed},
                         {keyword: entry[:2] for keyword, entry in entries().items()})

    def test_a_field_too_many_is_a_mistake(self):
        tried = 0
        for keyword, _, data in self.cards:
            if keyword in (*TITLES, *RESULTS):
                continue
            extra = "NOSUCH" if keyword in LISTS else "7"
            for number in data:
                with self.subTest(keyword=keyword, line=self.lines[number - 1]):
                    self.refused(number, f"{self.lines[number - 1]}, {extra}")
                    tried += 1
        self.assertGreater(tried, 35)

    def test_a_result_that_is_not_known_is_noted(self):
        for keyword, _, data in self.cards:
            if keyword not in RESULTS:
                continue
            with self.subTest(keyword=keyword):
                status, said, _ = self.plan({data[0]: self.lines[data[0] - 1] + ", NOSUCH"})
                self.assertEqual(status, 0, said)
                self.assertIn(f"*{keyword}: 'NOSUCH' is not written", said)

    def test_a_line_too_many_is_a_mistake(self):
        # More fields than any line has, so that cards with any number of lines refuse it too.
        many = ", ".join(["7"] * 11)
        for keyword, header, data in self.cards:
            if keyword in (*TITLES, *LISTS, "INCLUDE"):
                continue
            last = data[-1] if data else header
            with self.subTest(keyword=keyword):
                self.refused(last, f"{self.lines[last - 1]}\n{many}")

    def test_an_option_that_is_not_there_is_a_mistake(self):
        for keyword, header, _ in self.cards:
            if keyword == "INCLUDE":
                continue
            for option in ("NO SUCH OPTION", "NO SUCH OPTION=1"):
                with self.subTest(keyword=keyword, option=option):
                    self.refused(header, f"{self.lines[header - 1]}, {option}")

    def test_what_the_page_does_not_name_is_a_mistake(self):
        words = set(re.findall(r"'([A-Z][A-Z0-9 ]{1,24}?) *'", READER))
        words |= {" ".join(word.split()) for word in ELSEWHERE.split(",")}
        for options, ignored in self.table.values():
            words |= {*options, *ignored}
        words = sorted({squeezed(word) for word in words})
        self.assertGreater(len(words), 150)
        for keyword, header, _ in self.cards:
            if keyword in ("PARAMETER", "INCLUDE"):
                continue
            named = {squeezed(option) for kind in self.table[keyword] for option in kind}
            others = [word for word in words  # but shortened options
                      if not any(option.startswith(word) for option in named)]
            for first in range(0, len(others), 9):
                some = others[first:first + 9]
                text = ", ".join([self.lines[header - 1], *some])
                _, said, mistakes = self.plan({header: text})
                for word in some:
                    with self.subTest(keyword=keyword, option=word):
                        told = f"unknown parameter '{word}' of *{keyword}"
                        if word == "USER" and keyword in OF_USERS:
                            told = f"*{keyword}, USER is not available"
                        self.assertIn((header, told), mistakes, said)

    def test_what_the_page_names_is_known(self):
        for keyword, header, _ in self.cards:
            if keyword == "INCLUDE":
                continue
            for option in self.table[keyword][0]:
                with self.subTest(keyword=keyword, option=option):
                    _, said, _ = self.plan({header: f"{self.lines[header - 1]}, {option}=1"})
                    self.assertNotIn("unknown parameter", said)

    def test_what_is_ignored_is_noted(self):
        for keyword, header, _ in self.cards:
            for option in self.table[keyword][1]:
                with self.subTest(keyword=keyword, option=option):
                    status, said, _ = self.plan({header: f"{self.lines[header - 1]}, {option}=1"})
                    self.assertEqual(status, 0, said)
                    self.assertIn(f"{option} of *{keyword} is ignored", said)

    def test_keywords_are_ignored_as_the_page_says(self):
        listed = PAGES["errors.md"].split("skipped with a note:", 1)[1].split("\n\n", 1)[0]
        listed = set(re.findall(r"`\*([A-Z -]+)`", listed))
        ignored = set(keywords_that_are("ignored"))
        self.assertEqual(listed, ignored)
        for keyword in sorted(listed):
            with self.subTest(keyword=keyword):
                status, said, _ = self.plan({1: f"*{keyword}\n*HEADING"})
                self.assertEqual(status, 0, said)
                self.assertIn(f"*{keyword} is ignored", said)

    def test_any_other_keyword_is_a_mistake(self):
        others = keywords_that_are("refused")
        for keyword in (*sorted(set(others) - set(self.table)), "NOSUCH", "CONTACT PAIRS"):
            with self.subTest(keyword=keyword):
                status, said, mistakes = self.plan({1: f"*{keyword}\n*HEADING"})
                self.assertEqual(status, 1, said)
                self.assertEqual([at for at, _ in mistakes], [1], said)


class Flags(Changed):
    """Options without values: alone or YES, NO, and nothing else."""

    flags = (
        ("*NSET, NSET=UPPER, GENERATE", "GENERATE"), ("*STATIC", "DIRECT"), ("*STEP", "NLGEOM"),
        ("*STEP", "PERTURBATION"), ("*OBSTACLE, NAME=GROUND, TYPE=PLANE, REF NODE=900", "INNER"),
        ("*BOUNDARY", "FIXED"), ("*CONTACT GAP", "PARABOLA"),
    )

    def test_a_flag_takes_yes_or_no(self):
        sentence = PAGES["language.md"].split("**Options** have a value", 1)[1]
        sentence = sentence.split("stand alone")[0]
        self.assertEqual(
            {name for _, name in self.flags}, set(re.findall(r"`([A-Z]+)`", sentence))
        )
        for card, name in self.flags:
            bare = card.replace(f", {name}", "")
            header = self.lines.index(card) + 1
            for value in ("2", "NO STOP", "TRUE"):
                with self.subTest(card=card, value=value):
                    words = "YES, NO or AUTO" if name == "NLGEOM" else "YES or NO"
                    self.refused(header, f"{bare}, {name}={value}", f"takes no value but {words}")

    def test_a_flag_may_stand_on_a_line_of_its_own(self):
        for card, name in self.flags:
            bare = card.replace(f", {name}", "")
            header = self.lines.index(card) + 1
            with self.subTest(card=card):
                beside, below = (
                    self.plan({header: f"{bare},{between}{name}"}) for between in (" ", "\n")
                )
                self.assertEqual(beside[0], below[0], below[1])
                self.assertEqual(
                    [what for _, what in beside[2]], [what for _, what in below[2]]
                )

    def test_no_is_as_if_it_were_not_there(self):
        for card, name in self.flags:
            bare = card.replace(f", {name}", "")
            header = self.lines.index(card) + 1
            with self.subTest(card=card):
                absent, negated = (
                    self.plan({header: text})[:2] for text in (bare, f"{bare}, {name}=NO")
                )
                self.assertEqual(absent[0], negated[0])
                for words in ("contact points", "increments"):
                    lines = [
                        [line for line in said.splitlines() if words in line]
                        for _, said in (absent, negated)
                    ]
                    self.assertEqual(*lines)

    def test_yes_is_as_if_it_stood_alone(self):
        for card, name in self.flags:
            bare = card.replace(f", {name}", "")
            header = self.lines.index(card) + 1
            with self.subTest(card=card):
                alone, yes = (
                    self.plan({header: f"{bare}, {name}{value}"}) for value in ("", "=YES")
                )
                self.assertEqual(alone[0], yes[0])
                self.assertEqual([what for _, what in alone[2]], [what for _, what in yes[2]])


if __name__ == "__main__":
    unittest.main()
