"""Consistent masses against lumped ones in every kind of scene of gradient_kinds.py, so that none omits a mass.

The rows of an element's consistent mass matrix sum up to its lumped masses where the element is linear. Lumped masses give
every motion more kinetic energy: for triangles a twelfth of their mass times the squared differences of the velocity along
their edges.
"""

import numpy as np
import pytest
from gradient_kinds import MAKERS, kind

import magshell as ms
from magshell.solve.linear.vibration import consistent_masses, masses_of_vertices

# [-] Of the ratio of the lowest frequencies beyond 1, over (longest edge / extent)^2: 0.02 to 1.7 was seen.
MESH_ERROR = 2.0


def lacks_density(scene) -> bool:
    return any(body.mass_density is None for body in scene.bodies)


def is_linear(scene) -> bool:
    return all(
        body.element == "linear" if isinstance(body, ms.Solid) else body.mesh.order == 1
        for body in scene.bodies
    )


WEIGHING = [name for name in MAKERS if kind(name).scene.bodies and not lacks_density(kind(name).scene)]
WITH_RIGID_PARTS = [name for name in MAKERS if kind(name).scene.rigid_parts]
WITH_TIES = [
    name
    for name in WEIGHING
    if any(isinstance(each, ms.EqualDisplacement | ms.Periodic) for each in kind(name).scene.supports)
]
WITHOUT = [name for name in WEIGHING if name not in (*WITH_RIGID_PARTS, *WITH_TIES)]


@pytest.mark.parametrize("name", WEIGHING)
def test_consistent_masses_of_bodies_sum_up_to_the_lumped_ones(name):
    values = kind(name).scene._values
    matrix, lumped = masses_of_vertices(values), values.vertex_masses
    assert matrix.sum() == pytest.approx(lumped.sum(), rel=1e-12)
    if is_linear(values.scene):
        together = np.zeros(len(lumped))
        np.add.at(together, values.scene._bodies.original, lumped)
        np.testing.assert_allclose(matrix.sum(axis=1), together, rtol=1e-12, atol=1e-12 * lumped.max())


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
@pytest.mark.parametrize(
    "name",
    [
        name
        for name in WITHOUT
        if not kind(name).scene.has_forces_of_motion and kind(name).scene.own_field is None
    ],
)
def test_consistent_and_lumped_masses_give_frequencies_that_differ_by_the_mesh_error_alone(name):
    scene, about = kind(name).scene, None
    pulls_at_rest = any(word in name for word in ("grow", "custom", "creased"))
    if any(isinstance(each, ms.Muscle) for each in scene.actuators) or pulls_at_rest:
        if kind(name).function is not ms.equilibrium:
            pytest.skip("the same bodies as of the kind at rest, which needs an equilibrium")
        about = kind(name).found({})
    lumped, consistent = (
        ms.vibration_modes(scene, about, count=8, mass=mass).squares for mass in ("lumped", "consistent")
    )
    first = np.argmax(lumped > 1e-6 * lumped.max())
    ratio = np.sqrt(consistent[first] / lumped[first])
    coarse = scene.mesh.edge_lengths.max() / np.ptp(scene.mesh.rest_positions, axis=0).max()
    assert 1.0 <= ratio <= 1.0 + MESH_ERROR * coarse**2


@pytest.mark.parametrize("name", [*WITH_RIGID_PARTS, *WITH_TIES])
def test_consistent_masses_with_rigid_parts_or_ties_are_refused(name):
    scene = kind(name).scene
    with pytest.raises(ValueError, match='mass="lumped"'):
        consistent_masses(scene._values)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
@pytest.mark.parametrize("density", [2.5e4, (1e4, 4e4)])
def test_bar_with_half_of_its_mass_in_a_skin_on_its_tip_swings_as_slowly_with_consistent_masses(
    element, density
):
    """Check a bar of 20 g whose skin on the last tenth has another 20 g.

    f = sqrt(3 E I / (L^3 (m_tip + 0.236 m))) / 2 pi.
    """
    length, width = 0.1, 0.02
    mesh = ms.meshes.box((length, width, width), cells=(20, 3, 3))
    tip = mesh.faces_where(lambda x: x[:, 0] > 0.9 * length + 1e-9)
    area = mesh.face_areas[tip].sum()
    rows = np.resize(density, len(tip)) if np.ndim(density) else density
    scale = 0.02 / (area * 1e-3 * np.mean(rows))
    skin = ms.Skin(thickness=1e-3, mass_density=np.multiply(scale, rows), faces=tip)
    material = ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.0)
    bar = ms.Solid(mesh, material=material, mass_density=500.0, element=element, skin=skin)
    scene = ms.Scene(bar, supports=[ms.Pin(bar.mesh.vertices_at(x=0.0))])
    lumped, consistent = (
        ms.vibration_modes(scene, count=1, mass=mass).frequencies[0] for mass in ("lumped", "consistent")
    )
    assert consistent == pytest.approx(lumped, rel=0.01)
    light = ms.Solid(mesh, material=material, mass_density=500.0, element=element)
    held = ms.Scene(light, supports=[ms.Pin(light.mesh.vertices_at(x=0.0))])
    assert ms.vibration_modes(held, count=1, mass="consistent").frequencies[0] > 1.5 * consistent
