"""The program units of a Fortran file: what begins and ends where, and which names stand in it.

It reads what check_layers.logical_statements makes of a file. What belongs to an `include` file of
the project is read with the file that includes it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from check_layers import USE, Statement, logical_statements

_BEGIN = re.compile(
    r"(?P<prefix>[\w ,():*=]*?\b)??(?P<kind>subroutine|function|program|module) (?P<name>\w+)"
    r"(?P<rest>.*)$"
)
_END = re.compile(r"end( ?(subroutine|function|program|module|procedure)\b.*)?$")
_TYPE = re.compile(r"type( ?,.*::| ?::| (?!is\b)\w+$)")
_DECLARES = re.compile(
    r"(integer|real|complex|logical|character|double ?precision|type ?\(|class ?\(|procedure ?\()"
)


@dataclass
class Imported:
    """One name of a `use ..., only:` list."""

    name: str  # as the file knows it
    original: str  # as its module knows it
    module: str
    path: Path
    line: int


@dataclass
class Unit:
    """A module, program or procedure."""

    kind: str
    name: str
    path: Path
    first: int  # its lines in the file
    last: int = 0
    file: Path = Path()  # the one that was read; `path` may be a file that it includes
    host: Unit | None = None
    bound_to_c: bool = False
    imports: list[Imported] = field(default_factory=list)
    bare_uses: list[str] = field(default_factory=list)
    declared: set[str] = field(default_factory=set)  # with the dummy arguments
    mentioned: set[str] = field(default_factory=set)  # outside `use`, units within left out
    components: set[str] = field(default_factory=set)  # behind a `%`
    public: dict[str, int] = field(default_factory=dict)  # names and their lines
    types: set[str] = field(default_factory=set)
    generics: set[str] = field(default_factory=set)
    bindings: dict[str, int] = field(default_factory=dict)  # type-bound names and their lines


def entities(text: str) -> list[str]:
    """Return the parts of a list that commas separate, brackets respected."""
    parts, depth = [""], 0
    for c in text:
        depth += (c in "([") - (c in ")]")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    return [part.strip() for part in parts if part.strip()]


def read_units(path: Path, folders: list[Path] | None = None) -> list[Unit]:
    """Return the units of a file in the order in which they begin."""
    return _Reader(path, folders or [path.parent]).read()


class _Reader:
    """Walks through the statements of one file."""

    def __init__(self, path: Path, folders: list[Path]) -> None:
        self.path = path
        self.folders = folders
        self.units: list[Unit] = []
        self.inside: Unit | None = None
        self.in_type = False
        self.bound = False  # behind the `contains` of a type

    def read(self) -> list[Unit]:
        """Read the file, and what it includes."""
        self.read_statements(self.path)
        return self.units

    def read_statements(self, path: Path) -> None:
        """Read the statements of the file or of one that it includes."""
        for s in logical_statements(path.read_text(encoding="utf-8", errors="replace")):
            if s.code.startswith("include") and s.strings:
                for folder in [path.parent, *self.folders]:
                    if (folder / s.strings[0]).is_file():
                        self.read_statements(folder / s.strings[0])
                        break
            else:
                self.read_statement(path, s)

    def read_statement(self, path: Path, s: Statement) -> None:
        """Read one statement."""
        if _END.match(s.code):
            if self.inside is not None:
                self.inside.last = s.line
                self.inside = self.inside.host
            return
        begin = _BEGIN.match(s.code)
        if begin and "::" not in s.code and not s.code.startswith(("end ", "module procedure")):
            self.begin(path, s, begin)
        elif self.inside is None:
            return
        elif self.in_type:
            self.read_in_type(s)
        elif _TYPE.match(s.code):
            self.in_type, self.bound = True, False
            name = re.search(r"(\w+)$", s.code)
            self.inside.types.add(name[1])
            self.mention(s.code[: name.start()])
        elif (match := USE.match(s.code)) and not re.match(r"use ?[=(%]", s.code):
            self.use(path, s, match)
        else:
            self.read_other(s)

    def begin(self, path: Path, s: Statement, match: re.Match[str]) -> None:
        """Begin a unit."""
        unit = Unit(match["kind"], match["name"], path, s.line, file=self.path, host=self.inside)
        unit.bound_to_c = re.search(r"\bbind ?\( ?c\b", match["rest"]) is not None
        arguments = re.match(r" ?\(([^()]*)\)", match["rest"])
        if arguments:
            unit.declared.update(entities(arguments[1]))
        if self.inside is not None:
            self.mention(match["prefix"] or "")
            self.inside.declared.add(unit.name)
        self.units.append(unit)
        self.inside = unit

    def use(self, path: Path, s: Statement, match: re.Match[str]) -> None:
        """Read a `use` statement."""
        only = re.match(r", ?only ?:(.*)$", match[2] or "")
        if not only:
            self.inside.bare_uses.append(match[1])
            return
        for entry in entities(only[1]):
            name, _, original = (part.strip() for part in entry.partition("=>"))
            if "(" not in name:  # an operator or an assignment is used without its name
                imported = Imported(name, original or name, match[1], path, s.line)
                self.inside.imports.append(imported)

    def read_in_type(self, s: Statement) -> None:
        """Read a statement in the definition of a type."""
        left, colons, right = s.code.partition("::")
        if re.match(r"end ?type\b", s.code):
            self.in_type = False
        elif s.code == "contains":
            self.bound = True
        elif colons and self.bound:
            self.mention(left)
            if s.code.startswith("generic"):  # its name stands for these
                self.inside.components.update(re.findall(r"\w+", right.partition("=>")[2]))
            for entry in entities(right):
                name, _, target = (part.strip() for part in entry.partition("=>"))
                self.mention(target or name)
                if s.code.startswith("procedure"):
                    self.inside.bindings[name] = s.line
        elif colons:
            self.mention(left)
            for entry in entities(right):
                self.mention(re.sub(r"^\w+", "", entry))
        else:
            self.mention(s.code)

    def read_other(self, s: Statement) -> None:
        """Read any other statement."""
        left, colons, right = s.code.partition("::")
        if match := re.match(r"public\b ?(?:::)?(.*)$", s.code):
            for name in entities(match[1]):
                self.inside.public[name] = s.line
            return
        if colons and _DECLARES.match(s.code):
            for entry in entities(right):
                if name := re.match(r"\w+", entry):
                    self.inside.declared.add(name[0])
                    if re.search(r", ?public\b", left):
                        self.inside.public[name[0]] = s.line
                    entry = entry[name.end() :]
                self.mention(entry)
            self.mention(left)
            return
        if match := re.match(r"interface (\w+)$", s.code):
            self.inside.generics.add(match[1])
            return
        self.mention(s.code)

    def mention(self, code: str) -> None:
        """Note the names of a piece of code; a keyword of an argument is no name."""
        self.inside.components.update(re.findall(r"% ?(\w+)", code))
        code = re.sub(r"% ?\w+", "%", code)
        code = re.sub(r"([(,] ?)\w+ ?=(?![=>])", r"\1", code)
        self.inside.mentioned.update(re.findall(r"[a-z]\w*", code))
