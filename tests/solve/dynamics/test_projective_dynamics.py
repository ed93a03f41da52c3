"""Tests of Projective Dynamics: it takes the steps of implicit Euler, with the same solutions and gradients as
Newton.
"""

from itertools import pairwise

import numpy as np
import pytest
import torch
from projective_bars import MATERIALS, NEWTON, SIZE, TIGHT, assert_same, bar, both, clamped

import magshell as ms


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("name", MATERIALS)
def test_a_converged_step_is_newtons(name, element):
    solid = bar(MATERIALS[name], element, cells=(6, 2, 2) if element == "linear" else (3, 1, 1))
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    assert_same(*both(scene))


def test_rounds_as_they_are_lead_there_too():
    solid = bar(MATERIALS["Projective"])
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    _, expected = both(scene)
    given = {"steps": 4, "time_step": 5e-3, "progress": False}
    plain = ms.simulate(scene, integrator=ms.ProjectiveDynamics(20000, 1e-12, history=0), **given)
    assert_same(plain.positions, expected)
    errors = [
        np.abs(
            ms.simulate(scene, integrator=ms.ProjectiveDynamics(n, None, history=0), **given).positions
            - expected
        ).max()
        for n in (1, 4, 16, 64)
    ]
    assert all(later < 0.7 * earlier for earlier, later in pairwise(errors))


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_solver_recovers_from_inverted_elements():
    solid = bar(MATERIALS["Projective"])
    scene = ms.Scene(solid, supports=[clamped(solid)])
    start = np.array(solid.mesh.rest_positions)
    start[:, 0] *= -0.5
    held = start[:, 0] == 0
    start[held] = solid.mesh.rest_positions[held]
    move = ms.simulate(
        scene,
        steps=200,
        time_step=1e-2,
        start=start,
        integrator=ms.ProjectiveDynamics(tolerance=1e-8),
        progress=False,
    )
    assert np.abs(move.positions[-1] - solid.mesh.rest_positions).max() < 0.05 * SIZE[0]


SCENES = {
    "along one axis": lambda s: [clamped(s, "x"), ms.Pin([0, 1], "yz"), ms.Pin([2], "z")],
    "slanted": lambda s: [clamped(s), ms.SymmetryPlane((0.6, 0, 0.8), (SIZE[0], 0, SIZE[2]))],
    "moving": lambda s: [clamped(s, displacement=(0, 0, 4e-3))],
}


@pytest.mark.parametrize("name", SCENES)
def test_supports_equal_those_of_newton(name):
    solid = bar(MATERIALS["Corotated"])
    scene = ms.Scene(solid, supports=SCENES[name](solid), gravity=(0, 2.0, -9.81))
    options = {"support_factor": lambda t: t / 0.02} if name == "moving" else {}
    assert_same(*both(scene, **options))


def links_in_jelly(free):
    """Build a bar with two bones and an elbow between them; its first bone is fixed, or falls."""
    solid = bar(MATERIALS["Corotated"], cells=(8, 2, 2))
    x = solid.mesh.rest_positions[:, 0] / SIZE[0]
    bones = [
        ms.Link(vertices=np.flatnonzero((x > a) & (x < b)), body=solid) for a, b in ((0.1, 0.4), (0.6, 0.9))
    ]
    elbow = ms.Revolute(bones[1], bones[0], origin=(0.5 * SIZE[0], 0.005, 0.005), axis=(0, 1, 0), torque=2e-5)
    skeleton = ms.Skeleton(bones, [elbow] if free else [ms.Fixed(bones[0]), elbow])
    return ms.Scene([solid, skeleton], gravity=(0, 2.0, -9.81), allow_rigid_motions=free)


@pytest.mark.parametrize("free", [False, True])
def test_skeletons_turn_while_the_soft_part_stays_factorized(free):
    scene = links_in_jelly(free)
    assert_same(*both(scene, steps=6))
    given = {"time_step": 5e-3, "integrator": ms.ProjectiveDynamics(tolerance=1e-8), "progress": False}
    assert ms.simulate(scene, steps=6, **given).factorizations == 1
    assert ms.simulate(scene, steps=1, **given).factorizations == 1


def test_rigid_bodies_equal_those_of_newton():
    solid = bar(MATERIALS["Corotated"])
    x = solid.mesh.rest_positions[:, 0]
    weight = ms.RigidBody(
        np.flatnonzero(x > 0.9 * SIZE[0]), mass=2e-3, inertia=(1e-8, 2e-8, 3e-8), body=solid
    )
    scene = ms.Scene([solid, weight], supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    assert_same(*both(scene))


@pytest.mark.parametrize(
    "law",
    [
        {"stiffness_damping": 5e-3},
        {"maxwell_modulus": 1.0, "maxwell_time": 1e-2},
        {"maxwell_modulus": (1.0, 0.5), "maxwell_time": (1e-2, 1e-3)},
    ],
    ids=["damping", "branch", "branches"],
)
def test_viscosity_and_damping(law):
    solid = bar(MATERIALS["Corotated"])
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    assert_same(*both(scene, damping=1e-4, **law))


def test_free_bodies_and_obstacles_by_penalty():
    solid = bar(MATERIALS["Projective"])
    floor = ms.Contact(
        ms.obstacles.Plane(center=(0, 0, -1e-3)),
        contact_stiffness=20.0,
        friction_coefficient=0.4,
        smoothing=1e-4,
    )
    scene = ms.Scene(solid, contacts=[floor], gravity=(1.0, 0, -9.81), allow_rigid_motions=True)
    assert_same(*both(scene, steps=12, time_step=2e-3))


def test_fields_and_skins():
    solid = bar(MATERIALS["Corotated"], remanent_magnetization=(2e4, 0.0, 0.0))
    scene = ms.Scene(solid, supports=[clamped(solid)], field=ms.UniformField())
    assert_same(*both(scene, applied_flux_density=(0, 0, 5e-3)))


def test_gradients_are_those_of_implicit_euler():
    solid = bar(MATERIALS["Projective"], cells=(4, 1, 1))
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    n_t = solid.mesh.n_tetrahedra
    weights = torch.tensor(np.random.default_rng(0).standard_normal((solid.mesh.n_vertices, 3)))

    def gradient(integrator, **options):
        leaves = {
            "young_modulus": torch.full((n_t,), 2e4, dtype=torch.float64, requires_grad=True),
            "mass_density": torch.full((n_t,), 1e3, dtype=torch.float64, requires_grad=True),
        }
        move = ms.simulate(
            scene,
            steps=6,
            time_step=5e-3,
            values={solid: leaves},
            integrator=integrator,
            progress=False,
            **options,
        )
        (weights * move.positions[-1]).sum().backward()
        return [leaf.grad.numpy() for leaf in leaves.values()]

    for keep in ("stages", "checkpoints"):
        mine = gradient(
            TIGHT, adjoint_storage=ms.AdjointStorage(keep, memory_budget=2e9 if keep == "stages" else 5e4)
        )
        newton = gradient(ms.ImplicitEuler(), solver=NEWTON, adjoint_storage=keep)
        for found, expected in zip(mine, newton, strict=True):
            assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_missing_gradients_raise_an_error():
    solid = bar(MATERIALS["Projective"], cells=(4, 1, 1))
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 0, -9.81))
    young = torch.tensor(2e4, dtype=torch.float64, requires_grad=True)
    move = ms.simulate(
        scene,
        steps=2,
        time_step=5e-3,
        young_modulus=young,
        integrator=ms.ProjectiveDynamics(iterations=3, tolerance=None),
        progress=False,
    )
    with pytest.raises(ms.NoGradient, match="tolerance"):
        move.positions[-1].sum().backward()


def test_a_motion_has_the_same_bits_in_parts_and_on_any_threads():
    solid = bar(MATERIALS["Projective"])
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    given = {"time_step": 5e-3, "integrator": ms.ProjectiveDynamics(), "progress": False}
    whole = ms.simulate(scene, steps=6, **given)
    first = ms.simulate(scene, steps=2, **given)
    second = ms.simulate(scene, steps=4, start=first, **given)
    assert (second.positions == whole.positions[2:]).all()
    before = ms.num_threads()
    try:
        ms.set_num_threads(2)
        assert (ms.simulate(scene, steps=6, **given).positions == whole.positions).all()
    finally:
        ms.set_num_threads(before)


@pytest.mark.parametrize(
    "bad, words",
    [
        ({"iterations": 0}, "iterations must be an integer of at least 1"),
        ({"history": -1}, "history must be an integer of at least 0"),
        ({"tolerance": 0.0}, "tolerance must be in"),
        ({"contact": "hard"}, 'contact must be "penalty" or "coulomb"'),
    ],
)
def test_bad_options_are_refused(bad, words):
    with pytest.raises(ValueError, match=words):
        ms.ProjectiveDynamics(**bad)


def test_a_step_that_does_not_converge_hands_back_the_motion():
    solid = bar(MATERIALS["Projective"])
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 0, -9.81))
    with pytest.raises(
        ms.NotConverged, match="no convergence in 2 iterations of Projective Dynamics"
    ) as error:
        ms.simulate(
            scene, steps=3, time_step=5e-2, integrator=ms.ProjectiveDynamics(iterations=2), progress=False
        )
    assert error.value.last_good.steps_done == 0


@pytest.mark.parametrize("contact", ["penalty", "coulomb"])
def test_ctrl_c_hands_back_the_motion_and_leaves_the_scene_as_it_was(contact):
    calls = {"made": 0, "stop": None}

    def flux(points):
        calls["made"] += 1
        if calls["made"] == calls["stop"]:
            raise KeyboardInterrupt
        return np.tile((0.0, 0.0, 5e-3), (len(points), 1))

    solid = bar(MATERIALS["Projective"], cells=(3, 1, 1), remanent_magnetization=(2e4, 0.0, 0.0))
    floor = ms.Contact(ms.obstacles.Plane(center=(0, 0, 0)), friction_coefficient=0.3)
    field = ms.CustomField(flux, length_scale=0.05)
    scene = ms.Scene(solid, contacts=[floor], supports=[clamped(solid)], field=field, gravity=(0, 1.0, -9.81))
    method = ms.ProjectiveDynamics(contact=contact, tolerance=1e-6)
    given = {"steps": 4, "time_step": 5e-3, "integrator": method, "progress": False}
    whole = ms.simulate(scene, **given)
    calls["stop"] = calls["made"] + 9 * calls["made"] // 10
    with pytest.raises(ms.Interrupted) as error:
        ms.simulate(scene, **given)
    done = error.value.last_good
    assert 0 < done.steps_done < 4
    assert (done.positions == whole.positions[: len(done)]).all()
    calls["stop"] = None
    assert (ms.simulate(scene, **given).positions == whole.positions).all()


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_rounds_without_a_tolerance_do_not_run_away():
    """Check that steps that overshoot are shortened, because the matrix is no bound of Corotated's stiffness."""
    solid = bar(MATERIALS["Corotated"])
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    given = {"steps": 4, "time_step": 2e-2, "progress": False}
    exact = ms.simulate(scene, integrator=TIGHT, **given).positions
    errors = [
        np.abs(
            ms.simulate(scene, integrator=ms.ProjectiveDynamics(n, None, history=0), **given).positions
            - exact
        ).max()
        for n in (5, 50, 500)
    ]
    assert all(later < 0.7 * earlier for earlier, later in pairwise(errors))


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("time_step", [1e-5, 1e-3, 1e-1])
def test_short_and_long_steps(time_step):
    solid = bar(MATERIALS["Projective"])
    scene = ms.Scene(solid, supports=[clamped(solid)], gravity=(0, 2.0, -9.81))
    mine, newton = both(scene, time_step=time_step)
    moved = np.abs(newton - newton[0]).max()
    # In the inertia of a short step positions cancel: round-off of them over the way.
    round_off = 1e-12 * SIZE[0]
    assert np.abs(mine - newton).max() < 1e-8 * moved + round_off
