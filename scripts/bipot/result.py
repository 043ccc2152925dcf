"""Read a bipot result file (NAME.vtkhdf): history, contact, fields and mesh as numpy arrays.

    import bipot

    with bipot.read("block.vtkhdf") as result:
        pair = result.pairs["BODY-ZMIN:GROUND"]
        node = result.nearest_node((1.0, 0.0, 0.0))
        print(result.history("contact_iterations").sum(), pair.force_at(node)[-1])

Rows are increments of the whole run, counted from 0 here; the console counts from 1. The start of
the run (no load, no displacement) is not in the file. Whatever an interrupted run was still writing
is left out. All numbers are in the unit system of the deck: the program has none of its own.
docs/results.md describes the layout.
"""

from __future__ import annotations

import os
from functools import cached_property
from html import escape
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.along import Path as PathAlong
from bipot.along import path_of
from bipot.element_faces import ELEMENT_FACES, outer_faces_of, split_faces
from bipot.errors import ResultError
from bipot.mesh_sequence import GROUP as ACCURACY
from bipot.mesh_sequence import MeshSequence
from bipot.named_sets import NamedSets
from bipot.pairs import Pair, Pairs
from bipot.quantities import OPEN, SLIDE, STATUS_NAMES, STICK, von_mises
from bipot.reference_nodes import ReferenceNode, ReferenceNodes
from bipot.springs import Springs
from bipot.summary import Summary, summarize
from bipot.units import Units

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas
    import pyvista

__all__ = (
    "ELEMENT_FACES", "OPEN", "SLIDE", "STATUS_NAMES", "STICK", "Description", "MeshSequence",
    "NamedSets", "Pair", "Pairs", "ReferenceNode", "ReferenceNodes", "Result", "ResultError",
    "Springs", "von_mises",
)

Array = NDArray[Any]

# What of a deck asks for a field that not every result has.
ASKED_BY = {
    "displacement": "U of *NODE FILE", "applied_force": "CF of *NODE FILE",
    "contact_penetration": "COPEN of *CONTACT FILE", "stress": "S of *EL FILE",
    "strain": "E of *EL FILE", "von_mises": "S of *EL FILE", "principal_stress": "SP of *EL FILE",
    "principal_strain": "EP of *EL FILE", "green_strain": "EG of *EL FILE",
    "pk2_stress": "PK2 of *EL FILE", "mesh_error": "ERR of *EL FILE",
    "contact_force": "*CONTACT PAIR", "contact_pressure": "*CONTACT PAIR",
    "contact_status": "*CONTACT PAIR",
}


class Description(NamedTuple):
    """What the file says of a dataset."""

    quantity: str  #: "length", "force", "pressure", ...: the deck's own units; "seconds", "ratio"
    text: str  #: what it is
    shape: tuple[int, ...]  #: of what is stored

    def __str__(self) -> str:
        return f"{self.quantity}: {self.text}"


class Result:
    """A result file, open for reading; use it in a `with` statement, or `close` it.

    `notes` lists what the program noted: of the deck, and where the result comes from bipot.run
    also of the run.
    """

    def __init__(self, path: str | os.PathLike[str]):
        """Open `path`; raise ResultError if it is not the result of a bipot run."""
        self.path = Path(path)
        self.notes: list[str] = []
        if not self.path.is_file():
            raise ResultError(f"{path}: no such file")
        try:
            self.file = h5py.File(self.path, "r")
        except OSError as error:
            if "unable to lock" in str(error):
                raise ResultError(
                    f"{path}: a run is writing this file; wait for its end or read a copy"
                ) from error
            raise ResultError(f"{path}: not an HDF5 file ({error})") from error
        needed = ("VTKHDF/Points", "VTKHDF/Connectivity", "history", "run")
        absent = [name for name in needed if name not in self.file]
        if absent or "finished" not in self.file["history"].attrs:
            self.file.close()
            what = ", ".join("/" + name for name in absent) or "/history@finished"
            raise ResultError(f"{path}: not a bipot result (no {what})")
        if "notes" in self.file["run"]:
            lines = filter(str.strip, self.run_text("notes").splitlines())
            self.notes = [line.removeprefix("note: ") for line in lines]

    def __enter__(self) -> Result:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; arrays already read stay valid."""
        self.file.close()

    def _dataset(self, name: str) -> h5py.Dataset:
        """Return a dataset of the file by its full name."""
        found = self.file.get(name)
        if not isinstance(found, h5py.Dataset):
            raise ResultError(f"{self.path}: no dataset {name}")
        return found

    def _named_numbers(self, name: str) -> dict[str, float]:
        """Return a dataset whose numbers have names as a dictionary."""
        dataset = self._dataset(name)
        names = [_plain(name) for name in dataset.attrs["name"]]
        return dict(zip(names, dataset[:].tolist(), strict=True))

    # --- The run ------------------------------------------------------------------------------

    @cached_property
    def finished(self) -> int:
        """Number of finished increments, T."""
        return int(self.file["history"].attrs["finished"])

    @cached_property
    def run(self) -> dict[str, Any]:
        """The attributes of the run (program, version, status, ...) as a dictionary."""
        return {name: _plain(value) for name, value in self.file["run"].attrs.items()}

    @cached_property
    def units(self) -> Units:
        """What the deck calls its units (*UNITS): `units.of("pressure")` is "N/mm²", say."""
        return Units.from_text(str(self.run.get("units", "")))

    def run_text(self, name: str) -> str:
        """Return a text kept with the run: "deck", "overrides" or "plan"."""
        value = self._dataset(f"/run/{name}")[()]
        lines = [_plain(line) for line in np.atleast_1d(value)]
        return "\n".join(lines)

    @cached_property
    def counters(self) -> dict[str, float]:
        """What was really done, by name: /run/counters as a dictionary of numbers."""
        return self._named_numbers("/run/counters")

    @cached_property
    def estimates(self) -> dict[str, float]:
        """What the plan foresaw, by name: /run/estimates as a dictionary of numbers."""
        return self._named_numbers("/run/estimates")

    # --- History ------------------------------------------------------------------------------

    @cached_property
    def history_names(self) -> list[str]:
        """Names of all histories, such as "time" and "energy/strain"."""
        names: list[str] = []
        self.file["history"].visititems(
            lambda name, found: names.append(name) if isinstance(found, h5py.Dataset) else None
        )
        return names

    def history(self, name: str) -> Array:
        """Return a history over the finished increments, such as "energy/strain": (T,)."""
        return self._dataset(f"/history/{name}")[: self.finished]

    def to_pandas(self) -> pandas.DataFrame:
        """Return all histories as a pandas.DataFrame, a row an increment of the run, from 1.

        Behind them, of each pair: NAME/resultant_x, _y, _z, the force on the slave body; of each
        reference node: NUMBER/displacement_x, and so reaction_force, rotation, ..., as the file
        has them; of each spring NUMBER/spring_force and NUMBER/elongation.
        """
        import pandas

        columns = {name: self.history(name) for name in self.history_names}
        for pair in self.pairs.values():
            for axis, letter in enumerate("xyz"):
                columns[f"{pair.name}/resultant_{letter}"] = pair.resultant[:, axis]
        for node in self.reference_nodes:
            for name in self.reference_nodes.quantities:
                for axis, letter in enumerate("xyz"):
                    columns[f"{node.node_id}/{name}_{letter}"] = getattr(node, name)[:, axis]
        for row, number in enumerate(self.springs.element_ids):
            columns[f"{number}/spring_force"] = self.springs.force[:, row]
            columns[f"{number}/elongation"] = self.springs.elongation[:, row]
        rows = pandas.RangeIndex(1, self.finished + 1, name="row")
        return pandas.DataFrame(columns, index=rows)

    def summary(self) -> pandas.DataFrame | Summary:
        """Return what came of the contact pairs: a row for each at the end of each step.

        Columns: step, increment, time, pair; normal_force_x, _y, _z and friction_force_x, _y, _z,
        the sums on the slave body; largest_pressure; largest_slip; normal_force_error,
        friction_force_error, largest_pressure_error, largest_slip_error, estimated, in the same
        units as what they are of (of a vector, of each component), not a number where nothing is
        known; normal_sum, of the magnitudes of the normal forces; moment_x, _y, _z, of all forces
        on the slave body about the pair's `middle`; extent of the pair from there.

        It is a pandas.DataFrame where pandas is there, else a list of dictionaries. Printed, that
        list is the table that the program prints, in digits that are known.
        """
        rows = summarize(self)
        try:
            import pandas
        except ImportError:
            return rows
        return pandas.DataFrame(rows)

    def describe(self, name: str) -> Description:
        """Return what the file says of a field, a history, or a dataset by its full name.

        `describe("displacement").quantity` is "length"; the unit is the deck's own. Raises
        ResultError where there is no such dataset.
        """
        places = ("", "/VTKHDF/PointData/", "/VTKHDF/CellData/", "/history/", "/reference_nodes/",
                  "/VTKHDF/")
        for place in places[:1] if name.startswith("/") else places[1:]:
            found = self.file.get(place + name)
            if isinstance(found, h5py.Dataset):
                quantity, text = (
                    str(_plain(found.attrs.get(key, ""))) for key in ("quantity", "description")
                )
                return Description(quantity, text, found.shape)
        raise ResultError(f"{self.path}: no field or history '{name}'")

    @cached_property
    def certificate(self) -> dict[str, Array]:
        """The entries of the certificate over the increments, by name; -1 is pending."""
        group = self.file["history/certificate"]
        return {name: self.history(f"certificate/{name}") for name in group}

    @cached_property
    def accuracy(self) -> MeshSequence | None:
        """The runs that led to the accuracy asked for; None where the mesh was kept."""
        return MeshSequence(self) if ACCURACY in self.file else None

    @cached_property
    def step_ends(self) -> Array:
        """Rows of the last finished increment of each *STEP."""
        step = self.history("step")
        if len(step) == 0:
            return np.zeros(0, dtype=int)
        return np.flatnonzero(np.append(step[1:] != step[:-1], True))

    def label(self, row: int) -> str:
        """Return words for a row: step, increment and time."""
        step, increment, time = (self.history(name)[row] for name in ("step", "increment", "time"))
        return f"step {step}, increment {increment}, time {time:.4g}"

    @cached_property
    def convergence(self) -> dict[str, Array] | None:
        """The histories of the contact iterations by name, or None if the run kept none."""
        group = self.file.get("convergence")
        if group is None or len(group) == 0:
            return None
        return {name: dataset[()] for name, dataset in group.items()}

    @property
    def is_plane(self) -> bool:
        """Whether the mesh is a slice or a wedge that stands for bodies of elements of a plane."""
        return self.run.get("bodies") in ("slice", "wedge")

    # --- Mesh ---------------------------------------------------------------------------------

    @cached_property
    def points(self) -> Array:
        """Coordinates of the nodes of elements before any displacement, (N, 3)."""
        return self._dataset("/VTKHDF/Points")[()]

    @cached_property
    def elements(self) -> Array:
        """Nodes of the elements as rows of `points`, (E, 8), where all are hexahedra.

        Raises ResultError where any is of another shape: `cells` has them all.
        """
        if (self._dataset("/VTKHDF/Types")[()] != 12).any():
            raise ResultError(f"{self.path}: not all elements are C3D8; result.cells has them all")
        return self._dataset("/VTKHDF/Connectivity")[()].reshape(-1, 8)

    @cached_property
    def cells(self) -> dict[int, tuple[Array, Array]]:
        """The elements by their types in VTK: rows of `element_ids` (n,), and nodes (n, k).

        The nodes are rows of `points`, in the order of the deck, which is VTK's.
        """
        types = self._dataset("/VTKHDF/Types")[()]
        first = self._dataset("/VTKHDF/Offsets")[()]
        nodes = self._dataset("/VTKHDF/Connectivity")[()]
        found = {}
        for number in np.unique(types):
            rows = np.flatnonzero(types == number)
            count = first[rows[0] + 1] - first[rows[0]]
            found[int(number)] = (rows, nodes[first[rows][:, None] + np.arange(count)])
        return found

    @cached_property
    def _n_elements(self) -> int:
        return len(self._dataset("/VTKHDF/Types"))

    @cached_property
    def node_ids(self) -> Array:
        """The deck's ids of the nodes, (N,)."""
        return self._dataset("/VTKHDF/PointData/node_id")[: len(self.points)].ravel().astype(int)

    @cached_property
    def element_ids(self) -> Array:
        """The deck's ids of the elements, (E,)."""
        return self._dataset("/VTKHDF/CellData/element_id")[: self._n_elements].ravel().astype(int)

    def node(self, node_id: int) -> int:
        """Return the row in `points` of the node that the deck calls `node_id`.

        Raises ResultError where no element has it; `reference_nodes` has others.
        """
        found = np.flatnonzero(self.node_ids == node_id)
        if len(found) == 0:
            also = ""
            if node_id in self.reference_nodes.node_ids:
                also = "; it is one of reference_nodes"
            raise ResultError(f"{self.path}: elements have no node {node_id}{also}")
        return int(found[0])

    def nearest_node(self, position: ArrayLike) -> int:
        """Return the row in `points` of the node nearest to a position."""
        return int(np.argmin(np.linalg.norm(self.points - np.asarray(position, float), axis=1)))

    @cached_property
    def boundary(self) -> tuple[Array, Array]:
        """Faces that belong to one element only: (nodes (F, 4) counterclockwise, element (F,)).

        A triangle has its last node twice. Faces with nodes in the middles of their edges are split
        between all their nodes.
        """
        nodes, elements, _ = self._outer_pieces
        return nodes, elements

    @cached_property
    def boundary_edges(self) -> Array:
        """Which of the four sides of each face of `boundary` are edges of elements, (F, 4)."""
        return self._outer_pieces[2]

    @cached_property
    def _outer_pieces(self) -> tuple[Array, Array, Array]:
        blocks = list(self.cells.values())
        faces, nodes = outer_faces_of([cell for _, cell in blocks])
        rows = np.concatenate([rows for rows, _ in blocks])[faces[:, 0]]
        order = np.lexsort((faces[:, 1], rows))
        pieces, parent, edges = split_faces(nodes[order])
        return pieces, rows[order][parent], edges

    # --- Sets ---------------------------------------------------------------------------------

    @cached_property
    def node_sets(self) -> NamedSets:
        """The deck's sets of nodes, and its surfaces of nodes, by name: rows of `points`, (n,).

        Nodes of a set that no element has are not among them: reference nodes are found by
        `reference_nodes.of_set`. A set without nodes of elements is left out.
        """
        return NamedSets(self, "nodes")

    @cached_property
    def element_sets(self) -> NamedSets:
        """The deck's sets of elements by name: rows of `element_ids`, (n,)."""
        return NamedSets(self, "elements")

    @cached_property
    def face_sets(self) -> NamedSets:
        """The deck's surfaces of faces by name: (F, 2), element and face 0 to 5 (S1 to S6).

        The element is a row of `element_ids`. Where all elements are hexahedra,
        `bipot.element_faces.face_nodes(result.elements, result.face_sets["TOP"])` are their nodes.
        """
        return NamedSets(self, "faces")

    # --- Fields -------------------------------------------------------------------------------

    @cached_property
    def field_rows(self) -> Array:
        """Row of the history that each stored increment of the fields belongs to, (S,)."""
        steps = self.file["VTKHDF"].get("Steps")
        if steps is None or self.finished == 0:
            return np.zeros(0, dtype=int)
        values = steps["Values"][: int(steps.attrs["NSteps"])]
        times = self.history("time")
        # Times are copied, not computed, so an equal one exists unless its increment was undone.
        rows = np.clip(np.searchsorted(times, values), 0, len(times) - 1)
        return rows[times[rows] == values]

    def field_row(self, index: int = -1) -> int:
        """Return `field_rows[index]`; raise ResultError where there is no such increment."""
        stored = len(self.field_rows)
        if not -stored <= index < stored:
            raise ResultError(f"{self.path}: the fields of {stored} increments, no index {index}")
        return int(self.field_rows[index])

    @cached_property
    def field_names(self) -> tuple[set[str], ...]:
        """Names of the fields on nodes and on elements: (set, set)."""
        groups = (self.file["VTKHDF"].get(name, ()) for name in ("PointData", "CellData"))
        return tuple(set(group) for group in groups)

    def field(
        self, name: str, index: int = -1, on: str | None = None, *,
        nodes: str | ArrayLike | None = None, elements: str | ArrayLike | None = None,
        type: str | None = None,
    ) -> Array:
        """Return a field of the stored increment `index` (0 to S-1): (N, ...) or (E, ...).

        `on` is "nodes" or "elements"; it may be left out unless the run has the field
        on both, as it may have stress and strain. `nodes` or `elements` is the name of a set of
        the deck, or rows, of which the values are wanted. Negative indices count from the end;
        `field_rows[index]` is the increment of the run. Raises ResultError where there is no such
        field, increment or set, or where `on` is needed.

        With `on="gauss points"` these are the values at the points of all elements of a `type`,
        one of `gauss_types`, which may be left out where there is one only: (elements, points,
        ...), the elements those of `gauss_elements(type)`.
        """
        if on == "gauss points":
            if nodes is not None or elements is not None:
                raise ValueError("at Gauss points, all elements of a type: no nodes or elements")
            self.field_row(index)
            group = self._gauss_group(type)
            if name not in self.file[group]:
                raise ResultError(self._missing_field(name, on))
            return self._dataset(f"{group}/{name}")[index % len(self.field_rows)]
        if type is not None:
            raise ValueError("a type of elements is for on='gauss points'")
        if nodes is not None and elements is not None:
            raise ValueError("nodes or elements, not both")
        for place, chosen, sets in (
            ("nodes", nodes, self.node_sets), ("elements", elements, self.element_sets)
        ):
            if chosen is not None:
                if on not in (None, place):
                    raise ValueError(f"on is {on!r}, and {place} are given")
                rows = sets[chosen] if isinstance(chosen, str) else np.asarray(chosen)
                return self.field(name, index, place)[rows]
        self.field_row(index)
        places = ("nodes", "elements")
        if on not in (None, *places):
            raise ValueError(f"on must be 'nodes', 'elements' or 'gauss points', not {on!r}")
        found = [place for place, names in zip(places, self.field_names, strict=True)
                 if name in names and on in (None, place)]
        if not found:
            raise ResultError(self._missing_field(name, on))
        if len(found) > 1:
            raise ResultError(
                f"{self.path}: '{name}' is on nodes and on elements; say on='nodes' or 'elements'"
            )
        if found == ["nodes"]:
            kind, size = "Point", len(self.points)
        else:
            kind, size = "Cell", self._n_elements
        offsets = self._dataset(f"/VTKHDF/Steps/{kind}DataOffsets/{name}")
        start = int(offsets[index % len(self.field_rows)])
        return self._dataset(f"/VTKHDF/{kind}Data/{name}")[start : start + size]

    @cached_property
    def gauss_types(self) -> list[str]:
        """The types of elements whose Gauss points the result has, such as "C3D10"."""
        return list(self.file.get("gauss", ()))

    def gauss_elements(self, type: str | None = None) -> Array:
        """Return the elements of a type, rows of `element_ids`, in the order of their fields."""
        ids = self._dataset(f"{self._gauss_group(type)}/element_id")[()]
        order = np.argsort(self.element_ids)
        return order[np.searchsorted(self.element_ids, ids, sorter=order)]

    def gauss_coordinates(self, type: str | None = None) -> Array:
        """Return the natural coordinates of the Gauss points of a type: (points, 3).

        Those of a hexahedron for C3D4, C3D5 and C3D6, which are computed as one.
        """
        return self._dataset(f"{self._gauss_group(type)}/natural_coordinates")[()]

    def _gauss_group(self, type: str | None) -> str:
        """Return the path of the group of a type."""
        types = self.gauss_types
        if not types:
            raise ResultError(
                f"{self.path}: no fields at Gauss points; *EL FILE, POSITION=INTEGRATION POINTS in"
                " the deck asks for them"
            )
        if type is None and len(types) == 1:
            type = types[0]
        if type is None or type.upper() not in types:
            say = "say type=..." if type is None else f"no type {type}"
            raise ResultError(f"{self.path}: {say}; it has {', '.join(types)}")
        return f"/gauss/{type.upper()}"

    def _missing_field(self, name: str, on: str | None) -> str:
        """Return words for a field that is not there: those that are, and how to ask for it."""
        words = f"{self.path}: no field '{name}'" + (f" on {on}" if on else "")
        there = [f"{', '.join(sorted(names))} on {place}"
                 for place, names in zip(("nodes", "elements"), self.field_names, strict=True)
                 if names and on in (None, place)]
        if there:
            words += f"; it has {'; '.join(there)}"
        plain = name.removesuffix("_gauss_points")  # older files call those at Gauss points so
        if plain in ASKED_BY and plain != name and self.gauss_types:
            return words + f"; field('{plain}', on='gauss points') has it"
        if plain in ASKED_BY:
            words += f"; {ASKED_BY[plain]} in the deck asks for it"
            if plain != name or on == "gauss points":
                words += ", with POSITION=INTEGRATION POINTS"
            elif on == "nodes" and ASKED_BY[plain].endswith("*EL FILE"):
                words += ", with POSITION=AVERAGED AT NODES"
        return words

    def reaction(self, nodes: str, index: int = -1) -> Array:
        """Return the sum of the forces of the supports on a set of nodes, in x, y, z: (3,).

        `nodes` is the set's name, `index` the stored increment, as for `field`. Reference nodes of
        the set count, too. Raises ResultError where there is no such set or increment.
        """
        row = self.field_row(index)
        references = self.reference_nodes.sets.get(nodes, [])
        total = np.zeros(3)
        if nodes in self.node_sets or len(references) == 0:
            total += self.field("reaction_force", index, nodes=nodes).sum(axis=0)
        if len(references):
            total += self.reference_nodes.reaction_force[row, references].sum(axis=0)
        return total

    # --- Contact ------------------------------------------------------------------------------

    @cached_property
    def pairs(self) -> Pairs:
        """The contact pairs, in the order of their names: by number or by name."""
        return Pairs(self, list(self.file.get("contact", ())))

    # --- Reference nodes ----------------------------------------------------------------------

    @cached_property
    def reference_nodes(self) -> ReferenceNodes:
        """What moves or carries forces beside the elements, by the deck's ids of the nodes."""
        return ReferenceNodes(self)

    @cached_property
    def springs(self) -> Springs:
        """Forces and elongations of the springs, over the increments."""
        return Springs(self)

    # --- Along a path -------------------------------------------------------------------------

    def along(
        self, points: ArrayLike, count: int | None = None, *,
        elements: str | ArrayLike | None = None,
    ) -> PathAlong:
        """Return a path through places before any displacement, for values along it.

        points    (P, 3) places, two or more
        count     number of points at equal distances on the straight lines between those places;
                  None: the places as they are
        elements  a set of elements of the deck, or their rows: the path sees no other

        `path.field("displacement")` are values at the points, `path.table()` and `path.to_csv`
        all that one wants to know, `path.plot()` a figure. Raises ValueError for what is no path,
        ResultError where no element has a point of it.
        """
        return path_of(self, points, count, elements)

    # --- For other programs -------------------------------------------------------------------

    def to_pyvista(self, index: int = -1) -> pyvista.UnstructuredGrid:
        """Return the mesh and all fields of the stored increment `index` as a PyVista grid.

        It is undeformed; `grid.warp_by_vector("displacement")` deforms it. `node_id` and
        `element_id` are the deck's numbers. Its field data has the `time`.
        """
        import pyvista

        # Before the nodes of each cell stands how many there are.
        offsets = self._dataset("/VTKHDF/Offsets")[()]
        nodes = self._dataset("/VTKHDF/Connectivity")[()]
        cells = np.insert(nodes, offsets[:-1], np.diff(offsets))
        grid = pyvista.UnstructuredGrid(cells, self._dataset("/VTKHDF/Types")[()], self.points)
        grid.point_data["node_id"] = self.node_ids
        grid.cell_data["element_id"] = self.element_ids
        if len(self.field_rows) == 0:
            return grid
        kept = {"node_id", "element_id"}
        nodal, elemental = (names - kept for names in self.field_names)
        for name in sorted(nodal):
            grid.point_data[name] = self.field(name, index, on="nodes")
        for name in sorted(elemental):
            grid.cell_data[name] = self.field(name, index, on="elements")
        grid.field_data["time"] = [self.history("time")[self.field_rows[index]]]
        return grid

    def plot(
        self, what: str | None = None, index: int = -1, pair: str | int = 0,
        scale: float | None = None, *, component: str | None = None,
        view: tuple[float, float] | None = None, limits: tuple[float, float] | None = None,
        clip: str | None = None, turn: float | None = None,
    ) -> matplotlib.figure.Figure:
        """Return a matplotlib figure, as scripts/show draws it.

        what     "displacement", "stress", "pressure" (of contact) or "mesh_error" on the deformed
                 bodies at the stored increment `index`; "contact": the states of a pair's points
                 at a few increments; "forces" of a pair over the time; "errors" of the
                 certificate, and estimated ones; "accuracy": the runs by which one was reached.
                 None: "displacement", or "forces" where no field is stored
        pair     name or number of the pair
        scale    factor of the drawn displacements; None: chosen so that they are seen
        component  "x", "y" or "z" of the displacement, "xx", "yy", "zz", "xy", "yz" or "xz" of the
                 stress; None: the magnitude, von Mises's stress
        view     elevation and azimuth of the spectator, in degrees; None: chosen
        limits   of the colours, the least and the largest value; None: those of the increment

        clip     a plane across x, y or z, as "x=0.5", or "x" in the middle of the bodies; what lies
                 before it is cut away
        turn     degrees by which the section of bodies of revolution is turned about its axis

        Raises ResultError where the file does not hold it, ValueError for another word.
        """
        from bipot import pictures

        plane = pictures.plane_of(clip) if clip else None
        look = pictures.Look(scale, index, view, limits, component, plane, turn=turn)
        return pictures.figure(self, what, pair, look)

    def to_html(self, path: str | os.PathLike[str], scale: float | None = None) -> Path:
        """Write pictures, plan, errors and certificate as one page that needs nothing else.

        `scale` is that of `plot`. Returns the path. Raises ResultError where no increment is
        finished.
        """
        from bipot.page import write_page
        from bipot.pictures import Look

        if self.finished == 0:
            raise ResultError(f"{self.path}: no increment is finished")
        return write_page(self, Path(path), Look(scale))

    def to_frd(self, path: str | os.PathLike[str]) -> Path:
        """Write mesh and nodal results as CalculiX does, for cgx, FreeCAD and PrePoMax.

        Of every stored increment: DISP, FORC (forces of the supports), STRESS and TOSTRAIN as far
        as they are stored (of elements alone: means at the nodes), and with contact COPEN, CSLIP1,
        CSLIP2, CPRESS, CSHEAR1 and CSHEAR2 on slave nodes. Returns the path. Raises ResultError
        where no fields are stored.
        """
        from bipot.frd import write_frd

        return write_frd(self, Path(path))

    @property
    def error_of_energy(self) -> bool:
        """Whether the histories of estimated errors are of the energy, not of the contact force."""
        group = self.file.get("history/error")
        of_energy = group is not None and bool(group.attrs.get("of_energy", 0))
        return of_energy or not len(self.pairs)

    @property
    def small_strain_is(self) -> str:
        """What `error/small_strain` is: "bound", "estimate", or "finite strain", and then 0."""
        group = self.file.get("history/error")
        told = group.attrs.get("small_strain_is", "bound") if group is not None else "bound"
        return told.decode() if isinstance(told, bytes) else str(told)

    @property
    def certified(self) -> bool:
        """Whether there is an increment, and every one passed the certificate."""
        found = self.history("certified")
        return len(found) > 0 and bool((found == 1).all())

    @property
    def worst_error(self) -> float:
        """The largest entry of the certificate in any increment; not a number without one."""
        found = [values.max() for values in self.certificate.values() if len(values)]
        return float(max(found)) if found else float("nan")

    def _summary(self) -> dict[str, str]:
        """Return what one wants to know first, in words."""
        good = int((self.history("certified") == 1).sum())
        lines = {
            "status": str(self.run.get("status", "unknown")),
            "increments": f"{self.finished}, {good} of them certified",
            "worst error of the certificate": f"{self.worst_error:.2g}",
            "mesh": f"{len(self.points)} nodes, {len(self.element_ids)} elements",
        }
        if self.finished:
            for pair in self.pairs.values():
                force = ", ".join(f"{value:.6g}" for value in pair.resultant[-1])
                lines[f"force of {pair.name} at the end"] = force
        lines |= {f"note {number}": note for number, note in enumerate(self.notes, 1)}
        return lines

    def __repr__(self) -> str:
        if not self.file:
            return f"<Result {self.path}: closed>"
        words = self._summary()
        return f"<Result {self.path}: {words['status']}, increments {words['increments']}>"

    def _repr_html_(self) -> str:
        """Return a short summary with the certificate for a notebook."""
        if not self.file:
            return f"<p>{escape(str(self.path))}: closed</p>"
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th>"
            f"<td style='text-align:left'>{escape(text)}</td></tr>"
            for name, text in self._summary().items()
        )
        return f"<table><caption>{escape(str(self.path))}</caption>{rows}</table>"


def _plain(value: Any) -> Any:
    """Return text or numbers of an attribute as Python's own."""
    if isinstance(value, bytes):
        return value.decode(errors="replace").rstrip(" \0")
    if isinstance(value, str):
        return value.rstrip(" \0")
    if isinstance(value, np.ndarray):
        plain = [_plain(item) for item in value.ravel().tolist()]
        return plain[0] if len(plain) == 1 else plain
    return value.item() if isinstance(value, np.generic) else value
