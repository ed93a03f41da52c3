"""States with a closed-form answer: uniform strain, uniform curvature, magnetization as a dead load."""

import numpy as np
import pytest
from directors import directors
from model_access import LoadParameters, Problem

import magshell as ms
from magshell.model.supports.supports import continuations, rotation_matrix

YOUNG, THICKNESS = 2e6, 2e-3  # Pa, m
OBLIQUE = rotation_matrix(np.array([0.7, -1.1, 0.4]))


def sheet(cells=(6, 4), length=0.3, width=0.2, **options):
    mesh = ms.meshes.rectangle(length, width, cells=cells, irregular=0.25, seed=7)
    return ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG, **options)


def free(shell):
    return Problem(ms.Scene(shell, allow_rigid_motions=True), LoadParameters())


def plane_stress(strain, nu):
    """Compute ((1 - nu) tr G^2 + nu (tr G)^2) / (1 - nu^2), twice the energy over stiffness and area."""
    return ((1 - nu) * np.trace(strain @ strain) + nu * np.trace(strain) ** 2) / (1 - nu**2)


# Membrane


@pytest.mark.parametrize("nu", [-0.6, 0.0, 0.3, 0.5])
@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_uniform_stretch_has_the_energy_of_plane_stress(nu, bending):
    problem = free(sheet(poisson_ratio=nu, bending=bending))
    mesh = problem.scene.mesh
    stretch = np.array([[1.3, 0.2], [-0.1, 0.8]])
    positions = np.zeros_like(mesh.rest_positions)
    positions[:, :2] = mesh.rest_positions[:, :2] @ stretch.T
    q = problem.model.state(positions @ OBLIQUE.T + (0.1, 0.2, 0.3), np.zeros(mesh.n_edges))
    green = 0.5 * (stretch.T @ stretch - np.eye(2))
    energies = problem.model.energies(q, problem.load_parameters)
    expected = 0.5 * YOUNG * THICKNESS * 0.3 * 0.2 * plane_stress(green, nu)
    assert energies["membrane"] == pytest.approx(expected, rel=1e-12)
    assert energies["bending"] < 1e-20


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_affine_displacement_of_the_boundary_extends_to_the_inside():
    shell = sheet(poisson_ratio=0.3)
    mesh = shell.mesh
    stretch = np.array([[1.2, 0.15, 0.0], [0.05, 0.9, 0.0], [0.0, 0.0, 1.0]]) - np.eye(3)
    pins = [ms.Pin([v], displacement=stretch @ mesh.rest_positions[v]) for v in mesh.boundary_vertices]
    found = ms.equilibrium(ms.Scene(shell, supports=pins), require_stable=False)
    expected = mesh.rest_positions @ (np.eye(3) + stretch).T
    assert np.abs(found.positions - expected).max() < 1e-10 * mesh.size


# Bending


CURVATURES = {
    "cylinder": [[1.0, 0.0], [0.0, 0.0]],
    "oblique cylinder": [[0.36, 0.48], [0.48, 0.64]],
    "saddle": [[1.0, 0.0], [0.0, -1.0]],
    "twist": [[0.0, 1.0], [1.0, 0.0]],
    "sphere": [[1.0, 0.0], [0.0, 1.0]],
}


@pytest.mark.parametrize("nu", [-0.5, 0.0, 0.3, 0.5])
@pytest.mark.parametrize("shape", CURVATURES)
def test_uniform_curvature_has_the_energy_of_a_plate(shape, nu):
    """Check the bending patch test, exact on any mesh, with a curvature so small that the plan hardly changes."""
    problem = free(sheet(poisson_ratio=nu))
    mesh = problem.scene.mesh
    curvature = 1e-3 * np.array(CURVATURES[shape])  # 1/m
    plan = mesh.rest_positions[:, :2]
    height = 0.5 * np.einsum("vi,ij,vj->v", plan, curvature, plan)
    positions = np.column_stack([plan, height])
    slopes = mesh.edge_midpoints[:, :2] @ curvature
    normals = np.column_stack([-slopes, np.ones(len(slopes))])
    q = problem.model.state(positions, directors(mesh, positions, normals))
    stiffness = YOUNG * THICKNESS**3 / 12.0
    expected = 0.5 * stiffness * 0.3 * 0.2 * plane_stress(curvature, nu)
    assert problem.model.energies(q, problem.load_parameters)["bending"] == pytest.approx(expected, rel=1e-6)
    inner = mesh.interior_edges
    moments = problem.model.edge_rotations(problem.gradient(q))
    largest = stiffness * np.abs(curvature).max() * mesh.edge_lengths.max()
    assert np.abs(moments[inner]).max() < 1e-6 * largest


@pytest.mark.parametrize("nu", [0.0, 0.4])
def test_a_rolled_sheet_has_the_energy_of_a_cylinder(nu):
    """Compare with D/2 kappa^2 A of a sheet bent to a half circle without stretch; convergence is of second order."""
    length, width = 0.3, 0.2
    radius = length / np.pi
    stiffness = YOUNG * THICKNESS**3 / (12.0 * (1 - nu**2))
    exact = 0.5 * stiffness / radius**2 * length * width
    errors = []
    for cells in ((9, 6), (18, 12), (36, 24)):
        problem = free(sheet(cells, poisson_ratio=nu))
        mesh = problem.scene.mesh
        x, y, _ = mesh.rest_positions.T
        positions = np.column_stack([radius * np.sin(x / radius), y, radius * (1 - np.cos(x / radius))])
        angle = mesh.edge_midpoints[:, 0] / radius
        normals = np.column_stack([-np.sin(angle), np.zeros_like(angle), np.cos(angle)])
        q = problem.model.state(positions, directors(mesh, positions, normals))
        errors.append(abs(problem.model.energies(q, problem.load_parameters)["bending"] / exact - 1.0))
    assert errors[-1] < 2e-3
    assert errors[1] < errors[0] / 3.0 and errors[2] < errors[1] / 3.0


# Magnetization as a dead load: case C4


TANGENTIAL = np.array([4e4, 3e4, 0.0])  # A/m
FLUX_DENSITY = np.array([2e-3, -1e-3, 3e-3])  # T


def edge_traction(mesh, rotation):
    """Return the boundary edges and the line load h (M . outward conormal) B on each, in N/m."""
    edges = mesh.boundary_edges
    conormals = continuations(mesh, edges)
    return edges, THICKNESS * (conormals @ rotation @ TANGENTIAL)[:, None] * (rotation @ FLUX_DENSITY)


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")  # without stiffness
@pytest.mark.parametrize("rotation", [np.eye(3), OBLIQUE], ids=["along the axes", "oblique"])
def test_a_tangential_magnetization_pulls_at_the_boundary_only(rotation, rng):
    mesh = sheet().mesh.transformed(rotation)
    shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e-12)
    scene = ms.Scene(shell, field=ms.UniformField(), allow_rigid_motions=True)
    problem = Problem(
        scene, LoadParameters(applied_flux_density=rotation @ FLUX_DENSITY), rotation @ TANGENTIAL
    )
    expected = ms.EdgeLoad(*edge_traction(mesh, rotation)).vertex_forces(mesh)
    scale = np.abs(expected).max()
    inside = np.setdiff1d(np.arange(mesh.n_vertices), mesh.boundary_vertices)
    for positions in (
        mesh.rest_positions,
        mesh.rest_positions + 0.02 * rng.normal(size=(mesh.n_vertices, 3)),
    ):
        q = problem.model.state(positions, np.zeros(mesh.n_edges))
        force = -problem.model.positions(problem.gradient(q))
        assert np.abs(force - expected).max() < 1e-12 * scale
        assert np.abs(force[inside]).max() < 1e-12 * scale


def test_a_magnetized_strip_is_a_strip_under_its_edge_load():
    shell = sheet(cells=(12, 4), length=0.1, width=0.02, poisson_ratio=0.3)
    mesh = shell.mesh
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    magnetized = ms.equilibrium(
        ms.Scene(shell, supports=[clamp], field=ms.UniformField()),
        remanent_magnetization=TANGENTIAL,
        applied_flux_density=FLUX_DENSITY,
    )
    loaded = ms.equilibrium(
        ms.Scene(shell, supports=[clamp], loads=[ms.EdgeLoad(*edge_traction(mesh, np.eye(3)))])
    )
    assert np.abs(loaded.displacements).max() > 0.03
    assert np.abs(magnetized.positions - loaded.positions).max() < 1e-9 * mesh.size


# Loads


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
@pytest.mark.parametrize("flipped", [False, True])
def test_a_couple_bends_a_strip_to_a_circle_about_its_axis(bending, flipped):
    """Compare a small tip height with C L^2 / (2 D).

    A moment vector rotates the edge by the right-hand rule, whichever side the normals point to.
    """
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    mesh = mesh.flipped() if flipped else mesh
    shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG, poisson_ratio=0.0, bending=bending)
    stiffness = YOUNG * THICKNESS**3 / 12.0
    couple = 1e-3 * stiffness / 0.1  # N: bends the strip by a thousandth of a radian
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    tip, ends = mesh.vertices_at(x=0.1), mesh.edges_at(x=0.1)
    heights = []
    for given in ((0.0, -couple, 0.0), -couple if flipped else couple):
        found = ms.equilibrium(ms.Scene(shell, supports=[clamp], loads=[ms.EdgeCouple(ends, given)]))
        heights.append(found.displacements[tip, 2].mean())
    exact = couple * 0.1**2 / (2.0 * stiffness)
    assert heights[0] == pytest.approx(exact, rel=2e-2 if bending == "midedge" else 6e-2)
    assert abs(heights[1]) == pytest.approx(heights[0], rel=1e-9)


def test_loads_have_the_stated_resultants():
    shell = sheet(mass_density=1e3)
    mesh = shell.mesh
    area, edges, force = 0.3 * 0.2, mesh.edges_at(x=0.3), np.array([1.0, -2.0, 3.0])
    totals = {
        "area": (ms.AreaLoad(force), force * area),
        "two faces": (ms.AreaLoad(force, faces=[3, 8]), force * mesh.face_areas[[3, 8]].sum()),
        "edge": (ms.EdgeLoad(edges, force), force * 0.2),
        "points": (ms.PointLoad([0, 4, 7], force), 3.0 * force),
    }
    for load, expected in totals.values():
        np.testing.assert_allclose(load.vertex_forces(mesh).sum(axis=0), expected, rtol=1e-12)
    assert shell.vertex_masses.sum() == pytest.approx(1e3 * THICKNESS * area, rel=1e-12)
    # Their potentials decrease by force times displacement.
    scene = ms.Scene(
        shell, loads=[load for load, _ in totals.values()], gravity=(0, 0, -9.81), allow_rigid_motions=True
    )
    problem = Problem(scene, LoadParameters(load_factor=1.0, gravity_factor=1.0))
    way = np.array([0.1, 0.2, -0.3])
    before, after = (
        problem.model.energies(
            problem.model.state(mesh.rest_positions + shift, np.zeros(mesh.n_edges)), problem.load_parameters
        )
        for shift in (np.zeros(3), way)
    )
    work = sum(expected @ way for _, expected in totals.values())
    assert before["loads"] - after["loads"] == pytest.approx(work, rel=1e-10)
    assert before["gravity"] - after["gravity"] == pytest.approx(
        shell.vertex_masses.sum() * 9.81 * 0.3, rel=1e-10
    )
