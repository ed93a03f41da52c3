"""Small loads on shells of large radius: the residual cannot fall below round-off of the positions, so the
solve ends there."""

import numpy as np
import pytest

import magshell as ms
from benchmarks.cases import cylinder_roof
from benchmarks.skeleton_scaling import tree


@pytest.mark.parametrize("load_factor", [1e-4, 1e-3, 1e-2])
def test_small_load_on_a_shallow_roof(load_factor: float) -> None:
    # 2540 mm from its axis, cells of 16 mm.
    scene = cylinder_roof.scene(cylinder_roof.quarter((16, 16)), "midedge")
    state = ms.equilibrium(scene, load_factor=load_factor)
    response = ms.linear_response(scene, load_factor=load_factor).displacements
    assert state.iterations <= 5
    np.testing.assert_allclose(state.displacements, response, atol=0.02 * np.abs(response).max())


def test_result_reports_whether_round_off_ended_its_solve() -> None:
    scene = cylinder_roof.scene(cylinder_roof.quarter((16, 16)), "midedge")
    small, usual = (ms.equilibrium(scene, load_factor=factor) for factor in (1e-4, 1.0))
    assert small.at_roundoff and "at round-off" in repr(small)
    assert not usual.at_roundoff and "at round-off" not in repr(usual)
    # the same state meets a looser tolerance
    assert not ms.equilibrium(scene, load_factor=1e-4, solver=ms.MixedNewton(tolerance=1e-5)).at_roundoff


def test_fine_roof_takes_small_steps() -> None:
    mesh = cylinder_roof.quarter((32, 32))
    center = mesh.nearest_vertex((0, 0, cylinder_roof.RADIUS))
    path = ms.follow_path(
        cylinder_roof.scene(mesh, "midedge"),
        until=lambda _, positions: positions[center, 2] < cylinder_roof.RADIUS - 2.0,
        first_step=0.005,
        progress=False,
    )
    assert path.n_negative_eigenvalues[-1] == 0 and len(path) > 2


@pytest.mark.parametrize("links", [50, 200])
@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2()], ids=repr)
def test_long_chains_of_links_move_at_the_usual_tolerance(links: int, integrator) -> None:
    """Check the joint angles of long chains against a looser tolerance.

    The error of the angles, read off positions 10 m away, moves the last links by that error times the length of the chain.
    """
    scene = tree(links, 1)
    moves = [
        ms.simulate(
            scene,
            steps=3,
            time_step=1e-3,
            integrator=integrator,
            solver=ms.MixedNewton(tolerance=tolerance),
            progress=False,
        )
        for tolerance in (1e-10, 1e-7)
    ]
    assert all(parts == 7 for parts in moves[0].substeps.values())  # as the method begins
    for joint in scene.joints[:: links // 5]:
        angles, rough = (move[joint].angle[-1] for move in moves)
        assert angles == pytest.approx(rough, abs=1e-10)
