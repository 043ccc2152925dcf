"""What the cases of the programs with MPI share: decks with a card more, forces, starting ranks."""

import os
import sys
import time
from pathlib import Path

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(SOURCE / "tests" / "cases"))

import h5py  # noqa: E402
from boxes import pushed  # noqa: E402
from program import INPUT, PROGRAM, Run  # noqa: E402

__all__ = ["INPUT", "MPIEXEC", "PATIENCE", "PROGRAM", "SERIAL", "SOURCE", "Run", "check_end"]
__all__ += ["forces"]
__all__ += ["launch", "pushed", "ranks_of", "with_card"]

PATIENCE = 600  # a run that does not end is a failure [s]
# The program for one process.
SERIAL = os.environ.get("BIPOT_SERIAL", str(SOURCE / "build" / "bipot"))

MPIEXEC = os.environ.get("MPIEXEC", "mpiexec")
if os.geteuid() == 0:  # Open MPI starts nothing as root unless it is told twice.
    os.environ["OMPI_ALLOW_RUN_AS_ROOT"] = os.environ["OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"] = "1"


def launch(ranks, program=PROGRAM):
    """The command that starts the program on several ranks."""
    # A rank that waits lets who has work to do have the processor: tests run at once.
    options = "--oversubscribe --bind-to none --mca mpi_yield_when_idle 1".split()
    return (MPIEXEC, "-n", str(ranks), *options, program)


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


def ranks_of(running, result):
    """The processes of two ranks that mpirun has started, once one has begun with an increment."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and running.poll() is None:
        if result.exists():
            children = Path(f"/proc/{running.pid}/task/{running.pid}/children").read_text()
            ranks = {}
            for child in map(int, children.split()):
                environment = Path(f"/proc/{child}/environ").read_bytes().split(b"\0")
                rank = [e for e in environment if e.startswith(b"OMPI_COMM_WORLD_RANK=")]
                if rank:
                    ranks[int(rank[0].split(b"=")[1])] = child
            if len(ranks) == 2:
                return [ranks[0], ranks[1]]
        time.sleep(0.05)
    raise AssertionError("the run did not begin")


def check_end(running, ranks):
    """All of a run ends, says so, and leaves no process behind; what it printed."""
    output, _ = running.communicate(timeout=PATIENCE)
    assert running.returncode != 0, output
    until = time.monotonic() + PATIENCE
    while any(Path(f"/proc/{rank}").exists() for rank in ranks):
        assert time.monotonic() < until, "a rank is left"
        time.sleep(0.05)
    return output
