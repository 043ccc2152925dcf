"""An accuracy of what a node or a set has: kept, found in the file, or refused with the reason."""

import unittest

import numpy as np
from program import INPUT, Run
from references import reference

AUTO = {"solver": "AUTO", "local": "AUTO"}
FINE = {**AUTO, "tolerance": 1e-9}
ONE = "*NSET, NSET=ONE\n13\n"  # in the middle of the lower face, x = 0.5, y = 0.5, of 4 x 4 x 4
PRINTED = "*NODE PRINT, NSET=BODY-ZMAX, TOTALS=ONLY\nRF\n*CONTACT FILE\nCOPEN\n*NODE FILE\nU\n*END"


def asking(card, sets=ONE):
    """The block, its increments free to be cut, an accuracy before its first step."""
    text = (INPUT / "block.inp").read_text().replace("*STATIC, DIRECT", "*STATIC")
    text = text.replace("*END STEP", f"{PRINTED} STEP", 1)
    return text.replace("*STEP\n", f"{sets}{card}\n*STEP, NLGEOM=NO\n", 1)


def of_deck(result):
    """Which rows are ends of the deck's increments."""
    return np.flatnonzero(result.history("extra") == 0)


def at_node(result, name, place):
    """A field at a place of the mesh, at the ends of the deck's increments."""
    node = np.flatnonzero(np.linalg.norm(result.points - place, axis=1) < 1e-9)
    assert len(node) == 1
    return np.array([result.field(name, int(row))[node[0]] for row in of_deck(result)])


def sums(result):
    """The printed sums, at the ends of the deck's increments."""
    return result.file["print/1/total_reaction_force"][:][of_deck(result)]


def solve_finely():
    """On a fine mesh, at the ends of five increments: what the tests ask for, of node 13 of ONE."""
    with Run(asking(""), name="block", n=24, steps=20, **FINE).result() as result:
        found = {
            name: at_node(result, name, [0.5, 0.5, 0])[3::4]
            for name in ("displacement", "contact_pressure")
        }
        return found | {"sums": sums(result)[3::4]}


class Reached(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.fine = reference("block-24-node-13", solve_finely)

    def reach(self, card, accuracy):
        run = Run(asking(f"*ACCURACY, {card}\n{accuracy}"), name="block", steps=5, **AUTO)
        self.assertEqual(run.status, 0, run.errors)
        result = self.enterContext(run.result())
        self.assertTrue(result.accuracy.reached)
        return result

    def test_values_of_a_node(self):
        """Those of its fields, at the place that it has in the deck; as accurate as was asked."""
        for of, field, names, beside in (
            ("DISPLACEMENT", "displacement", [f"displacement_{x}" for x in "xyz"],
             ["largest_displacement"]),
            ("PRESSURE", "contact_pressure", ["contact_pressure"],
             ["largest_contact_pressure", "BODY-ZMIN:GROUND/used_gap"]),
        ):  # fmt: skip
            result = self.reach(f"OF={of}, NSET=ONE", 0.02)
            sequence = result.accuracy
            n = len(names)
            self.assertEqual(sequence.names, [f"ONE/13/{name}" for name in names] + beside)
            self.assertEqual(sequence.error[n], -1)
            # Edges in 1, 2, 3, ... parts: nodes stay where they are.
            np.testing.assert_allclose(1 / sequence.element_size,
                                       np.round(1 / sequence.element_size), rtol=1e-12)  # fmt: skip
            place = np.flatnonzero(result.node_ids == 13)
            np.testing.assert_array_equal(result.points[place[0]], [0.5, 0.5, 0])
            mine = at_node(result, field, [0.5, 0.5, 0]).reshape(5, -1)
            np.testing.assert_allclose(sequence.values[-1, :, :n], mine, rtol=1e-12, atol=1e-15)
            true = self.fine[field].reshape(5, -1)
            scale = np.linalg.norm(mine, axis=1).max()
            self.assertAlmostEqual(sequence.scale[0], scale, delta=1e-9 * scale)
            error = np.linalg.norm(mine - true, axis=1).max() / scale
            self.assertLess(error, 0.02)
            self.assertGreater(sequence.mesh, 0.3 * error)

    def test_slip_of_a_node(self):
        """What it is of its point in the pair."""
        result = self.reach("OF=SLIP, NSET=ONE", 0.05)
        pair = result.pairs[0]
        point = np.flatnonzero(result.node_ids[pair.nodes] == 13)[0]
        slip = np.linalg.norm(pair.slip[of_deck(result), point], axis=1)
        np.testing.assert_allclose(result.accuracy.values[-1, :, 0], slip, rtol=1e-12)
        self.assertGreater(slip[-1], 0)

    def test_force_on_a_set(self):
        """The sum over all its nodes on each mesh; of contact that with the other sign."""
        true = self.fine["sums"]
        for card, sign in (
            ("OF=REACTION FORCE, NSET=BODY-ZMAX", 1),
            ("OF=CONTACT FORCE, NSET=BODY-ZMIN", -1),
        ):
            result = self.reach(card, 0.02)
            found = sign * result.accuracy.values[-1, :, :3]
            scale = np.linalg.norm(true, axis=1).max()
            np.testing.assert_allclose(found, sums(result), atol=1e-5 * scale)
            self.assertLess(np.linalg.norm(found - true, axis=1).max() / scale, 0.02)
        result = self.reach("OF=REACTION FORCE, NSET=BODY-ZMAX, DIRECTION=1", 0.05)
        self.assertEqual(result.accuracy.names[0], "BODY-ZMAX/reaction_force_x")
        np.testing.assert_allclose(result.accuracy.values[-1, :, 0], sums(result)[:, 0], rtol=1e-12)

    def test_what_is_next_to_nothing(self):
        """A node that is held has no error but rounding, which is no part of that rounding."""
        held = "*NSET, NSET=ONE\n113\n"
        run = Run(asking("*ACCURACY, OF=DISPLACEMENT, NSET=ONE, DIRECTION=2\n0.001", held),
                  name="block", steps=5, theta=0, **AUTO)  # fmt: skip
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            values, scale = result.accuracy.values[-1], result.accuracy.scale
            self.assertLess(abs(values[:, 0]).max(), 1e-9)
            self.assertAlmostEqual(scale[0], 1e-3 * values[:, 1].max(), delta=1e-9)


class NotReached(unittest.TestCase):
    def test_beneath_a_force_on_a_node(self):
        """Its displacement grows for ever: said so, with the node's name, and status 2."""
        text = asking("*ACCURACY, OF=DISPLACEMENT, NSET=ONE\n0.01", "*NSET, NSET=ONE\n75\n")
        text = text.replace("*BOUNDARY\nBODY-ZMAX, 1, 2, 0.\nBODY-ZMAX, 3, 3, -0.1\n",
                            "*BOUNDARY\nBODY-ZMAX, 1, 3, 0.\n*CLOAD\n75, 1, 10.\n")  # fmt: skip
        text = text[: text.index("** Sideways")]
        run = Run(text, name="block", steps=5, n=4, **AUTO)
        self.assertEqual(run.status, 2, run.output)
        self.assertIn("ONE/75/displacement does not converge", run.errors)


if __name__ == "__main__":
    unittest.main()
