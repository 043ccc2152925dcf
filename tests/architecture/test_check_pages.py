"""check_pages.py names lines that are too long and can be broken, and no others."""

import unittest

from check_pages import COLUMNS, long_lines

LONG = "word " * 21 + "word"


class LongLines(unittest.TestCase):
    def test_text_is_named(self) -> None:
        self.assertEqual(long_lines(f"short\n{LONG}\n- {LONG}\n"), [2, 3])
        self.assertEqual(long_lines("x" * 50 + " " + "y" * (COLUMNS - 51)), [])
        self.assertEqual(long_lines("x" * 50 + " " + "y" * (COLUMNS - 50)), [1])

    def test_what_cannot_be_broken_is_left_out(self) -> None:
        for line in ("- `" + LONG + "`", f"[{LONG}](page.md)", "x" * 120):
            self.assertEqual(long_lines(line), [])
        self.assertEqual(long_lines(f"see [{LONG}](page.md)"), [1])

    def test_code_tables_and_headings_are_left_out(self) -> None:
        self.assertEqual(long_lines(f"# {LONG}\n| {LONG} |\n\n    {LONG}\n```\n{LONG}\n```\n"), [])


if __name__ == "__main__":
    unittest.main()
