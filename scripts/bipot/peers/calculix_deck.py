"""Write the scene of a bipot deck for CalculiX (ccx), and read what ccx found.

A rigid plane becomes the upper face of one large brick that cannot deform: fixed, or tied to the
obstacle's reference node. The contact is node to surface by a linear penalty, the friction by a
stick slope. The elements, increments and loads are those of the deck.
"""

import re
from dataclasses import dataclass

import numpy as np

from bipot.peers.flat_deck import DeckError, Load, LoadCard, id_lines

ELEMENTS = {"C3D8": "C3D8", "C3D8I": "C3D8I"}


@dataclass
class Penalty:
    """The numbers that a penalty method has and bipot has not."""

    stiffness: float  # pressure over penetration
    slope: float      # friction stress over slip while it sticks
    tension: float    # the largest tension of an open point: ccx's law is smooth there


@dataclass
class Plane:
    """The master surface of a pair: a brick with ids of its own, its upper face on the plane."""

    pair: int
    first_node: int
    element: int
    corners: np.ndarray  # (8, 3)
    ref_node: int | None


def check_translatable(scene):
    """Raise DeckError, with all reasons, where ccx cannot be given the scene."""
    reasons = []
    curved = sorted({o.kind for o in scene.obstacles.values() if o.kind != "PLANE"})
    if curved:
        reasons.append(f"obstacles of TYPE={', '.join(curved)}: only planes are translated")
    if scene.gaps:
        reasons.append("*CONTACT GAP: ccx has no gap that differs from node to node")
    kinds = {kind for kind, _ in scene.elements.values()} - ELEMENTS.keys()
    if kinds:
        reasons.append(f"elements of TYPE={', '.join(sorted(kinds))}: ccx does not have them")
    if not scene.pairs:
        reasons.append("no *CONTACT PAIR: there is nothing to compare")
    if any(card.keyword == "DSLOAD" and load.target not in scene.faces
           for step in scene.steps for card in step.cards for load in card.loads):
        reasons.append("*DSLOAD on a surface of nodes: ccx needs its faces")
    if reasons:
        raise DeckError("; ".join(reasons))


def make_planes(scene):
    """Return the master surface of each pair, wide enough for the body wherever it goes."""
    places = np.array([scene.nodes[node] for _, ids in scene.elements.values() for node in ids])
    low, high = places.min(axis=0), places.max(axis=0)
    travel = sum(
        abs(float(load.words[-1])) for step in scene.steps for card in step.cards
        if card.keyword == "BOUNDARY" for load in card.loads
    )
    reach = 2 * np.linalg.norm(high - low) + travel
    node = max(scene.nodes) + 1
    element = max([*scene.elements, *scene.skipped]) + 1
    planes = []
    for k, pair in enumerate(scene.pairs):
        obstacle = scene.obstacles[pair.obstacle]
        point, normal = np.array(obstacle.numbers[:3]), np.array(obstacle.numbers[3:6])
        normal /= np.linalg.norm(normal)
        along = np.eye(3)[np.argmin(abs(normal))]
        first = np.cross(along, normal)
        first /= np.linalg.norm(first)
        second = np.cross(normal, first)
        middle = (low + high) / 2
        middle += normal * ((point - middle) @ normal)
        square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        upper = np.array([middle + reach * (a * first + b * second) for a, b in square])
        corners = np.concatenate([upper - reach * normal, upper])
        planes.append(Plane(k, node + 8 * k, element + k, corners, obstacle.ref_node))
    return planes


def contact_lines(scene, planes, penalty):
    """Give the master bricks, surfaces, interactions and pairs."""
    for plane in planes:
        k = plane.pair + 1
        yield "*NODE"
        for i, place in enumerate(plane.corners):
            yield f"{plane.first_node + i}, " + ", ".join(f"{x:.12g}" for x in place)
        ids = list(range(plane.first_node, plane.first_node + 8))
        yield from id_lines(f"*NSET, NSET=PLANE{k}", ids)
        yield f"*ELEMENT, TYPE=C3D8, ELSET=PLANE{k}"
        yield f"{plane.element}, " + ", ".join(map(str, ids))
        yield f"*SOLID SECTION, ELSET=PLANE{k}, MATERIAL=MATERIAL1"
        yield from (f"*SURFACE, NAME=MASTER{k}, TYPE=ELEMENT", f"{plane.element}, S2")
        if plane.ref_node is not None:
            for node in ids:
                for axis in (1, 2, 3):
                    tie = f"{node}, {axis}, 1., {plane.ref_node}, {axis}, -1."
                    yield from ("*EQUATION", "2", tie)
        pair = scene.pairs[plane.pair]
        yield f"*SURFACE, NAME=SLAVE{k}, TYPE=NODE"
        yield from (f"{node}," for node in slave_nodes(scene, pair))
        yield f"*SURFACE INTERACTION, NAME=CONTACT{k}"
        yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
        yield f"{penalty.stiffness:.12g}, {penalty.tension:.12g}"
        mu = scene.friction[pair.interaction]
        if mu > 0:
            yield from ("*FRICTION", f"{mu:.12g}, {penalty.slope:.12g}")
        yield f"*CONTACT PAIR, INTERACTION=CONTACT{k}, TYPE=NODE TO SURFACE"
        yield f"SLAVE{k}, MASTER{k}"


def slave_nodes(scene, pair):
    """Return the ids of a pair's slave nodes."""
    if pair.slave in scene.faces:
        return scene.nodes_on(pair.slave)
    return scene.nodes_of(pair.slave)


class Targets:
    """Names in ccx's deck of the sets and surfaces that loads act on, and the cards they need."""

    def __init__(self, scene):
        self.scene, self.names, self.lines = scene, {}, []

    def name(self, keyword, target):
        """Return the name of a load's target, its card written once."""
        kind = {"BOUNDARY": "N", "CLOAD": "N", "DLOAD": "E", "DSLOAD": "S"}[keyword]
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


def step_lines(scene, planes, targets):
    """Give the steps: the deck's loads, the planes held, and the forces on them printed."""
    fixed = [plane for plane in planes if plane.ref_node is None]
    hold = [Load(f"PLANE{plane.pair + 1}", ["1", "3", "0."]) for plane in fixed]
    for step in scene.steps:
        yield from ("*STEP, INC=1000000", "*STATIC, DIRECT")
        yield f"{step.period / step.n_increments:.12g}, {step.period:.12g}"
        cards = list(step.cards)
        # OP=NEW would set the planes free, so they are held again behind every *BOUNDARY.
        last = max((k for k, c in enumerate(cards) if c.keyword == "BOUNDARY"), default=-1)
        for card in cards[: last + 1]:
            yield from load_lines(card, targets)
        if hold:
            yield from load_lines(LoadCard("BOUNDARY", {}, hold), None)
        for card in cards[last + 1 :]:
            yield from load_lines(card, targets)
        for plane in planes:
            yield from (f"*NODE PRINT, NSET=PLANE{plane.pair + 1}, TOTALS=ONLY", "RF")
        yield "*END STEP"


def load_lines(card, targets):
    """Give a loading card; `targets` None where its targets are names of ccx's deck."""
    if not card.loads:
        return
    options = "".join(f", {name}={value}" for name, value in card.options.items())
    yield f"*{card.keyword}{options}"
    for load in card.loads:
        name = targets.name(card.keyword, load.target) if targets else load.target
        yield ", ".join([name, *load.words])


def deck_lines(scene, penalty):
    """Return the lines of ccx's deck; DeckError where the scene has no translation."""
    check_translatable(scene)
    planes, targets = make_planes(scene), Targets(scene)
    steps = list(step_lines(scene, planes, targets))
    model = [*scene.model_lines(), *contact_lines(scene, planes, penalty)]
    return ["*HEADING", "written by scripts/compare", *model, *targets.lines, *steps]


def read_resultants(path, n_pairs):
    """Return the forces on the slave body, (T, pairs, 3), of the increments in a .dat file."""
    text = path.read_text(encoding="ascii", errors="replace") if path.is_file() else ""
    head = r"total force \(fx,fy,fz\) for set PLANE(\d+) and time"
    found = re.findall(head + 4 * r"\s+(\S+)", text)
    rows = {}
    for pair, time, *force in found:
        rows.setdefault(float(time), {})[int(pair)] = [float(one) for one in force]
    whole = [row for row in rows.values() if len(row) == n_pairs]
    return np.array([[row[k + 1] for k in range(n_pairs)] for row in whole]).reshape(-1, n_pairs, 3)
