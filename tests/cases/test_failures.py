"""The machine fails: disk full, quota, no memory, a folder or file that is not there any more.

Whatever fails, the program ends with exit status 3 and one message that names what failed, no
file half begun is left, and the increments that the result file counts are those of a run that
nothing disturbed.

Failures are provoked for real where a limit of the process does it (RLIMIT_FSIZE, RLIMIT_AS), by a
small disk where one may be mounted, and call by call through tests/reliability/failing_calls.c,
which makes a chosen allocation or write fail. BIPOT_LONG=1 tries up to 1,500 calls, not a few.
"""

import contextlib
import errno
import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import numpy
from program import INPUT, PROGRAM, SOURCE

from bipot.result import Result  # found through program

LONG = os.environ.get("BIPOT_LONG", "") not in ("", "0")
DECK = INPUT / "block.inp"
SETTINGS = ["--set", "steps=5", "--set", "n=3"]
INCREMENTS = 5
PATIENCE = 600  # with a program that hangs [s]
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
MACHINE = 3  # the exit status
MEGABYTE = 1000000
NOBODY = 65534

tools = tempfile.TemporaryDirectory(prefix="bipot-failing-")


def setUpModule():
    """Compile the library that fails at a chosen call, and run undisturbed once."""
    global FAILING_CALLS, WHOLE
    FAILING_CALLS = Path(tools.name) / "failing_calls.so"
    source = SOURCE / "tests" / "reliability" / "failing_calls.c"
    subprocess.run(
        [os.environ.get("CC", "cc"), "-shared", "-fPIC", "-O1", "-o", FAILING_CALLS, source,
         "-ldl"],
        check=True,
    )
    status, errors, _ = run(tools.name)
    if status != 0:
        raise RuntimeError(errors)
    with Result(Path(tools.name) / "block.vtkhdf") as result:
        WHOLE = displacements(result)


def tearDownModule():
    """Remove what was compiled."""
    tools.cleanup()


def run(folder, *options, program=PROGRAM, limits=(), user=None, environment=None, deck=DECK):
    """Run the deck in a folder: exit status, standard error, files left.

    `limits` are pairs of a resource and its value; `user` is the id to run as.
    """

    def prepare():
        for which, value in limits:
            resource.setrlimit(which, (value, value))
        if user is not None:
            os.setgroups([])
            os.setgid(user)
            os.setuid(user)

    done = subprocess.run(
        [str(program), str(deck), *SETTINGS, "--quiet", *options],
        cwd=folder,
        env={**os.environ, **(environment or {})},
        capture_output=True,
        timeout=PATIENCE,
        check=False,
        preexec_fn=prepare,
    )
    left = sorted(os.listdir(folder))
    return done.returncode, done.stderr.decode(), left


def run_failing(folder, deck=DECK, **which):
    """Run with calls that fail, `which` as failing_calls.c has it: exit status, standard error."""
    environment = {name: str(value) for name, value in which.items()}
    environment["LD_PRELOAD"] = str(FAILING_CALLS)
    return run(folder, deck=deck, environment=environment)[:2]


def displacements(result):
    """All displacements of a result, increment by increment."""
    return [result.field("displacement", row) for row in range(len(result.field_rows))]


class Failures(unittest.TestCase):
    """What is common to all failures."""

    def assert_told(self, status, errors, *words):
        """The machine failed, and the message says what of it."""
        self.assertEqual(status, MACHINE, errors)
        for word in words:
            self.assertRegex(errors, word)
        self.assertNotIn("Backtrace", errors)

    def assert_kept(self, folder, errors="", compare=True):
        """What the result file counts is there and right; nothing half begun lies beside it.

        Returns the number of increments. Without `compare` they are of another run than WHOLE.
        Where little memory is left the plan takes a factor in single precision: such a run stops
        at another point within the tolerance of contact, 1e-10.
        """
        folder = Path(folder)
        self.assertFalse((folder / "block.vtkhdf.new").exists(), "left behind")
        told = re.search(r"(\d+) increments before it are kept in", errors)
        if not (folder / "block.vtkhdf").exists():
            self.assertIsNone(told, errors)
            return 0
        with Result(folder / "block.vtkhdf") as result:
            found = displacements(result)
            finished = result.finished
            bits = result.run["single_factor"] == 0
        # The last increment may be counted in the histories, and its failure be told, before its
        # fields are counted as well.
        self.assertIn(finished - len(found), (0, 1))
        if told:
            self.assertIn(finished - int(told.group(1)), (0, 1), errors)
        if not compare:
            return finished
        for row, (kept, whole) in enumerate(zip(found, WHOLE[: len(found)], strict=True)):
            allowed = 0 if bits else 1e-9 * abs(whole).max()
            numpy.testing.assert_allclose(
                kept, whole, rtol=0, atol=allowed, err_msg=f"increment {row + 1}"
            )
        return finished


def calls(environment, folder, deck=DECK):
    """How many allocations and writes an undisturbed run makes."""
    counts = Path(folder) / "counts"
    run_failing(folder, deck, COUNT_CALLS=counts, **environment)
    return [int(word) for word in counts.read_text().split()]


def chosen(number, few):
    """The calls from 1 to `number` that are tried: a few, or 1,500 (often all) in the long form."""
    if LONG:
        few = 1500
    if number <= few:
        return range(1, number + 1)
    return sorted({1 + round(i * (number - 1) / (few - 1)) for i in range(few)})


class Disk(Failures):
    """A disk that takes no more, or never did."""

    @contextlib.contextmanager
    def small_disk(self, size):
        """A folder with room for `size` bytes, and limits for the process that make it so.

        A disk in memory where the machine lets one be mounted, otherwise the limit on files.
        """
        with tempfile.TemporaryDirectory() as folder:
            mounted = (
                os.geteuid() == 0
                and shutil.which("mount") is not None
                and subprocess.run(
                    ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder],
                    capture_output=True,
                    check=False,
                ).returncode
                == 0
            )
            try:
                yield folder, [] if mounted else [(resource.RLIMIT_FSIZE, size)]
            finally:
                if mounted:
                    subprocess.run(["umount", folder], check=True)

    def test_a_small_disk_is_refused_before_the_run(self):
        with self.small_disk(100000) as (folder, limits):
            status, errors, left = run(folder, limits=limits)
        self.assert_told(status, errors, "are free on that disk", "nothing was run")
        self.assertEqual(left, [])

    def test_a_disk_that_fills_keeps_what_was_written(self):
        kept = []
        # Almost all of a small file is what is laid out before the first increment.
        many = ("--set", "steps=100")
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(run(folder, *many)[0], 0)
            whole = (Path(folder) / "block.vtkhdf").stat().st_size
        for share in (0.01, 0.5, 0.8, 0.85, 0.9, 0.95, 0.99):
            size = int(share * whole)
            with self.small_disk(size) as (folder, limits):
                status, errors, _ = run(folder, "--force", *many, limits=limits)
                self.assert_told(
                    status, errors, "block.vtkhdf", "No space left on device|File too large"
                )
                kept.append(self.assert_kept(folder, errors, compare=False))
        self.assertIn(0, kept)
        self.assertTrue(any(0 < n < 100 for n in kept), kept)

    def test_the_limit_on_files_does_not_kill(self):
        for size in (0, 8192, 100000, 1000000):
            with tempfile.TemporaryDirectory() as folder:
                status, errors, _ = run(
                    folder, "--force", limits=[(resource.RLIMIT_FSIZE, size)]
                )
                self.assert_told(status, errors, r"File too large|limit on files \(ulimit -f\)")
                self.assert_kept(folder, errors)

    def test_the_limit_on_files_counts_fields_at_gauss_points(self):
        text = DECK.read_text(encoding="utf-8")
        gauss = "*EL FILE, POSITION=INTEGRATION POINTS\nS\n"
        needed = []
        for card in ("", gauss):
            with tempfile.TemporaryDirectory() as folder:
                deck = Path(folder) / "block.inp"
                deck.write_text(text.replace("*END STEP", f"{card}*END STEP"))
                status, errors, _ = run(
                    folder, "--force", "--set", "n=12", limits=[(resource.RLIMIT_FSIZE, MEGABYTE)],
                    deck=deck,
                )  # fmt: skip
            self.assert_told(status, errors, r"limit on files \(ulimit -f\) is 1 MB")
            needed.append(float(re.search(r"it may take ([\d.]+) MB", errors)[1]))
        # Six numbers of 8 bytes at 8 points of each of the elements.
        self.assertGreater(needed[1] - needed[0], 0.98 * 12**3 * 8 * 6 * 8 / MEGABYTE)

    def test_a_full_disk_at_any_write(self):
        self.fail_writes(errno.ENOSPC, "No space left on device", 25)

    def test_a_quota_at_any_write(self):
        self.fail_writes(errno.EDQUOT, "Disk quota exceeded", 6)

    def test_a_broken_disk_at_any_write(self):
        self.fail_writes(errno.EIO, "Input/output error", 6)

    def fail_writes(self, number, words, few):
        """Let the disk fail from a certain write on."""
        with tempfile.TemporaryDirectory() as folder:
            n_writes = calls({}, folder)[1]
        self.assertGreater(n_writes, 100)
        kept = set()
        for k in chosen(n_writes, few):
            with tempfile.TemporaryDirectory() as folder:
                status, errors = run_failing(folder, FAIL_WRITE=k, FAIL_ERRNO=number)
                with self.subTest(write=k):
                    self.assert_told(status, errors, words + "|reached the disk", "block.")
                    kept.add(self.assert_kept(folder, errors))
        self.assertIn(0, kept)
        self.assertGreater(len(kept), 1)

    def test_a_full_standard_output_goes_to_standard_error(self):
        with tempfile.TemporaryDirectory() as folder, open("/dev/full", "wb") as full:
            done = subprocess.run(
                [PROGRAM, str(DECK), *SETTINGS],
                cwd=folder, stdout=full, stderr=subprocess.PIPE, timeout=PATIENCE, check=False,
            )
            self.assertEqual(done.returncode, 0)
            self.assertIn(b"5 of 5 increments certified", done.stderr)
            self.assertIn(b"bipot 0", done.stderr)

    def test_closed_streams_do_not_become_the_result(self):
        for closed in ("<&- >&- 2>&-", ">&-", "2>&-", ">&- 2>&-", "<&-"):
            with self.subTest(closed=closed), tempfile.TemporaryDirectory() as folder:
                done = subprocess.run(
                    ["sh", "-c", f'exec "$@" {closed}', "sh", str(PROGRAM), str(DECK), *SETTINGS],
                    cwd=folder, capture_output=True, timeout=PATIENCE, check=False,
                )
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(done.stderr, b"")
                self.assertEqual(b"5 of 5 increments" in done.stdout, ">&-" not in closed.split())
                self.assertEqual(self.assert_kept(folder), INCREMENTS)

    def test_a_pipe_that_nobody_reads_does_not_end_the_run(self):
        with tempfile.TemporaryDirectory() as folder:
            with subprocess.Popen(
                [PROGRAM, str(DECK), *SETTINGS],
                cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            ) as process:
                process.stdout.readline()
                process.stdout.close()
                errors = process.stderr.read()
                self.assertEqual(process.wait(PATIENCE), 0, errors)
            self.assertEqual(errors, b"")
            self.assertEqual(self.assert_kept(folder), INCREMENTS)

    def test_a_folder_that_may_not_be_written(self):
        with tempfile.TemporaryDirectory() as folder:
            os.chmod(folder, 0o755)
            program, deck = Path(folder) / "bipot", Path(folder) / "block.inp"
            shutil.copy(PROGRAM, program)
            shutil.copy(DECK, deck)
            os.chmod(program, 0o755)
            os.chmod(deck, 0o644)
            os.chmod(folder, 0o555)
            # The superuser may write everywhere.
            user = NOBODY if os.geteuid() == 0 else None
            status, errors, left = run(folder, program=program, deck=deck, user=user)
            os.chmod(folder, 0o755)
            self.assert_told(status, errors, "block.vtkhdf", "Permission denied")
            self.assertEqual(left, ["bipot", "block.inp"])

    def test_a_folder_that_is_not_there(self):
        with tempfile.TemporaryDirectory() as folder:
            status, errors, left = run(folder, "-o", "no/such/folder.vtkhdf")
            self.assert_told(status, errors, "folder.vtkhdf", "No such file or directory")
            self.assertEqual(left, [])

    def test_a_result_that_vanishes(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "block.vtkhdf"
            with subprocess.Popen(
                [PROGRAM, str(DECK), "--set", "n=6", "--set", "steps=5000", "--quiet"],
                cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
            ) as process:
                end = time.monotonic() + PATIENCE
                while not file.exists() and time.monotonic() < end:
                    time.sleep(0.01)
                file.unlink()
                errors = process.communicate(timeout=PATIENCE)[1].decode()
            self.assert_told(process.returncode, errors, "block.vtkhdf' is no longer there")
            self.assertEqual(os.listdir(folder), [])

    def test_a_folder_that_vanishes(self):
        with tempfile.TemporaryDirectory() as parent:
            folder = Path(parent) / "runs"
            folder.mkdir()
            with subprocess.Popen(
                [PROGRAM, str(DECK), "--set", "n=6", "--set", "steps=5000", "--quiet"],
                cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
            ) as process:
                end = time.monotonic() + PATIENCE
                while not (folder / "block.vtkhdf").exists() and time.monotonic() < end:
                    time.sleep(0.01)
                shutil.rmtree(folder)
                errors = process.communicate(timeout=PATIENCE)[1].decode()
            self.assert_told(process.returncode, errors, "block.vtkhdf' is no longer there")


class Memory(Failures):
    """Memory that the system refuses."""

    def test_a_limit_on_addresses(self):
        """From the least with which the program starts at all to what is enough."""
        least, enough = 50 * MEGABYTE, 4000 * MEGABYTE
        while enough - least > 4 * MEGABYTE:
            middle = (least + enough) // 2
            if self.starts(middle):
                enough = middle
            else:
                least = middle
        limit, found = enough, set()
        while True:
            with tempfile.TemporaryDirectory() as folder:
                status, errors, _ = run(
                    folder, "--force", limits=[(resource.RLIMIT_AS, limit)]
                )
                with self.subTest(limit=limit):
                    found.add(status)
                    if status == 0:
                        self.assertEqual(self.assert_kept(folder), INCREMENTS)
                        break
                    self.assert_told(status, errors, "memory|limit on addresses")
                    self.assert_kept(folder, errors)
            limit += (1 if LONG else 12) * MEGABYTE
            self.assertLess(limit, 4000 * MEGABYTE)
        self.assertEqual(found, {0, MACHINE})

    def test_a_limit_on_data(self):
        found = set()
        for limit in range(60, 320, 4 if LONG else 20):
            with tempfile.TemporaryDirectory() as folder:
                status, errors, _ = run(
                    folder, "--force", limits=[(resource.RLIMIT_DATA, limit * MEGABYTE)]
                )
                with self.subTest(limit=limit):
                    found.add(status)
                    if status == 0:
                        self.assertEqual(self.assert_kept(folder), INCREMENTS)
                    else:
                        self.assert_told(status, errors, "memory|ulimit -d")
                        self.assert_kept(folder, errors)
        self.assertEqual(found, {0, MACHINE})

    def test_a_limit_on_the_stack(self):
        for kilobytes, expected in ((64, MACHINE), (256, MACHINE), (1024, 0)):
            with self.subTest(kilobytes=kilobytes), tempfile.TemporaryDirectory() as folder:
                limit = 1024 * kilobytes
                status, errors, left = run(folder, limits=[(resource.RLIMIT_STACK, limit)])
                self.assertEqual(status, expected, errors)
                if expected != 0:
                    self.assert_told(status, errors, rf"\(ulimit -s\) is {kilobytes} kB")
                    self.assertEqual(left, [])

    @staticmethod
    def starts(limit):
        """Whether the program and its libraries can be loaded with so many addresses."""
        return subprocess.run(
            [PROGRAM, "--version"],
            capture_output=True, check=False, timeout=PATIENCE,
            # OpenBLAS makes threads as it is loaded, where nothing keeps it from that.
            env={k: v for k, v in os.environ.items() if k not in THREADS},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
        ).returncode == 0

    def test_any_allocation_of_the_program(self):
        self.fail_allocations({}, 30)

    def test_any_large_allocation_of_the_program(self):
        self.fail_allocations({"FAIL_ALLOCATION_FROM": "2000"}, 20)

    def test_the_workspace_of_mumps(self):
        self.fail_allocations({"FAIL_IN": "libdmumps", "FAIL_ALLOCATION_FROM": "50000"}, 12,
                              "MUMPS -|memory")

    def fail_allocations(self, which, few, words="not enough memory"):
        """Let one allocation fail. Some can be done without; then the result is whole."""
        with tempfile.TemporaryDirectory() as folder:
            number = calls(which, folder)[0]
        self.assertGreater(number, 3)
        failed = 0
        for k in chosen(number, few):
            with tempfile.TemporaryDirectory() as folder:
                status, errors = run_failing(folder, FAIL_ALLOCATION=k, **which)
                with self.subTest(allocation=k):
                    if status == 0:
                        self.assertEqual(self.assert_kept(folder), INCREMENTS)
                        continue
                    failed += 1
                    if status == 1:
                        # A block that memory does not hold is a mistake with a place.
                        self.assertIn("error: not enough memory for the nodes", errors)
                        continue
                    self.assert_told(status, errors, words)
                    # As after a kill, what was begun may lie there; the next run clears it.
                    with contextlib.suppress(FileNotFoundError):
                        (Path(folder) / "block.vtkhdf.new").unlink()
                    self.assert_kept(folder, errors)
        self.assertGreater(failed, 0)

    def test_a_block_that_no_machine_holds(self):
        with tempfile.TemporaryDirectory() as folder:
            status, errors, left = run(
                folder, "--set", "n=250", limits=[(resource.RLIMIT_AS, 700 * MEGABYTE)]
            )
            self.assertIn(status, (1, MACHINE), errors)
            self.assertIn("memory", errors)
            self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()
