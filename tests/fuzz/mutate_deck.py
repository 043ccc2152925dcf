"""Decks made wrong, or strange, by mutations that know the grammar of a deck.

Three kinds, for three things that the program must get right:

- `wild`: one to six random mutations of any sort; whatever comes of it, the program must end in
  order;
- `wrong`: one mutation of a sound deck that certainly makes it wrong, with the line where the
  mistake stands (or None: anywhere); the program must refuse it there;
- `same`: mutations that change how a deck is written and not what it says; the plan must stay.

A deck is a list of lines without their ends, of bytes decoded as Latin-1: one character a byte.
"""

import contextlib
import itertools
import re

NUMBER = re.compile(r"(?<![\w<.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![\w>.])")
STRANGE_NUMBERS = (
    "0", "0.", "-0.", "1", "-1", "2", "7", "1e-300", "1e-320", "1e300", "1e400", "-1e400", "1e60",
    "1.0001e60", "1e61", "-1e60", "nan", "NaN", "inf", "-Inf", "infinity", "2147483647",
    "2147483648", "-2147483648", "-2147483649", "4294967296", "9223372036854775808",
    "99999999999999999999999999", "0.1", "1.5", "1.", ".5", ".", "-", "+", "", "1e", "1e+", "1d5",
    "1.5D-3", "1+5", "1-300", "1.2.3", "0x10", "1_000", "1,5", "1e5e5", "--1", "1 2", "1/2", "one",
    "<n>", "<1/0>", "<sqrt(-1)>", "<nosuch>", "<1e60*1e60>", "<n", "n>", "<>", "<<n>>", "1e-61",
    "20000000", "20000001", "16777216", "65536", "1000000",
    "3.141592653589793238462643383279502884",
    "0" * 400 + "1", "1" + "0" * 400, "1." + "0" * 400 + "1", "<" + "(" * 60 + "1" + ")" * 60 + ">",
)
# What cannot be a number in any place where one is asked for.
NO_NUMBERS = ("nan", "-Inf", "1e400", "1.2.3", "0x10", "1e", "--1", "1.5.", "<1/0>", "<nosuch>",
              "one", "1e61", "<sqrt(-1)>", "5%")
STRANGE_WORDS = (
    "", " ", "X", "NOSUCH", "nosuch set", "'", '"quoted"', "A" * 81, "A" * 5000, "\xc3\xa9", "1",
    "-1", "*", "**", ",", "=", "<n>", "<>", "GENERATE", "YES", "NO", "../../etc/passwd", "a/b",
    "BODY", "BODY-XMIN", "body-zmax", "C3D8", "C3D20", "GROUND", "\t",
)
# Cards that are passed over, or hold a text: what stands below them is not read.
PASSED_OVER = {"HEADING", "CONTROLS", "OUTPUT", "SURFACE BEHAVIOR", "PREPRINT", "RESTART",
               "NODE OUTPUT", "ELEMENT OUTPUT", "SECTION CONTROLS", "CONTACT CONTROLS",
               "CONTACT STABILIZATION"}


def keyword_of(line):
    """The keyword of a line in upper case, or None."""
    text = line.strip()
    if not text.startswith("*") or text.startswith("**"):
        return None
    return re.sub(r"\s+", " ", text[1:].split(",")[0].strip()).upper()


def cards_of(lines):
    """Where each card begins and ends: (keyword, first line, line after the last)."""
    starts = [(keyword_of(line), i) for i, line in enumerate(lines) if keyword_of(line) is not None]
    ends = [i for _, i in starts[1:]] + [len(lines)] * bool(starts)
    return [(keyword, first, end) for (keyword, first), end in zip(starts, ends, strict=True)]


def is_data(line):
    """Whether a line holds data."""
    return bool(line.strip()) and not line.lstrip().startswith("*")


def data_lines(lines, keywords=None):
    """The numbers of the data lines, of all cards or of some."""
    return [
        i
        for keyword, first, end in cards_of(lines)
        if (keyword in keywords if keywords else keyword not in PASSED_OVER)
        for i in range(first + 1, end)
        if is_data(lines[i])
    ]


# ---------------------------------------------------------------- wild


def change_number(rng, lines, _others):
    """Put a strange number in the place of one."""
    places = [(i, m) for i, line in enumerate(lines) for m in NUMBER.finditer(line)]
    if not places:
        return
    i, match = rng.choice(places)
    text = rng.choice(STRANGE_NUMBERS)
    if rng.random() < 0.3:
        with contextlib.suppress(ValueError, OverflowError):
            text = repr(float(match.group().replace("D", "e")) * 10.0 ** rng.randint(-12, 12))
    lines[i] = lines[i][: match.start()] + text + lines[i][match.end():]


def change_word(rng, lines, _others):
    """Put a strange word, or another word of the deck, in the place of one."""
    places = [(i, m) for i, line in enumerate(lines) for m in re.finditer(r"[A-Za-z][\w -]*", line)]
    if not places:
        return
    i, match = rng.choice(places)
    text = rng.choice(STRANGE_WORDS) if rng.random() < 0.5 else rng.choice(places)[1].group()
    lines[i] = lines[i][: match.start()] + text + lines[i][match.end():]


def change_field(rng, lines, _others):
    """Remove, repeat, exchange or add fields of a line."""
    i = rng.randrange(len(lines))
    fields = lines[i].split(",")
    k, j = rng.randrange(len(fields)), rng.randrange(len(fields))
    what = rng.randrange(5)
    if what == 0:
        del fields[k]
    elif what == 1:
        fields.insert(k, fields[j])
    elif what == 2:
        fields[k], fields[j] = fields[j], fields[k]
    elif what == 3:
        fields = fields[: k + 1]
    else:
        fields.extend([rng.choice(STRANGE_NUMBERS)] * rng.choice((1, 2, 20, 300)))
    lines[i] = ",".join(fields)


def change_option(rng, lines, others):
    """Take an option of another card, or drop, repeat or spoil one."""
    places = [i for i, line in enumerate(lines) if keyword_of(line) is not None]
    pool = [line for deck in others for line in deck if keyword_of(line) and "," in line]
    if not places or not pool:
        return
    i = rng.choice(places)
    fields = lines[i].split(",")
    what = rng.randrange(5)
    if what == 0 and len(fields) > 1:
        del fields[rng.randrange(1, len(fields))]
    elif what == 1:
        fields.append(rng.choice(rng.choice(pool).split(",")[1:]))
    elif what == 2:
        fields.append(rng.choice(fields))
    elif what == 3:
        k = rng.randrange(len(fields))
        fields[k] = fields[k].replace("=", rng.choice(("", "==", " = ", "=,", "=\t")))
    else:
        k = rng.randrange(len(fields))
        name = fields[k].split("=")[0]
        fields[k] = name + "=" + rng.choice(STRANGE_WORDS + STRANGE_NUMBERS)
    lines[i] = ",".join(fields)


def change_keyword(rng, lines, others):
    """Put another keyword line in the place of one, or misspell it."""
    places = [i for i, line in enumerate(lines) if keyword_of(line) is not None]
    pool = [line for deck in others for line in deck if keyword_of(line)]
    if not places:
        return
    i = rng.choice(places)
    if rng.random() < 0.5 and pool:
        lines[i] = rng.choice(pool)
    else:
        k = rng.randrange(len(lines[i]))
        lines[i] = lines[i][:k] + rng.choice(("", "*", "X", " ", "=", lines[i][k:k + 1] * 2)) + \
            lines[i][k + 1:]


def misspell(rng, lines, _others):
    """Spell words of keyword lines, or of lines of words below them, as people might."""
    places = [(i, m) for i, line in enumerate(lines) if not line.lstrip().startswith("**")
              for m in re.finditer(r"[A-Za-z][A-Za-z -]*", line)
              if keyword_of(line) or len(m.group()) > 1]
    if not places:
        return
    i, match = rng.choice(places)
    word = match.group()
    k = rng.randrange(len(word))
    spellings = (
        word[:k] + word[k + 1:], word[:k] + word[k] + word[k:], word[:max(k, 2)],
        word[:k] + word[k:k + 2][::-1] + word[k + 2:], word.replace(" ", ""),
        word.replace(" ", "_"), word.replace(" ", "-"), word.replace(" ", "  "),
        word.replace("-", " "), word[:k] + " " + word[k:], f'"{word}"', word.title(), word + "S",
        word.swapcase(),
    )
    lines[i] = lines[i][: match.start()] + rng.choice(spellings) + lines[i][match.end():]


def change_lines(rng, lines, _others):
    """Remove, repeat or move a few lines."""
    first = rng.randrange(len(lines))
    piece = lines[first: first + rng.choice((1, 1, 1, 2, 3, 8))]
    what = rng.randrange(3)
    if what != 1:
        del lines[first: first + len(piece)]
    if what != 0:
        at = rng.randrange(len(lines) + 1)
        lines[at:at] = piece * (rng.choice((1, 1, 2, 50)) if what == 1 else 1)


def change_cards(rng, lines, others):
    """Remove, repeat or move a whole card, or bring one from another deck."""
    cards = cards_of(lines)
    if not cards:
        return
    _, first, end = rng.choice(cards)
    piece = lines[first:end]
    what = rng.randrange(4)
    if what in (0, 2):
        del lines[first:end]
    if what == 3:
        other = rng.choice(others)
        found = cards_of(other)
        if found:
            _, a, b = rng.choice(found)
            piece = other[a:b]
    if what != 0:
        starts = [first for _, first, _ in cards_of(lines)] + [len(lines)]
        at = rng.choice(starts)
        lines[at:at] = piece


def cross(rng, lines, others):
    """Go on with the rest of another deck."""
    other = rng.choice(others)
    if other:
        lines[rng.randrange(len(lines)):] = other[rng.randrange(len(other)):]


def cut(rng, lines, _others):
    """End in the middle of a line."""
    i = rng.randrange(len(lines))
    lines[i:] = [lines[i][: rng.randrange(len(lines[i]) + 1)]]


def change_bytes(rng, lines, _others):
    """Change single bytes."""
    for _ in range(rng.choice((1, 1, 2, 8))):
        i = rng.randrange(len(lines))
        k = rng.randrange(len(lines[i]) + 1)
        some = "\0\r\n\t\x1a\x7f\xff*,<>="
        byte = chr(rng.randrange(256)) if rng.random() < 0.7 else rng.choice(some)
        lines[i] = lines[i][:k] + byte + lines[i][k + rng.randrange(2):]


def lengthen(rng, lines, _others):
    """Make a line very long, or repeat it very often."""
    i = rng.randrange(len(lines))
    if rng.random() < 0.5:
        lines[i] = lines[i] * rng.choice((10, 300, 5000))
    else:
        lines[i:i] = [lines[i]] * rng.choice((10, 300, 3000))


def nest(rng, lines, _others):
    """Includes, parameters and sets in circles and in depth."""
    i = rng.randrange(len(lines) + 1)
    n = rng.choice((2, 3, 20, 200))
    lines[i:i] = rng.choice((
        ["*INCLUDE, INPUT=deck.inp"],
        ["*INCLUDE, INPUT=piece.inp"],
        ["*INCLUDE, INPUT=."],
        ["*INCLUDE, INPUT=/dev/zero"],
        ["*INCLUDE, INPUT=" + "../" * n + "deck.inp"],
        ["*PARAMETER", "aa = <bb>", "bb = <aa>"],
        ["*PARAMETER", "aa = <aa>"],
        ["*PARAMETER"] + [f"p{k} = <p{k + 1}>+<p{k + 1}>" for k in range(n)] + [f"p{n} = 1"],
        ["*PARAMETER", f"p0 = {'x' * 50}"] + [f"p{k + 1} = <p{k}><p{k}>" for k in range(n)],
        ["*PARAMETER", "deep = " + "(" * n + "1" + ")" * n, "*HEADING", "<deep>"],
        ["*NSET, NSET=S0", "S1", "*NSET, NSET=S1", "S0"],
        ["*NSET, NSET=S0", "S0"],
        ["*ELSET, ELSET=S0", "S1, S1", "*ELSET, ELSET=S1", "S0, S0"],
        [line for k in range(n) for line in (f"*NSET, NSET=T{k}", f"T{k + 1}, T{k + 1}")]
        + [f"*NSET, NSET=T{n}", "1"],
        ["*NSET, NSET=ALL, GENERATE", "1, 2147483647, 1"],
        ["*NSET, NSET=ALL, GENERATE", "1, 2147483647, 2147483647"],
        ["*NSET, NSET=ALL, GENERATE", "-2147483648, 2147483647, 1"],
        ["*ELSET, ELSET=ALL, GENERATE", "2147483600, 2147483647, 1"],
        ["*NODE", "2147483647, 0., 0., 0.", "*BLOCK, NAME=LATE, NX=1, NY=1, NZ=1",
         "0., 0., 0., 1., 1., 1."],
        ["*BLOCK, NAME=BIG, NX=60, NY=60, NZ=60", "0., 0., 0., 1., 1., 1."],
        ["*BLOCK, NAME=BIG, NX=46341, NY=46341, NZ=1", "0., 0., 0., 1., 1., 1."],
        ["*BLOCK, NAME=BIG, NX=100, NY=100, NZ=100", "0., 0., 0., 1., 1., 1."],
        ["*BLOCK, NAME=BIG, NX=1000000000, NY=1, NZ=1", "0., 0., 0., 1., 1., 1."],
    ))


WILD = (
    (change_number, 10), (change_word, 5), (change_field, 5), (change_option, 5),
    (change_keyword, 3), (misspell, 8), (change_lines, 4), (change_cards, 5), (cross, 2), (cut, 1),
    (change_bytes, 2), (lengthen, 1), (nest, 2),
)


def wild(rng, lines, others):
    """Change the deck at random; returns the names of the mutations."""
    names = []
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 6))):
        mutation = rng.choices([f for f, _ in WILD], [w for _, w in WILD])[0]
        mutation(rng, lines, others)
        if not lines:
            lines.append("")
        names.append(mutation.__name__)
    return names


# ---------------------------------------------------------------- certainly wrong
# Each returns the line (from 0) where the mistake stands, None where it is the deck's as a whole or
# has several places, and False where the deck offers no place for it.


def unknown_keyword(rng, lines):
    """A keyword that nobody knows."""
    at = rng.choice([first for _, first, _ in cards_of(lines)])
    lines.insert(at, rng.choice(("*FOOBAR", "*NODDE, NSET=A", "* ", "*CONTACT PEAR", "*STEPS")))
    return at


def unknown_option(rng, lines):
    """An option that no card has."""
    places = [i for i, line in enumerate(lines)
              if keyword_of(line) not in PASSED_OVER | {None, "PARAMETER", "INCLUDE"}]
    i = rng.choice(places)
    if lines[i].rstrip().endswith(","):
        return False
    lines[i] += ", FOO=1"
    return i


def no_number(rng, lines):
    """What is no number, in the place of one."""
    numeric = {"NODE", "ELASTIC", "DENSITY", "FRICTION", "BLOCK", "STATIC", "OBSTACLE", "AMPLITUDE",
               "CLOAD", "BOUNDARY"}
    # In an expression <...> some of them have a meaning.
    places = [(i, m) for i in data_lines(lines, numeric) if "<" not in lines[i]
              for m in NUMBER.finditer(lines[i])]
    if not places:
        return False
    i, match = rng.choice(places)
    lines[i] = lines[i][: match.start()] + rng.choice(NO_NUMBERS) + lines[i][match.end():]
    return i


def no_parameter(rng, lines):
    """A value that needs a parameter which the deck does not have."""
    places = [(i, m) for i in data_lines(lines) for m in re.finditer(r"<[^<>]*>", lines[i])]
    return replace_one(rng, lines, places, "<nosuchparameter>")


def replace_one(rng, lines, places, word):
    """Put the word in one of the places, pairs of a line's number and a match: that number."""
    if not places:
        return False
    i, match = rng.choice(places)
    lines[i] = lines[i][: match.start()] + word + lines[i][match.end():]
    return i


def drop_card(rng, lines):
    """A card that the deck cannot do without."""
    needed = {"SOLID SECTION", "MATERIAL", "ELASTIC", "STEP", "END STEP", "STATIC",
              "SURFACE INTERACTION", "OBSTACLE"}
    cards = [card for card in cards_of(lines) if card[0] in needed]
    keyword, first, end = rng.choice(cards)
    if keyword == "END STEP" and first < cards_of(lines)[-1][1]:
        return False  # the next *STEP may begin all the same, in some decks as a mistake of its own
    del lines[first:end]
    return None


def repeat_card(rng, lines):
    """A card of which there can be but one of its name; a step may repeat a pair."""
    before_steps = itertools.takewhile(lambda card: card[0] != "STEP", cards_of(lines))
    cards = [card for card in before_steps
             if card[0] in {"ELEMENT", "BLOCK", "MATERIAL", "OBSTACLE", "CONTACT PAIR",
                            "AMPLITUDE", "CONTACT SOLVER"}
             and (card[0] != "ELEMENT" or any(map(is_data, lines[card[1] + 1:card[2]])))]
    if not cards:
        return False
    _, first, end = rng.choice(cards)
    lines[end:end] = lines[first:end]
    return None


def no_such_name(rng, lines):
    """The name of a set, surface, obstacle, material or interaction that is not there."""
    places = []
    for i, line in enumerate(lines):
        keyword = keyword_of(line)
        if keyword == "SOLID SECTION":
            places += [(i, m) for m in re.finditer(r"(?<=ELSET=)[^,]+|(?<=MATERIAL=)[^,]+", line)]
        if keyword == "CONTACT PAIR":
            places += [(i, m) for m in re.finditer(r"(?<=INTERACTION=)[^,]+", line)]
    for i in data_lines(lines, {"CONTACT PAIR", "BOUNDARY", "DSLOAD", "CLOAD"}):
        match = re.match(r"\s*[A-Za-z][^,]*", lines[i])
        if match:
            places.append((i, match))
    return replace_one(rng, lines, places, "NOSUCHNAME")


def wrong_value(rng, lines):
    """A value outside its range."""
    places = {
        "ELASTIC": ("-1., 0.3", "0., 0.3", "1000., 0.5", "1000., -1.", "1000., 1e9", "1000."),
        "FRICTION": ("-0.1", "nan", "-1e-30"),
        "DENSITY": ("-1.", "0."),
        "STATIC": ("nan, 1.", "-1., 1.", "2., 1.", "1., nan", "1., -1.", "1e-12, 1."),
        "BLOCK": ("0., 0., 0., 1., 1., 0.", "0., 0., 0., 1., -1., 1.", "0., 0., 0., 1., 1."),
    }
    keyword = rng.choice(list(places))
    cards = [card for card in cards_of(lines) if card[0] == keyword]
    cards = [(first, end) for _, first, end in cards if any(map(is_data, lines[first + 1:end]))]
    if not cards:
        return False
    first, end = rng.choice(cards)
    i = next(i for i in range(first + 1, end) if is_data(lines[i]))
    lines[i] = rng.choice(places[keyword])
    return i


def no_text(rng, lines):
    """A byte that no text has."""
    i = rng.randrange(len(lines))
    k = rng.randrange(len(lines[i]) + 1)
    byte = rng.choice("\0\x01\x1a\x7f\xff\xc0\x80")
    if lines[i].lstrip().startswith("**") or any(
        keyword == "HEADING" and first < i < end for keyword, first, end in cards_of(lines)
    ):
        byte = rng.choice("\0\x01\x1a\x7f")  # others may be Latin-1 there
    lines[i] = lines[i][:k] + byte + lines[i][k:]
    return i


def no_include(rng, lines):
    """A file that is not there, or the deck itself."""
    at = rng.choice([first for _, first, _ in cards_of(lines)])
    lines.insert(at, rng.choice(("*INCLUDE, INPUT=nosuch.inp", "*INCLUDE, INPUT=deck.inp",
                                 "*INCLUDE", "*INCLUDE, INPUT=/dev/null", "*INCLUDE, INPUT=.")))
    return at


def cut_in_step(rng, lines):
    """The end of the deck is missing from within its last step."""
    last = [first for keyword, first, _ in cards_of(lines) if keyword == "STEP"][-1]
    end = [first for keyword, first, _ in cards_of(lines) if keyword == "END STEP"][-1]
    if end <= last + 1:
        return False
    del lines[rng.randrange(last + 1, end):]
    return None


def bad_degree(rng, lines):
    """A degree of freedom that a node does not have."""
    places = [i for i in data_lines(lines, {"BOUNDARY", "CLOAD"}) if lines[i].count(",") >= 2]
    if not places:
        return False
    i = rng.choice(places)
    fields = lines[i].split(",")
    fields[1] = rng.choice((" 0", " 8", " -1", " 1.5", " X", " 2147483648"))
    lines[i] = ",".join(fields)
    return i


def too_many_fields(rng, lines):
    """More fields than a line can have."""
    fixed = {"NODE", "BLOCK", "ELASTIC", "DENSITY", "SOLID SECTION", "FRICTION", "CONTACT PAIR",
             "CONTACT GAP", "OBSTACLE", "SURFACE", "STATIC", "BOUNDARY", "CLOAD", "DLOAD", "DSLOAD"}
    places = data_lines(lines, fixed)
    if not places:
        return False
    i = rng.choice(places)
    lines[i] += ", 7" * 9
    return i


def second_property(rng, lines):
    """A property that the material or interaction above it has already."""
    cards = [(first, end) for keyword, first, end in cards_of(lines)
             if keyword in {"ELASTIC", "DENSITY", "FRICTION"}]
    if not cards:
        return False
    first, end = rng.choice(cards)
    lines[end:end] = lines[first:end]
    return end


WRONG = (unknown_keyword, unknown_option, no_number, no_parameter, drop_card, repeat_card,
         no_such_name, wrong_value, no_text, no_include, cut_in_step, bad_degree, too_many_fields,
         second_property)


def wrong(rng, lines):
    """Make a sound deck wrong: the mutation's name and the line of the mistake, or None."""
    while True:
        mutation = rng.choice(WRONG)
        changed = list(lines)
        line = mutation(rng, changed)
        if line is not False:
            lines[:] = changed
            return mutation.__name__, line


# ---------------------------------------------------------------- the same, written differently


def same(rng, lines):
    """Write the deck differently without changing what it says; returns the end of its lines."""
    for i in range(len(lines) - 1, -1, -1):
        line = lines[i]
        if keyword_of(line) == "INCLUDE":
            continue
        title = any(first < i < end for keyword, first, end in cards_of(lines)
                    if keyword == "HEADING")
        what = rng.randrange(9)
        if what == 0:
            lines.insert(i, "** a comment, with <nothing> in it = *STEP")
        elif what == 1 and keyword_of(line) is not None:
            lines[i] = swap_case_outside_quotes(line)
        elif what == 2 and not title:
            lines[i] = line.replace(",", rng.choice((" ,", ",  ", "\t,\t")))
        elif what == 3 and is_data(line) and not title:
            lines[i] = "  " + line + " \t"
        elif what == 4 and keyword_of(line) is not None:
            lines[i] = "  " + line
        elif what == 5 and is_data(line) and not title and not set("=<") & set(line):
            lines[i] = NUMBER.sub(lambda m: respell(rng, m.group()), line)
        elif what == 8 and keyword_of(line) is not None and not set("'\"<") & set(line):
            keyword, *options = line.split(",")
            rng.shuffle(options)
            lines[i] = ",".join([keyword.replace(" ", rng.choice(("", "  "))), *options])
    return rng.choice(("\n", "\r\n", "\r"))


def swap_case_outside_quotes(line):
    """The keyword and its options in lower case; values are names or words, in any case too."""
    if '"' in line or "'" in line or "<" in line:
        return line
    return line.lower()


def respell(rng, text):
    """The same number, written otherwise."""
    if not any(c in text for c in ".eEdD"):
        return text
    value = float(text.replace("D", "e").replace("d", "e"))
    spellings = [text, repr(value), f"{value:.17e}".replace("e", "D")]
    if not text.startswith(("+", "-")):
        spellings.append("+" + text)
    return rng.choice(spellings)
