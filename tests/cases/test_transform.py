"""*TRANSFORM: a scene whose supports, forces and equations are said along local directions.

Turned as a whole it must give the results of the scene that stands straight, turned; rings must
give those of their directions along x and y, and Lame's; a roller on a slope what statics says.
"""

import math
import subprocess
import unittest

import h5py
import numpy as np
from program import PROGRAM, Run
from two_bodies import solved

from studies.deck_cards import quarter_ring

PLACES = ("XMIN", "XMAX", "YMIN", "YMAX", "ZMIN", "ZMAX")


def turn(axis, degrees):
    """Return the matrix that turns about an axis."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.radians(degrees)
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


SLANT = turn((1, 2, 3), 30)
STRAIGHT = np.eye(3)


def numbers(values):
    """Return numbers as fields of a card."""
    return ", ".join(repr(float(value)) for value in values)


def elements(n, size, rotation, name="B", first=1):
    """Return the cards of a block of elements that is turned about the origin."""
    counts = np.array(n) + 1
    index = np.array(list(np.ndindex(*counts[::-1])))[:, ::-1]
    places = index / np.array(n) * np.array(size) @ rotation.T
    number = {tuple(ijk): first + k for k, ijk in enumerate(index.tolist())}
    lines = [f"*NODE, NSET={name}"]
    lines += [f"{first + k}, {numbers(x)}" for k, x in enumerate(places)]
    lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET={name}")
    around = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
              (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    for k, ijk in enumerate(np.ndindex(*n)):
        corners = [number[tuple(np.add(ijk, a).tolist())] for a in around]
        lines.append(f"{first + k}, " + ", ".join(map(str, corners)))
    for k, place in enumerate(PLACES):
        at = (0, n[k // 2])[k % 2]
        lines.append(f"*NSET, NSET={name}-{place}")
        lines += [str(m) for ijk, m in number.items() if ijk[k // 2] == at]
    return "\n".join(lines) + "\n"


def material(name="B"):
    """Return the cards of a soft material."""
    return f"*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET={name}, MATERIAL=M\n"


def directions(rotation, name="B"):
    """Return the *TRANSFORM whose local directions are the turned x, y, z."""
    return f"*TRANSFORM, NSET={name}\n{numbers([*rotation[:, 0], *(rotation @ [0.3, 0.7, 0])])}\n"


def last(result, field):
    """Return a field at the end."""
    return result.field(field, -1)


class TurnedScenes(unittest.TestCase):
    """A scene that is turned by 30 degrees about (1, 2, 3), and the same that stands straight."""

    def pair(self, build, *options):
        """Run the scene straight, without *TRANSFORM, and turned with it."""
        straight = solved(self, build(STRAIGHT, ""), *options)
        turned = solved(self, build(SLANT, directions(SLANT)), *options)
        return straight, turned

    def alike(self, straight, turned, tolerance=1e-10, fields=("displacement", "reaction_force")):
        for field in fields:
            for step in range(straight.file["VTKHDF/Steps"].attrs["NSteps"]):
                want = straight.field(field, step) @ SLANT.T
                found = turned.field(field, step)
                self.assertEqual(found.shape, want.shape)
                scale = np.abs(want).max()
                self.assertGreater(scale, 0, field)
                self.assertLess(np.abs(found - want).max(), tolerance * scale, (field, step))

    def block(self, rotation, cards):
        """Supports of one and two directions at a node, some prescribed, that change; forces."""
        return (
            elements((3, 2, 2), (3, 2, 1), rotation) + material() + cards
            + "*AMPLITUDE, NAME=RISE\n0., 0., 0.5, 1., 1., 0.6\n"
            "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-XMIN, XSYMM\nB-YMIN, 2\nB-ZMIN, 3\n"
            "B-XMAX, 1, 1, 0.02\nB-XMAX, 3, 3, -0.01\n*CLOAD\nB-YMAX, 2, 0.5\nB-YMAX, 1, -0.2\n"
            "*NODE FILE\nU, RF, CF\n*EL FILE\nMISES\n*END STEP\n"
            "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY, AMPLITUDE=RISE\nB-XMAX, 1, 1, 0.03\n"
            "*CLOAD\nB-YMAX, 2, 0.8\n*END STEP\n"
            "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY, OP=NEW\nB-XMIN, 1, 3\n"
            "*CLOAD, OP=NEW\nB-XMAX, 3, 0.1\n*END STEP\n"
        )

    def test_supports_and_forces(self):
        straight, turned = self.pair(self.block)
        self.alike(straight, turned)
        self.alike(straight, turned, fields=("applied_force",))
        for step in range(6):
            want = straight.field("von_mises", step, on="elements")
            found = turned.field("von_mises", step, on="elements")
            np.testing.assert_allclose(found, want, rtol=1e-9)
        for name in ("external_work", "strain"):
            want, found = (r.history(f"energy/{name}") for r in (straight, turned))
            np.testing.assert_allclose(found, want, rtol=1e-10)
        # Forces of the supports balance the loads: all of them are along x, y, z.
        for step in range(6):
            total = sum(turned.field(f, step).sum(axis=0) for f in ("reaction_force",
                                                                     "applied_force"))
            self.assertLess(np.abs(total).max(), 1e-10)

    def test_directions_along_axes_are_the_same_deck(self):
        """Local x along y, local y along -x: nothing but other names for the axes."""
        cards = "*TRANSFORM, NSET=B\n0., 2., 0., -1., 3., 0.\n"
        text = self.block(STRAIGHT, cards)
        names = {"1": "2", "2": "1"}
        plain, inside = [], ""
        for line in self.block(STRAIGHT, "").splitlines():
            if line.startswith("*"):
                inside = line.split(",")[0]
            elif inside in ("*BOUNDARY", "*CLOAD"):
                fields = [field.strip() for field in line.split(",")]
                local = "1" if fields[1] == "XSYMM" else fields[1]
                if len(fields) > 2 and inside == "*BOUNDARY" and fields[2] != local:
                    plain.append(line)  # all three
                    continue
                value = float(fields[-1]) if len(fields) > 2 else 0.0
                along = names.get(local, local)
                value = -value if local == "2" else value
                fields = [fields[0], along, along, repr(value)]
                line = ", ".join(fields if inside == "*BOUNDARY" else [fields[0], *fields[2:]])
            plain.append(line)
        one, other = solved(self, text), solved(self, "\n".join(plain) + "\n")
        for field in ("displacement", "reaction_force"):
            for step in range(6):
                np.testing.assert_array_equal(one.field(field, step), other.field(field, step))

    def test_contact_and_friction(self):
        """Pressed on a plane and pushed along it, sides held along and across local directions."""

        def build(rotation, cards):
            plane = numbers([0, 0, 0, *rotation[:, 2]])
            return (
                elements((3, 2, 2), (3, 2, 1), rotation) + material() + cards
                + f"*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n{plane}\n"
                "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3\n"
                "*CONTACT PAIR, INTERACTION=I\nB-ZMIN, FLOOR\n"
                "*CONTACT SOLVER, TOLERANCE=1e-12\n"
                "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-ZMAX, 3, 3, -0.02\nB-ZMAX, 1, 2\n*END STEP\n"
                "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-ZMAX, 1, 1, 0.03\n*END STEP\n"
            )

        fields = ("displacement", "reaction_force", "contact_force")
        straight, turned = self.pair(build)
        self.alike(straight, turned, 1e-9, fields)
        status = turned.pairs[0].status[-1]
        self.assertIn(2, status)
        products = solved(
            self, build(SLANT, directions(SLANT)).replace("=1e-12", "=1e-12, COMPLIANCE=PRODUCTS")
        )
        self.alike(straight, products, 1e-8, fields)

    def test_contact_points_on_a_plane_that_is_held(self):
        """A plane of symmetry aslant holds a tangent of contact points with friction."""

        def build(rotation, cards):
            plane = numbers([0, 0, 0, *rotation[:, 2]])
            return (
                elements((3, 2, 2), (3, 2, 1), rotation) + material() + cards
                + f"*OBSTACLE, NAME=FLOOR, TYPE=PLANE\n{plane}\n"
                "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3\n"
                "*CONTACT PAIR, INTERACTION=I\nB-ZMIN, FLOOR\n"
                "*CONTACT SOLVER, TOLERANCE=1e-12\n"
                "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-YMIN, 2\nB-ZMAX, 3, 3, -0.02\n"
                "B-ZMAX, 1, 1\n*END STEP\n"
                "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-ZMAX, 1, 1, 0.03\n*END STEP\n"
            )

        straight, turned = self.pair(build)
        self.alike(straight, turned, 1e-8, ("displacement",))
        # How friction and support share the force along the held tangent is not determined.
        for step in range(4):
            want, found = (
                r.field("contact_force", step) + r.field("reaction_force", step)
                for r in (straight, turned)
            )
            np.testing.assert_allclose(found, want @ SLANT.T, atol=1e-8 * np.abs(want).max())

    def test_equations(self):
        """Sides that move alike, but for a node without elements that says by how much."""

        def build(rotation, cards):
            cards = cards.replace("NSET=B\n", "NSET=ALL\n")
            return (
                "*NODE, NSET=SAYS\n900, 5., 5., 5.\n" + elements((4, 2, 3), (2, 1, 1), rotation)
                + "*NSET, NSET=ALL\nB, SAYS\n" + material() + cards
                + "*EQUATION\n3\nB-XMAX, 1, 1., B-XMIN, 1, -1., 900, 1, -1.\n"
                "2\nB-XMAX, 2, 2., B-XMIN, 2, -2.\n2\nB-XMAX, 3, 1., B-XMIN, 3, -1.\n"
                "*CONTACT SOLVER, TOLERANCE=1e-12\n"
                "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n900, 1, 1, 0.02\n"
                "*EL FILE\nMISES\n*END STEP\n"
            )

        straight, turned = self.pair(build)
        for result, rotation in ((straight, STRAIGHT), (turned, SLANT)):
            says = result.reference_nodes[900]
            np.testing.assert_allclose(says.reaction_force[0], 10 * rotation[:, 0], atol=1e-9)
            np.testing.assert_allclose(says.displacement[0], 0.02 * rotation[:, 0], atol=1e-15)
            mises = result.field("von_mises", -1, on="elements")
            np.testing.assert_allclose(mises, 10, rtol=1e-10)

    def test_a_direction_may_follow_another_of_its_node(self):
        """A slot aslant: what moves along local x moves twice as much along local y."""

        def build(rotation, cards):
            return (
                elements((2, 2, 2), (1, 1, 1), rotation) + material() + cards
                + "*EQUATION\n2\nB-XMAX, 2, 1., B-XMAX, 1, -2.\n"
                "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-XMIN, 1, 3\nB-XMAX, 3, 3, 0.01\n"
                "*CLOAD\nB-XMAX, 1, 1.\n*END STEP\n"
            )

        straight, turned = self.pair(build)
        self.alike(straight, turned)
        side = last(straight, "displacement")[2::3]
        np.testing.assert_allclose(side[:, 1], 2 * side[:, 0], rtol=1e-10)

    def test_reference_nodes_of_couplings(self):
        """A grip that is pushed, turned and loaded along local directions."""

        def build(rotation, cards):
            cards = cards.replace("NSET=B\n", "NSET=GRIP\n") + directions(rotation, "B-XMIN") * (
                cards != ""
            )
            grip = numbers(rotation @ [3.5, 0.4, 0.6])
            return (
                f"*NODE, NSET=GRIP\n900, {grip}\n" + elements((3, 2, 2), (3, 1, 1), rotation)
                + material() + cards + "*COUPLING, REF NODE=900, SURFACE=B-XMAX\n*KINEMATIC\n"
                "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nB-XMIN, 1, 3\nGRIP, 1, 1, 0.02\n"
                "GRIP, 4, 4, 0.05\nGRIP, 6, 6, -0.01\n*CLOAD\nGRIP, 2, 0.7\nGRIP, 5, 0.3\n"
                "*NODE FILE\nU, RF, CF\n*END STEP\n"
            )

        straight, turned = self.pair(build)
        self.alike(straight, turned)
        grips = [result.reference_nodes[900] for result in (straight, turned)]
        for name in ("displacement", "reaction_force", "rotation", "reaction_moment",
                     "applied_force", "applied_moment"):
            want, found = (getattr(grip, name) for grip in grips)
            self.assertEqual(found.shape, (2, 3))
            scale = np.abs(want).max()
            self.assertGreater(scale, 0, name)
            self.assertLess(np.abs(found - want @ SLANT.T).max(), 1e-10 * scale, name)
        # What the deck prescribes, along local directions.
        u, turn, force, moment = (getattr(grips[0], name) for name in (
            "displacement", "rotation", "applied_force", "applied_moment"
        ))
        np.testing.assert_allclose(u[:, 0], [0.01, 0.02], rtol=1e-14)
        np.testing.assert_allclose(turn[:, [0, 2]], [[0.025, -0.005], [0.05, -0.01]], rtol=1e-13)
        np.testing.assert_allclose(force, [[0, 0.35, 0], [0, 0.7, 0]], atol=1e-15)
        np.testing.assert_allclose(moment, [[0, 0.15, 0], [0, 0.3, 0]], atol=1e-15)

    def test_loads_on_what_is_tied(self):
        """Local forces on slave nodes of a tie go through it."""

        def build(rotation, cards):
            cards = cards.replace("NSET=B\n", "NSET=TOP\n")
            low = elements((2, 2, 2), (1, 1, 1), rotation, "LOW")
            up = elements((1, 1, 1), (1, 1, 1), rotation, "UP", 101)
            shift = rotation @ [0, 0, 1]
            lines, inside = [], False
            for line in up.splitlines():
                if line.startswith("*"):
                    inside = line.startswith("*NODE")
                elif inside:
                    number, *place = line.split(",")
                    line = f"{number}, {numbers(np.array(place, float) + shift)}"
                lines.append(line)
            sections = material("LOW") + "*SOLID SECTION, ELSET=UP, MATERIAL=M\n"
            return (
                low + "\n".join(lines) + "\n" + sections + "*NSET, NSET=TOP\nUP, LOW-ZMIN\n" + cards
                + "*SURFACE, NAME=S1, TYPE=ELEMENT\nUP, S1\n*ELSET, ELSET=LOWTOP\n2, 4, 6, 8\n"
                "*SURFACE, NAME=S2, TYPE=ELEMENT\nLOWTOP, S2\n*TIE, NAME=T\nS1, S2\n"
                "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nLOW-ZMIN, 1, 3\n*CLOAD\nUP-ZMIN, 1, 0.5\n"
                "UP-ZMIN, 3, -0.2\nUP-ZMAX, 2, 0.1\n*END STEP\n"
            )

        straight, turned = self.pair(build)
        self.alike(straight, turned)

    def test_the_file_has_the_nodes_of_the_deck(self):
        run = Run(self.block(SLANT, directions(SLANT)), name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertRegex(run.output, r"36 nodes, 12 elements")
        with h5py.File(run.file) as file:
            np.testing.assert_array_equal(file["VTKHDF/PointData/node_id"], np.arange(1, 37))
            self.assertEqual(file["VTKHDF/NumberOfPoints"][0], 36)
            self.assertEqual(file["VTKHDF/Points"].shape, (36, 3))

    def test_a_flat_deck_is_the_same(self):
        text = self.block(SLANT, directions(SLANT))
        whole = Run(text, name="deck")
        flat = subprocess.run([PROGRAM, str(whole.deck), "--flat"], capture_output=True, text=True,
                              check=True).stdout
        again = Run(flat, name="deck")
        self.assertEqual((whole.status, again.status), (0, 0), whole.errors + again.errors)
        with whole.result() as one, again.result() as other:
            for field in ("displacement", "reaction_force"):
                np.testing.assert_array_equal(one.field(field, -1), other.field(field, -1))


class Rings(unittest.TestCase):
    """Quarters of a ring under pressure whose planes of symmetry stand at 25 and 115 degrees."""

    RADII = (1.0, 2.0)
    HEIGHT = 0.1

    def ring(self, degrees, rest, elements_=(8, 12)):
        """A quarter that begins at an angle, and what else the deck has."""
        text = quarter_ring("R", 1, self.RADII, elements_, self.HEIGHT)
        lines, in_nodes = [], False
        rotation = turn((0, 0, 1), degrees)
        for line in text.splitlines():
            if line.startswith("*"):
                in_nodes = line.startswith("*NODE")
            elif in_nodes:
                number, *place = line.split(",")
                line = f"{number}, {numbers(rotation @ np.array(place, float))}"
            lines.append(line)
        return solved(self, "\n".join(lines) + "\n" + material("R") + rest)

    ROUND = "*TRANSFORM, NSET=R-ALL, TYPE=C\n0., 0., -3., 0., 0., 7.\n"

    def test_pressure_inside(self):
        loads = "*DSLOAD\nR-IN, P, 10.\n*END STEP\n"
        begin = "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nR-ALL, 3\n"
        straight = self.ring(0, begin + "R-X, 1\nR-Y, 2\n" + loads)
        turned = self.ring(25, self.ROUND + begin + "R-X, 2\nR-Y, YSYMM\n" + loads)
        rotation = turn((0, 0, 1), 25)
        for field in ("displacement", "reaction_force"):
            want = last(straight, field) @ rotation.T
            self.assertLess(np.abs(last(turned, field) - want).max(), 1e-10 * np.abs(want).max())
        # Lame's thick ring in plane strain: u = c1 r + c2/r.
        a, b, p, e, nu = *self.RADII, 10.0, 1000.0, 0.3
        shear, lame = e / (2 + 2 * nu), e * nu / (1 + nu) / (1 - 2 * nu)
        c1 = p * a**2 / (b**2 - a**2) / (2 * (lame + shear))
        c2 = p * a**2 * b**2 / (b**2 - a**2) / (2 * shear)
        points, u = turned.points, last(turned, "displacement")
        r = np.hypot(points[:, 0], points[:, 1])
        along = (u * points / r[:, None])[:, :2].sum(axis=1)
        np.testing.assert_allclose(along, c1 * r + c2 / r, rtol=5e-3)
        # The quarter pulls at its planes with what the pressure does to its chord.
        planes = np.zeros(len(points), bool)
        angle = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
        planes[np.abs(angle - 25) < 1e-6] = True
        force = last(turned, "reaction_force")
        across = rotation[:, 1]
        self.assertAlmostEqual(
            force[planes].sum(axis=0) @ across, -p * a * self.HEIGHT, delta=2e-2
        )
        self.assertLess(np.abs(force[planes] @ rotation[:, 0]).max(), 1e-12)

    def test_a_prescribed_radial_displacement(self):
        """A ring is widened: radial forces that balance, alike at all angles."""
        rest = (
            "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nR-ALL, 3\nR-X, 2\nR-Y, 2\nINSIDE, 1, 1, 0.01\n"
            "*END STEP\n"
        )
        inside = "*NSET, NSET=INSIDE\n" + "\n".join(
            str(1 + 9 * j + 117 * k) for k in (0, 1) for j in range(13)
        ) + "\n"
        turned = self.ring(25, inside + self.ROUND + rest)
        points, u = turned.points, last(turned, "displacement")
        r = np.hypot(points[:, 0], points[:, 1])
        inner = np.abs(r - 1) < 1e-9
        np.testing.assert_allclose(u[inner], 0.01 * points[inner] * [1, 1, 0], atol=1e-15)
        # By symmetry the ring is widened alike everywhere.
        outer = np.abs(r - 2) < 1e-9
        along = (u * points)[outer, :2].sum(axis=1) / 2
        np.testing.assert_allclose(along, along.mean(), rtol=1e-9)
        a, b, nu = 1.0, 2.0, 0.3
        ratio = ((1 - 2 * nu) * b + b) / ((1 - 2 * nu) * a + b**2 / a)
        np.testing.assert_allclose(along.mean(), 0.01 * ratio, rtol=5e-3)


class Slope(unittest.TestCase):
    """A block on rollers on a slope of 30 degrees, which one row of nodes keeps from rolling."""

    def test_reactions_are_those_of_statics(self):
        slope = turn((0, 1, 0), -30)
        text = (
            elements((3, 2, 2), (3, 2, 1), STRAIGHT) + material()
            + directions(slope, "B-ZMIN")
            + "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\nB-ZMIN, 3\nB-ZMIN, 2\n1, 1\n5, 1\n9, 1\n"
            "*CLOAD\nB-ZMAX, 3, -0.5\nB-ZMIN, 1, -0.25\n*NODE FILE\nU, RF, CF\n*END STEP\n"
        )
        result = solved(self, text)
        force = last(result, "reaction_force")
        u = last(result, "displacement")
        # Twelve nodes above, twelve below.
        load = np.array([0, 0, -6.0]) - 3.0 * slope[:, 0]
        np.testing.assert_allclose(last(result, "applied_force").sum(axis=0), load, atol=1e-12)
        np.testing.assert_allclose(force.sum(axis=0), -load, atol=1e-11)
        bottom = np.arange(12)
        self.assertAlmostEqual((force[bottom] @ slope[:, 2]).sum(), 6 * math.cos(math.radians(30)),
                               delta=1e-11)
        held = [0, 4, 8]
        self.assertAlmostEqual((force[held] @ slope[:, 0]).sum(),
                               3 + 6 * math.sin(math.radians(30)), delta=1e-11)
        others = np.setdiff1d(np.arange(36), held)
        self.assertLess(np.abs(force[others] @ slope[:, 0]).max(), 1e-11)
        self.assertLess(np.abs(u[bottom] @ slope[:, 2]).max(), 1e-16)
        self.assertGreater(np.abs(u[bottom] @ slope[:, 0]).max(), 1e-4)


if __name__ == "__main__":
    unittest.main()
