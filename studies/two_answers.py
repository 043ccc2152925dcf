"""Find the answers of an increment that has several: the block with a friction coefficient of 10.

    studies/run two_answers                   increment 48 of the block, n = 4
    studies/run two_answers --increment 47 --starts 40

bipot writes the condensed problem x = W r + q of the increment (--export-fclib). Newton's method on
the natural map, written here and nowhere else, then starts from many random reactions; each answer
it finds satisfies Coulomb's law to rounding. Answers that differ by more than 1e-6 are different.
"""

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from bipot.program import ROOT, program_options, set_words
from studies.contact_alone import read_matrix

MU = 10.0
SETTINGS = {"n": 4, "mu": MU, "solver": "AUTO", "local": "AUTO", "tolerance": 1e-10}
SAME = 1e-6


@dataclass
class Answer:
    """A solution: reactions (points, 3), largest |Z| over largest |r|, how often it was found."""

    reactions: np.ndarray
    residual: float
    found: int = 1

    def counts(self):
        """Return how many points are open, stick and slide."""
        normal = self.reactions[:, 0]
        friction = np.linalg.norm(self.reactions[:, 1:], axis=1)
        is_open = normal <= 0
        slides = ~is_open & (friction >= MU * normal * (1 - 1e-9))
        return is_open.sum(), (~is_open & ~slides).sum(), slides.sum()


def export(program, increment, folder):
    """Run the block and return W, q, the friction coefficients and the program's reactions."""
    command = [program, ROOT / "input" / "block.inp", "--quiet", "--export-fclib", str(increment)]
    command += set_words(SETTINGS)
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    with h5py.File(folder / f"block-{increment}.fclib.hdf5") as file:
        group = file["fclib_local"]
        return (
            read_matrix(group["W"]),
            group["vectors/q"][:],
            group["vectors/mu"][:],
            file["solution/r"][:].reshape(-1, 3),
        )


def project(mu, y):
    """Project on the Coulomb cone; return the projection and its derivative."""
    size = np.hypot(y[1], y[2])
    if mu * size <= -y[0]:
        return np.zeros(3), np.zeros((3, 3))
    if size <= mu * y[0]:
        return y.copy(), np.eye(3)
    normal = (y[0] + mu * size) / (1 + mu * mu)
    along = y[1:] / size
    derivative = np.zeros((3, 3))
    derivative[0, 0] = 1
    derivative[0, 1:] = derivative[1:, 0] = mu * along
    derivative[1:, 1:] = mu * mu * np.outer(along, along)
    derivative /= 1 + mu * mu
    derivative[1:, 1:] += mu * normal / size * (np.eye(2) - np.outer(along, along))
    return np.array([normal, *(mu * normal * along)]), derivative


def natural_map(w, q, mu, rho, r):
    """Return Z = r - P(r - rho x*), which is 0 at a solution, and its derivative."""
    x = w @ r + q
    z, derivative = np.zeros_like(r), np.eye(len(r))
    for i, of_point in enumerate(np.split(np.arange(len(r)), len(mu))):
        slip = x[of_point][1:]
        size = np.linalg.norm(slip)
        lift, turn = np.array([mu[i] * size, 0, 0]), np.eye(3)
        if size > 0:
            turn[0, 1:] = mu[i] * slip / size
        y = r[of_point] - rho[i] * (x[of_point] + lift)
        projection, slope = project(mu[i], y)
        z[of_point] = r[of_point] - projection
        derivative[of_point] += slope @ (rho[i] * turn) @ w[of_point]
        derivative[np.ix_(of_point, of_point)] -= slope
    return z, derivative


def newton(w, q, mu, rho, r):
    """Newton's method with halved steps; return the last reactions and |Z|/|r| there."""
    z, derivative = natural_map(w, q, mu, rho, r)
    for _ in range(80):
        size = np.linalg.norm(z)
        if size <= 1e-13 * np.linalg.norm(r):
            break
        try:
            way = np.linalg.solve(derivative, -z)
        except np.linalg.LinAlgError:
            break
        step = 1.0
        while step > 1e-4:
            trial = natural_map(w, q, mu, rho, r + step * way)
            if np.linalg.norm(trial[0]) <= (1 - 1e-4 * step) * size:
                break
            step /= 2
        r = r + step * way
        z, derivative = natural_map(w, q, mu, rho, r)
    return r, abs(z).max() / max(abs(r).max(), np.finfo(float).tiny)


def find_answers(w, q, mu, known, starts, seed=1):
    """Return the answers that random starts lead to, the one through `known` first."""
    rho = np.array([3 / np.trace(w[i : i + 3, i : i + 3]) for i in range(0, len(q), 3)])
    random = np.random.default_rng(seed)
    size = abs(known).max()
    answers = []
    for start in range(starts + 1):
        r = known.copy()
        if start > 0:
            r = size * random.random(known.shape) * random.integers(0, 2, (len(mu), 1))
            r[:, 1:] *= random.choice([-3, 3], (len(mu), 2))
        r, residual = newton(w, q, mu, rho, r.ravel())
        if residual > 1e-11:
            continue
        r = r.reshape(-1, 3)
        for one in answers:
            if abs(r - one.reactions).max() <= SAME * abs(r).max():
                one.found += 1
                break
        else:
            answers.append(Answer(r, residual))
    return answers


def answers_of_block(program, increment=48, starts=25):
    """Return the answers of an increment of the block, the program's own first."""
    with tempfile.TemporaryDirectory(prefix="answers-") as folder:
        return find_answers(*export(program, increment, Path(folder)), starts)


def rows(answers):
    """Return a row of words for each answer."""
    for one in answers:
        force = one.reactions.sum(axis=0)
        yield [
            f"{force[0]:.3f}",
            f"{np.hypot(*force[1:]):.3f}",
            "{}, {}, {}".format(*one.counts()),
            f"{one.residual:.1e}",
            str(one.found),
        ]


HEADS = ["normal force", "friction", "open, stick, slide", "residual", "found"]


def main():
    """Print the answers."""
    parser = program_options(__doc__)
    parser.add_argument("--increment", type=int, default=48)
    parser.add_argument("--starts", type=int, default=25)
    options = parser.parse_args()
    program = options.bipot.resolve()
    answers = answers_of_block(program, options.increment, options.starts)
    for row in [HEADS, *rows(answers)]:
        print("".join(f"{cell:>22}" for cell in row))
    return 0


if __name__ == "__main__":
    sys.exit(main())
