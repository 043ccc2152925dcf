"""Elements of nearly incompressible material: what the page of decks says of forces and limits.

A quarter of a flat block, pressed on a ball of five times its size: eight elements along each edge,
four of second order. Forces are those over that of C3D8B, which does not lock.
"""

import unittest

from boxes import DRY, FLOOR, Box, BoxCase
from program import Run

# Poisson's ratio, force over that of C3D8B; None: refused.
FORCES = {
    "C3D4": {0.48: 1.32, 0.481: None},
    "C3D6": {0.49: 1.24, 0.491: None},
    "C3D8": {0.49: 1.18, 0.499: 1.85},
    "C3D13": {0.495: 1.09, 0.496: None},
    "C3D15": {0.495: 1.11, 0.496: None},
    "C3D20": {0.499: 1.17, 0.4991: None},
    "C3D10": {0.4999: 1.12},
    "C3D20R": {0.4999: 1.07},
}


class Locking(BoxCase):
    def deck(self, kind, poisson):
        """Return the deck of a type."""
        n = 4 if kind in ("C3D10", "C3D13", "C3D15", "C3D20", "C3D20R") else 8
        box = Box("B", (n, n, n), ("C3D8" if kind == "C3D8B" else kind,), size=(4, 4, 4), shift=0)
        cards = box.cards()
        if kind == "C3D8B":
            cards = cards.replace("TYPE=C3D8,", "TYPE=C3D8B,")
        return (
            cards + f"*MATERIAL, NAME=STEEL\n*ELASTIC\n1000., {poisson}\n" + DRY + FLOOR
            + "*CONTACT GAP, PARABOLA\nB-Z0, 0., 0., 0., 20.\n*BOUNDARY\nB-X0, 1\nB-Y0, 2\n"
            "*STEP\n*STATIC, DIRECT\n1., 1.\n*BOUNDARY\nB-Z1, 1, 2, 0.\nB-Z1, 3, 3, -0.06\n"
            "*END STEP\n"
        )

    def force(self, kind, poisson):
        return self.solve(self.deck(kind, poisson)).pairs[0].resultant[-1, 2]

    def test_forces_and_limits(self):
        for kind, forces in FORCES.items():
            for poisson, wanted in forces.items():
                with self.subTest(kind=kind, poisson=poisson):
                    if wanted is None:
                        run = Run(self.deck(kind, poisson), name="deck")
                        self.assertEqual(run.status, 1, run.output)
                        self.assertIn("locks with a Poisson's ratio of", run.errors)
                        continue
                    part = self.force(kind, poisson) / self.force("C3D8B", poisson)
                    self.assertAlmostEqual(part, wanted, delta=0.006)

    def test_what_locks_is_noted(self):
        for kind, noted in (("C3D8", True), ("C3D20", True), ("C3D8B", False), ("C3D10", False)):
            for poisson in (0.45, 0.451):
                with self.subTest(kind=kind, poisson=poisson):
                    run = Run(self.deck(kind, poisson), "--plan", name="deck")
                    self.assertEqual(run.status, 0, run.errors)
                    words = "are too stiff with a Poisson's ratio of"
                    self.assertEqual(words in run.output, noted and poisson > 0.45)


class BentBeam(BoxCase):
    """A beam that a support bends over a drum: what its run says of its elements."""

    def run_of(self, kind, drum=-3.1):
        """Return the run of a type, and of where the axis of the drum is."""
        deck = (
            f"*BLOCK, NAME=B, TYPE={kind}, NX=10, NY=1, NZ=1\n0., 0., 0., 10., 1., 1.\n"
            "*MATERIAL, NAME=STEEL\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=B, MATERIAL=STEEL\n"
            "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.3\n*OBSTACLE, NAME=DRUM, TYPE=CYLINDER\n"
            f"3.71, 0., {drum}, 0., 1., 0., 3.\n*CONTACT PAIR, INTERACTION=I\nB-ZMIN, DRUM\n"
            "*STEP\n*STATIC, DIRECT\n0.25, 1.\n*BOUNDARY\nB-XMIN, 1, 3\nB-XMAX, 3, 3, -1.\n"
            "*END STEP\n"
        )
        return Run(deck, name="deck")

    def test_the_type_that_bends_is_named(self):
        locked, bent = self.run_of("C3D8"), self.run_of("C3D8I")
        self.assertRegex(
            locked.output,
            r"note: the largest known part of the error is the mesh's \([\d.]+ %\): C3D8 bends too "
            r"stiffly \([\d.]+ % of its strain energy\): C3D8I takes about [\d.e-]+ s of CPU time; "
            r"--refine 1 takes about [\d.e-]+ s of CPU time",
        )
        self.assertNotIn("bends too stiffly", bent.output)
        self.assertIn("the largest known part of the error is that of geometry", bent.output)
        apart = self.run_of("C3D8", drum=-6.0)
        self.assertEqual(apart.status, 0, apart.errors)
        self.assertNotIn("the largest known part of the error", apart.output)


if __name__ == "__main__":
    unittest.main()
