"""A bipot deck as a scene of ids, from what `bipot --flat` prints of it.

    scene = read_flat(program, Path("input/block.inp"), {"n": "8"})
    scene.take_mesh(result)          # coordinates as the program had them, *ADJUST and all
    lines = scene.model_lines()      # *NODE to *SOLID SECTION in the common dialect

It is for programs that read the Abaqus dialect but not our cards. The program has found all that
is wrong in the deck, so mistakes are not looked for here.
"""

import math
import re
from dataclasses import dataclass, field

import numpy as np

from bipot.element_faces import ELEMENT_FACES, face_nodes, outer_faces
from bipot.errors import RunError
from bipot.running import flat

ELEMENTS = {"C3D8": "C3D8", "C3D8I": "C3D8I", "C3D8B": "C3D8B"} | dict.fromkeys(
    ("C3D8R", "C3D8H", "C3D8RH"), "C3D8"
)
OTHER_SOLIDS = ("C3D6", "C3D5", "C3D4", "C3D10", "C3D13", "C3D15", "C3D20", "C3D20R")
HELD = {
    "XSYMM": (1,), "YSYMM": (2,), "ZSYMM": (3,), "XASYMM": (2, 3), "YASYMM": (1, 3),
    "ZASYMM": (1, 2), "PINNED": (1, 2, 3), "ENCASTRE": (1, 2, 3),
}
NOTHING = {  # what asks for output or for a way of solving, and says nothing about the scene
    "HEADING", "UNITS", "CONTACT SOLVER", "PRECISION", "BODY SOLVER", "ACCURACY", "NODE FILE",
    "EL FILE", "CONTACT FILE", "NODE PRINT", "EL PRINT", "CONTACT PRINT", "OUTPUT", "NODE OUTPUT",
    "ELEMENT OUTPUT", "CONTACT OUTPUT", "CONTROLS", "PREPRINT", "RESTART", "END STEP",
}


class DeckError(Exception):
    """The deck holds something that has no place in a flat scene."""


CONSTANTS_A_TERM = {"OGDEN": 3, "YEOH": 2, "REDUCED POLYNOMIAL": 2}  # of *HYPERELASTIC


@dataclass
class Card:
    """A keyword line with its data lines, parameters put in."""

    keyword: str
    options: dict
    rows: list

    def name(self, option, default=None):
        """Return an option that is a name; DeckError where it is missing and has no default."""
        if option not in self.options and default is None:
            raise DeckError(f"*{self.keyword}: no {option}=")
        return self.options.get(option, default)


@dataclass
class Obstacle:
    """A rigid obstacle."""

    kind: str
    numbers: list
    ref_node: int | None
    inner: bool = False  # the body is inside a cylinder


@dataclass
class Pair:
    """A contact pair; the master is an obstacle or a surface of faces."""

    slave: str
    master: str
    interaction: str
    adjust: str | None = None  # from how far away slave nodes are put on the master
    clearance: float | None = None  # in place of the gaps of the mesh


@dataclass
class Load:
    """A line of a loading card: the words after the set, as they go out."""

    target: str
    words: list


@dataclass
class LoadCard:
    """A loading card of a step, its values resolved."""

    keyword: str
    options: dict
    loads: list


@dataclass
class Step:
    """A step: increment, period, and its loads."""

    increment: float = 1.0
    period: float = 1.0
    cards: list = field(default_factory=list)

    @property
    def n_increments(self):
        """Number of increments, as bipot counts them."""
        return max(1, math.floor(self.period / self.increment + 0.5))


# --- Text to cards --------------------------------------------------------------------------------


def number(text):
    """Return the number of a text such as "2.1D+05" or "2.1+5"; ValueError where it is none."""
    text = text.strip().replace("d", "e").replace("D", "E")
    exponent = re.fullmatch(r"([+-]?[\d.]+)([+-]\d+)", text)
    return float(f"{exponent[1]}E{exponent[2]}" if exponent else text)


def words_of(line):
    """Return the words of a line between commas, names in capitals and without quotes."""
    parts = re.split(r',(?=(?:[^"]*"[^"]*")*[^"]*$)', line)
    return [part.strip().strip('"').upper() for part in parts]


def cards_of(lines):
    """Give the cards of a flat deck."""
    card, goes_on = None, False
    for line in lines:
        if line.startswith("**") or not line.strip():
            continue
        if line.lstrip().startswith("*") or goes_on:
            words = [word for word in words_of(line) if word]
            if not goes_on:
                if card is not None:
                    yield card
                card = Card(" ".join(words[0].lstrip("* ").split()), {}, [])
                words = words[1:]
            for word in words:
                option, _, value = word.partition("=")
                card.options[" ".join(option.split())] = value.strip().strip('"')
            goes_on = line.rstrip().endswith(",")
        elif card.keyword != "HEADING":
            card.rows.append(words_of(line))
    if card is not None:
        yield card


# --- Cards to a scene -----------------------------------------------------------------------------


class Scene:
    """A flat scene; every set is a list of ids, every face an element and its number 1 to 6."""

    def __init__(self):
        self.nodes = {}          # id: coordinates
        self.elements = {}       # id: (type, eight ids)
        self.skipped = {}        # id: nodes of a cell that is no hexahedron
        self.node_sets = {}
        self.element_sets = {}
        self.faces = {}          # surface: [(element, face)]
        self.node_surfaces = {}  # surface: [ids]
        self.materials = {}      # name: {"ELASTIC": [words], "DENSITY": [words]}
        self.sections = []       # (element set, material)
        self.ties = []           # (slave, master), both surfaces
        self.temperatures = []   # at first: (set, temperature)
        self.obstacles = {}
        self.pairs = []
        self.friction = {}       # interaction: mu
        self.amplitudes = {}     # name: [numbers]
        self.steps = []
        self.gaps = False        # whether a *CONTACT GAP adds a formula to the gaps of the mesh
        self.finite = False      # whether strains are finite: *STEP, NLGEOM
        self.clearances = []     # what it adds besides: (nodes' name, gap)

    # What the readers of single cards share.

    def nodes_of(self, name):
        """Return the ids that a set, a block's side, a surface or an id names."""
        if name in self.node_sets:
            return self.node_sets[name]
        if name in self.node_surfaces:
            return self.node_surfaces[name]
        if name in self.faces:
            return self.nodes_on(name)
        if name.isdigit():
            return [int(name)]
        raise DeckError(f"no set of nodes '{name}'")

    def nodes_on(self, surface):
        """Return the ids on a surface of faces, each once, in the order of the faces."""
        found = {}
        for element, face in self.faces[surface]:
            corners = self.elements[element][1]
            found.update(dict.fromkeys(corners[k] for k in ELEMENT_FACES[face - 1]))
        return list(found)

    def find_faces(self, names):
        """Give surfaces and sets of nodes their faces: outer ones with all four nodes there."""
        elements = np.array([corners for _, corners in self.elements.values()]).reshape(-1, 8)
        ids = list(self.elements)
        faces = outer_faces(elements)
        corners = face_nodes(elements, faces)
        for name in names:
            if name not in self.node_surfaces and name not in self.node_sets:
                continue
            inside = np.isin(corners, self.nodes_of(name)).all(axis=1)
            if inside.any():
                self.faces[name] = [(ids[row], int(face) + 1) for row, face in faces[inside]]

    def elements_of(self, name):
        """Return the ids that a set of elements or an id names."""
        if name in self.element_sets:
            return self.element_sets[name]
        if name.isdigit():
            return [int(name)]
        raise DeckError(f"no set of elements '{name}'")

    def add(self, sets, name, ids):
        """Add ids to a set, each once."""
        sets[name] = list(dict.fromkeys([*sets.get(name, ()), *ids]))

    @property
    def has_two_surfaces(self):
        """Whether any pair's master is a surface."""
        return any(pair.master not in self.obstacles for pair in self.pairs)

    @property
    def supports(self):
        """The sets that *BOUNDARY names, if it moves any, and the ids if it names no set."""
        loads = [load for step in self.steps for card in step.cards if card.keyword == "BOUNDARY"
                 for load in card.loads]
        if not any(float(load.words[2]) for load in loads):
            return []
        named = list(dict.fromkeys(load.target for load in loads))
        return [name for name in named if not name.isdigit()] or named

    @property
    def n_forces(self):
        """Number of forces that runs are compared by: of pairs, or of supports without a pair."""
        return len(self.pairs) or len(self.supports)

    @property
    def material_of(self):
        """The material of each element by its id."""
        return {e: material for name, material in self.sections for e in self.elements_of(name)}

    def take_mesh(self, result):
        """Take the coordinates from a result of the deck; DeckError where its elements differ."""
        ids = result.node_ids
        self.nodes |= dict(zip(ids.tolist(), result.points.tolist(), strict=True))
        corners = ids[result.elements].tolist()
        elements = dict(zip(result.element_ids.tolist(), corners, strict=True))
        ours = {name: list(corners) for name, (_, corners) in self.elements.items()}
        if elements != ours:
            raise DeckError("the mesh read from the deck is not the one in the result file")

    # The mesh as text.

    def model_lines(self):
        """Give the lines of mesh, sets, materials and sections in the common dialect."""
        yield "*NODE, NSET=ALLNODES"
        for name, place in self.nodes.items():
            yield f"{name}, " + ", ".join(f"{x:.12g}" for x in place)
        for kind in sorted({kind for kind, _ in self.elements.values()}):
            yield f"*ELEMENT, TYPE={kind}, ELSET=ALL{kind}"
            for name, (found, corners) in self.elements.items():
                if found == kind:
                    yield f"{name}, " + ", ".join(map(str, corners))
        for i, (name, cards) in enumerate(self.materials.items(), 1):
            yield f"*MATERIAL, NAME=MATERIAL{i}"
            for keyword, words in cards.items():
                yield f"*{keyword}"
                yield from (", ".join(words[k : k + 8]) for k in range(0, len(words), 8))
            ids = [e for e, material in self.material_of.items() if material == name]
            yield from id_lines(f"*ELSET, ELSET=MADEOF{i}", ids)
            yield f"*SOLID SECTION, ELSET=MADEOF{i}, MATERIAL=MATERIAL{i}"
        for name, numbers in self.amplitudes.items():
            yield f"*AMPLITUDE, NAME={name}"
            yield from (f"{t:.12g}, {f:.12g}" for t, f in zip(numbers[::2], numbers[1::2],
                                                              strict=True))


def id_lines(head, ids):
    """Give a card that lists ids, eight a line."""
    yield head
    for k in range(0, len(ids), 8):
        yield ", ".join(map(str, ids[k : k + 8])) + ","


def read_set(card, scene):
    """Add the ids of a *NSET or *ELSET."""
    kind = card.keyword
    sets, members = (
        (scene.node_sets, scene.nodes_of) if kind == "NSET"
        else (scene.element_sets, scene.elements_of)
    )
    name = card.name(kind)
    ids = []
    if kind == "NSET" and "ELSET" in card.options:
        for element in scene.elements_of(card.options["ELSET"]):
            ids += scene.skipped.get(element) or scene.elements[element][1]
    for row in card.rows:
        words = [word for word in row if word]
        if "GENERATE" in card.options:
            first, last, *step = (int(word) for word in words)
            ids += range(first, last + 1, step[0] if step else 1)
        else:
            for word in words:
                ids += members(word)
    known = scene.nodes if kind == "NSET" else scene.elements | scene.skipped
    scene.add(sets, name, [one for one in ids if one in known])


def read_elements(card, scene):
    """Add the elements of a card."""
    kind = card.name("TYPE")
    if kind in OTHER_SOLIDS:
        raise DeckError(f"elements of TYPE={kind} have no translation")
    numbers = [int(word) for row in card.rows for word in row if word]
    # Of what is no element the number of nodes is not known; such cards have a line an element.
    rows = (
        [numbers[k : k + 9] for k in range(0, len(numbers), 9)] if kind in ELEMENTS
        else [[int(word) for word in row if word] for row in card.rows]
    )
    for name, *corners in rows:
        if kind in ELEMENTS:
            scene.elements[name] = (ELEMENTS[kind], corners)
        else:
            scene.skipped[name] = corners
    if "ELSET" in card.options:
        scene.add(scene.element_sets, card.options["ELSET"], [name for name, *_ in rows])


def read_surface(card, scene):
    """Add a surface of faces or nodes."""
    name = card.name("NAME")
    if card.options.get("TYPE", "ELEMENT") == "NODE":
        scene.node_surfaces[name] = [
            node for row in card.rows for word in row if word for node in scene.nodes_of(word)
        ]
        return
    scene.faces[name] = [
        (element, int(face.lstrip("S")))
        for where, face, *_ in card.rows for element in scene.elements_of(where)
        if element in scene.elements
    ]


def read_load(card, scene, step):
    """Add the loads of a card to a step, directions as numbers and values given."""
    loads = []
    for row in card.rows:
        target, words = row[0], row[1:]
        if card.keyword == "TEMPERATURE":
            loads.append(Load(target, words[:1]))
        elif card.keyword == "BOUNDARY":
            loads += [Load(target, words) for words in boundary_words(words)]
        elif card.keyword in ("CLOAD", "DSLOAD"):
            loads.append(Load(target, words))
        else:
            given = [word or "0." for word in words]
            if given and given[0] == "GRAV":
                given += ["0."] * (5 - len(given))
            loads.append(Load(target, given))
    if "FIXED" in card.options:
        raise DeckError("FIXED of *BOUNDARY has no translation")
    options = {name: card.options[name] for name in ("AMPLITUDE", "OP") if name in card.options}
    step.cards.append(LoadCard(card.keyword, options, loads))


def boundary_words(words):
    """Return first and last direction and value of a line of *BOUNDARY, directions 1 to 3 only."""
    if words[0] in HELD:
        return [[str(axis), str(axis), "0."] for axis in HELD[words[0]]]
    first = int(words[0])
    last = int(words[1]) if len(words) > 1 and words[1] else first
    value = words[2] if len(words) > 2 and words[2] else "0."
    if last > 3 and float(value):
        raise DeckError("a turn by *BOUNDARY has no translation")
    return [[str(first), str(min(last, 3)), value]] if first <= 3 else []


def read_flat(program, path, overrides):
    """Return the flat scene of a deck; DeckError where it is wrong or has a card not known here."""
    try:
        text = flat(path, parameters=overrides, program=program)
    except RunError as error:
        raise DeckError(str(error)) from error
    scene, step, before = Scene(), None, Step()
    material = interaction = None
    for card in cards_of(text.splitlines()):
        match card.keyword:
            case "NODE":
                for row in card.rows:
                    words = [*row[1:4], "", "", ""][:3]
                    scene.nodes[int(row[0])] = [number(word or "0.") for word in words]
                if "NSET" in card.options:
                    ids = [int(row[0]) for row in card.rows]
                    scene.add(scene.node_sets, card.options["NSET"], ids)
            case "ELEMENT":
                read_elements(card, scene)
            case "NSET" | "ELSET":
                read_set(card, scene)
            case "SURFACE":
                read_surface(card, scene)
            case "MATERIAL":
                material = scene.materials.setdefault(card.name("NAME"), {})
            case "ELASTIC" | "DENSITY" | "EXPANSION":
                if not card.options.get("TYPE", "ISO").upper().startswith("ISO"):
                    raise DeckError(f"*{card.keyword}, TYPE={card.options['TYPE']}: materials "
                                    "that are not isotropic are not compared")
                words = [word for row in card.rows for word in row if word]
                material[card.keyword] = [f"{number(word):.12g}" for word in words]
            case "HYPERELASTIC":
                law = next(word for word in card.options if word != "N")
                n = int(card.options.get("N", 3 if law == "YEOH" else 1))
                words = [f"{number(word):.12g}" for row in card.rows for word in row if word]
                if law in CONSTANTS_A_TERM:
                    # D2 and D3 are 0 or left out here: no such term. In ccx 0 is a stiff one, and
                    # as many lines are read as all constants have.
                    words = words[: (CONSTANTS_A_TERM[law] - 1) * n + 1] + ["1e30"] * (n - 1)
                material[f"HYPERELASTIC, {law}" + f", N={n}" * ("N" in card.options)] = words
            case "SOLID SECTION":
                scene.sections.append((card.name("ELSET"), card.name("MATERIAL")))
            case "OBSTACLE":
                words = [word for row in card.rows for word in row if word]
                ref = card.options.get("REF NODE")
                scene.obstacles[card.name("NAME")] = Obstacle(
                    card.name("TYPE"), [number(word) for word in words], int(ref) if ref else None,
                    "INNER" in card.options,
                )
            case "SURFACE INTERACTION":
                interaction = card.name("NAME")
                scene.friction[interaction] = 0.0
            case "FRICTION":
                if {"TAUMAX", "EXPONENTIAL DECAY"} & set(card.options) or len(card.rows) > 1:
                    raise DeckError("*FRICTION that depends on pressure or rate is not compared")
                scene.friction[interaction] = number(card.rows[0][0])
            case "CONTACT PAIR":
                for slave, master, *_ in card.rows:
                    scene.pairs.append(Pair(slave, master, card.name("INTERACTION"),
                                            card.options.get("ADJUST")))
            case "CONTACT GAP":
                for row in card.rows:
                    if "PARABOLA" in card.options or len(row) != 2:
                        scene.gaps = True
                    else:
                        scene.clearances.append((row[0], number(row[1])))
            case "CLEARANCE":
                named = (card.name("SLAVE"), card.name("MASTER"))
                for pair in scene.pairs:
                    if (pair.slave, pair.master) == named:
                        pair.clearance = number(card.name("VALUE"))
            case "AMPLITUDE":
                for option in ("TIME", "DEFINITION"):
                    if card.options.get(option, "TABULAR").upper() not in ("STEP TIME", "TABULAR"):
                        raise DeckError(f"{option} of *AMPLITUDE has no translation")
                words = [word for row in card.rows for word in row if word]
                scene.amplitudes[card.name("NAME")] = [number(word) for word in words]
            case "TIE":
                scene.ties += [tuple(row[:2]) for row in card.rows]
            case "INITIAL CONDITIONS":
                scene.temperatures += [tuple(row[:2]) for row in card.rows]
            case "SURFACE BEHAVIOR":
                if card.options.get("PRESSURE-OVERCLOSURE", "").upper() == "TIED":
                    raise DeckError("pairs that *SURFACE BEHAVIOR ties have no translation")
            case "CONTACT INTERFERENCE":
                raise DeckError("*CONTACT INTERFERENCE has no translation")
            case "STEP":
                scene.finite |= card.options.get("NLGEOM", "NO").upper() != "NO"
                step = Step()
                if not scene.steps:
                    step.cards = before.cards
                scene.steps.append(step)
            case "STATIC":
                row = [number(word) if word else 0.0 for word in (*card.rows, [])[0]]
                given, period, _, largest = [*row, 0.0, 0.0, 0.0, 0.0][:4]
                step.period = period or 1.0
                step.increment = min(given or step.period, largest or math.inf)
            case "BOUNDARY" | "CLOAD" | "DLOAD" | "DSLOAD" | "TEMPERATURE":
                read_load(card, scene, before if step is None else step)
            case keyword if keyword in NOTHING:
                pass
            case keyword:
                raise DeckError(f"*{keyword} has no translation")
    wanted = {load.target for step in scene.steps for card in step.cards for load in card.loads
              if card.keyword == "DSLOAD"}
    wanted.update(*scene.ties)
    if scene.has_two_surfaces:
        wanted |= {name for pair in scene.pairs for name in (pair.slave, pair.master)}
    scene.find_faces(sorted(wanted - scene.faces.keys()))
    return scene
