"""What a result holds: histories, contact pairs, fields, what the file says of itself.

A block is pressed on rough ground, then pushed sideways until all of it slides.
"""

import numpy as np

import bipot

deck = bipot.Deck("Pressed, then pushed", name="pushed")
deck.block("BODY", cells=(3, 3, 3), size=(1.0, 1.0, 1.0))
deck.material("STEEL", young=210000.0, poisson=0.3)
deck.section("STEEL", "BODY")
deck.plane("GROUND", point=(0, 0, 0), normal=(0, 0, 1))
deck.interaction("DRY", friction=0.3)
deck.pair("BODY-ZMIN", "GROUND", "DRY")
with deck.step(increment=0.5, direct=True):
    deck.boundary("BODY-ZMAX", 1, 2)
    deck.boundary("BODY-ZMAX", 3, value=-0.01)
with deck.step(increment=0.125, direct=True):
    deck.boundary("BODY-ZMAX", 1, value=0.06)

bipot.run(deck).close()
with bipot.read("pushed.vtkhdf") as result:
    print(result, result.notes)
    time, work = result.history("time"), result.history("energy/dissipation")
    for name in ("energy/dissipation", "contact_pressure"):
        print(f"{name}: {result.describe(name)}")

    pair = result.pairs["BODY-ZMIN:GROUND"]
    tangential, normal = pair.resultant[:, 0], pair.resultant[:, 2]
    for t, ratio, w in zip(time, tangential / normal, work, strict=True):
        print(f"time {t:5.3f}: friction / pressure {ratio:+.4f}, dissipated {w:.4g}")

    sliding = (pair.status == 2).all(axis=1)
    top = result.nearest_node((0.5, 0.5, 1.0))
    moved = result.field("displacement", -1)[top]

assert abs(tangential[-1] / normal[-1] + 0.3) < 1e-6  # against the push
assert sliding[-1] and not sliding[1]
assert abs(moved[0] - 0.06) < 1e-12
assert (np.diff(work) >= -1e-9 * work[-1]).all()
