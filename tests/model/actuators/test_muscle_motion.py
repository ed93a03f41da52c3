"""Muscles in motion: the force-velocity curve, its order in time, and results, pictures and files."""

import numpy as np
import pytest
from muscle_curves import FORCE_LENGTH, curve
from muscle_rates import FORCE_VELOCITY

import magshell as ms

torch = pytest.importorskip("torch")


def twitching(
    steps: int, integrator, segments: int | None = None, time: float = 0.1
) -> tuple[ms.Trajectory, ms.Muscle]:
    """Simulate a block whose free half is thrown while its muscle is activated, over `time` [s]."""
    mesh = ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1))
    body = ms.Solid(
        mesh, material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.3), mass_density=1e3, element="linear"
    )
    fibres = ms.fibres_along([(0, 0.02, 0.04), (0.1, 0.02, 0.04)], body, reach=0.05)
    muscle = ms.Muscle(
        body,
        fibres,
        peak_stress=3e4,
        force_length=FORCE_LENGTH,
        force_velocity=FORCE_VELOCITY,
        shortening_rate=5.0,
        segments=segments,
    )
    scene = ms.Scene(body, supports=[ms.Pin(mesh.vertices_at(x=0.0))], actuators=[muscle])
    times = time / steps * np.arange(steps + 1)
    activation = 0.5 * np.sin(0.5 * np.pi * times / time) ** 2
    move = ms.simulate(
        scene,
        steps=steps,
        time_step=time / steps,
        velocities=mesh.rest_positions * (3.0, 1.0, -2.0),
        values={
            muscle: {"activation": activation if segments is None else np.tile(activation[:, None], segments)}
        },
        integrator=integrator,
        solver=ms.MixedNewton(tolerance=1e-11),
        record_every=steps // 10,
        progress=False,
    )
    return move, muscle


@pytest.mark.parametrize("integrator, order", [(ms.ImplicitEuler(), 1), (ms.SDIRK2(), 2), (ms.TRBDF2(), 2)])
def test_the_force_velocity_curve_keeps_the_order_of_the_integrator(integrator, order):
    a, b, c = (twitching(steps, integrator, time=0.02)[0].positions[-1] for steps in (30, 60, 120))
    found = np.log2(np.abs(a - b).max() / np.abs(b - c).max())
    assert found == pytest.approx(order, abs=0.25)


def test_results_contain_the_tension_of_a_moving_muscle():
    move, muscle = twitching(40, ms.TRBDF2(), segments=2)
    for index in (0, 3, -1):
        states = move[muscle].states(index)
        activation = 0.5 * np.sin(0.5 * np.pi * move.times[index] / 0.1) ** 2
        assert move[muscle].activation(index) == pytest.approx(activation, abs=1e-12)
        rows = muscle.body.mesh.tetrahedra[muscle.elements]
        rest = muscle.body.mesh.rest_positions[rows]
        inverse = np.linalg.inv((rest[:, 1:] - rest[:, :1]).swapaxes(1, 2))
        carried, rate = (
            np.einsum(
                "tij,tj->ti", (at[rows][:, 1:] - at[rows][:, :1]).swapaxes(1, 2) @ inverse, muscle.fibres
            )
            for at in (move.positions[index], move.velocities[index])
        )
        length = np.linalg.norm(carried, axis=1)
        rate = np.sum(carried * rate, axis=1) / length
        slowed = curve(FORCE_VELOCITY, torch.tensor(rate / 5.0)).numpy()
        tension = (
            3e4 * muscle.weights * activation * curve(FORCE_LENGTH, torch.tensor(length)).numpy() * slowed
        )
        assert states.stretches[:, 0] == pytest.approx(length, rel=1e-12)
        assert states.tensions[:, 0] == pytest.approx(tension, rel=1e-9, abs=1e-9)
        expected = (tension * muscle.body.mesh.volumes[muscle.elements]).sum() / 0.1
        assert move[muscle].force(index) == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert "tension" in repr(move[muscle])


def test_pictures_and_files_have_the_muscles(tmp_path):
    move, muscle = twitching(10, ms.ImplicitEuler())
    for name in ("activation", "fibre_stretch", "fibre_tension"):
        ms.plot(move, color=name, width=400)
    series = ms.write_series(tmp_path / "twitch.pvd", move, progress=False)
    last = sorted((tmp_path / "twitch").glob("*.vtu"))[-1]
    meshio = pytest.importorskip("meshio")
    found = meshio.read(last).cell_data
    assert series.exists()
    assert found["activation"][0][muscle.elements] == pytest.approx(0.5)
    assert found["fibre_stretch"][0][muscle.elements] == pytest.approx(move[muscle].stretches)
    assert found["fibre_tension"][0][muscle.elements] == pytest.approx(move[muscle].tensions)
    with pytest.raises(ValueError, match="activation"):
        ms.plot(ms.Scene(muscle.body, allow_rigid_motions=True), color="activation")


def test_snapshots_of_an_environment_have_the_actuators_of_their_time():
    from magshell.envs.snapshot import Snapshot

    move, muscle = twitching(10, ms.ImplicitEuler())
    tendon = ms.Tendon([(0.1, 0, 0), (0.1, 0, 0.04)], muscle.body, tension=2.0)
    scene = ms.Scene(muscle.body, supports=move.scene.supports, actuators=[muscle, tendon])
    pulls = {muscle: {"activation": np.linspace(0, 0.2, 5)}, tendon: {"tension": np.linspace(1.0, 3.0, 5)}}
    move = ms.simulate(
        scene, steps=4, time_step=1e-3, values=pulls, load_factor=np.linspace(0, 1, 5), progress=False
    )
    for index in (0, 2, -1):
        now = Snapshot(move, index, np.zeros(0))
        when = range(5)[index]
        assert now[muscle].activation()[0] == pytest.approx(0.05 * when)
        assert float(now[tendon].tension) == pytest.approx(0.25 * when * (1.0 + 0.5 * when))
        assert float(move[tendon].tension[index]) == pytest.approx(0.25 * when * (1.0 + 0.5 * when))
