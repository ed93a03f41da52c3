"""The own field of magnetized shells: forces, sums, charges, bending, derivatives, bad input."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.model.scene.solve_inputs import Inputs
from tests.support.magnet_forces import VACUUM_PERMEABILITY, cuboid_force

torch = pytest.importorskip("torch")

SIZE, THICKNESS = 0.01, 2e-4  # [m], of the plates
POLARIZATION = 0.0754  # [T]
MANY = ms.OwnField(max_points=10**5)


def pair_of_plates(cells, offset, **law):
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(cells, cells))
    meshes = [mesh, mesh.transformed(translation=tuple(offset))]
    plates = [ms.Shell(each, thickness=THICKNESS, young_modulus=1e6, **law) for each in meshes]
    return ms.Scene(plates, own_field=MANY, allow_rigid_motions=True)


def force_on_second(scene, magnetization):
    inputs, model = Inputs(scene, magnetization, None), scene._model
    with inputs.in_core():
        gradient = model.positions(
            model.term_gradient("own field", model.rest_state(), inputs.load_parameters)
        )
    return -gradient[scene.bodies[0].mesh.n_vertices :].sum(axis=0)


# Gaps [m] and forces [N] of coaxial plates, face to face, head to tail and side by side: [Akoun, Yonnet 1984].
TABLE = [
    *(
        (2, (0, 0, 1), gap, force)
        for gap, force in ((2e-4, 2.899245e-3), (1e-3, 8.50607e-4), (5e-3, 1.166597e-4))
    ),
    *(
        (0, (0, 0, 1), gap, force)
        for gap, force in ((2e-4, 1.449622e-3), (1e-3, 4.25303e-4), (1e-2, 1.39907e-5))
    ),
    *((0, (1, 0, 0), gap, force) for gap, force in ((2e-4, 1.217525e-3), (5e-3, 2.61808e-5))),
    *((0, (0, 1, 0), gap, force) for gap, force in ((1e-3, 4.13666e-5), (1e-2, 2.88663e-6))),
]


def test_closed_form_force_equals_the_published_table():
    for axis, direction, gap, force in TABLE:
        offset = np.where(np.array(direction) == 1, [SIZE, SIZE, THICKNESS], 0.0) + gap * np.array(direction)
        exact = cuboid_force([SIZE, SIZE, THICKNESS], [SIZE, SIZE, THICKNESS], offset, axis, POLARIZATION)
        assert abs(np.abs(exact).max() / force - 1) < 1e-5


@pytest.mark.parametrize("shifted", [False, True])
@pytest.mark.parametrize(("axis", "direction", "gap", "force"), TABLE)
def test_force_between_plates_equals_the_closed_form(axis, direction, gap, force, shifted):
    cells = 16 if axis == 2 else 32
    direction = np.array(direction)
    offset = np.where(direction == 1, [SIZE, SIZE, THICKNESS], 0.0) + gap * direction
    if shifted:
        offset = offset + np.where(direction == 1, 0.0, [SIZE / cells / 2, SIZE / cells / 2, 0.0])
    exact = cuboid_force([SIZE, SIZE, THICKNESS], [SIZE, SIZE, THICKNESS], offset, axis, POLARIZATION)
    magnetization = np.eye(3)[axis] * POLARIZATION / VACUUM_PERMEABILITY
    found = force_on_second(pair_of_plates(cells, offset), magnetization)
    bound = {16: 1.5e-2, 32: 5e-3}[cells] if gap < 5e-4 else 3e-4
    along = int(np.argmax(direction))
    assert abs(found[along] / exact[along] - 1) < bound


def random_pair(cells=3, components=(1, 1, 1), seed=0, **law):
    """Return two crumpled plates above each other, their inputs, and the state."""
    rng = np.random.default_rng(seed)
    scene = pair_of_plates(cells, (1e-3, 5e-4, 1.1e-3), **law)
    magnetization = 6e4 * rng.normal(size=(scene.mesh.n_faces, 3)) * np.array(components)
    positions = scene.mesh.rest_positions + 2e-4 * rng.normal(size=scene.mesh.rest_positions.shape)
    inputs = Inputs(scene, magnetization, None)
    with inputs.in_core():
        state = scene._model.state(positions, np.zeros(scene._bodies.n_rotations))
    return scene, inputs, state


KINDS = {"tangential": (1, 1, 0), "normal": (0, 0, 1), "oblique": (1, 1, 1)}


LAWS = ["stretches", "rotates"]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("components", KINDS.values(), ids=KINDS)
def test_force_and_torque_of_a_closed_system_vanish(components, law):
    scene, inputs, state = random_pair(components=components, magnetization_law=law)
    with inputs.in_core():
        gradient = scene._model.positions(
            scene._model.term_gradient("own field", state, inputs.load_parameters)
        )
        positions = scene._model.positions(state)
    total = np.linalg.norm(gradient, axis=1).sum()
    assert np.linalg.norm(gradient.sum(axis=0)) < 1e-14 * total
    assert np.linalg.norm(np.cross(positions, gradient).sum(axis=0)) < 1e-14 * total * SIZE


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("components", KINDS.values(), ids=KINDS)
def test_gradient_and_hessian_product_agree_with_differences(components, law):
    scene, inputs, state = random_pair(components=components, magnetization_law=law)
    model, load_parameters = scene._model, inputs.load_parameters
    rng = np.random.default_rng(1)
    direction = np.zeros_like(state)
    direction[: 3 * scene.mesh.n_vertices] = rng.normal(size=3 * scene.mesh.n_vertices)
    step = 1e-7

    def differentiated(function):
        def at(k):
            return function(state + k * step * direction)

        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)

    with inputs.in_core():
        gradient = model.term_gradient("own field", state, load_parameters)
        product = model.hessian_product(state, load_parameters, direction) - model.hessian_product(
            state, 0 * load_parameters, direction
        )
        slope = differentiated(lambda q: model.energies(q, load_parameters)["own field"])
        change = differentiated(lambda q: model.term_gradient("own field", q, load_parameters))
    assert abs(slope - gradient @ direction) < 1e-7 * abs(slope)
    assert np.abs(change - product).max() < 1e-7 * np.abs(product).max()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("magnetization", [(4e4, 0, 0), (0, 0, 4e4), (3e4, 0, 2e4)])
def test_derivatives_by_the_magnetization_of_every_face_agree_with_differences(magnetization, law):
    # With uniform magnetization most edges have no source, but their derivatives do not vanish.
    scene, _, state = random_pair(magnetization_law=law)
    rng = np.random.default_rng(2)
    base = np.tile(np.array(magnetization), (scene.mesh.n_faces, 1))
    change, adjoint = 1e4 * rng.normal(size=base.shape), rng.normal(size=len(state))

    def along(m):
        inputs = Inputs(scene, m, None)
        with inputs.in_core():
            return adjoint @ scene._model.term_gradient("own field", state, inputs.load_parameters)

    inputs = Inputs(scene, base, None)
    with inputs.in_core():
        found = _core.vjp(scene._model, state, inputs.load_parameters, adjoint)[0]
    by_body = [scene._value_layout.of(found, f"body {k}", "remanent_magnetization") for k in range(2)]
    step = 1e-3
    differences = (along(base + step * change) - along(base - step * change)) / (2 * step)
    assert abs(differences - np.sum(np.concatenate(by_body) * change)) < 1e-9 * abs(differences)


def test_uniform_tangential_magnetization_has_sources_on_the_border_only():
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(8, 8))
    shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6)
    border = ms.OwnField(max_points=4 * 16)  # two of the four sides have charges
    scene = ms.Scene(shell, own_field=border, allow_rigid_motions=True)
    with Inputs(scene, (6e4, 0, 0), None).in_core():
        pass
    with pytest.raises(ValueError, match=r"128 source points, more than max_points = 64"):
        ms.equilibrium(scene, remanent_magnetization=(6e4, 3e4, 0))


def bent_strip(length, width, cells, curvature):
    """Return a strip and its positions on an arc of equal chords."""
    mesh = ms.meshes.rectangle(length, width, cells=cells)
    chord = length / cells[0]
    x = mesh.rest_positions
    column = np.round((x[:, 0] - x[:, 0].min()) / chord).astype(int)
    angles = chord * curvature * (np.arange(cells[0]) - (cells[0] - 1) / 2)
    steps = chord * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    arc = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    positions = arc[column]
    positions[:, 1] = x[:, 1]
    return mesh, positions


def magnetic_bending_stiffness(length, width, cells, magnetization):
    """Return B of the energy E(kappa) - E(0) = 1/2 B kappa^2 L [N m2], at kappa L = 0.2."""
    energies = []
    for angle in (0.0, 0.2):
        mesh, positions = bent_strip(length, width, cells, angle / length)
        shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6)
        scene = ms.Scene(shell, own_field=MANY, allow_rigid_motions=True)
        inputs = Inputs(scene, magnetization, None)
        with inputs.in_core():
            state = scene._model.state(positions, np.zeros(scene._bodies.n_rotations))
            energies.append(scene._model.energies(state, inputs.load_parameters)["own field"])
    return 2 * (energies[1] - energies[0]) / (0.2**2 / length)


def test_bent_tangential_strip_is_softened_by_its_end_charges():
    length, width, magnetization = 20e-3, 1e-3, 6e4
    found = magnetic_bending_stiffness(length, width, (40, 2), (magnetization, 0, 0))
    unit = VACUUM_PERMEABILITY * (magnetization * width * THICKNESS) ** 2 / (4 * np.pi)
    assert abs(found / unit + 0.0834) < 0.01 * 0.0834


@pytest.mark.parametrize(
    ("width", "cells", "stiffness"), [(1e-3, (40, 2), 2.66e-11), (4e-3, (20, 4), 2.16e-10)]
)
def test_bent_normal_strip_is_stiffened_by_its_border_currents(width, cells, stiffness):
    found = magnetic_bending_stiffness(20e-3, width, cells, (0, 0, 6e4))
    assert abs(found / stiffness - 1) < 0.03


def test_stretched_plates_with_a_rotating_magnetization_have_the_charges_of_their_moment():
    """Check plates magnetized along x and stretched by 1.3 along x: those that rotate keep their moment, M V at rest."""
    stretch, gap = 1.3, 1e-3
    offset = np.array([0.0, 0.0, THICKNESS + gap])
    now = [stretch * SIZE, SIZE, THICKNESS]
    for law, polarization in (("stretches", POLARIZATION), ("rotates", POLARIZATION / stretch)):
        scene = pair_of_plates(32, offset, magnetization_law=law)
        inputs = Inputs(scene, (POLARIZATION / VACUUM_PERMEABILITY, 0, 0), None)
        positions = scene.mesh.rest_positions * [stretch, 1.0, 1.0]
        with inputs.in_core():
            state = scene._model.state(positions, np.zeros(scene._bodies.n_rotations))
            forces = -scene._model.positions(
                scene._model.term_gradient("own field", state, inputs.load_parameters)
            )
        found = forces[scene.bodies[0].mesh.n_vertices :].sum(axis=0)
        exact = cuboid_force(now, now, offset, 0, polarization)
        assert abs(found[2] / exact[2] - 1) < 3e-4


def test_bent_sheet_has_the_same_own_field_under_both_laws():
    """Check a strip on an arc of equal chords, which does not stretch."""
    mesh, positions = bent_strip(20e-3, 4e-3, (20, 4), 40.0)
    found = []
    for law in LAWS:
        shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6, magnetization_law=law)
        scene = ms.Scene(shell, own_field=MANY, allow_rigid_motions=True)
        inputs = Inputs(scene, (5e4, 0, 3e4), None)
        with inputs.in_core():
            state = scene._model.state(positions, np.zeros(scene._bodies.n_rotations))
            found.append(scene._model.energies(state, inputs.load_parameters)["own field"])
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_own_field_has_the_same_bits_for_every_number_of_threads():
    scene, inputs, state = random_pair(cells=5)
    before, found = _core.num_threads(), []
    try:
        for threads in (1, 2, 3):
            _core.set_num_threads(threads)
            with inputs.in_core():
                found.append(scene._model.term_gradient("own field", state, inputs.load_parameters))
    finally:
        _core.set_num_threads(before)
    assert all(np.array_equal(found[0], each) for each in found[1:])


def flaps(gap, young_modulus, **scene):
    mesh = ms.meshes.rectangle(0.02, 0.004, cells=(6, 2))
    meshes = [mesh, mesh.transformed(translation=(0, 0, gap + THICKNESS))]
    both = [
        ms.Shell(each, thickness=THICKNESS, young_modulus=young_modulus, mass_density=2e3) for each in meshes
    ]
    left = mesh.edges_at(x=mesh.rest_positions[:, 0].min())
    return ms.Scene(both, supports=[ms.Clamp(left, body=each) for each in both], **scene)


@pytest.mark.parametrize(("magnetization", "young_modulus"), [((6e4, 0, 0), 1e6), ((0, 0, 6e4), 1e8)])
def test_flaps_at_rest_balance_elastic_and_magnetic_forces(magnetization, young_modulus):
    scene = flaps(8e-3, young_modulus, own_field=ms.OwnField())
    rest = ms.equilibrium(scene, remanent_magnetization=magnetization, progress=False)
    assert rest.stable
    heights = rest[scene.bodies[0]].displacements[:, 2].sum(), rest[scene.bodies[1]].displacements[:, 2].sum()
    attracts = magnetization[2] > 0
    assert (heights[0] > 0 > heights[1]) == attracts and (heights[0] < 0 < heights[1]) != attracts
    # The forces of both flaps are opposite.
    assert abs(heights[0] + heights[1]) < 1e-6 * abs(heights[0])


def test_flaps_that_snap_together_without_contact_are_not_called_stable():
    scene = flaps(1e-3, 1e6, own_field=ms.OwnField())
    with pytest.raises(ms.NotConverged):
        ms.equilibrium(
            scene, remanent_magnetization=(0, 0, 6e4), progress=False, solver=ms.Newton(max_factorizations=6)
        )


def test_motion_and_path_have_the_own_field():
    scene = flaps(4e-3, 1e6, own_field=ms.OwnField())
    path = ms.follow_path(scene, remanent_magnetization=(6e4, 0, 0), progress=False)
    rest = ms.equilibrium(scene, remanent_magnetization=(6e4, 0, 0), progress=False)
    np.testing.assert_allclose(path.positions[-1], rest.positions, rtol=0, atol=1e-9)
    motion = ms.simulate(
        scene, steps=40, time_step=5e-3, damping=1e-4, remanent_magnetization=(6e4, 0, 0), progress=False
    )
    begins = (
        motion[scene.bodies[1]].positions[5, :, 2].sum() - motion[scene.bodies[1]].positions[0, :, 2].sum()
    )
    assert begins > 0  # parallel tangential plates repel each other


@pytest.mark.parametrize("implicit_contact", [False, True])
def test_gradient_of_a_motion_on_a_plane_with_the_own_field(implicit_contact):
    mesh = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2))
    sheet = ms.Shell(mesh, thickness=5e-4, young_modulus=1e5, mass_density=2e3)
    plane = ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-5)), friction_coefficient=0.3)
    scene = ms.Scene(
        sheet, contacts=[plane], gravity=(0, 0, -9.81), allow_rigid_motions=True, own_field=ms.OwnField()
    )
    slope = 0.1 * mesh.rest_positions[:, [0]] * [0.0, 0.0, 1.0]

    def moved(magnetization):
        motion = ms.simulate(
            scene,
            start=mesh.rest_positions + slope,
            remanent_magnetization=magnetization,
            steps=10,
            time_step=2e-4,
            integrator=ms.TRBDF2(implicit_contact=implicit_contact),
            solver=ms.MixedNewton(tolerance=1e-12),
            progress=False,
        )
        return motion, (1e3 * torch.as_tensor(motion.positions[-1]) ** 2).sum()

    at = torch.tensor([5e4, 3e4, 4e4], dtype=torch.float64, requires_grad=True)
    motion, loss = moved(at)
    assert motion.contact_state(plane).normal_forces.sum() > 0
    loss.backward()
    for k in range(3):
        step = torch.zeros(3, dtype=torch.float64)
        step[k] = 50.0
        ends = [moved((at.detach() + sign * step).numpy())[1].item() for sign in (1, -1)]
        assert at.grad[k].item() == pytest.approx((ends[0] - ends[1]) / 100.0, rel=1e-4)


def test_without_own_field_nothing_acts_between_shells():
    scene = flaps(4e-3, 1e6, field=ms.UniformField())
    rest = ms.equilibrium(
        scene, remanent_magnetization=(6e4, 0, 0), applied_flux_density=(0, 0, 0), progress=False
    )
    assert np.abs(rest.displacements).max() < 1e-12 * SIZE
    assert "own field" not in rest.energies


def test_scene_refuses_own_field_of_unsupported_bodies():
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(2, 2))
    shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6)
    other = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e6)
    with pytest.raises(ValueError, match="not among the bodies"):
        ms.Scene(shell, own_field=ms.OwnField(other), allow_rigid_motions=True)
    with pytest.raises(ValueError, match="own_field must be an OwnField, got bool"):
        ms.Scene(shell, own_field=True, allow_rigid_motions=True)
    with pytest.raises(ValueError, match="bodies is empty"):
        ms.OwnField([])
    with pytest.raises(ValueError, match="max_points"):
        ms.OwnField(max_points=0)


def test_shell_without_magnetization_is_refused():
    scene = flaps(4e-3, 1e6, own_field=ms.OwnField())
    with pytest.raises(ValueError, match=r"remanent_magnetization of body 0 .* is needed"):
        ms.equilibrium(scene, progress=False)


def test_hessians_as_matrices_name_what_works_with_the_own_field():
    scene = flaps(4e-3, 1e6, own_field=ms.OwnField())
    with pytest.raises(ValueError, match="can be computed with own_field"):
        ms.hessian(scene, scene.mesh.rest_positions, remanent_magnetization=(6e4, 0, 0))


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_a_scene_that_supports_hold_throughout_has_its_own_field():
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(2, 2))
    meshes = [mesh, mesh.transformed(translation=(0, 0, 1e-3 + THICKNESS))]
    plates = [ms.Shell(each, thickness=THICKNESS, young_modulus=1e9, bending="hinge") for each in meshes]
    held = [ms.Pin(np.arange(mesh.n_vertices), body=plate) for plate in plates]
    scene = ms.Scene(plates, supports=held, own_field=MANY)
    magnetization = POLARIZATION / VACUUM_PERMEABILITY
    found = ms.equilibrium(scene, remanent_magnetization=(magnetization, 0, 0), progress=False)
    assert found.stable and found.energies["own field"] != 0.0
    force = ms.field_of(found).magnetic_force(plates[1])
    assert force[2] > 1e-5


def test_force_torque_and_energies_of_two_plates_are_consistent():
    direction = np.array([1e-3, 0.0, 5e-3])
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(6, 6))
    meshes = [mesh, mesh.transformed(translation=tuple(direction))]
    plates = [ms.Shell(each, thickness=THICKNESS, young_modulus=1e9) for each in meshes]
    held = [
        ms.Pin(np.arange(each.n_vertices), body=plate) for each, plate in zip(meshes, plates, strict=True)
    ]
    scene = ms.Scene(plates, supports=held, own_field=ms.OwnField(), field=ms.UniformField())
    magnetization = POLARIZATION / VACUUM_PERMEABILITY
    flux_density = np.array([1e-3, 0.0, 0.0])
    state = ms.field_of(
        ms.equilibrium(
            scene,
            remanent_magnetization=(0, 0, magnetization),
            applied_flux_density=flux_density,
            progress=False,
        )
    )
    exact = cuboid_force([SIZE, SIZE, THICKNESS], [SIZE, SIZE, THICKNESS], direction, 2, POLARIZATION)
    np.testing.assert_allclose(
        state.magnetic_force(plates[1]), exact, rtol=0, atol=1e-3 * np.abs(exact).max()
    )
    center = (0.005, 0.005, 0.0)
    torques = [state.magnetic_torque(plate, center) for plate in plates]
    moment = magnetization * SIZE**2 * THICKNESS * np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(sum(torques), 2 * np.cross(moment, flux_density), rtol=0, atol=1e-12)
    energies = state.energies
    assert energies["applied"] == pytest.approx(0.0, abs=1e-12 * abs(energies["own"]))
    assert energies["mutual"] < 0  # they attract
    assert sum(energies.values()) == pytest.approx(
        sum(value for name, value in state.equilibrium.energies.items() if "field" in name or "magn" in name)
    )


@pytest.mark.parametrize("magnetization", [(5e4, 0, 0), (0, 0, 5e4), (3e4, 2e4, 1e4)])
def test_flux_density_equals_that_of_a_cuboid_magnet(magnetization):
    mesh = ms.meshes.rectangle(SIZE, SIZE, cells=(8, 8))
    plate = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e9)
    scene = ms.Scene(plate, supports=ms.Pin(np.arange(mesh.n_vertices)), own_field=ms.OwnField())
    state = ms.field_of(ms.equilibrium(scene, remanent_magnetization=magnetization, progress=False))
    magnet = ms.CuboidMagnet((SIZE, SIZE, THICKNESS), magnetization, center=(SIZE / 2, SIZE / 2, 0.0))
    points = np.array([[0.005, 0.004, 0.003], [0.013, 0.006, 0.001], [-0.002, 0.002, -0.004]])
    exact = magnet.flux_density(points)
    np.testing.assert_allclose(state.flux_density(points), exact, rtol=0, atol=1e-3 * np.abs(exact).max())
    with pytest.raises(ValueError, match="must be an Equilibrium"):
        ms.field_of(scene)
