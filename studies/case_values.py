"""Contact radius, peak pressure and stick radius from the nodal forces of a contact on a grid.

A node's force over its area is the pressure averaged with the node's shape function, not the
pressure at the node. So it is set against r^2 averaged in the same way: exact where p is linear in
x^2 and y^2, on graded grids and at planes of symmetry too. Radii come from fits of what the theory
says is linear in r^2, so they are not bound to the grid.
"""

from types import SimpleNamespace

import numpy as np

from bipot.result import OPEN, STICK


def grid_lines(values):
    """Return the different values in ascending order, and the index of each value in them."""
    scale = np.ptp(values)
    lines, index = np.unique(np.round(values / scale, 9), return_inverse=True)
    return lines * scale, index


def mean_square(values, centre=0.0):
    """Return (x - centre)^2 averaged over the hat functions of a grid, at each of its nodes' x."""
    lines, index = grid_lines(np.asarray(values) - centre)
    steps = np.diff(lines)
    left, right = np.append(0.0, steps), np.append(steps, 0.0)
    offset = (right - left) / 3
    second = (left**3 + right**3) / (6 * (left + right))
    return (lines**2 + 2 * lines * offset + second)[index]


def contact_points(pair, centre=(0.0, 0.0), row=-1):
    """Return what the fits need of a pair on a plane grid in x and y, at one increment.

    x and mean r^2 about `centre`, pressure, magnitude of the traction, and status of each point.
    """
    x, y = pair.coordinates[:, 0], pair.coordinates[:, 1]
    reaction = pair.reaction[row]
    return SimpleNamespace(
        x=x - centre[0],
        r2=mean_square(x, centre[0]) + mean_square(y, centre[1]),
        area=pair.area,
        normal=reaction[:, 0].sum(),
        pressure=reaction[:, 0] / pair.area,
        traction=np.linalg.norm(reaction[:, 1:], axis=1) / pair.area,
        status=pair.status[row],
    )


def hertz(force, radius, modulus):
    """Return contact radius and peak pressure of Hertz's theory; `modulus` is E/(1 - nu^2)."""
    a = (0.75 * force * radius / modulus) ** (1 / 3)
    return a, 1.5 * force / (np.pi * a * a)


def fit_hertz(points, least=0.3):
    """Fit p^2 = p0^2 (1 - r^2/a^2) where p is at least `least` of its largest; return a, p0."""
    used = points.pressure > least * points.pressure.max()
    slope, p2 = np.polyfit(points.r2[used], points.pressure[used] ** 2, 1)
    return np.sqrt(-p2 / slope), np.sqrt(p2)


def fit_line(pair, least=0.3):
    """Fit p^2 of a contact along y like fit_hertz; return half width and peak pressure."""
    pressure = pair.reaction[-1, :, 0] / pair.area
    used = pressure > least * pressure.max()
    x2 = mean_square(pair.coordinates[:, 0])[used]
    slope, p2 = np.polyfit(x2, pressure[used] ** 2, 1)
    return np.sqrt(-p2 / slope), np.sqrt(p2)


def contact_radius(points):
    """Return where the pressure ends: r^2 as a parabola of p^2 over the outer part, at p = 0.

    For pressures that end like Hertz's but have another shape inside.
    """
    top = points.pressure.max()
    used = (points.pressure > 0.12 * top) & (points.pressure < 0.75 * top)
    return np.sqrt(np.polyfit(points.pressure[used] ** 2, points.r2[used], 2)[-1])


def stick_radius(points, mu, least=0.75):
    """Return where the traction reaches mu p: r^2 as a parabola of 1 - t/(mu p), at 0."""
    sticks = (points.status == STICK) & (points.traction > least * mu * points.pressure)
    lack = 1 - points.traction[sticks] / (mu * points.pressure[sticks])
    degree = 2 if sticks.sum() > 8 else 1
    return np.sqrt(np.polyfit(lack, points.r2[sticks], degree)[-1])


def fit_mindlin(points, mu, least=0.1):
    """Fit (mu p - t)^2 where it sticks; return radius and x of the centre of the stick zone.

    In theory that is linear in r^2 up to the stick radius. The zone may lie beside the centre of
    the contact (coarse grid, finite body): what is fitted is linear in r^2 and x.
    """
    lack = mu * points.pressure - points.traction
    sticks = (points.status == STICK) & (lack > least * lack.max())
    terms = np.column_stack([np.ones(sticks.sum()), points.x[sticks], points.r2[sticks]])
    top, tilt, slope = np.linalg.lstsq(terms, lack[sticks] ** 2, rcond=None)[0]
    centre = -tilt / (2 * slope)
    return np.sqrt(-top / slope + centre**2), centre


def share_of_area(points, part=4):
    """Return the radii of circles as large as what sticks and what touches; 1/`part` is meshed."""
    areas = (points.area[points.status == STICK], points.area[points.status != OPEN])
    return tuple(np.sqrt(part * area.sum() / np.pi) for area in areas)
