#!/usr/bin/env python3
"""Files named in comments and on pages exist: `src/model/mesh.f90`, `model/mesh.f90`, `mesh.f90`.

Looked at are comments of Fortran, Python, shell and CMake files, docstrings of Python modules, and
the pages. A name may have wildcards; one letter or capitals stand for any file.
"""

from __future__ import annotations

import ast
import io
import os
import re
import tokenize
import unittest
from fnmatch import fnmatchcase
from pathlib import Path

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
NAME = re.compile(
    r"(?<![\w./<>*-])([\w.*-]+/)*[\w*-]+\.(f90|pf|py|c|md|sh|cmake)\b(?![\w./-]*[/(])"
)
ANY_FILE = re.compile(r"(.*/)?([A-Za-z]|[A-Z]+)\.\w+")
SKIPPED = {".git", "build"}


def source_files() -> list[str]:
    """Return the paths of all files of the project, below its folder."""
    found = []
    for folder, folders, names in os.walk(ROOT):
        folders[:] = [name for name in folders if name not in SKIPPED]
        found += [(Path(folder) / name).relative_to(ROOT).as_posix() for name in names]
    return found


def python_prose(text: str) -> str:
    """Return the comments of a Python file and its module's docstring."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = [token.string for token in tokens if token.type == tokenize.COMMENT]
    return "\n".join([ast.get_docstring(ast.parse(text)) or "", *comments])


def prose_of(path: str, text: str) -> str:
    """Return what a file says to its reader."""
    if path.endswith(".md"):
        return text
    if path.endswith((".f90", ".pf")):
        return "\n".join(re.findall(r"^[^'\"]*?(!.*)$", text, re.M))
    if path.endswith(".py"):
        return python_prose(text)
    if path.endswith((".sh", "CMakeLists.txt", ".cmake")):
        return "\n".join(re.findall(r"(?:^|\s)#.*$", text, re.M))
    return ""


def is_there(name: str, files: list[str]) -> bool:
    """Say whether a file has this name, from any folder on."""
    if ANY_FILE.fullmatch(name):
        return True
    name = re.sub(r"^(\.\./)+", "", name).lower()
    if "*" in name:
        return any(fnmatchcase(f"/{path}".lower(), f"*/{name}") for path in files)
    return any(f"/{path}".lower().endswith(f"/{name}") for path in files)


class Paths(unittest.TestCase):
    maxDiff = None
    """What the source says of itself is so."""

    def test_named_files_exist(self) -> None:
        files = source_files()
        gone = []
        for path in files:
            prose = ""
            if path.endswith((".md", ".f90", ".pf", ".py", ".sh", ".txt", ".cmake")):
                prose = prose_of(path, (ROOT / path).read_text(encoding="utf-8"))
            gone += [
                f"{path}: {name[0]}"
                for name in NAME.finditer(prose)
                if not is_there(name[0], files)
            ]
        self.assertEqual(gone, [])

    def test_what_is_gone_is_found(self) -> None:
        files = ["src/hdf5/hdf5_files.f90", "tests/base/test_text.pf", "docs/deck.md"]
        for text, gone in [
            ("!> Only files/hdf5_*.f90 see it.", ["files/hdf5_*.f90"]),
            ("!> Only hdf5/hdf5_*.f90 see it, and hdf5_files.f90.", []),
            ("call x('a.f90') ! as src/hdf5/files.f90", []),
            ("call x() ! as src/hdf5/files.f90", ["src/hdf5/files.f90"]),
        ]:
            with self.subTest(text):
                names = [name[0] for name in NAME.finditer(prose_of("src/x.f90", text))]
                self.assertEqual([name for name in names if not is_there(name, files)], gone)


if __name__ == "__main__":
    unittest.main()
