"""The examples in docs/examples, and the code on the pages, run and find their numbers."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from program import PROGRAM, SOURCE

EXAMPLES = sorted((SOURCE / "docs" / "examples").glob("*.py"))
# What not everybody has, by the word that asks for it.
OPTIONAL = ("matplotlib", "meshio", "pandas", "pyvista")
ASKED = {".plot(": "matplotlib", "to_pandas(": "pandas", "to_pyvista(": "pyvista"}
# Starts a script whose pictures have few pixels: they take time, and nothing here looks at them.
DRAWING = ("import runpy, sys; from bipot.drawing import rendering; rendering.DPI = 40; "
           "runpy.run_path(sys.argv[1], run_name='__main__')")  # fmt: skip


def missing(code):
    """Return the optional packages that a code needs and that are not installed."""
    needed = {name for name in OPTIONAL if re.search(rf"^import {name}\b", code, re.M)}
    needed |= {name for word, name in ASKED.items() if word in code}
    return sorted(name for name in needed if importlib.util.find_spec(name) is None)


class Examples(unittest.TestCase):
    """Each in a folder of its own, as a user runs it."""

    def run_code(self, path, folder):
        """Run a script and check that it went well."""
        environment = {**os.environ, "PYTHONPATH": str(SOURCE / "scripts"), "BIPOT": PROGRAM,
                       "MPLBACKEND": "Agg"}
        start = ["-c", DRAWING] if ".plot(" in path.read_text(encoding="utf-8") else []
        done = subprocess.run(
            [sys.executable, "-B", *start, path], cwd=folder,
            env=environment, capture_output=True, text=True, timeout=1800, check=False,
        )
        self.assertEqual(done.returncode, 0, f"{path}: {done.stdout}{done.stderr}")
        return done.stdout

    def test_the_page_names_every_example(self):
        page = (SOURCE / "docs" / "python.md").read_text(encoding="utf-8")
        self.assertEqual(sorted(re.findall(r"\(examples/(\w+\.py)\)", page)),
                         [path.name for path in EXAMPLES])

    def test_the_page(self):
        page = (SOURCE / "docs" / "python.md").read_text(encoding="utf-8")
        blocks = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
        self.assertGreater(len(blocks), 8)
        left_out = [names for names in map(missing, blocks) if names]
        code = "".join(block for block in blocks if not missing(block))
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(SOURCE / "input", Path(folder) / "input")
            path = Path(folder) / "page.py"
            path.write_text(code, encoding="utf-8")
            said = self.run_code(path, folder)
        self.assertIn("friction/mu=0.3,n=2.vtkhdf", said)
        self.assertIn("[0 0 0 0 0 0 0 0 0]", said)  # lifted: every point is open
        if left_out:
            print(f"left out, not installed: {left_out}", file=sys.stderr)


def add_example(path):
    """Add the test of an example."""

    def test(self):
        absent = missing(path.read_text(encoding="utf-8"))
        if absent:
            self.skipTest(f"{', '.join(absent)} not installed")
        with tempfile.TemporaryDirectory() as folder:
            self.run_code(path, folder)

    setattr(Examples, f"test_{path.stem}", test)


def cookbook():
    """Return what all tasks of docs/cookbook.md begin with, and the code of each by its number."""
    page = (SOURCE / "docs" / "cookbook.md").read_text(encoding="utf-8")
    before, *tasks = re.split(r"^## ", page, flags=re.M)
    codes = [re.findall(r"^```python\n(.*?)^```", part, re.M | re.S) for part in (before, *tasks)]
    if len(tasks) != 12 or any(len(code) != 1 for code in codes):
        raise AssertionError("docs/cookbook.md: twelve tasks with one piece of code each")
    return codes[0][0], {task.split(".")[0]: code for task, (code,) in zip(
        tasks, codes[1:], strict=True)}


def add_task(number, first, code):
    """Add the test of a task of the cookbook."""

    def test(self):
        self.assertIn("assert ", code)
        absent = missing(code)
        if absent:
            self.skipTest(f"{', '.join(absent)} not installed")
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(SOURCE / "input", Path(folder) / "input")
            path = Path(folder) / "task.py"
            path.write_text(f"{first}\n{code}", encoding="utf-8")
            self.run_code(path, folder)

    setattr(Examples, f"test_cookbook_{number}", test)


for example in EXAMPLES:
    add_example(example)
FIRST, TASKS = cookbook()
for name, task in TASKS.items():
    add_task(name, FIRST, task)

if __name__ == "__main__":
    unittest.main()
