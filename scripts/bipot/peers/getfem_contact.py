#!/usr/bin/python3
"""Solve increments of contact with friction in GetFEM; run with a Python that has `getfem`.

    python3 getfem_contact.py PROBLEM.npz

getfem_problem.py writes the problem. Every increment's forces are a line of JSON on the output:
{"iterations": Newton's, "converged": true, "seconds": processor time so far, "forces": [[x, y, z]
on the body of each pair]}. The status is 0, or 2 behind an increment in which Newton's iterations
did not end.

The unknowns of an increment are the free entries of the increment of displacement, so that friction
acts on it, and the normal and tangential forces of every contact point: GetFEM's basic contact
brick, in its first version, the augmented Lagrangian of Alart and Curnier. Forces are divided by
the largest Young's modulus: GetFEM's residual adds forces and, from the law of contact, lengths.
"""

import json
import sys
import time

import getfem as gf
import numpy as np

# Corners of an 8-node element in the order of GetFEM's reference cube: x fastest, then y, then z.
LEXICOGRAPHIC = [0, 1, 3, 2, 4, 5, 7, 6]
# Integration that is exact to the third degree in each direction: 2 x 2 x 2 points of Gauss.
ELEMENT, DEGREE_3 = "FEM_QK(3,1)", "IM_GAUSS_PARALLELEPIPED(3,3)"


def stiffness(problem, modulus):
    """Return the stiffness over `modulus` as a Spmat, and the numbers (N, 3) of its equations."""
    points, elements = problem["points"], problem["elements"]
    mesh = gf.Mesh("empty", 3)
    cube = gf.GeoTrans("GT_QK(3,1)")
    for corners in elements:
        mesh.add_convex(cube, points[corners[LEXICOGRAPHIC]].T)
    displacement = gf.MeshFem(mesh, 3)
    displacement.set_fem(gf.Fem(ELEMENT))
    constant = gf.MeshFem(mesh, 1)
    constant.set_fem(gf.Fem("FEM_QK(3,0)"))
    equations = np.full((len(points), 3), -1)
    order = np.empty(len(elements), dtype=int)
    for k, corners in enumerate(elements):
        equations[corners[LEXICOGRAPHIC]] = displacement.basic_dof_from_cvid(k)[0].reshape(8, 3)
        order[constant.basic_dof_from_cvid(k)[0]] = k
    if displacement.nbdof() != equations.size or len(np.unique(equations)) != equations.size:
        sys.exit("getfem_contact.py: nodes at one place are one node in GetFEM's mesh")
    lame = problem["lame"][order] / modulus
    matrix = gf.asm_linear_elasticity(
        gf.MeshIm(mesh, gf.Integ(DEGREE_3)), displacement, constant, lame[:, 0], lame[:, 1]
    )
    return matrix, equations


def across(normals):
    """Return two unit vectors across each normal, (C, 2, 3)."""
    along = np.eye(3)[np.argmin(abs(normals), axis=1)]
    first = np.cross(along, normals)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first)], axis=1)


def rows_of(vectors, columns, n_columns):
    """Return a Spmat whose rows are products of vectors (C, 3) with entries `columns` (C, 3)."""
    matrix = gf.Spmat("empty", len(vectors), n_columns)
    for k, (vector, places) in enumerate(zip(vectors, columns, strict=True)):
        for value, place in zip(vector, places, strict=True):
            if value != 0:
                matrix[k, int(place)] = value
    return matrix


class Contact:
    """The model of an increment, and what it leads to."""

    def __init__(self, problem):
        self.problem = problem
        self.modulus = float(problem["modulus"])
        self.matrix, equations = stiffness(problem, self.modulus)
        self.held = equations.reshape(-1)[problem["held"]]
        self.free = np.setdiff1d(np.arange(equations.size), self.held)
        self.u = np.zeros(equations.size)
        self.places = equations[problem["contact_nodes"]]  # (C, 3)
        self.normals = problem["normals"]
        self.tangents = across(self.normals)
        self.model = self.make_model()

    def make_model(self):
        """Return GetFEM's model: elasticity of the free entries, contact, a right-hand side."""
        problem, n = self.problem, len(self.normals)
        column = np.full(self.u.size, -1)
        column[self.free] = np.arange(len(self.free))
        places = column[self.places]
        model = gf.Model("real")
        model.add_variable("du", len(self.free))
        free = gf.Spmat("copy", self.matrix, self.free, self.free)
        model.add_explicit_matrix("du", "du", free, 1, 1)
        self.load = model.add_explicit_rhs("du", np.zeros(len(self.free)))
        model.add_variable("normal", n)
        model.add_variable("tangential", 2 * n)
        # The augmentation is a force over a length, here over the modulus.
        model.add_initialized_data("r", [float(problem["augmentation"])])
        model.add_initialized_data("friction", problem["friction"])
        model.add_initialized_data("gap", np.zeros(n))
        model.add_initialized_data("alpha", np.ones(n))
        approach = rows_of(-self.normals, places, len(self.free))
        slip = rows_of(self.tangents.reshape(-1, 3), np.repeat(places, 2, axis=0), len(self.free))
        model.add_basic_contact_brick(
            "du", "normal", "tangential", "r", approach, slip, "friction", "gap", "alpha", 1
        )
        return model

    def advance(self, values):
        """Solve the increment that brings the held entries to `values`; return its record."""
        known = np.zeros(self.u.size)
        known[self.held] = values - self.u[self.held]
        self.model.set_private_rhs(self.load, -self.matrix.mult(self.u + known)[self.free])
        gap = self.problem["gaps"] + (self.normals * self.u[self.places]).sum(axis=1)
        self.model.set_variable("gap", gap)
        # Newton's iterations begin at the displacement and forces of the increment before.
        iterations, converged = self.model.solve(
            "max_res", float(self.problem["tolerance"]), "max_iter", 100, "lsolver", "mumps"
        )[:2]
        self.u += known
        self.u[self.free] += self.model.variable("du")
        # GetFEM's normal force is negative: it acts along the rows -n of the approach.
        tangential = self.model.variable("tangential").reshape(-1, 2, 1)
        on_points = (tangential * self.tangents).sum(axis=1)
        on_points -= self.model.variable("normal")[:, None] * self.normals
        pairs = self.problem["pairs"]
        forces = [on_points[pairs == k].sum(axis=0) for k in range(pairs.max() + 1)]
        return {
            "iterations": int(iterations), "converged": bool(converged),
            "seconds": time.process_time(),
            "forces": (self.modulus * np.array(forces)).tolist(),
        }


def main():
    """Solve the increments of the problem named on the command line."""
    with np.load(sys.argv[1]) as file:
        problem = dict(file)
    contact = Contact(problem)
    for values in problem["values"]:
        record = contact.advance(values)
        print(json.dumps(record), flush=True)
        if not record["converged"]:
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
