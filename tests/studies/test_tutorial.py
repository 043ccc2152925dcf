"""The commands of docs/tutorial.md run, and print what the page shows."""

import unittest

from page_test import PageTest


class Tutorial(PageTest):
    def test_tutorial(self):
        self.check("docs/tutorial.md")


if __name__ == "__main__":
    unittest.main()
