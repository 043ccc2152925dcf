"""What a scene prescribes and loads at a time, by the judge's own reading of docs/deck.md."""

import numpy as np
from scenes import EPS


def amplitude_at(amplitude, time):
    """(value, steepest slope around `time`) of a table; constant outside."""
    times, values = (np.asarray(a, dtype=float) for a in amplitude)
    # Beside a jump what a time is rounded by is a load.
    nearest = times[np.abs(times - time).argmin()]
    if abs(nearest - time) <= 8 * EPS * np.abs(times).max():
        time = nearest
    value = float(np.interp(time, times, values))
    if len(times) == 1:
        return value, 0.0
    slopes = np.abs(np.diff(values) / np.diff(times))
    near = (times[:-1] <= time * (1 + 1e-9) + 1e-300) & (times[1:] >= time * (1 - 1e-9))
    return value, float(slopes[near].max(initial=0.0))


def kinks_of(amplitude, period):
    """Times within a step, its ends left out, at which a table changes its slope."""
    times, values = (np.asarray(a, dtype=float) for a in amplitude)
    slopes = np.concatenate([[0.0], np.diff(values) / np.diff(times), [0.0]])
    # Constant before the table and after it.
    bends = np.abs(np.diff(slopes)) * period > 1e-9 * np.abs(values).max(initial=0.0)
    return [t for t in times[bends] if 0.0 < t < period]


class LoadPath:
    """Walks through the steps of a scene; `begin` a step, then ask for times within it."""

    def __init__(self, scene):
        self.scene = scene
        elements = scene.elements()
        self.pressure_forces, self.weights = {}, {}
        for step in scene.steps:
            for one in step.pressures:
                key = (one.part, one.side)
                if key not in self.pressure_forces:
                    faces = scene.parts[one.part].sides[one.side]
                    self.pressure_forces[key] = elements.pressure_force(faces)
            for one in step.gravity:
                if one.part not in self.weights:
                    density = [scene.materials[m].density or 0.0 for m in scene.material]
                    which = np.asarray(scene.parts[one.part].elements)
                    self.weights[one.part] = elements.weights(density, which)
        self.expansion = [scene.materials[m].expansion or 0.0 for m in scene.material]
        self.warm = scene.first_temperature()  # at the end of the step before
        self.levels = {}  # place of a load -> its value at the end of the step before
        self.prescribed = {}  # (row, dof) -> None
        self.step = None

    def begin(self, step, u):
        """Begin step number `step` from displacements `u` (N, 3)."""
        if self.step is not None:
            period = self.scene.steps[self.step].period
            self.levels = self.levels_at(period)[0]
            self.warm = self.temperatures(period)
        self.step = step
        cards = self.scene.steps[step]
        if "*BOUNDARY" in cards.new:
            self.prescribed = {}
        held = {key: ("hold", float(u[key])) for key in self.prescribed}
        for one in cards.boundaries:
            for row in one.rows:
                *key, factor = self.scene.unknown_of(int(row), one.dof)
                key = tuple(key)
                if one.fixed:
                    held[key] = ("hold", float(u[key]))
                elif one.amplitude is None:
                    held[key] = ("ramp", float(u[key]), factor * one.value)
                else:
                    held[key] = ("follow", one.amplitude, factor * one.value)
        self.prescribed = held
        # Loads by place: several cards of one place add up.
        self.changes = {}
        for keyword, place, value, amplitude in self.cards_of(cards):
            self.changes.setdefault((keyword, *place), []).append((value, amplitude))
        self.ending = [
            key for key in self.levels if key[0] in cards.new and key not in self.changes
        ]

    @staticmethod
    def cards_of(step):
        """(keyword, place, value, amplitude) of the loads of a step."""
        for one in step.forces:
            for row in one.rows:
                yield "*CLOAD", ("force", int(row), one.dof), one.value, one.amplitude
        for one in step.pressures:
            keyword = "*DLOAD" if one.by_faces else "*DSLOAD"
            yield keyword, ("pressure", one.part, one.side), one.value, one.amplitude
        for one in step.gravity:
            way = one.direction / np.linalg.norm(one.direction)
            for i in range(3):
                value = one.value * way[i]
                yield "*DLOAD", ("weight", one.part, i), value, one.amplitude

    def kinks(self):
        """Times within the step at which a load or a support turns."""
        step = self.scene.steps[self.step]
        used = {amplitude for *_, amplitude in self.cards_of(step)}
        used |= {one.amplitude for one in [*step.boundaries, *step.temperatures]}
        found = [kinks_of(self.scene.amplitudes[a], step.period) for a in used - {None}]
        return sorted(t for one in found for t in one)

    def levels_at(self, time):
        """(values of the loads by place, how uncertain rounding of the time makes them)."""
        period = self.scene.steps[self.step].period
        share = min(1.0, time / period)
        levels, doubt = dict(self.levels), {}
        for key in self.ending:
            levels[key] = (1 - share) * self.levels[key]
        for key, cards in self.changes.items():
            ramps = [value for value, amplitude in cards if amplitude is None]
            old = self.levels.get(key, 0.0)
            total = old + share * (sum(ramps) - old) if ramps else 0.0
            for value, amplitude in cards:
                if amplitude is not None:
                    factor, slope = amplitude_at(self.scene.amplitudes[amplitude], time)
                    total += factor * value
                    doubt[key] = doubt.get(key, 0.0) + abs(value) * slope * 8 * EPS * period
            levels[key] = total
        return levels, doubt

    def loads(self, time, u=None, dead=False):
        """Nodal forces (N, 3) at `time` of the step, reference nodes included.

        At finite strain pressures follow the displacements `u` (N, 3); `dead`: without these.
        """
        out = np.zeros_like(self.scene.points)
        for key, value in self.levels_at(time)[0].items():
            _, kind, place, which = key
            if kind == "force":
                self.scene.add_force(out, place, which, value)
            elif kind == "pressure":
                force = self.pressure_forces[place, which]
                if self.scene.finite and dead:
                    continue
                if self.scene.finite and u is not None:
                    faces = self.scene.parts[place].sides[which]
                    force = self.scene.elements().pressure_force(faces, u)
                out += value * force
            else:
                out[:, which] += value * self.weights[place]
        return out

    def temperatures(self, time):
        """(N,) at `time` of the step; of one node the last card counts."""
        step = self.scene.steps[self.step]
        share = min(1.0, time / step.period)
        out = self.warm.copy()
        if "*TEMPERATURE" in step.new:
            out += share * (self.scene.first_temperature() - out)
        for one in step.temperatures:
            rows = list(one.rows)
            if one.amplitude is None:
                out[rows] = self.warm[rows] + share * (one.value - self.warm[rows])
            else:
                factor, _ = amplitude_at(self.scene.amplitudes[one.amplitude], time)
                out[rows] = factor * one.value
        return out

    def thermal(self, time):
        """Nodal forces (N, 3) of hindered expansion at `time` of the step."""
        if not any(self.expansion):
            return np.zeros_like(self.scene.points)
        rise = self.temperatures(time) - self.scene.first_temperature()
        return self.scene.elements().thermal_force(self.expansion, rise)

    def supports(self, time):
        """{(row, dof): (displacement, size of the terms it is made of, doubt from the time)}."""
        period = self.scene.steps[self.step].period
        share = min(1.0, time / period)
        out = {}
        for key, rule in self.prescribed.items():
            if rule[0] == "hold":
                out[key] = (rule[1], abs(rule[1]), 0.0)
            elif rule[0] == "ramp":
                _, old, value = rule
                size = max(abs(old), abs(value))
                out[key] = (old + share * (value - old), size, 4 * EPS * abs(value - old))
            else:
                _, amplitude, value = rule
                factor, slope = amplitude_at(self.scene.amplitudes[amplitude], time)
                out[key] = (factor * value, abs(factor * value),
                            abs(value) * slope * 8 * EPS * period)  # fmt: skip
        return out
