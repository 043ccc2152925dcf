"""scripts/compare: what it makes of a deck, and what it finds in the peers where there are any."""

import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("BIPOT_SOURCE", Path(__file__).resolve().parents[2]))
PROGRAM = Path(os.environ.get("BIPOT", ROOT / "build" / "bipot"))
INPUT = ROOT / "input"
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT)]

try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

from bipot.peers.calculix_deck import (  # noqa: E402
    MORTAR,
    SURFACES,
    Penalty,
    Targets,
    check_translatable,
    deck_lines,
    make_masters,
    read_resultants,
    slave_nodes,
    step_lines,
)
from bipot.peers.flat_deck import DeckError, read_flat  # noqa: E402
from bipot.peers.getfem_problem import (  # noqa: E402
    held_values,
    problem_arrays,
    read_output,
)
from bipot.peers.runs import (  # noqa: E402
    PeerRun,
    count_iterations,
    python_with_getfem,
    with_tolerance,
)
from bipot.result import Result  # noqa: E402
from studies import deck_cards  # noqa: E402

# A deck that says the same in many ways: parameters, an include, sets of sets, numbers of Fortran,
# a range of directions to 6, an obstacle with a reference node that moves, quoted names.
ODD = """*HEADING
*PARAMETER
n = 2
down = -0.01*sqrt(4)/2
kind = C3D8
*NODE
 500, 0., 0., -1.
*INCLUDE, INPUT=cube.inp
*NSET, NSET="upper, face"
CUBE-ZMAX
*nset, nset=SOME, generate
501, 505, 2
*MATERIAL, NAME=STEEL
*ELASTIC
2.1D+05, .3
*SOLID SECTION, ELSET=CUBE, MATERIAL=STEEL
*OBSTACLE, NAME=GROUND, TYPE=PLANE, REF NODE=500
0., 0., 0.,
0., 0., 2.
*SURFACE INTERACTION, NAME=DRY
*FRICTION
0.3
*CONTACT PAIR, INTERACTION=DRY, ADJUST=0.
CUBE-ZMIN, GROUND
*AMPLITUDE, NAME=RAMP
0., 0., 1., 1.+0
*BOUNDARY
"upper, face", 1, 6
*STEP
*STATIC
.5
*BOUNDARY, AMPLITUDE=RAMP
CUBE-ZMAX, 3, , <down>
500, 1, 3
*END STEP
*STEP
*STATIC, DIRECT
.25, 1.
*BOUNDARY
500, 1, 1, 0.002
*DSLOAD
CUBE-XMAX, P, 50.
*END STEP
"""
CUBE = """*BLOCK, NAME=CUBE, NX=<n>, NY=<n>, NZ=<2*n>, TYPE=<kind>
0., 0., -0.001,  1., 1., 2.
Z, 3.
"""


def run(deck, folder, *words):
    """Run bipot on a deck; return its result."""
    path = Path(folder) / "result.vtkhdf"
    subprocess.run([PROGRAM, deck, "-o", path, "--overwrite", "--quiet", *words], cwd=folder,
                   check=True, capture_output=True)
    return Result(path)


def forces(result, names):
    """Return the resultants of the pairs of these names, and the displacements at the end."""
    found = [result.pairs[name].resultant for name in names]
    return np.stack(found), result.field("displacement", -1)


def flat_for_bipot(scene):
    """Return a flat scene as a deck of bipot's, its planes and pairs unchanged."""
    targets = Targets(scene)
    steps = list(step_lines(scene, [], targets))
    lines = list(scene.model_lines())
    for name, obstacle in scene.obstacles.items():
        ref = f", REF NODE={obstacle.ref_node}" if obstacle.ref_node else ""
        lines += [f"*OBSTACLE, NAME={name}, TYPE={obstacle.kind}{ref}",
                  ", ".join(f"{x:.17g}" for x in obstacle.numbers)]
    for k, pair in enumerate(scene.pairs):
        lines += [f"*SURFACE, NAME=S{k}, TYPE=NODE", *map(str, slave_nodes(scene, pair)),
                  f"*SURFACE INTERACTION, NAME=I{k}", "*FRICTION",
                  f"{scene.friction[pair.interaction]:.17g}",
                  f"*CONTACT PAIR, INTERACTION=I{k}", f"S{k}, {pair.master}"]
    lines.append("*CONTACT SOLVER, TOLERANCE=1e-12")
    return "\n".join([*lines, *targets.lines, *steps]) + "\n"


# Two tied halves of a column of unlike laws, pulled and heated at finite strain, without contact.
COLUMN = """\
*BLOCK, NAME=A, ELSET=A, TYPE=C3D8, NX=2, NY=2, NZ=2
0., 0., 0.,  1., 1., 1.
*BLOCK, NAME=B, ELSET=B, TYPE=C3D8, NX=2, NY=2, NZ=2
0., 0., 1.,  1., 1., 1.
*MATERIAL, NAME=SOFT
*HYPERELASTIC, OGDEN, N=3
70., 2.4, -14., -1.2, 2., 5., 0.006
*EXPANSION
1e-5
*MATERIAL, NAME=HARD
*HYPERELASTIC, NEO HOOKE
100., 0.001
*SOLID SECTION, ELSET=A, MATERIAL=SOFT
*SOLID SECTION, ELSET=B, MATERIAL=HARD
*TIE, NAME=GLUE
B-ZMIN, A-ZMAX
*INITIAL CONDITIONS, TYPE=TEMPERATURE
A, 20.
*STEP, NLGEOM
*STATIC, DIRECT
0.5, 1.
*BOUNDARY
A-ZMIN, 1, 3
B-ZMAX, 1, 2
B-ZMAX, 3, 3, 0.3
*TEMPERATURE
A, 60.
*END STEP
*STEP
*STATIC, DIRECT
1., 1.
*BOUNDARY
B-ZMAX, 1, 1, 0.5
*END STEP
"""


class Flat(unittest.TestCase):
    """A deck written out flat is the same scene."""

    def same(self, deck, folder, **overrides):
        """Check that bipot finds the same with the deck and with what it is written out as."""
        words = [word for name, value in overrides.items() for word in ("--set", f"{name}={value}")]
        tight = Path(folder) / deck.name
        tight.write_text(with_tolerance(deck.read_text(), "1e-12"))
        with run(tight, folder, *words) as result:
            scene = read_flat(PROGRAM, deck, overrides)
            scene.take_mesh(result)
            expected = forces(result, [f"{p.slave}:{p.master}" for p in scene.pairs])
        flat = Path(folder) / "flat.inp"
        flat.write_text(flat_for_bipot(scene))
        with run(flat, folder) as result:
            found = forces(result, [f"S{k}:{p.master}" for k, p in enumerate(scene.pairs)])
        for one, other in zip(expected, found, strict=True):
            self.assertGreater(abs(one).max(), 0)
            self.assertLess(abs(one - other).max(), 1e-8 * abs(one).max(), deck.name)

    def test_decks_of_input_are_the_same(self):
        for name, overrides in (
            ("block", {"n": "2", "steps": "10", "theta": "20."}), ("quarter", {}), ("patch", {}),
            ("ssnv128", {"n": "4"}), ("corner", {}),
        ):
            with tempfile.TemporaryDirectory() as folder:
                self.same(INPUT / f"{name}.inp", folder, **overrides)

    def test_an_oddly_written_deck_is_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "cube.inp").write_text(CUBE)
            deck = Path(folder) / "odd" / "odd.inp"
            deck.parent.mkdir()
            deck.write_text(ODD)
            (deck.parent / "cube.inp").write_text(CUBE)
            self.same(deck, folder)

    def test_another_mesh_is_noticed(self):
        with tempfile.TemporaryDirectory() as folder:
            with run(INPUT / "block.inp", folder, "--set", "n=2", "--set", "steps=5") as result:
                scene = read_flat(PROGRAM, INPUT / "block.inp", {"n": "3"})
                with self.assertRaises(DeckError):
                    scene.take_mesh(result)


class Translation(unittest.TestCase):
    """What goes to CalculiX, and what cannot."""

    def test_what_has_no_translation_is_named(self):
        for name, words in (("tool", "SPHERE"), ("hertz", "CONTACT GAP"),
                            ("cantilever", "CONTACT PAIR")):
            with self.assertRaisesRegex(DeckError, words):
                check_translatable(read_flat(PROGRAM, INPUT / f"{name}.inp", {}))
        with self.assertRaisesRegex(DeckError, "C3D8B"):
            check_translatable(read_flat(PROGRAM, INPUT / "block.inp", {"element": "C3D8B"}))

    def test_other_cells_and_turns_have_no_translation(self):
        block = (INPUT / "block.inp").read_text()
        wedge = """*NODE
9001, 9., 0., 0.
9002, 10., 0., 0.
9003, 10., 1., 0.
9004, 9., 0., 1.
9005, 10., 0., 1.
9006, 10., 1., 1.
*ELEMENT, TYPE=C3D6, ELSET=BODY
9001, 9001, 9002, 9003, 9004, 9005, 9006
"""
        pyramid = wedge.replace("C3D6", "C3D5").replace(
            "9001, 9001, 9002, 9003, 9004, 9005, 9006", "9001, 9001, 9004, 9005, 9002, 9003"
        )
        tied = (INPUT / "stack.inp").read_text().replace(
            "*FRICTION", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED\n1e6\n*FRICTION", 1
        )
        with tempfile.TemporaryDirectory() as folder:
            for text, words in (
                (tied, "SURFACE BEHAVIOR ties"),
                (block.replace("*STEP\n", wedge + "*STEP\n", 1), "TYPE=C3D6"),
                (block.replace("*STEP\n", pyramid + "*STEP\n", 1), "TYPE=C3D5"),
                (block.replace("*ELASTIC\n210000., <nu>", "*HYPERFOAM, N=1\n1., -2., 0.25"),
                 "HYPERFOAM"),
                ((INPUT / "wheel.inp").read_text().replace("<n/2>", "1"), "turn by .BOUNDARY"),
            ):
                deck = Path(folder) / "deck.inp"
                deck.write_text(text)
                with self.assertRaisesRegex(DeckError, f"{words}.* no translation"):
                    read_flat(PROGRAM, deck, {"n": "1"})

    def test_master_faces_lie_on_the_planes(self):
        scene = read_flat(PROGRAM, INPUT / "corner.inp", {})
        for plane, normal in zip(make_masters(scene), np.eye(3), strict=True):
            upper = plane.places[plane.corners[0, 4:]]
            np.testing.assert_allclose(upper @ normal, 0, atol=1e-12)
            outward = np.cross(upper[1] - upper[0], upper[2] - upper[1])
            np.testing.assert_allclose(outward / np.linalg.norm(outward), normal, atol=1e-12)
            self.assertTrue((abs(upper).sum(axis=1) > 1).all())

    def test_master_faces_lie_on_the_cylinder(self):
        for name, towards in (("pipe", -1), ("roller", 1)):
            scene = read_flat(PROGRAM, INPUT / f"{name}.inp", {})
            ring, = make_masters(scene)
            numbers = next(iter(scene.obstacles.values())).numbers
            axis = np.array(numbers[3:6]) / np.linalg.norm(numbers[3:6])
            elements = ring.places[ring.corners] - numbers[:3]
            upper = elements[:, 4:]
            radial = upper - (upper @ axis)[..., None] * axis
            np.testing.assert_allclose(np.linalg.norm(radial, axis=2), numbers[6], rtol=1e-6)
            outward = np.cross(upper[:, 1] - upper[:, 0], upper[:, 2] - upper[:, 1])
            self.assertTrue((towards * (outward * radial[:, 0]).sum(axis=1) > 0).all())
            edges = elements[:, [1, 3, 4]] - elements[:, :1]
            self.assertTrue((np.linalg.det(edges) > 0).all())

    def test_two_bodies_touch_surface_to_surface(self):
        scene = read_flat(PROGRAM, INPUT / "foundation.inp", {"n": "2", "base": "3"})
        for kind in (SURFACES, MORTAR):
            lines = deck_lines(scene, Penalty(1e7, 1e6, 0.0, kind))
            self.assertIn(f"*CONTACT PAIR, INTERACTION=CONTACT1, TYPE={kind}", lines)
            slave, master = (lines.index(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
                             for name in ("SLAVE1", "MASTER1"))
            self.assertEqual(lines[slave + 4 : slave + 6][0].split(", ")[1], "S1")
            self.assertEqual(lines[master + 9].split(", ")[1], "S2")
        with self.assertRaisesRegex(DeckError, "two surfaces"):
            problem_arrays(scene)

    def test_finite_strain_has_its_cards(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "column.inp"
            path.write_text(COLUMN)
            scene = read_flat(PROGRAM, path, {})
        self.assertEqual(scene.supports, ["A-ZMIN", "B-ZMAX"])
        lines = deck_lines(scene, Penalty(0.0, 0.0, 0.0))
        for card, *data in (
            ("*HYPERELASTIC, OGDEN, N=3", "70, 2.4, -14, -1.2, 2, 5, 0.006, 1e30", "1e30"),
            ("*EXPANSION", "1e-05"),
            ("*HYPERELASTIC, NEO HOOKE", "100, 0.001"),
            ("*TIE, NAME=TIE1, ADJUST=NO", "TIESLAVE1, TIEMASTER1"),
            ("*INITIAL CONDITIONS, TYPE=TEMPERATURE", "ALLNODES, 0.", "1, 20."),
            ("*TIME POINTS, NAME=INCREMENTS1", "0.5,", "1,"),
            ("*TIME POINTS, NAME=INCREMENTS2", "1,"),
            ("*NODE PRINT, NSET=SUPPORT2, TOTALS=ONLY, TIME POINTS=INCREMENTS1", "RF"),
        ):
            at = lines.index(card)
            self.assertEqual(lines[at + 1 : at + 1 + len(data)], data, card)
        self.assertEqual(lines.count("*STEP, INC=1000000, NLGEOM"), 2)
        with self.assertRaisesRegex(DeckError, "finite strain; .TIE and .EXPANSION"):
            problem_arrays(scene)

    def test_sets_of_nodes_have_the_faces_of_their_nodes(self):
        deck = (INPUT / "foundation.inp").read_text()
        pair = "*CONTACT PAIR, INTERACTION=DRY\nBLOCK-ZMIN, BASE-ZMAX\n"
        self.assertEqual(deck.count(pair), 1)
        sets = ("*NSET, NSET=EDGE\n11\n*SURFACE, NAME=NODES, TYPE=NODE\nBLOCK-ZMIN\nEDGE\n"
                "*NSET, NSET=ALSO\nBASE-ZMAX\n*CONTACT PAIR, INTERACTION=DRY\nNODES, ALSO\n")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "sets.inp"
            path.write_text(deck.replace(pair, sets))
            overrides = {"n": "2", "base": "3"}
            found = read_flat(PROGRAM, path, overrides)
            expected = read_flat(PROGRAM, INPUT / "foundation.inp", overrides)
        self.assertEqual(sorted(found.faces["NODES"]), sorted(expected.faces["BLOCK-ZMIN"]))
        self.assertEqual(sorted(found.faces["ALSO"]), sorted(expected.faces["BASE-ZMAX"]))
        # Node 11, above the face, has no face among those of the surface.
        self.assertEqual(len(found.nodes_of("NODES")), 10)
        self.assertEqual(len(slave_nodes(found, found.pairs[0])), 9)
        self.assertIn("*SURFACE, NAME=SLAVE1, TYPE=ELEMENT",
                      deck_lines(found, Penalty(1e7, 1e6, 0.0, SURFACES)))

    def test_the_tolerance_is_put_in_anywhere(self):
        cards = (
            "*CONTACT SOLVER, SOLVER=AUTO,\n TOLERANCE=1e-3, STOP=RESIDUAL\n*STEP\n",
            "*contact  solver, solver=auto\n*STEP\n", "*CONTACT SOLVER\n*STEP\n", "*STEP\n",
            "*CONTACT SOLVER, TOLERANCE = <tolerance>\n*STEP\n",
        )
        for text in cards:
            changed = with_tolerance(text, "1e-12")
            self.assertEqual(changed.upper().count("TOLERANCE"), 1, changed)
            self.assertIn("TOLERANCE=1e-12", changed)
            self.assertLess(changed.index("TOLERANCE"), changed.index("*STEP"))

    def test_totals_are_read_from_a_dat_file(self):
        text = "".join(
            f"\n total force (fx,fy,fz) for set OBSTACLE{k} and time  {time}\n\n  {force}\n"
            for time, k, force in (
                ("0.1E+00", 1, "1.0E+00 2.0E+00 3.0E+00"), ("0.1E+00", 2, "4. 5. 6."),
                ("0.2E+00", 1, "7. 8. -9.E+00"),
            )
        )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "peer.dat"
            path.write_text(text)
            # The second increment is not complete, so it does not count.
            np.testing.assert_array_equal(read_resultants(path, 2), [[[1, 2, 3], [4, 5, 6]]])
            self.assertEqual(read_resultants(Path(folder) / "none", 2).shape, (0, 2, 3))
            path.write_text(
                text + " statistics for slave set SLAVE2, master set MASTER2 and time  0.2E+00\n\n"
                "   total surface force (fx,fy,fz) and moment about the origin (mx,my,mz)\n\n"
                "    1.0E+00  2.5E-01  -3.0E+00  9.  9.  9.\n"
            )
            last = read_resultants(path, 2)[-1]
        np.testing.assert_array_equal(last, [[7, 8, -9], [1, 0.25, -3]])

    def test_a_stopped_run_is_extrapolated_by_its_iterations(self):
        text = "SUMMARY\n  STEP  INC ATT ITER\n" + "".join(
            f"     {step}     {inc}     1     {i}      9  0.1E+00\n"
            for step, inc, count in ((1, 1, 5), (1, 2, 2), (2, 1, 1)) for i in range(1, count + 1)
        )
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "peer.cvg"
            path.write_text(text)
            self.assertEqual(count_iterations(path), (8, 3))
            self.assertEqual(count_iterations(Path(folder) / "none"), (0, 0))
        run = PeerRun("CalculiX", "", 120.0, 1e6, 1e-3, 2, 50, "stopped", 8, 116.0)
        self.assertEqual(run.whole_seconds, 120 / 8 * 116)
        whole = PeerRun("CalculiX", "", 120.0, 1e6, 1e-3, 50, 50, "", 8)
        self.assertEqual(whole.whole_seconds, 120)

    def test_every_load_has_its_set(self):
        scene = read_flat(PROGRAM, INPUT / "ssnv128.inp", {"n": "4"})
        lines = deck_lines(scene, Penalty(1e15, 1e14, 1.0))
        cards = [line for line in lines if line.startswith("*")]
        self.assertTrue(any(card.startswith("*DSLOAD") for card in cards))
        for k, line in enumerate(lines):
            if line.startswith("*BOUNDARY") or line.startswith("*DSLOAD"):
                name = lines[k + 1].split(",")[0]
                self.assertTrue(any(card.endswith(f"={name}") or f"={name}," in card
                                    for card in cards), name)


class ForGetFEM(unittest.TestCase):
    """What goes to GetFEM, what cannot, and what is read of its output."""

    def test_what_has_no_translation_is_named(self):
        for name, overrides, words in (
            ("tool", {}, "SPHERE"), ("hertz", {}, "CONTACT GAP"), ("ssnv128", {}, "DSLOAD"),
            ("slope", {}, "DLOAD"), ("quarter", {}, "BOUNDARY at contact points"),
            ("cantilever", {}, "no \\*CONTACT PAIR"), ("block", {"element": "C3D8I"}, "C3D8I"),
        ):
            with self.assertRaisesRegex(DeckError, words, msg=name):
                problem_arrays(read_flat(PROGRAM, INPUT / f"{name}.inp", overrides))

    def test_what_moves_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "cube.inp").write_text(CUBE)
            deck = Path(folder) / "odd.inp"
            deck.write_text(ODD)
            with self.assertRaisesRegex(DeckError, "REF NODE.*DSLOAD.*AMPLITUDE"):
                problem_arrays(read_flat(PROGRAM, deck, {}))

    def test_the_block_as_arrays(self):
        scene = read_flat(PROGRAM, INPUT / "block.inp", {"n": "2", "steps": "10", "theta": "0."})
        arrays = problem_arrays(scene)
        self.assertEqual(arrays["points"].shape, (27, 3))
        corners = arrays["points"][arrays["elements"][0]]
        np.testing.assert_allclose(corners[6] - corners[0], [0.5, 0.5, 0.5])
        np.testing.assert_allclose(
            arrays["lame"], np.tile([0.3 * 210000 / 1.3 / 0.4, 210000 / 2.6], (8, 1))
        )
        np.testing.assert_array_equal(arrays["points"][arrays["contact_nodes"], 2], 0)
        self.assertEqual(len(set(arrays["contact_nodes"])), 9)
        np.testing.assert_array_equal(arrays["gaps"], 0)
        np.testing.assert_array_equal(arrays["friction"], 0.3)
        self.assertAlmostEqual(arrays["augmentation"], 0.5)

    def test_held_values_grow_within_a_step(self):
        scene = read_flat(PROGRAM, INPUT / "block.inp", {"n": "1", "steps": "10", "theta": "0."})
        row_of = {node: row for row, node in enumerate(scene.nodes)}
        held, values = held_values(scene, row_of)
        self.assertEqual(values.shape, (10, 12))
        self.assertTrue((np.array(list(scene.nodes.values()))[held // 3, 2] == 1).all())
        push, down = values[:, held % 3 == 0], values[:, held % 3 == 2]
        np.testing.assert_allclose(down[:3, 0], [-0.05, -0.1, -0.1])
        np.testing.assert_allclose(push[:4, 0], [0, 0, 0.05, 0.1])
        np.testing.assert_allclose(push[-1], 0.4)

    def test_what_a_later_step_holds_is_refused(self):
        scene = read_flat(PROGRAM, INPUT / "block.inp", {"n": "1"})
        first = scene.steps[0].cards[0]
        first.loads = [load for load in first.loads if load.words[0] != "1"]
        row_of = {node: row for row, node in enumerate(scene.nodes)}
        with self.assertRaisesRegex(DeckError, "step 2 holds what step 1 left free"):
            held_values(scene, row_of)

    def test_forces_are_read_from_the_output(self):
        lines = [
            "Trace 2 in getfem: a line of the library",
            '{"iterations": 4, "converged": true, "seconds": 0.5, "forces": [[1, 2, 3]]}',
            '{"iterations": 100, "converged": false, "seconds": 2.5, "forces": [[4, 5, 6]]}',
            '{"iterations": 4, "conv',
        ]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "getfem.log"
            path.write_text("\n".join(lines))
            found = read_output(path, 1)
            nothing = read_output(Path(folder) / "none", 2)
        np.testing.assert_array_equal(found.forces, [[[1, 2, 3]]])
        self.assertEqual((found.iterations, found.increments, found.seconds), (104, 2, 2.5))
        self.assertEqual((nothing.forces.shape, nothing.increments), ((0, 2, 3), 0))


@unittest.skipIf(python_with_getfem() is None, "GetFEM is not installed")
class GetFEM(unittest.TestCase):
    """The peer itself: the same elements and the same law."""

    def error(self, *settings):
        """Return the error of GetFEM's run of the block with these settings."""
        words = [word for one in settings for word in ("--set", one)]
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "scripts" / "compare", INPUT / "block.inp", "--bipot",
             PROGRAM, "--penalty", "1e6", *words],
            capture_output=True, text=True, check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = [line.split("|") for line in done.stdout.splitlines() if "| GetFEM" in line]
        self.assertEqual(len(rows), 1, done.stdout)
        return float(rows[0][6])

    def test_it_has_the_same_elements(self):
        self.assertLess(self.error("n=2", "mu=0.", "nu=0.4"), 1e-10)

    def test_it_has_the_same_law(self):
        self.assertLess(self.error("n=3", "theta=20.", "steps=20"), 1e-8)


class Alone(unittest.TestCase):
    """Where no peer is installed."""

    def test_it_says_that_bipot_ran_alone(self):
        with tempfile.TemporaryDirectory() as empty:
            done = subprocess.run(
                [sys.executable, "-B", ROOT / "scripts" / "compare", INPUT / "block.inp", "--bipot",
                 PROGRAM, "--set", "n=1"],
                capture_output=True, text=True, check=False, env={**os.environ, "PATH": empty},
            )
        self.assertEqual(done.returncode, 77, done.stderr)
        self.assertIn("CalculiX is not installed", done.stdout)
        self.assertIn("GetFEM is not installed (Debian: apt-get install python3-getfem)",
                      done.stdout)
        self.assertIn("bipot", done.stdout)


@unittest.skipIf(shutil.which("ccx") is None, "CalculiX is not installed")
class CalculiX(unittest.TestCase):
    """The peer itself."""

    def test_its_error_falls_with_the_penalty(self):
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "scripts" / "compare", INPUT / "block.inp", "--bipot",
             PROGRAM, "--set", "n=2", "--penalty", "1e6,1e7,1e8"],
            capture_output=True, text=True, check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = [line.split("|") for line in done.stdout.splitlines() if line.startswith("|")][2:]
        rows = [row for row in rows if "GetFEM" not in row[1]]
        errors = [float(row[6]) for row in rows]
        self.assertEqual(len(errors), 4)
        self.assertLess(errors[0], 1e-8)
        for softer, stiffer in itertools.pairwise(errors[1:]):
            self.assertGreater(softer, 5 * stiffer)
        self.assertLess(errors[-1], 5e-3)

    def errors(self, deck, *words):
        """Return the errors of CalculiX's runs of a deck."""
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "scripts" / "compare", deck, "--bipot", PROGRAM, *words],
            capture_output=True, text=True, check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = [line for line in done.stdout.splitlines() if line.startswith("| CalculiX")]
        return [float(row.split("|")[6]) for row in rows]

    def test_a_cylinder_presses_as_here(self):
        error, = self.errors(INPUT / "roller.inp", "--set", "n=8")
        self.assertLess(error, 2e-3)

    def test_two_bodies_press_as_here_up_to_their_discretisations(self):
        words = ("--set", "n=2", "--set", "base=3", "--set", "steps=6")
        penalty, mortar = self.errors(INPUT / "foundation.inp", *words)
        self.assertLess(penalty, 0.1)
        self.assertLess(mortar, 0.1)

    def test_laws_ties_and_heat_at_finite_strain(self):
        """Heat is second order apart: CalculiX takes alpha dT off Green's strain (here 4e-4)."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "column.inp"
            cold = COLUMN.replace("1e-5\n", "0.\n")
            yeoh = "YEOH\n36., -6., 2., 0.006\n"
            others = cold.replace(COLUMN.split("*HYPERELASTIC, ")[1].split("*")[0], yeoh)
            self.assertNotEqual(others, cold)
            for text, limit in ((COLUMN, 3e-4), (cold, 1e-6), (others, 1e-6)):
                path.write_text(text)
                error, = self.errors(path)
                self.assertLess(error, limit)

    def test_the_penalty_is_raised_at_finite_strain(self):
        block = (INPUT / "block.inp").read_text().replace("*STEP\n", "*STEP, NLGEOM\n", 1)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "block.inp"
            path.write_text(block)
            errors = self.errors(path, "--set", "n=1")
        self.assertEqual(len(errors), 3)
        self.assertLess(errors[-1], 1e-4)

    def test_a_press_fit_by_clearance(self):
        """Rings alike whose meshes match: the error is the penalty's, and falls with it."""
        radial = deck_cards.quarter_ring("HUB", 1, (10.0, 20.0), (3, 9), 2.0)
        radial += deck_cards.quarter_ring("RING", 20001, (20.0, 30.0), (3, 9), 2.0)
        low = [first + k for first in (1, 20001) for k in range(4 * 10)]
        bore = [20001 + 4 * k for k in range(2 * 10)]
        cards = "".join(
            f"*NSET, NSET={name}\n" + "".join(f"{node}\n" for node in nodes)
            for name, nodes in (("LOW", low), ("BORE", bore))
        )
        text = deck_cards.deck(
            radial, "*MATERIAL, NAME=M\n*ELASTIC\n210000., 0.3\n"
            "*SOLID SECTION, ELSET=HUB, MATERIAL=M\n*SOLID SECTION, ELSET=RING, MATERIAL=M\n",
            cards, deck_cards.pair("RING-IN, HUB-OUT"), "*CONTACT GAP\nBORE, -0.0025\n",
            "*STEP\n*STATIC, DIRECT\n1., 1.\n*END STEP\n",
            held="HUB-X, 1\nHUB-Y, 2\nRING-X, 1\nRING-Y, 2\nLOW, 3",
        )  # fmt: skip
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "fit.inp"
            path.write_text(text)
            softer, stiffer = self.errors(path, "--penalty", "1e5,1e6")[:2]
            self.assertLess(softer, 5e-2)
            self.assertLess(stiffer, softer / 3)
            # One node of the bore has another gap: there is no clearance for that.
            path.write_text(text.replace("BORE, -0.0025\n", "BORE, -0.0025\n20001, -0.001\n"))
            done = subprocess.run(
                [sys.executable, "-B", ROOT / "scripts" / "compare", path, "--bipot", PROGRAM],
                capture_output=True, text=True, check=False,
            )
            self.assertIn("no gap that differs from node to node", done.stderr)

    def test_an_obstacle_moves_with_its_reference_node(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "cube.inp").write_text(CUBE)
            deck = Path(folder) / "odd.inp"
            deck.write_text(ODD)
            done = subprocess.run(
                [sys.executable, "-B", ROOT / "scripts" / "compare", deck, "--bipot", PROGRAM,
                 "--penalty", "1e9"],
                capture_output=True, text=True, check=False,
            )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("CalculiX", done.stdout)
        row = next(line for line in done.stdout.splitlines() if line.startswith("| CalculiX"))
        error = float(row.split("|")[6])
        self.assertLess(error, 1e-2, done.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
