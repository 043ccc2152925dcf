"""The settings by which any deck's accuracy may be bought: meshes, increments, element types, small
and finite strain, asked accuracies; and the reference that they are held against.

Two of them are no options of the program: `increments`, in how many parts each of the deck's is
cut, and `type`, hexahedra or quadrilaterals with or without incompatible modes. Runs with these
have decks of their own, the flat one with other cards.
"""

import re
import subprocess

INCREMENTS, TYPE = "--increments", "--type"  # names of settings that change the deck
# Types whose nodes are the same.
TWINS = {"C3D8": "C3D8I", "CPE4": "CPE4I", "CPS4": "CPS4I", "CAX4": "CAX4I"}
TWINS |= {twin: name for name, twin in TWINS.items()}
PLANNED = re.compile(r"^time +(?:about|at most) +(.*?) of CPU time", re.MULTILINE)
UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def seconds_in(words):
    """Return the seconds of words such as "1 min 20 s" or "0.12 s"; None where there are none."""
    found = re.findall(r"([\d.]+(?:e[+-]?\d+)?) (s|min|h|d)\b", words)
    return sum(float(value) * UNITS[unit] for value, unit in found) if found else None


def changed_deck(text, setting):
    """Return a flat deck with the increments and types of a setting."""
    parts = int(setting.get(INCREMENTS, 1))
    if parts > 1:
        text = re.sub(r"^(\*STATIC\b)([^\n]*)\n(?!\*)([^\n]*)", lambda card: cut(card, parts),
                      text, flags=re.MULTILINE | re.IGNORECASE)
    if TYPE in setting:
        other = setting[TYPE]
        text = re.sub(rf"(\bTYPE *= *){TWINS[other]}(?![A-Z0-9])", rf"\g<1>{other}", text,
                      flags=re.IGNORECASE)
    return text


def cut(card, parts):
    """Return *STATIC and its line with so many times as many increments, all of one length."""
    numbers = [word.strip() for word in card[3].split(",")]
    first = float(numbers[0] or 1) / parts
    rest = numbers[1:] if len(numbers) > 1 and numbers[1] else ["1."]
    options = card[2] if "DIRECT" in card[2].upper() else f"{card[2].rstrip()}, DIRECT"
    return f"{card[1]}{options}\n{first!r}, {rest[0]}"


def types_in(text):
    """Return the types of elements of a flat deck that have a twin."""
    found = re.findall(r"^\*ELEMENT\b[^\n]*\bTYPE *= *(\w+)", text, re.MULTILINE | re.IGNORECASE)
    return [name for name in TWINS if name in {word.upper() for word in found}]


def candidates(text):
    """Return the settings that are worth a run for a flat deck, beginning with the deck itself."""
    settings = [{}, {"--refine": "1"}, {"--refine": "2"}, {INCREMENTS: "2"}, {INCREMENTS: "4"},
                {"--refine": "1", INCREMENTS: "2"}]
    finite = re.search(r"^\*STEP\b[^\n]*\bNLGEOM(?! *= *NO)", text, re.MULTILINE | re.IGNORECASE)
    other = "no" if finite else "yes"
    settings += [{"--nlgeom": other}, {"--nlgeom": other, "--refine": "1"}]
    for name in types_in(text):
        twin = {TYPE: TWINS[name]}
        settings += [twin, twin | {"--refine": "1"}]
        if not finite:
            settings.append(twin | {"--nlgeom": "yes", "--refine": "1"})
    return [*settings, {"--accuracy": "0.1"}, {"--accuracy": "0.03"}]


def references(text):
    """Return settings for a reference, the best first: each with those that tell its own error, a
    coarser mesh and longer increments."""
    better = {"--nlgeom": "yes"}
    types = types_in(text)
    if types and not any(name.endswith("I") for name in types):
        better[TYPE] = TWINS[types[0]]
    found = []
    for strain in (better, {"--nlgeom": "yes"}, {}):
        for times in (3, 2, 1):
            finest = strain | {"--refine": str(times), INCREMENTS: "2"}
            found.append((finest, finest | {"--refine": str(times - 1)},
                          strain | {"--refine": str(times - 1)}))
    return found


def planned_seconds(program, words):
    """Return the time that a run would take by its plan [s], or None, and why it would not run."""
    done = subprocess.run([program, *words, "--plan"], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, check=False)
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error:" in line]
        return None, lines[0].split("error: ", 1)[-1].strip() if lines else "it is refused"
    planned = PLANNED.search(done.stdout)
    return (seconds_in(planned[1]) if planned else None), ""
