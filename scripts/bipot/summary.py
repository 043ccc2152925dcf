"""What comes of the contact pairs: forces, largest pressures and slips, and their errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bipot.pairs import Pair
    from bipot.result import Result

Array = NDArray[Any]

MOST, WHERE_UNKNOWN = 6, 3  # digits
OF_ROUNDING = 1e-9  # friction of a frictionless pair is no more than this, of its force
HEAD = (
    "step", "pair", "normal force (x, y, z)", "error", "friction (x, y, z)", "error",
    "largest pressure", "error", "largest slip", "error",
    "sum of normal forces", "moment (x, y, z)",
)
UNKNOWN = "-"


class Summary(list[dict[str, Any]]):
    """The rows of a summary as dictionaries; printed, they are a table in known digits."""

    def __repr__(self) -> str:
        cells = [HEAD, *(row_in_words(row) for row in self)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        return "\n".join(
            "  ".join(
                text.ljust(width) if k == 1 else text.rjust(width)
                for k, (text, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in cells
        )


def summarize(result: Result) -> Summary:
    """Return a row for each pair at the end of each step."""
    pairs = list(result.pairs.values())
    rows = Summary()
    total = np.full(result.finished, -1.0)
    if "error/total" in result.history_names and not result.error_of_energy:
        total = result.history("error/total")
    by_runs = [errors_by_runs(result, pair) for pair in pairs]
    for row in map(int, result.step_ends):
        step, increment, time = (
            result.history(name)[row].item() for name in ("step", "increment", "time")
        )
        of_forces = math.nan
        if total[row] >= 0 and pairs:
            of_forces = float(total[row] * max(
                np.linalg.norm(pair.normal_force[row] + pair.friction_force[row]) for pair in pairs
            ))
        for pair, errors in zip(pairs, by_runs, strict=True):
            rows.append({
                "step": step, "increment": increment, "time": time, "pair": pair.name,
                **vector("normal_force", pair.normal_force[row]),
                "normal_force_error": errors.get("normal_force_x", of_forces),
                **vector("friction_force", pair.friction_force[row]),
                "friction_force_error": errors.get("friction_force_x", of_forces),
                "largest_pressure": float(pair.largest_pressure[row]),
                "largest_pressure_error": errors.get("largest_pressure", math.nan),
                "largest_slip": float(pair.largest_slip[row]),
                "largest_slip_error": errors.get("largest_slip", math.nan),
                "normal_sum": float(pair.normal_sum[row]),
                **vector("moment", pair.moment_about_middle[row]),
                "extent": float(np.abs(pair.coordinates - pair.middle).max(initial=0)),
            })
    return rows


def errors_by_runs(result: Result, pair: Pair) -> dict[str, float]:
    """Return what several runs say of the pair's numbers, as far as they do: errors by name.

    All that is compared has the error of the worst, as the run says it.
    """
    runs = result.accuracy
    if runs is None:
        return {}
    compared = runs.error >= 0
    rubs = any(each.friction_coefficient > 0 for each in result.pairs.values())
    if not compared.any() or runs.mesh < 0 or (rubs and runs.load_steps < 0):
        return {}
    # What is said of extrapolated values is not said of the result.
    if runs.of_extrapolated:
        return {}
    total = runs.mesh_and_load_steps + runs.others
    found = {}
    for name, scale, is_compared in zip(runs.names, runs.scale, compared, strict=True):
        of_pair, _, what = name.rpartition("/")
        if is_compared and of_pair.replace("/", "_") == pair.name:
            found[what] = total * float(scale)
    return found


def vector(name: str, values: Array) -> dict[str, float]:
    """Return components by name."""
    return {f"{name}_{axis}": float(value) for axis, value in zip("xyz", values, strict=True)}


def row_in_words(row: dict[str, Any]) -> list[str]:
    """Return the cells of a row as they are read, below HEAD."""
    cells = [str(row["step"]), row["pair"]]
    friction = math.hypot(*(row[f"friction_force_{axis}"] for axis in "xyz"))
    least = OF_ROUNDING * max(row["normal_sum"], friction)
    for name in ("normal_force", "friction_force"):
        error = row[f"{name}_error"]
        cells += [vector_in_words(row, name, error, least), error_in_words(error)]
    for name in ("largest_pressure", "largest_slip"):
        error = row[f"{name}_error"]
        cells += [number_in_words(row[name], error), error_in_words(error)]
    cells.append(number_in_words(row["normal_sum"], row["normal_force_error"]))
    cells.append(vector_in_words(row, "moment", math.nan, least * row["extent"]))
    return cells


def number_in_words(value: float, error: float) -> str:
    """Return a number to the first digit of its error, but in two digits: less says nothing."""
    return known_digits(value, error if math.isnan(error) else min(error, 0.1 * abs(value)))


def vector_in_words(row: dict[str, Any], name: str, error: float, least: float) -> str:
    """Return components to the first digit of their error, the largest in two digits at least.

    What is below `least` is rounding.
    """
    values = [row[f"{name}_{axis}"] for axis in "xyz"]
    largest = max(map(abs, values))
    rounding = max(least, 0.01 * largest if math.isnan(error) else min(error, 0.1 * largest))
    return "(" + ", ".join(known_digits(value, rounding) for value in values) + ")"


def error_in_words(error: float) -> str:
    """Return an error with two digits."""
    return UNKNOWN if math.isnan(error) else known_digits(error, 0.1 * error)


def power_of_ten(value: float) -> int:
    """Return the place of the first digit of a number of seven: 2 for 123."""
    return int(f"{value:e}".partition("e")[2]) if value else 0


def known_digits(value: float, error: float) -> str:
    """Return a number down to the first digit of its error, in six digits at most.

    0 where all digits are below; three digits where the error is not a number, which means that
    it is not known.
    """
    if not math.isfinite(value):
        return str(value)
    if value == 0:
        return "0"
    power = power_of_ten(value)
    last = power - MOST + 1
    if math.isnan(error):
        last = power - WHERE_UNKNOWN + 1
    elif error > 0:
        last = max(last, power_of_ten(error))
    if power < last:
        return "0"
    text = f"{value:.{power - last}e}"
    mantissa, _, exponent = text.partition("e")
    if -4 <= int(exponent) <= MOST:
        return f"{round(value, -last) + 0.0:.{max(0, -last)}f}"
    return f"{mantissa}e{int(exponent)}"
