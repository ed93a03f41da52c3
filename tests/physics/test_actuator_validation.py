"""Cavities and cells against exact and published numbers: cases T9a and P3 of the validation set."""

import numpy as np
import pytest
from pressed_tubes import INCOMPRESSIBLE, LARGEST, TINY, TUBES, at

import magshell as ms


def tube_as_cavity(
    material: str, inside: dict, cells=(4, 16, 1), **moduli
) -> tuple[ms.Equilibrium, np.ndarray, ms.Cavity]:
    """Solve a ring in plane strain with lids over its two rims; return (equilibrium, inner and outer radius,
    cavity).
    """
    mesh = ms.meshes.tube(1.0, 2.0, 0.5, cells=cells, order=2)
    density = ms.StableNeoHookean if material == "stable" else lambda **own: ms.NeoHookean(material, **own)
    solid = ms.Solid(mesh, material=density(**moduli))
    x = solid.mesh.rest_positions
    inner = np.flatnonzero((np.hypot(x[..., 0], x[..., 1]) < 1 + TINY)[solid.mesh.faces].all(axis=1))
    cavity = ms.Cavity(solid, inner, close_rims=True, **inside)
    flat = np.union1d(at(solid, z=0.0), at(solid, z=0.5))
    pins = [
        ms.Pin(flat, components="z"),
        ms.Pin(at(solid, x=0.0), components="x"),
        ms.Pin(at(solid, y=0.0), components="y"),
    ]
    rest = ms.equilibrium(ms.Scene(solid, supports=pins, actuators=[cavity]))
    radii = np.hypot(*rest.positions[:, :2].T)
    around = np.hypot(x[:, 0], x[:, 1])
    ends = np.array([radii[np.abs(around - r) < 1e-6].mean() for r in (1.0, 2.0)])
    return rest, ends, cavity


@pytest.mark.parametrize("case", TUBES, ids=lambda case: "{} {} {}".format(*case))
def test_t9a_tube_as_a_cavity(case):
    material, poisson_ratio, pressure = case
    rest, radii, cavity = tube_as_cavity(
        material, {"pressure": pressure}, young_modulus=1.0, poisson_ratio=poisson_ratio
    )
    assert rest.stable and rest.load_steps == 1 and rest.iterations <= 8
    assert np.allclose(radii, TUBES[case], rtol=2e-3)
    assert float(rest[cavity].volume) == pytest.approx(0.5 * np.pi * radii[0] ** 2, rel=2e-3)


@pytest.mark.parametrize("case", [*INCOMPRESSIBLE, LARGEST], ids=lambda case: f"{case[1]}")
def test_t9a_incompressible_tube_filled_with_liquid(case):
    """Prescribe the volume, all of it in one call; the pressure is the result, also where it hardly rises."""
    pressure, inner, outer, _ = case
    rest, radii, cavity = tube_as_cavity(
        "isochoric",
        {"volume": 0.5 * np.pi * inner**2, "bulk_modulus": 1e6},
        young_modulus=2 * 1.4999,
        poisson_ratio=0.4999,
    )
    assert rest.stable
    assert np.allclose(radii, (inner, outer), rtol=2e-3)
    assert float(rest[cavity].pressure) == pytest.approx(pressure, rel=5e-3)


# P3: t1/t2, E1/E2, curvature times thickness at a mismatch of 0.01, by Timoshenko.
BILAYERS = [
    (1.0, 1.0, 0.015),
    (0.5, 1.0, 0.01333333333),
    (1.0, 4.0, 0.01315068493),
    (0.2, 10.0, 0.01454545455),
]


def bilayer_of_cells(ratio: float, moduli: float, mismatch: float) -> float:
    """Return curvature times thickness of half the length and half the width of the strip.

    The volumetric energies of isochoric material and of cells add up to one about a volume of (1 + mismatch)^3, with a
    Poisson's ratio of 0: the stress-free length of the layer is larger by that factor in each direction.
    """
    layers = {1.0: 4, 0.5: 3, 0.2: 6}[ratio]
    half = ms.meshes.box(
        (10.0, 0.25, 1.0), cells=(20, 1, layers), diagonals="crossed" if layers % 2 == 0 else "alternating"
    )
    thick = ratio / (1.0 + ratio)
    swells = half.tetrahedron_barycenters[:, 2] < thick
    young = np.where(swells, moduli, 1.0)
    share = 0.9  # of the bulk modulus E/3 that is the material's own
    # K = 2 mu (1 + nu) / (3 (1 - 2 nu)) with mu = E/2
    poisson = (share - 1.0) / (1.0 + 2.0 * share)
    material = ms.NeoHookean(
        "isochoric",
        young_modulus=young * np.where(swells, 1.0 + poisson, 1.0),
        poisson_ratio=np.where(swells, poisson, 0.0),
    )
    solid = ms.Solid(half, material=material)
    target = ((1.0 + mismatch) ** 3 - share) / (1.0 - share)
    cells = ms.PneumaticCells(
        solid,
        [np.array([k]) for k in np.flatnonzero(swells)],
        stiffness=(1.0 - share) * moduli / 3.0,
        volume_ratio=target,
    )
    held = [
        ms.SymmetryPlane((1, 0, 0)),
        ms.SymmetryPlane((0, 1, 0)),
        ms.Pin(at(solid, x=0.0, y=0.0, z=0.0), components="z"),
    ]
    rest = ms.equilibrium(ms.Scene(solid, supports=held, actuators=[cells]))
    assert rest.stable
    x = solid.mesh.rest_positions
    line = np.flatnonzero((np.abs(x[:, 1]) < TINY) & (np.abs(x[:, 2]) < TINY) & (x[:, 0] < 10.0 / 3 + TINY))
    # The curvature of the lower side, by a circle through it; of the middle it is less far from the center.
    along, up = rest.positions[line][:, [0, 2]].T
    circle = np.stack([2 * along, 2 * up, np.ones(len(line))], axis=1)
    middle_x, middle_z, rest_of = np.linalg.lstsq(circle, along**2 + up**2, rcond=None)[0]
    radius = np.sqrt(rest_of + middle_x**2 + middle_z**2)
    assert middle_z > 1.0  # what swells is on the outside
    return 1.0 / (radius - 0.5)


@pytest.mark.parametrize("case", BILAYERS, ids=str)
def test_p3_bilayer_with_a_layer_of_cells_that_swells(case):
    """Extrapolate to small strains, for which Timoshenko's curvature is exact.

    The error, up to 1.34 % at a mismatch of 1 % on any mesh, is proportional to the mismatch; without it, it is
    below 0.4 %.
    """
    ratio, moduli, curvature = case
    full, half = (bilayer_of_cells(ratio, moduli, mismatch) for mismatch in (0.01, 0.005))
    assert full == pytest.approx(curvature, rel=0.014 if moduli == 4.0 else 0.01)
    assert 4.0 * half - full == pytest.approx(curvature, rel=4e-3)


def test_a_free_block_of_cells_rests_at_their_volume():
    """Check case P3: free of stress, its edges are the cube root of the target."""
    block = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
    solid = ms.Solid(block, material=ms.NeoHookean("isochoric", young_modulus=1.0, poisson_ratio=-0.9))
    bulk = 1.0 / (3 * (1 + 1.8))
    cells = ms.PneumaticCells(solid, [np.arange(solid.mesh.n_tetrahedra)], stiffness=1e3, volume_ratio=1.5)
    held = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    rest = ms.equilibrium(ms.Scene(solid, supports=held, actuators=[cells]))
    ratio = (1e3 * 1.5 + bulk) / (1e3 + bulk)
    assert np.allclose(rest.positions.max(axis=0), np.cbrt(ratio), rtol=1e-9)
    assert rest[cells].volume_ratios == pytest.approx(ratio, rel=1e-9)
