"""Meshes of elements of a plane, with their cards."""


class PlaneMesh:
    """Elements over the unit square, row by row, with their nodes where `place` puts them."""

    def __init__(self, kind, n, place, name="A", first_node=0, first_element=0):
        self.kind, self.name, self.middles = kind, name, kind[3] in "68"
        self.at, self.lines, self.elements = {}, [], []
        self.place, self.first_node, self.first_element = place, first_node, first_element
        self.sides = {side: [] for side in ("BOTTOM", "RIGHT", "TOP", "LEFT")}
        self.step = 2 if self.middles else 1
        self.n = n
        for j in range(n[1]):
            for i in range(n[0]):
                on = {
                    "BOTTOM": j == 0,
                    "RIGHT": i == n[0] - 1,
                    "TOP": j == n[1] - 1,
                    "LEFT": i == 0,
                }
                self.add_cell(
                    [(i + a, j + b) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))],
                    [side if on[side] else "" for side in ("BOTTOM", "RIGHT", "TOP", "LEFT")],
                )

    def add_cell(self, corner, side):
        """Add a quadrilateral, or two triangles."""
        if self.kind[3] in "36":
            self.add(corner[:3], [side[0], side[1], ""])
            self.add([corner[0], corner[2], corner[3]], ["", side[2], side[3]])
        else:
            self.add(corner, side)

    def add(self, corner, side):
        """Add an element, each of whose edges may be on a side."""
        corner = [(self.step * a, self.step * b) for a, b in corner]
        after = corner[1:] + corner[:1]
        between = [
            ((a + c) // 2, (b + d) // 2) for (a, b), (c, d) in zip(corner, after, strict=True)
        ]
        nodes = [self.node(p) for p in corner + (between if self.middles else [])]
        number = self.first_element + len(self.elements) + 1
        self.elements.append(", ".join(map(str, [number, *nodes])))
        for k, name in enumerate(side):
            if name:
                self.sides[name].append(f"{number}, S{k + 1}")

    def node(self, p):
        """Return the number of the node at a place of the grid."""
        if p not in self.at:
            self.at[p] = self.first_node + len(self.at) + 1
            x, y = self.place(p[0] / (self.step * self.n[0]), p[1] / (self.step * self.n[1]))
            self.lines.append(f"{self.at[p]}, {x!r}, {y!r}")
        return self.at[p]

    @property
    def deck(self):
        """Nodes, elements, sets and surfaces, and the section."""
        last = self.step * self.n[0], self.step * self.n[1]
        on = {
            "BOTTOM": lambda p: p[1] == 0,
            "RIGHT": lambda p: p[0] == last[0],
            "TOP": lambda p: p[1] == last[1],
            "LEFT": lambda p: p[0] == 0,
        }
        text = [f"*NODE, NSET={self.name}ALL", *(line + ", 0." for line in self.lines)]
        text += [f"*ELEMENT, TYPE={self.kind}, ELSET={self.name}", *self.elements]
        for side, faces in self.sides.items():
            text += [f"*NSET, NSET={self.name}{side}-N"]
            text += [str(number) for p, number in self.at.items() if on[side](p)]
            text += [f"*SURFACE, NAME={self.name}{side}", *faces]
        return "\n".join(text) + "\n"
