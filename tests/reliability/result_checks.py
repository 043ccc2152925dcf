"""Runs that are killed and continued, and whether what they leave is what it should be.

Environment: BIPOT, the executable; BIPOT_KILL_LIBRARY, the library made of kill_at_write.c. By
hand: those of build/debug.
"""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import h5py
import numpy as np

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("BIPOT", str(SOURCE / "build" / "debug" / "bipot"))
LIBRARY = os.environ.get(
    "BIPOT_KILL_LIBRARY", str(SOURCE / "build" / "debug" / "tests" / "libkill_at_write.so")
)
CLOCK = str(Path(LIBRARY).with_name("libslow_clock.so"))
HERE = Path(__file__).resolve().parent
INPUT = SOURCE / "input"
NAME = "run.vtkhdf"
GROUPS = ("VTKHDF", "history", "contact", "reference_nodes", "print")
# No two runs agree in times, and a session that goes on makes the factor of its tangent anew.
CLOCKS = ("history/wall_time", "history/contact_time", "history/tangents")

try:
    import vtkmodules.vtkIOHDF  # noqa: F401  (only whether it is there)

    MISSING_VTK = None
except ImportError as problem:
    MISSING_VTK = f"VTK with its HDF reader is not installed: {problem}"


class Folder(unittest.TestCase):
    """Every test in a folder of its own, `path` the result of a run there."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="bipot-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.path = self.folder / NAME

    @classmethod
    def tearDownClass(cls):
        close_reader()

    def elsewhere(self):
        """Make another folder, not in it."""
        other = Path(tempfile.mkdtemp(prefix="bipot-"))
        self.addCleanup(shutil.rmtree, other)
        return other

    def fresh(self, name):
        """Make a folder in it, empty."""
        return fresh_folder(self.folder / name)


def fresh_folder(folder):
    """Make the folder anew, empty."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def wait_for(condition, seconds=600.0):
    """Wait until something is so."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError("waited in vain")
        time.sleep(0.005)


class Case:
    """A deck with its parameters, to be run in folders of its own.

    A run that is killed has a clock that goes on by `look` milliseconds whenever it is looked at:
    its file changes as often whatever the load, and with a second each increment is counted by
    itself.
    """

    def __init__(self, deck, *options, look=1000, **overrides):
        """Take a path of a deck, options as they are, and --set for `overrides`."""
        self.deck = Path(deck)
        self.watched = {"LD_PRELOAD": f"{LIBRARY}:{CLOCK}", "LOOK": str(look)}
        self.options = list(options)
        for key, value in overrides.items():
            self.options += ["--set", f"{key}={value}"]

    def __str__(self):
        """Name the deck and what was set."""
        return " ".join([self.deck.stem, *(o for o in self.options if o != "--set")])

    def start(self, folder, *more, prepare=None, **environment):
        """Begin a run of the program that writes NAME in `folder`; first it calls `prepare`."""
        return subprocess.Popen(
            [PROGRAM, str(self.deck), "-o", NAME, "--quiet", *self.options, *more],
            cwd=folder,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=prepare,
        )

    def run(self, folder, *more, prepare=None, **environment):
        """Run the program to its end; return the status (negative: a signal) and its messages."""
        process = self.start(folder, *more, prepare=prepare, **environment)
        output, errors = process.communicate(timeout=600)
        return process.returncode, output + errors

    def count_changes(self, folder, *more, prepare=None):
        """Run to the end; return how often the result file was changed."""
        count = Path(folder) / "changes"
        status, words = self.run(
            folder, *more, prepare=prepare, KILL_COUNT=str(count), **self.watched
        )
        if status != 0:
            raise AssertionError(f"{self}: status {status}\n{words}")
        return int(count.read_text())

    def kill_at(self, folder, change, *more, torn=False, prepare=None):
        """Kill the run instead of the given change of the file; return whether it came so far."""
        environment = {"KILL_TORN": "1"} if torn else {}
        status, words = self.run(
            folder, *more, prepare=prepare, KILL_AT_WRITE=str(change), **self.watched, **environment
        )
        if status not in (0, -signal.SIGKILL):
            raise AssertionError(f"{self}: status {status}\n{words}")
        return status != 0


class Whole:
    """The result of a run that was never stopped."""

    def __init__(self, path):
        """Read all of it."""
        with h5py.File(path) as file:
            self.rows = rows_of(file)
            self.steps = steps_of(file)
            self.data, self.attributes = {}, {}
            for group in set(GROUPS) & set(file):
                file[group].visititems(self._keep)
            time = self.data["VTKHDF/Steps/Values"]
            self.outputs = np.searchsorted(time, self.data["history/time"], side="right")
        self.pictures = None if MISSING_VTK else pictures_of(path)

    def _keep(self, _, thing):
        name = thing.name[1:]
        self.attributes[name] = dict(thing.attrs)
        if isinstance(thing, h5py.Dataset):
            self.data[name] = thing[()]

    def differences(self, path):
        """Say in what another result, run to its end, is not the same to the last bit."""
        found = []
        other = Whole(path)
        for name in sorted(set(self.attributes) | set(other.attributes)):
            one, two = (w.attributes.get(name) for w in (self, other))
            if one is None or two is None:
                found.append(f"{name} is in one of them")
            elif {k: same(v) for k, v in one.items()} != {k: same(v) for k, v in two.items()}:
                found.append(f"attributes of {name}")
            elif name not in self.data or name in CLOCKS:
                continue
            elif same(self.data[name]) != same(other.data[name]):
                found.append(name)
        if other.pictures != self.pictures:
            found.append("what VTK reads")
        return found

    def losses(self, path, fewest_rows):
        """Say in what a result is not the beginning of this one, or lacks what was finished."""
        found = []
        with h5py.File(path) as file:
            rows, steps = rows_of(file), steps_of(file)
            if rows < fewest_rows:
                found.append(f"{rows} increments, {fewest_rows} were finished before")
            if steps < self._due(rows):
                found.append(f"{steps} increments with fields, {rows} are finished")
            for name, whole in self.data.items():
                n = self._length(name, rows, steps)
                if name in CLOCKS:
                    continue
                if n is None:
                    n = len(whole)
                if same(file[name][:n]) != same(whole[:n]):
                    found.append(f"{name}[:{n}]")
        if self.pictures is not None:
            pictures = pictures_of(path)
            if pictures is None:
                found.append("VTK crashes")
            # Before the first fields VTK shows the mesh. Later one that is counted and not finished
            # may be there or not.
            elif steps == 0:
                pass
            elif pictures != self.pictures[: len(pictures)] or len(pictures) < self._due(rows):
                found.append("VTK reads other increments")
        return found

    def _due(self, rows):
        """Increments with fields among the first `rows`."""
        return self.outputs[rows - 1] if rows > 0 else 0

    def _length(self, name, rows, steps):
        """How much of a dataset counts; None for all of it."""
        if name.startswith("history/"):
            return rows
        parts = name.split("/")
        if name.startswith("print/"):
            return None if parts[-1] in ("node_id", "element_id") else rows
        if name.startswith("reference_nodes/"):
            return None if parts[-1] in ("node_id", "coordinates") else rows
        if name.startswith("contact/"):
            if parts[-1] in ("node", "coordinates", "area"):
                return None
            return min(rows, 1) if len(self.data[name]) < self.rows else rows
        if name == "VTKHDF/Steps/Values":  # it grows when the increment is counted already
            return self._due(rows)
        if parts[1] == "Steps":
            return steps
        if parts[1] in ("PointData", "CellData") and parts[2] not in ("node_id", "element_id"):
            return len(self.data[name]) // self.steps * steps
        return None


def rows_of(file):
    """Finished increments."""
    return int(file["history"].attrs["finished"])


def steps_of(file):
    """Increments with fields."""
    return int(file["VTKHDF/Steps"].attrs["NSteps"])


def same(value):
    """What two values share that agree in extents, type and every bit."""
    array = np.asarray(value)
    return array.shape, array.dtype.str, array.tobytes()


def is_finished(path):
    """Whether the run of this file came to its end."""
    with h5py.File(path) as file:
        return file["run"].attrs["status"] == b"finished"


def rows_in(path):
    """Finished increments of a file, 0 where there is none."""
    if not Path(path).exists():
        return 0
    with h5py.File(path) as file:
        return rows_of(file)


# VTK reads in a process of its own: a file that is wrong makes it crash, not fail.


class _Reader:
    process = None


def pictures_of(path):
    """Return what VTK reads of each increment, as a list of digests; None where it crashes."""
    if _Reader.process is None or _Reader.process.poll() is not None:
        _Reader.process = subprocess.Popen(
            [sys.executable, "-B", __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
    try:
        _Reader.process.stdin.write(f"{Path(path).resolve()}\n")
        _Reader.process.stdin.flush()
        answer = _Reader.process.stdout.readline()
    except BrokenPipeError:
        answer = ""
    if not answer:
        _Reader.process.wait()
        return None
    return json.loads(answer)


def close_reader():
    """End the process that reads."""
    if _Reader.process is not None:
        _Reader.process.stdin.close()
        _Reader.process.wait()
        _Reader.process.stdout.close()
        _Reader.process = None


def _read_with_vtk():
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    for line in sys.stdin:
        reader = vtkHDFReader()
        reader.SetFileName(line.strip())
        reader.UpdateInformation()
        digests = []
        for step in range(reader.GetNumberOfSteps()):
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutput()
            digest = hashlib.sha256(vtk_to_numpy(grid.GetPoints().GetData()).tobytes())
            for data in (grid.GetPointData(), grid.GetCellData()):
                for i in range(data.GetNumberOfArrays()):
                    digest.update(data.GetArrayName(i).encode())
                    digest.update(vtk_to_numpy(data.GetArray(i)).tobytes())
            digests.append(digest.hexdigest())
        print(json.dumps(digests), flush=True)


if __name__ == "__main__":
    _read_with_vtk()
