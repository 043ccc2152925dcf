"""Random scenes of several *STEPs that hold and free bodies: each *STEP has its own supports."""

import numpy as np
from body_scenes import Stack, rough, stiffness_ratio
from random_scenes import SIDES, Builder, body
from scenes import CYLINDER, SPHERE, Boundary, Force, Gravity, Pressure


class Loads:
    """Weight that stays, and what each *STEP has beside it."""

    def __init__(self, b, young, size):
        self.b, self.size = b, size
        self.level = young * b.power(-5, -2.5)

    def weigh(self, step, parts, down):
        """The weight of bodies, from this step on."""
        for part in parts:
            step.gravity.append(Gravity(part, self.level / self.size, down))

    def press(self, step, part, side):
        """A pressure, in this step alone."""
        step.new.add("*DSLOAD")
        if self.b.chance(0.6):
            value = self.level * self.b.between(0, 3)
            step.pressures.append(Pressure(part, side, value, self.b.maybe_amplitude(step, 0.1)))


def new_step(b):
    """A step with none of the supports before it, and few increments."""
    step = b.step()
    step.new.add("*BOUNDARY")
    step.increments = int(b.pick(1, 1, 2, 4))
    return step


def hold_across(b, step, part, axis=2, share=0.75):
    """Rollers on sides of a body across an axis; True where both directions are held."""
    others = [i for i in range(3) if i != axis]
    held = [i for i in others if b.chance(share)]
    for i in held:
        b.hold(step, part, "XYZ"[i] + b.pick("MIN", "MIN", "MAX"), (i,))
    return held == others


def unclamped(b):
    """Clamped on a plane, then free but for rollers, then perhaps clamped again."""
    part, young, size = body(b, density=1.0)
    loads = Loads(b, young, size)
    friction = max(b.friction(), b.pick(0.1, 0.1, 0.0))
    b.pair(part, "ZMIN", b.plane_at(part, "ZMIN", b.pick(0.0, 0.0, 1e-4 * size)), friction)
    slope = b.pick(0.0, 0.0, b.between(0, 0.8) * friction)
    down = np.array([slope, 0.0, -1.0])
    for number in range(b.rng.integers(2, 5)):
        step = new_step(b)
        if number == 0:
            loads.weigh(step, [part], down)
        if number == 0 or b.chance(0.3):
            way = size * b.pick(0.0, -1e-4, -1e-3, 1e-4)
            b.hold(step, part, "ZMAX", b.pick((0, 1, 2), (2,)), way)
        hold_across(b, step, part)
        loads.press(step, part, b.pick("ZMAX", "ZMAX", *SIDES))
    return "clamp taken off"


def driven_then_loaded(b):
    """A tool that is driven onto a held body and then loaded, and driven back."""
    part, young, size = body(b, size=1.0)
    top = b.scene.parts[part].corner + b.scene.parts[part].size * np.array([0.5, 0.5, 1.0])
    kind = b.pick("PLANE", "PLANE", SPHERE, CYLINDER)
    if kind == "PLANE":
        tool = b.plane_at(part, "ZMAX", b.pick(0.0, 1e-3), free=True)
    else:
        rows, _ = b.side(part, "ZMAX")
        over = b.points[rows[int(b.rng.integers(len(rows)))]] + np.array([0.01, 0.02, 0.0])
        radius = b.power(-0.3, 1)
        centre = np.array([over[0], over[1], top[2] + radius + b.pick(0.0, 1e-3)])
        axis = None if kind == SPHERE else np.eye(3)[b.pick(0, 1)]
        tool = b.obstacle(kind, centre, axis, radius, free=True)
    b.pair(part, "ZMAX", tool)
    reference = b.scene.obstacles[tool].reference
    depth = b.power(-3, -2)
    for number in range(b.rng.integers(2, 5)):
        step = new_step(b)
        b.hold(step, part, "ZMIN", (0, 1, 2) if number == 0 or b.chance(0.7) else (2,))
        if not hold_across(b, step, part):
            b.hold(step, part, "ZMIN", (0, 1))
        step.new.add("*CLOAD")
        step.boundaries += [
            Boundary([reference], i, depth * b.pick(0.0, 0.0, b.between(-1, 1))) for i in (0, 1)
        ]
        if number % 2 == 0:
            step.boundaries.append(Boundary([reference], 2, -depth * b.between(0.5, 2)))
        else:
            value = -young * size**2 * depth * b.power(-1.5, 0)
            step.forces.append(Force([reference], 2, value, b.maybe_amplitude(step, 0.1)))
    return "tool driven, then loaded"


def set_down(b):
    """A body held by its upper side, met by a plane from below, and set down on it."""
    part, young, size = body(b, density=1.0)
    loads = Loads(b, young, size)
    friction = max(b.friction(), b.pick(0.1, 0.1, 0.0))
    plane = b.plane_at(part, "ZMIN", b.pick(0.0, 1e-4 * size), free=True)
    b.pair(part, "ZMIN", plane, friction)
    reference = b.scene.obstacles[plane].reference
    for number in range(b.rng.integers(2, 5)):
        step = new_step(b)
        if number == 0:
            loads.weigh(step, [part], np.array([0.0, 0.0, -1.0]))
        moved = size * b.pick(0.0, 2e-4, 1e-3) if number == 0 or b.chance(0.5) else 2e-4 * size
        step.boundaries += [Boundary([reference], i, moved * (i == 2)) for i in range(3)]
        if number == 0 or b.chance(0.3):
            b.hold(step, part, "ZMAX", b.pick((0, 1, 2), (2,)))
        hold_across(b, step, part)
        loads.press(step, part, "ZMAX")
    return "set down on a tool"


def stacked(b):
    """Two blocks, of which each *STEP holds some sides and frees the others."""
    stack = Stack(b, b.pick(1.0, 1.0, 2.0))
    ratio = stiffness_ratio(b)
    below = stack.add(stack.young, density=1.0)
    if b.chance(0.6):
        shape, start = stack.wide, np.zeros(2)
    else:
        part = b.between(0.4, 0.9)
        shape, start = stack.wide * part, stack.wide * (1 - part) / 2
    above = stack.add(stack.young * ratio, 0.0, shape, start, density=1.0)
    loads = Loads(b, stack.young * min(1.0, ratio), stack.size)
    friction = max(rough(b), b.pick(0.1, 0.1, 0.0))
    b.touch(*stack.face(0, 1), friction)
    floor = b.plane_at(below, stack.lower())
    b.pair(below, stack.lower(), floor, max(friction, 0.1))
    for number in range(b.rng.integers(2, 5)):
        step = new_step(b)
        if number == 0:
            loads.weigh(step, [below, above], stack.along(-1.0))
        if number == 0 or b.chance(0.3):
            b.hold(step, above, stack.upper(), (stack.axis,),
                   stack.size * b.pick(0.0, -1e-4, -1e-3, 1e-4))  # fmt: skip
        for part in (below, above):
            # Without friction nothing but rounding decides where a block goes that is not held.
            hold_across(b, step, part, stack.axis, 1.0 if friction == 0 else 0.75)
        loads.press(step, above, stack.upper())
    return "stack held and freed"


KINDS = ((unclamped, 0.3), (driven_then_loaded, 0.25), (set_down, 0.2), (stacked, 0.25))


def random_steps(seed):
    """The scene of a seed."""
    rng = np.random.default_rng([20261129, seed])
    b = Builder(seed, rng)
    maker = KINDS[rng.choice(len(KINDS), p=[w for _, w in KINDS])][0]
    return b.finish(maker(b))
