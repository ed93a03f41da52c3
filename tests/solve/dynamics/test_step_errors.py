"""Tests of the estimated errors of time steps, and of the warnings about steps that are too long or taken in parts."""

import warnings

import numpy as np
import pytest
from chosen_steps import bouncing_plate, distance, swinging_strip

import magshell as ms

INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]
ORDERS = {"ImplicitEuler": 1, "TRBDF2": 2, "SDIRK2": 2, "SDIRK3": 3}


def names(integrator):
    return type(integrator).__name__


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=names)
def test_estimate_agrees_with_the_error_of_one_step(integrator) -> None:
    """Compare with many short steps, after a step that gives the method its rates. SDIRK3 is better than its estimate."""
    length = 2e-4
    before = swinging_strip(100, 1e-4, ms.SDIRK3()).end
    first = swinging_strip(1, length, integrator, start=before)
    if integrator == ms.TRBDF2():  # whose first step is one of SDIRK2
        before = first.end
        first = swinging_strip(1, length, integrator, start=before)
    exact = swinging_strip(32, length / 32, ms.SDIRK3(), start=before)
    ratio = first.step_errors[0] / distance(first, exact)
    assert 1.5 < ratio < 5.0 if integrator == ms.SDIRK3() else 0.95 < ratio < 1.05


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=names)
def test_estimates_fall_with_the_order_of_the_method_plus_one(integrator) -> None:
    worst = [
        swinging_strip(steps, 0.02 / steps, integrator).step_errors[steps // 2 :].max() for steps in (80, 160)
    ]
    order = np.log2(worst[0] / worst[1]) - 1.0
    assert abs(order - ORDERS[names(integrator)]) < 0.45


def test_estimate_of_a_projective_step_is_that_of_implicit_euler() -> None:
    bar = ms.meshes.box((0.1, 0.02, 0.02), cells=(4, 1, 1))
    solid = ms.Solid(
        bar,
        material=ms.ProjectiveMaterial(young_modulus=1e5, poisson_ratio=0.4),
        mass_density=1e3,
        element="linear",
    )
    scene = ms.Scene(solid, supports=[ms.Pin(bar.vertices_at(x=0.0))], gravity=(0, 0, -9.81))
    euler, projective = (
        ms.simulate(scene, steps=4, time_step=5e-3, integrator=each, progress=False)
        for each in (ms.ImplicitEuler(), ms.ProjectiveDynamics())
    )
    np.testing.assert_allclose(projective.step_errors, euler.step_errors, rtol=1e-5)
    speeds = np.asarray(euler.velocities)
    change = 0.5 * 5e-3 * np.diff(speeds, axis=0)
    np.testing.assert_allclose(euler.step_errors, np.sqrt((change**2).sum(-1).mean(-1)), rtol=1e-12)


def test_estimate_of_a_rigid_body_is_that_of_its_points() -> None:
    """Compare with free fall, in which implicit Euler is off by g dt^2 / 2 in each step."""
    body = ms.RigidBody(mass=1e-3, inertia=1e-8)
    scene = ms.Scene(body, gravity=(0, 0, -9.81), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=3, time_step=1e-3, integrator=ms.ImplicitEuler(), progress=False)
    np.testing.assert_allclose(move.step_errors, 0.5 * 9.81e-6, rtol=1e-9)


def test_prescribed_positions_have_no_error() -> None:
    """Move all of a strip by its support: the estimate of its held vertices is left out."""
    mesh = ms.meshes.rectangle(0.02, 0.02, cells=(1, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    held = ms.Pin(np.arange(mesh.n_vertices), displacement=(0, 0, 1e-2))
    scene = ms.Scene(sheet, supports=[held])
    move = ms.simulate(
        scene,
        steps=2,
        time_step=1e-3,
        support_factor=[0.0, 1.0, 1.0],
        integrator=ms.ImplicitEuler(),
        progress=False,
    )
    assert np.asarray(move.velocities)[1, :, 2].min() > 1.0 and move.step_errors.max() == 0.0


def test_coarse_steps_of_a_swing_are_warned_of() -> None:
    with pytest.warns(
        ms.StepErrorWarning, match=r"more than 1 % of the extent .* Take steps of 0.0\d* s"
    ) as caught:
        coarse = swinging_strip(10, 0.02, ms.ImplicitEuler())
    assert coarse.step_errors.max() > 0.01 * 0.1  # of the longest side
    assert caught[0].message.last_good is not None and "% of the extent" in repr(coarse)
    enough = float(str(caught[0].message).split("Take steps of ")[1].split(" s")[0])
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".*of the extent")  # implicit Euler still loses energy
        fine = swinging_strip(round(0.2 / enough), enough, ms.ImplicitEuler())
    assert fine.step_errors.max() < 0.01 * 0.1


def test_every_motion_with_coarse_steps_warns() -> None:
    """Check that a shorter step, whose error is smaller but still large, is not passed over after a longer one."""
    scene, named = bouncing_plate(), []
    for time_step in (0.05, 0.05, 0.04):
        options = {"time_step": time_step, "integrator": ms.ImplicitEuler(), "progress": False}
        with pytest.warns(ms.StepErrorWarning, match="of the extent") as told:
            ms.simulate(scene, steps=2, **options)
        named += [str(each.message) for each in told]
    assert len(named) == 3 and ["0.05 s long" in text for text in named] == [True, True, False]


def test_steps_that_take_many_factorizations_are_warned_of() -> None:
    """Change the counts of a motion by hand: 12 of 20 steps with 21 factorizations, then 2 of 20."""
    from dataclasses import replace

    from magshell.solve.dynamics.step_errors import warn_of_steps

    move = swinging_strip(20, 1e-3)
    for count in (12, 2):
        counts = np.where(np.arange(20) < count, 21, 20)
        judged = replace(move, _step_factorizations=counts)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            warn_of_steps(judged)
        assert len(caught) == (count == 12)
        if caught:
            assert "12 of 20 steps took more than 20 factorizations" in str(caught[0].message)
            assert "Take steps of 0.0005 s" in str(caught[0].message)
    wrong = replace(move, step_errors=np.full(20, 1.5 * 0.01 * 0.1))  # told even after the other warning
    with pytest.warns(ms.StepErrorWarning, match="more than 1 % of the extent"):
        warn_of_steps(wrong)


@pytest.mark.parametrize(
    "length, rounded", [(0.3, 0.3), (0.7, 0.7), (6e-4, 6e-4), (2.9e-3, 2e-3), (1.0, 1.0)]
)
def test_lengths_are_rounded_down_to_one_digit(length: float, rounded: float) -> None:
    """Check that 0.3, whose quotient by 0.1 is 2.9999..., stays 0.3."""
    from magshell.solve.dynamics.step_errors import _rounded

    assert _rounded(length) == pytest.approx(rounded, rel=1e-12)


def motion_in_parts():
    """Simulate a strip in a field that jumps by more than four iterations of Newton's method can follow in one step."""
    torch = pytest.importorskip("torch")
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(6, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    jump = torch.zeros((6, 3), dtype=torch.float64)
    jump[2:, 2] = 0.08
    options = {"steps": 6, "time_step": 5e-3, "remanent_magnetization": (4e4, 0, 1e4), "damping": 1e-5}

    def move(factor, **others):
        field = factor * jump
        return ms.simulate(scene, applied_flux_density=field, progress=False, **options, **others)

    return move


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_gradient_through_steps_in_parts_warns_that_objectives_may_jump() -> None:
    move = motion_in_parts()
    torch = pytest.importorskip("torch")
    factor = torch.ones((), dtype=torch.float64, requires_grad=True)
    divided, whole = move(factor, solver=ms.Newton(max_iterations=4)), move(factor)
    assert divided.substeps and not whole.substeps
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole.positions.sum().backward()
    with pytest.warns(ms.StepErrorWarning, match="the objective may jump here"):
        divided.positions.sum().backward()


def test_minimize_warns_once_that_objectives_may_jump() -> None:
    move = motion_in_parts()
    torch = pytest.importorskip("torch")
    factor = torch.tensor([0.99], dtype=torch.float64, requires_grad=True)

    def objective(factor):
        return (move(factor, solver=ms.Newton(max_iterations=4)).positions[-1, :, 2].mean() - 0.02) ** 2

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ms.minimize(objective, [factor], ms.optim.LBFGS([factor]), max_iterations=3, progress=False)
    jumps = [each for each in caught if "the objective may jump here" in str(each.message)]
    assert len(jumps) == 1 and jumps[0].category is ms.StepErrorWarning


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.StepErrorWarning")
def test_divided_steps_are_told_during_the_motion(monkeypatch):
    """Let a field jump in every step, with too few iterations for it, so that each step is taken in parts."""
    from magshell._runtime.progress import SolveBar

    notes = []
    monkeypatch.setattr(SolveBar, "note", lambda bar, text: notes.append(text))
    mesh = ms.meshes.rectangle(0.05, 0.01, cells=(20, 4))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    jumps = np.zeros((120, 3))
    jumps[::2, 2] = 0.08
    move = ms.simulate(
        scene,
        steps=len(jumps),
        time_step=5e-3,
        remanent_magnetization=(4e4, 0, 0),
        applied_flux_density=jumps,
        stiffness_damping=1e-4,
        solver=ms.Newton(max_iterations=4),
    )
    assert len(move.substeps) > 40
    [note] = notes  # once
    told = float(note.removesuffix(" s would do").rpartition("steps of ")[2])
    assert note.startswith("ten steps were too long and divided") and any(
        told == pytest.approx(5e-3 / 2.0**k, rel=0.05) for k in range(1, 7)
    )


def test_a_note_of_divided_steps_comes_once():
    from magshell.solve.dynamics.single_motion import Watch

    fractions, notes = [], []
    watch = Watch(fractions.append, notes.append)
    for fraction, shortest in ((0.1, 0.0), (0.2, 1e-3), (0.3, 5e-4)):
        watch(fraction, shortest)
    assert fractions == [0.1, 0.2, 0.3]
    assert notes == ["ten steps were too long and divided: steps of 0.001 s would do"]
