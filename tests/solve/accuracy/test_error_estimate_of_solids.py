"""ms.error_estimate of solids: against a series of finer meshes, and what goes over to a finer mesh."""

from functools import cache

import numpy as np
import pytest

import magshell as ms
from magshell.mesh.finer_solid import finer_solid
from magshell.model.scene.finer_scene import finer_scene, held_vertices

torch = pytest.importorskip("torch")

# Effectivity: the estimate over the true error. Its goal is 0.8 to 1.25 below errors of 5 %.
LEAST, MOST = 0.8, 1.25
SIZE = (0.06, 0.04, 0.04)
GIVEN = {"applied_flux_density": (0, 0, 2e-3), "progress": False}


def block(cells, element, **own):
    mesh = ms.meshes.box(SIZE, cells=cells)
    return ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3),
        element=element,
        mass_density=1e3,
        **own,
    )


@cache
def bent(n, element):
    """Return a block under its weight, a load and a field, and the corners of its end."""
    body = block((3 * n, 2 * n, 2 * n), element, remanent_magnetization=(2e4, 0, 0))
    scene = ms.Scene(
        body,
        supports=[ms.Pin(body.mesh.vertices_at(x=0.0))],
        loads=[ms.AreaLoad((0, 0, 100.0), faces=body.mesh.faces_at(x=SIZE[0]))],
        field=ms.UniformField(),
        gravity=(0, 0, -0.5),
    )
    x, y, z = body.mesh.rest_positions.T
    corners = (np.abs(x - SIZE[0]) < 1e-9) & np.isin(y, (0.0, SIZE[1])) & np.isin(z, (0.0, SIZE[2]))
    return ms.equilibrium(scene, **GIVEN), np.flatnonzero(corners)


def height_at(vertices):
    return lambda rest: rest.displacements[vertices, 2].mean()


@cache
def limit():
    """Return the height in the limit of ever finer meshes, by extrapolation with the order 2.3 that three meshes show."""
    coarse, fine = (
        float(np.mean(rest.displacements[corners, 2]))
        for rest, corners in (bent(1, "quadratic"), bent(2, "quadratic"))
    )
    return fine + (fine - coarse) / (2.0**2.3 - 1.0)


@pytest.mark.parametrize("element, n", [("linear", 2), ("quadratic", 1)])
def test_estimate_of_a_bent_block_matches_finer_meshes(element, n):
    rest, corners = bent(n, element)
    found = ms.error_estimate(rest, height_at(corners))
    assert LEAST < found.error / (limit() - found.value) < MOST
    assert found.by_face.shape == (rest.scene.bodies[0].mesh.n_tetrahedra,)
    assert found.by_face.sum() == pytest.approx(found.error, rel=1e-9)
    middles = rest.scene.bodies[0].mesh.tetrahedron_barycenters
    sizes = np.abs(found.by_face)
    assert sizes[middles[:, 0] < 0.5 * SIZE[0]].sum() > 0.5 * sizes.sum()  # it bends most where it is held
    assert "tetrahedra" in repr(found)


def test_estimate_of_a_linear_response_of_a_block_is_that_of_a_small_load():
    body = block((3, 2, 2), "linear")
    scene = ms.Scene(
        body,
        supports=[ms.Pin(body.mesh.vertices_at(x=0.0))],
        loads=[ms.AreaLoad((0, 0, 1e-3), faces=body.mesh.faces_at(z=SIZE[2]))],
    )
    corner = body.mesh.nearest_vertex(SIZE)
    linear = ms.error_estimate(ms.linear_response(scene), height_at([corner]))
    small = ms.error_estimate(ms.equilibrium(scene), height_at([corner]))
    assert linear.error == pytest.approx(small.error, rel=1e-4)


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_descent_of_finer_tetrahedra_is_that_of_their_positions(element):
    coarse = block((2, 1, 1), element).mesh
    finer = finer_solid(coarse)
    mesh, new = finer.mesh, finer.mesh.rest_positions[coarse.n_vertices :]
    assert np.abs(finer.interpolation @ coarse.rest_positions - mesh.rest_positions).max() < 1e-12
    on_edge = finer.new_edges >= 0
    ends = coarse.rest_positions[coarse.edges[finer.new_edges[on_edge]]]
    along, place = ends[:, 1] - ends[:, 0], new[on_edge] - ends[:, 0]
    assert np.abs(np.cross(along, place)).max() < 1e-12
    places = (finer.new_edges, finer.new_sides, finer.new_elements)
    assert (sum((each >= 0).astype(int) for each in places) == 1).all()
    normals = coarse.surface.face_normals[:: len(coarse.faces) // len(coarse.faces_of_corners)]
    of_sides = mesh.surface.face_normals[::4]
    assert np.abs(of_sides - normals[finer.side_parents]).max() < 1e-12


@pytest.mark.parametrize("element", ["linear", "quadratic"])
def test_pins_hold_new_vertices_of_held_sides_only(element):
    body = block((2, 2, 2), element)
    finer = finer_solid(body.mesh)
    low = body.mesh.vertices_at(x=0.0)
    held = held_vertices(finer, np.union1d(low, body.mesh.vertices_at(y=0.0)))
    x, y, _ = finer.mesh.rest_positions.T
    assert np.array_equal(held, np.flatnonzero((np.abs(x) < 1e-12) | (np.abs(y) < 1e-12)))


def test_materials_loads_and_magnetization_of_a_solid_go_over():
    rng = np.random.default_rng(1)
    body = block((2, 1, 1), "quadratic")
    n = body.mesh.n_tetrahedra
    body = ms.Solid(
        body.mesh,
        material=ms.NeoHookean(young_modulus=rng.uniform(1e6, 2e6, n), poisson_ratio=0.45),
        mass_density=rng.uniform(1e3, 2e3, n),
        remanent_magnetization=rng.uniform(-1e4, 1e4, (n, 3)),
    )
    faces = body.mesh.faces_at(z=SIZE[2])
    loads = [ms.Pressure(3.0, faces=faces), ms.AreaLoad((1.0, 2.0, 3.0)), ms.PointLoad([0], (0, 0, 1.0))]
    scene = ms.Scene(
        body, supports=[ms.Pin(body.mesh.vertices_at(x=0.0))], loads=loads, field=ms.UniformField()
    )
    finer = finer_solid(body.mesh)
    made = finer_scene(scene, scene._values, {id(body): finer})
    fine = made.bodies[0]
    assert np.array_equal(fine.young_modulus, np.repeat(body.young_modulus, 8))
    assert np.array_equal(fine.mass_density, np.repeat(body.mass_density, 8))
    assert np.array_equal(fine.remanent_magnetization, np.repeat(body.remanent_magnetization, 8, axis=0))
    assert fine.mean_volume == body.mean_volume
    assert np.array_equal(np.sort(made.loads[0].faces), fine.mesh.faces_at(z=SIZE[2]))
    forces = [
        each.vertex_forces(one.mesh).sum(axis=0) for each, one in ((loads[1], body), (made.loads[1], fine))
    ]
    assert forces[0] == pytest.approx(forces[1])


def test_objects_of_solids_that_do_not_go_over_are_refused_by_name():
    mesh = ms.meshes.box(SIZE, cells=(2, 1, 1))
    law = ms.NeoHookean(young_modulus=1e6, poisson_ratio=0.3)
    skinned = ms.Solid(mesh, material=law, skin=ms.Skin(thickness=1e-3, mass_density=1e3), mass_density=1e3)
    pin = ms.Pin(skinned.mesh.vertices_at(x=0.0))
    scene = ms.Scene(skinned, supports=[pin], gravity=(0, 0, -1.0))
    with pytest.raises(ValueError, match="a Skin cannot go over"):
        ms.error_estimate(ms.equilibrium(scene), height_at([0]))
    body = ms.Solid(mesh, material=law, mass_density=1e3)
    one = body.mesh.faces_at(z=SIZE[2])[:1]
    scene = ms.Scene(body, supports=[pin], loads=[ms.Pressure(1.0, faces=one)])
    with pytest.raises(ValueError, match="load whole sides"):
        ms.error_estimate(ms.equilibrium(scene), height_at([0]))
