"""What is told of errors is about true, and an accuracy that is asked for is reached or refused."""

import re
import unittest

import numpy as np
from program import ASKED, INPUT, Run
from references import reference

AUTO = {"solver": "AUTO", "local": "AUTO"}


def deck(name, direct=False):
    """A deck of input/, its increments free to be cut unless `direct`."""
    text = (INPUT / f"{name}.inp").read_text()
    return text if direct else text.replace("*STATIC, DIRECT", "*STATIC")


def with_card(text, card):
    """The deck with a card before its first step."""
    return text.replace("*STEP\n", f"{card}\n*STEP, NLGEOM=NO\n", 1)


def written_down(text, n):
    """The deck with the nodes and elements of its unit cube in place of its *BLOCK."""
    ids = 1 + np.arange((n + 1) ** 3).reshape((n + 1,) * 3)  # x, y, z
    low, high = slice(0, n), slice(1, n + 1)
    corners = [(low, low), (high, low), (high, high), (low, high)]
    of_elements = np.stack([ids[x, y, z] for z in (low, high) for x, y in corners], axis=-1)
    lines = ["*NODE"]
    lines += [f"{ids[at]}, " + ", ".join(str(k / n) for k in at) for at in np.ndindex(ids.shape)]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=BODY")
    lines += [", ".join(map(str, [1 + i, *nodes]))
              for i, nodes in enumerate(of_elements.reshape(-1, 8))]
    elements = 1 + np.arange(n**3).reshape((n,) * 3)
    sides = {"XMIN": 6, "XMAX": 4, "YMIN": 3, "YMAX": 5, "ZMIN": 1, "ZMAX": 2}
    for name, side in sides.items():
        axis, end = "XYZ".index(name[0]), -1 if name.endswith("MAX") else 0
        lines.append(f"*SURFACE, NAME=BODY-{name}")
        lines += [f"{element}, S{side}" for element in np.take(elements, end, axis).ravel()]
        lines.append(f"*NSET, NSET=BODY-{name}")
        lines += map(str, np.take(ids, end, axis).ravel())
    block = re.search(r"\*BLOCK,.*\n.*\n", text)
    return text[: block.start()] + "\n".join(lines) + "\n" + text[block.end() :]


def at_ends(run, name):
    """A history where the steps end."""
    step = run.history("step")
    return run.history(name)[np.append(step[1:] != step[:-1], True)]


def resultants(run):
    """Contact resultants where the steps end."""
    step = run.history("step")
    ends = np.append(step[1:] != step[:-1], True)
    return np.hstack([pair.resultant[ends] for pair in run.pairs.values()])


class Told(unittest.TestCase):
    """Errors by source, in runs of which nothing is asked."""

    def test_load_steps(self):
        """The part of load steps is the difference from fine ones, 1/3 to 3, while it is seen."""
        with Run(deck("block", direct=True), name="block", n=4, steps=200, **AUTO).result() as run:
            time = run.history("time")
            fine = run.pairs[0].resultant[:]
        for steps in (10, 20, 40):
            run = Run(deck("block", direct=True), name="block", n=4, steps=steps, **AUTO)
            with run.result() as run:
                told = run.history("error/load_steps")
                mine = run.pairs[0].resultant[:]
                seen = 0
                for row in np.flatnonzero((run.history("step") == 2) & (told > 1e-4)):
                    same = np.argmin(abs(time - run.history("time")[row]))
                    true = np.linalg.norm(mine[row] - fine[same]) / np.linalg.norm(fine[same])
                    if true > 1e-4:
                        seen += 1
                        self.assertLess(told[row] / true, 3.0, (steps, row))
                        self.assertGreater(told[row] / true, 1 / 3, (steps, row))
                self.assertGreaterEqual(seen, 1, steps)

    def test_left_out(self):
        """Nothing is estimated, and nothing else changes by it, to the last bit."""
        given = Run(deck("block", direct=True), name="block", n=3, steps=20)
        without = Run(with_card(deck("block", direct=True), "*ACCURACY, ESTIMATE=NO"),
                      name="block", n=3, steps=20)  # fmt: skip
        self.assertIn("estimated error", given.output)
        self.assertNotIn("estimated error", without.output)
        with given.result() as one, without.result() as other:
            for name in ("error/mesh", "error/load_steps"):
                self.assertGreaterEqual(one.history(name)[-1], 0)
                np.testing.assert_array_equal(other.history(name), -1)
            np.testing.assert_array_equal(other.field("displacement"), one.field("displacement"))
            np.testing.assert_array_equal(other.pairs[0].reaction, one.pairs[0].reaction)
        asked = Run(with_card(deck("block"), "*ACCURACY, ESTIMATE=NO"), *ASKED, "0.1",
                    name="block")  # fmt: skip
        self.assertEqual(asked.status, 1)
        self.assertEqual(asked.errors, "bipot: error: --accuracy takes the estimates that the deck "
                         "leaves out by *ACCURACY, ESTIMATE=NO\n")  # fmt: skip

    def test_left_out_but_where_it_is_drawn(self):
        """The field of the mesh's error is asked for by name, and is there."""
        text = with_card(deck("block", direct=True), "*ACCURACY, ESTIMATE=NO")
        text = text.replace("*END STEP", "*EL FILE\nERR\n*END STEP", 1)
        with Run(text, name="block", n=2, steps=5).result() as run:
            self.assertTrue(np.all(run.history("error/mesh") > 0))
            np.testing.assert_array_equal(run.history("error/load_steps"), -1)
            self.assertTrue(np.any(run.field("mesh_error") > 0))

    def test_where_they_are(self):
        """Each part where it is known, -1 elsewhere; the total is their sum."""
        with Run(deck("block", direct=True), name="block", n=4, **AUTO).result() as run:
            parts = {
                name: run.history(f"error/{name}")
                for name in ("contact", "load_steps", "mesh", "arithmetic", "total")
            }
            last = np.isin(np.arange(50), (9, 49))
            number = run.history("increment")
        self.assertTrue(np.array_equal(parts["mesh"] >= 0, last))
        self.assertTrue(np.array_equal(parts["load_steps"] >= 0, number % 2 == 0))
        self.assertTrue(np.all(parts["contact"] >= 0) and np.all(parts["arithmetic"] > 0))
        total = sum(parts[name] for name in ("contact", "load_steps", "mesh", "arithmetic"))
        np.testing.assert_allclose(parts["total"][last], total[last], rtol=1e-14)
        self.assertTrue(np.all(parts["total"][~last] == -1))

    def test_no_path(self):
        """Without friction before flat obstacles any increments end in the same place."""
        forces = []
        for steps in (5, 20):
            run = Run(deck("block", direct=True), name="block", n=4, steps=steps, mu=0, **AUTO)
            with run.result() as run:
                np.testing.assert_array_equal(run.history("error/load_steps"), 0)
                self.assertGreater(run.history("error/total")[-1], 0)
                forces.append(run.pairs[0].reaction[-1])
        np.testing.assert_allclose(*forces, rtol=0, atol=1e-9 * abs(forces[0]).max())

    def test_one_increment(self):
        """A step of one increment without an event is held against two halves of it."""
        with Run(deck("mindlin", direct=True), name="mindlin", steps=1).result() as run:
            told = run.history("error/load_steps")[0]
            one = run.pairs[0].reaction[0]
        with Run(deck("mindlin", direct=True), name="mindlin", steps=2).result() as run:
            two = run.pairs[0].reaction[1]
        change = np.linalg.norm((one - two).sum(axis=0)) / np.linalg.norm(two.sum(axis=0))
        self.assertAlmostEqual(told / (2 * change), 1.0, delta=0.02)


class Asked(unittest.TestCase):
    """--accuracy and *ACCURACY on a mesh that is kept."""

    def judge(self, name, accuracy, fine, **settings):
        """The run ends well and is as accurate as asked, by its estimate and in truth."""
        run = Run(
            deck(name), *ASKED, str(accuracy), "--refine", "0", name=name, **settings
        )
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertTrue(np.all(at_ends(result, "error/total") <= accuracy))
            self.assertTrue(np.all(at_ends(result, "error/total") >= 0))
            true = abs(resultants(result) - fine).max() / abs(fine).max()
            self.assertLess(true, accuracy)
            return len(result.history("step"))

    def test_block(self):
        """What is spent grows with what is asked; finer increments come of themselves."""
        def solve():
            fine = Run(deck("block", direct=True), name="block", n=16, steps=100, **AUTO)
            with fine.result() as result:
                return {"resultants": resultants(result)}

        fine = reference("block-16", solve)["resultants"]
        counts = [
            self.judge("block", accuracy, fine, n=8, steps=5, **AUTO)
            for accuracy in (0.1, 0.02)
        ]
        self.assertLessEqual(counts[0], counts[1])
        self.assertLess(counts[1], 30)

    def test_increments_are_cut(self):
        """Increments follow the direction of the motion as finely as the accuracy asks."""
        text = with_card(deck("block"), "*ACCURACY, MESH=KEEP\n3e-4")
        run = Run(text, name="block", n=4, steps=5, **AUTO)
        self.assertEqual(run.status, 2)
        with run.result() as result:
            time = np.append(0.0, result.history("time"))
            self.assertGreater(len(time), 10)
            length = np.diff(time)
            # Halves, quarters, ... of the deck's 1 and 0.25.
            share = np.where(time[1:] <= 1.0 + 1e-12, length, length / 0.25)
            np.testing.assert_allclose(np.log2(share), np.round(np.log2(share)), atol=1e-9)
            np.testing.assert_array_equal(at_ends(result, "time"), [1.0, 2.0])
            self.assertTrue(np.all(at_ends(result, "error/load_steps") < 3e-4))

    def test_the_mesh_is_too_coarse(self):
        """Said with the estimate and the elements that would do; the result is complete."""
        text = with_card(deck("block"), "*ACCURACY, MESH=KEEP\n0.001")
        run = Run(text, name="block", n=4, steps=5, **AUTO)
        self.assertEqual(run.status, 2)
        self.assertRegex(
            run.output,
            r"step 1: the contact forces are wrong by about 1\.2 %, "
            r"not 0\.1 %; the mesh alone makes 1\.2 %: it takes elements of about 0\.0",
        )
        self.assertIn("was not reached at the end of 2 of 2 steps", run.errors)
        with run.result() as result:
            self.assertEqual(result.history("time")[-1], 2.0)
            self.assertTrue(np.all(result.history("certified") == 1))

    def test_supports_that_carry_what_contact_would(self):
        """Where they hold the normals of points at the plate's end: 9 % of the force."""
        forces = []
        for n, status in ((8, 2), (64, 0)):
            run = Run(
                deck("ssnv128"), "--accuracy", "0.03", "--refine", "0", "--nlgeom", "no",
                name="plate", n=n, thickness=0.04 / 8, solver="AUTO", local="AUTO",
            )  # fmt: skip
            self.assertEqual(run.status, status, run.errors)
            with run.result() as result:
                forces.append((at_ends(result, "error/mesh")[-1], resultants(result)[-1]))
        (told, coarse), (_, fine) = forces
        missing = np.abs(coarse - fine).max() / np.abs(fine).max()
        self.assertGreater(missing, 0.08)
        self.assertGreater(told, missing)
        self.assertLess(told, 2 * missing)

    def test_direct_keeps_increments(self):
        """With DIRECT the program only tells."""
        run = Run(
            deck("tool", direct=True), *ASKED, "0.2", "--refine", "0", name="tool", n=12,
            steps=2,
        )  # fmt: skip
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertEqual(len(result.history("step")), 4)

    def test_energy(self):
        """*ACCURACY, OF=ENERGY: the plate's strain energy within what is asked."""
        with Run(INPUT / "ssnv128.inp", n=64, thickness=0.005).result() as result:
            true = result.history("energy/strain")[-1]
        for accuracy in (0.01, 0.001):
            text = with_card(deck("ssnv128"), f"*ACCURACY, OF=ENERGY, MESH=KEEP\n{accuracy}")
            run = Run(text, name="ssnv128", n=32, steps=1, thickness=0.005)
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                found = result.history("energy/strain")[-1]
                self.assertLess(abs(found / true - 1), accuracy)

    def test_a_body_that_contact_alone_holds(self):
        """The runs beside the run, by which load steps are judged, end where a body is free too."""
        text = with_card(deck("roller"), "*ACCURACY, OF=ENERGY, MESH=KEEP\n0.1")
        run = Run(text, name="roller", n=32, steps=1, tolerance=1e-9)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertGreaterEqual(result.history("error/load_steps")[-1], 0.0)

    def test_the_command_line_wins(self):
        """--accuracy stands in the file beside the overrides, and over the deck's."""
        run = Run(
            with_card(deck("ssnv128"), "*ACCURACY\n0.5"),
            *ASKED,
            "0.2",
            "--refine",
            "0",
            name="ssnv128",
            n=8,
            steps=1,
        )
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("20 % of the contact forces", run.output)
        with run.result() as result:
            self.assertIn("--accuracy 0.2", result.file["run/overrides"].asstr()[()])

    def test_the_mesh_of_a_deck_may_be_enough(self):
        """A mesh that is written down is the result where its own estimate, three times, is small.

        Elements of a third of the size say what is true.
        """
        text = written_down(deck("block"), 4)
        chosen = {**AUTO, "steps": 5}
        fine = Run(text, "--refine", "2", "--nlgeom", "no", name="own", **chosen)
        for asked, is_alone in ((0.1, True), (0.03, False)):
            run = Run(text, *ASKED, str(asked), name="own", **chosen)
            self.assertEqual(run.status, 0, run.errors)
            with fine.result() as true, run.result() as result:
                self.assertEqual(len(result.accuracy) == 1, is_alone)
                true, found = true.pairs[0], result.pairs[0]
                off = np.linalg.norm(found.friction_force[-1] - true.friction_force[-1])
                self.assertLess(off, asked * 0.3 * true.normal_force[:, 2].max())


class Cut(unittest.TestCase):
    """Increments that are not solved are cut where the deck lets them be."""

    def test_a_sliding_body(self):
        """Beyond its limit nothing balances a body: nor parts of its load, which are not tried."""
        run = Run(deck("slope"), name="slope", n=2, margin=0.1)
        self.assertEqual(run.status, 2)
        self.assertIn("nothing balances the loads along", run.errors)
        self.assertNotIn("retrying with half the increment", run.output)
        direct = Run(deck("slope", direct=True), name="slope", n=2, margin=0.1)
        self.assertEqual(direct.status, 2)
        self.assertNotIn("retrying with half the increment", direct.output)


if __name__ == "__main__":
    unittest.main()
