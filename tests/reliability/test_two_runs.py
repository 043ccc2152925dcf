"""Two runs never write one file, however close together they begin."""

import unittest

from result_checks import INPUT, NAME, Case, Folder, Whole, rows_in, wait_for

SHORT = Case(INPUT / "block.inp", n=2, steps=10)
LONG = Case(INPUT / "block.inp", n=2, steps=400)


class TwoRuns(Folder):
    def test_a_run_that_writes_keeps_its_file(self):
        process = LONG.start(self.folder)
        wait_for(self.path.exists)
        for options in ((), ("--overwrite",), ("--continue",)):
            status, words = LONG.run(self.folder, *options)
            if process.poll() is None:
                self.assertEqual(status, 1, words)
                self.assertIn("is in use by another program", words)
        process.communicate(timeout=600)
        self.assertEqual(process.returncode, 0)
        self.assertEqual(rows_in(self.path), 400)

    def race(self, *more):
        """Begin several runs at once; all but those that find a finished file are refused."""
        processes = [SHORT.start(self.folder, *more) for _ in range(6)]
        statuses, words = [], []
        for process in processes:
            words.append("".join(process.communicate(timeout=600)))
            statuses.append(process.returncode)
        self.assertIn(0, statuses, words)
        self.assertLessEqual(set(statuses), {0, 1}, words)
        for status, text in zip(statuses, words, strict=True):
            if status == 1:
                self.assertRegex(
                    text, "another run is about to write|in use by another program|is finished"
                )
        self.assertEqual(
            sorted(p.name for p in self.folder.iterdir() if p.suffix != ".xdmf"), [NAME]
        )

    def test_several_that_begin_at_once(self):
        other = self.elsewhere()
        n = SHORT.count_changes(other)
        (other / "changes").unlink()
        whole = Whole(other / NAME)
        for i in range(5):
            with self.subTest(attempt=i):
                if self.path.exists():
                    self.path.unlink()
                # What a killed run has left where its file began.
                SHORT.kill_at(self.folder, 3)
                self.race()
                self.assertEqual(whole.differences(self.path), [])
                self.path.unlink()
                SHORT.kill_at(self.folder, n // 2)
                self.race("--continue")
                self.assertEqual(whole.differences(self.path), [])


if __name__ == "__main__":
    unittest.main()
