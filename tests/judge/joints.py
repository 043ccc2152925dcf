"""What equations, couplings and supports along local directions make nodes do, from the deck alone.

All are lines u[row, dof] = sum of coefficients times others. Rotations of reference nodes have rows
of their own: the rotation times the longest arm. So have displacements along local directions that
supports prescribe (stand-ins). No result file has such rows: they are made of what it has.
"""

from itertools import combinations

import numpy as np
from scenes import EPS


class Joints:
    """`lines` {(row, dof): {(row, dof): share}} of a scene whose directions (N, 3) are `held`."""

    def __init__(self, scene, held):
        self.scene, self.lines = scene, {}
        axes = {row: one.directions(scene.points[row]) for one in scene.transforms
                for row in one.rows}  # fmt: skip
        for one in scene.equations:
            for line in zip(*[rows for rows, _, _ in one.terms], strict=True):
                dofs = [dof for _, dof, _ in one.terms]
                weights = [weight for _, _, weight in one.terms]
                terms = {}
                for row, dof, weight in list(zip(line, dofs, weights, strict=True))[1:]:
                    for k, share in enumerate(axes[row][dof] if row in axes else np.eye(3)[dof]):
                        if share:
                            more = share * weight / weights[0]
                            terms[row, k] = terms.get((row, k), 0.0) - more
                self.lines[line[0], dofs[0]] = terms
        for one in scene.couplings:
            (self.follow if one.kinematic else self.take_mean)(one)
        for one in scene.transforms:
            for row, stand_in in zip(one.rows, one.stand_ins, strict=True):
                self.hold_along(row, stand_in, one.directions(scene.points[row]), held)

    def follow(self, one):
        """Nodes of a surface go with their reference node: u_r + theta x arm."""
        scene = self.scene
        longest = scene.longest_arm(one)
        for row in scene.side_rows(one.part, one.side):
            arm = scene.points[row] - scene.points[one.reference]
            for i in one.dofs:
                terms = {(one.reference, i): 1.0}
                j, k = (i + 1) % 3, (i + 2) % 3
                terms[one.rotation, j] = arm[k] / longest
                terms[one.rotation, k] = -arm[j] / longest
                self.lines[int(row), i] = terms

    def take_mean(self, one):
        """A reference node goes with its surface: the fit of a rigid motion over the area."""
        scene = self.scene
        rows = scene.side_rows(one.part, one.side)
        faces = scene.parts[one.part].sides[one.side]
        elements = scene.elements()
        share = elements.node_areas(faces)[rows]
        area = share.sum()
        share /= area
        middle = share @ scene.points[rows]
        arm = scene.points[rows] - middle
        # int N_n (x - middle) dA / area
        lever = elements.node_moments(faces)[rows] / area - np.outer(share, middle)
        inertia = np.einsum("nk,nk", lever, arm) * np.eye(3) - lever.T @ arm
        inverse = np.linalg.inv(inertia)
        # theta_i = inverse_ij (lever_n x u_n)_j
        cross = np.array([np.cross(a, np.eye(3)).T for a in lever])  # (n, i, k): (lever x e_k)_i
        turn = np.einsum("ij,njk->ink", inverse, cross)
        beyond = scene.points[one.reference] - middle
        shift = np.einsum("n,ik->ink", share, np.eye(3))
        shift += np.cross(turn, beyond, axis=0)
        longest = scene.longest_arm(one)
        for target, of, scale in ((one.reference, shift, 1.0), (one.rotation, turn, longest)):
            for i in range(3):
                terms = {(int(r), k): scale * of[i, n, k] for n, r in enumerate(rows)
                         for k in range(3)}  # fmt: skip
                self.lines[target, i] = terms

    def hold_along(self, row, stand_in, directions, held):
        """Supports along `directions` (3, 3) of a node: as many components as these depend."""
        named = [k for k in range(3) if held[stand_in, k]]
        if not named:
            return
        rows = directions[named]
        chosen = max(combinations(range(3), len(named)),
                     key=lambda c: abs(np.linalg.det(rows[:, c])))  # fmt: skip
        others = [k for k in range(3) if k not in chosen]
        inverse = np.linalg.inv(rows[:, chosen])
        for i, dof in enumerate(chosen):
            terms = {(stand_in, k): inverse[i, n] for n, k in enumerate(named)}
            for other in others:
                terms[row, other] = -inverse[i] @ rows[:, other]
            self.lines[row, dof] = terms

    def hand_over(self, force):
        """(forces (N, 3) with those on what depends handed to others, what that added to nodes)."""
        force, before = force.copy(), force
        for _ in range(20):
            waiting = [key for key in self.lines if force[key] != 0.0]
            if not waiting:
                break
            for key in waiting:
                taken, force[key] = force[key], 0.0
                for other, share in self.lines[key].items():
                    force[other] += share * taken
        else:
            raise ValueError("constraints lead back to themselves")
        return force, force - before

    def spread(self, size):
        """Sizes (N,) of forces, with what is handed over to each node."""
        out = size.copy()
        for _ in range(3 if self.lines else 0):
            more = size.copy()
            for (row, _), terms in self.lines.items():
                for (other, _), share in terms.items():
                    more[other] += abs(share) * out[row]
            if np.array_equal(more, out):
                break
            out = more
        return out

    def jumps(self, u):
        """[(row, by how much its line is not kept, the size of its terms)] at displacements `u`."""
        out = []
        for key, terms in self.lines.items():
            value = sum(share * u[other] for other, share in terms.items())
            size = sum(abs(share * u[other]) for other, share in terms.items())
            out.append((key[0], abs(u[key] - value), size + abs(u[key])))
        return out

    def complete(self, out):
        """Give dependent entries of `out` (3N, ...) what their lines say, in place; once."""
        for (row, dof), terms in self.lines.items():
            out[3 * row + dof] = sum(share * out[3 * r + d] for (r, d), share in terms.items())


def file_rows(scene):
    """How many rows come before those of stand-ins."""
    return len(scene.points) - sum(len(one.rows) for one in scene.transforms)


def with_rotations(scene, stored):
    """Give a stored result the rows of couplings' rotations: displacements, support forces."""
    for one in scene.couplings:
        longest = scene.longest_arm(one, stored.places)
        stored.u[:, one.rotation] = longest * stored.rotation[:, one.reference]
        stored.supports[:, one.rotation] = stored.moments[:, one.reference] / longest


def with_stand_ins(scene, stored):
    """Give a stored result the rows of stand-ins: parts of the nodes' values along directions."""
    none = np.zeros((stored.finished, len(scene.points) - file_rows(scene), 3))
    for name in ("u", "supports", "rotation", "moments", "contact_force"):
        setattr(stored, name, np.concatenate([getattr(stored, name), none], axis=1))
    more = [row for one in scene.transforms for row in one.rows]
    stored.places = np.concatenate([stored.places, stored.places[more]])
    for one in scene.transforms:
        for row, stand_in in zip(one.rows, one.stand_ins, strict=True):
            axes = one.directions(stored.places[row])
            stored.u[:, stand_in] = stored.u[:, row] @ axes.T
            # Of a support along a direction nothing is left at the node itself.
            along = stored.supports[:, row] @ axes.T
            size = np.linalg.norm(along, axis=1, keepdims=True)
            stored.supports[:, stand_in] = np.where(np.abs(along) <= 8 * EPS * size, 0.0, along)
            stored.supports[:, row] = 0.0
