"""Results for solids: strain and stress of their tetrahedra with the values of their solve."""

import warnings

import numpy as np
import pytest

import magshell as ms

MODULI = {"young_modulus": 1e5, "poisson_ratio": 0.3}


def bar(element="quadratic", cells=(3, 1, 1), material=None, **given):
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=cells)
    return ms.Solid(mesh, material=material or ms.NeoHookean(**MODULI), element=element, **given)


def strip():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2)).transformed(translation=(0, 0, 0.1))
    return ms.Shell(mesh, thickness=1e-3, young_modulus=1e8, mass_density=1e3)


def pulled(solid, by=0.02, **given):
    """Return a scene of a solid pulled at its ends, which may contract laterally."""
    x = solid.mesh
    left, right = x.vertices_at(x=0.0), x.vertices_at(x=0.1)
    ends = [ms.Pin(left, components="x", body=solid), ms.Pin(right, "x", displacement=(by, 0, 0), body=solid)]
    sides = [ms.Pin(x.vertices_at(**{axis: 0.0}), axis, body=solid) for axis in "yz"]
    return ms.Scene(solid, supports=ends + sides, **given)


def with_a_strip(order):
    sheet, solid = strip(), bar(mass_density=1e3)
    supports = [
        ms.Clamp(sheet.mesh.edges_at(x=0.0), body=sheet),
        ms.Pin(solid.mesh.vertices_at(x=0.0), body=solid),
    ]
    bodies = [sheet, solid] if order == "shell first" else [solid, sheet]
    return sheet, solid, ms.Scene(bodies, supports=supports, gravity=(0, 0, -9.81))


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_uniaxial_tension_of_a_neo_hookean_bar(element):
    """Compare with P = mu (s - 1/s) + lambda ln J / s along and zero stress across."""
    solid = bar(element)
    strains = ms.equilibrium(pulled(solid))[solid].strains()
    mu, lam = 1e5 / 2.6, 1e5 * 0.3 / (1.3 * 0.4)
    along, across = 1.2, 1.0
    for _ in range(50):  # Newton for mu (t^2 - 1) + lambda ln(s t^2) = 0
        f = mu * (across**2 - 1) + lam * np.log(along * across**2)
        across -= f / (2 * mu * across + 2 * lam / across)
    ratio = along * across**2
    stress = (mu * (along**2 - 1) + lam * np.log(ratio)) / ratio
    assert np.allclose(strains.volume_ratios, ratio, rtol=1e-9)
    assert np.allclose(strains.green_strains[..., 0, 0], 0.5 * (along**2 - 1), rtol=1e-9)
    assert np.allclose(strains.green_strains[..., 2, 2], 0.5 * (across**2 - 1), rtol=1e-9)
    assert np.allclose(strains.cauchy_stresses, stress * np.diag([1, 0, 0]), atol=1e-6 * stress)
    assert np.allclose(strains.von_mises_stresses, stress, rtol=1e-6)


def test_stress_is_that_of_the_values_the_result_was_found_with():
    """Check the stress after another solve has put other values into the core."""
    solid = bar()
    scene = pulled(solid)
    soft = ms.equilibrium(scene)
    before = soft[solid].strains().von_mises_stresses
    stiff = ms.equilibrium(scene, values={solid: {"young_modulus": 2e5}})
    assert np.allclose(stiff[solid].strains().von_mises_stresses, 2 * before, rtol=1e-8)
    assert np.array_equal(soft[solid].strains().von_mises_stresses, before)


def test_the_volume_ratio_of_nearly_incompressible_elements_is_told_by_their_means():
    """Check a block of nu = 0.499 whose J is off by a tenth at single points, of which the energy knows nothing."""
    mesh = ms.meshes.box((0.04, 0.04, 0.02), cells=(2, 2, 1))
    law = ms.NeoHookean("isochoric", young_modulus=1e6, poisson_ratio=0.499)
    block = ms.Solid(mesh, material=law)
    ends = [block.mesh.vertices_at(x=0.0), block.mesh.vertices_at(x=0.04)]
    pulled = [ms.Pin(ends[0]), ms.Pin(ends[1], displacement=(0.02, 0, 0))]
    rest = ms.equilibrium(ms.Scene(block, supports=pulled))
    strains = rest[block].strains()
    means = strains.mean(strains.volume_ratios)
    assert np.ptp(strains.volume_ratios) > 0.2 and np.abs(means - 1.0).max() < 0.02
    assert f"J {means.min():.4g} to {means.max():.4g} (means of elements)," in repr(rest)


def test_every_kind_of_result_has_strains_of_its_solid():
    solid = bar(mass_density=1e3)
    scene = pulled(solid, gravity=(0, 0, 1e-6))
    rest = ms.equilibrium(scene)
    ratio = rest[solid].strains().volume_ratios.max()
    assert f"J {rest[solid].strains().volume_ratios.min():.4g} to {ratio:.4g}" in repr(rest)
    assert "membrane" not in repr(rest)
    path = ms.follow_path(scene)
    assert "von Mises" in repr(path) and "in the last state" in repr(path)
    assert np.allclose(path.equilibrium(-1)[solid].strains().volume_ratios, ratio, rtol=1e-4)
    motion = ms.simulate(scene, steps=3, time_step=1e-4)
    assert "von Mises" in repr(motion)
    assert np.allclose(motion[solid].strains(0).volume_ratios, 1.0)
    assert motion[solid].strains().volume_ratios.max() > 1.0
    cases = ms.equilibrium(scene, support_factor=[0.5, 1.0])
    assert np.allclose(cases[solid].strains(1).volume_ratios, ratio, rtol=1e-6)
    assert cases[solid].strains(0).volume_ratios.max() < ratio


def test_large_strains_of_solids_give_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error", ms.LargeStrainWarning)
        rest = ms.equilibrium(pulled(bar(), by=0.1))
    assert "BEYOND THE MODEL" not in repr(rest)


@pytest.mark.parametrize("order", ["shell first", "solid first"])
def test_shells_beside_solids_have_their_own_rows(order):
    sheet, solid, scene = with_a_strip(order)
    alone = ms.Scene(sheet, supports=[ms.Clamp(sheet.mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    expected = ms.equilibrium(alone)
    rest = ms.equilibrium(scene)
    for strains in (rest.strains(), rest[sheet].strains()):
        assert np.allclose(strains.membrane, expected.strains().membrane, atol=1e-9)
        assert np.allclose(strains.bending, expected.strains().bending, atol=1e-7)
    assert np.allclose(expected[sheet].strains().bending, expected.strains().bending)
    assert "of the membrane" in repr(rest) and f"body {scene.bodies.index(solid)}: J " in repr(rest)
    motion = ms.simulate(scene, steps=2, time_step=1e-3)
    assert motion[sheet].strains(1).membrane.shape == (sheet.mesh.n_faces, 2)
    assert len(ms.follow_path(scene)) > 1


def test_strains_of_a_result_with_one_solid_are_those_of_the_solid():
    scene = pulled(bar())
    result = ms.equilibrium(scene)
    (solid,) = scene.bodies
    for own, of_body in zip(result.strains(), result[solid].strains(), strict=True):
        np.testing.assert_array_equal(own, of_body)


def test_a_face_of_a_quadratic_solid_is_not_held_by_its_corners_alone():
    mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(3, 1, 1))
    wrong = mesh.vertices_at(x=0.0)  # of the mesh that was given, not of the solid
    quadratic = ms.Solid(mesh, material=ms.NeoHookean(**MODULI))
    with pytest.raises(ValueError, match=r"corners of 2 faces.*solid\.mesh\.vertices_at"):
        ms.Scene(quadratic, supports=[ms.Pin(wrong)])
    ms.Scene(quadratic, supports=[ms.Pin(quadratic.mesh.vertices_at(x=0.0))])
    right = quadratic.mesh.vertices_at(x=0.1)  # beside faces whose nodes are all held
    with pytest.raises(ValueError, match=r"corners of 2 faces"):
        ms.Scene(quadratic, supports=[ms.Pin(np.union1d(wrong, right))])
    linear = ms.Solid(mesh, material=ms.NeoHookean(**MODULI), element="linear")
    ms.Scene(linear, supports=[ms.Pin(wrong)])


def test_eighth_with_symmetry_planes_equals_the_full_block():
    """Compare a block pulled at both ends with its eighth."""
    material = ms.NeoHookean(**MODULI)
    whole = ms.Solid(ms.meshes.box((0.2, 0.04, 0.04), cells=(4, 2, 2)), material=material)
    part = ms.Solid(ms.meshes.box((0.1, 0.02, 0.02), cells=(2, 1, 1)), material=material)
    x = whole.mesh
    middle = [x.rest_positions.min(axis=0)[k] + size for k, size in enumerate((0.1, 0.02, 0.02))]
    held = [ms.Pin(x.vertices_at(**{axis: at}), axis) for axis, at in zip("xyz", middle, strict=True)]
    low, high = x.rest_positions[:, 0].min(), x.rest_positions[:, 0].max()
    ends = [
        ms.Pin(x.vertices_at(x=low), "x", displacement=(-0.02, 0, 0)),
        ms.Pin(x.vertices_at(x=high), "x", displacement=(0.02, 0, 0)),
    ]
    planes = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    end = ms.Pin(part.mesh.vertices_at(x=0.1), "x", displacement=(0.02, 0, 0))
    one = ms.equilibrium(ms.Scene(whole, supports=held + ends))
    eighth = ms.equilibrium(ms.Scene(part, supports=[*planes, end]))
    assert np.isclose(8 * eighth.energy, one.energy, rtol=1e-9)
    assert np.allclose(
        eighth[part].strains().von_mises_stresses, one[whole].strains().von_mises_stresses[0, 0]
    )


def test_a_couple_on_an_edge_of_a_solid_is_refused():
    solid = bar()
    couple = ms.EdgeCouple(solid.mesh.boundary_edges[:2], 1.0)
    with pytest.raises(ValueError, match="turns edges of a shell"):
        ms.Scene(solid, supports=[ms.Pin(solid.mesh.vertices_at(x=0.0))], loads=[couple])


def test_a_rigid_part_on_a_solid_leaves_its_strains_to_be_asked_for():
    solid = bar(mass_density=1e3)
    end = solid.mesh.vertices_at(x=0.1)
    part = ms.RigidBody(end, mass=0.01, inertia=1e-6 * np.eye(3), center=(0.1, 0.01, 0.01))
    held = ms.Pin(solid.mesh.vertices_at(x=0.0))
    scene = ms.Scene([solid, part], supports=[held], gravity=(0, 0, -9.81))
    rest = ms.equilibrium(scene)
    behind = np.flatnonzero(np.isin(solid.mesh.tetrahedra, end).sum(axis=1) == 6)  # a side of them is rigid
    strains = rest[solid].strains()
    assert len(behind) and strains.volume_ratios.min() < 1 < strains.volume_ratios.max()
    motion = ms.simulate(scene, start=rest, steps=2, time_step=1e-3)
    assert np.allclose(motion[solid].strains(0).volume_ratios, strains.volume_ratios, atol=1e-9)
