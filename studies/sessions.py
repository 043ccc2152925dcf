"""Run the console sessions of the user's pages, and write what they print anew.

A page shows a session as

    ```console
    $ build/bipot input/block.inp
    bipot 0.1.0: ...
    ...
    ```

where a line of three points stands for any lines. The commands of a page run one after the other
in one folder that holds what a clone does. Times, amounts of memory and rounding errors differ
from machine to machine, and numbers of iterations and of points by one or two; all else is
compared.

A page that types `. build/env` has a shell without a program before that, as its readers do. On
other pages `bipot` is the program, and `import bipot` finds its package.

    studies/run sessions [PAGE...]     write the pages anew, where what is printed has changed
"""

import argparse
import dataclasses
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from bipot.program import ROOT, built_program
from studies.pages import StudyError

PAGES = ("README.md", "docs/options.md", "docs/plan.md", "docs/tutorial.md")
REST = "..."
FENCE = re.compile(r"^```console\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PROMPT = "$ "
SETUP = ". build/env"
# What is the machine's, and not the deck's.
OF_THE_MACHINE = (
    (re.compile(r"\d+ min \d+ s\b"), "TIME"),
    (re.compile(r"\b[\d.]+(?:e-?\d+)? (?:s|min|h)\b"), "TIME"),
    (re.compile(r"\b[\d.]+ (?:kB|MB|GB)\b"), "MEMORY"),
    (re.compile(r"(?<!certified to )(?<!tolerance )\b\d(?:\.\d+)?[eE]-(?:0?[7-9]|[1-9]\d)\b"),
     "ROUNDING"),
    (re.compile(r"\(increment \d+\)"), "(INCREMENT)"),
    (re.compile(r" \d+\.\d\d  \d+ of \d+(?:, [\w. ]+ left)?$"), " TIME"),
)
# A line of the table of increments: step, number and time come first, and name it.
INCREMENT = re.compile(r"\s*\d+\s+\d+\s+[\d.]+\s")
NAMED = 3
ITERATIONS = 2
ROUNDED = 0.02


@dataclasses.dataclass
class Command:
    """A command of a session and what the page shows of its output."""

    words: str
    shown: list


def sessions_of(page):
    """Return the sessions on a page, a list of commands each."""
    found = []
    for text in FENCE.findall(page):
        commands = []
        for line in text.splitlines():
            if line.startswith(PROMPT):
                commands.append(Command(line[len(PROMPT):], []))
            elif commands:
                commands[-1].shown.append(line)
            else:
                raise StudyError(f"a session begins with '{line}', expected a line with '$ '")
        found.append(commands)
    return found


def furnish(folder, program):
    """Put into a folder what a clone holds for users, with this program built."""
    shutil.copytree(ROOT / "input", folder / "input")
    for place in ("docs/examples", "docs/tutorial"):
        shutil.copytree(ROOT / place, folder / place)
    (folder / "scripts").symlink_to(ROOT / "scripts")
    (folder / "build").mkdir()
    for name in ("bipot", "env"):
        (folder / "build" / name).symlink_to(program.parent / name)


def environment(folder, is_bare):
    """Return the variables of a shell; a bare one has been given no program."""
    own = {"MPLBACKEND": "Agg", "COLUMNS": "100"}
    if is_bare:
        inherited = {k: v for k, v in os.environ.items() if k not in ("BIPOT", "PYTHONPATH")}
        return {**inherited, **own}
    own["PATH"] = f"{folder / 'build'}:{os.environ['PATH']}"
    own["PYTHONPATH"] = str(ROOT / "scripts")
    own["BIPOT"] = str(folder / "build" / "bipot")
    return {**os.environ, **own}


def run(command, folder, variables):
    """Run a command as a user types it; return its exit status and the lines it prints.

    scripts/run builds the program of the clone first; where the folder has another one, that runs.
    """
    if (folder / "build" / "bipot").resolve() != (ROOT / "build" / "bipot").resolve():
        command = re.sub(r"\bscripts/run\b", "build/bipot", command)
    done = subprocess.run(
        command, shell=True, executable="/bin/bash", cwd=folder, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, env=variables,
    )  # fmt: skip
    return done.returncode, [line.rstrip() for line in done.stdout.splitlines()]


def words_of(line):
    """Return the words of a line, with those that are the machine's made alike."""
    for pattern, name in OF_THE_MACHINE:
        line = pattern.sub(name, line)
    return line.replace(",", " , ").split()


def number(word):
    """Return the value of a word, None where it is no number."""
    try:
        return float(word.rstrip("%:"))
    except ValueError:
        return None


def alike(shown, printed):
    """Whether a line says what the page shows."""
    left, right = words_of(shown), words_of(printed)
    if len(left) != len(right):
        return False
    table = INCREMENT.match(shown) is not None
    for place, (a, b) in enumerate(zip(left, right, strict=True)):
        x, y = number(a), number(b)
        if a == b:
            continue
        if x is None or y is None:
            return False
        if table and place >= NAMED and a.isdigit():
            if abs(x - y) > ITERATIONS:
                return False
        elif a.isdigit() or abs(x - y) > ROUNDED * abs(x):
            return False
    return True


def difference(shown, printed):
    """Return the first line of the page that is not what was printed; None where all is."""
    place = 0
    skipping = False
    for line in shown:
        if line.strip() == REST:
            skipping = True
            continue
        while skipping and place < len(printed) and not alike(line, printed[place]):
            place += 1
        if place == len(printed) or not alike(line, printed[place]):
            return line
        place += 1
        skipping = False
    if place < len(printed) and not skipping:
        return f"{REST} (more was printed: {printed[place]})"
    return None


def keep_pictures(page, place, folder):
    """Copy pictures that commands have made to where the page at `place` looks for them.

    foot-pictures/stress.png is foot-stress.png there.
    """
    made = {f"{path.parent.name.removesuffix('-pictures')}-{path.name}": path
            for path in folder.glob("*-pictures/*.png")}
    for name in re.findall(r"!\[[^]]*\]\(([^)]*\.png)\)", page):
        target = place.parent / name
        if target.parent.name == place.stem and target.name in made:
            shutil.copy(made[target.name], target)


def shortened(shown, printed):
    """Return what was printed, cut where the page cuts it."""
    if REST not in (line.strip() for line in shown):
        return printed
    cut = [line.strip() for line in shown].index(REST)
    after = len(shown) - cut - 1
    return [*printed[:cut], REST, *printed[len(printed) - after:]]


def missing_tool(command):
    """Return the first word of a command that this machine does not have, None where it does."""
    word = command.split()[0]
    here = "/" in word or word in ("bipot", ".") or shutil.which(word)
    return None if here else word


def replay(page, folder, show=""):
    """Run the commands of a page in a furnished folder; yield each, its status and its output.

    Those whose tool is not installed are left out: None stands for their output. `show` are options
    that each scripts/show is given, too.
    """
    commands = [command for session in sessions_of(page) for command in session]
    variables = environment(folder, is_bare=uses_setup(page))
    before = ""
    for command in commands:
        if missing_tool(command.words):
            yield command, 0, None
        else:
            words = command.words.replace("scripts/show ", f"scripts/show {show} ")
            yield command, *run(before + words, folder, variables)
        if command.words == SETUP:
            before = f"{SETUP}; "


def uses_setup(page):
    """Whether a page types the command that puts the program on the PATH."""
    return f"{PROMPT}{SETUP}\n" in page


def run_code(code, page, folder):
    """Run Python of a page as one program, where its reader has come to; the finished process."""
    command = shlex.join([sys.executable, "-B", "-c", code])
    setup = f"{SETUP}; " if uses_setup(page) else ""
    return subprocess.run(
        setup + command, shell=True, executable="/bin/bash", cwd=folder, capture_output=True,
        text=True, check=False, env=environment(folder, is_bare=uses_setup(page)),
    )  # fmt: skip


def written_anew(page, folder):
    """Return the page with what its commands print now."""
    for command, status, printed in replay(page, folder):
        if status != 0:
            raise StudyError(f"'{command.words}' ends with {status}: {printed[-5:]}")
        if printed is None or difference(command.shown, printed) is None:
            continue
        head = f"{PROMPT}{command.words}\n"
        old = head + "".join(f"{line}\n" for line in command.shown)
        new = head + "".join(f"{line}\n" for line in shortened(command.shown, printed))
        page = page.replace(old, new, 1)
    return page


def main():
    """Write the pages named, or all of them, anew."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--bipot", type=Path, help="the program")
    parser.add_argument("pages", nargs="*", default=PAGES, metavar="PAGE")
    options = parser.parse_args()
    program = built_program(options.bipot)
    for name in options.pages:
        path = ROOT / name
        before = path.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory(prefix="bipot-") as place:
            folder = Path(place)
            furnish(folder, program)
            after = written_anew(before, folder)
            keep_pictures(after, path, folder)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(f"{name}: written anew")
    return 0


if __name__ == "__main__":
    sys.exit(main())
