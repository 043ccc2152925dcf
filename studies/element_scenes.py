"""Scenes of the study of element types: their decks for any type, and what is measured of each."""

import math

import numpy as np

from studies.deck_cards import pair, step
from studies.solid_meshes import SolidMesh, graded, of_gmsh

DRY = "*SURFACE INTERACTION, NAME=DRY\n"


def material(young, nu, *bodies):
    """Return the cards of an elastic material and the bodies of it."""
    sections = "".join(f"*SOLID SECTION, ELSET={body}, MATERIAL=M\n" for body in bodies)
    return f"*MATERIAL, NAME=M\n*ELASTIC\n{young!r}, {nu!r}\n{sections}"


def forces(result):
    """Return normal force and friction of a plane z = constant over the increments."""
    total = result.pairs[0].resultant
    return abs(total[:, 2]), np.linalg.norm(total[:, :2], axis=1)


# --- The block of the paper -------------------------------------------------------------------


def block_deck(kind, n, steps=10, solver="SOLVER=AUTO, TOLERANCE=1e-10"):
    """Return the paper's block, small strain: pressed, then pushed until all of it slides."""
    axis = np.linspace(0, 1, n + 1)
    body = SolidMesh("BODY", kind, (axis,) * 3)
    push = 0.4 * np.array([math.cos(math.pi / 3), math.sin(math.pi / 3)])
    return (
        body.cards() + body.set_cards("SOLE", body.nodes(2, 0))
        + body.set_cards("TOP", body.nodes(2, 1)) + material(210000.0, 0.3, "BODY")
        + "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n"
        + pair("SOLE, GROUND", 0.3) + f"*CONTACT SOLVER, {solver}\n"
        + step("TOP, 1, 2, 0.\nTOP, 3, 3, -0.1", steps // 5)
        + step(f"TOP, 1, 1, {float(push[0])!r}\nTOP, 2, 2, {float(push[1])!r}", 4 * steps // 5)
    )


def block_values(_body, result):
    """Return the normal force pressed and at the end, and the friction there."""
    normal, tangential = forces(result)
    return {"N pressed": normal[1], "N": normal[-1], "T": tangential[-1]}


# --- A beam on a round support ----------------------------------------------------------------


def bending_deck(kind, n):
    """Return a clamped beam under pressure that comes to rest on a cylinder; n across it."""
    body = SolidMesh("BODY", kind, (
        np.linspace(0, 6, 12 * n + 1), np.linspace(0, 0.3, max(1, int(0.75 * n)) + 1),
        np.linspace(0, 0.4, n + 1),
    ))
    sole = np.intersect1d(body.nodes(2, 0), np.flatnonzero(body.x[:, 0] > 2.9))
    tip = int(np.flatnonzero((abs(body.x - (6, 0, 0.4)) < 1e-9).all(axis=1))[0])
    return (
        body.cards() + body.set_cards("SOLE", sole) + body.set_cards("TOP", body.nodes(2, 1))
        + body.set_cards("ROOT", body.nodes(0, 0)) + body.set_cards("MIDDLE", body.nodes(1, 0))
        + f"*NSET, NSET=TIP\n{body.first + tip}\n"
        + material(1000.0, 0.3, "BODY")
        + "*OBSTACLE, NAME=SUPPORT, TYPE=CYLINDER\n4., 0., -10.01,  0., 1., 0.,  10.\n"
        + DRY + "*CONTACT PAIR, INTERACTION=DRY\nSOLE, SUPPORT\n"
        + "*CONTACT SOLVER, TOLERANCE=1e-10\n*BOUNDARY\nROOT, 1, 3\nMIDDLE, 2\n"
        + "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nTOP-F, P, 0.1\n*NODE FILE\nU\n*END STEP\n"
    )


def bending_values(_body, result):
    """Return the force of the support and how far the tip goes down."""
    tip = result.node_sets["TIP"][0]
    return {"force": forces(result)[0][-1], "tip": -float(result.field("displacement")[tip, 2])}


# --- Hertz: blocks whose gaps are those of a ball ----------------------------------------------

RADIUS, NU, SIZE = 5.0, 0.3, 8.0
MODULUS = 1000.0 / (1 - NU**2)
FORCE, PEAK = 4 / 3 * MODULUS / RADIUS, 2 * MODULUS / math.pi / RADIUS  # of a contact of radius 1


def hertz_pressure(x, radius=1.0, peak=PEAK):
    """Return Hertz's pressure at places (m, 2 or more)."""
    return peak * np.sqrt(np.maximum(0, 1 - (x[:, 0] ** 2 + x[:, 1] ** 2) / radius**2))


def hertz_body(kind, n):
    """Return a quarter of a block of 16 by 16 by 8; n counts along an edge, 2 n of linear kinds."""
    return SolidMesh("BODY", kind, (graded(n, SIZE, 12.0),) * 3)


def hertz_deck(kind, n):
    """Return a quarter of a block pressed on a plane, its gap that of a ball."""
    body = hertz_body(kind, n)
    return (
        body.cards() + body.set_cards("SOLE", body.nodes(2, 0, 2.0))
        + body.set_cards("TOP", body.nodes(2, 1)) + body.set_cards("X", body.nodes(0, 0))
        + body.set_cards("Y", body.nodes(1, 0)) + material(1000.0, NU, "BODY")
        + "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n"
        + DRY + "*CONTACT PAIR, INTERACTION=DRY\nSOLE, GROUND\n*CONTACT GAP, PARABOLA\n"
        + f"SOLE, 0., 0., 0., {RADIUS!r}\n*CONTACT SOLVER, TOLERANCE=1e-10\n"
        + "*BOUNDARY\nX, 1\nY, 2\n"
        + f"*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nTOP-F, P, {FORCE / 4 / SIZE**2!r}\n*END STEP\n"
    )


# Faces with mid-side nodes as pieces, on which pressures are linear or bilinear.
PIECES = {
    3: ((0, 1, 2),), 4: ((0, 1, 2, 3),),
    6: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    8: ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6, 7)),
}


def piece_rule(corners, points=8):
    """Return the functions of the corners of a piece, their derivatives and weights at its points.

    Shapes (m, corners), (m, corners, 2), (m). Of a triangle: Gauss's points, collapsed to a corner.
    """
    g, w = np.polynomial.legendre.leggauss(points)
    g, w = (g + 1) / 2, w / 2
    a, b = (grid.ravel() for grid in np.meshgrid(g, g, indexing="ij"))
    weights = np.outer(w, w).ravel()
    if corners == 3:
        weights, b = weights * (1 - a), b * (1 - a)
        one = np.ones_like(a)
        shape = np.stack([1 - a - b, a, b], axis=1)
        along = np.stack([-one, one, 0 * one, -one, 0 * one, one], axis=1).reshape(-1, 2, 3)
    else:
        shape = np.stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b], axis=1)
        along = np.stack([b - 1, 1 - b, b, -b, a - 1, -a, a, 1 - a], axis=1).reshape(-1, 2, 4)
    return shape, along, weights


RULES = {corners: piece_rule(corners) for corners in (3, 4)}


def surface_error(x, faces, values, exact):
    """Return the error of nodal values over faces in the mean square, beside exact(places)."""
    wrong = whole = 0.0
    for face in faces:
        for piece in PIECES[len(face)]:
            rows = face[list(piece)]
            shape, along, weights = RULES[len(piece)]
            tangents = along @ x[rows]
            area = weights * np.linalg.norm(np.cross(tangents[:, 0], tangents[:, 1]), axis=1)
            there = exact(shape @ x[rows])
            wrong += area @ (shape @ values[rows] - there) ** 2
            whole += area @ there**2
    return math.sqrt(wrong / whole)


def at_nodes(points, nodes, values):
    """Return values of points over all nodes of the mesh, zero where there is no point."""
    found = np.zeros(points)
    found[nodes] = values
    return found


def hertz_values(body, result):
    """Return the error of the pressure, that of its peak, and how far the block comes down."""
    touching = result.pairs[0]
    ids = result.node_ids[touching.nodes] - body.first
    pressure = at_nodes(len(body.x), ids, touching.pressure[-1])
    faces = [nodes for _, _, nodes in body.faces(body.nodes(2, 0, 2.0))]
    return {"pressure": surface_error(body.x, faces, pressure, hertz_pressure)}


def two_hertz_deck(kind, upper, lower):
    """Return two quarters of blocks of 12 by 12 by 6 whose faces do not match."""
    size, modulus = 6.0, 2 * MODULUS * (1 - NU**2)
    up, low = two_hertz_bodies(kind, upper, lower)
    return (
        up.cards() + low.cards() + up.set_cards("SOLE", up.nodes(2, 0, 1.8))
        + low.set_cards("SEAT", low.nodes(2, 0, 3.0)) + low.set_cards("FLOOR", low.nodes(2, 1))
        + up.set_cards("TOP", up.nodes(2, 1))
        + "".join(body.set_cards(f"{body.name}-{'XY'[k]}", rows)
                  for body in (up, low) for k, rows in enumerate(planes(body)))
        + material(modulus, NU, "UP", "LOW") + DRY
        + "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE, SMALL SLIDING\n"
        + f"SOLE-F, SEAT-F\n*CONTACT GAP, PARABOLA\nSOLE, 0., 0., 0., {RADIUS!r}\n"
        + "*CONTACT SOLVER, TOLERANCE=1e-10\n*BOUNDARY\nUP-X, 1\nUP-Y, 2\nLOW-X, 1\nLOW-Y, 2\n"
        + "FLOOR, 3\n*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nTOP-F, P, "
        + f"{FORCE / 4 / size**2!r}\n*END STEP\n"
    )


def planes(body):
    """Return the rows of a body's nodes on the planes x = 0 and y = 0."""
    return [np.flatnonzero(abs(body.x[:, k]) < 1e-9) for k in range(2)]


def two_hertz_bodies(kind, upper, lower):
    """Return slave and master: the lower one is turned about x = y, so that it lies below."""
    up = SolidMesh("UP", kind, (graded(upper, 6.0, 8.0),) * 3)
    low = SolidMesh("LOW", kind, (graded(lower, 6.0, 10.0),) * 3, 100001,
                    lambda x: x[:, [1, 0, 2]] * (1, 1, -1))
    return up, low


def two_hertz_values(kind, upper, lower, result):
    """Return the error of the pressure between two bodies."""
    up, _ = two_hertz_bodies(kind, upper, lower)
    touching = result.pairs[0]
    pressure = at_nodes(len(up.x), result.node_ids[touching.nodes] - 1, touching.pressure[-1])
    faces = [nodes for _, _, nodes in up.faces(up.nodes(2, 0, 1.8))]
    return {"pressure": surface_error(up.x, faces, pressure, hertz_pressure)}


# --- Cattaneo and Mindlin: two blocks alike, pressed, then pulled by 7/8 of what friction holds --


def mindlin_bodies(kind, n):
    """Return halves of two blocks alike, mirror images of each other."""
    half = graded(n, SIZE, 12.0)
    axes = (np.concatenate([-half[:0:-1], half]), -half[::-1], half)
    up = SolidMesh("UP", kind, (axes[0], half, half))
    low = SolidMesh("LOW", kind, axes, 500001, lambda x: x * (1, -1, -1))
    return up, low


def mindlin_deck(kind, n):
    """Return two blocks alike, pressed by a lid and then pulled by it; half of both."""
    up, low = mindlin_bodies(kind, n)
    sole, seat = (np.intersect1d(body.nodes(2, 0), near(body)) for body in (up, low))
    normal, tangential = FORCE / 2, 0.875 * 0.3 * FORCE / 2
    middle = np.setdiff1d(planes(up)[1], up.nodes(2, 1))
    return (
        up.cards() + low.cards() + up.set_cards("SOLE", sole) + low.set_cards("SEAT", seat)
        + up.set_cards("TOP", up.nodes(2, 1)) + low.set_cards("FLOOR", low.nodes(2, 1))
        + up.set_cards("UP-Y", middle) + low.set_cards("LOW-Y", planes(low)[1])
        + f"*NODE, NSET=LEAD\n900001, 0., 0., {SIZE!r}\n" + material(2000.0, NU, "UP", "LOW")
        + "*COUPLING, REF NODE=900001, SURFACE=TOP-F\n*KINEMATIC\n"
        + pair("SOLE-F, SEAT-F", 0.3, ", TYPE=SURFACE TO SURFACE, SMALL SLIDING")
        + f"*CONTACT GAP, PARABOLA\nSOLE, 0., 0., 0., {RADIUS!r}\n"
        + "*CONTACT SOLVER, TOLERANCE=1e-10\n*BOUNDARY\nFLOOR, 1, 3\nUP-Y, 2\nLOW-Y, 2\n"
        + "900001, 2\n900001, 4, 6\n"
        + f"*STEP\n*STATIC, DIRECT\n1., 1.\n*CLOAD\n900001, 3, {-normal!r}\n*END STEP\n"
        + f"*STEP\n*STATIC, DIRECT\n0.25, 1.\n*CLOAD\n900001, 1, {tangential!r}\n*END STEP\n"
    )


def near(body):
    """Return the rows of nodes of faces that begin within 2 of the middle of the contact."""
    rows = body.nodes(2, 0)
    x = abs(body.x)
    corner = (body.keys[rows] % 2 == 0).all(axis=1)
    limit = x[rows[corner], 0]
    limit = limit[limit >= 2.0 - 1e-9].min()
    return np.flatnonzero((x[:, 0] <= limit + 1e-9) & (x[:, 1] <= limit + 1e-9))


def mindlin_values(kind, n, result):
    """Return the errors of pressure and of friction, and the radius that sticks beside theory's."""
    up, _ = mindlin_bodies(kind, n)
    touching = result.pairs[0]
    ids = result.node_ids[touching.nodes] - 1
    traction = touching.reaction[-1] / touching.area[:, None]
    along = np.einsum("pk,pkx->px", traction[:, 1:], touching.frame[-1][:, 1:])[:, 0]
    sole = np.intersect1d(up.nodes(2, 0), near(up))
    faces = [nodes for _, _, nodes in up.faces(sole)]
    mu = 0.3

    def exact(x):
        return mu * (hertz_pressure(x) - 0.5 * hertz_pressure(x, 0.5))

    sticks = (traction[:, 0] > 0) & (
        np.linalg.norm(traction[:, 1:], axis=1) < mu * traction[:, 0] * (1 - 1e-6))
    return {
        "pressure": surface_error(up.x, faces, at_nodes(len(up.x), ids, traction[:, 0]),
                                  hertz_pressure),
        "friction": surface_error(up.x, faces, at_nodes(len(up.x), ids, abs(along)), exact),
        "stick": math.sqrt(2 * touching.area[sticks].sum() / math.pi) / 0.5,
    }


# --- Curved interfaces: balls and rings that Gmsh and maps make ----------------------------------

BALL = """SetFactory("OpenCASCADE");
Sphere(1) = {{0, 0, 5, 5, -Pi/2, 0, Pi/2}};
Field[1] = Ball;
Field[1].XCenter = 0; Field[1].YCenter = 0; Field[1].ZCenter = 0;
Field[1].Radius = 0.8; Field[1].Thickness = 4; Field[1].VIn = {h}; Field[1].VOut = 1.6;
Background Field = 1;
Mesh.MeshSizeExtendFromBoundary = 0; Mesh.MeshSizeFromPoints = 0; Mesh.MeshSizeFromCurvature = 0;
Mesh.ElementOrder = {order}; Mesh.RandomSeed = 1;
Physical Volume("BALL") = {{1}};
"""
SHELL = """SetFactory("OpenCASCADE");
Sphere(1) = {{0, 0, 0, {high}, 0, Pi/2, Pi/2}};
{cut}
Mesh.MeshSizeMin = {h}; Mesh.MeshSizeMax = {h}; Mesh.ElementOrder = {order}; Mesh.RandomSeed = 1;
Physical Volume("SHELL") = {{Volume{{:}}}};
"""
HOLLOW = ("Sphere(2) = {{0, 0, 0, {low}, 0, Pi/2, Pi/2}};\n"
          "BooleanDifference{{ Volume{{1}}; Delete; }}{{ Volume{{2}}; Delete; }}")
SMALL = 0.5  # radius of contact of the ball


def order_of(kind):
    """Return the order of the elements for Gmsh."""
    return 2 if kind == "C3D10" else 1


def on_sphere(body, radius, centre=(0, 0, 0)):
    """Return the rows of the nodes on a sphere, its mid-side nodes too, where they are chords'."""
    distance = np.linalg.norm(body.x - centre, axis=1)
    return np.flatnonzero(abs(distance - radius) < 1e-6 * radius)


def ball_body(kind, h):
    """Return an eighth of a ball of radius 5, its elements `h` long where it is pressed."""
    return of_gmsh(BALL.format(h=h, order=order_of(kind)), "BALL", kind)


def ball_deck(kind, h, body):
    """Return the ball pressed on a plane so that Hertz's radius of contact is 0.5."""
    force = FORCE * SMALL**3
    x = body.x
    near = np.intersect1d(on_sphere(body, 5, (0, 0, 5)),
                          np.flatnonzero((np.hypot(x[:, 0], x[:, 1]) < 1.6 * SMALL + 2 * h)
                                         & (x[:, 2] < 2.5)))
    top = np.flatnonzero(abs(x[:, 2] - 5) < 1e-6)
    sides = [np.flatnonzero(abs(x[:, k]) < 1e-7) for k in range(2)]
    return (
        body.cards() + body.set_cards("SOLE", near) + body.set_cards("TOP", top)
        + body.set_cards("X", sides[0]) + body.set_cards("Y", sides[1])
        + material(1000.0, NU, "BALL")
        + "*OBSTACLE, NAME=GROUND, TYPE=PLANE\n0., 0., 0.,  0., 0., 1.\n" + DRY
        + "*CONTACT PAIR, INTERACTION=DRY\nSOLE, GROUND\n*CONTACT SOLVER, TOLERANCE=1e-10\n"
        + "*BOUNDARY\nX, 1\nY, 2\n*STEP\n*STATIC, DIRECT\n1., 1.\n"
        + f"*DSLOAD\nTOP-F, P, {force / 4 / (25 * math.pi / 4)!r}\n*END STEP\n"
    )


def ball_values(result):
    """Return the error of the pressure within 0.8 a, in the mean square, beside its peak."""
    touching = result.pairs[0]
    place = touching.coordinates
    inside = np.hypot(place[:, 0], place[:, 1]) < 0.8 * SMALL
    error = touching.pressure[-1] - hertz_pressure(place, SMALL, PEAK * SMALL)
    return {"pressure": float(np.sqrt((error[inside] ** 2).mean())) / (PEAK * SMALL)}


def shell_deck(kind, h):
    """Return an eighth of a ball in a shell, both meshed at random: exact stress -1."""
    order, first = order_of(kind), 100001
    inner = of_gmsh(SHELL.format(high=1, h=h[0], order=order, cut=""), "IN", kind)
    hollow = HOLLOW.format(low=1)
    outer = of_gmsh(SHELL.format(high=2, h=h[1], order=order, cut=hollow), "OUT", kind, first)
    cards, held = "", ""
    for body in (inner, outer):
        for k, side in enumerate("XYZ"):
            rows = np.flatnonzero(abs(body.x[:, k]) < 1e-7)
            cards += body.set_cards(f"{body.name}-{side}", rows)
            held += f"{body.name}-{side}, {k + 1}\n"
    return (
        inner.cards() + outer.cards() + cards + inner.set_cards("SOLE", on_sphere(inner, 1))
        + outer.set_cards("SEAT", on_sphere(outer, 1))
        + outer.set_cards("SKIN", on_sphere(outer, 2)) + material(1000.0, NU, "IN", "OUT") + DRY
        + "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE, SMALL SLIDING, ADJUST=0.05\n"
        + f"SOLE-F, SEAT-F\n*CONTACT SOLVER, TOLERANCE=1e-10\n*BOUNDARY\n{held}"
        + "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nSKIN-F, P, 1.\n*END STEP\n"
    )


def ring_body(name, kind, n, inner, first=1, across=2):
    """Return a quarter of a ring 0.5 thick, `across` elements thick, n around, one high."""
    def place(x):
        radius, angle = x[:, 0], x[:, 1] * math.pi / 2
        found = np.stack([radius * np.cos(angle), radius * np.sin(angle), x[:, 2]], axis=1)
        return np.where(abs(found) < 1e-14, 0, found)

    return SolidMesh(name, kind, (np.linspace(inner, inner + 0.5, across + 1),
                                  np.linspace(0, 1, n + 1), np.array([0.0, 1.0])), first, place)


def rings_deck(kind, inner, outer):
    """Return a ring in a ring under pressure 1 all round: exact stress -1."""
    bodies = (ring_body("IN", kind, inner, 1.0), ring_body("OUT", kind, outer, 1.5, 100001))
    cards, held = "", ""
    for body in bodies:
        for axis, end, side in ((0, 0, "X0"), (0, 1, "X1"), (1, 0, "Y0"), (1, 1, "Y1"),
                                (2, 0, "Z0"), (2, 1, "Z1")):
            cards += body.set_cards(f"{body.name}-{side}", body.nodes(axis, end))
        held += f"{body.name}-Y0, 2\n{body.name}-Y1, 1\n{body.name}-Z0, 3\n"
    return (
        "".join(body.cards() for body in bodies) + cards + material(1000.0, NU, "IN", "OUT") + DRY
        + "*CONTACT PAIR, INTERACTION=DRY, TYPE=SURFACE TO SURFACE, SMALL SLIDING, ADJUST=0.05\n"
        + f"IN-X1-F, OUT-X0-F\n*CONTACT SOLVER, TOLERANCE=1e-10\n*BOUNDARY\n{held}"
        + "*STEP\n*STATIC, DIRECT\n1., 1.\n*DSLOAD\nIN-X0-F, P, 1.\nOUT-X1-F, P, 1.\n"
        + "IN-Z1-F, P, 1.\nOUT-Z1-F, P, 1.\n*END STEP\n"
    )


def uniform_values(result):
    """Return the error of a pressure of 1, in the mean square of the points."""
    error = result.pairs[0].pressure[-1] - 1
    return {"pressure": float(np.sqrt((error**2).mean()))}

