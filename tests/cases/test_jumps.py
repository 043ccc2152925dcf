"""A solution at finite strain that jumps is not certified: it loses energy at once."""

import unittest

import numpy as np
from meshes import grid
from program import Run

SPAN, THICK = 10.0, 0.2


def arch(rise, increments, force, plate=True, direct=", DIRECT", length=1.0, stress=1.0, mu=0.0):
    """Deck of half of a clamped arch, pressed down in its middle by a force.

    By a plate that may move up and down, or on its nodes. It snaps over where it is high enough.
    """
    n = 8

    def shape(at):
        high = rise * (1 + np.cos(np.pi * at[0])) / 2 + THICK * (at[2] - 0.5)
        return length * SPAN * at[0], length * at[1], length * high

    mesh, index, _ = grid("ALL", (n, 1, 1), shape)
    sets = ""
    for name, row in (("MIDDLE", index[0]), ("END", index[-1])):
        sets += f"*NSET, NSET={name}\n" + "\n".join(map(str, row.ravel())) + "\n"
    top = length * (rise + THICK / 2)
    load = force * length**2 * stress
    contact, held = "", ""
    loads = f"MIDDLE, 3, {-load / 4!r}\n"
    if plate:
        contact = f"""\
*SURFACE, NAME=UPPER
1, S2
2, S2
3, S2
*NODE
9000, 0., 0., {top!r}
*OBSTACLE, NAME=PLATE, TYPE=PLANE, REF NODE=9000
0., 0., {top!r}, 0., 0., -1.
*SURFACE INTERACTION, NAME=I
*FRICTION
{mu}
*CONTACT PAIR, INTERACTION=I
UPPER, PLATE
"""
        held, loads = "9000, 1, 2\n", f"9000, 3, {-load!r}\n"
    return f"""\
*PARAMETER
element = C3D8I
{mesh}{sets}*MATERIAL, NAME=M
*ELASTIC
{1000.0 * stress!r}, 0.
*SOLID SECTION, ELSET=B, MATERIAL=M
{contact}*STEP, NLGEOM
*STATIC{direct}
{1 / increments!r}, 1.
*BOUNDARY
ALL, 2, 2
MIDDLE, 1, 1
END, 1, 3
{held}*CLOAD
{loads}*END STEP
"""


# A snap hook of CPE4 that is pushed over a pin until it would spring back behind it.
HOOK = """\
*NODE
1, 0., 0.
41, 20., 0.
501, 0., 2.
541, 20., 2.
1001, 18., -1.5
1002, 19., -1.5
1003, 20., -0.75
1004, 18., -0.75
1005, 19., -0.75
*NGEN, NSET=BELOW
1, 41, 1
*NGEN, NSET=ABOVE
501, 541, 1
*NFILL
BELOW, ABOVE, 4, 125
*ELEMENT, TYPE=CPE4
1, 1, 2, 127, 126
*ELGEN, ELSET=ARM
1, 40, 1, 1, 4, 125, 100
*ELEMENT, TYPE=CPE4, ELSET=NOSE
1001, 1001, 1002, 1005, 1004
1002, 1002, 1003, 41, 1005
1003, 1004, 1005, 41, 37
*MATERIAL, NAME=M
*ELASTIC
2000., 0.35
*SOLID SECTION, ELSET=ARM, MATERIAL=M
*SOLID SECTION, ELSET=NOSE, MATERIAL=M
*SURFACE, NAME=FRONT
NOSE
*OBSTACLE, NAME=PIN, TYPE=CYLINDER
21.2, -1.6, 0., 0., 0., 1., 0.8
*SURFACE INTERACTION, NAME=I
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=I
FRONT, PIN
*NSET, NSET=ROOT
1, 126, 251, 376, 501
*STEP, NLGEOM
*STATIC
0.02, 1.
*BOUNDARY
ROOT, 1, 1, 4.
ROOT, 2, 2, 0.
*END STEP
"""


class Arches(unittest.TestCase):
    def test_one_that_snaps_over(self):
        """Increments that land beyond are solved, and refused; where none does, it is said."""
        messages = []
        for rise, options in (
            (0.3, {}), (0.31, {}), (0.32, {}), (0.33, {}), (0.31, {"length": 1e-3, "stress": 1e6}),
            (0.31, {"plate": False}),
        ):  # fmt: skip
            run = Run(arch(rise, 50, 0.04 * rise**2, direct="", **options), name="arch")
            self.assertEqual(run.status, 2, (rise, options))
            self.assertRegex(run.errors, "the solution jumps: |would jump to another", rise)
            messages.append(run.errors)
        jumps = [message for message in messages if "the solution jumps: " in message]
        self.assertGreaterEqual(len(jumps), 2, messages)

    def test_large_increments(self):
        """Those that land far beyond are not certified either."""
        for options in ({}, {"length": 1e-3, "stress": 1e6}):
            run = Run(arch(0.33, 33, 0.32 * 0.33**2, **options), name="arch")
            self.assertEqual(run.status, 2, options)

    def test_with_friction(self):
        """Points that slide, come to press and leave do not hide it."""
        seen = 0
        for mu, rise, direct in (
            (0.02, 0.33, ""), (0.1, 0.33, ""), (0.1, 0.33, ", DIRECT"), (0.6, 0.33, ""),
            (0.3, 0.4, ", DIRECT"),
        ):  # fmt: skip
            for scale in ({}, {"length": 1e-3, "stress": 1e6}):
                deck = arch(rise, 33, 0.32 * rise**2, direct=direct, mu=mu, **scale)
                run = Run(deck, name="arch")
                self.assertEqual(run.status, 2, (mu, rise, direct, scale))
                seen += "the solution jumps: " in run.errors
        self.assertGreaterEqual(seen, 3)

    def test_one_that_is_too_flat_to_snap(self):
        for increments in (5, 20):
            for plate, mu in ((True, 0.0), (True, 0.3), (False, 0.0)):
                run = Run(arch(0.2, increments, 0.32 * 0.2**2, plate, mu=mu), name="arch")
                self.assertEqual(run.status, 0, (increments, plate, mu, run.errors))


def dragged_foot():
    """Deck of a block of rubber with a round sole, pressed on a belt that drags it; its sides are
    not in the surface."""
    n = range(11)
    lines = ["*NODE"]
    for j in n:
        for i in n:
            x = (i - 5) / 10
            sole = 0.8 * x * x
            lines.append(f"{11 * j + i + 1}, {x!r}, {sole + (1 - sole) * j / 10!r}")
    lines += ["9999, 0., 0.", "*ELEMENT, TYPE=CPE4, ELSET=B"]
    for j in n[:-1]:
        for i in n[:-1]:
            first = 11 * j + i + 1
            lines.append(f"{10 * j + i + 1}, {first}, {first + 1}, {first + 12}, {first + 11}")
    low, top = (", ".join(map(str, r)) for r in (range(1, 11), range(111, 122)))
    return "\n".join(lines) + f"""
*ELSET, ELSET=LOW
{low}
*SURFACE, NAME=SOLE
LOW, S1
*NSET, NSET=TOP
{top}
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, NEO HOOKE
192.3, 0.0024
*SOLID SECTION, ELSET=B, MATERIAL=RUBBER
*OBSTACLE, NAME=BELT, TYPE=PLANE, REF NODE=9999
0., 0., 0., 0., 1., 0.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.6
*CONTACT PAIR, INTERACTION=DRY
SOLE, BELT
*STEP, NLGEOM
*STATIC
0.1, 1.
*BOUNDARY
TOP, 1, 1
TOP, 2, 2, -0.3
9999, 1, 1, 1.
9999, 2, 2
*END STEP
"""


class Hooks(unittest.TestCase):
    def test_a_hook_that_springs_back(self):
        """Elements that turn inside out on the way to it, or no balance: the jump is named."""
        run = Run(HOOK, name="hook")
        self.assertEqual(run.status, 2)
        self.assertRegex(run.errors, "the body would jump to another one|(is|may be) unstable")
        self.assertRegex(run.errors, "increments before it are kept")


class SidesThatRollIn(unittest.TestCase):
    def test_what_the_surface_lacks_is_named(self):
        """The corner behind the sole comes to the belt: the message names it, and the surface."""
        run = Run(dragged_foot(), name="foot")
        self.assertEqual(run.status, 2, run.errors)
        self.assertRegex(run.errors, r"Node 12 has come to 0\.00\d+ of BELT, and its faces are not "
                         r"in SOLE: add all faces that may touch to SOLE")  # fmt: skip


if __name__ == "__main__":
    unittest.main()
