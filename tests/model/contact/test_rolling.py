"""Rolling, sliding and bouncing of smooth balls and rods on a plane against closed forms of rigid bodies."""

import numpy as np
import pytest

import magshell as ms
from magshell import obstacles as ob

G = 9.81
R, MASS = 5e-3, 4e-3  # m, kg
STIFFNESS = 2e3  # N/m
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12), "progress": False}
pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")  # impacts in few steps


def rolled(slope, friction, shape="ball", time=0.2, steps=200, lagged=False, **motion):
    """Return the motion on a plane, x downhill, of a ball or of a rod along y, and the body."""
    weight = MASS * G * np.cos(slope)
    if shape == "ball":
        inertia, surface = np.full(3, 0.4 * MASS * R**2), ob.Sphere(R)
    else:
        across = MASS * (R**2 / 4 + 0.02**2 / 12)
        inertia, surface = (
            np.array([across, 0.5 * MASS * R**2, across]),
            ob.Capsule([[0, -0.01, 0], [0, 0.01, 0]], R),
        )
    places = 1 if shape == "ball" else 2
    center = (0, 0, R - weight / (places * STIFFNESS))
    body = ms.RigidBody(mass=MASS, inertia=inertia, center=center, **motion)
    touch = ms.Contact(
        ob.Plane(),
        shapes=ob.Attached(surface, to=body, center=center),
        contact_stiffness=STIFFNESS,
        smoothing=1e-9,
        friction_coefficient=friction,
        sticking_speed=1e-5,
        lagged_friction=lagged,
    )
    gravity = (G * np.sin(slope), 0, -G * np.cos(slope))
    scene = ms.Scene(body, contacts=[touch], gravity=gravity, allow_rigid_motions=True)
    return ms.simulate(scene, steps=steps, time_step=time / steps, integrator=ms.TRBDF2(), **EXACT), body


@pytest.mark.parametrize(("shape", "share"), [("ball", 5 / 7), ("rod", 2 / 3)])
def test_rolls_down_a_slope(shape, share):
    """Compare with  a = g sin / (1 + I / m R^2)."""
    slope = 0.3
    move, body = rolled(slope, 0.5, shape)
    expected = share * G * np.sin(slope) * move.times
    assert move[body].velocity[:, 0] == pytest.approx(expected, abs=1e-3 * expected[-1])
    assert R * move[body].angular_velocity[:, 1] == pytest.approx(expected, abs=1e-3 * expected[-1])
    assert move[body].center[-1, 0] == pytest.approx(0.5 * expected[-1] * move.times[-1], rel=1e-3)


@pytest.mark.parametrize(("shape", "inertia"), [("ball", 0.4), ("rod", 0.5)])
def test_slips_down_a_steep_slope(shape, inertia):
    """Compare with  a = g (sin - mu cos),  spin' = mu g cos m R / I."""
    slope, mu = 0.8, 0.2
    move, body = rolled(slope, mu, shape)
    speed = G * (np.sin(slope) - mu * np.cos(slope)) * move.times
    spin = mu * G * np.cos(slope) / (inertia * R) * move.times
    assert move[body].velocity[:, 0] == pytest.approx(speed, abs=1e-3 * speed[-1])
    assert move[body].angular_velocity[:, 1] == pytest.approx(spin, abs=1e-3 * spin[-1])


@pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])
@pytest.mark.parametrize("spin", [0.0, -60.0, -200.0])
def test_ball_with_backspin_ends_at_the_speed_of_the_kept_moment(spin, lagged):
    """Compare with  v = 5/7 v0 + 2/7 R w0: friction has no moment about the line of contact. It may come back."""
    mu, speed = 0.3, 0.2
    slip = speed - R * spin
    stops = 2 / 7 * slip / (mu * G)
    move, body = rolled(
        0.0,
        mu,
        time=1.5 * stops,
        steps=300,
        lagged=lagged,
        velocity=(speed, 0, 0),
        angular_velocity=(0, spin, 0),
    )
    final = 5 / 7 * speed + 2 / 7 * R * spin
    assert move[body].velocity[-1, 0] == pytest.approx(final, abs=1e-3 * slip)
    assert R * move[body].angular_velocity[-1, 1] == pytest.approx(final, abs=1e-3 * slip)
    early = move.times < 0.95 * stops
    assert move[body].velocity[early, 0] == pytest.approx(speed - mu * G * move.times[early], abs=1e-3 * slip)


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.SDIRK3()], ids=str)
def test_ball_bounces_without_loss(integrator):
    """Drop a ball: it comes back at 2 v/g after each touch, as high as before."""
    height = 0.01
    center = (0, 0, R + height)
    body = ms.RigidBody(mass=MASS, inertia=0.4 * MASS * R**2, center=center)
    touch = ms.Contact(
        ob.Plane(), shapes=ob.Attached(ob.Sphere(R), to=body, center=center), contact_stiffness=STIFFNESS
    )
    scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=3000, time_step=1e-4, integrator=integrator, **EXACT)
    z = move[body].center[:, 2] - R
    tops = np.flatnonzero((z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:])) + 1
    assert len(tops) == 3
    assert z[tops] == pytest.approx(np.full(3, height), rel=5e-3)
    rate = np.sqrt(STIFFNESS / MASS)
    speed = np.sqrt(2 * G * height)
    touching = (
        np.pi + 2 * np.arctan(G / (rate * speed))
    ) / rate  # of a harmonic motion about the depth at rest
    assert np.diff(move.times[tops]) == pytest.approx(2 * speed / G + touching, rel=2e-3)
