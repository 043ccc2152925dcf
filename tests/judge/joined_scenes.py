"""Scenes of the other families with what joins, warms and turns: drawn by a generator of its own.

*EQUATION, *COUPLING, *TRANSFORM, *BOUNDARY with FIXED, and *EXPANSION with *TEMPERATURE are added
to a deck of the families `one` and `bodies`. What is added leaves alone the nodes of surfaces that
touch or are tied: they may go along with others as masters, but depend on none.
"""

import numpy as np
from body_scenes import random_bodies
from random_scenes import SIDES, random_scene
from scenes import Boundary, Coupling, Equation, Force, Temperature, Transform


class Joiner:
    """Adds to a scene piece by piece."""

    def __init__(self, scene, rng):
        self.scene, self.rng = scene, rng
        self.points, self.ids = list(scene.points), list(scene.ids)
        self.faced = set()
        for pair in scene.pairs:
            self.faced |= self.rows(pair.part, pair.side)
            if pair.master is not None:
                self.faced |= self.rows(*pair.master)
        for tie in scene.ties:
            self.faced |= self.rows(*tie.slave) | self.rows(*tie.master)
        self.dependent = set()  # rows that depend on others

    def rows(self, part, side):
        """The rows of a side, as a set."""
        return {int(r) for r in self.scene.side_rows(part, side)}

    def held(self):
        """Rows that any step prescribes."""
        return {int(r) for step in self.scene.steps for one in step.boundaries for r in one.rows}

    def chance(self, p):
        """True with probability `p`."""
        return bool(self.rng.random() < p)

    def pick(self, *values):
        """One of some values."""
        return values[self.rng.integers(len(values))]

    def between(self, low, high):
        """Uniform."""
        return float(self.rng.uniform(low, high))

    def node(self, place):
        """A node without elements."""
        self.points.append(np.asarray(place, dtype=float))
        self.ids.append(max(self.ids) + int(self.rng.integers(1, 9)))
        self.scene.loose.append(len(self.points) - 1)
        return len(self.points) - 1

    def amplitude(self, step):
        """An amplitude over a step, or None."""
        if self.chance(0.7):
            return None
        t = step.period
        times, values = self.pick(([0.0, t], [0.0, 0.7]), ([0.0, 0.5 * t, t], [0.0, 1.0, 0.4]),
                                  ([0.0, t], [1.0, 1.0]))  # fmt: skip
        self.scene.amplitudes.append((times, values))
        return len(self.scene.amplitudes) - 1

    # -- what is added ------------------------------------------------------------------------

    def warm(self):
        """Materials that expand, first temperatures, and temperatures of bodies and sides."""
        scene = self.scene
        for material in scene.materials:
            if self.chance(0.8):
                material.expansion = float(10 ** self.rng.uniform(-6, -3))
        largest = max(m.expansion or 0.0 for m in scene.materials)
        if not largest:
            scene.materials[0].expansion = largest = 1e-5
        rise = 10 ** self.rng.uniform(-4, -2.5) / largest
        if self.chance(0.5):
            rows = list(self.pick(*scene.parts).rows)
            scene.first_temperatures.append(Temperature(rows, self.between(-1, 1) * rise))
        for number, step in enumerate(scene.steps):
            if self.chance(0.3) and len(scene.steps) > 1:
                continue
            for _ in range(self.rng.integers(1, 3)):
                rows = list(self.pick(*scene.parts).rows)
                part = int(self.rng.integers(len(scene.parts)))
                name = None
                if self.chance(0.3):
                    side = self.pick(*SIDES)
                    rows, name = sorted(self.rows(part, side)), f"{scene.parts[part].name}-{side}"
                step.temperatures.append(Temperature(rows, self.between(-1, 1) * rise,
                                                     self.amplitude(step), name))  # fmt: skip
            if number and self.chance(0.3):
                step.new.add("*TEMPERATURE")

    def stay(self):
        """Later steps keep what an earlier one has moved, or hold a side where it is."""
        scene = self.scene
        if len(scene.steps) < 2:
            return
        number = int(self.rng.integers(1, len(scene.steps)))
        step = scene.steps[number]
        if step.new or any(s.new for s in scene.steps):
            return
        cards = [b for s in scene.steps[:number] for b in s.boundaries]
        if cards and self.chance(0.7):
            one = self.pick(*cards)
            for row in one.rows:
                if any(row in b.rows and b.dof == one.dof for b in step.boundaries):
                    return
            step.boundaries.append(Boundary(one.rows, one.dof, 0.0, None, one.name, fixed=True))
            return
        part = int(self.rng.integers(len(scene.parts)))
        side = self.pick(*SIDES)
        rows = self.rows(part, side)
        if rows & (self.faced | self.held() | self.dependent):
            return
        name = f"{scene.parts[part].name}-{side}"
        for dof in range(3):
            step.boundaries.append(Boundary(sorted(rows), dof, 0.0, None, name, fixed=True))

    def sides(self):
        """All (part, side, name), in any order."""
        all_ = [(part, side, f"{one.name}-{side}")
                for part, one in enumerate(self.scene.parts) for side in SIDES]  # fmt: skip
        return [all_[k] for k in self.rng.permutation(len(all_))]

    def turn_axes(self):
        """Supports and loads of a side that is held in all directions are said along others.

        Or a side that nothing holds is held, or pushed, along slanting directions.
        """
        scene = self.scene
        if self.chance(0.5):
            taken = self.faced | self.held() | self.dependent
            for part, side, name in self.sides():
                rows = sorted(self.rows(part, side))
                free = [r for r in rows if r not in taken]
                if len(free) < len(rows) and (len(free) < 2 or self.chance(0.5)):
                    continue
                name = name if len(free) == len(rows) else None
                if not self.lay_axes(name, free):
                    return
                step = self.pick(*scene.steps)
                if self.chance(0.6):
                    force = self.force(part) * self.between(-1, 1) / len(free)
                    amplitude = self.amplitude(step)
                    step.forces.append(Force(free, self.pick(0, 1, 2), force, amplitude, name))
                if self.chance(0.6) and not any("*BOUNDARY" in s.new for s in scene.steps):
                    way = self.little(part) * self.between(-1, 1) * self.pick(0, 1)
                    amplitude = self.amplitude(step)
                    step.boundaries.append(Boundary(free, self.pick(0, 1, 2), way, amplitude, name))
                return
            return
        sides = {}
        for one in scene.steps[0].boundaries:
            if one.name is not None and one.dof < 3:
                sides.setdefault(one.name, (set(), one.rows))[0].add(one.dof)
        sides = [(name, rows) for name, (dofs, rows) in sides.items() if dofs == {0, 1, 2}]
        sides = [(name, rows) for name, rows in sides
                 if not set(rows) & (self.faced | self.dependent)]  # fmt: skip
        if not sides:
            return
        self.lay_axes(*self.pick(*sides))

    def lay_axes(self, name, rows):
        """Local directions at some nodes; false: they came out too close to an axis."""
        scene = self.scene
        around = self.chance(0.4)
        if around:
            places = scene.points[list(rows)]
            size = np.ptp(scene.points[scene.parts[0].rows], axis=0).max()
            way = self.rng.normal(size=3)
            foot = places.mean(axis=0) + size * (3 * np.eye(3)[self.rng.integers(3)]
                                                 + self.rng.uniform(-1, 1, 3))  # fmt: skip
            points = np.concatenate([foot, foot + size * way])
            here = Transform(rows, points, True)
            for place in places:
                beside = np.cross(place - foot, way)
                if np.linalg.norm(beside) < 0.2 * size * np.linalg.norm(way):
                    return False
        else:
            points = self.rng.normal(size=6)
            if np.linalg.norm(np.cross(points[:3], points[3:])) < 0.1:
                return False
            here = Transform(rows, points, False)
        here.rows, here.name = [int(r) for r in rows], name
        scene.transforms.append(here)
        self.dependent |= set(here.rows)
        return True

    def equate(self):
        """Nodes of a side go along with those of another, or with one of them."""
        scene = self.scene
        part = int(self.rng.integers(len(scene.parts)))
        axis = "XYZ"[self.rng.integers(3)]
        ends = [sorted(self.rows(part, axis + end), key=lambda r: self.ids[r])
                for end in ("MIN", "MAX")]  # fmt: skip
        if self.chance(0.5):
            ends.reverse()
        taken = self.faced | self.held() | self.dependent
        pairs = [(d, m) for m, d in zip(*ends, strict=True) if d not in taken]
        if len(pairs) < 2:
            return
        dof = int(self.rng.integers(3))
        if self.chance(0.4):
            # A side that stays flat: its first node leads.
            rows = [d for d, _ in pairs]
            terms = [(rows[1:], dof, 1.0), ([rows[0]] * (len(rows) - 1), dof, -1.0)]
        else:
            share = self.pick(-1.0, -1.0, 0.5, -2.0)
            other = self.pick(dof, int(self.rng.integers(3)))
            terms = [([d for d, _ in pairs], dof, self.pick(1.0, 1.0, -2.0)),
                     ([m for _, m in pairs], other, share)]  # fmt: skip
        if set(terms[0][0]) & set(terms[1][0]):
            return
        if self.chance(0.6):
            leader = self.node(scene.points[pairs[0][0]] + self.rng.uniform(-1, 1, 3))
            terms.append(([leader] * len(terms[0][0]), dof, self.between(-2, 2)))
            step = self.pick(*scene.steps)
            draw = self.rng.random()
            if draw < 0.4:
                self.scene.steps[0].boundaries.append(Boundary([leader], dof, 0.0))
                value = self.little(part) * self.between(-1, 1)
                step.boundaries.append(Boundary([leader], dof, value, self.amplitude(step)))
            elif draw < 0.7:
                step.forces.append(Force([leader], dof, self.force(part) * self.between(-1, 1),
                                         self.amplitude(step)))  # fmt: skip
        self.dependent |= set(terms[0][0])
        scene.equations.append(Equation(terms))

    def couple(self):
        """A side goes with a reference node, or a reference node with a side."""
        scene = self.scene
        if any("*BOUNDARY" in s.new for s in scene.steps):
            return
        mean = self.chance(0.4)
        for part, side, name in self.sides():
            rows = self.rows(part, side)
            others = {int(r) for s in scene.steps for b in s.boundaries if b.name != name
                      for r in b.rows}  # fmt: skip
            if mean or not rows & (self.faced | others | self.dependent):
                break
        else:
            return
        place = scene.points[sorted(rows)].mean(axis=0)
        place = place + self.rng.uniform(-1, 1, 3) * scene.parts[part].size * self.pick(0.0, 0.5)
        held = not mean and any(b.name == name for s in scene.steps for b in s.boundaries)
        reference = self.node(place)
        kinematic = held or not mean
        one = Coupling(part, side, reference, kinematic)
        step = self.pick(*scene.steps)
        if held:
            self.prescribe(one, name)
        if kinematic and not held and self.chance(0.3):
            one.dofs = tuple(sorted(self.rng.choice(3, 2, replace=False).tolist()))
            for dof in {0, 1, 2} - set(one.dofs):
                scene.steps[0].boundaries.append(Boundary([reference], dof, 0.0))
            for dof in (3, 4, 5):
                scene.steps[0].boundaries.append(Boundary([reference], dof, 0.0))
        if not held:
            dof = self.pick(*one.dofs)
            step.forces.append(Force([reference], dof, self.force(part) * self.between(-1, 1),
                                     self.amplitude(step)))  # fmt: skip
            if len(one.dofs) == 3 and self.chance(0.6):
                moment = self.force(part) * scene.parts[part].size.min() * self.between(-0.3, 0.3)
                step.forces.append(Force([reference], int(self.rng.integers(3, 6)), moment,
                                         self.amplitude(step)))  # fmt: skip
        if kinematic:
            self.dependent |= rows
        scene.couplings.append(one)

    def prescribe(self, one, name):
        """What a side was prescribed its reference node is; it turns by little, freely or not."""
        # On a pivot friction makes bodies topple, which the slow solver cannot prove.
        scene = self.scene
        angle = self.pick(*([0.0, 0.0, 1.0] if scene.pairs else [None, 0.0, 1.0]))
        for step in scene.steps:
            for card in step.boundaries:
                if card.name == name:
                    card.rows, card.name = [one.reference], None
        if angle is None:
            return
        for dof in (3, 4, 5):
            scene.steps[0].boundaries.append(Boundary([one.reference], dof, 0.0))
        if angle:
            angle = self.between(-1, 1) * self.little(one.part) / scene.parts[one.part].size.max()
            step = self.pick(*scene.steps)
            step.boundaries.append(
                Boundary([one.reference], int(self.rng.integers(3, 6)), angle, self.amplitude(step))
            )

    def little(self, part):
        """A displacement."""
        return self.scene.parts[part].size.min() * 10 ** self.rng.uniform(-4, -2.5)

    def force(self, part):
        """A force that strains a part a little."""
        young = min(m.young for m in self.scene.materials)
        return young * self.scene.parts[part].size.min() ** 2 * 10 ** self.rng.uniform(-4.5, -3)

    def finish(self):
        """The scene, with rows for rotations and stand-ins behind its nodes."""
        scene, last = self.scene, max(self.ids)
        for number, one in enumerate(scene.couplings):
            one.rotation = len(self.points)
            self.points.append(self.points[one.reference])
            self.ids.append(last + 1 + number)
        for one in scene.transforms:
            one.stand_ins = list(range(len(self.points), len(self.points) + len(one.rows)))
            self.points += [self.points[r] for r in one.rows]
            self.ids += [self.ids[r] for r in one.rows]
        scene.points, scene.ids = np.array(self.points), np.array(self.ids)
        return scene


def random_joined(seed):
    """The scene of a seed of this family."""
    rng = np.random.default_rng([20262, seed])
    scene = (random_scene, random_bodies)[rng.integers(2)](seed)
    scene.exact = None
    joiner = Joiner(scene, rng)
    for piece, often in ((joiner.couple, 0.5), (joiner.turn_axes, 0.4), (joiner.equate, 0.4),
                         (joiner.warm, 0.4), (joiner.stay, 0.5), (joiner.couple, 0.2)):  # fmt: skip
        if joiner.chance(often):
            piece()
    scene.kind = "joined: " + scene.kind
    return joiner.finish()
