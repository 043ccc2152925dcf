#!/usr/bin/env python3
"""Build wheels with scripts/wheel, install them where nothing of the clone is seen, and run.

    install_wheel.py [--self-contained]

Part of `scripts/test --full`: it takes minutes, and its tools come from PyPI.
"""

import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ("press_a_block", "study_of_friction", "plan_first")
WANTED = (
    "bipot/__init__.py", "bipot/py.typed", "bipot/bin/bipot", "bipot/result.py",
    "bipot/pictures.py", "bipot/page.py", "bipot/drawing/bodies.py"
)
UNWANTED = ("bipot/program.py", "bipot/tradeoff.py", "bipot/peers/runs.py")


def build(*options):
    """Build a wheel and return its path."""
    done = subprocess.run(
        [ROOT / "scripts" / "wheel", *options], stdout=subprocess.PIPE, text=True, check=True
    )
    return Path(done.stdout.split()[-1])


def look_into(wheel, carries):
    """Check what a wheel holds."""
    with zipfile.ZipFile(wheel) as file:
        names = file.namelist()
    for name in WANTED:
        assert name in names, f"{wheel} lacks {name}"
    for name in UNWANTED:
        assert name not in names, f"{wheel} has {name}"
    assert "-py3-none-" in wheel.name, wheel.name
    licences = [name for name in names if "/licenses/" in name]
    assert any(name.endswith("/LICENSE") for name in licences), licences
    libraries = [name for name in names if name.startswith("bipot.libs/")]
    assert bool(libraries) == carries, libraries
    networks = [name for name in libraries if any(word in name for word in ("curl", "krb", "ssl"))]
    assert not networks, networks
    if carries:
        for word in ("mumps", "openblas", "hdf5", "gfortran"):
            assert any(word in name for name in licences), f"no licence of {word}: {licences}"


def install_and_run(wheel, carries):
    """Install a wheel into a new environment and run examples with it."""
    with tempfile.TemporaryDirectory() as holder:
        folder = Path(holder)
        venv.create(folder / "venv", with_pip=True)
        binaries = folder / "venv" / "bin"
        # Neither the clone nor the program that the caller has set.
        environment = {"PATH": f"{binaries}:/usr/bin:/bin", "HOME": holder}

        def run(*words):
            done = subprocess.run(
                [str(word) for word in words], cwd=folder, env=environment, capture_output=True,
                text=True, check=False,
            )
            assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
            return done.stdout

        run(binaries / "python", "-m", "pip", "install", "--quiet", wheel)
        print(run(binaries / "bipot", "--version").strip())
        assert (binaries / "bipot-show").is_file()
        code = "import bipot.executable as e; print(e.built_program())"
        program = Path(run(binaries / "python", "-c", code).strip())
        assert (folder / "venv").resolve() in program.parents, program
        if carries:
            loaded = run("ldd", program)
            assert "not found" not in loaded, loaded
            strangers = [
                line for line in loaded.splitlines()
                if any(word in line for word in ("mumps", "blas", "hdf5", "gfortran", "metis"))
                and "bipot.libs" not in line
            ]
            assert not strangers, strangers
        for name in EXAMPLES:
            said = run(binaries / "python", ROOT / "docs" / "examples" / f"{name}.py")
            print(f"{name}: {said.strip().splitlines()[-1]}")


def main():
    """Build, look, install and run; an assertion that fails says what is wrong."""
    carries = sys.argv[1:] == ["--self-contained"]
    if sys.argv[1:] and not carries:
        sys.exit(__doc__)
    os.environ.pop("BIPOT", None)
    wheel = build(*sys.argv[1:])
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
    look_into(wheel, carries)
    install_and_run(wheel, carries)


if __name__ == "__main__":
    main()
