"""Bodies of an own field that are near each other, touch or overlap: warnings and errors in the place of wrong forces."""

import re
import warnings

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY, cuboid_force

import magshell as ms
from magshell.model.scene.own_field_errors import gap_errors, warn_of_gaps
from magshell.model.scene.solve_inputs import plain_inputs

SIDE, THICKNESS, POLARIZATION = 0.01, 2e-4, 0.1
MAGNETIZATION = (0.0, 0.0, POLARIZATION / VACUUM_PERMEABILITY)
RUBBER = ms.StableNeoHookean(young_modulus=1e9, poisson_ratio=0.3)
PLATE, CUBE = (SIDE, SIDE, THICKNESS), (SIDE, SIDE, SIDE)


def plate(height, cells=12, **options):
    mesh = ms.meshes.rectangle(SIDE, SIDE, cells=(cells, cells)).transformed(translation=(0, 0, height))
    options = {"young_modulus": 1e9, "remanent_magnetization": MAGNETIZATION, "mass_density": 2e3, **options}
    return ms.Shell(mesh, thickness=THICKNESS, **options)


def cube(height, cells=3, along=(0, 0, 0)):
    """Return a cube whose center is at a height above that of a plate at zero."""
    mesh = ms.meshes.box(CUBE, cells=(cells,) * 3)
    at = np.add(along, (0, 0, height - SIDE / 2))
    return ms.Solid(
        mesh.transformed(translation=tuple(at)),
        material=RUBBER,
        element="linear",
        mass_density=2e3,
        remanent_magnetization=MAGNETIZATION,
    )


def held(*bodies, **scene):
    supports = [ms.Pin(np.arange(each.mesh.n_vertices), body=each) for each in bodies]
    return ms.Scene(bodies, supports=supports, own_field=ms.OwnField(), **scene)


def result_and_warnings(call):
    """Return what a call returns, and the texts of its warnings about fields."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = call()
    return found, [str(each.message) for each in caught if each.category is ms.FieldSamplingWarning]


@pytest.mark.parametrize(
    ("first", "second", "sizes", "distance"),
    [
        (plate(0.0), plate(1.1 * THICKNESS), (PLATE, PLATE), 1.1 * THICKNESS),
        (plate(0.0, 16), plate(2 * THICKNESS, 16), (PLATE, PLATE), 2 * THICKNESS),
        (cube(0.0, 4), cube(1.05 * SIDE, 4), (CUBE, CUBE), 1.05 * SIDE),
        (cube(0.0, 4), cube(1.25 * SIDE, 4), (CUBE, CUBE), 1.25 * SIDE),
        (
            cube(0.0),
            plate(0.5 * (SIDE + THICKNESS) + 1e-6, 4),
            (CUBE, PLATE),
            0.5 * (SIDE + THICKNESS) + 1e-6,
        ),
        (cube(0.0), plate(0.5 * SIDE + 1.5 * THICKNESS, 4), (CUBE, PLATE), 0.5 * SIDE + 1.5 * THICKNESS),
    ],
    ids=["plates near", "plates", "cubes near", "cubes", "plate on cube", "plate above cube"],
)
def test_near_bodies_are_warned_of_where_their_force_is_off(first, second, sizes, distance):
    """Check the error that the warning names to 40 %, and that there is none below 0.5 %."""
    found, warned = result_and_warnings(lambda: ms.equilibrium(held(first, second), progress=False))
    exact = cuboid_force(*sizes, (0, 0, distance), 2, POLARIZATION)[2]
    error = abs(found.magnetic_force(second)[2] / exact - 1)
    assert error < 5e-3 or error > 0.02
    assert bool(warned) == (error > 0.01)
    if warned:
        named = float(re.search(r"is off by about ([\d.]+)%", warned[0]).group(1)) / 100
        assert named == pytest.approx(error, rel=0.4)


@pytest.mark.parametrize(("distance", "is_off"), [(1.05 * SIDE, True), (1.4 * SIDE, False)])
def test_near_bodies_are_warned_of_where_their_couple_is_off(distance, is_off):
    """Check a cube that is shifted along another, against the charges of its sides in the closed field of a magnet."""
    along = np.array((2e-3, 3e-3, distance))
    first, second = cube(0.0, 4), cube(distance, 4, along=(*along[:2], 0))
    found, warned = result_and_warnings(lambda: ms.equilibrium(held(first, second), progress=False))
    at, weights = np.polynomial.legendre.leggauss(24)
    x, y, side = np.meshgrid(at, at, (-1.0, 1.0), indexing="ij")
    arms = SIDE / 2 * np.stack([x, y, side], axis=-1).reshape(-1, 3)
    charges = MAGNETIZATION[2] * (SIDE / 2) ** 2 * weights[:, None, None] * weights[:, None] * side
    fields = ms.CuboidMagnet(CUBE, MAGNETIZATION).flux_density(arms + along)
    exact = np.cross(arms, charges.reshape(-1, 1) * fields).sum(axis=0)
    error = np.linalg.norm(found.magnetic_torque(second) - exact) / np.linalg.norm(exact)
    assert (error > 0.02) == is_off and (is_off or error < 5e-3)
    (named,) = [re.search(r"the couple .* is off by about ([\d.]+)%", each) for each in warned] or [None]
    assert (named is not None) == is_off
    if named:
        assert float(named.group(1)) / 100 == pytest.approx(error, rel=0.4)


@pytest.mark.parametrize(("gap", "is_wrong"), [(0.1 * THICKNESS, True), (3 * THICKNESS, False)])
def test_parts_of_a_folded_sheet_are_warned_of_like_two_plates(gap, is_wrong):
    """Check a sheet that is folded flat, so that its outer parts are two plates that lie on each other."""
    mesh = ms.meshes.rectangle(2.2 * SIDE, SIDE, cells=(22, 10))
    x = mesh.rest_positions
    folded = x.copy()
    right = x[:, 0] > 1.1 * SIDE
    folded[right, 0] = 2.2 * SIDE - x[right, 0]
    folded[:, 2] = (gap + THICKNESS) * np.clip((x[:, 0] - SIDE) / (0.2 * SIDE), 0.0, 1.0)
    # Only the outer parts have a magnetization: those that lie on each other.
    centers = x[mesh.faces].mean(axis=1)[:, 0]
    outer = (centers < SIDE) | (centers > 1.2 * SIDE)
    magnetization = (
        np.where(outer[:, None], [[0.0, 0.0, 1.0]], 0.0) * np.where(centers < SIDE, 1.0, -1.0)[:, None]
    )
    magnetization *= MAGNETIZATION[2]
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=1e9, remanent_magnetization=magnetization)
    scene = held(sheet)
    values = plain_inputs(scene, None, None, None).values
    state = scene._model.state(folded, np.zeros(scene._bodies.n_rotations))
    (found,) = gap_errors(values, state)
    assert found.action == "within" and found.gap < 2 * (gap + THICKNESS)
    assert (found.error > 0.05) == is_wrong and (is_wrong or found.error < 5e-3)
    _, warned = result_and_warnings(lambda: warn_of_gaps([found], "this state"))
    assert bool(warned) == is_wrong and all("between parts of Shell(" in each for each in warned)


def flaps(gap):
    mesh = ms.meshes.rectangle(SIDE, SIDE / 2, cells=(4, 2))
    pair = [
        ms.Shell(each, thickness=THICKNESS, young_modulus=1e8, mass_density=2e3)
        for each in (mesh, mesh.transformed(translation=(0, 0, gap + THICKNESS)))
    ]
    return ms.Scene(
        pair, supports=[ms.Clamp(mesh.edges_at(x=0.0), body=each) for each in pair], own_field=ms.OwnField()
    )


@pytest.mark.parametrize("gap", [0.2 * THICKNESS, 10 * THICKNESS])
def test_paths_and_motions_warn_of_near_bodies(gap):
    scene, options = flaps(gap), {"remanent_magnetization": (2e4, 0, 0), "progress": False}
    for what, solve in (
        ("path", lambda: ms.follow_path(scene, **options)),
        ("motion", lambda: ms.simulate(scene, steps=2, time_step=1e-5, **options)),
    ):
        _, warned = result_and_warnings(solve)
        assert bool(warned) == (gap < THICKNESS)
        assert all(each.startswith(f"the {what}, ") and "own field" in each for each in warned)


@pytest.mark.parametrize(
    "intruder", [cube(0.4 * SIDE), cube(0.0), plate(0.2 * SIDE), cube(0.7 * SIDE, along=(3e-3, 2e-3, 0))]
)
def test_bodies_that_reach_into_a_solid_are_refused(intruder):
    solid = cube(0.0)
    scene = held(solid, intruder)
    with pytest.raises(ValueError, match=r"vertices \(.*\) of body \d are inside of body \d, Solid"):
        ms.equilibrium(scene, progress=False)
    with pytest.raises(ValueError, match=r"are inside of body \d, Solid"):
        ms.simulate(scene, steps=1, time_step=1e-4, progress=False)
    alone = ms.Scene(
        scene.bodies, supports=scene.supports, own_field=ms.OwnField(solid), field=ms.UniformField()
    )
    assert ms.equilibrium(alone, applied_flux_density=(0, 0, 0), progress=False).stable


def test_solids_that_touch_are_named():
    with pytest.raises(ValueError, match="33 pairs of edges coincide"):
        ms.equilibrium(held(cube(0.0), cube(SIDE)), progress=False)


def test_vertices_inside_of_a_magnet_are_warned_of():
    for height, inside in ((0.0, True), (0.5 * SIDE, False), (0.6 * SIDE, False)):
        magnet = ms.CuboidMagnet(CUBE, MAGNETIZATION, center=(0.3 * SIDE, 0.4 * SIDE, -height))
        sheet = plate(0.0, 4)
        scene = ms.Scene(sheet, supports=ms.Pin(np.arange(sheet.mesh.n_vertices)), field=magnet)
        _, warned = result_and_warnings(lambda scene=scene: ms.equilibrium(scene, progress=False))
        assert any("vertices 0, 1, 2, 3, ... are inside of CuboidMagnet" in each for each in warned) == inside


def test_flux_density_inside_of_a_solid_is_nan():
    """Check that mu_0 H, which the charges give, is not returned as the flux density mu_0 (H + M) there."""
    solid, sheet = cube(0.0), plate(SIDE)
    state = ms.field_of(ms.equilibrium(held(solid, sheet), progress=False))
    points = SIDE * np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 0.499], [0.5, 0.5, 0.501], [1.1, 0.5, 0.0]])
    for flux in (state.flux_density, state.own_flux_density):
        assert np.isnan(flux(points)).all(axis=1).tolist() == [True, True, False, False]
