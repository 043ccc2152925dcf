"""Least squares over what must not be negative."""

import numpy as np


def least_squares_in_cone(columns, right, limit=4000):
    """min |columns y - right| over y >= 0 (Lawson and Hanson); (y, size of what is left)."""
    n = columns.shape[1]
    y = np.zeros(n)
    passive = np.zeros(n, dtype=bool)
    left = right.copy()
    for _ in range(limit):
        slope = columns.T @ left
        slope[passive] = -np.inf
        at = int(np.argmax(slope))
        if slope[at] <= 1e-13 * np.linalg.norm(right):
            break
        passive[at] = True
        while True:
            found = np.zeros(n)
            found[passive] = np.linalg.lstsq(columns[:, passive], right, rcond=None)[0]
            bad = passive & (found <= 0)
            if not bad.any():
                break
            # A column that comes in with nothing goes again at once.
            share = (y[bad] / np.maximum(y[bad] - found[bad], np.finfo(float).tiny)).min()
            y = y + share * (found - y)
            passive &= y > 1e-15 * np.abs(y).max(initial=0)
            y[~passive] = 0
            if not passive.any():
                break
        y = found
        new = right - columns @ y
        if np.linalg.norm(new) >= np.linalg.norm(left) * (1 - 1e-15):
            left = new
            break
        left = new
    return y, float(np.linalg.norm(left))
