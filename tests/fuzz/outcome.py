"""A run of the program with limits, and what is wrong with any end of it, whatever the input."""

import math
import os
import re
import resource
import signal
import subprocess
import threading
import time
from contextlib import contextmanager

PATIENCE = 900  # with a program that hangs without working [s]
# A message of status 1: file:line:column, or the deck as a whole, or the command line.
PLACED = re.compile(
    r"^(?:[^\n]+:\d+:\d+: error: |[^\n]*(?:deck\.inp|problem\.hdf5): error: |"
    r"error: --set |bipot: error: )",
    re.M,
)
# What only a mistake in the program says.
BROKEN = re.compile(
    r"Backtrace|Fortran runtime|Program received|Sanitizer|runtime error:|internal error|"
    r"At line \d+ of file", re.I
)
ENVIRONMENT = {
    **os.environ,
    "OPENBLAS_NUM_THREADS": "1",
    # Chosen beforehand, so that the program need not start again.
    "OPENBLAS_CORETYPE": os.environ.get("OPENBLAS_CORETYPE", "Haswell"),
}


@contextmanager
def stopped_after(process, seconds):
    """Kill a process that is not done with after so many seconds; give the event of that."""
    stopped = threading.Event()

    def stop():
        stopped.set()
        process.kill()

    timer = threading.Timer(seconds, stop)
    timer.start()
    try:
        yield stopped
    finally:
        timer.cancel()


class Outcome:
    """What a run of the program did."""

    def __init__(self, command, folder, limit, addresses):
        """Run `command` in `folder` with a limit on the time of the processor, in seconds."""

        def prepare():
            os.setpgid(0, 0)
            # What works on and on is ended by the system: by time of its own, not by the clock.
            soonest = math.ceil(limit) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (soonest, soonest + 5))
            if addresses:
                resource.setrlimit(resource.RLIMIT_AS, (addresses, addresses))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

        with open(folder / "stdout", "wb") as out, open(folder / "stderr", "wb") as err:
            process = subprocess.Popen(
                command, cwd=folder / "work", stdout=out, stderr=err, stdin=subprocess.DEVNULL,
                preexec_fn=prepare, env=ENVIRONMENT,
            )
            started = time.monotonic()
            with stopped_after(process, PATIENCE) as stopped:
                _, status, usage = os.wait4(process.pid, 0)
            self.timed_out = stopped.is_set()
            process.returncode = os.waitstatus_to_exitcode(status)
        self.seconds = usage.ru_utime + usage.ru_stime
        self.waited = time.monotonic() - started
        self.limit = limit
        self.status = process.returncode
        # A child begins as a copy of this process: what is no more than that is not its own.
        own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        self.peak = 1024 * usage.ru_maxrss if usage.ru_maxrss > own else 0
        self.output = (folder / "stdout").read_bytes().decode("utf-8", "replace")
        self.errors = (folder / "stderr").read_bytes().decode("utf-8", "replace")

    def complaints(self):
        """What is wrong with any end of the program like this."""
        found = []
        if self.timed_out:
            return [f"no end within {self.waited:.0f} s"]
        if self.seconds > self.limit:
            found.append(f"{self.seconds:.0f} s")
        if self.status < 0:
            found.append(f"ended by {signal.Signals(-self.status).name}")
        elif self.status not in (0, 1, 2, 3):
            found.append(f"exit status {self.status}")
        match = BROKEN.search(self.errors + self.output)
        if match:
            found.append(f"'{match.group()}' was said")
        if self.status == 1 and not PLACED.search(self.errors):
            found.append("status 1 without a place")
        if self.status in (2, 3) and not self.errors.strip():
            found.append(f"status {self.status} without a message")
        if self.status == 0 and self.errors.strip():
            found.append("status 0 and a message on standard error")
        if "\ufffd" in self.errors + self.output:
            found.append("what was said is not UTF-8")
        if len(self.errors) > 2_000_000:
            found.append(f"{len(self.errors)} characters of messages")
        return found
