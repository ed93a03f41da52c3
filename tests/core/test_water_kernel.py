"""Drag, thrust and viscous drag on single faces: against published numbers, a second formula, and differences.

[Chen22] (42)-(44). Added mass: test_added_mass_kernel.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell import _core

RHO = 1000.0  # kg/m3

# phi [deg], C of [Chen22] (44), drag and thrust over rho A |v|^2, then C_d and C_t of DiffPD.
# C_d and C_t: python/example/starfish_ada.py of github.com/mit-gfx/diff_pd_public @1594aa07, cubic Bezier curves of phi.
# Min et al., ACM TOG 38(6) 208, 2019, have C_d = sin^2, half of (44): github.com/seiing/SoftCon @7856692e.
G1 = np.array(
    [
        (0, 0.0, 0.0, 0.0, 0.05, 0.06250000000000003),
        (10, 0.06030737921409161, 0.030153689607045803, 0.030153689607045803, 0.11200274348422495, 0.23497942386831286),
        (15, 0.13397459621556132, 0.06698729810778066, 0.06698729810778066, 0.18425925925925926, 0.3289930555555557),
        (30, 0.4999999999999999, 0.24999999999999994, 0.24999999999999994, 0.524074074074074, 0.6444444444444443),
        (45, 0.9999999999999998, 0.4999999999999999, 0.4999999999999999, 0.9750000000000001, 1.0140625),
        (60, 1.4999999999999998, 0.7499999999999999, 0.7499999999999999, 1.4425925925925922, 1.4430555555555549),
        (80, 1.9396926207859082, 0.9698463103929541, 0.9698463103929541, 1.9287379972565155, 2.116409465020576),
        (90, 2.0, 1.0, 1.0, 2.05, 2.5),
    ]
)  # fmt: skip
G1_ANGLES = np.deg2rad(G1[:, 0])


def bezier(t, controls):
    a, b, c, d = controls
    return (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d


def diffpd_drag(phi):
    return bezier(phi / (np.pi / 2), (0.05, 0.05, 1.85, 2.05))


def diffpd_thrust(phi):
    return bezier(phi / np.pi + 0.5, (-0.8, -0.5, 0.1, 2.5))


UNEVEN = np.pi / 2 * np.array([0.0, 0.1, 0.35, 0.4, 0.75, 1.0])
DIFFPD = {"attack_table": (UNEVEN, diffpd_drag(UNEVEN)), "thrust_table": (UNEVEN, diffpd_thrust(UNEVEN))}
SINES = np.linspace(0, np.pi / 2, 9)
WATERS = {
    "as printed": {},
    "DiffPD": DIFFPD,
    "a smooth table": {"attack_table": (SINES, 1.5 * np.sin(SINES) ** 2, (0, 0))},
}
waters = pytest.mark.parametrize("tables", WATERS.values(), ids=WATERS)


def make(tables=None, **changes):
    values = {
        "velocity": (0.3, -0.2, 0.4),
        "drag_coefficient": 0.7,
        "thrust_coefficient": 1.3,
        "normal_viscous_drag": 400.0,
        "tangential_viscous_drag": 150.0,
    }
    return ms.Water(**{"fluid_density": RHO, **values, **(tables or {}), **changes})


def random_faces(rng, count=40):
    """Return corners of centimetres and velocities of order one, each (n, 3, 3)."""
    return 0.01 * rng.standard_normal((count, 3, 3)), rng.standard_normal((count, 3, 3))


def areas(x):
    return 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)


def kernel(water, x, v):
    return _core.drag_faces(water._core, x, v)


def close(actual, expected, tolerance):
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * np.abs(expected).max())


# A face in the plane z = 0 and the flow that meets it at phi; the normal (0, 0, 1) or (0, 0, -1) by its orientation.
FACE = np.array([[0.1, 0, 0], [0.5, 0.1, 0], [0.2, 0.3, 0]])
AREA, SPEED = 0.055, 1.7
FACES = {"against the flow": FACE, "turned round": FACE[::-1]}
orientations = pytest.mark.parametrize("face", FACES.values(), ids=FACES)


def forces_at(angles, face, **water):
    """Return drag and thrust over 1/2 rho A |v|^2, along the flow and against it along the normal."""
    flow = SPEED * np.stack([np.cos(angles), 0 * angles, -np.sin(angles)], axis=1)
    x = np.broadcast_to(face, (len(angles), 3, 3))
    v = np.broadcast_to(-flow[:, None], x.shape)  # the water is at rest
    unit = 0.5 * RHO * AREA * SPEED**2
    drag = ms.Water(drag_coefficient=1, thrust_coefficient=0, **water).force(x, v)
    thrust = ms.Water(drag_coefficient=0, thrust_coefficient=1, **water).force(x, v)
    both = ms.Water(drag_coefficient=1, thrust_coefficient=1, **water).force(x, v)
    np.testing.assert_allclose(both, drag + thrust, rtol=0, atol=1e-12 * unit)
    np.testing.assert_allclose(np.cross(drag, flow), 0, rtol=0, atol=1e-12 * unit)
    assert (thrust[:, :2] == 0).all()
    return (drag * flow).sum(axis=1) / SPEED / unit, -thrust[:, 2] / unit


@orientations
def test_drag_and_thrust_have_the_published_values(face):
    drag, thrust = forces_at(G1_ANGLES, face)
    np.testing.assert_allclose(drag, 2 * G1[:, 2], rtol=0, atol=1e-12)
    np.testing.assert_allclose(thrust, 2 * G1[:, 3], rtol=0, atol=1e-12)
    published = ms.Water(drag_coefficient=1, thrust_coefficient=1)
    np.testing.assert_allclose(published.coefficients(G1_ANGLES), [G1[:, 1]] * 2, rtol=0, atol=1e-12)


@orientations
def test_diffpd_tables_give_the_published_values(face):
    drag, thrust = forces_at(G1_ANGLES, face, **DIFFPD)
    np.testing.assert_allclose(drag, G1[:, 4], rtol=0, atol=1e-12)
    np.testing.assert_allclose(thrust[1:], G1[1:, 5], rtol=0, atol=1e-12)
    assert thrust[0] == 0  # the thrust jumps from one side to the other; its mean is taken
    water = ms.Water(drag_coefficient=1, thrust_coefficient=1, **DIFFPD)
    np.testing.assert_allclose(water.coefficients(G1_ANGLES), G1[:, 4:].T, rtol=0, atol=1e-12)


def test_half_the_drag_is_that_of_softcon():
    table = (G1_ANGLES, np.sin(G1_ANGLES) ** 2)
    by_factor = ms.Water(drag_coefficient=0.5)
    by_table = ms.Water(drag_coefficient=1, attack_table=table)
    softcon = [0.0, 0.030153689607045786, 0.06698729810778065, 0.24999999999999994]
    softcon += [0.49999999999999994, 0.7499999999999999, 0.9698463103929542, 1.0]
    for water in (by_factor, by_table):
        np.testing.assert_allclose(water.coefficients(G1_ANGLES)[0], softcon, rtol=0, atol=1e-12)


@orientations
def test_face_on_is_twice_rho_a_v2(face):
    """Check both orientations: with oriented faces one of the two would have no force."""
    drag, thrust = forces_at(np.array([np.pi / 2]), face)
    assert drag + thrust == pytest.approx(4.0, rel=1e-14)


@orientations
def test_default_is_the_pressure_on_a_square_plate(face):
    """Compare with C = 1.18 of White's table 7.3, along the normal and by the velocity across the plate alone."""
    flow = SPEED * np.array([np.cos(0.7), 0.0, -np.sin(0.7)])
    force = ms.Water().force(face[None], np.broadcast_to(-flow, (1, 3, 3)))
    pressure = 0.5 * RHO * 1.18 * flow[2] ** 2
    np.testing.assert_allclose(force, [[0, 0, -pressure * AREA]], rtol=1e-14, atol=1e-15)


@waters
def test_forces_do_not_depend_on_the_orientation_of_faces(tables, rng):
    x, v = random_faces(rng)
    ours, turned = (kernel(make(tables), x[:, i], v[:, i]) for i in ([0, 1, 2], [2, 1, 0]))
    close(turned["corner_force"], ours["corner_force"], 1e-14)
    close(turned["by_position"][:, ::-1], ours["by_position"], 1e-14)
    close(turned["by_velocity"], ours["by_velocity"], 1e-14)


@waters
def test_a_turned_or_mirrored_world(tables, rng):
    x, v = random_faces(rng)
    velocity = rng.standard_normal(3)
    ours = make(tables, velocity=velocity).force(x, v)
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    for turned in (turn, turn @ np.diag([1, 1, -1])):
        theirs = make(tables, velocity=turned @ velocity).force(x @ turned.T, v @ turned.T)
        close(theirs, ours @ turned.T, 1e-13)


def test_a_moving_frame(rng):
    x, v = random_faces(rng)
    drift = np.array([1.0, 2.0, -3.0])
    ours, theirs = make(), make(velocity=make().velocity + drift)
    close(theirs.force(x + drift, v + drift), ours.force(x, v), 1e-13)


@waters
def test_drag_dissipates_energy(tables, rng):
    x, v = random_faces(rng)
    still = make(tables, velocity=(0, 0, 0))
    assert ((still.force(x, v) * v.mean(axis=1)).sum(axis=1) < 0).all()


@waters
def test_faces_moving_with_the_water_have_no_force(tables, rng):
    x, _ = random_faces(rng)
    water = make(tables)
    found = kernel(water, x, np.broadcast_to(water.velocity, x.shape))
    for name in ("corner_force", "by_position"):
        assert not found[name].any(), name
    turbulent = make(tables, normal_viscous_drag=0, tangential_viscous_drag=0)
    assert not kernel(turbulent, x, np.broadcast_to(water.velocity, x.shape))["by_velocity"].any()


@waters
@pytest.mark.parametrize("speed", [0.0, 1e-320, 1e-200, 1e-160, 1e-20])
@pytest.mark.parametrize("size", [0.0, 1e-200, 1e-100, 1e-20])
def test_no_nan_at_rest_or_without_area(tables, speed, size, rng):
    x, v = random_faces(rng)
    arguments = (size * x, speed * v)
    water = make(tables, velocity=(0, 0, 0), normal_viscous_drag=0, tangential_viscous_drag=0)
    for values in kernel(water, *arguments).values():
        assert np.isfinite(values).all() and np.abs(values).max() < 1e-15
    water = make(tables, velocity=(0, 0, 0))
    for values in kernel(water, *arguments).values():
        assert np.isfinite(values).all()
    for values in _core.drag_gradients(water._core, *arguments, np.ones((len(x), 3))).values():
        assert np.isfinite(values).all()


@waters
@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-17, 1e-9, 0.5 * np.pi - 1e-9, 0.5 * np.pi])
def test_no_nan_along_or_head_on(tables, angle):
    flow = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    found = kernel(make(tables, velocity=flow), FACE[None], np.zeros((1, 3, 3)))
    for values in found.values():
        assert np.isfinite(values).all() and np.abs(values).max() < 1e4


def test_a_smooth_table_is_differentiable_head_on():
    """Check that the Jacobian head on is the limit of those around it from every side."""
    water = make(WATERS["a smooth table"], velocity=(0, 0, 0))

    def jacobian(tilt, heading):
        flow = [np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), np.cos(tilt)]
        found = kernel(water, FACE[None], np.broadcast_to(flow, (1, 3, 3)))
        return np.concatenate([found["by_position"].ravel(), found["by_velocity"].ravel()])

    head_on = jacobian(0.0, 0.0)
    for heading in np.linspace(0, 2 * np.pi, 7):
        close(jacobian(1e-7, heading), head_on, 1e-6)
        close(jacobian(1e-12, heading), head_on, 1e-11)


def packed(x, v):
    """Return positions (9) and mean velocity (3) of each face as rows (n, 12)."""
    return np.concatenate([x.reshape(-1, 9), v.mean(axis=1)], axis=1)


def jacobian_of(water, x, v):
    """Return the Jacobian of the force on each face by the variables of `packed`, (n, 3, 12)."""
    found = kernel(water, x, v)
    by_position = found["by_position"].transpose(0, 2, 1, 3).reshape(-1, 3, 9)
    return 3 * np.concatenate([by_position, found["by_velocity"]], axis=2)


def force_of(water, z):
    x = z[:, :9].reshape(-1, 3, 3)
    return water.force(x, np.broadcast_to(z[:, None, 9:], x.shape))


@waters
def test_jacobians_against_differences(tables, rng):
    """Compare along every direction and along the one in which each component changes most."""
    faces = random_faces(rng, 20)
    water, z, jacobian = make(tables), packed(*faces), jacobian_of(make(tables), *faces)
    scale = np.repeat([0.01, 1.0], [9, 3])  # of positions, velocities
    steepest = jacobian * scale / np.linalg.norm(jacobian * scale, axis=2, keepdims=True)
    directions = [np.broadcast_to(unit, z.shape) for unit in np.eye(12)] + list(steepest.transpose(1, 0, 2))
    for direction in directions:
        step = 1e-6 * scale * direction
        difference = (force_of(water, z + step) - force_of(water, z - step)) / 2e-6
        close(np.einsum("fij,fj->fi", jacobian, scale * direction), difference, 1e-7)


@waters
def test_gradients_against_differences(tables, rng):
    faces, multipliers = random_faces(rng, 20), rng.standard_normal((20, 3))
    water = make(tables)
    gradient = _core.drag_gradients(water._core, *faces, multipliers)
    for name in gradient:
        value = np.atleast_1d(getattr(water, name))
        for k in range(len(value)):
            step = np.zeros(len(value))
            step[k] = 1e-6 * max(1.0, abs(value[k]))
            ahead, behind = (
                water.replaced(**{name: moved if len(moved) == 3 else moved[0]}).force(*faces)
                for moved in (value + step, value - step)
            )
            difference = (multipliers * (ahead - behind)).sum(axis=1) / (2 * step[k])
            close(gradient[name].reshape(20, -1)[:, k], difference, 2e-7)


def formula(x, v, rho, velocity, drag_coefficient, thrust_coefficient, normal, tangential, c_drag, c_thrust):
    """Compute [Chen22] (42)-(44) for one face as printed, in torch, and viscous drag; c_... are functions of phi.

    The normal n is turned against the flow.
    """
    import torch

    across = torch.linalg.cross(x[1] - x[0], x[2] - x[0])
    area, n = 0.5 * torch.linalg.norm(across), across / torch.linalg.norm(across)
    flow = velocity - v
    n = n if n @ flow <= 0 else -n
    speed = torch.linalg.norm(flow)
    d = flow / speed
    phi = torch.abs(torch.pi / 2 - torch.acos(n @ d))
    drag = 0.5 * rho * area * drag_coefficient * c_drag(phi) * speed**2 * d
    thrust = -0.5 * rho * area * thrust_coefficient * c_thrust(phi) * speed**2 * n
    across = (n @ flow) * n
    return drag + thrust + area * (normal * across + tangential * (flow - across))


@pytest.mark.parametrize("name", ["as printed", "DiffPD"])
def test_a_second_formula(name, rng):
    torch = pytest.importorskip("torch")
    curves = (diffpd_drag, diffpd_thrust) if name == "DiffPD" else [lambda phi: 2 * torch.sin(phi) ** 2] * 2
    water, faces = make(WATERS[name]), random_faces(rng, 12)
    multipliers = rng.standard_normal((12, 3))
    force, jacobian = water.force(*faces), jacobian_of(water, *faces)
    gradient = _core.drag_gradients(water._core, *faces, multipliers)
    names = tuple(name for name in ms.Water._replaceable if name != "added_mass")
    assert set(names) == set(gradient)
    numbers = tuple(torch.tensor(getattr(water, name), dtype=torch.float64) for name in names)
    for f, z in enumerate(torch.tensor(packed(*faces))):

        def by_motion(z):
            return formula(z[:9].reshape(3, 3), z[9:], *numbers, *curves)

        def by_water(*values, z=z, f=f):
            x, v = z[:9].reshape(3, 3), z[9:]
            return torch.tensor(multipliers[f]) @ formula(x, v, *values, *curves)

        close(force[f], by_motion(z).numpy(), 1e-12)
        close(jacobian[f], torch.autograd.functional.jacobian(by_motion, z).numpy(), 1e-11)
        for name, expected in zip(names, torch.autograd.functional.jacobian(by_water, numbers), strict=True):
            np.testing.assert_allclose(
                gradient[name][f], expected.numpy(), rtol=1e-10, atol=1e-12, err_msg=name
            )


def test_a_plate_that_falls():
    """Compare with v_T tanh(t / T) of the docstring, with a heavy added mass and coefficients of a table."""
    areal_mass, gravity, added_mass = 1.2, 9.81, 0.8
    water = ms.Water(drag_coefficient=0.6, thrust_coefficient=1.0, added_mass=added_mass, **DIFFPD)
    c_d, c_t = (float(c) for c in water.coefficients(np.pi / 2))
    terminal = np.sqrt(2 * areal_mass * gravity / (RHO * (c_d + c_t)))
    time = terminal * (areal_mass + added_mass) / (areal_mass * gravity)

    def acceleration(_, velocity):
        """Compute the acceleration from the kernel's force, which is linear in it."""
        v = np.broadcast_to([0, 0, velocity[0]], (1, 3, 3))
        at_rest, moved = (
            water.force(FACE[None], v, np.broadcast_to([0, 0, w], (1, 3, 3)))[0, 2] for w in (0.0, 1.0)
        )
        return [(at_rest - areal_mass * AREA * gravity) / (areal_mass * AREA - (moved - at_rest))]

    times = time * np.array([0.1, 0.5, 1.0, 2.0, 8.0])
    fall = solve_ivp(acceleration, (0, times[-1]), [0.0], t_eval=times, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(-fall.y[0], terminal * np.tanh(times / time), rtol=1e-8)
