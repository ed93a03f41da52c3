"""Waves of activation: their position over time, many muscles at once, derivatives by every argument."""

import numpy as np
import pytest
import torch

import magshell as ms
from magshell import control

PLACES = np.linspace(0.005, 0.095, 10)
TIMES = torch.linspace(0.0, 1.0, 21, dtype=torch.float64)


def test_a_wave_travels_with_its_speed():
    first = control.wave(TIMES, PLACES, speed=0.1, wavelength=0.05)
    later = control.wave(TIMES + 0.3, PLACES + 0.03, speed=0.1, wavelength=0.05)
    assert later.numpy() == pytest.approx(first.numpy(), abs=1e-12)
    assert first.min() >= 0 and first.max() <= 1
    back = control.wave(TIMES, PLACES[::-1].copy(), speed=-0.1, wavelength=0.05, mean=0.4, amplitude=0.2)
    expected = 0.4 + 0.2 * np.sin(2 * np.pi * (-0.1 * TIMES.numpy()[:, None] - PLACES[::-1]) / 0.05)
    assert back.numpy() == pytest.approx(expected, abs=1e-12)


def test_pulse_has_travelled_by_speed_times_time():
    a = control.pulse(TIMES, PLACES, speed=0.2, width=0.04, delay=0.1, amplitude=0.8).numpy()
    k = 7  # 0.35 s: 0.05 m
    assert PLACES[np.argmax(a[k])] == pytest.approx(0.05, abs=0.006)
    assert a[k] == pytest.approx(0.8 * np.exp(-4 * ((PLACES - 0.05) / 0.04) ** 2))
    again = control.pulse(TIMES, PLACES, speed=0.2, width=0.04, delay=0.1, amplitude=0.8, period=0.5).numpy()
    assert again[10:] == pytest.approx(again[:-10], abs=1e-12)
    near = np.abs(PLACES - 0.05) < 0.006
    assert again[k][near] == pytest.approx(a[k][near], rel=2e-2)


def test_many_muscles_at_once_and_one_time():
    delays = np.array([0.0, 0.1, 0.25])
    together = control.wave(TIMES, PLACES, speed=0.1, wavelength=0.05, delay=delays, ramp=0.2)
    assert together.shape == (21, 3, 10)
    for k, delay in enumerate(delays):
        alone = control.wave(TIMES, PLACES, speed=0.1, wavelength=0.05, delay=delay, ramp=0.2)
        assert (together[:, k] == alone).all()
    assert (
        control.wave(TIMES[4], PLACES, speed=0.1, wavelength=0.05, delay=0.25, ramp=0.2) == alone[4]
    ).all()


def test_wave_arguments_may_change_in_time():
    """Check that each row is the wave with the arguments at its time."""
    rng = np.random.default_rng(3)
    names = ("speed", "wavelength", "amplitude", "mean", "delay")
    numbers = {name: 0.2 + 0.1 * rng.random((21, 3)) for name in names}
    together = control.wave(TIMES, PLACES, **numbers)
    assert together.shape == (21, 3, 10)
    for k in (0, 8, 20):
        for muscle in range(3):
            alone = control.wave(TIMES[k], PLACES, **{n: float(v[k, muscle]) for n, v in numbers.items()})
            assert (together[k, muscle] == alone).all()
    mixed = control.wave(TIMES, PLACES, **{**numbers, "mean": numbers["mean"][0], "speed": 0.1})
    assert (
        mixed[0]
        == control.wave(TIMES[:1], PLACES, **{**{n: v[:1] for n, v in numbers.items()}, "speed": 0.1})[0]
    ).all()
    with pytest.raises(ValueError, match=r"delay \[s\] must have shape \(21, k\)"):
        control.wave(TIMES, PLACES, speed=0.1, wavelength=0.05, delay=np.zeros((20, 3)))


@pytest.mark.parametrize(
    "kind, names",
    [
        (control.wave, {"speed": 0.3, "wavelength": 0.2, "amplitude": 0.4, "mean": 0.5, "delay": 0.1}),
        (control.wave, {"speed": 0.3, "wavelength": 0.2, "ramp": 0.7}),
        (control.pulse, {"speed": 0.3, "width": 0.2, "amplitude": 0.4, "delay": 0.1}),
        (control.pulse, {"speed": 0.3, "width": 0.2, "delay": 0.1, "period": 0.6}),
    ],
)
def test_derivatives_by_all_arguments(kind, names):
    given = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in names.values()]
    times = TIMES[1:6].clone().requires_grad_(True)
    places = torch.tensor(PLACES[:3], requires_grad=True)
    assert torch.autograd.gradcheck(
        lambda t, s, *values: kind(t, s, **dict(zip(names, values, strict=True))), (times, places, *given)
    )


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"wavelength": 0.0}, "wavelength must be positive"),
        ({"wavelength": 0.1, "ramp": -1.0}, "ramp must be positive"),
        ({"wavelength": 0.1, "delay": (0.0, 0.1), "mean": (0.5, 0.4, 0.3)}, "of one number of muscles"),
        ({"wavelength": "long"}, "wavelength"),
    ],
)
def test_waves_with_bad_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        control.wave(TIMES, PLACES, speed=0.1, **arguments)


def test_a_wave_moves_a_muscle_and_its_numbers_have_gradients():
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(6, 1, 1))
    body = ms.Solid(
        mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), mass_density=1e3, element="linear"
    )
    fibres = ms.fibres_along([(0, 0.01, 0.02), (0.1, 0.01, 0.02)], body, reach=0.01)
    muscle = ms.Muscle(body, fibres, peak_stress=3e4, segments=6)
    scene = ms.Scene(body, supports=[ms.Pin(mesh.vertices_at(x=0.0))], actuators=[muscle])
    steps, step = 8, 4e-3
    times = control.step_times(steps, step)

    def end(speed, delay):
        a = control.wave(times, muscle.places, speed=speed, wavelength=0.1, delay=delay)
        move = ms.simulate(
            scene,
            steps=steps,
            time_step=step,
            values={muscle: {"activation": a}},
            solver=ms.MixedNewton(tolerance=1e-12),
            progress=False,
        )
        assert move[muscle].activation(3) == pytest.approx(a.detach().numpy()[3][muscle.segments], abs=1e-12)
        return (move.positions[-1] ** 2).sum() + move.positions[4, -1, 2]

    given = [torch.tensor(2.0, dtype=torch.float64, requires_grad=True),
             torch.tensor(0.01, dtype=torch.float64, requires_grad=True)]  # fmt: skip
    end(*given).backward()
    for k, size in enumerate((1e-4, 1e-6)):
        off = [torch.tensor([2.0, 0.01], dtype=torch.float64) for _ in range(2)]
        off[0][k] += size
        off[1][k] -= size
        slope = float(end(*off[0]) - end(*off[1])) / (2 * size)
        assert given[k].grad.item() == pytest.approx(slope, rel=1e-5)
