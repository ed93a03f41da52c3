"""Supports that rotate, and sheets that their supports leave free to rotate."""

import numpy as np

import magshell as ms


def test_a_full_turn_of_a_clamp_leaves_a_strip_twisted() -> None:
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(24, 2))
    sheet = ms.Shell(mesh, thickness=5e-4, young_modulus=1e6)
    ends = mesh.edges_at(x=0.0), mesh.edges_at(x=0.1)
    clamps = [ms.Clamp(ends[0]), ms.Clamp(ends[1], rotation=(2 * np.pi, 0, 0))]
    found = ms.equilibrium(ms.Scene(sheet, supports=clamps))
    np.testing.assert_allclose(found.displacements[np.unique(mesh.edges[ends[1]])], 0.0, atol=1e-12)
    rim = mesh.vertices_where(lambda x: np.isclose(x[:, 0], 0.05) & np.isclose(x[:, 1], 0.01))
    assert found.stable and found.positions[rim, 1] < 1e-3  # half way along, half a turn
    assert found.energy > 1e-5


def test_a_sheet_pinned_at_two_corners_hangs_down() -> None:
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(8, 8))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    corners = [mesh.nearest_vertex((0, 0, 0)), mesh.nearest_vertex((0, 1, 0))]
    scene = ms.Scene(sheet, supports=[ms.Pin(corners)], gravity=(0, 0, -9.81), allow_rigid_motions=True)
    found = ms.equilibrium(scene)
    below = found.positions[mesh.nearest_vertex((1, 0.5, 0))]
    assert found.stable and below[2] < -0.9 and abs(below[0]) < 0.2
