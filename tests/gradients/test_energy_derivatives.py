"""Derivatives of energies at given positions: first and second, by positions, edge rotations and values."""

import numpy as np
import pytest
import scipy.sparse.linalg

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.04, 0.02, cells=(4, 2))
QUADRATIC = ms.meshes.rectangle(0.04, 0.02, cells=(3, 1), order=2)
BLOCK = ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1))
RUBBER = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.3, "mass_density": 1e3}
MAGNETIC = {"remanent_magnetization": (3e4, 1e3, 2e4), "applied_flux_density": (1e-3, 2e-3, 5e-3)}


def shell(mesh=MESH, **options):
    sheet = ms.Shell(mesh, **{**RUBBER, **options})
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    return ms.Scene(sheet, supports=[clamp], gravity=(0, 0, -9.81), field=ms.UniformField())


def solid():
    rubber = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
    block = ms.Solid(BLOCK, material=rubber, mass_density=1e3, remanent_magnetization=(3e4, 1e3, 2e4))
    pin = ms.Pin(block.mesh.vertices_at(x=0.0))
    return ms.Scene(block, supports=[pin], gravity=(0, 0, -9.81), field=ms.UniformField())


def on_a_floor():
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, -0.2e-3)), contact_stiffness=20.0, offset=0.5e-3)
    sheet = ms.Shell(MESH, **RUBBER)
    return ms.Scene(sheet, contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)


SCENES = {
    "hinge": (lambda: shell(bending="hinge"), MAGNETIC),
    "midedge": (lambda: shell(bending="midedge"), MAGNETIC),
    "six-node": (lambda: shell(QUADRATIC), MAGNETIC),
    "solid": (solid, {"applied_flux_density": (1e-3, 2e-3, 5e-3)}),
    "contact": (on_a_floor, {}),
}
EACH = pytest.mark.parametrize("name", SCENES)


def at(name):
    """Return a scene, its loads, bent positions and edge rotations away from equilibrium."""
    make, given = SCENES[name]
    scene = make()
    rest, some = scene.mesh.rest_positions, np.random.default_rng(1)
    bend = np.stack([0 * rest[:, 0], 0.1 * rest[:, 0], 0.2 * rest[:, 0] * np.sin(60 * rest[:, 0])], 1)
    positions = 1.01 * rest + bend * (0.1 if name == "contact" else 1.0)
    positions = positions + 2e-5 * some.normal(size=rest.shape)
    rotations = 0.02 * some.normal(size=scene._bodies.n_rotations)
    return scene, given, positions, rotations


def tensors(*arrays):
    return [torch.tensor(np.array(each), dtype=torch.float64, requires_grad=True) for each in arrays]


def slope(function, length):
    """Return a derivative at 0 by central differences of sixth order, with steps of this length."""
    pairs = [(3 / 4, 1), (-3 / 20, 2), (1 / 60, 3)]
    return sum(c * (function(m * length) - function(-m * length)) for c, m in pairs) / length


@EACH
def test_derivatives_by_positions_agree_with_differences(name):
    scene, given, positions, rotations = at(name)
    x, r = tensors(positions, rotations)
    energy = ms.energy(scene, x, edge_rotations=r, **given)
    assert energy.item() == pytest.approx(
        sum(ms.energies(scene, positions, edge_rotations=rotations, **given).values()), rel=1e-14
    )
    by_x, by_r = torch.autograd.grad(energy, (x, r), create_graph=True)
    some = np.random.default_rng(2)
    for _ in range(2):
        dx, dr = 1e-2 * some.normal(size=positions.shape), some.normal(size=rotations.shape)

        def moved(t, dx=dx, dr=dr):
            return {"positions": positions + t * dx, "edge_rotations": rotations + t * dr, **given}

        first = (by_x.detach().numpy() * dx).sum() + (by_r.detach().numpy() * dr).sum()
        assert first == pytest.approx(slope(lambda t: ms.energy(scene, **moved(t)), 1e-3), rel=1e-8)
        product = torch.autograd.grad(
            (by_x * torch.tensor(dx)).sum() + (by_r * torch.tensor(dr)).sum(), (x, r), retain_graph=True
        )
        for which, found in enumerate(product):
            if not found.numel():  # solids have no edge rotations
                continue
            wanted = slope(lambda t, which=which: -ms.forces(scene, **moved(t))[which], 1e-3)
            assert np.abs(found.numpy() - wanted).max() <= 1e-6 * max(np.abs(wanted).max(), 1e-300)
        motion = np.concatenate([dx.ravel(), dr])
        hessian = ms.hessian(scene, positions, edge_rotations=rotations, **given)
        both = np.concatenate([each.numpy().ravel() for each in product])
        assert np.abs(hessian @ motion - both).max() <= 1e-12 * np.abs(both).max()
        assert abs(hessian - hessian.T).max() <= 1e-14 * abs(hessian).max()


def values_of(name, scene):
    """Return numbers for the values and load parameters of a scene, {name: array}."""
    n_f, some = scene._bodies.n_magnetized if name != "solid" else 1, np.random.default_rng(3)
    found = {"gravity_factor": np.array(0.7)}
    if name != "contact":
        found |= {"applied_flux_density": np.array(MAGNETIC["applied_flux_density"]), "field_factor": 0.9}
        found |= {"remanent_magnetization": 2e4 * some.normal(size=(n_f, 3))}
    if name == "solid":
        found.pop("remanent_magnetization")
        return found
    found |= {
        "thickness": 1e-3 * some.uniform(0.8, 1.2, n_f),
        "young_modulus": 1e6 * some.uniform(0.8, 1.2, n_f),
    }
    return found | {"poisson_ratio": np.array(0.3), "mass_density": np.array(1e3)}


@EACH
def test_first_derivatives_by_values_agree_with_differences(name):
    """Check first derivatives, and mixed ones, which begin with the gradient by positions."""
    scene, given, positions, rotations = at(name)
    given = {**given, "edge_rotations": rotations}
    for value, numbers in values_of(name, scene).items():
        check_one_value(scene, positions, given, value, numbers)


def check_one_value(scene, positions, given, value, numbers):
    k, x = tensors(numbers, positions)
    step = np.random.default_rng(4).uniform(0.5, 1.0, np.shape(numbers)) * numbers
    motion = 1e-2 * np.random.default_rng(5).normal(size=positions.shape)

    def with_value(there):
        return {**given, value: there}

    def power(t):
        return (motion * ms.forces(scene, positions, **with_value(numbers + t * step)).on_vertices).sum()

    energy = ms.energy(scene, x, **with_value(k))
    (by_k,) = torch.autograd.grad(energy, k, retain_graph=True)
    wanted = slope(lambda t: ms.energy(scene, positions, **with_value(numbers + t * step)), 2e-2)
    assert (by_k.numpy() * step).sum() == pytest.approx(wanted, rel=1e-8), value
    (by_x,) = torch.autograd.grad(energy, x, create_graph=True)
    (mixed,) = torch.autograd.grad((by_x * torch.tensor(motion)).sum(), k)
    assert (mixed.numpy() * step).sum() == pytest.approx(-slope(power, 2e-2), rel=1e-6), value
    on_vertices, _ = ms.forces(scene, positions, **with_value(k))
    (of_forces,) = torch.autograd.grad((on_vertices * torch.tensor(motion)).sum(), k)
    assert np.allclose(of_forces.numpy(), -mixed.numpy(), rtol=1e-12, atol=0)


def test_scalar_values_agree_with_differences():
    """Check numbers that all rows of the core equal, which change together."""
    scene, given, positions, rotations = at("midedge")
    given = {**given, "edge_rotations": rotations}
    for value, number in (("thickness", 1e-3), ("young_modulus", 1e6), ("poisson_ratio", 0.3)):
        check_one_value(scene, positions, given, value, np.array(number))


def test_values_of_objects_have_derivatives():
    """Check values of a scene's objects: a stiffness of a contact, and the moduli of a material."""
    scene, _, positions, _ = at("contact")
    floor = scene.contacts[0]
    (k,) = tensors(20.0)
    (by_k,) = torch.autograd.grad(
        ms.energies(scene, positions, values={floor: {"contact_stiffness": k}})["contact"], k
    )
    wanted = ms.energies(scene, positions)["contact"] / 20.0
    assert wanted > 0.0
    assert by_k.item() == pytest.approx(wanted, rel=1e-8)


def test_support_factor_turns_the_directions_of_clamps():
    """Check the directions that a clamp holds, which positions do not determine."""
    sheet = ms.Shell(MESH, **RUBBER)
    turned = ms.Clamp(MESH.edges_at(x=0.0), rotation=(0.0, -0.5, 0.0))
    scene = ms.Scene(sheet, supports=[turned], gravity=(0, 0, -9.81))
    positions, rotations = MESH.rest_positions.copy(), 0.02 * np.ones(MESH.n_edges)
    positions[:, 2] = 0.1 * positions[:, 0]
    check_one_value(scene, positions, {"edge_rotations": rotations}, "support_factor", np.array(0.7))


@pytest.mark.parametrize("of_single", [False, True], ids=["of the sum", "of one energy"])
def test_second_derivatives_stay_those_of_their_values_after_another_solve(of_single):
    """Check a clamp whose directions follow from values: those of the last use of the core were taken."""
    sheet = ms.Shell(MESH, **RUBBER)
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0), rotation=(0, 0.1, 0))
    scene = ms.Scene(sheet, supports=[clamp])
    places = 1.01 * MESH.rest_positions

    def second(thickness_too, other_solve):
        positions, thickness = tensors(places, RUBBER["thickness"])
        values = {clamp: {"rotation": (0, 0.5, 0)}, sheet: {"thickness": thickness}}
        if of_single:
            energy = ms.energies(scene, positions, values=values)["bending"]
        else:
            energy = ms.energy(scene, positions, values=values)
        (gradient,) = torch.autograd.grad(energy, positions, create_graph=True)
        if other_solve:
            ms.energy(scene, places)
        motion = torch.tensor(np.random.default_rng(0).standard_normal(places.shape))
        by = [positions, thickness] if thickness_too else [positions]
        return torch.autograd.grad((gradient * motion).sum(), by)

    for thickness_too in (False, True):
        for one, other in zip(second(thickness_too, False), second(thickness_too, True), strict=True):
            np.testing.assert_array_equal(one, other)


def test_volume_of_a_cavity_couples_all_vertices():
    """Check that the low-rank part of the core's Hessian is in the matrix."""
    box = ms.meshes.box((0.1, 0.1, 0.1), cells=(2, 2, 1))
    shape = ms.TriangleMesh(box.rest_positions, box.faces)
    sheet = ms.Shell(shape, **RUBBER)
    scene = ms.Scene(
        sheet, actuators=[ms.Cavity(sheet, volume=1.01e-3, bulk_modulus=1e9)], allow_rigid_motions=True
    )
    some = np.random.default_rng(8)
    positions = shape.rest_positions * (1.01, 0.98, 1.0)
    motion = 1e-3 * some.normal(size=positions.shape)
    wanted = slope(lambda t: -ms.forces(scene, positions + t * motion).on_vertices.ravel(), 1e-3)
    found = ms.hessian(scene, positions)[:, : positions.size] @ motion.ravel()
    assert np.abs(found[: positions.size] - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_rigid_bodies_are_refused():
    plate = ms.RigidBody(
        np.flatnonzero(MESH.rest_positions[:, 0] > 0.025), mass=1e-3, inertia=1e-12, center=(0.04, 0.01, 0.0)
    )
    clamp = ms.Clamp(MESH.edges_at(x=0.0))
    scene = ms.Scene([ms.Shell(MESH, **RUBBER), plate], supports=[clamp])
    assert ms.energy(scene, MESH.rest_positions) == pytest.approx(0.0, abs=1e-15)
    for function in (ms.forces, ms.hessian):
        with pytest.raises(ValueError, match="rigid bodies or skeletons"):
            function(scene, MESH.rest_positions)


def test_torch_finds_the_same_derivatives():
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(1, 1))
    scene = ms.Scene(
        ms.Shell(mesh, thickness=0.5, young_modulus=1.0, poisson_ratio=0.2), allow_rigid_motions=True
    )
    some = np.random.default_rng(6)
    x, r = tensors(mesh.rest_positions + 0.1 * some.normal(size=(mesh.n_vertices, 3)), np.zeros(mesh.n_edges))
    thickness, modulus = tensors(np.full(mesh.n_faces, 0.5), 1.0)

    def energy(x, r):
        return ms.energy(scene, x, edge_rotations=r)

    def forces(x, thickness, modulus):
        return ms.forces(scene, x, thickness=thickness, young_modulus=modulus).on_vertices

    assert torch.autograd.gradcheck(energy, (x, r))
    assert torch.autograd.gradgradcheck(energy, (x, r))
    assert torch.autograd.gradcheck(forces, (x, thickness, modulus))


@pytest.mark.parametrize("bending", ["hinge", "midedge"])
def test_own_newton_loop_finds_the_equilibrium(bending):
    scene = shell(bending=bending)
    given = {"remanent_magnetization": (3e4, 0, 0), "applied_flux_density": (0, 0, 5e-4)}
    wanted = ms.equilibrium(scene, **given)
    x, r = scene.mesh.rest_positions.copy(), np.zeros(scene.mesh.n_edges)
    free = ms.free_motions(scene)
    for _ in range(30):
        force = free.T @ np.concatenate(
            [each.ravel() for each in ms.forces(scene, x, edge_rotations=r, **given)]
        )
        hessian = ms.hessian(scene, x, edge_rotations=r, reduced=True, **given)
        step = free @ scipy.sparse.linalg.spsolve(hessian.tocsc(), force)
        x, r = x + step[: x.size].reshape(-1, 3), r + step[x.size :]
        if np.abs(step).max() < 1e-13:
            break
    assert np.abs(x - wanted.positions).max() < 1e-10
    assert np.abs(r - wanted.edge_rotations).max() < 1e-7
    assert np.abs(wanted.positions - scene.mesh.rest_positions).max() > 1e-3


def test_free_motions_keep_directions_of_slanted_supports():
    mesh = MESH
    sheet = ms.Shell(mesh, **RUBBER, bending="hinge")
    slanted = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
    held = mesh.vertices_at(x=0.0)
    scene = ms.Scene(sheet, supports=[ms.SymmetryPlane(slanted)], allow_rigid_motions=True)
    free = ms.free_motions(scene)
    assert abs(free.T @ free - scipy.sparse.eye_array(free.shape[1])).max() < 1e-14
    moved = (free @ np.random.default_rng(0).normal(size=free.shape[1]))[: 3 * mesh.n_vertices].reshape(-1, 3)
    assert np.abs(moved[held] @ slanted).max() < 1e-14


def test_second_derivatives_by_values_are_those_of_a_power_law():
    """Check a sheet whose stretching grows as E h, and whose bending grows as E h^3."""
    scene, _, positions, rotations = at("midedge")
    given = {**MAGNETIC, "edge_rotations": rotations, "gravity_factor": 0.0, "field_factor": 0.0}
    modulus, thickness = tensors(1e6, 1e-3)
    energies = ms.energies(scene, positions, **given, young_modulus=modulus, thickness=thickness)
    for name, power in (("membrane", 1), ("bending", 3)):
        first = torch.autograd.grad(energies[name], (modulus, thickness), create_graph=True)
        sizes, found = (1e6, 1e-3), []
        for slope_of, own in zip(first, sizes, strict=True):
            seconds = torch.autograd.grad(slope_of, (modulus, thickness), retain_graph=True)
            found.append([float(each) * own * other for each, other in zip(seconds, sizes, strict=True)])
        assert energies[name].item() > 0.0
        wanted = np.array([(0.0, power), (power, power * (power - 1))]) * energies[name].item()
        np.testing.assert_allclose(found, wanted, rtol=1e-8, atol=1e-8 * energies[name].item())


@pytest.mark.parametrize("name", ["hinge", "six-node", "solid", "contact"])
def test_second_derivatives_by_values_agree_with_differences(name):
    """Check derivatives that begin with the gradient by values: by values, and by positions, which are the mixed ones."""
    scene, given, positions, rotations = at(name)
    numbers = {key: np.asarray(each) for key, each in values_of(name, scene).items() if np.size(each) <= 3}
    given = {key: each for key, each in given.items() if key not in numbers}
    given |= {"edge_rotations": rotations}
    if name in ("hinge", "six-node"):
        given["remanent_magnetization"] = MAGNETIC["remanent_magnetization"]
    keys, some = list(numbers), np.random.default_rng(6)
    along = {key: some.uniform(0.3, 1.0, np.shape(each)) * each for key, each in numbers.items()}
    across = {key: some.uniform(0.3, 1.0, np.shape(each)) * each for key, each in numbers.items()}
    motion = 1e-2 * some.normal(size=positions.shape)

    def slopes(t, of_positions=0.0, graph=False):
        """Return the leaves and the gradients of the energy by them, at values moved along."""
        moved = [numbers[key] + t * along[key] for key in keys]
        *k, x = tensors(*moved, positions + of_positions * motion)
        energy = ms.energy(scene, x, **given, **dict(zip(keys, k, strict=True)))
        return (*k, x), torch.autograd.grad(energy, (*k, x), create_graph=graph)

    leaves, first = slopes(0.0, graph=True)
    power = sum((g * torch.tensor(across[key])).sum() for g, key in zip(first[:-1], keys, strict=True))
    *by_values, by_positions = torch.autograd.grad(power, leaves, retain_graph=True)
    found = sum(float((g * torch.tensor(along[key])).sum()) for g, key in zip(by_values, keys, strict=True))

    def rate(gradients):
        return sum(
            float((g.detach() * torch.tensor(across[key])).sum())
            for g, key in zip(gradients, keys, strict=True)
        )

    size = sum(
        float((g.abs() * torch.tensor(abs(along[key]))).sum()) for g, key in zip(by_values, keys, strict=True)
    )
    wanted = slope(lambda t: rate(slopes(t)[1][:-1]), 2e-2)
    assert found == pytest.approx(wanted, rel=0.0, abs=1e-6 * max(size, abs(rate(first[:-1]))))
    mixed = slope(lambda t: rate(slopes(0.0, t)[1][:-1]), 1e-3)
    assert float((by_positions * torch.tensor(motion)).sum()) == pytest.approx(mixed, rel=1e-6)
    other_order = torch.autograd.grad((first[-1] * torch.tensor(motion)).sum(), leaves[:-1])
    other = sum(
        float((g * torch.tensor(across[key])).sum()) for g, key in zip(other_order, keys, strict=True)
    )
    assert float((by_positions * torch.tensor(motion)).sum()) == pytest.approx(other, rel=1e-8)


@EACH
def test_single_energies_have_two_derivatives_by_positions_and_mixed_ones(name):
    scene, given, positions, rotations = at(name)
    given = {**given, "edge_rotations": rotations}
    x, gravity = tensors(positions, 0.7)
    energies = ms.energies(scene, x, **{**given, "gravity_factor": gravity})
    motion = 1e-2 * np.random.default_rng(7).normal(size=positions.shape)
    sizes, step = 0.0, 1e-5 if name == "contact" else 1e-3  # penalties act within a small distance
    for which, energy in energies.items():

        def first(t, which=which):
            (y,) = tensors(positions + t * motion)
            one = ms.energies(scene, y, **given, gravity_factor=0.7)[which]
            return one.item(), torch.autograd.grad(one, y)[0].numpy()

        (by_x,) = torch.autograd.grad(energy, x, create_graph=True)
        along = (by_x * torch.tensor(motion)).sum()
        wanted = slope(lambda t: first(t)[0], step)
        assert along.item() == pytest.approx(
            wanted, rel=1e-8, abs=1e-9 * float(by_x.detach().norm()) * np.linalg.norm(motion)
        )
        product, mixed = torch.autograd.grad(along, (x, gravity), retain_graph=True)
        bent = slope(lambda t: first(t)[1], step)
        assert np.abs(product.numpy() - bent).max() <= 1e-6 * max(
            np.abs(bent).max(), 1e-12 * by_x.detach().abs().max().item()
        )
        of_gravity = along.item() / 0.7 if which == "gravity" else 0.0
        assert mixed.item() == pytest.approx(of_gravity, rel=1e-8, abs=1e-10 * abs(along.item()))
        sizes += by_x.detach()
    (whole,) = torch.autograd.grad(sum(energies.values()), x)
    torch.testing.assert_close(sizes, whole, rtol=1e-12, atol=1e-12 * whole.abs().max().item())


def test_derivatives_that_there_are_none_of_raise():
    scene, given, positions, _ = at("midedge")
    x, modulus = tensors(positions, 1e6)
    energy = ms.energy(scene, x, **given, young_modulus=modulus)
    (by_modulus,) = torch.autograd.grad(energy, modulus, create_graph=True)
    (third,) = torch.autograd.grad(by_modulus.square(), modulus, create_graph=True)
    with pytest.raises(ms.NoGradient, match="no third derivatives"):
        third.backward()
    (by_x,) = torch.autograd.grad(energy, x, create_graph=True)
    (second,) = torch.autograd.grad(by_x.square().sum(), x, create_graph=True)
    with pytest.raises(ms.NoGradient, match="no third derivatives"):
        second.sum().backward()
    (of_sum,) = torch.autograd.grad(sum(ms.energies(scene, x, **given).values()), x)
    (wanted,) = torch.autograd.grad(ms.energy(scene, x, **given), x)
    assert torch.equal(of_sum, wanted)


@pytest.mark.parametrize("function", [ms.energy, ms.forces, ms.hessian])
def test_bad_input_is_refused(function):
    scene, given, positions, rotations = at("midedge")
    holed = positions.copy()
    holed[2, 1] = np.nan
    with pytest.raises(ValueError, match=r"positions \[m\] must have shape"):
        function(scene, positions[:-1], **given)
    with pytest.raises(ValueError, match=r"positions\[2, 1\] is nan"):
        function(scene, holed, **given)
    with pytest.raises(ValueError, match=r"edge_rotations \[rad\]"):
        function(scene, positions, edge_rotations=rotations[:-1], **given)
    with pytest.raises(ValueError, match="scene must be a Scene"):
        function(None, positions)
    with pytest.raises(ValueError, match="without area"):
        function(scene, np.zeros_like(positions), **given)
    with pytest.raises(TypeError, match="youngs_modulus"):
        function(scene, positions, youngs_modulus=1e6, **given)


def test_functions_without_derivatives_refuse_tensors():
    scene, given, positions, _ = at("midedge")
    (x,) = tensors(positions)
    with pytest.raises(ValueError, match="a Hessian has no gradients"):
        ms.hessian(scene, x, **given)
    with pytest.raises(ValueError, match="reduced"):
        ms.hessian(scene, positions, reduced="yes", **given)
    with pytest.raises(ValueError, match="of one body have no gradients"):
        ms.energies(scene, x, body=scene.bodies[0], **given)
    with pytest.raises(ValueError, match="scene must be a Scene"):
        ms.free_motions(None)
