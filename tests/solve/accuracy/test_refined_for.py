"""ms.refined_for: tolerances that are met with few unknowns, what goes over to finer meshes, and limits."""

import sys
from pathlib import Path

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.finer import bisected
from magshell.model.scene.finer_scene import finer_scene

sys.path.insert(0, str(Path(__file__).parents[3]))
from benchmarks.cases import magnetic_strip

pytest.importorskip("torch")

PINCHED = 1.82842e-5  # m, the limit of Kirchhoff-Love theory (benchmarks/cases/linear_cylinders.py)
RADIUS = 300.0


def onto_cylinder(points):
    factors = RADIUS / np.linalg.norm(points[:, [0, 2]], axis=1)
    return np.stack([factors * points[:, 0], points[:, 1], factors * points[:, 2]], axis=1)


def pinched(n):
    """Return the response of an eighth of a pinched cylinder on n x n even cells, and its unknowns and deflection."""
    mesh = ms.meshes.cylinder(RADIUS, 300.0, (0.0, np.pi / 2), cells=(n, n), order=2)
    sheet = ms.Shell(mesh, thickness=3.0, young_modulus=3e6, poisson_ratio=0.3)
    axes = np.eye(3)
    supports = [ms.Pin(mesh.vertices_at(y=300.0), "xz"), *(ms.SymmetryPlane(axis) for axis in axes)]
    loaded = mesh.nearest_vertex((0, 0, RADIUS))
    scene = ms.Scene(sheet, supports=supports, loads=[ms.PointLoad(loaded, (0, 0, -0.25))])
    return ms.linear_response(scene), lambda bent: -bent.displacements[loaded, 2]


def strip(cells=(20, 2)):
    mesh = ms.meshes.rectangle(magnetic_strip.LENGTH, magnetic_strip.WIDTH, cells)
    scene = magnetic_strip.scene(mesh, "midedge")
    rest = ms.equilibrium(scene, **magnetic_strip.load_parameters(1.0, (0, 0, 1.0)))
    tip = mesh.vertices_at(x=magnetic_strip.LENGTH)
    return rest, lambda rest: rest.positions[tip, 2].mean() / magnetic_strip.LENGTH


def test_refined_meshes_need_fewer_unknowns_than_uniform_ones():
    response, deflection = pinched(6)
    found = ms.refined_for(response, deflection, 1e-3 * PINCHED, project=onto_cylinder)
    assert (
        abs(found.value - PINCHED) < 1.5e-3 * PINCHED
    )  # the estimate is right to a quarter of itself, or so
    uniform, same = pinched(24)
    assert abs(float(same(uniform)) - PINCHED) > 1e-2 * PINCHED
    assert 3 * found.n_dofs[-1] < uniform.scene.n_dofs
    assert np.all(np.diff(found.n_dofs) > 0)
    assert len(found.n_dofs) == len(found.values) == len(found.errors) > 2


def test_magnetized_strips_are_refined_until_the_tip_is_right():
    rest, tip = strip()
    tolerance = 5e-4
    found = ms.refined_for(rest, tip, tolerance)
    exact = magnetic_strip.stretched_end(1.0)[1]
    assert abs(exact - found.values[0]) > tolerance
    assert abs(exact - found.value) < 1.25 * tolerance
    assert isinstance(found.result, ms.Equilibrium)
    assert found.result.scene.n_dofs == found.n_dofs[-1]
    assert f"{tolerance:.2g}" in repr(found)


def test_values_of_faces_edges_and_groups_go_over():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(5, 2)).with_groups({"END": {"edges": [0]}})
    numbers = np.arange(mesh.n_faces)
    sheet = ms.Shell(
        mesh,
        thickness=1e-3 + 1e-5 * numbers,
        young_modulus=1e6 + 1e3 * numbers,
        poisson_ratio=0.3,
        mass_density=1e3,
        growth=1.0 + 1e-3 * numbers,
        remanent_magnetization=np.stack([1e3 * numbers, 0 * numbers, 1e3 + 0 * numbers], axis=1),
        magnetization_law="rotates",
    )
    edges = mesh.edges_at(x=0.1)
    loads = [
        ms.EdgeLoad(edges, np.outer(1.0 + np.arange(len(edges)), (0, 0, 1e-3))),
        ms.AreaLoad((0, 0, -0.1), faces=[0, 3]),
        ms.Pressure(np.array([0.1, 0.2]), faces=[1, 4]),
        ms.EdgeCouple(edges, 1e-6),
        ms.PointLoad([3], (0, 0, 1e-5)),
    ]
    scene = ms.Scene(
        sheet,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        loads=loads,
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
    )
    finer = bisected(mesh, np.array([0, 1, 8]), None)
    made = finer_scene(scene, scene._values, {id(sheet): finer})
    fine = made.bodies[0]
    for name in ("thickness", "young_modulus", "remanent_magnetization", "growth"):
        assert np.array_equal(getattr(fine, name), getattr(sheet, name)[finer.element_parents])
    assert fine.magnetization_law == "rotates"
    assert fine.vertex_masses.sum() == pytest.approx(sheet.vertex_masses.sum(), rel=1e-12)
    for old, new in zip(loads, made.loads, strict=True):
        if hasattr(old, "vertex_forces"):
            before, after = old.vertex_forces(mesh).sum(axis=0), new.vertex_forces(finer.mesh).sum(axis=0)
            assert np.allclose(after, before, rtol=1e-12, atol=1e-18)
    areas = [
        (np.broadcast_to(each.pressure, len(each.faces)) * on.face_areas[each.faces]).sum()
        for each, on in ((loads[2], mesh), (made.loads[2], finer.mesh))
    ]
    assert areas[1] == pytest.approx(areas[0], rel=1e-12)
    assert np.allclose(made.gravity, scene.gravity)
    assert finer.mesh.groups["END"]["edges"] == 2


def test_outputs_name_bodies_of_the_scene_given():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1))
    sheets = [
        ms.Shell(
            mesh.transformed(translation=(0, y, 0)), thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0
        )
        for y in (0.0, 0.05)
    ]
    held = [ms.Clamp(mesh.edges_at(x=0.0), body=body) for body in sheets]
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01), body=sheets[1])
    response = ms.linear_response(ms.Scene(sheets, supports=held, loads=[load]))
    tip = mesh.vertices_at(x=0.1)
    found = ms.refined_for(response, lambda bent: bent[sheets[1]].displacements[tip, 2].mean(), 1e-4)
    assert abs(found.value - 0.04) < 1.25e-4  # p L^3 / (3 E I)
    assert found.scene.bodies[0].mesh.n_faces == mesh.n_faces  # the idle sheet stays coarse
    assert found.scene.bodies[1].mesh.n_faces > mesh.n_faces


def test_a_result_that_is_good_enough_is_returned_as_given():
    rest, tip = strip()
    found = ms.refined_for(rest, tip, 0.01)
    assert found.result is rest
    assert len(found.n_dofs) == 1


@pytest.mark.parametrize("limits", [{"max_unknowns": 500}, {"max_rounds": 1}])
def test_limits_raise_an_error_that_holds_the_last_result(limits):
    rest, tip = strip()
    with pytest.raises(ms.NotConverged, match=next(iter(limits))) as caught:
        ms.refined_for(rest, tip, 1e-5, **limits)
    last = caught.value.last_good
    assert isinstance(last, ms.RefinedResult)
    assert abs(last.estimate.error) > 1e-5


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf, "small", None, [1e-3, 1e-3]])
def test_tolerances_that_are_no_positive_numbers_are_refused(tolerance):
    rest, tip = strip()
    with pytest.raises((ValueError, TypeError), match="tolerance"):
        ms.refined_for(rest, tip, tolerance)


def test_tolerances_that_round_off_forbids_are_refused():
    rest, tip = strip()
    with pytest.raises(ValueError, match="round-off"):
        ms.refined_for(rest, tip, 1e-12)


def test_results_of_motions_and_objects_that_stay_are_refused():
    rest, tip = strip()
    with pytest.raises(ValueError, match="Equilibrium or a LinearResponse"):
        ms.refined_for(rest.scene, tip, 1e-3)
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[ms.SurfaceTension(0.01)])
    with pytest.raises(ValueError, match="SurfaceTension"):
        ms.refined_for(ms.equilibrium(scene), lambda rest: rest.positions[0, 2], 1e-3)
