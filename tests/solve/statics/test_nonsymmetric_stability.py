"""Stability under forces without potential: eigenvalues of the whole tangent, against those of differences of forces."""

import numpy as np
import pytest

import magshell as ms
from tests.hard.costs import thick_tube


def column(pressure: float, dead: float) -> ms.Scene:
    """Return a column of rubber on a held foot, with a follower pressure [Pa] and a dead load [N] on its top."""
    mesh = ms.meshes.box((0.2, 0.02, 1.0), cells=(1, 1, 5))
    body = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3), element="linear")
    x = mesh.rest_positions
    top = np.flatnonzero(np.abs(mesh.face_barycenters[:, 2] - 1.0) < 1e-9)
    loads = [
        ms.Pressure(pressure, faces=top),
        ms.PointLoad(np.flatnonzero(x[:, 2] > 1.0 - 1e-9), (0.0, 1e-4 * (dead == 0.0), dead / 4)),
    ]
    return ms.Scene(body, supports=[ms.Pin(np.flatnonzero(x[:, 2] < 1e-9))], loads=loads)


def tangent(scene: ms.Scene, positions: np.ndarray) -> np.ndarray:
    """Return minus the derivative of the forces of the column by its free coordinates, by central differences."""
    step = 1e-6  # m
    free = np.flatnonzero(np.repeat(scene.mesh.rest_positions[:, 2] > 1e-9, 3))
    columns = []
    for k in free:
        ends = []
        for sign in (1.0, -1.0):
            x = positions.copy()
            x.flat[k] += sign * step
            ends.append(ms.forces(scene, x).on_vertices.ravel()[free])
        columns.append((ends[1] - ends[0]) / (2 * step))
    return np.array(columns).T


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning", "ignore::magshell.LargeStrainWarning")
@pytest.mark.parametrize(
    ("pressure", "dead", "of_whole", "of_symmetric_part"),
    [
        (1e4, 0.0, 0, 0),
        (4e4, 0.0, 0, 1),  # Beck's column: a follower never buckles it
        (6e4, 0.0, 0, 1),  # a pair of complex eigenvalues, with positive real part
        (3e4, -40.0, 0, 1),
        (3e4, -250.0, 3, 3),
        (6e4, -400.0, 3, 3),
    ],
)
def test_stability_under_a_nonsymmetric_pressure(pressure, dead, of_whole, of_symmetric_part):
    scene = column(pressure, dead)
    found = ms.equilibrium(scene, require_stable=False)
    stiffness = tangent(scene, found.positions)
    assert np.sum(np.linalg.eigvals(stiffness).real < 0) == of_whole
    assert np.sum(np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T)) < 0) == of_symmetric_part
    assert found.n_negative_eigenvalues == of_whole and found.stable == (of_whole == 0)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning", "ignore::magshell.LargeStrainWarning")
def test_a_path_passes_the_limit_point_of_a_live_pressure():
    scene, inside, end = thick_tube((1, 3, 3))

    def pressures(p: float) -> dict:
        return {inside: {"pressure": p}, end: {"pressure": -p / 1.25}}

    peak = []

    def well_behind_it(parameter: float, positions: np.ndarray) -> bool:
        peak.append(parameter)
        return parameter < max(peak) - 0.02

    path = ms.follow_path(scene, values=pressures(1.5e5), until=well_behind_it, progress=False)
    (limit,) = path.critical
    assert limit.kind == "limit"
    assert max(path.parameters) <= limit.parameter <= max(path.parameters) * (1 + 1e-3)
    before = np.arange(len(path)) <= limit.after_point
    np.testing.assert_array_equal(path.n_negative_eigenvalues, np.where(before, 0, 1))
    # the tube bulges, which has no closed form; the solver at fixed pressures is the other witness
    below = path.equilibrium(limit.after_point)
    near = ms.equilibrium(scene, values=pressures(0.999 * limit.parameter * 1.5e5), start=below)
    assert near.stable
    with pytest.raises(ms.NotConverged):
        ms.equilibrium(
            scene,
            values=pressures(1.02 * limit.parameter * 1.5e5),
            start=near,
            solver=ms.MixedNewton(max_factorizations=100),
        )
