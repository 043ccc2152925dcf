#!/usr/bin/env python3
"""Continue runs from damaged and hostile result files.

    fuzz_results.py [--program P] [--count N] [--seed S] [--first I] [--keep FOLDER]

A run is stopped by a signal; copies of its file are changed byte by byte or through h5py, and the
run is continued from each. Held against the program: what outcome.py says of any input; status 0
only with all increments of the deck in the file, certified, with finite numbers. A file that is
refused stays as it was.
"""

import argparse
import collections
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
from fuzz_fclib import BYTES, change_links, change_shape, change_type, remove
from outcome import ENVIRONMENT, Outcome

ROOT = Path(__file__).resolve().parents[2]
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
        name = rng.choice(walk(file))
        values = file[name][()]
        if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu" or not values.size:
            return False
        flat = values.reshape(-1)
        with np.errstate(all="ignore"):
            flat[rng.randrange(flat.size)] = np.asarray(rng.choice(
                (np.nan, np.inf, 1e300, -1e300, 0.0, -1.0, 2.0**31 - 1, 1e-320))).astype(flat.dtype)
        file[name][...] = values
    return False


def walk(file):
    """The names of all datasets."""
    names = []
    file.visititems(lambda name, item: names.append(name) if hasattr(item, "shape") else None)
    return names


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


def judge(arguments, number, whole):
    """Continue from file `number`: (what was done, complaints, data, outcome)."""
    rng = random.Random(f"{arguments.seed}:{number}")
    with tempfile.TemporaryDirectory(prefix="bipot-fuzz-") as scratch:
        folder = Path(scratch)
        work = folder / "work"
        work.mkdir()
        path = work / "block.vtkhdf"
        path.write_bytes(whole)
        if rng.random() < 0.5:
            mutation = rng.choice(BYTES)
            data = bytearray(whole)
            mutation(rng, data)
            path.write_bytes(bytes(data))
        else:
            mutation = rng.choice(CONTENTS)
            try:
                mutation(rng, path)
            except (TypeError, ValueError, KeyError, IndexError, OSError, AttributeError):
                path.write_bytes(whole)  # h5py itself does not write that
        data = path.read_bytes()
        outcome = Outcome([arguments.program, str(DECK), *SETTINGS, "--continue", "--quiet"],
                          folder, TIME, ADDRESSES)
        complaints = [c for c in outcome.complaints() if "without a place" not in c]
        if outcome.status == 1 and not outcome.errors.strip():
            complaints.append("status 1 without a message")
        if outcome.status == 1 and path.read_bytes() != data:
            complaints.append("a refused file was changed")
        if outcome.status == 0:
            complaints += complaints_of(work)
    return mutation.__name__, complaints, data, outcome


def main():
    """Read the command line and go."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", default=os.environ.get("BIPOT", str(ROOT / "build" / "bipot")))
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--keep", help="folder for what is found")
    arguments = parser.parse_args()
    arguments.program = str(Path(arguments.program).resolve())
    with tempfile.TemporaryDirectory(prefix="bipot-fuzz-") as folder:
        whole = stopped_run(arguments.program, Path(folder))
    counts, findings, started = collections.Counter(), 0, time.monotonic()
    for number in range(arguments.first, arguments.first + arguments.count):
        done, complaints, data, outcome = judge(arguments, number, whole)
        counts[done, outcome.status] += 1
        if not complaints:
            continue
        findings += 1
        print(f"\nfile {number}: {done}: {'; '.join(complaints)}", flush=True)
        print("  " + "\n  ".join((outcome.errors or outcome.output)[-600:].splitlines()[:8]))
        if arguments.keep:
            Path(arguments.keep).mkdir(parents=True, exist_ok=True)
            (Path(arguments.keep) / f"{number}.vtkhdf").write_bytes(data)
    print(f"\n{arguments.count} result files of seed {arguments.seed} in "
          f"{time.monotonic() - started:.0f} s: {findings} findings")
    for key, n in sorted(counts.items()):
        print(f"  {key[0]:13s} exit status {key[1]:3d}: {n}")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
