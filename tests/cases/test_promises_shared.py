"""Accuracies asked of the decks of ../shared/reference/finds3 that were promised wrongly.

Where that folder is absent the whole file is skipped (status 77). Its name says `shared`, so that
the skip is allowed; nothing else is skipped here.
"""

import sys
import unittest

from program import ASKED, SOURCE, Run

SHARED = SOURCE.parent / "shared" / "reference" / "finds3"


def reached(name, *options, **overrides):
    """Run a deck there; the resultant of its pair at the end."""
    text = (SHARED / f"{name}.inp").read_text(encoding="utf-8")
    run = Run(text, *options, name=name, **overrides)
    if run.status != 0:
        raise AssertionError(run.errors)
    with run.result() as result:
        return result.pairs[0].resultant[-1]


class Promised(unittest.TestCase):
    def test_load_paths_are_followed(self):
        """Friction at the end, by fine increments on a mesh of n = 6: -1.61, of a scale of 6.3."""
        for name in ("accuracy_periodic_aliased", "accuracy_kinks_not_followed"):
            with self.subTest(deck=name):
                friction = reached(name, *ASKED, "0.1")[0]
                self.assertLess(abs(friction + 1.61), 0.1 * 6.3)

    def test_contact_is_found(self):
        """0.00188 by C3D8I, --refine 3."""
        force = reached("accuracy_reached_no_contact", *ASKED, "0.2")[2]
        self.assertLess(abs(force / 0.00188 - 1), 0.2)

    def test_what_has_a_limit_is_not_said_to_have_none(self):
        """20 % instead of the 5 % there, which take half a minute."""
        text = (SHARED / "accuracy_false_no_limit.inp").read_text(encoding="utf-8")
        run = Run(text.replace("\n0.05\n", "\n0.2\n"), name="limit")
        self.assertEqual(run.status, 0, run.errors)


if __name__ == "__main__":
    if not SHARED.exists():
        print(f"skipped: {SHARED} is not there")
        sys.exit(77)
    unittest.main()
