"""A parameter study: runs side by side, one file each, and only those that are not there yet."""

import numpy as np

import bipot

deck = bipot.Deck("Pressed, then pushed", name="pushed")
deck.parameter(n=2, mu=0.3)
deck.block("BODY", cells=("<n>", "<n>", "<n>"), size=(1.0, 1.0, 1.0))
deck.material("STEEL", young=210000.0, poisson=0.3)
deck.section("STEEL", "BODY")
deck.plane("GROUND", point=(0, 0, 0), normal=(0, 0, 1))
deck.interaction("DRY", friction="<mu>")
deck.pair("BODY-ZMIN", "GROUND", "DRY")
with deck.step(increment=0.5):
    deck.boundary("BODY-ZMAX", 1, 2)
    deck.boundary("BODY-ZMAX", 3, value=-0.01)
with deck.step(increment=0.25):
    deck.boundary("BODY-ZMAX", 1, value=0.1)


def inclination(result):
    """Return how far the force on the block leans at the end."""
    force = result.pairs[0].resultant[-1]
    return {"inclination": -force[0] / force[2]}


def make():
    """Make the study; the second time all of it is there."""
    return bipot.study(
        deck, {"mu": [0.1, 0.2, 0.4], "n": [1, 2]}, folder="friction", processes=2,
        evaluate=inclination,
    )


study = make()
for row in study:
    print(row["path"], row["status"], row["inclination"])
again = make()

# All of the block slides, so the force leans by the coefficient of friction, whatever the mesh.
expected = [0.1, 0.1, 0.2, 0.2, 0.4, 0.4]
np.testing.assert_allclose(study.column("inclination"), expected, rtol=1e-6)
# Not one was run again: a file tells how long its run took.
assert (again.column("seconds") == study.column("seconds")).all()
