"""Run bipot, read its results, and build decks in Python; docs/python.md is the page.

    import bipot

    result = bipot.run("input/block.inp", n=8, mu=0.2)
    print(result.pairs["BODY-ZMIN:GROUND"].resultant[-1])

run, plan, check, flat   what the command line does, as functions
read                     open a result file
Deck                     build a deck, and write it as text
study                    many runs of one deck, some at a time, resumed where they were
Result                   what read and run return: histories, pairs, fields as numpy arrays

What the commands in scripts/ share stands in modules beside: program, report, figures, pictures,
tradeoff (scripts/tradeoff) and peers (scripts/compare).
"""

import importlib
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bipot.deck import Deck
    from bipot.errors import (
        BipotError,
        DeckError,
        MachineError,
        MeshError,
        Message,
        NotSolvedError,
        ProgramMissingError,
        RefusedError,
        ResultError,
        RunError,
        RunTimeoutError,
        StoppedError,
    )
    from bipot.parameter_study import Study, study
    from bipot.result import Pair, Result
    from bipot.running import Plan, check, flat, plan, read, run

__all__ = (
    "BipotError", "Deck", "DeckError", "MachineError", "MeshError", "Message", "NotSolvedError",
    "Pair", "Plan", "ProgramMissingError", "RefusedError", "Result", "ResultError", "RunError",
    "RunTimeoutError", "StoppedError", "Study", "check", "flat", "plan", "read", "run", "study",
)

_MODULES = {
    "deck": ("Deck",),
    "errors": (
        "BipotError", "DeckError", "MachineError", "MeshError", "Message", "NotSolvedError",
        "ProgramMissingError", "RefusedError", "ResultError", "RunError", "RunTimeoutError",
        "StoppedError",
    ),
    "parameter_study": ("Study", "study"),
    "result": ("Pair", "Result"),
    "running": ("Plan", "check", "flat", "plan", "read", "run"),
}


def __getattr__(name: str) -> Any:
    """Import what is asked for: the command `bipot` begins without numpy and HDF5."""
    for module, names in _MODULES.items():
        if name in names:
            try:
                return getattr(importlib.import_module(f"bipot.{module}"), name)
            except ModuleNotFoundError as error:
                if error.name not in ("h5py", "numpy"):
                    raise
                raise ImportError(
                    f"bipot.{name} needs {error.name}: pip install numpy h5py, or on Debian:"
                    f" apt-get install python3-numpy python3-h5py (this is {sys.executable})"
                ) from None
    raise AttributeError(f"module 'bipot' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return what there is to import."""
    return sorted([*globals(), *__all__])
