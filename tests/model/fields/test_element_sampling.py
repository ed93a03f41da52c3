"""Six-node shells and solids near magnets: their elements sample the field finely where it changes over them."""

import pickle
import warnings

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY, cuboid_force

import magshell as ms
from magshell.model.scene import field_sampling
from magshell.model.scene.element_sampling import element_forces
from magshell.model.scene.field_sampling import _sources
from magshell.model.scene.fine_faces import fine_faces, having_fine_faces, with_fine_faces
from magshell.model.scene.solve_inputs import Inputs

torch = pytest.importorskip("torch")

WIDTH, HEIGHT, MAGNETIZATION = 10e-3, 2e-3, 1e5


def block_at_magnet(gap, cells=(8, 8, 2), young_modulus=1e12, **options):
    """Return a scene of a block above a magnet of its size, gap [m] apart, both magnetized along z, and the exact force."""
    mesh = ms.meshes.box((WIDTH, WIDTH, HEIGHT), cells=cells)
    mesh = mesh.transformed(translation=np.array([0.0, 0.0, gap]) - mesh.rest_positions.min(axis=0))
    material = ms.NeoHookean(young_modulus=young_modulus, poisson_ratio=0.3)
    block = ms.Solid(
        mesh, material=material, mass_density=1e3, remanent_magnetization=(0, 0, MAGNETIZATION), **options
    )
    magnet = ms.CuboidMagnet(
        (WIDTH, WIDTH, HEIGHT),
        remanent_magnetization=(0, 0, MAGNETIZATION),
        center=(WIDTH / 2, WIDTH / 2, -HEIGHT / 2),
    )
    size = (WIDTH, WIDTH, HEIGHT)
    exact = cuboid_force(size, size, (0, 0, gap + HEIGHT), 2, VACUUM_PERMEABILITY * MAGNETIZATION)
    scene = ms.Scene(block, supports=[ms.Pin(block.mesh.vertices_at(x=0.0))], field=magnet)
    return scene, exact


def plate_at_magnet(gap, cells, young_modulus=1e13, law="stretches"):
    thickness = 2e-4
    mesh = ms.meshes.rectangle(WIDTH, WIDTH, cells=(cells, cells), order=2)
    mesh = mesh.transformed(translation=(0, 0, gap + thickness))
    plate = ms.Shell(
        mesh,
        thickness=thickness,
        young_modulus=young_modulus,
        mass_density=1e3,
        magnetization_law=law,
        remanent_magnetization=(0, 0, MAGNETIZATION),
    )
    size = (WIDTH, WIDTH, thickness)
    magnet = ms.CuboidMagnet(
        size, remanent_magnetization=(0, 0, MAGNETIZATION), center=(WIDTH / 2, WIDTH / 2, 0)
    )
    exact = cuboid_force(size, size, (0, 0, gap + thickness), 2, VACUUM_PERMEABILITY * MAGNETIZATION)
    return ms.Scene(plate, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=magnet), exact


def with_fine(scene, fine):
    """Return the values of a scene whose elements sample finely or not, by numbers 1 and 0."""
    inputs = Inputs(scene, None, None)
    return having_fine_faces(inputs, np.broadcast_to(fine, fine_faces(inputs.values).shape)).values


def compared(scene, values, positions):
    """Return the force on the body as a solve takes it, as it is, and that of the core."""
    model, layout = scene._model, scene._load_parameter_layout
    with values.in_core():
        (found,) = element_forces(values, positions, _sources(values, positions, 1.0, None))
        state = model.state(positions, np.zeros(scene._bodies.n_rotations))
        ones = layout.packed({("scene", "field_factor"): 1.0}, layout.zeros())
        force = -model.positions(model.term_gradient("magnetic", state, ones)).sum(axis=0)
    return found.taken.sum(axis=0), found.mean.sum(axis=0), force


def warned(call) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught if each.category is ms.FieldSamplingWarning]


NEAR = [
    pytest.param(
        lambda law, gap=gap, element=element: block_at_magnet(
            gap, (6, 6, 2), element=element, magnetization_law=law
        ),
        id=f"{element} {gap}",
    )
    for element, gap in [("linear", 1e-3), ("linear", 5e-4), ("quadratic", 5e-4)]
] + [
    pytest.param(
        lambda law, gap=gap, cells=cells: plate_at_magnet(gap, cells, law=law), id=f"six nodes {gap}"
    )
    for cells, gap in [(8, 5e-4), (12, 2e-4)]
]


@pytest.mark.parametrize("law", ["stretches", "rotates"])
@pytest.mark.parametrize("make", NEAR)
def test_the_force_of_a_near_magnet_on_elements_is_right_to_0_1_percent(make, law):
    scene, exact = make(law)
    rest, size = scene.mesh.rest_positions, np.linalg.norm(exact)
    taken, mean, force = compared(scene, scene._values, rest)
    np.testing.assert_allclose(force, taken, rtol=0, atol=1e-10 * size)
    np.testing.assert_allclose(mean, exact, rtol=0, atol=1e-3 * size)
    found = ms.forces(scene, rest).on_vertices.sum(axis=0)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-3 * size)


# [m], [m], [T]: sizes and distance of two cuboids, the second one in the field of the first, and their polarization along z
CUBES = ((0.01,) * 3, (0.01,) * 3), (0.0, 0.0, 0.02), 1.0
CUBOIDS = ((0.02, 0.012, 0.006), (0.012, 0.02, 0.006)), (0.0, -0.004, 0.008), 0.38


@pytest.mark.parametrize(
    ("cuboids", "cells", "own", "fine"),
    [
        (CUBES, (2, 2, 2), 1.17e-2, 6e-8),
        (CUBES, (4, 4, 4), 7.49e-4, 4e-9),
        (CUBOIDS, (4, 7, 2), 2.77e-3, 4e-6),
    ],
)
def test_force_of_a_magnet_on_a_cuboid_equals_the_closed_form(cuboids, cells, own, fine):
    """Check linear elements; above 0.1 % they sample finely on their own, until the rest is off by 0.05 % at most."""
    (of_magnet, size), offset, polarization = cuboids
    magnetization = (0, 0, polarization / VACUUM_PERMEABILITY)
    exact = cuboid_force(of_magnet, size, offset, 2, polarization)
    block = ms.Solid(
        ms.meshes.box(size, cells=cells).transformed(translation=np.array(offset) - 0.5 * np.array(size)),
        material=ms.NeoHookean(young_modulus=1e12, poisson_ratio=0.3),
        element="linear",
        remanent_magnetization=magnetization,
    )
    held = ms.Pin(block.mesh.vertices_at(x=block.mesh.rest_positions[:, 0].min()))
    scene = ms.Scene(block, supports=[held], field=ms.CuboidMagnet(of_magnet, magnetization))
    rest = scene.mesh.rest_positions
    errors = [
        np.linalg.norm(compared(scene, with_fine(scene, each), rest)[2] - exact) / np.linalg.norm(exact)
        for each in (0.0, 1.0)
    ]
    assert errors[0] == pytest.approx(own, rel=0.05) and errors[1] < fine
    by_itself = np.linalg.norm(ms.forces(scene, rest).on_vertices.sum(axis=0) - exact) / np.linalg.norm(exact)
    assert by_itself <= (6e-4 if errors[0] > 1e-3 else 1.01 * errors[0])
    given = Inputs(scene, None, None, field_factor=1.0)
    states = [
        scene._model.state(positions, np.zeros(scene._bodies.n_rotations))
        for positions in (rest, rest + np.array((0.0, 0.0, 0.2)))
    ]
    near, far = (
        fine_faces(with_fine_faces(given, state, given.load_parameters).values).any() for state in states
    )
    assert near == (errors[0] > 1e-3) and not far


def test_an_equilibrium_computes_the_errors_of_its_elements_at_the_start_and_at_the_end_only(monkeypatch):
    states = []

    def counted(values, positions, sources):
        states.append(positions)
        return element_forces(values, positions, sources)

    monkeypatch.setattr(field_sampling, "element_forces", counted)
    ms.equilibrium(small("linear"), progress=False)
    assert len(states) == 2


def small(kind, law="stretches", **options):
    """Return a scene of few elements near a magnet."""
    if kind == "six nodes":
        return plate_at_magnet(3e-4, 3, law=law, **options)[0]
    return block_at_magnet(1e-3, (2, 2, 1), element=kind, magnetization_law=law, **options)[0]


KINDS = ["linear", "quadratic", "six nodes"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_elements_follow_a_deformed_body(kind, law):
    """Check a body that is turned and stretched, with some fine elements: what is compared is the force of the core."""
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    scene = small(kind, law)
    rest = scene.mesh.rest_positions
    middle = rest.mean(axis=0)
    positions = middle + (0, 0, 6e-3) + 0.5 * (rest - middle) @ np.diag([1.2, 0.9, 1.1]) @ turn.T
    positions += 1e-4 * rng.normal(size=rest.shape)
    taken, _, force = compared(scene, with_fine(scene, some_fine(scene)), positions)
    np.testing.assert_allclose(taken, force, rtol=0, atol=1e-9 * np.abs(force).max())


def some_fine(scene):
    """Return numbers 1 for some elements of a scene, so that SIMD vectors hold elements of both kinds."""
    count = len(fine_faces(scene._values))
    return (np.arange(count) % 5 < 2) * 1.0


def slope(function, step):
    """Return a derivative at 0 by central differences of fourth order."""
    pairs = [(2 / 3, 1), (-1 / 12, 2)]
    return sum(c * (function(m * step) - function(-m * step)) for c, m in pairs) / step


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_forces_and_hessian_products_of_fine_elements_agree_with_differences(kind, law):
    scene = small(kind, law, young_modulus=1e3)
    rng, model = np.random.default_rng(1), scene._model
    rest = scene.mesh.rest_positions
    layout = scene._load_parameter_layout
    uniform = (
        {("scene", "applied_flux_density"): (1e-3, 2e-3, -1e-3)}
        if ("scene", "applied_flux_density") in layout
        else {}
    )
    at = layout.packed({("scene", "field_factor"): 1.0, **uniform}, layout.zeros())
    still = np.zeros(scene._bodies.n_rotations)
    positions = rest * (1.05, 0.97, 1.02) + (0, 0, 3e-4) + 3e-5 * rng.normal(size=rest.shape)
    x = model.state(positions, still)
    along = model.state(positions + rng.normal(size=rest.shape), still) - x
    with with_fine(scene, some_fine(scene)).in_core():
        force = model.term_gradient("magnetic", x, at)
        by_differences = slope(lambda t: model.energies(x + t * along, at)["magnetic"], 1e-6)
        assert force @ along == pytest.approx(by_differences, abs=1e-7 * np.abs(force * along).sum())
        product = model.hessian_product(x, at, along)
        exact = slope(lambda t: model.gradient(x + t * along, at), 1e-6)
    assert product == pytest.approx(exact, abs=1e-7 * np.abs(exact).max())


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_equilibria_with_fine_elements_have_gradients_by_every_value(kind, law):
    """Check values of the body and of the magnet, and rest positions, against differences of whole solves."""
    soft = {"linear": 1e7, "quadratic": 3e7, "six nodes": 2e9}[kind]
    scene = small(kind, law, young_modulus=soft)
    (body,), (magnet,) = scene.bodies, scene.fields
    rng = np.random.default_rng(3)
    count = len(fine_faces(scene._values))
    base = {
        body: {
            "remanent_magnetization": MAGNETIZATION * rng.uniform(0.2, 1.0, (count, 3)),
            "rest_positions": scene.mesh.rest_positions,
        },
        magnet: {"center": np.array(magnet.center), "remanent_magnetization": (1e4, -2e4, 1.2e5)},
    }
    if kind == "six nodes":
        base[body]["thickness"] = 2e-4 * rng.uniform(0.8, 1.2, count)
    steps = {"rest_positions": 5e-5, "center": 1e-4}  # [m]; of others a twentieth
    directions = {
        (owner, name): rng.normal(size=np.shape(value)) * steps.get(name, 0.05 * np.abs(value).max())
        for owner, values in base.items()
        for name, value in values.items()
    }
    weights = torch.from_numpy(rng.normal(size=scene.mesh.rest_positions.shape))
    exact = {"solver": ms.MixedNewton(tolerance=1e-13), "progress": False}
    start = ms.equilibrium(scene, values=base, **exact)
    assert 0 < fine_faces(start._values).sum()
    assert 1e-6 < np.abs(start.displacements).max() < 3e-4  # well above the magnet

    def loss(values):
        found = ms.equilibrium(scene, values=values, start=start, **exact)
        moved = torch.as_tensor(found.positions)
        return (weights * moved).sum() / 1e-3

    given = {
        owner: {
            name: torch.tensor(np.array(value, float), requires_grad=True) for name, value in values.items()
        }
        for owner, values in base.items()
    }
    loss(given).backward()
    for (owner, name), direction in directions.items():

        def along(t, owner=owner, name=name, direction=direction):
            moved = {each: dict(values) for each, values in base.items()}
            moved[owner][name] = np.array(moved[owner][name], float) + t * direction
            return float(loss(moved))

        by = given[owner][name].grad.numpy() * direction
        assert by.sum() == pytest.approx(slope(along, 1e-2), abs=1e-6 * np.abs(by).sum()), name


def test_elements_that_need_it_sample_finely_and_results_keep_them():
    scene = block_at_magnet(1e-3, element="linear")[0]
    with warnings.catch_warnings():
        warnings.simplefilter("error", ms.FieldSamplingWarning)
        found = ms.equilibrium(scene, progress=False)
    fine = fine_faces(found._values)
    assert 0 < fine.sum() < len(fine)
    copied = pickle.loads(pickle.dumps(found))
    assert np.array_equal(fine_faces(copied._values), fine)
    again = ms.equilibrium(scene, start=found, progress=False)
    assert np.array_equal(fine_faces(again._values), fine)
    far = ms.equilibrium(block_at_magnet(2e-2, element="linear")[0], progress=False)
    assert not fine_faces(far._values).any()


def far_block(**options):
    return block_at_magnet(2e-2, (8, 8, 2), element="linear", **options)[0]


def test_paths_and_motions_of_solids_that_come_near_a_magnet_are_warned_of():
    scene = far_block()
    (block,), (magnet,) = scene.bodies, scene.fields
    lowered = ms.Pin(block.mesh.vertices_at(x=0.0), displacement=(0, 0, -19e-3))
    (told,) = warned(
        lambda: ms.follow_path(ms.Scene(block, supports=[lowered], field=magnet), progress=False)
    )
    assert "the path, at point" in told and "start nearer to the source, or take smaller elements" in told
    thrown = ms.Scene(block, field=magnet, allow_rigid_motions=True)
    speed = np.tile((0.0, 0.0, -3.8e3), (scene.mesh.n_vertices, 1))
    (told,) = warned(lambda: ms.simulate(thrown, velocities=speed, steps=5, time_step=1e-6, progress=False))
    assert (
        "the motion, in recorded state 5" in told and "as its elements sample the field at few points" in told
    )


def test_elements_too_large_for_fine_points_are_warned_of():
    scene, _ = block_at_magnet(1e-5, (1, 1, 1), element="linear")
    (told,) = warned(lambda: ms.equilibrium(scene, progress=False))
    assert "although elements near the sources sample the field at many points" in told
