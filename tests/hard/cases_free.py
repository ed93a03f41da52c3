"""Unsupported bodies: they fall, fly, rotate in a field, or raise an error where no equilibrium exists."""

from __future__ import annotations

import numpy as np
from answers import at_rest, both, near, refused
from registry import case
from sheets import LENGTH, MAGNETIZATION, shell, strip

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

GRAVITY = 9.81
INTEGRATORS = (ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())


def free_sheet(**options) -> ms.Scene:
    sheet = shell(strip((10, 2)), thickness=2e-3, mass_density=1e3)
    return ms.Scene(sheet, allow_rigid_motions=True, **options)


def center(scene: ms.Scene, vectors: np.ndarray) -> np.ndarray:
    """Compute the mean of vectors at the vertices, weighted by mass."""
    return np.tensordot(scene.shell.vertex_masses, vectors, axes=(0, -2)) / scene.shell.vertex_masses.sum()


@case("nothing holds it and it falls for 1 s in 7 steps, {}", over=INTEGRATORS)
def falling(integrator):
    scene = free_sheet(gravity=(0, 0, -GRAVITY))
    motion = ms.simulate(scene, steps=7, time_step=1.0 / 7.0, integrator=integrator, progress=False)
    expected = np.outer(0.5 * GRAVITY * motion.times**2, (0, 0, -1.0))
    return both(
        near("center", center(scene, motion.displacements), expected, rel=1e-10),
        near("speed", motion.velocities[-1][:, 2], np.full(scene.mesh.n_vertices, -GRAVITY), rel=1e-8),
    )


@case("thrown and spinning, 50 turns of 200 steps")
def thrown():
    scene = free_sheet()
    x = scene.mesh.rest_positions - center(scene, scene.mesh.rest_positions)
    spin = np.array(
        [0.0, 0.0, 2.0 * np.pi * 1.0]
    )  # rad/s: one revolution per second about the axis of the largest inertia
    velocities = np.cross(spin, x) + np.array((0.3, -0.2, 0.5))
    motion = ms.simulate(
        scene, steps=1000, time_step=5e-3, velocities=velocities, record_every=100, progress=False
    )
    moved = center(scene, motion.displacements)
    about = np.cross(
        motion.positions - (moved + center(scene, scene.mesh.rest_positions))[:, None], motion.velocities
    )
    turning = center(scene, about)[:, 2]
    return both(
        near("center", moved, np.outer(motion.times, (0.3, -0.2, 0.5)), rel=1e-9),
        near("angular momentum", turning / turning[0], np.ones(len(turning)), rel=2e-2),
    )


@case("a free magnet in a uniform field swings like a compass needle")
def compass():
    scene = free_sheet(field=ms.UniformField())
    x = scene.mesh.rest_positions - center(scene, scene.mesh.rest_positions)
    mass = scene.shell.vertex_masses
    inertia = float(mass @ (x[:, 0] ** 2 + x[:, 2] ** 2))  # about the y axis through its center
    strength = 2e-4
    moment = MAGNETIZATION * scene.shell.face_volumes.sum()
    period = 2.0 * np.pi * np.sqrt(inertia / (moment * strength))
    tilt = rotation_matrix(np.array([0.0, 0.02, 0.0]))
    start = x @ tilt.T
    motion = ms.simulate(
        scene,
        steps=200,
        time_step=period / 100,
        start=start,
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=(strength, 0, 0),
        progress=False,
    )
    angle = motion.positions[:, :, 2] @ (mass * x[:, 0]) / (mass @ x[:, 0] ** 2)
    expected = angle[0] * np.cos(2.0 * np.pi * motion.times / period)
    return near("tilt(t)", angle, expected, rel=2e-2)


@case("nothing holds it, and statics was asked for: it has no place of its own")
def no_supports():
    sheet = shell(strip((4, 2)))
    return refused(lambda: ms.Scene(sheet), r"leave the sheet free: .*Hold it, or say allow_rigid_motions")


@case("a free magnet in a uniform field: any place and any turn about the field is as good as another")
def neutral_equilibrium():
    scene = free_sheet(field=ms.UniformField())
    return refused(
        lambda: ms.equilibrium(
            scene, remanent_magnetization=(MAGNETIZATION, 0, 0), applied_flux_density=(1e-3, 0, 0)
        ),
        "neither stable nor unstable: its stiffness matrix is singular .* leave the sheet free",
        ms.NotConverged,
    )


@case("hinged at one side and heavy: it swings down by itself, and no load step leads there")
def pendulum():
    sheet = shell(strip((10, 2)), thickness=2e-3, mass_density=10.0, young_modulus=1e8)
    hinge = ms.Pin(sheet.mesh.vertices_at(x=0.0))
    scene = ms.Scene(sheet, supports=[hinge], gravity=(0, 0, -GRAVITY), allow_rigid_motions=True)
    found = ms.equilibrium(scene)
    return both(
        near("height of the center", center(scene, found.positions)[2], -LENGTH / 2, rel=1e-4), at_rest(found)
    )
