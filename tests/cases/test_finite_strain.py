"""Runs at finite strain (*STEP, NLGEOM): closed forms, the paper's solvers, refusals."""

import unittest

import numpy as np
from program import INPUT, Run
from scipy.optimize import brentq

E, NU = 200.0, 0.3
SVK = f"*ELASTIC\n{E}, {NU}"
NEO = f"*HYPERELASTIC, NEO HOOKE\n{E / (4 * (1 + NU))!r}, {6 * (1 - 2 * NU) / E!r}"

# A bar [0, 3] x [0, 1] x [0, 2] on symmetry planes, pressed along z by a smooth plane.
BAR = """\
*BLOCK, NAME=B, NX=2, NY=1, NZ=2, TYPE=C3D8
0., 0., 0., 3., 1., 2.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
900, 0., 0., 2.
*OBSTACLE, NAME=PRESS, TYPE=PLANE, REF NODE=900
0., 0., 2., 0., 0., -1.
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=SMOOTH
B-ZMAX, PRESS
*STEP, NLGEOM
*STATIC
{increment}, 1.
*EL FILE
S, E
*BOUNDARY
B-XMIN, 1, 1
B-YMIN, 2, 2
{sides}B-ZMIN, 3, 3
900, 1, 3
900, 3, 3, {press}
*END STEP
"""


def bar(law, stretch, confined=False, increment=0.1):
    """Return the force of the press, the logarithmic strains and the stress along z."""
    sides = "B-XMAX, 1, 1\nB-YMAX, 2, 2\n" if confined else ""
    text = BAR.format(law=law, press=2 * (stretch - 1), sides=sides, increment=increment)
    run = Run(text, name="bar")
    assert run.status == 0, run.errors
    with run.result() as result:
        force = result.pairs["B-ZMAX:PRESS"].resultant[-1]
        strain = result.field("strain", -1)
        stress = result.field("stress", -1)
    return force, strain, stress


class ClosedForms(unittest.TestCase):
    """Uniform stretches, whose forces are known. The tolerance of contact is 1e-8 and better."""

    def test_st_venant_kirchhoff(self):
        for stretch in (0.9, 0.75, 0.65):
            force, strain, stress = bar(SVK, stretch)
            expected = E * stretch * (stretch**2 - 1) / 2
            np.testing.assert_allclose(force, [0, 0, 3 * expected], rtol=0, atol=1e-5)
            across = np.sqrt(1 - NU * (stretch**2 - 1))
            np.testing.assert_allclose(strain[:, 2], np.log(stretch), rtol=1e-6)
            np.testing.assert_allclose(strain[:, 0], np.log(across), rtol=1e-6)
            np.testing.assert_allclose(
                stress[:, 2], expected / across**2, rtol=1e-6
            )

    def test_neo_hooke(self):
        c, d = E / (4 * (1 + NU)), 6 * (1 - 2 * NU) / E

        def stresses(along, across):
            """First Piola-Kirchhoff stress along and across."""
            volume = along * across**2
            squares = along**2 + 2 * across**2
            pressure = 2 / d * (volume - 1) * volume

            def one(stretch):
                shear = 2 * c * volume ** (-2 / 3) * (stretch**2 - squares / 3)
                return (shear + pressure) / stretch

            return one(along), one(across)

        for stretch in (0.9, 0.6, 0.4):
            across = brentq(lambda a, s=stretch: stresses(s, a)[1], 0.8, 2.0, xtol=1e-15)
            force, _, stress = bar(NEO, stretch, increment=0.05)
            expected = stresses(stretch, across)[0]
            np.testing.assert_allclose(force, [0, 0, 3 * expected], rtol=0, atol=1e-5)
            np.testing.assert_allclose(stress[:, 2], expected / across**2, rtol=1e-6)
            force = bar(NEO, stretch, confined=True, increment=0.05)[0]
            np.testing.assert_allclose(force[2], 3 * stresses_confined(c, d, stretch), rtol=1e-7)

    def test_a_bar_that_may_slide(self):
        """Along an axis that nothing holds a bar stays where it is, and has the same forces."""
        text = BAR.format(law=SVK, press=-0.2, sides="", increment=0.1)
        run = Run(text.replace("B-XMIN, 1, 1\n", ""), name="bar")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            force = result.pairs["B-ZMAX:PRESS"].resultant[-1]
        np.testing.assert_allclose(force, [0, 0, 3 * E * 0.9 * (0.81 - 1) / 2], rtol=0, atol=1e-5)

    def test_small_strains_are_linear(self):
        """Of strains of 1e-6 the force is that of linear theory to the square of the strain."""
        force = bar(NEO, 1 - 1e-6)[0]
        self.assertAlmostEqual(force[2] / (-3 * E * 1e-6), 1, delta=3e-6)


def stresses_confined(c, d, stretch):
    """First Piola-Kirchhoff stress along a stretch without another."""
    squares = stretch**2 + 2
    along = 2 * c * stretch ** (-2 / 3) * (stretch**2 - squares / 3)
    return (along + 2 / d * (stretch - 1) * stretch) / stretch


def block(law=None, **parameters):
    """Run the paper's block at finite strain, of two elements an edge unless said otherwise."""
    text = (INPUT / "block.inp").read_text().replace("*STEP\n", "*STEP, NLGEOM\n", 1)
    if law:
        text = text.replace("*ELASTIC\n210000., <nu>", law)
    return Run(text, name="block", **{"n": 2, **parameters})


class Block(unittest.TestCase):
    """The paper's example."""

    def test_all_solvers_of_the_paper_agree(self):
        """Both formulations, Uzawa and Newton at the points, sweeps and global Newton: to 1e-8."""
        solvers = [
            ("SWEEPS", formulation, local)
            for formulation in ("BIPOTENTIAL", "PSEUDOPOTENTIAL")
            for local in ("NEWTON", "NEWTON6", "UZAWA")
        ]
        solvers += [("SWEEPS", "BIPOTENTIAL", "EXACT"), ("GLOBAL NEWTON", "BIPOTENTIAL", "AUTO")]
        found = []
        for solver, formulation, local in solvers:
            run = block(solver=solver, formulation=formulation, local=local, steps=20)
            self.assertEqual(run.status, 0, (solver, formulation, local, run.errors))
            with run.result() as result:
                found.append(result.pairs["BODY-ZMIN:GROUND"].resultant)
        for other in found[1:]:
            np.testing.assert_allclose(other, found[0], rtol=0, atol=1e-8 * np.abs(found[0]).max())

    def test_energy_is_balanced_to_the_increment(self):
        """What is left of the work halves with the increment."""
        left = []
        for steps in (20, 40):
            with block(steps=steps).result() as result:
                energy = result.history("energy/balance")[-1]
                left.append(abs(energy) / result.history("energy/external_work")[-1])
        self.assertLess(left[0], 0.01)
        self.assertLess(left[1], 0.7 * left[0])

    def test_a_turned_scene_gives_turned_forces(self):
        with block(theta=60, steps=20).result() as result:
            one = result.pairs["BODY-ZMIN:GROUND"].resultant[-1]
        with block(theta=30, steps=20).result() as result:
            other = result.pairs["BODY-ZMIN:GROUND"].resultant[-1]
        np.testing.assert_allclose(other[[1, 0, 2]], one, rtol=1e-8)


class Ends(unittest.TestCase):
    """What ends a run."""

    def test_a_block_that_is_pressed_through_itself(self):
        """Pressed beyond its height in one increment: the law fails, an element would turn inside
        out, or forces do not come to balance; the run says so and ends with 2."""
        for law, why in ((SVK, "ellipticity"), (NEO, "inside out|balance")):
            run = Run(BAR.format(law=law, press=-2.2, sides="", increment=1.0), name="bar")
            self.assertEqual(run.status, 2, run.output)
            self.assertRegex(run.errors, why)

    def test_an_element_that_is_nearly_inside_out(self):
        """With a middle at 0.2505 of an edge the Jacobian is 0.002 at one end, 1.998 at the other:
        a strain of 0.01 turns the corner over, and the message says that the shape is why."""
        deck = """
*NODE
1, 0., 0., 0.
2, 1., 0., 0.
3, 0., 1., 0.
4, 0., 0., 1.
5, 0.2505, 0., 0.
6, 0.5, 0.5, 0.
7, 0., 0.5, 0.
8, 0., 0., 0.5
9, 0.5, 0., 0.5
10, 0., 0.5, 0.5
*ELEMENT, TYPE=C3D10, ELSET=BODY
1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
*NSET, NSET=STAY
1, 3, 4, 5
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=M
*BOUNDARY
STAY, 1, 3
2, 2, 3
*STEP, NLGEOM
*STATIC, DIRECT
1., 1.
*BOUNDARY
2, 1, 1, 0.01
*END STEP
"""
        run = Run(deck, name="bent")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("element 1 turns inside out", run.errors)
        self.assertIn("its Jacobian falls to 0.001 of its largest", run.errors)


if __name__ == "__main__":
    unittest.main()
