"""Contact and self-contact of bodies by Projective Dynamics: steps of implicit Euler, gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import magshell as ms

SIZE = 0.02


def block(
    height, *, aside=1e-3, material=None, cells=(2, 2, 1), young_modulus=5e4, velocity=None
) -> ms.Solid:
    box = ms.meshes.box((SIZE, SIZE, 0.5 * SIZE), cells=cells)
    shift = np.array((aside, 0.6 * aside, height))
    soft = (
        ms.ProjectiveMaterial(young_modulus=young_modulus, poisson_ratio=0.3)
        if material is None
        else material
    )
    return ms.Solid(
        ms.TetMesh(box.rest_positions + shift, box.tetrahedra),
        material=soft,
        mass_density=1e3,
        element="linear",
    )


def stacked(apart=4e-4, cells=(2, 2, 1), **contact) -> ms.Scene:
    """Build one block, whose bottom is held, under another."""
    lower, upper = block(0.0, aside=0.0, cells=cells), block(0.5 * SIZE + apart, cells=cells)
    held = ms.Pin(lower.mesh.vertices_at(z=lower.mesh.rest_positions[:, 2].min()), body=lower)
    touch = ms.Contact(lower, upper, activation_distance=5e-4, contact_stiffness=2e3, **contact)
    return ms.Scene(
        [lower, upper], supports=[held], contacts=[touch], gravity=(3.0, 0, -9.81), allow_rigid_motions=True
    )


def both(scene, **options):
    given = {"steps": 8, "time_step": 4e-3, "progress": False, **options}
    return (
        ms.simulate(scene, integrator=ms.ProjectiveDynamics(2000, 1e-11), **given),
        ms.simulate(scene, integrator=ms.ImplicitEuler(), solver=ms.MixedNewton(tolerance=1e-12), **given),
    )


def touched(move) -> bool:
    return np.max(move.energies["body contact"]) > 0.0


@pytest.mark.parametrize("law", ["barrier", "penalty"])
@pytest.mark.parametrize("rubbing", [None, 0.4])
def test_a_block_on_another_is_as_newton_has_it(law, rubbing):
    found, exact = both(stacked(law=law, friction_coefficient=rubbing))
    assert touched(exact) and not found.substeps
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * SIZE


def test_lagged_friction_is_as_newton_has_it():
    found, exact = both(stacked(friction_coefficient=0.4, lagged_friction=True))
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * SIZE


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_a_sheet_that_touches_itself():
    """Use a strip bent to a hook, the ends of which gravity closes."""
    strip = ms.meshes.rectangle(0.06, 0.01, cells=(12, 2))
    x = strip.rest_positions.copy()
    angle = 1.7 * np.pi * x[:, 0] / 0.06
    x[:, 0], x[:, 2] = 0.011 * np.sin(angle), 0.011 * (1.0 - np.cos(angle))
    shell = ms.Shell(
        ms.TriangleMesh(x, strip.faces),
        thickness=1e-3,
        young_modulus=2e4,
        poisson_ratio=0.3,
        mass_density=1e3,
        bending="hinge",
    )
    scene = ms.Scene(
        shell,
        supports=[ms.Clamp(shell.mesh.edges_where(lambda at: at[:, 2] < 1e-4))],
        contacts=[ms.SelfContact(shell, contact_stiffness=1e4, activation_distance=3e-4)],
        gravity=(0, 0, -9.81),
        allow_rigid_motions=True,
    )
    found, exact = both(scene, steps=20)
    assert touched(exact)
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06


def test_on_a_skeleton():
    """Drop a block on a bar with two bones in it, of which one rotates; this includes the Schur complement."""
    bar = ms.meshes.box((0.06, 0.01, 0.01), cells=(6, 1, 1))
    flesh = ms.Solid(
        bar,
        material=ms.NeoHookean(young_modulus=5e4, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
    )
    bones = [
        ms.Link(vertices=bar.vertices_where(where), body=flesh)
        for where in (lambda x: x[:, 0] < 0.011, lambda x: (x[:, 0] > 0.019) & (x[:, 0] < 0.041))
    ]
    hinge = ms.Revolute(bones[1], bones[0], origin=(0.015, 0.005, 0.005), axis=(0, 1, 0))
    skeleton = ms.Skeleton(bones, [ms.Fixed(bones[0]), hinge])
    box = ms.meshes.box((0.012, 0.012, 0.006), cells=(1, 1, 1))
    upper = ms.Solid(
        ms.TetMesh(box.rest_positions + np.array((0.04, -0.001, 0.0104)), box.tetrahedra),
        material=ms.ProjectiveMaterial(young_modulus=5e4, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
    )
    touch = ms.Contact(flesh, upper, activation_distance=5e-4, contact_stiffness=2e3)
    scene = ms.Scene(
        [flesh, skeleton, upper], contacts=[touch], gravity=(0, 0, -9.81), allow_rigid_motions=True
    )
    found, exact = both(scene)
    assert touched(exact)
    assert np.abs(found.positions - exact.positions).max() < 1e-8 * 0.06


def test_gradients_go_through_contact():
    """Compare with differences over 200 steps, most of them in contact."""
    scene = stacked(cells=(1, 1, 1), friction_coefficient=0.2, law="penalty", smoothing=2e-4)
    weights = np.random.default_rng(0).standard_normal((scene.mesh.n_vertices, 3))
    tight = ms.ProjectiveDynamics(4000, 1e-12)

    def end(modulus):
        return ms.simulate(
            scene,
            steps=200,
            time_step=1e-3,
            integrator=tight,
            values={scene.bodies[0]: {"young_modulus": modulus}},
            record_every=200,
            progress=False,
        ).positions[-1]

    modulus = torch.tensor(5e4, dtype=torch.float64, requires_grad=True)
    (end(modulus) * torch.as_tensor(weights)).sum().backward()
    step = 5e4 * 1e-5
    ends = [float((np.asarray(end(5e4 + sign * step)) * weights).sum()) for sign in (1, -1)]
    assert float(modulus.grad) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-5)
