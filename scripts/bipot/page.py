"""A result as one page of HTML: pictures, plan, errors and certificate, and nothing outside it."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterable, Sequence
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bipot.drawing.style import save
from bipot.page_style import STYLE
from bipot.pictures import Look, pictures_of
from bipot.summary import HEAD, UNKNOWN, row_in_words, summarize

if TYPE_CHECKING:
    from bipot.mesh_sequence import MeshSequence
    from bipot.result import Result

MOST_LINES = 400  # of a deck's part
BEGIN = re.compile(r"(?i)\*\* \s*\*\s*INCLUDE\b")
MOST_ROWS = 1000  # of a table of increments; of more, the ends of steps and the worst
WORST = 50
LARGE = 0.1  # error by small strain that is worth a warning
CLASS_TEXT = ' class="text"'
CERTIFIED = {1: "yes", 0: "no", -1: "pending"}


def write_page(result: Result, path: Path, look: Look | None = None) -> Path:
    """Write the page of a result with at least one increment; return its path."""
    path.write_text(make_page(result, look), encoding="utf-8")
    return path


def make_page(result: Result, look: Look | None = None) -> str:
    """Return the page's text."""
    title, name = escape(deck_title(result)), escape(result.path.stem)
    sections = [
        ("summary", "Summary", summary(result)),
        ("notes", "Notes and warnings", notes(result)),
        ("forces", "Contact forces", forces(result)),
        ("pictures", "Pictures", pictures(result, look)),
        ("errors", "Estimated errors", estimated_errors(result)),
        ("plan", "Plan", plan(result)),
        ("certificate", "Certificate", certificate(result)),
        ("deck", "Deck", deck(result)),
    ]
    sections = [section for section in sections if section[2]]
    links = "\n".join(f'<a href="#{key}">{head}</a>' for key, head, _ in sections)
    body = "\n".join(
        f'<section aria-labelledby="{key}">\n<h2 id="{key}">{head}</h2>\n{text}\n</section>'
        for key, head, text in sections
    )
    return f"""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<link rel="icon" href="data:,">
<title>{title} ({name})</title>
<style>
{STYLE}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p class="about">{name}: a run of bipot {escape(str(result.run.get("version", "")))},
 {escape(str(result.run.get("started", "")))}</p>
</header>
<nav aria-label="Sections">
{links}
</nav>
<main>
{body}
</main>
</body>
</html>
"""


# --- Pieces of HTML -----------------------------------------------------------------------------


def number(value: Any) -> str:
    """Return a number as text: whole ones as they are, others with six digits."""
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else f"{value:.6g}"


def short(value: Any) -> str:
    """Return an error as text, with three digits."""
    return f"{value:.3g}"


def brief(value: float) -> str:
    """Return an error as text, in the least room: "1.2e-9"."""
    return re.sub(r"e([-+])0*", lambda found: f"e{found[1].strip('+')}", f"{value:.2g}")


def cells(kind: str, row: Sequence[str], texts: int, attributes: str = "") -> str:
    """Return the cells of a row, of which the first `texts` are words."""
    return "".join(
        f"<{kind}{attributes}{CLASS_TEXT if k < texts else ''}>{escape(text)}</{kind}>"
        for k, text in enumerate(row)
    )


def table(
    caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], texts: int = 1,
    bad: Iterable[int] = (), key: str = "",
) -> str:
    """Return a table; the rows whose numbers are in `bad` are marked, `key` is its id."""
    marked = set(bad)
    lines = [
        ('<tr class="bad">' if k in marked else "<tr>") + cells("td", row, texts) + "</tr>"
        for k, row in enumerate(rows)
    ]
    named = f' id="{key}"' if key else ""
    header = cells("th", head, texts, ' scope="col"')
    return "\n".join([
        f'<div class="wide"><table{named}>', f"<caption>{escape(caption)}</caption>",
        f"<thead><tr>{header}</tr></thead>", "<tbody>", *lines, "</tbody>", "</table></div>",
    ])


def details(label: str, text: str, opened: bool = False) -> str:
    """Return text behind a line that opens and closes it."""
    tag = "<details open>" if opened else "<details>"
    return f"{tag}\n<summary>{escape(label)}</summary>\n{text}\n</details>"


# --- Sections -----------------------------------------------------------------------------------


def deck_title(result: Result) -> str:
    """Return what follows *HEADING in the deck, or the name of the run."""
    lines = result.run_text("deck").splitlines()
    for line, following in pairwise(lines):
        if line.strip().upper().startswith("*HEADING") and following[:1] != "*":
            return following.strip() or result.path.stem
    return result.path.stem


def summary(result: Result) -> str:
    """Return what one wants to know first."""
    good = int((result.history("certified") == 1).sum())
    counters = result.counters if "counters" in result.file["run"] else {}
    took = counters.get("seconds_total", 0.0)
    verdict = (
        f"All {result.finished} increments are certified." if result.certified else
        f"{good} of {result.finished} increments are certified."
    )
    words = {
        "status": str(result.run.get("status", "unknown")),
        "worst error of the certificate": worst_in_words(result, counters),
        "mesh": f"{len(result.points)} nodes, {len(result.element_ids)} elements",
        "steps": f"{len(result.step_ends)}, to the time {result.history('time')[-1]:.6g}",
        "units": f"{result.units.force}, {result.units.length}" if result.units.force else "",
        "took": f"{took:.3g} s" if took else "",
        "started": str(result.run.get("started", "")),
        "command": str(result.run.get("command", "")),
        "overrides": " ".join(result.run_text("overrides").split("\n"))
        if "overrides" in result.file["run"] else "",
        "program": " ".join(
            str(result.run.get(key, "")) for key in ("program", "version")
        ),
        "libraries": str(result.run.get("libraries", "")),
        "build": str(result.run.get("build", "")),
    }
    rows = "\n".join(
        f'<tr><th scope="row" class="text">{key}</th><td class="text">{escape(text)}</td></tr>'
        for key, text in words.items() if text.strip()
    )
    kind = "good" if result.certified else "bad"
    return (
        f'<p class="{kind}">{verdict}</p>\n<div class="wide"><table id="run">\n'
        f"<caption>The run</caption>\n<tbody>\n{rows}\n</tbody></table></div>"
    )


def worst_in_words(result: Result, counters: dict[str, float]) -> str:
    """Return the largest entry of the certificate, and what was allowed where the file says it."""
    allowed = counters.get("certificate_tolerance", 0.0)
    return short(result.worst_error) + (f" (allowed: {short(allowed)})" if allowed > 0 else "")


def notes(result: Result) -> str:
    """Return what the program noted of the deck, and what its numbers say of the run."""
    found = [(line, False) for line in result.notes]
    found += [(line, True) for line in warnings(result)]
    if not found:
        return "<p>None.</p>"
    lines = [f"<li{' class=' + chr(34) + 'bad' + chr(34) if bad else ''}>{escape(line)}</li>"
             for line, bad in found]
    return "<ul>\n" + "\n".join(lines) + "\n</ul>"


def warnings(result: Result) -> list[str]:
    """Return what of the run is not as it should be, by its numbers."""
    found = []
    status = result.run.get("status")
    if status not in ("finished", "settled"):
        found.append(f"the run's status is '{status}': {result.finished} increments are there")
    bad = np.flatnonzero(result.history("certified") == 0) + 1
    if len(bad):
        more = ", ..." if len(bad) > 10 else ""
        found.append(f"not certified: increments {', '.join(map(str, bad[:10]))}{more}")
    counters = result.counters if "counters" in result.file["run"] else {}
    error = counters.get("largest_small_strain_error", 0.0)
    if error > LARGE:
        off = "an unknown amount" if error > 1e300 else f"{100 * error:.2g} %"
        is_off = "is" if result.small_strain_is == "estimate" else "may be"
        found.append(f"small strain {is_off} off by {off}: strains up to "
                     f"{100 * counters['largest_strain']:.2g} %, rotations up to "
                     f"{counters['largest_rotation']:.2g} rad")
    for name, words in (
        ("increments_cut", "increments that were not solved, and tried again with half their size"),
        ("kinks_inside_increments", "breakpoints of amplitudes inside increments"),
        ("first_touches_inside_increments", "contact that begins inside increments"),
        ("solver_fallbacks", "times another solver took over"),
    ):
        if counters.get(name, 0) > 0:
            found.append(f"{words}: {counters[name]:.0f}")
    return found


def pictures(result: Result, look: Look | None) -> str:
    """Return the pictures, inlined."""
    made = []
    for picture in pictures_of(result, look):
        target = io.BytesIO()
        save(picture.figure, target, picture.tight, form="png")
        data = base64.b64encode(target.getvalue()).decode()
        text = escape(picture.text)
        made.append(
            f'<figure>\n<img alt="{text}" src="data:image/png;base64,{data}">\n'
            f"<figcaption>{text}</figcaption>\n</figure>"
        )
    return "\n".join(made)


def forces(result: Result) -> str:
    """Return what came of the pairs at the end of each step, with its errors."""
    rows = summarize(result)
    if not rows:
        return ""
    status = {pair.name: pair.status for pair in result.pairs.values()}
    ends = {int(result.history("step")[row]): row for row in result.step_ends}
    lines = []
    for row in rows:
        at = ends[row["step"]]
        counts = np.bincount(status[row["pair"]][at].astype(int), minlength=3)
        words = row_in_words(row)
        values = [
            value if error == UNKNOWN else f"{value} ± {error}"
            for value, error in zip(words[2:10:2], words[3:10:2], strict=True)
        ]
        lines.append([words[1], result.label(at), *values, *words[10:], *map(str, counts[:3])])
    head = ("pair", "at", *HEAD[2:10:2], *HEAD[10:], "open", "stick", "slide")
    names = dict.fromkeys(map(result.units.of, ("force", "pressure", "length", "moment")))
    units = ", ".join(names)
    return table(
        "Forces on the slave bodies, largest pressures and slips, moments about the middle of the "
        "slave surface or its axis, and states of the points, at the "
        f"ends of the steps ({units}); ±: estimated error", head, lines, texts=2,
        key="resultants",
    )


def estimated_errors(result: Result) -> str:
    """Return the errors by source: of several runs what they say together, else each step's."""
    if result.accuracy is not None and result.accuracy.mesh >= 0:
        return errors_of_runs(result.accuracy)
    names = [name for name in result.history_names if name.startswith("error/")]
    if not names:
        return ""
    values = np.stack([result.history(name) for name in names], axis=1)
    known = np.flatnonzero(values[:, names.index("error/mesh")] >= 0)
    chosen = chosen_rows(result, known, values.max(axis=1))
    # What is estimated nowhere has no column.
    shown = [k for k in range(len(names)) if (values[chosen, k] >= 0).any()]
    rows = [
        [str(row + 1), result.label(row),
         *(short(v) if v >= 0 else UNKNOWN for v in values[row, shown])]
        for row in chosen
    ]
    if not rows:
        return "<p>None was estimated.</p>"
    head = ("increment", "at", *(names[k].removeprefix("error/").replace("_", " ") for k in shown))
    subject = "energy" if result.error_of_energy else "contact force"
    return table(f"Of the {subject}, relative; {UNKNOWN}: not estimated", head, rows, texts=2,
                 key="estimates")


def errors_of_runs(runs: MeshSequence) -> str:
    """Return what the runs by which an accuracy was looked for say of the last one."""
    head = ("run", "elements", "edges over the deck's", "parts of increments", "CPU time [s]")
    rows = [
        [str(k + 1), str(runs.elements[k]), short(runs.element_size[k]), str(runs.divisions[k]),
         short(runs.processor_time[k])]
        for k in range(len(runs))
    ]
    parts = [
        f"{words} {short(value) if value >= 0 else 'not estimated'}" for words, value in (
            ("mesh", runs.mesh), ("load steps", runs.load_steps),
            ("contact and arithmetic", runs.others),
        )
    ]
    if runs.small_strain >= 0:
        error = "unknown" if runs.small_strain > 1e300 else short(runs.small_strain)
        parts.append(f"small strain {error}")
    reached = "reached" if runs.reached else "not reached"
    asked = f"; {short(runs.wanted)} was asked for and is {reached}" if runs.wanted else ""
    what = "extrapolated values" if runs.of_extrapolated else "result"
    said = (f"Estimated error of the {what}, relative, by {len(runs)} runs: "
            f"{', '.join(parts)}{asked}.")
    return f"<p>{said}</p>\n" + table(
        "Runs, the last of which is the result", head, rows, key="estimates"
    )


def chosen_rows(result: Result, rows: Any, badness: Any) -> list[int]:
    """Return the rows that a table shows: all, or the ends of steps and the worst of too many."""
    if len(rows) <= MOST_ROWS:
        return [int(row) for row in rows]
    worst = rows[np.argsort(badness[rows])[::-1][:WORST]]
    ends = np.intersect1d(result.step_ends, rows)[-MOST_ROWS:]
    return sorted({int(row) for row in (*ends, *worst)})


def certificate(result: Result) -> str:
    """Return the certificate of the increments."""
    entries = result.certificate
    certified = result.history("certified")
    worst = np.max(list(entries.values()), axis=0)
    rows = chosen_rows(result, np.arange(result.finished), worst)
    lines = [
        [str(row + 1), result.label(row), CERTIFIED.get(int(certified[row]), "?"),
         *(brief(values[row]) for values in entries.values())]
        for row in rows
    ]
    bad = [k for k, row in enumerate(rows) if certified[row] == 0]
    counters = result.counters if "counters" in result.file["run"] else {}
    caption = f"Errors of {len(rows)} increments, relative"
    if counters.get("certificate_tolerance", 0) > 0:
        caption += f", each allowed {short(counters['certificate_tolerance'])}"
    if len(rows) < result.finished:
        caption += f": the ends of the steps and the {WORST} worst of {result.finished}"
    made = table(
        caption, ("increment", "at", "certified", *entries), lines, texts=3, bad=bad,
        key="certificates",
    ).replace("<table", '<table class="narrow"', 1)
    return made if len(rows) <= 30 else details(f"{len(rows)} increments", made, True)


def plan_table(lines: list[str]) -> str:
    """Return the printed plan as a table: what, how it is meant, and how much.

    A line without a name goes on with the one before.
    """
    rows = [[line[:16].strip(), line[16:25].strip(), line[25:].strip()] for line in lines]
    return table("As it was printed before the run began", ("quantity", "bound", "planned"),
                 rows, texts=3, key="plan-table")


def plan(result: Result) -> str:
    """Return the plan as it was printed, and what was planned beside what was done."""
    made = []
    if "plan" in result.file["run"]:
        made.append(plan_table(result.run_text("plan").rstrip().splitlines()))
    if "counters" in result.file["run"]:
        planned = result.estimates if "estimates" in result.file["run"] else {}
        rows = [
            [name.replace("_", " "), number(planned[name]) if name in planned else "",
             number(value)]
            for name, value in result.counters.items()
        ]
        made.append(details("All numbers of the run, planned and done", table(
            "Times in seconds, memory and files in bytes", ("", "planned", "done"), rows,
            key="counters",
        )))
    return "\n".join(made)


def deck(result: Result) -> str:
    """Return the deck as it was written, its includes folded."""
    lines = result.run_text("deck").splitlines()
    return f'<div class="deck">\n{folded(lines)}\n</div>'


def folded(lines: list[str]) -> str:
    """Return lines of a deck; those of each include behind the line that names it."""
    made, plain, k = [], [], 0

    def put_plain() -> None:
        if plain:
            more = [f"... and {len(plain) - MOST_LINES} more lines"] * (len(plain) > MOST_LINES)
            made.append(f"<pre>{escape(chr(10).join([*plain[:MOST_LINES], *more]))}</pre>")
            plain.clear()

    while k < len(lines):
        end = end_of_include(lines, k)
        if end is None:
            plain.append(lines[k])
        else:
            inner = lines[k + 1 : end]
            put_plain()
            made.append(details(
                f"{lines[k].removeprefix('** ')}  ({len(inner)} lines)", folded(inner)
            ))
            k = end
        k += 1
    put_plain()
    return "\n".join(made)


def end_of_include(lines: list[str], start: int) -> int | None:
    """Return the line with which the include at `start` ends, None where none begins there.

    Results of programs that did not mark ends have their decks as one.
    """
    if not BEGIN.match(lines[start]):
        return None
    depth = 0
    for k in range(start, len(lines)):
        depth += bool(BEGIN.match(lines[k])) - lines[k].startswith("** end of ")
        if depth == 0:
            return k
    return None
