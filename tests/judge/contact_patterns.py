"""Show that no pattern of contact balances the loads on bodies that contact alone holds.

Every point is open, sticks, or slides along some direction. What a pattern allows is wider than the
law by pyramids around cones and sectors of directions alone, and linear: a linear program has the
least that it leaves of the loads. Patterns that are decided in part allow more, so that most are
not looked at.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import linprog
from slow_solver import Problem

OPEN, TOUCHES, STICKS = "open", "touches", "sticks"  # or slides: (first, last) angle of its slip
SOLVED, IMPOSSIBLE, UNKNOWN = "solved", "impossible", "unknown"
EDGES = 16  # of a pyramid
NARROWEST = 1e-6  # sector of directions
SOLVED_TO = 1e-6  # at best, beside the forces of the scene
MOST = 2000  # programs to solve


@dataclass
class Answer:
    """What the best of a pattern leaves of the loads, 0 to 1; reactions and gaps, scaled."""

    left: float
    force: np.ndarray
    gap: np.ndarray


def least_of_patterns(increment, enough):
    """At least how much of the loads every pattern leaves, if more than `enough`; else None.

    Placed where nothing has moved but supports: masters are flat, and slave nodes keep their arms.
    """
    u = np.where(increment.held, increment.target, increment.before)
    problem = Problem(increment, u, np.zeros((len(increment.points), 3)))
    # A point that no master covers might come before one.
    if not problem.counts.any() or not problem.counts[:, 0].all() or not np.any(problem.q):
        return None
    patterns = Patterns(problem, ways_on_masters(increment, problem.frames))
    return patterns.least(enough)


def ways_on_masters(increment, frames):
    """(P, 2): how far points may slip along their tangents before they have left their masters."""
    scene, ways = increment.scene, np.full((len(frames), 2), np.inf)
    for p, (index, *_) in enumerate(increment.points):
        pair = scene.pairs[index]
        if not pair.master:
            continue
        ways[p] = 0.0
        for faces in (scene.faces(pair.part, pair.side), scene.faces(*pair.master)):
            ways[p] += np.ptp(scene.points[np.unique(faces)] @ frames[p, 1:].T, axis=0)
    return ways


def parts(state):
    """The states that a state is made of."""
    if state is None:
        return [TOUCHES, OPEN]
    if state == TOUCHES:
        return [*pairwise(np.linspace(0, 2 * np.pi, 5)), STICKS]
    first, last = state
    middle = (first + last) / 2
    return [(first, middle), (middle, last)]


class Patterns:
    """Branch and bound over the patterns of a contact problem."""

    def __init__(self, problem, ways):
        self.mu, self.counts = problem.mu, problem.counts
        # Forces by what supports press and by the loads, lengths by what these make of gaps.
        softest, gap = np.abs(problem.w).max(), np.abs(problem.x[::3]).max()
        force = max(np.abs(problem.q).sum(), gap / softest if softest > 0 else 0.0)
        unit = max(gap, force * softest) or 1.0
        self.q, self.w = problem.q / force, problem.w * force / unit
        self.g, self.x, self.ways = problem.g, problem.x / unit, ways / unit

    def least(self, enough):
        """As of least_of_patterns."""
        least, waiting = 1.0, [[None] * len(self.mu)]
        if enough * np.abs(self.q).sum() < SOLVED_TO:
            return None
        for _ in range(MOST):
            if not waiting:
                return least
            pattern = waiting.pop()
            status, answer = self.solve(pattern)
            if status == IMPOSSIBLE:
                continue
            if status == SOLVED and answer.left > enough:
                least = min(least, answer.left)
                continue
            broken = self.open_questions(pattern)
            if answer is not None:
                broken = self.broken(pattern, answer, broken > 0)
            if broken.max() <= 1e-9:
                return None  # as good as a solution
            p = int(np.argmax(broken))
            waiting += [[*pattern[:p], state, *pattern[p + 1 :]] for state in parts(pattern[p])]
        return None

    def broken(self, pattern, answer, is_open):
        """By how much each point (P,) breaks the law that its state has not decided yet."""
        force, gap = answer.force.reshape(-1, 3), answer.gap.reshape(-1, 3)
        undecided = np.array([state is None for state in pattern])
        if np.any(undecided & (force[:, 0] * gap[:, 0] > 1e-9)):
            return np.where(undecided, force[:, 0] * gap[:, 0], 0.0)
        slip = np.linalg.norm(gap[:, 1:], axis=1)
        gained = self.mu * force[:, 0] * slip + np.einsum("pk,pk->p", force[:, 1:], gap[:, 1:])
        return np.where(is_open, gained, 0.0)

    def open_questions(self, pattern):
        """How much there is to be decided of each point (P,); 0: nothing."""
        slides = self.counts[:, 1:].all(axis=1) & (self.mu > 0)
        first = {None: 3.0, OPEN: 0.0, TOUCHES: 2.0, STICKS: 0.0}
        left = np.array([first[s] if s in first else (s[1] - s[0]) / np.pi for s in pattern])
        left[left < NARROWEST] = 0.0
        return np.where(slides | (left == first[None]), left, 0.0)

    def reactions(self, p, state):
        """(k, 3): all reactions that a state allows are sums of these, none below 0."""
        if state == OPEN:
            return np.zeros((0, 3))
        if self.mu[p] == 0:
            return np.array([(1.0, 0.0, 0.0)])
        if isinstance(state, tuple):
            first, last = state
            half = (last - first) / 2
            # Against the slip: between both ends of the arc and where their tangents meet.
            angles = np.array([first, last, first + half]) + np.pi
            reach = self.mu[p] * np.array([1.0, 1.0, 1 / np.cos(half)])
        else:
            angles = 2 * np.pi * np.arange(EDGES) / EDGES
            reach = np.full(EDGES, self.mu[p] / np.cos(np.pi / EDGES))
        edges = np.column_stack([np.ones(len(angles)), reach * np.cos(angles),
                                 reach * np.sin(angles)])  # fmt: skip
        return edges * self.counts[p]

    def solve(self, pattern):
        """(SOLVED, Answer), (IMPOSSIBLE, None) or, where no solver ends well, (UNKNOWN, None)."""
        columns = [np.zeros((len(self.x), 0))]
        for p, state in enumerate(pattern):
            edges = self.reactions(p, state)
            columns.append(np.zeros((len(self.x), len(edges))))
            columns[-1][3 * p : 3 * p + 3] = edges.T
        edges = np.hstack(columns)
        n, m = edges.shape[1], len(self.q)
        gaps = np.hstack([self.w @ edges, self.g, np.zeros((len(self.x), 2 * m))])
        balance = np.hstack([self.g.T @ edges, np.zeros((m, m)), np.eye(m), -np.eye(m)])
        equal, no_less = [], []  # (rows, constant): rows @ y + constant = 0, >= 0
        for p, state in enumerate(pattern):
            row, x = gaps[3 * p : 3 * p + 3], self.x[3 * p : 3 * p + 3]
            if state in (None, OPEN):
                no_less.append((row[0], x[0]))
                continue
            equal.append((row[0], x[0]))
            for i in (1, 2):
                if np.isfinite(self.ways[p, i - 1]):
                    no_less += [(s * row[i], s * x[i] + self.ways[p, i - 1]) for s in (1, -1)]
                if state == STICKS:
                    equal.append((row[i], x[i]))
            if isinstance(state, tuple):
                for angle, sign in zip(state, (1, -1), strict=True):
                    across = sign * np.array([-np.sin(angle), np.cos(angle)])
                    no_less.append((across @ row[1:], across @ x[1:]))
        cost = np.concatenate([np.zeros(n + m), np.ones(2 * m)])
        bounds = [(0, None)] * n + [(None, None)] * m + [(0, None)] * (2 * m)
        words = {
            "A_eq": np.vstack([balance, *[row for row, _ in equal]]),
            "b_eq": -np.concatenate([self.q, [c for _, c in equal]]),
        }
        if no_less:
            words["A_ub"] = -np.array([row for row, _ in no_less])
            words["b_ub"] = np.array([c for _, c in no_less])
        for method in ("highs", "highs-ipm"):
            found = linprog(cost, bounds=bounds, method=method, **words)
            if found.status == 2:
                return IMPOSSIBLE, None
            if found.status == 0:
                gap = gaps @ found.x + self.x
                return SOLVED, Answer(found.fun / np.abs(self.q).sum(), edges @ found.x[:n], gap)
        return UNKNOWN, None
