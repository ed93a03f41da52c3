"""Obstacles that are thin, sharp, fast or narrow, and tiny sticking speeds: a valid motion or an error."""

from __future__ import annotations

import numpy as np
from answers import Answer, below, both, holds, near
from registry import case

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

GRAVITY, SIDE, THICKNESS = 9.81, 0.02, 1e-3
TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.01
TIP_UP = (
    np.arccos(1 / np.sqrt(3)) / np.sqrt(2) * np.array([1.0, -1.0, 0.0])
)  # rotates (1, 1, 1) to the z axis


def plate(obstacles, friction=0.6, gravity=(0, 0, -GRAVITY), cells=(6, 6), **contact) -> ms.Scene:
    """Return a scene of a soft sheet with its middle at the origin."""
    mesh = ms.meshes.rectangle(SIDE, SIDE, cells=cells).transformed(translation=(-SIDE / 2, -SIDE / 2, 0))
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e5, mass_density=1e3)
    touch = ms.Contact(obstacles, friction_coefficient=friction, **contact)
    return ms.Scene(sheet, contacts=[touch], gravity=gravity, allow_rigid_motions=True)


def moved(scene: ms.Scene, steps: int, time_step: float, **options) -> ms.Trajectory:
    given = {"integrator": ms.ImplicitEuler(), "progress": False, **options}
    return ms.simulate(scene, steps=steps, time_step=time_step, **given)


def deepest(motion: ms.Trajectory) -> float:
    """Return the largest penetration over all recorded states, in m."""
    return max(
        -float(obstacle.signed_distance(positions, time).min())
        for obstacle in motion.scene.obstacles
        for positions, time in zip(motion.positions, motion.times, strict=True)
    )


def valid(motion: ms.Trajectory, depth: float) -> Answer:
    """Check that a motion is never deeper than `depth` and gains no energy from obstacles at rest."""
    energy = motion.energy
    return both(
        holds("finite", np.isfinite(motion.positions).all() and motion.steps_done == motion.steps),
        below("deepest, m", deepest(motion), depth),
        below("energy gained, over the largest", np.diff(energy).max() / np.abs(energy).max(), 1e-9),
    )


@case("thrown at {} m/s at a wall 1 mm thin, by steps of 1 ms", over=(1, 2, 5))
def thin_wall(speed):
    """Throw a plate at a wall thinner than its displacement per step."""
    wall = ms.obstacles.Box((0.06, 0.06, 1e-3), center=(0, 0, -2e-3))
    motion = moved(plate(wall), 60, 1e-3, velocities=(0, 0, -speed))
    above = holds("before the wall", motion.positions[..., 2].min() > -2e-3)
    return both(valid(motion, 1e-4), above)


@case("thrown at {} m/s at a wall 1 mm thin, where 1/64 of a step could still pass it", over=(200,))
def wall_that_no_step_sees(speed):
    wall = ms.obstacles.Box((0.06, 0.06, 1e-3), center=(0, 0, -2e-3))
    try:
        motion = moved(plate(wall), 5, 1e-3, velocities=(0, 0, -speed))
    except ms.NotConverged as error:
        return holds(
            "an error that says what passes through", "passes through an obstacle" in str(error), str(error)
        )
    return holds("before the wall", motion.positions[..., 2].min() > -2e-3)


@case("dropped from 1 m onto its face, by steps of {:g} s", over=(1e-5, 1e-4, 1e-3, 1e-2))
def dropped_flat(time_step):
    """Check that the plate sinks at most sqrt(m / k) v, 0.13 mm at the middle of the sheet."""
    start = {"velocities": (0, 0, -4.43)} if time_step < 1e-3 else {"start": None}
    height = 1e-4 if time_step < 1e-3 else 1.0
    floor = ms.obstacles.Plane(center=(0, 0, -height))
    steps = round((60e-4 if time_step < 1e-3 else 0.7) / time_step)
    return valid(moved(plate(floor), min(steps, 700), time_step, **start), 3e-4)


@case("sticks below {:g} m/s on a slope, by steps of 0.1 ms", over=(1e-7, 1e-6, 1e-5))
def sticks_to_nothing(sticking_speed):
    """Check a sticking speed at which the displacement per step is near round-off of the positions."""
    ground = ms.obstacles.Plane()
    level = plate(ground, None)
    settled = moved(level, 6, 1.0).positions[-1]
    scene = plate(ground, gravity=(3.0, 0, -GRAVITY), sticking_speed=sticking_speed)
    motion = moved(scene, 60, 1e-4, start=settled)
    fastest = np.abs(motion.velocities[-1, :, 0]).max()
    return both(
        below("iterations a step", motion.iterations / 60, 4),
        below("speed along the slope, over the sticking one", fastest / sticking_speed, 1),
    )


@case("pressed into the corner of three planes with ten times its weight")
def three_planes():
    planes = [
        ms.obstacles.Plane(axis, center=at)
        for axis, at in (((1, 0, 0), (-0.01, 0, 0)), ((0, 1, 0), (0, -0.01, 0)), ((0, 0, 1), (0, 0, 0)))
    ]
    scene = plate(planes, gravity=(-10 * GRAVITY,) * 3)
    return valid(moved(scene, 60, 1e-3, velocities=(-1.0, -1.0, -1.0)), 1e-4)


@case("lies on the corner of a box")
def corner_of_a_box():
    box = ms.obstacles.Box((0.02, 0.02, 0.02), center=(0, 0, -0.01 * np.sqrt(3)), rotation=TIP_UP)
    return valid(moved(plate(box, face_samples=1), 60, 1e-3), 1e-4)


@case("falls onto the {} of a tetrahedron given as a mesh", over=("edge", "tip"))
def tetrahedron(part):
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    place = (
        {"center": (0, 0, -0.011)}
        if part == "edge"
        else {"center": (0, 0, -0.01 * np.sqrt(3) - 1e-3), "rotation": TIP_UP}
    )
    return valid(moved(plate(ms.obstacles.MeshObstacle(TETRAHEDRON, faces, **place)), 60, 1e-3), 1e-4)


@case("a ball that flies at it with {} m/s", over=(1, 10, 40))
def struck_by_a_ball(speed):
    """Check a plate struck by a ball without friction.

    It ends at least as fast as the ball, and the ball sinks in by at most sqrt(m / k) times the speed.
    """
    ball = ms.obstacles.Sphere(0.01, center=(0, 0, -0.0101), motion=lambda t: (0, 0, speed * t))
    motion = moved(plate(ball, None, gravity=(0, 0, 0)), 40, 2.5e-3 / speed)
    return both(
        holds("finite", np.isfinite(motion.positions).all()),
        below("deepest, m", deepest(motion), 1e-4 + 3e-5 * speed),
        holds("as fast as the ball", motion.velocities[-1, :, 2].mean() > 0.95 * speed),
    )


@case("strikes the floor askew, thin and soft, with a friction of {}", over=(0.0, 0.6, 2.0))
def askew(friction):
    """Throw a plate obliquely onto the floor, where it crumples."""
    scene = plate(ms.obstacles.Plane(center=(0, 0, -0.011)), friction)
    start = scene.mesh.rest_positions @ rotation_matrix(np.array([0.8, 0.3, 0.0])).T
    return valid(moved(scene, 20, 1e-3, start=start, velocities=(0, 0, -4.43)), 1e-3)


@case("dragged at 10 m/s, loose, with a friction of 0.6, by steps of {:g} s", over=(1e-4, 1e-3, 1e-2))
def loose_at_10_m_per_s(time_step):
    """Check that the plate slows by mu g as soon as the floor carries it."""
    motion = moved(plate(ms.obstacles.Plane()), round(0.1 / time_step), time_step, velocities=(10.0, 0, 0))
    slowed = 10.0 - motion.velocities[-1, :, 0].mean()
    return both(valid(motion, 1e-5), near("slowed by, m/s", slowed, 0.06 * GRAVITY, rel=2e-2))


@case("thrown flat and askew at a floor of {:g} N/m", over=(1e2, 1e3, 1e4, 1e5, 1e6, 1e7))
def any_stiffness(stiffness):
    scene = plate(ms.obstacles.Plane(center=(0, 0, -2e-3)), contact_stiffness=stiffness)
    return valid(moved(scene, 60, 1e-3, velocities=(0.5, 0, -1.0)), 1e-3)
