"""What a command tells its user: tables, the machine, how far it is."""

import platform
import sys
import time
from pathlib import Path


def table(head, rows):
    """Return the lines of a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(map(str, line)) + " |" for line in lines]


def machine():
    """Return the processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


class Bar:
    """A progress bar on a terminal; a line now and then elsewhere."""

    def __init__(self, total):
        self.total, self.done, self.begun, self.said = total, 0.0, time.monotonic(), 0.0

    def show(self, what):
        """Show how far the study is and what runs now."""
        if self.total == 0:
            return
        share, now = self.done / self.total, time.monotonic()
        left = "?" if share < 0.01 else f"{(now - self.begun) * (1 / share - 1):.0f} s"
        blocks = "#" * int(30 * share)
        line = f"[{blocks:<30}] {share:4.0%}  {left} left  {what}"
        if sys.stderr.isatty():
            print(f"\r{line:<90.90}", end="", file=sys.stderr, flush=True)
        elif now - self.said > 30:
            self.said = now
            print(line, file=sys.stderr, flush=True)

    def advance(self, weight):
        """Count a run of this weight."""
        self.done += weight

    def close(self):
        """End the bar's line."""
        if self.total and sys.stderr.isatty():
            print(f"\r{'':<90}\r", end="", file=sys.stderr, flush=True)
