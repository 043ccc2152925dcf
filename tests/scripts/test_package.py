"""The package itself: what it exports, and where it finds its program."""

import ast
import inspect
import os
import shutil
import subprocess
import sys
import tomllib
import unittest
from fnmatch import fnmatchcase
from pathlib import Path
from unittest.mock import patch

try:
    import h5py  # noqa: F401
    import numpy as np  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "scripts"), str(HERE)]

import synthetic_result  # noqa: E402
from bipot import executable  # noqa: E402
from package import ROOT, WithFolder, bipot  # noqa: E402

PACKAGE = ROOT / "scripts" / "bipot"


def imported_modules(path):
    """Return the modules of the package that a file imports when it is loaded or run: those of
    annotations alone, under TYPE_CHECKING, do not count."""
    found = set()
    waiting = [ast.parse(path.read_text(encoding="utf-8"))]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module} | {f"{node.module}.{name.name}" for name in node.names}
        waiting += ast.iter_child_nodes(node)
    paths = {PACKAGE.parent.joinpath(*name.split(".")).with_suffix(".py") for name in found}
    return {path for path in paths if path.is_file()}


class Imports(unittest.TestCase):
    def test_no_module_imports_itself_by_way_of_others(self):
        """A result is read, drawn, and put on pages: what is below does not know what is above,
        also where a method imports late what draws it."""
        waiting = {path: imported_modules(path) for path in PACKAGE.rglob("*.py")}
        self.assertGreater(len(waiting), 30)
        self.assertIn(PACKAGE / "page.py", waiting[PACKAGE / "result.py"])
        while free := [path for path, needed in waiting.items() if not needed & set(waiting)]:
            for path in free:
                del waiting[path]
        self.assertEqual(sorted(str(path.relative_to(PACKAGE)) for path in waiting), [])


class Names(unittest.TestCase):
    def test_all_that_is_promised_is_there(self):
        promised = sorted(name for names in bipot._MODULES.values() for name in names)
        self.assertEqual(promised, sorted(bipot.__all__))
        for name in promised:
            self.assertTrue(inspect.getdoc(getattr(bipot, name)), name)
        self.assertLessEqual(set(promised), set(dir(bipot)))
        with self.assertRaises(AttributeError):
            bipot.colour  # noqa: B018

    def test_what_is_public_has_types_and_words(self):
        for module in ("element_faces", "deck", "errors", "executable", "meshes", "parameter_study",
                       "named_sets", "obstacle", "page", "pairs", "result", "running", "units"):
            tree = ast.parse((PACKAGE / f"{module}.py").read_text(encoding="utf-8"))
            for node in ast.walk(tree):
                if not isinstance(node, ast.FunctionDef):
                    continue
                place = f"{module}.{node.name}"
                given = [a for a in (*node.args.args, *node.args.kwonlyargs) if a.arg != "self"]
                if node.name[:1] != "_":
                    self.assertIsNotNone(node.returns, place)
                    named = [a.arg for a in given if a.annotation is None and a.arg != "cls"]
                    self.assertEqual(named, [], place)
                    nested = any(
                        isinstance(outer, ast.FunctionDef) and node in outer.body
                        for outer in ast.walk(tree)
                    )
                    self.assertTrue(nested or ast.get_docstring(node), place)

    def test_the_command_begins_without_numpy(self):
        code = "import sys, bipot.executable; print('numpy' in sys.modules)"
        done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": str(ROOT / "scripts")}, check=True)
        self.assertEqual(done.stdout, "False\n")


class Program(WithFolder):
    def test_the_environment_comes_first(self):
        Path("mine").write_text("")
        with patch.dict(os.environ, {"BIPOT": str(self.folder / "mine")}):
            self.assertEqual(executable.built_program(), (self.folder / "mine").resolve())
        with patch.dict(os.environ, {"BIPOT": "nowhere"}):
            with self.assertRaisesRegex(bipot.ProgramMissingError, "no program at nowhere"):
                executable.built_program()

    def installed(self):
        """Return the path and environment of a copy of the package as a wheel installs it."""
        left_out = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["scikit-build"]
        for path in PACKAGE.rglob("*.py"):
            name = f"bipot/{path.relative_to(PACKAGE)}"
            if any(fnmatchcase(name, pattern) for pattern in left_out["wheel"]["exclude"]):
                continue
            target = self.folder / "site" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, target)
        environment = {k: v for k, v in os.environ.items() if k != "BIPOT"}
        return self.folder / "site", {**environment, "PYTHONPATH": "site"}

    def test_without_numpy_one_sentence_says_what_to_install(self):
        (self.folder / "numpy.py").write_text("raise ModuleNotFoundError(name='numpy')\n")
        path = os.pathsep.join([str(self.folder), str(ROOT / "scripts")])
        done = subprocess.run(
            [sys.executable, "-B", "-c", "import bipot; bipot.read('a.vtkhdf')"],
            capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": path},
        )
        self.assertNotEqual(done.returncode, 0)
        self.assertRegex(done.stderr.splitlines()[-1],
                         r"^ImportError: bipot\.read needs numpy: pip install numpy h5py, or on ")
        self.assertNotIn("During handling", done.stderr)

    def test_an_installed_package_has_its_own_and_needs_nothing_of_the_clone(self):
        site, environment = self.installed()
        self.assertFalse((site / "bipot" / "program.py").exists())
        (site / "bipot" / "bin").mkdir()
        program = site / "bipot" / "bin" / "bipot"
        program.symlink_to(Path(os.environ["BIPOT"]).resolve())
        Path("deck.inp").write_text(bipot.flat(ROOT / "input" / "block.inp", n=1, steps=10))
        code = ("import bipot, bipot.executable as e; print(e.program_path());"
                "print(bipot.run('deck.inp').finished); import bipot.pictures, bipot.meshes")
        done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True,
                              env=environment, check=False)
        self.assertEqual(done.stderr.replace("\r", ""), "")
        self.assertEqual(done.stdout.split(), [str(program), "10"])

    def test_the_commands_of_an_installed_package(self):
        site, environment = self.installed()
        commands = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
        self.assertEqual(set(commands), {"bipot", "bipot-show"})
        synthetic_result.write(self.folder / "small.vtkhdf")
        module, _, name = commands["bipot-show"].partition(":")

        def show(*arguments):
            code = f"import sys; from {module} import {name}; sys.exit({name}())"
            return subprocess.run(
                [sys.executable, "-B", "-c", code, *arguments], capture_output=True, text=True,
                env=environment, check=False,
            )

        done = show("small.vtkhdf", "--only", "forces")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.split(), ["small-pictures/forces.png"])
        # A wheel does not bring matplotlib.
        (site / "matplotlib.py").write_text("raise ImportError('No module named matplotlib')\n")
        done = show("small.vtkhdf")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, "^show: No module named matplotlib; pip install matplotlib")

    def test_a_package_without_a_program_says_so(self):
        _, environment = self.installed()
        code = "import bipot.executable as e; e.main()"
        done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True,
                              env=environment, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^bipot: no program at .*build/bipot; scripts/run builds it")


if __name__ == "__main__":
    unittest.main()
