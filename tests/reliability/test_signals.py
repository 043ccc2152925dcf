"""SIGINT and SIGTERM end a run within a second, a second one at once; it goes on all the same."""

import os
import signal
import subprocess
import unittest
from pathlib import Path

import h5py
from result_checks import CLOCK, INPUT, NAME, Case, Folder, Whole, rows_in, wait_for

MANY = Case(INPUT / "block.inp", n=2, steps=400)  # seconds, of which no increment takes any
# Runs on several meshes, one after the other.
LONG_FORM = os.environ.get("BIPOT_LONG", "") not in ("", "0")
ACCURACY = "0.02" if LONG_FORM else "0.05"
SOUGHT = Case(
    INPUT / "block.inp", "--nlgeom", "no", "--accuracy", ACCURACY, steps=25, solver="AUTO",
    local="AUTO"
)  # fmt: skip
# The same with few increments, and on one mesh alone.
FEW = {"steps": 5, "solver": "AUTO", "local": "AUTO"}
PLAIN = Case(INPUT / "block.inp", "--nlgeom", "no", **FEW)
SEARCH = Case(INPUT / "block.inp", "--nlgeom", "no", "--accuracy", "0.05", **FEW)
SLOW = {"LD_PRELOAD": CLOCK, "LOOK": "1000"}
# Runs of which the last ones have smaller elements where contact is.
SMALL_CONTACT = Case(INPUT.parent / "tests" / "reliability" / "small_contact.inp")
# The same within a bound of the memory, which may choose other meshes another time.
BOUNDED = Case(
    INPUT / "block.inp", "--memory", "60MB", steps=5, solver="AUTO", local="AUTO", mu=0
)
# Many seconds in one increment, of which the program is not asked for more than the beginning.
LONG = Case(INPUT / "block.inp", "--force", n=24, steps=5, solver="AUTO", local="AUTO")


class Signals(Folder):
    def start(self, case, *more):
        """Begin a run that is ended with the test."""
        process = case.start(self.folder, *more)

        def end():
            process.kill()
            process.communicate()

        self.addCleanup(end)
        return process

    def test_a_stopped_run_says_how_to_go_on_and_does(self):
        other = self.elsewhere()
        self.assertEqual(MANY.run(other)[0], 0)
        whole = Whole(other / NAME)
        rows = 0
        for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            copied = self.path.stat().st_ino if rows else None
            process = self.start(MANY, *(["--continue"] if rows else []))
            # A run taken up is first copied, and its copy put in place: that is no increment yet.
            wait_for(lambda old=copied: self.path.exists() and self.path.stat().st_ino != old)
            size = self.path.stat().st_size
            wait_for(lambda size=size: self.path.stat().st_size > size)
            process.send_signal(number)
            _, words = process.communicate(timeout=600)
            self.assertEqual(process.returncode, status, words)
            self.assertIn("a second signal stops at once", words)
            name = signal.Signals(number).name
            self.assertRegex(words, rf"stopped by {name}: \d+ of 400 increments are in run.vtkhdf")
            self.assertRegex(words, r"to go on:\n  \S.* -o run.vtkhdf .*--continue\n")
            self.assertEqual(words.count("--continue"), 1)
            before, rows = rows, rows_in(self.path)
            # The signal may come before the first increment of a run taken up.
            self.assertGreaterEqual(rows, max(before, 1))
            self.assertLess(rows, 400)
            self.assertEqual(whole.losses(self.path, rows), [])
            self.assertTrue((self.folder / "run.xdmf").exists())
            with h5py.File(self.path) as file:
                self.assertEqual(file["run"].attrs["status"], b"stopped")
                counters = file["run/counters"]
                names = list(counters.attrs["name"].astype(str))
                self.assertEqual(counters[names.index("increments")], rows)
        self.assertEqual(MANY.run(self.folder, "--continue")[0], 0)
        self.assertEqual(whole.differences(self.path), [])

    def test_a_search_for_a_mesh_goes_on(self):
        """Killed at any change of the file, on any mesh: in the end the same to the last bit."""
        self.check_search(SOUGHT, 0)

    def test_a_search_that_cuts_elements_at_contact_goes_on(self):
        self.check_search(SMALL_CONTACT, 3, (0.95,))

    def check_search(self, case, cuts, parts=(0.5, 0.9)):
        other = self.elsewhere()
        n_changes = case.count_changes(other)
        whole = Whole(other / NAME)
        with h5py.File(other / NAME) as file:
            names = [n for n in file["accuracy"] if n != "processor_time"]
            accuracy = {n: file["accuracy"][n][()] for n in names}
            self.assertGreater(len(set(accuracy["element_size"])), 2)
            self.assertGreater(len(accuracy["element_size"]), 6)
            self.assertEqual(accuracy["cuts"][-1], cuts)
        for part in parts:
            self.path.unlink(missing_ok=True)
            self.assertTrue(case.kill_at(self.folder, int(part * n_changes)))
            status, words = case.run(self.folder, "--continue")
            self.assertEqual(status, 0, words)
            self.assertEqual(whole.differences(self.path), [], part)
            with h5py.File(self.path) as file:
                for name, values in accuracy.items():
                    self.assertEqual(file["accuracy"][name][()].tobytes(), values.tobytes(), name)

    def test_a_search_within_bounds_goes_on(self):
        """Killed at any change of the file: a complete result, of the runs that it names."""
        n_changes = BOUNDED.count_changes(self.elsewhere())
        ended = []
        for part in (0.15, 0.4, 0.8):
            self.path.unlink(missing_ok=True)
            if not BOUNDED.kill_at(self.folder, int(part * n_changes)):
                continue  # on other meshes there were fewer changes
            status, words = BOUNDED.run(self.folder, "--continue")
            # Killed between two meshes it has the result of the first.
            ended.append("is finished: there is nothing to continue" in words)
            self.assertEqual(status, 1 if ended[-1] else 0, words)
            with h5py.File(self.path) as file:
                self.assertEqual(file["run"].attrs["status"], b"finished")
                self.assertTrue((file["history/certified"][:] == 1).all())
                group = file["accuracy"]
                self.assertEqual(group.attrs["reached"], 1)
                self.assertEqual(group.attrs["memory_allowed"], 60e6)
                elements = group["elements"][:]
                self.assertTrue((elements[1:] > elements[:-1]).all())
                self.assertEqual(file["VTKHDF/CellData/element_id"].shape, (elements[-1],))
        self.assertFalse(all(ended))
        self.assertGreater(len(ended), 1)

    def test_what_it_says_can_be_given_to_a_shell(self):
        deck = self.folder / "a deck; it's --continue's" / "block $HOME.inp"
        deck.parent.mkdir()
        deck.write_bytes(MANY.deck.read_bytes())
        process = self.start(Case(deck, *MANY.options), "--overwrite")
        wait_for(self.path.exists)
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 143, words)
        command = words.split("to go on:\n  ", 1)[1].splitlines()[0]
        done = subprocess.run(
            ["sh", "-c", command], cwd=self.folder, capture_output=True, text=True, timeout=600,
            check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(rows_in(self.path), 400)
        with h5py.File(self.path) as file:
            self.assertNotEqual(file["run"].attrs["continued"].strip(b"\0 "), b"")

    def test_before_the_first_increment_nothing_is_kept(self):
        process = self.start(MANY)
        wait_for(lambda: caught(process))
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=600)
        self.assertEqual(process.returncode, 143, words)
        if "no increment was finished, so nothing is kept" in words:
            self.assertEqual(list(self.folder.iterdir()), [])
        else:  # it had come further when the signal came
            self.assertGreater(rows_in(self.path), 0)

    def test_a_second_signal_does_not_wait(self):
        process = self.start(LONG)
        wait_for(lambda: caught(process))
        process.send_signal(signal.SIGINT)
        line = process.stderr.readline() + process.stderr.readline()
        self.assertIn("stopping within a second; a second signal stops at once", line)
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=600)
        self.assertEqual(process.returncode, 143)
        self.assertNotIn("stopped", words)
        self.assertFalse(self.path.exists())

    def test_an_increment_of_many_seconds_is_not_waited_for(self):
        process = self.start(LONG)
        wait_for(lambda: caught(process))
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=600)
        self.assertEqual(process.returncode, 143)
        self.assertIn("stopped before an increment was finished", words)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_in_every_phase_it_stops_and_goes_on_to_the_same_bits(self):
        """At looks at clocks, where phases begin and end, one after the other.

        They are those of the end of a run that is short, and not kept, of the plan of the last
        mesh, its factor, contact, loads, and of increments with their estimates, certificates and
        what is written of them. In turns the run may stop in order, or the second that it has for
        that is cut to nothing.
        """
        of_a_mesh = looks_of(PLAIN, self.elsewhere())
        other = self.elsewhere()
        first = looks_of(SEARCH, other) - of_a_mesh + 8
        self.assertGreater(first, 2 * of_a_mesh)
        whole, kept = Whole(other / NAME), 0
        moments = range(first, first + 90, 1 if LONG_FORM else 6)
        for number, at in enumerate(moments):
            self.path.unlink(missing_ok=True)
            cut = {"SIGNAL_CUT": "1"} if number % 2 else {}
            status, words = SEARCH.run(self.folder, SIGNAL_AT=str(at), **SLOW, **cut)
            self.assertEqual(status, 143, words)
            self.assertLessEqual({f.suffix for f in self.folder.iterdir()}, {".vtkhdf", ".xdmf"})
            kept += self.path.exists()
            more = ["--continue"] if self.path.exists() else []
            status, words = SEARCH.run(self.folder, *more)
            self.assertEqual(status, 0, words)
            self.assertEqual(whole.differences(self.path), [], at)
        self.assertGreater(kept, len(moments) // 3)
        self.assertLess(kept, len(moments))

    def test_a_second_signal_loses_nothing(self):
        process = self.start(MANY)
        wait_for(self.path.exists)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=600)
        self.assertIn(process.returncode, (130, 143))
        with h5py.File(self.path) as file:
            self.assertIn(file["run"].attrs["status"], (b"running", b"stopped"))
        self.assertGreater(rows_in(self.path), 0)
        status, words = MANY.run(self.folder, "--continue")
        self.assertEqual(status, 0, words)
        self.assertEqual(rows_in(self.path), 400)

    def test_an_ignored_signal_stays_ignored(self):
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            process = self.start(MANY)
        finally:
            signal.signal(signal.SIGINT, before)
        wait_for(self.path.exists)
        process.send_signal(signal.SIGINT)
        _, words = process.communicate(timeout=600)
        self.assertEqual((process.returncode, words), (0, ""))


def looks_of(case, folder):
    """Run a case to its end; return how often it looked at clocks."""
    count = folder / "looks"
    status, words = case.run(folder, LOOK_COUNT=str(count), **SLOW)
    if status != 0:
        raise AssertionError(words)
    return int(count.read_text())


def caught(process):
    """Whether the program has set its own handler of SIGINT, a bit that /proc shows."""
    try:
        text = Path(f"/proc/{process.pid}/status").read_text()
    except OSError:
        return False
    mask = next(int(x.split()[1], 16) for x in text.splitlines() if x.startswith("SigCgt"))
    return mask >> (signal.SIGINT - 1) & 1 == 1


if __name__ == "__main__":
    if not os.path.exists("/proc/self/status"):
        raise SystemExit(77)
    unittest.main()
