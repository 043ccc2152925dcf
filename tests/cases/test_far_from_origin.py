"""Meshes far from the origin, as at coordinates of a national grid: the results of the same scenes
at the origin, at the places of the deck."""

import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from program import Run

# Powers of two and sizes that are few binary digits: nothing of the mesh is lost at these places.
EXACT = np.array([2.0**20, -(2.0**21), 128.0])
# Coordinates are rounded by up to 9e-10 there.
NATIONAL_GRID = np.array([4.3e5, 5.6e6, 120.7])

HEAD = """*HEADING
a scene at a place
*PARAMETER
ox = 0.
oy = 0.
oz = 0.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*DENSITY
1.
*SURFACE INTERACTION, NAME=I
*FRICTION
0.3
"""

STEP = """*STEP
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
"""

# An upper block pressed into a lower one and pushed along, both meshes their own.
BODIES = HEAD + """*BLOCK, NAME=L, NX=4, NY=2, NZ=2
<ox>, <oy>, <oz>, 2., 1., 1.
*BLOCK, NAME=U, NX=3, NY=3, NZ=1
<ox+0.25>, <oy>, <oz+1>, 1.5, 0.75, 0.5
*SOLID SECTION, ELSET=L, MATERIAL=M
*SOLID SECTION, ELSET=U, MATERIAL=M
*CONTACT PAIR, INTERACTION=I
U-ZMIN, L-ZMAX
*CONTACT GAP, PARABOLA
U-ZMIN, <ox+0.75>, <oy+0.5>, <oz+1>, 50.
*BOUNDARY
L-ZMIN, 1, 3
""" + STEP + """U-ZMAX, 1, 1, 0.005
U-ZMAX, 2, 2
U-ZMAX, 3, 3, -0.02
*END STEP
"""

# Two tied blocks on a plane, whose point is given somewhere else, under a sphere that moves.
TIED = HEAD + """*BLOCK, NAME=L, NX=2, NY=2, NZ=2
<ox>, <oy>, <oz>, 1., 1., 1.
*BLOCK, NAME=U, NX=4, NY=2, NZ=2
<ox>, <oy>, <oz+1>, 1., 1., 0.5
*NODE
9001, <ox+0.5>, <oy+0.5>, <oz+4>
*SOLID SECTION, ELSET=L, MATERIAL=M
*SOLID SECTION, ELSET=U, MATERIAL=M
*TIE
U-ZMIN, L-ZMAX
*REFINE
<ox+0.5>, <oy+0.5>, <oz+1.5>, 0.125
*OBSTACLE, NAME=GROUND, TYPE=PLANE
<ox-100>, <oy+70>, <oz>, 0., 0., 1.
*OBSTACLE, NAME=BALL, TYPE=SPHERE, REF NODE=9001
<ox+0.5>, <oy+0.5>, <oz+3.5>, 2.
*CONTACT PAIR, INTERACTION=I
L-ZMIN, GROUND
*CONTACT PAIR, INTERACTION=I
U-ZMAX, BALL
""" + STEP + """9001, 1, 2
9001, 3, 3, -0.03
*END STEP
"""

# A ring quarter, held along cylindrical directions, on a roller that turns.
ROLLER = HEAD + """*BLOCK, NAME=B, NX=4, NY=2, NZ=2
<ox-1>, <oy>, <oz>, 2., 1., 1.
*NODE
9001, <ox>, <oy>, <oz-2>
*SOLID SECTION, ELSET=B, MATERIAL=M
*TRANSFORM, NSET=B-ZMAX, TYPE=C
<ox>, <oy>, <oz-2>, <ox>, <oy+1>, <oz-2>
*OBSTACLE, NAME=ROLLER, TYPE=CYLINDER, REF NODE=9001
<ox>, <oy+64>, <oz-2>, 0., 1., 0., 2.
*CONTACT PAIR, INTERACTION=I
B-ZMIN, ROLLER
""" + STEP + """B-ZMAX, 1, 1, -0.02
B-ZMAX, 2, 3
9001, 1, 4
9001, 5, 5, 0.01
9001, 6, 6
*END STEP
"""

# A facet tool that turns, from a file.
FACETS = HEAD + """*BLOCK, NAME=B, NX=4, NY=4, NZ=2
<ox>, <oy>, <oz>, 1., 1., 1.
*NODE
9001, <ox+0.5>, <oy+0.5>, <oz+1>
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=TOOL, TYPE=STL, INPUT={stl}, REF NODE=9001
*CONTACT PAIR, INTERACTION=I
B-ZMAX, TOOL
*BOUNDARY
B-ZMIN, 1, 3
""" + STEP + """9001, 1, 2
9001, 3, 3, -0.01
9001, 4, 5
9001, 6, 6, 0.05
*END STEP
"""

DECKS = {"bodies": BODIES, "tied": TIED, "roller": ROLLER, "facets": FACETS}


def write_sole(path, place):
    """Write the flat sole of a tool over the block at a place: two triangles that face down."""
    a, b, c, d = (np.array(p) + place for p in [
        (-0.5, -0.5, 1.0), (1.5, -0.5, 1.0), (1.5, 0.75, 1.0), (-0.5, 0.75, 1.0)])  # fmt: skip
    text = "solid sole\n"
    for triangle in ((a, c, b), (a, d, c)):
        lines = "".join("vertex " + " ".join(repr(float(v)) for v in x) + "\n" for x in triangle)
        text += f"facet normal 0 0 -1\nouter loop\n{lines}endloop\nendfacet\n"
    path.write_text(text + "endsolid sole\n")


class FarFromOrigin(unittest.TestCase):
    """Each deck at the origin and far away."""

    @classmethod
    def setUpClass(cls):
        """Run all of them at all places."""
        cls.folder = tempfile.TemporaryDirectory(prefix="bipot-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.runs = {}
        for label, place in (("zero", 0 * EXACT), ("exact", EXACT), ("grid", NATIONAL_GRID)):
            stl = Path(cls.folder.name) / f"{label}.stl"
            write_sole(stl, place)
            at = dict(zip(("ox", "oy", "oz"), (repr(float(x)) for x in place), strict=True))
            for name, text in DECKS.items():
                cls.runs[name, label] = Run(text.replace("{stl}", str(stl)), name=name, **at)

    def file(self, name, label):
        """The result file of a run, which must be solved."""
        run = self.runs[name, label]
        self.assertEqual(run.status, 0, f"{name} {label}: {run.errors}{run.output}")
        return h5py.File(run.file)

    def values(self, name, label, field):
        """A field of every pair of a run that has it, by the pair's name."""
        with self.file(name, label) as file:
            pairs = file["contact"]
            return {k: pairs[k][field][()] for k in pairs if field in pairs[k]}

    def differ_by(self, name, label, field):
        """How far a field is from that at the origin, beside the largest entry there."""
        here, far = self.values(name, "zero", field), self.values(name, label, field)
        largest = max(abs(v).max() for v in here.values())
        return max(abs(far[k] - here[k]).max() for k in here) / largest

    def test_no_digit_is_lost(self):
        """Where the shift loses no digit of the mesh, none of the result is lost."""
        for name in DECKS:
            for field in ("resultant", "reaction", "slip"):
                self.assertLess(self.differ_by(name, "exact", field), 1e-9, f"{name} {field}")

    def test_rounded_coordinates(self):
        """Rounding by 9e-10 changes an indentation of 1e-2 by 1e-7 of itself."""
        for name in DECKS:
            self.assertLess(self.differ_by(name, "grid", "resultant"), 1e-6, name)

    def test_places_are_those_of_the_deck(self):
        """Files have the deck's coordinates, to the bit where nothing is rounded."""
        for name in DECKS:
            for field in ("coordinates", "obstacle_corners"):
                here, far = self.values(name, "zero", field), self.values(name, "exact", field)
                for k in here:
                    np.testing.assert_array_equal(far[k], here[k] + EXACT, f"{name} {field}")
            for label, place in (("exact", EXACT), ("grid", NATIONAL_GRID)):
                with self.file(name, "zero") as zero, self.file(name, label) as far:
                    here, there = (f["VTKHDF/Points"][()] for f in (zero, far))
                np.testing.assert_allclose(there, here + place, rtol=4e-16)
        with self.file("tied", "exact") as file:
            node = file["reference_nodes/coordinates"][()].ravel()
        np.testing.assert_array_equal(node, EXACT + [0.5, 0.5, 4.0])

    def test_obstacles_are_where_the_deck_has_them(self):
        """A plane goes through the point that is written, a centre is there."""
        points = self.values("tied", "exact", "obstacle_point")
        ground = next(v for k, v in points.items() if "GROUND" in k).ravel()
        ball = next(v for k, v in points.items() if "BALL" in k).ravel()
        self.assertEqual(ground[2], EXACT[2])
        np.testing.assert_array_equal(ball, EXACT + [0.5, 0.5, 3.5])

    def test_moments_are_about_the_origin_of_the_deck(self):
        """A force at a place away has the moment of the way more."""
        for name in DECKS:
            force = self.values(name, "zero", "resultant")
            here = self.values(name, "zero", "moment")
            far = self.values(name, "exact", "moment")
            for k in here:
                more = here[k] + np.cross(EXACT, force[k])
                np.testing.assert_allclose(far[k], more, rtol=0, atol=1e-9 * abs(more).max())

    def test_touching_is_no_overlap(self):
        """What overlaps by the rounding of its coordinates alone is not told."""
        for (name, label), run in self.runs.items():
            self.assertNotIn("overlap before", run.output, f"{name} {label}")


if __name__ == "__main__":
    unittest.main()
