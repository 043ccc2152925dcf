"""Decks read and planned one after the other in one process, by tests/fuzz/deck_server.c."""

import os
import struct
import subprocess
import tempfile
from pathlib import Path

PROGRAM = Path(os.environ.get("BIPOT", "bipot")).parent / "tests" / "deck_server"


class DeckServer:
    """A process that says what the program would say of a deck: of its reader and of its plan."""

    def __init__(self, folder=None, **files):
        """Start it in a folder, or one of its own that has some files: texts by their names."""
        self.folder = tempfile.TemporaryDirectory(prefix="bipot-")
        for name, text in files.items():
            (Path(self.folder.name) / name).write_text(text)
        self.process = subprocess.Popen(
            [PROGRAM], cwd=folder or self.folder.name, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def ask(self, text):
        """Return the exit status, and the errors, or the notes and lines of the plan, of a deck.

        A deck is a text, or its bytes.
        """
        data = text.encode() if isinstance(text, str) else text
        self.process.stdin.write(struct.pack("i", len(data)) + data)
        self.process.stdin.flush()
        status, length = struct.unpack("ii", self.process.stdout.read(8))
        return status, self.process.stdout.read(length).decode()

    def close(self):
        """End the process."""
        self.process.communicate()
        self.folder.cleanup()
