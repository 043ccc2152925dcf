"""How --time is kept and used, and the error it leaves beside that of the best by hand.

    studies/run time_budget [-o docs/studies/time-budget.md]

Six scenes, 1, 5 and 20 seconds of the processor, on meshes and with increments that the program
chooses. By hand: meshes and increments, all combinations; the most accurate run that takes no more
than the time allowed. Errors and the truth are those of the study asked_accuracy, the truth of
finer meshes. Before that all scenes of that study in shorter times: whether these are kept, alone.
"""

import resource
import sys
import tempfile
from dataclasses import replace

import numpy as np

from bipot.report import machine, table
from studies.pages import page_command
from studies.scenes import SCENES, run
from studies.truths import error_of, truth

ALLOWED = (1, 5, 20)
SHORT = (0.5, 1, 2, 4)  # of all scenes, for whether they are kept
# Of each scene the meshes by hand, those of the truth, and the one that the deck has.
MESHES = {
    "block": ((4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32), (16, 20, 26, 34), 8),
    "block, mu = 0.8, along x": ((4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32), (16, 20, 26, 34), 8),
    "ball, pressed a way": ((4, 6, 8, 12, 16, 20, 24, 28, 32), (16, 20, 26, 34), 8),
    "spence": ((4, 6, 8, 10, 12, 14, 16, 20, 24, 28), (14, 18, 24, 32), 8),
    "foundation": ((2, 4, 6, 8, 10, 12, 14), (8, 10, 12, 16), 6),
    "tool": ((8, 12, 16, 20, 24, 28, 32, 36, 44), (16, 24, 36, 48), 16),
}
DIVIDED = (1, 2, 4)  # by hand, increments of the deck


def processor_time():
    """Seconds of the processor that finished children have taken."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def by_hand(program, scene, folder, true):
    """All settings by hand that take no more than the longest time: error, seconds, words."""
    found = []
    for finer in DIVIDED if scene.mu > 0 else (1,):
        for n in MESHES[scene.name][0]:
            one = run(program, scene, folder, {**scene.parameters(n, finer), "tolerance": 1e-5})
            if one.seconds > ALLOWED[-1]:
                break
            words = f"n = {n}" + (f", {finer} times the increments" if finer > 1 else "")
            if one.status == 0:
                found.append((error_of(one, true), one.seconds, words))
    return found


def study(program):
    """The rows of the page's table; used over allowed; error over that by hand, and its time."""
    rows, used, ratios, hands = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES:
            if scene.name not in MESHES:
                continue
            _, fine, n = MESHES[scene.name]
            true, doubt = truth(program, replace(scene, meshes=fine), folder)
            settings = by_hand(program, scene, folder, true)
            for allowed in ALLOWED:
                began = processor_time()
                one = run(program, scene, folder, scene.parameters(n), "--time", str(allowed))
                seconds = processor_time() - began
                error, sequence = error_of(one, true), one.sequence
                best = min(s for s in settings if s[1] <= allowed)
                used.append(seconds / allowed)
                ratios.append(max(error, doubt) / max(best[0], doubt))
                hands.append(best[1] / allowed)
                told = [f"{100 * part:.2g} %" if part >= 0 else "-"
                        for part in (sequence.mesh, sequence.load_steps)]  # fmt: skip
                rows.append(
                    [
                        scene.name, f"{allowed}", f"{seconds:.2g}", f"{used[-1]:.2f}", *told,
                        f"{100 * error:.2g} %", f"{100 * doubt:.1g} %", len(sequence),
                        f"{sequence.elements[-1]:.0f}", sequence.divisions[-1],
                        f"{100 * best[0]:.2g} %", f"{ratios[-1]:.2f}", f"{best[1]:.2g}", best[2],
                    ]
                )  # fmt: skip
                print(*rows[-1], one.reason[:200], sep=" | ", file=sys.stderr, flush=True)
    return rows, np.array(used), np.array(ratios), np.array(hands)


def used_of_short(program):
    """What all scenes use of short times, as a part of these, and how many refuse to begin."""
    used, refused = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES:
            for allowed in SHORT:
                began = processor_time()
                try:
                    run(program, scene, folder, scene.parameters(scene.meshes[2]), "--time",
                        str(allowed))  # fmt: skip
                except SystemExit as too_little:
                    print(scene.name, allowed, too_little, file=sys.stderr, flush=True)
                    refused += 1
                    continue
                used.append((processor_time() - began) / allowed)
                print(scene.name, allowed, f"{used[-1]:.2f}", file=sys.stderr, flush=True)
    return np.array(used), refused


def page(program):
    """The page as Markdown."""
    short, refused = used_of_short(program)
    rows, used, ratios, hands = study(program)
    brief = hands < 0.5
    head = [
        "scene", "s allowed", "s used", "used", "mesh", "steps", "true", "doubt", "runs",
        "elements", "parts", "by hand", "ratio", "s by hand", "best by hand",
    ]  # fmt: skip
    return "\n".join(
        [
            "# What a time allows",
            "",
            "By `studies/run time_budget`: `--time` of the processor, on meshes and with",
            "increments that the program chooses, and by hand the most accurate mesh and",
            "increments that take no more. `used` is the time of the whole process over what is",
            "allowed; `mesh` and `steps` are the errors of the result as the program estimates",
            "them, `true` is the one against the limit of four fine meshes with fine increments,",
            "and `doubt` what is not known of that limit; `ratio` is that of the true errors, none",
            "of them taken for less than the doubt. `runs` are all that were made, `elements` and",
            "`parts` of each increment those",
            f"of the last. One thread, {machine()}, whose processors and memory other programs",
            "used too. By hand nothing tells how accurate a run is, nor how long it will take: its",
            "seconds are those of that one run, found afterwards.",
            "",
            f"Within the time: **{sum(used <= 1)}** of {len(used)}, at most {used.max():.2f} of "
            f"it, {np.median(used):.2f} in the median. The error is {np.median(ratios):.2f} times",
            f"that by hand in the median, at most {ratios.max():.2f}. Of {sum(brief)} the best by",
            "hand takes less than half of the time: finer meshes are less accurate, so that one",
            f"is right by accident. Without these it is at most {ratios[~brief].max():.2f}.",
            "",
            "All scenes of the study [asked-accuracy](asked-accuracy.md) in "
            f"{', '.join(f'{s:g}' for s in SHORT)} s: **{sum(short <= 1)}** of {len(short)} within "
            f"the time, at most {short.max():.2f} of it, {np.median(short):.2f} in the median; "
            f"{refused} more refused to begin.",
            "",
            *table(head, rows),
            "",
        ]
    )


if __name__ == "__main__":
    page_command(__doc__, page)
