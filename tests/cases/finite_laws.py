"""The laws of tests at finite strain, with E = 200 and nu = 0.3, and their stresses by hand."""

import numpy as np

E, NU = 200.0, 0.3
SVK = f"*ELASTIC\n{E}, {NU}"
NEO = f"*HYPERELASTIC, NEO HOOKE\n{E / (4 * (1 + NU))!r}, {6 * (1 - 2 * NU) / E!r}"
LAWS = {"St Venant-Kirchhoff": SVK, "neo-Hooke": NEO}


def cauchy_stress(law, stretches):
    """Return the principal Cauchy stresses of principal stretches."""
    a = np.asarray(stretches, dtype=float)
    volume = a.prod()
    shear, bulk = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
    if law is NEO:
        deviator = shear * volume ** (-5 / 3) * (a**2 - (a**2).mean())
        return deviator + bulk * (volume - 1)
    green = (a**2 - 1) / 2
    second = (bulk - 2 * shear / 3) * green.sum() + 2 * shear * green
    return a**2 * second / volume
