"""A run gives the same bits again: whatever the environment, the moment, or the folder."""

import unittest

import h5py
import numpy as np
from result_checks import HERE, INPUT, NAME, Case, Folder, Whole

CASES = (
    Case(INPUT / "block.inp", n=6, steps=10, solver="AUTO", local="AUTO"),
    Case(INPUT / "block.inp", n=4, steps=10),
    Case(HERE / "changes.inp", n=5),
    Case(INPUT / "tool.inp", n=6, steps=3),
)
# What moves the process in memory, and how memory is handed out.
ENVIRONMENTS = (
    {},
    {"PADDING": 1001 * "x"},
    {"MALLOC_PERTURB_": "171", "MALLOC_MMAP_THRESHOLD_": "1000"},
    {"MALLOC_ARENA_MAX": "1", "LD_BIND_NOW": "1", "LANG": "C"},
)


class SameBits(Folder):
    def solve(self, case, name, **environment):
        """Run a case in a folder of this name."""
        folder = self.fresh(name)
        status, words = case.run(folder, **environment)
        self.assertEqual(status, 0, words)
        return folder / NAME

    def test_from_run_to_run(self):
        for case in CASES:
            whole = Whole(self.solve(case, "first"))
            for i, environment in enumerate(ENVIRONMENTS):
                with self.subTest(case=str(case), environment=i):
                    path = self.solve(case, "again" + i * "-and-again", **environment)
                    self.assertEqual(whole.differences(path), [])

    def test_more_threads_give_the_same_to_the_tolerance(self):
        case = CASES[0]
        one = self.solve(case, "one")
        two = self.solve(case, "two", OPENBLAS_NUM_THREADS="2")
        with h5py.File(one) as a, h5py.File(two) as b:
            self.assertEqual(a["history"].attrs["finished"], b["history"].attrs["finished"])
            pair = "contact/BODY-ZMIN:GROUND"
            for name in (f"{pair}/reaction", f"{pair}/slip", "VTKHDF/PointData/displacement"):
                x, y = a[name][()], b[name][()]
                np.testing.assert_allclose(x, y, rtol=0, atol=1e-8 * abs(x).max(), err_msg=name)

    def test_the_file_says_what_made_it(self):
        with h5py.File(self.solve(CASES[1], "one")) as file:
            run = {name: np.atleast_1d(value)[0] for name, value in file["run"].attrs.items()}
        libraries = run["libraries"].decode()
        version = ".".join(map(str, h5py.version.hdf5_version_tuple))
        for pattern in (
            r"MUMPS \d+\.\d+\.\d+", r"HDF5 \d+\.\d+\.\d+", r"loaded .*mumps[^,]*\.so",
            r"metis[^,]*\.so[^,]*", r"blas[^,]*\.so",  # HDF5 may be a part of the program
        ):
            self.assertRegex(libraries, pattern)
        self.assertTrue(version)
        self.assertRegex(run["build"].decode(), r"^GCC version \d+.* -O\d ")
        self.assertIn("blas_core", run)


if __name__ == "__main__":
    unittest.main()
