"""Errors by mesh and load steps at finite strain, and accuracies that are asked for."""

import unittest

import numpy as np
from program import INPUT, Run

# Cook's panel between walls, neo-Hookean, its right side drawn up by a quarter of its height.
COOK = """\
*PARAMETER
element = C3D8I
up = 10.
*NODE, NSET=ALL
1, 0., 0., 0.
2, 48., 44., 0.
3, 48., 60., 0.
4, 0., 44., 0.
5, 0., 0., 1.
6, 48., 44., 1.
7, 48., 60., 1.
8, 0., 44., 1.
*ELEMENT, TYPE=<element>, ELSET=B
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=LEFT
1, 4, 5, 8
*NSET, NSET=RIGHT
2, 3, 6, 7
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
<240.565/5.2>, <2.4/240.565>
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.25, 1.
*EL FILE
ERR
*BOUNDARY
ALL, 3, 3
LEFT, 1, 2
RIGHT, 2, 2, <up>
*END STEP
"""


def errors(run, row=-1):
    """Return the errors by mesh and load steps, and the strain energy, at the end of a row."""
    assert run.status == 0, run.errors
    with run.result() as result:
        names = ("error/mesh", "error/load_steps", "energy/strain")
        return [float(result.history(name)[row]) for name in names]


class ByTheMesh(unittest.TestCase):
    """The energy of the recovered stresses, docs/theory.md (10.25)."""

    # Strain energy of meshes divided two, three and four times, of C3D8I and of C3D8 alike, by
    # Richardson's extrapolation.
    ENERGY = 618.6

    def test_error_of_the_energy_is_told(self):
        for element, divided in (("C3D8I", "2"), ("C3D8I", "3"), ("C3D8", "3")):
            run = Run(COOK, "--refine", divided, name="cook", element=element)
            told, _, energy = errors(run)
            true = energy / self.ENERGY - 1
            self.assertLess(told, 1.3 * true)
            self.assertGreater(told, 0.6 * true)

    def test_field_of_elements_sums_to_the_error(self):
        run = Run(COOK, "--refine", "2", name="cook")
        told, _, energy = errors(run)
        with run.result() as result:
            of_elements = result.field("mesh_error", -1)
        np.testing.assert_allclose(of_elements.sum(), told * 2 * energy, rtol=1e-10)

    def test_small_strain_is_as_without(self):
        for element in ("C3D8", "C3D8I", "C3D8B"):
            told = [
                errors(Run(COOK, "--refine", "2", *options, name="cook", element=element, up=1e-6))
                for options in ((), ("--nlgeom", "no"))
            ]
            np.testing.assert_allclose(told[0], told[1], rtol=1e-5)


if __name__ == "__main__":
    unittest.main()
