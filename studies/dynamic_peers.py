"""Dynamic scenes that this program and CalculiX both read: decks, and what each of them finds."""

import contextlib
import re
import subprocess
from dataclasses import dataclass

import numpy as np

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
FACES = {"ZMIN": "S1", "ZMAX": "S2", "YMIN": "S3", "XMAX": "S4", "YMAX": "S5", "XMIN": "S6"}


@dataclass
class Scene:
    """A scene: its deck, the set of nodes and the direction that are looked at."""

    name: str
    deck: str
    nodes: str
    direction: int
    right: float | None = None  # what is known, of rigid bodies or waves


class Boxes:
    """The cards of boxes of bricks, with sets of their nodes and what surfaces are asked for."""

    def __init__(self):
        """Begin without any."""
        self.text, self.n_nodes, self.n_bricks = "", 0, 0

    def add(self, name, low, size, n, kind="C3D8", surfaces=()):
        """Add a box, its set of nodes NAME-N, and surfaces NAME-ZMIN and so on."""
        grid = [np.linspace(a, a + s, k + 1) for a, s, k in zip(low, size, n, strict=True)]
        z, y, x = np.meshgrid(*grid[::-1], indexing="ij")
        first = self.n_nodes + 1
        points = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).tolist()
        self.text += "*NODE\n" + "".join(
            f"{first + i}, {a!r}, {b!r}, {c!r}\n" for i, (a, b, c) in enumerate(points)
        )
        cells = [(i, j, k) for k in range(n[2]) for j in range(n[1]) for i in range(n[0])]
        self.text += f"*ELEMENT, TYPE={kind}, ELSET={name}\n"
        bricks = {}
        for cell in cells:
            self.n_bricks += 1
            bricks[cell] = self.n_bricks
            nodes = [
                first + (cell[0] + a) + (n[0] + 1) * ((cell[1] + b) + (n[1] + 1) * (cell[2] + c))
                for a, b, c in CORNERS
            ]
            self.text += f"{self.n_bricks}, " + ", ".join(map(str, nodes)) + "\n"
        self.n_nodes += x.size
        self.text += f"*NSET, NSET={name}-N, GENERATE\n{first}, {self.n_nodes}\n"
        for side in surfaces:
            axis, last = "XYZ".index(side[0]), side.endswith("MAX")
            faces = [bricks[c] for c in cells if c[axis] == (n[axis] - 1 if last else 0)]
            self.text += f"*SURFACE, NAME={name}-{side}\n"
            self.text += "".join(f"{e}, {FACES[side]}\n" for e in faces)
        self.text += f"*SOLID SECTION, ELSET={name}, MATERIAL=M\n"

    def deck(self, material, pairs, penalty, friction, cards, step):
        """Return the deck: E and nu, pairs of surfaces, cards before the step and in it."""
        rules = f"*FRICTION\n{friction!r}, {penalty!r}\n" if friction else ""
        return (
            f"{self.text}*MATERIAL, NAME=M\n*ELASTIC\n{material[0]!r}, {material[1]!r}\n"
            "*DENSITY\n1.\n*SURFACE INTERACTION, NAME=I\n"
            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n"
            f"{penalty!r}\n{rules}"
            + "".join(
                f"*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\n{p}\n" for p in pairs
            )
            + cards + f"*STEP, INC=100000\n{step}"
        )  # fmt: skip


def thrown(**bodies):
    """Return *INITIAL CONDITIONS of bodies, each with three velocities."""
    return "*INITIAL CONDITIONS, TYPE=VELOCITY\n" + "".join(
        f"{name}-N, {i + 1}, {v!r}\n" for name, way in bodies.items() for i, v in enumerate(way)
    )


def step(dt, period, watched, cards=""):
    """Return the cards of a step; the displacements of its end are printed."""
    return (
        f"*DYNAMIC, DIRECT, ALPHA=-0.05\n{dt!r}, {period!r}\n{cards}"
        f"*NODE PRINT, NSET={watched}, FREQUENCY=100000\nU\n*NODE FILE, FREQUENCY=100000\nU\n"
        "*END STEP\n"
    )


def weight(name, x, z):
    """Return the *DLOAD of an acceleration in the plane of x and z."""
    size = float(np.hypot(x, z))
    return f"*DLOAD\n{name}, GRAV, {size!r}, {x / size!r}, 0., {z / size!r}\n"


def plate(boxes, low=(-1.0, -1.0), size=3.0, top=0.0):
    """Add a brick that is to be clamped, and return the cards that do so."""
    boxes.add("P", (*low, top - 1.0), (size, size, 1.0), (1, 1, 1), surfaces=["ZMAX"])
    return "*BOUNDARY\nP-N, 1, 3\n"


def own_scenes():
    """Scenes of blocks, bars and a beam, with what is known of them."""
    return [bar_on_wall(), two_bars(), *blocks_on_plate(), beam_on_stop(), stack()]


def bar_on_wall():
    """A bar of length 10 that leaves the wall as fast as it came, the way of waves later."""
    boxes = Boxes()
    boxes.add("B", (0.0, 0.0, 0.0), (1.0, 1.0, 10.0), (1, 1, 20), surfaces=["ZMIN"])
    cards = plate(boxes, top=-5.0) + thrown(B=(0.0, 0.0, -10.0))
    deck = boxes.deck((900.0, 0.0), ["B-ZMIN, P-ZMAX"], 1e4, 0.0, cards, step(1 / 60, 2.0, "B-N"))
    return Scene("a bar strikes a wall and leaves it", deck, "B-N", 2, 10 / 3)


def two_bars():
    """Of two equal bars one takes over the velocity of the other."""
    boxes = Boxes()
    boxes.add("B", (0.0, 0.0, 0.0), (1.0, 1.0, 10.0), (1, 1, 20), surfaces=["ZMIN"])
    boxes.add("C", (0.0, 0.0, -11.0), (1.0, 1.0, 10.0), (1, 1, 20), surfaces=["ZMAX"])
    cards = thrown(B=(0.0, 0.0, -10.0))
    deck = boxes.deck((900.0, 0.0), ["B-ZMIN, C-ZMAX"], 1e4, 0.0, cards, step(1 / 60, 1.5, "C-N"))
    return Scene("two bars: the one that is struck", deck, "C-N", 2, -(10 / 3 + 10 * (1.4 - 2 / 3)))


def blocks_on_plate():
    """Blocks that slide to rest, are pulled, bounce, and strike askew."""
    for name, height, n, dt, period, start, pull, direction, right in (
        ("a block slides to rest, mu = 0.3", 0.5, (4, 4, 2), 0.01, 0.5, (1.0, 0.0, 0.0),
         (0.0, -10.0), 0, 1 / 6),
        ("a block on a slope slides, mu = 0.3", 0.5, (4, 4, 2), 0.01, 0.5, (0.0, 0.0, 0.0),
         (5.0, -10.0), 0, 0.25),
        ("a cube falls and bounces", 1.0, (3, 3, 3), 0.001, 0.2, (0.0, 0.0, 0.0),
         (0.0, -10.0), 2, None),
        ("a block is thrown askew, mu = 0.3", 0.5, (4, 4, 2), 0.002, 0.3, (1.0, 0.0, -0.5),
         None, 0, None),
    ):  # fmt: skip
        boxes = Boxes()
        boxes.add("B", (0.0, 0.0, 0.0), (1.0, 1.0, height), n, surfaces=["ZMIN"])
        falls = direction == 2
        cards = plate(boxes, top=-0.1 if falls or pull is None else 0.0)
        if any(start):
            cards += thrown(B=start)
        loads = "" if pull is None else weight("B", *pull)
        deck = boxes.deck((1e4, 0.3), ["B-ZMIN, P-ZMAX"], 1e5, 0.0 if falls else 0.3, cards,
                          step(dt, period, "B-N", loads))  # fmt: skip
        yield Scene(name, deck, "B-N", direction, right)


def beam_on_stop():
    """A beam whose tip strikes a brick below it."""
    boxes = Boxes()
    boxes.add("B", (0.0, 0.0, 0.0), (10.0, 1.0, 1.0), (10, 1, 2), "C3D8I", ["ZMIN"])
    boxes.add("P", (9.0, 0.0, -1.2), (1.0, 1.0, 1.0), (1, 1, 1), surfaces=["ZMAX"])
    cards = "*BOUNDARY\nP-N, 1, 3\n" + "*NSET, NSET=ROOT\n" + "".join(
        f"{1 + 11 * i}\n" for i in range(6)
    ) + "*BOUNDARY\nROOT, 1, 3\n" + thrown(B=(0.0, 0.0, -1.0))  # fmt: skip
    deck = boxes.deck((1e4, 0.3), ["B-ZMIN, P-ZMAX"], 1e5, 0.0, cards, step(0.001, 1.0, "B-N"))
    return Scene("a beam strikes a stop below its tip", deck, "B-N", 2)


def stack():
    """Two blocks that fall on a plate, one on the other, with friction."""
    boxes = Boxes()
    boxes.add("B", (0.0, 0.0, 0.0), (1.0, 1.0, 0.5), (3, 3, 2), surfaces=["ZMIN", "ZMAX"])
    boxes.add("C", (0.1, 0.1, 0.6), (0.8, 0.8, 0.5), (3, 3, 2), surfaces=["ZMIN"])
    cards = plate(boxes, top=-0.05) + thrown(C=(0.5, 0.0, 0.0), B=(0.0, 0.0, 0.0))
    loads = weight("B", 0.0, -10.0) + weight("C", 0.0, -10.0)
    deck = boxes.deck((1e4, 0.3), ["B-ZMIN, P-ZMAX", "C-ZMIN, B-ZMAX"], 1e5, 0.3, cards,
                      step(0.001, 0.4, "C-N", loads))  # fmt: skip
    return Scene("two blocks fall, the upper one slides", deck, "C-N", 0)


def theirs(scene, folder, limit=300):
    """Run CalculiX; return the mean displacement at its end, and the time of that."""
    # CalculiX chooses its increments, up to those of the deck: with DIRECT most of these end.
    free = re.sub(r"(\*DYNAMIC), DIRECT(.*\n)([^,\n]*), ([^,\n]*)\n", r"\1\2\3, \4, , \3\n",
                  scene.deck)  # fmt: skip
    (folder / "peer.inp").write_text(free)
    run_other(folder, limit)
    return last_displacement(folder / "peer.dat", scene.direction)


def run_other(folder, limit):
    """Run CalculiX on the deck peer.inp, for some seconds at most; what it printed counts."""
    (folder / "peer.dat").unlink(missing_ok=True)
    with contextlib.suppress(subprocess.TimeoutExpired):
        subprocess.run(["ccx", "-i", "peer"], cwd=folder, capture_output=True, check=False,
                       timeout=limit)  # fmt: skip


def last_displacement(path, direction):
    """Return the mean of the last displacements that a .dat prints, and their time."""
    text = path.read_text() if path.exists() else ""
    blocks = re.split(r" displacements .* time\s+(\S+)\n", text)
    if len(blocks) < 3:
        return None, 0.0
    rows = [row.split() for row in blocks[-1].splitlines() if row.strip()]
    return float(np.mean([float(row[1 + direction]) for row in rows])), float(blocks[-2])


@dataclass
class Public:
    """A public deck: its file below the collection, a node whose displacements it prints."""

    path: str
    node: int
    direction: int


PUBLIC = [
    Public("ccx/test/contact12.inp", 24, 2),
    Public("ccx/test/contact15.inp", 23, 2),
    Public("ccx/test/contact16.inp", 23, 0),
    Public("ccx/test/contact16.inp", 23, 2),
    Public("ccx/test/contact17.inp", 23, 2),
    Public("ccx/structest/contact2i.inp", 395, 1),
]


def mean_over_time(time, values):
    """Return the mean of a history that begins with 0."""
    t, v = np.r_[0.0, time], np.r_[0.0, values]
    return float(((v[1:] + v[:-1]) / 2 * np.diff(t)).sum() / t[-1])


def our_mean(public, result):
    """Return the mean over time of a node's displacement, and the time of the end."""
    row = np.flatnonzero(result.node_ids == public.node)[0]
    time = result.history("time")
    values = [result.field("displacement", i)[row, public.direction] for i in range(len(time))]
    return mean_over_time(time, values), float(time[-1])


def their_mean(public, deck, folder, limit=600):
    """Run CalculiX; return the mean over time of that displacement, and the time of its end."""
    (folder / "peer.inp").write_text(deck)
    run_other(folder, limit)
    blocks = re.split(r" displacements .* time\s+(\S+)\n", (folder / "peer.dat").read_text())
    row = re.compile(rf"^\s+{public.node}\s+(.*)$", re.MULTILINE)
    history = {
        float(time): float(row.search(text)[1].split()[public.direction])
        for time, text in zip(blocks[1::2], blocks[2::2], strict=True)
    }
    time = np.array(sorted(history))
    return mean_over_time(time, [history[t] for t in time.tolist()]), float(time[-1])


def nodes_of_set(deck, name):
    """Return the numbers of a set that a deck generates or lists."""
    lines = re.search(rf"\*NSET, *NSET={name}([^\n]*)\n([^*]*)", deck, re.IGNORECASE)
    numbers = [int(x) for x in re.findall(r"\d+", lines[2])]
    if "GENERATE" in lines[1].upper():
        return np.arange(numbers[0], numbers[1] + 1)
    return np.array(numbers)


def ours(scene, result):
    """Return the mean displacement at the end of a result, and the time of that."""
    mine = np.isin(result.node_ids, nodes_of_set(scene.deck, scene.nodes))
    return float(result.field("displacement")[mine, scene.direction].mean()), float(
        result.history("time")[-1])  # fmt: skip
