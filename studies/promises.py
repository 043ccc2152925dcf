"""How the promise of an accuracy ended, as far as a truth with a doubt of its own can tell."""

JUDGED = 0.2  # of what is asked: the doubt up to which a truth can judge
MARKS = {"kept": "", "not judged": " ?", "broken": " **broken**", "refused": " refused"}


def end_of(status, error, asked, doubt):
    """How a run for an accuracy ended, as far as the truth can tell."""
    if status != 0:
        return "refused"
    if error > asked + (doubt if doubt > JUDGED * asked else 0.0):
        return "broken"
    return "kept" if doubt <= JUDGED * asked or error + doubt <= asked else "not judged"


def told_by(sequence):
    """The error by mesh and load steps as the program says it; -1: it does not."""
    return sequence.mesh + max(0.0, sequence.load_steps) if sequence.mesh >= 0 else -1


def effectivity(told, error, doubt):
    """The error as told over the true one; 0 where it is not told, or the truth cannot judge."""
    return told / error if told > 0 and doubt < JUDGED * error else 0.0
