"""Elements of eight nodes at finite strain: forces are derivatives of the energy, by complex steps.

No stress is computed: the energy of an element is written in the principal invariants of
`C - I = F^T F - I`, Ogden's in its eigenvalues, and its derivative along a displacement is the
imaginary part of the energy at a place that is moved by `i h`, over `h`; nothing is subtracted, so
`h` may be so small that no digit is lost.
"""

import math

import numpy as np
from elements import REAL, Elements

ST_VENANT, NEO_HOOKE, MOONEY_RIVLIN, BLATZ_KO, YEOH, OGDEN = (
    "ST VENANT", "NEO HOOKE", "MOONEY-RIVLIN", "BLATZ-KO", "YEOH", "OGDEN",
)  # fmt: skip
LITTLE = REAL(1e-300)  # what its square leaves at rest is 0 in double precision
BANDS = 400  # directions on a sphere: 0.1 apart
DIFFERENCE = REAL(1e-6)  # of an element: exact to 1e-12, as its square is


def determinant_of(f):
    """Determinants (...) of matrices (..., 3, 3), which may be complex."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    return (a * np.cross(b, c)).sum(axis=-1)


def invariants_of(h):
    """(i1, i2, i3) of `C - I`, and the trace of its square, for gradients (..., 3, 3) of u.

    Those of `C` are `3 + i1`, `3 + 2 i1 + i2` and `J^2 = 1 + i1 + i2 + i3`.
    """
    c = h + np.swapaxes(h, -1, -2) + np.einsum("...ki,...kj->...ij", h, h)
    first = np.einsum("...ii->...", c)
    squares = np.einsum("...ij,...ij->...", c, c)
    return first, (first**2 - squares) / 2, determinant_of(c), squares


def stepped(function, derivative, z):
    """A function of `z`, whose imaginary part is a step: next to nothing beside the real part."""
    if not np.iscomplexobj(z):
        return function(z)
    return function(z.real) + 1j * (z.imag * derivative(z.real))


def series(x, terms):
    """The sum over n >= 2 of `terms(n)` times x^n."""
    out = np.zeros_like(x)
    for n in range(60, 1, -1):
        out = (out + terms(n)) * x
    return out * x


def exponential_rest(x):
    """exp(x) - 1 - x."""
    factorial = [math.factorial(n) for n in range(61)]
    near = series(np.clip(x, -1, 1), lambda n: 1 / REAL(factorial[n]))
    return np.where(np.abs(x) < 1, near, np.expm1(x) - x)


def logarithm_rest(x):
    """x - log(1 + x)."""
    near = series(np.clip(x, -0.3, 0.3), lambda n: (-1) ** n / REAL(n))
    return np.where(np.abs(x) < 0.3, near, x - np.log1p(x))


def yeoh_terms(share):
    """C20 and C30 of Yeoh's law over C10."""
    return -share / 4, share / 6


def ogden_terms(share):
    """(mu over their sum, alpha) of Ogden's law with two terms, one of them negative."""
    return (1 + share, 2.6), (-share, -1.5)


def principal_values(c):
    """The eigenvalues of symmetric matrices (..., 3, 3), whose imaginary part is a step."""
    values, axes = np.linalg.eigh(np.asarray(c.real, dtype=float))
    if not np.iscomplexobj(c):
        return values
    return values + 1j * np.einsum("...ki,...kl,...li->...i", axes, c.imag, axes)


def energy_density(law, share, lame, shear, h):
    """Energy of an undeformed unit volume at displacement gradients (..., 3, 3).

    Terms of the first order in `h` are left out where they cancel each other: at rest nothing is
    lost.
    """
    i1, i2, i3, squares = invariants_of(h)
    if law == ST_VENANT:
        return lame / 8 * i1**2 + shear / 4 * squares
    k = i1 + i2 + i3
    log_change = stepped(np.log1p, lambda x: 1 / (1 + x), k) / 2
    # i1 - 2 log J
    left = stepped(logarithm_rest, lambda x: x / (1 + x), k) - i2 - i3

    def grown(x):
        return stepped(np.expm1, np.exp, x)

    def rest(x):
        return stepped(exponential_rest, np.expm1, x)

    if law == BLATZ_KO:
        of_inverse = 3 * rest(-2 * log_change) + (2 * i1 + i2) * grown(-2 * log_change)
        return shear / 2 * (of_inverse + i2 + 2 * rest(log_change) + 2 * left)
    bulk = lame + 2 * shear / 3
    volume = bulk / 2 * grown(log_change) ** 2
    if law == OGDEN:
        c = h + np.swapaxes(h, -1, -2) + np.einsum("...ki,...kj->...ij", h, h)
        logs = stepped(np.log1p, lambda x: 1 / (1 + x), principal_values(c)) / 2
        logs = logs - log_change[..., None] / 3
        terms = [2 * mu / alpha**2 * rest(alpha * logs) for mu, alpha in ogden_terms(share)]
        return shear * sum(terms).sum(axis=-1) + volume
    t = -2 * log_change / 3
    first = 3 * rest(t) + i1 * grown(t) + left
    if law == YEOH:
        c20, c30 = yeoh_terms(share)
        return shear / 2 * (first + c20 * first**2 + c30 * first**3) + volume
    second = 3 * rest(2 * t) + (2 * i1 + i2) * grown(2 * t) + 2 * left + i2
    isochoric = (1 - share) * first + share * second
    return shear / 2 * isochoric + volume


class FiniteElements(Elements):
    """Elements C3D8; `laws` [(name, share)] one an element."""

    def __init__(self, points, nodes, types, young, poisson, laws):
        if set(types) != {"C3D8"}:
            raise ValueError("at finite strain elements are C3D8")
        super().__init__(points, nodes, types, young, poisson)
        self.laws = [(str(law), float(share)) for law, share in laws]

    def displacement_gradients(self, u):
        """(E, 8, 3, 3) at the Gauss points."""
        moved = np.asarray(u, dtype=REAL)[self.nodes]
        moved = moved - moved[:, :1]
        return np.einsum("eai,egaj->egij", moved, self.gradients)

    def densities(self, h):
        """Energies (E, ...) of an undeformed unit volume at gradients (E, ..., 3, 3)."""
        out = np.empty(h.shape[:-2], dtype=h.dtype)
        for law in set(self.laws):
            of = np.array([one == law for one in self.laws])
            shape = (-1,) + (1,) * (h.ndim - 3)
            out[of] = energy_density(
                *law, self.lame[of].reshape(shape), self.shear[of].reshape(shape), h[of]
            )
        return out

    def energy(self, u):
        """The strain energy of displacements `u` (N, 3)."""
        return float((self.weight * self.densities(self.displacement_gradients(u))).sum())

    def forces_of_elements(self, h):
        """Forces (E, 8, 3) of gradients (E, 8, 3, 3): derivatives of the energy."""
        out = np.zeros((len(h), 8, 3), dtype=REAL)
        for i in range(3):
            step = np.zeros((*h.shape[:2], 8, 3, 3), dtype=np.clongdouble)
            step[..., i, :] = 1j * LITTLE * self.gradients
            energy = self.densities(h[:, :, None] + step)
            out[:, :, i] = np.einsum("eg,ega->ea", self.weight, energy.imag / LITTLE)
        return out

    def internal_force(self, u):
        """Forces (N, 3) that displacements `u` (N, 3) call for, float."""
        out = np.zeros(self.points.shape, dtype=REAL)
        h = self.displacement_gradients(u)
        if determinant_of(np.eye(3) + h).min() <= 0:
            return np.full(out.shape, np.nan)
        np.add.at(out, self.nodes, self.forces_of_elements(h))
        return out.astype(float)

    def tangent(self, u):
        """The dense matrix (3N, 3N) of derivatives of the forces, by differences; symmetric."""
        h = self.displacement_gradients(u)
        n = 3 * len(self.points)
        out = np.zeros((n, n))
        dofs = (3 * self.nodes[:, :, None] + np.arange(3)).reshape(len(self.nodes), 24)
        lengths = 1 / np.abs(self.gradients).max(axis=(1, 2, 3))
        for a in range(8):
            for i in range(3):
                step = np.zeros_like(h)
                step[:, :, i] = DIFFERENCE * lengths[:, None, None] * self.gradients[:, :, a]
                ends = [self.forces_of_elements(h + step), self.forces_of_elements(h - step)]
                column = (ends[0] - ends[1]).reshape(-1, 24) / (2 * DIFFERENCE * lengths[:, None])
                column = column.astype(float)
                for at, values in zip(dofs, column, strict=True):
                    out[at, at[3 * a + i]] += values
        return (out + out.T) / 2

    def least_acoustic(self, u):
        """The least eigenvalue of an acoustic tensor at a Gauss point, over `lambda + 2 G`.

        Of all directions of bands on a sphere of points; below 0 the law has lost its ellipticity.
        """
        return self.least_acoustic_at(self.displacement_gradients(u))

    def least_acoustic_at(self, h, which=slice(None)):
        """The same at given gradients (E, n, 3, 3) of displacements, of the elements `which`."""
        units = np.eye(9).reshape(9, 3, 3)

        def stress(at):
            energy = self.densities(at[:, :, None] + 1j * LITTLE * units)
            return energy.imag / LITTLE

        moduli = np.stack(
            [(stress(h + DIFFERENCE * e) - stress(h - DIFFERENCE * e)) / (2 * DIFFERENCE)
             for e in units], axis=-1,
        ).astype(float)  # fmt: skip
        moduli = moduli.reshape(*h.shape[:2], 3, 3, 3, 3)
        moduli /= (self.lame + 2 * self.shear).astype(float)[:, None, None, None, None, None]
        height = np.linspace(-1, 1, BANDS)
        angle = np.pi * (3 - np.sqrt(5)) * np.arange(BANDS)
        radius = np.sqrt(1 - height**2)
        least = np.inf
        for n in np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1):
            acoustic = np.einsum("egijkl,j,l->egik", moduli, n, n)
            least = min(least, np.linalg.eigvalsh(acoustic[which]).min())
        return float(least)
