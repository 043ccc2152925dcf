"""The quick version of the study of solvers: runs, resumes, and refuses what is not shown."""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from study import PROGRAM, ROOT, need

need("h5py", "matplotlib")

from studies import solvers  # noqa: E402


def quick(folder):
    """Run the quick study in a folder."""
    return subprocess.run(
        [sys.executable, "-B", ROOT / "studies" / "run", "solvers", "--quick", "-o", folder,
         "--bipot", PROGRAM],
        capture_output=True, text=True, check=False,
    )


class Quick(unittest.TestCase):
    """One quick study, read by all tests."""

    @classmethod
    def setUpClass(cls):
        holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(holder.cleanup)
        cls.folder = Path(holder.name)
        cls.done = quick(cls.folder)

    def test_every_case_is_there(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        study = solvers.Study(PROGRAM, self.folder)
        for case in solvers.design(quick=True):
            record = study[case]
            self.assertIsNotNone(record, case.key)
            if case.rho == 2.5:
                self.assertEqual(record["status"], solvers.NOT_SOLVED)
                self.assertIn("did not reach the tolerance", record["message"])
            else:
                self.assertEqual((record["status"], record["finished"]), (0, 50), case.key)
                self.assertLess(record["error"], 1e-6 if case.stop == "residual" else 1e-3)

    def test_coarse_meshes_bear_the_paper_out(self):
        study = solvers.Study(PROGRAM, self.folder)
        self.assertEqual(solvers.compare(study, 1.0, (1, 2)), ([1, 2], []))

    def test_tables_and_small_figures_are_written(self):
        self.assertIn("global Newton", (self.folder / "tables.md").read_text(encoding="utf-8"))
        for name in ("mesh", "rho", "error", "time"):
            size = (self.folder / f"study-{name}.png").stat().st_size
            self.assertTrue(5_000 < size < 100_000, f"{name}: {size} bytes")

    def test_a_finished_study_runs_nothing(self):
        before = (self.folder / "runs.json").stat().st_mtime_ns
        self.assertEqual(quick(self.folder).returncode, 0)
        self.assertEqual((self.folder / "runs.json").stat().st_mtime_ns, before)

    def test_another_program_begins_anew(self):
        study = solvers.Study(PROGRAM, self.folder)
        study.folder = self.folder / "elsewhere"  # its references are not to be touched
        study.facts = {"digest": "of another program"}
        study.check_program()
        self.assertEqual(study.records, {})
        self.assertTrue(json.loads(study.cache.read_text(encoding="utf-8"))["records"])


class Claims(unittest.TestCase):
    """A sentence is written only while the runs bear it out."""

    def test_what_does_not_hold_is_refused(self):
        self.assertEqual(solvers.claim(True, "so it is"), "so it is")
        with self.assertRaisesRegex(solvers.StudyError, "so it is"):
            solvers.claim(False, "so it is")


class Design(unittest.TestCase):
    """The full study asks for what the page tabulates."""

    def test_keys_are_unique(self):
        cases = solvers.design(quick=False)
        self.assertEqual(len({case.key for case in cases}), len(cases))


if __name__ == "__main__":
    unittest.main()
