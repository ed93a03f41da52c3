"""Rigid bodies with a magnetic moment in the own field of a scene: forces, derivatives, motions, bad input."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.scene.solve_inputs import Inputs
from tests.support.magnet_forces import VACUUM_PERMEABILITY

SIDE = 0.02  # [m]


def flap(center, moment, magnetization=(3e4, 1e4, 2e4)):
    """Return a sheet that is clamped on its left, its clamp, and a magnet glued to its right end."""
    mesh = ms.meshes.rectangle(SIDE, 0.01, cells=(4, 2)).transformed(translation=center)
    right = mesh.rest_positions[:, 0].max()
    sheet = ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e7, mass_density=1e3, remanent_magnetization=magnetization
    )
    held = ms.Clamp(mesh.edges_at(x=mesh.rest_positions[:, 0].min()), body=sheet)
    magnet = ms.RigidBody(
        mesh.vertices_where(lambda x: x[:, 0] > right - 6e-3),
        body=sheet,
        mass=1e-4,
        inertia=1e-9,
        center=(right + 2e-3, center[1] + 5e-3, center[2]),
        magnetic_moment=moment,
    )
    return sheet, held, magnet


def two_flaps(**scene):
    parts = [flap((0, 0, 0), (5e-3, -3e-3, 8e-3)), flap((1e-3, 2e-3, 0.012), (2e-3, 4e-3, -6e-3))]
    sheets, held, magnets = zip(*parts, strict=True)
    return (
        ms.Scene([*sheets, *magnets], supports=list(held), own_field=ms.OwnField(), **scene),
        sheets,
        magnets,
    )


def moved_state(scene):
    """Return inputs, a state in which all nodes are displaced, and the number of its entries in whole triples.

    Entries behind the nodes are scalars that the own field does not depend on.
    """
    inputs = Inputs(scene, None, None)
    with inputs.in_core():
        state = scene._model.rest_state()
    count = len(state) // 3 * 3
    state[:count] += 2e-4 * np.random.default_rng(0).normal(size=count)
    return inputs, state, count


def test_force_and_torque_of_sheets_and_moments_vanish():
    scene, *_ = two_flaps()
    inputs, state, count = moved_state(scene)
    with inputs.in_core():
        gradient = scene._model.term_gradient("own field", state, inputs.load_parameters)[:count].reshape(
            -1, 3
        )
    total = np.linalg.norm(gradient, axis=1).sum()
    assert total > 0
    assert np.linalg.norm(gradient.sum(axis=0)) < 1e-14 * total
    torque = np.cross(state[:count].reshape(-1, 3), gradient).sum(axis=0)
    assert np.linalg.norm(torque) < 1e-14 * total * SIDE


def test_gradient_and_hessian_product_with_moments_agree_with_differences():
    scene, *_ = two_flaps()
    model = scene._model
    inputs, state, count = moved_state(scene)
    direction = np.zeros_like(state)
    direction[:count] = np.random.default_rng(1).normal(size=count)
    step = 1e-7

    def differentiated(function):
        def at(k):
            return function(state + k * step * direction)

        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)

    with inputs.in_core():
        gradient = model.term_gradient("own field", state, inputs.load_parameters)
        product = model.hessian_product(state, inputs.load_parameters, direction) - model.hessian_product(
            state, 0 * inputs.load_parameters, direction
        )
        slope = differentiated(lambda q: model.energies(q, inputs.load_parameters)["own field"])
        change = differentiated(lambda q: model.term_gradient("own field", q, inputs.load_parameters))
    assert abs(slope - gradient @ direction) < 1e-7 * abs(slope)
    assert np.abs(change - product).max() < 1e-7 * np.abs(product).max()


def test_force_of_a_sheet_on_a_moment_is_that_of_a_magnet_of_its_shape():
    magnetization = (2e4, 1e4, 5e4)
    sheet, held, _ = flap((0, 0, 0), (0, 0, 0), magnetization)
    moment = np.array([1e-3, -2e-3, 4e-3])
    far = (0.008, 0.004, 0.02)
    mesh = ms.meshes.rectangle(SIDE, 0.01, cells=(2, 1)).transformed(translation=(0, 0, 0.02))
    other = ms.Shell(mesh, thickness=1e-3, young_modulus=1e9)
    glued = ms.RigidBody(
        mesh.vertices_where(lambda x: x[:, 0] > 0.4 * SIDE), body=other, center=far, magnetic_moment=moment
    )
    pinned = ms.Clamp(mesh.edges_at(x=0.0), body=other)
    scene = ms.Scene([sheet, other, glued], supports=[held, pinned], own_field=ms.OwnField([sheet, glued]))
    rows = np.zeros((sheet.mesh.n_faces + mesh.n_faces, 3))
    rows[: sheet.mesh.n_faces] = magnetization
    rest = ms.equilibrium(scene, remanent_magnetization=rows, progress=False)
    cuboid = ms.CuboidMagnet((SIDE, 0.01, 1e-3), magnetization, center=(SIDE / 2, 0.005, 0))
    exact = moment @ cuboid.gradient(far)
    np.testing.assert_allclose(rest.magnetic_force(glued), exact, rtol=0, atol=1e-2 * np.abs(exact).max())
    np.testing.assert_allclose(
        rest.magnetic_torque(glued),
        np.cross(moment, cuboid.flux_density(far)),
        rtol=0,
        atol=1e-2 * np.linalg.norm(moment) * np.abs(cuboid.flux_density(far)).max(),
    )
    np.testing.assert_allclose(
        rest.magnetic_force(sheet), -rest.magnetic_force(glued), rtol=0, atol=1e-12 * np.abs(exact).max()
    )


def free_magnets(distance, moments=((0, 0, 0.05), (0, 0, 0.05))):
    return [
        ms.RigidBody(
            mass=1e-3, inertia=2e-8, center=(0.1 * k * distance, 0, k * distance), magnetic_moment=moment
        )
        for k, moment in enumerate(moments)
    ]


def test_free_magnets_attract_like_dipoles_and_keep_their_momentum():
    distance, time_step = 0.03, 1e-4
    magnets = free_magnets(distance)
    scene = ms.Scene(magnets, own_field=ms.OwnField(), allow_rigid_motions=True)
    motion = ms.simulate(scene, steps=4, time_step=time_step, progress=False)
    moved = [motion[each].center[-1] - motion[each].center[0] for each in magnets]
    r = distance * np.array([0.1, 0, 1.0])
    size = np.linalg.norm(r)
    m = np.array([0, 0, 0.05])
    strength = 3 * VACUUM_PERMEABILITY / (4 * np.pi * size**5)
    force = strength * (2 * m * (m @ r) + r * (m @ m) - 5 * r * (m @ r) ** 2 / size**2)
    expected = 0.5 * force / 1e-3 * (4 * time_step) ** 2
    np.testing.assert_allclose(moved[1], expected, rtol=0, atol=1e-2 * np.abs(expected).max())
    np.testing.assert_allclose(moved[0], -moved[1], rtol=0, atol=1e-5 * np.abs(expected).max())
    spins = sum(2e-8 * motion[each].angular_velocity[-1] for each in magnets)
    orbits = sum(np.cross(motion[each].center[-1], 1e-3 * motion[each].velocity[-1]) for each in magnets)
    assert np.abs(spins).max() > 1e-12
    assert np.abs(spins + orbits).max() < 1e-6 * np.abs(spins).max()


def test_flux_density_of_a_moment_is_that_of_a_dipole():
    sheet, held, magnet = flap((0, 0, 0), (5e-3, -3e-3, 8e-3))
    scene = ms.Scene([sheet, magnet], supports=held, own_field=ms.OwnField(magnet))
    state = ms.field_of(
        ms.equilibrium(scene, remanent_magnetization=np.zeros((sheet.mesh.n_faces, 3)), progress=False)
    )
    points = np.array([[0.03, 0.01, 0.02], [0.0, 0.0, 0.03]])
    exact = ms.Dipoles([magnet.center], [magnet.magnetic_moment]).flux_density(points)
    np.testing.assert_allclose(state.flux_density(points), exact, rtol=1e-9)


def test_own_field_refuses_a_rigid_body_without_a_moment():
    with pytest.raises(ValueError, match="without a magnetic_moment"):
        plain = ms.RigidBody(mass=1.0, inertia=1.0)
        ms.Scene(plain, own_field=ms.OwnField(plain), allow_rigid_motions=True)
    magnets = free_magnets(0.03)
    with pytest.raises(ValueError, match="has a magnetic_moment, but the scene has no field"):
        ms.Scene(magnets, own_field=ms.OwnField(magnets[0]), allow_rigid_motions=True)
