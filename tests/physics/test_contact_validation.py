"""Contact against exact and published numbers: F1a, F2a, F3a, F4 and I3 of the validation set."""

import numpy as np
import pytest
import torch

import magshell as ms

GRAVITY = 9.81
RIGID = {"thickness": 1e-3, "young_modulus": 1e9, "mass_density": 1e3}


def everywhere(body) -> np.ndarray:
    return np.arange(body.mesh.n_vertices)


def flat(side, at=(0.0, 0.0, 0.0), cells=1, **given) -> ms.Shell:
    """Build a square around `at`, to be held: a floor."""
    mesh = ms.meshes.rectangle(side, side, cells=(cells, cells))
    return ms.Shell(
        mesh.transformed(translation=np.asarray(at) - (side / 2, side / 2, 0.0)), **{**RIGID, **given}
    )


def held(body, **moved) -> ms.Pin:
    return ms.Pin(everywhere(body), body=body, **moved)


# F1a: force / (E R^2) on a ball of NeoHookean("isochoric"), nu = 0.45, when each plate has advanced by delta / R.
# Axisymmetric Taylor-Hood elements; a finer mesh changes the force by 0.14 %.
SQUEEZED = {0.05: 0.02058275337, 0.1: 0.06157763805, 0.3: 0.4067555698}


def octant(cells: int) -> ms.TetMesh:
    """Build an eighth of the unit ball, of ten nodes, from a cube; cells are smaller towards the z axis."""
    cube = ms.meshes.box((1, 1, 1), cells=(cells, cells, cells), diagonals="aligned")
    x = cube.rest_positions.copy()
    x[:, :2] **= 2.2
    x *= (np.abs(x).max(axis=1) / np.maximum(np.linalg.norm(x, axis=1), 1e-300))[:, None]
    mesh = ms.TetMesh(x, cube.tetrahedra).second_order()
    x, r = mesh.rest_positions.copy(), np.linalg.norm(mesh.rest_positions, axis=1)
    x[r > 0.95] /= r[r > 0.95, None]  # the middle nodes on the surface
    return ms.TetMesh(x, mesh.tetrahedra)


def squeeze_force(cells: int, advance: float, reach=1e-3) -> float:
    """Return the force on a ball of radius 1 and modulus 1; the gap between ball and plate counts as ball."""
    mesh = octant(cells)
    ball = ms.Solid(mesh, material=ms.NeoHookean("isochoric", young_modulus=1.0, poisson_ratio=0.45))
    plate = flat(3.0, (0.1, 0.2, 1 + reach))
    touch = ms.Contact(plate, ball, min_distance=0.0, activation_distance=reach, contact_stiffness=1.0)
    mirrors = [ms.Pin(mesh.vertices_at(**{axis: 0.0}), axis, body=ball) for axis in "xyz"]
    down = held(plate, displacement=(0, 0, -advance - 0.3 * reach))
    found = ms.equilibrium(ms.Scene([plate, ball], supports=[down, *mirrors], contacts=[touch]))
    return 4 * found.contact_state(touch).forces[: plate.mesh.n_vertices, 2].sum()


@pytest.mark.parametrize("advance, cells", [(0.05, 6), (0.1, 6), (0.3, 6)])
def test_ball_between_plates(advance, cells):
    """Check case F1a: 2 % on a surface of size R / 20, which the mesh of six cells has at the pole."""
    assert squeeze_force(cells, advance) == pytest.approx(SQUEEZED[advance], rel=0.02)


# F2a and I3: a bar of nu = 0, linear in all but 0.3 % and 1.6 %.
BAR = {"young_modulus": 1e6, "poisson_ratio": 0.0}
LENGTH, SIDE, SOUND = 1.0, 0.05, np.sqrt(1e6 / 1e3)  # m, m, m/s
UPRIGHT = np.array([[0, 0, 1.0], [0, 1.0, 0], [-1.0, 0, 0]])  # turns z to x


def bar_and_wall(cells, gap, reach):
    """Build the bar along x, a gap behind a wall at x = 0."""
    mesh = ms.meshes.box((LENGTH, SIDE, SIDE), cells=(cells, 1, 1))
    mesh = mesh.transformed(translation=(gap, -SIDE / 2, -SIDE / 2))
    bar = ms.Solid(mesh, material=ms.NeoHookean(**BAR), mass_density=1e3, element="linear")
    wall = ms.Shell(flat(0.2).mesh.transformed(rotation=UPRIGHT), **RIGID)
    touch = ms.Contact(wall, bar, min_distance=0.0, activation_distance=reach)
    scene = ms.Scene([wall, bar], supports=[held(wall)], contacts=[touch], allow_rigid_motions=True)
    forwards = np.zeros((scene.mesh.n_vertices, 3))
    forwards[wall.mesh.n_vertices :, 0] = -1.0
    return scene, bar, touch, forwards


@pytest.mark.parametrize("cells, restitution", [(25, 0.94), (100, 0.98)])
def test_bar_against_a_wall(cells, restitution):
    """Check contact for 2 L / c under the stress rho c v, whatever the time step; shorter waves are damped."""
    speed, reach = 0.1, 1e-4
    scene, bar, touch, forwards = bar_and_wall(cells, 2 * reach, reach)
    time_step = LENGTH / SOUND / cells
    steps = round(2.3 * LENGTH / SOUND / time_step)
    move = ms.simulate(
        scene,
        steps=steps,
        time_step=time_step,
        velocities=speed * forwards,
        integrator=ms.TRBDF2(),
        progress=False,
    )
    of_wall = slice(0, scene.bodies[0].mesh.n_vertices)
    forces = np.array([-move.contact_state(touch, k).forces[of_wall, 0].sum() for k in range(len(move))])
    impulse, stress = forces.sum() * time_step, 1e3 * SOUND * speed
    pressed = forces > 0.05 * forces.max()
    assert pressed.sum() * time_step == pytest.approx(2 * LENGTH / SOUND, rel=0.02, abs=2 * time_step)
    assert np.median(forces[pressed]) / SIDE**2 == pytest.approx(stress, rel=0.02)
    mass = bar.vertex_masses
    rebound = mass @ move[bar].velocities[-1][:, 0] / mass.sum() / speed
    assert restitution < rebound < 1.0
    assert impulse == pytest.approx(mass.sum() * speed * (1 + rebound), rel=0.02)


def center_after_impact(cells, speed, gap, reach):
    """Return the center of the bar 0.4 s after it was thrown at the wall, m."""
    scene, bar, _, forwards = bar_and_wall(cells, 0.1, reach)
    forwards, mass = torch.tensor(forwards), torch.tensor(bar.vertex_masses)
    steps = round(0.4 * SOUND * cells / LENGTH)
    move = ms.simulate(
        scene,
        steps=steps,
        time_step=0.4 / steps,
        start=torch.tensor(np.array(scene.mesh.rest_positions)) - (gap - 0.1) * forwards,
        velocities=speed * forwards,
        integrator=ms.TRBDF2(),
        progress=False,
    )
    return mass @ move.positions[-1][-bar.mesh.n_vertices :, 0] / mass.sum()


def gradient_through_impact(cells, reach) -> list[float]:
    """Return the gradient by the speed [s] and by the gap [1]."""
    given = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (0.5, 0.1)]
    center_after_impact(cells, *given, reach).backward()
    return [float(each.grad) for each in given]


def test_gradient_through_an_impact():
    """Check case I3: T - 2 L / c by the speed, and -1 by the gap: a change of the gap changes the end by its
    negative.
    """
    by_speed, by_gap = gradient_through_impact(40, 1e-2)
    assert by_speed == pytest.approx(0.4 - 2 * LENGTH / SOUND, rel=0.03)
    assert by_gap == pytest.approx(-1.0, rel=0.03)


def test_gradient_through_an_impact_is_that_of_the_motion():
    found = gradient_through_impact(10, 1e-2)
    for k, value in enumerate(found):
        near = [[0.5, 0.1], [0.5, 0.1]]
        near[0][k] += 1e-6
        near[1][k] -= 1e-6
        ends = [float(center_after_impact(10, *each, 1e-2)) for each in near]
        assert value == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-4)


def ball_on_a_slope(slope: float, friction: float):
    """Simulate a rigid ball of 40 facets around, askew, released on a slope; several facets touch at once.

    Returns over time: speed, radius times angular velocity [m/s], and the time [s].
    """
    radius, distance = 0.05, 1e-3
    askew = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    askew *= np.linalg.det(askew)
    surface = ms.meshes.ball(radius, cells=8).surface.transformed(rotation=askew)
    up = distance + 3.6e-3 - surface.rest_positions[:, 2].min()
    ball = ms.Shell(
        surface.transformed(translation=(0, 0, up)), thickness=1e-3, young_modulus=1e7, mass_density=1e-3
    )
    rigid = ms.RigidBody(everywhere(ball), mass=1.0, inertia=0.4 * radius**2, center=(0, 0, up), body=ball)
    floor = flat(1.2, (0.35, 0.013, 0.0))
    touch = ms.Contact(
        floor,
        rigid,
        friction_coefficient=friction,
        sticking_speed=1e-3,
        activation_distance=4e-3,
        contact_stiffness=2e4,
    )
    scene = ms.Scene(
        [floor, ball, rigid],
        supports=[held(floor)],
        contacts=[touch],
        gravity=GRAVITY * np.array([np.sin(slope), 0, -np.cos(slope)]),
        allow_rigid_motions=True,
    )
    move = ms.simulate(scene, steps=100, time_step=3e-3, integrator=ms.TRBDF2(), progress=False)
    return move[rigid].velocity[:, 0], radius * move[rigid].angular_velocity[:, 1], move.times


@pytest.mark.parametrize(
    "slope, friction, acceleration, turning",
    [(20, 0.2, 2.396584004, 2.396584004), (45, 0.2, 5.549374019, 3.468358762)],
)
def test_ball_on_a_slope_rolls_or_slides(slope, friction, acceleration, turning):
    """Compare the accelerations with case F3a; each impact of a facet dissipates energy as that of a polygon would."""
    speed, turned, time = ball_on_a_slope(np.radians(slope), friction)
    assert np.polyfit(time, speed, 1)[0] == pytest.approx(acceleration, rel=0.02)
    assert np.polyfit(time, turned, 1)[0] == pytest.approx(turning, rel=0.02)


def cube(at, young_modulus=1e7, side=0.05, cells=2) -> ms.Solid:
    mesh = ms.meshes.box((side,) * 3, cells=(cells,) * 3).transformed(translation=at)
    material = ms.NeoHookean(young_modulus=young_modulus, poisson_ratio=0.0)
    return ms.Solid(mesh, material=material, mass_density=1e3, element="linear")


WEIGHT = 1e3 * 0.05**3 * GRAVITY  # N, of a cube


def test_stack_of_blocks():
    """Check case F4: each contact carries the weight above it, to the round-off of the solver."""
    ground = flat(0.2, (0.001, 0.002, -6e-4))
    blocks = [cube((1e-3 * (k % 2), 2e-3 * (k % 3), k * 0.0503)) for k in range(4)]
    below = [ground, *blocks]
    touches = [ms.Contact(a, b, activation_distance=4e-4) for a, b in zip(below, blocks, strict=False)]
    guided = [ms.Pin(everywhere(block), "xy", body=block) for block in blocks]
    scene = ms.Scene(
        [ground, *blocks],
        supports=[held(ground), *guided],
        contacts=touches,
        gravity=(0, 0, -GRAVITY),
        allow_rigid_motions=True,
    )
    rest = ms.equilibrium(scene)
    borne = [
        -rest.contact_state(touch).forces[scene._bodies.spans[k].vertices, 2].sum()
        for k, touch in enumerate(touches)
    ]
    np.testing.assert_allclose(borne, WEIGHT * np.array([4, 3, 2, 1]), rtol=1e-9)


STICKING = 5e-6  # m/s


def slid(ground, slope, friction, lagged=False, speed=0.0, time=0.2) -> tuple[float, float]:
    """Return the final speed [m/s] and acceleration of a cube on a plate or a larger cube, pulled aside by gravity."""
    base = flat(0.4, (0, 0, -5e-4)) if ground == "plate" else cube((-0.05, -0.05, -0.1), 1e9, side=0.1)
    block = cube((-0.024, -0.023, 2e-4))
    law = {"activation_distance": 2.5e-4, "contact_stiffness": 1e6}

    def scene(gravity, pins, **rubbing):
        return ms.Scene(
            [base, block],
            supports=[held(base), *pins],
            contacts=[ms.Contact(base, block, **law, **rubbing)],
            gravity=gravity,
            allow_rigid_motions=True,
        )

    straight = scene((0, 0, -GRAVITY * np.cos(slope)), [ms.Pin(everywhere(block), "xy", body=block)])
    rubbing = {"friction_coefficient": friction, "sticking_speed": STICKING, "lagged_friction": lagged}
    oblique = scene(GRAVITY * np.array([np.sin(slope), 0, -np.cos(slope)]), [], **rubbing)
    velocities = np.zeros((oblique.mesh.n_vertices, 3))
    velocities[base.mesh.n_vertices :, 0] = speed
    move = ms.simulate(
        oblique,
        steps=round(time / 2e-3),
        time_step=2e-3,
        start=ms.equilibrium(straight).positions,
        velocities=velocities,
        integrator=ms.ImplicitEuler(),
        progress=False,
    )
    speeds = move[block].velocities[:, :, 0] @ block.vertex_masses / block.vertex_masses.sum()
    return speeds[-1], (speeds[-1] - speed) / time


GROUNDS = pytest.mark.parametrize("ground", ["plate", "block"])
LAGGED = pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])


@GROUNDS
@LAGGED
@pytest.mark.parametrize("slope, friction, acceleration", [(20, 0.3, 0.5897022231), (30, 0.5, 0.6571453944)])
def test_block_slides_above_the_friction_angle(ground, lagged, slope, friction, acceleration):
    """Check case F4, at 10 mm/s and faster."""
    _, found = slid(ground, np.radians(slope), friction, lagged, speed=0.01)
    assert found == pytest.approx(acceleration, rel=5e-3)


@GROUNDS
@LAGGED
@pytest.mark.parametrize("slope, friction", [(20, 0.37), (30, 0.6)])
def test_block_sticks_below_the_friction_angle(ground, lagged, slope, friction):
    """Check case F4: it creeps as slowly as documented, and by less than 1e-4 of its size a second."""
    speed, _ = slid(ground, np.radians(slope), friction, lagged)
    share = np.tan(np.radians(slope)) / friction
    assert speed == pytest.approx(STICKING * (1 - np.sqrt(1 - share)), rel=0.01)
    assert speed < 1e-4 * 0.05
