"""Time steps from 1e-7 to 10 s for a sheet that swings in a tenth of a second, and fields that jump at every step."""

from __future__ import annotations

import numpy as np
from answers import below, both, holds, near
from model_access import LoadParameters, Problem
from registry import case
from scipy.linalg import eigh
from sheets import LENGTH, MAGNETIZATION, cantilever, shell, strip

import magshell as ms

GRAVITY = 9.81
INTEGRATORS = (ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3(), ms.ImplicitEuler())


def heavy_strip() -> ms.Scene:
    sheet = shell(strip((10, 1)), mass_density=1e3)
    return cantilever(sheet, gravity=(0, 0, -GRAVITY))


@case("ten steps of 1e-7 s: inertia is 1e9 times the stiffness", over=INTEGRATORS)
def shortest_steps(integrator):
    """Check free fall before a wave arrives from the clamp; the end falls by 5 pm in 1e-6 s."""
    motion = ms.simulate(heavy_strip(), steps=10, time_step=1e-7, integrator=integrator, progress=False)
    free = motion.scene.mesh.rest_positions[:, 0] > LENGTH / 2
    velocities = motion.velocities[-1][free, 2]
    return near("speed at 1e-6 s", velocities, np.full(free.sum(), -GRAVITY * 1e-6), rel=1e-4)


@case("six steps of 10 s: inertia is 1e-5 of the stiffness", over=INTEGRATORS)
def longest_steps(integrator):
    """Check that L-stable integrators end in the static equilibrium after steps far too long to resolve the motion."""
    scene = heavy_strip()
    rest = ms.equilibrium(scene)
    motion = ms.simulate(scene, steps=6, time_step=10.0, integrator=integrator, progress=False)
    return near("end of the motion", motion.positions[-1], rest.positions, rel=1e-5, scale=LENGTH)


@case("steps of {:g} s, the same 2 ms", over=(1e-6, 1e-5, 1e-4))
def same_motion_in_any_steps(time_step):
    """Compare with the smooth motion of the slowest modes, which all of these steps resolve."""
    scene = heavy_strip()
    steps = round(2e-3 / time_step)
    motion = ms.simulate(scene, steps=steps, time_step=time_step, record_every=steps, progress=False)
    return near("end of the motion", motion.displacements[-1], exact_fall(scene, 2e-3), rel=1e-3)


def exact_fall(scene: ms.Scene, time: float) -> np.ndarray:
    """Compute the displacements (n_v, 3) [m] a time [s] after gravity begins to act, by all modes of the linear problem."""
    problem = Problem(scene, LoadParameters(gravity_factor=1.0))
    model = problem.model
    q = model.rest_state()
    stiffness, force = problem.hessian(q, reduced=True), -model.reduce(problem.gradient(q))
    mass = np.asarray(model.free_weights(scene.shell.vertex_masses))
    moving = mass > 0
    # Edge rotations have no mass: they are condensed statically.
    inner = stiffness[np.ix_(~moving, ~moving)]
    coupling = stiffness[np.ix_(moving, ~moving)]
    condensed = stiffness[np.ix_(moving, moving)] - coupling @ np.linalg.solve(inner, coupling.T)
    squares, modes = eigh(condensed, np.diag(mass[moving]))
    amplitudes = (modes.T @ force[moving]) * (1.0 - np.cos(np.sqrt(np.abs(squares)) * time)) / squares
    moved = np.zeros(len(mass))
    moved[moving] = modes @ amplitudes
    return np.asarray(model.positions(model.expand(moved)))


@case("a field that jumps at every step, a thousand times what the strip can follow")
def strong_jumps():
    scene = cantilever(shell(strip((20, 2)), mass_density=1e3), field=ms.UniformField())
    rng = np.random.default_rng(3)
    fields = 50e-3 * rng.choice([-1.0, 1.0], size=(100, 3))
    motion = ms.simulate(
        scene,
        steps=100,
        time_step=5e-3,
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=fields,
        progress=False,
    )
    reach = np.linalg.norm(motion.positions, axis=2).max()
    return both(
        holds("all steps taken", motion.steps_done == 100 and np.isfinite(motion.positions).all()),
        below("how far it reaches, over its length", reach / LENGTH, 1.1),
    )


@case("a weak field that jumps at every step, against the same scheme in dense algebra")
def weak_jumps():
    """Compare with implicit Euler of the linear problem, (M / dt^2 + K) x = M (x^ + dt v^) / dt^2 + f_n, in numpy."""
    scene = cantilever(shell(strip((10, 1)), mass_density=1e3), field=ms.UniformField())
    rng = np.random.default_rng(4)
    fields, steps, dt = 1e-9 * rng.choice([-1.0, 1.0], size=(60, 3)), 60, 2e-3
    motion = ms.simulate(
        scene,
        steps=steps,
        time_step=dt,
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=fields,
        integrator=ms.ImplicitEuler(),
        solver=ms.MixedNewton(tolerance=1e-13),
        progress=False,
    )
    problem = Problem(scene, LoadParameters(), np.array([MAGNETIZATION, 0.0, 0.0]))
    model = problem.model
    q = model.rest_state()
    stiffness = problem.hessian(q, reduced=True)
    inertia = np.diag(np.asarray(model.free_weights(scene.shell.vertex_masses))) / dt**2
    x = v = np.zeros(len(stiffness))
    for field in fields:
        load_parameters = LoadParameters(applied_flux_density=field).of(scene)
        force = -model.reduce(np.asarray(model.gradient(q, load_parameters)))
        now = np.linalg.solve(inertia + stiffness, inertia @ (x + dt * v) + force)
        x, v = now, (now - x) / dt
    expected = np.asarray(model.positions(model.expand(x)))
    return near("end of the motion", motion.displacements[-1], expected, rel=1e-4)
