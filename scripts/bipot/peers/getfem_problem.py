"""Write the scene of a bipot deck for getfem_contact.py, and read what GetFEM found.

The elements, increments, planes and friction are those of the deck. What is not translated:
elements other than C3D8, loads other than prescribed displacements, amplitudes, planes that move,
prescribed displacements at contact points.
"""

import json
from dataclasses import dataclass

import numpy as np

from bipot.peers.calculix_deck import slave_nodes
from bipot.peers.flat_deck import DeckError

TOLERANCE = 1e-10     # of Newton's iterations: residual over external load, both the sums of sizes
AUGMENTATION = 1.0    # times the stiffness of an edge: Young's modulus by its length
LOADS = ("CLOAD", "DLOAD", "DSLOAD")


def check_translatable(scene):
    """Raise DeckError, with all reasons, where getfem_contact.py cannot be given the scene."""
    reasons = []
    kinds = sorted({kind for kind, _ in scene.elements.values()} - {"C3D8"})
    if kinds:
        reasons.append(f"elements of TYPE={', '.join(kinds)}")
    curved = sorted({o.kind for o in scene.obstacles.values() if o.kind != "PLANE"})
    if curved:
        reasons.append(f"obstacles of TYPE={', '.join(curved)}")
    if any(o.ref_node is not None for o in scene.obstacles.values()):
        reasons.append("*OBSTACLE, REF NODE=: planes that may move")
    if scene.has_two_surfaces:
        reasons.append("*CONTACT PAIR of two surfaces")
    if scene.gaps or scene.clearances or any(p.clearance is not None for p in scene.pairs):
        reasons.append("*CONTACT GAP and *CLEARANCE")
    if scene.finite or any("ELASTIC" not in cards for cards in scene.materials.values()):
        reasons.append("finite strain")
    if scene.ties or any("EXPANSION" in cards for cards in scene.materials.values()):
        reasons.append("*TIE and *EXPANSION")
    if not scene.pairs:
        reasons.append("no *CONTACT PAIR")
    cards = [card for step in scene.steps for card in step.cards if card.loads]
    loads = sorted({card.keyword for card in cards if card.keyword in LOADS})
    if loads:
        reasons.append(f"*{', *'.join(loads)}: the body is moved by *BOUNDARY alone")
    options = sorted({name for card in cards for name in card.options})
    if options:
        reasons.append(f"*BOUNDARY with {', '.join(options)}")
    if reasons:
        raise DeckError("; ".join(reasons))


def held_values(scene, row_of):
    """Return the entries held, 3 node + axis, and their values (T, H) over the increments.

    Within a step a value goes from that at its beginning to the one given, in equal increments.
    """
    held, rows = {}, []
    for number, step in enumerate(scene.steps):
        end = dict(held)
        for card in step.cards:
            for load in card.loads:
                first, last, value = int(load.words[0]), int(load.words[1]), float(load.words[2])
                for node in scene.nodes_of(load.target):
                    for axis in range(first - 1, last):
                        if node in row_of:
                            end[3 * row_of[node] + axis] = value
        if number > 0 and end.keys() != held.keys():
            raise DeckError(f"*BOUNDARY of step {number + 1} holds what step {number} left free")
        start = np.array([held.get(entry, 0.0) for entry in end])
        change = np.array(list(end.values())) - start
        n = step.n_increments
        rows += [start + change * (k / n) for k in range(1, n + 1)]
        held = end
    return np.array(list(held), dtype=int), np.array(rows)


def contact_points(scene, row_of):
    """Return node (C,), normal (C, 3), gap, friction and pair of every contact point."""
    found = {name: [] for name in ("contact_nodes", "normals", "gaps", "friction", "pairs")}
    for k, pair in enumerate(scene.pairs):
        numbers = np.array(scene.obstacles[pair.master].numbers)
        normal = numbers[3:6] / np.linalg.norm(numbers[3:6])
        for node in slave_nodes(scene, pair):
            found["contact_nodes"].append(row_of[node])
            found["normals"].append(normal)
            found["gaps"].append(normal @ (np.array(scene.nodes[node]) - numbers[:3]))
            found["friction"].append(scene.friction[pair.interaction])
            found["pairs"].append(k)
    return {name: np.array(values) for name, values in found.items()}


def problem_arrays(scene):
    """Return the arrays that getfem_contact.py reads; DeckError where there is no translation."""
    check_translatable(scene)
    used = {node: None for _, corners in scene.elements.values() for node in corners}
    row_of = {node: row for row, node in enumerate(used)}
    points = np.array([scene.nodes[node] for node in used])
    elements = np.array([[row_of[node] for node in corners]
                       for _, corners in scene.elements.values()])
    material_of = scene.material_of
    elastic = np.array([
        [float(word) for word in scene.materials[material_of[element]]["ELASTIC"][:2]]
        for element in scene.elements
    ])
    young, poisson = elastic.T
    shear = young / (2 * (1 + poisson))
    lame = np.stack([2 * shear * poisson / (1 - 2 * poisson), shear], axis=1)
    held, values = held_values(scene, row_of)
    contact = contact_points(scene, row_of)
    if np.isin(held // 3, contact["contact_nodes"]).any():
        raise DeckError("*BOUNDARY at contact points")
    edges = points[elements[:, [1, 3, 4]]] - points[elements[:, [0]]]
    return {
        "points": points, "elements": elements, "lame": lame, "held": held, "values": values,
        "modulus": young.max(), "tolerance": TOLERANCE,
        "augmentation": AUGMENTATION * np.median(np.linalg.norm(edges, axis=2)), **contact,
    }


@dataclass
class Found:
    """What GetFEM found."""

    forces: np.ndarray  # (T, pairs, 3), of the increments in which Newton's iterations ended
    iterations: int     # of all increments
    increments: int     # begun and ended, in whatever way
    seconds: float      # processor time at the end of the last


def read_output(path, n_pairs):
    """Return what GetFEM found of so many pairs; lines that are not records are passed over."""
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    records = [json.loads(line) for line in text.splitlines()
               if line.startswith("{") and line.endswith("}")]
    forces = [record["forces"] for record in records if record["converged"]]
    return Found(
        np.array(forces).reshape(-1, n_pairs, 3), sum(record["iterations"] for record in records),
        len(records), records[-1]["seconds"] if records else 0.0,
    )
