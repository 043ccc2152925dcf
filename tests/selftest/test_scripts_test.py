#!/usr/bin/env python3
"""scripts/test with a tree of small tests: what it builds and runs, and what it says of it.

ctest is the real one; in place of CMake stands a script that notes what it was told to build. The
tests of a tree are commands of the shell.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(SOURCE / "tests"))

import ctest_summary  # noqa: E402  (found through the line above)

# Configures by writing the files that say so; builds by noting it.
CMAKE = """#!/bin/bash
if [ "$1" = --build ]; then
  shift
  folder=$1
  shift 3 # the folder, --parallel and its number
  echo "${folder#"$ROOT"/} $*" >>"$ROOT/built"
  exit 0
fi
while [ $# -gt 0 ]; do
  case $1 in
    -B) folder=$2; shift 2 ;;
    -D*) entries+=("${1#-D}"); shift ;;
    *) shift ;;
  esac
done
touch "$folder/Makefile"
{
  echo "CMAKE_HOME_DIRECTORY:INTERNAL=$ROOT"
  for entry in "${entries[@]}"; do echo "${entry%%=*}:STRING=${entry#*=}"; done
} >"$folder/CMakeCache.txt"
cp "$ROOT/trees/${folder##*/}" "$folder/CTestTestfile.cmake"
"""
PART = """\
import unittest


class Part(unittest.TestCase):
    def test_that_runs(self):
        pass

    @unittest.skip("the 'moon' is not installed")
    def test_left_out(self):
        pass

    @unittest.skip("not today")
    def test_with_a_text(self):
        "A line about it."


unittest.main()
"""


def add(name: str, command: str, properties: str = "") -> str:
    """A line of a CTestTestfile."""
    text = f'add_test({name} "/bin/sh" "-c" "{command}")\n'
    return text + (f"set_tests_properties({name} PROPERTIES {properties})\n" if properties else "")


class ScriptsTest(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        # Under another folder, so that ../shared is not there.
        self.root = Path(folder.name).resolve() / "project"
        for path in ("scripts", "tests", "trees", "bin"):
            (self.root / path).mkdir(parents=True)
        for path in ("scripts/test", "scripts/common.sh", "tests/ctest_summary.py", "tests/timed"):
            shutil.copy(SOURCE / path, self.root / path)
        (self.root / "tests/requirements.txt").write_text("")
        (self.root / "part.py").write_text(PART)
        for name, text in (("cmake", CMAKE), ("mpirun", "#!/bin/sh\n")):
            (self.root / "bin" / name).write_text(text)
            (self.root / "bin" / name).chmod(0o755)
        units = add("unit_a", "true", "LABELS unit")
        self.tree("debug", units + add("case_b", "true", "LABELS checked"))
        self.tree("build", units + add("case_b", "true", "LABELS checked") +
                  add("case_c", "true", "LABELS readme") + add("lint", "true"))  # fmt: skip
        self.tree("mpi", add("ranks", "true"))

    def tree(self, name: str, text: str) -> None:
        """Say which tests a tree will have."""
        (self.root / "trees" / name).write_text(text)

    def run_it(self, *options: str, forbid: bool = False):
        """Run the script; return its status, what it printed, what it told, and what it built."""
        (self.root / "built").unlink(missing_ok=True)
        environment = {
            **{k: v for k, v in os.environ.items() if k != "BIPOT_FORBID_SKIPS"},
            "PATH": f"{self.root / 'bin'}:{os.environ['PATH']}",
            "ROOT": str(self.root),
            **({"BIPOT_FORBID_SKIPS": "1"} if forbid else {}),
        }
        done = subprocess.run(
            [str(self.root / "scripts/test"), "--no-install", *options],
            env=environment,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        built = self.root / "built"
        lines = built.read_text().splitlines() if built.is_file() else []
        # Trees are built at once.
        built_what = sorted(" ".join(line.split()) for line in lines if "check_build" not in line)
        return done.returncode, done.stdout, done.stderr, built_what

    def test_plain_runs_units_and_what_guards_the_readme(self) -> None:
        status, printed, told, built = self.run_it()
        self.assertEqual(status, 0, printed + told)
        self.assertEqual(built, ["build --target case_tools unit_a"])
        self.assertRegex(printed.splitlines()[-1], r"^2 of 2 passed in \d+ s$")
        self.assertIn("build: 2 tests, no times of earlier runs", told)
        self.assertRegex(printed, r"\nprocessor time: \d+ s installing, \d+ s building, \d+ s te")
        self.assertTrue((self.root / "build/test-times.txt").is_file())

    def test_all_runs_everything_once(self) -> None:
        status, printed, told, built = self.run_it("--all")
        self.assertEqual(status, 0, printed + told)
        # What is checked in the Debug tree is not run again.
        self.assertEqual(built, ["build --target bipot", "build --target case_tools unit_a",
                                 "build/debug", "build/mpi"])  # fmt: skip
        self.assertRegex(printed.splitlines()[-1], r"^6 of 6 passed in \d+ s$")

    def test_rest_is_what_plain_left(self) -> None:
        status, _, told, _ = self.run_it("--rest")
        self.assertEqual(status, 3)
        self.assertIn("run scripts/test before it", told)
        self.assertEqual(self.run_it()[0], 0)
        status, printed, told, _ = self.run_it("--rest")
        self.assertEqual(status, 0, printed + told)
        ran = [line.split()[3] for line in printed.splitlines() if "Passed" in line]
        self.assertEqual(sorted(ran), ["case_b", "lint", "ranks", "unit_a"])
        # The verdict is of both calls.
        self.assertRegex(printed.splitlines()[-1], r"^6 of 6 passed in \d+ s$")
        self.assertIn("\nby label:\n", printed)

    def test_rest_tells_what_failed_before_it(self) -> None:
        self.tree("build", add("unit_a", "false", "LABELS unit"))
        self.assertEqual(self.run_it()[0], 1)
        status, printed, _, _ = self.run_it("--rest")
        self.assertEqual(status, 1)
        self.assertRegex(printed.splitlines()[-1], r"^1 of 4 failed: unit_a \(\d+ s\)$")

    def test_options_of_ctest_choose_the_release_tree_and_what_is_built(self) -> None:
        for options, wanted, count in (
            (("-R", "unit_a"), ["build --target unit_a"], 1),
            (("-R", "case_b"), ["build --target case_tools"], 1),
            (("-R", "lint"), [], 1),
            (("-E", "lint"), ["build --target case_tools unit_a"], 3),
            (("--debug", "-R", "unit"), ["build/debug --target unit_a"], 1),
            (("--mpi", "-R", "ranks"), ["build --target bipot", "build/mpi --target bipot"], 1),
            (("--debug",), ["build/debug"], 2),
            (("--mpi",), ["build --target bipot", "build/mpi"], 1),
        ):
            with self.subTest(options):
                status, printed, told, built = self.run_it(*options)
                self.assertEqual(status, 0, printed + told)
                self.assertEqual(built, wanted)
                self.assertRegex(
                    printed.splitlines()[-1], rf"^{count} of {count} passed in \d+ s$"
                )
        status, printed, _, built = self.run_it("--all", "-R", "unit_a")
        self.assertEqual((status, len(built)), (0, 3))
        self.assertIn("2 of 2 passed", printed.splitlines()[-1])

    def test_times_of_earlier_runs_are_told(self) -> None:
        self.run_it("-R", "unit_a")
        data = self.root / "build/Testing/Temporary/CTestCostData.txt"
        data.write_text("unit_a 3 200\ncase_b 2 100\n---\n")
        told = self.run_it("-R", "unit_a|case_b|lint")[2]
        self.assertIn("build: 3 tests, about 3 min by the times of earlier runs, and 1 of", told)

    def test_nothing_chosen_is_a_failure(self) -> None:
        status, printed, _, _ = self.run_it("-R", "no_such_test")
        self.assertEqual((status, printed.splitlines()[-1]), (1, "no test was chosen"))

    def test_trees_are_chosen_once(self) -> None:
        for options in (("--debug", "--mpi"), ("--full", "--debug"), ("--rest", "--all")):
            status, _, told, built = self.run_it(*options)
            self.assertEqual((status, built), (1, []))
            self.assertIn("at a time", told)
        self.assertEqual(self.run_it("--list")[0], 1)

    def full_tree(self, **commands: str) -> None:
        """The Release tree, with parts of --full."""
        timed = f'"{self.root}/tests/timed" "{self.root}/build/test-times'
        parts = "".join(
            f'add_test(full_{name} {timed}/full_{name}" "/bin/sh" "-c" '
            f"\"echo {name} >>'{self.root}/ran'; {command}\")\n"
            f"set_tests_properties(full_{name} PROPERTIES LABELS full)\n"
            for name, command in commands.items()
        )
        (self.root / "build/test-times").mkdir(parents=True, exist_ok=True)
        (self.root / "build/bipot").write_text("a program\n")
        self.tree("build", add("unit_a", "true", "LABELS unit") + add("lint", "true") +
                  f'if(CTEST_CONFIGURATION_TYPE STREQUAL "full")\n{parts}endif()\n')  # fmt: skip
        (self.root / "build/Makefile").unlink(missing_ok=True)

    def states(self, printed: str) -> dict[str, str]:
        """Return how the parts ended, by their names."""
        return dict(re.findall(r"^(\w+) +(passed|failed|not run)$", printed, re.MULTILINE))

    def test_full(self) -> None:
        self.full_tree(x="test $BIPOT_SEED -gt 20000000", y="false")
        status, printed, told, built = self.run_it("--full")
        self.assertEqual(status, 1, printed + told)
        # Nothing is left to the Debug tree.
        self.assertEqual(built, ["build", "build --target bipot", "build --target case_tools",
                                 "build/debug", "build/mpi"])  # fmt: skip
        self.assertRegex(printed.splitlines()[-1], r"^full: FAILED in \d+ min$")
        passed = ("release", "debug", "mpi", "kernels", "x")
        ended = {**dict.fromkeys(passed, "passed"), "y": "failed"}
        self.assertEqual(self.states(printed), ended)
        self.assertEqual(self.states(self.run_it("--full", "--list")[1]), ended)

    def test_full_is_taken_up_where_it_ended(self) -> None:
        self.full_tree(x="true", y=f"test -f '{self.root}/mended'")
        self.assertEqual(self.run_it("--full")[0], 1)
        (self.root / "mended").touch()
        status, printed, told, built = self.run_it("--full")
        self.assertEqual(status, 0, printed + told)
        self.assertIn("left are: y", told)
        self.assertEqual(built, ["build --target case_tools"])
        self.assertEqual(self.states(printed), {"y": "passed"})
        self.assertEqual(sorted((self.root / "ran").read_text().split()), ["x", "y", "y"])
        # After that all begins anew, likewise with another seed or program.
        self.assertEqual(len(self.states(self.run_it("--full")[1])), 6)

    def test_parts_of_full_run_alone(self) -> None:
        self.full_tree(x="true", y="true")
        status, printed, told, built = self.run_it("--full", "y")
        self.assertEqual(status, 0, printed + told)
        self.assertEqual(self.states(printed), {"y": "passed"})
        self.assertEqual(built, ["build --target case_tools"])
        listed = self.states(self.run_it("--full", "--list")[1])
        self.assertEqual((listed["x"], listed["y"]), ("not run", "passed"))
        status, printed, told, _ = self.run_it("--full", "debug")
        self.assertEqual((status, self.states(printed)), (0, {"debug": "passed"}), told)
        status, _, told, _ = self.run_it("--full", "z")
        self.assertEqual(status, 1)
        self.assertIn("no part of --full: z", told)

    def test_what_failed_is_named(self) -> None:
        self.tree("debug", add("unit_a", "false"))
        self.tree("build", add("unit_a", "true") + add("case_b", "echo no; false") +
                  'add_test(case_c "/no/such/program")\n')  # fmt: skip
        status, printed, _, _ = self.run_it("--all")
        self.assertEqual(status, 1)
        self.assertRegex(
            printed.splitlines()[-1], r"^3 of 5 failed: case_b, case_c, unit_a \(debug\) \(\d+ s\)$"
        )
        self.assertIn("\n33% tests passed, 2 tests failed out of 3\n", printed)

    def test_skips_have_their_reasons(self) -> None:
        python = f"'{sys.executable}' '{self.root}/part.py' -v"
        self.tree("build", add("unit_a", "true") + add("case_part", python) +
                  add("case_shared", "echo 'skipped: X is not there'; exit 77",
                      "SKIP_RETURN_CODE 77"))  # fmt: skip
        options = ("-R", "unit|case")
        status, printed, told, _ = self.run_it(*options)
        self.assertEqual(status, 0, printed + told)
        for line in (
            "skipped: case_shared: X is not there",
            "skipped: case_part, test_left_out: the 'moon' is not installed",
            "skipped: case_part, test_with_a_text: not today",
        ):
            self.assertIn(f"\n{line}\n", printed)
        self.assertRegex(printed.splitlines()[-1], r"^2 of 3 passed, 1 skipped, in \d+ s$")
        # Its name says that it reads what may be absent; another test may not be skipped in CI.
        self.assertEqual(self.run_it(*options, forbid=True)[0], 0)
        self.tree("build", add("case_x", "exit 77", "SKIP_RETURN_CODE 77"))
        (self.root / "build/Makefile").unlink()
        status, printed, _, _ = self.run_it(*options, forbid=True)
        self.assertEqual(status, 1)
        self.assertIn("skipped: case_x: it does not say why", printed)
        self.assertRegex(
            printed.splitlines()[-1], r"^1 of 1 skipped, which is forbidden: case_x \(\d+ s\)$"
        )


class Summary(unittest.TestCase):
    def test_times(self) -> None:
        words = [ctest_summary.in_words(s) for s in (0.2, 59, 119, 120, 720, 5400)]
        self.assertEqual(words, ["0 s", "59 s", "119 s", "2 min", "12 min", "90 min"])

    def test_processor_times(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            tree = Path(name) / "debug"
            (tree / "test-times").mkdir(parents=True)
            (tree / "CTestTestfile.cmake").write_text(
                add("case_a", "true", "LABELS checked") + add("unit_b", "true", "LABELS unit") +
                add("lint", "true")
            )  # fmt: skip
            for test, mine in (("case_a", "0m14.5s 0m1.0s"), ("unit_b", "1m0.25s 0m0.5s"),
                               ("gone", "0m1s 0m1s")):  # fmt: skip
                (tree / "test-times" / test).write_text(f"0m9s 0m9s\n{mine}\nstatus 0\n")
            lines = ctest_summary.times([tree]).splitlines()
            self.assertEqual(lines[0], "processor time of 2 tests: 76 s")
            self.assertEqual(lines[1], "over 15 s outside --full: unit_b (debug), case_a (debug)")
            self.assertIn("     15.5 s  checked", lines)
            self.assertEqual(lines[-1], "     15.5 s  case_a (debug)")

    def test_timed(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            command = [str(SOURCE / "tests/timed"), f"{name}/times", "sh", "-c",
                       "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done; exit 77"]  # fmt: skip
            self.assertEqual(subprocess.run(command, check=False).returncode, 77)
            text = Path(name, "times").read_text()
            self.assertEqual(text.splitlines()[-1], "status 77")
            self.assertGreater(ctest_summary.seconds_of(text), 0.0)

    def test_a_run_that_came_to_no_end_is_no_success(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            tree = Path(name)
            (tree / "ctest.log").write_text("    Start 1: unit_a\n")
            line, is_well = ctest_summary.verdict(1, [], [tree / "ctest"])
            self.assertFalse(is_well)
            self.assertIn("came to no end", line)
            # Labels stand behind the names in later versions of ctest.
            (tree / "ctest.log").write_text(
                "\n50% tests passed, 1 tests failed out of 2\n\nThe following tests FAILED:\n"
                "\t  1 - unit_a (Failed)                unit\n"
            )
            line, is_well = ctest_summary.verdict(1, [], [tree / "ctest"])
            self.assertEqual((line, is_well), ("1 of 2 failed: unit_a (1 s)", False))


if __name__ == "__main__":
    unittest.main()
