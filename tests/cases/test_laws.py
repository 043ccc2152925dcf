"""Laws of finite strain: closed forms of a bar, where a law no longer holds, small strain."""

import unittest

import numpy as np
from program import INPUT, Run
from scipy.optimize import brentq
from test_finite_strain import BAR, NU, SVK, E

from bipot.errors import ResultError

MU = 80.0
C10, C01, D1 = 30.0, 8.0, 0.004
MOONEY = f"*HYPERELASTIC, MOONEY-RIVLIN\n{C10}, {C01}, {D1}"
C20, C30 = -4.0, 1.5
YEOH = f"*HYPERELASTIC, YEOH\n{C10}, {C20}, {C30}, {D1}"
OGDEN = f"*HYPERELASTIC, OGDEN, N=2\n90., 2.4, -14., -1.2, {D1}, 0."
FOAM = f"*HYPERFOAM, N=1\n{MU}, -2., 0.25"
WALLS = "B-XMAX, 1, 1\nB-YMAX, 2, 2\n"


def bar(law, stretch, sides="", increment=0.1, fields="S, E, EG, PK2", turn=None, **options):
    """Press the bar of a law to a stretch; `turn` changes the deck."""
    text = BAR.format(law=law, press=2 * (stretch - 1), sides=sides, increment=increment)
    text = text.replace("S, E\n", f"{fields}\n")
    return Run(turn(text) if turn else text, name="bar", **options)


def force_of(run):
    """Return the force of the press, which is on an area of 3."""
    assert run.status == 0, run.errors
    with run.result() as result:
        return result.pairs["B-ZMAX:PRESS"].resultant[-1] / 3


def of_invariants(isochoric):
    """Return an energy of stretches without change of volume, of one of their invariants."""
    return lambda one, two, three: isochoric(
        one**2 + two**2 + three**2 - 3,
        (one * two) ** 2 + (two * three) ** 2 + (three * one) ** 2 - 3,
    )


def of_ogden(*stretches):
    """Return the energy of OGDEN without change of volume."""
    return sum(
        2 * mu / alpha**2 * (sum(stretch**alpha for stretch in stretches) - 3)
        for mu, alpha in ((90.0, 2.4), (-14.0, -1.2))
    )


def stresses(along, across, isochoric):
    """Return the first Piola-Kirchhoff stress along and across, by a step of the energy.

    Its part without change of volume is a function of the stretches without it.
    """

    def energy(*stretches):
        volume = stretches[0] * stretches[1] * stretches[2]
        return isochoric(*(x * volume ** (-1 / 3) for x in stretches)) + (volume - 1) ** 2 / D1

    step = 1e-30j  # the derivative without differences of two numbers
    return (
        energy(along + step, across, across).imag / 1e-30,
        energy(along, across + step, across).imag / 1e-30,
    )


def mooney(along, across):
    """Return those of Mooney and Rivlin's law."""
    return stresses(along, across, of_invariants(lambda x, y: C10 * x + C01 * y))


class ClosedForms(unittest.TestCase):
    """Uniform stretches before a plane. The tolerance of contact is 1e-8 and better."""

    def test_rubber(self):
        """Mooney-Rivlin's law, Yeoh's and Ogden's."""
        yeoh = of_invariants(lambda x, _: C10 * x + C20 * x**2 + C30 * x**3)
        for law, isochoric in (
            (MOONEY, of_invariants(lambda x, y: C10 * x + C01 * y)),
            (YEOH, yeoh),
            (OGDEN, of_ogden),
        ):
            for stretch in (0.9, 0.5):
                across = brentq(
                    lambda a, s=stretch, w=isochoric: stresses(s, a, w)[1], 0.8, 2.0, xtol=1e-15
                )
                with self.subTest(law=law, stretch=stretch):
                    wanted = stresses(stretch, across, isochoric)[0]
                    force = force_of(bar(law, stretch, increment=0.05))
                    np.testing.assert_allclose(force, [0, 0, wanted], atol=1e-6 * abs(wanted))
                    force = force_of(bar(law, stretch, WALLS, increment=0.05))
                    wanted = stresses(stretch, 1.0, isochoric)[0]
                    np.testing.assert_allclose(force[2], wanted, rtol=1e-7)

    def test_foam(self):
        """Blatz and Ko's: across it gets l^(-1/4) wide."""
        for stretch in (0.9, 0.4):
            run = bar(FOAM, stretch, increment=0.05)
            force = force_of(run)
            wanted = MU * (stretch**-0.5 - stretch**-3)
            np.testing.assert_allclose(force, [0, 0, wanted], atol=1e-6 * abs(wanted))
            with run.result() as result:
                np.testing.assert_allclose(
                    result.field("strain", -1)[:, 0], -0.25 * np.log(stretch), rtol=1e-6
                )
            force = force_of(bar(FOAM, stretch, WALLS, increment=0.05))
            np.testing.assert_allclose(force[2], MU * (1 - stretch**-3), rtol=1e-7)

    def test_fields_of_the_undeformed_body(self):
        """Along the bar Green's strain is (l^2 - 1)/2, and the second Piola-Kirchhoff stress the
        force on the undeformed area over l; of shear none; at all places alike."""
        places = ("CENTROIDAL", "INTEGRATION POINTS", "AVERAGED AT NODES")
        cards = "".join(f"*EL FILE, POSITION={place}\nEG, PK2\n" for place in places)
        run = bar(SVK, 0.8, turn=lambda text: text.replace("*EL FILE\n", f"{cards}*EL FILE\n"))
        along, stress = (0.8**2 - 1) / 2, E * (0.8**2 - 1) / 2
        wanted = np.array([-NU * along, -NU * along, along, 0, 0, 0])
        with run.result() as result:
            for on in ("elements", "gauss points"):
                found = result.field("green_strain", -1, on=on).reshape(-1, 6)
                np.testing.assert_allclose(found, [wanted] * len(found), atol=1e-7)
                found = result.field("pk2_stress", -1, on=on).reshape(-1, 6)
                np.testing.assert_allclose(
                    found, [[0, 0, stress, 0, 0, 0]] * len(found), atol=1e-5
                )
            found = result.field("green_strain", -1, on="nodes")
            np.testing.assert_allclose(found, [wanted] * len(found), atol=1e-7)


class Limits(unittest.TestCase):
    """Where a law no longer holds."""

    def test_st_venant_kirchhoff_between_walls(self):
        """It loses its ellipticity at 0.7056 (nu = 0.3); smaller increments do not help."""
        for increment in (0.25, 0.1):
            run = bar(SVK, 0.71, WALLS, increment)
            self.assertEqual(run.status, 0, run.errors)
            run = bar(SVK, 0.70, WALLS, increment)
            self.assertEqual(run.status, 2, run.output)
            self.assertRegex(
                run.errors, r"increment \d+: the law of material M does not hold in element 1, "
                r"stretched by 0\.70?\d*, 1 and 1: it has lost its ellipticity"
            )
            self.assertIn("NEO HOOKE with C10 = 38.46 and D1 = 0.012 holds", run.errors)

    def test_the_law_that_is_named_holds(self):
        law = "*HYPERELASTIC, NEO HOOKE\n38.46, 0.012"
        self.assertEqual(bar(law, 0.5, WALLS).status, 0)

    def test_a_bar_that_may_bulge(self):
        """Between 0.60 and 0.58 (0.592)."""
        self.assertEqual(bar(SVK, 0.60).status, 0)
        run = bar(SVK, 0.58)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("ellipticity", run.errors)

    def test_units_and_places_do_not_matter(self):
        def moved(text):
            for old, new in (
                ("0., 0., 0., 3., 1., 2.", "1e4, 0., 0., 3e3, 1e3, 2e3"),
                ("900, 0., 0., 2.", "900, 1e4, 0., 2e3"),
                ("0., 0., 2., 0., 0., -1.", "1e4, 0., 2e3, 0., 0., -1."),
                ("3, 3, -0.6", "3, 3, -600"), ("200.0, 0.3", "200.0e9, 0.3"),
            ):
                self.assertIn(old, text)
                text = text.replace(old, new)
            return text

        run = bar(SVK, 0.70, WALLS, turn=lambda text: moved(
            text.replace("-0.6000000000000001", "-0.6")
        ))
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("ellipticity", run.errors)

    def test_foam_that_is_pulled(self):
        """A plate's foam is pulled until its stretches have the ratio 2 + sqrt(3)."""
        def pulled(text):
            text = text.split("*NODE\n900")[0] + text.split("B-ZMAX, PRESS\n")[1]
            return text.replace("900, 1, 3\n900, 3, 3", "B-ZMAX, 3, 3")

        self.assertEqual(bar(FOAM, 3.6, WALLS, turn=pulled).status, 0)
        run = bar(FOAM, 3.8, WALLS, turn=pulled)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("ellipticity", run.errors)

    def test_a_note_beyond_usual_stretches(self):
        """Once, below 0.9 and above 1.1; of *ELASTIC alone."""
        run = bar(SVK, 0.8)
        self.assertEqual(run.output.count("is stretched by"), 1, run.output)
        self.assertRegex(
            run.output, r"increment 6: element \d+ is stretched by 0\.88, 1\.03 and 1\.03: "
            r"\*ELASTIC is St Venant-Kirchhoff's law.*Abaqus's \*ELASTIC differ"
        )
        self.assertNotIn("is stretched by", bar(SVK, 0.91).output)
        self.assertNotIn("is stretched by", bar(MOONEY, 0.8).output)


# A bar that is stretched between walls, and then moved with them.
MOVED = """\
*BLOCK, NAME=B, NX=2, NY=2, NZ=3, TYPE=C3D8
0., 0., 0.,  1., 1.1, 2.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP, NLGEOM
*STATIC
0.1, 1.
*BOUNDARY
B-XMIN, 1
B-XMAX, 1
B-YMIN, 2
B-YMAX, 2
B-ZMIN, 3
B-ZMAX, 3, 3, <2*(stretch-1)>
*END STEP
*STEP
*STATIC
1., 1.
*BOUNDARY
B-XMIN, 1, 1, <far>
B-XMAX, 1, 1, <far>
B-YMIN, 2, 2, <far>
B-YMAX, 2, 2, <far>
B-ZMIN, 3, 3, <far>
B-ZMAX, 3, 3, <far+2*(stretch-1)>
*END STEP
"""


class MovedFar(unittest.TestCase):
    """Rounding of displacements makes more of forces where the tangent is stiffer."""

    def test_forces_are_what_is_certified(self):
        """Moved by 1e4 times its size a bar keeps its reactions to the 1e-10 that is certified,
        though its tangent is 5 to 40 times that of small strain."""
        for law, stretch in ((SVK, 3.0), (SVK, 5.0), (MOONEY, 0.2), (FOAM, 0.3)):
            with self.subTest(law=law, stretch=stretch):
                text = "*PARAMETER\nstretch = 1.\nfar = 10000.3\n" + MOVED.format(law=law)
                run = Run(text, name="moved", stretch=stretch)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    row = np.flatnonzero(result.history("step") == 1)[-1]
                    before, after = (result.field("reaction_force", i) for i in (row, -1))
                np.testing.assert_allclose(after, before, atol=1e-10 * np.abs(before).max())


class Words(unittest.TestCase):
    """Laws that others name with a number of terms."""

    def test_polynomials_are_the_laws_of_their_terms(self):
        """The same forces."""
        for words, law in (
            (f"REDUCED POLYNOMIAL\n{C10}, {D1}", f"NEO HOOKE\n{C10}, {D1}"),
            (f"REDUCED POLYNOMIAL, N=2\n{C10}, {C20}, {D1}", f"YEOH\n{C10}, {C20}, 0., {D1}"),
            (f"N=3, REDUCED POLYNOMIAL\n{C10}, {C20}, {C30}, {D1}, 0.", YEOH.split(", ", 1)[1]),
            (f"POLYNOMIAL, N=1\n{C10}, {C01}, {D1}", MOONEY.split(", ", 1)[1]),
            (f"OGDEN, N=3\n60., 2., 16., -2., 0., 1., {D1}, 0.\n0.", MOONEY.split(", ", 1)[1]),
        ):
            with self.subTest(words=words):
                forces = [force_of(bar(f"*HYPERELASTIC, {one}", 0.8)) for one in (words, law)]
                np.testing.assert_allclose(*forces, rtol=1e-12, atol=1e-9)


class SmallStrain(unittest.TestCase):
    """Without NLGEOM."""

    def test_laws_are_their_constants(self):
        """The same numbers as *ELASTIC of the same shear and bulk modulus, and a note."""
        def of_rubber(half_shear):
            bulk, shear = 2 / D1, 2 * half_shear
            young = 9 * bulk * shear / (3 * bulk + shear)
            return young, young / (2 * shear) - 1

        for law, constants in (
            (MOONEY, of_rubber(C10 + C01)), (YEOH, of_rubber(C10)), (OGDEN, of_rubber(76 / 2)),
            (FOAM, (2.5 * MU, 0.25)),
        ):
            elastic = f"*ELASTIC\n{constants[0]!r}, {constants[1]!r}"
            runs = [
                bar(one, 0.9, fields="S, E", turn=lambda text: text.replace(", NLGEOM", ""))
                for one in (law, elastic)
            ]
            np.testing.assert_allclose(force_of(runs[0]), force_of(runs[1]), rtol=1e-9, atol=1e-9)
            note = "without NLGEOM *HYPERELASTIC and *HYPERFOAM act by"
            self.assertIn(note, runs[0].output)
            self.assertNotIn(note, runs[1].output)
            self.assertNotIn(note, bar(law, 0.95, fields="S, E").output)

    def test_rubber_by_small_strain(self):
        """--nlgeom no says so too."""
        run = Run(INPUT / "rubber.inp", "--nlgeom", "no", "--plan")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("without NLGEOM *HYPERELASTIC and *HYPERFOAM act by", run.output)

    def test_fields_of_the_undeformed_body_are_not_written(self):
        run = bar(SVK, 0.9, turn=lambda text: text.replace(", NLGEOM", ""))
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("EG and PK2 are not written without NLGEOM", run.output)
        with run.result() as result, self.assertRaises(ResultError):
            result.field("green_strain", -1)


if __name__ == "__main__":
    unittest.main()
