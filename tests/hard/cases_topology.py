"""Closed surfaces, several pieces, and meshes that are no surfaces: one-sided, branching, pinched."""

from __future__ import annotations

import numpy as np
from answers import Answer, at_rest, both, near, refused
from cases_slivers import cut_inside
from model_access import LoadParameters, Problem
from registry import case
from sheets import LENGTH, cantilever, end_position, force_for, shell, strip
from theory import stretch

import magshell as ms


def moebius_strip(cells: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and faces of a strip whose ends are joined with half a twist."""
    angle = 2.0 * np.pi * np.arange(cells) / cells
    rows = [
        np.stack(
            [
                (1 + side * np.cos(angle / 2)) * np.cos(angle),
                (1 + side * np.cos(angle / 2)) * np.sin(angle),
                side * np.sin(angle / 2),
            ],
            axis=1,
        )
        for side in (-0.2, 0.2)
    ]
    faces = []
    for k in range(cells):
        low, high = k, cells + k
        next_low, next_high = (k + 1, cells + k + 1) if k + 1 < cells else (cells, 0)
        faces += [(low, next_low, next_high), (low, next_high, high)]
    return np.concatenate(rows), np.array(faces)


@case("one-sided: no choice of normals is consistent")
def moebius():
    return refused(lambda: ms.TriangleMesh(*moebius_strip()), "normals point to opposite sides.*Moebius")


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])


@case("three sheets meet in an edge")
def three_faces_at_an_edge():
    points = np.concatenate([SQUARE, [[0.5, 0.5, 1.0]]])
    faces = [[0, 1, 2], [0, 2, 3], [0, 2, 4]]
    return refused(lambda: ms.TriangleMesh(points, faces), r"edge \(0, 2\) belongs to 3 faces")


@case("two faces with opposite orientation")
def opposite_orientation():
    return refused(lambda: ms.TriangleMesh(SQUARE, [[0, 1, 2], [0, 3, 2]]), "both run their common edge")


@case("a face given twice, the other way round")
def doubled_face():
    return refused(lambda: ms.TriangleMesh(SQUARE[:3], [[0, 1, 2], [2, 1, 0]]), "have the same vertices")


def joined_at_a_vertex(*supports, thickness=1e-2, gravity=1e-3) -> ms.Scene:
    """Return a scene of two heavy squares with one common vertex, the first clamped at x = 0."""
    other = SQUARE + np.array((1, 1, 0))
    points = np.concatenate([SQUARE, other[1:]])
    mesh = ms.TriangleMesh(points, [[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]])
    sheet = shell(mesh, thickness=thickness, mass_density=1e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    return ms.Scene(sheet, supports=[clamp, *supports], gravity=(0, 0, -gravity))


@case("two sheets that touch in one vertex: it is a ball joint")
def bow_tie():
    """Check that the second square hangs from the common corner.

    The opposite corner, kept at y = 2, hangs 1 m below, as both are sqrt(2) apart.
    """
    found = ms.equilibrium(joined_at_a_vertex(ms.Pin([5], "y")))
    drop = found.positions[2, 2] - found.positions[5, 2]
    return both(near("drop", drop, 1.0, rel=1e-4), at_rest(found))


@case("two sheets that touch in one vertex, and nothing keeps the second from turning about the vertical")
def spinning_bow_tie():
    return refused(
        lambda: ms.equilibrium(joined_at_a_vertex()),
        "leave the sheet free|rigid motion",
        ms.NotConverged,
    )


@case("a vertex that belongs to no face")
def unused_vertex():
    return refused(lambda: ms.TriangleMesh(SQUARE, [[0, 1, 2]]), "vertex 3 belongs to no face")


@case("closed: a sphere under pressure, held only against rigid motions")
def sphere_under_pressure():
    """Compare with the inward displacement u = p R^2 (1 - nu) / (2 E h)."""
    mesh = ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(32, 24))
    sheet = shell(mesh, thickness=1e-2, poisson_ratio=0.3)
    supports = three_points(mesh)
    pressure = 1e-3
    scene = ms.Scene(sheet, supports=supports, loads=[ms.AreaLoad(-pressure * mesh.face_normals)])
    moved = ms.linear_response(scene).displacements
    inwards = -np.einsum("vi,vi->v", moved, mesh.rest_positions)
    expected = pressure * 0.7 / (2.0 * 1e6 * 1e-2)
    return near("mean radial displacement", inwards.mean(), expected, rel=1e-2)


def three_points(mesh: ms.TriangleMesh) -> list[ms.Pin]:
    """Holds a sphere against its six rigid motions, and lets it shrink evenly."""
    top, bottom, side = (mesh.nearest_vertex(x) for x in ((0, 0, 1), (0, 0, -1), (1, 0, 0)))
    return [ms.Pin([top, bottom], "xy"), ms.Pin([side], "yz")]


@case("an eighth of a closed sphere with three symmetry planes: its buckling pressure")
def sphere_buckles():
    """Compare with 2 E (h / R)^2 / sqrt(3 (1 - nu^2)), Zoelly 1915, where many modes lie close together."""
    thickness = 0.05
    mesh = ms.meshes.spherical_cap(1.0, 0.0, np.pi / 2, np.pi / 2, cells=(24, 24))
    sheet = shell(mesh, thickness=thickness, poisson_ratio=0.3)
    classical = 2e6 * thickness**2 / np.sqrt(3.0 * (1.0 - 0.3**2))
    planes = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    scene = ms.Scene(sheet, supports=planes, loads=[ms.AreaLoad(-classical * mesh.face_normals)])
    return near("pressure over the classical one", ms.linear_buckling(scene).factors[0], 1.0, rel=6e-2)


@case("vertices of three faces: two neighbours of a face meet in one vertex")
def vertices_of_three_faces():
    """Check the Hessian of a mesh with every face cut into three at its middle."""
    whole = strip((6, 2))
    mesh = cut_inside(whole, np.arange(whole.n_faces), 1 / 3)
    return hessian_is_right(mesh)


@case("a tetrahedron: all three neighbours of a face meet in one vertex")
def tetrahedron():
    mesh = ms.TriangleMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return hessian_is_right(mesh)


def hessian_is_right(mesh: ms.TriangleMesh) -> Answer:
    """Compare H p with central differences of the gradient, in a generic state."""
    problem = Problem(
        ms.Scene(shell(mesh, thickness=0.01 * mesh.size), allow_rigid_motions=True), LoadParameters()
    )
    rng = np.random.default_rng(2)
    length = mesh.edge_lengths.min()
    positions = mesh.rest_positions + 0.1 * length * rng.normal(size=mesh.rest_positions.shape)
    q = problem.model.state(positions, 0.1 * rng.normal(size=mesh.n_edges))
    p = problem.model.state(length * rng.normal(size=positions.shape), rng.normal(size=mesh.n_edges))
    step = 1e-5
    differences = (problem.gradient(q + step * p) - problem.gradient(q - step * p)) / (2.0 * step)
    return near("H p", problem.hessian(q) @ p, differences, rel=1e-7)


@case("closed and free: nothing says where it is")
def free_sphere():
    sheet = shell(ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(12, 8)))
    return refused(lambda: ms.Scene(sheet), "leave the sheet free: translation")


@case("a closed ring pinched by two forces: bending only, 1e-6 of the membrane stiffness")
def pinched_ring():
    """Compare the deflection with (pi/4 - 2/pi) P R^3 / (E I)."""
    radius, thickness, force = 1.0, 1e-3, 1e-9
    scene = ring(force)
    mesh = scene.mesh
    moved = ms.linear_response(scene).displacements[mesh.vertices_at(x=0.0, z=radius), 2].mean()
    expected = (np.pi / 4 - 2 / np.pi) * force * radius**3 / (1e6 * thickness**3 / 12.0)
    return near("how far it closes", -moved, expected, rel=5e-3)


def ring(force: float, cells=(96, 2), thickness=1e-3) -> ms.Scene:
    """Return a scene of a ring of radius 1 that stands on a generator, with `force` [N/m] down along the top one."""
    radius, width = 1.0, 0.1
    mesh = ms.meshes.cylinder(radius, width, cells=cells)
    sheet = shell(mesh, thickness=thickness)
    top, bottom = mesh.edges_at(x=0.0, z=radius), mesh.edges_at(x=0.0, z=-radius)
    low = mesh.vertices_at(x=0.0, z=-radius)
    supports = [ms.Pin(low), ms.Pin(mesh.vertices_at(x=0.0, z=radius), "x")]
    assert len(bottom) == len(top)
    return ms.Scene(sheet, supports=supports, loads=[ms.EdgeLoad(top, (0, 0, -force))])


def square_tube(side: float, length: float, cells: tuple[int, int]) -> ms.TriangleMesh:
    """Return a tube along y with four edges of 90 degrees in its rest shape.

    cells: per side and along.
    """
    round_tube = ms.meshes.cylinder(
        1.0, length, (np.pi / 4, np.pi / 4 + 2 * np.pi), cells=(4 * cells[0], cells[1])
    )
    x, y, z = round_tube.rest_positions.T
    # The angle, a multiple of the cells', becomes the arc length along the sides.
    way = np.mod(np.arctan2(x, z) - np.pi / 4, 2 * np.pi) / (np.pi / 2)
    quarter, share = np.divmod(np.round(way * cells[0]) / cells[0], 1.0)
    corners = side / 2 * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    k = quarter.astype(int) % 4
    around = corners[k] + share[:, None] * (corners[(k + 1) % 4] - corners[k])
    return ms.TriangleMesh(np.stack([around[:, 0], y, around[:, 1]], axis=1), round_tube.faces)


@case("folds of 90 degrees in the rest shape: a square tube in torsion")
def box_beam():
    """Compare with Bredt's twist T L p / (4 A^2 G h), with the perimeter p = 4 a and A = a^2."""
    side, length, thickness, angle = 0.1, 0.5, 1e-3, 1e-6
    found = ms.equilibrium(twisted_tube(angle, (6, 24), length, thickness))
    shear_modulus = 1e6 / 2.6
    torque = angle * 4.0 * side**4 * shear_modulus * thickness / (length * 4.0 * side)
    return near("energy over Bredt's", found.energy / (0.5 * torque * angle), 1.0, rel=2e-2)


def twisted_tube(angle: float, cells: tuple[int, int], length=0.5, thickness=1e-3) -> ms.Scene:
    """Return a scene of a square tube, its ends held and turned by an angle [rad]."""
    mesh = square_tube(0.1, length, cells)
    sheet = shell(mesh, thickness=thickness, poisson_ratio=0.3)
    turned = ms.Pin(mesh.vertices_at(y=length), rotation=(0, angle, 0), center=(0, length, 0))
    return ms.Scene(sheet, supports=[ms.Pin(mesh.vertices_at(y=0.0)), turned])


@case("two pieces in one scene, 1e6 apart in stiffness")
def disconnected_pieces():
    return two_pieces(1e6, 4.0, (20, 2))


def two_pieces(stiffer: float, number: float, cells: tuple[int, int]) -> Answer:
    """Compare two strips in one scene, one of them `stiffer` and loaded by as much more, with a strip alone."""
    one = strip(cells)
    other = one.transformed(translation=(0, 2 * LENGTH, 0))
    points = np.concatenate([one.rest_positions, other.rest_positions])
    both_pieces = ms.TriangleMesh(points, np.concatenate([one.faces, other.faces + one.n_vertices]))
    modulus = np.repeat([1e6, 1e6 * stiffer], one.n_faces)
    sheet = shell(both_pieces, young_modulus=modulus)
    force = force_for(number, shell(one), LENGTH)
    middle = both_pieces.edge_midpoints[:, 1] > LENGTH
    far = both_pieces.edges_at(x=LENGTH)
    loads = [
        ms.EdgeLoad(far[~middle[far]], (0, 0, force)),
        ms.EdgeLoad(far[middle[far]], (0, 0, stiffer * force)),
    ]
    scene = ms.Scene(sheet, supports=[ms.Clamp(both_pieces.edges_at(x=0.0))], loads=loads)
    found = ms.equilibrium(scene)
    alone = ms.equilibrium(cantilever(shell(one), (0, 0, force)))
    expected = np.concatenate([alone.positions, alone.positions + np.array((0, 2 * LENGTH, 0))])
    return both(near("positions", found.positions, expected, rel=1e-7, scale=LENGTH), at_rest(found))


@case("the smallest sheet there is")
def one_triangle():
    mesh = ms.TriangleMesh([[0, 0, 0], [LENGTH, -0.01, 0], [LENGTH, 0.01, 0]], [[0, 1, 2]])
    sheet = shell(mesh, bending="hinge")
    supports = [ms.Pin([0]), ms.Pin([1, 2], "yz")]
    stress = 0.3
    load = ms.EdgeLoad(mesh.edges_at(x=LENGTH), (stress * 1e6 * sheet.thickness[0], 0, 0))
    found = ms.equilibrium(ms.Scene(sheet, supports=supports, loads=[load]))
    # A dead force on one side and the reaction at the corner: the stress is uniform, twice the force over h b.
    return near("stretch", end_position(mesh, found.positions)[0] / LENGTH, stretch(stress * 2.0), rel=1e-9)
