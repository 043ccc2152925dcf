"""Judge a result by mechanics alone: supports, loads, balance, Signorini's and Coulomb's laws.

What the program says of itself (its certificate, its energies, its words) is not used. Every
allowance is a multiple `SLACK` of what docs/theory.md, section 6, lets a certified increment be
wrong by, or the rounding of stored numbers.
"""

from dataclasses import dataclass, replace

import h5py
import numpy as np
from held_points import (
    LEFT,
    Freedom,
    held_with_their_weights,
    points_that_cannot_part,
)
from joints import Joints, file_rows, with_rotations, with_stand_ins
from least_squares import least_squares_in_cone
from load_path import LoadPath
from mortar import LEAST_KEPT, LEAST_SHARE, normal_of
from obstacles import across, chords, depth_below, locate, shift_of, turned, unit
from scenes import CYLINDER, EPS, SPHERE
from surfaces import Surface, Ties, settled

SLACK = 2.0  # times what the program allows itself: its scales are not these to the last digit
STRICT = 0.3  # of it: what an own solution may be out of balance to prove that there is one
NOISE = 16.0  # times the rounding of a node: forces that may be rounding alone
TINY = 1e-300
NOTHING = 1e-24  # of what it would take to hold a node back: no measure of forces is less
LET_GO = 1e-3  # of the forces of contact before an increment: they are a measure, too
EXCUSED = 1e-3  # of a load or of the largest force: the most that rounding may take from it


@dataclass(frozen=True)
class Finding:
    """What is wrong: a kind, how large it is and what is allowed."""

    kind: str
    row: int
    found: float
    allowed: float
    where: str = ""

    def __str__(self):
        return (
            f"increment {self.row + 1}: {self.kind} {self.found:.3g}, "
            f"allowed {self.allowed:.2g}{' ' + self.where if self.where else ''}"
        )


class Unreadable(Exception):
    """A result that lacks what docs/results.md promises."""


class Stored:
    """The numbers of a result file, in the order of the scene's points."""

    def __init__(self, scene, path):
        with h5py.File(path) as file:
            history = file["history"]
            self.finished = int(history.attrs["finished"])
            rows = slice(0, self.finished)
            self.step = history["step"][rows]
            self.time = history["time"][rows]
            self.certified = history["certified"][rows]
            self.energy = history["energy/strain"][rows]
            self.status = file["run"].attrs["status"]
            if isinstance(self.status, bytes):
                self.status = self.status.decode()
            view = file["VTKHDF"]
            steps = view["Steps"]
            count = int(view["NumberOfPoints"][0])
            n_rows = file_rows(scene)
            at = self.rows_of(scene, view["PointData/node_id"][:count], np.unique(scene.nodes))
            moving = np.array(sorted({*scene.references(), *scene.loose}), int)
            tools = file.get("reference_nodes", {"node_id": np.zeros(0, dtype=int)})
            at_tools = self.rows_of(scene, tools["node_id"][:], moving)
            if int(steps.attrs["NSteps"]) != self.finished:
                raise Unreadable("fields are not written for every increment")
            self.places = scene.points[:n_rows].copy()
            self.places[at] = view["Points"][:count]
            if len(moving):
                self.places[at_tools] = tools["coordinates"][:]

            def field(name, empty):
                found = np.zeros((self.finished, n_rows, *empty))
                if name in view["PointData"]:
                    offsets = steps["PointDataOffsets"][name][: self.finished]
                    values = view["PointData"][name]
                    found[:, at] = [values[o : o + count] for o in offsets]
                if name in tools:
                    found[:, at_tools] = tools[name][rows]
                return found

            self.u = field("displacement", (3,))
            self.supports = field("reaction_force", (3,))
            self.rotation = field("rotation", (3,))
            self.moments = field("reaction_moment", (3,))
            self.contact_force = field("contact_force", (3,))
            self.pairs = {}
            groups = file.get("contact", {})
            for name, group in groups.items():
                frame = group["frame"][:]
                if len(frame) != 1:
                    frame = frame[rows]
                self.pairs[name] = {
                    "rows": at[group["node"][:]],
                    "frame": np.broadcast_to(frame, (self.finished, *frame.shape[1:])),
                    **{key: group[key][rows] for key in
                       ("reaction", "gap", "slip_increment", "status", "resultant",
                        "moment", "moment_left", "torque", "covered_area", "least_gap",
                        "redundant") if key in group},
                    "area": group["area"][:],
                    "friction": float(group.attrs["friction_coefficient"]),
                }  # fmt: skip
            for pair in scene.pairs:
                if pair.wall is not None:
                    name = scene.name_of(pair)
                    self.take_wall(scene, pair, groups[name], self.pairs[name])
        with_rotations(scene, self)
        with_stand_ins(scene, self)

    def take_wall(self, scene, pair, group, whole):
        """The points before a wall of a master: those before the side of the master that it is."""
        if "master_side" not in group:
            return
        sides = group["master_side"][:]
        if pair.obstacle is not None:
            of_facets = group["obstacle_side"][:]
            side = np.unique(of_facets[scene.obstacles[pair.obstacle].of_it])
            if len(side) != 1:
                raise Unreadable("facets of one wall are on several sides")
        else:
            wall = scene.faces(*pair.master)
            ahead = sum(normal_of(scene.points[list(f)]) for f in wall)
            along = np.where(whole["gap"] < 1e29, whole["frame"][:, :, 0] @ ahead, 0.0)
            number = range(1, sides.max() + 1)
            side = [max(number, key=lambda s: along[:, sides == s].sum())]
        chosen = sides == side[0]
        self.pairs[scene.key_of(pair)] = {
            "rows": whole["rows"][chosen], "area": whole["area"][chosen],
            "friction": whole["friction"],
            **{key: whole[key][:, chosen] for key in
               ("frame", "reaction", "gap", "slip_increment", "status", "covered_area",
                "least_gap", "redundant") if key in whole},
        }  # fmt: skip

    @staticmethod
    def rows_of(scene, ids, expected):
        """The rows of nodes in the scene; they must be those of `expected`, in any order."""
        known = scene.ids[: file_rows(scene)]
        order = np.argsort(known)
        place = np.searchsorted(known, ids, sorter=order).clip(max=len(order) - 1)
        rows = order[place]
        if not (np.array_equal(known[rows], ids) and np.array_equal(np.sort(rows), expected)):
            raise Unreadable("the nodes of the file are not those of the deck")
        return rows


class Judge:
    """Judges the increments of a stored result one after the other."""

    def __init__(self, scene, stored, strict=False):
        self.stored = stored
        self.settled = scene.points
        if scene.moves_nodes:
            self.settled = settled(scene)
            scene = replace(scene, points=stored.places)
        self.scene = scene
        self.ties = Ties(scene)
        self.surfaces = [Surface(scene, pair) for pair in scene.pairs]
        self.strict = strict  # for own solutions: rounding excuses nothing, and no slack
        self.path = LoadPath(scene)
        self.findings = []
        self.allowed = (1.0 if strict else SLACK) * 10 * scene.tolerance
        self.mesh = np.unique(scene.nodes)
        self.body_rows = scene.tied_bodies()
        self.added = scene.added_gaps()
        self.pressed_before = np.zeros_like(scene.points)
        self.farthest = 0.0  # of any increment so far: none later is measured by less
        self.closed = {}  # by pair: which points of surfaces without separation have touched
        self.freedom = None
        self.worst = {}

    def note(self, kind, row, found, allowed, where=""):
        """Keep a finding where `found` is more than allowed, or no number."""
        if allowed > 0 and np.isfinite(found):
            self.worst[kind] = max(self.worst.get(kind, 0.0), found / allowed)
        if not found <= allowed:
            self.findings.append(Finding(kind, row, float(found), float(allowed), where))

    def judge(self, complete=True):
        """All findings. `complete`: the run ended with status 0, so every increment is there."""
        scene, stored = self.scene, self.stored
        expected = sum(step.increments for step in scene.steps)
        extra = any(not step.direct for step in scene.steps)
        self.note("number of increments", -1,
                  0 if stored.finished == expected or not complete
                  or (extra and stored.finished > expected) else abs(stored.finished - expected),
                  0.5)  # fmt: skip
        self.note(
            "coordinates",
            -1,
            np.abs(stored.places - self.settled).max(),
            (1e-7 if scene.moves_nodes else 16 * EPS) * np.abs(scene.points).max(),
        )
        if complete:
            self.note("status of the file", -1, float(stored.status != "finished"), 0)
            self.note("not certified", -1, float(np.sum(stored.certified != 1)), 0)
        self.walk(complete)
        return self.findings

    def walk(self, complete=True):
        """Judge increment after increment."""
        scene, stored = self.scene, self.stored
        before, time_before, step_start, in_step = np.zeros_like(scene.points), 0.0, 0.0, 0
        step, turned_before = -1, np.zeros_like(scene.points)
        for row in range(stored.finished):
            if int(stored.step[row]) - 1 != step:
                if step >= 0:
                    step_start += scene.steps[step].period
                    self.note("end of a step", row, abs(time_before - step_start),
                              1e-12 * step_start)  # fmt: skip
                step += 1
                in_step = 0
                self.note("order of steps", row, abs(int(stored.step[row]) - 1 - step), 0)
                if int(stored.step[row]) - 1 != step:
                    return
                self.path.begin(step, np.hstack([before, turned_before]))
            cards = scene.steps[step]
            in_step += 1
            time = stored.time[row] - step_start
            if cards.direct:
                asked = cards.period * in_step / cards.increments
                self.note("time of an increment", row, abs(time - asked),
                          1e-12 * (step_start + cards.period))  # fmt: skip
                time = asked
            elif abs(time - cards.period) <= 1e-12 * (step_start + cards.period):
                time = cards.period
            self.judge_increment(row, time, before, turned_before)
            before, time_before = stored.u[row], stored.time[row]
            turned_before = stored.rotation[row]
        if complete:
            total = sum(s.period for s in scene.steps)
            self.note("end of the run", stored.finished - 1, abs(time_before - total),
                      1e-12 * total)  # fmt: skip
            if scene.exact is not None:
                self.note("not the exact displacements", stored.finished - 1,
                          np.abs(stored.u[-1] - scene.exact)[self.mesh].max(),
                          scene.exact_to * np.abs(scene.exact).max())  # fmt: skip

    def judge_increment(self, row, time, before, turned_before=None):
        """All laws at the end of one increment."""
        scene, stored = self.scene, self.stored
        u = stored.u[row]
        if not all(np.all(np.isfinite(a[row])) for a in
                   (stored.u, stored.supports, stored.contact_force)):  # fmt: skip
            self.note("numbers that are none", row, np.inf, 0)
            return
        self.note("inside out", row, -scene.elements().least_volume(u), 0)
        supports, loads = self.path.supports(time), self.path.loads(time, u)
        held = np.zeros(u.shape, dtype=bool)
        for node, dof in supports:
            if dof < 3:
                held[node, dof] = True
        self.check_supports(row, np.hstack([u, stored.rotation[row]]), supports)
        if turned_before is None:
            turned_before = np.zeros_like(u)

        if self.freedom is None or not np.array_equal(self.freedom.held, held):
            self.freedom = Freedom(scene, held)
        self.check_walls(row, u, before)
        points = self.points_of(row, u, before, held, turned_before)
        pressed, doubt = np.zeros_like(u), 0.0
        for p in points:
            np.add.at(pressed, p["rows"], p["force"])
            if p["reference"] is not None:
                pressed[p["reference"]] -= p["force"].sum(axis=0)
            if p["master"] is not None:
                pressed -= p["master"].T @ p["force"]
                strength = np.linalg.norm(p["force"], axis=1)
                doubt += ((p["doubt"] + p["either"]) * strength).sum()
        if any(p["master"] is not None for p in points):
            # What is on the masters is the file's, after it was found to be that, nearly.
            self.check_contact_forces(row, pressed, doubt, points)
            pressed = np.where(np.isin(np.arange(len(u)), self.mesh)[:, None],
                               stored.contact_force[row], pressed)  # fmt: skip
        # A hindered expansion is a load like others: its forces are a measure, too.
        thermal = self.path.thermal(time)
        internal = scene.elements().internal_force(u) - thermal
        residual = internal - loads - pressed
        self.check_ties(row, u, held)
        self.joints = Joints(scene, held)
        self.check_joints(row, u)
        residual, joined = self.joints.hand_over(residual)
        residual, self.tie_doubt = self.ties.hand_over(residual, held)
        support = np.where(held, residual, 0.0)
        force = max(
            np.linalg.norm(a[self.mesh], axis=1).max()
            for a in (pressed, LET_GO * self.pressed_before, support, loads, internal, thermal)
        ) or np.linalg.norm(loads, axis=1).max()  # fmt: skip
        if self.joints.lines:
            force = max(force, *(np.linalg.norm(a, axis=1).max() for a in (support, loads)))
        before_it, self.pressed_before = LET_GO * self.pressed_before, pressed
        spread = max(np.ptp(u[rows], axis=0).max() for rows in self.body_rows)
        length = max(np.linalg.norm(u - before, axis=1).max(), spread, self.moved_alone(pressed))
        self.farthest = max(self.farthest, length)
        self.least = NOTHING * scene.elements().node_size().max() * self.farthest
        force = max(force, self.least)

        # What the rounding of places before surfaces makes of forces, where nothing is loaded.
        rounded = max((p["rounding"].max() for p in points if p["placed"] is not None), default=0)
        self.places_lost = scene.elements().node_size() * rounded
        acting = np.max([np.linalg.norm(f, axis=1) for f in (internal, loads, pressed)], axis=0)
        far = np.maximum(np.abs(u), np.abs(before))
        self.goes_along = [
            self.is_carried(rows, u, far, held, np.abs(loads) + np.abs(thermal), pressed)
            for rows in self.body_rows
        ]
        self.check_equilibrium(row, far, residual, held, acting, force)
        self.check_stored_forces(row, far, residual, held, pressed, force)
        shift = u if scene.finite else np.zeros_like(u)
        dead = self.path.loads(time, dead=True)
        self.check_bodies(row, far, (loads, pressed, -joined), dead, before_it, shift)
        scale = self.contact_scale(far, points, acting, force)
        self.check_surfaces(row, points, length)
        self.check_sums_of_walls(row, points)
        self.check_tools(row, u, points, length)
        self.check_self_stress(row, points, scale)
        if scene.finite:
            self.check_energy(row, u)
        else:
            self.check_work(row, u, far, (internal, loads, thermal, pressed), force)
        self.check_moments(row, points, u)
        self.check_contact(row, points, scale, length)

    def check_supports(self, row, u, supports):
        """|u - u_prescribed| <= 16 eps max(|u| of the node, |u_prescribed|, size of the body)."""
        sizes = np.full(len(u), np.inf)
        for rows in self.body_rows:
            sizes[rows] = np.ptp(self.scene.points[rows], axis=0).max()
        if np.isinf(sizes).any():
            sizes[np.isinf(sizes)] = max(sizes[np.isfinite(sizes)])
        for (node, dof), (value, size, doubt) in supports.items():
            # Of a node that is held along a direction of its own the others round it.
            allowed = 16 * EPS * max(size, sizes[node], np.abs(u[node]).max()) + doubt
            self.note("prescribed displacement off by", row, abs(u[node, dof] - value), allowed,
                      f"at node {self.scene.ids[node]}, dof {dof + 1}")  # fmt: skip

    def points_of(self, row, u, before, held, turned_before):
        """What each pair's points do: geometry by the judge, reactions by the file."""
        scene, out = self.scene, []
        rotations = (turned_before, self.stored.rotation[row])
        for pair, surface in zip(scene.pairs, self.surfaces, strict=True):
            if scene.key_of(pair) not in self.stored.pairs:
                raise Unreadable("the points of a pair are not told apart by sides of its master")
            stored = self.stored.pairs[scene.key_of(pair)]
            if surface.has_faces:
                out.append(self.surface_points(row, surface, u, before, held, rotations))
                continue
            obstacle = scene.obstacles[pair.obstacle]
            rows = stored["rows"]
            slaves = scene.side_rows(pair.part, pair.side)
            missing = np.setdiff1d(slaves, rows)
            self.note("slave nodes without a contact point", row, float(len(missing)), 0)
            shift = shift_of(obstacle, u)
            here = obstacle
            if obstacle.reference is not None:
                here = turned(obstacle, rotations[1][obstacle.reference],
                              scene.points[obstacle.reference])  # fmt: skip
            gap, normal, rounding = locate(
                here, scene.points[rows], u[rows], shift, self.added[rows]
            )
            moved = self.motion(obstacle, rows, u, before, rotations)
            fixed = held[rows]
            if obstacle.reference is not None:
                fixed = fixed & held[obstacle.reference]
            frame = stored["frame"][row]
            force = np.einsum("pk,pki->pi", stored["reaction"][row], frame)
            # The way of held directions across the normal: what supports and obstacle make slip.
            known = across(np.where(fixed, moved, 0.0), normal)
            out.append({
                "pair": pair, "rows": rows, "reference": obstacle.reference, "gap": gap,
                "obstacle": here, "normal": normal, "rounding": rounding, "force": force,
                "frame": frame,
                "slip": across(moved, normal), "known": known, "master": None, "placed": None,
                # No direction along the normal is free: no reaction there (theory.md, section 2).
                "blocked": np.linalg.norm(np.where(fixed, 0.0, normal), axis=1) < 1e-9,
                "held": np.linalg.norm(across_held(fixed, normal), axis=(1, 2)) > 1e-9,
                "stored": stored, "status": stored["status"][row],
            })  # fmt: skip
        return out

    def motion(self, obstacle, rows, u, before, rotations, own=None):
        """How points (P, 3) moved in the increment against the material of an obstacle."""
        own = np.zeros((len(rows), len(u))) if own is None else own

        def at_rows(values):
            return values[rows] - own @ values

        moved = at_rows(u - before)
        at = obstacle.reference
        if at is None:
            return moved
        old, new = (r[at] for r in rotations)
        if np.any(old) or np.any(new):
            return chords(at_rows(self.scene.points), at_rows(before) - before[at],
                          at_rows(u) - u[at],
                          self.scene.points[at], old, new)  # fmt: skip
        return moved - (u - before)[at]

    def surface_points(self, row, surface, u, before, held, rotations):
        """What the points before a surface do: their gaps and slips by the file.

        How far these are from the judge's own (`off`) is judged by check_surfaces.
        """
        scene, pair = self.scene, surface.pair
        stored = self.stored.pairs[scene.key_of(pair)]
        rows = surface.first.rows
        order = np.argsort(stored["rows"])
        same = np.array_equal(stored["rows"][order], rows)
        self.note("slave nodes without a contact point", row, float(not same), 0)
        if not same:
            raise Unreadable("the points of a pair are not the slave's nodes")

        def read(name):
            return stored[name][row][order]

        frame, gap = read("frame"), read("gap")
        has_row = gap < 1e29
        still, none, placed = self.without_row(row, surface, u, rotations[1], has_row)
        force = np.einsum("pk,pki->pi", read("reaction"), frame)
        slip = np.einsum("pk,pki->pi", read("slip_increment"), frame[:, 1:])
        told = (gap, slip, frame[:, 0], read("covered_area"))
        self.keep_joined(surface, placed, u, before, rows[none], still, told)
        gap = np.where(has_row, gap, 0.0)
        obstacle = None if pair.obstacle is None else scene.obstacles[pair.obstacle]
        if obstacle is None:
            master = placed.weights
            fixed = still
            moved = (u - before)[rows] - master @ (u - before)
            if scene.finite:
                told = (slip, frame[:, 0])
                moved = self.way_over(surface, placed, (u, before), moved, told, gap)
            reference = None
        else:
            master, reference = placed.own, obstacle.reference
            fixed = held[rows]
            if reference is not None:
                fixed = fixed & held[reference]
            moved = self.motion(obstacle, rows, u, before, rotations, placed.own)
        own = placed.gap
        # With small sliding it grows linearly from that in the mesh.
        if obstacle is None and pair.small:
            own = own + np.einsum("pi,pi->p", placed.normal, u[rows] - master @ u)
        own = own + self.added[rows]
        own_slip = across(moved, placed.normal)
        if placed.mirror is not None:
            own_slip = own_slip * (1 - placed.mirror)
        places = scene.points + u
        size = np.abs(places[rows]).max(axis=1) + np.abs(places[surface.reached]).max()
        size = size + np.abs(placed.corners).max()
        # Weights that add up to 1, but not by their sizes, spread what places are rounded by.
        rounding = 32 * EPS * size * (1 + np.abs(placed.weights).sum(axis=1))
        kept = {**stored, **{k: {row: read(k)} for k in ("gap", "slip_increment", "status")}}
        kept["gap"] = {row: gap}
        return {
            "pair": pair, "rows": rows, "reference": reference, "gap": gap,
            "normal": frame[:, 0], "rounding": rounding,
            "force": force, "frame": frame, "slip": slip, "known": np.zeros_like(slip),
            "blocked": none | (np.linalg.norm(np.where(fixed, 0.0, frame[:, 0]), axis=1) < 1e-9),
            "held": np.linalg.norm(across_held(fixed, frame[:, 0]), axis=(1, 2)) > 1e-9,
            "still": still, "stored": kept, "status": read("status"), "has_row": has_row,
            "master": master, "placed": placed, "own_gap": own, "own_slip": own_slip,
            "doubt": placed.doubt(size), "either": placed.either, "apart": placed.apart,
            "area": stored["area"][order],
            "covered": read("covered_area"), "least": read("least_gap"),
            "added": self.added[rows], "far": size, "moved": np.abs(moved).max(initial=0.0),
        }  # fmt: skip

    def way_over(self, surface, placed, ends, moved, told, gap):
        """How far (P, 3) what points face went over the master, (11.18), at the places of the end.

        `moved`: how far the two sides parted, which is the way of a point that the master did not
        cover when the increment began, and of one that is open. Where it did so by little, or by
        the gap the point may be either, the one that is nearer to what the file has told counts.
        """
        u, before = ends
        slip, normal = told
        nowhere = np.zeros_like(u)
        first = surface.place(before, nowhere)
        over = (placed.weights - first.weights) @ (self.scene.points + u)
        off = [np.abs(slip - across(way, normal)).max(axis=1) for way in (over, moved)]
        size = np.sqrt(placed.area.max())
        begun = (first.share > 2e-3) & (gap < 1e-9 * size)
        nearer = off[0] <= off[1]
        return np.where((begun | nearer)[:, None], over, moved)

    def without_row(self, row, surface, u, rotation, has_row):
        """(still (P, 3), none (P,), Seen): where the two sides of points cannot move apart.

        Along axes, and along the normal, so that the point has no multiplier; and the points placed
        so.
        """
        rows = surface.first.rows
        still, none = np.zeros((len(rows), 3), dtype=bool), np.zeros(len(rows), dtype=bool)
        answers = points_that_cannot_part(surface, self.freedom, u, rotation)
        for at, number in enumerate(rows):
            if int(number) not in answers:
                continue
            surely, _, perhaps, still[at] = answers[int(number)]
            none[at] = perhaps and not has_row[at]
            if surely and has_row[at]:
                self.note("place of a point whose sides cannot move apart", row, 1.0, 0.0,
                          f"at node {self.scene.ids[number]}")  # fmt: skip
        # With what neighbours got of others a point may have nearly all of its weights where both
        # sides are held.
        while True:
            placed = surface.place(u, rotation, rows[none])
            held = held_with_their_weights(surface, self.freedom, placed, LEFT[2])
            if not np.any(held & ~has_row & ~none):
                break
            none |= held & ~has_row
        surely = held_with_their_weights(surface, self.freedom, placed, LEFT[0]) & has_row
        for at in np.flatnonzero(surely):
            self.note("place of a point whose weights are held", row, 1.0, 0.0,
                      f"at node {self.scene.ids[rows[at]]}")  # fmt: skip
        return still, none, placed

    def keep_joined(self, surface, placed, u, before, none, still, told):
        """Points that constraints join keep weights and normals of the undeformed mesh, perhaps.

        Or they face one node alone that has nearly all of them. Whatever explains best what the
        file tells of a point is taken: all are right. `told`: gaps, slips, normals, areas.
        """
        if surface.obstacle is not None or not self.joints_of(surface):
            return
        first = surface.place(np.zeros_like(u), np.zeros_like(u), none)
        one = (first.weights >= 0.95 * np.abs(first.weights).sum(axis=1)[:, None]).astype(float)
        alone = one.sum(axis=1) == 1
        rows, start, length = first.rows, self.scene.points, np.abs(u).max() or 1.0
        gaps, slips, normals, areas = told
        best = None
        for weights, of, which in ((placed.weights, placed, ~alone | True),
                                   (first.weights, first, ~alone | True), (one, first, alone)):
            # With small sliding places are those of the undeformed mesh.
            beyond = u[rows] - weights @ u
            apart = start[rows] - weights @ start
            if of is placed:
                apart = placed.apart
            elif not surface.pair.small:
                apart = apart + beyond
            whole = apart + (beyond if surface.pair.small else 0.0)
            own = np.einsum("pi,pi->p", of.normal, whole) + self.added[rows]
            slip = across((u - before)[rows] - weights @ (u - before), of.normal)
            slid = np.where(still, 0.0, np.abs(slips - slip)).max(axis=1)
            off = np.abs(gaps - own) / length + slid / length
            off = off + np.abs(normals - of.normal).max(axis=1)
            off = off + np.abs(areas - of.covered) / placed.area
            if best is None:
                best = off
                continue
            near = which & (first.covered > 0) & (gaps < 1e29) & (off < best - 1e-9)
            best = np.where(near, off, best)
            placed.weights[near], placed.normal[near] = weights[near], of.normal[near]
            placed.apart[near], placed.covered[near] = apart[near], of.covered[near]
        # Of little motion gaps do not say whether it is one node alone.
        alike = alone & (first.covered > 0) & (off <= best + 1e-9)
        placed.either = np.where(alike, np.abs(one - placed.weights).sum(axis=1), 0.0)

    def joints_of(self, surface):
        """Whether equations, couplings or ties have nodes of a pair."""
        rows = set(np.ravel(surface.slave).tolist()) | set(surface.reached.tolist())
        if any(rows & set(tie.rows.tolist()) for tie in self.ties.all):
            return True
        lines = Joints(self.scene, np.zeros(self.scene.points.shape, dtype=bool)).lines
        return any(at[0] in rows for at in lines)

    def check_walls(self, row, u, before):
        """No slave node is behind a wall of a master that has concave corners, by own integrals."""
        length = max(np.linalg.norm(u - before, axis=1).max(),
                     *(np.ptp(u[rows], axis=0).max() for rows in self.body_rows))  # fmt: skip
        for pair, surface in zip(self.scene.pairs, self.surfaces, strict=True):
            if pair.wall is None:
                continue
            seen = surface.place(u, self.stored.rotation[row])
            depth = np.where(seen.share > 10 * LEAST_SHARE, -seen.gap, 0.0)
            depth = depth - 1e-12 * np.abs(self.scene.points).max()
            at = int(np.argmax(depth))
            self.note("node behind a wall by", row, max(0.0, depth[at]) / (length or 1.0),
                      self.allowed, f"at node {self.scene.ids[seen.rows[at]]}")  # fmt: skip

    def check_surfaces(self, row, points, length):
        """Places of the file before a surface are those of own integrals."""
        for p in points:
            placed, has_row = p["placed"], p["has_row"] if p["placed"] is not None else None
            if placed is None:
                continue
            doubt = p["doubt"]
            size = np.sqrt(placed.area.max())
            self.note("folded faces in contact", row, float(placed.folded), 0)
            if placed.folded:
                continue  # integrals over such faces are nothing
            off = np.abs(p["area"] - placed.undeformed) / placed.area
            # What the file calls the area of a bent face is not that of its projection.
            self.note("area of a node wrong by", row, off.max(), 1e-6 + 10 * placed.bend**2)
            off = np.abs(np.where(has_row, p["covered"], placed.covered) - placed.covered)
            self.note("covered area wrong by", row, (off / placed.area).max(), 1e-6)
            share = placed.share
            self.note("node without a place, covered by", row,
                      share[~has_row & ~p["blocked"]].max(initial=0.0), 1.01e-3)  # fmt: skip
            self.note("node with a place that nothing covers", row,
                      float(np.any(has_row & (share < 0.95 * LEAST_KEPT))), 0)  # fmt: skip
            self.note("reaction on a node without a place", row,
                      np.abs(p["force"][~has_row]).max(initial=0.0), 0)  # fmt: skip
            if not has_row.any():
                continue
            seen = has_row & (placed.covered > 0)
            # Of flat surfaces gaps do not depend on weights.
            heights = np.where(seen, placed.most - np.where(seen, placed.least, 0.0), 0.0)
            # Places are as exact as the weights' sum is 1.
            lost = 4 * p["rounding"] + 1e-13 * p["far"] / np.maximum(placed.share, 1e-12)
            off = np.abs(p["gap"] - p["own_gap"]) - lost
            room = self.allowed * length + doubt * (length + heights) + TINY
            self.note("weighted gap wrong by", row, (off / room)[seen].max(initial=0.0), 1.0)
            off = np.abs(p["normal"] - placed.normal).max(axis=1)
            self.note("normal wrong by", row, (off / (1e-6 + doubt))[seen].max(initial=0.0), 1.0)
            off = np.where(p["still"], 0.0, np.abs(p["slip"] - p["own_slip"])).max(axis=1) - lost
            room = 1e-6 * length + doubt * (p["moved"] + length) + TINY
            self.note("slip wrong by", row, (off / room)[seen].max(initial=0.0), 1.0)
            if not seen.any():
                continue
            # Between the points of both quadratures bent faces may be nearer: by up to 0.45 of the
            # bend times the range of the gaps in 180 decks. At the corners of what they share both
            # look.
            least, most = placed.least[seen], placed.most[seen]
            told, nothing = (p["least"] - p["added"])[seen], 1e-6 * (length + size)
            room = nothing + min(placed.bend, 1.0) * (most - least)
            self.note("least gap too small by", row, ((least - told) / room).max(), 1.0)
            off = told - placed.corner[seen]
            self.note("least gap too large by", row, (off / nothing).max(), 1.0)

    def check_contact_forces(self, row, pressed, doubt, points):
        """The forces on the nodes of both surfaces are the reactions and their shares."""
        mesh = self.mesh
        off = np.abs(self.stored.contact_force[row][mesh] - pressed[mesh]).max()
        room = doubt + 1e-12 * np.abs(pressed[mesh]).max()
        self.note("contact force of a node wrong by", row, off, max(room, 1e-300))
        # Action is reaction: what is left of all forces on bodies is that of the obstacles.
        total = self.stored.contact_force[row][mesh].sum(axis=0)
        total = total - sum(p["force"].sum(axis=0) for p in points if p["pair"].master is None)
        strength = sum(np.abs(p["force"]).sum() for p in points)
        self.note("action is not reaction, by", row, np.abs(total).max(),
                  max(1e-11 * strength, TINY))  # fmt: skip

    def check_moments(self, row, points, u):
        """Moments and torques in the file are those of the reactions."""
        if not any("moment" in p["stored"] for p in points):  # an own solution
            return
        on, loose = np.zeros_like(u), np.zeros(len(u))
        reach = np.abs(self.scene.points).max() + np.abs(u).max()
        for p in points:
            stored, strength = p["stored"], np.abs(p["force"]).sum()
            if "moment" not in stored:  # an own solution, or a wall
                continue
            own = np.zeros((len(p["rows"]), len(u)))
            own = own if p["placed"] is None else p["placed"].own.copy()
            if p["pair"].master is not None:  # nodes of both surfaces count as the master's
                own[:, np.unique(self.scene.faces(*p["pair"].master))] = 0.0
            arm = self.scene.points[p["rows"]] - own @ self.scene.points
            moment = np.cross(arm, p["force"]).sum(axis=0)
            # What rows have of other nodes is known as weights are.
            rough = 0.0
            if own.any():
                size = np.linalg.norm(p["force"], axis=1)
                rough = (size * p["doubt"]).sum() * np.sqrt(p["area"].max())
            self.note("moment wrong by", row, np.abs(stored["moment"][row] - moment).max(),
                      max(1e-11 * strength * reach + rough, 1e-300))  # fmt: skip
            if p["pair"].master is not None and not p["pair"].small:
                left = np.cross(p["apart"], p["force"]).sum(axis=0)
                room = 1e-11 * strength * reach + (
                    np.linalg.norm(p["force"], axis=1) * (p["doubt"] * np.sqrt(p["area"].max()))
                ).sum()
                off = np.abs(stored["moment_left"][row] - left).max()
                self.note("moment left of a pair wrong by", row, off, max(room, TINY))
            if "torque" not in stored:
                continue
            arm = arm + u[p["rows"]] - own @ u
            if p["reference"] is not None:
                arm = arm - (self.scene.points + u)[p["reference"]]
            torque = -np.cross(arm, p["force"]).sum(axis=0)
            self.note("torque wrong by", row, np.abs(stored["torque"][row] - torque).max(),
                      max(1e-11 * strength * reach + rough, 1e-300))  # fmt: skip
            if p["reference"] is not None:
                on[p["reference"]] += torque
                loose[p["reference"]] += rough
        for at in self.scene.references():
            if any(dof > 2 for node, dof in self.path.prescribed if node == at):
                size = 1e-11 * np.abs(self.stored.contact_force[row]).sum() * reach + loose[at]
                self.note("moment of a support wrong by", row,
                          np.abs(self.stored.moments[row][at] + on[at]).max(),
                          max(size, 1e-300))  # fmt: skip

    def check_ties(self, row, u, held):
        """Tied nodes go where the mean of their masters goes."""
        for tie in self.ties.all:
            jump = np.where(held[tie.rows], 0.0, u[tie.rows] - tie.weights @ u)
            size = np.abs(u[tie.rows]) + np.abs(tie.weights) @ np.abs(u)
            size = np.maximum(size, self.ties.size)
            room = 64 * EPS * size + tie.doubt * np.ptp(u[tie.reached], axis=0).max()
            self.note("tied surfaces part by", row, (np.abs(jump) / room).max(initial=0.0), 1.0)

    def check_joints(self, row, u):
        """What depends on others by equations, couplings or local directions goes as they say."""
        size = max(np.ptp(self.scene.points[rows], axis=0).max() for rows in self.body_rows)
        for at, jump, terms in self.joints.jumps(u):
            self.note("joint not kept by", row, jump, 64 * EPS * max(terms, size),
                      f"at node {self.scene.ids[at]}")  # fmt: skip

    def check_equilibrium(self, row, far, residual, held, acting, force):
        """K u = loads + supports + contact at every node; the obstacles' reference nodes too.

        `far`: how far each node has been from its place, at either end of the increment.
        """
        imbalance = np.linalg.norm(np.where(held, 0.0, residual), axis=1)
        rounding = self.ties.spread(self.joints.spread(self.scene.elements().rounding(far)))
        for reference in self.scene.references():
            rounding[reference] = 0.0
        # Bodies that move as a whole have forces of rounding alone. Beside a force that is more
        # than the rounding of its own node, rounding excuses next to nothing.
        excused = np.minimum(rounding, EXCUSED * force)
        for rows, goes_along in zip(self.body_rows, self.goes_along, strict=True):
            rest = NOISE * rounding[rows] + self.places_lost[rows]
            if goes_along or np.all(acting[rows] <= rest):
                excused[rows] = rest
        beside = np.setdiff1d(np.arange(len(far)), np.concatenate(self.body_rows))
        if np.all(acting[self.mesh] <= (NOISE * rounding + self.places_lost)[self.mesh]):
            excused[beside] = NOISE * rounding[beside]
        if self.strict:
            excused = 0.0
        over = imbalance - excused - self.tie_doubt
        at = int(np.argmax(over))
        share = max(0.0, over[at]) / force if force > 0 else over[at]
        # Of a solution near what double precision holds another rounding decides.
        allowed = STRICT * self.allowed if self.strict else self.allowed
        self.note(
            "out of balance",
            row,
            share,
            allowed,
            f"of the largest force {force:.3g} at node {self.scene.ids[at]}",
        )

    def is_carried(self, rows, u, far, held, loads, pressed):
        """Whether nothing deforms a body, and it goes as a rigid motion to what is allowed.

        Nothing loads it, nothing presses on it, and its supports go as one. Rounding of its stiff
        elements may then leave more force in soft ones than that of their own displacements.
        """
        rest = NOISE * self.scene.elements().rounding(far)[rows]
        if np.any(loads[rows]) or np.any(np.linalg.norm(pressed[rows], axis=1) > rest):
            return False
        arm = self.scene.points[rows] - self.scene.points[rows].mean(axis=0)
        arm = arm / (np.abs(arm).max() or 1.0)
        ways = [np.tile(e, (len(rows), 1)) for e in np.eye(3)]
        ways += [np.cross(e, arm) for e in np.eye(3)]
        motions = np.stack([way.ravel() for way in ways], axis=1)
        moved, largest = u[rows].ravel(), np.abs(u[rows]).max()

        def off(among):
            share = np.linalg.lstsq(motions[among], moved[among], rcond=1e-12)[0]
            return np.abs(moved[among] - motions[among] @ share).max(initial=0.0)

        everything = np.ones(moved.shape, dtype=bool)
        return (off(held[rows].ravel()) <= 64 * EPS * largest
                and off(everything) <= self.allowed * largest)  # fmt: skip

    def check_stored_forces(self, row, far, residual, held, pressed, force):
        """Forces of supports and of contact in the file are those found here."""
        stored = self.stored
        rounding = self.joints.spread(self.scene.elements().rounding(far))
        rounding = 2 * self.ties.spread(rounding)[:, None]
        allowed = self.allowed * max(force, np.abs(stored.supports[row]).max(initial=0)) + rounding
        allowed = allowed + self.tie_doubt
        free = np.where(held, 0.0, stored.supports[row])
        self.note("support force where nothing is held", row, np.abs(free).max(), 0)
        wrong = np.abs(np.where(held, stored.supports[row] - residual, 0.0)) / np.where(
            allowed > 0, allowed, 1e-300)  # fmt: skip
        at = np.unravel_index(np.argmax(wrong), wrong.shape)
        self.note("support force wrong by", row, wrong.max(), 1.0,
                  f"times what is allowed at node {self.scene.ids[at[0]]}")  # fmt: skip
        if self.scene.pairs and not any(s.has_faces for s in self.surfaces):
            slack = 1e-12 * max(np.abs(pressed).max(), 1e-300)
            mesh = self.mesh
            off = np.abs(stored.contact_force[row][mesh] - pressed[mesh]).max()
            self.note("contact force of a node wrong by", row, off, slack)

    def check_bodies(self, row, far, forces, dead, before_it, shift):
        """Balance of every body in each of its rigid motions, without internal forces.

        `forces`: loads, contact, and what equations, couplings and supports along local directions
        put on nodes. Moments are about the places that `shift` (N, 3) takes the nodes to. What
        drives a body are `dead` loads: of pressures that follow its faces slopes are rounding.
        """
        loads, pressed, joined = forces
        places = self.scene.points + shift
        supports = self.stored.supports[row]
        rounding = self.joints.spread(self.scene.elements().rounding(far))
        groups = [(rows, 6) for rows in self.body_rows]
        # Where forces of a tie act is known as well as its weights are.
        groups += [(np.array([r]), 3) for r in self.scene.references()]
        for number, (rows, motions) in enumerate(groups):
            centre = places[rows].mean(axis=0)
            arm = places[rows] - centre
            reach = np.linalg.norm(arm, axis=1).max() or 1.0
            for m in range(motions):
                motion = np.zeros((len(rows), 3))
                if m < 3:
                    motion[:, m] = 1.0
                else:
                    motion = np.cross(np.eye(3)[m - 3], arm / reach)
                forces = (loads, supports, pressed, joined)
                parts = [np.sum(f[rows] * motion) for f in forces]
                sizes = [np.sum(np.abs(f[rows] * motion)) for f in forces]
                everything = [np.sum(np.abs(f[rows])) for f in forces]
                lost = sum(rounding[rows]) + 64 * EPS * sum(everything) + self.least
                driven = abs(np.sum(dead[rows] * motion))
                scale = sum(sizes)
                if driven > 64 * EPS * np.sum(np.abs(dead[rows])):
                    lost = min(lost, EXCUSED * driven)
                else:
                    # Nothing drives it: what is beside it in other directions is the measure.
                    scale = sum(everything) + np.sum(np.abs(before_it[rows]))
                name = "xyz"[m % 3]
                self.note("body out of balance by", row, abs(sum(parts)),
                          self.allowed * scale + lost,
                          f"in {'translation along' if m < 3 else 'rotation about'} {name}, "
                          f"body {number + 1} of {len(groups)}")  # fmt: skip

    def moved_alone(self, pressed):
        """The farthest that contact forces would move a node while the others are held.

        Where loads act on the very nodes that contact holds all displacements are rounding.
        """
        size = self.scene.elements().node_size()
        strength = np.linalg.norm(pressed, axis=1)
        return np.divide(strength, size, out=np.zeros(len(size)), where=size > 0).max()

    def contact_scale(self, far, points, acting, force):
        """The scale of reactions: the largest force, or what rounding makes of the way there.

        Where all forces are no more than that (a body came back to where it was without load, or
        went along with its supports) reactions say nothing.
        """
        if not points:
            return force
        rounding = self.scene.elements().rounding(far) + self.places_lost
        if not self.strict and np.all(acting[self.mesh] <= rounding[self.mesh]):
            return np.inf
        slaves = np.concatenate([p["rows"] for p in points])
        return max(force, float(rounding[slaves].max(initial=0.0)))

    def check_contact(self, row, points, force, length):
        """Signorini's and Coulomb's laws at every slave node."""
        allowed = self.allowed
        total = defect = 0.0
        farthest = length
        for number, p in enumerate(points):
            if len(p["rows"]) == 0:
                continue
            rounding = p["rounding"]
            closed = self.closed_points(number, p)
            longest = max(length, np.linalg.norm(p["slip"], axis=1).max(initial=0.0))
            normal_force = np.einsum("pi,pi->p", p["force"], p["normal"])
            mu = self.coefficients(p, normal_force)
            pressing = np.where(closed, np.maximum(0.0, normal_force), normal_force)
            friction = across(p["force"], p["normal"])
            size = np.linalg.norm(friction, axis=1)
            gap = np.where(np.abs(p["gap"]) <= rounding, 0.0, p["gap"])
            ids = self.scene.ids[p["rows"]]

            def worst(kind, values, scale, ids=ids):
                at = int(np.argmax(values))
                value = values[at] / scale if scale > 0 else (np.inf if values[at] > 0 else 0.0)
                self.note(kind, row, value, allowed, f"at node {ids[at]}")

            worst("penetration", np.maximum(0.0, -gap), length)
            worst("opening", np.where(closed, gap, 0.0), length)
            worst("adhesion", np.maximum(0.0, -normal_force) * ~closed, force)
            energy = force * length if length > 0 else 0.0
            worst("complementarity", np.abs(gap * normal_force), energy)
            worst("cone", np.maximum(0.0, size - mu * pressing), force)
            slip = p["slip"]
            # Friction does no work at any point: the law below is a mean over them. Slip that is
            # rounding of large displacements is none.
            work = np.einsum("pi,pi->p", friction, slip) - size * 4 * rounding
            scale = force * longest if longest > 0 else 0.0
            worst("friction does work", np.maximum(0.0, work), scale)
            law = np.abs(
                mu * pressing * np.linalg.norm(slip, axis=1)
                + np.einsum("pi,pi->p", friction, slip)
            )
            law = np.maximum(0.0, law - mu * np.abs(normal_force) * 4 * rounding)
            defect += law.sum()
            total += np.maximum(np.linalg.norm(p["force"], axis=1), mu * pressing).sum()
            if self.turns(p):
                farthest = max(farthest, longest)
            self.check_stored_points(row, p, gap, force, length, normal_force, size, mu)
        if total > 0 and length > 0:
            # Reactions that are rounding alone have no law.
            total = max(total, 1e-10 * force)
            self.note("friction law", row, defect / (total * farthest), allowed)

    def coefficients(self, p, normal_force):
        """The coefficient of friction that each point has under its force: its friction is at most
        a stress over its area, which is the judge's own.
        """
        pair = p["pair"]
        if pair.most is None:
            return np.full(len(p["rows"]), pair.friction)
        area = p["placed"].covered if p["placed"] is not None else self.areas(pair, p["rows"])
        with np.errstate(over="ignore"):
            cut = pair.most * area / np.maximum(normal_force, TINY)
        return np.minimum(pair.friction, cut)

    def areas(self, pair, rows):
        """The tributary areas of the nodes of a slave side of C3D8, in the mesh."""
        area = np.zeros(len(self.scene.points))
        at = 1 / np.sqrt(3)
        for face in self.scene.faces(pair.part, pair.side):
            x = self.scene.points[list(face)]
            for s, t in ((-at, -at), (at, -at), (at, at), (-at, at)):
                n = np.array([(1 - s) * (1 - t), (1 + s) * (1 - t), (1 + s) * (1 + t),
                              (1 - s) * (1 + t)]) / 4  # fmt: skip
                by_s = np.array([t - 1, 1 - t, 1 + t, -1 - t]) / 4
                by_t = np.array([s - 1, -1 - s, 1 + s, 1 - s]) / 4
                np.add.at(area, list(face), n * np.linalg.norm(np.cross(by_s @ x, by_t @ x)))
        return area[rows]

    def closed_points(self, number, p):
        """Which points of a pair stay closed in this increment; those that press join them."""
        has_row = p.get("has_row", np.ones(len(p["rows"]), bool))
        touches = p["pair"].closed
        if touches is None:
            return ~has_row & has_row
        before = self.closed.setdefault(number, np.full(len(p["rows"]), touches))
        closed = before & has_row
        self.closed[number] = closed | np.any(p["force"] != 0.0, axis=1)
        return closed

    def check_sums_of_walls(self, row, points):
        """Resultants of pairs whose points are told apart by walls."""
        sums = {}
        for p in points:
            if p["pair"].wall is not None:
                sums.setdefault(self.scene.name_of(p["pair"]), []).append(p["force"])
        for name, forces in sums.items():
            if name in self.stored.pairs:  # not so in an own solution
                self.check_resultant(row, self.stored.pairs[name], np.vstack(forces))

    def check_tools(self, row, u, points, length):
        """Planes, spheres and cylinders press on the outside of faces; middles are outside."""
        for p in points:
            obstacle = p.get("obstacle")
            if obstacle is None:
                continue
            faces = np.array(self.scene.faces(p["pair"].part, p["pair"].side))
            x = self.scene.points + u
            outward = np.zeros_like(x)
            for face in faces:
                n = np.cross(x[face[2]] - x[face[0]], x[face[3]] - x[face[1]])
                outward[face] += n
            outward = outward[p["rows"]]
            outward = outward / np.linalg.norm(outward, axis=1)[:, None]
            pressed = np.linalg.norm(p["force"], axis=1)
            pressed = pressed > 1e-6 * pressed.max(initial=0.0)
            along = np.einsum("pi,pi->p", p["normal"], outward)
            self.note("pressed from inside, cosine", row,
                      along[pressed].max(initial=-1.0), 0.2)  # fmt: skip
            if obstacle.inner or obstacle.kind not in (SPHERE, CYLINDER):
                continue
            way = unit(outward.sum(axis=0))
            deep = [depth_below(x[face], obstacle, shift_of(obstacle, u), way) for face in faces]
            self.note("middle of a tool is in a body by", row, max(deep) / obstacle.radius,
                      1e-6)  # fmt: skip

    def check_self_stress(self, row, points, force):
        """Reactions that supports and constraints could carry alone are the least there are.

        Of the points that press. Rows of contact over all directions that depend on nothing say
        which combinations of normal reactions move nothing.
        """
        moves, rows, sizes = self.freedom.motions, [], []
        joined = bool(self.ties.all or self.joints.lines)
        for p in points:
            if p["master"] is None or not (joined or self.freedom.held[p["rows"]].any()):
                continue
            normal_force = np.einsum("pi,pi->p", p["force"], p["normal"])
            for at in np.flatnonzero(normal_force > 1e-6 * min(force, normal_force.max())):
                own = np.einsum("i,in->n", p["normal"][at], moves[p["rows"][at]])
                other = np.einsum("m,i,min->n", p["master"][at], p["normal"][at], moves)
                rows.append(own - other)
                sizes.append(normal_force[at])
        if not rows:
            return
        left, size, _ = np.linalg.svd(np.array(rows))
        rank = int(np.sum(size > 1e-9 * size.max(initial=0.0)))
        if rank == len(rows):
            return
        sizes = np.array(sizes)
        across = left[:, :rank] @ left[:, :rank].T
        matrix = np.vstack([1e5 * across, np.eye(len(sizes))])
        right = np.concatenate([1e5 * across @ sizes, np.zeros(len(sizes))])
        least, _ = least_squares_in_cone(matrix, right)
        # The program's are the least to the tolerance of its solver, and with friction nearly.
        self.note("reactions that constraints could carry exceed the least", row,
                  np.linalg.norm(sizes), 1.1 * np.linalg.norm(least))  # fmt: skip

    def check_work(self, row, u, far, forces, force):
        """Half of u . K u is half the work of all nodal forces: constraints do none.

        `far`: as of check_equilibrium; what is let go keeps the rounding of how it was held.
        """
        internal, loads, thermal, pressed = forces
        forces = (loads, thermal, self.stored.supports[row], pressed)
        stiff = internal + thermal
        work = [np.sum(f * u) for f in (stiff, *forces)]
        size = sum(np.sum(np.abs(f * u)) for f in (stiff, *forces))
        # Where supports take the loads at once displacements are rounding; where nothing is loaded
        # forces are that of places.
        lost = np.sum(self.scene.elements().rounding(far) + self.places_lost)
        lost = lost + self.allowed * force + self.tie_doubt
        self.note("work of nodal forces wrong by", row, abs(work[0] - sum(work[1:])),
                  self.allowed * size + lost * np.abs(u).max() + TINY)  # fmt: skip

    def check_energy(self, row, u):
        """The strain energy of the file is that of its displacements, at finite strain."""
        elements = self.scene.elements()
        energy = elements.energy(u)
        lost = np.sum(elements.rounding(u)) * np.abs(u).max()
        self.note("strain energy wrong by", row, abs(self.stored.energy[row] - energy),
                  1e-10 * abs(energy) + lost + TINY)  # fmt: skip

    def turns(self, p):
        """Whether the obstacle before points turns."""
        at = p["reference"]
        return at is not None and any(n == at and dof > 2 for n, dof in self.path.prescribed)

    def check_stored_points(self, row, p, gap, force, length, normal_force, size, mu):
        """What the file says of the points agrees with what was found."""
        allowed, stored = self.allowed, p["stored"]
        off = np.abs(stored["gap"][row] - p["gap"]) - 4 * p["rounding"]
        self.note("stored gap wrong by", row, off.max() / length if length > 0 else 0.0, allowed)
        self.note("stored normal wrong by", row,
                  np.abs(p["frame"][:, 0] - p["normal"]).max(), 1e-6)  # fmt: skip
        turned = np.einsum("pki,pi->pk", p["frame"][:, 1:], p["slip"])
        off = np.abs(stored["slip_increment"][row] - turned).max(axis=1) - 4 * p["rounding"]
        self.note("stored slip wrong by", row, off.max() / length if length > 0 else 0.0, 1e-6)
        status = p["status"]
        strength = np.linalg.norm(p["force"], axis=1)
        largest = (strength * (status == 0)).max()
        self.note("force on an open point", row, largest / force if force > 0 else 0.0, allowed)
        way = np.linalg.norm(p["slip"], axis=1) - 4 * p["rounding"]
        sticks = (status == 1) & (mu * normal_force > 1e-3 * force)
        self.note("slip of a point that sticks", row,
                  (way * sticks).max() / length if length > 0 else 0.0, 1e-3)  # fmt: skip
        inside = (mu * normal_force - size) * (status == 2) * ~p["held"]
        # Reactions are known to `allowed`, limits of friction to what `mu` makes of it.
        self.note("friction of a point that slides below its limit by", row,
                  inside.max() / force if force > 0 else 0.0,
                  max(1e-3, allowed * np.hypot(1.0, np.max(mu))))  # fmt: skip
        if "resultant" in stored:
            self.check_resultant(row, stored, p["force"])
        given = p["pair"].friction
        if given != stored["friction"]:
            self.note("friction coefficient", row, abs(given - stored["friction"]), 0)

    def check_resultant(self, row, stored, force):
        """The sum of reactions (P, 3) in the file."""
        resultant, strength = force.sum(axis=0), np.abs(force)
        self.note("resultant wrong by", row, np.abs(stored["resultant"][row] - resultant).max(),
                  1e-12 * max(strength.sum(), 1e-300))  # fmt: skip


def across_held(fixed, normal):
    """The tangential parts (P, 3, 3) of the directions that are held at each point."""
    directions = np.einsum("pi,ij->pij", fixed.astype(float), np.eye(3))
    along = np.einsum("pij,pj->pi", directions, normal)
    return directions - along[:, :, None] * normal[:, None, :]
