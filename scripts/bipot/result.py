"""Read a bipot result file (NAME.vtkhdf): history, contact, fields and mesh as numpy arrays.

    from bipot.result import Result

    with Result("block.vtkhdf") as result:
        pair = result.pairs[0]
        node = result.nearest_node((1.0, 0.0, 0.0))
        print(result.history("contact_iterations").sum(), pair.force_at(node)[-1])

Rows are increments of the whole run, counted from 0 here; the console counts from 1. The start of
the run (no load, no displacement) is not in the file. Whatever an interrupted run was still writing
is left out. All numbers are in the unit system of the deck: the program has none of its own.
docs/results.md describes the layout.
"""

from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

OPEN, STICK, SLIDE = 0, 1, 2
STATUS_NAMES = ("open", "stick", "slide")

# The six faces of a brick, corners counterclockwise seen from outside.
BRICK_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


class ResultError(Exception):
    """The file cannot be read as a bipot result, or does not hold what was asked for."""


class Result:
    """A result file, open for reading; use it in a `with` statement."""

    def __init__(self, path):
        """Open `path`; raise ResultError if it is not the result of a bipot run."""
        self.path = Path(path)
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

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    def close(self):
        """Close the file; arrays already read stay valid."""
        self.file.close()

    def _dataset(self, name):
        """Return a dataset of the file by its full name."""
        found = self.file.get(name)
        if not isinstance(found, h5py.Dataset):
            raise ResultError(f"{self.path}: no dataset {name}")
        return found

    def _named_numbers(self, name):
        """Return a dataset whose numbers have names as a dictionary."""
        dataset = self._dataset(name)
        names = [_plain(name) for name in dataset.attrs["name"]]
        return dict(zip(names, dataset[:].tolist(), strict=True))

    # --- The run ------------------------------------------------------------------------------

    @cached_property
    def finished(self):
        """Number of finished increments, T."""
        return int(self.file["history"].attrs["finished"])

    @cached_property
    def run(self):
        """The attributes of the run (program, version, status, ...) as a dictionary."""
        return {name: _plain(value) for name, value in self.file["run"].attrs.items()}

    def run_text(self, name):
        """Return a text kept with the run: "deck", "overrides" or "plan"."""
        value = self._dataset(f"/run/{name}")[()]
        lines = [_plain(line) for line in np.atleast_1d(value)]
        return "\n".join(lines)

    @cached_property
    def counters(self):
        """What was really done, by name: /run/counters as a dictionary of numbers."""
        return self._named_numbers("/run/counters")

    @cached_property
    def estimates(self):
        """What the plan foresaw, by name: /run/estimates as a dictionary of numbers."""
        return self._named_numbers("/run/estimates")

    # --- History ------------------------------------------------------------------------------

    def history(self, name):
        """Return a history over the finished increments, such as "energy/strain"."""
        return self._dataset(f"/history/{name}")[: self.finished]

    @cached_property
    def certificate(self):
        """The six entries of the certificate over the increments, by name; -1 is pending."""
        group = self.file["history/certificate"]
        return {name: self.history(f"certificate/{name}") for name in group}

    @cached_property
    def step_ends(self):
        """Rows of the last finished increment of each *STEP."""
        step = self.history("step")
        return np.flatnonzero(np.append(step[1:] != step[:-1], True)) if len(step) else []

    def label(self, row):
        """Return words for a row: step, increment and time."""
        step, increment, time = (self.history(name)[row] for name in ("step", "increment", "time"))
        return f"step {step}, increment {increment}, time {time:.4g}"

    @cached_property
    def convergence(self):
        """The histories of the contact iterations by name, or None if the run kept none."""
        group = self.file.get("convergence")
        if group is None or len(group) == 0:
            return None
        return {name: dataset[()] for name, dataset in group.items()}

    # --- Mesh ---------------------------------------------------------------------------------

    @cached_property
    def points(self):
        """Coordinates of the nodes before any displacement, (N, 3)."""
        return self._dataset("/VTKHDF/Points")[()]

    @cached_property
    def bricks(self):
        """Nodes of the bricks as rows of `points`, (E, 8)."""
        return self._dataset("/VTKHDF/Connectivity")[()].reshape(-1, 8)

    @cached_property
    def node_ids(self):
        """The deck's ids of the nodes, (N,)."""
        return self._dataset("/VTKHDF/PointData/node_id")[: len(self.points)].ravel().astype(int)

    @cached_property
    def element_ids(self):
        """The deck's ids of the bricks, (E,)."""
        return self._dataset("/VTKHDF/CellData/element_id")[: len(self.bricks)].ravel().astype(int)

    def node(self, node_id):
        """Return the row in `points` of the node that the deck calls `node_id`."""
        found = np.flatnonzero(self.node_ids == node_id)
        if len(found) == 0:
            raise ResultError(f"{self.path}: the deck has no node {node_id}")
        return int(found[0])

    def nearest_node(self, position):
        """Return the row in `points` of the node nearest to a position."""
        return int(np.argmin(np.linalg.norm(self.points - np.asarray(position, float), axis=1)))

    @cached_property
    def boundary(self):
        """Faces that belong to one brick only: (nodes (F, 4) counterclockwise, brick (F,))."""
        faces = self.bricks[:, BRICK_FACES].reshape(-1, 4)
        _, first, count = np.unique(
            np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
        )
        alone = np.sort(first[count == 1])
        return faces[alone], alone // len(BRICK_FACES)

    # --- Fields -------------------------------------------------------------------------------

    @cached_property
    def field_rows(self):
        """Row of the history that each stored increment of the fields belongs to, (S,)."""
        steps = self.file["VTKHDF"].get("Steps")
        if steps is None or self.finished == 0:
            return np.zeros(0, dtype=int)
        values = steps["Values"][: int(steps.attrs["NSteps"])]
        times = self.history("time")
        # Times are copied, not computed, so an equal one exists unless its increment was undone.
        rows = np.clip(np.searchsorted(times, values), 0, len(times) - 1)
        return rows[times[rows] == values]

    @cached_property
    def field_names(self):
        """Names of the fields on nodes and on elements: (set, set)."""
        groups = (self.file["VTKHDF"].get(name, ()) for name in ("PointData", "CellData"))
        return tuple(set(group) for group in groups)

    def field(self, name, index, on=None):
        """Return a field of the stored increment `index` (0 to S-1): (N, ...) or (E, ...).

        `on` is "nodes" or "elements" (the bricks); it may be left out unless the run has the field
        on both, as it may have stress and strain. Negative indices count from the end;
        `field_rows[index]` is the increment of the run. Raises ResultError where there is no such
        field or increment, or where `on` is needed.
        """
        stored = len(self.field_rows)
        if not -stored <= index < stored:
            raise ResultError(f"{self.path}: the fields of {stored} increments, no index {index}")
        places = ("nodes", "elements")
        if on not in (None, *places):
            raise ValueError(f"on must be 'nodes' or 'elements', not {on!r}")
        found = [place for place, names in zip(places, self.field_names, strict=True)
                 if name in names and on in (None, place)]
        if not found:
            raise ResultError(f"{self.path}: no field '{name}'" + (f" on {on}" if on else ""))
        if len(found) > 1:
            raise ResultError(
                f"{self.path}: '{name}' is on nodes and on elements; say on='nodes' or 'elements'"
            )
        if found == ["nodes"]:
            kind, size = "Point", len(self.points)
        else:
            kind, size = "Cell", len(self.bricks)
        offsets = self._dataset(f"/VTKHDF/Steps/{kind}DataOffsets/{name}")
        start = int(offsets[index % stored])
        return self._dataset(f"/VTKHDF/{kind}Data/{name}")[start : start + size]

    # --- Contact ------------------------------------------------------------------------------

    @cached_property
    def pairs(self):
        """The contact pairs, in the order of their names."""
        return [Pair(self, name) for name in self.file.get("contact", ())]

    def pair(self, name):
        """Return the contact pair "<slave surface>:<master>"."""
        for pair in self.pairs:
            if pair.name == name:
                return pair
        raise ResultError(f"{self.path}: no contact pair '{name}'")


class Pair:
    """What happened at the P candidate points of one contact pair."""

    def __init__(self, result, name):
        self.result = result
        self.name = name

    def _points(self, quantity):
        """Return a dataset that is the same in all increments."""
        return self.result._dataset(f"/contact/{self.name}/{quantity}")[()]

    def _over_time(self, quantity):
        """Return a dataset over the finished increments."""
        return self.result._dataset(f"/contact/{self.name}/{quantity}")[: self.result.finished]

    @cached_property
    def friction_coefficient(self):
        """The pair's coefficient of friction; not a number where the file does not tell."""
        attributes = self.result.file[f"/contact/{self.name}"].attrs
        return float(attributes.get("friction_coefficient", np.nan))

    @cached_property
    def nodes(self):
        """Rows of the mesh's points, (P,)."""
        return self._points("node")

    @cached_property
    def coordinates(self):
        """Where the points are before any displacement, (P, 3)."""
        return self._points("coordinates")

    @cached_property
    def area(self):
        """The part of the surface that belongs to each point, (P,)."""
        return self._points("area")

    @cached_property
    def frame(self):
        """Local frames, rows n, t1, t2: (T, P, 3, 3), stored once where they do not change."""
        frame = self.result._dataset(f"/contact/{self.name}/frame")
        rows = self.result.finished
        if len(frame) == 1:
            return np.broadcast_to(frame[()], (rows, *frame.shape[1:]))
        return frame[:rows]

    @cached_property
    def reaction(self):
        """Reactions on the slave body in the local frame n, t1, t2: (T, P, 3)."""
        return self._over_time("reaction")

    @cached_property
    def force(self):
        """Reactions on the slave body in x, y, z: (T, P, 3)."""
        return np.einsum("tpa,tpax->tpx", self.reaction, self.frame)

    @cached_property
    def friction(self):
        """Tangential part of `force`, (T, P, 3)."""
        return np.einsum("tpa,tpax->tpx", self.reaction[:, :, 1:], self.frame[:, :, 1:])

    @cached_property
    def gap(self):
        """Distances to the obstacle, (T, P)."""
        return self._over_time("gap")

    @cached_property
    def slip(self):
        """Slip since the start of the run, local t1 and t2: (T, P, 2)."""
        return self._over_time("slip")

    @cached_property
    def slip_increment(self):
        """Slip in each increment, local t1 and t2: (T, P, 2)."""
        return self._over_time("slip_increment")

    @cached_property
    def status(self):
        """OPEN, STICK or SLIDE, (T, P)."""
        return self._over_time("status")

    @cached_property
    def resultant(self):
        """Sum of the reactions on the slave body in x, y, z: (T, 3)."""
        return self._over_time("resultant")

    @cached_property
    def moment(self):
        """Moment of the reactions on the slave body about the origin: (T, 3)."""
        return self._over_time("moment")

    @cached_property
    def torque(self):
        """Moment of the forces on the obstacle about its reference node: (T, 3)."""
        return self._over_time("torque")

    @cached_property
    def normal_sum(self):
        """Sum of the normal reactions, (T,)."""
        return self.reaction[:, :, 0].sum(axis=1)

    @cached_property
    def friction_sum(self):
        """Sum of the magnitudes of the tangential reactions, (T,)."""
        return np.linalg.norm(self.reaction[:, :, 1:], axis=2).sum(axis=1)

    def force_at(self, node):
        """Return the local reactions (n, t1, t2) at a node over the increments, (T, 3)."""
        found = np.flatnonzero(self.nodes == node)
        if len(found) == 0:
            raise ResultError(f"{self.result.path}: node {node} is not in pair {self.name}")
        return self.reaction[:, found[0]]

    @cached_property
    def faces(self):
        """Boundary faces whose four corners are points of this pair, as mesh points (F, 4)."""
        faces, _ = self.result.boundary
        return faces[np.isin(faces, self.nodes).all(axis=1)]


def von_mises(stress):
    """Return von Mises's stress of rows XX YY ZZ XY YZ XZ."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    return np.sqrt(
        ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * (xy**2 + yz**2 + xz**2)
    )


def _plain(value):
    """Return text or numbers of an attribute as Python's own."""
    if isinstance(value, bytes):
        return value.decode(errors="replace").rstrip(" \0")
    if isinstance(value, str):
        return value.rstrip(" \0")
    if isinstance(value, np.ndarray):
        plain = [_plain(item) for item in value.ravel().tolist()]
        return plain[0] if len(plain) == 1 else plain
    return value.item() if isinstance(value, np.generic) else value
