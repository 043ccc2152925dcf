"""The error of small strain by a run at finite strain beside it, and NLGEOM=AUTO."""

import re
import unittest

import h5py
import numpy as np
from meshes import grid
from program import Run, in_long_form

# A block on a plane, pressed and pushed; the law, the theory and what is asked as parameters.
BLOCK = """*PARAMETER
n = 3
down = 0.02
mu = 0.3
steps = 5
*BLOCK, NAME=B, TYPE={element}, NX=<n>, NY=<n>, NZ=<n>
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
{law}
{expansion}*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
{accuracy}*STEP{nlgeom}
*STATIC, DIRECT
<1/steps>, 1.
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, <-down>
{loads}*END STEP
*STEP
*STATIC, DIRECT
<1/steps>, 1.
*BOUNDARY
B-ZMAX, 1, 1, <2*down>
*END STEP
"""
SVK = "*ELASTIC, LAW=SVK\n1000., 0.3"
NEO = "*ELASTIC, LAW=NEO HOOKE\n1000., 0.3"
OPEN = "*ELASTIC\n1000., 0.3"
ESTIMATE = "*ACCURACY, THEORY=ESTIMATE\n"
# A block between smooth plates: every point has the same stress.
BAR = """*PARAMETER
down = 0.1
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
B-XMIN, 1, 1
B-YMIN, 2, 2
B-ZMAX, 3, 3, <-down>
*END STEP
"""
# A column on a rough plane, clamped at its upper end: Euler's strain is (2 pi/L)^2/12.
COLUMN = """*PARAMETER
load = 0.8
*BLOCK, NAME=B, TYPE=C3D8I, NX=2, NY=2, NZ=20
0., 0., 0., 1., 1., 20.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.5
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, <-load*20*pi*pi/1200>
*END STEP
"""
# Two blocks that slide on each other.
PAIR = """*PARAMETER
down = 0.05
*BLOCK, NAME=LOW, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*BLOCK, NAME=HIGH, NX=3, NY=3, NZ=2
0.2, 0.2, 1., 0.8, 0.8, 1.6
*MATERIAL, NAME=M
*ELASTIC, LAW=SVK
1000., 0.3
*ELSET, ELSET=ALL
LOW, HIGH
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
HIGH-ZMIN, LOW-ZMAX
*STEP{nlgeom}
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
LOW-ZMIN, 1, 3
HIGH-ZMAX, 1, 1, <down>
HIGH-ZMAX, 2, 2
HIGH-ZMAX, 3, 3, <-down>
*END STEP
"""
# A strip that is stretched, then bent by a cylinder: the stretch makes it many times as stiff.
STRIP = """*BLOCK, NAME=B, TYPE=C3D8I, NX=20, NY=1, NZ=1
0., 0., 0., 16., 1., 0.4
*MATERIAL, NAME=M
*ELASTIC, LAW=SVK
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
9999999, 8., 0.5, 2.4
*OBSTACLE, NAME=C, TYPE=CYLINDER, REF NODE=9999999
8., 0.5, 2.4, 0., 1., 0., 2.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMAX, C
*STEP{nlgeom}
*STATIC
0.25, 1.
*BOUNDARY
B-XMIN, 1, 3
B-XMAX, 2, 3
B-XMAX, 1, 1, 0.05
*END STEP
*STEP
*STATIC
0.25, 1.
*BOUNDARY
9999999, 1, 2
9999999, 3, 3, -0.05
*END STEP
"""
HUGE = 1e300
TIMES = re.compile(r"time|checksum")
OF_THEORY = tuple(f"history/error/{name}" for name in
                  ("small_strain", "small_strain_deck_law", "small_strain_other_law", "law"))


def block(law=SVK, nlgeom="", accuracy="", element="C3D8", expansion="", loads=""):
    """The deck of the block."""
    return BLOCK.format(law=law, nlgeom=nlgeom, accuracy=accuracy, element=element,
                        expansion=expansion, loads=loads)


def errors(run, name="small_strain"):
    """The error by the theory at the ends of the steps."""
    with run.result() as result:
        values = result.history(f"error/{name}")
        return np.array([values[row] for row in result.step_ends])


def resultants(run):
    """The resultants of the pairs at the ends of the steps."""
    with run.result() as result:
        pairs = result.file["contact"]
        return np.array([[pairs[name]["resultant"][row] for name in pairs]
                         for row in result.step_ends])


def change(linear, finite):
    """How far resultants are from those of finite strain, as a part of these."""
    norm = np.linalg.norm
    return np.array([norm(one - other, axis=-1).max() / norm(other, axis=-1).max()
                     for one, other in zip(resultants(linear), resultants(finite), strict=True)])


def unlike(one, other, but=OF_THEORY):
    """The datasets that differ in a bit, but times and those named."""
    found = []
    with h5py.File(one) as a, h5py.File(other) as b:
        def look(name, item):
            if not isinstance(item, h5py.Dataset) or TIMES.search(name) or name in but:
                return
            if name.startswith(("run/", "state")):
                return
            if name not in b or np.asarray(item[()]).tobytes() != np.asarray(b[name][()]).tobytes():
                found.append(name)
        a.visititems(look)
    return found


def arch(force):
    """A shallow strip between held ends, that a cylinder presses down by a force."""

    def curved(at):
        along = 12 * (at[0] - 0.5)
        return along, at[1], 0.6 * (1 - (along / 6) ** 2) + 0.3 * (at[2] - 0.5)

    mesh, index, _ = grid("ALL", (8, 1, 1), curved)
    ends = "\n".join(map(str, index[[0, -1]].ravel()))
    return mesh.replace("<element>", "C3D8I") + f"""*NSET, NSET=ENDS
{ends}
*SURFACE, NAME=UPPER
3, S2
4, S2
5, S2
6, S2
*MATERIAL, NAME=M
*ELASTIC, LAW=SVK
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*NODE
9999, 0., 0.5, 1.75
*OBSTACLE, NAME=BALL, TYPE=CYLINDER, REF NODE=9999
0., 0.5, 1.75, 0., 1., 0., 1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
UPPER, BALL
*STEP
*STATIC
0.25, 1.
*BOUNDARY
ENDS, 1, 3
9999, 1, 2
*CLOAD
9999, 3, {-force}
*END STEP
"""



class Estimate(unittest.TestCase):
    """The shadow run finds the resultants of NLGEOM, and leaves those of the linear run alone."""

    def holds(self, make, within=0.05, options=(), **values):
        """The estimate is within a part of the true error, at all ends of steps."""
        linear = Run(make(nlgeom=""), "--theory", *options, name="d", **values)
        finite = Run(make(nlgeom=", NLGEOM"), *options, name="d", **values)
        self.assertEqual((linear.status, finite.status), (0, 0), linear.errors + finite.errors)
        true = change(linear, finite)
        np.testing.assert_allclose(errors(linear), true, rtol=within, atol=2e-5)
        self.assertGreater(true.max(), 1e-3)

    def test_pressed_blocks(self):
        for law in (SVK, NEO):
            for down in (0.002, 0.02, 0.08):
                with self.subTest(law=law, down=down):
                    self.holds(lambda nlgeom, law=law: block(law, nlgeom), down=down)

    def test_other_elements_and_no_friction(self):
        for element in ("C3D8I", "C3D8B"):
            with self.subTest(element=element):
                self.holds(lambda nlgeom, e=element: block(NEO, nlgeom, element=e), mu=0)

    def test_a_stretch_that_stiffens(self):
        plain, followed, finite = (Run(STRIP.format(nlgeom=nlgeom), *more, name="strip")
                                   for nlgeom, *more in (("",), ("", "--theory"), (", NLGEOM",)))
        one, other = (np.linalg.norm(resultants(run)[-1]) for run in (plain, finite))
        true = abs(one - other) / other
        self.assertGreater(true, 0.5)
        np.testing.assert_allclose(errors(followed)[-1], true, rtol=0.05)
        self.assertGreater(errors(plain)[-1], true)

    def test_sizes_of_increments_are_no_theory(self):
        # One increment and 40 are apart by 0.2 % of the forces, as much as the theories are.
        for law in (SVK, NEO):
            self.holds(lambda nlgeom, law=law: block(law, nlgeom), down=0.001, steps=40)

    def test_loads_that_turn_within_a_step(self):
        back = "*AMPLITUDE, NAME=BACK\n0., 0., 0.3, 1., 0.7, -1., 1., 1.\n*STEP"

        def make(nlgeom):
            first, second = block(NEO, nlgeom).split("*END STEP\n*STEP")
            return (first.replace("*STEP", back, 1) + "*END STEP\n*STEP"
                    + second.replace("*BOUNDARY", "*BOUNDARY, AMPLITUDE=BACK"))
        self.holds(make, steps=20)

    def test_two_bodies(self):
        self.holds(lambda nlgeom: PAIR.format(nlgeom=nlgeom))

    def test_warmth_and_pressures_that_follow(self):
        heat, loads = "*EXPANSION\n1e-3\n", "*TEMPERATURE\nB, 20.\n*DSLOAD\nB-XMIN, P, 30.\n"
        self.holds(lambda nlgeom: block(NEO, nlgeom, expansion=heat, loads=loads), down=0.01)

    def test_factor_in_single_precision(self):
        single = "*PRECISION, FACTOR=SINGLE\n"
        self.holds(lambda nlgeom: block(NEO, nlgeom, accuracy="" if nlgeom else single))

    def test_closed_forms(self):
        # P/E of a bar with nu = 0: linear l - 1, St Venant-Kirchhoff l (l^2 - 1)/2.
        for down in (0.01, 0.1):
            run = Run(BAR, "--theory", name="bar", down=down)
            stretch = 1 - down
            svk = stretch * (1 - stretch**2) / 2
            np.testing.assert_allclose(errors(run), abs(down - svk) / svk, rtol=0.02)
            # Of the same size and other sign: the laws are apart by both.
            neo = errors(run, "small_strain_other_law")
            self.assertGreater(errors(run, "law")[0], 0.9 * (down + neo[0]))
            self.assertIn("by neo-Hooke's law", run.output)

    def test_the_run_keeps_its_bits(self):
        for name, deck in (("block", block(OPEN)), ("pair", PAIR.format(nlgeom=""))):
            plain, followed = (Run(deck, *more, name=name) for more in ((), ("--theory",)))
            self.assertEqual(unlike(plain.file, followed.file), [])
            with plain.result() as one, followed.result() as other:
                self.assertEqual([run.small_strain_is for run in (one, other)],
                                 ["bound", "estimate"])
            # The bound is one.
            self.assertTrue(np.all(errors(plain) >= errors(followed)))

    def test_continued_runs_say_the_same(self):
        deck = block(OPEN, accuracy=ESTIMATE)
        whole = Run(deck, name="deck")
        for place in (("1", "3"), ("2", "2")):
            continued = Run(deck, "--continue", name="deck", ended_at=place)
            self.assertEqual(continued.status, 0, continued.errors)
            self.assertEqual(unlike(whole.file, continued.file, but=()), [])

    def test_finite_strain_has_none(self):
        run = Run(block(nlgeom=", NLGEOM"), name="deck")
        self.assertEqual(list(errors(run)), [0.0, 0.0])
        with run.result() as result:
            self.assertEqual(result.small_strain_is, "finite strain")

    def test_a_bound_that_says_little_is_estimated(self):
        # Shadow runs make 4 increments: only where that is a fifth or less.
        plain, asked_for, few = (Run(block(SVK), *more, name="deck", down=0.1, steps=steps)
                                 for steps, more in ((10, ()), (10, ("--theory",)), (9, ())))
        self.assertIn("note: step 1: small strain may be off by more than 20 %: a run at finite "
                      "strain beside this one estimates it\n", plain.output)
        np.testing.assert_allclose(errors(plain), errors(asked_for), rtol=1e-9)
        self.assertNotIn("beside this one", few.output)
        with plain.result() as result, few.result() as other:
            self.assertEqual([run.small_strain_is for run in (result, other)],
                             ["estimate", "bound"])

    def test_couplings_that_turn_have_a_bound(self):
        text = PAIR.format(nlgeom="").replace("*STEP", "*NODE, NSET=R\n9999, 0.5, 0.5, 1.6\n"
            "*SURFACE, NAME=TOP\nHIGH-ZMAX\n*COUPLING, REF NODE=9999, SURFACE=HIGH-ZMAX, "
            "CONSTRAINT NAME=C\n*KINEMATIC\n1, 3\n*STEP", 1)
        text = text.replace("*SURFACE, NAME=TOP\nHIGH-ZMAX\n", "")
        for dof in (1, 2, 3):
            text = re.sub(rf"HIGH-ZMAX, {dof}, {dof}", f"9999, {dof}, {dof}", text)
        run = Run(text.replace("*END STEP", "9999, 4, 6\n*END STEP"), "--theory", name="deck")
        self.assertEqual(run.status, 0, run.output + run.errors)
        self.assertIn("error of small strain is bounded, not estimated", run.output)
        with run.result() as result:
            self.assertEqual(result.small_strain_is, "bound")


class Buckling(unittest.TestCase):
    """Beyond Euler's load small strain says nothing; below it says how far it is off."""

    def test_column_whose_edge_slides(self):
        # Lateral expansion makes points of the foot slide. None of them has to as it buckles.
        deck = COLUMN.replace("1000., 0.\n", "1000., 0.3\n")
        stable, unstable = (Run(deck, "--theory", name="column", load=load)
                            for load in (0.8, 2.4))
        self.assertTrue(0.003 < errors(stable)[0] < 0.02)
        self.assertGreater(errors(unstable)[0], HUGE)
        self.assertIn("is unstable (it buckles)", unstable.output)

    def test_column(self):
        stable, unstable = (Run(COLUMN, "--theory", name="column", load=load)
                            for load in (0.8, 2.4))
        self.assertTrue(0.003 < errors(stable)[0] < 0.02)
        self.assertGreater(errors(unstable)[0], HUGE)
        self.assertIn("is unstable (it buckles)", unstable.output)
        self.assertIn("small strain: not known\n", unstable.output)
        self.assertRegex(unstable.output, "at small strain, whose error is not known here")
        self.assertEqual(unstable.status, 0)


class Choice(unittest.TestCase):
    """NLGEOM=AUTO takes finite strain where small strain is not enough, and only there."""

    def test_small_strain_is_enough(self):
        run = Run(block(nlgeom=", NLGEOM=AUTO"), name="deck", down=0.002)
        plain = Run(block(), name="deck", down=0.002)
        self.assertEqual(unlike(plain.file, run.file), [])

    def test_finite_strain_takes_its_place(self):
        finite = Run(block(nlgeom=", NLGEOM"), name="deck")
        for deck, options in ((block(nlgeom=", NLGEOM=AUTO"), ()), (block(), ("--nlgeom", "auto")),
                              (block(nlgeom=", NLGEOM"), ("--nlgeom", "auto")),
                              (block(), ("--nlgeom", "yes"))):
            run = Run(deck, *options, name="deck")
            self.assertEqual(run.status, 0, run.errors)
            self.assertEqual(unlike(finite.file, run.file, but=()), [])
            self.assertEqual([path.name for path in run.folder.glob("*.linear")], [])
            if options != ("--nlgeom", "yes"):
                self.assertRegex(run.output, r"small strain is off by \S+ %, and 1 % is allowed")

    def test_what_is_asked_decides(self):
        run = Run(block(), "--nlgeom", "auto", "--accuracy", "0.3", "--refine", "0", name="deck")
        self.assertNotIn("begins again", run.output)

    def test_a_law_that_is_open_decides_nothing(self):
        run = Run(block(OPEN), "--nlgeom", "auto", name="deck")
        self.assertEqual(run.status, 0)
        self.assertRegex(run.output, r"keeps small strain: which law .* \*ELASTIC does not say")
        plain = Run(block(OPEN), name="deck")
        self.assertEqual(unlike(plain.file, run.file), [])

    def test_what_finite_strain_refuses_stays(self):
        run, plain = (Run(COLUMN, *more, name="column", load=1.5)
                      for more in (("--nlgeom", "auto"), ()))
        self.assertEqual(run.status, 0)
        self.assertRegex(run.output, r"keeps small strain: .*the equilibrium is unstable")
        self.assertEqual(unlike(plain.file, run.file), [])
        self.assertEqual([path.name for path in run.folder.glob("*.linear")], [])

    def test_continued_runs_decide_alike(self):
        deck = block(nlgeom=", NLGEOM=AUTO")
        whole = Run(deck, name="deck")
        for end in (("2", "2"), ("begins again", "1", "3")):
            with self.subTest(end=end):
                continued = Run(deck, "--continue", name="deck", ended_at=end)
                self.assertEqual(continued.status, 0, continued.errors)
                self.assertEqual(unlike(whole.file, continued.file, but=()), [])
                self.assertEqual([path.name for path in continued.folder.glob("*.linear")], [])

    def test_files_of_others_stay(self):
        deck = block(nlgeom=", NLGEOM=AUTO")
        ours = Run(block(), name="deck")
        linear, sidecar = "deck.vtkhdf.linear", "deck.xdmf.linear"
        for name, end in ((linear, None), (sidecar, None), (linear, ("1", "3")),
                          (linear, ("begins again", "1", "3"))):
            with self.subTest(name=name, end=end):
                run = Run(deck, *(["--continue"] if end else []), name="deck", ended_at=end,
                          beside={name: ours.file})
                self.assertEqual(run.status, 1)
                self.assertIn(f"'{name}' is there", run.errors)
                self.assertEqual((run.folder / name).read_bytes(), ours.file.read_bytes())
        run = Run(deck, "--overwrite", name="deck", beside={"deck.vtkhdf.linear": ours.file})
        self.assertEqual(run.status, 0, run.errors)


def free(deck):
    """The deck with increments that may be divided."""
    return deck.replace("*STATIC, DIRECT", "*STATIC")


def asked(deck, accuracy, *options, **values):
    """A run of the block for an accuracy, with increments that may be divided."""
    return Run(free(deck), "--accuracy", str(accuracy), *options, name="deck",
               **{"n": 4, "steps": 2, **values})


def sequence_of(run):
    """The runs by which an accuracy was reached."""
    with run.result() as result:
        return result.accuracy


class Accuracy(unittest.TestCase):
    """The error of small strain is a part of an accuracy, and finite strain takes its place."""

    def test_a_small_error_is_a_part_of_the_sum(self):
        run = asked(block(OPEN), 0.1, down=0.005)
        self.assertEqual(run.status, 0, run.errors)
        found = sequence_of(run)
        self.assertTrue(found.reached)
        self.assertLess(found.mesh_and_load_steps + found.others + found.small_strain, 0.1)
        np.testing.assert_allclose(found.small_strain, errors(run).max(), rtol=1e-12)
        with run.result() as result:
            self.assertEqual(result.small_strain_is, "estimate")
        self.assertRegex(run.output, r"load steps \S+ %, (together \S+ %, )?small strain \S+ %; "
                                     "10 % is")
        # Of the small-strain solution more is left for the mesh, and the sum is another one.
        alone = asked(block(OPEN), 0.1, "--nlgeom", "no", down=0.005)
        self.assertEqual(sequence_of(alone).small_strain, -1)
        self.assertNotIn("small strain", alone.output.splitlines()[-1])

    def test_a_bound_that_spoils_nothing_is_enough(self):
        run = asked(block(OPEN), 0.2, down=0.0005)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertEqual(result.small_strain_is, "bound")
        self.assertRegex(run.output, r"small strain at most \S+ %; 20 % is reached")

    def test_a_bound_is_one_of_a_stable_equilibrium(self):
        # 30 % allow a bound of 3 %, which the column has on both sides of Euler's load.
        for named in (COLUMN, COLUMN.replace("*ELASTIC", "*ELASTIC, LAW=SVK")):
            stable, unstable = (Run(free(named), "--accuracy", "0.3", name="column", load=load)
                                for load in (0.8, 1.2))
            self.assertEqual((stable.status, unstable.status), (0, 2), stable.errors)
            with stable.result() as result:
                self.assertEqual(result.small_strain_is, "bound")
            self.assertRegex(
                unstable.errors, "not reached: small strain is off by an unknown amount")
            alone = Run(free(named), "--accuracy", "0.3", "--nlgeom", "no", name="column", load=1.2)
            self.assertEqual(alone.status, 0, alone.errors)

    def test_buckling_is_refused_on_the_first_mesh(self):
        # Displacement elements are softer on finer meshes; incompatible modes ask twice.
        for element, load, meshes in (("C3D8I", 2, 2), ("C3D8", 8, 1)):
            deck = free(COLUMN).replace("C3D8I", element).replace("0.5, 1.", "0.25, 1.")
            run = Run(deck, "--accuracy", "0.3", "--nlgeom", "yes", name="column", load=load)
            self.assertEqual(run.status, 2)
            self.assertIn("the equilibrium is unstable", run.errors)
            self.assertEqual(run.output.count("elements are too few"), meshes - 1)

    @in_long_form
    def test_a_load_beyond_the_limit_ends_on_the_second_mesh(self):
        # A shallow strip, held at its ends, snaps through; finer meshes do so at smaller loads.
        run = Run(arch(0.2), "--accuracy", "0.3", "--nlgeom", "yes", name="arch")
        self.assertEqual(run.status, 2)
        self.assertEqual(run.output.count("elements are too few"), 1)
        self.assertIn("no equilibrium nearby", run.errors)
        self.assertEqual(run.errors.count("are kept in"), 1)
        self.assertNotIn("are kept in", run.output)
        followed = Run(arch(0.2), "--accuracy", "0.3", name="arch")
        self.assertEqual(followed.status, 2)
        self.assertNotIn("are kept in", followed.output + followed.errors)
        self.assertGreater(errors(followed)[-1], HUGE)

    def test_a_law_that_is_named_goes_to_finite_strain(self):
        run = asked(block(SVK), 0.1, down=0.05)
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, r"small strain is off by \S+ %, and 10 % is allowed for all "
                                     r"errors: the run begins again at finite strain")
        finite = asked(block(SVK, ", NLGEOM"), 0.1, down=0.05)
        self.assertEqual(finite.status, 0, finite.errors)
        of_runs = ("accuracy/processor_time",)
        self.assertEqual(unlike(finite.file, run.file, but=of_runs), [])
        self.assertEqual(sequence_of(run).small_strain, -1)

    def test_a_law_that_is_open_is_asked_for(self):
        run = asked(block(OPEN), 0.1, down=0.05)
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, r"accuracy 10 % of the contact forces was not reached: which "
                         r"law .* more than 10 %.* off by \S+ % with St Venant .* by \S+ % with "
                         r"neo-Hooke's. \*HYPERELASTIC, .*LAW=SVK says it; NLGEOM=NO .*beside that")
        found = sequence_of(run)
        self.assertFalse(found.reached)
        self.assertLess(found.mesh_and_load_steps + found.others, 0.1)
        # What stands there is the small-strain solution.
        alone = asked(block(OPEN), 0.1, "--nlgeom", "no", down=0.05)
        self.assertEqual(alone.status, 0, alone.errors)
        self.assertTrue(sequence_of(alone).reached)
        np.testing.assert_array_equal(resultants(run), resultants(alone))

    def test_the_deck_asks_for_small_strain(self):
        run = asked(block(SVK, ", NLGEOM=NO"), 0.1, down=0.05)
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, r"10 % is reached at small strain, which may be")
        self.assertEqual(sequence_of(run).small_strain, -1)
        # The option wins.
        run = asked(block(SVK, ", NLGEOM=NO"), 0.1, "--nlgeom", "auto", down=0.05)
        self.assertIn("begins again at finite strain", run.output)

    def test_what_finite_strain_refuses(self):
        run = Run(free(COLUMN), "--accuracy", "0.3", name="column", load=1.5)
        self.assertEqual(run.status, 2)
        self.assertIn("the runs go back to small strain: at finite strain ", run.output)
        self.assertRegex(run.errors, r"was not reached: small strain is off by an unknown amount, "
                                     "and at finite strain .*unstable")
        with run.result() as result:
            self.assertEqual(result.small_strain_is, "estimate")
            self.assertTrue(result.history("certified").all())
        self.assertGreater(errors(run)[-1], HUGE)

    def test_an_unstable_equilibrium_is_no_accuracy(self):
        # Points of the foot slide: no friction holds what buckles with the foot at rest.
        deck = free(COLUMN).replace("1000., 0.\n", "1000., 0.3\n")
        run = Run(deck.replace("*ELASTIC", "*ELASTIC, LAW=SVK"), "--accuracy", "0.1",
                  name="column", load=1.2)
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, r"at finite strain .*the equilibrium is unstable")

    def test_bodies_that_contact_alone_holds(self):
        # Between smooth plates a body is free to slide and to turn about their normal.
        deck = block(SVK).replace("B-ZMAX, 1, 2\nB-ZMAX, 3", "9999, 1, 2\n9999, 3").replace(
            "*OBSTACLE", "*NODE, NSET=R\n9999, 0.5, 0.5, 3.\n*OBSTACLE, NAME=TOOL, TYPE=PLANE, "
            "REF NODE=9999\n0., 0., 1., 0., 0., -1.\n*OBSTACLE", 1).replace(
            "B-ZMIN, FLOOR\n", "B-ZMIN, FLOOR\nB-ZMAX, TOOL\n").replace(
            "B-ZMAX, 1, 1, <2*down>", "9999, 3, 3, <-2*down>")
        run = asked(deck, 0.1, mu=0, down=0.03)
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("begins again at finite strain", run.output)
        self.assertNotIn("unstable", run.output)
        self.assertLess(len(sequence_of(run)), 5)

    def test_on_a_mesh_that_is_kept_the_sum_decides(self):
        options = ("--refine", "0")
        one = asked(block(SVK), 0.05, *options, "--nlgeom", "no", "--theory", n=6, down=0.01)
        with one.result() as result:
            total = max(result.history("error/total")[result.step_ends])
        theory = errors(one).max()
        self.assertGreater(total, 0.5 * theory)
        enough, less = (asked(block(SVK), wanted, *options, n=6, down=0.01)
                        for wanted in (1.1 * (total + theory), total + 0.5 * theory))
        self.assertEqual(enough.status, 0, enough.errors)
        self.assertNotIn("begins again", enough.output)
        self.assertIn("begins again at finite strain", less.output)

    def test_within_time_and_memory(self):
        for bound in (("--memory", "60MB"), ("--time", "2")):
            with self.subTest(bound=bound):
                run = Run(block(SVK), "--nlgeom", "auto", *bound, name="deck", n=4, steps=2)
                self.assertEqual(run.status, 0, run.errors)
                self.assertRegex(run.output, r"off by \S+ %, and 1 % is allowed: the run begins")
                with run.result() as result:
                    self.assertEqual(result.small_strain_is, "finite strain")
                    self.assertGreater(len(result.accuracy), 1)


if __name__ == "__main__":
    unittest.main()
