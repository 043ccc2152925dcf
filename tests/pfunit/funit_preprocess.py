#!/usr/bin/env python3
"""Turn a `.pf` file into Fortran for the in-tree stand-in of pFUnit.

    funit_preprocess.py INPUT.pf OUTPUT.F90

The output has one line for each line of the input, so that compiler messages and failures name
the line of the `.pf` file; the subroutine that runs the tests follows at the end.

The stand-in must accept no more than real pFUnit does. pFUnit's own preprocessor copies a line
it does not recognise and leaves the error to the compiler; here every such line is an error
with its file and line.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

# What each assertion takes: the number of operands, then the keywords it knows and needs.
TOLERANCE = {"tolerance", "message"}
MESSAGE = {"message"}
COMPARISONS = {
    "assertequal": TOLERANCE,
    "assertnotequal": TOLERANCE,
    "assertrelativelyequal": TOLERANCE,
    "assertlessthan": TOLERANCE,
    "assertlessthanorequal": TOLERANCE,
    "assertgreaterthan": TOLERANCE,
    "assertgreaterthanorequal": TOLERANCE,
}
CONDITIONS = {"asserttrue": ".true.", "assertfalse": ".false."}
CLASSES = {"assertisnan", "assertisfinite"}
ASSERTIONS = {*COMPARISONS, *CONDITIONS, *CLASSES, "assertfail"}

NAME = r"[a-z]\w*"
SUBROUTINE = re.compile(rf"\s*subroutine\s+({NAME})\s*(\(\s*\))?\s*(!.*)?$", re.IGNORECASE)
MODULE = re.compile(rf"\s*module\s+({NAME})\s*(.*)$", re.IGNORECASE)
# `module procedure x` and its like start with a second keyword, and are no module statement.
MODULE_PREFIX = {"procedure", "subroutine", "function", "pure", "elemental", "recursive"}
USE = re.compile(r"\s*use\b[\s,:\w]*?\b(p?funit)\b\s*(.*)$", re.IGNORECASE)
KEYWORD = re.compile(rf"\s*({NAME})\s*=(?!=)", re.IGNORECASE)


class PfError(Exception):
    """A line that pFUnit, or the subset used here, does not take."""


@dataclass
class Test:
    """One `@test` subroutine and the line it starts on."""

    name: str
    line: int
    disabled: bool


@dataclass
class Module:
    """What the `.pf` file declares, gathered while its lines are turned."""

    name: str = ""
    uses_funit: bool = False
    tests: list[Test] = field(default_factory=list)
    before: str = ""
    after: str = ""


def blank_strings(line: str, quote: str = "") -> tuple[str, int, str]:
    """Blank the inside of character literals.

    Returns the line (same length), where its comment starts (its length if it has none) and the
    quote that is still open at its end. `quote` is the one left open by the line before.
    """
    out = []
    for i, c in enumerate(line):
        if quote:
            if c == quote:
                quote = ""
                out.append(c)
            else:
                out.append(" ")
        elif c in "'\"":
            quote = c
            out.append(c)
        elif c == "!":
            return "".join(out) + line[i:], i, ""
        else:
            out.append(c)
    if quote and not line.rstrip().endswith("&"):
        quote = ""
    return "".join(out), len(line), quote


def split_arguments(text: str, blanked: str) -> list[str]:
    """Split at the commas outside brackets and strings."""
    parts, depth, start = [], 0, 0
    for i, c in enumerate(blanked):
        if c in "([":
            depth += 1
        elif c in ")]":
            depth -= 1
        elif c == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    parts.append(text[start:])
    return [p.strip() for p in parts]


def parse_arguments(name: str, rest: str) -> list[str]:
    """Return the arguments of an assertion, given what follows its name on the line."""
    blanked, comment, _ = blank_strings(rest)
    if comment < len(rest):
        raise PfError(f"@{name}: a comment may not follow an assertion")
    code = blanked.rstrip()
    if code.endswith("&"):
        raise PfError(f"@{name}: an assertion must stand on one line, without '&'")
    if not code.lstrip().startswith("("):
        raise PfError(f"@{name}: expected '(' after the name")
    start = code.index("(")
    depth = 0
    for i in range(start, len(code)):
        if code[i] in "([":
            depth += 1
        elif code[i] in ")]":
            depth -= 1
            if depth == 0:
                break
    else:
        raise PfError(f"@{name}: the ')' is missing")
    if i != len(code) - 1:
        raise PfError(f"@{name}: nothing may follow an assertion on its line")
    inner = slice(start + 1, i)
    if not code[inner].strip():
        return []
    return split_arguments(rest[inner], code[inner])


def sort_arguments(
    name: str, arguments: list[str], n_operands: int, keywords: set[str]
) -> tuple[list[str], dict[str, str]]:
    """Split the arguments into operands and keyword arguments, and check both."""
    operands: list[str] = []
    given: dict[str, str] = {}
    for argument in arguments:
        if not argument:
            raise PfError(f"@{name}: empty argument")
        match = KEYWORD.match(blank_strings(argument)[0])
        if match:
            key = match[1].lower()
            if key not in keywords:
                raise PfError(f"@{name}: unknown keyword '{key}'")
            if key in given:
                raise PfError(f"@{name}: '{key}' is given twice")
            given[key] = argument[match.end() :].strip()
        elif given:
            raise PfError(f"@{name}: an operand may not follow a keyword argument")
        else:
            operands.append(argument)
    if len(operands) < n_operands:
        raise PfError(f"@{name}: expected {n_operands} operands, found {len(operands)}")
    if len(operands) > n_operands:
        # pFUnit takes some of these by position, but not all, and not on all kinds.
        hint = " or ".join(f"{k}=" for k in sorted(keywords, reverse=True)) or "nothing"
        raise PfError(f"@{name}: after {n_operands} operand(s) comes {hint}, as a keyword")
    return operands, given


def assertion_call(name: str, rest: str, location: str) -> str:
    """Return the Fortran statement of one assertion."""
    key = name.lower()
    if key not in ASSERTIONS:
        raise PfError(f"unknown annotation '@{name}'")
    arguments = parse_arguments(name, rest)
    if key in COMPARISONS:
        operands, given = sort_arguments(name, arguments, 2, COMPARISONS[key])
        if key == "assertrelativelyequal" and "tolerance" not in given:
            raise PfError(f"@{name}: tolerance= is missing")
        values = [f"funit_values({o})" for o in operands]
        if "tolerance" in given:
            values.append(f"tolerance=funit_values({given['tolerance']})")
        procedure = "funit_compare"
    elif key in CONDITIONS:
        operands, given = sort_arguments(name, arguments, 1, MESSAGE)
        values = [CONDITIONS[key], *operands]
        procedure = "funit_condition"
    elif key in CLASSES:
        operands, given = sort_arguments(name, arguments, 1, MESSAGE)
        values = [f"funit_values({operands[0]})"]
        procedure = "funit_classify"
    else:
        operands, _ = sort_arguments(name, arguments, 1, set())
        return f"call funit_fail({operands[0]}, location={location})"
    if "message" in given:
        values.append(f"message={given['message']}")
    return f"call {procedure}('{key}', {', '.join(values)}, location={location})"


class Preprocessor:
    """Turns the lines of one `.pf` file, and collects its mistakes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.module = Module()
        self.errors: list[str] = []
        self.waiting = ""  # the annotation whose subroutine must come next
        self.disabled = False

    def error(self, number: int, message: str) -> None:
        """Note a mistake."""
        self.errors.append(f"{self.path}:{number}: {message}")

    def turn(self, text: str) -> str:
        """Return the Fortran text for the text of the `.pf` file."""
        lines = text.splitlines()
        out = [f'#line 1 "{self.path}"']
        quote = ""
        for number, line in enumerate(lines, start=1):
            in_string = bool(quote)
            blanked, comment, quote = blank_strings(line, quote)
            code = blanked[:comment].strip()
            if in_string or not code or code.startswith("#"):
                out.append(line)
                continue
            try:
                out.append(self.turn_line(number, line, code))
            except PfError as mistake:
                self.error(number, str(mistake))
                out.append("")
        self.check_whole(len(lines))
        return "\n".join(out) + "\n" + self.runner()

    def turn_line(self, number: int, line: str, code: str) -> str:
        """Return the Fortran line for one line that is neither empty nor a comment."""
        if code.startswith("@"):
            return self.turn_annotation(number, line)
        if "@" in code:
            raise PfError("'@' must come first on its line (an assertion cannot follow 'if')")
        if self.waiting:
            self.take_subroutine(number, line)
            return line
        match = MODULE.match(line)
        if match and not (match[1].lower() in MODULE_PREFIX and match[2]):
            self.take_module(match[1], match[2])
        match = USE.match(code)
        if match:
            if match[1].lower() != "funit" or match[2]:
                raise PfError("write 'use funit', alone on its line and without 'only'")
            self.module.uses_funit = True
        return line

    def turn_annotation(self, number: int, line: str) -> str:
        """Return the Fortran line for one annotation."""
        match = re.match(r"\s*@(\w*)(.*)$", line)
        assert match is not None
        name, rest = match[1], match[2]
        if name.lower() in ("test", "before", "after", "disable"):
            if rest.strip():
                raise PfError(f"nothing may follow @{name} on its line")
            if name.lower() == "disable":
                if self.waiting != "test":
                    raise PfError("@disable must follow @test")
                self.disabled = True
            elif self.waiting:
                raise PfError(f"@{self.waiting} must be followed by its subroutine")
            else:
                self.waiting = name.lower()
            return f"!@{name}"
        if self.waiting:
            raise PfError(f"@{self.waiting} must be followed by its subroutine")
        location = f"SourceLocation('{self.path.name}', {number})"
        return f"    {assertion_call(name, rest, location)}; if (anyExceptions()) return"

    def take_subroutine(self, number: int, line: str) -> None:
        """Note the subroutine that an annotation announced."""
        waiting, self.waiting = self.waiting, ""
        disabled, self.disabled = self.disabled, False
        match = SUBROUTINE.match(line)
        if not match:
            raise PfError(
                f"@{waiting} must be followed by 'subroutine name()', with no prefix or argument"
            )
        name = match[1]
        if waiting == "test":
            self.module.tests.append(Test(name, number, disabled))
        elif getattr(self.module, waiting):
            raise PfError(f"a second @{waiting}")
        else:
            setattr(self.module, waiting, name)

    def take_module(self, name: str, rest: str) -> None:
        """Note the module; pFUnit finds it by the name of the file."""
        if rest:
            raise PfError("nothing may follow the module's name on its line")
        if self.module.name:
            raise PfError(f"a second module '{name}'")
        self.module.name = name
        if name.lower() != self.path.stem.lower():
            raise PfError(f"the module must be named '{self.path.stem}', as the file")

    def check_whole(self, last: int) -> None:
        """Check what only the end of the file can tell."""
        if self.waiting:
            self.error(last, f"@{self.waiting} must be followed by its subroutine")
        if not self.module.name:
            self.error(1, "there is no module")
        if not self.module.uses_funit:
            self.error(1, "there is no 'use funit'")
        if not self.module.tests and not self.errors:
            self.error(last, "there is no @test")

    def runner(self) -> str:
        """Return the module whose subroutine runs the tests.

        Its local names `suite` and `t`, and the whole `use` of the tests' module, are pFUnit's:
        a public name of the tests that disturbs pFUnit's generated code disturbs this one too.
        """
        module = self.module
        out = [
            f"module Wrap{module.name}",
            "  implicit none",
            "contains",
            f"  subroutine {module.name}_suite(suite)",
            "    use funit",
            f"    use {module.name}",
            "    implicit none",
            "    type(testsuite), intent(inout) :: suite",
            "    type(test) :: t",
            f"    suite%name = '{module.name}_suite'",
        ]
        for test in module.tests:
            arguments = [f"'{test.name}'", test.name]
            if module.before:
                arguments.append(f"setup={module.before}")
            if module.after:
                arguments.append(f"teardown={module.after}")
            if test.disabled:
                arguments.append("disabled=.true.")
            # A private or missing test is an error of the .pf file, at that test.
            out.append(f'#line {test.line} "{self.path}"')
            out.append(f"    call t%define({', '.join(arguments)}); call suite%run(t)")
        out += [f"  end subroutine {module.name}_suite", f"end module Wrap{module.name}", ""]
        return "\n".join(out)


def main(arguments: list[str]) -> int:
    """Run the preprocessor; return the exit status."""
    if len(arguments) != 2:
        print("usage: funit_preprocess.py INPUT.pf OUTPUT.F90", file=sys.stderr)
        return 2
    source, target = Path(arguments[0]), Path(arguments[1])
    preprocessor = Preprocessor(source)
    result = preprocessor.turn(source.read_text(encoding="utf-8"))
    if preprocessor.errors:
        print("\n".join(preprocessor.errors), file=sys.stderr)
        target.unlink(missing_ok=True)
        return 1
    target.write_text(result, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
