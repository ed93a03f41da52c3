"""Tests of continued motions: the parts have the bits of one motion in one piece, for all inputs and clocks."""

import dataclasses

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2), irregular=0.2, seed=1)
INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())
IMPLICIT = ms.TRBDF2(implicit_contact=True)
STEPS, FIRST = 20, 7
TIME_STEP = 7e-4  # no sum of it is exact


def field(time):
    return np.array((0.0, 1e-3 * np.sin(900 * time), 1e-2 * np.sin(400 * time)))


def jumping(time):
    return field(time) + np.array((0.0, 0.0, 0.06 if time > 10.5 * TIME_STEP else 0.0))


def heaving(time):
    return 1e-2 * np.sin(300 * time), 0.0, 1e-3 * np.sin(500 * time)


def strip(bending="midedge", **changes):
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3, bending=bending)
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 2e-3))
    magnet = ms.Dipoles([(0.03, 0, -0.02)], [(0, 0, 0.1)])
    given = {"supports": [clamp], "gravity": (0, 0, -9.81), "fields": [ms.UniformField(), magnet], **changes}
    return ms.Scene(sheet, field=given.pop("fields"), **given)


def floor(motion=None, **changes):
    return [ms.Contact(ms.obstacles.Plane(center=(0, 0, -1.2e-3), motion=motion), **changes)]


def simulate(scene, steps=STEPS, **options):
    given = {
        "time_step": TIME_STEP,
        "remanent_magnetization": (3e4, 0, 0),
        "applied_flux_density": field,
        "support_factor": lambda time: np.sin(50 * time),
        "gravity_factor": lambda time: 1 + 10 * time,
        "field_factor": lambda time: np.cos(200 * time),
        "progress": False,
    }
    return ms.simulate(scene, steps=steps, **{**given, **options})


def same_bits(uninterrupted, *parts):
    ends = np.cumsum([0, *(part.steps_done for part in parts)])
    for begin, end, part in zip(ends[:-1], ends[1:], parts, strict=True):
        for name in ("times", "positions", "velocities", "edge_rotations", "kinetic_energy"):
            np.testing.assert_array_equal(
                getattr(part, name), getattr(uninterrupted, name)[begin : end + 1], name
            )
        fields = uninterrupted.applied_flux_density[
            begin + 1 : end + 1
        ]  # at the start of a part: that of its first step
        np.testing.assert_array_equal(part.applied_flux_density[1:], fields)
    assert parts[-1].end.time == uninterrupted.end.time


MAXWELL = {"maxwell_modulus": 0.5, "maxwell_time": 5e-3}
PRONY = {"maxwell_modulus": (0.5, 0.2), "maxwell_time": (5e-3, 2e-2)}
KINDS = {
    "elastic": (strip, {}),
    "hinge": (lambda: strip("hinge"), {}),
    "viscous": (strip, {"stiffness_damping": 1e-3, **MAXWELL}),
    "two Maxwell branches": (strip, PRONY),
    "contact": (lambda: strip(contacts=floor()), {}),
    "friction": (lambda: strip(contacts=floor(heaving, friction_coefficient=0.5)), MAXWELL),
    "lagged friction": (
        lambda: strip(contacts=floor(heaving, friction_coefficient=0.5, lagged_friction=True)),
        {},
    ),
    "water": (lambda: strip(water=ms.Water(added_mass=1.0)), {}),
    "halved": (
        strip,
        {"solver": ms.Newton(max_iterations=4), "damping": 1e-5, "applied_flux_density": jumping},
    ),
}


@pytest.mark.parametrize(
    "kind, integrator",
    [
        *[(kind, each) for each in INTEGRATORS for kind in KINDS],
        *[(kind, IMPLICIT) for kind in ("contact", "friction", "lagged friction")],
    ],
    ids=repr,
)
def test_functions_of_the_time_go_on(kind, integrator):
    make, options = KINDS[kind]
    scene, options = make(), {"integrator": integrator, **options}
    whole = simulate(scene, **options)
    first = simulate(scene, FIRST, **options)
    second = simulate(scene, 4, start=first, **options)
    third = simulate(scene, STEPS - FIRST - 4, start=second.end, **options)
    assert (kind == "halved") == bool(third.substeps)
    same_bits(whole, first, second, third)


def rubbing_layers(lagged):
    """Build a sheet on a block: two layers, of which the upper is pulled along over the lower by more than a cell."""
    lower = ms.meshes.rectangle(0.02, 0.01, cells=(6, 3), irregular=0.2, seed=1)
    upper = lower.transformed(translation=(1e-3, 5e-4, 5.8e-4))
    layers = ms.TriangleMesh(
        np.concatenate([lower.rest_positions, upper.rest_positions]),
        np.concatenate([lower.faces, upper.faces + lower.n_vertices]),
    )
    sheet = ms.Shell(layers, thickness=5e-4, young_modulus=1e6, mass_density=1e3)
    box = ms.meshes.box((0.02, 0.01, 4e-3), cells=(2, 1, 1)).transformed(translation=(0, 0, -4.58e-3))
    rubber = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.4)
    block = ms.Solid(box, material=rubber, mass_density=1e3, element="linear")
    law = {
        "min_distance": 3e-4,
        "activation_distance": 3e-4,
        "contact_stiffness": 1e3,
        "friction_coefficient": 0.5,
        "lagged_friction": lagged,
    }
    pulled = layers.vertices_where(lambda x: (x[:, 2] > 3e-4) & (x[:, 0] > 0.02))
    return ms.Scene(
        [sheet, block],
        supports=[
            ms.Pin(box.vertices_at(z=-4.58e-3), body=block),
            ms.Pin(pulled, displacement=(6e-3, 0, 0), body=sheet),
        ],
        contacts=[ms.SelfContact(sheet, **law), ms.Contact(sheet, block, **law)],
        gravity=(0, 0, -50.0),
        allow_rigid_motions=True,
    )


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), None], ids=["ImplicitEuler", "default"])
@pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])
def test_bodies_that_rub_go_on(lagged, integrator):
    """Check that a step does not depend on which pairs were near each other in the steps before."""
    scene = rubbing_layers(lagged)
    steps, factors = 8, np.linspace(0.0, 1.0, 9) ** 2

    def part(begin, end, **start):
        return ms.simulate(
            scene,
            steps=end - begin,
            time_step=2e-4,
            support_factor=factors[begin : end + 1],
            integrator=integrator,
            stiffness_damping=1e-4,
            progress=False,
            **start,
        )

    whole, first = part(0, steps), part(0, 5)
    for touch in scene.contacts:
        assert all(np.abs(whole.contact_state(touch, k).friction).max() > 0.0 for k in (5, 6, 8))
    same_bits(whole, first, part(5, steps, start=first.end))


@pytest.mark.parametrize("rows", [STEPS, STEPS + 1], ids=["a step", "ends"])
@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda each: type(each).__name__)
def test_arrays_begin_with_the_first_step_of_the_part(rows, integrator):
    values = np.array([field(k * TIME_STEP) for k in range(rows)])
    factors = np.linspace(0.0, 1.0, rows)
    scene, more = strip(), rows - STEPS

    def part(begin, end, **options):
        rows = slice(begin, end + more)
        given = {"applied_flux_density": values[rows], "support_factor": factors[rows], **options}
        return simulate(scene, end - begin, integrator=integrator, **given)

    first = part(0, FIRST)
    same_bits(part(0, STEPS), first, part(FIRST, STEPS, start=first))


@pytest.mark.parametrize("branches", [MAXWELL, PRONY], ids=["one branch", "two"])
def test_constants_and_a_file_between(tmp_path, branches):
    options = {"applied_flux_density": (0, 0, 1e-2), "support_factor": 1.0, **branches}
    scene = strip(contacts=floor(heaving))
    whole, first = simulate(scene, **options), simulate(scene, FIRST, **options)
    first.end.save(tmp_path / "state.npz")
    second = simulate(scene, STEPS - FIRST, start=ms.MotionState.load(tmp_path / "state.npz"), **options)
    same_bits(whole, first, second)


def test_steps_of_another_length_count_from_the_present_time():
    first = simulate(strip(), FIRST)
    asked = []

    def watched(time):
        asked.append(time)
        return field(time)

    second = simulate(
        first.scene,
        3,
        start=first,
        time_step=1e-4,
        applied_flux_density=watched,
        integrator=ms.ImplicitEuler(),
    )
    np.testing.assert_array_equal(second.times, first.end.time + 1e-4 * np.arange(4))
    assert asked == second.times.tolist()


def test_a_time_set_by_hand_is_where_it_goes_on():
    first = simulate(strip(), FIRST)
    again = simulate(first.scene, 3, start=dataclasses.replace(first.end, time=0.0))
    np.testing.assert_array_equal(again.times, first.times[:4])
    np.testing.assert_array_equal(again.applied_flux_density, first.applied_flux_density[:4])
    pushed = simulate(first.scene, 3, start=first, velocities=(0, 0, 0.1))
    np.testing.assert_array_equal(pushed.times, simulate(first.scene, 10).times[FIRST:])


def test_bad_clocks_are_refused(tmp_path):
    end = simulate(strip(), 1).end
    with pytest.raises(ValueError, match="clock must be that of a motion"):
        simulate(strip(), 1, start=dataclasses.replace(end, clock=0.0))
    end.save(tmp_path / "state.npz")
    with np.load(tmp_path / "state.npz") as file:
        arrays = dict(file)
    np.savez(tmp_path / "state.npz", **{**arrays, "clock": np.zeros((3, 2))})
    with pytest.raises(ValueError, match="not a saved MotionState"):
        ms.MotionState.load(tmp_path / "state.npz")


def test_times_of_load_parameters_go_on():
    torch = pytest.importorskip("torch")
    first = simulate(strip(), FIRST)
    for start in (first, first.end):
        times = ms.control.step_times(5, TIME_STEP, start=start)
        np.testing.assert_array_equal(times, simulate(first.scene, 5, start=start).times)
    time_step = torch.tensor(TIME_STEP, dtype=torch.float64, requires_grad=True)
    times = ms.control.step_times(5, time_step, start=first)
    np.testing.assert_array_equal(times.detach(), ms.control.step_times(5, TIME_STEP, start=first))
    times.sum().backward()
    assert time_step.grad == 15  # the time at which it goes on is fixed
    with pytest.raises(ValueError, match="start must be a Trajectory"):
        ms.control.step_times(5, TIME_STEP, start=0.1)


@pytest.mark.parametrize("name", ["time_step", "frequency"])
def test_gradients_of_a_part(name):
    torch = pytest.importorskip("torch")
    scene = strip()
    first = simulate(scene, FIRST)

    def loss(given):
        inputs = {"time_step": TIME_STEP, "frequency": 400.0, **given}

        def swinging(time):
            wave = torch.sin(inputs["frequency"] * torch.as_tensor(time, dtype=torch.float64))
            return 1e-2 * wave * torch.tensor((0.0, 0.1, 1.0), dtype=torch.float64)

        options = {"start": first, "time_step": inputs["time_step"], "applied_flux_density": swinging}
        options |= {"support_factor": lambda time: (50 * time) ** 2, "field_factor": 1.0}
        move = simulate(scene, 5, **options, solver=ms.MixedNewton(tolerance=1e-13))
        return 1e3 * torch.as_tensor(move.positions)[1:, -1].pow(2).sum()

    value = {"time_step": TIME_STEP, "frequency": 400.0}[name]
    tensor = torch.tensor(value, dtype=torch.float64, requires_grad=True)
    loss({name: tensor}).backward()
    above, below = (float(loss({name: (1 + change) * value})) for change in (1e-5, -1e-5))
    assert tensor.grad.item() == pytest.approx((above - below) / (2e-5 * value), rel=1e-6)
