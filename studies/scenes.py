"""Scenes that accuracies are asked of: decks of input/, and those made to be hard to judge.

The latter are in data/scenes. A scene is run on meshes and with increments set by hand, or for what
options ask; what comes of it are the forces of its pairs at the ends of the deck's increments.
"""

import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bipot.program import ROOT, set_words, with_threads
from bipot.result import Result, von_mises
from studies.meshes import Mesh
from studies.pages import DATA

AUTO = {"solver": "AUTO", "local": "AUTO"}
BALL = (
    "*CLOAD\nCENTRE, 3, <-force/4>",
    "*BOUNDARY\nCENTRE, 3, 3, <-a*a/radius>",
)
LIMIT = 20  # processor time that a run for an accuracy may take [s]
LARGEST = ("ENERGY", "DISPLACEMENT", "SLIP", "PRESSURE", "MISES")  # the values of OF= but forces


@dataclass
class Scene:
    """A deck, its meshes, the last four of which are the truth, and its settings."""

    name: str
    deck: str
    mu: float
    meshes: tuple = (4, 6, 8, 12, 16, 20, 26, 34)
    steps: int = 5  # 0: the deck has its own
    settings: dict = field(default_factory=dict)
    replaced: tuple = ()
    other: tuple = ()  # a parameter that grows with n, and its part of it
    by_hand: str = ""  # cards that an accuracy does not need
    finer: int = 4  # increments of the truth for one of the deck's
    own: bool = False  # accuracies are asked of a deck that writes its nodes and elements down

    @property
    def path(self):
        """The deck: of input/, or one of those that are there for this study."""
        own = DATA / "scenes" / f"{self.deck}.inp"
        return own if own.exists() else ROOT / "input" / own.name

    def parameters(self, n, finer=1):
        """The parameters of a run with n elements and so many times as many increments."""
        found = {**self.settings, "n": n}
        if self.steps:
            found["steps"] = self.steps * finer
        if self.other:
            found[self.other[0]] = int(self.other[1] * n)
        return found


COARSE = (2, 4, 6, 8, 12, 16, 20)
SCENES = (
    Scene("block", "block", 0.3, settings=AUTO),
    Scene("block, mu = 0.8, along x", "block", 0.8,
          settings={**AUTO, "mu": 0.8, "nu": 0.2, "theta": 0}),
    Scene("block, mu = 0.1", "block", 0.1, settings={**AUTO, "mu": 0.1}),
    Scene("quarter", "quarter", 0.3),
    Scene("hertz", "hertz", 0.0, steps=1),
    Scene("ball, pressed a way", "ball", 0.0, steps=1, replaced=BALL),
    Scene("spence", "spence", 0.2986),
    Scene("foundation", "foundation", 0.3, (2, 4, 6, 8, 10, 12), 6, other=("base", 1.5)),
    Scene("tool", "tool", 0.2, (8, 12, 16, 24, 36), 2),
    Scene("indent, by hand with *REFINE", "indent", 0.2, (2, 3, 4, 6, 8), 4, {"times": 4},
          by_hand="*REFINE, TIMES=<times>\n0., 0., 0., <reach>\n"),
    Scene("contact late in a step", "late", 0.3, finer=32),
    Scene("a period an increment", "wave", 0.3, finer=16),
    Scene("four periods an increment", "wave", 0.3, settings={"waves": 20}, finer=64),
    Scene("pressed by pulses", "pulse", 0.3, steps=4, finer=32),
    Scene("partial slip turned round", "reversal", 0.5, COARSE, 3),
    Scene("contact that spreads", "spreading", 0.4, (4, 6, 8, 12, 16, 20), 4, finer=16),
    Scene("a tilted plate", "tilted", 0.3, steps=3, finer=32),
    Scene("ball inside an element, by hand with *REFINE", "inside", 0.2, (2, 3, 4, 6, 8, 10), 2,
          {"times": 3}, by_hand="*REFINE, TIMES=<times>\n<at>, <at>, 0., 0.25\n"),
    Scene("layers 1 : 1000", "layers", 0.3, (4, 6, 8, 12, 16, 20), 3),
    Scene("re-entrant corner", "angle", 0.3, COARSE, 4),
    Scene("rubber, nu = 0.4999", "rubber", 0.5, (*COARSE, 26), 4),
    Scene("needle", "needle", 0.3, (1, 2, 3, 4), 16, finer=8),
    Scene("two blocks", "two", 0.4, (2, 4, 6, 8, 12, 16, 20), 3),
    Scene("rocking", "rocking", 0.6, COARSE, 4),
    Scene("weight alone", "weight", 0.3, COARSE, 4),
    Scene("press fit", "fit", 0.2, (2, 4, 6, 8, 10), 3),
    Scene("a rough floor, a smooth wall", "wall", 0.5),
    Scene("a rough floor, a rough wall", "corner", 0.5, (4, 6, 8, 10, 12), 4, finer=8),
    Scene("a cylinder rolled and dragged", "rolled", 0.3, (4, 6, 8, 12, 16, 20), 4),
    Scene("warm between two walls", "heat", 0.3, COARSE, 4),
    Scene("pressed, lifted, pressed again", "again", 0.4, steps=4, finer=32),
    Scene("two layers, much friction", "grip", 1.5, steps=4),
    Scene("a soft layer, elements cut", "fixed", 0.3, (2, 3, 4, 8, 12, 16), 4),
    Scene("a strip drawn from under a lid", "lap", 0.2, (2, 3, 4, 5, 6), 4),
    Scene("a plate in plane strain", "ssnv128", 1.0, (16, 24, 32, 48, 64, 96),
          settings={"thickness": 0.002}),
    Scene("a wheel that rubs a slice", "wheel", 0.3, (16, 24, 32, 48, 64), 3,
          settings={"thick": 0.25}),
    Scene("a pad pushed to and fro, own mesh", "pad", 0.35, (2, 4, 6, 8, 12, 16), 4, own=True),
    Scene("a ball that spins", "spin", 0.25, (4, 6, 8, 12, 16, 20), 4, finer=8),
    Scene("a ball dragged to and fro", "dragged", 0.25, (4, 6, 8, 12, 16, 20), 4, finer=8),
    Scene("three blocks", "three", 0.3, (2, 4, 6, 8, 10, 12), 3),
    Scene("a beam bent on a plane", "beam", 0.3, (2, 4, 6, 8, 10, 12), 4, finer=16),
    Scene("a plate warmed and cooled, own mesh", "cools", 0.3, (2, 4, 6, 8, 12, 16), 4, own=True),
    Scene("a roller dragged to and fro", "roller", 0.3, (8, 12, 16, 24, 32, 48), 4, finer=8),
    Scene("a block on a larger one, own meshes", "unlike", 0.5, (2, 4, 6, 8, 10, 12), 3,
          own=True),
    Scene("a slab lifted at an end", "slab", 0.6, (2, 4, 6, 8, 10, 12), 4, finer=8),
    Scene("a strip drawn and let back", "drawn", 0.4, (2, 4, 6, 8, 12, 16), 4),
)  # fmt: skip


@dataclass
class Outcome:
    """How a run ended, what it took, and what it found at the ends of the deck's increments."""

    status: int
    seconds: float
    times: np.ndarray
    pairs: list  # of each: sum of normal reactions (T,), as vectors (T, 3), friction (T, 3), mu
    sequence: object
    reason: str
    names: tuple = ()  # of the pairs
    largest: dict = field(default_factory=dict)  # by LARGEST: over time, of each pair or of all
    least: float = 0.0  # what errors are parts of, at least


def written_down(text, parameters):
    """The deck with nodes and elements, none of a regular shape inside, in place of its blocks."""

    def mesh_of(card):
        """The cards of a block's mesh."""
        words, name = card.groups()[1:], card[1]
        counts = [round(eval(word, {}, parameters)) for word in words[:3]]
        corner, size = np.reshape([float(word) for word in words[3].split(",")], (2, 3))

        def place(*parts):
            """A point of the block, moved where it is inside."""
            within = np.prod(np.sin(np.pi * np.array(parts)))
            waves = np.sin(np.multiply(counts, (2.3, 2.9, 3.1)) * parts + (0.3, 1.1, 2.3))
            return corner + size * (parts + 0.15 * within * waves / counts)

        mesh.name = name
        mesh.surfaces, mesh.of_surface = {}, {}
        mesh.grid(counts, place, XMIN="i-", XMAX="i+", YMIN="j-", YMAX="j+", ZMIN="k-", ZMAX="k+")
        found = mesh.cards().replace("*NODE\n", f"*NODE, NSET={name}\n")
        found = found.replace("<element>", card[0].split("TYPE=")[1].split(",")[0])
        mesh.first += max(len(mesh.nodes), len(mesh.elements))
        mesh.nodes, mesh.elements, mesh.number = [], [], {}
        return found

    mesh = Mesh("", 1000)
    return re.sub(r"\*BLOCK, NAME=(\w+), TYPE=\w+, NX=<(.*?)>, NY=<(.*?)>, NZ=<(.*?)>\n(.*)\n",
                  mesh_of, text)  # fmt: skip


def run(program, scene, folder, parameters, *options, direct=True, of="", limit=LIMIT):
    """Run the deck; None where that takes too long, or a mesh set by hand misses the contact.

    Increments are free to be cut where options ask for an accuracy, or `direct` is false. `of` is
    one of LARGEST that the accuracy is of, or ALL, for which the outcome has the values of each;
    `limit` the processor time of a run with options [s].
    """
    text = scene.path.read_text(encoding="utf-8")
    if scene.replaced:
        text = text.replace(*scene.replaced)
    if options:
        text = text.replace(scene.by_hand, "")
        if scene.own:
            text = written_down(text, parameters)
    if options or not direct:
        # They stay as long as the deck has them: the fourth number bounds what they grow to.
        text = re.sub(r"\*STATIC, DIRECT\n([^,\n]+),([^,\n]+)$", r"*STATIC\n\1,\2, , \1", text,
                      flags=re.MULTILINE)
    if of:
        text = text.replace("*END STEP", "*NODE FILE\nU\n*EL FILE\nS\n*END STEP")
    if of in LARGEST:
        text = text.replace("*STEP", f"*ACCURACY, OF={of}\n0.1\n*STEP", 1)
    deck, result = Path(folder) / f"{scene.deck}.inp", Path(folder) / "result.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    command = [program, deck, "-o", result, "--overwrite", "-q", *options]
    if "--accuracy" in options:
        command += ["--nlgeom", "no"]  # the truth is that of small strain
    command += set_words(parameters)
    if options:
        command = ["sh", "-c", f'ulimit -t {limit}; exec "$@"', "sh", *command]
    done = subprocess.run(command, check=False, capture_output=True, text=True, env=with_threads())
    if done.returncode < 0:
        result.unlink(missing_ok=True)
        return None
    if not result.exists():
        # A mesh that misses the contact is no setting, but the truth and an accuracy take a result.
        if direct and not options:
            return None
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    with Result(result) as found:
        kept = found.history("extra") == 0
        pairs = [forces(pair, kept) for pair in found.pairs.values()]
        names = tuple(found.pairs)
        largest = largest_values(found, kept) if of else {}
        times, sequence = found.history("time")[kept], found.accuracy
        seconds = found.counters["cpu_seconds"]
    if sequence:
        seconds = sequence.processor_time.sum()
    result.unlink()
    return Outcome(done.returncode, seconds, times, pairs, sequence, done.stderr.strip(), names,
                   largest)  # fmt: skip


def forces(pair, kept):
    """The sum of a pair's normal reactions, the same as vectors, the sum of its friction, mu."""
    local, total = pair.reaction[kept], pair.resultant[kept]
    normal = np.einsum("tp,tpx->tx", local[:, :, 0], pair.frame[kept][:, :, 0, :])
    return local[:, :, 0].sum(axis=1), normal, total - normal, pair.friction_coefficient


def largest_values(found, kept):
    """What LARGEST names at the ends of the deck's increments: of each pair (T,), or of all."""
    rows = [int(i) for i in np.flatnonzero(kept)]
    fields = {row: i for i, row in enumerate(found.field_rows)}
    moved = [np.linalg.norm(found.field("displacement", fields[row]), axis=1).max() for row in rows]
    stress = [von_mises(found.field("stress", fields[row])).max() for row in rows]
    return {
        "ENERGY": [found.history("energy/strain")[kept]],
        "DISPLACEMENT": [np.array(moved)],
        "SLIP": [np.linalg.norm(pair.slip[kept], axis=2).max(axis=1)
                 for pair in found.pairs.values()],
        "PRESSURE": [pair.pressure[kept].max(axis=1) for pair in found.pairs.values()],
        "MISES": [np.array(stress)],
    }
