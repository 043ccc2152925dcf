"""The paper's example at finite strain, for studies/paper.py: both tangents, all solvers.

With TANGENT=NEWTON its equation [1] is solved as it stands: tangent, factor, compliance and contact
problem anew in every iteration. With KEPT, the default, one factor serves many.
"""

import re
from functools import partial

import numpy as np

from bipot.program import ROOT
from studies.pages import claim, table

TANGENTS = ("KEPT", "NEWTON")
LAWS = {
    "neo-Hooke": "*HYPERELASTIC, NEO HOOKE\n<210000/(4*(1+nu))>, <6*(1-2*nu)/210000>",
    "St Venant-Kirchhoff": "*ELASTIC\n210000., <nu>",
}
SOLVERS = {
    f"{form}-potential, {words}": {
        "solver": "SWEEPS", "formulation": f"{form.upper()}POTENTIAL", "local": local
    }
    for form, words, local in (
        ("bi", "Uzawa", "UZAWA"),
        ("bi", "Newton 3x3", "NEWTON"),
        ("bi", "Newton 6x6", "NEWTON6"),
        ("bi", "exact", "EXACT"),
        ("pseudo", "Uzawa", "UZAWA"),
        ("pseudo", "Newton 3x3", "NEWTON"),
        ("pseudo", "Newton 6x6", "NEWTON6"),
    )
} | {"global Newton": {"solver": "GLOBAL NEWTON", "formulation": "BIPOTENTIAL", "local": "AUTO"}}
AUTO = {"solver": "AUTO", "local": "AUTO"}
SAME = 1e-8  # of the largest resultant


def block(law):
    """Return input/block.inp at finite strain, with a parameter `tangent`."""
    text = (ROOT / "input" / "block.inp").read_text(encoding="utf-8")
    for old, new in (
        ("*STEP\n", "*STEP, NLGEOM\n"),
        ("nu = 0.3\n", "nu = 0.3\ntangent = KEPT\n"),
        ("*CONTACT SOLVER", "*BODY SOLVER, TANGENT=<tangent>\n*CONTACT SOLVER"),
        (LAWS["St Venant-Kirchhoff"], LAWS[law]),
    ):
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def rubber():
    """Return input/rubber.inp with a choice of the local solver, to a sharper tolerance."""
    text = (ROOT / "input" / "rubber.inp").read_text(encoding="utf-8")
    for old, new in (
        ("tolerance = 1e-8\n", "tolerance = 1e-10\nformulation = BIPOTENTIAL\nlocal = AUTO\n"),
        ("SOLVER=<solver>, ", "SOLVER=<solver>, FORMULATION=<formulation>, LOCAL=<local>, "),
    ):
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def scenes():
    """Return what the solvers are compared on: names, decks and their parameters."""
    blocks = {
        f"block, {law}, n = {n}": (block(law), {"n": n}) for law in LAWS for n in (2, 4)
    }
    return blocks | {
        "rubber, pressed by 10 %": (rubber(), {"press": 1.0, "push": 1.5}),
        "rubber, pressed by 15 %": (rubber(), {"press": 1.5, "push": 1.5}),
    }


class Counts:
    """What a run took, and the resultants of its increments."""

    def __init__(self, runs, text, parameters):
        """Run the deck as far as it is solved."""
        result, self.end = runs.attempt("deck", text, **parameters)
        with result:
            self.iterations = int(result.history("newton_raphson_iterations").sum())
            self.tangents = int(result.history("tangents").sum())
            self.sweeps = int(result.history("contact_iterations").sum())
            self.resultant = result.pairs[0].resultant[result.history("extra") == 0]
            self.done = result.finished

    @property
    def words(self):
        """The sweeps, or where the run ended."""
        return f"(ends at {where(self.end)})" if self.end else str(self.sweeps)


def where(message):
    """Return step and increment of the message that ends a run."""
    return "/".join(re.findall(r"\d+", message.split(":", 1)[0]))


def solver_tables(runs):
    """Return the tables of iterations, factorisations and sweeps."""
    found = {
        (scene, solver, tangent): Counts(runs, text, {**more, **options, "tangent": tangent})
        for scene, (text, more) in scenes().items()
        for solver, options in SOLVERS.items()
        for tangent in TANGENTS
    }
    rows, largest = [], 0.0
    for scene in scenes():
        kept = found[scene, "global Newton", "KEPT"]
        worst = 0.0
        for (other, *_), counts in found.items():
            if other != scene:
                continue
            n = len(counts.resultant)
            apart = np.abs(counts.resultant[:n] - kept.resultant[:n]).max()
            worst = max(worst, apart / np.abs(kept.resultant).max())
        newton = [found[scene, solver, "NEWTON"] for solver in SOLVERS]
        whole = [counts for counts in newton if not counts.end]
        largest = max(largest, worst)
        rows.append((
            scene, str(kept.done), f"{kept.iterations}, {kept.tangents}",
            f"{whole[0].iterations}, {whole[0].tangents}" if whole else "see below",
            f"{worst:.0e}",
        ))
    sweeps = [
        (solver, *(
            " / ".join(found[scene, solver, tangent].words for tangent in TANGENTS)
            for scene in scenes()
        ))
        for solver in SOLVERS
    ]
    ends = [counts for counts in found.values() if counts.end]
    kept_all = all(not counts.end for (*_, tangent), counts in found.items() if tangent == "KEPT")
    return [
        "Newton-Raphson iterations, tangents that were factorised for them (beside the stiffness of"
        " small strain at the start), and how far the resultants of any two runs are apart, all"
        " solvers and both tangents, beside the largest:", "",
        table(("scene", "increments", "KEPT", "NEWTON", "apart"), rows), "",
        claim(
            kept_all and largest < SAME,
            "With the kept factor all solvers solve all of these, and all forces are the same to"
            f" {SAME:.0e}, with the tangent of every iteration as far as that goes.",
        ),
        claim(
            len(ends) > 0 and all("15 %" in scene for (scene, *_), c in found.items() if c.end),
            "Where rubber is pressed by 15 % that tangent ceases to be positive definite, and"
            " before it does sweeps over its compliance hardly make progress.",
        ), "",
        "Sweeps over the contact points (of global Newton iterations), all increments together,"
        " KEPT / NEWTON; step/increment where a run ends:", "",
        table(("contact solver", *scenes()), sweeps), "",
    ]


def convergence(runs):
    """Return the table of what is left out of balance after each iteration."""
    rows = []
    for law in LAWS:
        left = {}
        for tolerance in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-12):
            with runs.of_text(
                "deck", block(law), n=4, steps=10, tangent="NEWTON", tolerance=tolerance
            ) as result:
                iterations = result.history("newton_raphson_iterations")
                rest = result.history("error/arithmetic")
                for row in (0, 1):
                    left[row, int(iterations[row])] = rest[row]
        for row in (0, 1):
            steps = [left[row, i] for i in sorted(i for r, i in left if r == row)]
            rows.append((f"{law}, {row + 1}", " ".join(f"{one:.1e}" for one in steps)))
            claim(
                all(steps[i + 1] < steps[i] ** 2 for i in (0, 1)),
                f"{law}: what is left falls below its square with each iteration",
            )
    return [
        "Convergence is quadratic where no contact point changes its status: what is left out of"
        " balance, of the largest force, falls below its own square with each iteration, until it"
        " is rounding. Here in the first two increments (n = 4, steps = 10, `TANGENT=NEWTON`):",
        "",
        table(("law, increment", "after iteration 1, 2, ..."), rows), "",
    ]


def failures(runs):
    """Return where full Newton fails, and what the kept factor does there."""
    soft = block("neo-Hooke").replace("210000", "1").replace("3, 3, -0.1", "3, 3, -0.3")
    soft = soft.replace("<5/steps>", "<2.5/steps>").replace("0.4*", "0.5*")
    stiff = block("St Venant-Kirchhoff")
    tries = (
        ("block, neo-Hooke, n = 8", block("neo-Hooke"), {"n": 8, **AUTO}),
        ("block, St Venant-Kirchhoff, n = 6", stiff, {"n": 6, **AUTO}),
        ("block, St Venant-Kirchhoff, n = 8", stiff, {"n": 8, **AUTO}),
        ("soft block, pressed by 30 % (E = 1, nu = 0.45), n = 2", soft,
         {"n": 2, "nu": 0.45, "steps": 30, **AUTO}),
        ("soft block, n = 4", soft, {"n": 4, "nu": 0.45, "steps": 30, **AUTO}),
        ("`rubber.inp`, pressed by 20 %", rubber(), {}),
    )
    rows = []
    for name, text, parameters in tries:
        kept, newton = (Counts(runs, text, {**parameters, "tangent": one}) for one in TANGENTS)
        claim(not kept.end or ("ellipticity" in kept.end and text == stiff),
              f"{name} is solved with the kept factor as far as its law holds")
        lost = kept.end.split(" the law")[0] + " the law loses its ellipticity"
        rows.append((
            name, lost if kept.end else f"{kept.iterations}, {kept.tangents}",
            newton.end.split(", and contact")[0] or f"{newton.iterations}, {newton.tangents}",
        ))
    return [
        "Where full Newton-Raphson fails (automatic contact solver; Newton-Raphson iterations and"
        " tangents where a run comes to its end):", "",
        table(("scene", "KEPT", "NEWTON"), rows), "",
        "A tangent with a negative direction has a compliance of which contact problems have"
        " several solutions, so the run ends and says so. Projected element by element, as the kept"
        " one is, it is positive. With St Venant-Kirchhoff's law the block has no limit in the"
        " mesh: its leading lower edge collapses on finer ones, where the law loses its"
        " ellipticity.", "",
    ]


def finite_strain(runs, draw, n, folder):
    """Return the page's part of finite strain; `draw` makes the paper's figures 2 and 3."""
    text = [
        "## At finite strain", "",
        "`input/block.inp` with `*STEP, NLGEOM`, and for neo-Hooke `*HYPERELASTIC, NEO HOOKE` of"
        " the same constants in the place of `*ELASTIC`. `*BODY SOLVER, TANGENT=NEWTON` is the"
        " paper's equation [1] as it stands: tangent, factor, compliance and contact problem anew"
        " in every iteration; `TANGENT=KEPT` is the default, of whose factors each serves many"
        " iterations and increments ([theory](../theory/elements.md)). The figures are with"
        " `NEWTON`.", "",
    ]
    for number, figure in draw.items():
        for law in LAWS:
            path = folder / f"figure-{number}-{law.lower().replace(' ', '-')}.png"
            run = partial(runs.of_text, "deck", block(law), tangent="NEWTON")
            caption = figure(run, n, path)
            text += [f"![Figure {number}, {law}](figures/{path.name})", ""]
            text += [f"Figure {number} at finite strain, {law}. {caption}", ""]
    return [*text, *solver_tables(runs), *convergence(runs), *failures(runs)]
