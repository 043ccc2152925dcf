"""Cards that turn nodes about z by amplitudes of their own: a *BOUNDARY cannot say a rotation."""

import numpy as np
from program import Run


def rotation(angle):
    """Return the matrix of a rotation about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def turn_cards(ids, points, places, angle, increments):
    """Return amplitudes, and what a step's *BOUNDARY says of nodes that turn by `angle` about z.

    They begin at `places`, and were at `points` undeformed; the step has a period of 1.
    """
    amplitudes, boundary = "", ""
    times = np.linspace(0.0, 1.0, increments + 1)
    for number, x, place in zip(ids, points, places, strict=True):
        way = np.array([rotation(angle * t) @ place - x for t in times])
        for i in range(3):
            name = f"T{number}-{i + 1}"
            table = np.column_stack((times, way[:, i])).tolist()
            lines = [f"{time!r}, {u!r}" for time, u in table]
            amplitudes += f"*AMPLITUDE, NAME={name}\n" + "\n".join(lines) + "\n"
            boundary += f"*BOUNDARY, AMPLITUDE={name}\n{number}, {i + 1}, {i + 1}, 1.\n"
    return amplitudes, boundary


def check_turn(case, mesh, first_step, angle=np.pi / 2, increments=30):
    """Turn what the end of a first step has deformed by the nodes that it prescribes.

    Places must be those of the first step, turned, and so must be the energy and the forces.
    """
    run = Run(mesh + first_step, name="first")
    case.assertEqual(run.status, 0, run.errors)
    with run.result() as result:
        x, ids = result.points, result.node_ids
        places = x + result.field("displacement", -1)
        force = result.field("reaction_force", -1)
        energy = result.history("energy/strain")[-1]
    # Where nothing is held rounding leaves less; along some axes a held node may carry nothing.
    held = np.abs(force).max(axis=1) > 1e-6 * np.abs(force).max()
    case.assertTrue(held.any())
    amplitudes, boundary = turn_cards(ids[held], x[held], places[held], angle, increments)
    text = mesh + amplitudes + first_step + f"*STEP\n*STATIC\n{1 / increments!r}, 1.\n" + boundary
    run = Run(text + "*END STEP\n", name="second")
    case.assertEqual(run.status, 0, run.errors)
    with run.result() as result:
        turn = rotation(angle)
        size = np.abs(places).max()
        np.testing.assert_allclose(
            x + result.field("displacement", -1), places @ turn.T, atol=1e-7 * size
        )
        np.testing.assert_allclose(
            result.field("reaction_force", -1), force @ turn.T, atol=1e-6 * np.abs(force).max()
        )
        case.assertAlmostEqual(result.history("energy/strain")[-1] / energy, 1, delta=1e-6)
        return result.counters
