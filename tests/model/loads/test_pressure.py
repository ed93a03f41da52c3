"""Pressure that follows the faces: forces, stiffness, potential, closed-form answers, refused input.

Its gradients in all kinds of scenes: test_every_gradient.py. The tube and the beam of the validation set:
test_solid_validation.py.
"""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation
from solid_faces import Faces

import magshell as ms
from magshell.mesh.face_shapes import sides
from magshell.solve.linear.stiffness import symmetric

SOFT = ms.StVenantKirchhoff(young_modulus=1e5, poisson_ratio=0.3)
MOVED = 0.02


def curved_block(element: str) -> ms.Solid:
    mesh = ms.meshes.tube(1.0, 2.0, 0.5, np.pi / 2, cells=(1, 2, 1), order=2)
    return ms.Solid(mesh, material=SOFT, element=element)


def loose(body, *pressures) -> ms.Scene:
    return ms.Scene(body, loads=pressures, allow_rigid_motions=True)


def load_parameters(scene, load_factor: float) -> np.ndarray:
    layout = scene._load_parameter_layout
    return layout.packed({("scene", "load_factor"): load_factor}, layout.zeros())


def moved_state(scene, seed: int = 0) -> np.ndarray:
    x = scene.mesh.rest_positions
    moved = x + MOVED * np.random.default_rng(seed).standard_normal(x.shape)
    return scene._model.state(moved, np.zeros(scene.mesh.n_edges))


def forces(scene, state) -> np.ndarray:
    """Compute the forces of the loads alone, (n_v, 3) in N."""
    model = scene._model
    by_load = model.gradient(state, load_parameters(scene, 0.0)) - model.gradient(
        state, load_parameters(scene, 1.0)
    )
    return model.positions(by_load)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_forces_are_those_of_the_elements_own_shapes(element):
    body = curved_block(element)
    scene = loose(body, ms.Pressure(300.0))
    state = moved_state(scene)
    expected = Faces(body.mesh, lambda x: np.ones(len(x), bool)).forces(
        scene._model.positions(state), pressure=300.0
    )
    assert np.allclose(forces(scene, state), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_pressures_of_faces_add_up(element):
    """Compare one load with a pressure per face with a load for every face alone.

    A face of a quadratic element is a quarter of its side.
    """
    body = curved_block(element)
    chosen = np.arange(1, body.mesh.n_faces, 3)
    pressures = np.linspace(-200.0, 500.0, len(chosen))
    scene = loose(body, ms.Pressure(pressures, faces=chosen))
    state = moved_state(scene)
    alone = [ms.Pressure(p, faces=[f]) for f, p in zip(chosen, pressures, strict=True)]
    expected = forces(loose(body, *alone), state)
    assert np.allclose(forces(scene, state), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    x, nodes = scene._model.positions(state), body.mesh.faces[chosen]
    a, b, c = x[nodes].transpose(1, 0, 2)
    if element == "linear":
        total = -(pressures[:, None] * np.cross(b - a, c - a) / 2).sum(axis=0)
        assert np.allclose(forces(scene, state).sum(axis=0), total, rtol=1e-12)


def test_four_quarters_are_a_side():
    body = curved_block("quadratic")
    nodes, parts = sides(body.mesh)
    assert parts == 4 and len(nodes) * 4 == body.mesh.n_faces
    whole, quarters = (
        loose(body, ms.Pressure(pressure, faces=np.arange(8, 12))) for pressure in (70.0, np.full(4, 70.0))
    )
    state = moved_state(whole)
    assert np.allclose(forces(whole, state), forces(quarters, state), rtol=0, atol=1e-12)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_a_closed_surface_has_a_potential(element):
    """Compare the potential with p times the change of volume, and its two derivatives with differences."""
    body = curved_block(element)
    scene = loose(body, ms.Pressure(2e4))
    model, state, on = scene._model, moved_state(scene), load_parameters(scene, 1.0)
    moved = ms.TetMesh(model.positions(state), body.mesh.tetrahedra)
    change = moved.volume - body.mesh.volume
    assert model.energies(state, on)["pressure"] == pytest.approx(2e4 * change, rel=1e-12)
    off = load_parameters(scene, 0.0)
    rng = np.random.default_rng(1)
    along, step = rng.standard_normal(model.size), 1e-4
    rise = [model.energies(state + amount * along, on)["pressure"] for amount in (step, -step)]
    slope = (model.gradient(state, on) - model.gradient(state, off)) @ along
    assert (rise[0] - rise[1]) / (2 * step) == pytest.approx(slope, rel=1e-6)

    def gradient(at):
        return model.gradient(at, on) - model.gradient(at, off)

    size, starts, rows, with_load = model.hessian(state, on, reduced=False)
    values = with_load - model.hessian(state, off, reduced=False)[3]
    exact = symmetric(size, starts, rows, values) @ along
    # Forces are of the second degree: central differences are exact.
    found = (gradient(state + along) - gradient(state - along)) / 2
    assert np.allclose(found, exact, rtol=0, atol=1e-11 * np.abs(exact).max())


def test_a_free_border_has_none_and_a_held_one_has():
    mesh = ms.meshes.rectangle(0.1, 0.1, cells=(4, 4))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    held = ms.Scene(sheet, supports=[ms.Pin(mesh.boundary_vertices)], loads=[ms.Pressure(-20.0)])
    flap = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[ms.Pressure(-0.5)])
    patches = ms.Pressure(np.linspace(-20.0, -10.0, mesh.n_faces))
    uneven = ms.Scene(sheet, supports=[ms.Pin(mesh.boundary_vertices)], loads=[patches])
    assert ms.vibration_modes(held, ms.equilibrium(held)).squares[0] > 0
    for scene in (flap, uneven):
        rest = ms.equilibrium(scene)
        assert rest.stable
        with pytest.raises(ValueError, match="pressure has no potential, so the stiffness is not symmetric"):
            ms.vibration_modes(scene, rest)
        with pytest.raises(ValueError, match="pressure has no potential, so the stiffness is not symmetric"):
            ms.linear_buckling(scene)
        path = ms.follow_path(scene)
        assert path.stable.all()
        np.testing.assert_allclose(path.positions[-1], rest.positions, rtol=0, atol=1e-9)
    assert ms.follow_path(held).parameters[-1] == pytest.approx(1.0)


def test_oblique_symmetry_planes_close_a_surface():
    """Check a rotated quarter of a tube, whose border slides in symmetry planes.

    It has the same equilibrium and frequencies as the upright one, and a potential.
    """
    turn = Rotation.from_rotvec([0.4, -0.3, 0.7]).as_matrix()
    found = []
    for rotation in (np.eye(3), turn):
        mesh = ms.meshes.tube(1.0, 2.0, 0.5, np.pi / 2, cells=(2, 4, 1), order=2)
        upright = mesh.rest_positions[mesh.faces]
        inner = np.flatnonzero((np.hypot(*upright[..., :2].T) < 1 + 1e-9).all(axis=0))
        solid = ms.Solid(
            mesh.transformed(rotation),
            material=ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.3),
            mass_density=1.0,
        )
        planes = [ms.SymmetryPlane(rotation[:, k]) for k in range(2)]
        heights = np.unique(np.round(mesh.rest_positions[:, 2], 9))[[0, -1]]
        planes += [ms.SymmetryPlane(rotation[:, 2], point=rotation[:, 2] * z) for z in heights]
        scene = ms.Scene(solid, supports=planes, loads=[ms.Pressure(0.05, faces=inner)])
        rest = ms.equilibrium(scene)
        found.append((rest.positions @ rotation, ms.vibration_modes(scene, rest, count=3).squares))
    assert np.allclose(found[0][0], found[1][0], rtol=0, atol=1e-9)
    assert np.allclose(found[0][1], found[1][1], rtol=1e-7)


def test_warm_start_works_without_a_potential():
    scene = flap_of("linear")
    warm = ms.WarmStart(scene)
    for pressure in (15.0, 18.0, 20.0):
        rest = warm(values={scene.loads[0]: {"pressure": pressure}})
    assert rest.iterations <= 4
    assert np.allclose(rest.positions, ms.equilibrium(scene).positions, rtol=0, atol=1e-9)


def flap_of(element: str, **options) -> ms.Scene:
    """Return a scene of a bar held at one end, under a pressure on its lower side, which has no potential."""
    solid = ms.Solid(
        ms.meshes.box((10, 1, 1), cells=(6, 1, 1)),
        material=ms.NeoHookean("isochoric", young_modulus=1e5, poisson_ratio=0.4),
        element=element,
        mass_density=1.0,
    )
    below = np.flatnonzero(solid.mesh.face_barycenters[:, 2] < 1e-9)
    pin = ms.Pin(solid.mesh.vertices_at(x=0.0), **options)
    return ms.Scene(solid, supports=[pin], loads=[ms.Pressure(20.0, faces=below)])


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_equilibrium_and_gradient_without_a_potential(element):
    """Check few Newton iterations with the full stiffness, the balance of forces, and the adjoint."""
    scene = flap_of(element, displacement=(0.0, 0.0, 0.1), rotation=(0.0, 0.05, 0.0))
    rest = ms.equilibrium(scene)
    assert rest.displacements[:, 2].max() > (2.0 if element == "quadratic" else 0.1)
    assert rest.iterations <= 14
    load, pin = scene.loads[0], scene.supports[0]
    free = np.setdiff1d(np.arange(scene.mesh.n_vertices), pin.vertices)
    left = scene._model.positions(scene._model.gradient(rest._state, rest._load_parameters))[free]
    assert np.abs(left).max() < 1e-9 * np.abs(forces(scene, rest._state)).max()
    tolerance = {"solver": ms.MixedNewton(tolerance=1e-13)}

    def tip(given):
        pressure, moved, modulus = given[0], given[1:4], given[4]
        values = {
            load: {"pressure": pressure},
            pin: {"displacement": moved},
            scene.bodies[0]: {"young_modulus": modulus},
        }
        found = ms.equilibrium(scene, start=rest.positions, values=values, **tolerance)
        return found.displacements[:, 1:].sum() + (found.displacements[:, 0] ** 2).sum()

    given = torch.tensor([20.0, 0.0, 0.0, 0.1, 1e5], dtype=torch.float64, requires_grad=True)
    exact = torch.autograd.grad(tip(given), given)[0].numpy()
    for k, step in enumerate([1e-3, 1e-5, 1e-5, 1e-5, 5.0]):
        change = torch.zeros(5, dtype=torch.float64)
        change[k] = step
        found = (tip(given.detach() + change) - tip(given.detach() - change)) / (2 * step)
        assert float(found) == pytest.approx(exact[k], rel=2e-6), k


def test_linear_response_is_the_first_order_of_the_equilibrium():
    scene = flap_of("quadratic")
    response = ms.linear_response(scene, load_factor=1e-3).displacements
    rest = ms.equilibrium(scene, load_factor=1e-3).displacements
    assert np.allclose(response, rest, rtol=0, atol=5e-3 * np.abs(rest).max())


def test_pressure_in_time_as_array_as_function_and_by_load_factor_agree():
    scene = flap_of("linear")
    load, n = scene.loads[0], 5
    course = 20.0 * np.linspace(0.0, 1.0, n + 1)
    options = {"steps": n, "time_step": 2e-3, "progress": False}
    given = torch.tensor(course, requires_grad=True)
    moved = ms.simulate(scene, values={load: {"pressure": given}}, adjoint_storage="stages", **options)
    by_function = ms.simulate(scene, values={load: {"pressure": lambda t: 20.0 * t / 0.01}}, **options)
    by_factor = ms.simulate(scene, load_factor=course / 20.0, **options)
    end = moved.positions[-1].detach().numpy()
    assert np.abs(end - scene.mesh.rest_positions).max() > 1e-6
    for other in (by_function, by_factor):
        assert np.allclose(other.positions[-1], end, rtol=0, atol=1e-12)
    loss = (moved.positions[-1, :, 2] ** 2).sum()
    slope = torch.autograd.grad(loss, given)[0].numpy()
    along, step = np.random.default_rng(2).standard_normal(n + 1), 1e-2

    def at(amount):
        found = ms.simulate(scene, values={load: {"pressure": course + amount * along}}, **options)
        return float((np.asarray(found.positions[-1])[:, 2] ** 2).sum())

    assert (at(step) - at(-step)) / (2 * step) == pytest.approx(slope @ along, rel=1e-6)


def test_ring_buckles_at_levys_pressure_where_the_load_follows():
    """Compare the critical pressure of a ring with Levy (1884) and Boresi (1955).

    p = 3 E I / R^3 for a pressure that follows the ring, 4 E I / R^3 for one that keeps its direction.
    """
    mesh = ms.meshes.cylinder(1.0, 0.1, cells=(72, 2))
    x = mesh.rest_positions
    along = int(np.argmin(np.ptp(x, axis=0)))
    one, other = (k for k in range(3) if k != along)
    sheet = ms.Shell(mesh, thickness=0.02, young_modulus=1e6, poisson_ratio=0.0)
    unit = 1e6 * 0.02**3 / 12
    # The symmetry planes leave a quarter of the two waves; everything stays in the ring's plane.
    flat = {axis: np.abs(x[:, axis]) < 1e-9 for axis in (one, other)}
    supports = [
        ms.Pin(np.flatnonzero(flat[axis]), components="xyz"[along] + "xyz"[axis]) for axis in (one, other)
    ]
    supports.append(ms.Pin(np.flatnonzero(~flat[one] & ~flat[other]), components="xyz"[along]))
    outwards = np.sign(
        np.einsum("fi,fi->f", mesh.face_normals, mesh.face_barycenters - x.mean(axis=0)).mean()
    )
    found = [
        ms.linear_buckling(ms.Scene(sheet, supports=supports, loads=[load])).factors[0]
        for load in (ms.Pressure(outwards * unit), ms.AreaLoad(-outwards * unit * mesh.face_normals))
    ]
    assert found == pytest.approx([3.0, 4.0], rel=0.02)


def test_bad_pressures_are_refused():
    body = curved_block("linear")
    with pytest.raises(ValueError, match=r"pressure \[Pa\] must be a number or one a face"):
        ms.Pressure(np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"pressure \[Pa\]"):
        ms.Pressure(float("nan"))
    with pytest.raises(ValueError, match=r"must be a number or have shape \(2,\), got \(3,\)"):
        loose(body, ms.Pressure(np.ones(3), faces=[0, 1]))
    with pytest.raises(ValueError, match="Pressure faces must be in"):
        loose(body, ms.Pressure(1.0, faces=[body.mesh.n_faces]))
    scene = flap_of("linear")
    with pytest.raises(ValueError, match=r"pressure \[Pa\] must keep its shape \(\)"):
        ms.equilibrium(scene, values={scene.loads[0]: {"pressure": np.ones(12)}})
    with pytest.raises(ValueError, match="has no PointLoad, EdgeLoad or AreaLoad"):
        ms.equilibrium(scene, vertex_loads=np.zeros((scene.mesh.n_vertices, 3)))
