"""Normal contact: bodies at rest are carried, pressed bodies push back, falling bodies are stopped."""

import numpy as np
import pytest
from blocks import (
    GRAVITY,
    block_on,
    block_sheet,
    depth_under,
    force_at,
    resting_on_plane,
    simulated,
    smoothing_of,
    weight_of,
)

import magshell as ms


def normal_forces(contact: ms.Contact, obstacle, positions, sheet) -> np.ndarray:
    """Compute the forces on the vertices by the documented law alone, (n_v, 3) in N."""
    depth = contact.offset - obstacle.signed_distance(positions)
    forces = force_at(depth, smoothing_of(sheet), contact.contact_stiffness)
    return forces[:, None] * obstacle.normals(positions)


@pytest.mark.parametrize("offset", [0.0, 1e-3])
def test_at_rest_the_ground_carries_the_weight(offset):
    scene = block_on(ms.obstacles.Plane(), offset=offset)
    sheet = scene.shell
    start = resting_on_plane(sheet) + np.array([0, 0, offset])
    motion = simulated(scene, 20, 1e-2, start=start)
    np.testing.assert_allclose(motion.positions[-1], start, rtol=0, atol=1e-12)
    forces = normal_forces(scene.contacts[0], scene.obstacles[0], motion.positions[-1], sheet)
    np.testing.assert_allclose(forces.sum(axis=0), [0, 0, weight_of(sheet)], rtol=1e-7, atol=1e-12)


def quarter(cells=(8, 8), young_modulus=1e5) -> ms.Shell:
    mesh = ms.meshes.rectangle(0.03, 0.03, cells=cells)
    return ms.Shell(mesh, thickness=1e-3, young_modulus=young_modulus, mass_density=1e3)


@pytest.mark.parametrize(
    "obstacle",
    [
        ms.obstacles.Sphere(0.02, center=(0, 0, -0.02)),
        ms.obstacles.Box((0.04, 0.04, 0.02), rounding=2e-3, center=(0, 0, -0.01)),
        ms.obstacles.Capsule([[0, 0, -0.011], [0.1, 0, -0.011]], 0.011),
    ],
    ids=repr,
)
def test_obstacle_carries_the_weight_of_a_draped_sheet(obstacle):
    """Check a quarter of a sheet, whose symmetry planes exert no vertical force."""
    sheet = quarter()
    sides = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]
    contact = ms.Contact(obstacle, contact_stiffness=100.0)
    scene = ms.Scene(
        sheet, supports=sides, contacts=[contact], gravity=(0, 0, -GRAVITY), allow_rigid_motions=True
    )
    found = ms.equilibrium(scene)
    forces = normal_forces(contact, obstacle, found.positions, sheet)
    assert forces.sum(axis=0)[2] == pytest.approx(weight_of(sheet), rel=1e-6)
    assert np.ptp(found.positions[:, 2]) > 1e-3


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("samples, at", [(0, (1, 1, 1)), (1, (1, 1, 1)), (3, (4, 1, 1))])
def test_sample_points_on_faces_detect_a_peak_between_vertices(samples, at):
    """Drop a sheet on a small ball under a point of a face.

    With contact at vertices alone the ball would pass through the face, which is an error.
    """
    sheet = block_sheet(young_modulus=1e6)
    point = np.array(at) / sum(at) @ sheet.mesh.rest_positions[sheet.mesh.faces[2]]
    ball = ms.obstacles.Sphere(1e-3, center=point - [0, 0, 2e-3])
    scene = block_on(ball, sheet=sheet, face_samples=samples)
    if samples:
        motion = simulated(scene, 30, 1e-3)
        assert motion.energies["contact"].max() > 0
        assert np.ptp(motion.positions[-1, :, 2]) > 1e-3
    else:
        with pytest.raises(ms.NotConverged, match="passes between the points in contact") as caught:
            simulated(scene, 30, 1e-3)
        heights = caught.value.last_good.positions[-1, :, 2]
        assert np.ptp(heights) < 1e-9  # it has met no force
        assert -2e-3 < heights[0] < -1.6e-3  # and its plane has nearly reached the middle of the ball


def test_points_on_faces_share_the_load():
    """Check that on level ground every point of a stiff sheet, on vertices and faces, carries the same load."""
    sheet = block_sheet(young_modulus=1e11)
    scene = block_on(ms.obstacles.Plane(), sheet=sheet, face_samples=3)
    motion = simulated(scene, 30, 0.1)
    count = sheet.mesh.n_vertices + 3 * sheet.mesh.n_faces
    depth = depth_under(weight_of(sheet) / count, smoothing_of(sheet))
    np.testing.assert_allclose(motion.positions[-1, :, 2], -depth, rtol=2e-3)


def test_contact_acts_on_chosen_vertices_only():
    sheet = block_sheet(young_modulus=1e6)
    edge = sheet.mesh.vertices_at(x=0.0)
    motion = simulated(block_on(ms.obstacles.Plane(), sheet=sheet, vertices=edge), 30, 1e-3)
    free = np.setdiff1d(np.arange(sheet.mesh.n_vertices), edge)
    assert motion.positions[-1, edge, 2].min() > -1e-4
    assert motion.positions[-1, free, 2].max() < -1e-3


def test_pressed_between_two_plates():
    """Flatten an arc between two closing plates, which push equally hard and set its height."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(16, 2))
    radius, gap, closing, stiffness = 0.05, 2e-3, 1.0, 1e3
    angle = (mesh.rest_positions[:, 0] - 0.02) / radius
    arc = np.stack([radius * np.sin(angle), mesh.rest_positions[:, 1], radius * np.cos(angle)], axis=1)
    sheet = ms.Shell(ms.TriangleMesh(arc, mesh.faces), thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    low, high = arc[:, 2].min(), arc[:, 2].max()

    def descending(t):
        return 0, 0, (low + gap - high) * min(t, closing)

    lower = ms.obstacles.Plane(center=(0, 0, low))
    upper = ms.obstacles.Plane(normal=(0, 0, -1), center=(0, 0, high), motion=descending)
    contact = ms.Contact([lower, upper], contact_stiffness=stiffness)
    motion = simulated(ms.Scene(sheet, contacts=[contact], allow_rigid_motions=True), 20, 0.1)
    end, time = motion.positions[-1], motion.times[-1]
    up, down = (
        force_at(-plate.signed_distance(end, time), smoothing_of(sheet), stiffness).sum()
        for plate in (lower, upper)
    )
    assert up == pytest.approx(down, rel=1e-8)
    assert high - low > 1.9 * gap
    deepest = sum(-plate.signed_distance(end, time).min() for plate in (lower, upper))
    assert 0 < deepest < 0.02 * gap
    assert np.ptp(end[:, 2]) == pytest.approx(gap + deepest, rel=1e-12)


def dropped(integrator, time_step, time=0.02, stiffness=300.0):
    """Simulate a soft sheet that meets oblique ground at 0.3 m/s."""
    sheet = block_sheet((3, 3), young_modulus=1e6)
    ground = ms.obstacles.Plane(normal=(0.1, 0.2, 1.0), center=(0, 0, -3e-3))
    scene = block_on(ground, gravity=(0, 0, 0), sheet=sheet, contact_stiffness=stiffness)
    return simulated(
        scene, round(time / time_step), time_step, integrator=integrator, velocities=(0, 0, -0.3)
    )


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()], ids=repr)
def test_an_impact_that_is_resolved_keeps_the_energy(integrator):
    motion = dropped(integrator, 5e-5)
    assert motion.energies["contact"].max() > 0.03 * motion.energy[0]
    assert motion.energies["contact"][-1] == 0
    np.testing.assert_allclose(motion.energy, motion.energy[0], rtol=5e-3)


@pytest.mark.parametrize("time_step", [1e-4, 1e-3, 4e-3])
def test_implicit_euler_never_gains_energy_in_an_impact(time_step):
    motion = dropped(ms.ImplicitEuler(), time_step)
    assert np.diff(motion.energy).max() <= 1e-10 * motion.energy[0]
    assert motion.energy[-1] < 0.99 * motion.energy[0]
