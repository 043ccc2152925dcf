"""An accuracy that is asked for chooses the mesh, keeps its promise, or says why it cannot."""

import os
import tempfile
import unittest
from pathlib import Path

import numpy as np
from program import ASKED, INPUT, PROGRAM, SOURCE, Run, in_long_form
from references import reference

AUTO = {"solver": "AUTO", "local": "AUTO"}
FINE = {**AUTO, "tolerance": 1e-9}


def deck(name, *replacements):
    """A deck of input/, its increments free to be cut, with other words in it."""
    text = (INPUT / f"{name}.inp").read_text().replace("*STATIC, DIRECT", "*STATIC")
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    return text


def with_card(text, card):
    """The deck with a card before its first step."""
    return text.replace("*STEP\n", f"{card}\n*STEP, NLGEOM=NO\n", 1)


def of_deck(result):
    """Which rows are ends of the deck's increments."""
    return result.history("extra") == 0


def friction_and_normal(result):
    """What a plane below carries, in x, y and in z, at the ends of the deck's increments."""
    resultant = result.pairs[0].resultant[of_deck(result)]
    return resultant[:, :2], resultant[:, 2]


def forces_of(text, name, every=1, **settings):
    """Friction and normal force of a run, at the end of each so many increments."""
    with Run(text, name=name, **settings).result() as fine:
        friction, normal = (force[every - 1::every] for force in friction_and_normal(fine))
    return {"friction": friction, "normal": normal}


def fine_block():
    """Friction and normal force of the block on a fine mesh, at the ends of five increments."""
    fine = reference(
        "block-24", lambda: forces_of(deck("block"), "block", every=4, n=24, steps=20, **FINE)
    )
    return fine["friction"], fine["normal"]


BEAM = """*HEADING
A cantilever, 20 times as long as high, of an element across: meshes that bend are ill-conditioned
*BLOCK, NAME=A, NX=4, NY=1, NZ=1, TYPE=C3D8
0., 0., 0.,  20., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=A, MATERIAL=M
*ACCURACY, OF=DISPLACEMENT
0.1
*STEP, NLGEOM=NO
*STATIC
1., 1.
*BOUNDARY
A-XMIN, 1, 3
*DSLOAD
A-ZMAX, P, 0.0005
*END STEP
"""


class Reached(unittest.TestCase):
    @in_long_form
    def test_precision_that_did_not_hold_is_not_tried_again(self):
        """Two meshes and more are large enough for a factor in single precision to save time."""
        run = Run(BEAM, name="beam")
        self.assertEqual(run.status, 0, run.errors)
        self.assertEqual(run.output.count("does not hold this scene"), 1, run.output)

    def test_a_promise_is_kept(self):
        """The block: normal force of itself, friction of mu times that, in each increment."""
        friction, normal = fine_block()
        for accuracy in (0.1, 0.02):
            run = Run(deck("block"), *ASKED, str(accuracy), name="block", steps=5, **AUTO)
            self.assertEqual(run.status, 0, run.errors)
            self.assertRegex(run.output, r"\nestimated error of the contact forces: mesh .*; "
                             rf"{100 * accuracy:.0f} % is reached.*; \d+ runs, ")  # fmt: skip
            with run.result() as result:
                mine, pressing = friction_and_normal(result)
                scale = abs(normal).max()
                self.assertLess(abs(pressing - normal).max() / scale, accuracy)
                error = np.linalg.norm(mine - friction, axis=1).max() / (0.3 * scale)
                self.assertLess(error, accuracy)
                group = result.file["accuracy"]
                self.assertEqual(group.attrs["reached"], 1)
                self.assertLessEqual(group.attrs["mesh_and_load_steps"], accuracy)
                # It would be no estimate if it were not about as large as the error.
                self.assertGreater(group.attrs["mesh"], 0.5 * error)
                self.assertLess(group.attrs["mesh"], 8 * error)

    def test_what_the_file_tells(self):
        """The sequence, its values and what they tend to; the result is that of the last mesh."""
        run = Run(deck("block"), *ASKED, "0.1", name="block", steps=5, **AUTO)
        with run.result() as result:
            group = result.file["accuracy"]
            size, divisions = group["element_size"][:], group["divisions"][:]
            self.assertTrue(np.all(np.diff(size) <= 0))
            np.testing.assert_array_equal(divisions[:5], [1, 1, 1, 2, 4])
            np.testing.assert_allclose(group["elements"][:], 64 / size**3, rtol=1e-12)
            self.assertEqual(len(result.file["VTKHDF/CellData/element_id"]), group["elements"][-1])
            self.assertTrue(np.all(group["processor_time"][:] > 0))
            names = list(group["values"].attrs["name"].astype(str))
            self.assertEqual(names[0], "BODY-ZMIN:GROUND/pressing_force")
            self.assertEqual(names[4:7], [f"BODY-ZMIN:GROUND/friction_force_{x}" for x in "xyz"])
            self.assertEqual(names[7:], ["BODY-ZMIN:GROUND/used_gap"])
            values = group["values"][:]
            resultant = result.pairs[0].resultant[of_deck(result)]
            self.assertEqual(values.shape, (len(size), len(resultant), 8))
            np.testing.assert_allclose(values[-1, :, 0], resultant[:, 2], rtol=1e-12)
            np.testing.assert_allclose(values[-1, :, 4:6], resultant[:, :2], rtol=1e-9)
            sequence = result.accuracy
            self.assertEqual((sequence.names, sequence.reached, len(sequence)),
                             (names, True, len(size)))  # fmt: skip
            np.testing.assert_array_equal(sequence.values, values)
            self.assertIn("0.1 reached", repr(sequence))
            limit = group["extrapolated"][:, 0]
            scale, mu = group["scale"][[0, 4]], 0.3
            self.assertAlmostEqual(scale[0], values[-1, :, 0].max(), delta=1e-9 * scale[0])
            self.assertAlmostEqual(scale[1], mu * scale[0], delta=1e-9 * scale[0])
        true = fine_block()[1]
        self.assertLess(abs(limit - true).max(), 0.5 * abs(values[-1, :, 0] - true).max())

    def test_extrapolated_values(self):
        """They are nearer than the last mesh's own, on fewer elements than these would take."""
        order = 1.5  # about that of both
        weight = 1 / (1.5**order - 1)
        meshes = []
        for n in (12, 18):
            fine = reference(f"block-{n}", lambda n=n: forces_of(
                deck("block"), "block", every=8, n=n, steps=40, **FINE))  # fmt: skip
            meshes.append([fine["friction"], fine["normal"]])
        friction, normal = (b + weight * (b - a) for a, b in zip(*meshes, strict=True))
        scale, asked = abs(normal).max(), 0.012
        found = {}
        for options in ([], ["--extrapolated"]):
            run = Run(deck("block"), *ASKED, str(asked), *options, name="block", steps=5,
                      **AUTO)  # fmt: skip
            self.assertEqual(run.status, 0, run.errors)
            with run.result() as result:
                sequence, finest = result.accuracy, friction_and_normal(result)
            self.assertEqual(sequence.of_extrapolated, bool(options))
            found[bool(options)] = sequence.elements[-1]
        reached = "error of the extrapolated contact forces: .*; 1.2 % is reached"
        self.assertRegex(run.output, reached)
        self.assertLess(found[True], 0.5 * found[False])
        pressing = abs(sequence.extrapolated[:, 0] - normal).max() / scale
        self.assertLess(pressing, asked)
        error = np.linalg.norm(sequence.extrapolated[:, 4:6] - friction, axis=1).max()
        self.assertLess(error / (0.3 * scale), asked)
        # The mesh's own values, on which the certificate is, are farther off.
        self.assertGreater(np.linalg.norm(finest[0] - friction, axis=1).max(), 2 * error)
        self.assertGreater(sequence.error.max(), asked)
        self.assertLess(sequence.extrapolated_error.max(), asked)

    def test_any_mesh(self):
        """Elements of a deck that names nodes by their numbers are cut; sets stay what they are."""
        text = with_card(deck("block"), "*NSET, NSET=ONE\n1")
        run = Run(text, *ASKED, "0.2", name="cut", n=2, steps=5, **AUTO)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            group = result.file["accuracy"]
            np.testing.assert_allclose(group["elements"][:] * group["element_size"][:] ** 3,
                                       8.0, rtol=1e-12)  # fmt: skip
            self.assertEqual(group["element_size"][0], 1)

    def test_a_slice_stays_one_element_thick(self):
        """Plane strain: whether blocks have others or elements are cut, evenly or at contact,
        there are nodes on both sides alone, and the run is that of a deck with such elements."""
        run = Run(deck("roller"), *ASKED, "0.01", name="roller")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertEqual(result.file["run"].attrs["across"], 2)
            elements = result.accuracy.elements
            along = np.sqrt(elements)
            np.testing.assert_allclose(along * result.accuracy.element_size, along[0] *
                                       result.accuracy.element_size[0], rtol=1e-12)  # fmt: skip
            chosen = result.pairs[0].resultant
        with Run(deck("roller"), name="roller", n=round(along[-1])).result() as result:
            np.testing.assert_allclose(chosen, result.pairs[0].resultant, rtol=1e-3,
                                       atol=1e-3 * abs(chosen).max())  # fmt: skip

        same = {"thickness": 0.04 / 8, **AUTO}
        run = Run(deck("ssnv128"), *ASKED, "0.03", name="plate", n=8, **same)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertGreater(result.file["run"].attrs["cuts"], 0)
            thick = result.file["VTKHDF/Points"][:, 1]
            self.assertEqual(set(thick), {0, 0.04 / 8})
            friction, normal = friction_and_normal(result)
        fine = reference(
            "ssnv128-64", lambda: forces_of(deck("ssnv128"), "plate", n=64, **same)
        )
        true_friction, true_normal = fine["friction"], fine["normal"]
        scale = abs(true_normal).max()
        self.assertLess(abs(normal - true_normal).max(), 0.03 * scale)
        self.assertLess(abs(friction - true_friction).max(), 0.03 * scale)

    def test_local_quantities(self):
        """The largest pressure under a ball: Hertz."""
        text = with_card(deck("hertz"), "*ACCURACY, OF=PRESSURE\n0.1")
        run = Run(text, name="hertz")
        self.assertEqual(run.status, 0, run.errors)
        # 2 E' a/(pi R), with the edge of the block at eight radii of the contact: some parts in a
        # hundred are the block's.
        true = 2 * 20000 / (1 - 0.3**2) * 10 / (np.pi * 50)
        with run.result() as result:
            found = result.file["accuracy/values"][-1, -1, 0]
            pressure = result.pairs[0].reaction[-1][:, 0] / result.pairs[0].area
        self.assertAlmostEqual(found, np.nanmax(pressure), delta=1e-9 * found)
        self.assertLess(abs(found / true - 1), 0.1)


class NotReached(unittest.TestCase):
    @in_long_form
    def test_what_has_no_limit(self):
        """The pressure at the sharp edge of the block grows for ever: said so, with status 2."""
        text = with_card(deck("quarter"), "*ACCURACY, OF=PRESSURE\n0.01")
        run = Run(text, name="quarter", steps=1)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("does not converge", run.errors)
        with run.result() as result:
            self.assertEqual(result.file["accuracy"].attrs["reached"], 0)
            self.assertTrue(np.all(result.history("certified") == 1))

    def test_coarse_meshes_that_agree_by_accident(self):
        """Four of them on a pressure that grows without end at an edge: no promise is made."""
        text = (SOURCE / "studies/data/scenes/heat.inp").read_text()
        text = with_card(text.replace("*STATIC, DIRECT", "*STATIC"), "*ACCURACY, OF=PRESSURE\n0.1")
        run = Run(text, name="heat")
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("largest_pressure does not converge: 6 meshes", run.errors)
        with run.result() as result:
            names, values = result.accuracy.names, result.accuracy.values
            ends = ("BODY-XMIN:LEFT", "BODY-XMAX:RIGHT")
            kinds = ("largest_pressure", "pressure_beside")
            gaps = [f"{end}/used_gap" for end in ends]
            self.assertEqual(names, [f"{end}/{kind}" for end in ends for kind in kinds] + gaps)
            pair = result.pairs["BODY-XMIN:LEFT"]
            row = of_deck(result).nonzero()[0][-1]
            pressure = pair.pressure[row]
            at = pressure.argmax()
            self.assertAlmostEqual(values[-1, -1, 0], pressure[at], delta=1e-9 * pressure[at])
            far = np.linalg.norm(pair.coordinates - pair.coordinates[at], axis=1)
            near = far < 1.01 * far[far > 0].min()
            self.assertAlmostEqual(values[-1, -1, 1], pressure[near].min(),
                                   delta=1e-9 * pressure[at])  # fmt: skip

    @in_long_form
    def test_load_steps_that_are_never_small_enough(self):
        """Half of a circle an increment turns little friction round: refused where increments are
        tried again, on elements of half the size; complete."""
        text = (SOURCE / "studies/data/scenes/circle.inp").read_text()
        text = text.replace("*STATIC, DIRECT", "*STATIC")
        text = text.replace("NX=<n>, NY=<n>, NZ=<n>", "NX=4, NY=1, NZ=1")
        text = text.replace("1.2, 1., 0.5", "4., 1., 1.")
        run = Run(text, *ASKED, "0.0003", name="circle", steps=1, mu=0.05)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("the load steps make", run.errors)
        with run.result() as result:
            self.assertFalse(result.accuracy.reached)
            divisions, size = result.accuracy.divisions, result.accuracy.element_size
            self.assertEqual(divisions.max(), 128)
            np.testing.assert_allclose(size[divisions > 4], size[divisions == 4].max() / 2)
            self.assertEqual(result.run["status"], "finished")
            self.assertTrue(np.all(result.history("certified") == 1))

    def test_what_makes_most_is_mended_first(self):
        """Of a block the mesh makes more than increments in 8 parts: refused for the mesh, without
        more of them, where 6 GB are all there is."""
        limited = ("sh", "-c", 'ulimit -v 6000000; exec "$0" "$@"', PROGRAM)
        run = Run(deck("block"), *ASKED, "0.00005", name="block", command=limited, steps=5,
                  **AUTO)  # fmt: skip
        self.assertEqual(run.status, 3, run.output)
        self.assertIn("it takes elements", run.errors)
        with run.result() as result:
            self.assertEqual(result.accuracy.divisions.max(), 8)
            self.assertGreater(result.accuracy.error.max(), 0.001)
            self.assertEqual(result.run["status"], "finished")

    def test_increments_that_direct_keeps(self):
        """What they make of the friction counts as a part of mu times the normal force.

        With mu = 0.1 five increments are 3 % off in that, and 0.3 % of the largest resultant.
        """
        text = (INPUT / "block.inp").read_text()
        with Run(text, name="block", n=6, steps=5, **FINE, mu=0.1).result() as coarse:
            mine, pressing = friction_and_normal(coarse)
        fine = reference("block-6-160", lambda: forces_of(
            text, "block", every=32, n=6, steps=160, **FINE, mu=0.1))  # fmt: skip
        friction = fine["friction"]
        true = np.linalg.norm(mine - friction, axis=1).max() / (0.1 * pressing.max())
        for asked, status in ((0.5 * true, 2), (8 * true, 0)):
            run = Run(text, *ASKED, str(asked), name="block", steps=5, mu=0.1, **AUTO)
            self.assertEqual(run.status, status, run.errors)
            with run.result() as result:
                sequence = result.accuracy
                self.assertEqual(sequence.reached, status == 0)
                self.assertGreater(sequence.load_steps, true)
                self.assertEqual(sequence.divisions[-1], 1)
                self.assertEqual(result.finished, 5)
            self.assertEqual("DIRECT keeps them as they are" in run.errors, status == 2)

    @in_long_form
    def test_increments_that_the_first_mesh_wants_divided(self):
        """Tried again on a finer one; those beyond are run undivided but for the last. Kept.

        Where the last says that divisions change more there than on coarser meshes, finer ones
        follow, undivided first.
        """
        text = (SOURCE / "studies/data/scenes/spreading.inp").read_text()
        text = text.replace("*STATIC, DIRECT", "*STATIC")
        fine = reference("spreading-12", lambda: forces_of(
            text, "spreading", every=4, n=12, steps=16, tolerance=1e-6))  # fmt: skip
        friction, normal = fine["friction"], fine["normal"]
        run = Run(text, *ASKED, "0.05", name="spreading", steps=4)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            divisions, elements = result.accuracy.divisions, result.accuracy.elements
            tried = np.unique(elements[divisions > 2])[1]
            self.assertGreater(np.count_nonzero(elements == tried), 2)
            divided = (divisions > 1) & (elements > tried)
            self.assertLessEqual(np.count_nonzero(divided[:-1]), 3, divisions)
            for i in np.flatnonzero(divided):
                self.assertIn(elements[i], elements[:i][divisions[:i] == 1])
            mine, pressing = friction_and_normal(result)
            scale = abs(normal).max()
            self.assertLess(abs(pressing - normal).max() / scale, 0.05)
            error = np.linalg.norm(mine - friction, axis=1).max() / (0.4 * scale)
            self.assertLess(error, 0.05)

    def test_what_stands_in_the_place_of_the_result(self):
        """It is refused before the first run, which is not written."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "mine.vtkhdf"
            path.write_text("not a result")
            for where, words in ((path, "is not a result of bipot"), (folder, "is a folder")):
                run = Run(deck("block"), *ASKED, "0.1", "-o", str(where), name="block")
                self.assertEqual(run.status, 1, run.output)
                self.assertIn(words, run.errors)
                self.assertNotIn("run by run", run.output)
            self.assertEqual(path.read_text(), "not a result")
            self.assertEqual(os.listdir(folder), ["mine.vtkhdf"])

    @in_long_form
    def test_slip_that_coarse_meshes_do_not_show(self):
        """Two blocks stick on coarse meshes; on fine ones an edge slips. That is not promised."""
        text = (SOURCE / "studies/data/scenes/two.inp").read_text()
        for n, least, most in ((8, 0, 1e-6), (12, 1e-4, 1e-3)):
            with Run(text, name="two", n=n).result() as result:
                slip = np.linalg.norm(result.pairs[0].slip, axis=2).max()
            self.assertTrue(least <= slip <= most, (n, slip))
        text = with_card(text.replace("*STATIC, DIRECT", "*STATIC"), "*ACCURACY, OF=SLIP\n0.1")
        run = Run(text, name="two")
        self.assertEqual(run.status, 2)
        self.assertIn("used_friction", run.errors)

    def test_contact_that_begins_within_an_increment(self):
        """In 1, 2 and 4 parts the increment that is left behind the touch must not be the same.

        The block comes down late in its one increment; 64 of them are what is true.
        """
        text = (SOURCE / "studies/data/scenes/late.inp").read_text()
        text = text.replace("*STATIC, DIRECT", "*STATIC")
        fine = reference("late-16", lambda: forces_of(text, "late", n=16, steps=64, mu=0.186))
        friction, normal = fine["friction"], fine["normal"]
        run = Run(text, *ASKED, "0.02", name="late", steps=1, mu=0.186)
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            mine, _ = friction_and_normal(result)
            error = np.linalg.norm(mine[-1] - friction[-1]) / (0.186 * normal.max())
            self.assertLess(error, 0.02)
            self.assertGreater(result.accuracy.load_steps, 0.001)

    def test_options_that_mean_one_mesh(self):
        for words, message in (
            (["--export-fclib", "1"], "--refine 0 keeps the deck's mesh"),
            (["--refine", "0"], "on one mesh only the errors of RESULTANTS and ENERGY"),
        ):
            text = with_card(deck("block"), "*ACCURACY, OF=SLIP\n0.1")
            run = Run(text, *words, name="block", n=2, steps=5)
            self.assertEqual(run.status, 1)
            self.assertIn(message, run.errors)
            self.assertEqual(run.errors.count("\n"), 1)
        for words, message in (
            (["--extrapolated"], "none is asked for: --accuracy X"),
            (["--extrapolated", *ASKED, "0.1", "--refine", "0"], "--refine keeps the mesh"),
            (["--extrapolate", *ASKED, "0.1"], "did you mean '--extrapolated'?"),
        ):
            run = Run(deck("block"), *words, name="block", n=2, steps=5)
            self.assertEqual(run.status, 1)
            self.assertIn(message, run.errors)
            self.assertEqual(run.errors.count("\n"), 1)

    def test_a_plan_is_that_of_the_first_mesh(self):
        run = Run(deck("block"), *ASKED, "0.1", "--plan", name="block")
        self.assertEqual(run.status, 0)
        self.assertIn("27 nodes, 8 elements", run.output)
        self.assertIn("10 % of the contact forces; the mesh is chosen for it", run.output)


if __name__ == "__main__":
    unittest.main()
