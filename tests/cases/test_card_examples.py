"""The examples of docs/deck run, and every card stands in one on the page of its entry.

An example is a whole deck, or a part of that of docs/deck.md, where its cards take the place of
those of the same kind and name.
"""

import json
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

from program import PROGRAM, SOURCE

DOCS = SOURCE / "docs"
FENCE = re.compile(r"^```inp\n(.*?)^```$", re.DOTALL | re.MULTILINE)
BLOCK = re.compile(r"^    \*[A-Z].*\n(?:^    .*\n)*", re.MULTILINE)
ENTRY = re.compile(r"^\| `\*([A-Z -]+)` \| .* \|\n\|---\|---\|$", re.MULTILINE)
PROPERTIES = ("*ELASTIC", "*HYPERELASTIC", "*HYPERFOAM", "*DENSITY", "*EXPANSION", "*FRICTION",
              "*SURFACE BEHAVIOR", "*KINEMATIC", "*DISTRIBUTING")
FIRST_NODES = 200  # nodes below come before the blocks, whose numbers follow those above them
FILES = {
    "meshes/cube.inp": "*NSET, NSET=CORNERS\n1, 5\n",
    "die.stl": "solid\nfacet normal 0 0 1\nouter loop\nvertex -9 -9 -1\nvertex 9 -9 -1\n"
               "vertex 0 9 -1\nendloop\nendfacet\nendsolid\n",
}


def cards_of(text):
    """Return the cards of a text, each a list of lines; properties go with what they belong to."""
    cards = []
    for line in text.splitlines():
        word = line.split(",")[0]
        if line.startswith("*") and not line.startswith("**") and not (
            cards and word in PROPERTIES and cards[-1][0] != "*STEP"
        ):
            cards.append([line])
        else:
            cards[-1].append(line)
    return cards


def keyword(card):
    """Return the keyword of a card, without its star."""
    return card[0].split(",")[0][1:]


def identity(card):
    """Return what makes a card another one of the same keyword: its name, or its set."""
    named = re.search(r"\b(?:NAME|ELSET)=([\w-]+)", card[0])
    return keyword(card), named[1] if named else ""


def of_step():
    """Return the keywords that stand in a step only."""
    text = subprocess.run([PROGRAM, "--cards"], capture_output=True, text=True, check=True).stdout
    return {card["keyword"] for card in json.loads(text)["cards"] if card.get("place") == "step"}


def whole_deck(base, example, in_step):
    """Return a deck: the base with an example in it."""
    start = next((k for k, card in enumerate(example) if keyword(card) == "STEP"), len(example))
    model, steps = example[:start], example[start:]
    first = next((k for k, card in enumerate(model) if keyword(card) in in_step), len(model))
    model, loads = model[:first], model[first:]
    at = next(k for k, card in enumerate(base) if keyword(card) == "STEP")
    replaced = {identity(card) for card in model} - {("BOUNDARY", "")}
    kept = [card for card in base[1:at] if identity(card) not in replaced]
    if any(keyword(card) == "TIE" for card in model):
        kept = [card for card in kept if keyword(card) != "CONTACT PAIR"]
    numbers = [int(card[1].split(",")[0]) for card in model if keyword(card) == "NODE"]
    early = any(number < FIRST_NODES for number in numbers)
    early = early or any(keyword(card) in ("PARAMETER", "BLOCK") for card in model)
    blocks = [card for card in kept if keyword(card) == "BLOCK"]
    others = [card for card in kept if keyword(card) != "BLOCK"]
    mesh = [*model, *blocks] if early else [*blocks, *model]
    if not steps:
        taken = {keyword(card) for card in loads} & {"STATIC"}
        steps = [card for card in base[at:] if keyword(card) not in taken]
        steps[1:1] = [card for card in loads if keyword(card) == "STATIC"]
        steps[2:2] = [card for card in loads if keyword(card) != "STATIC"]
    cards = [base[0], *mesh, *others, *steps]
    return "\n".join(line for card in cards for line in card) + "\n"


class Examples(unittest.TestCase):
    """Every example of the pages of cards."""

    def run_deck(self, deck):
        """Run a deck beside the files that examples name."""
        with tempfile.TemporaryDirectory(prefix="bipot-") as name:
            folder = Path(name)
            for path, text in {**FILES, "deck.inp": deck}.items():
                (folder / path).parent.mkdir(exist_ok=True)
                (folder / path).write_text(text)
            done = subprocess.run([PROGRAM, "deck.inp"], cwd=folder, capture_output=True, text=True,
                                  timeout=100, check=False)
        self.assertEqual(done.returncode, 0, deck + done.stdout + done.stderr)

    def test_examples_run(self):
        base = cards_of(FENCE.search((DOCS / "deck.md").read_text(encoding="utf-8"))[1])
        in_step = of_step()
        self.run_deck("\n".join(line for card in base for line in card) + "\n")
        for path in sorted((DOCS / "deck").glob("*.md")):
            page = path.read_text(encoding="utf-8")
            shown = set()
            entries = ENTRY.findall(page)
            if not entries:
                continue
            for deck in FENCE.findall(page):
                shown |= {keyword([line]) for line in deck.splitlines() if line.startswith("*")}
                with self.subTest(page=path.name, deck=deck):
                    self.run_deck(deck)
            for block in BLOCK.findall(page):
                text = re.sub(r"^    ", "", block, flags=re.MULTILINE)
                shown |= {keyword([line]) for line in text.splitlines() if line.startswith("*")}
                with self.subTest(page=path.name, example=text):
                    self.run_deck(whole_deck(base, cards_of(text), in_step))
            self.assertEqual(set(entries) - shown, set(), path.name)


if __name__ == "__main__":
    unittest.main()
