"""Where the program is, the one place that knows; how it is given parameters and threads.

BIPOT in the environment names it. Otherwise it is `bin/bipot` in this package, where a wheel has
put it, or `build/bipot` of the clone that this package lies in.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bipot.errors import ProgramMissingError

PACKAGE = Path(__file__).resolve().parent
INSTALLED = PACKAGE / "bin" / "bipot"
ROOT = PACKAGE.parents[1]
"""Of the clone; of no use where the package is installed."""


def program_path() -> Path:
    """Return where the program should be, be it there or not."""
    named = os.environ.get("BIPOT")
    if named:
        return Path(named)
    return INSTALLED if INSTALLED.is_file() else ROOT / "build" / "bipot"


def built_program(path: str | os.PathLike[str] | None = None) -> Path:
    """Return the full path of the program, or of the one at `path`.

    Raises ProgramMissingError where there is none.
    """
    path = program_path() if path is None else Path(path)
    if not path.is_file():
        raise ProgramMissingError(
            f"no program at {path}; scripts/run builds it, BIPOT in the environment names another"
        )
    return path.resolve()


def set_words(settings: Mapping[str, Any]) -> list[str]:
    """Return the words of a command line that give a deck's parameters these values.

    Names that begin with "--" are the program's options, such as "--refine": how often every
    element is cut into eight.
    """
    words = []
    for name, value in settings.items():
        if not name.startswith("--"):
            words += ["--set", f"{name}={value}"]
        elif (name, str(value)) != ("--refine", "0"):
            words += [name, str(value)]
    return words


def with_threads(threads: int = 1) -> dict[str, str]:
    """Return the environment in which a program has so many threads."""
    return {**os.environ, "OPENBLAS_NUM_THREADS": str(threads), "OMP_NUM_THREADS": str(threads)}


def main() -> None:
    """Become the program: the command `bipot` of an installed package."""
    try:
        program = built_program()
    except ProgramMissingError as error:
        sys.exit(f"bipot: {error}")
    os.execv(program, ["bipot", *sys.argv[1:]])
