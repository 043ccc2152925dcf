"""Bodies solved for by iteration beside bodies with a factor, and what iteration refuses.

BIPOT_LONG=1 runs some longer scenes, too.
"""

import os
import re
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from agreement import AUTO, ITERATIVE, LONG, NOT_SOLVED, WRONG_INPUT, Agreement
from launching import (
    INPUT,
    PROGRAM,
    Run,
    check_end,
    forces,
    launch,
    ranks_of,
    with_card,
)

HELD_ABOVE = """*HEADING
A block that is held above, before an obstacle
*BLOCK, NAME=BODY, ELSET=BODY, TYPE=C3D8, NX=5, NY=4, NZ=4
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*OBSTACLE, NAME=TOOL, TYPE={kind}
{shape}
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, TOOL
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP
*STATIC, DIRECT
0.5, 1.0
*BOUNDARY
BODY-ZMAX, 1, 1, 0.02
BODY-ZMAX, 2, 2, {aside}
BODY-ZMAX, 3, 3, -0.03
*END STEP
"""

MESHED = """*HEADING
The mesh by Gmsh of a punch and its base, both held below, each before a plane of its own
*PARAMETER
element = C3D8
*INCLUDE, INPUT={mesh}
*MATERIAL, NAME=STEEL
*ELASTIC
210000., 0.3
*MATERIAL, NAME=ALUMINIUM
*ELASTIC
70000., 0.3
*SOLID SECTION, ELSET=PUNCH, MATERIAL=STEEL
*SOLID SECTION, ELSET=BASE, MATERIAL=ALUMINIUM
*OBSTACLE, NAME=ABOVE, TYPE=PLANE
0., 0., 0.,  0.02, 0., -1.
*OBSTACLE, NAME=BELOW, TYPE=PLANE
0., 0., 0.,  0., 0.01, 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=DRY
BASE-TOP, ABOVE
*CONTACT PAIR, INTERACTION=DRY
PUNCH-SOLE, BELOW
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP
*STATIC, DIRECT
0.5, 1.0
*BOUNDARY
BASE-BOTTOM, 1, 2, 0.
BASE-BOTTOM, 3, 3, 0.01
PUNCH-TOP, 1, 1, 0.005
PUNCH-TOP, 2, 2, 0.
PUNCH-TOP, 3, 3, -0.02
*END STEP
"""


FREE = """*HEADING
A block that nothing supports, on a slope, and what comes down on it
*PARAMETER
n = 4
steps = 2
gap = 0.
up = -1.
aside = 0.
mu = 0.4
press = 0.
*NODE
9001, 0.5, 0.5, 2.
*BLOCK, NAME=BODY, ELSET=BODY, TYPE=C3D8, NX=<n>, NY=<n>, NZ=<n>
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=RUBBER
*DENSITY
1.
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=BODY, MATERIAL=RUBBER
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., <-gap>,  0.05, 0., 1.
*OBSTACLE, NAME=TOOL, TYPE=PLANE, REF NODE=9001
0., 0., <1.+gap>,  0., 0.02, -1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
<mu>
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMIN, GROUND
*CONTACT PAIR, INTERACTION=DRY
BODY-ZMAX, TOOL
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP
*STATIC, DIRECT
<1/steps>, 1.0
*DLOAD
BODY, GRAV, 10., <aside>, 0., <up>
*BOUNDARY
9001, 1, 1, <0.1*press>
9001, 2, 2, 0.
9001, 3, 3, <-press>
*END STEP
"""


LAYER = """*HEADING
A soft block between a plane and a stiff layer that is tied to it
*BLOCK, NAME=LOWER, ELSET=LOWER, TYPE=C3D8, NX=4, NY=4, NZ=3
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=UPPER, ELSET=UPPER, TYPE=C3D8, NX=3, NY=3, NZ=1
0., 0., 1.,  1., 1., 0.3
*MATERIAL, NAME=SOFT
*ELASTIC
9114., 0.25
*MATERIAL, NAME=STIFF
*ELASTIC
1.7e7, 0.
*SOLID SECTION, ELSET=LOWER, MATERIAL=SOFT
*SOLID SECTION, ELSET=UPPER, MATERIAL=STIFF
*OBSTACLE, NAME=GROUND, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.365
*CONTACT PAIR, INTERACTION=DRY
LOWER-ZMIN, GROUND
*TIE
UPPER-ZMIN, LOWER-ZMAX
*CONTACT SOLVER, TOLERANCE=1e-11
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
UPPER-ZMAX, 1, 1, 0.02
UPPER-ZMAX, 2, 2, 0.
UPPER-ZMAX, 3, 3, -0.03
*END STEP
"""


class SameForces(Agreement):
    def block(self, **overrides):
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        return self.agree(deck, **{"n": 6, "steps": 10, **AUTO, **overrides})

    def test_the_block(self):
        self.block()

    # 15; coarser levels that do not see what contact holds take 25.
    def test_its_iterations_stay_few_in_small_increments(self):
        self.block(n=8, steps=50, most=18)

    # 35; a smoother whose bounds are those of the levels as they were made takes 53. There are four
    # levels from here on.
    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_its_iterations_stay_few_with_four_levels(self):
        self.block(n=40, steps=10, most=42)

    # Newton's method alone goes to and fro between points that stick and slide: the way is gone in
    # parts.
    def test_friction_that_spreads_far_in_an_increment(self):
        run = self.block(steps=5, nu=0.495, mu=0.6)
        self.assertNotIn("from where smaller increments led", run.output)

    def test_an_increment_that_its_parts_lead_to(self):
        """Contact that a first increment does not solve for from rest, of a body that is soft."""
        soft = {"n": 3, "element": "C3D8B", "nu": 0.4999, **AUTO}
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        run = self.agree(deck, **soft)
        self.assertIn("solved only from where smaller increments led", run.errors + run.output)

    def test_without_friction(self):
        self.block(mu=0)

    def test_with_much_friction(self):
        self.block(mu=1.5)

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_incompatible_modes(self):
        self.block(element="C3D8I")

    def test_mean_dilatation(self):
        self.block(element="C3D8B", nu=0.4, steps=20)

    def test_a_quarter_between_planes_of_symmetry(self):
        self.agree((INPUT / "quarter.inp").read_text(encoding="utf-8"))

    def test_a_sphere(self):
        self.agree(HELD_ABOVE.format(kind="SPHERE", shape="0.5, 0.5, -3., 3.", aside="0."))

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_a_cylinder(self):
        shape = "0.5, 0., -3.,  0., 1., 0.,  3."
        self.agree(HELD_ABOVE.format(kind="CYLINDER", shape=shape, aside="0.01"))

    def test_a_plane_that_leans(self):
        shape = "0.5, 0.5, 0.,  0.1, 0.05, 1."
        self.agree(HELD_ABOVE.format(kind="PLANE", shape=shape, aside="0.01"))

    def test_two_bodies_of_a_mesh_by_gmsh(self):
        self.agree(MESHED.format(mesh=INPUT / "meshes" / "punch.inp"))

    # All nodes of the layer that supports leave are tied: what supports do acts on their masters.
    def test_a_stiff_layer_that_is_tied(self):
        self.agree(LAYER)


class FreeBodies(Agreement):
    """Bodies that contact and friction alone hold."""

    def test_on_a_slope(self):
        self.agree(FREE)

    def test_its_iterations_stay_few(self):
        self.agree(FREE, n=8, most=60)

    def test_it_falls_far_and_slides_to_its_place(self):
        self.agree(FREE, gap=0.5, aside=0.2)

    def test_pressed_between_two_planes(self):
        self.agree(FREE, press=0.03)

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_pressed_after_a_gap_by_a_tool_that_moves_aside(self):
        self.agree(FREE, press=0.05, gap=0.01)

    def test_on_a_round_obstacle_with_friction(self):
        deck = FREE.replace("*CONTACT PAIR, INTERACTION=DRY\nBODY-ZMAX, TOOL\n", "")
        deck = deck.replace("NAME=GROUND, TYPE=PLANE", "NAME=GROUND, TYPE=CYLINDER")
        deck = deck.replace("0., 0., <-gap>,  0.05, 0., 1.", "0.5, 0., -20.,  0., 1., 0.,  20.")
        self.agree(deck, mu=0.1, aside=0.09)

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_two_beside_one_that_supports_hold(self):
        deck = FREE.replace(
            "*MATERIAL",
            "*BLOCK, NAME=OTHER, ELSET=OTHER, NX=3, NY=4, NZ=3\n3., 0., -0.15,  1., 1., 0.7\n"
            "*BLOCK, NAME=HELD, ELSET=HELD, NX=4, NY=3, NZ=3\n6., 0., -0.3,  1., 1., 1.\n*MATERIAL",
            1,
        )
        for name in ("OTHER", "HELD"):
            deck = deck.replace(
                "*OBSTACLE", f"*SOLID SECTION, ELSET={name}, MATERIAL=RUBBER\n*OBSTACLE", 1
            )
            pair = f"*CONTACT PAIR, INTERACTION=DRY\n{name}-ZMIN, GROUND\n"
            deck = deck.replace("*CONTACT SOLVER", f"{pair}*CONTACT SOLVER", 1)
        deck = deck.replace("*DLOAD\n", "*DLOAD\nOTHER, GRAV, 20., 0.1, 0., -1.\n")
        held = "HELD-ZMAX, 1, 2, 0.\nHELD-ZMAX, 3, 3, -0.03\n"
        deck = deck.replace("*BOUNDARY\n", f"*BOUNDARY\n{held}")
        self.agree(deck)

    def test_without_friction_where_nothing_drives_it_aside(self):
        self.agree((INPUT / "rest.inp").read_text(encoding="utf-8"))

    def test_supports_that_leave_one_motion(self):
        self.agree((INPUT / "hertz.inp").read_text(encoding="utf-8"), n=6, tolerance=1e-11)

    def test_friction_that_all_but_slides(self):
        deck = (INPUT / "slope.inp").read_text(encoding="utf-8")
        self.agree(deck, margin=-1e-3, tolerance=1e-11)

    def test_what_nothing_balances_is_told_as_with_a_factor(self):
        slope = (INPUT / "slope.inp").read_text(encoding="utf-8")
        no_tool = FREE.replace("*CONTACT PAIR, INTERACTION=DRY\nBODY-ZMAX, TOOL\n", "")
        for name, deck, overrides in (
            ("it flies off", no_tool, {"up": 1.0}),
            ("it slides without friction", no_tool, {"mu": 0}),
            ("friction is too little", slope, {"margin": 0.01}),
            ("nothing is there", (INPUT / "fall.inp").read_text(encoding="utf-8"), {}),
        ):
            with self.subTest(name):
                runs = [
                    Run(with_card(deck, f"*BODY SOLVER, TYPE={kind}"), name="free", **overrides)
                    for kind in ("FACTOR", "ITERATIVE")
                ]
                self.assertEqual([run.status for run in runs], [NOT_SOLVED, NOT_SOLVED])
                self.assertIn("nothing balances the loads along", runs[0].errors)
                # Of several directions that nothing balances either may be named.
                told = [re.sub(r"(\(of node \d+\)): .*", r"\1", run.errors) for run in runs]
                self.assertEqual(*told)


class Continued(unittest.TestCase):
    def test_a_continued_run_has_the_forces_of_one_that_was_not(self):
        self.continue_at_increment_7(
            with_card((INPUT / "block.inp").read_text(encoding="utf-8"), ITERATIVE),
            {"n": 4, "steps": 20, **AUTO},
        )

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_so_has_that_of_a_free_body(self):
        self.continue_at_increment_7(
            with_card(FREE, ITERATIVE), {"n": 4, "steps": 20, "aside": 0.2}
        )

    def continue_at_increment_7(self, deck, options):
        """Compare a run of 20 increments with one that is stopped behind its seventh."""
        whole = Run(deck, name="whole", **options)
        self.assertEqual(whole.status, 0, whole.errors)
        # Its first increments, then the others.
        run = Run(deck, "--plan", name="whole", **options)
        command = [PROGRAM, str(run.deck)]
        for key, value in options.items():
            command += ["--set", f"{key}={value}"]
        with subprocess.Popen(
            command, cwd=run.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            for line in process.stdout:
                if "7 of 20" in line:
                    process.send_signal(signal.SIGTERM)
                    break
            process.communicate(timeout=600)
        subprocess.run(
            [*command, "--continue"], cwd=run.folder, timeout=600, check=True, capture_output=True
        )
        expected, found = forces(whole), forces(run)
        self.assertEqual(expected.keys(), found.keys())
        for name, values in expected.items():
            largest = max(abs(values).max(), 1e-300)
            np.testing.assert_allclose(
                found[name], values, rtol=0, atol=1e-10 * largest, err_msg=name
            )

    def test_a_run_has_the_same_bits_again(self):
        deck = with_card((INPUT / "block.inp").read_text(encoding="utf-8"), ITERATIVE)
        one, other = (Run(deck, name="same", n=4, steps=10, **AUTO) for _ in range(2))
        for name, values in forces(one).items():
            np.testing.assert_array_equal(forces(other)[name], values, err_msg=name)


class Chosen(unittest.TestCase):
    def plan_within(self, megabytes, *cards):
        """The lines `memory` and `chosen` of the plan within so many megabytes of addresses."""
        text = (INPUT / "block.inp").read_text(encoding="utf-8")
        for card in cards:
            text = with_card(text, card)
        limited = ("sh", "-c", f'ulimit -v {1000 * megabytes}; exec "$@"', "sh", PROGRAM)
        run = Run(text, "--plan", "--force", name="plan", command=limited, n=24, steps=5, **AUTO)
        self.assertEqual(run.status, 0, run.errors)
        lines = dict(line.split(maxsplit=1) for line in run.output.splitlines() if " " in line)
        return lines["memory"], lines.get("chosen", "")

    # The factor fits in double precision, in single precision, on the disk, and not at all.
    def test_a_factor_as_long_as_it_is_in_memory(self):
        found = {}
        for megabytes in range(1200, 600, -60):
            memory, chosen = self.plan_within(megabytes)
            kind = re.sub(r"\d[\d.]* ", "", chosen.strip())
            found.setdefault(kind, (megabytes, memory))
        kinds = list(found)
        self.assertEqual(kinds[0], "")
        self.assertTrue(any("single precision, in core" in kind for kind in kinds), kinds)
        by_iteration = [kind for kind in kinds if kind.startswith("by iteration: a share of")]
        self.assertEqual(len(by_iteration), 1, kinds)
        # A deck that names the factor gets it, and a run that has little room for either takes
        # what needs less.
        at = found[by_iteration[0]][0]
        card = "*BODY SOLVER, TYPE=FACTOR"
        self.assertIn("out of core", self.plan_within(at, card)[1])
        self.assertIn("out of core", kinds[-1])


class Refused(unittest.TestCase):
    def refused(self, deck, words, *options, status=WRONG_INPUT, **overrides):
        run = Run(with_card(deck, ITERATIVE), *options, name="refused", **overrides)
        self.assertEqual(run.status, status, run.errors)
        self.assertIn(words, run.errors)
        self.assertIn("TYPE=FACTOR", run.errors)
        return run

    def read(self, name):
        return (INPUT / f"{name}.inp").read_text(encoding="utf-8")

    def test_nodes_before_two_obstacles(self):
        deck = self.read("corner").replace("*STEP", "*BOUNDARY\nCUBE-ZMAX, 1, 3, 0.\n*STEP", 1)
        self.refused(deck, "two obstacles")

    def test_sweeps(self):
        self.refused(self.read("block"), "SOLVER=SWEEPS")

    def test_an_obstacle_that_moves_freely(self):
        self.refused(self.read("ball"), "obstacles that move freely")

    def test_a_body_that_may_turn_on_a_round_obstacle(self):
        shape = "0.5, 0.5, -3., 3."
        deck = HELD_ABOVE.format(kind="SPHERE", shape=shape, aside="0.")
        deck = deck.replace("*FRICTION\n0.3", "*FRICTION\n0.")
        deck = deck.replace("BODY-ZMAX, 1, 1, 0.02\nBODY-ZMAX, 2, 2, 0.\n", "")
        self.refused(deck, "free to turn or slide on a round obstacle", status=NOT_SOLVED)

    def test_what_does_not_converge_says_so(self):
        soft = {"n": 3, "element": "C3D8B", "nu": 0.49999, **AUTO}
        run = self.refused(self.read("block"), "by iteration", status=NOT_SOLVED, **soft)
        self.assertNotIn("certified to", run.output)


class SeveralRanks(Agreement):
    """Each rank has the rows of some nodes; the forces are those of a factor on one rank."""

    def test_the_block(self):
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        for ranks in (2, 3, 4) if LONG else (2,):
            with self.subTest(ranks=ranks):
                self.agree(deck, ranks=ranks, n=6, steps=10, **AUTO)

    def test_stiffness_across_the_border(self):
        """Sweeps that leave out what other ranks have do not converge by themselves here."""
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        self.agree(deck, ranks=2, element="C3D8B", nu=0.4, n=6, steps=5, **AUTO)

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_its_iterations_stay_few(self):
        deck = (INPUT / "block.inp").read_text(encoding="utf-8")
        self.agree(deck, ranks=2, most=45, n=8, steps=10, **AUTO)

    def test_two_bodies_of_a_mesh_by_gmsh(self):
        self.agree(MESHED.format(mesh=INPUT / "meshes" / "punch.inp"), ranks=2)

    def test_a_free_body(self):
        self.agree(FREE, ranks=2)

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_a_free_body_between_two_planes(self):
        self.agree(FREE, ranks=4, press=0.03)

    @unittest.skipUnless(LONG, "with BIPOT_LONG")
    def test_a_sphere(self):
        deck = HELD_ABOVE.format(kind="SPHERE", shape="0.5, 0.5, -3., 3.", aside="0.")
        self.agree(deck, ranks=4)

    def test_tied_bodies(self):
        """What a node depends on may be another rank's."""
        deck = (INPUT / "bracket.inp").read_text(encoding="utf-8")
        self.agree(deck, ranks=4 if LONG else 2, tolerance=1e-11)

    def test_a_killed_rank_ends_the_run(self):
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "block.inp"
            text = (INPUT / "block.inp").read_text(encoding="utf-8")
            deck.write_text(with_card(text, ITERATIVE), encoding="utf-8")
            command = [*launch(2), str(deck), "--overwrite", "--set", "n=8", "--set", "steps=200"]
            command += ["--set", "solver=AUTO", "--set", "local=AUTO"]
            for victim in (0, 1):
                with self.subTest(victim=victim):
                    running = subprocess.Popen(
                        command,
                        cwd=folder,
                        text=True,
                        stdout=subprocess.PIPE,
                        stderr=subprocess.STDOUT,
                    )
                    self.addCleanup(running.kill)
                    ranks = ranks_of(running, deck.with_suffix(".vtkhdf"))
                    os.kill(ranks[victim], signal.SIGKILL)
                    output = check_end(running, ranks)
                    self.assertEqual(running.returncode, 128 + signal.SIGKILL)
                    self.assertIn("signal 9 (Killed)", output)
                    deck.with_suffix(".vtkhdf").unlink()


if __name__ == "__main__":
    unittest.main()
