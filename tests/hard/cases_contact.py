"""Contact: dropped from high, dragged fast, pressed into corners, over sharp edges, any stiffness, friction and step."""

from __future__ import annotations

import numpy as np
from answers import Answer, above, below, both, holds, near
from registry import case

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

GRAVITY, SIDE, THICKNESS, DENSITY = 9.81, 0.05, 2e-3, 1e3
SMOOTHING = 1e-2 * THICKNESS
WEIGHT = DENSITY * THICKNESS * SIDE**2 * GRAVITY  # N, of the plate


def plate(contacts, cells=(4, 4), at=(0.0, 0.0, 0.0), turned=(0.0, 0.0, 0.0), **options) -> ms.Scene:
    """Return a scene of a free square sheet around `at`, rotated by a rotation vector."""
    flat = ms.meshes.rectangle(SIDE, SIDE, cells=cells).transformed(translation=(-SIDE / 2, -SIDE / 2, 0))
    mesh = flat.transformed(rotation_matrix(np.array(turned)), at)
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e7, poisson_ratio=0.3, mass_density=DENSITY)
    given = {"gravity": (0, 0, -GRAVITY), "allow_rigid_motions": True, **options}
    return ms.Scene(sheet, contacts=contacts, **given)


def floor(stiffness=1e3, friction=None, **options) -> ms.Contact:
    plane = ms.obstacles.Plane()
    return ms.Contact(plane, contact_stiffness=stiffness, friction_coefficient=friction, **options)


def moved(scene: ms.Scene, steps: int, time_step: float, **options) -> ms.Trajectory:
    given = {"integrator": ms.ImplicitEuler(), "progress": False, **options}
    return ms.simulate(scene, steps=steps, time_step=time_step, **given)


def floor_force(depth: np.ndarray, stiffness: float) -> float:
    """Compute the force of the floor on vertices at these depths, in N.

    The law is a parabola within the smoothing length, then linear.
    """
    inside = np.clip(depth, 0.0, None)
    early, late = stiffness * inside**2 / (2.0 * SMOOTHING), stiffness * (inside - SMOOTHING / 2.0)
    return float(np.where(inside < SMOOTHING, early, late).sum())


@case("a contact stiffness of {:g} N/m", over=(1e2, 1e3, 1e4, 1e5, 1e6, 1e7))
def lies_on_the_floor(stiffness):
    scene = plate([floor(stiffness)])
    motion = moved(scene, 150, 4e-3)
    borne = floor_force(-motion.positions[-1][:, 2], stiffness)
    return both(
        near("force of the floor", borne, WEIGHT, rel=1e-2),
        below("largest speed", np.abs(motion.velocities[-1]).max(), 1e-3),
    )


@case("dropped from {} m on a corner, by steps of 1 ms", over=(1.0, 10.0))
def dropped(height):
    """Check that the plate comes to rest on the floor, and not in it."""
    scene = plate([floor(1e3, 0.5)], at=(0, 0, height), turned=(0.4, 0.3, 0.0))
    before = round(0.98 * np.sqrt(2.0 * height / GRAVITY) * 1e3)
    motion = moved(scene, before + 1500, 1e-3, record_every=10)
    z = motion.positions[:, :, 2]
    return both(
        holds("all steps taken", motion.steps_done == motion.steps),
        below("deepest in the floor, m", -z.min(), 0.1),
        near("where it ends, m", z[-1].mean(), 0.0, rel=2e-3, scale=1.0),
    )


SLOPE = 0.5  # rad: tan = 0.546


def sliding_speed(friction: float, time_step: float, lagged: bool = False) -> Answer:
    """Compare the acceleration down a slope with g (sin - mu cos), or zero where friction holds."""
    plane = ms.obstacles.slope(SLOPE)
    rubs = ms.Contact(plane, contact_stiffness=1e3, friction_coefficient=friction, lagged_friction=lagged)
    resting = THICKNESS * DENSITY * SIDE**2 * GRAVITY * np.cos(SLOPE) / 25 / 1e3 + SMOOTHING / 2
    scene = plate([rubs], at=tuple(-resting * plane.normal), turned=(0.0, -SLOPE, 0.0))
    duration = 0.1
    motion = moved(scene, round(duration / time_step), time_step, record_every=round(duration / time_step))
    downhill = np.array((-np.cos(SLOPE), 0.0, -np.sin(SLOPE)))
    speed = float((motion.velocities[-1] @ downhill).mean())
    expected = max(0.0, GRAVITY * (np.sin(SLOPE) - friction * np.cos(SLOPE)) * duration)
    return near("speed after 0.1 s", speed, expected, rel=2e-2, scale=GRAVITY * np.sin(SLOPE) * duration)


@case("a slope, and a friction coefficient of {}", over=(0.0, 0.3, 0.6, 2.0))
def slope_with_friction(friction):
    return sliding_speed(friction, 1e-3)


@case("a slope, by steps of {:g} s", over=(1e-5, 1e-4, 1e-2))
def slope_in_steps(time_step):
    return sliding_speed(0.3, time_step)


@case("a slope, friction of the step before")
def slope_with_lagged_friction():
    return sliding_speed(0.3, 1e-3, lagged=True)


@case("dragged at 10 m/s over a floor with friction")
def dragged():
    """Pull the plate by one side; it follows, taut and flat."""
    scene = plate([floor(1e3, 0.5)])
    side = ms.Pin(scene.mesh.vertices_at(x=SIDE / 2), displacement=(1.0, 0, 0))
    held = ms.Scene(
        scene.shell,
        supports=[side],
        contacts=scene.contacts,
        gravity=(0, 0, -GRAVITY),
        allow_rigid_motions=True,
    )
    motion = moved(held, 100, 1e-3, support_factor=lambda t: 10.0 * t, velocities=(10.0, 0, 0))
    trailing = motion.positions[-1].mean(axis=0)
    return both(
        near("where it is, m", trailing[0], 1.0, rel=2e-2),
        below("off the floor, m", np.abs(motion.positions[..., 2]).max(), 5e-3),
    )


@case("thrown at 5 m/s into the corner of a box with sharp edges")
def into_a_corner():
    box = ms.obstacles.Box((0.2, 0.2, 0.2), inside=True)
    scene = plate([ms.Contact(box, contact_stiffness=1e3, friction_coefficient=0.3)], gravity=(0, 0, 0))
    motion = moved(scene, 300, 5e-4, velocities=(5.0, 5.0, 5.0), damping=1e-3)
    return both(
        holds("all steps taken", motion.steps_done == 300 and np.isfinite(motion.positions).all()),
        below("out of the box, m", np.abs(motion.positions).max() - 0.1, 0.03),
    )


@case("dropped over the sharp edge of a box, half of it beyond")
def over_a_sharp_edge():
    """Check that a plate whose center is beyond the edge tips over and falls."""
    box = ms.obstacles.Box((0.1, 0.1, 0.1), center=(-0.05, 0, -0.05))
    touch = ms.Contact(box, contact_stiffness=1e3, friction_coefficient=0.3, face_samples=3)
    scene = plate([touch], at=(0.005, 0, 1e-3))
    motion = moved(scene, 400, 1e-3, record_every=10)
    return both(
        below("height of its center at last, m", motion.positions[-1][:, 2].mean(), -0.1),
        above("height of its lowest point in the first 10 ms, m", motion.positions[1][:, 2].min(), -5e-3),
    )
