"""Fields that follow from others: von Mises' stress, principal values, penetration, loads."""

import os
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from two_bodies import solved

PLACES = (("", "nodes"), ("", "elements"), ("_gauss_points", "elements"))
# A block pressed into another, which its master's nodes enter between the slave's; a plane holds.
DECK = """*BLOCK, NAME=A, NX=2, NY=3, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=B, NX=4, NY=3, NZ=1
0., 0., 1.,  1., 1., 0.5
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
A-ZMIN, FLOOR
*CONTACT PAIR, INTERACTION=I
A-ZMAX, B-ZMIN
*STEP
*STATIC
0.5, 1.
*DSLOAD
B-ZMAX, P, 20.
*CLOAD
9, 1, 0.5
*NODE FILE
U, RF, CF
*EL FILE, POSITION=AVERAGED AT NODES
S, E, MISES, SP, EP
*EL FILE, POSITION=INTEGRATION POINTS
*EL FILE, POSITION=CENTROIDAL
*CONTACT FILE
COPEN
*END STEP
"""


class DerivedFields(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.result = solved(cls(), DECK)

    def tensors(self, name, ending, on, step):
        """Return symmetric matrices, one a place: (n, 3, 3)."""
        flat = self.result.field(name + ending, step, on=on).reshape(-1, 6)
        return flat[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]

    def test_von_mises(self):
        for ending, on in PLACES:
            for step in (0, 1):
                stress = self.tensors("stress", ending, on, step)
                mean = np.trace(stress, axis1=1, axis2=2) / 3
                deviator = stress - mean[:, None, None] * np.eye(3)
                want = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
                found = self.result.field("von_mises" + ending, step, on=on).reshape(-1)
                np.testing.assert_allclose(found, want, rtol=1e-12, atol=1e-12)
                self.assertGreater(found.max(), 5)

    def test_principal_values(self):
        for ending, on in PLACES:
            for name in ("stress", "strain"):
                tensor = self.tensors(name, ending, on, -1)
                found = self.result.field(f"principal_{name}{ending}", -1, on=on).reshape(-1, 3)
                scale = np.abs(tensor).max()
                np.testing.assert_allclose(
                    found, np.linalg.eigvalsh(tensor)[:, ::-1], rtol=0, atol=1e-13 * scale
                )

    def test_penetration(self):
        """At the points of the quadrature the faces overlap where the slave's nodes only touch."""
        found = self.result.field("contact_penetration", -1)
        want = np.zeros_like(found)
        for pair in self.result.pairs:
            group = self.result.file[f"contact/{pair.name}"]
            gap = group["least_gap" if "least_gap" in group else "gap"][-1]
            np.maximum.at(want, group["node"][:], -gap)
        np.testing.assert_array_equal(found, want)
        self.assertGreater(found.max(), 1e-6)

    def test_loads(self):
        for step, part in ((0, 0.5), (1, 1.0)):
            found = self.result.field("applied_force", step)
            np.testing.assert_allclose(
                found.sum(axis=0), [0.5 * part, 0, -20 * part], rtol=0, atol=1e-12
            )
            self.assertEqual(found[8, 0], 0.5 * part)


if __name__ == "__main__":
    os.environ.setdefault("BIPOT_SOURCE", str(Path(__file__).resolve().parents[2]))
    unittest.main()
