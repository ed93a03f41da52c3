"""Bodies that start within the default activation distance of their contact are warned of, with their force and gap."""

import re
import warnings

import pytest

import magshell as ms


def blocks(gap, **options):
    material = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3)
    meshes = [
        ms.meshes.box((0.02, 0.004, 0.01), cells=(4, 1, 2)).transformed(translation=(0, 0, z))
        for z in (gap, -0.01)
    ]
    upper, lower = (ms.Solid(mesh, material=material) for mesh in meshes)
    contact = ms.Contact(upper, lower, **options)
    supports = [
        ms.Pin(upper.mesh.vertices_at(z=0.01 + gap), body=upper),
        ms.Pin(lower.mesh.vertices_at(z=-0.01), body=lower),
    ]
    return ms.Scene([upper, lower], supports=supports, contacts=[contact]), contact


def made(gap, **options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene, contact = blocks(gap, **options)
    return scene, contact, [str(each.message) for each in caught if each.category is ms.MeshQualityWarning]


def test_blocks_within_the_default_distance_are_warned_of_with_force_and_gap():
    scene, _, messages = made(1e-5)
    [message] = messages
    assert "body 0 and body 1 start 1e-05 m apart" in message
    force = float(re.search(r"with (\S+) N", message).group(1))
    held = ms.energies(scene, scene.mesh.rest_positions)["body contact"]
    assert held > 0 and force > 0
    nearer = ms.forces(scene, scene.mesh.rest_positions).on_vertices
    upper = nearer[: scene.bodies[0].mesh.n_vertices, 2].sum()
    assert upper == pytest.approx(force, rel=0.01)  # three digits are printed


@pytest.mark.parametrize("gap, options", [(1e-3, {}), (1e-5, {"activation_distance": 5e-6})])
def test_blocks_that_do_not_push_are_not_warned_of(gap, options):
    scene, _, messages = made(gap, **options)
    assert not messages
    assert ms.energies(scene, scene.mesh.rest_positions).get("body contact", 0.0) == 0.0
