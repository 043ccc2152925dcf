"""Loads at finite strain: pressures that follow their surfaces, and bodies that become warmer."""

import unittest

import numpy as np
from finite_laws import LAWS, NEO, E, cauchy_stress
from program import INPUT, Run
from scipy.optimize import brentq
from turned_grips import check_turn

from studies.deck_cards import quarter_ring

# A box [0, 3] x [0, 1] x [0, 2] on symmetry planes.
BOX = """\
*BLOCK, NAME=B, NX=3, NY=2, NZ=2, TYPE=C3D8
0., 0., 0.,  3., 1., 2.
*NSET, NSET=ALL
B
*MATERIAL, NAME=M
{law}
*EXPANSION
0.01
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
{increment}, 1., , {increment}
*NODE FILE
U, RF
*EL FILE, POSITION=INTEGRATION POINTS
S, E
*BOUNDARY
B-XMIN, 1, 1
B-YMIN, 2, 2
B-ZMIN, 3, 3
{loads}*END STEP
"""

# A quarter of a ring on symmetry planes that becomes warmer.
HEATED = """\
*NSET, NSET=LOW, GENERATE
1, 12
*MATERIAL, NAME=M
{law}
*EXPANSION
0.01
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.25, 1.
*NODE FILE
U
*EL FILE, POSITION=INTEGRATION POINTS
S, E
*BOUNDARY
B-X, 1, 1
B-Y, 2, 2
LOW, 3, 3
*TEMPERATURE
B-ALL, 40.
*END STEP
"""

# A beam [0, 10] x [0, 1] x [0, 1], held at one end, of Young's modulus 1000 and no Poisson's ratio.
BEAM = """\
*BLOCK, NAME=B, NX=10, NY=1, NZ=1, TYPE=C3D8
0., 0., 0.,  10., 1., 1.
*NSET, NSET=ENDS
{ends}
*NSET, NSET=INNER
{inner}
*NSET, NSET=TIP
11, 22, 33, 44
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.125, 1.
*NODE FILE
U
*BOUNDARY
B-XMIN, 1, 3
{load}*END STEP
"""

# The nodes of its upper side, those of a corner and of an edge.
ENDS = "23, 33, 34, 44"
INNER = ", ".join(str(n) for n in range(24, 44) if n not in (33, 34))
FOLLOWING = [-0.9322, 0, -3.9136]


def solved(case, text, **parameters):
    """Run a deck that must be certified, and open its result."""
    run = Run(text, name="case", **parameters)
    case.assertEqual(run.status, 0, run.errors)
    result = run.result()
    case.addCleanup(result.close)
    return result


def gauss(result, name, step=-1):
    """Return a tensor at the Gauss points: (E, 8, 6)."""
    return result.field(name, step, on="gauss points")


class Pressure(unittest.TestCase):
    """Pressures act on the surface where it is, along its normal there."""

    def test_all_around(self):
        """Under pressure on all sides the stress is the pressure, whatever the law."""
        sides = "*DSLOAD\nB-XMAX, P, 60.\nB-ZMAX, P, 60.\n*DLOAD\nB-YMAX-ELEMENTS, P5, 60.\n"
        text = BOX.replace("*MATERIAL", "*ELSET, ELSET=B-YMAX-ELEMENTS, GENERATE\n4, 6\n10, 12\n"
                           "*MATERIAL", 1)
        for name, law in LAWS.items():
            with self.subTest(law=name):
                result = solved(self, text.format(law=law, increment=0.25, loads=sides))
                wanted = np.broadcast_to([-60.0, -60, -60, 0, 0, 0], (12, 8, 6))
                np.testing.assert_allclose(gauss(result, "stress"), wanted, rtol=0, atol=1e-6)
                stretch = brentq(lambda a, law=law: cauchy_stress(law, [a] * 3)[0] + 60, 0.6, 1)
                u = result.field("displacement", -1)
                np.testing.assert_allclose(u, (stretch - 1) * result.points, rtol=0, atol=1e-8)

    def test_force_on_a_cap_is_that_on_its_rim(self):
        """A plate that is clamped at its sides bulges under pressure: its supports carry pressure
        times the area within its rim, though the surface has grown."""
        text = BOX.replace("B-XMIN, 1, 1\nB-YMIN, 2, 2\nB-ZMIN, 3, 3\n", "".join(
            f"B-{side}, 1, 3\n" for side in ("XMIN", "XMAX", "YMIN", "YMAX")))
        text = text.replace("NX=3, NY=2, NZ=2", "NX=6, NY=4, NZ=1").replace("1., 2.\n", "1., 0.1\n")
        text = text.format(law=NEO, increment=0.25, loads="*DSLOAD\nB-ZMIN, P, 20.\n")
        result = solved(self, text)
        self.assertGreater(np.abs(result.field("displacement", -1)).max(), 0.1)
        sides = [result.node_sets[f"B-{s}"] for s in ("XMIN", "XMAX", "YMIN", "YMAX")]
        nodes = np.unique(np.concatenate(sides))
        force = result.field("reaction_force", -1)[nodes].sum(axis=0)
        np.testing.assert_allclose(force, [0, 0, -20.0 * 3], rtol=0, atol=1e-6)

    def test_it_turns_with_the_body(self):
        """A bar between grips under pressures, turned by 90 degrees, is what it was, turned."""
        mesh = BOX[: BOX.index("*STEP")].format(law=NEO)
        mesh = mesh.replace("0., 0., 0.,  3.", "-1., -1., 0.,  3.")
        loads = "*DSLOAD\nB-YMAX, P, 30.\nB-ZMAX, P, 10.\n"
        pull = BOX[BOX.index("*STEP") :].format(increment=0.5, loads=loads)
        grips = "B-XMIN, 2, 3\nB-XMAX, 2, 3\nB-XMAX, 1, 1, 0.3\n"
        pull = pull.replace("B-YMIN, 2, 2\nB-ZMIN, 3, 3\n", grips)
        check_turn(self, mesh, pull)

    def test_cantilever(self):
        """Under a pressure that follows and one that does not (nodal forces), by an independent
        program with the same elements (../shared/reference/finite_strain/t_load.py)."""
        # q L^3/(E I): the tip's displacement, and under the dead load.
        for ratio, follows, dead in (
            (1.2, [-0.0589, 0, -1.0098], [-0.0592, 0, -1.0177]),
            (4.8, FOLLOWING, [-0.8677, 0, -3.8049]),
        ):
            pressure = ratio * 1000 / 12 / 1000
            for load, wanted in (
                (f"*DSLOAD\nB-ZMAX, P, {pressure!r}\n", follows),
                (f"*CLOAD\nINNER, 3, {-pressure / 2!r}\nENDS, 3, {-pressure / 4!r}\n", dead),
            ):
                with self.subTest(ratio=ratio, load=load.split("\n", maxsplit=1)[0]):
                    result = solved(self, BEAM.format(load=load, ends=ENDS, inner=INNER))
                    u = result.field("displacement", -1)
                    tip = u[np.isclose(result.points[:, 0], 10)].mean(axis=0)
                    np.testing.assert_allclose(tip, wanted, rtol=0, atol=1e-4)

    def test_as_calculix_has_it(self):
        """The corner of a short cantilever, from CalculiX 2.20 (NLGEOM, C3D8, to 1e-8)."""
        for name, top, side, wanted in (
            ("St Venant-Kirchhoff", 4.0, 0.0, [0.06333165, 0.00180089, -0.5543401]),
            ("neo-Hooke", 4.0, 0.0, [0.08375003, 0.00174588, -0.5412873]),
            ("neo-Hooke", 0.0, -20.0, [-1.631066, 1.344657, -0.009709368]),
            ("neo-Hooke", -4.0, 6.0, [-0.1224228, -0.7862704, 0.4893727]),
        ):
            loads = f"*DSLOAD\nB-ZMAX, P, {top}\nB-YMAX, P, {side}\n"
            with self.subTest(law=name, top=top, side=side):
                u = self.cantilever(LAWS[name], loads)
                np.testing.assert_allclose(u, wanted, rtol=0, atol=2e-4 * np.abs(wanted).max())

    def cantilever(self, law, loads, more=""):
        """Return the displacement of the far corner of a short cantilever."""
        text = BOX.replace("B-YMIN, 2, 2\nB-ZMIN, 3, 3\n", "").replace("XMIN, 1, 1", "XMIN, 1, 3")
        text = text.replace("NX=3", "NX=4").replace("3., 1., 2.", "2., 1., 1.")
        result = solved(self, text.format(law=law, increment=0.1, loads=loads) + more)
        return result.field("displacement", -1)[result.nearest_node((2.0, 1.0, 1.0))]

    def test_what_comes_and_goes(self):
        """Without contact the way does not count: pressures of earlier steps that are taken away,
        or go with an amplitude, leave nothing."""
        once = self.cantilever(NEO, "*DSLOAD\nB-YMAX, P, 6.\n")
        step = "*STEP\n*STATIC\n0.25, 1.\n"
        back = "*AMPLITUDE, NAME=BACK\n0., 1., 1., 0.\n" + step + "*DSLOAD, AMPLITUDE=BACK\n"
        for more in (
            step + "*DSLOAD, OP=NEW\nB-YMAX, P, 6.\n*END STEP\n",
            back + "B-ZMAX, P, 4.\n*DSLOAD\nB-YMAX, P, 6.\n*END STEP\n",
        ):
            with self.subTest(more=more):
                twice = self.cantilever(NEO, "*DSLOAD\nB-ZMAX, P, 4.\n", more)
                np.testing.assert_allclose(twice, once, rtol=0, atol=1e-7)

    def test_a_long_beam(self):
        """P L^2/(E I) = 4 at the end of a cantilever of ten elements.

        An independent program with the same elements has 0.568 of its length; the elastica, which
        they are too stiff for, 0.670.
        """
        load = 4 * 1000 / 12 / 100 / 4
        text = BEAM.format(load=f"*CLOAD\nTIP, 3, {-load!r}\n", ends=ENDS, inner=INNER)
        result = solved(self, text.replace("1000., 0.\n", "1000., 0.3\n"))
        u = result.field("displacement", -1)
        tip = u[np.isclose(result.points[:, 0], 10)].mean(axis=0)
        self.assertAlmostEqual(tip[2], -5.68, delta=0.005)
        # Of tangents of other places alone the increments would be far more.
        self.assertLess(result.counters["factorisations"], 40)

    def test_a_block_that_is_squeezed_slides(self):
        """Pressed on a plane, then pushed, a pressure on its sides that follows: reactions of an
        independent program (../shared/reference/finite_strain/t_load.py)."""
        text = (INPUT / "block.inp").read_text()
        for old, new in (
            ("*ELASTIC\n210000., <nu>", f"*HYPERELASTIC, NEO HOOKE\n{1 / 5.2!r}, 2.4"),
            ("*STEP\n*STATIC, DIRECT\n<5/steps>, 1.0", "*STEP, NLGEOM\n*STATIC, DIRECT\n1., 6."),
            ("3, 3, -0.1\n", "3, 3, -0.2\n*DSLOAD\n" + "".join(
                f"BODY-{side}, P, 0.15\n" for side in ("XMIN", "XMAX", "YMIN", "YMAX"))),
            ("<1.25/steps>, 1.0", "1., 6."), ("<0.4*cos", "<0.2*cos"), ("<0.4*sin", "<0.2*sin"),
        ):
            self.assertIn(old, text)
            text = text.replace(old, new, 1)
        for n, down, forward in (
            (2, 0.31249171473974735, [-0.06542559544853861, 0, 0.30869708297864296]),
            (3, 0.31413828626122425, [-0.05768118964972937, 0, 0.30674355314144625]),
        ):
            with self.subTest(n=n):
                result = solved(self, text, n=n, theta=0)
                found = result.pairs["BODY-ZMIN:GROUND"].resultant
                found = found[result.history("extra") == 0]
                np.testing.assert_allclose(found[5], [0, 0, down], rtol=0, atol=3e-9)
                np.testing.assert_allclose(found[11], forward, rtol=0, atol=3e-9)


class Heat(unittest.TestCase):
    """A rise dT of the temperature is a stretch 1 + alpha dT without stress."""

    def test_a_free_body_has_no_stress(self):
        for name, law in LAWS.items():
            with self.subTest(law=name):
                text = quarter_ring("B", 1, (1.0, 2.0), (2, 3)) + HEATED.format(law=law)
                result = solved(self, text)
                self.assertLess(np.abs(gauss(result, "stress")).max(), 1e-7 * E)
                wanted = np.broadcast_to(np.log(1.4) * np.array([1, 1, 1, 0, 0, 0]), (6, 8, 6))
                np.testing.assert_allclose(gauss(result, "strain"), wanted, rtol=0, atol=1e-9)
                np.testing.assert_allclose(
                    result.field("displacement", -1), 0.4 * result.points, rtol=0, atol=1e-8
                )
                for energy in ("strain", "external_work", "balance"):
                    self.assertLess(abs(result.history(f"energy/{energy}")[-1]), 1e-6 * E)

    def test_a_held_bar(self):
        """Held at both ends, free at its sides."""
        for name, law in LAWS.items():
            for rise in (20.0, -15.0):
                with self.subTest(law=name, rise=rise):
                    loads = f"B-XMAX, 1, 1\n*TEMPERATURE\nALL, {rise}\n"
                    result = solved(self, BOX.format(law=law, increment=0.2, loads=loads))
                    grown = 1 + 0.01 * rise
                    across = grown * brentq(
                        lambda a, law=law, g=grown: cauchy_stress(law, [1 / g, a, a])[1], 0.7, 1.5,
                        xtol=1e-15,
                    )
                    wanted = cauchy_stress(law, [1 / grown, across / grown, across / grown])[0]
                    stress = gauss(result, "stress")
                    np.testing.assert_allclose(stress[..., 0], wanted, rtol=1e-6)
                    self.assertLess(np.abs(stress[..., 1:]).max(), 1e-5 * E)
                    strain = gauss(result, "strain")
                    np.testing.assert_allclose(strain[..., 1], np.log(across), rtol=1e-6)
                    self.assertLess(np.abs(strain[..., 0]).max(), 1e-9)

    def test_a_clamped_body_that_hardly_changes_its_volume(self):
        """Its end cannot expand. The tangent of what is elastic takes it there without cuts."""
        hot = "B-XMIN, 2, 3\n*TEMPERATURE\nALL, 20.\n"
        law = f"*HYPERELASTIC, NEO HOOKE\n{50 / 1.49!r}, {6 * 0.02 / 200!r}"
        result = solved(self, BOX.format(law=law, increment=0.1, loads=hot))
        self.assertEqual(len(result.history("time")), 10)

    def test_energy_is_balanced_to_the_increment(self):
        """Heat does work where it is held; what is left of all work falls with the increment
        squared."""
        loads = "B-XMAX, 1, 1, 0.5\n*DSLOAD\nB-ZMAX, P, 20.\n*TEMPERATURE\nALL, 20.\n"
        left = []
        for increment in (0.1, 0.05):
            result = solved(self, BOX.format(law=NEO, increment=increment, loads=loads))
            energy = result.history("energy/balance")[-1]
            left.append(abs(energy) / result.history("energy/external_work")[-1])
        self.assertLess(left[0], 2e-3)
        self.assertLess(left[1], 0.3 * left[0])


if __name__ == "__main__":
    unittest.main()
