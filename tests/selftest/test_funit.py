#!/usr/bin/env python3
"""Tests of the in-tree stand-in for pFUnit (tests/pfunit): what it runs, reports and refuses."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest
from pathlib import Path

PFUNIT = Path(__file__).resolve().parent.parent / "pfunit"
COMPILER = os.environ.get("FC", "gfortran")
# The flags of a Debug build: the stand-in and what it generates must be clean under them.
FLAGS = (
    "-g -O1 -std=f2008 -Wall -Wextra -Werror -fcheck=all,no-array-temps -fbacktrace "
    "-ffpe-trap=invalid,zero,overflow -ffree-line-length-none"
).split()

HEAD = """\
module {name}
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
  use, intrinsic :: iso_fortran_env, only: int64, real32, wp => real64
  use funit
  implicit none
contains
"""

PASSING = """
  @test
  subroutine integers()
    integer :: a(2, 2)
    a = 7
    @assertEqual(3, 3)
    @assertEqual(3, 3_int64)
    @assertEqual(3_int64, 3_int64)
    @assertEqual([1, 2], [1, 2])
    @assertEqual(7, a)
    @assertEqual(a, a, message='same, "matrix" (!)')
    @assertNotEqual(8, a)
    @assertLessThan(1, 2)
    @assertLessThanOrEqual(2, [2, 3])
    @assertGreaterThan(3, 2)
    @assertGreaterThanOrEqual(2, 2)
    @assertEqual([integer ::], [integer ::])
  end subroutine integers

  ! A comment may stand between.
  @test

  ! Here too.
  subroutine reals() ! and here
    real(wp) :: x(3), b(1, 1, 1), inf
    character(len=*), parameter :: at = 'a@b! &'
    inf = ieee_value(inf, ieee_positive_inf)
    x = [1.0_wp, 2.0_wp, 3.0_wp]
    b = 0.5_wp
    @assertEqual(x, x)
    @assertEqual([1, 2, 3], x)
    @assertEqual([1.0, 2.0, 3.0], x)
    @assertEqual(1.0_wp, x(1), tolerance=1.0e-12_wp)
    @assertEqual(2, x, tolerance=1.0_wp, message=at)
    @assertEqual(0.5_wp, b)
    @assertEqual(inf, inf)
    @assertEqual([inf, 1.0_wp], [inf, 1.0_wp], tolerance=1.0e-3)
    @assertEqual(1.5, 1.5_real32, tolerance=0.0_real32)
    @assertEqual(huge(1.0_wp), huge(1.0_wp))
    @assertNotEqual(huge(1.0_wp), -huge(1.0_wp))
    @assertNotEqual(inf, -inf, tolerance=1.0_wp)
    @assertRelativelyEqual(100.0_wp, 101.0_wp, tolerance=0.011_wp)
    @assertLessThan(0.0_wp, x)
    @assertLessThan(1.05_wp, 1.0_wp, tolerance=0.1_wp)
    @assertLessThanOrEqual(x, x)
    @assertGreaterThan(inf, x)
    @assertGreaterThanOrEqual(x, 1.0_wp*x)
    @assertIsNaN(ieee_value(inf, ieee_quiet_nan))
    @assertIsFinite(1.0_wp)
  end subroutine reals

  @TEST
  subroutine others
    character(len=8) :: padded
    padded = 'abc'
    @AssertEqual('abc', padded, message='it''s, (trimmed')
    @assertEqual('abc', ['abc ', ' abc'])
    @assertTrue(.true.)
    @assertTrue([.true., .true.], message='all')
    @assertFalse(.false.)
    @assertFalse([.false.])
    if (anyExceptions()) return
    call helper(2)
  end subroutine others

  subroutine helper(n)
    integer, intent(in) :: n
    @assertEqual(2, n)
  end subroutine helper
"""

# Each of these must fail at its own line, and its test subroutine must return there.
FAILING = [
    "@assertEqual(1, 2, message='one, two')",
    "@assertEqual([1.0_wp, 2.0_wp], [1.0_wp, 2.5_wp], tolerance=0.1_wp)",
    "@assertEqual(reshape([1, 2, 3, 4], [2, 2]), reshape([1, 2, 3, 5], [2, 2]))",
    "@assertEqual([1, 2], [1, 2, 3])",
    "@assertEqual([integer ::], [1])",
    "@assertEqual(nan(), nan())",
    "@assertNotEqual(nan(), 1.0_wp)",
    "@assertLessThan(nan(), 1.0_wp)",
    "@assertGreaterThanOrEqual(1.0_wp, nan())",
    "@assertEqual(1.0_wp, nan(), tolerance=1.0_wp)",
    "@assertRelativelyEqual(0.0_wp, 0.0_wp, tolerance=1.0_wp)",
    "@assertRelativelyEqual(100.0_wp, 102.0_wp, tolerance=0.011_wp)",
    "@assertEqual(huge(1.0_wp), -huge(1.0_wp), tolerance=1.0_wp)",
    "@assertEqual(1.0_wp, 1.0_real32)",
    "@assertEqual(1_int64, 1)",
    "@assertEqual(1_int64, 1.0_wp)",
    "@assertEqual(1.0_wp, 1)",
    "@assertEqual([1], 1)",
    "@assertEqual([1], reshape([1], [1, 1]))",
    "@assertEqual(1, 1.0_wp, tolerance=[1.0_wp])",
    "@assertEqual(1, 1.0_wp, tolerance=1)",
    "@assertEqual(1, 1, tolerance=1.0_wp)",
    "@assertEqual(1.0, 1.0_real32, tolerance=1.0_wp)",
    "@assertEqual('abc', 'abd')",
    "@assertEqual('abc', 'abcd')",
    "@assertNotEqual('abc', 'abd')",
    "@assertLessThan(2, 2)",
    "@assertLessThan(0.0_wp, [1.0_wp, 0.0_wp])",
    "@assertTrue(.false.)",
    "@assertFalse([.false., .true.])",
    "@assertIsNaN(1.0_wp)",
    "@assertIsFinite(nan())",
    "@assertIsFinite(ieee_value(1.0_wp, ieee_positive_inf))",
    "@assertIsFinite([1.0_wp])",
    "@assertFail('must not happen')",
]


def module(name: str, body: str, head: str = HEAD) -> str:
    """Wrap a body into a `.pf` module."""
    return head.format(name=name) + textwrap.dedent(body) + f"end module {name}\n"


def preprocess(folder: Path, name: str, text: str) -> tuple[int, str, Path]:
    """Preprocess a `.pf` text; return the status, the messages and the output file."""
    source, target = folder / f"{name}.pf", folder / f"{name}.F90"
    source.write_text(text)
    done = subprocess.run(
        [sys.executable, PFUNIT / "funit_preprocess.py", source, target],
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stderr, target


class Compiled(unittest.TestCase):
    """Base of the tests that compile: the library is compiled once."""

    folder: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        sources = [PFUNIT / f for f in ("funit_names.f90", "funit_values.f90", "funit.f90")]
        cls.compile("-c", *map(str, sources))

    @classmethod
    def compile(cls, *arguments: str) -> None:
        """Run the compiler in the folder; its messages go into the exception."""
        done = subprocess.run(
            [COMPILER, *FLAGS, *arguments], cwd=cls.folder, capture_output=True, text=True
        )
        if done.returncode != 0:
            raise AssertionError(done.stderr)

    def build(self, name: str, body: str, head: str = HEAD) -> Path:
        """Build the executable of one `.pf` text."""
        status, messages, target = preprocess(self.folder, name, module(name, body, head))
        self.assertEqual(status, 0, messages)
        driver = self.folder / f"{name}_driver.f90"
        driver.write_text(
            f"program main\n  use funit, only: testsuite\n  use Wrap{name}, only: {name}_suite\n"
            f"  implicit none\n  type(testsuite) :: suite\n  call suite%start()\n"
            f"  call {name}_suite(suite)\n  call suite%finish()\nend program main\n"
        )
        self.compile(
            "-o", name, str(target), str(driver), "funit.o", "funit_values.o", "funit_names.o"
        )
        return self.folder / name

    def run_tests(self, name: str, body: str, *arguments: str) -> tuple[int, str]:
        """Build and run one `.pf` text; return the status and what it printed."""
        done = subprocess.run(
            [self.build(name, body), *arguments], capture_output=True, text=True, cwd=self.folder
        )
        return done.returncode, done.stdout

    def test_everything_allowed_passes(self) -> None:
        status, out = self.run_tests("passing", PASSING)
        self.assertEqual(status, 0, out)
        self.assertIn("passing_suite.integers ... ok", out)
        self.assertIn("3 tests run, 0 failed, 0 disabled", out)

    def test_each_failure_names_its_line_and_values(self) -> None:
        body = "".join(
            f"\n@test\nsubroutine fails_{i}()\n  {line}\n  stop 'did not return'\n"
            f"end subroutine fails_{i}\n"
            for i, line in enumerate(FAILING)
        )
        body += (
            "\nfunction nan()\n  real(wp) :: nan\n  nan = ieee_value(nan, ieee_quiet_nan)\n"
            "end function nan\n"
        )
        text = module("failing", body)
        status, out = self.run_tests("failing", body)
        self.assertEqual(status, 1, out)
        for i, line in enumerate(FAILING):
            number = text.splitlines().index("  " + line) + 1
            self.assertIn(f"\nfailing.pf:{number}: fails_{i}: ", out)
        n = len(FAILING)
        self.assertIn(f"{n} tests run, {n} failed, 0 disabled", out)
        self.assertRegex(out, r"fails_0: one, two: assertequal: .*\n +expected: 1\n +found: +2\n")
        self.assertRegex(out, r"found: +2\.5\d*\n +tolerance: +0?\.1\d*\n +at index: \(2\)\n")
        self.assertIn("at index: (2, 2)", out)
        self.assertIn("the shapes differ", out)
        self.assertIn("must not happen", out)
        self.assertEqual(out.count("pFUnit has no"), 12, out)

    def test_before_after_and_disabled(self) -> None:
        body = """
          @test
          subroutine first()
            print '(a)', ' first'
          end subroutine first

          @after
          subroutine clean()
            print '(a)', ' clean'
          end subroutine clean

          @test
          subroutine fails()
            @assertTrue(.false.)
          end subroutine fails

          @test
          @disable
          subroutine off()
            print '(a)', ' off'
          end subroutine off

          @before
          subroutine prepare()
            print '(a)', ' prepare'
          end subroutine prepare
        """
        head = "module {name}\n  use funit\n  implicit none\ncontains\n"
        executable = self.build("order", body, head)
        done = subprocess.run([executable], capture_output=True, text=True)
        words = re.findall(r"\b(prepare|first|clean|off|FAILED|ok|disabled)\b", done.stdout)
        first = ["first", "prepare", "first", "clean", "ok"]
        self.assertEqual(
            words, [*first, "prepare", "clean", "FAILED", "off", "disabled", "disabled"]
        )
        self.assertEqual(done.returncode, 1)

        chosen = subprocess.run([executable, "-f", "r_suite.fi"], capture_output=True, text=True)
        self.assertEqual(chosen.returncode, 0, chosen.stdout)
        self.assertIn("1 tests run", chosen.stdout)
        none = subprocess.run([executable, "-f", "nothing"], capture_output=True, text=True)
        self.assertEqual(none.returncode, 1)
        self.assertIn("no test ran", none.stdout)
        wrong = subprocess.run([executable, "first"], capture_output=True, text=True)
        self.assertEqual(wrong.returncode, 1)

    def test_a_failure_before_skips_the_test(self) -> None:
        body = """
          @before
          subroutine prepare()
            @assertFail('not ready')
          end subroutine prepare
          @test
          subroutine never()
            print '(a)', 'ran'
          end subroutine never
        """
        head = "module {name}\n  use funit\n  implicit none\ncontains\n"
        executable = self.build("unready", body, head)
        done = subprocess.run([executable], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertNotIn("ran\n", done.stdout.replace("ran)", ""))
        self.assertIn("never: not ready", done.stdout)

    def test_compile_errors_point_into_the_pf_file(self) -> None:
        body = (
            "@test\nsubroutine one()\n  @assertTrue(.true.)\n  @assertEqual(1, y)\nend subroutine\n"
        )
        with self.assertRaisesRegex(AssertionError, r"wrong\.pf:10:"):
            self.build("wrong", body)
        # A test that the module hides is as unreachable for pFUnit.
        head = "module {name}\n  use funit\n  implicit none\n  private\ncontains\n"
        body = "@test\nsubroutine one()\nend subroutine\n"
        with self.assertRaisesRegex(AssertionError, r"hidden\.pf:\d+:"):
            self.build("hidden", body, head)
        # `run` is a name of pFUnit's.
        body = "@test\nsubroutine run()\nend subroutine\n"
        with self.assertRaisesRegex(AssertionError, r"clash\.pf:\d+:"):
            self.build("clash", body)


class Refused(unittest.TestCase):
    """Lines that the preprocessor must not take."""

    def messages(self, text: str, name: str = "bad") -> str:
        """Preprocess a text that must be refused; return the messages."""
        with tempfile.TemporaryDirectory() as folder:
            status, messages, target = preprocess(Path(folder), name, text)
            self.assertEqual(status, 1, f"accepted: {text}")
            self.assertFalse(target.exists())
        return messages

    def test_lines_in_a_test(self) -> None:
        for line, reason in [
            ("@assertEquals(1, 2)", "unknown annotation"),
            ("@fail('x')", "unknown annotation"),
            ("@assertIsInfinite(x)", "unknown annotation"),
            ("@mpitest", "unknown annotation"),
            ("@suite(name='x')", "unknown annotation"),
            ("@ assertTrue(a)", "unknown annotation"),
            ("@assertTrue(a) ! why", "a comment may not follow"),
            ("@assertEqual(1, &", "without '&'"),
            ("if (a) @assertTrue(b)", "must come first"),
            ("call f(); @assertTrue(b)", "must come first"),
            ("@assertTrue(a); call f(b)", "nothing may follow"),
            ("@assertTrue(a", "the ')' is missing"),
            ("@assertTrue a", "expected '('"),
            ("@assertTrue()", "expected 1 operands"),
            ("@assertEqual(1)", "expected 2 operands"),
            ("@assertEqual(1, , 2)", "empty argument"),
            ("@assertEqual(1, 2, 0.1)", "as a keyword"),
            ("@assertTrue(a, 'text')", "as a keyword"),
            ("@assertTrue(a, tolerance=0.1)", "unknown keyword 'tolerance'"),
            ("@assertEqual(1, found=2)", "unknown keyword 'found'"),
            ("@assertEqual(1, 2, message='a', message='b')", "given twice"),
            ("@assertEqual(1, message='a', 2)", "may not follow a keyword"),
            ("@assertRelativelyEqual(1.0, 2.0)", "tolerance= is missing"),
            ("@disable", "must follow @test"),
            ("use funit, only: assertEqual", "without 'only'"),
            ("use pfunit", "use funit"),
        ]:
            with self.subTest(line):
                text = module("bad", f"@test\nsubroutine one()\n{line}\nend subroutine one\n")
                messages = self.messages(text)
                number = text.splitlines().index(line) + 1
                self.assertRegex(messages, rf"bad\.pf:{number}: .*{re.escape(reason)}")

    def test_test_headers(self) -> None:
        for header in [
            "@test(name='x')\nsubroutine one()",
            "@test ! why\nsubroutine one()",
            "@test\nsubroutine one(this)",
            "@test\npure subroutine one()",
            "@test\ninteger :: i\nsubroutine one()",
            "@disable\n@test\nsubroutine one()",
            "@test\n@before\nsubroutine one()",
            "@before\n@disable\nsubroutine one()",
        ]:
            with self.subTest(header):
                text = module("bad", f"{header}\nend subroutine one\n")
                self.assertRegex(self.messages(text), r"bad\.pf:\d+: ")

    def test_whole_files(self) -> None:
        one = "@test\nsubroutine one()\nend subroutine one\n"
        no_funit = "module {name}\n  implicit none\ncontains\n"
        self.assertIn("there is no @test", self.messages(module("bad", "")))
        self.assertIn("must be named 'bad'", self.messages(module("good", one)))
        self.assertIn("there is no 'use funit'", self.messages(module("bad", one, no_funit)))
        self.assertIn("there is no module", self.messages("use funit\n" + one))
        self.assertIn("second module", self.messages(module("bad", one) + module("worse", one)))
        self.assertIn("nothing may follow", self.messages("module bad ! x\nuse funit\n" + one))
        self.assertIn("must be followed", self.messages(module("bad", one) + "@test\n"))
        twice = "@before\nsubroutine a()\nend subroutine\n@before\nsubroutine b()\nend subroutine\n"
        self.assertIn("a second @before", self.messages(module("bad", one + twice)))

    def test_every_mistake_is_reported(self) -> None:
        text = module("bad", "@test\nsubroutine one()\n@fail()\n@fail()\nend subroutine one\n")
        self.assertEqual(self.messages(text).count("unknown annotation"), 2)


class Cmake(unittest.TestCase):
    """The CMake function, in a small project of its own."""

    def test_builds_and_runs_two_modules(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "sub").mkdir()
            one = "@test\nsubroutine {0}()\n@assertEqual({1}, answer())\nend subroutine {0}\n"
            head = HEAD.replace("  use funit\n", "  use other_mod, only: answer\n  use funit\n")
            head = re.sub(r"  use, .*\n", "", head)
            (folder / "one.pf").write_text(module("one", one.format("good", 42), head))
            (folder / "sub/two.pf").write_text(module("two", one.format("bad", 43), head))
            (folder / "other.f90").write_text(
                "module other_mod\n  implicit none\ncontains\n  integer function answer()\n"
                "    answer = 42\n  end function answer\nend module other_mod\n"
            )
            (folder / "CMakeLists.txt").write_text(
                "cmake_minimum_required(VERSION 3.18)\nproject(p Fortran)\nenable_testing()\n"
                f"include({PFUNIT}/add_pfunit_ctest.cmake)\n"
                "add_pfunit_ctest(both TEST_SOURCES one.pf sub/two.pf OTHER_SOURCES other.f90\n"
                "  LINK_LIBRARIES m LABELS unit quick)\n"
            )
            build = folder / "build"
            for command in (
                ["cmake", "-S", name, "-B", f"{build}", f"-DCMAKE_Fortran_COMPILER={COMPILER}"],
                ["cmake", "--build", f"{build}", "-j2"],
            ):
                done = subprocess.run(command, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            test = ["ctest", "--test-dir", f"{build}", "--output-on-failure", "-L", "quick"]
            done = subprocess.run(test, capture_output=True, text=True)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("one_suite.good ... ok", done.stdout)
            self.assertIn("two_suite.bad ... FAILED\ntwo.pf:8: bad: ", done.stdout)
            self.assertIn("2 tests run, 1 failed", done.stdout)


if __name__ == "__main__":
    unittest.main()
