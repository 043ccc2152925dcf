"""Random scenes of surfaces without separation, pressed, pulled, pushed and loaded.

A body that is held at its top, before a plane, or on another body that is held at its foot.
Surfaces touch in the mesh, or begin apart.
"""

import numpy as np
from random_scenes import Builder, add_loads, body
from scenes import Boundary


def random_closed(seed):
    """The scene of a seed."""
    rng = np.random.default_rng([20261, seed])
    b = Builder(seed, rng)
    part, young, size = body(b)
    depth = size * b.power(-4, -2)
    gap = b.pick(0.0, 0.3 * depth)
    reference = None
    if b.chance(0.5):
        kind = "closed, on a plane"
        plane = b.plane_at(part, "ZMIN", gap, b.pick(0.0, 0.0, 0.02) if gap else 0.0,
                           free=b.chance(0.3))  # fmt: skip
        b.pair(part, "ZMIN", plane)
        reference = b.scene.obstacles[plane].reference
    else:
        kind = "closed, on a body"
        shape = np.array([1.0, 1.0, 0.5]) * size * b.pick(1.0, 2.0)
        corner = np.array([-0.1 * size, -0.1 * size, -gap - shape[2]])
        below = b.part(corner, shape, tuple(b.rng.integers(1, 4, 3)), b.material(
            young * b.pick(1.0, 10.0, 0.1)), b.pick("C3D8", "C3D8I", "C3D8B"))  # fmt: skip
        b.touch((part, "ZMIN"), (below, "ZMAX"), small=b.chance(0.5))
    b.scene.pairs[0].closed = not gap
    for number in range(b.rng.integers(2, 5)):
        step = b.step()
        if number == 0:
            b.hold(step, part, "ZMAX", (0, 1, 2))
            if reference is not None:
                step.boundaries += [Boundary([reference], i, 0.0) for i in range(3)]
            elif len(b.scene.parts) > 1:
                b.hold(step, below, "ZMIN", (0, 1, 2))
        way = depth * b.pick(-1.0, 1.0, 0.0) * b.between(0.3, 2.0)
        b.hold(step, part, "ZMAX", (2,), way, b.maybe_amplitude(step, 0.2))
        if b.chance(0.6):
            b.hold(step, part, "ZMAX", (b.pick(0, 1),), depth * b.between(-3.0, 3.0))
        if b.chance(0.3):
            add_loads(b, step, part, young, size, False, b.power(-5, -3))
    b.add_controls()
    return b.finish(kind)
