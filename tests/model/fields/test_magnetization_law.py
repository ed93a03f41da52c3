"""The law of a magnetization: whether it stretches with a body or only rotates with it."""

import numpy as np
import pytest

import magshell as ms
from magshell.output.results.state import states_of

YOUNG, MAGNETIZATION, FLUX_DENSITY = 1e5, 6e4, 0.05
STRAIN = MAGNETIZATION * FLUX_DENSITY / YOUNG
LENGTH = 0.04


def three_node_strip(law, **options):
    mesh = ms.meshes.rectangle(LENGTH, 0.01, cells=(8, 2))
    return ms.Shell(mesh, thickness=1e-3, young_modulus=YOUNG, poisson_ratio=0.0, **law, **options)


def six_node_strip(law):
    mesh = ms.meshes.rectangle(LENGTH, 0.01, cells=(4, 1), order=2)
    return ms.Shell(mesh, thickness=1e-3, young_modulus=YOUNG, poisson_ratio=0.0, **law)


def solid_strip(element):
    def build(law):
        mesh = ms.meshes.box((LENGTH, 0.01, 0.01), cells=(4, 1, 1))
        material = ms.StVenantKirchhoff(young_modulus=YOUNG, poisson_ratio=0.0)
        return ms.Solid(
            mesh, material=material, element=element, remanent_magnetization=(MAGNETIZATION, 0, 0), **law
        )

    return build


def skinned_strip(law):
    mesh = ms.meshes.box((LENGTH, 0.01, 0.01), cells=(4, 1, 1))
    material = ms.StVenantKirchhoff(young_modulus=YOUNG, poisson_ratio=0.0)
    faces = np.concatenate([mesh.faces_at(z=0.0), mesh.faces_at(z=0.01)])
    skin = ms.Skin(thickness=5e-3, faces=faces, remanent_magnetization=(MAGNETIZATION, 0, 0), **law)
    return ms.Solid(mesh, material=material, element="linear", skin=skin)


STRIPS = {
    "three-node shell": three_node_strip,
    "six-node shell": six_node_strip,
    "linear solid": solid_strip("linear"),
    "quadratic solid": solid_strip("quadratic"),
    "skin": skinned_strip,
}


def elongation(strip, law) -> float:
    """Compute the strain of a strip that is magnetized along a uniform field."""
    body = STRIPS[strip]({"magnetization_law": law})
    if isinstance(body, ms.Shell):
        support = ms.Clamp(body.mesh.edges_at(x=0.0))
        given = {"remanent_magnetization": (MAGNETIZATION, 0, 0)}
    else:
        support, given = ms.Pin(body.mesh.vertices_at(x=0.0)), {}
    scene = ms.Scene(body, supports=[support], field=ms.UniformField())
    found = ms.equilibrium(scene, applied_flux_density=(FLUX_DENSITY, 0, 0), **given)
    return found.displacements[body.mesh.vertices_at(x=LENGTH), 0].mean() / LENGTH


@pytest.mark.parametrize("strip", STRIPS)
def test_a_strip_along_the_field_grows_if_its_magnetization_stretches_and_not_if_it_rotates(strip):
    assert elongation(strip, "stretches") == pytest.approx(STRAIN, rel=0.1)
    assert abs(elongation(strip, "rotates")) < 1e-4 * STRAIN


def test_a_strip_that_bends_without_stretching_is_the_same_under_both_laws():
    tips = []
    for law in ("stretches", "rotates"):
        strip = three_node_strip({"magnetization_law": law})
        scene = ms.Scene(strip, supports=[ms.Clamp(strip.mesh.edges_at(x=0.0))], field=ms.UniformField())
        bent = ms.equilibrium(
            scene, remanent_magnetization=(MAGNETIZATION, 0, 0), applied_flux_density=(0, 0, 2e-4)
        )
        tips.append(bent.displacements[-1])
    assert np.linalg.norm(tips[0]) > 0.1 * LENGTH
    assert np.linalg.norm(tips[1] - tips[0]) < 1e-3 * np.linalg.norm(tips[0])


def test_the_law_is_kept_when_values_of_a_body_are_replaced():
    law = {"magnetization_law": "rotates"}
    for strip in (three_node_strip(law), solid_strip("linear")(law)):
        assert strip.replaced(mass_density=900.0).magnetization_law == "rotates"
    assert skinned_strip(law).skin.replaced(thickness=1e-3).magnetization_law == "rotates"


@pytest.mark.parametrize("law", ["turns", None, 3, ("rotates",)])
def test_unknown_laws_are_refused(law):
    for build in (three_node_strip, solid_strip("linear"), skinned_strip):
        with pytest.raises(ValueError, match="magnetization_law must be one of"):
            build({"magnetization_law": law})


@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_the_drawn_magnetization_follows_the_law(law):
    """Check a strip that is stretched by a half and turned about y: F M_r is half longer than R M_r."""
    strip = three_node_strip({"magnetization_law": law}, remanent_magnetization=(MAGNETIZATION, 0, 1e4))
    x, y, _ = strip.mesh.rest_positions.T
    turned = np.stack([1.5 * np.cos(0.4) * x, y, 1.5 * np.sin(0.4) * x], axis=1)
    (state,) = states_of(strip, positions=turned)
    length = MAGNETIZATION * (1.5 if law == "stretches" else 1.0)
    along, normal = np.array([np.cos(0.4), 0, np.sin(0.4)]), np.array([-np.sin(0.4), 0, np.cos(0.4)])
    np.testing.assert_allclose(
        state.magnetization, np.broadcast_to(length * along + 1e4 * normal, (32, 3)), atol=1e-9 * length
    )
