"""Shells by Projective Dynamics: steps of implicit Euler, together with solids and on obstacles; gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import magshell as ms

BENDINGS = ("hinge", "midedge", "midedge2")


def sheet(bending="hinge", cells=(6, 2), **options) -> ms.Shell:
    mesh = ms.meshes.rectangle(0.06, 0.02, cells=cells, order=2 if bending == "midedge2" else 1)
    own = {"thickness": 1e-3, "young_modulus": 1e5, "poisson_ratio": 0.3, "mass_density": 1e3, **options}
    return ms.Shell(mesh, bending=bending, **own)


def both(scene, **options):
    """Return the motion by Projective Dynamics and by Newton."""
    given = {"steps": 6, "time_step": 5e-3, "progress": False, **options}
    return (
        ms.simulate(scene, integrator=ms.ProjectiveDynamics(2000, 1e-11), **given),
        ms.simulate(scene, integrator=ms.ImplicitEuler(), solver=ms.MixedNewton(tolerance=1e-12), **given),
    )


@pytest.mark.parametrize("bending", BENDINGS)
@pytest.mark.parametrize("thickness", [1e-3, 3e-4])
def test_a_flag_falls_as_newton_has_it(thickness, bending):
    flag = sheet(bending, thickness=thickness)
    scene = ms.Scene(flag, supports=[ms.Clamp(flag.mesh.edges_at(x=0.0))], gravity=(0, 1.0, -9.81))
    found, exact = both(scene)
    assert np.abs(exact.displacements[-1]).max() > 2e-3
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06
    # One factorization, whatever the shape.
    assert found.factorizations <= 2


@pytest.mark.parametrize("bending", BENDINGS[:2])
def test_a_curved_sheet_in_a_field(bending):
    """Use a roof, magnetized along itself, whose rest shape has dihedral angles."""
    roof = ms.meshes.rectangle(0.06, 0.02, cells=(6, 2))
    x = roof.rest_positions.copy()
    x[:, 2] = 0.2 * x[:, 0] * (0.06 - x[:, 0]) / 0.06
    shell = ms.Shell(
        ms.TriangleMesh(x, roof.faces),
        thickness=1e-3,
        young_modulus=1e5,
        poisson_ratio=0.3,
        mass_density=1e3,
        bending=bending,
        remanent_magnetization=(3e4, 0, 0),
    )
    ends = shell.mesh.edges_at(x=0.0)
    scene = ms.Scene(shell, supports=[ms.Clamp(ends)], field=ms.UniformField())
    found, exact = both(scene, applied_flux_density=(0, 0, 5e-3))
    assert np.abs(exact.displacements[-1]).max() > 1e-3
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06


def test_a_sheet_that_lands_beside_a_block():
    """Drop a shell and a solid in one scene onto the ground."""
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


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@pytest.mark.parametrize("bending", BENDINGS[1:])
def test_strongly_bent_shells_keep_their_stiffness(bending):
    """Check a flag that hangs down from one end: after a rotation by 90 degrees a step takes as many iterations as
    at first.
    """
    flag = sheet(bending, cells=(6, 1), young_modulus=1e4)
    scene = ms.Scene(flag, supports=[ms.Clamp(flag.mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    given = {"time_step": 5e-3, "progress": False, "integrator": ms.ProjectiveDynamics(2000, 1e-10)}
    first = ms.simulate(scene, steps=6, **given)
    whole = ms.simulate(scene, steps=40, **given)
    assert whole.positions[-1, :, 2].min() < -0.03
    assert (whole.iterations - first.iterations) / 34 < 2.0 * first.iterations / 6


def test_on_a_slanted_support_beside_edge_rotations():
    """Combine nodes that are eliminated densely and edge rotations in one matrix."""
    turn = np.array([[0.8, 0, -0.6], [0, 1.0, 0], [0.6, 0, 0.8]])
    flat = ms.meshes.rectangle(0.06, 0.02, cells=(6, 2))
    leaning = flat.transformed(rotation=turn)
    shell = ms.Shell(
        leaning, thickness=1e-3, young_modulus=1e5, poisson_ratio=0.3, mass_density=1e3, bending="midedge"
    )
    mirror = ms.SymmetryPlane(turn[:, 0])
    scene = ms.Scene(shell, supports=[mirror], gravity=(0, 1.0, -9.81), allow_rigid_motions=True)
    found, exact = both(scene)
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06


@pytest.mark.parametrize("bending", BENDINGS)
def test_gradients_are_those_of_newton(bending):
    flag = sheet(bending)
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


def test_gradients_of_edge_rotations_over_200_steps():
    """Compare the gradients with differences."""
    flag = sheet("midedge", cells=(4, 1))
    scene = ms.Scene(flag, supports=[ms.Clamp(flag.mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))

    def end(thickness):
        return ms.simulate(
            scene,
            steps=200,
            time_step=2e-3,
            integrator=ms.ProjectiveDynamics(2000, 1e-12),
            thickness=thickness,
            record_every=200,
            progress=False,
        ).positions[-1]

    thickness = torch.tensor(1e-3, dtype=torch.float64, requires_grad=True)
    end(thickness)[:, 2].sum().backward()
    step = 1e-8
    sums = [float(np.asarray(end(1e-3 + sign * step))[:, 2].sum()) for sign in (1, -1)]
    assert float(thickness.grad) == pytest.approx((sums[0] - sums[1]) / (2 * step), rel=1e-5)
