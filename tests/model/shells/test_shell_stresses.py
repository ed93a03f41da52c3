"""Membrane force, bending moment and stress of shells' faces: by formula, by equilibrium, by virtual work."""

import numpy as np
import pytest
from crossed_cells import crossed
from directors import directors
from model_access import LoadParameters

import magshell as ms
from magshell.model.scene.values import Values
from magshell.model.shells.shell_stresses import stresses_of
from magshell.model.supports.supports import rotation_matrix
from magshell.output.plot.colors import scalar_of
from magshell.output.results.state import states_of
from magshell.output.results.units import length_unit

YOUNG, POISSON, THICKNESS = 2e6, 0.3, 2e-3  # Pa, 1, m
OBLIQUE = rotation_matrix(np.array([0.7, -1.1, 0.4]))


def sheet(mesh=None, **given):
    mesh = mesh or ms.meshes.rectangle(0.3, 0.2, cells=(6, 4), irregular=0.25, seed=7)
    material = {"thickness": THICKNESS, "young_modulus": YOUNG, "poisson_ratio": POISSON}
    return ms.Shell(mesh, **(material | given))


def at(shell, positions, rotations=0.0):
    scene = ms.Scene(shell, allow_rigid_motions=True)
    rotations = np.broadcast_to(rotations, shell.mesh.n_edges).astype(float)
    return stresses_of(Values(scene), shell, scene._model.state(positions, rotations))


def plane_stress(strains, modulus):
    """Compute modulus/(1 - nu^2) ((1 - nu) E + nu tr E) in a plane across z, (..., 3, 3)."""
    traces = np.trace(strains, axis1=-2, axis2=-1)[..., None, None] * np.diag([1, 1, 0])
    return modulus / (1 - POISSON**2) * ((1 - POISSON) * strains + POISSON * traces)


def in_world(stresses, tensors):
    return np.einsum("fai,fab,fbj->fij", stresses.rest_axes, tensors, stresses.rest_axes)


def strip(n=20, **given):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(n, 4))
    shell = sheet(mesh, thickness=1e-3, **given)
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    return shell, mesh.edges_at(x=0.1), clamp


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
@pytest.mark.parametrize("mesh", [None, crossed(0.3, 0.2, (6, 4), [0.5, 0.01, 0.01, 0.5])], ids=["", "caps"])
def test_a_stretched_sheet(mesh, bending):
    """Compare a homogeneous deformation, also on obtuse faces, whose strain is measured on other triangles."""
    shell = sheet(mesh, bending=bending)
    stretch = np.array([[1.1, 0.05, 0], [-0.1, 0.9, 0], [0, 0, 1]])
    found = at(shell, shell.mesh.rest_positions @ stretch.T @ OBLIQUE.T + (0.1, 0.2, 0.3))
    strain = 0.5 * (stretch.T @ stretch - np.eye(3))
    force = plane_stress(strain, YOUNG * THICKNESS)
    assert np.allclose(in_world(found, found.membrane_strains), strain, atol=1e-12)
    assert np.allclose(in_world(found, found.membrane_forces), force, rtol=1e-9, atol=1e-9)
    assert np.allclose(found.principal_membrane_forces, np.linalg.eigvalsh(force[:2, :2])[::-1], rtol=1e-9)
    assert np.abs(found.bending_moments).max() < 1e-12 * YOUNG * THICKNESS**2
    cauchy = OBLIQUE @ stretch @ force @ stretch.T @ OBLIQUE.T / np.linalg.det(stretch) / THICKNESS
    assert np.allclose(found.in_space(found.membrane_forces), THICKNESS * cauchy, rtol=1e-9, atol=1e-8)
    assert np.allclose(found.cauchy_stresses, cauchy, rtol=1e-8, atol=1e-5)
    deviator = cauchy - np.trace(cauchy) / 3 * np.eye(3)
    assert np.allclose(found.von_mises_stresses, np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-8)
    assert np.allclose(found.green_strains, strain, atol=1e-9)


@pytest.mark.parametrize(
    "curvature", [[[1, 0], [0, 0]], [[0.36, 0.48], [0.48, 0.64]], [[0, 1], [1, 0]]], ids=str
)
def test_a_curved_sheet(curvature):
    """Compare z = x.k x/2, with normals up: positive k makes them lean together and compresses the top."""
    shell, plane = sheet(curvature_scale=0.7), np.zeros((3, 3))
    plane[:2, :2] = 1e-3 * np.array(curvature, dtype=float)
    plan = shell.mesh.rest_positions
    positions = plan + np.outer(0.5 * np.einsum("vi,ij,vj->v", plan, plane, plan), (0, 0, 1))
    normals = np.eye(3)[2] - shell.mesh.edge_midpoints @ plane
    found = at(shell, positions, directors(shell.mesh, positions, normals))
    moment = 0.7**2 * plane_stress(plane, YOUNG * THICKNESS**3 / 12)
    scale = np.abs(moment).max()
    assert np.allclose(in_world(found, found.curvatures), plane, atol=1e-9)
    assert np.allclose(in_world(found, found.bending_moments), moment, atol=1e-6 * scale)
    assert np.allclose(
        found.principal_bending_moments, np.linalg.eigvalsh(moment[:2, :2])[::-1], atol=1e-6 * scale
    )
    top, bottom = found.cauchy_stresses.transpose(1, 0, 2, 3)
    expected = -6 * moment / THICKNESS**2
    assert np.allclose(0.5 * (top - bottom), expected, atol=2e-3 * np.abs(expected).max())
    upper = found.green_strains[:, 0] - found.green_strains[:, 1]
    assert np.allclose(upper, -THICKNESS * plane, atol=1e-9)


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_forces_and_moments_do_the_virtual_work_of_the_energy(bending):
    """Compare the sum of N : dE + M : dK over the faces with the derivative of the energy along a motion.

    Material and curvature_scale differ from face to face and from edge to edge.
    """
    random = np.random.default_rng(3)
    mesh = ms.meshes.rectangle(0.3, 0.2, cells=(6, 4), irregular=0.25, seed=7)
    own = {name: random.uniform(0.5, 1.5, mesh.n_faces) for name in ("thickness", "young_modulus", "nu")}
    shell = sheet(
        mesh,
        bending=bending,
        thickness=THICKNESS * own["thickness"],
        young_modulus=YOUNG * own["young_modulus"],
        poisson_ratio=0.3 * own["nu"],
        curvature_scale=random.uniform(0.3, 1.0, mesh.n_edges),
    )
    scene = ms.Scene(shell, allow_rigid_motions=True)
    model, values, load_parameters = scene._model, Values(scene), LoadParameters().of(scene)
    model.set_values(values.numbers)

    def state(t):
        at = mesh.rest_positions + 0.01 * start[0] + t * along[0]
        return model.state(at, 0.2 * start[1] + t * along[1])

    start, along = (
        [random.normal(size=(mesh.n_vertices, 3)), random.normal(size=mesh.n_edges)] for _ in "ab"
    )
    step = 1e-6
    before, here, after = (stresses_of(values, shell, state(t)) for t in (-step, 0.0, step))
    rates = ((getattr(after, name) - getattr(before, name)) / (2 * step) for name in after._fields[:2])
    forces = (here.membrane_forces, here.bending_moments)
    work = [
        np.sum(mesh.face_areas[:, None, None] * force * rate)
        for force, rate in zip(forces, rates, strict=True)
    ]
    energies = [dict(model.energies(state(t), load_parameters)) for t in (-step, step)]
    for name, done in zip(("membrane", "bending"), work, strict=True):
        change = (energies[1][name] - energies[0][name]) / (2 * step)
        assert done == pytest.approx(change, rel=1e-6), name
    elastic = 0.5 * sum(
        np.sum(mesh.face_areas[:, None, None] * force * strain)
        for force, strain in zip(forces, here[:2], strict=True)
    )
    assert elastic == pytest.approx(sum(model.energies(state(0.0), load_parameters).values()), rel=1e-10)


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_a_sheet_carries_the_force_at_its_end(bending):
    shell, end, clamp = strip(bending=bending)
    rest = ms.equilibrium(ms.Scene(shell, supports=[clamp], loads=[ms.EdgeLoad(end, (20.0, 0, 0))]))
    stresses = rest[shell].stresses()
    force = stresses.in_space(stresses.membrane_forces)[:, 0, 0]
    x = shell.mesh.rest_positions[shell.mesh.faces].mean(axis=1)[:, 0]
    middle = abs(x - 0.05) < 0.02
    y = rest.positions[shell.mesh.vertices_at(x=0.05), 1]
    assert force[middle] * np.ptp(y) == pytest.approx(np.full(middle.sum(), 20.0 * 0.02), rel=1e-3)


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_a_cantilever_carries_force_times_arm(bending):
    """Check a strip bent upwards, whose normals lean together; nu = 0, so that it bends along only."""
    shell, end, clamp = strip(bending=bending, poisson_ratio=0.0)
    rest = ms.equilibrium(ms.Scene(shell, supports=[clamp], loads=[ms.EdgeLoad(end, (0, 0, 1e-4))]))
    stresses = rest[shell].stresses()
    moment = in_world(stresses, stresses.bending_moments)[:, 0, 0]
    x = shell.mesh.rest_positions[shell.mesh.faces].mean(axis=1)[:, 0]
    columns = np.round(x / (0.1 / 20) - 0.5).astype(int)
    mean = np.bincount(columns, moment) / np.bincount(columns)
    assert mean[1:-1] == pytest.approx(1e-4 * (0.1 - (np.arange(20) + 0.5)[1:-1] * 0.005), rel=0.02)


def test_a_couple_at_the_end_is_the_moment_everywhere():
    shell, end, clamp = strip(poisson_ratio=0.0)
    rest = ms.equilibrium(ms.Scene(shell, supports=[clamp], loads=[ms.EdgeCouple(end, 2e-3)]))
    found = rest[shell].stresses().bending_moments
    moments = np.linalg.eigvalsh(found)
    assert np.abs(moments).max(axis=1) == pytest.approx(np.full(len(found), 2e-3), rel=1e-6)


def test_stresses_of_every_kind_of_result_use_the_values_of_its_solve():
    shell, end, clamp = strip(mass_density=1e3)
    scene = ms.Scene(shell, supports=[clamp], loads=[ms.EdgeLoad(end, (1.0, 0, 0))])
    rest = ms.equilibrium(scene)
    force = rest[shell].stresses().membrane_forces
    thick = ms.equilibrium(scene, values={shell: {"thickness": 2e-3}})
    stresses = thick[shell].stresses()
    assert np.allclose(stresses.membrane_forces, force, atol=2e-3)
    assert np.allclose(2 * stresses.von_mises_stresses, rest[shell].stresses().von_mises_stresses, rtol=1e-2)
    assert np.array_equal(rest[shell].stresses().membrane_forces, force)
    path = ms.follow_path(scene)
    assert np.allclose(path[shell].stresses().membrane_forces, force, atol=1e-5)
    assert np.abs(path[shell].stresses(0).membrane_forces).max() < 1e-12
    cases = ms.equilibrium(scene, load_factor=[0.0, 1.0])
    assert np.allclose(cases[shell].stresses(1).membrane_forces, force, atol=1e-5)
    motion = ms.simulate(scene, steps=2, time_step=1e-4)
    assert 0 < np.abs(motion[shell].stresses().membrane_forces).max() < 2.0
    assert np.abs(motion[shell].stresses(0).membrane_forces).max() < 1e-12


def test_shells_and_solids_have_the_same_names():
    solid = ms.Solid(
        ms.meshes.box((0.1, 0.02, 0.02), cells=(3, 1, 1)),
        material=ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.3),
    )
    shell, end, clamp = strip()
    held = ms.Pin(solid.mesh.vertices_at(x=0.0), body=solid)
    pull = ms.EdgeLoad(end, (1.0, 0, 0), body=shell)
    clamp = ms.Clamp(clamp.edges, body=shell)
    alone = ms.equilibrium(ms.Scene(shell, supports=[clamp], loads=[pull]))[shell].stresses()
    for order in ([solid, shell], [shell, solid]):
        rest = ms.equilibrium(ms.Scene(order, supports=[held, clamp], loads=[pull]))
        assert np.allclose(rest[shell].stresses().membrane_forces, alone.membrane_forces, atol=1e-6)
        for body in order:
            found = rest[body].stresses()
            rows = found.volumes.shape
            assert found.cauchy_stresses.shape == found.green_strains.shape == (*rows, 3, 3)
            assert found.von_mises_stresses.shape == rows
            assert found.mean(found.von_mises_stresses).shape == rows[:1]
    with pytest.raises(ValueError, match=r"a shell of the scene.*Solid"):
        stresses_of(Values(rest.scene), solid, rest._state)


def test_pictures_and_pages_are_coloured_by_them(tmp_path):
    shell, end, clamp = strip()
    rest = ms.equilibrium(ms.Scene(shell, supports=[clamp], loads=[ms.EdgeLoad(end, (1.0, 0, 1e-3))]))
    stresses, states = rest[shell].stresses(), states_of(rest)
    for color, pair in (
        ("membrane_force", stresses.principal_membrane_forces),
        ("bending_moment", 1e6 * stresses.principal_bending_moments),
    ):
        scalar = scalar_of(states, color, None, None, length_unit(0.1))
        largest = np.take_along_axis(pair, np.abs(pair).argmax(axis=1)[:, None], 1)[:, 0]
        assert scalar.values[0] == pytest.approx(largest) and color.replace("_", " ") in scalar.label
        ms.plot(rest, color=color, width=400, style=ms.Style(backend="matplotlib"))
        ms.write_page(rest, tmp_path / "rest.html", color=color)
    with pytest.raises(ValueError, match=r"volume_ratio.*solids of a result, which has none"):
        ms.plot(rest, color="volume_ratio", width=400, style=ms.Style(backend="matplotlib"))
    with pytest.raises(ValueError, match=r"bending_moment.*shells of a result"):
        ms.plot(shell, color="bending_moment", width=400, style=ms.Style(backend="matplotlib"))
