"""Frictional contact problems alone, u = W r + q, solved by bipot and by Siconos, and measured."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from bipot.program import ROOT

REPEATS = 3
ENOUGH_SECONDS = 2.0  # a run this long is not repeated


@dataclass
class Problem:
    """u = W r + q with Coulomb's law, in units of the file or scaled."""

    name: str
    w: np.ndarray
    q: np.ndarray
    mu: np.ndarray

    def scaled(self) -> Problem:
        """The same problem in units that make the largest entries of W and q 1."""
        w, q = np.abs(self.w).max(), np.abs(self.q).max()
        return Problem(self.name, self.w / w, self.q / q, self.mu)

    def write(self, path: Path) -> None:
        """Write the problem as FCLIB's local one, W by compressed rows."""
        rows, columns = np.nonzero(self.w)
        with h5py.File(path, "w") as file:
            group = file.create_group("fclib_local")
            group["spacedim"] = np.array([3], dtype=np.int32)
            n = len(self.q)
            counts = {"m": n, "n": n, "nzmax": len(rows), "nz": -2}
            for name, value in counts.items():
                group[f"W/{name}"] = np.array([value], dtype=np.int32)
            starts = np.searchsorted(rows, np.arange(n + 1))
            group["W/p"] = starts.astype(np.int32)
            group["W/i"] = columns.astype(np.int32)
            group["W/x"] = self.w[rows, columns]
            group["vectors/q"] = self.q
            group["vectors/mu"] = self.mu

    def residual(self, r: np.ndarray) -> float:
        """The scaled natural map of reactions, docs/theory.md (5.2), from a start at 0."""
        r = r.reshape(-1, 3)
        if not np.isfinite(r).all():
            return np.inf
        trace = np.diag(self.w).reshape(-1, 3).sum(axis=1)
        rho = (3 / trace)[:, None]
        q = self.q.reshape(-1, 3)
        u = (self.w @ r.ravel()).reshape(-1, 3) + q
        z = r - self.project(r - rho * self.augmented(u))
        scale = max(np.linalg.norm(r), np.linalg.norm(self.project(-rho * self.augmented(q))))
        return np.linalg.norm(z) / scale if scale > 0 else np.linalg.norm(z)

    def augmented(self, u: np.ndarray) -> np.ndarray:
        """U + mu |u_t| n."""
        lifted = u.copy()
        lifted[:, 0] += self.mu * np.linalg.norm(u[:, 1:], axis=1)
        return lifted

    def project(self, y: np.ndarray) -> np.ndarray:
        """Onto the Coulomb cones."""
        normal, size = y[:, 0], np.linalg.norm(y[:, 1:], axis=1)
        inside = size <= self.mu * normal
        apex = self.mu * size <= -normal
        slide_normal = (normal + self.mu * size) / (1 + self.mu**2)
        factor = self.mu * slide_normal / np.where(size > 0, size, 1)
        slide = np.column_stack([slide_normal, factor[:, None] * y[:, 1:]])
        return np.where(apex[:, None], 0, np.where(inside[:, None], y, slide))


def read_matrix(group: h5py.Group) -> np.ndarray:
    """A matrix of an FCLIB file; triplets with `i` rows, as in Siconos' files."""
    m, n, nz = (int(np.ravel(group[name][()])[0]) for name in ("m", "n", "nz"))
    p, i, x = (group[name][()] for name in ("p", "i", "x"))
    matrix = np.zeros((m, n))
    if nz >= 0:
        np.add.at(matrix, (i[:nz], p[:nz]), x[:nz])
    elif nz == -1:
        np.add.at(matrix, (i, np.repeat(np.arange(n), np.diff(p))), x)
    else:
        np.add.at(matrix, (np.repeat(np.arange(m), np.diff(p)), i), x)
    return matrix


def read_problem(path: Path) -> Problem:
    """A problem of an FCLIB file, condensed where it is global."""
    with h5py.File(path) as file:
        if "fclib_local" in file:
            group = file["fclib_local"]
            w, q = read_matrix(group["W"]), group["vectors/q"][()]
        else:
            group = file["fclib_global"]
            m, h = read_matrix(group["M"]), read_matrix(group["H"])
            if not np.tril(m, -1).any():
                m = m + np.triu(m, 1).T
            solved = np.linalg.solve(m, np.column_stack([h, group["vectors/f"][()]]))
            w = h.T @ solved[:, :-1]
            w = 0.5 * (w + w.T)
            q = group["vectors/w"][()] + h.T @ solved[:, -1]
        return Problem(path.name.split(".")[0], w, q, group["vectors/mu"][()])


@dataclass
class Run:
    """What came of one solver on one problem."""

    program: str
    solver: str
    iterations: int = 0
    seconds: float = np.inf
    residual: float = np.inf
    own: str = ""  # what the program says of itself

    def reached(self, tolerance: float) -> bool:
        """Whether it counts, with room for the other order of summation here."""
        return self.residual <= 1.01 * tolerance

    def row(self) -> list[str]:
        """Cells of a table: program, solver, iterations, seconds, residual."""
        return [
            self.program,
            self.solver,
            str(self.iterations) if np.isfinite(self.residual) else "-",
            f"{self.seconds:.3g}" if np.isfinite(self.seconds) else "-",
            f"{self.residual:.1e}" if np.isfinite(self.residual) else "-",
        ]


@dataclass
class Bench:
    """Where the programs are and how they are run."""

    bipot: Path
    driver: Path | None
    tolerance: float
    timeout: float
    folder: Path
    env: dict[str, str] = field(default_factory=dict)

    def call(self, command: list[str]) -> subprocess.CompletedProcess | None:
        """Run a program in the scratch folder; None where it took too long."""
        try:
            return subprocess.run(
                command,
                cwd=self.folder,
                env=self.env,
                timeout=self.timeout,
                capture_output=True,
                text=True,
                errors="replace",
                check=False,
            )
        except subprocess.TimeoutExpired:
            return None

    def run_bipot(self, problem: Problem, path: Path, name: str, options: list[str]) -> Run:
        """Bipot with some options."""
        run = Run("bipot", name)
        output = self.folder / "bipot.hdf5"
        command = [str(self.bipot), str(path), "-o", str(output), "--overwrite", "--quiet"]
        command += [*options, "--tolerance", f"{self.tolerance:g}"]
        for _ in range(REPEATS):
            done = self.call(command)
            if done is None:
                run.own = f"more than {self.timeout:g} s"
                return run
            if done.returncode not in (0, 2):
                run.own = done.stderr.strip().splitlines()[-1]
                return run
            with h5py.File(output) as file:
                said = dict(file["solution"].attrs)
                run.iterations = int(said["iterations"])
                run.seconds = min(run.seconds, float(said["processor_seconds"]))
                run.residual = problem.residual(file["solution/r"][()])
                solver = said["solver"]
            run.own = solver.decode() if isinstance(solver, bytes) else str(solver)
            if done.returncode == 2:
                run.own += ", not converged"
            if run.seconds > ENOUGH_SECONDS:
                break
        return run

    def run_siconos(self, problem: Problem, path: Path, solver: str, storage: str) -> Run:
        """Siconos at ever lower tolerances until the residual is reached, or it ends badly."""
        best = Run("Siconos", f"{solver}, {storage}")
        for power in (0, 2, 4):
            tolerance = self.tolerance * 10.0**-power
            run = self.run_driver(problem, path, solver, storage, tolerance)
            if run.residual < best.residual or not best.own:
                best = run
            if run.reached(self.tolerance) or "converged" not in run.own or "not" in run.own:
                break
        return best

    def run_driver(
        self, problem: Problem, path: Path, solver: str, storage: str, tolerance: float
    ) -> Run:
        """Siconos once, at a tolerance of its own."""
        run = Run("Siconos", f"{solver}, {storage}")
        output = self.folder / "siconos.txt"
        command = [str(self.driver), str(path), solver, storage, f"{tolerance:g}", "100000"]
        for _ in range(REPEATS):
            output.unlink(missing_ok=True)
            done = self.call([*command, str(output)])
            if done is None:
                run.own = f"more than {self.timeout:g} s"
                return run
            lines = [line for line in done.stdout.splitlines() if line.startswith("solver=")]
            if done.returncode != 0 or not lines:
                run.own = f"failed (status {done.returncode})"
                return run
            said = dict(pair.split("=", 1) for pair in lines[-1].split())
            run.iterations = int(said["iterations"])
            run.seconds = min(run.seconds, float(said["seconds"]))
            run.residual = problem.residual(np.loadtxt(output, ndmin=1))
            verdict = "converged" if said["info"] == "0" else "not converged"
            run.own = f"{verdict}, error {float(said['error']):.1e} at {tolerance:.0e}"
            if run.seconds > ENOUGH_SECONDS:
                break
        return run


def same_kernels() -> dict[str, str]:
    """An environment with one thread and, for both programs, the kernels the processor can use."""
    env = dict(os.environ, OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    try:
        flags = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return env
    if "OPENBLAS_CORETYPE" not in env:
        if all(f" {flag}" in flags for flag in ("avx512f", "avx512bw", "avx512dq", "avx512vl")):
            env["OPENBLAS_CORETYPE"] = "SKYLAKEX"
        elif " avx2" in flags and " fma" in flags:
            env["OPENBLAS_CORETYPE"] = "HASWELL"
    return env


def export_block(bench: Bench, n: int, steps: str) -> list[Path]:
    """The condensed problems of the paper's block at some increments."""
    folder = bench.folder / f"block-n{n}"
    folder.mkdir()
    command = [str(bench.bipot), str(ROOT / "input/block.inp"), "--quiet", "--set", f"n={n}"]
    done = subprocess.run(
        [*command, "--export-fclib", steps],
        cwd=folder,
        env=bench.env,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        sys.exit(f"the block with n={n} could not be exported: {done.stderr.strip()}")
    files = sorted(folder.glob("*.fclib.hdf5"), key=lambda path: int(path.name.split("-")[1][:-11]))
    named = [path.with_name(path.name.replace("block-", f"block-n{n}-step")) for path in files]
    return [path.rename(name) for path, name in zip(files, named, strict=True)]


def find_program(given: str | None, places: list[str]) -> Path | None:
    """The program named, or the first that is there."""
    for place in [given] if given else [str(ROOT / place) for place in places]:
        if Path(place).is_file() and os.access(place, os.X_OK):
            return Path(place).resolve()
    return None
