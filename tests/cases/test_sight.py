"""Bodies whose surfaces are all their outer faces: a face acts on what it sees."""

import copy
import itertools
import unittest

import numpy as np
from program import Run

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
"""


def turned(*angles):
    """A rotation about x, then y, then z."""
    result = np.eye(3)
    for axis, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(3)
        a, b = [k for k in range(3) if k != axis]
        turn[a, a] = turn[b, b] = c
        turn[a, b], turn[b, a] = (-s, s) if axis != 1 else (s, -s)
        result = turn @ result
    return result


# Its space diagonal is upright.
ON_A_CORNER = turned(np.pi / 4, -np.arctan(np.sqrt(0.5)), 0.0)


class Bar:
    """A box of one element, or of several along x, with all outer faces as its surface."""

    def __init__(self, name, first, size, turn=None, n=1):
        self.name, self.first, self.n, self.faces = name, first, n, name
        turn = np.eye(3) if turn is None else turn
        x = [
            np.multiply((i / n - 0.5, j - 0.5, k - 0.5), size)
            for i, k, j in itertools.product(range(n + 1), range(2), range(2))
        ]
        self.x = np.array(x) @ np.transpose(turn)

    def cards(self):
        number = [self.first + i for i in range(len(self.x))]
        lines = [f"*NODE, NSET={self.name}"]
        places = list(zip(number, self.x.tolist(), strict=True))
        lines += [f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in places]
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={self.name}")
        for e in range(self.n):
            k = 4 * e
            nodes = [k, k + 4, k + 5, k + 1, k + 2, k + 6, k + 7, k + 3]
            lines.append(", ".join(map(str, [self.first + e, *(number[i] for i in nodes)])))
        lines.append(f"*SOLID SECTION, ELSET={self.name}, MATERIAL=M")
        for end, of in (("LOW", self.x[:, 2].min()), ("TOP", self.x[:, 2].max())):
            there = [str(i) for i, x in places if abs(x[2] - of) < 1e-9]
            lines.append(f"*NSET, NSET={self.name}{end}\n{', '.join(there)}")
        lines.append(f"*SURFACE, NAME=S{self.name}\n{self.faces}")
        return "\n".join(lines) + "\n"


def deck(one, other, step, options="", increments=2):
    """One is the slave and moves; the lowest nodes of the other are held."""
    return (
        f"*HEADING\nall outer faces\n{one.cards()}{other.cards()}{MATERIAL}"
        "*SURFACE INTERACTION, NAME=I\n*CONTACT PAIR, INTERACTION=I\n"
        f"S{one.name}, S{other.name}\n"
        f"*STEP{options}\n*STATIC\n{1 / increments!r}, 1.\n{step}*END STEP\n"
    )


class ApartAndTouching(unittest.TestCase):
    def pressing(self, one, other, step, options=""):
        """The force between two bodies at the end, on the slave."""
        run = Run(deck(one, other, step, options), name="sight")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            return result.file[f"contact/S{one.name}:S{other.name}/resultant"][-1]

    def apart(self, high, low):
        """They come closer by less than a plane between them is wide: no force."""
        step = "*BOUNDARY\nA, 1, 2\nB, 1, 3\nA, 3, 3, -0.015\n"
        for one, other in ((high, low), (low, high)):
            for options in ("", ", NLGEOM"):
                with self.subTest(slave=one.name, options=options):
                    force = self.pressing(one, other, step, options)
                    self.assertEqual(np.abs(force).max(), 0)

    def test_corner_over_corner(self):
        low, high = Bar("B", 1, (1, 1, 1), ON_A_CORNER), Bar("A", 101, (1, 1, 1), ON_A_CORNER)
        high.x = high.x @ turned(0, 0, 0.4).T + (0.1, 0.03, 0)
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.05
        self.apart(high, low)

    def test_crossing_bars(self):
        on_edge = turned(np.pi / 4, 0, 0)
        low = Bar("B", 1, (3, 0.5, 0.5), on_edge, n=3)
        high = Bar("A", 101, (3, 0.5, 0.5), turned(0, 0, 1.1) @ on_edge, n=3)
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.05
        self.apart(high, low)

    def test_a_plate_over_a_ridge(self):
        """It sees a face that leans by 17 degrees and, beyond the ridge, one by 73."""
        step = "*BOUNDARY\nATOP, 1, 2\nB, 1, 3\nATOP, 3, 3, -0.015\n"
        for place in (-0.2, 0.2):
            low = Bar("B", 1, (2, 3, 2), turned(0, 0.3, 0))
            high = Bar("A", 101, (1, 1, 0.2), n=2)
            high.faces = "A, S1"
            high.x[:, 0] += low.x[low.x[:, 2].argmax(), 0] + place
            high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.02
            for options in ("", ", NLGEOM"):
                with self.subTest(place=place, options=options):
                    self.assertEqual(np.abs(self.pressing(high, low, step, options)).max(), 0)

    def test_a_plate_over_a_blunt_roof(self):
        """An edge of 20 degrees counts as an arc, which is told; a flat block does not press."""
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nATOP, 3, 3, -0.005\n"
        for fall in (0.0, 0.36):
            roof, plate = Bar("B", 1, (4, 2, 2), n=2), Bar("A", 101, (2, 1, 0.4), n=2)
            roof.faces, plate.faces = "B, S2", "A, S1"
            roof.x[:, 2] -= fall * np.maximum(0, roof.x[:, 0]) * (roof.x[:, 2] > 0)
            plate.x += (-0.3, 0, 1.21)
            run = Run(deck(plate, roof, step), name="roof")
            self.assertEqual(run.status, 0, run.output + run.errors)
            words = "though all that its faces see of each other is apart, by 0.00"
            self.assertEqual(words in run.output, fall > 0, run.output)
            with run.result() as result:
                force = np.abs(result.pairs[0].resultant[-1]).max()
                self.assertEqual(force > 1, fall > 0)
                self.assertGreaterEqual(result.history("error/geometry")[-1], 0.5 * (fall > 0))

    def test_a_leaning_facet_over_a_face(self):
        """It covers a tenth of a face, and does not reach it: its plane goes on to enter a node."""
        block = Bar("A", 101, (2, 1, 1), n=2)
        facet = np.array([(-0.1, -0.2, 0), (-0.1, 0.2, 0), (0.1, 0.2, 0), (0.1, -0.2, 0)])
        facet = facet @ turned(0, 0.35, 0).T
        facet += (0.7, 0, 0.5 + 0.01 - facet[:, 2].min())
        tool = "*NODE\n" + "".join(
            f"{901 + i}, {x!r}, {y!r}, {z!r}\n" for i, (x, y, z) in enumerate(facet.tolist()))
        tool += ("905, 0., 0., 1.\n*ELEMENT, TYPE=R3D4, ELSET=B\n901, 901, 902, 903, 904\n"
                 "*RIGID BODY, ELSET=B, REF NODE=905\n*SURFACE, NAME=SB\nB, SPOS\n")  # fmt: skip
        step = "*BOUNDARY\nALOW, 1, 3\n905, 1, 2\n905, 4, 6\n905, 3, 3, -0.005\n"
        for options in ("", ", NLGEOM"):
            with self.subTest(options=options):
                text = deck(block, Bar("B", 1, (1, 1, 1)), step, options)
                start, end = text.index("*NODE, NSET=B"), text.index("*MATERIAL")
                run = Run(text[:start] + tool + text[end:], name="facet")
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    self.assertEqual(np.abs(result.pairs[0].resultant).max(), 0)

    def test_leaning_side_by_side(self):
        """From the top of one, past sides that lean by a tenth, one would see the other's foot."""
        for gap, turn in ((0.0, None), (0.02, None), (0.02, turned(0.3, 0.5, 0.7))):
            one, other = Bar("A", 101, (1, 1, 1)), Bar("B", 1, (1, 1, 1))
            other.x[:, 0] += 1 + gap
            for bar in (one, other):
                bar.x[:, 0] += 0.1 * bar.x[:, 2]
                if turn is not None:
                    bar.x = bar.x @ turn.T
            step = "*BOUNDARY\nA, 1, 3\nB, 1, 3\n"
            for slave, master in ((one, other), (other, one)):
                with self.subTest(gap=gap, turned=turn is not None, slave=slave.name):
                    self.assertEqual(np.abs(self.pressing(slave, master, step)).max(), 0)

    def test_leaning_that_passes(self):
        """Driven up past its neighbour, by more than its height: its foot leans over the other."""
        one, other = Bar("A", 101, (1, 1, 1)), Bar("B", 1, (1, 1, 1))
        other.x[:, 0] += 1.01
        for bar in (one, other):
            bar.x[:, 0] += 0.1 * bar.x[:, 2]
        step = "*BOUNDARY\nA, 1, 2\nB, 1, 3\nA, 3, 3, 1.3\n"
        for slave, master in ((one, other), (other, one)):
            with self.subTest(slave=slave.name):
                run = Run(deck(slave, master, step, ", NLGEOM", 1), name="passes")
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    force = result.pairs[0].resultant[-1]
                self.assertEqual(np.abs(force).max(), 0)

    def test_bars_that_cross_through_each_other(self):
        """Where the least gap is below 0 between nodes nothing is certified."""
        on_edge = turned(np.pi / 4, 0, 0)
        low = Bar("B", 1, (3, 0.5, 0.5), on_edge, n=3)
        high = Bar("A", 101, (3, 0.5, 0.5), turned(0, 0, 1.1) @ on_edge, n=3)
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.005
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nATOP, 3, 3, -0.02\n"
        run = Run(deck(high, low, step), name="bars")
        self.assertEqual(run.status, 2)
        self.assertIn("contact is missed", run.output + run.errors)

    def test_past_a_thin_plate(self):
        """A block that leans moves over it: at edges no strip of its underside is seen."""
        low = Bar("B", 1, (2, 1.1, 0.05), turned(-0.33, 0.39, 0))
        high = Bar("A", 101, (1.9, 1.5, 0.36), turned(0, 0, 2.8), n=2)
        high.x[:, 1] += high.x[:, 2]
        high.x[:, 0] += low.x[low.x[:, 2].argmax(), 0] + 0.8
        high.x[:, 2] += low.x[:, 2].max() - high.x[:, 2].min() + 0.004
        step = "*BOUNDARY\nA, 2, 2\nB, 1, 3\nA, 1, 1, 0.05\nA, 3, 3, -0.002\n"
        for options in ("", ", NLGEOM"):
            with self.subTest(options=options):
                self.assertEqual(np.abs(self.pressing(high, low, step, options)).max(), 0)

    def test_stairs(self):
        """Three floors, of three sides: a plate is pressed on the third, at finite strain."""
        plate, block = Bar("A", 101, (2, 1, 0.5), n=2), Bar("B", 401, (0.8, 2, 1))
        plate.x[:, 2] += 0.25
        block.x += (-0.2, 0, -0.5)
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nATOP, 3, 3, -0.002\n"
        forces = []
        for faces in ("B", "B\nC\nD"):
            block.faces = faces
            text = deck(plate, block, step, ", NLGEOM")
            if faces != "B":
                low, lowest = Bar("C", 201, (0.4, 2, 0.6)), Bar("D", 301, (0.3, 2, 0.4))
                low.x += (0.45, 0, -0.5)
                lowest.x += (0.82, 0, -0.6)
                floors = low.cards() + lowest.cards()
                text = text.replace("*NODE, NSET=B\n", floors + "*NODE, NSET=B\n")
                text = text.replace("*STEP", "*BODY SOLVER, TANGENT=NEWTON\n*STEP")
                text = text.replace("BLOW, 1, 3", "C, 1, 3\nD, 1, 3\nBLOW, 1, 3")
            run = Run(text, name="stairs")
            self.assertEqual(run.status, 0, run.output + run.errors)
            self.assertEqual("3 sides" in run.output, faces != "B")
            with run.result() as result:
                forces.append(result.pairs[0].resultant[-1])
        self.assertGreater(np.abs(forces[0]).max(), 0.3)
        self.assertLess(np.abs(forces[0] - forces[1]).max(), 1e-7)

    def test_a_step(self):
        """A floor beside the top that a plate lies on is no part of what it lies on."""
        plate, floor = Bar("A", 101, (2, 1, 0.5), n=2), Bar("C", 201, (3, 2, 0.8))
        floor.x += (2.4, 0.2, -0.6)
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nCLOW, 1, 3\nATOP, 3, 3, -0.002\n"
        for gap, options in ((0.005, ""), (0.0, ""), (0.0, ", NLGEOM")):
            forces = []
            for faces in ("B", "B\nC"):
                block = Bar("B", 1, (3, 2, 1))
                block.x += (-0.6, 0.2, -0.5)
                block.faces = faces
                high = copy.deepcopy(plate)
                high.x[:, 2] += 0.25 + gap
                text = deck(high, block, step, options)
                run = Run(text.replace("*SURFACE, NAME=SB", floor.cards() + "*SURFACE, NAME=SB"),
                          name="step")  # fmt: skip
                self.assertEqual(run.status, 0, run.output + run.errors)
                with run.result() as result:
                    forces.append(result.pairs[0].resultant[-1])
            with self.subTest(gap=gap, options=options):
                self.assertEqual(np.abs(forces[0]).max() > 1, gap == 0)
                self.assertLess(np.abs(forces[0] - forces[1]).max(), 1e-7)

    def test_a_step_that_comes_about(self):
        """A floor sinks beside the block that a plate lies on: no mean over both is certified."""
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nCLOW, 1, 2\nCLOW, 3, 3, -0.2\n"
        step += "ATOP, 3, 3, -0.002\n"
        for of_plate in ("A", "A, S1"):
            plate, floor = Bar("A", 101, (2, 1, 0.5), n=2), Bar("C", 201, (3, 2, 1))
            block = Bar("B", 1, (3, 2, 1))
            plate.x[:, 2] += 0.25
            block.x += (-0.6, 0.2, -0.5)
            floor.x += (2.4, 0.2, -0.5)
            plate.faces, block.faces = of_plate, "B, S2\nC, S2"
            text = deck(plate, block, step)
            text = text.replace("*SURFACE, NAME=SB", floor.cards() + "*SURFACE, NAME=SB")
            with self.subTest(slave=of_plate):
                run = Run(text, name="step")
                self.assertEqual(run.status, 2, run.output + run.errors)
                self.assertIn("SB has 2 bodies that part: give each a pair of its own", run.errors)

    def test_a_thin_plate(self):
        """The top of the block and the underside of the plate do not see each other."""
        plate, block = Bar("B", 1, (2, 2, 0.02), n=4), Bar("A", 101, (1, 1, 0.3))
        block.x[:, 2] += 0.16
        step = "*BOUNDARY\nATOP, 1, 2\nBLOW, 1, 3\nATOP, 3, 3, -0.003\n"
        for options in ("", ", NLGEOM"):
            for one, other in ((block, plate), (plate, block)):
                forces = []
                for block.faces, plate.faces in (("A", "B"), ("A, S1", "B, S2")):
                    forces.append(self.pressing(one, other, step, options))
                with self.subTest(slave=one.name, options=options):
                    self.assertGreater(abs(forces[1][2]), 5)
                    self.assertLess(np.abs(forces[0] - forces[1]).max(), 1e-9*abs(forces[1][2]))


class Wedge(unittest.TestCase):
    """A block leans over another one that ends within its last face, and is turned upright."""

    def pressing(self, ends, lean, options):
        """The force at the end, where the faces are parallel."""
        high, low = Bar("A", 101, (3, 1, 1), n=3), Bar("B", 1, (2 + ends, 1, 1))
        low.x += (1 + ends / 2, 0.5, -0.5)
        high.x += (1.5, 0.5, 0.5)
        upright = high.x.copy()
        if options:
            high.x = high.x @ turned(0, -lean, 0)
            way = upright - high.x
        else:
            high.x = upright + lean * upright[:, [2, 1, 0]] * (-1, 0, 1)
            way = lean * high.x[:, [2, 1, 0]] * (1, 0, -1)
        step = ["*BOUNDARY", "BLOW, 1, 3"]
        for i in np.flatnonzero(upright[:, 2] > 0.5):
            for k, u in enumerate((way[i] - (0, 0, 0.001)).tolist(), 1):
                step.append(f"{101 + i}, {k}, {k}, {u!r}")
        run = Run(deck(high, low, "\n".join(step) + "\n", options, 4), name="wedge")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            return result.file["contact/SA:SB/resultant"][-1][2]

    def test_it_closes(self):
        """No gap at an edge of what is covered is left from when it was open."""
        for ends, options, close in (
            (0.2, "", 1e-2),
            (0.5, "", 1e-2),
            (0.8, "", 1e-2),
            (0.2, ", NLGEOM", 1e-7),
            (0.8, ", NLGEOM", 1e-7),
        ):
            with self.subTest(ends=ends, options=options):
                twin = self.pressing(ends, 0.0, options)
                self.assertGreater(twin, 1)
                found = self.pressing(ends, 0.02, options)
                self.assertLess(abs(found - twin), close * twin)


PLANE = """*HEADING
two blocks of a plane
*NODE
{nodes}
*ELEMENT, TYPE={kind}, ELSET=B
1, 1, 2, 6, 5
2, 2, 3, 7, 6
3, 3, 4, 8, 7
*ELEMENT, TYPE={kind}, ELSET=A
11, 11, 12, 15, 14
12, 12, 13, 16, 15
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=B, MATERIAL=M
*NSET, NSET=LOW
1, 2, 3, 4
*NSET, NSET=TOP
14, 15, 16
*SURFACE, NAME=SB
{of_b}
*SURFACE, NAME=SA
{of_a}
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
{pair}
*STEP{options}
*STATIC
0.5, 1.
*BOUNDARY
LOW, 1, 2
TOP, 1, 1, 0.01
TOP, 2, 2, -0.02
*END STEP
"""


class Planes(unittest.TestCase):
    """Ends of slices and wedges neither pair nor hide."""

    def force(self, kind, slave, everywhere, options):
        """The force on the slave at the end, with all edges as surfaces or those that face."""
        places = [(x, y) for y in (0.0, 1.0) for x in (0.0, 1.0, 2.0, 3.0)]
        places = dict(enumerate(places, 1))
        places |= {11: (0.5, 1.0), 12: (1.2, 1.0), 13: (2.5, 1.0), 14: (0.5, 2.0), 15: (1.2, 2.0),
                   16: (2.5, 2.0)}
        nodes = "\n".join(f"{i}, {x + 2!r}, {y!r}" for i, (x, y) in places.items())
        text = PLANE.format(
            nodes=nodes, kind=kind, of_b="B" if everywhere else "B, S3",
            of_a="A" if everywhere else "A, S1", pair="SA, SB" if slave == "A" else "SB, SA",
            options=options)
        run = Run(text, name="plane")
        self.assertEqual(run.status, 0, run.output + run.errors)
        with run.result() as result:
            return result.pairs[0].resultant[-1]

    def test_all_edges_are_as_those_that_face(self):
        """Where the lower block is the slave its corners are covered in part: least gaps count."""
        for kind in ("CPE4", "CPS4", "CAX4"):
            for slave, options in (("A", ""), ("A", ", NLGEOM"), ("B", "")):
                with self.subTest(kind=kind, slave=slave, options=options):
                    facing = self.force(kind, slave, False, options)
                    self.assertGreater(abs(facing[1]), 10)
                    found = self.force(kind, slave, True, options)
                    close = 1e-7 if slave == "A" else 0.005
                    self.assertLess(np.abs(found - facing).max(), close * abs(facing[1]))


if __name__ == "__main__":
    unittest.main()
