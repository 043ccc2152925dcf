#!/usr/bin/env python3
"""The mutants that are made of a few lines of Fortran: which, and that each is one change."""

import re
import unittest
from pathlib import Path

from mutants import mutants_of
from mutate import CASES
from wrong_solver import MISTAKES, ROOT

SOURCE = """\
!> A module: max(a, b) + 1 in words is not code.
module sample_mod
  implicit none
  real(wp), parameter :: tolerance = 1.0e-8_wp !! + 1
  integer, parameter :: axis(3) = [1, 2, 3]
contains
  pure subroutine work(n, x, y, ok)
    integer, intent(in) :: n
    real(wp), intent(inout) :: x(:), y(3, n)
    logical, intent(out) :: ok
    integer :: i

    ok = .false.
    do i = 1, n
      if (x(i) <= tiny(1.0_wp) .or. .not. i > 2) cycle
      x(i) = max(x(i), -y(1, i))*0.5_wp &
        - 1.5e-3_wp
      text = 'a - b < c'//' > '
      p => x
    end do
    call other(x(i + 1:), &
      y)
  end subroutine work
end module sample_mod
"""

SUMS = """\
module sums_mod
contains
  subroutine work(a, b)
    x = a + b*f(c, d) - 1.0e-3_wp*e/g
    y = a - b &
      + c*d
    z = a + f(b, &
      c - 1)
    if (a > b + c .and. &
      d) then
      w = -a
    else if (a > 0) then
      w = a
    end if
  end subroutine work
end module sums_mod
"""


class Mutants(unittest.TestCase):
    def setUp(self):
        self.mutants = mutants_of("room/sample.f90", SOURCE)
        self.sums = mutants_of("room/sums.f90", SUMS)
        self.lines = SOURCE.splitlines()

    def new_lines(self, kind):
        return [m.new for m in self.mutants if m.kind == kind]

    def test_terms_and_branches(self):
        """A term with all of its factors; a term that goes on in another line stays."""
        self.assertEqual(
            [m.new for m in self.sums if m.kind == "term"],
            [
                "x = a - 1.0e-3_wp*e/g",
                "x = a + b*f(c, d)",
                "y = a &",
                "if (a > b .and. &",
            ],
        )
        branches = [(m.new, m.last - m.first) for m in self.sums if m.kind == "branch"]
        self.assertEqual(branches, [("if (.false.) then", 1), ("else if (.false.) then", 0)])

    def test_what_is_changed(self):
        condition = "if (x(i) <= tiny(1.0_wp) .or. .not. i > 2) cycle"
        assignment = "x(i) = max(x(i), -y(1, i))*0.5_wp &"
        self.assertEqual(
            self.new_lines("sign"),
            [
                assignment.replace("-y", "y"),
                assignment.replace("*", "/"),
                "+ 1.5e-3_wp",
                "call other(x(i - 1:), &",
            ],
        )
        self.assertEqual(
            self.new_lines("comparison"),
            [
                condition.replace("<=", ">"),
                condition.replace("> 2", "<= 2"),
                condition.replace("> 2", ">= 2"),
            ],
        )
        self.assertEqual(
            self.new_lines("logic"),
            [condition.replace(".or.", ".and."), condition.replace(".not. ", "")],
        )
        self.assertEqual(self.new_lines("min/max"), [assignment.replace("max", "min")])
        self.assertEqual(
            self.new_lines("cap"),
            [assignment.replace("max(x(i), -y(1, i))", one) for one in ("(x(i))", "(-y(1, i))")],
        )
        self.assertEqual(self.new_lines("term"), [])
        self.assertEqual(
            self.new_lines("constant"),
            [
                "real(wp), parameter :: tolerance = 1.0e-7_wp !! + 1",
                "ok = .true.",
                assignment.replace("0.5_wp", "1.5_wp"),
                "- 1.5e-2_wp",
            ],
        )
        dropped = [m.old for m in self.mutants if m.kind == "dropped"]
        self.assertEqual(
            dropped,
            [
                "ok = .false.",
                condition,
                assignment + " - 1.5e-3_wp",
                "text = 'a - b < c'//' > '",
                "call other(x(i + 1:), & y)",
            ],
        )

    def test_indices(self):
        index = self.new_lines("index")
        self.assertIn("do i = 2, n", index)
        self.assertIn("do i = 0, n", index)
        self.assertIn("integer, parameter :: axis(3) = [1, 3, 3]", index)
        self.assertIn("x(i - 1) = max(x(i), -y(1, i))*0.5_wp &", index)
        self.assertIn("x(i) = max(x(i), -y(1, i + 1))*0.5_wp &", index)
        self.assertNotIn("integer, parameter :: axis(4) = [1, 2, 3]", index)
        self.assertFalse([line for line in index if "text" in line or "=>" in line])

    def test_each_is_one_change_of_the_file(self):
        for mutant in self.mutants:
            changed = mutant.apply(self.lines)
            self.assertEqual(len(changed), len(self.lines))
            different = [
                n for n, (a, b) in enumerate(zip(self.lines, changed, strict=True), 1) if a != b
            ]
            self.assertTrue(different)
            self.assertTrue(set(different) <= set(range(mutant.first, mutant.last + 1)))

    def test_names_outlive_edits_elsewhere(self):
        names = [m.name for m in self.mutants]
        self.assertEqual(len(names), len(set(names)))
        edited = SOURCE.replace("    integer :: i\n", "    integer :: i\n    ! more\n    n = 7\n")
        self.assertTrue(set(names) <= {m.name for m in mutants_of("room/sample.f90", edited)})

    def test_rooms_and_cases_are_there(self):
        tests = {path.stem.replace("test_", "case_") for path in (ROOT / "tests").rglob("*.py")}
        for room, cases in CASES.items():
            self.assertTrue((ROOT / "src" / room).is_dir(), room)
            self.assertLessEqual({case.split()[0] for case in cases}, tests)

    def test_the_source_of_the_program_is_understood(self):
        source = Path(__file__).resolve().parents[2] / "src"
        for path in sorted(source.rglob("*.f90")):
            text = path.read_text()
            names = [m.name for m in mutants_of(str(path.relative_to(source)), text)]
            self.assertEqual(len(names), len(set(names)), path)
            # Files of declarations have little to change, and interfaces of libraries nothing.
            own = re.sub(
                r"\n  (?:abstract )?interface\n.*?\n  end interface\n", "\n", text, flags=re.S
            )
            if own.count("\n") > 100:
                self.assertGreater(len(names), 10, path)


class Mistakes(unittest.TestCase):
    """What is put into the solver to see whether the certificate notices."""

    def test_texts(self):
        """The text of each stands once in its file."""
        for mistake in MISTAKES:
            with self.subTest(mistake.name):
                text = (ROOT / "src" / mistake.file).read_text(encoding="utf-8")
                self.assertEqual(text.count(mistake.old), 1)


if __name__ == "__main__":
    unittest.main()
