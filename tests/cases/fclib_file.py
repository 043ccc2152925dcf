"""FCLIB files for the tests: write a problem in every storage, read one, measure a solution."""

import subprocess
from pathlib import Path

import h5py
import numpy as np
from program import PROGRAM


def write_matrix(group, matrix, storage="rows"):
    """Write a dense matrix by `rows`, `columns`, `triplets` (i rows) or `swapped` triplets."""
    rows, columns = np.nonzero(matrix)
    m, n = matrix.shape
    if storage == "columns":
        order = np.lexsort((rows, columns))
        rows, columns = rows[order], columns[order]
    values = matrix[rows, columns]
    if storage == "rows":
        nz, p, i = -2, np.searchsorted(rows, np.arange(m + 1)), columns
    elif storage == "columns":
        nz, p, i = -1, np.searchsorted(columns, np.arange(n + 1)), rows
    elif storage == "triplets":
        nz, p, i = len(values), columns, rows
    else:
        nz, p, i = len(values), rows, columns
    for name, value in {"m": m, "n": n, "nzmax": len(values), "nz": nz}.items():
        group[name] = np.array([value], dtype=np.int32)
    group["p"] = np.asarray(p, dtype=np.int32)
    group["i"] = np.asarray(i, dtype=np.int32)
    group["x"] = values


def write_local(path, w, q, mu, storage="rows"):
    """Write u = W r + q."""
    with h5py.File(path, "w") as file:
        file["fclib_local/spacedim"] = np.array([3], dtype=np.int32)
        write_matrix(file.create_group("fclib_local/W"), np.asarray(w, dtype=float), storage)
        file["fclib_local/vectors/q"] = np.asarray(q, dtype=float)
        file["fclib_local/vectors/mu"] = np.asarray(mu, dtype=float)


def write_global(path, m, h, f, w, mu, storage="triplets"):
    """Write M v = H r + f, u = H^T v + w."""
    with h5py.File(path, "w") as file:
        file["fclib_global/spacedim"] = np.array([3], dtype=np.int32)
        write_matrix(file.create_group("fclib_global/M"), np.asarray(m, dtype=float), storage)
        write_matrix(file.create_group("fclib_global/H"), np.asarray(h, dtype=float), storage)
        for name, values in {"f": f, "w": w, "mu": mu}.items():
            file[f"fclib_global/vectors/{name}"] = np.asarray(values, dtype=float)


def read_matrix(group):
    """A matrix as a dense one; triplets with `i` rows."""
    m, n, nz = (int(np.ravel(group[name][()])[0]) for name in ("m", "n", "nz"))
    p, i, x = (group[name][()] for name in ("p", "i", "x"))
    matrix = np.zeros((m, n))
    if nz >= 0:
        rows, columns = i[:nz], p[:nz]
    elif nz == -1:
        rows, columns = i, np.repeat(np.arange(n), np.diff(p))
    else:
        rows, columns = np.repeat(np.arange(m), np.diff(p)), i
    np.add.at(matrix, (rows, columns), x)
    return matrix


def read_local(path):
    """W, q, mu of a file, a global problem condensed (one triangle of M mirrored)."""
    with h5py.File(path) as file:
        if "fclib_local" in file:
            group = file["fclib_local"]
            return read_matrix(group["W"]), group["vectors/q"][()], group["vectors/mu"][()]
        group = file["fclib_global"]
        m, h = read_matrix(group["M"]), read_matrix(group["H"])
        if not np.tril(m, -1).any():
            m = m + np.triu(m, 1).T
        solved = np.linalg.solve(m, np.column_stack([h, group["vectors/f"][()]]))
        q = group["vectors/w"][()] + h.T @ solved[:, -1]
        return h.T @ solved[:, :-1], q, group["vectors/mu"][()]


def project(mu, y):
    """Onto the Coulomb cone of one point."""
    size = np.linalg.norm(y[1:])
    if mu * size <= -y[0]:
        return np.zeros(3)
    if size <= mu * y[0]:
        return y
    normal = (y[0] + mu * size) / (1 + mu**2)
    return np.array([normal, *(mu * normal * y[1:] / size)])


def residual(w, q, mu, r):
    """The scaled natural map of docs/theory.md (5.2) from a start at 0, point by point."""
    u = w @ r + q
    z, start = np.zeros_like(r), np.zeros_like(r)
    for point, friction in enumerate(mu):
        part = slice(3 * point, 3 * point + 3)
        rho = 3 / np.trace(w[part, part])
        lift = np.array([friction, 0, 0])
        image = rho * (u[part] + lift * np.linalg.norm(u[part][1:]))
        z[part] = r[part] - project(friction, r[part] - image)
        start[part] = project(friction, -rho * (q[part] + lift * np.linalg.norm(q[part][1:])))
    scale = max(np.linalg.norm(r), np.linalg.norm(start))
    return np.linalg.norm(z) / scale if scale > 0 else np.linalg.norm(z)


class Solved:
    """One run of the program on a problem, in the folder of the problem."""

    def __init__(self, path, *options, output=None):
        """Solve `path`; the solution stands beside it."""
        path = Path(path)
        command = [PROGRAM, str(path), *options]
        self.file = path.with_name(path.name.rsplit(".", 1)[0] + ".solution.hdf5")
        if output is not None:
            self.file = Path(output)
            command += ["-o", str(output)]
        done = subprocess.run(
            command,
            cwd=path.parent,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=600,
            check=False,
        )
        self.status, self.output, self.errors = done.returncode, done.stdout, done.stderr

    def read(self, name):
        """A dataset of the solution: r, u or v."""
        with h5py.File(self.file) as file:
            return file[f"solution/{name}"][()]

    def fact(self, name):
        """What the file says of the solution."""
        with h5py.File(self.file) as file:
            return file["solution"].attrs[name]
