"""Obstacles between the nodes: what a slave face is entered by where no node touches."""

import unittest

import numpy as np
from facets import plate, rigid
from program import INPUT, LONG, Run

from studies.deck_cards import deck, pair, quarter_ring

BLOCK = """*NODE
1, {x}, {y}, {radius}
*BLOCK, NAME=B, TYPE=C3D8I, NX=8, NY=8, NZ=4
-1., -1., -1.,  2., 2., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*OBSTACLE, NAME=S, TYPE={shape}, REF NODE=1
{x}, {y}, {radius}, {axis} {radius}
*SURFACE INTERACTION, NAME=D
*FRICTION
0.2
*CONTACT PAIR, INTERACTION=D
{surface}, S
*BOUNDARY
B-ZMIN, 1, 3, 0.
"""

# Elements of 0.25: the face over (0.125, 0.125) has these corners.
FACE = "nodes 366, 367, 376 and 375"
EDGE, RADIUS = 0.25, 2.0
CORNERS = EDGE**2 / (4.0 * RADIUS)  # how deep a sphere is when all corners touch, to first order


def block(x=0.125, y=0.125, radius=RADIUS, shape="SPHERE", surface="B-ZMAX"):
    axis = "0., 1., 0.," if shape == "CYLINDER" else ""
    return BLOCK.format(x=x, y=y, radius=radius, shape=shape, axis=axis, surface=surface)


def step(way, increments=1, more=""):
    """A *STEP that takes the obstacle to `way` from where the deck has it."""
    moves = "\n".join(f"1, {dof}, {dof}, {value!r}" for dof, value in enumerate(way, 1))
    return (
        f"*STEP\n*STATIC, DIRECT\n{1.0 / increments!r}, 1.\n*BOUNDARY{more}\n{moves}\n*END STEP\n"
    )


def faceted_hole(facets, part=1.0, radius=1.0):
    """A ring of elements, its hole of flat facets, held outside; part of a turn of it."""
    n = round(facets * part)
    columns = n if part == 1.0 else n + 1
    nodes, elements, outside = [], [], []
    for k in range(3):
        for j in range(3):
            for i in range(columns):
                angle = 2.0 * np.pi * i / facets
                r = radius * (1.0 + 0.5 * j)
                nodes.append((r * np.cos(angle), r * np.sin(angle), 0.2 * k))
                if j == 2:
                    outside.append(len(nodes))

    def at(i, j, k):
        return (k * 3 + j) * columns + i % columns + 1

    for k in range(2):
        for j in range(2):
            for i in range(n):
                low = [at(i, j, k), at(i, j + 1, k), at(i + 1, j + 1, k), at(i + 1, j, k)]
                high = [at(i, j, k + 1), at(i, j + 1, k + 1), at(i + 1, j + 1, k + 1)]
                elements.append([*low, *high, at(i + 1, j, k + 1)])
    inside = [at(i, 0, k) for k in range(3) for i in range(columns)]
    text = "*NODE, NSET=ALL\n"
    text += "".join(f"{i}, {x!r}, {y!r}, {z!r}\n" for i, (x, y, z) in enumerate(nodes, 1))
    text += "*ELEMENT, TYPE=C3D8I, ELSET=B\n"
    text += "".join(f"{i}, {', '.join(map(str, b))}\n" for i, b in enumerate(elements, 1))
    text += "*NSET, NSET=OUTSIDE\n" + "".join(f"{i}\n" for i in outside)
    return text + "*NSET, NSET=INSIDE\n" + "".join(f"{i}\n" for i in inside)


PIN = """*NODE
90000, 0., 0., 0.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
*SURFACE, NAME=HOLE, TYPE=NODE
INSIDE
*OBSTACLE, NAME=PIN, TYPE=CYLINDER, REF NODE=90000
0., 0., 0.,  0., 0., 1.,  {radius!r}
*SURFACE INTERACTION, NAME=D
*FRICTION
0.1
*CONTACT PAIR, INTERACTION=D
HOLE, PIN
*BOUNDARY
OUTSIDE, 1, 3, 0.
*STEP
*STATIC, DIRECT
0.05, 1.
*BOUNDARY
90000, 1, 1, {x!r}
90000, 2, 2, {y!r}
90000, 3, 3, 0.
*END STEP
"""


class Missed(unittest.TestCase):
    def refuse(self, deck, *words):
        run = Run(deck, "--quiet", name="missed")
        self.assertEqual(run.status, 2, run.output + run.errors)
        for word in (*words, "contact is missed"):
            self.assertIn(word, run.errors)
        return run

    def test_a_sphere_pressed_into_the_middle_of_a_face_is_told(self):
        deck = block() + step((0.0, 0.0, -0.005))
        self.refuse(deck, "step 1, increment 1: S is 0.005 deep", FACE + " of B-ZMAX", "0.2")

    def test_it_is_told_at_the_end_of_the_step_at_the_latest(self):
        deck = block() + step((0.0, 0.0, -0.005), increments=4)
        run = self.refuse(deck, "step 1, increment 4: S is 0.005 deep")
        with run.result() as result:
            np.testing.assert_allclose(
                result.history("face_penetration"), [0.00125, 0.0025, 0.00375], rtol=1e-9
            )

    def test_what_went_in_and_out_within_a_step_is_told(self):
        up_and_down = "*AMPLITUDE, NAME=A\n0., 0., 0.5, 1., 1., 0.\n"
        deck = block() + up_and_down + step((0.0, 0.0, -0.005), 4, ", AMPLITUDE=A")
        self.refuse(deck, "increment 4: S was 0.0025 deep", FACE)

    def test_a_sphere_that_crosses_the_body_in_one_increment_is_told(self):
        self.refuse(block() + step((0.0, 0.0, -6.0)), "S gets 2 deep", "within the increment")

    def test_a_small_sphere_off_the_middle_is_told(self):
        # Its radius is a tenth of the face's edge, and no middle of an edge or face is on its way.
        deck = block(x=0.06, y=0.05, radius=0.025)
        self.refuse(deck + step((0.0, 0.0, -0.01)), "S is 0.01 deep", FACE)
        self.refuse(deck + step((0.0, 0.0, -2.0)), "S gets 0.025 deep", FACE)

    def test_a_graze_in_one_increment_is_told(self):
        # From beside the body to its other side, 0.1 into the upper face.
        deck = block(x=-4.0, y=0.125)
        run = self.refuse(deck + step((8.0, 0.0, -0.1)), "within the increment")
        self.assertIn("use smaller increments", run.errors)

    def test_a_roller_between_two_rows_of_nodes_is_told(self):
        # Along y; two rows touch at edge^2/(8 R) = 0.0039.
        self.refuse(block(shape="CYLINDER") + step((0.0, 0.0, -0.003)), "S is 0.003 deep")

    def test_a_pin_between_the_nodes_of_a_hole_is_told(self):
        # Its radius is 0.3: between rows 0.196 apart it enters by up to
        # 0.196^2/8 (1/0.3 - 1) = 0.011. A twentieth of the sagitta, 0.0048, is left open.
        way = 0.705 * np.array([np.cos(np.pi / 32), np.sin(np.pi / 32)])
        pin = PIN.format(radius=0.3, x=way[0], y=way[1])
        self.refuse(faceted_hole(32) + pin, "PIN is 0.00476", "of HOLE")


class Right(unittest.TestCase):
    def solve(self, deck):
        run = Run(deck, name="right")
        self.assertEqual(run.status, 0, run.errors)
        return run

    def test_spheres_at_random_places_are_pressed_in(self):
        random = np.random.default_rng(60)
        entered = 0
        spheres = 60 if LONG else 20
        for _ in range(spheres):
            x, y = random.uniform(-0.5, 0.5, 2)
            radius, depth = random.uniform(1.0, 4.0), random.uniform(0.02, 0.05)
            increments = int(random.integers(1, 9))
            with self.subTest(x=x, y=y, radius=radius, depth=depth, increments=increments):
                run = self.solve(block(x, y, radius) + step((0.0, 0.0, -depth), increments))
                with run.result() as result:
                    self.assertLess(result.pairs[0].resultant[-1, 2], 0.0)
                    deepest = result.history("face_penetration")[-1]
                    # Four corners touch by then; a dent between them hides no more than they do.
                    self.assertLess(deepest, 1.1 * EDGE**2 / (4.0 * radius))
                    entered += deepest > 0.0
        self.assertEqual(entered, spheres)

    def test_a_sphere_on_its_way_to_the_nodes_is_not_ended(self):
        run = self.solve(block() + step((0.0, 0.0, -0.02), increments=8))
        with run.result() as result:
            force = -result.pairs[0].resultant[:, 2]
            np.testing.assert_array_equal(force[:3], 0.0)
            self.assertTrue(np.all(force[3:] > 0.0))
            depths = result.history("face_penetration")
            np.testing.assert_allclose(depths[:3], [0.0025, 0.005, 0.0075], rtol=1e-9)
        entered = "step 1: faces of B-ZMAX penetrate S between their nodes by up to"
        self.assertIn(entered, run.output)
        self.assertIn("at " + FACE, run.output)

    def test_a_tool_that_is_dragged_far_in_one_increment_is_not_ended(self):
        # The straight way goes deep through faces that nothing touches before or after.
        deck = block(x=-0.75, y=0.0, radius=1.0) + step((0.0, 0.0, -0.02))
        run = self.solve(deck + step((1.5, 0.0, -0.02)))
        with run.result() as result:
            self.assertAlmostEqual(result.history("face_penetration_on_way")[1], 0.02, places=3)

    def test_what_nodes_have_seen_may_leave_after_them(self):
        # The last node lets go while the tool is in the faces beside it still, and a little later
        # these do: in as many increments as that takes.
        path = "*AMPLITUDE, NAME=A\n0., 0., .45, 1., 1., -1.\n*STEP\n*STATIC{}\n{}, 1.\n"
        path += "*BOUNDARY, AMPLITUDE=A\n1, 1, 1, 0.\n1, 2, 2, 0.\n1, 3, 3, -0.03\n*END STEP\n"
        for direct, increment in (("", 1.0), ("", 1.0 / 3.0), (", DIRECT", 0.01)):
            for shape in ("SPHERE", "CYLINDER"):
                if direct and shape == "SPHERE":
                    continue
                with self.subTest(direct=direct, increment=increment, shape=shape):
                    deck = block(0.03, 0.06, shape=shape)
                    deck = deck.replace("NX=8, NY=8, NZ=4", "NX=2, NY=2, NZ=1")
                    run = Run(deck + path.format(direct, increment), "--quiet", name="right")
                    self.assertEqual(run.status, 0, run.errors)
                    with run.result() as result:
                        force = result.pairs[0].resultant[:, 2]
                        deep = result.history("face_penetration")
                    self.assertLess(force.min(), -1.0)
                    self.assertEqual(force[-1], 0.0)
                    # Between the last node and the last face.
                    self.assertTrue(direct or np.any((force == 0.0) & (deep > 1e-7)))

    def test_a_pin_in_a_faceted_hole_enters_no_facet_before_a_node_touches(self):
        # 32 facets are 0.48 % of the radius nearer than their nodes, the pin is 0.1 % smaller.
        for part, turns in ((1.0, (0.0, 0.5, 0.3, 8.5)), (0.25, (0.0, 0.5, 4.3, 7.5))):
            hole = faceted_hole(32, part)
            for turn in turns:
                with self.subTest(part=part, turn=turn):
                    angle = 2.0 * np.pi * turn / 32
                    way = 0.02 * np.array([np.cos(angle), np.sin(angle)])
                    run = self.solve(hole + PIN.format(radius=0.999, x=way[0], y=way[1]))
                    with run.result() as result:
                        touched = np.linalg.norm(result.pairs[0].resultant, axis=1) > 0.0
                        self.assertTrue(touched[-1])
                        entered = result.history("face_penetration")
                        np.testing.assert_array_equal(entered[: np.argmax(touched)], 0.0)
                        # The surface through the nodes' normals: a hundredth of the sagitta.
                        self.assertLess(entered.max(), 0.01 * 0.0048)

    def test_a_pin_that_fits_a_coarse_hole_is_not_ended(self):
        # 16 facets: 1.9 %; pressed from the start, as the pin is larger than the hole.
        hole = faceted_hole(16)
        self.solve(hole + PIN.format(radius=1.001, x=0.005, y=0.002))
        self.solve(hole + PIN.format(radius=1.0, x=0.0, y=0.0))

    def test_a_surface_without_faces_has_nothing_to_enter(self):
        nodes = "*SURFACE, NAME=FOUR, TYPE=NODE\n366\n384\n"
        deck = block(surface="FOUR").replace("*SURFACE INTERACTION", nodes + "*SURFACE INTERACTION")
        run = self.solve(deck + step((0.0, 0.0, -0.005)))
        with run.result() as result:
            np.testing.assert_array_equal(result.history("face_penetration"), 0.0)


class OfTheMesh(unittest.TestCase):
    def test_what_enters_counts_in_the_error_of_the_mesh(self):
        # Four nodes just touch, alike: the dent between them is what the mesh misses.
        depth = 0.009
        run = Run(block() + step((0.0, 0.0, -depth)), name="coarse")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            pair = result.pairs[0]
            pressing = pair.reaction[-1][:, 0] > 0.0
            self.assertEqual(np.count_nonzero(pressing), 4)
            force = pair.reaction[-1][pressing, 0].mean()
            area = EDGE**2
            corners = pair.gap[-1][pressing].mean()
            energy = result.history("energy/strain")[-1]
            error = result.history("error/mesh")[-1]
            u = result.field("displacement", -1)
            x = result.file["VTKHDF/Points"][:]
        # By Simpson's rule over the face and the eight around it, as the nodes have it. Of the
        # middle: 4/9 of the area; of middles of edges 1/9 each, of two faces each.
        self.assertLess(abs(corners), 1e-9)
        place = {}
        for i, point in enumerate(x[: 9 * 9 * 5]):
            place[tuple(np.round(point / 0.125).astype(int))] = i
        work = 0.0
        pressure = dict.fromkeys(range(len(x)), 0.0)
        for corner in ((0, 0), (2, 0), (0, 2), (2, 2)):
            pressure[place[(*corner, 0)]] = force / area
        for i in range(-4, 6, 2):
            for j in range(-4, 6, 2):
                nodes = [place[(i + a, j + b, 0)] for a, b in ((0, 0), (2, 0), (2, 2), (0, 2))]
                for a, wa in ((-1, 1 / 6), (0, 4 / 6), (1, 1 / 6)):
                    for b, wb in ((-1, 1 / 6), (0, 4 / 6), (1, 1 / 6)):
                        n = np.array(
                            [
                                (1 - a) * (1 - b),
                                (1 + a) * (1 - b),
                                (1 + a) * (1 + b),
                                (1 - a) * (1 + b),
                            ]
                        )
                        at = n @ (x + u)[nodes] / 4.0
                        gap = np.linalg.norm(at - [0.125, 0.125, RADIUS - depth]) - RADIUS
                        p = n @ [pressure[k] for k in nodes] / 4.0
                        work += wa * wb * area * p * min(gap, 0.0)
        self.assertAlmostEqual(error, abs(work) / (2.0 * energy), delta=1e-6 * error)
        self.assertGreater(error, 0.5)

    def test_the_decks_that_come_with_the_program_keep_theirs(self):
        # 8.2 % of the indentation where the elements are an n-th, n = 12.
        run = Run(INPUT / "tool.inp")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertAlmostEqual(result.history("face_penetration")[4], 0.082 * 0.02, delta=2e-5)


ON_FACES = """*BLOCK, NAME=B, TYPE=C3D8, NX={n}, NY={n}, NZ=2
0., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.3
*SOLID SECTION, ELSET=B, MATERIAL=M
{tool}
*SURFACE INTERACTION, NAME=D
*CONTACT PAIR, INTERACTION=D{small}
B-ZMIN, {master}
*BOUNDARY
{held}
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMAX, 1, 2, 0.
B-ZMAX, 3, 3, -0.03
*END STEP
"""


class BeforeFaces(unittest.TestCase):
    """Facets and bodies whose faces rise between the slave's nodes, and at them, touched or not."""

    def hills(self, x, y):
        """Return hills and valleys, four along an edge, that means over faces do not see."""
        return 0.01 * np.cos(8.0 * np.pi * x) * np.cos(8.0 * np.pi * y)

    def solve(self, tool, master, held="900, 1, 3", n=2, small=""):
        text = ON_FACES.format(n=n, tool=tool, master=master, held=held, small=small)
        run = Run(text, name="faces")
        self.assertEqual(run.status, 0, run.errors)
        return run

    def rigid(self):
        corners, facets = plate((-0.1, -0.1), (1.1, 1.1), (48, 48), True, self.hills)
        return rigid("FLOOR", corners, facets, (900, (0.0, 0.0, 0.0)))

    def test_hills_under_facets_are_measured_noted_and_counted(self):
        run = self.solve(self.rigid(), "FLOOR")
        self.assertIn("faces of B-ZMIN penetrate FLOOR between their nodes by up to", run.output)
        with run.result() as result:
            depth = result.history("face_penetration")[-1]
            error = result.history("error/mesh")[-1]
            energy = result.history("energy/strain")[-1]
            pair = result.pairs[0]
            least = result.file[f"contact/{pair.name}/least_gap"][-1].min()
            pressure = pair.pressure[-1]
            u = result.field("displacement", -1)
            x = result.file["VTKHDF/Points"][:]
            place = {tuple(np.round(2.0 * c).astype(int)): k for k, c in enumerate(x[:27])}
            row = {tuple(np.round(2.0 * c).astype(int)): k for k, c in enumerate(pair.coordinates)}
        self.assertAlmostEqual(depth, -least, delta=1e-12)
        # Face by face, from the pressures and displacements of their nodes; gaps are along the
        # normals of the facets.
        work = 0.0
        s, fine = np.meshgrid((np.arange(100) + 0.5) / 100, (np.arange(100) + 0.5) / 100)
        for i in (0, 1):
            for j in (0, 1):
                shapes = {
                    (i, j): (1 - s) * (1 - fine), (i + 1, j): s * (1 - fine),
                    (i, j + 1): (1 - s) * fine, (i + 1, j + 1): s * fine,
                }  # fmt: skip
                height = sum(n * u[place[(*k, 0)]][2] for k, n in shapes.items())
                p = sum(n * pressure[row[(*k, 0)]] for k, n in shapes.items())
                hx, hy = 0.5 * (i + s), 0.5 * (j + fine)
                slope = [
                    (self.hills(hx + a, hy + b) - self.hills(hx - a, hy - b)) / 2e-6
                    for a, b in ((1e-6, 0.0), (0.0, 1e-6))
                ]
                gap = (height - self.hills(hx, hy)) / np.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
                work += 0.25 * (p * np.minimum(gap, 0.0)).mean()
        self.assertAlmostEqual(error, -work / (2.0 * energy), delta=0.03 * error)
        self.assertGreater(error, 0.05)

    def body(self, place="0., 0., -0.5"):
        # Narrower than the faces over it, which bend about its edges.
        tool = f"*BLOCK, NAME=T, TYPE=C3D8, NX=3, NY=3, NZ=2\n{place}, 0.7, 0.7, 0.5\n"
        return tool + "*SOLID SECTION, ELSET=T, MATERIAL=M"

    def test_a_body_that_faces_bend_about_is_measured_and_noted(self):
        run = self.solve(self.body(), "T-ZMAX", "T-ZMIN, 1, 3")
        self.assertIn("faces of B-ZMIN penetrate T-ZMAX between their nodes by up to", run.output)
        with run.result() as result:
            depth = result.history("face_penetration")[-1]
            least = result.file["contact/B-ZMIN:T-ZMAX/least_gap"][-1].min()
            self.assertAlmostEqual(depth, -least, delta=1e-12)
            self.assertGreater(depth, 1e-4)

    def test_meshes_that_match_overlap_nowhere(self):
        tool = self.body().replace("NX=3, NY=3", "NX=2, NY=2").replace("0.7, 0.7", "1., 1.")
        run = self.solve(tool, "T-ZMAX", "T-ZMIN, 1, 3")
        self.assertNotIn("penetrate", run.output)
        with run.result() as result:
            np.testing.assert_array_equal(result.history("face_penetration"), 0.0)

    def test_with_small_sliding_nothing_is_followed(self):
        run = self.solve(self.body(), "T-ZMAX", "T-ZMIN, 1, 3", small=", SMALL SLIDING")
        with run.result() as result:
            np.testing.assert_array_equal(result.history("face_penetration"), 0.0)

    def test_a_hub_that_is_too_large_for_its_ring_is_missed_between_the_nodes(self):
        """Of few faces, with nodes that overlap by less than those faces are from their circle.

        With small sliding as without: gaps are means over faces, and say that nothing touches.
        """
        for small in ("", ", SMALL SLIDING"):
            for divisions, overlap, status in (((4, 9), 0.01, 2), ((4, 9), 0.0, 0),
                                               ((4, 9), 0.05, 0), ((9, 4), 0.01, 0)):
                with self.subTest(small=small, divisions=divisions, overlap=overlap):
                    run = Run(deck(
                        quarter_ring("I", 1, (0.5, 1.0 + overlap), (3, divisions[0])),
                        quarter_ring("O", 1001, (1.0, 1.5), (3, divisions[1])),
                        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n"
                        "*SOLID SECTION, ELSET=I, MATERIAL=M\n"
                        "*SOLID SECTION, ELSET=O, MATERIAL=M\n",
                        pair("I-OUT, O-IN", options=small),
                        "*STEP\n*STATIC\n1., 1.\n*END STEP",
                        held="I-X, 1\nI-Y, 2\nO-X, 1\nO-Y, 2\nI-ALL, 3\nO-ALL, 3",
                    ), name="rings")  # fmt: skip
                    self.assertEqual(run.status, status, run.output + run.errors)
                    if status == 2:
                        self.assertIn("contact is missed", run.errors)

    def test_leaves_that_bend_into_polygons_miss_no_contact(self):
        """Two leaves of a spring, of unlike flat faces: bent, those of the upper one are a hollow
        polygon, which the lower one's corners enter away from its end, where alone it presses.
        """
        cards = []
        leaves = ("UPPER", 1, 60.0, 10, 0.0), ("LOWER", 101, 44.0, 9, -2.0)
        for name, first, length, n, low in leaves:
            cards.append("*NODE")
            for k in range(n + 1):
                cards += [f"{first + 2 * k + i}, {length * k / n!r}, {low + 2 * i}" for i in (0, 1)]
            cards.append(f"*ELEMENT, TYPE=CPE4, ELSET={name}")
            for k in range(n):
                a = first + 2 * k
                cards.append(f"{first + k}, {a}, {a + 2}, {a + 3}, {a + 1}")
            cards += [f"*SURFACE, NAME={name}-TOP", f"{name}, S3", f"*SURFACE, NAME={name}-BOTTOM",
                      f"{name}, S1", f"*SOLID SECTION, ELSET={name}, MATERIAL=STEEL"]  # fmt: skip
        run = Run("\n".join((
            *cards, "*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3",
            "*SURFACE INTERACTION, NAME=DRY", "*FRICTION", "0.1",
            "*CONTACT PAIR, INTERACTION=DRY", "LOWER-TOP, UPPER-BOTTOM",
            "*STEP, NLGEOM", "*STATIC", "0.2, 1.", "*BOUNDARY", "1, 1, 2", "2, 1, 2",
            "101, 1, 2", "102, 1, 2", "22, 2, 2, -16.", "*END STEP\n",
        )), name="leaves")  # fmt: skip
        self.assertEqual(run.status, 0, run.output + run.errors)
        self.assertIn("faces of a hollow stand out of it", run.output)
        with run.result() as result:
            status = result.pairs[0].status[-1]
            np.testing.assert_array_equal(result.points[result.pairs[0].nodes[status > 0], 0], 44.0)

    def test_what_turning_makes_of_a_motion_is_not_missed_at_small_strain(self):
        """Two heads are held side by side at their tops, one a little lower; they lean alike, and
        part below. Only in deformed places, by slope times height, is one in the other.
        """
        text = """*BLOCK, NAME=A, ELSET=ALL, NX=1, NY=1, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=B, ELSET=ALL, NX=1, NY=1, NZ=2
1., 0., 0.,  1., 1., 1.
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*SURFACE INTERACTION, NAME=I
*CONTACT PAIR, INTERACTION=I
B-XMIN, A-XMAX
*STEP
*STATIC
1., 1.
*BOUNDARY
A-ZMAX, 1, 2
B-ZMAX, 1, 2
A-ZMAX, 3, 3, -0.001
B-ZMAX, 3
*DSLOAD
A-XMIN, P, -1.1
B-XMAX, P, 1.
*END STEP
"""
        run = Run(text, name="heads")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            self.assertTrue(result.certified)
            np.testing.assert_array_equal(result.pairs[0].resultant[-1], 0.0)

    def test_polygons_that_fit_into_each_other_are_no_dents(self):
        # Hub and ring have other faces: they overlap by their rises where both press evenly.
        run = Run(INPUT / "press.inp")
        self.assertEqual(run.status, 0, run.errors)
        with run.result() as result:
            np.testing.assert_array_equal(result.history("face_penetration"), 0.0)
            self.assertLess(result.history("error/mesh")[-1], 0.01)


if __name__ == "__main__":
    unittest.main()
