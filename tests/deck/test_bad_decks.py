"""Every deck in bad/ is refused, for the mistakes it announces and no others.

A deck says in its first lines what must be found:

    ** expect: 12: unknown parameter 'NU'

the line of the mistake (0: the deck as a whole) and a part of the message. The program must name
that line, end with exit status 1, and leave no file behind. Decks are read one after the other in
one process; every tenth is given to the program itself, and all of them to its --check.

BIPOT is the program.
"""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from deck_server import DeckServer

BIPOT = os.environ.get("BIPOT", "bipot")
DECKS = pathlib.Path(__file__).resolve().parent / "bad"
EXPECT = re.compile(rb"^\*\* expect: (\d+): (.*?)\r?$", re.MULTILINE)
MISTAKE = re.compile(r"^(?:[^:]*[/.][^:]*:)?(?:(\d+):(\d+): |)\s?error: (.*)$")
PATIENCE = 600  # with a program that hangs [s]


def mistakes_in(text):
    """Return line and message of each mistake that is told; files of bad/ by their names."""
    matches = (MISTAKE.match(line) for line in text.replace(f"{DECKS}/", "").splitlines())
    return [(int(match.group(1) or 0), match.group(3)) for match in matches if match]


def run(deck, *arguments):
    """Run the program on a deck in an empty folder: status, mistakes, text, files left."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [BIPOT, str(deck), *arguments],
            cwd=folder, capture_output=True, timeout=PATIENCE, check=False,
        )
        left = sorted(os.listdir(folder))
    text = done.stderr.decode() + done.stdout.decode()
    return done.returncode, mistakes_in(text), text, left


class Read(unittest.TestCase):
    """Decks read in one process."""

    @classmethod
    def setUpClass(cls):
        cls.server = DeckServer(folder=DECKS)
        cls.addClassCleanup(cls.server.close)

    def read(self, deck):
        """Read one deck: status, mistakes, text."""
        status, text = self.server.ask(deck.read_bytes())
        return status, mistakes_in(text), text


class BadDecks(Read):
    """One test a deck, made below."""

    def check(self, deck):
        """Run one deck and hold what is said against what it expects."""
        expected = [
            (int(line), text.decode("latin-1")) for line, text in EXPECT.findall(deck.read_bytes())
        ]
        self.assertTrue(expected, "the deck expects nothing")
        status, found, text = self.read(deck)
        self.assertEqual(status, 1, text)
        for line, message in expected:
            self.assertTrue(
                any(line == at and message in said for at, said in found),
                f"not found: {line}: {message}\n{text}",
            )
        self.assertEqual(len(found), len(expected), f"more mistakes than expected:\n{text}")

    def test_what_is_not_printed_is_counted(self):
        status, text = self.server.ask(
            b"*NODE\n" + b"".join(b"%d, x\n" % (k + 1) for k in range(20))
        )
        self.assertEqual(status, 1)
        self.assertEqual(len(mistakes_in(text)), 10, text)
        self.assertIn("and 11 more errors; --check lists all", text)  # and no *STEP

    def test_the_program_says_the_same(self):
        for deck in sorted(DECKS.glob("*.inp"))[::10]:
            with self.subTest(deck=deck.name):
                status, told, text, left = run(deck)
                self.assertEqual((status, left), (1, []), text)
                self.assertEqual(told, self.read(deck)[1])


def add_test(deck):
    """Give the class a test for one deck, under the deck's name."""

    def test(self):
        self.check(deck)

    test.__doc__ = None
    setattr(BadDecks, "test_" + deck.stem, test)


for path in sorted(DECKS.glob("*.inp")):
    add_test(path)


class Checked(Read):
    """--check: each mistake in a line of its own, as editors read them, and nothing else."""

    LINE = re.compile(
        r"^(?P<file>[^:]+):(?P<line>[1-9]\d*):(?P<column>[1-9]\d*): error: (?P<text>.+)$"
    )

    def check(self, path, *words):
        """Check a deck; return the status, and of each line its matches."""
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [BIPOT, "--check", str(path), *words],
                cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False,
            )
            self.assertEqual(os.listdir(folder), [])
        self.assertEqual(done.stdout, "")
        found = [self.LINE.match(line) for line in done.stderr.splitlines()]
        self.assertNotIn(None, found, done.stderr)
        return done.returncode, found

    def check_folder(self):
        """Check all decks in one process: of each that has one mistake alone what is said."""
        done = subprocess.run(
            [BIPOT, "--check", str(DECKS)], capture_output=True, text=True, timeout=PATIENCE,
            check=False,
        )
        self.assertEqual(done.returncode, 1)
        found = {}
        for line in done.stdout.splitlines():
            match = self.LINE.match(line.removeprefix("refused").strip())
            if match and not re.search(r" \(and \d+ more\)$", line):
                found[pathlib.Path(match["file"])] = [match]
        return found

    def test_the_same_mistakes_are_told(self):
        together = self.check_folder()
        self.assertGreater(len(together), 300)
        for deck in sorted(DECKS.glob("*.inp")):
            with self.subTest(deck=deck.name):
                _, told, text = self.read(deck)
                found = together.get(deck)
                if found is None:
                    status, found = self.check(deck)
                    self.assertEqual(status, 1)
                self.assertEqual(len(found), len(told), text)
                for match, (line, message) in zip(found, told, strict=True):
                    self.assertTrue(pathlib.Path(match["file"]).is_file())
                    self.assertEqual(int(match["line"]), max(line, 1))
                    self.assertTrue(match["text"].replace(f"{DECKS}/", "").startswith(message),
                                    (match["text"], message))

    def test_hints_follow_their_mistake(self):
        _, (match,) = self.check(DECKS / "poisson_half.inp")
        self.assertRegex(match["text"], "0.5'; nearly incompressible: ")

    def test_a_deck_without_mistakes(self):
        deck = DECKS.parent / "odd" / "cube_on_slab.inp"
        self.assertEqual(self.check(deck), (0, []))

    def test_what_has_no_place_is_told_at_the_first_letter(self):
        status, (match,) = self.check("/no/such/deck.inp")
        self.assertEqual((status, match["line"], match["column"]), (1, "1", "1"))
        deck = DECKS / "poisson_half.inp"
        status, found = self.check(deck, "--set", "q=1")
        self.assertEqual([match["line"] for match in found], ["1", "6"])

    def test_all_mistakes_are_told_however_many(self):
        with tempfile.TemporaryDirectory() as folder:
            deck = pathlib.Path(folder) / "many.inp"
            deck.write_text("*NODE\n" + "1, x, 0., 0.\n" * 80)
            _, found = self.check(deck)
        self.assertGreaterEqual(len(found), 80)


class OtherInput(unittest.TestCase):
    """What is wrong before or beside the text of a deck."""

    def refused(self, content, message, *arguments):
        """Write a deck, run it, and expect one mistake without a line."""
        with tempfile.TemporaryDirectory() as folder:
            deck = pathlib.Path(folder) / "deck.inp"
            deck.write_bytes(content)
            status, found, text, left = run(deck, *arguments)
        self.assertEqual(status, 1, text)
        self.assertEqual(left, [])
        self.assertEqual(len(found), 1, text)
        self.assertIn(message, found[0][1])

    def test_there_must_be_a_file(self):
        status, found, text, _ = run("/no/such/deck.inp")
        self.assertEqual((status, len(found)), (1, 1), text)
        self.assertIn("there is no such file", text)

    def test_a_folder_is_no_deck(self):
        status, _, text, left = run(DECKS)
        self.assertEqual((status, left), (1, []), text)
        self.assertIn("is a folder; name a deck", text)

    def test_an_empty_file_is_no_deck(self):
        self.refused(b"", "the file is empty")

    def test_a_binary_file_is_no_deck(self):
        self.refused(bytes(range(256)) * 16, "a control character")

    def test_utf16_is_named_as_not_utf8(self):
        self.refused("*HEADING\n".encode("utf-16"), "not UTF-8")

    def test_an_override_needs_its_parameter(self):
        deck = (DECKS / "no_step.inp").read_bytes() + b"*STEP\n*STATIC\n1., 1.\n*END STEP\n"
        self.refused(deck, "the deck has no parameter 'M'", "--set", "m=3")

    def test_a_pipe_does_not_hang(self):
        with tempfile.TemporaryDirectory() as folder:
            pipe = os.path.join(folder, "pipe.inp")
            os.mkfifo(pipe)
            status, found, text, _ = run(pipe)
        self.assertEqual((status, len(found)), (1, 1), text)


if __name__ == "__main__":
    unittest.main()
