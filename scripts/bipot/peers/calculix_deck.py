"""Write the scene of a bipot deck for CalculiX (ccx), and read what ccx found.

A rigid obstacle becomes elements that cannot deform, fixed or tied to its reference node: a
plane the upper face of one large element, a cylinder a ring of them. Contact with obstacles is node
to surface by a linear penalty with a stick slope for friction. Where a pair has two surfaces it is
surface to surface by the same penalty, or mortar without one. The elements, increments and loads
are those of the deck.
"""

import re
from dataclasses import dataclass

import numpy as np

from bipot.peers.flat_deck import DeckError, Load, LoadCard, id_lines, number

ELEMENTS = {"C3D8": "C3D8", "C3D8I": "C3D8I"}
NODES, SURFACES, MORTAR = "NODE TO SURFACE", "SURFACE TO SURFACE", "MORTAR"
# Residual and correction where ccx's iterations end at finite strain, relative to the largest force
# and displacement; by its own 5e-3 and 1e-2 a strip bent without contact was 8e-4 off.
RESIDUAL, CORRECTION = 1e-6, 1e-4
SECTORS = 2880  # elements round a cylinder: they leave its mean radius by 2e-7 of it at most


@dataclass
class Penalty:
    """The numbers that a penalty method has and bipot has not; `kind` is ccx's TYPE of contact."""

    stiffness: float  # pressure over penetration
    slope: float      # friction stress over slip while it sticks
    tension: float    # the largest tension of an open point: ccx's law is smooth there
    kind: str = NODES


@dataclass
class Master:
    """An obstacle as elements, their upper faces on it; ids are its own."""

    pair: int
    first_node: int
    first_element: int
    places: np.ndarray  # (n, 3) of its nodes
    corners: np.ndarray  # (m, 8) rows of places, the upper face last
    ref_node: int | None

    @property
    def nodes(self):
        """The ids of its nodes."""
        return range(self.first_node, self.first_node + len(self.places))

    @property
    def elements(self):
        """The ids of its elements."""
        return range(self.first_element, self.first_element + len(self.corners))


def check_translatable(scene):
    """Raise DeckError, with all reasons, where ccx cannot be given the scene."""
    reasons = []
    curved = sorted({o.kind for o in scene.obstacles.values() if o.kind not in SHAPES})
    if curved:
        reasons.append(f"obstacles of TYPE={', '.join(curved)}: only planes and cylinders are "
                       "translated")
    if scene.gaps or any(clearance(scene, pair) is None for pair in scene.pairs):
        reasons.append("*CONTACT GAP: ccx has no gap that differs from node to node")
    given = scene.clearances or any(pair.clearance is not None for pair in scene.pairs)
    if given and not scene.has_two_surfaces:
        reasons.append("gaps before an obstacle: ccx has clearances between faces alone")
    kinds = {kind for kind, _ in scene.elements.values()} - ELEMENTS.keys()
    if kinds:
        reasons.append(f"elements of TYPE={', '.join(sorted(kinds))}: ccx does not have them")
    if not scene.n_forces:
        reasons.append("no *CONTACT PAIR, and nothing that *BOUNDARY moves: there is nothing to "
                       "compare")
    if any(name not in scene.faces for tie in scene.ties for name in tie):
        reasons.append("*TIE of a surface without faces: ccx needs them")
    if scene.has_two_surfaces and any(pair.slave not in scene.faces for pair in scene.pairs):
        reasons.append("a slave surface without faces beside a pair of surfaces: ccx needs them")
    if any(card.keyword == "DSLOAD" and load.target not in scene.faces
           for step in scene.steps for card in step.cards for load in card.loads):
        reasons.append("*DSLOAD on a surface without faces: ccx needs them")
    if reasons:
        raise DeckError("; ".join(reasons))


def plane_elements(obstacle, low, high, reach):
    """Return places and elements of a plane, `reach` wide about the box that bodies are in."""
    point, normal = np.array(obstacle.numbers[:3]), np.array(obstacle.numbers[3:6])
    normal /= np.linalg.norm(normal)
    first, second = across(normal)
    middle = (low + high) / 2
    middle += normal * ((point - middle) @ normal)
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    upper = np.array([middle + reach * (a * first + b * second) for a, b in square])
    return np.concatenate([upper - reach * normal, upper]), np.arange(8)[None]


def cylinder_elements(obstacle, low, high, reach):
    """Return places and elements of a cylinder, as far along its axis as bodies can be."""
    point, axis = np.array(obstacle.numbers[:3]), np.array(obstacle.numbers[3:6])
    radius = obstacle.numbers[6]
    axis /= np.linalg.norm(axis)
    first, second = across(axis)
    middle = point + axis * (((low + high) / 2 - point) @ axis)
    # On the chords of the sectors the mean radius is that of the cylinder.
    corner = radius / (1 - (np.pi / SECTORS) ** 2 / 3)
    back = 1.2 * corner if obstacle.inner else 0.8 * corner
    angle = 2 * np.pi * np.arange(SECTORS) / SECTORS
    radial = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    places = np.concatenate([middle + r * radial + z * axis
                             for r in (back, corner) for z in (-reach, reach)])
    here = np.arange(SECTORS)
    beyond = (here + 1) % SECTORS
    lower, upper = here, here + SECTORS  # at -reach and at reach, on the back
    sides = [here, beyond, beyond + SECTORS, upper]
    if obstacle.inner:
        sides = [lower, upper, beyond + SECTORS, beyond]
    elements = np.stack([*sides, *(side + 2 * SECTORS for side in sides)], axis=1)
    return places, elements


SHAPES = {"PLANE": plane_elements, "CYLINDER": cylinder_elements}


def across(axis):
    """Return two unit vectors, with `axis` a right-handed frame (first, second, axis)."""
    along = np.eye(3)[np.argmin(abs(axis))]
    first = np.cross(along, axis)
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def make_masters(scene):
    """Return the obstacle of each pair that has one, wide enough for the body wherever it goes."""
    places = np.array([scene.nodes[node] for _, ids in scene.elements.values() for node in ids])
    low, high = places.min(axis=0), places.max(axis=0)
    travel = sum(
        abs(float(load.words[-1])) for step in scene.steps for card in step.cards
        if card.keyword == "BOUNDARY" for load in card.loads
    )
    reach = 2 * np.linalg.norm(high - low) + travel
    node = max(scene.nodes) + 1
    element = max([*scene.elements, *scene.skipped]) + 1
    masters = []
    for k, pair in enumerate(scene.pairs):
        if pair.master not in scene.obstacles:
            continue
        obstacle = scene.obstacles[pair.master]
        places, elements = SHAPES[obstacle.kind](obstacle, low, high, reach)
        masters.append(Master(k, node, element, places, elements, obstacle.ref_node))
        node += len(places)
        element += len(elements)
    return masters


def contact_lines(scene, masters, penalty):
    """Give the master elements, surfaces, interactions and pairs."""
    for master in masters:
        k = master.pair + 1
        yield "*NODE"
        for name, place in zip(master.nodes, master.places, strict=True):
            yield f"{name}, " + ", ".join(f"{x:.12g}" for x in place)
        yield from id_lines(f"*NSET, NSET=OBSTACLE{k}", list(master.nodes))
        yield f"*ELEMENT, TYPE=C3D8, ELSET=OBSTACLE{k}"
        for name, places in zip(master.elements, master.corners, strict=True):
            yield f"{name}, " + ", ".join(str(master.first_node + c) for c in places)
        yield f"*SOLID SECTION, ELSET=OBSTACLE{k}, MATERIAL=MATERIAL1"
        yield f"*SURFACE, NAME=MASTER{k}, TYPE=ELEMENT"
        yield from (f"{element}, S2" for element in master.elements)
        if master.ref_node is not None:
            for node in master.nodes:
                for axis in (1, 2, 3):
                    tie = f"{node}, {axis}, 1., {master.ref_node}, {axis}, -1."
                    yield from ("*EQUATION", "2", tie)
    for k, pair in enumerate(scene.pairs, 1):
        if pair.master not in scene.obstacles:
            yield f"*SURFACE, NAME=MASTER{k}, TYPE=ELEMENT"
            yield from (f"{element}, S{face}" for element, face in scene.faces[pair.master])
        if penalty.kind == NODES:
            yield f"*SURFACE, NAME=SLAVE{k}, TYPE=NODE"
            yield from (f"{node}," for node in slave_nodes(scene, pair))
        else:
            yield f"*SURFACE, NAME=SLAVE{k}, TYPE=ELEMENT"
            yield from (f"{element}, S{face}" for element, face in scene.faces[pair.slave])
            yield from id_lines(f"*NSET, NSET=SLAVES{k}", slave_nodes(scene, pair))
        yield f"*SURFACE INTERACTION, NAME=CONTACT{k}"
        if penalty.kind == MORTAR:
            yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD"
        else:
            yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
            yield f"{penalty.stiffness:.12g}, {penalty.tension:.12g}"
        mu = scene.friction[pair.interaction]
        if mu > 0:
            yield from ("*FRICTION", f"{mu:.12g}, {penalty.slope:.12g}")
        adjusted = f", ADJUST={pair.adjust}" if pair.adjust is not None else ""
        yield f"*CONTACT PAIR, INTERACTION=CONTACT{k}, TYPE={penalty.kind}{adjusted}"
        yield f"SLAVE{k}, MASTER{k}"
        gap = clearance(scene, pair) + (pair.clearance or 0.0)
        if gap or pair.clearance is not None:
            yield f"*CLEARANCE, MASTER=MASTER{k}, SLAVE=SLAVE{k}, VALUE={gap:.12g}"


def support_lines(scene):
    """Give the sets of supports whose forces are compared, where there is no pair."""
    if not scene.pairs:
        for k, name in enumerate(scene.supports, 1):
            yield from id_lines(f"*NSET, NSET=SUPPORT{k}", scene.nodes_of(name))


def joint_lines(scene):
    """Give ties, and the temperatures at first of all nodes where anything expands."""
    for k, tie in enumerate(scene.ties, 1):
        for side, name in zip(("SLAVE", "MASTER"), tie, strict=True):
            yield f"*SURFACE, NAME=TIE{side}{k}, TYPE=ELEMENT"
            yield from (f"{element}, S{face}" for element, face in scene.faces[name])
        yield from (f"*TIE, NAME=TIE{k}, ADJUST=NO", f"TIESLAVE{k}, TIEMASTER{k}")
    if any("EXPANSION" in cards for cards in scene.materials.values()):
        yield from ("*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALLNODES, 0.")
        for name, temperature in scene.temperatures:
            yield from (f"{node}, {temperature}" for node in scene.nodes_of(name))


def resultant_lines(scene, masters, kind):
    """Give the cards that print the resultants of the pairs.

    With a penalty ccx counts contact among the internal forces, so what holds an obstacle is its
    force on the body; with mortar contact is what acts on the slave nodes from outside.
    """
    if kind == MORTAR:
        for k in range(1, len(scene.pairs) + 1):
            yield from (f"*NODE PRINT, NSET=SLAVES{k}, TOTALS=ONLY", "RF")
        return
    if not scene.pairs:
        for k in range(1, scene.n_forces + 1):
            yield from (f"*NODE PRINT, NSET=SUPPORT{k}, TOTALS=ONLY", "RF")
    for master in masters:
        yield from (f"*NODE PRINT, NSET=OBSTACLE{master.pair + 1}, TOTALS=ONLY", "RF")
    for k, pair in enumerate(scene.pairs, 1):
        if pair.master not in scene.obstacles:
            yield from (f"*CONTACT PRINT, SLAVE=SLAVE{k}, MASTER=MASTER{k}", "CF")


def slave_nodes(scene, pair):
    """Return the ids of a pair's slave nodes."""
    if pair.slave in scene.faces:
        return scene.nodes_on(pair.slave)
    return scene.nodes_of(pair.slave)


def clearance(scene, pair):
    """Return the gap added before all nodes of a pair; None where it differs between them."""
    total = dict.fromkeys(slave_nodes(scene, pair), 0.0)
    for name, gap in scene.clearances:
        for node in scene.nodes_of(name):
            if node in total:
                total[node] += gap
    values = set(total.values())
    return values.pop() if len(values) == 1 else None


class Targets:
    """Names in ccx's deck of the sets and surfaces that loads act on, and the cards they need."""

    def __init__(self, scene):
        self.scene, self.names, self.lines = scene, {}, []

    def name(self, keyword, target):
        """Return the name of a load's target, its card written once."""
        kind = {"DLOAD": "E", "DSLOAD": "S"}.get(keyword, "N")
        if (kind, target) in self.names:
            return self.names[kind, target]
        name = self.names[kind, target] = f"LOADED{kind}{len(self.names) + 1}"
        if kind == "N":
            self.lines += id_lines(f"*NSET, NSET={name}", self.scene.nodes_of(target))
        elif kind == "E":
            ids = self.scene.elements_of(target) if target else list(self.scene.elements)
            self.lines += id_lines(f"*ELSET, ELSET={name}", ids)
        else:
            self.lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
            self.lines += [f"{element}, S{face}" for element, face in self.scene.faces[target]]
        return name


def step_lines(scene, masters, targets, kind=NODES):
    """Give the steps: the deck's loads, the obstacles held, and the resultants printed.

    At finite strain ccx may cut the deck's increments, and prints at their ends: else its Newton
    iterations fail where contact begins to slide.
    """
    fixed = [master for master in masters if master.ref_node is None]
    hold = [Load(f"OBSTACLE{master.pair + 1}", ["1", "3", "0."]) for master in fixed]
    for k, step in enumerate(scene.steps, 1):
        increment, period = f"{step.period / step.n_increments:.12g}", f"{step.period:.12g}"
        points = f", TIME POINTS=INCREMENTS{k}" if scene.finite else ""
        if scene.finite:
            yield from ("*STEP, INC=1000000, NLGEOM", "*CONTROLS, PARAMETERS=FIELD")
            yield from (f"{RESIDUAL:g}, {CORRECTION:g}", "*STATIC")
            yield f"{increment}, {period}, , {increment}"
        else:
            yield from ("*STEP, INC=1000000", "*STATIC, DIRECT", f"{increment}, {period}")
        cards = list(step.cards)
        # OP=NEW would set the obstacles free, so they are held again behind every *BOUNDARY.
        last = max((k for k, c in enumerate(cards) if c.keyword == "BOUNDARY"), default=-1)
        for card in cards[: last + 1]:
            yield from load_lines(card, targets)
        if hold:
            yield from load_lines(LoadCard("BOUNDARY", {}, hold), None)
        for card in cards[last + 1 :]:
            yield from load_lines(card, targets)
        for line in resultant_lines(scene, masters, kind):
            yield line + points if line.startswith("*") else line
        yield "*END STEP"


def time_lines(scene):
    """Give the ends of the deck's increments at finite strain; ccx wants them before all steps."""
    for k, step in enumerate(scene.steps if scene.finite else (), 1):
        yield f"*TIME POINTS, NAME=INCREMENTS{k}"
        n = step.n_increments
        yield from (f"{step.period * j / n:.12g}," for j in range(1, n + 1))


def load_lines(card, targets):
    """Give a loading card; `targets` None where its targets are names of ccx's deck."""
    if not card.loads:
        return
    options = "".join(f", {name}={value}" for name, value in card.options.items())
    yield f"*{card.keyword}{options}"
    for load in card.loads:
        name = targets.name(card.keyword, load.target) if targets else load.target
        yield ", ".join([name, *map(short, load.words)])


def short(word):
    """Return a number in the 20 letters that ccx reads of it; other words as they are."""
    return word if len(word) <= 20 else f"{number(word):.12g}"


def deck_lines(scene, penalty):
    """Return the lines of ccx's deck; DeckError where the scene has no translation."""
    check_translatable(scene)
    masters, targets = make_masters(scene), Targets(scene)
    steps = list(step_lines(scene, masters, targets, penalty.kind))
    model = [*scene.model_lines(), *contact_lines(scene, masters, penalty), *support_lines(scene),
             *joint_lines(scene), *time_lines(scene)]
    return ["*HEADING", "written by scripts/compare", *model, *targets.lines, *steps]


FORCES = (  # what ccx prints of a pair before the three numbers
    r"total force \(fx,fy,fz\) for set (?:OBSTACLE|SLAVES|SUPPORT)(\d+) and time\s+(\S+)",
    r"statistics for slave set SLAVE(\d+), master set \S+ and time\s+(\S+)"
    r"\s+total surface force \(fx,fy,fz\) and moment about the origin\s+\(mx,my,mz\)",
)


def read_resultants(path, n_forces):
    """Return the forces on the slave bodies, (T, pairs, 3), of the increments in a .dat file."""
    text = path.read_text(encoding="ascii", errors="replace") if path.is_file() else ""
    rows = {}
    for head in FORCES:
        for pair, time, *force in re.findall(head + 3 * r"\s+([-+.\dE]+)", text):
            rows.setdefault(float(time), {})[int(pair)] = [float(one) for one in force]
    whole = [row for _, row in sorted(rows.items()) if len(row) == n_forces]
    return np.array([[row[k + 1] for k in range(n_forces)] for row in whole]
                    ).reshape(-1, n_forces, 3)
