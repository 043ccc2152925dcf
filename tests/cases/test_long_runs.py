"""A run of many increments takes no more memory than one of a few: nothing leaks from step to step.

The memory in the machine is read while the run goes on, behind every line that tells of an
increment. BIPOT_LONG=1 runs 1,000 increments instead of 300.
"""

import os
import re
import subprocess
import tempfile
import unittest

from program import INPUT, PROGRAM

LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")
INCREMENTS = 1000 if LONG else 300
# HDF5 keeps the tables of its datasets in memory as they fill: some 5 MB. One vector over the nodes
# that leaks in every increment would be more than this [bytes].
ALLOWED = 7_000 * INCREMENTS + 1_400_000 * (not LONG)


def memory_of(pid):
    """Bytes of a process that are in the machine now."""
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        return 1024 * int(re.search(r"VmRSS:\s+(\d+) kB", status.read()).group(1))


class LongRuns(unittest.TestCase):
    """One deck with friction and one with a tool that is moved."""

    def measure(self, deck, *settings):
        """Memory behind every increment."""
        with tempfile.TemporaryDirectory() as folder:
            process = subprocess.Popen(
                [PROGRAM, str(INPUT / deck), *settings], cwd=folder, text=True,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            )
            found = []
            for line in process.stdout:
                if re.match(r"\s+\d+\s+\d+\s+[\d.e-]+\s+\d+\s+\d+\s+\d+\s+\d+\s", line):
                    # Reading may fail where the process has ended in between.
                    try:
                        found.append(memory_of(process.pid))
                    except (OSError, AttributeError):
                        break
            errors = process.communicate()[1]
        self.assertEqual(process.returncode, 0, errors)
        self.assertGreater(len(found), INCREMENTS * 0.9)
        return found

    def check(self, deck, *settings):
        """The last tenth takes hardly more than the second."""
        found = self.measure(deck, *settings)
        tenth = len(found) // 10
        early, late = max(found[tenth: 2 * tenth]), max(found[-tenth:])
        if os.environ.get("BIPOT_TELL"):
            print(f"{deck}: {early / 1e6:.2f} MB behind increment {2 * tenth}, "
                  f"{late / 1e6:.2f} MB at the end")
        self.assertLess(late - early, ALLOWED)

    def test_a_sliding_block(self):
        self.check("block.inp", "--set", "n=8", "--set", "solver=AUTO", "--set", "local=AUTO",
                   "--set", f"steps={INCREMENTS}")

    def test_a_tool_under_motion(self):
        self.check("tool.inp", "--set", "n=12", "--set", f"steps={INCREMENTS // 2}")


if __name__ == "__main__":
    unittest.main()
