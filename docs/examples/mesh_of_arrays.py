"""A mesh of one's own, from numpy arrays: a quarter of a thick ring under pressure from within.

Lame's solution of a thick tube in plane strain tells how far its bore widens.
"""

import numpy as np

import bipot

inner, outer, pressure, young, poisson = 50.0, 100.0, 60.0, 210000.0, 0.3
radii = np.geomspace(inner, outer, 13)
angles = np.linspace(0.0, np.pi / 2, 13)
z, a, r = np.meshgrid([0.0, 5.0], angles, radii, indexing="ij")
points = np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1).reshape(-1, 3)
number = np.arange(len(points)).reshape(z.shape)
low = [number[0, :-1, :-1], number[0, :-1, 1:], number[0, 1:, 1:], number[0, 1:, :-1]]
high = [number[1, :-1, :-1], number[1, :-1, 1:], number[1, 1:, 1:], number[1, 1:, :-1]]
elements = np.stack([*low, *high], axis=-1).reshape(-1, 8)

deck = bipot.Deck("A quarter of a thick ring", name="ring")
ring = deck.mesh((points, elements), name="RING", type="C3D8I")
deck.surface("BORE", ring.faces(lambda x, n: np.hypot(x[:, 0], x[:, 1]) < inner * 1.0001))
deck.node_set("Y0", ring.nodes(lambda x: x[:, 1] < 1e-9))
deck.node_set("X0", ring.nodes(lambda x: x[:, 0] < 1e-9))
deck.material("STEEL", young, poisson)
deck.section("STEEL", "RING")
with deck.step():
    deck.boundary("X0", "XSYMM")
    deck.boundary("Y0", "YSYMM")
    deck.boundary("RING", 3)
    deck.pressure("BORE", pressure)

with bipot.run(deck) as result:
    node = result.nearest_node((inner, 0.0, 0.0))
    widened = result.field("displacement")[node, 0]

share = pressure * inner**2 / (outer**2 - inner**2)
expected = (1 + poisson) / young * share * ((1 - 2 * poisson) * inner + outer**2 / inner)
print(f"the bore widens by {widened:.6f}, by Lame's solution {expected:.6f}")
assert abs(widened / expected - 1) < 0.005, widened / expected
