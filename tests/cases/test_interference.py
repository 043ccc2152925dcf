"""*CONTACT INTERFERENCE: an overlap that is allowed for a time.

By hand: two bars of height 1, Young's modulus 1000, no Poisson's ratio and cross-section 1, held at
their far ends, of which the upper one overlaps the lower by d. Where e of it is allowed, both bars
are shortened by d - e together: the force is 1000 (d - e)/2.
"""

import unittest

import numpy as np
from program import ASKED, Run

DECK = """\
*PARAMETER
at = 0.98
n = 4
poisson = 0
mu = 0.3
*BLOCK, NAME=LOW, NX=3, NY=3, NZ=2
0., 0., 0., 1., 1., 1.
*BLOCK, NAME=UP, NX=4, NY=4, NZ=2
0., 0., <at>, 1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., <poisson>
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=I{sliding}
UP-ZMIN, LOW-ZMAX
*AMPLITUDE, NAME=RISE
0., 0., 1., 1.
*AMPLITUDE, NAME=KINK
0., 0., 0.35, 1., 1., 0.5
*STEP
*STATIC{direct}
<1/n>, 1.
*BOUNDARY
LOW-ZMIN, 1, 3
UP-ZMAX, 1, 3
{card}
*END STEP
{more}"""
SHRINK = "*CONTACT INTERFERENCE, SHRINK\nUP-ZMIN, LOW-ZMAX"
KINK = "*CONTACT INTERFERENCE, AMPLITUDE=KINK\nUP-ZMIN, LOW-ZMAX, -0.02"
SLIDINGS = ("", ", SMALL SLIDING")


def deck(card=SHRINK, sliding="", direct=", DIRECT", more=""):
    """Give the deck with another card, and steps behind it."""
    return DECK.format(card=card, sliding=sliding, direct=direct, more=more)


def history(run):
    """Return times, normal forces and what is allowed at the first point."""
    assert run.status == 0, run.output + run.errors
    with run.result() as result:
        (pair,) = result.pairs.values()
        forces = np.asarray(pair.resultant)
        allowed = np.asarray(pair.allowed_interference)
        np.testing.assert_allclose(allowed, allowed[:, :1] + 0*allowed, atol=1e-14)
        return result.history("time"), forces[:, 2], allowed[:, 0]


class Bars(unittest.TestCase):
    """The force of two bars."""

    def test_a_shrink_fit_grows_over_the_step(self):
        for sliding in SLIDINGS:
            for n in (1, 2, 10):
                with self.subTest(sliding=sliding, n=n):
                    time, force, allowed = history(Run(deck(sliding=sliding), name="bars", n=n))
                    self.assertEqual(len(time), n)
                    np.testing.assert_allclose(force, 10*time, atol=2e-7)
                    np.testing.assert_allclose(allowed, 0.02*(1 - time), atol=1e-14)

    def test_a_given_interference_fades(self):
        card = "*CONTACT INTERFERENCE\nUP-ZMIN, LOW-ZMAX, 0.012"
        for sliding in SLIDINGS:
            with self.subTest(sliding=sliding):
                time, force, allowed = history(Run(deck(card, sliding), name="bars"))
                np.testing.assert_allclose(allowed, 0.012*(1 - time), atol=1e-14)
                np.testing.assert_allclose(force, 500*(0.02 - allowed), atol=2e-7)

    def test_what_is_allowed_beyond_the_overlap_is_no_contact(self):
        card = "*CONTACT INTERFERENCE\nUP-ZMIN, LOW-ZMAX, 0.06"
        time, force, _ = history(Run(deck(card), name="bars"))
        np.testing.assert_allclose(force, 500*np.maximum(0, 0.02 - 0.06*(1 - time)), atol=2e-7)

    def test_increments_end_at_the_breakpoints_of_the_amplitude(self):
        for sliding in SLIDINGS:
            with self.subTest(sliding=sliding):
                time, force, _ = history(Run(deck(KINK, sliding, ""), name="bars", at=1.0))
                np.testing.assert_allclose(time, [0.25, 0.35, 0.5, 0.75, 1.0], atol=1e-9)
                np.testing.assert_allclose(force, 10*np.interp(time, [0, 0.35, 1], [0, 1, 0.5]),
                                           atol=2e-7)

    def test_an_increment_ends_where_the_gap_closes(self):
        # A gap of 0.1, of which 0.12 are taken away: contact begins at 5/6 of the step.
        card = "*CONTACT INTERFERENCE, AMPLITUDE=RISE\nUP-ZMIN, LOW-ZMAX, -0.12"
        for sliding in SLIDINGS:
            with self.subTest(sliding=sliding):
                time, force, _ = history(Run(deck(card, sliding, ""), name="bars", at=1.1))
                np.testing.assert_allclose(time, [0.25, 0.5, 0.75, 5/6, 1.0], atol=1e-6)
                np.testing.assert_allclose(force, [0, 0, 0, 0, 10], atol=1e-5)

    def test_later_steps_keep_replace_and_end_it(self):
        more = "".join(f"*STEP\n*STATIC, DIRECT\n1., 1.\n{card}*END STEP\n" for card in (
            "", "*CONTACT INTERFERENCE, AMPLITUDE=RISE\nUP-ZMIN, LOW-ZMAX, -0.03\n",
            "*CONTACT INTERFERENCE, OP=NEW\n"))
        run = Run(deck(KINK, more=more), name="bars", at=1.0)
        time, force, allowed = history(run)
        np.testing.assert_allclose(time[-4:], [1, 2, 3, 4])
        np.testing.assert_allclose(allowed[-4:], [-0.01, -0.01, -0.03, 0], atol=1e-14)
        np.testing.assert_allclose(force[-4:], [5, 5, 15, 0], atol=2e-7)

    def test_an_amplitude_over_the_time_of_the_run_goes_on(self):
        card = KINK.replace("KINK", "LONG")
        more = "*STEP\n*STATIC, DIRECT\n0.25, 0.5\n*END STEP\n"
        long = "*AMPLITUDE, NAME=LONG, TIME=TOTAL TIME\n0., 0., 2., 2.\n*STEP"
        text = deck(card, more=more).replace("*STEP", long, 1)
        time, force, _ = history(Run(text, name="bars", at=1.0))
        np.testing.assert_allclose(time, [0.25, 0.5, 0.75, 1, 1.25, 1.5])
        np.testing.assert_allclose(force, 10*time, atol=2e-7)

    def test_the_energy_of_the_bars_is_what_the_interference_does(self):
        for sliding in SLIDINGS:
            for text, at in ((deck(sliding=sliding), 0.98), (deck(KINK, sliding, ""), 1.0)):
                run = Run(text, name="bars", at=at, mu=0)
                self.assertEqual(run.status, 0, run.errors)
                with run.result() as result:
                    (pair,) = result.pairs.values()
                    force = np.asarray(pair.resultant)[:, 2]
                    strain = result.history("energy/strain")
                    np.testing.assert_allclose(strain, force**2/1000, atol=1e-8)
                    np.testing.assert_allclose(result.history("energy/external_work"), strain,
                                               atol=1e-8)

    def test_with_friction_two_increments_lead_where_ten_do(self):
        # Overlaps that grow in proportion have reactions that do, but for what sliding changes.
        ends = []
        for n in (2, 10):
            run = Run(deck(sliding=", SMALL SLIDING"), name="bars", n=n, poisson=0.3, mu=0.1)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                (pair,) = result.pairs.values()
                ends.append(np.asarray(pair.reaction)[-1])
        self.assertGreater(abs(ends[0][:, 1:]).max(), 1e-3)
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)

    def test_it_is_solved_on_finer_meshes_and_with_an_accuracy(self):
        _, force, _ = history(Run(deck(), "--refine", "1", name="bars"))
        np.testing.assert_allclose(force[-1], 10.0, atol=2e-6)
        run = Run(deck(KINK, direct=""), *ASKED, "0.05", name="bars", at=1.0)
        _, force, _ = history(run)
        np.testing.assert_allclose(force[-1], 5.0, atol=1e-3)

    def test_the_flat_deck_has_it(self):
        run = Run(deck(), "--flat", name="bars")
        np.testing.assert_array_equal(history(Run(run.output, name="flat"))[1],
                                      history(Run(deck(), name="bars"))[1])

    def test_a_run_that_goes_on_ends_with_the_same_bits(self):
        for sliding in SLIDINGS:
            text = deck(sliding=sliding).replace("n = 4", "n = 64").replace("= 0\n", "= 0.3\n")
            whole = Run(text, name="bars")
            self.assertEqual(whole.status, 0, whole.errors)
            continued = Run(text, "--continue", name="bars", ended_at=("1", "3"))
            self.assertEqual(continued.status, 0, continued.errors)
            with continued.result() as one, whole.result() as other:
                for name in ("reaction", "gap", "slip", "allowed_interference"):
                    np.testing.assert_array_equal(getattr(one.pairs[0], name),
                                                  getattr(other.pairs[0], name))


LID = """\
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*NODE
900, 0.5, 0.5, 3.
*NSET, NSET=CORNER
27
{model}
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=LID, TYPE=PLANE, REF NODE=900
0., 0., 0.99, 0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
B-ZMAX, LID
{gaps}
*STEP{nlgeom}
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
B-ZMIN, 1, 3
900, 1, 3
{held}
{card}
*END STEP
"""
LID_SHRINK = "*CONTACT INTERFERENCE, SHRINK\nB-ZMAX, LID"


class Lid(unittest.TestCase):
    """A block below a lid that it overlaps: the end is that of the overlap at once."""

    def check(self, tolerance=1e-7, **changes):
        ends = []
        for card in (LID_SHRINK, ""):
            names = {"model": "**", "gaps": "**", "held": "**", "nlgeom": "", **changes}
            run = Run(LID.format(card=card, **names), name="lid")
            self.assertEqual(run.status, 0, run.output + run.errors)
            with run.result() as result:
                self.assertEqual(result.finished, 4)
                ends.append(result.pairs[0].resultant[-1])
        np.testing.assert_allclose(*ends, atol=tolerance)

    def test_a_plain_lid(self):
        self.check()

    def test_a_node_that_cannot_move_along_the_normal_keeps_its_overlap(self):
        self.check(held="CORNER, 3, 3")

    def test_nodes_that_hang(self):
        self.check(model="*REFINE, NSET=CORNER, TIMES=1")

    def test_gaps_beside_those_of_the_mesh(self):
        self.check(gaps="*CONTACT GAP\nB-ZMAX, -0.005")

    def test_finite_strain(self):
        self.check(1e-5, nlgeom=", NLGEOM")

    def test_a_note_says_what_overlaps_and_what_is_allowed(self):
        names = {"model": "**", "gaps": "**", "held": "**", "nlgeom": ""}
        run = Run(LID.format(card=LID_SHRINK, **names), "--plan", name="lid")
        self.assertIn("9 nodes of B-ZMAX:LID overlap before the first step, by up to 0.01 at node "
                      "19; at first *CONTACT INTERFERENCE allows 0.01 of it", run.output)


WALLS = """\
*PARAMETER
v = 0.01
n = 4
*BLOCK, NAME=BAR, NX=1, NY=1, NZ=4
0., 0., 0., 1., 1., 2.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=BAR, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE={floor}
*OBSTACLE, NAME=LID, TYPE=PLANE
0., 0., <2-v>, 0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
BAR-ZMIN, FLOOR
BAR-ZMAX, LID
*STEP{nlgeom}
*STATIC, DIRECT
<1/n>, 1.
*BOUNDARY
BAR-XMIN, 1, 1
BAR-YMIN, 2, 2
{support}*CONTACT INTERFERENCE, SHRINK
BAR-ZMIN, FLOOR
BAR-ZMAX, LID
*END STEP
"""
PLANE = "PLANE\n0., 0., 0., 0., 0., 1."


class Walls(unittest.TestCase):
    """A bar of length L between walls that are L - v apart has the stress E v/L."""

    def check(self, stress, tolerance, **names):
        names = {"floor": PLANE, "nlgeom": "", "support": "", **names}
        ends = []
        for n in (2, 10):
            run = Run(WALLS.format(**names), name="bar", n=n)
            self.assertEqual(run.status, 0, run.output + run.errors)
            with run.result() as result:
                force = [result.pairs[name].resultant[-1] for name in ("BAR-ZMIN:FLOOR",
                                                                       "BAR-ZMAX:LID")]
                np.testing.assert_allclose(force, [[0, 0, stress], [0, 0, -stress]],
                                           atol=tolerance)
                ends.append(force)
        np.testing.assert_allclose(*ends, atol=tolerance)

    def test_a_bar_that_nothing_else_holds(self):
        self.check(5.0, 1e-7)

    def test_a_floor_of_facets(self):
        facets = ("*NODE\n901, -1., -1., 0.\n902, 2., -1., 0.\n903, 2., 2., 0.\n904, -1., 2., 0.\n"
                  "905, 0., 0., 0.\n*ELEMENT, TYPE=R3D4, ELSET=TOOL\n901, 901, 902, 903, 904\n"
                  "*RIGID BODY, ELSET=TOOL, REF NODE=905\n*SURFACE, NAME=FLOOR\nTOOL, SPOS")
        text = WALLS.replace("*OBSTACLE, NAME=FLOOR, TYPE={floor}", facets)
        run = Run(text.format(nlgeom="", support="905, 1, 6\n"), name="bar")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            for pair in result.pairs.values():
                np.testing.assert_allclose(abs(np.asarray(pair.resultant)[:, 2]),
                                           5*result.history("time"), atol=1e-6)

    def test_at_finite_strain(self):
        # St Venant-Kirchhoff: the stretch l = 1 - v/L, the force E (l^2 - 1) l/2 a unit of area.
        stretch = 1 - 0.01/2
        force = 1000*(1 - stretch**2)*stretch/2
        held = "BAR-ZMIN, 3, 3\n"
        run = Run(WALLS.format(floor=PLANE, nlgeom=", NLGEOM", support=held), name="bar")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            pair = result.pairs["BAR-ZMAX:LID"]
            np.testing.assert_allclose(np.asarray(pair.resultant)[-1], [0, 0, -force], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
