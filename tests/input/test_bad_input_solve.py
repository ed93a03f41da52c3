"""Messages for bad input to a solve, DESIGN.md 5."""

import numpy as np
import pytest
from bad_input import (
    MESH,
    N_E,
    N_F,
    N_V,
    NOT_NUMBERS,
    refused,
    scene,
    shell,
    solve,
    solve_magnetic,
    with_entry,
)

import magshell as ms

test_solve_is_refused = refused(
    [
        (
            "no magnetization",
            lambda: solve_magnetic(remanent_magnetization=None),
            r"so remanent_magnetization \[A/m\] is",
        ),
        (
            "no field value",
            lambda: solve_magnetic(applied_flux_density=None),
            r"so applied_flux_density \[T\] is needed",
        ),
        (
            "no field",
            lambda: solve(remanent_magnetization=(1, 0, 0)),
            "remanent_magnetization was given, .* no field",
        ),
        (
            "no uniform field",
            lambda: solve(applied_flux_density=(1, 0, 0)),
            "but the scene has no UniformField",
        ),
        (
            "magnetization's shape",
            lambda: solve_magnetic(remanent_magnetization=np.ones(N_F)),
            rf"remanent_magnetization \[A/m\] must have shape \(n_f, 3\) = \({N_F}, 3\) or .* got \({N_F},\)",
        ),
        (
            "magnetization nan",
            lambda: solve_magnetic(remanent_magnetization=with_entry((N_F, 3), (4, 1), np.nan)),
            r"remanent_magnetization\[4, 1\] is nan",
        ),
        (
            "magnetization ragged",
            lambda: solve_magnetic(remanent_magnetization=[[1, 2, 3], [1]]),
            rf"remanent_magnetization \[A/m\] {NOT_NUMBERS}",
        ),
        (
            "magnetization string",
            lambda: solve_magnetic(remanent_magnetization="up"),
            rf"{NOT_NUMBERS}, got 'up'",
        ),
        (
            "magnetization bools",
            lambda: solve_magnetic(remanent_magnetization=np.ones((N_F, 3), bool)),
            NOT_NUMBERS,
        ),
        (
            "flux densities of two components",
            lambda: solve_magnetic(applied_flux_density=np.ones((5, 2))),
            r"applied_flux_density \[T\] must have shape \(3,\), or \(k, 3\) for k load cases, got \(5, 2\)",
        ),
        (
            "a field as value",
            lambda: solve_magnetic(applied_flux_density=ms.UniformField()),
            rf"\[T\] {NOT_NUMBERS}",
        ),
        ("factor nan", lambda: solve(load_factor=np.nan), "load_factor is nan"),
        (
            "factors",
            lambda: solve(support_factor=((1, 2),)),
            r"support_factor \[1\] must be a number, or have shape \(k,\) for k load cases, got \(1, 2\)",
        ),
        ("factor bool", lambda: solve(load_factor=True), rf"load_factor \[1\] {NOT_NUMBERS}, got True"),
        ("scene", lambda: solve(shell()), "scene must be a Scene, got Shell"),
        ("another's start", lambda: solve(start=solve()), "start is an equilibrium of another scene"),
        (
            "start's shape",
            lambda: solve(start=np.zeros((3, 3))),
            rf"start \[m\] must have shape \(n_v, 3\) = \({N_V}, 3\), got \(3, 3\)",
        ),
        ("start nan", lambda: solve(start=with_entry((N_V, 3), (2, 1), np.nan)), r"start\[2, 1\] is nan"),
        ("start string", lambda: solve(start=MESH.rest_positions.astype(str)), rf"start \[m\] {NOT_NUMBERS}"),
        ("start complex", lambda: solve(start=MESH.rest_positions + 0j), rf"start \[m\] {NOT_NUMBERS}"),
        (
            "start in a point",
            lambda: solve(start=np.ones((N_V, 3))),
            r"start \[m\] leaves face 0 without area",
        ),
        ("solver", lambda: solve(solver="newton"), "solver must be a MixedNewton or a Newton, got str"),
        ("stable", lambda: solve(require_stable="no"), "require_stable must be True or False, got 'no'"),
        (
            "progress",
            lambda: solve(progress="often"),
            r"progress must be True, False or a function of \(progress, residual\), got 'often'",
        ),
        ("tolerance", lambda: ms.Newton(tolerance=0), r"tolerance must be in \(0, 1\), got 0"),
        ("tolerance nan", lambda: ms.Newton(tolerance=np.nan), "tolerance is nan"),
        ("tolerance string", lambda: ms.Newton(tolerance="a"), rf"tolerance \[1\] {NOT_NUMBERS}"),
        (
            "iterations",
            lambda: ms.Newton(max_iterations=2.5),
            "max_iterations must be an integer of at least 1, got 2.5",
        ),
        (
            "no iterations",
            lambda: ms.MixedNewton(max_iterations=0),
            "max_iterations must be an integer of at least 1",
        ),
        (
            "endless",
            lambda: ms.Newton(max_relaxation_steps=10**12),
            r"max_relaxation_steps must be below 2\^31",
        ),
        ("load step", lambda: ms.Newton(first_load_step=2), r"first_load_step must be in \(0, 1\], got 2"),
        ("path's end", lambda: ms.follow_path(scene(), until=True), "until must be a function of"),
    ]
)

GRADIENTS = {
    "thickness": lambda t: shell(thickness=t((N_F,))),
    "young_modulus": lambda t: shell(young_modulus=t(())),
    "curvature_scale": lambda t: shell(curvature_scale=t((N_E,))),
    "start": lambda t: solve(start=t((N_V, 3))),
    "force": lambda t: ms.PointLoad([0], t((3,))),
    "displacement": lambda t: ms.Pin([0], displacement=t((3,))),
    "gravity": lambda t: scene(gravity=t((3,))),
    "rest_positions": lambda t: ms.TriangleMesh(t((3, 3)), [[0, 1, 2]]),
}


@pytest.mark.parametrize("name", GRADIENTS)
def test_gradients_that_nothing_passes_back_are_refused(name):
    """Check that an input without a gradient raises instead of giving a silent zero."""
    torch = pytest.importorskip("torch")
    with pytest.raises(ValueError, match=rf"{name}.* requires a gradient.*detach it first"):
        GRADIENTS[name](lambda shape: torch.ones(shape, requires_grad=True))


def test_a_list_of_tensors_is_refused_by_name():
    torch = pytest.importorskip("torch")
    rows = [torch.ones(3, requires_grad=True)] * N_F
    with pytest.raises(ValueError, match=r"remanent_magnetization \[A/m\]"):
        solve_magnetic(remanent_magnetization=rows)


def test_a_scene_cannot_be_solved_from_within_its_own_solve():
    """Check the refusal of a nested solve, which would overwrite the state of the outer one."""
    itself = scene(loads=[ms.AreaLoad((0, 0, 1.0))])
    with pytest.raises(RuntimeError, match="the scene is being solved"):
        ms.equilibrium(itself, progress=lambda *_: ms.equilibrium(itself))
    assert ms.equilibrium(itself).stable
