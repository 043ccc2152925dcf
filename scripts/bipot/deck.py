"""Build decks in Python, and write them as the text that the program reads.

    deck = bipot.Deck("A block on the ground", name="block")
    deck.parameter(n=4, mu=0.3)
    deck.block("BODY", cells=("<n>", "<n>", "<n>"), size=(1, 1, 1))
    deck.material("STEEL", young=210000, poisson=0.3)
    deck.section("STEEL", "BODY")
    deck.plane("GROUND", point=(0, 0, 0), normal=(0, 0, 1))
    deck.interaction("DRY", friction="<mu>")
    deck.pair("BODY-ZMIN", "GROUND", "DRY")
    with deck.step(increment=0.1, direct=True):
        deck.boundary("BODY-ZMAX", 1, 2)
        deck.boundary("BODY-ZMAX", 3, value=-0.1)
    print(deck.text())
    result = bipot.run(deck, mu=0.2)

A deck in Python is text in the making: each method writes the cards that docs/deck.md describes,
and `card` writes any other. So nothing is possible in one that is not in the other. What is a
number in a deck may be a text here: "<mu>" is a parameter, "<2*n>" an expression. Mistakes are
found by the program: `bipot.check(deck)` lists them with their lines in the text.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.element_faces import face_normals
from bipot.errors import MeshError, RefusedError
from bipot.meshes import PLANE_TYPES, TYPES, SolidMesh, read_mesh

Array = NDArray[Any]
Number = float | int | str
"""A number, or a text such as "<mu>" that stands for one."""
Members = Iterable[int | str] | int | str
"""Ids, or names of sets."""

MARK = "** Written by bipot.Deck"
ENTRIES = 12  # of a line in a list of ids
INPUT_PATH = re.compile(r'(?i)(\bINPUT\s*=\s*)("[^"\r\n]*"|[^,\r\n]*)')


def _entry(value: Any) -> str:
    """Return an entry of a data line."""
    if value is None:
        return ""
    if isinstance(value, str):
        text = value.strip()
        return f'"{text}"' if "," in text and not text.startswith(('"', "<")) else text
    if isinstance(value, bool | np.bool_):
        raise TypeError(f"an entry of a deck is a number or a text, not {value!r}")
    if isinstance(value, int | np.integer):
        return str(int(value))
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"an entry of a deck must be finite, not {number!r}")
    return repr(number)


def _name(name: str) -> str:
    """Return a name as a deck has it: in quotes where it has blanks or commas."""
    text = str(name).strip()
    if not text or '"' in text.strip('"') or "\n" in text:
        raise ValueError(f"not a name: {name!r}")
    if text.startswith(('"', "<")) or not re.search(r"[,\s]", text):
        return text
    return f'"{text}"'


def _where(where: int | str) -> str:
    """Return a set's name or an id."""
    return _name(where) if isinstance(where, str) else str(int(where))


def _members(members: Members) -> list[str]:
    """Return ids or names as lines of a set."""
    if isinstance(members, str) or not isinstance(members, Iterable):
        members = [members]
    entries = [_where(member) for member in members]
    return [", ".join(entries[i : i + ENTRIES]) for i in range(0, len(entries), ENTRIES)]


@dataclass(frozen=True)
class MeshPart:
    """A mesh as it stands in a deck: `faces` and `nodes` choose from it by place."""

    mesh: SolidMesh
    node_ids: Array  #: of the rows of `mesh.points`, (N,)
    element_ids: Array  #: of the elements, block after block of `mesh.blocks`, (E,)

    def nodes(self, where: Callable[[Array], ArrayLike]) -> Array:
        """Return the ids of nodes: `where` takes coordinates (N, 3) and returns a mask (N,)."""
        return self.node_ids[np.asarray(where(self.mesh.points), bool)]

    def faces(self, where: Callable[[Array, Array], ArrayLike]) -> list[tuple[int, str]]:
        """Return outer faces as Deck.surface takes them.

        `where` takes the middles (F, 3) of all outer faces and their outward unit normals (F, 3),
        and returns a mask (F,).
        """
        faces, nodes = self.mesh.outer_faces()
        if self.mesh.is_plane:
            ends = self.mesh.points[nodes[:, :2]]
            along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[
                :, None
            ]
            normals = np.stack([along[:, 1], -along[:, 0], 0 * along[:, 0]], axis=1)
            chosen = faces[np.asarray(where(ends.mean(axis=1), normals), bool)]
            return [(int(self.element_ids[element]), f"S{edge + 1}") for element, edge in chosen]
        count = (nodes >= 0).sum(axis=1)
        corners = nodes[:, :4].copy()  # of triangles the third one twice
        corners[(count == 3) | (count == 6), 3] = corners[(count == 3) | (count == 6), 2]
        x = self.mesh.points[corners]
        middles = self.mesh.points[nodes].sum(axis=1, where=(nodes >= 0)[:, :, None])
        chosen = faces[np.asarray(where(middles / count[:, None], face_normals(x)), bool)]
        return [(int(self.element_ids[element]), f"S{face + 1}") for element, face in chosen]


class Deck:
    """A deck: built card by card, or read from a text and added to.

    `name` is that of its file and of its results. The text has, in this order: title, parameters,
    nodes and elements, whatever else comes before the steps, and the steps; within each the order
    of the calls.
    """

    def __init__(self, title: str = "", name: str = "deck"):
        self.name = name
        self.origin = Path.cwd()  #: folder that the files it names are looked for in
        self._head = ["*HEADING", *title.splitlines()] if title else []
        self._parameters: list[str] = []
        self._mesh: list[str] = []
        self._model: list[str] = []
        self._steps: list[str] = []
        self._in_step = False
        self._read = ""  # the text it was read from, while nothing is added
        self._next = {"nodes": 1, "elements": 1}  # the ids of the next ones; 0: not known

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Deck:
        """Return the deck of a text file; `text()` is that text until something is added.

        Added parameters, nodes and elements go to its beginning, other cards before its first
        *STEP, steps to its end. OSError where the file cannot be read.
        """
        path = Path(path)
        with path.open(encoding="utf-8", newline="") as file:
            deck = cls.from_text(file.read(), path.stem)
        deck.origin = path.resolve().parent
        return deck

    @classmethod
    def from_text(cls, text: str, name: str = "deck") -> Deck:
        """Return the deck of a text, such as bipot.flat gives."""
        deck = cls(name=name)
        deck._read = text
        lines = re.split(r"\r\n|\n|\r", text.removeprefix(MARK).lstrip("\r\n"))
        if not lines[-1]:
            del lines[-1]
        step = next(
            (i for i, line in enumerate(lines) if re.match(r"(?i)\s*\*STEP\b", line)), len(lines)
        )
        deck._model, deck._steps = lines[:step], lines[step:]
        deck._next = {"nodes": 0, "elements": 0}
        return deck

    # --- As text ------------------------------------------------------------------------------

    def text(self) -> str:
        """Return the deck as text."""
        if self._read:
            return self._read
        parameters = ["*PARAMETER", *self._parameters] if self._parameters else []
        parts = (self._head, parameters, self._mesh, self._model, self._steps)
        return "\n".join([MARK, *(line for part in parts for line in part)]) + "\n"

    __str__ = text

    def write(self, path: str | os.PathLike[str], overwrite: bool = False) -> Path:
        """Write the deck into a file and return its path.

        A file that a Deck has written is replaced; any other that differs only with `overwrite`:
        else RefusedError is raised. Where the deck was read, or made, in another folder, the
        relative paths of files that it names become absolute ones.
        """
        path = Path(path)
        text = self.text()
        if path.resolve().parent != self.origin:
            text = self._with_absolute_paths(text)
        if path.exists():
            with path.open(encoding="utf-8", errors="replace", newline="") as file:
                there = file.read()
            if there == text:
                return path
            if not overwrite and not there.startswith(MARK):
                raise RefusedError(
                    f"{path} is there, and no Deck has written it: give the deck another name,"
                    " or write it with overwrite=True"
                )
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f"{path.name}.part")
        with partial.open("w", encoding="utf-8", newline="") as file:
            file.write(text)
        partial.replace(path)
        return path

    def _with_absolute_paths(self, text: str) -> str:
        """Return a text whose INPUT= names files wherever the text lies."""

        def absolute(match: re.Match[str]) -> str:
            named = Path(match[2].strip().strip('"'))
            found = self.origin / named
            return match[0] if not found.is_file() else f'{match[1]}"{found.resolve()}"'

        lines = text.split("\n")
        for i, line in enumerate(lines):
            if re.match(r"\s*\*(?!\*)", line) or (i and lines[i - 1].rstrip().endswith(",")):
                lines[i] = INPUT_PATH.sub(absolute, line)
        return "\n".join(lines)

    # --- Cards --------------------------------------------------------------------------------

    def card(
        self, keyword: str, lines: Iterable[str | Sequence[Any]] = (),
        options: Mapping[str, Any] | None = None, **more: Any,
    ) -> Deck:
        """Add any card of docs/deck.md; return the deck.

            deck.card("*OBSTACLE", lines=[(0, 0, 15, 5)], NAME="BALL", TYPE="SPHERE", REF_NODE=1000)

        keyword  with its star or without
        lines    data lines: texts as they are, or sequences of entries
        options  by name; `_` in a keyword argument is a blank, True is a flag, and None or False
                 leave an option out

        Between *STEP and *END STEP it belongs to that step, else it comes before all steps; but for
        *PARAMETER, which comes before all that may use it. ValueError for what would be no card.
        """
        word = " ".join(keyword.strip().lstrip("*").upper().split())
        if not re.fullmatch(r"[A-Z][A-Z -]*", word):
            raise ValueError(f"not a keyword: {keyword!r}")
        head = f"*{word}"
        given = dict(options or {})
        given |= {name.replace("_", " "): value for name, value in more.items()}
        for name, value in given.items():
            if value is True:
                head += f", {name}"
            elif value is not None and value is not False:
                head += f", {name}={_entry(value)}"
        self._add(word, [head, *self._data(lines)])
        return self

    @staticmethod
    def _data(lines: Iterable[str | Sequence[Any]]) -> list[str]:
        """Return data lines as text."""
        if isinstance(lines, str):
            lines = lines.splitlines()
        found = []
        for line in lines:
            text = line if isinstance(line, str) else ", ".join(map(_entry, line))
            if "\n" in text or re.match(r"\s*\*(?!\*)", text):
                raise ValueError(f"not a data line: {text!r}")
            found.append(text)
        return found

    def _add(self, word: str, lines: list[str]) -> None:
        """Put a card where its keyword belongs."""
        self._read = ""
        if word == "PARAMETER":
            self._parameters += lines[1:]
        elif word == "HEADING":
            self._head = lines
        elif word == "STEP" or self._in_step:
            self._steps += lines
            self._in_step = word != "END STEP"
        else:
            self._model += lines

    def parameter(self, **values: Number) -> Deck:
        """Define parameters: numbers, words, or arithmetic with those above as a text."""
        lines = [f"{name} = {_entry(value)}" for name, value in values.items()]
        return self.card("PARAMETER", lines)

    def units(self, force: str, length: str) -> Deck:
        """Name the units of force and length for labels, as "N" and "mm"; nothing is converted."""
        return self.card("UNITS", [f"{force}, {length}"])

    def comment(self, text: str) -> Deck:
        """Add comment lines where the next card will be."""
        self._read = ""
        target = self._steps if self._in_step else self._model
        target += [f"** {line}".rstrip() for line in text.splitlines()]
        return self

    # --- The mesh -----------------------------------------------------------------------------

    def number_from(self, node: int, element: int) -> Deck:
        """Say which ids the next nodes and elements have; needed in a deck read from a text."""
        self._next = {"nodes": node, "elements": element}
        return self

    def _take_ids(self, ids: ArrayLike | None, count: int, what: str) -> Array:
        """Return ids for nodes or elements: those given, or the next ones."""
        following = self._next[what]
        if ids is None:
            if following == 0:
                raise ValueError(
                    f"the deck was read from a text: give the ids of its new {what}, or say where"
                    " they begin: deck.number_from(node=..., element=...)"
                )
            found = following + np.arange(count)
        else:
            found = np.atleast_1d(np.asarray(ids, int))
            if found.shape != (count,):
                raise ValueError(f"{count} {what} need as many ids, not {found.shape}")
        if following and count:
            self._next[what] = max(following, int(found.max()) + 1)
        return found

    def nodes(
        self, points: ArrayLike, set: str | None = None, ids: ArrayLike | None = None
    ) -> Array:
        """Add nodes at points (N, 3) and return their ids (N,): the next ones, or those given."""
        points = np.atleast_2d(np.asarray(points, float))
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"nodes have 3 coordinates each, and these are {points.shape}")
        found = self._take_ids(ids, len(points), "nodes")
        head = "*NODE" if set is None else f"*NODE, NSET={_name(set)}"
        lines = (
            f"{number}, {', '.join(map(_entry, point))}"
            for number, point in zip(found.tolist(), points.tolist(), strict=True)
        )
        self._read = ""
        self._mesh += [head, *lines]
        return found

    def reference_node(self, point: ArrayLike, id: int | None = None) -> int:
        """Add a node that moves an obstacle or a rigid body; return its id."""
        return int(self.nodes(np.asarray(point)[None], ids=None if id is None else [id])[0])

    def elements(
        self, corners: ArrayLike, set: str | None = None, type: str = "C3D8",
        ids: ArrayLike | None = None,
    ) -> Array:
        """Add elements, (E, 8) ids of nodes, or facets, (E, 3) or (E, 4); return their ids (E,)."""
        corners = np.atleast_2d(np.asarray(corners, int))
        found = self._take_ids(ids, len(corners), "elements")
        head = f"*ELEMENT, TYPE={type}" + ("" if set is None else f", ELSET={_name(set)}")
        self._read = ""
        self._mesh += [head, *(
            f"{number}, {', '.join(map(str, nodes))}"
            for number, nodes in zip(found.tolist(), corners.tolist(), strict=True)
        )]
        return found

    def mesh(
        self, source: Any, name: str = "BODY", type: str | None = None,
        element_sets: Mapping[str, ArrayLike] | None = None,
        node_sets: Mapping[str, ArrayLike] | None = None,
    ) -> MeshPart:
        """Add a mesh: from a file by meshio, meshio, PyVista, or (points, elements).

        name          of the set of all its nodes, and of all its elements
        type          of hexahedra: C3D8, C3D8I or C3D8B with 8 nodes, C3D20 or C3D20R with 20, the
                      first of these where it is left out; others have one type (C3D10, ...);
                      of plane meshes CPE, CPS or CAX, as of a type (CAX8R)
        element_sets  more sets: rows or masks of the elements
        node_sets     more sets: rows or masks of the points

        Named groups become sets; those of faces, in a plane of lines, surfaces and sets of nodes.
        Returns what chooses nodes and faces by place. MeshError where the mesh has solids that no
        element is, or none that can be of the type.
        """
        plane = type is not None and type.startswith(("CPE", "CPS", "CAX"))
        mesh = read_mesh(source, element_sets, node_sets, plane)
        known = (
            {kind: [type[:3] + end for end in ends] for kind, ends in PLANE_TYPES.items()}
            if type is not None and plane else TYPES
        )
        types = [type if type in known[kind] else known[kind][0] for kind, _ in mesh.blocks]
        if type is not None and type not in types and not (plane and len(type) == 3):
            there = ", ".join(
                f"{len(nodes)} of kind {kind} ({' or '.join(known[kind])})"
                for kind, nodes in mesh.blocks
            )
            raise MeshError(f"no element of the mesh can be of type {type}: it has {there}")
        node_ids = self.nodes(mesh.points, set=name)
        element_ids = np.concatenate([
            self.elements(node_ids[nodes], set=name, type=of_type)
            for (_, nodes), of_type in zip(mesh.blocks, types, strict=True)
        ])
        for set_name, rows in mesh.element_sets.items():
            self.element_set(set_name, element_ids[rows])
        for set_name, rows in mesh.node_sets.items():
            self.node_set(set_name, node_ids[rows])
        for surface, faces in mesh.surfaces.items():
            self.surface(surface, [(int(element_ids[b]), f"S{f + 1}") for b, f in faces])
        return MeshPart(mesh, node_ids, element_ids)

    def block(
        self, name: str, cells: Sequence[Number], size: Sequence[Number],
        corner: Sequence[Number] = (0.0, 0.0, 0.0), type: str | None = None,
        set: str | None = None, grow: Mapping[str, Number | Sequence[Number]] | None = None,
    ) -> Deck:
        """Add a box of elements with the sets and surfaces NAME, NAME-XMIN to NAME-ZMAX.

        cells  elements along x, y, z
        grow   {"X": 3} or {"X": (3, "MIDDLE")}: the size of the last element over the first
        """
        lines: list[Sequence[Any]] = [(*corner, *size)]
        for axis, factor in (grow or {}).items():
            if isinstance(factor, str) or not isinstance(factor, Sequence):
                factor = [factor]
            lines.append((axis.upper(), *factor))
        counts = dict(zip(("NX", "NY", "NZ"), cells, strict=True))
        given = {"NAME": _name(name), **counts, "TYPE": type, "ELSET": set and _name(set)}
        return self.card("BLOCK", lines, given)

    def node_set(self, name: str, members: Members) -> Deck:
        """Add a set of nodes: ids, or names of sets above it."""
        return self.card("NSET", _members(members), NSET=_name(name))

    def element_set(self, name: str, members: Members) -> Deck:
        """Add a set of elements: ids, or names of sets above it."""
        return self.card("ELSET", _members(members), ELSET=_name(name))

    def refine(
        self, balls: Iterable[Sequence[Number]] = (), times: int = 1, nodes: str | None = None,
        elements: str | None = None,
    ) -> Deck:
        """Cut elements into eight, some times: about balls, at a set of nodes, or those of a set.

        balls  (x, y, z, radius) of each
        """
        given = {"NSET": nodes and _name(nodes), "ELSET": elements and _name(elements)}
        return self.card("REFINE", [tuple(ball) for ball in balls], given, TIMES=times)

    def surface(self, name: str, faces: Iterable[tuple[int | str, str]]) -> Deck:
        """Add a surface of faces: pairs of a set or an element, and S1 to S6, SPOS or SNEG."""
        return self.card("SURFACE", [(_where(of), side) for of, side in faces], NAME=_name(name))

    def node_surface(self, name: str, members: Iterable[int | str]) -> Deck:
        """Add a surface of nodes: ids or sets."""
        members = [members] if isinstance(members, str) else members
        return self.card("SURFACE", [(_where(m),) for m in members], NAME=_name(name), TYPE="NODE")

    # --- Materials ----------------------------------------------------------------------------

    def material(
        self, name: str, young: Number, poisson: Number, density: Number | None = None,
        expansion: Number | None = None,
    ) -> Deck:
        """Add a linear elastic material: Young's modulus [force/area], Poisson's ratio; density
        [mass/volume], coefficient of thermal expansion [1/temperature]."""
        self.card("MATERIAL", NAME=_name(name))
        self.card("ELASTIC", [(young, poisson)])
        if density is not None:
            self.card("DENSITY", [(density,)])
        if expansion is not None:
            self.card("EXPANSION", [(expansion,)])
        return self

    def rubber(
        self, name: str, law: str, *parameters: Number, density: Number | None = None
    ) -> Deck:
        """Add a hyperelastic material for finite strain: `rubber("SEAL", "NEO HOOKE", C10, D1)`.

        law  a word of `*HYPERELASTIC`: NEO HOOKE, MOONEY-RIVLIN, YEOH, OGDEN and others; its
             `parameters` follow, with options as in "OGDEN, N=2"
        """
        self.card("MATERIAL", NAME=_name(name))
        words, *options = (word.strip() for word in law.split(","))
        pairs = (option.partition("=") for option in options if option)
        given = {key.strip(): value.strip() or True for key, _, value in pairs}
        lines = [parameters[k : k + 8] for k in range(0, len(parameters), 8)]
        self.card("HYPERELASTIC", lines, {words: True, **given})
        if density is not None:
            self.card("DENSITY", [(density,)])
        return self

    def section(self, material: str, elements: str) -> Deck:
        """Give a set of elements its material."""
        return self.card("SOLID SECTION", options={
            "ELSET": _name(elements), "MATERIAL": _name(material),
        })

    # --- Contact ------------------------------------------------------------------------------

    def plane(
        self, name: str, point: Sequence[Number], normal: Sequence[Number],
        reference_node: int | None = None,
    ) -> Deck:
        """Add a rigid plane; its normal points to where the body is."""
        return self._obstacle(name, "PLANE", [(*point, *normal)], reference_node)

    def sphere(
        self, name: str, centre: Sequence[Number], radius: Number, inner: bool = False,
        reference_node: int | None = None,
    ) -> Deck:
        """Add a rigid sphere; `inner`: the body lies inside it."""
        return self._obstacle(name, "SPHERE", [(*centre, radius)], reference_node, INNER=inner)

    def cylinder(
        self, name: str, point: Sequence[Number], axis: Sequence[Number], radius: Number,
        inner: bool = False, reference_node: int | None = None,
    ) -> Deck:
        """Add a rigid cylinder without ends about the axis through a point."""
        lines = [(*point, *axis, radius)]
        return self._obstacle(name, "CYLINDER", lines, reference_node, INNER=inner)

    def cone(
        self, name: str, centre: Sequence[Number], axis: Sequence[Number],
        radii: tuple[Number, Number], height: Number, inner: bool = False,
        facets: int | None = None, reference_node: int | None = None,
    ) -> Deck:
        """Add a rigid cone with flat ends, of facets; with equal radii it is a cylinder with ends.

        The first radius belongs to the end at `centre`; `axis` points to the other end. With
        `inner` it is a bore without ends.
        """
        lines = [(*centre, *axis, *radii, height)]
        return self._obstacle(name, "CONE", lines, reference_node, INNER=inner, FACETS=facets)

    def stl(
        self, name: str, path: str | os.PathLike[str], reference_node: int | None = None
    ) -> Deck:
        """Add a rigid surface of the triangles in an STL file."""
        full = f'"{Path(path).resolve()}"'
        return self._obstacle(name, "STL", [], reference_node, INPUT=full)

    def _obstacle(
        self, name: str, kind: str, lines: list[Any], reference_node: int | None, **options: Any
    ) -> Deck:
        given = {"NAME": _name(name), "TYPE": kind, **options, "REF NODE": reference_node}
        return self.card("OBSTACLE", lines, given)

    def rigid_body(self, elements: str, reference_node: int) -> Deck:
        """Make a set of facets, or of solid elements, move as its reference node does."""
        return self.card("RIGID BODY", ELSET=_name(elements), REF_NODE=reference_node)

    def interaction(self, name: str, friction: Number | None = None) -> Deck:
        """Add what happens where surfaces touch: a coefficient of friction, or none."""
        self.card("SURFACE INTERACTION", NAME=_name(name))
        return self if friction is None else self.card("FRICTION", [(friction,)])

    def pair(
        self, slave: str, master: str, interaction: str, adjust: Number | None = None,
        small_sliding: bool = False,
    ) -> Deck:
        """Let a slave surface touch a master: an obstacle, or the surface of another body."""
        given = {
            "INTERACTION": _name(interaction), "ADJUST": adjust, "SMALL SLIDING": small_sliding,
        }
        return self.card("CONTACT PAIR", [(_name(slave), _name(master))], given)

    def tie(
        self, name: str, slave: str, master: str, position_tolerance: Number | None = None
    ) -> Deck:
        """Join two surfaces."""
        given = {"NAME": _name(name), "POSITION TOLERANCE": position_tolerance}
        return self.card("TIE", [(_name(slave), _name(master))], given)

    def sector(
        self, name: str, sides: tuple[str, str], n: int,
        axis: tuple[Sequence[Number], Sequence[Number]], position_tolerance: Number | None = None,
    ) -> Deck:
        """Take the body between two sides for one of n equal sectors about an axis.

            deck.sector("WHEEL", ("LEFT", "RIGHT"), 12, ((0, 0, 0), (0, 0, 1)))
        """
        given = {"NAME": _name(name), "POSITION TOLERANCE": position_tolerance,
                 "CYCLIC SYMMETRY": True}
        self.card("TIE", [tuple(_name(side) for side in sides)], given)
        line = (*axis[0], *axis[1])
        return self.card("CYCLIC SYMMETRY MODEL", [line], {"N": n, "TIE": _name(name)})

    def contact_solver(self, **options: Any) -> Deck:
        """Choose the contact solver: SOLVER="AUTO", TOLERANCE=1e-10 and others of docs/deck.md."""
        return self.card("CONTACT SOLVER", (), None, **options)

    # --- Steps and loads ----------------------------------------------------------------------

    def accuracy(
        self, wanted: Number, of: str | None = None, nodes: str | None = None,
        direction: int | None = None, mesh: str | None = None, value: str | None = None,
    ) -> Deck:
        """Ask for an accuracy: the program chooses mesh and increments.

            deck.node_set("TIP", [17])
            deck.accuracy(0.02, "DISPLACEMENT", nodes="TIP", direction=3)

        wanted     the largest error allowed, 0.02 for 2 %; `accuracy=` of a run takes precedence
        of         RESULTANTS, ENERGY, PRESSURE, SLIP, DISPLACEMENT, MISES; of a set also
                   REACTION FORCE and CONTACT FORCE
        nodes      the set of nodes whose values are meant
        direction  1, 2 or 3: of their vectors this component alone
        mesh       REFINE or KEEP
        value      FINEST: of the last mesh; EXTRAPOLATED: of what several meshes give
        """
        given = {
            "OF": of, "NSET": nodes and _name(nodes), "DIRECTION": direction, "MESH": mesh,
            "VALUE": value,
        }  # fmt: skip
        return self.card("ACCURACY", [(wanted,)], given)

    def amplitude(
        self, name: str, points: Sequence[tuple[Number, Number]], total_time: bool = False
    ) -> Deck:
        """Add a table of pairs (time, factor), linear between."""
        return self.card(
            "AMPLITUDE", points, NAME=_name(name), TIME="TOTAL TIME" if total_time else None
        )

    def initial_temperature(self, where: int | str, value: Number) -> Deck:
        """Say what the temperature of nodes is before the first step."""
        return self.card("INITIAL CONDITIONS", [(_where(where), value)], TYPE="TEMPERATURE")

    @contextmanager
    def step(
        self, increment: Number = 1.0, period: Number = 1.0, direct: bool = False, title: str = "",
        nlgeom: bool = False, largest: Number | None = None,
    ) -> Iterator[Deck]:
        """Add a step; the cards made in the `with` block belong to it.

        increment, period  of time; `direct`: the increments stay as they are
        nlgeom             finite strain
        largest            increment that they grow to while load steps make little error
        """
        if self._in_step:
            raise ValueError("a step within a step")
        self.card("STEP", title.splitlines(), NLGEOM=nlgeom)
        line = (increment, period) if largest is None else (increment, period, 0, largest)
        self.card("STATIC", [line], DIRECT=direct)
        try:
            yield self
        finally:
            self.card("END STEP")

    def _load(
        self, keyword: str, line: Sequence[Any], amplitude: str | None, op: str | None,
        **options: Any,
    ) -> Deck:
        """Add a card of one line that belongs to a step."""
        given = {"AMPLITUDE": amplitude and _name(amplitude), "OP": op, **options}
        return self.card(keyword, [line], given)

    def boundary(
        self, where: int | str, first: int | str, last: int | None = None, value: Number = 0.0,
        amplitude: str | None = None, op: str | None = None, fixed: bool = False,
    ) -> Deck:
        """Prescribe a displacement of nodes in the directions `first` to `last`.

        first  1, 2, 3 for x, y, z; 4 to 6 for the rotation vector of a reference node; or "XSYMM",
               "PINNED" and their like alone
        fixed  hold the nodes where they are as the step begins
        """
        line: tuple[Any, ...] = (_where(where), first, first if last is None else last, value)
        if isinstance(first, str) and not first.startswith("<"):
            line = line[:2]
        return self._load("BOUNDARY", line, amplitude, op, FIXED=fixed)

    def force(
        self, where: int | str, direction: int, value: Number, amplitude: str | None = None,
        op: str | None = None,
    ) -> Deck:
        """Put a force on each of some nodes, or on the obstacle of a reference node."""
        return self._load("CLOAD", (_where(where), direction, value), amplitude, op)

    def pressure(
        self, surface: str, value: Number, amplitude: str | None = None, op: str | None = None
    ) -> Deck:
        """Put a pressure on a surface, positive into the body."""
        return self._load("DSLOAD", (_name(surface), "P", value), amplitude, op)

    def gravity(
        self, acceleration: Number, direction: Sequence[Number] = (0.0, 0.0, -1.0),
        elements: str = "", amplitude: str | None = None, op: str | None = None,
    ) -> Deck:
        """Let elements, or all of them, have weight; their materials need a density."""
        name = _name(elements) if elements else ""
        return self._load("DLOAD", (name, "GRAV", acceleration, *direction), amplitude, op)

    def temperature(
        self, where: int | str, value: Number, amplitude: str | None = None, op: str | None = None
    ) -> Deck:
        """Prescribe a temperature of nodes."""
        return self._load("TEMPERATURE", (_where(where), value), amplitude, op)

    def output(
        self, nodes: Sequence[str] = (), elements: Sequence[str] = (), contact: bool = True,
        position: str | None = None, frequency: int | None = None,
    ) -> Deck:
        """Say what is written of nodes, of elements and of contact.

        nodes      "U", "RF", "CF"
        elements   "S", "E", "MISES", "SP", "EP", "EG", "PK2", "ERR"
        position   of what is on elements: "CENTROIDAL", "INTEGRATION POINTS" or "AVERAGED AT NODES"
        frequency  every so many increments
        """
        every = {"FREQUENCY": frequency}
        if nodes:
            self.card("NODE FILE", [tuple(nodes)], every)
        if elements:
            self.card("EL FILE", [tuple(elements)], {**every, "POSITION": position})
        if contact:
            self.card("CONTACT FILE", options=every)
        return self
