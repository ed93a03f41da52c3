"""Tests of ms.richardson_extrapolation: the exact solution estimated from nested meshes, and the error estimate."""

import numpy as np
import pytest

import magshell as ms
from benchmarks.cases import linear_cylinders, magnetic_strip, plates


def roof(mesh, bending: str = "midedge") -> float:
    """Return the deflection of the free edge of case B1, the Scordelis-Lo roof."""
    half = linear_cylinders.ROOF_HALF_ANGLE
    x, z = linear_cylinders.ROOF_RADIUS * np.array([np.sin(half), np.cos(half)])
    edge = mesh.nearest_vertex((x, linear_cylinders.ROOF_LENGTH / 2, z))
    return -linear_cylinders.roof_response(mesh, bending).displacements[edge, 2]


def roof_mesh(n: int) -> ms.TriangleMesh:
    span = (0.0, linear_cylinders.ROOF_HALF_ANGLE)
    return ms.meshes.cylinder(
        linear_cylinders.ROOF_RADIUS, linear_cylinders.ROOF_LENGTH / 2, span, cells=(n, n)
    )


ROOF_EXACT = 0.30060154  # isogeometric, PENGoLINS: the case B1 of the reference numbers


def strip(mesh, beta: float = 5.0) -> ms.Equilibrium:
    """Solve case C1-90: a magnetised strip in a field across it."""
    load_parameters = magnetic_strip.load_parameters(beta, (0.0, 0.0, 1.0))
    return ms.equilibrium(magnetic_strip.scene(mesh, "midedge"), **load_parameters)


def strip_mesh(n: int) -> ms.TriangleMesh:
    return ms.meshes.rectangle(magnetic_strip.LENGTH, magnetic_strip.WIDTH, cells=(n, max(1, n // 10)))


def strip_end(mesh) -> np.ndarray:
    rest = strip(mesh)
    return (
        rest.positions[mesh.vertices_at(x=magnetic_strip.LENGTH)].mean(axis=0)[[0, 2]] / magnetic_strip.LENGTH
    )


def test_a_roof_gains_a_digit():
    found = ms.richardson_extrapolation(roof, [roof_mesh(16), roof_mesh(32)])
    plain, gained = (abs(value / ROOF_EXACT - 1.0) for value in (found.values[-1], found.value))
    assert 8e-3 < plain < 1e-2
    assert gained < 1.5e-3
    assert found.error == pytest.approx(abs(found.values[-1] - ROOF_EXACT), rel=0.1)
    assert found.order == 2.0


def test_a_magnetic_strip_gains_a_digit():
    found = ms.richardson_extrapolation(strip_end, [strip_mesh(20), strip_mesh(40)])
    exact = np.array(magnetic_strip.ACROSS[5.0])
    plain, gained = (np.abs(value - exact).max() for value in (found.values[-1], found.value))
    assert 2e-4 < plain < 6e-4
    assert gained < 4e-5
    np.testing.assert_allclose(found.error, np.abs(found.values[-1] - exact), rtol=0.2)


def second_order_roof(n: int) -> ms.QuadraticTriangleMesh:
    span = (0.0, linear_cylinders.ROOF_HALF_ANGLE)
    size = linear_cylinders.ROOF_RADIUS, linear_cylinders.ROOF_LENGTH / 2
    return ms.meshes.cylinder(*size, span, cells=(n, n), order=2)


def test_six_node_elements_gain_a_digit():
    """Check that two meshes assume the order 4 that three find."""
    meshes = [second_order_roof(n) for n in (3, 6, 12)]
    by_two = ms.richardson_extrapolation(lambda mesh: roof(mesh, "midedge2"), meshes[1:])
    by_three = ms.richardson_extrapolation(lambda mesh: roof(mesh, "midedge2"), meshes)
    limit = 0.3006 * (1 - 2.5e-5)  # of finer meshes, NGSolve's of order 4 too
    assert by_two.order == 4.0 and 3.5 < by_three.order < 4.3
    for found in (by_two, by_three):
        plain, gained = (abs(value / limit - 1.0) for value in (found.values[-1], found.value))
        assert 1e-4 < plain < 4e-4 and gained < 0.25 * plain


def test_under_a_point_force_the_order_is_lower():
    """Use case B5, clamped, a force in the middle."""
    meshes = [ms.meshes.rectangle(0.5, 0.5, (n, n), diagonals="crossed", order=2) for n in (2, 4, 8)]
    found = ms.richardson_extrapolation(
        lambda mesh: plates.middle_deflection(mesh, "clamped", "force"), meshes
    )
    assert 1.5 < found.order < 3.0
    assert abs(found.value - plates.SQUARE["clamped", "force"]) < 0.5 * found.error


def test_rows_by_vertex_are_those_of_corners():
    """Include a cap, whose middle nodes are no corners of the generator's finer mesh."""
    coarse = ms.meshes.spherical_cap(1.0, 0.3, np.pi / 2, cells=(8, 4), order=2)
    for fine in (coarse.refined(), ms.meshes.spherical_cap(1.0, 0.3, np.pi / 2, cells=(16, 8), order=2)):
        found = ms.richardson_extrapolation(lambda mesh: mesh.rest_positions, [coarse, fine])
        assert found.value == pytest.approx(coarse.rest_positions[coarse.corner_vertices], abs=1e-14)
    with pytest.raises(
        ValueError, match=r"of one kind, got .* a QuadraticTriangleMesh and .* a TriangleMesh"
    ):
        ms.richardson_extrapolation(lambda mesh: 1.0, [coarse, coarse.surface])


def test_three_meshes_tell_the_order():
    found = ms.richardson_extrapolation(roof, [roof_mesh(8), roof_mesh(16), roof_mesh(32)])
    assert 1.5 < found.order < 2.1
    assert abs(found.value / ROOF_EXACT - 1.0) < 2e-3
    assert (
        ms.richardson_extrapolation(roof, [roof_mesh(8), roof_mesh(16), roof_mesh(32)], order=2).order == 2.0
    )


def model(power: float, exact: float = 3.0):
    """Return a function of a mesh of n by n cells with the value exact + n^-power."""
    return lambda mesh: exact + (mesh.n_faces / 2.0) ** (-power / 2.0)


def square(n: int) -> ms.TriangleMesh:
    return ms.meshes.rectangle(1.0, 1.0, cells=(n, n))


@pytest.mark.parametrize("power", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("ratio", [2, 3])
def test_errors_that_are_powers_are_gone(power, ratio):
    meshes = [square(n) for n in (2, 2 * ratio, 2 * ratio**2)]
    for found in (
        ms.richardson_extrapolation(model(power), meshes),
        ms.richardson_extrapolation(model(power), meshes[:2], order=power),
    ):
        assert found.value == pytest.approx(3.0, abs=1e-12)
        assert found.order == pytest.approx(power, abs=1e-9)
        assert found.error == pytest.approx(found.values[-1] - 3.0, rel=1e-9)


def test_dicts_and_rows_by_vertex():
    def solve(mesh):
        x = mesh.rest_positions[:, 0]
        return {"sum": model(2.0)(mesh), "rows": np.stack([x, x + model(1.0)(mesh)], axis=1)}

    found = ms.richardson_extrapolation(solve, [square(n) for n in (2, 4, 8)])
    assert found.value["sum"] == pytest.approx(3.0, abs=1e-12)
    assert found.value["rows"].shape == (9, 2)
    np.testing.assert_allclose(found.value["rows"][:, 0], square(2).rest_positions[:, 0], atol=1e-15)
    np.testing.assert_allclose(found.value["rows"][:, 1] - found.value["rows"][:, 0], 3.0, atol=1e-12)
    assert found.order == {"sum": pytest.approx(2.0), "rows": pytest.approx(1.0)}
    assert "order 2" in repr(found) and "(9, 2)" in repr(found)


def test_solids_and_their_refinements():
    mesh = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
    meshes = [mesh, mesh.refined(), mesh.refined().refined()]
    found = ms.richardson_extrapolation(lambda each: 1.0 + 1.0 / each.n_tetrahedra, meshes)
    assert found.value == pytest.approx(1.0, abs=1e-12)
    assert found.order == pytest.approx(3.0)


def test_gradients_go_through():
    torch = pytest.importorskip("torch")
    strength = torch.tensor(3e4, dtype=torch.float64, requires_grad=True)

    def tip(mesh):
        sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
        scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
        magnetization = strength * torch.tensor((1.0, 0.0, 0.0), dtype=torch.float64)
        rest = ms.equilibrium(scene, remanent_magnetization=magnetization, applied_flux_density=(0, 0, 2e-3))
        return rest.positions[mesh.nearest_vertex((0.1, 0.0, 0.0)), 2]

    coarse = ms.meshes.rectangle(0.1, 0.02, cells=(5, 1))
    meshes = [coarse, coarse.refined()]
    found = ms.richardson_extrapolation(tip, meshes)
    (slope,) = torch.autograd.grad(found.value, strength)
    with torch.no_grad():
        strength += 10.0
        above = float(ms.richardson_extrapolation(tip, meshes).value)
        strength -= 20.0
        below = float(ms.richardson_extrapolation(tip, meshes).value)
    assert float(slope) == pytest.approx((above - below) / 20.0, rel=1e-5)


def slit(n: int) -> ms.TriangleMesh:
    """Build a ring cut open, with two coincident rows of vertices."""
    ring = ms.meshes.rectangle(2.0 * np.pi, 1.0, cells=(4 * n, n))
    angle, radius = ring.rest_positions[:, 0], 1.0 + ring.rest_positions[:, 1]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    return ms.TriangleMesh(points, ring.faces)


def test_both_sides_of_a_slit_are_told_apart():
    def rows(mesh):  # -1 on the side where the ring begins, 1 where it ends, 0 between
        first, last = (np.isin(np.arange(mesh.n_vertices), mesh.faces[k]) for k in (0, mesh.n_faces - 1))
        del first, last
        angle = np.arctan2(*mesh.face_barycenters.T[[1, 0]]) % (2.0 * np.pi)
        sums = np.bincount(mesh.faces.ravel(), np.repeat(angle, 3), mesh.n_vertices)
        mean = sums / np.bincount(mesh.faces.ravel(), minlength=mesh.n_vertices)
        on_slit = np.abs(mesh.rest_positions[:, 1]) < 1e-9
        right = on_slit & (mesh.rest_positions[:, 0] > 0.0)
        return np.where(right, np.sign(mean - np.pi), 0.0)

    coarse, fine = slit(2), slit(4)
    found = ms.richardson_extrapolation(rows, [coarse, fine])
    assert np.count_nonzero(found.value) == 6
    np.testing.assert_array_equal(found.value, rows(coarse))


def test_missing_convergence_raises_an_error():
    values = iter([1.0, 2.0, 2.9])
    with pytest.raises(
        ms.NotConverged, match=r"changes by 1 and then by 0\.9, which tells no limit"
    ) as caught:
        ms.richardson_extrapolation(lambda mesh: next(values), [square(n) for n in (2, 4, 8)])
    assert caught.value.last_good.value == 2.9
    assert caught.value.last_good.error == 1.0
    values = iter([1.0, 2.0, 1.9])
    with pytest.raises(ms.NotConverged, match="turns back"):
        ms.richardson_extrapolation(lambda mesh: next(values), [square(n) for n in (2, 4, 8)])


def test_constant_values_are_converged():
    found = ms.richardson_extrapolation(lambda mesh: 2.0, [square(n) for n in (2, 4, 8)])
    assert found.value == 2.0 and found.error == 0.0 and np.isnan(found.order)


def aligned(n: int) -> ms.TriangleMesh:
    return ms.meshes.rectangle(1.0, 1.0, cells=(n, n), diagonals="aligned")


def irregular(n: int) -> ms.TriangleMesh:
    return ms.meshes.rectangle(1.0, 1.0, cells=(n, n), irregular=0.25, seed=0)


@pytest.mark.parametrize(
    ("meshes", "message"),
    [
        ([square(2)], "two or three, the coarsest first, got 1"),
        (square(2), "two or three"),
        (
            [square(2), 3.0],
            r"meshes\[1\] must be a TriangleMesh, a QuadraticTriangleMesh or a TetMesh, got float",
        ),
        ([square(4), square(2)], "32 and 8 faces"),
        ([square(2), square(3)], "8 and 18 faces, where the finer one must have 4, 9"),
        ([square(2), square(4), square(12)], "refined alike, got edges divided by 2, then by 3"),
        ([irregular(4), irregular(8)], r"vertices of meshes\[0\] are none of meshes\[1\], the first"),
        ([square(2), ms.meshes.box((1, 1, 1), cells=(1, 1, 1))], "of one kind"),
        ([square(2), aligned(4)], r"2 edges of meshes\[1\]"),
    ],
)
def test_meshes_that_are_not_nested_are_refused_before_any_solve(meshes, message):
    with pytest.raises(ValueError, match=message):
        ms.richardson_extrapolation(lambda mesh: pytest.fail("solved"), meshes)


def test_values_that_do_not_compare_are_refused():
    meshes = [square(2), square(4)]
    with pytest.raises(ValueError, match=r"or a row for each vertex, got \(8,\), \(32,\)"):
        ms.richardson_extrapolation(lambda mesh: mesh.face_areas, meshes)
    with pytest.raises(ValueError, match="not finite"):
        ms.richardson_extrapolation(lambda mesh: np.nan, meshes)
    with pytest.raises(ValueError, match="real numbers"):
        ms.richardson_extrapolation(lambda mesh: "x", meshes)
    with pytest.raises(ValueError, match=r"\['b'\] for meshes\[1\], but \['a'\]"):
        ms.richardson_extrapolation(lambda mesh: {"a" if mesh is meshes[0] else "b": 1.0}, meshes)
    with pytest.raises(ValueError, match="function of a mesh"):
        ms.richardson_extrapolation(3.0, meshes)
    with pytest.raises(ValueError, match="order must be positive"):
        ms.richardson_extrapolation(lambda mesh: 1.0, meshes, order=-1)


def test_an_irregular_mesh_refined_is_nested():
    mesh = irregular(3)
    found = ms.richardson_extrapolation(model(2.0), [mesh, mesh.refined()])
    assert found.value == pytest.approx(3.0)


def test_refined_faces_lie_where_they_did():
    mesh = irregular(3)
    fine = mesh.refined()
    assert fine.n_vertices == mesh.n_vertices + mesh.n_edges
    np.testing.assert_allclose(fine.face_areas.reshape(-1, 4).sum(axis=1), mesh.face_areas, rtol=1e-12)
    np.testing.assert_allclose(fine.face_normals, np.repeat(mesh.face_normals, 4, axis=0), atol=1e-12)
    np.testing.assert_array_equal(fine.rest_positions[: mesh.n_vertices], mesh.rest_positions)
    np.testing.assert_allclose(fine.rest_positions[mesh.n_vertices :], mesh.edge_midpoints)


def test_refined_onto_a_surface():
    tube = ms.meshes.cylinder(1.0, 1.0, cells=(12, 3))
    fine = tube.refined(surface=lambda x: np.hypot(x[:, 0], x[:, 2]) - 1.0)
    np.testing.assert_allclose(np.hypot(fine.rest_positions[:, 0], fine.rest_positions[:, 2]), 1.0, atol=1e-6)
    assert ms.richardson_extrapolation(
        lambda mesh: mesh.face_areas.sum(), [tube, fine]
    ).value == pytest.approx(2.0 * np.pi, rel=1e-3)
    with pytest.raises(ValueError, match="surface must be a signed distance"):
        tube.refined(surface=1.0)


def swing(time_step):
    """Return the tip of a strip that falls from rest, at 0.08 s."""
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 1))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    move = ms.simulate(scene, steps=round(0.08 / time_step), time_step=time_step, progress=False)
    return move.positions[-1, -1, 2]


def test_steps_of_a_motion_have_the_order_of_the_integrator_and_an_error_bar():
    found = ms.richardson_extrapolation(swing, time_step=4e-3)
    assert found.values == tuple(swing(each) for each in (4e-3, 2e-3, 1e-3))
    assert found.order == pytest.approx(2.0, abs=0.1)  # TR-BDF2
    exact = swing(1e-3 / 16)
    assert abs(found.value - exact) < abs(found.values[-1] - exact) < found.error
    assert found.error >= abs(found.values[-1] - found.values[-2])
    assert "3 time steps" in repr(found) and "the shortest step is off by" in repr(found)


def test_steps_out_of_the_range_of_convergence_are_told():
    outputs = {4e-3: 1.0, 2e-3: 1.1, 1e-3: 0.9}  # as of a sheet whose landing depends on the step
    with pytest.raises(
        ms.NotConverged, match=r"not in the range of convergence: from a time step of 0\.004 s"
    ) as told:
        ms.richardson_extrapolation(outputs.__getitem__, time_step=4e-3)
    assert told.value.last_good.value == 0.9 and told.value.last_good.error == pytest.approx(0.2)


def test_steps_take_dictionaries_arrays_and_tensors():
    torch = pytest.importorskip("torch")

    def outputs(step):
        return {"way": 1.0 + step, "shape": np.array([step, 2.0]), "time": torch.tensor(3.0 - step**2)}

    found = ms.richardson_extrapolation(outputs, time_step=0.4)
    assert found.order["way"] == pytest.approx(1.0) and found.value["way"] == pytest.approx(1.0)
    assert found.order["shape"] == pytest.approx(1.0)
    assert float(found.value["time"]) == pytest.approx(3.0, abs=1e-5)


@pytest.mark.parametrize("given", [{}, {"meshes": [1, 2], "time_step": 1e-3}, {"time_step": -1.0}])
def test_either_meshes_or_a_time_step_are_given(given):
    with pytest.raises(ValueError, match=r"meshes or a time_step|time_step .* must be positive"):
        ms.richardson_extrapolation(swing, **given)
