"""The solvers of the paper on tetrahedra and elements of second order find the same reactions.

The study of docs/studies/solvers.md on coarser meshes: one block before a plane, and two blocks.
"""

import os
import tempfile
import unittest

from program import PROGRAM

from studies import solver_elements  # found through program


class Solvers(unittest.TestCase):
    def check(self, scene):
        for kind, n in (("C3D4", 2), ("C3D10", 2), ("C3D20R", 2)):
            with self.subTest(kind=kind), tempfile.TemporaryDirectory() as folder:
                for row in solver_elements.compare(PROGRAM, scene, kind, folder, n, 5):
                    self.assertLess(float(row["difference"]), 1e-8, row["solver"])

    def test_one_block(self):
        self.check("one block")

    def test_two_blocks(self):
        self.check("two blocks")


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    unittest.main()
