"""Finite strain against an independent program, ../shared/reference/finite_strain.

Its elements, laws, contact solver and iterations are its own. Where that folder is absent the whole
file is skipped (status 77). Its name says `shared`, so that the skip is allowed.
"""

import csv
import sys
import unittest

import numpy as np
from program import INPUT, SOURCE, Run
from test_finite_bodies import turned_block

SHARED = SOURCE.parent / "shared" / "reference" / "finite_strain" / "ref"
NEO = "*HYPERELASTIC, NEO HOOKE\n<{E}/(4*(1+{nu}))>, <6*(1-2*{nu})/{E}>"

# A body [-1, 1] x .. x [0, 1], held below, into which a rigid tool is pressed and dragged.
TOOL = """\
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8, NX={nx}, NY={ny}, NZ={n}
-1., {low}, 0.,  2., {width}, 1.
*NODE
90000, 0., 0., 2.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=TOOL, {shape}, REF NODE=90000
0., 0., 2., {numbers}
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
B-ZMAX, TOOL
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP, NLGEOM
*STATIC, DIRECT
1., {steps}.
*BOUNDARY
B-ZMIN, 1, 3
{plane}90000, 1, 2
90000, 3, 3, -{depth}
*END STEP
*STEP
*STATIC, DIRECT
1., {steps}.
*BOUNDARY
90000, 1, 1, {side}
*END STEP
"""

# A block dragged over another one.
PAIR = """\
*BLOCK, NAME=A, ELSET=A, TYPE=C3D8, NX=2, NY=2, NZ=2
0.25, 0.25, 1.,  1., 1., 1.
*BLOCK, NAME=L, ELSET=L, TYPE=C3D8, NX=4, NY=3, NZ=3
0., 0., 0.,  2., 1.5, 1.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=L, MATERIAL=M
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
A-ZMIN, L-ZMAX
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP, NLGEOM
*STATIC, DIRECT
1., 6.
*BOUNDARY
L-ZMIN, 1, 3
A-ZMAX, 1, 2
A-ZMAX, 3, 3, -0.2
*END STEP
*STEP
*STATIC, DIRECT
1., 10.
*BOUNDARY
A-ZMAX, 1, 1, 0.25
*END STEP
"""


def paper(law=None, down=0.1, side=0.4, theta=60.0, steps=(10, 40), **parameters):
    """Run the deck of the paper's block with another law and path."""
    text = (INPUT / "block.inp").read_text().replace("*STEP\n", "*STEP, NLGEOM\n", 1)
    for old, new in (
        ("*ELASTIC\n210000., <nu>", law or "*ELASTIC\n210000., <nu>"),
        ("3, 3, -0.1", f"3, 3, -{down}"),
        ("<0.4*cos", f"<{side}*cos"), ("<0.4*sin", f"<{side}*sin"),
        ("<5/steps>, 1.0", f"1., {steps[0]}."), ("<1.25/steps>, 1.0", f"1., {steps[1]}."),
        ("steps = 50\n", ""),
    ):
        assert old in text, old
        text = text.replace(old, new)
    return Run(text, name="block", **parameters, theta=theta)


def soft(**parameters):
    """Run the block of neo-Hooke, pressed by 30 % and dragged by half of its edge."""
    law = NEO.format(E="1", nu="nu")
    return paper(law, down=0.3, side=0.5, theta=30.0, steps=(12, 20), nu=0.45, **parameters)


@unittest.skipUnless(SHARED.is_dir(), "no ../shared")
class Independent(unittest.TestCase):
    """Resultants and strain energies of whole histories, to 1e-9 of the largest resultant.

    Those of soft_n4_C3D8I are not there, but the resultant at the end.
    """

    def check(self, name, run, column=4):
        """Hold a run against a history, whose energy is in a column."""
        self.assertEqual(run.status, 0, run.errors)
        with open(SHARED / f"{name}.csv", newline="", encoding="utf-8") as file:
            rows = [row for row in csv.reader(file) if not row[0].startswith("#")]
        wanted = np.array(rows[1:], dtype=float)
        with run.result() as result:
            extra = result.history("extra") != 0
            found = result.pairs[0].resultant[~extra]
            energy = result.history("energy/strain")[~extra]
        forces = wanted[:, 1:4]
        np.testing.assert_allclose(found, forces, rtol=0, atol=1e-9 * np.abs(forces).max())
        np.testing.assert_allclose(energy, wanted[:, column], rtol=1e-8)

    def test_paper_block(self):
        for n in (1, 2, 4):
            with self.subTest(law="St Venant-Kirchhoff", n=n):
                self.check(f"block_svk_n{n}", paper(n=n))
        for n in (1, 2):
            with self.subTest(law="neo-Hooke", n=n):
                self.check(f"block_neo_n{n}", paper(NEO.format(E="210000", nu="nu"), n=n))

    def test_rubber_and_foam(self):
        for name, law in (
            ("mooney", "*HYPERELASTIC, MOONEY-RIVLIN\n0.1, 0.08, 0.1"),
            ("blatzko", "*HYPERFOAM, N=1\n0.4, -2., 0.25"),
        ):
            with self.subTest(law=name):
                run = paper(law, down=0.2, side=0.3, steps=(10, 15), n=2)
                self.check(f"block_{name}_n2", run)

    def test_soft_block(self):
        """Pressed by 30 % and dragged by half of its edge; its true tangent is not positive."""
        for n in (2, 4):
            with self.subTest(n=n):
                self.check(f"soft_n{n}_C3D8", soft(n=n))

    def test_kinds(self):
        """The block and the soft one with the mean dilatation, and with transposed modes."""
        neo = NEO.format(E="210000", nu="nu")
        for kind in ("C3D8B", "C3D8I"):
            for name, law in (("svk", None), ("neo", neo)):
                with self.subTest(law=name, kind=kind):
                    self.check(f"block_{name}_n2_{kind}", paper(law, n=2, element=kind))
            with self.subTest(kind=kind, law="soft"):
                run = soft(n=2, element=kind)
                self.check(f"soft_n2_{kind}", run)
        self.check("soft_n4_C3D8B", soft(n=4, element="C3D8B"))
        with soft(n=4, element="C3D8I").result() as result:
            end = result.pairs[0].resultant[-1]
        np.testing.assert_allclose(end, [-0.078258, -0.045915, 0.499090], rtol=0, atol=6e-7)

    def test_ball(self):
        text = TOOL.format(
            nx=4, ny=4, n=2, low=-1.0, width=2.0, law=NEO.format(E="1", nu="0.4"),
            shape="TYPE=SPHERE", numbers="1.", plane="", depth=0.25, side=0.3, steps=10,
        )
        self.check("ball_n2", Run(text, name="ball"))

    def test_cylinder(self):
        text = TOOL.format(
            nx=6, ny=1, n=3, low=0.0, width=0.5, law=NEO.format(E="1", nu="0.4"),
            shape="TYPE=CYLINDER", numbers="0., 1., 0., 1.", plane="B, 2, 2\n", depth=0.2, side=0.2,
            steps=8,
        )
        self.check("cylinder_n3", Run(text, name="cylinder"))

    def test_a_block_that_turns_with_its_floor(self):
        self.check("turned_block", turned_block("plane", law="*ELASTIC\n1., 0.3"), column=7)

    def test_a_block_on_a_block(self):
        text = PAIR.format(law=NEO.format(E="1", nu="0.3"))
        self.check("pair_2_3", Run(text, name="pair"))

    def test_ironing(self):
        text = (INPUT / "ironing.inp").read_text().replace("*STATIC", "*STATIC, DIRECT")
        self.check("ironing_4_9", Run(text, name="ironing", tolerance=1e-10))


if __name__ == "__main__":
    if not SHARED.is_dir():
        sys.exit(77)
    unittest.main()
