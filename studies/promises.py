"""How the promise of an accuracy ended, as far as a truth with a doubt of its own can tell."""

from collections import Counter

import numpy as np

from studies.scenes import LIMIT

JUDGED = 0.2  # of what is asked: the doubt up to which a truth can judge
ENDS = ("kept", "broken", "not judged", "refused", "over")  # the last: it takes too long
HEADS = [*ENDS[:-1], f"over {LIMIT} s"]
MARKS = {"kept": "", "not judged": " ?", "broken": " **broken**", "refused": " refused"}


def can_judge(asked, doubt):
    """Whether a truth with such a doubt can judge what is asked."""
    return doubt <= JUDGED * asked


def end_of(status, error, asked, doubt):
    """How a run for an accuracy ended, as far as the truth can tell."""
    if status != 0:
        return "refused"
    is_known = can_judge(asked, doubt)
    if error > asked + (0.0 if is_known else doubt):
        return "broken"
    return "kept" if is_known or error + doubt <= asked else "not judged"


def told_by(sequence):
    """The error by mesh and load steps as the program says it; -1: it does not."""
    return sequence.mesh_and_load_steps


def effectivity(told, error, doubt):
    """The error as told over the true one; 0 where it is not told, or the truth cannot judge."""
    return told / error if told > 0 and doubt < JUDGED * error else 0.0


def counts(asks):
    """How many ended in each way of ENDS; of asks what counts is `end`."""
    count = Counter(one.end for one in asks)
    return [count[end] for end in ENDS]


def within(asks):
    """In what part of the asks the error as told is 0.5 to 5 times the true one: in words."""
    good = [one.effectivity for one in asks if one.effectivity > 0]
    return f"{100 * np.mean([0.5 <= value <= 5 for value in good]):.0f} % of {len(good)}"


def reached(asks):
    """How many are reached of those that the truth can judge, by their `is_known`: in words."""
    known = [one.end for one in asks if one.is_known]
    return f"{known.count('kept') + known.count('broken')} of {len(known)}"


def verdict(asks):
    """The lines that say how promises were kept; of asks what counts is `end` and `effectivity`."""
    kept, broken, unknown, *_ = counts(asks)
    lines = [
        f"Promises broken: **{broken}** of {kept + broken} that can be judged; reached",
        f"{kept + broken + unknown} of {len(asks)}.",
    ]
    good = np.array([one.effectivity for one in asks if one.effectivity > 0])
    if good.size > 0:
        lines += [
            f"The estimated errors are {np.median(good):.2g} times the true ones in the median,",
            f"0.5 to 5 times in {within(asks)}",
            f"and less than 0.3 times in {sum(good < 0.3)}.",
        ]
    return lines
