"""Bipot beside Siconos on the same frictional contact problems, by one definition of the residual.

    compare_siconos.py [--bipot PATH] [--driver PATH] [--n 8,16] [--steps 1,15,30] [--page FILE]
                       [PROBLEM.hdf5 ...]

The problems are the FCLIB files named, and the condensed problems of the paper's block that bipot
exports. Each is solved as it is and scaled (largest entries of W and q are 1): Siconos' stopping
test has units. Both programs start from 0 and get the same file, one thread and the same kernels of
OpenBLAS. The time is the processor's in the solver, with what it prepares from W, without reading
and writing; the best of three runs. The residual is the scaled natural map, docs/theory.md (5.2),
computed here from the reactions each program wrote. Where Siconos stops before that residual is
reached, its tolerance is lowered; the table says to what.

--page writes the tables as a page in Markdown. Status 0; 1 for a wrong command line; 77 where
Siconos (the driver `solve_fclib`) is not there, after a table of bipot alone.
"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
BIPOT_SOLVERS = {
    "auto": ["--solver", "auto"],
    "global Newton": ["--solver", "global-newton"],
    "sweeps": ["--solver", "sweeps"],
    "sweeps, accelerated": ["--solver", "sweeps", "--acceleration"],
    "sweeps, accelerated, relaxation 0.5": ["--acceleration", "--relaxation", "0.5"],
    "one Uzawa visit a sweep, accelerated": ["--local", "uzawa", "--rho", "0.3", "--acceleration"],
}
SICONOS_SOLVERS = [
    ("NSGS", "blocks"),
    ("NSGS", "dense"),
    ("NSN_AC", "blocks"),
    ("NSN_AC", "dense"),
    ("NSN_FB", "blocks"),
    ("NSN_FB", "dense"),
    ("ADMM", "blocks"),
    ("ADMM", "dense"),
]
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

    def row(self, tolerance: float) -> list[str]:
        """Cells of the table."""
        seconds = f"{self.seconds:.3g}" if np.isfinite(self.seconds) else "-"
        return [
            self.program,
            self.solver,
            str(self.iterations),
            seconds,
            f"{self.residual:.1e}" if np.isfinite(self.residual) else "-",
            "yes" if self.reached(tolerance) else "no",
            self.own,
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


def table(rows: list[list[str]]) -> list[str]:
    """Rows as a table in Markdown, the columns aligned."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        lines.append("| " + " | ".join(cells) + " |")
    rule = "|" + "|".join("-" * (w + 2) for w in widths) + "|"
    return [lines[0], rule, *lines[1:]]


def fastest(runs: list[Run], program: str, tolerance: float) -> Run | None:
    """The fastest run of a program that reached the residual."""
    good = [run for run in runs if run.program == program and run.reached(tolerance)]
    return min(good, key=lambda run: run.seconds, default=None)


def compare(bench: Bench, problem: Problem, kind: str) -> tuple[list[str], list[str]]:
    """All solvers on one problem: the lines of its section and its row of the summary."""
    path = bench.folder / "problem.hdf5"
    problem.write(path)
    runs = [bench.run_bipot(problem, path, *item) for item in BIPOT_SOLVERS.items()]
    if bench.driver:
        runs += [bench.run_siconos(problem, path, *choice) for choice in SICONOS_SOLVERS]
    head = ["program", "solver", "iterations", "time (s)", "residual", "reached", "says of itself"]
    title = f"{problem.name}, {kind}: {len(problem.mu)} points"
    lines = [f"## {title}", "", *table([head] + [run.row(bench.tolerance) for run in runs]), ""]

    auto, ours = runs[0], fastest(runs, "bipot", bench.tolerance)
    theirs = fastest(runs, "Siconos", bench.tolerance)
    summary = [problem.name, kind, f"{auto.seconds:.3g}" if auto.reached(bench.tolerance) else "-"]
    for run in (ours, theirs):
        summary += [f"{run.seconds:.3g}", run.solver] if run else ["-", "none"]
    for run in (auto if auto.reached(bench.tolerance) else None, ours):
        summary.append(f"{run.seconds / theirs.seconds:.2g}" if run and theirs else "-")
    return lines, summary


def introduction(arguments: argparse.Namespace, bench: Bench, has_files: bool) -> list[str]:
    """What the page says before its tables."""
    shown = ["benchmarks/compare_siconos.py", "--n", arguments.n, "--steps", arguments.steps]
    shown += ["--tolerance", f"{arguments.tolerance:g}", "--timeout", f"{arguments.timeout:g}"]
    command = shlex.join(shown) + (" FCLIB-FILES" if has_files else "")
    siconos = "Siconos is not installed here, so these are bipot's figures alone."
    if bench.driver:
        siconos = "Siconos is Debian's libsiconos-numerics, through `benchmarks/siconos`."
    return [
        "# Beside Siconos",
        "",
        "This page is written by a script and holds the figures of one real run:",
        "",
        f"    {command}",
        "",
        *[line.strip() for line in __doc__.split("\n\n")[2].splitlines()],
        f"{siconos} `reached` means a residual of {arguments.tolerance:g} or less by that one",
        "definition. A ratio below 1 means that bipot is faster.",
        "",
    ]


def find_program(given: str | None, places: list[str]) -> Path | None:
    """The program named, or the first that is there."""
    for place in [given] if given else [str(ROOT / place) for place in places]:
        if Path(place).is_file() and os.access(place, os.X_OK):
            return Path(place).resolve()
    return None


def main() -> int:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", type=Path)
    parser.add_argument("--bipot", help="the program (default: build/bipot)")
    parser.add_argument("--driver", help="Siconos' driver (default: build/benchmarks/solve_fclib)")
    parser.add_argument("--n", default="8,16", help="bricks along the block's edge, or none")
    parser.add_argument("--steps", default="1,15,30", help="increments of the block")
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--timeout", type=float, default=60, help="seconds a run")
    parser.add_argument("--page", type=Path, help="write the tables here, too")
    arguments = parser.parse_args()

    bipot = find_program(arguments.bipot, ["build/bipot"])
    if not bipot:
        print("bipot is not built; scripts/run builds it", file=sys.stderr)
        return 1
    driver = find_program(arguments.driver, ["build/benchmarks/siconos/solve_fclib"])
    if not driver:
        print(
            "Siconos is not installed, or its driver is not built: install libsiconos-numerics-dev "
            "and libfclib-dev and configure with -DBIPOT_BENCHMARKS=ON; bipot runs alone",
            file=sys.stderr,
        )
    with tempfile.TemporaryDirectory() as scratch:
        bench = Bench(
            bipot,
            driver,
            arguments.tolerance,
            arguments.timeout,
            Path(scratch),
            same_kernels(),
        )
        files = list(arguments.problems)
        if arguments.n != "none":
            for n in arguments.n.split(","):
                files += export_block(bench, int(n), arguments.steps)
        head = ["problem", "units", "auto (s)", "bipot's best (s)", "by", "Siconos' best (s)", "by"]
        sections, summary = [], [[*head, "auto / Siconos", "best / Siconos"]]
        for path in files:
            problem = read_problem(path)
            for kind, version in (("as it is", problem), ("scaled", problem.scaled())):
                lines, row = compare(bench, version, kind)
                print("\n".join(lines), flush=True)
                sections += lines
                summary.append(row)
        page = introduction(arguments, bench, bool(arguments.problems))
        page += ["## Summary", "", *table(summary), "", *sections]
    print("\n".join(table(summary)))
    if arguments.page:
        arguments.page.write_text("\n".join(page).rstrip() + "\n", encoding="utf-8")
    return 0 if driver else 77


if __name__ == "__main__":
    sys.exit(main())
