"""Magnetic forces do not depend on the direction of the axes: a scene that is turned or mirrored has the same ones."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell.model.scene.extent import extent_of

TURNED = {
    "about an oblique axis": Rotation.from_rotvec([0.3, -1.1, 2.0]).as_matrix(),
    "about z": Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix(),
    "about x": Rotation.from_rotvec([1.0, 0.0, 0.0]).as_matrix(),
    "mirrored": np.diag([1.0, -1.0, 1.0]),
    "mirrored and turned": Rotation.from_rotvec([0.3, -1.1, 2.0]).as_matrix() @ np.diag([1.0, -1.0, 1.0]),
}
UNIFORM = [(0.0, 0.0, 0.0), (1e-3, 0.0, 0.0), (1e-3, 2e-3, 4e-3), (0.0, 0.0, 4e-2)]


def waved(x: np.ndarray) -> np.ndarray:
    """Return a displacement without a symmetry, (n, 3) m."""
    a, b = x[:, 0], x[:, 1]
    return 2e-4 * np.stack(
        [np.sin(90 * a + 40 * b), np.cos(70 * a + 150 * b), np.sin(120 * a + 90 * b + 1)], axis=1
    )


def forces_near_magnet(frame: np.ndarray, uniform) -> tuple[float, np.ndarray]:
    """Return the magnetic energy [J] and the forces [N] of a waved strip near a cuboid magnet, in the axes of the strip.

    frame: (3, 3), by which all of it is turned or mirrored. A mirror turns the vectors of a magnetic field and of a
    magnetization around as well.
    """
    axial = np.linalg.det(frame) * frame
    mesh = ms.meshes.rectangle(0.03, 0.01, cells=(6, 3))
    x = mesh.rest_positions
    faces = mesh.faces if np.linalg.det(frame) > 0 else mesh.faces[:, ::-1]
    turned = ms.TriangleMesh(x @ frame.T, faces)
    sheet = ms.Shell(
        turned, thickness=3e-4, young_modulus=1e6, remanent_magnetization=axial @ [3e4, 1e4, 5e3]
    )
    rotation = frame if np.linalg.det(frame) > 0 else frame @ np.diag([1.0, 1.0, -1.0])
    magnetization = rotation.T @ axial @ [2e5, 1e5, 3e5]
    magnet = ms.CuboidMagnet(
        (0.008, 0.006, 0.004),
        magnetization,
        center=frame @ [0.035, 0.005, -0.012],
        rotation=Rotation.from_matrix(rotation).as_rotvec(),
    )
    clamp = ms.Clamp(turned.edges_where(lambda points: np.abs((points @ frame)[:, 0]) < 1e-7))
    scene = ms.Scene(sheet, supports=[clamp], field=[ms.UniformField(), magnet])
    positions, flux = (x + waved(x)) @ frame.T, axial @ np.array(uniform)
    on_vertices = ms.forces(scene, positions, applied_flux_density=flux).on_vertices @ frame
    return ms.energies(scene, positions, applied_flux_density=flux)["magnetic"], on_vertices


@pytest.mark.parametrize("uniform", UNIFORM)
@pytest.mark.parametrize("frame", TURNED.values(), ids=TURNED)
def test_forces_near_a_magnet_turn_with_the_scene(frame, uniform):
    """Check scenes with few finely sampled faces, whose choice depended on the bounding box along the axes."""
    energy, forces = forces_near_magnet(np.eye(3), uniform)
    again, turned = forces_near_magnet(frame, uniform)
    assert again == pytest.approx(energy, rel=1e-11)
    assert turned == pytest.approx(forces, abs=1e-11 * np.abs(forces).max())


def turned_scenes(frame: np.ndarray) -> list[ms.Scene]:
    """Return scenes of bodies of each kind, turned."""
    flat = ms.meshes.rectangle(0.05, 0.02, cells=(5, 2))
    curved = ms.meshes.rectangle(0.05, 0.02, cells=(5, 2), order=2)
    block = ms.meshes.box((0.05, 0.02, 0.01), cells=(3, 2, 1))
    shell = {"thickness": 1e-3, "young_modulus": 1e6, "mass_density": 1e3}
    bodies = [
        ms.Shell(ms.TriangleMesh(flat.rest_positions @ frame.T, flat.faces), **shell),
        ms.Shell(ms.QuadraticTriangleMesh(curved.rest_positions @ frame.T, curved.elements), **shell),
        ms.Solid(
            ms.TetMesh(block.rest_positions @ frame.T, block.tetrahedra),
            material=ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.3),
            mass_density=1e3,
        ),
    ]
    return [ms.Scene(body, allow_rigid_motions=True) for body in bodies]


def test_the_extent_of_bodies_turns_with_them():
    for name, frame in TURNED.items():
        if np.linalg.det(frame) < 0:
            continue
        for scene, other in zip(turned_scenes(np.eye(3)), turned_scenes(frame), strict=True):
            assert extent_of(other) == pytest.approx(extent_of(scene), rel=1e-12), (name, scene)


def test_the_extent_of_rigid_bodies_turns_with_them():
    def scene(frame):
        ends = [
            ms.RigidBody(mass=0.1, inertia=frame @ np.diag([1e-5, 2e-5, 2.5e-5]) @ frame.T, center=frame @ at)
            for at in ((0.0, 0.0, 0.0), (0.1, 0.05, 0.02))
        ]
        return ms.Scene(ends, allow_rigid_motions=True)

    frame = TURNED["about an oblique axis"]
    assert extent_of(scene(frame)) == pytest.approx(extent_of(scene(np.eye(3))), rel=1e-12)
