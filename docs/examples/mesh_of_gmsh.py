"""A mesh of Gmsh with physical groups, read by meshio: a block rests on rough ground.

Gmsh writes such a file with `gmsh block.geo -3`; here meshio does, so that the example needs no
Gmsh. What the ground carries is the weight.
"""

import meshio
import numpy as np

import bipot

size, counts = np.array([3.0, 2.0, 1.0]), (3, 2, 2)
grid = np.stack(np.meshgrid(*(np.linspace(0, s, n + 1) for s, n in zip(size, counts, strict=True)),
                            indexing="ij"), axis=-1)
number = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
low = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
elements = np.stack([c[:, :, k] for k in (slice(0, -1), slice(1, None)) for c in low], axis=-1)
elements = elements.reshape(-1, 8)
bottom = np.stack([c[:, :, 0] for c in low], axis=-1).reshape(-1, 4)
tags = [np.full(len(elements), 1), np.full(len(bottom), 2)]
meshio.Mesh(
    grid.reshape(-1, 3), [("hexahedron", elements), ("quad", bottom)],
    cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
    field_data={"block": np.array([1, 3]), "foot": np.array([2, 2])},
).write("block.msh", file_format="gmsh22", binary=False)

deck = bipot.Deck("A block from Gmsh", name="gmsh_block")
deck.mesh("block.msh")  # its groups: a set of elements "block", a surface "foot"
deck.material("STEEL", young=210000.0, poisson=0.3, density=7.8e-9)
deck.section("STEEL", "block")
deck.plane("GROUND", point=(0, 0, 0), normal=(0, 0, 1))
deck.interaction("DRY", friction=0.5)
deck.pair("foot", "GROUND", "DRY")
with deck.step():
    deck.gravity(9810.0)

with bipot.run(deck) as result:
    carried = result.pairs["foot:GROUND"].resultant[-1]

weight = 7.8e-9 * 9810.0 * size.prod()
print(f"the ground carries {carried[2]:.8g}, the weight is {weight:.8g}")
assert abs(carried[2] / weight - 1) < 1e-6
assert np.abs(carried[:2]).max() < 1e-6 * weight
