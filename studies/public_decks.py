"""Public decks with contact, here and in CalculiX: docs/studies/public-decks.md.

    studies/run public_decks FOLDER [--only NAME,...] [--variant "slope=100 stiffness=100"]
    studies/run public_decks FOLDER --draw LIST [--only NAME,...]
    studies/run public_decks --page

FOLDER holds decks, such as a clone of github.com/calculix/examples. Each that has a *CONTACT PAIR
is checked; those that are accepted are run with one thread, one after the other, here and by
CalculiX, and compared at the ends of their steps. Rows go into studies/data/public_decks.csv, in
place of older ones, and the page is written from that file, with --page alone. A variant changes
the contact of CalculiX's deck: `studies/public_deck_text.py` says how. Status 77: CalculiX
is not installed.

A draw from other repositories has a list, a line a deck: the repository (owner/name), its commit
and the deck's path, between tabs; decks are in FOLDER/owner+name. Its rows go into
studies/data/public_draw.csv.
"""

import argparse
import csv
import math
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bipot.peers.runs import CCX, absent, measure
from bipot.program import built_program, program_path, run_words
from bipot.report import machine
from bipot.result import Result
from studies.pages import DATA, PAGES, put_page
from studies.public_deck_page import page
from studies.public_deck_text import (
    decks_in,
    family_key,
    for_bipot,
    for_calculix,
    is_mortar,
    read_cards,
    source_of,
)

KEPT = DATA / "public_decks.csv"
DRAWN = DATA / "public_draw.csv"
PAGE = PAGES / "public-decks.md"
CHECK_LIMIT = 300  # seconds
SMALL = 1e-6       # resultants below this part of the nodal forces are rounding


@dataclass
class Row:
    """A deck, or a variant of it for CalculiX."""

    deck: str
    variant: str = ""
    source: str = ""
    family: str = ""          # its first deck
    check: str = ""           # accepted, or the first message
    ours: str = ""            # solved, not solved, stopped, refused
    our_seconds: float = math.nan
    theirs: str = ""          # solved, not solved, stopped
    their_seconds: float = math.nan
    steps: int = 0
    compared: int = 0         # steps that both have
    contact: float = math.nan       # difference of the forces of contact on the bodies
    supports: float = math.nan      # of the forces of the supports
    displacement: float = math.nan
    note: str = ""

    @property
    def key(self):
        """What tells rows apart."""
        return self.deck, self.variant


@dataclass
class Drawn(Row):
    """A deck of another repository, its source."""

    commit: str = ""
    option: str = ""          # of the command line, with which it is accepted
    day: str = ""             # when it was tried


def read_rows(path=KEPT, kind=Row, key=lambda row: row.key):
    """Return the rows kept, by deck and variant."""
    if not path.is_file():
        return {}
    kinds = {field.name: field.type for field in fields(kind)}
    with path.open(encoding="utf-8", newline="") as file:
        rows = [kind(**{name: kinds[name](text) for name, text in line.items()})
                for line in csv.DictReader(file)]
    return {key(row): row for row in rows}


def keep_rows(rows, path=KEPT):
    """Write the rows, sorted."""
    with path.open("w", encoding="utf-8", newline="") as file:
        kind = next((type(row) for row in rows.values()), Row)
        writer = csv.DictWriter(file, [field.name for field in fields(kind)], lineterminator="\n")
        writer.writeheader()
        for _, row in sorted(rows.items()):
            writer.writerow({
                name: f"{value:.3g}" if isinstance(value, float) else value
                for name, value in asdict(row).items()
            })


def checked(program, deck, option=""):
    """Return "accepted", or the first message of a deck that is refused."""
    try:
        done = subprocess.run(
            [program, "--check", *option.split(), deck.name], cwd=deck.parent,
            capture_output=True, text=True, errors="replace", timeout=CHECK_LIMIT, check=False,
        )
    except subprocess.TimeoutExpired:
        return f"not checked within {CHECK_LIMIT} s"
    if done.returncode == 0:
        return "accepted"
    errors = [line for line in done.stderr.splitlines() if "error: " in line]
    return errors[0] if errors else f"ended with status {done.returncode}"


def foreseen(program, deck):
    """Return what the plan says of the time of a run: "38 min of CPU time", or nothing."""
    done = subprocess.run([program, "--plan", deck.name], cwd=deck.parent, capture_output=True,
                          text=True, errors="replace", timeout=CHECK_LIMIT, check=False)
    found = re.search(r"^ *time +about +(.*? of CPU time)", done.stdout, re.MULTILINE)
    return found[1] if found else ""


def run_bipot(program, cards, variant, folder, limit, option=""):
    """Run the deck of these cards; return how it ended, the time, the result or None, a message."""
    (folder / "ours.inp").write_text(for_bipot(cards, variant), encoding="latin-1")
    log = folder / "ours.log"
    command = run_words(program, "ours.inp", "ours.vtkhdf", {}) + option.split()
    taken = measure(command, folder, log, lambda seconds: seconds > limit)
    how = {0: "solved", 1: "refused", 2: "not solved"}.get(taken.status, "failed")
    try:
        result = Result(folder / "ours.vtkhdf")
    except Exception:  # there may be none, or half of one
        result = None
    said = [line for line in log.read_text(errors="replace").splitlines()
            if not line.startswith("note: ")]
    message = said[0] if said and how != "solved" else ""
    return "stopped" if taken.stopped else how, taken.seconds, result, message


def run_calculix(cards, variant, folder, limit):
    """Run CalculiX; return how it ended, the time, and what it printed: {time: {name: array}}."""
    (folder / "theirs.inp").write_text(for_calculix(cards, variant), encoding="latin-1")
    log = folder / "theirs.log"
    taken = measure([CCX, "-i", "theirs"], folder, log, lambda seconds: seconds > limit)
    finished = "Job finished" in log.read_text(errors="replace")
    how = "stopped" if taken.stopped else "solved" if finished else "not solved"
    said = re.findall(r"\*ERROR[^\n]*", log.read_text(errors="replace"))
    return how, taken.seconds, read_printed(folder / "theirs.dat"), said[0] if said else ""


def read_printed(path):
    """Return what a .dat file has of all nodes: {time: {"displacements" or "forces": (N, 4)}}."""
    found, rows = {}, None
    if not path.is_file():
        return found
    for line in path.read_text(errors="replace").splitlines():
        head = re.match(r" (displacements|forces) .* for set \S+ and time\s+(\S+)", line)
        if head:
            rows = found.setdefault(float(head[2]), {})[head[1]] = []
        elif rows is not None and line.strip():
            try:
                rows.append([float(word) for word in line.split()])
            except ValueError:
                rows = None
    return {time: {name: np.array(rows) for name, rows in printed.items()}
            for time, printed in found.items()}


def bodies_of(result):
    """Return the number of the body of each node, (N): nodes of one element are of one body."""
    label = np.arange(len(result.points))
    groups = [nodes for _, nodes in result.cells.values()]
    while True:
        before = label.copy()
        for nodes in groups:
            least = label[nodes].min(axis=1)
            for column in nodes.T:
                np.minimum.at(label, column, least)
        label = label[label]
        if (label == before).all():
            return np.unique(label, return_inverse=True)[1]


def sums(values, bodies):
    """Return the sums (B, 3) of values at nodes over each body."""
    total = np.zeros((bodies.max() + 1, values.shape[1]))
    np.add.at(total, bodies, values)
    return total


def relative(pairs, floor):
    """Return the largest difference of pairs of arrays over the largest of the first ones.

    nan where these are no more than `floor`: nothing but rounding.
    """
    scale = max((abs(ours).max(initial=0) for ours, _ in pairs), default=0)
    if scale <= floor:
        return math.nan
    return max(abs(ours - theirs).max() for ours, theirs in pairs) / scale


def compare(result, printed, row, mortar=False):
    """Put into a row how far both are apart at the ends of steps that both have.

    A body's contact force is the opposite of the sum of CalculiX's forces at its nodes, which are
    those of supports and loads; with its mortar (`mortar`) they are in balance with contact, and
    say nothing of it. Forces of supports are summed over the nodes of a body that supports hold.
    """
    bodies = bodies_of(result)
    ends = [(k, float(result.history("time")[k])) for k in result.step_ends]
    fields_at = {int(r): k for k, r in enumerate(result.field_rows)}
    contact, supports, moved, floor = [], [], [], 0.0
    for k, time in ends:
        near = [t for t in printed if abs(t - time) <= 1e-5 * max(time, 1e-30)]
        if not near or k not in fields_at:
            continue
        numbers = printed[near[0]]["displacements"][:, 0].astype(int)
        at = {node: i for i, node in enumerate(numbers)}
        ours = [i for i, node in enumerate(result.node_ids) if int(node) in at]
        rows = [at[int(result.node_ids[i])] for i in ours]
        theirs = {name: np.zeros((len(bodies), 3)) for name in printed[near[0]]}
        for name, lines in printed[near[0]].items():
            theirs[name][ours] = lines[rows, 1:4]
        row.compared += 1
        moved.append((result.field("displacement", fields_at[k])[ours],
                      theirs["displacements"][ours]))
        # A slice that elements of a plane stand for, and a bolt that is cut, have other nodes.
        whole = np.bincount(bodies[ours], minlength=bodies.max() + 1) == np.bincount(bodies)
        if not whole.any():
            continue
        reaction = result.field("reaction_force", fields_at[k])
        held = (abs(reaction).max(axis=1) > 0)[:, None]
        outer = (reaction + result.field("applied_force", fields_at[k])) * held
        supports.append((sums(outer, bodies)[whole],
                         sums(theirs["forces"] * held, bodies)[whole]))
        floor = max(floor, SMALL * abs(reaction).sum())
        if "contact_force" in result.field_names[0] and not mortar:
            force = result.field("contact_force", fields_at[k])
            contact.append((sums(force, bodies)[whole],
                            -sums(theirs["forces"], bodies)[whole]))
            floor = max(floor, SMALL * abs(force).sum())
    row.contact = relative(contact, floor)
    row.supports = relative(supports, floor)
    row.displacement = relative(moved, 0.0)


def run_deck(program, row, cards, options):
    """Run a deck in both programs and fill its row."""
    row.steps = sum(card.keyword == "STEP" for card in cards)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        row.ours, row.our_seconds, result, message = run_bipot(
            program, cards, row.variant, folder, options.limit, getattr(row, "option", "")
        )
        row.note = message
        if result is None or options.alone:
            return  # nothing to compare
        with result:
            row.theirs, row.their_seconds, printed, error = run_calculix(
                cards, row.variant, folder, options.limit
            )
            row.note = row.note or error
            compare(result, printed, row, is_mortar(cards, row.variant))


def cards_of(deck):
    """Return the cards of a deck, none where a file that it includes is not there."""
    try:
        return read_cards(deck)
    except FileNotFoundError:
        return []


def study(folder, program, options, rows):
    """Check all decks of a folder, run those that are accepted, keep each row as it is made."""
    decks = {str(deck.relative_to(folder)): deck for deck in decks_in(folder)}
    chosen = [name for name in decks
              if not options.only or any(only in name for only in options.only.split(","))]
    family = {row.deck: row.family for row in rows.values()}
    if not family.keys() >= set(chosen):
        family, first = {}, {}
        for name, deck in decks.items():
            family[name] = first.setdefault(family_key(cards_of(deck)) or name, name)
    for name in chosen:
        deck = decks[name]
        cards = cards_of(deck)
        row = Row(name, options.variant, source_of(deck, folder), family[name],
                  checked(program, deck))
        if row.check == "accepted" and not options.check:
            run_deck(program, row, cards, options)
        elif options.check and row.key in rows:
            rows[row.key].check, row = row.check, rows[row.key]
        if options.check and row.check == "accepted" and not row.ours:
            row.note = foreseen(program, deck)
        rows[row.key] = row
        keep_rows(rows, options.csv)
        print(row, file=sys.stderr, flush=True)


def study_draw(folder, program, options, rows):
    """Check and run the decks of a draw, in the order of its list."""
    for line in options.draw.read_text(encoding="utf-8").splitlines():
        repository, commit, path = line.split("\t")
        if options.only and not any(only in line for only in options.only.split(",")):
            continue
        deck = folder / repository.replace("/", "+", 1) / path
        row = Drawn(path, source=repository, commit=commit,
                    day=datetime.now(UTC).date().isoformat())
        row.check = checked(program, deck)
        if "--elastic" in row.check and checked(program, deck, "--elastic") == "accepted":
            row.check, row.option = "accepted", "--elastic"
        if row.check == "accepted" and not options.check:
            run_deck(program, row, cards_of(deck), options)
        rows[f"{repository} {path}"] = row
        keep_rows(rows, DRAWN)
        print(row, file=sys.stderr, flush=True)


def read_drawn():
    """Return the rows of the draw, by repository and path."""
    rows = read_rows(DRAWN, Drawn, lambda row: f"{row.source} {row.deck}")
    return dict(sorted(rows.items()))


def main():
    """Check, run and compare; write the page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", type=Path, help="where the decks are")
    parser.add_argument("-o", dest="page", type=Path, default=PAGE)
    parser.add_argument("--csv", type=Path, default=KEPT, help="where rows are kept")
    parser.add_argument("--only", default="", help="parts of names of decks")
    parser.add_argument("--check", action="store_true", help="do not run what is accepted")
    parser.add_argument("--alone", action="store_true", help="do not run CalculiX")
    parser.add_argument("--variant", default="", help="changes of CalculiX's contact")
    parser.add_argument("--limit", type=float, default=200.0, help="processor seconds a run")
    parser.add_argument("--draw", type=Path, help="a list of decks of other repositories")
    parser.add_argument("--page", dest="kept", action="store_true",
                        help="write the page from the rows kept")
    parser.add_argument("--machine", default=machine(), help="where these were made (here)")
    parser.add_argument("--bipot", type=Path, default=program_path(), help="the program")
    options = parser.parse_args()
    rows = read_rows(options.csv)
    if not options.kept:
        if options.folder is None:
            parser.error("a folder of decks is needed, or --page")
        if shutil.which(CCX) is None:
            print(f"{absent('CalculiX')}; no page without it")
            return 77
        folder, program = options.folder.resolve(), built_program(options.bipot).resolve()
        if options.draw:
            study_draw(folder, program, options, read_drawn())
        else:
            study(folder, program, options, rows)
    put_page(page(rows, options.machine, read_drawn()), options.page)
    return 0


if __name__ == "__main__":
    sys.exit(main())
