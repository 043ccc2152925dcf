#!/usr/bin/env python3
"""Find what the Fortran source does not need: unused imports and unused public procedures.

    check_unused.py [ROOT]

An import is a name of a `use ..., only:` list, in any Fortran file of ROOT; it is used where its
unit, or one within, names it otherwise than in a `use`. A public procedure of a module of ROOT/src
is used where another file imports it; public types and constants are left out, since a component of
a public type need not be named and constants come in sets, and so are procedures that C code calls
by their binding name. A procedure bound to a type is used where anything calls it by `%`. Prints
`file:line: message` for each finding. Procedures that files outside src alone import (tests,
measurements) are listed as notes, which are no findings.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from fortran_units import Unit, read_units

SUFFIXES = {".f90", ".F90", ".pf"}


def fortran_files(root: Path) -> list[Path]:
    """Return the Fortran files of a tree, those that a build made left out."""
    return [
        path
        for path in sorted(root.rglob("*"))
        if path.suffix in SUFFIXES and "build" not in path.relative_to(root).parts
    ]


def within(unit: Unit, units: list[Unit]) -> Iterator[Unit]:
    """Yield the unit and all units in it."""
    yield unit
    for other in units:
        if other.host is unit:
            yield from within(other, units)


def is_used(name: str, unit: Unit, units: list[Unit]) -> bool:
    """Say whether a unit or one within mentions a name that it does not declare itself."""
    if name in unit.mentioned or name in unit.public:
        return True
    return any(
        is_used(name, inner, units)
        for inner in units
        if inner.host is unit
        and name not in inner.declared
        and all(name != entry.name for entry in inner.imports)
    )


class Checker:
    """Checks one tree and collects what it finds."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.findings: list[str] = []
        self.notes: list[str] = []
        self.files = {path: read_units(path, [root / "src"]) for path in fortran_files(root)}

    def report(self, path: Path, line: int, message: str) -> None:
        """Note a finding, once: a file may be included twice."""
        finding = f"{path.relative_to(self.root).as_posix()}:{line}: {message}"
        if finding not in self.findings:
            self.findings.append(finding)

    def run(self) -> list[str]:
        """Check everything; return the findings."""
        for units in self.files.values():
            for unit in units:
                for entry in unit.imports:
                    if not is_used(entry.name, unit, units):
                        self.report(
                            entry.path,
                            entry.line,
                            f"{entry.name} of {entry.module} is imported and not used",
                        )
        importers = self.importers()
        called: set[str] = set().union(
            *(unit.components for units in self.files.values() for unit in units)
        )
        for path, units in self.files.items():
            if path.is_relative_to(self.root / "src"):
                for unit in units:
                    self.check_public(path, unit, importers)
                    self.check_bindings(unit, called)
        return self.findings

    def importers(self) -> dict[tuple[str, str], set[Path]]:
        """Return which files import a name: by module and name."""
        found: dict[tuple[str, str], set[Path]] = {}
        for path, units in self.files.items():
            for unit in units:
                for entry in unit.imports:
                    found.setdefault((entry.module, entry.original), set()).add(path)
                for module in unit.bare_uses:  # all that the unit mentions may come from there
                    for inner in within(unit, units):
                        for name in inner.mentioned:
                            found.setdefault((module, name), set()).add(path)
        return found

    def check_public(
        self, path: Path, unit: Unit, importers: dict[tuple[str, str], set[Path]]
    ) -> None:
        """Check that other files use the procedures that a module makes public."""
        for name, line in unit.public.items():
            users = importers.get((unit.name, name), set()) - {path}
            if any(user.is_relative_to(self.root / "src") for user in users):
                continue
            if not self.is_procedure(name, unit):
                continue
            if not users:
                self.report(path, line, f"{name} is public, and no other file uses it")
                continue
            here = path.relative_to(self.root).as_posix()
            names = ", ".join(sorted(user.relative_to(self.root).as_posix() for user in users))
            own = self.files[path]
            called = any(is_used(name, inner, own) for inner in own if inner.host is unit)
            use = "no other file of src uses it" if called else "src does not use it at all"
            self.notes.append(f"{here}:{line}: note: {name} is public, {use}, only {names}")

    def is_procedure(self, name: str, unit: Unit) -> bool:
        """Say whether a name of a module is that of a procedure, not one that C code calls."""
        if name in unit.types:
            return False
        if name in unit.generics:
            return True
        own = [u for u in self.files[unit.file] if u.host is unit and u.name == name]
        if own:
            return not own[0].bound_to_c
        entry = next((e for e in unit.imports if e.name == name), None)
        if entry is None:
            return False
        return any(
            self.is_procedure(entry.original, other)
            for units in self.files.values()
            for other in units
            if other.kind == "module" and other.name == entry.module
        )

    def check_bindings(self, unit: Unit, called: set[str]) -> None:
        """Check that something calls the procedures that are bound to types."""
        for name, line in unit.bindings.items():
            if name not in called:
                self.report(unit.path, line, f"{name} is bound to a type, and nothing calls it")


def main(arguments: list[str]) -> int:
    """Check the tree; return the exit status."""
    default = Path(__file__).resolve().parents[2]
    checker = Checker(Path(arguments[0]) if arguments else default)
    findings = checker.run()
    for finding in findings + checker.notes:
        print(finding)
    print(f"{len(checker.files)} files, {len(findings)} findings")
    return 1 if findings or not checker.files else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
