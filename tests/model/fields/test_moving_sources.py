"""Field sources, obstacles and supports that move in time and along a path: functions, arrays, gradients."""

import numpy as np
import pytest

import magshell as ms
from magshell import obstacles as ob

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.05, 0.02, cells=(5, 2))
N_V = MESH.n_vertices
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
CLAMP = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0))
MAGNETIZED = {"remanent_magnetization": (2e4, 0, 1e4)}
EXACT = {"solver": ms.MixedNewton(tolerance=1e-13), "progress": False}
INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]


def ends(function, steps, time_step):
    return np.array([function(k * time_step) for k in range(steps + 1)])


def swirl(x):
    return 0.01 * np.stack([np.sin(10 * x[:, 1]), 30 * x[:, 2] * x[:, 0], np.cos(10 * x[:, 0])], axis=1)


GRID = ms.SampledField.from_function(swirl, (-0.2,) * 3, (0.2,) * 3, (9, 9, 9))
PAIR = ms.Dipoles([[0.03, 0.0, 0.05], [0.02, 0.01, -0.06]], [[0.1, 0.2, 1.0], [0.0, 1.0, 0.5]])
CUBE = ms.CuboidMagnet((0.01, 0.012, 0.008), (0, 1e4, 2e5), center=(0.05, 0.01, 0.03))
DISK = ms.CylinderMagnet(0.005, 0.01, (0, 0, 3e5), center=(0.02, 0, -0.04), rotation=(0.1, 0, 0))


def positioned_field(field):
    return ms.PlacedField(field, center=(0.001, 0.002, 0.0), rotation=(0.1, 0.2, 0.0))


SOURCES = {
    "cuboid": lambda: CUBE,
    "cylinder": lambda: DISK,
    "dipoles": lambda: PAIR,
    "placed dipoles": lambda: positioned_field(PAIR),
    "placed grid": lambda: positioned_field(GRID),
    "placed function": lambda: positioned_field(ms.CustomField(swirl, length_scale=0.05)),
}


def in_field(source, **options):
    return ms.Scene(SHEET, supports=[CLAMP], field=source, **options)


def approach(t):
    return np.array([0.05 - t, 0.01 + 20 * t**2, 0.04 - 0.5 * t])


def rotation_vector(t):
    return np.array([20 * t, 5 * np.sin(40 * t), 400 * t**2])


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
def test_a_magnet_that_approaches_by_an_array_as_by_a_function(integrator):
    """Compare an array with a function of the time.

    An array is linear between the ends of steps: exact for a uniform motion, of second order for another.
    """
    scene, apart = in_field(CUBE), []
    even = {"center": lambda t: (0.05 - t, 0.01, 0.04 - t), "rotation": lambda t: (0, 30 * t, 0)}
    curved = {"center": approach, "rotation": rotation_vector}
    for path, steps in ((even, 8), (curved, 8), (curved, 16)):
        given = {"steps": steps, "time_step": 0.016 / steps, "integrator": integrator, **MAGNETIZED, **EXACT}
        sampled = {name: ends(f, steps, 0.016 / steps) for name, f in path.items()}
        called, listed = (
            ms.simulate(scene, **given, values={CUBE: each}).positions for each in (path, sampled)
        )
        apart.append(abs(called - listed).max())
    moved = abs(listed - MESH.rest_positions).max()
    assert moved > 5e-5 and apart[0] < 1e-10 * moved
    if integrator == ms.ImplicitEuler():  # which asks at the ends of steps only
        assert max(apart) < 1e-10 * moved
    else:
        assert 3.0 < apart[1] / apart[2] < 5.0 and apart[2] < 0.01 * moved


def test_rotating_source_equals_its_rotating_dipoles():
    """Compare dipoles with prescribed positions and moments with the same dipoles rotated as one field."""
    steps, time_step = 6, 2e-3
    given = {"steps": steps, "time_step": time_step, "integrator": ms.ImplicitEuler(), **MAGNETIZED, **EXACT}
    whole = ms.PlacedField(PAIR)
    path = {"center": lambda t: (t, 0.0, -t), "rotation": rotation_vector}
    moved = ms.simulate(in_field(whole), **given, values={whole: path})
    turns = [ms.obstacles.obstacle._motion.matrix(rotation_vector(k * time_step)) for k in range(steps + 1)]
    shifts = ends(path["center"], steps, time_step)
    rows = {
        "positions": np.array([PAIR.positions @ r.T + c for r, c in zip(turns, shifts, strict=True)]),
        "moments": np.array([PAIR.moments @ r.T for r in turns]),
    }
    alone = ms.simulate(in_field(PAIR), **given, values={PAIR: rows})
    assert abs(moved.displacements).max() > 1e-5
    np.testing.assert_allclose(moved.positions, alone.positions, rtol=0, atol=1e-13)


def test_source_positions_per_step_change_at_the_beginning_of_each_step():
    scene, rows = in_field(CUBE), np.array([(0.05, 0.01, z) for z in (0.04, 0.03, 0.035)])
    given = {"time_step": 2e-3, "integrator": ms.TRBDF2(), **MAGNETIZED, **EXACT}
    at_once = ms.simulate(scene, steps=3, **given, values={CUBE: {"center": rows}})
    one = ms.simulate(scene, steps=1, **given, values={CUBE: {"center": rows[0]}})
    assert np.array_equal(at_once.positions[1], one.positions[1])
    assert not np.array_equal(at_once.positions[2], ms.simulate(scene, steps=2, **given).positions[2])


def slope(loss, given, name, direction, step):
    """Compute the derivative of a loss along a direction of one input, from central differences with two steps."""
    found = []
    for size in (step, 0.5 * step):
        above, below = (float(loss({**given, name: given[name] + s * size * direction})) for s in (1, -1))
        found.append((above - below) / (2 * size))
    return (4 * found[1] - found[0]) / 3


def check_gradients(loss, given, steps):
    """Compare the gradient by each input with differences along that gradient and along noise."""
    tensors = {
        name: torch.tensor(value, dtype=torch.float64, requires_grad=True) for name, value in given.items()
    }
    loss(tensors).backward()
    rng = np.random.default_rng(4)
    for name, tensor in tensors.items():
        by = tensor.grad.numpy()
        noise = rng.standard_normal(by.shape)
        for along in (by / np.linalg.norm(by), noise / np.linalg.norm(noise)):
            exact = float((by * along).sum())
            assert slope(loss, given, name, along, steps[name]) == pytest.approx(
                exact, rel=1e-6, abs=1e-6 * np.linalg.norm(by)
            ), name


STEPS = {"center": 3e-7, "rotation": 1e-4, "positions": 3e-6, "moments": 1e-3, "remanent_magnetization": 1e2}


@pytest.mark.parametrize("name", SOURCES)
def test_gradient_by_the_path_of_a_source(name):
    source, steps = SOURCES[name](), 4
    scene, rng = in_field(source), np.random.default_rng(2)
    size = {"center": 1e-3, "rotation": 0.1, "positions": 1e-3, "moments": 0.1, "remanent_magnetization": 1e4}
    given = {
        each: np.asarray(getattr(source, each))
        + size[each] * rng.standard_normal((steps + 1, *np.shape(getattr(source, each))))
        for each in type(source)._in_time
    }
    weights = torch.tensor(1e3 * rng.standard_normal((steps + 1, N_V, 3)))

    def loss(values):
        move = ms.simulate(scene, steps=steps, time_step=2e-3, values={source: values}, **MAGNETIZED, **EXACT)
        return (weights * torch.as_tensor(move.displacements)).sum()

    differences = {"placed function": 30.0, "placed grid": 10.0}.get(name, 3.0)
    check_gradients(loss, given, {each: differences * STEPS[each] for each in given})


def sliding(t):
    return np.array([2 * t**2, 0.01 * np.sin(40 * t), -0.0505 + 1e-4 * np.sin(50 * t)])


def rocking(t):
    return np.array([0.02 * np.sin(30 * t), 0.01 * np.sin(20 * t), 2 * np.sin(10 * t)])


def on_a_block(**contact):
    """Return a block and a scene of a sheet that lies on it and is moved by its friction."""
    block = ob.Box((0.2, 0.2, 0.1), rounding=0.01, center=(0, 0, -0.0505))
    law = {"friction_coefficient": 0.5, "offset": 1e-4, "contact_stiffness": 50.0, **contact}
    touching = ms.Contact(block, **law)
    return block, ms.Scene(SHEET, contacts=[touching], gravity=(0, 0, -9.81), allow_rigid_motions=True)


@pytest.mark.parametrize("integrator", INTEGRATORS[:2], ids=repr)
@pytest.mark.parametrize("lagged", [False, True])
def test_an_obstacle_by_an_array_tends_to_one_by_a_function_with_second_order(integrator, lagged):
    block, scene = on_a_block(lagged_friction=lagged)
    path, apart = {"center": sliding, "rotation": rocking}, []
    for steps in (10, 20):
        given = {"steps": steps, "time_step": 0.02 / steps, "integrator": integrator, **EXACT}
        sampled = {name: ends(f, steps, 0.02 / steps) for name, f in path.items()}
        called, listed = (ms.simulate(scene, **given, values={block: each}) for each in (path, sampled))
        apart.append(abs(called.positions - listed.positions)[-1].max())
    moved = abs(listed.displacements[-1]).max()
    assert moved > 5e-4 and 3.0 < apart[0] / apart[1] < 5.5 and apart[1] < 1e-3 * moved


def test_an_obstacle_that_moves_by_a_value_moves_as_by_its_motion():
    motion = lambda t: (sliding(t) - sliding(0), rocking(t))  # noqa: E731
    block, scene = on_a_block()
    contact = scene.contacts[0]
    own = ob.Box((0.2, 0.2, 0.1), rounding=0.01, center=(0, 0, -0.0505), motion=motion)
    rubbing = ms.Contact(own, friction_coefficient=0.5, offset=1e-4, contact_stiffness=50.0)
    other = ms.Scene(SHEET, contacts=[rubbing], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    given = {"steps": 8, "time_step": 2e-3, **EXACT}
    by_value = ms.simulate(scene, values={block: {"center": sliding, "rotation": rocking}}, **given)
    by_motion = ms.simulate(other, **given)
    np.testing.assert_allclose(by_value.positions, by_motion.positions, rtol=0, atol=1e-11)
    assert contact.obstacles == (block,) and block.motion is None


def test_sheet_on_a_belt_moves_at_the_speed_of_the_belt():
    block, scene = on_a_block()
    speed, steps, time_step = 0.02, 60, 1e-3
    path = ends(lambda t: (speed * t, 0.0, -0.0505), steps, time_step)
    move = ms.simulate(scene, steps=steps, time_step=time_step, values={block: {"center": path}}, **EXACT)
    assert move.velocities[-1, :, 0] == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
@pytest.mark.parametrize("lagged", [False, True])
def test_gradient_by_the_path_of_an_obstacle_with_friction(integrator, lagged):
    block, scene = on_a_block(lagged_friction=lagged)
    steps, time_step = 5, 2e-3
    weights = torch.tensor(1e3 * np.random.default_rng(5).standard_normal((steps + 1, N_V, 3)))
    given = {
        "center": ends(sliding, steps, time_step),
        "rotation": ends(rocking, steps, time_step),
        "time_step": time_step,
    }

    def loss(given):
        place = {name: given[name] for name in ("center", "rotation")}
        motion = {"steps": steps, "time_step": given["time_step"], "integrator": integrator}
        move = ms.simulate(scene, **motion, values={block: place}, **EXACT)
        return (weights * torch.as_tensor(move.displacements)).sum()

    check_gradients(loss, given, {"center": 1e-8, "rotation": 1e-6, "time_step": 1e-7})


def test_functions_of_torch_have_gradients_by_their_tensors():
    block, scene = on_a_block()

    def loss(given):
        speed, time_step = given["speed"], given["time_step"]
        center = lambda t: torch.stack([speed * t, 0.0 * t, -0.0505 + 1e-4 * torch.sin(50 * t)])  # noqa: E731
        numbers = lambda t: [float(speed) * t, 0.0, -0.0505 + 1e-4 * np.sin(50 * t)]  # noqa: E731
        values = {block: {"center": center if torch.is_tensor(speed) else numbers}}
        move = ms.simulate(scene, steps=5, time_step=time_step, values=values, **EXACT)
        return 1e3 * torch.as_tensor(move.displacements)[-1, :, 0].sum()

    check_gradients(
        loss, {"speed": np.array(0.05), "time_step": np.array(2e-3)}, {"speed": 1e-4, "time_step": 1e-7}
    )


def test_a_function_that_torch_cannot_follow_has_no_gradient_by_the_time_step():
    block, scene = on_a_block()
    time_step = torch.tensor(2e-3, dtype=torch.float64, requires_grad=True)
    values = {block: {"center": lambda t: sliding(float(t.detach()))}}
    move = ms.simulate(scene, steps=2, time_step=time_step, values=values, **EXACT)
    with pytest.raises(ms.NoGradient, match=r"by time_step: .*center is a function of the time"):
        move.positions.sum().backward()


def test_a_support_by_an_array_is_its_displacement_times_the_motion_factor():
    steps, far = 6, np.array((1e-3, 2e-3, 4e-3))
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=far, rotation=(0.0, 0.2, 0.0))
    scene = ms.Scene(SHEET, supports=[clamp], gravity=(0, 0, -9.81))
    factor = np.linspace(0, 1, steps + 1) ** 2
    given = {"steps": steps, "time_step": 2e-3, **EXACT}
    short = ms.simulate(scene, **given, support_factor=factor)
    rows = {"displacement": factor[:, None] * far, "rotation": factor[:, None] * (0.0, 0.2, 0.0)}
    by_values = ms.simulate(scene, **given, values={clamp: rows})
    np.testing.assert_allclose(by_values.positions, short.positions, rtol=0, atol=1e-13)
    called = {name: (lambda t, row=row: row[round(t / 2e-3)]) for name, row in rows.items()}
    by_function = ms.simulate(scene, **given, integrator=ms.ImplicitEuler(), values={clamp: called})
    euler = ms.simulate(scene, **given, integrator=ms.ImplicitEuler(), values={clamp: rows})
    assert np.array_equal(by_function.positions, euler.positions)


@pytest.mark.parametrize("integrator", INTEGRATORS[1:], ids=repr)
def test_gradient_by_the_path_of_a_support(integrator):
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0), rotation=(0, 0, 0))
    pin = ms.Pin(MESH.vertices_at(x=0.05), "z", displacement=(0, 0, 0))
    scene = ms.Scene(SHEET, supports=[clamp, pin], gravity=(0, 0, -9.81))
    steps, rng = 4, np.random.default_rng(6)
    weights = torch.tensor(1e3 * rng.standard_normal((steps + 1, N_V, 3)))
    ramp = np.linspace(0, 1, steps + 1)[:, None]
    size = {"displacement": 2e-4, "rotation": 0.02, "center": 1e-3}
    given = {name: s * ramp * rng.standard_normal((steps + 1, 3)) for name, s in size.items()}

    def loss(given):
        along = (0.0, 0.0, 0.5)
        lifted = given["displacement"] * (
            torch.tensor(along) if torch.is_tensor(given["rotation"]) else along
        )
        lift = {"displacement": lifted}
        motion = {"steps": steps, "time_step": 2e-3, "integrator": integrator, **EXACT}
        move = ms.simulate(scene, **motion, values={clamp: given, pin: lift})
        assert not move.substeps
        return (weights * torch.as_tensor(move.displacements)).sum()

    check_gradients(loss, given, {"displacement": 1e-6, "rotation": 1e-4, "center": 1e-5})


def test_all_that_moves_at_once_from_checkpoints():
    """Check that the gradient has the same bits however little of a motion is stored.

    A solve afterwards finds the scene unchanged.
    """
    block, _ = on_a_block()
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0))
    scene = ms.Scene(
        SHEET,
        supports=[clamp],
        field=[CUBE, PAIR],
        contacts=[ms.Contact(block, offset=1e-3, contact_stiffness=50.0, friction_coefficient=0.3)],
    )
    steps = 12
    path = {"center": ends(sliding, steps, 2e-3), "rotation": ends(rocking, steps, 2e-3)}
    before = ms.equilibrium(ms.Scene(SHEET, supports=[clamp], field=[CUBE, PAIR]), **MAGNETIZED).positions
    alone = ms.Scene(SHEET, supports=[clamp], field=[CUBE, PAIR])
    found = []
    for kept in (
        {"adjoint_storage": "stages"},
        {"adjoint_storage": "factors"},
        {"adjoint_storage": ms.AdjointStorage("checkpoints", memory_budget=3e4)},
    ):
        magnet = torch.tensor(ends(approach, steps, 2e-3), requires_grad=True)
        lift = torch.tensor(1e-4 * np.arange(steps + 1)[:, None] * np.ones(3), requires_grad=True)
        values = {block: path, CUBE: {"center": magnet}, clamp: {"displacement": lift}}
        move = ms.simulate(scene, steps=steps, time_step=2e-3, values=values, **kept, **MAGNETIZED, **EXACT)
        found.append(torch.autograd.grad((move.positions**2).sum(), (magnet, lift)))
    for other in found[1:]:
        for a, b in zip(found[0], other, strict=True):
            torch.testing.assert_close(a, b, rtol=1e-9, atol=1e-9 * float(a.abs().max()))
    assert all(torch.equal(a, b) for a, b in zip(found[0], found[2], strict=True))
    given = {"steps": 3, "time_step": 2e-3, **MAGNETIZED, **EXACT}
    ms.simulate(
        alone, **given, values={CUBE: {"center": approach}, clamp: {"displacement": lambda t: (0, 0, t)}}
    )
    assert np.array_equal(ms.equilibrium(alone, **MAGNETIZED).positions, before)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning", "ignore::magshell.StepErrorWarning")
def test_gradients_through_a_step_that_was_taken_in_parts():
    """Check gradients by prescribed motions that are evaluated within a subdivided step."""
    ball, steps, time_step = ob.Sphere(0.004, center=(0.03, 0.01, -0.03)), 5, 1e-3
    hits = ms.Contact(ball, contact_stiffness=200.0, friction_coefficient=0.3)
    scene = ms.Scene(SHEET, supports=[CLAMP], field=PAIR, contacts=[hits])
    weights = torch.tensor(1e3 * np.random.default_rng(0).standard_normal((N_V, 3)))
    given = {
        "ball": ends(lambda t: (0.03, 0.01, -0.03 + 6 * t), steps, time_step),
        "lift": ends(lambda t: (0, 0, 0.3 * t), steps, time_step),
    }

    def loss(given):
        values = {
            ball: {"center": given["ball"]},
            CLAMP: {"displacement": given["lift"]},
            PAIR: {"positions": lambda t: PAIR.positions + approach(t) - approach(0.0)},
        }
        move = ms.simulate(scene, steps=steps, time_step=time_step, values=values, **MAGNETIZED, **EXACT)
        assert move.substeps
        return (weights * torch.as_tensor(move.displacements)[-1]).sum()

    check_gradients(loss, given, {"ball": 1e-8, "lift": 1e-8})


def test_motion_in_two_parts_continues_with_functions_of_the_time():
    scene, given = in_field(CUBE), {"time_step": 2e-3, **MAGNETIZED, **EXACT}
    values = {CUBE: {"center": approach, "rotation": rotation_vector}}
    whole = ms.simulate(scene, steps=6, values=values, **given)
    first = ms.simulate(scene, steps=2, values=values, **given)
    second = ms.simulate(scene, steps=4, start=first, values=values, **given)
    assert np.array_equal(second.positions, whole.positions[2:])


def test_trajectory_stores_the_positions_of_its_obstacles():
    ball = ob.Sphere(0.02, center=(0.025, 0.01, -0.021))
    scene = ms.Scene(SHEET, supports=[CLAMP], contacts=[ms.Contact(ball)])
    path = ends(lambda t: (0.025, 0.01, -0.021 + t), 4, 1e-3)
    move = ms.simulate(scene, steps=4, time_step=1e-3, values={ball: {"center": path}}, **EXACT)
    (there,) = move._obstacles
    np.testing.assert_allclose(there.signed_distance((0.025, 0.01, 0.0), 4e-3), -0.003, atol=1e-15)
    np.testing.assert_allclose(there.signed_distance((0.025, 0.01, 0.0), 2.5e-3), -0.0015, atol=1e-15)
