"""Gradients of every energy term against differences of its energy, Hessians against differences of its gradient.

There is one row per term. Differences are taken along every degree of freedom and along the gradient itself. The states
are far from rest: stretched, compressed, and folded to within a tenth of a degree of lying flat on themselves.
"""

import numpy as np
import pytest
from model_access import LoadParameters, Problem

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

pytestmark = pytest.mark.filterwarnings("ignore::magshell.UnitWarning")  # sheets without stiffness

FIELD = (0.03, -0.05, 0.08)  # T
MAGNETIZATION = {"tangential": (4e4, 3e4, 0.0), "normal": (0.0, 0.0, 6e4), "mixed": (3e4, -2e4, 5e4)}


def flat_mesh(size):
    return ms.meshes.rectangle(1.0, 0.6, cells=(4, 2), irregular=0.2, seed=3).scaled(size)


def curved_mesh(size):
    mesh = flat_mesh(size)
    x, y, _ = mesh.rest_positions.T / size
    return ms.TriangleMesh(np.stack([x, y, 0.2 * x**2 - 0.15 * x * y], axis=1) * size, mesh.faces)


def shell(mesh, thickness=0.02, **options):
    """Return a shell whose thickness is given in units of the mesh's size.

    A thin one is dominated by membrane energy, a thick one by bending energy.
    """
    size = mesh.size
    return ms.Shell(mesh, thickness=thickness * size, young_modulus=1e6, poisson_ratio=0.35, **options)


def elastic(thickness, bending):
    def build(size):
        scene = ms.Scene(shell(curved_mesh(size), thickness, bending=bending), allow_rigid_motions=True)
        return Problem(scene, LoadParameters())

    return build


def capped_mesh(size):
    """Return a mesh with two faces of an angle of 165 degrees, whose strain is measured on other triangles."""
    mesh = flat_mesh(size)
    long = mesh.interior_edges[[1, -2]]
    faces = mesh.edge_faces[long, 0]
    tips = [
        np.setdiff1d(face, ends)[0] for face, ends in zip(mesh.faces[faces], mesh.edges[long], strict=True)
    ]
    x = mesh.rest_positions
    points = 0.88 * mesh.edge_midpoints[long] + 0.12 * x[tips]
    corners, new = mesh.faces[faces], mesh.n_vertices + np.arange(2)
    parts = [np.stack([corners[:, i], corners[:, (i + 1) % 3], new], axis=1) for i in range(3)]
    return ms.TriangleMesh(
        np.concatenate([x, points]), np.concatenate([np.delete(mesh.faces, faces, axis=0), *parts])
    )


def capped(thickness):
    def build(size):
        scene = ms.Scene(shell(capped_mesh(size), thickness), allow_rigid_motions=True)
        assert len(scene._model.recut_faces) == 4
        return Problem(scene, LoadParameters())

    return build


def soft(mesh, **options):
    """Return a shell whose elastic energy is negligible beside that of what acts on it."""
    return ms.Shell(mesh, thickness=1e-2 * mesh.size, young_modulus=1e-9, **options)


def magnetic(field, magnetization, load_parameters, law="stretches"):
    def build(size):
        source = field(size)
        sheet = soft(curved_mesh(size), magnetization_law=law)
        scene = ms.Scene(sheet, field=source, allow_rigid_motions=True)
        return Problem(scene, load_parameters, np.array(MAGNETIZATION[magnetization]))

    return build


def uniform(size):
    return ms.UniformField()


def dipoles(size):
    return ms.Dipoles(
        size * np.array([[0.3, 0.2, -1.2], [1.5, -0.9, 1.0]]),
        size**3 * np.array([[3e5, 1e5, 5e5], [0, 4e5, 1e5]]),
    )


def sampled(size):
    return ms.SampledField.from_function(
        dipoles(size).flux_density, np.full(3, -0.8) * size, np.array([1.6, 1.2, 0.8]) * size, (7, 6, 5)
    )


def custom(size):
    return ms.CustomField(dipoles(size).flux_density, length_scale=size)


def custom_with_gradient(size):
    field = dipoles(size)
    return ms.CustomField(field.flux_density, gradient=field.gradient, length_scale=size)


def everything_magnetic(size):
    return [ms.UniformField(), dipoles(size), sampled(size)]


def gravity(size):
    scene = ms.Scene(
        soft(flat_mesh(size), mass_density=1e3), gravity=(1.0, -2.0, -9.81), allow_rigid_motions=True
    )
    return Problem(scene, LoadParameters(gravity_factor=0.7))


def loads(size):
    mesh = flat_mesh(size)
    acting = [
        ms.PointLoad([0, 5], [[1.0, 2.0, 3.0], [-1.0, 0.5, 0.2]]),
        ms.EdgeLoad(mesh.edges_at(x=size), (0.4, -0.3, 2.0)),
        ms.AreaLoad((0.0, 0.7, -1.0), faces=[1, 3, 4]),
    ]
    return Problem(
        ms.Scene(soft(mesh), loads=acting, allow_rigid_motions=True), LoadParameters(load_factor=1.3)
    )


def edge_moment(bending):
    def build(size):
        mesh = curved_mesh(size)
        ends = mesh.edges_where(lambda midpoints: midpoints[:, 0] > 0.9 * size, boundary_only=True)
        scene = ms.Scene(
            soft(mesh, bending=bending), loads=[ms.EdgeCouple(ends, 0.8)], allow_rigid_motions=True
        )
        return Problem(scene, LoadParameters(load_factor=1.0))

    return build


def clamped(size):
    mesh = curved_mesh(size)
    inner = mesh.edges_between(mesh.vertices_where(lambda x: np.abs(x[:, 0] - 0.5 * size) < 0.13 * size))
    supports = [ms.Clamp(mesh.edges_at(x=0.0), rotation=(0.0, 1.0, 0.0)), ms.Clamp(inner[:1])]
    scene = ms.Scene(shell(mesh, 10.0), supports=supports)
    return Problem(scene, LoadParameters(support_factor=0.5))


def turned(mesh):
    """Return a rotation by 0.9 rad about an axis that is oblique to the world's axes."""
    axis = np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0)
    return rotation_matrix(0.9 * axis)


def oblique_symmetry(size):
    mesh = flat_mesh(size)
    rotation = turned(mesh)
    supports = [ms.SymmetryPlane(rotation @ (1, 0, 0)), ms.SymmetryPlane(rotation @ (0, 1, 0))]
    scene = ms.Scene(shell(mesh.transformed(rotation), 0.1), supports=supports, allow_rigid_motions=True)
    return Problem(scene, LoadParameters())


def scaled_curvature(size):
    mesh = curved_mesh(size)
    scale = np.random.default_rng(5).uniform(0.3, 3.0, mesh.n_edges)
    return Problem(
        ms.Scene(shell(mesh, 10.0, curvature_scale=scale), allow_rigid_motions=True), LoadParameters()
    )


def patchwork(size):
    mesh = curved_mesh(size)
    draw = np.random.default_rng(6).uniform
    sheet = ms.Shell(
        mesh,
        thickness=draw(0.02, 0.3, mesh.n_faces) * size,
        young_modulus=draw(1e5, 1e7, mesh.n_faces),
        poisson_ratio=draw(-0.9, 0.5, mesh.n_faces),
    )
    return Problem(ms.Scene(sheet, allow_rigid_motions=True), LoadParameters())


IN_FIELD = LoadParameters(applied_flux_density=np.array(FIELD))
IN_SOURCES = LoadParameters(applied_flux_density=np.zeros(3), field_factor=1.0)
IN_BOTH = LoadParameters(applied_flux_density=np.array(FIELD), field_factor=0.8)

# name -> (builder for a given size, the term that must have nearly all of the energy, or None)
TERMS = {
    "membrane": (elastic(1e-6, "midedge"), "membrane"),
    "membrane beside caps": (capped(1e-6), "membrane"),
    "bending, midedge": (elastic(1e3, "midedge"), "bending"),
    "bending, hinge": (elastic(1e3, "hinge"), "bending"),
    "magnetic, tangential": (magnetic(uniform, "tangential", IN_FIELD), "magnetic"),
    "magnetic, normal": (magnetic(uniform, "normal", IN_FIELD), "magnetic"),
    "magnetic, mixed": (magnetic(uniform, "mixed", IN_FIELD), "magnetic"),
    "dipoles": (magnetic(dipoles, "mixed", IN_SOURCES), "magnetic"),
    "sampled grid": (magnetic(sampled, "mixed", IN_SOURCES), "magnetic"),
    "custom field": (magnetic(custom, "mixed", IN_SOURCES), "magnetic"),
    "custom field with gradient": (magnetic(custom_with_gradient, "tangential", IN_SOURCES), "magnetic"),
    "superposed fields": (magnetic(everything_magnetic, "mixed", IN_BOTH), "magnetic"),
    "magnetic, rotating, tangential": (magnetic(uniform, "tangential", IN_FIELD, "rotates"), "magnetic"),
    "magnetic, rotating, mixed": (magnetic(uniform, "mixed", IN_FIELD, "rotates"), "magnetic"),
    "superposed fields, rotating": (magnetic(everything_magnetic, "mixed", IN_BOTH, "rotates"), "magnetic"),
    "gravity": (gravity, "gravity"),
    "loads": (loads, "loads"),
    "edge couple, midedge": (edge_moment("midedge"), "couple"),
    "edge couple, hinge": (edge_moment("hinge"), "couple"),
    "clamped edges": (clamped, "bending"),
    "oblique symmetry planes": (oblique_symmetry, None),
    "curvature scale": (scaled_curvature, "bending"),
    "material a face": (patchwork, None),
}


# States


def bent(problem, rng, amplitude=0.12):
    """Return a state with random displacements of about a tenth of an edge, on top of stretches along the axes."""
    mesh = problem.scene.mesh
    strain = np.diag([1.35, 0.7, 1.1]) + 0.1 * rng.normal(size=(3, 3))
    spacing = mesh.edge_lengths.min()
    moves = amplitude * spacing * rng.normal(size=(mesh.n_vertices, 3))
    return problem.model.state(mesh.rest_positions @ strain.T + moves, 0.3 * rng.normal(size=mesh.n_edges))


def folded(degrees):
    """Return a function that makes a state folded by an angle about an edge in the middle of the flattened sheet."""

    def state(problem, rng):
        mesh = problem.scene.mesh
        x = mesh.rest_positions
        crease = crease_edge(mesh)
        start, end = x[mesh.edges[crease]]
        along = (end - start) / np.linalg.norm(end - start)
        tips = [face_tip(mesh, face, crease) for face in mesh.edge_faces[crease]]
        normal = mesh.face_normals[mesh.edge_faces[crease, 0]]
        flat = x - np.outer((x - start) @ normal, normal)
        across = np.cross(normal, along)
        on_right = (flat - start) @ across < 0.0
        assert on_right[tips[0]] != on_right[tips[1]]
        on_right[mesh.edges[crease]] = False
        rotation = rotation_matrix(np.radians(degrees) * along)
        positions = np.where(on_right[:, None], (flat - start) @ rotation.T + start, flat)
        left_open = np.pi - abs(np.radians(degrees))
        positions = positions + 0.05 * left_open * mesh.edge_lengths.min() * rng.normal(size=positions.shape)
        assert abs(abs(dihedral_angle(mesh, positions, crease)) - np.pi + left_open) < 0.5 * left_open
        return problem.model.state(positions, 0.3 * rng.normal(size=mesh.n_edges))

    return state


def crease_edge(mesh):
    """Return the interior edge nearest to the middle of the mesh."""
    inner = mesh.interior_edges
    center = mesh.rest_positions.mean(axis=0)
    return inner[np.argmin(np.linalg.norm(mesh.edge_midpoints[inner] - center, axis=1))]


def face_tip(mesh, face, edge):
    return np.setdiff1d(mesh.faces[face], mesh.edges[edge])[0]


def dihedral_angle(mesh, positions, edge):
    start, end = positions[mesh.edges[edge]]
    left, right = (positions[face_tip(mesh, face, edge)] for face in mesh.edge_faces[edge])
    normal_left, normal_right = np.cross(end - start, left - start), np.cross(right - start, end - start)
    sine = np.cross(normal_left, normal_right) @ (end - start) / np.linalg.norm(end - start)
    return np.arctan2(sine, normal_left @ normal_right)


STATES = {
    "bent": bent,
    "folded by 170 degrees": folded(170.0),
    "folded by 179 degrees": folded(179.0),
    "folded by 179.9 degrees": folded(179.9),
    "folded by -179.9 degrees": folded(-179.9),
}

# [-] Relative errors. The project requires 1e-7 and 1e-6; the differences themselves are accurate to a few 1e-11.
GRADIENT_TOLERANCE = 1e-9
HESSIAN_TOLERANCE = 1e-9


# Differences


def steps(problem):
    """Return the unit of each unknown: a length of the mesh for positions, 1 for rotations and directions, (n,)."""
    size = problem.scene.mesh.edge_lengths.min()
    units = np.ones(problem.model.size)
    units[: 3 * problem.scene.mesh.n_vertices] = size
    return units


def difference(function, q, direction, step):
    """Compute d function(q + t direction)/dt by central differences, fourth order by Richardson extrapolation."""

    def central(h):
        return (function(q + h * direction) - function(q - h * direction)) / (2.0 * h)

    return (4.0 * central(step) - central(2.0 * step)) / 3.0


def best_difference(function, q, direction, exact, weights=1.0):
    """Return the smallest error over several step sizes; a wrong derivative is wrong with every one of them."""
    found = [difference(function, q, direction, step) for step in (1e-3, 3e-4, 1e-4, 3e-5)]
    return min(np.max(np.abs((value - exact) * weights)) for value in found)


def worst_errors(problem, q):
    """Return the errors of the gradient and of the Hessian, relative to their largest entries in units of energy."""
    units = steps(problem)
    gradient = problem.gradient(q)  # first: a couple counts full circles from the last evaluated state
    hessian = problem.hessian(q)
    assert np.isfinite(gradient).all() and np.isfinite(hessian).all()
    by_gradient = gradient * units
    directions = np.concatenate([np.diag(units), [by_gradient / np.abs(by_gradient).max() * units]])
    largest = np.abs(by_gradient).max()
    scaled_hessian = hessian * units * units[:, None]
    # A Hessian far below force over unit length is round-off: its error is then measured relative to the forces.
    largest_hessian = max(np.abs(scaled_hessian).max(), largest)
    gradient_error = max(best_difference(problem.energy, q, d, gradient @ d) for d in directions) / largest
    hessian_error = (
        max(best_difference(problem.gradient, q, d, hessian @ d, units) for d in directions) / largest_hessian
    )
    return gradient_error, hessian_error


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("term", TERMS)
def test_gradient_and_hessian_agree_with_differences(term, state, rng):
    build, _ = TERMS[term]
    problem = build(1.0)
    gradient_error, hessian_error = worst_errors(problem, STATES[state](problem, rng))
    assert gradient_error < GRADIENT_TOLERANCE
    assert hessian_error < HESSIAN_TOLERANCE


@pytest.mark.parametrize("size", [1e-3, 1e3])
@pytest.mark.parametrize("term", TERMS)
def test_derivatives_hold_at_a_millimetre_and_at_a_kilometre(term, size, rng):
    build, _ = TERMS[term]
    problem = build(size)
    gradient_error, hessian_error = worst_errors(problem, bent(problem, rng))
    assert gradient_error < GRADIENT_TOLERANCE
    assert hessian_error < HESSIAN_TOLERANCE


@pytest.mark.parametrize("term", [name for name, (_, carrier) in TERMS.items() if carrier])
def test_tested_term_dominates_the_energy(term, rng):
    """Check that one term dominates the energy; otherwise the derivatives of others would hide an error in it."""
    build, carrier = TERMS[term]
    problem = build(1.0)
    energies = problem.model.energies(bent(problem, rng), problem.load_parameters)
    rest = sum(abs(value) for name, value in energies.items() if name != carrier)
    assert abs(energies[carrier]) > 50.0 * rest


@pytest.mark.parametrize("term", TERMS)
def test_free_hessian_is_the_full_one_rotated_and_restricted(term, rng):
    """Check the free Hessian where supports oblique to the axes rotate their nodes into local frames."""
    build, _ = TERMS[term]
    problem = build(1.0)
    q = bent(problem, rng)
    free = np.stack([problem.model.expand(row) for row in np.eye(problem.scene.n_dofs)])
    expected = free @ problem.hessian(q) @ free.T
    assert np.abs(problem.hessian(q, reduced=True) - expected).max() <= 1e-13 * np.abs(expected).max()
    np.testing.assert_allclose(free @ free.T, np.eye(len(free)), atol=1e-14)
    gradient = problem.gradient(q)
    np.testing.assert_allclose(
        problem.model.reduce(gradient), free @ gradient, atol=1e-13 * np.abs(gradient).max()
    )
