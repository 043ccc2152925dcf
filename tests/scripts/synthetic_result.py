"""Write a small result file in the program's layout, with numbers that are easy to foretell."""

import h5py
import numpy as np

PRESSURE = 10.0
FRICTION = 0.25
UNFINISHED = 1  # rows that a run was still writing when it was stopped


def element_mesh(nx, ny, nz):
    """Return points and elements of unit cubes, x fastest."""
    axes = [np.arange(count + 1.0) for count in (nz, ny, nx)]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    row, layer = nx + 1, (nx + 1) * (ny + 1)
    first = np.array(
        [i + j * row + k * layer for k in range(nz) for j in range(ny) for i in range(nx)]
    )
    corners = np.array([0, 1, row + 1, row])
    return points, first[:, None] + np.concatenate([corners, corners + layer])


def write(path, size=(2, 1, 1), finished=3, field_increments=None, stress_on=("Cell",), tool=0):
    """Write a body of unit cubes on the plane z = 0, pressed down and pushed along x.

    In increment i (from 1) every node of height z has the displacement i (0.01 z, 0, -0.01 z), and
    every contact point the local reaction i (10, 2.5, 0). Points slide where x > 0. The deck's id
    of point p is 100 + p. `field_increments` lists the rows that have fields (default: all). The
    stress of increment i is -10 i along z on elements ("Cell" in `stress_on`), twice that on nodes
    ("Point"). With `tool` there is a reference node 900, far above, which goes so far down a time.
    """
    points, elements = element_mesh(*size)
    rows = finished + UNFINISHED
    stored = list(range(finished) if field_increments is None else field_increments)
    with h5py.File(path, "w") as file:
        write_grid(file, points, elements, stored, stress_on)
        write_history(file, rows, finished)
        run = file.create_group("run")
        run.attrs.update({"program": "bipot", "version": "0.1.0", "status": np.bytes_("finished")})
        run["deck"] = np.bytes_("*HEADING\nA synthetic run")
        write_contact(file, points, rows, finished)
        if tool:
            write_reference_node(file, tool, rows)


def with_unfinished(rows, shape=(), kind=float):
    """Return an array whose last rows hold what no reader should see."""
    values = np.full((rows, *shape), 99, dtype=kind)
    values[: rows - UNFINISHED] = 0
    return values


def write_grid(file, points, elements, stored, stress_on):
    """Write the VTKHDF part with the fields of the rows in `stored` and one that is unfinished."""
    height = points[:, 2]
    shape = np.stack([0.01 * height, 0 * height, -0.01 * height], axis=1)
    grid = file.create_group("VTKHDF")
    grid.attrs["Version"] = np.array([2, 0], dtype="i8")
    grid.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    grid["NumberOfPoints"] = np.array([len(points)])
    grid["NumberOfCells"] = np.array([len(elements)])
    grid["NumberOfConnectivityIds"] = np.array([elements.size])
    grid["Points"] = points
    grid["Connectivity"] = elements.ravel()
    grid["Offsets"] = np.arange(0, elements.size + 1, 8)
    grid["Types"] = np.full(len(elements), 12, dtype="u1")

    displacement = [(row + 1) * shape for row in stored] + [0 * shape + 99] * UNFINISHED
    grid["PointData/displacement"] = np.concatenate(displacement)
    grid["PointData/node_id"] = (100 + np.arange(len(points))).astype("i8")
    grid["CellData/element_id"] = (1 + np.arange(len(elements))).astype("i8")

    steps = grid.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(len(stored))
    count = len(stored) + UNFINISHED
    steps["Values"] = np.array([0.5 * (row + 1) for row in stored])
    steps["PointDataOffsets/displacement"] = np.arange(count) * len(points)
    steps["PointDataOffsets/node_id"] = np.zeros(count, dtype="i8")
    steps["CellDataOffsets/element_id"] = np.zeros(count, dtype="i8")
    for kind, size, factor in (("Cell", len(elements), 1), ("Point", len(points), 2)):
        if kind not in stress_on:
            continue
        stress = np.zeros((size, 6))
        stress[:, 2] = -factor * PRESSURE
        grid[f"{kind}Data/stress"] = np.concatenate([(row + 1) * stress for row in [*stored, 98]])
        steps[f"{kind}DataOffsets/stress"] = np.arange(count) * size


def write_history(file, rows, finished):
    """Write the history: the first increment belongs to step 1, the others to step 2."""
    history = file.create_group("history")
    history.attrs["finished"] = np.int64(finished)
    number = np.arange(rows)
    history["step"] = np.where(number < 1, 1, 2).astype("i4")
    history["increment"] = np.where(number < 1, 1, number).astype("i4")
    history["time"] = 0.5 * (number + 1.0)
    history["certified"] = np.ones(rows, dtype="i1")
    history["contact_iterations"] = (10 + with_unfinished(rows)).astype("i4")
    history["local_iterations"] = (20 + with_unfinished(rows)).astype("i4")
    history["newton_raphson_iterations"] = (1 + with_unfinished(rows)).astype("i4")
    for name in ("penetration", "adhesion", "complementarity", "cone", "law", "equilibrium"):
        history[f"certificate/{name}"] = with_unfinished(rows)
    history["certificate/equilibrium"][:finished] = 1e-12
    for name in ("external_work", "strain", "dissipation", "balance"):
        history[f"energy/{name}"] = with_unfinished(rows)


def write_reference_node(file, tool, rows):
    """Write a reference node that goes down by `tool` in each increment, without any force."""
    group = file.create_group("reference_nodes")
    group["node_id"] = np.array([900])
    group["coordinates"] = np.array([[0.0, 0, 50]])
    displacement = with_unfinished(rows, (1, 3))
    for row in range(rows - UNFINISHED):
        displacement[row, 0, 2] = -(row + 1) * tool
    group["displacement"] = displacement
    group["reaction_force"] = with_unfinished(rows, (1, 3))


def write_contact(file, points, rows, finished):
    """Write the contact of the nodes at z = 0 with a plane whose tangents are x and y."""
    nodes = np.flatnonzero(points[:, 2] == 0)
    pair = file.create_group("contact/BODY-ZMIN:GROUND")
    pair.attrs["friction_coefficient"] = 0.3
    pair["node"] = nodes.astype("i8")
    pair["coordinates"] = points[nodes]
    pair["area"] = np.full(len(nodes), 1.0)
    pair["middle"] = points[nodes].mean(axis=0)
    normal_first = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    pair["frame"] = np.broadcast_to(normal_first, (1, len(nodes), 3, 3))
    reaction = with_unfinished(rows, (len(nodes), 3))
    for row in range(finished):
        reaction[row] = (row + 1) * np.array([PRESSURE, FRICTION * PRESSURE, 0])
    pair["reaction"] = reaction
    pair["gap"] = with_unfinished(rows, (len(nodes),))
    pair["slip"] = with_unfinished(rows, (len(nodes), 2))
    pair["slip_increment"] = with_unfinished(rows, (len(nodes), 2))
    status = with_unfinished(rows, (len(nodes),), "i1")
    status[:finished] = np.where(points[nodes, 0] > 0, 2, 1)
    pair["status"] = status
    pair["resultant"] = reaction.sum(axis=1)[:, [1, 2, 0]]
    normal_and_friction = reaction[..., None] * np.array([[1, 0], [0, 1], [0, 1]])
    pair["forces"] = normal_and_friction.sum(axis=1).swapaxes(1, 2)[..., [1, 2, 0]]
    pair["largest_pressure"] = reaction[:, :, 0].max(axis=1)
    pair["largest_slip"] = with_unfinished(rows, ())
    pair["moment"] = with_unfinished(rows, (3,))
