"""The commands and the Python of README.md run, and print what the page shows."""

import contextlib
import doctest
import tempfile
import unittest
from pathlib import Path

import numpy as np
from page_test import PageTest
from study import PROGRAM, ROOT

from studies.sessions import furnish


class Readme(PageTest):
    def test_commands(self):
        self.check("README.md")

    def test_python(self):
        page = (ROOT / "README.md").read_text(encoding="utf-8")
        examples = doctest.DocTestParser().get_examples(page)
        shown = 0
        names = {}
        with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
            furnish(Path(place), PROGRAM)
            for example in examples:
                if example.want:
                    found = eval(example.source, names)
                    wanted = eval(example.want, {"array": np.array})
                    np.testing.assert_allclose(found, wanted, rtol=1e-6, err_msg=example.source)
                    shown += 1
                else:
                    exec(example.source, names)
        self.assertGreater(shown, 0)


if __name__ == "__main__":
    unittest.main()
