"""Energies of a scene in any shape, in equilibrium or not."""

import numpy as np
import pytest
from body_contact_scenes import DOWN, PLATE, SOFT, two_sheets

import magshell as ms

BOX = ms.meshes.box((0.02, 0.02, 0.02), cells=(2, 2, 2))


def mixed(**options):
    """Return a scene of a sheet, a solid and another sheet, in a field and with gravity."""
    rubber = ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3)
    cube = ms.Solid(BOX.transformed(translation=(0, 0, 0.05)), material=rubber, mass_density=1e3)
    sheets = [ms.Shell(PLATE, **SOFT), ms.Shell(PLATE.transformed(translation=(0, 0, 0.1)), **SOFT)]
    bodies = [sheets[0], cube, sheets[1]]
    supports = [ms.Clamp(PLATE.edges_at(x=0.0), body=each) for each in sheets]
    supports.append(ms.Pin(cube.mesh.vertices_at(x=0.0), body=cube))
    return ms.Scene(bodies, supports=supports, gravity=DOWN, field=ms.UniformField(), **options)


GIVEN = {"remanent_magnetization": (2e4, 0, 0), "applied_flux_density": (0, 0, 2e-3)}


def given(scene):
    rows = np.zeros((scene.mesh.n_faces, 3))
    for body, span in zip(scene.bodies, scene._bodies.spans, strict=True):
        if isinstance(body, ms.Shell):
            rows[span.faces] = (2e4, 0, 0)
    return {**GIVEN, "remanent_magnetization": rows}


def test_energies_of_an_equilibrium_are_those_of_its_result():
    scene = mixed()
    rest = ms.equilibrium(scene, **given(scene))
    found = ms.energies(scene, rest.positions, edge_rotations=rest.edge_rotations, **given(scene))
    assert found.keys() == rest.energies.keys()
    for name, energy in rest.energies.items():
        assert found[name] == pytest.approx(energy, rel=1e-12, abs=1e-18)
    half = ms.energies(scene, rest.positions, gravity_factor=0.5, **given(scene))
    assert half["gravity"] == pytest.approx(0.5 * found["gravity"])


def test_energies_of_bodies_make_up_the_sum():
    """Check that one stretched body has all of the energy, and that all bodies make up the sum."""
    scene = mixed()
    for k, body in enumerate(scene.bodies):
        positions = scene.mesh.rest_positions.copy()
        span = scene._bodies.spans[k]
        positions[span.vertices, 0] *= 1.01
        whole = ms.energies(scene, positions, **given(scene))
        own = ms.energies(scene, positions, body=body, **given(scene))
        assert own and own.keys() == ({"solid"} if k == 1 else {"membrane", "bending"})
        for name, energy in own.items():
            assert energy == pytest.approx(whole[name], rel=1e-12, abs=1e-20)
        assert max(own.values()) > 0
        others = [each for each in scene.bodies if each is not body]
        assert all(
            abs(energy) < 1e-12 * max(own.values())
            for each in others
            for energy in ms.energies(scene, positions, body=each, **given(scene)).values()
        )


def test_energies_do_not_depend_on_earlier_solves():
    """Check angles beyond half a circle, whose branch the core tracks during a solve."""
    mesh = ms.meshes.rectangle(0.1, 0.01, cells=(10, 1))
    strip = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6, bending="hinge")
    ends = [ms.Clamp(mesh.edges_at(x=0.0)), ms.Clamp(mesh.edges_at(x=0.1), rotation=(3.0, 0, 0))]
    scene = ms.Scene(strip, supports=ends)
    before = ms.energies(scene, mesh.rest_positions)
    ms.equilibrium(scene)
    assert ms.energies(scene, mesh.rest_positions) == before


def test_values_and_friction_of_the_scene_stay_unchanged():
    scene = two_sheets(rubbing=0.3)
    lower = scene.bodies[0]
    positions = scene.mesh.rest_positions * (1.001, 1, 1)
    once = ms.energies(scene, positions)
    twice = ms.energies(scene, positions, values={lower: {"young_modulus": 2e6}})
    assert twice["membrane"] == pytest.approx(1.5 * once["membrane"], rel=1e-9)
    assert ms.energies(scene, positions) == once


def test_bad_input_is_refused():
    scene = two_sheets()
    rest = scene.mesh.rest_positions
    with pytest.raises(ValueError, match=r"positions \[m\]"):
        ms.energies(scene, rest[:-1])
    with pytest.raises(ValueError, match=r"edge_rotations \[rad\]"):
        ms.energies(scene, rest, edge_rotations=[0.0])
    with pytest.raises(ValueError, match=r"remanent_magnetization of body 0"):
        ms.energies(mixed(), mixed().mesh.rest_positions)
    with pytest.raises(ValueError, match=r"scene\.bodies|in the scene|one of"):
        ms.energies(scene, rest, body=ms.Shell(PLATE, **SOFT))
    lowered = rest - np.repeat([[0, 0, 0], [0, 0, 1e-3]], PLATE.n_vertices, axis=0)
    with pytest.raises(ValueError, match=r"no energy at these positions: .* apart"):
        ms.energies(scene, lowered)
    with pytest.raises(ValueError, match="without area"):
        ms.energies(scene, np.zeros_like(rest))


@pytest.mark.parametrize("order", [1, 2])
def test_rotating_clamp_has_its_direction_in_energies(order):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2), order=order)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    turned = ms.Clamp(mesh.edges_at(x=0.0), rotation=(0.0, -0.5, 0.0))
    scene = ms.Scene(sheet, supports=[turned], gravity=(0, 0, -9.81))
    rest = ms.equilibrium(scene, support_factor=0.7)
    found = ms.energies(scene, rest.positions, edge_rotations=rest.edge_rotations, support_factor=0.7)
    assert found["bending"] == pytest.approx(rest.energies["bending"], rel=1e-9)
