"""Tests of motions: closed forms, time-varying inputs, subdivided steps, stopping and continuing, bad input."""

import os
import signal
import threading

import numpy as np
import pytest

import magshell as ms
from magshell._runtime.progress import SolveBar

MESH = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2), irregular=0.2, seed=1)
N_V = MESH.n_vertices
INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())
STRENGTH = (3e4, 0.0, 0.0)


def shell(**properties):
    return ms.Shell(MESH, **{"thickness": 1e-3, "young_modulus": 1e6, "mass_density": 1e3, **properties})


@pytest.fixture
def strip():
    return ms.Scene(shell(), supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())


def simulate(scene, **options):
    given = {"steps": 10, "time_step": 1e-3, "progress": False}
    if scene.fields:
        given |= {"remanent_magnetization": STRENGTH, "applied_flux_density": (0, 0, 2e-3)}
    return ms.simulate(scene, **{**given, **options})


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_free_fall_has_its_closed_form(integrator):
    """Compare with closed forms: backward Euler falls by g dt^2 n (n + 1)/2; the others are exact for a constant
    acceleration.
    """
    scene = ms.Scene(shell(), gravity=(0, 0, -9.81), allow_rigid_motions=True)
    move = simulate(scene, steps=50, integrator=integrator, velocities=(1.0, 0.0, 0.5))
    time = move.times[-1]
    fallen = 9.81 / 2 * (time * (time + 1e-3) if isinstance(integrator, ms.ImplicitEuler) else time**2)
    exact = MESH.rest_positions + np.array((time, 0, 0.5 * time - fallen))
    np.testing.assert_allclose(move.positions[-1], exact, atol=1e-12)
    np.testing.assert_allclose(move.velocities[-1], np.tile((1, 0, 0.5 - 9.81 * time), (N_V, 1)), atol=1e-9)
    np.testing.assert_allclose(move.kinetic_energy[0], 0.5 * 1.25 * shell().vertex_masses.sum())


def test_terminal_speed_of_a_damped_fall():
    """Compare with m g / gamma at every vertex; the vertices have equal masses here."""
    even = ms.meshes.rectangle(0.02, 0.02, cells=(2, 2))
    sheet = ms.Shell(even, thickness=1e-3, young_modulus=1e5, mass_density=1e3)
    scene = ms.Scene(sheet, gravity=(0, 0, -9.81), allow_rigid_motions=True)
    damping = 2.0 * sheet.vertex_masses / 0.01  # so that every vertex takes 5 ms
    move = simulate(scene, steps=100, damping=damping)
    np.testing.assert_allclose(move.velocities[-1, :, 2], -9.81 * 0.005, rtol=1e-8)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_momenta_of_a_free_sheet(integrator):
    """Check a spinning and stretched sheet: momentum is exact, angular momentum to the order of the method."""
    scene = ms.Scene(shell(), allow_rigid_motions=True)
    masses = shell().vertex_masses[:, None]
    turning = np.array((0.1, 0.2, 0.3)) + np.cross((0.0, 3.0, 20.0), MESH.rest_positions)

    def momenta(time_step):
        start = MESH.rest_positions * (1.02, 1.0, 1.0)
        move = simulate(
            scene,
            steps=round(0.02 / time_step),
            time_step=time_step,
            integrator=integrator,
            start=start,
            velocities=turning,
        )
        linear = (masses * move.velocities).sum(axis=1)
        angular = (masses * np.cross(move.positions, move.velocities)).sum(axis=1)
        assert np.ptp(linear, axis=0).max() < 1e-10 * np.abs(linear).max()
        return np.linalg.norm(angular[-1] - angular[0]) / np.linalg.norm(angular[0])

    coarse, fine = momenta(5e-4), momenta(2.5e-4)
    assert fine < max(0.6 * coarse, 2e-4)
    assert fine < (0.05 if isinstance(integrator, ms.ImplicitEuler) else 2e-3)


def test_comes_to_rest_where_the_equilibrium_is(strip):
    move = simulate(strip, steps=300, time_step=1e-2, damping=6e-4)
    rest = ms.equilibrium(strip, remanent_magnetization=STRENGTH, applied_flux_density=(0, 0, 2e-3))
    np.testing.assert_allclose(move.positions[-1], rest.positions, atol=1e-7)
    np.testing.assert_allclose(move.edge_rotations[-1], rest.edge_rotations, atol=1e-5)


@pytest.mark.parametrize("law", [{"stiffness_damping": 0.05}, {"maxwell_modulus": 0.5, "maxwell_time": 0.05}])
def test_viscous_sheets_lose_energy_and_rest_where_elastic_ones_do(strip, law):
    bent = ms.equilibrium(strip, remanent_magnetization=STRENGTH, applied_flux_density=(0, 0, 1e-3))
    off = {"applied_flux_density": (0, 0, 0), "start": bent, "steps": 200, "time_step": 1e-2}
    elastic, viscous = simulate(strip, **off), simulate(strip, **off, **law)
    assert viscous.energy[-1] < 0.05 * elastic.energy[-1]
    assert viscous.energy[20] < elastic.energy[20]


def test_viscosity_does_not_slow_a_rigid_motion():
    scene = ms.Scene(shell(), allow_rigid_motions=True)
    turning = np.cross((0.0, 0.0, 10.0), MESH.rest_positions)
    options = {"steps": 40, "velocities": turning}
    elastic, viscous = simulate(scene, **options), simulate(scene, **options, stiffness_damping=1e-2)
    np.testing.assert_allclose(viscous.kinetic_energy[-1], elastic.kinetic_energy[-1], rtol=1e-3)


def test_stiffness_damping_is_beta_k_for_small_motions():
    """Compare the logarithmic decrement of the first mode with pi beta w, to second order in it."""
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(10, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0, mass_density=1e3)
    load = ms.EdgeLoad(mesh.edges_at(x=0.05), (0, 0, 1e-5))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    omega = 3.516 * np.sqrt(1e6 * (1e-3) ** 2 / 12 / 1e3) / 0.05**2
    bent, period, beta = ms.equilibrium(scene), 2 * np.pi / omega, 0.02 / omega
    options = {"start": bent, "load_factor": 0.0, "steps": 400, "time_step": period / 80, "progress": False}
    free, damped = ms.simulate(scene, **options), ms.simulate(scene, **options, stiffness_damping=beta)
    lost = np.log((free.energy[-1] / free.energy[80]) / (damped.energy[-1] / damped.energy[80]))
    assert lost == pytest.approx(beta * omega**2 * 4 * period, rel=0.03)


def test_load_parameters_may_be_given_in_four_ways(strip):
    steps, dt = 8, 1e-3
    field = lambda t: np.array((0.0, 1e-3 * t / dt, 2e-3))  # noqa: E731
    ends = np.array([field(k * dt) for k in range(steps + 1)])
    by_function = simulate(strip, steps=steps, applied_flux_density=field)
    by_ends = simulate(strip, steps=steps, applied_flux_density=ends)
    np.testing.assert_allclose(by_function.positions, by_ends.positions, atol=1e-13)
    constant = simulate(strip, steps=steps, applied_flux_density=(0, 0, 2e-3))
    a_step = simulate(strip, steps=steps, applied_flux_density=np.tile((0, 0, 2e-3), (steps, 1)))
    np.testing.assert_array_equal(constant.positions, a_step.positions)


def test_a_clamp_that_shakes():
    clamp = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 1e-3))
    scene = ms.Scene(shell(), supports=[clamp])
    move = simulate(scene, steps=100, time_step=5e-3, support_factor=lambda t: np.sin(20 * t))
    held = MESH.vertices_at(x=0.0)
    expected = 1e-3 * np.sin(20 * move.times)
    np.testing.assert_allclose(
        move.positions[:, held, 2], np.tile(expected[:, None], (1, len(held))), atol=1e-12
    )
    assert np.ptp(move.positions[:, MESH.vertices_at(x=0.05), 2]) > 1e-3


def test_going_on_gives_the_same_bits(strip, tmp_path):
    law = {"maxwell_modulus": 0.5, "maxwell_time": 5e-3, "time_step": 0.0009765625}
    whole = simulate(strip, steps=20, **law)
    first = simulate(strip, steps=12, **law)
    first.end.save(tmp_path / "state.npz")
    for start in (first, first.end, ms.MotionState.load(tmp_path / "state.npz")):
        second = simulate(strip, steps=8, start=start, **law)
        np.testing.assert_array_equal(second.positions[-1], whole.positions[-1])
        np.testing.assert_array_equal(second.velocities[-1], whole.velocities[-1])
        np.testing.assert_array_equal(second.times, whole.times[12:])
    (tmp_path / "other").write_bytes(b"nothing")
    with pytest.raises(ValueError, match="not a saved MotionState"):
        ms.MotionState.load(tmp_path / "other")


def test_recording_fewer_states_gives_the_same_states(strip):
    every, third = simulate(strip), simulate(strip, record_every=3)
    np.testing.assert_array_equal(third.positions, every.positions[::3])
    np.testing.assert_array_equal(third.times, every.times[::3])
    np.testing.assert_array_equal(third.end.state, every.end.state)
    assert third.energies.keys() == {"membrane", "bending", "magnetic"}


def test_a_step_that_fails_is_taken_in_parts(strip):
    jump = np.zeros((4, 3))
    jump[2:, 2] = 0.08
    options = {"steps": 4, "time_step": 5e-3, "applied_flux_density": jump, "damping": 1e-5}
    move = simulate(strip, **options, solver=ms.Newton(max_iterations=4))
    assert set(move.substeps) <= {2, 3} and move.substeps[2] >= 2
    assert "in parts" in repr(move)
    assert move.steps_done == 4 and len(move) == 5


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")  # 1e4 T
def test_failed_step_returns_the_motion_before_it(strip):
    field = np.zeros((6, 3))
    field[4:, 2] = 1e4
    with pytest.raises(ms.NotConverged, match=r"step 4 of 6, at 0.004 s") as caught:
        simulate(
            strip, steps=6, applied_flux_density=field, solver=ms.Newton(max_iterations=1, tolerance=1e-3)
        )
    move = caught.value.last_good
    assert move.steps_done == 4 and len(move) == 5
    np.testing.assert_allclose(move.times, 1e-3 * np.arange(5))


def test_non_finite_field_is_named():
    """Put a dipole at the barycenter of a face."""
    mesh = ms.TriangleMesh([(0.0, 0, 0), (3.0, 0, 0), (0, 3.0, 0), (3.0, 3.0, 0)], [(0, 1, 2), (1, 3, 2)])
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, field=ms.Dipoles([(1.0, 1.0, 0.0)], [(0, 0, 1.0)]), allow_rigid_motions=True)
    with pytest.raises(ms.NotConverged, match=r"step 0 .* the magnetic force on vertex [012] is not finite"):
        simulate(scene, applied_flux_density=None)


def test_ctrl_c_keeps_the_motion(strip, monkeypatch):
    begun = threading.Event()
    monkeypatch.setattr(SolveBar, "to", lambda bar, fraction: begun.set() if fraction > 0.0 else None)

    def interrupt_once_begun() -> None:
        if begun.wait(timeout=600.0):
            os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt_once_begun, daemon=True).start()
    with pytest.raises(ms.Interrupted, match="interrupted after") as caught:
        simulate(strip, steps=300_000, record_every=1000)
    move = caught.value.last_good
    assert 0 < move.steps_done < 300_000
    assert len(move) == move.steps_done // 1000 + 1


def test_the_same_bits_on_any_number_of_threads(strip):
    before = ms.num_threads()
    try:
        found = []
        for threads in (1, 2):
            ms.set_num_threads(threads)
            found.append(simulate(strip).positions)
    finally:
        ms.set_num_threads(before)
    np.testing.assert_array_equal(*found)


class Unknown(ms.TRBDF2):
    _name = "bdf3"


BAD = [
    ({"steps": 0}, "steps must be an integer of at least 1, got 0"),
    ({"steps": 2.5}, "steps must be an integer"),
    ({"steps": 10**12}, r"steps must be below 2\^31, about 2.1e\+09, got 1000000000000"),
    ({"integrator": Unknown()}, 'no integrator is called "bdf3"'),
    ({"time_step": 0.0}, r"time_step \[s\] must be positive"),
    ({"time_step": np.nan}, r"time_step \[s\] must be finite"),
    ({"applied_flux_density": np.zeros((7, 3))}, r"\(steps, ...\) = \(10, 3\)"),
    ({"applied_flux_density": None}, "applied_flux_density"),
    ({"applied_flux_density": lambda t: (0, 0)}, r"applied_flux_density at 0 s \[T\] must have shape \(3,\)"),
    ({"applied_flux_density": lambda t: (0, 0, np.inf)}, "applied_flux_density at 0 s .* finite"),
    ({"load_factor": np.zeros(3)}, "load_factor"),
    ({"damping": -1.0}, "damping .* must not be negative"),
    ({"damping": np.ones(3)}, r"\(n_v,\)"),
    ({"stiffness_damping": -1.0}, r"stiffness_damping \[s\] must not be negative, got -1"),
    ({"maxwell_modulus": 1.0}, "maxwell_time"),
    ({"maxwell_modulus": []}, r"maxwell_modulus \[1\] must be a number or have shape \(n,\), got \(0,\)"),
    ({"maxwell_modulus": np.ones((2, 1))}, r"must be a number or have shape \(n,\), got \(2, 1\)"),
    ({"maxwell_modulus": (1.0, -0.1)}, "maxwell_modulus .* must not be negative, but the smallest is -0.1"),
    ({"maxwell_modulus": (1.0, 1.0), "maxwell_time": (1.0, 0.0)}, r"maxwell_time \[s\] must be positive"),
    ({"maxwell_modulus": (1.0, 1.0), "maxwell_time": 1.0}, "there are 2 moduli and 1 times"),
    ({"maxwell_modulus": 1.0, "maxwell_time": (1.0, 2.0)}, "there are 1 moduli and 2 times"),
    ({"maxwell_modulus": (1.0, np.nan), "maxwell_time": (1.0, 2.0)}, r"maxwell_modulus\[1\] is nan"),
    ({"velocities": np.zeros((2, 3))}, r"velocities \[m/s\]"),
    ({"start": np.zeros((2, 3))}, "start"),
    ({"start": np.zeros((N_V, 3))}, "leaves face 0 without area"),
    ({"integrator": "bdf2"}, "integrator must be"),
    ({"solver": "newton"}, "solver must be"),
    ({"record_every": 0}, "record_every"),
    (
        {"steps": 10, "record_every": 11},
        "record_every must be at most steps = 10, got 11: only the start would be recorded",
    ),
    ({"adjoint_storage": "all"}, "adjoint_storage must be"),
    ({"remanent_magnetization": None}, "remanent_magnetization"),
]


@pytest.mark.parametrize("options, words", BAD)
def test_bad_options_are_refused(strip, options, words):
    with pytest.raises(ValueError, match=words):
        simulate(strip, **options)


def test_bad_scenes_are_refused(strip):
    with pytest.raises(ValueError, match="scene must be a Scene"):
        ms.simulate("scene", steps=1, time_step=1.0)
    light = ms.Scene(shell(mass_density=None), supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    with pytest.raises(ValueError, match="no mass_density"):
        ms.simulate(light, steps=1, time_step=1.0)
    other = ms.Scene(shell(), supports=[ms.Clamp(MESH.edges_at(x=0.0))])
    with pytest.raises(ValueError, match="of another scene"):
        simulate(other, start=simulate(strip))
    with pytest.raises(ValueError, match="degrees of freedom"):
        simulate(ms.Scene(shell(bending="hinge"), supports=strip.supports), start=simulate(strip).end)


def test_motion_too_large_for_the_memory_is_refused_at_once(strip, monkeypatch):
    with pytest.raises(MemoryError, match=r"2,000,000,000 steps need .* GB .*record_every.*start="):
        simulate(strip, steps=2 * 10**9)
    monkeypatch.setattr("magshell.solve.dynamics.motion_inputs._physical_memory", lambda: 10**5)
    with pytest.raises(MemoryError, match="record fewer"):
        simulate(strip, steps=100)
    assert len(simulate(strip, steps=100, record_every=100)) == 2
    monkeypatch.setattr(
        "magshell.solve.dynamics.motion_inputs._physical_memory", lambda: None
    )  # the system does not tell
    assert len(simulate(strip, steps=100)) == 101
