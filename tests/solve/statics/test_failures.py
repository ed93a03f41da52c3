"""Failed solves: the reason in the message, and the last good state."""

import os
import re
import signal
import threading
import time

import numpy as np
import pytest
from crossed_cells import crossed

import magshell as ms

LENGTH, WIDTH, THICKNESS, YOUNG = 0.1, 0.01, 1e-3, 1e6  # m, Pa
HASTY = ms.MixedNewton(max_iterations=3, min_load_step=0.5, max_relaxation_steps=1)


def cantilever(field, cells=(20, 2)):
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG, poisson_ratio=0.0)
    return ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=field)


def short_grid(height):
    """Build a sampled field that ends `height` above and below the strip."""
    return ms.SampledField.from_function(
        lambda x: np.tile((0.0, 0.0, 5e-3), (len(x), 1)),
        (-0.02, -0.02, -height),
        (0.12, 0.03, height),
        (4, 4, 4),
    )


def test_too_few_iterations():
    scene = cantilever(ms.UniformField())
    with pytest.raises(
        ms.NotConverged, match=r"stopped at .* of the way .* iterations: .*`error.last_good`"
    ) as caught:
        ms.equilibrium(
            scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, 20e-3), solver=HASTY
        )
    good = caught.value.last_good
    assert isinstance(good, ms.Equilibrium) and good.scene is scene
    assert 0.0 <= good.load_fraction < 1.0 and not good.stable
    assert np.isfinite(good.positions).all() and "of the way" in repr(good)
    # The last good state is an equilibrium under its own load parameters, and can be a start.
    assert good.applied_flux_density[2] == pytest.approx(20e-3 * good.load_fraction)
    found = ms.equilibrium(
        scene, remanent_magnetization=(4e4, 0, 0), applied_flux_density=(0, 0, 20e-3), start=good
    )
    assert found.stable and found.positions[:, 2].max() > 0.05


def test_a_sheet_that_leaves_a_sampled_field():
    """Check that NaN outside the grid gives neither an equilibrium nor a message about a matrix."""
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(cantilever(short_grid(2e-3)), remanent_magnetization=(4e4, 0, 0))
    good = caught.value.last_good
    assert good.load_fraction < 1.0 and np.isfinite(good.positions).all() and np.isfinite(good.energy)


def test_a_sheet_that_starts_outside_a_sampled_field():
    field = short_grid(2e-3)
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(20, 2)).transformed(translation=(0, 0, 0.05))
    shell = ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG)
    scene = ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=field)
    with pytest.raises(
        ms.NotConverged, match="not finite: a face has no area, or lies where a field has no value"
    ):
        ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0))


def test_a_neutral_equilibrium_is_no_stable_one():
    """Use a sheet without supports and loads: its Hessian is singular."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(6, 2))
    scene = ms.Scene(ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG), allow_rigid_motions=True)
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(scene)
    assert not caught.value.last_good.stable


def bent_far(mesh, max_relaxation_steps=20):
    """Solve a thin strip in a field that makes beta = 300."""
    shell = ms.Shell(mesh, thickness=LENGTH / 400, young_modulus=YOUNG, poisson_ratio=0.0)
    scene = ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    flux_density = 300.0 * YOUNG * shell.thickness[0] ** 2 / (12.0 * 1e5 * LENGTH**2)
    return ms.equilibrium(
        scene,
        remanent_magnetization=(1e5, 0, 0),
        applied_flux_density=(-0.87 * flux_density, 0, 0.5 * flux_density),
        solver=ms.MixedNewton(max_relaxation_steps=max_relaxation_steps),
    )


def with_a_cap(height):
    """Build a strip with a vertex close to a boundary edge in its middle; height: over that edge's length."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(20, 2))
    edge = mesh.edges_at(y=0.0)[10]
    face = mesh.edge_faces[edge].max()
    tip = mesh.edge_midpoints[edge] + (0.0, height * mesh.edge_lengths[edge], 0.0)
    a, b, c = mesh.faces[face]
    new = mesh.n_vertices
    faces = np.concatenate([np.delete(mesh.faces, face, axis=0), [[a, b, new], [b, c, new], [c, a, new]]])
    return ms.TriangleMesh(np.concatenate([mesh.rest_positions, [tip]]), faces)


def test_a_nearly_degenerate_face_is_named():
    """Check that the message does not suggest supports for a sheet that is clamped."""
    mesh = with_a_cap(1e-7)
    worst = mesh.quality.worst(1)[0]
    with pytest.raises(
        ms.NotConverged, match=rf"Face {worst} \(.*\) is nearly degenerate.*leave such faces out"
    ) as caught:
        bent_far(mesh)
    assert "smaller steps" not in str(caught.value) and "free" not in str(caught.value)


def test_a_failure_says_where_and_what_was_tried():
    solver = ms.MixedNewton(max_iterations=3, min_load_step=0.2, max_relaxation_steps=1)
    with pytest.raises(ms.NotConverged) as caught:
        ms.equilibrium(
            cantilever(ms.UniformField()),
            remanent_magnetization=(4e4, 0, 0),
            applied_flux_density=(0, 0, 20e-3),
            solver=solver,
        )
    text = str(caught.value)
    assert "Load steps were shortened to 0.2 of the way." in text
    assert "Relaxation took 1 step; it still moved the sheet by" in text
    assert "The forces are out of balance most at vertices" in text
    assert "max_relaxation_steps" in text and "first_load_step" not in text


def test_a_failure_beside_flat_faces_names_them():
    """Use faces so flat that shorter load steps do not help."""
    mesh = crossed(LENGTH, WIDTH, (20, 2), [0.0002, 0.5])
    with pytest.raises(ms.NotConverged) as caught:
        bent_far(
            mesh, max_relaxation_steps=2
        )  # with 20 the round-off of these faces decides whether the solve succeeds
    text = str(caught.value)
    named = re.search(
        r"(?:faces, namely|Face) (\d+) \(largest angle 179\.\d+ deg, height .* of the thickness\).* almost flat",
        text,
    )
    assert mesh.quality.largest_angles[int(named[1])] > np.radians(179)
    assert "mend the mesh there first" in text and "smaller steps" not in text


def test_a_failure_beside_an_unstable_state_says_along_what_the_energy_falls():
    """Check a strip magnetized against the field: two steps do not lead from the unstable flat state to the turned one."""
    with pytest.raises(ms.NotConverged, match="The energy still falls along a motion at vertices"):
        ms.equilibrium(
            cantilever(ms.UniformField()),
            remanent_magnetization=(6e4, 0, 0),
            applied_flux_density=(-0.05, 0, 1e-6),
            solver=ms.MixedNewton(max_relaxation_steps=2),
        )


def test_exception_of_a_field_reaches_the_caller():
    def broken(points):
        raise ZeroDivisionError("the coil is off")

    scene = cantilever(ms.CustomField(broken, length_scale=LENGTH))
    with pytest.raises(ZeroDivisionError, match="the coil is off"):
        ms.equilibrium(scene, remanent_magnetization=(4e4, 0, 0))


def slow_field():
    def flux_density(points):
        time.sleep(0.02)
        return np.tile((0.0, 0.0, 5e-3), (len(points), 1))

    return ms.CustomField(flux_density, length_scale=LENGTH)


def press_ctrl_c(after):
    """Send an interrupt once from another thread; return its timer."""
    timer = threading.Timer(after, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    return timer


def long_solve(progress):
    """Solve by standard Newton in an extreme field on a fine mesh, which takes many seconds."""
    scene = cantilever(ms.UniformField(), cells=(400, 32))
    ms.equilibrium(
        scene,
        remanent_magnetization=(4e4, 0, 0),
        applied_flux_density=(1e-3, 0, 0.5),
        solver=ms.Newton(max_iterations=500, min_load_step=1e-6, max_relaxation_steps=10**6),
        progress=progress,
    )


def long_solve_in_a_slow_field(progress):
    ms.equilibrium(
        cantilever(slow_field()),
        remanent_magnetization=(4e5, 0, 0),
        solver=ms.Newton(max_iterations=500),
        progress=progress,
    )


def long_solve_with_a_slow_progress(progress):
    def slow(*arguments):
        progress(*arguments)
        time.sleep(0.05)

    long_solve(slow)


@pytest.mark.parametrize(
    "solve",
    [long_solve, long_solve_in_a_slow_field, long_solve_with_a_slow_progress],
    ids=lambda f: f.__name__,
)
def test_ctrl_c_hands_back_the_last_good_state(solve):
    pressed = []

    def press_once(progress, residual):
        if not pressed:
            pressed.append(press_ctrl_c(0.3))

    try:
        with pytest.raises(ms.Interrupted, match=r"interrupted at .* of the way") as caught:
            solve(press_once)
    finally:  # a solve that ended before must not leave a Ctrl-C to the next test
        pressed[0].cancel()
    assert isinstance(caught.value, KeyboardInterrupt)
    good = caught.value.last_good
    assert isinstance(good, ms.Equilibrium) and np.isfinite(good.positions).all()
    assert 0.0 <= good.load_fraction < 1.0


def sliding_onto_the_floor() -> ms.Scene:
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(40, 20), irregular=0.2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, mass_density=1e3)
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, -1e-3)), friction_coefficient=0.6)
    return ms.Scene(sheet, contacts=[floor], gravity=(0, 0, -9.81), allow_rigid_motions=True)


def simulate_sliding(scene: ms.Scene, **options) -> np.ndarray:
    velocities = np.tile((1.0, 0.0, -1.0), (scene.mesh.n_vertices, 1))
    integrator = ms.ImplicitEuler()
    return ms.simulate(
        scene, steps=6, time_step=1e-3, velocities=velocities, integrator=integrator, **options
    ).positions


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("call", [1, 2, 4, 9, 20, 40])
def test_an_interrupted_motion_leaves_nothing_behind(monkeypatch, call):
    """Stop a motion that takes damped iterations only, which freeze the normal forces meanwhile.

    The solve calls back a few times a second. To make the interrupted call the same on every machine, each call takes
    so long that the next possible one is made.
    """
    scene = sliding_onto_the_floor()
    calls = []

    def interrupt(*_):
        calls.append(None)
        time.sleep(0.06)
        if len(calls) == call:
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("magshell.solve.dynamics.simulate.SolveBar.to", interrupt)
        with pytest.raises(ms.Interrupted) as caught:
            simulate_sliding(scene, solver=ms.Newton(max_iterations=1))
    assert caught.value.last_good.steps_done > 0 or call < 40  # not in the first step alone
    np.testing.assert_array_equal(simulate_sliding(scene), simulate_sliding(sliding_onto_the_floor()))


@pytest.mark.parametrize("field_factor", [-1e300, 1e300, -1e308])
def test_fields_beyond_all_bounds_end_a_solve(field_factor):
    mesh = ms.meshes.rectangle(0.1, 0.05, cells=(3, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        field=[ms.UniformField(), ms.Dipoles([(0.05, 0, 0.1)], [(0, 0, 0.1)])],
    )
    with pytest.raises(ms.NotConverged):
        ms.equilibrium(
            scene,
            remanent_magnetization=(1e4, 0, 2e3),
            applied_flux_density=(0, 0, 1e-3),
            field_factor=field_factor,
            solver=ms.MixedNewton(max_iterations=10, max_relaxation_steps=5),
        )
