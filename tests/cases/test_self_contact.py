"""A surface that touches itself: as its two parts with names of their own."""

import unittest

import numpy as np
from program import Run

N = 6  # elements along each arm


def clip(pair, kind="C3D8", step="*STEP"):
    """Return the deck of a C of one layer of elements, 0.06 apart, whose upper arm is pressed down.

    INNER is the inside of both arms, LOW and UP its two parts, ALL all outer faces.
    """
    size = 8 if kind == "C3D8" else 4
    height = [0.0, 0.5, 0.56, 1.06]
    layers = 2 if size == 8 else 1
    ids, nodes, elements = {}, "", ""

    def node(i, j, k):
        if (i, j, k) not in ids:
            ids[i, j, k] = len(ids) + 1
            place = [0.5 * i, height[j], 0.5 * k][:2 if size == 4 else 3]
            nonlocal nodes
            nodes += f"{ids[i, j, k]}, " + ", ".join(map(str, place)) + "\n"
        return ids[i, j, k]

    cells = [(i, j) for j in (0, 2) for i in range(N)] + [(0, 1)]
    for e, (i, j) in enumerate(cells, 1):
        corners = [node(a, b, k) for k in range(layers)
                   for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
        elements += f"{e}, " + ", ".join(map(str, corners)) + "\n"
    # Faces towards the slot: of the cell (0, 1) the right one.
    up, right, down = ("S5", "S4", "S3") if size == 8 else ("S3", "S2", "S1")
    low = "".join(f"{e}, {up}\n" for e in range(2, N + 1))
    high = "".join(f"{e}, {down}\n" for e in range(N + 2, 2 * N + 1))
    held = [ids[i, 0, k] for i in range(N + 1) for k in range(layers)]
    tip = [ids[N, 3, k] for k in range(layers)]
    across = "" if size == 4 else "*NSET, NSET=EVERY, GENERATE\n1, " + str(len(ids)) + "\n"
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=B\n{elements}{across}"
        f"*SURFACE, NAME=LOW\n{low}*SURFACE, NAME=UP\n{high}"
        f"*SURFACE, NAME=INNER\n{low}{high}{2 * N + 1}, {right}\n"
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=B, MATERIAL=M\n"
        "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.2\n"
        f"*CONTACT PAIR, INTERACTION=I\n{pair}\n"
        f"{step}\n*STATIC\n0.5, 1.\n*BOUNDARY\n"
        + "".join(f"{n}, 1, 2\n" for n in held) + "".join(f"{n}, 2, 2, -0.12\n" for n in tip)
        + ("" if size == 4 else "EVERY, 3, 3\n") + "*END STEP\n"
    )


class Self(unittest.TestCase):
    def solve(self, deck):
        run = Run(deck, name="deck")
        self.assertEqual(run.status, 0, run.errors + run.output)
        result = run.result()
        self.addCleanup(result.close)
        self.assertTrue(result.history("certified").all())
        return result, run

    def test_is_its_parts_by_name(self):
        """To 1e-8, at small and finite strain, of solids and of plane strain."""
        for kind in ("C3D8", "CPE4"):
            for step in ("*STEP", "*STEP, NLGEOM"):
                with self.subTest(kind=kind, step=step):
                    named, _ = self.solve(clip("LOW, UP", kind, step))
                    force = np.abs(named.pairs["LOW:UP"].normal_force[-1])
                    self.assertGreater(force.max(), 0.1)
                    for pair, name in (("INNER, INNER", "INNER:INNER"), ("INNER", "INNER:INNER")):
                        itself, run = self.solve(clip(pair, kind, step))
                        self.assertIn("contact of INNER with itself: ", run.output)
                        self.assertEqual(list(itself.pairs), [name])
                        u, v = (of.field("displacement") for of in (itself, named))
                        self.assertLess(abs(u - v).max(), 1e-8 * abs(v).max())

    def test_what_does_not_see_itself_is_a_mistake(self):
        run = Run(clip("LOW, LOW"), "--check", name="deck")
        self.assertEqual(run.status, 1)
        self.assertIn("no face of 'LOW' sees another in the mesh", run.errors)


if __name__ == "__main__":
    unittest.main()
