#!/usr/bin/env python3
"""Tests of check_unused.py and check_sizes.py: each rule finds what is planted, and no more."""

from __future__ import annotations

import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import check_sizes
import check_unused

# Everything in it is used, in the ways in which a careless reader would miss it.
LOW = """\
!> A module that others use.
module low_mod
  use, intrinsic :: iso_c_binding, only: c_int, c_double
  implicit none
  private
  public :: wp, shape_t, area, as_text, twice, called_by_c, long => never
  public operator(+)

  integer, parameter :: wp = kind(1.0d0), unused_constant = 3
  public :: unused_constant
  type :: shape_t
    real(wp) :: side
  contains
    procedure, private :: hidden
    procedure :: grow => grow_it, shrink
    generic :: assignment(=) => hidden
  end type shape_t
  interface as_text
    module procedure text_of_real
  end interface as_text
  interface operator(+)
    module procedure add
  end interface operator(+)
  abstract interface
    subroutine callback(x)
      import :: c_double
      real(c_double), intent(in) :: x
    end subroutine callback
  end interface
  include 'more.inc'
end module low_mod
"""
MORE = """\
contains
  pure real(wp) function area(shape) result(a)
    class(shape_t), intent(in) :: shape
    a = shape%side**2
  end function area
  function text_of_real(x) result(text)
    use kinds_mod, only: width
    real(wp), intent(in) :: x
    character(len=width) :: text
    text = 'area, use kinds_mod'
  end function text_of_real
  integer(c_int) function called_by_c() bind(c, name='called_by_c')
    called_by_c = 1
  end function called_by_c
  subroutine twice(x)
    real(wp), intent(inout) :: x
    x = 2*x
  end subroutine twice
"""
HIGH = """\
module high_mod
  use low_mod, only: wp, shape_t, operator(+), text => as_text, & ! continued
    area
  use low_mod, only: &
    twice
  implicit none
  private
  public :: high
contains
  subroutine high(side)
    real(wp), intent(in) :: side
    type(shape_t) :: s
    s = shape_t(side=side) + shape_t(1.0_wp)
    call s%grow()
    call s%shrink()
    print *, text(area(s))
    call inner()
  contains
    subroutine inner()
      call twice(s%side)
    end subroutine inner
  end subroutine high
end module high_mod
"""
MAIN = """\
program main
  use high_mod, only: high
  implicit none
  call high(1.0d0)
end program main
"""
KINDS = "module kinds_mod\n  implicit none\n  integer, parameter, public :: width = 9\nend module\n"


def clean_tree() -> dict[str, str]:
    """Return a small tree in which everything is used."""
    return {
        "src/kinds.f90": KINDS,
        "src/low.f90": LOW.replace(", long => never", ""),
        "src/more.inc": MORE,
        "src/high.f90": HIGH,
        "src/main.f90": MAIN,
        "build/src/copy.f90": "module copy_mod\n  use low_mod, only: gone\nend module copy_mod\n",
    }


class WithTree(unittest.TestCase):
    """Writes trees."""

    def setUp(self) -> None:
        """Make a folder."""
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)

    def write(self, tree: dict[str, str]) -> None:
        """Write the files of a tree."""
        for path, text in tree.items():
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            (self.root / path).write_text(text)


class CheckUnused(WithTree):
    """Each test plants what nothing uses into the clean tree."""

    def expect(self, tree: dict[str, str], *expected: str, notes: tuple[str, ...] = ()) -> None:
        """Expect exactly these findings and notes."""
        self.write(tree)
        checker = check_unused.Checker(self.root)
        self.assertEqual(sorted(checker.run()), sorted(expected))
        self.assertEqual(sorted(checker.notes), sorted(notes))

    def plant(self, path: str, old: str, new: str, *expected: str) -> None:
        """Replace a piece of the clean tree and expect the findings."""
        tree = clean_tree()
        self.assertEqual(tree[path].count(old), 1, old)
        tree[path] = tree[path].replace(old, new)
        self.expect(tree, *expected)

    def test_a_clean_tree_passes(self) -> None:
        self.expect(clean_tree())

    def test_an_import(self) -> None:
        unused = "of low_mod is imported and not used"
        call = "print *, text(area(s))"
        for instead in (
            "print *, text(s%area)",  # a component
            "print *, text(f(area=1))",  # the name of an argument
            "print *, text('area(s)')",  # in a string
            "print *, text(s) ! area",  # in a comment
            "print *, text(area_of(s))",  # a part of a name
        ):
            with self.subTest(instead):
                self.plant("src/high.f90", call, instead, f"src/high.f90:2: area {unused}")
        other_name = "print *, as_text(area(s))"
        self.plant("src/high.f90", call, other_name, f"src/high.f90:2: text {unused}")
        self.plant(
            "src/low.f90",
            "c_int, c_double",
            "c_int, c_double, c_ptr",
            "src/low.f90:3: c_ptr of iso_c_binding is imported and not used",
        )

    def test_an_import_in_a_procedure_and_in_an_included_file(self) -> None:
        finding = "src/more.inc:7: width of kinds_mod is imported and not used"
        self.plant("src/more.inc", "len=width", "len=9", finding)

    def test_an_import_that_a_procedure_hides(self) -> None:
        finding = "src/high.f90:4: twice of low_mod is imported and not used"
        call = "      call twice(s%side)\n"
        for hiding in (
            "      integer :: i, twice(9)\n      twice = 1\n",
            "      use low_mod, only: twice\n" + call,
        ):
            with self.subTest(hiding):
                self.plant("src/high.f90", call, hiding, finding)
        self.plant(
            "src/high.f90",
            "    subroutine inner()\n" + call,
            "    subroutine inner(twice)\n      real(wp) :: twice\n      twice = 1\n",
            finding,
        )

    def test_components_of_a_type_are_no_use(self) -> None:
        self.plant(
            "src/high.f90",
            "contains\n  subroutine high(side)",
            "  type :: t\n    real :: wide = 1\n  end type t\ncontains\n  subroutine high(side)",
        )
        tree = clean_tree()
        tree["src/high.f90"] = (
            tree["src/high.f90"]
            .replace("  implicit none\n", "  use kinds_mod, only: width\n  implicit none\n", 1)
            .replace(
                "contains\n  subroutine high(side)",
                "  type :: t\n    real :: width = 1\n  end type t\n"
                "contains\n  subroutine high(side)",
            )
        )
        self.expect(tree, "src/high.f90:6: width of kinds_mod is imported and not used")

    def test_public_and_used_by_none(self) -> None:
        tree = clean_tree()
        tree["src/high.f90"] = (
            tree["src/high.f90"]
            .replace("use low_mod, only: &\n    twice\n", "implicit none\n")
            .replace("  implicit none\n  implicit none\n", "  implicit none\n")
            .replace("call twice(s%side)", "continue")
        )
        self.expect(tree, "src/low.f90:6: twice is public, and no other file uses it")
        # A generic name counts, and what main alone uses is used.
        tree = clean_tree()
        without = HIGH.replace("text => as_text, ", "").replace("text(area(s))", "area(s)")
        tree["src/high.f90"] = without
        self.expect(tree, "src/low.f90:6: as_text is public, and no other file uses it")

    def test_what_others_use_by_a_bare_use(self) -> None:
        tree = clean_tree()
        rest = HIGH[HIGH.index("  implicit none") :].replace("text(area(s))", "as_text(area(s))")
        tree["src/high.f90"] = "module high_mod\n  use low_mod, text => as_text\n" + rest
        self.expect(tree)

    def test_what_only_tests_use(self) -> None:
        tree = clean_tree()
        tree["src/low.f90"] = tree["src/low.f90"].replace("twice, called", "twice, thrice, called")
        tree["src/more.inc"] += "  subroutine thrice()\n  end subroutine thrice\n"
        tree["tests/test_low.pf"] = (
            "module test_low\n  use low_mod, only: thrice\ncontains\n  @test\n"
            "  subroutine t()\n    call thrice()\n    @assertTrue(.true.)\n"
            "  end subroutine t\nend module test_low\n"
        )
        note = "src/low.f90:6: note: thrice is public, {}, only tests/test_low.pf"
        self.expect(tree, notes=(note.format("src does not use it at all"),))
        tree["src/more.inc"] = tree["src/more.inc"].replace("    x = 2*x\n", "    call thrice()\n")
        self.expect(tree, notes=(note.format("no other file of src uses it"),))
        # The test needs what it imports too.
        tree["tests/test_low.pf"] = tree["tests/test_low.pf"].replace("call thrice()", "continue")
        self.expect(
            tree,
            "tests/test_low.pf:2: thrice of low_mod is imported and not used",
            notes=(note.format("no other file of src uses it"),),
        )

    def test_what_is_handed_on(self) -> None:
        tree = clean_tree()
        tree["src/high.f90"] = HIGH.replace("public :: high", "public :: high, twice")
        self.expect(tree, "src/high.f90:8: twice is public, and no other file uses it")
        tree["src/main.f90"] = tree["src/main.f90"].replace("only: high", "only: high, twice")
        tree["src/main.f90"] = tree["src/main.f90"].replace("call high", "call twice")
        self.expect(tree, "src/main.f90:2: high of high_mod is imported and not used")

    def test_a_bound_procedure_that_nothing_calls(self) -> None:
        finding = "src/low.f90:15: shrink is bound to a type, and nothing calls it"
        self.plant("src/high.f90", "    call s%shrink()\n", "", finding)

    def test_the_command_line(self) -> None:
        self.write(clean_tree())
        for add, status, says in (("", 0, "4 files, 0 findings"), ("x", 1, "1 findings")):
            if add:
                text = MAIN.replace("implicit", "use kinds_mod, only: width\n  implicit")
                (self.root / "src/main.f90").write_text(text)
            with contextlib.redirect_stdout(io.StringIO()) as out:
                self.assertEqual(check_unused.main([str(self.root)]), status)
            self.assertIn(says, out.getvalue())
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(check_unused.main([str(self.root / "absent")]), 1)


class CheckSizes(WithTree):
    """Files and procedures at their limits and over them."""

    def long_ones(self, tree: dict[str, str]) -> list[str]:
        """Return the messages for a tree."""
        self.write(tree)
        return [message for _, message in check_sizes.long_ones(self.root / "src")]

    def procedure(self, lines: int, inner: str = "") -> str:
        """Return a module whose one procedure has so many lines of its own."""
        body = "    i = 1\n" * (lines - 2 - (1 if inner else 0))
        contains = f"  contains\n{inner}" if inner else ""
        return (
            f"module a_mod\ncontains\n  pure subroutine a()\n{body}{contains}  end subroutine a\n"
            "end module a_mod\n"
        )

    def test_a_procedure(self) -> None:
        self.assertEqual(self.long_ones({"src/a.f90": self.procedure(80)}), [])
        found = self.long_ones({"src/a.f90": self.procedure(81)})
        self.assertEqual(found, ["src/a.f90:3: a has 81 lines, over 80"])

    def test_a_procedure_within_counts_by_itself(self) -> None:
        inner = "    subroutine b()\n" + "      j = 2\n" * 79 + "    end subroutine b\n"
        found = self.long_ones({"src/a.f90": self.procedure(80, inner)})
        self.assertEqual(found, ["src/a.f90:82: b has 81 lines, over 80"])

    def test_a_file(self) -> None:
        text = "module a_mod\n" + "! x\n" * 398 + "end module a_mod\n"
        self.assertEqual(self.long_ones({"src/a.f90": text}), [])
        text = "module a_mod\n" + "! x\n" * 399 + "end module a_mod\n"
        self.assertEqual(self.long_ones({"src/a.f90": text}), ["src/a.f90:1: 401 lines, over 400"])

    def test_the_longest_comes_first_and_nothing_fails(self) -> None:
        tree = {"src/a.f90": self.procedure(90), "src/b/c.f90": self.procedure(100)}
        found = self.long_ones(tree)
        self.assertEqual([line.split(":")[0] for line in found], ["src/b/c.f90", "src/a.f90"])
        with contextlib.redirect_stdout(io.StringIO()) as out:
            self.assertEqual(check_sizes.main([str(self.root / "src")]), 0)
        self.assertEqual(out.getvalue().splitlines(), found)
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(check_sizes.main([str(self.root / "absent")]), 1)


if __name__ == "__main__":
    unittest.main()
