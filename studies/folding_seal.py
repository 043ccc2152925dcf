"""A rubber seal that folds and touches itself, with a picture.

    studies/run folding_seal [-o docs/studies/folding-seal.md]

The figure goes into the folder `figures` beside the page; without -o the page alone is made, and
printed.
"""

import math

import numpy as np
from matplotlib.collections import PolyCollection

from bipot.figures import BLUE, INK, ORANGE, new_axes, save
from studies.pages import claim, fresh_runs, page_options, put_page, table

AROUND, THROUGH = 64, 2  # elements
INNER, OUTER = 8.5, 10.0  # radii [mm]
FOOT = 10.0  # degrees to either side of the lowest place that are glued
WAY, PARTS = 17.2, 24
SHOWN = (0.4, 0.8, 1.0)  # of the way


def nodes():
    """Return the places of the nodes, counter-clockwise, from the inner radius on."""
    return {
        1 + i + (THROUGH + 1) * k: (i, 360.0 * k / AROUND)
        for k in range(AROUND) for i in range(THROUGH + 1)
    }  # fmt: skip


def elements():
    """Return the nodes of the elements."""
    row = THROUGH + 1
    return [
        [1 + i + row * k, 2 + i + row * k, 2 + i + row * after, 1 + i + row * after]
        for k in range(AROUND) for after in [(k + 1) % AROUND] for i in range(THROUGH)
    ]  # fmt: skip


def deck():
    """Return the deck: general contact, and nothing that says what will touch."""
    lines = ["*HEADING", "A seal that folds; mm, N", "*NODE"]
    for n, (i, degrees) in nodes().items():
        radius = INNER + (OUTER - INNER) * i / THROUGH
        angle = math.radians(degrees)
        lines.append(f"{n}, {radius * math.cos(angle):.9f}, {radius * math.sin(angle):.9f}")
    lines += ["9001, 0., 20.", "*ELEMENT, TYPE=CPE4, ELSET=SEAL"]
    lines += [f"{e}, {', '.join(map(str, its))}" for e, its in enumerate(elements(), 1)]
    lines += ["*NSET, NSET=FOOT"]
    lines += [str(n) for n, (i, degrees) in nodes().items()
              if i == THROUGH and abs(degrees - 270) <= FOOT]  # fmt: skip
    return "\n".join([
        *lines,
        "*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, MOONEY-RIVLIN", "0.4, 0.1, 0.04",
        "*SOLID SECTION, ELSET=SEAL, MATERIAL=RUBBER",
        "*OBSTACLE, NAME=DOOR, TYPE=PLANE, REF NODE=9001", f"0., {OUTER}, 0., 0., -1., 0.",
        "*OBSTACLE, NAME=FRAME, TYPE=PLANE", f"0., {-OUTER}, 0., 0., 1., 0.",
        "*SURFACE INTERACTION, NAME=DRY", "*FRICTION", "0.3",
        "*CONTACT", "*CONTACT INCLUSIONS, ALL EXTERIOR", "*CONTACT PROPERTY ASSIGNMENT", ", , DRY",
        "*STEP, NLGEOM", "*STATIC", f"{1 / PARTS}, 1., , {1 / PARTS}",
        "*BOUNDARY", "FOOT, 1, 2", "9001, 1, 1", f"9001, 2, 2, {-WAY}", "*END STEP", "",
    ])  # fmt: skip


def sections(result, k):
    """Return the corners of the elements after increment `k`."""
    u = result.field("displacement", k)
    x = (result.points + u)[: len(nodes()), :2]
    return x[np.array(elements()) - 1]


def draw(result, time, forces, path):
    """Draw sections along the way, and the forces over it."""
    figure, axes = new_axes(2, 2)
    for axis, at in zip(axes, SHOWN, strict=False):
        k = int(np.argmin(abs(time - at)))
        axis.add_collection(PolyCollection(sections(result, k), facecolor=BLUE, edgecolor=INK,
                                           linewidth=0.3))
        for height in (OUTER - WAY * time[k], -OUTER):
            axis.axhline(height, color=INK)
        axis.set(xlim=(-16, 16), ylim=(-11, 5), aspect="equal",
                 title=f"door {WAY * time[k]:.1f} mm down")
        axis.grid(visible=False)
    for (name, force), colour in zip(forces.items(), (ORANGE, BLUE), strict=True):
        axes[3].plot(WAY * time, force, color=colour, label=name)
    axes[3].set(xlabel="way of the door [mm]", ylabel="normal force [N/mm]")
    axes[3].legend()
    figure.tight_layout()
    save(figure, path)


def main():
    """Run the seal and put the page."""
    options = page_options(__doc__.splitlines()[0]).parse_args()
    with fresh_runs(options.bipot) as runs, runs.of_text("seal", deck()) as result:
        time = result.history("time")
        forces = {"seal on door": result.pairs["SEAL:DOOR"].normal_sum[:],
                  "seal on itself": result.pairs["SEAL:SEAL"].normal_sum[:]}
        certified = result.history("certified")[:]
        if options.page:
            draw(result, time, forces, options.page.parent / "figures" / "folding-seal.png")
        rows = [[f"{WAY * t:.1f}", *(f"{f[k]:.3g}" for f in forces.values())]
                for k, t in enumerate(time)
                if k in [int(np.argmin(abs(time - s))) for s in SHOWN]]  # fmt: skip
        touches = WAY * time[np.flatnonzero(forces["seal on itself"] > 0)[0]]
    words = claim(
        certified.all() and 0 < forces["seal on itself"][-1] < forces["seal on door"][-1],
        f"All {len(time)} increments are certified. The seal first touches itself in the increment "
        f"that ends at a way of {touches:.1f} mm.",
    )
    put_page(f"""# A seal that folds

A tube of rubber (Mooney-Rivlin, 0.4 and 0.1 MPa), inner radius {INNER} mm and wall
{OUTER - INNER} mm, is glued to its frame along {2 * FOOT:.0f} degrees, and a door closes by
{WAY} mm. The deck has general contact with a friction coefficient of 0.3, and says nothing of what
will touch: the sides of the tube are found [where it is](../theory/bodies.md) as it folds.
`studies/run folding_seal -o docs/studies/folding-seal.md` makes this page.

![The tube as the door closes, and the forces](figures/folding-seal.png)

{words}

{table(["way of the door [mm]", "normal force on the door [N/mm]", "on itself [N/mm]"], rows)}
""", options.page)


if __name__ == "__main__":
    main()
