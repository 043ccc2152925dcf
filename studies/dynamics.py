"""Dynamic steps: the force of an impact over mesh and increment, energy, turns, damping, CalculiX.

    studies/run dynamics FOLDER [-o docs/studies/dynamics.md]

FOLDER: the collection calculix/examples. Needs CalculiX (ccx). Status 1 where the runs do not show
what the page says.
"""

import math
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np

from studies.dynamic_peers import PUBLIC, our_mean, ours, own_scenes, their_mean, theirs
from studies.pages import StudyError, claim, fresh_runs, page_options, put_page, table

LENGTH, YOUNG, SPEED, SIDE = 10.0, 900.0, 10.0, 1.0  # density 1: sound has the velocity 30
SOUND = math.sqrt(YOUNG)
PUSH = SPEED * SOUND * SIDE**2  # from the wall, while waves run to the other end and back
BEGINS, ENDS = 0.5, 0.5 + 2 * LENGTH / SOUND

BAR = """*BLOCK, NAME=B, NX=1, NY=1, NZ={n}
0., 0., 0., 1., 1., 10.
*MATERIAL, NAME=M
*ELASTIC
900., 0.
*DENSITY
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=WALL, TYPE=PLANE
0., 0., -5., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, WALL
*INITIAL CONDITIONS, TYPE=VELOCITY
B, 3, -10.
*STEP, INC=100000
*DYNAMIC{direct}, ALPHA={alpha}
{dt!r}, 2.
*END STEP
"""

CUBE = """*BLOCK, NAME=B, NX=3, NY=3, NZ=3
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1e4, 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=WALL, TYPE=PLANE
0., 0., -0.1, 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, WALL
*STEP, INC=100000
*DYNAMIC, DIRECT, ALPHA={alpha}
{dt!r}, 2.
*DLOAD
B, GRAV, 10., 0., 0., -1.
*END STEP
"""

SPIN = """*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC, LAW=NEO HOOKE
100., 0.3
*DENSITY
1.
*SOLID SECTION, ELSET=B, MATERIAL=M
*INITIAL CONDITIONS, TYPE=VELOCITY
{speeds}*STEP, NLGEOM, INC=100000
*DYNAMIC, DIRECT
{dt!r}, {period!r}
*END STEP
"""

SWING = """*BLOCK, NAME=B, NX=1, NY=1, NZ=1
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
300., 0.
*DENSITY
1.
*DAMPING, ALPHA=2., BETA=0.003
*SOLID SECTION, ELSET=B, MATERIAL=M
*BOUNDARY
B-ZMIN, 1, 3
B-ZMAX, 1, 2
*INITIAL CONDITIONS, TYPE=VELOCITY
B-ZMAX, 3, 1.
*STEP, INC=100000
*DYNAMIC, DIRECT, ALPHA=0.
{dt!r}, 1.
*NODE FILE, FREQUENCY=1
U
*END STEP
"""


def share(x):
    """Return a part in per cent."""
    return f"{100 * x:.2g} %"


def of_force(time, force):
    """(mean error, largest value, impulse) of the wall's force, of what they should be."""
    lengths = np.diff(np.r_[0.0, time])
    right = np.where((time > BEGINS) & (time <= ENDS), PUSH, 0.0)
    whole = PUSH * (ENDS - BEGINS)
    return (abs(force - right) @ lengths / whole, force.max() / PUSH, force @ lengths / whole)


def lost(result):
    """What the scheme took of the energy, and what contact gave."""
    largest = max((result.history("energy/kinetic") + result.history("energy/strain")).max(),
                  abs(result.history("energy/external_work")).max())  # fmt: skip
    return (result.history("energy/balance")[-1] / largest,
            result.history("energy/contact")[-1] / largest)  # fmt: skip


def strike(runs, n, courant, alpha, direct=True):
    """Run a bar; return the numbers of its force, its losses and how many increments it took."""
    dt = courant * LENGTH / n / SOUND
    text = BAR.format(n=n, alpha=alpha, dt=dt, direct=", DIRECT" * direct)
    with runs.of_text("bar", text) as result:
        force = result.pairs[0].resultant[:, 2]
        time = result.history("time")
        return *of_force(time, force), *lost(result), len(time)


def impact_tables(runs):
    """The tables of the bar, and their sentences."""
    rows, errors = [], {}
    for n, courant, alpha in (
        (10, 1, -0.05), (20, 1, -0.05), (40, 1, -0.05), (20, 0.25, -0.05), (20, 0.5, -0.05),
        (20, 2, -0.05), (20, 4, -0.05), (20, 1, 0.0), (20, 1, -0.3),
    ):  # fmt: skip
        mean, peak, impulse, scheme, contact, _ = strike(runs, n, courant, alpha)
        errors[n, courant, alpha] = mean
        rows.append([n, f"{courant:g}", f"{alpha:g}", share(mean), f"{peak:.2f}",
                     f"{impulse:.3f}", share(scheme), share(contact)])  # fmt: skip
    falls = claim(
        errors[40, 1, -0.05] < 0.7 * errors[20, 1, -0.05] < 0.6 * errors[10, 1, -0.05],
        "The mean error of the force falls with the mesh; its largest value, in the first "
        "increments behind the front, does not.",
    )
    heads = ["elements", "c dt/h", "alpha", "mean error", "largest", "impulse", "scheme took",
             "contact gave"]  # fmt: skip
    chosen = []
    for courant in (12, 3, 0.75, 0.3):
        mean, _, impulse, scheme, contact, n = strike(runs, 20, courant, -0.05, direct=False)
        chosen.append([f"{courant / 60:g}", n, share(mean), f"{impulse:.3f}", share(scheme),
                       share(contact)])  # fmt: skip
    return (
        table(heads, rows), falls,
        table(["first increment", "increments", "mean error", "impulse", "scheme took",
               "contact gave"], chosen),
    )  # fmt: skip


def deck_of_others(n, courant, alpha, stiffness):
    """Return the bar for CalculiX, before a brick that is clamped."""
    h = LENGTH / n
    levels = [(1 + 4 * i, h * i) for i in range(n + 1)] + [(10001, -6.0), (10005, -5.0)]
    nodes = "".join(
        f"{first + x + 2 * y}, {x}., {y}., {z!r}\n"
        for first, z in levels for y in (0, 1) for x in (0, 1)
    )  # fmt: skip
    bricks = "".join(
        f"{e}, {b}, {b + 1}, {b + 3}, {b + 2}, {b + 4}, {b + 5}, {b + 7}, {b + 6}\n"
        for e, b in [(i + 1, 4 * i + 1) for i in range(n)]
    )
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=BAR\n{bricks}*ELEMENT, TYPE=C3D8, ELSET=W\n"
        "10001, 10001, 10002, 10004, 10003, 10005, 10006, 10008, 10007\n"
        "*NSET, NSET=WALL, GENERATE\n10001, 10008\n"
        f"*NSET, NSET=BARN, GENERATE\n1, {4 * n + 4}\n"
        "*MATERIAL, NAME=M\n*ELASTIC\n900., 0.\n*DENSITY\n1.\n"
        "*SOLID SECTION, ELSET=BAR, MATERIAL=M\n*SOLID SECTION, ELSET=W, MATERIAL=M\n"
        "*SURFACE, NAME=S\n1, S1\n*SURFACE, NAME=T\n10001, S2\n*SURFACE INTERACTION, NAME=I\n"
        f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{stiffness:g}\n"
        "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\nS, T\n"
        "*BOUNDARY\nWALL, 1, 3\nBARN, 1, 2\n*INITIAL CONDITIONS, TYPE=VELOCITY\nBARN, 3, -10.\n"
        f"*STEP, INC=100000\n*DYNAMIC, DIRECT, ALPHA={alpha}\n{courant * h / SOUND!r}, 2.\n"
        "*NODE PRINT, NSET=WALL, TOTALS=ONLY, FREQUENCY=1\nRF\n*END STEP\n"
    )


def table_of_others(folder):
    """The table of CalculiX, with its penalty, and its sentence."""
    if shutil.which("ccx") is None:
        raise StudyError("CalculiX (ccx) is not installed")
    rows = []
    for n, courant, alpha, stiffness in (
        (20, 1, -0.05, 3e3), (20, 1, -0.05, 1e4), (20, 1, -0.05, 3e4), (20, 1, -0.3, 1e4),
        (20, 0.25, -0.05, 1e4), (40, 1, -0.05, 1e4),
    ):  # fmt: skip
        (folder / "ccx.inp").write_text(deck_of_others(n, courant, alpha, stiffness))
        subprocess.run(["ccx", "-i", "ccx"], cwd=folder, capture_output=True, check=False)
        time, force = forces_of_others(folder / "ccx.dat")
        row = [n, f"{courant:g}", f"{alpha:g}", f"{stiffness:g}", share(PUSH / stiffness)]
        if time[-1] < 1.99:
            rows.append([*row, f"ends at {time[-1]:.2g}", "", ""])
            continue
        mean, peak, impulse = of_force(time, force)
        rows.append([*row, share(mean), f"{peak:.2f}", f"{impulse:.3f}"])
    heads = ["elements", "c dt/h", "alpha", "penalty", "overlap, of the side", "mean error",
             "largest", "impulse"]  # fmt: skip
    return table(heads, rows)


def forces_of_others(path):
    """Return times and the force along z on the wall, of a .dat."""
    lines = path.read_text().splitlines()
    time, force = [0.0], [0.0]
    for i, line in enumerate(lines):
        if "total force" not in line:
            continue
        time.append(float(line.split()[-1]))
        force.append(float(next(row for row in lines[i + 1:] if row.strip()).split()[2]))
    return np.array(time), np.array(force)


def bounce_table(runs):
    """The table of the cube that falls and bounces for 2, eleven times, and its sentence."""
    rows, taken = [], {}
    for alpha in (0.0, -0.05):
        for dt in (0.004, 0.002, 0.001, 0.0005):
            text = CUBE.format(alpha=alpha, dt=dt)
            result, ended = runs.attempt("cube", text)
            with result:
                scheme, contact = lost(result)
                taken[alpha, dt] = scheme - contact
                rows.append([f"{alpha:g}", f"{dt:g}", share(scheme), share(contact),
                             "status 2: " + ended.split(":")[0] if ended else "certified"])
    words = claim(
        taken[-0.05, 0.0005] < 0.4 * taken[-0.05, 0.002],
        "Each landing shakes the cube, and `alpha` damps what rings: a quarter of the increment "
        "leaves most of it.",
    )
    return table(["alpha", "dt", "scheme took", "contact gave", "end"], rows), words


def spin_table(runs):
    """The table of the soft cube that turns freely at finite strain, and its sentence."""
    speeds = "".join(
        f"{1 + i + 3 * (j + 3 * k)}, {axis}, {v!r}\n"
        for k in range(3) for j in range(3) for i in range(3)
        for axis, v in ((2, -4 * (k / 2 - 0.5)), (3, 4 * (j / 2 - 0.5)))
    )  # fmt: skip
    rows, twist = [], []
    for each in (50, 100, 200):
        dt = 0.5 * math.pi / each
        text = SPIN.format(speeds=speeds, dt=dt, period=1.5 * math.pi)
        with runs.of_text("spin", text) as result:
            twist.append(result.history("error/angular_momentum")[-1])
            rows.append([each, share(lost(result)[0]), share(twist[-1])])
    words = claim(
        twist[2] < 0.7 * twist[1] < 0.5 * twist[0], "The errors fall with the increment."
    )
    return table(["increments a turn", "scheme took", "angular momentum"], rows), words


def swing_table(runs):
    """The table of the damped brick, and its sentence."""
    frequency = 30.0
    ratio = (2.0 / frequency + 0.003 * frequency) / 2
    swings = frequency * math.sqrt(1 - ratio**2)
    rows, errors = [], []
    for dt in (0.02, 0.01, 0.005, 0.0025):
        with runs.of_text("swing", SWING.format(dt=dt)) as result:
            time = result.history("time")
            top = result.points[:, 2] > 0.9
            found = [result.field("displacement", i)[top, 2].mean() for i in range(len(time))]
            right = np.exp(-ratio * frequency * time) / swings * np.sin(swings * time)
            errors.append(abs(found - right).max() * frequency)
            gone = 1 / 6 - (result.history("energy/kinetic") + result.history("energy/strain"))[-1]
            off = abs(result.history("energy/damped")[-1] - gone) * 6
        rows.append([f"{dt:g}", f"{errors[-1]:.2g}", f"{off:.0e}"])
    words = claim(errors[3] < 0.3 * errors[2], "The error falls as `dt^2`.")
    return table(["dt", "error of the place, of v/w", "energy lost and not reported"], rows), words


def peer_table(runs):
    """The table of scenes that both programs read, and its sentence."""
    rows, apart = [], []
    for scene in own_scenes():
        with runs.of_text("scene", scene.deck) as result:
            mine, end = ours(scene, result)
        other, stop = theirs(scene, runs.folder)
        whole = stop > 0.999 * end
        if scene.right is not None:
            apart.append(abs(mine / scene.right - 1))
        rows.append([scene.name, "" if scene.right is None else f"{scene.right:.4g}",
                     f"{mine:.4g}", f"{other:.4g}" if whole else "ends early"])  # fmt: skip
    words = claim(max(apart) < 0.1, "Where the motion is known, a rigid body's or that of waves, "
                  f"these are at most {share(max(apart))} off.")  # fmt: skip
    return table(["scene", "known", "bipot", "CalculiX"], rows), words


def public_table(runs, collection):
    """The table of public decks."""
    rows = []
    for public in PUBLIC:
        deck = (collection / public.path).read_text(encoding="latin-1")
        with runs.of_text("public", deck) as result:
            mine, _ = our_mean(public, result)
        other, _ = their_mean(public, deck, runs.folder)
        rows.append([Path(public.path).name, f"{public.node}, {'xyz'[public.direction]}",
                     f"{mine:.3g}", f"{other:.3g}"])  # fmt: skip
    return table(["deck", "node, direction", "bipot", "CalculiX"], rows)


def wrapped(sentence):
    """Return a sentence in lines of a page."""
    return "\n".join(textwrap.wrap(sentence, 100))


def page(program, collection):
    """Return the page."""
    with fresh_runs(program) as runs:
        turns, twists = spin_table(runs)
        strikes, falls, chosen = impact_tables(runs)
        others = table_of_others(Path(runs.folder))
        peers, known = peer_table(runs)
        public = public_table(runs, collection)
        bounces, shakes = bounce_table(runs)
        swings, damps = swing_table(runs)
    return f"""# Dynamic steps

Scenes of [`*DYNAMIC`](../deck/steps.md#dynamic) whose motion is known, beside this motion and
CalculiX. `studies/run dynamics FOLDER -o docs/studies/dynamics.md` makes this page.

## A bar strikes a wall

A bar of length 10 and side 1 (`E = 900`, `nu = 0`, density 1, speed of sound 30) strikes a wall
with the velocity 10. The force is 300 for the time 2/3 in which a wave runs to the far end and
back; then the bar leaves with 10. Mean error: the integral of the error of the force over time,
relative to the impulse 200. Largest: the largest force, relative to 300. Impulse: relative to 200.

{strikes}

{wrapped(falls)}
Slave nodes have no mass here. A separate program in which they have mass makes a mean error of 59
to 150 % instead of 5 % ([theory](../theory/inertia.md)). With increments by their error in time, 20
elements and `alpha = -0.05`:

{chosen}

CalculiX, the same bar before a clamped brick, with a penalty (pressure over overlap) in place of
hard contact. Nodes at contact have mass there:

{others}

A low penalty gives as good a force, but the bar penetrates the wall by a tenth of its side. With a
higher penalty or shorter increments nodes at contact oscillate, and the highest ends the run.

## Scenes beside CalculiX

One deck for both programs, with increments of one length here and of at most this in CalculiX,
`alpha = -0.05`. The mean displacement of the body in question at the end, along the direction that
matters. CalculiX's contact has a penalty of ten times `E` over the unit of length.

{peers}

{wrapped(known)}

## Public decks

Those of the collection [calculix/examples](https://github.com/calculix/examples) whose only
obstacle was `*DYNAMIC`: the mean over time of a displacement that the deck prints.

{public}

The decks with one or two elements a body depend on what becomes of the mass at contact: bipot moves
it to other nodes, CalculiX drops it (`TYPE=MASSLESS`, contact15 to contact17) or keeps it, and in
contact12 lowers its penalty. `contact2e` is contact2i with `EXPLICIT`. `unstable` ends early in
both programs. In `bwdyn2` supports move off at once, and by the waves of that increments get so
short that neither program comes to the end.

## A cube bounces

It falls from 0.1 under 10 for the time 2 and bounces up to eleven times (`E = 1e4`, `nu = 0.3`, 27
elements, h/c = 1/300). In nature all energy stays.

{bounces}

{wrapped(shakes)}

## A soft cube turns freely

At finite strain (`E = 100`, 8 elements). The angular velocity is 4 at first, and the run has the
time of three turns.

{turns}

{twists}

## A damped brick swings

With `ALPHA = 2` and `BETA = 0.003`, circular frequency 30, damping ratio 0.078, `alpha = 0`.

{swings}

{damps}
"""


def main():
    """Make the page."""
    options = page_options(__doc__)
    options.add_argument("collection", type=Path, help="the collection calculix/examples")
    options = options.parse_args()
    put_page(page(options.bipot.resolve(), options.collection), options.page)


if __name__ == "__main__":
    sys.exit(main())
