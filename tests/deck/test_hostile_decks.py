"""Decks that mean harm: loops, depth, size, numbers at the limits of their types, odd paths.

Each must be refused in order, with its place, or read: in 5 s of the processor (15 s in a Debug
build), within a limit on memory, without a file left behind. BIPOT_LONG=1 makes long lines of
100 MB instead of 10 MB.

BIPOT is the program; `--plan` reads the deck and ends before anything is computed.
"""

import os
import resource
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

BIPOT = os.environ.get("BIPOT", "bipot")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "fuzz"))
from outcome import Outcome  # noqa: E402  (found through the line above)

LONG = 100_000_000 if os.environ.get("BIPOT_LONG", "") not in ("", "0") else 10_000_000
SECONDS = 15 if os.environ.get("BIPOT_BUILD_TYPE") == "Debug" else 5
SECONDS *= max(1, LONG // 20_000_000)
ADDRESSES = 3_000_000_000
SANITIZED = b"libasan" in Path(BIPOT).read_bytes()
DECK = (ROOT / "input" / "block.inp").read_text().replace("\nn = 4\n", "\nn = 1\n")
HEAD, TAIL = DECK.split("*MATERIAL", 1)
TAIL = "*MATERIAL" + TAIL


class Hostile(unittest.TestCase):
    """A deck in a folder of its own."""

    def setUp(self):
        """Make the folder."""
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)
        self.work = self.folder / "work"
        self.work.mkdir()

    def read(self, text, status, message="", name="deck.inp", options=()):
        """Write a deck, have it read, and expect an exit status and a part of the message."""
        deck = self.work / name
        deck.write_bytes(text.encode() if isinstance(text, str) else text)
        before = sorted(os.listdir(self.work))
        outcome = Outcome([BIPOT, str(deck), "--plan", *options], self.folder, SECONDS,
                          0 if SANITIZED else ADDRESSES)
        self.assertEqual(outcome.complaints(), [], outcome.errors[:2000])
        self.assertEqual(outcome.status, status, outcome.errors[:2000])
        self.assertIn(message, outcome.errors)
        self.assertEqual(sorted(os.listdir(self.work)), before)
        return outcome


class Includes(Hostile):
    """*INCLUDE."""

    def test_a_loop_of_two(self):
        (self.work / "other.inp").write_text("*INCLUDE, INPUT=deck.inp\n")
        self.read("*INCLUDE, INPUT=other.inp\n" + DECK, 1, "includes itself")

    def test_a_loop_by_other_paths(self):
        os.symlink(self.work, self.work / "again")
        self.read("*INCLUDE, INPUT=again/deck.inp\n" + DECK, 1, "deep")

    def test_depth(self):
        for k in range(40):
            (self.work / f"{k}.inp").write_text(f"*INCLUDE, INPUT={k + 1}.inp\n")
        self.read("*INCLUDE, INPUT=0.inp\n" + DECK, 1, "16 deep")

    def test_each_twice(self):
        """As many files as 2 to the 14, were they all put in."""
        for k in range(14):
            (self.work / f"{k}.inp").write_text(f"*INCLUDE, INPUT={k + 1}.inp\n" * 2)
        (self.work / "14.inp").write_text("** the last\n")
        self.read("*INCLUDE, INPUT=0.inp\n" + DECK, 1, "more than 1000 files")

    def test_what_never_ends(self):
        os.mkfifo(self.work / "pipe")
        for path in ("/dev/zero", "/dev/tty", "/proc/self/mem", "pipe", ".", "/", "\\"):
            with self.subTest(path=path):
                self.read(f"*INCLUDE, INPUT={path}\n" + DECK, 1, "deck.inp:1:1")

    def test_a_long_path(self):
        self.read(f"*INCLUDE, INPUT={'a/' * 1999}a\n" + DECK, 1, "no such file")
        self.read(f"*INCLUDE, INPUT={'a/' * (LONG // 2)}a\n" + DECK, 1, "longer than 4000")


class Parameters(Hostile):
    """*PARAMETER."""

    def test_circles(self):
        for lines in ("a = <a>", "a = <b>\nb = <a>", "a = a + 1"):
            with self.subTest(lines=lines):
                self.read(f"*PARAMETER\n{lines}\n" + DECK, 1, "deck.inp:2:")

    def test_texts_that_double(self):
        lines = "".join(f"p{k + 1} = <p{k}><p{k}>\n" for k in range(60))
        self.read(f"*PARAMETER\np0 = {'x' * 50}\n{lines}" + DECK, 1, "too long")

    def test_sums_that_double(self):
        lines = "".join(f"p{k + 1} = <p{k} + p{k}>\n" for k in range(300))
        self.read(f"*PARAMETER\np0 = 1\n{lines}" + DECK, 1, "error: ")

    def test_depth(self):
        for n in (50, 400):
            self.read(f"*PARAMETER\na = <{'(' * n}1{')' * n}>\n" + DECK, 1 if n > 100 else 0)
        self.read(f"*PARAMETER\na = <{'-' * 900}1>\n" + DECK, 0)

    def test_too_many(self):
        self.read("*PARAMETER\n" + "".join(f"a{k} = {k}\n" for k in range(100000)) + DECK, 1,
                  "too many parameters")

    def test_overrides(self):
        for value in ("n=1e400", "n=nan", "n=<n>", "n=<m>", "=1", "n=" + "1" * 5000, "n=1e9",
                      "n=\n*STEP", "n==", "n=\xff"):
            with self.subTest(value=value):
                self.read(DECK, 1, "error: ", options=("--set", value))


class Sizes(Hostile):
    """More than the machine or the types hold."""

    def test_blocks(self):
        for n, message in (
            ((10**9, 1, 1), "NX must be"), ((2147483647, 1, 1), "NX must be"),
            ((2147483648, 1, 1), "NX must be"), ((99999999999999999999, 1, 1), "NX must be"),
            ((46341, 46341, 1), "more than 20000000 nodes"), ((20000, 20000, 20000), "nodes"),
            ((0, 1, 1), "NX must be"), ((-1, 1, 1), "NX must be"),
        ):
            with self.subTest(n=n):
                card = "*BLOCK, NAME=BIG, NX={}, NY={}, NZ={}\n0., 0., 0., 1., 1., 1.\n".format(*n)
                self.read(HEAD + card + TAIL, 1, message)

    def test_a_block_that_memory_does_not_hold(self):
        card = "*BLOCK, NAME=BIG, NX=270, NY=270, NZ=270\n0., 0., 0., 1., 1., 1.\n"
        deck = self.work / "deck.inp"
        deck.write_text(HEAD + card + TAIL)
        if not SANITIZED:
            outcome = Outcome([BIPOT, str(deck), "--plan"], self.folder, SECONDS, 1_000_000_000)
            self.assertEqual(outcome.complaints(), [])
            self.assertEqual(outcome.status, 1, outcome.errors)
            self.assertIn("not enough memory for the nodes of this block", outcome.errors)

    def test_ids_at_the_limits(self):
        for node, status in ((2147483647, 0), (2147483648, 1), (-2147483648, 1), (0, 1),
                             (18446744073709551617, 1)):
            with self.subTest(node=node):
                self.read(HEAD + f"*NODE, NSET=FAR\n{node}, 5., 0., 0.\n" + TAIL, status)
        self.read("*NODE\n2147483647, 5., 0., 0.\n" + DECK, 1, "would exceed 2147483647")

    def test_generate(self):
        for line in ("1, 2147483647, 1", "1, 2147483647, 2147483647", "1, 2147483647, 2147483646",
                     "1, 1, 2147483647", "2147483647, 2147483647, 1", "1, 8, 0", "1, 8, -1",
                     "8, 1, 1", "-5, 5, 1"):
            with self.subTest(line=line):
                outcome = self.read(HEAD + f"*NSET, NSET=S, GENERATE\n{line}\n" + TAIL,
                                    0 if line == "1, 1, 2147483647" else 1)
                if outcome.status == 1:
                    self.assertIn("deck.inp:34:", outcome.errors)

    def test_sets_in_circles(self):
        for lines in ("*NSET, NSET=S0\nS1\n*NSET, NSET=S1\nS0\n", "*NSET, NSET=S0\nS0\n",
                      "*ELSET, ELSET=S0\nS1\n*ELSET, ELSET=S1\nS2\n*ELSET, ELSET=S2\nS0\n"):
            self.read(HEAD + lines + TAIL, 1, "above it")

    def test_sets_that_double(self):
        lines = "*NSET, NSET=S0\n1\n" + "".join(
            f"*NSET, NSET=S{k + 1}\nS{k}, S{k}\n" for k in range(200))
        self.read(HEAD + lines + TAIL, 0)

    def test_many_of_everything(self):
        n = 30000
        for name, lines in {
            "sets": "".join(f"*NSET, NSET=S{k}\n1\n" for k in range(n)),
            "one set": "*NSET, NSET=S\n1, 2, 3\n" * n,
            "surfaces": "".join(f"*SURFACE, NAME=S{k}, TYPE=NODE\n1\n" for k in range(n)),
            "materials": "".join(f"*MATERIAL, NAME=S{k}\n*ELASTIC\n1., 0.3\n" for k in range(n)),
            "obstacles": "".join(f"*OBSTACLE, NAME=S{k}, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
                                 for k in range(n)),
            "amplitudes": "".join(f"*AMPLITUDE, NAME=S{k}\n0., 0., 1., 1.\n" for k in range(n)),
            "nodes": "*NODE\n" + "".join(f"{k}, {k}., 0., 0.\n" for k in range(1000, 1000 + n)),
            "prints": "".join(f"*ENERGY PRINT, ELSET=S{k}\n" for k in range(n)),
        }.items():
            with self.subTest(name=name):
                self.read(HEAD + lines + TAIL, 0)

    def test_many_mistakes(self):
        outcome = self.read("".join(f"*FOO{k}\n" for k in range(100000)) + DECK, 1, "and more")
        self.assertLess(len(outcome.errors), 100000)

    def test_many_bodies(self):
        cards = "".join(
            f"*BLOCK, NAME=B{k}, NX=1, NY=1, NZ=1, ELSET=BODY\n{2 * k}., 9., 9., 1., 1., 1.\n"
            for k in range(1, 1000)
        )
        self.read(HEAD + cards + TAIL, 0)

    def test_many_steps(self):
        self.read(DECK + "*STEP\n*STATIC\n1., 1.\n*END STEP\n" * 3000, 0)


class Numbers(Hostile):
    """Numbers that are none, or too many digits of them."""

    def test_what_is_no_number(self):
        for text in ("1e400", "-1e400", "1e61", "nan", "NAN", "inf", "-Infinity", "0x1p3", "1e",
                     "1e+", "--1", "1.2.3", "1_0", "1e99999999999999999999", "++1", ".", "e5",
                     "\u0661", "1" + "0" * 400, "nan(1)", "1e5f"):
            with self.subTest(text=text):
                self.read(DECK.replace("0., 0., 0.,  1., 1., 1.", f"{text}, 0., 0.,  1., 1., 1."),
                          1, "deck.inp:32:1: error: ")

    def test_what_is_a_number(self):
        for text in ("1e-400", "-1e-99999999999", "0" * 400 + ".5", "1." + "0" * 4000 + "1",
                     "1d5", "1.5D-3", "1+5", "1e59", "+.5", "5."):
            with self.subTest(text=text):
                self.read(HEAD + f"*NODE\n1000, {text}, 0., 0.\n" + TAIL, 0)

    def test_sizes_that_leave_nothing(self):
        for box in ("1e10, 0., 0., 1e-10, 1., 1.", "0., 0., 0., 1e-300, 1., 1.",
                    "0., 0., 0., 1e60, 1e60, 1e60", "1e60, 1e60, 1e60, 1e60, 1e60, 1e60"):
            with self.subTest(box=box):
                deck = self.work / "deck.inp"
                deck.write_text(DECK.replace("0., 0., 0.,  1., 1., 1.", box))
                outcome = Outcome([BIPOT, str(deck)], self.folder, SECONDS,
                                  0 if SANITIZED else ADDRESSES)
                self.assertEqual(outcome.complaints(), [], outcome.errors)


class Bytes(Hostile):
    """What is no text, or a line without end."""

    def test_no_text(self):
        for byte in (b"\0", b"\x01", b"\x1a", b"\x7f", b"\xff", b"\xc0\x80", b"\xed\xa0\x80",
                     b"\xf4\x90\x80\x80", b"\xe2\x82", b"\xc2\x85"):
            with self.subTest(byte=byte):
                self.read(DECK.encode().replace(b"*STEP", byte + b"*STEP", 1), 1, "deck.inp:")
        self.read(b"\0" * 1000000, 1, "deck.inp:1:1")

    def test_long_lines(self):
        n = LONG
        for name, (text, status) in {
            "comment": ("**" + "x" * n + "\n" + DECK, 0),
            "heading": ("*HEADING\n" + "x" * n + "\n" + DECK, 0),
            "keyword": ("*" + "x" * n + "\n" + DECK, 1),
            "option": (f"*NSET, NSET={'x' * n}\n1\n" + DECK, 1),
            "options": ("*NSET" + ", NSET=A" * (n // 8) + "\n1\n" + DECK, 1),
            "entries": (HEAD + "*NSET, NSET=S\n" + "1," * (n // 2) + "\n" + TAIL, 0),
            "commas": (HEAD + "*NSET, NSET=S\n" + "," * n + "\n" + TAIL, 1),
            "digits": (HEAD + "*NSET, NSET=S\n" + "1" * n + "\n" + TAIL, 1),
            "zeros": (HEAD + f"*NODE\n1000, {'0' * n}.5, 0., 0.\n" + TAIL, 0),
            "words": (HEAD + "*BOUNDARY\n" + "a b " * (n // 4) + "\n" + TAIL, 1),
            "parameter": (f"*PARAMETER\na = {'1' * n}\n" + DECK, 1),
            "name": (f"*PARAMETER\n{'a' * n} = 1\n" + DECK, 1),
            "brackets": (f"*PARAMETER\na = <{'(' * n}>\n" + DECK, 1),
            "openings": (HEAD + "*NSET, NSET=S\n" + "<" * n + "\n" + TAIL, 1),
            "uses": ("*PARAMETER\nq = 1\n" + HEAD + "*NSET, NSET=S\n" + "<q>," * (n // 4) + "\n"
                     + TAIL, 1),
            "blanks": (" " * n + "\n" + DECK, 0),
            "stars": ("*" * n + "\n" + DECK, 0),
            "ends": ("\r" * (n // 10) + DECK, 0),
        }.items():
            with self.subTest(name=name):
                self.read(text, status)


class Paths(Hostile):
    """Odd names of decks and results."""

    def test_names_of_decks(self):
        for name in ("a b.inp", "\u00e9.inp", "*.inp", "-n.inp", "deck", ".inp", "a'b\"c.inp",
                     "x" * 250 + ".inp", "new\nline.inp", "$(id).inp", "deck.inp.inp"):
            with self.subTest(name=name):
                self.read(DECK, 0, name=name)

    def test_a_deep_path(self):
        here = os.getcwd()
        self.addCleanup(os.chdir, here)
        os.chdir(self.work)
        for _ in range(40):
            os.mkdir("d" * 200)
            os.chdir("d" * 200)
        Path("deck.inp").write_text(DECK)
        done = subprocess.run([Path(BIPOT).resolve(), "deck.inp", "--quiet", "--set", "steps=5"],
                              capture_output=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(Path("deck.vtkhdf").exists())

    def test_names_of_results(self):
        deck = self.work / "deck.inp"
        deck.write_text(DECK)
        for name, status in (("x" * 300, 3), ("a/b/c.vtkhdf", 3), (".", 1), ("/", 1), ("..", 1),
                             ("/dev/null", 1), ("/dev/full", 1), ("a b.vtkhdf", 0), ("deck.inp", 1),
                             ("x" * 5000, 3)):
            with self.subTest(name=name):
                outcome = Outcome([BIPOT, str(deck), "-o", name, "--set", "steps=5"], self.folder,
                                  SECONDS, 0 if SANITIZED else ADDRESSES)
                self.assertEqual(outcome.status, status, outcome.errors)
                self.assertNotIn("Backtrace", outcome.errors)
                self.assertEqual(deck.read_text(), DECK)


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    unittest.main()
