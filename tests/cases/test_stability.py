"""Equilibria at finite strain that are not stable are refused, or noted where points slide."""

import unittest
from itertools import product
from math import pi

import numpy as np
from boxes import Box
from meshes import grid
from program import Run

YOUNG, LENGTH = 1000.0, 20.0


def column(part, law=f"*ELASTIC\n{YOUNG}, 0."):
    """Deck of a column held at both ends, shortened by a part of what Euler's load does."""
    load = 4 * pi**2 * YOUNG / 12 / LENGTH**2
    return f"""\
*PARAMETER
element = C3D8I
*BLOCK, NAME=B, ELSET=B, TYPE=<element>, NX=1, NY=1, NZ=20
0., 0., 0., 1., 1., {LENGTH}
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
B-ZMIN, 1, 3
B-ZMAX, 1, 2
B-ZMAX, 3, 3, {-part * load / YOUNG * LENGTH!r}
*END STEP
"""


def post(obstacle, press, radius=2.0, friction=0.0):
    """Deck of a post 1 x 1 x 4 held above, its foot shaped as what it stands on."""
    side = {"bowl": 1, "dome": -1, "flat": 0}[obstacle]

    def shape(at):
        x, y, z = at[0] - 0.5, at[1] - 0.5, at[2]
        low = side * (radius - (radius**2 - x * x - y * y) ** 0.5)
        return x, y, low + (4 - low) * z

    mesh, index, _ = grid("ALL", (2, 2, 4), shape)
    kind = shape_of(obstacle, radius)
    top = "\n".join(map(str, index[:, :, -1].ravel()))
    faces = "\n".join(f"{e}, S1" for e in range(1, 17, 4))
    return f"""\
*PARAMETER
element = C3D8
{mesh}*NSET, NSET=TOP
{top}
*SURFACE, NAME=LOW
{faces}
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
<1/(4*1.3)>, <6*0.4>
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=O, {kind}
*SURFACE INTERACTION, NAME=I
*FRICTION
{friction}
*CONTACT PAIR, INTERACTION=I
LOW, O
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
TOP, 1, 2
TOP, 3, 3, {-4 * press!r}
*END STEP
"""

def shape_of(obstacle, radius):
    """Return what a post stands on, by its words in a deck."""
    return {
        "bowl": f"TYPE=SPHERE, INNER\n0., 0., {radius}, {radius}",
        "dome": f"TYPE=SPHERE\n0., 0., {-radius}, {radius}",
        "flat": "TYPE=PLANE\n0., 0., 0., 0., 0., 1.",
    }[obstacle]


def second_order_post(element, obstacle, press, radius=2.0):
    """The deck of `post` with elements of second order, without friction."""
    box = Box("B", (2, 2, 4), (element,), size=(1, 1, 4), shift=0)
    foot, top = (box.side(2, end) for end in (0, 1))
    box.x -= [0.5, 0.5, 0]
    side = {"bowl": 1, "dome": -1, "flat": 0}[obstacle]
    low = side * (radius - np.sqrt(radius**2 - (box.x[:, :2] ** 2).sum(axis=1)))
    box.x[:, 2] = low + (4 - low) * box.x[:, 2] / 4
    box.side = lambda axis, end: [foot, top][end] if axis == 2 else []
    return (
        box.cards()
        + f"""\
*MATERIAL, NAME=STEEL
*HYPERELASTIC, NEO HOOKE
{1 / (4 * 1.3)}, {6 * 0.4}
*OBSTACLE, NAME=O, {shape_of(obstacle, radius)}
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-Z0, O
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
B-Z1, 1, 2
B-Z1, 3, 3, {-4 * press}
*END STEP
"""
    )


# A block on a larger one, in plane strain.
PLANE_PAIR = """\
*BLOCK, NAME=T, ELSET=T, TYPE=C3D8, NX=2, NY=1, NZ=1
0.2, 0., 1., 0.8, 0.5, 1.6
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8, NX=3, NY=1, NZ=2
0., 0., 0., 1.2, 0.5, 1.
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
192., 0.0024
*SOLID SECTION, ELSET=T, MATERIAL=M
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=I
T-ZMIN, B-ZMAX
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
B-YMIN, 2, 2
B-YMAX, 2, 2
T-YMIN, 2, 2
T-YMAX, 2, 2
B-ZMIN, 1, 3
T-ZMAX, 1, 1
T-ZMAX, 3, 3, -0.1
*END STEP
"""


class Columns(unittest.TestCase):
    """Euler's column, held at both ends: 4 pi^2 EI/L^2, and 2.05 times that along each axis."""

    def test_loads_about_eulers(self):
        for part, motions in ((0.9, 0), (1.1, 2), (2.4, 4)):
            run = Run(column(part), name="column")
            if motions == 0:
                self.assertEqual(run.status, 0, run.errors)
                continue
            self.assertEqual(run.status, 2, part)
            self.assertIn(f"the equilibrium is unstable ({motions} motions", run.errors)
            self.assertIn("buckles", run.errors)

    def test_mean_dilatation_may_be_the_reason(self):
        run = Run(column(1.5), name="column", element="C3D8B")
        self.assertEqual(run.status, 2)
        self.assertIn("C3D8I instead of C3D8B", run.errors)
        self.assertIn("note: C3D8B at finite strain", run.errors + run.output)


def second_order_column(element, part):
    """Deck of the same column of 2 x 2 x 10 elements, of which none takes more points."""
    load = 4 * pi**2 * YOUNG / 12 / LENGTH**2
    box = Box("B", (2, 2, 10), (element,), size=(1, 1, LENGTH), shift=0)
    return box.cards() + f"""\
*MATERIAL, NAME=STEEL
*ELASTIC
{YOUNG}, 0.3
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
B-Z0, 1, 3
B-Z1, 1, 2
B-Z1, 3, 3, {-part * load / YOUNG * LENGTH!r}
*END STEP
"""


PRESSED_FLAT = f"""\
*MATERIAL, NAME=STEEL
*ELASTIC, LAW=NEO HOOKE
{YOUNG}, 0.3
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
LOW, G
*OBSTACLE, NAME=G, TYPE=PLANE
"""


def plate(element):
    """Deck of a plate of 3 x 3 x 2 elements, pressed to 0.8 of its thickness without friction."""
    box = Box("B", (3, 3, 2), (element,), size=(100, 100, 1), shift=0)
    return box.cards() + f"""\
*SURFACE, NAME=LOW, TYPE=NODE
B-Z0
{PRESSED_FLAT}0., 0., 0., 0., 0., 1.
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
B-X0, 1
B-Y0, 2
B-Z1, 3, 3, -0.2
*END STEP
"""


def strip(element):
    """The same of 4 x 4 elements of a plane."""
    ids = {}
    lines = ["*NODE"]
    for i, j in product(range(9), repeat=2):
        if i % 2 == 0 or j % 2 == 0:
            ids[i, j] = len(ids) + 1
            lines.append(f"{ids[i, j]}, {12.5 * i}, {j / 8}, 0.")
    lines.append(f"*ELEMENT, TYPE={element}, ELSET=B")
    around = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
    for e, (i, j) in enumerate(product(range(4), repeat=2), 1):
        lines.append(f"{e}, " + ", ".join(str(ids[2 * i + a, 2 * j + b]) for a, b in around))
    for name, axis, end in (("LEFT", 0, 0), ("TOP", 1, 8)):
        lines += [f"*NSET, NSET={name}", *(str(n) for at, n in ids.items() if at[axis] == end)]
    lines += ["*SURFACE, NAME=LOW", *(f"{e}, S1" for e in range(1, 17, 4))]
    return "\n".join(lines) + f"""
*SOLID SECTION, ELSET=B, MATERIAL=STEEL
{PRESSED_FLAT}0., 0., 0., 0., 1., 0.
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
LEFT, 1
TOP, 2, 2, -0.2
*END STEP
"""


class Hourglass(unittest.TestCase):
    """Motions that reduced integration leaves without strain are no buckling of the body."""

    def test_pressed_flat(self):
        """A stretch of 0.8 is homogeneous, and stable: the elements with all points say so."""
        for deck, element, full in ((plate, "C3D20R", "C3D20"), (strip, "CPE8R", "CPE8"),
                                    (strip, "CPS8R", "CPS8")):
            runs = [Run(deck(kind), name="flat") for kind in (element, full)]
            for run in runs:
                self.assertEqual(run.status, 0, run.errors)
            self.assertRegex(runs[0].output, r"note: step 1, increment 4: \d hourglass motion")
            self.assertNotIn("hourglass", runs[1].output)
            forces = []
            for run in runs:
                with run.result() as result:
                    forces.append(np.linalg.norm(result.pairs[0].resultant[-1]))
            self.assertAlmostEqual(forces[0] / forces[1], 1.0, 6)

    def test_a_column_buckles(self):
        """At the load of the elements with all points, 0.995 of Euler's."""
        for element in ("C3D20", "C3D20R"):
            for part, status in ((0.985, 0), (1.005, 2)):
                run = Run(second_order_column(element, part), name="column")
                self.assertEqual(run.status, status, run.errors)
            self.assertIn("the equilibrium is unstable (2 motions", run.errors)


def between_plates(load, sides):
    """Deck of a column that friction alone holds between two plates, the upper one pushed."""
    return f"""\
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8I, NX=1, NY=1, NZ=20
0., 0., 0., 1., 1., {LENGTH}
*NODE
9000, 0.5, 0.5, {LENGTH}
*MATERIAL, NAME=M
*ELASTIC
{YOUNG}, 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=UP, TYPE=PLANE, REF NODE=9000
0., 0., {LENGTH}, 0., 0., -1.
*OBSTACLE, NAME=LOW, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.5
*CONTACT PAIR, INTERACTION=I
B-ZMAX, UP
*CONTACT PAIR, INTERACTION=I
B-ZMIN, LOW
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
{sides}
*CLOAD
9000, 3, {-load!r}
*END STEP
"""


STACK = """\
*BLOCK, NAME=L, ELSET=B, TYPE=C3D8I, NX=1, NY=1, NZ=6
0., 0., 0., 1., 1., 5.
*BLOCK, NAME=A, ELSET=B, TYPE=C3D8I, NX=1, NY=1, NZ=6
0., 0., 5., 1., 1., 5.
*MATERIAL, NAME=M
*ELASTIC
200., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
0.9
*CONTACT PAIR, INTERACTION=I
A-ZMIN, L-ZMAX
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
L-ZMIN, 1, 3
*CLOAD
A-ZMAX, 3, {load!r}
*END STEP
"""


class Free(unittest.TestCase):
    """Bodies and plates that supports do not hold: contact may hold them, nothing else does."""

    def test_a_column_between_plates(self):
        """Friction clamps both ends: 4 pi^2 EI/L^2; pi^2 EI/L^2 where a plate may go sideways."""
        euler = pi**2 * YOUNG / 12 / LENGTH**2
        for sides, times in (("9000, 1, 2", 4), ("9000, 4, 6", 1)):
            for part in (0.9, 1.1):
                run = Run(between_plates(part * times * euler, sides), name="plates")
                self.assertEqual(run.status, 0 if part < 1 else 2, (sides, part, run.errors))
                if part > 1:
                    self.assertIn("the equilibrium is unstable (2 motions", run.errors)

    def test_a_column_of_two_blocks(self):
        """The upper half stands on the lower one, and no point slides. pi^2 EI/4L^2."""
        for part in (0.9, 1.1):
            euler = pi**2 * 200 / 12 / 400
            run = Run(STACK.format(load=-part * euler / 4), name="stack")
            self.assertEqual(run.status, 2 if part > 1 else 0, run.errors)
            self.assertEqual("is unstable (2 motions" in run.errors, part > 1, run.errors)

    def test_supports_on_both_sides_of_a_pair(self):
        """Plane strain holds both blocks across: where they stick, contact has no row across."""
        run = Run(PLANE_PAIR, name="pair")
        self.assertEqual(run.status, 0, run.errors)
        self.assertNotIn("unstable", run.output)


def ring(part, radius=1.0, thick=0.05, turned=0.0, length=1.0):
    """Deck of a quarter of a ring under a part of 3 EI/R^3 from outside, in plane strain.

    `turned` about its axis [radians], all lengths times `length`.
    """
    n, outer = 16, radius + thick / 2

    def shape(at):
        angle, r = turned + pi / 2 * at[0], radius + thick * (at[2] - 0.5)
        return length * r * np.cos(angle), length * r * np.sin(angle), length * thick * at[1]

    mesh, index, _ = grid("ALL", (n, 1, 1), shape)
    ends = ""
    for name, row, angle in (("FIRST", index[0], turned), ("LAST", index[-1], turned + pi / 2)):
        c, s = float(np.cos(angle)), float(np.sin(angle))
        ends += f"*NSET, NSET={name}\n" + "\n".join(map(str, row.ravel()))
        ends += f"\n*TRANSFORM, NSET={name}\n{c!r}, {s!r}, 0., {-s!r}, {c!r}, 0.\n"
    pressure = part * 3 * YOUNG * thick**3 / 12 / (radius**2 * outer)
    faces = "\n".join(f"{e}, S2" for e in range(1, n + 1))
    return f"""\
*PARAMETER
element = C3D8I
{mesh}{ends}*SURFACE, NAME=OUT
{faces}
*MATERIAL, NAME=M
*ELASTIC
{YOUNG}, 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.25, 1.
*BOUNDARY
ALL, 3, 3
FIRST, 2, 2
LAST, 2, 2
*DSLOAD
OUT, P, {pressure!r}
*END STEP
"""


class Pressed(unittest.TestCase):
    """Pressures follow the body: their stiffness counts where they have an energy."""

    def test_rings(self):
        """3 EI/R^3; a pressure that kept its direction would take 4 EI/R^3, and a column less."""
        for options in ({}, {"turned": 0.6, "length": 1e3}):
            for part in (0.95, 1.06):
                run = Run(ring(part, **options), name="ring")
                self.assertEqual(run.status, 0 if part < 1 else 2, (part, options, run.errors))
                if part > 1:
                    self.assertIn("the equilibrium is unstable (1 motion of", run.errors)

    def test_a_pressure_without_an_energy(self):
        """A bar under pressure on one end, whose edge moves: what buckles it is a note."""
        euler = pi**2 * YOUNG / 12 / LENGTH**2
        text = column(0.0).replace("B-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.0\n", "*DSLOAD\nB-ZMAX, P, {}\n")
        # Beck's column: the force follows, and no equilibrium nearby is lost at any load.
        run = Run(text.format(1.1 * euler / 4), name="beck")
        self.assertEqual(run.status, 0, run.errors)

    def test_pressures_on_all_sides(self):
        """They hold a column that the one on its end alone would buckle, step after step."""
        text = column(0.0).replace("B-ZMAX, 1, 2\nB-ZMAX, 3, 3, -0.0\n*END STEP\n", "*DSLOAD\n")
        sides = ("XMIN", "XMAX", "YMIN", "YMAX", "ZMAX")
        text += "".join(f"B-{side}, P, 3.\n" for side in sides) + "*END STEP\n"
        text += "*STEP\n*STATIC\n1., 1.\n*CLOAD\nB-ZMAX, 1, 1e-5\n*END STEP\n"
        text += "*STEP\n*STATIC\n1., 1.\n*DSLOAD, OP=NEW\n*END STEP\n"
        run = Run(text, name="pressed")
        self.assertEqual(run.status, 0, run.errors)
        self.assertNotIn("unstable", run.output)


class Posts(unittest.TestCase):
    """Frictionless posts, as the Hessian of the Lagrangian of another program says.

    Without the curvature of contact the bowl has two unstable motions everywhere, the dome none.
    """

    def test_bowl_and_dome(self):
        for obstacle, press, is_stable in (
            ("flat", 0.06, True), ("flat", 0.08, False), ("bowl", 0.04, True), ("bowl", 0.14, True),
            ("dome", 0.08, True), ("dome", 0.1, False),
        ):
            run = Run(post(obstacle, press), name="post")
            self.assertEqual(run.status, 0 if is_stable else 2, (obstacle, press, run.errors))
            if not is_stable:
                self.assertIn("unstable (2 motions", run.errors)
        self.assertEqual(Run(post("bowl", 0.14, radius=5.0), name="post").status, 2)

    def test_faces_with_mid_side_nodes(self):
        """The critical strokes of C3D8, 4 x 4 x 16 elements, are .0523, .1445 and .0648.

        It is still too stiff. A straight post that slides at its foot and is clamped above has
        pi^2 EI/L^2, at .051, as elements of second order say.
        """
        for element in ("C3D10", "C3D20R"):
            for obstacle, stroke in (("flat", 0.0514), ("bowl", 0.14), ("dome", 0.063)):
                for part in (0.93, 1.07):
                    with self.subTest(element=element, obstacle=obstacle, part=part):
                        run = Run(second_order_post(element, obstacle, part * stroke), name="post")
                        self.assertEqual(run.status, 0 if part < 1 else 2, run.errors)
                        if part > 1:
                            self.assertIn("unstable (2 motions", run.errors)

    def test_dead_loads_turn_a_free_body(self):
        """Between smooth plates it may turn: pushed from both sides it does, pulled it stays."""
        for pull in (-1.0, 1.0):
            run = Run(f"""\
*BLOCK, NAME=B, NX=2, NY=2, NZ=2
0., 0., 0., 1., 1., 1.
*NODE, NSET=R
9999, 0.5, 0.5, 3.
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
192., 0.0024
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*OBSTACLE, NAME=TOOL, TYPE=PLANE, REF NODE=9999
0., 0., 1., 0., 0., -1.
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
B-ZMAX, TOOL
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
9999, 1, 2
9999, 3, 3, -0.02
*CLOAD
B-XMIN, 1, {-pull}
B-XMAX, 1, {pull}
*END STEP
""", name="deck")
            self.assertEqual(run.status, 0 if pull > 0 else 2, run.errors)
            self.assertEqual("the equilibrium is unstable (1 motion" in run.errors, pull < 0)

    def test_friction_holds(self):
        """A foot that spreads slides outwards on all sides, and some of it across any sway."""
        for press, element in ((0.08, "C3D8"), (0.12, "C3D8I")):
            run = Run(post("flat", press, friction=0.3), name="post", element=element)
            self.assertEqual(run.status, 0, run.errors)
            self.assertNotIn("unstable", run.output)
        # A small force across it moves the foot by little: 0.11 of what it is of E = 1, length 1.
        # Without friction, at 0.9 of the critical stroke, it is 255.
        foot = "\n".join(map(str, grid("ALL", (2, 2, 4), list)[1][:, :, 0].ravel()))
        force = f"*STEP, NLGEOM\n*STATIC\n*CLOAD\nFOOT, 1, {1e-4 / 9}\n*END STEP\n"
        deck = post("flat", 0.12, friction=0.3).replace(
            "*SURFACE", f"*NSET, NSET=FOOT\n{foot}\n*SURFACE", 1)
        run = Run(deck + force, name="post", element="C3D8I")
        with run.result() as result:
            sways = [result.field("displacement", row)[:, 0] for row in result.step_ends]
        self.assertLess(abs(sways[1] - sways[0]).max(), 1e-4)

    def test_a_foot_that_slides_along_the_sway(self):
        """Held across, both edges of a foot slide along the only way it can sway: a note."""
        run = Run("""\
*BLOCK, NAME=B, TYPE=C3D8I, NX=1, NY=1, NZ=8
0., 0., 0., 1., 1., 8.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=FLOOR, TYPE=PLANE
0., 0., 0., 0., 0., 1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.05
*CONTACT PAIR, INTERACTION=I
B-ZMIN, FLOOR
*STEP, NLGEOM
*STATIC
0.5, 1.
*BOUNDARY
B-ZMAX, 1
B-YMIN, 2
B-YMAX, 2
B-ZMAX, 3, 3, -0.2
*END STEP
""", name="deck")
        self.assertEqual(run.status, 0, run.errors)
        self.assertIn("the equilibrium may be unstable (1 motion", run.output)


class Continued(unittest.TestCase):
    """A run that is continued finds the modes of C3D8I anew."""

    def test_a_run_cut_in_two_is_the_same(self):
        """A cantilever bent by half of its length: to 1e-7 of that, where 1e-8 is balanced."""
        deck = """\
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8I, NX=8, NY=1, NZ=1
0., 0., 0., 8., 1., 1.
*MATERIAL, NAME=M
*HYPERELASTIC, NEO HOOKE
200., 1e-4
*SOLID SECTION, ELSET=B, MATERIAL=M
*STEP, NLGEOM
*STATIC
0.05, 1.
*BOUNDARY
B-XMIN, 1, 3
B-XMAX, 3, 3, 4.
*END STEP
"""
        whole = Run(deck, name="deck")
        self.assertEqual(whole.status, 0, whole.errors)
        continued = Run(deck, "--continue", name="deck", ended_at=("1", "8"))
        self.assertEqual(continued.status, 0, continued.errors)
        with continued.result() as one, whole.result() as other:
            np.testing.assert_allclose(
                one.field("displacement", -1), other.field("displacement", -1), atol=4e-7
            )


if __name__ == "__main__":
    unittest.main()
