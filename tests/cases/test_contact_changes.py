"""Contact that steps change: *CHANGE FRICTION and *MODEL CHANGE, on blocks of hand values."""

import unittest

import numpy as np
from program import Run


def block(*steps, mu=0.1, deck=""):
    """Return a block that is pressed on a plane by 4, its upper face led as the steps say."""
    text = f"""*HEADING
a block
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 2., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
{mu!r}
*CONTACT PAIR, INTERACTION=DRY
B-ZMIN, FLOOR
{deck}*STEP
*STATIC
1., 1.
*BOUNDARY
B-ZMAX, 1, 2
*DSLOAD
B-ZMAX, P, 1.
*END STEP
"""
    for cards in steps:
        text += f"*STEP\n*STATIC\n0.5, 1.\n{cards}*END STEP\n"
    return text


def change(mu, name="DRY"):
    """Return the cards that give a coefficient anew."""
    return f"*CHANGE FRICTION, INTERACTION={name}\n*FRICTION\n{mu!r}\n"


def drag(to):
    """Return the cards that lead the upper face along x."""
    return f"*BOUNDARY\nB-ZMAX, 1, 1, {to!r}\n"


REMOVE, ADD = "REMOVE", "ADD"
FLOOR, UPON = "B-ZMIN, FLOOR", "UP-ZMIN, LOW-ZMAX"
PLANE = "*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n0., 0., 0., 0., 0., 1.\n"
SPHERE = "*OBSTACLE, NAME=FLOOR, TYPE=SPHERE\n1., 1., -20., 20.\n"
FACETS = """*NODE
9001, -9., -9., 0.
9002, 9., -9., 0.
9003, 9., 9., 0.
9004, -9., 9., 0.
9005, 0., 0., -1.
*ELEMENT, TYPE=R3D4, ELSET=PLATE
9001, 9001, 9002, 9003, 9004
*RIGID BODY, ELSET=PLATE, REF NODE=9005
*SURFACE, NAME=FLOOR
PLATE, SPOS
*BOUNDARY
9005, 1, 3
"""
UNLIKE = "*OBSTACLE, NAME=OTHER, TYPE=PLANE\n0., 0., -1., 0., 0., 1.\n"


def turn(what, pair=FLOOR):
    """Return the card that removes or adds a pair."""
    return f"*MODEL CHANGE, TYPE=CONTACT PAIR, {what}\n{pair}\n"


def push(by, body="B"):
    """Return the cards that lead the upper face down."""
    return f"*BOUNDARY\n{body}-ZMAX, 1, 2\n{body}-ZMAX, 3, 3, {-by!r}\n"


def in_steps(text, steps, nlgeom):
    """Return a deck with steps of two increments each."""
    for cards in steps:
        text += f"*STEP{', NLGEOM' if nlgeom else ''}\n*STATIC\n0.5, 1.\n{cards}*END STEP\n"
    return text


def bar(*steps, nlgeom=False, obstacle=PLANE):
    """Return a bar of stiffness E A/h = 4000 that stands on an obstacle."""
    return in_steps(f"""*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 2., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
{obstacle}*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
B-ZMIN, FLOOR
""", steps, nlgeom)


def two(*steps, nlgeom=False, join="*CONTACT PAIR, INTERACTION=DRY"):
    """Return two such bars, one upon the other, whose meshes do not match."""
    return in_steps(f"""*BLOCK, NAME=LOW, NX=3, NY=3, NZ=2
0., 0., 0., 2., 2., 1.
*BLOCK, NAME=UP, NX=2, NY=2, NZ=2
0., 0., 1., 2., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=LOW, MATERIAL=M
*SOLID SECTION, ELSET=UP, MATERIAL=M
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
{join}
UP-ZMIN, LOW-ZMAX
*BOUNDARY
LOW-ZMIN, 1, 3
""", steps, nlgeom)


def ends_of(test, deck, axis, *options):
    """Return the sizes of a component of the force of the first pair where steps end."""
    run = Run(deck, *options, name="b")
    test.assertEqual(run.status, 0, run.output + run.errors)
    with run.result() as result:
        test.assertTrue(all(result.history("certified") == 1))
        return abs(np.array(result.pairs[0].resultant)[:, axis])[np.array(result.step_ends)]


def errors_of(test, deck, status=1):
    """Return the errors of a run that must fail."""
    run = Run(deck, name="b")
    test.assertEqual(run.status, status, run.output + run.errors)
    return run.errors


class Friction(unittest.TestCase):
    """The coefficient of a step holds from its beginning until another is given."""

    def test_a_dragged_block_has_the_friction_of_its_step(self):
        """It slides with mu times the force of 4, from and to 0 too."""
        for before, after in ((0.1, 0.5), (0.5, 0.1), (0.0, 0.3), (0.3, 0.0)):
            with self.subTest(before=before, after=after):
                run = Run(block(drag(0.1), change(after) + drag(0.2), drag(0.3), mu=before),
                          name="b")
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    pair = result.pairs[0]
                    force = abs(np.array(pair.resultant)[:, 0])
                    ends = np.array(result.step_ends)
                    self.assertEqual(list(pair.friction_coefficients[ends]),
                                     [before, before, after, after])
                    self.assertTrue(all(result.history("certified") == 1))
                np.testing.assert_allclose(
                    force[ends], [0, 4 * before, 4 * after, 4 * after], rtol=0, atol=1e-9)

    def test_less_friction_lets_a_sheared_block_slide_back(self):
        """Sheared by 0.001 it sticks with more than mu = 0.1 can hold."""
        force = ends_of(self, block(drag(0.001), change(0.1), mu=0.5), 0)
        self.assertGreater(force[1], 1.0)
        np.testing.assert_allclose(force[2], 0.4, rtol=0, atol=1e-9)

    def test_at_finite_strain_too(self):
        deck = block(drag(0.1), change(0.5) + drag(0.2)).replace("*STEP", "*STEP, NLGEOM")
        force = ends_of(self, deck, 0)
        np.testing.assert_allclose(force[1:], [0.4, 2.0], rtol=0.01)

    def test_each_interaction_has_its_own(self):
        """What is not named stays as it is."""
        force = ends_of(self, block(
            drag(0.1), change(0.5, "WET") + drag(0.2),
            deck=UNLIKE + "*SURFACE INTERACTION, NAME=WET\n*FRICTION\n0.2\n"
            "*CONTACT PAIR, INTERACTION=WET\nB-ZMIN, OTHER\n"), 0)
        np.testing.assert_allclose(force, [0, 0.4, 0.4], rtol=0, atol=1e-9)

    def test_each_error_has_one_message(self):
        for cards, message in (
            (change(0.5, "WET"), "no contact pair has a surface interaction 'WET'"),
            (change(0.5) + change(0.6), "has a *CHANGE FRICTION in this step already"),
            ("*CHANGE FRICTION, INTERACTION=DRY\n", "needs a *FRICTION below it"),
            ("*CHANGE FRICTION\n*FRICTION\n0.2\n", "needs INTERACTION="),
            ("*FRICTION\n0.3\n", "*FRICTION belongs before the first *STEP"),
            (change(-0.5), "must not be negative"),
        ):
            with self.subTest(cards):
                errors = errors_of(self, block(cards))
                self.assertEqual(errors.count(": error: "), 1, errors)
                self.assertIn(message, errors)


class Pairs(unittest.TestCase):
    """A pair that is removed does not press, and presses again where it is added."""

    def test_a_bar_springs_back_and_is_pressed_again(self):
        """4000 * 0.001 = 4 on the floor, 2000 * 0.002 = 4 between two bars; small strain."""
        for obstacle in (PLANE, FACETS):
            force = ends_of(self, bar(push(0.001), turn(REMOVE), turn(ADD), obstacle=obstacle), 2)
            np.testing.assert_allclose(force, [4, 0, 4], rtol=0, atol=1e-9)
        force = ends_of(self, two(push(0.002, "UP"), turn(REMOVE, UPON), turn(ADD, UPON)), 2)
        np.testing.assert_allclose(force, [4, 0, 4], rtol=0, atol=1e-9)

    def test_a_pair_that_is_added_late_presses_as_one_that_was_there(self):
        for obstacle, nlgeom in ((PLANE, True), (SPHERE, False), (SPHERE, True)):
            there = ends_of(self, bar(push(0.01), "", nlgeom=nlgeom, obstacle=obstacle), 2)
            late = ends_of(self, bar(push(0.01) + turn(REMOVE), turn(ADD), nlgeom=nlgeom,
                                     obstacle=obstacle), 2)
            self.assertEqual(late[0], 0)
            np.testing.assert_allclose(late[1], there[1], rtol=1e-6)
        late = ends_of(self, two(push(0.002, "UP") + turn(REMOVE, UPON), turn(ADD, UPON),
                                 nlgeom=True), 2)
        there = ends_of(self, two(push(0.002, "UP"), "", nlgeom=True), 2)
        np.testing.assert_allclose(late[1], there[1], rtol=1e-6)

    def test_what_is_removed_is_open_and_may_pass(self):
        """The bar goes 0.9 deep, where nothing resists it, and comes back."""
        for deck in (bar(push(0.001) + turn(REMOVE), push(0.9), push(0.001), turn(ADD)),
                     two(push(0.001, "UP") + turn(REMOVE, UPON), push(0.9, "UP"),
                         push(0.001, "UP"), turn(ADD, UPON))):
            run = Run(deck, name="b")
            self.assertEqual(run.status, 0, run.output + run.errors)
            with run.result() as result:
                pair = result.pairs[0]
                self.assertEqual(list(pair.is_removed), [True] * 6 + [False] * 2)
                gone = pair.is_removed
                self.assertFalse(np.any(pair.reaction[gone]))
                self.assertFalse(np.any(pair.status[gone]))
                self.assertTrue(np.all(pair.gap[gone] == 1e30))
                self.assertGreater(pair.reaction[-1, :, 0].sum(), 1)

    def test_deep_overlaps_are_refused_where_a_pair_is_added(self):
        """An element is 0.5 high."""
        for deck in (bar(push(0.1) + turn(REMOVE), push(0.9), turn(ADD)),
                     two(push(0.1, "UP") + turn(REMOVE, UPON), push(0.9, "UP"), turn(ADD, UPON))):
            self.assertIn("overlap", errors_of(self, deck, 2))

    def test_a_body_that_the_pair_alone_held_is_free(self):
        errors = errors_of(self, block(turn(REMOVE)), 2)
        self.assertIn("step 2, increment 1: nothing balances the loads", errors)

    def test_one_of_two_pairs_is_removed_alone(self):
        """The other obstacle is a distance of 0.1 below."""
        low = "*OBSTACLE, NAME=LOW, TYPE=PLANE\n0., 0., -0.1, 0., 0., 1.\n"
        deck = bar(push(0.2), turn(REMOVE)).replace("*SURFACE INTERACTION", low +
                                                     "*SURFACE INTERACTION")
        run = Run(deck.replace("B-ZMIN, FLOOR\n", "B-ZMIN, FLOOR\nB-ZMIN, LOW\n", 1), name="b")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            forces = [np.array(pair.resultant)[result.step_ends, 2]
                      for pair in result.pairs.values()]
        np.testing.assert_allclose(forces, [[800, 0], [0, 400]], rtol=0, atol=1e-6)

    def test_each_error_has_one_message(self):
        card = "*MODEL CHANGE, TYPE=CONTACT PAIR"
        twin = bar(turn(REMOVE)).replace("B-ZMIN, FLOOR\n", "B-ZMIN, FLOOR\nSOME, FLOOR\n", 1)
        twin = twin.replace("*MATERIAL", "*SURFACE, NAME=SOME, TYPE=NODE\nB-ZMIN\n*MATERIAL")
        for deck, message in (
            (bar("*MODEL CHANGE, TYPE=ELEMENT, REMOVE\nB\n"), "TYPE=ELEMENT is not available"),
            (bar(f"{card}\nB-ZMIN, FLOOR\n"), "needs either ADD or REMOVE"),
            (bar(f"{card}, ADD, REMOVE\nB-ZMIN, FLOOR\n"), "needs either ADD or REMOVE"),
            (bar("*MODEL CHANGE, REMOVE\nB-ZMIN, FLOOR\n"), "needs TYPE=CONTACT PAIR"),
            (bar(turn(REMOVE, "B-ZMIN, LID")), "no *CONTACT PAIR has the slave 'B-ZMIN'"),
            (bar(turn(REMOVE) + turn(ADD)), "has a *MODEL CHANGE in this step already"),
            (two(turn(REMOVE, UPON), join="*TIE, NAME=T"),
             "the tie of 'UP-ZMIN' and 'LOW-ZMAX' cannot end"),
            (twin, "share nodes"),
        ):
            with self.subTest(message):
                errors = errors_of(self, deck)
                self.assertLessEqual(errors.count("error: "), 1, errors)
                self.assertIn(message, errors)

    def test_what_changes_nothing_is_noted(self):
        run = Run(bar(push(0.001) + turn(ADD)), name="b")
        self.assertIn("changes nothing: it is there already", run.output)


class Runs(unittest.TestCase):
    """Continued and flat decks know it."""

    def test_continued_runs_have_the_same_bits(self):
        for deck in (block(drag(0.1), change(0.5) + drag(0.2), drag(0.3)),
                     two(push(0.002, "UP"), turn(REMOVE, UPON), turn(ADD, UPON)),
                     two(push(0.002, "UP"), turn(REMOVE, UPON), turn(ADD, UPON), nlgeom=True)):
            deck = deck.replace("0.5, 1.", "0.1, 1.")
            whole = Run(deck, name="b")
            for place in (("2", "2"), ("2", "9")):
                part = Run(deck, "--continue", name="b", ended_at=place)
                self.assertEqual(part.status, 0, part.errors)
                with whole.result() as one, part.result() as other:
                    for field in ("resultant", "slip", "gap", "status"):
                        np.testing.assert_array_equal(getattr(one.pairs[0], field),
                                                      getattr(other.pairs[0], field))

    def test_flat_decks_have_the_cards(self):
        for deck in (block(drag(0.1), change(0.5) + drag(0.2)),
                     bar(push(0.001), turn(REMOVE), turn(ADD))):
            flat = Run(deck, "--flat", name="b").output
            np.testing.assert_array_equal(ends_of(self, deck, 2), ends_of(self, flat, 2))


if __name__ == "__main__":
    unittest.main()
