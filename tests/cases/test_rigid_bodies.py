"""*RIGID BODY of solid elements and of their nodes: as an obstacle, and as a loaded part."""

import unittest

import numpy as np
from program import Run
from scipy.spatial.transform import Rotation

YOUNG, POISSON = 1000.0, 0.3
SIDE, HEIGHT = 2.0, 1.0  # of the elastic block [length]
PLATE = 0.5  # thickness of the rigid one [length]

# A rigid plate UP on an elastic block LOW, whose foot is on a smooth floor.
DECK = """\
*BLOCK, NAME=LOW, NX=3, NY=3, NZ=2, TYPE={element}
0., 0., 0., 2., 2., 1.
*BLOCK, NAME=UP, NX={cuts}, NY={cuts}, NZ=1, TYPE={element}
{plate}
*NODE
9000, {at}
9001, 7., 7., 7.
*NSET, NSET=REF
9000
*NSET, NSET=ROT
9001
*NSET, NSET=BOTH
REF, ROT
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.3
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SOLID SECTION, ELSET=LOW, MATERIAL=SOFT
*SOLID SECTION, ELSET=UP, MATERIAL=STEEL
{body}
*SURFACE INTERACTION, NAME=DRY
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=DRY{sliding}
{pair}
*STEP{step}
*STATIC
{static}
*BOUNDARY
{held}
{loads}
*END STEP
"""
ON_TOP = "0., 0., 1., 2., 2., 0.5"
WHOLE = "*RIGID BODY, ELSET=UP, REF NODE=9000, ROT NODE=9001"
ON_FLOOR = "LOW-ZMIN, 3, 3\nLOW-XMIN, 1, 1\nLOW-YMIN, 2, 2"
CLAMPED = "LOW-ZMIN, 1, 3"
# Two prescribed dofs, a force and a moment on a plate beside the middle.
LOADS = "9000, 1, 1, 0.003\n9001, 3, 3, 0.01\n*CLOAD\n9000, 3, -60.\n9001, 2, 4."
OFF_CENTRE = {"plate": "0.3, 0.4, 1., 1.1, 1.2, 0.5", "mu": 0.3, "held": CLAMPED,
              "static": "0.25, 1.", "loads": LOADS}
NAMES = ("displacement", "rotation", "reaction_force", "reaction_moment")


def text(**changes):
    """Return the deck; the middle of the plate's foot is its reference node."""
    words = {"element": "C3D8", "plate": ON_TOP, "cuts": 2, "at": "1., 1., 1.", "body": WHOLE,
             "mu": 0, "pair": "LOW-ZMAX, UP-ZMIN", "sliding": "", "step": "", "static": "1., 1.",
             "held": ON_FLOOR, "loads": ""}
    return DECK.format(**{**words, **changes})


def solved(case, *options, deck=None, **changes):
    """Run a deck that must be certified; return its result."""
    run = Run(deck or text(**changes), *options, name="case")
    case.assertEqual(run.status, 0, run.errors + run.output)
    result = run.result()
    case.addCleanup(result.close)
    return result


def reference(result, node=9000):
    """Return what the result file says of a reference node at the end."""
    of = result.reference_nodes[node]
    return {name: np.asarray(getattr(of, name))[-1] for name in NAMES}


class ClosedForms(unittest.TestCase):
    """Uniform pressure and pure bending below a rigid plate: C3D8I has both exactly."""

    # The floor holds the foot along z, and two of its corners hold the block in the plane.
    HELD = "LOW-ZMIN, 3, 3\n1, 1, 2\n4, 2, 2\n9000, 1, 2"

    def check_loads(self, **changes):
        """Force and moments within the middle of the plate: shortening and rotation."""
        force, about_x, about_y = -40.0, 3.0, -5.0
        loads = (f"9001, 3, 3\n*CLOAD\n9000, 3, {force!r}\n9001, 1, {about_x!r}\n"
                 f"9001, 2, {about_y!r}")
        found = reference(solved(self, element="C3D8I", held=self.HELD, loads=loads,
                                 sliding=", SMALL SLIDING", **changes))
        stiffness = YOUNG * SIDE**2 / HEIGHT
        bending = YOUNG * SIDE**4 / 12.0 / HEIGHT
        self.assertAlmostEqual(found["displacement"][2], force / stiffness, delta=1e-9)
        np.testing.assert_allclose(found["rotation"], [about_x / bending, about_y / bending, 0.0],
                                   atol=1e-9)

    def test_a_plate_under_a_force_and_moments_is_master(self):
        self.check_loads()

    def test_the_plate_is_slave(self):
        """Its faces match those of the block: gaps are means over those of the slave."""
        self.check_loads(pair="UP-ZMIN, LOW-ZMAX", cuts=3)

    def test_rigid_nodes_of_a_body(self):
        """The plate is deformable but for its foot: it is as stiff as the whole is."""
        self.check_loads(body="*RIGID BODY, NSET=UP-ZMIN, REF NODE=9000, ROT NODE=9001")

    def test_a_rigid_body_between_two_elastic_ones(self):
        """Springs in series: both blocks shorten by F h / (E A), the plate goes with the lower."""
        third = "*BLOCK, NAME=TOP, NX=2, NY=1, NZ=2\n0., 0., 1.5, 2., 2., 1.\n*MATERIAL, NAME=STEEL"
        deck = text(held=ON_FLOOR + "\nTOP-XMIN, 1, 1\nTOP-YMIN, 2, 2\n9000, 1, 2\n9001, 3, 3",
                    pair="LOW-ZMAX, UP-ZMIN\nTOP-ZMIN, UP-ZMAX",
                    loads="*DSLOAD\nTOP-ZMAX, P, 8.").replace("*MATERIAL, NAME=STEEL", third)
        deck = deck.replace("ELSET=UP, MATERIAL=STEEL", "ELSET=UP, MATERIAL=STEEL\n"
                            "*SOLID SECTION, ELSET=TOP, MATERIAL=SOFT")
        result = solved(self, deck=deck)
        found = reference(result)
        self.assertAlmostEqual(found["displacement"][2], -8.0 * HEIGHT / YOUNG, delta=1e-10)
        np.testing.assert_allclose(found["rotation"], 0.0, atol=1e-10)
        top = result.points[:, 2] > 2.4
        np.testing.assert_allclose(result.field("displacement", -1)[top, 2],
                                   -16.0 * HEIGHT / YOUNG, atol=1e-10)
        for pair in result.pairs.values():
            np.testing.assert_allclose(np.abs(pair.resultant[-1]), [0.0, 0.0, 32.0], atol=1e-7)


class SameInOtherWords(unittest.TestCase):
    """Each way of writing it gives the same bits."""

    def check(self, **changes):
        """Compare all of the last increment with the deck of the class."""
        result = [solved(self, **{**OFF_CENTRE, **more}) for more in ({}, changes)]
        for name in NAMES:
            np.testing.assert_array_equal(*[reference(one)[name] for one in result])
        np.testing.assert_array_equal(*[one.field("displacement", -1) for one in result])
        np.testing.assert_array_equal(
            *[next(iter(one.pairs.values())).resultant[-1] for one in result]
        )
        pair = next(iter(result[0].pairs.values()))
        self.assertGreater(np.abs(pair.resultant[-1][[0, 2]]).min(), 0.1)

    def test_dofs_4_to_6_of_the_reference_node(self):
        self.check(loads="9000, 1, 1, 0.003\n9000, 6, 6, 0.01\n*CLOAD\n9000, 3, -60.\n9000, 5, 4.")

    def test_sets_with_a_rot_node(self):
        self.check(loads="REF, 1, 1, 0.003\nROT, 3, 3, 0.01\n*CLOAD\nREF, 3, -60.\nROT, 2, 4.")

    def test_a_set_of_its_nodes(self):
        self.check(body="*RIGID BODY, NSET=UP, REF NODE=9000, ROT NODE=9001")

    def test_sets_of_other_programs(self):
        self.check(body="*RIGID BODY, PIN NSET=UP-ZMIN, TIE NSET=UP, REF NODE=9000, "
                        "ROT NODE=9001, ISOTHERMAL=YES")

    def test_two_cards_of_one_body(self):
        self.check(body="*RIGID BODY, NSET=UP-ZMIN, REF NODE=9000, ROT NODE=9001\n"
                        "*RIGID BODY, NSET=UP-ZMAX, REF NODE=9000, ROT NODE=9001")

    def test_a_coupling_of_its_surface(self):
        self.check(body="*COUPLING, REF NODE=9000, SURFACE=UP\n*KINEMATIC",
                   loads="9000, 1, 1, 0.003\n9000, 6, 6, 0.01\n*CLOAD\n9000, 3, -60.\n9000, 5, 4.")

    def test_an_equation_with_the_rot_node(self):
        """A node of its own turns the body through an equation."""
        twist = "*NODE\n9002, 0., 0., 0.\n*EQUATION\n2\n9002, 1, 1., {}, -1.\n"
        body = WHOLE + "\n" + twist
        found = [
            solved(self, held=CLAMPED, body=body.format(term),
                   loads="9000, 1, 3, -0.01\n9001, 1, 2\n*CLOAD\n9002, 1, 2.", mu=0.3)
            for term in ("9001, 3", "9000, 6")
        ]
        np.testing.assert_array_equal(*[one.field("displacement", -1) for one in found])
        self.assertGreater(reference(found[0])["rotation"][2], 1e-4)


class Runs(unittest.TestCase):
    """What else a run may be asked for."""

    def test_flat(self):
        run = Run(text(**OFF_CENTRE), "--flat", name="case")
        self.assertEqual(run.status, 0, run.errors)
        result = [solved(self, **OFF_CENTRE), solved(self, deck=run.output)]
        np.testing.assert_array_equal(*[one.field("displacement", -1) for one in result])

    def test_continued(self):
        whole = solved(self, **OFF_CENTRE)
        run = Run(text(**OFF_CENTRE), "--continue", name="case", ended_at=("1", "1"))
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            np.testing.assert_array_equal(result.field("displacement", -1),
                                          whole.field("displacement", -1))

    def test_refined(self):
        """All nodes of the finer mesh are rigid; the finer block is softer."""
        for body in (WHOLE, WHOLE.replace("ELSET", "NSET")):
            with self.subTest(body):
                result = solved(self, "--refine", "1", **{**OFF_CENTRE, "body": body})
                end = reference(result)
                x = result.points
                rigid = x[:, 2] > HEIGHT
                wanted = end["displacement"] + np.cross(end["rotation"], x[rigid] - [1.0, 1.0, 1.0])
                np.testing.assert_allclose(result.field("displacement", -1)[rigid], wanted,
                                           atol=1e-12)
                self.assertGreater(rigid.sum(), 30)
                coarse = reference(solved(self, **OFF_CENTRE))
                self.assertLess(end["displacement"][2], coarse["displacement"][2])

    def test_an_accuracy(self):
        """Blocks alone have no nodes of a deck: the meshes may be chosen."""
        result = solved(self, "--accuracy", "0.05", "--nlgeom", "no", **OFF_CENTRE)
        coarse = reference(solved(self, **OFF_CENTRE))
        self.assertLess(reference(result)["displacement"][2], coarse["displacement"][2])

    def test_a_body_without_a_reference_node(self):
        """Its rotation is prescribed by the ROT NODE; it moves as it likes, for nothing presses."""
        body = WHOLE.replace("REF NODE=9000, ", "")
        result = solved(self, body=body, mu=0.5, held=CLAMPED,
                        loads="9001, 1, 3\n*DSLOAD\nUP-ZMAX, P, 1.")
        pair = next(iter(result.pairs.values()))
        np.testing.assert_allclose(np.abs(pair.resultant[-1]), [0.0, 0.0, 4.0], atol=1e-7)

    def test_a_table_leaves_out_the_rot_node(self):
        run = Run(text(**{**OFF_CENTRE, "loads": OFF_CENTRE["loads"] +
                          "\n*NODE PRINT, NSET=BOTH\nU, RF"}), name="case")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("*NODE PRINT of 'BOTH' leaves out ROT NODEs", run.output)


class LargeTurns(unittest.TestCase):
    """With NLGEOM a body turns by any angle."""

    QUARTER = np.pi / 2

    def check_pattern(self, result, at):
        """Hold the nodes of the plate against the rotation vector."""
        end = reference(result)
        x = result.points
        rigid = x[:, 2] > HEIGHT + 1e-6
        turned = Rotation.from_rotvec(end["rotation"]).apply(x[rigid] - at)
        np.testing.assert_allclose(x[rigid] + result.field("displacement", -1)[rigid],
                                   at + end["displacement"] + turned, atol=1e-11)

    def tray(self, turn, static="0.05, 1."):
        """An elastic block LOW under a rigid tray, pressed to it from below, and turned with it."""
        return solved(self, step=", NLGEOM", mu=0.5, static="1., 1.", held="9000, 1, 6",
                      loads="*DSLOAD\nLOW-ZMIN, P, 5.\n*END STEP\n*STEP, NLGEOM\n*STATIC\n"
                      f"{static}\n*BOUNDARY\n{turn}")

    def test_a_quarter_turns_contact_forces(self):
        """The pressure follows the block, which friction holds to the tray."""
        result = self.tray(f"9001, 1, 1, {self.QUARTER!r}")
        pair = next(iter(result.pairs.values()))
        first = pair.resultant[0]
        # Of the pressed block the area is larger by 2 nu p / E.
        np.testing.assert_allclose(first, [0.0, 0.0, -20.06], atol=0.01)
        turned = Rotation.from_rotvec([self.QUARTER, 0.0, 0.0]).apply(first)
        np.testing.assert_allclose(pair.resultant[-1], turned, atol=1e-4)
        self.check_pattern(result, [1.0, 1.0, 1.0])
        np.testing.assert_allclose(reference(result)["rotation"], [self.QUARTER, 0, 0], atol=1e-12)

    def test_both_sides_turn_together(self):
        """The block's foot goes with a coupling, the plate with it, about a place beside both: the
        forces turn, and what the rigid plate's elements are out of balance by is rounding."""
        foot = WHOLE + ("\n*NODE\n9002, -3., 1., 2.\n*COUPLING, CONSTRAINT NAME=FOOT, "
                        "REF NODE=9002, SURFACE=LOW-ZMIN\n*KINEMATIC\n1, 6")
        turn = [0.004, 0.001, -0.01]
        vector = "\n".join(f"9001, {k}, {k}, {w}\n9002, {k + 3}, {k + 3}, {w}"
                           for k, w in enumerate(turn, 1))
        # The plate is pressed in by 0.02; as it turns that turns, too: in one increment.
        pressed = Rotation.from_rotvec(turn).apply([0.0, 0.0, -0.02])
        then = "\n".join(f"9000, {k}, {k}, {u!r}" for k, u in enumerate(pressed.tolist(), 1))
        result = solved(self, step=", NLGEOM", mu=0.5, body=foot, at="-3., 1., 2.",
                        static="1., 1.", held="9000, 1, 6\n9002, 1, 6\n9000, 3, 3, -0.02",
                        loads="*END STEP\n*STEP, NLGEOM\n*STATIC, DIRECT\n*BOUNDARY\n"
                        f"{then}\n{vector}")
        pair = next(iter(result.pairs.values()))
        turned = Rotation.from_rotvec(turn).apply(pair.resultant[0])
        np.testing.assert_allclose(pair.resultant[-1], turned, atol=1e-5 * np.abs(turned).max())

    def test_a_moment_turns_a_plate(self):
        """The plate is free about y: what turns it is the moment that holds it where it is."""
        common = {"step": ", NLGEOM", "held": CLAMPED, "static": "0.25, 1.",
                  "body": "*RIGID BODY, NSET=LOW-ZMAX, REF NODE=9000, ROT NODE=9001",
                  "plate": "5., 5., 5., 1., 1., 1.", "pair": "UP-ZMIN, LOW-ZMAX"}
        rest = "UP-ZMAX, 1, 3\n9001, 1, 1\n9001, 3, 3\n"
        led = solved(self, loads=rest + "9001, 2, 2, 0.1\n9000, 1, 3", **common)
        moment = reference(led)["reaction_moment"][1]
        pushed = solved(self, loads=rest + f"9000, 1, 3\n*CLOAD\n9001, 2, {moment!r}", **common)
        self.assertAlmostEqual(reference(pushed)["rotation"][1], 0.1, delta=1e-5)

    def test_a_free_plate_turns_on_a_smooth_block(self):
        """Under a uniform pressure it stays as deep as it is, whichever way it stands."""
        found = []
        for turn in (0.0, self.QUARTER):
            held = f"{ClosedForms.HELD}\n9001, 1, 2\n9001, 3, 3, {turn!r}"
            result = solved(self, step=", NLGEOM", static="0.2, 1.", held=held,
                            plate="-0.5, -0.5, 1., 3., 3., 0.5", loads="*CLOAD\n9000, 3, -40.")
            self.check_pattern(result, [1.0, 1.0, 1.0])
            pair = next(iter(result.pairs.values()))
            np.testing.assert_allclose(pair.resultant[-1], [0.0, 0.0, -40.0], atol=1e-5)
            found.append(reference(result)["displacement"][2])
        self.assertAlmostEqual(found[0], -40.0 * HEIGHT / (YOUNG * SIDE**2), delta=2e-4)
        self.assertAlmostEqual(found[1], found[0], delta=1e-6)

    def test_free_plates_under_forces_and_moments(self):
        """Held by contact alone, as master and as slave; small loads do what small strain says."""
        loads = "*CLOAD\n9000, 3, -0.4\n9001, 1, 0.03\n9001, 2, -0.05"
        for pair in ("LOW-ZMAX, UP-ZMIN", "UP-ZMIN, LOW-ZMAX"):
            with self.subTest(pair):
                found = [
                    reference(solved(self, mu=0.3, cuts=3, element="C3D8I", step=step,
                                     held=CLAMPED, loads=loads, pair=pair))
                    for step in ("", ", NLGEOM")
                ]
                for name in ("displacement", "rotation"):
                    np.testing.assert_allclose(found[1][name], found[0][name], rtol=5e-3, atol=1e-7)
                self.assertGreater(np.abs(found[0]["rotation"][:2]).min(), 1e-5)

    def test_more_points_than_ways_to_move(self):
        """A rigid plate with 16 points on one soft element, which lies on a floor: it is stable."""
        floor = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n*STEP"
        deck = text(mu=0.5, cuts=3, step=", NLGEOM", held="9000, 1, 2\n9001, 3, 3",
                    pair="UP-ZMIN, LOW-ZMAX\nLOW-ZMIN, FLOOR", loads="*CLOAD\n9000, 3, -40.")
        deck = deck.replace("NX=3, NY=3, NZ=2", "NX=1, NY=1, NZ=1").replace("*STEP", floor, 1)
        result = solved(self, deck=deck)
        for pair in result.pairs.values():
            np.testing.assert_allclose(np.abs(pair.resultant[-1]), [0.0, 0.0, 40.0], atol=1e-5)


if __name__ == "__main__":
    unittest.main()
