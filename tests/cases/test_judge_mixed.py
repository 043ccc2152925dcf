"""Random decks of elements of second order before their judge, tried on changed results first."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from program import PROGRAM, SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

from mixed import Scene, judge, solve_next
from second_order import KINDS


class Elements(unittest.TestCase):
    def test_a_constant_strain_is_in_balance_inside_and_its_areas_add_up(self):
        for seed in range(1, 13):
            scene = Scene(seed)
            for middle, ends in scene.middles.items():  # else quadrature is not exact
                scene.points[middle] = scene.points[list(ends)].mean(axis=0)
            strain = 1e-3 * np.array([(1.0, 0.2, -0.3), (0.2, -0.5, 0.4), (-0.3, 0.4, 0.7)])
            force = scene.internal_force(scene.points @ strain)
            low, high = scene.points.min(axis=0), scene.points.max(axis=0)
            inner = np.all((scene.points > low) & (scene.points < high), axis=1)
            with self.subTest(types=scene.types):
                self.assertLess(np.abs(force[inner]).max(), 1e-12 * np.abs(force).max())
                whole = np.prod((high - low)[:2])
                self.assertAlmostEqual(scene.areas().sum() / whole, 1, delta=1e-12)

    def test_types_are_those_of_the_deck(self):
        self.assertEqual([len(k.edges) + k.corners for k in KINDS.values()], [10, 15, 20, 20])


class Faults(unittest.TestCase):
    """Each number that is changed in a result is found."""

    def findings(self, change):
        scene = Scene(3)
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "deck.inp"
            deck.write_text(scene.deck())
            subprocess.run([PROGRAM, deck.name, "--quiet"], cwd=folder, check=True,
                           capture_output=True)  # fmt: skip
            path = deck.with_suffix(".vtkhdf")
            if change:
                with h5py.File(path, "r+") as file:
                    (group,) = file["contact"].values()
                    change(group)
            return {kind for _, kind, _ in judge(scene, path)}

    def test_what_is_changed_is_found(self):
        def scaled(name, factor):
            def change(group):
                # Gaps of what touches are 0.
                more = 1e-5 * Scene(3).size if name == "gap" else 0.0
                group[name][:] = group[name][:] * factor + more

            return change

        self.assertEqual(self.findings(None), set())
        for name, factor, kind in (
            ("area", 1 + 1e-5, "areas"), ("slip_increment", -1, "stored slip"),
            ("gap", 1, "stored gap"), ("reaction", 1 + 1e-5, "equilibrium"),
        ):  # fmt: skip
            with self.subTest(name=name):
                self.assertIn(kind, self.findings(scaled(name, factor)))


class Mistakes(unittest.TestCase):
    """What the judge's own formulas have, and the program has otherwise, is found."""

    def findings(self, family, seed, change):
        scene = Scene(seed, family)
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "deck.inp"
            deck.write_text(scene.deck())
            subprocess.run([PROGRAM, deck.name, "--quiet"], cwd=folder, check=True,
                           capture_output=True)  # fmt: skip
            change(scene)
            return {kind for _, kind, _ in judge(scene, deck.with_suffix(".vtkhdf"))}

    def test_loads_and_temperatures(self):
        def pressure(scene):
            scene.pressures = [(faces, 1.001 * size) for faces, size in scene.pressures]

        def weight(scene):
            scene.gravity = [(b, 1.001 * size) for b, size in scene.gravity]

        def heat(scene):  # of the nodes one after the other: not the mean of an element
            scene.warmth = np.roll(scene.warmth, 1, axis=1)

        seed = next(i for i in range(1, 99) if self.has_all(Scene(i, "loads")))
        self.assertEqual(self.findings("loads", seed, lambda scene: None), set())
        for change in (pressure, weight, heat):
            with self.subTest(change=change.__name__):
                self.assertIn("equilibrium", self.findings("loads", seed, change))

    @staticmethod
    def has_all(scene):
        return scene.pressures and scene.gravity and scene.warmth is not None

    def test_surfaces(self):
        def shares(scene):  # 1/4 for 1/5 and the other way round
            edge_shares = scene.mesh.edge_shares
            scene.mesh.edge_shares = lambda faces: {
                m: 0.45 - alpha for m, alpha in edge_shares(faces).items()
            }
            scene.alpha = scene.mesh.edge_shares(scene.faces)

        for family, seed, kind in (("bodies", 16, "stored gap"), ("tied", 2, "tie")):
            with self.subTest(family=family):
                self.assertEqual(self.findings(family, seed, lambda scene: None), set())
                self.assertIn(kind, self.findings(family, seed, shares))

    def test_its_own_solution_is_that_of_the_program(self):
        for family, seed in (("plain", 5), ("bodies", 16)):
            scene = Scene(seed, family)
            with self.subTest(family=family), tempfile.TemporaryDirectory() as folder:
                deck = Path(folder) / "deck.inp"
                deck.write_text(scene.deck())
                subprocess.run([PROGRAM, deck.name, "--quiet"], cwd=folder, check=True,
                               capture_output=True)  # fmt: skip
                with h5py.File(deck.with_suffix(".vtkhdf")) as file:
                    view, count = file["VTKHDF"], len(scene.points)
                    u = np.zeros((count, 3))
                    first = view["Steps/PointDataOffsets/displacement"][0]
                    ids = view["PointData/node_id"][:count] - 1
                    u[ids] = view["PointData/displacement"][first : first + count]
                own = solve_next(scene, Path(folder) / "none")
                self.assertLess(np.abs(own - u).max(), 1e-5 * np.abs(u).max())

    def test_a_refusal_fails(self):
        with tempfile.TemporaryDirectory() as folder:
            refuses = Path(folder) / "refuses"
            refuses.write_text("#!/bin/sh\nexit 2\n")
            refuses.chmod(0o755)
            done = subprocess.run(
                [sys.executable, "-B", str(SOURCE / "tests" / "judge" / "mixed.py"),
                 "--bipot", str(refuses), "--decks", "1"],
                capture_output=True, text=True, check=False,
            )  # fmt: skip
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("refused", done.stdout)


class Decks(unittest.TestCase):
    def test_random_decks(self):
        done = subprocess.run(
            [sys.executable, "-B", str(SOURCE / "tests" / "judge" / "mixed.py"),
             "--bipot", PROGRAM, "--decks", "4", "--seed", "1300"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(done.stdout.strip(), "{'right': 4}")


if __name__ == "__main__":
    unittest.main()
