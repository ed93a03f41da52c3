"""Balls on a plane: the rebound of an elastic ball, and a ball thrown with backspin, both with closed forms.

`PYTHONPATH=. python tests/support/ball_impacts.py [rebound | backspin]` prints restitution by the number of steps in
contact, beside that of a point mass with the same law of force; and speed and time of the ball with backspin over the
closed forms.
"""

import sys

import numpy as np
from scipy.optimize import brentq

import magshell as ms

IMPLICIT = ms.TRBDF2(implicit_contact=True)
BACKSPIN_SPEED, BACKSPIN, RADIUS, FRICTION, GRAVITY = 1.0, -50.0, 0.01, 0.3, 9.81  # m/s, rad/s, m, -, m/s2


def point_rebound(steps: int, integrator=IMPLICIT) -> float:
    """Return the mean restitution of a point mass with the force depth^1.5 of Hertz, in so many steps in contact."""
    # For a mass, a stiffness and a speed of 1 contact lasts 2.9433 x 1.25^0.4 (Johnson, Contact Mechanics, 11.4).
    time_step = 3.2180 / steps
    implicit = integrator == IMPLICIT
    g, w = (1.0 - np.sqrt(0.5), np.sqrt(0.125)) if implicit else (1.0, 0.0)

    def force(depth: float) -> float:
        return -(max(depth, 0.0) ** 1.5)

    def stage(x: float, v: float, before: float, fraction: float) -> tuple[float, float]:
        """Solve x' = x + dt (before + g v') with v' = v + fraction dt force(x')."""
        found = brentq(
            lambda z: z - x - time_step * (before + g * (v + fraction * time_step * force(z))),
            x - 30 * time_step,
            x + 30 * time_step,
            xtol=1e-14,
        )
        return found, v + fraction * time_step * force(found)

    back = []
    for phase in np.linspace(0.0, 1.0, 10, endpoint=False):
        x, v = -time_step * (1.0 + phase), 1.0
        for _ in range(round(1.3 * steps) + 8):
            middle = stage(x, v, g * v, 2.0 * g)[1] if implicit else 0.0
            x, v = stage(x, v, w * v + w * middle, 1.0)
        back.append(-v)
    return float(np.mean(back))


def ball_rebound(integrator, steps: int) -> tuple[float, ms.Trajectory]:
    """Return the restitution of an elastic ball, in so many steps in a contact that lasts as long as Hertz says."""
    modulus, poisson, density, speed = 1e6, 0.3, 1e3, 0.3
    mesh = ms.meshes.ball(RADIUS, cells=6)
    material = ms.NeoHookean(young_modulus=modulus, poisson_ratio=poisson)
    ball = ms.Solid(mesh, material=material, mass_density=density, element="linear")
    mass = ball.vertex_masses
    contact_time = 2.87 * (mass.sum() ** 2 / (RADIUS * (modulus / (1 - poisson**2)) ** 2 * speed)) ** 0.2
    time_step = contact_time / steps
    below = mesh.rest_positions[:, 2].min() - 1.5 * speed * time_step
    ground = ms.Contact(ms.obstacles.Plane(center=(0, 0, below)), contact_stiffness=2e3, smoothing=1e-6)
    move = ms.simulate(
        ms.Scene(ball, contacts=[ground], allow_rigid_motions=True),
        steps=round(1.3 * steps) + 6,
        time_step=time_step,
        velocities=(0, 0, -speed),
        integrator=integrator,
        progress=False,
    )
    return float(mass @ move.velocities[-1][:, 2]) / mass.sum() / speed, move


def ball_with_backspin(integrator, time_step: float, cells: int = 8) -> tuple[float, float, float]:
    """Return speed and time at which a rigid ball rolls, over their closed forms, and factorizations per step.

    A ball with the speed v and the spin w slides with friction mu g until it rolls with (5 v + 2 w R)/7. The time is where
    the line of constant deceleration at half of the change of speed meets the speed at the end.
    """
    surface = ms.meshes.ball(RADIUS, cells=cells).surface
    depth = 0.01 * RADIUS
    surface = surface.transformed(translation=(0, 0, RADIUS))
    mass = 1e3 * 4 / 3 * np.pi * RADIUS**3
    skin = ms.Shell(surface, thickness=1e-4 * RADIUS, young_modulus=1e6, mass_density=1e-3)
    ball = ms.RigidBody(
        range(surface.n_vertices), mass=mass, inertia=0.4 * mass * RADIUS**2, center=(0, 0, RADIUS)
    )
    patch = 2 * np.pi * RADIUS * depth / (4 * np.pi * RADIUS**2) * surface.n_vertices
    ground = ms.Contact(
        ms.obstacles.Plane(),
        contact_stiffness=mass * GRAVITY / (0.5 * depth * patch),
        smoothing=1e-3 * depth,
        friction_coefficient=FRICTION,
        sticking_speed=1e-3,
    )
    scene = ms.Scene([skin, ball], contacts=[ground], gravity=(0, 0, -GRAVITY), allow_rigid_motions=True)
    arm = surface.rest_positions - [0, 0, RADIUS]
    velocities = np.array([BACKSPIN_SPEED, 0, 0]) + np.cross([0, BACKSPIN, 0], arm)
    slip = BACKSPIN_SPEED - BACKSPIN * RADIUS
    rolling_speed, rolling_time = BACKSPIN_SPEED - slip * 2 / 7, slip * 2 / 7 / (FRICTION * GRAVITY)
    move = ms.simulate(
        scene,
        steps=round(1.5 * rolling_time / time_step),
        time_step=time_step,
        velocities=velocities,
        integrator=integrator,
        progress=False,
    )
    speed = move[ball].velocity[:, 0]
    last = speed[move.times > 1.2 * rolling_time].mean()
    sliding = (move.times > 0.1 * rolling_time) & (move.times < 0.8 * rolling_time)
    slope, start = np.polyfit(move.times[sliding], speed[sliding], 1)
    return (
        last / rolling_speed,
        (last - start) / slope / rolling_time,
        move.factorizations / move.steps,
    )


def main(words: list[str]) -> None:
    """Print the measurements."""
    if "backspin" not in words:
        for steps in (30, 59, 75, 118):
            back, move = ball_rebound(IMPLICIT, steps)
            print(
                f"{steps} steps in contact: restitution {back:.4f}, Euler {ball_rebound(ms.ImplicitEuler(), steps)[0]:.4f}; "
                f"point {point_rebound(steps):.4f}, Euler {point_rebound(steps, ms.ImplicitEuler()):.4f}; energy gained "
                f"{move.energy.max() / move.energy[0] - 1:.1e}",
                flush=True,
            )
    if "rebound" not in words:
        for integrator in (ms.ImplicitEuler(), IMPLICIT):
            for step in (2e-3, 1e-3):
                speed, time, cost = ball_with_backspin(integrator, step)
                print(
                    f"{integrator!r}, {step:g} s: speed {speed:.4f}, time {time:.4f} of the closed form, {cost:.1f} "
                    "factorizations per step",
                    flush=True,
                )


if __name__ == "__main__":
    main(sys.argv[1:])
