"""Makes bars of every material, and moves them by two methods."""

import numpy as np
from solid_materials import SAMPLES

import magshell as ms

SIZE = (0.04, 0.01, 0.01)
MODULI = {"young_modulus": 2e4, "poisson_ratio": 0.35}
MATERIALS = {
    "Projective": ms.ProjectiveMaterial(**MODULI),
    "Corotated": ms.Corotated(**MODULI),
    "ln J": ms.NeoHookean(**MODULI),
    "J": ms.NeoHookean("J", **MODULI),
    "isochoric": ms.NeoHookean("isochoric", **MODULI),
    "stable": ms.StableNeoHookean(**MODULI),
    "barrier": ms.StableNeoHookean(log_barrier=True, **MODULI),
    "StVenantKirchhoff": ms.StVenantKirchhoff(**MODULI),
    "Guccione": ms.Guccione(
        stiffness=4e3,
        fibre_exponent=4.0,
        cross_fibre_exponent=2.0,
        fibre_shear_exponent=2.0,
        bulk_modulus=2e4,
        fibres=(1.0, 0.2, 0.0),
    ),
}
_LISTED = {type(each) for each in MATERIALS.values()}
MATERIALS |= {name: each.scaled(20.0) for name, each in SAMPLES.items() if each.make not in _LISTED}
TIGHT = ms.ProjectiveDynamics(tolerance=1e-12, iterations=3000)
NEWTON = ms.MixedNewton(tolerance=1e-12)


def bar(material, element="linear", cells=(6, 2, 2), **options):
    return ms.Solid(
        ms.meshes.box(SIZE, cells=cells), material=material, mass_density=1e3, element=element, **options
    )


def clamped(solid, axes="xyz", **motion):
    at_end = np.flatnonzero(solid.mesh.rest_positions[:, 0] < 1e-9)
    return ms.Pin(at_end, axes, **motion) if axes != "xyz" else ms.Pin(at_end, **motion)


def both(scene, steps=4, time_step=5e-3, **options):
    """Return the positions by Projective Dynamics and by Newton's method."""
    given = {"steps": steps, "time_step": time_step, "progress": False, **options}
    mine = ms.simulate(scene, integrator=TIGHT, **given)
    newton = ms.simulate(scene, integrator=ms.ImplicitEuler(), solver=NEWTON, **given)
    assert not mine.substeps and not newton.substeps
    return mine.positions, newton.positions


def assert_same(found, expected, tolerance=1e-8):
    moved = np.abs(expected - expected[0]).max()
    assert moved > 1e-2 * SIZE[1]
    assert np.abs(found - expected).max() < tolerance * moved
