"""What tests of pages with console sessions share: a page is replayed in a folder of its own."""

import re
import sys
import tempfile
import unittest
from pathlib import Path

from study import ROOT

from bipot.executable import built_program
from studies.sessions import difference, furnish, missing_tool, replay, run_code

CODE = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


class PageTest(unittest.TestCase):
    """Tests of pages."""

    def check(self, name):
        """Run the commands of a page, then its pieces of Python as one program."""
        page = (ROOT / name).read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory(prefix="bipot-") as place:
            folder = Path(place)
            furnish(folder, built_program())
            # Pixels take time, and nothing here looks at them.
            for command, status, printed in replay(page, folder, show="--dpi 20"):
                if printed is None:
                    print(f"{missing_tool(command.words)} is not installed: {command.words}",
                          file=sys.stderr)
                    continue
                with self.subTest(command=command.words):
                    self.assertEqual(status, 0, "\n".join(printed))
                    self.assertIsNone(difference(command.shown, printed), "\n".join(printed))
            code = "".join(CODE.findall(page))
            if code:
                done = run_code(code, page, folder)
                self.assertEqual(done.returncode, 0, done.stderr)
