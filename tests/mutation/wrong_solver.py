#!/usr/bin/env python3
"""Put one mistake at a time into the solver and run decks: does the certificate notice?

    tests/mutation/wrong_solver.py [--build DIR] [--only TEXT]

No test takes part: a run that ends with status 0 has not noticed. The mistakes are signs and
factors in what the certificate computes by code of its own: internal forces, the mortar's weights,
normals and gaps, and overlaps that are allowed for a time. Prints a table as in
docs/reliability.md. Wants a tree built by Ninja (build/),
whose program has to be up to date.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
SECONDS = 120.0


@dataclass(frozen=True)
class Mistake:
    """A text of a file that stands there once, what is put in its place, and decks that meet it."""

    name: str
    file: str
    old: str
    new: str
    decks: str


BLOCK = "block.inp n=4 steps=20"
BODIES = "foundation.inp, stack.inp"
MISTAKES = [
    Mistake(
        "no error",
        "geometry/mortar.f90",
        "!> Weights of a",
        "!> Weights of  a",
        f"{BLOCK}, bracket.inp, pipe.inp, tool.inp n=4, roller.inp, wheel.inp, {BODIES}",
    ),
    Mistake(
        "shear forces with the wrong sign, C3D8",
        "elements/hexahedron8.f90",
        "f(1, a) = f(1, a) + s(1)*d(1) + s(4)*d(2)",
        "f(1, a) = f(1, a) + s(1)*d(1) - s(4)*d(2)",
        f"{BLOCK}, {BODIES}",
    ),
    Mistake(
        "internal forces 1e-6 too large",
        "elements/hexahedron8.f90",
        "s = weight(g)*stress(:, g)",
        "s = 1.000001_wp*weight(g)*stress(:, g)",
        f"{BLOCK}, {BODIES}",
    ),
    Mistake(
        "internal forces of congruent elements with the wrong sign",
        "elements/congruent_forces.f90",
        "call add_at_nodes(nodes, reshape(force(:, k), [3, 8]), f)",
        "call add_at_nodes(nodes, -reshape(force(:, k), [3, 8]), f)",
        f"{BLOCK}, {BODIES}",
    ),
    Mistake(
        "one factor of congruent elements with the wrong sign",
        "elements/congruent_forces.f90",
        "factors(10:12) = (xi(:, 2) - xi(:, 1))",
        "factors(10:12) = (xi(:, 1) - xi(:, 2))",
        f"{BLOCK}, {BODIES}",
    ),
    Mistake(
        "internal forces at finite strain 1e-6 too large",
        "elements/finite_strain.f90",
        "p = element%weight(g)*stress(:, :, g)",
        "p = 1.000001_wp*element%weight(g)*stress(:, :, g)",
        "rubber.inp",
    ),
    Mistake(
        "the first Piola-Kirchhoff stress transposed",
        "elements/finite_strain.f90",
        "p = element%weight(g)*stress(:, :, g)",
        "p = element%weight(g)*transpose(stress(:, :, g))",
        "rubber.inp",
    ),
    Mistake(
        "pressures at finite strain 1e-6 too large",
        "elements/mesh_forces.f90",
        "f(:, of_face) = f(:, of_face) - pressure*face",
        "f(:, of_face) = f(:, of_face) - 1.000001_wp*pressure*face",
        "gasket.inp",
    ),
    Mistake(
        "pressures that do not follow",
        "elements/mesh_forces.f90",
        "x(:, :n) = x(:, :n) + u(:, of_face)",
        "x(:, :n) = x(:, :n) + 0.0_wp*u(:, of_face)",
        "gasket.inp",
    ),
    Mistake(
        "expansion at finite strain 1e-5 too large",
        "elements/expansion.f90",
        "way = free*(x",
        "way = 1.00001_wp*free*(x",
        "gasket.inp",
    ),
    Mistake(
        "modes of C3D8I with the wrong sign",
        "elements/c3d8i.f90",
        "b = -reshape(force_of(3,",
        "b = reshape(force_of(3,",
        "block.inp n=4 steps=20 element=C3D8I, foundation.inp element=C3D8I",
    ),
    Mistake(
        "weights of the master with the wrong sign",
        "geometry/weight_rows.f90",
        "weights%weight(m) = weights%weight(m) + entry%weight/area(i)",
        "weights%weight(m) = weights%weight(m) - entry%weight/area(i)",
        f"{BODIES}, cylinder.inp, press.inp",
    ),
    Mistake(
        "dual functions with the wrong sign off the diagonal",
        "geometry/dual_weights.f90",
        "(1.0_wp - plain)*lumped(a)*dual(:, a)",
        "(1.0_wp - plain)*lumped(a)*dual(:, a)*merge(1, -1, [1, 2, 3, 4] == a)",
        BODIES,
    ),
    Mistake(
        "weights 1 % too large",
        "geometry/weight_rows.f90",
        "entry%weight/area(i)",
        "1.01_wp*entry%weight/area(i)",
        BODIES,
    ),
    Mistake(
        "no dual functions: the slave's own",
        "geometry/dual_weights.f90",
        "matmul(transpose(dual), overlap%mixed(:n, :parts(i)%n))",
        "overlap%mixed(:n, :parts(i)%n)",
        BODIES,
    ),
    Mistake(
        "normals before surfaces with the wrong sign",
        "geometry/mortar.f90",
        "if (length > 0.0_wp) mortar%normal(:, i) = mortar%normal(:, i)/length",
        "if (length > 0.0_wp) mortar%normal(:, i) = -mortar%normal(:, i)/length",
        BODIES,
    ),
    Mistake(
        "gaps before surfaces with the wrong sign",
        "contact/geometry/placement.f90",
        "placement%gap(i) = dot_product(mortar%normal(:, here), mortar%apart(:, here))",
        "placement%gap(i) = -dot_product(mortar%normal(:, here), mortar%apart(:, here))",
        f"{BODIES}, cylinder.inp, press.inp",
    ),
    Mistake(
        "gaps before surfaces 1e-4 too large",
        "contact/geometry/placement.f90",
        "placement%gap(i) = dot_product(mortar%normal(:, here), mortar%apart(:, here))",
        "placement%gap(i) = 1.0e-4_wp + dot_product(mortar%normal(:, here), mortar%apart(:, here))",
        f"{BODIES}, cylinder.inp, press.inp",
    ),
    Mistake(
        "gaps before round obstacles with the wrong sign",
        "geometry/obstacle_shapes.f90",
        "gap = distance - obstacle%radius\n    if (.not. obstacle%inner)",
        "gap = obstacle%radius - distance\n    if (.not. obstacle%inner)",
        "pipe.inp, tool.inp n=4, roller.inp",
    ),
    Mistake(
        "round obstacles 1e-6 too large",
        "geometry/obstacle_shapes.f90",
        "gap = distance - obstacle%radius\n    if (.not. obstacle%inner)",
        "gap = distance - 1.000001_wp*obstacle%radius\n    if (.not. obstacle%inner)",
        "pipe.inp, tool.inp n=4, roller.inp",
    ),
    Mistake(
        "gaps before planes with the wrong sign",
        "geometry/obstacle_shapes.f90",
        "gap = dot_product(obstacle%normal, arm)",
        "gap = -dot_product(obstacle%normal, arm)",
        "corner.inp, hertz.inp, bend.inp",
    ),
    Mistake(
        "planes with the wrong normal",
        "geometry/obstacle_shapes.f90",
        "      normal = obstacle%normal\n      return",
        "      normal = -obstacle%normal\n      return",
        f"{BLOCK}, bracket.inp, corner.inp",
    ),
    Mistake(
        "planes with a normal off by 1e-5",
        "geometry/obstacle_shapes.f90",
        "      normal = obstacle%normal\n      return",
        "      normal = obstacle%normal + [1.0e-5_wp, 0.0_wp, 0.0_wp]\n      return",
        f"{BLOCK}, bracket.inp, corner.inp",
    ),
    Mistake(
        "obstacles move against their reference node",
        "geometry/obstacle_shapes.f90",
        "if (obstacle%ref_node > 0) shift = u(:, obstacle%ref_node)",
        "if (obstacle%ref_node > 0) shift = -u(:, obstacle%ref_node)",
        "tool.inp n=4, roller.inp, wheel.inp",
    ),
    Mistake(
        "obstacles turn the wrong way",
        "geometry/obstacle_shapes.f90",
        "r = rotation_matrix(rotation)",
        "r = rotation_matrix(-rotation)",
        "wheel.inp",
    ),
    Mistake(
        "slips before obstacles that turn with the wrong sign",
        "contact/geometry/drag_points.f90",
        "placement%drag(:, i) = (matmul(after, half) - after)",
        "placement%drag(:, i) = -(matmul(after, half) - after)",
        "wheel.inp",
    ),
    Mistake(
        "allowed interference with the wrong sign",
        "model/interference.f90",
        "extra = points%constant_gap + allowed_interference",
        "extra = points%constant_gap - allowed_interference",
        "shrink_fit.inp, shrink_fit.inp over=1e-6",
    ),
    Mistake(
        "allowed interference as at the beginning of the step",
        "model/interference.f90",
        "share = 1.0_wp - fraction",
        "share = 1.0_wp - 0.0_wp*fraction",
        "shrink_fit.inp, shrink_fit.inp over=1e-6",
    ),
    Mistake(
        "allowed interference by an amplitude of half its time",
        "model/interference.f90",
        "fraction*scene%steps(k)%period",
        "0.5_wp*fraction*scene%steps(k)%period",
        "shrink_fit.inp, shrink_fit.inp over=1e-6",
    ),
    Mistake(
        "overlaps of a shrink fit 1 % too large",
        "contact/geometry/initial_overlaps.f90",
        "points%overlap = max(0.0_wp, -placement%gap)",
        "points%overlap = 1.01_wp*max(0.0_wp, -placement%gap)",
        "shrink_fit.inp, shrink_fit.inp over=1e-6",
    ),
    Mistake(
        "slips between bodies at finite strain 1e-4 too large",
        "contact/surface_drag.f90",
        "drag = faced_place(scene, points, now, i, u)",
        "drag = 1.0e-4_wp + faced_place(scene, points, now, i, u)",
        "ironing.inp n=2",
    ),
    Mistake(
        "slips half as large in the result",
        "contact/describe_contact.f90",
        "contact%frame(:, 2:, i))",
        "0.5_wp*contact%frame(:, 2:, i))",
        BODIES,
    ),
]


def commands(build: Path, wanted: str) -> str:
    """Return the command that makes a file of the tree."""
    called = ["ninja", "-C", str(build), "-t", "commands", "bipot"]
    listed = subprocess.run(called, capture_output=True, text=True, check=True).stdout.splitlines()
    return next(line for line in listed if wanted in line)


def build_with(mistake: Mistake, build: Path, folder: Path) -> Path:
    """Compile the changed file and link it before the library."""
    text = (ROOT / "src" / mistake.file).read_text(encoding="utf-8")
    if text.count(mistake.old) != 1:
        sys.exit(f"{mistake.file} has '{mistake.old}' {text.count(mistake.old)} times")
    source = folder / Path(mistake.file).name
    source.write_text(text.replace(mistake.old, mistake.new), encoding="utf-8")
    command = shlex.split(commands(build, f"{mistake.file}-pp.f90 -o"))
    # Modules of the other files of its room lie where its own would go.
    command = [c.replace("-J", "-I", 1) if c.startswith("-J") else c for c in command
               if c != "-fpreprocessed"]
    at = command.index("-c")
    compiled = folder / "changed.o"
    (folder / "modules").mkdir(exist_ok=True)
    command = [*command[:at], f"-J{folder}/modules", "-c", str(source), "-o", str(compiled)]
    subprocess.run(command, cwd=build, check=True, capture_output=True)
    link = commands(build, " -o bipot ").removeprefix(": && ").removesuffix(" && :")
    program = folder / "bipot"
    link = link.replace(" -o bipot ", f" {compiled} -o {program} ", 1)
    subprocess.run(shlex.split(link), cwd=build, check=True, capture_output=True)
    return program


def run(program: Path, deck: str, folder: Path) -> subprocess.CompletedProcess[str] | None:
    """Run a deck; None where it does not end."""
    name, *values = deck.split()
    path = next(at / name for at in (ROOT / "input", HERE) if (at / name).exists())
    called = [str(program), str(path), "-o", str(folder / "out"), "--overwrite"]
    for value in values:
        called += ["--set", value]
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    try:
        return subprocess.run(
            called, capture_output=True, text=True, timeout=SECONDS, env=env, check=False
        )
    except subprocess.TimeoutExpired:
        return None


def numbers(said: str) -> list[float]:
    """Return the numbers of the table of forces, pressures and slips; rounding of 0 as 0."""
    lines = "".join(re.findall(r"^ *\d+ +\S+ +(\(.*\n)", said, re.M))
    found = [float(n) for n in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", lines)]
    return [n if abs(n) > 1e-9 else 0.0 for n in found]


def outcome_of(program: Path, deck: str, folder: Path, true: Path) -> str:
    """Run a deck, and say how that ended; where well, whether the result is the true one."""
    done = run(program, deck, folder)
    if done is None:
        return "not ended"
    if done.returncode == 0:
        right = run(true, deck, folder)
        same = right is not None and numbers(done.stdout) == numbers(right.stdout)
        return "0, the result is right" if same else "**0, not noticed**"
    said = (done.stdout + done.stderr).partition("not certified,")[2].partition(", allowed")[0]
    entries = {name: float(value) for name, value in re.findall(r"(\w+) (\d[\d.e+-]*)", said)}
    if not entries:
        return f"{done.returncode}, not solved"
    worst = max(entries, key=lambda name: entries[name])
    size = f"{entries[worst]:.1g}" if entries[worst] < 1e9 else "> 1e9"
    return f"{done.returncode}, {worst} {size}"


def main() -> int:
    """Try all mistakes; return 0."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build", help="a tree built by Ninja")
    parser.add_argument("--only", default="", help="only mistakes whose name has this text")
    options = parser.parse_args()
    print("| error | deck: exit status, worst error |\n|---|---|")
    true = options.build.resolve() / "bipot"
    for mistake in MISTAKES:
        if options.only not in mistake.name:
            continue
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            program = build_with(mistake, options.build.resolve(), folder)
            found = [
                f"`{deck.replace('.inp', '')}`: {outcome_of(program, deck, folder, true)}"
                for deck in mistake.decks.split(", ")
            ]
        print(f"| {mistake.name} | {'; '.join(found)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
