"""The own field of magnetized solids: forces, energies, derivatives, sheets and skins beside them, bad input."""

import numpy as np
import pytest

import magshell as ms
from magshell import _core
from magshell.model.scene.solve_inputs import Inputs
from tests.support.magnet_forces import VACUUM_PERMEABILITY, cuboid_force

RUBBER = ms.StableNeoHookean(young_modulus=1e6, poisson_ratio=0.3)
SIDE = 0.01  # [m]


def block(sizes, cells, center=(0, 0, 0), magnetization=(0, 0, 1e5), element="linear", **options):
    mesh = ms.meshes.box(tuple(sizes), cells=cells)
    at = np.asarray(center) - mesh.rest_positions.mean(axis=0)
    return ms.Solid(
        mesh.transformed(translation=tuple(at)),
        material=RUBBER,
        element=element,
        remanent_magnetization=magnetization,
        **options,
    )


def free_scene(of, **own_field):
    return ms.Scene(of, own_field=ms.OwnField(**own_field), allow_rigid_motions=True)


def evaluated(scene, positions=None, magnetization=None, direction=None):
    """Return the energy, its gradient by all positions and, along a direction (n_v, 3), the product of the Hessian."""
    model, inputs = scene._model, Inputs(scene, magnetization, None)
    at = scene.mesh.rest_positions if positions is None else positions
    with inputs.in_core():
        state = model.state(at, np.zeros(scene._bodies.n_rotations))
        energy = model.energies(state, inputs.load_parameters).get("own field", 0.0)
        gradient = model.positions(model.term_gradient("own field", state, inputs.load_parameters))
        if direction is None:
            return energy, gradient
        along = model.state(direction, np.zeros(scene._bodies.n_rotations))
        product = model.hessian_product(state, inputs.load_parameters, along) - model.hessian_product(
            state, 0 * inputs.load_parameters, along
        )
        return energy, gradient, model.positions(product)


@pytest.mark.parametrize(("element", "cells"), [("linear", 6), ("quadratic", 3)])
@pytest.mark.parametrize(
    ("sizes", "offset", "polarization", "force"),
    [
        (((SIDE,) * 3, (SIDE,) * 3), (0, 0, 0.02), 1.0, (0, 0, -2.2510132358)),
        (
            ((0.02, 0.012, 0.006), (0.012, 0.02, 0.006)),
            (0, -0.004, 0.008),
            0.38,
            (0, 0.637580444, -1.85337278),
        ),
    ],
)
def test_force_between_solid_cuboids_equals_the_closed_form(
    sizes, offset, polarization, force, element, cells
):
    magnetization = (0, 0, polarization / VACUUM_PERMEABILITY)
    counts = [tuple(round(cells * side / min(each)) for side in each) for each in sizes]
    lower = block(sizes[0], counts[0], magnetization=magnetization, element=element)
    upper = block(sizes[1], counts[1], offset, magnetization, element)
    _, gradient = evaluated(free_scene([lower, upper]))
    found = -gradient[lower.mesh.n_vertices :].sum(axis=0)
    exact = cuboid_force(*sizes, offset, 2, polarization)
    np.testing.assert_allclose(exact, force, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(found, force, rtol=0, atol=1e-3 * np.linalg.norm(force))


def test_force_of_a_plate_on_a_solid_equals_the_closed_form():
    """Check each component of the magnetization of a sheet: charges and currents on its edges act on those of the solid."""
    thickness, gap = 4e-4, 2e-3
    offset = np.array([0.0, 0.0, 0.5 * SIDE + 0.5 * thickness + gap])
    mesh = ms.meshes.rectangle(SIDE, SIDE, cells=(12, 12))
    mesh = mesh.transformed(translation=tuple(offset - mesh.rest_positions.mean(axis=0)))
    plate = ms.Shell(mesh, thickness=thickness, young_modulus=1e6)
    for axis in range(3):
        magnetization = np.eye(3)[axis] / VACUUM_PERMEABILITY
        cube = block((SIDE,) * 3, (6, 6, 6), magnetization=magnetization)
        faces = np.zeros((plate.mesh.n_faces + cube.mesh.n_faces, 3))
        faces[: plate.mesh.n_faces] = magnetization
        _, gradient = evaluated(free_scene([plate, cube]), magnetization=faces)
        found = -gradient[: plate.mesh.n_vertices].sum(axis=0)
        exact = cuboid_force([SIDE] * 3, [SIDE, SIDE, thickness], offset, axis, 1.0)
        np.testing.assert_allclose(found, exact, rtol=0, atol=2e-3 * np.abs(exact).max())


LAWS = ["stretches", "rotates"]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_stretched_cubes_have_the_charges_of_their_law(element, law):
    """Check stretched cubes against cuboids of their size: with the same charges, or with the same moment."""
    stretch, polarization = np.array([0.8, 0.9, 1.3]), 0.5
    offset = np.array([0, 0, 0.024])
    magnetization = (0, 0, polarization / VACUUM_PERMEABILITY)
    cubes = [
        block((SIDE,) * 3, (4, 4, 4), center, magnetization, element, magnetization_law=law)
        for center in ((0, 0, 0), offset / stretch)
    ]
    scene = free_scene(cubes, max_points=10**5)
    _, gradient = evaluated(scene, scene.mesh.rest_positions * stretch)
    found = -gradient[cubes[0].mesh.n_vertices :].sum(axis=0)
    now = SIDE * stretch
    polarization *= SIDE**2 / (now[0] * now[1]) if law == "stretches" else SIDE**3 / now.prod()
    exact = cuboid_force(now, now, offset, 2, polarization)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-3 * np.abs(exact).max())


def test_own_energy_of_a_cube_tends_to_that_of_its_demagnetizing_factor():
    """Check mu_0 M^2 V / 6: the factor of a cube is a third by symmetry."""
    magnetization = 1e5
    exact = VACUUM_PERMEABILITY * magnetization**2 * SIDE**3 / 6
    errors = []
    for cells in (2, 4, 8):
        cube = block((SIDE,) * 3, (cells,) * 3, magnetization=(0, 0, magnetization))
        errors.append(abs(evaluated(free_scene(cube))[0] / exact - 1))
    assert errors[-1] < 1e-2 and errors[0] > errors[1] > errors[2]


def crumpled(element="linear", seed=0, accuracy=1e-6, law="stretches"):
    """Return a scene of a shell, a solid and a solid with a skin, its positions, and its magnetization."""
    rng = np.random.default_rng(seed)
    cells = (2, 2, 1) if element == "linear" else (1, 1, 1)
    mesh = ms.meshes.rectangle(SIDE, SIDE, cells=(3, 3)).transformed(translation=(-4e-3, -6e-3, 6.5e-3))
    shell = ms.Shell(mesh, thickness=5e-4, young_modulus=1e6, magnetization_law=law)
    solid = block((SIDE, SIDE, 0.6 * SIDE), cells, element=element, magnetization_law=law)
    solid = solid.replaced(remanent_magnetization=1e5 * rng.normal(size=(solid.mesh.n_tetrahedra, 3)))
    core = ms.meshes.box((SIDE, SIDE, SIDE), cells=cells).transformed(translation=(7e-3, 1e-3, -2e-3))
    coat = ms.Skin(
        thickness=5e-4,
        faces=np.arange(6),
        remanent_magnetization=1e5 * rng.normal(size=(6, 3)),
        magnetization_law=law,
    )
    skinned = ms.Solid(core, material=RUBBER, element=element, skin=coat)
    scene = free_scene([shell, solid, skinned], accuracy=accuracy)
    rest = scene.mesh.rest_positions
    magnetization = scene_magnetization(scene, shell, skinned, rng)
    return scene, rest + 3e-4 * rng.normal(size=rest.shape), magnetization


def scene_magnetization(scene, shell, skinned, rng):
    rows = np.zeros((scene._bodies.n_magnetized, 3))
    rows[: shell.mesh.n_faces] = 6e4 * rng.normal(size=(shell.mesh.n_faces, 3))
    first = scene._bodies.n_magnetized - skinned.mesh.n_faces
    rows[first + skinned.skin.faces] = skinned.skin.remanent_magnetization
    return rows


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_force_and_torque_of_shells_solids_and_skins_vanish(element, law):
    scene, positions, magnetization = crumpled(element, law=law)
    _, gradient = evaluated(scene, positions, magnetization)
    total = np.linalg.norm(gradient, axis=1).sum()
    assert np.linalg.norm(gradient.sum(axis=0)) < 1e-14 * total
    assert np.linalg.norm(np.cross(positions, gradient).sum(axis=0)) < 1e-14 * total * SIDE


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_gradient_and_hessian_product_of_solids_agree_with_differences(element, law):
    scene, positions, magnetization = crumpled(element, law=law)
    direction = np.random.default_rng(1).normal(size=positions.shape)
    step = 1e-7

    def differentiated(number):
        def at(k):
            return evaluated(scene, positions + k * step * direction, magnetization)[number]

        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)

    _, gradient, product = evaluated(scene, positions, magnetization, direction)
    slope, change = differentiated(0), differentiated(1)
    assert abs(slope - np.sum(gradient * direction)) < 1e-7 * abs(slope)
    assert np.abs(change - product).max() < 1e-7 * np.abs(product).max()


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_derivatives_by_the_magnetization_of_every_tetrahedron_agree_with_differences(element, law):
    solids = [
        block((SIDE,) * 3, (1, 1, 1), center, element=element, magnetization_law=law)
        for center in ((0, 0, 0), (0, 2e-3, 0.014))
    ]
    bent = None
    rng = np.random.default_rng(2)
    change, adjoint = 1e4 * rng.normal(size=(solids[1].mesh.n_tetrahedra, 3)), None

    def along(m):
        nonlocal adjoint
        nonlocal bent
        scene = free_scene([solids[0], solids[1].replaced(remanent_magnetization=m)])
        rest = scene.mesh.rest_positions
        bent = rest + 5e-4 * np.random.default_rng(6).normal(size=rest.shape)
        _, gradient = evaluated(scene, bent)
        adjoint = np.random.default_rng(3).normal(size=gradient.shape) if adjoint is None else adjoint
        return np.sum(adjoint * gradient)

    base = np.tile([3e4, 0, 8e4], (solids[1].mesh.n_tetrahedra, 1))
    step = 1e-3
    differences = (along(base + step * change) - along(base - step * change)) / (2 * step)
    scene = free_scene([solids[0], solids[1].replaced(remanent_magnetization=base)])
    inputs = Inputs(scene, None, None)
    with inputs.in_core():
        state = scene._model.state(bent, np.zeros(scene._bodies.n_rotations))
        full = scene._model.state(adjoint, np.zeros(scene._bodies.n_rotations))
        found = _core.vjp(scene._model, state, inputs.load_parameters, full)[0]
    rows = scene._value_layout.of(found, "body 1", "remanent_magnetization")
    assert abs(differences - np.sum(rows * change)) < 1e-8 * abs(differences)


@pytest.mark.parametrize("thickness", [2e-3, 8e-3])
def test_tree_sums_of_solids_agree_with_direct_ones(thickness):
    """Check trees to their accuracy times extent over thickness, as the fields of a plate's two faces cancel so far."""
    rng = np.random.default_rng(4)
    solid = block((0.032, 0.032, thickness), (32, 32, 1), magnetization=(3e4, 2e4, 9e4))
    direction = rng.normal(size=solid.mesh.rest_positions.shape)
    exact, by_tree = (
        evaluated(free_scene(solid, accuracy=accuracy), direction=direction) for accuracy in (None, 1e-6)
    )
    for number in range(3):
        error = np.linalg.norm(by_tree[number] - exact[number])
        assert error < 1e-6 * 0.032 / thickness * np.linalg.norm(exact[number])
    assert not np.array_equal(by_tree[1], exact[1])  # there are more than 8,000 points


@pytest.mark.parametrize("law", LAWS)
def test_rough_products_of_solids_are_close_to_exact_ones_and_symmetric(law):
    """Check tetrahedra that are magnetized at random, with charges between all of them."""
    rng = np.random.default_rng(8)
    cells = (6, 5, 4)
    magnetization = 1e5 * rng.normal(size=(6 * np.prod(cells), 3))
    solid = block(1e-3 * np.array(cells), cells, magnetization=magnetization, magnetization_law=law)
    scene = free_scene(solid)
    model, inputs = scene._model, Inputs(scene, None, None)
    x = solid.mesh.rest_positions
    with inputs.in_core():
        state = model.state(x + 5e-5 * rng.normal(size=x.shape), np.zeros(0))
        one, other = (model.state(rng.normal(size=x.shape), np.zeros(0)) for _ in range(2))
        zero = 0 * inputs.load_parameters
        exact = model.hessian_product(state, inputs.load_parameters, one) - model.hessian_product(
            state, zero, one
        )
        found, of_other = (
            model.rough_operator_product(state, inputs.load_parameters, v) for v in (one, other)
        )
    assert 0.0 < np.linalg.norm(found - exact) < 1.5e-2 * np.linalg.norm(exact)
    assert abs(other @ found - one @ of_other) < 2e-5 * np.linalg.norm(other) * np.linalg.norm(found)


def test_skin_has_the_own_field_of_a_shell_on_the_same_faces():
    mesh = ms.meshes.box((SIDE, SIDE, SIDE), cells=(3, 3, 3))
    top = mesh.faces_at(z=SIDE)
    magnetization = (5e4, 2e4, 3e4)
    coat = ms.Skin(thickness=5e-4, faces=top, remanent_magnetization=magnetization)
    coated = ms.Solid(mesh, material=RUBBER, element="linear", skin=coat)
    scene = free_scene(coated)
    rows = np.zeros((mesh.n_faces, 3))
    rows[coated.skin.faces] = magnetization
    energy, gradient = evaluated(scene, magnetization=rows)
    used, faces = np.unique(mesh.faces[top], return_inverse=True)
    sheet = ms.TriangleMesh(mesh.rest_positions[used], faces.reshape(-1, 3))
    shell = ms.Shell(sheet, thickness=5e-4, young_modulus=1e6)
    alone, forces = evaluated(free_scene(shell), magnetization=magnetization)
    assert energy == pytest.approx(alone, rel=1e-12)
    np.testing.assert_allclose(gradient[used], forces, rtol=0, atol=1e-12 * np.abs(forces).max())


def held_pair(gap, young_modulus=3e5):
    """Return a scene of two soft blocks whose far sides are held."""
    material = ms.StableNeoHookean(young_modulus=young_modulus, poisson_ratio=0.3)
    blocks = [
        ms.Solid(each.mesh, material=material, element="linear", remanent_magnetization=(0, 0, 1.5e5))
        for each in (
            block((SIDE,) * 3, (2, 2, 2)),
            block((SIDE,) * 3, (2, 2, 2), (0, 0, SIDE + gap)),
        )
    ]
    supports = [
        ms.Pin(blocks[0].mesh.vertices_at(z=-0.5 * SIDE), body=blocks[0]),
        ms.Pin(blocks[1].mesh.vertices_at(z=1.5 * SIDE + gap), body=blocks[1]),
    ]
    return blocks, ms.Scene(blocks, supports=supports, own_field=ms.OwnField())


def test_soft_solids_at_rest_attract_each_other():
    blocks, scene = held_pair(4e-3)
    rest = ms.equilibrium(scene, progress=False)
    assert rest.stable
    lower, upper = (rest.magnetic_force(each) for each in blocks)
    assert upper[2] < 0 < lower[2]
    np.testing.assert_allclose(lower, -upper, rtol=0, atol=1e-13 * np.abs(upper).max())
    state = ms.field_of(rest)
    assert state.energies["own"] > 0 > state.energies["mutual"]
    assert sum(state.energies.values()) == pytest.approx(rest.energies["own field"])
    facing = blocks[0].mesh.vertices_at(z=0.5 * SIDE)
    alone = ms.Scene(
        blocks[0], supports=ms.Pin(blocks[0].mesh.vertices_at(z=-0.5 * SIDE)), own_field=ms.OwnField()
    )
    by_itself = ms.equilibrium(alone, progress=False).displacements[facing, 2].mean()
    assert rest[blocks[0]].displacements[facing, 2].mean() > by_itself


def test_flux_density_outside_of_a_solid_equals_that_of_a_magnet():
    magnetization = (4e4, 2e4, 9e4)
    solid = block((SIDE,) * 3, (5, 5, 5), magnetization=magnetization)
    stiff = ms.Solid(
        solid.mesh,
        material=ms.StableNeoHookean(young_modulus=1e9, poisson_ratio=0.3),
        element="linear",
        remanent_magnetization=magnetization,
    )
    held = ms.Pin(stiff.mesh.vertices_at(z=-0.5 * SIDE))
    state = ms.field_of(
        ms.equilibrium(ms.Scene(stiff, supports=held, own_field=ms.OwnField()), progress=False)
    )
    points = np.array([[0.0, 0.001, 0.01], [0.009, 0.006, 0.001], [-0.002, 0.002, -0.009]])
    exact = ms.CuboidMagnet((SIDE,) * 3, magnetization).flux_density(points)
    np.testing.assert_allclose(state.flux_density(points), exact, rtol=0, atol=1e-3 * np.abs(exact).max())


def test_rigid_magnet_that_moves_freely_pushes_a_sheet_and_is_pushed_back():
    """Check a solid of which all vertices belong to a rigid body: without other forces the momentum of all stays zero."""
    mesh = ms.meshes.rectangle(0.02, 0.02, cells=(4, 4)).transformed(translation=(-0.01, -0.01, 9e-3))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=2e3)
    cube = block((6e-3,) * 3, (2, 2, 2), (1e-3, 0, 0), magnetization=(2e5, 0, 8e5), mass_density=7e3)
    carrier = ms.RigidBody(np.arange(cube.mesh.n_vertices), body=cube)
    scene = ms.Scene([sheet, cube, carrier], own_field=ms.OwnField(), allow_rigid_motions=True)
    rows = np.zeros((mesh.n_faces + cube.mesh.n_faces, 3))
    rows[: mesh.n_faces] = (0, 0, -5e4)
    motion = ms.simulate(scene, steps=5, time_step=1e-4, remanent_magnetization=rows, progress=False)
    masses = np.concatenate([sheet.vertex_masses, cube.vertex_masses])
    moved = motion.positions[-1] - motion.positions[0]
    momentum = masses[:, None] * moved
    assert momentum[: mesh.n_vertices, 2].sum() > 0  # unlike poles repel
    assert np.linalg.norm(momentum.sum(axis=0)) < 1e-8 * np.abs(momentum).sum()
    now = motion[cube].positions[-1]
    distances = np.linalg.norm(now - now[0], axis=1) - np.linalg.norm(
        cube.mesh.rest_positions - cube.mesh.rest_positions[0], axis=1
    )
    assert np.abs(distances).max() < 1e-12


def test_scene_refuses_solids_without_a_supported_own_field():
    plain = ms.Solid(ms.meshes.box((SIDE,) * 3, cells=(1, 1, 1)), material=RUBBER, element="linear")
    with pytest.raises(ValueError, match="no body of the scene has a magnetization"):
        free_scene(plain)
    with pytest.raises(ValueError, match="body 0, a Solid without magnetization"):
        free_scene(plain, bodies=plain)
    coat = ms.Skin(thickness=1e-4, remanent_magnetization=(1e4, 0, 0))
    with pytest.raises(ValueError, match="magnetized throughout and has a skin"):
        free_scene(block((SIDE,) * 3, (1, 1, 1), skin=coat))
    other = block((SIDE,) * 3, (1, 1, 1))
    shell = ms.Shell(ms.meshes.rectangle(SIDE, SIDE, cells=(1, 1)), thickness=1e-3, young_modulus=1e6)
    with pytest.raises(ValueError, match="names a Solid that is not among the bodies"):
        free_scene(shell, bodies=other)


def test_uniform_rotating_magnetization_has_its_charges_on_the_surface_at_rest():
    energies = [
        evaluated(free_scene(block((SIDE,) * 3, (3, 3, 3), magnetization_law=law), max_points=10**5))[0]
        for law in LAWS
    ]
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)


def test_derivatives_hold_where_a_body_is_turned_far_and_stretched():
    """Check the rotation of large deformations, for which its iteration takes many steps."""
    solid = block((SIDE,) * 3, (1, 1, 1), magnetization=(5e4, -3e4, 8e4), magnetization_law="rotates")
    scene = free_scene(solid)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    rest = scene.mesh.rest_positions
    positions = rest @ np.diag([6.0, 0.2, 1.5]) @ turn
    alone = rest @ np.diag([6.0, 0.2, 1.5])
    assert evaluated(scene, positions)[0] == pytest.approx(evaluated(scene, alone)[0], rel=1e-12)
    direction = np.random.default_rng(4).normal(size=rest.shape)
    step = 1e-8

    def at(k):
        return evaluated(scene, positions + k * step * direction)

    _, gradient, product = evaluated(scene, positions, direction=direction)
    slope = (8 * (at(1)[0] - at(-1)[0]) - (at(2)[0] - at(-2)[0])) / (12 * step)
    change = (8 * (at(1)[1] - at(-1)[1]) - (at(2)[1] - at(-2)[1])) / (12 * step)
    assert abs(slope - np.sum(gradient * direction)) < 1e-6 * np.abs(gradient * direction).sum()
    assert np.abs(change - product).max() < 1e-6 * np.abs(product).max()
