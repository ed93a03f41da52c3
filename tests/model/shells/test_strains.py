"""Strains of a sheet in results: exact where the answer is known, with warnings beyond the model."""

import warnings
from contextlib import nullcontext

import numpy as np
import pytest
from directors import angle_about, directors
from model_access import LoadParameters, Problem

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

pytestmark = pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")

YOUNG, THICKNESS = 2e6, 2e-3  # Pa, m
OBLIQUE = rotation_matrix(np.array([0.7, -1.1, 0.4]))
MAGNETIZATION = (4e4, 0.0, 0.0)


def sheet(cells=(6, 4), **options):
    mesh = ms.meshes.rectangle(0.3, 0.2, cells=cells, irregular=0.25, seed=7)
    return ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG, **options)


def strains(shell, positions, rotations):
    model = ms.Scene(shell, allow_rigid_motions=True)._model
    rows = model.principal_strains(model.state(positions, rotations), shell.thickness)
    return rows[:, :2], rows[:, 2:]


def strip(bending="midedge", cells=(20, 2), **options):
    """Return a scene of a strip of 10 cm x 2 cm, clamped at one end."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=cells)
    shell = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, bending=bending)
    return ms.Scene(shell, **{"supports": [ms.Clamp(mesh.edges_at(x=0.0))], **options})


def in_field(flux_density, scene=None, **options):
    return ms.equilibrium(
        scene or strip(field=ms.UniformField()),
        remanent_magnetization=MAGNETIZATION,
        applied_flux_density=(0, 0, flux_density),
        **options,
    )


# Values


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_a_stretched_sheet_has_greens_strain(bending):
    shell = sheet(bending=bending)
    stretch = np.array([[1.3, 0.2], [-0.1, 0.8]])
    positions = np.zeros_like(shell.mesh.rest_positions)
    positions[:, :2] = shell.mesh.rest_positions[:, :2] @ stretch.T
    membrane, bent = strains(shell, positions @ OBLIQUE.T + (0.1, 0.2, 0.3), np.zeros(shell.mesh.n_edges))
    expected = np.linalg.eigvalsh(0.5 * (stretch.T @ stretch - np.eye(2)))[::-1]
    assert membrane == pytest.approx(np.tile(expected, (shell.mesh.n_faces, 1)), abs=1e-12)
    assert np.abs(bent).max() < 1e-12


@pytest.mark.parametrize(
    "curvature",
    [[[1, 0], [0, 0]], [[0.36, 0.48], [0.48, 0.64]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[-1, 0], [0, -1]]],
    ids=["cylinder", "oblique cylinder", "saddle", "twist", "sphere"],
)
def test_a_curved_sheet_has_half_the_thickness_times_its_curvature(curvature):
    """Check a curvature so small that the plan hardly changes; positive where the normals lean together."""
    shell, curvature = sheet(), 1e-3 * np.array(curvature, dtype=float)
    plan = shell.mesh.rest_positions[:, :2]
    positions = np.column_stack([plan, 0.5 * np.einsum("vi,ij,vj->v", plan, curvature, plan)])
    slopes = shell.mesh.edge_midpoints[:, :2] @ curvature
    normals = np.column_stack([-slopes, np.ones(len(slopes))])
    _, bent = strains(shell, positions, directors(shell.mesh, positions, normals))
    expected = 0.5 * THICKNESS * np.linalg.eigvalsh(curvature)[::-1]
    assert bent == pytest.approx(np.tile(expected, (shell.mesh.n_faces, 1)), abs=1e-6 * 0.5e-3 * THICKNESS)


def test_a_strip_rolled_by_a_couple_has_the_strain_of_its_circle():
    """Check that with M = D / R the outer fibres have the strain h / 2R everywhere."""
    scene = strip()
    radius, rigidity = 0.04, 1e6 * 1e-3**3 / 12.0
    mesh = scene.mesh
    end = mesh.edges_at(x=0.1)
    rolled = ms.Scene(scene.shell, supports=scene.supports, loads=[ms.EdgeCouple(end, rigidity / radius)])
    found = ms.equilibrium(rolled)
    assert found.largest_bending_strain == pytest.approx(0.5 * 1e-3 / radius, rel=5e-3)
    per_face = np.abs(found.strains().bending).max(axis=1)
    assert per_face == pytest.approx(np.full(mesh.n_faces, 0.5 * 1e-3 / radius), rel=5e-3)
    assert found.largest_membrane_strain < 1e-3


def by_numpy(shell, positions, rotations):
    """Compute the tensors sum s_i S_i and h/2 sum delta_i R_i of every face in its plane, from DESIGN.md 2.1."""
    mesh = shell.mesh
    corners, rest = positions[mesh.faces], mesh.rest_positions[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    membrane, bent = np.zeros((mesh.n_faces, 2)), np.zeros((mesh.n_faces, 2))
    for f in range(mesh.n_faces):
        edges = [rest[f, (i + 2) % 3] - rest[f, (i + 1) % 3] for i in range(3)]
        now = [corners[f, (i + 2) % 3] - corners[f, (i + 1) % 3] for i in range(3)]
        turned = [np.cross(mesh.face_normals[f], edge) for edge in edges]
        area = mesh.face_areas[f]
        tensor, curvature = np.zeros((3, 3)), np.zeros((3, 3))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            change = now[i] @ now[i] - edges[i] @ edges[i]
            tensor -= (
                change * (np.outer(turned[j], turned[k]) + np.outer(turned[k], turned[j])) / (16 * area**2)
            )
            e = mesh.face_edges[f, i]
            forward, backward = mesh.edge_faces[e]
            along = positions[mesh.edges[e, 1]] - positions[mesh.edges[e, 0]]
            along /= np.linalg.norm(along)
            theta = (
                0.0 if min(forward, backward) < 0 else angle_about(along, normals[backward], normals[forward])
            )
            sign = 1.0 if f == forward else -1.0
            delta = 0.5 * theta + sign * rotations[e]
            curvature += delta * np.outer(turned[i], turned[i]) / (area * np.linalg.norm(turned[i]))
        for found, of in ((membrane, tensor), (bent, 0.5 * shell.thickness[f] * curvature)):
            values = np.linalg.eigvalsh(of)  # one of them is zero, that across the face
            zero = np.argmin(np.abs(values))
            found[f] = np.sort(np.delete(values, zero))[::-1]
    return membrane, bent


def test_strains_of_any_state_are_those_of_numpy(rng):
    shell = sheet(cells=(4, 3))
    mesh = shell.mesh
    positions = mesh.rest_positions + 5e-3 * rng.standard_normal(mesh.rest_positions.shape)
    rotations = 0.1 * rng.standard_normal(mesh.n_edges)
    for found, expected in zip(
        strains(shell, positions, rotations), by_numpy(shell, positions, rotations), strict=True
    ):
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_strains_reproduce_the_energies(bending, rng):
    """Check that the terms integrate the strains shown, with a clamp and varying thickness."""
    mesh = ms.meshes.rectangle(0.3, 0.2, cells=(6, 4), irregular=0.25, seed=7)
    thickness, nu = rng.uniform(1e-3, 3e-3, mesh.n_faces), 0.3
    shell = ms.Shell(mesh, thickness=thickness, young_modulus=YOUNG, poisson_ratio=nu, bending=bending)
    problem = Problem(ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))]), LoadParameters())
    positions = mesh.rest_positions + 2e-3 * rng.standard_normal(mesh.rest_positions.shape)
    q = problem.model.state(positions, 0.05 * rng.standard_normal(mesh.n_edges))
    rows = problem.model.principal_strains(q, thickness)
    energies = problem.model.energies(q, problem.load_parameters)

    def integral(pair, weight):
        density = (1 - nu) * (pair**2).sum(axis=1) + nu * pair.sum(axis=1) ** 2
        return float((weight * YOUNG * thickness * mesh.face_areas / (1 - nu**2) * density).sum())

    assert integral(rows[:, :2], 1 / 2) == pytest.approx(energies["membrane"], rel=1e-12)
    assert integral(rows[:, 2:], 1 / 6) == pytest.approx(energies["bending"], rel=1e-12)


# On every result


def test_an_equilibrium_has_its_largest_strains():
    found = in_field(2e-3)
    every = found.strains()
    assert every.membrane.shape == every.bending.shape == (found.scene.mesh.n_faces, 2)
    assert found.largest_membrane_strain == np.abs(every.membrane).max()
    assert found.largest_bending_strain == np.abs(every.bending).max() > 1e-3
    assert "largest strain" in repr(found) and "BEYOND" not in repr(found)
    thick = in_field(2e-3, found.scene, thickness=2e-3, young_modulus=1e6 / 4.0, start=found)
    assert thick.largest_bending_strain != found.largest_bending_strain
    assert thick.largest_bending_strain == np.abs(thick.strains().bending).max()


def test_load_cases_have_the_largest_of_all():
    cases = ms.equilibrium(
        strip(field=ms.UniformField()),
        remanent_magnetization=MAGNETIZATION,
        applied_flux_density=[(0, 0, 1e-3), (0, 0, 2e-3)],
    )
    assert cases.largest_bending_strain == cases[1].largest_bending_strain > cases[0].largest_bending_strain
    assert cases.largest_membrane_strain == max(case.largest_membrane_strain for case in cases)


def test_path_has_strains_at_each_point():
    scene = strip(field=ms.UniformField())
    path = ms.follow_path(scene, remanent_magnetization=MAGNETIZATION, applied_flux_density=(0, 0, 2e-3))
    assert len(path.largest_bending_strain) == len(path)
    for k in (0, len(path) - 1):
        assert np.abs(path.strains(k).bending).max() == path.largest_bending_strain[k]
    assert path.equilibrium(-1).largest_bending_strain == pytest.approx(path.largest_bending_strain[-1])
    assert "largest strain" in repr(path)


@pytest.mark.parametrize("dtype", [None, "float64", "float32"])
def test_motion_has_strains_in_each_state(dtype):
    """Check a clamp that rotates, whose direction across the edge is in none of the returned arrays."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    shell = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    clamp = ms.Clamp(mesh.edges_at(x=0.0), rotation=(0.0, -0.5, 0.0))
    load = np.zeros((mesh.n_vertices, 3))
    if dtype:
        torch = pytest.importorskip("torch")
        load = torch.zeros((mesh.n_vertices, 3), dtype=getattr(torch, dtype), requires_grad=True)
    move = ms.simulate(
        ms.Scene(shell, supports=[clamp], loads=[ms.PointLoad([5], (0, 0, 0))]),
        steps=6,
        time_step=1e-3,
        support_factor=lambda t: t / 6e-3,
        vertex_loads=load,
        record_every=2,
    )
    with nullcontext() if dtype is None else torch.no_grad():  # numbers, no tensors in the graph of the load
        assert len(move.largest_bending_strain) == len(move.largest_membrane_strain) == 4
        assert move.largest_bending_strain[0] < 1e-12 < move.largest_bending_strain[-1]
        for k in range(4):
            found = move.strains(k)
            tolerance = 1e-4 if dtype == "float32" else 1e-9  # returned arrays are rounded to float32
            assert np.abs(found.bending).max() == pytest.approx(move.largest_bending_strain[k], abs=tolerance)
            assert np.abs(found.membrane).max() == pytest.approx(
                move.largest_membrane_strain[k], abs=tolerance
            )
        assert f"state {int(np.argmax(move.largest_bending_strain))}: largest strain" in repr(move)


# The warning


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_large_strain_is_warned_of_at_the_callers_line():
    """Check a strip at 1000 T, which is "stable" at several times its length."""
    with pytest.warns(
        ms.LargeStrainWarning, match=r"^mT for T.*40 of 40 faces are beyond it: the first of them \d"
    ) as caught:
        found = in_field(1000.0, strip(cells=(10, 2), field=ms.UniformField()))
    assert found.stable and found.largest_membrane_strain > 2.0
    assert "BEYOND THE MODEL" in repr(found)
    strains = [warning for warning in caught if warning.category is ms.LargeStrainWarning]
    assert [warning.filename for warning in strains] == [__file__]


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_strain_warning_comes_once_a_scene_and_again_at_doubled_strain():
    scene = strip(cells=(10, 2), field=ms.UniformField())
    with pytest.warns(ms.LargeStrainWarning) as caught:
        for flux_density in (50.0, 51.0, 52.0, 400.0):
            found = in_field(flux_density, scene)
            assert found.largest_membrane_strain > 0.2
    assert sum(warning.category is ms.LargeStrainWarning for warning in caught) == 2


def test_small_strains_give_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ms.LargeStrainWarning)
        in_field(2e-3)


def test_moderately_large_strain_is_no_mistaken_unit():
    with pytest.warns(ms.LargeStrainWarning, match=r"^(?!mT for T)"):
        found = in_field(25.0, strip(cells=(10, 2), field=ms.UniformField()))
    assert 0.2 < found.largest_membrane_strain < 1.0


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_strain_warning_as_an_error_contains_the_result():
    scene = strip(cells=(10, 2), field=ms.UniformField())
    for _ in range(2):
        with warnings.catch_warnings():
            warnings.simplefilter("error", ms.LargeStrainWarning)
            with pytest.raises(ms.LargeStrainWarning) as error:
                in_field(1000.0, scene)
        assert error.value.last_good.largest_membrane_strain > 2.0


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_a_motion_and_a_path_name_the_state():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1))
    shell = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    ends = [
        ms.Pin(mesh.vertices_at(x=0.0)),
        ms.Pin(mesh.vertices_at(x=0.1), displacement=(0.06, 0, 0)),
    ]
    with pytest.warns(ms.LargeStrainWarning, match=r"recorded state 4, at 0\.4 s: .* 8 of 8 faces"):
        ms.simulate(ms.Scene(shell, supports=ends), steps=4, time_step=0.1, support_factor=lambda t: t / 0.4)
    with pytest.warns(ms.LargeStrainWarning, match=r"the path, at point \d+, parameter 1"):
        ms.follow_path(ms.Scene(shell, supports=ends))
