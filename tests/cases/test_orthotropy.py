"""Materials that are not isotropic: closed forms, mistakes in their constants."""

import math
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from boxes import DRY, FLOOR, Box
from program import Run
from two_bodies import solved

KINDS = ("C3D8", "C3D8I", "C3D8B", "C3D6", "C3D4", "C3D5", "C3D10", "C3D15", "C3D20", "C3D20R")
WOOD = (11000.0, 900.0, 500.0, 0.4, 0.45, 0.5, 800.0, 700.0, 90.0)
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # XX YY ZZ XY YZ XZ
PRESSURE = 5.0


def stiffness(constants=WOOD):
    """Return C along the material's axes, of engineering strains XX YY ZZ XY YZ XZ."""
    e1, e2, e3, nu12, nu13, nu23, g12, g13, g23 = constants
    s = np.diag([1 / e1, 1 / e2, 1 / e3, 1 / g12, 1 / g23, 1 / g13])
    s[0, 1] = s[1, 0] = -nu12 / e1
    s[0, 2] = s[2, 0] = -nu13 / e1
    s[1, 2] = s[2, 1] = -nu23 / e2
    return np.linalg.inv(s)


def turned(c, axes):
    """Return C along x, y, z of that along axes, the columns of a matrix."""
    tensor = np.zeros((3, 3, 3, 3))
    for i, (a, b) in enumerate(PAIRS):
        for j, (p, q) in enumerate(PAIRS):
            tensor[[a, b, a, b], [b, a, b, a], [p, p, q, q], [q, q, p, p]] = c[i, j]
    tensor = np.einsum("ip,jq,kr,ls,pqrs->ijkl", axes, axes, axes, axes, tensor)
    return np.array([[tensor[a + b] for b in PAIRS] for a in PAIRS])


def cards(kind="ENGINEERING CONSTANTS", constants=WOOD, name="STEEL"):
    """Return *MATERIAL and *ELASTIC with eight constants on a line."""
    numbers = [repr(float(x)) for x in constants]
    lines = "\n".join(", ".join(numbers[i:i + 8]) for i in range(0, len(numbers), 8))
    return f"*MATERIAL, NAME={name}\n*ELASTIC, TYPE={kind}\n{lines}\n"


def upper(c):
    """Return the upper triangle of C, 11 22 33 12 13 23 column by column."""
    c = c[np.ix_([0, 1, 2, 3, 5, 4], [0, 1, 2, 3, 5, 4])]
    return [c[i, j] for j in range(6) for i in range(j + 1)]


class OffItsAxes(unittest.TestCase):
    """A block on a floor whose axes are aslant; its strain is the same all over."""

    AXES = "1., 1., 0.5, -1., 2., 0.3, 0., 0., 0.\n2, 25."

    def axes(self):
        """Return the axes of AXES, columns."""
        first = np.array([1, 1, 0.5]) / np.linalg.norm([1, 1, 0.5])
        third = np.cross(first, [-1, 2, 0.3])
        third /= np.linalg.norm(third)
        axes = np.array([first, np.cross(third, first), third]).T
        turn = math.radians(25)
        about_2 = [[math.cos(turn), 0, math.sin(turn)], [0, 1, 0], [-math.sin(turn), 0,
                                                                    math.cos(turn)]]
        return axes @ about_2

    STRAIN = np.array([[2.0, -0.7, 0.6], [-0.7, -1.0, 0.9], [0.6, 0.9, -8.0]]) * 1e-3

    def pressed(self, kind, material, c, orientation=", ORIENTATION=O", options=""):
        """Give the outside of a block of distorted elements one strain; the floor is below it."""
        box = Box("B", (2, 2, 2), (kind if kind[-1] not in "IB" else "C3D8",))
        outside = np.any((box.x == 0) | (box.x == 1), axis=1)
        way = 2 * np.triu(self.STRAIN, 1) + np.diag(np.diag(self.STRAIN))
        motion = ""
        for i in np.flatnonzero(outside):
            for dof, of in enumerate(way @ box.x[i], 1):
                if dof < 3 or box.x[i, 2] > 0:
                    motion += f"{1 + i}, {dof}, {dof}, {of!r}\n"
        text = box.cards().replace("TYPE=C3D8,", f"TYPE={kind},")
        result = solved(
            self,
            text.replace("MATERIAL=STEEL", "MATERIAL=STEEL" + orientation) + material
            + f"*ORIENTATION, NAME=O\n{self.AXES}\n" + DRY + FLOOR
            + f"*STEP{options}\n*STATIC\n*BOUNDARY\n{motion}*END STEP\n",
        )
        stress = c @ [self.STRAIN[i, j] * (1 + (i != j)) for i, j in PAIRS]
        u = result.field("displacement", -1)
        np.testing.assert_allclose(u, box.x @ way.T, rtol=0, atol=1e-12)
        self.assertAlmostEqual(result.pairs[0].resultant[-1][2], -stress[2], delta=1e-9 * 30)
        # What acts on the outside, times where it acts: the stress times the volume.
        force = result.field("reaction_force", -1) + result.field("contact_force", -1)
        moment = box.x.T @ force
        np.testing.assert_allclose(moment, np.array([
            [stress[0], stress[3], stress[5]], [stress[3], stress[1], stress[4]],
            [stress[5], stress[4], stress[2]]]), rtol=0, atol=1e-9 * 30)
        return result

    def test_all_elements_have_the_stress_of_the_strain(self):
        c = turned(stiffness(), self.axes())
        for kind in KINDS:
            with self.subTest(kind=kind):
                self.pressed(kind, cards(), c)

    def test_constants_of_all_types_say_the_same(self):
        """Of the material's axes, and along x, y, z, where it has 21 constants."""
        c = stiffness()
        ortho = [upper(c)[i] for i in (0, 1, 2, 3, 4, 5, 9, 14, 20)]
        along = turned(c, self.axes())
        self.pressed("C3D8", cards("ORTHOTROPIC", ortho), along)
        self.pressed("C3D8", cards("ANISOTROPIC", upper(c)), along)
        self.pressed("C3D8", cards("ANISO", upper(along)), along, orientation="")


class Presses(unittest.TestCase):
    """A cube between three floors and three presses, whose axes are x, y and z in another order."""

    def test_forces_by_the_stiffness(self):
        closing = np.array([1.0, 2.0, 3.0]) * 1e-3
        axes = np.eye(3)[:, [1, 2, 0]]  # axis 1 along y, 2 along z, 3 along x
        box = Box("B", (2, 2, 2), ("C3D20R",))
        pairs, motion = "", ""
        for i, axis in enumerate("XYZ"):
            normal = ", ".join(str(float(n)) for n in np.eye(3)[i])
            pairs += (f"*OBSTACLE, NAME=FLOOR-{axis}, TYPE=PLANE\n0., 0., 0., {normal}\n"
                      f"*CONTACT PAIR, INTERACTION=DRY\nB-{axis}0, FLOOR-{axis}\n")
            motion += f"B-{axis}1, {i + 1}, {i + 1}, {-closing[i]!r}\n"
        result = solved(
            self,
            box.cards().replace("MATERIAL=STEEL", "MATERIAL=STEEL, ORIENTATION=O") + cards()
            + "*ORIENTATION, NAME=O\n0., 1., 0., 0., 0., 1.\n" + DRY + pairs
            + f"*STEP\n*STATIC\n*BOUNDARY\n{motion}*END STEP\n",
        )
        force = turned(stiffness(), axes)[:3, :3] @ closing
        for i in range(3):
            found = result.pairs[i].resultant[-1][i]
            self.assertAlmostEqual(found, force[i], delta=1e-9 * force[i])


class Cylinder(unittest.TestCase):
    """A ring under pressure in a rigid sleeve, of radial and tangential moduli (Lekhnitskii)."""

    IN, OUT = 1.0, 2.0
    RINGS = (600.0, 9000.0, 800.0, 0.02, 0.2, 0.3, 700.0, 100.0, 90.0)  # radial, tangential, axial

    def pressure(self):
        """Return the pressure on the sleeve of a pressure inside, in plane strain."""
        c = stiffness(self.RINGS)
        k = math.sqrt(c[1, 1] / c[0, 0])
        a, b = self.IN, self.OUT

        def radial(power, r):
            return (power * c[0, 0] + c[0, 1]) * r ** (power - 1)

        motion = np.linalg.solve([[radial(k, a), radial(-k, a)], [b**k, b**-k]], [-PRESSURE, 0])
        return -(motion @ [radial(k, b), radial(-k, b)])

    def solve(self, kind, cells, shape, constants, orientation, sleeve, held):
        """Return the result of a ring, cells across and around; shape: places by both."""
        n, number, nodes, elements = cells, {}, [], []
        for j in range(2 * n[1] + 1):
            for i in range(2 * n[0] + 1):
                if i % 2 and j % 2:
                    continue
                number[i, j] = len(number) + 1
                x, y = shape(i / 2 / n[0], j / 2 / n[1])
                nodes.append(f"{number[i, j]}, {x!r}, {y!r}")
        around = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
        for j in range(n[1]):
            for i in range(n[0]):
                corners = [number[2 * i + a, 2 * j + b] for a, b in around]
                elements.append(", ".join(map(str, [1 + i + j * n[0], *corners])))
        inside = "\n".join(str(1 + j * n[0]) for j in range(n[1]))
        outside = "\n".join(str(n[0] + j * n[0]) for j in range(n[1]))
        low = ",\n".join(str(v) for (_, j), v in number.items() if j == 0)
        high = ",\n".join(str(v) for (_, j), v in number.items() if j == 2 * n[1])
        return solved(
            self,
            "*NODE\n" + "\n".join(nodes) + f"\n*ELEMENT, TYPE={kind}, ELSET=B\n"
            + "\n".join(elements) + f"\n*ELSET, ELSET=IN\n{inside}\n*ELSET, ELSET=OUT\n{outside}\n"
            f"*NSET, NSET=LOW\n{low}\n*NSET, NSET=HIGH\n{high}\n"
            "*SURFACE, NAME=OUTSIDE\nOUT, S2\n" + cards(constants=constants)
            + f"*SOLID SECTION, ELSET=B, MATERIAL=STEEL{orientation}\n1.\n"
            f"*OBSTACLE, NAME=SLEEVE, TYPE=CYLINDER, INNER\n{sleeve}\n" + DRY
            + "*CONTACT PAIR, INTERACTION=DRY\nOUTSIDE, SLEEVE\n"
            f"*STEP\n*STATIC\n*BOUNDARY\n{held}*DLOAD\nIN, P4, {PRESSURE!r}\n*END STEP\n",
        )

    def test_a_quarter_in_plane_strain(self):
        def place(across, around):
            r, angle = self.IN + (self.OUT - self.IN) * across, math.pi / 2 * around
            return (0.0 if around == 1 else r * math.cos(angle)), r * math.sin(angle)

        errors = []
        for n in (4, 8):
            result = self.solve("CPE8R", (n, n), place, self.RINGS, ", ORIENTATION=RINGS\n"
                                "*ORIENTATION, NAME=RINGS, SYSTEM=CYLINDRICAL\n"
                                "0., 0., 0., 0., 0., 1.\n*SOLID SECTION, ELSET=B, MATERIAL=STEEL, "
                                "ORIENTATION=RINGS", "0., 0., 0., 0., 0., 1., 2.",
                                "LOW, 2\nHIGH, 1\n")
            force = result.pairs[0].resultant[-1]
            found = np.hypot(force[0], force[1]) / (math.sqrt(2) * self.OUT)
            errors.append(abs(found / self.pressure() - 1))
        self.assertLess(errors[1], 4e-3)
        self.assertLess(errors[1], 0.3 * errors[0])

    def test_a_body_of_revolution(self):
        """The same in the plane of radius and axis, where axis 3 goes around."""
        constants = (600.0, 800.0, 9000.0, 0.2, 0.02, 0.3 * 800 / 9000, 100.0, 700.0, 90.0)
        errors = []
        for n in (4, 8):
            result = self.solve("CAX8R", (n, 1), lambda a, b: (
                self.IN + (self.OUT - self.IN) * a, 0.25 * b), constants, "",
                "0., 0., 0., 0., 1., 0., 2.", "LOW, 2\nHIGH, 2\n")
            found = result.pairs[0].normal_sum[-1] / (2 * math.pi * self.OUT * 0.25)
            errors.append(abs(found / self.pressure() - 1))
        self.assertLess(errors[1], 1e-4)
        self.assertLess(errors[1], 0.3 * errors[0])


class Warmth(unittest.TestCase):
    """Between rigid plates that do not give, warmth presses with C : I alpha dT."""

    def test_forces_of_a_warm_cube(self):
        axes = np.eye(3)[:, [1, 2, 0]]
        force = turned(stiffness(), axes)[:3, :3].sum(axis=1) * 1e-5 * 80
        for kind in ("C3D8", "C3D8I", "C3D10"):
            box = Box("B", (2, 2, 2), (kind.rstrip("I"),))
            result = solved(
                self,
                box.cards().replace("MATERIAL=STEEL", "MATERIAL=STEEL, ORIENTATION=O")
                .replace("TYPE=C3D8,", f"TYPE={kind},") + cards() + "*EXPANSION\n1e-5\n"
                "*ORIENTATION, NAME=O\n0., 1., 0., 0., 0., 1.\n" + DRY + FLOOR
                + "*NSET, NSET=ALL, GENERATE\n1, " + str(len(box.x)) + "\n"
                "*STEP\n*STATIC\n*BOUNDARY\nB-X0, 1\nB-X1, 1\nB-Y0, 2\nB-Y1, 2\nB-Z1, 3\n"
                "*TEMPERATURE\nALL, 80.\n*END STEP\n",
            )
            with self.subTest(kind=kind):
                self.assertAlmostEqual(result.pairs[0].resultant[-1][2] / force[2], 1, delta=1e-9)
                side = np.isclose(box.x[:, 0], 0)
                pushed = result.field("reaction_force", -1)[side, 0].sum()
                self.assertAlmostEqual(pushed / force[0], 1, delta=1e-9)


class FiniteStrain(unittest.TestCase):
    """Green's strain about the undeformed axes: P = F C : E, of a stretch with shear."""

    def test_stress_of_a_homogeneous_motion(self):
        axes = np.eye(3)[:, [1, 2, 0]]
        c = turned(stiffness(), axes)
        h = np.array([[0.06, 0.1, 0.05], [0.0, -0.03, 0.02], [0.0, 0.0, -0.1]])
        green = 0.5 * (h + h.T + h.T @ h)
        s = c @ [green[i, j] * (1 + (i != j)) for i, j in PAIRS]
        first = (np.eye(3) + h) @ np.array([[s[0], s[3], s[5]], [s[3], s[1], s[4]],
                                            [s[5], s[4], s[2]]])
        for kind in ("C3D8I", "C3D20R"):
            box = Box("B", (2, 2, 2), (kind.rstrip("I"),))
            outside = np.any((box.x == 0) | (box.x == 1), axis=1)
            motion = "".join(
                f"{1 + i}, {dof}, {dof}, {of!r}\n" for i in np.flatnonzero(outside)
                for dof, of in enumerate(h @ box.x[i], 1) if dof < 3 or box.x[i, 2] > 0
            )
            result = solved(
                self,
                box.cards().replace("MATERIAL=STEEL", "MATERIAL=STEEL, ORIENTATION=O")
                .replace("TYPE=C3D8,", f"TYPE={kind},") + cards()
                + "*ORIENTATION, NAME=O\n0., 1., 0., 0., 0., 1.\n" + DRY + FLOOR
                + f"*STEP, NLGEOM\n*STATIC\n0.5, 1.\n*BOUNDARY\n{motion}*END STEP\n",
            )
            with self.subTest(kind=kind):
                force = result.field("reaction_force", -1) + result.field("contact_force", -1)
                np.testing.assert_allclose(force.T @ box.x, first, rtol=0, atol=1e-7 * 1e3)


@unittest.skipUnless(shutil.which("ccx"), "CalculiX (ccx) is not installed")
class BesideCalculiX(unittest.TestCase):
    """A beam of distorted elements, loaded aslant: the displacements of CalculiX, which has six
    digits of them; at finite strain it ends where its own tolerance says.
    """

    ASLANT = ("\n1., 1., 0.5, -1., 2., 0.3\n3, 20.", (0.0, 0.1, -0.2))
    RINGS = (", SYSTEM=CYLINDRICAL\n-1., 0.4, 0., -1., 0.5, 1.", (0.1, 0.0, -0.2))
    FULL = (100.0, 50.0, 90.0, 40.0, 30.0, 80.0, 3.0, 2.0, 1.0, 20.0, 4.0, -2.0, 1.0, 2.0, 25.0,
            1.0, 2.0, -3.0, 1.0, 2.0, 30.0)
    ORTHO = (12000.0, 900.0, 1200.0, 500.0, 400.0, 800.0, 800.0, 700.0, 90.0)

    def compare(self, kind, constants, axes, nlgeom="", within=5e-6):
        orientation, force = axes
        box = Box("B", (4, 2, 2), (kind,), size=(2, 1, 1))
        text = box.cards().replace("MATERIAL=STEEL", "MATERIAL=STEEL, ORIENTATION=O")
        text = re.sub(r"[*]SURFACE, NAME=.*\n.*\n", "", text)
        # ccx reads sixteen numbers of a line.
        text = re.sub(r"((?:\d+, ){10}\d+), (\d+(?:, \d+){5,})\n", r"\1,\n\2\n", text)
        share = 2.0 if nlgeom else 1.0
        loads = "".join(f"{n}, {dof}, {share * f!r}\n" for n in box.side(0, 1)
                        for dof, f in enumerate(force, 1) if f)
        text += (constants + f"*ORIENTATION, NAME=O{orientation}\n*BOUNDARY\nB-X0, 1, 3\n"
                 f"*STEP{nlgeom}\n*STATIC\n1., 1.\n*CLOAD\n{loads}*NODE FILE\nU\n*END STEP\n")
        run = Run(text, name="deck")
        self.assertEqual(run.status, 0, run.errors)
        with tempfile.TemporaryDirectory() as folder, run.result() as result:
            (Path(folder) / "beam.inp").write_text(text)
            subprocess.run(["ccx", "beam"], cwd=folder, capture_output=True, check=True,
                           timeout=100)
            theirs = self.displacements(Path(folder) / "beam.frd")
            ours = result.field("displacement", -1)
        expected = np.array([theirs[n] for n in range(1, len(box.x) + 1)])
        np.testing.assert_allclose(ours, expected, rtol=0, atol=within * abs(expected).max())

    def displacements(self, path):
        """Return the last displacements of a .frd file by node."""
        found, inside = {}, False
        for line in path.read_text().splitlines():
            if line.startswith(" -4"):
                inside = line.split()[1] == "DISP"
            elif inside and line.startswith(" -1"):
                found[int(line[3:13])] = [float(line[13 + 12 * i:25 + 12 * i]) for i in range(3)]
        return found

    def test_displacements(self):
        for kind, constants, axes in (
            ("C3D8", cards(), self.ASLANT),
            ("C3D20R", cards(), self.ASLANT),
            ("C3D10", cards("ORTHO", self.ORTHO), self.ASLANT),
            ("C3D20", cards(), self.RINGS),
            ("C3D10", cards("ORTHO", self.ORTHO), self.RINGS),
            ("C3D20R", cards("ANISO", self.FULL), self.ASLANT),
        ):
            with self.subTest(kind=kind, constants=constants):
                self.compare(kind, constants, axes)

    def test_displacements_at_finite_strain(self):
        self.compare("C3D20R", cards(), self.ASLANT, ", NLGEOM", 2e-4)
        self.compare("C3D10", cards("ORTHO", self.ORTHO), self.ASLANT, ", NLGEOM", 2e-4)


class Mistakes(unittest.TestCase):
    def said(self, material, orientation="", section=""):
        """Return what is said of a deck that is refused, in one message."""
        box = Box("B", (1, 1, 1), ("C3D8",))
        run = Run(box.cards().replace("MATERIAL=STEEL", "MATERIAL=STEEL" + section) + material
                  + orientation + DRY + FLOOR + "*STEP\n*STATIC\n*BOUNDARY\nB-Z1, 1, 3, 0.\n"
                  "*END STEP\n", name="deck")
        self.assertEqual(run.status, 1, run.errors)
        self.assertEqual(run.errors.count("error:"), 1, run.errors)
        return run.errors

    def test_constants_without_energy_are_named(self):
        def but(i, value):
            return cards(constants=[*WOOD[:i], value, *WOOD[i + 1:]])

        self.assertIn("E2 must be positive, not -900", self.said(but(1, -900.0)))
        self.assertIn("G23 must be positive, not 0", self.said(but(8, 0.0)))
        self.assertIn("nu12 must lie between -3.496 and 3.496, not 3.6", self.said(but(3, 3.6)))
        self.assertIn("nu12, nu13 and nu23 are too large together", self.said(
            cards(constants=[100.0, 100.0, 100.0, 0.6, 0.6, 0.6, 40.0, 40.0, 40.0])))
        ortho = [100.0, 50.0, 90.0, 40.0, 30.0, 80.0, 20.0, 20.0, 20.0]
        self.assertIn("D2222 must be more than 25, not 20", self.said(
            cards("ORTHO", [*ortho[:2], 20.0, *ortho[3:]])))
        self.assertIn("D2323 must be positive, not -1", self.said(cards("ORTHO", [*ortho[:8], -1])))
        self.assertIn("needs G23 on its next line", self.said(cards(constants=WOOD[:8])))
        self.assertIn("LAW applies to isotropic", self.said(cards("ORTHO, LAW=SVK", ortho)))
        self.assertIn("TYPE must be ", self.said(cards("LAMINA")))

    def test_orientations(self):
        named = ", ORIENTATION=O"
        start = "*ORIENTATION, NAME=O"
        self.assertIn("orientation 'O' is not defined", self.said(cards(), section=named))
        for lines, said in (
            ("\n1., 0., 0., 2., 0., 0.", "lie on a line with the origin"),
            (", SYSTEM=CYLINDRICAL\n1., 0., 0., 1., 0., 0.", "the two points are one"),
            (", SYSTEM=CYLINDRICAL\n0.5, 0.5, 0., 0.5, 0.5, 1.", "no direction is radial"),
            (", SYSTEM=SPHERICAL\n0., 0., 0., 0., 0., 1.", "SYSTEM must be"),
            ("\n1., 0., 0., 0., 1., 0.\n4, 20.", "an axis is 1, 2 or 3"),
            ("", "*ORIENTATION needs a line"),
        ):
            with self.subTest(lines=lines):
                self.assertIn(said, self.said(cards(), f"{start}{lines}\n", named))
        self.assertIn("NLGEOM does not cover materials that are not isotropic", self.finite())

    def test_axes_that_go_around_do_not_expand_everywhere(self):
        for kind in ("C3D8I", "C3D8B"):
            box = Box("B", (1, 1, 1), ("C3D8",))
            run = Run(box.cards().replace("=STEEL", "=STEEL, ORIENTATION=O")
                      .replace("TYPE=C3D8,", f"TYPE={kind},") + cards() + "*EXPANSION\n1e-5\n"
                      "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n-1., 0., 0., -1., 0., 1.\n" + DRY
                      + FLOOR + "*STEP\n*STATIC\n*BOUNDARY\nB-Z1, 1, 3, 0.\n*TEMPERATURE\n"
                      "B-Z0, 5.\n*END STEP\n", name="deck")
            self.assertEqual(run.status, 1, run.errors)
            self.assertIn("do not expand in elements computed as C3D8I", run.errors)

    def finite(self):
        """Return what is said of cylindrical axes at finite strain."""
        box = Box("B", (1, 1, 1), ("C3D8",))
        run = Run(box.cards().replace("=STEEL", "=STEEL, ORIENTATION=O") + cards()
                  + "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n-1., 0., 0., -1., 0., 1.\n" + DRY
                  + FLOOR + "*STEP, NLGEOM\n*STATIC\n*BOUNDARY\nB-Z1, 1, 3, 0.\n*END STEP\n",
                  name="deck")
        self.assertEqual(run.status, 1, run.errors)
        return run.errors


if __name__ == "__main__":
    unittest.main()
