"""What the cases of the programs with MPI share: decks with a card more, forces, starting ranks."""

import os
import sys
from pathlib import Path

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(SOURCE / "tests" / "cases"))

import h5py  # noqa: E402
from program import INPUT, PROGRAM, Run  # noqa: E402

__all__ = ["INPUT", "MPIEXEC", "PROGRAM", "SOURCE", "Run", "forces", "launch", "with_card"]

MPIEXEC = os.environ.get("MPIEXEC", "mpiexec")
if os.geteuid() == 0:  # Open MPI starts nothing as root unless it is told twice.
    os.environ["OMPI_ALLOW_RUN_AS_ROOT"] = os.environ["OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"] = "1"


def launch(ranks, program=PROGRAM):
    """The command that starts the program on several ranks."""
    return (MPIEXEC, "-n", str(ranks), "--oversubscribe", "--bind-to", "none", program)


def with_card(text, card):
    """The text of a deck with a card before its first step."""
    return text.replace("*STEP", f"{card}\n*STEP", 1)


def forces(run):
    """Every force of a result: name to array."""
    found = {}

    def keep(name, item):
        if name.rsplit("/", 1)[-1] in ("reaction", "resultant", "reaction_force", "contact_force"):
            found[name] = item[()]

    with h5py.File(run.file) as file:
        file.visititems(keep)
    return found
