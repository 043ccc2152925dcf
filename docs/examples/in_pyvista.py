"""A mesh of PyVista in, a grid of PyVista out: its deformed volume is what the stress makes it."""

import pyvista

import bipot

body = pyvista.ImageData(dimensions=(4, 4, 4), spacing=(1.0, 1.0, 1.0))
deck = bipot.Deck("A grid of PyVista, pressed", name="grid")
part = deck.mesh(body)
deck.surface("FOOT", part.faces(lambda x, n: n[:, 2] < -0.9))
deck.node_set("LID", part.nodes(lambda x: x[:, 2] > 2.999))
deck.node_set("X0", part.nodes(lambda x: x[:, 0] < 1e-9))
deck.node_set("Y0", part.nodes(lambda x: x[:, 1] < 1e-9))
deck.material("RUBBER", young=10.0, poisson=0.4)
deck.section("RUBBER", "BODY")
deck.plane("GROUND", point=(0, 0, 0), normal=(0, 0, 1))
deck.interaction("SMOOTH")
deck.pair("FOOT", "GROUND", "SMOOTH")
with deck.step():
    deck.boundary("X0", "XSYMM")
    deck.boundary("Y0", "YSYMM")
    deck.boundary("LID", 3, value=-0.03)

with bipot.run(deck) as result:
    grid = result.to_pyvista()
warped = grid.warp_by_vector("displacement")
print(f"volume {grid.volume:.6f}, deformed {warped.volume:.6f}")

# Shorter by 1 %, and so wider by nu times as much.
expected = 27.0 * (1 - 0.01) * (1 + 0.4 * 0.01) ** 2
assert abs(warped.volume / expected - 1) < 1e-9
# warped.plot(scalars="contact_pressure") opens a window
