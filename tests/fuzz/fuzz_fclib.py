#!/usr/bin/env python3
"""Run the program on damaged and hostile FCLIB files.

    fuzz_fclib.py [--bipot P] [--count N] [--seed S] [--first I] [--keep FOLDER]

Files are changed byte by byte, or through h5py: other types, shapes and values, huge extents, links
in circles. Held against the program: what outcome.py says of any input; status 0 only with a
converged solution of finite numbers; status 1 for what is certainly wrong.
"""

import sys

import h5py
import numpy as np
from campaign import ROOT, campaign_options, is_sanitized, numbered_input, try_files
from outcome import Outcome

sys.path.insert(0, str(ROOT / "tests" / "cases"))
from fclib_file import write_global, write_local

TIME = 10  # seconds of the processor
ADDRESSES = 1_000_000_000  # bytes that the process may reserve
STORAGES = ("rows", "columns", "triplets", "swapped")
STRANGE = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e41, 1e40, 1e-320, 0.0, -1.0, 1e-30, 1e20)
COUNTS = (0, -1, -2, -3, 1, 2, 3, 5, 7, 2**31 - 1, -(2**31), 10_000_000, 10_000_001)


def write_problem(rng, path):
    """Write a sound problem of a few points."""
    values = np.random.default_rng(rng.randrange(2**32))
    n = rng.choice((1, 2, 4))
    factor = values.normal(size=(3 * n, 3 * n))
    storage = rng.choice(STORAGES)
    mu = values.uniform(0.0, 0.8, size=n)
    if rng.random() < 0.4:
        size = 3 * n + 3
        wide = values.normal(size=(size, size))
        write_global(path, wide @ wide.T + np.eye(size), values.normal(size=(size, 3 * n)),
                     values.normal(size=size), values.normal(size=3 * n), mu, storage)
    else:
        write_local(path, factor @ factor.T + np.eye(3 * n), values.normal(size=3 * n), mu, storage)


def names_of(path):
    """All datasets of a file."""
    with h5py.File(path) as file:
        return datasets(file)


def datasets(file):
    """The names of all datasets of an open file."""
    names = []
    file.visititems(lambda name, item: names.append(name) if hasattr(item, "shape") else None)
    return names


# ---------------------------------------------------------------- bytes


def flip(rng, data):
    """Flip single bits, mostly in the tables at the beginning."""
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        end = len(data) if rng.random() < 0.5 else min(len(data), 2048)
        data[rng.randrange(end)] ^= 1 << rng.randrange(8)


def truncate(rng, data):
    """Cut the file off."""
    del data[rng.randrange(len(data)):]


def fill(rng, data):
    """Fill a piece with one byte, or with numbers at the limits."""
    first = rng.randrange(len(data))
    piece = rng.choice((b"\0", b"\xff", b"\x7f", b"\xff\xff\xff\x7f", b"\0\0\0\x80"))
    n = rng.choice((1, 4, 8, 64, 512))
    data[first: first + n] = (piece * n)[: len(data[first: first + n])]


def shift(rng, data):
    """Put bytes in, or take some out."""
    first = rng.randrange(len(data))
    if rng.random() < 0.5:
        data[first:first] = bytes(rng.randrange(1, 64))
    else:
        del data[first: first + rng.randrange(1, 64)]


# ---------------------------------------------------------------- contents: certainly wrong or not
# Each returns whether the file is certainly wrong now.


def remove(rng, path):
    """A dataset is missing; nzmax alone is not needed."""
    name = rng.choice(names_of(path))
    with h5py.File(path, "a") as file:
        del file[name]
    return not name.endswith("nzmax")


def change_value(rng, path):
    """A number at a limit, or none at all."""
    name = rng.choice(names_of(path))
    with h5py.File(path, "a") as file:
        values = file[name][()]
        if values.dtype.kind == "f":
            value = rng.choice(STRANGE)
            values[rng.randrange(len(values))] = value
            file[name][...] = values
            return not np.isfinite(value) or abs(value) > 1.1e40 or (
                name.endswith("mu") and value < 0.0)
        values[rng.randrange(len(values))] = rng.choice(COUNTS)
        file[name][...] = values
    return False


def change_type(rng, path):
    """The same numbers in another type, or what is no number."""
    name = rng.choice(names_of(path))
    with h5py.File(path, "a") as file:
        values = file[name][()]
        del file[name]
        kind = rng.choice(("f4", "f8", "i1", "u8", ">i4", ">f8", "text", "strings", "compound",
                           "boolean", "complex", "enum", "reference"))
        if kind == "text":
            file[name] = "text"
        elif kind == "strings":
            file.create_dataset(name, data=["a", "bc"], dtype=h5py.string_dtype())
        elif kind == "compound":
            file[name] = np.zeros(len(values), dtype=[("a", "i4"), ("b", "f8")])
        elif kind == "boolean":
            file[name] = values > 0
        elif kind == "complex":
            file[name] = values.astype("c16")
        elif kind == "enum":
            file.create_dataset(name, data=np.zeros(len(values), "i4"),
                                dtype=h5py.enum_dtype({"A": 0, "B": 1}, basetype="i4"))
        elif kind == "reference":
            file.create_dataset(name, (len(values),), dtype=h5py.ref_dtype)
        else:
            with np.errstate(all="ignore"):
                file[name] = values.astype(kind)
        return kind in ("text", "strings", "compound") and not name.endswith("nzmax")


def change_shape(rng, path):
    """Too few, too many, none, in two dimensions, a scalar, or far too many."""
    name = rng.choice(names_of(path))
    with h5py.File(path, "a") as file:
        values = file[name][()]
        del file[name]
        kind = rng.choice(("none", "fewer", "more", "table", "scalar", "empty", "huge", "wide"))
        if kind == "none":
            file[name] = values[:0]
        elif kind == "fewer":
            file[name] = values[: len(values) - 1]
        elif kind == "more":
            file[name] = np.append(values, values)
        elif kind == "table":
            file[name] = values.reshape(1, -1)
        elif kind == "scalar":
            file[name] = values.flat[0]
        elif kind == "empty":
            file[name] = h5py.Empty(values.dtype)
        elif kind == "huge":
            file.create_dataset(name, (rng.choice((10**7, 2**31, 2**40, 2**62)),), values.dtype,
                                chunks=(1024,))
        else:
            file.create_dataset(name, (2**16, 2**16, 2**16, 2**15), values.dtype,
                                chunks=(1, 1, 1, 1024))
        return kind in ("none", "empty", "huge", "wide") and not name.endswith("nzmax")


def change_links(rng, path):
    """Links in circles and to nowhere, a group in the place of a dataset."""
    name = rng.choice(names_of(path))
    with h5py.File(path, "a") as file:
        group = file[name].parent
        last = name.split("/")[-1]
        del file[name]
        kind = rng.choice(("itself", "nowhere", "outside", "own file", "group", "circle", "pair"))
        if kind == "itself":
            group[last] = h5py.SoftLink("/" + name)
        elif kind == "nowhere":
            group[last] = h5py.SoftLink("/no/such/place")
        elif kind == "outside":
            group[last] = h5py.ExternalLink("/no/such/file.hdf5", "/x")
        elif kind == "own file":
            group[last] = h5py.ExternalLink("problem.hdf5", "/" + name)
        elif kind == "group":
            group.create_group(last)
        elif kind == "circle":
            group[last] = file["/"]
        else:
            group[last] = h5py.SoftLink("/" + name + "2")
            group[last + "2"] = h5py.SoftLink("/" + name)
        return not name.endswith("nzmax")


BYTES = (flip, flip, flip, truncate, fill, shift)
CONTENTS = (remove, change_value, change_value, change_type, change_shape, change_links)


def change_bytes(rng, path):
    """Change bytes of the file: what was done."""
    mutation = rng.choice(BYTES)
    data = bytearray(path.read_bytes())
    mutation(rng, data)
    path.write_bytes(bytes(data))
    return mutation.__name__


def change(rng, path):
    """Change the file: what was done, and whether it is certainly wrong."""
    if rng.random() < 0.5:
        return change_bytes(rng, path), False
    mutation = rng.choice(CONTENTS)
    return mutation.__name__, mutation(rng, path)


def held_to_solution(folder):
    """What is wrong with the file of a run that ended well."""
    path = folder / "problem.solution.hdf5"
    if not path.exists():
        return ["status 0 without a solution"]
    with h5py.File(path) as file:
        group = file["solution"]
        if int(group.attrs["converged"]) != 1:
            return ["status 0 without convergence"]
        for name in ("r", "u"):
            if not np.isfinite(group[name][()]).all():
                return [f"status 0 and numbers in {name} that are not finite"]
    return []


def judge(options, number, sanitized):
    """Try file `number`: (what was done, complaints, data, outcome)."""
    with numbered_input(options, number) as (rng, folder):
        path = folder / "work" / "problem.hdf5"
        write_problem(rng, path)
        done, certain = change(rng, path)
        data = path.read_bytes()
        outcome = Outcome([options.bipot, "problem.hdf5"], folder,
                          TIME * (4 if sanitized else 1), 0 if sanitized else ADDRESSES)
        complaints = outcome.complaints()
        if certain and outcome.status != 1:
            complaints.append(f"a wrong file ended with status {outcome.status}")
        if outcome.status == 0:
            complaints += held_to_solution(path.parent)
    return done, complaints, data, outcome


def main():
    """Read the command line and go."""
    options = campaign_options(__doc__, "file", 1000).parse_args()
    sanitized = is_sanitized(options.bipot)
    found = try_files(options, "files", "hdf5", lambda number: judge(options, number, sanitized))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
