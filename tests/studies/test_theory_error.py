"""The study of small strain beside finite strain: its page is that of its data."""

import unittest

from study import need

need("h5py", "matplotlib")

from studies import theory_error  # noqa: E402
from studies.pages import StudyError  # noqa: E402


class TheoryError(unittest.TestCase):
    """The page, and what it refuses to say."""

    def setUp(self):
        self.rows = theory_error.read_kept()
        self.asked = theory_error.read_kept(theory_error.KEPT_ASKED)

    def page(self):
        """The page of these rows, without the line that names the machine."""
        figure = theory_error.FIGURE.relative_to(theory_error.PAGE.parent)
        return [line for line in theory_error.page(self.rows, self.asked,
                                                         figure).splitlines()
                if not line.startswith("By `studies/run")]

    def test_the_page_is_that_of_the_data(self):
        text = theory_error.PAGE.read_text(encoding="utf-8").splitlines()
        self.assertEqual(self.page(), [line for line in text
                                       if not line.startswith("By `studies/run")])

    def test_every_scene_is_kept(self):
        self.assertEqual({row["scene"] for row in self.rows}, set(theory_error.SCENES))
        self.assertLessEqual({row["scene"] for row in self.asked}, set(theory_error.ASKED))

    def test_an_accuracy_that_is_not_kept_is_no_page(self):
        row = next(row for row in self.asked if row["true"])
        row["true"] = 1.1 * row["asked"]
        with self.assertRaises(StudyError):
            self.page()

    def test_a_bound_below_the_truth_is_no_page(self):
        self.rows[0]["bound"] = 0.5 * self.rows[0]["svk_true"]
        with self.assertRaises(StudyError):
            self.page()


if __name__ == "__main__":
    unittest.main()
