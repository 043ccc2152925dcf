#!/usr/bin/env python3
"""Damage the result files of unfinished runs and continue from them; nothing wrong may come of it.

    damage_sweep.py [--count N] [--first I] [--seed S] [--keep FOLDER]

The files are those of runs that were killed. Of each copy something is changed: bits, bytes, pages;
anywhere in the file, in its numbers, or in what HDF5 keeps beside them; or a number through h5py;
or the file is cut off. Then the run is continued, and one of four things happens:

    refused     exit status 1 and a message that names the file, which is left as it was
    same        continued to the same bits as the undisturbed run, in what was run as well
    otherwise   continued to something else, or ended otherwise: a finding
    crashed     a signal, no end, a backtrace: a finding

Exit status 0: no findings. Environment: see result_checks.py.
"""

import argparse
import collections
import random
import re
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
from result_checks import INPUT, NAME, Case, Whole, close_reader, fresh_folder, rows_in

CASES = (
    Case(INPUT / "block.inp", n=3, steps=12, solver="AUTO", local="AUTO"),
    Case(INPUT / "tool.inp", n=4, steps=4),
)
PATIENCE = 60  # seconds of the processor
# What h5py and numpy raise over a damaged file.
UNREADABLE = (OSError, LookupError, ValueError, RuntimeError, TypeError, AttributeError)
MUTABLE = {"status", "continued"}  # of /run, while the run goes on
BROKEN = re.compile(r"Backtrace|Fortran runtime|Program received|Sanitizer|runtime error:|"
                    r"internal error|At line \d+ of file", re.I)


class Base:
    """An unfinished result: its bytes, and where its numbers are."""

    def __init__(self, case, path, whole):
        """Read what a run left at `path`; `whole` is the result of the undisturbed run."""
        self.case, self.whole = case, whole
        self.data = path.read_bytes()
        self.rows = rows_in(path)
        self.origin = origin_of(path)
        self.numbers = np.zeros(len(self.data), bool)
        with h5py.File(path) as file:
            file.visititems(self._mark)
        live = np.frombuffer(self.data, np.uint8) != 0
        self.beside = np.flatnonzero(live & ~self.numbers)
        self.numbers = np.flatnonzero(self.numbers)

    def _mark(self, _, thing):
        if not isinstance(thing, h5py.Dataset):
            return
        if thing.chunks is None:
            if thing.id.get_offset() is not None:
                start = thing.id.get_offset()
                self.numbers[start: start + thing.id.get_storage_size()] = True
            return
        for i in range(thing.id.get_num_chunks()):
            chunk = thing.id.get_chunk_info(i)
            self.numbers[chunk.byte_offset: chunk.byte_offset + chunk.size] = True


def origin_of(path):
    """What the file says of where it comes from, which a continued run does not change."""
    found = {}
    with h5py.File(path) as file:
        run = file["run"]
        found["/run"] = sorted((k, np.asarray(v).tobytes()) for k, v in run.attrs.items()
                               if k not in MUTABLE)
        for name, thing in run.items():
            attributes = sorted((k, np.asarray(v).tobytes()) for k, v in thing.attrs.items())
            value = b"" if name == "counters" else np.asarray(thing[()]).tobytes()
            found[name] = attributes, value
    return found


def bases(case, folder, chance):
    """Make the unfinished results of a case."""
    whole_folder = fresh_folder(folder / "whole")
    n = case.count_changes(whole_folder)
    whole = Whole(whole_folder / NAME)
    found = []
    for share in (0.45, 0.65, 0.85):
        killed = fresh_folder(folder / "killed")
        if not case.kill_at(killed, int((share + 0.1 * chance.random()) * n)):
            raise RuntimeError(f"{case} was not killed")
        found.append(Base(case, killed / NAME, whole))
    return found


# ---------------------------------------------------------------------- damage


def anywhere(chance, base):
    """Choose a byte: of the numbers, of what is beside them, or any."""
    kind = chance.random()
    if kind < 0.4:
        return int(base.numbers[chance.randrange(len(base.numbers))])
    if kind < 0.8:
        return int(base.beside[chance.randrange(len(base.beside))])
    return chance.randrange(len(base.data))


def flip_a_bit(chance, base, data):
    """One bit."""
    data[anywhere(chance, base)] ^= 1 << chance.randrange(8)


def change_bytes(chance, base, data):
    """A few bytes, here and there."""
    for _ in range(chance.randint(1, 8)):
        data[anywhere(chance, base)] = chance.randrange(256)


def zero(chance, base, data):
    """A range of zeros: what a disk lost."""
    start = anywhere(chance, base)
    n = chance.choice((1, 4, 8, 64, 512, 4096))
    data[start: start + n] = bytes(len(data[start: start + n]))


def fill(chance, base, data):
    """A range of something else."""
    start = anywhere(chance, base)
    n = chance.choice((2, 8, 64, 512))
    data[start: start + n] = chance.randbytes(len(data[start: start + n]))


def lose_pages(chance, base, data):
    """Pages of zeros, as after a power failure."""
    for _ in range(chance.randint(1, 4)):
        start = anywhere(chance, base) // 4096 * 4096
        data[start: start + 4096] = bytes(len(data[start: start + 4096]))


def move(chance, base, data):
    """A range that is another's."""
    n = chance.choice((8, 64, 512, 4096))
    here, there = (min(anywhere(chance, base), len(data) - n) for _ in range(2))
    data[here: here + n] = data[there: there + n]


def cut_off(chance, base, data):
    """The end is missing."""
    del data[chance.choice((anywhere(chance, base), len(data) - chance.randint(1, 5000))):]


def change_number(chance, _, path):
    """A number of a dataset, through h5py."""
    with h5py.File(path, "r+") as file:
        names = []
        file.visititems(lambda name, thing: names.append(name)
                        if isinstance(thing, h5py.Dataset) and thing.dtype.kind in "fiu"
                        and thing.size else None)
        thing = file[chance.choice(names)]
        place = tuple(chance.randrange(n) for n in thing.shape)
        try:
            value = thing[place]
        except OSError:  # of the row that was being written, which no reader looks at
            return
        thing[place] = value + 1 if chance.random() < 0.5 else -value
        file.flush()


def change_attribute(chance, _, path):
    """A number among the attributes, through h5py."""
    with h5py.File(path, "r+") as file:
        places = []

        def add(name, thing):
            places.extend((name, key) for key, value in thing.attrs.items()
                          if np.asarray(value).dtype.kind in "iuf")

        file.visititems(add)
        name, key = chance.choice(places)
        value = file[name].attrs[key]
        file[name].attrs.modify(key, value + np.asarray(value).dtype.type(
            chance.choice((-2, -1, 1, 2, 64))))


BYTES = (flip_a_bit, flip_a_bit, change_bytes, zero, zero, fill, lose_pages, move, cut_off)
NUMBERS = (change_number, change_number, change_attribute)


def damage(chance, base, path):
    """Write a damaged copy of the base; return what was done."""
    kind = chance.choice(BYTES + NUMBERS)
    if kind in NUMBERS:
        path.write_bytes(base.data)
        kind(chance, base, path)
    else:
        data = bytearray(base.data)
        kind(chance, base, data)
        path.write_bytes(data)
    return kind.__name__


# ---------------------------------------------------------------------- what comes of it


def limit_process():
    """Let what never ends be ended, whatever else the machine does; no cores."""
    resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def outcome(base, folder):
    """Continue from the damaged file: (what happened, why)."""
    path = folder / NAME
    before = path.read_bytes()
    process = base.case.start(folder, "--continue", prepare=limit_process)
    out, errors = process.communicate()
    status = process.returncode
    words = (out + errors).strip()
    if status < 0 or BROKEN.search(words):
        return "crashed", f"status {status}: {words[-300:]}"
    if status == 1:
        if NAME not in errors:
            return "otherwise", f"status 1, no file is named: {errors[-300:]}"
        if path.read_bytes() != before:
            return "otherwise", f"refused, and the file was changed: {errors[-300:]}"
        return "refused", errors.strip()
    if status != 0:
        return "otherwise", f"status {status}: {words[-300:]}"
    if errors:
        return "otherwise", f"status 0: {errors[-300:]}"
    try:
        found = base.whole.differences(path)
        if origin_of(path) != base.origin:
            found.append("where it comes from")
    except UNREADABLE as problem:
        found = [f"unreadable: {problem}"]
    if found:
        return "otherwise", f"status 0, and differs in {', '.join(found[:6])}"
    return "same", ""


def sweep(options, cases=CASES, tell=print):
    """Damage files by their numbers; return how often each thing happened, and the findings."""
    folder = Path(tempfile.mkdtemp(prefix="bipot-"))
    counts, findings, messages = collections.Counter(), [], collections.Counter()
    try:
        chance = random.Random(options.seed)
        files = [base for case in cases for base in bases(case, folder, chance)]
        for number in range(options.first, options.first + options.count):
            chance = random.Random(f"{options.seed}:{number}")
            base = chance.choice(files)
            work = fresh_folder(folder / "work")
            done = damage(chance, base, work / NAME)
            damaged = (work / NAME).read_bytes()
            what, why = outcome(base, work)
            counts[what] += 1
            if what == "refused":
                messages[re.sub(r"\d+", "N", why)[:160]] += 1
            if what in ("refused", "same"):
                continue
            findings.append(f"{number} ({base.case}, {done}): {what}: {why}")
            tell(findings[-1])
            if options.keep:
                options.keep.mkdir(parents=True, exist_ok=True)
                (options.keep / f"{number}.vtkhdf").write_bytes(damaged)
    finally:
        close_reader()
        shutil.rmtree(folder)
    return counts, findings, messages


def main():
    """Sweep as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=700)
    parser.add_argument("--first", type=int, default=0, help="number of the first damage")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for what is found")
    options = parser.parse_args()
    started = time.monotonic()
    counts, findings, messages = sweep(options)
    for words, n in messages.most_common():
        print(f"  {n:4d}  {words}")
    print(f"{options.count} damaged files: " + ", ".join(
        f"{counts[what]} {what}" for what in ("refused", "same", "otherwise", "crashed")
    ) + f"; {time.monotonic() - started:.0f} s")
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
