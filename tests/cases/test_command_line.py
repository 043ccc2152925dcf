"""The command line, the exit statuses, and what happens to result files."""

import os
import pty
import re
import subprocess
import unittest

import h5py
from program import INPUT, PROGRAM, SOURCE, Run

BLOCK = INPUT / "block.inp"
SMALL = {"n": 1, "steps": 10}


class CommandLine(unittest.TestCase):
    def call(self, *words, **environment):
        return subprocess.run(
            [PROGRAM, *words], capture_output=True, text=True, timeout=600, check=False,
            env={**os.environ, **environment},
        )

    def test_help_and_version(self):
        answer = self.call("--help")
        self.assertEqual(answer.returncode, 0)
        for option in ("--set", "--plan", "--overwrite", "--quiet", "--verbose", "--output"):
            self.assertIn(option, answer.stdout)
        for status in (0, 1, 2, 3, 130):
            self.assertRegex(answer.stdout, rf"(?m)^ +{status}  \w")
        project = (SOURCE / "CMakeLists.txt").read_text()
        declared = re.search(r"project\(bipot VERSION (\S+)", project)
        self.assertEqual(self.call("--version").stdout.strip(), f"bipot {declared[1]}")

    def test_every_option_is_read_and_in_the_help(self):
        source = (SOURCE / "src" / "console" / "command_line.f90").read_text()
        table = re.findall(r"option_t\('(-[a-z-]+)'", source)
        self.assertGreater(len(table), 25)
        cases = re.findall(r"'(-[a-z-]+)'", "".join(re.findall(r"case \('-.*\)", source)))
        self.assertEqual(sorted(table), sorted(cases))
        text = self.call("--help").stdout
        for option in table:
            with self.subTest(option=option):
                self.assertRegex(text, rf"(?<!\S){option}(?![\w-])")

    def test_a_deck_without_a_heading_is_called_by_its_file(self):
        text = re.sub(r"\*HEADING\n.*\n", "", BLOCK.read_text())
        run = Run(text, "--plan", name="nameless", **SMALL)
        self.assertRegex(run.output.splitlines()[0], r"^bipot \S+: \S*nameless.inp$")

    def test_wrong_words_end_with_1_and_say_why(self):
        for words, expected in (
            ((), "no deck"),
            (("--plans", "x.inp"), "--plan"),
            (("--chek", "x.inp"), "--check"),
            (("--check", "x.hdf5"), "--check applies to decks"),
            (("-o",), "needs a value"),
            (("--as-rigid",), "needs a value"),
            (("--as-rigd", "A", "x.inp"), "--as-rigid"),
            (("--until-stedy", "x.inp"), "--until-steady"),
            (("--until-steady", "x.hdf5"), "--until-steady applies to decks"),
            (("--symmetry", "x.hdf5"), "--symmetry applies to decks"),
            (("--as-rigid", "A", "x.hdf5"), "--as-rigid applies to decks"),
            (("a.inp", "b.inp"), "one deck"),
            (("--set", "n", "a.inp"), "name=value"),
            (("nowhere.inp",), "nowhere.inp"),
            ((str(INPUT),), "input"),
            (("--plan", "--flat", str(BLOCK)), "exclude each other"),
            (("--quiet", "--verbose", str(BLOCK)), "exclude each other"),
        ):
            with self.subTest(words=words):
                answer = self.call(*words)
                self.assertEqual(answer.returncode, 1, answer.stderr)
                self.assertIn(expected, answer.stderr)
                self.assertEqual(answer.stdout, "")

    def test_an_override_must_name_a_parameter(self):
        run = Run(BLOCK, nn=3)
        self.assertEqual(run.status, 1)
        self.assertIn("nn", run.errors.lower())
        self.assertFalse(run.file.exists())

    def kernels(self, core=None):
        """Return which kernels of OpenBLAS the program has where OPENBLAS_CORETYPE is `core`."""
        environment = dict(os.environ)
        environment.pop("OPENBLAS_CORETYPE", None)
        if core is not None:
            environment["OPENBLAS_CORETYPE"] = core
        answer = subprocess.run(
            [PROGRAM, "--version", "--verbose"], capture_output=True, text=True, timeout=600,
            check=True, env=environment,
        )
        return re.search(r"\nOpenBLAS .*, (\w+) kernels\n", answer.stdout)[1]

    def test_the_kernels_of_the_user_win(self):
        self.assertEqual(self.kernels("Nehalem"), "Nehalem")

    def test_kernels_are_those_of_the_processor(self):
        """The program starts again where OpenBLAS does not know the processor."""
        chosen = self.kernels()
        self.assertEqual(self.kernels(chosen), chosen)
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            flags = re.search(r"flags\s*: (.*)", file.read())[1].split()
        if "avx512vl" in flags:
            self.assertIn(chosen.upper(), ("SKYLAKEX", "COOPERLAKE", "SAPPHIRERAPIDS"))
        elif "avx2" in flags:
            self.assertIn(chosen.upper(), ("HASWELL", "ZEN"))
        else:
            self.assertNotEqual(chosen.upper(), "PRESCOTT")

    def test_it_starts_once_where_the_kernels_are_right(self):
        environment = {name: value for name, value in os.environ.items()
                       if not name.endswith("_NUM_THREADS")}  # fmt: skip
        environment |= {"OPENBLAS_CORETYPE": self.kernels(), "LD_DEBUG": "libs"}
        answer = subprocess.run(
            [PROGRAM, "--version"], capture_output=True, text=True, timeout=600, check=True,
            env=environment,
        )
        self.assertEqual(answer.stderr.count("initialize program:"), 1)
        # Libraries in the user's folder are none of the program's.
        tried = re.findall(r"trying file=(.*)", answer.stderr)
        self.assertTrue(tried)
        self.assertEqual([path for path in tried if not path.startswith("/")], [])

    def test_quiet_prints_one_sentence(self):
        run = Run(BLOCK, "--quiet", **SMALL)
        self.assertEqual(len(run.output.strip().split("\n")), 1)
        self.assertIn("10 of 10 increments certified", run.output)

    def test_a_run_prints_two_dozen_lines(self):
        """Title, five lines of plan, a line an increment, errors, forces, the file: no more."""
        run = Run(BLOCK, **{**SMALL, "n": 2})
        lines = run.output.splitlines()
        self.assertLessEqual(sum(not line.startswith("note: ") for line in lines), 24)
        names = ["mesh", "contact", "increments", "memory", "time"]
        self.assertEqual([line.split()[0] for line in lines[1:6]], names)
        self.assertEqual(len(re.findall(r"^ +[12] +\d+ .* of 10\b", run.output, re.MULTILINE)), 10)
        self.assertTrue(lines[-1].endswith(": block.vtkhdf"), lines[-1])
        # How it is solved is for those who ask.
        inside = (
            "residual|sweeps|Newton|linear solver|contact matrix|compliance|rows|factor|recover|"
            "condense")
        self.assertNotRegex(run.output, inside)
        verbose = Run(BLOCK, "--verbose", **{**SMALL, "n": 2}).output
        for word in (*inside.split("|")[:3], "linear solver", "contact matrix", "condense"):
            self.assertIn(word, verbose)

    def test_the_page_has_every_option(self):
        help_ = subprocess.run([PROGRAM, "--help"], capture_output=True, text=True, check=True)
        of_decks = help_.stdout.split("for a contact problem")[0]
        page = (SOURCE / "docs" / "options.md").read_text(encoding="utf-8")
        named = set(re.findall(r"^ +(?:-\w, )?(--[a-z-]+)", of_decks, re.MULTILINE))
        self.assertGreater(len(named), 25)
        rows = "".join(line for line in page.splitlines() if line.startswith("| `"))
        self.assertEqual(named, set(re.findall(r"(?<=`)--[a-z-]+", rows)))

    def test_the_plan_alone_writes_nothing(self):
        run = Run(BLOCK, "--plan")
        self.assertEqual(run.status, 0)
        self.assertFalse(run.file.exists())


def on_terminal(folder, *words, **environment):
    """Run the program with a terminal as its output; return its status and what it wrote."""
    try:
        ours, theirs = pty.openpty()
    except OSError as error:
        raise unittest.SkipTest(f"no pseudo-terminal: {error}") from error
    with subprocess.Popen(
        [PROGRAM, *map(str, words)], cwd=folder, stdin=subprocess.DEVNULL, stdout=theirs,
        stderr=theirs, env={**os.environ, "TERM": "xterm", **environment},
    ) as process:
        os.close(theirs)
        written = b""
        try:
            while piece := os.read(ours, 65536):
                written += piece
        except OSError:  # the other end is closed
            pass
        status = process.wait(timeout=600)
    os.close(ours)
    return status, written.decode().replace("\r\n", "\n")


class Progress(unittest.TestCase):
    """How much of a run is done, on a terminal and elsewhere."""

    def test_lines_in_a_pipe_count_the_increments(self):
        run = Run(BLOCK, n=1, steps=50)
        self.assertEqual(run.status, 0, run.errors)
        found = re.findall(r"^ +[12] .* (\d+) of 50(?:, (.+) left)?$", run.output, re.MULTILINE)
        self.assertEqual([int(done) for done, _ in found], list(range(1, 51)))
        # The first has the factorisation in it and tells no time; of the end there is nothing left.
        self.assertEqual([not left for _, left in found], [True] + [False] * 48 + [True])
        for _, left in found[1:-1]:
            self.assertRegex(left, r"^(\d+(\.\d+)? s|\d+ min \d+ s|\d+ h \d+ min)$")
        self.assertNotRegex(run.output, r"[\x00-\x09\x0b-\x1f\x7f]")

    def test_a_terminal_shows_the_iterations_of_the_first_increment(self):
        run = Run(BLOCK, n=4, steps=5)
        self.assertNotIn("first increment", run.output)
        status, text = on_terminal(run.folder, BLOCK, "--set", "n=4", "--set", "steps=5",
                                   "--overwrite")
        self.assertEqual(status, 0, text)
        shown = re.findall(r"\r\x1b\[Kfirst increment: (\D+) (\d+), residual (\S+)(?=\r\x1b\[K)",
                           text)
        self.assertEqual(len(shown), text.count("first increment"))
        self.assertEqual({what for what, *_ in shown}, {"sweep", "iteration"})
        sweeps = [(int(k), float(residual)) for what, k, residual in shown if what == "sweep"]
        self.assertEqual(sweeps[0][0], 0)
        self.assertEqual(sweeps, sorted(sweeps, key=lambda sweep: sweep[0]))
        self.assertLess(sweeps[-1][1], 1e-8)
        # Nothing of it stays, and later increments have the bar alone.
        self.assertNotIn("first increment", text[text.index(" of 5"):])
        wiped = re.sub(r"[^\n]*\r\x1b\[K", "", text)
        self.assertNotIn("residual", wiped)

    def test_a_terminal_shows_a_bar_and_the_same_words(self):
        run = Run(BLOCK, "--plan")
        words = (BLOCK, "--set", "n=1", "--set", "steps=10", "--overwrite")
        status, text = on_terminal(run.folder, *words)
        self.assertEqual(status, 0, text)
        bars = re.findall(r"\[(#*)(\.*)\] (\d+) of 10(, [^\[\r\n]+ left)?\r\x1b\[K", text)
        self.assertEqual([int(done) for *_, done, _ in bars], list(range(1, 10)))
        self.assertEqual([bool(left) for *_, left in bars], [False] + [True] * 8)
        for full, empty, done, _ in bars:
            self.assertEqual((len(full), len(full + empty)), (3 * int(done), 30))
        # Nothing but the bar, and no colour.
        self.assertEqual(set(re.findall(r"\x1b\[[^A-Za-z]*[A-Za-z]", text)), {"\x1b[K"})
        self.assertNotIn(" of 10", re.sub(r"\[#.*?\x1b\[K", "", text).split("10 of 10")[0])
        # A terminal that cannot wipe a line is written to as a pipe is.
        for environment in ({"TERM": "dumb"}, {"TERM": ""}):
            status, text = on_terminal(run.folder, *words, **environment)
            self.assertEqual(status, 0, text)
            self.assertNotRegex(text, r"[\r\x1b]")
            self.assertIn("9 of 10, ", text)

    def test_increments_between_the_decks_count_no_more(self):
        """Contact that begins inside the first of two increments ends one more there."""
        deck = BLOCK.read_text().replace(
            "*CONTACT SOLVER", "*CONTACT GAP\nBODY-ZMIN, 0.02\n*CONTACT SOLVER", 1
        )
        deck = re.sub(r", DIRECT", "", deck)
        run = Run(deck, name="late", n=1, steps=10)
        self.assertEqual(run.status, 0, run.errors)
        counts = re.findall(r"^ +[12] .* (\d+ of 10)\b", run.output, re.MULTILINE)
        with run.result() as result:
            self.assertGreater(result.finished, 10)
            whole = [not extra for extra in result.history("extra")]
        self.assertEqual(counts, [f"{sum(whole[:i + 1])} of 10" for i in range(len(whole))])


class ResultFiles(unittest.TestCase):
    def again(self, run, *options):
        command = [PROGRAM, str(run.deck), "--set", "n=1", "--quiet", *options]
        return subprocess.run(
            command, cwd=run.folder, capture_output=True, text=True, timeout=600, check=False
        )

    def call(self, folder, *words):
        """Run the program in a folder."""
        return subprocess.run(
            [PROGRAM, *map(str, words)], cwd=folder, capture_output=True, text=True, timeout=600,
            check=False,
        )

    def test_a_finished_result_with_the_same_parameters_is_replaced(self):
        run = Run(BLOCK, "--set", "steps=30", **SMALL)  # of one name the last counts
        before = run.file.read_bytes()
        again = self.call(run.folder, BLOCK, "--set", "Steps=10", "--set", "N=1", "--quiet")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertNotEqual(run.file.read_bytes(), before)
        with run.result() as result:
            self.assertEqual(result.finished, 10)

    def test_a_finished_result_with_other_parameters_is_kept(self):
        run = Run(BLOCK, **SMALL)
        before = run.file.read_bytes()
        for words, expected in (
            (("--set", "steps=20"), "was made with --set n=1 --set steps=10, not with --set n=1 "
                                    "--set steps=20: -o FILE writes another file"),
            ((), "not with --set n=1: -o"),
            (("--set", "steps=10", "--nlgeom", "no", "--accuracy", "0.3"),
             "--set steps=10 --nlgeom no --accuracy 0.3: -o"),
        ):
            with self.subTest(words=words):
                answer = self.again(run, *words)
                self.assertEqual(answer.returncode, 1)
                self.assertIn(expected, answer.stderr)
                self.assertEqual(run.file.read_bytes(), before)
        self.assertEqual(self.again(run, "--set", "steps=20", "-o", "other").returncode, 0)
        self.assertEqual(run.file.read_bytes(), before)
        self.assertEqual(self.again(run, "--set", "steps=20", "--overwrite").returncode, 0)
        with run.result() as result:
            self.assertEqual(result.finished, 20)
        # One made with --accuracy, and then without.
        self.assertEqual(
            self.again(run, "--set", "steps=20", "--nlgeom", "no", "--accuracy", "0.3", "-o",
                       "asked").returncode, 0
        )
        answer = self.again(run, "--set", "steps=20", "-o", "asked")
        self.assertEqual(answer.returncode, 1)
        self.assertIn("--set steps=20 --nlgeom no --accuracy 0.3, not with", answer.stderr)

    def test_a_name_without_an_ending_gets_one(self):
        run = Run(BLOCK, "--plan")
        for given, file in (
            ("foo", "foo.vtkhdf"), ("mu0.3", "mu0.3.vtkhdf"), ("foo.h5", "foo.h5"),
            ("./bar", "bar.vtkhdf"), ("foo.vtkhdf", "foo.vtkhdf"),
        ):
            with self.subTest(given=given):
                answer = self.again(run, "--set", "steps=10", "-o", given)
                self.assertEqual(answer.returncode, 0, answer.stderr)
                self.assertTrue(h5py.is_hdf5(run.folder / file))
        self.assertFalse((run.folder / "foo").exists())
        (run.folder / "folder").mkdir()
        for given in ("folder", "folder/"):
            answer = self.again(run, "--set", "steps=10", "-o", given)
            self.assertEqual(answer.returncode, 1)
            self.assertIn("is a folder", answer.stderr)

    def test_the_files_that_are_read_are_never_written(self):
        run = Run(BLOCK, "--plan")
        folder = run.folder
        part, deck = folder / "part.vtkhdf", folder / "whole.inp"
        part.write_bytes(BLOCK.read_bytes())
        deck.write_text("*INCLUDE, INPUT=part.vtkhdf\n")
        os.link(part, folder / "hard.vtkhdf")
        os.symlink("whole.inp", folder / "soft.vtkhdf")
        os.link(deck, folder / "sidecar.xdmf")
        os.link(deck, folder / "begun.vtkhdf.new")
        for name in ("whole.inp", "./whole.inp", folder / "whole.inp", "part.vtkhdf", "part",
                     "hard.vtkhdf", "soft", "sidecar", "begun"):
            for more in ((), ("--overwrite",), ("--continue",)):
                with self.subTest(name=name, more=more):
                    answer = self.call(folder, "whole.inp", "--set", "n=1", "-o", name, *more)
                    self.assertEqual(answer.returncode, 1)
                    self.assertIn("would be written", answer.stderr)
                    self.assertEqual(deck.read_text(), "*INCLUDE, INPUT=part.vtkhdf\n")
                    self.assertEqual(part.read_bytes(), BLOCK.read_bytes())
        self.assertEqual(len(list(folder.iterdir())), 6)

    def test_a_contact_problem_is_never_written(self):
        run = Run(BLOCK, "--export-fclib", "1", **SMALL)
        problem = run.folder / "block-1.fclib.hdf5"
        os.symlink(problem.name, run.folder / "link.hdf5")
        before = problem.read_bytes()
        for name in (problem.name, "block-1.fclib", "link.hdf5", "link"):
            with self.subTest(name=name):
                answer = self.call(run.folder, problem.name, "--overwrite", "-o", name)
                if name == "block-1.fclib":  # an ending of its own
                    self.assertEqual(answer.returncode, 0, answer.stderr)
                else:
                    self.assertEqual(answer.returncode, 1)
                    self.assertIn("would be written", answer.stderr)
                self.assertEqual(problem.read_bytes(), before)
        self.assertEqual(self.call(run.folder, problem.name, "-o", "solved").returncode, 0)
        self.assertTrue(h5py.is_hdf5(run.folder / "solved.hdf5"))

    def test_stresses_alone_keep_the_fields_at_the_nodes(self):
        usual = Run(BLOCK, **SMALL)
        text = BLOCK.read_text()
        self.assertEqual(text.count("*END STEP"), 2)
        for cards, left_out in (
            ("*EL FILE\nS\n", set()),
            ("*NODE FILE\nU\n*EL FILE\nS\n", set()),
            ("*NODE FILE\nRF\n*EL FILE\nS\n", {"displacement"}),
        ):
            run = Run(text.replace("*END STEP", cards + "*END STEP", 1), name="block", **SMALL)
            self.assertEqual(run.status, 0, run.errors)
            with usual.result() as before, run.result() as now:
                (points, cells), (was, _) = now.field_names, before.field_names
                self.assertEqual(cells, {"stress", "von_mises", "element_id"})
                self.assertEqual(points, was - left_out)

    def test_anything_else_is_kept(self):
        run = Run(BLOCK, **SMALL)
        with h5py.File(run.file, "r+") as file:
            file["run"].attrs.modify("status", b"running")
        answer = self.again(run)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("--overwrite", answer.stderr)
        run.file.write_bytes(b"not a result")
        self.assertEqual(self.again(run).returncode, 1)
        self.assertEqual(run.file.read_bytes(), b"not a result")
        self.assertEqual(self.again(run, "--overwrite").returncode, 0)

    def test_a_run_that_solves_nothing_leaves_the_old_result(self):
        run = Run(BLOCK, **SMALL)
        before = run.file.read_bytes()
        deck = run.folder / "block.inp"
        # Lifted off, and free to go where a force drives it.
        text = BLOCK.read_text().replace("BODY-ZMAX, 1, 2, 0.", "BODY-ZMAX, 1, 1, 0.")
        text = text.replace("BODY-ZMAX, 3, 3, -0.1", "BODY-ZMAX, 3, 3, 0.1\n*CLOAD\n1, 2, 1.")
        deck.write_text(text)
        answer = subprocess.run(
            [PROGRAM, str(deck), "--set", "n=1", "--set", "steps=10"], cwd=run.folder,
            capture_output=True, text=True, timeout=600, check=False,
        )
        self.assertNotEqual(answer.returncode, 0)
        self.assertIn("nothing balances", answer.stderr)
        self.assertEqual(run.file.read_bytes(), before)


# A step in which nothing balances the loads any more.
PULLED_OFF = """*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY, OP=NEW
BODY-ZMAX, 3, 3, -0.1
*CLOAD
BODY-ZMAX, 1, 1e6
*END STEP
"""


class NotSolved(unittest.TestCase):
    def test_too_few_sweeps_end_with_2_and_name_the_step(self):
        deck = BLOCK.read_text().replace("STOP=<stop>", "STOP=<stop>, MAX SWEEPS=70")
        run = Run(deck, name="few", n=4)
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, r"step 1, increment 1: .*70")

    def test_the_increments_before_are_in_the_file(self):
        deck = BLOCK.read_text().replace("STOP=<stop>", "STOP=<stop>, MAX SWEEPS=121")
        run = Run(deck, name="few", n=4, tolerance=1e-10)
        self.assertEqual(run.status, 2)
        run = Run(BLOCK.read_text() + PULLED_OFF, name="off", n=4)
        self.assertEqual(run.status, 2)
        self.assertIn("step 3, increment 1", run.errors)
        with run.result() as result:
            self.assertEqual(result.finished, 50)
            self.assertEqual(result.run["status"], "not solved")

    def test_uzawa_outside_its_range_is_stopped_and_told(self):
        for settings in (
            {"rho": 100},
            {"rho": 2.5},
            {"rho": 2, "mu": 0, "stop": "CHANGE", "tolerance": 1e-6},
        ):
            with self.subTest(**settings):
                run = Run(BLOCK, n=4, local="UZAWA", **settings)
                self.assertEqual(run.status, 2)
                self.assertIn("rho", run.errors)
                self.assertIn("Uzawa", run.errors)

    def test_newton_works_at_any_rho(self):
        for rho in (1e-6, 1e-3, 10, 1e3, 1e6):
            with self.subTest(rho=rho):
                run = Run(BLOCK, n=2, rho=rho, steps=20, tolerance=1e-8)
                self.assertEqual(run.status, 0, run.errors)

    def test_a_node_driven_into_the_plane_is_named(self):
        deck = BLOCK.read_text().replace(
            "BODY-ZMAX, 3, 3, -0.1\n", "BODY-ZMAX, 3, 3, -0.1\n1, 3, 3, -0.01\n"
        )
        run = Run(deck, name="driven", n=2)
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, r"node 1 is prescribed to move .* into GROUND")


if __name__ == "__main__":
    unittest.main()
