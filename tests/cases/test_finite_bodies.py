"""Several bodies at finite strain (*STEP, NLGEOM): closed forms, patch tests, turns, refusals."""

import unittest

import numpy as np
from program import Run
from scipy.optimize import brentq

E, NU = 200.0, 0.3
C10, D1 = E / (4 * (1 + NU)), 6 * (1 - 2 * NU) / E
NEO = f"*HYPERELASTIC, NEO HOOKE\n{C10!r}, {D1!r}"
SVK = f"*ELASTIC\n{E}, {NU}"


def nominal_stresses(along, across):
    """First Piola-Kirchhoff stress of the neo-Hookean law along and across a uniaxial stretch."""
    volume = along * across**2
    squares = along**2 + 2 * across**2
    pressure = 2 / D1 * (volume - 1) * volume
    return [
        (2 * C10 * volume ** (-2 / 3) * (stretch**2 - squares / 3) + pressure) / stretch
        for stretch in (along, across)
    ]


def uniaxial(stretch):
    """Stress on the undeformed area, and the stretch across."""
    across = brentq(lambda a: nominal_stresses(stretch, a)[1], 0.8, 2.0, xtol=1e-15)
    return nominal_stresses(stretch, across)[0], across


# One block on another, [0, 2] x [0, 1] x [0, 1] and [1, 2], on symmetry planes.
STACK = """\
*BLOCK, NAME=L, NX={lower[0]}, NY={lower[1]}, NZ={lower[2]}, TYPE=C3D8
0., 0., 0., 2., 1., 1.
*BLOCK, NAME=A, NX={upper[0]}, NY={upper[1]}, NZ={upper[2]}, TYPE=C3D8
0., 0., 1., 2., 1., 1.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=A, MATERIAL=M
*SOLID SECTION, ELSET=L, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I{options}
A-ZMIN, L-ZMAX
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP, NLGEOM
*STATIC
0.1, 1.
*EL FILE
S
*BOUNDARY
A-XMIN, 1, 1
L-XMIN, 1, 1
A-YMIN, 2, 2
L-YMIN, 2, 2
L-ZMIN, 3, 3
A-ZMAX, 3, 3, {press}
*END STEP
"""


def stack(stretch, upper, lower, mu=0.0, options=""):
    """Press one block on another."""
    text = STACK.format(
        upper=upper, lower=lower, mu=mu, press=2 * (stretch - 1), law=NEO, options=options
    )
    return Run(text, name="stack")


# Three blocks on each other, the middle one of a mesh of its own and without supports; the rigid
# plate above them is pressed down by a displacement or by a force.
TOWER = """\
*BLOCK, NAME=L, NX=2, NY=2, NZ=1, TYPE=C3D8
0., 0., 0., 1., 1., 1.
*BLOCK, NAME=M, NX=3, NY=3, NZ=2, TYPE=C3D8
0., 0., 1., 1., 1., 1.
*BLOCK, NAME=U, NX=2, NY=2, NZ=1, TYPE=C3D8
0., 0., 2., 1., 1., 1.
*NODE
9000, 0., 0., 3.
*MATERIAL, NAME=M
{law}
*SOLID SECTION, ELSET=L, MATERIAL=M
*SOLID SECTION, ELSET=M, MATERIAL=M
*SOLID SECTION, ELSET=U, MATERIAL=M
*OBSTACLE, NAME=PLATE, TYPE=PLANE, REF NODE=9000
0., 0., 3., 0., 0., -1.
*SURFACE INTERACTION, NAME=ROUGH
*FRICTION
0.3
*SURFACE INTERACTION, NAME=SMOOTH
*CONTACT PAIR, INTERACTION=ROUGH
M-ZMIN, L-ZMAX
*CONTACT PAIR, INTERACTION=ROUGH
M-ZMAX, U-ZMIN
*CONTACT PAIR, INTERACTION=SMOOTH
U-ZMAX, PLATE
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP, NLGEOM
*STATIC
0.1, 1.
*EL FILE
E
*BOUNDARY
L-XMIN, 1, 1
L-YMIN, 2, 2
L-ZMIN, 3, 3
9000, 1, 2
{press}
*END STEP
"""


class Free(unittest.TestCase):
    """Bodies without supports, and obstacles under force."""

    def test_a_tower_of_blocks(self):
        """Contact alone holds two of three blocks, which are one column in uniaxial stress."""
        stress, _ = uniaxial(0.87)
        for press in (f"9000, 3, 3, {-3 * 0.13}", f"*CLOAD\n9000, 3, {stress}"):
            with self.subTest(press=press):
                run = Run(TOWER.format(law=NEO, press=press), name="tower")
                self.assertEqual(run.status, 0, run.errors)
                # Where bodies are pinned, and what the factor takes, depends on how they turn.
                self.assertRegex(run.plan, "factor +about")
                with run.result() as result:
                    for name in result.pairs:
                        force = result.pairs[name].resultant[-1]
                        self.assertAlmostEqual(abs(force[2]), -stress, delta=1e-6)
                    strain = result.field("strain", -1)
                np.testing.assert_allclose(strain[:, 2], np.log(0.87), rtol=1e-7)

    def test_a_tower_that_is_pressed_too_far(self):
        """From 16 % on a force to the right moves the top to the left: it would sway."""
        run = Run(TOWER.format(law=NEO, press=f"9000, 3, 3, {-3 * 0.2}"), name="tower")
        self.assertEqual(run.status, 2, run.errors)
        self.assertIn("unstable (2 motions of the body", run.errors)

    def test_a_block_between_plates_that_turn(self):
        """Friction alone holds a block between two rigid plates that turn by 90 degrees."""
        plates = ((9000, 0, 1), (9001, 1, -1))
        cards = [
            "*BLOCK, NAME=B, ELSET=B, NX=2, NY=2, NZ=2, TYPE=C3D8\n0., 0., 0., 1., 1., 1.",
            f"*MATERIAL, NAME=M\n{NEO}\n*SOLID SECTION, ELSET=B, MATERIAL=M",
            "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.5\n*CONTACT SOLVER, TOLERANCE=1e-11",
            "*CONTACT PAIR, INTERACTION=I\nB-ZMIN, P9000",
            "*CONTACT PAIR, INTERACTION=I\nB-ZMAX, P9001",
        ]
        for node, z, normal in plates:
            cards.append(f"*NODE\n{node}, 0., 0., 0.\n*OBSTACLE, NAME=P{node}, TYPE=PLANE, "
                         f"REF NODE={node}\n0., 0., {z}., 0., 0., {normal}.")
        for k, turn in enumerate((0, *range(10, 91, 10))):
            cards.append("*STEP, NLGEOM\n*STATIC, DIRECT" if k == 0 else "*STEP\n*STATIC, DIRECT")
            cards.append(f"{0.25 if k == 0 else 1.}, 1.\n*BOUNDARY\n9000, 1, 3")
            down = rotation(turn) @ [0, 0, -0.05]
            cards += [f"9001, {i + 1}, {i + 1}, {down[i]}" for i in range(3)]
            axis = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5]) * np.radians(turn)
            cards += [f"{p[0]}, {i + 4}, {i + 4}, {axis[i]}" for p in plates for i in range(3) if k]
            cards.append("*END STEP")
        run = Run("\n".join(cards) + "\n", name="plates")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            force = result.pairs[0].resultant
        for k in range(1, 10):
            back = rotation(10 * k).T @ force[3 + k]
            np.testing.assert_allclose(
                back, force[3], rtol=0, atol=1e-10 * np.abs(force[3]).max()
            )


# Cubes of unlike stiffness, one on the other, pressed and then sheared a little.
UNLIKE = """\
*BLOCK, NAME=A, ELSET=A, TYPE=C3D8, NX=2, NY=2, NZ=2
0., 0., 1.,  1., 1., 1.
*BLOCK, NAME=L, ELSET=L, TYPE=C3D8, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=SOFT
{soft}
*MATERIAL, NAME=HARD
{hard}
*SOLID SECTION, ELSET=A, MATERIAL=SOFT
*SOLID SECTION, ELSET=L, MATERIAL=HARD
{joint}
*CONTACT SOLVER, TOLERANCE=1e-10
*STEP, NLGEOM
*STATIC, DIRECT
{increment}, 1.
*BOUNDARY
L-ZMIN, 1, 3
A-ZMAX, 1, 2
A-ZMAX, 3, 3, -0.3
*END STEP
*STEP
*STATIC, DIRECT
{increment}, 1.
*BOUNDARY
A-ZMAX, 1, 1, 0.05
*END STEP
"""
STICKING = ("*SURFACE INTERACTION, NAME=I\n*FRICTION\n10.\n"
            "*CONTACT PAIR, INTERACTION=I\nA-ZMIN, L-ZMAX")


class Sticking(unittest.TestCase):
    """Contact that sticks everywhere holds bodies as a tie does, whatever the increments."""

    def test_it_is_a_tie(self):
        def end(joint, increments):
            hard = f"*HYPERELASTIC, NEO HOOKE\n{3 * C10!r}, {D1 / 3!r}"
            text = UNLIKE.format(soft=NEO, hard=hard, joint=joint, increment=1 / increments)
            with Run(text, name="cubes").result() as result:
                return result.reaction("A-ZMAX"), result.field("displacement")

        force, places = end("*TIE, NAME=T\nA-ZMIN, L-ZMAX", 2)
        for increments in (2, 5, 20):
            with self.subTest(increments=increments):
                found, moved = end(STICKING, increments)
                np.testing.assert_allclose(found, force, rtol=0, atol=1e-8 * abs(force).max())
                np.testing.assert_allclose(moved, places, rtol=0, atol=1e-9)


class PatchTest(unittest.TestCase):
    """Two blocks pressed together are one block, to any strain."""

    def test_uniaxial_compression(self):
        """Of alike meshes, and of meshes that do not match, to a stretch of 0.6."""
        meshes = (((2, 1, 1), (2, 1, 1)), ((4, 2, 1), (3, 1, 2)), ((3, 1, 2), (4, 2, 1)))
        for (upper, lower) in meshes:
            for mu in (0.0, 0.3):
                with self.subTest(upper=upper, lower=lower, mu=mu):
                    run = stack(0.6, upper, lower, mu)
                    self.assertEqual(run.status, 0, run.errors)
                    stress, across = uniaxial(0.6)
                    with run.result() as result:
                        force = result.pairs["A-ZMIN:L-ZMAX"].resultant[-1]
                        found = result.field("stress", -1)
                    np.testing.assert_allclose(force, [0, 0, -2 * stress], rtol=0, atol=1e-7)
                    np.testing.assert_allclose(found[:, 2], stress / across**2, rtol=1e-7)

    def test_small_sliding_is_ignored(self):
        force = []
        for options in (", SMALL SLIDING", ""):
            run = stack(0.6, (2, 1, 1), (3, 2, 1), mu=0.3, options=options)
            self.assertEqual(run.status, 0, run.errors)
            self.assertEqual("SMALL SLIDING is ignored" in run.output, options != "")
            with run.result() as result:
                force.append(result.pairs[0].force)
        np.testing.assert_array_equal(force[0], force[1])


def two_blocks(names):
    """Press blocks of the names, which do not touch each other, on the ground and push them."""
    cards = ["*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0., 0., 0., 1."]
    cards.append("*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3")
    steps = ["*STEP, NLGEOM\n*STATIC\n0.25, 1.\n*BOUNDARY", "*STEP\n*STATIC\n0.25, 1.\n*BOUNDARY"]
    laws = {"A": NEO, "B": SVK}
    for name, place, n in (("A", 0.0, 2), ("B", 1.5, 3)):
        if name not in names:
            continue
        cards.append(f"*BLOCK, NAME={name}, ELSET={name}, NX={n}, NY=2, NZ={n}, TYPE=C3D8")
        cards.append(f"{place}, 0., 0., 1., 1., 1.\n*MATERIAL, NAME={name}\n{laws[name]}")
        cards.append(f"*SOLID SECTION, ELSET={name}, MATERIAL={name}")
        cards.append(f"*CONTACT PAIR, INTERACTION=I\n{name}-ZMIN, GROUND")
        steps[0] += f"\n{name}-ZMAX, 1, 2\n{name}-ZMAX, 3, 3, -0.15"
        steps[1] += f"\n{name}-ZMAX, 1, 1, 0.2"
    cards.append("*CONTACT SOLVER, TOLERANCE=1e-10")
    return Run("\n".join(cards + [f"{step}\n*END STEP" for step in steps]) + "\n", name="blocks")


class Apart(unittest.TestCase):
    """Bodies that do not touch each other."""

    def test_each_is_as_if_it_were_alone(self):
        together = two_blocks("AB")
        self.assertEqual(together.status, 0, together.errors)
        for name in "AB":
            alone = two_blocks(name)
            self.assertEqual(alone.status, 0, alone.errors)
            with together.result() as both, alone.result() as one:
                found = [r.pairs[f"{name}-ZMIN:GROUND"].resultant[-1] for r in (both, one)]
            np.testing.assert_allclose(*found, rtol=0, atol=1e-8 * np.abs(found[1]).max())


def rotation(degrees):
    """Turn about the axis (1, 2, 0.5)."""
    axis = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5])
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def grid(name, first, n, low, high):
    """Return the cards of a block of n elements an edge, and its nodes by number."""
    cards, nodes, number = [f"*NODE, NSET={name}"], {}, {}
    for i, j, k in np.ndindex(n + 1, n + 1, n + 1):
        number[i, j, k] = first + len(nodes)
        x = low + (np.array(high) - low) * np.array([i, j, k]) / n
        nodes[number[i, j, k]] = x
        cards.append(", ".join(map(str, [number[i, j, k], *x.tolist()])))
    cards.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
    around = [(0, 0), (1, 0), (1, 1), (0, 1)]
    ends = {0: [], n - 1: []}
    for e, (i, j, k) in enumerate(np.ndindex(n, n, n)):
        of = [number[i + a, j + b, k + c] for c in (0, 1) for a, b in around]
        cards.append(", ".join(map(str, [first + e, *of])))
        if k in ends:
            ends[k].append(first + e)
    cards += [f"*SURFACE, NAME={name}-LOW, TYPE=ELEMENT", *(f"{e}, S1" for e in ends[0])]
    cards += [f"*SURFACE, NAME={name}-UP, TYPE=ELEMENT", *(f"{e}, S2" for e in ends[n - 1])]
    return cards, nodes


def turned_stack(mu, side, degrees, angle=90, tangent="KEPT"):
    """Press a block on another one, push it by `side` along x, then turn both."""
    upper, above = grid("A", 10001, 2, (0.25, 0.25, 1.0), (1.25, 1.25, 2.0))
    lower, below = grid("L", 20001, 3, (0.0, 0.0, 0.0), (1.5, 1.5, 1.0))
    above = {i: x for i, x in above.items() if x[2] > 1.999}
    below = {i: x for i, x in below.items() if x[2] < 0.001}
    cards = upper + lower + [
        f"*MATERIAL, NAME=M\n{NEO}\n*SOLID SECTION, ELSET=A, MATERIAL=M",
        f"*SOLID SECTION, ELSET=L, MATERIAL=M\n*SURFACE INTERACTION, NAME=I\n*FRICTION\n{mu}",
        "*CONTACT PAIR, INTERACTION=I\nA-LOW, L-UP\n*CONTACT SOLVER, TOLERANCE=1e-12",
        f"*BODY SOLVER, TANGENT={tangent}",
    ]
    steps = [(0.0, (0, 0, -0.1), 4), (0.0, (side, 0, -0.1), 4)]
    steps += [(turn, (side, 0, -0.1), 1) for turn in range(degrees, angle + 1, degrees)]
    for s, (turn, way, increments) in enumerate(steps):
        cards += ["*STEP, NLGEOM" if s == 0 else "*STEP", f"*STATIC, DIRECT\n1., {increments}."]
        cards.append("*BOUNDARY")
        q = rotation(turn)
        for nodes, shift in ((above, way), (below, (0, 0, 0))):
            for node, x in nodes.items():
                u = q @ (x + shift) - x
                cards += [f"{node}, {i + 1}, {i + 1}, {float(u[i])!r}" for i in range(3)]
        cards.append("*END STEP")
    return Run("\n".join(cards) + "\n", name="turned")


# The floor of a block: a plane, or facets in it.
FLOOR = {
    "plane": "*OBSTACLE, NAME=FLOOR, TYPE=PLANE, REF NODE=9000\n0., 0., 0., 0., 0., 1.",
    "facets": """\
*NODE
9001, -1., -1., 0.
9002, 2., -1., 0.
9003, 2., 2., 0.
9004, -1., 2., 0.
9005, 0.4, 0.3, 0.
*ELEMENT, TYPE=R3D3, ELSET=F
9001, 9001, 9002, 9005
9002, 9002, 9003, 9005
9003, 9003, 9004, 9005
9004, 9004, 9001, 9005
*RIGID BODY, ELSET=F, REF NODE=9000
*SURFACE, NAME=FLOOR
F, SPOS""",
}


def turned_block(floor, law=NEO, degrees=10):
    """Press a block on the floor, push it, then turn both."""
    cards, nodes = grid("B", 1, 2, (0, 0, 0), (1, 1, 1))
    top = {i: x for i, x in nodes.items() if x[2] > 0.999}
    cards += [
        f"*NODE\n9000, 0., 0., 0.\n{FLOOR[floor]}\n*MATERIAL, NAME=M\n{law}",
        "*SOLID SECTION, ELSET=B, MATERIAL=M\n*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3",
        "*CONTACT PAIR, INTERACTION=I\nB-LOW, FLOOR\n*CONTACT SOLVER, TOLERANCE=1e-12",
    ]
    steps = [(0, (0, 0, -0.1), 4), (0, (0.05, 0, -0.1), 2)]
    steps += [(turn, (0.05, 0, -0.1), 1) for turn in range(degrees, 91, degrees)]
    for s, (turn, way, increments) in enumerate(steps):
        cards += ["*STEP, NLGEOM" if s == 0 else "*STEP", f"*STATIC, DIRECT\n1., {increments}."]
        cards += ["*BOUNDARY", "9000, 1, 3"]
        axis = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5]) * np.radians(turn)
        cards += [f"9000, {i + 4}, {i + 4}, {axis[i]}" for i in range(3) if turn]
        for node, x in top.items():
            u = rotation(turn) @ (x + way) - x
            cards += [f"{node}, {i + 1}, {i + 1}, {u[i]}" for i in range(3)]
        cards.append("*END STEP")
    return Run("\n".join(cards) + "\n", name="turned")


class Turns(unittest.TestCase):
    """Both bodies turn together: nothing slips, and forces turn with them."""

    def check(self, run, degrees=10):
        """Hold forces and energies against those before the turn."""
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            forces = result.pairs[0].resultant
            energy = result.history("energy/strain")
            lost = result.history("energy/dissipation")
        turns = 90 // degrees
        before = forces[-turns - 1]
        for k in range(turns):
            np.testing.assert_allclose(
                rotation(degrees * (k + 1)).T @ forces[k - turns], before,
                rtol=0, atol=1e-10 * np.abs(before).max(),
            )
        np.testing.assert_allclose(energy[-turns:], energy[-turns - 1], rtol=1e-9)
        np.testing.assert_allclose(lost[-turns:], lost[-turns - 1], rtol=1e-9, atol=1e-12)

    def test_what_sticks(self):
        self.check(turned_stack(2.0, 0.02, 10))

    def test_what_has_slid(self):
        """Points at the limit of friction stay there without slipping."""
        self.check(turned_stack(0.3, 0.15, 10))

    def test_obstacles_that_turn(self):
        for floor in FLOOR:
            with self.subTest(floor=floor):
                self.check(turned_block(floor))


if __name__ == "__main__":
    unittest.main()
