#!/usr/bin/env python3
"""Continue runs from damaged and hostile result files.

    fuzz_results.py [--bipot P] [--count N] [--seed S] [--first I] [--keep FOLDER]

A run is stopped by a signal; copies of its file are changed byte by byte or through h5py, and the
run is continued from each. Held against the program: what outcome.py says of any input; status 0
only with all increments of the deck in the file, certified, with finite numbers. A file that is
refused stays as it was.
"""

import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
from campaign import ROOT, campaign_options, numbered_input, try_files
from fuzz_fclib import (
    change_bytes,
    change_links,
    change_shape,
    change_type,
    datasets,
    remove,
)
from outcome import ENVIRONMENT, Outcome

DECK = ROOT / "input" / "block.inp"
SETTINGS = ("--set", "n=8", "--set", "steps=50")
STEPS = 50
TIME = 60  # seconds of the processor
ADDRESSES = 1_500_000_000  # bytes that the process may reserve


def stopped_run(program, folder):
    """The bytes of the file of a run that was stopped near its end."""
    path = folder / "block.vtkhdf"
    with subprocess.Popen([program, str(DECK), *SETTINGS], cwd=folder, text=True, env=ENVIRONMENT,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        lines = 0
        for line in process.stdout:
            lines += line.lstrip()[:1].isdigit()
            if lines == STEPS - 20:
                process.send_signal(signal.SIGTERM)
        process.wait()
    if process.returncode != 128 + signal.SIGTERM:
        raise RuntimeError(f"the run was not stopped: exit status {process.returncode}")
    return path.read_bytes()


def change_number(rng, path):
    """A number of a dataset or an attribute at a limit."""
    with h5py.File(path, "a") as file:
        if rng.random() < 0.5:
            places = [(file[g], name) for g in ("run", "history", "VTKHDF", "state", "VTKHDF/Steps")
                      if g in file for name in file[g].attrs]
            item, name = rng.choice(places)
            value = item.attrs[name]
            if np.asarray(value).dtype.kind in "iu":
                item.attrs.modify(name, np.asarray(value) * 0 + rng.choice(
                    (0, -1, 1, 7, 2**31 - 1, -(2**31), 2**62)))
            elif rng.random() < 0.5:
                del item.attrs[name]
            else:
                item.attrs[name] = rng.choice(("", "running", "x" * 5000, 5))
            return False
        name = rng.choice(datasets(file))
        values = file[name][()]
        if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu" or not values.size:
            return False
        flat = values.reshape(-1)
        with np.errstate(all="ignore"):
            flat[rng.randrange(flat.size)] = np.asarray(rng.choice(
                (np.nan, np.inf, 1e300, -1e300, 0.0, -1.0, 2.0**31 - 1, 1e-320))).astype(flat.dtype)
        file[name][...] = values
    return False


CONTENTS = (remove, change_number, change_number, change_number, change_type, change_shape,
            change_links)


def complaints_of(folder):
    """What is wrong with the file of a run that ended well."""
    found = []
    with h5py.File(folder / "block.vtkhdf") as file:
        rows = int(file["history"].attrs["finished"])
        if rows != STEPS:
            found.append(f"status 0 with {rows} of {STEPS} increments")
        if not file["history/certified"][rows - 10: rows].all():
            found.append("status 0 without a certificate")
        for name in ("VTKHDF/PointData/displacement", "history/residual"):
            values = file[name][-10:]
            if not np.isfinite(values).all():
                found.append(f"status 0 and /{name} is not finite")
    return found


def judge(options, number, whole):
    """Continue from file `number`: (what was done, complaints, data, outcome)."""
    with numbered_input(options, number) as (rng, folder):
        path = folder / "work" / "block.vtkhdf"
        path.write_bytes(whole)
        if rng.random() < 0.5:
            done = change_bytes(rng, path)
        else:
            mutation = rng.choice(CONTENTS)
            done = mutation.__name__
            try:
                mutation(rng, path)
            except (TypeError, ValueError, KeyError, IndexError, OSError, AttributeError):
                path.write_bytes(whole)  # h5py itself does not write that
        data = path.read_bytes()
        outcome = Outcome([options.bipot, str(DECK), *SETTINGS, "--continue", "--quiet"],
                          folder, TIME, ADDRESSES)
        complaints = [c for c in outcome.complaints() if "without a place" not in c]
        if outcome.status == 1 and not outcome.errors.strip():
            complaints.append("status 1 without a message")
        if outcome.status == 1 and path.read_bytes() != data:
            complaints.append("a refused file was changed")
        if outcome.status == 0:
            complaints += complaints_of(path.parent)
    return done, complaints, data, outcome


def main():
    """Read the command line and go."""
    options = campaign_options(__doc__, "file", 200).parse_args()
    with tempfile.TemporaryDirectory(prefix="bipot-fuzz-") as folder:
        whole = stopped_run(options.bipot, Path(folder))
    found = try_files(
        options, "result files", "vtkhdf", lambda number: judge(options, number, whole)
    )
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
