"""What a scene's forces are without the errors of meshes and increments; how far off runs are.

Errors are those of docs/deck.md, *ACCURACY: of each pair the normal forces as parts of their
largest sum, friction as a part of mu times that, at the ends of the deck's increments.

The runs are the program's, so what all of them have wrong is not seen. Their limit is that of one
power of the elements' size, which is what the program's own estimates suppose: where values
converge otherwise, or slower than by the order 1/2, the doubt may be too small.
"""

from dataclasses import dataclass

import numpy as np

from studies.scenes import Outcome, run


def limit_of(sizes, values):
    """The limit of q + c h^p fitted to what meshes give, all increments of a quantity alike."""
    best = None
    for order in np.arange(0.5, 2.51, 0.01):
        powers = np.stack([np.ones(len(sizes)), np.array(sizes) ** order], axis=1)
        found = np.linalg.lstsq(powers, values, rcond=None)[0]
        left = ((powers @ found - values) ** 2).sum()
        if best is None or left < best[0]:
            best = left, found[0]
    return best[1]


def limit(runs, sizes):
    """The forces of a mesh without size."""
    pairs = []
    for of_pair in zip(*(one.pairs for one in runs), strict=True):
        *forces, mu = zip(*of_pair, strict=True)
        limits = [
            limit_of(sizes, np.array([part.ravel() for part in parts])).reshape(parts[0].shape)
            for parts in forces
        ]
        pairs.append((*limits, mu[0]))
    return Outcome(0, 0, runs[-1].times, pairs, None, "", least=runs[-1].least)


def common(found, other):
    """The places of the increments whose ends both have, in each of them."""
    here = np.flatnonzero(np.isclose(found.times[:, None], other.times, rtol=1e-9).any(axis=1))
    return here, [int(np.argmin(abs(other.times - time))) for time in found.times[here]]


def to_fine_steps(runs, true):
    """The truth with increments without size, and what is not known of that.

    Of the runs each has half the increments of the next, on one mesh; the truth has those of the
    first. Their errors halve with the increments, as those of friction do, else the limits of the
    last two and of the two before them are apart.
    """
    places = [common(true, one)[1] for one in runs]
    kept = common(true, runs[-1])[0]

    def limit_of_steps(k):
        """By the runs k - 1 and k."""
        pairs = []
        for i, pair in enumerate(true.pairs):
            found = []
            for j, part in enumerate(pair[:3]):
                of = [one.pairs[i][j][at] for one, at in zip(runs, places, strict=True)]
                found.append(part[kept] + 2 * of[k] - of[k - 1] - of[0])
            pairs.append((*found, pair[3]))
        return Outcome(0, 0, true.times[kept], pairs, None, "", least=true.least)

    found = limit_of_steps(-1)
    return found, error_of(limit_of_steps(-2), found)


@dataclass
class TrueRuns:
    """The runs that a scene's truth is taken from.

    Of `meshes` the last four are its limit; of three it is the other that says how well that is
    known. `steps` are on a coarse mesh, each with twice the increments of the one before.
    """

    sizes: list
    meshes: list
    steps: list


def runs_for_truth(program, scene, folder, of=""):
    """Run what a scene's truth is taken from; `of` as for scenes.run."""

    def one(n, finer):
        return run(program, scene, folder, {**scene.parameters(n, finer), "tolerance": 1e-8},
                   direct=False, of=of)  # fmt: skip

    fine = scene.meshes[-4:]
    steps = [1, 2, 4, 8] if scene.mu > 0 else []
    return TrueRuns(
        [1 / n for n in fine],
        [one(n, scene.finer) for n in fine],
        [one(scene.meshes[1], times * scene.finer) for times in steps],
    )


def truth_of(runs):
    """What is true, and what is not known of it.

    What increments of one size leave is taken from what more of them give on a coarse mesh.
    """
    true = limit(runs.meshes, runs.sizes)
    doubt = error_of(limit(runs.meshes[-3:], runs.sizes[-3:]), true)
    if runs.steps:
        true, of_steps = to_fine_steps(runs.steps, true)
        doubt += of_steps
    return true, doubt


def truth(program, scene, folder):
    """The forces without an error of mesh or increments, and what is not known of them."""
    return truth_of(runs_for_truth(program, scene, folder))


def error_of(found, true):
    """The largest error of a pair at the ends of increments that both have."""
    here, there = common(found, true)
    scales = [pair[0].max() for pair in true.pairs]
    worst = 0.0
    for one, other, own in zip(found.pairs, true.pairs, scales, strict=True):
        scale = max(own, 1e-3 * max(scales), true.least)
        apart = [a[here] - b[there] for a, b in zip(one[:3], other[:3], strict=True)]
        mu = other[3]
        worst = max(worst, abs(apart[0]).max() / scale,
                    np.linalg.norm(apart[1], axis=1).max() / scale)  # fmt: skip
        if mu > 0:
            worst = max(worst, np.linalg.norm(apart[2], axis=1).max() / (scale * min(mu, 1)))
    return worst
