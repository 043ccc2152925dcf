"""Mutants of Fortran source, each of one statement.

A mutant changes one token of one line, or drops one statement. Its name is made of the file, the
procedure, the text of the line and the change, not of the line's number, so that a sample stays
the same while other lines are edited.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass

HEADER = re.compile(
    r"(?:(?:pure|elemental|recursive|impure|logical|integer(?:\(\w+\))?|real\(\w+\)|module|type\(\w+\))\s+)*"
    r"(?:subroutine|function)\s+(\w+)"
)
NOT_RUN = re.compile(
    r"(?:use|implicit|public|private|contains|module|program|interface|abstract|import|type\b\s*[^(]*$|"
    r"end\b|else$|case\s+default|include|procedure|save|sequence|class\s+default|generic)\b"
)
DECLARATION = re.compile(r"(?:integer|real|complex|logical|character|type|class|procedure)\b.*::")
DROPPED = re.compile(
    r"call\s+\w|if\s*\(.*\)\s*(?!then\b)\w|where\s*\(.*\)\s*\w|(?:exit|cycle|return)\b|allocate\s*\("
)
ASSIGNMENT = re.compile(r"[a-z]\w*(?:%\w+|\([^=]*\))*\s*=(?![=>])")
BLOCK = re.compile(
    r"(?:\w+\s*:\s*)?(?:do|select|associate|block|if\s*\(.*\)\s*then|where\s*\(.*\)$)\b"
)
# Not in epsilon(1.0_wp), tiny and huge: they ask for the kind alone.
REAL = re.compile(r"(?<!epsilon\()(?<!tiny\()(?<!huge\()(?<![\w.])(\d+\.\d*)(e[+-]?\d+)?(_\w+)")
INTEGER = re.compile(r"(?<![\w.])(\d+)(_i8)?(?![\w.])")
SWAPPED = {
    ".and.": ".or.",
    ".or.": ".and.",
    ".true.": ".false.",
    ".false.": ".true.",
    "min(": "max(",
    "max(": "min(",
    "minval(": "maxval(",
    "maxval(": "minval(",
    "minloc(": "maxloc(",
    "maxloc(": "minloc(",
    "any(": "all(",
    "all(": "any(",
}
EXPONENT = re.compile(r"\d\.?\d*e$")  # of a real number, before its sign
BRANCH = re.compile(r"(else\s+)?if\s*\(.*\)\s*then$")
NEGATED = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "/=", "/=": "=="}
BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}


@dataclass(frozen=True)
class Mutant:
    """One change of one line, or of the lines of one statement that is dropped."""

    file: str  # below src/
    procedure: str
    first: int  # line, from 1
    last: int
    old: str  # the lines as they are, stripped and joined by a blank
    new: str  # the same, changed; empty: dropped
    kind: str
    text: str  # the changed line; of a dropped statement the line that takes its place
    name: str  # twelve digits that stand for all of that

    def apply(self, lines: list[str]) -> list[str]:
        """Return the lines of the file with the change."""
        blank = [""] * (self.last - self.first)
        return [*lines[: self.first - 1], self.text, *blank, *lines[self.last :]]


@dataclass
class Statement:
    """A statement of one or several lines; in `masked` what strings and comments say is blanked."""

    first: int
    masked: list[str]

    @property
    def code(self) -> str:
        """Return it on one line, in lower case, without its label of a block and continuations."""
        joined = " ".join(m.strip().strip("&").strip() for m in self.masked)
        return joined.strip().lower()


def mask(line: str, quote: str = "") -> tuple[str, str]:
    """Blank comments and strings; the quote that is still open goes in and comes out."""
    out = []
    for i, c in enumerate(line):
        if quote:
            if c == quote:
                quote = ""
            out.append("&" if c == "&" and not line[i + 1 :].strip() else "_")
        elif c in "'\"":
            quote = c
            out.append("_")
        elif c == "!":
            break
        else:
            out.append(c)
    if quote and not "".join(out).rstrip().endswith("&"):
        quote = ""
    return "".join(out).ljust(len(line)), quote


def statements(lines: list[str]) -> list[Statement]:
    """Split a file into statements; comments and empty lines belong to none."""
    found: list[Statement] = []
    going_on, quote = False, ""
    for number, line in enumerate(lines, 1):
        masked, quote = mask(line, quote)
        if not masked.strip():
            if going_on:
                found[-1].masked.append(masked)
            continue
        if going_on:
            found[-1].masked.append(masked)
        else:
            found.append(Statement(number, [masked]))
        going_on = masked.rstrip().endswith("&")
    return found


def integers(code: str) -> set[str]:
    """Return the names of scalars that a declaration makes integers."""
    match = re.match(
        r"integer(?:\(\w+\))?(?:\s*,\s*(?:intent\(\w+\)|value|optional))*\s*::\s*(.*)", code
    )
    if not match:
        return set()
    return {
        n.split("=")[0].strip()
        for n in re.sub(r"\([^()]*\)", "(", match[1]).split(",")
        if "(" not in n
    }


def end_of_operand(low: str, at: int, ends: str) -> int:
    """Return where what begins at `at` ends: at one of `ends` outside of brackets, or at a bracket.

    -1 where that is on another line.
    """
    depth = 0
    for i in range(at, len(low)):
        c = low[i]
        if c in "+-" and EXPONENT.search(low[:i]):
            continue
        if depth == 0 and (c in ")]" or c in ends or low.startswith((".and.", ".or."), i)):
            return i
        depth += (c in "([") - (c in ")]")
        if c == "&":
            complete = depth == 0 and low[:i].rstrip()[-1:] not in (*"*/=(,+-", "")
            return i if complete else -1
    return len(low) if depth == 0 else -1


def left_out(low: str, above: str) -> list[tuple[int, int, str, str]]:
    """Return the terms of sums that a line may lack, and the caps min(a, b) without a or b."""
    out: list[tuple[int, int, str, str]] = []
    for m in re.finditer(r"[+-]", low):
        before = low[: m.start()].rstrip().lstrip("& ") or above
        if not before or before[-1] in "(=,*/<>[:&" or EXPONENT.search(before):
            continue
        end = end_of_operand(low, m.end(), "+-,<>=:/")
        if low[end : end + 1] == "/" and low[end : end + 2] != "/=":
            end = end_of_operand(low, end + 1, "+-,<>=:")
        # What is a whole number alone is an index one more or less; a line is not left empty.
        if end <= m.end() or not (low[: m.start()] + low[end:]).strip():
            continue
        if not re.fullmatch(r"\s*\d*\s*", low[m.end() : end]):
            out.append((m.start(), end, "", "term"))
    for m in re.finditer(r"(?<![\w%])(?:min|max)\(", low):
        middle = end_of_operand(low, m.end(), ",")
        end = end_of_operand(low, middle + 1, ",") if middle > 0 else -1
        if middle > 0 and end > 0 and low[middle : middle + 1] == "," and low[end : end + 1] == ")":
            for one in (low[m.end() : middle], low[middle + 1 : end]):
                out.append((m.start(), end + 1, f"({one.strip()})", "cap"))
    return out


def changes(
    masked: str, only_constants: bool, whole: set[str], above: str
) -> list[tuple[int, int, str, str]]:
    """Return (start, end, replacement, kind) of every token of a line that can be changed.

    `above` is what the line continues.
    """
    out: list[tuple[int, int, str, str]] = []
    start = masked.index("=") if only_constants and "=" in masked else 0
    low = masked.lower()
    for m in REAL.finditer(low, start):
        value = f"{m[1]}e{int(m[2][1:]) + 1}" if m[2] else str(float(m[1]) + 1.0)
        out.append((m.start(), m.end(), value + m[3], "constant"))
    for m in INTEGER.finditer(low, start):
        n = int(m[1])
        out.append((m.start(1), m.end(1), str(n + 1), "index"))
        if n > 0:
            out.append((m.start(1), m.end(1), str(n - 1), "index"))
    for m in re.finditer(r"\.true\.|\.false\.", low[start:]):
        out.append((start + m.start(), start + m.end(), SWAPPED[m[0]], "constant"))
    if only_constants:
        return out
    out += left_out(low, above)
    for m in re.finditer(r"\.and\.|\.or\.", low):
        out.append((m.start(), m.end(), SWAPPED[m[0]], "logic"))
    for m in re.finditer(r"\.not\.\s*", low):
        out.append((m.start(), m.end(), "", "logic"))
    for m in re.finditer(r"(?<![\w%])(?:(?:min|max)(?:val|loc)?|any|all)\(", low):
        out.append((m.start(), m.end(), SWAPPED[m[0]], "min/max"))
    for m in re.finditer(r"(?<![=<>/(])(<=|>=|==|/=|<|>)(?![=/)])", low):
        out.append((m.start(), m.end(), NEGATED[m[0]], "comparison"))
        if m[0] in BOUNDARY and INTEGER.match(low[m.end() :].lstrip()):
            out.append((m.start(), m.end(), BOUNDARY[m[0]], "comparison"))
    for m in re.finditer(r"[+-]", low):
        before = low[: m.start()].rstrip().lstrip("& ") or above
        if EXPONENT.search(before) or not low[m.end() :].strip():
            continue
        if not before or before[-1] in "(=,*/<>[:&":
            if m[0] == "-":
                out.append((m.start(), m.end(), "", "sign"))
        else:
            out.append((m.start(), m.end(), "-" if m[0] == "+" else "+", "sign"))
    for m in re.finditer(r"(?<=[\w)\]])\s*(?<![*/(])([*/])(?![*/=)])\s*(?=[\w(.\[])", low):
        out.append((m.start(1), m.end(1), "/" if m[1] == "*" else "*", "sign"))
    for m in re.finditer(r"(?<=[(,:])\s*([a-z]\w*)\s*(?=[),:])", low):
        if m[1] in whole and low.count("(", 0, m.start(1)) > low.count(")", 0, m.start(1)):
            out.append((m.start(1), m.end(1), m[1] + " + 1", "index"))
            out.append((m.start(1), m.end(1), m[1] + " - 1", "index"))
    return out


def mutants_of(file: str, text: str) -> list[Mutant]:
    """List every mutant of a file, in the order of its lines."""
    lines = text.splitlines()
    found: list[Mutant] = []
    seen: dict[str, int] = {}
    procedures: list[str] = []
    whole: set[str] = set()

    def add(first: int, last: int, old: str, new: str, kind: str, changed: str, where: str) -> None:
        key = "|".join((file, procedures[-1] if procedures else "", old, where, new))
        seen[key] = seen.get(key, 0) + 1
        name = hashlib.sha256(f"{key}|{seen[key]}".encode()).hexdigest()[:12]
        procedure = procedures[-1] if procedures else ""
        found.append(Mutant(file, procedure, first, last, old, new, kind, changed, name))

    for statement in statements(lines):
        code = statement.code
        header = HEADER.match(code)
        if header and not code.startswith("end"):
            procedures.append(header[1])
            continue
        if re.match(r"end\s+(subroutine|function)\b", code):
            if procedures:
                procedures.pop()
            if not procedures:
                whole = set()
            continue
        if NOT_RUN.match(code):
            continue
        declared = bool(DECLARATION.match(code))
        if declared:
            whole |= integers(code)
            if "parameter" not in code:
                continue
        elif not procedures and not file.endswith(".inc"):
            continue
        last = statement.first + len(statement.masked) - 1
        for offset, masked in enumerate(statement.masked):
            number = statement.first + offset
            line = lines[number - 1]
            only = declared and offset == 0
            above = "".join(statement.masked[:offset]).rstrip(" &").lower()
            for start, end, new, kind in changes(masked, only or declared, whole, above):
                changed = line[:start] + new + line[end:]
                add(
                    number,
                    number,
                    line.strip(),
                    changed.strip(),
                    kind,
                    changed,
                    str(start - len(line) + len(line.lstrip())),
                )
        if declared:
            continue
        if branch := BRANCH.match(code):
            old = " ".join(lines[n - 1].strip() for n in range(statement.first, last + 1))
            indent = re.match(r"\s*", lines[statement.first - 1])[0]  # type: ignore[index]
            never = (branch[1] or "") + "if (.false.) then"
            add(statement.first, last, old, never, "branch", indent + never, "")
        if (DROPPED.match(code) or ASSIGNMENT.match(code)) and not BLOCK.match(code):
            old = " ".join(lines[n - 1].strip() for n in range(statement.first, last + 1))
            indent = re.match(r"\s*", lines[statement.first - 1])[0]  # type: ignore[index]
            add(statement.first, last, old, "", "dropped", indent + "continue", "")
    return found
