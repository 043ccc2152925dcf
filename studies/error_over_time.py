"""Draw the error over the processor time: settings by hand, and what --accuracy makes of it.

    studies/run error_over_time [-o docs/studies/error-over-time.md] [--jobs N]

The ten scenes of asked_accuracy that are asked for four accuracies, here for more of them. Errors
and the truth are those of that study. The figure goes into the folder `figures` beside the page;
without -o the page alone is made, and printed.
"""

import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bipot.figures import BLUE, GRID, INK, ORANGE, new_axes, save
from bipot.report import machine, table
from studies.asked_accuracy import OF_TEN, by_hand, of_sequence
from studies.pages import page_options, put_page
from studies.scenes import SCENES, run
from studies.truths import error_of, truth

ASKED = (0.3, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.003)
LONGEST = 30  # processor time that an accuracy may take [s]
LINES = (([], "--accuracy", BLUE, "o-"), (["--extrapolated"], "extrapolated", ORANGE, "s--"))


@dataclass
class Measured:
    """What was found of a scene; of points the seconds and the true error."""

    name: str
    doubt: float
    hand: list  # points
    lines: list  # of LINES the points, with what was asked


def measure(program, scene):
    """Run a scene by hand and for accuracies."""
    with tempfile.TemporaryDirectory() as folder:
        true, doubt = truth(program, scene, folder)
        hand = [(s.outcome.seconds, s.error) for s in by_hand(program, scene, folder, true)]
        lines = []
        for options, *_ in LINES:
            points = []
            for asked in ASKED:
                one = run(program, scene, folder, scene.parameters(scene.meshes[2]),
                          "--accuracy", str(asked), *options, limit=LONGEST)  # fmt: skip
                if one is None or one.status != 0:
                    break
                found = of_sequence(one) if options else one
                points.append((one.seconds, error_of(found, true), asked))
            lines.append(points)
    print(scene.name, len(hand), [len(points) for points in lines], file=sys.stderr, flush=True)
    return Measured(scene.name, doubt, hand, lines)


def draw(scenes, path):
    """Draw the figure: a scene an axis."""
    figure, axes = new_axes(2, (len(scenes) + 1) // 2, sharex=True, sharey=True)
    for ax, scene in zip(axes, scenes, strict=False):
        seen = max(scene.doubt, 1e-5)
        # What the truth does not tell is drawn as its doubt.
        ax.axhline(100 * seen, color=INK, linewidth=0.6, linestyle=":")
        x, y = np.array(scene.hand).T
        ax.plot(x, 100 * np.maximum(y, seen), "o", color=GRID, markersize=4, label="by hand")
        for (_, label, color, style), points in zip(LINES, scene.lines, strict=True):
            if points:
                x, y, _ = np.array(points).T
                ax.plot(x, 100 * np.maximum(y, seen), style, color=color, markersize=3.5,
                        linewidth=1, label=label)  # fmt: skip
        ax.set(xscale="log", yscale="log", ylim=(0.01, 30))
        ax.set_title(scene.name, fontsize=9, loc="left")
    for ax in axes[-2:]:
        ax.set_xlabel("processor time, all runs [s]")
    for ax in axes[::2]:
        ax.set_ylabel("true error [%]")
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    save(figure, path)


def by_hand_as_accurate(scene, error):
    """Seconds of the cheapest setting by hand with no larger an error, as far as is known; or None.

    What is below the doubt of the truth counts as alike.
    """
    return min((s for s, e in scene.hand if e <= max(error, scene.doubt)), default=None)


def rows_of(scene):
    """The rows of a scene in the page's table."""
    rows = []
    for (_, label, *_), points in zip(LINES, scene.lines, strict=True):
        for seconds, error, asked in points:
            best = by_hand_as_accurate(scene, error)
            rows.append([scene.name, label, f"{100 * asked:g} %", f"{100 * error:.2g} %",
                         f"{seconds:.2g}", f"{best:.2g}" if best else "-"])  # fmt: skip
    return rows


def ratios(scenes, line):
    """Seconds for an accuracy over those of the cheapest setting by hand that is as accurate."""
    found = []
    for scene in scenes:
        for seconds, error, _ in scene.lines[line]:
            best = by_hand_as_accurate(scene, error)
            if best:
                found.append(seconds / best)
    return found


def page(scenes, figure):
    """The page as Markdown."""
    missed = [(error - asked, scene.doubt) for scene in scenes for points in scene.lines
              for _, error, asked in points]  # fmt: skip
    true = sum(by <= 0 for by, _ in missed)
    unknown = sum(0 < by <= doubt for by, doubt in missed)
    last, extrapolated = (ratios(scenes, line) for line in range(2))
    return "\n".join(
        [
            "# Error over processor time",
            "",
            "By `studies/run error_over_time`: ten scenes of the study",
            "[asked-accuracy](asked-accuracy.md), whose errors and truth these are. Each grey",
            "point is one run, with a mesh and increments set by hand; how accurate it is, the",
            "truth tells, not the run. Lines: `--accuracy`, of the last mesh and of extrapolated",
            "values,",
            f"for {', '.join(f'{100 * asked:g}' for asked in ASKED)} %, as far as each is reached",
            f"in at most {LONGEST} s; all of its runs count. Dotted: what is not known of the",
            "truth; errors below it are drawn on it. Processor seconds, one thread,",
            f"{machine()}.",
            "",
            f"![Error over processor time]({figure})",
            "",
            f"Of {len(missed)} accuracies that were reached {true} are kept, {unknown} are",
            f"missed by less than the doubt, and {len(missed) - true - unknown} by more.",
            "All their runs take as many times the time of the cheapest setting by hand that is as",
            "accurate, where there is one:",
            f"{np.median(last):.1f} of the last mesh, in the median of {len(last)}, and",
            f"{np.median(extrapolated):.1f} of extrapolated values, of {len(extrapolated)}.",
            "",
            *table(["scene", "line", "asked", "true", "s", "s by hand, as accurate"],
                   [row for scene in scenes for row in rows_of(scene)]),
            "",
        ]
    )  # fmt: skip


def main():
    """Make the page and its figure as the command line says."""
    options = page_options(__doc__)
    options.add_argument("--jobs", type=int, default=2, help="scenes at a time")
    options = options.parse_args()
    program = options.bipot.resolve()
    with ThreadPoolExecutor(options.jobs) as pool:
        scenes = list(pool.map(lambda scene: measure(program, scene),
                               [scene for scene in SCENES if scene.name in OF_TEN]))  # fmt: skip
    figure = Path("figures") / "error-over-time.png"
    if options.page:
        draw(scenes, options.page.parent / figure)
    put_page(page(scenes, figure), options.page)


if __name__ == "__main__":
    main()
