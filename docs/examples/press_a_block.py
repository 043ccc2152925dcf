"""Build a deck in Python, run it, and compare the force with Hooke's law.

A cube of steel between three planes of symmetry and a lid is pressed on a smooth ground: its stress
is uniform, and the force on the ground is E A u / L.
"""

import bipot

deck = bipot.Deck("A cube on a smooth ground", name="cube")
deck.parameter(n=2, push=0.01)
deck.block("CUBE", cells=("<n>", "<n>", "<n>"), size=(10.0, 10.0, 10.0))
deck.material("STEEL", young=210000.0, poisson=0.3)
deck.section("STEEL", "CUBE")
deck.plane("GROUND", point=(0, 0, 0), normal=(0, 0, 1))
deck.interaction("SMOOTH")
deck.pair("CUBE-ZMIN", "GROUND", "SMOOTH")
with deck.step(increment=0.5):
    deck.boundary("CUBE-XMIN", "XSYMM")
    deck.boundary("CUBE-YMIN", "YSYMM")
    deck.boundary("CUBE-ZMAX", 3, value="<-push>")
    deck.output(nodes=["U"], elements=["S"])

print(deck)  # the text that the program reads; it is written beside the result as cube.inp
with bipot.run(deck, push=0.02) as result:
    force = result.pairs["CUBE-ZMIN:GROUND"].resultant[-1]
    stress = result.field("stress")  # (elements, 6): XX YY ZZ XY YZ XZ
    print("force on the cube:", force, "stress along z:", stress[:, 2].mean())

expected = 210000.0 * 100.0 * 0.02 / 10.0
assert abs(force[2] - expected) < 1e-6 * expected, force
assert abs(stress[:, 2] + expected / 100.0).max() < 1e-6 * expected, stress
