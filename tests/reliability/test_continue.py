"""`--continue` ends with the file of a run that was never stopped, or says why it cannot."""

import os
import resource
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
from result_checks import HERE, INPUT, NAME, PROGRAM, Case, Folder, Whole, fresh_folder, rows_in

sys.path.append(str(HERE.parent / "cases"))
from boxes import DRY, FLOOR, MATERIAL, Box

# Every deck of input/ but fall.inp, which has no solution, in a size that takes little time.
SMALL = {
    "ball": {"n": 6, "steps": 4},
    "bend": {},
    "block": {"n": 3, "steps": 10},
    "bolt": {"n": 1},
    "bracket": {"n": 2, "steps": 4},
    "cantilever": {},
    "corner": {"n": 3},
    "cylinder": {"steps": 3, "mu": 0.1},
    "foundation": {"n": 2, "base": 3, "steps": 6},
    "gasket": {"n": 2, "steps": 3},
    "grip": {},
    "hertz": {"n": 6, "steps": 4},
    "incompressible": {},
    "indent": {"n": 2, "times": 2, "steps": 2},
    "ironing": {"n": 2, "steps": 3},
    "mindlin": {"n": 12, "steps": 3},
    "patch": {"n": 2},
    "pipe": {},
    "press": {"steps": 3},
    "punch": {"steps": 2},
    "quarter": {"n": 4, "steps": 6},
    "rest": {},
    "roller": {"n": 4},
    "rubber": {"n": 2, "steps": 4},
    "seal": {"n": 2, "steps": 3},
    "slope": {"n": 3},
    "spence": {"n": 6, "steps": 4},
    "ssnv128": {"n": 4, "steps": 4},
    "stack": {"n": 2, "steps": 4},
    "tool": {"n": 4, "steps": 3},
    "wheel": {"n": 8, "steps": 2},
}

RELEASE = os.environ.get("BIPOT_BUILD_TYPE", "Release") == "Release"
LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")
# Those whose states have something that others have not; the rest in the long form.
DIFFERENT = ("block", "foundation", "ironing", "mindlin", "rubber", "slope", "wheel")

# A step behind those of the block in which nothing balances the loads any more.
PULLED_OFF = """*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY, OP=NEW
BODY-ZMAX, 3, 3, -0.1
*CLOAD
BODY-ZMAX, 1, 1e6
*END STEP
"""

# Without DIRECT: contact begins inside increment 2, and the way along x turns inside others.
EVENTS = """*BLOCK, NAME=B, NX=4, NY=4, NZ=3
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., -0.006,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*AMPLITUDE, NAME=A
0., 0., 0.23, 1., 0.4, 0.2, 1., 1.
*STEP
*STATIC
0.2, 1.
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, -0.02
*END STEP
*STEP
*STATIC
0.1, 1.
*BOUNDARY, AMPLITUDE=A
B-ZMAX, 1, 1, 0.02
*END STEP
"""


# Small strain is off by more than a tenth.
PRESSED = """*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC, LAW=SVK
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*STEP
*STATIC
0.2, 1.
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, -0.07
*END STEP
"""


# A tool that turns, a grip that is turned and loaded, and a node that says how far sides part.
REFERENCES = """*NODE
1, 0.5, 0.5, 8.
*BLOCK, NAME=B, NX=3, NY=3, NZ=3
0., 0., 0.,  1., 1., 1.
*NODE
901, 0.5, 0.5, -9.
902, 30., 0., 0.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE, REF NODE=1
0., 0., 1.,  0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMAX, O
*NSET, NSET=LEFT
22, 38
*NSET, NSET=RIGHT
25, 41
*EQUATION
3
RIGHT, 1, 1., LEFT, 1, -1., 902, 1, -1.
*COUPLING, REF NODE=901, SURFACE=B-ZMIN
*KINEMATIC
*STEP
*STATIC, DIRECT
0.2, 1.
*BOUNDARY
1, 1, 2
1, 3, 3, -0.02
901, 1, 5
902, 1, 1, 0.004
*CLOAD
901, 6, 0.5
*NODE FILE, FREQUENCY=2
U, RF, CF
*END STEP
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
1, 6, 6, 0.1
*END STEP
"""


# A rigid plate from a file, pressed on a block and turned.
DIE = """*BLOCK, NAME=B, NX=3, NY=3, NZ=2
0., 0., 0.,  1., 1., 1.
*NODE
900, 0.5, 0.5, 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=STL, INPUT=die.stl, REF NODE=900
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMAX, O
*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
B-ZMIN, 1, 3
900, 1, 2
900, 3, 3, -0.02
*END STEP
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
900, 6, 6, 0.1
*END STEP
"""
DIE_FILE = """solid die
facet normal 0 0 0 outer loop vertex -1 -1 1 vertex 2 2 1 vertex 2 -1 1.01 endloop endfacet
facet normal 0 0 0 outer loop vertex -1 -1 1 vertex -1 2 {height} vertex 2 2 1 endloop endfacet
endsolid die
"""


# Supports aslant that come and go, and sets of which tables are written.
PRINTED = """*BLOCK, NAME=B, NX=3, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, TYPE=PLANE
0., 0., 0.,  0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
B-ZMIN, O
*TRANSFORM, NSET=B-ZMAX
2., 1., 0.5,  -1., 3., 0.4
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY
B-ZMAX, 1, 2
B-ZMAX, 3, 3, -0.02
*NODE PRINT, NSET=B-ZMAX, TOTALS=YES, FREQUENCY=2
U, RF
*EL PRINT, ELSET=B, POSITION=CENTROIDAL
S
*END STEP
*STEP
*STATIC, DIRECT
0.25, 1.
*BOUNDARY, OP=NEW
B-ZMAX, 1, 1, 0.01
B-ZMAX, 3, 3, -0.02
*CLOAD
B-ZMAX, 2, 0.05
*END STEP
"""


class EveryDeck(Folder):
    """Killed in the middle of its run and continued, every deck ends with the same file."""

    def check(self, case, kills=(0.35, 0.8)):
        """Kill at shares of the writes and continue; but in the long form at some of them."""
        folder = self.fresh("whole")
        n = case.count_changes(folder)
        whole = Whole(folder / NAME)
        shares = kills if LONG else kills[1::2] if RELEASE else kills[len(kills) // 2 :: 6]
        for share in shares:
            with self.subTest(deck=str(case), share=share):
                folder = self.fresh("killed")
                self.assertTrue(case.kill_at(folder, int(share * n)))
                rows = rows_in(folder / NAME)
                status, words = case.run(folder, "--continue")
                self.assertEqual(status, 0, words)
                self.assertEqual(whole.differences(folder / NAME), [])
                self.assertGreaterEqual(whole.rows, rows)

    def test_decks_of_input(self):
        self.assertEqual(set(SMALL), {p.stem for p in INPUT.glob("*.inp")} - {"fall", "column"})
        for name, overrides in SMALL.items():
            if LONG or name in DIFFERENT:
                self.check(Case(INPUT / f"{name}.inp", **overrides))

    def test_increments_that_are_counted_together(self):
        """Of a fast run several are, with the state that the last of them ended in."""
        words = {"n": 3, "steps": 40, "solver": "AUTO", "local": "AUTO"}
        block = INPUT / "block.inp"
        fast = Case(block, look=2, **words)
        changes = [case.count_changes(self.fresh("whole")) for case in (Case(block, **words), fast)]
        self.assertLess(changes[1], 0.5 * changes[0])
        self.check(fast, kills=[k / 24 for k in range(10, 24)])

    def test_the_tangent_of_every_iteration(self):
        deck = self.folder / "newton.inp"
        deck.write_text((INPUT / "rubber.inp").read_text().replace(
            "*CONTACT SOLVER", "*BODY SOLVER, TANGENT=NEWTON\n*CONTACT SOLVER"))
        self.check(Case(deck, n=2, steps=4, press=1))

    def test_modes_at_finite_strain(self):
        """They are sought from where they were: a part of the state."""
        self.check(Case(INPUT / "rubber.inp", n=2, steps=4, element="C3D8I"))

    def test_elements_of_second_order(self):
        for kind in ("C3D10", "C3D20"):
            for nlgeom in ("", ", NLGEOM"):
                box = Box("B", (2, 2, 2), (kind,))
                deck = self.folder / "box.inp"
                deck.write_text(
                    box.cards() + MATERIAL + DRY + "*FRICTION\n0.3\n" + FLOOR
                    + f"*STEP{nlgeom}\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\nB-Z1, 1, 2\n"
                    "B-Z1, 3, 3, -0.05\n*END STEP\n*STEP\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\n"
                    "B-Z1, 1, 1, 0.05\n*END STEP\n"
                )
                self.check(Case(deck))

    def test_supports_obstacles_and_outputs_that_change(self):
        self.check(Case(HERE / "changes.inp"), kills=(0.2, 0.35, 0.5, 0.65, 0.75, 0.95))
        self.check(Case(HERE / "changes.inp", factor="DOUBLE"))
        self.check(Case(HERE / "changes.inp", solver="SWEEPS", tolerance="1e-7"))

    def test_a_round_tool_that_turns_back(self):
        # Trials beside the run leave normals of other places; where it is taken up there are none.
        deck = self.folder / "tool.inp"
        back = "*STEP\n*STATIC, DIRECT\n<1/steps>, 1.\n*BOUNDARY\nCENTRE, 1, 1, 0.1\n*END STEP\n"
        deck.write_text((INPUT / "tool.inp").read_text() + back)
        case = Case(deck, n=8, mu=1.2, steps=4, radius=0.4, depth=0.04, way=0.7)
        self.check(case, kills=[k / 12 + 0.02 for k in range(2, 12)])

    def test_reference_nodes_of_every_kind(self):
        deck = self.folder / "references.inp"
        deck.write_text(REFERENCES)
        self.check(Case(deck), kills=(0.3, 0.4, 0.5, 0.6, 0.7, 0.9))
        folder = self.fresh("whole")
        Case(deck).run(folder)
        with h5py.File(folder / NAME) as file:
            nodes = file["reference_nodes"]
            self.assertEqual(nodes["node_id"][:].tolist(), [1, 901, 902])
            self.assertEqual(set(nodes), {
                "node_id", "coordinates", "displacement", "rotation", "reaction_force",
                "reaction_moment", "applied_force", "applied_moment",
            })

    def test_an_interface_that_was_widened(self):
        self.check(Case(HERE / "widened.inp"), kills=(0.1, 0.2, 0.3, 0.45, 0.6, 0.7, 0.9))

    def test_increments_that_end_at_events(self):
        deck = self.folder / "events.inp"
        deck.write_text(EVENTS)
        self.check(Case(deck), kills=(0.15, 0.2, 0.25, 0.35, 0.4, 0.45, 0.5, 0.55, 0.65, 0.9))

    def test_runs_that_change_to_finite_strain(self):
        """The runs at small strain, their shadow runs, and those that take their place."""
        deck = self.folder / "pressed.inp"
        deck.write_text(PRESSED)
        for options in (("--accuracy", "0.1"), ("--nlgeom", "auto")):
            case = Case(deck, *options)
            self.check(case, kills=(0.15, 0.3, 0.45, 0.6, 0.75, 0.9))
            with h5py.File(self.folder / "killed" / NAME) as file:
                told = file["history/error"].attrs["small_strain_is"]
                self.assertEqual(told, b"finite strain")

    def test_local_directions_and_tables_of_sets(self):
        deck = self.folder / "printed.inp"
        deck.write_text(PRINTED)
        case = Case(deck)
        self.check(case, kills=(0.3, 0.45, 0.6, 0.8))
        whole, killed = self.fresh("whole"), self.fresh("killed")
        n = case.count_changes(whole)
        case.kill_at(killed, n // 2)
        self.assertFalse((killed / "run.node.csv").exists())
        self.assertEqual(case.run(killed, "--continue")[0], 0)
        for table in ("run.node.csv", "run.element.csv"):
            text = (whole / table).read_text()
            self.assertGreater(len(text.splitlines()), 8)
            self.assertEqual((killed / table).read_text(), text)

    def test_between_two_steps(self):
        case = Case(HERE / "changes.inp")
        folder = self.fresh("whole")
        n = case.count_changes(folder)
        whole = Whole(folder / NAME)
        first, last = 1, n
        while last - first > 1:  # the first write after which step 1 is finished
            middle = (first + last) // 2
            folder = self.fresh("killed")
            case.kill_at(folder, middle)
            first, last = (first, middle) if rows_in(folder / NAME) >= 4 else (middle, last)
        for change in range(first, first + (12 if LONG else 6 if RELEASE else 3)):
            with self.subTest(change=change):
                folder = self.fresh("killed")
                case.kill_at(folder, change)
                status, words = case.run(folder, "--continue")
                self.assertEqual(status, 0, words)
                self.assertEqual(whole.differences(folder / NAME), [])

    def test_a_run_without_a_solution_is_refused_again(self):
        deck = self.folder / "pulled.inp"
        deck.write_text((INPUT / "block.inp").read_text() + PULLED_OFF)
        case = Case(deck, n=2, steps=10)
        first = self.fresh("first")
        status, words = case.run(first)
        self.assertEqual(status, 2, words)
        rows = rows_in(first / NAME)
        self.assertGreater(rows, 0)
        whole = Whole(first / NAME)
        status, again = case.run(first, "--continue")
        self.assertEqual((status, again), (2, words))
        self.assertEqual(whole.differences(first / NAME), [])

    def test_a_run_that_a_limit_on_files_ended(self):
        case = Case(INPUT / "block.inp", "--force", n=6, solver="AUTO", local="AUTO")
        folder = self.fresh("whole")
        self.assertEqual(case.run(folder)[0], 0)
        whole = Whole(folder / NAME)
        size = (folder / NAME).stat().st_size
        for share in (0.85, 0.9, 0.95, 0.99) if RELEASE else (0.9,):
            with self.subTest(share=share):
                folder = self.fresh("limited")
                before = resource.getrlimit(resource.RLIMIT_FSIZE)
                resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * size), before[1]))
                try:
                    status, words = case.run(folder)
                finally:
                    resource.setrlimit(resource.RLIMIT_FSIZE, before)
                self.assertEqual(status, 3, words)
                if (folder / NAME).exists():
                    self.assertEqual(whole.losses(folder / NAME, 1), [])
                self.assertEqual(case.run(folder, "--continue")[0], 0)
                self.assertEqual(whole.differences(folder / NAME), [])

    def test_exported_problems_of_the_rest(self):
        case = Case(INPUT / "block.inp", "--export-fclib", "2,9", n=2, steps=10)
        whole = self.fresh("whole")
        n = case.count_changes(whole)
        folder = self.fresh("killed")
        case.kill_at(folder, n // 2)
        status, words = case.run(folder, "--continue")
        self.assertEqual(status, 0, words)
        for name in ("block-2.fclib.hdf5", "block-9.fclib.hdf5"):
            with h5py.File(whole / name) as one, h5py.File(folder / name) as two:
                for key in ("fclib_local/W/nzval", "fclib_local/vectors/q", "guesses/1/r"):
                    if key in one:
                        self.assertEqual(one[key][()].tobytes(), two[key][()].tobytes(), key)


class WhatIsKept(Folder):
    """A continued file says so, and counts over all sessions."""

    def test_counters_sidecar_and_sessions(self):
        case = Case(INPUT / "block.inp", n=2, steps=10)
        whole = self.fresh("whole")
        n = case.count_changes(whole)
        folder = self.fresh("killed")
        case.kill_at(folder, n // 2)
        case.kill_at(folder, n // 4, "--continue")
        self.assertEqual(case.run(folder, "--continue")[0], 0)
        tables = []
        for path in (whole / NAME, folder / NAME):
            with h5py.File(path) as file:
                run = file["run"]
                names = run["counters"].attrs["name"].astype(str)
                tables.append(dict(zip(names, run["counters"][:], strict=True)))
                self.assertEqual(run.attrs["status"], b"finished")
                sessions = run.attrs["continued"].decode().splitlines()
                self.assertNotIn("--continue", run.attrs["command"].decode())
        self.assertEqual(len(sessions), 2)
        for line in sessions:
            self.assertRegex(line, r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ .* --continue$")
        for name in (
            "increments", "increments_with_fields", "contact_iterations", "local_iterations",
            "newton_raphson_iterations", "factorisations", "equations", "contact_points",
            "compliance_products", "imbalance", "unrefined_imbalance", "plan_revisions",
        ):
            self.assertEqual(tables[0][name], tables[1][name], name)
        self.assertGreater(tables[1]["seconds_total"], tables[1]["seconds_contact"])
        one, two = ((f / "run.xdmf").read_text() for f in (whole, folder))
        # Both are complete; a continued file may be longer, and nothing of that shows.
        self.assertEqual(one, two)

    def test_the_state_is_a_small_part_of_the_file(self):
        folder = self.fresh("whole")
        Case(INPUT / "block.inp", n=8, steps=50, solver="AUTO", local="AUTO").run(folder)
        with h5py.File(folder / NAME) as file:
            stored = {
                group: sum_of_storage(file[group]) for group in ("state", "VTKHDF", "contact")
            }
        # Here as much as the fields of six increments, of 50.
        self.assertLess(stored["state"], 0.12 * stored["VTKHDF"])

    def test_the_tables_of_a_long_run(self):
        """More increments than a page holds of times: 512."""
        folder = self.fresh("whole")
        case = Case(INPUT / "block.inp", n=1, steps=600, solver="AUTO", local="AUTO")
        status, words = case.run(folder)
        self.assertEqual(status, 0, words)
        with h5py.File(folder / NAME) as file:
            steps = file["VTKHDF/Steps"]
            self.assertEqual(steps.attrs["NSteps"], 600)
            # Where a chunk of times begins, a kill may leave what VTK cannot read.
            self.assertGreaterEqual(steps["Values"].chunks[0], 600)
            lengths = []
            steps.visititems(
                lambda _, thing: lengths.append(len(thing)) if hasattr(thing, "shape") else None
            )
            self.assertEqual(set(lengths), {600})
            offsets = steps["PointDataOffsets/displacement"][:]
            self.assertEqual(offsets.tolist(), [8 * i for i in range(600)])


def sum_of_storage(group):
    """Bytes that the datasets of a group take."""
    sizes = []

    def add(_, thing):
        if isinstance(thing, h5py.Dataset):
            sizes.append(thing.id.get_storage_size())

    group.visititems(add)
    return sum(sizes)


class Refusals(Folder):
    """What cannot be continued is left as it is, and the reason is told."""

    @classmethod
    def setUpClass(cls):
        """Run a deck, and kill it in the middle: the tests begin with copies of both results."""
        made = tempfile.TemporaryDirectory()
        cls.addClassCleanup(made.cleanup)
        cls.made = Path(made.name)
        whole, killed = (fresh_folder(cls.made / name) for name in ("whole", "killed"))
        deck = cls.made / "run.inp"
        deck.write_text((INPUT / "block.inp").read_text())
        case = Case(deck, n=2, steps=10)
        cls.n = case.count_changes(whole)
        case.kill_at(killed, cls.n // 2)

    def setUp(self):
        super().setUp()
        shutil.copytree(self.made, self.folder, dirs_exist_ok=True)
        self.deck, self.whole, self.killed = (
            self.folder / name for name in ("run.inp", "whole", "killed")
        )
        self.case = Case(self.deck, n=2, steps=10)

    def refused(self, reason, case=None, folder=None, *more):
        """Check that --continue ends with 1, tells the reason and leaves the file."""
        folder = folder or self.killed
        before = (folder / NAME).read_bytes()
        status, words = (case or self.case).run(folder, "--continue", *more)
        self.assertEqual(status, 1, words)
        self.assertRegex(words, reason)
        self.assertEqual((folder / NAME).read_bytes(), before)

    def test_another_parameter(self):
        self.refused(
            "begun with --set n=2 --set steps=10, not with --set n=3 --set steps=10",
            Case(self.deck, n=3, steps=10),
        )
        self.refused("begun with --set n=2 --set steps=10, not without --set", Case(self.deck))

    def test_another_text_of_the_deck(self):
        text = self.deck.read_text()
        line = text[: text.index("mu = 0.3")].count("\n") + 1
        self.deck.write_text(text.replace("mu = 0.3", "mu = 0.4"))
        self.refused(f"line {line} was 'mu = 0.3', is 'mu = 0.4'")
        self.deck.write_text(text + "** more\n")
        self.refused(r"was '', is '\*\* more'")
        self.deck.write_text(text)
        self.assertEqual(self.case.run(self.killed, "--continue")[0], 0)

    def test_another_deck(self):
        other = self.folder / "other.inp"
        other.write_text(self.deck.read_text())
        self.refused("is the result of another deck, 'run'", Case(other, n=2, steps=10))

    def test_another_version(self):
        with h5py.File(self.killed / NAME, "r+") as file:
            file["run"].attrs.modify("version", b"0.0.9")
        self.refused("begun by version 0.0.9 of bipot, this is version ")

    def test_a_finished_run(self):
        self.refused("is finished: there is nothing to continue", folder=self.whole)

    def test_a_foreign_file(self):
        (self.killed / NAME).write_text("something else\n")
        self.refused("is not a result of bipot")
        with h5py.File(self.killed / NAME, "w") as file:
            file["run/deck"] = 1
        self.refused("is not a result of bipot")

    def test_a_truncated_file(self):
        data = (self.killed / NAME).read_bytes()
        for share in (0.99, 0.5, 0.01):
            (self.killed / NAME).write_bytes(data[: int(share * len(data))])
            self.refused("cannot be read: it is damaged or cut off")
        (self.killed / NAME).write_bytes(b"")
        self.refused("is not a result of bipot")

    def test_a_damaged_state(self):
        slots = ("state/slot_1", "state/slot_2")
        # Killed when an increment has just been counted: nothing of the next is there.
        before = rows_in(self.killed / NAME)
        change = self.n // 2
        while rows_in(self.killed / NAME) == before:
            change += 1
            self.assertTrue(self.case.kill_at(self.fresh("killed"), change))
        with h5py.File(self.killed / NAME) as file:
            later = max(slots, key=lambda slot: file[slot].attrs["row"])
        with h5py.File(self.killed / NAME, "r+") as file:
            file[later][20] += 1e-15
        copy = self.fresh("copy")
        shutil.copy(self.killed / NAME, copy)
        # The other slot still holds, one increment before.
        self.assertEqual(self.case.run(copy, "--continue")[0], 0)
        self.assertEqual(Whole(self.whole / NAME).differences(copy / NAME), [])
        with h5py.File(self.killed / NAME, "r+") as file:
            for slot in slots:
                file[slot].attrs["bits"] += 1
        self.refused("no state to continue from: /state is missing or damaged")
        with h5py.File(self.killed / NAME, "r+") as file:
            del file["state"]
        self.refused("is damaged: its names, descriptions, mesh or deck are not what was written")

    def test_what_is_called_finished_but_is_not_there(self):
        rows = rows_in(self.killed / NAME)
        with h5py.File(self.killed / NAME, "r+") as file:
            file["history"].attrs["finished"] += 3
        status, words = self.case.run(self.killed, "--continue")
        self.assertEqual(status, 0, words)
        # The one that was being written may be there, and sound.
        self.assertRegex(words, rf"note: increments \d+ to {rows + 3} were damaged in the file")
        self.assertEqual(Whole(self.whole / NAME).differences(self.killed / NAME), [])

    def test_to_replace_and_to_keep_at_once(self):
        self.refused("--continue and --overwrite exclude each other", None, None,
                     "--overwrite")

    def test_an_unfinished_result_is_not_replaced(self):
        before = (self.killed / NAME).read_bytes()
        status, words = self.case.run(self.killed)
        self.assertEqual(status, 1)
        self.assertRegex(words, r"unfinished result \(\d+ increments, running\), which --continue")
        self.assertEqual((self.killed / NAME).read_bytes(), before)
        self.assertEqual(self.case.run(self.killed, "--overwrite")[0], 0)
        self.assertEqual(Whole(self.whole / NAME).differences(self.killed / NAME), [])

    def test_where_there_is_nothing_it_begins(self):
        folder = self.fresh("nothing")
        self.case.kill_at(folder, 3)
        self.assertFalse((folder / NAME).exists())
        self.assertEqual(self.case.run(folder, "--continue")[0], 0)
        self.assertEqual(Whole(self.whole / NAME).differences(folder / NAME), [])


class FacetsOfAFile(Folder):
    """A run with an STL file goes on to the same bits, but not with another file."""

    def test_facets(self):
        deck = self.folder / "deck.inp"
        deck.write_text(DIE)
        (self.folder / "die.stl").write_text(DIE_FILE.format(height=1.02))
        case = Case(deck)
        folder = self.fresh("run")
        n = case.count_changes(folder)
        whole = Whole(folder / NAME)
        for share in (0.4, 0.7):
            folder = self.fresh("run")
            self.assertTrue(case.kill_at(folder, int(share * n)))
            (self.folder / "die.stl").write_text(DIE_FILE.format(height=1.03))
            status, words = case.run(folder, "--continue")
            self.assertEqual(status, 1, words)
            self.assertIn("was begun with a deck that was otherwise", words)
            self.assertIn("die.stl: 2 triangles, checksum", words)
            (self.folder / "die.stl").write_text(DIE_FILE.format(height=1.02))
            status, words = case.run(folder, "--continue")
            self.assertEqual(status, 0, words)
            self.assertEqual(whole.differences(folder / NAME), [])


if __name__ == "__main__":
    assert Path(PROGRAM).exists(), PROGRAM
    unittest.main()
