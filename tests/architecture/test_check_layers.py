#!/usr/bin/env python3
"""Tests of check_layers.py: a clean tree passes, and each rule catches its planted violation."""

from __future__ import annotations

import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import check_layers

FILES = [
    "base/kinds",
    "base/errors",
    "machine/libc",
    "machine/system",
    "machine/parallel",
    "model/mesh",
    "model/controls",
    "model/plan",
    "elements/cube",
    "deck/reader",
    "equations/metis_graph",
    "factors/mumps_double",
    "certificate/certificate",
    "contact/solvers/problem",
    "contact/solvers/solve",
    "increment/advance",
    "hdf5/hdf5_files",
    "hdf5/hdf5_rows",
    "fclib/fclib",
    "run/run",
]


SEES = {
    "base": "",
    "machine": "base",
    "model": "base",
    "elements": "base model",
    "deck": "base model elements",
    "equations": "base machine model elements",
    "factors": "base equations",
    "certificate": "base model",
    "contact/solvers": "base model",
    "increment": "base model equations certificate contact/solvers",
    "hdf5": "base machine",
    "fclib": "base contact/solvers increment hdf5",
    "run": "base machine model increment hdf5 fclib",
    "app": "base run",
}


def rooms() -> str:
    """Return the text that adds the rooms with their files, with traps for a careless reader."""
    text = "# add_room(base FILES base/unwanted.f90) in a comment\nfunction(add_room room)\n"
    for room, seen in SEES.items():
        files = [f for f in [*FILES, "app/main"] if f.rpartition("/")[0] == room]
        text += f"add_room({room} # a comment (more)\n  SEES {seen}\n  FILES\n"
        text += "".join(f"  {path}.f90  # lowest first\n" for path in files) + ")\n"
    return text + "set_source_files_properties(base/kinds.f90 PROPERTIES X y)\n"


def module(path: str, specification: str = "", procedures: str = "") -> str:
    """Return the text of a clean module with the given lines added."""
    name = path.rpartition("/")[2]
    return (
        f"!> The module {name}.\nmodule {name}_mod\n{specification}\n"
        f"  implicit none\n  private\n  public :: n_{name}\n"
        f"  integer, parameter :: n_{name} = 1\ncontains\n{procedures}\n"
        f"end module {name}_mod\n"
    )


def clean_tree() -> dict[str, str]:
    """Return a small source tree that keeps every rule, with traps for a careless reader."""
    tree = {f"{path}.f90": module(path) for path in FILES}
    tree["app/main.f90"] = (
        "program bipot\n  use run_mod, only: n_run\n  implicit none\n"
        "  if (n_run > 1) error stop 'no'\n  stop\nend program bipot\n"
    )
    tree["machine/system.f90"] = module(
        "machine/system",
        procedures="  subroutine s()\n    integer :: i\n    i = 1\n  end subroutine",
    ).replace("contains", "  integer, volatile, save :: flag(2) = [0, 1], other = 0\ncontains", 1)
    tree["model/mesh.f90"] = """\
! use plan_mod, stop, call exit(1): a comment
module mesh_mod
  use, intrinsic :: iso_c_binding, only: c_int
  use kinds_mod, & ! the kinds

    & only: n_kinds; use :: errors_mod, only: n_errors
  implicit none ; private
  public :: mesh_t, make
  character(len=*), parameter :: text = 'it''s; stop & use plan_mod'
  character(len=9), parameter :: long = 'a &
    &stop'
  type, abstract :: base_t
    integer :: i
  contains
    procedure(make), deferred :: make
  end type base_t
  type mesh_t
    type(mesh_t), pointer :: next => null()
    real :: x
  end type
  abstract interface
    subroutine make(x)
      import :: base_t
      class(base_t), intent(in) :: x
      integer :: y
    end subroutine make
  end interface
  interface
    module subroutine other(x)
      integer, intent(in) :: x
    end subroutine other
  end interface
  integer(c_int), parameter :: &
    one = 1
contains
  subroutine local(use_it)
    integer, intent(inout) :: use_it
    integer :: stop_now, exit_now
    character(len=20) :: metis, say
    say = "stop"
    stop_now = use_it
    exit_now = 1
    if (stop_now == 1) exit_now = 2
    print *, 'call dmumps(x)', "mpi_init" // 'error stop', metis, n_kinds
  end subroutine local
end module mesh_mod
"""
    tree["machine/parallel.f90"] = module("machine/parallel", "  use mpi, only: mpi_comm_world")
    tree["equations/metis_graph.f90"] = module(
        "equations/metis_graph",
        procedures="  subroutine s()\n    call metis_nodend()\n  end subroutine s",
    )
    tree["factors/mumps_double.f90"] = module(
        "factors/mumps_double",
        procedures="  subroutine s()\n    include 'dmumps_struc.h'\n"
        "    type(dmumps_struc) :: id\n    call dmumps(id)\n  end subroutine s",
    )
    tree["hdf5/hdf5_files.f90"] = module("hdf5/hdf5_files", "  use hdf5\n  use h5lt, only: x")
    tree["hdf5/hdf5_rows.f90"] = module(
        "hdf5/hdf5_rows",
        "  use hdf5\n  use hdf5_files_mod, only: n_hdf5_files",
        "  subroutine s()\n    call h5dset_extent_f()\n  end subroutine s",
    )
    tree["fclib/fclib.f90"] = module("fclib/fclib", "  use problem_mod, only: n_problem")
    tree["certificate/certificate.f90"] = module(
        "certificate/certificate", "  use mesh_mod, only: n_mesh"
    )
    tree["increment/advance.f90"] = module(
        "increment/advance", "  use mesh_mod, only: n_mesh\n  use solve_mod, only: n_solve"
    )
    tree["run/run.f90"] = module("run/run", "  use fclib_mod, only: n_fclib")
    tree["CMakeLists.txt"] = rooms()
    return tree


class CheckLayers(unittest.TestCase):
    """Each test plants one violation into the clean tree."""

    def violations(self, tree: dict[str, str]) -> list[str]:
        """Write the tree and check it; paths are relative to src."""
        with tempfile.TemporaryDirectory() as name:
            src = Path(name)
            for path, text in tree.items():
                (src / path).parent.mkdir(parents=True, exist_ok=True)
                (src / path).write_text(text)
            found = check_layers.Checker(src).run()
            return [v.removeprefix(f"{src}/") for v in found]

    def expect(self, tree: dict[str, str], *starts: str) -> None:
        """Expect exactly these violations, given by how they start."""
        found = self.violations(tree)
        self.assertEqual(len(found), len(starts), found)
        for violation, start in zip(sorted(found), sorted(starts), strict=True):
            self.assertTrue(violation.startswith(start), f"{violation!r} is not {start!r}")

    def plant(self, path: str, specification: str, *messages: str, procedures: str = "") -> None:
        """Give a module new lines and expect the violations, all on line 3 or in procedures."""
        tree = clean_tree()
        tree[f"{path}.f90"] = module(path, specification, procedures)
        line = 3 if specification else 9
        self.expect(tree, *(f"{path}.f90:{line}: {m}" for m in messages))

    def test_a_clean_tree_passes(self) -> None:
        self.expect(clean_tree())

    def test_use_of_a_later_file(self) -> None:
        late = "use of plan_mod: it is not listed before this file"
        self.plant("model/mesh", "  use plan_mod, only: n_plan", late)
        own = "use of mesh_mod: it is not listed before this file"
        self.plant("model/mesh", "  USE Mesh_Mod, ONLY: n_mesh", own)

    def test_listing(self) -> None:
        tree = clean_tree()
        tree["model/extra.f90"] = module("model/extra")
        self.expect(tree, "model/extra.f90:1: is not listed")
        tree = clean_tree()
        del tree["base/kinds.f90"]
        self.expect(
            tree,
            "CMakeLists.txt:6: base/kinds.f90 is listed but absent",
            "model/mesh.f90:4: use of",
        )
        tree = clean_tree()
        text = tree["CMakeLists.txt"]
        tree["CMakeLists.txt"] = text.replace("  app/main.f90", "  app/main.f90 app/main.f90")
        line = text[: text.index("  app/main.f90")].count("\n") + 1
        self.expect(tree, f"CMakeLists.txt:{line}: app/main.f90 is listed twice")
        self.expect({"CMakeLists.txt": "project(x)\n"}, "CMakeLists.txt:1: lists no source")
        self.expect({"base/kinds.f90": module("base/kinds")}, "CMakeLists.txt:1: there is no such")
        other = {"CMakeLists.txt": "add_room(base FILES x/a.f90)", "x/a.f90": module("x/a")}
        self.expect(other, "CMakeLists.txt:1: x/a.f90 is no file of the room base")

    def test_rooms(self) -> None:
        for path, used in [
            ("elements/cube", "base/kinds"),
            ("deck/reader", "elements/cube"),
            ("equations/metis_graph", "elements/cube"),
            ("increment/advance", "contact/solvers/solve"),
            ("increment/advance", "equations/metis_graph"),
            ("fclib/fclib", "contact/solvers/problem"),
            ("run/run", "fclib/fclib"),
        ]:
            name = used.rpartition("/")[2]
            self.plant(path, f"  use {name}_mod, only: n_{name}")
        for path, used in [
            ("equations/metis_graph", "deck/reader"),
            ("contact/solvers/solve", "deck/reader"),
            ("contact/solvers/solve", "equations/metis_graph"),
            ("contact/solvers/solve", "certificate/certificate"),
            ("increment/advance", "deck/reader"),
            ("hdf5/hdf5_files", "increment/advance"),
            ("hdf5/hdf5_files", "elements/cube"),
            ("hdf5/hdf5_files", "equations/metis_graph"),
        ]:
            name = used.rpartition("/")[2]
            rooms = path.rpartition("/")[0], used.rpartition("/")[0]
            message = f"use of {name}_mod: {rooms[0]} may not use {rooms[1]}"
            self.plant(path, f"  use {name}_mod, only: n_{name}", message)

    def test_an_increment_knows_no_files(self) -> None:
        tree = clean_tree()
        use = "  use fclib_mod, only: n_fclib"
        tree["increment/advance.f90"] = module("increment/advance", use)
        self.expect(
            tree,
            "increment/advance.f90:3: use of fclib_mod: increment may not use fclib",
            "increment/advance.f90:3: use of fclib_mod: it is not listed before",
        )

    def test_base_uses_nothing(self) -> None:
        tree = clean_tree()
        tree["base/kinds.f90"] = module("base/kinds", "  use mesh_mod, only: n_mesh")
        self.expect(
            tree,
            "base/kinds.f90:3: use of mesh_mod: base may not use model",
            "base/kinds.f90:3: use of mesh_mod: it is not listed before",
        )

    def test_what_a_room_sees_of_another(self) -> None:
        seen = "model/controls.f90, model/friction_laws.f90, model/increment_report.f90"
        only = f"contact/solvers may use of model only {seen}"
        use = "  use mesh_mod, only: mesh_t"
        self.plant("contact/solvers/solve", use, f"use of mesh_mod: {only}")
        self.plant("contact/solvers/solve", "  use controls_mod, only: n_controls")

    def test_the_certificate_is_independent(self) -> None:
        path = "certificate/certificate"
        for used in ("equations/metis_graph", "contact/solvers/problem"):
            room, _, name = used.rpartition("/")
            tree = clean_tree()
            # Listed last of all: what is refused is the room, not the place.
            before, rest = tree["CMakeLists.txt"].split("add_room(certificate", 1)
            own, rest = rest.split("\n)\n", 1)
            tree["CMakeLists.txt"] = before + rest + f"add_room(certificate{own}\n)\n"
            tree[f"{path}.f90"] = module(path, f"  use {name}_mod, only: n_{name}")
            message = f"use of {name}_mod: certificate may not use {room}"
            self.expect(tree, f"{path}.f90:3: {message}")

    def test_who_sees_the_plan(self) -> None:
        use = "  use plan_mod, only: n_plan"
        self.plant("run/run", use)
        for path in ("deck/reader", "equations/metis_graph", "increment/advance"):
            room = path.rpartition("/")[0]
            self.plant(path, use, f"use of plan_mod: {room} may not see the plan")

    def test_libraries(self) -> None:
        mumps = "only factors/mumps_*.f90 may see MUMPS"
        hdf5 = "only hdf5/hdf5_*.f90 may see HDF5"
        mpi = "only machine/parallel.f90 may see MPI"
        metis = "only equations/metis_graph.f90 may see METIS"
        self.plant("contact/solvers/solve", "  use hdf5", hdf5)
        self.plant("contact/solvers/solve", "  use h5lt, only: x", hdf5)
        self.plant("fclib/fclib", "  use hdf5", hdf5)
        self.plant("contact/solvers/solve", "  use mpi_f08", mpi)
        self.plant("contact/solvers/solve", "  include 'mpif.h'", mpi)
        self.plant("contact/solvers/solve", "  use, non_intrinsic :: mpi, only: mpi_x", mpi)
        self.plant("contact/solvers/solve", "  include 'dmumps_struc.h'", mumps)
        for line, message in [
            ("call dmumps(id)", mumps),
            ("if (x) call smumps(id)", mumps),
            ("type(dmumps_struc) :: id", mumps),
            ("call METIS_NodeND(x)", metis),
            ("call h5open_f(i)", hdf5),
            ("call mpi_init(i)", mpi),
            ("subroutine a() bind(c, &\n    name='METIS_NodeND')", metis),
        ]:
            with self.subTest(line):
                self.plant("contact/solvers/solve", "", message, procedures=line)

    def test_the_c_library(self) -> None:
        declared = """  interface
    subroutine c_sync() bind(c, name='sync')
    end subroutine c_sync
  end interface"""
        for path in ("run/run", "machine/system"):
            for form in (declared, declared.replace("bind(c, ", "bind ( C , ")):
                with self.subTest(path=path, form=form):
                    tree = clean_tree()
                    tree[f"{path}.f90"] = module(path, form)
                    message = "only machine/libc.f90 may declare 'sync'"
                    self.expect(tree, f"{path}.f90:4: {message}")
        uses = "  use libc_mod, only: n_libc"
        alone = "use of libc_mod: only machine and app/main.f90 may see the C library"
        self.plant("run/run", uses, alone)
        # What the program itself gives C is no declaration; the room may use what is declared.
        given = "  subroutine s() bind(c, name='sync')\n  end subroutine s"
        tree = clean_tree()
        tree["machine/system.f90"] = module("machine/system", uses, given)
        tree["machine/libc.f90"] = module("machine/libc", declared)
        self.expect(tree)

    def test_unknown_modules(self) -> None:
        unknown = "use of an unknown module "
        self.plant("contact/solvers/solve", "  use omp_lib, only: x", unknown + "omp_lib")
        self.plant("contact/solvers/solve", "  use gone_mod, only: x", unknown + "gone_mod")

    def test_who_stops(self) -> None:
        for line in [
            "stop",
            "STOP 1",
            "stop 'text'",
            "error stop",
            "errorstop 3",
            "if (a(1) > 2) stop 1",
            "if (a) &\n    error stop 'x'",
            "i = 1; call exit(1)",
            "10 stop",
            "stop (1)",
            "call abort()",
        ]:
            with self.subTest(line):
                message = "only app/main.f90 may stop"
                self.plant("contact/solvers/solve", "", message, procedures=f"  {line}")

    def test_words_of_one_file(self) -> None:
        for line, word in [
            ("if (kind == obstacle_sphere) return", "obstacle_sphere"),
            ("select case (scene%obstacles(i)%kind)", "obstacles(i)%kind"),
            ("flat = obstacle%kind == 1", "obstacle%kind"),
            ("call locate_point(one, shift, x, gap, normal)", "locate_point"),
        ]:
            with self.subTest(line):
                message = f"'{word}' may stand only in "
                self.plant("contact/solvers/solve", "", message, procedures=f"  {line}")
        self.plant("contact/solvers/solve", "", procedures="  n = mesh%kind + is_obstacle_plane")

    def test_names_of_texts_that_functions_make(self) -> None:
        words = (
            "  function words(n) result(text)\n    integer, intent(in) :: n\n"
            "    character(:), allocatable :: text\n    text = 'a'\n  end function words\n"
            "  function letter(n)\n    integer, intent(in) :: n\n"
            "    character(1) :: letter\n    letter = 'a'\n  end function letter\n"
        )
        for made, name in [
            ("words(1)", "words"),
            ("adjustl(line)", "adjustl"),
            ("trim(words(1))", "words"),
        ]:
            with self.subTest(made):
                lines = f"  associate (n => 1, t => {made})\n{words}"
                message = f"no associate name may stand for the text that {name} makes"
                self.plant("contact/solvers/solve", "", message, procedures=lines)
        lines = f"  associate (a => letter(1), b => line%words(2), c => trim(line))\n{words}"
        self.plant("contact/solvers/solve", "", procedures=lines)

    def test_numbers_of_nodes(self) -> None:
        for line in ("real :: x(3, 8)", "integer, intent(in) :: nodes(8)", "do a = 1, 8"):
            with self.subTest(line):
                self.plant("run/run", "", "8 or 24 nodes: ask the table", procedures=f"  {line}")
                self.plant("elements/cube", "", procedures=f"  {line}")

    def test_who_changes_a_scene(self) -> None:
        for line in [
            "type(scene_t), intent(inout) :: scene",
            "type (scene_t), intent (in out) :: deck",
            "type(scene_t), intent(out) :: scene",
            "scene%steps(2)%direct = .false.",
            "if (n(1) == 1) scene%notes = [scene%notes, notes]",
            "deck%mesh%body(i) => body",
        ]:
            with self.subTest(line):
                message = (
                    "only contact/mirror_scene.f90, contact/take_as_rigid.f90, "
                    "deck/named_sets.f90, deck/read_deck.f90, model/part_of_scene.f90, "
                    "run/prepare_scene.f90 may"
                )
                self.plant("run/run", "", message, procedures=f"  {line}")
        for line in [
            "type(scene_t), intent(in), target :: scene",
            "type(scene_t) :: scene",
            "if (scene%steps(1)%direct .eqv. is_direct) n = 1",
            "call plan(scene%mesh, error=error)",
            "n = scene%mesh%n_nodes",
        ]:
            with self.subTest(line):
                self.plant("run/run", "", procedures=f"  {line}")

    def test_who_reads_what_the_program_may_choose(self) -> None:
        for word in ["scene%precision", "scene%contact%tolerance", "scene%contact%compliance"]:
            with self.subTest(word):
                message = f"'{word}' may stand only in "
                self.plant("run/run", "", message, procedures=f"  n = {word}")
        self.plant("run/run", "", procedures="  n = scene%contact%solver + choices%tolerance")

    def test_types_that_keep_their_entries(self) -> None:
        def tree_with(components: str) -> dict[str, str]:
            tree = clean_tree()
            path = "contact/solvers/compliance"
            lines = f"  type :: compliance_t\n{components}    real :: w(3, 3)\n  end type"
            tree[f"{path}.f90"] = module(path, lines, "")
            tree["CMakeLists.txt"] = tree["CMakeLists.txt"].replace(
                "  contact/solvers/solve.f90", f"  {path}.f90\n  contact/solvers/solve.f90"
            )
            return tree

        self.expect(tree_with("    private\n"))
        message = "the components of compliance_t must be private"
        self.expect(tree_with(""), f"contact/solvers/compliance.f90:1: {message}")

    def test_only(self) -> None:
        without = "use of kinds_mod without 'only'"
        self.plant("contact/solvers/solve", "  use kinds_mod", without)
        self.plant("contact/solvers/solve", "  use kinds_mod, n => n_kinds", without)
        self.plant("contact/solvers/solve", "", without, procedures="  use :: kinds_mod")
        tree = clean_tree()
        tree["app/main.f90"] = tree["app/main.f90"].replace(", only: n_run", "")
        self.expect(tree, "app/main.f90:2: use of run_mod without 'only'")

    def test_one_module_named_after_the_file(self) -> None:
        tree = clean_tree()
        tree["deck/reader.f90"] = module("deck/other")
        self.expect(tree, "deck/reader.f90:2: the module must be named reader_mod")
        tree["deck/reader.f90"] = module("deck/reader") + module("deck/other")
        self.expect(tree, "deck/reader.f90:1: holds 2 modules")
        tree["deck/reader.f90"] = "subroutine x()\nend subroutine x\n"
        self.expect(tree, "deck/reader.f90:1: holds 0 modules")
        tree["deck/reader.f90"] = module("deck/reader") + "program x\nend program x\n"
        self.expect(tree, "deck/reader.f90:11: only a module")
        tree = clean_tree()
        tree["app/main.f90"] += module("app/main")
        self.expect(tree, "app/main.f90:8: holds a module")

    def test_implicit_none_and_private(self) -> None:
        tree = clean_tree()
        clean = module("deck/reader")
        tree["deck/reader.f90"] = clean.replace("  implicit none\n", "")
        self.expect(tree, "deck/reader.f90:2: the module has no 'implicit none'")
        tree["deck/reader.f90"] = clean.replace("  private\n", "  private :: n_reader\n")
        self.expect(tree, "deck/reader.f90:2: the module has no 'private'")
        # In a procedure it does not count for the module.
        inside = "  subroutine s()\n    implicit none\n  end subroutine s"
        text = module("deck/reader", procedures=inside).replace("  implicit none\n  private", "")
        tree["deck/reader.f90"] = text.replace("contains", "  private\ncontains")
        self.expect(tree, "deck/reader.f90:2: the module has no 'implicit none'")

    def test_module_variables(self) -> None:
        for line in [
            "integer :: i",
            "integer i",
            "real(wp), allocatable :: parameter_of_x(:)",
            "type(x_t), save :: x",
            "class(x_t), pointer :: x => null()",
            "procedure(x), pointer :: p",
            "character(len=9), &\n    protected :: c",
            "double precision d",
        ]:
            with self.subTest(line):
                self.plant("contact/solvers/solve", f"  {line}", "module variable")
        self.plant("contact/solvers/solve", "  save", "module variables: 'save'")
        tree = clean_tree()
        text = tree["machine/system.f90"]
        tree["machine/system.f90"] = text.replace("other = 0", "other = 0, third")
        self.expect(tree, "machine/system.f90:8: module variable")
        tree["machine/system.f90"] = text.replace("contains", "  logical :: other\ncontains", 1)
        self.expect(
            tree, "machine/system.f90:8: module variable", "machine/system.f90:9: module variable"
        )

    def test_edges_that_nothing_uses(self) -> None:
        text = "add_room(base FILES base/a.f90)\nadd_room(laws SEES base FILES laws/b.f90)\n"
        for use, found in [
            ("", ["CMakeLists.txt:1: laws sees base and uses none of it"]),
            ("  use a_mod, only: n_a", []),
        ]:
            with tempfile.TemporaryDirectory() as name, self.subTest(use):
                src = Path(name)
                for path, lines in [("base/a", ""), ("laws/b", use)]:
                    (src / path).parent.mkdir()
                    (src / f"{path}.f90").write_text(module(path, lines))
                (src / "CMakeLists.txt").write_text(text)
                checker = check_layers.Checker(src)
                checker.run()
                checker.check_edges()
                violations = [v.removeprefix(f"{src}/") for v in checker.violations]
                self.assertEqual(violations, found)

    def test_the_command_line(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                status = check_layers.main([name])
            self.assertEqual(status, 1)
            self.assertIn("0 files, 1 violations", out.getvalue())


if __name__ == "__main__":
    unittest.main()
