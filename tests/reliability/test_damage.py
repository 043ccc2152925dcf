"""A damaged result is never taken up as it is: it is refused, or what is damaged is done again."""

import argparse
import os
import random
import re
import resource
import shutil
import struct
import tempfile
import unittest
import zlib
from pathlib import Path

import h5py
import numpy as np
from damage_sweep import sweep
from result_checks import HERE, INPUT, LIBRARY, NAME, Case, Folder, Whole, rows_in


class DamageSweep(unittest.TestCase):
    """A short form of damage_sweep.py."""

    def test_nothing_wrong_comes_of_damage(self):
        options = argparse.Namespace(count=60, first=0, seed=3, keep=None)
        counts, findings, messages = sweep(options, tell=lambda _: None)
        self.assertEqual(findings, [])
        self.assertEqual(counts["refused"] + counts["same"], 60)
        # Much of a small file is room for tables, where damage does no harm.
        self.assertGreater(counts["refused"], 15)
        self.assertGreater(len(messages), 3)


class Checksums(Folder):
    """What the file says of its rows is what anybody can compute from them."""

    def check(self, case):
        """Compare the table with sums over what h5py reads."""
        folder = self.fresh("whole")
        status, words = case.run(folder)
        self.assertEqual(status, 0, words)
        with h5py.File(folder / NAME) as file:
            rows = int(file["history"].attrs["finished"])
            sums = [0] * rows
            table = file["checksums/increments"][:]
            self.assertEqual(table.shape, (rows, 2))
            with_fields = table[:, 1]
            self.assertEqual(with_fields[-1], file["VTKHDF/Steps"].attrs["NSteps"])
            owner = [int(np.searchsorted(with_fields, k + 1)) for k in range(with_fields[-1])]

            def add(_, thing):
                if not isinstance(thing, h5py.Dataset) or None not in thing.maxshape:
                    return
                path = thing.name
                if path.startswith(("/history/", "/contact/", "/reference_nodes/")):
                    for i, row in enumerate(thing[:]):
                        sums[i] += zlib.crc32(row.tobytes(), zlib.crc32(path.encode()))
                elif path.startswith("/gauss/"):
                    for k, i in enumerate(owner):
                        sums[i] += zlib.crc32(thing[k].tobytes(), zlib.crc32(path.encode()))
                elif path.startswith("/VTKHDF/"):
                    n = len(thing) // len(owner)
                    for k, i in enumerate(owner):
                        block = thing[k * n: (k + 1) * n]
                        sums[i] += zlib.crc32(block.tobytes(), zlib.crc32(path.encode()))

            file.visititems(add)
        self.assertEqual(table[:, 0].tolist(), sums)

    def test_of_decks(self):
        self.check(Case(INPUT / "block.inp", n=2, steps=10))
        self.check(Case(INPUT / "tool.inp", n=4, steps=3))  # frames that turn
        self.check(Case(HERE / "changes.inp"))  # fields now and then
        self.check(Case(INPUT / "slope.inp"))

    def test_fields_are_not_read_where_they_are_damaged(self):
        """h5py and VTK read through HDF5, which checks what is one chunk."""
        folder = self.fresh("whole")
        Case(INPUT / "block.inp", n=4, steps=5).run(folder)
        path = folder / NAME
        with h5py.File(path) as file:
            fields = file["VTKHDF/PointData"]
            chunk = fields["displacement"].id.get_chunk_info(1)
            n = len(fields["displacement"]) // 5
        data = bytearray(path.read_bytes())
        data[chunk.byte_offset + chunk.size // 2] ^= 1
        path.write_bytes(data)
        with h5py.File(path) as file:
            field = file["VTKHDF/PointData/displacement"]
            field[:n]
            with self.assertRaises(OSError):
                field[n: 2 * n]


class Damage(Folder):
    """What is done about one damaged number."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.kept = Path(tempfile.mkdtemp(prefix="bipot-"))
        cls.addClassCleanup(shutil.rmtree, cls.kept)

    def setUp(self):
        super().setUp()
        self.kill(Case(INPUT / "block.inp", n=3, steps=12, solver="AUTO", local="AUTO"))

    def kill(self, case):
        """Take the files of a killed run and of a whole one; the first who asks has them made."""
        self.case = case
        kept = self.kept / case.deck.stem
        if not kept.exists():
            self.kill_anew()
            shutil.copytree(self.folder, kept)
        self.killed = self.fresh("killed")
        shutil.copy(kept / "killed" / NAME, self.killed)
        self.whole = Whole(kept / "whole" / NAME)
        self.rows = rows_in(self.killed / NAME)

    def kill_anew(self):
        """Kill a run when an increment has just been counted: the state of the one before is there.
        """
        whole = self.fresh("whole")
        n = self.case.count_changes(whole)
        self.killed = self.fresh("killed")
        change = n // 2
        self.assertTrue(self.case.kill_at(self.killed, change))
        before = rows_in(self.killed / NAME)
        while rows_in(self.killed / NAME) == before:
            change += 1
            self.assertTrue(self.case.kill_at(self.fresh("killed"), change))

    def change(self, name, row):
        """Change a number of a row in a copy of the file; return the copy's folder."""
        folder = self.fresh("copy")
        shutil.copy(self.killed / NAME, folder)
        with h5py.File(folder / NAME, "r+") as file:
            values = file[name]
            place = (row, *(0 for _ in values.shape[1:]))
            values[place] = values[place] + 1
        return folder

    def test_the_last_increment_is_done_again(self):
        with h5py.File(self.killed / NAME) as file:
            nodes = int(file["VTKHDF/NumberOfPoints"][0])
        for name, row in (
            ("history/energy/strain", self.rows - 1),
            ("history/certified", self.rows - 1),
            ("contact/BODY-ZMIN:GROUND/status", self.rows - 1),
            ("VTKHDF/PointData/displacement", nodes * self.rows - 1),
            ("VTKHDF/Steps/Values", self.rows - 1),
            ("VTKHDF/Steps/PointOffsets", self.rows - 1),
            ("checksums/increments", self.rows - 1),
        ):
            with self.subTest(name=name):
                folder = self.change(name, row)
                status, words = self.case.run(folder, "--continue")
                self.assertEqual(status, 0, words)
                self.assertIn(f"note: increment {self.rows} was damaged in the file and is "
                              "computed again", words)
                self.assertEqual(self.whole.differences(folder / NAME), [])

    def test_reference_nodes_are_checked_too(self):
        self.kill(Case(INPUT / "tool.inp", n=4, steps=3))
        self.assertGreater(self.rows, 1)
        for row, expected in ((self.rows - 1, 0), (0, 1)):
            for name in ("displacement", "reaction_force"):
                with self.subTest(row=row, name=name):
                    folder = self.change(f"reference_nodes/{name}", row)
                    status, words = self.case.run(folder, "--continue")
                    self.assertEqual(status, expected, words)
                    self.assertIn(f"increment {row + 1} ", words)
                    if expected == 0:
                        self.assertEqual(self.whole.differences(folder / NAME), [])
        folder = self.change("reference_nodes/coordinates", 0)
        self.assertEqual(self.case.run(folder, "--continue")[0], 1)

    def test_an_earlier_increment_is_named(self):
        for name, row in (
            ("history/residual", 2),
            ("contact/BODY-ZMIN:GROUND/gap", 2),
            ("VTKHDF/Steps/Values", 2),
            ("checksums/increments", 2),
        ):
            with self.subTest(name=name):
                folder = self.change(name, row)
                before = (folder / NAME).read_bytes()
                status, words = self.case.run(folder, "--continue")
                self.assertEqual(status, 1, words)
                self.assertIn(f"'{NAME}' is damaged: increment 3 of {self.rows} is not what was "
                              "written", words)
                self.assertIn("--overwrite starts the run again", words)
                self.assertEqual((folder / NAME).read_bytes(), before)
                self.assertEqual(os.listdir(folder), [NAME])

    def test_what_does_not_change_is_checked_too(self):
        for name in ("VTKHDF/Points", "contact/BODY-ZMIN:GROUND/area", "run/estimates"):
            with self.subTest(name=name):
                folder = self.change(name, 0)
                status, words = self.case.run(folder, "--continue")
                self.assertEqual(status, 1, words)
                self.assertIn(f"'{NAME}' is damaged: its names, descriptions, mesh or deck are "
                              "not what was written", words)
        for name, attribute in (("history/time", "quantity"), ("run/counters", "description")):
            with self.subTest(name=name, attribute=attribute):
                folder = self.fresh("copy")
                shutil.copy(self.killed / NAME, folder)
                with h5py.File(folder / NAME, "r+") as file:
                    of = file[name].attrs
                    of.modify(attribute, np.bytes_("x" + bytes(of[attribute]).decode()[1:]))
                self.assertEqual(self.case.run(folder, "--continue")[0], 1)

    def test_how_to_go_on_is_checked_too(self):
        """What a continued run takes from the file before it checks its increments."""
        for name in ("compliance", "factor_threads", "block_low_rank", "divisions", "blocks_times"):
            with self.subTest(name=name):
                folder = self.fresh("copy")
                shutil.copy(self.killed / NAME, folder)
                with h5py.File(folder / NAME, "r+") as file:
                    of = file["run"].attrs
                    of.modify(name, of[name] + of.get_id(name).dtype.type(64))
                status, words = self.case.run(folder, "--continue")
                self.assertEqual(status, 1, words)
                self.assertIn(f"'{NAME}' is damaged: its names, descriptions, mesh or deck are "
                              "not what was written", words)

    def test_types_of_numbers_are_checked_too(self):
        """A bit of what HDF5 writes of an IEEE number: offset, precision, exponent, mantissa."""
        description = struct.pack("<HHBBBBI", 0, 64, 52, 11, 0, 52, 1023)
        before = (self.killed / NAME).read_bytes()
        places = [m.start() for m in re.finditer(re.escape(description), before)]
        self.assertGreater(len(places), 10)
        chance = random.Random(1)
        for i in range(len(description)):
            with self.subTest(byte=i):
                data = bytearray(before)
                data[chance.choice(places) + i] ^= 1 << chance.randrange(8)
                folder = self.fresh("copy")
                (folder / NAME).write_bytes(data)
                status, words = self.case.run(folder, "--continue")
                self.assertEqual(status, 1, words)
                self.assertIn(NAME, words)
                self.assertEqual((folder / NAME).read_bytes(), bytes(data))

    def test_a_file_that_crashes_its_reader(self):
        library = Path(LIBRARY).with_name("libcrash_in_child.so")
        before = (self.killed / NAME).read_bytes()
        for option in ("--continue", "--quiet"):  # a new run looks at what is there, too
            with self.subTest(option=option):
                status, words = self.case.run(self.killed, option, LD_PRELOAD=str(library))
                self.assertEqual(status, 1, words)
                self.assertIn(f"'{NAME}' is damaged: it ends whoever reads all of it (signal 6)",
                              words)
                self.assertNotIn("#0", words, "a backtrace")
                self.assertEqual((self.killed / NAME).read_bytes(), before)
                self.assertEqual(os.listdir(self.killed), [NAME])

    def test_a_file_without_checksums(self):
        with h5py.File(self.killed / NAME, "r+") as file:
            del file["checksums"]
        status, words = self.case.run(self.killed, "--continue")
        self.assertEqual(status, 1, words)
        self.assertIn("has no checksums", words)

    def test_a_checksum_that_cannot_be_read(self):
        with h5py.File(self.killed / NAME, "r+") as file:
            del file["checksums"].attrs["contents"]
        status, words = self.case.run(self.killed, "--continue")
        self.assertEqual(status, 1, words)
        self.assertIn("is damaged: its checksum cannot be read; --overwrite", words)

    def test_the_copy_does_not_fit(self):
        """What is continued is written anew beside it; where that fails the old one stays."""
        before = (self.killed / NAME).read_bytes()
        size = len(before)

        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (size // 2, resource.RLIM_INFINITY))

        status, words = self.case.run(self.killed, "--continue", "--force", prepare=limit)
        self.assertEqual(status, 3, words)
        self.assertEqual((self.killed / NAME).read_bytes(), before)
        self.assertEqual(os.listdir(self.killed), [NAME])
        self.assertEqual(self.case.run(self.killed, "--continue")[0], 0)
        self.assertEqual(self.whole.differences(self.killed / NAME), [])


if __name__ == "__main__":
    unittest.main()
