"""The page of public decks: what is accepted, what is not and why, and how far both are apart."""

import math
import re
import textwrap
from collections import Counter, defaultdict

from bipot.report import table
from studies.pages import claim
from studies.public_deck_text import refusal_of

WITHIN = 0.02  # a difference that needs no explanation
SOURCES = ("users", "examples of tools", "tests of CalculiX")
MORTAR = ("face", "Displacements as written agree: what differs are the forces that CalculiX "
          "prints at supports with its mortar.")
SECTOR = ("", "With `stiffness=10000` the contact forces agree to 2e-5 and displacements to 5e-6. "
          "What differs are forces at supports on the sides of a sector; why is not known.")
REASONS = {    # what a variant does not say by itself: deck: (variant, words)
    "ccx/test/hueeber1_mortar.inp": MORTAR, "ccx/test/hueeber2_mortar.inp": MORTAR,
    "ccx/test/scheibe2f2f.inp": SECTOR, "ccx/test/scheibe2n2f.inp": SECTOR,
    "yahoo/Bolt_mm.inp": ("", "The contact forces agree to 0.088 %. At the largest slip of 1.9e-4 "
                          "mm CalculiX's stick slope of 1000 N/mm³ makes 0.19 MPa of friction, "
                          "where 0.1 of the largest pressure is 0.85 MPa. No run shows yet whether "
                          "that is all."),
    "yahoo/A4.inp": ("", "It is `Bolt_mm.inp` with `SMALL SLIDING`; both programs find what they "
                     "find in that."),
    "yahoo/Bolt_meter.inp": ("", "It is `Bolt_mm.inp` in metres, with the stick slope of 1000 as "
                             "in millimetres, a billionth of it: hardly any friction holds the "
                             "flange in CalculiX. bipot, which has no stick slope, finds the "
                             "displacements of `Bolt_mm.inp` to 4e-6."),
    "yahoo/model1.inp": ("", "Not explained yet. Its soft contact gives way by 0.0016 mm under "
                         "bipot's pressure of 101 MPa, 9 % of the largest displacement; with "
                         "`stiffness=100` CalculiX did not end within 200 s."),
}
# Static decks of solids that users sent and that are refused, and why.
LEFT = {
    "other/CubeTie/CubeTie.inp": "files that it includes are not in the collection",
    "yahoo/L-Shape_contact.inp": "its master surface is of elements that the deck does not have; "
                                 "CalculiX stops there, too",
    "yahoo/d-01-21Dec16-rev02.inp": "32000 of its 35395 elements are clockwise; CalculiX stops "
                                    "there, too",
    "yahoo/inp_combined_change-contact.inp": "its material changes in the second step, and a tie "
                                             "that was weak becomes stiff",
}

# Of the draw: why both programs differ.
DRAWN = {
    "examples/Contact/Leafspring/solve.inp":
        "`Leafspring` has two elements along its shortest leaf, and edges get 0.024 mm into other "
        "leaves between nodes, with which the run ends. Before bipot looked for that, the largest "
        "resultant of contact was 516 N, a quarter of it where supports move both leaves alike; "
        "CalculiX, whose contact is at nodes, has 398 N and none there. With elements of half the "
        "size bipot has 316 N, and none there: the mesh makes more of it than the programs do.",
    "src/Mod/Fem/femtest/data/ccx/constraint_tie.inp":
        "`constraint_tie`: CalculiX's tie does not carry the turn of the part; the forces of the "
        "supports agree to 7e-8.",
}


def worst(row):
    """Return the largest difference of a row, nan where nothing was compared."""
    found = [x for x in (row.contact, row.supports, row.displacement) if not math.isnan(x)]
    return max(found, default=math.nan)


def shown(x):
    """Return a difference in words."""
    if math.isnan(x):
        return "-"
    return f"{100 * x:.0f} %" if x >= 0.1 else f"{100 * x:.2g} %" if x >= 1e-4 else f"{x:.0e}"


def taken(seconds):
    """Return seconds to two digits, without a power of ten."""
    return f"{seconds:.0f}" if seconds >= 100 else f"{seconds:.2g}"


def families(rows):
    """Return the number of families of rows."""
    return len({row.family for row in rows})


def accepted_table(written):
    """Return the table of decks accepted, by source."""
    lines = []
    for source in (*SOURCES, "all"):
        rows = [row for row in written if source in (row.source, "all")]
        good = [row for row in rows if row.check == "accepted"]
        solved = [row for row in good if row.ours == "solved"]
        lines.append([source, len(rows), len(good), len(solved), families(rows), families(good),
                      families(solved)])
    return table(["source", "decks", "accepted", "solved", "families", "of these accepted",
                  "of these solved"], lines)


def refusal_table(written):
    """Return the table of what decks that are refused stumble over first."""
    groups = defaultdict(Counter)
    for row in written:
        if row.check != "accepted":
            groups[refusal_of(row.check)][row.source] += 1
    ordered = sorted(groups.items(), key=lambda item: (
        -item[1]["users"], -sum(item[1].values()), item[0]
    ))
    return table(["first message", *SOURCES], [
        [words, *(counts[source] or "" for source in SOURCES)] for words, counts in ordered
    ])


def compared_table(rows):
    """Return the table of the decks that both programs ran."""
    return table(
        ["deck", "bipot s", "CalculiX s", "steps", "contact", "supports", "displacements"],
        [[f"`{row.deck}`", taken(row.our_seconds), taken(row.their_seconds),
          f"{row.compared} of {row.steps}", shown(row.contact), shown(row.supports),
          shown(row.displacement)] for row in rows],
    )


def explained(row, variants):
    """Return the sentence that explains a difference of more than `WITHIN`."""
    tried = [(worst(other), other.variant) for other in variants if other.compared >= row.compared]
    tried = [pair for pair in tried if not math.isnan(pair[0])]
    least, variant = min(tried, default=(math.nan, ""))
    how, words = REASONS.get(row.deck, ("", ""))
    if how:
        least, variant = next(pair for pair in tried if pair[1] == how)
    said = claim(least < max(WITHIN, worst(row) / 3),
                 f"{shown(least)} with `{variant}`") if not words or how else ""
    text = f"- `{row.deck}`: {shown(worst(row))} as written"
    return f"{text}, {said}. {words}".strip() if said else f"{text}. {words}"


def ended(rows, variants):
    """Return sentences on accepted decks that were not compared over all steps."""
    lines = []
    for row in rows:
        if not row.ours or (row.ours == "solved" and row.theirs in ("solved", "")):
            continue
        runs = (("bipot", row.ours, row.our_seconds), ("CalculiX", row.theirs, row.their_seconds))
        who = [f"{name} {how} ({taken(seconds)} s)" for name, how, seconds in runs if how]
        note = f": {row.note}" if row.note else ""
        line = f"- `{row.deck}`: {', '.join(who)}{note}".rstrip(".") + "."
        other = [one for one in variants[row.deck] if one.compared == one.steps > 0]
        if other:
            least = min(other, key=worst)
            line += f" With `{least.variant}` both are {shown(worst(least))} apart."
        lines.append(line)
    return lines


def wrapped(lines):
    """Return the lines, those of lists no longer than 100 columns."""
    return [part for line in lines for part in (
        textwrap.wrap(line, 100, subsequent_indent="  ", break_on_hyphens=False,
                      break_long_words=False) if line.startswith("- ") else [line]
    )]


def drawn_table(drawn):
    """Return the table of a draw's decks: what is in the way, or how it ran."""
    lines = []
    for row in drawn:
        if row.check != "accepted":
            said = re.sub(r"^.*?: error: ", "", row.check).split(": bipot solves")[0]
            said = textwrap.shorten(said.split(";")[0], 100, placeholder=" ...")
            outcome = f"refused: {said}"
        elif row.ours == "stopped":
            outcome = f"not solved within {taken(row.our_seconds)} s"
        else:
            outcome = f"{row.ours} ({taken(row.our_seconds)} s)"
        if row.option:
            outcome = f"with `{row.option}` {outcome}"
        if row.compared:
            outcome += (f"; CalculiX ({taken(row.their_seconds)} s): contact {shown(row.contact)}, "
                        f"displacements {shown(row.displacement)}")
        name = "/".join(row.deck.split("/")[-2:])
        lines.append([f"`{name}`", outcome.replace("|", "/")])
    return table(["deck", "outcome"], lines)


def draw(drawn):
    """Return the section on decks drawn from other repositories."""
    by_repository = defaultdict(list)
    for row in drawn:
        by_repository[row.source].append(row)
    accepted = [row for row in drawn if row.check == "accepted"]
    plain = [row for row in accepted if not row.option]
    lines = [
        "", f"## {len(drawn)} decks of {len(by_repository)} other repositories", "",
        f"Tried on {max(row.day for row in drawn)}, from repositories of GitHub by a rule that was",
        "written before any deck was looked into: of each repository the first three, by path, of",
        "the decks with static steps alone, a `*CONTACT PAIR`, `*TIE` or `*SURFACE INTERACTION`,",
        "and elements C3D, CPE, CPS or CAX (or includes), that are not in the collection above;",
        "then the fourth of each, and so on. Meshes that decks include and repositories lack were",
        "made by cgx where their examples have its input. Runs may take 200 s. Decks are named by",
        "their last folder; `studies/data/public_draw.csv` has the whole paths.", "",
        f"{len(plain)} are accepted, {len(accepted) - len(plain)} more with an option;",
        f"{sum(row.ours == 'solved' for row in accepted)} of these are solved.",
    ]
    for repository, rows in by_repository.items():
        link = f"[{repository}](https://github.com/{repository})"
        lines += ["", f"{link} at `{rows[0].commit[:12]}`:", "", *drawn_table(rows)]
        for row in rows:
            if row.deck in DRAWN:
                lines += ["", *textwrap.wrap(DRAWN[row.deck], 100)]
    return lines


def page(rows, where, drawn=()):
    """Return the page's text."""
    written = [row for row in rows.values() if not row.variant]
    accepted = [row for row in written if row.check == "accepted"]
    compared = [row for row in accepted if row.compared]
    apart = [row for row in compared if worst(row) > WITHIN]
    variants = defaultdict(list)
    for row in rows.values():
        if row.variant:
            variants[row.deck].append(row)
    near = len(compared) - len(apart)
    stopped = ended(accepted, variants)
    lines = [
        "# Public decks beside CalculiX", "",
        f"By `studies/run public_decks FOLDER` on {where},",
        "one thread a program; `studies/data/public_decks.csv` holds all rows. The folder is the",
        "collection [calculix/examples](https://github.com/calculix/examples): CalculiX's own",
        "tests, examples of tools for it, and decks that users sent to its mailing list and forum.",
        "All its `.inp` files with a `*CONTACT PAIR` are here, under the names they have there.",
        "", "## What is accepted", "",
        "Accepted: `bipot --check` has no objection. Decks are one family if they are equal but",
        "for blanks, capitals, comments, heading, output requests, and what chooses the type of",
        "contact: `TYPE` of `*CONTACT PAIR`, `*SURFACE BEHAVIOR`, the stick slope of `*FRICTION`.",
        "", *accepted_table(written),
        "", "## What the others stumble over", "",
        "The first message of each, names and numbers left out.",
        "", *refusal_table(written),
        "",
        "Static decks of solids that users sent, among these:", "",
        *(f"- `{row.deck}`: {LEFT[row.deck]}." for row in written
          if row.deck in LEFT and row.check != "accepted"),
        "", "## Both programs", "",
        "CalculiX runs a copy of the deck that prints all displacements and forces at the ends of",
        "steps; a pair without `TYPE`, which it refuses, gets `SURFACE TO SURFACE`, or `NODE TO",
        "SURFACE` where its slave is a surface of nodes. Both are compared at the ends of all",
        "steps that both have. Contact: the resultants of contact on the bodies, largest",
        "difference over the largest resultant; a body's is the opposite of the sum of the forces",
        "that CalculiX prints at its nodes. Supports: the same of the forces at a body's nodes",
        "that supports hold. Displacements: largest difference at a node over the largest",
        "displacement. A dash: there are none, or they are zero by symmetry. Forces on",
        "bodies with nodes that CalculiX does not print (slices that stand for elements of a",
        "plane, bolts that are cut) are left out. Times are CPU seconds.", "",
        *compared_table(sorted(compared, key=lambda row: (SOURCES.index(row.source), row.deck))),
        "",
        f"- {near} of {len(compared)} differ by no more than {100 * WITHIN:g} %.",
    ]
    left = [f"`{row.deck}`" + (f" ({row.note})" if row.note else "") for row in accepted
            if not row.ours]
    if left:
        lines.append(f"- Accepted and not run yet, with the time that the plan foresees: "
                     f"{', '.join(left)}.")
    alone = [f"`{row.deck}` ({taken(row.our_seconds)} s)" for row in accepted
             if row.ours == "solved" and not row.theirs]
    if alone:
        lines.append(f"- Solved by bipot, and not run in CalculiX yet: {', '.join(alone)}.")
    if apart:
        lines += [
            "", f"## Differences over {100 * WITHIN:g} %", "",
            "Each was run again with another contact in CalculiX's deck: `stiffness=F` is its",
            "linear stiffness times F (F times 50 E, its default for `HARD`, in place of another",
            "law), `slope=F` its stick slope times F, `face` its contact of faces; `once` begins",
            "each step with an increment of all of it. What brings CalculiX to bipot's result is",
            "what the difference is due to.", "",
            *(explained(row, variants[row.deck]) for row in apart),
        ]
    if stopped:
        lines += [
            "", "## Runs that did not end", "",
            "What ended them is the program's message. `translations` leaves out the supports of",
            "rotations, which CalculiX refuses there; `full` integrates CPE4R in full, as bipot",
            "does.",
            "", *stopped,
        ]
    if drawn:
        lines += draw(list(drawn.values()))
    return "\n".join(wrapped(lines)) + "\n"
