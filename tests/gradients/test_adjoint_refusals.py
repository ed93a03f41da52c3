"""Refusals of gradients: results without one say so, and values that a solve cannot replace are refused by name."""

import numpy as np
import pytest
from bad_input import END, MESH, N_F, N_V, refused, scene, solve

import magshell as ms

torch = pytest.importorskip("torch")

LOAD = ms.PointLoad(END, (0, 0, 0))
TIP = ms.PointLoad(MESH.vertices_at(x=1.0), (0, 0, 1e-3))
MOVED = ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0))
STILL = ms.Clamp(MESH.edges_at(x=0.0))
CUSTOM = ms.CustomField(lambda x: 0.0 * x, length_scale=1.0)
DIPOLES = ms.Dipoles([[0, 0, 5]], [[0, 0, 1]])
GRID = ms.SampledField((-9, -9, -9), (18, 18, 18), np.zeros((2, 2, 2, 3)))
COUPLE = ms.EdgeCouple(MESH.edges_at(x=1.0), 0.0)


def young():
    return torch.full((N_F,), 1e6, dtype=torch.float64, requires_grad=True)


def compressed():
    return scene(loads=[ms.EdgeLoad(MESH.edges_at(x=1.0), (-3.0, 0, 0))])


def test_an_unstable_equilibrium_has_no_gradient():
    """Use a straight strip, far beyond its buckling load."""
    found = solve(compressed(), young_modulus=young(), require_stable=False)
    assert not found.stable
    with pytest.raises(ms.NoGradient, match=r"not stable \(\d+ directions lower"):
        found.positions.sum().backward()


def test_a_state_on_the_way_has_no_gradient():
    hasty = ms.MixedNewton(max_iterations=1, min_load_step=0.5, max_relaxation_steps=1)
    with pytest.raises(ms.NotConverged) as caught:
        solve(scene(loads=[TIP]), young_modulus=young(), load_factor=1e3, solver=hasty)
    with pytest.raises(ms.NoGradient, match=r"did not converge, it got .* of the way"):
        caught.value.last_good.positions.sum().backward()


def with_values(owner, name, value, **changes):
    magnetic = {"remanent_magnetization": (1, 0, 0)} if "field" in changes else {}
    return lambda: solve(scene(**changes), values={owner: {name: value}}, **magnetic)


test_values_are_refused = refused(
    [
        ("no dict", lambda: solve(values=3), "values must be a dict .* got int"),
        ("no dict inside", lambda: solve(scene(loads=[LOAD]), values={LOAD: 1}), "must be a dict .* got int"),
        ("another object", with_values(LOAD, "force", (0, 0, 1)), "not the scene, nor an object of it"),
        (
            "no such name",
            with_values(LOAD, "vertices", [1], loads=[LOAD]),
            "PointLoad has no value 'vertices' .* it has force",
        ),
        (
            "function",
            with_values(CUSTOM, "function", 1, field=CUSTOM),
            "CustomField has no value 'function' .* none",
        ),
        (
            "load's shape",
            with_values(LOAD, "force", (0, 1), loads=[LOAD]),
            r"force \[N\] must have shape \(3,\) or",
        ),
        (
            "couple's shape",
            with_values(COUPLE, "couple_per_length", (0, 1, 0), loads=[COUPLE]),
            "must keep its shape",
        ),
        (
            "more dipoles",
            with_values(DIPOLES, "positions", np.ones((2, 3)), field=DIPOLES),
            r"moments .* must have shape \(2, 3\)",
        ),
        (
            "another grid",
            with_values(GRID, "flux_density", np.ones((3, 2, 2, 3)), field=GRID),
            r"\(2, 2, 2, 3\)",
        ),
        (
            "a support that stays",
            with_values(STILL, "displacement", (0, 0, 1), supports=[STILL]),
            "give it a displacement in the scene",
        ),
        ("no gravity", lambda: solve(mass_density=1e3), "the scene has no gravity"),
        (
            "no loads",
            lambda: solve(vertex_loads=np.zeros((N_V, 3))),
            "the scene has no PointLoad, EdgeLoad or AreaLoad",
        ),
        (
            "loads' shape",
            lambda: solve(scene(loads=[LOAD]), vertex_loads=np.zeros(3)),
            rf"vertex_loads \[N\] must have shape \({N_V}, 3\)",
        ),
        (
            "loads twice",
            lambda: solve(
                scene(loads=[LOAD]), vertex_loads=np.zeros((N_V, 3)), values={LOAD: {"force": (0, 0, 1)}}
            ),
            "vertex_loads stands for all point, edge and area loads",
        ),
        ("modulus", lambda: solve(young_modulus=-1.0), r"young_modulus \[Pa\] must be positive"),
        ("ratio", lambda: solve(poisson_ratio=0.6), r"poisson_ratio \[1\] must be in"),
        (
            "scale's shape",
            lambda: solve(curvature_scale=np.ones(3)),
            r"curvature_scale \[1\] must be a number or",
        ),
    ]
)


def test_a_value_given_twice():
    itself = scene()
    with pytest.raises(ValueError, match="young_modulus was given twice"):
        solve(itself, young_modulus=1e6, values={itself.shell: {"young_modulus": 1e6}})


def test_values_last_for_one_solve():
    itself = scene(supports=[MOVED], loads=[TIP])
    before = solve(itself)
    softer = solve(itself, young_modulus=5e5, values={MOVED: {"displacement": (0, 0, 0.1)}}, start=before)
    anew = ms.equilibrium(
        ms.Scene(
            ms.Shell(MESH, thickness=1e-2, young_modulus=5e5),
            supports=[ms.Clamp(MESH.edges_at(x=0.0), displacement=(0, 0, 0.1))],
            loads=[TIP],
        )
    )
    np.testing.assert_allclose(softer.positions, anew.positions, atol=1e-9)
    assert np.array_equal(solve(itself).positions, before.positions)
