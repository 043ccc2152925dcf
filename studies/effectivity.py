"""How far the estimated errors are from the true ones.

    studies/run effectivity [-o docs/studies/effectivity.md]
    studies/run effectivity --unmatched [-o docs/studies/effectivity.md]

With --unmatched the section on meshes that do not match alone is made anew, in a minute.

The estimate is /history/error/total at the end of each *STEP: mesh, load steps, contact and
arithmetic together. The truth is taken from finer meshes with fine increments: their limit by
Richardson's extrapolation where their errors fall regularly, else the finest of them. Effectivity
is estimate over truth.
"""

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.program import ROOT, run_deck
from bipot.result import Result
from studies.pages import PAGES, page_options, put_page
from studies.unmatched_scenes import scenes


@dataclass
class Case:
    """A deck, what is judged on which meshes, and what the truth is taken from."""

    deck: str
    quantity: str
    meshes: tuple
    truth: tuple
    settings: dict
    steps: tuple = (10, 50, 200)
    label: str = ""


AUTO = {"solver": "AUTO", "local": "AUTO"}
CASES = (
    Case("block", "resultant", (2, 4, 8, 16), (8, 16, 24), AUTO),
    Case(
        "block",
        "resultant",
        (2, 4, 8, 16),
        (8, 16, 24),
        {**AUTO, "mu": 0.8, "nu": 0.2, "theta": 0},
        (10, 50),
        "block, mu = 0.8, nu = 0.2, theta = 0",
    ),
    Case("quarter", "resultant", (2, 4, 8, 16), (8, 16, 24), {}),
    Case("ssnv128", "strain energy", (4, 8, 16, 32), (128,), {"thickness": 0.005}),
)
BESIDE = (Case("tool", "resultant", (6, 12, 18), (36,), {}, (10, 50)),)


def run(program, case, n, steps, folder):
    """Run the deck; return its estimates and its quantity as at_step_ends does."""
    path = Path(folder) / f"{case.deck}.vtkhdf"
    deck = ROOT / "input" / f"{case.deck}.inp"
    run_deck(program, deck, path, {**case.settings, "n": n, "steps": steps})
    with Result(path) as result:
        return at_step_ends(result, case.quantity == "strain energy")


def at_step_ends(result, energy):
    """Return, at the ends of the steps, the estimates and the quantity: (steps,), (steps, k).

    The quantity is the strain energy, k = 1, or the resultants of all contact pairs.
    """
    ends = result.step_ends
    if energy:
        values = result.history("energy/strain")[ends, None]
    else:
        values = np.hstack([pair.resultant[ends] for pair in result.pairs.values()])
    return result.history("error/total")[ends], values


def limit(meshes, values):
    """Return the limit of values on three meshes, v + c n^-p, p of the largest component."""
    first, second, third = values
    largest = np.argmax(abs(third))
    ratio = (first[largest] - second[largest]) / (second[largest] - third[largest])
    low, high = 0.1, 8.0
    for _ in range(60):
        order = 0.5 * (low + high)
        powers = [n**-order for n in meshes]
        found = (powers[0] - powers[1]) / (powers[1] - powers[2])
        low, high = (order, high) if found < ratio else (low, order)
    return third + (third - second) * powers[2] / (powers[1] - powers[2])


def rows(program, cases):
    """Yield a table row a case, mesh, number of increments and step."""
    with tempfile.TemporaryDirectory() as folder:
        for case in cases:
            finest = case.steps[-1]
            fine = [run(program, case, n, finest, folder)[1] for n in case.truth]
            for n in case.meshes:
                for steps in case.steps:
                    estimates, values = run(program, case, n, steps, folder)
                    for step, estimate in enumerate(estimates):
                        true = [of_mesh[step] for of_mesh in fine]
                        true = limit(case.truth, true) if len(true) == 3 else true[0]
                        error = abs(values[step] - true).max() / abs(true).max()
                        yield case, n, steps, step + 1, estimate, error


def tabulate(program, cases, most=3.0, floor=0.0):
    """The rows of a table in Markdown, and how many of them are between a third and `most`.

    What is below `floor` counts as that.
    """
    lines, within = [], 0
    for case, n, steps, step, estimate, error in rows(program, cases):
        ratio = max(estimate, floor) / max(error, floor)
        within += 1 / 3 <= ratio <= most
        lines.append(
            f"| {case.label or case.deck} | {case.quantity} | {n} | {steps} | {step} "
            f"| {estimate:.2g} | {error:.2g} | {ratio:.2g} |"
        )
        print(lines[-1], file=sys.stderr, flush=True)
    return lines, within


FLOOR = 0.005  # of the force: below it neither the truth nor the estimate means anything
FEW, MANY = 1 / 3, 5.0


def force_of(program, text, folder):
    """Return the estimate at the end of a deck, and the forces of its pairs; None: not run."""
    deck, path = Path(folder) / "deck.inp", Path(folder) / "deck.vtkhdf"
    deck.write_text(text, encoding="utf-8")
    run_deck(program, deck, path, {})
    with Result(path) as result:
        estimates, values = at_step_ends(result, energy=False)
    return estimates[-1], values[-1]


def unmatched_rows(program):
    """Yield scenes whose meshes do not match, with the estimate and the true error of each."""
    known = {}
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes():
            true = scene.force
            for text in scene.fine.values():
                if text not in known:
                    known[text] = force_of(program, text, folder)[1]
            if scene.fine:
                values = [known[text] for text in scene.fine.values()]
                # Of two meshes, one half as fine, errors are as 2 to 1.
                true = values[0] if len(values) == 1 else 2 * values[1] - values[0]
            estimate, values = force_of(program, scene.deck, folder)
            error = np.linalg.norm(values - true) / np.linalg.norm(values)
            print(scene.kind, scene.name, estimate, error, file=sys.stderr, flush=True)
            yield scene, estimate, error


def tabulate_unmatched(program):
    """The rows of two tables in Markdown: of each scene, and of each kind."""
    lines, kinds = [], {}
    for scene, estimate, error in unmatched_rows(program):
        ratio = max(estimate, FLOOR) / max(error, FLOOR)
        counts = kinds.setdefault(scene.kind, [0, 0, 0, 0])
        place = 3 if estimate < 0 else 0 if ratio < FEW else 2 if ratio > MANY else 1
        counts[place] += 1
        told = "not known" if estimate < 0 else f"{estimate:.2g}"
        shown = "-" if estimate < 0 else f"{ratio:.2g}"
        lines.append(f"| {scene.kind} | {scene.name} | {told} | {error:.2g} | {shown} |")
    counted = [f"| {kind} | {' | '.join(map(str, counts))} |" for kind, counts in kinds.items()]
    return lines, counted


def unmatched_section(program):
    """The section on meshes that do not match."""
    lines, counted = tabulate_unmatched(program)
    return [
        "## Where meshes do not match",
        "",
        "Eight scenes of each kind, half of the punches and all beams with friction. True is the",
        "force of a finer mesh whose faces match; of rings it is Lame's; of punches, the first two",
        "kinds, that of 160 elements along whose lines follow the edges of contact, less what it",
        "differs from that of 80: from 40 on each mesh halves the difference. Errors are parts of",
        "the run's force; what is less than 0.5 % of it counts as 0.5 %. What each term is:",
        "[theory](../theory/errors.md), section 10.",
        "",
        "| kind | below 1/3 | 1/3 to 5 | above 5 | not known |",
        "|---|---|---|---|---|",
        *counted,
        "",
        "| kind | scene | estimate | true | effectivity |",
        "|---|---|---|---|---|",
        *lines,
        "",
        "Edges of the slave in faces of the master have no term of their own. If statics",
        "determines a force, only the error of this force is estimated; pressures have no",
        "estimate.",
        "",
    ]


HEAD = (
    "| deck | quantity | n | increments | step | estimate | true | effectivity |",
    "|---|---|---|---|---|---|---|---|",
)


def page(program):
    """The page as Markdown."""
    table, within = tabulate(program, CASES)
    beside, beside_within = tabulate(program, BESIDE, MANY, FLOOR)
    return "\n".join(
        [
            "# How good the estimates of errors are",
            "",
            "By `studies/run effectivity`: the whole estimate of [theory](../theory/errors.md),",
            "section 10 (`/history/error/total`: mesh, geometry, load steps, contact,",
            "arithmetic), at the end of each `*STEP`, and the true error of the largest contact",
            "resultant or of the strain energy. True is, of the block and its quarter, the limit",
            "of n = 8, 16, 24 (Richardson), of the plate n = 128, with the most increments.",
            "`increments` is the parameter `steps` of the deck. Effectivity is estimate over",
            "truth.",
            "",
            f"Between 1/3 and 3: **{within} of {len(table)}**.",
            "",
            *HEAD,
            *table,
            "",
            "## A round tool",
            "",
            "A round tool of a few elements' contact width. The mesh makes the body too stiff, and",
            "between its nodes the tool sinks into it, so that errors of opposite sign cancel in",
            "its force; of the estimate the difference is left, or a quarter of the larger. True:",
            "n = 36; what is less than 0.5 % counts as 0.5 %.",
            f"Between 1/3 and 5: {beside_within} of {len(beside)}.",
            "",
            *HEAD,
            *beside,
            "",
            "Where prescribed forces press the bodies together (Hertz, Spence), equilibrium gives",
            "the resultants on any mesh; there the estimate is that of displacements and energy.",
            "",
            *unmatched_section(program),
        ]
    )


def main():
    """Put the page, or the page that is there with its last section made anew."""
    options = page_options(__doc__)
    options.add_argument("--unmatched", action="store_true", help="the last section alone")
    options = options.parse_args()
    program = options.bipot.resolve()
    if not options.unmatched:
        put_page(page(program), options.page)
        return
    section = unmatched_section(program)
    kept = (PAGES / "effectivity.md").read_text(encoding="utf-8").split(section[0])[0].rstrip()
    put_page("\n".join([kept, "", *section]), options.page)


if __name__ == "__main__":
    main()
