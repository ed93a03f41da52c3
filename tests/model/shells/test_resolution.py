"""The estimate of what a mesh does not resolve, beside errors that are known, and its warning."""

import warnings

import numpy as np
import pytest

import magshell as ms
from magshell.model.results.resolution import _corners, unresolved

YOUNG, THICKNESS = 1e6, 1e-3
STIFFNESS = YOUNG * THICKNESS**3 / 12.0  # of a plate, N m


def sheet(mesh, **options):
    return ms.Shell(mesh, **{"thickness": THICKNESS, "young_modulus": YOUNG, "poisson_ratio": 0.0, **options})


def solved(scene, **options):
    """Return an equilibrium and the texts of the warnings of its resolution."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ms.ResolutionWarning)
        rest = ms.equilibrium(scene, progress=False, **options)
    return rest, [str(each.message) for each in caught if each.category is ms.ResolutionWarning]


def fraction(rest) -> float:
    [found] = unresolved(rest._values, rest._state)
    assert found.by_face.sum() == pytest.approx(found.membrane + found.bending)
    return found.membrane + found.bending


def strip(length, width, cells, load):
    mesh = ms.meshes.rectangle(length, width, cells=cells)
    ends = mesh.edges_at(x=0.0), mesh.edges_at(x=length)
    return mesh, ms.Scene(sheet(mesh), supports=[ms.Clamp(ends[0])], loads=[ms.EdgeLoad(ends[1], load)])


def bent_across(cells):
    """Return a cantilever under a load across it, and its deflection over that of a beam."""
    mesh, scene = strip(0.1, 0.02, (cells, 2), (0, 0, 1e-4))
    rest, told = solved(scene)
    tip = rest.displacements[mesh.vertices_at(x=0.1), 2].mean()
    return rest, told, tip / (1e-4 * 0.1**3 / (3.0 * STIFFNESS))


def bent_in_its_plane(cells):
    """Return a cantilever under a load in its plane, and its deflection over that of a beam that shears."""
    mesh, scene = strip(0.1, 0.01, (10 * cells, cells), (0, 1e-3, 0))
    rest, told = solved(scene)
    tip = rest.displacements[mesh.vertices_at(x=0.1), 1].mean()
    inertia, area, force = THICKNESS * 1e-6 / 12.0, THICKNESS * 0.01, 1e-3 * 0.01
    exact = force * (0.1**3 / (3.0 * YOUNG * inertia) + 0.1 / (5.0 / 6.0 * 0.5 * YOUNG * area))
    return rest, told, tip / exact


def on_a_bed(edges):
    """Return a long plate on a bed, loaded at its end, with edges of that many (D/k)^(1/4), and its deflection over the
    exact one.
    """
    bed = 1e5
    length = (STIFFNESS / bed) ** 0.25
    mesh = ms.meshes.rectangle(12 * length, 2 * edges * length, cells=(round(12 / edges), 2))
    load = 1e-2 * STIFFNESS / length**2
    loads = [ms.EdgeLoad(mesh.edges_at(x=0.0), (0, 0, -load)), ms.ElasticFoundation(bed)]
    rest, told = solved(ms.Scene(sheet(mesh), loads=loads, allow_rigid_motions=True))
    deflection = -rest.displacements[mesh.vertices_at(x=0.0), 2].mean()
    return rest, told, deflection / (2.0 * load * (bed / (4.0 * STIFFNESS)) ** 0.25 / bed)


@pytest.mark.parametrize(
    "case, size",
    [
        (bent_across, 3),
        (bent_across, 5),
        (bent_across, 10),
        (bent_in_its_plane, 4),
        (bent_in_its_plane, 8),
        (on_a_bed, 1.0),
        (on_a_bed, 0.5),
        (on_a_bed, 0.25),
    ],
)
def test_estimate_is_near_the_error_of_displacements(case, size):
    rest, told, ratio = case(size)
    estimate = fraction(rest)
    assert 0.4 < abs(ratio - 1.0) / estimate < 1.5
    assert bool(told) == (estimate > 0.1)


def channel(cells):
    """Return an open channel that twists, with flanges of so many cells, and the work of its couple."""
    width, height, length = 0.02, 0.04, 0.3
    flange, web = np.linspace(width, 0, cells + 1), np.linspace(0, height, 2 * cells + 1)[1:-1]
    y = np.concatenate([flange, np.zeros(2 * cells - 1), flange[::-1]])
    z = np.concatenate([np.zeros(cells + 1), web, np.full(cells + 1, height)])
    flat = ms.meshes.rectangle(length, 1.0, cells=(15 * cells, len(y) - 1))
    at = np.rint(flat.rest_positions[:, 1] * (len(y) - 1)).astype(int)
    mesh = ms.TriangleMesh(np.stack([flat.rest_positions[:, 0], y[at], z[at]], axis=1), flat.faces)
    tip = mesh.vertices_at(x=length)
    arm = mesh.rest_positions[tip] - mesh.rest_positions[tip].mean(axis=0)
    forces = np.zeros((mesh.n_vertices, 3))
    forces[tip] = 1e-3 * np.cross((1, 0, 0), arm) / (arm**2).sum()
    body = sheet(mesh, young_modulus=1e9, poisson_ratio=0.3)
    scene = ms.Scene(body, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[ms.PointLoad(tip, (0, 0, 0))])
    rest, told = solved(scene, vertex_loads=forces)
    return rest, told, float((forces * rest.displacements).sum())


def test_an_open_channel_that_twists_is_warned_of():
    """Compare with a limit that this function finds with 4 and 8 cells, whose errors fall to a quarter."""
    rest, told, work = channel(2)
    error = 1.0 - work / channel_limit()
    assert 0.4 < error / fraction(rest) < 1.5
    [text] = told
    assert "membrane strains" in text and "order=2" in text


def channel_limit() -> float:
    coarse, fine = channel(3)[2], channel(6)[2]
    return fine + (fine - coarse) / 3.0


def test_lengths_of_beds_and_fields_are_named():
    _, [text], _ = on_a_bed(1.5)
    assert "its foundation bends it over (D/k)^(1/4) = 0.0054 m, and edges are up to" in text
    flux, magnetization = 0.02, 5e4
    length = np.sqrt(STIFFNESS / (flux * magnetization * THICKNESS))
    mesh = ms.meshes.rectangle(10 * length, 3 * length, cells=(7, 2))
    body = sheet(mesh, remanent_magnetization=(magnetization, 0, 0))
    scene = ms.Scene(body, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    _, [text] = solved(scene, applied_flux_density=(0, 0, flux))
    assert "the field bends it over (D/(M B h))^(1/2) = 0.0091 m" in text


def test_strains_that_jump_as_they_should_are_not_errors():
    """Check sheets of two thicknesses, with a crease, and a tube: strains are constant in each of their parts."""
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(8, 4))
    ends = mesh.vertices_at(x=0.0), mesh.vertices_at(x=0.04)
    pulled = [ms.Pin(ends[0]), ms.Pin(ends[1], displacement=(4e-4, 0, 0))]
    halves = np.where(mesh.face_barycenters[:, 0] < 0.02, 1e-3, 2e-3)
    rest, told = solved(ms.Scene(sheet(mesh, thickness=halves), supports=pulled))
    assert fraction(rest) < 1e-6 and not told
    middle = mesh.edges_at(x=0.02)
    creased = sheet(mesh, creases=[ms.Crease(middle, stiffness=1e-5)])
    couple = ms.EdgeCouple(mesh.edges_at(x=0.04), 5e-6)
    rest, told = solved(ms.Scene(creased, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[couple]))
    assert fraction(rest) < 0.02 and not told


def test_averages_cross_a_crease_at_its_end_only():
    mesh = ms.meshes.rectangle(0.04, 0.02, cells=(8, 4))
    middle = mesh.edges_at(x=0.02)
    half = middle[np.argsort(mesh.edge_midpoints[middle, 1])[:2]]
    body = sheet(mesh, creases=[ms.Crease(half, stiffness=1e-5)])
    assert len(np.unique(_corners(body, body))) == mesh.n_vertices + 2


def test_sheets_at_rest_and_six_node_sheets_have_no_estimate():
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(2, 1))
    rest, told = solved(ms.Scene(sheet(mesh), supports=[ms.Clamp(mesh.edges_at(x=0.0))]))
    assert unresolved(rest._values, rest._state) == [] and not told
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(2, 1), order=2)
    load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 1e-4))
    rest, told = solved(ms.Scene(sheet(mesh), supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load]))
    assert unresolved(rest._values, rest._state) == [] and not told


def test_searches_of_one_scene_are_checked_ever_more_seldom():
    """Count warnings of ten equal searches: the first, second, fourth and eighth are checked."""
    _, scene = strip(0.1, 0.01, (10, 1), (0, 1e-3, 0))
    assert sum(len(solved(scene)[1]) for _ in range(10)) == 4
