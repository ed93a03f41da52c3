"""Tests of time steps that are given one by one or chosen by their errors: accuracy, grid, repetition, refusals."""

import pickle
from itertools import count

import numpy as np
import pytest
from chosen_steps import BOUNCE, bounce, bounces, bouncing_plate, changes, distance, noise, swinging_strip

import magshell as ms
from magshell.solve.dynamics.step_errors import tolerance_of

INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]


def names(integrator):
    return type(integrator).__name__


@pytest.fixture(scope="module")
def exact():
    return swinging_strip(400, 5e-4, ms.SDIRK3())


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=names)
def test_error_at_the_end_falls_with_the_tolerance(integrator, exact) -> None:
    moves = [swinging_strip(5, ms.Adaptive(0.04, tolerance), integrator) for tolerance in (1e-4, 1e-5, 1e-6)]
    errors = [distance(move, exact) for move in moves]
    assert errors[2] < 0.7 * errors[1] < 0.5 * errors[0]
    for move, tolerance in zip(moves, (1e-4, 1e-5, 1e-6), strict=True):
        assert 0.0 < move.step_errors.max() <= tolerance


def test_steps_are_binary_fractions_aligned_to_the_grid() -> None:
    interval = 0.04
    move = swinging_strip(5, ms.Adaptive(interval, 1e-5))
    np.testing.assert_array_equal(move.times, interval * np.arange(6))
    assert move.steps == move.steps_done == 5 and len(move) == 6
    levels = np.log2(interval / move.time_steps)
    np.testing.assert_array_equal(levels, np.round(levels))
    begins = np.cumsum(move.time_steps) - move.time_steps
    places = begins / move.time_steps
    np.testing.assert_allclose(places, np.round(places), atol=1e-9)
    assert move.time_steps.sum() == pytest.approx(5 * interval, rel=1e-12)
    assert f"5 steps in {len(move.time_steps)}" in repr(move)


def test_ladder_keeps_its_steps_where_a_mass_bounces() -> None:
    moves = bounces(0.13, 1e-5, 1e-6, count=12)
    assert changes(moves) == 0 and len(moves[0].time_steps) > 20
    assert noise(moves) < 1e-6 * 1e-5


def test_short_steps_resolve_an_impact_and_long_ones_follow() -> None:
    move = bounce(bouncing_plate(), 0.1, ms.Adaptive(BOUNCE / 8, 1e-4))
    assert move.time_steps.max() >= 16 * move.time_steps.min()
    shortest = int(np.argmin(move.time_steps))
    assert move.time_steps[:shortest].max() == move.time_steps[shortest:].max() == BOUNCE / 8


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=names)
def test_time_steps_of_a_motion_repeat_it(integrator) -> None:
    field = lambda t: (0, 0, 4e-3 * np.sin(40 * t))  # noqa: E731
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    given = {"steps": 4, "remanent_magnetization": (4e4, 0, 0), "integrator": integrator, "progress": False}
    for control in (field, np.array([field(0.02 * k) for k in range(5)])):
        move = ms.simulate(scene, time_step=ms.Adaptive(0.02, 1e-5), applied_flux_density=control, **given)
        again = ms.simulate(scene, time_step=move.time_steps, applied_flux_density=control, **given)
        assert len(move.time_steps) > 4 and len(again) == 5
        np.testing.assert_array_equal(again.time_steps, move.time_steps)
        np.testing.assert_allclose(again.times, move.times, rtol=1e-14)
        np.testing.assert_allclose(again.positions, move.positions, rtol=0, atol=1e-12)


def test_equal_listed_steps_have_the_bits_of_a_number() -> None:
    one, other = swinging_strip(6, 1e-3), swinging_strip(6, [1e-3] * 6)
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_array_equal(one.times, other.times)


def test_steps_of_unequal_lengths_end_at_their_sums() -> None:
    lengths = np.array([1e-3, 4e-4, 2e-3, 3e-4])
    move = swinging_strip(4, lengths, ms.SDIRK3())
    np.testing.assert_allclose(move.times, [0.0, *np.cumsum(lengths)], rtol=1e-15)
    assert distance(move, swinging_strip(37, 1e-4, ms.SDIRK3())) < 1e-8
    later = swinging_strip(2, 1e-3, ms.SDIRK3(), start=move.end)
    np.testing.assert_allclose(later.times, lengths.sum() + 1e-3 * np.arange(3), rtol=1e-14)


def test_recorded_states_are_those_of_every_second_interval() -> None:
    every = swinging_strip(6, ms.Adaptive(0.02, 1e-5))
    second = swinging_strip(6, ms.Adaptive(0.02, 1e-5), record_every=2)
    np.testing.assert_array_equal(second.positions, every.positions[::2])
    np.testing.assert_array_equal(second.times, every.times[::2])
    np.testing.assert_array_equal(second.kinetic_energy, every.kinetic_energy[::2])
    copied = pickle.loads(pickle.dumps(every))
    np.testing.assert_array_equal(copied.time_steps, every.time_steps)


def test_adaptive_motion_continues_another() -> None:
    whole = swinging_strip(6, ms.Adaptive(0.02, 1e-5))
    first = swinging_strip(3, ms.Adaptive(0.02, 1e-5))
    second = swinging_strip(3, ms.Adaptive(0.02, 1e-5), start=first.end)
    np.testing.assert_array_equal(second.times, whole.times[3:])
    assert distance(second, whole) < 1e-4


def test_jump_of_a_load_parameter_ends_a_step() -> None:
    """Let a field jump between two intervals: no step extends over that time."""
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    jump = np.zeros((4, 3))
    jump[2:, 2] = 4e-3
    given = {"remanent_magnetization": (4e4, 0, 0), "integrator": ms.SDIRK2(), "progress": False}
    move = ms.simulate(scene, steps=4, time_step=ms.Adaptive(0.01, 1e-6), applied_flux_density=jump, **given)
    ends = np.cumsum(move.time_steps)
    assert np.abs(ends - 0.02).min() < 1e-15 and move.time_steps[0] == 0.01
    fine = ms.simulate(
        scene, steps=400, time_step=1e-4, applied_flux_density=jump.repeat(100, axis=0), **given
    )
    assert distance(move, fine) < 2e-5


@pytest.mark.parametrize("jointed", [False, True], ids=["rigid body", "skeleton"])
def test_rigid_bodies_and_skeletons_take_chosen_steps(jointed) -> None:
    if jointed:
        arm = ms.Link(mass=0.1, inertia=1e-4, center=(0.1, 0, 0))
        scene = ms.Scene(
            ms.Skeleton([arm], [ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0))]), gravity=(0, 0, -9.81)
        )
    else:
        spin = {
            "angular_velocity": (0.1, 2.0, 0.0),
            "torque": (0.5, -0.2, 1.0),
        }  # without a torque any step would do
        top = ms.RigidBody(mass=1.0, inertia=(1.0, 2.0, 3.0), **spin)
        scene = ms.Scene(top, allow_rigid_motions=True)
    coarse, fine = (
        ms.simulate(scene, steps=4, time_step=ms.Adaptive(0.25, tolerance), progress=False)
        for tolerance in (1e-4, 1e-6)
    )
    points = lambda move: np.asarray(move._own_points)[-1]  # noqa: E731
    assert len(fine.time_steps) > 2 * len(coarse.time_steps)
    assert np.abs(points(coarse) - points(fine)).max() < 100 * 1e-4
    assert fine.step_errors.max() <= 1e-6


def test_tolerance_that_cannot_be_reached_leaves_the_motion_until_there() -> None:
    with pytest.raises(
        ms.NotConverged, match=r"failed even with a length of 0.01 s: its error is estimated"
    ) as caught:
        swinging_strip(5, ms.Adaptive(0.04, 1e-7, max_halvings=2), ms.ImplicitEuler())
    assert len(caught.value.last_good) == 1 and caught.value.last_good.steps_done == 0
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    field = np.zeros((4, 3))
    field[3:, 2] = 0.05
    with pytest.raises(ms.NotConverged, match=r"at 0.03 s, failed") as caught:
        ms.simulate(
            scene,
            steps=4,
            time_step=ms.Adaptive(0.01, 1e-6, max_halvings=1),
            remanent_magnetization=(4e4, 0, 0),
            applied_flux_density=field,
            progress=False,
        )
    assert caught.value.last_good.steps_done == 3 and len(caught.value.last_good.time_steps) == 3


def test_default_tolerance_is_a_fraction_of_the_extent() -> None:
    extent = np.hypot(0.1, 0.02)  # the diagonal
    move, given = (swinging_strip(2, ms.Adaptive(0.02, tolerance)) for tolerance in (None, 1e-4 * extent))
    np.testing.assert_array_equal(move.time_steps, given.time_steps)
    assert tolerance_of(move.scene, ms.Adaptive(0.02)) == pytest.approx(1e-4 * extent, rel=1e-12)


def test_tolerance_below_round_off_is_refused() -> None:
    with pytest.raises(ValueError, match=r"tolerance \[m\] must be at least 1.02e-11 m, .* got 1e-12"):
        swinging_strip(2, ms.Adaptive(0.02, 1e-12))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.0, 1e-3), r"interval \[s\] must be positive, got 0"),
        ((1e-13, 1e-3), r"interval \[s\] must be at least 1e-12 s, got 1e-13"),
        ((1e-2, 0.0), r"tolerance \[m\] must be positive, got 0"),
        ((1e-2, np.nan), r"tolerance \[m\] must be finite"),
        ((1e-2, 1e-3, 21), r"max_halvings must be at most 20, got 21"),
        ((1e-10, 1e-3, 8), r"max_halvings = 8 of an interval of 1e-10 s .* at most 6 are possible"),
    ],
)
def test_impossible_ladders_are_refused(arguments, words) -> None:
    with pytest.raises(ValueError, match=words):
        ms.Adaptive(*arguments)


@pytest.mark.parametrize(
    ("time_step", "words"),
    [
        (1e-13, r"time_step \[s\] must be at least 1e-12 s, got 1e-13"),
        ([1e-3, 1e-3, 1e-13, 1e-3], r"time_step \[s\] must be at least 1e-12 s, got 1e-13"),
        ([1e-3, -1e-3, 1e-3, 1e-3], r"time_step \[s\] must be positive, but the smallest is -0.001"),
        ([1e-3] * 3, r"one length for each of the 4 steps, or more that divide them, got 3"),
        (np.full((2, 2), 1e-3), r"time_step \[s\] must have shape \(m,\), got \(2, 2\)"),
        ([1e-3, np.inf, 1e-3, 1e-3], r"time_step \[s\] must be finite, but time_step\[1\] is inf"),
    ],
)
def test_impossible_steps_are_refused(time_step, words) -> None:
    with pytest.raises(ValueError, match=words):
        swinging_strip(4, time_step)


def test_steps_that_miss_the_grid_are_refused() -> None:
    words = r"add up to 0.004 s, but not to steps = 4 equal intervals of 0.001 s: none ends at 0.001 s"
    with pytest.raises(ValueError, match=words):
        swinging_strip(4, [6e-4, 8e-4, 6e-4, 1e-3, 1e-3])


def test_tolerance_beyond_a_percent_of_the_extent_is_warned_of() -> None:
    with pytest.warns(ms.StepErrorWarning, match=r"Take a tolerance of at most 0.001 m"):
        swinging_strip(5, ms.Adaptive(0.04, 5e-3), ms.ImplicitEuler())


@pytest.mark.parametrize("storage", ["checkpoints", "factors", None])
def test_gradient_by_the_interval_does_not_depend_on_the_storage(storage) -> None:
    """Give the stages so little memory that checkpoints replace them during the motion."""
    torch = pytest.importorskip("torch")
    slopes = []
    for kept in (ms.AdjointStorage("stages"), ms.AdjointStorage(storage, memory_budget=3e4)):
        interval = torch.tensor(0.02, dtype=torch.float64, requires_grad=True)
        move = swinging_strip(5, ms.Adaptive(interval, 1e-5), ms.ImplicitEuler(), adjoint_storage=kept)
        assert move.adjoint_storage == (kept.what or "checkpoints") and len(move.time_steps) > 40
        (move.positions**2).sum().backward()
        slopes.append(float(interval.grad))
    assert slopes[1] == pytest.approx(slopes[0], rel=1e-9)


def test_interrupted_motion_has_the_steps_until_then() -> None:
    """Let a field interrupt the motion, after the 81 calls by which the inputs are checked before it."""
    calls = count()

    def field(t):
        if next(calls) == 150:
            raise KeyboardInterrupt
        return (0, 0, 4e-3 * np.sin(40 * t))

    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    given = {"remanent_magnetization": (4e4, 0, 0), "progress": False, "time_step": ms.Adaptive(0.01, 1e-5)}
    with pytest.raises(ms.Interrupted) as caught:
        ms.simulate(scene, steps=40, applied_flux_density=field, **given)
    move = caught.value.last_good
    assert 0 < move.steps_done < 40 and len(move) == move.steps_done + 1
    assert move.time_steps.sum() == pytest.approx(move.end.time)
