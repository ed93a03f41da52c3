"""ms.error_estimate against closed forms: size, sign and faces of the error, and what it refuses."""

import sys
from pathlib import Path

import numpy as np
import pytest

import magshell as ms
from magshell.solve.accuracy.enriched import _MOST_FROM_COARSE

sys.path.insert(0, str(Path(__file__).parents[3]))
from benchmarks.cases import magnetic_strip, shear_strip
from benchmarks.cases.linear_cylinders import roof_response

torch = pytest.importorskip("torch")

# Effectivity: the estimate over the true error. Its goal is 0.8 to 1.25 below errors of 5 %.
LEAST, MOST = 0.8, 1.25


def effectivity(found: ms.ErrorEstimate, exact: float) -> float:
    return found.error / (exact - found.value)


def height_at(vertices):
    return lambda rest: rest.positions[vertices, 2].mean()


def cantilever(cells=(10, 2), bending="midedge", **load):
    mesh = shear_strip.strip(cells, bending)
    return ms.equilibrium(shear_strip.scene(mesh, bending), **load), mesh.vertices_at(x=shear_strip.LENGTH)


def magnetized(cells, bending, beta=1.0):
    mesh = ms.meshes.rectangle(
        magnetic_strip.LENGTH, magnetic_strip.WIDTH, cells, irregular=0.25, order=1 + (bending == "midedge2")
    )
    scene = magnetic_strip.scene(mesh, bending)
    return (
        ms.equilibrium(scene, **magnetic_strip.load_parameters(beta, (0, 0, 1.0))),
        mesh.vertices_at(x=magnetic_strip.LENGTH),
    )


def clamped_square(cells, order=1, thickness=0.01):
    mesh = ms.meshes.rectangle(0.5, 0.5, cells, diagonals="crossed", order=order)
    stiffness_of_one = 12.0 * (1.0 - 0.3**2) / thickness**3
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=stiffness_of_one, poisson_ratio=0.3)
    rim = mesh.edges_where(lambda x: x[:, :2].max(axis=1) > 0.5 - 1e-9)
    held = [ms.Clamp(rim), ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]
    scene = ms.Scene(sheet, supports=held, loads=[ms.AreaLoad((0, 0, 1.0))])
    return ms.linear_response(scene), [mesh.nearest_vertex((0, 0, 0))]


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_estimate_of_a_bent_strip_matches_the_extensible_elastica(bending):
    mesh = shear_strip.strip((10, 2), bending, irregular=None)
    rest = ms.equilibrium(shear_strip.scene(mesh, bending))
    tip = mesh.vertices_at(x=shear_strip.LENGTH)
    found = ms.error_estimate(rest, height_at(tip))
    assert LEAST < effectivity(found, shear_strip.stretched_end()[0]) < MOST
    assert found.error < 0.0  # the coarse strip bends too far


@pytest.mark.parametrize("bending", ["midedge", "midedge2"])
def test_estimate_of_a_magnetized_strip_matches_the_elastica(bending):
    rest, tip = magnetized((10, 2), bending)
    found = ms.error_estimate(rest, lambda rest: rest.positions[tip, 2].mean() / magnetic_strip.LENGTH)
    assert LEAST < effectivity(found, magnetic_strip.stretched_end(1.0)[1]) < MOST
    if bending == "midedge2":
        assert found.corrected == pytest.approx(0.301721, abs=3e-6)


@pytest.mark.parametrize("cells", [(4, 4), (8, 8)])
def test_estimate_of_a_clamped_plate_matches_its_linear_solution(cells):
    response, middle = clamped_square(cells)
    found = ms.error_estimate(response, height_at(middle))
    assert LEAST < effectivity(found, 0.00126532) < MOST
    assert found.corrected == pytest.approx(0.00126532, rel=2e-3)


def test_estimates_of_six_node_meshes_are_within_a_quarter():
    response, middle = clamped_square((2, 2), order=2)
    found = ms.error_estimate(response, height_at(middle))
    assert LEAST < effectivity(found, 0.00126532) < MOST


@pytest.mark.parametrize("project", ["given", "fitted"])
def test_estimate_of_a_curved_roof_includes_the_error_of_its_facets(project):
    mesh = ms.meshes.cylinder(25.0, 25.0, (0.0, np.radians(40.0)), cells=(8, 8))
    edge = mesh.nearest_vertex(25.0 * np.array([np.sin(np.radians(40.0)), 1.0, np.cos(np.radians(40.0))]))

    def onto(points):
        radii = np.linalg.norm(points[:, [0, 2]], axis=1)
        return np.stack([25 * points[:, 0] / radii, points[:, 1], 25 * points[:, 2] / radii], axis=1)

    found = ms.error_estimate(
        roof_response(mesh, "midedge"),
        lambda bent: -bent.displacements[edge, 2],
        project=onto if project == "given" else None,
    )
    assert LEAST < effectivity(found, 0.300592) < MOST  # midedge2 on 64 x 64 elements


def test_contributions_of_faces_sum_to_the_estimate_and_lie_where_the_strip_bends():
    rest, tip = cantilever((20, 2))
    found = ms.error_estimate(rest, height_at(tip))
    assert found.by_face.shape == (rest.scene.mesh.n_faces,)
    assert found.by_face.sum() == pytest.approx(found.error, rel=1e-9)
    # The moment falls from the clamp to the tip, and with it what its faces contribute.
    near = rest.scene.mesh.face_barycenters[:, 0] < 0.5 * shear_strip.LENGTH
    assert np.abs(found.by_face[near]).sum() > 3.0 * np.abs(found.by_face[~near]).sum()
    # Errors of irregular faces cancel partly; they must not exceed their sum by orders of magnitude.
    assert np.abs(found.by_face).sum() < 10.0 * abs(found.error)


def test_contributions_of_two_bodies_follow_the_order_of_bodies():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2))
    loaded = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    idle = ms.Shell(
        mesh.transformed(translation=(0, 0.05, 0)), thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0
    )
    held = [ms.Clamp(mesh.edges_at(x=0.0), body=body) for body in (idle, loaded)]
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.05), body=loaded)
    rest = ms.equilibrium(ms.Scene([idle, loaded], supports=held, loads=[load]))
    tip = mesh.vertices_at(x=0.1)
    found = ms.error_estimate(rest, lambda rest: rest[loaded].positions[tip, 2].mean())
    first, second = found.by_face[: mesh.n_faces], found.by_face[mesh.n_faces :]
    assert np.abs(first).max() < 1e-6 * np.abs(second).max()


def test_estimate_without_faces_has_the_same_error():
    rest, tip = cantilever()
    whole = ms.error_estimate(rest, height_at(tip))
    short = ms.error_estimate(rest, height_at(tip), by_face=False)
    assert short.by_face is None
    assert short.error == pytest.approx(whole.error, rel=1e-9)
    assert short.factorizations < whole.factorizations
    assert "unknowns" in repr(short)


def test_estimates_take_few_factorizations():
    rest, tip = cantilever((40, 4))
    found = ms.error_estimate(rest, height_at(tip), by_face=False)
    assert found.factorizations <= rest.factorizations < _MOST_FROM_COARSE


def test_values_of_the_solve_go_over_to_the_finer_mesh():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    tip = height_at(mesh.vertices_at(x=0.1))
    stiffer = {sheet: {"young_modulus": 2e6}, load: {"force_per_length": (0, 0, 0.04)}}
    found = ms.error_estimate(ms.linear_response(scene, values=stiffer), tip)
    assert found.corrected == pytest.approx(0.08, rel=1e-3)  # p L^3 / (3 E I)
    halved = ms.error_estimate(ms.linear_response(scene, load_factor=0.5), tip)
    assert halved.corrected == pytest.approx(0.02, rel=1e-3)


def test_moved_clamps_go_over_to_the_finer_mesh():
    # The ends move apart by 0.2 mm: a compressed strip would buckle to either side, on each mesh to its own.
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    ends = [ms.Clamp(mesh.edges_at(x=0.0)), ms.Clamp(mesh.edges_at(x=0.1), displacement=(-0.0003, 0, 0.01))]
    rest = ms.equilibrium(ms.Scene(sheet, supports=ends))
    middle = mesh.vertices_at(x=0.025)
    found = ms.error_estimate(rest, height_at(middle))
    finest = ms.meshes.rectangle(0.1, 0.02, cells=(16, 4), order=2)
    sheet = ms.Shell(finest, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    ends = [
        ms.Clamp(finest.edges_at(x=0.0)),
        ms.Clamp(finest.edges_at(x=0.1), displacement=(-0.0003, 0, 0.01)),
    ]
    exact = ms.equilibrium(ms.Scene(sheet, supports=ends)).positions
    at = [finest.nearest_vertex(x) for x in mesh.rest_positions[middle]]
    assert LEAST < effectivity(found, exact[at, 2].mean()) < MOST


@pytest.mark.parametrize(
    ("output", "words"),
    [
        (lambda rest: 1.0, "scalar tensor"),
        (lambda rest: rest.positions[0], "scalar tensor"),
        (lambda rest: rest.positions.detach().sum(), "no derivative"),
        (lambda rest: torch.as_tensor(rest.positions.detach().numpy()[0, 2]), "no derivative"),
        (lambda rest: rest.positions.sum() / 0.0, "finite"),
        (lambda rest: (rest.positions[:, 2] ** 2 + rest.positions[:, 2].detach() * 3).sum(), "not smooth"),
        (lambda rest: rest.energy, "energy"),
        ("tip", "function of a result"),
    ],
)
def test_outputs_that_are_not_smooth_scalars_are_refused(output, words):
    rest, _ = cantilever()
    with pytest.raises((ValueError, AttributeError), match=words):
        ms.error_estimate(rest, output)


def test_results_without_an_estimate_are_refused_by_name():
    rest, tip = cantilever()
    scene = rest.scene
    path = ms.follow_path(scene, progress=False)
    for other in (path, scene, None):
        with pytest.raises(ValueError, match="Equilibrium or a LinearResponse"):
            ms.error_estimate(other, height_at(tip))
    about = ms.linear_response(scene, rest, load_factor=1.1)
    with pytest.raises(ValueError, match="about an equilibrium"):
        ms.error_estimate(about, height_at(tip))


def test_objects_that_do_not_go_over_are_refused_by_name():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(6, 2))
    clamp = ms.Clamp(mesh.edges_at(x=0.0))

    def refused(words, loads=(), contacts=(), **sheet):
        body = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3, **sheet)
        scene = ms.Scene(
            body, supports=[clamp], loads=list(loads), contacts=list(contacts), gravity=(0, 0, -1)
        )
        rest = ms.equilibrium(scene)
        with pytest.raises(ValueError, match=words):
            ms.error_estimate(rest, height_at([0]))

    refused("SurfaceTension", loads=[ms.SurfaceTension(0.01)])
    refused("contacts", contacts=[ms.Contact(ms.obstacles.Plane(center=(0, 0, -1)))])
    refused("curvature_scale", curvature_scale=2.0)


def test_faces_of_open_pressures_are_refused():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[ms.Pressure(0.2)])
    rest = ms.equilibrium(scene)
    tip = height_at(mesh.vertices_at(x=0.1))
    with pytest.raises(ValueError, match="by_face=False"):
        ms.error_estimate(rest, tip)
    assert ms.error_estimate(rest, tip, by_face=False).relative_error < 0.1


def test_equilibria_far_from_the_coarse_one_are_refused(monkeypatch):
    rest, tip = cantilever()
    monkeypatch.setattr("magshell.solve.accuracy.enriched._NEAR", 1e-6)
    with pytest.raises(ms.NotConverged, match="away from the given one"):
        ms.error_estimate(rest, height_at(tip))


def test_a_scene_without_displacements_has_no_error(monkeypatch):
    """Check that round-off is not taken for another equilibrium, however small the displacements are."""
    monkeypatch.setattr("magshell.solve.accuracy.enriched._NEAR", 0.0)
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    mesh = ms.meshes.cylinder(0.02, 0.05, cells=(12, 4)).transformed(turn)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.boundary_vertices)])
    inside = np.setdiff1d(np.arange(mesh.n_vertices), mesh.boundary_vertices)[0]
    found = ms.error_estimate(ms.equilibrium(scene), lambda rest: rest.displacements[inside, 2])
    assert abs(found.value) + abs(found.error) < 1e-13


def test_pins_hold_new_vertices_between_held_ones_only():
    mesh = ms.meshes.rectangle(2.0, 2.0, cells=(2, 2))
    sheet = ms.Shell(mesh, thickness=0.1, young_modulus=1e6, poisson_ratio=0.0)
    rim = ms.Pin(mesh.boundary_vertices)
    scene = ms.Scene(sheet, supports=[rim], loads=[ms.AreaLoad((0, 0, 1.0))])
    from magshell.mesh.finer import second_order
    from magshell.model.scene.finer_scene import finer_scene

    finer = second_order(mesh, None)
    made = finer_scene(scene, scene._values, {id(sheet): finer})
    held = made.supports[0].vertices
    assert np.array_equal(np.sort(held), finer.mesh.boundary_vertices)


def test_symmetry_planes_keep_the_new_vertices_of_their_edges():
    mesh = ms.meshes.spherical_cap(1.0, 0.3, np.pi / 2, np.pi / 2, cells=(12, 12))
    sheet = ms.Shell(mesh, thickness=0.05, young_modulus=1e6)
    planes = [
        ms.SymmetryPlane((1, 0, 0)),
        ms.SymmetryPlane((0, 1, 0)),
        ms.Pin(mesh.nearest_vertex((1, 0, 0)), "z"),
    ]
    corner = mesh.nearest_vertex((1, 0, 0))
    scene = ms.Scene(sheet, supports=planes, loads=[ms.PointLoad(corner, (10.0, 0, 0))])
    response = ms.linear_response(scene)
    fitted = ms.error_estimate(response, lambda bent: bent.displacements[corner, 0])
    exact = ms.error_estimate(
        response,
        lambda bent: bent.displacements[corner, 0],
        project=lambda x: x / np.linalg.norm(x, axis=1, keepdims=True),
    )
    assert fitted.error == pytest.approx(exact.error, rel=0.1)
    with pytest.raises(ValueError, match="does not lie in SymmetryPlane"):
        ms.error_estimate(response, lambda bent: bent.displacements[corner, 0], project=lambda x: x + 1e-3)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_results_with_tensors_have_the_estimate_of_those_with_arrays(dtype):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    tip = height_at(mesh.vertices_at(x=0.1))
    given = torch.tensor([3e4, 0.0, 0.0], dtype=dtype, requires_grad=True)
    found, expected = (
        ms.error_estimate(
            ms.equilibrium(scene, remanent_magnetization=each, applied_flux_density=(0, 0, 2e-3)), tip
        )
        for each in (given, (3e4, 0, 0))
    )
    assert found.error == pytest.approx(expected.error, rel=1e-4)
    assert np.allclose(found.by_face, expected.by_face, rtol=1e-2, atol=1e-3 * abs(expected.error))


def test_rest_positions_of_a_solve_go_over_to_the_finer_mesh():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    shorter = mesh.rest_positions * (0.5, 1.0, 1.0)
    response = ms.linear_response(scene, values={sheet: {"rest_positions": shorter}})
    found = ms.error_estimate(response, height_at(mesh.vertices_at(x=0.1)))
    assert found.corrected == pytest.approx(0.005, rel=1e-3)  # p L^3 / (3 E I)


def above_a_magnet(cells, order):
    """Return a strip that a magnet below its end pulls down, and its tip."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells, order=order)
    sheet = ms.Shell(mesh, thickness=5e-4, young_modulus=1e7, remanent_magnetization=(0, 0, 2e4))
    magnet = ms.CuboidMagnet(
        (0.01, 0.01, 0.01), remanent_magnetization=(0, 0, 2e4), center=(0.04, 0.005, -0.015)
    )
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=magnet)
    return ms.equilibrium(scene), [mesh.nearest_vertex((0.04, 0.005, 0.0))]


def test_estimate_of_a_strip_over_a_magnet_matches_a_finer_mesh():
    rest, tip = above_a_magnet((8, 2), 1)
    found = ms.error_estimate(rest, height_at(tip))
    finest, same = above_a_magnet((32, 8), 2)
    assert LEAST < effectivity(found, finest.positions[same, 2].mean()) < MOST


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"project": "fit"}, "project must be a function"),
        ({"project": lambda x: x[:1]}, "project"),
        ({"project": lambda x: x * np.nan}, "project"),
        ({"by_face": 1}, "by_face must be True or False"),
    ],
)
def test_options_of_the_wrong_kind_are_refused(options, words):
    rest, tip = cantilever()
    with pytest.raises(ValueError, match=words):
        ms.error_estimate(rest, height_at(tip), **options)


def test_estimates_of_loose_solves_are_corrected_by_the_adjoint(monkeypatch):
    given = [cantilever((20, 2)), magnetized((20, 2), "midedge", beta=20.0), cantilever((10, 2), "midedge2")]
    loose = [ms.error_estimate(rest, height_at(tip), by_face=False) for rest, tip in given]
    monkeypatch.setattr("magshell.solve.accuracy.enriched._LOOSE", 1e-11)
    exact = [ms.error_estimate(rest, height_at(tip), by_face=False) for rest, tip in given]
    for one, other in zip(loose, exact, strict=True):
        assert one.error == pytest.approx(other.error, rel=0.02)
    assert sum(each.factorizations for each in loose) < sum(each.factorizations for each in exact)
