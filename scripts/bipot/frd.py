"""Results as CalculiX writes them, in an ASCII file NAME.frd: for cgx, FreeCAD and PrePoMax.

The records have fixed columns: numbers of nodes take ten, values twelve (E12.5). `Result.to_frd`
says what is written.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bipot.errors import ResultError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bipot.result import Result

Array = NDArray[Any]

# The cells of VTK: their number in the format, and their nodes in its order. A pyramid, of which
# there is none, is a hexahedron whose upper corners are one. The edges between bottom and top of
# a cell of second order stand before those of the top.
CELLS = {
    12: (1, range(8)), 13: (2, range(6)), 14: (1, [0, 1, 2, 3, 4, 4, 4, 4]), 10: (3, range(4)),
    27: (4, [0, 1, 2, 3, 4, 4, 4, 4, *range(5, 13), 4, 4, 4, 4]),
    25: (4, [*range(12), *range(16, 20), *range(12, 16)]),
    26: (5, [*range(9), *range(12, 15), *range(9, 12)]), 24: (6, range(10)),
    5: (7, range(3)), 22: (8, range(6)), 9: (9, range(4)), 23: (10, range(8)),
}  # fmt: skip
NODES_A_LINE = 10
# What a component is: of a vector (2, with its direction), or of a tensor (4, with two of them).
VECTOR = [(2, i, 0) for i in (1, 2, 3)]
TENSOR = [(4, *ij) for ij in ((1, 1), (2, 2), (3, 3), (1, 2), (2, 3), (3, 1))]
SCALARS = [(1, i, 0) for i in range(1, 7)]
CONTACT = ("COPEN", "CSLIP1", "CSLIP2", "CPRESS", "CSHEAR1", "CSHEAR2")
STRESS = ("SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX")
STRAIN = ("EXX", "EYY", "EZZ", "EXY", "EYZ", "EZX")
LEAST, MOST = 1e-99, 9.99999e99  # what two digits of an exponent hold


def write_frd(result: Result, path: Path) -> Path:
    """Write mesh and results of all stored increments; return the path."""
    if not len(result.field_rows):
        raise ResultError(f"{result.path}: no fields are stored: nothing to write")
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.writelines(f"{line}\n" for line in lines_of(result))
    return path


def lines_of(result: Result) -> Iterator[str]:
    """Give the lines of the file."""
    yield "    1C"
    yield "    1UPGM               bipot"
    ids = result.node_ids
    yield f"    2C{len(ids):30d}{1:38d}"
    yield from values_of(ids, result.points)
    yield " -3"
    yield from elements_of(result)
    number = 0
    steps = result.history("step").astype(int)
    time = result.history("time")
    for index, row in enumerate(result.field_rows):
        for name, components, kinds, values in fields_of(result, index):
            number += 1
            yield f"    1PSTEP{number:26d}{index + 1:12d}{steps[row]:12d}          "
            yield (f"  100CL{100 + index + 1:5d}{number_of(time[row])}{len(ids):12d}{'':20s}"
                   f"{0:2d}{index + 1:5d}{'':10s}{1:2d}")  # fmt: skip
            yield from block_of(ids, name, components, kinds, values)
    yield " 9999"


def elements_of(result: Result) -> Iterator[str]:
    """Give the block of the elements, in the order of the file; all are of one group."""
    rows, lines = [], {}
    for kind, (cells, nodes) in result.cells.items():
        number, order = CELLS[kind]
        for row, of_cell in zip(cells, result.node_ids[nodes[:, list(order)]], strict=True):
            rows.append(row)
            text = [f" -1{result.element_ids[row]:10d}{number:5d}{0:5d}{1:5d}"]
            for first in range(0, len(of_cell), NODES_A_LINE):
                part = of_cell[first : first + NODES_A_LINE]
                text.append(" -2" + "".join(f"{node:10d}" for node in part))
            lines[row] = text
    yield f"    3C{len(rows):30d}{1:38d}"
    for row in sorted(rows):
        yield from lines[row]
    yield " -3"


def fields_of(result: Result, index: int) -> Iterator[tuple[str, tuple[str, ...], list, Array]]:
    """Give the results at the nodes: name, components, what these are, and values (N, k)."""
    nodal, elemental = result.field_names
    for name, field, components in (
        ("DISP", "displacement", ("D1", "D2", "D3")),
        ("FORC", "reaction_force", ("F1", "F2", "F3")),
    ):
        if field in nodal:
            yield name, components, VECTOR, result.field(field, index, on="nodes")
    for name, field, components in (("STRESS", "stress", STRESS), ("TOSTRAIN", "strain", STRAIN)):
        if field in nodal:
            yield name, components, TENSOR, result.field(field, index, on="nodes")
        elif field in elemental:
            of_elements = result.field(field, index, on="elements")
            yield name, components, TENSOR, at_nodes(result, of_elements)
    if len(result.pairs):
        yield "CONTACT", CONTACT, SCALARS, contact_at_nodes(result, result.field_rows[index])


def at_nodes(result: Result, of_elements: Array) -> Array:
    """Return the means of what the elements at each node have, (N, 6)."""
    total = np.zeros((len(result.points), of_elements.shape[1]))
    count = np.zeros(len(total))
    for cells, nodes in result.cells.values():
        np.add.at(total, nodes, of_elements[cells][:, None])
        np.add.at(count, nodes, 1)
    return total / np.maximum(count, 1)[:, None]


def contact_at_nodes(result: Result, row: int) -> Array:
    """Return gap, slips, pressure and friction over the area of slave nodes, 0 at others: (N, 6).

    Of a node that several pairs have the one counts that presses it most.
    """
    found = np.zeros((len(result.points), 6))
    pressed = np.full(len(found), -np.inf)
    for pair in result.pairs.values():
        pressure = pair.pressure[row]
        reaction = pair.reaction[row]
        area = np.divide(reaction[:, 0], pressure, out=np.ones_like(pressure), where=pressure != 0)
        values = np.column_stack([
            np.where(pair.gap[row] < 1e29, pair.gap[row], 0.0), pair.slip[row], pressure,
            reaction[:, 1:] / area[:, None],
        ])  # fmt: skip
        for node, value in zip(pair.nodes, values, strict=True):
            if value[3] > pressed[node]:
                found[node], pressed[node] = value, value[3]
    return found


def block_of(
    ids: Array, name: str, components: tuple[str, ...], kinds: list, values: Array
) -> Iterator[str]:
    """Give the block of a result, a line a node; readers make a vector's length themselves."""
    is_vector = kinds is VECTOR
    yield f" -4  {name:8s}{len(components) + is_vector:5d}{1:5d}"
    for component, (kind, first, second) in zip(components, kinds, strict=True):
        yield f" -5  {component:8s}{1:5d}{kind:5d}{first:5d}{second:5d}"
    if is_vector:
        yield f" -5  {'ALL':8s}{1:5d}{2:5d}{0:5d}{0:5d}{1:5d}ALL"
    yield from values_of(ids, values)
    yield " -3"


def values_of(ids: Array, values: Array) -> Iterator[str]:
    """Give a line a node."""
    for node, of_node in zip(ids, values, strict=True):
        yield f" -1{node:10d}" + "".join(number_of(value) for value in of_node)


def number_of(value: float) -> str:
    """Return a number in twelve columns; what two digits of an exponent do not hold is nearest."""
    if abs(value) < LEAST:
        value = 0.0
    return f"{np.clip(value, -MOST, MOST):12.5E}"
