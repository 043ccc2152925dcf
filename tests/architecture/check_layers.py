#!/usr/bin/env python3
"""Check the source against the architecture: src/CMakeLists.txt lists rooms and files lowest first.

    check_layers.py [SRC]

A file may use only modules of files listed before it, and only of the rooms its own room may see,
which `add_room` names there (the build refuses others too, later and in more words): a room is a
folder of src, or a folder within one. Each outside library has one file that sees it, HDF5 a few
that share a prefix; modules hide their names and hold no variables; only the main
program stops; only its readers change the scene; and no `associate` name stands for a text that a
function makes, which gfortran 12 frees twice. Prints `file:line: message` for each violation.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

MAIN = "app/main.f90"
# What a room, or a file, sees of another room: these files and no more.
SEES_ONLY = {
    ("contact/solvers", "model"): {
        "model/controls.f90", "model/friction_laws.f90", "model/increment_report.f90",
    },
    # one list for deck and command line
    ("console", "deck/cards"): {"deck/cards/solver_options.f90"},
    ("output", "geometry"): {"geometry/obstacle_shapes.f90"},
    ("run", "hdf5"): {"hdf5/hdf5_files.f90"},  # the version of the library
}
PLAN = "model/plan.f90"
PLAN_ROOMS = {"model", "plan", "results", "progress", "acceptance", "run"}
# Words that stand in these files alone: what they mean is decided there.
WORDS = {
    r"obstacle_(plane|sphere|cylinder|facets)|obstacles?(\(\w+\))?%kind": {
        "model/obstacles.f90",
        "geometry/obstacle_shapes.f90",
        "certificate/obstacle_gaps.f90",  # of its own: it shares nothing
        "deck/cards/read_analytical.f90", "deck/cards/read_obstacles.f90",
        "deck/cards/read_gap_elements.f90",  # a node before a plane through another
    },
    # contact points are placed pair by pair: all else asks a placement
    "locate_point": {
        "geometry/obstacle_shapes.f90",
        "contact/geometry/placement.f90",
        "contact/geometry/candidate_points.f90",
        "contact/geometry/nodes_behind.f90",  # of nodes that are no points
        "meshing/adjust.f90",
        "meshing/general_pairs.f90",  # which faces look at an obstacle
        "constraints/plane_mesh.f90",
        "contact/mirror_scene.f90",  # of places and their mirror images
    },
}
# How many nodes an element has is told by the table of cells: lists of 8 or 24 stand in rooms that
# are below it, in kernels, and in what cuts hexahedra.
KNOW_HEXAHEDRA = {
    "base",
    "machine",
    "algebra",
    "hdf5",
    "cells",
    "certificate",
    "elements",
    "model/block_mesh.f90",
    "model/refine_elements.f90",
    "model/local_refinement.f90",
    "meshing/cut_mesh.f90",
    "meshing/refine_locally.f90",
    "meshing/refine_mesh.f90",
}
OF_HEXAHEDRA = re.compile(
    r"^(real|integer|logical)\b.*\(([36], ?)?(8|24)\b[^_.]|^do \w+ = 1, ?(8|24)$"
    r"|\ballocate ?\(.*\(([36], ?)?(8|24), |\[8, ?\w+\]"
)
# The scene is what the user said: these read it, from the deck and from the options, and no other
# file changes it. What the program may choose of it (model/choices.f90) is read where it is chosen.
SCENE_READERS = {
    "deck/read_deck.f90", "deck/named_sets.f90", "run/prepare_scene.f90",
    "contact/take_as_rigid.f90", "contact/mirror_scene.f90",  # of options, for prepare_scene
    "model/part_of_scene.f90",
}  # fmt: skip
WORDS[r"scene%(precision|contact%(tolerance|compliance))"] = SCENE_READERS | {
    "model/finite_strain_limits.f90", "model/dynamic_limits.f90",  # refuse decks
}
# A dummy argument that gives a scene back; a component that is given a value.
SCENE_CHANGED = re.compile(r"type ?\(scene_t\).*intent ?\((in ?)?out|(scene|deck)%[^=]*=(?!=)")
# Types whose components no other file sees; the compiler holds others to it.
OPAQUE = {
    "contact/solvers/compliance.f90": "compliance_t",  # the entries of W
}
# The one file that may hold module variables: what the handlers of signals set, and remove.
SIGNAL_FILE = "machine/system.f90"

# Functions of the language whose texts are as long as it turns out.
TEXT_INTRINSICS = {"adjustl", "adjustr", "repeat"}
FUNCTION = re.compile(r"(?:[\w ,():*=]* )?function (\w+) ?\(.*?\)(?: ?result ?\((\w+)\))?")

INTRINSIC = {
    "iso_fortran_env",
    "iso_c_binding",
    "ieee_arithmetic",
    "ieee_exceptions",
    "ieee_features",
}


@dataclass(frozen=True)
class Library:
    """An outside library and the one file that may see it, or the few."""

    name: str
    home: str  # a path; `*` for any part of the file's name
    modules: str  # of its Fortran modules, a pattern
    code: str  # of what calls it, a pattern outside strings
    strings: str  # of include files and binding names, a pattern inside strings

    def lives_in(self, path: str) -> bool:
        """Say whether the file may see the library."""
        return fnmatchcase(path, self.home)


LIBRARIES = [
    Library(
        "MUMPS",
        "factors/mumps_*.f90",
        r"[sdcz]?mumps\w*",
        r"\b[sdcz]mumps(_\w+)?\b",
        r"[sdcz]mumps",
    ),
    Library("HDF5", "hdf5/hdf5_*.f90", r"hdf5|h5\w+", r"\bcall\s+h5\w+", r"^h5\w+$|^hdf5"),
    Library(
        "MPI",
        "machine/parallel.f90",
        r"mpi(_f08)?",
        r"\bcall\s+mpi_\w+",
        r"^mpif?(\.h|_\w+$)",
    ),
    Library(
        "PETSc",
        "iteration/petsc_*.f90",
        r"petsc\w*(?<!_mod)",
        r"\bcall\s+(petsc|mat|vec|pc|ksp)_\w+",
        r"^(petsc|mat(create|destroy|set|assembly|null|shell|dup|copy|axpy|ptap|update)"
        r"|vec(create|destroy|get|restore|ghost|scatter)|pc(mg|create|destroy|set|apply|shell)"
        r"|ksp(set|get))",
    ),
    Library("zlib", "machine/checksum.f90", r"zlib\w*", r"\bzlib_\w+", r"^(crc32|adler32)"),
    Library("METIS", "equations/metis_graph.f90", r"metis\w*", r"\bmetis_\w+", r"^metis_"),
    Library("SCOTCH", "factors/scotch_graph.f90", r"scotch\w*", r"\bscotchf\w+", r"^scotch"),
]
# The C library is declared in one file, which only its own room sees, and the main program.
LIBC = "machine/libc.f90"
# Reads numbers as C does, below every room that has the machine.
DECLARES_STRTOD = "deck/language/numbers.f90"

TYPE_SPEC = re.compile(
    r"(integer|real|complex|logical|character|double\s*precision)\b"
    r"|(type|class|procedure)\s*\("
)
USE = re.compile(r"use(?:\s*,\s*(?:non_)?intrinsic\s*::\s*|\s*::\s*|\s+)(\w+)\s*(,.*)?$")
STOP = re.compile(
    r"(error\s*)?stop\b(?!\s*[=%(])|(error\s*)?stop\s*\(.*\)$|call\s+(c_)?(exit|abort)\b"
)


@dataclass
class Statement:
    """One Fortran statement, in lower case, without comments and continuations."""

    line: int
    code: str  # strings blanked
    strings: list[str]  # the contents of its strings


@dataclass
class Source:
    """One file of the list."""

    path: str  # relative to src
    position: int
    statements: list[Statement] = field(default_factory=list)

    @property
    def room(self) -> str:
        """The folder, or the folder within a folder."""
        return self.path.rpartition("/")[0]

    @property
    def module(self) -> str:
        """The name its module must have."""
        return Path(self.path).stem + "_mod"


def logical_statements(text: str) -> list[Statement]:
    """Split free-form Fortran into statements."""
    statements: list[Statement] = []
    code: list[str] = []  # of the statement being read
    strings: list[str] = []
    literal: list[str] = []
    quote = ""
    start = 0
    continued = False

    def close() -> None:
        joined = "".join(code).strip()
        if joined:
            statements.append(Statement(start, re.sub(r"\s+", " ", joined), list(strings)))
        code.clear()
        strings.clear()

    for number, raw in enumerate(text.lower().splitlines(), start=1):
        line = raw
        stripped = line.lstrip()
        if stripped.startswith("#") or (not quote and stripped.startswith("!")):
            continue
        if continued and not stripped:
            continue
        if continued and stripped.startswith("&"):
            line = stripped[1:]
        elif continued and quote:
            line = stripped
        if not continued:
            start = number
        continued = False
        for i, c in enumerate(line):
            # In a string, '&' continues only at the very end: a '!' there is no comment.
            if c == "&":
                rest = line[i + 1 :] if quote else line[i + 1 :].split("!")[0]
                if not rest.strip():
                    continued = True
                    break
            if quote:
                if c == quote:
                    quote = ""
                    strings.append("".join(literal))
                    literal.clear()
                    code.append(c)
                else:
                    literal.append(c)
            elif c == "!":
                break
            elif c == ";":
                close()
                start = number
            else:
                if c in "'\"":
                    quote = c
                code.append(c)
        if not continued:
            quote = ""
            literal.clear()
            close()
        else:
            # A continuation splits tokens only in strings, where code is blank anyway.
            code.append("" if quote else " ")
    close()
    return statements


@dataclass
class Room:
    """What src/CMakeLists.txt says of a room."""

    name: str
    line: int
    sees: set[str]  # rooms, besides itself
    files: list[tuple[int, str]]  # lines and paths, in order


def rooms_of(text: str) -> list[Room]:
    """Return the rooms that src/CMakeLists.txt adds, in order."""
    # Comments are blanked, so that every word stays on its line.
    text = re.sub(r"#[^\n]*", "", text)
    rooms = []
    for command in re.finditer(r"^add_room\s*\(([^()]*)\)", text, re.MULTILINE):
        name, *words = re.finditer(r"\S+", command[1])
        room = Room(name[0], text.count("\n", 0, command.start()) + 1, set(), [])
        into = ""
        for word in words:
            if word[0] in ("SEES", "FILES"):
                into = word[0]
            elif into == "SEES":
                room.sees.add(word[0])
            elif into == "FILES":
                line = text.count("\n", 0, command.start(1) + word.start()) + 1
                room.files.append((line, word[0]))
        rooms.append(room)
    return rooms


def after_if(code: str) -> str:
    """Return the statement behind a label and a one-line `if (...)`."""
    code = re.sub(r"^\d+ ", "", code)
    if not re.match(r"if ?\(", code):
        return code
    depth = 0
    for i, c in enumerate(code):
        depth += (c == "(") - (c == ")")
        if c == ")" and depth == 0:
            return code[i + 1 :].strip()
    return code


def n_entities(declaration: str) -> int:
    """Count the variables of a declaration."""
    depth = 0
    count = 1
    for c in declaration.split("::")[-1]:
        depth += (c in "([") - (c in ")]")
        count += c == "," and depth == 0
    return count


def texts_of(statements: list[Statement]) -> set[str]:
    """Return the functions whose result is a text of a length that is not constant."""
    found = set()
    name = result = None
    for s in statements:
        if (match := FUNCTION.match(s.code)) and not s.code.startswith("end"):
            name, result = match[1], match[2] or match[1]
        elif name and (match := re.match(r"character ?\((.*?)\)(?: ?,.*?)? ?:: ?(.*)", s.code)):
            if not match[1].isdigit() and re.search(rf"\b{result}\b", match[2]):
                found.add(name)
        elif re.match(r"end ?function", s.code):
            name = None
    return found


class Checker:
    """Checks one source tree and collects the violations."""

    def __init__(self, src: Path) -> None:
        self.src = src
        self.may_use: dict[str, set[str]] = {}
        self.violations: list[str] = []
        self.sources: dict[str, Source] = {}
        self.by_module: dict[str, Source] = {}
        self.text_functions: set[str] = set()

    def report(self, path: str, line: int, message: str) -> None:
        """Note a violation."""
        self.violations.append(f"{self.src / path}:{line}: {message}")

    def run(self) -> list[str]:
        """Check everything; return the violations."""
        self.read_list()
        self.text_functions = TEXT_INTRINSICS.union(
            *(texts_of(source.statements) for source in self.sources.values())
        )
        for source in self.sources.values():
            self.check_module(source)
            self.check_uses(source)
            self.check_statements(source)
            self.check_c_library(source)
        return self.violations

    def read_list(self) -> None:
        """Read the list and the files, and compare it with the folders."""
        cmake = "CMakeLists.txt"
        if not (self.src / cmake).is_file():
            self.report(cmake, 1, "there is no such file")
            return
        rooms = rooms_of((self.src / cmake).read_text(encoding="utf-8"))
        self.may_use = {room.name: room.sees for room in rooms}
        entries = [(line, path, room.name) for room in rooms for line, path in room.files]
        for line, path, room in entries:
            if path in self.sources:
                self.report(cmake, line, f"{path} is listed twice")
            elif path.rpartition("/")[0] != room:
                self.report(cmake, line, f"{path} is no file of the room {room}")
            elif not (self.src / path).is_file():
                self.report(cmake, line, f"{path} is listed but absent")
            else:
                text = (self.src / path).read_text(encoding="utf-8")
                source = Source(path, len(self.sources), logical_statements(text))
                self.sources[path] = source
                if path != MAIN:
                    if source.module in self.by_module:
                        self.report(cmake, line, f"{path}: another file of that name is listed")
                    self.by_module[source.module] = source
        if not self.sources and not self.violations:
            self.report(cmake, 1, "lists no source file")
        listed = {path for _, path, _ in entries}
        for file in sorted(self.src.rglob("*.[fF]90")):
            path = file.relative_to(self.src).as_posix()
            if path not in listed:
                self.report(path, 1, "is not listed in src/CMakeLists.txt")

    def check_edges(self) -> None:
        """Check that each room uses all rooms that it sees: links are no more than is needed."""
        used = {room: {room} for room in self.may_use}
        for source in self.sources.values():
            names = {match[1] for s in source.statements if (match := USE.match(s.code))}
            used[source.room] |= {self.by_module[n].room for n in names & set(self.by_module)}
        for room, sees in self.may_use.items():
            for other in sorted(sees - used[room]):
                self.report("CMakeLists.txt", 1, f"{room} sees {other} and uses none of it")

    def check_module(self, source: Source) -> None:
        """Check that the file holds one module, closed and without variables."""
        statements = source.statements
        starts = [
            (i, match[1])
            for i, s in enumerate(statements)
            if (match := re.match(r"module (\w+)$", s.code))
        ]
        if source.path == MAIN:
            if starts:
                self.report(source.path, statements[starts[0][0]].line, "holds a module")
            if not any(s.code.startswith("program ") for s in statements):
                self.report(source.path, 1, "holds no program")
            return
        for s in statements:
            if re.match(r"program \w+$|submodule ?\(", s.code):
                self.report(source.path, s.line, "only a module may stand here")
        if len(starts) != 1:
            self.report(source.path, 1, f"holds {len(starts)} modules instead of one")
            return
        first, name = starts[0]
        if name != source.module:
            line = statements[first].line
            self.report(source.path, line, f"the module must be named {source.module}")
        self.check_specification(source, first)

    def check_specification(self, source: Source, first: int) -> None:
        """Check the specification part of the module that starts at statement `first`."""
        module_line = source.statements[first].line
        inside = 0  # depth in type, interface and enum blocks
        implicit_none = private = False
        variables: list[Statement] = []
        for s in source.statements[first + 1 :]:
            code = s.code
            if re.match(r"end ?(type|interface|enum)\b", code):
                inside -= 1
            elif re.match(r"type( ?,| ?::| (?!is\b)\w+$)|(abstract )?interface\b|enum ?,", code):
                inside += 1
            elif inside:
                continue
            elif code == "contains" or re.match(r"end( ?module\b|$)", code):
                break
            elif code.startswith("implicit none"):
                implicit_none = True
            elif code == "private":
                private = True
            elif re.match(r"(save|common|equivalence|data|namelist)\b", code):
                self.report(source.path, s.line, f"module variables: '{code.split()[0]}'")
            elif TYPE_SPEC.match(code):
                attributes = code.split("::")[0]
                if not re.search(r", ?parameter\b", attributes):
                    variables.append(s)
        if not implicit_none:
            self.report(source.path, module_line, "the module has no 'implicit none'")
        if not private:
            self.report(source.path, module_line, "the module has no 'private'")
        flags = sum(n_entities(s.code) for s in variables)
        if source.path == SIGNAL_FILE and flags == 2:
            return
        for s in variables:
            self.report(source.path, s.line, f"module variable: '{s.code}'")

    def check_uses(self, source: Source) -> None:
        """Check every `use` of the file."""
        for s in source.statements:
            match = USE.match(s.code)
            if not match or re.match(r"use ?(=|\()", s.code):
                continue
            name, rest = match[1], match[2] or ""
            if name in INTRINSIC:
                continue
            if self.check_library(source, s.line, name):
                continue
            used = self.by_module.get(name)
            if used is None:
                self.report(source.path, s.line, f"use of an unknown module {name}")
                continue
            if not re.match(r", ?only ?:", rest):
                self.report(source.path, s.line, f"use of {name} without 'only'")
            self.check_layer(source, s.line, used)

    def check_library(self, source: Source, line: int, name: str) -> bool:
        """Say whether `name` is a module of an outside library; check who uses it."""
        if name in self.by_module:
            return False
        for library in LIBRARIES:
            if re.fullmatch(library.modules, name):
                if not library.lives_in(source.path):
                    self.report(source.path, line, f"only {library.home} may see {library.name}")
                return True
        return False

    def check_layer(self, source: Source, line: int, used: Source) -> None:
        """Check the use of one project file by another."""

        def refuse(reason: str) -> None:
            self.report(source.path, line, f"use of {used.module}: {reason}")

        if used.position >= source.position:
            refuse("it is not listed before this file")
        if used.room not in self.may_use[source.room] | {source.room}:
            refuse(f"{source.room} may not use {used.room}")
        seen = SEES_ONLY.get((source.room, used.room))
        if seen is not None and used.path not in seen:
            refuse(f"{source.room} may use of {used.room} only {', '.join(sorted(seen))}")
        if used.path == LIBC and source.room != "machine" and source.path != MAIN:
            refuse(f"only machine and {MAIN} may see the C library")
        if used.path == PLAN and source.room not in PLAN_ROOMS:
            refuse(f"{source.room} may not see the plan")

    def check_c_library(self, source: Source) -> None:
        """Check that no other file declares procedures of the C library."""
        if source.path == LIBC:
            return
        inside = False
        for s in source.statements:
            if re.match(r"(abstract )?interface\b", s.code):
                inside = True
            elif re.match(r"end ?interface\b", s.code):
                inside = False
            elif inside and re.search(r"\bbind ?\( ?c ?,", s.code):
                name = s.strings[0]
                known = any(re.search(library.strings, name) for library in LIBRARIES)
                if not known and (source.path, name) != (DECLARES_STRTOD, "strtod"):
                    self.report(source.path, s.line, f"only {LIBC} may declare '{name}'")

    def check_statements(self, source: Source) -> None:
        """Check who stops, who calls an outside library, and who decides on kinds."""
        opaque = OPAQUE.get(source.path)
        if opaque is not None:
            pairs = zip(source.statements, source.statements[1:], strict=False)
            if not any(
                re.match(rf"type\b.*\b{opaque}$", s.code) and after.code == "private"
                for s, after in pairs
            ):
                self.report(source.path, 1, f"the components of {opaque} must be private")
        for s in source.statements:
            if source.path != MAIN and STOP.match(after_if(s.code)):
                self.report(source.path, s.line, f"only {MAIN} may stop the program")
            if s.code.startswith("associate"):
                for name in re.findall(r"=> ?(?:trim ?\( ?)*(\w+) ?\(", s.code):
                    if name in self.text_functions:
                        message = f"no associate name may stand for the text that {name} makes"
                        self.report(source.path, s.line, f"{message}: gfortran 12 frees it twice")
            if not {source.path, source.room} & KNOW_HEXAHEDRA and OF_HEXAHEDRA.search(s.code):
                self.report(source.path, s.line, "8 or 24 nodes: ask the table of cells")
            if source.path not in SCENE_READERS and SCENE_CHANGED.match(after_if(s.code)):
                readers = ", ".join(sorted(SCENE_READERS))
                self.report(source.path, s.line, f"only {readers} may change a scene")
            is_use = USE.match(s.code) is not None
            for word, homes in WORDS.items():
                if source.path not in homes and (found := re.search(rf"\b({word})\b", s.code)):
                    at = ", ".join(sorted(homes))
                    self.report(source.path, s.line, f"'{found[0]}' may stand only in {at}")
            binds = re.match(r"include\b", s.code) or re.search(r"\bbind ?\(", s.code)
            for library in LIBRARIES:
                if library.lives_in(source.path):
                    continue
                seen = not is_use and re.search(library.code, s.code) is not None
                if binds and any(re.search(library.strings, t) for t in s.strings):
                    seen = True
                if seen:
                    self.report(source.path, s.line, f"only {library.home} may see {library.name}")


def main(arguments: list[str]) -> int:
    """Check the tree; return the exit status."""
    default = Path(__file__).resolve().parents[2] / "src"
    checker = Checker(Path(arguments[0]) if arguments else default)
    checker.run()
    checker.check_edges()
    violations = checker.violations
    for violation in violations:
        print(violation)
    print(f"{len(checker.sources)} files, {len(violations)} violations")
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
