"""Equilibrium.branches: ways out of unstable states that round-off decided against, with starts that lead there."""

from __future__ import annotations

import numpy as np
import pytest

import magshell as ms


def strip(gravity=(0.0, 0.0, 0.0)) -> ms.Scene:
    """Return a strip between clamps, one of which moves toward the other: it buckles to either side."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    sheet = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6, mass_density=1e3)
    moved = ms.Clamp(mesh.edges_at(x=0.04), displacement=(-1e-5, 0, 0))
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), moved], gravity=gravity)


def plate(ratio: float) -> ms.Scene:
    """Return a plate pushed in from four sides, five times as far as it takes to buckle.

    Its most unstable shapes have two half-waves along x and one along y, or the other way round; they are equally
    unstable if the strains along both are the same. ratio: of the strain along y to that along x.
    """
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(8, 8), diagonals="crossed")
    sheet = ms.Shell(mesh, thickness=1e-2, young_modulus=1e6, poisson_ratio=0.3)
    strain = 5.0 * np.pi**2 * 1e-4 / (6.0 * 1.3)
    corner = [mesh.nearest_vertex((1, 1, 0))]
    right, top = (np.setdiff1d(side, corner) for side in (mesh.vertices_at(x=1.0), mesh.vertices_at(y=1.0)))
    supports = [
        ms.Pin(mesh.vertices_at(x=0.0), "x"),
        ms.Pin(mesh.vertices_at(y=0.0), "y"),
        ms.Pin(right, "x", displacement=(-strain, 0, 0)),
        ms.Pin(top, "y", displacement=(0, -ratio * strain, 0)),
        ms.Pin(corner, "xy", displacement=(-strain, -ratio * strain, 0)),
        ms.Pin(mesh.boundary_vertices, "z"),
    ]
    return ms.Scene(sheet, supports=supports)


def test_the_other_side_of_a_buckled_strip_is_its_mirror_image() -> None:
    scene = strip()
    found = ms.equilibrium(scene)
    assert found.symmetric_saddles == len(found.branches) == 1
    (branch,) = found.branches
    assert branch.cause == "other side" and "result.branches" in repr(found)
    np.testing.assert_allclose(branch.saddle[:, 2], 0.0, atol=1e-12)
    assert np.abs(branch.mode).max() == pytest.approx(1.0, rel=1e-12)
    other = ms.equilibrium(scene, start=branch.positions)
    assert other.stable and np.abs(found.positions[:, 2]).max() > 1e-4
    np.testing.assert_allclose(other.positions, found.positions * (1, 1, -1), atol=1e-8)
    assert other.energy == pytest.approx(found.energy, rel=1e-8)


def test_a_strip_that_its_weight_bends_one_way_has_no_other_branch() -> None:
    heavy = ms.equilibrium(strip(gravity=(0, 0, -9.81)))
    assert heavy.symmetric_saddles == 0 and heavy.branches == ()
    assert "result.branches" not in repr(heavy)


def test_branches_are_kept_in_files(tmp_path) -> None:
    scene = strip()
    found = ms.equilibrium(scene)
    found.save(tmp_path / "found.npz")
    again = ms.load(tmp_path / "found.npz", scene)
    assert len(again.branches) == len(found.branches) == 1
    for name in ("saddle", "positions"):
        np.testing.assert_array_equal(getattr(again.branches[0], name), getattr(found.branches[0], name))


def test_a_mode_that_is_as_unstable_as_the_one_taken_is_told() -> None:
    scene = plate(1.0)
    found = ms.equilibrium(scene)
    others = [branch for branch in found.branches if branch.cause == "other mode"]
    assert others
    np.testing.assert_allclose(others[0].saddle[:, 2], 0.0, atol=1e-9)
    assert np.abs(others[0].mode[:, 2]).max() == pytest.approx(1.0)
    assert ms.equilibrium(scene, start=others[0].positions).stable


def test_modes_that_are_not_equally_unstable_are_no_branches() -> None:
    assert "other mode" not in [branch.cause for branch in ms.equilibrium(plate(0.8)).branches]
