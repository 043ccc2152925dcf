"""Random decks judged by the independent finite-element program of tests/judge."""

import os
import sys
import unittest

from judged import judge_decks
from program import LONG, SOURCE

sys.path.insert(0, str(SOURCE / "tests" / "judge"))

from body_scenes import random_bodies
from finite_elements import BLATZ_KO, MOONEY_RIVLIN, NEO_HOOKE, OGDEN, ST_VENANT, YEOH
from finite_scenes import random_finite
from random_scenes import random_scene
from scenes import deck_of
from step_scenes import random_steps

RELEASE = os.environ.get("BIPOT_BUILD_TYPE", "Release") == "Release"


@unittest.skipUnless(RELEASE, "no check of a Debug build sees the judge")
class Seeds(unittest.TestCase):
    """What is drawn by a seed."""

    def test_seeds_at_finite_strain_are_reproducible_and_varied(self):
        self.assertEqual(deck_of(random_finite(11)), deck_of(random_finite(11)))
        scenes = [random_finite(seed) for seed in range(100)]
        self.assertEqual({s.materials[m].law for s in scenes for m in s.material},
                         {ST_VENANT, NEO_HOOKE, MOONEY_RIVLIN, BLATZ_KO, YEOH, OGDEN})  # fmt: skip
        self.assertEqual({o.kind for s in scenes for o in s.obstacles},
                         {"PLANE", "SPHERE", "CYLINDER", "FACETS", "STL"})  # fmt: skip
        self.assertEqual(len({s.kind for s in scenes}), 8)

    def test_seeds_of_several_steps_are_reproducible_and_varied(self):
        self.assertEqual(deck_of(random_steps(11)), deck_of(random_steps(11)))
        scenes = [random_steps(seed) for seed in range(100)]
        self.assertEqual(len({s.kind for s in scenes}), 4)
        self.assertTrue(all("*BOUNDARY" in t.new for s in scenes for t in s.steps))
        # Bodies are held from above and later not, and the other way round.
        held = [["ZMAX" in str(b.name) for t in s.steps for b in t.boundaries] for s in scenes]
        self.assertTrue(any(h[0] != h[-1] for h in held if h))
        self.assertEqual({t.increments for s in scenes for t in s.steps}, {1, 2, 4})

    def test_seeds_of_bodies_are_reproducible_and_varied(self):
        self.assertEqual(deck_of(random_bodies(11)), deck_of(random_bodies(11)))
        scenes = [random_bodies(seed) for seed in range(200)]
        self.assertGreaterEqual(len({s.kind for s in scenes}), 10)
        self.assertEqual({o.kind for s in scenes for o in s.obstacles},
                         {"PLANE", "SPHERE", "CYLINDER", "FACETS", "STL"})  # fmt: skip
        pairs = [p for s in scenes for p in s.pairs]
        self.assertTrue(any(p.adjust is not None for p in pairs))
        self.assertTrue(any(p.small for p in pairs) and any(s.gaps for s in scenes))
        roles = [({p.part for p in s.pairs}, {p.master[0] for p in s.pairs if p.master})
                 for s in scenes]  # fmt: skip
        self.assertTrue(any(slaves & masters for slaves, masters in roles))
        self.assertTrue(any(s.ties and s.pairs for s in scenes))
        turns = [b for s in scenes for t in s.steps for b in t.boundaries if b.dof > 2]
        self.assertGreater(len(turns), 20)

    def test_seeds_are_reproducible_and_varied(self):
        self.assertEqual(deck_of(random_scene(11)), deck_of(random_scene(11)))
        scenes = [random_scene(seed) for seed in range(200)]
        self.assertGreaterEqual(len({s.kind for s in scenes}), 10)
        self.assertEqual({o.kind for s in scenes for o in s.obstacles},
                         {"PLANE", "SPHERE", "CYLINDER"})  # fmt: skip
        self.assertEqual({t for s in scenes for t in s.types}, {"C3D8", "C3D8I", "C3D8B"})


class Judged(unittest.TestCase):
    def judge(self, family, *options):
        """Run the judge on decks that must all be right, or rightly refused."""
        done = judge_decks(family, *options)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


@unittest.skipUnless(RELEASE, "takes minutes in a Debug build")
class Kept(Judged):
    """Decks that once failed."""

    def test_decks(self):
        # 10252: forces of rounding alone. 10335, 20079: bodies far apart in stiffness. 10404,
        # 30008: long thin elements that turn, and stiff ones beside soft ones. 20001: a block that
        # wedges as it is pushed on. 20040, 20166: loads on the nodes that contact holds. 30101: a
        # tool between nodes. 30179: a load path that begins out of balance. 60066: loads that
        # contact has no part in. 60316: a stiffness that has no factor. 61012: at rest, out of
        # balance by less than rounding of places is worth. 61425, 80246: friction that Newton's
        # method solves only as it grows from none. 70471: no factor in single precision alone.
        # 80092: a tool left without load where its nodes all but touch. 80129: stiff elements that
        # are carried far, whose forces are not as exact as long elements make it seem. 80336: mu =
        # 1e6, and points that slide under next to no force. 20785158: supports that take all loads,
        # and are let go. 20785165: a load where a free motion is at rest but for rounding.
        seeds = (10252, 10335, 10404, 20001, 20040, 20079, 20166, 30008, 30101, 30179, 60066, 60316,
                 61012, 61425, 70471, 80092, 80129, 80246, 80336, 20785158,
                 20785165)  # fmt: skip
        if LONG:
            # A wedge whose reactions made their own balance small. A body that tips over an edge.
            seeds += (20148, 71215)
        self.judge("one", "--only", *map(str, seeds))

    def test_bodies(self):
        # 20, 51, 83: increments in which nothing changes. 36, 563: without load. 77: a body that is
        # let go, in single precision. 128: a first touch with forces of rounding. 197: a plane of
        # symmetry that the plan did not see in reach. 982, 1020: bodies that rest, beside others.
        # 700: energy that contact gives in the increment before. 20785029: a hollow that turns a
        # face over, and would press it from behind. 20785075: a block beside its base, which
        # friction alone keeps upright. 60045: bodies that part, and forces of rounding.
        seeds = (20, 36, 51, 77, 83, 128, 197, 563, 700, 982, 1020, 60045, 20785029, 20785075)
        self.judge("bodies", "--only", *map(str, seeds))

    def test_decks_at_finite_strain(self):
        # 314: a law that is pressed beyond its ellipticity. 548: an increment in which nothing
        # presses or moves.
        seeds = ("314", "548")
        if LONG:
            # A face that is folded as the face before it sees it. A block that buckles, seen with
            # smaller increments.
            seeds += ("20785024", "303")
        self.judge("finite", "--only", *seeds)

    def test_decks_of_several_steps(self):
        # 71045: distorted faces that are covered wholly, and keep their mean gaps.
        self.judge("steps", "--only", "71045")

    def test_decks_without_separation(self):
        # 106: a block that slides where nothing presses; all its forces are rounding. 71111: small
        # sliding of faces that are covered in part. 81053: a pull that is taken off.
        self.judge("closed", "--only", "106", "71111", "81053")


@unittest.skipUnless(LONG or not RELEASE, "the Debug tree judges them")
class Drawn(Judged):
    """Decks of one seed, of every family; scripts/test --full judges hundreds, others each day."""

    def test_each_family(self):
        seed = "1" if RELEASE else "1001"
        for family, n in (("one", 10), ("bodies", 4), ("steps", 4), ("closed", 4), ("finite", 2),
                          ("axes", 2)):
            with self.subTest(family=family):
                self.judge(family, "--decks", str(4 * n if LONG else n), "--seed", seed)


if __name__ == "__main__":
    unittest.main()
