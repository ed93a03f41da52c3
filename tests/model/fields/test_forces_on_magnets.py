"""Magnetic forces and torques on magnets, other sources, and rigid bodies with a moment."""

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY, cuboid_force

import magshell as ms

SIZE, THICKNESS, POLARIZATION = 0.01, 2e-4, 0.0754
MAGNETIZATION = POLARIZATION / VACUUM_PERMEABILITY


def held_plate(field, gap_center=(0.0, 0.0, 0.0)):
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(16, 16)).transformed(translation=gap_center)
    plate = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e9)
    return plate, ms.Scene(plate, supports=[ms.Pin(np.arange(mesh.n_vertices))], field=field)


@pytest.mark.parametrize("gap", [2e-4, 1e-3])
def test_force_of_a_plate_on_a_magnet_equals_the_closed_form(gap):
    distance = gap + THICKNESS
    center = np.array([0.5 * SIZE, 0.5 * SIZE, -distance])
    magnet = ms.CuboidMagnet(
        (SIZE, SIZE, THICKNESS), center=center, remanent_magnetization=(0, 0, MAGNETIZATION)
    )
    plate, scene = held_plate(magnet)
    rest = ms.equilibrium(scene, remanent_magnetization=(0, 0, MAGNETIZATION))
    shape = [SIZE, SIZE, THICKNESS]
    on_plate = cuboid_force(shape, shape, [0.0, 0.0, distance], 2, POLARIZATION)
    force = rest.magnetic_force(magnet)
    np.testing.assert_allclose(force, -on_plate, rtol=0, atol=2e-3 * np.abs(on_plate).max())
    np.testing.assert_allclose(force, -rest.magnetic_force(plate), rtol=0, atol=1e-12 * np.abs(force).max())
    assert np.abs(rest.magnetic_torque(magnet)).max() < 1e-6 * np.abs(force).max() * SIZE  # centered


def everything():
    """Build a scene with bodies of every kind and sources of several kinds, without a uniform field."""
    meshes = [
        ms.meshes.rectangle(0.02, 0.01, cells=(4, 2)),
        ms.meshes.rectangle(0.02, 0.01, cells=(2, 1), order=2).transformed(translation=(0, 0, 0.03)),
        ms.meshes.rectangle(0.02, 0.01, cells=(4, 2)).transformed(translation=(0, 0.03, 0)),
    ]
    shells = [
        ms.Shell(meshes[0], thickness=1e-3, young_modulus=1e6, remanent_magnetization=(2e4, 1e4, 3e4)),
        ms.Shell(meshes[1], thickness=1e-3, young_modulus=1e6, remanent_magnetization=(-1e4, 2e4, 3e4)),
        ms.Shell(
            meshes[2], thickness=1e-3, young_modulus=1e6, susceptibility=2.0, magnetization_law="rotates"
        ),
    ]
    box = ms.meshes.box((0.01, 0.01, 0.01), cells=(1, 1, 1)).transformed(translation=(0, 0, -0.04))
    rubber = ms.StableNeoHookean(young_modulus=1e6, poisson_ratio=0.3)
    skin = ms.Skin(thickness=1e-3, faces=box.faces_at(z=-0.04), remanent_magnetization=(1e4, 0, 2e4))
    solid = ms.Solid(box, material=rubber, element="linear", remanent_magnetization=(0, 1e4, 1e4), skin=skin)
    payload = ms.RigidBody(
        meshes[0].vertices_where(lambda x: x[:, 0] > 0.014),
        body=shells[0],
        magnetic_moment=(1e-3, 2e-3, -1e-3),
        mass=1e-4,
    )
    sources = [
        ms.CuboidMagnet(
            (0.006, 0.005, 0.004),
            center=(0.01, 0.0, 0.012),
            rotation=(0.2, 0.1, 0),
            remanent_magnetization=(1e4, 0, 3e5),
        ),
        ms.Dipoles([[0.03, 0.02, -0.01]], [[0.02, 0.05, 0.1]]),
        ms.PlacedField(ms.Dipoles([[0.0, 0.0, 0.0]], [[0.05, 0.0, 0.1]]), center=(0.0, 0.02, -0.02)),
    ]
    supports = [
        *(ms.Clamp(each.mesh.edges_at(x=0.0), body=each) for each in shells),
        ms.Pin(box.vertices_at(x=0.0), body=solid),
    ]
    scene = ms.Scene([*shells, solid, payload], supports=supports, field=sources)
    return scene, [*shells, solid], payload, sources


def test_forces_and_torques_of_bodies_and_sources_cancel():
    """Check shells, a six-node shell, a susceptible one, a solid with a skin, and a moment, between three sources."""
    scene, bodies, payload, sources = everything()
    state = ms.field_of(ms.equilibrium(scene, field_factor=0.7))
    every = [*bodies, payload, *sources]
    forces = np.array([state.magnetic_force(each) for each in every])
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-11 * np.abs(forces).max())
    center = (0.004, -0.002, 0.001)
    torques = np.array([state.magnetic_torque(each, center) for each in every])
    np.testing.assert_allclose(torques.sum(axis=0), 0.0, atol=1e-11 * np.abs(torques).max())
    assert (np.abs(forces).max(axis=1) > 0).all()


def test_force_on_a_moment_in_the_field_of_a_dipole_equals_the_closed_form():
    mesh = ms.meshes.rectangle(0.01, 0.01, cells=(2, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e9)
    moment, other, distance = 2e-3, 0.5, 0.05
    magnet = ms.RigidBody(
        mesh.vertices_where(lambda x: x[:, 0] > 0.004),
        mass=1e-3,
        magnetic_moment=(0, 0, moment),
        center=(0.01, 0.005, 0),
    )
    dipole = ms.Dipoles([[0.01, 0.005, -distance]], [[0, 0, other]])
    supports = [ms.Clamp(mesh.edges_at(x=0.0))]
    scene = ms.Scene([sheet, magnet], supports=supports, field=[dipole, ms.UniformField()])
    rest = ms.equilibrium(scene, remanent_magnetization=(0, 0, 0), applied_flux_density=(0.01, 0, 0))
    down = -3 * VACUUM_PERMEABILITY * moment * other / (2 * np.pi * distance**4)
    assert rest.magnetic_force(magnet)[2] == pytest.approx(down, rel=1e-3)
    assert rest.magnetic_torque(magnet)[1] == pytest.approx(moment * 0.01, rel=1e-2)
    np.testing.assert_allclose(rest.magnetic_force(dipole), -rest.magnetic_force(magnet), rtol=1e-9)


def test_objects_without_a_magnetic_force_are_refused():
    uniform = ms.UniformField()
    source = ms.PlacedField(ms.Dipoles([[0.0, 0.0, 0.0]], [[0.05, 0.0, 0.1]]), center=(0.0, 0.02, -0.05))
    dipole = ms.Dipoles([[0.0, 0.0, -0.1]], [[0.0, 0.0, 0.1]])
    _, scene = held_plate([uniform, source, dipole])
    rest = ms.equilibrium(scene, remanent_magnetization=(0, 0, 1e4), applied_flux_density=(0, 0, 0))
    stranger = ms.Dipoles([[0.0, 0.0, -0.1]], [[0.0, 0.0, 0.1]])
    for bad in (uniform, stranger, None, "magnet", ms.RigidBody(mass=1.0, inertia=1.0)):
        with pytest.raises(ValueError, match="body must be a Shell or Solid of the scene"):
            rest.magnetic_force(bad)
    with pytest.raises(ValueError, match="center is needed"):
        rest.magnetic_torque(dipole)
    assert rest.magnetic_torque(dipole, center=(0, 0, 0)).shape == (3,)
    assert rest.magnetic_torque(source).shape == (3,)


def lone_scene(*sources):
    """Build a scene with sources and a sheet that has no magnetization."""
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(1, 1)).transformed(translation=(0.3, 0, 0))
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e9)
    scene = ms.Scene(sheet, supports=[ms.Pin(np.arange(mesh.n_vertices))], field=list(sources))
    uniform = any(isinstance(each, ms.UniformField) for each in sources)
    options = {"applied_flux_density": (0.0, 0.02, 0.0)} if uniform else {}
    return ms.field_of(ms.equilibrium(scene, remanent_magnetization=(0, 0, 0), **options))


@pytest.mark.parametrize(
    ("sizes", "offset", "polarization", "force"),
    [
        (((0.01,) * 3, (0.01,) * 3), (0, 0, 0.02), 1.0, (0, 0, -2.2510132358)),
        (
            ((0.02, 0.012, 0.006), (0.012, 0.02, 0.006)),
            (0, -0.004, 0.008),
            0.38,
            (0, 0.637580444, -1.85337278),
        ),
        (((0.01,) * 3, (0.01,) * 3), (0, 0, 0.0101), 1.0, None),
    ],
)
def test_forces_between_cuboid_magnets_equal_the_closed_form(sizes, offset, polarization, force):
    magnetization = (0, 0, polarization / VACUUM_PERMEABILITY)
    lower = ms.CuboidMagnet(sizes[0], magnetization)
    upper = ms.CuboidMagnet(sizes[1], magnetization, center=offset)
    exact = cuboid_force(*sizes, offset, 2, polarization)
    if force is not None:
        np.testing.assert_allclose(exact, force, rtol=0, atol=1e-9 * np.linalg.norm(force))
    state = lone_scene(lower, upper)
    found, back = state.magnetic_force(upper), state.magnetic_force(lower)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-11 * np.linalg.norm(exact))
    np.testing.assert_allclose(found, -back, rtol=0, atol=1e-14 * np.linalg.norm(exact))


def test_forces_and_torques_of_magnets_of_every_kind_cancel():
    sources = [
        ms.CuboidMagnet(
            (0.01, 0.02, 0.01), (3e5, 0, 8e5), center=(0.004, 0.003, 0.02), rotation=(0.1, 0.2, 0.3)
        ),
        ms.CylinderMagnet(0.005, 0.01, (1e5, 2e5, 8e5)),
        ms.Dipoles([[0.03, 0.02, -0.01]], [[0.02, 0.05, 0.1]]),
        ms.PlacedField(ms.Dipoles([[0.0, 0.0, 0.0]], [[0.05, 0.0, 0.1]]), center=(0.0, 0.02, -0.02)),
    ]
    state = lone_scene(*sources)
    forces = np.array([state.magnetic_force(each) for each in sources])
    torques = np.array([state.magnetic_torque(each, (0.001, 0.002, 0.003)) for each in sources])
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-11 * np.abs(forces).max())
    np.testing.assert_allclose(torques.sum(axis=0), 0.0, atol=1e-11 * np.abs(torques).max())
    assert (np.abs(forces).max(axis=1) > 0).all()


def test_distant_magnets_attract_like_dipoles():
    magnets = [
        ms.CuboidMagnet((0.01,) * 3, (0, 0, 1e6)),
        ms.CylinderMagnet(0.004, 0.01, (0, 0, 1e6), center=(0, 0, 0.4)),
    ]
    moments = 1e6 * 0.01**3, 1e6 * np.pi * 0.004**2 * 0.01
    exact = 3 * VACUUM_PERMEABILITY * moments[0] * moments[1] / (2 * np.pi * 0.4**4)
    assert lone_scene(*magnets).magnetic_force(magnets[0])[2] == pytest.approx(exact, rel=1e-3)


def test_uniform_field_turns_a_magnet_by_its_moment():
    for magnet, volume in (
        (ms.CuboidMagnet((0.01, 0.02, 0.03), (0, 0, 1e6), rotation=(0.3, 0, 0)), 6e-6),
        (ms.CylinderMagnet(0.01, 0.02, (0, 0, 1e6), rotation=(0.3, 0, 0)), 2e-6 * np.pi),
    ):
        state = lone_scene(magnet, ms.UniformField())
        moment = 1e6 * volume * np.array([0, -np.sin(0.3), np.cos(0.3)])
        np.testing.assert_allclose(
            state.magnetic_torque(magnet), np.cross(moment, (0, 0.02, 0)), rtol=1e-12, atol=1e-15
        )
        np.testing.assert_allclose(state.magnetic_force(magnet), 0.0, atol=1e-15)


def test_forces_between_overlapping_or_unknown_sources_are_refused():
    magnets = [ms.CuboidMagnet((0.01,) * 3, (0, 0, 1e6), center=(0, 0, z)) for z in (0.0, 0.006)]
    with pytest.raises(ValueError, match="overlap"):
        lone_scene(*magnets).magnetic_force(magnets[0])
    tables = [
        ms.CustomField(lambda x, scale=scale: np.zeros_like(x) + scale, length_scale=0.1)
        for scale in (0.0, 1.0)
    ]
    with pytest.raises(ValueError, match="one of them must be a magnet or Dipoles"):
        lone_scene(*tables).magnetic_force(tables[0])
