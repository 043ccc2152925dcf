"""The tangent of every iteration at finite strain (*BODY SOLVER, TANGENT=NEWTON) beside KEPT."""

import unittest

import h5py
import numpy as np
from program import INPUT, Run

NEO = "*HYPERELASTIC, NEO HOOKE\n<{E}/(4*(1+nu))>, <6*(1-2*nu)/{E}>"
SOLVERS = [
    ("SWEEPS", formulation, local)
    for formulation in ("BIPOTENTIAL", "PSEUDOPOTENTIAL")
    for local in ("UZAWA", "NEWTON", "NEWTON6")
] + [("SWEEPS", "BIPOTENTIAL", "EXACT"), ("GLOBAL NEWTON", "BIPOTENTIAL", "AUTO")]


def block(tangent, law="NEO", e="210000", finite=True, down=None, **parameters):
    """Run the paper's block of two elements an edge, unless said otherwise; pressed by `down` alone
    where that is given."""
    text = (INPUT / "block.inp").read_text()
    if down:
        text = text.replace("3, 3, -0.1", f"3, 3, -{down}").replace("<5/steps>", "<1/steps>")
        text = text[: text.index("** Sideways")]
    text = text.replace("*CONTACT SOLVER", f"*BODY SOLVER, TANGENT={tangent}\n*CONTACT SOLVER")
    if finite:
        text = text.replace("*STEP\n", "*STEP, NLGEOM\n", 1)
    if law == "NEO":
        text = text.replace("*ELASTIC\n210000., <nu>", NEO.format(E=e))
    return Run(text, name="block", **{"n": 2, "steps": 20, **parameters})


def rubber(tangent, **parameters):
    """Run the block of rubber, pressed by a tenth and pushed by 15 % of its height."""
    text = (INPUT / "rubber.inp").read_text()
    text = text.replace("SOLVER=<solver>,", "SOLVER=<solver>, FORMULATION=<form>, LOCAL=<local>,")
    text = text.replace("*CONTACT SOLVER", f"*BODY SOLVER, TANGENT={tangent}\n*CONTACT SOLVER")
    text = text.replace("element = C3D8\n", "element = C3D8\nform = BIPOTENTIAL\nlocal = AUTO\n")
    parameters = {"press": 1, "push": 1.5, "tolerance": 1e-10, "steps": 5, **parameters}
    return Run(text, name="rubber", **parameters)


class Solvers(unittest.TestCase):
    """What the tangent is changes nothing but the way to the solution."""

    def resultants(self, run, what):
        """Return the resultants of all increments of a run that is certified."""
        self.assertEqual(run.status, 0, (what, run.errors))
        with run.result() as result:
            return result.pairs[0].resultant

    def check(self, make, solvers, name="formulation"):
        """Hold each solver with NEWTON against one with KEPT, to 1e-8."""
        kept = self.resultants(make("KEPT"), "KEPT")
        for solver, formulation, local in solvers:
            run = make("NEWTON", solver=solver, local=local, **{name: formulation})
            found = self.resultants(run, (solver, formulation, local))
            np.testing.assert_allclose(found, kept, atol=1e-8 * np.abs(kept).max())

    def test_block(self):
        self.check(block, SOLVERS)
        self.check(lambda tangent, **p: block(tangent, "SVK", **p), SOLVERS[::2])

    def test_finer_block(self):
        few = [SOLVERS[i] for i in (0, 1, -1)]
        for law in ("NEO", "SVK"):
            self.check(lambda tangent, law=law, **p: block(tangent, law, n=4, steps=10, **p), few)

    def test_rubber(self):
        few = [SOLVERS[i] for i in (0, 2, 4, -2, -1)]
        self.check(rubber, few, name="form")

    def test_a_ball(self):
        """Normals turn: placements settle by a fixed point beside the Newton-Raphson steps."""
        text = """\
*PARAMETER
tangent = KEPT
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8, NX=4, NY=4, NZ=2
-1., -1., 0.,  2., 2., 1.
*NODE
90000, 0., 0., 2.
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
0.178571, 1.2
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=TOOL, TYPE=SPHERE, REF NODE=90000
0., 0., 2., 1.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY
B-ZMAX, TOOL
*CONTACT SOLVER, TOLERANCE=1e-10
*BODY SOLVER, TANGENT=<tangent>
*STEP, NLGEOM
*STATIC, DIRECT
1., 5.
*BOUNDARY
B-ZMIN, 1, 3
90000, 1, 2
90000, 3, 3, -0.2
*END STEP
*STEP
*STATIC, DIRECT
1., 4.
*BOUNDARY
90000, 1, 1, 0.2
*END STEP
"""
        kept, newton = (
            self.resultants(Run(text, name="ball", tangent=tangent), tangent)
            for tangent in ("KEPT", "NEWTON")
        )
        np.testing.assert_allclose(newton, kept, atol=1e-8 * np.abs(kept).max())

    def test_what_joints_move_and_heat(self):
        """A warm bar that a coupling draws and a force bends: what the coupling moves acts through
        the tangent, too."""
        text = """\
*PARAMETER
tangent = KEPT
*BLOCK, NAME=B, NX=6, NY=2, NZ=2, TYPE=C3D8
0., 0., 0., 6., 1., 1.
*NODE
900, 6., 0.5, 0.5
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
40., 0.012
*EXPANSION
1e-3
*SOLID SECTION, ELSET=B, MATERIAL=M
*COUPLING, CONSTRAINT NAME=GRIP, REF NODE=900, SURFACE=B-XMAX
*KINEMATIC
*BODY SOLVER, TANGENT=<tangent>
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
B-XMIN, 1, 3
900, 1, 1, 0.9
900, 2, 2
900, 4, 6
*CLOAD
900, 3, 2.
*TEMPERATURE
B, 40.
*END STEP
"""
        found, iterations = {}, {}
        for tangent in ("KEPT", "NEWTON"):
            run = Run(text, name="bar", tangent=tangent)
            self.assertEqual(run.status, 0, (tangent, run.errors))
            with run.result() as result:
                found[tangent] = result.field("displacement", -1)
                iterations[tangent] = result.history("newton_raphson_iterations").sum()
        np.testing.assert_allclose(found["NEWTON"], found["KEPT"], atol=1e-7)
        self.assertLess(iterations["NEWTON"], 0.6 * iterations["KEPT"])


class Convergence(unittest.TestCase):
    """How the iterations get there."""

    def test_it_is_quadratic(self):
        """Forces out of balance after 1, 2 and 3 iterations of the first increments, where all
        points keep their status: each is less than the square of the one before."""
        left, status = {}, {}
        for tolerance in (0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
            with block("NEWTON", steps=10, tolerance=tolerance).result() as result:
                iterations = result.history("newton_raphson_iterations")
                # The rest of it, rounding times the condition, is below 1e-13.
                rows = result.history("error/arithmetic")
                for row in range(2):
                    left[row, int(iterations[row])] = rows[row]
                    status[row, int(iterations[row])] = result.pairs[0].status[row]
        for row in range(2):
            first, second, third = (left[row, i] for i in (1, 2, 3))
            for i in (2, 3):
                np.testing.assert_array_equal(status[row, i], status[row, 1])
            self.assertGreater(first, 1e-3)
            self.assertLess(third, 1e-10)
            self.assertLess(second, first**2)
            self.assertLess(third, second**2)

    def test_pressures_that_follow(self):
        """A cantilever bent far by pressures in one increment."""
        deck = """\
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8I, NX=1, NY=1, NZ=6
0., 0., 0., 1., 1., 4.
*MATERIAL, NAME=M
*ELASTIC
200., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*BODY SOLVER, TANGENT={tangent}
*STEP, NLGEOM
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMIN, 1, 3
*DSLOAD
B-XMAX, P, 0.25
B-ZMAX, P, 0.75
*END STEP
"""
        found = {}
        for tangent in ("KEPT", "NEWTON"):
            run = Run(deck.format(tangent=tangent), name="bent")
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found[tangent] = result.field("displacement", -1)
                iterations = result.history("newton_raphson_iterations").sum()
        np.testing.assert_allclose(found["NEWTON"], found["KEPT"], atol=1e-6)
        self.assertLess(iterations, 14)

    def test_each_iteration_has_its_tangent(self):
        counts = {}
        for tangent in ("KEPT", "NEWTON"):
            run = block(tangent)
            with run.result() as result:
                self.assertEqual(result.run["tangent"], tangent.lower())
                iterations = result.history("newton_raphson_iterations")
                counts[tangent] = iterations.sum(), result.history("tangents").sum()
                if tangent == "NEWTON":
                    np.testing.assert_array_equal(result.history("tangents"), iterations)
                    self.assertIn("of the tangent in every iteration", run.plan)
        self.assertLess(counts["NEWTON"][0], 0.6 * counts["KEPT"][0])
        self.assertLessEqual(counts["KEPT"][1], 4)


class Ends(unittest.TestCase):
    """What the choice says where it is of no use."""

    def test_a_tangent_that_is_not_positive_definite(self):
        """A soft block, pressed by 30 %, whose tangent is not positive definite from a fifth on:
        contact that a named solver finds by its compliance ends there, and the run says so; found
        together with the displacements it does not."""
        soft = {"e": "1", "down": 0.3, "steps": 12, "nu": 0.45}
        auto = {"solver": "AUTO", "local": "AUTO"}
        runs = {tangent: block(tangent, **soft, **auto) for tangent in ("KEPT", "NEWTON")}
        named = block("NEWTON", **soft, solver="GLOBAL NEWTON", local="AUTO")
        self.assertEqual(named.status, 2, named.output)
        self.assertRegex(
            named.errors,
            r"the tangent stiffness of iteration \d+ is not positive definite, .*TANGENT=KEPT",
        )
        forces = {}
        for name, run in (*runs.items(), ("named", named)):
            if name != "named":
                self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                forces[name] = result.pairs[0].resultant
        size = abs(forces["KEPT"]).max()
        np.testing.assert_allclose(forces["NEWTON"], forces["KEPT"], rtol=0, atol=1e-8 * size)
        before = len(forces["named"])
        self.assertGreater(before, 3)
        np.testing.assert_allclose(forces["named"], forces["KEPT"][:before], rtol=0,
                                   atol=1e-8 * size)

    def test_small_strain_has_one_stiffness(self):
        kept, newton = (block(t, "SVK", finite=False, steps=5) for t in ("KEPT", "NEWTON"))
        note = "TANGENT of *BODY SOLVER is ignored: it applies to NLGEOM only"
        self.assertNotIn("TANGENT", kept.output)
        self.assertIn(note, newton.output)
        with kept.result() as one, newton.result() as other:
            np.testing.assert_array_equal(one.pairs[0].resultant, other.pairs[0].resultant)
            self.assertEqual(other.run["tangent"], "small strain")

    def test_a_continued_run_has_the_same_bits(self):
        text = (INPUT / "rubber.inp").read_text().replace("solver = AUTO", "solver = GLOBAL NEWTON")
        text = text.replace("*CONTACT SOLVER", "*BODY SOLVER, TANGENT=NEWTON\n*CONTACT SOLVER")
        text = text.replace("press = 2.", "press = 1.").replace("n = 4", "n = 2")
        whole = Run(text, name="rubber")
        self.assertEqual(whole.status, 0, whole.errors)
        continued = Run(text, "--continue", name="rubber", ended_at=("1", "3"))
        self.assertEqual(continued.status, 0, continued.errors)
        with h5py.File(continued.file) as one, h5py.File(whole.file) as other:
            for name in ("displacement", "contact_force"):
                name = f"VTKHDF/PointData/{name}"
                np.testing.assert_array_equal(one[name][()], other[name][()])


if __name__ == "__main__":
    unittest.main()
