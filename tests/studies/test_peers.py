"""The study of peers: what it makes of comparisons that are known."""

import math
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

from study import ROOT, need

need("h5py", "matplotlib")

from bipot.peers.runs import Comparison, PeerRun  # noqa: E402
from studies import peers  # noqa: E402
from studies.pages import StudyError  # noqa: E402


def block(error=1e-11):
    """Return a comparison of the block with a whole run of every peer."""
    runs = [PeerRun("bipot", "", 0.5, 4e7, 1e-11, 50, 50)]
    for k, stiffness in enumerate(("1e+06", "1e+07", "1e+08")):
        runs.append(PeerRun("CalculiX", f"K {stiffness}", 5.0, 2e7, 0.2 / 10**k, 50, 50, "", 100))
    runs.append(PeerRun("GetFEM", "augmentation 1 E h", 4.0, 8e7, error, 50, 50, "", 150))
    return Comparison(runs, 1944, 81, "1e-13")


def alone(increments=50):
    """Return a comparison of the contact problems alone."""
    return Comparison([
        PeerRun("bipot", "auto", 0.2, math.nan, 1e-11, 50, 50),
        PeerRun("Siconos", "NSGS, dense", 0.8, math.nan, 1e-11, 50, 50),
        PeerRun("Siconos", "ADMM, dense", 0.1, math.nan, 1e-11, increments, 50,
                "" if increments == 50 else f"ended in increment {increments + 1}"),
    ], 243, 81, "1e-13")


class Peers(unittest.TestCase):
    """The page, and the file of runs behind it."""

    def test_the_page_names_every_peer(self):
        text = "\n".join(peers.page({8: block()}, {"quarter": block()}, {8: alone()}, "a machine"))
        for words in (
            "| GetFEM | augmentation 1 E h | 4 | 8 | 80 | 1.0e-11 |",
            "n = 8: GetFEM takes 8 times the processor time",
            "n = 8: CalculiX takes 10 times the processor time, with an error of 2.0e-03",
            "It takes 3.0 to 3.0 iterations an increment", "40, 20, 80 MB at n = 8",
            "| Siconos | ADMM, dense | 0.1 | 0.5 | 1.0e-11 |",
            "the fastest of Siconos' solvers, ADMM, dense, takes 0.5 times",
        ):
            self.assertIn(words, text)

    def test_a_peer_that_did_not_run_is_left_out(self):
        comparison = block()
        comparison.runs.pop()
        text = "\n".join(peers.page({8: comparison}, {}, {}, "a machine"))
        self.assertNotIn("GetFEM takes", text)
        self.assertNotIn("Siconos' solvers", text)

    def test_a_solver_that_gives_up_is_not_the_fastest(self):
        lines = peers.contact_section({8: alone(increments=20)})
        self.assertIn("- n = 8: the fastest of Siconos' solvers, NSGS, dense, takes 4 times "
                      "bipot's time.", lines)
        row = next(line for line in lines if "ADMM" in line)
        self.assertIn("| - | - |", row)
        self.assertIn("ended in increment 21", row)

    def test_another_answer_of_getfem_stops_the_page(self):
        with self.assertRaisesRegex(StudyError, "GetFEM takes"):
            peers.page({8: block(error=1e-3)}, {}, {}, "a machine")

    def test_runs_are_kept_and_read_again(self):
        with tempfile.TemporaryDirectory() as folder:
            with mock.patch.object(peers, "KEPT", Path(folder) / "peers.csv"):
                self.assertEqual(peers.read_comparisons(), {})
                peers.keep("block", 8, alone())
                peers.keep("block", 8, block())
                peers.keep(peers.CONTACT_ALONE, 8, alone(20))
                found = peers.read_comparisons()
        self.assertEqual(found["block", 8], block())
        self.assertEqual(len(found), 2)
        again = found[peers.CONTACT_ALONE, 8].runs[2]
        self.assertTrue(math.isnan(again.memory))
        self.assertEqual((again.increments, again.note), (20, "ended in increment 21"))

    def test_the_page_is_that_of_the_runs_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(
                [sys.executable, "-B", ROOT / "studies" / "run", "peers", "--page", "-o", folder],
                check=True, capture_output=True,
            )
            made = (Path(folder) / "peers.md").read_text(encoding="utf-8").splitlines()
        kept = (ROOT / "docs" / "studies" / "peers.md").read_text(encoding="utf-8").splitlines()
        # The third line names the machine.
        self.assertEqual(made[3:], kept[3:])

    def test_iterations_are_those_of_the_largest_whole_run(self):
        small, large, stopped = block(), block(), block()
        for run in small.runs[1:]:
            run.iterations = 7
        for run in stopped.runs:
            run.increments = 3
        found = {("block", 4): small, ("block", 8): large, ("block", 16): stopped,
                 ("quarter", 0): small}
        self.assertEqual(peers.iterations_an_increment(found), {"CalculiX": 2.0, "GetFEM": 3.0})


if __name__ == "__main__":
    unittest.main(verbosity=2)
