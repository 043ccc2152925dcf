"""Parts and their instances are the model that they stand for.

The deck has two cubes of one part, written as Abaqus/CAE writes it: the upper one is moved, then
turned, and lies on the lower one with friction. Its twin is the same model written by hand here,
without parts.
"""

import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cases"))
from program import PROGRAM, Result, Run

N = 2  # elements along a side of the cube
STEP = 100  # the first power of ten above the 27 nodes


def cube():
    """Return nodes and elements of a cube of side 1, by their ids in the part."""
    def node(i, j, k):
        return 1 + i + (N + 1) * (j + (N + 1) * k)

    side = range(N + 1)
    nodes = {node(i, j, k): (i / N, j / N, k / N) for k in side for j in side for i in side}
    face = [(0, 0), (1, 0), (1, 1), (0, 1)]
    corners = [(*corner, k) for k in (0, 1) for corner in face]
    cells = [(i, j, k) for k in range(N) for j in range(N) for i in range(N)]
    elements = {
        e: [node(*np.add(cell, corner)) for corner in corners] for e, cell in enumerate(cells, 1)
    }
    return nodes, elements


NODES, ELEMENTS = cube()
LOW = [n for n, x in NODES.items() if x[2] == 0.0]
HIGH = [n for n, x in NODES.items() if x[2] == 1.0]
BOTTOM, TOP = range(1, N * N + 1), range(N**3 - N * N + 1, N**3 + 1)


def lines(ids):
    """Return one id a line."""
    return "\n".join(str(i) for i in ids)


def mesh(move=lambda x: x, added=0, name=""):
    """Return nodes, elements and sets, moved and renumbered, with names that begin with `name`."""
    text = "*Node\n"
    for n, x in NODES.items():
        text += f"{n + added}, " + ", ".join(repr(float(value)) for value in move(x)) + "\n"
    text += "*Element, type=C3D8\n"
    for e, corners in ELEMENTS.items():
        text += f"{e + added}, " + ", ".join(str(c + added) for c in corners) + "\n"
    text += f"*Elset, elset={name}Body, generate\n{1 + added}, {N**3 + added}, 1\n"
    for label, nodes in (("Low", LOW), ("High", HIGH)):
        text += f"*Nset, nset={name}{label}\n" + lines(np.add(nodes, added)) + "\n"
    text += f"*Elset, elset={name}_Bottom_S1, internal\n" + lines(np.add(BOTTOM, added)) + "\n"
    text += f"*Surface, type=ELEMENT, name={name}Bottom\n{name}_Bottom_S1, S1\n"
    text += f"*Solid Section, elset={name}Body, material=Steel\n,\n"
    return text


ASSEMBLY = """\
*Heading
** as Abaqus/CAE writes
*Part, name=Cube
{part}*End Part
*Assembly, name=Assembly
*Instance, name=Cube-1, part=Cube
*End Instance
*Instance, name=Cube-2, part=Cube
0.125, 0.25, 1.
{rotation}*End Instance
*Node
1, 0.5, 0.5, 3.
*Nset, nset=RP
1
*Nset, nset=Held, instance=Cube-1
Low
*Nset, nset=Moved, internal, instance=Cube-2, generate
{first}, {last}, 1
*Elset, elset=_Table_S2, internal, instance=Cube-1
{top}
*Surface, type=ELEMENT, name=Table
_Table_S2, S2
*End Assembly
{rest}"""
REST = """\
*Material, name=Steel
*Elastic
1000., 0.3
*Surface Interaction, name=Dry
1.,
*Friction
0.3,
*Contact Pair, interaction=Dry, type=SURFACE TO SURFACE
{surface}, Table
*Step, name=Press, nlgeom=NO
*Static
0.5, 1.
*Boundary
{held}, 1, 3
Moved, 1, 1, 0.002
Moved, 2, 2
Moved, 3, 3, -0.01
*Cload
{node}, 1, 0.5
*End Step
"""
QUARTER = "0.5, 0.5, 0., 0.5, 0.5, 1., 90.\n"
MIDDLE = 14  # the node in the middle of the cube


def assembly(**changes):
    """Return the deck with parts."""
    values = {
        "part": mesh(), "rotation": QUARTER, "top": lines(TOP), "first": HIGH[0], "last": HIGH[-1],
        "rest": REST.format(surface="Cube-2.Bottom", held="Assembly.Held", node=f"cube-2.{MIDDLE}"),
    }
    return ASSEMBLY.format(**{**values, **changes})


def by_hand(x):
    """Move a point, then turn it by 90 degrees about the line x = y = 0.5."""
    x, y, z = x[0] + 0.125 - 0.5, x[1] + 0.25 - 0.5, x[2] + 1.0
    return 0.5 - y, 0.5 + x, z


def twin():
    """Return the same model without parts."""
    return (
        "*Node\n1, 0.5, 0.5, 3.\n" + mesh(added=STEP, name="Cube-1.")
        + mesh(by_hand, 2 * STEP, "Cube-2.")
        + "*Nset, nset=Held\nCube-1.Low\n"
        + "*Nset, nset=Moved\n" + lines(np.add(HIGH, 2 * STEP)) + "\n"
        + "*Elset, elset=_Table_S2\n" + lines(np.add(TOP, STEP)) + "\n"
        + "*Surface, type=ELEMENT, name=Table\n_Table_S2, S2\n"
        + REST.format(surface="Cube-2.Bottom", held="Held", node=MIDDLE + 2 * STEP)
    )


def flat(text):
    """Return a deck's flat text, and the coordinates in it by node."""
    run = Run(text, "--flat", name="deck")
    assert run.status == 0, run.errors
    number = r"[-+.\de]+"
    found = re.findall(rf"^(\d+), ({number}), ({number}), ({number})$", run.output, re.MULTILINE)
    return run.output, {int(n): np.array(x, dtype=float) for n, *x in found}


class Instances(unittest.TestCase):
    """What the deck with parts says is what its twin says."""

    def histories(self, text, *options):
        """Run a deck: points, displacements, resultants, output."""
        run = Run(text, *options, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            found = [
                result.points, result.elements, result.field("displacement", -1),
                [pair.resultant[-1] for pair in result.pairs.values()],
            ]
        return found, run

    def same(self, one, other):
        """Check that two runs found the same to the bit."""
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)

    def test_an_assembly_equals_its_twin(self):
        found, run = self.histories(assembly())
        expected, _ = self.histories(twin())
        self.assertGreater(np.abs(found[3]).max(), 1.0)
        self.same(found, expected)
        self.assertIn("instance 'CUBE-2': its nodes and elements have the numbers of its part plus"
                      " 200", run.output)

    def test_the_flat_deck_has_no_parts_and_is_the_same(self):
        text, _ = flat(assembly())
        self.assertNotRegex(text.upper(), r"\*(PART|INSTANCE|ASSEMBLY)|INSTANCE *=")
        self.same(self.histories(text)[0], self.histories(assembly())[0])

    def test_on_a_finer_mesh(self):
        self.same(*(self.histories(text, "--refine", "1")[0] for text in (assembly(), twin())))

    def test_a_run_goes_on(self):
        text = assembly().replace("0.5, 1.\n*Boundary", "0.015625, 1.\n*Boundary")
        expected, _ = self.histories(text)
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "deck.inp").write_text(text)
            with subprocess.Popen(
                [PROGRAM, "deck.inp"],
                cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            ) as running:
                for line in running.stdout:
                    if line.split()[:2] == ["1", "3"]:
                        running.terminate()
                running.wait()
            done = subprocess.run(
                [PROGRAM, "deck.inp", "--continue"],
                cwd=folder, capture_output=True, text=True, timeout=60, check=False,
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            with Result(Path(folder, "deck.vtkhdf")) as result:
                np.testing.assert_array_equal(result.field("displacement", -1), expected[2])

    def test_a_deck_without_mistakes(self):
        run = Run(assembly(), "--check", name="deck")
        self.assertEqual((run.status, run.errors), (0, ""))

    def test_an_instance_may_have_the_mesh(self):
        empty = assembly(part="").replace(
            "part=Cube\n*End Instance", "part=Cube\n" + mesh() + "*End Instance"
        ).replace(QUARTER, QUARTER + mesh())
        self.same(self.histories(empty)[0], self.histories(assembly())[0])

    def test_parameters_in_parts(self):
        part = mesh().replace("1, 0.0, 0.0, 0.0", "<one>, <one-1>, 0.0, 0.0")
        text = "*PARAMETER\none = 1\nangle = 90.\n" + assembly(
            part=part, rotation=QUARTER.replace("90.", "<angle>")
        )
        self.same(self.histories(text)[0], self.histories(assembly())[0])

    def test_names_with_blanks(self):
        text = assembly()
        for one, other in (
            ("name=Cube-2", 'name="Cube 2"'), ("instance=Cube-2", "instance='Cube 2'"),
            ("Cube-2.Bottom", '"Cube 2.Bottom"'), ("cube-2.14", '"cube 2.14"'),
        ):
            self.assertIn(one, text)
            text = text.replace(one, other)
        self.same(self.histories(text)[0], self.histories(assembly())[0])

    def test_a_part_without_an_instance(self):
        text = "*Part, name=Spare\n" + mesh() + "*End Part\n" + assembly()
        found, run = self.histories(text)
        self.assertIn("part 'SPARE' has no instance: it is not in the model", run.output)
        self.same(found, self.histories(assembly())[0])

    def test_an_error_in_a_part_is_reported_once_at_its_line(self):
        text = assembly().replace("2, 0.5, 0.0, 0.0", "2, 0.5, x, 0.0")
        line = text.splitlines().index("2, 0.5, x, 0.0") + 1
        run = Run(text, "--check", name="deck")
        self.assertEqual(run.status, 1)
        self.assertEqual(len(run.errors.splitlines()), 1, run.errors)
        self.assertIn(f"deck.inp:{line}:", run.errors)

    def test_an_id_of_another_part_is_not_taken(self):
        run = Run(assembly(part=mesh() + "*Nset, nset=Odd\n150\n"), "--check", name="deck")
        self.assertEqual(run.status, 1)
        self.assertIn("no part has a node or an element 150", run.errors)


class Motions(unittest.TestCase):
    """A translation, then a rotation about an axis anywhere."""

    def moved(self, rotation):
        """Return the coordinates of a deck without contact, by node."""
        text = assembly(rotation=rotation)
        pair = "*Contact Pair, interaction=Dry, type=SURFACE TO SURFACE\nCube-2.Bottom, Table\n"
        self.assertIn(pair, text)
        return flat(text.replace(pair, ""))[1]

    def test_a_third_of_a_turn_about_the_diagonal(self):
        # By hand: about (1, 1, 1) through the origin, 120 degrees send x to y, y to z, z to x.
        found = self.moved("0., 0., 0., 2., 2., 2., 120.\n")
        for n, (x, y, z) in NODES.items():
            x, y, z = x + 0.125, y + 0.25, z + 1.0
            np.testing.assert_allclose(found[n + 2 * STEP], (z, x, y), rtol=0, atol=1e-15)
            np.testing.assert_array_equal(found[n + STEP], NODES[n])

    def test_an_oblique_axis(self):
        # The point keeps its place along the axis and turns right-handed in the plane across it.
        a, b, angle = np.array([1.0, -2.0, 0.5]), np.array([2.0, 0.0, 2.5]), 37.0
        found = self.moved(", ".join(f"{v}" for v in (*a, *b, angle)) + "\n")
        n = (b - a) / 3.0
        u = np.array([2.0, 1.0, -2.0]) / 3.0
        v = np.cross(n, u)
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        for node, x in NODES.items():
            d = np.add(x, (0.125, 0.25, 1.0)) - a
            along, p, q = d @ n, d @ u, d @ v
            expected = a + along * n + (c * p - s * q) * u + (s * p + c * q) * v
            np.testing.assert_allclose(found[node + 2 * STEP], expected, rtol=0, atol=2e-15)

    def test_quarter_turns_are_exact(self):
        for angle in (-270.0, 90.0, 450.0):
            found = self.moved(f"0.5, 0.5, 0., 0.5, 0.5, 1., {angle}\n")
            for node, x in NODES.items():
                np.testing.assert_array_equal(found[node + 2 * STEP], by_hand(x))


class ReferenceNodes(unittest.TestCase):
    """REF NODE= may be a set of one node."""

    COUPLING = (
        "*Coupling, constraint name=Grip, ref node={node}, surface=Cube-2.High\n*Kinematic\n"
        "*Material"
    )

    def result(self, node, text=None):
        """Run the deck with its upper face held by a coupling: displacements."""
        text = (text or assembly()).replace("*Material", self.COUPLING.format(node=node), 1)
        text = text.replace("Moved, ", "1, ")
        run = Run(text, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            return result.field("displacement", -1)

    def test_a_set_of_one_node(self):
        expected = self.result("1")
        np.testing.assert_array_equal(self.result("RP"), expected)
        of_nodes = assembly().replace("*Node\n1, 0.5", "*Node, nset=Pilot\n1, 0.5")
        np.testing.assert_array_equal(self.result("Pilot", of_nodes), expected)

    def test_other_sets_are_refused(self):
        for name, message in (("Held", "'HELD' cannot be a reference node"),
                              ("Nobody", "node set 'NOBODY' is not defined")):
            text = assembly().replace("*Material", self.COUPLING.format(node=name), 1)
            run = Run(text, "--check", name="deck")
            self.assertEqual(run.status, 1)
            self.assertIn(message, run.errors)
            self.assertEqual(len(run.errors.splitlines()), 1, run.errors)


if __name__ == "__main__":
    unittest.main()
