"""The runs by which a result got to its accuracy, and what they say of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bipot.result import Result

Array = NDArray[Any]

GROUP = "/accuracy"


class MeshSequence:
    """K runs on finer and finer meshes, of which the last one is the result.

    wanted, reached   the accuracy asked for (0: none), and whether the result has it
    time_allowed, memory_allowed   CPU time in seconds and bytes that runs might take, 0: any
    of_extrapolated   whether the accuracy is that of the extrapolated values
    mesh, load_steps, others   errors of these, or of the result, by source, -1 where not known
    mesh_and_load_steps  what these two make together, -1 where that of the mesh is not known
    small_strain      what small strain leaves out, -1 where it is no part of the accuracy
    element_size        (K,) edges of the elements over those of the deck
    divisions, elements, processor_time   (K,) parts of each increment, elements, seconds
    cuts              (K,) how often the elements at contact were cut beside all others
    names             what was compared: C names, such as "BODY:GROUND/friction_force_x"
    values            (K, T, C) what each run gives at the ends of the deck's T increments
    extrapolated      (T, C) for elements without size; not certified
    error, extrapolated_error   (C,) of each name: error of the result, and of these values, by the
                      mesh as a part of the scale, -1 where not known
    order, scale      (C,) the order that was observed, and what errors are parts of
    """

    def __init__(self, result: Result):
        group = result.file[GROUP]
        self.wanted = float(group.attrs["wanted"])
        self.of_extrapolated = bool(group.attrs["of_extrapolated"])
        self.reached = bool(group.attrs["reached"])
        self.time_allowed = float(group.attrs.get("time_allowed", 0))
        self.memory_allowed = float(group.attrs.get("memory_allowed", 0))
        self.mesh, self.load_steps, self.others = (
            float(group.attrs[name]) for name in ("mesh", "load_steps", "others")
        )
        both = self.mesh + max(0.0, self.load_steps) if self.mesh >= 0 else -1.0
        self.mesh_and_load_steps = float(group.attrs.get("mesh_and_load_steps", both))
        self.small_strain = float(group.attrs.get("small_strain", -1))
        self.element_size: Array = group["element_size"][()]
        self.divisions: Array = group["divisions"][()].astype(int)
        self.cuts: Array = group["cuts"][()].astype(int)
        self.elements: Array = group["elements"][()].astype(int)
        self.processor_time: Array = group["processor_time"][()]
        self.names = [
            name.decode() if isinstance(name, bytes) else str(name)
            for name in np.atleast_1d(group["values"].attrs.get("name", []))
        ]
        self.values: Array = group["values"][()]
        self.extrapolated: Array = group["extrapolated"][()]
        self.error: Array = group["error"][()]
        self.extrapolated_error: Array = group["extrapolated_error"][()]
        self.order: Array = group["order"][()]
        self.scale: Array = group["scale"][()]

    def __len__(self) -> int:
        return len(self.elements)

    def __repr__(self) -> str:
        told = [f"{self.wanted:g} {'' if self.reached else 'not '}reached"] if self.wanted else []
        bounds = [f"{self.time_allowed:g} s"] if self.time_allowed else []
        bounds += [f"{self.memory_allowed / 1e6:g} MB"] if self.memory_allowed else []
        told += [f"within {' and '.join(bounds)}"] if bounds else []
        told += [f"{len(self)} runs", f"{self.elements[-1]} elements"]
        return f"<MeshSequence {', '.join(told)}>"
