"""Impacts whose restitution is known: a bar on a wall, two bars, and a stiff cube on a plane.

`PYTHONPATH=. python tests/support/impacts.py` prints restitution, energy gained, and factorizations per step by integrator.
"""

import numpy as np

import magshell as ms

Impact = tuple[ms.Trajectory, np.ndarray, float]
INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.TRBDF2(implicit_contact=True))


def rebound(move: ms.Trajectory, mass: np.ndarray, speed: float) -> float:
    """Return the mean speed upwards at the end over that downwards at the start."""
    return float(mass @ move.velocities[-1][:, 2]) / mass.sum() / speed


def bar_on_a_wall(integrator, time_step: float, stiffness: float, phase: float = 0.0) -> Impact:
    """Throw a bar of 50 nodes in a row, of length, modulus and density 1, whose contact lasts 2 s, onto a plane.

    stiffness: of the plane [N/m] per area of the bar. phase: of the impact within a step. Returns motion, masses and speed.
    """
    side, speed = 0.02, 0.01
    gap = speed * time_step * (1.0 + phase)
    mesh = ms.meshes.box((side, side, 1.0), cells=(1, 1, 49)).transformed(translation=(0, 0, gap))
    material = ms.NeoHookean(young_modulus=1.0, poisson_ratio=0.0)
    bar = ms.Solid(mesh, material=material, mass_density=1.0, element="linear")
    foot = np.flatnonzero(mesh.rest_positions[:, 2] < gap + 1e-9)
    wall = ms.Contact(
        ms.obstacles.Plane(),
        contact_stiffness=stiffness * side**2 / len(foot),
        smoothing=1e-4,
        vertices=foot,
    )
    scene = ms.Scene(bar, contacts=[wall], allow_rigid_motions=True)
    steps = int(np.ceil((4.0 + gap / speed) / time_step))
    return _thrown(scene, steps, time_step, (0, 0, -speed), integrator), bar.vertex_masses, speed


def bars_that_collide(integrator, cells: int) -> Impact:
    """Throw two equal bars at each other along x, in steps in which a wave passes one cell."""
    side, sound, speed, reach = 0.05, np.sqrt(1e3), 0.1, 1e-4
    material = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.0)
    bars = [
        ms.Solid(
            ms.meshes.box((1.0, side, side), cells=(cells, 1, 1)).transformed(translation=(x, 0, 0)),
            material=material,
            mass_density=1e3,
            element="linear",
        )
        for x in (-1.0 - reach, reach)
    ]
    touch = ms.Contact(*bars, activation_distance=reach, min_distance=0.0)
    scene = ms.Scene(bars, contacts=[touch], allow_rigid_motions=True)
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[: bars[0].mesh.n_vertices, 0] = speed
    velocities[bars[0].mesh.n_vertices :, 0] = -speed
    time_step = 1.0 / sound / cells
    move = _thrown(scene, round(2.6 * cells), time_step, velocities, integrator)
    return move, bars[0].vertex_masses, speed


def cube_on_a_plane(integrator, ratio: float, phase: float) -> Impact:
    """Throw a stiff cube onto a plane, in steps of `ratio` times the contact time pi sqrt(m/k) of a point."""
    speed, stiffness = 0.01, 1e4
    contact_time = np.pi / np.sqrt(stiffness)
    time_step = ratio * contact_time
    gap = speed * time_step * (2.0 + phase)
    mesh = ms.meshes.box((1.0, 1.0, 1.0), cells=(1, 1, 1)).transformed(translation=(0, 0, gap))
    material = ms.NeoHookean(young_modulus=100.0 * stiffness, poisson_ratio=0.3)
    cube = ms.Solid(mesh, material=material, mass_density=1.0, element="linear")
    foot = np.flatnonzero(mesh.rest_positions[:, 2] < gap + 1e-9)
    ground = ms.Contact(
        ms.obstacles.Plane(), contact_stiffness=stiffness / len(foot), smoothing=1e-6, vertices=foot
    )
    scene = ms.Scene(cube, contacts=[ground], allow_rigid_motions=True)
    steps = int(np.ceil(12 + 3 / ratio))
    return _thrown(scene, steps, time_step, (0, 0, -speed), integrator), cube.vertex_masses, speed


def _thrown(scene, steps, time_step, velocities, integrator) -> ms.Trajectory:
    return ms.simulate(
        scene,
        steps=steps,
        time_step=time_step,
        velocities=velocities,
        integrator=integrator,
        progress=False,
    )


def _line(name: str, integrator, impacts: list[Impact], axis: int = 2) -> None:
    """Print the restitutions of some impacts, their largest gain of energy and their cost."""
    back = [rebound(*each) for each in impacts]
    gain = max(move.energy.max() / move.energy[0] - 1.0 for move, _, _ in impacts)
    cost = sum(move.factorizations for move, _, _ in impacts) / sum(move.steps for move, _, _ in impacts)
    print(
        f"{name}, {integrator!r}: restitution {min(back):.3f} to {max(back):.3f}, mean {np.mean(back):.3f}, "
        f"energy gained {gain:.1e}, {cost:.1f} factorizations per step",
        flush=True,
    )


def main() -> None:
    """Print one line for each impact and integrator."""
    for integrator in INTEGRATORS:
        for stiffness in (50.0, 2500.0):
            for steps in (20, 100):
                impacts = [
                    bar_on_a_wall(integrator, 2.0 / steps, stiffness, phase) for phase in (0.0, 0.37, 0.71)
                ]
                _line(f"bar on a wall of {stiffness:g} Pa/m, {steps} steps", integrator, impacts)
        for ratio in (2.0, 20.0, 200.0):
            impacts = [cube_on_a_plane(integrator, ratio, phase) for phase in np.linspace(0.0, 1.0, 60)]
            _line(f"cube on a plane, step over contact time {ratio:g}", integrator, impacts)
        move, mass, speed = bars_that_collide(integrator, 50)
        back = -(mass @ move[move.scene.bodies[0]].velocities[-1][:, 0]) / mass.sum() / speed
        print(f"two bars, {integrator!r}: restitution {back:.3f}", flush=True)


if __name__ == "__main__":
    main()
