"""Scenes in which nothing can move: every solve gives what is there, or says why it has no answer."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")


def held_shell(order):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(2, 1), order=order)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    clamp = ms.Clamp(np.arange(len(mesh.edges)))
    return ms.Scene(sheet, supports=[clamp], loads=[ms.AreaLoad((0, 0, 1.0))], gravity=(0, 0, -9.81)), sheet


def held_solid():
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1))
    material = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3)
    block = ms.Solid(mesh, material=material, mass_density=1e3, element="linear")
    pin = ms.Pin(np.arange(mesh.n_vertices))
    return ms.Scene(block, supports=[pin], gravity=(0, 0, -9.81)), block


def held_links(count):
    links = [ms.Link(mass=0.5, inertia=0.01, center=(0.3 * k, 0, 0)) for k in range(count)]
    return ms.Scene(ms.Skeleton(links, [ms.Fixed(each) for each in links]), gravity=(0, 0, -9.81)), links[-1]


HELD = {
    "shell": lambda: held_shell(1),
    "six-node shell": lambda: held_shell(2),
    "solid": held_solid,
    "one link": lambda: held_links(1),
    "three links": lambda: held_links(3),
}
PARAMETERS = {ms.Shell: ("thickness", 1e-3), ms.Solid: ("young_modulus", 1e6), ms.Link: ("mass", 0.5)}


def rest(scene):
    return ms.equilibrium(scene, progress=False)


FINDS = {
    "equilibrium": rest,
    "simulate": lambda scene: ms.simulate(scene, steps=3, time_step=1e-2, progress=False),
    "simulate by implicit Euler": lambda scene: ms.simulate(
        scene, steps=3, time_step=1e-2, integrator=ms.ImplicitEuler(), progress=False
    ),
    "follow_path": lambda scene: ms.follow_path(scene, progress=False),
    "linear_response": ms.linear_response,
    "linear_response about": lambda scene: ms.linear_response(scene, rest(scene), load_factor=2.0),
}
REFUSES = {
    "simulate no steps": lambda scene: ms.simulate(scene, steps=0, time_step=1e-2, progress=False),
    "vibration_modes": lambda scene: ms.vibration_modes(scene, count=1),
    "vibration_modes about": lambda scene: ms.vibration_modes(scene, rest(scene), count=1),
    "linear_buckling": ms.linear_buckling,
    "linear_buckling about": lambda scene: ms.linear_buckling(scene, rest(scene), load_factor=2.0),
}


@pytest.mark.parametrize("solve", FINDS.values(), ids=FINDS)
@pytest.mark.parametrize("make", HELD.values(), ids=HELD)
def test_scene_without_unknowns_stays_where_it_is(make, solve):
    scene, _ = make()
    assert scene.n_dofs == 0
    found = solve(scene)
    assert np.all(np.asarray(found.positions) == scene.mesh.rest_positions)
    if isinstance(found, ms.Equilibrium):
        assert found.stable and found.n_negative_eigenvalues == 0


@pytest.mark.parametrize("solve", REFUSES.values(), ids=REFUSES)
@pytest.mark.parametrize("make", HELD.values(), ids=HELD)
def test_questions_without_an_answer_are_refused_where_nothing_moves(make, solve):
    with pytest.raises(ValueError, match="0"):
        solve(make()[0])


@pytest.mark.parametrize("make", HELD.values(), ids=HELD)
def test_energies_of_scenes_without_unknowns_are_finite(make):
    scene, _ = make()
    if not scene.mesh.n_vertices:
        pytest.skip("ms.energy is a function of vertices, and links have none")
    positions = torch.tensor(np.array(scene.mesh.rest_positions), requires_grad=True)
    energy = ms.energy(scene, positions)
    assert torch.isfinite(torch.autograd.grad(energy, positions)[0]).all()
    assert all(np.isfinite(each).all() for each in ms.forces(scene, scene.mesh.rest_positions))
    assert np.isfinite(ms.hessian(scene, scene.mesh.rest_positions).data).all()


SOLVES = {
    "equilibrium": lambda scene, values: ms.equilibrium(scene, values=values, progress=False),
    "simulate": lambda scene, values: ms.simulate(
        scene, values=values, steps=2, time_step=1e-2, progress=False
    ),
}


@pytest.mark.parametrize("solve", SOLVES.values(), ids=SOLVES)
@pytest.mark.parametrize("make", HELD.values(), ids=HELD)
def test_positions_without_unknowns_have_the_gradient_zero(make, solve):
    scene, owner = make()
    name, value = PARAMETERS[type(owner)]
    number = torch.tensor(value, dtype=torch.float64, requires_grad=True)
    found = solve(scene, {owner: {name: number}})
    place = found[owner].center if isinstance(owner, ms.Link) else found.positions
    assert torch.autograd.grad(place.sum(), number)[0] == 0.0
