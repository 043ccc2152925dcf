"""docs/coming-from.md keeps its word: what it shows is run, and says what the page says.

The page has one deck. A fragment takes the place of the card that has its first line, or its
keyword, in that deck (a comment that of the card commented out); what the deck lacks comes before
its first *STEP, or behind *STATIC if it belongs in a step.
"""

import re
import unittest

from program import SOURCE, Run

PAGE = (SOURCE / "docs" / "coming-from.md").read_text(encoding="utf-8")
FENCE = re.compile(r"^```(inp|text)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
IN_STEP = ("*CHANGE FRICTION", "*CHANGE SURFACE BEHAVIOR", "*MODEL CHANGE", "*CONTROLS",
           "*OUTPUT", "*EL FILE",
           "*CLOAD", "*DLOAD")


def cards_of(text):
    """Return the cards of a text, each a list of lines."""
    cards = []
    for line in text.splitlines():
        if re.match(r"(\*\* )?\*[A-Z]", line):
            cards.append([line])
        else:
            cards[-1].append(line)
    return cards


DECK = cards_of(FENCE.search(PAGE)[2])


def place_of(deck, line):
    """Return the last card that a fragment's first line takes the place of; None where none."""
    line = line.removeprefix("** ")
    keyword = line.split(",")[0].replace("*DYNAMIC", "*STATIC")
    for wanted in (lambda card: card[0] == line, lambda card: card[0].split(",")[0] == keyword):
        found = [i for i, card in enumerate(deck) if wanted(card)]
        if found:
            return found[-1]
    return None


def changed(*fragments):
    """Return the page's deck with fragments in it, later ones in the place of earlier ones."""
    deck = list(DECK)
    for fragment in fragments:
        first, *more = cards_of(fragment)
        at = place_of(deck, first[0])
        if at is None and first[0].split(",")[0] in IN_STEP:
            at = place_of(deck, "*STATIC") + 1
        elif at is None:
            at = place_of(deck, "*STEP")
        else:
            del deck[at]
        deck[at:at] = [first, *more]
    return "\n".join(line for card in deck for line in card) + "\n"


class Page(unittest.TestCase):
    """Rows of the table, and errors with their remedies."""

    def said(self, deck, wrong=None):
        """Run a deck and return what it says."""
        run = Run(deck, name="deck")
        if wrong is not None:
            self.assertEqual(run.status != 0, wrong, deck + run.output + run.errors)
        return run.output + run.errors

    def test_the_deck_runs(self):
        self.said(changed(), False)

    def test_rows_of_the_table(self):
        rows = re.findall(r"^\| (`\*.*?) \| .*? \| (?:`(.*?)`)? ?\|$", PAGE, re.MULTILINE)
        self.assertGreater(len(rows), 20)
        for cards, message in rows:
            with self.subTest(cards):
                fragment = "\n".join(re.findall(r"`(.*?)`", cards))
                said = self.said(changed(fragment), None if message else False)
                self.assertIn(message, said)

    def test_errors_and_remedies(self):
        parts = re.split(r"^### ", PAGE, flags=re.MULTILINE)[1:]
        self.assertEqual(len(parts), 19)
        for part in parts:
            with self.subTest(part.splitlines()[0]):
                fences = FENCE.findall(part)
                first, remedy = fences[0][1], fences[-1][1]
                for message in [text.strip() for kind, text in fences if kind == "text"]:
                    self.assertIn(message, self.said(changed(first)))
                self.said(self.mended(first, remedy), False)

    def mended(self, wrong, remedy):
        """Return the deck with the remedy: in the place of what was wrong if both say one thing."""
        of_same = cards_of(wrong)[0][0].split(",")[0] == cards_of(remedy)[0][0].split(",")[0]
        if of_same or cards_of(wrong)[0][0].startswith("** "):
            return changed(remedy)
        if "*TIE" in remedy:
            return changed("** *CONTACT PAIR, INTERACTION=DRY", remedy)
        return changed(remedy, wrong)


if __name__ == "__main__":
    unittest.main()
