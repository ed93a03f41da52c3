"""Shells with hinges by Projective Dynamics: steps of implicit Euler, beside solids and on obstacles; gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import magshell as ms


def sheet(**options) -> ms.Shell:
    mesh = ms.meshes.rectangle(0.06, 0.02, cells=(6, 2))
    own = {"thickness": 1e-3, "young_modulus": 1e5, "poisson_ratio": 0.3, "mass_density": 1e3, **options}
    return ms.Shell(mesh, bending="hinge", **own)


def both(scene, **options):
    """By Projective Dynamics and by Newton."""
    given = {"steps": 6, "time_step": 5e-3, "progress": False, **options}
    return (
        ms.simulate(scene, integrator=ms.ProjectiveDynamics(2000, 1e-11), **given),
        ms.simulate(scene, integrator=ms.ImplicitEuler(), solver=ms.MixedNewton(tolerance=1e-12), **given),
    )


@pytest.mark.parametrize("thickness", [1e-3, 3e-4])
def test_a_flag_falls_as_newton_has_it(thickness):
    flag = sheet(thickness=thickness)
    scene = ms.Scene(flag, supports=[ms.Clamp(flag.mesh.edges_at(x=0.0))], gravity=(0, 1.0, -9.81))
    found, exact = both(scene)
    assert np.abs(exact.displacements[-1]).max() > 2e-3
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06
    # One factorization, whatever the shape.
    assert found.factorizations <= 2


def test_a_curved_sheet_in_a_field():
    """A roof, magnetized along: its rest shape has folds."""
    roof = ms.meshes.rectangle(0.06, 0.02, cells=(6, 2))
    x = roof.rest_positions.copy()
    x[:, 2] = 0.2 * x[:, 0] * (0.06 - x[:, 0]) / 0.06
    shell = ms.Shell(
        ms.TriangleMesh(x, roof.faces),
        thickness=1e-3,
        young_modulus=1e5,
        poisson_ratio=0.3,
        mass_density=1e3,
        bending="hinge",
        remanent_magnetization=(3e4, 0, 0),
    )
    ends = shell.mesh.edges_at(x=0.0)
    scene = ms.Scene(shell, supports=[ms.Clamp(ends)], field=ms.UniformField())
    found, exact = both(scene, applied_flux_density=(0, 0, 5e-3))
    assert np.abs(exact.displacements[-1]).max() > 1e-3
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06


def test_a_sheet_that_lands_beside_a_block():
    """A shell and a solid in one scene, on the ground."""
    shell = sheet()
    bar = ms.meshes.box((0.03, 0.01, 0.01), cells=(3, 1, 1))
    block = ms.Solid(
        ms.TetMesh(bar.rest_positions + np.array((0.0, 0.1, 0.0)), bar.tetrahedra),
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
    )
    ground = ms.obstacles.Plane((0, 0, 1), center=(0, 0, -2e-3))
    contacts = [ms.Contact(ground)]
    scene = ms.Scene([shell, block], contacts=contacts, gravity=(0, 0, -9.81), allow_rigid_motions=True)
    found, exact = both(scene, steps=8)
    assert np.abs(found.positions - exact.positions).max() < 1e-7 * 0.06


def test_gradients_are_those_of_newton():
    flag = sheet()
    scene = ms.Scene(flag, supports=[ms.Clamp(flag.mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    found = []
    for integrator in (ms.ProjectiveDynamics(2000, 1e-12), ms.ImplicitEuler()):
        modulus = torch.tensor(1e5, dtype=torch.float64, requires_grad=True)
        move = ms.simulate(
            scene, steps=5, time_step=5e-3, integrator=integrator, young_modulus=modulus, progress=False
        )
        move.positions[-1, :, 2].sum().backward()
        found.append(float(modulus.grad))
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[1] != 0.0
