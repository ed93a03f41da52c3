"""A field in time that brings the tip of a clamped strip to a point after 50 steps."""

import numpy as np
import pytest
import torch

import magshell as ms
from magshell import control

STEPS, TIME_STEP, LENGTH = 50, 1e-3, 0.05
LIMIT = 3.5e-3  # T; a field without a limit would go beyond
TARGET = [[0.046, 0.005, 0.016]]

MESH = ms.meshes.rectangle(LENGTH, 0.01, cells=(6, 2))
TIP = int(np.linalg.norm(MESH.rest_positions - [LENGTH, 0.005, 0.0], axis=1).argmin())
SHEET = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
SCENE = ms.Scene(SHEET, supports=[ms.Clamp(MESH.edges_at(x=0.0))], field=ms.UniformField())


def field(in_plane):
    """Return a spline in the x-z plane. in_plane: (k, 2) T."""
    control_points = in_plane @ torch.tensor([[1.0, 0, 0], [0, 0, 1.0]], dtype=torch.float64)
    return control.spline(control.step_times(STEPS, TIME_STEP), control_points, STEPS * TIME_STEP)


def terms(in_plane):
    b = field(in_plane)
    move = ms.simulate(
        SCENE,
        steps=STEPS,
        time_step=TIME_STEP,
        remanent_magnetization=(5e4, 0, 0),
        applied_flux_density=b,
        damping=1e-4,
        integrator=ms.ImplicitEuler(),
    )
    return {
        "tip": control.key_frames(move.positions, [-1], [TARGET], [TIP]) / LENGTH**2,
        "strength": 1e-5 * control.field_strength(b) / LIMIT**2,
    }


@pytest.mark.parametrize(
    ("optimizer", "iterations", "reached"),
    [(ms.optim.MMA, 20, 2e-2), (ms.optim.LBFGS, 20, 2e-3)],
)
def test_the_tip_arrives_within_the_bounds(optimizer, iterations, reached):
    in_plane = torch.zeros(6, 2, dtype=torch.float64, requires_grad=True)
    bounded = optimizer([in_plane], lower=-LIMIT, upper=LIMIT)
    found = ms.minimize(terms, [in_plane], bounded, max_iterations=iterations, progress=False)
    with torch.no_grad():
        assert terms(in_plane)["tip"] ** 0.5 < reached  # of its length; it begins 0.33 away
        assert field(in_plane).abs().max() <= LIMIT
    assert found.history[0].terms["tip"] ** 0.5 > 0.3


def test_an_optimizer_without_bounds_is_held_by_a_penalty():
    in_plane = torch.zeros(6, 2, dtype=torch.float64, requires_grad=True)
    adam = torch.optim.Adam([in_plane], lr=LIMIT / 8, betas=(0.8, 0.99))
    for _ in range(40):
        adam.zero_grad()
        loss = sum(terms(in_plane).values()) + control.field_excess(field(in_plane), LIMIT) / LIMIT**2
        loss.backward()
        adam.step()
    with torch.no_grad():
        assert terms(in_plane)["tip"] ** 0.5 < 3e-2
        assert field(in_plane).abs().max() < 1.05 * LIMIT
