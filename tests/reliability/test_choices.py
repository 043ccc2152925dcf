"""What a run computes follows from its deck, not from how fast the machine is.

What depends on the memory that was left is kept, and chosen again when the run is continued.
"""

import os
import resource
import unittest

import h5py
import numpy as np
from result_checks import CLOCK, HERE, INPUT, NAME, Case, Folder, Whole

LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")


class Clock(Folder):
    """A clock that goes on by so many milliseconds with every look counts the looks.

    Their number in an increment tells how many increments were solved ahead together with it.
    """

    def run_with(self, case, look, *more):
        """Run, or continue; return how often the program looked in each increment."""
        status, words = case.run(self.folder / "run", *more, LD_PRELOAD=CLOCK, LOOK=str(look))
        self.assertEqual(status, 0, words)
        with h5py.File(self.folder / "run" / NAME) as file:
            return file["history/wall_time"][:] * 1000 / look

    def check(self, case):
        """Run, and kill and continue, on fast and slow machines."""
        self.fresh("run")
        n = case.count_changes(self.folder / "run")
        whole = Whole(self.folder / "run" / NAME)
        looks = []
        for look in (1, 100_000):
            self.fresh("run")
            looks.append(self.run_with(case, look))
            self.assertEqual(whole.differences(self.folder / "run" / NAME), [])
        np.testing.assert_allclose(looks[0], looks[1], rtol=1e-9)
        self.assertGreater(np.ptp(looks[0]), 0)
        for share in (0.35, 0.6) if LONG else (0.6,):
            continued = []
            for look in (1, 100_000):
                folder = self.fresh("run")
                self.assertTrue(case.kill_at(folder, int(share * n)))
                with h5py.File(folder / NAME) as file:
                    rows = int(file["history"].attrs["finished"])
                continued.append(self.run_with(case, look, "--continue")[rows:])
                self.assertEqual(whole.differences(folder / NAME), [])
            np.testing.assert_allclose(continued[0], continued[1], rtol=1e-9)

    def test_a_slow_machine_computes_the_same(self):
        self.check(Case(INPUT / "block.inp", n=3, steps=40, solver="AUTO", local="AUTO"))
        self.check(Case(INPUT / "block.inp", n=2, steps=30))
        self.check(Case(HERE / "changes.inp", factor="DOUBLE"))


class Memory(Folder):
    """A run that began with little memory goes on in the same arithmetic where there is more."""

    def limited(self, megabytes):
        """A limit on addresses for a process."""

        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (megabytes * 1_000_000, resource.RLIM_INFINITY))

        return limit

    def test_the_arithmetic_that_memory_chose(self):
        case = Case(INPUT / "block.inp", n=16, steps=12, solver="AUTO", local="AUTO")
        for megabytes in range(420, 280, -30):
            prepare = self.limited(megabytes)
            folder = self.fresh("whole")
            n = case.count_changes(folder, prepare=prepare)
            with h5py.File(folder / NAME) as file:
                if file["run"].attrs["single_factor"] == 1:
                    break
        else:
            self.fail("single precision was never chosen")
        whole = Whole(folder / NAME)
        folder = self.fresh("killed")
        self.assertTrue(case.kill_at(folder, int(0.6 * n), prepare=prepare))
        status, words = case.run(folder, "--continue")
        self.assertEqual(status, 0, words)
        self.assertEqual(whole.differences(folder / NAME), [])

    def test_products_with_the_compliance(self):
        case = Case(HERE / "plate.inp")
        folder = self.fresh("whole")
        n = case.count_changes(folder)
        whole = Whole(folder / NAME)
        with h5py.File(folder / NAME) as file:
            self.assertEqual(file["run"].attrs["compliance"], 2)
        folder = self.fresh("killed")
        self.assertTrue(case.kill_at(folder, int(0.7 * n)))
        status, words = case.run(folder, "--continue")
        self.assertEqual(status, 0, words)
        with h5py.File(folder / NAME) as file:
            self.assertEqual(file["run"].attrs["compliance"], 2)
        self.assertEqual(whole.differences(folder / NAME), [])


if __name__ == "__main__":
    unittest.main()
