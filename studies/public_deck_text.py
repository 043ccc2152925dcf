"""Public decks as text: their cards, families and sources, and copies that can be compared."""

import hashlib
import re
from dataclasses import dataclass, field
from pathlib import Path

# By the first folder of the collection: whose decks these are.
SOURCES = {
    "ccx": "tests of CalculiX", "elements": "tests of CalculiX",
    "cgx": "examples of tools", "cgx-jet-engine-model": "examples of tools",
    "launcher": "examples of tools",
    "other": "users", "suleymanmuti": "users", "yahoo": "users",
}
OUTPUT = {
    "NODEFILE", "NODEPRINT", "ELFILE", "ELPRINT", "CONTACTFILE", "CONTACTPRINT", "SECTIONPRINT",
    "NODEOUTPUT", "ELEMENTOUTPUT", "CONTACTOUTPUT", "OUTPUT", "RESTART",
}
ALL = "PUBLICALL"  # the set of all nodes, in the copy for CalculiX
KINDS = {"face": "SURFACE TO SURFACE", "node": "NODE TO SURFACE"}
STIFF = 50.0       # CalculiX's default stiffness for HARD, in moduli a length


@dataclass
class Card:
    """A keyword with its options and its data lines."""

    head: str
    data: list = field(default_factory=list)

    @property
    def keyword(self):
        """The keyword without blanks, in capitals."""
        return re.sub(r"\s", "", self.head[1:].split(",")[0]).upper()

    def option(self, name):
        """Return the value of an option, "" of a bare one, None where it is not there."""
        for word in self.head.split(",")[1:]:
            key, _, value = word.partition("=")
            if re.sub(r"\s", "", key).upper() == name.replace(" ", ""):
                return value.strip()
        return None

    def numbers(self, row=0):
        """Return the numbers of a data line, blanks as None."""
        words = [word.strip() for word in self.data[row].split(",")] if self.data else []
        return [float(word.upper().replace("D", "E")) if word else None for word in words]


def read_cards(path, before=None):
    """Return the cards of a deck, those of files that it includes among them.

    A file may begin with data lines of the last card `before` it. FileNotFoundError where a file
    is not there. Comments are left out.
    """
    cards, open_head = [] if before is None else before, False
    for line in path.read_text(encoding="latin-1").splitlines():
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        if open_head:
            cards[-1].head += line
        elif line.startswith("*"):
            cards.append(Card(line))
        else:
            if cards:
                cards[-1].data.append(line)
            continue
        open_head = cards[-1].head.endswith(",")
        if not open_head and cards[-1].keyword == "INCLUDE":
            name = cards.pop().option("INPUT").strip('"')
            read_cards(path.parent / name, cards)
    return cards


def is_contact_deck(path):
    """Return whether a file, without those that it includes, has a contact pair."""
    text = path.read_bytes()
    return re.search(rb"^\*CONTACT *PAIR", text, re.IGNORECASE | re.MULTILINE) is not None


def source_of(path, folder):
    """Return whose deck this is, by its first folder."""
    parts = path.relative_to(folder).parts
    return SOURCES.get(parts[0], "users") if len(parts) > 1 else "users"


def family_key(cards):
    """Return a text that decks of one family share, "" of no cards.

    They are equal but for blanks, capitals, comments, heading, output requests, and what chooses
    the type of contact: TYPE of the pairs, how pressure grows with overclosure, the stick slope.
    """
    lines = []
    for card in cards:
        if card.keyword in OUTPUT | {"HEADING", "SURFACEBEHAVIOR"}:
            continue
        head = re.sub(r"\s", "", card.head).upper()
        data = [re.sub(r"\s", "", line).upper().rstrip(",") for line in card.data]
        if card.keyword == "CONTACTPAIR":
            head = ",".join(word for word in head.split(",") if not word.startswith("TYPE="))
        elif card.keyword == "FRICTION":
            data = [line.split(",")[0] for line in data]
        lines += [head, *data]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest() if lines else ""


def node_ids(cards):
    """Return the numbers of all nodes."""
    return [int(line.split(",")[0]) for card in cards if card.keyword == "NODE"
            for line in card.data]


def bare(cards):
    """Return the lines of a deck without requests of output."""
    kept = (card for card in cards if card.keyword not in OUTPUT)
    return [line for card in kept for line in (card.head, *card.data)]


def for_bipot(cards, variant=""):
    """Return the text of the deck that bipot runs: displacements and forces at all nodes."""
    lines = bare(changed(cards, [word for word in variant.split() if word == "swap"]))
    ends = [k for k, line in enumerate(lines)
            if re.sub(r"\s", "", line).upper().startswith("*ENDSTEP")]
    lines[ends[0]:ends[0]] = ["*NODE FILE", "U, RF, CF"]
    return "\n".join(lines) + "\n"


def for_calculix(cards, variant=""):
    """Return the text of the deck that CalculiX runs: it prints all nodes at the ends of steps.

    `variant` is words of `changed`, each of which changes how contact is taken.
    """
    ids = node_ids(cards)
    before = {
        "*STEP": [f"*NSET, NSET={ALL}", *(
            ", ".join(map(str, ids[k:k + 12])) for k in range(0, len(ids), 12)
        )],
        "*ENDSTEP": [f"*NODE PRINT, NSET={ALL}, FREQUENCY=100000, GLOBAL=YES", "U, RF"],
    }
    lines = []
    for line in bare(changed(cards, [word for word in variant.split() if word != "swap"])):
        keyword = re.sub(r"\s", "", line.split(",")[0]).upper()
        lines += [*before.pop(keyword, []), line]
    return "\n".join(lines) + "\n"


def changed(cards, words):
    """Return cards with another contact: `stiffness=F`, `slope=F`, `face`, `node`, `swap`.

    `stiffness` multiplies a linear stiffness, and sets F times CalculiX's default in place of
    another law; `slope` multiplies the stick slope, and gives tied surfaces without one, which
    CalculiX refuses, the stiffness times F; `face` and `node` choose CalculiX's contact of faces or
    of nodes with faces; `swap` exchanges slave and master, in bipot's deck alone; `translations`
    leaves out supports of dofs 4 to 6; `full` integrates elements of first order in full, as bipot
    does; `once` begins each step with an increment of all of it; a pair without TYPE, which
    CalculiX refuses, gets that of faces, or where its slave is a surface of nodes that of nodes
    with faces.
    """
    factors = dict(word.split("=") for word in words if "=" in word)
    moduli = [card.numbers()[0] for card in cards if card.keyword == "ELASTIC" and card.data]
    of_nodes = {card.option("NAME").upper() for card in cards
                if card.keyword == "SURFACE" and (card.option("TYPE") or "").upper() == "NODE"}
    found = []
    for card, after in zip(cards, [*cards[1:], Card("*")], strict=True):
        if card.keyword == "SURFACEBEHAVIOR" and factors:
            law = (card.option("PRESSURE-OVERCLOSURE") or "HARD").upper()
            first = card.numbers()[0] if law in ("LINEAR", "TIED") else STIFF * max(moduli)
            kept = "TIED" if law == "TIED" else "LINEAR"
            if "stiffness" in factors:
                first *= float(factors["stiffness"])
                card = Card(f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE={kept}", [f"{first:g}"])
            if law == "TIED" and after.keyword != "FRICTION" and "slope" in factors:
                found.append(card)
                card = Card("*FRICTION", [f"1, {first * float(factors['slope']):g}"])
        elif card.keyword == "FRICTION" and card.data and "slope" in factors:
            mu, *rest = card.numbers()
            slope = rest[0] if rest and rest[0] else STIFF * max(moduli) / 10
            card = Card(card.head, [f"{mu:g}, {slope * float(factors['slope']):g}"])
        elif card.keyword == "CONTACTPAIR":
            kept = [word for word in card.head.split(",")
                    if not re.match(r"\s*TYPE\s*=", word, re.IGNORECASE)]
            slave = card.data[0].split(",")[0].strip().upper()
            kind = card.option("TYPE") or KINDS["node" if slave in of_nodes else "face"]
            kind = KINDS.get(next((word for word in words if word in KINDS), ""), kind)
            data = [",".join(line.split(",")[1::-1]) if "swap" in words else line
                    for line in card.data]
            card = Card(",".join([*kept, f" TYPE={kind}"]), data)
        elif card.keyword == "STATIC" and "once" in words and card.data:
            card = Card(card.head, ["{0:g}, {0:g}".format(card.numbers()[1])])
        elif card.keyword == "ELEMENT" and "full" in words:
            card = Card(re.sub(r"\b(C3D8|CPE4|CAX4)R\b", r"\1", card.head, flags=re.IGNORECASE),
                        card.data)
        elif card.keyword == "BOUNDARY" and "translations" in words:
            words_of = ([word.strip() for word in line.split(",")] for line in card.data)
            card = Card(card.head, [
                ", ".join([*line[:2], *(str(min(3, int(last))) for last in line[2:3]), *line[3:]])
                for line in words_of if line[1] not in ("4", "5", "6")
            ])
        found.append(card)
    return found


def is_mortar(cards, variant=""):
    """Return whether CalculiX takes contact by one of its mortar methods."""
    return any("MORTAR" in (card.option("TYPE") or "").upper()
               for card in changed(cards, variant.split()) if card.keyword == "CONTACTPAIR")


def refusal_of(message):
    """Return a refusal without names, numbers and places: what decks stumble over alike."""
    words = re.sub(r"^.*?: error: ", "", message)
    words = re.sub(r": bipot solves static frictional contact of elastic solids.*", "", words)
    words = re.sub(r"'(?!\*)[^']*'", "'...'", words)
    return re.sub(r"(?<![\w'*])-?\d[\d.e+-]*", "N", words).split(";")[0].split(": ")[0].strip()


def decks_in(folder):
    """Return the decks with contact pairs of a folder, sorted."""
    return sorted(path for path in Path(folder).rglob("*.inp") if is_contact_deck(path))
