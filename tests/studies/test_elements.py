"""The study of elements: its page is that of its data, and its data are those of the program."""

import sys
import tempfile
import unittest
from pathlib import Path

from study import PROGRAM, ROOT, need

need("h5py", "matplotlib")

from studies import elements  # noqa: E402

if not PROGRAM.exists():
    print(f"skipped: there is no {PROGRAM}")
    sys.exit(77)


class Elements(unittest.TestCase):
    """Runs of a second or less."""

    def test_the_page_is_that_of_the_data(self):
        page = (ROOT / "docs" / "studies" / "elements.md").read_text(encoding="utf-8")
        self.assertEqual(elements.page(elements.read_kept(), Path("figures/elements.png")), page)

    def test_runs_find_what_was_kept(self):
        kept = elements.read_kept()
        with tempfile.TemporaryDirectory() as folder:
            for part, kind, size in (
                ("block", "C3D10", "2"), ("bending", "C3D20R", "2"), ("hertz", "C3D8I", "8"),
                ("rings", "C3D15", "3/2"),
            ):
                with self.subTest(part=part, kind=kind):
                    row = elements.run(PROGRAM, part, kind, size, Path(folder))
                    wanted = elements.values_of(kept[part, kind, size])
                    for name, value in elements.values_of(row).items():
                        self.assertAlmostEqual(value / wanted[name], 1, delta=1e-6)

    def test_extrapolation(self):
        values = [3 + 5 * n**-1.3 for n in (4, 6, 8)]
        self.assertAlmostEqual(elements.extrapolated((4, 6, 8), values), 3, delta=1e-9)


if __name__ == "__main__":
    unittest.main()
