"""Elements of eight nodes: internal forces, stiffness, weight and pressure, in extended precision.

Voigt order xx, yy, zz, xy, yz, xz with engineering shear strains. Numbers of equations are those of
docs/theory.md; the formulas here are the textbook's own, in another form than the program's.
"""

import numpy as np

REAL = np.longdouble

# Corners of the parent cube in the order of the nodes, and its Gauss points.
CORNERS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
     (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], dtype=REAL,
)  # fmt: skip
GAUSS = CORNERS / np.sqrt(REAL(3))

# Nodes of the faces S1 to S6, anticlockwise as seen from outside.
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def shape_functions(xi):
    """Values (8,) of the trilinear functions at `xi` (3,)."""
    return np.prod(1 + CORNERS * xi, axis=1) / 8


def parent_gradients(xi):
    """Derivatives (8, 3) of the trilinear functions by the parent coordinates at `xi`."""
    factors = 1 + CORNERS * xi
    out = np.empty((8, 3), dtype=REAL)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[:, i] = CORNERS[:, i] * factors[:, j] * factors[:, k] / 8
    return out


def inverse_and_determinant(matrix):
    """Inverses (n, 3, 3) and determinants (n,) of 3x3 matrices, by cofactors."""
    a, b, c = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    determinant = np.einsum("ni,ni->n", a, np.cross(b, c))
    return columns / determinant[:, None, None], determinant


def strain_rows(gradient):
    """The (n, 6, 3k) matrices that turn k vectors with `gradient` (n, k, 3) into strains."""
    n, k, _ = gradient.shape
    b = np.zeros((n, 6, k, 3), dtype=REAL)
    for i in range(3):
        b[:, i, :, i] = gradient[:, :, i]
    for row, (i, j) in enumerate(((0, 1), (1, 2), (0, 2)), start=3):
        b[:, row, :, i] = gradient[:, :, j]
        b[:, row, :, j] = gradient[:, :, i]
    return b.reshape(n, 6, 3 * k)


class Elements:
    """Elements of a scene: `nodes` (E, 8) rows of `points` (N, 3), types and Lame's constants."""

    def __init__(self, points, nodes, types, young, poisson, axes=None):
        """`axes`: of each element, None where it is isotropic."""
        self.points = np.asarray(points, dtype=REAL)
        self.nodes, self.types = np.asarray(nodes), np.asarray(types)
        young, poisson = np.asarray(young, dtype=REAL), np.asarray(poisson, dtype=REAL)
        self.lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        self.shear = young / (2 * (1 + poisson))
        x = self.points[self.nodes]
        elements = len(self.nodes)
        self.b = np.zeros((elements, 8, 6, 24), dtype=REAL)
        self.weight = np.zeros((elements, 8), dtype=REAL)
        self.gradients = gradients = np.zeros((elements, 8, 8, 3), dtype=REAL)
        for g, xi in enumerate(GAUSS):
            dn = parent_gradients(xi)
            jacobian = np.einsum("eai,aj->eij", x, dn)  # dx_i/dxi_j
            inverse, determinant = inverse_and_determinant(jacobian)
            gradients[:, g] = np.einsum("aj,eji->eai", dn, inverse)
            self.weight[:, g] = determinant
            self.b[:, g] = strain_rows(gradients[:, g])
        if np.any(self.weight <= 0):
            raise ValueError("an element is inside out")
        self._take_mean_dilatation(gradients)
        self._take_axes(x, axes or [None] * elements)
        self._add_modes(x)
        size = np.einsum("eg,egai,egai->ea", self.weight, gradients, gradients)
        # Stiffness of a node times a length: what rounding of a displacement makes of forces.
        largest = np.abs(self.lame) + 2 * self.shear
        for element, c in self.along.items():
            largest[element] = np.linalg.eigvalsh(c.astype(float)).max()
        self.size = (largest * size.max(axis=1)).astype(float)

    def _take_axes(self, x, axes):
        """The stiffness (8, 6, 6) of elements that are not isotropic, along x, y, z."""
        shapes = np.array([shape_functions(xi) for xi in GAUSS])
        self.along = {}
        for element, one in enumerate(axes):
            if one is not None:
                self.along[element] = one.at((shapes @ x[element]).astype(float)).astype(REAL)

    def _take_mean_dilatation(self, gradients):
        """C3D8B: the element's mean volume change takes the place of the points' (8.8)."""
        chosen = self.types == "C3D8B"
        volume = self.weight.sum(axis=1)
        mean = np.einsum("eg,egai->eai", self.weight, gradients) / volume[:, None, None]
        change = (mean[:, None] - gradients).reshape(len(self.nodes), 8, 24) / 3
        for i in range(3):
            self.b[chosen, :, i, :] += change[chosen]

    def _add_modes(self, x):
        """C3D8I: the strains of the nine modes (8.5), and their stiffness."""
        centre = parent_gradients(np.zeros(3, dtype=REAL))
        inverse, determinant = inverse_and_determinant(np.einsum("eai,aj->eij", x, centre))
        self.modes = np.zeros((len(x), 8, 6, 9), dtype=REAL)
        for g, xi in enumerate(GAUSS):
            # The gradient of 1 - xi_k^2 by parent coordinates is -2 xi_k along k.
            slope = np.einsum("k,eki->eki", -2 * xi, inverse)
            slope *= (determinant / self.weight[:, g])[:, None, None]
            self.modes[:, g] = strain_rows(slope)
        self.modes[self.types != "C3D8I"] = 0
        stressed = self.stress(self.modes)
        self.mode_stiffness = np.einsum("eg,egsi,egsj->eij", self.weight, self.modes, stressed)
        unused = self.types != "C3D8I"
        self.mode_stiffness[unused] = np.eye(9)

    def least_volume(self, u):
        """The least det(I + grad u) at the Gauss points: not above 0, an element is inside out."""
        moved = (self.points + np.asarray(u, dtype=REAL))[self.nodes]
        parts = [
            inverse_and_determinant(np.einsum("eai,aj->eij", moved, parent_gradients(xi)))[1]
            for xi in GAUSS
        ]
        return float((np.stack(parts, axis=1) / self.weight).min())

    def stress(self, strain):
        """Hooke's law for strains (E, 8, 6, ...)."""
        shape = (-1, 1) + (1,) * (strain.ndim - 3)
        out = np.empty_like(strain)
        trace = strain[:, :, :3].sum(axis=2)
        for i in range(3):
            out[:, :, i] = self.lame.reshape(shape) * trace
            out[:, :, i] += 2 * self.shear.reshape(shape) * strain[:, :, i]
            out[:, :, 3 + i] = self.shear.reshape(shape) * strain[:, :, 3 + i]
        for element, c in self.along.items():
            out[element] = np.einsum("gst,gt...->gs...", c, strain[element])
        return out

    def solve_modes(self, right):
        """Solve for the modes (E, 9, ...), refined in extended precision."""
        matrix = self.mode_stiffness.astype(float)
        scale = np.sqrt(np.einsum("eii->ei", matrix))
        scaled = matrix / (scale[:, :, None] * scale[:, None, :])
        flat = right.reshape(len(right), 9, -1)
        out = np.zeros_like(flat)
        for _ in range(3):
            left = flat - np.einsum("eij,ejk->eik", self.mode_stiffness, out)
            step = np.linalg.solve(scaled, (left / scale[:, :, None]).astype(float))
            out += step / scale[:, :, None]
        return out.reshape(right.shape)

    def internal_force(self, u):
        """Forces (N, 3) of the stresses of displacements `u` (N, 3), float."""
        u = np.asarray(u, dtype=REAL)
        # An element's own translation takes no part in its strains.
        local = (u[self.nodes] - u[self.nodes[:, :1]]).reshape(len(self.nodes), 24)
        strain = np.einsum("egsi,ei->egs", self.b, local)
        driven = np.einsum("eg,egsi,egs->ei", self.weight, self.modes, self.stress(strain))
        alpha = -self.solve_modes(driven)
        strain = strain + np.einsum("egsi,ei->egs", self.modes, alpha)
        force = np.einsum("eg,egsi,egs->ei", self.weight, self.b, self.stress(strain))
        out = np.zeros_like(u)
        np.add.at(out, self.nodes, force.reshape(-1, 8, 3))
        return out.astype(float)

    def thermal_force(self, expansion, rise):
        """Forces (N, 3) that the stress of a hindered expansion puts on nodes.

        `expansion` (E,), `rise` of the temperature (N,): an element takes the mean of its nodes.
        """
        strain = np.asarray(expansion, dtype=REAL) * np.asarray(rise)[self.nodes].mean(axis=1)
        strain = np.broadcast_to(strain[:, None, None], (len(strain), 8, 3))
        stress = self.stress(np.concatenate([strain, np.zeros_like(strain)], axis=2))
        # What the modes take of it: their stress does no work on a stress that is constant.
        driven = np.einsum("eg,egsi,egs->ei", self.weight, self.modes, stress)
        answer = np.einsum("egsi,ei->egs", self.modes, self.solve_modes(driven))
        force = np.einsum("eg,egsi,egs->ei", self.weight, self.b, stress - self.stress(answer))
        out = np.zeros(self.points.shape, dtype=REAL)
        np.add.at(out, self.nodes, force.reshape(-1, 8, 3))
        return out.astype(float)

    def stiffness(self):
        """The dense matrix (3N, 3N), float."""
        stressed = self.stress(self.b)
        k = np.einsum("eg,egsi,egsj->eij", self.weight, self.b, stressed)
        coupling = np.einsum("eg,egsi,egsj->eij", self.weight, self.modes, stressed)
        k -= np.einsum("eki,ekj->eij", coupling, self.solve_modes(coupling))
        n = 3 * len(self.points)
        out = np.zeros((n, n), dtype=REAL)
        dofs = (3 * self.nodes[:, :, None] + np.arange(3)).reshape(len(self.nodes), 24)
        for matrix, at in zip(k, dofs, strict=True):
            out[np.ix_(at, at)] += matrix
        return ((out + out.T) / 2).astype(float)

    def rounding(self, u):
        """What 32 units in the last place of displacements make of nodal forces, (N,)."""
        largest = np.abs(u[self.nodes]).max(axis=(1, 2))
        out = np.zeros(len(u))
        np.add.at(out, self.nodes, (32 * np.finfo(float).eps * self.size * largest)[:, None])
        return out

    def node_size(self):
        """The stiffness of each node (N,) while all others are held; no direction is stiffer."""
        out = np.zeros(len(self.points))
        np.add.at(out, self.nodes, self.size[:, None])
        return out

    def weights(self, density, which):
        """Integrals (N,) of the shape functions times `density` (E,) over the elements `which`."""
        shapes = np.array([shape_functions(xi) for xi in GAUSS])
        masses = np.einsum("eg,ga->ea", self.weight[which], shapes)
        masses *= np.asarray(density, dtype=REAL)[which][:, None]
        out = np.zeros(len(self.points), dtype=REAL)
        np.add.at(out, self.nodes[which], masses)
        return out.astype(float)

    def pressure_force(self, faces, u=0.0):
        """Forces (N, 3) of a unit pressure into the body on `faces` [(element, 0..5)].

        Displacements `u` (N, 3) take the faces with them.
        """
        return self.pushed(faces, u)[0].astype(float)

    def node_areas(self, faces):
        """The part (N,) of the area of `faces` that belongs to each node: int N dA."""
        return self.pushed(faces)[1].astype(float)

    def node_moments(self, faces):
        """int N x dA (N, 3) over `faces`."""
        return self.pushed(faces)[2].astype(float)

    def pushed(self, faces, u=0.0):
        """Forces of a unit pressure, areas and int N x dA, by 2 x 2 Gauss points of each face."""
        out = np.zeros(self.points.shape, dtype=REAL)
        moment = np.zeros(self.points.shape, dtype=REAL)
        area = np.zeros(len(self.points), dtype=REAL)
        root = 1 / np.sqrt(REAL(3))
        places = self.points + np.asarray(u, dtype=REAL)
        for element, face in faces:
            corners = self.nodes[element][list(FACES[face])]
            x = places[corners]
            for s in (-root, root):
                for t in (-root, root):
                    n = np.array([(1 - s) * (1 - t), (1 + s) * (1 - t),
                                  (1 + s) * (1 + t), (1 - s) * (1 + t)]) / 4  # fmt: skip
                    along_s = np.array([-(1 - t), 1 - t, 1 + t, -(1 + t)]) / 4 @ x
                    along_t = np.array([-(1 - s), -(1 + s), 1 + s, 1 - s]) / 4 @ x
                    normal = np.cross(along_s, along_t)
                    out[corners] -= np.outer(n, normal)
                    part = n * np.sqrt(normal @ normal)
                    area[corners] += part
                    moment[corners] += np.outer(part, n @ x)
        return out, area, moment
