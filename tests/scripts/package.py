"""What the tests of the Python package share: where it is, the program, a folder for each test."""

import importlib.util
import os
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
os.environ.setdefault("BIPOT", str(ROOT / "build" / "bipot"))
BLOCK = ROOT / "input" / "block.inp"
sys.path.insert(0, str(ROOT / "scripts"))

import bipot  # noqa: E402  (found through the line above)


def needs(name):
    """Return a decorator that skips a test where an optional package is not installed."""
    return unittest.skipIf(importlib.util.find_spec(name) is None, f"{name} is not installed")


class WithFolder(unittest.TestCase):
    """A test in a working directory of its own."""

    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)

    def run_block(self, **options):
        """Return the result of a small run of the paper's block."""
        given = {"n": 2, "steps": 10, "quiet": True, **options}
        result = bipot.run(BLOCK, **given)
        self.addCleanup(result.close)
        return result


def pressed_block(name="pressed", **solver):
    """Return a deck of a block that is pressed and pushed, as input/block.inp has it."""
    deck = bipot.Deck("A block, pressed and pushed", name=name)
    deck.parameter(n=2, steps=10, mu=0.3, theta=60.0)
    deck.block("BODY", ("<n>", "<n>", "<n>"), (1.0, 1.0, 1.0))
    deck.material("STEEL", young=210000.0, poisson=0.3)
    deck.section("STEEL", "BODY")
    deck.plane("GROUND", (0, 0, 0), (0, 0, 1))
    deck.interaction("DRY", friction="<mu>")
    deck.pair("BODY-ZMIN", "GROUND", "DRY")
    deck.contact_solver(SOLVER="SWEEPS", TOLERANCE=1e-10, **solver)
    with deck.step("<5/steps>", direct=True):
        deck.boundary("BODY-ZMAX", 1, 2)
        deck.boundary("BODY-ZMAX", 3, value=-0.1)
    with deck.step("<1.25/steps>", direct=True):
        deck.boundary("BODY-ZMAX", 1, value="<0.4*cos(theta*pi/180)>")
        deck.boundary("BODY-ZMAX", 2, value="<0.4*sin(theta*pi/180)>")
    return deck
